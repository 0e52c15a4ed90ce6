//! Status words of ATI's sensors, each bit in words. Source: reference/PROTOCOLS.md, section 2.2.
//!
//! Net F/T and Axia give the same bits other meanings: 30 is 'CPU or RAM' on the one and 'force or torque out of range' on the
//! other. Which one speaks is said by the product's name on its page ([`Model::of`]), never guessed from the word.
//!
//! | word | Net F/T | source |
//! |---|---|---|
//! | 0 | good | rule of a public driver |
//! | 0x80010000 | warning: a monitor condition is latched | the same |
//! | anything else | error; bit 17 alone beside the summary: saturated | the same |
//!
//! On the Axia bit 16 alone is a warning too, and bits 27 and 30 say that the load is out of range [inferred from the table].

use super::event::Health;
use serde::Deserialize;

/// Whose table of status bits holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// The box with a transducer at a cable.
    NetFt,
    /// The sensor with its electronics inside.
    Axia,
}

/// Set together with any error.
const SUMMARY: u32 = 1 << 31;
/// A monitor condition was met and is latched.
const LATCHED: u32 = 1 << 16;
/// Net F/T: the transducer is saturated.
const NET_FT_SATURATED: u32 = 1 << 17;
/// Axia: a gage, or the wrench, is out of range.
const AXIA_SATURATED: u32 = 1 << 27 | 1 << 30;

/// Net F/T, by bit.
const NET_FT: [&str; 32] = [
    "bit 0",
    "HTTP server",
    "temperature",
    "reference voltage or power",
    "serial link data unavailable",
    "supply voltage low",
    "supply voltage high",
    "analog ground",
    "gage excitation low",
    "gage excitation high",
    "analog watchdog",
    "flash memory (SPI)",
    "EEPROM (I2C)",
    "stack",
    "watchdog",
    "bit 15",
    "monitor condition latched",
    "transducer saturation or A/D",
    "DeviceNet",
    "EtherNet/IP",
    "RDT",
    "CAN",
    "network",
    "configuration does not fit the calibration",
    "settings invalid",
    "halted, configuration",
    "program memory",
    "serial link communication",
    "analog board",
    "digital board",
    "CPU or RAM",
    "error",
];

/// Axia, by bit.
const AXIA: [&str; 32] = [
    "temperature",
    "supply voltage",
    "broken gage",
    "busy",
    "bit 4",
    "other error",
    "bit 6",
    "bit 7",
    "bit 8",
    "bit 9",
    "bit 10",
    "bit 11",
    "bit 12",
    "bit 13",
    "bit 14",
    "bit 15",
    "monitor condition latched",
    "bit 17",
    "bit 18",
    "bit 19",
    "bit 20",
    "bit 21",
    "bit 22",
    "bit 23",
    "bit 24",
    "bit 25",
    "bit 26",
    "gage out of range",
    "simulated error",
    "calibration checksum",
    "force or torque out of range",
    "error",
];

impl Model {
    /// From the product's name; `None` where it says neither. The root of the page does not tell: both sensors use both.
    pub fn of(product: &str) -> Option<Model> {
        let plain: String = product.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
        if plain.contains("axia") {
            return Some(Model::Axia);
        }
        plain.contains("netft").then_some(Model::NetFt)
    }

    /// Name in settings.
    pub fn name(self) -> &'static str {
        match self {
            Model::NetFt => "net-ft",
            Model::Axia => "axia",
        }
    }

    /// The word that this sensor sends when the load is out of range.
    pub fn saturated(self) -> u32 {
        match self {
            Model::NetFt => SUMMARY | NET_FT_SATURATED,
            Model::Axia => SUMMARY | 1 << 30,
        }
    }

    /// What a word amounts to, and each of its bits in words, highest first.
    pub fn judge(self, status: u32) -> (Health, String) {
        let (table, saturated) = match self {
            Model::NetFt => (&NET_FT, NET_FT_SATURATED),
            Model::Axia => (&AXIA, AXIA_SATURATED),
        };
        let faults = status & !SUMMARY;
        let health = match faults {
            0 if status == 0 => Health::Good,
            LATCHED if status & SUMMARY != 0 || self == Model::Axia => Health::Warning,
            _ if faults & saturated != 0 && faults & !(saturated | LATCHED) == 0 => Health::Saturated,
            _ => Health::Error,
        };
        (health, words(status, table))
    }
}

/// Every set bit in words, highest first; 'good' if there is none.
pub(super) fn words(status: u32, table: &[&'static str]) -> String {
    let set: Vec<&str> =
        table.iter().enumerate().rev().filter(|(bit, _)| status >> bit & 1 == 1).map(|(_, text)| *text).collect();
    if set.is_empty() { "good".to_string() } else { set.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(model: Model, status: u32, health: Health, text: &str) {
        assert_eq!(model.judge(status), (health, text.to_string()), "{model:?} 0x{status:08x}");
    }

    #[test]
    fn the_same_word_is_another_thing_on_another_sensor() {
        check(Model::NetFt, 0, Health::Good, "good");
        check(Model::NetFt, 0x8001_0000, Health::Warning, "error, monitor condition latched");
        check(Model::NetFt, 0x8002_0000, Health::Saturated, "error, transducer saturation or A/D");
        check(Model::NetFt, 0xc000_0000, Health::Error, "error, CPU or RAM");
        check(Model::Axia, 0xc000_0000, Health::Saturated, "error, force or torque out of range");
        check(Model::Axia, 0x8800_0000, Health::Saturated, "error, gage out of range");
        check(Model::Axia, 0x8002_0000, Health::Error, "error, bit 17");
        check(Model::Axia, 0x0001_0000, Health::Warning, "monitor condition latched");
        // The rule of the Net F/T is exact: the latch without its summary bit is no warning.
        check(Model::NetFt, 0x0001_0000, Health::Error, "monitor condition latched");
        check(Model::NetFt, 0x8000_0000, Health::Error, "error");
    }

    #[test]
    fn each_bit_has_its_own_words() {
        for model in [Model::NetFt, Model::Axia] {
            let mut seen: Vec<String> = (0..32).map(|bit| model.judge(1 << bit).1).collect();
            seen.sort();
            seen.dedup();
            assert_eq!(seen.len(), 32, "{model:?}");
            assert_eq!(model.judge(model.saturated()).0, Health::Saturated);
        }
        assert_eq!(NET_FT[25], "halted, configuration");
        assert_eq!(AXIA[29], "calibration checksum");
    }

    #[test]
    fn the_product_says_which_table_holds() {
        for (product, model) in [
            ("Ethernet Axia", Some(Model::Axia)),
            ("AXIA80", Some(Model::Axia)),
            ("Axia Net F/T", Some(Model::Axia)),
            ("Digital Net F/T", Some(Model::NetFt)),
            ("NETFT", Some(Model::NetFt)),
            ("something", None),
        ] {
            assert_eq!(Model::of(product), model, "{product}");
        }
    }
}
