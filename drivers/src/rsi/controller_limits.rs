//! Limits of the corrections: those that saturate without a word (POSCORR, AXISCORREXT) and those that stop (POSCORRMON).
//!
//! | limit | on what | default |
//! |---|---|---|
//! | `lower_mm`, `upper_mm` | cumulative correction along X, Y, Z, each alone | -5, 5 mm |
//! | `rotation_deg` | total angle between the orientation at the start and the corrected one | 5° |
//! | `stop_translation_mm` | length of the translation (POSCORRMON) | 6 mm |
//! | `stop_rotation_deg` | the same total angle (POSCORRMON) | 6° |
//! | `external` | each external axis, both ways, in its own unit (AXISCORREXT) | 5 |
//!
//! Source: reference/PROTOCOLS.md, section 1.5. Chosen, because it is documented nowhere: where the angle is too large, A, B and
//! C of the correction shrink by one factor until it fits.

use crate::units::radians_from_degrees;
use sim_core::frames::Euler321;

/// Halvings that find the factor: more than a double resolves.
const HALVINGS: u32 = 60;

/// Limits of the corrections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Smallest correction along X, Y, Z, in mm.
    pub lower_mm: [f64; 3],
    /// Largest correction along X, Y, Z, in mm.
    pub upper_mm: [f64; 3],
    /// Largest total rotation, in degrees.
    pub rotation_deg: f64,
    /// Translation beyond which the robot stops, in mm; `None`: the object is not in the signal flow.
    pub stop_translation_mm: Option<f64>,
    /// Rotation beyond which the robot stops, in degrees.
    pub stop_rotation_deg: Option<f64>,
    /// Largest correction of an external axis, either way, in mm or degrees.
    pub external: f64,
}

impl Limits {
    /// As KUKA's own objects have them if nobody sets them.
    pub const KUKA: Limits = Limits {
        lower_mm: [-5.0; 3],
        upper_mm: [5.0; 3],
        rotation_deg: 5.0,
        stop_translation_mm: Some(6.0),
        stop_rotation_deg: Some(6.0),
        external: 5.0,
    };

    /// The correction that POSCORR lets through, for a robot that started at `start` (mm and degrees).
    pub(super) fn pose(&self, start: &[f64; 6], correction: &[f64; 6]) -> [f64; 6] {
        let mut limited = *correction;
        for (value, (lower, upper)) in limited.iter_mut().zip(self.lower_mm.iter().zip(&self.upper_mm)) {
            *value = value.min(*upper).max(*lower);
        }
        let limit_rad = radians_from_degrees(self.rotation_deg);
        if rotation_rad(start, correction) > limit_rad {
            let scaled = |factor: f64| {
                let mut turned = limited;
                turned.iter_mut().skip(3).for_each(|angle_deg| *angle_deg *= factor);
                turned
            };
            let (mut fits, mut exceeds) = (0.0, 1.0);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (fits + exceeds);
                if rotation_rad(start, &scaled(middle)) > limit_rad {
                    exceeds = middle;
                } else {
                    fits = middle;
                }
            }
            limited = scaled(fits);
        }
        limited
    }

    /// The corrections of external axes that AXISCORREXT lets through.
    pub(super) fn external(&self, correction: &[f64; 6]) -> [f64; 6] {
        correction.map(|value| value.min(self.external).max(-self.external))
    }

    /// What POSCORRMON measures, if it is too much: value, limit and unit.
    pub(super) fn too_far(&self, start: &[f64; 6], correction: &[f64; 6]) -> Option<(f64, f64, &'static str)> {
        let [x, y, z, ..] = *correction;
        let translation_mm = (x * x + y * y + z * z).sqrt();
        let rotation_deg = crate::units::degrees_from_radians(rotation_rad(start, correction));
        let beyond = |value: f64, limit: Option<f64>, unit| {
            limit.filter(|&limit| value > limit).map(|limit| (value, limit, unit))
        };
        beyond(translation_mm, self.stop_translation_mm, "mm")
            .or_else(|| beyond(rotation_deg, self.stop_rotation_deg, "deg"))
    }
}

/// Angle between the orientation at the start and the corrected one. A, B and C of a correction add to those of the pose.
fn rotation_rad(start: &[f64; 6], correction: &[f64; 6]) -> f64 {
    let turned = |part: f64| {
        let angle_rad = |axis: usize| radians_from_degrees(start[axis] + part * correction[axis]);
        Euler321 { about_z_rad: angle_rad(3), about_y_rad: angle_rad(4), about_x_rad: angle_rad(5) }.attitude()
    };
    turned(0.0).angle_to(&turned(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(start: [f64; 6], correction: [f64; 6], expected: &str) {
        let limited = Limits::KUKA.pose(&start, &correction);
        let text = limited.map(|value| format!("{value:.9}"));
        assert_eq!(text.join(" ").replace(".000000000", ""), expected);
        // An angle from a quaternion near 1 keeps half the digits of the quaternion at worst.
        let over = rotation_rad(&start, &limited) - radians_from_degrees(5.0);
        assert!(over <= 0.0, "{over}");
    }

    #[test]
    fn the_correction_saturates_exactly_and_each_axis_alone() {
        check([0.0; 6], [1.0, -2.0, 3.0, 0.5, -0.5, 0.25], "1 -2 3 0.500000000 -0.500000000 0.250000000");
        check([0.0; 6], [5.01, -50.0, 3.0, 0.0, 0.0, 0.0], "5 -5 3 0 0 0");
        check([0.0; 6], [0.0, 0.0, 0.0, 0.0, 0.0, -40.0], "0 0 0 0 0 -5");
        // About one axis the start does not matter.
        check([9.0, 9.0, 9.0, 120.0, 0.0, 0.0], [0.0, 0.0, 0.0, 20.0, 0.0, 0.0], "0 0 0 5 0 0");
    }

    /// At B = 90° a turn of A and one of C are about the same axis and may cancel: `R = Rz(A - C)` about it.
    #[test]
    fn the_angle_is_that_of_the_whole_rotation() {
        let start = [0.0, 0.0, 0.0, 0.0, 90.0, 0.0];
        let same = [0.0, 0.0, 0.0, 30.0, 0.0, 30.0];
        assert_eq!(Limits::KUKA.pose(&start, &same).map(f64::to_bits), same.map(f64::to_bits));
        check(start, [0.0, 0.0, 0.0, 10.0, 0.0, -10.0], "0 0 0 2.500000000 0 -2.500000000");
    }

    #[test]
    fn the_monitor_measures_the_length() {
        let far = |correction| Limits::KUKA.too_far(&[0.0; 6], &correction).map(|(_, limit, unit)| (limit, unit));
        assert_eq!(far([3.4, 3.4, 3.4, 0.0, 0.0, 0.0]), None);
        assert_eq!(far([3.5, 3.5, 3.5, 0.0, 0.0, 0.0]), Some((6.0, "mm")));
        assert_eq!(far([0.0, 0.0, 0.0, 0.0, 6.1, 0.0]), Some((6.0, "deg")));
        let none = Limits { stop_translation_mm: None, stop_rotation_deg: None, ..Limits::KUKA };
        assert_eq!(none.too_far(&[0.0; 6], &[1e9; 6]), None);
    }
}
