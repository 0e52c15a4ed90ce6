//! What `record` and `import` tell of a session, and what they share.

use super::console::Console;
use super::outcome::Exit;
use crate::error::Error;
use crate::recorder::{Recorder, Spread, Summary, Tapped};
use crate::recording::Kind;
use serde_json::json;
use sim_core::time::Nanos;
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// What a recording came to.
pub(super) struct Outcome {
    pub summary: Summary,
    pub tapped: Option<Tapped>,
    pub latencies: Vec<(&'static str, Spread)>,
}

/// The kind of a session of a cell.
pub(super) fn kind(text: &str) -> Result<Kind, String> {
    let known = [Kind::Static, Kind::FreeFlight, Kind::Impact];
    let found = known.into_iter().find(|kind| kind.id() == text);
    found.ok_or_else(|| "expected static, free-flight or impact".to_owned())
}

/// A capture.
pub(super) fn open(path: &Path) -> Result<File, Error> {
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

/// Why nothing was recorded.
pub(super) fn nothing(outcome: &Outcome) -> Error {
    let Some(tapped) = &outcome.tapped else {
        return Error::new("no frame of a robot came").help(
            "start RSI on the robot; check IP_NUMBER and PORT in its configuration, and the firewall of this computer",
        );
    };
    if let (Some(damage), 0) = (&tapped.damage, tapped.tally.frames) {
        return Error::new(damage.to_string()).help("give a pcap or pcapng, as Wireshark and tcpdump write them");
    }
    let others: Vec<String> = tapped.others.iter().map(|(to, count)| format!("{count} packets {to}")).collect();
    let others = if others.is_empty() { "no UDP or TCP at all".to_owned() } else { others.join(", ") };
    Error::new(format!("no packet of the capture belongs to the cell; it has {others}"))
        .help("correct `listen` of the robots and `address` of the sensor in the cell")
}

/// Prints what came of it.
pub(super) fn tell(
    outcome: &Outcome,
    json: Option<&Path>,
    file: &Path,
    console: &mut Console<'_>,
) -> Result<Exit, Error> {
    let frames: u64 = outcome.summary.robots.iter().map(|robot| robot.1).sum();
    if let Some(path) = json {
        console.save(path, &format!("{:#}\n", answer(outcome, file)))?;
    }
    if json != Some(Path::new("-")) {
        console.print(&text(outcome, file));
    }
    if frames == 0 {
        console.error(&nothing(outcome).file(file));
        return Ok(Exit::NothingToRun);
    }
    Ok(Exit::Pass)
}

fn text(outcome: &Outcome, file: &Path) -> String {
    let summary = &outcome.summary;
    let mut text = format!("{}: {:.3} s\n", file.display(), summary.duration_s);
    let names = summary.robots.iter().map(|robot| robot.0.as_str()).chain(["ft"]);
    for ((name, frames, replies, delay), lines) in summary.robots.iter().zip(&summary.lines) {
        let late = delay.map_or_else(|| "not sent".to_owned(), |delay| delay.to_string());
        let sessions = if lines.len() > 1 { format!(", {} RSI sessions", lines.len()) } else { String::new() };
        text += &format!("  {name}: {frames} frames, {replies} replies, Delay D {late}{sessions}\n");
    }
    text += &format!("  ft: {} samples\n", summary.samples);
    text += &format!("  relative poses: {} commanded, {} measured\n", summary.poses[0], summary.poses[1]);
    for (name, lines) in names.zip(&summary.lines) {
        for line in lines.iter().flatten() {
            let (drift, above_ms) = (line.drift_ppm, line.mean_above_ns * 1e-6);
            text += &format!("  clock of {name}: drift {drift:.1} ppm, mean delay {above_ms:.3} ms above the least\n");
        }
    }
    for (name, spread) in &outcome.latencies {
        let Spread { count, median_us, p99_us, most_us } = spread;
        text += &format!(
            "  latency {name}: median {median_us:.0} µs, 99 % {p99_us:.0} µs, most {most_us:.0} µs, {count} packets\n"
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

fn answer(outcome: &Outcome, file: &Path) -> serde_json::Value {
    let summary = &outcome.summary;
    let robot = |(name, frames, replies, delay): &(String, u64, u64, Option<i64>)| json!({ "name": name, "frames": frames, "replies": replies, "delay_d": delay });
    let robots: Vec<_> = summary.robots.iter().map(robot).collect();
    let events = summary
        .events
        .iter()
        .map(|((source, class), count)| json!({ "source": source, "class": class, "count": count }));
    json!({
        "file": file.display().to_string(), "duration_s": summary.duration_s, "robots": robots,
        "ft_samples": summary.samples, "commanded": summary.poses[0], "measured": summary.poses[1],
        "clocks": summary.lines, "events": events.collect::<Vec<_>>(),
        "latency": outcome.latencies.iter().map(|(name, spread)| json!({ "way": name, "spread": spread })).collect::<Vec<_>>(),
    })
}
