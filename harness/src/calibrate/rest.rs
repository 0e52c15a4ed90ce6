//! Poses at rest in a recording: where the robot stands long enough for the sensor to be averaged.

use crate::error::Error;
use crate::recording::{Pose, Series, Session};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;

/// The robot stands while its attitude stays this close to where the segment began. Chosen: the weight of 12 kg then changes
/// its parts by at most 0.1 N, and a controller's noise (10 µrad) is far below.
const ANGLE_MAX_RAD: f64 = 1e-3;
/// The same for the position: ten times the noise of a read-out. Chosen.
const DISTANCE_MAX_M: f64 = 2e-4;
/// A segment is at least this long. Chosen: a motion that stays this close for so long is slower than 2 mrad/s.
const REST_MIN_NS: i64 = 500_000_000;
/// What is left out after a motion, while the arm still rings: four periods at 10 Hz fit twice. Chosen.
const SETTLE_NS: i64 = 200_000_000;
/// What is left out before the next one.
const LEAVE_NS: i64 = 50_000_000;
/// A mean that moves by less within a pose does no harm: the error of a sensor. Chosen.
const DRIFT_MAX_N: f64 = 0.25;
/// The same in its own standard deviations.
const DRIFT_SIGMAS: f64 = 5.0;
/// Fewest samples of the sensor in a pose.
const SAMPLES_MIN: usize = 20;

/// One pose at rest and what the sensor read there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestPose {
    /// The recording.
    pub file: String,
    /// From when to when it is averaged, in s since the recording's first sample.
    pub from_s: f64,
    /// To when.
    pub to_s: f64,
    /// How many samples of the sensor.
    pub samples: usize,
    /// Attitude of the probe relative to the nozzle, x, y, z, w.
    pub orientation_xyzw: [f64; 4],
    /// Mean force on the tool.
    pub force_n: [f64; 3],
    /// Mean torque on the tool.
    pub torque_n_m: [f64; 3],
    /// Scatter of single samples, the largest of the three axes.
    pub force_scatter_n: f64,
    /// By how much the mean force moves from the begin of the pose to its end, the largest of the three axes.
    pub force_drift_n: f64,
    /// Whether that is more than noise, and more than a sensor may be wrong.
    pub drifts: bool,
    /// Temperature of the sensor, as the operator wrote it: `ft_temperature_c`.
    pub temperature_c: Option<f64>,
}

/// Every pose at rest of a recording, in order of time.
///
/// # Errors
/// When the recording lacks the measured pose or the sensor, or its temperature is no number.
pub fn at_rest(session: &Session) -> Result<Vec<RestPose>, Error> {
    let lacking = |what: &str, role: &str| {
        Error::new(format!("holds no {what}"))
            .file(&session.file)
            .help(format!("record it, or name its topic in the map given with --map: [topics] {role} = …"))
    };
    let measured = session.measured.as_ref().ok_or_else(|| lacking("measured pose", "measured"))?;
    let sensed = session.sensed.as_ref().ok_or_else(|| lacking("force/torque reading", "sensed"))?;
    let temperature = "ft_temperature_c";
    let temperature_c =
        session.believed.contains_key(temperature).then(|| session.believed_f64(temperature)).transpose()?;
    let mut poses = Vec::new();
    for (first, last) in segments(measured) {
        let (from_ns, to_ns) = (measured.time_ns[first] + SETTLE_NS, measured.time_ns[last] - LEAVE_NS);
        let from = sensed.time_ns.partition_point(|time| *time < from_ns);
        let to = sensed.time_ns.partition_point(|time| *time <= to_ns);
        if to - from.min(to) < SAMPLES_MIN {
            continue;
        }
        let readings = &sensed.value[from..to];
        let force_n = mean(readings.iter().map(|wrench| wrench.force_n));
        let torque_n_m = mean(readings.iter().map(|wrench| wrench.torque_n_m));
        let square = |axis: usize| {
            let squares = readings
                .iter()
                .map(|wrench| (wrench.force_n[axis] - force_n[axis]) * (wrench.force_n[axis] - force_n[axis]));
            squares.sum::<f64>() / readings.len() as f64
        };
        let drift = |axis: usize| drift_n(&readings.iter().map(|wrench| wrench.force_n[axis]).collect::<Vec<_>>());
        let [force_drift_n, sd_n] =
            (0..3).map(drift).fold([0.0; 2], |most, one| if one[0] > most[0] { one } else { most });
        poses.push(RestPose {
            file: session.file.display().to_string(),
            from_s: from_ns as f64 * 1e-9,
            to_s: to_ns as f64 * 1e-9,
            samples: readings.len(),
            orientation_xyzw: mean_attitude(&measured.value[first..=last]),
            force_n,
            torque_n_m,
            force_scatter_n: libm::sqrt((0..3).map(square).fold(0.0, f64::max)),
            force_drift_n,
            drifts: force_drift_n > DRIFT_MAX_N.max(DRIFT_SIGMAS * sd_n),
            temperature_c,
        });
    }
    Ok(poses)
}

/// From begin to end twice what lies between the means of both halves, as on a ramp; and its noise, by the differences of neighbours,
/// which a ramp hardly moves.
fn drift_n(values: &[f64]) -> [f64; 2] {
    let (first, second) = values.split_at(values.len() / 2);
    let mean = |half: &[f64]| half.iter().sum::<f64>() / half.len() as f64;
    let squares = values.windows(2).map(|pair| (pair[1] - pair[0]) * (pair[1] - pair[0]));
    let variance = 0.5 * squares.sum::<f64>() / (values.len() - 1) as f64;
    [2.0 * (mean(second) - mean(first)).abs(), 4.0 * libm::sqrt(variance / values.len() as f64)]
}

/// First and last index of every stretch in which the robot stands.
fn segments(measured: &Series<Pose>) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut first = 0;
    while first < measured.value.len() {
        let stands = |pose: &Pose| near(&measured.value[first], pose);
        let length = measured.value[first..].iter().take_while(|pose| stands(pose)).count().max(1);
        let last = first + length - 1;
        if measured.time_ns[last] - measured.time_ns[first] >= REST_MIN_NS {
            found.push((first, last));
            first = last + 1;
        } else {
            first += 1;
        }
    }
    found
}

/// Whether two poses are one to the sensor.
fn near(one: &Pose, other: &Pose) -> bool {
    let distance = (Vector3::from(one.position_m) - Vector3::from(other.position_m)).norm();
    distance <= DISTANCE_MAX_M && attitude(one).angle_to(&attitude(other)) <= ANGLE_MAX_RAD
}

fn attitude(pose: &Pose) -> UnitQuaternion<f64> {
    let [x, y, z, w] = pose.orientation_xyzw;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// The mean of attitudes that lie close together, which turned round (q and -q) are the same.
fn mean_attitude(poses: &[Pose]) -> [f64; 4] {
    let first = attitude(&poses[0]);
    let mut sum = Quaternion::new(0.0, 0.0, 0.0, 0.0);
    for pose in poses {
        let q = attitude(pose).into_inner();
        sum += if q.dot(&first.into_inner()) < 0.0 { -q } else { q };
    }
    let unit = UnitQuaternion::from_quaternion(sum);
    [unit.i, unit.j, unit.k, unit.w]
}

fn mean(values: impl ExactSizeIterator<Item = [f64; 3]>) -> [f64; 3] {
    let count = values.len() as f64;
    let sum = values.fold([0.0; 3], |sum, value| [sum[0] + value[0], sum[1] + value[1], sum[2] + value[2]]);
    sum.map(|part| part / count)
}
