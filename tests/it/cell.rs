//! The virtual cell: in process and over sockets the same, faults act as they say, and its recordings can be diagnosed.

mod catalogue;
mod diagnosed;
mod every_fault;
mod faults;
mod gaps;
mod hostile;
mod krc2;
mod relative;
pub mod sockets;

use harness::cell::controller::{Command, Controller, Reference, Seen, Task};
use harness::cell::on_wire::OnWire;
use harness::cell::run::{InProcess, Options, Ran, run};
use harness::cell::{Cell, CellConfig};
use harness::cli::in_process;
use sim_core::effects::standard;
use std::path::Path;

/// A cell inside the program, with text added to its file.
pub fn cell(name: &str, added: &str) -> Cell {
    let mut cell = Cell::find(Path::new(name)).unwrap();
    cell.source.text = format!("{}\n{added}", cell.source.text);
    cell.config = CellConfig::parse(name, &cell.source.text).unwrap();
    cell
}

pub fn reference(cell: &Cell, duration_s: f64) -> Ran {
    in_process(cell, &standard(), &Options { duration_s, keeps: true }, Task::Dock)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// A controller that is not the same in its second run.
struct Drifting {
    inner: Reference,
    from: u64,
}

impl Controller for Drifting {
    fn cycle(&mut self, seen: &Seen<'_>) -> Command {
        let mut command = self.inner.cycle(seen);
        if seen.cycle >= self.from {
            command.pose.position_m[2] += 1e-6;
        }
        command
    }
}

#[test]
fn two_runs_are_the_same_and_a_controller_that_is_not_is_named_with_its_cycle() {
    let cell = cell("bench", "");
    let (one, two) = (reference(&cell, 0.8), reference(&cell, 0.8));
    assert_eq!(one.first_difference(&two), None);
    assert_eq!((one.cycles, one.answered, one.stops.len()), (200, 200, 0));
    let model = cell.model(&standard()).unwrap();
    let inner = Reference::new(&model, cell.first().unwrap(), Task::Dock);
    let controller = OnWire::new(&cell, Drifting { inner, from: 57 }).unwrap();
    let other = run(&cell, &standard(), &Options { duration_s: 0.8, keeps: true }, &mut InProcess(controller)).unwrap();
    assert_eq!(one.first_difference(&other), Some(57));
    assert_ne!(one.fingerprint(), other.fingerprint());
}

/// What is commanded, reported and felt is what the closed loop of the model would do, to what the wires round.
#[test]
fn a_run_is_that_of_the_closed_loop() {
    let cell = cell("bench", "");
    let model = cell.model(&standard()).unwrap();
    let session = reference(&cell, 1.6).session;
    let scenario = "schema = 1\nname = \"loop\"\nseed = 20140401\nduration_s = 1.6\nmodel = \"m.toml\"\n[start]\nposition_m = -0.008\nvelocity_m_per_s = 0.035\n";
    let source = harness::scenario::Source {
        file: "loop.toml".into(),
        text: scenario.to_owned(),
        model_file: "m.toml".into(),
        model_text: cell.model.text.clone(),
        is_embedded: true,
    };
    let looped = harness::scenario::run::run(&source, &standard()).unwrap().session;
    let (wired, whole) = (session.commanded.unwrap(), looped.commanded.unwrap());
    assert_eq!((wired.time_ns.len(), &wired.time_ns), (400, &whole.time_ns));
    let apart = wired.value.iter().zip(&whole.value).map(|(a, b)| (a.position_m[2] - b.position_m[2]).abs());
    let most_m = apart.fold(0.0, f64::max);
    // A step of the wire is 1e-12 m. Rounded poses and readings push 63 kg for 1.6 s; a reading may round to the next mN.
    let push_m = 0.5 * 1e-3 / model.plant.mass_kg * 1.6 * 1.6;
    assert!(most_m > 0.0 && most_m < push_m, "{most_m} of {push_m}");
    let (felt, truth) = (session.sensed.unwrap(), looped.sensed.unwrap());
    let same =
        felt.value.iter().zip(&truth.value).filter(|(a, b)| (a.force_n[2] - b.force_n[2]).abs() < 1.5e-3).count();
    assert!(felt.value.len() > 1500 && same == felt.value.len(), "{same} of {}", felt.value.len());
}

#[test]
fn two_robots_have_their_own_clocks_and_one_may_stop_alone() {
    let calm = reference(&cell("pair", ""), 1.6);
    assert_eq!((calm.cycles, calm.answered, calm.stops.len()), (400, 400, 0));
    let fault = "[[fault]]\nid = \"drop\"\non = \"rsi-reply\"\nrobot = \"target\"\nat = 10\nfor = 200\n";
    let ran = reference(&cell("pair", fault), 1.6);
    assert_eq!((ran.cycles, ran.answered), (400, 400), "the chaser goes on");
    let [(robot, why)] = &ran.stops[..] else { panic!("{:?}", ran.stops) };
    assert!(
        robot == "target" && why.contains("cycle 110") && why.contains("ERX: Defined timeout limit"),
        "{robot}: {why}"
    );
    // The nozzle holds where it is: the relative pose is the one of the calm run.
    assert_eq!(calm.session.commanded, ran.session.commanded);
    // One robot that has the nozzle at the origin sees the same docking.
    let alone = reference(&cell("bench", ""), 1.6).session.commanded.unwrap();
    let pair = calm.session.commanded.unwrap();
    let apart = alone.value.iter().zip(&pair.value).map(|(a, b)| (a.position_m[2] - b.position_m[2]).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-5);
}
