//! A compliance device: springs between a base and a platform, preloaded or not (thesis 5.3; reference/PHYSICS.md, section 3.3).
//!
//! `K = Σ Jᵀ [k l lᵀ + (T/len) (I - l lᵀ)] J + blkdiag(0, Σ (F·p) I - (F pᵀ + p Fᵀ)/2)`, `J = [I, -[p]×]`, `F = -T l`
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k | stiffness of a spring | N/m |
//! | p | its end on the platform, from the reference point | m |
//! | l, len | unit vector from base to platform along it; length at rest of the device | 1, m |
//! | T | tension, `k (len - len₀)`; negative when pressed | N |
//! | F | its force on the platform | N |
//!
//! K is the second derivative of the springs' energy, with the turn as a rotation vector. `Jᵀ k l lᵀ J` alone, which is often all
//! that is computed, leaves the preload out: pressed springs soften the device across themselves, down to below zero. So K is to
//! be measured, not only computed. If the springs do not balance at rest, [`ComplianceDevice::wrench`] says what holds it.
//!
//! Not modelled: mass, friction in the guides, stops, springs that bend. A spring of negative stiffness (a disc past its peak) has a
//! meaning, and is answered.

use super::StiffnessTensor;
use crate::refusal::{self, Refusal};
use crate::space::Wrench;
use alloc::vec::Vec;
use nalgebra::{Matrix3, Matrix3x6, Matrix6, UnitQuaternion, Vector3};

/// One spring; both ends in the frame of the device at rest, from the reference point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// End on the base.
    pub base_m: Vector3<f64>,
    /// End on the platform.
    pub platform_m: Vector3<f64>,
    /// Stiffness k.
    pub stiffness_n_per_m: f64,
    /// Length at which it does not push: longer than at rest if it is pressed.
    pub free_length_m: f64,
}

/// Springs between a base and a platform.
#[derive(Debug, Clone, PartialEq)]
pub struct ComplianceDevice {
    springs: Vec<Spring>,
}

impl ComplianceDevice {
    /// A device of these springs, at rest.
    pub fn new(springs: Vec<Spring>) -> Result<Self, Refusal> {
        if springs.is_empty() {
            return Err(Refusal { name: "springs", value: 0.0, unit: "springs", limit: "is not above 0" });
        }
        for spring in &springs {
            refusal::positive("length_m", (spring.platform_m - spring.base_m).norm(), "m")?;
            refusal::finite("stiffness_n_per_m", spring.stiffness_n_per_m, "N/m")?;
            refusal::not_negative("free_length_m", spring.free_length_m, "m")?;
        }
        Ok(ComplianceDevice { springs })
    }

    /// The stiffness about the reference point, with the preload.
    pub fn stiffness(&self) -> StiffnessTensor {
        self.sum(|spring| spring.stiffness(spring.tension_n()))
    }

    /// What it would be if no spring were preloaded: the difference to [`ComplianceDevice::stiffness`] is the preload's.
    pub fn stiffness_without_preload(&self) -> StiffnessTensor {
        self.sum(|spring| spring.stiffness(0.0))
    }

    /// What the springs exert on the platform at rest, about the reference point: zero if they balance.
    pub fn wrench(&self) -> Wrench {
        self.springs.iter().fold(Wrench::default(), |sum, spring| {
            let force_n = spring.force_n();
            sum + Wrench { force_n, torque_n_m: spring.platform_m.cross(&force_n) }
        })
    }

    /// Energy in the springs with the platform moved by `shift_m` and turned by the rotation vector `turn_rad`.
    pub fn energy_j(&self, shift_m: &Vector3<f64>, turn_rad: &Vector3<f64>) -> f64 {
        let turn = UnitQuaternion::from_scaled_axis(*turn_rad);
        self.springs.iter().map(|spring| spring.energy_j(&(turn * spring.platform_m + shift_m))).sum()
    }

    fn sum(&self, part: impl Fn(&Spring) -> Matrix6<f64>) -> StiffnessTensor {
        StiffnessTensor(self.springs.iter().fold(Matrix6::zeros(), |sum, spring| sum + part(spring)))
    }
}

impl Spring {
    fn length_m(&self) -> f64 {
        (self.platform_m - self.base_m).norm()
    }

    fn tension_n(&self) -> f64 {
        self.stiffness_n_per_m * (self.length_m() - self.free_length_m)
    }

    fn direction(&self) -> Vector3<f64> {
        (self.platform_m - self.base_m) / self.length_m()
    }

    fn force_n(&self) -> Vector3<f64> {
        self.direction() * -self.tension_n()
    }

    fn energy_j(&self, platform_m: &Vector3<f64>) -> f64 {
        let stretch_m = (platform_m - self.base_m).norm() - self.free_length_m;
        0.5 * self.stiffness_n_per_m * stretch_m * stretch_m
    }

    /// What the spring adds to K when it carries this tension.
    fn stiffness(&self, tension_n: f64) -> Matrix6<f64> {
        let (l, p) = (self.direction(), &self.platform_m);
        let along = l * l.transpose();
        let across = Matrix3::identity() - along;
        let end = along * self.stiffness_n_per_m + across * (tension_n / self.length_m());
        let mut lever = Matrix3x6::zeros();
        lever.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        lever.fixed_view_mut::<3, 3>(0, 3).copy_from(&-p.cross_matrix());
        let mut stiffness = lever.transpose() * end * lever;
        let force_n = l * -tension_n;
        let outer = force_n * p.transpose();
        let turning = Matrix3::identity() * force_n.dot(p) - (outer + outer.transpose()) * 0.5;
        let mut block = stiffness.fixed_view_mut::<3, 3>(3, 3);
        block += turning;
        stiffness
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Principal;
    use alloc::vec;

    /// Springs that stand upright on a circle of 0.1 m, 0.19 m long, pressed by `press` of their free length.
    fn upright(count: usize, press: f64) -> ComplianceDevice {
        let spring = |i: usize| {
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * i as f64 / count as f64);
            let base_m = Vector3::new(0.1 * cos, 0.1 * sin, -0.19);
            let platform_m = Vector3::new(0.1 * cos, 0.1 * sin, 0.0);
            Spring { base_m, platform_m, stiffness_n_per_m: 500.0, free_length_m: 0.19 / (1.0 - press) }
        };
        ComplianceDevice::new((0..count).map(spring).collect()).unwrap()
    }

    /// Upright springs alone hold nothing sideways; pressed, each pushes its end away with T / len, here 500 · 0.05 / 0.95 N/m.
    #[test]
    fn pressed_springs_push_sideways_and_it_is_reported() {
        let device = upright(3, 0.05);
        let sideways = -3.0 * 500.0 * (0.05 / 0.95);
        let stiffness = device.stiffness();
        for axis in 0..2 {
            assert!((stiffness.0[(axis, axis)] - sideways).abs() < 1e-10, "{}", stiffness.0);
            assert!(device.stiffness_without_preload().0[(axis, axis)].abs() < 1e-10);
        }
        assert!((stiffness.0[(2, 2)] - 1500.0).abs() < 1e-10, "along the springs the preload changes nothing");
        let reported: Vec<Principal> = stiffness.negative(0.1).unwrap().collect();
        // Both shifts across, and the turn about the springs.
        assert_eq!(reported.len(), 3, "{reported:?}");
        assert!(reported.iter().all(|direction| direction.shift.z.abs() < 1e-9));
        let words = alloc::format!("{}", reported[0]);
        assert!(words.starts_with('-') && words.contains("N/m along"), "{words}");
        assert_eq!(upright(3, -0.05).stiffness().negative(0.1).unwrap().count(), 0, "stretched, they hold");
        assert!(stiffness.negative(0.0).is_err());
    }

    /// Half the force of a pair of springs at rest: pressed against each other they balance, and there is nothing to hold.
    #[test]
    fn the_wrench_at_rest_is_what_the_springs_leave_open() {
        let spring = |side: f64| Spring {
            base_m: Vector3::new(0.0, 0.02, side * 0.2),
            platform_m: Vector3::new(0.0, 0.02, side * 0.05),
            stiffness_n_per_m: 800.0,
            free_length_m: 0.16,
        };
        let balanced = ComplianceDevice::new(vec![spring(1.0), spring(-1.0)]).unwrap().wrench();
        assert!(balanced.force_n.norm() < 1e-12 && balanced.torque_n_m.norm() < 1e-12);
        let open = ComplianceDevice::new(vec![spring(-1.0)]).unwrap().wrench();
        // 10 mm of 800 N/m, upwards, 20 mm beside the reference point.
        assert!((open.force_n - Vector3::new(0.0, 0.0, 8.0)).norm() < 1e-12);
        assert!((open.torque_n_m - Vector3::new(0.16, 0.0, 0.0)).norm() < 1e-12);
    }

    /// The same springs, told from another point and in other axes. One more spring takes up the force that the others leave open,
    /// since a held device has another stiffness about another point.
    #[test]
    fn a_tensor_can_be_carried_to_the_probe_tip() {
        let mut springs = upright(3, 0.05).springs;
        springs[1].platform_m.x += 0.03;
        let open_n = ComplianceDevice::new(springs.clone()).unwrap().wrench().force_n;
        let platform_m = Vector3::new(0.02, -0.01, 0.04);
        let base_m = platform_m + open_n.normalize() * 0.1;
        // It pushes back with 0.02 m of what it takes.
        springs.push(Spring { base_m, platform_m, stiffness_n_per_m: open_n.norm() / 0.02, free_length_m: 0.12 });
        let device = ComplianceDevice::new(springs.clone()).unwrap();
        assert!(device.wrench().force_n.norm() < 1e-12);

        let (to_m, turn) = (Vector3::new(0.1, 0.2, 0.5), UnitQuaternion::from_euler_angles(0.3, -0.2, 0.9));
        let moved = springs.iter().map(|spring| Spring {
            base_m: turn * (spring.base_m - to_m),
            platform_m: turn * (spring.platform_m - to_m),
            ..*spring
        });
        let direct = ComplianceDevice::new(moved.collect()).unwrap().stiffness().0;
        let carried = device.stiffness().about(&to_m).turned(&turn).0;
        // Some forty products of entries up to the largest.
        assert!((direct - carried).abs().max() < 64.0 * f64::EPSILON * direct.abs().max(), "{}", direct - carried);
    }

    #[test]
    fn a_device_without_springs_or_without_length_is_refused() {
        let spring = Spring {
            base_m: Vector3::zeros(),
            platform_m: Vector3::z(),
            stiffness_n_per_m: -159.0,
            free_length_m: 1.0,
        };
        assert!(ComplianceDevice::new(vec![spring]).is_ok(), "a disc spring past its peak has a negative stiffness");
        assert!(ComplianceDevice::new(vec![]).is_err());
        assert!(ComplianceDevice::new(vec![Spring { platform_m: Vector3::zeros(), ..spring }]).is_err());
        assert!(ComplianceDevice::new(vec![Spring { stiffness_n_per_m: f64::NAN, ..spring }]).is_err());
        assert!(ComplianceDevice::new(vec![Spring { free_length_m: -1.0, ..spring }]).is_err());
    }
}
