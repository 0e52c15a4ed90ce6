//! Mean speed over a window, with its uncertainty.
//!
//! The thesis takes average speeds before and after contact. Where the satellites' velocity was recorded the average is taken
//! of it; else it is the slope of a straight line through the reported positions (least squares), and never a quotient of two
//! samples. Either standard deviation comes from the scatter inside the window itself.

use super::{Along, Missing, Observation};
use serde::Serialize;

/// Fewer ticks than this are no mean. Chosen: three numbers are left to tell the scatter about a line.
pub(super) const TICKS_MIN: usize = 5;

/// A number and its standard deviation, if that is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub sd: Option<f64>,
}

impl Estimate {
    /// A number that is exact.
    pub fn exact(value: f64) -> Self {
        Estimate { value, sd: Some(0.0) }
    }
}

/// Mean velocity in `[from_s, to_s)`; positive closes.
pub fn mean_velocity(run: &Observation<'_>, along: &Along<'_>, from_s: f64, to_s: f64) -> Result<Estimate, Missing> {
    let ticks = run.ticks(from_s, to_s);
    if ticks.len() < TICKS_MIN {
        let what = alloc::format!("{} ticks from {from_s:.3} to {to_s:.3} s are no mean speed", ticks.len());
        return Err(Missing(what));
    }
    if let Some(after) = along.after.as_ref().and_then(|after| after.get(ticks.clone())) {
        return Ok(mean(after));
    }
    let positions = along.measured.as_ref().or(along.commanded.as_ref());
    let positions = positions.and_then(|positions| positions.get(ticks.clone()));
    let positions = positions.ok_or_else(|| along.no("velocity and no position"))?;
    let time_s: alloc::vec::Vec<f64> = run.loop_time[ticks].iter().map(|time| time.seconds()).collect();
    Ok(slope(&time_s, positions))
}

fn mean(values: &[f64]) -> Estimate {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    Estimate { value: mean, sd: Some(libm::sqrt(squares / (count - 1.0) / count)) }
}

fn slope(time_s: &[f64], values: &[f64]) -> Estimate {
    let count = values.len() as f64;
    let (middle_s, mean) = (time_s.iter().sum::<f64>() / count, values.iter().sum::<f64>() / count);
    let pairs = || time_s.iter().zip(values).map(|(time_s, value)| (time_s - middle_s, value - mean));
    let spread: f64 = pairs().map(|(time, _)| time * time).sum();
    let slope = pairs().map(|(time, value)| time * value).sum::<f64>() / spread;
    let left: f64 = pairs().map(|(time, value)| (value - slope * time) * (value - slope * time)).sum();
    Estimate { value: slope, sd: Some(libm::sqrt(left / (count - 2.0) / spread)) }
}
