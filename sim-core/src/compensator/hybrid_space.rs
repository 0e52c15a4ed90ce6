//! The hybrid architecture in space (thesis Fig. 3.1, bottom): the load that the sensor feels, plus a virtual one in software.
//!
//! `F = D (f_S - f_0) - kv x - bv x'`, `τ = D (τ_S - τ_0 - r × (f_S - f_0)) - kφ φ - bφ ω`, on the chaser at the probe tip, in the
//! nozzle frame. The virtual part acts while its pose is past the onset; it is clamped by nothing. Virtual damping of the
//! longitudinal and of the torsional axis (thesis Figs 5.10, 5.11) is `bv_z` and `bφ_z`: `τ_z = -bφ_z ω_z`.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | f_S, τ_S | newest reading, in the sensor frame | N, N m |
//! | f_0, τ_0 | what the known tool and bias read at the measured attitude | N, N m |
//! | D, r | known attitude of the sensor at the measured pose, known arm to the probe tip | 1, m |
//! | kv, bv | virtual stiffness and damping along x, y, z | N/m, N s/m |
//! | kφ, bφ | the same about x, y, z | N m/rad, N m s/rad |
//! | x | measured or commanded position; z counts from the onset | m |
//! | φ | turn from alignment, axis times angle | rad |
//! | x', ω | backward differences over one tick | m/s, rad/s |
//!
//! Outside contact (force and torque both inside their dead band, and no onset) the felt load counts as zero, since a bias of
//! 0.25 N would push 63 kg to 40 mm/s within ten seconds.
//!
//! Not modelled: compensation of the delay, an estimator of the pose (both are there along one axis).

use super::{Architecture, Compensator, Heard};
use crate::force_sensor::SpaceCell;
use crate::refusal::{Refusal, finite, not_negative};
use crate::space::{Motion, Path, Spatial, Wrench, turn_between};
use crate::time::Step;
use nalgebra::{UnitQuaternion, Vector3};

/// The pose that the virtual contact is at. It sets the delay of the virtual part of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpacePose {
    /// The measured pose: late by the robot and by the read-back (32 ms at the facility).
    #[default]
    Measured,
    /// The commanded pose: not late.
    Commanded,
}

/// One number for each translation and one for each rotation, in the nozzle frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisPair {
    /// Along x, y, z: N/m of a stiffness, N s/m of a damping.
    pub along: Vector3<f64>,
    /// About x, y, z: N m/rad of a stiffness, N m s/rad of a damping.
    pub about: Vector3<f64>,
}

/// What the compensator believes, and the virtual contact that it adds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HybridSpace {
    /// Known mounting, tool and bias of the sensor.
    pub known: SpaceCell,
    /// Virtual stiffness.
    pub virtual_stiffness: AxisPair,
    /// Virtual damping.
    pub virtual_damping: AxisPair,
    /// The virtual contact acts while z of its pose is above this.
    pub onset_m: f64,
    /// Below this force, with the torque below its own and before the onset, the felt load counts as zero.
    pub dead_band_n: f64,
    /// See [`HybridSpace::dead_band_n`].
    pub dead_band_n_m: f64,
    /// Which of the two contacts count.
    pub architecture: Architecture,
    /// Which pose the virtual contact is at.
    pub virtual_pose: SpacePose,
}

/// The pose of the tick before; none before the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HybridSpaceState {
    before: Option<Motion>,
    measured_first: Motion,
}

impl HybridSpace {
    /// Both contacts, the virtual one still without stiffness and damping, no dead band.
    pub fn new(known: SpaceCell) -> Self {
        HybridSpace {
            known,
            virtual_stiffness: AxisPair::default(),
            virtual_damping: AxisPair::default(),
            onset_m: 0.0,
            dead_band_n: 0.0,
            dead_band_n_m: 0.0,
            architecture: Architecture::Hybrid,
            virtual_pose: SpacePose::Measured,
        }
    }

    /// Refuses what no compensator can mean.
    pub fn check(&self) -> Result<(), Refusal> {
        self.known.check()?;
        let each = |name: &'static str, value: &Vector3<f64>, unit: &'static str| {
            value.iter().try_for_each(|&value| finite(name, value, unit).map(|_| ()))
        };
        each("virtual_stiffness.along", &self.virtual_stiffness.along, "N/m")?;
        each("virtual_stiffness.about", &self.virtual_stiffness.about, "N m/rad")?;
        each("virtual_damping.along", &self.virtual_damping.along, "N s/m")?;
        each("virtual_damping.about", &self.virtual_damping.about, "N m s/rad")?;
        finite("onset_m", self.onset_m, "m")?;
        not_negative("dead_band_n", self.dead_band_n, "N")?;
        not_negative("dead_band_n_m", self.dead_band_n_m, "N m")?;
        Ok(())
    }

    /// The load that the sensor felt, without tool and bias, at the probe tip.
    #[inline]
    fn felt(&self, heard: &Heard<'_, Spatial>) -> Wrench {
        let Some(reading) = heard.sensed.filter(|_| self.architecture.feels()) else {
            return Wrench::default();
        };
        let attitude = self.known.attitude(heard.measured);
        self.known.at_tip(&attitude, &(*reading - self.known.unloaded(&attitude)))
    }

    /// The load of the virtual contact at `pose`, which the tick before had `before`.
    #[inline]
    fn virtual_load(&self, pose: &Motion, before: &Motion, period_s: f64) -> Wrench {
        let depth_m = pose.position_m - Vector3::z() * self.onset_m;
        let turn_rad = if self.virtual_stiffness.about == Vector3::zeros() {
            Vector3::zeros()
        } else {
            turn_between(&UnitQuaternion::identity(), &pose.attitude)
        };
        let velocity = (pose.position_m - before.position_m) / period_s;
        let rate = turn_between(&before.attitude, &pose.attitude) / period_s;
        let (stiffness, damping) = (&self.virtual_stiffness, &self.virtual_damping);
        Wrench {
            force_n: -(stiffness.along.component_mul(&depth_m) + damping.along.component_mul(&velocity)),
            torque_n_m: -(stiffness.about.component_mul(&turn_rad) + damping.about.component_mul(&rate)),
        }
    }
}

impl Compensator<Spatial> for HybridSpace {
    type State = HybridSpaceState;

    fn start(&self, measured: &Motion, _period_s: f64) -> HybridSpaceState {
        HybridSpaceState { before: None, measured_first: *measured }
    }

    #[inline]
    fn feedback(&self, state: &mut HybridSpaceState, step: Step, heard: Heard<'_, Spatial>) -> Wrench {
        let period_s = step.dt.seconds();
        let (pose, first) = match self.virtual_pose {
            SpacePose::Measured => (heard.measured, &state.measured_first),
            SpacePose::Commanded => (heard.commanded, heard.commanded),
        };
        let before = state.before.unwrap_or_else(|| first.coasted(-period_s));
        state.before = Some(*pose);
        let felt = self.felt(&heard);
        if pose.position_m.z > self.onset_m {
            return if self.architecture.computes() { felt + self.virtual_load(pose, &before, period_s) } else { felt };
        }
        let quiet = felt.force_n.norm() < self.dead_band_n && felt.torque_n_m.norm() < self.dead_band_n_m;
        if quiet { Wrench::default() } else { felt }
    }

    fn reads_acceleration(&self) -> bool {
        false
    }
}
