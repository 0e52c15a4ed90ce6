//! What moves and what pushes, along one axis or in space. Parts are generic over it.

use crate::force_sensor::Noisy;
use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Sub};

mod axis;
mod spatial;
pub use axis::{Axis, AxisLine, AxisMotion, AxisTouch};
pub use spatial::{Motion, MotionLine, Spatial, Touch, Wrench, turn_between, turned};

/// A kind of space: its motions, its loads, and how two things touch in it.
pub trait Space: Copy + Send + Sync + 'static {
    /// Position, velocity and what else a rigid interface has.
    type Motion: Path;
    /// Force, or force and torque.
    type Wrench: Load + Noisy;
    /// Where and how fast the interfaces penetrate.
    type Touch: Copy + Default + Send + Sync;
}

/// A motion that can be drawn as a straight line between two poses.
pub trait Path: Copy + Debug + Default + Send + Sync + PartialEq {
    /// A straight line between two poses, with all that does not change along it.
    type Line: Copy + Debug + Default + Send + Sync;
    /// A position without its attitude.
    type Place: Copy + Sub<Output = Self::Place> + Div<f64, Output = Self::Place>;
    /// The straight line that takes `duration_s`.
    fn line(from: &Self, to: &Self, duration_s: f64) -> Self::Line;
    /// A line that is this motion all along, but for its acceleration.
    fn held(at: &Self) -> Self::Line;
    /// The point at `share` (0 at the beginning, 1 at the end); its velocity is the line's, its acceleration zero.
    fn on(line: &Self::Line, share: f64) -> Self;
    /// The same, without attitude and rates.
    fn place_on(line: &Self::Line, share: f64) -> Self::Place;
    /// Where it is.
    fn place(&self) -> Self::Place;
    /// The same motion, moved on along its own velocity for `duration_s` (may be negative).
    fn coasted(&self, duration_s: f64) -> Self;
    /// The same motion with this acceleration.
    fn accelerated(&self, acceleration: Self::Place) -> Self;
    /// `share` of the way from `a` to `b` in every component, velocities too: how a stored history is read between samples.
    fn blend(a: &Self, b: &Self, share: f64) -> Self;
}

/// Something that pushes: it can be added and scaled.
pub trait Load:
    Copy + Default + Send + Sync + PartialEq + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
}
