//! A sensor, or a device, of any protocol.

use super::client::Client;
use super::{Bench, Device, Disturbance, Event, Sensor, Tally, Unable};
use super::{bota, optoforce, rdt, record, robotiq, schunk};
use core::net::SocketAddr;
use sim_core::time::Nanos;

/// The host's side of a sensor whose protocol the settings name.
#[derive(Debug, Clone)]
pub enum AnySensor {
    /// ATI Net F/T and Axia.
    Rdt(Box<Client<rdt::Rdt>>),
    /// OnRobot/OptoForce HEX.
    OptoForce(Box<Client<optoforce::OptoForce>>),
    /// SCHUNK FTS with IFB-EN.
    Schunk(Box<Client<schunk::Schunk>>),
    /// Bota Rokubi and SensONE.
    Bota(Box<Client<bota::Bota>>),
    /// Robotiq FT 150/300.
    Robotiq(Box<Client<robotiq::Robotiq>>),
    /// A laboratory's own box.
    Record(Box<Client<record::RecordWire>>),
}

/// The device's side of a sensor whose protocol the settings name.
#[derive(Debug, Clone)]
pub enum AnyDevice {
    /// ATI Net F/T and Axia.
    Rdt(Box<rdt::RdtDevice>),
    /// OnRobot/OptoForce HEX.
    OptoForce(Box<optoforce::OptoForceDevice>),
    /// SCHUNK FTS with IFB-EN.
    Schunk(Box<schunk::SchunkDevice>),
    /// Bota Rokubi and SensONE.
    Bota(Box<bota::BotaDevice>),
    /// Robotiq FT 150/300.
    Robotiq(Box<robotiq::RobotiqDevice>),
    /// A laboratory's own box.
    Record(Box<record::RecordDevice>),
}

impl AnySensor {
    fn inner(&self) -> &dyn Sensor {
        match self {
            AnySensor::Rdt(sensor) => sensor.as_ref(),
            AnySensor::OptoForce(sensor) => sensor.as_ref(),
            AnySensor::Schunk(sensor) => sensor.as_ref(),
            AnySensor::Bota(sensor) => sensor.as_ref(),
            AnySensor::Robotiq(sensor) => sensor.as_ref(),
            AnySensor::Record(sensor) => sensor.as_ref(),
        }
    }

    fn inner_mut(&mut self) -> &mut dyn Sensor {
        match self {
            AnySensor::Rdt(sensor) => sensor.as_mut(),
            AnySensor::OptoForce(sensor) => sensor.as_mut(),
            AnySensor::Schunk(sensor) => sensor.as_mut(),
            AnySensor::Bota(sensor) => sensor.as_mut(),
            AnySensor::Robotiq(sensor) => sensor.as_mut(),
            AnySensor::Record(sensor) => sensor.as_mut(),
        }
    }
}

impl Sensor for AnySensor {
    fn start(&mut self, out: &mut Vec<Vec<u8>>) {
        self.inner_mut().start(out);
    }

    fn stop(&mut self, out: &mut Vec<Vec<u8>>) {
        self.inner_mut().stop(out);
    }

    fn receive(&mut self, now: Nanos, bytes: &[u8], events: &mut Vec<Event>) {
        self.inner_mut().receive(now, bytes, events);
    }

    fn tick(&mut self, now: Nanos, out: &mut Vec<Vec<u8>>, events: &mut Vec<Event>) {
        self.inner_mut().tick(now, out, events);
    }

    fn bias(&mut self, set: bool, out: &mut Vec<Vec<u8>>, events: &mut Vec<Event>) -> Result<(), Unable> {
        self.inner_mut().bias(set, out, events)
    }

    fn overhear(&mut self, bytes: &[u8], events: &mut Vec<Event>) {
        self.inner_mut().overhear(bytes, events);
    }

    fn tally(&self) -> &Tally {
        self.inner().tally()
    }
}

impl AnyDevice {
    fn inner(&self) -> &dyn Device {
        match self {
            AnyDevice::Rdt(device) => device.as_ref(),
            AnyDevice::OptoForce(device) => device.as_ref(),
            AnyDevice::Schunk(device) => device.as_ref(),
            AnyDevice::Bota(device) => device.as_ref(),
            AnyDevice::Robotiq(device) => device.as_ref(),
            AnyDevice::Record(device) => device.as_ref(),
        }
    }

    fn inner_mut(&mut self) -> &mut dyn Device {
        match self {
            AnyDevice::Rdt(device) => device.as_mut(),
            AnyDevice::OptoForce(device) => device.as_mut(),
            AnyDevice::Schunk(device) => device.as_mut(),
            AnyDevice::Bota(device) => device.as_mut(),
            AnyDevice::Robotiq(device) => device.as_mut(),
            AnyDevice::Record(device) => device.as_mut(),
        }
    }
}

impl Device for AnyDevice {
    fn receive_from(&mut self, now: Nanos, peer: Option<SocketAddr>, request: &[u8], out: &mut Vec<Vec<u8>>) {
        self.inner_mut().receive_from(now, peer, request, out);
    }

    fn sample(&mut self, force_n: [f64; 3], torque_n_m: [f64; 3], out: &mut Vec<Vec<u8>>) {
        self.inner_mut().sample(force_n, torque_n_m, out);
    }

    fn is_request(&self, bytes: &[u8]) -> bool {
        self.inner().is_request(bytes)
    }

    fn bench(&self) -> &Bench {
        self.inner().bench()
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        self.inner_mut().disturb(disturbance)
    }
}
