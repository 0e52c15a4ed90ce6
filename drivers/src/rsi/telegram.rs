//! One document of the exchange, either direction.
//!
//! ```text
//! document := '<Rob' (Type|TYPE)'="KUKA"' '>' [ '<Dat TaskType="b">' ] element* [ '</Dat>' ] '</Rob>'     or the same with Sen
//! element  := '<'TAG ( ATTRIBUTE'="'value'"' )+ '/>'  |  '<'TAG'>' text '</'TAG'>'
//! ```
//! Values stay the text that they are on the wire, and elements keep their order, so that a document that nobody touched is
//! encoded as it was, but for white space and the kind of quotes. Elements that no configuration names are kept too.
//!
//! | element | meaning |
//! |---|---|
//! | `RIst` X..C | measured pose of the tool in BASE, mm and degrees |
//! | `RSol` X..C | set pose; it does not move while corrections run |
//! | `EIPos` E1..E6 | measured external axes, degrees or mm |
//! | `Delay` D | count of late or invalid replies |
//! | `IPOC` | time stamp of the controller in ms, and the key that a reply echoes; last, or in the middle (`Dat` form of KRC2) |
//!
//! Source: reference/PROTOCOLS.md, sections 1.2 and 1.3. Not covered: entities (`&amp;`) stay as they are written.

use super::malformed::{Malformed, Why};
use super::number::{BadNumber, NumberWhy, parse};
use super::scan::{Opening, Scanner};

/// Longest document, in bytes.
pub(super) const DOCUMENT_MAX: usize = 65_536;
/// Most elements: 64 channels and the internal ones leave plenty of room.
const ELEMENTS_MAX: usize = 256;

/// Attributes of a pose.
pub const POSE: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
/// Attributes of the external axes.
pub const EXTERNAL: [&str; 6] = ["E1", "E2", "E3", "E4", "E5", "E6"];

/// Which way a document goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Root {
    /// From the robot controller.
    Rob,
    /// To the robot controller.
    Sen,
}

/// How the elements are wrapped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Directly in the root.
    Flat,
    /// In `<Dat TaskType="b">`, as a KRC2 may send them.
    Dat,
}

/// One element.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Element {
    /// Its name.
    pub tag: String,
    /// Names and values in the order of the wire.
    pub attributes: Vec<(String, String)>,
    /// Its text; empty where it has attributes only.
    pub text: String,
}

/// One document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Telegram {
    /// Which way it goes.
    pub root: Root,
    /// `Type` of the root; empty when there is none.
    pub kind: String,
    /// It is spelled `TYPE`, as some simulators do.
    pub upper_type: bool,
    /// Other attributes of the root, such as a schema.
    pub extra: Vec<(String, String)>,
    /// How the elements are wrapped.
    pub form: Form,
    /// Attributes of `Dat`.
    pub task: Vec<(String, String)>,
    /// Elements in the order of the wire, IPOC too.
    pub elements: Vec<Element>,
}

/// Time stamp of the controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ipoc {
    /// Its digits, with the zeros before them: what a reply echoes.
    pub text: String,
    /// Its value, ms on a real controller.
    pub value: u64,
}

impl Root {
    fn tag(self) -> &'static str {
        match self {
            Root::Rob => "Rob",
            Root::Sen => "Sen",
        }
    }
}

impl Element {
    /// An element that holds a text.
    pub fn text(tag: &str, text: &str) -> Self {
        Element { tag: tag.to_owned(), attributes: Vec::new(), text: text.to_owned() }
    }

    /// An element that holds attributes.
    pub fn attributes<'a>(tag: &str, attributes: impl IntoIterator<Item = (&'a str, String)>) -> Self {
        let attributes = attributes.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        Element { tag: tag.to_owned(), attributes, text: String::new() }
    }

    /// The value of an attribute; of the text, when `attribute` is empty.
    pub fn value(&self, attribute: &str) -> Option<&str> {
        if attribute.is_empty() {
            return Some(&self.text);
        }
        self.attributes.iter().find(|(key, _)| key == attribute).map(|(_, value)| value.as_str())
    }
}

impl Telegram {
    /// An empty document.
    pub fn new(root: Root, kind: &str, form: Form) -> Self {
        let task = if form == Form::Dat { vec![("TaskType".to_owned(), "b".to_owned())] } else { Vec::new() };
        let kind = kind.to_owned();
        Telegram { root, kind, upper_type: false, extra: Vec::new(), form, task, elements: Vec::new() }
    }

    /// Reads one document; NUL and white space around it are allowed.
    pub fn decode(bytes: &[u8]) -> Result<Telegram, Malformed> {
        if bytes.len() > DOCUMENT_MAX {
            return Err(Malformed { at: DOCUMENT_MAX, why: Why::TooLong });
        }
        let text =
            core::str::from_utf8(bytes).map_err(|error| Malformed { at: error.valid_up_to(), why: Why::NotUtf8 })?;
        let mut scanner = Scanner::new(text);
        scanner.skip_outside()?;
        if scanner.ended() {
            return Err(scanner.fail(Why::Empty));
        }
        let begin = scanner.at();
        let opening = scanner.opening().map_err(|error| match error.why {
            Why::StrayText | Why::BadName => Malformed { at: begin, why: Why::NoRoot },
            _ => error,
        })?;
        let root = match opening.name {
            "Rob" => Root::Rob,
            "Sen" => Root::Sen,
            _ => return Err(Malformed { at: begin, why: Why::NoRoot }),
        };
        let mut telegram = Telegram::from_root(root, &opening);
        if !opening.closed {
            telegram.read_elements(&mut scanner)?;
            scanner.closing(root.tag())?;
        }
        scanner.skip_outside()?;
        if scanner.ended() { Ok(telegram) } else { Err(scanner.fail(Why::Trailing)) }
    }

    fn from_root(root: Root, opening: &Opening<'_>) -> Telegram {
        let is_kind = |key: &str| key == "Type" || key == "TYPE";
        let mut telegram = Telegram::new(root, "", Form::Flat);
        for (key, value) in &opening.attributes {
            if is_kind(key) && telegram.kind.is_empty() {
                telegram.kind.clone_from(value);
                telegram.upper_type = key == "TYPE";
            } else if !is_kind(key) {
                telegram.extra.push((key.clone(), value.clone()));
            }
        }
        telegram
    }

    /// The elements of the root, up to its closing tag.
    fn read_elements(&mut self, scanner: &mut Scanner<'_>) -> Result<(), Malformed> {
        let mut inside = false;
        loop {
            scanner.skip_gap()?;
            if scanner.at_close() {
                if !inside {
                    return Ok(());
                }
                scanner.closing("Dat")?;
                inside = false;
                continue;
            }
            let at = scanner.at();
            let opening = scanner.opening()?;
            if opening.name == "Dat" {
                if self.form == Form::Dat {
                    return Err(Malformed { at, why: if inside { Why::Nested } else { Why::DatTwice } });
                }
                self.form = Form::Dat;
                self.task = opening.attributes;
                inside = !opening.closed;
                continue;
            }
            self.read_element(scanner, opening, at)?;
        }
    }

    fn read_element(&mut self, scanner: &mut Scanner<'_>, opening: Opening<'_>, at: usize) -> Result<(), Malformed> {
        if self.elements.len() == ELEMENTS_MAX {
            return Err(Malformed { at, why: Why::TooManyElements });
        }
        if opening.name == "IPOC" && self.element("IPOC").is_some() {
            return Err(Malformed { at, why: Why::IpocTwice });
        }
        let mut text = "";
        if !opening.closed {
            text = scanner.text()?;
            scanner.closing(opening.name)?;
        }
        let tag = opening.name.to_owned();
        self.elements.push(Element { tag, attributes: opening.attributes, text: text.to_owned() });
        Ok(())
    }

    /// Appends the document in one line, without white space between elements.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let kind = if self.upper_type { "TYPE" } else { "Type" };
        put(out, &["<", self.root.tag()]);
        if !self.kind.is_empty() {
            put_attribute(out, kind, &self.kind);
        }
        put_attributes(out, &self.extra);
        put(out, &[">"]);
        if self.form == Form::Dat {
            put(out, &["<Dat"]);
            put_attributes(out, &self.task);
            put(out, &[">"]);
        }
        for element in &self.elements {
            put(out, &["<", &element.tag]);
            put_attributes(out, &element.attributes);
            if element.text.is_empty() && !element.attributes.is_empty() {
                put(out, &["/>"]);
            } else {
                put(out, &[">", &element.text, "</", &element.tag, ">"]);
            }
        }
        if self.form == Form::Dat {
            put(out, &["</Dat>"]);
        }
        put(out, &["</", self.root.tag(), ">"]);
    }

    /// The time stamp; `None` when there is none, or none that is a whole number.
    pub fn ipoc(&self) -> Option<Ipoc> {
        let text = self.element("IPOC")?.text.trim_ascii();
        if text.is_empty() || !text.bytes().all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        Some(Ipoc { text: text.to_owned(), value: text.parse().ok()? })
    }

    /// The first element of this name.
    pub fn element(&self, tag: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.tag == tag)
    }

    /// The number in an attribute (in the text, when `attribute` is empty); `None` when the element is missing.
    pub fn number(&self, tag: &str, attribute: &str) -> Option<Result<f64, BadNumber>> {
        let element = self.element(tag)?;
        let Some(text) = element.value(attribute) else {
            return Some(Err(BadNumber::new(tag, attribute, "", NumberWhy::Absent)));
        };
        Some(parse(text).map_err(|why| BadNumber::new(tag, attribute, text, why)))
    }

    /// Six numbers of one element; `None` when the element is missing.
    pub fn six(&self, tag: &str, attributes: [&str; 6]) -> Option<Result<[f64; 6], BadNumber>> {
        let mut values = [0.0; 6];
        for (value, attribute) in values.iter_mut().zip(attributes) {
            match self.number(tag, attribute)? {
                Ok(number) => *value = number,
                Err(error) => return Some(Err(error)),
            }
        }
        Some(Ok(values))
    }
}

fn put(out: &mut Vec<u8>, parts: &[&str]) {
    for part in parts {
        out.extend_from_slice(part.as_bytes());
    }
}

fn put_attributes(out: &mut Vec<u8>, attributes: &[(String, String)]) {
    for (key, value) in attributes {
        put_attribute(out, key, value);
    }
}

/// A value that came in single quotes may hold a double one.
fn put_attribute(out: &mut Vec<u8>, key: &str, value: &str) {
    let quote = if value.contains('"') { "'" } else { "\"" };
    put(out, &[" ", key, "=", quote, value, quote]);
}

#[cfg(test)]
mod tests {
    use super::super::vectors::{GPIO, HELLO_EMPTY, KRC2_DAT, RICH, SEN_DAT, SEN_MANUAL, SPACED, TELEGRAMS, UPPER};
    use super::*;

    fn decoded(text: &str) -> Telegram {
        Telegram::decode(text.as_bytes()).unwrap()
    }

    fn encoded(telegram: &Telegram) -> String {
        let mut out = Vec::new();
        telegram.encode(&mut out);
        String::from_utf8(out).unwrap()
    }

    /// Everything between quotes, and everything between tags that is not blank.
    fn values(text: &str) -> Vec<&str> {
        let between_tags = text.split('<').filter_map(|tag| tag.split_once('>')).map(|(_, text)| text.trim());
        text.split('"').skip(1).step_by(2).chain(between_tags.filter(|text| !text.is_empty())).collect()
    }

    #[test]
    fn every_quoted_telegram_is_read_and_written_as_it_was() {
        for (name, text, ipoc) in TELEGRAMS {
            let telegram = decoded(text);
            assert_eq!(telegram.ipoc().map(|ipoc| ipoc.text).as_deref(), Some(ipoc), "{name}");
            let once = encoded(&telegram);
            assert_eq!(decoded(&once), telegram, "{name}");
            assert_eq!(encoded(&decoded(&once)), once, "{name}");
            assert_eq!(values(&once), values(text), "{name}");
        }
    }

    #[test]
    fn a_rail_frame_of_a_krc2_keeps_its_order_and_its_numbers() {
        let telegram = decoded(KRC2_DAT);
        assert_eq!((telegram.root, telegram.kind.as_str(), telegram.form), (Root::Rob, "KUKA", Form::Dat));
        assert_eq!(telegram.elements.iter().position(|element| element.tag == "IPOC"), Some(9));
        assert_eq!(telegram.elements.len(), 17);
        let pose = telegram.six("RIst", POSE).unwrap().unwrap();
        assert_eq!(
            pose.map(f64::to_bits),
            [93.9531, -347.9674, 1844.9703, -126.946, 24.9226, -28.2871].map(f64::to_bits)
        );
        let external = telegram.six("EIPos", EXTERNAL).unwrap().unwrap();
        assert_eq!(external[0].to_bits(), 226_966.932_6_f64.to_bits());
        assert_eq!(telegram.element("ComStatus").unwrap().text, "continuous");
        assert_eq!(telegram.element("Tech").unwrap().value("p8x3"), Some("0.0000"));
        assert_eq!(telegram.element("Tick").unwrap().text, "0000000000000000");
    }

    #[test]
    fn foreign_forms_are_read() {
        assert!(decoded(UPPER).upper_type);
        assert!(encoded(&decoded(UPPER)).starts_with("<Rob TYPE=\"KUKA\">"));
        assert_eq!(decoded(GPIO).number("GPIO", "01"), Some(Ok(1.0)));
        assert_eq!(decoded(SPACED).number("Run", ""), Some(Ok(1.0)));
        assert_eq!(decoded(SPACED).number("Delay", "D"), Some(Ok(0.0)));
        assert_eq!(decoded(SPACED).ipoc(), Some(Ipoc { text: "0000000000".into(), value: 0 }));
        assert_eq!(decoded(RICH).number("OvPro", "R"), Some(Ok(99.0)));
        assert_eq!(decoded(SEN_MANUAL).ipoc().unwrap().value, 123_645_634_563);
        assert_eq!(decoded(SEN_DAT).extra.len(), 2);
        assert_eq!(decoded(HELLO_EMPTY).ipoc(), None);
        // A buffer of 2048 bytes, padded; a byte-order mark; a prologue; a comment; single quotes.
        let padded = format!("\u{feff}<?xml version=\"1.0\"?><!-- {GPIO} -->{}\0\0\0\0", GPIO.replace('"', "'"));
        assert_eq!(decoded(&padded), decoded(GPIO));
    }

    #[test]
    fn a_document_made_here_is_what_a_controller_wants() {
        let mut telegram = Telegram::new(Root::Sen, "ImFree", Form::Flat);
        telegram.elements.push(Element::text("Stop", "0"));
        telegram.elements.push(Element::attributes("GPIO", [("01", "1".to_owned())]));
        telegram.elements.push(Element::text("IPOC", "0012"));
        assert_eq!(encoded(&telegram), r#"<Sen Type="ImFree"><Stop>0</Stop><GPIO 01="1"/><IPOC>0012</IPOC></Sen>"#);
        let dat = encoded(&Telegram::new(Root::Sen, "CoRob", Form::Dat));
        assert_eq!(dat, r#"<Sen Type="CoRob"><Dat TaskType="b"></Dat></Sen>"#);
        // Closed at once, and its elements behind it: written once more it stays what it is.
        let once = encoded(&Telegram::decode(b"<Rob TYPE=\"KUKA\"><Dat /><IPOC>435</IPOC></Rob>").unwrap());
        assert_eq!(once, encoded(&Telegram::decode(once.as_bytes()).unwrap()));
    }

    #[test]
    fn every_mistake_has_a_name_and_a_place() {
        let many = |count: usize| (0..count).map(|i| format!("<E{i} X=\"1\"/>")).collect::<String>();
        let attributes = |count: usize| (0..count).map(|i| format!(" A{i}=\"1\"")).collect::<String>();
        let long = "x".repeat(65);
        let cases: Vec<(String, Why, usize)> = [
            ("", Why::Empty, 0),
            (" \0\r\n\0", Why::Empty, 5),
            ("hello", Why::NoRoot, 0),
            (" <ROOT/>", Why::NoRoot, 1),
            ("<rob Type=\"KUKA\"></rob>", Why::NoRoot, 0),
            ("<Rob Type=\"KUKA\"><IPOC>12", Why::Truncated, 25),
            ("<Rob Type=\"KUKA\"><IPOC>12</IPOC>", Why::Truncated, 32),
            ("<Rob Type=\"KU", Why::Truncated, 13),
            ("<Rob><RIst X=1/></Rob>", Why::BadAttribute, 13),
            ("<Rob><RIst X/></Rob>", Why::BadAttribute, 12),
            ("<Rob><RIst X=\"1<2\"/></Rob>", Why::BadValue, 15),
            ("<Rob><RIst X=\"1\0\"/></Rob>", Why::BadValue, 15),
            ("<Rob><A>1\u{7f}</A></Rob>", Why::BadValue, 9),
            ("<Rob><RIst X=\"1\" X=\"2\"/></Rob>", Why::AttributeTwice, 17),
            ("<Rob><RIst X=\"1\" / ></Rob>", Why::BadTag, 17),
            ("<Rob><A>1</B></Rob>", Why::WrongClose, 9),
            ("<Rob><A>1</A></Sen>", Why::WrongClose, 13),
            ("<Rob><A><B>1</B></A></Rob>", Why::Nested, 8),
            ("<Rob><Dat><Dat></Dat></Dat></Rob>", Why::Nested, 10),
            ("<Rob><Dat></Dat><Dat></Dat></Rob>", Why::DatTwice, 16),
            ("<Rob><Dat/><Dat/></Rob>", Why::DatTwice, 11),
            ("<Rob>1<A/></Rob>", Why::StrayText, 5),
            ("<Rob><A/>,</Rob>", Why::StrayText, 9),
            ("<Rob><\u{e4}/></Rob>", Why::BadName, 6),
            ("<Rob><IPOC>1</IPOC><IPOC>2</IPOC></Rob>", Why::IpocTwice, 19),
            ("<Rob></Rob><Rob></Rob>", Why::Trailing, 11),
            ("<Rob></Rob>x", Why::Trailing, 11),
        ]
        .map(|(text, why, at)| (text.to_owned(), why, at))
        .into_iter()
        .chain([
            (format!("<Rob><{long}/></Rob>"), Why::BadName, 6),
            (format!("<Rob>{}</Rob>", many(256)), Why::Empty, 0),
            (format!("<Rob>{}</Rob>", many(257)), Why::TooManyElements, 5 + many(256).len()),
            (format!("<Rob><A{}/></Rob>", attributes(129)), Why::TooManyAttributes, 8 + attributes(128).len()),
            (format!("<Rob>{}</Rob>", " ".repeat(65_526)), Why::TooLong, 65_536),
        ])
        .collect();
        for (text, why, at) in cases {
            let shown: String = text.chars().take(60).collect();
            match Telegram::decode(text.as_bytes()) {
                // As many elements as allowed.
                Ok(telegram) => assert_eq!((telegram.elements.len(), why), (256, Why::Empty), "{shown}"),
                Err(problem) => assert_eq!(problem, Malformed { at, why }, "{shown}"),
            }
        }
        assert_eq!(Telegram::decode(b"<Rob>\xff</Rob>"), Err(Malformed { at: 5, why: Why::NotUtf8 }));
    }

    #[test]
    fn a_stamp_is_a_whole_number() {
        for (text, value) in [("0", Some(0)), (" 12\n", Some(12)), ("18446744073709551615", Some(u64::MAX))] {
            assert_eq!(decoded(&format!("<Rob><IPOC>{text}</IPOC></Rob>")).ipoc().map(|ipoc| ipoc.value), value);
        }
        for text in ["", "-1", "1.0", "18446744073709551616", "12a", "+1"] {
            assert_eq!(decoded(&format!("<Rob><IPOC>{text}</IPOC></Rob>")).ipoc(), None, "{text}");
        }
    }

    #[test]
    fn a_value_that_is_no_number_says_where_it_stands() {
        let telegram = decoded(r#"<Rob><RIst X="1,5" Y="2"/></Rob>"#);
        let problem = telegram.six("RIst", POSE).unwrap().unwrap_err();
        assert_eq!(problem.to_string(), "RIst.X = '1,5': a comma; numbers on this wire have a point");
        assert_eq!(telegram.number("RIst", "Z").unwrap().unwrap_err().why, NumberWhy::Absent);
        assert_eq!(telegram.number("RSol", "X"), None);
    }
}
