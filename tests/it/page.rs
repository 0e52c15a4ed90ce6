//! The report page: one file, nothing loaded, all strings escaped, the same bytes each time, spikes survive.
//!
//! `html_is_written_for_eyes` leaves `page.html` and `page.txt` in `CARGO_TARGET_TMPDIR`, to be looked at.

use harness::report::{
    Band, Column, Curve, Heat, HeatRow, Ladder, LadderChannel, LadderStep, Page, Panel, PlotGroup, Role, Row, Section,
    Table, Tone, XyCurve, XyPlot, html, text, uplot_sha256,
};
use serde_json::Value;

/// `dist/uPlot.iife.min.js` of the npm package uplot 1.6.32, by `sha256sum`.
const UPLOT_1_6_32: &str = "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f";
const HOSTILE: &str = "</script><script>alert(1)</script>\"'&<img src=x onerror=alert(2)>\u{1b}[31m";

/// Noise without a generator crate: an integer hash in [-1, 1].
fn noise(index: usize, stream: usize) -> f64 {
    let mut word = (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (stream as u64 + 7) << 32;
    word = (word ^ word >> 31).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    ((word ^ word >> 29) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Penetration in mm of a made-up contact from 1.1 s to 1.9 s.
#[expect(clippy::disallowed_methods, reason = "a picture, not a number that is compared")]
fn penetration_mm(time: f64) -> f64 {
    let phase = (time - 1.1) / 0.8;
    if (0.0..1.0).contains(&phase) { 9.0 * (std::f64::consts::PI * phase).sin() } else { 0.0 }
}

/// A hardening spring, or a linear one with hysteresis.
fn force_n(time: f64, hardening: f64) -> f64 {
    let depth = penetration_mm(time);
    let rate = (penetration_mm(time + 5e-4) - penetration_mm(time - 5e-4)) / 1e-3;
    if depth > 0.0 { 1.05 * depth + hardening * depth * depth * depth + 0.012 * rate } else { 0.0 }
}

fn curve(label: &str, role: Role, y: Vec<f64>, dashed: bool) -> Curve {
    Curve { label: label.into(), role, y: y.into_iter().map(Some).collect(), dashed }
}

/// A panel of signals and the panel of their residual.
fn pair(name: &str, unit: &str, x: &[f64], scale: f64, sigma: f64, session: usize) -> [Panel; 2] {
    let bend = 0.012 + 0.001 * session as f64;
    let truth: Vec<f64> = x.iter().map(|t| scale * force_n(*t, bend)).collect();
    let mut measured: Vec<Option<f64>> =
        truth.iter().enumerate().map(|(i, v)| Some(v + sigma * noise(i, session))).collect();
    for gap in &mut measured[2400.min(x.len() - 1)..2440.min(x.len())] {
        *gap = None;
    }
    let model: Vec<f64> = x.iter().map(|t| scale * force_n(*t, 0.0115)).collect();
    let earlier: Vec<f64> = x.iter().map(|t| scale * force_n(*t, 0.0)).collect();
    let residual: Vec<Option<f64>> = measured.iter().zip(&model).map(|(m, p)| m.map(|m| m - p)).collect();
    let wide = |sign: f64| model.iter().map(|v| v + sign * 2.0 * (sigma + 0.02 * v.abs())).collect::<Vec<f64>>();
    let signals = Panel {
        y_label: format!("{name} in {unit}"),
        x_label: "time in s".into(),
        height_px: 230,
        x: x.to_vec(),
        curves: vec![
            Curve { label: "measured".into(), role: Role::Measured, y: measured, dashed: false },
            curve("model M1", Role::Model, model.clone(), true),
            curve("earlier M0", Role::Earlier, earlier, true),
        ],
        band: Some(Band { low: wide(-1.0), high: wide(1.0), label: "±2σ".into() }),
    };
    let below = Panel {
        y_label: format!("residual of {name} in {unit}"),
        x_label: "time in s".into(),
        height_px: 130,
        x: x.to_vec(),
        curves: vec![
            Curve { label: "measured - model".into(), role: Role::Residual, y: residual, dashed: false },
            curve("limit", Role::Limit, vec![6.0 * sigma; x.len()], true),
        ],
        band: Some(Band { low: vec![-2.0 * sigma; x.len()], high: vec![2.0 * sigma; x.len()], label: "±2σ".into() }),
    };
    [signals, below]
}

fn session(index: usize, samples: usize) -> PlotGroup {
    let x: Vec<f64> = (0..samples).map(|i| i as f64 * 3.0 / samples as f64).collect();
    let [force, force_residual] = pair("force x", "N", &x, 1.0, 0.25, index);
    let [torque, torque_residual] = pair("torque y", "Nm", &x, 0.11, 0.02, index + 10);
    PlotGroup {
        id: format!("session-{index}"),
        title: format!("Session {index}: approach at {} mm/s", 20 + 5 * index),
        note: "The residual leaves the band during compression only.".into(),
        panels: vec![force, force_residual, torque, torque_residual],
        contact: Some((1.1, 1.9)),
    }
}

fn table(title: &str, note: &str, section: Section, columns: &[&str], rows: &[(Option<Tone>, &[&str])]) -> Table {
    let is_number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+');
    let right = |index: usize| rows.iter().all(|row| row.1.get(index).is_some_and(|cell| is_number(cell)));
    let column = |(index, label): (usize, &&str)| Column { label: (*label).into(), align_right: right(index) };
    let row = |row: &(Option<Tone>, &[&str])| Row { cells: row.1.iter().map(|c| (*c).into()).collect(), tone: row.0 };
    Table {
        title: title.into(),
        note: note.into(),
        columns: columns.iter().enumerate().map(column).collect(),
        rows: rows.iter().map(row).collect(),
        section,
    }
}

fn tables() -> Vec<Table> {
    let (good, warning, bad) = (Some(Tone::Good), Some(Tone::Warning), Some(Tone::Bad));
    vec![
        table(
            "Ranking",
            "The change in hold-out error decides; one parameter each.",
            Section::Missing,
            &["effect", "RMSE in N", "hold-out in N", "explains in %", "fit", "check"],
            &[
                (good, &["stiffness hardening", "0.262", "0.268", "88", "0.0117 N/mm³ [0.0112, 0.0121]", "passes"]),
                (warning, &["bottoming stop", "0.291", "0.297", "81", "7.9 mm [7.7, 8.1]", "tied with rank 1"]),
                (None, &["softer contact", "0.550", "0.710", "24", "0.81 N/mm [0.64, 0.98]", "fails hold-out"]),
                (bad, &["negative damping", "0.330", "0.360", "80", "-0.018 N s/mm", "not physical: b < 0"]),
            ],
        ),
        table(
            "Tied effects and the experiment that decides",
            "",
            Section::Missing,
            &["effects", "deciding experiment", "difference over noise"],
            &[(
                warning,
                &[
                    "stiffness hardening, bottoming stop",
                    "repeat session 2 at 60 mm/s, so that penetration passes 11 mm, where they differ by 2.9 N",
                    "11.6",
                ],
            )],
        ),
        table(
            "Not visible in these recordings",
            "An effect that would change nothing by more than the noise cannot be found here.",
            Section::Missing,
            &["effect", "greatest change", "why"],
            &[(
                None,
                &["transport delay", "0.04 N", "the stiffness is in hardware, so the force hardly sees the delay"],
            )],
        ),
        table(
            "Quantities of interest",
            "Error is model minus measured, with its expanded uncertainty (k = 2).",
            Section::Quantities,
            &["quantity", "unit", "measured", "model M1", "error", "±", "limit"],
            &[
                (good, &["peak force", "N", "18.21", "18.05", "-0.160", "0.25", "0.35"]),
                (warning, &["restitution", "-", "0.872", "0.889", "+0.017", "0.015", "0.02"]),
                (good, &["observed energy in contact", "mJ", "10.24", "10.02", "-0.220", "1.3", "2.0"]),
            ],
        ),
        table(
            "Parameters",
            "",
            Section::Quantities,
            &["parameter", "value", "95 % interval", "unit", "origin"],
            &[
                (None, &["stiffness", "1.050", "1.041 to 1.059", "N/mm", "data sheet"]),
                (None, &["hardening", "0.0117", "0.0112 to 0.0121", "N/mm³", "fitted on sessions 1 to 3"]),
            ],
        ),
    ]
}

fn loops() -> Vec<XyPlot> {
    let plot = |index: usize| {
        let times: Vec<f64> = (0..1200).map(|i| 1.1 + 0.8 * f64::from(i) / 1200.0).collect();
        let x: Vec<f64> = times.iter().map(|t| penetration_mm(*t)).collect();
        let one = |label: &str, role, hardening: f64, sigma: f64| XyCurve {
            label: label.into(),
            role,
            x: x.clone(),
            y: times.iter().enumerate().map(|(i, t)| force_n(*t, hardening) + sigma * noise(i, index)).collect(),
        };
        XyPlot {
            title: format!("Session {index}"),
            x_label: "penetration in mm".into(),
            y_label: "force x in N".into(),
            curves: vec![
                one("measured", Role::Measured, 0.012, 0.25),
                one("model M1", Role::Model, 0.0115, 0.0),
                one("earlier M0", Role::Earlier, 0.0, 0.0),
            ],
        }
    };
    (1..=2).map(plot).collect()
}

fn heat(title: &str, cells: [[f64; 5]; 3]) -> Heat {
    let mut rows: Vec<HeatRow> = ["force x", "force z", "torque y"]
        .into_iter()
        .zip(cells)
        .map(|(label, cells)| HeatRow { label: label.into(), cells: cells.into_iter().map(Some).collect() })
        .collect();
    rows[2].cells[4] = None;
    Heat {
        title: title.into(),
        note: "95th percentile of |residual| over all test sessions".into(),
        columns: ["approach", "contact", "compression", "release", "retreat"].map(String::from).to_vec(),
        rows,
        unit: "times noise".into(),
    }
}

fn ladder() -> Ladder {
    let step = |label: &str, value: f64| LadderStep {
        label: label.into(),
        value,
        per_session: (0..5).map(|i| value * (1.0 + 0.15 * noise(i, (value * 1e3) as usize))).collect(),
    };
    let steps = |scale: f64| {
        vec![
            step("M0 linear spring, viscous dashpot", 0.704 * scale),
            step("M1 + stiffness hardening", 0.268 * scale),
            step("M2 + first bending mode of the flange with 1.3 % damping", 0.2514 * scale),
        ]
    };
    let channel = |label: &str, unit: &str, scale: f64| LadderChannel {
        label: label.into(),
        unit: unit.into(),
        noise_floor: 0.25 * scale,
        steps: steps(scale),
    };
    Ladder {
        note: "RMSE on the test sessions, which no parameter was fitted to.".into(),
        channels: vec![channel("force x", "N", 1.0), channel("torque y", "Nm", 0.061)],
    }
}

fn page(sessions: usize, samples: usize) -> Page {
    Page {
        title: "Model M0 against recording epos-2026-11-17, 5 sessions".into(),
        tone: Tone::Warning,
        verdict: "explained: stiffness-hardening".into(),
        sentences: vec![
            "Most likely missing: a stiffness that grows with penetration, 0.0117 N/mm³ (0.0112 to 0.0121).".into(),
            "It explains 88 % of the remaining error and holds on sessions it was not fitted to.".into(),
            "A bottoming stop fits about as well; a session at 60 mm/s tells them apart.".into(),
        ],
        command: "dockhil diagnose data/epos-2026-11-17.mcap --model models/m0.toml --seed 7".into(),
        heat: vec![
            heat("Before: M0", [[0.9, 1.8, 11.6, 5.2, 0.8], [0.7, 0.9, 1.6, 2.4, 0.8], [0.8, 1.1, 7.3, 3.9, 0.0]]),
            heat("After: M1", [[0.9, 1.2, 1.1, 1.3, 0.8], [0.7, 0.9, 1.1, 1.0, 0.8], [0.8, 1.0, 1.3, 0.9, 0.0]]),
        ],
        plots: (1..=sessions).map(|index| session(index, samples)).collect(),
        loops: loops(),
        charts: Vec::new(),
        tables: tables(),
        ladder: Some(ladder()),
        provenance: [
            ("recording", "sha256:3f9c1e0a7b55d2c4a9e1f0887766554433221100ffeeddccbbaa998877665544"),
            ("model", "sha256:aa41be20c0ffee11223344556677889900aabbccddeeff001122334455667788"),
            ("dockhil", "0.1.0, commit 4be1c20"),
            ("seed", "7"),
        ]
        .map(|(key, value)| (key.into(), value.into()))
        .to_vec(),
    }
}

/// The JSON of all plot groups in a page.
fn data(html: &str) -> Vec<Value> {
    let open = r#"<script type="application/json">"#;
    let parts = html.split(open).skip(1).map(|part| part.split("</script>").next().expect("split gives one part"));
    parts.map(|json| serde_json::from_str(json).expect("the data of a plot is JSON")).collect()
}

/// The values of a packed column, by the formula in `pack.rs`.
fn unpack(column: &Value) -> Vec<f64> {
    let number = |key: &str| column[key].as_f64().expect("a number");
    let length = column["length"].as_u64().expect("a length") as usize;
    match column["kind"].as_str() {
        Some("even") => (0..length).map(|i| number("first") + number("step") * i as f64).collect(),
        Some("constant") => vec![number("value"); length],
        _ => {
            let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
            let sextet = |c: &u8| letters.iter().position(|l| l == c).expect("base64") as u32;
            let codes = column["codes"].as_str().expect("codes").as_bytes();
            let code = |four: &[u8]| (four.iter().fold(0, |word, c| word << 6 | sextet(c)) << 8).swap_bytes();
            let value = |code: u32| number("low") + f64::from(code) * (number("high") - number("low")) / 16_777_214.0;
            codes.chunks(4).map(code).map(|c| if c == 0xFF_FFFF { f64::NAN } else { value(c) }).collect()
        }
    }
}

#[test]
fn html_is_written_for_eyes() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let page = page(2, 3000);
    std::fs::write(folder.join("page.html"), html(&page)).expect("the folder of test outputs is writable");
    std::fs::write(folder.join("page.txt"), text(&page, 100)).expect("the folder of test outputs is writable");
}

#[test]
fn html_stays_small() {
    let size = html(&page(5, 3000)).len();
    assert!(size < 1_500_000, "{size} bytes for 5 sessions of 3000 samples and 4 panels");
    let long = html(&page(5, 60_000)).len();
    assert!(long < 3_000_000, "{long} bytes for 5 sessions of 60 000 samples and 4 panels");
}

#[test]
fn html_loads_nothing() {
    let html = html(&page(1, 300));
    for loader in ["src=", "href=\"h", " url(", ":url(", "@import", "<link", "fetch(", "XMLHttp", "import(", "<iframe"]
    {
        assert!(!html.contains(loader), "the page contains {loader}");
    }
    assert!(html.contains("default-src 'none'"));
    // The only address is that of uPlot, in the comment of its licence.
    assert_eq!(html.matches("http://").count() + html.matches("https://").count(), 1);
}

#[test]
fn html_escapes_every_string() {
    let mut page = page(1, 300);
    let hostile = || HOSTILE.to_owned();
    page.title = hostile();
    page.verdict = hostile();
    page.command = hostile();
    page.sentences.push(hostile());
    page.provenance.push((hostile(), hostile()));
    page.heat[0].rows[0].label = hostile();
    page.heat[0].columns[0] = hostile();
    page.tables[0].rows[0].cells[0] = hostile();
    page.tables[0].columns[0].label = hostile();
    page.loops[0].x_label = hostile();
    page.loops[0].curves[0].label = hostile();
    let group = &mut page.plots[0];
    group.id = hostile();
    group.title = hostile();
    group.panels[0].y_label = hostile();
    group.panels[3].x_label = hostile();
    group.panels[0].curves[0].label = hostile();
    let ladder = page.ladder.as_mut().expect("the test page has a ladder");
    ladder.channels[0].steps[0].label = hostile();
    ladder.channels[0].unit = hostile();
    let html = html(&page);
    assert!(!html.contains("<script>alert"));
    assert!(!html.contains("<img"));
    assert_eq!(html.matches("</script>").count(), 3, "the data of one group, uPlot and our script");
    assert_eq!(data(&html)[0]["title"], HOSTILE);
    assert!(!text(&page, 100).contains('\u{1b}'));
}

#[test]
fn same_page_gives_same_bytes() {
    assert_eq!(html(&page(1, 3000)), html(&page(1, 3000)));
    assert_eq!(text(&page(1, 3000), 80), text(&page(1, 3000), 80));
}

#[test]
fn thinning_keeps_extremes_and_gaps() {
    let mut page = page(1, 50_000);
    let y = &mut page.plots[0].panels[0].curves[0].y;
    y[31_234] = Some(77.0);
    y[123] = Some(-55.0);
    y[40_000] = None;
    let json = &data(&html(&page))[0]["panels"][0];
    let (x, y) = (unpack(&json["x"]), unpack(&json["curves"][0]["y"]));
    assert!(x.len() <= 4000 && x.len() == y.len() && x.is_sorted(), "{} rows", x.len());
    let at = |sample: f64| x.iter().position(|x| (x - sample * 3.0 / 50_000.0).abs() < 1e-6).expect("the row is kept");
    // Half a step of 24 bits over a range of 132 N is 4e-6 N.
    assert!((y[at(31_234.0)] - 77.0).abs() < 1e-5);
    assert!((y[at(123.0)] + 55.0).abs() < 1e-5);
    assert!(y[at(40_000.0)].is_nan());
}

#[test]
fn values_that_are_not_finite_become_gaps() {
    let mut page = page(1, 300);
    let panel = &mut page.plots[0].panels[0];
    panel.curves[0].y[5] = Some(f64::NAN);
    panel.curves[1].y[6] = Some(f64::INFINITY);
    page.plots[0].panels[1].curves[0].y.fill(None);
    page.heat[0].rows[0].cells[0] = Some(f64::NAN);
    page.loops[0].curves[0].y[3] = f64::NAN;
    page.ladder.as_mut().expect("the test page has a ladder").channels[0].steps[0].value = f64::NAN;
    let html = html(&page);
    let json = &data(&html)[0]["panels"];
    assert!(unpack(&json[0]["curves"][0]["y"])[5].is_nan());
    assert!(unpack(&json[0]["curves"][1]["y"])[6].is_nan());
    assert!(unpack(&json[1]["curves"][0]["y"]).iter().all(|value| value.is_nan()));
    for drawing in html.split("<svg").skip(1).map(|part| part.split("</svg>").next().expect("split gives one part")) {
        assert!(!drawing.contains("NaN") && !drawing.contains("inf"), "{drawing}");
    }
}

#[test]
fn packed_values_are_close() {
    let page = page(1, 3000);
    let json = &data(&html(&page))[0]["panels"][0]["curves"][0]["y"];
    for (packed, value) in unpack(json).into_iter().zip(&page.plots[0].panels[0].curves[0].y) {
        match value {
            // Half a step of 24 bits over a range of 20 N is 6e-7 N.
            Some(value) => assert!((packed - value).abs() < 1e-6, "{packed} for {value}"),
            None => assert!(packed.is_nan()),
        }
    }
}

#[test]
fn empty_page_is_a_page() {
    let empty = Page {
        heat: vec![],
        plots: vec![],
        loops: vec![],
        charts: Vec::new(),
        tables: vec![],
        ladder: None,
        provenance: vec![],
        sentences: vec![],
        ..page(0, 0)
    };
    assert!(html(&empty).contains("1 Verdict"));
    assert_eq!(text(&empty, 80).lines().last(), Some("! explained: stiffness-hardening"));
}

#[test]
fn text_fits_and_ends_with_the_verdict() {
    let page = page(1, 300);
    for width in [60, 80, 100, 200] {
        let text = text(&page, width);
        let longest = text.lines().map(|line| line.chars().count()).max().unwrap_or(0);
        assert!(longest <= width.min(100), "{longest} columns at {width}:\n{text}");
        assert_eq!(text.lines().last(), Some("! explained: stiffness-hardening"));
    }
}

#[test]
fn uplot_is_the_vendored_version() {
    assert_eq!(uplot_sha256(), UPLOT_1_6_32);
}
