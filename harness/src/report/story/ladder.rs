//! The error ladder: nominal, + effect 1, + effect 2 …, on recordings that no fit has seen.

use super::super::page::{self, Page, Section, Table, Tone};
use super::diagnosis::title_with_model;
use super::maps::channel_of_key;
use super::table::{numbers, row, table, words};
use super::words::{Scale, counted, figures};
use crate::diagnose::answer::{Ladder, LadderChannel};

/// What is left above the noise floor, over the floor, at which a ladder counts as having reached it. Chosen, not measured.
const REACHED: f64 = 0.5;

/// The ladder as a page of its own.
pub fn ladder_page(ladder: &Ladder, command: &str, provenance: &[(String, String)]) -> Page {
    Page {
        title: title_with_model("Error ladder", provenance),
        tone: tone(ladder),
        verdict: verdict(ladder),
        sentences: ladder.channels.iter().filter_map(|(key, channel)| sentence(key, channel)).collect(),
        command: command.to_owned(),
        heat: Vec::new(),
        plots: Vec::new(),
        loops: Vec::new(),
        charts: Vec::new(),
        tables: tables(ladder),
        ladder: Some(drawn(ladder)),
        provenance: provenance.to_vec(),
    }
}

/// The ladder for the page.
pub(super) fn drawn(ladder: &Ladder) -> page::Ladder {
    let channels = ladder.channels.iter().map(|(key, channel)| {
        let scale = scale(channel);
        let step = |step: &crate::diagnose::answer::LadderStep| page::LadderStep {
            label: step.label.clone(),
            value: step.rms * scale.factor,
            per_session: step.per_session.iter().map(|rms| rms * scale.factor).collect(),
        };
        page::LadderChannel {
            label: channel_of_key(key),
            unit: scale.unit.clone(),
            noise_floor: channel.noise_floor * scale.factor,
            steps: channel.steps.iter().map(step).collect(),
        }
    });
    let note = format!(
        "Root mean square over {} that no fit has seen. Each step keeps the effects above it; nominal is the model without them.",
        counted(ladder.sessions.len(), "test recording")
    );
    page::Ladder { note, channels: channels.collect() }
}

fn scale(channel: &LadderChannel) -> Scale {
    Scale::of(channel.unit, channel.steps.iter().map(|step| step.rms).fold(channel.noise_floor, f64::max))
}

/// The numbers behind the dots, one table per channel.
pub(super) fn tables(ladder: &Ladder) -> Vec<Table> {
    ladder.channels.iter().filter_map(|(key, channel)| numbers_of(key, channel, &ladder.sessions)).collect()
}

fn numbers_of(key: &str, channel: &LadderChannel, sessions: &[String]) -> Option<Table> {
    let scale = scale(channel);
    let cell = |rms: f64| figures(rms * scale.factor, 3);
    let label = |label: &String| numbers(label.clone());
    let columns = std::iter::once(words("recording")).chain(channel.steps.iter().map(|step| label(&step.label)));
    let of = |index: usize, name: &String| {
        let values =
            channel.steps.iter().map(|step| step.per_session.get(index).map_or("–".to_owned(), |rms| cell(*rms)));
        row(None, std::iter::once(name.clone()).chain(values).collect())
    };
    let mut rows: Vec<page::Row> = sessions.iter().enumerate().map(|(index, name)| of(index, name)).collect();
    let summary = |name: &str, of: fn(&LadderChannel, usize) -> f64| {
        let values = (0..channel.steps.len()).map(|index| cell(of(channel, index)));
        row(None, std::iter::once(name.to_owned()).chain(values).collect())
    };
    rows.push(summary("all together", |channel, index| channel.steps[index].rms));
    if channel.noise_floor > 0.0 {
        rows.push(summary("left above the noise floor", |channel, index| channel.steps[index].excess));
    }
    let floor = match channel.noise_floor {
        floor if floor > 0.0 => format!("Noise floor {}.", scale.figures(floor, 3)),
        _ => "The noise floor is not known.".to_owned(),
    };
    let title =
        format!("{}, root mean square per test recording", scale.label(&format!("Error of {}", channel_of_key(key))));
    table(Section::Ladder, &title, floor, columns.collect(), rows)
}

/// Whether what is left is small against the noise.
fn reaches(channel: &LadderChannel) -> Option<bool> {
    let last = channel.steps.last()?;
    (channel.noise_floor > 0.0).then_some(last.excess <= REACHED * channel.noise_floor)
}

fn worsens(channel: &LadderChannel) -> bool {
    matches!((channel.steps.first(), channel.steps.last()), (Some(first), Some(last)) if last.rms > first.rms)
}

fn tone(ladder: &Ladder) -> Tone {
    if ladder.channels.values().any(worsens) {
        Tone::Bad
    } else if !ladder.channels.is_empty() && ladder.channels.values().all(|channel| reaches(channel) == Some(true)) {
        Tone::Good
    } else {
        Tone::Warning
    }
}

fn verdict(ladder: &Ladder) -> String {
    let named = |of: &dyn Fn(&LadderChannel) -> bool| {
        let keys = ladder.channels.iter().filter(|(_, channel)| of(channel)).map(|(key, _)| channel_of_key(key));
        super::words::listed(&keys.collect::<Vec<String>>(), "and")
    };
    let worse = named(&worsens);
    let open = named(&|channel| reaches(channel) == Some(false));
    let unknown = named(&|channel| reaches(channel).is_none());
    if !worse.is_empty() {
        format!("the last step is worse than the first: {worse}")
    } else if !open.is_empty() {
        format!("above the noise floor: {open}")
    } else if !unknown.is_empty() {
        format!("the error falls or stays; noise floor not known: {unknown}")
    } else {
        "the last step reaches the noise floor".to_owned()
    }
}

fn sentence(key: &str, channel: &LadderChannel) -> Option<String> {
    let (first, last) = (channel.steps.first()?, channel.steps.last()?);
    let scale = scale(channel);
    let text = |value: f64| scale.figures(value, 3);
    let floor = if channel.noise_floor > 0.0 {
        let times = figures(last.rms / channel.noise_floor, 3);
        format!("noise floor {}, {times} times of which is left", text(channel.noise_floor))
    } else {
        "noise floor not known".to_owned()
    };
    let name = channel_of_key(key);
    Some(format!("Error of {name}: {} nominal, {} with {}; {floor}.", text(first.rms), text(last.rms), last.label))
}
