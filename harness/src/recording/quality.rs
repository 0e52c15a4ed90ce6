//! Order, duplicates, gaps and clocks of a stream: repaired where that is safe, reported always.

use super::collect::Stream;
use super::session::{Finding, Grade, Series, Severity};

/// An interval longer than this many nominal periods is a gap: halfway between one sample and two.
const GAP_PERIODS_MIN: f64 = 1.5;
/// Single gaps reported per topic; the rest is counted. Chosen: more would bury other findings.
const GAPS_LISTED_MAX: usize = 10;
/// Clocks that differ by less in their variation tick together: resolution of a header stamp made from a microsecond clock.
const SKEW_VARIATION_NS_MAX: i64 = 1_000;

/// Findings and the grade that follows from them.
#[derive(Debug)]
pub(super) struct Report {
    pub findings: Vec<Finding>,
    pub grade: Grade,
}

impl Default for Report {
    fn default() -> Self {
        Self { findings: Vec::new(), grade: Grade::A }
    }
}

impl Report {
    pub fn add(&mut self, severity: Severity, topic: &str, at_ns: Option<i64>, what: String, consequence: &str) {
        let consequence = consequence.to_owned();
        self.findings.push(Finding { topic: topic.to_owned(), at_ns, what, consequence, severity });
    }

    pub fn lower(&mut self, grade: Grade) {
        self.grade = self.grade.max(grade);
    }
}

/// Puts a stream in order and reports what was not.
pub(super) fn tidy<T: Clone>(
    topic: &str,
    mut stream: Stream<T>,
    start_ns: i64,
    report: &mut Report,
) -> Option<Series<T>> {
    if stream.time_ns.is_empty() {
        return None;
    }
    clocks(topic, stream.skew_ns, report);
    for time_ns in &mut stream.time_ns {
        *time_ns -= start_ns;
    }
    let mut series = Series { time_ns: stream.time_ns, value: stream.value };
    order(topic, &mut series, report);
    duplicates(topic, &mut series, report);
    gaps(topic, &series.time_ns, report);
    Some(series)
}

fn order<T: Clone>(topic: &str, series: &mut Series<T>, report: &mut Report) {
    let times = &series.time_ns;
    let back: Vec<usize> = (1..times.len()).filter(|&i| times[i] < times[i - 1]).collect();
    let Some(&first) = back.first() else { return };
    let what =
        format!("{} of {} samples are earlier than the one before, first sample {first}", back.len(), times.len());
    report.add(
        Severity::Warning,
        topic,
        Some(times[first]),
        what,
        "sorted by time; delays that depend on the order of arrival are lost",
    );
    report.lower(Grade::D);
    let mut by_time: Vec<usize> = (0..times.len()).collect();
    by_time.sort_by_key(|&i| times[i]);
    *series = Series {
        time_ns: by_time.iter().map(|&i| series.time_ns[i]).collect(),
        value: by_time.iter().map(|&i| series.value[i].clone()).collect(),
    };
}

fn duplicates<T: Clone>(topic: &str, series: &mut Series<T>, report: &mut Report) {
    let times = &series.time_ns;
    let again: Vec<usize> = (1..times.len()).filter(|&i| times[i] == times[i - 1]).collect();
    let Some(&first) = again.first() else { return };
    let what =
        format!("{} of {} samples have the time of the one before, first sample {first}", again.len(), times.len());
    report.add(Severity::Warning, topic, Some(times[first]), what, "the first of each is kept, the others are dropped");
    report.lower(Grade::D);
    let keep: Vec<usize> = (0..times.len()).filter(|&i| i == 0 || times[i] != times[i - 1]).collect();
    *series = Series {
        time_ns: keep.iter().map(|&i| series.time_ns[i]).collect(),
        value: keep.iter().map(|&i| series.value[i].clone()).collect(),
    };
}

fn gaps(topic: &str, times: &[i64], report: &mut Report) {
    let Some(nominal_ns) = nominal_period_ns(times) else { return };
    let limit_ns = GAP_PERIODS_MIN * nominal_ns as f64;
    let long: Vec<(i64, i64)> = times
        .windows(2)
        .map(|pair| (pair[0], pair[1] - pair[0]))
        .filter(|(_, length)| *length as f64 > limit_ns)
        .collect();
    let missed = |length_ns: i64| ((length_ns as f64 / nominal_ns as f64).round() as i64 - 1).max(1);
    for (at_ns, length_ns) in long.iter().take(GAPS_LISTED_MAX) {
        let what = format!(
            "a gap of {:.3} ms, nominal period {:.3} ms: {} samples missing",
            *length_ns as f64 * 1e-6,
            nominal_ns as f64 * 1e-6,
            missed(*length_ns)
        );
        report.add(
            Severity::Warning,
            topic,
            Some(*at_ns),
            what,
            "nothing is interpolated: no residual and no energy inside the gap",
        );
        report.lower(Grade::D);
    }
    if let Some(rest) = long.get(GAPS_LISTED_MAX..).filter(|rest| !rest.is_empty()) {
        let samples: i64 = rest.iter().map(|(_, length)| missed(*length)).sum();
        let what = format!("{} more gaps: {samples} samples missing", rest.len());
        report.add(
            Severity::Warning,
            topic,
            Some(rest[0].0),
            what,
            "nothing is interpolated: no residual and no energy inside a gap",
        );
    }
}

/// Median interval; none below three samples.
pub(super) fn nominal_period_ns(times: &[i64]) -> Option<i64> {
    let mut intervals: Vec<i64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if intervals.len() < 2 {
        return None;
    }
    let middle = intervals.len() / 2;
    Some(*intervals.select_nth_unstable(middle).1)
}

fn clocks(topic: &str, skew_ns: Option<(i64, i64)>, report: &mut Report) {
    let Some((least, most)) = skew_ns else { return };
    let milliseconds = |time_ns: i64| time_ns as f64 * 1e-6;
    if most - least > SKEW_VARIATION_NS_MAX {
        let what = format!(
            "log_time - header.stamp varies from {:.6} ms to {:.6} ms",
            milliseconds(least),
            milliseconds(most)
        );
        report.add(
            Severity::Note,
            topic,
            None,
            what,
            "two clocks, or transport with jitter: only the mapped clock is used",
        );
    } else if least != 0 {
        let what = format!("log_time - header.stamp is {:.6} ms throughout", milliseconds(least));
        report.add(Severity::Note, topic, None, what, "the two clocks tick together; only the mapped one is used");
    }
}

/// Reports a stream that does not overlap in time with the rest: its stamps come from another clock.
pub(super) fn overlap(spans: &[(&str, i64, i64)], report: &mut Report) {
    for (topic, first, last) in spans {
        let others = spans.iter().filter(|(other, ..)| other != topic);
        let apart = others.clone().count() > 0 && others.clone().all(|(_, start, end)| last < start || end < first);
        if apart {
            let what = format!(
                "its samples, {:.3} s to {:.3} s, overlap with no other topic",
                *first as f64 * 1e-9,
                *last as f64 * 1e-9
            );
            report.add(
                Severity::Defect,
                topic,
                Some(*first),
                what,
                "nothing can be compared with it; its clock is another one: try clock_of or clock = \"log\" in the map",
            );
        }
    }
}
