//! A model against recordings: what it says of a right model, of a wrong one, of a shifted clock, and of what cannot be had.

use std::path::{Path, PathBuf};

use harness::case::Case;
use harness::clamp::Clamp;
use harness::compare::{
    CompareVerdict, Comparison, FreeRun, Limit, Outcome, Quantity, Request, SessionComparison, Verdict, compare,
    exit_code,
};
use harness::diagnose::quality::Phase;
use harness::diagnose::software::CLOSED_M;
use harness::error::Error;
use harness::model::{EffectModel, Model, from_session};
use harness::recording::{Grade, Kind, Pose, ReadOptions, Series, Session, read};
use sim_core::space::AxisMotion;

/// The recordings of a set that stays outside the project; says aloud when a test cannot run without it.
fn set(name: &str, files: &[&str]) -> Option<Vec<Session>> {
    let root = std::env::var_os("DOCKHIL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let folder = root.join("data/hidden-effect/dev").join(name);
    if !folder.exists() {
        println!("SKIPPED: {} is missing; set DOCKHIL_SHARED", folder.display());
        return None;
    }
    let one = |file: &&str| read(&folder.join(file), &ReadOptions::default()).unwrap();
    Some(files.iter().map(one).collect())
}

const FILES: [&str; 5] = ["static.mcap", "excite.mcap", "test_07.mcap", "test_08.mcap", "test_09.mcap"];

fn against(model: &Model, sessions: &[Session], limits: &[Limit], samples: usize) -> Result<Comparison, Error> {
    let catalog = sim_core::effects::standard();
    compare(Request {
        model,
        catalog: &catalog,
        sessions,
        limits,
        free_run: FreeRun { samples, seed: 7 },
        clamp: Clamp::Commanded,
    })
}

fn compared(sessions: &[Session], limits: &[&str]) -> Comparison {
    let model = from_session(sessions.last().unwrap()).unwrap();
    let limits: Vec<Limit> = limits.iter().map(|text| Limit::parse(text).unwrap()).collect();
    against(&model, sessions, &limits, 40).unwrap_or_else(|error| panic!("{error}"))
}

fn impacts(comparison: &Comparison) -> impl Iterator<Item = &SessionComparison> {
    comparison.sessions.iter().filter(|session| session.kind == Kind::Impact)
}

fn misfit(comparison: &Comparison, channel: &str, phase: Phase) -> f64 {
    let row = comparison.heat.iter().find(|row| row.channel == channel).unwrap();
    row.cells.iter().find(|cell| cell.phase == phase).unwrap().misfit
}

#[test]
fn a_right_model_is_inside_noise_in_every_block() {
    let Some(sessions) = set("d0", &FILES) else { return };
    let comparison = compared(&sessions, &[]);
    assert_eq!(comparison.verdict, CompareVerdict::InsideNoise, "{:#?}", comparison.findings);
    assert_eq!(exit_code(&comparison), 0);
    assert_eq!(comparison.sessions.len(), 4, "the recording at rest gives the noise and is not compared");
    for session in &comparison.sessions {
        for block in &session.blocks {
            // The floor is known to 2 % from 4 s at rest, the rms of 1000 positions to 2 %.
            assert!(block.rms < 1.15 * block.noise_floor, "{}: {block:#?}", session.file);
            assert!(block.misfit.unwrap() < 1.15, "{}: {block:#?}", session.file);
            assert_eq!(block.verdict, Verdict::InsideNoise);
        }
        if session.kind == Kind::Impact {
            // 0.085 N of noise on a force that varies by 1.6 to 3 N rms over the contact leave 94 to 97 %.
            let agreement = session.blocks[1].agreement.unwrap();
            assert!(agreement.fit_percent > 90.0 && agreement.magnitude_percent.abs() < 1.0, "{agreement:?}");
        }
        assert!(session.shift_force.as_ref().is_none_or(|shift| !shift.finding), "{:?}", session.shift_force);
        assert!(session.shift_pose.as_ref().is_none_or(|shift| !shift.finding), "{:?}", session.shift_pose);
    }
    let mut inside = 0;
    for session in impacts(&comparison) {
        assert!(session.software.closure_m.unwrap() < CLOSED_M, "{:?}", session.software);
        assert_eq!(session.free_run.as_ref().unwrap().diverged, 0);
        assert_eq!(session.quantities.len(), 5);
        for quantity in &session.quantities {
            let (difference, uncertainty) = (quantity.difference.unwrap(), quantity.uncertainty.unwrap());
            // 2u leaves out one in twenty of fifteen numbers that are not independent; 3u one in four hundred.
            assert!(difference.abs() < 1.5 * uncertainty, "{}: {quantity:#?}", session.file);
            inside += usize::from(quantity.verdict == Verdict::InsideNoise);
        }
    }
    assert!(inside >= 12, "{inside} of 15 quantities inside");
}

#[test]
fn a_recording_says_what_its_simulator_knows() {
    // `restitution` of dev/truth.json, test_07 to test_09; four digits there, 1e-3 for another window.
    let Some(sessions) = set("d0", &FILES) else { return };
    let comparison = compared(&sessions, &[]);
    for (session, truth) in impacts(&comparison).zip([0.8496, 0.8535, 0.8836]) {
        let restitution = quantity(session, "restitution").measured.unwrap();
        assert!((restitution - truth).abs() < 1e-3, "{}: {restitution} for {truth}", session.file);
        // Energy is what speed was lost: (m/2) v² (1 - e²), exactly, up to the dead band's last ticks.
        let speed = quantity(session, "rebound_speed_m_per_s").measured.unwrap();
        let mass = sessions.iter().find(|one| one.file.ends_with(&session.file)).unwrap();
        let mass = mass.believed_f64("reduced_mass_kg").unwrap();
        let lost = 0.5 * mass * speed * speed * (1.0 / (restitution * restitution) - 1.0);
        let energy = quantity(session, "observed_energy_j").measured.unwrap();
        assert!((energy - lost).abs() < 1e-3 * lost, "{}: {energy} J for {lost} J", session.file);
    }
}

fn quantity<'a>(session: &'a SessionComparison, name: &str) -> &'a Quantity {
    session.quantities.iter().find(|quantity| quantity.name == name).unwrap()
}

#[test]
fn a_missing_stiffness_shows_in_the_force_while_in_contact() {
    let Some(sessions) = set("d1", &FILES) else { return };
    let comparison = compared(&sessions, &[]);
    assert_eq!(comparison.verdict, CompareVerdict::Outside);
    assert_eq!(exit_code(&comparison), 1);
    for session in impacts(&comparison) {
        assert!(session.software.closure_m.unwrap() < CLOSED_M, "hardware is no fault of our software");
        assert_eq!(session.blocks[0].verdict, Verdict::InsideNoise, "the path is right: {:?}", session.blocks[0]);
        assert_eq!(session.blocks[1].verdict, Verdict::Outside);
        assert!(session.shift_force.as_ref().is_none_or(|shift| !shift.finding), "a spring is no shift");
    }
    let all = comparison.heat.iter().flat_map(|row| row.cells.iter().map(move |cell| (&row.channel, cell)));
    let (channel, worst) = all.max_by(|a, b| a.1.misfit.total_cmp(&b.1.misfit)).unwrap();
    assert_eq!(channel, "force_z_n");
    assert!(matches!(worst.phase, Phase::Compression | Phase::Expansion), "{worst:?}");
    assert!(misfit(&comparison, "measured_z_m", Phase::Compression) < 1.5);
}

#[test]
fn with_the_effect_added_the_model_is_inside_noise() {
    // The truth of dev/truth.json, in our own implementation of each effect.
    type Truth = (&'static str, &'static [(&'static str, &'static [f64])]);
    let truths: [Truth; 5] = [
        ("d1", &[("stiffness-hardening", &[9.0e6])]),
        ("d3", &[("command-delay", &[0.008])]),
        ("d4", &[("force-lag", &[14.0, 2.0])]),
        ("d5", &[("tool-inertia", &[6.5])]),
        ("d6", &[("stiffness-hardening", &[16.0e6]), ("force-bias-drift", &[0.18])]),
    ];
    let catalog = sim_core::effects::standard();
    let (mut inside, mut all) = (0, 0);
    for (name, effects) in truths {
        let Some(sessions) = set(name, &FILES) else { return };
        let mut model = from_session(&sessions[2]).unwrap();
        for (id, values) in effects {
            let names = catalog.get(id).unwrap().params.iter().map(|param| param.name.to_string());
            let values = names.zip(values.iter().copied()).collect();
            model.effects.push(EffectModel { id: (*id).into(), enabled: true, source: String::new(), values });
        }
        let comparison = against(&model, &sessions, &[], 40).unwrap();
        assert_eq!(comparison.verdict, CompareVerdict::InsideNoise, "{name}: {:#?}", comparison.findings);
        for session in impacts(&comparison) {
            assert!(session.software.closure_m.unwrap() < CLOSED_M, "{name}: {:?}", session.software);
            all += session.quantities.len();
            inside += session.quantities.iter().filter(|one| one.verdict == Verdict::InsideNoise).count();
        }
    }
    // 95 % are expected; speed, restitution and energy of one run go together, so that few runs decide.
    assert!(10 * inside >= 8 * all, "{inside} of {all} quantities of the free runs inside");
}

#[test]
fn missing_friction_is_not_reported_as_a_shift() {
    let Some(sessions) = set("d2", &FILES) else { return };
    let comparison = compared(&sessions, &[]);
    assert_eq!(comparison.verdict, CompareVerdict::Outside);
    assert!(
        comparison.findings.iter().all(|finding| !finding.contains("would fit better")),
        "{:#?}",
        comparison.findings
    );
}

#[test]
fn a_late_pose_is_named_by_the_software_block() {
    let Some(sessions) = set("d3", &FILES) else { return };
    let comparison = compared(&sessions, &[]);
    assert_eq!(comparison.verdict, CompareVerdict::Outside);
    for session in impacts(&comparison) {
        assert!(!session.software.closes() && session.software.explained(), "{:?}", session.software);
        assert!(session.software.closure_found_m.unwrap() < CLOSED_M);
        assert!((session.software.pose_delay_s.unwrap() - 0.008).abs() < 1e-9, "{:?}", session.software);
        let pose = session.shift_pose.as_ref().unwrap();
        assert!(pose.finding && (pose.shift_ms - 8.0).abs() < 4.0 * pose.sd_ms, "{pose:?}");
    }
    let first = &comparison.findings[0];
    assert!(first.contains("pose 8.00 ms later") && first.contains("settle this first"), "{first}");
}

#[test]
fn a_drift_at_rest_is_a_finding() {
    let Some(sessions) = set("d6", &FILES) else { return };
    let comparison = compared(&sessions, &[]);
    // The truth is 0.18 N/s.
    assert!(comparison.findings.iter().any(|f| f.contains("drifts at rest by +0.1")), "{:#?}", comparison.findings);
}

#[test]
fn force_stamps_that_were_moved_are_found_and_not_corrected() {
    let Some(mut sessions) = set("d0", &["static.mcap", "test_08.mcap"]) else { return };
    let before = compared(&sessions, &[]);
    let sensed = sessions[1].sensed.as_mut().unwrap();
    sensed.time_ns.iter_mut().for_each(|time_ns| *time_ns += 5_000_000);
    let comparison = compared(&sessions, &[]);
    let session = &comparison.sessions[0];
    let shift = session.shift_force.as_ref().unwrap();
    assert!(shift.finding && (shift.shift_ms - 5.0).abs() < 3.0 * shift.sd_ms, "{shift:?}");
    assert!((session.software.clock_offset_s - 0.005).abs() < 1e-9, "{:?}", session.software);
    assert!(session.software.explained());
    assert!(session.blocks[1].misfit > before.sessions[0].blocks[1].misfit, "the block is not aligned");
    assert!(comparison.findings.iter().any(|f| f.contains("would fit better") && f.contains("not applied")));
    assert_eq!(comparison.verdict, CompareVerdict::Outside);
    assert_eq!(session.blocks[0].verdict, Verdict::InsideNoise, "the path has its own clock");
}

#[test]
fn limits_have_a_guard_band() {
    let Some(sessions) = set("d0", &["static.mcap", "test_08.mcap"]) else { return };
    let outcome = |limits: &[&str]| {
        let comparison = compared(&sessions, limits);
        (comparison.verdict, exit_code(&comparison), comparison.limits)
    };
    let (verdict, code, limits) = outcome(&["force_z_n=0.35", "peak_force_n=0.5", "measured_z_m=1e-4"]);
    assert_eq!((verdict, code, limits.len()), (CompareVerdict::Pass, 0, 3), "{limits:#?}");
    let (verdict, code, _) = outcome(&["force_z_n=0.05", "peak_force_n=0.5"]);
    assert_eq!((verdict, code), (CompareVerdict::Fail, 1));
    let (verdict, code, limits) = outcome(&["force_z_n=0.083"]);
    assert_eq!((verdict, code), (CompareVerdict::Undecided, 3), "{limits:#?}");
    assert_eq!(limits[0].outcome, Outcome::Undecided);
    let (value, uncertainty) = (limits[0].value.unwrap(), limits[0].uncertainty.unwrap());
    assert!(value - uncertainty <= 0.083 && 0.083 < value + uncertainty, "{limits:#?}");
}

#[test]
fn the_same_request_gives_the_same_bytes() {
    let Some(sessions) = set("d0", &["static.mcap", "test_07.mcap"]) else { return };
    let json = || serde_json::to_string(&compared(&sessions, &[])).unwrap();
    let many = json();
    assert_eq!(many, json());
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(json);
    assert!(many == one, "one thread and many give the same bytes");
}

#[test]
fn a_loop_that_runs_away_is_told_and_does_not_panic() {
    let Some(sessions) = set("d0", &["static.mcap", "test_07.mcap"]) else { return };
    let mut model = from_session(&sessions[1]).unwrap();
    model.contact.stiffness_n_per_m = 1e7;
    let comparison = against(&model, &sessions, &[], 8).unwrap();
    let session = &comparison.sessions[0];
    assert_eq!(session.free_run.as_ref().unwrap().diverged, 8);
    assert!(session.quantities.iter().all(|quantity| quantity.verdict == Verdict::CannotSay));
    assert!(comparison.findings.iter().any(|f| f.contains("8 of 8 free runs left 1 m")), "{:#?}", comparison.findings);
}

#[test]
fn what_cannot_be_compared_is_refused_with_help() {
    let texts = ["force_z_n", "force=1", "force_z_n=0.35 N", "force_z_n=-1", "force_z_n=NaN"];
    for text in texts {
        let error = Limit::parse(text).unwrap_err();
        assert!(error.help.is_some(), "{text}: {error}");
    }
    assert!(Limit::parse("force=1").unwrap_err().help.unwrap().contains("peak_force_n in N"));
    let Some(sessions) = set("d0", &["static.mcap", "excite.mcap", "test_07.mcap"]) else { return };
    let model = from_session(&sessions[2]).unwrap();
    let refused = |sessions: &[Session], model: &Model| {
        let error = against(model, sessions, &[], 4).unwrap_err();
        assert!(error.help.is_some(), "{error}");
        error.to_string()
    };
    assert!(refused(&sessions[..1], &model).contains("no recording to compare"));
    assert!(refused(&sessions[..2], &model).contains("no recording with contact among excite.mcap"));
    let mut silent = model.clone();
    silent.sensor.white_sigma_n = 0.0;
    silent.sensor.slow_sigma_n = 0.0;
    assert!(refused(&sessions[2..], &silent).contains("the noise of the force is not known"));
    let declared = against(&model, &sessions[2..], &[], 4).unwrap();
    assert!(declared.findings.iter().any(|f| f.contains("declared one")), "{:#?}", declared.findings);
}

/// A driven axis of two seconds that the model describes exactly.
fn driven(model: &Model) -> Session {
    let count = 2000_usize;
    let time_ns: Vec<i64> = (0..count as i64).map(|tick| tick * 1_000_000).collect();
    let pose = |z: f64| Pose { position_m: [0.0, 0.0, z], orientation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    let applied = (0..count).map(|tick| 40.0 * ((tick % 600) as f64 / 300.0 - 1.0)).collect();
    let mut session = Session {
        file: PathBuf::from("drive.csv"),
        sha256: String::new(),
        start_ns: 0,
        kind: Kind::Drive,
        believed: std::collections::BTreeMap::new(),
        commanded: None,
        measured: Some(Series { time_ns: time_ns.clone(), value: vec![pose(0.0); count] }),
        twist: None,
        sensed: None,
        applied: Some(Series { time_ns: time_ns.clone(), value: applied }),
        grade: Grade::A,
        findings: Vec::new(),
    };
    let case = Case::of(&session, model).unwrap();
    let base = harness::blocks::Base::of(model);
    let first = AxisMotion::moving(0.01, 0.02);
    let exact = harness::blocks::drive(&case, 0..count, first, &base, &[], &mut sim_core::trace::Trace::default());
    // White enough: steps of a full-period sequence over 41 values, standard deviation 11.83 of them.
    let noise = |tick: usize| ((tick * 7919 % 41) as f64 - 20.0) / 11.83 * 1e-5;
    let value = exact.iter().enumerate().map(|(tick, z)| pose(z + noise(tick))).collect();
    session.measured = Some(Series { time_ns, value });
    session
}

#[test]
fn a_drive_has_one_block_and_no_software() {
    let text = "schema = 1\nname = \"axis\"\nrig = \"drive\"\n[plant]\nmass_kg = 95.0\n[contact]\nstiffness_n_per_m = 0.0\n\
                damping_n_s_per_m = 200.0\n[timing]\nloop_period_s = 0.001\n[readout]\nposition_sigma_m = 1e-5\n";
    let mut model = Model::parse("axis.toml", text, &sim_core::effects::standard()).unwrap();
    let session = driven(&model);
    let right = against(&model, std::slice::from_ref(&session), &[], 4).unwrap();
    assert_eq!(right.verdict, CompareVerdict::InsideNoise, "{:#?}", right.findings);
    assert_eq!((right.sessions[0].blocks.len(), right.sessions[0].software.closure_m), (1, None));
    let position = right.sessions[0].fitted[0].value;
    assert!((position - 0.01).abs() < 1e-6, "{position} m at the start");
    model.contact.damping_n_s_per_m = 220.0;
    let wrong = against(&model, std::slice::from_ref(&session), &[], 4).unwrap();
    assert_eq!(wrong.verdict, CompareVerdict::Outside);
    model.readout.position_sigma_m = 0.0;
    let unknown = against(&model, std::slice::from_ref(&session), &[], 4).unwrap();
    assert_eq!((unknown.verdict, exit_code(&unknown)), (CompareVerdict::CannotSay, 3));
    let limit = Limit::parse("measured_z_m=1.0").unwrap();
    let limited = against(&model, std::slice::from_ref(&session), &[limit], 4).unwrap();
    assert_eq!(limited.limits[0].outcome, Outcome::Pass, "a limit needs no noise: {:?}", limited.limits);
}
