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
            if opening.name == "Dat" && !opening.closed {
                if self.form == Form::Dat {
                    return Err(Malformed { at, why: if inside { Why::Nested } else { Why::DatTwice } });
                }
                self.form = Form::Dat;
                self.task = opening.attributes;
                inside = true;
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
