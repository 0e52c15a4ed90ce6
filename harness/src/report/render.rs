//! The HTML page: one file that loads nothing, made from a template and the drawings of this module.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Value;
use minijinja::{AutoEscape, Environment, context};
use sha2::{Digest as _, Sha256};

use super::axis::{number, unit_of};
use super::page::{Chart, Heat, Page, Panel, PlotGroup, Section, Table, Tone, XyPlot};
use super::{chart, heat, ladder, live, loops, still};

const TEMPLATE: &str = include_str!("../../assets/report.html.j2");
const STYLE: &str = include_str!("../../assets/report.css");
const SCRIPT: &str = include_str!("../../assets/report.js");
const UPLOT_SCRIPT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../../assets/uplot/LICENSE");

/// The report as one HTML file that works without network, and without JavaScript as tables and drawings.
///
/// The same page gives the same bytes. All strings of the page are escaped.
pub fn html(page: &Page) -> String {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build();
    environment.set_syntax(syntax.expect("the delimiters are the default ones"));
    environment.add_template("report", TEMPLATE).expect("the embedded template parses, as the tests show");
    let template = environment.get_template("report").expect("the template was added above");
    template.render(context(page)).expect("the template names only what the context holds, as the tests show")
}

/// SHA-256 of the vendored script of uPlot 1.6.32, in lower-case hexadecimal.
pub fn uplot_sha256() -> String {
    Sha256::digest(UPLOT_SCRIPT.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn context(page: &Page) -> Value {
    let shown = Section::ALL.into_iter().filter(|section| page.has(*section));
    let sections = shown.enumerate().map(|(index, section)| {
        context! {
            number => index + 1,
            id => id(section),
            title => section.title(),
            tables => page.tables_in(section).map(table).collect::<Vec<Value>>(),
        }
    });
    context! {
        title => &page.title,
        tone => tone(page.tone),
        mark => page.tone.mark(),
        verdict => &page.verdict,
        sentences => list(page.sentences.iter()),
        command => &page.command,
        sections => sections.collect::<Vec<Value>>(),
        heat => page.heat.iter().map(heat_map).collect::<Vec<Value>>(),
        heat_steps => list(heat::step_names().iter()),
        groups => page.plots.iter().map(group).collect::<Vec<Value>>(),
        loops => page.loops.iter().map(loop_plot).collect::<Vec<Value>>(),
        charts => page.charts.iter().map(chart_of).collect::<Vec<Value>>(),
        ladder => ladder_channels(page),
        provenance => page.provenance.iter().map(|(key, value)| context! { key, value }).collect::<Vec<Value>>(),
        style => safe(STYLE),
        script => safe(SCRIPT),
        uplot_style => safe(UPLOT_STYLE),
        uplot_script => safe(UPLOT_SCRIPT),
        uplot_licence => safe(UPLOT_LICENCE),
    }
}

fn safe(text: &str) -> Value {
    Value::from_safe_string(text.to_owned())
}

fn list<'a>(texts: impl Iterator<Item = &'a String>) -> Vec<Value> {
    texts.map(Value::from).collect()
}

fn tone(tone: Tone) -> &'static str {
    match tone {
        Tone::Good => "good",
        Tone::Warning => "warning",
        Tone::Bad => "bad",
    }
}

fn id(section: Section) -> &'static str {
    match section {
        Section::Verdict => "verdict",
        Section::WhereItFails => "where",
        Section::Signals => "signals",
        Section::Loops => "loops",
        Section::Charts => "charts",
        Section::Missing => "missing",
        Section::Ladder => "ladder",
        Section::Quantities => "quantities",
        Section::Provenance => "provenance",
    }
}

/// A name that is kept on one line, though it has hyphens at which a browser would break it.
fn is_word(text: &str) -> bool {
    text.chars().count() <= 24 && !text.contains(' ')
}

fn table(table: &Table) -> Value {
    let align = |index: usize| if table.columns.get(index).is_some_and(|c| c.align_right) { "right" } else { "left" };
    let columns = table.columns.iter().enumerate().map(|(index, column)| {
        context! { label => &column.label, align => align(index) }
    });
    let rows = table.rows.iter().map(|row| {
        let cells = row.cells.iter().enumerate().map(|(index, text)| {
            let word = if is_word(text) { " word" } else { "" };
            context! { text, align => format!("{}{word}", align(index)) }
        });
        context! {
            tone => row.tone.map(tone),
            mark => row.tone.map(Tone::mark),
            cells => cells.collect::<Vec<Value>>(),
        }
    });
    context! {
        title => &table.title,
        note => &table.note,
        columns => columns.collect::<Vec<Value>>(),
        rows => rows.collect::<Vec<Value>>(),
        marked => table.rows.iter().any(|row| row.tone.is_some()),
    }
}

fn heat_map(map: &Heat) -> Value {
    let worst = heat::worst(map);
    let rows = map.rows.iter().enumerate().map(|(row_index, row)| {
        let cells = row.cells.iter().enumerate().map(|(column_index, cell)| {
            context! {
                text => heat::cell(*cell),
                step => cell.filter(|value| value.is_finite()).map(heat::step),
                worst => worst == Some((row_index, column_index)),
            }
        });
        context! { label => &row.label, cells => cells.collect::<Vec<Value>>() }
    });
    context! {
        title => &map.title,
        note => &map.note,
        unit => &map.unit,
        columns => list(map.columns.iter()),
        rows => rows.collect::<Vec<Value>>(),
        has_worst => worst.is_some(),
    }
}

fn group(group: &PlotGroup) -> Value {
    let panels = group.panels.iter().enumerate().map(|(index, panel)| {
        let next = group.panels.get(index + 1);
        let with_x_label = next.is_none_or(|next| next.x_label != panel.x_label);
        context! {
            y_label => &panel.y_label,
            drawing => Value::from_safe_string(still::panel(group, panel, with_x_label)),
            legend => legend(panel),
            band => panel.band.as_ref().map(|band| &band.label),
        }
    });
    context! {
        id => &group.id,
        title => &group.title,
        note => &group.note,
        extent => extent(group),
        contact => group.contact.is_some(),
        panels => panels.collect::<Vec<Value>>(),
        data => Value::from_safe_string(live::json(group)),
    }
}

fn legend(panel: &Panel) -> Vec<Value> {
    let entry = |(curve, dash): (&super::page::Curve, String)| {
        let class = format!("{}{dash}", still::class(curve.role));
        context! { label => &curve.label, class }
    };
    panel.curves.iter().zip(still::dashes(&panel.curves)).map(entry).collect()
}

/// Window and sample count of a group, in words.
fn extent(group: &PlotGroup) -> String {
    let Some(panel) = group.panels.iter().max_by_key(|panel| panel.x.len()) else {
        return String::new();
    };
    let (Some(first), Some(last)) = (panel.x.first(), panel.x.last()) else {
        return "no samples".to_owned();
    };
    let unit = unit_of(&panel.x_label);
    let mut text = format!("{} samples, {} to {} {unit}", panel.x.len(), number(*first), number(*last));
    if let Some((begin, end)) = group.contact {
        text.push_str(&format!("; contact {} to {} {unit} (shaded)", number(begin), number(end)));
    }
    if live::is_thinned(group) {
        text.push_str("; thinned for drawing, minimum and maximum of every group of samples are kept");
    }
    text
}

fn loop_plot(plot: &XyPlot) -> Value {
    let legend = plot.curves.iter().map(|curve| {
        let class = format!("{}{}", still::class(curve.role), loops::dash(curve.role));
        context! { label => &curve.label, class }
    });
    context! {
        title => &plot.title,
        drawing => Value::from_safe_string(loops::plot(plot)),
        legend => legend.collect::<Vec<Value>>(),
    }
}

fn chart_of(chart: &Chart) -> Value {
    let legend = chart.curves.iter().map(|curve| {
        let class = format!("{}{}", still::class(curve.role), loops::dash(curve.role));
        context! { label => &curve.label, class }
    });
    context! {
        title => &chart.title,
        untold => chart.untold.iter().any(|strip| !strip.is_empty()),
        drawing => Value::from_safe_string(chart::drawing(chart)),
        legend => legend.collect::<Vec<Value>>(),
    }
}

fn ladder_channels(page: &Page) -> Option<Value> {
    let ladder = page.ladder.as_ref()?;
    let channels = ladder.channels.iter().map(|channel| {
        context! { label => &channel.label, drawing => Value::from_safe_string(ladder::channel(channel)) }
    });
    Some(context! { note => &ladder.note, channels => channels.collect::<Vec<Value>>() })
}
