//! Where a scenario comes from: a file and the model beside it, or the program itself.

use super::Scenario;
use crate::error::Error;
use crate::model::{Model, SpaceModel};
use fixtures::{SCENARIO_MODELS, SCENARIOS};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Component, Path, PathBuf};

/// The texts of a scenario and of its model.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// The scenario's file; for one inside the program, its name.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
    /// The model's file.
    pub model_file: PathBuf,
    /// Its text.
    pub model_text: String,
    /// Whether it is inside the program.
    pub is_embedded: bool,
}

/// Every scenario inside the program, in the order of the names.
pub fn embedded() -> impl Iterator<Item = Result<Scenario, Error>> {
    SCENARIOS.iter().map(|file| Scenario::parse(file.name, file.text))
}

impl Source {
    /// Finds a scenario by the path of its file, or by its name among those inside the program.
    pub fn find(named: &Path) -> Result<Self, Error> {
        let name = named.to_str().unwrap_or_default();
        let is_inside = SCENARIOS.iter().any(|file| file.name.strip_suffix(".toml") == Some(name));
        if named.is_dir() && !is_inside {
            let help =
                "name a scenario in it, a file that ends in .toml; or list the scenarios inside: dockhil run --list";
            return Err(Error::new("is a folder, expected a scenario").file(named).help(help));
        }
        let is_file = named.is_file() || name.ends_with(".toml") || named.components().count() > 1;
        if is_file { Source::read(named) } else { Source::embedded(name) }
    }

    fn read(file: &Path) -> Result<Self, Error> {
        let read = |path: &Path, what: &str, help: &str| {
            let text = std::fs::read_to_string(path);
            text.map_err(|error| {
                Error::new(format!("cannot read the {what}: {error}")).file(path).help(help.to_owned())
            })
        };
        let text = read(file, "scenario", "check the path, or list the scenarios inside: dockhil run --list")?;
        let scenario = Scenario::parse(&file.display().to_string(), &text)?;
        let model_file = file.parent().unwrap_or(Path::new("")).join(&scenario.model);
        let help = "correct the key model of the scenario: it is seen from the scenario's folder";
        let model_text = read(&model_file, "model", help)?;
        Ok(Source { file: file.to_path_buf(), text, model_file, model_text, is_embedded: false })
    }

    fn embedded(name: &str) -> Result<Self, Error> {
        let file_name = format!("{name}.toml");
        let found = SCENARIOS.iter().find(|file| file.name == file_name);
        let file = found.ok_or_else(|| {
            let names: Vec<&str> = SCENARIOS.iter().map(|file| file.name.trim_end_matches(".toml")).collect();
            Error::new(format!("there is no scenario {name:?} inside the program, and no such file"))
                .place("argument SCENARIO")
                .help(format!("give a file that ends in .toml, or one of: {}", names.join(", ")))
        })?;
        let scenario = Scenario::parse(file.name, file.text)?;
        let model = SCENARIO_MODELS.iter().find(|model| model.name == scenario.model);
        let model = model.ok_or_else(|| {
            Error::new(format!("the model {} is not inside the program", scenario.model)).file(file.name)
        })?;
        Ok(Source {
            file: file.name.into(),
            text: file.text.to_owned(),
            model_file: model.name.into(),
            model_text: model.text.to_owned(),
            is_embedded: true,
        })
    }

    /// The same for a model with six axes.
    ///
    /// # Errors
    /// When one of the two is wrong, or they do not go together.
    pub fn parse_space(&self, catalog: &Catalog<Axis>) -> Result<(Scenario, SpaceModel), Error> {
        let scenario = Scenario::parse(&self.file.display().to_string(), &self.text)?;
        let model = SpaceModel::parse(&self.model_file.display().to_string(), &self.model_text, catalog)?;
        scenario.check_length(self, model.timing.loop_period_s)?;
        scenario.check_faults(self, &model.effects, &model.timing, catalog)?;
        Ok((scenario, model))
    }

    /// The model's file as the scenario names it.
    ///
    /// # Errors
    /// When that would lead out of the scenario's folder.
    pub fn model_named(&self) -> Result<PathBuf, Error> {
        let scenario = Scenario::parse(&self.file.display().to_string(), &self.text)?;
        let path = PathBuf::from(&scenario.model);
        if path.components().all(|part| matches!(part, Component::Normal(_))) {
            return Ok(path);
        }
        let what = format!("the model {} lies outside the scenario's folder", scenario.model);
        Err(Error::new(what).file(&self.file).place("key model").help("copy the two files by hand"))
    }

    /// Scenario and model, each checked, and checked against each other.
    pub fn parse(&self, catalog: &Catalog<Axis>) -> Result<(Scenario, Model), Error> {
        let scenario = Scenario::parse(&self.file.display().to_string(), &self.text)?;
        let model = Model::parse(&self.model_file.display().to_string(), &self.model_text, catalog)?;
        let model = model.with_identified_robot().map_err(|error| error.file(&self.model_file))?;
        scenario.check_with(self, &model, catalog)?;
        Ok((scenario, model))
    }
}
