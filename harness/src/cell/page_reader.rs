//! The computer's side of the sensor's page: read before the sensor is asked to stream, and held against the cell's file.

use super::clock::WallClock;
use super::config::Cell;
use crate::error::Error;
use drivers::ft::Calibration;
use drivers::ft::http::PAGE;
use drivers::net::http_get;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

/// How often the page is asked for.
const TRIES: u32 = 3;
/// Between two tries: the server of a sensor refuses quick calls.
const PAUSE: Duration = Duration::from_millis(300);
/// How long a page may take. Chosen.
const LIMIT: Duration = Duration::from_secs(2);

/// Reads the page at this address. A try that fails is counted in `events`.
///
/// # Errors
/// When no try brings a page, or the page is that of another sensor than the cell's.
pub fn check_page(cell: &Cell, address: SocketAddr, events: &mut BTreeMap<String, u64>) -> Result<(), Error> {
    let page = read(address, events)?;
    let differences = cell.sensor()?.differences(&page).map_err(|error| cell.sensor_error(&error))?;
    let Some((key, here, there)) = differences.first() else { return Ok(()) };
    let what = format!(
        "{key} = {here}, and the page of the sensor at {address} says {there}: this is the configuration for another sensor"
    );
    let help = "give the table [sensor] what the page says, or connect the sensor that it is for";
    Err(cell.at(&format!("sensor.{key}"), &what, help))
}

fn read(address: SocketAddr, events: &mut BTreeMap<String, u64>) -> Result<Calibration, Error> {
    let clock = WallClock::new();
    let mut why = String::new();
    for attempt in 0..TRIES {
        if attempt > 0 {
            std::thread::sleep(PAUSE);
        }
        let page = http_get(&|| clock.now(), address, PAGE, LIMIT).map_err(|error| error.to_string());
        match page.and_then(|text| Calibration::parse(&text).map_err(|error| error.to_string())) {
            Ok(page) => return Ok(page),
            Err(error) => {
                *events.entry("net-page".to_owned()).or_default() += 1;
                why = error;
            }
        }
    }
    Err(Error::new(format!("the sensor's page cannot be read, {TRIES} tries: {why}"))
        .help("correct the address `page` of [sensor], or take it out: then the counts of the cell are believed"))
}
