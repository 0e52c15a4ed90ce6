//! Tables made short.

use super::super::page::{Column, Row, Section, Table, Tone};

/// Heading of a column that holds words.
pub(super) fn words(label: impl Into<String>) -> Column {
    Column { label: label.into(), align_right: false }
}

/// Heading of a column that holds numbers.
pub(super) fn numbers(label: impl Into<String>) -> Column {
    Column { label: label.into(), align_right: true }
}

/// A row, with its mark if it has one.
pub(super) fn row(tone: Option<Tone>, cells: Vec<String>) -> Row {
    Row { cells, tone }
}

/// A table, or none if it has no rows.
pub(super) fn table(
    section: Section,
    title: &str,
    note: impl Into<String>,
    columns: Vec<Column>,
    rows: Vec<Row>,
) -> Option<Table> {
    (!rows.is_empty()).then(|| Table { title: title.to_owned(), note: note.into(), columns, rows, section })
}
