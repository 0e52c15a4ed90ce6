//! What the arrivals of a live recording become.

use super::devices::{Devices, Way};
use crate::cell::link::told;
use drivers::net::Arrival;

/// What is no bytes becomes an event.
pub(super) fn note(source: &str, arrival: &Arrival, devices: &mut Devices) {
    if let Some((at, class, text)) = told(arrival) {
        devices.event(at, source, class, text);
    }
}

/// Takes what came from a robot controller. True: there is a fresh frame in it.
pub(super) fn take(robot: usize, arrival: &Arrival, is_stream: bool, devices: &mut Devices) -> bool {
    match arrival {
        Arrival::Bytes { at, bytes, .. } if is_stream => devices.stream(robot, Way::FromRobot, *at, bytes, false),
        // A datagram that is no frame has a decoder that says why.
        Arrival::Bytes { at, bytes, .. } | Arrival::Invalid { at, bytes, .. } => {
            devices.datagram(robot, Way::FromRobot, *at, bytes)
        }
        _ => false,
    }
}
