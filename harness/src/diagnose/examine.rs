//! Before any physics is blamed: is each recording what it says it is?
//!
//! The order is that of how sure one can be. Findings of the reader (stale or broken streams) come first, then axes and signs of
//! the force stream, then the software block: clock, mass, compensator. A recording that differs from the others in one of
//! these is odd and takes no part in the fit; what all of them share is an answer.

use super::gaps::Gaps;
use super::software::{Software, examine};
use crate::case::{Case, Channel};
use crate::model::{Chosen, Model};
use crate::recording::{Session, Severity};
use rayon::prelude::*;

/// What was found in one recording.
#[derive(Debug, Clone)]
pub struct Examined {
    /// Software block; `None` for a drive.
    pub software: Option<Software>,
    /// Why this recording is not what it says it is, if it is not.
    pub defect: Option<String>,
    /// Everything else worth saying.
    pub notes: Vec<String>,
}

/// What all impacts share.
#[derive(Debug, Clone, Default)]
pub struct Shared {
    /// Offset between the clocks, s.
    pub clock_offset_s: f64,
    /// True over declared mass.
    pub mass_ratio: f64,
    /// Mass that most of the impacts were made with, kg.
    pub mass_kg: f64,
    /// The force stream carries something else than it says: a sentence.
    pub convention: Option<String>,
}

/// Two values differ beyond this many standard deviations.
const SURE: f64 = 4.0;

/// Ways in which a force stream can be mislabelled.
const MISLABELLED: [(&str, usize, f64); 5] = [
    ("its sign along z is reversed", 2, -1.0),
    ("its x axis carries what z should", 0, 1.0),
    ("its x axis carries what z should, reversed", 0, -1.0),
    ("its y axis carries what z should", 1, 1.0),
    ("its y axis carries what z should, reversed", 1, -1.0),
];

/// Examines recordings that are already on the clocks of the model.
pub fn all(
    model: &Model,
    sessions: &[&Session],
    cases: &[Case],
    effects: &[Chosen],
    delay: &Chosen,
) -> (Vec<Examined>, Shared) {
    let found: Vec<Software> = cases.par_iter().map(|case| examine(model, case, effects, delay)).collect();
    let impacts: Vec<usize> = (0..cases.len()).filter(|&i| cases[i].is_impact()).collect();
    // Only what closes the block is an answer; a value that merely balances it better is not.
    let sure = || impacts.iter().filter(|&&i| found[i].is_judged() && found[i].explained());
    let clock_offset_s = most_common(sure().map(|&i| (found[i].clock_offset_s, 0.0)), 0.0);
    let mass_ratio = most_common(sure().map(|&i| (found[i].mass_ratio, found[i].mass_ratio_sd)), 1.0);
    let mass_kg = most_common(impacts.iter().map(|&i| (cases[i].mass_kg, 0.0)), model.plant.mass_kg) * mass_ratio;
    let unexplained: Vec<usize> = impacts.iter().copied().filter(|&i| !found[i].explained()).collect();
    let convention = if unexplained.len() * 2 > impacts.len() {
        mislabelled(model, cases, &unexplained, effects, delay)
    } else {
        None
    };
    let examined = sessions
        .iter()
        .zip(cases)
        .zip(found)
        .map(|((session, case), software)| one(session, case, software, clock_offset_s, mass_ratio))
        .collect();
    (examined, Shared { clock_offset_s, mass_ratio, mass_kg, convention })
}

fn one(session: &Session, case: &Case, software: Software, clock_offset_s: f64, mass_ratio: f64) -> Examined {
    let broken = session.findings.iter().find(|finding| finding.severity == Severity::Defect);
    let mut defect = broken.map(|finding| format!("{}: {}", finding.topic, finding.what));
    let mut notes: Vec<String> = session
        .findings
        .iter()
        .filter(|finding| finding.severity == Severity::Warning)
        .map(|finding| format!("{}: {}; {}", finding.topic, finding.what, finding.consequence))
        .collect();
    notes.extend(software.gaps.as_ref().map(Gaps::words));
    notes.extend(software.other_pose().map(|words| format!("the software block closes {words}")));
    if case.is_impact() && !software.closes() {
        if software.explained() && (software.clock_offset_s - clock_offset_s).abs() > 1e-6 {
            let apart_ms = (software.clock_offset_s - clock_offset_s) * 1e3;
            defect = defect.or(Some(format!(
                "its force stream is stamped {apart_ms:+.1} ms against the robot's, the others' is not"
            )));
        }
        if software.explained() && (software.mass_ratio - mass_ratio).abs() > 1e-5 + SURE * software.mass_ratio_sd {
            let what = format!(
                "its record says {:.6} kg, but its commands were made with {:.6} kg",
                case.mass_kg,
                case.mass_kg * software.mass_ratio
            );
            defect = defect.or(Some(what));
        }
        notes.push(words(&software, case));
    }
    Examined { software: Some(software), defect, notes }
}

/// What the software block found, in a sentence.
pub fn words(software: &Software, case: &Case) -> String {
    let mut causes = Vec::new();
    if software.clock_offset_s != 0.0 && software.explained() {
        causes.push(format!("the force's stamps are {:+.1} ms late", software.clock_offset_s * 1e3));
    }
    if (software.mass_ratio - 1.0).abs() > 1e-6 {
        causes.push(format!("the mass was {:.4} kg, not {:.4} kg", case.mass_kg * software.mass_ratio, case.mass_kg));
    }
    if software.bias_error_n.abs() > 1e-6 {
        causes.push(format!("the compensator took out {:+.4} N more than declared", software.bias_error_n));
    }
    if let Some(delay_s) = software.pose_delay_s.filter(|delay_s| *delay_s != 0.0) {
        causes.push(format!("the controller's own pose is {:+.3} ms later than declared", delay_s * 1e3));
    }
    match (software.explained(), causes.is_empty()) {
        (true, true) => "the software block closes".into(),
        (true, false) => format!("the software block closes once {}", causes.join(" and ")),
        (false, _) => "the software block does not close: the controller's own pose is not the delayed command (robot, losses, jitter), or the compensator is not as declared".into(),
    }
}

/// The value that most of them share, to rounding and to how well each is known; the first of the most frequent.
fn most_common(values: impl Iterator<Item = (f64, f64)>, otherwise: f64) -> f64 {
    let values: Vec<(f64, f64)> = values.collect();
    let apart = |(a, sd): (f64, f64), (b, other_sd): (f64, f64)| {
        (a - b).abs() > 1e-6 * (1.0 + a.abs()) + SURE * (sd + other_sd)
    };
    let votes = |value: (f64, f64)| values.iter().filter(|other| !apart(value, **other)).count();
    let mut best = (0, values.first().map_or(otherwise, |first| first.0));
    for &value in &values {
        if votes(value) > best.0 {
            best = (votes(value), value.0);
        }
    }
    best.1
}

/// Whether another axis or sign of the force stream closes what the declared one does not.
fn mislabelled(model: &Model, cases: &[Case], impacts: &[usize], effects: &[Chosen], delay: &Chosen) -> Option<String> {
    let first = &cases[impacts[0]];
    for (words, axis, sign) in MISLABELLED {
        let source = if axis == 2 { &first.sensed_n } else { &first.across_n[axis] };
        let turned = |channel: &Channel| Channel {
            value: channel.value.iter().map(|value| sign * value).collect(),
            known: channel.known.clone(),
        };
        let case = Case { sensed_n: turned(source), ..first.clone() };
        let software = examine(model, &case, effects, delay);
        if software.explained() && software.clock_offset_s == 0.0 {
            return Some(format!("the force stream is not what it says: {words}"));
        }
    }
    None
}
