//! One axis: every motion a number and its rates, every load a force along it.

use super::{Load, Path, Space};
use serde::{Deserialize, Serialize};

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

/// A straight line along one axis. What is used together stands together: the compiler loads it in pairs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct AxisLine {
    from_m: f64,
    change_m: f64,
    from_rad: f64,
    change_rad: f64,
    velocity_m_per_s: f64,
    rate_rad_per_s: f64,
}

impl Path for AxisMotion {
    type Line = AxisLine;
    type Place = f64;

    #[inline]
    fn line(from: &Self, to: &Self, duration_s: f64) -> AxisLine {
        let (change_m, change_rad) = (to.position_m - from.position_m, to.pitch_rad - from.pitch_rad);
        AxisLine {
            from_m: from.position_m,
            change_m,
            velocity_m_per_s: change_m / duration_s,
            from_rad: from.pitch_rad,
            change_rad,
            rate_rad_per_s: change_rad / duration_s,
        }
    }

    #[inline]
    fn held(at: &Self) -> AxisLine {
        AxisLine {
            from_m: at.position_m,
            change_m: 0.0,
            velocity_m_per_s: at.velocity_m_per_s,
            from_rad: at.pitch_rad,
            change_rad: 0.0,
            rate_rad_per_s: at.pitch_rate_rad_per_s,
        }
    }

    #[inline]
    fn on(line: &AxisLine, share: f64) -> Self {
        AxisMotion {
            position_m: line.from_m + line.change_m * share,
            velocity_m_per_s: line.velocity_m_per_s,
            acceleration_m_per_s2: 0.0,
            pitch_rad: line.from_rad + line.change_rad * share,
            pitch_rate_rad_per_s: line.rate_rad_per_s,
        }
    }

    #[inline]
    fn place_on(line: &AxisLine, share: f64) -> f64 {
        line.from_m + line.change_m * share
    }

    #[inline]
    fn place(&self) -> f64 {
        self.position_m
    }

    #[inline]
    fn coasted(&self, duration_s: f64) -> Self {
        AxisMotion {
            position_m: self.position_m + self.velocity_m_per_s * duration_s,
            pitch_rad: self.pitch_rad + self.pitch_rate_rad_per_s * duration_s,
            ..*self
        }
    }

    #[inline]
    fn accelerated(&self, acceleration_m_per_s2: f64) -> Self {
        AxisMotion { acceleration_m_per_s2, ..*self }
    }

    #[inline]
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
