//! Where a file that the strict reader refused is sound, where it is damaged, and where it ends.
//!
//! Cut off and damaged are told apart by the ends: a file that stops inside a record, with nothing verifiable after that
//! point and no end marker, was cut off; everything else that does not fit is damage. A file can be both. After damage
//! the walk goes on at the length that the damaged record states if a record stands there, and otherwise at the next
//! chunk whose checksum is right.

use std::io::{self, Read, SeekFrom};

use mcap::records::op;

use super::dispatch::Trouble;
use super::outline::{CHUNK_PREFIX_LENGTH, HEADER_LENGTH, header};
use super::records::{Each, RECORD_LENGTH_MAX, Source, guarded, pump, strict};

/// Bytes searched at once for the next sound chunk. Chosen.
const WINDOW_LENGTH: usize = 64 << 10;
/// Bytes of a chunk's start that are compared: its headers and the longest name of a compression.
const CANDIDATE_LENGTH: usize = 64;

/// A record that is as it was written, as far as that can be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Piece {
    pub at: u64,
    pub length: u64,
    pub opcode: u8,
}

/// A place that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Damage {
    pub at: u64,
    pub what: String,
}

/// The state of a file.
#[derive(Debug, Default)]
pub(super) struct Survey {
    pub pieces: Vec<Piece>,
    pub damages: Vec<Damage>,
    /// First byte of the record that is cut off.
    pub cut_at: Option<u64>,
    /// Length of the file.
    pub length: u64,
}

/// What to do after one record.
enum Step {
    On(u64),
    End,
}

pub(super) fn survey(source: &mut dyn Source) -> io::Result<Survey> {
    let length = source.seek(SeekFrom::End(0))?;
    let mut survey = Survey { length, ..Survey::default() };
    let ends_in_marker = ends_in_marker(source, length)?;
    let mut start = [0; 8];
    source.seek(SeekFrom::Start(0))?;
    source.read_exact(&mut start)?;
    if start != *mcap::MAGIC {
        survey.damages.push(Damage { at: 0, what: "the start marker is wrong".to_owned() });
    }
    let mut at = mcap::MAGIC.len() as u64;
    while let Step::On(next) = step(source, &mut survey, at, ends_in_marker)? {
        at = next;
    }
    Ok(survey)
}

fn ends_in_marker(source: &mut dyn Source, length: u64) -> io::Result<bool> {
    let marker = mcap::MAGIC.len() as u64;
    if length < 2 * marker {
        return Ok(false);
    }
    let mut end = [0; 8];
    source.seek(SeekFrom::Start(length - marker))?;
    source.read_exact(&mut end)?;
    Ok(end == *mcap::MAGIC)
}

fn step(source: &mut dyn Source, survey: &mut Survey, at: u64, ends_in_marker: bool) -> io::Result<Step> {
    let rest = survey.length - at;
    if rest < HEADER_LENGTH {
        if ends_in_marker {
            return Ok(damaged(survey, at, "the footer is missing".to_owned(), None));
        }
        survey.cut_at = Some(at);
        return Ok(Step::End);
    }
    let (opcode, body) = header(source, at)?;
    let known = (op::HEADER..=op::DATA_END).contains(&opcode) || opcode >= 0x80;
    let end = at.saturating_add(HEADER_LENGTH).saturating_add(body);
    if end > survey.length {
        let lost = resync(source, survey.length, at + 1)?;
        if known && lost.is_none() && !ends_in_marker {
            survey.cut_at = Some(at);
            return Ok(Step::End);
        }
        return Ok(damaged(survey, at, "a record runs past the end of the file".to_owned(), lost));
    }
    if opcode == op::FOOTER {
        return footer(source, survey, at, end);
    }
    let fault =
        if known { verify(source, at, opcode, end - at)? } else { Some(format!("unknown opcode {opcode:#04x}")) };
    let Some(what) = fault else {
        survey.pieces.push(Piece { at, length: end - at, opcode });
        return Ok(Step::On(end));
    };
    let next = if known && plausible(source, survey.length, end)? {
        Some(end)
    } else {
        resync(source, survey.length, at + 1)?
    };
    Ok(damaged(survey, at, what, next))
}

fn damaged(survey: &mut Survey, at: u64, what: String, next: Option<u64>) -> Step {
    survey.damages.push(Damage { at, what });
    next.map_or(Step::End, Step::On)
}

fn footer(source: &mut dyn Source, survey: &mut Survey, at: u64, end: u64) -> io::Result<Step> {
    let mut marker = Vec::new();
    source.seek(SeekFrom::Start(end))?;
    source.take(mcap::MAGIC.len() as u64).read_to_end(&mut marker)?;
    if marker.len() < mcap::MAGIC.len() && mcap::MAGIC.starts_with(&marker) {
        survey.cut_at = Some(at);
    } else if marker != mcap::MAGIC {
        survey.damages.push(Damage { at: end, what: "the end marker is wrong".to_owned() });
    }
    Ok(Step::End)
}

/// Says what is wrong with a record that lies within the file.
fn verify(source: &mut dyn Source, at: u64, opcode: u8, length: u64) -> io::Result<Option<String>> {
    if opcode == op::CHUNK {
        return verify_chunk(source, at, length);
    }
    if length > RECORD_LENGTH_MAX as u64 {
        return Ok(Some(format!("a length of {length} bytes exceeds the limit of {RECORD_LENGTH_MAX} bytes")));
    }
    let mut record = Vec::new();
    source.seek(SeekFrom::Start(at))?;
    source.take(length).read_to_end(&mut record)?;
    let body = record.get(HEADER_LENGTH as usize..).unwrap_or_default();
    Ok(match guarded(|| mcap::parse_record(opcode, body).map(|_| ())) {
        Ok(Ok(())) => None,
        Ok(Err(error)) => Some(format!("record {opcode:#04x}: {error}")),
        Err(what) => Some(what),
    })
}

fn verify_chunk(source: &mut dyn Source, at: u64, length: u64) -> io::Result<Option<String>> {
    Ok(match pump_piece(source, Piece { at, length, opcode: op::CHUNK }, true, &mut |_, _| Ok(()))? {
        Ok(()) => None,
        Err(Trouble::Damage(what)) => Some(what),
        Err(Trouble::Content(error)) => Some(error.what),
    })
}

/// Reads one record, or a chunk's records, from its place. Not strict: hands on what comes before the end of the bytes.
pub(super) fn pump_piece(
    source: &mut dyn Source,
    piece: Piece,
    is_strict: bool,
    each: &mut Each<'_>,
) -> io::Result<Result<(), Trouble>> {
    source.seek(SeekFrom::Start(piece.at))?;
    let mut options =
        strict().with_skip_start_magic(true).with_skip_end_magic(true).with_validate_data_section_crc(false);
    if !is_strict {
        options = options.with_prevalidate_chunk_crcs(false).with_validate_chunk_crcs(false);
    }
    Ok(pump(&mut source.take(piece.length), options, each))
}

/// Whether a record of a known kind stands at `at` and ends within the file.
fn plausible(source: &mut dyn Source, file_length: u64, at: u64) -> io::Result<bool> {
    if at + HEADER_LENGTH > file_length {
        return Ok(at == file_length);
    }
    let (opcode, body) = header(source, at)?;
    let end = at.saturating_add(HEADER_LENGTH).saturating_add(body);
    Ok((op::HEADER..=op::DATA_END).contains(&opcode) && end <= file_length)
}

/// The next chunk whose checksum is right, or the end of the data section, at or after `from`.
fn resync(source: &mut dyn Source, file_length: u64, from: u64) -> io::Result<Option<u64>> {
    let mut window = Vec::with_capacity(WINDOW_LENGTH + CANDIDATE_LENGTH);
    let mut base = from;
    while base + HEADER_LENGTH < file_length {
        window.clear();
        source.seek(SeekFrom::Start(base))?;
        source.take((WINDOW_LENGTH + CANDIDATE_LENGTH) as u64).read_to_end(&mut window)?;
        for offset in 0..window.len().min(WINDOW_LENGTH) {
            let at = base + offset as u64;
            if is_sound(source, file_length, at, &window[offset..])? {
                return Ok(Some(at));
            }
        }
        base += WINDOW_LENGTH as u64;
    }
    Ok(None)
}

fn is_sound(source: &mut dyn Source, file_length: u64, at: u64, bytes: &[u8]) -> io::Result<bool> {
    let Some(([opcode, length @ ..], body)) = bytes.split_first_chunk::<9>() else { return Ok(false) };
    let length = u64::from_le_bytes(*length);
    if at.saturating_add(HEADER_LENGTH).saturating_add(length) > file_length {
        return Ok(false);
    }
    match *opcode {
        op::CHUNK => {
            let Some((prefix, rest)) = body.split_first_chunk::<{ CHUNK_PREFIX_LENGTH as usize }>() else {
                return Ok(false);
            };
            let has_checksum = prefix[24..28] != [0; 4];
            let name = usize::from(prefix[28]);
            let is_known = prefix[29..32] == [0; 3]
                && (name == 0 || rest.starts_with(b"zstd") && name == 4 || rest.starts_with(b"lz4") && name == 3);
            Ok(has_checksum && is_known && verify_chunk(source, at, HEADER_LENGTH + length)?.is_none())
        }
        op::DATA_END => Ok(length == 4 && plausible(source, file_length, at + HEADER_LENGTH + length)?),
        _ => Ok(false),
    }
}
