//! Changes of RDT records: 36 bytes each, big-endian, as many in a datagram as fit.
//!
//! | offset | field |
//! |---|---|
//! | 0 | `u32 rdt_sequence` |
//! | 4 | `u32 ft_sequence` |
//! | 8 | `u32 status` |
//! | 12 | `i32 Fx Fy Fz Tx Ty Tz` |
//!
//! Source: reference/PROTOCOLS.md, section 2.1. A datagram of another length is left alone, and the fault has not acted.

use super::action::Action;

const LENGTH: usize = 36;
/// N in a pound-force, by its definition.
const NEWTONS_PER_POUND: f64 = 4.448_221_615_260_5;
/// m in an inch, by its definition.
const METRES_PER_INCH: f64 = 0.0254;

/// `ft_sequence` and the six counts of one record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sample {
    sequence: [u8; 4],
    counts: [u8; 24],
}

fn records(bytes: &mut [u8]) -> impl Iterator<Item = &mut [u8]> {
    let whole = if bytes.len().is_multiple_of(LENGTH) { bytes } else { &mut [] };
    whole.chunks_exact_mut(LENGTH)
}

fn word(record: &[u8], field: usize) -> [u8; 4] {
    let mut word = [0; 4];
    word.copy_from_slice(&record[field..field + 4]);
    word
}

/// This sequence number of the first record.
pub(super) fn sequence(bytes: &mut [u8], field: usize) -> Option<u32> {
    records(bytes).next().map(|record| u32::from_be_bytes(word(record, field)))
}

/// Takes `offset` from this sequence number of every record; whether it changed any.
pub(super) fn count_back(bytes: &mut [u8], field: usize, offset: u32) -> bool {
    each(bytes, |record| {
        let count = u32::from_be_bytes(word(record, field)).wrapping_sub(offset);
        record[field..field + 4].copy_from_slice(&count.to_be_bytes());
    })
}

/// What the last record holds.
pub(super) fn last(bytes: &mut [u8]) -> Option<Sample> {
    records(bytes).last().map(|record| {
        let mut counts = [0; 24];
        counts.copy_from_slice(&record[12..LENGTH]);
        Sample { sequence: word(record, 4), counts }
    })
}

/// Every record repeats this sample; whether that changed any.
pub(super) fn stall(bytes: &mut [u8], sample: &Sample) -> bool {
    each(bytes, |record| {
        record[4..8].copy_from_slice(&sample.sequence);
        record[12..LENGTH].copy_from_slice(&sample.counts);
    })
}

/// Does what the action says; whether it changed anything.
pub(super) fn change(action: &Action, bytes: &mut [u8]) -> bool {
    match action {
        Action::StatusWord { status } => each(bytes, |record| record[8..12].copy_from_slice(&status.to_be_bytes())),
        Action::CountsAtLimits { axis, negative } => {
            let limit = if *negative { i32::MIN } else { i32::MAX };
            let axes = axis.map_or(0..6, |axis| usize::from(axis)..usize::from(axis) + 1);
            each_count(bytes, |at, count| if axes.contains(&at) { limit } else { count })
        }
        Action::CpfChange { factor } => each_count(bytes, |_, count| scaled(count, *factor)),
        Action::UnitChange {} => each_count(bytes, |at, count| {
            let torque = if at < 3 { 1.0 } else { METRES_PER_INCH };
            scaled(count, 1.0 / (NEWTONS_PER_POUND * torque))
        }),
        _ => false,
    }
}

fn scaled(count: i32, factor: f64) -> i32 {
    // A conversion to an integer saturates, as the box does.
    (f64::from(count) * factor).round() as i32
}

fn each_count(bytes: &mut [u8], new: impl Fn(usize, i32) -> i32) -> bool {
    each(bytes, |record| {
        for axis in 0..6 {
            let field = 12 + 4 * axis;
            let count = new(axis, i32::from_be_bytes(word(record, field)));
            record[field..field + 4].copy_from_slice(&count.to_be_bytes());
        }
    })
}

fn each(bytes: &mut [u8], change: impl Fn(&mut [u8])) -> bool {
    let mut changed = false;
    for record in records(bytes) {
        let mut before = [0; LENGTH];
        before.copy_from_slice(record);
        change(record);
        changed |= before[..] != *record;
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record with counts 1 000 000 to 6 000 000.
    fn record(rdt: u32, ft: u32) -> Vec<u8> {
        let mut bytes: Vec<u8> = [rdt, ft, 0].iter().flat_map(|word| word.to_be_bytes()).collect();
        bytes.extend((1..=6).flat_map(|axis| (axis * 1_000_000_i32).to_be_bytes()));
        bytes
    }

    fn counts(bytes: &[u8]) -> Vec<i32> {
        (0..6).map(|axis| i32::from_be_bytes(word(bytes, 12 + 4 * axis))).collect()
    }

    #[test]
    fn each_field_changes_alone() {
        let mut bytes = record(5, 7);
        assert!(change(&Action::StatusWord { status: 0x8002_0000 }, &mut bytes));
        assert_eq!(word(&bytes, 8), [0x80, 2, 0, 0]);
        assert_eq!(counts(&bytes), counts(&record(5, 7)));
        assert!(!change(&Action::StatusWord { status: 0x8002_0000 }, &mut bytes), "it says so already");
        assert!(change(&Action::CountsAtLimits { axis: Some(2), negative: true }, &mut bytes));
        assert_eq!(counts(&bytes), [1_000_000, 2_000_000, i32::MIN, 4_000_000, 5_000_000, 6_000_000]);
    }

    /// 1 N is 0.2248089 lbf and 1 N m is 8.850746 lbf in (NIST SP 811, appendix B).
    #[test]
    fn units_change_by_their_definition() {
        let mut bytes = record(5, 7);
        assert!(change(&Action::UnitChange {}, &mut bytes));
        assert_eq!(counts(&bytes), [224_809, 449_618, 674_427, 35_402_983, 44_253_729, 53_104_475]);
        assert!(change(&Action::CpfChange { factor: 1e9 }, &mut bytes));
        assert_eq!(counts(&bytes), [i32::MAX; 6]);
    }

    #[test]
    fn another_length_is_left_alone() {
        let mut bytes = vec![1; 37];
        assert!(!change(&Action::UnitChange {}, &mut bytes));
        assert!(!count_back(&mut bytes, 0, 1));
        assert_eq!((bytes, sequence(&mut [], 0)), (vec![1; 37], None));
    }
}
