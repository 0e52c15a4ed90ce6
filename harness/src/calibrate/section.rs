//! The section of the model that a calibration writes.

use super::ft::FtCalibration;
use crate::model::{CalibrationModel, Editor, TemperatureModel};
use crate::recording::AxisName;
use toml_edit::{Array, InlineTable, Value};

const SECTION: [&str; 2] = ["sensor", "calibration"];

impl FtCalibration {
    /// As it stands in a model.
    pub fn section(&self, source: &str, travel: AxisName) -> CalibrationModel {
        let found = &self.calibration.parameters;
        let deviations = self.calibration.deviations();
        let three = |at: usize| std::array::from_fn(|axis| deviations.get(at + axis).copied().unwrap_or(0.0));
        let crosstalk = self.calibration.terms.crosstalk.then(|| {
            let matrix = found.crosstalk();
            std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
        });
        let temperature = self.reference_c.filter(|_| self.calibration.terms.temperature);
        CalibrationModel {
            source: source.to_owned(),
            bias_force_n: found.bias_force_n.into(),
            bias_torque_n_m: found.bias_torque_n_m.into(),
            tool_mass_kg: found.mass_kg,
            centre_of_mass_m: found.centre_m.into(),
            misalignment_rad: found.misalignment_rad().into(),
            bias_force_sd_n: three(0),
            bias_torque_sd_n_m: three(3),
            tool_mass_sd_kg: deviations[6],
            centre_of_mass_sd_m: three(7),
            misalignment_sd_rad: if self.calibration.terms.misalignment { three(10) } else { [0.0; 3] },
            travel,
            crosstalk,
            temperature: temperature.map(|reference_c| TemperatureModel {
                reference_c,
                bias_force_n_per_k: found.drift_force_n_per_k.into(),
                bias_torque_n_m_per_k: found.drift_torque_n_m_per_k.into(),
            }),
        }
    }
}

/// Puts a calibration into a model, with the tool's mass and the bias along the axis of approach for the loop along one axis.
pub fn write_calibration(editor: &mut Editor, section: &CalibrationModel) {
    let three = |values: &[f64; 3]| Value::Array(values.iter().copied().collect::<Array>());
    let values = [
        ("source", section.source.as_str().into()),
        ("bias_force_n", three(&section.bias_force_n)),
        ("bias_torque_n_m", three(&section.bias_torque_n_m)),
        ("tool_mass_kg", section.tool_mass_kg.into()),
        ("centre_of_mass_m", three(&section.centre_of_mass_m)),
        ("misalignment_rad", three(&section.misalignment_rad)),
        ("bias_force_sd_n", three(&section.bias_force_sd_n)),
        ("bias_torque_sd_n_m", three(&section.bias_torque_sd_n_m)),
        ("tool_mass_sd_kg", section.tool_mass_sd_kg.into()),
        ("centre_of_mass_sd_m", three(&section.centre_of_mass_sd_m)),
        ("misalignment_sd_rad", three(&section.misalignment_sd_rad)),
    ];
    editor.set_table(&SECTION, &values);
    let (nth, name) = match section.travel {
        AxisName::X => (0, Some("x")),
        AxisName::Y => (1, Some("y")),
        // The usual one is not written.
        AxisName::Z => (2, None),
    };
    match name {
        Some(name) => editor.set_table(&SECTION, &[("travel", name.into())]),
        None => editor.remove_key(&SECTION, "travel"),
    }
    // What an earlier calibration estimated and this one does not would no longer belong to it.
    editor.remove_key(&SECTION, "crosstalk");
    editor.remove_key(&SECTION, "temperature");
    if let Some(crosstalk) = &section.crosstalk {
        let rows = crosstalk.iter().map(|row| Value::Array(row.iter().copied().collect()));
        editor.set_table(&SECTION, &[("crosstalk", Value::Array(rows.collect()))]);
    }
    if let Some(temperature) = &section.temperature {
        let mut table = InlineTable::new();
        table.insert("reference_c", temperature.reference_c.into());
        table.insert("bias_force_n_per_k", three(&temperature.bias_force_n_per_k));
        table.insert("bias_torque_n_m_per_k", three(&temperature.bias_torque_n_m_per_k));
        editor.set_table(&SECTION, &[("temperature", Value::InlineTable(table))]);
    }
    editor.set_base("sensor", "tool_mass_kg", section.tool_mass_kg);
    editor.set_base("sensor", "bias_n", section.bias_force_n[nth]);
}
