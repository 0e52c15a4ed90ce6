//! What was exchanged, as a session that `compare` and `diagnose` read.
//!
//! The log stands at the robot controllers and hears both directions: commands as they were sent, poses and readings as they
//! arrived at the other side. Times are those of the cell: a command bears the time of the cycle that it answers, a reading the time
//! at which it was taken. Twist is not on the wire, and so not in the session.

use super::config::{Carries, Cell};
use crate::error::Error;
use crate::files::sha256_hex;
use crate::model::Model;
use crate::recording::{Grade, Kind, Luggage, Pose, Series, Session, Wrench, write_mcap_with};
use crate::simulate::believed;
use drivers::metres_from_millimetres;

/// Date of the first cycle, in ns: any date will do, and it is never the clock's.
const START_NS: i64 = 1_770_000_000_000_000_000;

/// Signals as they come.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Relative pose that was commanded.
    pub commanded: Series<Pose>,
    /// Relative pose that was reported.
    pub measured: Series<Pose>,
    /// Readings.
    pub sensed: Series<Wrench>,
}

impl Default for Log {
    fn default() -> Self {
        let poses = || Series { time_ns: Vec::new(), value: Vec::new() };
        Log { commanded: poses(), measured: poses(), sensed: Series { time_ns: Vec::new(), value: Vec::new() } }
    }
}

/// Adds a sample; one that is not newer than the last is left out, as a recorder's queue would drop it.
pub(super) fn push<T>(series: &mut Series<T>, time_ns: i64, value: T) {
    if series.time_ns.last().is_none_or(|last| time_ns > *last) {
        series.time_ns.push(time_ns);
        series.value.push(value);
    }
}

impl Log {
    /// Whether the commands moved along z.
    fn moved(&self) -> bool {
        let first = self.commanded.value.first().map(|pose| pose.position_m[2].to_bits());
        self.commanded.value.iter().any(|pose| Some(pose.position_m[2].to_bits()) != first)
    }

    /// The session of a run; `touched` says whether probe and nozzle did, `late_s` by how much a recorder's stamps of the
    /// readings are late.
    pub fn session(mut self, model: &Model, cell: &Cell, touched: bool, late_s: f64) -> Session {
        let name = &cell.config.name;
        let kind = match (touched, self.moved()) {
            (true, _) => Kind::Impact,
            (false, true) => Kind::FreeFlight,
            (false, false) => Kind::Static,
        };
        let numbers = self.sensed.value.iter().map(|wrench| wrench.force_n[2]);
        let numbers = numbers.chain(self.measured.value.iter().map(|pose| pose.position_m[2]));
        let bytes: Vec<u8> = name.bytes().chain(numbers.flat_map(f64::to_le_bytes)).collect();
        let sha256 = sha256_hex(&bytes);
        let late_ns = (late_s * 1e9).round() as i64;
        self.sensed.time_ns.iter_mut().for_each(|time_ns| *time_ns += late_ns);
        let mut record = believed(model, model.plant.mass_kg, kind);
        // The step to which a command is rounded: `compare` asks no more of our software than that.
        let decimals = cell.config.robot(Carries::Probe).map_or(0, |robot| i32::from(robot.decimals));
        let quantum_m = metres_from_millimetres(libm::pow(10.0, -f64::from(decimals)));
        record.insert("command_quantum_m".to_owned(), quantum_m.to_string());
        Session {
            file: format!("{name}.cell").into(),
            sha256,
            start_ns: START_NS,
            kind,
            believed: record,
            twist: None,
            commanded: Some(self.commanded),
            measured: Some(self.measured),
            sensed: Some(self.sensed),
            applied: None,
            grade: Grade::A,
            findings: Vec::new(),
        }
    }
}

/// The session as a file, with the cell and its model in it.
///
/// # Errors
/// When it cannot be encoded.
pub fn mcap(session: &Session, cell: &Cell) -> Result<Vec<u8>, Error> {
    let file = |name: &str, text: &str| (name.to_owned(), text.as_bytes().to_vec());
    let files = vec![file("cell.toml", &cell.source.text), file("model.toml", &cell.model.text)];
    let mut bytes = std::io::Cursor::new(Vec::new());
    write_mcap_with(session, &Luggage { metadata: Vec::new(), files }, &mut bytes)?;
    Ok(bytes.into_inner())
}
