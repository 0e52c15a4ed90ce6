//! All recordings together: what lies between command and pose on each axis.

use super::axes::{AxisSignal, axes};
use super::steps::{Stepped, steps};
use crate::error::Error;
use crate::model::ROBOT_AXES;
use crate::recording::{Grade, Session};
use serde::Serialize;
use sim_core::identification::excitation::Sampled;
use sim_core::identification::form::DEVIATIONS_MIN;
use sim_core::identification::{Choice, Form, Lag, Line, Spectrum, Way, spectrum};

/// A command that changes in more than this part of its samples is an excitation, and no sequence of steps.
const MOVING: f64 = 0.5;
/// What is left out after an excitation begins, while the robot swings in: four periods at 8 Hz. Chosen.
const SETTLE_S: f64 = 0.5;
/// An excitation shorter than this shows too few periods. Chosen.
const EXCITATION_MIN_S: f64 = 2.0;

/// What shows a robot.
pub(super) const RECORD_INSTEAD: &str = "record steps of one axis at a time, each held for half a second and 20 times larger than \
                                         the noise, or free flight under a multi-sine of two seconds or more";

/// A robot.
#[derive(Debug, Clone, Serialize)]
pub struct RobotIdentification {
    /// Every axis that moved.
    pub axes: Vec<AxisIdentification>,
    /// What is to be known of the recordings: each one that is not whole.
    pub findings: Vec<String>,
}

/// One axis.
#[derive(Debug, Clone, Serialize)]
pub struct AxisIdentification {
    /// Its name, as in the model.
    pub axis: &'static str,
    /// The form that fits best.
    pub form: &'static str,
    /// Whether its numbers are determined and the other forms are out of the question; only then it is claimed, and written.
    pub is_decided: bool,
    /// Whether its numbers are determined: each known to 25 %, or a dead time to a millisecond. Only then they stand here.
    pub is_determined: bool,
    /// Natural frequency and its standard deviation.
    pub natural_frequency_hz: Option<[f64; 2]>,
    /// Damping ratio and its standard deviation.
    pub damping_ratio: Option<[f64; 2]>,
    /// Dead time and its standard deviation.
    pub dead_time_s: Option<[f64; 2]>,
    /// Delay at low frequency of all of it, if the data determine it.
    pub equivalent_delay_s: Option<f64>,
    /// Steps that it was learned from.
    pub steps: Vec<Stepped>,
    /// Excitations that it was learned from.
    pub excitations: Vec<Excited>,
    /// All forms, over all steps and excitations.
    #[serde(skip)]
    pub choice: Choice,
}

/// One excitation.
#[derive(Debug, Clone, Serialize)]
pub struct Excited {
    /// The recording.
    pub file: String,
    /// Mean delay of the lines, and its standard deviation.
    pub mean_delay_s: [f64; 2],
    /// Every excited frequency: Hz, amplitude, gain and its standard deviation, delay in s and its standard deviation.
    pub lines: Vec<[f64; 6]>,
}

/// Identifies.
///
/// # Errors
/// When a recording lacks command or pose, or none of them moves any axis in a way that can be learned from.
pub fn identify_robot(sessions: &[Session]) -> Result<RobotIdentification, Error> {
    let mut stepped: [Vec<Stepped>; 6] = Default::default();
    let mut excited: [Vec<(Excited, Choice)>; 6] = Default::default();
    for session in sessions {
        let all = axes(session)?;
        for axis in 0..6 {
            let changes = all[axis].changes().len();
            if changes as f64 > MOVING * all[axis].command.len() as f64 {
                excited[axis].extend(excitation(&all[axis], session));
            } else if changes > 0 {
                stepped[axis].extend(steps(&all, axis));
            }
        }
    }
    let of = stepped.into_iter().zip(excited).zip(ROBOT_AXES);
    let found: Vec<AxisIdentification> = of.filter_map(|((steps, excited), axis)| one(axis, steps, excited)).collect();
    if found.is_empty() {
        let what = "no axis makes a step that can be learned from, and none is excited";
        let bare = Error::new(what).help(RECORD_INSTEAD);
        return Err(match sessions {
            [only] => bare.file(&only.file),
            _ => bare.place(format!("{} recordings", sessions.len())),
        });
    }
    match found.iter().find(|axis| comes_early(axis.choice.way())) {
        Some(axis) => Err(early(axis)),
        None => Ok(RobotIdentification { axes: found, findings: gradings(sessions) }),
    }
}

/// Each recording that is not whole, with its grade.
pub fn gradings(sessions: &[Session]) -> Vec<String> {
    let worse = sessions.iter().filter(|session| session.grade != Grade::A);
    worse.map(|one| format!("{}: grade {:?}, {}", one.file.display(), one.grade, one.grade.about())).collect()
}

/// Whether the pose comes before its command by more than the data leave open.
fn comes_early(way: &Way) -> bool {
    way.equivalent_delay_s() < -DEVIATIONS_MIN * way.dead_time_s.1
}

fn early(axis: &AxisIdentification) -> Error {
    let early_ms = -1e3 * axis.choice.way().equivalent_delay_s();
    Error::new(format!("{}: the pose comes {early_ms:.2} ms before its command", axis.axis))
        .place("clocks of command and pose")
        .help("date both by one clock: clock = \"log\" in the map given with --map, or clock_of for one of them")
}

fn excitation(signal: &AxisSignal, session: &Session) -> Option<(Excited, Choice)> {
    let changes = signal.changes();
    let (begin_s, end_s) = (changes.first()?.0, changes.last()?.0);
    if end_s - begin_s < EXCITATION_MIN_S {
        return None;
    }
    let middle_s = 0.5 * (begin_s + end_s);
    let cut = |times: &[f64], values: &[f64], from_s: f64| {
        let first = times.partition_point(|time| *time < from_s);
        let last = times.partition_point(|time| *time <= end_s);
        let centred: Vec<f64> = times[first..last].iter().map(|time| time - middle_s).collect();
        (centred, values[first..last].to_vec())
    };
    let command = cut(&signal.command_s, &signal.command, begin_s);
    let pose = cut(&signal.pose_s, &signal.pose, begin_s + SETTLE_S);
    let Spectrum { lines, mean_delay_s, choice } =
        spectrum(&Sampled { time_s: &command.0, value: &command.1 }, &Sampled { time_s: &pose.0, value: &pose.1 })?;
    let line = |line: &Line| {
        [line.frequency_hz, line.amplitude, line.gain, line.gain_deviation, line.delay_s, line.delay_deviation_s()]
    };
    let excited = Excited {
        file: session.file.display().to_string(),
        mean_delay_s: [mean_delay_s.0, mean_delay_s.1],
        lines: lines.iter().map(line).collect(),
    };
    Some((excited, choice))
}

fn one(axis: &'static str, steps: Vec<Stepped>, excited: Vec<(Excited, Choice)>) -> Option<AxisIdentification> {
    let choices: Vec<&Choice> = steps.iter().map(|step| &step.choice).chain(excited.iter().map(|(_, c)| c)).collect();
    let forms = [Form::DeadTime, Form::Lag, Form::Both];
    let choice = Choice::of(forms.into_iter().filter_map(|form| together(form, &choices)).collect())?;
    let way = *choice.way();
    let (is_decided, is_determined) = (choice.is_decided(), way.is_determined());
    let equivalent_delay_s = match choice.delay_of_either_s() {
        Some((delay_s, _)) if !is_decided => Some(delay_s),
        _ => is_determined.then(|| way.equivalent_delay_s()),
    };
    // Below 0 within its scatter is 0.
    let dead_time_s =
        (is_determined && way.form != Form::Lag).then_some([way.dead_time_s.0.max(0.0), way.dead_time_s.1]);
    let lag = way.lag.filter(|_| is_determined);
    Some(AxisIdentification {
        axis,
        form: super::section::form(way.form).id(),
        is_decided,
        is_determined,
        natural_frequency_hz: lag.map(|(lag, sd)| [lag.natural_frequency_hz, sd.natural_frequency_hz]),
        damping_ratio: lag.map(|(lag, sd)| [lag.damping_ratio, sd.damping_ratio]),
        dead_time_s,
        equivalent_delay_s: equivalent_delay_s.map(|delay_s| delay_s.max(0.0)),
        steps,
        excitations: excited.into_iter().map(|(excited, _)| excited).collect(),
        choice,
    })
}

/// One form over all tests of an axis: the mean of its numbers, each weighed by its scatter; the criteria add up.
fn together(form: Form, choices: &[&Choice]) -> Option<Way> {
    // A form must be possible in every test, and of several fits in one test the best counts.
    let best = |choice: &&Choice| {
        let own = choice.ways.iter().filter(|way| way.form == form);
        own.min_by(|one, other| one.criterion.total_cmp(&other.criterion)).copied()
    };
    let ways: Option<Vec<Way>> = choices.iter().map(best).collect();
    let ways = ways.filter(|ways| !ways.is_empty())?;
    let of = |pick: &dyn Fn(&Way) -> (f64, f64)| weighed(&ways.iter().map(pick).collect::<Vec<_>>());
    let lag = ways[0].lag.is_some().then(|| {
        let frequency =
            of(&|way| way.lag.map_or((0.0, 0.0), |(l, sd)| (l.natural_frequency_hz, sd.natural_frequency_hz)));
        let damping = of(&|way| way.lag.map_or((0.0, 0.0), |(l, sd)| (l.damping_ratio, sd.damping_ratio)));
        let lag = |frequency: f64, damping: f64| Lag { natural_frequency_hz: frequency, damping_ratio: damping };
        (lag(frequency.0, damping.0), lag(frequency.1, damping.1))
    });
    let count = ways.len() as f64;
    Some(Way {
        form,
        lag,
        dead_time_s: if form == Form::Lag { (0.0, 0.0) } else { of(&|way| way.dead_time_s) },
        gain: ways.iter().map(|way| way.gain).sum::<f64>() / count,
        residual_rms: ways.iter().map(|way| way.residual_rms).sum::<f64>() / count,
        criterion: ways.iter().map(|way| way.criterion).sum(),
    })
}

/// Mean by inverse variance, with the larger of the stated and the seen standard deviation.
fn weighed(values: &[(f64, f64)]) -> (f64, f64) {
    // A fit without any scatter would weigh infinitely.
    let weight = |sd: f64| 1.0 / (sd * sd).max(f64::MIN_POSITIVE);
    let sum: f64 = values.iter().map(|(_, sd)| weight(*sd)).sum();
    if sum <= 0.0 {
        // Nobody knows anything.
        return values.first().copied().unwrap_or((0.0, f64::INFINITY));
    }
    let mean = values.iter().map(|(value, sd)| value * weight(*sd)).sum::<f64>() / sum;
    let count = values.len() as f64;
    let seen = values.iter().map(|(value, _)| (value - mean) * (value - mean)).sum::<f64>();
    let seen = if values.len() > 1 { (seen / (count * (count - 1.0))).sqrt() } else { 0.0 };
    (mean, (1.0 / sum).sqrt().max(seen))
}
