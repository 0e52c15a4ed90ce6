//! Two free bodies in the plane that touch in one point: the contact's inverse mass, and the loop's fourth-order equation.
//!
//! With n along the normal and t along the tangent, `A = J M⁻¹ Jᵀ` has `A_nn = Σ (1/m + d²/J)`, `A_tt = Σ (1/m + a²/J)` and
//! `A_nt = -Σ d a / J`. The loop is `det(s² I + A (K + B s) e^{-hs}) = 0`.
//!
//! - Only normal compliance: a rigid double zero, and the loop along one axis with the reduced contact mass 1/A_nn.
//! - Damping in proportion, B = α K: it falls apart into one loop for each eigenvalue λ of A K, with mass 1/λ, stiffness 1 and
//!   damping α; the smallest critical delay decides.
//! - Anything else: `PlanarContact::system` and its characteristic roots.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m, J | mass and inertia of a body | kg, kg m² |
//! | d | lever of the normal force: offset of the contact from the centre of mass along t | m |
//! | a | lever of the tangential force: offset along n | m |
//! | K, B | stiffness and damping at the contact, rows and columns (n, t) | N/m, N s/m |
//! | h | dead time of the loop | s |
//!
//! Not modelled: friction, a normal that turns, a lever that changes. Source: `reference/PHYSICS.md`, section 3.1.

use super::eigen::exponential;
use super::exact::{Critical, critical_delay};
use super::spectral::{DelayedForce, DelayedSystem};
use crate::refusal::{Refusal, finite, not_negative, positive};
use nalgebra::{Complex, DMatrix, Matrix2};

/// A free body in the plane, as the contact sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarBody {
    /// Mass.
    pub mass_kg: f64,
    /// Inertia about the centre of mass.
    pub inertia_kg_m2: f64,
    /// Offset of the contact point from the centre of mass along the tangent: lever of the normal force.
    pub normal_lever_m: f64,
    /// The same along the normal: lever of the tangential force.
    pub tangential_lever_m: f64,
}

impl PlanarBody {
    fn checked(&self) -> Result<(), Refusal> {
        positive("mass_kg", self.mass_kg, "kg")?;
        positive("inertia_kg_m2", self.inertia_kg_m2, "kg m²")?;
        finite("normal_lever_m", self.normal_lever_m, "m")?;
        finite("tangential_lever_m", self.tangential_lever_m, "m")?;
        Ok(())
    }

    fn inverse_mass(&self) -> Matrix2<f64> {
        let (d, a) = (self.normal_lever_m, self.tangential_lever_m);
        let (mobility, turn) = (1.0 / self.mass_kg, 1.0 / self.inertia_kg_m2);
        let cross = -d * a * turn;
        Matrix2::new(mobility + d * d * turn, cross, cross, mobility + a * a * turn)
    }
}

/// Two bodies and what is between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarContact {
    /// The chaser.
    pub chaser: PlanarBody,
    /// The target.
    pub target: PlanarBody,
    /// Stiffness over (n, t).
    pub stiffness_n_per_m: Matrix2<f64>,
    /// Damping over (n, t).
    pub damping_n_s_per_m: Matrix2<f64>,
}

/// The edge where damping is in proportion to stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decoupled {
    /// Eigenvalues of A K: squares of the frequencies without damping and delay, larger first.
    pub squared_rad2_per_s2: [f64; 2],
    /// Each one's critical delay; `None` for a direction without stiffness.
    pub critical: [Option<Critical>; 2],
}

impl Decoupled {
    /// The edge that is met first.
    pub fn first(&self) -> Option<Critical> {
        let both = self.critical.iter().flatten();
        both.copied().min_by(|a, b| a.delay_s.total_cmp(&b.delay_s))
    }
}

impl PlanarContact {
    /// The contact's inverse mass A over (n, t), in 1/kg.
    pub fn inverse_mass(&self) -> Result<Matrix2<f64>, Refusal> {
        self.chaser.checked()?;
        self.target.checked()?;
        Ok(self.chaser.inverse_mass() + self.target.inverse_mass())
    }

    /// The mass that a normal force feels, `1/m_a = 1/m_C + 1/m_T + d_C²/J_C + d_T²/J_T`.
    pub fn reduced_mass_kg(&self) -> Result<f64, Refusal> {
        Ok(1.0 / self.inverse_mass()?[(0, 0)])
    }

    /// The edge if only the normal direction has stiffness and damping: those of row and column n.
    pub fn normal_critical_delay(&self) -> Result<Option<Critical>, Refusal> {
        let (stiffness, damping) = (self.stiffness_n_per_m[(0, 0)], self.damping_n_s_per_m[(0, 0)]);
        Ok(critical_delay(self.reduced_mass_kg()?, stiffness, damping))
    }

    /// The edge for damping in proportion, `B = α K` with α in s, whatever `damping_n_s_per_m` says. K has to be symmetric.
    pub fn proportional(&self, proportion_s: f64) -> Result<Decoupled, Refusal> {
        not_negative("proportion_s", proportion_s, "s")?;
        let k = self.stiffness_n_per_m;
        let skew = (k[(0, 1)] - k[(1, 0)]).abs();
        if skew > 1e-9 * k.norm() {
            return Err(Refusal { name: "skew stiffness", value: skew, unit: "N/m", limit: "is not 0: no potential" });
        }
        // A K has the eigenvalues of the symmetric L^T K L with A = L L^T.
        let limit = "is not above 0";
        let refusal = Refusal { name: "inverse mass", value: 0.0, unit: "1/kg", limit };
        let factor = self.inverse_mass()?.cholesky().ok_or(refusal)?.l();
        let values = (factor.transpose() * k * factor).symmetric_eigenvalues();
        let squared = [values.max(), values.min()];
        Ok(Decoupled {
            squared_rad2_per_s2: squared,
            critical: squared.map(|value| critical_delay(1.0 / value, 1.0, proportion_s)),
        })
    }

    /// The loop with one dead time, for its characteristic roots.
    pub fn system(&self, delay_s: f64) -> Result<DelayedSystem, Refusal> {
        let dynamic = |matrix: &Matrix2<f64>| DMatrix::from_column_slice(2, 2, matrix.as_slice());
        let force =
            DelayedForce::spring_dashpot(delay_s, dynamic(&self.stiffness_n_per_m), dynamic(&self.damping_n_s_per_m));
        DelayedSystem::with_mobility(&dynamic(&self.inverse_mass()?), &[force])
    }

    /// The left side of the fourth-order equation at s, in 1/s⁴: zero at a root.
    pub fn characteristic(&self, s: Complex<f64>, delay_s: f64) -> Result<Complex<f64>, Refusal> {
        let late = exponential(-s * delay_s);
        let a = self.inverse_mass()?;
        let entry = |row: usize, column: usize| {
            let share = |k: usize| {
                a[(row, k)] * (self.stiffness_n_per_m[(k, column)] + s * self.damping_n_s_per_m[(k, column)])
            };
            let inertia = if row == column { s * s } else { Complex::new(0.0, 0.0) };
            inertia + (share(0) + share(1)) * late
        };
        Ok(entry(0, 0) * entry(1, 1) - entry(0, 1) * entry(1, 0))
    }
}
