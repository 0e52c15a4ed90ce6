//! The sensor's page, written and held against the settings of a cell. What the elements mean: [`super::calibration`].

use super::calibration::Calibration;
use super::settings::{Protocol, Settings, SettingsError};
use super::status::Model;
use crate::units::{ForceUnit, TorqueUnit};

/// Counts are the same to this share: a page may count in another unit, and its conversion is rounded.
const ROUNDING: f64 = 1e-9;

impl Settings {
    /// What the sensor's page would say: counts for one N and one N m, and its product.
    ///
    /// # Errors
    /// Where the protocol has no such page, or the counts are missing.
    pub fn page(&self) -> Result<String, SettingsError> {
        if self.protocol != Protocol::Rdt {
            let problem = format!("= {}: only sensors of ATI have this page, take page out", self.protocol.name());
            return Err(SettingsError { field: "protocol", problem });
        }
        let (scale, (model, _)) = (self.scale()?, self.model_and_clock());
        let product = match model {
            Model::NetFt => "Net F/T",
            Model::Axia => "Axia80",
        };
        let code = |place: Option<usize>| place.map_or(0, |place| place + 1);
        let force = code(ForceUnit::ALL.iter().position(|unit| *unit == ForceUnit::Newton));
        let torque = code(TorqueUnit::ALL.iter().position(|unit| *unit == TorqueUnit::NewtonMetre));
        let (per_n, per_n_m) = (scale.counts_per_n(), scale.counts_per_n_m());
        let (force_text, torque_text) = (ForceUnit::Newton.text(), TorqueUnit::NewtonMetre.text());
        Ok(format!(
            "<?xml version=\"1.0\"?>\r\n<netft>\r\n<prodname>{product}</prodname>\r\n\
             <cfgcpf>{per_n}</cfgcpf><cfgcpt>{per_n_m}</cfgcpt>\r\n\
             <cfgfu>{force}</cfgfu><cfgtu>{torque}</cfgtu>\r\n\
             <scfgfu>{force_text}</scfgfu><scfgtu>{torque_text}</scfgtu>\r\n</netft>\r\n"
        ))
    }

    /// What the sensor's page says otherwise than these settings: name, value here, value there. Whoever divides by the wrong
    /// counts gets a wrong force that looks like a sound one.
    ///
    /// # Errors
    /// When the counts are missing here.
    pub fn differences(&self, page: &Calibration) -> Result<Vec<(&'static str, String, String)>, SettingsError> {
        let (scale, (model, _)) = (self.scale()?, self.model_and_clock());
        let mut found = Vec::new();
        let there = page.scale().map(|scale| [scale.counts_per_n(), scale.counts_per_n_m()]).unwrap_or_default();
        let here = [scale.counts_per_n(), scale.counts_per_n_m()];
        for ((name, here), there) in ["counts_per_n", "counts_per_n_m"].into_iter().zip(here).zip(there) {
            if (here - there).abs() > ROUNDING * here {
                found.push((name, here.to_string(), there.to_string()));
            }
        }
        if let Some(other) = page.model.filter(|other| *other != model) {
            found.push(("model", model.name().to_owned(), other.name().to_owned()));
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(text: &str) -> Settings {
        toml::from_str(&format!("protocol = \"rdt\"\nrate_hz = 1000\n{text}")).unwrap()
    }

    #[test]
    fn a_page_that_is_written_says_what_the_settings_say() {
        let axia = "counts_per_n = 250.5\ncounts_per_n_m = 123456.75\nmodel = \"axia\"\nclock_hz = 1000\n";
        for text in ["counts_per_n = 1000000\ncounts_per_n_m = 1000000\n", axia] {
            let settings = settings(text);
            let page = Calibration::parse(&settings.page().unwrap()).unwrap();
            assert_eq!(settings.differences(&page).unwrap(), []);
        }
        let robotiq: Settings = toml::from_str("protocol = \"robotiq\"").unwrap();
        assert_eq!(
            robotiq.page().unwrap_err().to_string(),
            "sensor.protocol = robotiq: only sensors of ATI have this page, take page out"
        );
    }

    #[test]
    fn another_sensor_is_known_by_its_counts_in_whatever_unit() {
        let here = settings("counts_per_n = 1000000\ncounts_per_n_m = 1000000\n");
        let page = |page: &str| here.differences(&Calibration::parse(page).unwrap()).unwrap();
        let own = here.page().unwrap();
        let pounds = own.replace("<cfgcpf>1000000", "<cfgcpf>4448221.6152605");
        let pounds = pounds.replace("<cfgfu>2", "<cfgfu>1").replace(">N<", ">lbf<");
        assert_eq!(page(&pounds), []);
        let other = own.replace("<cfgcpt>1000000", "<cfgcpt>999999").replace("Net F/T", "Axia80");
        let text = |text: &str| text.to_owned();
        assert_eq!(
            page(&other),
            [("counts_per_n_m", text("1000000"), text("999999")), ("model", text("net-ft"), text("axia"))]
        );
    }
}
