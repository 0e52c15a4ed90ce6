//! Which records lie where, and which checksums a file carries: a walk over record headers, nothing is decoded.

use std::io::{self, SeekFrom};

use mcap::records::op;

use super::records::Source;

/// Opcode and length.
pub(super) const HEADER_LENGTH: u64 = 9;
/// Start time, end time, uncompressed size, then the checksum and the length of the compression's name.
pub(super) const CHUNK_PREFIX_LENGTH: u64 = 8 + 8 + 8 + 4 + 4;

/// What a sound file carries.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Outline {
    /// Chunks, and those of them whose writer left the checksum out.
    pub chunks: u64,
    pub chunks_without_checksum: u64,
    /// Messages that lie outside chunks.
    pub loose_messages: u64,
    /// Whether the data section and the summary have a checksum.
    pub data_checksum: bool,
    pub summary_checksum: bool,
    /// First byte and length of each metadata record.
    pub metadata: Vec<(u64, u64)>,
    /// Bytes after the end marker.
    pub trailing: u64,
}

/// Opcode and body length of the record at `at`.
pub(super) fn header(source: &mut dyn Source, at: u64) -> io::Result<(u8, u64)> {
    let mut bytes = [0; HEADER_LENGTH as usize];
    source.seek(SeekFrom::Start(at))?;
    source.read_exact(&mut bytes)?;
    let [opcode, length @ ..] = bytes;
    Ok((opcode, u64::from_le_bytes(length)))
}

/// Walks a file that the strict reader accepted.
pub(super) fn trace(source: &mut dyn Source) -> io::Result<Outline> {
    let end = source.seek(SeekFrom::End(0))?;
    let mut outline = Outline::default();
    let mut at = mcap::MAGIC.len() as u64;
    while at + HEADER_LENGTH <= end {
        let (opcode, length) = header(source, at)?;
        match opcode {
            op::CHUNK => {
                outline.chunks += 1;
                outline.chunks_without_checksum += u64::from(u32_at(source, at + HEADER_LENGTH + 24)? == 0);
            }
            op::MESSAGE => outline.loose_messages += 1,
            op::METADATA => outline.metadata.push((at, HEADER_LENGTH + length)),
            op::DATA_END => outline.data_checksum = u32_at(source, at + HEADER_LENGTH)? != 0,
            op::FOOTER => {
                outline.summary_checksum = u32_at(source, at + HEADER_LENGTH + 16)? != 0;
                let used = at + HEADER_LENGTH + length + mcap::MAGIC.len() as u64;
                outline.trailing = end.saturating_sub(used);
                break;
            }
            _ => {}
        }
        at = at.saturating_add(HEADER_LENGTH).saturating_add(length);
    }
    Ok(outline)
}

fn u32_at(source: &mut dyn Source, at: u64) -> io::Result<u32> {
    let mut bytes = [0; 4];
    source.seek(SeekFrom::Start(at))?;
    source.read_exact(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}
