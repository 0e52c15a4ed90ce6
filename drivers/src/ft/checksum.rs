//! Checksums by name: those of the `crc` crate's catalogue up to 64 bits, and two plain ones that laboratory boxes use.
//!
//! | name | what |
//! |---|---|
//! | `sum-8` | sum of the bytes, modulo 256 |
//! | `xor-8` | exclusive or of the bytes |
//! | `crc-16-modbus`, `CRC-16/MODBUS`, `CRC_16_MODBUS`, … | the catalogue's, however it is written |

use crc::{Algorithm, Crc};

/// A checksum that can be computed.
#[derive(Clone)]
pub enum Checksum {
    /// Sum of the bytes.
    Sum8,
    /// Exclusive or of the bytes.
    Xor8,
    /// Up to 8 bits.
    Crc8(&'static str, Box<Crc<u8>>),
    /// Up to 16 bits.
    Crc16(&'static str, Box<Crc<u16>>),
    /// Up to 32 bits.
    Crc32(&'static str, Box<Crc<u32>>),
    /// Up to 64 bits.
    Crc64(&'static str, Box<Crc<u64>>),
}

impl core::fmt::Debug for Checksum {
    fn fmt(&self, to: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        to.write_str(self.name())
    }
}

impl Checksum {
    /// By its name; `None` if there is none of that name.
    pub fn named(name: &str) -> Option<Checksum> {
        let spelled = |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_uppercase() } else { '_' };
        let plain: String = name.chars().map(spelled).collect();
        match plain.as_str() {
            "SUM_8" => return Some(Checksum::Sum8),
            "XOR_8" => return Some(Checksum::Xor8),
            _ => {}
        }
        find(&plain, WIDTH_8)
            .map(|(name, algorithm)| Checksum::Crc8(name, Box::new(Crc::<u8>::new(algorithm))))
            .or_else(|| {
                find(&plain, WIDTH_16).map(|(name, found)| Checksum::Crc16(name, Box::new(Crc::<u16>::new(found))))
            })
            .or_else(|| {
                find(&plain, WIDTH_32).map(|(name, found)| Checksum::Crc32(name, Box::new(Crc::<u32>::new(found))))
            })
            .or_else(|| {
                find(&plain, WIDTH_64).map(|(name, found)| Checksum::Crc64(name, Box::new(Crc::<u64>::new(found))))
            })
    }

    /// Its name in the catalogue.
    pub fn name(&self) -> &'static str {
        match self {
            Checksum::Sum8 => "SUM_8",
            Checksum::Xor8 => "XOR_8",
            Checksum::Crc8(name, _)
            | Checksum::Crc16(name, _)
            | Checksum::Crc32(name, _)
            | Checksum::Crc64(name, _) => name,
        }
    }

    /// Bytes that it takes on the wire.
    pub fn bytes(&self) -> usize {
        let bits = match self {
            Checksum::Sum8 | Checksum::Xor8 => 8,
            Checksum::Crc8(_, crc) => crc.algorithm.width,
            Checksum::Crc16(_, crc) => crc.algorithm.width,
            Checksum::Crc32(_, crc) => crc.algorithm.width,
            Checksum::Crc64(_, crc) => crc.algorithm.width,
        };
        usize::from(bits).div_ceil(8)
    }

    /// Of these bytes.
    pub fn of(&self, bytes: &[u8]) -> u64 {
        match self {
            Checksum::Sum8 => bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)).into(),
            Checksum::Xor8 => bytes.iter().fold(0_u8, |sum, byte| sum ^ byte).into(),
            Checksum::Crc8(_, crc) => crc.checksum(bytes).into(),
            Checksum::Crc16(_, crc) => crc.checksum(bytes).into(),
            Checksum::Crc32(_, crc) => crc.checksum(bytes).into(),
            Checksum::Crc64(_, crc) => crc.checksum(bytes),
        }
    }
}

type Table<W> = &'static [(&'static str, &'static Algorithm<W>)];

fn find<W: crc::Width>(name: &str, table: Table<W>) -> Option<(&'static str, &'static Algorithm<W>)> {
    table.iter().find(|(known, _)| *known == name).copied()
}

macro_rules! table {
    ($($name:ident)*) => { &[$((stringify!($name), &crc::$name)),*] };
}

const WIDTH_8: Table<u8> = table!(
    CRC_3_GSM CRC_3_ROHC CRC_4_G_704 CRC_4_INTERLAKEN CRC_5_EPC_C1G2 CRC_5_G_704 CRC_5_USB CRC_6_CDMA2000_A
    CRC_6_CDMA2000_B CRC_6_DARC CRC_6_G_704 CRC_6_GSM CRC_7_MMC CRC_7_ROHC CRC_7_UMTS CRC_8_AUTOSAR CRC_8_BLUETOOTH
    CRC_8_CDMA2000 CRC_8_DARC CRC_8_DVB_S2 CRC_8_GSM_A CRC_8_GSM_B CRC_8_HITAG CRC_8_I_432_1 CRC_8_I_CODE CRC_8_LTE
    CRC_8_MAXIM_DOW CRC_8_MIFARE_MAD CRC_8_NRSC_5 CRC_8_OPENSAFETY CRC_8_ROHC CRC_8_SAE_J1850 CRC_8_SMBUS
    CRC_8_TECH_3250 CRC_8_WCDMA
);
const WIDTH_16: Table<u16> = table!(
    CRC_10_ATM CRC_10_CDMA2000 CRC_10_GSM CRC_11_FLEXRAY CRC_11_UMTS CRC_12_CDMA2000 CRC_12_DECT CRC_12_GSM
    CRC_12_UMTS CRC_13_BBC CRC_14_DARC CRC_14_GSM CRC_15_CAN CRC_15_MPT1327 CRC_16_ARC CRC_16_CDMA2000 CRC_16_CMS
    CRC_16_DDS_110 CRC_16_DECT_R CRC_16_DECT_X CRC_16_DNP CRC_16_EN_13757 CRC_16_GENIBUS CRC_16_GSM CRC_16_IBM_3740
    CRC_16_IBM_SDLC CRC_16_ISO_IEC_14443_3_A CRC_16_KERMIT CRC_16_LJ1200 CRC_16_M17 CRC_16_MAXIM_DOW CRC_16_MCRF4XX
    CRC_16_MODBUS CRC_16_NRSC_5 CRC_16_OPENSAFETY_A CRC_16_OPENSAFETY_B CRC_16_PROFIBUS CRC_16_RIELLO
    CRC_16_SPI_FUJITSU CRC_16_T10_DIF CRC_16_TELEDISK CRC_16_TMS37157 CRC_16_UMTS CRC_16_USB CRC_16_XMODEM
);
const WIDTH_32: Table<u32> = table!(
    CRC_17_CAN_FD CRC_21_CAN_FD CRC_24_BLE CRC_24_FLEXRAY_A CRC_24_FLEXRAY_B CRC_24_INTERLAKEN CRC_24_LTE_A
    CRC_24_LTE_B CRC_24_OPENPGP CRC_24_OS_9 CRC_30_CDMA CRC_31_PHILIPS CRC_32_AIXM CRC_32_AUTOSAR CRC_32_BASE91_D
    CRC_32_BZIP2 CRC_32_CD_ROM_EDC CRC_32_CKSUM CRC_32_ISCSI CRC_32_ISO_HDLC CRC_32_JAMCRC CRC_32_MEF CRC_32_MPEG_2
    CRC_32_XFER
);
const WIDTH_64: Table<u64> = table!(
    CRC_40_GSM CRC_64_ECMA_182 CRC_64_GO_ISO CRC_64_MS CRC_64_NVME CRC_64_REDIS CRC_64_WE CRC_64_XZ
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_algorithm_gives_its_own_check_value() {
        fn check<W: crc::Width + Copy + Into<u64>>(table: Table<W>) -> usize {
            for (name, algorithm) in table {
                let checksum = Checksum::named(name).unwrap();
                assert_eq!(checksum.of(b"123456789"), algorithm.check.into(), "{name}");
                assert_eq!(checksum.name(), *name);
                assert_eq!(checksum.bytes(), usize::from(algorithm.width).div_ceil(8));
            }
            table.len()
        }
        let count = check(WIDTH_8) + check(WIDTH_16) + check(WIDTH_32) + check(WIDTH_64);
        assert_eq!(count, 112, "all of the catalogue but CRC-82");
    }

    #[test]
    fn a_name_may_be_spelled_as_people_do() {
        for name in ["crc-16-modbus", "CRC-16/MODBUS", "CRC_16_MODBUS"] {
            assert_eq!(Checksum::named(name).map(|found| found.name()), Some("CRC_16_MODBUS"));
        }
        assert!(Checksum::named("crc-16").is_none());
        assert_eq!(Checksum::named("sum-8").map(|sum| sum.of(&[200, 100])), Some(44));
        assert_eq!(Checksum::named("xor-8").map(|sum| sum.of(&[0xf0, 0x3c])), Some(0xcc));
    }
}
