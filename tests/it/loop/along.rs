//! Effects of one axis in a loop with six.

use super::space::{aligned, as_in_space, askew, level_start};
use super::{NOISE, cell, run, start, started};
use sim_core::effect::{catalog_along, kind_along};
use sim_core::effects::standard;
use sim_core::force_sensor::{SensorNoise, WrenchNoise};
use sim_core::space::Motion;
use sim_core::trace::Columns;

/// With everything on the z axis, each effect does in space what it does along one axis.
#[test]
fn every_effect_acts_along_z_as_along_one_axis() {
    for kind in standard().kinds() {
        let along = kind_along(kind);
        let one = run(&cell(), &[started(kind)], &start(2.0, SensorNoise::NONE), Columns::LOG);
        let six = run(&aligned(), &[started(&along)], &level_start(2.0), Columns::LOG);
        as_in_space(&one, &six, &kind.id);
    }
}

/// Off is the identity, to the last bit, also where probe and nozzle are askew and turning.
#[test]
fn an_effect_that_is_off_is_the_identity_in_space() {
    let noise = WrenchNoise { force: [NOISE; 3], torque: [NOISE; 3] };
    let mut start = askew::start(2.0);
    start.noise = noise;
    let columns = Columns { loop_ticks: true, sensor_ticks: true, achieved: true, measured: true };
    let nominal = run(&askew::cell(), &[], &start, columns);
    assert!(nominal.touch.iter().any(|touch| touch.depth_m > 0.0), "it touches");
    for kind in catalog_along(&standard()).kinds() {
        let off = run(&askew::cell(), &[kind.attach(&kind.off())], &start, columns);
        assert_eq!(nominal.fingerprint(), off.fingerprint(), "{}", kind.id);
        let on = run(&askew::cell(), &[started(kind)], &start, columns);
        // Only the recorder knows a clock offset.
        assert_eq!(nominal.fingerprint() == on.fingerprint(), kind.id == "clock-offset", "{}", kind.id);
    }
}

/// A packet that is lost is lost in every axis.
#[test]
fn a_lost_packet_is_lost_in_every_axis() {
    let kind = kind_along(standard().get("command-loss").unwrap());
    let trace = run(&askew::cell(), &[started(&kind)], &askew::start(2.0), Columns::LOG);
    let pairs = || trace.received.windows(2).zip(&trace.commanded[1..]);
    let (mut lost, mut kept) = (0, 0);
    for (pair, commanded) in pairs() {
        let same = |motion: &Motion| pair[1].motion == *motion;
        assert!(same(if pair[1].lost { &pair[0].motion } else { commanded }));
        if pair[1].lost { lost += 1 } else { kept += 1 }
    }
    assert!(lost > 0 && kept > 0, "{lost} {kept}");
}
