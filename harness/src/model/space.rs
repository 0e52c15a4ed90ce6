//! The model of a docking cell with six axes: two satellites with their lever arms, probe and nozzle, device, sensor, software.
//!
//! TOML, units in the keys, unknown keys refused with their place. Vectors are in the axes that the key names: of a body, of the
//! probe, or of the nozzle, where positive z closes the gap.

use super::check::parsed;
use super::{EffectModel, List, ReleaseModel, RigKind, TimingModel, check_effects, place};
use crate::error::Error;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_core::compensator::{Architecture, AxisPair, HybridSpace, SpacePose};
use sim_core::contact::{Friction, SMOOTHING_M_PER_S, SpringDashpot};
use sim_core::effect::Catalog;
use sim_core::force_sensor::{SpaceCell, WrenchNoise};
use sim_core::frames::Pose;
use sim_core::geometry::{Cone, Plane};
use sim_core::link::Link;
use sim_core::plant::{Body, Integrator, TwoBody};
use sim_core::readout::Readout;
use sim_core::refusal::{Refusal, not_negative};
use sim_core::rig::DockingSpace;
use sim_core::robot::StraightLine;
use sim_core::space::{Axis, Wrench};

/// A whole model with six axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpaceModel {
    /// Version of this format.
    pub schema: u32,
    /// What the model is called in reports.
    pub name: String,
    /// What kind of rig it is.
    pub rig: SpaceRig,
    /// The satellite that carries the probe.
    pub chaser: BodyModel,
    /// The satellite that carries the nozzle; without it the nozzle is fixed.
    pub target: Option<BodyModel>,
    /// Where the interfaces touch.
    pub geometry: GeometryModel,
    /// The device in contact.
    pub contact: SpaceContactModel,
    /// Delays and clocks.
    #[serde(default)]
    pub timing: TimingModel,
    /// The virtual contact in software.
    #[serde(default)]
    pub virtual_contact: SpaceVirtualModel,
    /// The force/torque sensor and its tool.
    #[serde(default)]
    pub sensor: SpaceSensorModel,
    /// Read-out noise of the pose.
    #[serde(default)]
    pub readout: super::ReadoutModel,
    /// What was added to the nominal model; an effect of one axis acts along z of the nozzle.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectModel>,
}

/// The kind of rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpaceRig {
    /// A docking cell with six axes.
    DockingSpace,
}

/// A satellite.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyModel {
    /// Mass.
    pub mass_kg: f64,
    /// Moments of inertia about the centre of mass, in body axes.
    pub inertia_kg_m2: [f64; 3],
    /// Products of inertia xy, xz, yz, in body axes.
    #[serde(default)]
    pub inertia_products_kg_m2: [f64; 3],
    /// The interface from the centre of mass, in body axes: probe tip of the chaser, origin of the nozzle of the target.
    pub interface_m: [f64; 3],
    /// How the interface is turned against the body: axis times angle.
    #[serde(default)]
    pub interface_turn_rad: [f64; 3],
}

/// Where the interfaces touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum GeometryModel {
    /// A plane across the axis, and a point.
    Plane,
    /// A cone with rim and throat, and a round tip; the origin is the middle of the rim.
    Cone {
        /// Radius of the rim.
        rim_radius_m: f64,
        /// Radius of the throat.
        throat_radius_m: f64,
        /// Angle between axis and wall.
        half_angle_deg: f64,
        /// Radius of the tip.
        tip_radius_m: f64,
    },
}

/// The device, along the normal of the contact, with friction across it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpaceContactModel {
    /// Stiffness.
    pub stiffness_n_per_m: f64,
    /// Damping.
    pub damping_n_s_per_m: f64,
    /// Coefficient of friction.
    #[serde(default)]
    pub friction: f64,
    /// When the device lets go.
    #[serde(default)]
    pub release: ReleaseModel,
}

/// The virtual contact, along and about x, y, z of the nozzle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpaceVirtualModel {
    /// Stiffness along.
    pub stiffness_n_per_m: [f64; 3],
    /// Damping along.
    pub damping_n_s_per_m: [f64; 3],
    /// Stiffness about.
    pub stiffness_n_m_per_rad: [f64; 3],
    /// Damping about.
    pub damping_n_m_s_per_rad: [f64; 3],
    /// It acts while z of the pose is above this.
    pub onset_m: f64,
    /// Below this force, with the torque below its own and before the onset, the felt load counts as zero.
    pub dead_band_n: f64,
    /// The same for the torque.
    pub dead_band_n_m: f64,
    /// Which contact the satellites feel.
    #[schemars(with = "String", extend("enum" = ["pure-hardware", "pure-software", "hybrid"]))]
    pub architecture: Architecture,
    /// The pose that the virtual contact is at.
    pub pose: SpacePoseModel,
}

/// The pose that a virtual contact in space is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpacePoseModel {
    /// As the robot reports it.
    #[default]
    Measured,
    /// As it was commanded.
    Commanded,
}

/// The force/torque sensor, along the probe's axes at its tip, on a cell whose axis is level.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpaceSensorModel {
    /// Mass of the declared tool, at the probe tip.
    pub tool_mass_kg: f64,
    /// Known bias of the force.
    pub bias_n: [f64; 3],
    /// Known bias of the torque.
    pub bias_n_m: [f64; 3],
    /// Standard deviation of the white noise of each force.
    pub white_sigma_n: f64,
    /// Standard deviation of the white noise of each torque.
    pub white_sigma_n_m: f64,
}

/// A device of this project in space.
pub(crate) type SpaceLaw = Friction<SpringDashpot>;

impl SpaceModel {
    /// Whether a text says that it is a model with six axes.
    pub fn is_meant(text: &str) -> bool {
        toml::from_str::<toml::Table>(text)
            .is_ok_and(|table| table.get("rig").and_then(toml::Value::as_str) == Some("docking-space"))
    }

    /// Reads a model from text; `name` stands in errors.
    pub fn parse(name: &str, text: &str, catalog: &Catalog<Axis>) -> Result<Self, Error> {
        let model: SpaceModel = parsed(name, text, "dockhil model schema --space")?;
        let refuse = |key: &str, what: String, help: &str| {
            Err(Error::new(what).file(name).span(text, place::of_key(text, key)).help(help.to_owned()))
        };
        if model.schema != 1 {
            return refuse(
                "schema",
                format!("schema = {} is not 1, the only version there is", model.schema),
                "set schema = 1",
            );
        }
        if let Err(fault) = model.timing.check(true) {
            return refuse(fault.key, format!("{} = {} {}", fault.key, fault.value, fault.limit), fault.help);
        }
        if let Err((table, refusal)) = model.checked() {
            let help = "correct the value; see the keys with: dockhil model schema --space";
            return refuse(&format!("{table}.{}", refusal.name), format!("{table}: {refusal}"), help);
        }
        if let GeometryModel::Cone { throat_radius_m, tip_radius_m, .. } = model.geometry
            && tip_radius_m > throat_radius_m
        {
            return refuse(
                "geometry.tip_radius_m",
                format!(
                    "tip_radius_m = {tip_radius_m} m is above throat_radius_m = {throat_radius_m} m: it does not fit"
                ),
                "a tip docks in the throat: make it smaller, or the throat wider",
            );
        }
        let effects: Vec<&EffectModel> = model.effects.iter().collect();
        check_effects(&List { effects: &effects, rig: RigKind::Docking, name, text, catalog })?;
        Ok(model)
    }

    /// Builds every part once; the table that holds what has no meaning comes with the refusal.
    fn checked(&self) -> Result<(), (&'static str, Refusal)> {
        let at = |table: &'static str| move |refusal: Refusal| (table, refusal);
        self.chaser.body().map_err(at("chaser"))?;
        self.target.as_ref().map(BodyModel::body).transpose().map_err(at("target"))?;
        self.plant().map_err(of_interface)?;
        self.law().map_err(at("contact"))?;
        self.compensator().check().map_err(at("virtual_contact"))?;
        self.cone().map_err(at("geometry"))?;
        let sensor = &self.sensor;
        not_negative("white_sigma_n", sensor.white_sigma_n, "N").map_err(at("sensor"))?;
        not_negative("white_sigma_n_m", sensor.white_sigma_n_m, "N m").map_err(at("sensor"))?;
        not_negative("position_sigma_m", self.readout.position_sigma_m, "m").map_err(at("readout"))?;
        Ok(())
    }

    pub(crate) fn plant(&self) -> Result<TwoBody, Refusal> {
        let target = self.target.as_ref().map(BodyModel::body).transpose()?.unwrap_or_else(Body::fixed);
        let nozzle = self.target.as_ref().map_or_else(Pose::default, |target| {
            Pose::new(vector(target.interface_m), turn(target.interface_turn_rad))
        });
        let probe = Pose::new(vector(self.chaser.interface_m), turn(self.chaser.interface_turn_rad));
        TwoBody::new(self.chaser.body()?, target, probe, nozzle, Integrator::ExactHold)
    }

    fn law(&self) -> Result<SpaceLaw, Refusal> {
        let contact = &self.contact;
        let normal = SpringDashpot {
            stiffness_n_per_m: contact.stiffness_n_per_m,
            damping_n_s_per_m: contact.damping_n_s_per_m,
            sides: contact.release.sides(),
        };
        Friction::new(normal.checked()?, contact.friction, SMOOTHING_M_PER_S)
            .map_err(|refusal| Refusal { name: "friction", ..refusal })
    }

    /// The cone, if the geometry is one.
    pub(crate) fn cone(&self) -> Result<Option<Cone>, Refusal> {
        match self.geometry {
            GeometryModel::Plane => Ok(None),
            GeometryModel::Cone { rim_radius_m, throat_radius_m, half_angle_deg, tip_radius_m } => {
                Cone::new(rim_radius_m, throat_radius_m, half_angle_deg.to_radians(), tip_radius_m).map(Some).map_err(
                    |refusal| match refusal.name {
                        "half_angle_rad" => {
                            Refusal { name: "half_angle_deg", value: half_angle_deg, unit: "deg", ..refusal }
                        }
                        _ => refusal,
                    },
                )
            }
        }
    }

    /// The sensor, as it is known and as it is.
    pub(crate) fn cell(&self) -> SpaceCell {
        let sensor = &self.sensor;
        let bias = Wrench { force_n: vector(sensor.bias_n), torque_n_m: vector(sensor.bias_n_m) };
        SpaceCell::level(sensor.tool_mass_kg * crate::blocks::GRAVITY_M_PER_S2, bias)
    }

    fn compensator(&self) -> HybridSpace {
        let software = &self.virtual_contact;
        let pair = |along: [f64; 3], about: [f64; 3]| AxisPair { along: vector(along), about: vector(about) };
        HybridSpace {
            known: self.cell(),
            virtual_stiffness: pair(software.stiffness_n_per_m, software.stiffness_n_m_per_rad),
            virtual_damping: pair(software.damping_n_s_per_m, software.damping_n_m_s_per_rad),
            onset_m: software.onset_m,
            dead_band_n: software.dead_band_n,
            dead_band_n_m: software.dead_band_n_m,
            architecture: software.architecture,
            virtual_pose: match software.pose {
                SpacePoseModel::Measured => SpacePose::Measured,
                SpacePoseModel::Commanded => SpacePose::Commanded,
            },
        }
    }

    /// The rig with this geometry and these satellites.
    pub(crate) fn rig<G>(&self, geometry: G, plant: TwoBody) -> DockingSpace<G, SpaceLaw> {
        DockingSpace {
            plant,
            link: Link { dead_time_s: self.timing.command_delay_s },
            robot: StraightLine { corner_s: self.timing.loop_period_s, averaging_s: 2.0 * self.timing.sensor_period_s },
            readout: Readout { delay_s: self.timing.measurement_delay_s },
            geometry,
            law: self.law().expect("the model was checked"),
            sensor: self.cell(),
            noise: WrenchNoise::NONE,
            compensator: self.compensator(),
        }
    }

    /// Reduced mass along z of the nozzle, lever arms included, where both bodies begin: `1/m = Σ 1/mᵢ + (rᵢ × z) · Jᵢ⁻¹ (rᵢ × z)`.
    pub fn reduced_mass_kg(&self) -> f64 {
        let inverse = |body: &BodyModel| {
            let axis = turn(body.interface_turn_rad) * Vector3::z();
            let lever = vector(body.interface_m).cross(&axis);
            let turned = body.inertia().try_inverse().map_or(0.0, |inverse| lever.dot(&(inverse * lever)));
            1.0 / body.mass_kg + turned
        };
        1.0 / (inverse(&self.chaser) + self.target.as_ref().map_or(0.0, inverse))
    }

    /// What touches nothing but a plane.
    pub(crate) fn plane(&self) -> Plane {
        Plane
    }
}

impl BodyModel {
    /// The tensor about the centre of mass, in body axes.
    pub(crate) fn inertia(&self) -> Matrix3<f64> {
        let ([xx, yy, zz], [xy, xz, yz]) = (self.inertia_kg_m2, self.inertia_products_kg_m2);
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    fn body(&self) -> Result<Body, Refusal> {
        Body::new(self.mass_kg, self.inertia())
    }
}

/// The table and the key of a file that a refusal of the two bodies is about.
fn of_interface(refusal: Refusal) -> (&'static str, Refusal) {
    let (table, name) = match refusal.name {
        "probe.position_m" => ("chaser", "interface_m"),
        "probe.attitude" => ("chaser", "interface_turn_rad"),
        "nozzle.position_m" => ("target", "interface_m"),
        "nozzle.attitude" => ("target", "interface_turn_rad"),
        name => ("chaser", name),
    };
    (table, Refusal { name, unit: if name == "interface_turn_rad" { "rad" } else { refusal.unit }, ..refusal })
}

/// Three numbers of a file.
pub(crate) fn vector(numbers: [f64; 3]) -> Vector3<f64> {
    Vector3::from(numbers)
}

/// Axis times angle.
pub(crate) fn turn(turn_rad: [f64; 3]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(vector(turn_rad))
}
