//! What a number of a cell may be.

use super::config::{Carries, CellConfig, LateConfig, RobotConfig};
use crate::error::Error;
use crate::model::place;

/// Shortest and longest cycle: robot controllers have 4 and 12 ms.
const CYCLE_S: [f64; 2] = [0.001, 0.1];
/// Fastest approach of a start.
pub(super) const SPEED_MAX_M_PER_S: f64 = 10.0;
/// Furthest place: the rail of the facility is 25 m long.
const PLACE_MAX_M: f64 = 100.0;
/// Most digits after the point that a robot controller takes.
const DECIMALS_MAX: u8 = 12;
/// Longest document.
const FRAME_BYTES_MAX: usize = 65_536;
/// A direction is of length 1 to this.
const UNIT: f64 = 1e-6;

impl CellConfig {
    pub(super) fn check(&self, name: &str, text: &str) -> Result<(), Error> {
        let refuse = |key: &str, what: String, help: &str| {
            Err(Error::new(what).file(name).span(text, place::of_key(text, key)).help(help.to_owned()))
        };
        if self.schema != 1 {
            let what = format!("schema = {} is not 1, the only version there is", self.schema);
            return refuse("schema", what, "set schema = 1");
        }
        let [least_s, most_s] = CYCLE_S;
        if !(least_s..=most_s).contains(&self.time.cycle_s) {
            let what = format!("time.cycle_s = {} s is outside [{least_s}, {most_s}]", self.time.cycle_s);
            return refuse("time.cycle_s", what, "give the cycle of the robot controller in seconds: 0.004 or 0.012");
        }
        if beyond(self.start.velocity_m_per_s, SPEED_MAX_M_PER_S) {
            let (value, most) = (self.start.velocity_m_per_s, SPEED_MAX_M_PER_S);
            let what = format!("start.velocity_m_per_s = {value} m/s is outside [-{most}, {most}]");
            return refuse("start.velocity_m_per_s", what, "give the value in the unit of the key");
        }
        let carrying = |what| self.robots.iter().filter(|robot| robot.carries == what).count();
        if carrying(Carries::Probe) != 1 || carrying(Carries::Nozzle) > 1 {
            let what = format!(
                "{} robots carry the probe and {} the nozzle",
                carrying(Carries::Probe),
                carrying(Carries::Nozzle)
            );
            let help = "one [[robot]] carries the probe, and at most one the nozzle";
            return refuse("robot", what, help);
        }
        (0..self.robots.len()).try_for_each(|nth| self.check_robot(nth, name, text))?;
        if let Some(nth) = self.faults.iter().position(|fault| fault.get("id").and_then(toml::Value::as_str).is_none())
        {
            return Err(Error::new("a fault without an id")
                .file(name)
                .span(text, place::in_list(text, "fault", nth, None))
                .help("name it with id = \"…\": a wire fault, or an effect of: dockhil effect list"));
        }
        Ok(())
    }

    fn check_robot(&self, nth: usize, name: &str, text: &str) -> Result<(), Error> {
        let robot = &self.robots[nth];
        let refuse = |key: &str, what: String, help: &str| {
            let span = place::in_list(text, "robot", nth, Some(key));
            Err(Error::new(what).file(name).span(text, span).help(help.to_owned()))
        };
        for other in &self.robots[..nth] {
            if other.name == robot.name {
                let what = format!("two robots are called {:?}", robot.name);
                return refuse("name", what, "give each its own name");
            }
            if other.listen == robot.listen && robot.listen.port() != 0 {
                let what = format!("listen = {} is taken by the robot {:?}", robot.listen, other.name);
                return refuse("listen", what, "give each robot its own port: each has its own link and its own IPOC");
            }
        }
        if robot.listen == self.sensor.address && robot.listen.port() != 0 {
            let what = format!("listen = {} is the address of the sensor", robot.listen);
            return refuse("listen", what, "give each its own address");
        }
        if let Some((key, what, help)) = wrong(robot) {
            return refuse(key, what, help);
        }
        Ok(())
    }
}

/// Whether a value is no number, or further from zero than this.
pub(super) fn beyond(value: f64, limit: f64) -> bool {
    value.is_nan() || value.abs() > limit
}

/// The first value of a robot that cannot be.
fn wrong(robot: &RobotConfig) -> Option<(&'static str, String, &'static str)> {
    if robot.decimals > DECIMALS_MAX {
        let what = format!("decimals = {} is above {DECIMALS_MAX}", robot.decimals);
        return Some(("decimals", what, "give the digits after the point; controllers are set to 1, 4 or 6"));
    }
    if robot.frame_bytes > FRAME_BYTES_MAX {
        let what = format!("frame_bytes = {} is above {FRAME_BYTES_MAX}", robot.frame_bytes);
        return Some(("frame_bytes", what, "give the bytes of the controller's buffer; 2048 have been seen"));
    }
    for (key, place) in [("base", &robot.base), ("interface", &robot.interface)] {
        if let Some(value) = place.position_m.iter().find(|value| beyond(**value, PLACE_MAX_M)) {
            let what = format!("{key}.position_m has {value} m, outside [-{PLACE_MAX_M}, {PLACE_MAX_M}]");
            return Some((key, what, "give metres"));
        }
        if let Some(value) = place.abc_deg.iter().find(|value| beyond(**value, 360.0)) {
            let what = format!("{key}.abc_deg has {value} deg, outside [-360, 360]");
            return Some((key, what, "give degrees about z, y' and x''"));
        }
    }
    if let Some(value) = robot.start_mm_deg.iter().find(|value| beyond(**value, 1e3 * PLACE_MAX_M)) {
        let what = format!("start_mm_deg has {value}, outside [-{0}, {0}]", 1e3 * PLACE_MAX_M);
        return Some(("start_mm_deg", what, "give X, Y, Z in mm and A, B, C in deg"));
    }
    if let Some(rail) = &robot.rail {
        let [x, y, z] = rail.direction;
        let length = libm::sqrt(x * x + y * y + z * z);
        if beyond(length - 1.0, UNIT) {
            let what = format!("rail.direction has the length {length}, expected 1");
            return Some(("rail", what, "divide the direction by its length"));
        }
        if !["E1", "E2", "E3", "E4", "E5", "E6"].contains(&rail.axis.as_str()) {
            let what = format!("rail.axis = {:?} is no external axis", rail.axis);
            return Some(("rail", what, "name one of E1 to E6"));
        }
    }
    let limits = &robot.limits;
    let given = [
        ("translation_mm", Some(limits.translation_mm)),
        ("rotation_deg", Some(limits.rotation_deg)),
        ("stop_translation_mm", limits.stop_translation_mm),
        ("stop_rotation_deg", limits.stop_rotation_deg),
    ];
    if let Some((key, Some(value))) =
        given.iter().find(|(_, value)| value.is_some_and(|value| value.is_nan() || value <= 0.0))
    {
        return Some(("limits", format!("limits.{key} = {value} is not above 0"), "give mm or deg"));
    }
    match robot.late {
        LateConfig::Total { limit: 0 } | LateConfig::Consecutive { limit: 0 } => {
            Some(("late", "late.limit = 0 stops before the first answer".to_owned(), "controllers have 10 or 100"))
        }
        LateConfig::Percent { limit, window } if beyond(limit, 100.0) || limit <= 0.0 || window == 0 => {
            let what = format!("late: {limit} % of {window} answers cannot be counted");
            Some(("late", what, "give a share in (0, 100] and a window of at least one answer"))
        }
        _ => None,
    }
}
