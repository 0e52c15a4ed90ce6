//! What a number of a model may be.

use super::effects::{DELAY_HELP, List, check_delays, check_effects, delays};
use super::{CalibrationModel, LawModel, Model, RigKind, RobotModel, TimingModel, place};
use crate::error::Error;
use serde::de::DeserializeOwned;
use sim_core::compensator::DelayCompensation;
use sim_core::effect::Catalog;
use sim_core::refusal::plain;
use sim_core::space::Axis;

/// Longest time of a model: a longer one is a millisecond taken for a second.
const TIME_MAX_S: f64 = 10.0;
/// Shortest physics step. Chosen: a thousandth of the usual one, and far above the nanosecond that time is counted in.
const STEP_MIN_S: f64 = 1e-6;

/// Which sign a number may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    Positive,
    NotNegative,
    Any,
}

impl Sign {
    fn help(self) -> &'static str {
        match self {
            Sign::Positive => "give a positive number in the unit of the key",
            Sign::NotNegative => "give zero or a positive number in the unit of the key",
            Sign::Any => "give a number in the unit of the key",
        }
    }
}

/// Reads a file that a user writes; the error points at the mistake. `schema` is the command that lists the keys.
pub fn parsed<T: DeserializeOwned>(name: &str, text: &str, schema: &str) -> Result<T, Error> {
    toml::from_str(text).map_err(|error| {
        let span = error.span().unwrap_or(0..0);
        // The parser speaks of Rust's types.
        let what = error.message().replace('\n', " ").replace(" f64", " a number").replace(" u32", " a whole number");
        let what = what.replace(" u64", " a whole number").replace(" i64", " a whole number");
        Error::new(what).file(name).span(text, span).help(format!("see the keys that are known with: {schema}"))
    })
}

/// A time that no rig can have.
pub(super) struct TimingFault {
    pub key: &'static str,
    pub value: f64,
    pub limit: String,
    pub help: &'static str,
}

impl TimingModel {
    /// Refuses clocks that do not go together; `is_driven` by a robot that draws straight lines to its commands.
    pub(super) fn check(&self, is_driven: bool) -> Result<(), TimingFault> {
        let fault = |key, value, limit, help| Err(TimingFault { key, value, limit, help });
        let times = [
            ("timing.loop_period_s", self.loop_period_s),
            ("timing.sensor_period_s", self.sensor_period_s),
            ("timing.physics_step_s", self.physics_step_s),
            ("timing.command_delay_s", self.command_delay_s),
            ("timing.measurement_delay_s", self.measurement_delay_s),
        ];
        for (key, value) in times {
            if !(0.0..=TIME_MAX_S).contains(&value) {
                return fault(
                    key,
                    value,
                    format!("is outside [0, {TIME_MAX_S}]"),
                    "give the value in the unit of the key",
                );
            }
        }
        if self.physics_step_s < STEP_MIN_S {
            let limit = format!("is below {STEP_MIN_S}");
            return fault("timing.physics_step_s", self.physics_step_s, limit, "a millisecond or less is fine enough");
        }
        if is_driven && self.command_delay_s < self.loop_period_s {
            let help = "the robot draws a straight line to a command that it must know: give at least one loop period";
            let limit = format!("is shorter than one loop period, {} s", self.loop_period_s);
            return fault("timing.command_delay_s", self.command_delay_s, limit, help);
        }
        for (key, period_s) in &times[..2] {
            let ratio = period_s / self.physics_step_s;
            if (ratio - ratio.round()).abs() > 1e-6 || ratio < 0.5 {
                let limit = format!("is not a whole number of physics steps of {} s", self.physics_step_s);
                return fault(key, *period_s, limit, "choose a physics_step_s that divides every period");
            }
        }
        Ok(())
    }
}

impl Model {
    pub(super) fn check(&self, name: &str, text: &str, catalog: &Catalog<Axis>) -> Result<(), Error> {
        let refuse = |key: &str, value: f64, limit: &str, help: &str| {
            let span = place::of_key(text, key);
            Err(Error::new(format!("{key} = {} {limit}", plain(value)))
                .file(name)
                .span(text, span)
                .help(help.to_string()))
        };
        if self.schema != 1 {
            return refuse("schema", f64::from(self.schema), "is not 1, the only version there is", "set schema = 1");
        }
        let calibration = self.sensor.calibration.iter().flat_map(CalibrationModel::numbers);
        let identified = self.robot.iter().flat_map(RobotModel::numbers);
        for (key, value, sign) in self.numbers().into_iter().chain(calibration).chain(identified) {
            let (wrong, limit) = match sign {
                Sign::Positive => (value <= 0.0, "is not above 0"),
                Sign::NotNegative => (value < 0.0, "is below 0"),
                Sign::Any => (false, ""),
            };
            if wrong || value.is_nan() {
                let limit = if wrong || sign == Sign::Positive { limit } else { "is not a number" };
                return refuse(key, value, limit, sign.help());
            }
            let upper = if key.starts_with("timing.") { TIME_MAX_S } else { f64::MAX };
            if value.abs() > upper {
                let limit = format!("is above {}", plain(upper));
                return refuse(key, value, &limit, "give the value in the unit of the key");
            }
        }
        if let Some((key, what, help)) = self.robot.as_ref().and_then(RobotModel::contradiction) {
            return Err(Error::new(what).file(name).span(text, place::of_key(text, key)).help(help));
        }
        if let Some((key, what, help)) =
            self.sensor.calibration.as_ref().and_then(|own| own.contradiction(&self.sensor))
        {
            return Err(Error::new(what).file(name).span(text, place::of_key(text, key)).help(help));
        }
        if let Err(fault) = self.timing.check(self.rig == RigKind::Docking) {
            return refuse(fault.key, fault.value, &fault.limit, fault.help);
        }
        self.check_parts(name, text)?;
        check_effects(&List { effects: &self.effects.iter().collect::<Vec<_>>(), rig: self.rig, name, text, catalog })?;
        if self.rig == RigKind::Docking {
            check_delays(&self.timing, delays(self.effects.iter())).map_err(|(id, what)| {
                let nth = self.effects.iter().position(|effect| effect.id == id).unwrap_or_default();
                Error::new(what).file(name).span(text, place::in_effect(text, nth, Some("delay_s"))).help(DELAY_HELP)
            })?;
        }
        Ok(())
    }

    /// The parts that the model chooses.
    fn check_parts(&self, name: &str, text: &str) -> Result<(), Error> {
        let refuse = |key: &str, what: String, help: &str| {
            Err(Error::new(what).file(name).span(text, place::of_key(text, key)).help(help.to_owned()))
        };
        if self.rig == RigKind::Drive && !self.has_usual_parts() {
            let what = "a drive has a spring and a dashpot, and nothing that compensates".to_owned();
            return refuse("rig", what, "leave integrator, law, release, architecture, pose and compensation out");
        }
        let contact = &self.contact;
        let device = contact.law.device(contact.stiffness_n_per_m, contact.damping_n_s_per_m, contact.release.sides());
        if let Err(refusal) = device {
            let help = "correct the law; see its keys with: dockhil model schema";
            return refuse(&format!("contact.law.{}", refusal.name), format!("contact.law: {refusal}"), help);
        }
        let period_s = self.timing.loop_period_s;
        if let Err(refusal) = self.virtual_contact.pose.check(period_s) {
            return refuse("virtual_contact.pose", format!("virtual_contact.pose: {refusal}"), "correct the estimator");
        }
        if let Err(refusal) = self.compensation.check(period_s) {
            let key = format!("compensation.{}", refusal.name);
            return refuse(
                &key,
                format!("compensation: {refusal}"),
                "correct the method; see its keys with: dockhil model schema",
            );
        }
        Ok(())
    }

    /// Every number outside the effects.
    fn numbers(&self) -> [(&'static str, f64, Sign); 21] {
        let (contact, timing, sensor) = (&self.contact, &self.timing, &self.sensor);
        let (software, scatter) = (&self.virtual_contact, &self.repeatability);
        // A spring preloaded too far pushes apart: unstable, and answered. The other laws have no such form.
        let stiffness = if contact.law == LawModel::SpringDashpot { Sign::Any } else { Sign::NotNegative };
        [
            ("plant.mass_kg", self.plant.mass_kg, Sign::Positive),
            ("timing.loop_period_s", timing.loop_period_s, Sign::Positive),
            ("timing.sensor_period_s", timing.sensor_period_s, Sign::Positive),
            ("timing.physics_step_s", timing.physics_step_s, Sign::Positive),
            ("timing.command_delay_s", timing.command_delay_s, Sign::NotNegative),
            ("timing.measurement_delay_s", timing.measurement_delay_s, Sign::NotNegative),
            ("contact.stiffness_n_per_m", contact.stiffness_n_per_m, stiffness),
            ("contact.damping_n_s_per_m", contact.damping_n_s_per_m, Sign::Any),
            ("contact.offset_n", contact.offset_n, Sign::Any),
            ("virtual_contact.stiffness_n_per_m", software.stiffness_n_per_m, Sign::Any),
            ("virtual_contact.damping_n_s_per_m", software.damping_n_s_per_m, Sign::Any),
            ("virtual_contact.dead_band_n", software.dead_band_n, Sign::NotNegative),
            ("sensor.tool_mass_kg", sensor.tool_mass_kg, Sign::NotNegative),
            ("sensor.bias_n", sensor.bias_n, Sign::Any),
            ("sensor.white_sigma_n", sensor.white_sigma_n, Sign::NotNegative),
            ("sensor.slow_sigma_n", sensor.slow_sigma_n, Sign::NotNegative),
            ("readout.position_sigma_m", self.readout.position_sigma_m, Sign::NotNegative),
            ("repeatability.stiffness_ratio", scatter.stiffness_ratio, Sign::NotNegative),
            ("repeatability.damping_ratio", scatter.damping_ratio, Sign::NotNegative),
            ("repeatability.force_offset_n", scatter.force_offset_n, Sign::NotNegative),
            ("repeatability.approach_speed_ratio", scatter.approach_speed_ratio, Sign::NotNegative),
        ]
    }
}
