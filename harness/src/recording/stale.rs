//! A noisy channel that repeats itself: the last value was sent again, and the sensor said nothing.
//!
//! Whether noise is to be expected is read from the channel itself. White noise turns back at 2 of 3 samples; a smooth
//! signal almost never does. A channel that is frozen throughout has no noise to go by and is judged by its neighbour.

use super::quality::Report;
use super::session::{Grade, Pose, Series, Severity, Wrench};

/// Identical samples in a row that noise can still explain. Chosen; with noise of 3 counts the chance is 1e-10 a run.
const REPEATS_MAX: usize = 10;
/// Share of turns that noise has at least; white noise has 2/3.
const TURNS_MIN: f64 = 0.3;
/// Share of samples outside long runs that differ from the one before, in a noisy channel.
const CHANGES_MIN: f64 = 0.9;
/// Travel of the command during which a reported pose cannot stand still: far above the rounding of any log.
const TRAVEL_M: f64 = 2e-4;
/// How long a robot may rest at the start of a recording while the first commands are on their way, in ns: several times the dead
/// times of any cell. Chosen.
const COMING_NS: i64 = 200_000_000;
/// Samples that the judgement needs.
const SAMPLES_MIN: usize = 30;

pub(super) fn sensed(topic: &str, series: &Series<Wrench>, report: &mut Report) {
    let parts = |wrench: &Wrench| {
        let ([fx, fy, fz], [tx, ty, tz]) = (wrench.force_n, wrench.torque_n_m);
        [fx, fy, fz, tx, ty, tz, 0.0]
    };
    if is_frozen(series, parts) {
        let what = format!("all {} samples are the same", series.value.len());
        report.add(
            Severity::Warning,
            topic,
            None,
            what,
            "a sensor has noise: it is switched off, stuck or simulated without noise",
        );
    }
    runs(topic, series, parts, None::<fn(i64, i64) -> bool>, report);
}

pub(super) fn measured(topic: &str, series: &Series<Pose>, commanded: Option<&Series<Pose>>, report: &mut Report) {
    if is_frozen(series, pose_parts) && commanded.is_some_and(|other| !other.value.is_empty() && !is_constant(other)) {
        let what = format!("all {} samples are the same while the command moves", series.value.len());
        report.add(
            Severity::Defect,
            topic,
            None,
            what,
            "the controller reports no motion: nothing can be compared with it",
        );
        report.lower(Grade::D);
    }
    // A moving channel has too little noise to turn back, but it cannot stand still while the command goes on.
    let first_ns = series.time_ns.first().copied().unwrap_or(0);
    let moved = |from_ns: i64, to_ns: i64| {
        let to_ns = if from_ns == first_ns { to_ns - COMING_NS } else { to_ns };
        commanded.is_some_and(|commanded| travel_m(commanded, from_ns, to_ns) > TRAVEL_M)
    };
    runs(topic, series, pose_parts, Some(moved), report);
}

/// How far a pose travels between two times.
fn travel_m(series: &Series<Pose>, from_ns: i64, to_ns: i64) -> f64 {
    let at = |time_ns: i64| {
        let index = series.time_ns.partition_point(|other| *other < time_ns).min(series.value.len().saturating_sub(1));
        series.value.get(index).map(|pose| pose.position_m)
    };
    match (at(from_ns), at(to_ns)) {
        (Some(from), Some(to)) => libm::sqrt(from.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum()),
        _ => 0.0,
    }
}

fn pose_parts(pose: &Pose) -> [f64; 7] {
    let ([px, py, pz], [qx, qy, qz, qw]) = (pose.position_m, pose.orientation_xyzw);
    [px, py, pz, qx, qy, qz, qw]
}

fn is_constant(series: &Series<Pose>) -> bool {
    series.value.windows(2).all(|pair| same(&pose_parts(&pair[0]), &pose_parts(&pair[1])))
}

fn is_frozen<T>(series: &Series<T>, parts: impl Fn(&T) -> [f64; 7]) -> bool {
    series.value.len() > REPEATS_MAX && series.value.windows(2).all(|pair| same(&parts(&pair[0]), &parts(&pair[1])))
}

fn same(a: &[f64; 7], b: &[f64; 7]) -> bool {
    a.map(f64::to_bits) == b.map(f64::to_bits)
}

/// `moved` says whether what is reported must have moved; what needs not may rest at the start, with or without noise.
fn runs<T>(
    topic: &str,
    series: &Series<T>,
    parts: impl Fn(&T) -> [f64; 7],
    moved: Option<impl Fn(i64, i64) -> bool>,
    report: &mut Report,
) {
    if series.value.len() < SAMPLES_MIN {
        return;
    }
    let values: Vec<[f64; 7]> = series.value.iter().map(parts).collect();
    let mut long: Vec<(usize, usize)> = Vec::new();
    let mut start = 0;
    for i in 1..=values.len() {
        if values.get(i).is_some_and(|value| same(value, &values[start])) {
            continue;
        }
        if i - start > REPEATS_MAX {
            long.push((start, i - start));
        }
        start = i;
    }
    let noisy = is_noisy(&values, &long);
    for (first, length) in long {
        let at_ns = series.time_ns[first];
        let must_move = moved.as_ref().map(|moved| moved(at_ns, series.time_ns[first + length - 1]));
        let shows_noise = noisy && !(must_move.is_some() && first == 0);
        if !shows_noise && must_move != Some(true) {
            continue;
        }
        let span_ms = (series.time_ns[first + length - 1] - at_ns) as f64 * 1e-6;
        let what = format!(
            "{length} identical samples in a row ({span_ms:.3} ms), at most {REPEATS_MAX} are explained by noise"
        );
        report.add(
            Severity::Defect,
            topic,
            Some(at_ns),
            what,
            "stale: the last value was repeated, what happened there is unknown",
        );
        report.lower(Grade::D);
    }
}

fn is_noisy(values: &[[f64; 7]], long: &[(usize, usize)]) -> bool {
    let repeated: usize = long.iter().map(|(_, length)| length - 1).sum();
    let changes = values.windows(2).filter(|pair| !same(&pair[0], &pair[1])).count();
    let pairs = values.len() - 1 - repeated;
    if pairs < SAMPLES_MIN || (changes as f64) < CHANGES_MIN * pairs as f64 {
        return false;
    }
    (0..7).any(|part| {
        let steps = values.windows(2).map(|pair| pair[1][part] - pair[0][part]).filter(|step| step.abs() > 0.0);
        let signs: Vec<bool> = steps.map(|step| step > 0.0).collect();
        let turns = signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
        signs.len() >= SAMPLES_MIN && turns as f64 >= TURNS_MIN * signs.len() as f64
    })
}
