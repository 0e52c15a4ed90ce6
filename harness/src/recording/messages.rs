//! The bodies of the stamped geometry messages of ROS 2, in plain CDR (XCDR1).
//!
//! ```text
//! 00 01 00 00 | sec i32 | nanosec u32 | length u32, frame_id, 00 | padding to 8 | 6 or 7 × f64
//! ```
//! The first two bytes name the encapsulation: 00 01 is little endian, 00 00 is big endian; padding counts from the byte
//! after the four. Not read: parameter lists and XCDR2 (other first bytes), where alignment differs.

use byteorder::{BigEndian, LittleEndian};
use serde::de::{DeserializeOwned, Deserializer, Visitor};
use serde::{Deserialize, Serialize};

/// Full names, as rosbag2 writes them.
pub(super) const POSE: &str = "geometry_msgs/msg/PoseStamped";
pub(super) const TWIST: &str = "geometry_msgs/msg/TwistStamped";
pub(super) const WRENCH: &str = "geometry_msgs/msg/WrenchStamped";

/// Position and orientation x, y, z, w.
pub(super) type PoseBody = ([f64; 3], [f64; 4]);
/// Linear and angular part: of a wrench, or of a twist.
pub(super) type PairBody = ([f64; 3], [f64; 3]);

const NANOSECONDS_PER_SECOND: i64 = 1_000_000_000;
const ENCAPSULATION_LENGTH: usize = 4;
/// Most bytes that padding to a multiple of 4 leaves behind the last field.
const PADDING_MAX: usize = 3;

/// A text that is stepped over without a copy.
struct Skipped;

impl<'de> Deserialize<'de> for Skipped {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl Visitor<'_> for Any {
            type Value = Skipped;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a text")
            }
            fn visit_str<E>(self, _: &str) -> Result<Skipped, E> {
                Ok(Skipped)
            }
        }
        deserializer.deserialize_str(Any)
    }
}

/// Whether a schema name means this type; ROS 1 style and IDL style names are the same type.
pub(super) fn is_type(name: &str, wanted: &str) -> bool {
    let short = |text: &str| text.replace("::", "/").replace("/msg/", "/");
    name == wanted || short(name) == short(wanted)
}

/// Header stamp in ns, and the fields.
pub(super) fn decode<T: DeserializeOwned>(data: &[u8]) -> Result<(i64, T), String> {
    let Some((encapsulation, body)) = data.split_first_chunk::<ENCAPSULATION_LENGTH>() else {
        return Err(too_short::<T>(data.len()));
    };
    type Fields<T> = ((i32, u32), Skipped, T);
    let decoded: Result<(Fields<T>, usize), _> = match encapsulation {
        [0, 1, ..] => cdr_encoding::from_bytes::<Fields<T>, LittleEndian>(body),
        [0, 0, ..] => cdr_encoding::from_bytes::<Fields<T>, BigEndian>(body),
        [high, low, ..] => {
            return Err(format!("encapsulation {high:02x} {low:02x} is not plain cdr, expected 00 01 or 00 00"));
        }
    };
    let (((seconds, nanoseconds), _, fields), used) = decoded.map_err(|_| too_short::<T>(data.len()))?;
    if i64::from(nanoseconds) >= NANOSECONDS_PER_SECOND {
        return Err(format!("header.stamp.nanosec = {nanoseconds} ns is outside [0, 999999999]"));
    }
    let left = body.len() - used;
    if left > PADDING_MAX {
        return Err(format!("the message has {left} bytes after its last field, at most {PADDING_MAX} are padding"));
    }
    Ok((i64::from(seconds) * NANOSECONDS_PER_SECOND + i64::from(nanoseconds), fields))
}

fn too_short<T>(length: usize) -> String {
    // Encapsulation, stamp, length of an empty frame_id and the padding after it, then the fields, which are all f64.
    let least = ENCAPSULATION_LENGTH + 8 + 8 + size_of::<T>();
    format!("the message of {length} bytes is too short or its frame_id is damaged; it needs at least {least} bytes")
}

/// The message, little endian.
pub(super) fn encode<T: Serialize>(stamp_ns: i64, frame_id: &str, fields: &T) -> Result<Vec<u8>, String> {
    let seconds = i32::try_from(stamp_ns.div_euclid(NANOSECONDS_PER_SECOND))
        .map_err(|_| format!("stamp {stamp_ns} ns does not fit the 32 bits that ROS has for seconds"))?;
    let nanoseconds = stamp_ns.rem_euclid(NANOSECONDS_PER_SECOND) as u32;
    let mut bytes = vec![0, 1, 0, 0];
    cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, &((seconds, nanoseconds), frame_id, fields))
        .map_err(|error| format!("encoding failed: {error}"))?;
    Ok(bytes)
}

/// Stamp in ns and numbers of a stamped pose, twist or wrench; `None` for any other type or a body that is none.
pub(super) fn numbers(type_name: &str, data: &[u8]) -> Option<(i64, Vec<f64>)> {
    if is_type(type_name, POSE) {
        let (stamp_ns, (position, orientation)) = decode::<PoseBody>(data).ok()?;
        return Some((stamp_ns, [&position[..], &orientation].concat()));
    }
    let is_pair = is_type(type_name, TWIST) || is_type(type_name, WRENCH);
    let (stamp_ns, (first, second)) = if is_pair { decode::<PairBody>(data).ok()? } else { return None };
    Some((stamp_ns, [first, second].concat()))
}

/// The message with other numbers in their old places and byte order; everything else keeps its bytes.
pub(super) fn with_numbers(data: &[u8], numbers: &[f64]) -> Option<Vec<u8>> {
    let is_little = *data.get(1)? == 1;
    let length = data.get(12..16)?.try_into().ok()?;
    let length = if is_little { u32::from_le_bytes(length) } else { u32::from_be_bytes(length) };
    let start = ENCAPSULATION_LENGTH + (12 + usize::try_from(length).ok()?).next_multiple_of(8);
    let mut message = data.to_vec();
    for (place, number) in numbers.iter().enumerate() {
        let bytes = if is_little { number.to_le_bytes() } else { number.to_be_bytes() };
        message.get_mut(start + 8 * place..start + 8 * place + 8)?.copy_from_slice(&bytes);
    }
    Some(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One wrench in either byte order, laid out by hand from the module's picture.
    fn bytes(is_little: bool) -> Vec<u8> {
        let order4 = |bytes: [u8; 4]| if is_little { bytes } else { [bytes[3], bytes[2], bytes[1], bytes[0]] };
        let mut message = vec![0, u8::from(is_little), 0, 0];
        for word in [7_u32, 8, 3] {
            message.extend(order4(word.to_le_bytes()));
        }
        message.extend(*b"ft\0\0");
        for part in [1.0_f64, 2.0, 3.0, 4.0, 5.0, 6.0] {
            message.extend(if is_little { part.to_le_bytes() } else { part.to_be_bytes() });
        }
        message
    }

    #[test]
    fn both_byte_orders_decode() {
        for is_little in [true, false] {
            let (stamp_ns, body) = decode::<PairBody>(&bytes(is_little)).unwrap();
            assert_eq!((stamp_ns, body), (7_000_000_008, ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])));
        }
        assert_eq!(encode(7_000_000_008, "ft", &([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])).unwrap(), bytes(true));
    }

    #[test]
    fn numbers_are_replaced_where_they_stand() {
        for is_little in [true, false] {
            let old = bytes(is_little);
            let (stamp_ns, mut values) = numbers(WRENCH, &old).unwrap();
            assert_eq!((stamp_ns, values.as_slice()), (7_000_000_008, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].as_slice()));
            assert_eq!(with_numbers(&old, &values).unwrap(), old, "the same numbers are the same bytes");
            values[2] = -0.5;
            let new = with_numbers(&old, &values).unwrap();
            assert_eq!(numbers(WRENCH, &new), Some((7_000_000_008, values)));
            assert_eq!(new.iter().zip(&old).filter(|(a, b)| a != b).count(), 2, "3 and -0.5 differ in two bytes");
        }
        assert_eq!(numbers("std_msgs/msg/String", &bytes(true)), None);
    }

    #[test]
    fn a_message_of_another_length_is_refused() {
        let message = bytes(true);
        for length in 0..message.len() {
            assert!(decode::<PairBody>(&message[..length]).is_err(), "{length} bytes");
        }
        let longer = [message.as_slice(), &[0; 8]].concat();
        assert_eq!(
            decode::<PairBody>(&longer).unwrap_err(),
            "the message has 8 bytes after its last field, at most 3 are padding"
        );
    }

    #[test]
    fn names_of_one_type_agree() {
        for name in ["geometry_msgs/msg/PoseStamped", "geometry_msgs/PoseStamped", "geometry_msgs::msg::PoseStamped"] {
            assert!(is_type(name, POSE), "{name}");
        }
        assert!(!is_type("geometry_msgs/msg/Pose", POSE));
    }
}
