//! Changes of bytes and of RSI documents. They work on the text, not on a decoded document: a fault must also meet what no
//! decoder accepts, and must not depend on the code that it tests.

use super::action::Action;
use std::ops::Range;

/// Does what the action says; whether it changed anything.
pub(super) fn change(action: &Action, bytes: &mut Vec<u8>) -> bool {
    match action {
        Action::Truncate { bytes: length } => {
            let shorter = *length < bytes.len();
            bytes.truncate(*length);
            shorter
        }
        Action::NulPadding { bytes: length } => {
            let longer = *length > bytes.len();
            bytes.resize(bytes.len().max(*length), 0);
            longer
        }
        Action::Length { bytes: length } => {
            let differs = *length != bytes.len();
            bytes.resize(*length, 0);
            differs
        }
        Action::IpocStep { step } => {
            ipoc(bytes).is_some_and(|before| set_ipoc(bytes, before.wrapping_add_signed(*step)))
        }
        Action::IpocZero {} => set_ipoc(bytes, 0),
        Action::IpocMiddle {} => move_ipoc(bytes),
        Action::WrongType { text } => {
            root(bytes).and_then(|root| value(bytes, root)).is_some_and(|at| replace(bytes, at, text.as_bytes()))
        }
        Action::TypeSpelling {} => spell(bytes),
        Action::AttributeExtra { element } => attributes(bytes, element.as_deref())
            .is_some_and(|at| replace(bytes, at.start..at.start, b" Extra=\"1.0000\"")),
        Action::AttributeAbsent { element } => attributes(bytes, element.as_deref())
            .and_then(|at| last_attribute(bytes, at))
            .is_some_and(|at| replace(bytes, at, b"")),
        Action::DecimalComma { element } => number(bytes, element.as_deref(), |text| text.replace('.', ",")),
        Action::Nan { element } => number(bytes, element.as_deref(), |_| "NaN".to_owned()),
        Action::Exponent { element } => number(bytes, element.as_deref(), |text| {
            text.parse::<f64>().map_or_else(|_| text.to_owned(), |value| format!("{value:e}"))
        }),
        _ => false,
    }
}

/// Turns one bit round, if the packet has it.
pub(super) fn flip(bytes: &mut [u8], bit: usize) -> bool {
    bytes.get_mut(bit / 8).map(|byte| *byte ^= 1 << (bit % 8)).is_some()
}

/// The number in the first IPOC.
pub(super) fn ipoc(bytes: &[u8]) -> Option<u64> {
    std::str::from_utf8(&bytes[ipoc_digits(bytes)?]).ok()?.trim().parse().ok()
}

/// Writes another number there, zeros in front as before; whether it differs.
pub(super) fn set_ipoc(bytes: &mut Vec<u8>, value: u64) -> bool {
    let Some(at) = ipoc_digits(bytes) else { return false };
    let padded = bytes.get(at.start) == Some(&b'0') && at.len() > 1;
    let width = if padded { at.len() } else { 0 };
    replace(bytes, at, format!("{value:0width$}").as_bytes())
}

fn ipoc_digits(bytes: &[u8]) -> Option<Range<usize>> {
    let start = find(bytes, b"<IPOC>", 0)? + 6;
    Some(start..find(bytes, b"</IPOC>", start)?)
}

/// The IPOC moves from the end to the place behind the first element, or from elsewhere to the end.
fn move_ipoc(bytes: &mut Vec<u8>) -> bool {
    let Some(digits) = ipoc_digits(bytes) else { return false };
    let element: Vec<u8> = bytes[digits.start - 6..digits.end + 7].to_vec();
    let before = bytes.clone();
    bytes.drain(digits.start - 6..digits.end + 7);
    let Some(first) = attributes(bytes, None).and_then(|at| find(bytes, b">", at.end)) else {
        *bytes = before;
        return false;
    };
    bytes.splice(first + 1..first + 1, element);
    *bytes != before
}

/// `Type` and `TYPE`.
fn spell(bytes: &mut Vec<u8>) -> bool {
    let Some(root) = root(bytes) else { return false };
    for (from, to) in [(b" Type=", b" TYPE="), (b" TYPE=", b" Type=")] {
        if let Some(at) = find(&bytes[..root.end], from, root.start) {
            return replace(bytes, at..at + from.len(), to);
        }
    }
    false
}

/// What stands between the root's name and its end.
fn root(bytes: &[u8]) -> Option<Range<usize>> {
    let start = find(bytes, b"<Rob", 0).or_else(|| find(bytes, b"<Sen", 0))? + 4;
    Some(start..find(bytes, b">", start)?)
}

/// The value of the type in a root.
fn value(bytes: &[u8], root: Range<usize>) -> Option<Range<usize>> {
    let within = &bytes[..root.end];
    let start = find(within, b" Type=\"", root.start).or_else(|| find(within, b" TYPE=\"", root.start))? + 7;
    Some(start..find(within, b"\"", start)?)
}

/// What stands between the name and the end of the element with this name, or of the first below the root with attributes.
fn attributes(bytes: &[u8], element: Option<&str>) -> Option<Range<usize>> {
    let mut from = root(bytes)?.end;
    loop {
        let start = find(bytes, b"<", from)? + 1;
        let end = find(bytes, b">", start)?;
        let stop = if bytes[end - 1] == b'/' { end - 1 } else { end };
        let tag = &bytes[start..stop.max(start)];
        let name = tag.iter().position(|byte| byte.is_ascii_whitespace()).unwrap_or(tag.len());
        let wanted = element.map_or(&tag[..name] != b"Dat", |element| &tag[..name] == element.as_bytes());
        if wanted && tag[name..].contains(&b'=') {
            return Some(start + name..stop);
        }
        from = end;
    }
}

/// The last `name="value"` in a range, with the white space before it.
fn last_attribute(bytes: &[u8], within: Range<usize>) -> Option<Range<usize>> {
    let text = &bytes[within.clone()];
    let equals = text.iter().rposition(|&byte| byte == b'=')?;
    let start = text[..equals].iter().rposition(u8::is_ascii_whitespace)?;
    let end = text.iter().rposition(|&byte| byte == b'"')? + 1;
    (end > equals).then_some(within.start + start..within.start + end)
}

/// Rewrites the first value with a decimal point, of the element with this name or of any.
fn number(bytes: &mut Vec<u8>, element: Option<&str>, rewrite: impl Fn(&str) -> String) -> bool {
    let whole = || root(bytes).map(|root| root.end..bytes.len());
    let Some(within) = element.map_or_else(whole, |_| attributes(bytes, element)) else { return false };
    let mut from = within.start;
    while let Some(open) = find(&bytes[..within.end], b"\"", from).map(|at| at + 1) {
        let Some(close) = find(&bytes[..within.end], b"\"", open) else { return false };
        if let Ok(text) = std::str::from_utf8(&bytes[open..close])
            && text.contains('.')
            && text.parse::<f64>().is_ok()
        {
            let new = rewrite(text);
            return replace(bytes, open..close, new.as_bytes());
        }
        from = close + 1;
    }
    false
}

fn replace(bytes: &mut Vec<u8>, at: Range<usize>, with: &[u8]) -> bool {
    let differs = bytes[at.clone()] != *with;
    bytes.splice(at, with.iter().copied());
    differs
}

fn find(bytes: &[u8], needle: &[u8], from: usize) -> Option<usize> {
    bytes.get(from..)?.windows(needle.len()).position(|window| window == needle).map(|at| from + at)
}
