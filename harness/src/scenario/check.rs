//! What a scenario may say, alone and together with its model.

use super::{Components, FaultModel, Scenario, library::Source};
use crate::error::Error;
use crate::model::{
    DELAY_HELP, EffectModel, List, Model, RigKind, TimingModel, check_delays, check_effects, delays, place,
};
use sim_core::effect::Catalog;
use sim_core::refusal::plain;
use sim_core::signals::Wire;
use sim_core::space::Axis;

/// Longest run: an hour, which is 3.6 million samples of the force sensor. Chosen.
const DURATION_MAX_S: f64 = 3600.0;
/// Fewer ticks of the loop are no run.
const TICKS_MIN: f64 = 20.0;
/// A length is a whole number of ticks up to this share of one: a decimal fraction of a second is rounded, 14 million ticks to
/// some 1e-9.
const TICK_ROUNDING: f64 = 1e-6;
/// Furthest start, in m: the rail of the facility is 25 m long.
const DISTANCE_MAX_M: f64 = 25.0;
/// Fastest start, in m/s; docking is a hundred times slower.
const SPEED_MAX_M_PER_S: f64 = 10.0;
/// Fastest turn of a satellite, in rad/s; a tumbling one turns a tenth as fast.
const RATE_MAX_RAD_PER_S: f64 = 1.0;
/// Last date that a ROS stamp can hold, in s.
const EPOCH_MAX_S: u64 = 2_147_483_647 - 3600;

impl Scenario {
    /// What can be checked without the model.
    pub(super) fn check(&self, name: &str, text: &str) -> Result<(), Error> {
        let refuse = |key: &str, what: String, help: &str| {
            Err(Error::new(what).file(name).span(text, place::of_key(text, key)).help(help.to_owned()))
        };
        if self.schema != 1 {
            let what = format!("schema = {} is not 1, the only version there is", self.schema);
            return refuse("schema", what, "set schema = 1");
        }
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if self.name.is_empty() || !self.name.chars().all(is_plain) {
            let what = format!("name = {:?} is not made of lower-case letters, digits and dashes", self.name);
            return refuse("name", what, "the name stands in file names and on the command line");
        }
        if !(self.duration_s > 0.0 && self.duration_s <= DURATION_MAX_S) {
            let what = format!("duration_s = {} s is outside (0, {DURATION_MAX_S}]", self.duration_s);
            return refuse("duration_s", what, "give the length of the run in seconds");
        }
        if self.epoch_s > EPOCH_MAX_S {
            let what = format!("epoch_s = {} s is above {EPOCH_MAX_S}, what a ROS stamp can hold", self.epoch_s);
            return refuse("epoch_s", what, "give whole seconds since 1970");
        }
        let limits = [
            ("start.position_m", self.start.position_m, DISTANCE_MAX_M, "m"),
            ("start.velocity_m_per_s", self.start.velocity_m_per_s, SPEED_MAX_M_PER_S, "m/s"),
        ];
        for (key, components, limit, unit) in limits {
            if let Some(value) = components.vector().into_iter().find(|value| value.is_nan() || value.abs() > limit) {
                let what = format!("{key} = {} {unit} is outside [-{limit}, {limit}]", plain(value));
                return refuse(key, what, "give the value in the unit of the key");
            }
        }
        let vectors = [
            ("start.turn_rad", self.start.turn_rad, std::f64::consts::PI, "rad"),
            ("start.rate_rad_per_s", self.start.rate_rad_per_s, RATE_MAX_RAD_PER_S, "rad/s"),
            ("start.target_velocity_m_per_s", self.start.target_velocity_m_per_s, SPEED_MAX_M_PER_S, "m/s"),
            ("start.target_rate_rad_per_s", self.start.target_rate_rad_per_s, RATE_MAX_RAD_PER_S, "rad/s"),
        ];
        for (key, vector, limit, unit) in vectors {
            let wrong = |value: &f64| value.is_nan() || value.abs() > limit;
            if let Some(value) = vector.into_iter().flatten().find(wrong) {
                let what = format!("{key} = {} {unit} is outside [-{limit}, {limit}]", plain(value));
                return refuse(key, what, "give the value in the unit of the key");
            }
        }
        let own = ["kind", "reduced_mass_kg", "ft_bias"];
        if let Some(key) = own.iter().find(|key| self.session.contains_key(**key)) {
            let what = format!("session.{key} is written by the run itself");
            return refuse(&format!("session.{key}"), what, "leave it out; the model says it");
        }
        super::judge::check(&self.criteria, name, text)?;
        (0..self.faults.len()).try_for_each(|nth| self.check_window(nth, name, text))
    }

    fn check_window(&self, nth: usize, name: &str, text: &str) -> Result<(), Error> {
        let FaultModel { effect, from_s, until_s } = &self.faults[nth];
        let refuse = |key: &str, what: String, help: String| {
            Err(Error::new(what).file(name).span(text, place::in_effect(text, nth, Some(key))).help(help))
        };
        let limit = self.duration_s;
        for (key, value) in [("from_s", *from_s), ("until_s", *until_s)] {
            if let Some(value) = value.filter(|value| !(*value >= 0.0 && *value <= limit)) {
                let what = format!("{}.{key} = {} s is outside [0, {limit}]", effect.id, plain(value));
                return refuse(key, what, "give a time within the run, in seconds from its beginning".into());
            }
        }
        match (from_s, until_s) {
            (Some(from_s), Some(until_s)) if from_s >= until_s => {
                let what = format!("{}.until_s = {until_s} s is not after from_s = {from_s} s", effect.id);
                refuse("until_s", what, "a fault ends after it began".into())
            }
            _ => Ok(()),
        }
    }

    /// What can be checked only together with the model.
    pub(super) fn check_with(&self, source: &Source, model: &Model, catalog: &Catalog<Axis>) -> Result<(), Error> {
        let (file, text) = (source.file.display().to_string(), source.text.as_str());
        let refuse = |span: std::ops::Range<usize>, what: String, help: &str| {
            Err(Error::new(what).file(&file).span(text, span).help(help.to_owned()))
        };
        if model.rig != RigKind::Docking {
            let what = format!("the model {} is a drive, and a scenario runs a docking cell", self.model);
            return refuse(place::of_key(text, "model"), what, "name a model with rig = \"docking\"");
        }
        self.check_length(source, model.timing.loop_period_s)?;
        for (key, components) in
            [("start.position_m", self.start.position_m), ("start.velocity_m_per_s", self.start.velocity_m_per_s)]
        {
            if matches!(components, Components::Vector(_)) {
                let what = format!("{key} has three parts, and the model {} has one axis", self.model);
                return refuse(place::of_key(text, key), what, "give one number, along the axis of approach");
            }
        }
        let only_in_space = [
            ("start.turn_rad", self.start.turn_rad),
            ("start.rate_rad_per_s", self.start.rate_rad_per_s),
            ("start.target_velocity_m_per_s", self.start.target_velocity_m_per_s),
            ("start.target_rate_rad_per_s", self.start.target_rate_rad_per_s),
        ];
        if let Some((key, _)) = only_in_space.iter().find(|(_, value)| value.is_some()) {
            let what = format!("{key} is there, and the model {} has one axis", self.model);
            return refuse(
                place::of_key(text, key),
                what,
                "leave it out, or name a model with rig = \"docking-space\"",
            );
        }
        self.check_faults(source, &model.effects, &model.timing, catalog)
    }

    /// Whether the run is long enough for the loop, and ends with a tick of it.
    pub(super) fn check_length(&self, source: &Source, loop_period_s: f64) -> Result<(), Error> {
        let (asked_s, least_s) = (self.duration_s, TICKS_MIN * loop_period_s);
        let ticks = asked_s / loop_period_s;
        let (what, help) = if asked_s < least_s {
            let what = format!("duration_s = {asked_s} s is below {least_s} s, {TICKS_MIN} ticks of the loop");
            (what, "give a longer run".to_owned())
        } else if (ticks - ticks.round()).abs() > TICK_ROUNDING {
            let near = |ticks: f64| (ticks * loop_period_s * 1e9).round() / 1e9;
            let what =
                format!("duration_s = {asked_s} s is no whole number of ticks of the loop, {loop_period_s} s each");
            (what, format!("give {} or {} s", near(ticks.floor()), near(ticks.ceil())))
        } else {
            return Ok(());
        };
        let span = place::of_key(&source.text, "duration_s");
        Err(Error::new(what).file(&source.file).span(&source.text, span).help(help))
    }

    /// The faults, beside the effects of the model.
    pub(super) fn check_faults(
        &self,
        source: &Source,
        own: &[EffectModel],
        timing: &TimingModel,
        catalog: &Catalog<Axis>,
    ) -> Result<(), Error> {
        let (file, text) = (source.file.display().to_string(), source.text.as_str());
        let refuse = |span: std::ops::Range<usize>, what: String, help: &str| {
            Err(Error::new(what).file(&file).span(text, span).help(help.to_owned()))
        };
        let faults: Vec<&EffectModel> = self.faults.iter().map(|fault| &fault.effect).collect();
        check_effects(&List { effects: &faults, rig: RigKind::Docking, name: &file, text, catalog })?;
        for (nth, fault) in self.faults.iter().enumerate() {
            let twice = own.iter().any(|effect| effect.enabled && effect.id == fault.effect.id);
            let kind = catalog.get(&fault.effect.id);
            let stamps = kind.is_some_and(|kind| kind.wires.contains(&Wire::Recorder));
            let at = |key| place::in_effect(text, nth, key);
            if twice {
                let what = format!("effect {} is in the model already", fault.effect.id);
                return refuse(at(None), what, "put it into one of the two files");
            }
            if stamps && (fault.from_s.is_some() || fault.until_s.is_some()) {
                let what = format!("effect {} shifts every stamp and cannot begin or end", fault.effect.id);
                return refuse(at(Some("from_s")), what, "leave from_s and until_s out");
            }
        }
        let all = own.iter().chain(faults);
        let Err((id, what)) = check_delays(timing, delays(all)) else { return Ok(()) };
        match self.faults.iter().position(|fault| fault.effect.id == id) {
            Some(nth) => refuse(place::in_effect(text, nth, Some("delay_s")), what, DELAY_HELP),
            None => Err(Error::new(what).file(&source.model_file).place(format!("[[effect]] {id}")).help(DELAY_HELP)),
        }
    }
}
