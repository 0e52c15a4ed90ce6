//! The six axes of a recording: command and pose of each, as numbers over time.
//!
//! Positions along x, y, z of the nozzle in m; attitude as the rotation vector from the first command, about x, y, z, in rad.

use crate::error::Error;
use crate::recording::{Pose, Series, Session};
use nalgebra::{Quaternion, UnitQuaternion};

/// A change of the command below this is rounding, in m or rad.
const CHANGE_MIN: f64 = 1e-9;

/// One axis of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisSignal {
    /// Times of the command.
    pub command_s: Vec<f64>,
    /// The command.
    pub command: Vec<f64>,
    /// Times of the pose.
    pub pose_s: Vec<f64>,
    /// The pose.
    pub pose: Vec<f64>,
}

impl AxisSignal {
    /// Index, time and size of every change of the command.
    pub fn changes(&self) -> Vec<(f64, f64)> {
        let pairs = self.command.windows(2).zip(&self.command_s[1..]);
        let change = |(pair, time_s): (&[f64], &f64)| (*time_s, pair[1] - pair[0]);
        pairs.map(change).filter(|(_, size)| size.abs() > CHANGE_MIN).collect()
    }
}

/// All six axes.
///
/// # Errors
/// When the recording lacks the command or the measured pose.
pub fn axes(session: &Session) -> Result<[AxisSignal; 6], Error> {
    let lacking = |what: &str, role: &str| {
        Error::new(format!("holds no {what}"))
            .file(&session.file)
            .help(format!("record it, or name its topic in the map given with --map: [topics] {role} = …"))
    };
    let commanded = session.commanded.as_ref().ok_or_else(|| lacking("command", "commanded"))?;
    let measured = session.measured.as_ref().ok_or_else(|| lacking("measured pose", "measured"))?;
    let origin = commanded.value.first().map_or_else(UnitQuaternion::identity, attitude);
    let (asked, got) = (columns(commanded, &origin), columns(measured, &origin));
    let seconds = |times: &[i64]| times.iter().map(|time| *time as f64 * 1e-9).collect::<Vec<_>>();
    let (command_s, pose_s) = (seconds(&commanded.time_ns), seconds(&measured.time_ns));
    let mut pairs = asked.into_iter().zip(got);
    Ok(std::array::from_fn(|_| {
        let (command, pose) = pairs.next().unwrap_or_default();
        AxisSignal { command_s: command_s.clone(), command, pose_s: pose_s.clone(), pose }
    }))
}

fn attitude(pose: &Pose) -> UnitQuaternion<f64> {
    let [x, y, z, w] = pose.orientation_xyzw;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn columns(series: &Series<Pose>, origin: &UnitQuaternion<f64>) -> [Vec<f64>; 6] {
    let rows: Vec<[f64; 6]> = series
        .value
        .iter()
        .map(|pose| {
            let [x, y, z] = pose.position_m;
            let turn = (attitude(pose) * origin.inverse()).scaled_axis();
            [x, y, z, turn.x, turn.y, turn.z]
        })
        .collect();
    std::array::from_fn(|axis| rows.iter().map(|row| row[axis]).collect())
}
