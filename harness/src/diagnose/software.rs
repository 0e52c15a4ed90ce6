//! The software block: recorded force in, commanded pose out. It is our own arithmetic, so it closes to rounding, whatever is
//! missing in the hardware; what does not close names a wrong clock, mass or compensator before anything else is blamed.
//!
//! For every tick, `x₊ - 2x + x₋ = -(F + F₋) T² / (2m)`, with F from the sample that carries the tick's own stamp and from the
//! pose that the controller had at hand (its own, without read-out noise). Where that pose follows from the commands (dead time
//! and read-back), nothing in it is fitted. An extra delay on the way shows itself in the virtual force and is found exactly.

use super::gaps::Gaps;
use super::stretches::{Judged, edges, rounding_m};
use crate::blocks::{self, Cell, Held};
use crate::case::Case;
use crate::model::{Chosen, Model};
use serde::Serialize;
use sim_core::closed_loop::{Clamps, Start};
use sim_core::effect::Attached;
use sim_core::force_sensor::SensorNoise;
use sim_core::plant::PointIntegrator;
use sim_core::rng::Streams;
use sim_core::signals::Wire;
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// A block that closes this well is our own software, recomputed: a hundred times the rounding of a metre, far below a
/// micrometre of anything real.
pub const CLOSED_M: f64 = 1e-9;
/// Furthest shift between the two clocks that is searched, in samples of the force sensor.
const SHIFT_MAX: i64 = 60;
/// Ticks with a felt force above this take part: below it the dead band may have acted either way.
pub(super) const FELT_N: f64 = 1.0;

/// What the software block says of one recording.
#[derive(Debug, Clone, Serialize)]
pub struct Software {
    /// Largest difference between recorded and recomputed command, as the model stands, in m; `None` where nothing closes the
    /// loop (no satellites).
    pub closure_m: Option<f64>,
    /// What the rounding of the recorded commands on their wire allows, in m: the first two of them say how fast the satellites were.
    #[serde(skip)]
    pub rounding_m: f64,
    /// The same as `closure_m`, with what was found below.
    pub closure_found_m: Option<f64>,
    /// By how much the force's stamps are late against the robot's, in s, if another sample than the tick's own was used.
    pub clock_offset_s: f64,
    /// Mass that the recording was made with, over the mass that its record or the model declares.
    pub mass_ratio: f64,
    /// Bias that the compensator took out, beyond the declared one, in N.
    pub bias_error_n: f64,
    /// Delay of the controller's own pose, beyond the declared delays, in s, where the virtual force shows it.
    pub pose_delay_s: Option<f64>,
    /// What the recording lacks, if it lacks anything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gaps: Option<Gaps>,
}

impl Software {
    /// Nothing was examined: there is no software, or no contact that it felt.
    pub fn not_examined() -> Self {
        Software {
            closure_m: None,
            rounding_m: 0.0,
            closure_found_m: None,
            clock_offset_s: 0.0,
            mass_ratio: 1.0,
            bias_error_n: 0.0,
            pose_delay_s: None,
            gaps: None,
        }
    }

    /// Whether our own software, as the model describes it, made this recording; true also where it is not judged.
    pub fn closes(&self) -> bool {
        self.closure_m.is_none_or(|closure_m| closes(closure_m, self.rounding_m))
    }

    /// Whether there is enough of the recording to judge it, or nothing to judge.
    pub fn is_judged(&self) -> bool {
        self.gaps.as_ref().is_none_or(Gaps::is_enough)
    }

    /// Whether it does with what was found.
    pub fn explained(&self) -> bool {
        self.closes() || self.closure_found_m.is_some_and(|closure_m| closes(closure_m, self.rounding_m))
    }
}

/// Whether what is left is rounding.
pub(super) fn closes(closure_m: f64, rounding_m: f64) -> bool {
    closure_m < CLOSED_M + rounding_m
}

/// Largest difference between the recorded commands and those that our software makes of the recorded force.
pub fn closure_m(model: &Model, case: &Case, effects: &[Chosen], mass_ratio: f64) -> f64 {
    let (commanded, _) = recomputed(model, case, &Inputs { mass_ratio, ..Inputs::plain(effects) });
    let pairs = case.commanded.iter().zip(&commanded).zip(&case.commanded_known);
    pairs.filter(|(_, known)| **known).map(|((a, b), _)| (a.position_m - b).abs()).fold(0.0, f64::max)
}

/// What our software makes of the recorded force: commanded position in m and net force in N, at each tick of the loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Recomputed {
    /// Commanded position, before the tick's force acts.
    pub commanded_m: Vec<f64>,
    /// Net force of the tick; positive resists closing.
    pub net_n: Vec<f64>,
}

/// Recomputes the software block of a recording.
pub fn recompute(model: &Model, case: &Case, effects: &[Chosen]) -> Recomputed {
    let (commanded_m, net_n) = recomputed(model, case, &Inputs::plain(effects));
    Recomputed { commanded_m, net_n }
}

/// A number of the software block that is not the same in two recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Tick of the loop.
    pub tick: usize,
    /// The wire on which it shows first: [`Wire::Commanded`] or [`Wire::Feedback`].
    pub wire: Wire,
    /// Value in the first recording, m or N.
    pub one: f64,
    /// Value in the second recording.
    pub other: f64,
}

/// The first number whose bits differ when our software is recomputed from two recordings, in the order of the loop.
///
/// A last digit of a force reaches the net force at the tick that uses the sample. It reaches the next command only if a
/// metre has the digits for it: one unit in the last place of 5 N moves 63 kg by 1e-22 m within a tick, and a command of 1 mm
/// ends at 1e-19 m.
pub fn first_difference(model: &Model, one: &Case, other: &Case, effects: &[Chosen]) -> Option<Difference> {
    let (here, there) = (recompute(model, one, effects), recompute(model, other, effects));
    let wires = [(Wire::Commanded, &here.commanded_m, &there.commanded_m), (Wire::Feedback, &here.net_n, &there.net_n)];
    (0..here.net_n.len().min(there.net_n.len()))
        .flat_map(|tick| wires.map(|(wire, one, other)| Difference { tick, wire, one: one[tick], other: other[tick] }))
        .find(|difference| difference.one.to_bits() != difference.other.to_bits())
}

/// What the recomputation is given.
pub(super) struct Inputs<'a> {
    pub(super) effects: &'a [Chosen],
    pub(super) mass_ratio: f64,
    pub(super) bias_error_n: f64,
    pub(super) shift: i64,
    /// Whether the commands are clamped to the recording, so that errors do not add up.
    pub(super) clamped: bool,
}

impl<'a> Inputs<'a> {
    pub(super) fn plain(effects: &'a [Chosen]) -> Self {
        Inputs { effects, mass_ratio: 1.0, bias_error_n: 0.0, shift: 0, clamped: false }
    }
}

/// Commands and net forces that our software makes of the recorded force.
pub(super) fn recomputed(model: &Model, case: &Case, inputs: &Inputs<'_>) -> (Vec<f64>, Vec<f64>) {
    let cell = Cell { believed_offset_n: inputs.bias_error_n, ..Cell::of(model, case.mass_kg * inputs.mass_ratio) };
    let on_path = inputs.effects.iter().filter(|chosen| blocks::is_on_path(&chosen.kind.wires));
    let attached: Vec<Attached<_>> = on_path.map(Chosen::attach).chain(Held::attach(&case.settled.held)).collect();
    let sensed: Vec<f64> = (0..case.sensed_n.value.len() as i64)
        .map(|tick| case.sensed_n.value[(tick + inputs.shift).clamp(0, case.sensed_n.value.len() as i64 - 1) as usize])
        .collect();
    let clamps = Clamps {
        sensed: Some(&sensed),
        commanded: if inputs.clamped { Some(&case.commanded) } else { None },
        ..Clamps::default()
    };
    let start = Start {
        first: case.first,
        from: Nanos(0),
        until: case.until,
        noise: SensorNoise::NONE,
        streams: Streams::new(0),
    };
    let mut trace = Trace::default();
    let columns = Columns { loop_ticks: true, sensor_ticks: false, achieved: false, measured: false };
    cell.run(&attached, case.rates, &start, &clamps, columns, &mut trace);
    (trace.commanded.iter().map(|motion| motion.position_m).collect(), trace.feedback)
}

/// One tick of the balance.
pub(super) struct Balance {
    /// What the recorded commands say: `-(x₊ - 2x + x₋) 2m / T²`, in N.
    pub(super) acted_n: f64,
    /// What the software would have felt, `F + F₋`, in N.
    pub(super) felt_n: f64,
}

/// Every tick but the first and the last, whether recorded or not; the commands are clamped.
pub(super) fn balances(model: &Model, case: &Case, inputs: &Inputs<'_>) -> Vec<Balance> {
    let (_, feedback) = recomputed(model, case, &Inputs { clamped: true, ..*inputs });
    let factor = 2.0 * case.mass_kg / (case.rates.loop_period.seconds() * case.rates.loop_period.seconds());
    let x = |tick: usize| case.commanded[tick].position_m;
    // Twice the force that bends the path of the commands, by each integrator.
    let felt = |now_n: f64, before_n: f64| match model.plant.integrator {
        PointIntegrator::ExactHold => now_n + before_n,
        PointIntegrator::SemiImplicit => 2.0 * now_n,
        PointIntegrator::Explicit => 2.0 * before_n,
    };
    (1..case.commanded.len() - 1)
        .map(|tick| Balance {
            acted_n: -(x(tick + 1) - 2.0 * x(tick) + x(tick - 1)) * factor,
            felt_n: felt(feedback[tick], feedback[tick - 1]),
        })
        .collect()
}

/// The recording that is examined, and which of its ticks count.
struct Examined<'a> {
    model: &'a Model,
    case: &'a Case,
    judged: Option<&'a Judged>,
}

/// The ticks that tell anything.
fn balance(of: &Examined<'_>, inputs: &Inputs<'_>) -> Vec<Balance> {
    let case = of.case;
    let whole = |tick: usize| case.commanded_known[tick - 1..=tick + 1].iter().all(|known| *known);
    let all = balances(of.model, case, inputs);
    let all: Vec<Option<Balance>> = match of.judged {
        Some(judged) => judged.masked(case, all),
        None => all.into_iter().enumerate().map(|(nth, balance)| whole(nth + 1).then_some(balance)).collect(),
    };
    all.into_iter().flatten().filter(|balance| balance.felt_n.abs() > 2.0 * FELT_N).collect()
}

/// Root mean square of what does not balance, in N, and the mass ratio and bias error that leave least: `acted = felt / r + c`.
fn left_over(balances: &[Balance]) -> (f64, f64, f64) {
    let n = balances.len() as f64;
    if balances.len() < 10 {
        return (f64::INFINITY, 1.0, 0.0);
    }
    let mean = |of: &dyn Fn(&Balance) -> f64| balances.iter().map(of).sum::<f64>() / n;
    let (fx, fy) = (mean(&|b| b.felt_n), mean(&|b| b.acted_n));
    let sxx = mean(&|b| (b.felt_n - fx) * (b.felt_n - fx));
    let sxy = mean(&|b| (b.felt_n - fx) * (b.acted_n - fy));
    let slope = if sxx > 0.0 { sxy / sxx } else { 1.0 };
    let offset = fy - slope * fx;
    let left = |b: &Balance| b.acted_n - slope * b.felt_n - offset;
    (libm::sqrt(mean(&|b| left(b) * left(b))), 1.0 / slope, offset)
}

/// Examines one recording. `effects` are those of the model that is examined.
pub fn examine(model: &Model, case: &Case, effects: &[Chosen], delay: &Chosen) -> Software {
    let mut software = Software { rounding_m: rounding_m(case, case.commanded.len()), ..Software::not_examined() };
    if !case.is_impact() {
        return software;
    }
    let plain_m = closure_m(model, case, effects, 1.0);
    let on_edge = || edges(model, case, &Inputs::plain(effects)).contains(&true);
    let is_needed = Judged::is_needed(case) || !closes(plain_m, software.rounding_m) && on_edge();
    let judged = (is_needed && !model.moves_command()).then(|| Judged::of(model, case, effects));
    if let Some(judged) = &judged {
        software.gaps = judged.gaps(case, &balances(model, case, &Inputs::plain(effects)));
        if !software.is_judged() {
            return software;
        }
        let (closure_m, longest) = judged.closure_m(case);
        (software.closure_m, software.rounding_m) = (Some(closure_m), rounding_m(case, longest));
    } else {
        software.closure_m = Some(plain_m);
    }
    if software.closes() {
        software.pose_delay_s = model.hears_pose().then_some(0.0);
        return software;
    }
    if model.moves_command() {
        // The commands are not where the satellites were: no balance can be drawn from them.
        return software;
    }
    let of = Examined { model, case, judged: judged.as_ref() };
    let (shift, mut best) = best_shift(&of, effects);
    let mut with = effects.to_vec();
    let unbalanced = model.hears_pose() && best.0 > 1e-6;
    let delayed = if unbalanced { best_delay(&of, effects, delay, shift) } else { None };
    if let Some((delay_s, found)) = delayed.filter(|(_, found)| found.0 < 0.5 * best.0) {
        best = found;
        with = with_delay(effects, delay, delay_s);
        software.pose_delay_s = Some(delay_s);
    }
    // Shares of the mass and forces below these are rounding, not findings.
    let (ratio, bias_n) = (best.1, best.2 / 2.0);
    software.mass_ratio = if (ratio - 1.0).abs() > 1e-7 { ratio } else { 1.0 };
    software.bias_error_n = if bias_n.abs() > 1e-7 { bias_n } else { 0.0 };
    software.clock_offset_s = shift as f64 * case.rates.sensor_period.seconds();
    let inputs = Inputs {
        effects: &with,
        mass_ratio: software.mass_ratio,
        bias_error_n: software.bias_error_n,
        shift,
        clamped: false,
    };
    if judged.is_some() {
        software.closure_found_m = Some(Judged::with(model, case, &inputs).closure_m(case).0);
        return software;
    }
    let (commanded, _) = recomputed(model, case, &inputs);
    let differences = case.commanded.iter().zip(&commanded).map(|(a, b)| (a.position_m - b).abs());
    software.closure_found_m = Some(differences.fold(0.0, f64::max));
    software
}

/// The shift of the force stream that balances best.
fn best_shift(of: &Examined<'_>, effects: &[Chosen]) -> (i64, (f64, f64, f64)) {
    let at = |shift: i64| left_over(&balance(of, &Inputs { shift, ..Inputs::plain(effects) }));
    let here = at(0);
    let other = (-SHIFT_MAX..=SHIFT_MAX).map(|shift| (shift, at(shift))).min_by(|a, b| a.1.0.total_cmp(&b.1.0));
    match other {
        // Another sample must balance far better than the tick's own: noise alone prefers one shift or another.
        Some((shift, found)) if found.0 < 0.3 * here.0 => (shift, found),
        _ => (0, here),
    }
}

fn with_delay(effects: &[Chosen], delay: &Chosen, delay_s: f64) -> Vec<Chosen> {
    let mut with = effects.to_vec();
    with.push(Chosen { values: vec![delay_s], ..delay.clone() });
    with
}

/// The extra delay of the pose that balances best: a grid of half a loop period, then a golden section.
fn best_delay(of: &Examined<'_>, effects: &[Chosen], delay: &Chosen, shift: i64) -> Option<(f64, (f64, f64, f64))> {
    let (model, case) = (of.model, of.case);
    let least_s = case.rates.loop_period.seconds() - model.timing.command_delay_s;
    let at = |delay_s: f64| {
        let with = with_delay(effects, delay, delay_s);
        left_over(&balance(of, &Inputs { shift, ..Inputs::plain(&with) }))
    };
    let grid_s = 0.25 * case.rates.loop_period.seconds();
    let start = (-16..=40)
        .map(|i| i as f64 * grid_s)
        .filter(|delay_s| *delay_s >= least_s)
        .min_by(|a, b| at(*a).0.total_cmp(&at(*b).0))?;
    let (mut low, mut high) = ((start - grid_s).max(least_s), start + grid_s);
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    for _ in 0..60 {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if at(a).0 <= at(b).0 { high = b } else { low = a }
    }
    // Controllers are set in round numbers: a delay within the last digit of one is that one.
    let found = 0.5 * (low + high);
    let round = libm::round(found * 1e5) / 1e5;
    let best = if at(round).0 <= at(found).0 * 1.000_001 || (round - found).abs() < 1e-9 { round } else { found };
    Some((best, at(best)))
}
