//! Tables of numbers: one line of names, then one sample a line, all on one clock.

use std::path::Path;

use super::collect::Collector;
use super::map::CsvMap;
use super::records::Source;
use super::session::{Pose, Wrench};
use crate::error::Error;

const UPRIGHT_XYZW: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// A column that is wanted, where it is, and its factor.
struct Column {
    name: String,
    index: usize,
    factor: f64,
}

struct Columns {
    time: Column,
    commanded: Option<Column>,
    measured: Option<Column>,
    sensed: Option<Column>,
    applied: Option<Column>,
}

/// Reads a table into the collector's streams. Returns the names of the mapped columns.
pub(super) fn read(
    name: &Path,
    source: &mut dyn Source,
    table: &CsvMap,
    into: &mut Collector<'_>,
) -> Result<(), Error> {
    let mut reader = csv::ReaderBuilder::new().flexible(false).trim(csv::Trim::All).from_reader(source);
    let names = reader.byte_headers().map_err(|error| bad_row(&error).file(name))?;
    let names: Vec<String> =
        names.iter().map(|cell| String::from_utf8_lossy(cell).trim_start_matches('\u{feff}').to_owned()).collect();
    let columns = locate(table, &names).map_err(|error| error.file(name))?;
    let axis = into.map.axis.clone();
    let mut row = csv::ByteRecord::new();
    while reader.read_byte_record(&mut row).map_err(|error| bad_row(&error).file(name))? {
        let line = row.position().map_or(0, csv::Position::line);
        let cell = |column: &Column| number(&row, column, line).map_err(|error| error.file(name));
        let time_ns = (cell(&columns.time)? * 1e9).round();
        if time_ns.abs() >= i64::MAX as f64 {
            let what = format!("column `{}` is {time_ns} ns, beyond what 64 bits hold", columns.time.name);
            return Err(Error::new(what)
                .file(name)
                .place(format!("line {line}"))
                .help("correct time_s_per_unit in the map"));
        }
        let time_ns = time_ns as i64;
        let pose = |along_m: f64| Pose { position_m: axis.vector(along_m), orientation_xyzw: UPRIGHT_XYZW };
        if let Some(column) = &columns.commanded {
            into.commanded.add(time_ns, pose(cell(column)?));
        }
        if let Some(column) = &columns.measured {
            into.measured.add(time_ns, pose(cell(column)?));
        }
        if let Some(column) = &columns.sensed {
            into.sensed.add(time_ns, Wrench { force_n: axis.vector(cell(column)?), torque_n_m: [0.0; 3] });
        }
        if let Some(column) = &columns.applied {
            into.applied.add(time_ns, cell(column)?);
        }
    }
    Ok(())
}

fn locate(table: &CsvMap, names: &[String]) -> Result<Columns, Error> {
    let find = |name: &str, factor: f64| {
        let index = names.iter().position(|other| other == name).ok_or_else(|| {
            Error::new(format!("column `{name}` is missing; the table has {}", names.join(", ")))
                .place("line 1")
                .help("name the right column in the map: [csv]")
        })?;
        Ok::<_, Error>(Column { name: name.to_owned(), index, factor })
    };
    let maybe = |name: &Option<String>, factor: f64| name.as_ref().map(|name| find(name, factor)).transpose();
    Ok(Columns {
        time: find(&table.time, table.time_s_per_unit)?,
        commanded: maybe(&table.commanded, table.commanded_m_per_unit)?,
        measured: maybe(&table.measured, table.measured_m_per_unit)?,
        sensed: maybe(&table.sensed, table.sensed_n_per_unit)?,
        applied: maybe(&table.applied, table.applied_n_per_unit)?,
    })
}

fn number(row: &csv::ByteRecord, column: &Column, line: u64) -> Result<f64, Error> {
    let text = String::from_utf8_lossy(row.get(column.index).unwrap_or_default());
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.map(|number| number * column.factor).ok_or_else(|| {
        let cell = if text.is_empty() { "empty".to_owned() } else { format!("`{text}`") };
        Error::new(format!("column `{}` is {cell}, expected a finite number", column.name))
            .place(format!("line {line}"))
            .help("remove the line, or cut the table before it; a removed line is then reported as a gap")
    })
}

fn bad_row(error: &csv::Error) -> Error {
    let line = error.position().map(|position| format!("line {}", position.line()));
    let what = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} columns, the first line has {expected_len}")
        }
        csv::ErrorKind::Io(error) => format!("reading failed: {error}"),
        _ => error.to_string(),
    };
    let bare = Error::new(what).help("every line needs one cell per name of the first line");
    match line {
        Some(line) => bare.place(line),
        None => bare,
    }
}
