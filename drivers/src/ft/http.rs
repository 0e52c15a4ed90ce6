//! A request for a page and the reply, without a socket: bytes in, a page or a reason out.
//!
//! | part | rule |
//! |---|---|
//! | request | `GET path HTTP/1.0`, so that the server closes when it is done |
//! | status line | `HTTP/1.x code words`; 200 is a page, 302 the answer of a setting that was taken |
//! | headers | lines `name: value` up to an empty line, at most 16 KiB; only `Content-Length` is used |
//! | body | as long as `Content-Length` says, else up to the end of the connection |
//!
//! Not covered: chunked bodies (HTTP/1.1), which a server does not send to a request of HTTP/1.0; they are named and refused.

use super::calibration::PAGE_MAX;
use thiserror::Error;

/// Path of the page with settings and calibration in use.
pub const PAGE: &str = "/netftapi2.xml";
/// Path of the page with a calibration alone.
pub const CALIBRATION_PAGE: &str = "/netftcalapi.xml";
/// Longest head of a reply.
const HEAD_MAX: usize = 16 * 1024;

/// A request for this path. The sensor's server refuses after about three quick calls: wait between two.
pub fn request(path: &str, host: &str) -> Vec<u8> {
    let clean = |text: &str| -> String { text.chars().filter(|letter| letter.is_ascii_graphic()).collect() };
    format!("GET {} HTTP/1.0\r\nHost: {}\r\nConnection: close\r\n\r\n", clean(path), clean(host)).into_bytes()
}

/// A reply that is no page.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum HttpError {
    /// The first line is none of HTTP.
    #[error("the reply begins with \"{0}\", not with HTTP/1.x and a number; is this the sensor's port 80?")]
    NotHttp(String),
    /// Another status than 200 and 302.
    #[error("the server answers {code} {words}")]
    Refused {
        /// Code of the status line.
        code: u16,
        /// Its words.
        words: String,
    },
    /// A header that cannot be used.
    #[error("header \"{0}\" cannot be used")]
    Header(String),
    /// Too long.
    #[error("more than {0} bytes, which no page of a sensor has")]
    Long(usize),
    /// The connection ended too early.
    #[error("the connection ended after {got} bytes of {wanted}: only a part came, ask again")]
    Half {
        /// Bytes that came.
        got: usize,
        /// Bytes that were announced.
        wanted: String,
    },
    /// The body is no text.
    #[error("the page is not text: byte {0} is not UTF-8")]
    Text(usize),
}

/// A reply that is whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// 200 or 302.
    pub code: u16,
    /// The body.
    pub text: String,
}

/// A reply that is coming in.
#[derive(Debug, Clone, Default)]
pub struct Reply {
    bytes: Vec<u8>,
    head: Option<Head>,
}

#[derive(Debug, Clone, Copy)]
struct Head {
    code: u16,
    body_at: usize,
    length: Option<usize>,
}

impl Reply {
    /// Takes a piece; the page as soon as it is whole.
    ///
    /// # Errors
    /// As soon as the reply cannot become a page.
    pub fn push(&mut self, piece: &[u8]) -> Result<Option<Page>, HttpError> {
        if self.bytes.len() + piece.len() > HEAD_MAX + PAGE_MAX {
            return Err(HttpError::Long(HEAD_MAX + PAGE_MAX));
        }
        self.bytes.extend_from_slice(piece);
        let Some(head) = self.head()? else { return Ok(None) };
        match head.length {
            Some(length) if self.bytes.len() - head.body_at >= length => self.page(head, length).map(Some),
            _ => Ok(None),
        }
    }

    /// The connection ended: the page, if it is whole.
    ///
    /// # Errors
    /// If only a part came.
    pub fn end(&mut self) -> Result<Page, HttpError> {
        let got = self.bytes.len();
        let Some(head) = self.head()? else { return Err(HttpError::Half { got, wanted: "a head".to_string() }) };
        let got = got - head.body_at;
        match head.length {
            Some(length) if got < length => Err(HttpError::Half { got, wanted: format!("{length} of the page") }),
            length => self.page(head, length.unwrap_or(got)),
        }
    }

    fn page(&self, head: Head, length: usize) -> Result<Page, HttpError> {
        let body = self.bytes.get(head.body_at..head.body_at + length).unwrap_or_default();
        let text = core::str::from_utf8(body).map_err(|error| HttpError::Text(error.valid_up_to()))?;
        Ok(Page { code: head.code, text: text.to_string() })
    }

    fn head(&mut self) -> Result<Option<Head>, HttpError> {
        if self.head.is_none() {
            let ends =
                |end: &[u8]| self.bytes.windows(end.len()).position(|window| window == end).map(|at| at + end.len());
            let body_at = match (ends(b"\r\n\r\n"), ends(b"\n\n")) {
                (Some(one), Some(other)) => one.min(other),
                (Some(at), None) | (None, Some(at)) => at,
                (None, None) if self.bytes.len() > HEAD_MAX => return Err(HttpError::Long(HEAD_MAX)),
                (None, None) => return self.looks_like_http().map(|()| None),
            };
            let head = String::from_utf8_lossy(self.bytes.get(..body_at).unwrap_or_default()).into_owned();
            self.head = Some(parse_head(&head, body_at)?);
        }
        Ok(self.head)
    }

    /// Whatever else answers on that port is named before a whole head has come.
    fn looks_like_http(&self) -> Result<(), HttpError> {
        let wanted = b"HTTP/1.";
        if self.bytes.iter().zip(wanted).all(|(got, wanted)| got == wanted) {
            return Ok(());
        }
        Err(HttpError::NotHttp(first_line(&String::from_utf8_lossy(&self.bytes))))
    }
}

fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().chars().take(60).collect()
}

fn parse_head(head: &str, body_at: usize) -> Result<Head, HttpError> {
    let not_http = || HttpError::NotHttp(first_line(head));
    let mut lines = head.lines();
    let (version, rest) = lines.next().and_then(|line| line.split_once(' ')).ok_or_else(not_http)?;
    if !version.starts_with("HTTP/1.") {
        return Err(not_http());
    }
    let (code, words) = rest.split_once(' ').unwrap_or((rest, ""));
    let code: u16 = code.parse().map_err(|_| not_http())?;
    if code != 200 && code != 302 {
        return Err(HttpError::Refused { code, words: first_line(words) });
    }
    let mut length = None;
    for line in lines.take_while(|line| !line.is_empty()) {
        let bad = || HttpError::Header(first_line(line));
        let (name, value) = line.split_once(':').ok_or_else(bad)?;
        if name.eq_ignore_ascii_case("transfer-encoding") {
            return Err(bad());
        }
        if name.eq_ignore_ascii_case("content-length") {
            let bytes: usize = value.trim().parse().map_err(|_| bad())?;
            if bytes > PAGE_MAX {
                return Err(HttpError::Long(PAGE_MAX));
            }
            length = Some(bytes);
        }
    }
    Ok(Head { code, body_at, length })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The whole reply in pieces of one byte, then the end of the connection.
    fn check(reply: &str) -> Result<Page, HttpError> {
        let mut incoming = Reply::default();
        for byte in reply.as_bytes() {
            if let Some(page) = incoming.push(&[*byte])? {
                return Ok(page);
            }
        }
        incoming.end()
    }

    fn page(code: u16, text: &str) -> Result<Page, HttpError> {
        Ok(Page { code, text: text.to_string() })
    }

    #[test]
    fn a_page_may_say_its_length_or_just_end() {
        assert_eq!(check("HTTP/1.1 200 OK\r\nContent-Length: 8\r\n\r\n<netft/>more"), page(200, "<netft/>"));
        assert_eq!(check("HTTP/1.0 200 OK\nServer: x\n\n<netft/>"), page(200, "<netft/>"));
        assert_eq!(check("HTTP/1.0 302 Found\r\nLocation: /\r\n\r\n"), page(302, ""));
    }

    #[test]
    fn what_is_no_page_is_named() {
        let said = |reply: &str| check(reply).expect_err("no page").to_string();
        assert_eq!(said("HTTP/1.0 404 Not Found\r\n\r\nno"), "the server answers 404 Not Found");
        assert_eq!(
            said("HTTP/1.0 200 OK\r\nContent-Length: 9\r\n\r\n<net"),
            "the connection ended after 4 bytes of 9 of the page: only a part came, ask again"
        );
        assert_eq!(
            said("HTTP/1.0 200 OK\r\nContent-Le"),
            "the connection ended after 27 bytes of a head: only a part came, ask again"
        );
        assert!(said("220 smtp ready\r\n\r\n").starts_with("the reply begins with \"2\""));
        assert!(said("HTTP/1.0 fine\r\n\r\n").contains("HTTP/1.0 fine"));
        assert!(said("HTTP/1.0 200 OK\r\nContent-Length: -4\r\n\r\n").contains("Content-Length: -4"));
        assert!(said("HTTP/1.0 200 OK\r\nContent-Length: 999999999\r\n\r\n").contains("262144"));
        assert!(said("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n").contains("chunked"));
        assert!(said(&format!("HTTP/1.1 200 OK\r\nX: {}", "x".repeat(HEAD_MAX))).contains("16384"));
    }

    #[test]
    fn a_request_has_no_room_for_another() {
        let text = String::from_utf8(request(PAGE, "192.168.1.1\r\nEvil: 1")).unwrap();
        assert_eq!(text, "GET /netftapi2.xml HTTP/1.0\r\nHost: 192.168.1.1Evil:1\r\nConnection: close\r\n\r\n");
    }
}
