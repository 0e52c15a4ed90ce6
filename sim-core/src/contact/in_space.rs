//! Laws in space: the lift, friction, and a device that yields differently along each axis. Built under `#[cfg(test)]` alone.

use super::*;
use crate::rng::{Stream, Streams};
use crate::space::{Axis, Spatial, Touch, Wrench};
use nalgebra::{Matrix6, Vector3, Vector6};

fn vector(random: &mut Stream) -> Vector3<f64> {
    Vector3::new(random.normal(), random.normal(), random.normal())
}

/// A touch of a body that moves with `velocity` and `turn` at the probe tip.
fn touch(normal: Vector3<f64>, arm_m: Vector3<f64>, depth_m: f64, velocity: Vector3<f64>, turn: Vector3<f64>) -> Touch {
    let at_point = velocity + turn.cross(&arm_m);
    let rate_m_per_s = -normal.dot(&at_point);
    Touch { depth_m, rate_m_per_s, normal, point_m: arm_m, arm_m, slip_m_per_s: at_point + normal * rate_m_per_s }
}

fn interface(law: &impl ContactLaw<Spatial>, touch: &Touch) -> Wrench {
    law.clamped(touch, &law.force(touch))
}

fn cases(mut check: impl FnMut(Touch, Vector3<f64>, Vector3<f64>)) {
    let mut random = Streams::new(3).named("test/contact-in-space");
    for _ in 0..2_000 {
        let (velocity, turn) = (vector(&mut random) * 0.03, vector(&mut random) * 0.2);
        let (normal, arm_m) = (vector(&mut random).normalize(), vector(&mut random) * 0.05);
        check(touch(normal, arm_m, 0.005 * random.normal(), velocity, turn), velocity, turn);
    }
}

/// Power of a wrench on a body is what the scalar law says of depth and rate: `F·v + M·ω = -f d'`.
#[test]
fn a_law_in_space_does_the_work_of_the_law_along_the_normal() {
    let law = SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 40.0, sides: Sides::One };
    let (mut pressed, mut free) = (0, 0);
    cases(|touch, velocity, turn| {
        let wrench = interface(&law, &touch);
        let along = touch.along_normal();
        let force_n = ContactLaw::<Axis>::clamped(&law, &along, &law.resistance(&along));
        let power_w = wrench.force_n.dot(&velocity) + wrench.torque_n_m.dot(&turn);
        // A dozen roundings of products of the size of force times speed.
        let size_w = force_n * (velocity.norm() + turn.norm() * touch.arm_m.norm());
        assert!((power_w + force_n * touch.rate_m_per_s).abs() <= 32.0 * f64::EPSILON * size_w);
        assert!(force_n >= 0.0 && wrench.force_n.dot(&touch.normal) >= 0.0, "it never pulls");
        if force_n > 0.0 { pressed += 1 } else { free += 1 }
    });
    assert!(pressed > 500 && free > 500, "{pressed} {free}");
}

#[test]
fn friction_takes_energy_opposes_the_slip_and_is_bounded_by_the_coefficient() {
    let bare = SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 40.0, sides: Sides::Two };
    let law = Friction::new(bare, 0.2, SMOOTHING_M_PER_S).unwrap();
    cases(|touch, velocity, turn| {
        let added = interface(&law, &touch) - interface(&bare, &touch);
        let normal_n = interface(&bare, &touch).force_n.norm();
        let power_w = added.force_n.dot(&velocity) + added.torque_n_m.dot(&turn);
        // Of the two interfaces' difference: roundings of the size of the normal force.
        let rounding_n = 16.0 * f64::EPSILON * normal_n;
        assert!(power_w <= rounding_n * (velocity.norm() + turn.norm() * touch.arm_m.norm()), "{power_w}");
        assert!(added.force_n.norm() <= 0.2 * normal_n + rounding_n);
        assert!(added.force_n.dot(&touch.normal).abs() <= 2.0 * rounding_n, "it acts across the normal");
        assert!((added.torque_n_m - touch.arm_m.cross(&added.force_n)).norm() <= rounding_n);
        let speed = touch.slip_m_per_s.norm();
        let expected_n = 0.2 * normal_n * speed / libm::sqrt(speed * speed + SMOOTHING_M_PER_S * SMOOTHING_M_PER_S);
        assert!((added.force_n.norm() - expected_n).abs() <= 2.0 * rounding_n);
    });
    assert!(Friction::new(bare, -0.1, 1e-3).is_err() && Friction::new(bare, 0.1, 0.0).is_err());
}

#[test]
fn nothing_is_felt_outside_contact() {
    let bare = SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 40.0, sides: Sides::One };
    let law = Friction::new(bare, 0.2, SMOOTHING_M_PER_S).unwrap();
    let slip = Vector3::new(0.1, 0.0, 0.2);
    let away = touch(-Vector3::z(), Vector3::zeros(), -1e-9, slip, Vector3::zeros());
    assert_eq!(interface(&law, &away), Wrench::default());
    let pulled = touch(-Vector3::z(), Vector3::zeros(), 1e-3, Vector3::new(0.1, 0.0, -0.2), Vector3::zeros());
    assert_eq!(interface(&law, &pulled), Wrench::default(), "40 N s/m · 0.2 m/s is more than 1066 N/m · 1 mm");
    let sticky = SpringDashpot { sides: Sides::OnePulling, ..bare };
    // Force on the chaser: -z pushes it out, +z holds it back. 8 N of damping, less 1.066 N of spring.
    assert!((interface(&sticky, &pulled).force_n.z - 6.934).abs() < 1e-12);
}

/// A device with six axes of their own: compliances along the wrench `G = [n; arm × n]` add up, each by its share squared.
#[test]
fn a_device_is_as_soft_as_its_axes_along_the_wrench() {
    let axes = Vector6::new(400.0, 600.0, 1000.0, 30.0, 20.0, 50.0);
    let device = StiffnessTensor(Matrix6::from_diagonal(&axes));
    let law = DeviceContact::new(&device, 0.02, Sides::One).unwrap();
    cases(|touch, _, _| {
        let lever = touch.arm_m.cross(&touch.normal);
        let compliance: f64 = (0..3).map(|i| touch.normal[i] * touch.normal[i] / axes[i]).sum::<f64>()
            + (0..3).map(|i| lever[i] * lever[i] / axes[i + 3]).sum::<f64>();
        let stiffness = law.stiffness_n_per_m(&touch);
        assert!((stiffness * compliance - 1.0).abs() < 64.0 * f64::EPSILON);
        let wrench = interface(&law, &touch);
        let force_n = (stiffness * (touch.depth_m + 0.02 * touch.rate_m_per_s)).max(0.0);
        let expected = if touch.depth_m > 0.0 { touch.pushed(force_n) } else { Wrench::default() };
        assert!((wrench.force_n - expected.force_n).norm() <= 32.0 * f64::EPSILON * (1.0 + force_n));
    });
    assert!(DeviceContact::new(&StiffnessTensor(Matrix6::zeros()), 0.0, Sides::One).is_err());
}

/// What the doc says is not modelled, in numbers: pressed where the device is stiff, slid to where it is soft, let go.
#[test]
fn a_slide_from_stiff_to_soft_loses_the_difference_of_the_stored_energies() {
    let device = StiffnessTensor(Matrix6::from_diagonal(&Vector6::new(400.0, 600.0, 1000.0, 30.0, 20.0, 50.0)));
    let law = DeviceContact::new(&device, 0.0, Sides::One).unwrap();
    let work_j = |normal: Vector3<f64>| {
        let steps = 1000;
        let force_n = |i: f64| {
            let depth_m = 0.01 * i / f64::from(steps);
            interface(&law, &touch(normal, Vector3::zeros(), depth_m, Vector3::zeros(), Vector3::zeros()))
                .force_n
                .norm()
        };
        // The force is linear in the depth: the midpoint rule is exact.
        (0..steps).map(|i| force_n(f64::from(i) + 0.5) * 0.01 / f64::from(steps)).sum::<f64>()
    };
    // At constant depth the normal force does no work while the normal turns from y to x.
    let lost_j = work_j(Vector3::y()) - work_j(Vector3::x());
    assert!((lost_j - 0.5 * (600.0 - 400.0) * 1e-4).abs() < 1e-12, "{lost_j}");
}
