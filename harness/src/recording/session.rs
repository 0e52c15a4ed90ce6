//! What a recording holds, once it is read.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// A signal at the times at which it was sampled.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series<T> {
    /// Nanoseconds since [`Session::start_ns`], strictly increasing.
    pub time_ns: Vec<i64>,
    /// One value per time.
    pub value: Vec<T>,
}

/// Probe relative to the nozzle, expressed in the nozzle frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position in m; along the travel axis, positive closes the gap (default map).
    pub position_m: [f64; 3],
    /// Attitude as a unit quaternion x, y, z, w.
    pub orientation_xyzw: [f64; 4],
}

/// Raw reading of the force/torque sensor, turned to axes parallel to the nozzle's, as a force ON the probe.
///
/// Weight, bias and noise are still in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force in N.
    pub force_n: [f64; 3],
    /// Torque in N m, about the sensor's origin.
    pub torque_n_m: [f64; 3],
}

/// Velocity of the simulated satellites: probe relative to nozzle, in the nozzle frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Velocity in m/s.
    pub linear_m_per_s: [f64; 3],
    /// Angular rate in rad/s.
    pub angular_rad_per_s: [f64; 3],
}

/// What was done while the recorder ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// At rest: the noise is learned from it.
    Static,
    /// The robot moves and touches nothing, loop open.
    FreeFlight,
    /// An approach and a contact, loop closed.
    Impact,
    /// A rig driven by an applied force, no satellites.
    Drive,
}

impl Kind {
    /// All kinds, in the order in which a help text names them.
    pub const ALL: [Self; 4] = [Self::Static, Self::FreeFlight, Self::Impact, Self::Drive];

    /// The word that stands for it in files.
    pub const fn id(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::FreeFlight => "free-flight",
            Self::Impact => "impact",
            Self::Drive => "drive",
        }
    }
}

/// How far the bytes can be trusted. The order is the order of trust: the worst wins, A < D < B < C.
///
/// The letters name the cause. Repaired order or a gap (D) is stated by the data themselves and costs less trust than a
/// lost end (B); bytes known to be wrong (C) cost most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Grade {
    /// Complete; every checksum that the file carries is right.
    A,
    /// Complete, but order or duplicates were repaired, or samples are missing.
    D,
    /// Cut off, and recovered as far as it goes.
    B,
    /// Salvaged: parts with a wrong checksum were dropped.
    C,
}

impl Grade {
    /// What the letter means, in words for a report.
    pub const fn about(self) -> &'static str {
        match self {
            Self::A => "complete, every checksum right",
            Self::B => "cut off, recovered as far as it goes",
            Self::C => "salvaged: damaged parts dropped",
            Self::D => "repaired order or duplicates, or samples missing",
        }
    }
}

/// How much a [`Finding`] matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Good to know.
    Note,
    /// Was repaired, or limits what can be concluded.
    Warning,
    /// Part of the data is wrong or lost.
    Defect,
}

/// One thing that is unusual about a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Topic, or column of a table; empty when it concerns the whole file.
    pub topic: String,
    /// Nanoseconds since [`Session::start_ns`].
    pub at_ns: Option<i64>,
    /// What was found: value, limit, unit.
    pub what: String,
    /// What follows from it.
    pub consequence: String,
    /// How much it matters.
    pub severity: Severity,
}

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// The file, as given.
    pub file: PathBuf,
    /// SHA-256 of the file's bytes, in hexadecimal.
    pub sha256: String,
    /// Absolute time of the first sample, in ns.
    pub start_ns: i64,
    /// What was done while the recorder ran.
    pub kind: Kind,
    /// What the operator believes: the `session` metadata record, verbatim, and `[believed]` of the map where it is silent.
    pub believed: BTreeMap<String, String>,
    /// Pose asked for.
    pub commanded: Option<Series<Pose>>,
    /// Pose that the robot controller reports.
    pub measured: Option<Series<Pose>>,
    /// Velocity of the simulated satellites.
    pub twist: Option<Series<Twist>>,
    /// Raw force/torque reading.
    pub sensed: Option<Series<Wrench>>,
    /// Force that drives the rig, in N along the travel axis.
    pub applied: Option<Series<f64>>,
    /// How far the bytes can be trusted.
    pub grade: Grade,
    /// Everything unusual, in order of topic and time.
    pub findings: Vec<Finding>,
}

impl Session {
    /// A believed number.
    ///
    /// # Errors
    /// When the key is missing, or its value is not a finite number.
    pub fn believed_f64(&self, key: &str) -> Result<f64, Error> {
        let text = self.believed.get(key).ok_or_else(|| self.missing(key))?;
        self.number(key, text)
    }

    /// A believed number, or `default` when nobody says.
    ///
    /// # Errors
    /// When the value is there and is not a finite number.
    pub fn believed_f64_or(&self, key: &str, default: f64) -> Result<f64, Error> {
        self.believed.get(key).map_or(Ok(default), |text| self.number(key, text))
    }

    /// A believed list of numbers, written as `[a, b]`.
    ///
    /// # Errors
    /// When the key is missing, or its value is not such a list.
    pub fn believed_vec(&self, key: &str) -> Result<Vec<f64>, Error> {
        let text = self.believed.get(key).ok_or_else(|| self.missing(key))?;
        let inner = text.trim().strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        let inner = inner.ok_or_else(|| self.bad(key, text, "a list of numbers such as [0.0, 0.0, 0.11]"))?.trim();
        if inner.is_empty() {
            return Ok(Vec::new());
        }
        inner.split(',').map(|part| self.number(key, part)).collect()
    }

    /// Refuses a recording of a run with six axes: what lies across the axis of approach would be missing from every answer.
    ///
    /// # Errors
    /// When its session record says `axes`, and not 1.
    pub fn along_one_axis(&self) -> Result<(), Error> {
        match self.believed.get("axes").map(|axes| axes.trim()) {
            None | Some("1") => Ok(()),
            Some(axes) => Err(Error::new(format!("was recorded with {axes} axes, and this command works along one"))
                .file(&self.file)
                .place("metadata record `session`")
                .help(
                    "plot it, or run its scenario again with another model or fault: dockhil run SCENARIO --report FILE.html; \
                     the loop of its model is answered by: dockhil stability MODEL.toml",
                )),
        }
    }

    /// The last time of all series, in ns since [`Self::start_ns`].
    pub fn end_ns(&self) -> i64 {
        let ends = [
            self.commanded.as_ref().and_then(|series| series.time_ns.last()),
            self.measured.as_ref().and_then(|series| series.time_ns.last()),
            self.twist.as_ref().and_then(|series| series.time_ns.last()),
            self.sensed.as_ref().and_then(|series| series.time_ns.last()),
            self.applied.as_ref().and_then(|series| series.time_ns.last()),
        ];
        ends.into_iter().flatten().copied().max().unwrap_or(0)
    }

    fn number(&self, key: &str, text: &str) -> Result<f64, Error> {
        let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| self.bad(key, text, "a finite number"))
    }

    fn missing(&self, key: &str) -> Error {
        let known: Vec<&str> = self.believed.keys().map(String::as_str).collect();
        let known =
            if known.is_empty() { "it has no such record".to_owned() } else { format!("it has {}", known.join(", ")) };
        Error::new(format!("the session record does not say `{key}`; {known}"))
            .file(&self.file)
            .place("metadata record `session`")
            .help(format!("give it in the map of topics and conventions: [believed] {key} = …"))
    }

    fn bad(&self, key: &str, text: &str, wanted: &str) -> Error {
        Error::new(format!("`{key}` is `{text}`, expected {wanted}"))
            .file(&self.file)
            .place("metadata record `session`")
            .help("record it again with a right value; a record without a checksum may also be damaged")
    }
}
