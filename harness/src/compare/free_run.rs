//! The free run: the whole loop from the recorded first motion on, nothing else clamped, many times over.
//!
//! Each run draws its stiffness, damping and force offset from the declared repeatability, and its own sensor noise, which the
//! loop feels. Every draw has a name made of seed, recording, run and quantity: neither the order nor the number of threads
//! changes it. The approach speed is not drawn: the first motion is recorded exactly.

use super::log::Log;
use super::quantity::{self, Seen};
use super::result::FreeRunSummary;
use crate::blocks::{self, Base, Cell};
use crate::case::Case;
use crate::model::{Chosen, Model};
use rayon::prelude::*;
use sim_core::closed_loop::{Clamps, Start};
use sim_core::effect::{Attached, Rates};
use sim_core::force_sensor::SensorNoise;
use sim_core::rng::Streams;
use sim_core::space::Axis;
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// A pose or a command beyond this is a loop that ran away: the travel of a docking cell is a fraction of it.
const TRAVEL_MAX_M: f64 = 1.0;

/// What one free run is given.
struct Inputs {
    base: Base,
    offset_n: f64,
    noise: SensorNoise,
    streams: Streams,
    rates: Rates,
}

/// One free run that stayed finite.
struct Free {
    force_n: Vec<f64>,
    commanded_m: Vec<f64>,
    seen: Seen,
}

/// Median and 95 % band of a channel.
#[derive(Debug, Clone, Default)]
pub struct Band {
    /// Half of the runs lie below.
    pub median: Vec<f64>,
    /// 2.5 % of the runs lie below.
    pub low: Vec<f64>,
    /// 2.5 % of the runs lie above.
    pub high: Vec<f64>,
}

/// What the free runs of a recording say.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// How it went.
    pub summary: FreeRunSummary,
    /// Quantities of each run that did not diverge.
    pub seen: Vec<Seen>,
    /// Quantities without noise and scatter, at the physics step and at half of it.
    pub coarse_and_fine: (Seen, Seen),
    /// Contact force, one value for each tick of the sensor.
    pub force_n: Band,
}

/// Runs the loop `samples` times from the first motion of a recording.
pub fn run(model: &Model, effects: &[Chosen], case: &Case, noise: SensorNoise, samples: usize, seed: u64) -> Outcome {
    let attached: Vec<Attached<Axis>> = effects.iter().map(Chosen::attach).collect();
    let threshold_n = quantity::threshold_n(&noise);
    let drawn = |index: usize| {
        let inputs = drawn(model, case, noise, seed, index);
        free(model, &attached, case, &inputs, threshold_n)
    };
    let runs: Vec<Option<Free>> = (0..samples).into_par_iter().map(drawn).collect();
    let quiet = |rates: Rates| {
        let inputs = Inputs {
            base: Base::of(model),
            offset_n: 0.0,
            noise: SensorNoise::NONE,
            streams: Streams::new(seed),
            rates,
        };
        free(model, &attached, case, &inputs, threshold_n).map(|free| free.seen).unwrap_or_default()
    };
    let half = Rates { physics_step: Nanos(case.rates.physics_step.0 / 2), ..case.rates };
    // An odd number of nanoseconds cannot be halved; then the step is said to cost nothing that could be measured.
    let can_halve = case.rates.physics_step.0 % 2 == 0;
    let coarse = quiet(case.rates);
    let fine = if can_halve { quiet(half) } else { coarse.clone() };
    let kept: Vec<Free> = runs.into_iter().flatten().collect();
    let command = band(&kept, |free| &free.commanded_m);
    let (command_error_m, command_band_m) = command_error(case, &command);
    Outcome {
        summary: FreeRunSummary { samples, diverged: samples - kept.len(), seed, command_error_m, command_band_m },
        force_n: band(&kept, |free| &free.force_n),
        seen: kept.into_iter().map(|free| free.seen).collect(),
        coarse_and_fine: (coarse, fine),
    }
}

/// The inputs of one run, drawn from the declared repeatability.
fn drawn(model: &Model, case: &Case, noise: SensorNoise, seed: u64, index: usize) -> Inputs {
    let streams = Streams::new(seed);
    let name = |what: &str| format!("free-run/{}/{index}/{what}", case.name);
    let normal = |what: &str| streams.named(&name(what)).normal();
    let repeat = &model.repeatability;
    let base = Base::of(model);
    // 53 random bits make the seed of the run's own streams: noise and random effects.
    let own = (streams.named(&name("loop")).uniform() * 9_007_199_254_740_992.0) as u64;
    Inputs {
        base: Base {
            stiffness_n_per_m: base.stiffness_n_per_m * libm::exp(repeat.stiffness_ratio * normal("stiffness")),
            damping_n_s_per_m: base.damping_n_s_per_m * libm::exp(repeat.damping_ratio * normal("damping")),
            ..base
        },
        offset_n: repeat.force_offset_n * normal("offset"),
        noise,
        streams: Streams::new(own),
        rates: case.rates,
    }
}

/// One free run; `None` if it ran away.
fn free(model: &Model, attached: &[Attached<Axis>], case: &Case, inputs: &Inputs, threshold_n: f64) -> Option<Free> {
    let cell = Cell { base: inputs.base, sensor_offset_n: inputs.offset_n, ..Cell::of(model, case.mass_kg) };
    let start =
        Start { first: case.first, from: Nanos(0), until: case.until, noise: inputs.noise, streams: inputs.streams };
    let mut trace = Trace::default();
    cell.run(attached, inputs.rates, &start, &Clamps::default(), Columns::LOG, &mut trace);
    let late_s: f64 = attached.iter().map(|attached| attached.effect.stamp_offset_s()).sum();
    let sensed_n = blocks::stamped(&trace.sensed, late_s / case.rates.sensor_period.seconds());
    let stays = |position_m: f64| position_m.is_finite() && position_m.abs() <= TRAVEL_MAX_M;
    let motions = trace.commanded.iter().chain(&trace.measured).all(|motion| stays(motion.position_m));
    if !(motions && sensed_n.iter().all(|reading| reading.is_finite())) {
        return None;
    }
    let log = Log::simulated(model, case, &trace, &sensed_n);
    let seen = quantity::seen(&log, threshold_n);
    let commanded_m = trace.commanded.iter().map(|motion| motion.position_m).collect();
    Some(Free { force_n: log.force_n, commanded_m, seen })
}

fn band(runs: &[Free], channel: impl Fn(&Free) -> &Vec<f64>) -> Band {
    let mut band = Band::default();
    let Some(first) = runs.first() else { return band };
    let mut sorted = vec![0.0; runs.len()];
    for tick in 0..channel(first).len() {
        for (value, run) in sorted.iter_mut().zip(runs) {
            *value = channel(run)[tick];
        }
        sorted.sort_by(f64::total_cmp);
        band.low.push(quantile(&sorted, 0.025));
        band.median.push(quantile(&sorted, 0.5));
        band.high.push(quantile(&sorted, 0.975));
    }
    band
}

/// On the straight line between the two nearest of sorted values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let low = libm::floor(place) as usize;
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + (sorted[high] - sorted[low]) * (place - low as f64)
}

/// Largest distance of the recorded command from the median, and half the band there.
fn command_error(case: &Case, band: &Band) -> (Option<f64>, Option<f64>) {
    let known = (0..band.median.len().min(case.commanded.len())).filter(|&tick| case.commanded_known[tick]);
    let error = |tick: usize| (case.commanded[tick].position_m - band.median[tick]).abs();
    match known.max_by(|&a, &b| error(a).total_cmp(&error(b))) {
        Some(tick) => (Some(error(tick)), Some(0.5 * (band.high[tick] - band.low[tick]))),
        None => (None, None),
    }
}
