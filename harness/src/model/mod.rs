//! The model file: what we believe of the rig, and which effects we added to it.
//!
//! TOML, units in the keys, unknown keys refused with their place. Each effect is one table and says where its numbers come
//! from. `dockhil model init` writes the nominal model from a recording's own `session` record.

use crate::error::Error;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_core::effect::{Attached, Catalog, Kind, Param, Where};
use sim_core::space::Axis;
use std::path::Path;

mod calibration;
mod edit;
mod init;
mod place;
mod robot;
mod schema;
mod text;
pub use calibration::{CalibrationModel, TemperatureModel};
pub use edit::{Editor, EffectText};
pub use init::from_session;
pub use robot::{ROBOT_AXES, RobotAxis, RobotForm, RobotModel};
pub use schema::schema;

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

/// Longest time of a model: a longer one is a millisecond taken for a second.
const TIME_MAX_S: f64 = 10.0;
/// Shortest physics step. Chosen: a thousandth of the usual one, and far above the nanosecond that time is counted in.
const STEP_MIN_S: f64 = 1e-6;

/// Which sign a number may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sign {
    Positive,
    NotNegative,
    Any,
}

impl Sign {
    fn help(self) -> &'static str {
        match self {
            Sign::Positive => "give a positive number in the unit of the key",
            Sign::NotNegative => "give zero or a positive number in the unit of the key",
            Sign::Any => "give a number in the unit of the key",
        }
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
        let model: Model = toml::from_str(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            // The parser speaks of Rust's types.
            let what =
                error.message().replace('\n', " ").replace(" f64", " a number").replace(" u32", " a whole number");
            Error::new(what).file(name).span(text, span).help("see the keys that are known with: dockhil model schema")
        })?;
        model.check(name, text, catalog)?;
        Ok(model)
    }

    /// The effects that take part, in the order of the file.
    pub fn chosen(&self, catalog: &Catalog<Axis>) -> Vec<Chosen> {
        let enabled = self.effects.iter().filter(|effect| effect.enabled);
        enabled.filter_map(|effect| catalog.get(&effect.id).map(|kind| effect.chosen(kind))).collect()
    }

    fn check(&self, name: &str, text: &str, catalog: &Catalog<Axis>) -> Result<(), Error> {
        let refuse = |key: &str, value: f64, limit: &str, help: &str| {
            let span = place::of_key(text, key);
            Err(Error::new(format!("{key} = {value} {limit}")).file(name).span(text, span).help(help.to_string()))
        };
        if self.schema != 1 {
            return refuse("schema", f64::from(self.schema), "is not 1, the only version there is", "set schema = 1");
        }
        let calibration = self.sensor.calibration.iter().flat_map(CalibrationModel::numbers);
        let identified = self.robot.iter().flat_map(RobotModel::numbers);
        for (key, value, sign) in self.numbers().into_iter().chain(calibration).chain(identified) {
            let (wrong, limit) = match sign {
                Sign::Positive => (value <= 0.0, "is not above 0"),
                Sign::NotNegative => (value < 0.0, "is below 0"),
                Sign::Any => (false, ""),
            };
            if wrong || value.is_nan() {
                let limit = if wrong || sign == Sign::Positive { limit } else { "is not a number" };
                return refuse(key, value, limit, sign.help());
            }
            let upper = if key.starts_with("timing.") { TIME_MAX_S } else { f64::MAX };
            if value.abs() > upper {
                let limit = format!("is above {upper}");
                return refuse(key, value, &limit, "give the value in the unit of the key");
            }
        }
        if let Some((key, what, help)) = self.robot.as_ref().and_then(RobotModel::contradiction) {
            return Err(Error::new(what).file(name).span(text, place::of_key(text, key)).help(help));
        }
        let timing = &self.timing;
        if timing.physics_step_s < STEP_MIN_S {
            let limit = format!("is below {STEP_MIN_S}");
            return refuse(
                "timing.physics_step_s",
                timing.physics_step_s,
                &limit,
                "a millisecond or less is fine enough",
            );
        }
        if self.rig == RigKind::Docking && timing.command_delay_s < timing.loop_period_s {
            let limit = format!("is shorter than one loop period, {} s", timing.loop_period_s);
            return refuse(
                "timing.command_delay_s",
                timing.command_delay_s,
                &limit,
                "the robot draws a straight line to a command that it must know: give at least one loop period",
            );
        }
        for (key, period_s) in
            [("timing.loop_period_s", timing.loop_period_s), ("timing.sensor_period_s", timing.sensor_period_s)]
        {
            let ratio = period_s / timing.physics_step_s;
            if (ratio - ratio.round()).abs() > 1e-6 {
                let limit = format!("is not a whole number of physics steps of {} s", timing.physics_step_s);
                return refuse(key, period_s, &limit, "choose a physics_step_s that divides every period");
            }
        }
        (0..self.effects.len()).try_for_each(|nth| self.check_effect(nth, name, text, catalog))
    }

    /// Every number outside the effects.
    fn numbers(&self) -> [(&'static str, f64, Sign); 21] {
        let (contact, timing, sensor) = (&self.contact, &self.timing, &self.sensor);
        let (software, scatter) = (&self.virtual_contact, &self.repeatability);
        [
            ("plant.mass_kg", self.plant.mass_kg, Sign::Positive),
            ("timing.loop_period_s", timing.loop_period_s, Sign::Positive),
            ("timing.sensor_period_s", timing.sensor_period_s, Sign::Positive),
            ("timing.physics_step_s", timing.physics_step_s, Sign::Positive),
            ("timing.command_delay_s", timing.command_delay_s, Sign::NotNegative),
            ("timing.measurement_delay_s", timing.measurement_delay_s, Sign::NotNegative),
            ("contact.stiffness_n_per_m", contact.stiffness_n_per_m, Sign::NotNegative),
            ("contact.damping_n_s_per_m", contact.damping_n_s_per_m, Sign::Any),
            ("contact.offset_n", contact.offset_n, Sign::Any),
            ("virtual_contact.stiffness_n_per_m", software.stiffness_n_per_m, Sign::Any),
            ("virtual_contact.damping_n_s_per_m", software.damping_n_s_per_m, Sign::Any),
            ("virtual_contact.dead_band_n", software.dead_band_n, Sign::NotNegative),
            ("sensor.tool_mass_kg", sensor.tool_mass_kg, Sign::NotNegative),
            ("sensor.bias_n", sensor.bias_n, Sign::Any),
            ("sensor.white_sigma_n", sensor.white_sigma_n, Sign::NotNegative),
            ("sensor.slow_sigma_n", sensor.slow_sigma_n, Sign::NotNegative),
            ("readout.position_sigma_m", self.readout.position_sigma_m, Sign::NotNegative),
            ("repeatability.stiffness_ratio", scatter.stiffness_ratio, Sign::NotNegative),
            ("repeatability.damping_ratio", scatter.damping_ratio, Sign::NotNegative),
            ("repeatability.force_offset_n", scatter.force_offset_n, Sign::NotNegative),
            ("repeatability.approach_speed_ratio", scatter.approach_speed_ratio, Sign::NotNegative),
        ]
    }

    fn check_effect(&self, nth: usize, name: &str, text: &str, catalog: &Catalog<Axis>) -> Result<(), Error> {
        let effect = &self.effects[nth];
        let at = |what: String, key: Option<&str>, help: String| {
            Err(Error::new(what).file(name).span(text, place::in_effect(text, nth, key)).help(help))
        };
        let Some(kind) = catalog.get(&effect.id) else {
            return at(unknown_effect(&effect.id, catalog), None, "see all of them with: dockhil effect list".into());
        };
        let fits = match self.rig {
            RigKind::Docking => kind.rigs != Where::Drive,
            RigKind::Drive => kind.rigs != Where::Docking,
        };
        if !fits {
            let what = format!("effect {} cannot happen on this rig", effect.id);
            return at(what, None, "see the rigs of each effect with: dockhil effect list".into());
        }
        if self.effects[..nth].iter().any(|other| other.id == effect.id) {
            let what = format!("effect {} stands in the file twice", effect.id);
            return at(what, None, "keep one of the two tables".into());
        }
        let known: Vec<&str> = kind.params.iter().map(|param| param.name.as_ref()).collect();
        if let Some(key) = effect.values.keys().find(|key| !known.contains(&key.as_str())) {
            let what = format!("effect {} has no parameter {key}", effect.id);
            return at(what, Some(key), format!("its parameters are: {}", known.join(", ")));
        }
        for param in &kind.params {
            let Some(value) = effect.values.get(param.name.as_ref()).copied().or(param.default) else {
                let what = format!("effect {} lacks its parameter {}", effect.id, param.name);
                return at(what, None, format!("add {} = a number in {}", param.name, param.unit));
            };
            if !(value >= param.lower && value <= param.upper) {
                let what = format!(
                    "{}.{} = {value} {} is outside [{}, {}]",
                    effect.id, param.name, param.unit, param.lower, param.upper
                );
                return at(what, Some(&param.name), "give a value inside, or remove the effect".into());
            }
            if param.discrete && !param.starts.contains(&value) {
                let what = format!("{}.{} = {value} is none of {:?}", effect.id, param.name, param.starts);
                return at(what, Some(&param.name), "choose one of them, or remove the effect".into());
            }
        }
        Ok(())
    }
}

impl EffectModel {
    /// With the values of this table.
    fn chosen(&self, kind: &Kind<Axis>) -> Chosen {
        let value =
            |param: &Param| self.values.get(param.name.as_ref()).copied().or(param.default).unwrap_or(param.off);
        Chosen { kind: kind.clone(), values: kind.params.iter().map(value).collect() }
    }
}

/// 'Unknown effect x; did you mean y?'
pub fn unknown_effect(id: &str, catalog: &Catalog<Axis>) -> String {
    let near = catalog.kinds().iter().map(|kind| (distance(id, &kind.id), &kind.id)).min();
    match near {
        Some((edits, other)) if edits <= id.len() / 2 => format!("unknown effect {id}; did you mean {other}?"),
        _ => format!("unknown effect {id}"),
    }
}

/// Levenshtein distance: how many letters differ.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let changed = corner + usize::from(letter != *other);
            corner = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}
