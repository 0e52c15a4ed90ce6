//! The strict reader: every checksum that a file carries is checked before a message is handed on.
//!
//! The configuration is the one that detected every one of 19 033 single flipped bits in files with all checksums
//! (zstd, lz4 and uncompressed); every option of it is off by default in the crate. What the library does with hostile
//! lengths (it may panic) is caught and counts as damage.

use std::io::{BufReader, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::dispatch::{Dispatch, Sink, Tally, Trouble};
use super::outline::{self, Outline};
use crate::error::Error;

/// Longest record, and longest decoded chunk, in bytes: 16 times the usual chunk of 1 MiB. Without a limit a flipped bit
/// in a length makes the library ask for more memory than there is. Chosen.
pub const RECORD_LENGTH_MAX: usize = 16 << 20;

/// Bytes that are asked of the file at once. Chosen.
const READ_LENGTH: usize = 64 << 10;

/// What is read from: a file, or bytes in memory.
pub(super) trait Source: Read + Seek {}
impl<T: Read + Seek> Source for T {}

/// Takes an opcode and a body.
pub(super) type Each<'a> = dyn FnMut(u8, &[u8]) -> Result<(), Trouble> + 'a;

/// Every check on.
pub(super) fn strict() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_validate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_record_length_limit(RECORD_LENGTH_MAX)
}

/// Calls into the library; a panic there is a message, not an end.
pub(super) fn guarded<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(call)).map_err(|_| "the mcap library gave up on these bytes".to_owned())
}

/// Feeds the source to a reader with these options and hands on each record.
pub(super) fn pump(source: &mut dyn Read, options: LinearReaderOptions, each: &mut Each<'_>) -> Result<(), Trouble> {
    let mut source = BufReader::with_capacity(READ_LENGTH, source);
    let mut reader = LinearReader::new_with_options(options);
    loop {
        let borrowed = &mut reader;
        let event = guarded(move || borrowed.next_event()).map_err(Trouble::Damage)?;
        let Some(event) = event else { return Ok(()) };
        match event.map_err(|error| Trouble::Damage(describe(&error)))? {
            LinearReadEvent::Record { data, opcode } => each(opcode, data)?,
            LinearReadEvent::ReadRequest(wanted) => {
                let wanted = wanted.clamp(1, READ_LENGTH);
                let read = guarded(|| source.read(reader.insert(wanted))).map_err(Trouble::Damage)?;
                let read = read.map_err(|error| Trouble::Content(Error::new(format!("reading failed: {error}"))))?;
                reader.notify_read(read);
            }
        }
    }
}

fn describe(error: &mcap::McapError) -> String {
    use mcap::McapError as E;
    let wrong = |what: &str, saved: &u32, calculated: &u32| {
        format!("the checksum of {what} is wrong (stored {saved:08x}, computed {calculated:08x})")
    };
    match error {
        E::BadChunkCrc { saved, calculated } => wrong("a chunk", saved, calculated),
        E::BadDataCrc { saved, calculated } => wrong("the data section", saved, calculated),
        E::BadSummaryCrc { saved, calculated } => wrong("the summary", saved, calculated),
        E::BadAttachmentCrc { saved, calculated } => wrong("an attachment", saved, calculated),
        E::RecordTooLarge { len, .. } | E::ChunkTooLarge(len) => {
            format!("a length of {len} bytes exceeds the limit of {RECORD_LENGTH_MAX} bytes")
        }
        other => {
            let text = other.to_string();
            let mut letters = text.chars();
            letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
        }
    }
}

/// Reads every record strictly, compares the counts with the summary, and says which checksums were there.
pub(super) fn read_strict(source: &mut dyn Source, dispatch: &mut Dispatch<'_>) -> Result<Outline, Trouble> {
    let io = |error: std::io::Error| Trouble::Content(Error::new(format!("reading failed: {error}")));
    source.seek(SeekFrom::Start(0)).map_err(io)?;
    pump(&mut &mut *source, strict(), &mut |opcode, body| dispatch.record(opcode, body))?;
    dispatch.agree()?;
    outline::trace(source).map_err(io)
}

/// Reads every message of an MCAP file with full validation, whatever its topics and encodings are.
///
/// # Errors
/// When a checksum is wrong, the file is cut off, or the sink refuses a message. Nothing is repaired.
pub fn read_records<S: Read + Seek>(name: &Path, source: &mut S, sink: &mut dyn Sink) -> Result<Tally, Error> {
    let mut dispatch = Dispatch::new(sink);
    match read_strict(source, &mut dispatch) {
        Ok(_) => Ok(dispatch.tally),
        Err(Trouble::Content(error)) => Err(error.file(name)),
        Err(Trouble::Damage(what)) => {
            Err(Error::new(what).file(name).help("check the copy; compare its size and SHA-256"))
        }
    }
}
