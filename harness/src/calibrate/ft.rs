//! From recordings to a calibration: finds the poses, weighs forces against torques, judges what the poses could show.

use super::rest::{RestPose, at_rest};
use super::words::pattern_words;
use crate::error::Error;
use crate::identify::gradings;
use crate::recording::{Body, SensorMap, Session};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;
use sim_core::calibration::{
    AxisResidual, Calibration, Noise, Observability, StaticPose, Terms, Unsolved, calibrate, observe, patterns,
};

/// Noise of a pose's mean until the residuals show it: what the thesis says of its calibrated sensor, and the torque that a
/// lever arm of 8 cm makes of it.
const NOISE_FIRST: Noise = Noise { force_sigma_n: 0.25, torque_sigma_n_m: 0.02 };
/// Below these poses the residuals show too little of the noise: 8 poses leave 35 readings free. Chosen: 12 % of the noise.
const POSES_FOR_NOISE: usize = 8;
/// Half of the last digit of the recordings: 1 mN and 0.1 mN m.
const NOISE_MIN: Noise = Noise { force_sigma_n: 5e-4, torque_sigma_n_m: 5e-5 };
/// How often the noise is taken from the residuals anew. The second time changes the third digit.
const WEIGHINGS: usize = 3;

/// What to calibrate from.
pub struct FtRequest<'a> {
    /// Recordings with poses at rest.
    pub sessions: &'a [Session],
    /// How the sensor is mounted, and where gravity points.
    pub sensor: &'a SensorMap,
    /// What is estimated.
    pub terms: Terms,
    /// Noise of a pose's mean; from the residuals where it is not given.
    pub noise: Option<Noise>,
}

/// A number that was estimated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NamedNumber {
    /// What it is.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// One standard deviation.
    pub deviation: f64,
}

/// What the poses could show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObservabilityReport {
    /// Distinct directions of gravity.
    pub directions: usize,
    /// Largest angle between two of them.
    pub opening_deg: f64,
    /// Largest standard deviation of the predicted force among the poses.
    pub visited_n: f64,
    /// The same in any attitude.
    pub anywhere_n: f64,
    /// The same if the poses were spread evenly.
    pub even_n: f64,
    /// Whether more attitudes would help little.
    pub is_enough: bool,
}

/// A calibration and what it is worth.
#[derive(Debug, Clone, Serialize)]
pub struct FtCalibration {
    /// Every pose that was used.
    pub poses: Vec<RestPose>,
    /// Every number, three for a vector.
    pub numbers: Vec<NamedNumber>,
    /// Their covariance, row by row, in the same order.
    pub covariance: Vec<Vec<f64>>,
    /// Noise of a pose's mean force, N, as used.
    pub force_sigma_n: f64,
    /// Noise of a pose's mean torque.
    pub torque_sigma_n_m: f64,
    /// Where the noise comes from.
    pub noise_source: &'static str,
    /// How many iterations it took.
    pub iterations: usize,
    /// Root of the mean squared residual in standard deviations, per degree of freedom.
    pub weighted_rms: f64,
    /// Standard deviation of the residuals, three forces, then three torques.
    pub residual_sd: [f64; 6],
    /// Largest residual.
    pub residual_max: [f64; 6],
    /// What the poses could show.
    pub observability: ObservabilityReport,
    /// Patterns in the residuals, in words.
    pub patterns: Vec<String>,
    /// What is to be known of the recordings: each one that is not whole.
    pub findings: Vec<String>,
    /// Whether the force stood still in every pose.
    pub is_steady: bool,
    /// Mean temperature of the poses, if it was given with every recording.
    pub reference_c: Option<f64>,
    /// The same with all its digits.
    #[serde(skip)]
    pub calibration: Calibration,
    /// The same with the poses to add.
    #[serde(skip)]
    pub found: Observability,
}

/// Calibrates.
///
/// # Errors
/// When a recording lacks what is needed, or the poses do not determine the numbers.
pub fn calibrate_ft(request: &FtRequest<'_>) -> Result<FtCalibration, Error> {
    if request.sensor.body == Body::Target {
        return Err(Error::new("the map says that the sensor is on the target, which does not turn with the probe")
            .place("map: sensor.body")
            .help("calibrate a sensor that the robot carries: body = \"chaser\""));
    }
    let mut rests = Vec::new();
    for session in request.sessions {
        rests.extend(at_rest(session)?);
    }
    let reference_c = reference(request, &rests)?;
    let gravity = Vector3::from(request.sensor.gravity_m_per_s2);
    let poses: Vec<StaticPose> = rests.iter().map(|rest| static_pose(rest, &gravity, reference_c)).collect();
    let (calibration, noise_source) =
        weighed(&poses, request).map_err(|unsolved| explain(&unsolved, request, &rests))?;
    let found = observe(&calibration, &poses);
    let residuals = calibration.axis_residuals();
    let each = |of: fn(&AxisResidual) -> f64| std::array::from_fn(|axis| of(&residuals[axis]));
    Ok(FtCalibration {
        numbers: numbers(&calibration),
        covariance: calibration.covariance.row_iter().map(|row| row.iter().copied().collect()).collect(),
        force_sigma_n: calibration.noise.force_sigma_n,
        torque_sigma_n_m: calibration.noise.torque_sigma_n_m,
        noise_source,
        iterations: calibration.steps.len(),
        weighted_rms: calibration.weighted_rms,
        residual_sd: each(|axis| axis.deviation),
        residual_max: each(|axis| axis.largest),
        observability: ObservabilityReport {
            directions: found.directions,
            opening_deg: found.opening_rad.to_degrees(),
            visited_n: found.visited_n,
            anywhere_n: found.anywhere_n,
            even_n: found.even_n,
            is_enough: found.is_enough(),
        },
        patterns: patterns(&calibration, &poses).iter().map(pattern_words).collect(),
        findings: gradings(request.sessions).into_iter().chain(rests.iter().filter_map(drifting)).collect(),
        is_steady: !rests.iter().any(|rest| rest.drifts),
        reference_c,
        poses: rests,
        calibration,
        found,
    })
}

/// What is to be said of a pose whose force does not stand still.
fn drifting(rest: &RestPose) -> Option<String> {
    rest.drifts.then(|| {
        format!(
            "{}: from {:.1} s to {:.1} s the robot stands and the mean force moves by {:.2} N: not decided; let the sensor warm up, and \
             see that nothing touches the tool",
            rest.file, rest.from_s, rest.to_s, rest.force_drift_n
        )
    })
}

/// The mean temperature; with the drift among the terms every pose needs its own.
fn reference(request: &FtRequest<'_>, rests: &[RestPose]) -> Result<Option<f64>, Error> {
    let given: Vec<f64> = rests.iter().filter_map(|rest| rest.temperature_c).collect();
    if let (true, Some(rest)) = (request.terms.temperature, rests.iter().find(|rest| rest.temperature_c.is_none())) {
        return Err(Error::new("does not say the temperature of the sensor, which --temperature needs")
            .file(&rest.file)
            .place("metadata record `session`")
            .help("record ft_temperature_c, or give it in the map: [believed] ft_temperature_c = …"));
    }
    let all = !given.is_empty() && given.len() == rests.len();
    Ok(all.then(|| given.iter().sum::<f64>() / given.len() as f64))
}

fn static_pose(rest: &RestPose, gravity: &Vector3<f64>, reference_c: Option<f64>) -> StaticPose {
    let [x, y, z, w] = rest.orientation_xyzw;
    let attitude = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let warmer_k = rest.temperature_c.zip(reference_c).map_or(0.0, |(own, reference)| own - reference);
    StaticPose {
        gravity_m_per_s2: attitude.inverse() * gravity,
        force_n: Vector3::from(rest.force_n),
        torque_n_m: Vector3::from(rest.torque_n_m),
        warmer_k,
    }
}

/// Calibrates with the noise that was given, or with the one that the residuals show.
fn weighed(poses: &[StaticPose], request: &FtRequest<'_>) -> Result<(Calibration, &'static str), Unsolved> {
    if let Some(noise) = request.noise {
        return Ok((calibrate(poses, noise, request.terms)?, "given"));
    }
    let mut calibration = calibrate(poses, NOISE_FIRST, request.terms)?;
    if poses.len() < POSES_FOR_NOISE {
        return Ok((calibration, "assumed: too few poses to see it"));
    }
    for _ in 0..WEIGHINGS {
        let Some(seen) = calibration.observed_noise else { break };
        let noise = Noise {
            force_sigma_n: seen.force_sigma_n.max(NOISE_MIN.force_sigma_n),
            torque_sigma_n_m: seen.torque_sigma_n_m.max(NOISE_MIN.torque_sigma_n_m),
        };
        calibration = calibrate(poses, noise, request.terms)?;
    }
    Ok((calibration, "from the residuals"))
}

/// What the user can do about it.
fn explain(unsolved: &Unsolved, request: &FtRequest<'_>, rests: &[RestPose]) -> Error {
    let help = match unsolved {
        Unsolved::Directions { .. } if rests.is_empty() => {
            "record the robot standing for a second in each of several attitudes".to_owned()
        }
        Unsolved::Directions { .. } => {
            "add poses in which gravity points elsewhere in the sensor: about one axis by 60 \
             degrees and by -60 degrees, then about another; a turn about the vertical shows nothing"
                .to_owned()
        }
        Unsolved::Poses { .. } => "add poses, or estimate fewer terms".to_owned(),
        Unsolved::Unobservable { name } if name.contains("temperature") => {
            "record at two temperatures at least, or leave out --temperature".to_owned()
        }
        Unsolved::Unobservable { name } if name.contains("crosstalk") => {
            "add poses in which gravity leaves the plane of the others, or leave out --crosstalk".to_owned()
        }
        Unsolved::Unobservable { .. } => "add poses in which gravity points elsewhere in the sensor".to_owned(),
        Unsolved::Diverged => "check units, signs and the axes of the sensor in the map given with --map".to_owned(),
        Unsolved::Value(_) => "give a positive number in the unit of the option".to_owned(),
    };
    let what = format!("{unsolved}; {} poses at rest were found", rests.len());
    let bare = Error::new(what).help(help);
    match request.sessions {
        [only] => bare.file(&only.file),
        _ => bare.place(format!("{} recordings", request.sessions.len())),
    }
}

fn numbers(calibration: &Calibration) -> Vec<NamedNumber> {
    let found = &calibration.parameters;
    let mut values: Vec<f64> = found.bias_force_n.iter().chain(found.bias_torque_n_m.iter()).copied().collect();
    values.push(found.mass_kg);
    values.extend(found.centre_m.iter());
    if calibration.terms.misalignment {
        values.extend(found.misalignment_rad().iter());
    }
    if calibration.terms.crosstalk {
        let (shear, lever) = (&found.shear, &found.lever_m);
        values.extend([shear[(0, 0)], shear[(1, 1)], shear[(0, 1)], shear[(0, 2)], shear[(1, 2)]]);
        let places = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
        values.extend(places.map(|place| lever[place]));
    }
    if calibration.terms.temperature {
        values.extend(found.drift_force_n_per_k.iter().chain(found.drift_torque_n_m_per_k.iter()));
    }
    let names = calibration.terms.names().into_iter().zip(values).zip(calibration.deviations());
    names.map(|(((name, unit), value), deviation)| NamedNumber { name, unit, value, deviation }).collect()
}
