//! The position estimator of thesis Fig. 3.1: the pose that the robot has now, from a report that is late.
//!
//! | method | equation |
//! |---|---|
//! | forward | `x̂(t) = x_m(t) + D (x_m(t) - x_m(t - T)) / T` |
//! | command history | `x̂(t) = x_c(t - h) + x_m(t) - x_c(t - h - D)` |
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x_m, x_c | measured and commanded pose | m |
//! | h | dead time from command to pose | s |
//! | D | delay from pose to report | s |
//! | T | tick of the loop | s |
//!
//! `forward` needs no model of the robot. It misses a D (D + T) / 2 under an acceleration a, and multiplies read-out noise by
//! √((1 + D/T)² + (D/T)²): 6.4 at 16 ms and 4 ms. `command history` multiplies read-out noise by one, and what the robot adds
//! to the command is late by D. An h that is wrong by δ errs by a δ D, which vanishes in uniform motion; a wrong D errs by
//! v (D̂ - D), as in the other method. Neither sees a robot that is not a dead time.
//!
//! The equations are this project's: the thesis names the block and does not give it.

use super::delay_compensation::ring::{Ring, within_reach};
use crate::delay;
use crate::refusal::{Refusal, not_negative};
use crate::space::AxisMotion;
use serde::{Deserialize, Serialize};

/// How the pose of now is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "kebab-case")]
pub enum PositionEstimator {
    /// The report, moved on with its own velocity.
    Forward {
        /// Believed delay D of the report.
        readout_delay_s: f64,
    },
    /// The command as the robot should have it, corrected by what the last report says about it.
    CommandHistory {
        /// Believed dead time h of the robot.
        dead_time_s: f64,
        /// Believed delay D of the report.
        readout_delay_s: f64,
    },
}

/// The poses that it remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PositionEstimatorState {
    commanded: Ring,
    measured: Ring,
}

impl PositionEstimator {
    /// Refuses delays without meaning, and delays beyond what is remembered.
    pub fn check(&self, period_s: f64) -> Result<(), Refusal> {
        match *self {
            PositionEstimator::Forward { readout_delay_s } => {
                not_negative("readout_delay_s", readout_delay_s, "s").map(|_| ())
            }
            PositionEstimator::CommandHistory { dead_time_s, readout_delay_s } => {
                not_negative("dead_time_s", dead_time_s, "s")?;
                not_negative("readout_delay_s", readout_delay_s, "s")?;
                within_reach("dead_time_s + readout_delay_s", dead_time_s + readout_delay_s, period_s)
            }
        }
    }

    /// The pose of now.
    pub fn position_m(
        &self,
        state: &mut PositionEstimatorState,
        commanded: &AxisMotion,
        measured: &AxisMotion,
        period_s: f64,
    ) -> f64 {
        state.commanded.push(commanded, period_s);
        state.measured.push(measured, period_s);
        match *self {
            PositionEstimator::Forward { readout_delay_s } => {
                let rate_m_per_s = (measured.position_m - state.measured.at(1.0)) / period_s;
                measured.position_m + readout_delay_s * rate_m_per_s
            }
            PositionEstimator::CommandHistory { dead_time_s, readout_delay_s } => {
                let now_m = state.commanded.at(delay::steps(dead_time_s, period_s));
                let reported_m = state.commanded.at(delay::steps(dead_time_s + readout_delay_s, period_s));
                now_m + (measured.position_m - reported_m)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot with a dead time of four ticks and a report that is four ticks late follows x(t).
    fn worst_m(estimator: PositionEstimator, x: impl Fn(f64) -> f64, v: impl Fn(f64) -> f64, offset_m: f64) -> f64 {
        let mut state = PositionEstimatorState::default();
        let mut worst_m: f64 = 0.0;
        for n in 0..100 {
            let t = |ticks: f64| (f64::from(n) - ticks) * 0.004;
            let commanded = AxisMotion::moving(x(t(0.0)), v(t(0.0)));
            let measured = AxisMotion::moving(x(t(8.0)) + offset_m, v(t(8.0)));
            let found_m = estimator.position_m(&mut state, &commanded, &measured, 0.004);
            if n > 10 {
                worst_m = worst_m.max((found_m - offset_m - x(t(4.0))).abs());
            }
        }
        worst_m
    }

    #[test]
    fn the_command_history_is_exact_for_a_dead_time_and_keeps_what_the_robot_adds() {
        let history = PositionEstimator::CommandHistory { dead_time_s: 0.016, readout_delay_s: 0.016 };
        let rounding_m = 4.0 * f64::EPSILON;
        let bent = |t: f64| 0.035 * t + 0.3 * t * t;
        assert!(worst_m(history, bent, |t| 0.035 + 0.6 * t, 0.0) < rounding_m);
        assert!(worst_m(history, bent, |t| 0.035 + 0.6 * t, 0.001) < rounding_m, "a constant tracking error passes");
    }

    #[test]
    fn the_forward_shift_misses_what_an_acceleration_does_within_the_delay() {
        let forward = PositionEstimator::Forward { readout_delay_s: 0.016 };
        let straight = worst_m(forward, |t| 0.035 * t, |_| 0.035, 0.0);
        assert!(straight < 16.0 * f64::EPSILON * 0.02, "{straight}");
        // a D (D + T) / 2 with a = 0.6 m/s².
        let bent = worst_m(forward, |t| 0.3 * t * t, |t| 0.6 * t, 0.0);
        assert!((bent - 0.6 * 0.016 * 0.020 / 2.0).abs() < 1e-15, "{bent}");
    }

    #[test]
    fn a_wrong_dead_time_costs_acceleration_a_wrong_report_costs_velocity() {
        let believed =
            |dead_time_s, readout_delay_s| PositionEstimator::CommandHistory { dead_time_s, readout_delay_s };
        let (x, v) = (|t: f64| 0.035 * t + 0.3 * t * t, |t: f64| 0.035 + 0.6 * t);
        // Eight milliseconds of h: the velocity changes by a δ within the D that lies between the two commands.
        let dead = worst_m(believed(0.024, 0.016), x, v, 0.0);
        assert!((dead - 0.6 * 0.008 * 0.016).abs() < 1e-15, "{dead}");
        let straight = worst_m(believed(0.024, 0.016), |t| 0.035 * t, |_| 0.035, 0.0);
        assert!(straight < 1e-15, "{straight}");
        let late = worst_m(believed(0.016, 0.024), |t| 0.035 * t, |_| 0.035, 0.0);
        assert!((late - 0.035 * 0.008).abs() < 1e-15, "{late}");
    }

    #[test]
    fn delays_without_meaning_are_refused() {
        let late = PositionEstimator::CommandHistory { dead_time_s: 0.2, readout_delay_s: 0.1 };
        assert!(late.check(0.004).is_err() && late.check(0.005).is_ok());
        assert!(PositionEstimator::Forward { readout_delay_s: -0.001 }.check(0.004).is_err());
        assert!(PositionEstimator::Forward { readout_delay_s: f64::NAN }.check(0.004).is_err());
    }
}
