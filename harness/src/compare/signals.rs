//! The curves that the report shows of one recording.

use super::clamped::Clamped;
use super::free_run::Band;
use super::log::contact_force_n;
use super::result::Signals;
use crate::blocks;
use crate::case::Channel;
use crate::diagnose::problem::{Problem, Trial};
use crate::model::RigKind;

/// Collects the curves of one run.
pub fn signals(problem: &Problem, index: usize, trial: &Trial, clamped: &Clamped, free: Option<&Band>) -> Signals {
    let case = &problem.runs[index].case;
    let measured_m = &case.measured_m;
    let mut out = Signals {
        pose_time_s: (0..measured_m.value.len()).map(|tick| case.loop_time_s(tick)).collect(),
        pose_measured_m: with_gaps(measured_m, |tick| measured_m.value[tick]),
        pose_model_m: clamped.measured_m.clone(),
        pose_residual_m: with_gaps(measured_m, |tick| measured_m.value[tick] - clamped.measured_m[tick]),
        pose_band_m: 2.0 * problem.noise.position_floor_m,
        contact_s: clamped.contact.map(|contact| (contact.first_s, contact.last_s)),
        ..Signals::default()
    };
    if problem.model.rig == RigKind::Drive {
        return out;
    }
    let sensed = &case.sensed_n;
    let measured_n = contact_force_n(&problem.model, case, &case.commanded, &sensed.value);
    let model_n = contact_force_n(&problem.model, case, &case.commanded, &clamped.force_n);
    out.force_time_s = (0..sensed.value.len()).map(|tick| case.sensor_time_s(tick)).collect();
    out.force_measured_n = with_gaps(sensed, |tick| measured_n[tick]);
    out.force_residual_n = with_gaps(sensed, |tick| measured_n[tick] - model_n[tick]);
    out.force_model_n = model_n;
    out.force_band_n = 2.0 * problem.noise.force_floor_n;
    let on_path = trial.effects.iter().any(|chosen| blocks::is_on_path(&chosen.kind.wires));
    let path =
        on_path.then(|| blocks::path(&problem.model, case, &trial.effects, problem.runs[index].schedule.as_ref()));
    let path = path.as_ref().unwrap_or_else(|| problem.runs[index].nominal_path());
    out.depth_m = (0..sensed.value.len())
        .map(|tick| {
            let time_ns = case.rates.sensor_phase.0 + tick as i64 * case.rates.sensor_period.0;
            let step = (time_ns / case.rates.physics_step.0) as usize;
            path.achieved.get(step).or(path.achieved.last()).map_or(0.0, |motion| motion.position_m)
        })
        .collect();
    if let Some(free) = free {
        out.free_median_n = free.median.clone();
        out.free_low_n = free.low.clone();
        out.free_high_n = free.high.clone();
    }
    out
}

/// A value where a sample was recorded, else a gap.
fn with_gaps(channel: &Channel, value: impl Fn(usize) -> f64) -> Vec<Option<f64>> {
    channel.known.iter().enumerate().map(|(tick, known)| known.then(|| value(tick))).collect()
}
