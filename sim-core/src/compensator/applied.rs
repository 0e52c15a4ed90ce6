//! A rig without satellites: a known force drives it, and its own mechanics resists.

use super::{Compensator, Heard};
use crate::space::Space;
use crate::time::Step;

/// Net force = what resists - what is applied.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Applied;

impl<S: Space> Compensator<S> for Applied {
    type State = ();

    fn start(&self, _measured: &S::Motion, _period_s: f64) {}

    #[inline]
    fn feedback(&self, _state: &mut (), _step: Step, heard: Heard<'_, S>) -> S::Wrench {
        *heard.interface - heard.applied
    }

    fn reads_acceleration(&self) -> bool {
        false
    }
}
