//! Relative corrections go the way of absolute ones; a step that is lost is asked for again, once the controller has counted it.

use super::{cell, reference};
use harness::cell::run::Ran;
use harness::cell::{Cell, ModeName};

const LOST: &str = "[[fault]]\nid = \"drop\"\non = \"rsi-reply\"\nat = 30\n";

/// The bench with this many digits on the wire, and a robot that adds up what it is sent.
fn bench(decimals: u8, mode: ModeName, fault: &str) -> Cell {
    let mut cell = cell("bench", fault);
    let robot = &mut cell.config.robots[0];
    (robot.decimals, robot.mode) = (decimals, mode);
    if mode == ModeName::Relative {
        // A late answer must not be added again.
        cell.rsi[0].text = cell.rsi[0].text.replace("HOLDON=\"1\"", "HOLDON=\"0\"");
    }
    cell
}

fn measured_m(ran: &Ran) -> Vec<f64> {
    ran.session.measured.as_ref().unwrap().value.iter().map(|pose| pose.position_m[2]).collect()
}

/// The greatest distance, and the furthest way that the robot went.
fn apart_m(one: &Ran, other: &Ran) -> (f64, f64) {
    let (one, other) = (measured_m(one), measured_m(other));
    assert_eq!(one.len(), other.len());
    let most = one.iter().zip(&other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
    (most, one.iter().map(|position| (position - one[0]).abs()).fold(0.0, f64::max))
}

#[test]
fn both_modes_go_the_same_way_to_the_step_of_the_wire() {
    for decimals in [4, 9] {
        let absolute = reference(&bench(decimals, ModeName::Absolute, ""), 1.6);
        let relative = reference(&bench(decimals, ModeName::Relative, ""), 1.6);
        for ran in [&absolute, &relative] {
            assert_eq!((ran.cycles, ran.answered, ran.stops.len()), (400, 400, 0), "{:?}", ran.events);
            assert!(ran.events.is_empty(), "{:?}", ran.events);
        }
        let (most_m, way_m) = apart_m(&absolute, &relative);
        eprintln!("{decimals} digits: {most_m:e} m apart on a way of {way_m} m");
        assert!(way_m > 8e-3, "the probe touches: {way_m} m");
        // What is sent is the rest to the pose that is wanted, so that rounding does not add up: one step at most.
        assert!(most_m < 1.001e-3 * libm::pow(10.0, -f64::from(decimals)), "{decimals} digits: {most_m:e} m");
    }
}

#[test]
fn a_lost_answer_is_made_good() {
    // Cycle 54 is before the contact, and all dead times after cycle 30.
    let at = |mode, fault| measured_m(&reference(&bench(9, mode, fault), 0.24))[54];
    let calm_m = at(ModeName::Absolute, "");
    let late_m = [ModeName::Absolute, ModeName::Relative].map(|mode| calm_m - at(mode, LOST));
    // Half a step of rounding each, of RIst and of the correction.
    assert!(late_m.iter().all(|late_m| late_m.abs() < 2e-12), "{late_m:?}");
    // The session says where the robot was asked to go: in the cycle of the loss further than it went.
    let session = reference(&bench(9, ModeName::Relative, LOST), 0.24).session;
    let (asked, calm) = (session.commanded.unwrap(), reference(&bench(9, ModeName::Relative, ""), 0.24).session);
    let calm = calm.commanded.unwrap();
    assert_eq!(asked.time_ns, calm.time_ns);
    let apart = asked.value.iter().zip(&calm.value).map(|(a, b)| (a.position_m[2] - b.position_m[2]).abs());
    assert!(apart.fold(0.0, f64::max) < 2e-12, "what was asked for is what was meant, in every cycle");
}
