//! A rig without a robot: the pose is the plant's own, at once.

use super::Robot;
use crate::space::Space;

/// Follows without delay.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rigid;

impl<S: Space> Robot<S> for Rigid {
    type State = S::Motion;

    fn start(&self, first: &S::Motion, _due_s: f64) -> S::Motion {
        *first
    }

    fn accept(&self, state: &mut S::Motion, _due_s: f64, command: &S::Motion) {
        *state = *command;
    }

    fn motion(&self, state: &mut S::Motion, _now_s: f64) -> S::Motion {
        *state
    }
}
