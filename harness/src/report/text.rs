//! The report as plain text for a terminal: the same story without the plots, the verdict on the last line.

use super::axis::number;
use super::page::{Heat, Ladder, LadderChannel, Page, Section, Table};
use super::wrap::{printable, wrap};
use super::{heat, page::Tone};

/// No line is longer; a wider terminal does not make lines easier to read.
const WIDTH_MAX: usize = 100;
/// Below this a table cannot be read at all.
const WIDTH_MIN: usize = 40;
/// Room that is left to a text behind a long first word.
const BODY_MIN: usize = 8;
/// A longer word, such as a hash, may be split.
const WORD_MAX: usize = 20;
/// Spaces before a table, and between its columns.
const INDENT: usize = 4;
const GAP: usize = 2;
/// Blocks of one to eight eighths of a character.
const EIGHTHS: [char; 8] = ['▏', '▎', '▍', '▌', '▋', '▊', '▉', '█'];
const FLOOR_MARK: char = '┊';

/// The report as plain text without colour, at most `width` and never more than 100 columns wide.
///
/// Signals and loops need the HTML page; everything else is here. Control characters in names are blanked.
pub fn text(page: &Page, width: usize) -> String {
    let width = width.clamp(WIDTH_MIN, WIDTH_MAX);
    let mut lines = wrap(&page.title, width);
    for section in Section::ALL.into_iter().filter(|section| page.has(*section)) {
        let own = own_lines(page, section, width);
        let tables: Vec<String> = page.tables_in(section).flat_map(|table| table_lines(table, width)).collect();
        if own.is_empty() && tables.is_empty() {
            continue;
        }
        lines.extend([String::new(), section.title().to_uppercase()]);
        let is_spaced = own.first().or(tables.first()).is_some_and(String::is_empty);
        lines.extend(own.into_iter().chain(tables).skip(usize::from(is_spaced)));
    }
    lines.push(String::new());
    lines.extend(page.sentences.iter().flat_map(|sentence| indented(sentence, "  ", width)));
    lines.extend(indented(&page.command, "  again: ", width));
    lines.extend(indented(&page.verdict, &format!("{} ", page.tone.mark()), width));
    let mut text = String::new();
    for line in &lines {
        text.push_str(printable(line).trim_end());
        text.push('\n');
    }
    text
}

/// What a section shows besides its tables.
fn own_lines(page: &Page, section: Section, width: usize) -> Vec<String> {
    match section {
        Section::WhereItFails => page.heat.iter().flat_map(|map| heat_lines(map, width)).collect(),
        Section::Ladder => page.ladder.iter().flat_map(|ladder| ladder_lines(ladder, width)).collect(),
        Section::Provenance => {
            let key_width = page.provenance.iter().map(|(key, _)| key.chars().count()).max().unwrap_or(0).min(24);
            let line = |(key, value): &(String, String)| indented(value, &format!("  {:<key_width$}  ", key), width);
            page.provenance.iter().flat_map(line).collect()
        }
        Section::Verdict | Section::Signals | Section::Loops | Section::Charts => Vec::new(),
        Section::Missing | Section::Quantities => Vec::new(),
    }
}

/// Wraps a text behind a first word; following lines are indented as far.
fn indented(text: &str, first: &str, width: usize) -> Vec<String> {
    let indent = first.chars().count();
    let body = wrap(text, width.saturating_sub(indent).max(BODY_MIN));
    let line = |(index, part): (usize, String)| match index {
        0 => format!("{first}{part}"),
        _ => format!("{:indent$}{part}", ""),
    };
    body.into_iter().enumerate().map(line).collect()
}

fn heat_lines(map: &Heat, width: usize) -> Vec<String> {
    let worst = heat::worst(map);
    let head = std::iter::once(String::new()).chain(map.columns.iter().cloned()).collect();
    let rows = map.rows.iter().enumerate().map(|(row_index, row)| {
        let cells = row.cells.iter().enumerate().map(|(column_index, cell)| {
            let mark = if worst == Some((row_index, column_index)) { ">" } else { "" };
            format!("{mark}{}", heat::cell(*cell))
        });
        std::iter::once(row.label.clone()).chain(cells).collect()
    });
    let align_right: Vec<bool> = (0..=map.columns.len()).map(|index| index > 0).collect();
    let mut lines = titled(&format!("{}, {}", map.title, map.unit), &map.note, width);
    lines.extend(grid(head, rows.collect(), &align_right, width));
    if let Some((row, column)) = worst {
        let channel = map.rows.get(row).map_or("", |row| &row.label);
        let phase = map.columns.get(column).map_or("", String::as_str);
        lines.extend(indented(&format!("worst: {channel}, {phase}"), "  > ", width));
    }
    lines
}

fn table_lines(table: &Table, width: usize) -> Vec<String> {
    let marked = table.rows.iter().any(|row| row.tone.is_some());
    let first = |text: &str| marked.then(|| text.to_owned()).into_iter();
    let head = first("").chain(table.columns.iter().map(|column| column.label.clone())).collect();
    let rows = table
        .rows
        .iter()
        .map(|row| first(row.tone.map_or("", Tone::mark)).chain(row.cells.iter().cloned()).collect::<Vec<String>>());
    let columns = table.columns.iter().map(|column| column.align_right);
    let align_right: Vec<bool> = marked.then_some(false).into_iter().chain(columns).collect();
    let mut lines = titled(&table.title, &table.note, width);
    lines.extend(grid(head, rows.collect(), &align_right, width));
    lines
}

/// A title and its note, after an empty line.
fn titled(title: &str, note: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    lines.extend(indented(title, "  ", width));
    if !note.is_empty() {
        lines.extend(indented(note, "  ", width));
    }
    lines
}

/// Columns of text. The widest columns are wrapped until the line fits; if their longest words do not let them, every
/// row becomes a list.
fn grid(head: Vec<String>, rows: Vec<Vec<String>>, align_right: &[bool], width: usize) -> Vec<String> {
    let all: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let room = width.saturating_sub(INDENT + GAP * align_right.len().saturating_sub(1));
    let Some(widths) = column_widths(&all, align_right.len(), room) else {
        return records(&all, width);
    };
    all.iter().flat_map(|row| grid_row(row, &widths, align_right)).collect()
}

/// Widths of the columns whose sum is at most `room`, none below its longest word.
fn column_widths(all: &[Vec<String>], count: usize, room: usize) -> Option<Vec<usize>> {
    let cells = |column: usize| all.iter().filter_map(move |row| row.get(column));
    let longest_word =
        |cell: &String| cell.split_ascii_whitespace().map(|word| word.chars().count()).max().unwrap_or(0);
    let least: Vec<usize> =
        (0..count).map(|column| cells(column).map(longest_word).max().unwrap_or(0).min(WORD_MAX)).collect();
    let mut widths: Vec<usize> =
        (0..count).map(|column| cells(column).map(|cell| cell.chars().count()).max().unwrap_or(0)).collect();
    while widths.iter().sum::<usize>() > room {
        let shrinkable = (0..count).filter(|column| widths[*column] > least[*column]);
        let widest = shrinkable.max_by_key(|column| widths[*column])?;
        widths[widest] -= 1;
    }
    Some(widths)
}

/// One row of a grid, as many lines as its highest cell.
fn grid_row(row: &[String], widths: &[usize], align_right: &[bool]) -> Vec<String> {
    let wrapped = |(column, width): (usize, &usize)| row.get(column).map_or_else(Vec::new, |cell| wrap(cell, *width));
    let cells: Vec<Vec<String>> = widths.iter().enumerate().map(wrapped).collect();
    let height = cells.iter().map(Vec::len).max().unwrap_or(0);
    let line = |part: usize| {
        let piece = |((lines, width), right): ((&Vec<String>, &usize), &bool)| {
            let text = lines.get(part).map_or("", String::as_str);
            if *right { format!("{text:>width$}") } else { format!("{text:<width$}") }
        };
        let pieces: Vec<String> = cells.iter().zip(widths).zip(align_right).map(piece).collect();
        format!("{:INDENT$}{}", "", pieces.join("  "))
    };
    (0..height).map(line).collect()
}

/// Each row as a list of `heading: cell`, for terminals too narrow for the table.
fn records(all: &[Vec<String>], width: usize) -> Vec<String> {
    let Some((head, rows)) = all.split_first() else {
        return Vec::new();
    };
    let mut lines = Vec::new();
    for row in rows {
        for (index, (name, cell)) in head.iter().zip(row).filter(|(_, cell)| !cell.is_empty()).enumerate() {
            let bullet = if index == 0 { "  - " } else { "    " };
            let text = if name.is_empty() { cell.clone() } else { format!("{name}: {cell}") };
            lines.extend(indented(&text, bullet, width));
        }
    }
    lines
}

fn ladder_lines(ladder: &Ladder, width: usize) -> Vec<String> {
    let mut lines = indented(&ladder.note, "  ", width);
    for channel in &ladder.channels {
        lines.extend(channel_lines(channel, width));
    }
    lines
}

/// One bar per model; the noise floor is a dotted line through them, named below.
fn channel_lines(channel: &LadderChannel, width: usize) -> Vec<String> {
    let label_width = channel.steps.iter().map(|step| step.label.chars().count()).max().unwrap_or(0).min(width / 3);
    let values: Vec<String> = channel.steps.iter().map(|step| number(step.value)).collect();
    let value_width = values.iter().map(|value| value.chars().count()).max().unwrap_or(0);
    let bar_width = width.saturating_sub(4 + label_width + 2 + value_width + 2).max(1);
    let finite = channel.steps.iter().map(|step| step.value).chain([channel.noise_floor]).filter(|v| v.is_finite());
    let most = finite.fold(0.0, f64::max);
    let cells = |value: f64| if most > 0.0 { (value / most).clamp(0.0, 1.0) * bar_width as f64 } else { 0.0 };
    let floor_at = (cells(channel.noise_floor) as usize).min(bar_width - 1);
    let mut lines = indented(&format!("{} in {}", channel.label, channel.unit), "  ", width);
    for (step, value) in channel.steps.iter().zip(&values) {
        let bar = bar(cells(step.value), floor_at);
        let names = wrap(&step.label, label_width);
        for (index, name) in names.iter().enumerate() {
            let tail = if index == 0 { format!("  {value:>value_width$}  {bar}") } else { String::new() };
            lines.push(format!("    {name:<label_width$}{tail}"));
        }
    }
    let note = format!("{FLOOR_MARK} noise floor {} {}", number(channel.noise_floor), channel.unit);
    let before = 4 + label_width + 2 + value_width + 2 + floor_at;
    // The name stands below the mark, moved left as far as the line needs.
    let before = before.min(width.saturating_sub(note.chars().count()));
    lines.push(format!("{:before$}{note}", ""));
    lines
}

/// A bar of `length` characters, cut by the noise floor.
fn bar(length: f64, floor_at: usize) -> String {
    let eighths = libm::round(if length.is_finite() { length } else { 0.0 } * 8.0) as usize;
    let mut bar: Vec<char> = vec![EIGHTHS[7]; eighths / 8];
    if !eighths.is_multiple_of(8) {
        bar.push(EIGHTHS[eighths % 8 - 1]);
    }
    if bar.len() <= floor_at {
        bar.resize(floor_at + 1, ' ');
    }
    bar[floor_at] = FLOOR_MARK;
    bar.into_iter().collect()
}
