//! A sensor, or a device, of any protocol.

use super::client::Client;
use super::{Device, Disturbance, Event, Sensor, Tally, Unable, rdt};
use core::net::SocketAddr;
use sim_core::time::Nanos;

/// The host's side of a sensor whose protocol the settings name.
#[derive(Debug, Clone)]
pub enum AnySensor {
    /// ATI Net F/T and Axia.
    Rdt(Client<rdt::Rdt>),
}

/// The device's side of a sensor whose protocol the settings name.
#[derive(Debug, Clone)]
pub enum AnyDevice {
    /// ATI Net F/T and Axia.
    Rdt(rdt::RdtDevice),
}

impl AnySensor {
    fn inner(&self) -> &dyn Sensor {
        match self {
            AnySensor::Rdt(sensor) => sensor,
        }
    }

    fn inner_mut(&mut self) -> &mut dyn Sensor {
        match self {
            AnySensor::Rdt(sensor) => sensor,
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

    fn tally(&self) -> &Tally {
        self.inner().tally()
    }
}

impl AnyDevice {
    fn inner(&self) -> &dyn Device {
        match self {
            AnyDevice::Rdt(device) => device,
        }
    }

    fn inner_mut(&mut self) -> &mut dyn Device {
        match self {
            AnyDevice::Rdt(device) => device,
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

    fn client(&self) -> Option<SocketAddr> {
        self.inner().client()
    }

    fn streams(&self) -> bool {
        self.inner().streams()
    }

    fn disturb(&mut self, disturbance: Disturbance) -> Result<(), Unable> {
        self.inner_mut().disturb(disturbance)
    }
}
