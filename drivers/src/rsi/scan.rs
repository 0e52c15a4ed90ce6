//! The scanner of the wire: tags, attributes and texts of one document, without a library.
//!
//! A dotted name of the configuration (`GPIO.01`) becomes `<GPIO 01="1"/>`, which is no well-formed XML: attribute names may not
//! begin with a digit there. A strict reader refuses what real controllers send, so this one is lenient where it does no harm:
//! white space, quotes of either kind, comments, a prologue, NUL around the document. It is strict where a mistake could pass as
//! a value. Entities stay as they are written.

use super::malformed::{Malformed, Why};

/// Longest name in bytes.
const NAME_MAX: usize = 64;
/// Most attributes of an element; a configuration can name 64 channels and six function generators with ten parameters each.
const ATTRIBUTES_MAX: usize = 128;

/// Where it stands in a document.
pub(super) struct Scanner<'a> {
    text: &'a str,
    at: usize,
}

/// An opening tag.
pub(super) struct Opening<'a> {
    pub name: &'a str,
    pub attributes: Vec<(String, String)>,
    /// `/>`: there is no closing tag.
    pub closed: bool,
}

impl<'a> Scanner<'a> {
    /// At the beginning of `text`.
    pub fn new(text: &'a str) -> Self {
        Scanner { text, at: 0 }
    }

    /// Byte at which it stands.
    pub fn at(&self) -> usize {
        self.at
    }

    /// This reason, here.
    pub fn fail(&self, why: Why) -> Malformed {
        Malformed { at: self.at, why }
    }

    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or_default()
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn takes(&mut self, word: &str) -> bool {
        let found = self.rest().starts_with(word);
        if found {
            self.at += word.len();
        }
        found
    }

    /// Past white space; with `padding`, also past NUL and the byte-order mark.
    fn skip_blank(&mut self, padding: bool) {
        let rest = self.rest();
        let blank = |c: char| c.is_ascii_whitespace() || (padding && matches!(c, '\0' | '\u{feff}'));
        self.at += rest.len() - rest.trim_start_matches(blank).len();
    }

    /// Past white space and comments between elements.
    pub fn skip_gap(&mut self) -> Result<(), Malformed> {
        loop {
            self.skip_blank(false);
            if !self.skip_past("<!--", "-->")? {
                return Ok(());
            }
        }
    }

    /// Past padding, a prologue and comments before and after the document.
    pub fn skip_outside(&mut self) -> Result<(), Malformed> {
        loop {
            self.skip_blank(true);
            if !self.skip_past("<!--", "-->")? && !self.skip_past("<?", "?>")? {
                return Ok(());
            }
        }
    }

    fn skip_past(&mut self, opening: &str, closing: &str) -> Result<bool, Malformed> {
        if !self.rest().starts_with(opening) {
            return Ok(false);
        }
        let Some(length) = self.rest()[opening.len()..].find(closing) else {
            return Err(self.fail(Why::Truncated));
        };
        self.at += opening.len() + length + closing.len();
        Ok(true)
    }

    /// Whether nothing is left.
    pub fn ended(&self) -> bool {
        self.at >= self.text.len()
    }

    /// Whether a closing tag comes next.
    pub fn at_close(&self) -> bool {
        self.rest().starts_with("</")
    }

    fn name(&mut self) -> Result<&'a str, Malformed> {
        let rest = self.rest();
        let part = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.:".contains(&byte);
        let length = rest.bytes().position(|byte| !part(byte)).unwrap_or(rest.len());
        if length == rest.len() {
            return Err(self.fail(Why::Truncated));
        }
        if length == 0 || length > NAME_MAX {
            return Err(self.fail(Why::BadName));
        }
        self.at += length;
        Ok(&rest[..length])
    }

    /// An opening tag.
    pub fn opening(&mut self) -> Result<Opening<'a>, Malformed> {
        if !self.takes("<") {
            return Err(self.fail(if self.ended() { Why::Truncated } else { Why::StrayText }));
        }
        let name = self.name()?;
        let mut attributes: Vec<(String, String)> = Vec::new();
        loop {
            self.skip_blank(false);
            if self.takes("/>") {
                return Ok(Opening { name, attributes, closed: true });
            }
            if self.takes(">") {
                return Ok(Opening { name, attributes, closed: false });
            }
            match self.peek() {
                None => return Err(self.fail(Why::Truncated)),
                Some(b'/' | b'<' | b'"' | b'\'' | b'=') => return Err(self.fail(Why::BadTag)),
                Some(_) => {}
            }
            let begin = self.at;
            let (key, value) = self.attribute()?;
            if attributes.iter().any(|(known, _)| known == key) {
                return Err(Malformed { at: begin, why: Why::AttributeTwice });
            }
            if attributes.len() == ATTRIBUTES_MAX {
                return Err(Malformed { at: begin, why: Why::TooManyAttributes });
            }
            attributes.push((key.to_owned(), value.to_owned()));
        }
    }

    fn attribute(&mut self) -> Result<(&'a str, &'a str), Malformed> {
        let key = self.name()?;
        self.skip_blank(false);
        if !self.takes("=") {
            return Err(self.fail(if self.ended() { Why::Truncated } else { Why::BadAttribute }));
        }
        self.skip_blank(false);
        let quote = match self.peek() {
            Some(b'"') => '"',
            Some(b'\'') => '\'',
            None => return Err(self.fail(Why::Truncated)),
            Some(_) => return Err(self.fail(Why::BadAttribute)),
        };
        self.at += 1;
        let rest = self.rest();
        let length = rest.find(quote).unwrap_or(rest.len());
        if let Some(bad) = rest[..length].find(|c: char| c == '<' || c.is_control()) {
            return Err(Malformed { at: self.at + bad, why: Why::BadValue });
        }
        if length == rest.len() {
            return Err(Malformed { at: self.text.len(), why: Why::Truncated });
        }
        self.at += length + 1;
        Ok((key, &rest[..length]))
    }

    /// The text up to the next tag.
    pub fn text(&mut self) -> Result<&'a str, Malformed> {
        let rest = self.rest();
        let length = rest.find('<').unwrap_or(rest.len());
        if let Some(bad) = rest[..length].find(|c: char| c.is_control() && !c.is_ascii_whitespace()) {
            return Err(Malformed { at: self.at + bad, why: Why::BadValue });
        }
        if length == rest.len() {
            return Err(Malformed { at: self.text.len(), why: Why::Truncated });
        }
        self.at += length;
        Ok(&rest[..length])
    }

    /// The closing tag of `name`.
    pub fn closing(&mut self, name: &str) -> Result<(), Malformed> {
        let begin = self.at;
        if !self.takes("</") {
            let why = if self.rest().len() < 2 { Why::Truncated } else { Why::Nested };
            return Err(self.fail(why));
        }
        if self.name()? != name {
            return Err(Malformed { at: begin, why: Why::WrongClose });
        }
        self.skip_blank(false);
        if !self.takes(">") {
            return Err(self.fail(if self.ended() { Why::Truncated } else { Why::BadTag }));
        }
        Ok(())
    }
}
