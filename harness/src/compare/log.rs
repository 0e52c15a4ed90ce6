//! What a recording and a free run have in common: the same numbers are taken from both by the same functions, so that an
//! estimator's own error is the same on either side.

use crate::blocks::GRAVITY_M_PER_S2;
use crate::case::Case;
use crate::model::Model;
use sim_core::plant::PointIntegrator;
use sim_core::space::{Axis, AxisMotion};
use sim_core::trace::Trace;

/// A run along the axis.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// Time of the first force sample, in s.
    pub sensor_first_s: f64,
    /// Period of the force samples, in s.
    pub sensor_period_s: f64,
    /// Contact force: known bias and weight taken out, positive resists penetration.
    pub force_n: Vec<f64>,
    /// Whether each force sample was recorded.
    pub force_known: Vec<bool>,
    /// Time of the first tick of the loop, in s.
    pub loop_first_s: f64,
    /// Period of the loop, in s.
    pub loop_period_s: f64,
    /// Velocity of the satellites before each tick.
    pub before_m_per_s: Vec<f64>,
    /// Velocity of the satellites after each tick.
    pub after_m_per_s: Vec<f64>,
    /// Mass of the satellites.
    pub mass_kg: f64,
}

impl Log {
    /// What was recorded.
    pub fn recorded(model: &Model, case: &Case) -> Self {
        let force_n = contact_force_n(model, case, &case.commanded, &case.sensed_n.value);
        let after = if case.after_m_per_s.value.len() == case.commanded.len() {
            case.after_m_per_s.value.clone()
        } else {
            after_from_commands(model, case)
        };
        Log::new(case, force_n, case.sensed_n.known.clone(), after)
    }

    /// What a free run gave; `sensed_n` as the recorder stamps it.
    pub fn simulated(model: &Model, case: &Case, trace: &Trace<Axis>, sensed_n: &[f64]) -> Self {
        let force_n = contact_force_n(model, case, &trace.commanded, sensed_n);
        let known = vec![true; force_n.len()];
        Log::new(case, force_n, known, trace.after.iter().map(|motion| motion.velocity_m_per_s).collect())
    }

    fn new(case: &Case, force_n: Vec<f64>, force_known: Vec<bool>, after_m_per_s: Vec<f64>) -> Self {
        let mut before_m_per_s = Vec::with_capacity(after_m_per_s.len());
        before_m_per_s.push(case.first.velocity_m_per_s);
        before_m_per_s.extend_from_slice(&after_m_per_s[..after_m_per_s.len().saturating_sub(1)]);
        Log {
            sensor_first_s: case.sensor_time_s(0),
            sensor_period_s: case.rates.sensor_period.seconds(),
            force_n,
            force_known,
            loop_first_s: case.loop_time_s(0),
            loop_period_s: case.rates.loop_period.seconds(),
            before_m_per_s,
            after_m_per_s,
            mass_kg: case.mass_kg,
        }
    }

    /// Time of a force sample; the index may lie between two samples.
    pub fn sensor_time_s(&self, index: f64) -> f64 {
        self.sensor_first_s + index * self.sensor_period_s
    }

    /// The ticks of the loop within a window of time.
    pub fn ticks(&self, from_s: f64, to_s: f64) -> std::ops::Range<usize> {
        let tick = |time_s: f64| libm::ceil((time_s - self.loop_first_s) / self.loop_period_s).max(0.0) as usize;
        let end = tick(to_s).min(self.after_m_per_s.len());
        tick(from_s).min(end)..end
    }
}

/// Contact force of each reading: `c + W sin θ - reading`, with θ of the command that the robot is reaching.
pub fn contact_force_n(model: &Model, case: &Case, commanded: &[AxisMotion], reading_n: &[f64]) -> Vec<f64> {
    let weight_n = model.sensor.tool_mass_kg * GRAVITY_M_PER_S2;
    let period_s = case.rates.loop_period.seconds();
    let of = |(tick, reading_n): (usize, &f64)| {
        let at = (case.sensor_time_s(tick) - model.timing.command_delay_s) / period_s;
        let at = (libm::round(at).max(0.0) as usize).min(commanded.len().saturating_sub(1));
        let pitch_rad = commanded.get(at).map_or(0.0, |motion| motion.pitch_rad);
        model.sensor.bias_n + weight_n * libm::sin(pitch_rad) - reading_n
    };
    reading_n.iter().enumerate().map(of).collect()
}

/// Velocities after each tick where no twist was recorded. Two commands give the velocity that moved the point within a tick, `v̄`.
/// Where the force is held exactly it is the mean of the tick, and `v₊ = 2 v̄ - v₋`; by the other integrators it is the velocity
/// after the tick, or the one before it.
fn after_from_commands(model: &Model, case: &Case) -> Vec<f64> {
    let period_s = case.rates.loop_period.seconds();
    let moved: Vec<f64> =
        case.commanded.windows(2).map(|pair| (pair[1].position_m - pair[0].position_m) / period_s).collect();
    let mut out: Vec<f64> = match model.plant.integrator {
        PointIntegrator::ExactHold => exactly_held(case, &moved),
        PointIntegrator::SemiImplicit => moved,
        PointIntegrator::Explicit => moved.into_iter().skip(1).collect(),
    };
    let last = out.last().copied().unwrap_or(case.first.velocity_m_per_s);
    out.resize(case.commanded.len(), last);
    out
}

/// `v₊ = 2 v̄ - v₋`. Beside a gap `v̄` is not known: the velocity stays, and after it the mean of two ticks gives it anew.
fn exactly_held(case: &Case, moved: &[f64]) -> Vec<f64> {
    let known = |tick: usize| case.trusts_command(tick) && case.trusts_command(tick + 1);
    let mut before = case.first.velocity_m_per_s;
    let one = |(tick, mean): (usize, &f64)| {
        if known(tick) && (tick == 0 || known(tick - 1)) {
            before = 2.0 * mean - before;
        } else if known(tick) {
            let next = if tick + 1 < moved.len() && known(tick + 1) { moved[tick + 1] } else { *mean };
            before = 0.5 * (mean + next);
        }
        before
    };
    moved.iter().enumerate().map(one).collect()
}
