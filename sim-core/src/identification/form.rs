//! A lag, a dead time, or both: which one the data ask for.
//!
//! Each form is fitted by itself. The one with the least `N ln(S/N) + p ln N` (the criterion of Schwarz) is best; a simpler form
//! within [`DECISIVE`] of it is kept instead. Both together are kept only if, besides, the dead time is more than
//! [`DEVIATIONS_MIN`] of its standard deviations.

/// A difference in the criterion of Schwarz that decides. Chosen: odds of e⁵, about 150 to 1.
pub const DECISIVE: f64 = 10.0;
/// How many standard deviations a dead time beside a lag must have.
pub const DEVIATIONS_MIN: f64 = 4.0;

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

    /// The chosen way.
    pub fn way(&self) -> &Way {
        &self.ways[self.chosen]
    }
}
