//! KUKA's Robot Sensor Interface (RSI): documents, Ethernet configuration, and the PC's side of the exchange.
//!
//! The robot controller sends a `<Rob>` document in every cycle (4 or 12 ms); the PC answers each with one `<Sen>` document that
//! carries the same IPOC. Units on this wire are millimetres and degrees, with A, B, C as rotations about z, y', x''.
//!
//! | file | what it is |
//! |---|---|
//! | `telegram`, `scan`, `malformed`, `number` | one document, either direction; what may be wrong with it |
//! | `write` | numbers as they go onto the wire |
//! | `frames` | a stream or a datagram cut into documents |
//! | `config`, `config_xml`, `layout`, `dangers` | the Ethernet configuration file of the controller |
//! | `controller*` | the controller's side of one robot |
//! | `host`, `event`, `ipoc`, `pace`, `names`, `quantum`, `reply` | the PC's side for one robot |
//!
//! Source: reference/PROTOCOLS.md, section 1.

mod config;
mod config_xml;
mod controller;
mod controller_event;
mod controller_late;
mod controller_limits;
mod controller_reply;
mod controller_send;
mod controller_settings;
mod dangers;
mod event;
mod frames;
mod host;
#[cfg(test)]
mod host_tests;
mod ipoc;
mod layout;
mod malformed;
#[cfg(test)]
mod mutated;
mod names;
mod number;
mod pace;
mod quantum;
mod reply;
mod scan;
mod telegram;
#[cfg(test)]
mod vectors;
mod write;

pub use config::{Channel, EthernetConfig, Index, Kind, Transport};
pub use config_xml::ConfigError;
pub use controller::Controller;
pub use controller_event::{ControllerEvent, Refusal, Stop, StopReason};
pub use controller_late::LateRule;
pub use controller_limits::Limits;
pub use controller_settings::{Family, Settings};
pub use dangers::{Danger, Dangerous, Mode, Trap};
pub use event::Event;
pub use frames::{Frames, Prefix, split};
pub use host::{Frame, Host, HostOptions};
pub use layout::{Slot, layout};
pub use malformed::{Malformed, Why};
pub use number::{BadNumber, NumberWhy, decimals, parse};
pub use reply::{Corrections, ReplyError};
pub use telegram::{EXTERNAL, Element, Form, Ipoc, POSE, Root, Telegram};
pub use write::{DECIMALS_MAX, NotFinite, fixed, sent};
