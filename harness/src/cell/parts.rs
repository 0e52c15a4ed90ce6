//! The parts of a cell, made from its files and checked against each other.

use super::config::{Cell, FamilyName, FormName, LateConfig, LimitsConfig, ModeName, RobotConfig};
use super::config_check::{SPEED_MAX_M_PER_S, beyond};
use super::frames::{Places, Reported, recorded, relative};
use crate::error::Error;
use crate::model::{Model, RigKind, place};
use crate::scenario::run::TRAVEL_MAX_M;
use drivers::ft;
use drivers::rsi::{Danger, EthernetConfig, Family, Form, LateRule, Limits, Mode, POSE, Settings, Transport, sent};
use sim_core::effect::Catalog;
use sim_core::refusal::plain;
use sim_core::space::{Axis, AxisMotion};

/// Periods are the same to this share: a decimal fraction of a second is rounded.
const PERIOD_ROUNDING: f64 = 1e-9;
/// Stamp of the first frame: a week of milliseconds, as a controller has that has run for a while. Chosen.
const FIRST_IPOC: u64 = 604_800_000;
/// By how much the clock of the next robot is ahead. Chosen.
const BETWEEN_IPOC: u64 = 3_600_004;
/// Turns that a cell along one axis does not know, below this: rounding of the frames.
const ALIGNED_RAD: f64 = 1e-6;

impl From<ModeName> for Mode {
    fn from(name: ModeName) -> Mode {
        match name {
            ModeName::Absolute => Mode::Absolute,
            ModeName::Relative => Mode::Relative,
        }
    }
}

impl Cell {
    /// The model of the cell.
    ///
    /// # Errors
    /// When it is wrong, or its clocks are not those of the cell.
    pub fn model(&self, catalog: &Catalog<Axis>) -> Result<Model, Error> {
        let model = Model::parse(&self.model.file.display().to_string(), &self.model.text, catalog)?;
        let model = model.with_identified_robot().map_err(|error| error.file(&self.model.file))?;
        if model.rig != RigKind::Docking {
            return Err(self.at("model", "the model is a drive, and a cell docks", "name one with rig = \"docking\""));
        }
        let cycle_s = self.config.time.cycle_s;
        if (model.timing.loop_period_s / cycle_s - 1.0).abs() > PERIOD_ROUNDING {
            let what = format!("time.cycle_s = {cycle_s} s, and the model says {} s", model.timing.loop_period_s);
            return Err(self.at("time.cycle_s", &what, "give both the cycle of the robot controller"));
        }
        let period_s = self.sensor()?.period().map_err(|error| self.sensor_error(&error))?.seconds();
        if (model.timing.sensor_period_s / period_s - 1.0).abs() > PERIOD_ROUNDING {
            let what =
                format!("the sensor's period is {period_s} s, and the model says {} s", model.timing.sensor_period_s);
            return Err(self.at("sensor.rate_hz", &what, "give both the rate of the sensor"));
        }
        Ok(model)
    }

    /// What the sensor speaks.
    ///
    /// # Errors
    /// When a key is unknown or a value cannot be.
    pub fn sensor(&self) -> Result<ft::Settings, Error> {
        let settings = self.config.sensor.protocol.clone().try_into::<ft::Settings>();
        settings.map_err(|error| {
            let what = error.message().replace('\n', " ");
            let unknown = what.strip_prefix("unknown field `").and_then(|rest| rest.split_once('`'));
            let place = unknown.map_or("sensor".to_owned(), |(key, _)| format!("sensor.{key}"));
            self.at(&place, &format!("sensor: {what}"), "correct the table [sensor]")
        })
    }

    pub(crate) fn sensor_error(&self, error: &ft::SettingsError) -> Error {
        self.at(&format!("sensor.{}", error.field), &error.to_string(), "correct the table [sensor]")
    }

    /// The Ethernet configuration of a robot, to hear it by. One that reports no pose is refused: nothing could be made of its
    /// frames.
    ///
    /// # Errors
    /// When it is no configuration, or cannot go with this robot.
    pub fn ethernet(&self, nth: usize) -> Result<EthernetConfig, Error> {
        let (file, robot) = (&self.rsi[nth], &self.config.robots[nth]);
        let refuse = |what: String, help: &str| Error::new(what).file(&file.file).help(help.to_owned());
        let config = EthernetConfig::parse(&file.text)
            .map_err(|error| refuse(error.to_string(), "give the file that the robot controller loads"))?;
        if !config.sends("RIst") {
            let what = format!("SEND has no DEF_RIst: robot {} does not tell its measured pose", robot.name);
            return Err(refuse(what, "add DEF_RIst to SEND, here and on the robot controller"));
        }
        if config.protocol == Transport::Tcp && robot.family != FamilyName::Krc2 {
            let what = format!("{} says TCP, and only a KRC2 speaks it", file.file.display());
            return Err(self.at_robot(nth, "family", &what, "set family = \"krc2\", or PROTOCOL to UDP"));
        }
        Ok(config)
    }

    /// The same, to move it by.
    ///
    /// # Errors
    /// Also when its correction cannot be sent, or would move the robot on a lost packet.
    pub fn driven(&self, nth: usize) -> Result<EthernetConfig, Error> {
        let (file, robot) = (&self.rsi[nth], &self.config.robots[nth]);
        let config = self.ethernet(nth)?;
        let refuse = |key: &str, what: String, help: &str| Err(self.at_robot(nth, key, &what, help));
        let name = file.file.display();
        let lacks: Vec<&str> =
            POSE[..3].iter().copied().filter(|name| config.receives(&robot.correction, name).is_none()).collect();
        if (1..3).contains(&lacks.len()) {
            let what = format!("correction = {:?} has no {} in {name}", robot.correction, lacks.join(" and "));
            return refuse(
                "correction",
                what,
                "RECEIVE needs X, Y and Z of it: the cell is docked along a line in space",
            );
        }
        if !lacks.is_empty() {
            let mut receives: Vec<&str> = config.receive.iter().map(|channel| channel.element.as_str()).collect();
            receives.dedup();
            let what = format!(
                "correction = {:?} has no X to C in {name}, and corrections of axes cannot be used here: it receives {}",
                robot.correction,
                if receives.is_empty() { "nothing".to_owned() } else { receives.join(", ") }
            );
            return refuse("correction", what, "name the element of RECEIVE that drives POSCORR");
        }
        if config.length_prefix && robot.frame_bytes > 0 {
            let what = format!("frame_bytes = {}, and {name} says PROTCOLLENGTH On", robot.frame_bytes);
            return refuse("frame_bytes", what, "leave one of them out: behind its length a document is not filled up");
        }
        let dangers = config.dangers(robot.mode.into());
        let attribute = format!("{}.", robot.correction);
        let moves = |danger: &&Danger| danger.channels.iter().any(|(tag, _)| tag.starts_with(&attribute));
        if let Some(danger) = dangers.iter().find(moves) {
            let help = "correct HOLDON: 1 for absolute, 0 for relative corrections";
            return Err(Error::new(danger.to_string()).file(&file.file).help(help));
        }
        Ok(config)
    }

    /// The frames.
    pub(super) fn places(&self) -> Places {
        Places::of(&self.config).expect("the check has found a robot with the probe")
    }

    /// What the robots report at the start, in their order.
    pub(super) fn start(&self) -> Vec<Reported> {
        let reported = |robot: &RobotConfig| Reported { pose_mm_deg: robot.start_mm_deg, ..Reported::default() };
        self.config.robots.iter().map(reported).collect()
    }

    /// Which robot carries the probe, and which the nozzle.
    pub(super) fn roles(&self) -> (usize, Option<usize>) {
        let of = |what| self.config.robots.iter().position(|robot| robot.carries == what);
        (of(super::Carries::Probe).unwrap_or_default(), of(super::Carries::Nozzle))
    }

    /// The motion along z with which the cell begins.
    ///
    /// # Errors
    /// When the start has a turn that a model along one axis does not know.
    pub fn first(&self) -> Result<AxisMotion, Error> {
        let (start, (probe, nozzle)) = (self.start(), self.roles());
        let pose = self.places().relative(&start[probe], nozzle.map(|nth| &start[nth]));
        let turn = pose.attitude.coords;
        let across = libm::sqrt(turn.y * turn.y + turn.z * turn.z);
        if across > ALIGNED_RAD {
            let what = "at the start, the probe is turned against the nozzle about another axis than x";
            let help = "correct base, interface and start_mm_deg: the virtual cell works along one axis";
            return Err(self.at("robot", what, help));
        }
        let pitch_rad = 2.0 * libm::atan2(turn.x, turn.w);
        Ok(AxisMotion { pitch_rad, ..AxisMotion::moving(pose.position_m.z, self.config.start.velocity_m_per_s) })
    }

    /// Changes the start along z, where something is given: the probe's robot then begins where the probe is at this position.
    ///
    /// # Errors
    /// When the position is outside the hall, or the speed is none that a facility has.
    pub fn begin_at(&mut self, position_m: Option<f64>, velocity_m_per_s: Option<f64>) -> Result<(), Error> {
        if let Some(velocity_m_per_s) = velocity_m_per_s {
            if beyond(velocity_m_per_s, SPEED_MAX_M_PER_S) {
                let (given, most) = (plain(velocity_m_per_s), SPEED_MAX_M_PER_S);
                let what = format!("a start with {given} m/s is outside [-{most}, {most}]");
                let help = "give the speed in m/s; positive closes the gap";
                return Err(Error::new(what).place("argument --velocity").help(help));
            }
            self.config.start.velocity_m_per_s = velocity_m_per_s;
        }
        let Some(position_m) = position_m else { return Ok(()) };
        if beyond(position_m, TRAVEL_MAX_M) {
            let what = format!("a start at {} m is outside [-{TRAVEL_MAX_M}, {TRAVEL_MAX_M}]", plain(position_m));
            let help = "give metres; positive z is penetration of the contact plane";
            return Err(Error::new(what).place("argument --position").help(help));
        }
        let (start, (probe, nozzle), places) = (self.start(), self.roles(), self.places());
        let nozzle = nozzle.map(|nth| start[nth]);
        let mut pose = recorded(&places.relative(&start[probe], nozzle.as_ref()));
        pose.position_m[2] = position_m;
        let asked = places.probe_mm_deg(&relative(&pose), &start[probe].external_mm, nozzle.as_ref());
        // Controllers begin where they say: a start has no more digits than a frame.
        self.config.robots[probe].start_mm_deg = asked.map(|value| sent(value, self.config.robots[probe].decimals));
        Ok(())
    }

    /// An error at a key of a robot in the cell's file.
    fn at_robot(&self, nth: usize, key: &str, what: &str, help: &str) -> Error {
        let span = place::in_list(&self.source.text, "robot", nth, Some(key));
        Error::new(what).file(&self.source.file).span(&self.source.text, span).help(help.to_owned())
    }

    /// An error at a key of the cell's file.
    pub(super) fn at(&self, key: &str, what: &str, help: &str) -> Error {
        let text = &self.source.text;
        Error::new(what).file(&self.source.file).span(text, place::of_key(text, key)).help(help.to_owned())
    }
}

/// The virtual controller of a robot, by its number in the cell.
pub(super) fn settings(nth: usize, robot: &RobotConfig, config: EthernetConfig, cycle_s: f64) -> Settings {
    let family = match robot.family {
        FamilyName::Krc2 => Family::Krc2,
        FamilyName::Krc4 => Family::Krc4,
        FamilyName::Krc5 => Family::Krc5,
        FamilyName::Iiqka => Family::IiQka,
    };
    Settings {
        form: match robot.form {
            FormName::Flat => Form::Flat,
            FormName::Dat => Form::Dat,
        },
        mode: robot.mode.into(),
        cycle_ms: (cycle_s * 1e3).round() as u32,
        decimals: robot.decimals,
        correction: robot.correction.clone(),
        frame_bytes: robot.frame_bytes,
        first_ipoc: FIRST_IPOC + nth as u64 * BETWEEN_IPOC,
        limits: limits(&robot.limits),
        late: match robot.late {
            LateConfig::Total { limit } => LateRule::Total { limit },
            LateConfig::Consecutive { limit } => LateRule::Consecutive { limit },
            LateConfig::Percent { limit, window } => LateRule::Percent { limit, window },
        },
        ..Settings::new(config, family)
    }
}

fn limits(limits: &LimitsConfig) -> Limits {
    Limits {
        lower_mm: [-limits.translation_mm; 3],
        upper_mm: [limits.translation_mm; 3],
        rotation_deg: limits.rotation_deg,
        stop_translation_mm: limits.stop_translation_mm,
        stop_rotation_deg: limits.stop_rotation_deg,
        ..Limits::KUKA
    }
}
