//! Damaged input: bits flipped, bytes cut, inserted, repeated, NUL, pieces of other documents. Nothing panics, nothing grows,
//! and whatever is refused has a name and is counted.

#[cfg(test)]
mod tests {
    use sim_core::rng::{Stream, Streams};
    use sim_core::time::Nanos;

    use super::super::telegram::DOCUMENT_MAX;
    use super::super::vectors::{CONFIG, HELLO_EMPTY, TELEGRAMS, frame};
    use super::super::{Corrections, EthernetConfig, Frames, Host, HostOptions, Telegram, Why, split};

    /// The short form; the long one is a fuzz target.
    const CASES: usize = 100_000;
    /// Configurations are longer, and XML proper.
    const CONFIGS: usize = 10_000;

    fn below(stream: &mut Stream, limit: usize) -> usize {
        ((stream.uniform() * limit as f64) as usize).min(limit.saturating_sub(1))
    }

    /// One to three damages.
    fn damaged(stream: &mut Stream, sources: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = sources[below(stream, sources.len())].clone();
        for _ in 0..=below(stream, 3) {
            let at = below(stream, bytes.len().max(1));
            let words: [&[u8]; 12] = [
                b"\0",
                b"<",
                b">",
                b"\"",
                b"/>",
                b"</Rob>",
                b"<Dat>",
                b"<!--",
                b",",
                b"\xff",
                b"1e999",
                b"99999999999999999999",
            ];
            match below(stream, 7) {
                0 if !bytes.is_empty() => bytes[at] ^= 1 << below(stream, 8),
                1 => bytes.truncate(at),
                2 => drop(bytes.drain(..at)),
                3 => drop(bytes.splice(at..at, words[below(stream, words.len())].iter().copied())),
                4 => {
                    let end = (at + below(stream, 40)).min(bytes.len());
                    drop(bytes.drain(at..end));
                }
                5 => {
                    let end = (at + below(stream, 200)).min(bytes.len());
                    let piece = bytes[at..end].to_vec();
                    drop(bytes.splice(at..at, piece));
                }
                _ => bytes.extend_from_slice(&sources[below(stream, sources.len())]),
            }
        }
        bytes
    }

    fn telegrams() -> Vec<Vec<u8>> {
        let quoted = TELEGRAMS.iter().map(|(_, text, _)| text.as_bytes().to_vec());
        quoted.chain([HELLO_EMPTY.as_bytes().to_vec(), frame(100, 1.0, 0), frame(104, -1.0, 2)]).collect()
    }

    fn heap(telegram: &Telegram) -> usize {
        let pair = |(key, value): &(String, String)| key.capacity() + value.capacity() + size_of::<(String, String)>();
        let elements = telegram.elements.iter().map(|element| {
            element.tag.capacity() + element.text.capacity() + element.attributes.iter().map(pair).sum::<usize>()
        });
        elements.sum::<usize>() + telegram.extra.iter().chain(&telegram.task).map(pair).sum::<usize>()
    }

    #[test]
    fn a_damaged_telegram_is_read_or_refused_by_name() {
        let sources = telegrams();
        let mut stream = Streams::new(1).named("rsi/mutated/telegram");
        let mut host = Host::new(EthernetConfig::parse(CONFIG).unwrap(), HostOptions::default());
        let (mut read, mut malformed, mut now) = (0_u64, 0_u64, Nanos(0));
        let mut whys = std::collections::BTreeSet::new();
        for _ in 0..CASES {
            let bytes = damaged(&mut stream, &sources);
            let mut events = Vec::new();
            now = now + Nanos(4_000_000);
            let frame = host.receive(now, &bytes, &mut events);
            assert!(events.len() < 64, "{} events of one document", events.len());
            if frame.is_some() {
                host.reply(&Corrections::none()).unwrap();
            }
            host.tick(now, &mut events);
            match Telegram::decode(&bytes) {
                Ok(telegram) => {
                    read += 1;
                    assert!(heap(&telegram) < 64 * bytes.len() + 1024);
                    let mut once = Vec::new();
                    telegram.encode(&mut once);
                    assert_eq!(Telegram::decode(&once).as_ref(), Ok(&telegram), "{}", String::from_utf8_lossy(&bytes));
                    let mut twice = Vec::new();
                    Telegram::decode(&once).unwrap().encode(&mut twice);
                    assert_eq!(once, twice);
                }
                Err(problem) => {
                    malformed += 1;
                    whys.insert(problem.why);
                    assert!(problem.at <= bytes.len());
                }
            }
        }
        // Both ways are used (one in fifty at least), each refusal was counted, and the host keeps no more names than there are.
        assert!(read > 2000 && malformed > 2000, "{read} read, {malformed} malformed");
        assert!(host.counts()["rsi-malformed"] >= malformed);
        assert!(whys.len() >= 12, "{whys:?}");
        let known: Vec<&str> = Why::ALL.iter().map(Why::id).collect();
        assert!(host.causes().keys().all(|cause| known.contains(cause) || cause.starts_with("number-")));
    }

    #[test]
    fn a_damaged_stream_stays_bounded_and_comes_to_itself() {
        let sources = telegrams();
        let mut stream = Streams::new(2).named("rsi/mutated/stream");
        let good = frame(100, 1.0, 0);
        for prefix in [false, true] {
            let mut frames = Frames::new(prefix);
            for _ in 0..CASES / 4 {
                let bytes = damaged(&mut stream, &sources);
                frames.push(&bytes);
                // What comes out is bounded by what went in: a piece gives at most one document, or two errors, per tag.
                let mut out = 0;
                while let Some(found) = frames.next() {
                    out += 1;
                    assert!(found.is_ok_and(|document| document.len() <= DOCUMENT_MAX) || out < 2000);
                    assert!(out < 2000);
                }
                assert!(frames.waiting() <= 2 * DOCUMENT_MAX);
            }
            let mut last = None;
            for _ in 0..3 {
                frames.push(&good);
                last = core::iter::from_fn(|| frames.next()).last();
            }
            assert_eq!(last, Some(Ok(good.clone())), "length before: {prefix}");
        }
    }

    #[test]
    fn a_damaged_datagram_gives_a_document_or_a_reason() {
        let sources = telegrams();
        let mut stream = Streams::new(3).named("rsi/mutated/datagram");
        let mut host = Host::new(EthernetConfig::parse(CONFIG).unwrap(), HostOptions::default());
        for _ in 0..CASES / 4 {
            let bytes = damaged(&mut stream, &sources);
            assert!(!split(&bytes).is_empty());
            let (mut events, before) = (Vec::new(), host.counts().values().sum::<u64>());
            let frames = host.receive_documents(Nanos(0), split(&bytes), &mut events);
            let said = host.counts().values().sum::<u64>() - before;
            assert_eq!(said, events.len() as u64, "every event is counted");
            assert!(!frames.is_empty() || !events.is_empty(), "silent about {}", String::from_utf8_lossy(&bytes));
        }
    }

    #[test]
    fn a_damaged_configuration_is_read_or_refused_with_its_line() {
        let sources = [CONFIG.as_bytes().to_vec(), b"<ROOT><CONFIG></CONFIG></ROOT>".to_vec()];
        let mut stream = Streams::new(4).named("rsi/mutated/config");
        let mut refused = 0;
        for _ in 0..CONFIGS {
            let bytes = damaged(&mut stream, &sources);
            let text = String::from_utf8_lossy(&bytes);
            match EthernetConfig::parse(&text) {
                Ok(config) => assert!(config.send.len() + config.receive.len() <= 256),
                Err(problem) => {
                    refused += 1;
                    assert!((1..=text.lines().count().max(1) + 1).contains(&problem.line), "{problem}");
                    assert!(!problem.help.is_empty() && problem.to_string().len() < 600, "{problem}");
                }
            }
        }
        assert!((CONFIGS / 2..CONFIGS).contains(&refused), "{refused} of {CONFIGS} refused");
    }
}
