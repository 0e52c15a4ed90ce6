//! From a file to a session: which kind of file it is, whether its bytes are sound, and what follows if not.

use std::fs::File;
use std::io::{Cursor, Read, SeekFrom};
use std::path::Path;

use sha2::{Digest, Sha256};

use super::assemble::{Origin, assemble};
use super::collect::Collector;
use super::csv;
use super::dispatch::{Dispatch, Trouble};
use super::map::Map;
use super::outline::Outline;
use super::quality::Report;
use super::records::{Source, read_strict};
use super::salvage;
use super::session::{Grade, Session, Severity};
use super::survey::{Damage, Survey, survey};
use crate::error::Error;

/// Bytes of the start marker that may be wrong while the file still counts as a damaged recording.
const MARKER_DAMAGE_MAX: usize = 2;
/// Single damages listed; the rest is counted. Chosen.
const DAMAGES_LISTED_MAX: usize = 20;

const REPAIR_HELP: &str = "copy the file again and compare its SHA-256, or read the sound parts with --salvage (every verdict then carries grade C)";

/// How to read.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// Topics and conventions.
    pub map: Map,
    /// Whether to read the sound parts of a damaged file.
    pub salvage: bool,
}

/// Reads a recording.
///
/// # Errors
/// When the file cannot be opened, is no recording, is damaged and salvage is not asked for, or does not hold what the
/// map asks for. The error names the place and what to do.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Session, Error> {
    let failed = |error: std::io::Error| {
        let help = match error.kind() {
            std::io::ErrorKind::NotFound => "check the path; a recording is one .mcap or .csv file",
            std::io::ErrorKind::PermissionDenied => "check the permissions of the file",
            _ => "check the disk and try again",
        };
        let what = match error.kind() {
            std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
            _ => format!("cannot be read: {error}"),
        };
        Error::new(what).file(path).help(help)
    };
    if std::fs::metadata(path).map_err(failed)?.is_dir() {
        let help = format!("name one file in it; `ls {}` lists them", path.display());
        return Err(Error::new("is a folder, expected one .mcap or .csv file").file(path).help(help));
    }
    ingest(path, &mut File::open(path).map_err(failed)?, options)
}

/// Reads a recording that is in memory; `name` stands for the file.
///
/// # Errors
/// As [`read`].
pub fn from_bytes(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<Session, Error> {
    ingest(Path::new(name), &mut Cursor::new(bytes), options)
}

fn ingest(name: &Path, source: &mut dyn Source, options: &ReadOptions) -> Result<Session, Error> {
    let io = |error: std::io::Error| {
        Error::new(format!("reading failed: {error}")).file(name).help("check the disk and try again")
    };
    let sha256 = hash(source).map_err(io)?;
    let mut head = Vec::new();
    source.seek(SeekFrom::Start(0)).map_err(io)?;
    Read::take(&mut *source, 32).read_to_end(&mut head).map_err(io)?;
    if head.is_empty() {
        return Err(Error::new("is empty (0 bytes)")
            .file(name)
            .help("the recorder wrote nothing, or the copy failed: copy it again"));
    }
    let origin = Origin { file: name.to_owned(), sha256 };
    let wrong = mcap::MAGIC.iter().zip(head.iter().chain(std::iter::repeat(&0))).filter(|(a, b)| a != b).count();
    if wrong == 0 {
        return read_mcap(origin, source, options);
    }
    let is_csv = name.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    if is_csv {
        return read_csv(origin, source, options);
    }
    if wrong <= MARKER_DAMAGE_MAX {
        return read_damaged(origin, source, options, "the start marker is wrong");
    }
    Err(not_a_recording(&head).file(name))
}

fn not_a_recording(head: &[u8]) -> Error {
    if mcap::MAGIC.starts_with(head) {
        return Error::new(format!("is cut off at byte {}, inside the start marker", head.len()))
            .help("copy the file again");
    }
    let (what, help) = if head.starts_with(b"#ROSBAG") {
        ("is a bag of ROS 1", "convert it: `rosbags-convert --src in.bag --dst out --dst-storage mcap`")
    } else if head.starts_with(b"SQLite format 3") {
        ("is a database of rosbag2 (storage sqlite3)", "convert it: `ros2 bag convert` with storage_id: mcap")
    } else if head.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        ("is compressed as a whole with zstd", "unpack it: `unzstd FILE`")
    } else if head.starts_with(&[0x1f, 0x8b]) {
        ("is compressed as a whole with gzip", "unpack it: `gunzip FILE`")
    } else {
        ("is no mcap recording", "name a recording; a table of numbers must end in .csv and needs [csv] in the map")
    };
    let begins: String = String::from_utf8_lossy(head).chars().take(16).flat_map(char::escape_debug).collect();
    Error::new(format!("{what}: it begins with `{begins}`, expected the mcap marker 89 4d 43 41 50"))
        .place("byte 0")
        .help(help)
}

fn hash(source: &mut dyn Source) -> std::io::Result<String> {
    let mut hasher = Sha256::new();
    let mut block = vec![0; 1 << 16];
    source.seek(SeekFrom::Start(0))?;
    loop {
        let read = source.read(&mut block)?;
        if read == 0 {
            return Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect());
        }
        hasher.update(&block[..read]);
    }
}

fn read_csv(origin: Origin, source: &mut dyn Source, options: &ReadOptions) -> Result<Session, Error> {
    let Some(table) = &options.map.csv else {
        let help =
            "say which column is what: `--map emps.toml` with a table [csv]; fixtures/maps/emps.toml is an example";
        return Err(Error::new("is a table, and the map has no [csv]").file(origin.file).help(help));
    };
    let mut collector = Collector::new(&options.map);
    let read = source.seek(SeekFrom::Start(0)).map_err(|error| Error::new(format!("reading failed: {error}")));
    read.and_then(|_| csv::read(&origin.file, source, table, &mut collector))
        .map_err(|error| error.file(&origin.file))?;
    let mut report = Report::default();
    let what = "a table carries no checksum".to_owned();
    report.add(
        Severity::Note,
        "",
        None,
        what,
        "a changed digit would not be noticed; the SHA-256 stands in the report",
    );
    assemble(origin, collector, report)
}

fn read_mcap(origin: Origin, source: &mut dyn Source, options: &ReadOptions) -> Result<Session, Error> {
    let mut collector = Collector::new(&options.map);
    let outcome = read_strict(source, &mut Dispatch::new(&mut collector));
    match outcome {
        Ok(outline) => {
            let mut report = Report::default();
            uncovered(&outline, &mut report);
            assemble(origin, collector, report)
        }
        Err(Trouble::Content(error)) => Err(error.file(origin.file)),
        Err(Trouble::Damage(what)) => {
            drop(collector);
            read_damaged(origin, source, options, &what)
        }
    }
}

/// Notes which parts no checksum protects.
fn uncovered(outline: &Outline, report: &mut Report) {
    if outline.chunks_without_checksum > 0 {
        let what = format!("{} of {} chunks carry no checksum", outline.chunks_without_checksum, outline.chunks);
        report.add(Severity::Note, "", None, what, "a flipped bit in a message would not be noticed");
    }
    if !outline.data_checksum {
        let metadata: Vec<String> =
            outline.metadata.iter().map(|(at, length)| format!("bytes {at} to {}", at + length - 1)).collect();
        if !metadata.is_empty() {
            let what = format!(
                "the data section carries no checksum, so none protects the metadata ({})",
                metadata.join(", ")
            );
            report.add(
                Severity::Note,
                "",
                None,
                what,
                "a changed digit of what the operator believes would not be noticed",
            );
        }
        if outline.loose_messages > 0 {
            let what = format!("{} messages lie outside chunks and carry no checksum", outline.loose_messages);
            report.add(Severity::Note, "", None, what, "a flipped bit in a message would not be noticed");
        }
    }
    if outline.trailing > 0 {
        let what = format!("{} bytes follow the end of the recording", outline.trailing);
        report.add(Severity::Warning, "", None, what, "they are ignored; a second recording may have been appended");
    }
}

fn read_damaged(
    origin: Origin,
    source: &mut dyn Source,
    options: &ReadOptions,
    reason: &str,
) -> Result<Session, Error> {
    let io = |error: std::io::Error| {
        Error::new(format!("reading failed: {error}")).file(&origin.file).help("check the disk and try again")
    };
    let found = survey(source).map_err(io)?;
    let is_cut_only = found.damages.is_empty() && found.cut_at.is_some();
    if !is_cut_only && !options.salvage {
        return Err(refusal(&found, reason).file(&origin.file));
    }
    let mut collector = Collector::new(&options.map);
    let outcome = salvage::collect(source, &found, &mut Dispatch::new(&mut collector)).map_err(io)?;
    let salvaged = match outcome {
        Ok(salvaged) => salvaged,
        Err(Trouble::Content(error)) => return Err(error.file(&origin.file)),
        Err(Trouble::Damage(what)) => return Err(Error::new(what).file(&origin.file).help(REPAIR_HELP)),
    };
    let mut damages = found.damages.clone();
    damages.extend(salvaged.damages);
    let lost = salvaged.undefined_messages;
    if lost > 0 {
        let what = format!("{lost} sound messages are dropped: the chunk that defines their topics is damaged");
        damages.push(Damage { at: damages.first().map_or(0, |damage| damage.at), what });
    }
    if is_cut_only && !damages.is_empty() && !options.salvage {
        let both = Survey { damages, ..found };
        return Err(refusal(&both, reason).file(&origin.file));
    }
    if let (Some(at), true) = (found.cut_at, collector.topics.values().all(|seen| seen.messages == 0) && lost == 0) {
        let what = format!("is cut off at byte {at}, before its first complete message: nothing can be recovered");
        return Err(Error::new(what)
            .file(&origin.file)
            .help("copy the file again from where it was recorded; if it ends there too, the recorder was killed before it wrote \
                   anything, and --salvage has nothing to read: record it again"));
    }
    let mut report = Report::default();
    if let Some(at) = found.cut_at {
        cut(at, &found, salvaged.unverified_messages, &collector, &mut report);
    }
    if !is_cut_only || !damages.is_empty() {
        damaged(&damages, reason, &mut report);
    }
    assemble(origin, collector, report).map_err(|error| {
        let mut what = error.what.clone();
        if lost > 0 {
            what = format!(
                "{what}; {lost} sound messages are of no use, since the chunk that defines their topics is damaged"
            );
        }
        if let Some(at) = found.cut_at {
            what = format!("{what} (the file is cut off at byte {at})");
        }
        Error { what, ..error }
    })
}

fn refusal(found: &Survey, reason: &str) -> Error {
    let first = found.damages.first();
    let mut what = first.map_or_else(|| reason.to_owned(), |damage| damage.what.clone());
    if found.damages.len() > 1 {
        what = format!("{what}; {} places are damaged", found.damages.len());
    }
    if let Some(at) = found.cut_at {
        what = format!("{what}; the file is also cut off at byte {at}");
    }
    let bare = Error::new(what).help(REPAIR_HELP);
    match first {
        Some(damage) => bare.place(format!("byte {}", damage.at)),
        None => bare.place("outside the chunks"),
    }
}

fn cut(at: u64, found: &Survey, unverified: u64, collector: &Collector<'_>, report: &mut Report) {
    let what =
        format!("the file is cut off: it ends at byte {} inside the record that begins at byte {at}", found.length);
    report.add(Severity::Warning, "", None, what, "what came later is lost; verdicts cover the recovered time only");
    if unverified > 0 {
        let what = format!("{unverified} messages come from the chunk that is cut off");
        report.add(Severity::Warning, "", None, what, "the checksum of that chunk cannot be verified");
    }
    for (topic, seen) in &collector.topics {
        let span_s = collector.span_s(topic).map_or_else(String::new, |span_s| format!(" over {span_s:.3} s"));
        report.add(
            Severity::Note,
            topic,
            None,
            format!("{} messages recovered{span_s}", seen.messages),
            "the rest is lost",
        );
    }
    report.lower(Grade::B);
}

fn damaged(damages: &[Damage], reason: &str, report: &mut Report) {
    for damage in damages.iter().take(DAMAGES_LISTED_MAX) {
        let what = format!("byte {}: {}", damage.at, damage.what);
        report.add(
            Severity::Defect,
            "",
            None,
            what,
            "what cannot be verified is dropped; a gap that it leaves is reported with each topic",
        );
    }
    if damages.is_empty() {
        let consequence =
            "all chunks are sound; metadata and indexes may be wrong, so check what the operator believes";
        report.add(Severity::Defect, "", None, reason.to_owned(), consequence);
    } else if damages.len() > DAMAGES_LISTED_MAX {
        let what = format!("{} more places are damaged", damages.len() - DAMAGES_LISTED_MAX);
        report.add(Severity::Defect, "", None, what, "these parts are dropped");
    }
    report.lower(Grade::C);
}
