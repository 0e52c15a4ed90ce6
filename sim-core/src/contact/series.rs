//! Springs in a row: `1/k = 1/k_device + 1/k_robot + 1/k_sensor + 1/k_interface`.
//!
//! | part | stiffness | source |
//! |---|---|---|
//! | compliance device | about 1 kN/m | thesis |
//! | robot | about 1 MN/m | reference/PHYSICS.md, section 3.3: with it the device loses 0.1 % |
//! | sensor, interface | given | data sheet, measurement |
//!
//! A part that does not yield has infinite stiffness, and a device may have a negative one, from its preload: both are answered.
//! Not modelled: masses between the parts, each of which would be a mode of its own.

use super::StiffnessTensor;
use crate::refusal::Refusal;

/// What yields between the interfaces, in the order of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Series {
    /// Compliance device.
    pub device_n_per_m: f64,
    /// Robot, both of them together.
    pub robot_n_per_m: f64,
    /// Force sensor.
    pub sensor_n_per_m: f64,
    /// The docking interface itself.
    pub interface_n_per_m: f64,
}

impl Series {
    /// A device alone: everything else is rigid.
    pub fn device(device_n_per_m: f64) -> Self {
        let rigid = f64::INFINITY;
        Series { device_n_per_m, robot_n_per_m: rigid, sensor_n_per_m: rigid, interface_n_per_m: rigid }
    }

    /// The stiffness of all together.
    pub fn stiffness_n_per_m(&self) -> Result<f64, Refusal> {
        let parts = self.parts();
        for (name, stiffness) in parts {
            if stiffness.is_nan() {
                return Err(Refusal { name, value: stiffness, unit: "N/m", limit: "is not a number" });
            }
            if stiffness.abs() <= 0.0 {
                // A part that carries nothing: nothing does.
                return Ok(0.0);
            }
        }
        Ok(1.0 / parts.iter().map(|(_, stiffness)| 1.0 / stiffness).sum::<f64>())
    }

    /// The share of the deflection that each part takes, in the order of the fields; they sum to one.
    pub fn shares(&self) -> Result<[f64; 4], Refusal> {
        let total = self.stiffness_n_per_m()?;
        Ok(self.parts().map(|(_, stiffness)| total / stiffness))
    }

    fn parts(&self) -> [(&'static str, f64); 4] {
        [
            ("device_n_per_m", self.device_n_per_m),
            ("robot_n_per_m", self.robot_n_per_m),
            ("sensor_n_per_m", self.sensor_n_per_m),
            ("interface_n_per_m", self.interface_n_per_m),
        ]
    }
}

/// Tensors in a row, about the same point and in the same frame; none if a part, or the whole, has a direction that carries nothing.
pub fn tensors_in_series(parts: &[StiffnessTensor]) -> Option<StiffnessTensor> {
    let mut compliance = nalgebra::Matrix6::zeros();
    for part in parts {
        compliance += part.compliance()?;
    }
    Some(StiffnessTensor(compliance.try_inverse()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    /// reference/PHYSICS.md, section 3.3: a robot of 1 MN/m takes 0.1 % of a device of 1 kN/m.
    #[test]
    fn a_robot_takes_a_thousandth() {
        let cell = Series { robot_n_per_m: 1e6, ..Series::device(1e3) };
        let stiffness = cell.stiffness_n_per_m().unwrap();
        assert!((stiffness - 1e3 / 1.001).abs() < 1e-9, "{stiffness}");
        let shares = cell.shares().unwrap();
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 4.0 * f64::EPSILON);
        assert!((shares[1] - 1e-3 / 1.001).abs() < 1e-12);
    }

    #[test]
    fn negative_and_nothing_are_answered_and_nan_is_refused() {
        let soft = Series { robot_n_per_m: 1e6, ..Series::device(-159.0) };
        assert!(soft.stiffness_n_per_m().unwrap() < -159.0, "a robot in series makes a negative device worse");
        assert!(Series::device(0.0).stiffness_n_per_m().unwrap().abs() <= 0.0);
        assert!(Series::device(f64::NAN).stiffness_n_per_m().is_err());
    }

    #[test]
    fn tensors_in_a_row_are_softer_on_every_axis() {
        let device = StiffnessTensor(Matrix6::from_diagonal(&Vector6::new(500.0, 400.0, 1e3, 20.0, 20.0, 50.0)));
        let robot = StiffnessTensor(Matrix6::from_diagonal(&Vector6::new(1e6, 1e6, 2e6, 1e5, 1e5, 1e5)));
        let both = tensors_in_series(&[device, robot]).unwrap();
        for axis in 0..6 {
            let (a, b) = (device.0[(axis, axis)], robot.0[(axis, axis)]);
            // Three divisions and a sum.
            assert!((both.0[(axis, axis)] - a * b / (a + b)).abs() < 8.0 * f64::EPSILON * a);
        }
        assert!(tensors_in_series(&[StiffnessTensor(Matrix6::zeros()), robot]).is_none());
    }
}
