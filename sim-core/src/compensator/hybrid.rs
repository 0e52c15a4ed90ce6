//! Hybrid architecture (thesis Fig. 3.1, bottom): a real contact, felt by the sensor, plus a virtual one in software.
//!
//! `F = C[-(reading - c - W sin θ)] + kv z + bv z'`, the virtual part while its pose penetrates; it is clamped by nothing.
//! Outside contact (less than the dead band in the sensor, and no penetration) the felt force counts as zero, since a bias
//! of 0.25 N would push 63 kg to 40 mm/s within ten seconds.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | C | compensation of the delay: none unless said | |
//! | c | known bias | N |
//! | W | known weight of the tool | N |
//! | kv, bv | virtual stiffness and damping | N/m, N s/m |
//! | z, z' | measured, estimated or commanded pose, and its backward difference over one tick | m, m/s |
//!
//! [`Architecture`] makes it pure hardware (no virtual part) or pure software (no felt part).

use super::delay_compensation::Felt;
use super::{
    Architecture, Compensator, DelayCompensation, Heard, PositionEstimatorState, Uncompensated, VirtualPose,
    weight_along_axis_n,
};
use crate::refusal::{Refusal, finite, not_negative};
use crate::space::{Axis, AxisMotion, Path};
use crate::time::Step;
use serde::{Deserialize, Serialize};

/// What the compensator believes, the virtual contact that it adds, and how it makes up for the delay.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Hybrid<Delay = Uncompensated> {
    /// Known bias c of the sensor.
    pub bias_n: f64,
    /// Known weight W of the tool.
    pub tool_weight_n: f64,
    /// Virtual stiffness kv.
    pub virtual_stiffness_n_per_m: f64,
    /// Virtual damping bv.
    pub virtual_damping_n_s_per_m: f64,
    /// Below this reading, and without penetration, the felt force counts as zero.
    pub dead_band_n: f64,
    /// Which of the two contacts count.
    #[serde(default)]
    pub architecture: Architecture,
    /// Which pose the virtual contact penetrates.
    #[serde(default)]
    pub virtual_pose: VirtualPose,
    /// Compensation of the delay.
    #[serde(default)]
    pub delay: Delay,
}

/// The pose of the tick before, and what its parts remember.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HybridState<Delay = ()> {
    /// None before the first tick.
    before_m: Option<f64>,
    measured_first: AxisMotion,
    estimator: PositionEstimatorState,
    delay: Delay,
}

impl<Delay> Hybrid<Delay> {
    /// The same compensator with this compensation of its delay.
    pub fn with_delay<Other>(self, delay: Other) -> Hybrid<Other> {
        Hybrid {
            bias_n: self.bias_n,
            tool_weight_n: self.tool_weight_n,
            virtual_stiffness_n_per_m: self.virtual_stiffness_n_per_m,
            virtual_damping_n_s_per_m: self.virtual_damping_n_s_per_m,
            dead_band_n: self.dead_band_n,
            architecture: self.architecture,
            virtual_pose: self.virtual_pose,
            delay,
        }
    }
}

impl<Delay: DelayCompensation> Hybrid<Delay> {
    /// Refuses what no compensator can mean.
    pub fn check(&self, period_s: f64) -> Result<(), Refusal> {
        finite("bias_n", self.bias_n, "N")?;
        finite("tool_weight_n", self.tool_weight_n, "N")?;
        finite("virtual_stiffness_n_per_m", self.virtual_stiffness_n_per_m, "N/m")?;
        finite("virtual_damping_n_s_per_m", self.virtual_damping_n_s_per_m, "N s/m")?;
        not_negative("dead_band_n", self.dead_band_n, "N")?;
        self.virtual_pose.check(period_s)?;
        self.delay.check(period_s)
    }

    /// Where the virtual contact is, in m, and how fast, in m/s.
    fn pose(&self, state: &mut HybridState<Delay::State>, heard: &Heard<'_, Axis>, period_s: f64) -> (f64, f64) {
        let position_m = match &self.virtual_pose {
            VirtualPose::Measured => heard.measured.position_m,
            VirtualPose::Commanded => heard.commanded.position_m,
            VirtualPose::Estimated(estimator) => {
                estimator.position_m(&mut state.estimator, heard.commanded, heard.measured, period_s)
            }
        };
        // Before the first tick the measured pose is known; any other one has been moving with its own velocity.
        let before_m = state.before_m.unwrap_or_else(|| match self.virtual_pose {
            VirtualPose::Measured => state.measured_first.coasted(-period_s).position_m,
            _ => position_m - heard.commanded.velocity_m_per_s * period_s,
        });
        state.before_m = Some(position_m);
        (position_m, (position_m - before_m) / period_s)
    }
}

impl<Delay: DelayCompensation> Compensator<Axis> for Hybrid<Delay> {
    type State = HybridState<Delay::State>;

    fn start(&self, measured: &AxisMotion, period_s: f64) -> Self::State {
        HybridState {
            before_m: None,
            measured_first: *measured,
            estimator: PositionEstimatorState::default(),
            delay: self.delay.start(period_s),
        }
    }

    fn feedback(&self, state: &mut Self::State, step: Step, heard: Heard<'_, Axis>) -> f64 {
        let period_s = step.dt.seconds();
        let known_n = self.bias_n + weight_along_axis_n(self.tool_weight_n, heard.measured);
        let heard_n = heard.sensed.map_or(0.0, |reading_n| known_n - reading_n);
        let felt_n = if self.architecture.feels() { heard_n } else { 0.0 };
        let (position_m, rate_m_per_s) = self.pose(state, &heard, period_s);
        let touches = position_m > 0.0;
        let felt = Felt {
            force_n: if !touches && felt_n.abs() < self.dead_band_n { 0.0 } else { felt_n },
            commanded: *heard.commanded,
            measured: *heard.measured,
            period_s,
        };
        let felt_n = self.delay.force_n(&mut state.delay, &felt);
        if touches && self.architecture.computes() {
            let virtual_n = self.virtual_stiffness_n_per_m * position_m + self.virtual_damping_n_s_per_m * rate_m_per_s;
            felt_n + virtual_n
        } else {
            felt_n
        }
    }

    fn command(&self, state: &mut Self::State, step: Step, asked: AxisMotion) -> AxisMotion {
        self.delay.command(&mut state.delay, &asked, step.dt.seconds())
    }

    fn reads_acceleration(&self) -> bool {
        false
    }
}
