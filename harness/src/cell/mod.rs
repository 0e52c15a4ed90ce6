//! Cells: robots, sensor and satellites that speak over wires, as a file, and the virtual one that is a cell itself.
//!
//! ```text
//! CELL.toml ──┬─ Ethernet configuration of each robot (XML)
//!             └─ model.toml: what the operator believes of the cell
//! ```

pub mod clock;
mod config;
mod config_check;
pub mod controller;
pub mod faults;
pub mod frames;
pub mod on_wire;
mod parts;
mod pc;
pub mod process;
pub mod run;
pub mod serve;
pub mod session;
pub mod virtual_cell;
pub mod wires;

pub use config::{Carries, PlaceConfig, RailConfig, RobotConfig, SensorConfig, StartConfig, TimeConfig};
pub use config::{Cell, TextFile, embedded};
pub use config::{CellConfig, Correction, FamilyName, FormName, LateConfig, LimitsConfig, ModeName};
