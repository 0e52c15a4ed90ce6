//! Two clocks: the force stream's stamps are late against the robot's, `t_force = t + t₀`.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | t₀ | offset of the stamps; positive: the force seems to come late | s | fitted; 0 to 10 ms is the usual range |
//!
//! Only the log is wrong: the loop does not feel it. So the replay of the software from the recorded force, which is exact
//! otherwise, shows it alone. Not modelled: skew (1 to 100 ppm). Confused with: force delay and measurement delay, in contact
//! data alone; these are felt by the loop.

use crate::effect::{Effect, Family, Kind, Param, Reads, Verified, Where};
use crate::signals::Wire;
use crate::space::Axis;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec;

struct ClockOffset {
    offset_s: f64,
}

impl Effect<Axis> for ClockOffset {
    fn stamp_offset_s(&self) -> f64 {
        self.offset_s
    }

    fn reads(&self) -> Reads {
        Reads::Loads
    }
}

/// The entry of the catalogue.
pub fn kind() -> Kind<Axis> {
    Kind {
        id: "clock-offset".into(),
        about: "the stamps of force and pose come from clocks that differ by a constant".into(),
        fingerprint: "the recorded command answers the recorded force at the wrong time, though the loop itself is right".into(),
        experiment: "stamp one common event (a trigger line, a tap that both streams see) with both clocks".into(),
        wires: vec![Wire::Recorder],
        order: 10,
        family: Family::Timing,
        rigs: Where::Docking,
        params: vec![Param::new("offset_s", "s", [-0.1, 0.0, 0.1], 1e-3, &[0.002, -0.002])],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(ClockOffset { offset_s: values[0] })),
    }
}
