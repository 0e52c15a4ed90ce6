//! The loop as the computers run it: forces sampled, commands held, one step of the satellites for each tick.
//!
//! One tick maps the state (past positions, speed, robot, filter, read-back poses, force samples) linearly onto itself. The
//! loop is stable where every eigenvalue of that map, the monodromy matrix, is inside the unit circle: exact, no averaging.
//!
//! At tick n the F/T reading and the read-back pose are taken, the force follows, and position and speed x, v step to n + 1:
//! semi-implicit `v += a T, x += v T`; exact hold `x += v T + a T²/2, v += a T`; explicit `x += v T, v += a T`. The conventions
//! are parameters, since each is worth up to a tick of delay, and a tick is k T of damping:
//!
//! | parameter | choices, and what they cost on the stiffness path |
//! |---|---|
//! | `Issue` | when x_{n+1} leaves: as it is computed at t_n (0); at t_{n+1} before that tick's reading (0); after it (T); a tick late (2 T) |
//! | `PointIntegrator` | semi-implicit 0, exact hold T/2, explicit T |
//! | `Arrival` | a jump; a line that starts when the command arrives; a line that ends then |
//! | sensor | newest sample or mean of some, their age, low pass |
//! | stiffness, damping | in hardware at the achieved pose; virtual on the measured or the commanded pose and rate |
//!
//! A reading at the very instant of a jump sees the pose before it, except with `Issue::BeforeReading`.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m | reduced mass | kg |
//! | T | tick of the loop | s |
//! | k, b | stiffness, damping | N/m, N s/m |
//!
//! Not modelled: contact that opens, noise, jitter, saturation. Source: `reference/PHYSICS.md`, section 2.2.

use super::eigen::spectral_radius;
use super::sampled_tick::Tick;
use crate::plant::PointIntegrator;
use crate::refusal::{Refusal, finite, not_negative, positive};

/// When the command for tick n + 1, computed at tick n, leaves for the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Issue {
    /// As soon as it is computed, at t_n: one tick early.
    AsComputed,
    /// At t_{n+1}, before that tick's reading and step.
    BeforeReading,
    /// At t_{n+1}, after that tick's reading: it is valid when it leaves.
    WhenValid,
    /// At t_{n+2}, after that tick's reading.
    OneTickLate,
}

/// What the robot makes of commands that arrive a tick apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// It jumps when one arrives.
    Hold,
    /// It starts a straight line when one arrives, and is there a tick later.
    LineFrom,
    /// It is there when one arrives, on a straight line from the one before.
    LineTo,
}

/// Which pose or rate a virtual force is made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// The pose that the robot reports, its rate by backward difference over a tick.
    Measured,
    /// The satellites' own.
    Commanded,
}

/// A robot or a filter: `ω² / (s² + 2 ζ ω s + ω²)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder {
    /// ω / 2π.
    pub natural_frequency_hz: f64,
    /// ζ.
    pub damping_ratio: f64,
}

/// How the force is felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensing {
    /// Samples in a tick of the loop.
    pub samples_per_tick: usize,
    /// The newest this many are averaged.
    pub averaged: usize,
    /// Age of the newest sample when it is used: transport and the phase between the clocks.
    pub age_s: f64,
    /// Low pass before sampling.
    pub low_pass: Option<SecondOrder>,
}

/// The loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLoop {
    /// Reduced mass.
    pub mass_kg: f64,
    /// Stiffness that the sensor feels.
    pub hardware_stiffness_n_per_m: f64,
    /// Damping that the sensor feels; not with `Arrival::Hold` and no robot, whose jumps have no rate.
    pub hardware_damping_n_s_per_m: f64,
    /// Stiffness that the software adds.
    pub virtual_stiffness_n_per_m: f64,
    /// Damping that the software adds.
    pub virtual_damping_n_s_per_m: f64,
    /// Damping on the satellites' own speed, whatever `damping_on` says: a compensation's.
    pub own_damping_n_s_per_m: f64,
    /// Pose of the virtual spring.
    pub stiffness_on: Seen,
    /// Rate of the virtual damper.
    pub damping_on: Seen,
    /// Tick of the loop.
    pub tick_s: f64,
    /// From a command's leaving to its arrival.
    pub dead_time_s: f64,
    /// From the achieved pose to the measured one.
    pub readout_s: f64,
    /// When commands leave.
    pub issue: Issue,
    /// What the robot makes of them.
    pub arrival: Arrival,
    /// Dynamics of the robot behind that.
    pub robot: Option<SecondOrder>,
    /// The force sensor.
    pub sensing: Sensing,
    /// How the satellites step.
    pub integrator: PointIntegrator,
}

/// The damping that stabilises, both ends excluded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledInterval {
    /// Below it the loop grows; 0 if it decays without virtual damping.
    pub low_n_s_per_m: f64,
    /// Above it the loop grows.
    pub high_n_s_per_m: f64,
}

/// Ratio of the dampings that are tried in the search for the interval: an interval narrower than this is missed.
const SEARCH_RATIO: f64 = 1.1;
/// A radius this near to 1 neither grows nor decays: rounding of an eigenvalue of a matrix of some 30 rows.
const NEUTRAL: f64 = 1e-12;

impl SampledLoop {
    /// A loop at 4 ms with one stiffness in hardware, 16 ms there and 16 ms back, the newest sample of 1 kHz, and the damping
    /// virtual on the measured rate.
    pub fn facility(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> SampledLoop {
        SampledLoop {
            mass_kg,
            hardware_stiffness_n_per_m: stiffness_n_per_m,
            hardware_damping_n_s_per_m: 0.0,
            virtual_stiffness_n_per_m: 0.0,
            virtual_damping_n_s_per_m: damping_n_s_per_m,
            own_damping_n_s_per_m: 0.0,
            stiffness_on: Seen::Measured,
            damping_on: Seen::Measured,
            tick_s: 0.004,
            dead_time_s: 0.016,
            readout_s: 0.016,
            issue: Issue::WhenValid,
            arrival: Arrival::Hold,
            robot: None,
            sensing: Sensing { samples_per_tick: 4, averaged: 1, age_s: 0.0, low_pass: None },
            integrator: PointIntegrator::SemiImplicit,
        }
    }

    /// Refuses what has no meaning.
    pub fn checked(&self) -> Result<(), Refusal> {
        positive("mass_kg", self.mass_kg, "kg")?;
        finite("hardware_stiffness_n_per_m", self.hardware_stiffness_n_per_m, "N/m")?;
        finite("hardware_damping_n_s_per_m", self.hardware_damping_n_s_per_m, "N s/m")?;
        finite("virtual_stiffness_n_per_m", self.virtual_stiffness_n_per_m, "N/m")?;
        finite("virtual_damping_n_s_per_m", self.virtual_damping_n_s_per_m, "N s/m")?;
        finite("own_damping_n_s_per_m", self.own_damping_n_s_per_m, "N s/m")?;
        positive("tick_s", self.tick_s, "s")?;
        for (name, delay_s) in [("dead_time_s", self.dead_time_s), ("readout_s", self.readout_s)] {
            self.in_ticks(name, delay_s)?;
        }
        self.in_ticks("age_s", self.sensing.age_s)?;
        for (name, count) in [("samples_per_tick", self.sensing.samples_per_tick), ("averaged", self.sensing.averaged)]
        {
            if !(1..=64).contains(&count) {
                return Err(Refusal { name, value: count as f64, unit: "samples", limit: "is not in 1 to 64" });
            }
        }
        for second_order in [self.robot, self.sensing.low_pass].into_iter().flatten() {
            positive("natural_frequency_hz", second_order.natural_frequency_hz, "Hz")?;
            not_negative("damping_ratio", second_order.damping_ratio, "of critical")?;
        }
        if self.arrival == Arrival::LineTo && self.dead_time_s < self.tick_s {
            let limit = "is shorter than the line to the command, which has to be known when it starts";
            return Err(Refusal { name: "dead_time_s", value: self.dead_time_s, unit: "s", limit });
        }
        if self.arrival == Arrival::Hold && self.robot.is_none() && self.hardware_damping_n_s_per_m != 0.0 {
            let (value, limit) = (self.hardware_damping_n_s_per_m, "meets a pose that jumps and has no rate");
            return Err(Refusal { name: "hardware_damping_n_s_per_m", value, unit: "N s/m", limit });
        }
        Ok(())
    }

    fn in_ticks(&self, name: &'static str, delay_s: f64) -> Result<(), Refusal> {
        not_negative(name, delay_s, "s")?;
        if delay_s > 100.0 * self.tick_s {
            return Err(Refusal { name, value: delay_s, unit: "s", limit: "is above 100 ticks" });
        }
        Ok(())
    }

    /// By what the slowest motion grows in a tick: the spectral radius of the monodromy matrix.
    pub fn growth_per_tick(&self) -> Result<f64, Refusal> {
        self.checked()?;
        Tick::new(self).growth(self)
    }

    /// Whether every motion decays.
    pub fn stable(&self) -> Result<bool, Refusal> {
        Ok(self.growth_per_tick()? < 1.0 - NEUTRAL)
    }

    /// The interval of virtual damping that stabilises, with all else as it is; `None` if none does.
    pub fn damping_interval(&self) -> Result<Option<SampledInterval>, Refusal> {
        self.checked()?;
        let tick = Tick::new(self);
        self.interval(|damping| {
            let tried = SampledLoop { virtual_damping_n_s_per_m: damping, ..*self };
            Ok(tick.growth(&tried)? < 1.0 - NEUTRAL)
        })
    }

    /// The same for the damping that the sensor feels.
    pub fn hardware_damping_interval(&self) -> Result<Option<SampledInterval>, Refusal> {
        self.checked()?;
        self.interval(|damping| SampledLoop { hardware_damping_n_s_per_m: damping, ..*self }.stable())
    }

    fn interval(&self, stable: impl Fn(f64) -> Result<bool, Refusal>) -> Result<Option<SampledInterval>, Refusal> {
        // No damping beyond 2 m/T can be stable: it turns the speed round within one tick.
        let most = 2.0 * self.mass_kg / self.tick_s;
        let (mut below, mut tried) = (0.0, 1e-6 * most);
        if !stable(0.0)? {
            while !stable(tried)? {
                if tried > most {
                    return Ok(None);
                }
                (below, tried) = (tried, tried * SEARCH_RATIO);
            }
        }
        let low_n_s_per_m = if stable(0.0)? { 0.0 } else { edge(below, tried, |damping| Ok(!stable(damping)?))? };
        while stable(tried)? {
            (below, tried) = (tried, tried * SEARCH_RATIO);
        }
        Ok(Some(SampledInterval { low_n_s_per_m, high_n_s_per_m: edge(below, tried, &stable)? }))
    }
}

/// The edge between `from`, where it holds, and `to`, where it does not.
fn edge(from: f64, to: f64, holds: impl Fn(f64) -> Result<bool, Refusal>) -> Result<f64, Refusal> {
    let (mut from, mut to) = (from, to);
    // Beyond 40 halvings the eigenvalue's own rounding decides.
    for _ in 0..40 {
        let middle = 0.5 * (from + to);
        if holds(middle)? { from = middle } else { to = middle }
    }
    Ok(0.5 * (from + to))
}

impl Tick {
    fn growth(&self, sampled: &SampledLoop) -> Result<f64, Refusal> {
        let matrix = self.monodromy(sampled);
        let (name, value) = ("states of the loop", matrix.nrows() as f64);
        spectral_radius(matrix).ok_or(Refusal {
            name,
            value,
            unit: "rows",
            limit: "give a matrix whose eigenvalues cannot be told",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::exact::damping_interval;

    fn lowest(sampled: &SampledLoop) -> f64 {
        sampled.damping_interval().unwrap().unwrap().low_n_s_per_m
    }

    #[test]
    fn a_fast_tick_is_the_continuous_loop() {
        let exact = damping_interval(63.2, 1066.0, 0.016).unwrap().unwrap().low_n_s_per_m;
        let at = |tick_s: f64| {
            let loop_at = SampledLoop { tick_s, readout_s: 0.0, ..SampledLoop::facility(63.2, 1066.0, 0.0) };
            lowest(&loop_at) - exact
        };
        // One tick of issue, and half a tick by the backward difference in second order: k T in all, first order in T.
        let (coarse, fine) = (at(0.002), at(0.001));
        assert!((coarse / 2.132 - 1.0).abs() < 0.03 && (fine / 1.066 - 1.0).abs() < 0.03, "{coarse} {fine}");
    }

    #[test]
    fn a_robot_that_is_very_fast_is_none() {
        let base = SampledLoop { arrival: Arrival::LineFrom, ..SampledLoop::facility(63.2, 1066.0, 0.0) };
        let fast = SecondOrder { natural_frequency_hz: 2000.0, damping_ratio: 0.7 };
        // Its delay is 2 ζ / ω = 0.11 ms, worth 0.12 N s/m.
        let with = lowest(&SampledLoop { robot: Some(fast), ..base }) - lowest(&base);
        assert!((with - 1066.0 * 1.4 / (2.0 * core::f64::consts::PI * 2000.0)).abs() < 5e-3, "{with}");
    }

    #[test]
    fn delay_before_and_behind_the_sensor_is_the_same() {
        // A millisecond of age on a line is a millisecond of dead time, except for the rate's path.
        let base = SampledLoop {
            arrival: Arrival::LineTo,
            damping_on: Seen::Commanded,
            ..SampledLoop::facility(63.2, 1066.0, 0.0)
        };
        for extra_s in [0.001, 0.0013, 0.007] {
            let older = SampledLoop { sensing: Sensing { age_s: extra_s, ..base.sensing }, ..base };
            let later = SampledLoop { dead_time_s: base.dead_time_s + extra_s, ..base };
            assert!((lowest(&older) - lowest(&later)).abs() < 1e-9, "{extra_s}");
        }
    }

    #[test]
    fn damping_in_hardware_counts_like_damping() {
        let base = SampledLoop { arrival: Arrival::LineFrom, ..SampledLoop::facility(63.2, 1066.0, 0.0) };
        let both = SampledLoop { hardware_damping_n_s_per_m: 10.0, ..base };
        let saved = lowest(&base) - lowest(&both);
        // It is less late than the virtual damping, in second order.
        assert!((saved - 10.0).abs() < 0.3, "{saved}");
        assert!(SampledLoop { hardware_damping_n_s_per_m: 1.0, arrival: Arrival::Hold, ..base }.stable().is_err());
    }

    #[test]
    fn damping_on_the_own_speed_is_virtual_damping_on_the_command() {
        let base = SampledLoop { damping_on: Seen::Commanded, ..SampledLoop::facility(63.2, 1066.0, 30.0) };
        let own = SampledLoop {
            own_damping_n_s_per_m: 20.0,
            virtual_damping_n_s_per_m: 10.0,
            damping_on: Seen::Commanded,
            ..base
        };
        let growth = |sampled: &SampledLoop| sampled.growth_per_tick().unwrap();
        assert!((growth(&base) - growth(&own)).abs() < 1e-12);
        assert!(growth(&own) < growth(&SampledLoop { own_damping_n_s_per_m: 0.0, ..own }));
    }

    #[test]
    fn the_felt_damping_has_an_interval_too() {
        let base = SampledLoop { arrival: Arrival::LineFrom, ..SampledLoop::facility(63.2, 1066.0, 0.0) };
        let edges = base.hardware_damping_interval().unwrap().unwrap();
        for (damping, stable) in [
            (edges.low_n_s_per_m * 0.999, false),
            (edges.low_n_s_per_m * 1.001, true),
            (edges.high_n_s_per_m * 0.999, true),
            (edges.high_n_s_per_m * 1.001, false),
        ] {
            let tried = SampledLoop { hardware_damping_n_s_per_m: damping, ..base };
            assert_eq!(tried.stable().unwrap(), stable, "{damping} {edges:?}");
        }
    }

    #[test]
    fn instability_is_answered_and_nonsense_refused() {
        let base = SampledLoop::facility(63.2, 1066.0, 0.0);
        assert!(!base.stable().unwrap());
        assert!(SampledLoop { virtual_damping_n_s_per_m: 40.0, ..base }.stable().unwrap());
        assert!(!SampledLoop { virtual_damping_n_s_per_m: 1e4, ..base }.stable().unwrap());
        let hopeless = SampledLoop { hardware_stiffness_n_per_m: 1e6, ..base };
        assert_eq!(hopeless.damping_interval(), Ok(None));
        assert!(SampledLoop { tick_s: 0.0, ..base }.stable().is_err());
        assert!(SampledLoop { dead_time_s: f64::NAN, ..base }.stable().is_err());
        assert!(SampledLoop { arrival: Arrival::LineTo, dead_time_s: 0.001, ..base }.stable().is_err());
    }
}
