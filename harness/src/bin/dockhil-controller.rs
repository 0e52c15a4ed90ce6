//! The reference controller as a program of its own: satellites, compensation and virtual contact of the cell's model, over RSI and
//! F/T on real sockets.

use harness::cli::{Console, Look, controller};
use std::io::{stderr, stdout};
use std::process::ExitCode;

fn main() -> ExitCode {
    let (mut out, mut err) = (stdout(), stderr());
    let mut console = Console::new(&mut out, &mut err, Look::default());
    ExitCode::from(controller(std::env::args_os(), &sim_core::effects::standard(), &mut console))
}
