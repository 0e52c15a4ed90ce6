//! `[sensor.calibration]`: what a calibration found of the force/torque sensor and its tool, in six axes.
//!
//! `dockhil calibrate ft` writes it, together with `sensor.tool_mass_kg` and `sensor.bias_n`, which the loop along one axis uses.

use super::{SensorModel, Sign};
use crate::recording::AxisName;
use crate::report::story::words::number;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The force/torque sensor and its tool, as calibrated: reading = (1 + crosstalk) load + bias, in the sensor's own axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationModel {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Reading without load: force on the tool.
    pub bias_force_n: [f64; 3],
    /// Reading without load: torque on the tool about the sensor's origin.
    pub bias_torque_n_m: [f64; 3],
    /// Mass of everything beyond the sensor.
    pub tool_mass_kg: f64,
    /// Its centre of mass from the sensor's origin.
    pub centre_of_mass_m: [f64; 3],
    /// Rotation vector that turns the nominal axes of the sensor into its own.
    #[serde(default)]
    pub misalignment_rad: [f64; 3],
    /// One standard deviation of the bias.
    #[serde(default)]
    pub bias_force_sd_n: [f64; 3],
    /// One standard deviation of the bias.
    #[serde(default)]
    pub bias_torque_sd_n_m: [f64; 3],
    /// One standard deviation of the mass.
    #[serde(default)]
    pub tool_mass_sd_kg: f64,
    /// One standard deviation of the centre of mass.
    #[serde(default)]
    pub centre_of_mass_sd_m: [f64; 3],
    /// One standard deviation of the misalignment.
    #[serde(default)]
    pub misalignment_sd_rad: [f64; 3],
    /// Axis of the sensor along which the loop runs: that of `sensor.bias_n`.
    #[serde(default = "along_z", skip_serializing_if = "is_z")]
    pub travel: AxisName,
    /// What a load reads too much: rows are readings, columns loads; forces in N, torques in N m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crosstalk: Option<[[f64; 6]; 6]>,
    /// Drift of the bias with temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<TemperatureModel>,
}

/// Drift of the sensor's bias with temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TemperatureModel {
    /// Temperature at which the bias holds.
    pub reference_c: f64,
    /// Drift of the force.
    pub bias_force_n_per_k: [f64; 3],
    /// Drift of the torque.
    pub bias_torque_n_m_per_k: [f64; 3],
}

/// Numbers that agree to this part are the same, rounded to the four digits that people type.
const ROUNDING: f64 = 5e-4;

fn along_z() -> AxisName {
    AxisName::Z
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
fn is_z(axis: &AxisName) -> bool {
    *axis == AxisName::Z
}

impl CalibrationModel {
    /// Bias along the axis on which the loop runs.
    fn bias_n(&self) -> f64 {
        let [x, y, z] = self.bias_force_n;
        match self.travel {
            AxisName::X => x,
            AxisName::Y => y,
            AxisName::Z => z,
        }
    }

    /// The first number that the sensor states otherwise: place, what is wrong, what to do.
    pub(super) fn contradiction(&self, sensor: &SensorModel) -> Option<(&'static str, String, &'static str)> {
        let pairs = [
            ("sensor.tool_mass_kg", "tool_mass_kg", "kg", sensor.tool_mass_kg, self.tool_mass_kg),
            ("sensor.bias_n", "bias_force_n along the travel", "N", sensor.bias_n, self.bias_n()),
        ];
        pairs.into_iter().find_map(|(place, key, unit, own, calibrated)| {
            let differs = (own - calibrated).abs() > ROUNDING * own.abs().max(calibrated.abs());
            let (own, calibrated) = (number(own), number(calibrated));
            let what = format!("{place} = {own} {unit} contradicts sensor.calibration, whose {key} is {calibrated} {unit}");
            let help = "they are the same number twice: give both the value that holds, or calibrate anew with dockhil calibrate ft";
            differs.then_some((place, what, help))
        })
    }

    /// Every number, with the key under which it stands and the sign that it may have.
    pub(super) fn numbers(&self) -> Vec<(&'static str, f64, Sign)> {
        let mut numbers = vec![
            ("sensor.calibration.tool_mass_kg", self.tool_mass_kg, Sign::Positive),
            ("sensor.calibration.tool_mass_sd_kg", self.tool_mass_sd_kg, Sign::NotNegative),
        ];
        let mut triple = |key, values: &[f64; 3], sign| numbers.extend(values.map(|value| (key, value, sign)));
        triple("sensor.calibration.bias_force_n", &self.bias_force_n, Sign::Any);
        triple("sensor.calibration.bias_torque_n_m", &self.bias_torque_n_m, Sign::Any);
        triple("sensor.calibration.centre_of_mass_m", &self.centre_of_mass_m, Sign::Any);
        triple("sensor.calibration.misalignment_rad", &self.misalignment_rad, Sign::Any);
        triple("sensor.calibration.bias_force_sd_n", &self.bias_force_sd_n, Sign::NotNegative);
        triple("sensor.calibration.bias_torque_sd_n_m", &self.bias_torque_sd_n_m, Sign::NotNegative);
        triple("sensor.calibration.centre_of_mass_sd_m", &self.centre_of_mass_sd_m, Sign::NotNegative);
        triple("sensor.calibration.misalignment_sd_rad", &self.misalignment_sd_rad, Sign::NotNegative);
        if let Some(temperature) = &self.temperature {
            triple("sensor.calibration.temperature", &temperature.bias_force_n_per_k, Sign::Any);
            triple("sensor.calibration.temperature", &temperature.bias_torque_n_m_per_k, Sign::Any);
            numbers.push(("sensor.calibration.temperature", temperature.reference_c, Sign::Any));
        }
        let crosstalk = self.crosstalk.iter().flatten().flatten();
        numbers.extend(crosstalk.map(|value| ("sensor.calibration.crosstalk", *value, Sign::Any)));
        numbers
    }
}
