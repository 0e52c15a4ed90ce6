//! Reads an Ethernet configuration: XML in, checked channels out, each error with its line.
//!
//! The file is XML proper, so a library reads it. A KRC2 file closes its comments with `!-->`, which is legal.

use core::ops::Range;

use quick_xml::Reader;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};

use super::config::{Channel, EthernetConfig, Index, Kind, Transport};
use super::layout::expand;

/// Largest file that is read, in bytes: 64 channels each way need a tenth of it.
const FILE_MAX: usize = 262_144;
/// Most lines of a section: 64 ports and room for all internal names.
const CHANNELS_MAX: usize = 128;

/// A configuration that is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}; {help}")]
pub struct ConfigError {
    /// Line of the file, from 1.
    pub line: usize,
    /// What is wrong, with the value.
    pub what: String,
    /// What to do.
    pub help: String,
}

fn error<T>(line: usize, what: impl Into<String>, help: impl Into<String>) -> Result<T, ConfigError> {
    Err(ConfigError { line, what: what.into(), help: help.into() })
}

/// The fields of `CONFIG`, as they were found.
#[derive(Default)]
struct Head {
    fields: Vec<(String, String, usize)>,
}

/// Which part of the file it is in.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Send,
    Receive,
}

struct Parser {
    head: Head,
    send: Vec<Channel>,
    receive: Vec<Channel>,
    krc2: bool,
    /// Names of the elements that are open.
    open: Vec<String>,
}

pub(super) fn parse(xml: &str) -> Result<EthernetConfig, ConfigError> {
    if xml.len() > FILE_MAX {
        return error(
            1,
            format!("the file has {} bytes, limit {FILE_MAX}", xml.len()),
            "give an Ethernet configuration",
        );
    }
    let xml = xml.trim_start_matches('\u{feff}');
    let mut parser =
        Parser { head: Head::default(), send: Vec::new(), receive: Vec::new(), krc2: false, open: Vec::new() };
    let mut reader = Reader::from_str(xml);
    let mut lines = Lines { xml, at: 0, line: 1 };
    loop {
        let begin = usize::try_from(reader.buffer_position()).unwrap_or(xml.len()).min(xml.trim_end().len());
        let line = lines.of(begin);
        match reader.read_event() {
            Ok(Event::Eof) => return parser.finish(line),
            Ok(event) => parser.event(event, line)?,
            Err(problem) => {
                let at = usize::try_from(reader.error_position()).unwrap_or(begin).max(begin);
                return error(lines.of(at), no_xml(&problem), "close every tag and every comment");
            }
        }
    }
}

/// Line numbers of growing byte positions.
struct Lines<'a> {
    xml: &'a str,
    at: usize,
    line: usize,
}

impl Lines<'_> {
    fn of(&mut self, position: usize) -> usize {
        let range: Range<usize> = self.at..position.clamp(self.at, self.xml.len());
        self.at = range.end;
        self.line += self.xml.as_bytes()[range].iter().filter(|byte| **byte == b'\n').count();
        self.line
    }
}

impl Parser {
    fn event(&mut self, event: Event<'_>, line: usize) -> Result<(), ConfigError> {
        match event {
            Event::Start(tag) => {
                self.element(&tag, line)?;
                if self.open.len() == 8 {
                    return error(line, "more than 8 elements within each other", "give an Ethernet configuration");
                }
                self.open.push(tag.name().as_ref().to_owned());
            }
            Event::Empty(tag) => self.element(&tag, line)?,
            Event::End(_) => {
                self.open.pop();
            }
            Event::Text(text) => self.text(&text.xml_content(XmlVersion::Implicit1_0), line)?,
            Event::GeneralRef(_) => return error(line, "an entity (&…;)", "write the character itself"),
            Event::CData(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) | Event::Eof => {}
        }
        Ok(())
    }

    fn text(&mut self, text: &str, line: usize) -> Result<(), ConfigError> {
        let text = text.trim();
        if text.is_empty() {
            return Ok(());
        }
        match self.open.as_slice() {
            [root, config, name] if root == "ROOT" && config == "CONFIG" => {
                if self.head.fields.iter().any(|(known, _, _)| known == name) {
                    return error(line, format!("{name} stands there twice"), "keep one");
                }
                // Nothing there is longer than an address, and unknown names could be many.
                if self.head.fields.len() < 64 {
                    self.head.fields.push((name.clone(), text.chars().take(256).collect(), line));
                }
                Ok(())
            }
            _ => error(line, format!("text outside CONFIG: '{}'", cut(text)), "delete it, or make it a comment"),
        }
    }

    fn element(&mut self, tag: &BytesStart<'_>, line: usize) -> Result<(), ConfigError> {
        let name = tag.name();
        let name: &str = name.as_ref();
        if self.open.is_empty() && name != "ROOT" {
            let help = "an Ethernet configuration begins with <ROOT>; an object graph (RSIObjects) is another file";
            return error(line, format!("the file begins with <{}>", cut(name)), help);
        }
        if name != "ELEMENT" {
            return Ok(());
        }
        let section = match self.open.get(1).map(String::as_str) {
            Some("SEND") => Section::Send,
            Some("RECEIVE") => Section::Receive,
            _ => return error(line, "an ELEMENT outside SEND and RECEIVE", "move it into one of them"),
        };
        let channel = self.channel(tag, section, line)?;
        let (channels, name) = match section {
            Section::Send => (&mut self.send, "SEND"),
            Section::Receive => (&mut self.receive, "RECEIVE"),
        };
        check_against(channels, &channel, name)?;
        channels.push(channel);
        Ok(())
    }

    fn channel(&mut self, tag: &BytesStart<'_>, section: Section, line: usize) -> Result<Channel, ConfigError> {
        let [mut name, mut kind, mut index, mut hold] = [const { None::<String> }; 4];
        for attribute in tag.attributes() {
            let attribute = match attribute {
                Ok(attribute) => attribute,
                Err(problem) => return error(line, no_xml(&problem), "write NAME=\"value\""),
            };
            let value = match attribute.normalized_value(XmlVersion::Implicit1_0) {
                Ok(value) => value.trim().to_owned(),
                Err(problem) => return error(line, no_xml(&problem), "write the character itself"),
            };
            let key: &str = attribute.key.as_ref();
            match key {
                "TAG" => name = Some(value),
                "TYPE" => kind = Some(value),
                "INDX" => index = Some(value),
                "HOLDON" => hold = Some(value),
                "UNIT" => self.krc2 = true,
                _ => return error(line, format!("unknown attribute {}", cut(key)), "known: TAG TYPE INDX UNIT HOLDON"),
            }
        }
        let Some(name) = name else { return error(line, "an ELEMENT without TAG", "add TAG=\"…\"") };
        let (element, attributes) = wire_names(&name, section, line)?;
        let kind = kind_of(&name, kind.as_deref(), line)?;
        let index = index_of(&name, index.as_deref(), line)?;
        let hold = hold_of(&name, hold.as_deref(), section == Section::Receive && index != Index::Internal, line)?;
        Ok(Channel { tag: name, element, attributes, kind, index, hold, line })
    }

    fn finish(self, line: usize) -> Result<EthernetConfig, ConfigError> {
        if let Some(name) = self.open.last() {
            return error(line, format!("<{}> is never closed", cut(name)), "the file is cut off; copy it again");
        }
        let head = self.head;
        let Some((port_text, port_line)) = head.get("PORT") else {
            return error(line, "no PORT in CONFIG", "add <PORT>49152</PORT>");
        };
        let Some(port) = port_text.parse::<u16>().ok().filter(|port| *port > 0) else {
            return error(port_line, format!("PORT = '{}' is outside 1..65535", cut(port_text)), "give the PC's port");
        };
        let Some((sentype, _)) = head.get("SENTYPE") else {
            let help = "add <SENTYPE>name</SENTYPE>; without it the controller drops every reply and says nothing";
            return error(line, "no SENTYPE in CONFIG", help);
        };
        let Some((ip, _)) = head.get("IP_NUMBER") else {
            return error(line, "no IP_NUMBER in CONFIG", "add the PC's address");
        };
        let protocol = match head.choice("PROTOCOL", ["UDP", "TCP"])? {
            Some(1) => Transport::Tcp,
            _ => Transport::Udp,
        };
        let length = head.choice("PROTCOLLENGTH", ["OFF", "ON"])?;
        let krc2 = self.krc2 || length.is_some() || head.get("PROTOCOL").is_some();
        Ok(EthernetConfig {
            ip: ip.to_owned(),
            port,
            protocol,
            sentype: sentype.to_owned(),
            length_prefix: length == Some(1),
            only_send: head.choice("ONLYSEND", ["FALSE", "TRUE"])? == Some(1),
            krc2,
            send: self.send,
            receive: self.receive,
        })
    }
}

impl Head {
    fn get(&self, name: &str) -> Option<(&str, usize)> {
        self.fields.iter().find(|(known, _, _)| known == name).map(|(_, text, line)| (text.as_str(), *line))
    }

    /// Which of two words a field holds, in any case; `None` when the field is missing.
    fn choice(&self, name: &str, words: [&str; 2]) -> Result<Option<usize>, ConfigError> {
        let Some((text, line)) = self.get(name) else { return Ok(None) };
        match words.iter().position(|word| word.eq_ignore_ascii_case(text)) {
            Some(found) => Ok(Some(found)),
            None => error(line, format!("{name} = '{}'", cut(text)), format!("write {} or {}", words[0], words[1])),
        }
    }
}

fn wire_names(tag: &str, section: Section, line: usize) -> Result<(String, Vec<String>), ConfigError> {
    let Some((element, attributes)) = expand(tag) else {
        let help =
            "names are letters, digits, _ and -, at most 32, with at most one point; generators are Tech.C1 to Tech.T6";
        return error(line, format!("TAG = '{}' is no name", cut(tag)), help);
    };
    if element == "IPOC" || element == "Dat" || !element.as_bytes()[0].is_ascii_alphabetic() {
        return error(line, format!("TAG = '{}': no element can have this name", cut(tag)), "take another name");
    }
    let internal = tag.starts_with("DEF_");
    if section == Section::Receive && tag == "DEF_Tech.T1" {
        let help = "generator 1 belongs to RSI and stops it with RSIBad; take T2 to T6, or C1";
        return error(line, "DEF_Tech.T1 in RECEIVE", help);
    }
    if section == Section::Receive && internal && element != "Tech" && element != "EStr" {
        return error(
            line,
            format!("{} in RECEIVE", cut(tag)),
            "only DEF_EStr and DEF_Tech can be taken; move it to SEND",
        );
    }
    Ok((element, attributes))
}

fn kind_of(tag: &str, text: Option<&str>, line: usize) -> Result<Kind, ConfigError> {
    match text {
        Some("BOOL") => Ok(Kind::Bool),
        Some("STRING") => Ok(Kind::String),
        Some("LONG") => Ok(Kind::Long),
        Some("DOUBLE") => Ok(Kind::Double),
        other => error(
            line,
            format!("TYPE of {} is '{}'", cut(tag), cut(other.unwrap_or("missing"))),
            "write BOOL, STRING, LONG or DOUBLE",
        ),
    }
}

fn index_of(tag: &str, text: Option<&str>, line: usize) -> Result<Index, ConfigError> {
    let Some(text) = text else { return error(line, format!("{} has no INDX", cut(tag)), "add INDX=\"…\"") };
    let internal = tag.starts_with("DEF_");
    if text == "INTERNAL" {
        let help = "give the port of the ETHERNET object, 1 to 64; INTERNAL is for DEF_ names";
        return if internal {
            Ok(Index::Internal)
        } else {
            error(line, format!("INDX of {} is INTERNAL", cut(tag)), help)
        };
    }
    if internal {
        let help = "DEF_ names are read inside the controller: write INDX=\"INTERNAL\"";
        return error(line, format!("INDX of {} is '{}'", cut(tag), cut(text)), help);
    }
    match text.parse::<u8>() {
        Ok(port @ 1..=64) => Ok(Index::Port(port)),
        _ => error(
            line,
            format!("INDX of {} is '{}', outside 1..64", cut(tag), cut(text)),
            "the ETHERNET object has 64 ports",
        ),
    }
}

fn hold_of(tag: &str, text: Option<&str>, needed: bool, line: usize) -> Result<Option<bool>, ConfigError> {
    let help = "write 1 where corrections are absolute, 0 where they are relative";
    match text {
        Some("0") => Ok(Some(false)),
        Some("1") => Ok(Some(true)),
        Some(other) => error(line, format!("HOLDON of {} is '{}', not 0 or 1", cut(tag), cut(other)), help),
        None if needed => error(line, format!("{} has no HOLDON", cut(tag)), help),
        None => Ok(None),
    }
}

fn check_against(channels: &[Channel], channel: &Channel, section: &str) -> Result<(), ConfigError> {
    let line = channel.line;
    if channels.len() == CHANNELS_MAX {
        return error(
            line,
            format!("more than {CHANNELS_MAX} elements in {section}"),
            "the ETHERNET object has 64 ports",
        );
    }
    for known in channels {
        if known.index == channel.index && channel.index != Index::Internal {
            let Index::Port(port) = channel.index else { continue };
            let what =
                format!("INDX = {port} of {} belongs to {} (line {}) already", channel.tag, known.tag, known.line);
            return error(line, what, format!("each port of {section} once"));
        }
        if known.element == channel.element {
            let text = known.attributes.is_empty() || channel.attributes.is_empty();
            let twice = channel.attributes.iter().any(|name| known.attributes.contains(name));
            if text || twice {
                let what =
                    format!("{} names the same place on the wire as {} (line {})", channel.tag, known.tag, known.line);
                return error(line, what, "take another name");
            }
        }
    }
    Ok(())
}

/// What the library says; it may quote half of the file.
fn no_xml(problem: &dyn core::fmt::Display) -> String {
    let said = problem.to_string();
    let end = if said.chars().nth(160).is_some() { "…" } else { "" };
    let said: String = said.chars().take(160).map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!("no XML: {said}{end}")
}

/// The beginning of what a file says, for an error.
fn cut(text: &str) -> String {
    text.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::super::layout::layout;
    use super::super::vectors::CONFIG;
    use super::*;

    #[test]
    fn a_configuration_becomes_elements_of_the_wire() {
        let config = parse(&format!("\u{feff}<?xml version=\"1.0\"?>\r\n{CONFIG}")).unwrap();
        assert_eq!((config.ip.as_str(), config.port, config.protocol), ("192.168.1.2", 49152, Transport::Udp));
        assert_eq!((config.sentype.as_str(), config.length_prefix, config.only_send), ("ImFree", false, false));
        assert!(!config.krc2);
        let wire = |channels: &[Channel]| -> Vec<String> {
            let name = |slot: &super::super::layout::Slot| {
                let names: Vec<&str> = slot.fields.iter().map(|(name, _)| name.as_str()).collect();
                format!("{} {}", slot.element, names.join(" "))
            };
            layout(channels).iter().map(name).collect()
        };
        assert_eq!(wire(&config.send), ["RIst X Y Z A B C", "EIPos E1 E2 E3 E4 E5 E6", "Delay D"]);
        assert_eq!(wire(&config.receive), ["EStr ", "Stop ", "RKorr X Y Z A B C", "DiO "]);
        assert_eq!(config.receives("RKorr", "Y").unwrap().index, Index::Port(3));
        assert_eq!(config.receives("Stop", "").unwrap().hold, Some(false));
        assert_eq!(config.receives("RKorr", ""), None);
    }

    #[test]
    fn what_only_a_krc2_reads_is_read() {
        let fields = "<PROTOCOL>tcp</PROTOCOL><PROTCOLLENGTH>On</PROTCOLLENGTH><ONLYSEND>FALSE";
        let config = parse(&CONFIG.replace("<ONLYSEND>FALSE", fields)).unwrap();
        assert_eq!((config.protocol, config.length_prefix, config.krc2), (Transport::Tcp, true, true));
        let tech = r#"<ELEMENT TAG="DEF_Tech.T2" TYPE="DOUBLE" INDX="INTERNAL" UNIT="0x1" />"#;
        let config = parse(&CONFIG.replacen("<RECEIVE><ELEMENTS>", &format!("<RECEIVE><ELEMENTS>{tech}"), 1)).unwrap();
        assert_eq!(config.receive[0].attributes[9], "T210");
        assert!(config.krc2);
    }

    #[test]
    fn every_mistake_names_its_line_and_what_to_do() {
        let cases = [
            (
                r#"INDX="2""#,
                r#"INDX="65""#,
                16,
                "INDX of RKorr.X is '65', outside 1..64; the ETHERNET object has 64 ports",
            ),
            (r#"INDX="2""#, r#"INDX="0""#, 16, "INDX of RKorr.X is '0'"),
            (r#"INDX="2""#, r#"INDX="INTERNAL""#, 16, "INTERNAL is for DEF_ names"),
            (r#"INDX="3""#, r#"INDX="2""#, 17, "INDX = 2 of RKorr.Y belongs to RKorr.X (line 16) already"),
            (r#""RKorr.Y""#, r#""RKorr.X""#, 17, "RKorr.X names the same place on the wire as RKorr.X (line 16)"),
            (r#""RKorr.Y""#, r#""RKorr""#, 17, "RKorr names the same place"),
            (r#""RKorr.Y""#, r#""RKorr.Y.Z""#, 17, "TAG = 'RKorr.Y.Z' is no name"),
            (r#""RKorr.Y""#, r#""IPOC""#, 17, "no element can have this name"),
            (r#""RKorr.Y""#, r#""1st""#, 17, "no element can have this name"),
            (
                r#"TYPE="LONG" INDX="8""#,
                r#"TYPE="INT" INDX="8""#,
                22,
                "TYPE of DiO is 'INT'; write BOOL, STRING, LONG or DOUBLE",
            ),
            (r#"TYPE="LONG" INDX="8""#, r#"INDX="8""#, 22, "TYPE of DiO is 'missing'"),
            (r#"INDX="8" HOLDON="1""#, r#"INDX="8" HOLDON="2""#, 22, "HOLDON of DiO is '2', not 0 or 1"),
            (r#"INDX="8" HOLDON="1""#, r#"INDX="8""#, 22, "DiO has no HOLDON"),
            (
                "DEF_EStr",
                "DEF_Tech.T1",
                14,
                "DEF_Tech.T1 in RECEIVE; generator 1 belongs to RSI and stops it with RSIBad",
            ),
            ("DEF_EStr", "DEF_Tech.T7", 14, "TAG = 'DEF_Tech.T7' is no name"),
            ("DEF_EStr", "DEF_RIst", 14, "DEF_RIst in RECEIVE; only DEF_EStr and DEF_Tech can be taken"),
            (r#"LONG" INDX="INTERNAL""#, r#"LONG" INDX="5""#, 11, "DEF_ names are read inside the controller"),
            ("<PORT>49152", "<PORT>70000", 4, "PORT = '70000' is outside 1..65535"),
            ("<PORT>49152</PORT>", "", 24, "no PORT in CONFIG"),
            ("<SENTYPE>ImFree</SENTYPE>", "", 24, "the controller drops every reply and says nothing"),
            ("<ONLYSEND>FALSE", "<ONLYSEND>no", 6, "ONLYSEND = 'no'; write FALSE or TRUE"),
            ("<ROOT>", "<RSIObjects>", 1, "an object graph (RSIObjects) is another file"),
            ("</SEND>", "</SEN>", 12, "no XML"),
            ("</ROOT>", "", 23, "<ROOT> is never closed"),
            (r#"HOLDON="1" />"#, r#"HOLDON="1" HOLD="1" />"#, 16, "unknown attribute HOLD"),
            ("of the PC !-->", "of the PC", 3, "no XML"),
        ];
        for (from, to, line, what) in cases {
            assert!(CONFIG.contains(from), "{from}");
            let problem = parse(&CONFIG.replacen(from, to, 1)).unwrap_err();
            let said = problem.to_string();
            assert!(said.contains(what), "{to}: {said}");
            assert_eq!(problem.line, line, "{to}: {said}");
        }
        assert_eq!(parse("").unwrap_err().to_string().split(';').next(), Some("line 1: no PORT in CONFIG"));
        assert!(parse(&" ".repeat(300_000)).unwrap_err().what.contains("300000 bytes"));
        assert!(parse(&"<ROOT>".repeat(9)).unwrap_err().what.contains("within each other"));
    }
}
