//! Criteria: what they say of runs whose answer is known, of noise, of missing columns, and of files.

use harness::blocks::{Base, docking_rig};
use harness::compare::observation;
use harness::model::{Repeatability, from_session};
use harness::recording::{ReadOptions, read};
use harness::simulate::{Run, Task, cell as simulated};
use nalgebra::Vector3;
use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::compensator::Hybrid;
use sim_core::contact::{ContactLaw, Sides, SpringDashpot};
use sim_core::criterion::{
    Along, Answer, AnyCriterion, Bound, Criterion, Damping, Distortion, DistortionOf, Estimate, Known, Observation,
    ObservedAxis, ObservedEnergy, Outcome, Window, contact, distortion, energy_per_axis, observed_damping,
    observed_energy, peak_force, same_sign, same_value, speeds,
};
use sim_core::effect::{Attached, Rates};
use sim_core::energy::{Activity, Pairing};
use sim_core::force_sensor::{AxisCell, SensorNoise};
use sim_core::link::Link;
use sim_core::plant::PointMass;
use sim_core::readout::Readout;
use sim_core::restitution::Release;
use sim_core::rig::DockingAxis;
use sim_core::rng::Streams;
use sim_core::robot::StraightLine;
use sim_core::space::{Axis, AxisMotion, Motion, Spatial, Wrench};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// The operating point P1 of reference/PHYSICS.md, section 1.5.
pub const MASS_KG: f64 = 63.2;
pub const STIFFNESS_N_PER_M: f64 = 1066.0;
pub const SPEED_M_PER_S: f64 = 0.035;
/// What is known of a run without noise.
pub const KNOWN: Known = Known {
    mass_kg: Some(MASS_KG),
    bias: [0.0; 6],
    tool_weight_n: 0.0,
    force_sd_n: Some(0.0),
    torque_sd_n_m: Some(0.0),
    position_sd_m: Some(0.0),
};
const ALL: Columns = Columns { loop_ticks: true, sensor_ticks: true, achieved: true, measured: true };

/// A spring without damping that never pulls.
pub fn spring() -> SpringDashpot {
    SpringDashpot { stiffness_n_per_m: STIFFNESS_N_PER_M, damping_n_s_per_m: 0.0, sides: Sides::One }
}

/// P1 behind this delay each way; `loop_s` is the period of the loop.
pub fn cell<Law>(law: Law, virtual_damping_n_s_per_m: f64, delay_s: f64, loop_s: f64) -> DockingAxis<Law> {
    DockingAxis {
        plant: PointMass::of_mass(MASS_KG),
        link: Link { dead_time_s: delay_s },
        robot: StraightLine { corner_s: loop_s, averaging_s: 2.0 * loop_s },
        readout: Readout { delay_s },
        law,
        sensor: AxisCell { tool_weight_n: 0.0, bias_n: 0.0 },
        noise: SensorNoise::NONE,
        compensator: Hybrid {
            bias_n: 0.0,
            tool_weight_n: 0.0,
            virtual_stiffness_n_per_m: 0.0,
            virtual_damping_n_s_per_m,
            dead_band_n: 0.0,
            ..Hybrid::default()
        },
    }
}

/// The clocks of the facility: 4 ms loop, 1 ms sensor.
pub const FACILITY: Rates = Rates {
    physics_step: Nanos(500_000),
    loop_period: Nanos(4_000_000),
    loop_phase: Nanos(0),
    sensor_period: Nanos(1_000_000),
    sensor_phase: Nanos(0),
};

/// One impact: 0.3 s of approach, the contact, a departure; 1.6 s in all.
pub fn impact<Law: ContactLaw<Axis>>(
    rig: &DockingAxis<Law>,
    effects: &[Attached<Axis>],
    speed_m_per_s: f64,
    (rates, noise, seed): (Rates, SensorNoise, u64),
    achieved: Option<&[AxisMotion]>,
) -> Trace<Axis> {
    let start = Start {
        first: AxisMotion::moving(-0.3 * speed_m_per_s, speed_m_per_s),
        from: Nanos(0),
        until: Nanos(1_600_000_000),
        noise,
        streams: Streams::new(seed),
    };
    let mut trace = Trace::default();
    let clamps = Clamps { achieved, ..Clamps::default() };
    ClosedLoop::new(rig, effects, rates).run(&start, &clamps, ALL, &mut trace);
    trace
}

/// White noise of this size, rounded to nothing.
pub fn white(white_n: f64) -> SensorNoise {
    SensorNoise { white_n, slow_n: 0.0, memory: 0.0, quantum_n: 0.0 }
}

/// P1 with a spring in hardware, 16 ms each way, this virtual damping on the measured pose.
fn facility(damping_n_s_per_m: f64) -> Trace<Axis> {
    let rig = cell(spring(), damping_n_s_per_m, 0.016, 0.004);
    impact(&rig, &[], SPEED_M_PER_S, (FACILITY, SensorNoise::NONE, 1), None)
}

fn criterion(text: &str) -> AnyCriterion {
    let criterion: AnyCriterion = toml::from_str(text).unwrap();
    criterion.check().unwrap();
    criterion
}

#[test]
fn energy_is_passive_neutral_or_active_and_each_expectation_has_its_outcome() {
    let known = Known { force_sd_n: Some(0.25), ..KNOWN };
    // At 19.3 N s/m the loop is within the noise of 0.25 N, ±1.5 N s/m, of neither absorbing nor creating.
    for (damping, activity) in [(0.0, Activity::Active), (19.3, Activity::Neutral), (70.0, Activity::Passive)] {
        let trace = facility(damping);
        let run = Observation::of_axis(&trace, &known);
        for expect in [Activity::Active, Activity::Neutral, Activity::Passive] {
            let verdict = ObservedEnergy { expect, ..ObservedEnergy::default() }.judge(&run);
            let wanted = match (activity, expect) {
                (found, expect) if found == expect => Outcome::Pass,
                (Activity::Neutral, _) => Outcome::Undecided,
                _ => Outcome::Fail,
            };
            assert_eq!(verdict.outcome, wanted, "{damping}: {verdict:?}");
            let begins = format!("{}, expected {}: ", activity.word(), expect.word());
            assert!(verdict.why.starts_with(&begins) && verdict.why.contains("net force"), "{}", verdict.why);
        }
    }
}

/// reference/PHYSICS.md, section 4.1: 0.34 mJ at P1 for 0.25 N white at 250 Hz; section 7: e scatters by 0.004-0.008.
#[test]
fn the_band_is_the_scatter_of_repeated_runs() {
    const RUNS: u64 = 300;
    let rig = cell(spring(), 40.0, 0.016, 0.004);
    let quiet = facility(40.0);
    let known = Known { force_sd_n: Some(0.25), ..KNOWN };
    let what =
        ObservedEnergy { pairing: Pairing::SensedWithMeasured, window: Window::Contact, ..ObservedEnergy::default() };
    let (mut energies, mut restitutions, mut said_j, mut said_e) = (Vec::new(), Vec::new(), 0.0, 0.0);
    for seed in 0..RUNS {
        // On one path, so that only the noise of the reading differs.
        let noisy = impact(&rig, &[], SPEED_M_PER_S, (FACILITY, white(0.25), seed), Some(&quiet.achieved));
        let run = Observation::of_axis(&noisy, &known);
        let energy = observed_energy(&run, &ObservedEnergy { window: Window::Run, ..what }).unwrap();
        energies.push(energy.value_j);
        said_j = energy.sd_j.unwrap();
        let gated = DockingAxis { compensator: Hybrid { dead_band_n: 1.25, ..rig.compensator }, ..rig };
        let free = impact(&gated, &[], SPEED_M_PER_S, (FACILITY, white(0.25), seed), None);
        let speeds = speeds(&Observation::of_axis(&free, &known), ObservedAxis::Z, Release::ZeroForce).unwrap();
        restitutions.push(speeds.restitution.value);
        said_e = speeds.restitution.sd.unwrap();
    }
    let scatter = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        (squares / (values.len() as f64 - 1.0)).sqrt()
    };
    // A standard deviation from n runs is known to 1/√(2n); three of those.
    let known_to = 3.0 / (2.0 * RUNS as f64).sqrt();
    assert!((scatter(&energies) / said_j - 1.0).abs() < known_to, "{} {said_j}", scatter(&energies));
    // The loop feeds noise back and gates it at rest, which the formula leaves out: the same size is all that is said.
    let ratio = scatter(&restitutions) / said_e;
    assert!((0.5..2.0).contains(&ratio), "{} {said_e}", scatter(&restitutions));
    assert!((0.004..0.008).contains(&said_e), "{said_e}");
    let run = Observation::of_axis(&quiet, &known);
    let touched =
        contact(&Observation::of_axis(&quiet, &KNOWN), &Observation::of_axis(&quiet, &KNOWN).along[0]).unwrap();
    assert!((touched.end_s - touched.begin_s - 0.765).abs() < 0.01, "{touched:?}");
    let one_port = observed_energy(&run, &ObservedEnergy::default()).unwrap();
    // 0.34 mJ counts the contact alone; 60 ms of flight on either side add 25 % of Σ v².
    assert!((0.33e-3..0.40e-3).contains(&one_port.sd_j.unwrap()), "{one_port:?}");
}

#[test]
fn a_recording_and_the_run_behind_it_are_judged_alike() {
    let session = read(&fixtures::session("cell-a", "learn_01.mcap"), &ReadOptions::default()).unwrap();
    let mut model = from_session(&session).unwrap();
    (model.sensor.white_sigma_n, model.sensor.slow_sigma_n, model.readout.position_sigma_m) = (0.0, 0.0, 0.0);
    model.repeatability =
        Repeatability { stiffness_ratio: 0.0, damping_ratio: 0.0, force_offset_n: 0.0, approach_speed_ratio: 0.0 };
    let task = Task::Impact { speed_m_per_s: 0.03, mass_ratio: 1.0, distance_m: 0.008 };
    let recorded = &simulated(&model, &[], &[Run { name: "a", task }], 1)[0];
    let rig = docking_rig(&model, &Base::of(&model), model.plant.mass_kg);
    let rates = Rates { physics_step: Nanos(1_000_000), sensor_phase: Nanos(1_000_000), ..FACILITY };
    let until = Nanos(recorded.commanded.as_ref().unwrap().time_ns.len() as i64 * rates.loop_period.0);
    let start = Start {
        first: AxisMotion::moving(-0.008, 0.03),
        from: Nanos(0),
        until,
        // The recorded cell's sensor rounds to whole mN, and its loop feels that.
        noise: SensorNoise { quantum_n: 1e-3, ..SensorNoise::NONE },
        streams: Streams::new(1),
    };
    let mut trace = Trace::default();
    ClosedLoop::new(&rig, &[], rates).run(&start, &Clamps::default(), Columns::LOG, &mut trace);
    let mut bias = [0.0; 6];
    bias[2] = model.sensor.bias_n;
    let known = Known { mass_kg: Some(model.plant.mass_kg), bias, ..KNOWN };
    let (ran, logged) = (Observation::of_axis(&trace, &known), observation(recorded).unwrap());
    // The log rounds forces to 1 mN and positions to 1 µm; velocities it keeps.
    for (text, tolerance) in [
        ("id = 'observed-energy'", 1e-12),
        ("id = 'damping'\nat_least_n_s_per_m = 1.0", 1e-9),
        ("id = 'restitution'\nat_most = 1.0", 1e-12),
        ("id = 'peak-force'\nat_most_n = 1.0", 5e-4),
        ("id = 'contact-duration'\nat_least_s = 0.1", 1e-3),
    ] {
        let (ran, logged) = (criterion(text).judge(&ran), criterion(text).judge(&logged));
        assert_eq!((ran.outcome, ran.unit), (logged.outcome, logged.unit), "{ran:?} {logged:?}");
        assert!((ran.value.unwrap() - logged.value.unwrap()).abs() <= tolerance, "{ran:?} {logged:?}");
    }
}

#[test]
fn what_is_missing_makes_a_criterion_undecided_and_is_named() {
    let trace = facility(40.0);
    let full = Observation::of_axis(&trace, &KNOWN);
    let without = |change: fn(&mut Along<'_>)| {
        let mut run = full.clone();
        change(&mut run.along[0]);
        run
    };
    let two_port = "id = 'observed-energy'\npairing = 'feedback-minus-sensed'";
    for (run, text, reason) in [
        (without(|along| along.sensed = None), two_port, "no reading of the sensor on axis z"),
        (without(|along| along.measured = None), two_port, "no measured position on axis z"),
        (without(|along| along.after = None), "id = 'damping'", "no velocity of the satellites on axis z"),
        (without(|along| along.load_sd = None), "id = 'observed-energy'", "no noise figure to tell it from zero"),
        (full.clone(), "id = 'energy-per-axis'\naxes = ['about-z']", "axis about-z was not observed"),
        (Observation::default(), "id = 'peak-depth'\nat_most_m = 1.0", "axis z was not observed"),
    ] {
        let verdict = criterion(text).judge(&run);
        assert!(verdict.why.starts_with("cannot be judged: ") && verdict.why.ends_with(reason), "{text}: {verdict:?}");
        assert_eq!((verdict.outcome, verdict.value, verdict.margin), (Outcome::Undecided, None, None));
    }
    let never = impact(&cell(spring(), 0.0, 0.016, 0.004), &[], -0.035, (FACILITY, SensorNoise::NONE, 1), None);
    let verdict = criterion("id = 'restitution'\nat_most = 1.0").judge(&Observation::of_axis(&never, &KNOWN));
    assert!(verdict.why.contains("no contact") || verdict.why.contains("in contact"), "{verdict:?}");
}

/// What an air-bearing table records: pose and force, neither velocity nor net force.
#[test]
fn restitution_from_positions_alone_is_that_of_the_velocities() {
    // The pose is that of the robots: without virtual damping its speeds are the satellites' 16 ms later.
    let trace = facility(0.0);
    let full = Observation::of_axis(&trace, &KNOWN);
    let mut table = full.clone();
    (table.along[0].after, table.along[0].before, table.along[0].feedback) = (None, None, None);
    for release in [Release::ZeroForce, Release::ZeroDepth] {
        let (one, other) = (speeds(&full, ObservedAxis::Z, release), speeds(&table, ObservedAxis::Z, release));
        let (one, other) = (one.unwrap().restitution.value, other.unwrap().restitution.value);
        // A hundred ticks of a line, each rounded to 1e-17 m over 0.1 s.
        assert!((one - other).abs() < 1e-12, "{release:?}: {one} {other}");
    }
}

#[test]
fn a_limit_passes_fails_or_is_left_open_by_the_noise() {
    let trace = facility(0.0);
    let run = Observation::of_axis(&trace, &Known { force_sd_n: Some(0.25), ..KNOWN });
    let peak = peak_force(&run, ObservedAxis::Z).unwrap();
    // P1: 9.1 N at 8.5 mm without delay (reference/PHYSICS.md, section 1.5), times the energy that the delay adds by then.
    assert!((9.1..9.1 * 1.12).contains(&peak.value.value), "{peak:?}");
    for (limit_n, outcome) in [(11.0, Outcome::Pass), (9.7, Outcome::Undecided), (9.0, Outcome::Fail)] {
        let verdict = criterion(&format!("id = 'peak-force'\nat_most_n = {limit_n:?}")).judge(&run);
        assert_eq!((verdict.outcome, verdict.at), (outcome, Some(peak.at)), "{verdict:?}");
        assert!((verdict.margin.unwrap() - (limit_n - peak.value.value)).abs() < 1e-12);
    }
    let deep = criterion("id = 'peak-depth'\nat_most_m = 0.008").judge(&run);
    assert_eq!((deep.outcome, deep.unit), (Outcome::Fail, "m"));
    for (text, bound) in [("at_least_s = 0.5", Bound::AtLeast), ("at_most_s = 2.0", Bound::AtMost)] {
        let verdict = criterion(&format!("id = 'contact-duration'\n{text}")).judge(&run);
        assert_eq!((verdict.outcome, verdict.bound), (Outcome::Pass, Some(bound)), "{verdict:?}");
    }
    let open = criterion("id = 'contact-duration'").judge(&run);
    assert!(open.outcome == Outcome::Undecided && open.why.starts_with("no limit is given"), "{open:?}");
}

#[test]
fn the_ideal_docking_is_not_distorted_and_delay_distorts_it() {
    let ideal = |of| Distortion {
        of,
        stiffness_n_per_m: STIFFNESS_N_PER_M,
        damping_n_s_per_m: 40.0,
        release: Release::ZeroForce,
        at_least: None,
        at_most: None,
    };
    let law = SpringDashpot { damping_n_s_per_m: 40.0, ..spring() };
    let step = Nanos(20_000);
    let fine = Rates { physics_step: step, loop_period: step, sensor_period: step, ..FACILITY };
    let undelayed = impact(&cell(law, 0.0, 0.0, 2e-5), &[], SPEED_M_PER_S, (fine, SensorNoise::NONE, 1), None);
    let delayed = impact(&cell(law, 0.0, 0.016, 0.004), &[], SPEED_M_PER_S, (FACILITY, SensorNoise::NONE, 1), None);
    let ratio = |trace, of| distortion(&Observation::of_axis(trace, &KNOWN), &ideal(of)).unwrap().value;
    for of in [DistortionOf::Restitution, DistortionOf::PeakForce] {
        // The held force is a step late: k T of damping, 0.02 N s/m, moves either by 0.006 of that.
        assert!((ratio(&undelayed, of) - 1.0).abs() < 2e-4, "{of:?}: {}", ratio(&undelayed, of));
        assert!(ratio(&delayed, of) > 1.04, "{of:?}: {}", ratio(&delayed, of));
    }
}

#[test]
fn a_prediction_agrees_contradicts_or_cannot_be_told() {
    let number = |value, sd| Estimate { value, sd: Some(sd) };
    assert_eq!(same_sign(number(1.0, 0.1), number(2.0, 0.5)), Answer::Agrees);
    assert_eq!(same_sign(number(1.0, 0.1), number(-2.0, 0.5)), Answer::Contradicts);
    assert_eq!(same_sign(number(1.0, 0.6), number(-2.0, 0.5)), Answer::CannotTell);
    assert_eq!(same_value(number(1.0, 0.0), number(1.4, 0.1), 0.7), Answer::Agrees);
    assert_eq!(same_value(number(1.0, 0.0), number(1.4, 0.1), 0.1), Answer::Contradicts);
    assert_eq!(same_value(number(1.0, 0.0), number(1.4, 0.1), 0.5), Answer::CannotTell);
    // Linear prediction of this sampled loop: 19.38 N s/m is neutral (reference/PHYSICS.md, correction 4).
    for (damping, outcome) in [(0.0, Outcome::Pass), (19.6, Outcome::Undecided), (70.0, Outcome::Pass)] {
        let trace = facility(damping);
        let run = Observation::of_axis(&trace, &Known { force_sd_n: Some(0.25), ..KNOWN });
        let predicted = damping - 19.38;
        let verdict = criterion(&format!("id = 'agreement'\nof = 'stability'\npredicted = {predicted:?}")).judge(&run);
        assert_eq!(verdict.outcome, outcome, "{verdict:?}");
        let wrong = criterion(&format!("id = 'agreement'\nof = 'stability'\npredicted = {:?}", -predicted)).judge(&run);
        assert_ne!(wrong.outcome, Outcome::Pass, "{wrong:?}");
        let found = observed_damping(&run, ObservedAxis::Z, Pairing::FeedbackWithSatelliteMean).unwrap().damping;
        // Effective damping is b - b_crit to first order in w τ = 0.07 .. 0.16.
        assert!((found.value - predicted).abs() < 0.16 * damping.max(19.38), "{damping}: {found:?}");
    }
    let damped = Damping { at_least_n_s_per_m: Some(20.0), ..Damping::default() };
    assert_eq!(damped.judge(&Observation::of_axis(&facility(70.0), &KNOWN)).outcome, Outcome::Pass);
}

/// Two ticks by hand: a force and a torque on the chaser, in the nozzle frame.
#[test]
fn an_axis_that_creates_energy_shows_where_the_sum_is_passive() {
    let moving = |v: f64, w: f64| Motion {
        velocity_m_per_s: Vector3::new(0.0, 0.0, v),
        rate_rad_per_s: Vector3::new(0.0, 0.0, w),
        ..Motion::default()
    };
    let load = |force: f64, torque: f64| Wrench {
        force_n: Vector3::new(0.0, 0.0, force),
        torque_n_m: Vector3::new(0.0, 0.0, torque),
    };
    let trace = Trace::<Spatial> {
        loop_time: vec![Nanos(0), Nanos(4_000_000)],
        commanded: vec![moving(0.05, 0.1), moving(0.03, 0.3)],
        after: vec![moving(0.03, 0.3), moving(0.01, 0.5)],
        // Against the motion along z; with the motion about it.
        feedback: vec![load(-10.0, 1.0), load(-10.0, 1.0)],
        // A sensor that reads twice the load, as its owner knows.
        sensor_time: vec![Nanos(0), Nanos(1_000_000)],
        sensed: vec![load(-20.0, 2.0), load(-20.0, 2.0)],
        ..Trace::default()
    };
    let run = Observation::of_spatial(&trace, &KNOWN, |reading, _| *reading * 0.5);
    let energies = energy_per_axis(&run, &[]).unwrap();
    let of = |axis| energies.iter().find(|energy| energy.axis == axis).unwrap();
    let (along, about) = (of(ObservedAxis::Z), of(ObservedAxis::AboutZ));
    // 10 N times 0.04 and 0.02 m/s, 1 N m times 0.2 and 0.4 rad/s, 4 ms each; rounding of four products.
    assert!((along.value_j - 0.0024).abs() < 1e-17 && (about.value_j + 0.0024).abs() < 1e-17, "{energies:?}");
    assert_eq!((along.activity, about.activity), (Activity::Passive, Activity::Active));
    assert_eq!(of(ObservedAxis::X).activity, Activity::Neutral);
    let felt = |axis| run.along(axis).unwrap().sensed.as_ref().unwrap()[1];
    let off = (felt(ObservedAxis::Z) - 10.0).abs() + (felt(ObservedAxis::AboutZ) + 1.0).abs();
    assert!(off < f64::EPSILON, "what resists is minus the load");
    for (text, outcome) in [
        // The sum of both is nothing: neither passive nor active.
        ("id = 'energy-per-axis'", Outcome::Undecided),
        ("id = 'energy-per-axis'\naxes = ['z', 'about-z']", Outcome::Fail),
        ("id = 'energy-per-axis'\naxes = ['z']", Outcome::Pass),
        // Nothing moves along x.
        ("id = 'energy-per-axis'\naxes = ['z', 'x']", Outcome::Undecided),
    ] {
        assert_eq!(criterion(text).judge(&run).outcome, outcome, "{text}");
    }
}

#[test]
fn a_list_of_criteria_is_refused_where_it_has_no_meaning() {
    for (text, reason) in [
        ("id = 'restitution'\nat_mots = 1.0", "unknown field `at_mots`"),
        ("id = 'restitutoin'", "unknown variant `restitutoin`"),
        ("id = 'peak-force'", "missing field `at_most_n`"),
        ("id = 'observed-energy'\nexpect = 'calm'", "unknown variant `calm`"),
        ("at_most = 1.0", "missing field `id`"),
    ] {
        let error = toml::from_str::<AnyCriterion>(text).unwrap_err().to_string();
        assert!(error.contains(reason), "{text}: {error}");
    }
    for (text, reason) in [
        ("id = 'restitution'\nat_least = 2.0\nat_most = 1.0", "at_least = 2 1 is above the upper limit"),
        ("id = 'peak-force'\nat_most_n = -1.0", "at_most_n = -1 N is not above 0"),
        ("id = 'contact-duration'\nat_most_s = nan", "at_most_s = NaN s is not a finite number"),
        ("id = 'observed-energy'\nmeasured_late_s = -0.016", "measured_late_s = -0.016 s is below 0"),
        ("id = 'agreement'\nof = 'damping'\npredicted = 1.0", "tolerance = 0 N s/m is what is left out"),
        ("id = 'energy-per-axis'\naxes = ['x', 'x']", "axes = 2 (place in the list) is named twice"),
    ] {
        let criterion: AnyCriterion = toml::from_str(text).unwrap();
        let refusal = criterion.check().unwrap_err().to_string();
        assert!(refusal.starts_with(reason), "{text}: {refusal}");
    }
    let list =
        "[[criterion]]\nid = 'restitution'\nrelease = 'zero-depth'\nat_most = 1\n[[criterion]]\nid = 'damping'\n";
    let parsed: std::collections::BTreeMap<String, Vec<AnyCriterion>> = toml::from_str(list).unwrap();
    let ids: Vec<&str> = parsed["criterion"].iter().map(Criterion::id).collect();
    assert_eq!(ids, ["restitution", "damping"]);
}
