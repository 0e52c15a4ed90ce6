//! Faults on the wire, as data: what a cell's links can do to the packets of one stream.
//!
//! A [`WireFault`] says what happens (`id` and its parameters), to which [`Stream`], and from which packet on. It is addressed by
//! the number of a packet (a cycle of an RSI link, a sample of a sensor), never by time, or by an event such as the first contact.
//! What is random in it comes from a named stream of the run's seed, so that a run with faults can be repeated to the bit.
//!
//! [`Faulty`] takes the packets of one stream and yields what arrives instead. Some faults are not a change of bytes: a foreign
//! peer needs a second socket, a controller's clock that jumps needs the controller. [`TABLE`] says so in [`Row::needs`]; the
//! virtual cell performs those and asks a [`Schedule`] when. Every fault counts how often it acted, and one that never did is an
//! error of the run. What the computer reports of each, and which look alike from there: [`table`].
//!
//! | list of reference/PROTOCOLS.md, section 5 | id |
//! |---|---|
//! | drop, duplicate, swap with next k, hold for n cycles, delay d | `drop` `duplicate` `swap` `hold` `delay` |
//! | jitter from a recorded table, silence then burst | `jitter` `silence-then-burst` |
//! | truncate at byte, flip bit, NUL padding, two documents in one segment | `truncate` `flip-bit` `nul-padding` `two-documents` |
//! | wrong IPOC (step, 0, previous), IPOC mid-document | `ipoc-step` `ipoc-zero` `ipoc-previous` `ipoc-middle` |
//! | IPOC freeze, back jump, restart, 2^32 crossing | `ipoc-freeze` `ipoc-back` `ipoc-restart` `ipoc-crossing` |
//! | wrong Sen Type, `TYPE`/`Type` | `wrong-type` `type-spelling` |
//! | extra, absent attribute | `attribute-extra` `attribute-absent` |
//! | decimal comma, NaN, exponent | `decimal-comma` `nan` `exponent` |
//! | foreign peer, ICMP unreachable | `foreign-peer` `icmp-unreachable` |
//! | status word, counts at the limits of i32 | `status-word` `counts-at-limits` |
//! | cpf change mid-run, unit change | `cpf-change` `unit-change` |
//! | rdt restart to 1, ft stall, ft restart | `rdt-restart` `ft-stall` `ft-restart` |
//! | second client steals stream, lost start, length not 36 k | `second-client` `lost-start` `length` |
//! | HTTP 404, slow, half a page | `http-not-found` `http-slow` `http-half-page` |
//!
//! Not covered: faults of the sensor's record know the 36 bytes of RDT (and of OptoForce, which are the same); on the records of
//! other sensors only those act that need no layout (drop, truncate, flip bit and the like).

mod action;
mod classes;
mod document;
mod faulty;
mod record;
mod schedule;
mod stage;
pub mod table;
mod wire_fault;

pub use action::Action;
pub use classes::CLASSES;
pub use faulty::{Faulty, Out, Robot};
pub use schedule::{Event, Schedule};
pub use table::{Needs, Row, TABLE, alike, row};
pub use wire_fault::{At, FaultError, Stream, WireFault};

#[cfg(test)]
mod ft_tests;
#[cfg(test)]
mod rsi_tests;
#[cfg(test)]
mod tests;
