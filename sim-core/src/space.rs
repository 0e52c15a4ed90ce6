//! What moves and what pushes, along one axis or in space. Parts are generic over it.

use core::ops::{Add, Mul, Sub};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A kind of space: its motions, its loads, and how two things touch in it.
pub trait Space: Copy + Send + Sync + 'static {
    /// Position, velocity and what else a rigid interface has.
    type Motion: Path;
    /// Force, or force and torque.
    type Wrench: Load;
    /// Where and how fast the interfaces penetrate.
    type Touch: Copy + Default + Send + Sync;
}

/// A motion that can be drawn as a straight line between two poses.
pub trait Path: Copy + Default + Send + Sync + PartialEq {
    /// The point at `share` (0 at `from`, 1 at `to`) of a straight line that takes `duration_s`; its velocity is the line's.
    fn on_line(from: &Self, to: &Self, share: f64, duration_s: f64) -> Self;
    /// The same motion, moved on along its own velocity for `duration_s` (may be negative).
    fn coasted(&self, duration_s: f64) -> Self;
    /// The average acceleration that turns the velocity of `earlier` into that of `later` within `duration_s`.
    fn with_acceleration(&self, later: &Self, earlier: &Self, duration_s: f64) -> Self;
    /// `share` of the way from `a` to `b` in every component, velocities too: how a stored history is read between samples.
    fn blend(a: &Self, b: &Self, share: f64) -> Self;
}

/// Something that pushes: it can be added and scaled.
pub trait Load:
    Copy + Default + Send + Sync + PartialEq + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
}

/// Motion along one axis, with the pitch that turns a known weight into a force along it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct AxisMotion {
    /// Penetration of the nominal contact plane; positive z closes the gap.
    pub position_m: f64,
    /// Rate of [`AxisMotion::position_m`].
    pub velocity_m_per_s: f64,
    /// Rate of [`AxisMotion::velocity_m_per_s`].
    pub acceleration_m_per_s2: f64,
    /// Rotation about +x of the nozzle frame.
    pub pitch_rad: f64,
    /// Rate of [`AxisMotion::pitch_rad`].
    pub pitch_rate_rad_per_s: f64,
}

impl AxisMotion {
    /// At `position_m`, moving with `velocity_m_per_s`, level.
    pub fn moving(position_m: f64, velocity_m_per_s: f64) -> Self {
        AxisMotion { position_m, velocity_m_per_s, ..AxisMotion::default() }
    }
}

impl Path for AxisMotion {
    fn on_line(from: &Self, to: &Self, share: f64, duration_s: f64) -> Self {
        AxisMotion {
            position_m: from.position_m + (to.position_m - from.position_m) * share,
            velocity_m_per_s: (to.position_m - from.position_m) / duration_s,
            acceleration_m_per_s2: 0.0,
            pitch_rad: from.pitch_rad + (to.pitch_rad - from.pitch_rad) * share,
            pitch_rate_rad_per_s: (to.pitch_rad - from.pitch_rad) / duration_s,
        }
    }

    fn coasted(&self, duration_s: f64) -> Self {
        AxisMotion {
            position_m: self.position_m + self.velocity_m_per_s * duration_s,
            pitch_rad: self.pitch_rad + self.pitch_rate_rad_per_s * duration_s,
            ..*self
        }
    }

    fn with_acceleration(&self, later: &Self, earlier: &Self, duration_s: f64) -> Self {
        let change_m_per_s = later.velocity_m_per_s - earlier.velocity_m_per_s;
        AxisMotion { acceleration_m_per_s2: change_m_per_s / duration_s, ..*self }
    }

    fn blend(a: &Self, b: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        AxisMotion {
            position_m: mix(a.position_m, b.position_m),
            velocity_m_per_s: mix(a.velocity_m_per_s, b.velocity_m_per_s),
            acceleration_m_per_s2: mix(a.acceleration_m_per_s2, b.acceleration_m_per_s2),
            pitch_rad: mix(a.pitch_rad, b.pitch_rad),
            pitch_rate_rad_per_s: mix(a.pitch_rate_rad_per_s, b.pitch_rate_rad_per_s),
        }
    }
}

/// Penetration along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisTouch {
    /// Depth of penetration; positive while the interfaces touch.
    pub depth_m: f64,
    /// Rate of [`AxisTouch::depth_m`].
    pub rate_m_per_s: f64,
}

impl Load for f64 {}

/// One axis: every load is a force along it, in N.
#[derive(Debug, Clone, Copy)]
pub struct Axis;

impl Space for Axis {
    type Motion = AxisMotion;
    type Wrench = f64;
    type Touch = AxisTouch;
}

/// Motion of the probe tip relative to the nozzle, expressed in the nozzle frame. Positive z closes the gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Probe tip from the nozzle's origin.
    pub position_m: Vector3<f64>,
    /// Turns probe axes into nozzle axes.
    pub attitude: UnitQuaternion<f64>,
    /// Rate of the position.
    pub velocity_m_per_s: Vector3<f64>,
    /// Rate of turn, in nozzle axes.
    pub rate_rad_per_s: Vector3<f64>,
    /// Rate of the velocity.
    pub acceleration_m_per_s2: Vector3<f64>,
}

impl Default for Motion {
    fn default() -> Self {
        Motion {
            position_m: Vector3::zeros(),
            attitude: UnitQuaternion::identity(),
            velocity_m_per_s: Vector3::zeros(),
            rate_rad_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
        }
    }
}

impl Path for Motion {
    fn on_line(from: &Self, to: &Self, share: f64, duration_s: f64) -> Self {
        let turn = (to.attitude * from.attitude.inverse()).scaled_axis();
        Motion {
            position_m: from.position_m + (to.position_m - from.position_m) * share,
            attitude: UnitQuaternion::from_scaled_axis(turn * share) * from.attitude,
            velocity_m_per_s: (to.position_m - from.position_m) / duration_s,
            rate_rad_per_s: turn / duration_s,
            acceleration_m_per_s2: Vector3::zeros(),
        }
    }

    fn coasted(&self, duration_s: f64) -> Self {
        Motion {
            position_m: self.position_m + self.velocity_m_per_s * duration_s,
            attitude: UnitQuaternion::from_scaled_axis(self.rate_rad_per_s * duration_s) * self.attitude,
            ..*self
        }
    }

    fn with_acceleration(&self, later: &Self, earlier: &Self, duration_s: f64) -> Self {
        let change = later.velocity_m_per_s - earlier.velocity_m_per_s;
        Motion { acceleration_m_per_s2: change / duration_s, ..*self }
    }

    fn blend(a: &Self, b: &Self, share: f64) -> Self {
        Motion {
            position_m: a.position_m + (b.position_m - a.position_m) * share,
            attitude: Motion::on_line(a, b, share, 1.0).attitude,
            velocity_m_per_s: a.velocity_m_per_s + (b.velocity_m_per_s - a.velocity_m_per_s) * share,
            rate_rad_per_s: a.rate_rad_per_s + (b.rate_rad_per_s - a.rate_rad_per_s) * share,
            acceleration_m_per_s2: a.acceleration_m_per_s2
                + (b.acceleration_m_per_s2 - a.acceleration_m_per_s2) * share,
        }
    }
}

/// Force and torque on the chaser at the probe tip, expressed in the nozzle frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force.
    pub force_n: Vector3<f64>,
    /// Torque about the probe tip.
    pub torque_n_m: Vector3<f64>,
}

impl Default for Wrench {
    fn default() -> Self {
        Wrench { force_n: Vector3::zeros(), torque_n_m: Vector3::zeros() }
    }
}

impl Add for Wrench {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Wrench { force_n: self.force_n + other.force_n, torque_n_m: self.torque_n_m + other.torque_n_m }
    }
}

impl Sub for Wrench {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Wrench { force_n: self.force_n - other.force_n, torque_n_m: self.torque_n_m - other.torque_n_m }
    }
}

impl Mul<f64> for Wrench {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Wrench { force_n: self.force_n * factor, torque_n_m: self.torque_n_m * factor }
    }
}

impl Load for Wrench {}

/// Penetration in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Depth along the normal; positive while the interfaces touch.
    pub depth_m: f64,
    /// Rate of the depth.
    pub rate_m_per_s: f64,
    /// Unit normal on the probe, in the nozzle frame.
    pub normal: Vector3<f64>,
    /// Contact point in the nozzle frame.
    pub point_m: Vector3<f64>,
    /// From the probe tip to the contact point, in the nozzle frame: the arm of the contact force.
    pub arm_m: Vector3<f64>,
    /// Velocity of the probe at the contact point across the normal, relative to the nozzle, in the nozzle frame.
    pub slip_m_per_s: Vector3<f64>,
}

impl Default for Touch {
    fn default() -> Self {
        Touch {
            depth_m: 0.0,
            rate_m_per_s: 0.0,
            normal: -Vector3::z(),
            point_m: Vector3::zeros(),
            arm_m: Vector3::zeros(),
            slip_m_per_s: Vector3::zeros(),
        }
    }
}

/// Three translations and three rotations.
#[derive(Debug, Clone, Copy)]
pub struct Spatial;

impl Space for Spatial {
    type Motion = Motion;
    type Wrench = Wrench;
    type Touch = Touch;
}
