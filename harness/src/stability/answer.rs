//! The answer as data. Delays in s, damping in N s/m; a margin is positive on the stable side.

use super::cell::Linear;
use super::subject::{Cell, OneDelay, Subject};
use super::{growth_per_s, is_stable};
use crate::error::Error;
use serde::Serialize;
use sim_core::refusal::{Refusal, finite, not_negative, positive};
use sim_core::stability::budget::{Line, Path, budget};
use sim_core::stability::sampled::SampledInterval;
use sim_core::stability::{exact, impact, pade};

/// Longest delay that is added in the search for the margin, in s.
const DELAY_MAX_S: f64 = 1.0;
/// Ticks of dead time that the prediction of the sampled loop holds, less a rounding.
const TICKS_MAX: f64 = 99.999;
/// Delays that are tried towards longer ones, each twice the one before, and towards shorter ones.
const DOUBLINGS: i32 = 12;
const GRID: i32 = 64;
/// Halvings of an interval: down to a nanosecond.
const HALVINGS: usize = 30;

/// Where the loop stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// Version of this format.
    pub schema: u32,
    /// Whether it is stable; `None` if no delay was given.
    pub stable: Option<bool>,
    /// Reduced mass.
    pub mass_kg: f64,
    /// Stiffness, hardware and virtual together.
    pub stiffness_n_per_m: f64,
    /// Damping, hardware and virtual together.
    pub damping_n_s_per_m: f64,
    /// The dead time; of a cell the one that its budget adds up to.
    pub delay_s: Option<f64>,
    /// The dead time that one delay could have at most: closed form.
    pub critical_delay_s: Option<f64>,
    /// Frequency of the oscillation there.
    pub critical_frequency_rad_per_s: Option<f64>,
    /// The same by the Padé approximation of first order: always too long, never a criterion.
    pub pade_critical_delay_s: Option<f64>,
    /// The longest dead time that any damping stabilises, and that damping; `None` where the contact pushes apart.
    pub longest_delay_s: Option<f64>,
    /// See [`Answer::longest_delay_s`].
    pub longest_delay_damping_n_s_per_m: Option<f64>,
    /// The damping that stabilises at this delay, by the closed form.
    pub damping_interval: Option<Edges>,
    /// Rate at which the slowest motion grows, 1/s.
    pub growth_per_s: Option<f64>,
    /// Delay that may be added; `None` if no delay that was tried changes the answer.
    pub delay_margin: Option<Margin>,
    /// The longest delay that was added in the search for it.
    pub delay_searched_s: Option<f64>,
    /// Damping that may be taken away: virtual, or that of the device where none is needed of the software.
    pub damping_margin_low: Option<Margin>,
    /// Damping that may be added.
    pub damping_margin_high: Option<Margin>,
    /// Of a cell: the loop as its computers run it.
    pub sampled: Option<Sampled>,
    /// Contact that never pulls: another boundary, computed and not the linear one; `None` where the delay is longer than a contact,
    /// and where the contact pulls: a virtual part does.
    pub one_sided: Option<OneSided>,
    /// Of a cell: the sensor feels at least as much undeclared mass as the satellites have.
    pub too_heavy_a_tool: bool,
    /// Who makes the force late.
    pub budget: Vec<Budgeted>,
    /// What the model holds and the prediction does not.
    pub left_out: Vec<String>,
    /// Names of those of them that may turn the answer round: the model is not decided by this prediction.
    pub undecided_by: Vec<String>,
}

/// An interval of damping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Edges {
    /// Below it the loop grows.
    pub low_n_s_per_m: f64,
    /// Above it the loop grows; `None`: there is no such edge.
    pub high_n_s_per_m: Option<f64>,
}

/// A distance to an edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Margin {
    /// In s or N s/m.
    pub distance: f64,
    /// In per cent of the edge.
    pub per_cent: Option<f64>,
}

impl Margin {
    /// At this distance from this edge.
    pub(super) fn to_edge(distance: f64, edge: f64) -> Self {
        Margin { distance, per_cent: (edge > 0.0).then(|| 100.0 * distance / edge) }
    }
}

/// The sampled loop: exact, from its monodromy matrix.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sampled {
    /// Virtual damping that stabilises, all else as it is.
    pub virtual_damping: Option<Edges>,
    /// Largest eigenvalue of one tick.
    pub growth_per_tick: f64,
}

/// Contact that never pulls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OneSided {
    /// Restitution of one impact with the delay of the budget; above 1 the impact creates energy.
    pub restitution: Option<f64>,
    /// Damping from which on an impact loses energy; `None`: none does.
    pub neutral_damping_n_s_per_m: Option<f64>,
    /// Damping from which on it creates energy again; `None`: there is no such damping, or none that can be told.
    pub neutral_damping_high_n_s_per_m: Option<f64>,
}

/// One line of the delay budget.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Budgeted {
    /// Who.
    pub name: String,
    /// Which stiffness it makes late: `hardware`, `virtual` or `both`.
    pub path: &'static str,
    /// Its delay.
    pub delay_s: f64,
    /// What it adds to the delay of the whole stiffness.
    pub contribution_s: f64,
    /// What it costs in damping; `None` if no damping suffices.
    pub damping_n_s_per_m: Option<f64>,
}

impl Budgeted {
    /// A line of the budget as data.
    pub(super) fn of(line: &Line) -> Self {
        Budgeted {
            name: line.contributor.name.clone(),
            path: match line.contributor.path {
                Path::Hardware => "hardware",
                Path::Virtual => "virtual",
                Path::Both => "both",
            },
            delay_s: line.contributor.delay_s,
            contribution_s: line.contribution_s,
            damping_n_s_per_m: line.damping_n_s_per_m,
        }
    }
}

/// Answers. Input without meaning is refused; what is unstable is answered.
pub fn assess(subject: &Subject) -> Result<Answer, Error> {
    let refused = |refusal: Refusal| {
        let help = if refusal.limit.contains("ticks") {
            "the prediction of the sampled loop holds up to 100 ticks of dead time: take a longer loop_period_s, or ask for one \
             dead time: dockhil stability --mass-kg … --delay-s …"
        } else {
            "give every value in the unit of its name"
        };
        Error::new(refusal.to_string()).help(help)
    };
    match subject {
        Subject::OneDelay(one) => one_delay(subject, one).map_err(refused),
        Subject::Cell(cell) => of_cell(subject, cell).map_err(refused),
        Subject::Space(_) => Err(Error::new("a model with six axes is told by its roots")),
    }
}

/// What the closed form says at this delay.
fn closed_form(mass_kg: f64, stiffness: f64, damping: f64, delay_s: Option<f64>) -> Result<Answer, Refusal> {
    if stiffness < 0.0 {
        return pushed_apart(mass_kg, stiffness, damping, delay_s);
    }
    if stiffness == 0.0 {
        return damped_alone(mass_kg, damping, delay_s);
    }
    let found = exact::assess(mass_kg, stiffness, damping, delay_s.unwrap_or(0.0))?;
    let margin = |margin: exact::Margin| {
        let per_cent = margin.per_cent.is_finite().then_some(margin.per_cent);
        margin.distance.is_finite().then_some(Margin { distance: margin.distance, per_cent })
    };
    let given = delay_s.map(|_| found);
    Ok(Answer {
        schema: 1,
        // Without damping any dead time is too long.
        stable: given.map(|found| found.stable).or(found.critical.is_none().then_some(false)),
        mass_kg,
        stiffness_n_per_m: stiffness,
        damping_n_s_per_m: damping,
        delay_s,
        critical_delay_s: found.critical.map(|critical| critical.delay_s),
        critical_frequency_rad_per_s: found.critical.map(|critical| critical.frequency_rad_per_s),
        pade_critical_delay_s: pade::critical_delay_pade(mass_kg, stiffness, damping).map(|edge| edge.delay_s),
        longest_delay_s: Some(found.longest.delay_s),
        longest_delay_damping_n_s_per_m: Some(found.longest.damping_n_s_per_m),
        damping_interval: given.and_then(|found| found.interval).map(|edges| Edges {
            low_n_s_per_m: edges.low_n_s_per_m,
            high_n_s_per_m: edges.high_n_s_per_m.is_finite().then_some(edges.high_n_s_per_m),
        }),
        growth_per_s: None,
        delay_margin: given.and_then(|found| margin(found.delay_margin)),
        delay_searched_s: None,
        damping_margin_low: given.and_then(|found| found.low_margin).and_then(margin),
        damping_margin_high: given.and_then(|found| found.high_margin).and_then(margin),
        sampled: None,
        one_sided: None,
        too_heavy_a_tool: false,
        budget: Vec::new(),
        left_out: Vec::new(),
        undecided_by: Vec::new(),
    })
}

/// A negative stiffness, such as that of a device preloaded too far: unstable at any delay and any damping.
fn pushed_apart(mass_kg: f64, stiffness: f64, damping: f64, delay_s: Option<f64>) -> Result<Answer, Refusal> {
    positive("mass_kg", mass_kg, "kg")?;
    finite("stiffness_n_per_m", stiffness, "N/m")?;
    finite("damping_n_s_per_m", damping, "N s/m")?;
    not_negative("delay_s", delay_s.unwrap_or(0.0), "s")?;
    Ok(Answer {
        schema: 1,
        stable: Some(false),
        mass_kg,
        stiffness_n_per_m: stiffness,
        damping_n_s_per_m: damping,
        delay_s,
        critical_delay_s: None,
        critical_frequency_rad_per_s: None,
        pade_critical_delay_s: None,
        longest_delay_s: None,
        longest_delay_damping_n_s_per_m: None,
        damping_interval: None,
        growth_per_s: None,
        delay_margin: None,
        delay_searched_s: None,
        damping_margin_low: None,
        damping_margin_high: None,
        sampled: None,
        one_sided: None,
        too_heavy_a_tool: false,
        budget: Vec::new(),
        left_out: Vec::new(),
        undecided_by: Vec::new(),
    })
}

/// A damper without a spring, `m s + b e^{-hs} = 0` beside a free position: it holds the speed up to h = π m / 2 b.
fn damped_alone(mass_kg: f64, damping: f64, delay_s: Option<f64>) -> Result<Answer, Refusal> {
    let answer = pushed_apart(mass_kg, 0.0, damping, delay_s)?;
    if damping <= 0.0 {
        return Ok(answer);
    }
    let quarter_turn = std::f64::consts::FRAC_PI_2;
    let critical_s = quarter_turn * mass_kg / damping;
    let below = |value: f64, edge: f64| Margin::to_edge(edge - value, edge);
    let most = |delay_s: f64| quarter_turn * mass_kg / delay_s;
    let late_s = delay_s.filter(|delay_s| *delay_s > 0.0);
    Ok(Answer {
        stable: delay_s.map(|delay_s| delay_s < critical_s),
        critical_delay_s: Some(critical_s),
        critical_frequency_rad_per_s: Some(damping / mass_kg),
        damping_interval: delay_s.map(|_| Edges { low_n_s_per_m: 0.0, high_n_s_per_m: late_s.map(most) }),
        delay_margin: delay_s.map(|delay_s| below(delay_s, critical_s)),
        damping_margin_low: delay_s.map(|_| Margin::to_edge(damping, 0.0)),
        damping_margin_high: late_s.map(|delay_s| below(damping, most(delay_s))),
        ..answer
    })
}

fn one_delay(subject: &Subject, one: &OneDelay) -> Result<Answer, Refusal> {
    let (mass, stiffness, damping) = (one.mass_kg, one.stiffness_n_per_m, one.damping_n_s_per_m);
    let answer = closed_form(mass, stiffness, damping, one.delay_s)?;
    let size = answer.critical_frequency_rad_per_s.unwrap_or(1.0);
    if !size.is_normal() {
        let limit = "is out of proportion to stiffness and damping: give all three of one order";
        return Err(Refusal { name: "mass_kg", value: mass, unit: "kg", limit });
    }
    let Some(delay_s) = one.delay_s else { return Ok(answer) };
    if stiffness <= 0.0 {
        return Ok(Answer { growth_per_s: growth_per_s(subject), ..answer });
    }
    Ok(Answer {
        growth_per_s: growth_per_s(subject),
        one_sided: one_sided(mass, stiffness, damping, delay_s)?,
        ..answer
    })
}

fn of_cell(subject: &Subject, cell: &Cell) -> Result<Answer, Refusal> {
    let linear = Linear::of(cell);
    linear.sampled.checked()?;
    let sampled = &linear.sampled;
    let mass = sampled.mass_kg;
    let stiffness = linear.stiffness.hardware_n_per_m + linear.stiffness.virtual_n_per_m;
    let damping =
        sampled.hardware_damping_n_s_per_m + sampled.virtual_damping_n_s_per_m + sampled.own_damping_n_s_per_m;
    if stiffness < 0.0 {
        let answer = pushed_apart(mass, stiffness, damping, None)?;
        let (left_out, undecided_by) = (linear.left_out, linear.undecided);
        return Ok(Answer { growth_per_s: growth_per_s(subject), left_out, undecided_by, ..answer });
    }
    let budget = budget(mass, linear.stiffness, &linear.contributors)?;
    let answer = closed_form(mass, stiffness, damping, Some(budget.delay_s))?;
    let stable = is_stable(subject).unwrap_or(false);
    let growth = growth_per_s(subject).unwrap_or(f64::INFINITY);
    let answer = Answer {
        stable: Some(stable),
        growth_per_s: growth.is_finite().then_some(growth),
        budget: budget.lines.iter().map(Budgeted::of).collect(),
        left_out: linear.left_out.clone(),
        undecided_by: linear.undecided.clone(),
        ..answer
    };
    if linear.tool_mass_kg >= cell.model.plant.mass_kg {
        return Ok(hopeless(answer));
    }
    let interval = linear.sampled.damping_interval()?;
    let (delay_margin, delay_searched_s) = match delay_margin(subject, &linear, stable) {
        Found::Edge(margin) => (Some(margin), None),
        Found::NoneUntil(searched_s) => (None, Some(searched_s).filter(|searched_s| *searched_s > 0.0)),
    };
    let [low, high] = damping_margins(&linear, interval.as_ref())?;
    Ok(Answer {
        delay_margin,
        delay_searched_s,
        damping_margin_low: low,
        damping_margin_high: high,
        sampled: Some(Sampled {
            virtual_damping: interval
                .map(|edges| Edges { low_n_s_per_m: edges.low_n_s_per_m, high_n_s_per_m: Some(edges.high_n_s_per_m) }),
            growth_per_tick: linear.sampled.growth_per_tick()?,
        }),
        one_sided: if linear.pulls { None } else { one_sided(mass, stiffness, damping, budget.delay_s)? },
        ..answer
    })
}

/// Too heavy a tool is unstable in free flight whatever the damping: no interval of it helps, and no contact is of interest.
fn hopeless(answer: Answer) -> Answer {
    Answer {
        too_heavy_a_tool: true,
        critical_delay_s: None,
        critical_frequency_rad_per_s: None,
        pade_critical_delay_s: None,
        longest_delay_s: None,
        longest_delay_damping_n_s_per_m: None,
        damping_interval: None,
        delay_margin: None,
        damping_margin_low: None,
        damping_margin_high: None,
        ..answer
    }
}

/// The damping that may go and that may be added: of the software where it has some or needs some, otherwise of the device.
fn damping_margins(linear: &Linear, software: Option<&SampledInterval>) -> Result<[Option<Margin>; 2], Refusal> {
    let needs = software.is_none_or(|edges| edges.low_n_s_per_m > 0.0);
    let of_software = linear.computes && (needs || linear.stiffness.hardware_n_per_m == 0.0);
    let hardware = if of_software { None } else { linear.sampled.hardware_damping_interval()? };
    let (edges, here) = match (hardware, software) {
        (Some(edges), _) => (edges, linear.sampled.hardware_damping_n_s_per_m),
        (None, Some(edges)) => (*edges, linear.sampled.virtual_damping_n_s_per_m),
        (None, None) => return Ok([None, None]),
    };
    // Where neither is needed, all of the larger one may go.
    let free = edges.low_n_s_per_m == 0.0 && linear.computes;
    let goes = if free { here.max(linear.sampled.virtual_damping_n_s_per_m) } else { here - edges.low_n_s_per_m };
    let low = Margin::to_edge(goes, edges.low_n_s_per_m);
    Ok([Some(low), Some(Margin::to_edge(edges.high_n_s_per_m - here, edges.high_n_s_per_m))])
}

/// What a search for an edge found.
enum Found {
    Edge(Margin),
    /// None up to here, or as far as it can be told.
    NoneUntil(f64),
}

/// Delay of the command that may be added, or that must go.
fn delay_margin(subject: &Subject, linear: &Linear, stable: bool) -> Found {
    let name = "timing.command_delay_s";
    let Some(here) = subject.get(name) else { return Found::NoneUntil(0.0) };
    let with = |delay_s: f64| is_stable(&subject.with(name, here + delay_s));
    let same = |delay_s: f64| with(delay_s).map(|found| found == stable);
    // Towards longer delays a stable loop is left once, so that few delays are tried, longer and longer. The prediction holds up to a
    // hundred ticks. Towards shorter ones all are tried down to one tick, the shortest delay that a cell can have.
    let tick_s = linear.sampled.tick_s;
    let longest_s = DELAY_MAX_S.min(TICKS_MAX * tick_s - linear.sampled.dead_time_s).max(0.0);
    let at = |step: i32| match stable {
        true if step == 0 => 0.0,
        true => longest_s * libm::exp2(f64::from(step - DOUBLINGS)),
        false => (tick_s - here) * f64::from(step) / f64::from(GRID),
    };
    let last = if stable { DOUBLINGS } else { GRID };
    let Some(first) = (1..=last).find(|step| same(at(*step)) != Some(true)) else {
        return Found::NoneUntil(at(last).abs());
    };
    let (mut from, mut to) = (at(first - 1), at(first));
    // Where it cannot be told any more there is no edge to be told either.
    if same(to).is_none() {
        return Found::NoneUntil(from.abs());
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (from + to);
        match same(middle) {
            Some(true) => from = middle,
            Some(false) => to = middle,
            None => return Found::NoneUntil(from.abs()),
        }
    }
    let distance = 0.5 * (from + to);
    Found::Edge(Margin::to_edge(distance, here + distance))
}

/// The one-sided impact with this delay; `None` where the delay is longer than a contact.
fn one_sided(mass_kg: f64, stiffness: f64, damping: f64, delay_s: f64) -> Result<Option<OneSided>, Refusal> {
    let contact = impact::OneSided {
        mass_kg,
        stiffness_n_per_m: stiffness,
        damping_n_s_per_m: damping.max(0.0),
        delay_s,
        pull: impact::Pull::Never,
    };
    if !contact.is_told() {
        return Ok(None);
    }
    let restitution = if damping >= 0.0 { Some(contact.impact()?.restitution) } else { None };
    Ok(Some(OneSided {
        restitution,
        neutral_damping_n_s_per_m: contact.unit_restitution_damping()?,
        neutral_damping_high_n_s_per_m: contact.unit_restitution_damping_above()?,
    }))
}
