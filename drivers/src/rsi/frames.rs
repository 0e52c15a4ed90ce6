//! Cuts a stream, or a datagram, into documents.
//!
//! Over TCP (KRC2) a document may come in pieces, two may come at once, and whole buffers may be padded with NUL. The closing
//! tag of the root delimits them. With `PROTCOLLENGTH On` a length stands before each document; which form it has is documented
//! nowhere, so every plausible one is read, checked against the document, and used for the answers. It may count white space and
//! NUL after the document too: a KRC2 ends its telegrams with a new line, and others fill whole buffers.
//!
//! | limit | bytes |
//! |---|---|
//! | a document | 65536; a longer one is dropped |
//! | what waits here | 131072; what is older is dropped |

use super::malformed::{Malformed, Why};
use super::telegram::DOCUMENT_MAX;

/// Most bytes that wait.
const WAITING_MAX: usize = 2 * DOCUMENT_MAX;
/// Longest length: the digits of 65536 and a separator.
const PREFIX_MAX: usize = 8;
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();
const STARTS: [&[u8]; 2] = [b"<Rob", b"<Sen"];
const ENDS: [&[u8]; 2] = [b"</Rob", b"</Sen"];

/// Form of the length before a document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prefix {
    /// None.
    None,
    /// Four bytes, least significant first.
    Little32,
    /// Four bytes, most significant first.
    Big32,
    /// Two bytes, least significant first.
    Little16,
    /// Two bytes, most significant first.
    Big16,
    /// Decimal digits.
    Digits,
}

/// A stream in the making.
#[derive(Debug, Clone)]
pub struct Frames {
    waiting: Vec<u8>,
    /// Bytes that were dropped because nobody took them.
    lost: bool,
    /// No closing tag before here.
    searched: usize,
    expects_prefix: bool,
    prefix: Prefix,
    /// What stood before the document at the front was reported already.
    reported: bool,
    /// Bytes after the document at the front that its length counts.
    behind: usize,
    /// Since the last document, something that is none was dropped and reported.
    skips: bool,
}

impl Default for Frames {
    fn default() -> Self {
        Frames::new(false)
    }
}

impl Frames {
    /// A stream; with `length_prefix`, a length stands before each document.
    pub fn new(length_prefix: bool) -> Self {
        let prefix = if length_prefix { Prefix::Little32 } else { Prefix::None };
        Frames {
            waiting: Vec::new(),
            lost: false,
            searched: 0,
            expects_prefix: length_prefix,
            prefix,
            reported: false,
            behind: 0,
            skips: false,
        }
    }

    /// Takes the next bytes of the stream.
    pub fn push(&mut self, bytes: &[u8]) {
        let bytes = &bytes[bytes.len().saturating_sub(WAITING_MAX)..];
        let excess = (self.waiting.len() + bytes.len()).saturating_sub(WAITING_MAX);
        if excess > 0 {
            self.lost = true;
            self.reported = false;
            self.drop_front(excess);
        }
        self.waiting.extend_from_slice(bytes);
    }

    /// Takes the next bytes and gives all documents that are whole now, or what was in their place.
    pub fn documents(&mut self, bytes: &[u8]) -> Vec<Result<Vec<u8>, Malformed>> {
        self.push(bytes);
        let mut found: Vec<_> = core::iter::from_fn(|| self.next()).collect();
        found.extend(self.junk().map(Err));
        found
    }

    /// Bytes that wait for the rest of their document.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Form of the length, as seen so far; four bytes, least significant first, until one was seen.
    pub fn prefix(&self) -> Prefix {
        self.prefix
    }

    /// A document as it goes onto this stream.
    pub fn wrap(&self, document: &[u8]) -> Vec<u8> {
        let mut out = self.prefix.bytes(document.len());
        out.extend_from_slice(document);
        out
    }

    /// The next document, or what was in its place; `None`: more bytes are needed.
    #[expect(clippy::should_implement_trait, reason = "a stream has no end, so that it is no iterator")]
    pub fn next(&mut self) -> Option<Result<Vec<u8>, Malformed>> {
        if core::mem::take(&mut self.lost) {
            return Some(Err(Malformed { at: 0, why: Why::Overrun }));
        }
        let Some(end) = self.find_end() else {
            return self.too_long().map(Err);
        };
        let Some(start) = find_last(&self.waiting[..end], &STARTS) else {
            self.drop_front(end);
            return Some(Err(Malformed { at: 0, why: Why::NoRoot }));
        };
        if let Some(cut) = find_first(&self.waiting[..start], &STARTS) {
            // The length of the next document stands before it, and stays.
            let prefix = if self.expects_prefix { PREFIX_MAX } else { 0 };
            self.drop_front(start.saturating_sub(prefix).max(cut + STARTS[0].len()));
            return Some(Err(Malformed { at: start - cut, why: Why::Truncated }));
        }
        if !core::mem::take(&mut self.reported)
            && let Some(problem) = self.before(start, end)
        {
            self.drop_front(start);
            self.reported = true;
            return Some(Err(problem));
        }
        let document = self.waiting[start..end].to_vec();
        let behind = core::mem::take(&mut self.behind);
        self.drop_front(end + behind);
        self.skips = false;
        let problem = Malformed { at: DOCUMENT_MAX, why: Why::TooLong };
        Some(if document.len() > DOCUMENT_MAX { Err(problem) } else { Ok(document) })
    }

    fn drop_front(&mut self, count: usize) {
        self.waiting.drain(..count.min(self.waiting.len()));
        self.searched = self.searched.saturating_sub(count);
    }

    /// One past the closing tag of the first document.
    fn find_end(&mut self) -> Option<usize> {
        let mut from = self.searched;
        while let Some(found) = find_first(&self.waiting[from..], &ENDS).map(|at| from + at) {
            let after = found + ENDS[0].len();
            let blank = self.waiting[after..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
            match self.waiting.get(after + blank) {
                Some(b'>') => return Some(after + blank + 1),
                Some(_) => from = after,
                None => {
                    self.searched = found;
                    return None;
                }
            }
        }
        self.searched = from.max((self.waiting.len() + 1).saturating_sub(ENDS[0].len()));
        None
    }

    /// Forgets a document that has grown too long, up to the next beginning.
    fn too_long(&mut self) -> Option<Malformed> {
        let start = find_first(&self.waiting, &STARTS).unwrap_or(0);
        if self.waiting.len() - start <= DOCUMENT_MAX {
            return None;
        }
        let padding = self.waiting.iter().all(|byte| *byte == 0 || byte.is_ascii_whitespace());
        let next = find_first(&self.waiting[start + 1..], &STARTS).map_or(self.waiting.len(), |at| start + 1 + at);
        self.drop_front(next);
        (!padding).then_some(Malformed { at: DOCUMENT_MAX, why: Why::TooLong })
    }

    /// Drops what no document begins with: whoever speaks another language may never end one. It is said once.
    fn junk(&mut self) -> Option<Malformed> {
        let is_padding = |byte: &u8| *byte == 0 || byte.is_ascii_whitespace() || BYTE_ORDER_MARK.contains(byte);
        let padding = self.waiting.iter().take_while(|byte| is_padding(byte)).count();
        let rest = &self.waiting[padding..];
        // A length may have any form.
        let length = if self.expects_prefix { PREFIX_MAX } else { 0 };
        let mut begins = (0..rest.len()).filter(|at| begins_document(&rest[*at..]));
        let next = begins.next().unwrap_or(rest.len());
        if next <= length {
            return None;
        }
        self.drop_front(padding + next - length);
        (!core::mem::replace(&mut self.skips, true)).then_some(Malformed { at: 0, why: Why::Junk })
    }

    /// What stands before a document: padding, a length, or neither.
    fn before(&mut self, start: usize, end: usize) -> Option<Malformed> {
        let (before, after) = (&self.waiting[..start], &self.waiting[end..]);
        if self.expects_prefix {
            let tail = &before[before.len().saturating_sub(PREFIX_MAX)..];
            return match Prefix::of(tail, end - start, after, self.prefix) {
                Some((prefix, beyond)) => {
                    self.prefix = prefix;
                    // What of it has not come yet is white space before the next document.
                    self.behind = beyond.min(after.len());
                    None
                }
                None => Some(Malformed { at: 0, why: Why::WrongLength }),
            };
        }
        let text = String::from_utf8_lossy(before);
        let rest = text.trim_matches(|c: char| c == '\0' || c == '\u{feff}' || c.is_ascii_whitespace());
        let prologue = rest.is_empty() || (rest.starts_with("<?") && rest.ends_with("?>"));
        (!prologue).then_some(Malformed { at: 0, why: Why::Junk })
    }
}

impl Prefix {
    const ALL: [Prefix; 5] = [Prefix::Little32, Prefix::Big32, Prefix::Little16, Prefix::Big16, Prefix::Digits];

    /// The length as it stands before a document.
    fn bytes(self, length: usize) -> Vec<u8> {
        // A document is at most 65536 bytes; one of exactly that length does not fit two bytes and is cut by the limit.
        let wide = u32::try_from(length).unwrap_or(u32::MAX);
        let narrow = u16::try_from(length).unwrap_or(u16::MAX);
        match self {
            Prefix::None => Vec::new(),
            Prefix::Little32 => wide.to_le_bytes().to_vec(),
            Prefix::Big32 => wide.to_be_bytes().to_vec(),
            Prefix::Little16 => narrow.to_le_bytes().to_vec(),
            Prefix::Big16 => narrow.to_be_bytes().to_vec(),
            Prefix::Digits => length.to_string().into_bytes(),
        }
    }

    /// The length that the end of `tail` is in this form.
    fn read(self, tail: &[u8]) -> Option<usize> {
        match self {
            Prefix::None => None,
            Prefix::Little32 => tail.last_chunk().map(|bytes| u32::from_le_bytes(*bytes) as usize),
            Prefix::Big32 => tail.last_chunk().map(|bytes| u32::from_be_bytes(*bytes) as usize),
            Prefix::Little16 => tail.last_chunk().map(|bytes| usize::from(u16::from_le_bytes(*bytes))),
            Prefix::Big16 => tail.last_chunk().map(|bytes| usize::from(u16::from_be_bytes(*bytes))),
            Prefix::Digits => {
                let text = tail.trim_ascii_end();
                let digits = text.iter().rev().take_while(|byte| byte.is_ascii_digit()).count();
                core::str::from_utf8(&text[text.len() - digits..]).ok()?.parse().ok()
            }
        }
    }

    /// The form in which the end of `tail` is the length of a document, and by how much it is longer: so much white space or NUL
    /// follows, as far as it has come. The least surplus is taken, and of equal ones the form seen before.
    fn of(tail: &[u8], length: usize, after: &[u8], known: Prefix) -> Option<(Prefix, usize)> {
        let is_blank = |beyond: usize| after.iter().take(beyond).all(|byte| *byte == 0 || byte.is_ascii_whitespace());
        let forms = core::iter::once(known).chain(Prefix::ALL);
        let read = forms.filter_map(|form| Some((form, form.read(tail)?.checked_sub(length)?)));
        read.filter(|(_, beyond)| length + beyond <= DOCUMENT_MAX && is_blank(*beyond))
            .min_by_key(|(_, beyond)| *beyond)
    }
}

/// The documents of one datagram; what is left over at its end is cut off.
pub fn split(datagram: &[u8]) -> Vec<Result<Vec<u8>, Malformed>> {
    let mut frames = Frames::new(false);
    frames.push(datagram);
    let mut found: Vec<_> = core::iter::from_fn(|| frames.next()).collect();
    let rest = frames.waiting.iter().any(|byte| *byte != 0 && !byte.is_ascii_whitespace());
    if rest {
        let known = find_first(&frames.waiting, &STARTS).is_some();
        let why = if known { Why::Truncated } else { Why::NoRoot };
        found.push(Err(Malformed { at: datagram.len(), why }));
    } else if found.is_empty() {
        found.push(Err(Malformed { at: 0, why: Why::Empty }));
    }
    found
}

/// Whether bytes may be the beginning of a document, or of what may stand before one.
fn begins_document(bytes: &[u8]) -> bool {
    let words: [&[u8]; 3] = [STARTS[0], STARTS[1], b"<?"];
    words.iter().any(|word| word.iter().zip(bytes).all(|(a, b)| a == b))
}

fn find_first(bytes: &[u8], words: &[&[u8]; 2]) -> Option<usize> {
    let length = words[0].len();
    bytes.windows(length).position(|window| words.contains(&window))
}

fn find_last(bytes: &[u8], words: &[&[u8]; 2]) -> Option<usize> {
    let length = words[0].len();
    bytes.windows(length).rposition(|window| words.contains(&window))
}

#[cfg(test)]
mod tests {
    use super::super::vectors::{HELLO, KRC2_DAT, KRC2_SHORT};
    use super::*;

    type Found = Result<Vec<u8>, Why>;

    fn all(frames: &mut Frames) -> Vec<Found> {
        core::iter::from_fn(|| frames.next()).map(|found| found.map_err(|problem| problem.why)).collect()
    }

    /// A document as it comes out: without what stands around it.
    fn document(text: &str) -> Found {
        Ok(text.trim().as_bytes().to_vec())
    }

    #[test]
    fn a_stream_in_pieces_of_any_length_gives_the_same_documents() {
        // Two in one piece, whole buffers padded with NUL, and a new line.
        let stream = format!("{HELLO}\0\0\0\0\0{KRC2_DAT}{KRC2_SHORT}\r\n\0\0{}", "<Sen Type=\"ImFree\"></Sen >");
        for length in 1..stream.len() {
            let mut frames = Frames::default();
            let mut found = Vec::new();
            for piece in stream.as_bytes().chunks(length) {
                frames.push(piece);
                found.extend(all(&mut frames));
            }
            let sen = document("<Sen Type=\"ImFree\"></Sen >");
            assert_eq!(found, [document(HELLO), document(KRC2_DAT), document(KRC2_SHORT), sen], "{length}");
            assert_eq!(frames.waiting(), 0);
        }
    }

    #[test]
    fn what_is_no_document_is_named_and_the_next_one_found() {
        let cases: [(&str, &[Found]); 5] = [
            ("GET / HTTP/1.1\r\n\r\n<Rob></Rob>", &[Err(Why::Junk), document("<Rob></Rob>")]),
            ("IPOC></Rob><Rob></Rob>", &[Err(Why::NoRoot), document("<Rob></Rob>")]),
            ("<Rob><RIst X=\"1<Rob></Rob>", &[Err(Why::Truncated), document("<Rob></Rob>")]),
            ("<Rob></Robot></Rob>", &[document("<Rob></Robot></Rob>")]),
            ("<?xml version=\"1.0\"?>\n<Rob></Rob>", &[document("<Rob></Rob>")]),
        ];
        for (text, want) in cases {
            let mut frames = Frames::default();
            frames.push(text.as_bytes());
            assert_eq!(all(&mut frames), want, "{text}");
        }
    }

    #[test]
    fn who_speaks_another_language_is_named_at_once_and_only_once() {
        let junk = |frames: &mut Frames, text: &str| -> Vec<Option<Why>> {
            let found = frames.documents(text.as_bytes()).into_iter();
            found.map(|found| found.err().map(|problem| problem.why)).collect()
        };
        for prefix in [false, true] {
            let mut frames = Frames::new(prefix);
            assert_eq!(junk(&mut frames, "\0\r\n"), []);
            assert_eq!(junk(&mut frames, "GET / HTTP/1.1\r\n"), [Some(Why::Junk)], "{prefix}");
            assert_eq!(junk(&mut frames, "Host: <b>1.2.3.4</b>\r\n\r\n"), [], "{prefix}");
            assert!(frames.waiting() <= PREFIX_MAX);
            let wrapped = String::from_utf8(frames.wrap(b"<Rob></Rob>")).unwrap();
            assert_eq!(junk(&mut frames, &wrapped), [None], "{prefix}");
            assert_eq!(junk(&mut frames, "and this is no document"), [Some(Why::Junk)]);
        }
        let mut frames = Frames::default();
        assert_eq!(junk(&mut frames, "\u{feff}<?xml version=\"1.0\"?>"), []);
        assert_eq!(junk(&mut frames, "<R"), []);
        assert_eq!(junk(&mut frames, "ob></Rob><"), [None]);
        assert_eq!(junk(&mut frames, "Sen></Sen>"), [None]);
    }

    #[test]
    fn a_document_that_breaks_off_does_not_take_the_length_of_the_next_one() {
        let mut frames = Frames::new(true);
        let whole = frames.wrap(b"<Rob></Rob>");
        for cut in 4..11 {
            let bytes = [&frames.wrap(&b"<Rob></Rob>"[..cut])[..], &whole].concat();
            frames.push(&bytes);
            assert_eq!(all(&mut frames), [Err(Why::Truncated), document("<Rob></Rob>")], "{cut} bytes");
        }
    }

    #[test]
    fn memory_is_bounded_and_the_stream_recovers() {
        let mut frames = Frames::default();
        let mut whys = Vec::new();
        for _ in 0..100 {
            frames.push(&[b'x'; 10_000]);
            assert!(frames.waiting() <= WAITING_MAX);
            whys.extend(all(&mut frames));
        }
        assert!(whys.len() > 10 && whys.iter().all(|found| *found == Err(Why::TooLong)), "{whys:?}");
        frames.push(b"<Rob></Rob>");
        assert_eq!(all(&mut frames), [Err(Why::Junk), document("<Rob></Rob>")]);
        // Nobody takes them.
        for _ in 0..40_000 {
            frames.push(b"<Rob></Rob>");
        }
        assert!(frames.waiting() <= WAITING_MAX);
        assert_eq!(frames.next().unwrap().unwrap_err().why, Why::Overrun);
        // NUL alone is padding, however long.
        let mut frames = Frames::default();
        frames.push(&[0; 70_000]);
        assert_eq!(all(&mut frames), []);
        frames.push(b"<Rob></Rob>");
        assert_eq!(all(&mut frames), [document("<Rob></Rob>")]);
        // A document that is complete and too long.
        let mut frames = Frames::default();
        frames.push(format!("<Rob>{}</Rob><Rob></Rob>", " ".repeat(66_000)).as_bytes());
        assert_eq!(all(&mut frames), [Err(Why::TooLong), document("<Rob></Rob>")]);
    }

    #[test]
    fn a_length_before_the_document_is_read_in_any_form_and_used_for_answers() {
        // 60 is also the character <; 316 is 01 3c in two bytes, 15361 is 3c 01.
        for length in [11, 60, 316, 15361] {
            let text = format!("<Rob>{}</Rob>", " ".repeat(length - 11));
            for form in Prefix::ALL {
                let mut frames = Frames::new(true);
                for _ in 0..2 {
                    frames.push(&form.bytes(length));
                    frames.push(text.as_bytes());
                }
                assert_eq!(all(&mut frames), [document(&text), document(&text)], "{form:?} {length}");
                assert_eq!(frames.prefix().bytes(300), form.bytes(300), "{form:?}");
                assert_eq!(frames.wrap(b"<Sen/>"), [form.bytes(6), b"<Sen/>".to_vec()].concat());
            }
        }
        let mut frames = Frames::new(true);
        frames.push(b"\x0a\0\0\0<Rob></Rob>\0\0\0\x0b<Rob></Rob>\x0c\0\0\0<Rob></Rob>x");
        let document = document("<Rob></Rob>");
        assert_eq!(
            all(&mut frames),
            [Err(Why::WrongLength), document.clone(), document.clone(), Err(Why::WrongLength), document]
        );
    }

    /// A real KRC2 telegram ends with a new line; whole buffers are filled up with NUL.
    #[test]
    fn a_length_may_count_the_blanks_behind_the_document() {
        for filler in ["\n", "\r\n", "\0\0\0", &"\0".repeat(2048 - KRC2_DAT.trim().len())] {
            let text = format!("{}{filler}", KRC2_DAT.trim());
            for form in Prefix::ALL {
                let stream = [form.bytes(text.len()), text.clone().into_bytes()].concat().repeat(3);
                for piece in [1, 7, text.len(), stream.len()] {
                    let mut frames = Frames::new(true);
                    let found: Vec<Found> = stream
                        .chunks(piece)
                        .flat_map(|bytes| frames.documents(bytes))
                        .map(|found| found.map_err(|problem| problem.why))
                        .collect();
                    assert_eq!(found, vec![document(KRC2_DAT); 3], "{form:?} {filler:?} {piece}");
                    assert_eq!(frames.prefix().bytes(300), form.bytes(300), "{form:?} {filler:?} {piece}");
                }
            }
        }
    }

    #[test]
    fn a_datagram_is_cut_into_its_documents() {
        let whys = |text: &str| -> Vec<Option<Why>> {
            split(text.as_bytes()).into_iter().map(|found| found.err().map(|problem| problem.why)).collect()
        };
        assert_eq!(whys(KRC2_SHORT), [None]);
        assert_eq!(whys(&format!("{KRC2_SHORT}{KRC2_DAT}")), [None, None]);
        assert_eq!(whys(&format!("{KRC2_SHORT}{}", &KRC2_DAT[..100])), [None, Some(Why::Truncated)]);
        assert_eq!(whys(&KRC2_DAT[..100]), [Some(Why::Truncated)]);
        assert_eq!(whys("hello"), [Some(Why::NoRoot)]);
        assert_eq!(whys(""), [Some(Why::Empty)]);
        assert_eq!(whys(" \0\0"), [Some(Why::Empty)]);
    }
}
