//! The stability of a cell with six axes, pressed together: characteristic roots, and the delay that may be added.

use crate::error::Error;
use crate::model::{BodyModel, GeometryModel, SpaceModel, SpacePoseModel, turn, vector};
use nalgebra::{Matrix3, Matrix6, Vector3};
use serde::Serialize;
use sim_core::compensator::Architecture;
use sim_core::refusal::Refusal;
use sim_core::stability::budget::second_order_delay_s;
use sim_core::stability::space::{Carrier, SpaceLoop};

/// A root of a lower frequency is real: rounding of the eigenvalues.
const REAL_RAD_PER_S: f64 = 1e-9;
/// Roots that are told.
const ROOTS: usize = 6;
/// Longest delay that is added in the search for the margin, in s, the steps of the search, and halvings of the last: to 10 µs.
const DELAY_MAX_S: f64 = 0.32;
const STEPS: i32 = 32;
const HALVINGS: usize = 10;

/// Where a cell with six axes stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpaceAnswer {
    /// Version of this format.
    pub schema: u32,
    /// Whether every motion that meets a force decays.
    pub stable: bool,
    /// Mass that the contact feels along its normal, lever arms included.
    pub reduced_mass_kg: f64,
    /// Normal of the contact on the probe, in nozzle axes.
    pub normal: [f64; 3],
    /// Delay of what the sensor feels.
    pub felt_delay_s: f64,
    /// Delay of what the software adds.
    pub virtual_delay_s: f64,
    /// Rightmost characteristic roots.
    pub roots: Vec<RootAnswer>,
    /// Directions in which nothing pushes: they coast.
    pub free_directions: usize,
    /// Delay that may be added to both paths; negative: that must go. `None` if no such delay changes anything.
    pub delay_margin_s: Option<f64>,
    /// What the model holds and the prediction does not.
    pub left_out: Vec<String>,
}

/// A characteristic root.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RootAnswer {
    /// Growth, or decay below 0.
    pub growth_per_s: f64,
    /// Frequency.
    pub frequency_rad_per_s: f64,
}

/// Answers for a model with six axes.
pub fn assess_space(model: &SpaceModel) -> Result<SpaceAnswer, Error> {
    let mut left_out = Vec::new();
    let pressed = pressed(model, &mut left_out).map_err(refused)?;
    let spectrum = pressed.system().and_then(|system| system.rightmost(ROOTS)).map_err(refused)?;
    let root = |root: &sim_core::stability::spectral::Root| RootAnswer {
        growth_per_s: root.growth_per_s,
        // A real root leaves rounding there.
        frequency_rad_per_s: if root.frequency_rad_per_s < REAL_RAD_PER_S { 0.0 } else { root.frequency_rad_per_s },
    };
    let stable = spectrum.stable();
    Ok(SpaceAnswer {
        schema: 1,
        stable,
        reduced_mass_kg: pressed.reduced_mass_kg(),
        normal: pressed.normal.into(),
        felt_delay_s: pressed.felt_delay_s,
        virtual_delay_s: pressed.virtual_delay_s,
        roots: spectrum.roots.iter().map(root).collect(),
        free_directions: spectrum.rigid_modes,
        delay_margin_s: margin(&pressed, stable).map_err(refused)?,
        left_out,
    })
}

/// Growth of the slowest motion that meets a force.
pub(super) fn growth_per_s(model: &SpaceModel) -> Result<f64, Refusal> {
    let spectrum = pressed(model, &mut Vec::new())?.system()?.rightmost(1)?;
    if spectrum.neutral_radius >= 1.0 {
        return Ok(f64::INFINITY);
    }
    Ok(spectrum.roots.first().map_or(0.0, |root| root.growth_per_s))
}

fn refused(refusal: Refusal) -> Error {
    Error::new(refusal.to_string()).help("correct the model: dockhil model check MODEL.toml")
}

/// The linear loop of the cell where the probe is pressed into the nozzle, both as they begin.
fn pressed(model: &SpaceModel, left_out: &mut Vec<String>) -> Result<SpaceLoop, Refusal> {
    let (timing, software) = (&model.timing, &model.virtual_contact);
    let mut mobility_per_kg: Matrix6<f64> = carrier(&model.chaser).mobility_per_kg()?;
    if let Some(target) = &model.target {
        mobility_per_kg += carrier(target).mobility_per_kg()?;
    }
    let hold_s = 0.5 * timing.loop_period_s;
    let (mut both_s, mut felt_s, mut report_s) = (timing.command_delay_s + hold_s, 0.0, timing.measurement_delay_s);
    for effect in model.effects.iter().filter(|effect| effect.enabled) {
        let value = |name: &str| effect.values.get(name).copied().unwrap_or(0.0);
        match effect.id.as_str() {
            "command-delay" => both_s += value("delay_s"),
            "measurement-delay" => report_s += value("delay_s"),
            "force-delay" => felt_s += value("delay_s"),
            "force-lag" => {
                let poles = effect.values.get("order").copied().unwrap_or(1.0);
                felt_s += poles * second_order_delay_s(value("corner_frequency_hz"), 0.5);
            }
            "robot-second-order" => {
                both_s += second_order_delay_s(value("natural_frequency_hz"), value("damping_ratio"));
            }
            id => left_out.push(format!("{id}: run the scenario to see it")),
        }
    }
    if model.contact.friction > 0.0 {
        left_out.push(
            "friction: its force is as late as the rest, and may shake a contact across its normal that is stable here: run the \
             scenario, and judge its forces across"
                .to_owned(),
        );
    }
    let felt = if software.architecture == Architecture::PureSoftware { 0.0 } else { 1.0 };
    let added = if software.architecture == Architecture::PureHardware { 0.0 } else { 1.0 };
    let six = |along: [f64; 3], about: [f64; 3]| {
        let [x, y, z] = along.map(|value| added * value);
        let [a, b, c] = about.map(|value| added * value);
        [x, y, z, a, b, c]
    };
    let virtual_delay_s = match software.pose {
        SpacePoseModel::Measured => both_s + report_s,
        // The satellites' own pose: only the held force is late.
        SpacePoseModel::Commanded => hold_s,
    };
    Ok(SpaceLoop {
        mobility_per_kg,
        normal: normal(&model.geometry),
        stiffness_n_per_m: felt * model.contact.stiffness_n_per_m,
        damping_n_s_per_m: felt * model.contact.damping_n_s_per_m,
        felt_delay_s: both_s + felt_s,
        virtual_stiffness: six(software.stiffness_n_per_m, software.stiffness_n_m_per_rad),
        virtual_damping: six(software.damping_n_s_per_m, software.damping_n_m_s_per_rad),
        virtual_delay_s,
    })
}

/// A satellite in the axes of the nozzle, which those of its interface are where both begin.
fn carrier(body: &BodyModel) -> Carrier {
    let into_interface = turn(body.interface_turn_rad).inverse().to_rotation_matrix().into_inner();
    let inertia_kg_m2: Matrix3<f64> = into_interface * body.inertia() * into_interface.transpose();
    Carrier { mass_kg: body.mass_kg, inertia_kg_m2, lever_m: into_interface * vector(body.interface_m) }
}

/// The plane across the axis; or the wall of the cone where x of the nozzle meets it, which for a cone is any place.
fn normal(geometry: &GeometryModel) -> Vector3<f64> {
    match geometry {
        GeometryModel::Plane => -Vector3::z(),
        GeometryModel::Cone { half_angle_deg, .. } => {
            let half_rad = half_angle_deg.to_radians();
            Vector3::new(-libm::cos(half_rad), 0.0, -libm::sin(half_rad))
        }
    }
}

/// The delay at which the answer changes, added to both paths.
fn margin(pressed: &SpaceLoop, stable: bool) -> Result<Option<f64>, Refusal> {
    let shortest_s = pressed.felt_delay_s.min(pressed.virtual_delay_s);
    let far_s = if stable { DELAY_MAX_S } else { -shortest_s };
    let same = |added_s: f64| -> Result<bool, Refusal> {
        let moved = SpaceLoop {
            felt_delay_s: (pressed.felt_delay_s + added_s).max(0.0),
            virtual_delay_s: (pressed.virtual_delay_s + added_s).max(0.0),
            ..*pressed
        };
        Ok(moved.system()?.rightmost(1)?.stable() == stable)
    };
    let at = |step: i32| far_s * f64::from(step) / f64::from(STEPS);
    for step in 1..=STEPS {
        if same(at(step))? {
            continue;
        }
        let (mut from, mut to) = (at(step - 1), at(step));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            if same(middle)? { from = middle } else { to = middle }
        }
        return Ok(Some(0.5 * (from + to)));
    }
    Ok(None)
}
