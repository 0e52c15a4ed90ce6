//! The page of a diagnosis, from a made-up answer: a hardening spring that the model lacks.
//!
//! `the_page_holds_every_section` leaves `story.html` and `story.txt` in `CARGO_TARGET_TMPDIR`, to be looked at.

use harness::diagnose::answer::{
    BaseParameter, Cell, Curves, Diagnosis, Estimate, Group, Ladder, LadderChannel, LadderStep, Rank, SessionNote,
    TestScore, Verdict,
};
use harness::diagnose::noise::Noise;
use harness::diagnose::quality::{Channel, Phase};
use harness::diagnose::software::Software;
use harness::recording::{Grade, Kind};
use harness::report::story::{diagnosis, ladder_page};
use harness::report::{Page, Section, Tone, html, text};
use sim_core::effects::standard;
use std::collections::BTreeMap;

const STIFFNESS_N_PER_M: f64 = 1066.0;
const CUBIC_N_PER_M3: f64 = 9.1e6;
pub const FORCE_SIGMA_N: f64 = 0.25;
pub const POSITION_SIGMA_M: f64 = 5e-5;
const FORBIDDEN: [&str; 4] = ["validated", "accurate", "100 %", "100%"];

/// Noise without a generator crate: an integer hash in [-1, 1], scaled to unit variance.
fn noise(index: usize, stream: usize) -> f64 {
    let mut word = (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (stream as u64 + 7) << 32;
    word = (word ^ word >> 31).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    (((word ^ word >> 29) >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * 3f64.sqrt()
}

/// One impact of 63 kg: 1.5 s approach, then the hardening spring, 4 s in all.
pub fn impact(file: &str, role: &'static str, speed_m_per_s: f64, stream: usize) -> Curves {
    let (mut depth_m, mut speed) = (-1.5 * speed_m_per_s, speed_m_per_s);
    let mut curves = Curves {
        file: file.into(),
        role,
        contact_s: None,
        sensor_time_s: Vec::new(),
        force_measured_n: Vec::new(),
        force_before_n: Vec::new(),
        force_after_n: Vec::new(),
        depth_m: Vec::new(),
        loop_time_s: Vec::new(),
        position_measured_m: Vec::new(),
        position_before_m: Vec::new(),
        position_after_m: Vec::new(),
    };
    for tick in 0..4000 {
        let time_s = tick as f64 * 1e-3;
        let inside = depth_m.max(0.0);
        let linear = STIFFNESS_N_PER_M * inside + if inside > 0.0 { 40.0 * speed } else { 0.0 };
        let force = linear + CUBIC_N_PER_M3 * inside * inside * inside;
        if inside > 0.0 {
            curves.contact_s = Some((curves.contact_s.map_or(time_s, |(first, _)| first), time_s));
        }
        curves.sensor_time_s.push(time_s);
        curves.depth_m.push(depth_m);
        curves.force_measured_n.push(force + FORCE_SIGMA_N * noise(tick, stream));
        curves.force_before_n.push(linear);
        curves.force_after_n.push(force * 1.002);
        if tick % 4 == 0 {
            curves.loop_time_s.push(time_s);
            curves.position_measured_m.push(depth_m + POSITION_SIGMA_M * noise(tick, stream + 50));
            curves.position_before_m.push(depth_m);
            curves.position_after_m.push(depth_m);
        }
        speed -= force / 63.0 * 1e-3;
        depth_m += speed * 1e-3;
    }
    curves
}

fn all_curves() -> Vec<Curves> {
    vec![
        impact("impact-03.mcap", "learn", 0.020, 1),
        impact("impact-04.mcap", "learn", 0.030, 2),
        impact("impact-07.mcap", "test", 0.025, 3),
        impact("impact-08.mcap", "test", 0.030, 4),
    ]
}

fn estimates(pairs: &[(&str, f64, f64)]) -> BTreeMap<String, Estimate> {
    pairs.iter().map(|(name, value, sd)| ((*name).to_owned(), Estimate { value: *value, sd: *sd })).collect()
}

fn groups() -> Vec<Group> {
    vec![
        Group {
            effects: vec!["stiffness-hardening".into(), "stiffness-power-law".into()],
            alternatives: vec![vec!["stiffness-hardening".into()], vec!["stiffness-power-law".into()]],
            parameters: BTreeMap::from([("stiffness-hardening".into(), estimates(&[("cubic_n_per_m3", 9.1e6, 3e5)]))]),
            held_out_gain: 1834.2,
            reason: "the missing force grows with the third power of the depth, in and out alike".into(),
            splitting_experiment: "impacts at rising speed, up to the deepest travel that is allowed".into(),
        },
        Group {
            effects: vec!["force-lag".into()],
            alternatives: vec![vec!["force-lag".into()]],
            parameters: BTreeMap::from([(
                "force-lag".into(),
                estimates(&[("corner_frequency_hz", 28.9, 1.3), ("order", 1.0, 0.0)]),
            )]),
            held_out_gain: 41.7,
            reason: "the reading trails the force and rounds its onset, and its noise is coloured".into(),
            splitting_experiment:
                "a tap on the sensor at rest: a low-pass rounds the edge, a transport delay only shifts it".into(),
        },
    ]
}

fn note(file: &str, role: &'static str, kind: Kind) -> SessionNote {
    let closed = Software { closure_m: Some(2.2e-14), ..Software::not_examined() };
    SessionNote {
        file: file.into(),
        role,
        kind,
        grade: Grade::A,
        sha256: format!("{:064x}", file.len() as u128 * 0x1234_5678_9abc_def0_1234),
        odd: false,
        notes: Vec::new(),
        software: (kind == Kind::Impact).then_some(closed),
        nuisance: (kind == Kind::Impact).then_some([0.012, -0.004, 0.021]),
    }
}

fn sessions() -> Vec<SessionNote> {
    let mut sessions = vec![
        note("static-01.mcap", "aux", Kind::Static),
        note("impact-03.mcap", "learn", Kind::Impact),
        note("impact-04.mcap", "learn", Kind::Impact),
        note("impact-05.mcap", "learn", Kind::Impact),
        note("impact-07.mcap", "test", Kind::Impact),
        note("impact-08.mcap", "test", Kind::Impact),
    ];
    sessions[3].odd = true;
    sessions[3].grade = Grade::D;
    sessions[3].notes = vec!["stamps of the force stream are 3 ms late".into(), "12 samples were missing".into()];
    sessions[3].software = sessions[3].software.take().map(|software| Software {
        closure_m: Some(3.24e-6),
        closure_found_m: Some(4.1e-14),
        clock_offset_s: 0.003,
        ..software
    });
    sessions
}

fn map() -> Vec<Cell> {
    let force =
        [(1.02, 1.01, 320), (1.84, 1.05, 18), (6.91, 1.08, 96), (7.42, 1.13, 96), (2.11, 1.02, 30), (0.98, 0.98, 260)];
    let position =
        [(1.00, 1.00, 320), (0.97, 0.97, 18), (1.03, 1.02, 96), (1.01, 1.01, 96), (0.92, 0.92, 30), (1.04, 1.04, 260)];
    let of = |channel: Channel, cells: [(f64, f64, usize); 6]| {
        let row = cells.into_iter().zip(Phase::ALL);
        row.map(move |((before, after, blocks), phase)| Cell { phase, channel, before, after, blocks })
    };
    of(Channel::Force, force).chain(of(Channel::Position, position)).collect()
}

fn ranking() -> Vec<Rank> {
    let rank = |step: usize, effect: &str, gain: f64, held_out_gain: Option<f64>, wins: usize, accepted: bool| Rank {
        step,
        effect: effect.into(),
        gain,
        held_out_gain,
        wins,
        of: 3,
        accepted,
    };
    vec![
        rank(1, "stiffness-hardening", 1850.1, Some(1834.2), 3, true),
        rank(1, "stiffness-power-law", 1848.7, Some(1830.9), 3, false),
        rank(1, "end-stop", 911.0, Some(402.8), 2, false),
        rank(1, "contact-gap", 120.4, None, 0, false),
        rank(2, "force-lag", 44.0, Some(41.7), 3, true),
        rank(2, "hysteresis", 12.9, Some(-3.1), 1, false),
    ]
}

fn answer(verdict: Verdict) -> Diagnosis {
    let base = |nominal: f64, fitted: f64, sd: f64, wrong: bool| BaseParameter {
        nominal,
        fitted,
        sd,
        wrong,
        looks_like: Vec::new(),
    };
    let size = |name: &str, size: f64| BTreeMap::from([(name.to_owned(), size)]);
    Diagnosis {
        schema: 1,
        verdict,
        sentences: vec![
            "The recorded contact force grows faster than the depth: a cubic stiffness of 9.1e6 ± 0.3e6 N/m³ is missing."
                .into(),
            "It holds on recordings that it was not fitted to, and takes the force error from 0.724 N to 0.251 N.".into(),
        ],
        groups: groups(),
        base_parameters: BTreeMap::from([
            ("stiffness_n_per_m".into(), base(1066.0, 1071.3, 4.2, false)),
            ("damping_n_s_per_m".into(), base(40.0, 46.7, 1.3, true)),
        ]),
        not_visible_below: BTreeMap::from([
            ("contact-gap".into(), size("gap_m", 3.14e-5)),
            ("coulomb-friction".into(), size("force_n", 0.0421)),
            ("force-scale".into(), size("scale_ratio", 0.00412)),
            ("robot-second-order".into(), size("natural_frequency_hz", 41.94)),
        ]),
        sessions: sessions(),
        misfit_before: 3.37,
        misfit_after: 1.04,
        test: BTreeMap::from([
            ("force_z_n", TestScore { before: 0.7241, after: 0.2512, noise_floor: 0.25, unit: "N" }),
            ("measured_z_m", TestScore { before: 5.03e-5, after: 5.02e-5, noise_floor: 5e-5, unit: "m" }),
        ]),
        map: map(),
        ranking: ranking(),
        noise: Noise {
            slow_memory: 0.95,
            average: -0.9,
            innovation_n: 0.25,
            force_floor_n: FORCE_SIGMA_N,
            position_floor_m: POSITION_SIGMA_M,
            learned: true,
            excess: 0.0,
        },
        scatter: [[0.03, 0.012], [0.01, 0.008], [0.03, 0.026]],
    }
}

fn ladder() -> Ladder {
    let step = |label: &str, rms: f64, floor: f64, spread: f64| LadderStep {
        label: label.into(),
        rms,
        excess: (rms * rms - floor * floor).max(0.0).sqrt(),
        per_session: vec![rms - spread, rms + spread],
    };
    let force = vec![
        step("nominal", 0.7241, 0.25, 0.11),
        step("+ stiffness-hardening", 0.2683, 0.25, 0.004),
        step("+ force-lag", 0.2512, 0.25, 0.002),
    ];
    let position = vec![
        step("nominal", 5.03e-5, 5e-5, 4e-7),
        step("+ stiffness-hardening", 5.02e-5, 5e-5, 4e-7),
        step("+ force-lag", 5.02e-5, 5e-5, 4e-7),
    ];
    Ladder {
        schema: 1,
        channels: BTreeMap::from([
            ("force_z_n", LadderChannel { unit: "N", noise_floor: 0.25, steps: force }),
            ("measured_z_m", LadderChannel { unit: "m", noise_floor: 5e-5, steps: position }),
        ]),
        sessions: vec!["impact-07.mcap".into(), "impact-08.mcap".into()],
    }
}

fn provenance() -> Vec<(String, String)> {
    let pairs = [("model", "nominal.toml"), ("model sha256", "3f9c1e"), ("dockhil", "0.1.0"), ("seed", "20261122")];
    pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).to_vec()
}

const COMMAND: &str = "dockhil diagnose recordings/ --model nominal.toml";

fn page(verdict: Verdict) -> Page {
    diagnosis(&answer(verdict), &all_curves(), Some(&ladder()), &standard(), COMMAND, &provenance())
}

pub fn check_words(written: &str) {
    let lower = written.to_lowercase();
    for word in FORBIDDEN {
        assert!(!lower.contains(word), "the report says ‘{word}’");
    }
}

/// Digits of every number of a text; ids, hashes and file names are not numbers.
pub fn check_digits(cell: &str) {
    let words = cell.split(|c: char| c.is_whitespace() || ",;:()".contains(c));
    for word in words.filter(|word| word.parse::<f64>().is_ok()) {
        let mantissa = word.split('e').next().unwrap_or(word).trim_start_matches(['+', '-']);
        let digits = mantissa.replace('.', "");
        let significant = digits.trim_start_matches('0').len();
        assert!(significant <= 4 || mantissa.ends_with('0'), "‘{word}’ in ‘{cell}’ has {significant} digits");
    }
}

#[test]
fn the_page_holds_every_section() {
    let page = page(Verdict::Explained);
    for section in Section::ALL {
        // Stable domains belong to another command's page.
        assert_eq!(page.has(section), section != Section::Charts, "{}", section.title());
    }
    let (html, text) = (html(&page), text(&page, 100));
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    check_words(&text);
    assert!(!html.contains("validated") && !html.contains("100 %"));
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("story.html"), html).unwrap();
    std::fs::write(folder.join("story.txt"), text).unwrap();
}

#[test]
fn the_last_line_is_the_verdict() {
    let text = text(&page(Verdict::Explained), 100);
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let verdict = "✓ explained: stiffness-hardening (or stiffness-power-law) + force-lag, with a wrong damping";
    assert!(text.ends_with(verdict), "{text}");
}

#[test]
fn verdicts_have_their_tones() {
    let table = [
        (Verdict::NothingMissing, Tone::Good),
        (Verdict::Explained, Tone::Good),
        (Verdict::WrongParameter, Tone::Good),
        (Verdict::PartlyExplained, Tone::Warning),
        (Verdict::VariesBetweenSessions, Tone::Warning),
        (Verdict::Undecided, Tone::Warning),
        (Verdict::NoneOfThese, Tone::Bad),
        (Verdict::RecordingDefect, Tone::Bad),
    ];
    for (verdict, tone) in table {
        let page = page(verdict);
        assert_eq!(page.tone, tone, "{verdict:?}");
        let (word, _) = verdict.id().split_once('-').unwrap_or((verdict.id(), ""));
        assert!(page.verdict.starts_with(word), "{}", page.verdict);
    }
}

#[test]
fn values_stand_with_their_units() {
    let page = page(Verdict::Explained);
    let cells = || page.tables.iter().flat_map(|table| table.rows.iter().flat_map(|row| row.cells.iter()));
    for expected in [
        "cubic 9.1e6 ± 0.3e6 N/m³",
        "corner frequency 28.9 ± 1.3 Hz; order 1 (not fitted)",
        "0.724 N",
        "50.2 µm",
        "above 42 Hz",
        "below 31 µm",
        "-3.1",
        "1849",
        "within 0.0041 of 1",
        "1071 ± 4 N/m",
        "3 of 3",
        "closes (2e-14 m)",
        "does not close: 3.2 µm; clock offset 3 ms, closes with it (4e-14 m)",
    ] {
        assert!(cells().any(|cell| cell.replace('\u{a0}', " ") == expected), "no cell says ‘{expected}’");
    }
    cells().for_each(|cell| check_digits(cell));
    for table in &page.tables {
        let widths = table.rows.iter().map(|row| row.cells.len());
        assert!(widths.clone().all(|width| width == table.columns.len()), "{}", table.title);
    }
}

#[test]
fn the_worst_learning_recording_is_shown_after_the_tests() {
    let page = page(Verdict::Explained);
    let titles: Vec<&str> = page.plots.iter().map(|group| group.title.as_str()).collect();
    let expected =
        ["Test recording impact-07.mcap", "Test recording impact-08.mcap", "Learning recording impact-04.mcap"];
    assert_eq!(titles, expected);
    assert_eq!(page.loops.len(), 2);
    let labels: Vec<&str> = page.plots[0].panels.iter().map(|panel| panel.y_label.as_str()).collect();
    assert_eq!(labels, ["force in N", "force residual in N", "position residual in µm"]);
}

#[test]
fn an_answer_without_anything_still_makes_a_page() {
    let mut empty = answer(Verdict::Undecided);
    (empty.groups, empty.map, empty.ranking) = (Vec::new(), Vec::new(), Vec::new());
    (empty.sessions, empty.test) = (Vec::new(), BTreeMap::new());
    empty.noise.force_floor_n = 0.0;
    let page = diagnosis(&empty, &[], None, &standard(), COMMAND, &[]);
    assert!(!page.has(Section::WhereItFails) && !page.has(Section::Ladder) && !page.has(Section::Signals));
    assert_eq!(text(&page, 80).lines().last(), Some("! undecided: these recordings cannot answer"));
}

#[test]
fn the_ladder_is_a_page_of_its_own() {
    let page = ladder_page(&ladder(), "dockhil ladder test/ --model m2.toml", &provenance());
    let text = text(&page, 100);
    assert_eq!(text.lines().last(), Some("✓ the last step reaches the noise floor"));
    assert!(text.contains("0.724 N nominal, 0.251 N with + force-lag"), "{text}");
    check_words(&text);
    assert!(html(&page).contains("Error ladder of nominal.toml"));
}
