//! Calibration of a force/torque sensor and its tool from poses at rest.
//!
//! At rest the sensor feels its bias and the weight of the tool. Turned through enough attitudes, the two separate:
//!
//! ```text
//! f = (1 + S) w + c_f + k_f ΔT,    τ = r × w + Q w + c_τ + k_τ ΔT,    w = m D(α) γ,   γ = R(q)ᵀ g
//! ```
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | f, τ | mean reading of one pose, force and torque on the tool, in the sensor's own axes S | N, N m | recording |
//! | γ | gravity in the nominal axes S₀ of the sensor | m/s² | pose of the robot |
//! | D(α) | turns S₀ into S: rotation vector α, the misalignment | rad | estimated |
//! | m, r | mass of the tool; its centre of mass from the sensor's origin, in S | kg, m | estimated |
//! | c_f, c_τ | bias | N, N m | estimated |
//! | S | crosstalk between forces that a weight can show: symmetric, without trace (5 numbers) | 1 | estimated on request |
//! | Q | crosstalk from force to torque that a weight can show: symmetric (6 numbers) | m | estimated on request |
//! | k_f, k_τ | drift of the bias with temperature | N/K, N m/K | estimated on request |
//! | ΔT | temperature less a reference | K | given |
//!
//! The other entries of a full crosstalk matrix look like something else under weight alone: the trace of S like m, its
//! antisymmetric part like α, that of Q like r, and whatever a torque causes needs a second tool. A matrix from a data sheet is
//! taken out of the readings first ([`decoupled`]).
//!
//! The estimate: a closed-form start ([`start`]), then an iterative batch of weighted least squares
//! `x ← x + (Hᵀ R⁻¹ H)⁻¹ Hᵀ R⁻¹ (z - h(x))`, `P = (Hᵀ R⁻¹ H)⁻¹` ([`batch`]), what the poses could not show
//! ([`observability`]), and what is left ([`residuals`]). Sources: reference/PHYSICS.md, section 5.
//!
//! Not modelled: motion (every pose is at rest), an error of the robot's own attitude, elastic sag of the tool, hysteresis.

pub mod batch;
pub mod measurement;
pub mod observability;
pub mod residuals;
pub mod start;

pub use batch::{Calibration, Noise, Unsolved, calibrate};
pub use measurement::{Parameters, StaticPose, Terms, decoupled};
pub use observability::{Observability, observe};
pub use residuals::{AxisResidual, Pattern, Shape, patterns};

/// Synthetic sensors whose truth is written out here, not by the code under test.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, Streams};
    use alloc::vec::Vec;
    use nalgebra::Vector3;

    const G: f64 = 9.80665;
    const NOISE: Noise = Noise { force_sigma_n: 0.25, torque_sigma_n_m: 0.02 };
    const BIAS: [f64; 6] = [1.2, -0.7, 2.1, 0.05, -0.02, 0.01];
    const MASS_KG: f64 = 12.0;
    const CENTRE_M: [f64; 3] = [0.01, -0.02, 0.12];
    /// One degree about an axis that is none of the sensor's.
    const TURN_RAD: [f64; 3] = [0.010, -0.012, 0.008];

    /// v turned by a rotation vector, by Rodrigues' formula.
    fn turned(by: [f64; 3], v: [f64; 3]) -> [f64; 3] {
        let angle = libm::sqrt(by[0] * by[0] + by[1] * by[1] + by[2] * by[2]);
        let axis = by.map(|part| part / angle.max(1e-300));
        let (sin, cos) = libm::sincos(angle);
        let dot = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
        let cross = cross(axis, v);
        core::array::from_fn(|i| v[i] * cos + cross[i] * sin + axis[i] * dot * (1.0 - cos))
    }

    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    /// A reading: weight turned by the misalignment, its torque, bias, noise.
    fn read(down: [f64; 3], turn_rad: [f64; 3], stream: &mut Stream, noise: Noise) -> StaticPose {
        let weight = turned(turn_rad, down).map(|part| part * MASS_KG);
        let torque = cross(CENTRE_M, weight);
        let force: [f64; 3] = core::array::from_fn(|i| weight[i] + BIAS[i] + noise.force_sigma_n * stream.normal());
        let torque: [f64; 3] =
            core::array::from_fn(|i| torque[i] + BIAS[i + 3] + noise.torque_sigma_n_m * stream.normal());
        StaticPose {
            gravity_m_per_s2: Vector3::from(down),
            force_n: Vector3::from(force),
            torque_n_m: Vector3::from(torque),
            warmer_k: 0.0,
        }
    }

    /// Directions of gravity of random attitudes.
    fn random_directions(count: usize, stream: &mut Stream) -> Vec<[f64; 3]> {
        let one = |_| {
            let v: [f64; 3] = core::array::from_fn(|_| stream.normal());
            let length = libm::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            v.map(|part| part * G / length)
        };
        (0..count).map(one).collect()
    }

    /// A sweep about x, from -half to +half of this angle about gravity along -y.
    fn sweep(count: usize, half_rad: f64) -> Vec<[f64; 3]> {
        let one = |nth: usize| {
            let angle = half_rad * (2.0 * nth as f64 / (count - 1) as f64 - 1.0);
            [0.0, -G * libm::cos(angle), G * libm::sin(angle)]
        };
        (0..count).map(one).collect()
    }

    fn poses(directions: &[[f64; 3]], stream: &mut Stream, noise: Noise) -> Vec<StaticPose> {
        directions.iter().map(|down| read(*down, TURN_RAD, stream, noise)).collect()
    }

    /// Estimate less truth, in the order of the estimate. The misalignment as the small turn from truth to estimate.
    fn error(calibration: &Calibration) -> [f64; 13] {
        let found = &calibration.parameters;
        let truth = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::from(TURN_RAD));
        let turn = (found.alignment * truth.inverse()).scaled_axis();
        core::array::from_fn(|nth| match nth {
            0..3 => found.bias_force_n[nth] - BIAS[nth],
            3..6 => found.bias_torque_n_m[nth - 3] - BIAS[nth],
            6 => found.mass_kg - MASS_KG,
            7..10 => found.centre_m[nth - 7] - CENTRE_M[nth - 7],
            _ => turn[nth - 10],
        })
    }

    fn quiet() -> Stream {
        Streams::new(1).named("quiet")
    }

    /// Without noise the closed-form start is the answer: what is left is rounding.
    #[test]
    fn without_noise_the_start_is_the_answer() {
        let none = Noise { force_sigma_n: 0.0, torque_sigma_n_m: 0.0 };
        for directions in [random_directions(36, &mut quiet()), sweep(36, 1.0), sweep(3, 1.5)] {
            let poses = poses(&directions, &mut quiet(), none);
            let found = calibrate(&poses, NOISE, Terms::USUAL).unwrap();
            let worst = error(&found).iter().fold(0.0_f64, |most, part| most.max(part.abs()));
            // Rounding of 1e-16 × 118 N, through a sweep that is ten times worse conditioned.
            assert!(worst < 1e-11, "{worst}");
            assert_eq!(found.steps.len(), 1, "{:?}", found.steps);
        }
    }

    /// The covariance is what repeated calibrations scatter with: eᵀ P⁻¹ e follows χ² with 13 degrees of freedom. Its mean over N
    /// repeats has the standard deviation √(26/N); one in twenty exceeds 22.362. Four standard deviations each.
    #[test]
    fn thirty_six_poses_are_recovered_within_the_stated_covariance() {
        const REPEATS: usize = 400;
        let (mut sum, mut beyond, mut squares) = (0.0, 0, [0.0; 13]);
        for seed in 0..REPEATS {
            let mut stream = Streams::new(seed as u64).named("calibration");
            let directions = random_directions(36, &mut stream);
            let found = calibrate(&poses(&directions, &mut stream, NOISE), NOISE, Terms::USUAL).unwrap();
            assert!(found.steps.len() <= 4, "seed {seed}: {:?}", found.steps);
            let error = nalgebra::DVector::from_column_slice(&error(&found));
            let weight = found.covariance.clone().try_inverse().unwrap();
            let distance = error.dot(&(weight * &error));
            sum += distance;
            beyond += usize::from(distance > 22.362);
            for (square, (part, deviation)) in squares.iter_mut().zip(error.iter().zip(found.deviations())) {
                *square += (part / deviation) * (part / deviation);
            }
        }
        let count = REPEATS as f64;
        assert!((sum / count - 13.0).abs() < 4.0 * libm::sqrt(26.0 / count), "{}", sum / count);
        let expected = 0.05 * count;
        assert!((beyond as f64 - expected).abs() < 4.0 * libm::sqrt(0.95 * expected), "{beyond} of {count}");
        // Each number alone: its mean square over the stated one has the standard deviation √(2/N).
        for (nth, square) in squares.iter().enumerate() {
            assert!((square / count - 1.0).abs() < 4.0 * libm::sqrt(2.0 / count), "{nth}: {}", square / count);
        }
    }

    /// A large misalignment is no obstacle: the start finds it.
    #[test]
    fn a_sensor_mounted_upside_down_is_calibrated() {
        let mut stream = quiet();
        let turn = [2.0, -1.5, 1.0];
        let poses: Vec<StaticPose> =
            random_directions(36, &mut stream).iter().map(|down| read(*down, turn, &mut stream, NOISE)).collect();
        let found = calibrate(&poses, NOISE, Terms::USUAL).unwrap();
        assert!(found.steps.len() <= 4, "{:?}", found.steps);
        let truth = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        // Five standard deviations of the misalignment.
        let most = 5.0 * found.deviations()[10..].iter().fold(0.0_f64, |most, part| most.max(*part));
        assert!((found.parameters.alignment * truth.inverse()).angle() < most);
    }

    #[test]
    fn fewer_than_three_distinct_directions_are_refused() {
        let mut directions = sweep(2, 0.5);
        directions.extend(sweep(2, 0.501));
        let four = poses(&directions, &mut quiet(), NOISE);
        assert_eq!(calibrate(&four, NOISE, Terms::USUAL), Err(Unsolved::Directions { found: 2 }));
        assert_eq!(calibrate(&[], NOISE, Terms::USUAL), Err(Unsolved::Directions { found: 0 }));
        let three = poses(&sweep(3, 0.5), &mut quiet(), NOISE);
        assert!(calibrate(&three, NOISE, Terms::USUAL).is_ok(), "three in one plane are enough");
    }

    #[test]
    fn what_the_poses_do_not_show_is_named() {
        let terms = Terms { crosstalk: true, ..Terms::USUAL };
        let flat = poses(&sweep(36, 3.0), &mut quiet(), NOISE);
        assert!(matches!(calibrate(&flat, NOISE, terms), Err(Unsolved::Unobservable { .. })), "one plane of gravity");
        let terms = Terms { temperature: true, ..Terms::USUAL };
        let cold = poses(&random_directions(36, &mut quiet()), &mut quiet(), NOISE);
        let refused = calibrate(&cold, NOISE, terms);
        assert_eq!(refused, Err(Unsolved::Unobservable { name: "drift of the force with temperature" }));
        let still = Noise { force_sigma_n: 0.0, ..NOISE };
        assert!(matches!(calibrate(&cold, still, Terms::USUAL), Err(Unsolved::Value(_))));
    }

    /// Crosstalk and drift that were put in are found within four standard deviations; left out of the terms they show as a pattern.
    #[test]
    fn crosstalk_and_temperature_are_found() {
        let mut stream = quiet();
        let mut poses = poses(&random_directions(60, &mut stream), &mut stream, NOISE);
        for (nth, pose) in poses.iter_mut().enumerate() {
            let weight = Vector3::from(turned(TURN_RAD, pose.gravity_m_per_s2.into())) * MASS_KG;
            pose.force_n += Vector3::new(0.02 * weight.y, 0.02 * weight.x, 0.0);
            pose.torque_n_m.x += 0.01 * weight.x;
            pose.warmer_k = nth as f64 * 0.1;
            pose.force_n.z += 0.3 * pose.warmer_k;
        }
        let terms = Terms { misalignment: true, crosstalk: true, temperature: true };
        let found = calibrate(&poses, NOISE, terms).unwrap();
        let names = terms.names();
        let deviations = found.deviations();
        let of = |name: &str, nth: usize| deviations[names.iter().position(|other| other.0 == name).unwrap() + nth];
        let shear = of("crosstalk between forces", 2);
        assert!((found.parameters.shear[(0, 1)] - 0.02).abs() < 4.0 * shear, "{}", found.parameters.shear);
        let lever = of("crosstalk from force to torque", 0);
        assert!((found.parameters.lever_m[(0, 0)] - 0.01).abs() < 4.0 * lever, "{}", found.parameters.lever_m);
        let drift = of("drift of the force with temperature", 2);
        assert!((found.parameters.drift_force_n_per_k.z - 0.3).abs() < 4.0 * drift);
        assert_eq!(found.parameters.crosstalk()[(3, 0)].to_bits(), found.parameters.lever_m[(0, 0)].to_bits());
        assert!(patterns(&found, &poses).is_empty(), "{:?}", patterns(&found, &poses));
        let plain = calibrate(&poses, NOISE, Terms::USUAL).unwrap();
        let seen = patterns(&plain, &poses);
        assert!(seen.iter().any(|pattern| pattern.axis == 2 && pattern.shape == Shape::Order), "{seen:?}");
        assert!(seen.iter().any(|pattern| matches!(pattern.shape, Shape::Once(_)) && pattern.axis == 3), "{seen:?}");
    }

    /// White residuals have no pattern: the false alarm is 0.01 for a calibration, so that 400 of them draw 4 ± 2.
    #[test]
    fn white_residuals_show_no_pattern() {
        let alarms = (0..400).filter(|seed| {
            let mut stream = Streams::new(*seed).named("white");
            let poses = poses(&random_directions(36, &mut stream), &mut stream, NOISE);
            !patterns(&calibrate(&poses, NOISE, Terms::USUAL).unwrap(), &poses).is_empty()
        });
        let alarms = alarms.count();
        assert!(alarms <= 12, "{alarms} of 400: four standard deviations above four");
    }

    /// A tool that sags turns the weight by an angle that grows with it: the square shows as twice the angle.
    #[test]
    fn sag_shows_at_twice_the_angle() {
        let mut stream = quiet();
        let mut poses = poses(&sweep(72, core::f64::consts::PI), &mut stream, NOISE);
        for pose in &mut poses {
            let weight = Vector3::from(turned(TURN_RAD, pose.gravity_m_per_s2.into())) * MASS_KG;
            // 2 mrad for each N m.
            let sag = Vector3::from(CENTRE_M).cross(&weight) * 2e-3;
            pose.force_n += sag.cross(&weight);
        }
        let seen = patterns(&calibrate(&poses, NOISE, Terms::USUAL).unwrap(), &poses);
        assert!(seen.iter().all(|pattern| pattern.shape == Shape::Twice(0)), "{seen:?}");
        assert!(seen.iter().any(|pattern| pattern.axis < 3), "{seen:?}");
    }
}
