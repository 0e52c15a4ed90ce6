//! Recording a real cell: from captures, as the robots' PC, between robots and PC; ended, killed, and with a full disk.

mod captures;
mod commands;
mod crash;
mod ends;
mod import;
mod lacks;
mod live;
mod real_xml;
mod sensors;
mod tcp;
mod wire;
