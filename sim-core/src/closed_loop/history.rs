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

    /// As if everything had been moving along `first` for ever; `first` itself is pushed next.
    pub fn fill(&mut self, first: &S::Motion) {
        let length = self.ring.len();
        for (i, pose) in self.ring.iter_mut().enumerate() {
            *pose = first.coasted(-((length - i) as f64) * self.step_s);
        }
        self.head = 0;
    }

    /// Puts the newest pose in.
    #[inline]
    pub fn push(&mut self, newest: S::Motion) {
        self.ring[self.head] = newest;
        self.head = if self.head + 1 == self.ring.len() { 0 } else { self.head + 1 };
    }

    /// The pose as old as the delay, if the newest one was just put in.
    #[inline]
    pub fn read(&self) -> S::Motion {
        let young = self.at(self.whole);
        if self.share == 0.0 { *young } else { S::Motion::blend(young, self.at(self.whole + 1), self.share) }
    }

    #[inline]
    fn at(&self, age: usize) -> &S::Motion {
        let back = age + 1;
        let slot = if back <= self.head { self.head - back } else { self.head + self.ring.len() - back };
        &self.ring[slot]
    }
}
