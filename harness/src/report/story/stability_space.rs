//! The stability of a cell with six axes as a page.

use super::super::page::{Page, Row, Section, Table, Tone};
use super::stability::{budget_table, chart, largest, margin, nearer, without};
use super::table::{numbers, row, table, words as text};
use super::words::{figures, number, value};
use crate::stability::{Domain, SpaceAnswer};

const BUDGET_NOTE: &str = "Along the normal of the contact; to first order the loop sees one delay, τ = Σ kᵢ τᵢ / k. The verdict is \
                           from the characteristic roots of all six axes.";

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
        tone: match answer.stable {
            _ if !answer.undecided_by.is_empty() => Tone::Warning,
            true => Tone::Good,
            false => Tone::Bad,
        },
        verdict: verdict(answer),
        sentences: sentences(answer),
        command: command.to_owned(),
        heat: Vec::new(),
        plots: Vec::new(),
        loops: Vec::new(),
        charts: domain.map(|domain| chart(None, domain)).into_iter().collect(),
        tables: [budget_table(&answer.budget, answer.delay_s, BUDGET_NOTE), roots(answer), quantities(answer)]
            .into_iter()
            .flatten()
            .collect(),
        ladder: None,
        provenance: provenance.to_vec(),
    }
}

fn verdict(answer: &SpaceAnswer) -> String {
    format!("{}{}", without(&answer.undecided_by), linear(answer))
}

/// What the linear loop does.
fn linear(answer: &SpaceAnswer) -> String {
    let delay = answer.delay_margin.as_ref().map(|found| margin(found, "s"));
    if answer.stable {
        let delay = delay.map(|delay| format!("{delay} of delay on both paths"));
        let (low, high) = (answer.damping_margin_low.as_ref(), answer.damping_margin_high.as_ref());
        let damping = nearer(low, high, " along the normal");
        let margins: Vec<String> = delay.into_iter().chain(damping).collect();
        return match margins.is_empty() {
            true if answer.search_gave_up => "stable; its margins were not searched".to_owned(),
            true => "stable, and no delay and no damping that was tried changes it".to_owned(),
            false => format!("stable; margin {}", margins.join(" and ")),
        };
    }
    if answer.search_gave_up {
        return "unstable; what makes it stable was not searched: delay times stiffness is out of proportion"
            .to_owned();
    }
    match (&answer.damping_margin_low, &answer.damping_margin_high, delay) {
        (Some(low), ..) if low.distance <= 0.0 => {
            format!("unstable; {} of damping along the normal are missing", margin(low, "N s/m"))
        }
        (_, Some(high), _) if high.distance <= 0.0 => {
            format!("unstable; {} of damping along the normal are too much", margin(high, "N s/m"))
        }
        (.., Some(delay)) => format!("unstable; {delay} of delay are too much"),
        _ => "unstable, even with no delay but the hold of half a tick; no damping along the normal alone makes it stable".to_owned(),
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
    said.extend(largest(&answer.budget, answer.delay_s));
    said.extend(advice(answer));
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

fn advice(answer: &SpaceAnswer) -> Option<String> {
    if answer.stable {
        return None;
    }
    let mut ways: Vec<String> = Vec::new();
    match (&answer.damping_margin_low, &answer.damping_margin_high) {
        (Some(low), Some(high)) if low.distance <= 0.0 => ways.push(format!(
            "{} to {} more damping along the normal",
            value(-low.distance, "N s/m"),
            value(high.distance, "N s/m")
        )),
        (Some(low), None) if low.distance <= 0.0 => {
            ways.push(format!("at least {} more damping along the normal", value(-low.distance, "N s/m")));
        }
        (_, Some(high)) if high.distance <= 0.0 => {
            ways.push(format!("{} less damping along the normal", value(-high.distance, "N s/m")));
        }
        _ => {}
    }
    if let Some(delay) = &answer.delay_margin {
        ways.push(format!("{} less delay on both paths", value(-delay.distance, "s")));
    }
    (!ways.is_empty()).then(|| format!("To make it stable: {}.", ways.join("; or ")))
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
        row(None, vec!["stiffness along the normal".to_owned(), value(answer.stiffness_n_per_m, "N/m")]),
        row(None, vec!["damping along the normal".to_owned(), value(answer.damping_n_s_per_m, "N s/m")]),
        row(None, vec!["delay of what the sensor feels".to_owned(), value(answer.felt_delay_s, "s")]),
        row(None, vec!["delay of what the software adds".to_owned(), value(answer.virtual_delay_s, "s")]),
    ];
    table(Section::Quantities, "Numbers", "", vec![text("what"), numbers("value")], rows)
}
