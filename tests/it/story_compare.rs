//! The page of a comparison, from a made-up result: a linear spring against recordings of a hardening one.
//!
//! `the_page_tells_limits_blocks_and_quantities` leaves `compare.html` and `compare.txt` in `CARGO_TARGET_TMPDIR`.

use crate::story::{FORCE_SIGMA_N, POSITION_SIGMA_M, check_digits, check_words, impact};
use harness::compare::{
    Agreement, Block, CompareVerdict, Comparison, Fitted, FreeRunSummary, HeatCell, HeatRow, LimitResult, Outcome,
    Quantity, SessionComparison, Shift, Signals, Verdict,
};
use harness::diagnose::noise::Noise;
use harness::diagnose::quality::Phase;
use harness::diagnose::software::Software;
use harness::recording::{Grade, Kind};
use harness::report::story::comparison;
use harness::report::{Section, Tone, html, text};

fn signals(file: &str, stream: usize) -> Signals {
    let curves = impact(file, "test", 0.03, stream);
    let gap = |index: usize, value: f64| (!(2500..2520).contains(&index)).then_some(value);
    let with_gaps = |values: Vec<f64>| values.into_iter().enumerate().map(|(i, v)| gap(i, v)).collect();
    let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
    let around = |by: f64| curves.force_before_n.iter().map(|force| force * (1.0 + by) + by).collect::<Vec<f64>>();
    Signals {
        force_residual_n: with_gaps(minus(&curves.force_measured_n, &curves.force_before_n)),
        force_measured_n: with_gaps(curves.force_measured_n.clone()),
        force_band_n: 2.0 * FORCE_SIGMA_N,
        free_median_n: around(0.0),
        free_low_n: around(-0.04),
        free_high_n: around(0.04),
        force_model_n: curves.force_before_n,
        force_time_s: curves.sensor_time_s,
        depth_m: curves.depth_m,
        pose_residual_m: minus(&curves.position_measured_m, &curves.position_before_m).into_iter().map(Some).collect(),
        pose_measured_m: curves.position_measured_m.into_iter().map(Some).collect(),
        pose_model_m: curves.position_before_m,
        pose_band_m: 2.0 * POSITION_SIGMA_M,
        pose_time_s: curves.loop_time_s,
        contact_s: curves.contact_s,
    }
}

fn heat(force: [f64; 4]) -> Vec<HeatRow> {
    let phases = [Phase::Approach, Phase::Compression, Phase::Expansion, Phase::Retreat];
    let cells = |values: [f64; 4]| {
        phases.into_iter().zip(values).map(|(phase, misfit)| HeatCell { phase, misfit, blocks: 24 }).collect()
    };
    vec![
        HeatRow { channel: "force_z_n".into(), cells: cells(force) },
        HeatRow { channel: "measured_z_m".into(), cells: cells([1.0, 0.93, 1.04, 1.01]) },
    ]
}

fn blocks() -> Vec<Block> {
    let path = Block {
        block: "path: command → measured pose".into(),
        channel: "measured_z_m".into(),
        rms: 5.02e-5,
        rms_unfitted: 5.02e-5,
        rms_contact: Some(4.98e-5),
        rms_contact_uncertainty: Some(4.1e-6),
        agreement: Some(Agreement { fit_percent: 99.97, magnitude_percent: 0.012, phase_percent: 0.031 }),
        noise_floor: POSITION_SIGMA_M,
        unit: "m".into(),
        misfit: Some(1.02),
        misfit_limit: 1.162,
        phases_outside: Vec::new(),
        verdict: Verdict::InsideNoise,
    };
    let force = Block {
        block: "force: achieved pose → reading".into(),
        channel: "force_z_n".into(),
        rms: 0.691,
        rms_unfitted: 0.7241,
        rms_contact: Some(1.314),
        rms_contact_uncertainty: Some(0.021),
        agreement: Some(Agreement { fit_percent: 61.24, magnitude_percent: -21.3, phase_percent: 4.02 }),
        noise_floor: FORCE_SIGMA_N,
        unit: "N".into(),
        misfit: Some(4.83),
        misfit_limit: 1.162,
        phases_outside: vec![Phase::Compression, Phase::Expansion],
        verdict: Verdict::Outside,
    };
    vec![path, force]
}

fn quantity(name: &str, unit: &str, [measured, model, uncertainty]: [f64; 3], verdict: Verdict) -> Quantity {
    Quantity {
        name: name.into(),
        unit: unit.into(),
        about: String::new(),
        measured: Some(measured),
        model: Some(model),
        difference: Some(model - measured),
        uncertainty: Some(uncertainty),
        u_data: 0.3 * uncertainty,
        u_input: 0.4 * uncertainty,
        u_numerical: 1e-4 * uncertainty,
        verdict,
    }
}

fn session(file: &str, stream: usize) -> SessionComparison {
    let fitted = |name: &str, unit: &str, value: f64, declared: f64| Fitted {
        name: name.into(),
        unit: unit.into(),
        value,
        declared: Some(declared),
    };
    SessionComparison {
        file: file.into(),
        grade: Grade::A,
        kind: Kind::Impact,
        verdict: Verdict::Outside,
        software: Software { closure_m: Some(2e-14), ..Software::not_examined() },
        software_sentence: "our software, recomputed from the recorded force, gives the recorded commands to 2e-14 m"
            .into(),
        fitted: vec![fitted("force offset", "N", 0.012, 0.03), fitted("stiffness", "1", 0.0294, 0.01)],
        blocks: blocks(),
        quantities: vec![
            quantity("peak_force_n", "N", [8.53, 6.61, 0.35], Verdict::Outside),
            quantity("contact_time_s", "s", [0.6891, 0.7312, 0.0031], Verdict::Outside),
            quantity("observed_energy_j", "J", [-0.0081, -0.0079, 0.0004], Verdict::InsideNoise),
        ],
        free_run: Some(FreeRunSummary {
            samples: 40,
            diverged: 0,
            seed: 7,
            command_error_m: Some(3.1e-3),
            command_band_m: Some(4e-4),
        }),
        shift_force: Some(Shift { shift_ms: 2.13, sd_ms: 0.41, gain: 48.0, share_of_excess: 0.043, finding: true }),
        shift_pose: None,
        heat: heat([1.0, 6.9, 7.4, 1.0]),
        signals: signals(file, stream),
    }
}

fn result(verdict: CompareVerdict) -> Comparison {
    let limit = |channel: &str, limit: f64, value: f64, uncertainty: f64, unit: &str, outcome: Outcome| LimitResult {
        channel: channel.into(),
        limit,
        value: Some(value),
        uncertainty: Some(uncertainty),
        unit: unit.into(),
        outcome,
        session: "impact-07.mcap".into(),
    };
    Comparison {
        schema: 1,
        model: "nominal".into(),
        noise: Noise {
            slow_memory: 0.95,
            average: -0.9,
            innovation_n: 0.25,
            force_floor_n: FORCE_SIGMA_N,
            position_floor_m: POSITION_SIGMA_M,
            learned: true,
            excess: 0.0,
        },
        verdict,
        sessions: vec![session("impact-07.mcap", 3), session("impact-08.mcap", 4)],
        heat: heat([1.0, 6.8, 7.3, 1.0]),
        findings: (1..=8).map(|index| format!("finding {index} of a made-up comparison")).collect(),
        limits: vec![
            limit("force_z_n", 0.35, 1.314, 0.021, "N", Outcome::Fail),
            limit("contact_time_s", 0.043, 0.0421, 0.0031, "s", Outcome::Undecided),
            limit("measured_z_m", 1e-4, 4.98e-5, 4.1e-6, "m", Outcome::Pass),
        ],
    }
}

#[test]
fn the_page_tells_limits_blocks_and_quantities() {
    let provenance = [("scenario".to_owned(), "made up".to_owned())];
    let page =
        comparison(&result(CompareVerdict::Fail), "dockhil compare recordings/ --model nominal.toml", &provenance);
    for section in [Section::Verdict, Section::WhereItFails, Section::Signals, Section::Loops, Section::Quantities] {
        assert!(page.has(section), "{} is empty", section.title());
    }
    let (html, text) = (html(&page), text(&page, 100));
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    check_words(&text);
    assert_eq!(text.lines().last(), Some("✗ fail: 1 of 3 limits exceeded, uncertainty included"));
    let cells = || page.tables.iter().flat_map(|table| table.rows.iter().flat_map(|row| row.cells.iter()));
    for expected in [
        "1.31 ± 0.02 N",
        "-0.96 N",
        "42 ± 3 ms",
        "0.90 ms",
        "50 ± 4 µm",
        "-1.92 ± 0.35 N",
        "0.2 ± 0.4 mJ",
        "4.83",
        "above 99.9 %; 0.012 %, 0.031 %",
        "61.2 %; -21 %, 4.0 %",
        "compression and expansion",
    ] {
        assert!(cells().any(|cell| cell.replace('\u{a0}', " ") == expected), "no cell says ‘{expected}’\n{text}");
    }
    cells().for_each(|cell| check_digits(cell));
    for table in &page.tables {
        assert!(table.rows.iter().all(|row| row.cells.len() == table.columns.len()), "{}", table.title);
    }
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("compare.html"), html).unwrap();
    std::fs::write(folder.join("compare.txt"), text).unwrap();
}

#[test]
fn verdicts_of_a_comparison_have_their_tones() {
    let table = [
        (CompareVerdict::InsideNoise, Tone::Good, "inside the noise: software closes, every block is at its noise"),
        (CompareVerdict::Pass, Tone::Good, "pass: 3 limits held, uncertainty included"),
        (CompareVerdict::CannotSay, Tone::Warning, "cannot say: the noise is not known"),
        (CompareVerdict::Undecided, Tone::Warning, "undecided: 1 of 3 limits within the uncertainty"),
        (CompareVerdict::Outside, Tone::Bad, "outside the noise: force block"),
        (CompareVerdict::Fail, Tone::Bad, "fail: 1 of 3 limits exceeded, uncertainty included"),
    ];
    for (verdict, tone, words) in table {
        let page = comparison(&result(verdict), "dockhil compare", &[]);
        assert_eq!((page.tone, page.verdict.as_str()), (tone, words));
    }
}
