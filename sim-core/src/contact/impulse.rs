//! Contact as a jump of the speeds: no force, no duration, `d'₊ = -e d'₋` (the discrete model, thesis eq. 1.1).
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | e | restitution | 1 | measured, or from a law, see `restitution` |
//! | d' | rate at which the interfaces close | m/s | |
//! | P | impulse, `(1 + e) d' / w` while they close | N s | |
//! | w | inverse mass that the contact feels, `Σ 1/m + (r × n)ᵀ J⁻¹ (r × n)` over both bodies | 1/kg | |
//! | r, n | arm from centre of mass to contact point; normal | m, 1 | |
//!
//! It is no contact law of the loop: it has no force between, so that no sensor can read it and no delay acts on it. It is the
//! reference against which a contact that took time is judged: which speeds and which energy an e stands for.
//!
//! e > 1 creates energy, and is answered: that is what a delayed loop does. Not modelled: friction, more than one point.

use crate::refusal::{self, Refusal};
use nalgebra::{Matrix3, Vector3};

/// An impact of known restitution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impulse {
    restitution: f64,
}

/// One of the bodies, as the contact feels it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Struck {
    /// Mass.
    pub mass_kg: f64,
    /// Inverse of the inertia tensor about the centre of mass, in the frame of arm and normal; zero for a body that cannot turn.
    pub inverse_inertia_per_kg_m2: Matrix3<f64>,
    /// From the centre of mass to the contact point.
    pub arm_m: Vector3<f64>,
}

impl Struck {
    /// What the body adds to the inverse mass w along this unit normal.
    pub fn inverse_mass_per_kg(&self, normal: &Vector3<f64>) -> Result<f64, Refusal> {
        let mass_kg = refusal::positive("mass_kg", self.mass_kg, "kg")?;
        let lever = self.arm_m.cross(normal);
        Ok(1.0 / mass_kg + lever.dot(&(self.inverse_inertia_per_kg_m2 * lever)))
    }
}

impl Impulse {
    /// An impact of this restitution.
    pub fn new(restitution: f64) -> Result<Self, Refusal> {
        Ok(Impulse { restitution: refusal::not_negative("restitution", restitution, "")? })
    }

    /// The impulse on both bodies, in opposite directions; none if they part already.
    pub fn impulse_n_s(&self, rate_m_per_s: f64, inverse_mass_per_kg: f64) -> f64 {
        if rate_m_per_s > 0.0 { (1.0 + self.restitution) * rate_m_per_s / inverse_mass_per_kg } else { 0.0 }
    }

    /// The speeds after a straight impact of two masses; the first runs into the second if its speed is the greater.
    pub fn speeds_after(&self, masses_kg: [f64; 2], speeds_m_per_s: [f64; 2]) -> Result<[f64; 2], Refusal> {
        let inverse = [
            1.0 / refusal::positive("mass_kg", masses_kg[0], "kg")?,
            1.0 / refusal::positive("mass_kg", masses_kg[1], "kg")?,
        ];
        let impulse_n_s = self.impulse_n_s(speeds_m_per_s[0] - speeds_m_per_s[1], inverse[0] + inverse[1]);
        Ok([speeds_m_per_s[0] - impulse_n_s * inverse[0], speeds_m_per_s[1] + impulse_n_s * inverse[1]])
    }

    /// Energy that the impact takes from the relative motion, `(1 - e²) d'² / 2w`; negative if it creates some.
    pub fn absorbed_j(&self, rate_m_per_s: f64, inverse_mass_per_kg: f64) -> f64 {
        if rate_m_per_s <= 0.0 {
            return 0.0;
        }
        0.5 * (1.0 - self.restitution * self.restitution) * rate_m_per_s * rate_m_per_s / inverse_mass_per_kg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Momentum stays, the rate turns by -e, and the energy that is missing is the energy that is stated.
    #[test]
    fn an_impact_keeps_the_momentum_and_turns_the_rate() {
        let (masses, before) = ([63.2, 250.0], [0.035, -0.01]);
        for e in [0.0, 0.4, 1.0, 1.2] {
            let impact = Impulse::new(e).unwrap();
            let after = impact.speeds_after(masses, before).unwrap();
            let momentum = |speeds: [f64; 2]| masses[0] * speeds[0] + masses[1] * speeds[1];
            let energy_j = |v: [f64; 2]| 0.5 * (masses[0] * v[0] * v[0] + masses[1] * v[1] * v[1]);
            // A handful of roundings of terms of the size of the largest.
            assert!((momentum(after) - momentum(before)).abs() < 8.0 * f64::EPSILON * 2.5);
            assert!(((after[1] - after[0]) - e * (before[0] - before[1])).abs() < 8.0 * f64::EPSILON * 0.05);
            let absorbed_j = impact.absorbed_j(before[0] - before[1], 1.0 / masses[0] + 1.0 / masses[1]);
            assert!((energy_j(before) - energy_j(after) - absorbed_j).abs() < 16.0 * f64::EPSILON * 0.06);
        }
        let apart = Impulse::new(0.5).unwrap().speeds_after(masses, [-0.1, 0.1]).unwrap();
        assert_eq!(apart.map(f64::to_bits), [-0.1, 0.1].map(f64::to_bits), "they part already");
        assert!(Impulse::new(-0.1).is_err() && Impulse::new(f64::NAN).is_err());
        assert!(Impulse::new(0.5).unwrap().speeds_after([0.0, 1.0], before).is_err());
    }

    /// reference/PHYSICS.md, section 3.1: two bodies of 50 kg, 2 kg m², lever 0.155 m feel like 15.6 kg.
    #[test]
    fn a_lever_makes_a_body_lighter() {
        let body = Struck {
            mass_kg: 50.0,
            inverse_inertia_per_kg_m2: Matrix3::identity() * 0.5,
            arm_m: Vector3::new(0.155, 0.0, 0.3),
        };
        let one = body.inverse_mass_per_kg(&-Vector3::z()).unwrap();
        // Their three digits.
        assert!((1.0 / (2.0 * one) - 15.6).abs() < 0.05, "{}", 1.0 / (2.0 * one));
        assert!(Struck { mass_kg: -1.0, ..body }.inverse_mass_per_kg(&Vector3::z()).is_err());
    }
}
