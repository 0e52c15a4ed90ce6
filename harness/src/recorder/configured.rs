//! What a cell says of its devices, held against their own files before anything is bound.

use crate::cell::{Cell, FamilyName, ModeName};
use crate::error::Error;
use crate::model::place;
use drivers::ft::Settings;
use drivers::rsi::{EthernetConfig, Mode, Transport};
use serde::Deserialize;

/// A decoder's settings as TOML has them.
pub(super) fn settings(cell: &Cell) -> Result<Settings, Error> {
    Settings::deserialize(toml::Value::Table(cell.config.sensor.protocol.clone())).map_err(|error| {
        Error::new(error.message().to_owned())
            .file(&cell.source.file)
            .place("[sensor]")
            .help("correct the settings of the sensor")
    })
}

/// The Ethernet configuration of a robot. That of a robot which reports no pose is refused: nothing could be made of its frames.
pub(super) fn ethernet(cell: &Cell, nth: usize) -> Result<EthernetConfig, Error> {
    let (file, robot) = (&cell.rsi[nth], &cell.config.robots[nth]);
    let refuse = |what: String| Error::new(what).file(&file.file);
    let config = EthernetConfig::parse(&file.text)
        .map_err(|error| refuse(error.to_string()).help("give the file that the robot controller loads"))?;
    if !config.sends("RIst") {
        let what = format!("SEND has no DEF_RIst: robot {} does not tell its measured pose", robot.name);
        return Err(refuse(what).help("add DEF_RIst to SEND, here and on the robot controller"));
    }
    if config.protocol == Transport::Tcp && robot.family != FamilyName::Krc2 {
        let span = place::in_list(&cell.source.text, "robot", nth, Some("family"));
        let what = format!("{} says TCP, and only a KRC2 speaks it", file.file.display());
        let error = Error::new(what).file(&cell.source.file).span(&cell.source.text, span);
        return Err(error.help("set family = \"krc2\", or PROTOCOL to UDP"));
    }
    Ok(config)
}

pub(super) fn mode(name: ModeName) -> Mode {
    match name {
        ModeName::Absolute => Mode::Absolute,
        ModeName::Relative => Mode::Relative,
    }
}

/// What does not go together and yet may be meant.
///
/// # Errors
/// When an Ethernet configuration cannot be used.
pub fn remarks(cell: &Cell) -> Result<Vec<String>, Error> {
    let mut remarks = Vec::new();
    for (nth, robot) in cell.config.robots.iter().enumerate() {
        let (port, listen) = (ethernet(cell, nth)?.port, robot.listen);
        if port != listen.port() && listen.port() != 0 {
            remarks.push(format!(
                "robot {}: {} sends its controller to port {port}, and listen = {listen}",
                robot.name,
                cell.rsi[nth].file.display()
            ));
        }
    }
    Ok(remarks)
}
