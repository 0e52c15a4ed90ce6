//! Edits a model file in place and keeps its comments.

use super::{Model, unknown_effect};
use crate::error::Error;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::path::{Path, PathBuf};
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// One effect as it was typed: `id` or `id:param=value,param=value`.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectText {
    /// Which effect.
    pub id: String,
    /// The values that were given.
    pub values: Vec<(String, f64)>,
}

impl EffectText {
    /// Reads `id[:param=value[,param=value…]]` and checks it against the catalogue.
    pub fn parse(text: &str, catalog: &Catalog<Axis>) -> Result<Self, Error> {
        let (id, rest) = text.split_once(':').unwrap_or((text, ""));
        let kind = catalog.get(id).ok_or_else(|| {
            Error::new(unknown_effect(id, catalog))
                .place(format!("argument {text:?}"))
                .help("see all of them with: dockhil effect list")
        })?;
        let mut values = Vec::new();
        for pair in rest.split([',', ':']).filter(|pair| !pair.is_empty()) {
            let names = || kind.params.iter().map(|param| param.name.as_ref()).collect::<Vec<_>>().join(", ");
            let bad = |what: String, help: String| Error::new(what).place(format!("argument {text:?}")).help(help);
            let (name, number) = pair.split_once('=').ok_or_else(|| {
                bad(format!("{pair:?} is not param=value"), format!("the parameters of {id} are: {}", names()))
            })?;
            let param = kind.params.iter().find(|param| param.name == name).ok_or_else(|| {
                bad(format!("effect {id} has no parameter {name}"), format!("its parameters are: {}", names()))
            })?;
            let number: f64 = number
                .parse()
                .map_err(|_| bad(format!("{number:?} is not a number"), format!("give {name} in {}", param.unit)))?;
            if !(number >= param.lower && number <= param.upper) {
                let limits = format!("{name} = {number} {} is outside [{}, {}]", param.unit, param.lower, param.upper);
                return Err(bad(limits, "give a value inside".into()));
            }
            if param.discrete && !param.starts.contains(&number) {
                return Err(bad(
                    format!("{name} = {number} is none of {:?}", param.starts),
                    "choose one of them".into(),
                ));
            }
            if values.iter().any(|(other, _)| other == name) {
                return Err(bad(format!("{name} is given twice"), "give each parameter once".into()));
            }
            values.push((name.to_string(), number));
        }
        Ok(EffectText { id: id.to_string(), values })
    }
}

/// A model file that is being edited.
pub struct Editor {
    path: PathBuf,
    document: DocumentMut,
}

impl Editor {
    /// Opens a model file; it must be valid before it is edited.
    pub fn open(path: &Path, catalog: &Catalog<Axis>) -> Result<Self, Error> {
        Model::read(path, catalog)?;
        let text = std::fs::read_to_string(path).map_err(|error| Error::new(error.to_string()).file(path))?;
        let document = text.parse::<DocumentMut>().map_err(|error| Error::new(error.to_string()).file(path))?;
        if document.get("effect").is_some_and(|item| !item.is_array_of_tables()) {
            let what = "the effects stand in one list, which cannot be edited here";
            return Err(Error::new(what)
                .file(path)
                .place("key effect")
                .help("write each of them as a table of its own: [[effect]]"));
        }
        Ok(Editor { path: path.to_path_buf(), document })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The ids of the effects in the file.
    pub fn effects(&self) -> Vec<String> {
        let tables = self.document.get("effect").and_then(Item::as_array_of_tables);
        let id = |table: &Table| table.get("id").and_then(Item::as_str).unwrap_or_default().to_string();
        tables.map(|tables| tables.iter().map(id).collect()).unwrap_or_default()
    }

    /// Adds an effect, or sets the values of one that is there.
    pub fn set(&mut self, id: &str, values: &[(String, f64)], source: &str) {
        let tables = self.document.entry("effect").or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
        let Some(tables) = tables.as_array_of_tables_mut() else { return };
        let is_this = |table: &Table| table.get("id").and_then(Item::as_str) == Some(id);
        if !tables.iter().any(is_this) {
            let mut table = Table::new();
            table["id"] = value(id);
            tables.push(table);
        }
        if let Some(table) = tables.iter_mut().find(|table| is_this(table)) {
            for (name, number) in values {
                put(table, name, (*number).into());
            }
            put(table, "source", source.into());
        }
    }

    /// Takes an effect out; says whether it was there.
    pub fn remove(&mut self, id: &str) -> bool {
        let Some(tables) = self.document.get_mut("effect").and_then(Item::as_array_of_tables_mut) else { return false };
        let before = tables.len();
        tables.retain(|table| table.get("id").and_then(Item::as_str) != Some(id));
        let removed = tables.len() < before;
        if tables.is_empty() {
            self.document.remove("effect");
        }
        removed
    }

    /// Sets a base value, as `contact.stiffness_n_per_m`.
    pub fn set_base(&mut self, table: &str, key: &str, number: f64) {
        let entry = self.document.entry(table).or_insert(Item::Table(Table::new()));
        if let Some(table) = entry.as_table_mut() {
            put(table, key, number.into());
        } else {
            entry[key] = value(number);
        }
    }

    /// Sets all base values.
    pub fn set_all_base(&mut self, base: &crate::blocks::Base) {
        self.set_base("plant", "mass_kg", base.mass_kg);
        self.set_base("contact", "stiffness_n_per_m", base.stiffness_n_per_m);
        self.set_base("contact", "damping_n_s_per_m", base.damping_n_s_per_m);
        self.set_base("contact", "offset_n", base.offset_n);
    }

    /// Whether the file has this table, as `["sensor", "calibration"]`.
    pub fn has(&self, path: &[&str]) -> bool {
        let mut item = Some(self.document.as_item());
        for name in path {
            item = item.and_then(|item| item.get(name));
        }
        item.is_some()
    }

    /// Sets values of a table, and makes it where it is missing; `path` as `["sensor", "calibration"]`.
    pub fn set_table(&mut self, path: &[&str], values: &[(&str, toml_edit::Value)]) {
        let mut table = self.document.as_table_mut() as &mut dyn toml_edit::TableLike;
        for (depth, name) in path.iter().enumerate() {
            let mut new = Table::new();
            // A table that only holds others needs no line of its own.
            new.set_implicit(depth + 1 < path.len());
            let Some(inner) = table.entry(name).or_insert(Item::Table(new)).as_table_like_mut() else { return };
            table = inner;
        }
        for (key, value) in values {
            let mut value = value.clone();
            if let Some(old) = table.get(key).and_then(Item::as_value) {
                *value.decor_mut() = old.decor().clone();
            }
            table.insert(key, Item::Value(value));
        }
    }

    /// Takes a key out of a table, if it is there.
    pub fn remove_key(&mut self, path: &[&str], key: &str) {
        let mut table = self.document.as_table_mut() as &mut dyn toml_edit::TableLike;
        for name in path {
            let Some(inner) = table.get_mut(name).and_then(Item::as_table_like_mut) else { return };
            table = inner;
        }
        table.remove(key);
    }

    /// The text as it would be saved.
    pub fn text(&self) -> String {
        self.document.to_string()
    }

    /// Saves, all or nothing.
    pub fn save(&self, catalog: &Catalog<Axis>) -> Result<(), Error> {
        self.save_as(&self.path, catalog)
    }

    /// Saves to another file, all or nothing.
    pub fn save_as(&self, path: &Path, catalog: &Catalog<Axis>) -> Result<(), Error> {
        let text = self.text();
        Model::parse(&path.display().to_string(), &text, catalog)?;
        crate::files::write_whole(path, text.as_bytes())
    }
}

/// Sets a value and keeps the comment beside it.
fn put(table: &mut Table, key: &str, mut new: toml_edit::Value) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *new.decor_mut() = old.decor().clone();
    }
    table[key] = Item::Value(new);
}
