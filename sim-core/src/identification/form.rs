//! A lag, a dead time, or both: which one the data ask for.
//!
//! Each form is fitted by itself. The one with the least `N ln(S/N) + p ln N` (the criterion of Schwarz) is best; a simpler form
//! within [`DECISIVE`] of it is kept instead. Both together are kept only if, besides, the dead time is more than
//! [`DEVIATIONS_MIN`] of its standard deviations.

/// A difference in the criterion of Schwarz that decides. Chosen: odds of e⁵, about 150 to 1.
pub const DECISIVE: f64 = 10.0;
/// How many standard deviations a dead time beside a lag must have.
pub const DEVIATIONS_MIN: f64 = 4.0;

/// A dead time is determined, however short, when its standard deviation is at most this. Chosen: a quarter of a period of a loop at
/// 250 Hz.
pub const DEAD_DEVIATION_MAX_S: f64 = 1e-3;

/// Whether a positive number is determined: its distance from 0 is [`DEVIATIONS_MIN`] standard deviations, so that it is known to
/// 25 %. A standard deviation without end is none that determines.
fn is_known((value, deviation): (f64, f64)) -> bool {
    value.is_finite() && value >= DEVIATIONS_MIN * deviation
}

/// A lag of second order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    /// Natural frequency of the undamped axis, in Hz.
    pub natural_frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

impl Lag {
    /// Delay at low frequency, 2 ζ / ωₙ.
    pub fn delay_s(&self) -> f64 {
        2.0 * self.damping_ratio / (2.0 * core::f64::consts::PI * self.natural_frequency_hz)
    }
}

/// What lies between command and pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A lag of second order alone.
    Lag,
    /// A dead time alone.
    DeadTime,
    /// Both, fitted together.
    Both,
}

/// One fitted form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// Which form.
    pub form: Form,
    /// The lag, and one standard deviation of each of its numbers; `None` for a dead time alone.
    pub lag: Option<(Lag, Lag)>,
    /// Dead time, and its standard deviation; 0 for a lag alone.
    pub dead_time_s: (f64, f64),
    /// Pose over command at rest.
    pub gain: f64,
    /// Root of the mean squared residual, in the unit of the data.
    pub residual_rms: f64,
    /// The criterion of Schwarz; only differences count.
    pub criterion: f64,
}

impl Way {
    /// Whether the data determine the numbers of this form, and those are physical: nothing comes before its command.
    pub fn is_determined(&self) -> bool {
        let lag = self.lag.is_none_or(|(lag, deviation)| {
            is_known((lag.natural_frequency_hz, deviation.natural_frequency_hz))
                && is_known((lag.damping_ratio, deviation.damping_ratio))
        });
        let (dead_s, deviation_s) = self.dead_time_s;
        // Below 0 within its scatter is 0.
        let is_physical = dead_s >= -DEVIATIONS_MIN * deviation_s;
        lag && is_physical && (is_known(self.dead_time_s) || deviation_s <= DEAD_DEVIATION_MAX_S)
    }

    /// Delay at low frequency, of lag and dead time together.
    pub fn equivalent_delay_s(&self) -> f64 {
        self.dead_time_s.0 + self.lag.map_or(0.0, |(lag, _)| lag.delay_s())
    }
}

/// The criterion of Schwarz.
pub fn criterion(squares: f64, readings: usize, numbers: usize) -> f64 {
    let count = readings as f64;
    // A fit to rounding has no scatter; the least positive number keeps the logarithm finite.
    count * libm::log(squares.max(f64::MIN_POSITIVE) / count) + numbers as f64 * libm::log(count)
}

/// The forms that could be fitted, and the one that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Every form that could be fitted.
    pub ways: alloc::vec::Vec<Way>,
    /// Which of them was chosen.
    pub chosen: usize,
}

impl Choice {
    /// Chooses; `None` if there is nothing to choose from.
    pub fn of(ways: alloc::vec::Vec<Way>) -> Option<Choice> {
        let allowed = |way: &Way| way.form != Form::Both || way.dead_time_s.0 > DEVIATIONS_MIN * way.dead_time_s.1;
        let best = ways.iter().filter(|way| allowed(way)).map(|way| way.criterion).fold(f64::INFINITY, f64::min);
        let near = |way: &&(usize, &Way)| allowed(way.1) && way.1.criterion <= best + DECISIVE;
        // Of one number each the dead time comes first, then the lag, then both; of equally simple ones the better.
        let simple = |way: &Way| match way.form {
            Form::DeadTime => 0,
            Form::Lag => 1,
            Form::Both => 2,
        };
        let chosen = ways.iter().enumerate().filter(|way| near(&way)).min_by_key(|(_, way)| simple(way))?.0;
        Some(Choice { ways, chosen })
    }

    /// Whether the numbers of the chosen way are determined and the other simple form, fitted too, is out of the question.
    pub fn is_decided(&self) -> bool {
        let way = self.way();
        let is_rival = |other: &&Way| other.form != way.form && other.form != Form::Both;
        let mut rivals = self.ways.iter().filter(is_rival).peekable();
        // What could not be fitted was not refused by the data.
        let is_alone = rivals.peek().is_some() && rivals.all(|other| other.criterion - way.criterion > DECISIVE);
        is_alone && way.is_determined()
    }

    /// Delay at low frequency and its standard deviation, where the form is open: slow motion shows the sum of dead time and lag, and
    /// a dead time alone stands for it. `None` if the data do not determine it, or refuse a dead time.
    pub fn delay_of_either_s(&self) -> Option<(f64, f64)> {
        let dead = self.ways.iter().find(|way| way.form == Form::DeadTime)?;
        let is_near = dead.criterion - self.way().criterion <= DECISIVE;
        (is_near && dead.is_determined()).then_some(dead.dead_time_s)
    }

    /// The chosen way.
    pub fn way(&self) -> &Way {
        &self.ways[self.chosen]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lag(sd_hz: f64, sd_damping: f64, dead_time_s: (f64, f64)) -> Way {
        let own = Lag { natural_frequency_hz: 8.0, damping_ratio: 0.4 };
        let deviation = Lag { natural_frequency_hz: sd_hz, damping_ratio: sd_damping };
        let form = if dead_time_s.1 > 0.0 { Form::Both } else { Form::Lag };
        Way { form, lag: Some((own, deviation)), dead_time_s, gain: 1.0, residual_rms: 1e-5, criterion: 0.0 }
    }

    fn dead(dead_time_s: (f64, f64), criterion: f64) -> Way {
        Way { form: Form::DeadTime, lag: None, dead_time_s, gain: 1.0, residual_rms: 1e-5, criterion }
    }

    #[test]
    fn a_number_within_four_of_its_deviations_of_zero_is_not_determined() {
        assert!(lag(2.0, 0.1, (0.0, 0.0)).is_determined());
        assert!(!lag(2.01, 0.1, (0.0, 0.0)).is_determined() && !lag(2.0, 0.11, (0.0, 0.0)).is_determined());
        assert!(!lag(f64::INFINITY, 0.1, (0.0, 0.0)).is_determined());
        assert!(!lag(0.1, 0.01, (-5.29e-3, 1.2e-3)).is_determined(), "before its command");
        assert!(dead((0.0, 1e-4), 0.0).is_determined() && dead((0.03, 5e-3), 0.0).is_determined());
        assert!(!dead((0.03, 0.02), 0.0).is_determined() && !dead((0.15, f64::INFINITY), 0.0).is_determined());
    }

    #[test]
    fn a_form_without_a_rival_that_the_data_refuse_is_not_decided() {
        let own = lag(0.1, 0.01, (0.0, 0.0));
        let decided = |ways: &[Way]| Choice::of(ways.to_vec()).unwrap().is_decided();
        assert!(decided(&[own, dead((0.03, 1e-4), 50.0)]));
        assert!(!decided(&[own]) && !decided(&[own, dead((0.03, 1e-4), 5.0)]));
        let open = Choice::of(alloc::vec![own, dead((0.03, 1e-4), 5.0)]).unwrap();
        assert_eq!(open.delay_of_either_s(), Some((0.03, 1e-4)));
        let refused = Choice::of(alloc::vec![own, dead((0.03, 1e-4), 50.0)]).unwrap();
        assert_eq!(refused.delay_of_either_s(), None);
    }
}
