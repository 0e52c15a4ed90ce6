//! `[robot]`: what was identified between a command and the recorded pose, axis by axis.
//!
//! An axis that stands here replaces `timing.command_delay_s` and `timing.measurement_delay_s` for whoever uses it; it never adds
//! to them, since a stated delay may be this very lag.

use super::Sign;
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
