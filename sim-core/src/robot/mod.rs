//! The robot: how the pose follows the commands that were received.

use crate::refusal::Refusal;
use crate::space::Space;

mod rigid;
mod straight_line;
pub use rigid::Rigid;
pub use straight_line::{StraightLine, StraightLineState};

/// Follows commands; knows its path exactly between ticks.
pub trait Robot<S: Space>: Send + Sync {
    /// What changes from step to step.
    type State: Clone + Send;
    /// Moving along `first` since ever; `first` takes effect at `due_s`.
    fn start(&self, first: &S::Motion, due_s: f64) -> Self::State;
    /// Takes a command that takes effect at `due_s`.
    fn accept(&self, state: &mut Self::State, due_s: f64, command: &S::Motion);
    /// The pose at `now_s`; times only grow from call to call.
    fn motion(&self, state: &mut Self::State, now_s: f64) -> S::Motion;
    /// The same, for a run in which nothing reads the acceleration: it may be left out.
    fn pose(&self, state: &mut Self::State, now_s: f64) -> S::Motion {
        self.motion(state, now_s)
    }
    /// Refuses parameters that mean nothing.
    fn check(&self) -> Result<(), Refusal> {
        Ok(())
    }
}
