//! A frame as the controller writes it.
//!
//! | family and form | white space | place of IPOC |
//! |---|---|---|
//! | KRC4, KRC5, iiQKA | none | last |
//! | KRC2, flat | a line feed behind every element | last |
//! | KRC2, `Dat` | a line feed and tabs before every element | in the middle |
//!
//! | element | what it says here |
//! |---|---|
//! | `RIst`, `EIPos` | measured pose and external axes |
//! | `RSol`, `ESPos` | those at the start: they do not move while corrections run |
//! | `AIPos`, `ASPos` | constant angles: nothing here knows the arm |
//! | `MACur`, `MECur`, `Tech` | 0: no motors and no function generators |
//! | `Delay` | late replies, by the rule of the settings |
//! | a port of SEND | what the settings say, or `Stat` |
//!
//! Source: reference/PROTOCOLS.md, section 1.2. Not here: the length before a document (`PROTCOLLENGTH`), which belongs to the
//! stream ([`super::Frames::wrap`]).

use super::controller_settings::{Family, Settings};
use super::{EXTERNAL, Element, Form, Index, Kind, POSE, fixed, layout};

/// What changes from frame to frame.
pub(super) struct State<'a> {
    pub(super) measured_mm_deg: &'a [f64; 6],
    pub(super) external: &'a [f64; 6],
    pub(super) start_mm_deg: &'a [f64; 6],
    pub(super) start_external: &'a [f64; 6],
    pub(super) late: u32,
    pub(super) stat: u8,
    pub(super) ipoc: u64,
}

/// The document of a cycle.
pub(super) fn frame(settings: &Settings, state: &State<'_>) -> Vec<u8> {
    let mut elements: Vec<Element> = layout(&settings.config.send)
        .iter()
        .map(|slot| {
            let mut element = Element { tag: slot.element.clone(), ..Element::default() };
            for (attribute, channel) in &slot.fields {
                let text = value(settings, state, *channel, attribute);
                if attribute.is_empty() {
                    element.text = text;
                } else {
                    element.attributes.push((attribute.clone(), text));
                }
            }
            element
        })
        .collect();
    let place = if settings.form == Form::Dat { elements.len().div_ceil(2) } else { elements.len() };
    elements.insert(place, ipoc(settings, state.ipoc));
    document(settings, &elements)
}

/// What a KRC2 sends when its connection is made, before RSI runs: only the IPOC.
pub(super) fn greeting(settings: &Settings) -> Vec<u8> {
    document(settings, &[ipoc(settings, settings.first_ipoc)])
}

fn ipoc(settings: &Settings, value: u64) -> Element {
    // More zeros than a u64 has digits say nothing.
    let width = settings.ipoc_digits.min(20);
    Element { tag: "IPOC".to_owned(), text: format!("{value:0width$}"), ..Element::default() }
}

fn value(settings: &Settings, state: &State<'_>, channel: usize, attribute: &str) -> String {
    let channel = &settings.config.send[channel];
    let at = |names: &[&str; 6], values: &[f64; 6]| {
        names.iter().position(|name| *name == attribute).map_or(0.0, |axis| values[axis])
    };
    let axes = ["A1", "A2", "A3", "A4", "A5", "A6"];
    let number = match (channel.index, channel.element.as_str()) {
        (Index::Port(port), _) if settings.stat_port == Some(port) => f64::from(state.stat),
        (Index::Port(port), _) => settings.inputs.get(&port).copied().unwrap_or(0.0),
        (Index::Internal, "RIst") => at(&POSE, state.measured_mm_deg),
        (Index::Internal, "RSol") => at(&POSE, state.start_mm_deg),
        (Index::Internal, "AIPos" | "ASPos") => at(&axes, &settings.axes_deg),
        (Index::Internal, "EIPos") => at(&EXTERNAL, state.external),
        (Index::Internal, "ESPos") => at(&EXTERNAL, state.start_external),
        (Index::Internal, "Delay") => f64::from(state.late),
        (Index::Internal, _) => 0.0,
    };
    let decimals = match channel.kind {
        Kind::String => return settings.texts.get(&channel.element).cloned().unwrap_or_default(),
        Kind::Bool | Kind::Long => 0,
        Kind::Double => settings.decimals,
    };
    // The controller lets no number in that is not finite, and the settings' own are checked when it is made.
    fixed(number, decimals).unwrap_or_default()
}

fn document(settings: &Settings, elements: &[Element]) -> Vec<u8> {
    let (before, open, close) = match (settings.family, settings.form) {
        (_, Form::Dat) => ("\n\t\t", "\n\t<Dat TaskType=\"b\">", "\n\t</Dat>\n"),
        (Family::Krc2, Form::Flat) => ("\n", "", "\n"),
        (_, Form::Flat) => ("", "", ""),
    };
    let mut text = format!("<Rob Type=\"KUKA\">{open}");
    for Element { tag, attributes, text: inner } in elements {
        text += before;
        text += &format!("<{tag}");
        for (name, value) in attributes {
            text += &format!(" {name}=\"{value}\"");
        }
        text += &if attributes.is_empty() { format!(">{inner}</{tag}>") } else { "/>".to_owned() };
    }
    text += close;
    text += "</Rob>";
    // Behind a length the document ends with its closing tag: how a real one counts a line feed there is not known.
    if settings.family == Family::Krc2 && !settings.config.length_prefix {
        text.push('\n');
    }
    let mut bytes = text.into_bytes();
    let padded = settings.frame_bytes.min(super::telegram::DOCUMENT_MAX);
    bytes.resize(bytes.len().max(padded), 0);
    bytes
}
