//! The Ethernet configuration of a controller: what it sends, what it takes, and how.
//!
//! ```text
//! <ROOT><CONFIG><IP_NUMBER/><PORT/>[<PROTOCOL>TCP|UDP</PROTOCOL>]<SENTYPE/>[<PROTCOLLENGTH>On|Off</PROTCOLLENGTH>]<ONLYSEND/></CONFIG>
//! <SEND><ELEMENTS><ELEMENT TAG= TYPE= INDX= [UNIT=]/>…</ELEMENTS></SEND>
//! <RECEIVE><ELEMENTS><ELEMENT TAG= TYPE= INDX= [UNIT=] HOLDON=/>…</ELEMENTS></RECEIVE></ROOT>
//! ```
//! | field | meaning |
//! |---|---|
//! | `TAG` | `DEF_…`: read inside the controller, see below; `A.B`: attribute B of element A; `A`: text of element A |
//! | `TYPE` | BOOL, STRING, LONG or DOUBLE |
//! | `INDX` | `INTERNAL` with `DEF_…`; otherwise the port of the ETHERNET object, 1..64, each once in its section |
//! | `HOLDON` | what the port does when a reply is late: 0 falls to zero, 1 holds the last value |
//! | `SENTYPE` | `Type` of every reply; with another one the controller drops the reply and says nothing |
//! | `ONLYSEND` | TRUE: no reply is expected |
//! | `PROTOCOL`, `PROTCOLLENGTH`, `UNIT` | KRC2 only; without `PROTOCOL` it is UDP |
//!
//! Source: reference/PROTOCOLS.md, section 1.4. Not covered: the object graph (`.rsi.xml`, `.rsix`), so that what a port drives,
//! and whether the robot has the external axes that are corrected, is not known here.

use super::config_xml::{self, ConfigError};

/// An Ethernet configuration, checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EthernetConfig {
    /// Address of the PC as written; files that are handed round hold a placeholder.
    pub ip: String,
    /// Port of the PC.
    pub port: u16,
    /// How documents travel.
    pub protocol: Transport,
    /// `Type` of every reply.
    pub sentype: String,
    /// Each document follows its length.
    pub length_prefix: bool,
    /// The controller takes no reply.
    pub only_send: bool,
    /// It holds what only a KRC2 reads: `PROTOCOL`, `PROTCOLLENGTH` or `UNIT`.
    pub krc2: bool,
    /// What the controller sends, in the order of the file.
    pub send: Vec<Channel>,
    /// What the controller takes, in the order of the file.
    pub receive: Vec<Channel>,
}

/// How documents travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// One document per datagram.
    Udp,
    /// A stream; KRC2 only.
    Tcp,
}

/// One line of `SEND` or `RECEIVE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// As written: `DEF_RIst`, `RKorr.X`, `Stop`.
    pub tag: String,
    /// Element on the wire.
    pub element: String,
    /// Attributes on the wire; none: the value is the text of the element.
    pub attributes: Vec<String>,
    /// Type of its values.
    pub kind: Kind,
    /// Where it is connected in the controller.
    pub index: Index,
    /// What happens when a reply is late: `Some(true)` holds, `Some(false)` falls to zero. `None` where the file says nothing.
    pub hold: Option<bool>,
    /// Line of the file, from 1.
    pub line: usize,
}

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// 0 or 1.
    Bool,
    /// Text.
    String,
    /// Whole number, 32 bits.
    Long,
    /// Number with decimals.
    Double,
}

/// Where a channel is connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Index {
    /// Inside the controller.
    Internal,
    /// Port of the ETHERNET object, 1..=64.
    Port(u8),
}

impl EthernetConfig {
    /// Reads the text of a configuration file.
    pub fn parse(xml: &str) -> Result<Self, ConfigError> {
        config_xml::parse(xml)
    }

    /// Whether the controller sends this element.
    pub fn sends(&self, element: &str) -> bool {
        self.send.iter().any(|channel| channel.element == element)
    }

    /// The channel that takes this attribute of this element (its text, when `attribute` is empty).
    pub fn receives(&self, element: &str, attribute: &str) -> Option<&Channel> {
        self.receive.iter().find(|channel| {
            channel.element == element
                && (channel.attributes.iter().any(|known| known == attribute)
                    || (attribute.is_empty() && channel.attributes.is_empty()))
        })
    }
}
