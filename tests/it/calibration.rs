//! Calibration of a force/torque sensor through the command, on recordings whose truth is made here.

use crate::shell::Shell;
use harness::recording::{Grade, Kind, Pose, Series, Session, Wrench, write_mcap};
use sim_core::calibration::{Noise, StaticPose, Terms, calibrate, observe};
use sim_core::rng::Streams;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const G: f64 = 9.80665;
/// The truth: twelve kilogrammes, a bias, a centre of mass, one degree of misalignment about z.
const MASS_KG: f64 = 12.0;
const BIAS: [f64; 6] = [1.2, -0.7, 2.1, 0.05, -0.02, 0.01];
const CENTRE_M: [f64; 3] = [0.01, -0.02, 0.12];
const TURN_Z_RAD: f64 = 0.0175;
/// Noise of the mean of a pose, as in reference/PHYSICS.md, section 5.
const FORCE_SIGMA_N: f64 = 0.25;
const TORQUE_SIGMA_N_M: f64 = 0.02;

/// Turned about an axis of the nozzle: x = 0, y = 1, z = 2.
fn about(axis: usize, angle: f64) -> [f64; 4] {
    let mut q = [0.0, 0.0, 0.0, libm::cos(angle / 2.0)];
    q[axis] = libm::sin(angle / 2.0);
    q
}

/// One turn after another one: the product of two quaternions x, y, z, w.
fn after(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Gravity along -y of the nozzle, seen from an attitude: v' = q* v q.
fn down_in(q: [f64; 4]) -> [f64; 3] {
    let conjugate = [-q[0], -q[1], -q[2], q[3]];
    let seen = after(after(conjugate, [0.0, -G, 0.0, 0.0]), q);
    [seen[0], seen[1], seen[2]]
}

/// What the sensor reads at rest in this attitude, without noise.
fn reading(q: [f64; 4]) -> [f64; 6] {
    let down = down_in(q);
    let (sin, cos) = libm::sincos(TURN_Z_RAD);
    let weight = [cos * down[0] - sin * down[1], sin * down[0] + cos * down[1], down[2]].map(|part| part * MASS_KG);
    let torque = cross(CENTRE_M, weight);
    std::array::from_fn(|i| BIAS[i] + if i < 3 { weight[i] } else { torque[i - 3] })
}

/// A recording that stands 1.2 s in each attitude and moves 0.4 s in between; each pose has its own error, each sample noise.
fn recording(attitudes: &[[f64; 4]], seed: u64) -> Session {
    let mut stream = Streams::new(seed).named("test");
    let mut measured = Series { time_ns: Vec::new(), value: Vec::new() };
    let mut sensed = Series { time_ns: Vec::new(), value: Vec::new() };
    for (nth, q) in attitudes.iter().enumerate() {
        let truth = reading(*q);
        let sigma = |i: usize| if i < 3 { FORCE_SIGMA_N } else { TORQUE_SIGMA_N_M };
        let settled: [f64; 6] = std::array::from_fn(|i| truth[i] + sigma(i) * stream.normal());
        for ms in 0..1600 {
            let time_ns = (nth as i64 * 1600 + ms) * 1_000_000;
            let moves = ms >= 1200;
            if ms % 4 == 0 {
                // Between two poses it turns fast; where to does not matter.
                let turned = if moves { after(*q, about(0, (ms - 1190) as f64 * 1e-3)) } else { *q };
                measured.time_ns.push(time_ns);
                measured.value.push(Pose { position_m: [0.0, 0.0, -0.15], orientation_xyzw: turned });
            }
            // In motion, and just after it, the reading is anything: it must not be used.
            let shake = if moves || ms < 150 { 20.0 } else { 0.0 };
            let sample: [f64; 6] = std::array::from_fn(|i| settled[i] + 0.2 * sigma(i) * stream.normal() + shake);
            sensed.time_ns.push(time_ns);
            let [fx, fy, fz, tx, ty, tz] = sample;
            sensed.value.push(Wrench { force_n: [fx, fy, fz], torque_n_m: [tx, ty, tz] });
        }
    }
    Session {
        file: PathBuf::from("poses.mcap"),
        sha256: String::new(),
        start_ns: 1_770_000_000_000_000_000,
        kind: Kind::Static,
        believed: BTreeMap::new(),
        commanded: Some(measured.clone()),
        measured: Some(measured),
        twist: None,
        sensed: Some(sensed),
        applied: None,
        grade: Grade::A,
        findings: Vec::new(),
    }
}

fn save(session: &Session, path: &Path) {
    let mut out = std::io::Cursor::new(Vec::new());
    write_mcap(session, &mut out).unwrap();
    std::fs::write(path, out.into_inner()).unwrap();
}

/// Random attitudes, evenly over all turns.
fn random_attitudes(count: usize) -> Vec<[f64; 4]> {
    let mut stream = Streams::new(36).named("attitudes");
    let one = |_| {
        let q: [f64; 4] = std::array::from_fn(|_| stream.normal());
        let length = libm::sqrt(q.iter().map(|part| part * part).sum());
        q.map(|part| part / length)
    };
    (0..count).map(one).collect()
}

fn sweep(count: usize, half_deg: f64) -> Vec<[f64; 4]> {
    let angle = |nth: usize| half_deg.to_radians() * (2.0 * nth as f64 / (count - 1) as f64 - 1.0);
    (0..count).map(|nth| about(0, angle(nth))).collect()
}

/// Five standard deviations of each number: of thirteen, one in 10⁵ runs would fail; this seed does not change.
fn within(found: &serde_json::Value, truth: &[f64]) {
    let numbers = found["numbers"].as_array().unwrap();
    assert_eq!(numbers.len(), truth.len());
    for (number, truth) in numbers.iter().zip(truth) {
        let (value, deviation) = (number["value"].as_f64().unwrap(), number["deviation"].as_f64().unwrap());
        assert!((value - truth).abs() < 5.0 * deviation, "{number}, truth {truth}");
    }
}

#[test]
fn thirty_six_poses_in_a_recording_become_a_section_of_the_model() {
    let shell = Shell::with_model();
    save(&recording(&random_attitudes(36), 1), &shell.path("poses.mcap"));
    let before = shell.read("m.toml").replace("[sensor]", "# mine\n[sensor]");
    shell.write("m.toml", &before);
    let args = ["calibrate", "ft", "DIR/poses.mcap", "--model", "DIR/m.toml", "--json", "DIR/ft.json"];
    let ran = shell.run(&args);
    assert_eq!((ran.exit, ran.err.as_str()), (0, "DIR/ft.json: written\n"), "{}", ran.out);
    assert!(ran.out.ends_with("tool_mass_kg and bias_n written to DIR/m.toml\n"), "{}", ran.out);
    assert!(ran.out.starts_with("36 poses at rest, 36 directions of gravity"), "{}", ran.out);
    assert!(
        ran.out.contains("more attitudes would help little") && ran.out.contains("residuals: white"),
        "{}",
        ran.out
    );
    let found: serde_json::Value = serde_json::from_str(&shell.read("ft.json")).unwrap();
    let [fx, fy, fz, tx, ty, tz] = BIAS;
    let [rx, ry, rz] = CENTRE_M;
    within(&found, &[fx, fy, fz, tx, ty, tz, MASS_KG, rx, ry, rz, 0.0, 0.0, TURN_Z_RAD]);
    assert!(found["iterations"].as_u64().unwrap() <= 4);
    // The noise is read from 216 readings less 13 numbers: 5 % each, four of them.
    let sigma_n = found["force_sigma_n"].as_f64().unwrap();
    assert!((sigma_n / FORCE_SIGMA_N - 1.0).abs() < 0.3, "{sigma_n}");
    let text = shell.read("m.toml");
    assert!(text.contains("# mine\n[sensor]") && text.contains("[sensor.calibration]"), "{text}");
    let model = harness::model::Model::parse("m.toml", &text, &sim_core::effects::standard()).unwrap();
    let section = model.sensor.calibration.as_ref().unwrap();
    assert_eq!(section.tool_mass_kg.to_bits(), model.sensor.tool_mass_kg.to_bits());
    assert_eq!(section.bias_force_n[2].to_bits(), model.sensor.bias_n.to_bits());
    // The reader of JSON is right to the last digit but one.
    assert!((section.tool_mass_kg - found["numbers"][6]["value"].as_f64().unwrap()).abs() < 1e-14);
    assert!(section.source.contains("36 poses at rest in DIR") || section.source.contains("poses.mcap"), "{section:?}");
    shell.refuses(
        &args[..5],
        "  × DIR/m.toml: [sensor.calibration]: holds a calibration already and was left as it is\n  help: replace it with --force\n",
    );
    let again = shell.run(&[&args[..5], &["--force"]].concat());
    assert_eq!((again.exit, shell.read("m.toml")), (0, text), "the same recording gives the same section");
}

/// A force that ramps by 5 N while the robot stands is no reading of a weight, and nothing is written; and poses at rest need no command.
#[test]
fn a_force_that_drifts_in_a_pose_decides_nothing() {
    let shell = Shell::with_model();
    let mut session = recording(&random_attitudes(36), 3);
    session.commanded = None;
    save(&session, &shell.path("steady.mcap"));
    let ran = shell.run(&["calibrate", "ft", "DIR/steady.mcap"]);
    assert_eq!(ran.exit, 0, "{}{}", ran.out, ran.err);
    let sensed = session.sensed.as_mut().unwrap();
    for (wrench, time_ns) in sensed.value.iter_mut().zip(&sensed.time_ns) {
        wrench.force_n[2] += 5.0 * (time_ns % 1_600_000_000) as f64 / 1.2e9;
    }
    save(&session, &shell.path("ramp.mcap"));
    let ran = shell.run(&["calibrate", "ft", "DIR/ramp.mcap", "--model", "DIR/m.toml"]);
    assert_eq!(ran.exit, 3, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("the mean force moves by") && ran.out.contains("not written"), "{}", ran.out);
}

/// A sensor that is known to a millinewton is not 'known to 0.00 N'; and a recording that was cut says so.
#[test]
fn small_numbers_keep_their_digits_and_a_cut_recording_its_grade() {
    let shell = Shell::new();
    save(&recording(&random_attitudes(36), 5), &shell.path("poses.mcap"));
    let args = ["calibrate", "ft", "DIR/poses.mcap", "--force-sigma-n=0.0005", "--torque-sigma-n-m=0.00005"];
    let ran = shell.run(&args);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    assert!(ran.out.contains("a predicted force is known to ") && !ran.out.contains(" 0.00 N"), "{}", ran.out);
    assert!(!ran.out.contains("grade"), "{}", ran.out);
    let whole = std::fs::read(shell.path("poses.mcap")).unwrap();
    std::fs::write(shell.path("cut.mcap"), &whole[..whole.len() * 4 / 5]).unwrap();
    let ran = shell.run(&["calibrate", "ft", "DIR/cut.mcap"]);
    assert!(
        ran.exit != 2 && ran.out.contains("cut.mcap: grade B, cut off, recovered as far as it goes"),
        "{} {}",
        ran.out,
        ran.err
    );
}

/// Poses at rest say themselves what was recorded: no kind is asked for.
#[test]
fn a_recording_without_a_record_is_calibrated_from() {
    let shell = Shell::new();
    save(&recording(&random_attitudes(12), 6), &shell.path("poses.mcap"));
    let whole = std::fs::read(shell.path("poses.mcap")).unwrap();
    let bare = crate::recording::messages_alone(&whole, "ros2msg", |_, time| time);
    std::fs::write(shell.path("bare.mcap"), bare).unwrap();
    let (named, bare) =
        (shell.run(&["calibrate", "ft", "DIR/poses.mcap"]), shell.run(&["calibrate", "ft", "DIR/bare.mcap"]));
    assert_eq!((bare.exit, bare.out.as_str()), (0, named.out.as_str()), "{}", bare.err);
}

/// The figures of reference/PHYSICS.md, section 5: a sweep of ± 30 degrees leaves one axis ten times worse.
#[test]
fn a_narrow_sweep_is_told_which_poses_to_add() {
    let shell = Shell::with_model();
    let before = shell.read("m.toml");
    save(&recording(&sweep(36, 30.0), 2), &shell.path("sweep.mcap"));
    let ran = shell.run(&["calibrate", "ft", "DIR/sweep.mcap", "--model", "DIR/m.toml"]);
    assert_eq!((ran.exit, ran.err.as_str()), (3, ""), "{}", ran.out);
    assert!(ran.out.ends_with("[sensor.calibration] not written to DIR/m.toml: not decided\n"), "{}", ran.out);
    assert_eq!(shell.read("m.toml"), before);
    let numbers = shell.run(&["calibrate", "ft", "DIR/sweep.mcap", "--model", "DIR/m.toml", "--json", "-"]);
    assert!(numbers.exit == 3 && numbers.err.contains("not written to DIR/m.toml"), "{}", numbers.err);
    assert!(ran.out.contains("attitudes within ±30 degrees leave the bias along x at 0."), "{}", ran.out);
    assert!(ran.out.contains(": add poses\n  add: gravity along ("), "{}", ran.out);
    // What was proposed is added: gravity turned over.
    let mut more = sweep(36, 30.0);
    more.extend([about(0, std::f64::consts::PI), about(2, std::f64::consts::FRAC_PI_2), about(2, -2.0)]);
    save(&recording(&more, 2), &shell.path("more.mcap"));
    let ran = shell.run(&["calibrate", "ft", "DIR/more.mcap", "--json", "-"]);
    assert_eq!(ran.exit, 0, "{}", ran.out);
    let found: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(found["observability"]["directions"], 39);
}

#[test]
fn what_cannot_be_calibrated_from_is_refused_with_what_to_do() {
    let shell = Shell::with_model();
    let fixture = |name: &str| fixtures::session("cell-a", name).display().to_string();
    let (rest, flight) = (fixture("static.mcap"), fixture("excite.mcap"));
    shell.refuses(
        &["calibrate", "ft", &rest, "--model", "DIR/m.toml"],
        &format!(
            "  × {rest}: 1 distinct directions of gravity, at least 3 are needed; 1 poses at rest were found\n  help: add poses in \
             which gravity points elsewhere in the sensor: about one axis by 60 degrees and by -60 degrees, then about another; \
             a turn about the vertical shows nothing\n"
        ),
    );
    shell.refuses(
        &["calibrate", "ft", &flight],
        &format!(
            "  × {flight}: 0 distinct directions of gravity, at least 3 are needed; 0 poses at rest were found\n  help: record the \
             robot standing for a second in each of several attitudes\n"
        ),
    );
    // Three turns about the vertical are one direction of gravity.
    let upright: Vec<[f64; 4]> = [0.0, 1.0, 2.0].map(|angle| about(1, angle)).to_vec();
    save(&recording(&upright, 3), &shell.path("upright.mcap"));
    let ran = shell.run(&["calibrate", "ft", "DIR/upright.mcap"]);
    assert!(ran.exit == 2 && ran.err.contains("1 distinct directions"), "{}", ran.err);
    save(&recording(&random_attitudes(12), 4), &shell.path("a.mcap"));
    let ran = shell.run(&["calibrate", "ft", "DIR/a.mcap", "--temperature"]);
    assert!(ran.exit == 2 && ran.err.contains("[believed] ft_temperature_c"), "{}", ran.err);
    let ran = shell.run(&["calibrate", "ft", "DIR/a.mcap", "DIR/a.mcap"]);
    assert!(ran.exit == 2 && ran.err.contains("it would count twice"), "{}", ran.err);
    let ran = shell.run(&["calibrate", "ft", "DIR/a.mcap", "--force-sigma-n", "-1", "--torque-sigma-n-m", "0.02"]);
    assert!(ran.exit == 2, "{}", ran.err);
    let ran = shell.run(&["calibrate", "ft", "DIR/a.mcap", "--force-sigma-n=0", "--torque-sigma-n-m=0.02"]);
    assert!(ran.exit == 2 && ran.err.contains("force_sigma_n = 0 N is not above 0"), "{}", ran.err);
    let ran = shell.run(&["calibrate", "ft", "DIR/a.mcap", "--json", "DIR/a.mcap"]);
    assert!(ran.exit == 2 && ran.err.contains("would be overwritten"), "{}", ran.err);
}

/// Crosstalk between fx and fy and a drift with temperature, in four recordings; and a section that holds both.
#[test]
fn crosstalk_and_temperature_go_into_the_model() {
    let shell = Shell::with_model();
    let mut args = vec!["calibrate", "ft", "--crosstalk", "--temperature", "--model", "DIR/m.toml"];
    let names = ["DIR/0.mcap", "DIR/1.mcap", "DIR/2.mcap", "DIR/3.mcap"];
    let attitudes = random_attitudes(48);
    for (nth, name) in names.iter().enumerate() {
        let mut session = recording(&attitudes[nth * 12..nth * 12 + 12], 10 + nth as u64);
        let warmer_k = 5.0 * nth as f64;
        for wrench in &mut session.sensed.as_mut().unwrap().value {
            // 0.1 N/K along x.
            wrench.force_n[0] += 0.1 * warmer_k;
        }
        session.believed.insert("ft_temperature_c".to_owned(), format!("{}", 20.0 + warmer_k));
        save(&session, &shell.path(&name[4..]));
        args.push(name);
    }
    let ran = shell.run(&args);
    assert_eq!((ran.exit, ran.err.as_str()), (0, ""), "{}", ran.out);
    let model = harness::model::Model::parse("m.toml", &shell.read("m.toml"), &sim_core::effects::standard()).unwrap();
    let section = model.sensor.calibration.unwrap();
    let temperature = section.temperature.unwrap();
    assert!((temperature.reference_c - 27.5).abs() < 1e-9, "{temperature:?}");
    // 48 poses, 0.25 N, temperatures with a standard deviation of 5.6 K: 0.25 / (5.6 √48) = 6.4 mN/K; five of them.
    assert!((temperature.bias_force_n_per_k[0] - 0.1).abs() < 0.033, "{temperature:?}");
    // None was put in: 0.25 N of 118 N over √(48/3) poses is 0.5 ‰; five of them.
    let crosstalk = section.crosstalk.unwrap();
    assert!(crosstalk[0][1].abs() < 0.003 && crosstalk[0][3].abs() < 1e-12, "{crosstalk:?}");
    let plain = shell.run(&["calibrate", "ft", "DIR/0.mcap", "--model", "DIR/m.toml", "--force"]);
    assert_eq!(plain.exit, 0, "{}", plain.err);
    let text = shell.read("m.toml");
    assert!(!text.contains("crosstalk =") && !text.contains("temperature ="), "of another calibration: {text}");
}

#[test]
fn a_mistake_in_a_calibration_is_shown_at_its_place() {
    let shell = Shell::with_model();
    let text = shell.read("m.toml");
    let own = harness::model::Model::parse("m.toml", &text, &sim_core::effects::standard()).unwrap().sensor;
    let section = format!(
        "\n[sensor.calibration]\nbias_force_n = [0, 0, {}]\nbias_torque_n_m = [0, 0, 0]\ntool_mass_kg = {}\n\
         centre_of_mass_m = [0, 0, 0.1]\n",
        own.bias_n, own.tool_mass_kg
    );
    shell.write("m.toml", &(text.clone() + &section));
    let ran = shell.run(&["model", "check", "DIR/m.toml"]);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    // One of two equal numbers was edited.
    let other = format!("= [0, 0, {}]", own.bias_n + 2.5);
    let bias = section.replace(&format!("= [0, 0, {}]", own.bias_n), &other);
    let mass = section.replace(
        &format!("tool_mass_kg = {}", own.tool_mass_kg),
        &format!("tool_mass_kg = {}", own.tool_mass_kg + 0.5),
    );
    for (wrong, expected) in [(bias, "sensor.bias_n = "), (mass, "sensor.tool_mass_kg = ")] {
        shell.write("m.toml", &(text.clone() + &wrong));
        let ran = shell.run(&["model", "check", "DIR/m.toml"]);
        assert!(ran.exit == 2 && ran.err.contains(expected), "{}", ran.err);
        assert!(
            ran.err.contains("contradicts sensor.calibration") && ran.err.contains("calibrate anew"),
            "{}",
            ran.err
        );
        assert!(ran.err.contains("m.toml:"), "the place: {}", ran.err);
    }
    // Along x it is another component that counts; four digits of a number are that number.
    let along_x =
        section.replace(&format!("= [0, 0, {}]", own.bias_n), &format!("= [{}, 0, 7]\ntravel = \"x\"", own.bias_n));
    let along_x = along_x.replace(
        &format!("tool_mass_kg = {}", own.tool_mass_kg),
        &format!("tool_mass_kg = {}", own.tool_mass_kg * 1.0004),
    );
    shell.write("m.toml", &(text.clone() + &along_x));
    let ran = shell.run(&["model", "check", "DIR/m.toml"]);
    assert_eq!(ran.exit, 0, "{}", ran.err);
    shell.write("m.toml", &(text + &section.replace("\ntool_mass_kg = ", "\ntool_mass_kg = -")));
    let ran = shell.run(&["model", "check", "DIR/m.toml"]);
    assert!(ran.exit == 2 && ran.err.contains("sensor.calibration.tool_mass_kg = -"), "{}", ran.err);
    assert!(ran.err.contains("is not above 0") && ran.err.contains("│ tool_mass_kg = -"), "{}", ran.err);
}

/// Data that stay outside the project; says aloud when they are not there.
fn shared(path: &str) -> Option<PathBuf> {
    let root = std::env::var_os("DOCKHIL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let found = root.join(path);
    if !found.exists() {
        eprintln!("skipped: {} is missing; set DOCKHIL_SHARED", found.display());
        return None;
    }
    Some(found)
}

/// The numbers in the brackets behind `key:` of a file in YAML.
fn yaml(text: &str, key: &str) -> Option<Vec<f64>> {
    let rest = text.split(&format!("\n{key}: ")).nth(1)?;
    let inner = rest.trim_start().strip_prefix('[').and_then(|rest| rest.split(']').next());
    let inner = inner.unwrap_or(rest.lines().next()?);
    inner.split(',').map(|part| part.trim().parse().ok()).collect()
}

/// A real arm (KTH, force_torque_tools): 35 poses and the result of their calibration. Their readings are not in the folder, nor is
/// the direction of gravity in the frame of the arm's base, which they took from an accelerometer. So what can be reproduced is:
/// that their poses determine all that they state, whichever way the base is mounted; that readings made from their result
/// give it back; and what it was worth. The numbers themselves cannot be derived anew, and their model has no misalignment.
#[test]
fn the_real_poses_determine_the_real_result() {
    let Some(folder) = shared("data/protocols/kth_ft_calib") else { return };
    let read = |name: &str| format!("\n{}", std::fs::read_to_string(folder.join(name)).unwrap());
    let (result, asked) = (read("ft_calib_data_example.yaml"), read("example_ft_calib_params.yaml"));
    let poses: Vec<Vec<f64>> = (0..).map_while(|nth| yaml(&asked, &format!("pose{nth}"))).collect();
    assert_eq!(poses.len(), 35);
    let (bias, mass_kg) = (yaml(&result, "bias").unwrap(), yaml(&result, "gripper_mass").unwrap()[0]);
    let centre = yaml(&result, "gripper_com_pose").unwrap();
    assert!((mass_kg - 1.695).abs() < 1e-3 && (centre[2] - 0.0791).abs() < 1e-4 && (bias[1] + 11.63).abs() < 0.01);
    let noise = Noise { force_sigma_n: 0.25, torque_sigma_n_m: 0.02 };
    let (mut worst, mut best) = (0.0_f64, f64::INFINITY);
    for base in sim_core::calibration::observability::even(60) {
        let reading = |pose: &Vec<f64>| {
            // Fixed axes: roll about x, then pitch about y, then yaw about z.
            let q = after(about(2, pose[5]), after(about(1, pose[4]), about(0, pose[3])));
            let conjugate = [-q[0], -q[1], -q[2], q[3]];
            let seen = after(after(conjugate, [base.x * G, base.y * G, base.z * G, 0.0]), q);
            let weight = [seen[0], seen[1], seen[2]].map(|part| part * mass_kg);
            let torque = cross([centre[0], centre[1], centre[2]], weight);
            StaticPose {
                gravity_m_per_s2: [seen[0], seen[1], seen[2]].into(),
                force_n: std::array::from_fn(|i| weight[i] + bias[i]).into(),
                torque_n_m: std::array::from_fn(|i| torque[i] + bias[i + 3]).into(),
                warmer_k: 0.0,
            }
        };
        let readings: Vec<StaticPose> = poses.iter().map(reading).collect();
        let found = calibrate(&readings, noise, Terms::USUAL).unwrap();
        assert!(found.steps.len() <= 4, "{:?}", found.steps);
        let parameters = found.parameters;
        // Rounding of 1e-16 × 17 N, and at most a thousand times that for the condition of the poses.
        assert!((parameters.mass_kg - mass_kg).abs() < 1e-12 && parameters.misalignment_rad().norm() < 1e-12);
        for axis in 0..3 {
            assert!((parameters.bias_force_n[axis] - bias[axis]).abs() < 1e-12);
            assert!((parameters.bias_torque_n_m[axis] - bias[axis + 3]).abs() < 1e-12);
            assert!((parameters.centre_m[axis] - centre[axis]).abs() < 1e-12);
        }
        let seen = observe(&found, &readings);
        (worst, best) = (worst.max(seen.anywhere_n / seen.even_n), best.min(seen.anywhere_n / seen.even_n));
        assert!(seen.is_enough(), "{base}: {seen:?}");
    }
    eprintln!("KTH poses: the error of a predicted force is {best:.2} to {worst:.2} times that of even poses");
}
