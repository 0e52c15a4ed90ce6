//! What may be wrong with a configuration that is sound as a file.
//!
//! Dangers may crash a robot; a program refuses to send with them.
//!
//! | pair | what happens |
//! |---|---|
//! | absolute corrections, HOLDON 0 | a single late reply sets the offset to zero: the robot tries to jump back in one cycle |
//! | relative corrections, HOLDON 1 | a stalled PC: the last step is added again in every cycle, 0.6 mm × 100 cycles = 60 mm |
//!
//! Traps mislead, and are said. Source: reference/PROTOCOLS.md, sections 1.4, 1.5 and 1.9. Every DOUBLE port of RECEIVE counts
//! as a correction, because the object graph is not read. Not covered: a file name too long for the controller (its limit is
//! documented nowhere) and corrections of external axes that the robot does not have.

use core::fmt;
use std::net::Ipv4Addr;

use super::config::{EthernetConfig, Index, Kind, Transport};

/// What a correction means; `RSI_ON(#ABSOLUTE | #RELATIVE)` on the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Offset from the pose at the start.
    Absolute,
    /// Added to the running correction in every cycle.
    Relative,
}

/// A pair that may crash the robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Danger {
    /// How corrections are meant.
    pub mode: Mode,
    /// Channels with the HOLDON that does not go with it: name and line.
    pub channels: Vec<(String, usize)>,
}

/// A configuration that must not be used to send corrections.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dangerous(pub Vec<Danger>);

/// Something in a configuration that misleads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trap {
    /// The address is a placeholder, not four numbers.
    AddressPlaceholder,
    /// 192.168.0.x is taken inside a KRC4.
    AddressTakenByKrc4,
    /// 192.0.1.x is taken inside a KRC2.
    AddressTakenByKrc2,
    /// No `DEF_Delay`: late and refused replies cannot be seen.
    NoDelay,
    /// A set pose or set angles without the measured ones: they do not move while corrections run.
    SetpointOnly,
    /// No measured pose (`DEF_RIst`).
    NoMeasuredPose,
    /// ONLYSEND: the controller takes no correction.
    OnlySend,
    /// PROTCOLLENGTH without TCP: datagrams have no length before them.
    LengthWithoutStream,
}

impl EthernetConfig {
    /// Pairs of mode and HOLDON that may crash the robot.
    pub fn dangers(&self, mode: Mode) -> Vec<Danger> {
        let wrong = mode == Mode::Relative;
        let correction = |kind: Kind, index: Index| kind == Kind::Double && index != Index::Internal;
        let channels: Vec<(String, usize)> = self
            .receive
            .iter()
            .filter(|channel| correction(channel.kind, channel.index) && channel.hold == Some(wrong))
            .map(|channel| (channel.tag.clone(), channel.line))
            .collect();
        if channels.is_empty() || self.only_send { Vec::new() } else { vec![Danger { mode, channels }] }
    }

    /// Refuses the dangerous pairs.
    pub fn check(&self, mode: Mode) -> Result<(), Dangerous> {
        let dangers = self.dangers(mode);
        if dangers.is_empty() { Ok(()) } else { Err(Dangerous(dangers)) }
    }

    /// What in the configuration misleads.
    pub fn traps(&self) -> Vec<Trap> {
        let mut traps = Vec::new();
        match self.ip.parse::<Ipv4Addr>().map(|address| address.octets()) {
            Err(_) => traps.push(Trap::AddressPlaceholder),
            Ok([192, 168, 0, _]) if !self.krc2 => traps.push(Trap::AddressTakenByKrc4),
            Ok([192, 0, 1, _]) if self.krc2 => traps.push(Trap::AddressTakenByKrc2),
            Ok(_) => {}
        }
        if self.only_send {
            traps.push(Trap::OnlySend);
        } else if !self.sends("Delay") {
            traps.push(Trap::NoDelay);
        }
        let set_only = |set: &str, measured: &str| self.sends(set) && !self.sends(measured);
        if set_only("RSol", "RIst") || set_only("ASPos", "AIPos") || set_only("ESPos", "EIPos") {
            traps.push(Trap::SetpointOnly);
        }
        if !self.sends("RIst") {
            traps.push(Trap::NoMeasuredPose);
        }
        if self.length_prefix && self.protocol == Transport::Udp {
            traps.push(Trap::LengthWithoutStream);
        }
        traps
    }
}

impl Danger {
    /// Its name in reports.
    pub fn id(&self) -> &'static str {
        match self.mode {
            Mode::Absolute => "absolute-without-hold",
            Mode::Relative => "relative-with-hold",
        }
    }
}

impl fmt::Display for Danger {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mode, hold, what, want) = match self.mode {
            Mode::Absolute => ("absolute", 0, "one late reply makes the robot jump back in one cycle", 1),
            Mode::Relative => ("relative", 1, "a PC that stalls moves the robot on by its last step in every cycle", 0),
        };
        write!(out, "{mode} corrections with HOLDON=\"{hold}\": {what}; set HOLDON=\"{want}\" for ")?;
        for (i, (tag, line)) in self.channels.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(out, "{comma}{tag} (line {line})")?;
        }
        Ok(())
    }
}

impl fmt::Display for Dangerous {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, danger) in self.0.iter().enumerate() {
            let comma = if i == 0 { "" } else { "; " };
            write!(out, "{comma}{danger}")?;
        }
        Ok(())
    }
}

impl core::error::Error for Dangerous {}

impl Trap {
    /// Its name in reports.
    pub fn id(&self) -> &'static str {
        match self {
            Trap::AddressPlaceholder => "address-placeholder",
            Trap::AddressTakenByKrc4 => "address-taken-by-krc4",
            Trap::AddressTakenByKrc2 => "address-taken-by-krc2",
            Trap::NoDelay => "no-delay",
            Trap::SetpointOnly => "setpoint-only",
            Trap::NoMeasuredPose => "no-measured-pose",
            Trap::OnlySend => "only-send",
            Trap::LengthWithoutStream => "length-without-stream",
        }
    }
}

impl fmt::Display for Trap {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Trap::AddressPlaceholder => "IP_NUMBER is no address; set the PC's",
            Trap::AddressTakenByKrc4 => "192.168.0.x is taken inside a KRC4; give the PC another network",
            Trap::AddressTakenByKrc2 => "192.0.1.x is taken inside a KRC2; give the PC another network",
            Trap::NoDelay => "without DEF_Delay in SEND nobody sees that replies are late or refused; add it",
            Trap::SetpointOnly => {
                "set values (RSol, ASPos, ESPos) without measured ones do not move while corrections run; add RIst, AIPos or EIPos"
            }
            Trap::NoMeasuredPose => "no DEF_RIst in SEND, so that there is no measured pose; add it",
            Trap::OnlySend => "ONLYSEND is TRUE: the controller takes no correction",
            Trap::LengthWithoutStream => "PROTCOLLENGTH is On and PROTOCOL is not TCP: a datagram has no length before it; leave it out",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::vectors::CONFIG;
    use super::*;

    fn config(from: &str, to: &str) -> EthernetConfig {
        assert!(CONFIG.contains(from));
        EthernetConfig::parse(&CONFIG.replace(from, to)).unwrap()
    }

    #[test]
    fn the_two_pairs_are_refused_by_name() {
        let hold = config("", "");
        assert_eq!(hold.check(Mode::Absolute), Ok(()));
        let problem = hold.check(Mode::Relative).unwrap_err();
        assert_eq!(problem.0[0].id(), "relative-with-hold");
        assert!(problem.to_string().contains("RKorr.X (line 16), RKorr.Y (line 17)"), "{problem}");
        let one = config(r#"INDX="4" HOLDON="1""#, r#"INDX="4" HOLDON="0""#);
        let problem = one.check(Mode::Absolute).unwrap_err();
        assert_eq!(
            problem.to_string(),
            "absolute corrections with HOLDON=\"0\": one late reply makes the robot jump back in one cycle; \
             set HOLDON=\"1\" for RKorr.Z (line 18)"
        );
        // A switch that falls to zero is no correction, and neither is what nobody takes.
        let relative = config(r#"TYPE="DOUBLE" INDX="2" HOLDON="1""#, r#"TYPE="DOUBLE" INDX="2" HOLDON="0""#);
        assert_eq!(relative.check(Mode::Relative).unwrap_err().0[0].channels.len(), 5);
        assert_eq!(config("<ONLYSEND>FALSE", "<ONLYSEND>TRUE").dangers(Mode::Relative), []);
    }

    #[test]
    fn each_trap_has_its_name() {
        let cases: [(&str, &str, &[Trap]); 9] = [
            ("", "", &[]),
            ("192.168.1.2", "ip.address.of.rospc", &[Trap::AddressPlaceholder]),
            ("192.168.1.2", "192.168.0.2", &[Trap::AddressTakenByKrc4]),
            ("192.168.1.2</IP_NUMBER>", "192.0.1.2</IP_NUMBER><PROTOCOL>TCP</PROTOCOL>", &[Trap::AddressTakenByKrc2]),
            ("192.168.1.2</IP_NUMBER>", "192.168.0.2</IP_NUMBER><PROTOCOL>TCP</PROTOCOL>", &[]),
            ("DEF_Delay", "DEF_AIPos", &[Trap::NoDelay]),
            ("DEF_RIst", "DEF_RSol", &[Trap::SetpointOnly, Trap::NoMeasuredPose]),
            ("<ONLYSEND>FALSE", "<ONLYSEND>true", &[Trap::OnlySend]),
            ("<ONLYSEND>", "<PROTCOLLENGTH>On</PROTCOLLENGTH><ONLYSEND>", &[Trap::LengthWithoutStream]),
        ];
        for (from, to, traps) in cases {
            assert_eq!(config(from, to).traps(), traps, "{to}");
        }
    }
}
