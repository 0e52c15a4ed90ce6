//! Cells: robots, sensor and satellites that speak over wires, as a file; and the virtual one that is a cell itself.
//!
//! ```text
//! CELL.toml ──┬─ Ethernet configuration of each robot (XML)
//!             └─ model.toml: what the operator believes of the cell
//!
//!            facility (sim_core)                         satellites, compensator
//!                   │                                              │
//!  VirtualCell: rsi::Controller ×n, ft::Device   ◄─bytes─►   OnWire: rsi::Host ×n, ft::Sensor ── Controller
//!                   └──────────── Peer: InProcess, or Wires ◄─UDP, TCP─► Served ┘
//! ```
//!
//! | file | what it is |
//! |---|---|
//! | `config`, `config_check`, `parts` | the file, what it may say, and the parts made of it |
//! | `frames` | poses of two robots and the relative one |
//! | `virtual_cell`, `faults`, `session` | the cell without a socket, what it gets wrong, and what was exchanged |
//! | `controller`, `on_wire`, `pc` | controllers under test in SI, and their bytes |
//! | `fault_list` | the faults of the wire as text |
//! | `run`, `page` | one run: the cell and whoever is at the other end; and how it is shown |
//! | `wires`, `waiting`, `timing`, `serve`, `link`, `process`, `clock` | the same over real sockets, with a program that is started and watched |
//! | `sensor_link` | the sockets of a sensor, on both sides, as its protocol has them |
//! | `net_faults`, `intruder` | what only sockets get wrong: strangers, closed ports, a second client |
//! | `page_server`, `page_reader` | the sensor's page, and the computer that reads it |
//!
//! In virtual time a run is a function of its files and of the controller's answers: the F/T packets of a cycle are sent before its
//! frames, and the cell goes on when it has its answers.

pub mod clock;
mod config;
mod config_check;
pub mod controller;
pub mod fault_list;
pub mod faults;
pub mod frames;
mod intruder;
pub(crate) mod link;
pub mod net_faults;
pub mod on_wire;
pub mod page;
pub mod page_reader;
mod page_server;
mod parts;
mod pc;
pub mod process;
pub mod run;
pub(crate) mod sensor_link;
pub mod serve;
pub mod session;
pub mod timing;
pub mod virtual_cell;
mod waiting;
pub mod wires;

pub use config::{Carries, PlaceConfig, RailConfig, RobotConfig, SensorConfig, StartConfig, TimeConfig, schema};
pub use config::{Cell, TextFile, embedded};
pub use config::{CellConfig, Correction, FamilyName, FormName, LateConfig, LimitsConfig, ModeName};
