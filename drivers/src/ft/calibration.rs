//! The page on which ATI's sensors say what a count is worth: `netftapi2.xml`, and `netftcalapi.xml` for the calibration alone.
//! Source: reference/PROTOCOLS.md, section 2.6.
//!
//! | element | meaning | on `netftcalapi.xml` |
//! |---|---|---|
//! | `prodname` | product; says whose status bits hold | |
//! | `cfgcpf`, `cfgcpt` | counts per unit of force and torque | `calcpf`, `calcpt` |
//! | `scfgfu`, `scfgtu` | units as text: `N`, `lbf`, …; `Nm` or `N-m`, … | |
//! | `cfgfu`, `cfgtu` | units as codes, 1 to 6 | `calfu`, `caltu` |
//! | `cfgcalsn` | serial number of the calibration | `calsn` |
//!
//! Roots: `netft` or `netFTApi`; `netftCalibration` for the calibration alone. Counts and units have no default: a page without
//! them is an error, and so is one whose code and text contradict each other, since a wrong factor looks like a sound wrench.

use super::event::Event;
use super::rdt::Rdt;
use super::status::Model;
use super::{Client, Unable};
use crate::units::{ForceUnit, SensorScale, TorqueUnit};
use quick_xml::Reader;
use quick_xml::events::Event as Xml;
use std::collections::BTreeMap;
use thiserror::Error;

/// Longest page that is read.
pub const PAGE_MAX: usize = 256 * 1024;
/// Most elements of a page.
const ELEMENTS_MAX: usize = 4096;
/// Roots of a page of the sensor.
const ROOTS: [&str; 2] = ["netft", "netFTApi"];
/// Root of a page of the calibration alone.
const CALIBRATION_ROOT: &str = "netftCalibration";

/// A page that says nothing usable.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PageError {
    /// Too long for a page of a sensor.
    #[error("a page of {0} bytes, limit {PAGE_MAX}; is this the sensor's address?")]
    Long(usize),
    /// It ends before its last element does.
    #[error("the page ends at byte {at} inside <{element}>: only a part came, ask again")]
    Half {
        /// Bytes that came.
        at: usize,
        /// Innermost element that is open.
        element: String,
    },
    /// It is no XML.
    #[error("not XML at byte {at}: {why}")]
    Xml {
        /// Where.
        at: u64,
        /// The reader's words.
        why: String,
    },
    /// The page of something else.
    #[error("the page's root is <{0}>, not <netft>, <netFTApi> or <netftCalibration>; is this the sensor's address?")]
    Root(String),
    /// An element that must be there.
    #[error("the page has no <{0}>, and it has no default")]
    Missing(&'static str),
    /// An element whose value cannot be used.
    #[error("<{element}> is \"{value}\", {wanted}")]
    Value {
        /// Which.
        element: &'static str,
        /// What it says.
        value: String,
        /// What it may say.
        wanted: &'static str,
    },
    /// Code and text of a unit contradict each other.
    #[error("<{code_element}> says {code}, <{text_element}> says {text}: one of them is wrong, look at the sensor")]
    Contradiction {
        /// Element with the code.
        code_element: &'static str,
        /// Its unit.
        code: &'static str,
        /// Element with the text.
        text_element: &'static str,
        /// Its unit.
        text: &'static str,
    },
}

/// What the page says.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Product; empty on a page of the calibration alone.
    pub product: String,
    /// Whose status bits hold, if the product says so.
    pub model: Option<Model>,
    /// Counts per unit of force.
    pub counts_per_force: f64,
    /// Counts per unit of torque.
    pub counts_per_torque: f64,
    /// Unit of force.
    pub force: ForceUnit,
    /// Unit of torque.
    pub torque: TorqueUnit,
    /// Serial number of the calibration.
    pub serial: Option<String>,
    /// Every element of the page with its text, for the record.
    pub elements: BTreeMap<String, String>,
}

impl Calibration {
    /// Reads a page.
    ///
    /// # Errors
    /// What is missing, wrong or contradictory, or where the page breaks off.
    pub fn parse(page: &str) -> Result<Calibration, PageError> {
        let (root, elements) = read(page)?;
        let names = match root.as_str() {
            CALIBRATION_ROOT => Names::CALIBRATION,
            known if ROOTS.contains(&known) => Names::SENSOR,
            _ => return Err(PageError::Root(root)),
        };
        let product = match names.product {
            Some(name) => required(&elements, name)?.to_string(),
            None => String::new(),
        };
        let model = Model::of(&product);
        let counts_per_force = counts(&elements, names.counts[0])?;
        let counts_per_torque = counts(&elements, names.counts[1])?;
        let (force, torque) = (names.force(&elements)?, names.torque(&elements)?);
        let serial = elements.get(names.serial).filter(|serial| !serial.is_empty()).cloned();
        Ok(Calibration { product, model, counts_per_force, counts_per_torque, force, torque, serial, elements })
    }

    /// Counts per N and N m.
    pub fn scale(&self) -> Option<SensorScale> {
        SensorScale::from_units(self.counts_per_force, self.force, self.counts_per_torque, self.torque)
    }
}

/// Names of the elements on one of the two pages.
struct Names {
    product: Option<&'static str>,
    counts: [&'static str; 2],
    codes: [&'static str; 2],
    texts: Option<[&'static str; 2]>,
    serial: &'static str,
}

impl Names {
    const SENSOR: Names = Names {
        product: Some("prodname"),
        counts: ["cfgcpf", "cfgcpt"],
        codes: ["cfgfu", "cfgtu"],
        texts: Some(["scfgfu", "scfgtu"]),
        serial: "cfgcalsn",
    };
    const CALIBRATION: Names =
        Names { product: None, counts: ["calcpf", "calcpt"], codes: ["calfu", "caltu"], texts: None, serial: "calsn" };

    fn force(&self, elements: &BTreeMap<String, String>) -> Result<ForceUnit, PageError> {
        self.unit(elements, 0, ForceUnit::of_code, ForceUnit::of_text, ForceUnit::text)
    }

    fn torque(&self, elements: &BTreeMap<String, String>) -> Result<TorqueUnit, PageError> {
        self.unit(elements, 1, TorqueUnit::of_code, TorqueUnit::of_text, TorqueUnit::text)
    }

    /// The unit that text and code agree on; the code alone only where the page has no text.
    fn unit<U: Copy + PartialEq>(
        &self,
        elements: &BTreeMap<String, String>,
        which: usize,
        of_code: fn(u8) -> Option<U>,
        of_text: fn(&str) -> Option<U>,
        name: fn(U) -> &'static str,
    ) -> Result<U, PageError> {
        let code_element = self.codes[which];
        let code = elements.get(code_element);
        let wrong = |element, value: &String, wanted| PageError::Value { element, value: value.clone(), wanted };
        let by_code = code
            .map(|value| {
                let unit = value.parse().ok().and_then(of_code);
                unit.ok_or_else(|| wrong(code_element, value, "no code of a unit (1 to 6)"))
            })
            .transpose()?;
        let Some(text_element) = self.texts.map(|texts| texts[which]) else {
            return by_code.ok_or(PageError::Missing(code_element));
        };
        let value = required(elements, text_element)?;
        let by_text = of_text(value).ok_or_else(|| wrong(text_element, value, "no unit of ATI's pages"))?;
        match by_code {
            Some(code) if code != by_text => {
                let (code, text) = (name(code), name(by_text));
                Err(PageError::Contradiction { code_element, code, text_element, text })
            }
            _ => Ok(by_text),
        }
    }
}

fn required<'a>(elements: &'a BTreeMap<String, String>, name: &'static str) -> Result<&'a String, PageError> {
    elements.get(name).filter(|value| !value.is_empty()).ok_or(PageError::Missing(name))
}

fn counts(elements: &BTreeMap<String, String>, name: &'static str) -> Result<f64, PageError> {
    let value = required(elements, name)?;
    let number = value.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    let wanted = "no number of counts above zero";
    number.ok_or_else(|| PageError::Value { element: name, value: value.clone(), wanted })
}

/// Root and leaves of the page: the first of each name holds.
fn read(page: &str) -> Result<(String, BTreeMap<String, String>), PageError> {
    if page.len() > PAGE_MAX {
        return Err(PageError::Long(page.len()));
    }
    let mut reader = Reader::from_str(page);
    let (mut open, mut elements): (Vec<String>, BTreeMap<String, String>) = Default::default();
    let (mut root, mut text) = (None, String::new());
    loop {
        let at = reader.buffer_position();
        let half = |open: &[String]| PageError::Half {
            at: page.len(),
            element: open.last().cloned().unwrap_or_else(|| "nothing".to_string()),
        };
        match reader.read_event() {
            Ok(Xml::Start(start)) => {
                let name = start.name().as_ref().to_string();
                root.get_or_insert_with(|| name.clone());
                open.push(name);
                text.clear();
            }
            Ok(Xml::Text(part)) => text.push_str(&part.xml10_content()),
            Ok(Xml::End(_)) => {
                let name = open.pop().unwrap_or_default();
                if !open.is_empty() && elements.len() < ELEMENTS_MAX {
                    elements.entry(name).or_insert_with(|| text.trim().to_string());
                }
                text.clear();
                if open.is_empty() {
                    break;
                }
            }
            Ok(Xml::Eof) => return Err(half(&open)),
            Ok(_) => {}
            Err(quick_xml::Error::Syntax(_)) => return Err(half(&open)),
            Err(why) => return Err(PageError::Xml { at, why: why.to_string() }),
        }
    }
    Ok((root.unwrap_or_default(), elements))
}

impl Client<Rdt> {
    /// Takes counts and model from a page that was read while it streams, and says what changed: samples until now were divided by
    /// other counts.
    ///
    /// # Errors
    /// If the counts of the page make no scale.
    pub fn calibrate(&mut self, page: &Calibration, events: &mut Vec<Event>) -> Result<(), Unable> {
        let scale = page.scale().ok_or(Unable { what: "divide by counts that are not finite and above zero" })?;
        let before = events.len();
        let wire = self.wire_mut();
        let changes = [
            ("counts_per_n", wire.scale.counts_per_n(), scale.counts_per_n()),
            ("counts_per_n_m", wire.scale.counts_per_n_m(), scale.counts_per_n_m()),
        ];
        for (what, was, is) in changes {
            if was.to_bits() != is.to_bits() {
                events.push(Event::Scale { what, before: was.to_string(), now: is.to_string() });
            }
        }
        wire.scale = scale;
        if let Some(model) = page.model.filter(|model| *model != wire.model) {
            let (before, now) = (wire.model.name().to_string(), model.name().to_string());
            events.push(Event::Scale { what: "model", before, now });
            wire.model = model;
        }
        self.count(&events[before..]);
        Ok(())
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "proves that bits are equal")]
mod tests {
    use super::*;

    const PAGE: &str = "<?xml version=\"1.0\"?>\r\n<netft>\r\n <runstat>00000000</runstat><runft>1;2;3;4;5;6</runft>\r\n\
        <cfgfu>2</cfgfu><cfgtu>3</cfgtu><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt><scfgfu>N</scfgfu>\
        <scfgtu>N-m</scfgtu><cfgcalsn>FT12345</cfgcalsn><prodname>Net F/T</prodname></netft>";

    fn error(page: &str) -> String {
        Calibration::parse(page).map(|found| format!("{found:?}")).expect_err("no page").to_string()
    }

    #[test]
    fn a_page_says_counts_units_and_model() {
        for page in [PAGE.to_string(), PAGE.replace("netft>", "netFTApi>")] {
            let read = Calibration::parse(&page).unwrap();
            assert_eq!((read.model, read.serial.as_deref()), (Some(Model::NetFt), Some("FT12345")));
            let scale = read.scale().unwrap();
            assert_eq!((scale.counts_per_n(), scale.counts_per_n_m()), (1e6, 1e6));
            assert_eq!(read.elements["runft"], "1;2;3;4;5;6");
        }
        let page = PAGE.replace(">N<", ">lbf<").replace("<cfgfu>2", "<cfgfu>1").replace("Net F/T", "Axia80");
        let read = Calibration::parse(&page).unwrap();
        assert_eq!(read.model, Some(Model::Axia));
        assert_eq!(read.scale().unwrap().counts_per_n(), 1e6 / 4.4482216152605);
        let calibration = "<netftCalibration><calcpf>500</calcpf><calcpt>20000</calcpt><calfu>4</calfu>\
            <caltu>4</caltu><calsn>FT7</calsn></netftCalibration>";
        let scale = Calibration::parse(calibration).unwrap().scale().unwrap();
        assert_eq!((scale.counts_per_n(), scale.counts_per_n_m()), (0.5, 2e7));
    }

    #[test]
    fn nothing_is_filled_in() {
        for name in ["cfgcpf", "cfgcpt", "scfgfu", "scfgtu", "prodname"] {
            assert_eq!(error(&PAGE.replace(name, "other")), format!("the page has no <{name}>, and it has no default"));
        }
        let zero = PAGE.replace("<cfgcpf>1000000", "<cfgcpf>0");
        assert_eq!(error(&zero), "<cfgcpf> is \"0\", no number of counts above zero");
        assert!(error(&PAGE.replace(">N<", ">kgf<")).contains("<cfgfu> says N, <scfgfu> says kgf"));
        assert!(error(&PAGE.replace(">N<", ">furlong<")).contains("no unit"));
        assert!(error("<html><body>Not found</body></html>").contains("root is <html>"));
        assert!(error(&" ".repeat(PAGE_MAX + 1)).contains("limit 262144"));
    }

    #[test]
    fn every_half_page_is_an_error() {
        for end in 0..PAGE.len() {
            assert!(Calibration::parse(&PAGE[..end]).is_err(), "{end} bytes");
        }
        let cut = PAGE.find("</runft").unwrap();
        let wanted = format!("the page ends at byte {cut} inside <runft>: only a part came, ask again");
        assert_eq!(error(&PAGE[..cut]), wanted);
    }

    #[test]
    fn a_page_that_is_read_again_tells_what_changed() {
        let scale = SensorScale::new(1e6, 1e6).unwrap();
        let wire = Rdt { scale, model: Model::NetFt, buffered: false, clock_hz: None };
        let mut client = Client::new(wire, sim_core::time::Nanos(100_000_000));
        let mut events = Vec::new();
        client.calibrate(&Calibration::parse(PAGE).unwrap(), &mut events).unwrap();
        assert_eq!(events, []);
        let page = PAGE.replace("<cfgcpf>1000000", "<cfgcpf>500000").replace("Net F/T", "Axia80");
        client.calibrate(&Calibration::parse(&page).unwrap(), &mut events).unwrap();
        let said: Vec<String> = events.iter().map(ToString::to_string).collect();
        assert_eq!(
            said,
            [
                "counts_per_n is 500000, and the samples so far were taken with 1000000",
                "model is axia, and the samples so far were taken with net-ft"
            ]
        );
        assert_eq!(client.wire().scale.counts_per_n(), 5e5);
    }
}
