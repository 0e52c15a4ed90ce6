//! What a cycle of the virtual cell costs over sockets: 1,000 cycles of the bench, robot and sensor on loopback, with the reference
//! controller in a thread of its own. Virtual time: nobody sleeps, each side waits for the other's packets alone. The controller
//! ends when it has heard nothing for a while; that is not counted.
//!
//! Limit: 150 ms, which is 0.15 ms of the 4 ms that a robot controller grants. Chosen; nothing fails beyond it, since the machine
//! decides.

use criterion::{Criterion, criterion_group, criterion_main};
use harness::cell::Cell;
use harness::cell::clock::WallClock;
use harness::cell::controller::{Reference, Task};
use harness::cell::on_wire::OnWire;
use harness::cell::run::{Options, run};
use harness::cell::serve::Served;
use harness::cell::wires::{Addresses, Pace, Wires};
use sim_core::effects::standard;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::time::Duration;

/// The longest wait for anybody.
const PATIENCE: Duration = Duration::from_secs(60);
/// Silence after which the controller ends.
const SILENCE: Duration = Duration::from_millis(100);
/// A thousand cycles of 4 ms.
const DURATION_S: f64 = 4.0;

/// One run: how long the cell took for it.
fn looped(cell: &Cell) -> Duration {
    let any: SocketAddr = "127.0.0.1:0".parse().expect("it is an address");
    // Whoever binds it next has it: the socket is closed at the end of the line.
    let robot = UdpSocket::bind(any).and_then(|socket| socket.local_addr()).expect("a port of loopback is free");
    let addresses = Addresses { robots: vec![robot], sensor: any, page: None };
    let pace = Pace::Virtual { patience: PATIENCE };
    let mut wires = Wires::bind(cell, &addresses, pace, PATIENCE).expect("loopback is there");
    let addresses = Addresses { sensor: wires.sensor(), ..addresses };
    let model = cell.model(&standard()).expect("the bench is sound");
    std::thread::scope(|scope| {
        let controller = scope.spawn(|| {
            let reference = Reference::new(&model, cell.first().expect("the bench is sound"), Task::Dock);
            let mut on_wire = OnWire::new(cell, reference).expect("the bench is sound");
            let mut served = Served::bind(cell, &addresses).expect("the port is free");
            served.serve(&mut on_wire, PATIENCE, SILENCE, &|| false).expect("loopback is there")
        });
        let clock = WallClock::new();
        let ran = run(cell, &standard(), &Options { duration_s: DURATION_S, keeps: false }, &mut wires)
            .expect("somebody answers");
        let took = Duration::from_nanos(clock.now().0.unsigned_abs());
        assert_eq!((ran.cycles, ran.answered), (1000, 1000));
        // The wires stay until the controller has ended: a closed port would be heard.
        controller.join().expect("the controller ends");
        took
    })
}

fn loopback(criterion: &mut Criterion) {
    let cell = Cell::find(Path::new("bench")).expect("it is inside the program");
    let mut group = criterion.benchmark_group("virtual cell");
    group.sample_size(10);
    group.bench_function("1000 cycles over loopback", |bencher| {
        bencher.iter_custom(|times| (0..times).map(|_| looped(&cell)).sum());
    });
    group.finish();
}

criterion_group!(benches, loopback);
criterion_main!(benches);
