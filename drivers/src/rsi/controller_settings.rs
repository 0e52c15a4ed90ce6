//! How a virtual robot controller is set up: what the RSI context and the configuration file hold on a real one.
//!
//! | field | on a real controller | default |
//! |---|---|---|
//! | `cycle_ms` | `IPO_FAST` 4 ms, `IPO` 12 ms | 4, on a KRC2 12 |
//! | `decimals` | `Precision` of the ETHERNET object | 1, on a KRC2 4 |
//! | `late` | `Timeout` of the ETHERNET object, `eERXmaxLatePackages` | total, 10; on a KRC2 total, 100 |
//! | `warning` | `eERXmaxLateInPercent`, `eERXmaxFieldOfView` | none; on a KRC2 50 % of 1000 |
//! | `limits` | POSCORR, POSCORRMON, AXISCORREXT | KUKA's own |
//!
//! Source: reference/PROTOCOLS.md, sections 1.5 and 1.6. Not modelled: the filter of `IPO`, of which nothing is documented.

use super::controller_late::LateRule;
use super::controller_limits::Limits;
use super::{EthernetConfig, Form, Mode};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// First number that 32 bits do not hold.
pub(super) const TWO_TO_32: u64 = 1 << 32;

/// Family of robot controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// KSS 8.2 to 8.6, RSI 3 and 4.
    Krc4,
    /// KSS 8.7, RSI 5.
    Krc5,
    /// iiQKA.OS2, RSI 6: a reply that names what RECEIVE does not is refused.
    IiQka,
    /// `Ethernet.RSI.XML` 1.x, RSI 2.
    Krc2,
}

/// A virtual robot controller before it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Its Ethernet configuration.
    pub config: EthernetConfig,
    /// What it is.
    pub family: Family,
    /// Whether its elements stand in `<Dat>`.
    pub form: Form,
    /// What a correction means. Pairs with HOLDON that are dangerous are taken, as a real controller takes them.
    pub mode: Mode,
    /// Time between two frames, in ms; IPOC grows by it.
    pub cycle_ms: u32,
    /// Decimals of what it sends.
    pub decimals: u8,
    /// IPOC of the first frame.
    pub first_ipoc: u64,
    /// Whether IPOC goes on at 0 after 2^32 - 1.
    pub ipoc_wraps: bool,
    /// Fewest digits of IPOC; zeros stand before it.
    pub ipoc_digits: usize,
    /// Fewest bytes of a frame; NUL stands behind it.
    pub frame_bytes: usize,
    /// Element of RECEIVE that drives POSCORR.
    pub correction: String,
    /// Element of RECEIVE that drives AXISCORREXT.
    pub external: String,
    /// Element of RECEIVE that drives STOP.
    pub stop: String,
    /// Limits of the corrections.
    pub limits: Limits,
    /// When late replies stop it.
    pub late: LateRule,
    /// When late replies are worth a warning; a share of a window.
    pub warning: Option<LateRule>,
    /// Whether a reply that cannot be read stops it (RSIBad). Otherwise such a reply counts as late.
    pub bad_stops: bool,
    /// Joint angles in degrees that it reports: constant, since nothing here knows the arm.
    pub axes_deg: [f64; 6],
    /// Values at the ports of SEND; 0 where nothing is said.
    pub inputs: BTreeMap<u8, f64>,
    /// Port of SEND that carries `Stat` of POSCORR.
    pub stat_port: Option<u8>,
    /// Texts of SEND by element, such as `ComStatus`; empty where nothing is said.
    pub texts: BTreeMap<String, String>,
}

impl Settings {
    /// A controller of this family with this configuration; the rest as KUKA delivers it.
    pub fn new(config: EthernetConfig, family: Family) -> Self {
        let krc2 = family == Family::Krc2;
        Settings {
            config,
            family,
            form: Form::Flat,
            mode: Mode::Absolute,
            cycle_ms: if krc2 { 12 } else { 4 },
            decimals: if krc2 { 4 } else { 1 },
            first_ipoc: 0,
            ipoc_wraps: false,
            ipoc_digits: 1,
            frame_bytes: 0,
            correction: "RKorr".to_owned(),
            external: "EKorr".to_owned(),
            stop: "Stop".to_owned(),
            limits: Limits::KUKA,
            late: LateRule::Total { limit: if krc2 { 100 } else { 10 } },
            warning: krc2.then_some(LateRule::Percent { limit: 50.0, window: 1000 }),
            bad_stops: true,
            axes_deg: [0.0, -90.0, 90.0, 0.0, 0.0, 0.0],
            inputs: BTreeMap::new(),
            stat_port: None,
            texts: BTreeMap::new(),
        }
    }

    /// IPOC passes 2^32 with the frame of this cycle; `wraps`: that frame has 0.
    pub fn cross_at(&mut self, cycle: u64, wraps: bool) {
        self.first_ipoc = TWO_TO_32.saturating_sub(cycle.saturating_mul(u64::from(self.cycle_ms)));
        self.ipoc_wraps = wraps;
    }
}
