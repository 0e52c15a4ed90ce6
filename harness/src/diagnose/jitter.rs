//! Jitter, packet by packet: when each command took effect, from the pose that was reported.
//!
//! The robot draws straight lines between commands (d_i, c_i), d_i = i T + j_i. The report at tick i + lag shows that path at
//! (i + share) T, with noise σ_m; each lateness j_i has standard deviation σ. The most likely latenesses minimise
//! `Σ (r - Δy(j))²/σ_m² + Σ j²/σ²` (Gauss-Newton; each report depends on two neighbours, so the normal matrix is tridiagonal).
//! The path is not linear in j: a packet that is 1.5 ms late stretches a line of 4 ms, so that variances alone would find a σ that
//! is a quarter too small. σ maximises the marginal likelihood of all runs (Laplace): `-2 log p = cost + log det(σ² H)`.

use super::problem::Problem;
use super::random::{Decoded, Track};
use crate::blocks::Schedule;
use crate::model::Chosen;
use sim_core::effect::Kind;
use sim_core::signals::Received;
use sim_core::space::Axis;

/// The range of σ that is searched, in s, and in how many equal ratios.
const SIGMA_S: (f64, f64) = (2e-5, 1e-2);
const RATIOS: i32 = 36;
/// Golden-section steps between two of them: σ to a thousandth, far below its own standard deviation.
const SECTIONS: usize = 14;
/// Gauss-Newton steps, and halvings of one that does not help.
const STEPS: usize = 12;
const HALVINGS: usize = 6;
/// A step that lowers the cost by less is the last one: ranking resolves about 1 over all runs together.
const GAIN_MIN: f64 = 1e-3;
/// From this share of a tick on packets wait for one another, and σ is known to its order of magnitude alone. Found on runs with a
/// known σ: 2, 3, 5 and 8 ms at 4 ms gave 1.3, 5.0, 3.9 and 1.8 ms.
const WAITS: f64 = 0.3;
const ORDER: f64 = 0.6;
/// What the straight lines cost below it, as a share of σ: 0.2 and 1 ms gave 0.17 and 0.94 ms.
const FORM: f64 = 0.15;
/// Packets never overtake: the least time between two, in ticks.
const APART: f64 = 1e-6;

/// What one run says of its packets.
struct Solution {
    /// Lateness of each packet, in ticks.
    late: Vec<f64>,
    /// Twice the log density of the report above 'every packet was in time'.
    gain: f64,
}

/// The tridiagonal normal equations at one point.
struct Normal {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
    gradient: Vec<f64>,
}

/// The standard deviation by maximum likelihood, unless it is known, then the most likely lateness of each packet.
pub(super) fn decode(problem: &Problem, kind: &Kind<Axis>, tracks: &[Track<'_>], known: Option<&[f64]>) -> Decoded {
    let tick_s = problem.model.timing.loop_period_s;
    let total = |sigma_s: f64| tracks.iter().map(|track| solve(track, sigma_s / tick_s).gain).sum::<f64>();
    let sigma_s = known.map_or_else(|| likeliest(&total), |values| values[0]);
    let nudge = 0.05 * sigma_s.max(SIGMA_S.0);
    let curvature = (2.0 * total(sigma_s) - total(sigma_s + nudge) - total(sigma_s - nudge)) / (nudge * nudge);
    let fitted = if curvature > 0.0 { libm::sqrt(2.0 / curvature) } else { f64::INFINITY };
    let form = if sigma_s > WAITS * tick_s { ORDER } else { FORM } * sigma_s;
    let solved: Vec<Solution> = tracks.iter().map(|track| solve(track, sigma_s / tick_s)).collect();
    let schedule = |(track, solution): (&Track<'_>, &Solution)| {
        let packets = track.run.case.commanded.iter().zip(&solution.late);
        Schedule(
            packets.map(|(motion, late)| Received { motion: *motion, late_s: late * tick_s, lost: false }).collect(),
        )
    };
    Decoded {
        chosen: Chosen { kind: kind.clone(), values: vec![sigma_s] },
        deviations: vec![libm::hypot(fitted, form)],
        schedules: tracks.iter().zip(&solved).map(schedule).collect(),
        gains: solved.iter().map(|solution| solution.gain).collect(),
    }
}

/// The largest of a function of σ that has one maximum; 0 if nothing is better than no jitter.
fn likeliest(total: &dyn Fn(f64) -> f64) -> f64 {
    let (low, high) = (libm::log(SIGMA_S.0), libm::log(SIGMA_S.1));
    let at = |index: i32| low + (high - low) * f64::from(index) / f64::from(RATIOS);
    let value = |x: f64| total(libm::exp(x));
    let grid: Vec<f64> = (0..=RATIOS).map(|index| value(at(index))).collect();
    let best = (0..=RATIOS).max_by(|a, b| grid[*a as usize].total_cmp(&grid[*b as usize])).unwrap_or(0);
    if grid[best as usize] <= 0.0 {
        return 0.0;
    }
    let (mut from, mut to) = (at((best - 1).max(0)), at((best + 1).min(RATIOS)));
    let golden = 0.5 * (libm::sqrt(5.0) - 1.0);
    let (mut left, mut right) = (to - golden * (to - from), from + golden * (to - from));
    let (mut at_left, mut at_right) = (value(left), value(right));
    for _ in 0..SECTIONS {
        if at_left > at_right {
            (to, right, at_right) = (right, left, at_left);
            left = to - golden * (to - from);
            at_left = value(left);
        } else {
            (from, left, at_left) = (left, right, at_right);
            right = from + golden * (to - from);
            at_right = value(right);
        }
    }
    libm::exp(0.5 * (from + to))
}

fn solve(track: &Track<'_>, sigma: f64) -> Solution {
    let packets = track.run.case.commanded.len();
    let in_time = vec![0.0; packets];
    if sigma <= 0.0 {
        return Solution { late: in_time, gain: 0.0 };
    }
    let nothing = cost(track, sigma, &in_time);
    let (mut late, mut now) = (in_time, nothing);
    for _ in 0..STEPS {
        let step = linearise(track, sigma, &late).step();
        let tried = (0..HALVINGS).find_map(|halving| {
            let share = 1.0 / f64::from(1 << halving);
            let there: Vec<f64> = late.iter().zip(&step).map(|(late, step)| late - share * step).collect();
            let cost = cost(track, sigma, &there);
            (cost < now).then_some((there, cost))
        });
        let Some((there, cost)) = tried else { break };
        let gained = now - cost;
        (late, now) = (there, cost);
        if gained < GAIN_MIN {
            break;
        }
    }
    let gain = nothing - now - linearise(track, sigma, &late).log_det_over_prior(sigma);
    Solution { late, gain }
}

/// When each packet takes effect, in ticks of the command's own clock.
fn due(late: &[f64]) -> Vec<f64> {
    let mut last = f64::NEG_INFINITY;
    let one = |(packet, late): (usize, &f64)| {
        last = (packet as f64 + late).max(last + APART);
        last
    };
    late.iter().enumerate().map(one).collect()
}

/// Position at a report on the straight lines, less the one without lateness; the packet that begins the line, the share of the
/// line that is done, and its slope per tick. Before the first packet the robot comes in along its velocity, as late as that one.
fn shown(track: &Track<'_>, due: &[f64], report: usize) -> Option<(f64, usize, f64, f64)> {
    let time = report as f64 - track.lag as f64 + track.share;
    let coming_in = track.run.case.first.velocity_m_per_s * track.run.case.rates.loop_period.seconds();
    let in_time = in_time(track, report).unwrap_or(track.command(0) + coming_in * time);
    if time <= due[0] {
        return Some((track.command(0) + coming_in * (time - due[0]) - in_time, 0, 0.0, coming_in));
    }
    let mut from = report.saturating_sub(track.lag).min(due.len() - 1);
    while from > 0 && due[from] >= time {
        from -= 1;
    }
    while from + 1 < due.len() && due[from + 1] < time {
        from += 1;
    }
    if from + 1 >= due.len() {
        return None;
    }
    let (begin, end) = (track.command(from), track.command(from + 1));
    let length = due[from + 1] - due[from];
    let done = (time - due[from]) / length;
    Some((begin + (end - begin) * done - in_time, from, done, (end - begin) / length))
}

/// Position at a report if every packet were in time; `None` before the first.
fn in_time(track: &Track<'_>, report: usize) -> Option<f64> {
    let packet = report.checked_sub(track.lag)?;
    let next = track.command((packet + 1).min(track.run.case.commanded.len() - 1));
    Some(track.command(packet) + (next - track.command(packet)) * track.share)
}

/// Every report that a packet's line can show: its residual, and what the latenesses make of it.
fn reports<'t>(track: &'t Track<'_>, due: &'t [f64]) -> impl Iterator<Item = (f64, usize, f64, f64)> + 't {
    let one = move |report: usize| {
        let residual = *track.residual_m.get(report)?;
        let (moved, from, done, slope) = shown(track, due, report)?;
        (!residual.is_nan()).then_some((residual - moved, from, done, slope))
    };
    (0..due.len() + track.lag).filter_map(one)
}

fn cost(track: &Track<'_>, sigma: f64, late: &[f64]) -> f64 {
    let weight = 1.0 / (track.sigma_m * track.sigma_m);
    let of_reports: f64 = reports(track, &due(late)).map(|(left, ..)| left * left * weight).sum();
    of_reports + late.iter().map(|late| late * late / (sigma * sigma)).sum::<f64>()
}

fn linearise(track: &Track<'_>, sigma: f64, late: &[f64]) -> Normal {
    let (weight, prior) = (1.0 / (track.sigma_m * track.sigma_m), 1.0 / (sigma * sigma));
    let mut normal = Normal {
        diagonal: vec![prior; late.len()],
        beside: vec![0.0; late.len()],
        gradient: late.iter().map(|late| late * prior).collect(),
    };
    for (left, from, done, slope) in reports(track, &due(late)) {
        // A later begin or end of the line makes the pose lag; the residual that is left grows by as much.
        let (begin, end) = (slope * (1.0 - done), slope * done);
        normal.diagonal[from] += begin * begin * weight;
        normal.diagonal[from + 1] += end * end * weight;
        normal.beside[from] += begin * end * weight;
        normal.gradient[from] += begin * left * weight;
        normal.gradient[from + 1] += end * left * weight;
    }
    normal
}

impl Normal {
    /// Pivots of the elimination, and the right side after it.
    fn eliminated(&self) -> (Vec<f64>, Vec<f64>) {
        let (mut pivot, mut right) = (self.diagonal.clone(), self.gradient.clone());
        for i in 1..pivot.len() {
            let factor = self.beside[i - 1] / pivot[i - 1];
            pivot[i] -= factor * self.beside[i - 1];
            right[i] -= factor * right[i - 1];
        }
        (pivot, right)
    }

    fn step(&self) -> Vec<f64> {
        let (pivot, mut right) = self.eliminated();
        for i in (0..pivot.len()).rev() {
            let after = if i + 1 < pivot.len() { self.beside[i] * right[i + 1] } else { 0.0 };
            right[i] = (right[i] - after) / pivot[i];
        }
        right
    }

    fn log_det_over_prior(&self, sigma: f64) -> f64 {
        self.eliminated().0.iter().map(|pivot| libm::log(pivot * sigma * sigma)).sum()
    }
}
