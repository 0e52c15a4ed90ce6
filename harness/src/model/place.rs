//! Where a key stands in the text of a model file.

use std::ops::Range;
use toml_edit::{Document, Item, Table};

/// The bytes of `table.key = value`, or of a key at the top; the innermost table that is there, then the start of the file, if it
/// is not written.
pub fn of_key(text: &str, path: &str) -> Range<usize> {
    let Ok(document) = Document::parse(text) else { return 0..0 };
    let (mut table, mut path, mut whole) = (document.as_table(), path, 0..0);
    while let Some((name, key)) = path.split_once('.') {
        // A table may also stand on one line; its keys then have no place of their own.
        whole = table.get(name).and_then(Item::span).unwrap_or(whole);
        let Some(inner) = table.get(name).and_then(Item::as_table) else { return whole };
        (table, path) = (inner, key);
    }
    in_table(table, path).unwrap_or(whole)
}

/// The same in the `nth` effect; without a key, or if it is not written, the effect's id.
pub fn in_effect(text: &str, nth: usize, key: Option<&str>) -> Range<usize> {
    in_list(text, "effect", nth, key)
}

/// The same in the `nth` table of any list.
pub fn in_list(text: &str, list: &str, nth: usize, key: Option<&str>) -> Range<usize> {
    let Ok(document) = Document::parse(text) else { return 0..0 };
    let table = document.get(list).and_then(Item::as_array_of_tables).and_then(|tables| tables.get(nth));
    let Some(table) = table else { return 0..0 };
    key.and_then(|key| line(table, key)).or_else(|| in_table(table, "id")).unwrap_or(0..0)
}

fn in_table(table: &Table, key: &str) -> Option<Range<usize>> {
    line(table, key).or_else(|| table.span())
}

fn line(table: &Table, key: &str) -> Option<Range<usize>> {
    let start = table.key(key)?.span()?.start;
    Some(start..table.get(key)?.span()?.end)
}
