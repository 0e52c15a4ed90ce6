//! The software block: recorded force in, commanded pose out. It is our own arithmetic, so it closes to rounding, whatever is
//! missing in the hardware; what does not close names a wrong clock, mass or compensator before anything else is blamed.
//!
//! For every tick, `x₊ - 2x + x₋ = -(F + F₋) T² / (2m)`, with F from the sample that carries the tick's own stamp and from the
//! pose that the controller had at hand. Nothing in it is fitted. Which pose that was is tried in this order:
//!
//! | the controller's pose | is known | closes |
//! |---|---|---|
//! | the command, through dead time and read-back | exactly, also where the log of the pose has noise | a robot that is as the model has it |
//! | the reported one, as it was recorded | where the log is what was on the wire | any robot: what it does is judged by its path |
//! | the first, with an extra delay | from the virtual force that it makes | a link that is slower than declared |

use super::gaps::Gaps;
use super::paths::LeftOver;
use super::stretches::{Judged, rounding_m};
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
use sim_core::space::AxisMotion;
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// A block that closes this well is our own software, recomputed: a hundred times the rounding of a metre, far below a
/// micrometre of anything real.
pub const CLOSED_M: f64 = 1e-9;
/// What is found and does not close the block must leave less than this share of what was open. Chosen.
const NEARER: f64 = 0.3;
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
    /// What the rounding of the recorded commands on their wire allows, in m.
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
    /// Whether that pose was the recorded one: the robot is not where the model has it, and the software is sound.
    pub on_reported_pose: bool,
    /// How well the mass ratio is known.
    #[serde(skip)]
    pub mass_ratio_sd: f64,
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
            on_reported_pose: false,
            mass_ratio_sd: 0.0,
            gaps: None,
        }
    }

    /// Whether our own software, as the model describes it, made this recording; true also where it is not judged.
    pub fn closes(&self) -> bool {
        self.closure_m.is_none_or(|closure_m| closes(closure_m, self.rounding_m))
    }

    /// That the software is sound and the robot is not where the model has it, in words.
    pub fn other_pose(&self) -> Option<&'static str> {
        let words = "with the pose that the robot reported, not with the one that the model gives it: what the robot does differs";
        (self.on_reported_pose && self.explained()).then_some(words)
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

/// Largest difference between the recorded commands and those that our software makes of the recorded force, and what their
/// rounding allows, both in m.
pub fn closure_m(model: &Model, case: &Case, effects: &[Chosen]) -> (f64, f64) {
    let inputs = Inputs::plain(effects);
    if tells_satellites(model, case) {
        return (Judged::whole(model, case, &inputs).closure_m(case), rounding_m(case));
    }
    let (commanded, _) = recomputed(model, case, &inputs);
    let pairs = case.commanded.iter().zip(&commanded).zip(&case.commanded_known);
    let worst_m = pairs.filter(|(_, known)| **known).map(|((a, b), _)| (a.position_m - b).abs()).fold(0.0, f64::max);
    // The first two commands say how fast the satellites were, and that adds up.
    (worst_m, case.command_quantum_m * (case.commanded.len() as f64 + 1.0))
}

/// Whether the recorded commands tell where the satellites were at each tick.
fn tells_satellites(model: &Model, case: &Case) -> bool {
    let sparse = !case.missing.any() && case.commanded_known.contains(&false);
    !model.moves_command() && !sparse
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
#[derive(Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) effects: &'a [Chosen],
    pub(super) mass_ratio: f64,
    pub(super) bias_error_n: f64,
    pub(super) shift: i64,
    /// Whether the commands are clamped to the recording, so that errors do not add up.
    pub(super) clamped: bool,
    /// Whether the reported pose is.
    pub(super) reported: bool,
}

impl<'a> Inputs<'a> {
    pub(super) fn plain(effects: &'a [Chosen]) -> Self {
        Inputs { effects, mass_ratio: 1.0, bias_error_n: 0.0, shift: 0, clamped: false, reported: false }
    }
}

/// Commands and net forces that our software makes of the recorded force.
pub(super) fn recomputed(model: &Model, case: &Case, inputs: &Inputs<'_>) -> (Vec<f64>, Vec<f64>) {
    let cell = Cell { believed_offset_n: inputs.bias_error_n, ..Cell::of(model, case.mass_kg * inputs.mass_ratio) };
    let on_path =
        inputs.effects.iter().filter(|chosen| blocks::is_on_path(&chosen.kind.wires) && !blocks::is_random(chosen));
    let attached: Vec<Attached<_>> = on_path.map(Chosen::attach).chain(Held::attach(&case.settled.held)).collect();
    let sensed: Vec<f64> = (0..case.sensed_n.value.len() as i64)
        .map(|tick| case.sensed_n.value[(tick + inputs.shift).clamp(0, case.sensed_n.value.len() as i64 - 1) as usize])
        .collect();
    let reported = inputs.reported.then(|| reported(case));
    let clamps = Clamps {
        sensed: Some(&sensed),
        measured: reported.as_deref(),
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

/// The reported pose at each physics step: that of the last tick.
fn reported(case: &Case) -> Vec<AxisMotion> {
    let at = |tick: usize| AxisMotion {
        position_m: case.measured_m.value[tick],
        pitch_rad: case.measured_pitch_rad[tick],
        ..case.first
    };
    let steps = case.until.0.div_euclid(case.rates.physics_step.0) as usize + 1;
    let last = case.measured_m.value.len() - 1;
    let tick = |step: usize| (step as i64 * case.rates.physics_step.0).div_euclid(case.rates.loop_period.0) as usize;
    (0..steps).map(|step| at(tick(step).min(last))).collect()
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

/// Examines one recording. `effects` are those of the model that is examined.
pub fn examine(model: &Model, case: &Case, effects: &[Chosen], delay: &Chosen) -> Software {
    let software = Software { rounding_m: rounding_m(case), ..Software::not_examined() };
    if !case.is_impact() {
        return software;
    }
    if !tells_satellites(model, case) {
        // No balance can be drawn from such commands.
        let (closure_m, rounding_m) = closure_m(model, case, effects);
        let mut software = Software { closure_m: Some(closure_m), rounding_m, ..software };
        software.pose_delay_s = (model.hears_pose() && software.closes()).then_some(0.0);
        return software;
    }
    let poses: &[bool] = if model.hears_pose() { &[false, true] } else { &[false] };
    let plain = |reported: bool| Examined::plain(model, case, Inputs { reported, ..Inputs::plain(effects) });
    let all: Vec<Examined<'_>> = poses.iter().map(|reported| plain(*reported)).collect();
    let sound = all.iter().find(|one| one.software.is_judged() && one.software.closes());
    if let Some(told) = sound.or_else(|| all.iter().find(|one| !one.software.is_judged())) {
        return told.software.clone();
    }
    let searched: Vec<Software> = all.iter().map(|one| one.searched(delay)).collect();
    searched.iter().find(|one| one.explained()).unwrap_or(&searched[0]).clone()
}

/// A recording on one of its poses.
struct Examined<'a> {
    model: &'a Model,
    case: &'a Case,
    inputs: Inputs<'a>,
    judged: Judged,
    software: Software,
}

impl<'a> Examined<'a> {
    /// As the model stands.
    fn plain(model: &'a Model, case: &'a Case, inputs: Inputs<'a>) -> Self {
        let mut software =
            Software { rounding_m: rounding_m(case), on_reported_pose: inputs.reported, ..Software::not_examined() };
        let mut judged = Judged::whole(model, case, &inputs);
        if Judged::is_needed(case) {
            judged = Judged::with(model, case, &inputs);
            software.gaps = judged.gaps(case, &balances(model, case, &inputs));
        }
        if software.is_judged() {
            software.closure_m = Some(judged.closure_m(case));
            let own_pose = model.hears_pose() && !inputs.reported;
            software.pose_delay_s = (own_pose && software.closes()).then_some(0.0);
        }
        Examined { model, case, inputs, judged, software }
    }

    /// What is left with another shift or another delay.
    fn left_over(&self, inputs: &Inputs<'_>) -> LeftOver {
        self.judged.again(self.model, self.case, inputs).left_over(self.case)
    }

    /// Looks for a clock, a delay, a mass or a bias that closes it: as few of them as do.
    fn searched(&self, delay: &Chosen) -> Software {
        let mut software = self.software.clone();
        let limit_m = CLOSED_M + software.rounding_m;
        let (shift, mut best) = self.best_shift();
        let mut with = self.inputs.effects.to_vec();
        let unbalanced = self.model.hears_pose() && !self.inputs.reported && best.rms_m > limit_m;
        let delayed = if unbalanced { self.best_delay(delay, shift) } else { None };
        if let Some((delay_s, found)) = delayed.filter(|(_, found)| found.rms_m < 0.5 * best.rms_m) {
            best = found;
            with = with_delay(self.inputs.effects, delay, delay_s);
            software.pose_delay_s = Some(delay_s);
        }
        software.clock_offset_s = shift as f64 * self.case.rates.sensor_period.seconds();
        software.mass_ratio_sd = best.ratio_per_m * self.case.command_quantum_m;
        // Shares of the mass and forces below these are rounding, not findings.
        let mass = |ratio: f64| if (ratio - 1.0).abs() > 1e-7 { ratio } else { 1.0 };
        let bias = |twice_n: f64| if twice_n.abs() > 2e-7 { 0.5 * twice_n } else { 0.0 };
        let tries = [
            (1.0, 0.0),
            (mass(best.mass_ratio_alone), 0.0),
            (1.0, bias(best.twice_bias_alone_n)),
            (mass(best.mass_ratio), bias(best.twice_bias_n)),
        ];
        for (mass_ratio, bias_error_n) in tries {
            let inputs = Inputs { effects: &with, mass_ratio, bias_error_n, shift, ..self.inputs };
            (software.mass_ratio, software.bias_error_n) = (mass_ratio, bias_error_n);
            software.closure_found_m = Some(self.judged.anew(self.model, self.case, &inputs).closure_m(self.case));
            if software.explained() {
                return software;
            }
        }
        let is_nearer =
            software.closure_found_m.zip(software.closure_m).is_some_and(|(found, open)| found < NEARER * open);
        // What leaves as much as there was names nothing.
        if is_nearer { software } else { self.software.clone() }
    }

    /// The shift of the force stream that balances best.
    fn best_shift(&self) -> (i64, LeftOver) {
        let at = |shift: i64| self.left_over(&Inputs { shift, ..self.inputs });
        let here = at(0);
        let other =
            (-SHIFT_MAX..=SHIFT_MAX).map(|shift| (shift, at(shift))).min_by(|a, b| a.1.rms_m.total_cmp(&b.1.rms_m));
        match other {
            // Another sample must balance far better than the tick's own: noise alone prefers one shift or another.
            Some((shift, found)) if found.rms_m < 0.3 * here.rms_m => (shift, found),
            _ => (0, here),
        }
    }

    /// The extra delay of the pose that balances best: a grid of a quarter of a loop period, then a golden section.
    fn best_delay(&self, delay: &Chosen, shift: i64) -> Option<(f64, LeftOver)> {
        let period_s = self.case.rates.loop_period.seconds();
        let least_s = period_s - self.model.timing.command_delay_s;
        let at = |delay_s: f64| {
            let with = with_delay(self.inputs.effects, delay, delay_s);
            self.left_over(&Inputs { effects: &with, shift, ..self.inputs })
        };
        let rms_m = |delay_s: f64| at(delay_s).rms_m;
        let grid_s = 0.25 * period_s;
        let grid = (-16..=40).map(|i| i as f64 * grid_s).filter(|delay_s| *delay_s >= least_s);
        let (start, _) = grid.map(|delay_s| (delay_s, rms_m(delay_s))).min_by(|a, b| a.1.total_cmp(&b.1))?;
        let (mut low, mut high) = ((start - grid_s).max(least_s), start + grid_s);
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        for _ in 0..60 {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            if rms_m(a) <= rms_m(b) { high = b } else { low = a }
        }
        // Controllers are set in round numbers: a delay within the last digit of one is that one.
        let found = 0.5 * (low + high);
        let round = libm::round(found * 1e5) / 1e5;
        let is_as_good = rms_m(round) <= rms_m(found) * 1.000_001 + 0.1 * self.case.command_quantum_m;
        let best = if is_as_good || (round - found).abs() < 1e-9 { round } else { found };
        Some((best, at(best)))
    }
}

fn with_delay(effects: &[Chosen], delay: &Chosen, delay_s: f64) -> Vec<Chosen> {
    let mut with = effects.to_vec();
    with.push(Chosen { values: vec![delay_s], ..delay.clone() });
    with
}
