//! The map of topics and conventions: which topic plays which role, and how its numbers are to be read.
//!
//! TOML, units in the keys. [`Map::default`] describes the recordings of `data/hidden-effect`; a file overrides tables
//! of it. A `[topics]` table replaces the default topics as a whole: what it leaves out is not mapped.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::session::Kind;
use crate::error::Error;

/// Which topic plays which role, and the conventions of its numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Map {
    /// Version of this format: 1.
    pub schema: u32,
    /// The clock that dates every sample, unless `clock_of` says otherwise.
    pub clock: Clock,
    /// The clock of single roles, for recordings with several clocks.
    pub clock_of: Clocks,
    /// What was recorded; overrides the recording's own `kind`.
    pub kind: Option<Kind>,
    /// Roles that may be absent.
    pub optional: Vec<Role>,
    /// Topics by role.
    pub topics: Topics,
    /// How the force/torque sensor is mounted and what it counts.
    pub sensor: SensorMap,
    /// The axes of the task.
    pub axis: AxisMap,
    /// Columns of a table, for recordings in CSV.
    pub csv: Option<CsvMap>,
    /// What the operator believes, where the recording does not say. A number, a word or a list of numbers.
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub believed: BTreeMap<String, toml::Value>,
}

/// The part that a signal plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Pose asked for.
    Commanded,
    /// Pose reported by the robot controller.
    Measured,
    /// Velocity of the simulated satellites.
    Twist,
    /// Raw force/torque reading.
    Sensed,
    /// Force that drives the rig.
    Applied,
}

impl Role {
    /// The key that stands for it in a map.
    pub const fn id(self) -> &'static str {
        match self {
            Self::Commanded => "commanded",
            Self::Measured => "measured",
            Self::Twist => "twist",
            Self::Sensed => "sensed",
            Self::Applied => "applied",
        }
    }
}

/// A clock that a message carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// `header.stamp`: the clock of the device that sampled.
    Header,
    /// `log_time`: the clock of the recorder.
    Log,
    /// `publish_time`: the clock of the publisher, when it sent.
    Publish,
}

/// Topics by role; `None` is not mapped.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Topics {
    /// `geometry_msgs/msg/PoseStamped`.
    pub commanded: Option<String>,
    /// `geometry_msgs/msg/PoseStamped`.
    pub measured: Option<String>,
    /// `geometry_msgs/msg/TwistStamped`.
    pub twist: Option<String>,
    /// `geometry_msgs/msg/WrenchStamped`.
    pub sensed: Option<String>,
    /// `geometry_msgs/msg/WrenchStamped`, of which the force along the travel axis is read.
    pub applied: Option<String>,
}

/// Clocks by role; `None` is the map's clock.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Clocks {
    /// Clock of the command.
    pub commanded: Option<Clock>,
    /// Clock of the read-out.
    pub measured: Option<Clock>,
    /// Clock of the satellites' velocity.
    pub twist: Option<Clock>,
    /// Clock of the force/torque sensor.
    pub sensed: Option<Clock>,
    /// Clock of the driving force.
    pub applied: Option<Clock>,
}

/// How the force/torque sensor is mounted and what it counts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensorMap {
    /// Turns a vector from sensor axes to nozzle-parallel axes; unit quaternion x, y, z, w.
    pub rotation_to_nozzle_xyzw: [f64; 4],
    /// The same as angles about z, then y', then x'', in degrees. Give one of the two.
    pub rotation_to_nozzle_euler_zyx_deg: Option<[f64; 3]>,
    /// On whom the reported force acts.
    pub force_sign: ForceSign,
    /// Unit of the reported force.
    pub force_unit: ForceUnit,
    /// Unit of the reported torque.
    pub torque_unit: TorqueUnit,
    /// The body that carries the probe and the sensor.
    pub body: Body,
    /// Gravity in the nozzle frame, in m/s².
    pub gravity_m_per_s2: [f64; 3],
}

/// On whom the reported force acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ForceSign {
    /// The force on the probe: contact reads negative along the travel axis.
    OnProbe,
    /// Its reaction, the force on the target: turned round on reading.
    OnTarget,
}

/// Unit of a reported force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum ForceUnit {
    /// Newton.
    #[serde(rename = "N")]
    Newton,
    /// Millinewton.
    #[serde(rename = "mN")]
    Millinewton,
    /// Kilonewton.
    #[serde(rename = "kN")]
    Kilonewton,
    /// Pound-force, 4.448 221 615 260 5 N exactly.
    #[serde(rename = "lbf")]
    PoundForce,
}

/// Unit of a reported torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TorqueUnit {
    /// Newton metre.
    #[serde(rename = "N m")]
    NewtonMetre,
    /// Millinewton metre.
    #[serde(rename = "mN m")]
    MillinewtonMetre,
    /// Newton millimetre.
    #[serde(rename = "N mm")]
    NewtonMillimetre,
}

/// The body that carries the probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Body {
    /// The active vehicle.
    Chaser,
    /// The passive vehicle.
    Target,
}

/// The axes of the task, in the nozzle frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AxisMap {
    /// The axis of approach.
    pub travel: AxisName,
    /// +1 when a growing coordinate closes the gap, -1 when it opens it.
    pub sign: i32,
    /// The axis of pitch.
    pub pitch: AxisName,
}

/// An axis of the nozzle frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AxisName {
    /// First.
    X,
    /// Second.
    Y,
    /// Third.
    Z,
}

/// Columns of a table, by the names in its first line. A value is the cell times its factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CsvMap {
    /// Column of the time.
    pub time: String,
    /// Seconds per unit of the time column.
    pub time_s_per_unit: f64,
    /// Column of the position asked for, along the travel axis.
    pub commanded: Option<String>,
    /// Metres per unit.
    pub commanded_m_per_unit: f64,
    /// Column of the measured position, along the travel axis.
    pub measured: Option<String>,
    /// Metres per unit.
    pub measured_m_per_unit: f64,
    /// Column of the sensed force, along the travel axis.
    pub sensed: Option<String>,
    /// Newton per unit.
    pub sensed_n_per_unit: f64,
    /// Column of the driving force.
    pub applied: Option<String>,
    /// Newton per unit.
    pub applied_n_per_unit: f64,
}

impl Default for Map {
    fn default() -> Self {
        Self {
            schema: 1,
            clock: Clock::Header,
            clock_of: Clocks::default(),
            kind: None,
            optional: vec![Role::Twist, Role::Applied],
            topics: Topics::default(),
            sensor: SensorMap::default(),
            axis: AxisMap::default(),
            csv: None,
            believed: BTreeMap::new(),
        }
    }
}

impl Default for Topics {
    fn default() -> Self {
        Self {
            commanded: Some("/robot/pose_command".to_owned()),
            measured: Some("/robot/pose_measured".to_owned()),
            twist: Some("/satellite/relative_twist".to_owned()),
            sensed: Some("/ft/wrench".to_owned()),
            applied: Some("/axis/applied_wrench".to_owned()),
        }
    }
}

impl Default for SensorMap {
    fn default() -> Self {
        Self {
            rotation_to_nozzle_xyzw: [0.0, 0.0, 0.0, 1.0],
            rotation_to_nozzle_euler_zyx_deg: None,
            force_sign: ForceSign::OnProbe,
            force_unit: ForceUnit::Newton,
            torque_unit: TorqueUnit::NewtonMetre,
            body: Body::Chaser,
            gravity_m_per_s2: [0.0, -9.80665, 0.0],
        }
    }
}

impl Default for AxisMap {
    fn default() -> Self {
        Self { travel: AxisName::Z, sign: 1, pitch: AxisName::X }
    }
}

impl Default for CsvMap {
    fn default() -> Self {
        Self {
            time: "t".to_owned(),
            time_s_per_unit: 1.0,
            commanded: None,
            commanded_m_per_unit: 1.0,
            measured: None,
            measured_m_per_unit: 1.0,
            sensed: None,
            sensed_n_per_unit: 1.0,
            applied: None,
            applied_n_per_unit: 1.0,
        }
    }
}

impl Map {
    /// Reads a map and checks it. `name` is the file, for the error.
    ///
    /// # Errors
    /// When the text is not TOML, has an unknown key, or a value that cannot be; the error points at it.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        let map: Self = toml::from_str(text).map_err(|error| {
            let what = error.message().lines().collect::<Vec<_>>().join("; ");
            let bare = Error::new(what).file(name).help("correct the map; `dockhil model schema --map` lists its keys");
            match error.span() {
                Some(span) => bare.span(text, span),
                None => bare,
            }
        })?;
        super::map_check::check(&map).map_err(|(key, what)| {
            let bare = Error::new(what).file(name).help("correct the map; `dockhil model schema --map` lists its keys");
            match text.find(key) {
                Some(start) => bare.span(text, start..start + key.len()),
                None => bare,
            }
        })?;
        Ok(map)
    }
}
