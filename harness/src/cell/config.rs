//! A cell as a file: which robots, which sensor, where they stand, what they speak, and what the virtual cell gets wrong.
//!
//! TOML, units in the keys, unknown keys refused with their place. Wire units (mm, deg) stand where a robot controller counts in
//! them; all else is SI. Paths are seen from the folder of the file.
//!
//! How a robot's documents travel stands in its Ethernet configuration alone: with `<PROTOCOL>TCP</PROTOCOL>` (KRC2) the robot
//! connects to `listen`, otherwise it sends datagrams there; `<PROTCOLLENGTH>On</PROTCOLLENGTH>` puts a length before each document.
//!
//! `[time]`, `[start]`, `[[fault]]`, `seed`, `frame_bytes`, `limits` and `late` are for the virtual cell; a recorder of a real one ignores them.

use crate::error::Error;
use crate::model::parsed;
use crate::scenario::fault_schemas;
use drivers::fault::WireFault;
use drivers::ft;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// A whole cell.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellConfig {
    /// Version of this format: 1.
    pub schema: u32,
    /// What the cell is called.
    pub name: String,
    /// What it is for, and where its numbers come from.
    #[serde(default)]
    pub about: String,
    /// The nominal model: what the operator believes. It becomes the `session` record.
    pub model: String,
    /// Where all randomness of the virtual cell comes from; the virtual cell needs it.
    #[serde(default)]
    pub seed: Option<u64>,
    /// Clock of the virtual cell.
    #[serde(default)]
    pub time: TimeConfig,
    /// How the virtual cell begins.
    #[serde(default)]
    pub start: StartConfig,
    /// One robot, or two.
    #[serde(rename = "robot")]
    pub robots: Vec<RobotConfig>,
    /// The force/torque sensor.
    pub sensor: SensorConfig,
    /// Wire faults and effects of the catalogue, each with its `id`.
    #[serde(default, rename = "fault")]
    #[schemars(with = "Vec<WireFault>")]
    pub faults: Vec<toml::Table>,
}

/// Clock of the virtual cell.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TimeConfig {
    /// Length of a cycle of the robot controller.
    pub cycle_s: f64,
}

impl Default for TimeConfig {
    fn default() -> Self {
        TimeConfig { cycle_s: 0.004 }
    }
}

/// How the virtual cell begins; where it begins follows from `start_mm_deg` of its robots.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartConfig {
    /// Speed with which the probe has been coming in, as if for ever; positive closes the gap.
    pub velocity_m_per_s: f64,
}

/// What a robot carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Carries {
    /// The probe, and the sensor behind it.
    Probe,
    /// The nozzle.
    Nozzle,
}

/// The family of a robot controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FamilyName {
    /// KR C2, over TCP or UDP.
    Krc2,
    /// KR C4.
    #[default]
    Krc4,
    /// KR C5.
    Krc5,
    /// iiQKA.OS2.
    Iiqka,
}

/// How a correction counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ModeName {
    /// From the pose at the start.
    #[default]
    Absolute,
    /// Added to the running correction in each cycle.
    Relative,
}

/// The form of the documents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FormName {
    /// Elements directly in the root.
    #[default]
    Flat,
    /// Elements in `<Dat TaskType="b">`.
    Dat,
}

/// Name of the element that carries the correction.
pub type Correction = String;

/// One robot and its controller.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// What it is called.
    pub name: String,
    /// What it carries.
    pub carries: Carries,
    /// Its Ethernet configuration.
    pub rsi: String,
    /// Where the PC is bound, or listens if the robot speaks TCP; the virtual controller sends there.
    #[schemars(with = "String")]
    pub listen: SocketAddr,
    /// Its controller.
    #[serde(default)]
    pub family: FamilyName,
    /// How its corrections count.
    #[serde(default)]
    pub mode: ModeName,
    /// The form of its documents.
    #[serde(default)]
    pub form: FormName,
    /// Element of the correction.
    #[serde(default = "correction")]
    pub correction: Correction,
    /// Digits after the point, both ways.
    #[serde(default = "decimals")]
    pub decimals: u8,
    /// Virtual controller: fewest bytes of a frame; NUL fills it up.
    #[serde(default)]
    pub frame_bytes: usize,
    /// The robot's BASE in the laboratory, with its rail at zero.
    #[serde(default)]
    pub base: PlaceConfig,
    /// Probe tip or nozzle, seen from the tool.
    #[serde(default)]
    pub interface: PlaceConfig,
    /// Rail that moves the base.
    #[serde(default)]
    pub rail: Option<RailConfig>,
    /// Pose of the tool in BASE at the start, in mm and deg: what RIst reports then.
    #[serde(default)]
    pub start_mm_deg: [f64; 6],
    /// Limits of the virtual controller.
    #[serde(default)]
    pub limits: LimitsConfig,
    /// What the virtual controller makes of late answers.
    #[serde(default)]
    pub late: LateConfig,
}

fn correction() -> Correction {
    "RKorr".to_owned()
}

fn decimals() -> u8 {
    4
}

/// A place: a position, and turns about z, y' and x''.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlaceConfig {
    /// Position.
    pub position_m: [f64; 3],
    /// Turns A, B, C.
    pub abc_deg: [f64; 3],
}

/// A rail under a robot.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RailConfig {
    /// The external axis that moves it, `E1` to `E6`, in mm.
    pub axis: String,
    /// The way that the base goes for a growing axis, in the laboratory; of length 1.
    pub direction: [f64; 3],
}

/// Limits of a virtual robot controller, on the whole correction.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LimitsConfig {
    /// Correction of X, Y and Z, each way: it saturates without a word.
    pub translation_mm: f64,
    /// Turn of the correction: it saturates without a word.
    pub rotation_deg: f64,
    /// Length of the correction that stops the robot; none if it is not said.
    pub stop_translation_mm: Option<f64>,
    /// Turn of the correction that stops the robot; none if it is not said.
    pub stop_rotation_deg: Option<f64>,
}

impl Default for LimitsConfig {
    fn default() -> Self {
        // What KUKA ships: POSCORR 5 mm and 5 deg.
        LimitsConfig { translation_mm: 5.0, rotation_deg: 5.0, stop_translation_mm: None, stop_rotation_deg: None }
    }
}

/// What counts as too many late answers.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(tag = "rule", rename_all = "lowercase", deny_unknown_fields)]
pub enum LateConfig {
    /// Late answers in all.
    Total {
        /// The answer after which the robot stops.
        limit: u32,
    },
    /// Late answers in a row.
    Consecutive {
        /// The answer after which the robot stops.
        limit: u32,
    },
    /// Late answers among the last ones.
    Percent {
        /// Share in percent at which the robot stops.
        limit: f64,
        /// How many answers are looked at.
        window: u32,
    },
}

impl Default for LateConfig {
    fn default() -> Self {
        LateConfig::Total { limit: 10 }
    }
}

/// The force/torque sensor.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
pub struct SensorConfig {
    /// Where the sensor is; the virtual one listens there.
    #[schemars(with = "String")]
    pub address: SocketAddr,
    /// Where its web server is, if it has one: a controller that is told reads the calibration there. ATI's is at port 80.
    #[serde(default)]
    #[schemars(with = "Option<String>")]
    pub page: Option<SocketAddr>,
    /// All other keys of the table: what it speaks, and what it counts.
    #[serde(flatten)]
    #[schemars(with = "ft::Settings")]
    pub protocol: toml::Table,
}

/// A file that a cell names.
#[derive(Debug, Clone, PartialEq)]
pub struct TextFile {
    /// Where it is; for one inside the program, its name.
    pub file: PathBuf,
    /// What it says.
    pub text: String,
}

/// A cell with all the files that it names.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// What it says.
    pub config: CellConfig,
    /// The file itself.
    pub source: TextFile,
    /// Its model.
    pub model: TextFile,
    /// The Ethernet configuration of each robot, in their order.
    pub rsi: Vec<TextFile>,
    /// Whether all of it is inside the program.
    pub is_embedded: bool,
}

/// Names of the cells inside the program.
pub fn embedded() -> impl Iterator<Item = &'static str> {
    let cells = fixtures::CELL_FILES.iter().map(|file| file.name);
    cells.filter(|name| !name.contains('/')).map(|name| name.trim_end_matches(".toml"))
}

/// The JSON schema of a cell's file, with all faults and effects that this catalogue knows.
pub fn schema(catalog: &Catalog<Axis>) -> Value {
    let mut schema = serde_json::to_value(schemars::schema_for!(CellConfig)).unwrap_or(Value::Null);
    let effects = fault_schemas(catalog);
    if let Some(definitions) = schema.get_mut("$defs").and_then(Value::as_object_mut) {
        let wire = definitions.remove("WireFault").unwrap_or(Value::Null);
        let fault = json!({ "anyOf": [wire, { "oneOf": effects }] });
        definitions.insert("WireFault".into(), fault);
        // The keys of the protocol stand beside the table's own.
        definitions["SensorConfig"]["additionalProperties"] = json!(false);
    }
    schema
}

impl CellConfig {
    /// Reads a cell from text and checks it; `name` stands in errors.
    ///
    /// # Errors
    /// When the text is not TOML, has an unknown key, or a value that cannot be; the error points at it.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        let config: CellConfig = parsed(name, text, "dockhil cell --schema")?;
        config.check(name, text)?;
        Ok(config)
    }

    /// The robot that carries this.
    pub fn robot(&self, carries: Carries) -> Option<&RobotConfig> {
        self.robots.iter().find(|robot| robot.carries == carries)
    }
}

impl Cell {
    /// Finds a cell by the path of its file, or by its name among those inside the program, and reads all that it names.
    ///
    /// # Errors
    /// When one of the files cannot be read, or the cell is wrong.
    pub fn find(named: &Path) -> Result<Self, Error> {
        let name = named.to_str().unwrap_or_default();
        let is_file = named.is_file() || name.ends_with(".toml") || named.components().count() > 1;
        if is_file {
            let folder = named.parent().unwrap_or(Path::new(""));
            let source = read(named, "cell", "check the path after --cell")?;
            return Cell::with(source, false, |key, path| {
                let help = format!("correct the key {key} of the cell: it is seen from the cell's folder");
                read(&folder.join(path), "file", &help)
            });
        }
        let inside = |path: &str| {
            let found = fixtures::CELL_FILES.iter().find(|file| file.name == path)?;
            Some(TextFile { file: found.name.into(), text: found.text.to_owned() })
        };
        let source = inside(&format!("{name}.toml")).ok_or_else(|| {
            Error::new(format!("there is no cell {name:?} inside the program, and no such file"))
                .place("argument --cell")
                .help(format!(
                    "give a file that ends in .toml, or one of: {}",
                    embedded().collect::<Vec<_>>().join(", ")
                ))
        })?;
        Cell::with(source, true, |_, path| {
            inside(path).ok_or_else(|| Error::new(format!("the file {path} is not inside the program")).file(named))
        })
    }

    /// The files that were read.
    pub fn files(&self) -> Vec<&PathBuf> {
        let all = [&self.source, &self.model].into_iter().chain(&self.rsi);
        all.filter(|_| !self.is_embedded).map(|file| &file.file).collect()
    }

    fn with(
        source: TextFile,
        is_embedded: bool,
        read: impl Fn(&str, &str) -> Result<TextFile, Error>,
    ) -> Result<Self, Error> {
        let config = CellConfig::parse(&source.file.display().to_string(), &source.text)?;
        let model = read("model", &config.model)?;
        let rsi = config.robots.iter().map(|robot| read("rsi", &robot.rsi)).collect::<Result<_, _>>()?;
        Ok(Cell { config, source, model, rsi, is_embedded })
    }
}

fn read(file: &Path, what: &str, help: &str) -> Result<TextFile, Error> {
    let text = std::fs::read_to_string(file);
    let text =
        text.map_err(|error| Error::new(format!("cannot read the {what}: {error}")).file(file).help(help.to_owned()))?;
    Ok(TextFile { file: file.to_path_buf(), text })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bench(from: &str, to: &str) -> String {
        let text = Cell::find(Path::new("bench")).unwrap().source.text;
        assert!(text.contains(from), "{from}");
        CellConfig::parse("CELL.toml", &text.replace(from, to))
            .map_or_else(|error| error.to_string(), |_| "fine".into())
    }

    #[test]
    fn the_cells_inside_the_program_read() {
        for name in embedded() {
            let cell = Cell::find(Path::new(name)).unwrap();
            assert_eq!(cell.config.name, name);
            assert_eq!(cell.rsi.len(), cell.config.robots.len());
            assert_eq!(cell.config.robot(Carries::Probe).unwrap().correction, "RKorr");
            assert!(!cell.config.sensor.protocol.contains_key("address"), "{:?}", cell.config.sensor);
        }
    }

    #[test]
    fn mistakes_are_shown_at_their_line() {
        assert_eq!(bench("schema = 1", "schema = 1"), "fine");
        assert_eq!(
            bench("schema = 1", "schema = 2"),
            "CELL.toml: line 2: schema = 2 is not 1, the only version there is"
        );
        let line = |what: &str, line: usize| assert!(what.starts_with(&format!("CELL.toml: line {line}: ")), "{what}");
        line(&bench("cycle_s = 0.004", "cycle_s = 4"), 9);
        line(&bench("decimals = 9", "decimals = 99"), 23);
        line(&bench("family = \"krc4\"", "family = \"krc9\""), 19);
        line(&bench("carries = \"probe\"", "carries = \"nozzle\""), 14);
        line(&bench("127.0.0.1:49152", "127.0.0.1:49153"), 18);
        line(&bench("limit = 100", "limit = 0"), 28);
    }
}
