//! What can still be had from a file that the strict reader refused.

use std::io;

use mcap::records::op;

use super::dispatch::{Dispatch, Trouble};
use super::records::Source;
use super::survey::{Damage, Piece, Survey, pump_piece};

/// What was kept.
#[derive(Debug, Default)]
pub(super) struct Salvaged {
    /// Parts that turned out to be unusable while they were read.
    pub damages: Vec<Damage>,
    /// Messages taken from the chunk that is cut off: its checksum cannot be verified.
    pub unverified_messages: u64,
    /// Messages dropped because the chunk that defined their channel is lost, and no summary repeats it.
    pub undefined_messages: u64,
}

/// Hands on the messages of all sound pieces, and those of a cut chunk as far as it goes.
///
/// Two rounds, because a schema may stand only in a chunk that is lost, and again in the summary.
pub(super) fn collect(
    source: &mut dyn Source,
    survey: &Survey,
    dispatch: &mut Dispatch<'_>,
) -> io::Result<Result<Salvaged, Trouble>> {
    let mut salvaged = Salvaged::default();
    for piece in &survey.pieces {
        // A piece that fails here fails again, and is reported, in the second round.
        let _ = pump_piece(source, *piece, true, &mut |opcode, body| dispatch.define(opcode, body))?;
    }
    for piece in survey.pieces.iter().filter(|piece| carries_content(piece.opcode)) {
        let mut undefined = 0;
        let mut each = |opcode: u8, body: &[u8]| match dispatch.record(opcode, body) {
            Err(Trouble::Damage(_)) if opcode == op::MESSAGE => {
                undefined += 1;
                Ok(())
            }
            outcome => outcome,
        };
        let outcome = pump_piece(source, *piece, true, &mut each)?;
        salvaged.undefined_messages += undefined;
        match outcome {
            Ok(()) => {}
            Err(Trouble::Damage(what)) => salvaged.damages.push(Damage { at: piece.at, what }),
            Err(content) => return Ok(Err(content)),
        }
    }
    if let Some(at) = survey.cut_at {
        let before = dispatch.tally.messages;
        let tail = Piece { at, length: survey.length - at, opcode: op::CHUNK };
        // The end is expected to fail: that is where the file was cut.
        if let Err(content @ Trouble::Content(_)) =
            pump_piece(source, tail, false, &mut |opcode, body| dispatch.record(opcode, body))?
        {
            return Ok(Err(content));
        }
        salvaged.unverified_messages = dispatch.tally.messages - before;
    }
    Ok(Ok(salvaged))
}

fn carries_content(opcode: u8) -> bool {
    matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::METADATA | op::ATTACHMENT)
}
