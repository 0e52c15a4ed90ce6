//! An identification in words: what lies between command and pose, why not something else, and from which data.

use super::robot::{AxisIdentification, Excited, RECORD_INSTEAD, RobotIdentification};
use super::steps::{Coupling, Stepped};
use crate::report::story::words::{figures, value, value_with_sd};
use sim_core::identification::form::{DEAD_DEVIATION_MAX_S, DEVIATIONS_MIN};
use sim_core::identification::{Form, Way};

/// An excursion of fewer standard deviations of its noise is not shown as one.
const NOISES: f64 = 4.0;
/// An overshoot below this is called none. Chosen: a fifth of the noise of the smallest step that is learned from.
const OVERSHOOT_MIN: f64 = 0.01;

/// The whole result as text.
pub fn text(robot: &RobotIdentification) -> String {
    let lines = robot.axes.iter().flat_map(axis_lines).chain(robot.findings.iter().cloned());
    lines.collect::<Vec<_>>().join("\n") + "\n"
}

fn axis_lines(axis: &AxisIdentification) -> Vec<String> {
    let way = axis.choice.way();
    let delay = match axis.choice.delay_of_either_s() {
        Some((delay_s, sd_s)) if !axis.is_decided => value_with_sd(delay_s.max(0.0), sd_s, "s"),
        _ => axis.equivalent_delay_s.map_or_else(|| "not determined".to_owned(), |delay_s| value(delay_s, "s")),
    };
    let form = if axis.is_determined { way_words(way) } else { "not determined, whether lag or dead time".to_owned() };
    let mut lines = vec![format!("{}: {form}; delay at low frequency {delay}", axis.axis)];
    let others = axis.choice.ways.iter().filter(|other| axis.is_determined && other.form != way.form);
    for other in others {
        let ratio = figures(other.residual_rms / way.residual_rms, 3);
        let verdict = match (other.form, axis.is_decided) {
            (Form::Both, _) => "not needed: it would count one delay twice",
            (_, true) => "the data refuse it",
            (_, false) => "the data do not refuse it",
        };
        lines.push(format!("  instead {}: {ratio} times the residual, {verdict}", way_words(other)));
    }
    if !axis.is_determined {
        lines.push(format!(
            "  the motion does not show it: at constant speed only the sum of lag and dead time is seen, if at all; {RECORD_INSTEAD}"
        ));
    } else if !axis.is_decided {
        lines.push(
            "  a lag and a dead time look the same here: excite higher frequencies, or record a faster step response"
                .to_owned(),
        );
    }
    lines.extend(axis.steps.iter().flat_map(|step| step_lines(step, axis.axis)));
    lines.extend(axis.excitations.iter().flat_map(excited_lines));
    lines
}

fn way_words(way: &Way) -> String {
    let is_known = way.is_determined();
    let dead_s = way.dead_time_s;
    let dead = match is_known {
        true => format!("dead time {}", value_with_sd(dead_s.0.max(0.0), dead_s.1, "s")),
        false => "dead time not determined".to_owned(),
    };
    let Some((lag, sd)) = way.lag else { return format!("{dead} and no lag") };
    let lag = match is_known {
        true => format!(
            "lag of {}, damping {}",
            value_with_sd(lag.natural_frequency_hz, sd.natural_frequency_hz, "Hz"),
            value_with_sd(lag.damping_ratio, sd.damping_ratio, "1")
        ),
        false => "lag not determined".to_owned(),
    };
    match (way.form, is_known) {
        (Form::Lag, _) => format!("{lag}, and no dead time"),
        (_, false) => "lag and dead time together, not determined".to_owned(),
        (_, true) => format!("{lag}, and {dead} that it does not explain"),
    }
}

fn step_lines(step: &Stepped, axis: &str) -> Vec<String> {
    let unit = if axis.starts_with("about") { "rad" } else { "m" };
    let read = match (step.overshoot, step.classical_damping) {
        (Some(overshoot), Some(damping)) => {
            let frequency = step.classical_frequency_hz.map_or_else(String::new, |hz| format!(", {hz:.2} Hz"));
            format!("overshoot {:.1} %, by hand damping {damping:.3}{frequency}", overshoot * 100.0)
        }
        _ => unread(step.choice.way()),
    };
    let coupling: Vec<String> = step.coupling.iter().map(coupling_words).collect();
    vec![format!("  step of {:.4} {unit} at {:.2} s: {read}; coupled: {}", step.size, step.at_s, coupling.join(", "))]
}

/// What to say where no overshoot is read by hand.
fn unread(way: &Way) -> String {
    match way.lag {
        Some((lag, _)) if way.is_determined() && overshoot(lag.damping_ratio) > OVERSHOOT_MIN => {
            let percent = figures(100.0 * overshoot(lag.damping_ratio), 2);
            format!(
                "overshoot {percent} % by the fit, not to be read by hand (hold the step longer, or make it larger)"
            )
        }
        _ => "no overshoot".to_owned(),
    }
}

/// First overshoot over the step.
fn overshoot(damping: f64) -> f64 {
    if damping < 1.0 { libm::exp(-std::f64::consts::PI * damping / (1.0 - damping * damping).sqrt()) } else { 0.0 }
}

fn coupling_words(other: &Coupling) -> String {
    let floor = NOISES * other.noise_percent;
    if other.percent < floor {
        return format!("{} not resolved below {floor:.1} %", other.axis);
    }
    format!("{} {:.1} ± {:.1} %", other.axis, other.percent, other.noise_percent)
}

fn excited_lines(excited: &Excited) -> Vec<String> {
    let [delay_s, sd_s] = excited.mean_delay_s;
    let is_known = sd_s <= DEAD_DEVIATION_MAX_S || DEVIATIONS_MIN * sd_s <= delay_s;
    let mut lines = vec![format!(
        "  excited in {}: mean delay {}",
        excited.file,
        if is_known { value_with_sd(delay_s, sd_s, "s") } else { "not determined".to_owned() }
    )];
    if excited.lines.is_empty() || !is_known {
        return lines;
    }
    let mut rows = vec![["Hz", "gain", "delay"].map(str::to_owned)];
    rows.extend(excited.lines.iter().map(|[frequency_hz, _, gain, gain_sd, delay_s, delay_sd]| {
        [figures(*frequency_hz, 4), value_with_sd(*gain, *gain_sd, "1"), value_with_sd(*delay_s, *delay_sd, "s")]
    }));
    lines.extend(columns(&rows));
    lines
}

/// Rows as lines, every column as wide as its widest cell.
fn columns(rows: &[[String; 3]]) -> impl Iterator<Item = String> {
    let width = |nth: usize| rows.iter().map(|row| row[nth].chars().count()).max().unwrap_or_default();
    let [first, second, third] = [0, 1, 2].map(width);
    rows.iter().map(move |[a, b, c]| format!("  {a:>first$}   {b:>second$}   {c:>third$}"))
}

#[cfg(test)]
mod tests {
    use super::columns;

    #[test]
    fn a_long_cell_moves_no_other() {
        let rows = [["Hz", "gain", "delay"], ["1.500", "1.000, sd below its last digit", "16.0 ± 0.2 ms"]];
        let lines: Vec<String> = columns(&rows.map(|row| row.map(str::to_owned))).collect();
        assert_eq!(lines[0], "     Hz                             gain           delay");
        assert_eq!(lines[1], "  1.500   1.000, sd below its last digit   16.0 ± 0.2 ms");
    }
}
