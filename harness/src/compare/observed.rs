//! A recording as criteria see it: columns along the axis of travel, without a model.
//!
//! | column | from |
//! |---|---|
//! | commanded, measured | the recorded poses |
//! | velocity of the satellites | the recorded twist; without it speeds are slopes of the reported pose |
//! | sensed | raw reading, with the bias and the tool's weight that the session record declares taken out, positive resists |
//! | noise | what the session record declares; else the scatter of the first 100 ms |
//!
//! Streams are put on the clock of the first that is there (twist, command, reported pose), on the straight line between two
//! samples: a sample that lies on the clock keeps its value. Nothing is shifted.

use crate::blocks::GRAVITY_M_PER_S2;
use crate::case::median_period_ns;
use crate::error::Error;
use crate::recording::{Pose, Series, Session};
use sim_core::criterion::{Along, Column, Observation, ObservedAxis};
use sim_core::time::Nanos;
use std::borrow::Cow;

/// Length of the part at the beginning whose scatter is the noise, where nobody declares it. Chosen: it lies before any contact
/// of a recording that has an approach speed.
const QUIET_NS: i64 = 100_000_000;
/// Fewer samples than this tell no noise. Chosen: their standard deviation is known to a fifth.
const QUIET_SAMPLES_MIN: usize = 12;

/// What the session record says, or does not say.
fn declared(session: &Session, key: &str) -> Result<Option<f64>, Error> {
    if session.believed.contains_key(key) { session.believed_f64(key).map(Some) } else { Ok(None) }
}

/// A recording, ready to be judged.
///
/// # Errors
/// When no stream tells a motion, or a number of the session record is none.
pub fn observation(session: &Session) -> Result<Observation<'static>, Error> {
    let pose_clock = session.commanded.as_ref().or(session.measured.as_ref()).map(|series| &series.time_ns);
    let clock = session.twist.as_ref().map(|series| &series.time_ns).or(pose_clock);
    let clock = clock.filter(|clock| clock.len() > 1).ok_or_else(|| {
        Error::new("the recording has no pose and no velocity")
            .file(&session.file)
            .help("name the topic in a map file and pass it with --map MAP.toml")
    })?;
    let time_ns = regular(clock);
    let z = |pose: &Pose| pose.position_m[2];
    let after = session.twist.as_ref().map(|twist| on_clock(twist, |twist| twist.linear_m_per_s[2], &time_ns));
    let before = after.as_ref().map(|after: &Vec<f64>| {
        after.first().copied().into_iter().chain(after.iter().copied()).take(after.len()).collect::<Vec<f64>>()
    });
    let sensed = sensed(session)?;
    let noise = match (declared(session, "ft_force_sigma_n")?, declared(session, "ft_force_slow_sigma_n")?) {
        (None, None) => {
            session.sensed.as_ref().zip(sensed.as_ref()).and_then(|(series, force)| quiet_sd(series, force))
        }
        (white, slow) => Some(libm::hypot(white.unwrap_or(0.0), slow.unwrap_or(0.0))),
    };
    let owned = |values: Vec<f64>| -> Column<'static> { Cow::Owned(values) };
    let along = Along {
        axis: ObservedAxis::Z,
        feedback: None,
        before: before.map(owned),
        after: after.map(owned),
        commanded: session.commanded.as_ref().map(|series| owned(on_clock(series, z, &time_ns))),
        measured: session.measured.as_ref().map(|series| owned(on_clock(series, z, &time_ns))),
        sensed: sensed.map(owned),
        interface: None,
        load_sd: noise,
        position_sd: declared(session, "position_sigma_m")?,
    };
    let times = |times: &[i64]| Cow::Owned(times.iter().map(|time| Nanos(*time)).collect());
    Ok(Observation {
        loop_time: times(&time_ns),
        sensor_time: session.sensed.as_ref().map_or(Cow::Owned(Vec::new()), |series| times(&series.time_ns)),
        mass_kg: declared(session, "reduced_mass_kg")?,
        contact_plane_m: None,
        depth_m: None,
        depth_rate_m_per_s: None,
        along: vec![along],
    })
}

/// The reading as a force that resists, known bias and weight taken out.
fn sensed(session: &Session) -> Result<Option<Vec<f64>>, Error> {
    let Some(series) = &session.sensed else { return Ok(None) };
    let bias_n = if session.believed.contains_key("ft_bias") {
        session.believed_vec("ft_bias")?.get(2).copied().unwrap_or(0.0)
    } else {
        0.0
    };
    let weight_n = declared(session, "tool_mass_kg")?.unwrap_or(0.0) * GRAVITY_M_PER_S2;
    let pitch_rad = |pose: &Pose| 2.0 * libm::atan2(pose.orientation_xyzw[0], pose.orientation_xyzw[3]);
    let poses = session.measured.as_ref().or(session.commanded.as_ref());
    let pitch = poses.map_or(vec![0.0; series.time_ns.len()], |poses| on_clock(poses, pitch_rad, &series.time_ns));
    let force = |(wrench, pitch_rad): (&crate::recording::Wrench, f64)| {
        bias_n + weight_n * libm::sin(pitch_rad) - wrench.force_n[2]
    };
    Ok(Some(series.value.iter().zip(pitch).map(force).collect()))
}

/// Scatter of the reading at the beginning.
fn quiet_sd(series: &Series<crate::recording::Wrench>, force: &[f64]) -> Option<f64> {
    let first = *series.time_ns.first()?;
    let quiet = &force[..series.time_ns.partition_point(|time| *time < first + QUIET_NS)];
    if quiet.len() < QUIET_SAMPLES_MIN {
        return None;
    }
    let count = quiet.len() as f64;
    let mean = quiet.iter().sum::<f64>() / count;
    Some((quiet.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (count - 1.0)).sqrt())
}

/// Ticks of the median interval, from the first stamp to the last.
fn regular(time_ns: &[i64]) -> Vec<i64> {
    let period_ns = median_period_ns(time_ns).max(1);
    let (first, last) = (time_ns[0], time_ns[time_ns.len() - 1]);
    (0..=(last - first + period_ns / 2) / period_ns).map(|tick| first + tick * period_ns).collect()
}

/// A stream at these times, on the straight line between two samples; before the first and after the last it holds.
fn on_clock<T>(series: &Series<T>, of: impl Fn(&T) -> f64, time_ns: &[i64]) -> Vec<f64> {
    let at = |time: &i64| {
        let next = series.time_ns.partition_point(|stamp| stamp < time);
        let value = |place: usize| series.value.get(place).map_or(f64::NAN, &of);
        if next == 0 {
            value(0)
        } else if next == series.time_ns.len() {
            value(next - 1)
        } else {
            let (early, late) = (series.time_ns[next - 1], series.time_ns[next]);
            let share = (time - early) as f64 / (late - early) as f64;
            // A sample on the clock keeps its bits.
            if *time == late { value(next) } else { value(next - 1) + share * (value(next) - value(next - 1)) }
        }
    };
    time_ns.iter().map(at).collect()
}
