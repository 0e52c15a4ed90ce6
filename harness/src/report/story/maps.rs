//! Where it fails: phase × channel in times the noise, before and after.

use super::super::page::{Heat, HeatRow};
use super::words::{HOLD, counted, figures};
use crate::diagnose::answer::{Cell, Diagnosis};
use crate::diagnose::quality::{Channel, Phase};

/// Both maps, or none if there are no cells.
pub(super) fn maps(answer: &Diagnosis, found: &str) -> Vec<Heat> {
    if answer.map.is_empty() {
        return Vec::new();
    }
    let after = if found.is_empty() { "after: base values refitted".to_owned() } else { format!("after: {found}") };
    vec![
        map(answer, "before: model as given", answer.misfit_before, |cell| cell.before),
        map(answer, &after, answer.misfit_after, |cell| cell.after),
    ]
}

fn map(answer: &Diagnosis, title: &str, overall: f64, of: fn(&Cell) -> f64) -> Heat {
    let phases: Vec<Phase> =
        Phase::ALL.into_iter().filter(|phase| answer.map.iter().any(|cell| cell.phase == *phase)).collect();
    let cell = |channel: Channel, phase: Phase| {
        answer.map.iter().find(|cell| cell.channel == channel && cell.phase == phase && cell.blocks > 0).map(of)
    };
    let row = |channel: Channel| HeatRow {
        label: channel_name(channel).to_owned(),
        cells: phases.iter().map(|phase| cell(channel, *phase)).collect(),
    };
    let occurs = |channel: &Channel| answer.map.iter().any(|cell| cell.channel == *channel);
    Heat {
        title: title.to_owned(),
        note: format!("all cells {}; {}", figures(overall, 3), chance(answer)),
        columns: phases.iter().map(|phase| phase.name().to_owned()).collect(),
        rows: [Channel::Force, Channel::Position].into_iter().filter(occurs).map(row).collect(),
        unit: "times noise".to_owned(),
    }
}

/// How far chance alone moves the smallest cell: the root mean square of n numbers of unit variance scatters by 1/√(2n).
fn chance(answer: &Diagnosis) -> String {
    let least = answer.map.iter().map(|cell| cell.blocks).filter(|blocks| *blocks > 0).min().unwrap_or(1);
    let scatter = 1.0 / libm::sqrt(2.0 * least as f64);
    format!("noise alone reads 1 ±{HOLD}{} in the smallest cell, of {}", figures(scatter, 1), counted(least, "block"))
}

/// A channel, for people.
pub(super) fn channel_name(channel: Channel) -> &'static str {
    match channel {
        Channel::Force => "force",
        Channel::Position => "reported position",
    }
}

/// A channel by its key in the answer's JSON.
pub(super) fn channel_of_key(key: &str) -> String {
    match key {
        "force_z_n" => channel_name(Channel::Force).to_owned(),
        "measured_z_m" => channel_name(Channel::Position).to_owned(),
        other => super::words::key(other).0,
    }
}
