//! What is taken from the recording, and what the model makes of it.
//!
//! | clamped | taken from the recording | made by the model |
//! |---|---|---|
//! | nothing | the first motion | everything: the satellites react |
//! | commanded | the command and the satellites' velocity | the reported pose and the force |
//! | achieved | also the reported pose, without its declared delay the path | the force |
//! | sensed | the force and the reported pose | the command and the satellites' velocity: our own software |

use crate::error::Error;
use crate::model::Chosen;
use crate::recording::Role;
use crate::scenario::Fault;
use serde::Serialize;
use sim_core::signals::Wire;

/// The wire that is clamped to the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Clamp {
    /// Nothing: the satellites react.
    #[default]
    Nothing,
    /// The commanded pose: link, robot, read-out, contact and sensor react.
    Commanded,
    /// The achieved pose, taken as the reported one without its declared delay: contact and sensor react.
    Achieved,
    /// The reading of the force sensor: the satellites react, and nothing else.
    Sensed,
}

impl Clamp {
    /// As it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Clamp::Nothing => "nothing",
            Clamp::Commanded => "commanded",
            Clamp::Achieved => "achieved",
            Clamp::Sensed => "sensed",
        }
    }

    /// Whether the model makes this stream.
    pub fn makes(self, role: Role) -> bool {
        match self {
            Clamp::Nothing => role != Role::Applied,
            Clamp::Commanded => matches!(role, Role::Measured | Role::Sensed),
            Clamp::Achieved => role == Role::Sensed,
            Clamp::Sensed => matches!(role, Role::Commanded | Role::Twist),
        }
    }

    /// Whether an effect on this wire could change nothing that the model makes.
    fn silences(self, wire: Wire) -> bool {
        match self {
            Clamp::Nothing | Clamp::Commanded => false,
            Clamp::Achieved => matches!(wire, Wire::Received | Wire::Achieved | Wire::Measured),
            Clamp::Sensed => matches!(wire, Wire::Touch | Wire::Contact | Wire::Sensed | Wire::Recorder),
        }
    }

    /// Whether this effect acts on a wire that comes from the recording.
    pub fn silences_effect(self, chosen: &Chosen) -> bool {
        chosen.kind.wires.iter().any(|wire| self.silences(*wire))
    }

    /// Refuses a fault that the clamp would silence, and one that acts on the recorder: the stamps stay those of the recording.
    pub fn check(self, faults: &[Fault]) -> Result<(), Error> {
        if let Some(fault) = faults.iter().find(|fault| fault.chosen.kind.wires.contains(&Wire::Recorder)) {
            let id = &fault.chosen.kind.id;
            return Err(Error::new(format!("effect {id} acts on the recorder, whose stamps a replay does not change"))
                .place(format!("--with {id}"))
                .help("put it into a scenario, as [[effect]], and run that: dockhil run SCENARIO.toml -o OUT.mcap"));
        }
        let Some(fault) = faults.iter().find(|fault| self.silences_effect(&fault.chosen)) else { return Ok(()) };
        let id = &fault.chosen.kind.id;
        let wires: Vec<&str> = fault.chosen.kind.wires.iter().map(|wire| wire.name()).collect();
        let what = format!(
            "effect {id} acts on the wire {}, which is clamped to the recording or lies before the clamp",
            wires.join(", ")
        );
        let elsewhere = match self {
            Clamp::Achieved => "--clamp commanded, or clamp nothing",
            _ => "--clamp commanded or --clamp achieved, or clamp nothing",
        };
        Err(Error::new(what)
            .place(format!("--clamp {}", self.name()))
            .help(format!("leave --with {id} out, or clamp elsewhere: {elsewhere}")))
    }
}
