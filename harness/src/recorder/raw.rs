//! A robot's documents as they came: what `/rsi/NAME` keeps of each.
//!
//! What this program understands has fields of its own. Everything else (`GPIO`, `AIPos`, `MACur`, `FTC`, `Tech`, `AKorr`, text) is
//! kept in `elements`, as text and by the name that it has in an Ethernet configuration: `GPIO.01`, `AKorr.A1`, `EStr`. A name
//! that comes again in the same document gets a number: `GPIO.01#2`. Source: reference/PROTOCOLS.md, section 1.2.

use drivers::rsi::{Frame, POSE, Telegram};
use serde_json::{Map, Value, json};
use sim_core::time::Nanos;

/// A frame.
pub(super) fn frame(frame: &Frame) -> Value {
    let known = [
        ("IPOC", true),
        ("RIst", frame.pose_mm_deg.is_some()),
        ("EIPos", frame.external.is_some()),
        ("Delay", frame.delay.is_some()),
    ];
    json!({
        "direction": "from-robot", "received_ns": frame.received.0, "ipoc": frame.ipoc, "delay_d": frame.delay,
        "pose_mm_deg": frame.pose_mm_deg, "external": frame.external, "elements": others(&frame.telegram, &known),
    })
}

/// A reply with the correction under this name.
pub(super) fn reply(at: Nanos, telegram: &Telegram, correction: &str) -> Value {
    let ipoc = telegram.ipoc().map(|ipoc| ipoc.value);
    let sent = telegram.six(correction, POSE).and_then(Result::ok);
    let known = [("IPOC", ipoc.is_some()), (correction, sent.is_some())];
    json!({
        "direction": "to-robot", "received_ns": at.0, "ipoc": ipoc, "pose_mm_deg": sent, "type": telegram.kind,
        "elements": others(telegram, &known),
    })
}

/// All elements but those that have a field of their own.
fn others(telegram: &Telegram, known: &[(&str, bool)]) -> Map<String, Value> {
    let mut others = Map::new();
    let mut keep = |name: String, text: &str| {
        let mut key = name.clone();
        let mut count = 1;
        while others.contains_key(&key) {
            count += 1;
            key = format!("{name}#{count}");
        }
        others.insert(key, text.into());
    };
    let is_known = |tag: &str| known.iter().any(|(name, is_read)| *is_read && *name == tag);
    for element in telegram.elements.iter().filter(|element| !is_known(&element.tag)) {
        for (name, value) in &element.attributes {
            keep(format!("{}.{name}", element.tag), value);
        }
        if element.attributes.is_empty() || !element.text.is_empty() {
            keep(element.tag.clone(), &element.text);
        }
    }
    others
}
