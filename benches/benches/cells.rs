//! The facility along one axis and in space: 250 Hz satellites, 16 + 16 ms, a sensor at 1 kHz, physics at 1 ms.
//!
//! In space nothing is spared by symmetry: interfaces off centre, a tumbling target, a cone, a sensor askew in its probe.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sim_core::closed_loop::Start;
use sim_core::compensator::{AxisPair, Hybrid, HybridSpace};
use sim_core::contact::{Sides, SpringDashpot};
use sim_core::effect::{Attached, Kind, Rates};
use sim_core::force_sensor::{AxisCell, SensorNoise, SpaceCell, WrenchNoise};
use sim_core::frames::Pose;
use sim_core::geometry::Cone;
use sim_core::link::Link;
use sim_core::plant::{Body, BodyMotion, Integrator, PointMass, TwoBody};
use sim_core::readout::Readout;
use sim_core::rig::{DockingAxis, DockingSpace};
use sim_core::rng::Streams;
use sim_core::robot::StraightLine;
use sim_core::space::{Axis, AxisMotion, Motion, Space, Spatial, Wrench};
use sim_core::time::Nanos;
use sim_core::trace::Columns;

/// Two seconds.
pub const STEPS: usize = 2000;
pub const RATES: Rates = Rates {
    physics_step: Nanos(1_000_000),
    loop_period: Nanos(4_000_000),
    loop_phase: Nanos(0),
    sensor_period: Nanos(1_000_000),
    sensor_phase: Nanos(0),
};
pub const NOTHING: Columns = Columns { loop_ticks: false, sensor_ticks: false, achieved: false, measured: false };
const UNTIL: Nanos = Nanos(2_000_000_000);
const LINK: Link = Link { dead_time_s: 0.016 };
const ROBOT: StraightLine = StraightLine { corner_s: 0.004, averaging_s: 0.002 };
const READOUT: Readout = Readout { delay_s: 0.016 };
const LAW: SpringDashpot = SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 6.0, sides: Sides::One };
const NOISE: SensorNoise = SensorNoise { white_n: 0.08, ..SensorNoise::NONE };

/// The kind with its parameters where a fit would start.
pub fn started<S: Space>(kind: &Kind<S>) -> Attached<S> {
    let values: Vec<f64> = kind.params.iter().map(|param| param.starts[0]).collect();
    kind.attach(&values)
}

pub fn one_axis() -> DockingAxis {
    DockingAxis {
        plant: PointMass::of_mass(63.2),
        link: LINK,
        robot: ROBOT,
        readout: READOUT,
        law: LAW,
        sensor: AxisCell { tool_weight_n: 73.5, bias_n: 2.1 },
        noise: SensorNoise::NONE,
        compensator: Hybrid {
            bias_n: 2.1,
            tool_weight_n: 73.5,
            virtual_damping_n_s_per_m: 40.0,
            dead_band_n: 0.25,
            ..Hybrid::default()
        },
    }
}

pub fn start_one(noisy: bool) -> Start<Axis> {
    Start {
        first: AxisMotion::moving(-0.010_13, 0.035),
        from: Nanos(0),
        until: UNTIL,
        noise: if noisy { NOISE } else { SensorNoise::NONE },
        streams: Streams::new(7),
    }
}

fn turn(x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z))
}

fn bodies() -> TwoBody {
    let inertia = |xx, yy, zz, xy| Matrix3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, zz);
    let chaser = Body::new(60.0, inertia(3.0, 4.0, 5.0, 0.3)).expect("a body can be so");
    let target = Body::new(200.0, inertia(20.0, 30.0, 35.0, -2.0)).expect("a body can be so");
    let probe = Pose::new(Vector3::new(0.1, -0.2, 0.6), turn(0.02, 0.01, -0.3));
    let nozzle = Pose::new(Vector3::new(-0.3, 0.1, -0.8), turn(3.0, 0.1, 0.2));
    let tumbling = BodyMotion {
        position_m: Vector3::new(0.4, 0.3, -0.2),
        attitude: turn(0.3, -0.5, 0.2),
        velocity_m_per_s: Vector3::new(0.01, -0.02, 0.03),
        rate_rad_per_s: Vector3::new(0.02, 0.03, -0.02),
    };
    let plant = TwoBody::new(chaser, target, probe, nozzle, Integrator::SemiImplicit).expect("poses are finite");
    plant.with_target(tumbling).expect("its motion is finite")
}

pub fn six_axes() -> DockingSpace<Cone, SpringDashpot> {
    let sensor = SpaceCell {
        mounting: turn(0.1, 0.2, 0.7),
        tip_m: Vector3::new(0.01, 0.02, 0.15),
        tool_weight_n: 73.5,
        tool_centre_m: Vector3::new(0.01, -0.02, 0.05),
        gravity: -Vector3::y(),
        bias: Wrench { force_n: Vector3::new(1.0, 2.0, 3.0), torque_n_m: Vector3::new(0.1, 0.0, 0.2) },
    };
    DockingSpace {
        plant: bodies(),
        link: LINK,
        robot: ROBOT,
        readout: READOUT,
        geometry: Cone::new(0.2, 0.05, 0.8, 0.02).expect("a cone can be so"),
        law: LAW,
        sensor,
        noise: WrenchNoise::NONE,
        compensator: HybridSpace {
            virtual_damping: AxisPair { along: Vector3::z() * 40.0, about: Vector3::z() * 0.5 },
            onset_m: 0.13,
            dead_band_n: 0.25,
            dead_band_n_m: 0.02,
            ..HybridSpace::new(sensor)
        },
    }
}

pub fn start_six(noisy: bool) -> Start<Spatial> {
    Start {
        first: Motion {
            position_m: Vector3::new(0.03, -0.02, 0.11),
            attitude: turn(0.03, -0.02, 0.4),
            velocity_m_per_s: Vector3::new(0.002, -0.001, 0.035),
            rate_rad_per_s: Vector3::new(-0.01, 0.02, 0.005),
            acceleration_m_per_s2: Vector3::zeros(),
        },
        from: Nanos(0),
        until: UNTIL,
        noise: if noisy { WrenchNoise { force: [NOISE; 3], torque: [NOISE; 3] } } else { WrenchNoise::NONE },
        streams: Streams::new(7),
    }
}
