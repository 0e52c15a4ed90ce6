//! Two robots with two clocks: the relative pose at the times of the robot with the probe.
//!
//! A sample of the probe's robot waits until the other robot has one from before it and one from after it; the relative pose is
//! interpolated between the two that these give, linearly in position and along the shortest turn. If the other robot falls
//! silent, its last pose is held, and the caller is told. The nozzle's motion within one cycle is taken to be uniform.

use crate::cell::frames::{Places, Reported};
use nalgebra::UnitQuaternion;
use sim_core::frames::{Nozzle, Pose, Probe};
use std::collections::VecDeque;

/// How long a sample waits for the other robot: two cycles of the slow interpolator and a spare. Chosen.
const PATIENCE_NS: i64 = 40_000_000;
/// Most samples that wait, whatever their times say.
const WAITING_MAX: usize = 256;

/// A relative pose and its times.
#[derive(Debug, Clone, Copy)]
pub(super) struct Paired {
    pub received_ns: i64,
    pub stamp_ns: i64,
    pub pose: Pose<Nozzle, Probe>,
    /// The other robot's pose was held.
    pub is_held: bool,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    received_ns: i64,
    stamp_ns: i64,
    reported: Reported,
}

#[derive(Debug)]
pub(super) struct Pairing {
    places: Places,
    has_nozzle: bool,
    probe: VecDeque<Sample>,
    nozzle: VecDeque<Sample>,
    /// Samples from before the other robot's first.
    pub unpaired: u64,
}

impl Pairing {
    pub fn new(places: Places, has_nozzle: bool) -> Self {
        Pairing { places, has_nozzle, probe: VecDeque::new(), nozzle: VecDeque::new(), unpaired: 0 }
    }

    /// A sample of the robot with the probe.
    pub fn probe(&mut self, received_ns: i64, stamp_ns: i64, reported: Reported) {
        self.probe.push_back(Sample { received_ns, stamp_ns, reported });
    }

    /// A sample of the robot with the nozzle.
    pub fn nozzle(&mut self, received_ns: i64, stamp_ns: i64, reported: Reported) {
        if self.nozzle.len() == WAITING_MAX {
            self.nozzle.pop_front();
        }
        self.nozzle.push_back(Sample { received_ns, stamp_ns, reported });
    }

    /// The next relative pose that is ready at this time.
    pub fn next(&mut self, now_ns: i64) -> Option<Paired> {
        loop {
            let sample = *self.probe.front()?;
            if !self.has_nozzle {
                self.probe.pop_front();
                return Some(self.paired(&sample, self.places.relative(&sample.reported, None), false));
            }
            // Of the samples before, only the last one counts.
            while self.nozzle.get(1).is_some_and(|next| next.stamp_ns <= sample.stamp_ns) {
                self.nozzle.pop_front();
            }
            let is_late = now_ns.saturating_sub(sample.received_ns) > PATIENCE_NS || self.probe.len() > WAITING_MAX;
            let before = self.nozzle.front().filter(|before| before.stamp_ns <= sample.stamp_ns).copied();
            match (before, self.nozzle.get(1).copied()) {
                (Some(before), Some(after)) => {
                    self.probe.pop_front();
                    return Some(self.paired(&sample, self.between(&sample, &before, &after), false));
                }
                (Some(before), None) if is_late => {
                    self.probe.pop_front();
                    let pose = self.places.relative(&sample.reported, Some(&before.reported));
                    return Some(self.paired(&sample, pose, true));
                }
                (None, _) if is_late || !self.nozzle.is_empty() => {
                    self.probe.pop_front();
                    self.unpaired += 1;
                }
                _ => return None,
            }
        }
    }

    fn between(&self, sample: &Sample, before: &Sample, after: &Sample) -> Pose<Nozzle, Probe> {
        let [from, to] = [before, after].map(|nozzle| self.places.relative(&sample.reported, Some(&nozzle.reported)));
        let span_ns = after.stamp_ns.saturating_sub(before.stamp_ns).max(1);
        let part = sample.stamp_ns.saturating_sub(before.stamp_ns) as f64 / span_ns as f64;
        let turn = (from.attitude.inverse() * to.attitude).scaled_axis() * part;
        let attitude = from.attitude * UnitQuaternion::from_scaled_axis(turn);
        Pose::new(from.position_m + (to.position_m - from.position_m) * part, attitude)
    }

    fn paired(&self, sample: &Sample, pose: Pose<Nozzle, Probe>, is_held: bool) -> Paired {
        Paired { received_ns: sample.received_ns, stamp_ns: sample.stamp_ns, pose, is_held }
    }
}
