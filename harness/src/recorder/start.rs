//! What a session says of itself at its beginning.

use crate::cell::Cell;
use crate::error::Error;
use crate::model::Model;
use crate::recording::Kind;
use crate::simulate;
use drivers::ft::Transport;
use sim_core::effect::Catalog;
use sim_core::space::Axis;
use std::collections::BTreeMap;

/// The `session` record: what the operator believes of the cell, as its model says it, and what was done.
///
/// # Errors
/// When the model cannot be read.
pub fn session_record(
    cell: &Cell,
    catalog: &Catalog<Axis>,
    kind: Kind,
    how: &str,
) -> Result<BTreeMap<String, String>, Error> {
    let model = Model::parse(&cell.model.file.display().to_string(), &cell.model.text, catalog)?;
    let mut record = simulate::believed(&model, model.plant.mass_kg, kind);
    record.insert("cell".to_owned(), cell.config.name.clone());
    record.insert("recorded_as".to_owned(), how.to_owned());
    Ok(record)
}

/// How the sensor of a cell is reached.
///
/// # Errors
/// When its settings cannot be used.
pub fn sensor_transport(cell: &Cell) -> Result<Transport, Error> {
    Ok(super::devices::settings(cell)?.transport())
}
