//! Effects that are random: a command that was lost or late is decoded from the reported pose, packet by packet.
//!
//! A fit cannot predict which packet is lost, but the recording tells: a lost packet leaves the robot where it was for one tick,
//! `v T` behind (0.14 mm at 35 mm/s), seven times the read-out noise. Losses are decoded as the most likely path of a two-state
//! chain (Viterbi); its transitions are paid for with their probabilities, so that noise cannot be explained away by losses.
//! The latenesses of jitter are decoded in `jitter`.

use super::jitter;
use super::problem::{Problem, Run, Scratch, Trial};
use super::score::path_delay_s;
use crate::blocks::{Schedule, is_random};
use crate::model::Chosen;
use sim_core::effect::Kind;
use sim_core::signals::Received;
use sim_core::space::{Axis, AxisMotion};

/// Longest run of losses that is considered, in packets: 60 ms at 4 ms; a controller stops long before.
const HELD_MAX: usize = 15;

/// A random effect, with what happened in each run.
#[derive(Debug, Clone)]
pub struct Decoded {
    /// The effect with its fitted parameters.
    pub chosen: Chosen,
    /// Standard deviations of the parameters.
    pub deviations: Vec<f64>,
    /// For each run, the commands as the robot got them.
    pub schedules: Vec<Schedule>,
    /// For each run, by how much twice the log density of the reported pose rises.
    pub gains: Vec<f64>,
}

/// What the reported pose of a run says, with the deterministic part of the path taken out.
pub(super) struct Track<'a> {
    /// The run.
    pub run: &'a Run,
    /// Reported minus predicted position, m; NaN where unknown.
    pub residual_m: Vec<f64>,
    /// Ticks between a command and the report that first shows it.
    pub lag: usize,
    /// The share of the next command in that report.
    pub share: f64,
    /// Standard deviation of the report.
    pub sigma_m: f64,
    /// What the robot goes by at each packet as far as that is known: the last command that it did not miss.
    going_by: Vec<AxisMotion>,
}

impl<'a> Track<'a> {
    fn new(problem: &'a Problem, run: &'a Run, predicted_m: &[f64], path_delay_s: f64) -> Self {
        let case = &run.case;
        let measured = case.measured_m.value.iter().zip(predicted_m).zip(&case.measured_m.known);
        let residual_m = measured.map(|((m, p), known)| if *known { m - p } else { f64::NAN }).collect();
        let ticks = path_delay_s / case.rates.loop_period.seconds();
        // The report at tick n lies between commands n - lag and n - lag + 1.
        let lag = libm::ceil(ticks - 1e-9) as usize;
        let mut going_by = case.commanded.clone();
        for packet in 1..going_by.len() {
            if case.settled.held.get(packet) == Some(&true) {
                going_by[packet] = going_by[packet - 1];
            }
        }
        Track { run, residual_m, lag, share: lag as f64 - ticks, sigma_m: problem.noise.position_floor_m, going_by }
    }

    /// Position that a packet asks for.
    pub fn command(&self, packet: usize) -> f64 {
        self.going_by[packet].position_m
    }

    /// Step of the command into a packet: what a loss leaves undone.
    fn advance(&self, packet: usize) -> f64 {
        if packet == 0 { 0.0 } else { self.command(packet) - self.command(packet - 1) }
    }
}

/// Position that is behind when `held` packets in a row up to this one were lost.
fn behind(track: &Track<'_>, packet: usize, held: usize) -> f64 {
    track.command(packet) - track.command(packet - held.min(packet))
}

/// The most likely losses, and twice their log density above 'nothing was lost'.
fn losses(track: &Track<'_>, probability_in: f64, probability_out: f64) -> (Vec<usize>, f64) {
    let packets = track.run.case.commanded.len();
    let weight = 1.0 / (track.sigma_m * track.sigma_m);
    // Cost of going on from `held` lost packets to another loss, or to a received one.
    let lost = |held: usize| -2.0 * libm::log(if held == 0 { probability_in } else { 1.0 - probability_out });
    let got = |held: usize| -2.0 * libm::log(if held == 0 { 1.0 - probability_in } else { probability_out });
    let mut cost = vec![f64::INFINITY; HELD_MAX + 1];
    cost[0] = 0.0;
    let mut nothing = 0.0;
    let mut from: Vec<[usize; HELD_MAX + 1]> = Vec::with_capacity(packets);
    for packet in 0..packets {
        let tick = packet + track.lag - usize::from(track.share > 0.0);
        let residual = track.residual_m.get(tick).copied().unwrap_or(f64::NAN);
        let square = |behind_m: f64| {
            if residual.is_nan() { 0.0 } else { (residual + behind_m) * (residual + behind_m) * weight }
        };
        nothing += square(0.0);
        let mut next = vec![f64::INFINITY; HELD_MAX + 1];
        let mut back = [0; HELD_MAX + 1];
        for (held, so_far) in cost.iter().enumerate().filter(|(_, so_far)| so_far.is_finite()) {
            for (to, price) in [(0, got(held)), (held + 1, lost(held))] {
                if to > HELD_MAX || to > packet {
                    continue;
                }
                let before_m = if packet == 0 { 0.0 } else { behind(track, packet - 1, held) };
                let expected = if track.share > 0.0 {
                    behind(track, packet, to) * track.share + before_m * (1.0 - track.share)
                } else {
                    behind(track, packet, to)
                };
                let total = so_far + price + square(expected);
                if total < next[to] {
                    next[to] = total;
                    back[to] = held;
                }
            }
        }
        cost = next;
        from.push(back);
    }
    let mut at = (0..=HELD_MAX).min_by(|&a, &b| cost[a].total_cmp(&cost[b])).unwrap_or(0);
    let best = cost[at];
    let mut held = vec![0; packets];
    for packet in (0..packets).rev() {
        held[packet] = at;
        at = from[packet][at];
    }
    (held, nothing - best)
}

fn tracks<'a>(problem: &'a Problem, predicted: &[Vec<f64>], path_delay_s: f64) -> Vec<Track<'a>> {
    problem
        .runs
        .iter()
        .zip(predicted)
        .map(|(run, predicted)| Track::new(problem, run, predicted, path_delay_s))
        .collect()
}

/// The problem on links whose packets were decoded, if one of these effects is random: with its parameters as they are.
pub fn with_packets(mut problem: Problem, trial: &Trial) -> Problem {
    let Some(chosen) = trial.effects.iter().find(|chosen| is_random(chosen)) else { return problem };
    let mut scratch = Scratch::default();
    let predicted: Vec<Vec<f64>> =
        (0..problem.runs.len()).map(|run| problem.predicted(run, trial, &[0.0; 3], &mut scratch).1).collect();
    let delay_s = path_delay_s(&problem.model, &trial.effects);
    if let Some(decoded) = decode(&problem, &chosen.kind, &predicted, delay_s, Some(&chosen.values)) {
        let runs = problem.runs.iter().zip(&decoded.schedules);
        problem.runs = runs.map(|(run, schedule)| run.decoded(&problem.model, schedule)).collect();
    }
    problem
}

/// Decodes a random effect: `predicted` is the reported pose of each run by the deterministic part of the model, `path_delay_s`
/// its delay from command to report. With `known` parameters only the packets are decoded. `None` for an effect that is not
/// random.
pub fn decode(
    problem: &Problem,
    kind: &Kind<Axis>,
    predicted: &[Vec<f64>],
    path_delay_s: f64,
    known: Option<&[f64]>,
) -> Option<Decoded> {
    let tracks = tracks(problem, predicted, path_delay_s);
    match kind.id.as_ref() {
        "command-loss" => Some(decode_losses(kind, &tracks, known)),
        "command-jitter" => Some(jitter::decode(problem, kind, &tracks, known)),
        _ => None,
    }
}

/// Losses.
fn decode_losses(kind: &Kind<Axis>, tracks: &[Track<'_>], known: Option<&[f64]>) -> Decoded {
    let (mut into, mut out) = known.map_or((0.02, 0.5), |values| (values[0], values[1]));

    let mut decoded: Vec<(Vec<usize>, f64)> = Vec::new();
    let mut counts = [0.0; 4];
    for _ in 0..if known.is_some() { 1 } else { 6 } {
        decoded = tracks.iter().map(|track| losses(track, into, out)).collect();
        counts = [0.0; 4];
        if known.is_some() {
            break;
        }
        for (track, (held, _)) in tracks.iter().zip(&decoded) {
            // Packets that do not move tell nothing.
            for packet in (1..held.len()).filter(|&packet| track.advance(packet).abs() > 3.0 * track.sigma_m) {
                let state = usize::from(held[packet - 1] > 0) * 2 + usize::from(held[packet] > 0);
                counts[state] += 1.0;
            }
        }
        // One loss and one end of a loss are added, so that no probability is ever nought.
        into = (counts[1] + 0.5) / (counts[0] + counts[1] + 1.0);
        out = (counts[2] + 0.5) / (counts[2] + counts[3] + 1.0);
    }
    let deviation = |p: f64, n: f64| libm::sqrt(p * (1.0 - p) / n.max(1.0));
    let schedules = tracks.iter().zip(&decoded).map(|(track, (held, _))| held_commands(track, held)).collect();
    Decoded {
        chosen: Chosen { kind: kind.clone(), values: vec![into, out] },
        deviations: vec![deviation(into, counts[0] + counts[1]), deviation(out, counts[2] + counts[3])],
        schedules,
        gains: decoded.iter().map(|(_, gain)| *gain).collect(),
    }
}

fn held_commands(track: &Track<'_>, held: &[usize]) -> Schedule {
    let packet = |(i, held): (usize, &usize)| {
        let motion = track.going_by[i - (*held).min(i)];
        Received { motion, late_s: 0.0, lost: *held > 0 }
    };
    Schedule(held.iter().enumerate().map(packet).collect())
}
