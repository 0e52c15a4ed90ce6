//! The sensor's web server: one page, to whoever asks. A fault answers wrongly, late, or by half.

use super::link::failed;
use crate::error::Error;
use drivers::fault::Action;
use drivers::ft::http::PAGE;
use drivers::net::{Arrival, Clock, Connection, Listener};
use sim_core::time::Nanos;
use std::net::SocketAddr;

/// Most connections at a time; the server of a sensor has few.
const OPEN_MAX: usize = 4;
/// Longest request, in bytes.
const REQUEST_BYTES_MAX: usize = 4096;

/// See the module.
pub(super) struct PageServer {
    listener: Listener,
    page: String,
    open: Vec<Talk>,
    asked: u64,
}

/// One connection.
struct Talk {
    connection: Connection,
    request: Vec<u8>,
    answer: Option<(Nanos, Vec<u8>)>,
}

impl PageServer {
    /// Binds the port; there is no page yet.
    pub fn bind(address: SocketAddr) -> Result<Self, Error> {
        let listener = Listener::bind(address).map_err(failed)?;
        Ok(PageServer { listener, page: String::new(), open: Vec::new(), asked: 0 })
    }

    /// From now on this is the page.
    pub fn show(&mut self, page: String) {
        self.page = page;
    }

    /// Where it is bound.
    pub fn local(&self) -> SocketAddr {
        self.listener.local()
    }

    /// For a wait that ends when somebody comes.
    pub fn listener(&self) -> &Listener {
        &self.listener
    }

    /// Hears requests and answers them; `fault` says what happens to the one with this number.
    pub fn look(&mut self, clock: Clock<'_>, fault: &mut dyn FnMut(u64) -> Option<Action>) -> Result<(), Error> {
        while let Some(connection) = self.listener.accept(self.open.len() >= OPEN_MAX).map_err(failed)? {
            self.open.push(Talk { connection, request: Vec::new(), answer: None });
        }
        let mut arrivals = Vec::new();
        for talk in &mut self.open {
            talk.connection.receive(clock, &mut arrivals).map_err(failed)?;
            for arrival in arrivals.drain(..) {
                let Arrival::Bytes { bytes, .. } = arrival else { continue };
                talk.request.extend_from_slice(&bytes[..bytes.len().min(REQUEST_BYTES_MAX)]);
            }
            let is_whole = talk.request.windows(4).any(|four| four == b"\r\n\r\n");
            if talk.answer.is_none() && (is_whole || talk.request.len() >= REQUEST_BYTES_MAX) {
                let action = fault(self.asked);
                self.asked += 1;
                let delay = if let Some(Action::HttpSlow { delay_ms }) = action { delay_ms } else { 0 };
                let answer = answer(&talk.request, &self.page, action.as_ref());
                talk.answer = Some((clock() + Nanos(i64::from(delay) * 1_000_000), answer));
            }
        }
        let now = clock();
        let is_due = |talk: &Talk| talk.answer.as_ref().is_some_and(|(at, _)| *at <= now);
        for talk in self.open.iter_mut().filter(|talk| is_due(talk)) {
            let (_, answer) = talk.answer.as_ref().expect("it is due");
            talk.connection.send(clock, answer, &mut arrivals).map_err(failed)?;
        }
        // What was answered is closed: the request was for HTTP/1.0, and a page is far shorter than what a socket takes.
        self.open.retain(|talk| !is_due(talk) && talk.connection.is_open());
        Ok(())
    }
}

/// What goes out to this request.
fn answer(request: &[u8], page: &str, action: Option<&Action>) -> Vec<u8> {
    let asked = request.split(|byte| *byte == b' ').nth(1).unwrap_or_default();
    if asked != PAGE.as_bytes() || action == Some(&Action::HttpNotFound {}) {
        return b"HTTP/1.0 404 Not Found\r\nContent-Length: 0\r\n\r\n".to_vec();
    }
    let body = if action == Some(&Action::HttpHalfPage {}) { &page[..page.len() / 2] } else { page };
    format!("HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\nContent-Length: {}\r\n\r\n{body}", page.len()).into_bytes()
}
