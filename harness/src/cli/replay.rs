//! `dockhil replay`: a recorded session through a model, clamped where asked, with faults put in.

use super::console::Console;
use super::inputs::{self, Outputs, Reading};
use super::outcome::Exit;
use super::run::{did_nothing, exit};
use crate::error::Error;
use crate::files::sha256_hex;
use crate::model::{Chosen, DELAY_HELP, EffectText, Model, check_delays, delays};
use crate::recording::{Grade, Kind, Luggage, Session, luggage};
use crate::replay::{Clamp, Earlier, Own, REPLAY_RECORD, Replayed, Request, page, replay};
use crate::report::{TEXT_WIDTH, html, text};
use crate::scenario::run::MODEL_FILE;
use crate::scenario::{self, Fault, Scenario, judge};
use clap::Args;
use serde_json::json;
use sim_core::criterion::{AnyCriterion, ObservedEnergy, Restitution, Verdict};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Arguments of `dockhil replay`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The recording.
    recording: PathBuf,
    /// The model; a recording of `dockhil run` or of `replay -o` holds its own.
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// The wire that is taken from the recording; everything behind it reacts.
    #[arg(long, value_enum, default_value_t)]
    clamp: Clamp,
    /// Put an effect in, as id:param=value; may be given again.
    #[arg(long = "with", value_name = "EFFECT:PARAM=VALUE")]
    faults: Vec<String>,
    /// Judge by the criteria of this scenario, instead of the usual ones.
    #[arg(long, value_name = "SCENARIO.toml")]
    criteria: Option<PathBuf>,
    /// Draw the sensor's noise from this seed; without it there is none. Not for recordings of `dockhil run`.
    #[arg(long, value_name = "SEED", allow_negative_numbers = true, value_parser = inputs::seed)]
    seed: Option<u64>,
    /// Save the recording with what the model made in it; all other messages keep their bytes.
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// Overwrite the recording that -o names.
    #[arg(long, requires = "output")]
    force: bool,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    reading: Reading,
}

/// What the command is about, once its files are read.
struct Read {
    session: Session,
    bytes: Vec<u8>,
    own: Option<Own>,
    earlier: Option<Earlier>,
    model: Model,
    model_named: String,
    model_text: String,
    model_sha256: String,
    /// What the recording's own scenario had put in, then what was asked for.
    faults: Vec<Fault>,
    injected: usize,
    /// Whether the recording's own scenario put faults in that are not in this replay.
    leaves_faults_out: bool,
    criteria: Vec<AnyCriterion>,
}

impl Read {
    /// Whether a replay must be the recording again: it is ours, the model is its own, nothing is put in, and what the model
    /// makes follows from what is left.
    fn must_be_same(&self, clamp: Clamp) -> bool {
        let own = self.own.as_ref().filter(|own| own.model_sha256 == self.model_sha256);
        let determined = matches!(clamp, Clamp::Nothing | Clamp::Sensed);
        own.is_some() && self.injected == 0 && determined && !self.leaves_faults_out
    }
}

impl Arguments {
    /// Does what was asked for.
    pub fn run(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Exit, Error> {
        self.check()?;
        let options = self.reading.options()?;
        let read = self.read(catalog, console)?;
        let request = Request {
            session: &read.session,
            map: &options.map,
            model: &read.model,
            catalog,
            own: read.own.as_ref(),
            earlier: read.earlier.as_ref(),
            clamp: self.clamp,
            faults: &read.faults,
            injected: read.injected,
            must_be_same: read.must_be_same(self.clamp),
            seed: self.seed,
        };
        let replayed = replay(&request)?;
        if !replayed.idle.is_empty() {
            console.error(&did_nothing(&replayed.idle, "--with").file(&self.recording));
            return Ok(Exit::Idle);
        }
        let known = judge::known(&read.model, replayed.case.mass_kg);
        let verdicts = judge::judged(&read.criteria, &replayed.made.trace, &known);
        let written = self.written(&request, &read, &replayed)?;
        let mut provenance = vec![
            ("program".to_owned(), format!("dockhil {}", env!("CARGO_PKG_VERSION"))),
            (
                self.recording.display().to_string(),
                format!("grade {:?}, sha256 {}", read.session.grade, read.session.sha256),
            ),
            (format!("model {}", read.model_named), format!("sha256 {}", read.model_sha256)),
        ];
        provenance.extend(written.as_ref().map(|(path, _, what)| (path.display().to_string(), what.clone())));
        let page = page::page(&request, &replayed, &verdicts, &console.command, &provenance);
        if let Some((path, bytes, _)) = &written {
            console.write(path, bytes)?;
        }
        if let Some(path) = &self.outputs.json {
            console.save(path, &format!("{:#}\n", self.answer(&request, &read, &replayed, &verdicts)))?;
        }
        if let Some(path) = &self.outputs.report {
            console.save(path, &html(&page))?;
        }
        if !self.outputs.takes_stdout() {
            console.print(&text(&page, TEXT_WIDTH));
        }
        Ok(if replayed.diverged(&request).is_some() { Exit::Diverged } else { exit(&verdicts) })
    }

    /// Refuses now what could not be written later.
    fn check(&self) -> Result<(), Error> {
        let read = || [&self.recording].into_iter().chain(&self.model).chain(&self.criteria).chain(&self.reading.map);
        self.outputs.check(read())?;
        if let Some(path) = &self.output {
            inputs::not_read(path, read())?;
            self.outputs.written_once(path)?;
            inputs::writable_new(path, self.force)?;
        }
        Ok(())
    }

    fn read(&self, catalog: &Catalog<Axis>, console: &mut Console<'_>) -> Result<Read, Error> {
        let mut sessions = self.reading.sessions_along(std::slice::from_ref(&self.recording), console)?;
        let session = sessions.pop().ok_or_else(|| Error::new("no recording was read").file(&self.recording))?;
        let bytes = std::fs::read(&self.recording)
            .map_err(|error| Error::new(format!("cannot be read: {error}")).file(&self.recording))?;
        let is_mcap = bytes.starts_with(mcap::MAGIC);
        let found = if is_mcap { luggage(&bytes).ok() } else { None };
        let own = found.as_ref().map(|luggage| Own::find(&self.recording, luggage)).transpose()?.flatten();
        let earlier = found.as_ref().and_then(Earlier::find);
        let Some((path, model_text)) = self.model_text(own.as_ref(), earlier.as_ref())? else {
            return Err(self.without_model(session.grade));
        };
        let model_named = path.display().to_string();
        let model = Model::parse(&model_named, &model_text, catalog)?;
        let model = model.with_identified_robot().map_err(|error| error.file(&path))?;
        let model_sha256 = sha256_hex(model_text.as_bytes());
        let injected = self.faults.iter().map(|text| fault(text, &model, catalog)).collect::<Result<Vec<_>, _>>()?;
        let scenario = own.as_ref().map(|own| own.source.parse(catalog)).transpose()?.map(|(scenario, _)| scenario);
        // Who brings a model of his own asks what that model says; the recording's faults are then part of what is asked about.
        let scheduled = scenario.as_ref().filter(|_| self.model.is_none() && self.clamp == Clamp::Nothing);
        let leaves_faults_out =
            scheduled.is_none() && scenario.as_ref().is_some_and(|scenario| !scenario.faults.is_empty());
        let scheduled = scheduled.map_or(Vec::new(), |scenario| scenario::acting(&scenario.faults, catalog));
        each_once(&scheduled, &injected)?;
        self.check_delays(&model, &injected)?;
        if own.is_some() && self.seed.is_some() && self.clamp == Clamp::Nothing {
            return Err(Error::new("the recording has a seed of its own: its noise is drawn from that")
                .file(&self.recording)
                .place("--seed")
                .help("leave --seed out"));
        }
        let criteria = self.criteria(scenario.as_ref(), &session)?;
        let count = injected.len();
        let faults = scheduled.into_iter().chain(injected).collect();
        let injected = count;
        Ok(Read {
            session,
            bytes,
            own,
            earlier,
            model,
            model_named,
            model_text,
            model_sha256,
            faults,
            injected,
            leaves_faults_out,
            criteria,
        })
    }

    /// Refuses delays that no loop can have. The same effect is never in two lists, so that what is asked for is looked at alone.
    fn check_delays(&self, model: &Model, injected: &[Fault]) -> Result<(), Error> {
        let asked =
            injected.iter().filter_map(|fault| Some((fault.chosen.kind.id.as_ref(), *fault.chosen.values.first()?)));
        check_delays(&model.timing, delays(model.effects.iter()).chain(asked)).map_err(|(id, what)| {
            let given = self.faults.iter().find(|text| text.starts_with(id));
            let place = given.map_or_else(|| "--with".to_owned(), |text| format!("--with {text}"));
            Error::new(what).file(&self.recording).place(place).help(DELAY_HELP)
        })
    }

    /// The model's file and its text: the one that was asked for, else the recording's own.
    fn model_text(&self, own: Option<&Own>, earlier: Option<&Earlier>) -> Result<Option<(PathBuf, String)>, Error> {
        Ok(match (&self.model, own, earlier) {
            (Some(path), ..) => Some((path.clone(), inputs::model_text(path)?)),
            (None, Some(own), _) => Some((own.source.model_file.clone(), own.source.model_text.clone())),
            (None, None, Some(Earlier { model_text: Some(text), .. })) => {
                Some((format!("{} / {MODEL_FILE}", self.recording.display()).into(), text.clone()))
            }
            _ => None,
        })
    }

    fn without_model(&self, grade: Grade) -> Error {
        let (what, help) = match grade {
            Grade::B => (
                "is cut off: what a run was made from stands at the end of its recording, and is lost",
                "give the model, --model MODEL.toml, to replay what is left; or copy the file again, if the original is whole",
            ),
            Grade::C => (
                "is damaged: what it was made from cannot be read",
                "give the model, --model MODEL.toml, to replay what is left; or copy the file again, if the original is whole",
            ),
            Grade::A | Grade::D => (
                "the recording does not hold its model",
                "give one: --model MODEL.toml; a nominal one is written by: dockhil model init RECORDING -o MODEL.toml",
            ),
        };
        Error::new(what).file(&self.recording).help(help)
    }

    /// Those that were asked for, else those of the recording's own scenario, else that the contact absorbs energy.
    fn criteria(&self, scenario: Option<&Scenario>, session: &Session) -> Result<Vec<AnyCriterion>, Error> {
        if let Some(path) = &self.criteria {
            let text = std::fs::read_to_string(path).map_err(|error| {
                Error::new(format!("cannot read the criteria: {error}"))
                    .file(path)
                    .help("check the path after --criteria")
            })?;
            return Ok(Scenario::parse(&path.display().to_string(), &text)?.criteria);
        }
        Ok(match scenario {
            Some(scenario) => scenario.criteria.clone(),
            None if session.kind == Kind::Impact => vec![
                AnyCriterion::ObservedEnergy(ObservedEnergy::default()),
                AnyCriterion::Restitution(Restitution { at_most: Some(1.0), ..Restitution::default() }),
            ],
            None => Vec::new(),
        })
    }

    /// The recording that -o names, its bytes, and what it is in words.
    fn written(
        &self,
        request: &Request<'_>,
        read: &Read,
        replayed: &Replayed,
    ) -> Result<Option<(PathBuf, Vec<u8>, String)>, Error> {
        let Some(path) = &self.output else { return Ok(None) };
        let faults: Vec<String> = request.faults.iter().map(Fault::words).collect();
        let record: BTreeMap<String, String> = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("recording_sha256", read.session.sha256.clone()),
            ("model_sha256", read.model_sha256.clone()),
            ("clamp", self.clamp.name().to_owned()),
            ("faults", faults.join("; ")),
            ("seed", self.seed.map_or(String::new(), |seed| seed.to_string())),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect();
        let added = Luggage {
            metadata: vec![(REPLAY_RECORD.to_owned(), record)],
            files: vec![(MODEL_FILE.to_owned(), read.model_text.clone().into_bytes())],
        };
        let (bytes, copied) = replayed.mcap(request, &read.bytes, &added)?;
        let what = format!("{}, sha256 {}", page::copied(copied), sha256_hex(&bytes));
        Ok(Some((path.clone(), bytes, what)))
    }

    fn answer(
        &self,
        request: &Request<'_>,
        read: &Read,
        replayed: &Replayed,
        verdicts: &[Verdict],
    ) -> serde_json::Value {
        json!({
            "schema": 1,
            "recording": { "file": self.recording, "sha256": read.session.sha256, "grade": read.session.grade },
            "model": { "file": read.model_named, "sha256": read.model_sha256 },
            "clamp": self.clamp,
            "faults": request.faults.iter().map(Fault::words).collect::<Vec<_>>(),
            "seed": self.seed,
            "streams": replayed.streams,
            "diverged": replayed.diverged(request),
            "ran_away_s": replayed.made.ran_away_s,
            "verdicts": verdicts,
            "outcome": judge::outcome(verdicts),
        })
    }
}

/// Refuses a fault that is there twice.
fn each_once(scheduled: &[Fault], injected: &[Fault]) -> Result<(), Error> {
    if let Some(both) = injected.iter().find(|fault| scheduled.iter().any(|other| same_kind(other, fault))) {
        let what = format!("effect {} is in the recording's own scenario already", both.chosen.kind.id);
        return Err(Error::new(what)
            .place("--with")
            .help("give --model MODEL.toml to leave the scenario's faults out"));
    }
    if let Some(nth) =
        (1..injected.len()).find(|&nth| injected[..nth].iter().any(|other| same_kind(other, &injected[nth])))
    {
        let what = format!("effect {} is put in twice", injected[nth].chosen.kind.id);
        return Err(Error::new(what).place("--with").help("give each effect once, with all its parameters"));
    }
    Ok(())
}

fn same_kind(one: &Fault, other: &Fault) -> bool {
    one.chosen.kind.id == other.chosen.kind.id
}

/// An effect as it was typed; every parameter without a default must be named.
fn fault(text: &str, model: &Model, catalog: &Catalog<Axis>) -> Result<Fault, Error> {
    let typed = EffectText::parse(text, catalog)?;
    let place = || format!("argument {text:?}");
    let kind = catalog.get(&typed.id).ok_or_else(|| Error::new("unknown effect").place(place()))?;
    let value = |param: &sim_core::effect::Param| {
        let given = typed.values.iter().find(|(name, _)| *name == param.name).map(|(_, value)| *value);
        given.or(param.default).ok_or_else(|| {
            Error::new(format!("effect {} lacks its parameter {}", typed.id, param.name))
                .place(place())
                .help(format!("add it: {}:{}=a number in {}", typed.id, param.name, param.unit))
        })
    };
    let values = kind.params.iter().map(value).collect::<Result<Vec<_>, _>>()?;
    if model.effects.iter().any(|effect| effect.enabled && effect.id == typed.id) {
        return Err(Error::new(format!("effect {} is in the model already", typed.id))
            .place(place())
            .help("take it out of the model, or leave --with out"));
    }
    if kind.rigs == sim_core::effect::Where::Drive {
        return Err(Error::new(format!("effect {} cannot happen on this rig", typed.id))
            .place(place())
            .help("see the rigs of each effect with: dockhil effect list"));
    }
    Ok(Fault::always(Chosen { kind: kind.clone(), values }))
}
