//! The stability of a cell with six axes, pressed together: characteristic roots, the delay and the damping that may be added, and
//! who makes the force along the contact's normal late.

use super::answer::{Budgeted, Margin};
use crate::error::Error;
use crate::model::{BodyModel, GeometryModel, SpaceModel, SpacePoseModel, turn, vector};
use nalgebra::{Matrix3, Matrix6, Vector3};
use serde::Serialize;
use sim_core::compensator::Architecture;
use sim_core::refusal::Refusal;
use sim_core::stability::budget::{Contributor, Path, Stiffness, budget, second_order_delay_s};
use sim_core::stability::space::{Carrier, SpaceLoop};
use std::cell::Cell;

/// A root of a lower frequency is real: rounding of the eigenvalues.
const REAL_RAD_PER_S: f64 = 1e-9;
/// Roots that are told.
const ROOTS: usize = 6;
/// Longest delay that is added in the search for the margin, in s.
const DELAY_MAX_S: f64 = 0.32;
/// The shortest delay that counts in the search for the damping, in s.
const SHORTEST_S: f64 = 1e-4;
/// Cubes of rows of all matrices that a search may look at: about a second.
const EFFORT_MAX: f64 = 2e8;
/// Steps of a search, and halvings of the last: a delay is found to 10 µs.
const STEPS: i32 = 32;
const HALVINGS: usize = 10;

/// The contributor that every path has.
const HELD: &str = "force held for one tick";

/// Where a cell with six axes stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpaceAnswer {
    /// Version of this format.
    pub schema: u32,
    /// Whether every motion that meets a force decays.
    pub stable: bool,
    /// Mass that the contact feels along its normal, lever arms included.
    pub reduced_mass_kg: f64,
    /// Stiffness along the normal, hardware and virtual together.
    pub stiffness_n_per_m: f64,
    /// Damping along the normal, hardware and virtual together.
    pub damping_n_s_per_m: f64,
    /// What the budget adds up to, along the normal; `None` where nothing holds the contact together.
    pub delay_s: Option<f64>,
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
    /// Delay that may be added to both paths, in per cent of all that there is then along the normal; negative: that must go.
    /// `None` if no such delay changes anything.
    pub delay_margin: Option<Margin>,
    /// Damping of the contact that may go along its normal, in per cent of the least that is stable; negative: that is missing.
    pub damping_margin_low: Option<Margin>,
    /// Damping of the contact that may be added along its normal; negative: that is too much.
    pub damping_margin_high: Option<Margin>,
    /// The margins were not searched to the end: delay times stiffness is out of proportion.
    pub search_gave_up: bool,
    /// Who makes the force along the normal late.
    pub budget: Vec<Budgeted>,
    /// What the model holds and the prediction does not.
    pub left_out: Vec<String>,
    /// Names of those of them that may turn the answer round: the model is not decided by this prediction.
    pub undecided_by: Vec<String>,
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
    let Pressed { space, contributors, left_out, undecided_by } = pressed(model).map_err(refused)?;
    let spectrum = space.system().and_then(|system| system.rightmost(ROOTS)).map_err(refused)?;
    let root = |root: &sim_core::stability::spectral::Root| RootAnswer {
        growth_per_s: root.growth_per_s,
        // A real root leaves rounding there.
        frequency_rad_per_s: if root.frequency_rad_per_s < REAL_RAD_PER_S { 0.0 } else { root.frequency_rad_per_s },
    };
    let (stable, reduced_mass_kg) = (spectrum.stable(), space.reduced_mass_kg());
    let along = |values: &[f64; 6]| -> f64 { (0..3).map(|i| values[i] * space.normal[i] * space.normal[i]).sum() };
    let stiffness =
        Stiffness { hardware_n_per_m: space.stiffness_n_per_m, virtual_n_per_m: along(&space.virtual_stiffness) };
    let stiffness_n_per_m = stiffness.hardware_n_per_m + stiffness.virtual_n_per_m;
    let damping_n_s_per_m = space.damping_n_s_per_m + along(&space.virtual_damping);
    let holds = stiffness_n_per_m > 0.0;
    let budget = holds.then(|| budget(reduced_mass_kg, stiffness, &contributors)).transpose().map_err(refused)?;
    let delay_s = budget.as_ref().map(|budget| budget.delay_s);
    let searched = margins(&space, stable, delay_s, damping_n_s_per_m);
    let search_gave_up = matches!(searched, Err(Stop::Effort));
    let [delay_margin, low, high] = match searched {
        Ok(margins) => margins,
        Err(Stop::Effort) => [None; 3],
        Err(Stop::Refused(refusal)) => return Err(refused(refusal)),
    };
    Ok(SpaceAnswer {
        schema: 1,
        stable,
        reduced_mass_kg,
        stiffness_n_per_m,
        damping_n_s_per_m,
        delay_s,
        normal: space.normal.into(),
        felt_delay_s: space.felt_delay_s,
        virtual_delay_s: space.virtual_delay_s,
        roots: spectrum.roots.iter().map(root).collect(),
        free_directions: spectrum.rigid_modes,
        delay_margin,
        damping_margin_low: low,
        damping_margin_high: high,
        search_gave_up,
        budget: budget.iter().flat_map(|budget| &budget.lines).map(Budgeted::of).collect(),
        left_out,
        undecided_by,
    })
}

/// Growth of the slowest motion that meets a force.
pub(super) fn growth_per_s(model: &SpaceModel) -> Result<f64, Refusal> {
    let spectrum = pressed(model)?.space.system()?.rightmost(1)?;
    if spectrum.neutral_radius >= 1.0 {
        return Ok(f64::INFINITY);
    }
    Ok(spectrum.roots.first().map_or(0.0, |root| root.growth_per_s))
}

fn refused(refusal: Refusal) -> Error {
    Error::new(refusal.to_string()).help("correct the model: dockhil model check MODEL.toml")
}

/// The linear loop of the cell where the probe is pressed into the nozzle, both as they begin.
struct Pressed {
    space: SpaceLoop,
    contributors: Vec<Contributor>,
    left_out: Vec<String>,
    undecided_by: Vec<String>,
}

fn pressed(model: &SpaceModel) -> Result<Pressed, Refusal> {
    let (timing, software) = (&model.timing, &model.virtual_contact);
    let mut mobility_per_kg: Matrix6<f64> = carrier(&model.chaser).mobility_per_kg()?;
    if let Some(target) = &model.target {
        mobility_per_kg += carrier(target).mobility_per_kg()?;
    }
    let hold_s = 0.5 * timing.loop_period_s;
    let (mut left_out, mut undecided_by) = (Vec::new(), Vec::new());
    let mut contributors: Vec<Contributor> = Vec::new();
    let mut late = |name: &str, path: Path, delay_s: f64| {
        contributors.push(Contributor { name: name.to_owned(), path, delay_s });
    };
    late("dead time of the command", Path::Both, timing.command_delay_s);
    late("read-back of the pose", Path::Virtual, timing.measurement_delay_s);
    late(HELD, Path::Both, hold_s);
    for effect in model.effects.iter().filter(|effect| effect.enabled) {
        let value = |name: &str| effect.values.get(name).copied().unwrap_or(0.0);
        match effect.id.as_str() {
            id @ "command-delay" => late(id, Path::Both, value("delay_s")),
            id @ "measurement-delay" => late(id, Path::Virtual, value("delay_s")),
            id @ "force-delay" => late(id, Path::Hardware, value("delay_s")),
            id @ "force-lag" => {
                let poles = effect.values.get("order").copied().unwrap_or(1.0);
                late(id, Path::Hardware, poles * second_order_delay_s(value("corner_frequency_hz"), 0.5));
            }
            id @ "robot-second-order" => {
                late(id, Path::Both, second_order_delay_s(value("natural_frequency_hz"), value("damping_ratio")));
            }
            id => {
                left_out.push(format!("{id}: run the scenario to see it"));
                undecided_by.push(id.to_owned());
            }
        }
    }
    if model.contact.friction > 0.0 {
        left_out.push(
            "friction: its force is as late as the rest, and may shake a contact across its normal that is stable here: run the \
             scenario, and judge its forces across"
                .to_owned(),
        );
        undecided_by.push("friction".to_owned());
    }
    let felt = if software.architecture == Architecture::PureSoftware { 0.0 } else { 1.0 };
    let added = if software.architecture == Architecture::PureHardware { 0.0 } else { 1.0 };
    let six = |along: [f64; 3], about: [f64; 3]| {
        let [x, y, z] = along.map(|value| added * value);
        let [a, b, c] = about.map(|value| added * value);
        [x, y, z, a, b, c]
    };
    if software.pose == SpacePoseModel::Commanded {
        // The satellites' own pose: only the held force is late.
        contributors.iter_mut().filter(|one| one.path == Path::Both).for_each(|one| one.path = Path::Hardware);
        contributors.retain(|one| one.path != Path::Virtual);
        contributors.push(Contributor { name: HELD.to_owned(), path: Path::Virtual, delay_s: hold_s });
    }
    let sum = |other: Path| -> f64 {
        let on = contributors.iter().filter(|one| one.path == Path::Both || one.path == other);
        on.map(|one| one.delay_s).sum()
    };
    let space = SpaceLoop {
        mobility_per_kg,
        normal: normal(&model.geometry),
        stiffness_n_per_m: felt * model.contact.stiffness_n_per_m,
        damping_n_s_per_m: felt * model.contact.damping_n_s_per_m,
        felt_delay_s: sum(Path::Hardware),
        virtual_stiffness: six(software.stiffness_n_per_m, software.stiffness_n_m_per_rad),
        virtual_damping: six(software.damping_n_s_per_m, software.damping_n_m_s_per_rad),
        virtual_delay_s: sum(Path::Virtual),
    };
    Ok(Pressed { space, contributors, left_out, undecided_by })
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

/// Why a search ended without an answer.
enum Stop {
    /// A loop without meaning.
    Refused(Refusal),
    /// It would take too long.
    Effort,
}

impl From<Refusal> for Stop {
    fn from(refusal: Refusal) -> Self {
        Stop::Refused(refusal)
    }
}

/// Answers whether loops are stable, until that takes too long.
struct Search {
    spent: Cell<f64>,
}

impl Search {
    fn is_stable(&self, space: &SpaceLoop) -> Result<bool, Stop> {
        let system = space.system()?;
        let rows = system.rows() as f64;
        self.spent.set(self.spent.get() + rows * rows * rows);
        if self.spent.get() > EFFORT_MAX {
            return Err(Stop::Effort);
        }
        Ok(system.rightmost(1)?.stable())
    }
}

/// The first value on the way to `far` at which the answer is another one, with more of the steps near 0.
fn first_change(far: f64, is: &dyn Fn(f64) -> Result<bool, Stop>) -> Result<Option<f64>, Stop> {
    let at = |step: i32| far * (f64::from(step) / f64::from(STEPS)) * (f64::from(step) / f64::from(STEPS));
    let here = is(0.0)?;
    for step in 1..=STEPS {
        if is(at(step))? == here {
            continue;
        }
        let (mut from, mut to) = (at(step - 1), at(step));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            if is(middle)? == here { from = middle } else { to = middle }
        }
        return Ok(Some(0.5 * (from + to)));
    }
    Ok(None)
}

/// The margin of delay, and those of damping down and up.
fn margins(space: &SpaceLoop, stable: bool, delay_s: Option<f64>, damping: f64) -> Result<[Option<Margin>; 3], Stop> {
    let search = Search { spent: Cell::new(0.0) };
    let delay = delay_margin(&search, space, stable, delay_s)?;
    let [low, high] = damping_margins(&search, space, stable, damping)?;
    Ok([delay, low, high])
}

/// The delay at which the answer changes, added to both paths.
fn delay_margin(
    search: &Search,
    space: &SpaceLoop,
    stable: bool,
    delay_s: Option<f64>,
) -> Result<Option<Margin>, Stop> {
    let shortest_s = space.felt_delay_s.min(space.virtual_delay_s);
    let far_s = if stable { DELAY_MAX_S } else { -shortest_s };
    let is_stable = |added_s: f64| {
        search.is_stable(&SpaceLoop {
            felt_delay_s: (space.felt_delay_s + added_s).max(0.0),
            virtual_delay_s: (space.virtual_delay_s + added_s).max(0.0),
            ..*space
        })
    };
    Ok(first_change(far_s, &is_stable)?.map(|distance| Margin::to_edge(distance, delay_s.unwrap_or(0.0) + distance)))
}

/// The damping of the contact along its normal at which the answer changes: what may go, and what may be added.
fn damping_margins(search: &Search, space: &SpaceLoop, stable: bool, here: f64) -> Result<[Option<Margin>; 2], Stop> {
    let is_stable =
        |added: f64| search.is_stable(&SpaceLoop { damping_n_s_per_m: space.damping_n_s_per_m + added, ..*space });
    // One delay τ alone bears π m / 2 τ of damping; twice that is beyond any edge.
    let far = core::f64::consts::PI * space.reduced_mass_kg() / space.felt_delay_s.max(SHORTEST_S);
    let low_edge = |change: f64| Margin::to_edge(-change, here + change);
    let high_edge = |change: f64| Margin::to_edge(change, here + change);
    if stable {
        let (less, more) = (first_change(-far, &is_stable)?, first_change(far, &is_stable)?);
        return Ok([less.map(low_edge), more.map(high_edge)]);
    }
    if let Some(missing) = first_change(far, &is_stable)? {
        // Beyond the edge that is found the search begins anew.
        let inside = missing * (1.0 + 1e-3);
        let beyond = first_change(far, &|added| is_stable(inside + added))?;
        return Ok([Some(low_edge(missing)), beyond.map(|added| high_edge(inside + added))]);
    }
    Ok([None, first_change(-far, &is_stable)?.map(high_edge)])
}
