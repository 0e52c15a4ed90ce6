//! A force/torque sensor with six axes that carries a tool and sits in the probe.
//!
//! The reading is the load on the probe, expressed in the sensor frame S, so that contact reads negative along z:
//! `f_S = D (F + W g) + c_f`, `τ_S = D (τ + D' r × F) + p × D W g + c_τ`. The sensor's electronics takes out the inertia of the
//! declared tool; any further mass is an effect.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | F, τ | load on the chaser at the probe tip, in the nozzle frame | N, N m |
//! | D | turns nozzle axes into sensor axes; D' back | 1 |
//! | r | from the sensor's origin to the probe tip, in the sensor frame | m |
//! | W | weight of the declared tool, m g | N |
//! | g | direction of gravity in the nozzle frame: a unit vector | 1 |
//! | p | from the sensor's origin to the tool's centre of mass, in the sensor frame | m |
//! | c | bias | N, N m |
//!
//! A cell whose axis is level has g = -y: then pitch θ about +x gives W sin θ along z of the sensor, as on one axis.
//!
//! Not modelled: crosstalk, a nozzle that turns against gravity while it is held by its robot (g is constant).

use super::{ForceSensor, Noisy, SensorNoise};
use crate::refusal::{Refusal, finite, not_negative};
use crate::rng::Stream;
use crate::space::{Motion, Spatial, Wrench};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

/// Mounting, tool and bias of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpaceCell {
    /// Turns sensor axes into probe axes.
    pub mounting: UnitQuaternion<f64>,
    /// From the sensor's origin to the probe tip, in the sensor frame.
    pub tip_m: Vector3<f64>,
    /// Weight of the declared tool.
    pub tool_weight_n: f64,
    /// From the sensor's origin to the tool's centre of mass, in the sensor frame.
    pub tool_centre_m: Vector3<f64>,
    /// Unit vector along gravity, in the nozzle frame.
    pub gravity: Vector3<f64>,
    /// Bias of the reading, in the sensor frame.
    pub bias: Wrench,
}

impl SpaceCell {
    /// A sensor at the probe tip, along its axes, on a cell whose axis is level.
    pub fn level(tool_weight_n: f64, bias: Wrench) -> Self {
        SpaceCell {
            mounting: UnitQuaternion::identity(),
            tip_m: Vector3::zeros(),
            tool_weight_n,
            tool_centre_m: Vector3::zeros(),
            gravity: -Vector3::y(),
            bias,
        }
    }

    /// Refuses what no sensor can be: numbers that are not finite, a direction of gravity that is not a unit vector.
    pub fn check(&self) -> Result<(), Refusal> {
        let each = |name: &'static str, value: &Vector3<f64>, unit: &'static str| {
            value.iter().try_for_each(|&value| finite(name, value, unit).map(|_| ()))
        };
        each("tip_m", &self.tip_m, "m")?;
        not_negative("tool_weight_n", self.tool_weight_n, "N")?;
        each("tool_centre_m", &self.tool_centre_m, "m")?;
        each("bias.force_n", &self.bias.force_n, "N")?;
        each("bias.torque_n_m", &self.bias.torque_n_m, "N m")?;
        each("gravity", &self.gravity, "")?;
        let value = self.gravity.norm();
        // Wide enough for a direction that was typed with six digits.
        if (value - 1.0).abs() > 1e-6 {
            return Err(Refusal { name: "gravity", value, unit: "", limit: "is not the length of a unit vector" });
        }
        Ok(())
    }

    /// Turns sensor axes into nozzle axes, at this pose of the probe. A matrix: it turns three vectors with fewer products than a
    /// quaternion does.
    #[inline(always)]
    pub fn attitude(&self, pose: &Motion) -> Rotation3<f64> {
        (pose.attitude * self.mounting).to_rotation_matrix()
    }

    /// What the sensor reads without contact: weight of the tool and bias, in the sensor frame.
    #[inline(always)]
    pub fn unloaded(&self, sensor_to_nozzle: &Rotation3<f64>) -> Wrench {
        let weight_n = sensor_to_nozzle.matrix().tr_mul(&self.gravity) * self.tool_weight_n;
        Wrench {
            force_n: weight_n + self.bias.force_n,
            torque_n_m: self.tool_centre_m.cross(&weight_n) + self.bias.torque_n_m,
        }
    }

    /// A load in the sensor frame, moved to the probe tip and turned into nozzle axes.
    #[inline(always)]
    pub fn at_tip(&self, sensor_to_nozzle: &Rotation3<f64>, load: &Wrench) -> Wrench {
        Wrench {
            force_n: sensor_to_nozzle * load.force_n,
            torque_n_m: sensor_to_nozzle * (load.torque_n_m - self.tip_m.cross(&load.force_n)),
        }
    }
}

impl ForceSensor<Spatial> for SpaceCell {
    #[inline(always)]
    fn reading(&self, achieved: &Motion, interface: &Wrench) -> Wrench {
        let attitude = self.attitude(achieved);
        if *interface == Wrench::default() {
            return self.unloaded(&attitude);
        }
        let force_n = attitude.matrix().tr_mul(&interface.force_n);
        let torque_n_m = attitude.matrix().tr_mul(&interface.torque_n_m) + self.tip_m.cross(&force_n);
        Wrench { force_n, torque_n_m } + self.unloaded(&attitude)
    }

    fn reads_acceleration(&self) -> bool {
        false
    }
}

/// Noise of the six channels, in the sensor frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchNoise {
    /// Noise of each force.
    pub force: [SensorNoise; 3],
    /// Noise of each torque; read every N in its fields as N m.
    pub torque: [SensorNoise; 3],
}

impl WrenchNoise {
    /// A sensor that tells the truth.
    pub const NONE: WrenchNoise = WrenchNoise { force: [SensorNoise::NONE; 3], torque: [SensorNoise::NONE; 3] };
}

impl Noisy for Wrench {
    type Noise = WrenchNoise;
    type Slow = [f64; 6];

    fn silent(noise: &WrenchNoise) -> bool {
        *noise == WrenchNoise::NONE
    }

    #[inline]
    fn noisy(&self, noise: &WrenchNoise, slow: &mut [f64; 6], random: &mut Stream) -> Wrench {
        let mut numbers = [0.0; 6];
        let (force, torque) = (&self.force_n, &self.torque_n_m);
        let analogue = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        let channels = noise.force.iter().chain(&noise.torque);
        for (((number, channel), slow), analogue) in numbers.iter_mut().zip(channels).zip(slow).zip(analogue) {
            *number = channel.drawn(analogue, slow, random);
        }
        let [x, y, z, about_x, about_y, about_z] = numbers;
        Wrench { force_n: Vector3::new(x, y, z), torque_n_m: Vector3::new(about_x, about_y, about_z) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force_sensor::AxisCell;
    use crate::rng::Streams;
    use crate::space::{Axis, AxisMotion};

    fn bias() -> Wrench {
        Wrench { force_n: Vector3::new(0.0, 0.0, 2.1), torque_n_m: Vector3::zeros() }
    }

    /// On a level cell, at any pitch: the sensor of one axis, along z.
    #[test]
    fn a_level_sensor_reads_along_z_what_the_one_of_one_axis_reads() {
        let space = SpaceCell::level(73.5, bias());
        let axis = AxisCell { tool_weight_n: 73.5, bias_n: 2.1 };
        for pitch_rad in [-0.5, 0.0, 0.1, 1.2] {
            let attitude = UnitQuaternion::from_scaled_axis(Vector3::x() * pitch_rad);
            // The probe's own z carries 9 N of contact.
            let interface = Wrench { force_n: attitude * Vector3::new(0.0, 0.0, -9.0), torque_n_m: Vector3::zeros() };
            let reading = space.reading(&Motion { attitude, ..Motion::default() }, &interface);
            let pose = AxisMotion { pitch_rad, ..AxisMotion::default() };
            let expected_n = ForceSensor::<Axis>::reading(&axis, &pose, &9.0);
            // A dozen roundings of numbers up to 73.5 N.
            assert!((reading.force_n.z - expected_n).abs() <= 16.0 * f64::EPSILON * 73.5, "{pitch_rad}");
        }
    }

    /// A force at the tip turns the sensor about its origin; the tool's weight does so at its own centre.
    #[test]
    fn torque_is_about_the_origin_of_the_sensor() {
        let mut cell = SpaceCell::level(10.0, Wrench::default());
        cell.tip_m = Vector3::z() * 0.2;
        cell.tool_centre_m = Vector3::z() * 0.1;
        let push = Wrench { force_n: Vector3::x() * 5.0, torque_n_m: Vector3::zeros() };
        let reading = cell.reading(&Motion::default(), &push);
        // z × x = y: 0.2 m · 5 N. The weight: z × -y = x: 0.1 m · 10 N.
        assert_eq!(reading.torque_n_m, Vector3::new(1.0, 1.0, 0.0));
        let attitude = cell.attitude(&Motion::default());
        assert_eq!(cell.at_tip(&attitude, &(reading - cell.unloaded(&attitude))), push);
    }

    #[test]
    fn a_channel_without_noise_draws_nothing_and_keeps_its_reading() {
        let some = SensorNoise { white_n: 0.1, ..SensorNoise::NONE };
        let mut noise = WrenchNoise::NONE;
        assert!(Wrench::silent(&noise));
        noise.torque[1] = some;
        let mut random = Streams::new(1).named("noise");
        let expected = 0.1 * random.clone().normal();
        let noisy = bias().noisy(&noise, &mut [0.0; 6], &mut random);
        assert_eq!(noisy, bias() + Wrench { force_n: Vector3::zeros(), torque_n_m: Vector3::y() * expected });
    }

    #[test]
    fn gravity_is_a_direction() {
        let cell = SpaceCell { gravity: Vector3::y() * -9.81, ..SpaceCell::level(10.0, Wrench::default()) };
        assert_eq!(cell.check().unwrap_err().limit, "is not the length of a unit vector");
        assert!(SpaceCell::level(-1.0, Wrench::default()).check().is_err());
        assert!(SpaceCell::level(1.0, bias()).check().is_ok());
    }
}
