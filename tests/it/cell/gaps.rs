//! One lost cycle is no wrong software: what a recording lacks is left out and named, and what is wrong beside it is still found.

use super::diagnosed::{HIDDEN, diagnosed};
use super::{cell, reference};
use harness::cell::CellConfig;
use harness::compare::{CompareVerdict, Comparison, FreeRun, Request, compare, exit_code};
use harness::diagnose::gaps::Gaps;
use harness::recording::Session;
use sim_core::effects::standard;

/// What `compare` says of this session under the bench's model, its mass turned.
fn compared_with(session: Session, mass: f64) -> Comparison {
    let catalog = standard();
    let mut model = cell("bench", "").model(&catalog).unwrap();
    model.plant.mass_kg *= mass;
    let mut session = session;
    session.believed.insert("reduced_mass_kg".into(), model.plant.mass_kg.to_string());
    let request = Request {
        model: &model,
        catalog: &catalog,
        sessions: &[session],
        limits: &[],
        free_run: FreeRun { samples: 2, seed: 1 },
        clamp: harness::clamp::Clamp::Commanded,
    };
    compare(request).unwrap_or_else(|error| panic!("{error}"))
}

/// A run of the bench with these faults.
fn session(faults: &str) -> Session {
    reference(&cell("bench", faults), 2.0).session
}

fn fault(id: &str, on: &str, at: u64, more: &str) -> String {
    format!("[[fault]]\nid = \"{id}\"\non = \"{on}\"\nat = {at}\n{more}\n")
}

/// The software closes, nobody is blamed, and this is said to be missing.
fn is_sound(faults: &str) -> Gaps {
    let comparison = compared_with(session(faults), 1.0);
    let all = format!("{faults}{:?} {:?}", comparison.findings, comparison.sessions[0].software);
    let [one] = &comparison.sessions[..] else { panic!("{all}") };
    assert!(one.software.closes() && one.software.is_judged(), "{all}");
    assert_eq!((one.software.mass_ratio, one.software.clock_offset_s, one.software.bias_error_n), (1.0, 0.0, 0.0));
    assert!(comparison.findings.iter().all(|text| !text.contains("misses the recorded")), "{all}");
    assert_eq!(comparison.verdict, CompareVerdict::InsideNoise, "{all}");
    one.software.gaps.clone().unwrap_or_else(|| panic!("{all}"))
}

fn near(times_s: &[f64], wanted_s: &[f64]) {
    let same = times_s.len() == wanted_s.len() && times_s.iter().zip(wanted_s).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(same, "{times_s:?}, not {wanted_s:?}");
}

/// From 8 mm away at these speeds the satellites stand on the edge of the contact to the last digit, in one of the cycles.
#[test]
fn a_pose_on_the_edge_of_the_contact_blames_nobody() {
    for velocity_m_per_s in [0.01, 0.025, 0.04, 0.1] {
        let mut bench = cell("bench", "");
        bench.config.start.velocity_m_per_s = velocity_m_per_s;
        let comparison = compared_with(reference(&bench, 2.0).session, 1.0);
        let software = &comparison.sessions[0].software;
        assert!(software.closes() && software.gaps.is_none(), "{velocity_m_per_s}: {software:?}");
        assert_eq!((software.mass_ratio, software.bias_error_n), (1.0, 0.0), "{velocity_m_per_s}");
        // What is wrong is found all the same.
        let other = compared_with(reference(&bench, 2.0).session, 1.05);
        let ratio = other.sessions[0].software.mass_ratio;
        assert!((ratio * 1.05 - 1.0).abs() < 1e-3, "{velocity_m_per_s}: {ratio}");
    }
}

#[test]
fn without_gaps_nothing_is_said() {
    let comparison = compared_with(session(""), 1.0);
    assert_eq!((comparison.verdict, &comparison.sessions[0].software.gaps), (CompareVerdict::InsideNoise, &None));
}

#[test]
fn a_lost_frame_leaves_one_cycle_without_a_command() {
    let gaps = is_sound(&fault("drop", "rsi-frame", 200, ""));
    near(&gaps.without_command_s, &[0.8]);
    assert!(gaps.left_out > 2 && gaps.left_out < 16 && gaps.judged_share > 0.9, "{gaps:?}");
    assert!(gaps.words().contains("1 of 500 cycles without a command (0.800 s)"), "{}", gaps.words());
    let gaps = is_sound(&fault("delay", "rsi-frame", 120, "cycles = 2"));
    near(&gaps.without_command_s, &[0.48, 0.484]);
}

/// The command is in the recording. One round trip later the software's own pose shows that the robot did not follow it.
#[test]
fn a_lost_answer_is_named_with_its_time() {
    near(&is_sound(&fault("drop", "rsi-reply", 200, "")).unheard_s, &[0.8]);
    near(&is_sound(&fault("delay", "rsi-reply", 150, "cycles = 2")).unheard_s, &[0.6, 0.604]);
    let two = [fault("drop", "rsi-reply", 110, ""), fault("drop", "rsi-reply", 112, "")].concat();
    near(&is_sound(&two).unheard_s, &[0.44, 0.448]);
}

#[test]
fn a_reading_that_is_lost_or_late_leaves_out_its_cycle() {
    for faults in [fault("drop", "ft", 399, ""), fault("delay", "ft", 399, "cycles = 2")] {
        let gaps = is_sound(&faults);
        near(&gaps.without_reading_s, &[0.4]);
        assert!(gaps.left_out < 6, "{gaps:?}");
    }
    // What comes first after a gap may be what was due in it.
    near(&is_sound(&fault("drop", "ft", 402, "")).without_reading_s, &[0.404]);
    // Under 10 ms of late readings lie three ticks.
    let gaps = is_sound(&fault("delay", "ft", 399, "cycles = 10"));
    assert!(gaps.without_reading_s.len() >= 2 && gaps.left_out < 12, "{gaps:?}");
}

/// The computer hears a frame for the second time and answers it again: the recording shows no gap.
#[test]
fn an_answer_that_was_given_again_is_no_new_command() {
    near(&is_sound(&fault("ipoc-previous", "rsi-frame", 140, "")).repeated_s, &[0.56]);
}

/// A gap excuses what hangs on it and nothing else.
#[test]
fn a_wrong_mass_is_named_beside_gaps() {
    let faults =
        [fault("drop", "rsi-frame", 100, ""), fault("drop", "rsi-frame", 200, ""), fault("drop", "ft", 599, "")];
    let comparison = compared_with(session(&faults.concat()), 1.02);
    let software = &comparison.sessions[0].software;
    assert_eq!(comparison.verdict, CompareVerdict::Outside);
    assert!(!software.closes() && software.explained(), "{software:?}");
    assert!((software.mass_ratio - 1.0 / 1.02).abs() < 1e-6, "{software:?}");
    assert!(comparison.findings[0].contains("with a mass 0.98"), "{:?}", comparison.findings);
}

#[test]
fn too_many_gaps_leave_it_undecided_with_a_sentence() {
    let comparison = compared_with(session(&fault("drop", "rsi-frame", 80, "for = 150\nevery = 6")), 1.0);
    let software = &comparison.sessions[0].software;
    assert!(!software.is_judged() && software.closure_m.is_none(), "{software:?}");
    assert!(comparison.findings[0].contains("too little is left to judge the software"), "{:?}", comparison.findings);
    assert_eq!((comparison.verdict, exit_code(&comparison)), (CompareVerdict::CannotSay, 3));
}

/// A run of the bench with these faults on a wire with four digits.
fn coarse(faults: &str) -> Session {
    let mut cell = cell("bench", faults);
    cell.source.text = cell.source.text.replace("decimals = 9", "decimals = 4");
    cell.config = CellConfig::parse("bench", &cell.source.text).unwrap();
    reference(&cell, 2.0).session
}

/// On a wire with four digits a lost frame is found by its stamps, and nobody is blamed for it.
#[test]
fn gaps_on_a_coarse_wire() {
    let comparison = compared_with(coarse(&fault("drop", "rsi-frame", 200, "")), 1.0);
    assert_eq!(comparison.verdict, CompareVerdict::InsideNoise, "{:?}", comparison.findings);
    near(&comparison.sessions[0].software.gaps.as_ref().unwrap().without_command_s, &[0.8]);
}

/// A clipped reading is no force: it is missing, and what the software made of it is left out.
#[test]
fn a_reading_at_its_limit_is_missing() {
    let gaps = is_sound(&fault("counts-at-limits", "ft", 619, "for = 2"));
    assert!(!gaps.without_reading_s.is_empty() && gaps.left_out < 20, "{gaps:?}");
}

/// What four digits leave is a step of the last one, however long the recording: a mass that is wrong by a thousandth shows.
#[test]
fn a_wrong_mass_is_named_on_a_coarse_wire() {
    for mass in [1.02, 0.999] {
        let software = compared_with(coarse(""), mass).sessions[0].software.clone();
        assert!(!software.closes() && software.explained(), "{mass}: {software:?}");
        assert!(software.rounding_m < 2.5e-7 && software.closure_found_m.unwrap() < 1.5e-7, "{mass}: {software:?}");
        assert_eq!((software.bias_error_n, software.clock_offset_s), (0.0, 0.0), "{mass}: {software:?}");
        let off = (software.mass_ratio * mass - 1.0).abs();
        assert!(off < 4.0 * software.mass_ratio_sd && software.mass_ratio_sd < 1e-3, "{mass}: {off}, {software:?}");
    }
}

/// A robot that is not as the model has it is no fault of the software: it closes with the pose that was reported.
#[test]
fn a_slow_robot_is_not_the_software() {
    let slow = "[[fault]]\nid = \"robot-second-order\"\nnatural_frequency_hz = 12\ndamping_ratio = 0.6\n";
    for session in [session(slow), coarse(slow)] {
        let comparison = compared_with(session.clone(), 1.0);
        let software = &comparison.sessions[0].software;
        assert!(software.closes() && software.on_reported_pose, "{software:?}");
        assert_eq!((software.mass_ratio, software.bias_error_n), (1.0, 0.0), "{software:?}");
        // A wrong mass is one with either pose.
        let wrong = compared_with(session, 1.02).sessions[0].software.clone();
        assert!(!wrong.closes() && wrong.explained() && wrong.on_reported_pose, "{wrong:?}");
        assert!((wrong.mass_ratio * 1.02 - 1.0).abs() < 1e-3, "{wrong:?}");
    }
}

/// What is hidden in the cell is named through lost frames, answers and readings, and nothing else is.
#[test]
fn the_injected_effect_is_named_beside_gaps() {
    let lost = [
        fault("drop", "rsi-frame", 100, ""),
        fault("delay", "rsi-frame", 180, "cycles = 2"),
        fault("drop", "rsi-reply", 150, ""),
        fault("drop", "ft", 479, "for = 3"),
    ];
    let ran = diagnosed(&format!("{HIDDEN}{}", lost.concat()));
    assert!(ran.out.contains("explained: stiffness-hardening"), "{}{}", ran.out, ran.err);
    assert_eq!(ran.exit, 0, "{}{}", ran.out, ran.err);
    assert!(!ran.out.contains("does not close"), "{}", ran.out);
}
