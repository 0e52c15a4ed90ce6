//! Every decoder takes random and mutated bytes: no panic, bounded memory, and every input counted under a name.
//!
//! The short form runs with all tests; `DOCKHIL_FULL=1` runs ten million inputs for each target. An input follows from the
//! target's name and its number alone. `tests/fuzz/` gives the same targets to libFuzzer.

mod mutate;
mod sensors;
mod targets;

use mutate::Mutator;
use rayon::prelude::*;
use sim_core::rng::Streams;
use std::panic::{AssertUnwindSafe, catch_unwind};
use targets::{Outcomes, TARGETS, Target};

/// Inputs of the short and of the long form.
const SHORT: usize = 20_000;
const FULL: usize = 10_000_000;
/// Inputs of one stream of random numbers.
const CHUNK: usize = 1000;
/// What a decoder may take at once: a stream holds two documents, a capture what TCP holds back; and some of it for each byte
/// that came, since an attribute of four bytes becomes two strings, and a sample of 36 bytes an event.
const MEMORY_BASE_BYTES: u64 = 1 << 20;
const MEMORY_PER_BYTE: u64 = 128;

/// What a chunk of inputs came to.
#[derive(Default)]
struct Seen {
    outcomes: Outcomes,
    memory_bytes_max: u64,
}

impl Seen {
    fn and(mut self, other: Seen) -> Seen {
        for (name, times) in other.outcomes {
            *self.outcomes.entry(name).or_default() += times;
        }
        self.memory_bytes_max = self.memory_bytes_max.max(other.memory_bytes_max);
        self
    }
}

fn chunk(target: &Target, seeds: &[Vec<u8>], number: usize) -> Seen {
    let mut mutator = Mutator::new(seeds, Streams::new(0).named(&format!("fuzz/{}/{number}", target.name)));
    let mut seen = Seen::default();
    for nth in 0..CHUNK {
        let input = mutator.next();
        let before: u64 = seen.outcomes.values().sum();
        let mut run = || (target.run)(&input, &mut seen.outcomes);
        let mut outcome = Ok(());
        let memory = allocation_counter::measure(|| outcome = catch_unwind(AssertUnwindSafe(&mut run)));
        if outcome.is_err() {
            let text = String::from_utf8_lossy(&input);
            panic!("{}: input {nth} of chunk {number} broke a promise, see above: {text:?}", target.name);
        }
        assert!(seen.outcomes.values().sum::<u64>() > before, "{}: {input:?} leaves no trace", target.name);
        let limit = MEMORY_BASE_BYTES + MEMORY_PER_BYTE * input.len() as u64;
        let taken = memory.bytes_max;
        assert!(taken <= limit, "{}: {taken} bytes taken for {} bytes, limit {limit}", target.name, input.len());
        seen.memory_bytes_max = seen.memory_bytes_max.max(taken);
    }
    seen
}

fn check(name: &str) {
    let target = TARGETS.iter().find(|target| target.name == name).expect("a target of this name");
    let inputs = if std::env::var("DOCKHIL_FULL").is_ok_and(|value| value == "1") { FULL } else { SHORT };
    let seeds = (target.seeds)();
    for seed in &seeds {
        let mut outcomes = Outcomes::new();
        (target.run)(seed, &mut outcomes);
        assert!(outcomes.contains_key(target.sound), "{name}: a seed is not sound: {outcomes:?}");
    }
    let chunks = (0..inputs / CHUNK).into_par_iter();
    let seen = chunks.map(|number| chunk(target, &seeds, number)).reduce(Seen::default, Seen::and);
    let Seen { outcomes, memory_bytes_max } = seen;
    println!("{name}: {inputs} inputs, at most {memory_bytes_max} bytes taken at once, {outcomes:?}");
    // The inputs are neither all refused at the door nor all sound.
    assert!(outcomes.get(target.sound).copied().unwrap_or_default() > inputs as u64 / 200, "{outcomes:?}");
    assert!(outcomes.len() > 1, "{outcomes:?}");
}

#[test]
fn a_telegram_is_decoded_or_refused_by_name() {
    check("telegram");
}

#[test]
fn a_stream_is_cut_into_documents() {
    check("frames");
}

#[test]
fn a_datagram_is_cut_into_documents() {
    check("datagram");
}

#[test]
fn a_host_takes_any_datagram() {
    check("host");
}

#[test]
fn a_controller_takes_any_reply() {
    check("controller");
}

#[test]
fn an_ethernet_configuration_is_read_or_refused_at_its_line() {
    check("ethernet");
}

#[test]
fn an_rdt_stream_is_counted() {
    check("rdt");
}

#[test]
fn a_buffered_stream_is_counted() {
    check("buffered");
}

#[test]
fn an_optoforce_stream_is_counted() {
    check("optoforce");
}

#[test]
fn a_schunk_stream_is_counted() {
    check("schunk");
}

#[test]
fn a_bota_line_is_counted() {
    check("bota");
}

#[test]
fn a_robotiq_line_is_counted() {
    check("robotiq");
}

#[test]
fn a_described_stream_is_counted() {
    check("record-stream");
}

#[test]
fn described_datagrams_are_counted() {
    check("record");
}

#[test]
fn a_device_takes_any_request() {
    check("devices");
}

#[test]
fn a_calibration_page_is_read_or_refused() {
    check("calibration");
}

#[test]
fn settings_of_a_sensor_are_read_or_refused() {
    check("sensor-settings");
}

#[test]
fn a_capture_is_read_or_damaged_by_name() {
    check("capture");
}

#[test]
fn a_cell_is_read_or_refused_by_name() {
    check("cell");
}

#[test]
fn every_target_is_checked() {
    let text = include_str!("fuzz.rs");
    for target in TARGETS {
        assert!(text.contains(&format!("check(\"{}\")", target.name)), "{} is not checked", target.name);
    }
}
