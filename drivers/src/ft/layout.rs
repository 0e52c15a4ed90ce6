//! How the record of a laboratory's own box is described, as the table `[sensor.record]` of CELL.toml.
//!
//! | key | meaning |
//! |---|---|
//! | `length` | bytes of a record, 1 to 4096 |
//! | `framing` | `datagram` (one or more whole records, the default) or `stream` |
//! | `endian` | `little` or `big`, of every number |
//! | `sync` | `{ at, bytes }`: bytes that are always the same, as hex digits |
//! | `force`, `torque` | `{ at = [x, y, z], type, scale, offset, unit }`: value = raw · scale + offset, in the unit |
//! | `sequence` | `{ at, type }`: counts the records |
//! | `status` | `{ at, type, good, mask, saturated }`: good where `status & mask == good`; a bit of `saturated` says overload |
//! | `time` | `{ at, type, hz }`: clock of the device, `hz` ticks in a second |
//! | `crc` | `{ name, at, from, to, endian }`: over the bytes `from..to` |
//! | `start`, `stop` | request as hex digits, if the box wants one |
//!
//! Types: u8 u16 u32 u64 i8 i16 i32 i64 f32 f64. Not covered: numbers of other widths, and records of changing length.

use super::checksum::Checksum;
use super::settings::SettingsError;
use crate::units::{ForceUnit, TorqueUnit};
use serde::Deserialize;

/// Longest record.
pub const LENGTH_MAX: usize = 4096;

/// Order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Endian {
    /// Lowest byte first.
    Little,
    /// Highest byte first.
    Big,
}

/// Whether the bytes come in datagrams.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Framing {
    /// A datagram is one or more whole records.
    #[default]
    Datagram,
    /// Records come in pieces.
    Stream,
}

/// Type of a number on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "they are named as in Rust")]
pub enum Kind {
    U8,
    U16,
    U32,
    U64,
    I8,
    I16,
    I32,
    I64,
    F32,
    F64,
}

impl Kind {
    /// Its bytes.
    pub fn bytes(self) -> usize {
        match self {
            Kind::U8 | Kind::I8 => 1,
            Kind::U16 | Kind::I16 => 2,
            Kind::U32 | Kind::I32 | Kind::F32 => 4,
            Kind::U64 | Kind::I64 | Kind::F64 => 8,
        }
    }

    /// Whether it is a floating-point number.
    pub fn floats(self) -> bool {
        matches!(self, Kind::F32 | Kind::F64)
    }

    /// The ends of a whole number's range.
    pub fn limits(self) -> Option<(i128, i128)> {
        let bits = self.bytes() as u32 * 8;
        match self {
            Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => Some((0, (1_i128 << bits) - 1)),
            Kind::I8 | Kind::I16 | Kind::I32 | Kind::I64 => Some((-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1)),
            Kind::F32 | Kind::F64 => None,
        }
    }
}

/// One number for all three axes, or one for each.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum PerAxis {
    /// The same for all.
    All(f64),
    /// x, y, z.
    Each([f64; 3]),
}

impl PerAxis {
    /// x, y, z.
    pub fn values(self) -> [f64; 3] {
        match self {
            PerAxis::All(value) => [value; 3],
            PerAxis::Each(values) => values,
        }
    }
}

/// Three components of a force or a torque.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Vector {
    /// First byte of x, y, z.
    pub at: [usize; 3],
    /// Type of each.
    #[serde(rename = "type")]
    pub kind: Kind,
    /// What one of the raw numbers is worth, in the unit.
    #[serde(default = "one")]
    pub scale: PerAxis,
    /// Added after the scale, in the unit.
    #[serde(default = "zero")]
    pub offset: PerAxis,
    /// `N`, `kN`, `lbf`, … for a force; `Nm`, `Nmm`, `lbf-in`, … for a torque.
    pub unit: String,
}

fn one() -> PerAxis {
    PerAxis::All(1.0)
}

fn zero() -> PerAxis {
    PerAxis::All(0.0)
}

/// A counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// First byte.
    pub at: usize,
    /// Type.
    #[serde(rename = "type")]
    pub kind: Kind,
}

/// A status word of up to 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct StatusField {
    /// First byte.
    pub at: usize,
    /// Type.
    #[serde(rename = "type")]
    pub kind: Kind,
    /// What a sound sensor says.
    #[serde(default)]
    pub good: u32,
    /// Bits that matter.
    #[serde(default = "all_bits")]
    pub mask: u32,
    /// Bits that say overload.
    #[serde(default)]
    pub saturated: u32,
}

fn all_bits() -> u32 {
    u32::MAX
}

/// The device's clock.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TimeField {
    /// First byte.
    pub at: usize,
    /// Type.
    #[serde(rename = "type")]
    pub kind: Kind,
    /// Ticks in a second; 1 for a floating-point number in seconds.
    pub hz: f64,
}

/// Bytes that are always the same.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Sync {
    /// First byte.
    #[serde(default)]
    pub at: usize,
    /// Hex digits.
    pub bytes: String,
}

/// Checksum of the record.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CrcField {
    /// Name in the catalogue, `sum-8` or `xor-8`.
    pub name: String,
    /// First byte of the checksum.
    pub at: usize,
    /// First byte that it covers.
    pub from: usize,
    /// Byte after the last that it covers.
    pub to: usize,
    /// Order of its bytes; that of the record unless it says otherwise.
    pub endian: Option<Endian>,
}

/// The table `[sensor.record]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RecordLayout {
    /// Bytes of a record.
    pub length: usize,
    /// How the bytes come.
    #[serde(default)]
    pub framing: Framing,
    /// Order of the bytes of every number.
    pub endian: Endian,
    /// Bytes that are always the same.
    pub sync: Option<Sync>,
    /// Force.
    pub force: Vector,
    /// Torque.
    pub torque: Vector,
    /// Counts the records.
    pub sequence: Option<Field>,
    /// Status.
    pub status: Option<StatusField>,
    /// Clock.
    pub time: Option<TimeField>,
    /// Checksum.
    pub crc: Option<CrcField>,
    /// What makes it stream, as hex digits.
    pub start: Option<String>,
    /// What stops it.
    pub stop: Option<String>,
}

/// A layout that was checked, ready to decode.
#[derive(Debug, Clone)]
pub struct Checked {
    /// As it was written.
    pub layout: RecordLayout,
    /// Bytes that are always the same, and where.
    pub sync: (usize, Vec<u8>),
    /// N and N m in one unit of force and torque.
    pub unit: [f64; 2],
    /// Checksum with its place and order.
    pub crc: Option<(Checksum, CrcField, Endian)>,
    /// Requests.
    pub start: Vec<u8>,
    /// Requests.
    pub stop: Vec<u8>,
}

impl RecordLayout {
    /// Checks every place, unit and name.
    ///
    /// # Errors
    /// Names the first key that cannot be used, with its value and its limit.
    pub fn check(&self) -> Result<Checked, SettingsError> {
        if self.length == 0 || self.length > LENGTH_MAX {
            return Err(no("record.length", format!("= {} bytes is outside [1, {LENGTH_MAX}]", self.length)));
        }
        let vectors = [("record.force.at", &self.force), ("record.torque.at", &self.torque)];
        for (name, vector) in vectors {
            vector.at.iter().try_for_each(|at| self.inside(name, *at, vector.kind.bytes()))?;
        }
        numbers("record.force.scale", &self.force)?;
        numbers("record.torque.scale", &self.torque)?;
        if let Some(field) = &self.sequence {
            self.inside("record.sequence.at", field.at, field.kind.bytes())?;
            whole("record.sequence.type", field.kind, 8)?;
        }
        if let Some(field) = &self.status {
            self.inside("record.status.at", field.at, field.kind.bytes())?;
            whole("record.status.type", field.kind, 4)?;
        }
        if let Some(field) = &self.time {
            self.inside("record.time.at", field.at, field.kind.bytes())?;
            if !(field.hz >= 1.0 && field.hz <= 1e9) {
                return Err(no("record.time.hz", format!("= {} Hz is outside [1, 1e9]", field.hz)));
            }
        }
        let force = ForceUnit::of_text(&self.force.unit).map(ForceUnit::newtons);
        let torque = TorqueUnit::of_text(&self.torque.unit).map(TorqueUnit::newton_metres);
        let unknown = |name, unit: &str, known: &str| no(name, format!("= \"{unit}\" is no unit; one of {known}"));
        let forces = ForceUnit::ALL.map(ForceUnit::text).join(", ");
        let torques = TorqueUnit::ALL.map(TorqueUnit::text).join(", ");
        let unit = [
            force.ok_or_else(|| unknown("record.force.unit", &self.force.unit, &forces))?,
            torque.ok_or_else(|| unknown("record.torque.unit", &self.torque.unit, &torques))?,
        ];
        let sync = self.checked_sync()?;
        let crc = self.checked_crc()?;
        let start = hex("record.start", self.start.as_deref().unwrap_or_default())?;
        let stop = hex("record.stop", self.stop.as_deref().unwrap_or_default())?;
        Ok(Checked { layout: self.clone(), sync, unit, crc, start, stop })
    }

    fn checked_sync(&self) -> Result<(usize, Vec<u8>), SettingsError> {
        let Some(sync) = &self.sync else {
            if self.framing == Framing::Stream {
                let help = "is missing: in a stream a record is found by bytes that are always the same";
                return Err(no("record.sync", help.to_string()));
            }
            return Ok((0, Vec::new()));
        };
        let bytes = hex("record.sync.bytes", &sync.bytes)?;
        self.inside("record.sync.at", sync.at, bytes.len())?;
        Ok((sync.at, bytes))
    }

    fn checked_crc(&self) -> Result<Option<(Checksum, CrcField, Endian)>, SettingsError> {
        let Some(field) = &self.crc else { return Ok(None) };
        let help =
            "is no checksum of the catalogue; for example crc-16-modbus, crc-16-ibm-sdlc, crc-32-iso-hdlc, sum-8";
        let checksum = Checksum::named(&field.name)
            .ok_or_else(|| no("record.crc.name", format!("= \"{}\" {help}", field.name)))?;
        self.inside("record.crc.at", field.at, checksum.bytes())?;
        let covers_itself = field.from < field.at + checksum.bytes() && field.at < field.to;
        if field.from >= field.to || field.to > self.length || covers_itself {
            let (from, to) = (field.from, field.to);
            let limit = format!("must lie within 0..{} and without the checksum itself", self.length);
            return Err(no("record.crc.to", format!("= {to}: the bytes {from}..{to} {limit}")));
        }
        Ok(Some((checksum, field.clone(), field.endian.unwrap_or(self.endian))))
    }

    fn inside(&self, field: &'static str, at: usize, bytes: usize) -> Result<(), SettingsError> {
        if bytes > 0 && at.checked_add(bytes).is_some_and(|end| end <= self.length) {
            return Ok(());
        }
        let length = self.length;
        Err(no(field, format!("= {at}: {bytes} bytes from there do not lie within the {length} bytes of the record")))
    }
}

fn no(field: &'static str, problem: String) -> SettingsError {
    SettingsError { field, problem }
}

fn numbers(field: &'static str, vector: &Vector) -> Result<(), SettingsError> {
    let scales = vector.scale.values();
    match scales.iter().chain(&vector.offset.values()).find(|value| !value.is_finite()) {
        Some(bad) => Err(no(field, format!("= {bad} is not finite"))),
        None if scales.contains(&0.0) => Err(no(field, "= 0 makes every reading the same".to_string())),
        None => Ok(()),
    }
}

fn whole(field: &'static str, kind: Kind, bytes_max: usize) -> Result<(), SettingsError> {
    if kind.floats() || kind.bytes() > bytes_max {
        return Err(no(field, format!("= {kind:?} is no whole number of at most {bytes_max} bytes")));
    }
    Ok(())
}

/// Bytes of hex digits; spaces are allowed.
fn hex(field: &'static str, text: &str) -> Result<Vec<u8>, SettingsError> {
    let digits: Vec<Option<u32>> = text.chars().filter(|digit| *digit != ' ').map(|digit| digit.to_digit(16)).collect();
    let (pairs, odd) = digits.as_chunks::<2>();
    let bytes: Option<Vec<u8>> = pairs.iter().map(|[high, low]| Some(((*high)? << 4 | (*low)?) as u8)).collect();
    match bytes {
        Some(bytes) if odd.is_empty() && bytes.len() <= LENGTH_MAX => Ok(bytes),
        _ => Err(no(field, format!("= \"{text}\" is not an even number of hex digits, at most {LENGTH_MAX} bytes"))),
    }
}
