//! libFuzzer on the target that has the name of the binary.
#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| dockhil_fuzz::run(env!("CARGO_BIN_NAME"), input));
