//! The model file: what we believe of the rig, and which effects we added to it.
//!
//! TOML, units in the keys, unknown keys refused with their place. Each effect is one table and says where its numbers come
//! from. `dockhil model init` writes the nominal model from a recording's own `session` record.

use crate::error::Error;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_core::compensator::{Architecture, Compensation, VirtualPose};
use sim_core::effect::{Attached, Catalog, Kind, Param};
use sim_core::plant::PointIntegrator;
use sim_core::space::Axis;
use std::path::Path;

mod calibration;
mod check;
mod edit;
mod effects;
mod init;
mod parts;
pub(crate) mod place;
mod robot;
mod schema;
mod space;
mod text;
pub use calibration::{CalibrationModel, TemperatureModel};
use check::Sign;
pub use check::parsed;
pub use edit::{Editor, EffectText};
pub use effects::unknown_effect;
pub(crate) use effects::{DELAY_HELP, List, check_delays, check_effects, delays, nearest};
pub use init::from_session;
pub(crate) use parts::Parts;
pub use parts::{Device, LawModel, ReleaseModel};
pub use robot::{ROBOT_AXES, RobotAxis, RobotForm, RobotModel};
pub(crate) use schema::effect_schemas;
pub use schema::{schema, space_schema};
pub use space::{BodyModel, GeometryModel, SpaceModel, SpacePoseModel};
pub(crate) use space::{turn, vector};

/// A whole model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Version of this format.
    pub schema: u32,
    /// What the model is called in reports.
    pub name: String,
    /// What kind of rig it is.
    pub rig: RigKind,
    /// What moves.
    pub plant: PlantModel,
    /// The device in contact, or the bearing of a drive.
    pub contact: ContactModel,
    /// Delays and clocks.
    #[serde(default)]
    pub timing: TimingModel,
    /// The virtual contact in software.
    #[serde(default)]
    pub virtual_contact: VirtualContactModel,
    /// The force sensor and its tool.
    #[serde(default)]
    pub sensor: SensorModel,
    /// Read-out noise of the pose.
    #[serde(default)]
    pub readout: ReadoutModel,
    /// How the delay of the loop is made up for.
    #[serde(default, skip_serializing_if = "parts::is_usual")]
    #[schemars(schema_with = "parts::compensation_schema")]
    pub compensation: Compensation,
    /// What was identified of the robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotModel>,
    /// How well a run repeats another one.
    #[serde(default)]
    pub repeatability: Repeatability,
    /// What was added to the nominal model.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectModel>,
}

/// The kind of rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RigKind {
    /// A docking cell: satellites in software, a robot, a device, a force sensor.
    Docking,
    /// An axis that a known force drives.
    Drive,
}

/// What moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlantModel {
    /// Reduced mass of the satellites, or the moving mass of a drive. A recording's own record holds where it differs.
    pub mass_kg: f64,
    /// How the position follows from the force, which is held for one tick.
    #[serde(default, skip_serializing_if = "parts::is_usual")]
    #[schemars(with = "String", extend("enum" = ["exact-hold", "semi-implicit", "explicit"]))]
    pub integrator: PointIntegrator,
}

/// The device in contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactModel {
    /// Stiffness.
    pub stiffness_n_per_m: f64,
    /// Damping.
    pub damping_n_s_per_m: f64,
    /// A constant force that resists positive motion: the offset of a drive.
    #[serde(default)]
    pub offset_n: f64,
    /// When the device lets go.
    #[serde(default, skip_serializing_if = "parts::is_usual")]
    pub release: ReleaseModel,
    /// How the device answers a penetration.
    #[serde(default, skip_serializing_if = "parts::is_usual")]
    pub law: LawModel,
}

/// Delays and clocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TimingModel {
    /// From a command to the pose.
    pub command_delay_s: f64,
    /// From the pose to its report.
    pub measurement_delay_s: f64,
    /// Period of satellites and link.
    pub loop_period_s: f64,
    /// Period of the force sensor.
    pub sensor_period_s: f64,
    /// Physics step; divides every period.
    pub physics_step_s: f64,
}

impl Default for TimingModel {
    fn default() -> Self {
        TimingModel {
            command_delay_s: 0.0,
            measurement_delay_s: 0.0,
            loop_period_s: 0.004,
            sensor_period_s: 0.001,
            physics_step_s: 0.001,
        }
    }
}

/// The virtual contact.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VirtualContactModel {
    /// Virtual stiffness.
    pub stiffness_n_per_m: f64,
    /// Virtual damping.
    pub damping_n_s_per_m: f64,
    /// Below this force, and without penetration, the force counts as zero.
    pub dead_band_n: f64,
    /// Which contact the satellites feel: the real one, the virtual one, or both.
    #[serde(skip_serializing_if = "parts::is_usual")]
    #[schemars(with = "String", extend("enum" = ["pure-hardware", "pure-software", "hybrid"]))]
    pub architecture: Architecture,
    /// The pose that the virtual contact penetrates.
    #[serde(skip_serializing_if = "parts::is_usual")]
    #[schemars(schema_with = "parts::pose_schema")]
    pub pose: VirtualPose,
}

/// The force sensor and its tool, along the axis.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SensorModel {
    /// Mass of the declared tool.
    pub tool_mass_kg: f64,
    /// Known bias along the axis.
    pub bias_n: f64,
    /// Standard deviation of the white noise; a static recording overrides it.
    pub white_sigma_n: f64,
    /// Standard deviation of the slow noise; a static recording overrides it.
    pub slow_sigma_n: f64,
    /// What a calibration found in six axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<CalibrationModel>,
}

/// Read-out noise of the pose.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReadoutModel {
    /// Standard deviation of the position.
    pub position_sigma_m: f64,
}

/// Declared repeatability from run to run, one standard deviation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Repeatability {
    /// Of the stiffness, relative.
    pub stiffness_ratio: f64,
    /// Of the damping, relative.
    pub damping_ratio: f64,
    /// Of the force's offset.
    pub force_offset_n: f64,
    /// Of the approach speed, relative.
    pub approach_speed_ratio: f64,
}

impl Default for Repeatability {
    fn default() -> Self {
        Repeatability { stiffness_ratio: 0.01, damping_ratio: 0.03, force_offset_n: 0.03, approach_speed_ratio: 0.01 }
    }
}

/// One effect that was added.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectModel {
    /// Which effect.
    pub id: String,
    /// Whether it takes part.
    #[serde(default = "yes")]
    pub enabled: bool,
    /// Where its numbers come from.
    #[serde(default)]
    pub source: String,
    /// Its parameters, by name.
    #[serde(flatten)]
    pub values: std::collections::BTreeMap<String, f64>,
}

fn yes() -> bool {
    true
}

/// A catalogue entry together with its values.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// The entry.
    pub kind: Kind<Axis>,
    /// One value for each of its parameters.
    pub values: Vec<f64>,
}

impl Chosen {
    /// With every parameter at its first start.
    pub fn at_start(kind: &Kind<Axis>) -> Self {
        Chosen { kind: kind.clone(), values: kind.params.iter().map(|param| param.starts[0]).collect() }
    }

    /// Ready to run.
    pub fn attach(&self) -> Attached<Axis> {
        self.kind.attach(&self.values)
    }
}

impl Model {
    /// Reads a model file.
    pub fn read(path: &Path, catalog: &Catalog<Axis>) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|error| {
            Error::new(format!("cannot read the model: {error}"))
                .file(path)
                .help("check the path, or write a nominal model with: dockhil model init RECORDING.mcap -o MODEL.toml")
        })?;
        Model::parse(&path.display().to_string(), &text, catalog)
    }

    /// Reads a model from text; `name` stands in errors.
    pub fn parse(name: &str, text: &str, catalog: &Catalog<Axis>) -> Result<Self, Error> {
        if SpaceModel::is_meant(text) {
            let span = place::of_key(text, "rig");
            return Err(Error::new("the model has six axes, and this command works along one")
                .file(name)
                .span(text, span)
                .help("run it as a scenario: dockhil run; ask about its loop: dockhil stability MODEL.toml"));
        }
        check_rig(name, text)?;
        let model: Model = parsed(name, text, "dockhil model schema")?;
        model.check(name, text, catalog)?;
        Ok(model)
    }

    /// The effects that take part, in the order of the file.
    pub fn chosen(&self, catalog: &Catalog<Axis>) -> Vec<Chosen> {
        let enabled = self.effects.iter().filter(|effect| effect.enabled);
        enabled.filter_map(|effect| catalog.get(&effect.id).map(|kind| effect.chosen(kind))).collect()
    }
}

/// Refuses a rig of no kind with all kinds that there are: the parser knows those along one axis alone.
fn check_rig(name: &str, text: &str) -> Result<(), Error> {
    let table = toml::from_str::<toml::Table>(text).unwrap_or_default();
    let Some(rig) = table.get("rig").and_then(toml::Value::as_str) else { return Ok(()) };
    match rig {
        "docking" | "docking-space" | "drive" => Ok(()),
        _ => Err(Error::new(format!("unknown rig `{rig}`, expected `docking`, `docking-space` or `drive`"))
            .file(name)
            .span(text, place::of_key(text, "rig"))
            .help("docking runs along one axis, docking-space with six; a drive is an axis that a known force drives")),
    }
}

impl EffectModel {
    /// With the values of this table.
    pub(crate) fn chosen(&self, kind: &Kind<Axis>) -> Chosen {
        let value =
            |param: &Param| self.values.get(param.name.as_ref()).copied().or(param.default).unwrap_or(param.off);
        Chosen { kind: kind.clone(), values: kind.params.iter().map(value).collect() }
    }
}
