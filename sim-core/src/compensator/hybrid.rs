//! Hybrid architecture (thesis Fig. 3.1, bottom): a real contact, felt by the sensor, plus a virtual one in software.
//!
//! `F = -(reading - c - W sin θ) + kv z + bv z'` while the measured pose penetrates; the virtual part is clamped by nothing.
//! Outside contact (less than the dead band in the sensor, and no penetration measured) the force counts as zero, since a bias
//! of 0.25 N would push 63 kg to 40 mm/s within ten seconds.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c | known bias | N |
//! | W | known weight of the tool | N |
//! | kv, bv | virtual stiffness and damping | N/m, N s/m |
//! | z, z' | measured pose and its backward difference over one tick | m, m/s |
//!
//! Pure hardware is kv = bv = 0; pure software is a sensor that reads nothing.

use super::{Compensator, Heard, weight_along_axis_n};
use crate::space::{Axis, AxisMotion, Path};
use crate::time::Step;
use serde::{Deserialize, Serialize};

/// What the compensator believes, and the virtual contact that it adds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hybrid {
    /// Known bias c of the sensor.
    pub bias_n: f64,
    /// Known weight W of the tool.
    pub tool_weight_n: f64,
    /// Virtual stiffness kv.
    pub virtual_stiffness_n_per_m: f64,
    /// Virtual damping bv.
    pub virtual_damping_n_s_per_m: f64,
    /// Below this reading, and without penetration, the force counts as zero.
    pub dead_band_n: f64,
}

/// The pose of the tick before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HybridState {
    before: AxisMotion,
}

impl Compensator<Axis> for Hybrid {
    type State = HybridState;

    fn start(&self, measured: &AxisMotion, period_s: f64) -> HybridState {
        HybridState { before: measured.coasted(-period_s) }
    }

    #[inline]
    fn feedback(&self, state: &mut HybridState, step: Step, heard: Heard<'_, Axis>) -> f64 {
        let measured = heard.measured;
        let known_n = self.bias_n + weight_along_axis_n(self.tool_weight_n, measured);
        let felt_n = heard.sensed.map_or(0.0, |reading_n| known_n - reading_n);
        let rate_m_per_s = (measured.position_m - state.before.position_m) / step.dt.seconds();
        state.before = *measured;
        if measured.position_m > 0.0 {
            let virtual_n =
                self.virtual_stiffness_n_per_m * measured.position_m + self.virtual_damping_n_s_per_m * rate_m_per_s;
            felt_n + virtual_n
        } else if felt_n.abs() < self.dead_band_n {
            0.0
        } else {
            felt_n
        }
    }

    fn reads_acceleration(&self) -> bool {
        false
    }
}
