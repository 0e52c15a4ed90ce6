//! The achieved poses of the recent past: the read-back's memory.

use crate::delay;
use crate::space::{Path, Space};
use crate::time::Nanos;
use alloc::vec::Vec;

/// A ring of poses, one for each physics step, that is read at a constant age.
pub(super) struct History<S: Space> {
    ring: Vec<S::Motion>,
    /// Where the next pose goes.
    head: usize,
    /// Age in steps, and the share of the next older pose.
    whole: usize,
    share: f64,
    step_s: f64,
}

impl<S: Space> History<S> {
    /// A history that is yet to be filled.
    pub fn new(delay_s: f64, physics_step: Nanos) -> Self {
        let step_s = physics_step.seconds();
        let steps = delay::steps(delay_s, step_s);
        let whole = libm::floor(steps);
        let ring = alloc::vec![S::Motion::default(); delay::slots(delay_s, step_s) - 1];
        History { ring, head: 0, whole: whole as usize, share: steps - whole, step_s }
    }

    /// As if everything had been moving along `first` for ever; `first` itself is put in next.
    pub fn fill(&mut self, first: &S::Motion) {
        let length = self.ring.len();
        for (i, pose) in self.ring.iter_mut().enumerate() {
            *pose = first.coasted(-((length - i) as f64) * self.step_s);
        }
        self.head = 0;
    }

    /// The pose as old as the delay, when `newest` is yet to be put in.
    #[inline]
    pub fn read(&self, newest: &S::Motion) -> S::Motion {
        let young = if self.whole == 0 { newest } else { self.at(self.whole) };
        if self.share == 0.0 { *young } else { S::Motion::blend(young, self.at(self.whole + 1), self.share) }
    }

    /// Puts the newest pose in.
    #[inline]
    pub fn push(&mut self, newest: &S::Motion) {
        self.ring[self.head] = *newest;
        self.head = if self.head + 1 == self.ring.len() { 0 } else { self.head + 1 };
    }

    /// The pose that was put in `age` pushes ago, if the last one counts as 1.
    #[inline]
    fn at(&self, age: usize) -> &S::Motion {
        let slot = if age <= self.head { self.head - age } else { self.head + self.ring.len() - age };
        &self.ring[slot]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{Axis, AxisMotion};

    /// Along a straight line every delay is exact: whole steps, none, and a share of one.
    #[test]
    fn it_reads_as_late_as_the_delay_says() {
        let at = |time_s: f64| AxisMotion::moving(0.035 * time_s, 0.035);
        for delay_s in [0.0, 0.001, 0.0162, 0.0004] {
            let mut history = History::<Axis>::new(delay_s, Nanos(1_000_000));
            history.fill(&at(0.0));
            for step in 0..100 {
                let now_s = f64::from(step) * 1e-3;
                let late = history.read(&at(now_s));
                history.push(&at(now_s));
                // A few roundings of positions below 3.5 mm.
                let off_m = late.position_m - at(now_s - delay_s).position_m;
                assert!(off_m.abs() <= 8.0 * f64::EPSILON * 0.0035, "{delay_s} s, step {step}: {off_m}");
            }
        }
    }
}
