//! The parts of a docking cell that a model may choose: device, release, integrator, virtual contact, compensation. A model that
//! does not choose has a spring and a dashpot, released at zero force, held exactly, and no compensation.

use super::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sim_core::compensator::delay_compensation::Side;
use sim_core::compensator::{Architecture, Compensation, VirtualPose};
use sim_core::contact::{Empirical, Hertz, HuntCrossley, Row, Sides, SpringDashpot};
use sim_core::plant::PointIntegrator;
use sim_core::refusal::{Refusal, positive};

/// How the device answers a penetration. Stiffness and damping keep their meaning: at `depth_m` every law resists as the spring
/// and the dashpot of `contact` would, so that a fit turns the same two numbers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum LawModel {
    /// A spring and a dashpot.
    #[default]
    SpringDashpot,
    /// A power of the depth, and a dashpot.
    Hertz {
        /// Exponent; 1.5 for two round bodies.
        exponent: f64,
        /// Depth at which it resists as the spring would.
        depth_m: f64,
    },
    /// A power of the depth, with damping that grows with the force.
    HuntCrossley {
        /// Exponent of the depth.
        exponent: f64,
        /// Depth at which it resists as the spring and the dashpot would.
        depth_m: f64,
    },
    /// A measured spring: stiffness over depth from a table, and a dashpot.
    Table {
        /// Pairs of a depth in m and the stiffness there over `stiffness_n_per_m`; depths grow, at most sixteen.
        rows: Vec<[f64; 2]>,
    },
}

/// When a contact lets go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ReleaseModel {
    /// At zero force: it never pulls.
    #[default]
    ZeroForce,
    /// At zero depth: the dashpot may pull until then.
    ZeroDepth,
}

impl ReleaseModel {
    /// Which way the device acts.
    pub fn sides(self) -> Sides {
        match self {
            ReleaseModel::ZeroForce => Sides::One,
            ReleaseModel::ZeroDepth => Sides::OnePulling,
        }
    }
}

/// A device, built.
#[expect(clippy::large_enum_variant, reason = "one is made for each run, and taken apart before the run begins")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Device {
    /// See [`SpringDashpot`].
    SpringDashpot(SpringDashpot),
    /// See [`Hertz`].
    Hertz(Hertz),
    /// See [`HuntCrossley`].
    HuntCrossley(HuntCrossley),
    /// See [`Empirical`].
    Table(Empirical),
}

impl LawModel {
    /// The device with this stiffness and damping.
    ///
    /// # Errors
    /// When a number has no meaning.
    pub fn device(&self, stiffness_n_per_m: f64, damping_n_s_per_m: f64, sides: Sides) -> Result<Device, Refusal> {
        let power = |exponent: f64, depth_m: f64| {
            positive("exponent", exponent, "1")?;
            positive("depth_m", depth_m, "m")?;
            Ok(stiffness_n_per_m * libm::pow(depth_m, 1.0 - exponent))
        };
        Ok(match self {
            LawModel::SpringDashpot => {
                Device::SpringDashpot(SpringDashpot { stiffness_n_per_m, damping_n_s_per_m, sides })
            }
            LawModel::Hertz { exponent, depth_m } => {
                Device::Hertz(Hertz::new(power(*exponent, *depth_m)?, *exponent, damping_n_s_per_m, sides)?)
            }
            LawModel::HuntCrossley { exponent, depth_m } => {
                let stiffness = power(*exponent, *depth_m)?;
                // 3/2 c K d₀ⁿ = b, with K d₀ⁿ = k d₀. Without a spring there is no force for the damping to grow with.
                let resists_n = 1.5 * stiffness_n_per_m * depth_m;
                let damping_s_per_m = if resists_n > 0.0 { damping_n_s_per_m / resists_n } else { 0.0 };
                Device::HuntCrossley(HuntCrossley::new(stiffness, *exponent, damping_s_per_m, sides)?)
            }
            LawModel::Table { rows } => {
                let row = |[amplitude_m, ratio]: &[f64; 2]| Row {
                    amplitude_m: *amplitude_m,
                    stiffness_n_per_m: ratio * stiffness_n_per_m,
                };
                let rows: Vec<Row> = rows.iter().map(row).collect();
                Device::Table(Empirical::new(&rows, damping_n_s_per_m, sides)?)
            }
        })
    }
}

/// What a recording's session record says of the parts, where they are not the usual ones.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Parts {
    integrator: PointIntegrator,
    release: ReleaseModel,
    architecture: Architecture,
    law: LawModel,
    pose: VirtualPose,
    compensation: Compensation,
}

impl Parts {
    /// The key of the session record.
    pub const KEY: &'static str = "model_parts";

    fn of(model: &Model) -> Self {
        Parts {
            integrator: model.plant.integrator,
            release: model.contact.release,
            architecture: model.virtual_contact.architecture,
            law: model.contact.law.clone(),
            pose: model.virtual_contact.pose,
            compensation: model.compensation,
        }
    }

    /// The text for the record; none for the usual parts.
    pub fn text(model: &Model) -> Option<String> {
        let parts = Parts::of(model);
        if parts == Parts::default() { None } else { toml::to_string(&parts).ok() }
    }

    /// Reads the text of a record.
    pub fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.message().replace('\n', " "))
    }

    /// Puts the parts into a model.
    pub fn put(self, model: &mut Model) {
        model.plant.integrator = self.integrator;
        model.contact.release = self.release;
        model.contact.law = self.law;
        model.virtual_contact.architecture = self.architecture;
        model.virtual_contact.pose = self.pose;
        model.compensation = self.compensation;
    }
}

impl Model {
    /// Whether the parts are the usual ones, which are the only ones that a drive can have.
    pub(super) fn has_usual_parts(&self) -> bool {
        Parts::of(self) == Parts::default()
    }

    /// Whether the compensator listens to the pose that the robot reports.
    pub fn hears_pose(&self) -> bool {
        let software = &self.virtual_contact;
        let is_virtual = software.stiffness_n_per_m != 0.0 || software.damping_n_s_per_m != 0.0;
        let virtual_part = is_virtual && software.architecture.computes() && software.pose != VirtualPose::Commanded;
        let responds =
            matches!(self.compensation, Compensation::ResponseError(_) | Compensation::IdentifiedResponse(_));
        virtual_part || responds
    }

    /// Whether the command is another pose than the satellites': then it does not tell what force acted on them.
    pub fn moves_command(&self) -> bool {
        match self.compensation {
            Compensation::Extrapolation(_) => true,
            Compensation::Passivity(passivity) => passivity.side == Side::Velocity,
            _ => false,
        }
    }
}

/// Numbers of a method of compensation, for the schema; words where it is not a number.
const METHODS: [(&str, &[&str]); 10] = [
    ("none", &[]),
    ("virtual-damping", &["stiffness_n_per_m", "delay_s"]),
    ("phase-lead", &["delay_s"]),
    ("smith-predictor", &["stiffness_n_per_m", "delay_s"]),
    ("smith-lead", &["delay_s"]),
    ("extrapolation", &["order", "delay_s"]),
    ("response-error", &["stiffness_n_per_m", "forward_s"]),
    ("identified-response", &["initial_stiffness_n_per_m", "forgetting", "forward_s"]),
    ("passivity", &["side"]),
    ("energy-tank", &["initial_j"]),
];

/// The schema of `[compensation]`.
pub(super) fn compensation_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let one = |(method, keys): &(&str, &[&str])| tagged("method", method, keys);
    let all: Vec<Value> = METHODS.iter().map(one).collect();
    schemars::Schema::try_from(json!({ "oneOf": all })).unwrap_or_default()
}

/// The schema of the pose of the virtual contact.
pub(super) fn pose_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let estimators = [
        tagged("method", "forward", &["readout_delay_s"]),
        tagged("method", "command-history", &["dead_time_s", "readout_delay_s"]),
    ];
    let estimated = json!({
        "type": "object",
        "properties": { "estimated": { "oneOf": estimators } },
        "required": ["estimated"],
        "additionalProperties": false,
    });
    let schema = json!({ "oneOf": [{ "enum": ["measured", "commanded"] }, estimated] });
    schemars::Schema::try_from(schema).unwrap_or_default()
}

/// A table that says which kind it is and then names numbers; two words are choices.
fn tagged(tag: &str, name: &str, keys: &[&str]) -> Value {
    let mut properties = serde_json::Map::from_iter([(tag.to_owned(), json!({ "const": name }))]);
    let mut required = vec![json!(tag)];
    for key in keys {
        let choice = match *key {
            "order" => json!({ "enum": ["velocity", "cubic"] }),
            "side" => json!({ "enum": ["force", "velocity"] }),
            _ => json!({ "type": "number" }),
        };
        properties.insert((*key).to_owned(), choice);
        required.push(json!(key));
    }
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
}

/// Whether a value is the usual one, which a file need not write.
pub(super) fn is_usual<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every method of the schema is one that a model reads, with these keys and no other.
    #[test]
    fn the_schema_lists_the_methods_that_a_model_reads() {
        for (method, keys) in METHODS {
            let value = |key: &&str| match *key {
                "order" => "order = \"cubic\"\n".to_owned(),
                "side" => "side = \"force\"\n".to_owned(),
                key => format!("{key} = 0.5\n"),
            };
            let text: String =
                std::iter::once(format!("method = \"{method}\"\n")).chain(keys.iter().map(value)).collect();
            let read: Compensation = toml::from_str(&text).unwrap();
            let written = toml::Table::try_from(read).unwrap();
            assert_eq!(written.len(), keys.len() + 1, "{method}: {written}");
            for key in keys {
                assert!(written.contains_key(*key), "{method} has {key}");
            }
        }
    }

    #[test]
    fn every_law_resists_as_the_spring_does_at_its_depth() {
        use sim_core::contact::DepthLaw;
        use sim_core::space::AxisTouch;
        let touch = AxisTouch { depth_m: 0.004, rate_m_per_s: 0.01 };
        let laws = [
            LawModel::SpringDashpot,
            LawModel::Hertz { exponent: 1.5, depth_m: 0.004 },
            LawModel::HuntCrossley { exponent: 1.5, depth_m: 0.004 },
            LawModel::Table { rows: vec![[0.002, 0.5], [0.004, 1.0]] },
        ];
        for law in laws {
            let force = match law.device(1000.0, 40.0, Sides::One).unwrap() {
                Device::SpringDashpot(law) => law.resistance(&touch),
                Device::Hertz(law) => law.resistance(&touch),
                Device::HuntCrossley(law) => law.resistance(&touch),
                Device::Table(law) => law.resistance(&touch),
            };
            // A power of a power: a few roundings.
            assert!((force.elastic - 4.0).abs() < 1e-13 && (force.dissipative - 0.4).abs() < 1e-13, "{law:?}");
        }
    }
}
