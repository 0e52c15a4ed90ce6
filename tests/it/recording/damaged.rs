//! Flipped bits and files that were cut off.

use harness::recording::{Grade, Luggage, RECORD_LENGTH_MAX, ReadOptions, Severity, from_bytes, luggage, rewrite};
use sim_core::rng::Streams;
use std::io::Cursor;

use super::{bytes, cell, content, salvage, samples, shared};

/// Flips one bit at every `step`-th byte and counts refused, harmless and silent.
fn flips(original: &[u8], step: usize) -> (usize, usize, Vec<usize>) {
    let options = ReadOptions::default();
    let sound = from_bytes("sound.mcap", original, &options).unwrap();
    let (mut refused, mut harmless, mut silent) = (0, 0, Vec::new());
    let mut bytes = original.to_vec();
    for at in (0..bytes.len()).step_by(step) {
        bytes[at] ^= 1 << (at / step % 8);
        match from_bytes("flipped.mcap", &bytes, &options) {
            Err(_) => refused += 1,
            Ok(read)
                if content(&read) == content(&sound) && read.believed == sound.believed && read.grade == Grade::A =>
            {
                harmless += 1
            }
            Ok(_) => silent.push(at),
        }
        bytes[at] = original[at];
    }
    (refused, harmless, silent)
}

#[test]
fn a_flipped_bit_in_a_file_of_ours_is_always_refused() {
    let original = bytes(&cell(1));
    let (refused, harmless, silent) = flips(&original, 31);
    println!("ours: {} bytes, refused {refused}, harmless {harmless}, silent {silent:?}", original.len());
    assert_eq!((harmless, silent), (0, vec![]));
}

#[test]
fn a_flipped_bit_in_a_real_recording_is_refused_or_harmless() {
    let Some(file) = shared("data/hidden-effect/dev/d0/static.mcap") else { return };
    let original = std::fs::read(file).unwrap();
    let (refused, harmless, silent) = flips(&original, 97);
    println!("d0/static: {} bytes, refused {refused}, harmless {harmless}, silent {silent:?}", original.len());
    // The writer of these files left the checksum of the data section out (0), so nothing protects the operator's record
    // at bytes 70 to 652; the session carries a note that says so. Every sample is protected.
    assert!(silent.iter().all(|at| (70..653).contains(at)), "{silent:?}");
    let session = from_bytes("static.mcap", &original, &ReadOptions::default()).unwrap();
    assert!(
        session.findings.iter().any(|finding| finding.what.contains("metadata (bytes 70 to 652)")),
        "{:?}",
        session.findings
    );
}

#[test]
fn salvage_drops_the_damaged_chunk_and_keeps_the_others() {
    let original = bytes(&cell(4));
    let sound = from_bytes("cell.mcap", &original, &ReadOptions::default()).unwrap();
    let mut worst = samples(&sound);
    for at in (8..original.len()).step_by(997) {
        let mut damaged = original.clone();
        damaged[at] ^= 4;
        let refusal = from_bytes("flipped.mcap", &damaged, &ReadOptions::default()).unwrap_err();
        assert!(refusal.help.as_deref().is_some_and(|help| help.contains("--salvage")), "byte {at}: {refusal}");
        let saved =
            from_bytes("flipped.mcap", &damaged, &salvage()).unwrap_or_else(|error| panic!("byte {at}: {error}"));
        assert_eq!(saved.grade, Grade::C, "byte {at}");
        assert!(saved.findings.iter().any(|finding| finding.severity == Severity::Defect), "byte {at}");
        worst = worst.min(samples(&saved));
    }
    println!("salvage keeps at least {worst} of {} samples", samples(&sound));
    assert!(worst * 2 > samples(&sound), "a flipped bit costs one chunk of several");
}

/// A replay of a damaged recording reads it, looks for what it carries, and would copy it: a length with a flipped bit is damage to
/// all three, and asks nobody for memory.
#[test]
fn a_flipped_bit_asks_for_no_memory() {
    let original = bytes(&cell(1));
    let mut stream = Streams::new(7).named("recording/flips");
    let mut most = 0;
    let (mut carried, mut copied) = (0, 0);
    for _ in 0..600 {
        let mut damaged = original.clone();
        let bit = (stream.uniform() * (8 * damaged.len()) as f64) as usize;
        damaged[bit / 8] ^= 1 << (bit % 8);
        let memory = allocation_counter::measure(|| {
            let _ = from_bytes("flipped.mcap", &damaged, &salvage());
            carried += usize::from(luggage(&damaged).is_ok());
            let out = Cursor::new(Vec::new());
            copied += usize::from(rewrite(&damaged, &mut |_| None, &Luggage::default(), &[], out).is_ok());
        });
        most = most.max(memory.bytes_max);
    }
    println!("at most {most} bytes at once; of 600 flips {carried} were carried over and {copied} copied");
    // One record at its limit, and its decoded chunk at the same limit, beside a few copies of a file below 1 MiB.
    assert!(most < 2 * RECORD_LENGTH_MAX as u64 + (8 << 20), "{most}");
    // Files of ours protect every byte.
    assert_eq!((carried, copied), (0, 0));
}

/// Cuts at many lengths; the number of recovered samples must never fall as the file grows.
fn cuts(original: &[u8], step: usize) -> usize {
    let mut most = 0;
    for length in (0..original.len()).step_by(step) {
        match from_bytes("cut.mcap", &original[..length], &ReadOptions::default()) {
            Ok(session) => {
                assert_eq!(session.grade, Grade::B, "cut at {length}");
                assert!(samples(&session) >= most, "cut at {length}: {} after {most}", samples(&session));
                most = samples(&session);
            }
            Err(error) => {
                assert_eq!(most, 0, "cut at {length}: {error}");
                assert!(error.to_string().contains("cut off") || length == 0, "cut at {length}: {error}");
            }
        }
    }
    most
}

#[test]
fn a_file_cut_anywhere_is_recovered_as_far_as_it_goes() {
    let original = bytes(&cell(3));
    assert_eq!(cuts(&original, 211), 3 * 1500);
    let Some(file) = shared("data/hidden-effect/dev/d0/static.mcap") else { return };
    let original = std::fs::read(file).unwrap();
    assert_eq!(cuts(&original, 4999), 6000);
    let half = from_bytes("half.mcap", &original[..100_000], &ReadOptions::default()).unwrap();
    let said: Vec<String> =
        half.findings.iter().map(|finding| format!("{}: {}", finding.topic, finding.what)).collect();
    println!("{}", said.join("\n"));
    assert!(
        said.iter().any(|text| text.starts_with("/ft/wrench: ") && text.contains("messages recovered over")),
        "{said:?}"
    );
}

#[test]
fn cut_and_damaged_is_refused_and_salvaged_with_the_worse_grade() {
    let mut cut = bytes(&cell(4));
    cut.truncate(cut.len() * 3 / 4);
    let sound = from_bytes("cut.mcap", &cut, &ReadOptions::default()).unwrap();
    let text = sound.findings.iter().find(|finding| finding.what.contains("begins at byte")).unwrap().what.clone();
    let tail: usize = text.rsplit(' ').next().unwrap().parse().unwrap();
    let (mut refused, mut harmless) = (0, 0);
    // What lies behind `tail` belongs to the chunk that is cut off: unverified, and said to be so.
    for at in (8..tail).step_by(499) {
        let mut both = cut.clone();
        both[at] ^= 1;
        match from_bytes("both.mcap", &both, &ReadOptions::default()) {
            Ok(read) => {
                assert_eq!(content(&read), content(&sound), "byte {at}");
                harmless += 1;
            }
            Err(refusal) => {
                assert!(refusal.to_string().starts_with("both.mcap: byte "), "{refusal}");
                refused += 1;
                match from_bytes("both.mcap", &both, &salvage()) {
                    Ok(saved) => assert_eq!(saved.grade, Grade::C),
                    // The first chunk alone defines the topics, and the summary that repeats them is cut off.
                    Err(error) => {
                        assert!(error.to_string().contains("since the chunk that defines their topics"), "{error}")
                    }
                }
            }
        }
    }
    println!("cut and flipped: refused {refused}, harmless {harmless}");
    assert!(refused > harmless, "indexes, which nothing protects in a cut file, are less than half of it");
}
