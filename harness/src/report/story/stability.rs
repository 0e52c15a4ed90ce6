//! The stability of a loop: stable or not, how far from the edge, who contributes what, what to change.

use super::super::page::{Chart, Page, Role, Row, Section, Table, Tone, XyCurve};
use super::table::{numbers, row, table, words as text};
use super::words::{Scale, figures, value};
use crate::stability::{Answer, Budgeted, Domain, Margin, Side};
use sim_core::stability::exact::critical_delay;

/// A slower growth is rounding: it doubles in thirty years.
const NEUTRAL_PER_S: f64 = 1e-9;
/// A larger share of an edge near 0 says nothing.
const PER_CENT_MAX: f64 = 1000.0;
/// Points of the closed form over a chart.
const CURVE_POINTS: usize = 200;

/// The answer as a page.
pub fn stability_page(
    title: &str,
    answer: &Answer,
    domain: Option<&Domain>,
    command: &str,
    provenance: &[(String, String)],
) -> Page {
    Page {
        title: title.to_owned(),
        tone: tone(answer),
        verdict: verdict(answer),
        sentences: sentences(answer),
        command: command.to_owned(),
        heat: Vec::new(),
        plots: Vec::new(),
        loops: Vec::new(),
        charts: domain.map(|domain| chart(Some(answer), domain)).into_iter().collect(),
        tables: tables(answer),
        ladder: None,
        provenance: provenance.to_vec(),
    }
}

fn tone(answer: &Answer) -> Tone {
    match answer.stable {
        _ if !answer.undecided_by.is_empty() => Tone::Warning,
        Some(true) => Tone::Good,
        Some(false) => Tone::Bad,
        None => Tone::Warning,
    }
}

/// `undecided; without its compensation: `, before what the linear loop does.
pub(super) fn without(undecided_by: &[String]) -> String {
    if undecided_by.is_empty() { String::new() } else { format!("undecided; without {}: ", undecided_by.join(", ")) }
}

/// The nearer edge of the damping: `3 N s/m less damping`, or `3 N s/m more damping`.
pub(super) fn nearer(low: Option<&Margin>, high: Option<&Margin>, along: &str) -> Option<String> {
    let low = low.filter(|found| found.distance > 0.0);
    match (low, high.filter(|found| found.distance > 0.0)) {
        (Some(low), Some(high)) if high.distance < low.distance => {
            Some(format!("{} more damping{along}", margin(high, "N s/m")))
        }
        (Some(low), _) => Some(format!("{} of damping{along}", margin(low, "N s/m"))),
        (None, Some(high)) => Some(format!("{} more damping{along}", margin(high, "N s/m"))),
        (None, None) => None,
    }
}

/// `2 ms (12 % of the edge)`.
pub(super) fn margin(margin: &Margin, unit: &str) -> String {
    let told = margin.per_cent.filter(|share| share.abs() < PER_CENT_MAX);
    let share = told.map(|share| format!(" ({} % of the edge)", figures(share.abs(), 2))).unwrap_or_default();
    format!("{}{share}", value(margin.distance.abs(), unit))
}

fn verdict(answer: &Answer) -> String {
    format!("{}{}", without(&answer.undecided_by), linear(answer))
}

/// What the linear loop does.
fn linear(answer: &Answer) -> String {
    match answer.stable {
        None => format!("stable below a dead time of {}", value(answer.critical_delay_s.unwrap_or(0.0), "s")),
        Some(false) if answer.growth_per_s.is_some_and(|growth| growth.abs() < NEUTRAL_PER_S) => {
            "on the edge: it neither grows nor decays".to_owned()
        }
        Some(false) if answer.delay_s.is_none() && answer.budget.is_empty() && answer.stiffness_n_per_m > 0.0 => {
            "unstable at any dead time: without positive damping nothing decays".to_owned()
        }
        Some(true) => {
            let found = answer.delay_margin.as_ref().map(|found| format!("{} of delay", margin(found, "s")));
            let searched = answer.delay_searched_s.map(|delay_s| format!("more than {} of delay", value(delay_s, "s")));
            let damping = nearer(answer.damping_margin_low.as_ref(), answer.damping_margin_high.as_ref(), "");
            let margins: Vec<String> = found.or(searched).into_iter().chain(damping).collect();
            match margins.is_empty() {
                true => "stable; no delay and no damping was found that changes it".to_owned(),
                false => format!("stable; margin {}", margins.join(" and ")),
            }
        }
        Some(false) => match (&answer.damping_margin_low, &answer.damping_margin_high) {
            (Some(low), _) if low.distance <= 0.0 => {
                format!("unstable; {} of damping are missing", margin(low, "N s/m"))
            }
            (_, Some(high)) if high.distance <= 0.0 => {
                format!("unstable; {} of damping are too much", margin(high, "N s/m"))
            }
            _ => "unstable; no damping alone makes it stable".to_owned(),
        },
    }
}

fn sentences(answer: &Answer) -> Vec<String> {
    let mut said = Vec::new();
    let stable = answer.stable == Some(true);
    if !answer.undecided_by.is_empty() {
        said.push(format!(
            "The linear loop leaves out {}, which may turn this round: run the loop to see it.",
            answer.undecided_by.join(", ")
        ));
    }
    if let Some(growth) = answer.growth_per_s.filter(|growth| growth.abs() < NEUTRAL_PER_S) {
        said.push(format!("It neither grows nor decays ({growth:.0e} 1/s)."));
    } else if let Some(growth) = answer.growth_per_s {
        let doubling = std::f64::consts::LN_2 / growth.abs();
        let verb = if growth < 0.0 { "halves" } else { "doubles" };
        said.push(format!("The slowest motion {verb} in {}.", value(doubling, "s")));
    }
    if answer.stiffness_n_per_m < 0.0 {
        said.push(
            "The stiffness is negative: the contact pushes apart what it should hold, at any delay and any damping. A device \
             preloaded too far does this; let its springs out, or add a stiffness in software that outweighs it."
                .to_owned(),
        );
    } else if answer.too_heavy_a_tool {
        said.push(
            "The sensor feels at least as much undeclared mass as the satellites have: unstable in free flight, whatever the \
             damping. Declare the tool's mass, or simulate a heavier satellite."
                .to_owned(),
        );
    }
    said.extend(largest(&answer.budget, answer.delay_s));
    if let (Some(delay_s), Some(critical_s)) = (answer.delay_s, answer.critical_delay_s) {
        let pade = answer.pade_critical_delay_s.map(|pade_s| format!(" (Padé would say {})", value(pade_s, "s")));
        said.push(format!(
            "One dead time of {} stands for the loop; by the closed form it may be {} with this damping{}.",
            value(delay_s, "s"),
            value(critical_s, "s"),
            pade.unwrap_or_default()
        ));
    }
    said.extend(one_sided(answer));
    said.extend(advice(answer, stable));
    said.extend(answer.left_out.iter().map(|left| format!("Not in this prediction: {left}.")));
    said
}

/// Who takes most of the delay.
pub(super) fn largest(budget: &[Budgeted], delay_s: Option<f64>) -> Option<String> {
    let worst = budget.iter().max_by(|a, b| a.contribution_s.total_cmp(&b.contribution_s))?;
    let (all, part) = (value(delay_s.unwrap_or(0.0), "s"), value(worst.contribution_s, "s"));
    Some(format!("Largest contributor to the delay of {all}: {}, {part}.", worst.name))
}

/// The impact, in two digits where one delay stands for several.
fn one_sided(answer: &Answer) -> Option<String> {
    let found = answer.one_sided.as_ref()?;
    let lumped = !answer.budget.is_empty();
    let digits = if lumped { 2 } else { 4 };
    let damping = |edge: f64| if lumped { with_unit(edge, "N s/m") } else { value(edge, "N s/m") };
    let impact = found.restitution.map(|restitution| {
        let word = match restitution {
            e if e > 1.0 + 1e-12 => "creates energy",
            e if e < 1.0 - 1e-12 => "loses energy",
            _ => "keeps its energy",
        };
        format!("an impact has restitution {} and {word}", figures(restitution, digits))
    })?;
    let edge = match (found.neutral_damping_n_s_per_m, found.neutral_damping_high_n_s_per_m) {
        (Some(low), Some(high)) => format!("it loses energy between {} and {}", damping(low), damping(high)),
        (Some(low), None) => format!("it loses energy from {} on", damping(low)),
        (None, _) => "no damping makes it lose energy".to_owned(),
    };
    let caveat = if lumped { ", with one dead time for all of the delay" } else { "" };
    Some(format!(
        "With contact that never pulls, and so ends at zero force, {impact}; {edge} (computed{caveat}; not the linear boundary)."
    ))
}

/// Two digits and the unit.
fn with_unit(value: f64, unit: &str) -> String {
    Scale::of(unit, value).figures(value, 2)
}

fn advice(answer: &Answer, stable: bool) -> Option<String> {
    if stable || answer.stable.is_none() {
        return None;
    }
    let interval = answer.sampled.as_ref().map_or(answer.damping_interval, |sampled| sampled.virtual_damping);
    let mut ways: Vec<String> = Vec::new();
    if let Some(edges) = interval {
        let low = value(edges.low_n_s_per_m, "N s/m");
        let high = edges.high_n_s_per_m.map(|high| format!(" and {}", value(high, "N s/m"))).unwrap_or_default();
        let kind = if answer.sampled.is_some() { "virtual damping" } else { "damping" };
        ways.push(if high.is_empty() { format!("{kind} above {low}") } else { format!("{kind} between {low}{high}") });
    }
    if let Some(margin) = answer.delay_margin.as_ref().filter(|margin| margin.distance < 0.0)
        && answer.delay_s.is_some_and(|delay_s| -margin.distance < delay_s)
    {
        ways.push(format!("{} less delay", value(-margin.distance, "s")));
    }
    if let (Some(delay_s), Some(longest_s)) = (answer.delay_s, answer.longest_delay_s)
        && delay_s > longest_s
    {
        // The longest delay goes with the root of 1/k.
        let ratio = longest_s / delay_s;
        let softer = value(answer.stiffness_n_per_m * ratio * ratio, "N/m");
        ways.push(format!("a contact softer than {softer}, which some damping can then stabilise"));
    }
    (!ways.is_empty()).then(|| format!("To make it stable: {}.", ways.join("; or ")))
}

fn tables(answer: &Answer) -> Vec<Table> {
    let note = "τ = Σ kᵢ τᵢ / k: to first order the loop sees one delay. Good to some 2 %; the verdict is from the sampled loop.";
    [budget_table(&answer.budget, answer.delay_s, note), numbers_table(answer)].into_iter().flatten().collect()
}

/// Who makes the force late, and what that costs.
pub(super) fn budget_table(budget: &[Budgeted], delay_s: Option<f64>, note: &str) -> Option<Table> {
    let ms = |delay_s: f64| figures(delay_s * 1e3, 4);
    let line = |line: &Budgeted| {
        let damping = line.damping_n_s_per_m.map_or("–".to_owned(), |damping| figures(damping, 3));
        row(None, vec![line.name.clone(), line.path.to_owned(), ms(line.delay_s), ms(line.contribution_s), damping])
    };
    let mut rows: Vec<Row> = budget.iter().map(line).collect();
    if let Some(delay_s) = delay_s.filter(|_| !rows.is_empty()) {
        let all: Option<f64> = budget.iter().map(|line| line.damping_n_s_per_m).sum();
        let needed = all.map_or("–".to_owned(), |damping| figures(damping, 3));
        rows.push(row(None, vec!["all together".into(), String::new(), String::new(), ms(delay_s), needed]));
    }
    let columns = vec![
        text("who makes the force late"),
        text("stiffness"),
        numbers("delay in ms"),
        numbers("its share of the whole in ms"),
        numbers("damping it costs in N s/m"),
    ];
    table(Section::Quantities, "Delay budget", note, columns, rows)
}

fn numbers_table(answer: &Answer) -> Option<Table> {
    let mut rows = Vec::new();
    let mut add =
        |name: &str, shown: Option<String>| rows.push(row(None, vec![name.to_owned(), shown.unwrap_or("–".into())]));
    let edges = |edges: &crate::stability::Edges| {
        let high = edges.high_n_s_per_m.map_or("without end".to_owned(), |high| value(high, "N s/m"));
        format!("{} to {high}", value(edges.low_n_s_per_m, "N s/m"))
    };
    let mass = if answer.budget.is_empty() { "reduced mass" } else { "reduced mass, with what the sensor feels late" };
    add(mass, Some(value(answer.mass_kg, "kg")));
    add("stiffness, hardware and virtual", Some(value(answer.stiffness_n_per_m, "N/m")));
    add("damping, hardware and virtual", Some(value(answer.damping_n_s_per_m, "N s/m")));
    add("critical dead time, closed form", answer.critical_delay_s.map(|delay| value(delay, "s")));
    add("frequency of the oscillation there", answer.critical_frequency_rad_per_s.map(|w| value(w, "rad/s")));
    add("damping that stabilises, closed form", answer.damping_interval.as_ref().map(edges));
    if let Some(sampled) = &answer.sampled {
        add("virtual damping that stabilises, sampled loop", sampled.virtual_damping.as_ref().map(edges));
        add("largest eigenvalue of one tick", Some(format!("{:.6}", sampled.growth_per_tick)));
    }
    let margin_row = |found: &Option<Margin>| found.as_ref().map(|found| value(found.distance, "N s/m"));
    if answer.damping_margin_low.is_some() {
        add("damping that may go", margin_row(&answer.damping_margin_low));
        add("damping that may be added", margin_row(&answer.damping_margin_high));
    }
    add("longest dead time that any damping stabilises", answer.longest_delay_s.map(|delay| value(delay, "s")));
    table(Section::Quantities, "Numbers", "", vec![text("what"), numbers("value")], rows)
}

/// The chart, with the closed form where there is one and both sides of the domain are its own.
pub(super) fn chart(answer: Option<&Answer>, domain: &Domain) -> Chart {
    let (x, y) = (scale(&domain.x), scale(&domain.y));
    let scaled = |strips: &[Vec<(f64, f64)>]| -> Vec<Vec<(f64, f64)>> {
        strips.iter().map(|strip| strip.iter().map(|(a, b)| (a * y.factor, b * y.factor)).collect()).collect()
    };
    Chart {
        title: format!("{} over {}", named(&domain.y), named(&domain.x)),
        x_label: x.label(&named(&domain.x)),
        y_label: y.label(&named(&domain.y)),
        x_range: (domain.x.low * x.factor, domain.x.high * x.factor),
        y_range: (domain.y.low * y.factor, domain.y.high * y.factor),
        strips: scaled(&domain.strips),
        untold: scaled(&domain.untold),
        point: (domain.x.here * x.factor, domain.y.here * y.factor),
        curves: answer.and_then(|answer| closed_form(answer, domain, &x, &y)).into_iter().collect(),
    }
}

/// `virtual_contact.damping_n_s_per_m` as people say it: the unit stands beside it.
fn named(side: &Side) -> String {
    let suffix = match side.unit.as_str() {
        "N/m" => "_n_per_m",
        "N s/m" => "_n_s_per_m",
        "N m/rad" => "_n_m_per_rad",
        "N m s/rad" => "_n_m_s_per_rad",
        "kg" => "_kg",
        "s" => "_s",
        _ => "",
    };
    // Of a list the axis comes last: virtual_contact.damping_n_s_per_m.z.
    let without_unit = side.name.replacen(suffix, "", usize::from(!suffix.is_empty()));
    let name = without_unit.as_str();
    name.strip_prefix("timing.").or(name.strip_prefix("plant.")).unwrap_or(name).replace(['.', '_'], " ")
}

fn scale(side: &Side) -> Scale {
    Scale::of(&side.unit, side.low.abs().max(side.high.abs()))
}

/// Critical dead time over damping: drawn where a cell's chart has delay and virtual damping, as what one delay would say.
fn closed_form(answer: &Answer, domain: &Domain, x: &Scale, y: &Scale) -> Option<XyCurve> {
    if domain.x.name != "timing.command_delay_s" || domain.y.name != "virtual_contact.damping_n_s_per_m" {
        return None;
    }
    let other_s = answer.delay_s? - domain.x.here;
    let hardware = answer.damping_n_s_per_m - domain.y.here;
    let point = |index: usize| {
        let damping = domain.y.low + (domain.y.high - domain.y.low) * index as f64 / CURVE_POINTS as f64;
        let edge = critical_delay(answer.mass_kg, answer.stiffness_n_per_m, damping + hardware);
        (edge.map_or(f64::NAN, |edge| (edge.delay_s - other_s) * x.factor), damping * y.factor)
    };
    let (xs, ys) = (0..=CURVE_POINTS).map(point).unzip();
    Some(XyCurve { label: "closed form for one delay".into(), role: Role::Limit, x: xs, y: ys })
}
