//! Arguments that several commands share, and the files behind them.

use crate::error::Error;
use crate::files::write_whole;
use crate::model::{Editor, Model, SpaceModel};
use crate::recording::{Kind, Map, ReadOptions, Role, Session, read};
use clap::Args;
use rayon::prelude::*;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::console::Console;

/// How recordings are read.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Reading")]
pub struct Reading {
    /// Topics, units and conventions of the recordings, if they are not the usual ones.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// Read the sound parts of a damaged recording; every verdict then carries grade C.
    #[arg(long)]
    pub salvage: bool,
}

impl Reading {
    /// As the reader wants it.
    pub fn options(&self) -> Result<ReadOptions, Error> {
        let map = match &self.map {
            None => Map::default(),
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|error| {
                    Error::new(format!("cannot read the map: {error}")).file(path).help("check the path after --map")
                })?;
                Map::parse(&path.display().to_string(), &text)?
            }
        };
        Ok(ReadOptions { map, salvage: self.salvage })
    }

    /// Reads recordings, in the order given; of several errors the first in that order counts.
    pub fn sessions(&self, paths: &[PathBuf], console: &Console<'_>) -> Result<Vec<Session>, Error> {
        read_all(paths, &self.options()?, console)
    }

    /// The same for a command that does not ask what was done in a recording: none needs to say it; nor does it need these roles.
    pub fn sessions_as(
        &self,
        kind: Kind,
        unneeded: &[Role],
        paths: &[PathBuf],
        console: &Console<'_>,
    ) -> Result<Vec<Session>, Error> {
        let mut options = self.options()?;
        options.map.optional.extend(unneeded);
        options.map.kind.get_or_insert(kind);
        read_all(paths, &options, console)
    }

    /// The same for a command that works along one axis.
    pub fn sessions_along(&self, paths: &[PathBuf], console: &Console<'_>) -> Result<Vec<Session>, Error> {
        let sessions = self.sessions(paths, console)?;
        sessions.iter().try_for_each(Session::along_one_axis)?;
        Ok(sessions)
    }
}

fn read_all(paths: &[PathBuf], options: &ReadOptions, console: &Console<'_>) -> Result<Vec<Session>, Error> {
    let progress = console.progress();
    let read_one = |path: &PathBuf| {
        progress.say(&format!("reading {}", path.display()));
        read(path, options)
    };
    let results: Vec<Result<Session, Error>> = paths.par_iter().map(read_one).collect();
    results.into_iter().collect()
}

/// A seed as it is typed.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("a seed is a whole number from 0 to {}", u64::MAX))
}

/// Where results go besides standard output.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Output")]
pub struct Outputs {
    /// Save the numbers as JSON; `-` prints them instead of the text.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Save a report page: one file, no network; `-` prints it instead of the text.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
}

impl Outputs {
    /// Refuses now what could not be written after minutes of computing.
    pub fn check<'p>(&'p self, read: impl Iterator<Item = &'p PathBuf> + Clone) -> Result<(), Error> {
        self.json.iter().chain(&self.report).try_for_each(|path| result(path, read.clone()))?;
        one_on_stdout(self.json.iter().chain(&self.report))?;
        match (&self.json, &self.report) {
            (Some(json), Some(report)) => not_the_same(report, json),
            _ => Ok(()),
        }
    }

    /// Refuses a result that another result of the same command would replace.
    pub fn written_once(&self, written: &Path) -> Result<(), Error> {
        self.json.iter().chain(&self.report).try_for_each(|path| not_the_same(path, written))
    }

    /// Whether standard output is for one of the results, and not for the text.
    pub fn takes_stdout(&self) -> bool {
        self.json.iter().chain(&self.report).any(|path| path == Path::new("-"))
    }
}

/// Refuses a second result on standard output: nobody could tell where one ends and the other begins.
pub fn one_on_stdout<'p>(written: impl IntoIterator<Item = &'p PathBuf>) -> Result<(), Error> {
    match written.into_iter().filter(|path| *path == Path::new("-")).count() {
        0 | 1 => Ok(()),
        _ => Err(Error::new("only one result can go to standard output")
            .place("argument -")
            .help("name a file for each of the others")),
    }
}

/// How a result begins: JSON, or a page.
const RESULTS: [&str; 2] = ["{", "<!doctype html"];

/// A result that may replace an older one, and nothing else: not what the command reads, and not what somebody else has written.
pub fn result<'p>(path: &Path, read: impl Iterator<Item = &'p PathBuf>) -> Result<(), Error> {
    if path == Path::new("-") {
        return Ok(());
    }
    writable(path)?;
    not_read(path, read)?;
    if !path.is_file() {
        return Ok(());
    }
    let mut head = Vec::new();
    let longest = RESULTS.iter().map(|start| start.len()).max().unwrap_or_default() as u64;
    let opened = std::fs::File::open(path).and_then(|file| file.take(longest).read_to_end(&mut head));
    opened.map_err(|error| Error::new(format!("cannot be read: {error}")).file(path).help("name another file"))?;
    let head = String::from_utf8_lossy(&head).to_lowercase();
    if head.is_empty() || RESULTS.iter().any(|start| head.starts_with(start)) {
        return Ok(());
    }
    let help = "name another file, or remove this one";
    Err(Error::new("exists already, is no result of this program, and was left as it is").file(path).help(help))
}

/// Refuses one file for two results.
pub fn not_the_same(one: &Path, other: &Path) -> Result<(), Error> {
    if !same_file(one, other) {
        return Ok(());
    }
    Err(Error::new("is named for two results, and the second would replace the first")
        .file(one)
        .help("name another file for one of them"))
}

/// A file that is going to be written: its folder exists, and it is no folder itself.
pub fn writable(path: &Path) -> Result<(), Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        let what = format!("the folder {} does not exist", folder.display());
        return Err(Error::new(what).file(path).help("make the folder, or name another file"));
    }
    if path.is_dir() {
        return Err(Error::new("is a folder, expected a file to write").file(path).help("name a file in it"));
    }
    Ok(())
}

/// Whether two paths lead to one file.
fn same_file(one: &Path, other: &Path) -> bool {
    // A file that is not there yet is known by its folder and its name.
    let planned = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    let real = |path: &Path| path.canonicalize().ok().or_else(|| planned(path)).unwrap_or_else(|| path.to_path_buf());
    // Standard output is no file.
    let is_stream = |path: &Path| path == Path::new("-");
    if is_stream(one) || is_stream(other) { is_stream(one) && is_stream(other) } else { real(one) == real(other) }
}

/// Refuses a result that would replace what the command reads.
pub fn not_read<'p>(written: &Path, mut read: impl Iterator<Item = &'p PathBuf>) -> Result<(), Error> {
    match read.find(|path| same_file(written, path)) {
        None => Ok(()),
        Some(_) => Err(Error::new("is read by this command, and would be overwritten by its result")
            .file(written)
            .help("name another file for the result")),
    }
}

/// A file that is going to be written and may hold somebody's work: an old one is kept unless `force` is given.
pub fn writable_new(path: &Path, force: bool) -> Result<(), Error> {
    if path == Path::new("-") {
        let help = "name a file; one of that name is ./-";
        return Err(Error::new("stands for standard output, which takes text and --json alone").file(path).help(help));
    }
    writable(path)?;
    if path.exists() && !force {
        let help = "name another file, or overwrite it with --force";
        return Err(Error::new("exists already and was left as it is").file(path).help(help));
    }
    Ok(())
}

/// A file of the program that is saved to be changed.
pub struct Extracted<'e> {
    /// Where it goes.
    pub to: PathBuf,
    /// What it says.
    pub text: &'e str,
}

/// Saves files, and makes their folders; none of them if one cannot be written. `read` is what they are from.
pub fn extract(
    files: &[Extracted<'_>],
    read: Vec<&PathBuf>,
    force: bool,
    console: &mut Console<'_>,
) -> Result<(), Error> {
    for file in files {
        let parent = file.to.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent).map_err(|error| {
            Error::new(format!("cannot make the folder: {error}")).file(parent).help("name another one after --extract")
        })?;
        not_read(&file.to, read.iter().copied())?;
        writable_new(&file.to, force)?;
    }
    for file in files {
        write_whole(&file.to, file.text.as_bytes())?;
        console.print(&format!("{}: written\n", file.to.display()));
    }
    Ok(())
}

/// The text of a model.
pub fn model_text(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|error| {
        Error::new(format!("cannot read the model: {error}"))
            .file(path)
            .help("check the path, or write a nominal model with: dockhil model init RECORDING.mcap -o MODEL.toml")
    })
}

/// The model, checked.
pub fn model(path: &Path, catalog: &Catalog<Axis>) -> Result<Model, Error> {
    Model::read(path, catalog)
}

/// The model to write to, for a command whose result belongs to a model along one axis.
pub fn editor_along(path: &Path, catalog: &Catalog<Axis>) -> Result<Editor, Error> {
    Editor::open(path, catalog).map_err(|error| {
        let is_space = std::fs::read_to_string(path).is_ok_and(|text| SpaceModel::is_meant(&text));
        if !is_space {
            return error;
        }
        let help = "name a model of the same cell along one axis: rig = \"docking\", as dockhil model init writes it; or leave \
                    --model out and read the numbers";
        Error { help: Some(help.to_owned()), ..error }
    })
}

/// The model as its loop runs, with what was identified of its robot.
pub fn running_model(path: &Path, catalog: &Catalog<Axis>) -> Result<Model, Error> {
    model(path, catalog)?.with_identified_robot().map_err(|error| error.file(path))
}

/// Refuses a recording that is given twice: it would count twice.
pub fn each_once(sessions: &[&Session]) -> Result<(), Error> {
    for (place, session) in sessions.iter().enumerate() {
        if let Some(first) = sessions[..place].iter().find(|first| first.sha256 == session.sha256) {
            let what = format!("holds the same bytes as {}: it would count twice", first.file.display());
            return Err(Error::new(what).file(&session.file).help("give each recording once, in one list"));
        }
    }
    Ok(())
}

/// Refuses a recording that is both learned from and tested on: by its bytes, not by its name.
pub fn apart(learn: &[Session], test: &[Session]) -> Result<(), Error> {
    let twice = test.iter().find_map(|test| Some((test, learn.iter().find(|learn| learn.sha256 == test.sha256)?)));
    match twice {
        None => Ok(()),
        Some((test, learn)) => {
            let what = format!("holds the same bytes as {}, which the model learns from", learn.file.display());
            Err(Error::new(what)
                .file(&test.file)
                .help("test on recordings that the fit has not seen: take it out of one of the lists"))
        }
    }
}

/// What a result was made from: program, model, recordings, each with its hash.
pub fn provenance(model: &Path, sessions: &[&Session]) -> Result<Vec<(String, String)>, Error> {
    let bytes =
        std::fs::read(model).map_err(|error| Error::new(format!("cannot read the model: {error}")).file(model))?;
    let mut rows = vec![
        ("program".to_string(), format!("dockhil {}", env!("CARGO_PKG_VERSION"))),
        (format!("model {}", model.display()), format!("sha256 {}", crate::files::sha256_hex(&bytes))),
    ];
    rows.extend(recorded(sessions));
    Ok(rows)
}

/// The same, where no model takes part.
pub fn provenance_of(sessions: &[&Session]) -> Vec<(String, String)> {
    let program = ("program".to_string(), format!("dockhil {}", env!("CARGO_PKG_VERSION")));
    std::iter::once(program).chain(recorded(sessions)).collect()
}

fn recorded<'s>(sessions: &'s [&Session]) -> impl Iterator<Item = (String, String)> + 's {
    sessions.iter().map(|session| {
        (session.file.display().to_string(), format!("grade {:?}, sha256 {}", session.grade, session.sha256))
    })
}
