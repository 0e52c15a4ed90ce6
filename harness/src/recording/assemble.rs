//! From streams to a session: checks that nothing required is missing, puts the streams in order, judges them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::collect::{Collector, Stream, TopicSeen};
use super::map::{CsvMap, Map, Role};
use super::map_check::roles;
use super::messages;
use super::quality::{self, Report, tidy};
use super::session::{Grade, Kind, Pose, Series, Session, Severity};
use super::stale;
use crate::error::Error;

/// Where the samples came from.
pub(super) struct Origin {
    pub file: PathBuf,
    pub sha256: String,
}

pub(super) fn assemble(origin: Origin, mut collector: Collector<'_>, mut report: Report) -> Result<Session, Error> {
    let map = collector.map;
    let names = names(map);
    present(map, &names, &collector).map_err(|error| error.file(&origin.file))?;
    encodings(map, &collector, &mut report);
    let believed = believed(map, std::mem::take(&mut collector.believed));
    let start_ns =
        first_ns(&collector).ok_or_else(|| Error::new("holds no sample").file(&origin.file).help("record it again"))?;
    let name = |role: Role| names.get(&role).map_or("", String::as_str);
    let commanded = tidy(name(Role::Commanded), collector.commanded, start_ns, &mut report);
    let measured = tidy(name(Role::Measured), collector.measured, start_ns, &mut report);
    let twist = tidy(name(Role::Twist), collector.twist, start_ns, &mut report);
    let sensed = tidy(name(Role::Sensed), collector.sensed, start_ns, &mut report);
    let applied = tidy(name(Role::Applied), collector.applied, start_ns, &mut report);
    if let Some(series) = &sensed {
        stale::sensed(name(Role::Sensed), series, &mut report);
    }
    if let Some(series) = &measured {
        stale::measured(name(Role::Measured), series, commanded.as_ref(), &mut report);
    }
    let spans = [
        span(name(Role::Commanded), commanded.as_ref()),
        span(name(Role::Measured), measured.as_ref()),
        span(name(Role::Twist), twist.as_ref()),
        span(name(Role::Sensed), sensed.as_ref()),
        span(name(Role::Applied), applied.as_ref()),
    ];
    quality::overlap(&spans.into_iter().flatten().collect::<Vec<_>>(), &mut report);
    let guess = guess(twist.is_some(), sensed.is_none(), commanded.as_ref());
    let kind = kind(map, &believed, guess, &mut report).map_err(|error| error.file(&origin.file))?;
    let mut findings = report.findings;
    findings.sort_by(|a, b| (&a.topic, a.at_ns).cmp(&(&b.topic, b.at_ns)));
    let Origin { file, sha256 } = origin;
    let grade = report.grade;
    Ok(Session { file, sha256, start_ns, kind, believed, commanded, measured, twist, sensed, applied, grade, findings })
}

/// The name under which a role is reported: a topic, or a column.
fn names(map: &Map) -> BTreeMap<Role, String> {
    match &map.csv {
        None => roles(map).into_iter().map(|(role, topic)| (role, topic.to_owned())).collect(),
        Some(table) => columns(table).into_iter().filter_map(|(role, name)| Some((role, name.clone()?))).collect(),
    }
}

fn columns(table: &CsvMap) -> [(Role, &Option<String>); 4] {
    [
        (Role::Commanded, &table.commanded),
        (Role::Measured, &table.measured),
        (Role::Sensed, &table.sensed),
        (Role::Applied, &table.applied),
    ]
}

/// Every mapped role that is not optional has samples.
fn present(map: &Map, names: &BTreeMap<Role, String>, collector: &Collector<'_>) -> Result<(), Error> {
    let samples = |role: Role| match role {
        Role::Commanded => collector.commanded.value.len(),
        Role::Measured => collector.measured.value.len(),
        Role::Twist => collector.twist.value.len(),
        Role::Sensed => collector.sensed.value.len(),
        Role::Applied => collector.applied.value.len(),
    };
    let absent: Vec<(Role, &str)> = names
        .iter()
        .filter(|(role, _)| samples(**role) == 0 && !map.optional.contains(role))
        .map(|(role, name)| (*role, name.as_str()))
        .collect();
    match absent.first() {
        None => Ok(()),
        Some((_, name)) if map.csv.is_some() => Err(Error::new(format!("column `{name}` has no sample"))
            .help("the table needs lines of numbers below the names")),
        Some(_) => Err(missing(&absent, collector)),
    }
}

fn missing(absent: &[(Role, &str)], collector: &Collector<'_>) -> Error {
    let seen = &collector.topics;
    let lines: Vec<String> = absent
        .iter()
        .map(|(role, topic)| {
            let fault = if seen.contains_key(*topic) { "has no message" } else { "is missing" };
            format!("topic {topic} ({}, {}) {fault}", role.id(), type_of(*role))
        })
        .collect();
    let there: Vec<String> =
        seen.iter().map(|(name, seen)| format!("{name} ({}, {} messages)", seen.type_name, seen.messages)).collect();
    let there = if there.is_empty() { "no topic".to_owned() } else { there.join(", ") };
    let known: Vec<&str> = roles(collector.map).into_iter().map(|(_, topic)| topic).collect();
    let hints: Vec<String> = absent
        .iter()
        .map(|(role, _)| {
            let fits = |(name, seen): &(&String, &TopicSeen)| {
                messages::is_type(&seen.type_name, type_of(*role))
                    && seen.messages > 0
                    && !known.contains(&name.as_str())
            };
            let instead = seen.iter().find(fits).map_or("/the/right/topic", |(name, _)| name.as_str());
            format!("{} = \"{instead}\"", role.id())
        })
        .collect();
    Error::new(format!("{}; the recording has {there}", lines.join(", "))).help(format!(
        "record it, or name the topics that stand for it in the map given with --map: [topics] {}",
        hints.join(", ")
    ))
}

const fn type_of(role: Role) -> &'static str {
    match role {
        Role::Commanded | Role::Measured => messages::POSE,
        Role::Twist => messages::TWIST,
        Role::Sensed | Role::Applied => messages::WRENCH,
    }
}

/// Reports topics whose encoding is not known.
fn encodings(map: &Map, collector: &Collector<'_>, report: &mut Report) {
    let mapped = roles(map);
    for (topic, seen) in &collector.topics {
        let is_mapped = mapped.iter().any(|(_, name)| name == topic);
        if !is_mapped && seen.message_encoding != "cdr" {
            let what = format!("{} messages are encoded as `{}`", seen.messages, seen.message_encoding);
            report.add(Severity::Note, topic, None, what, "not read; no role is mapped to this topic");
        }
        if is_mapped && !matches!(seen.schema_encoding.as_str(), "ros2msg" | "ros2idl") {
            let what = format!("the schema is encoded as `{}`, known are ros2msg and ros2idl", seen.schema_encoding);
            report.add(
                Severity::Warning,
                topic,
                None,
                what,
                "the layout of the messages is taken from the name of their type",
            );
        }
    }
}

/// What the recording says, and the map where it is silent.
fn believed(map: &Map, mut record: BTreeMap<String, String>) -> BTreeMap<String, String> {
    for (key, value) in &map.believed {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        record.entry(key.clone()).or_insert(text);
    }
    record
}

fn kind(map: &Map, believed: &BTreeMap<String, String>, guess: Kind, report: &mut Report) -> Result<Kind, Error> {
    if let Some(kind) = map.kind {
        return Ok(kind);
    }
    let known = Kind::ALL.map(Kind::id).join(", ");
    let place = "metadata record `session`";
    let help = format!("say it in the map given with --map: kind = \"{}\"", guess.id());
    match believed.get("kind") {
        Some(text) => Kind::ALL
            .into_iter()
            .find(|kind| kind.id() == text)
            .ok_or_else(|| Error::new(format!("kind is `{text}`, expected one of {known}")).place(place).help(help)),
        None if matches!(report.grade, Grade::B | Grade::C) => {
            let what = format!("the metadata record `session` is lost; the kind is taken to be {}", guess.id());
            report.add(
                Severity::Defect,
                "",
                None,
                what,
                "what the operator believes is unknown; give it in the map: kind and [believed]",
            );
            Ok(guess)
        }
        None => {
            Err(Error::new(format!("nothing says what was recorded, expected one of {known}")).place(place).help(help))
        }
    }
}

/// What the topics suggest, for a file whose session record is lost.
fn guess(has_twist: bool, lacks_sensed: bool, commanded: Option<&Series<Pose>>) -> Kind {
    let moves = commanded.is_some_and(|series| series.value.windows(2).any(|pair| pair[0] != pair[1]));
    match (has_twist, lacks_sensed, moves) {
        (true, ..) => Kind::Impact,
        (_, true, _) => Kind::Drive,
        (_, _, true) => Kind::FreeFlight,
        _ => Kind::Static,
    }
}

fn least<T>(stream: &Stream<T>) -> Option<i64> {
    stream.time_ns.iter().copied().min()
}

fn first_ns(collector: &Collector<'_>) -> Option<i64> {
    let firsts = [
        least(&collector.commanded),
        least(&collector.measured),
        least(&collector.twist),
        least(&collector.sensed),
        least(&collector.applied),
    ];
    firsts.into_iter().flatten().min()
}

fn span<'a, T>(name: &'a str, series: Option<&Series<T>>) -> Option<(&'a str, i64, i64)> {
    let times = &series?.time_ns;
    Some((name, *times.first()?, *times.last()?))
}

impl Collector<'_> {
    /// Time from the first to the last sample of a mapped topic.
    pub fn span_s(&self, topic: &str) -> Option<f64> {
        let (role, _) = roles(self.map).into_iter().find(|(_, name)| *name == topic)?;
        let times = match role {
            Role::Commanded => &self.commanded.time_ns,
            Role::Measured => &self.measured.time_ns,
            Role::Twist => &self.twist.time_ns,
            Role::Sensed => &self.sensed.time_ns,
            Role::Applied => &self.applied.time_ns,
        };
        Some((times.iter().max()? - times.iter().min()?) as f64 * 1e-9)
    }
}
