//! The command `dockhil`. What it does is in [`harness::cli`].

use harness::cli::{Console, Look, run};
use std::io::{BufWriter, IsTerminal, Write};
use std::process::ExitCode;

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(report));
    let (stdout, mut stderr) = (std::io::stdout(), std::io::stderr());
    // Asks the terminal, NO_COLOR and CLICOLOR_FORCE.
    let colour = anstream::AutoStream::choice(&stderr) != anstream::ColorChoice::Never;
    let look = Look { colour, terminal: stderr.is_terminal() };
    let mut out = BufWriter::new(stdout.lock());
    let mut console = Console::new(&mut out, &mut stderr, look);
    ExitCode::from(run(std::env::args_os(), &sim_core::effects::standard(), &mut console))
}

/// Says that this is our mistake, and how to report it. The process then ends with 101.
fn report(panic: &std::panic::PanicHookInfo<'_>) {
    let line: Vec<String> = std::env::args_os().map(|arg| arg.to_string_lossy().into_owned()).collect();
    // Nobody can be told that standard error is closed.
    let _ = writeln!(
        std::io::stderr(),
        "bug in dockhil {}: {panic}\n  command: {}\n  help: this is our mistake, not yours. Please report these lines and, if you may, the files of the command.",
        env!("CARGO_PKG_VERSION"),
        line.join(" ")
    );
}
