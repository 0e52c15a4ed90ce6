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
use nalgebra::{UnitQuaternion, Vector3};

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

    /// What the sensor reads without contact: weight of the tool and bias, in the sensor frame.
    #[inline]
    pub fn unloaded(&self, sensor_to_nozzle: &UnitQuaternion<f64>) -> Wrench {
        let weight_n = sensor_to_nozzle.inverse_transform_vector(&(self.gravity * self.tool_weight_n));
        Wrench {
            force_n: weight_n + self.bias.force_n,
            torque_n_m: self.tool_centre_m.cross(&weight_n) + self.bias.torque_n_m,
        }
    }

    /// Turns sensor axes into nozzle axes, at this pose of the probe.
    #[inline]
    pub fn attitude(&self, pose: &Motion) -> UnitQuaternion<f64> {
        pose.attitude * self.mounting
    }

    /// A load in the sensor frame, moved to the probe tip and turned into nozzle axes.
    #[inline]
    pub fn at_tip(&self, sensor_to_nozzle: &UnitQuaternion<f64>, load: &Wrench) -> Wrench {
        Wrench {
            force_n: sensor_to_nozzle * load.force_n,
            torque_n_m: sensor_to_nozzle * (load.torque_n_m - self.tip_m.cross(&load.force_n)),
        }
    }
}

impl ForceSensor<Spatial> for SpaceCell {
    #[inline]
    fn reading(&self, achieved: &Motion, interface: &Wrench) -> Wrench {
        // A matrix turns three vectors with fewer products than a quaternion does.
        let to_nozzle = self.attitude(achieved).to_rotation_matrix();
        let to_sensor = to_nozzle.matrix().transpose();
        let force_n = to_sensor * interface.force_n;
        let weight_n = to_sensor * self.gravity * self.tool_weight_n;
        Wrench {
            force_n: force_n + weight_n + self.bias.force_n,
            torque_n_m: to_sensor * interface.torque_n_m
                + self.tip_m.cross(&force_n)
                + self.tool_centre_m.cross(&weight_n)
                + self.bias.torque_n_m,
        }
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
