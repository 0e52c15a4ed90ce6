//! A folder and a command line of its own for each test of the command.

use harness::cli::{Console, Look, run};
use sim_core::effects::standard;
use std::path::PathBuf;
use tempfile::TempDir;

/// What a command left behind.
pub struct Ran {
    pub exit: u8,
    pub out: String,
    pub err: String,
}

/// A folder of its own, in which a command runs; `DIR` stands for it in arguments and in what is printed.
pub struct Shell {
    folder: TempDir,
}

impl Shell {
    pub fn new() -> Self {
        Shell { folder: tempfile::tempdir().unwrap() }
    }

    /// With `m.toml`, the nominal model of a recording.
    pub fn with_model() -> Self {
        let shell = Shell::new();
        assert_eq!(shell.run(&["model", "init", &impact(), "-o", "DIR/m.toml"]).exit, 0);
        shell
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn run(&self, args: &[&str]) -> Ran {
        let folder = self.folder.path().display().to_string();
        let args = std::iter::once("dockhil".to_owned()).chain(args.iter().map(|arg| arg.replace("DIR", &folder)));
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let exit = run(args, &standard(), &mut Console::new(&mut out, &mut err, Look::default()));
        let text = |bytes| String::from_utf8(bytes).unwrap().replace(&folder, "DIR");
        Ran { exit, out: text(out), err: text(err) }
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// Every file in the folder, by name.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// The command is refused with exactly this text; nothing is printed, and no file changes.
    pub fn refuses(&self, args: &[&str], expected: &str) {
        let content =
            |shell: &Shell| shell.names().iter().map(|name| std::fs::read(shell.path(name)).ok()).collect::<Vec<_>>();
        let before = (self.names(), content(self));
        let ran = self.run(args);
        assert_eq!((ran.exit, ran.out.as_str()), (2, ""), "{args:?}: {}", ran.err);
        assert_eq!(ran.err, expected, "{args:?}");
        assert_eq!(before, (self.names(), content(self)), "{args:?} left something behind");
    }
}

pub fn impact() -> String {
    fixtures::session("cell-a", "learn_01.mcap").display().to_string()
}
