//! A rig: which part drives which wire.

use crate::compensator::{Applied, Compensator, Hybrid};
use crate::contact::{ContactLaw, SpringDashpot};
use crate::force_sensor::{AxisCell, ForceSensor, SensorNoise};
use crate::geometry::{Geometry, Plane};
use crate::link::Link;
use crate::plant::{Plant, PointMass};
use crate::readout::Readout;
use crate::robot::{Rigid, Robot, StraightLine};
use crate::space::{Axis, Space};

mod docking_space;
pub use docking_space::DockingSpace;

/// One part for each wire; static dispatch, so that the compiler checks the wiring.
pub trait Rig<S: Space>: Send + Sync {
    /// Satellites, or whatever is pushed.
    type Plant: Plant<S>;
    /// Robot.
    type Robot: Robot<S>;
    /// Geometry of the interfaces.
    type Geometry: Geometry<S>;
    /// Contact law.
    type Law: ContactLaw<S>;
    /// Force sensor.
    type Sensor: ForceSensor<S>;
    /// Compensator.
    type Compensator: Compensator<S>;

    /// See [`Plant`].
    fn plant(&self) -> &Self::Plant;
    /// See [`Link`].
    fn link(&self) -> &Link;
    /// See [`Robot`].
    fn robot(&self) -> &Self::Robot;
    /// See [`Readout`].
    fn readout(&self) -> &Readout;
    /// See [`Geometry`].
    fn geometry(&self) -> &Self::Geometry;
    /// See [`ContactLaw`].
    fn law(&self) -> &Self::Law;
    /// See [`ForceSensor`].
    fn sensor(&self) -> &Self::Sensor;
    /// See [`Compensator`].
    fn compensator(&self) -> &Self::Compensator;
}

/// A docking cell along one axis: satellites in software, a robot, a device in contact, a force sensor.
///
/// Device and compensator are type parameters, so that a step does not ask which ones they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DockingAxis<Law = SpringDashpot, Software = Hybrid> {
    /// Satellites.
    pub plant: PointMass,
    /// Link.
    pub link: Link,
    /// Robot.
    pub robot: StraightLine,
    /// Read-back.
    pub readout: Readout,
    /// Device.
    pub law: Law,
    /// Sensor.
    pub sensor: AxisCell,
    /// Noise of the sensor, in the loop and in the log.
    pub noise: SensorNoise,
    /// Compensator.
    pub compensator: Software,
}

/// An axis that a known force drives: no satellites, no robot, no sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveAxis {
    /// The moving mass.
    pub plant: PointMass,
    /// No delay.
    pub link: Link,
    /// Read-back.
    pub readout: Readout,
    /// Bearing and spring: two-sided.
    pub law: SpringDashpot,
    /// Reads nothing that matters.
    pub sensor: AxisCell,
}

impl<Law: ContactLaw<Axis>, Software: Compensator<Axis>> Rig<Axis> for DockingAxis<Law, Software> {
    type Plant = PointMass;
    type Robot = StraightLine;
    type Geometry = Plane;
    type Law = Law;
    type Sensor = AxisCell;
    type Compensator = Software;

    fn plant(&self) -> &PointMass {
        &self.plant
    }
    fn link(&self) -> &Link {
        &self.link
    }
    fn robot(&self) -> &StraightLine {
        &self.robot
    }
    fn readout(&self) -> &Readout {
        &self.readout
    }
    fn geometry(&self) -> &Plane {
        &Plane
    }
    fn law(&self) -> &Law {
        &self.law
    }
    fn sensor(&self) -> &AxisCell {
        &self.sensor
    }
    fn compensator(&self) -> &Software {
        &self.compensator
    }
}

impl Rig<Axis> for DriveAxis {
    type Plant = PointMass;
    type Robot = Rigid;
    type Geometry = Plane;
    type Law = SpringDashpot;
    type Sensor = AxisCell;
    type Compensator = Applied;

    fn plant(&self) -> &PointMass {
        &self.plant
    }
    fn link(&self) -> &Link {
        &self.link
    }
    fn robot(&self) -> &Rigid {
        &Rigid
    }
    fn readout(&self) -> &Readout {
        &self.readout
    }
    fn geometry(&self) -> &Plane {
        &Plane
    }
    fn law(&self) -> &SpringDashpot {
        &self.law
    }
    fn sensor(&self) -> &AxisCell {
        &self.sensor
    }
    fn compensator(&self) -> &Applied {
        &Applied
    }
}
