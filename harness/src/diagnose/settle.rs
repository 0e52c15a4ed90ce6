//! A recording before it is compared or diagnosed: what is missing in it is found, and left out of the blocks.
//!
//! | looked for | found by | then |
//! |---|---|---|
//! | a missing command, pose or reading | the stamps | not trusted; the robot held where there was no command |
//! | a reading that came late | its stamp, at the first tick that does not balance | not trusted |
//! | a command that is the one before again | its bits, there | the robot held |
//! | an answer that the robot did not get in time | the commands follow with it to their rounding, and not without | the robot held |
//! | what the software did within one round trip after a gap | nothing else explains it | not judged |
//!
//! An answer that got lost leaves no gap: the command is recorded. The software feels it one round trip later in its own pose.
//! Not found: one that is lost while the software does not listen to that pose.

use super::software::{closes, closure_m};
use super::stretches::{BEND_M, Judged, held, lacks, round_trip, rounding_m, sample_of};
use crate::blocks;
use crate::case::Case;
use crate::error::Error;
use crate::missing::{Has, distrust};
use crate::model::{Chosen, Model};
use crate::recording::Session;
use sim_core::space::AxisMotion;

/// Most cycles in a row that the robot may have held.
const HELD_MAX: usize = 8;
/// Share of the cycles, and number of them, that may be left out for what no gap shows. With more lost answers the blocks start
/// from the command as it is recorded: that is no accident but how the cell is, and belongs to the effects. Chosen.
const ACCIDENTS: (f64, usize) = (0.02, 8);
/// More cycles that may be left out for each cycle without a command: a controller that is late for some cycles stands in the
/// recording one cycle late until it has caught up. Chosen.
const AFTER_EACH: usize = 3;
/// Share of the cycles whose answer may have got lost so that the software is still judged. Chosen.
const UNHEARD_MAX: f64 = 0.2;
/// A path is another one from here on, a twentieth of a read-out's noise, in m.
const APART_M: f64 = 1e-6;
/// For how long after that an unknown path stays left out: a delay that the model lacks shifts it. Chosen, in s.
const LATER_S: f64 = 0.012;

/// A recording that somebody has looked at: samples that are not trusted count nowhere, the robot holds where it got no command,
/// and what depends on a command that is not known is left out of the blocks.
pub fn settled(mut case: Case, model: &Model, effects: &[Chosen]) -> Case {
    if case.commanded.is_empty() {
        return case;
    }
    let is_impact = case.is_impact() && !model.moves_command();
    let is_whole = || {
        let (closure_m, rounding_m) = closure_m(model, &case, effects);
        closes(closure_m, rounding_m)
    };
    if !case.missing.any() && (!is_impact || is_whole()) {
        return case;
    }
    case.settled.held = case.missing.command.iter().map(|has| *has == Has::Nothing).collect();
    if is_impact {
        search(model, &mut case, effects);
    }
    if case.missing.any() {
        distrust(&mut case.measured_m, &case.missing.pose);
        distrust(&mut case.sensed_n, &case.missing.reading);
        leave_out(model, &mut case, effects);
    }
    case
}

/// Recordings on the clocks of a model, looked at.
///
/// # Errors
/// As [`Case::of`].
pub fn cases<'s>(
    sessions: impl IntoIterator<Item = &'s Session>,
    model: &Model,
    effects: &[Chosen],
) -> Result<Vec<Case>, Error> {
    let one = |session| Ok(settled(Case::of(session, model)?, model, effects));
    sessions.into_iter().map(one).collect()
}

/// Looks for what no gap shows; a recording of which that would be too much stays as it was.
fn search(model: &Model, case: &mut Case, effects: &[Chosen]) {
    let (before, missing) = (case.settled.clone(), case.missing.clone());
    let cycles = case.commanded.len() as f64;
    let most = ACCIDENTS.1.max((ACCIDENTS.0 * cycles) as usize);
    let without_command = case.missing.command.iter().filter(|has| **has == Has::Nothing).count();
    let left_out_most = most + AFTER_EACH * without_command;
    let mut left_out = 0;
    while let Some(first) = Judged::of(model, case, effects).first_unbalanced(case) {
        let unheard = case.settled.unheard.len();
        let is_explained = explain(model, case, effects, first);
        left_out += usize::from(case.settled.unheard.len() == unheard);
        let is_too_much = left_out > left_out_most || case.settled.unheard.len() as f64 > UNHEARD_MAX * cycles;
        if !is_explained || is_too_much {
            (case.settled, case.missing) = (before, missing);
            return;
        }
    }
    if !closes(Judged::of(model, case, effects).closure_m(case), rounding_m(case)) {
        // Each tick balances to the rounding of its commands, and together they do not: it was something else.
        (case.settled, case.missing) = (before, missing);
        return;
    }
    if case.settled.unheard.len() <= most {
        // What is known for sure is so for the blocks too.
        *case = held(case);
    }
}

/// Explains the first tick that does not balance, if it can.
fn explain(model: &Model, case: &mut Case, effects: &[Chosen], first: usize) -> bool {
    for tick in [first, first - 1] {
        let Some(sample) = sample_of(case, tick) else { continue };
        if case.missing.late.get(sample) == Some(&true) && case.missing.reading[sample] == Has::Sample {
            case.missing.reading[sample] = Has::AfterGap;
            return true;
        }
    }
    if let Some(again) = (first..=first + 1).find(|tick| is_again(case, *tick)) {
        case.missing.command[again] = Has::Nothing;
        case.missing.command[again + 1] = Has::AfterGap;
        case.settled.held[again] = true;
        return true;
    }
    if let Some((from, cycles)) = unheard(model, case, effects, first) {
        case.settled.unheard.extend(from..from + cycles);
        return true;
    }
    let trip = round_trip(model, case, effects) + 4;
    if (first.saturating_sub(trip)..first).any(|tick| lacks(case, tick)) {
        case.settled.resumed.push(first);
        return true;
    }
    false
}

/// Whether a command is the one before to the last bit, though the commands move before and after it.
fn is_again(case: &Case, tick: usize) -> bool {
    let Some([two_before, before, here, after]) =
        case.commanded.get(tick.saturating_sub(2)..tick + 2).and_then(|four| <&[AxisMotion; 4]>::try_from(four).ok())
    else {
        return false;
    };
    let moves = |one: &AxisMotion, other: &AxisMotion| {
        (one.position_m - other.position_m).abs() > BEND_M + 4.0 * case.command_quantum_m
    };
    let all_trusted = (tick - 2..tick + 2).all(|tick| case.trusts_command(tick));
    all_trusted
        && here.position_m.to_bits() == before.position_m.to_bits()
        && moves(two_before, before)
        && moves(here, after)
}

/// From which tick on, and for how many, the robot must have held so that the commands follow.
fn unheard(model: &Model, case: &Case, effects: &[Chosen], first: usize) -> Option<(usize, usize)> {
    if !model.hears_pose() {
        return None;
    }
    let trip = round_trip(model, case, effects);
    let from = first.checked_sub(trip + 1)?.max(1);
    (1..=HELD_MAX).flat_map(|cycles| (from..=from + 2).map(move |from| (from, cycles))).find(|(from, cycles)| {
        let mut tried = case.clone();
        tried.settled.unheard.extend(*from..from + cycles);
        if tried.settled.unheard.iter().any(|tick| *tick >= case.commanded.len()) {
            return false;
        }
        let then = Judged::of(model, &tried, effects).first_unbalanced(&tried);
        then.is_none_or(|then| then > first + cycles)
    })
}

/// Leaves out of the blocks what depends on a command that is not known: where the path differs between a robot that held and one
/// that got what lies between, and for a while after.
fn leave_out(model: &Model, case: &mut Case, effects: &[Chosen]) {
    let mut between = case.clone();
    for tick in 0..case.commanded.len() {
        between.settled.held[tick] &= case.trusts_command(tick);
    }
    refill(&mut between.commanded, |tick| case.trusts_command(tick));
    let (one, other) = (blocks::path(model, case, effects, None), blocks::path(model, &between, effects, None));
    let apart = |(one, other): (f64, f64)| (one - other).abs() > APART_M;
    let measured = one.measured_m.iter().copied().zip(other.measured_m.iter().copied()).map(apart);
    let step_s = case.rates.physics_step.seconds();
    let achieved = one.achieved.iter().zip(&other.achieved).map(|(a, b)| apart((a.position_m, b.position_m)));
    let unknown_pose = lasting(measured, LATER_S / case.rates.loop_period.seconds());
    let unknown_path = lasting(achieved, LATER_S / step_s);
    for (known, unknown) in case.measured_m.known.iter_mut().zip(unknown_pose) {
        *known &= !unknown;
    }
    if case.missing.before > 0 {
        // What the robot was told before the first command is still on its way.
        let first = round_trip(model, case, effects) + 2;
        case.measured_m.known.iter_mut().take(first).for_each(|known| *known = false);
        let until_s = model.timing.command_delay_s + 2.0 * case.rates.loop_period.seconds() + LATER_S;
        let early = |sample: &usize| case.sensor_time_s(*sample) < until_s;
        let early = (0..case.sensed_n.known.len()).take_while(early).count();
        case.sensed_n.known.iter_mut().take(early).for_each(|known| *known = false);
    }
    for sample in 0..case.sensed_n.known.len() {
        let step = libm::round(case.sensor_time_s(sample) / step_s).max(0.0) as usize;
        case.sensed_n.known[sample] &= unknown_path.get(step) != Some(&true);
    }
}

/// What is true stays so for this many ticks.
fn lasting(all: impl Iterator<Item = bool>, ticks: f64) -> Vec<bool> {
    let ticks = libm::ceil(ticks) as usize;
    let mut left = 0;
    let one = |is: bool| {
        left = if is { ticks + 1 } else { left.saturating_sub(1) };
        left > 0
    };
    all.map(one).collect()
}

/// Straight lines over what is not trusted.
fn refill(commanded: &mut [AxisMotion], trusted: impl Fn(usize) -> bool) {
    let mut before: Option<usize> = None;
    for tick in 0..commanded.len() {
        if !trusted(tick) {
            continue;
        }
        let end = commanded[tick].position_m;
        if let Some(from) = before {
            let begin = commanded[from].position_m;
            let share = |gap: usize| gap as f64 / (tick - from) as f64;
            let between = commanded[from + 1..tick].iter_mut();
            between.zip(1..).for_each(|(motion, gap)| motion.position_m = begin + (end - begin) * share(gap));
        }
        before = Some(tick);
    }
}
