//! The bench of the compensators: 63.2 kg, 1066 N/m, 35 mm/s, 32 ms of dead time and a loop of 4 ms.
//!
//! `reference/PHYSICS.md`, section 7, was computed in a loop whose force at tick n comes from the pose of tick n - 9: 32 ms, and one
//! tick in which the command becomes valid. Here a command leaves with its tick, so that the same loop has 36 ms of dead time.

use sim_core::closed_loop::{Clamps, ClosedLoop, Start};
use sim_core::compensator::{Compensation, Compensator, Hybrid, Software};
use sim_core::contact::ContactLaw;
use sim_core::effect::Rates;
use sim_core::force_sensor::{AxisCell, SensorNoise};
use sim_core::geometry::Plane;
use sim_core::link::Link;
use sim_core::plant::PointMass;
use sim_core::readout::Readout;
use sim_core::restitution::from_speeds;
use sim_core::rig::{DockingAxis, Rig};
use sim_core::rng::Streams;
use sim_core::robot::{Rigid, StraightLine};
use sim_core::signals::ContactForce;
use sim_core::space::{Axis, AxisMotion, AxisTouch};
use sim_core::time::Nanos;
use sim_core::trace::{Columns, Trace};

pub const MASS_KG: f64 = 63.2;
pub const STIFFNESS_N_PER_M: f64 = 1066.0;
pub const SPEED_M_PER_S: f64 = 0.035;
/// The delay that the compensations believe: the hold's 2 ms are left out.
pub const BELIEVED_S: f64 = 0.036;

/// A spring that may stiffen, and a dashpot; in contact it may pull, as in the source of the numbers.
#[derive(Debug, Clone, Copy)]
pub struct Device {
    pub stiffness_n_per_m: f64,
    pub damping_n_s_per_m: f64,
    /// `k x (1 + (x / this)²)`; infinite for none.
    pub stiffening_m: f64,
}

impl Device {
    pub const SPRING: Device =
        Device { stiffness_n_per_m: STIFFNESS_N_PER_M, damping_n_s_per_m: 0.0, stiffening_m: f64::INFINITY };
}

impl ContactLaw<Axis> for Device {
    fn force(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        let share = touch.depth_m / self.stiffening_m;
        ContactForce {
            elastic: self.stiffness_n_per_m * touch.depth_m * (1.0 + share * share),
            dissipative: self.damping_n_s_per_m * touch.rate_m_per_s,
        }
    }

    fn clamped(&self, touch: &AxisTouch, force: &ContactForce<Axis>) -> f64 {
        if touch.depth_m > 0.0 { force.total() } else { 0.0 }
    }
}

pub type Bench<Law = Device, Software = Hybrid<Compensation>> = DockingAxis<Law, Software>;

/// A bench with this device and compensator, and these delays there and back.
pub fn bench<Law, Software>(law: Law, compensator: Software, dead_time_s: f64, readout_s: f64) -> Bench<Law, Software> {
    DockingAxis {
        plant: PointMass::of_mass(MASS_KG),
        link: Link { dead_time_s },
        robot: StraightLine { corner_s: 0.004, averaging_s: 0.004 },
        readout: Readout { delay_s: readout_s },
        law,
        sensor: AxisCell { tool_weight_n: 0.0, bias_n: 0.0 },
        noise: SensorNoise::NONE,
        compensator,
    }
}

/// The bench of the table: 36 ms there, 16 ms back, nothing virtual.
pub fn compensated(law: Device, delay: Compensation) -> Bench {
    bench(law, Hybrid { delay, ..Hybrid::default() }, 0.036, 0.016)
}

/// All clocks at 4 ms.
pub const RATES: Rates = Rates {
    physics_step: Nanos(4_000_000),
    loop_period: Nanos(4_000_000),
    loop_phase: Nanos(0),
    sensor_period: Nanos(4_000_000),
    sensor_phase: Nanos(0),
};

/// Runs from `first` for `seconds`.
pub fn run<Law: ContactLaw<Axis>, Software: Compensator<Axis>>(
    rig: &Bench<Law, Software>,
    first: AxisMotion,
    seconds: i64,
    noise_n: f64,
    seed: u64,
) -> Trace<Axis> {
    let start = Start {
        first,
        from: Nanos(0),
        until: Nanos(seconds * 1_000_000_000),
        noise: SensorNoise { white_n: noise_n, ..SensorNoise::NONE },
        streams: Streams::new(seed),
    };
    let mut trace = Trace::default();
    ClosedLoop::new(rig, &[], RATES).run(&start, &Clamps::default(), Columns::LOG, &mut trace);
    trace
}

/// Restitution of an impact that begins `phase` of a tick's way further on.
pub fn restitution<Law: ContactLaw<Axis>, Software: Compensator<Axis>>(rig: &Bench<Law, Software>, phase: f64) -> f64 {
    let first = AxisMotion::moving(-0.01 + phase * SPEED_M_PER_S * 0.004, SPEED_M_PER_S);
    let trace = run(rig, first, 3, 0.0, 1);
    from_speeds(SPEED_M_PER_S, trace.after.last().unwrap().velocity_m_per_s)
}

/// A rig of software alone: the pose is the satellites' own at once, and the compensator computes the contact.
struct Computed {
    plant: PointMass,
    software: Software,
}

impl Rig<Axis> for Computed {
    type Plant = PointMass;
    type Robot = Rigid;
    type Geometry = Plane;
    type Law = Device;
    type Sensor = AxisCell;
    type Compensator = Software;

    fn plant(&self) -> &PointMass {
        &self.plant
    }
    fn link(&self) -> &Link {
        &Link { dead_time_s: 0.0 }
    }
    fn robot(&self) -> &Rigid {
        &Rigid
    }
    fn readout(&self) -> &Readout {
        &Readout { delay_s: 0.0 }
    }
    fn geometry(&self) -> &Plane {
        &Plane
    }
    fn law(&self) -> &Device {
        &Device::SPRING
    }
    fn sensor(&self) -> &AxisCell {
        &AxisCell { tool_weight_n: 0.0, bias_n: 0.0 }
    }
    fn compensator(&self) -> &Software {
        &self.software
    }
}

/// Velocity after an impact in software that begins `gap_m` away.
pub fn computed_exit_m_per_s(
    mass_kg: f64,
    software: Software,
    gap_m: f64,
    speed_m_per_s: f64,
    step: Nanos,
    seconds: f64,
) -> f64 {
    software.check(step.seconds()).unwrap();
    let rig = Computed { plant: PointMass::of_mass(mass_kg), software };
    let rates = Rates {
        physics_step: step,
        loop_period: step,
        loop_phase: Nanos(0),
        sensor_period: step,
        sensor_phase: Nanos(0),
    };
    let start = Start {
        first: AxisMotion::moving(-gap_m, speed_m_per_s),
        from: Nanos(0),
        until: Nanos::from_seconds(seconds),
        noise: SensorNoise::NONE,
        streams: Streams::new(1),
    };
    let mut trace = Trace::default();
    ClosedLoop::new(&rig, &[], rates).run(&start, &Clamps::default(), Columns::LOG, &mut trace);
    trace.after.last().unwrap().velocity_m_per_s
}
