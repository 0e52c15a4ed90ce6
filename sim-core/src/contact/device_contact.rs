//! A rigid tip on a compliance device that yields differently along each axis: `f = (d + τ d') / (Gᵀ C G)`, `G = [n; arm × n]`.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | C | compliance of the device about the probe tip, K⁻¹, in the nozzle frame | m/N, 1/N, 1/(N m) |
//! | τ | damping over stiffness, `B = τ K` | s |
//! | n, arm | normal on the probe; from the probe tip to the contact point | 1, m |
//! | G | wrench at the probe tip of a force of one newton along n | 1, m |
//! | d | penetration that the tip would have if the device were rigid | m |
//!
//! The tip has no mass and touches at one point, without friction: the wrench is `f G`. The device gives way by `C f G`, of which
//! the part along the normal must make up for the depth. So the stiffness that the contact feels is `1 / (Gᵀ C G)`: it depends on
//! the normal and on the arm, and a device that is soft in turning is soft against a force with a lever.
//!
//! With B in proportion to K the same holds for shift and rate together, and no state is needed. For any other B the tip is a
//! relaxation of its own (the shares of the axes in the deflection change with time) and the law would need a state, which no
//! contact law has: use this law for the stiffness, and virtual damping per axis in the compensator. Not modelled, further: the change
//! of place of the contact point as the device gives way; a device that turns with the probe by more than a little. While the
//! normal or the arm change during a contact, `1 / (Gᵀ C G)` changes under load, and a loop through places of different stiffness
//! neither loses nor gains what it should by up to the change of the stored energy `d² / (2 Gᵀ C G)`.

use super::{ContactLaw, Sides, StiffnessTensor};
use crate::refusal::{self, Refusal};
use crate::signals::ContactForce;
use crate::space::{Spatial, Touch, Wrench};
use nalgebra::{Matrix6, Vector6};

/// Contact through a compliance device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceContact {
    compliance: Matrix6<f64>,
    relaxation_s: f64,
    sides: Sides,
}

impl DeviceContact {
    /// From the stiffness of the device about the probe tip, in the nozzle frame, and its damping over its stiffness. Negative
    /// stiffness is unstable, and is answered.
    pub fn new(device: &StiffnessTensor, relaxation_s: f64, sides: Sides) -> Result<Self, Refusal> {
        for value in device.0.iter() {
            refusal::finite("stiffness", *value, "N/m, N or N m")?;
        }
        let Some(compliance) = device.compliance() else {
            let limit = "is not different from 0: some direction carries nothing";
            return Err(Refusal { name: "determinant", value: 0.0, unit: "(N/m)^3 (N m)^3", limit });
        };
        let relaxation_s = refusal::finite("relaxation_s", relaxation_s, "s")?;
        Ok(DeviceContact { compliance, relaxation_s, sides })
    }

    /// The stiffness that this contact feels along its normal.
    pub fn stiffness_n_per_m(&self, touch: &Touch) -> f64 {
        let (n, lever) = (&touch.normal, touch.arm_m.cross(&touch.normal));
        let unit = Vector6::new(n.x, n.y, n.z, lever.x, lever.y, lever.z);
        1.0 / unit.dot(&(self.compliance * unit))
    }
}

impl ContactLaw<Spatial> for DeviceContact {
    fn force(&self, touch: &Touch) -> ContactForce<Spatial> {
        let stiffness_n_per_m = self.stiffness_n_per_m(touch);
        ContactForce {
            elastic: touch.pushed(stiffness_n_per_m * touch.depth_m),
            dissipative: touch.pushed(stiffness_n_per_m * self.relaxation_s * touch.rate_m_per_s),
        }
    }

    fn clamped(&self, touch: &Touch, force: &ContactForce<Spatial>) -> Wrench {
        self.sides.clamped(touch, force)
    }
}
