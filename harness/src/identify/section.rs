//! The section of the model that an identification writes.

use super::robot::{AxisIdentification, RobotIdentification};
use crate::model::{Editor, RobotForm};
use sim_core::identification::Form;

/// Every key of an axis.
const KEYS: [&str; 7] = [
    "form",
    "natural_frequency_hz",
    "natural_frequency_sd_hz",
    "damping_ratio",
    "damping_ratio_sd",
    "dead_time_s",
    "dead_time_sd_s",
];

/// The form as the model names it.
pub(super) fn form(form: Form) -> RobotForm {
    match form {
        Form::Lag => RobotForm::Lag,
        Form::DeadTime => RobotForm::DeadTime,
        Form::Both => RobotForm::LagAndDeadTime,
    }
}

/// Puts every axis that is decided into a model; other axes stay.
pub fn write_robot(editor: &mut Editor, robot: &RobotIdentification, source: &str) {
    editor.set_table(&["robot"], &[("source", source.into())]);
    for axis in robot.axes.iter().filter(|axis| axis.is_decided) {
        write_axis(editor, axis);
    }
}

fn write_axis(editor: &mut Editor, axis: &AxisIdentification) {
    let path = ["robot", axis.axis];
    let of = |pair: Option<[f64; 2]>| [pair.map(|pair| pair[0]), pair.map(|pair| pair[1])];
    let [frequency, frequency_sd] = of(axis.natural_frequency_hz);
    let [damping, damping_sd] = of(axis.damping_ratio);
    let [dead, dead_sd] = of(axis.dead_time_s);
    editor.set_table(&path, &[(KEYS[0], axis.form.into())]);
    for (key, value) in KEYS[1..].iter().zip([frequency, frequency_sd, damping, damping_sd, dead, dead_sd]) {
        match value {
            Some(value) => editor.set_table(&path, &[(key, value.into())]),
            // What belongs to another form would contradict this one.
            None => editor.remove_key(&path, key),
        }
    }
}
