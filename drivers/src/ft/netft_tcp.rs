//! Net F/T over TCP, port 49151: one reading, and what a count is worth. Big-endian. Source: reference/PROTOCOLS.md, section 2.6.
//!
//! | bytes | request, 20 bytes |
//! |---|---|
//! | 0 | 0 READFT, 1 READCALINFO |
//! | 16..18 | READFT: which monitor conditions are on |
//! | 18..20 | READFT: bit 0 sets the bias, bit 1 clears the latch |
//!
//! | bytes | reply to READFT, 16 bytes | bytes | reply to READCALINFO, 24 bytes |
//! |---|---|---|---|
//! | 0..2 | 0x1234 | 0..2 | 0x1234 |
//! | 2..4 | upper half of the status | 2, 3 | codes of the units of force and torque |
//! | 4..16 | six i16; value = raw · factor / counts per unit | 4..12 | counts per unit of force and torque |
//! | | | 12..24 | six u16: the factors |
//!
//! Not covered: WRITETRANSFORM (2) and WRITECONDITION (3), which change the sensor.

use super::event::{Asked, Event, Malformed};
use super::rdt::HEADER;
use crate::units::{ForceUnit, SensorScale, TorqueUnit};

/// Port of the sensor.
pub const PORT: u16 = 49151;
/// Bytes of a request.
pub const REQUEST: usize = 20;
/// Bytes of the reply to READFT.
pub const READING: usize = 16;
/// Bytes of the reply to READCALINFO.
pub const INFO: usize = 24;

const READ_FT: u8 = 0;
const READ_CALIBRATION: u8 = 1;

/// A request to the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// One reading.
    Reading {
        /// Bit for each monitor condition that is on.
        conditions: u16,
        /// Set the zero at the present load.
        bias: bool,
        /// Clear the latched monitor condition.
        clear_latch: bool,
    },
    /// What a count is worth.
    Calibration,
}

impl Request {
    /// Its 20 bytes.
    pub fn encode(self) -> [u8; REQUEST] {
        let mut bytes = [0; REQUEST];
        match self {
            Request::Calibration => bytes[0] = READ_CALIBRATION,
            Request::Reading { conditions, bias, clear_latch } => {
                bytes[0] = READ_FT;
                bytes[16..18].copy_from_slice(&conditions.to_be_bytes());
                bytes[19] = u8::from(bias) | u8::from(clear_latch) << 1;
            }
        }
        bytes
    }

    /// From 20 bytes; `None` if they are neither request.
    pub fn decode(bytes: &[u8]) -> Option<Request> {
        let bytes: &[u8; REQUEST] = bytes.try_into().ok()?;
        match bytes[0] {
            READ_FT => Some(Request::Reading {
                conditions: u16::from_be_bytes([bytes[16], bytes[17]]),
                bias: bytes[19] & 1 != 0,
                clear_latch: bytes[19] & 2 != 0,
            }),
            READ_CALIBRATION => Some(Request::Calibration),
            _ => None,
        }
    }
}

/// What bytes on their way to the sensor ask it for, beside a reading.
pub fn overhear(bytes: &[u8]) -> Vec<Event> {
    let requests = bytes.chunks_exact(REQUEST).filter_map(Request::decode);
    let mut heard = Vec::new();
    for request in requests {
        let Request::Reading { bias, clear_latch, .. } = request else { continue };
        heard.extend(bias.then_some(Event::Bias { set: true }));
        heard.extend(clear_latch.then_some(Event::Asked(Asked::ResetLatch)));
    }
    heard
}

/// Reply to READCALINFO.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Info {
    /// Unit of force.
    pub force: ForceUnit,
    /// Unit of torque.
    pub torque: TorqueUnit,
    /// Counts per unit of force.
    pub counts_per_force: u32,
    /// Counts per unit of torque.
    pub counts_per_torque: u32,
    /// By what the raw numbers of a reading are multiplied.
    pub factors: [u16; 6],
}

impl Info {
    /// From its 24 bytes.
    ///
    /// # Errors
    /// Wrong length or header, a code of no unit, counts of zero.
    pub fn decode(bytes: &[u8]) -> Result<Info, Malformed> {
        let length = Malformed::Length { got: bytes.len(), wanted: "24 bytes" };
        let bytes: &[u8; INFO] = bytes.try_into().map_err(|_| length)?;
        header(bytes)?;
        let word = |at: usize| u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let unknown = |what: &str| Malformed::Answer(what.to_string());
        let (counts_per_force, counts_per_torque) = (word(4), word(8));
        if counts_per_force == 0 || counts_per_torque == 0 {
            return Err(unknown("counts per unit of zero"));
        }
        let force = ForceUnit::of_code(bytes[2]);
        let torque = TorqueUnit::of_code(bytes[3]);
        let mut factors = [0; 6];
        let (pairs, _) = bytes[12..].as_chunks::<2>();
        factors.iter_mut().zip(pairs).for_each(|(factor, pair)| *factor = u16::from_be_bytes(*pair));
        Ok(Info {
            force: force.ok_or_else(|| unknown(&format!("unit of force {}", bytes[2])))?,
            torque: torque.ok_or_else(|| unknown(&format!("unit of torque {}", bytes[3])))?,
            counts_per_force,
            counts_per_torque,
            factors,
        })
    }

    /// Its 24 bytes.
    pub fn encode(&self) -> Vec<u8> {
        let code = |place: Option<usize>| place.map_or(0, |index| index as u8 + 1);
        let mut bytes = HEADER.to_be_bytes().to_vec();
        bytes.push(code(ForceUnit::ALL.iter().position(|unit| *unit == self.force)));
        bytes.push(code(TorqueUnit::ALL.iter().position(|unit| *unit == self.torque)));
        bytes.extend(self.counts_per_force.to_be_bytes());
        bytes.extend(self.counts_per_torque.to_be_bytes());
        bytes.extend(self.factors.iter().flat_map(|factor| factor.to_be_bytes()));
        bytes
    }

    /// Counts per N and N m.
    pub fn scale(&self) -> Option<SensorScale> {
        let (per_force, per_torque) = (f64::from(self.counts_per_force), f64::from(self.counts_per_torque));
        SensorScale::from_units(per_force, self.force, per_torque, self.torque)
    }
}

/// Reply to READFT.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Status; its lower half does not travel.
    pub status: u32,
    /// Fx Fy Fz Tx Ty Tz before the factors.
    pub raw: [i16; 6],
}

impl Reading {
    /// From its 16 bytes.
    ///
    /// # Errors
    /// Wrong length or header.
    pub fn decode(bytes: &[u8]) -> Result<Reading, Malformed> {
        let length = Malformed::Length { got: bytes.len(), wanted: "16 bytes" };
        let bytes: &[u8; READING] = bytes.try_into().map_err(|_| length)?;
        header(bytes)?;
        let mut raw = [0; 6];
        let (pairs, _) = bytes[4..].as_chunks::<2>();
        raw.iter_mut().zip(pairs).for_each(|(value, pair)| *value = i16::from_be_bytes(*pair));
        Ok(Reading { status: u32::from(u16::from_be_bytes([bytes[2], bytes[3]])) << 16, raw })
    }

    /// Its 16 bytes.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = HEADER.to_be_bytes().to_vec();
        bytes.extend(((self.status >> 16) as u16).to_be_bytes());
        bytes.extend(self.raw.iter().flat_map(|value| value.to_be_bytes()));
        bytes
    }

    /// Force in N, torque in N m.
    pub fn wrench(&self, info: &Info) -> Option<[f64; 6]> {
        let mut counts = [0; 6];
        // The product of an i16 and a u16 fits an i32.
        let values = self.raw.iter().zip(info.factors).map(|(raw, factor)| i32::from(*raw) * i32::from(factor));
        counts.iter_mut().zip(values).for_each(|(count, value)| *count = value);
        info.scale().map(|scale| scale.wrench_from_counts(counts))
    }
}

fn header(bytes: &[u8]) -> Result<(), Malformed> {
    let got = u16::from_be_bytes([bytes[0], bytes[1]]);
    if got == HEADER {
        return Ok(());
    }
    Err(Malformed::Header { got: u64::from(got), wanted: u64::from(HEADER), at: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_have_twenty_bytes() {
        let reading = Request::Reading { conditions: 0x8001, bias: true, clear_latch: true };
        let mut wanted = [0; REQUEST];
        wanted[16..].copy_from_slice(&[0x80, 0x01, 0x00, 0x03]);
        assert_eq!(reading.encode(), wanted);
        assert_eq!(Request::decode(&wanted), Some(reading));
        wanted = [0; REQUEST];
        wanted[0] = 1;
        assert_eq!(Request::Calibration.encode(), wanted);
        assert_eq!(Request::decode(&wanted), Some(Request::Calibration));
        assert_eq!(Request::decode(&wanted[1..]), None);
        wanted[0] = 3;
        assert_eq!(Request::decode(&wanted), None);
    }

    #[test]
    fn a_reading_is_raw_times_factor_over_counts() {
        let factors = [400, 400, 400, 20, 20, 20];
        let info = Info {
            force: ForceUnit::Newton,
            torque: TorqueUnit::NewtonMillimetre,
            counts_per_force: 1_000_000,
            counts_per_torque: 1000,
            factors,
        };
        let bytes = info.encode();
        assert_eq!(bytes[..12], [0x12, 0x34, 2, 4, 0, 0x0f, 0x42, 0x40, 0, 0, 3, 0xe8]);
        assert_eq!(bytes[12..16], [1, 0x90, 1, 0x90]);
        assert_eq!(Info::decode(&bytes), Ok(info));
        let reading = Reading { status: 0x8002_0000, raw: [31_250, -8125, 0, 50, -1, i16::MIN] };
        let bytes = reading.encode();
        assert_eq!(bytes[..6], [0x12, 0x34, 0x80, 0x02, 0x7a, 0x12]);
        assert_eq!(Reading::decode(&bytes), Ok(reading));
        assert_eq!(reading.wrench(&info), Some([12.5, -3.25, 0.0, 0.001, -2e-5, -0.65536]));
    }

    #[test]
    fn what_is_no_reply_is_named() {
        assert_eq!(Reading::decode(&[0x12; 15]).map_err(|why| why.id()), Err("length"));
        assert_eq!(Reading::decode(&[0x12; 16]).map_err(|why| why.id()), Err("header"));
        let mut bytes = [0; INFO];
        bytes[..2].copy_from_slice(&[0x12, 0x34]);
        assert_eq!(Info::decode(&bytes), Err(Malformed::Answer("counts per unit of zero".to_string())));
        bytes[4..12].copy_from_slice(&[0, 0, 0, 1, 0, 0, 0, 1]);
        bytes[2] = 7;
        assert_eq!(Info::decode(&bytes), Err(Malformed::Answer("unit of force 7".to_string())));
    }
}
