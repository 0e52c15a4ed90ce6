//! From names of the configuration to elements of the wire.
//!
//! | name | on the wire |
//! |---|---|
//! | `DEF_RIst`, `DEF_RSol` | attributes X Y Z A B C |
//! | `DEF_AIPos`, `DEF_ASPos`, `DEF_MACur` | A1..A6, whatever the number of axes |
//! | `DEF_EIPos`, `DEF_ESPos`, `DEF_MECur` | E1..E6 |
//! | `DEF_Delay` | D |
//! | `DEF_Tech.Cn`, `DEF_Tech.Tn` (n = 1..6) | element Tech, attributes Cn1..Cn10, Tn1..Tn10 |
//! | `DEF_EStr` | text; taken only |
//! | `A.B` | attribute B of element A |
//! | `A` | text of element A |
//!
//! Another `DEF_…` in SEND is taken as a text: a recorder need not refuse what it does not know. Source:
//! reference/PROTOCOLS.md, sections 1.2 and 1.4.

use super::config::Channel;

/// One element of the wire and where its values belong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slot {
    /// Its name.
    pub element: String,
    /// Attribute (empty: the text) and index of its channel in the section.
    pub fields: Vec<(String, usize)>,
}

/// The elements of a section, each where its first channel stands.
pub fn layout(channels: &[Channel]) -> Vec<Slot> {
    let mut slots: Vec<Slot> = Vec::new();
    for (index, channel) in channels.iter().enumerate() {
        let at = slots.iter().position(|slot| slot.element == channel.element).unwrap_or_else(|| {
            slots.push(Slot { element: channel.element.clone(), fields: Vec::new() });
            slots.len() - 1
        });
        if channel.attributes.is_empty() {
            slots[at].fields.push((String::new(), index));
        }
        slots[at].fields.extend(channel.attributes.iter().map(|name| (name.clone(), index)));
    }
    slots
}

/// Element and attributes of a name; `None` when no element can have it.
pub(super) fn expand(tag: &str) -> Option<(String, Vec<String>)> {
    let named = |prefix: &str, count: u8| (1..=count).map(|i| format!("{prefix}{i}")).collect();
    let Some(internal) = tag.strip_prefix("DEF_") else {
        let (element, attribute) = match tag.split_once('.') {
            Some((element, attribute)) if is_name(attribute) => (element, vec![attribute.to_owned()]),
            Some(_) => return None,
            None => (tag, Vec::new()),
        };
        return is_name(element).then(|| (element.to_owned(), attribute));
    };
    let attributes = match internal {
        "RIst" | "RSol" => ["X", "Y", "Z", "A", "B", "C"].map(str::to_owned).to_vec(),
        "AIPos" | "ASPos" | "MACur" => named("A", 6),
        "EIPos" | "ESPos" | "MECur" => named("E", 6),
        "Delay" => vec!["D".to_owned()],
        _ => match internal.split_once('.') {
            Some(("Tech", set)) if is_generator(set) => return Some(("Tech".to_owned(), named(set, 10))),
            Some(_) => return None,
            None => Vec::new(),
        },
    };
    is_name(internal).then(|| (internal.to_owned(), attributes))
}

fn is_generator(set: &str) -> bool {
    matches!(set.as_bytes(), [b'C' | b'T', b'1'..=b'6'])
}

fn is_name(name: &str) -> bool {
    let length = (1..=32).contains(&name.len());
    length && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte))
}
