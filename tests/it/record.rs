//! Recording a real cell: from captures, as the robots' PC, between robots and PC; killed, and with a full disk.

mod crash;
mod import;
mod live;
mod tcp;
mod wire;
