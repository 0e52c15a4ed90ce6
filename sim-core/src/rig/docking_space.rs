//! A docking cell with six axes: two satellites in software, a robot, a device in contact, a force/torque sensor.
//!
//! The robots' relative pose is one [`Motion`](crate::space::Motion), probe tip in the nozzle frame, however many robots move it.
//! The three architectures of thesis Fig. 3.1 are settings of the compensator.

use super::Rig;
use crate::compensator::{Compensator, HybridSpace};
use crate::contact::ContactLaw;
use crate::force_sensor::{SpaceCell, WrenchNoise};
use crate::geometry::Geometry;
use crate::link::Link;
use crate::plant::TwoBody;
use crate::readout::Readout;
use crate::robot::StraightLine;
use crate::space::Spatial;

/// Geometry, device and compensator are type parameters, so that a step does not ask which ones they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DockingSpace<Interface, Law, Software = HybridSpace> {
    /// Satellites.
    pub plant: TwoBody,
    /// Link.
    pub link: Link,
    /// Robot.
    pub robot: StraightLine,
    /// Read-back.
    pub readout: Readout,
    /// Where probe and nozzle touch.
    pub geometry: Interface,
    /// Device.
    pub law: Law,
    /// Sensor.
    pub sensor: SpaceCell,
    /// Noise of the sensor, in the loop and in the log.
    pub noise: WrenchNoise,
    /// Compensator.
    pub compensator: Software,
}

impl<Interface, Law, Software> Rig<Spatial> for DockingSpace<Interface, Law, Software>
where
    Interface: Geometry<Spatial>,
    Law: ContactLaw<Spatial>,
    Software: Compensator<Spatial>,
{
    type Plant = TwoBody;
    type Robot = StraightLine;
    type Geometry = Interface;
    type Law = Law;
    type Sensor = SpaceCell;
    type Compensator = Software;

    fn plant(&self) -> &TwoBody {
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
    fn geometry(&self) -> &Interface {
        &self.geometry
    }
    fn law(&self) -> &Law {
        &self.law
    }
    fn sensor(&self) -> &SpaceCell {
        &self.sensor
    }
    fn compensator(&self) -> &Software {
        &self.compensator
    }
}
