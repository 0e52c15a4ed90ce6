//! What `record` and `import` tell of a session, and what they share.

use super::console::Console;
use super::outcome::Exit;
use super::shortfall::shortfalls;
use crate::cell::Cell;
use crate::clocks::ClockLine;
use crate::error::Error;
use crate::recorder::{Heard, Recorder, Spread, Summary, Tapped};
use crate::recording::Kind;
use serde_json::json;
use sim_core::time::Nanos;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a recording came to.
pub(super) struct Outcome {
    pub summary: Summary,
    pub tapped: Option<Tapped>,
    pub latencies: Vec<(&'static str, Spread)>,
    /// The session; `None` where nothing was worth keeping.
    pub file: Option<PathBuf>,
    /// The capture.
    pub source: Option<PathBuf>,
    /// What came from the sensor; `None` where it was not listened to.
    pub heard: Option<Heard>,
}

/// The kind of a session of a cell.
pub(super) fn kind(text: &str) -> Result<Kind, String> {
    let known = [Kind::Static, Kind::FreeFlight, Kind::Impact];
    let found = known.into_iter().find(|kind| kind.id() == text);
    found.ok_or_else(|| "expected static, free-flight or impact".to_owned())
}

/// A capture.
pub(super) fn open(path: &Path) -> Result<File, Error> {
    if path.is_dir() {
        let help = "name the pcap or pcapng in it";
        return Err(Error::new("is a folder, expected a capture").file(path).help(help));
    }
    File::open(path).map_err(|error| {
        Error::new(format!("cannot read the capture: {error}")).file(path).help("check the path of the capture")
    })
}

/// What a capture skipped becomes events of the session.
pub(super) fn note_capture<W: Write>(recorder: &mut Recorder<W>, tapped: &Tapped) -> Result<(), Error> {
    let at = Nanos(recorder.last_ns());
    for (why, count) in &tapped.tally.skipped {
        recorder.event(at, "capture", why.id(), &format!("{count} {}", why.about()))?;
    }
    match &tapped.damage {
        None => Ok(()),
        Some(damage) => recorder.event(at, "capture", "capture-damaged", &damage.to_string()),
    }
}

/// Says what does not go together, before anything begins.
pub(super) fn warn(remarks: &[String], console: &mut Console<'_>) {
    remarks.iter().for_each(|remark| console.say(&format!("warning: {remark}\n")));
}

/// Prints what came of it, and what is missing in it.
pub(super) fn tell(
    outcome: &Outcome,
    cell: &Cell,
    json: Option<&Path>,
    console: &mut Console<'_>,
) -> Result<Exit, Error> {
    if let Some(path) = json {
        console.save(path, &format!("{:#}\n", answer(outcome)))?;
    }
    if json != Some(Path::new("-")) {
        console.print(&text(outcome));
    }
    if outcome.summary.biases > 0 {
        let what = "warning: the sensor's zero was moved while it was recorded";
        let count = outcome.summary.biases;
        console.say(&format!("{what}, {count} × (ft-bias-…): forces before and after differ by a constant\n"));
    }
    let shortfalls = shortfalls(outcome, cell);
    shortfalls.iter().for_each(|(_, error)| console.error(error));
    Ok(shortfalls.iter().map(|(exit, _)| *exit).find(|exit| *exit != Exit::Pass).unwrap_or(Exit::Pass))
}

fn text(outcome: &Outcome) -> String {
    let summary = &outcome.summary;
    let file = outcome.file.as_ref().map_or_else(|| "nothing kept".to_owned(), |file| file.display().to_string());
    let mut text = format!("{file}: {:.3} s\n", summary.duration_s);
    let names = summary.robots.iter().map(|robot| robot.0.as_str()).chain(["ft"]);
    for ((name, frames, replies, delay), lines) in summary.robots.iter().zip(&summary.lines) {
        let late = delay.map_or_else(|| "not sent".to_owned(), |delay| delay.to_string());
        let sessions = if lines.len() > 1 { format!(", {} RSI sessions", lines.len()) } else { String::new() };
        text += &format!("  {name}: {frames} frames, {replies} replies, Delay D {late}{sessions}\n");
    }
    let unmeasured = match summary.unmeasured {
        0 => String::new(),
        count => format!(", {count} of them clipped or invalid by their status: kept raw, and not as forces"),
    };
    text += &format!("  ft: {} samples{unmeasured}\n", summary.samples);
    text += &format!("  relative poses: {} commanded, {} measured\n", summary.poses[0], summary.poses[1]);
    for (name, lines) in names.zip(&summary.lines) {
        text += &clock(name, &lines.iter().flatten().collect::<Vec<_>>());
    }
    for (name, spread) in &outcome.latencies {
        let Spread { count, least_us, mean_us, median_us, p99_us, most_us } = spread;
        text += &format!(
            "  latency {name}: least {least_us:.0} µs, mean {mean_us:.0} µs, median {median_us:.0} µs, 99 % {p99_us:.0} µs, \
             most {most_us:.0} µs, {count} packets\n"
        );
    }
    for ((source, class), count) in &summary.events {
        text += &format!("  {count} × {class} ({source})\n");
    }
    if let Some(damage) = outcome.tapped.as_ref().and_then(|tapped| tapped.damage.as_ref()) {
        text += &format!("  the capture ends early: {damage}\n");
    }
    text
}

/// The clock of a device in a line, however many sessions it had.
fn clock(name: &str, lines: &[&ClockLine]) -> String {
    let ms = |line: &ClockLine| line.mean_above_ns * 1e-6;
    match lines {
        [] => String::new(),
        [line] => {
            let (drift, above_ms) = (line.drift_ppm, ms(line));
            format!("  clock of {name}: drift {drift:.1} ppm, mean delay {above_ms:.3} ms above the least\n")
        }
        lines => {
            let most = lines.iter().map(|line| ms(line)).fold(0.0, f64::max);
            let samples: Vec<u64> = lines.iter().map(|line| line.samples).collect();
            let (least, longest) = (samples.iter().min().unwrap_or(&0), samples.iter().max().unwrap_or(&0));
            format!(
                "  clock of {name}: it began {} times, after {least} to {longest} samples; mean delay at most {most:.3} ms above \
                 the least\n",
                lines.len()
            )
        }
    }
}

fn answer(outcome: &Outcome) -> serde_json::Value {
    let summary = &outcome.summary;
    let robot = |(name, frames, replies, delay): &(String, u64, u64, Option<i64>)| json!({ "name": name, "frames": frames, "replies": replies, "delay_d": delay });
    let robots: Vec<_> = summary.robots.iter().map(robot).collect();
    let events = summary
        .events
        .iter()
        .map(|((source, class), count)| json!({ "source": source, "class": class, "count": count }));
    let names = summary.robots.iter().map(|robot| robot.0.as_str()).chain(["ft"]);
    let clocks = names.zip(&summary.lines).flat_map(|(name, lines)| {
        lines.iter().enumerate().map(move |(nth, line)| json!({ "device": name, "session": nth + 1, "line": line }))
    });
    let rates = summary.rates.iter().map(|(name, rate)| json!({ "device": name, "rate": rate }));
    let capture = outcome.tapped.as_ref().map(|tapped| {
        let skipped: BTreeMap<_, _> = tapped.tally.skipped.iter().map(|(why, count)| (why.id(), count)).collect();
        let damage = tapped.damage.as_ref().map(ToString::to_string);
        json!({ "frames": tapped.tally.frames, "matched": tapped.matched.total(), "skipped": skipped, "ends_early": damage })
    });
    let latency = outcome.latencies.iter().map(|(name, spread)| json!({ "way": name, "spread": spread }));
    json!({
        "file": outcome.file.as_ref().map(|file| file.display().to_string()), "duration_s": summary.duration_s,
        "robots": robots, "ft_samples": summary.samples, "ft_unmeasured": summary.unmeasured, "biases": summary.biases, "commanded": summary.poses[0], "measured": summary.poses[1],
        "clocks": clocks.collect::<Vec<_>>(), "clock_rates": rates.collect::<Vec<_>>(),
        "events": events.collect::<Vec<_>>(), "latency": latency.collect::<Vec<_>>(), "capture": capture,
    })
}
