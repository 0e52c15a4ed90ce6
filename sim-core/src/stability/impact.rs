//! One impact on a one-sided contact whose force is late: how fast it leaves, and at which damping it leaves as it came.
//!
//! `m x'' = -f(t - h)`, with `f = k x + b x'` while x > 0 and 0 otherwise; a law that never pulls is 0 where that sum is
//! negative too. Before contact the mass flies freely. The law is linear while its signs stay, so that the speed of approach
//! only scales the answer.
//!
//! Method of steps, exact: where the force of h ago is a polynomial of time, so is the position, two degrees higher. Pieces end
//! at roots of x and of f, found to rounding, and each piece ends one of the next delay. Powers of `t/h` beyond the 28th are
//! left out: their coefficients fall like `(ωh)ⁿ/n!`. A contact lasts π/H delays: where that is thousands, the loop expanded to second
//! order in h stands in, with the closed form of a contact without delay.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m | reduced mass | kg |
//! | k, b | stiffness and damping of the contact | N/m, N s/m |
//! | h | delay of the force | s |
//! | e | restitution: speed of leaving over speed of approach | 1 |
//! | H | h √(k/m) | 1 |
//!
//! The damping at which e = 1 is *not* the b_lo of the two-sided loop: for a law that never pulls it is above it by 2 % at H =
//! 0.066 and by a third at H = 0.5, and from H = 0.6 there is none. Not modelled: sampling, stiffness that is not constant.
//! Source: `reference/PHYSICS.md`, correction 1.

use crate::refusal::{Refusal, not_negative, positive};
use crate::restitution::damping_ratio;
use alloc::collections::VecDeque;
use core::f64::consts::PI;

/// Powers of time that are kept.
const POWERS: usize = 29;
/// Places in a piece where signs are compared: two roots closer than a twelfth of a delay are missed together.
const PLACES: usize = 12;
/// Contacts of half a period that are waited for before a mass counts as captured.
const PERIODS_MAX: f64 = 50.0;
/// Delays that are waited for what never pulls. Above the shortest delay that is computed this is two and a half half periods, and a
/// release takes one; what creeps out later leaves with nothing.
const DELAYS_MAX: f64 = 4000.0;
/// Below this H, and this b h/m, the delay changes mass and damping, and no more: their squares are left out.
const SHORT: f64 = 2e-3;
const SHORT_DAMPING: f64 = 5e-3;
/// Steps of the searches for the damping at which e = 1, as ratios.
const STEP_UP: f64 = 1.02;
const STEP_DOWN: f64 = 0.97;
/// Roots nearer than this to an end of a piece are that end.
const END: f64 = 1e-11;

/// Whether the contact can hold the mass back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pull {
    /// The force is never negative.
    Never,
    /// The damper may pull while there is penetration.
    Allowed,
}

/// What meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneSided {
    /// Reduced mass.
    pub mass_kg: f64,
    /// Stiffness.
    pub stiffness_n_per_m: f64,
    /// Damping.
    pub damping_n_s_per_m: f64,
    /// Delay of the force.
    pub delay_s: f64,
    /// Whether it may pull.
    pub pull: Pull,
}

/// How it went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Speed of leaving over speed of approach; 0 if it does not leave.
    pub restitution: f64,
    /// From onset until the undelayed force is first zero; infinite if never.
    pub until_zero_force_s: f64,
    /// From onset until the depth is first zero; infinite if never.
    pub until_zero_depth_s: f64,
}

/// A polynomial of time since its begin, in delays.
type Polynomial = [f64; POWERS];

/// The force on a stretch of time, which drives the position one delay later.
struct Piece {
    /// In delays.
    length: f64,
    force_n: Polynomial,
}

impl OneSided {
    fn checked(&self) -> Result<(), Refusal> {
        positive("mass_kg", self.mass_kg, "kg")?;
        positive("stiffness_n_per_m", self.stiffness_n_per_m, "N/m")?;
        not_negative("damping_n_s_per_m", self.damping_n_s_per_m, "N s/m")?;
        not_negative("delay_s", self.delay_s, "s")?;
        if !self.is_told() {
            let limit = "is above 4 / (√(k/m) + b/m): longer than the contact";
            return Err(Refusal { name: "delay_s", value: self.delay_s, unit: "s", limit });
        }
        Ok(())
    }

    /// Whether the delay is short enough for an impact to be told: beyond two radians in one delay the powers that are kept do not
    /// suffice, and nothing of it is a contact any more.
    pub fn is_told(&self) -> bool {
        let rate = libm::sqrt(self.stiffness_n_per_m / self.mass_kg) + self.damping_n_s_per_m / self.mass_kg;
        self.delay_s * rate <= 4.0
    }

    /// The impact, computed.
    pub fn impact(&self) -> Result<Impact, Refusal> {
        self.checked()?;
        if self.delay_s == 0.0 {
            return Ok(self.undelayed());
        }
        Ok(if self.is_short() { self.shortly_delayed() } else { Flight::new(self).flown() })
    }

    /// Whether the delay only changes the damping.
    fn is_short(&self) -> bool {
        self.pull == Pull::Never
            && self.scaled_delay() < SHORT
            && self.damping_n_s_per_m * self.delay_s < SHORT_DAMPING * self.mass_kg
    }

    /// H.
    fn scaled_delay(&self) -> f64 {
        self.delay_s * libm::sqrt(self.stiffness_n_per_m / self.mass_kg)
    }

    /// To second order in h the loop is `(m - b h + k h²/2) s² + (b - k h) s + k`, which starts at m over that mass, since the damper of
    /// the first delay is missing; both are let go where the acceleration ends.
    fn shortly_delayed(&self) -> Impact {
        let (m, k, b, h) = (self.mass_kg, self.stiffness_n_per_m, self.damping_n_s_per_m, self.delay_s);
        let mass_kg = m - b * h + 0.5 * k * h * h;
        let found = OneSided { mass_kg, damping_n_s_per_m: b - k * h, delay_s: 0.0, ..*self }.undelayed();
        let until_zero_force_s = found.until_zero_force_s - h;
        Impact { restitution: found.restitution * m / mass_kg, until_zero_force_s, ..found }
    }

    /// The closed form: `x = e^{-ζτ} sin(wτ)/w` in units of 1/ω₀, with w = √|1 - ζ²| and sinh for sin where ζ > 1.
    fn undelayed(&self) -> Impact {
        let (m, k) = (self.mass_kg, self.stiffness_n_per_m);
        let frequency = libm::sqrt(k / m);
        let ratio = damping_ratio(m, k, self.damping_n_s_per_m);
        let w = libm::sqrt((1.0 - ratio * ratio).abs());
        // Where x + 2 ζ x' = 0; at ζ = 1 both forms tend to 2.
        let scaled_s = if w < 1e-9 {
            2.0
        } else if ratio < 1.0 {
            (PI - libm::atan2(2.0 * ratio * w, w * w - ratio * ratio)) / w
        } else {
            2.0 * libm::log(ratio + w) / w
        };
        let until_zero_depth_s = if ratio < 1.0 && w > 0.0 { PI / (frequency * w) } else { f64::INFINITY };
        let held_s = match self.pull {
            Pull::Never => scaled_s,
            Pull::Allowed => until_zero_depth_s * frequency,
        };
        // At both releases the speed is e^{-ζτ}; a damper that pulls for ever lets nothing go.
        let restitution = if held_s.is_finite() { libm::exp(-ratio * held_s) } else { 0.0 };
        // What never pulls leaves at its speed of release, in a straight line.
        let drift_s = match self.pull {
            Pull::Never => scaled_s / frequency + 2.0 * ratio / frequency,
            Pull::Allowed => until_zero_depth_s,
        };
        Impact { restitution, until_zero_force_s: scaled_s / frequency, until_zero_depth_s: drift_s }
    }

    /// The least damping at which it leaves as fast as it came, with all else as it is; `None` if none does.
    ///
    /// Dampings are tried in steps of 2 %, so that an interval narrower than that is missed.
    pub fn unit_restitution_damping(&self) -> Result<Option<f64>, Refusal> {
        self.checked()?;
        let (k, h) = (self.stiffness_n_per_m, self.delay_s);
        if h == 0.0 {
            return Ok(Some(0.0));
        }
        // Where the mass that starts faster and the damping that is left outweigh each other.
        if self.pull == Pull::Never && self.scaled_delay() < SHORT {
            return Ok(Some(k * h * (1.0 + self.scaled_delay() / PI)));
        }
        // The edge lies at the linear one, about k h, and up to a third above it: ten times as far there is none.
        let most = self.most_damping().min(10.0 * k * h);
        let (mut gains, mut loses) = (0.0, 0.2 * k * h);
        while self.gains(loses)? {
            (gains, loses) = (loses, loses * STEP_UP);
            if loses > most {
                return Ok(None);
            }
        }
        for _ in 0..60 {
            let middle = 0.5 * (gains + loses);
            if self.gains(middle)? { gains = middle } else { loses = middle }
        }
        Ok(Some(0.5 * (gains + loses)))
    }

    /// The damping above which it leaves faster than it came again: too much of what is late throws it back. `None` if there is no
    /// damping at which it leaves slower, or none above at which it does not.
    ///
    /// The search comes from above, where the mass is thrown back within some delays, in steps of 3 %.
    pub fn unit_restitution_damping_above(&self) -> Result<Option<f64>, Refusal> {
        let Some(low) = self.unit_restitution_damping()? else { return Ok(None) };
        if self.delay_s == 0.0 {
            return Ok(None);
        }
        // A little inside, so that rounding does not make this damping too much to be told.
        let mut gains = self.most_damping() * (1.0 - 1e-9);
        if gains <= low || !self.gains(gains)? {
            return Ok(None);
        }
        let mut loses = gains * STEP_DOWN;
        while self.gains(loses)? {
            (gains, loses) = (loses, loses * STEP_DOWN);
            if loses <= low {
                return Ok(None);
            }
        }
        for _ in 0..60 {
            let middle = 0.5 * (gains + loses);
            if self.gains(middle)? { gains = middle } else { loses = middle }
        }
        Ok(Some(0.5 * (gains + loses)))
    }

    /// The most damping with which an impact can be told.
    fn most_damping(&self) -> f64 {
        (4.0 / self.delay_s - libm::sqrt(self.stiffness_n_per_m / self.mass_kg)) * self.mass_kg
    }

    /// Whether it leaves faster than it came with this damping.
    fn gains(&self, damping_n_s_per_m: f64) -> Result<bool, Refusal> {
        Ok(OneSided { damping_n_s_per_m, ..*self }.impact()?.restitution > 1.0)
    }
}

/// A mass on its way, with an approach at 1 m/s.
struct Flight<'a> {
    contact: &'a OneSided,
    position_m: f64,
    speed_m_per_s: f64,
    /// In delays since onset.
    now: f64,
    /// Forces of the last delay, oldest first.
    late: VecDeque<Piece>,
    zero_force: f64,
    zero_depth: f64,
}

impl<'a> Flight<'a> {
    fn new(contact: &'a OneSided) -> Self {
        let late = VecDeque::from([Piece { length: 1.0, force_n: [0.0; POWERS] }]);
        Flight {
            contact,
            position_m: 0.0,
            speed_m_per_s: 1.0,
            now: 0.0,
            late,
            zero_force: f64::INFINITY,
            zero_depth: f64::INFINITY,
        }
    }

    fn flown(mut self) -> Impact {
        let h = self.contact.delay_s;
        let patience = PERIODS_MAX * PI / self.contact.scaled_delay();
        let patience = if self.contact.pull == Pull::Never { patience.min(DELAYS_MAX) } else { patience };
        let mut restitution = 0.0;
        while self.now < patience {
            let quiet = self.late.iter().all(|piece| piece.force_n.iter().all(|&power| power == 0.0));
            if quiet && self.speed_m_per_s < 0.0 && (self.position_m <= 0.0 || self.is_let_go()) {
                restitution = -self.speed_m_per_s;
                if self.position_m > 0.0 {
                    self.zero_depth = self.zero_depth.min(self.now + self.position_m / restitution / h);
                }
                break;
            }
            let Some(piece) = self.late.pop_front() else { break };
            self.step(&piece);
        }
        Impact { restitution, until_zero_force_s: self.zero_force * h, until_zero_depth_s: self.zero_depth * h }
    }

    /// Whether what never pulls cannot push any more: on a straight way out its sum of spring and damper only falls.
    fn is_let_go(&self) -> bool {
        let OneSided { stiffness_n_per_m, damping_n_s_per_m, pull, .. } = *self.contact;
        pull == Pull::Never && stiffness_n_per_m * self.position_m + damping_n_s_per_m * self.speed_m_per_s <= 0.0
    }

    /// Moves on under a force of one delay ago, and remembers the force that this motion makes.
    fn step(&mut self, piece: &Piece) {
        let OneSided { mass_kg, stiffness_n_per_m, damping_n_s_per_m, delay_s, .. } = *self.contact;
        let mut position: Polynomial = [0.0; POWERS];
        (position[0], position[1]) = (self.position_m, self.speed_m_per_s * delay_s);
        let share = -delay_s * delay_s / mass_kg;
        for (power, force_n) in (2..POWERS).zip(piece.force_n) {
            position[power] = share * force_n / (power * (power - 1)) as f64;
        }
        let speed = slope(&position);
        let mut law: Polynomial = [0.0; POWERS];
        for power in 0..POWERS {
            law[power] = stiffness_n_per_m * position[power] + damping_n_s_per_m / delay_s * speed[power];
        }
        let mut begin = 0.0;
        while begin < piece.length {
            let depth_ends = next_root(&position, begin, piece.length);
            let force_ends = next_root(&law, begin, piece.length);
            let end = depth_ends.min(force_ends).min(piece.length);
            let middle = 0.5 * (begin + end);
            let (depth_m, force_n) = (value(&position, middle), value(&law, middle));
            let pushes = depth_m > 0.0 && (force_n > 0.0 || self.contact.pull == Pull::Allowed);
            let force_n_of = if pushes { shifted(&law, begin) } else { [0.0; POWERS] };
            self.late.push_back(Piece { length: end - begin, force_n: force_n_of });
            if end < piece.length && depth_m > 0.0 {
                let at = self.now + end;
                if force_ends <= end && force_n > 0.0 {
                    self.zero_force = self.zero_force.min(at);
                }
                if depth_ends <= end {
                    self.zero_depth = self.zero_depth.min(at);
                }
            }
            begin = end;
        }
        self.position_m = value(&position, piece.length);
        self.speed_m_per_s = value(&speed, piece.length) / delay_s;
        self.now += piece.length;
    }
}

fn value(polynomial: &Polynomial, at: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, power| sum * at + power)
}

fn slope(polynomial: &Polynomial) -> Polynomial {
    let mut slope = [0.0; POWERS];
    for power in 1..POWERS {
        slope[power - 1] = power as f64 * polynomial[power];
    }
    slope
}

/// The same polynomial of the time since `at`.
fn shifted(polynomial: &Polynomial, at: f64) -> Polynomial {
    let mut out = *polynomial;
    if at != 0.0 {
        for first in 0..POWERS {
            for power in (first..POWERS - 1).rev() {
                out[power] += at * out[power + 1];
            }
        }
    }
    out
}

/// The first change of sign after `begin`, or infinity if there is none before `length`.
fn next_root(polynomial: &Polynomial, begin: f64, length: f64) -> f64 {
    let place = |i: usize| begin + END + (length - begin - 2.0 * END) * i as f64 / PLACES as f64;
    if length - begin <= 4.0 * END {
        return f64::INFINITY;
    }
    let above = value(polynomial, place(0)) > 0.0;
    let Some(first) = (1..=PLACES).find(|&i| (value(polynomial, place(i)) > 0.0) != above) else {
        return f64::INFINITY;
    };
    let (mut before, mut after) = (place(first - 1), place(first));
    for _ in 0..52 {
        let middle = 0.5 * (before + after);
        if (value(polynomial, middle) > 0.0) == above { before = middle } else { after = middle }
    }
    after
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::exact::damping_interval;

    /// Damping of e = 1 over b_lo, at unit mass and stiffness.
    fn ratio(scaled_delay: f64, pull: Pull) -> Option<f64> {
        let contact =
            OneSided { mass_kg: 1.0, stiffness_n_per_m: 1.0, damping_n_s_per_m: 0.0, delay_s: scaled_delay, pull };
        let low = damping_interval(1.0, 1.0, scaled_delay).unwrap().unwrap().low_n_s_per_m;
        contact.unit_restitution_damping().unwrap().map(|damping| damping / low)
    }

    #[test]
    fn the_edge_of_an_impact_lies_above_that_of_the_loop() {
        // Half a unit in the last digit of `reference/PHYSICS.md`, correction 1.
        for (scaled_delay, expected, digit) in
            [(0.066, 1.022, 5e-4), (0.13, 1.046, 6e-4), (0.4, 1.20, 5e-3), (0.5, 1.33, 5e-3)]
        {
            let found = ratio(scaled_delay, Pull::Never).unwrap();
            assert!((found - expected).abs() < digit, "{scaled_delay}: {found}");
        }
        for scaled_delay in [0.6, 0.65, 0.7] {
            assert_eq!(ratio(scaled_delay, Pull::Never), None);
        }
        assert!((ratio(0.066, Pull::Allowed).unwrap() - 1.000).abs() < 5e-4);
        assert!((ratio(0.7, Pull::Allowed).unwrap() - 0.89).abs() < 5e-3);
    }

    #[test]
    fn a_short_delay_tends_to_none() {
        for (pull, damping_n_s_per_m) in [(Pull::Never, 40.0), (Pull::Allowed, 40.0), (Pull::Never, 700.0)] {
            let now = OneSided { mass_kg: 15.6, stiffness_n_per_m: 3000.0, damping_n_s_per_m, delay_s: 0.0, pull };
            let at = |delay_s: f64| OneSided { delay_s, ..now }.impact().unwrap().restitution;
            let (none, short, shorter) = (at(0.0), at(2e-4), at(1e-4));
            // First order in the delay: half the delay, half the difference.
            assert!(((short - none) / (shorter - none) - 2.0).abs() < 0.05, "{none} {shorter} {short}");
        }
    }

    #[test]
    fn too_much_damping_throws_it_back() {
        let contact = OneSided {
            mass_kg: 60.0,
            stiffness_n_per_m: 1000.0,
            damping_n_s_per_m: 0.0,
            delay_s: 0.016,
            pull: Pull::Never,
        };
        let low = contact.unit_restitution_damping().unwrap().unwrap();
        let high = contact.unit_restitution_damping_above().unwrap().unwrap();
        let at = |damping_n_s_per_m: f64| OneSided { damping_n_s_per_m, ..contact }.impact().unwrap().restitution;
        assert!(at(low * 0.999) > 1.0 && at(low * 1.001) < 1.0 && low < 17.0, "{low}");
        assert!(at(high * 0.999) < 1.0 && at(high * 1.001) > 1.0 && high > 5000.0, "{high}");
        // Where no damping loses energy there is no upper end either.
        let long = OneSided { delay_s: 0.16, ..contact };
        assert_eq!(long.unit_restitution_damping_above(), Ok(None));
    }

    /// Where the expansion ends both ways meet: what it leaves out is the squares of H and of b h/m.
    #[test]
    fn a_very_short_delay_changes_mass_and_damping() {
        let contact = |damping_n_s_per_m: f64, delay_s: f64| OneSided {
            mass_kg: 1.0,
            stiffness_n_per_m: 1.0,
            damping_n_s_per_m,
            delay_s,
            pull: Pull::Never,
        };
        for damping in [0.0, 1e-3, 0.5, 2.0] {
            let short = contact(damping, SHORT * 0.999).impact().unwrap();
            let long = contact(damping, SHORT * 1.001).impact().unwrap();
            // The difference of the delays itself is 4e-6.
            let close = |a: f64, b: f64| (a - b).abs() < 1e-5 + 4.0 * (SHORT * SHORT + square(damping * SHORT));
            assert!(close(short.restitution, long.restitution), "{damping}: {short:?} {long:?}");
            assert!(close(short.until_zero_force_s, long.until_zero_force_s), "{damping}: {short:?} {long:?}");
            assert!(close(short.until_zero_depth_s, long.until_zero_depth_s), "{damping}: {short:?} {long:?}");
        }
        let edge = |delay_s: f64| contact(0.0, delay_s).unit_restitution_damping().unwrap().unwrap() / delay_s;
        let (short, long) = (edge(SHORT * 0.999), edge(SHORT * 1.001));
        assert!((short - long).abs() < 10.0 * SHORT * SHORT, "{short} {long}");
        let high = |delay_s: f64| contact(0.0, delay_s).unit_restitution_damping_above().unwrap().unwrap() * delay_s;
        // At these delays the spring plays no part in being thrown back.
        assert!((high(1e-6) / high(1e-4) - 1.0).abs() < 1e-3, "{} {}", high(1e-6), high(1e-4));
    }

    fn square(value: f64) -> f64 {
        value * value
    }

    #[test]
    fn a_damper_that_pulls_holds_what_is_overdamped() {
        let contact =
            |pull| OneSided { mass_kg: 1.0, stiffness_n_per_m: 1.0, damping_n_s_per_m: 3.0, delay_s: 0.0, pull };
        assert!(contact(Pull::Allowed).impact().unwrap().restitution < f64::MIN_POSITIVE);
        assert!(contact(Pull::Never).impact().unwrap().restitution > 0.0);
        let late = OneSided { delay_s: 0.01, ..contact(Pull::Allowed) }.impact().unwrap();
        assert!(late.restitution < 1e-3 && late.until_zero_depth_s > 10.0, "{late:?}");
    }

    #[test]
    fn input_without_meaning_is_refused() {
        let base =
            OneSided { mass_kg: 1.0, stiffness_n_per_m: 1.0, damping_n_s_per_m: 0.1, delay_s: 0.1, pull: Pull::Never };
        assert!(base.impact().is_ok());
        assert!(OneSided { mass_kg: 0.0, ..base }.impact().is_err());
        assert!(OneSided { delay_s: -0.1, ..base }.impact().is_err());
        assert!(OneSided { delay_s: 10.0, ..base }.impact().is_err());
        assert!(OneSided { damping_n_s_per_m: f64::NAN, ..base }.impact().is_err());
    }
}
