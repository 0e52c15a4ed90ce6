//! The page of a run of a cell: how it ended first, then what was exchanged.

use super::config::Cell;
use super::run::Ran;
use super::timing::{Spread, Timing};
use crate::files::sha256_hex;
use crate::recording::{Pose, Series};
use crate::report::story::words::Scale;
use crate::report::{Page, PlotGroup, Role, Row, Section, Table, Tone};
use crate::scenario::page::{MM_PER_M, columns, curve, over_time, panel};

const US_PER_NS: f64 = 1e-3;
const CELL: &str = "cell";

/// The page of a run. `ended` is how, in a few words; `command` makes it again; `files` are what was written.
pub fn page(
    cell: &Cell,
    ran: &Ran,
    timing: Option<&Timing>,
    ended: (Tone, String),
    command: &str,
    files: &[(String, String)],
) -> Page {
    let ms = cell.config.time.cycle_s * 1e3;
    let mut sentences =
        vec![format!("{} of {} cycles of {ms} ms ran, {} answered.", ran.cycles, ran.planned, ran.answered)];
    sentences.push(match ran.contact_s {
        Some([first_s, last_s]) => {
            format!("Probe and nozzle first touch at {first_s:.3} s and last at {last_s:.3} s.")
        }
        None => "Probe and nozzle never touch.".to_owned(),
    });
    if let Some((peak_n, at_s)) = ran.peak {
        sentences.push(format!(
            "The largest reading along z is {}, at {at_s:.3} s.",
            Scale::of("N", peak_n).figures(peak_n, 4)
        ));
    }
    sentences.extend(ran.stops.iter().map(|(robot, why)| format!("{robot}: {why}")));
    let file = |text: &str| format!("sha256 {}", sha256_hex(text.as_bytes()));
    let mut provenance = vec![
        ("program".to_owned(), format!("dockhil {}", env!("CARGO_PKG_VERSION"))),
        (format!("cell {}", cell.config.name), file(&cell.source.text)),
        (format!("model {}", cell.config.model), file(&cell.model.text)),
    ];
    let rsi = cell.config.robots.iter().zip(&cell.rsi);
    provenance.extend(rsi.map(|(robot, xml)| (format!("robot {}", robot.name), file(&xml.text))));
    provenance.extend(cell.config.seed.map(|seed| ("seed".to_owned(), seed.to_string())));
    provenance.push(("exchange".to_owned(), ran.fingerprint()));
    provenance.extend_from_slice(files);
    let (tone, verdict) = ended;
    Page {
        title: format!("Cell {}", cell.config.name),
        tone,
        verdict,
        sentences,
        command: command.to_owned(),
        heat: Vec::new(),
        plots: vec![signals(cell, ran)],
        charts: Vec::new(),
        loops: Vec::new(),
        tables: [faults(ran), events(ran), timing.map(kept)].into_iter().flatten().collect(),
        ladder: None,
        provenance,
    }
}

fn signals(cell: &Cell, ran: &Ran) -> PlotGroup {
    let seconds = |time_ns: &[i64]| time_ns.iter().map(|ns| *ns as f64 * 1e-9).collect::<Vec<_>>();
    let along = |label: &str, role, series: &Option<Series<Pose>>| {
        let series = series.as_ref().filter(|series| !series.value.is_empty())?;
        let z_mm = series.value.iter().map(|pose| pose.position_m[2] * MM_PER_M);
        Some(panel(&format!("{label} in mm"), seconds(&series.time_ns), vec![curve(label, role, z_mm)]))
    };
    let force = ran.session.sensed.as_ref().filter(|series| !series.value.is_empty()).map(|series| {
        let z_n = series.value.iter().map(|wrench| wrench.force_n[2]);
        panel("reading of the sensor in N", seconds(&series.time_ns), vec![curve("along z", Role::Measured, z_n)])
    });
    let commanded = along("commanded position", Role::Model, &ran.session.commanded);
    let reported = along("reported position", Role::Measured, &ran.session.measured);
    let panels = [force, commanded, reported].into_iter().flatten().collect();
    let note = "Along z, the axis of approach. Positions are penetrations of the nominal contact plane; readings are as the sensor \
                sends them, negative where the contact resists.";
    let contact = ran.contact_s.map(|[first_s, last_s]| (first_s, last_s));
    PlotGroup { note: note.to_owned(), ..over_time(&cell.config.name, panels, contact) }
}

fn faults(ran: &Ran) -> Option<Table> {
    let row = |one: &super::run::FaultAccount| {
        let first = one.first.map_or_else(|| "-".to_owned(), |first| first.to_string());
        let tone = if one.acted == 0 { Tone::Bad } else { Tone::Good };
        Row { cells: vec![one.fault.clone(), one.acted.to_string(), first], tone: Some(tone) }
    };
    (!ran.faults.is_empty()).then(|| Table {
        title: "Faults that were put in".to_owned(),
        note: "An effect of the catalogue has acted once or not at all.".to_owned(),
        columns: columns(&["fault"], &["acted", "first on packet"]),
        rows: ran.faults.iter().map(row).collect(),
        section: Section::Verdict,
    })
}

fn events(ran: &Ran) -> Option<Table> {
    let row = |who: &str, class: &str, count: u64| {
        let first = ran.first_of.get(class).filter(|_| who == CELL).cloned().unwrap_or_default();
        Row { cells: vec![who.to_owned(), class.to_owned(), first, count.to_string()], tone: None }
    };
    let mut rows: Vec<Row> = ran.events.iter().map(|(class, count)| row(CELL, class, *count)).collect();
    rows.extend(ran.driver.iter().map(|(class, count)| row("driver", class, *count)));
    (!rows.is_empty()).then(|| Table {
        title: "What was seen".to_owned(),
        note: "By the cell: its robot controllers and sockets. By the driver: the computer's side, where it is in this program."
            .to_owned(),
        columns: columns(&["by", "event", "the first"], &["times"]),
        rows,
        section: Section::Quantities,
    })
}

fn kept(timing: &Timing) -> Table {
    let us = |ns: f64| format!("{:.0} µs", ns * US_PER_NS);
    let row = |what: &str, spread: &Spread| {
        let mean_ns = spread.sum_ns as f64 / spread.count.max(1) as f64;
        Row {
            cells: vec![what.to_owned(), spread.count.to_string(), us(mean_ns), us(spread.most_ns as f64)],
            tone: None,
        }
    };
    let load = 100.0 * timing.busy_ns as f64 / timing.total_ns.max(1) as f64;
    Table {
        title: "Real time".to_owned(),
        note: format!(
            "{} answers were late or missing. {load:.1} % of the time was not spent waiting.",
            timing.late_or_missing
        ),
        columns: columns(&["what"], &["count", "mean", "at most"]),
        rows: vec![
            row("frames sent late by", &timing.sent_late),
            row("answers in time after", &timing.answers_in_time),
        ],
        section: Section::Quantities,
    }
}
