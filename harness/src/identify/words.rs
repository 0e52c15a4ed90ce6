//! An identification in words: what lies between command and pose, why not something else, and from which data.

use super::robot::{AxisIdentification, Excited, RobotIdentification};
use super::steps::{Coupling, Stepped};
use sim_core::identification::{Form, Way};

/// An excursion of fewer standard deviations of its noise is not shown as one.
const NOISES: f64 = 4.0;

/// The whole result as text.
pub fn text(robot: &RobotIdentification) -> String {
    let lines: Vec<String> = robot.axes.iter().flat_map(axis_lines).collect();
    lines.join("\n") + "\n"
}

fn axis_lines(axis: &AxisIdentification) -> Vec<String> {
    let way = axis.choice.way();
    let mut lines = vec![format!(
        "{}: {}; delay at low frequency {:.2} ms",
        axis.axis,
        way_words(way),
        axis.equivalent_delay_s * 1e3
    )];
    let others = axis.choice.ways.iter().filter(|other| other.form != way.form);
    for other in others {
        let ratio = other.residual_rms / way.residual_rms;
        let verdict = match (other.form, axis.is_decided) {
            (Form::Both, _) => "not needed: it would count one delay twice",
            (_, true) => "the data refuse it",
            (_, false) => "the data do not refuse it",
        };
        lines.push(format!("  instead {}: {ratio:.2} times the residual, {verdict}", way_words(other)));
    }
    if !axis.is_decided {
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
    let dead = format!("dead time {:.2} ± {:.2} ms", way.dead_time_s.0 * 1e3, way.dead_time_s.1 * 1e3);
    let Some((lag, sd)) = way.lag else { return format!("{dead} and no lag") };
    let lag = format!(
        "lag of {:.3} ± {:.3} Hz, damping {:.3} ± {:.3}",
        lag.natural_frequency_hz, sd.natural_frequency_hz, lag.damping_ratio, sd.damping_ratio
    );
    match way.form {
        Form::Lag => format!("{lag}, and no dead time"),
        Form::Both | Form::DeadTime => format!("{lag}, and {dead} that it does not explain"),
    }
}

fn step_lines(step: &Stepped, axis: &str) -> Vec<String> {
    let unit = if axis.starts_with("about") { "rad" } else { "m" };
    let read = match (step.overshoot, step.classical_damping) {
        (Some(overshoot), Some(damping)) => {
            let frequency = step.classical_frequency_hz.map_or_else(String::new, |hz| format!(", {hz:.2} Hz"));
            format!("overshoot {:.1} %, by hand damping {damping:.3}{frequency}", overshoot * 100.0)
        }
        _ => "no overshoot".to_owned(),
    };
    let coupling: Vec<String> = step.coupling.iter().map(coupling_words).collect();
    vec![format!("  step of {:.4} {unit} at {:.2} s: {read}; coupled: {}", step.size, step.at_s, coupling.join(", "))]
}

fn coupling_words(other: &Coupling) -> String {
    // The largest of some hundred means of pure noise lies at three of its standard deviations.
    let floor = NOISES * other.noise_percent;
    if other.percent < floor {
        return format!("{} below {floor:.1} %", other.axis);
    }
    format!("{} {:.1} ± {:.1} %", other.axis, other.percent, other.noise_percent)
}

fn excited_lines(excited: &Excited) -> Vec<String> {
    let mut lines = vec![format!(
        "  excited in {}: mean delay {:.3} ± {:.3} ms",
        excited.file,
        excited.mean_delay_s[0] * 1e3,
        excited.mean_delay_s[1] * 1e3
    )];
    lines.push(format!("  {:>10} {:>20} {:>20}", "Hz", "gain", "delay in ms"));
    for [frequency_hz, _, gain, gain_sd, delay_s, delay_sd] in &excited.lines {
        let (gain, delay) =
            (format!("{gain:.4} ± {gain_sd:.4}"), format!("{:.2} ± {:.2}", delay_s * 1e3, delay_sd * 1e3));
        lines.push(format!("  {frequency_hz:>10.4} {gain:>20} {delay:>20}"));
    }
    lines
}
