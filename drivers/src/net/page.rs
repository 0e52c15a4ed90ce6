//! What a web server answers: the page, or why there is none. Only bytes, no socket.
//!
//! The request is HTTP/1.0, so that the page comes in one piece. Not covered: redirections, chunks, compression.

/// Where the page begins in the answer, and how long it says that it is.
fn head(answer: &[u8]) -> Option<(usize, String, Option<usize>)> {
    let begins = answer.windows(4).position(|four| four == b"\r\n\r\n")?;
    let text = String::from_utf8_lossy(answer.get(..begins)?).into_owned();
    let length = text.lines().filter_map(|line| line.split_once(':'));
    let mut length = length.filter(|(name, _)| name.eq_ignore_ascii_case("content-length")).map(|(_, value)| value);
    let length = length.next_back().and_then(|value| value.trim().parse().ok());
    Some((begins + 4, text, length))
}

/// Whether all of the page is there. Some servers keep the connection in spite of the request.
pub(super) fn whole(answer: &[u8]) -> bool {
    head(answer).is_some_and(|(begins, _, length)| length.is_some_and(|length: usize| answer.len() - begins >= length))
}

/// The page in the whole answer, or what is wrong with it.
pub(super) fn page(answer: &[u8]) -> Result<Vec<u8>, String> {
    let Some((begins, text, length)) = head(answer) else {
        return Err(format!("no HTTP answer: {} bytes without the end of a head", answer.len()));
    };
    let status = text.lines().next().unwrap_or_default();
    if status.split_whitespace().nth(1) != Some("200") {
        return Err(format!("the server answers {status:?}"));
    }
    let body = answer.get(begins..).unwrap_or_default();
    match length {
        Some(length) if body.len() < length => Err(format!("half a page: {} of {length} bytes", body.len())),
        Some(length) => Ok(body.get(..length).unwrap_or_default().to_vec()),
        None => Ok(body.to_vec()),
    }
}
