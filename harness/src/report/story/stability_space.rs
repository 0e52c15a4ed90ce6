//! The stability of a cell with six axes as a page.

use super::super::page::{Page, Row, Section, Table, Tone};
use super::stability::chart;
use super::table::{numbers, row, table, words as text};
use super::words::{figures, number, value};
use crate::stability::{Domain, SpaceAnswer};

/// The answer as a page.
pub fn stability_space_page(
    title: &str,
    answer: &SpaceAnswer,
    domain: Option<&Domain>,
    command: &str,
    provenance: &[(String, String)],
) -> Page {
    Page {
        title: title.to_owned(),
        tone: if answer.stable { Tone::Good } else { Tone::Bad },
        verdict: verdict(answer),
        sentences: sentences(answer),
        command: command.to_owned(),
        heat: Vec::new(),
        plots: Vec::new(),
        loops: Vec::new(),
        charts: domain.map(|domain| chart(None, domain)).into_iter().collect(),
        tables: [roots(answer), quantities(answer)].into_iter().flatten().collect(),
        ladder: None,
        provenance: provenance.to_vec(),
    }
}

fn verdict(answer: &SpaceAnswer) -> String {
    match (answer.stable, answer.delay_margin_s) {
        (true, Some(margin_s)) => format!("stable; margin {} of delay on both paths", value(margin_s, "s")),
        (true, None) => "stable, and no delay that was tried changes it".to_owned(),
        (false, Some(margin_s)) => format!("unstable; {} of delay are too much", value(-margin_s, "s")),
        (false, None) => "unstable, even with no delay but the hold of half a tick".to_owned(),
    }
}

fn sentences(answer: &SpaceAnswer) -> Vec<String> {
    let mut said = vec![format!(
        "The contact feels {} along its normal, ({}, {}, {}) in nozzle axes.",
        value(answer.reduced_mass_kg, "kg"),
        number(answer.normal[0]),
        number(answer.normal[1]),
        number(answer.normal[2])
    )];
    if let Some(slowest) = answer.roots.first() {
        let verb = if slowest.growth_per_s < 0.0 { "halves" } else { "doubles" };
        let time_s = std::f64::consts::LN_2 / slowest.growth_per_s.abs();
        said.push(format!("The slowest motion {verb} in {}.", value(time_s, "s")));
    }
    if answer.free_directions > 0 {
        said.push(format!("In {} of six directions nothing pushes: they coast.", answer.free_directions));
    }
    said.push(
        "Linear, with the probe pressed on: continuous delays, the held force as half a tick. Sliding and opening are not in it."
            .to_owned(),
    );
    said.extend(answer.left_out.iter().map(|left| format!("Not in this prediction: {left}.")));
    said
}

fn roots(answer: &SpaceAnswer) -> Option<Table> {
    let line = |root: &crate::stability::RootAnswer| {
        let tone = (root.growth_per_s >= 0.0).then_some(Tone::Bad);
        row(tone, vec![figures(root.growth_per_s, 4), figures(root.frequency_rad_per_s, 4)])
    };
    let rows: Vec<Row> = answer.roots.iter().map(line).collect();
    let columns = vec![numbers("growth in 1/s"), numbers("frequency in rad/s")];
    table(Section::Quantities, "Rightmost characteristic roots", "", columns, rows)
}

fn quantities(answer: &SpaceAnswer) -> Option<Table> {
    let rows = vec![
        row(None, vec!["delay of what the sensor feels".to_owned(), value(answer.felt_delay_s, "s")]),
        row(None, vec!["delay of what the software adds".to_owned(), value(answer.virtual_delay_s, "s")]),
    ];
    table(Section::Quantities, "Delays", "", vec![text("what"), numbers("value")], rows)
}
