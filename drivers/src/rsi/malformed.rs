//! What is wrong with bytes that are no document, by name, so that it can be counted.

use core::fmt;

/// Bytes that are no document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Malformed {
    /// Byte at which it shows, from the beginning of what was looked at.
    pub at: usize,
    /// What is wrong.
    pub why: Why,
}

/// Why bytes are no document.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    /// Nothing but white space and NUL.
    Empty,
    /// Longer than a document may be.
    TooLong,
    /// A byte sequence that is no UTF-8.
    NotUtf8,
    /// It does not begin with `<Rob` or `<Sen`.
    NoRoot,
    /// It ends before its closing tag.
    Truncated,
    /// A tag or attribute without a name, or with a name longer than 64 bytes.
    BadName,
    /// A tag that is not closed by `>` or `/>`.
    BadTag,
    /// An attribute without `="…"`.
    BadAttribute,
    /// `<`, or a control character, inside a value or a text.
    BadValue,
    /// The same attribute twice in one element.
    AttributeTwice,
    /// A closing tag of another name than the opening one.
    WrongClose,
    /// An element within an element other than `Dat`.
    Nested,
    /// Text between elements.
    StrayText,
    /// More elements than any configuration can name.
    TooManyElements,
    /// More attributes than any configuration can name.
    TooManyAttributes,
    /// A second `Dat`.
    DatTwice,
    /// A second `IPOC`.
    IpocTwice,
    /// More bytes after the closing tag of the root.
    Trailing,
    /// Bytes between two documents of a stream.
    Junk,
    /// A length before the document that is not its length.
    WrongLength,
    /// Bytes came faster than they were taken; the oldest are lost.
    Overrun,
    /// A sound document of the other direction.
    WrongDirection,
    /// No IPOC, so that there is nothing to answer.
    IpocMissing,
    /// An IPOC that is no whole number below 2^64.
    IpocNotANumber,
}

impl Why {
    /// All of them.
    pub const ALL: [Why; 24] = [
        Why::Empty,
        Why::TooLong,
        Why::NotUtf8,
        Why::NoRoot,
        Why::Truncated,
        Why::BadName,
        Why::BadTag,
        Why::BadAttribute,
        Why::BadValue,
        Why::AttributeTwice,
        Why::WrongClose,
        Why::Nested,
        Why::StrayText,
        Why::TooManyElements,
        Why::TooManyAttributes,
        Why::DatTwice,
        Why::IpocTwice,
        Why::Trailing,
        Why::Junk,
        Why::WrongLength,
        Why::Overrun,
        Why::WrongDirection,
        Why::IpocMissing,
        Why::IpocNotANumber,
    ];

    /// Its name in counts and reports.
    pub fn id(&self) -> &'static str {
        match self {
            Why::Empty => "empty",
            Why::TooLong => "too-long",
            Why::NotUtf8 => "not-utf8",
            Why::NoRoot => "no-root",
            Why::Truncated => "truncated",
            Why::BadName => "bad-name",
            Why::BadTag => "bad-tag",
            Why::BadAttribute => "bad-attribute",
            Why::BadValue => "bad-value",
            Why::AttributeTwice => "attribute-twice",
            Why::WrongClose => "wrong-close",
            Why::Nested => "nested",
            Why::StrayText => "stray-text",
            Why::TooManyElements => "too-many-elements",
            Why::TooManyAttributes => "too-many-attributes",
            Why::DatTwice => "dat-twice",
            Why::IpocTwice => "ipoc-twice",
            Why::Trailing => "trailing",
            Why::Junk => "junk",
            Why::WrongLength => "wrong-length",
            Why::Overrun => "overrun",
            Why::WrongDirection => "wrong-direction",
            Why::IpocMissing => "ipoc-missing",
            Why::IpocNotANumber => "ipoc-not-a-number",
        }
    }
}

impl fmt::Display for Why {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Why::Empty => "nothing but white space",
            Why::TooLong => "longer than 65536 bytes",
            Why::NotUtf8 => "bytes that are no UTF-8",
            Why::NoRoot => "no <Rob or <Sen where a document should begin",
            Why::Truncated => "it ends before its closing tag",
            Why::BadName => "no name, or a name longer than 64 bytes",
            Why::BadTag => "a tag that neither > nor /> closes",
            Why::BadAttribute => "an attribute without =\"…\"",
            Why::BadValue => "< or a control character inside a value",
            Why::AttributeTwice => "an attribute that the element already has",
            Why::WrongClose => "a closing tag of another name than the opening one",
            Why::Nested => "an element within an element other than Dat",
            Why::StrayText => "text between elements",
            Why::TooManyElements => "more than 256 elements",
            Why::TooManyAttributes => "more than 128 attributes in one element",
            Why::DatTwice => "a second <Dat>",
            Why::IpocTwice => "a second <IPOC>",
            Why::Trailing => "more bytes after the closing tag",
            Why::Junk => "bytes between two documents",
            Why::WrongLength => "a length before the document that is not its length",
            Why::Overrun => "bytes came faster than they were taken, and the oldest are lost",
            Why::WrongDirection => "a <Sen> where a <Rob> should come, or the other way round",
            Why::IpocMissing => "no <IPOC>, so that there is nothing to answer",
            Why::IpocNotANumber => "an <IPOC> that is no whole number below 2^64",
        })
    }
}

impl fmt::Display for Malformed {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "at byte {}: {}", self.at, self.why)
    }
}

impl core::error::Error for Malformed {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_has_a_name_of_its_own() {
        let mut names: Vec<&str> = Why::ALL.iter().map(Why::id).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Why::ALL.len());
        assert!(
            names.iter().all(|name| name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-'))
        );
    }
}
