//! Prints the fingerprint of one impact with every effect of the catalogue: the same bits in debug and release, on every
//! machine. And of one replay: a force as a log holds it, rounded to whole mN, clamped into the loop. `.ci/run` compares two builds.

use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::compensator::Hybrid;
use sim_core::contact::{Sides, SpringDashpot};
use sim_core::effect::{Attached, Rates, Where};
use sim_core::effects::standard;
use sim_core::force_sensor::{AxisCell, SensorNoise};
use sim_core::link::Link;
use sim_core::plant::PointMass;
use sim_core::readout::Readout;
use sim_core::recorder::LogChannel;
use sim_core::rig::DockingAxis;
use sim_core::rng::Streams;
use sim_core::robot::StraightLine;
use sim_core::space::{Axis, AxisMotion};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

/// Records an impact as a log would, and feeds the recorded force to the software again.
fn replay(rig: &DockingAxis, rates: Rates, start: &Start<Axis>) -> String {
    let (mut log, mut again) = (Trace::default(), Trace::default());
    let effects: [Attached<Axis>; 0] = [];
    let looped = ClosedLoop::new(rig, &effects, rates);
    looped.run(start, &Clamps::default(), Columns::LOG, &mut log);
    let whole_mn = LogChannel { sigma: 0.0, quantum: 1e-3 };
    let mut unused = start.streams.named("recorder");
    let recorded: Vec<f64> = log.sensed.iter().map(|reading_n| whole_mn.written(*reading_n, &mut unused)).collect();
    let clamps = Clamps { sensed: Some(&recorded), ..Clamps::default() };
    looped.run(start, &clamps, Columns::LOG, &mut again);
    again.fingerprint().hex()
}

fn main() {
    let rig = DockingAxis {
        plant: PointMass::of_mass(63.2),
        link: Link { dead_time_s: 0.016 },
        robot: StraightLine { corner_s: 0.004, averaging_s: 0.002 },
        readout: Readout { delay_s: 0.016 },
        law: SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 6.0, sides: Sides::One },
        sensor: AxisCell { tool_weight_n: 73.5, bias_n: 2.1 },
        noise: SensorNoise::NONE,
        compensator: Hybrid {
            bias_n: 2.1,
            tool_weight_n: 73.5,
            virtual_stiffness_n_per_m: 0.0,
            virtual_damping_n_s_per_m: 40.0,
            dead_band_n: 0.25,
            ..Hybrid::default()
        },
    };
    let rates = Rates {
        physics_step: Nanos(500_000),
        loop_period: Nanos(4_000_000),
        loop_phase: Nanos(0),
        sensor_period: Nanos(1_000_000),
        sensor_phase: Nanos(0),
    };
    let start = Start {
        first: AxisMotion::moving(-0.01, 0.035),
        from: Nanos(0),
        until: Nanos(2_000_000_000),
        noise: SensorNoise { white_n: 0.08, ..SensorNoise::NONE },
        streams: Streams::new(7),
    };
    let columns = Columns { loop_ticks: true, sensor_ticks: true, achieved: true, measured: true };
    let run = |effects: &[Attached<Axis>]| {
        let mut trace = Trace::default();
        ClosedLoop::new(&rig, effects, rates).run(&start, &Clamps::default(), columns, &mut trace);
        trace.fingerprint().hex()
    };
    println!("{:<22} {}", "nominal", run(&[]));
    println!("{:<22} {}", "clamped replay", replay(&rig, rates, &start));
    for kind in standard().kinds().iter().filter(|kind| kind.rigs != Where::Drive) {
        let values: Vec<f64> = kind.params.iter().map(|param| param.starts[0]).collect();
        println!("{:<22} {}", kind.id, run(&[kind.attach(&values)]));
    }
}
