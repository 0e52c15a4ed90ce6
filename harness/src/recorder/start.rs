//! What a session says of itself at its beginning.

use crate::cell::{Carries, Cell};
use crate::error::Error;
use crate::model::Model;
use crate::recording::Kind;
use crate::simulate;
use drivers::ft::Transport;
use drivers::metres_from_millimetres;
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
    // The step to which a command is rounded: `compare` asks no more of the software than that.
    let decimals = cell.config.robot(Carries::Probe).map_or(0, |robot| i32::from(robot.decimals));
    let quantum_m = metres_from_millimetres(libm::pow(10.0, -f64::from(decimals)));
    record.insert("command_quantum_m".to_owned(), quantum_m.to_string());
    for (nth, remark) in remarks(cell)?.into_iter().enumerate() {
        record.insert(format!("remark_{}", nth + 1), remark);
    }
    Ok(record)
}

/// How the sensor of a cell is reached.
///
/// # Errors
/// When its settings cannot be used.
pub fn sensor_transport(cell: &Cell) -> Result<Transport, Error> {
    Ok(cell.sensor()?.transport())
}

/// What in a cell does not go together or misleads, and yet may be meant.
///
/// # Errors
/// When an Ethernet configuration cannot be used.
pub fn remarks(cell: &Cell) -> Result<Vec<String>, Error> {
    let mut remarks = Vec::new();
    for (nth, robot) in cell.config.robots.iter().enumerate() {
        let (config, file) = (cell.ethernet(nth)?, cell.rsi[nth].file.display());
        remarks.extend(config.traps().iter().map(|trap| format!("robot {}: {file}: {trap}", robot.name)));
        let (port, listen) = (config.port, robot.listen);
        if port != listen.port() && listen.port() != 0 {
            remarks.push(format!(
                "robot {}: {file} sends its controller to port {port}, and listen = {listen}",
                robot.name
            ));
        }
    }
    Ok(remarks)
}
