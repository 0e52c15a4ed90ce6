//! What each class of events means, in one line: those of [`crate::rsi::Event`], of [`crate::ft::Event`], and of the socket.

/// Class and meaning, in the order of their names.
pub const CLASSES: &[(&str, &str)] = &[
    ("ft-answer", "the sensor answered a command"),
    ("ft-bias-cleared", "the software bias was taken back: forces before and after differ by a constant"),
    ("ft-bias-set", "the load of that moment reads zero from then on"),
    ("ft-clock-back", "the sensor's own sample counter went back while the packets are in order"),
    ("ft-clock-restart", "the sensor's own sample counter began anew: it was switched off and on"),
    ("ft-duplicate", "the last packet again; it counts once"),
    ("ft-error", "by its status word the reading must not be used"),
    ("ft-gap", "packets are missing before this one"),
    ("ft-good", "the status word is good again"),
    ("ft-latch-reset", "somebody asked the sensor to clear its latched monitor condition"),
    ("ft-malformed", "bytes that are no record; nothing was published"),
    ("ft-moving", "the sensor's own sample counter moves again"),
    ("ft-no-answer", "no answer to any request to stream"),
    ("ft-out-of-order", "a packet that is older than the last; it does not count"),
    ("ft-refused", "the sensor refused a command"),
    ("ft-restart", "the packet counter began anew without being asked to"),
    ("ft-resumed", "samples come again after a silence"),
    ("ft-saturated", "the load is out of range: the reading is clipped"),
    ("ft-scale", "the sensor counts differently from what the samples so far were divided by"),
    ("ft-session", "all that was known of the stream was dropped: it begins anew"),
    ("ft-stale", "no fresh sample for too long: the last one must not be used any more"),
    ("ft-stalled", "packets go on with the same reading: the sensor's own sample counter stands still"),
    ("ft-start", "the sensor was asked to stream"),
    ("ft-start-resent", "no answer: the request to stream was sent again"),
    ("ft-stop", "the sensor was asked to stop"),
    ("ft-warning", "by its status word it measures, and something is latched or limited"),
    ("net-closed", "the connection was closed"),
    ("net-invalid", "bytes that are no packet of this stream"),
    ("net-page", "the sensor's page is not there, slow or not whole"),
    ("net-stranger", "somebody else sends to this port; it is not listened to"),
    ("net-taken", "a new peer takes the stream from a silent one"),
    ("net-unreachable", "the other side's port is closed, and its machine says so"),
    ("rsi-absent", "the configuration names what the frame does not have"),
    ("rsi-backlog", "frames were waiting when they were read: what is measured is old"),
    ("rsi-coarse", "fewer decimals of the measured pose say something than are printed"),
    ("rsi-decimals", "how many decimals the measured pose is printed with"),
    ("rsi-duplicate", "the same IPOC again"),
    ("rsi-frozen", "the same IPOC for the third time: the controller's clock stands"),
    ("rsi-gap", "frames are missing, by their IPOC"),
    ("rsi-hello", "a frame with nothing but an IPOC, before the exchange begins"),
    ("rsi-irregular", "the IPOC advanced by no multiple of its step"),
    ("rsi-late", "the robot controller counted replies as late or invalid (Delay D)"),
    ("rsi-malformed", "bytes that are no frame"),
    ("rsi-number", "a value that is no number, or not written as RSI writes one"),
    ("rsi-out-of-order", "a frame that is older than one that came before it; it is not answered"),
    ("rsi-restart", "the IPOC jumped: the controller began anew"),
    ("rsi-resumed", "frames come again after a silence"),
    ("rsi-silent", "no frame for longer than allowed"),
    ("rsi-spelling", "the frame spells TYPE, as only simulators do"),
    ("rsi-started", "the first frame of a session"),
    ("rsi-step", "the step of the IPOC was learned, or is another one"),
    ("rsi-type", "Type of the frame is not KUKA"),
    ("rsi-unanswered", "a frame came before the one before it was answered"),
    ("rsi-unexpected", "the frame has what the configuration does not name"),
    ("rsi-wrap", "the IPOC passed 2^32"),
];

#[cfg(test)]
mod tests {
    use super::CLASSES;
    use crate::fault::TABLE;

    #[test]
    fn every_class_that_a_fault_shows_is_explained_once() {
        assert!(CLASSES.windows(2).all(|pair| pair[0].0 < pair[1].0), "sorted, each once");
        for class in TABLE.iter().flat_map(|row| row.classes) {
            assert!(CLASSES.iter().any(|(known, _)| known == class), "{class}");
        }
    }

    /// Every name that the program's own text has as the class of an event.
    #[test]
    fn every_class_of_the_events_is_explained() {
        for text in [include_str!("../rsi/event.rs"), include_str!("../ft/event.rs")] {
            let classes = text.split('"').filter(|part| part.starts_with("rsi-") || part.starts_with("ft-"));
            for class in classes.filter(|class| *class != "ft-sample") {
                assert!(CLASSES.iter().any(|(known, _)| known == &class), "{class}");
            }
        }
    }
}
