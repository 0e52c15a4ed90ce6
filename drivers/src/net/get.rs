//! One page of a device's own server.

use super::{Arrival, Clock, Connection, NetError, system, wait};
use crate::ft::http::{Page, Reply, request};
use std::net::SocketAddr;
use std::time::Duration;

/// Fetches one page. The limit is for all of it, however slowly it drips in.
pub fn http_get(clock: Clock<'_>, address: SocketAddr, path: &str, limit: Duration) -> Result<String, NetError> {
    let bad = |what: String| NetError::Page { address, path: path.to_owned(), what };
    let begun = clock();
    let left = || {
        let spent = Duration::from_nanos(u64::try_from((clock() - begun).0).unwrap_or(0));
        limit.checked_sub(spent).filter(|left| !left.is_zero())
    };
    let mut connection = Connection::connect(address, limit).map_err(|error| bad(error.to_string()))?;
    let (mut arrivals, mut reply, mut length) = (Vec::new(), Reply::default(), 0);
    connection.send(clock, &request(path, &address.to_string()), &mut arrivals)?;
    let page = loop {
        for arrival in arrivals.drain(..) {
            let Arrival::Bytes { bytes, .. } = arrival else { continue };
            length += bytes.len();
            if let Some(page) = reply.push(&bytes).map_err(|error| bad(error.to_string()))? {
                return text(page).map_err(bad);
            }
        }
        if !connection.is_open() {
            break reply.end().map_err(|error| bad(error.to_string()))?;
        }
        let Some(left) = left() else {
            return Err(bad(format!("not whole after {limit:?}: {length} bytes came")));
        };
        wait(&[&connection], left).map_err(system("wait for", address))?;
        connection.receive(clock, &mut arrivals)?;
    };
    text(page).map_err(bad)
}

/// The text of a page; the answer to a setting is none.
fn text(page: Page) -> Result<String, String> {
    match page.code {
        200 => Ok(page.text),
        code => Err(format!("the server answers {code}, which is no page")),
    }
}
