//! Geometries at places where depth and normal are known by hand, and what is refused. Built under `#[cfg(test)]` alone.

use super::*;
use crate::space::{Axis, AxisMotion, Motion, Path, Spatial, Touch};
use nalgebra::{UnitQuaternion, Vector3};

fn at(x: f64, y: f64, z: f64) -> Motion {
    Motion { position_m: Vector3::new(x, y, z), ..Motion::default() }
}

fn check(geometry: &impl Geometry<Spatial>, motion: &Motion, depth_m: f64, normal: Vector3<f64>) -> Touch {
    let touch = geometry.touch(motion);
    // A few roundings of lengths below a metre.
    assert!((touch.depth_m - depth_m).abs() < 1e-15, "{touch:?} is not {depth_m} deep");
    assert!((touch.normal - normal).norm() < 4e-14, "{touch:?} does not point along {normal:?}");
    assert!((touch.point_m - motion.position_m - touch.arm_m).norm() < 1e-16);
    touch
}

/// Rim 0.2 m, throat 0.05 m, half angle 30°, tip 0.02 m.
fn cone() -> Cone {
    Cone::new(0.2, 0.05, core::f64::consts::FRAC_PI_6, 0.02).unwrap()
}

#[test]
fn a_plane_is_the_same_along_the_axis_and_in_space() {
    let motion = Motion { velocity_m_per_s: Vector3::new(0.01, 0.0, 0.03), ..at(0.3, 0.1, 0.007) };
    let touch = check(&Plane, &motion, 0.007, -Vector3::z());
    let along = Geometry::<Axis>::touch(&Plane, &AxisMotion::moving(0.007, 0.03));
    assert_eq!(touch.along_normal(), along);
    assert_eq!(touch.slip_m_per_s, Vector3::new(0.01, 0.0, 0.0));
}

#[test]
fn the_cone_follows_the_formula_of_the_reference() {
    // reference/PHYSICS.md, section 3.4, with apex A and a = -z (correction 8): the apex is 0.2 / tan 30° behind the rim.
    let (sin, cos) = (0.5, libm::sqrt(3.0) / 2.0);
    let apex_z = 0.2 * cos / sin;
    for (r, z) in [(0.15, 0.05), (0.12, 0.1), (0.1, 0.2), (0.18, 0.03)] {
        let gap_m = (apex_z - z) * sin - r * cos - 0.02;
        check(&cone(), &at(0.6 * r, -0.8 * r, z), -gap_m, Vector3::new(-cos * 0.6, cos * 0.8, -sin));
    }
}

#[test]
fn rim_and_throat_are_circles_and_the_throat_is_open() {
    let depth_z = 0.15 * libm::sqrt(3.0);
    // Before the rim, 3-4-5: 0.03 inward and 0.04 in front of the circle.
    check(&cone(), &at(0.17, 0.0, -0.04), 0.02 - 0.05, Vector3::new(-0.6, 0.0, -0.8));
    // Behind the throat, the other way round.
    check(&cone(), &at(0.0, 0.05 - 0.004, depth_z + 0.003), 0.02 - 0.005, Vector3::new(0.0, -0.8, 0.6));
    // In the middle of the throat, and far behind it: nothing. The tip has passed through.
    assert!(cone().touch(&at(0.0, 0.0, depth_z)).depth_m < 0.0);
    assert!(cone().touch(&at(0.0, 0.0, 1.0)).depth_m < -0.6);
    // A tip that misses meets the plate; one that is through and off the axis is held by its back.
    check(&cone(), &at(0.3, 0.0, -0.015), 0.005, -Vector3::z());
    check(&cone(), &at(0.1, 0.0, depth_z + 0.019), 0.001, Vector3::z());
}

/// Once round each circle in the half plane, through face, circle, plate and wall: a distance changes by no more than the way.
#[test]
fn a_walk_round_rim_or_throat_meets_no_step() {
    let peg = Peg::new(0.05, 0.3, 0.045, 0.4).unwrap();
    // The last number is the depth beyond which the doc promises nothing: the middle line of the peg is inside the wall.
    let places: [(&dyn Geometry<Spatial>, f64, f64, f64); 5] = [
        (&cone(), 0.2, 0.0, 1.0),
        (&cone(), 0.05, 0.15 * libm::sqrt(3.0), 1.0),
        (&peg, 0.05, 0.0, 0.045),
        (&peg, 0.05, 0.3, 0.045),
        (&Ring::new(0.6, 0.03, 0.02).unwrap(), 0.6, 0.0, 1.0),
    ];
    let steps = 20_000;
    for (geometry, circle_m, z, deepest_m) in places {
        for away_m in [0.001, 0.01, 0.03] {
            let step_m = core::f64::consts::TAU * away_m / f64::from(steps);
            let depth_m = |i: i32| {
                let (sin, cos) = libm::sincos(core::f64::consts::TAU * f64::from(i) / f64::from(steps));
                geometry.touch(&at(circle_m + away_m * cos, 0.0, z + away_m * sin)).depth_m
            };
            for i in 0..steps {
                // Lengths below a metre are rounded a few times.
                let (here_m, there_m) = (depth_m(i), depth_m(i + 1));
                let jump_m = (there_m - here_m).abs();
                assert!(
                    here_m.max(there_m) > deepest_m || jump_m <= step_m + 1e-15,
                    "{jump_m} m over {step_m} m, {away_m} m from {circle_m} m"
                );
            }
        }
    }
}

#[test]
fn on_the_axis_the_nearest_side_is_the_one_ahead() {
    let motion = Motion { velocity_m_per_s: Vector3::new(0.0, 0.03, 0.01), ..at(0.0, 0.0, 0.1) };
    let touch = cone().touch(&motion);
    let later = cone().touch(&motion.coasted(0.5));
    // The depth is linear along this way: the rate is the difference quotient, up to rounding over half a second.
    assert!((touch.rate_m_per_s - (later.depth_m - touch.depth_m) / 0.5).abs() < 1e-15, "{touch:?}");
    assert!(touch.normal.y < 0.0 && cone().touch(&at(0.0, 0.0, 0.1)).normal.x < 0.0);
    let wide = Cone::new(0.2, 0.05, 0.5, 0.08).unwrap().touch(&at(0.0, 0.0, 0.25));
    assert!(wide.depth_m > 0.0 && (wide.normal.norm() - 1.0).abs() < 1e-15, "wider than the throat, it rests on it");
}

#[test]
fn a_ring_is_met_from_all_sides() {
    let ring = Ring::new(0.6, 0.03, 0.02).unwrap();
    check(&ring, &at(0.6, 0.0, -0.045), 0.005, -Vector3::z());
    check(&ring, &at(0.0, 0.6 - 0.024, -0.032), 0.01, Vector3::new(0.0, -0.6, -0.8));
    check(&ring, &at(0.66, 0.0, 0.0), -0.01, Vector3::x());
    check(&ring, &at(0.6, 0.0, 0.0), 0.05, -Vector3::z());
}

#[test]
fn a_straight_peg_slides_on_the_wall_and_a_tilted_one_leans_on_the_rim() {
    let peg = Peg::new(0.05, 0.3, 0.045, 0.4).unwrap();
    // Straight, 6 mm off the axis: 1 mm into the wall, over the whole length.
    let touch = check(&peg, &at(0.006, 0.0, 0.1), 0.001, -Vector3::x());
    assert!((touch.arm_m.x - 0.045).abs() < 1e-15);
    // Tilted about +y by asin 0.1, nose on the axis: the line crosses the rim's plane 0.1/cos behind. Nearest to the rim there is
    // the foot of the perpendicular, at distance cos · (R - 0.1 tan).
    let (sin, cos) = (0.1, libm::sqrt(0.99));
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::y() * -libm::asin(sin));
    let motion = Motion { attitude: tilt, ..at(0.0, 0.0, 0.1) };
    let distance_m = cos * (0.05 - 0.1 * sin / cos);
    let touch = peg.touch(&motion);
    assert!((touch.depth_m - (0.045 - distance_m)).abs() < 1e-15, "{touch:?}");
    assert!((touch.normal - Vector3::new(-cos, 0.0, -sin)).norm() < 1e-12, "{touch:?}");
    assert!(touch.arm_m.norm() > 0.1, "the arm of the force is the way back to the rim");
    assert!(touch.normal.dot(&(tilt * Vector3::z())).abs() < 1e-12, "it stands on the shaft");
    // Through the plate, the rear rim counts too: the tilted line is 0.4 tan off the axis at the front, 0.1 tan at the back.
    let through = peg.touch(&Motion { attitude: tilt.inverse(), ..at(0.02, 0.0, 0.4) });
    assert!(through.depth_m > 0.0 && through.normal.x.abs() > 0.9, "{through:?}");
    let short = Peg::new(0.05, 0.3, 0.045, 0.01).unwrap().touch(&motion);
    assert!(short.depth_m < touch.depth_m, "a shaft that ends before the rim does not lean on it");
}

/// Turned by a right angle about y and shifted: what was along z is along x. Rate and slip of the same motion agree.
#[test]
fn a_geometry_in_another_place_is_the_same_geometry() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * core::f64::consts::FRAC_PI_2);
    let origin_m = Vector3::new(0.1, -0.2, 0.3);
    let placed = Placed::new(cone(), origin_m, turn).unwrap();
    let here = Motion {
        velocity_m_per_s: Vector3::new(0.01, -0.02, 0.03),
        rate_rad_per_s: Vector3::new(0.3, 0.1, -0.2),
        ..at(0.12, 0.05, 0.1)
    };
    let there = Motion {
        position_m: origin_m + turn * here.position_m,
        attitude: turn * here.attitude,
        velocity_m_per_s: turn * here.velocity_m_per_s,
        rate_rad_per_s: turn * here.rate_rad_per_s,
        ..here
    };
    let (bare, touch) = (cone().touch(&here), placed.touch(&there));
    // Rotations to and fro of lengths below a metre.
    assert!((touch.depth_m - bare.depth_m).abs() < 1e-15 && (touch.rate_m_per_s - bare.rate_m_per_s).abs() < 1e-16);
    for (seen, expected) in
        [(touch.normal, bare.normal), (touch.arm_m, bare.arm_m), (touch.slip_m_per_s, bare.slip_m_per_s)]
    {
        assert!((seen - turn * expected).norm() < 1e-14, "{seen:?} {expected:?}");
    }
    assert!((touch.point_m - there.position_m - touch.arm_m).norm() < 1e-15);
    // A tilted plane pushes by the sine of its tilt across the axis.
    let tilted = Placed::new(Plane, Vector3::zeros(), UnitQuaternion::from_scaled_axis(Vector3::y() * 0.02)).unwrap();
    assert!((tilted.touch(&at(0.0, 0.0, 0.005)).normal.x + libm::sin(0.02)).abs() < 1e-16);
    assert!(Placed::new(Plane, Vector3::new(f64::NAN, 0.0, 0.0), turn).is_err());
}

#[test]
fn what_cannot_be_built_is_refused() {
    assert!(Cone::new(0.2, 0.2, 0.5, 0.02).is_err() && Cone::new(0.2, 0.0, 0.5, 0.02).is_err());
    assert!(Cone::new(0.2, 0.05, 0.0, 0.02).is_err() && Cone::new(0.2, 0.05, 1.6, 0.02).is_err());
    assert!(Cone::new(0.2, 0.05, 0.5, -0.02).is_err() && Cone::new(f64::NAN, 0.05, 0.5, 0.02).is_err());
    assert!(Peg::new(0.05, 0.3, 0.05, 0.4).is_err() && Peg::new(0.05, -0.3, 0.04, 0.4).is_err());
    assert!(Peg::new(0.05, 0.3, 0.0, 0.4).is_err() && Peg::new(0.05, 0.3, 0.04, -0.1).is_err());
    assert!(Ring::new(0.6, 0.6, 0.02).is_err() && Ring::new(-0.6, 0.1, 0.02).is_err());
}
