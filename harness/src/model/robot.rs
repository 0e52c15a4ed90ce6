//! `[robot]`: what was identified between a command and the recorded pose, axis by axis.
//!
//! An axis that stands here replaces `timing.command_delay_s` and `timing.measurement_delay_s` for whoever uses it; it never adds
//! to them, since a stated delay may be this very lag.

use super::{EffectModel, Model, RigKind, Sign};
use crate::error::Error;
use crate::report::story::words::number;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The robot, as identified: the way from a command to the recorded pose. It replaces the delays of `[timing]`, never adds to
/// them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RobotModel {
    /// Where the numbers come from.
    pub source: String,
    /// Along x of the nozzle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<RobotAxis>,
    /// Along y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<RobotAxis>,
    /// Along z, the axis of approach.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<RobotAxis>,
    /// Turning about x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about_x: Option<RobotAxis>,
    /// Turning about y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about_y: Option<RobotAxis>,
    /// Turning about z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about_z: Option<RobotAxis>,
}

/// One axis of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotAxis {
    /// What lies between command and pose.
    pub form: RobotForm,
    /// Natural frequency of the undamped axis; not for a dead time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub natural_frequency_hz: Option<f64>,
    /// One standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub natural_frequency_sd_hz: Option<f64>,
    /// Damping ratio; not for a dead time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<f64>,
    /// One standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_ratio_sd: Option<f64>,
    /// Dead time that no lag explains; not for a lag.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dead_time_s: Option<f64>,
    /// One standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dead_time_sd_s: Option<f64>,
}

/// What lies between command and pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RobotForm {
    /// A lag of second order, and no dead time.
    Lag,
    /// A dead time, and no lag.
    DeadTime,
    /// Both, fitted together: the dead time is what the lag does not explain.
    LagAndDeadTime,
}

impl RobotForm {
    /// The word that stands for it in files.
    pub const fn id(self) -> &'static str {
        match self {
            RobotForm::Lag => "lag",
            RobotForm::DeadTime => "dead-time",
            RobotForm::LagAndDeadTime => "lag-and-dead-time",
        }
    }
}

/// Names of the axes, in the order of the file.
pub const ROBOT_AXES: [&str; 6] = ["x", "y", "z", "about_x", "about_y", "about_z"];
/// Places of the axes in the file, in the same order.
const PLACES: [&str; 6] = ["robot.x", "robot.y", "robot.z", "robot.about_x", "robot.about_y", "robot.about_z"];

impl RobotModel {
    /// The axes that are given, by the place at which they stand.
    fn axes(&self) -> impl Iterator<Item = (&'static str, RobotAxis)> {
        let all = [self.x, self.y, self.z, self.about_x, self.about_y, self.about_z];
        PLACES.into_iter().zip(all).filter_map(|(place, axis)| Some((place, axis?)))
    }

    /// Every number, with the place of its axis and the sign that it may have.
    pub(super) fn numbers(&self) -> Vec<(&'static str, f64, Sign)> {
        let of = |(place, axis): (&'static str, RobotAxis)| {
            let positive = [axis.natural_frequency_hz, axis.damping_ratio];
            let not_negative =
                [axis.dead_time_s, axis.dead_time_sd_s, axis.natural_frequency_sd_hz, axis.damping_ratio_sd];
            let with = |sign: Sign| move |value: f64| (place, value, sign);
            let positive = positive.into_iter().flatten().map(with(Sign::Positive));
            positive.chain(not_negative.into_iter().flatten().map(with(Sign::NotNegative))).collect::<Vec<_>>()
        };
        self.axes().flat_map(of).collect()
    }

    /// The first axis whose numbers do not belong to its form: place, what is wrong, what to do.
    pub(super) fn contradiction(&self) -> Option<(&'static str, String, String)> {
        self.axes().find_map(|(place, axis)| {
            let has_lag = axis.natural_frequency_hz.is_some() && axis.damping_ratio.is_some();
            let has_no_lag = axis.natural_frequency_hz.is_none() && axis.damping_ratio.is_none();
            let has_dead_time = axis.dead_time_s.is_some();
            let (fits, wanted) = match axis.form {
                RobotForm::Lag => (has_lag && !has_dead_time, "natural_frequency_hz, damping_ratio, no dead_time_s"),
                RobotForm::DeadTime => (has_no_lag && has_dead_time, "dead_time_s alone"),
                RobotForm::LagAndDeadTime => {
                    (has_lag && has_dead_time, "natural_frequency_hz, damping_ratio, dead_time_s")
                }
            };
            let what = format!("{place} is of the form {}, which takes {wanted}", axis.form.id());
            let help = "a dead time and the lag that explains it are the same delay twice: keep what was identified";
            (!fits).then(|| (place, what, help.to_owned()))
        })
    }
}

/// A stated delay this many standard deviations from the identified one, or nearer, is confirmed by it, and is kept: it is what
/// the cell's own software believes to the last digit.
const CONFIRMED_SD: f64 = 3.0;
/// The effect that a lag becomes in the loop.
const LAG: &str = "robot-second-order";

impl Model {
    /// The model as its loop runs: what was identified along z stands in the place of the stated delays. The dead time is that of
    /// the whole way from command to report, so that the command has what the read-back leaves of it; a lag becomes the effect
    /// `robot-second-order`.
    ///
    /// # Errors
    /// When less than one period of the loop is left for the command, or the lag stands in the model twice.
    pub fn with_identified_robot(mut self) -> Result<Self, Error> {
        let Some(axis) = self.robot.as_ref().and_then(|robot| robot.z) else { return Ok(self) };
        let refuse = |what: String, help: &str| Err(Error::new(what).place("table robot.z").help(help));
        if self.rig == RigKind::Drive {
            return refuse("a drive has no robot".to_owned(), "take the table out, or set rig = \"docking\"");
        }
        let timing = &mut self.timing;
        let stated_s = timing.command_delay_s + timing.measurement_delay_s;
        let confirms =
            |dead_time_s: f64| (dead_time_s - stated_s).abs() <= CONFIRMED_SD * axis.dead_time_sd_s.unwrap_or(0.0);
        if axis.form == RobotForm::DeadTime && axis.dead_time_s.is_some_and(confirms) {
            return Ok(self);
        }
        let command_s = axis.dead_time_s.unwrap_or(0.0) - timing.measurement_delay_s;
        if command_s < timing.loop_period_s {
            let (readback_s, period_s) = (timing.measurement_delay_s, timing.loop_period_s);
            let needs = format!("after {readback_s} s of read-back, less than one loop period, {period_s} s");
            if axis.form == RobotForm::Lag {
                let help = "the robot draws a straight line to a command that it must know; take the table out to use the delays of \
                            timing, or state the dead time that is known and the rest as the effect robot-second-order";
                return refuse(
                    format!("is a lag without dead time, which leaves nothing for the command {needs}"),
                    help,
                );
            }
            return refuse(
                format!("leaves {} s for the command {needs}", number(command_s)),
                "the robot draws a straight line to a command that it must know; take the table out to use the delays of timing",
            );
        }
        timing.command_delay_s = command_s;
        if let (Some(frequency), Some(damping)) = (axis.natural_frequency_hz, axis.damping_ratio) {
            if self.effects.iter().any(|effect| effect.id == LAG) {
                let what = format!("holds a lag, and the effect {LAG} holds another one");
                return refuse(what, "keep one of the two: it is the same robot");
            }
            let values = [("natural_frequency_hz", frequency), ("damping_ratio", damping)];
            self.effects.push(EffectModel {
                id: LAG.to_owned(),
                enabled: true,
                source: self.robot.as_ref().map(|robot| robot.source.clone()).unwrap_or_default(),
                values: values.map(|(name, value)| (name.to_owned(), value)).into(),
            });
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(robot: &str) -> Model {
        let text = format!(
            "schema = 1\nname = \"cell\"\nrig = \"docking\"\n[plant]\nmass_kg = 60.0\n[contact]\nstiffness_n_per_m = \
             1000.0\ndamping_n_s_per_m = 6.0\n[timing]\ncommand_delay_s = 0.016\nmeasurement_delay_s = 0.016\n{robot}"
        );
        Model::parse("cell.toml", &text, &sim_core::effects::standard()).unwrap()
    }

    #[test]
    fn what_was_identified_takes_the_place_of_the_stated_delay() {
        let bare = model("");
        assert_eq!(bare.clone().with_identified_robot().unwrap(), bare, "no robot, no change");
        let late = model("[robot.z]\nform = \"dead-time\"\ndead_time_s = 0.04\n").with_identified_robot().unwrap();
        assert!((late.timing.command_delay_s - 0.024).abs() < 1e-15 && late.effects.is_empty());
        let same = "[robot.z]\nform = \"dead-time\"\ndead_time_s = 0.03201\ndead_time_sd_s = 0.00001\n";
        let same = model(same).with_identified_robot().unwrap();
        assert_eq!(same.timing, bare.timing, "a stated delay that is confirmed is kept");
        let lag = "natural_frequency_hz = 10.0\ndamping_ratio = 0.5\ndead_time_s = 0.024\n";
        let lag = model(&format!("[robot.z]\nform = \"lag-and-dead-time\"\n{lag}")).with_identified_robot().unwrap();
        assert!((lag.timing.command_delay_s - 0.008).abs() < 1e-15);
        assert_eq!(lag.effects[0].values["natural_frequency_hz"].to_bits(), 10.0_f64.to_bits());
    }

    #[test]
    fn a_way_that_the_loop_cannot_run_is_refused() {
        let alone = "[robot.z]\nform = \"lag\"\nnatural_frequency_hz = 10.0\ndamping_ratio = 0.5\n";
        let error = model(alone).with_identified_robot().unwrap_err();
        assert!(error.what.contains("less than one loop period"), "{}", error.what);
    }
}
