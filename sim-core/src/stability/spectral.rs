//! Rightmost characteristic roots of any linear loop with delays: `x' = A x + Σ (Aⱼ x(t - τⱼ) + Cⱼ x'(t - τⱼ))`.
//!
//! A root s with direction v satisfies `Δ(s) v = 0`, `Δ(s) = s I - A - Σ (Aⱼ + s Cⱼ) e^{-sτⱼ}`. There are infinitely many. The
//! state over the last τ_max is represented by its values at Chebyshev nodes; the operator that moves it on becomes a matrix,
//! whose rightmost eigenvalues are starts for Newton's method on Δ itself. So the roots are exact to rounding, and only
//! *finding* them rests on the nodes.
//!
//! How many nodes: a root in the right half plane is no larger than R, the spectral radius of
//! `(I - Σ|Cⱼ|)⁻¹ (|A| + Σ|Aⱼ|)`. Twelve nodes and one more per radian of R τ_max resolve e^{sθ} there to a few digits.
//!
//! With Cⱼ (the inertia of a tool between sensor and contact, say) the system is neutral: it has chains of roots of ever higher
//! frequency. With one such delay they tend to the line Re s = ln(r)/τ, r the spectral radius of C. From r = 1 on no finite set
//! of roots decides: it is unstable at frequencies without bound.
//!
//! With several, r would be the largest spectral radius of `Σ Cⱼ e^{iβⱼ}` over all phases βⱼ. The phases are not searched: the
//! spectral radius of `Σ|Cⱼ|` (entry by entry) stands in, an upper bound for every set of delays. Below 1 stability is decided
//! by the roots, as it is. From 1 on a system is called unstable that may be stable: the answer errs on the safe side.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x | state: positions and velocities for a mechanical system | m, m/s |
//! | A, Aⱼ | rates of the state from the state now and τⱼ ago | 1/s |
//! | Cⱼ | share of the rate of τⱼ ago | 1 |
//! | τⱼ | delays | s |
//!
//! Not modelled: contact that opens, sampling (`sampled`). Source: `reference/PHYSICS.md`, sections 2.1 and 3.1.

use super::chebyshev::{differentiation, interpolation};
use super::eigen::{eigenvalues, exponential, modulus, spectral_radius};
pub use super::mechanical::DelayedForce;
use crate::refusal::{Refusal, not_negative};
use alloc::vec::Vec;
use nalgebra::{Complex, DMatrix, DVector};

/// Imaginary part that a real eigenvalue may have, over the largest one: a double one has the root of a rounding.
const REAL: f64 = 1e-7;
/// Nodes on the delay interval: at least, and at most (times the states, so that the matrix stays in reach).
const NODES_MIN: f64 = 12.0;
const SIZE_MAX: usize = 400;
/// Nodes for a neutral system, whose bound R is loose near r = 1: roots of higher frequency belong to the chain that r judges.
const NODES_NEUTRAL: usize = 60;
/// Where a root at zero is certain, a root below this share of 1/τ_max is that one, with Newton's method settled or not.
const SETTLED_ZERO: f64 = 1e-6;
const UNSETTLED_ZERO: f64 = 1e-3;
/// Steps of Newton's method; it doubles the digits with each.
const NEWTON_STEPS: usize = 40;

/// What acts with one delay.
#[derive(Debug, Clone, PartialEq)]
pub struct Delayed {
    /// The delay τ.
    pub delay_s: f64,
    /// Matrix on the state of then.
    pub on_state: DMatrix<f64>,
    /// Matrix on the rate of the state of then; zero unless the system is neutral.
    pub on_rate: DMatrix<f64>,
}

/// A linear system with delays.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayedSystem {
    now: DMatrix<f64>,
    delayed: Vec<Delayed>,
    pub(super) rigid_modes: usize,
}

/// One characteristic root; its conjugate is meant too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Real part: growth (positive) or decay.
    pub growth_per_s: f64,
    /// Imaginary part, not negative.
    pub frequency_rad_per_s: f64,
}

/// The roots that decide.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// The rightmost roots, rightmost first.
    pub roots: Vec<Root>,
    /// Directions in which no force acts: a double root at zero each, left out of `roots`.
    pub rigid_modes: usize,
    /// Whether there is a root at zero beside them: a motion that nothing brings back. It is left out of `roots`.
    pub root_at_zero: bool,
    /// r of the neutral part, 0 if it has none: exact with one delay of a rate, an upper bound with several. From 1 on no roots
    /// are sought.
    pub neutral_radius: f64,
}

impl Spectrum {
    /// Whether every motion that meets a force decays. With several delays of rates a stable system may be called unstable.
    pub fn stable(&self) -> bool {
        self.neutral_radius < 1.0 && self.roots.first().is_none_or(|root| root.growth_per_s < 0.0)
    }
}

impl DelayedSystem {
    /// A system from its matrices. Refuses delays without meaning, and a rate fed back without delay.
    pub fn new(now: DMatrix<f64>, delayed: Vec<Delayed>) -> Result<Self, Refusal> {
        let n = now.nrows();
        shaped("state matrix", &now, n)?;
        let mut system = DelayedSystem { now, delayed: Vec::new(), rigid_modes: 0 };
        for term in delayed {
            not_negative("delay_s", term.delay_s, "s")?;
            shaped("delayed state matrix", &term.on_state, n)?;
            shaped("delayed rate matrix", &term.on_rate, n)?;
            let neutral = term.on_rate.iter().any(|&value| value != 0.0);
            if term.delay_s == 0.0 && neutral {
                return Err(Refusal { name: "delay_s", value: 0.0, unit: "s", limit: "feeds a rate back at once" });
            }
            if term.delay_s == 0.0 {
                system.now += term.on_state;
            } else if let Some(same) =
                system.delayed.iter_mut().find(|other| other.delay_s.total_cmp(&term.delay_s).is_eq())
            {
                same.on_state += term.on_state;
                same.on_rate += term.on_rate;
            } else {
                system.delayed.push(term);
            }
        }
        Ok(system)
    }

    /// The rightmost roots, at most `count`, conjugates counted once.
    pub fn rightmost(&self, count: usize) -> Result<Spectrum, Refusal> {
        let neutral_radius = self.neutral_radius()?;
        let mut spectrum = Spectrum {
            roots: Vec::new(),
            rigid_modes: self.rigid_modes,
            root_at_zero: self.root_at_zero(),
            neutral_radius,
        };
        if self.now.nrows() == 0 || neutral_radius >= 1.0 {
            return Ok(spectrum);
        }
        let (wanted, nodes) = self.nodes();
        let generator = self.generator(nodes);
        let lost =
            Refusal { name: "size", value: generator.nrows() as f64, unit: "states", limit: "does not converge" };
        let mut starts = eigenvalues(generator).ok_or(lost)?;
        // Conjugates count once. A real eigenvalue may come out a rounding of the largest below the axis: it must not get lost.
        let rounding = REAL * starts.iter().copied().map(modulus).fold(0.0, f64::max);
        starts.retain(|start| start.im >= -rounding);
        starts.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
        // Some starts more than asked for: Newton's method may change their order, and merges those that are one root. What
        // it does not settle on is no root but an artefact of the nodes, far to the left.
        let mut unsettled = f64::NEG_INFINITY;
        let span_s = self.longest_delay_s();
        let rate_per_s = if span_s > 0.0 { 1.0 / span_s } else { self.largest_unstable_rad_per_s() };
        for &start in starts.iter().take(2 * count + 4) {
            let settled = self.polished(start);
            // A double root at zero is moved by the root of its rounding, and Newton's method only creeps back to it.
            let reach = if settled.is_some() { SETTLED_ZERO } else { UNSETTLED_ZERO };
            if spectrum.root_at_zero && modulus(settled.unwrap_or(start)) < reach * rate_per_s {
                continue;
            }
            let Some(root) = settled else {
                unsettled = unsettled.max(start.re);
                continue;
            };
            let same = |other: &Root| {
                let distance = Complex::new(root.re - other.growth_per_s, root.im.abs() - other.frequency_rad_per_s);
                modulus(distance) <= 1e-9 * (1.0 + modulus(root))
            };
            if !spectrum.roots.iter().any(same) {
                spectrum.roots.push(Root { growth_per_s: root.re, frequency_rad_per_s: root.im.abs() });
            }
        }
        spectrum.roots.sort_by(|a, b| b.growth_per_s.total_cmp(&a.growth_per_s));
        spectrum.roots.truncate(count);
        let rightmost = spectrum.roots.first().map_or(f64::NEG_INFINITY, |root| root.growth_per_s);
        // With too few nodes a root that was found is a root all the same; that there is none cannot be told.
        if wanted > nodes as f64 && rightmost < 0.0 {
            let limit = "is too many for the spectral method: delay times stiffness is out of proportion";
            return Err(Refusal { name: "nodes", value: wanted, unit: "rows", limit });
        }
        if unsettled > rightmost {
            let limit = "is the growth of a root that Newton's method does not settle on";
            return Err(Refusal { name: "growth_per_s", value: unsettled, unit: "1/s", limit });
        }
        Ok(spectrum)
    }

    /// Rows of the matrix whose eigenvalues `rightmost` takes: its time goes with their third power.
    pub fn rows(&self) -> usize {
        if self.now.nrows() == 0 { 0 } else { (self.nodes().1 + 1) * self.now.nrows() }
    }

    /// Δ(s) and its derivative.
    pub fn characteristic(&self, s: Complex<f64>) -> (DMatrix<Complex<f64>>, DMatrix<Complex<f64>>) {
        let n = self.now.nrows();
        let mut value = DMatrix::from_diagonal_element(n, n, s) - complex(&self.now);
        let mut slope = DMatrix::from_diagonal_element(n, n, Complex::new(1.0, 0.0));
        for term in &self.delayed {
            let late = exponential(-s * term.delay_s);
            let (on_state, on_rate) = (complex(&term.on_state), complex(&term.on_rate));
            let both = &on_state + &on_rate * s;
            value -= &both * late;
            slope -= (on_rate - both * Complex::new(term.delay_s, 0.0)) * late;
        }
        (value, slope)
    }

    /// Newton's method on `Δ(s) v = 0`, as inverse iteration; `None` if it does not settle near the start.
    fn polished(&self, start: Complex<f64>) -> Option<Complex<f64>> {
        let n = self.now.nrows();
        // A direction without symmetry, so that no mode is perpendicular to it.
        let mut v = DVector::from_fn(n, |row, _| Complex::new(1.0 + 0.37 * row as f64, 0.11 * row as f64));
        let mut s = start;
        let reach = 0.5 * (modulus(start) + 1.0 / self.longest_delay_s().max(1e-9));
        let mut last = f64::INFINITY;
        for step in 0..NEWTON_STEPS {
            let (value, slope) = self.characteristic(s);
            let Some(next) = value.lu().solve(&(&slope * &v)) else { return Some(s) };
            let gain = v.dotc(&next);
            let length = v.norm_squared();
            if modulus(gain) == 0.0 || !(gain.re.is_finite() && gain.im.is_finite()) {
                return None;
            }
            v = &next / Complex::new(next.norm(), 0.0);
            // The first solution only turns the direction towards the null space.
            if step == 0 {
                continue;
            }
            let change = Complex::new(length, 0.0) / gain;
            s -= change;
            if modulus(s - start) > reach {
                return None;
            }
            // Rounding of Δ stops it some digits above that of s, more so where roots lie close together.
            if modulus(change) <= 1e-13 * (modulus(s) + 1e-3) {
                return Some(s);
            }
            last = modulus(change);
        }
        (last <= 1e-7 * (modulus(s) + 1e-3)).then_some(s)
    }

    fn longest_delay_s(&self) -> f64 {
        self.delayed.iter().map(|term| term.delay_s).fold(0.0, f64::max)
    }

    /// R of the module's doc: no root in the right half plane is larger.
    fn largest_unstable_rad_per_s(&self) -> f64 {
        let n = self.now.nrows();
        let mut rates = self.now.abs();
        let mut shares = DMatrix::identity(n, n);
        for term in &self.delayed {
            rates += term.on_state.abs();
            shares -= term.on_rate.abs();
        }
        let bound = shares.try_inverse().map(|inverse| inverse.abs() * rates);
        bound.and_then(spectral_radius).unwrap_or(f64::INFINITY)
    }

    /// How many nodes would resolve every unstable root, and how many are taken.
    fn nodes(&self) -> (f64, usize) {
        let wanted = libm::ceil(NODES_MIN + self.largest_unstable_rad_per_s() * self.longest_delay_s());
        let most = SIZE_MAX / self.now.nrows();
        let wanted = if self.is_neutral() { wanted.min(NODES_NEUTRAL as f64).min(most as f64) } else { wanted };
        (wanted, wanted.min(most as f64) as usize)
    }

    /// The matrix that moves the state over the last τ_max on, at this many Chebyshev nodes.
    fn generator(&self, nodes: usize) -> DMatrix<f64> {
        let n = self.now.nrows();
        let span_s = self.longest_delay_s();
        if span_s == 0.0 {
            return self.now.clone();
        }
        let slopes = differentiation(nodes) * (2.0 / span_s);
        let mut generator = DMatrix::zeros((nodes + 1) * n, (nodes + 1) * n);
        for row in 1..=nodes {
            for column in 0..=nodes {
                generator.view_mut((row * n, column * n), (n, n)).fill_diagonal(slopes[(row, column)]);
            }
        }
        generator.view_mut((0, 0), (n, n)).copy_from(&self.now);
        for term in &self.delayed {
            let values = interpolation(nodes, 1.0 - 2.0 * term.delay_s / span_s);
            let rates = &values * &slopes;
            for column in 0..=nodes {
                let block = &term.on_state * values[column] + &term.on_rate * rates[column];
                let mut place = generator.view_mut((0, column * n), (n, n));
                place += block;
            }
        }
        generator
    }

    /// Whether Δ(0) has no inverse.
    fn root_at_zero(&self) -> bool {
        let sum = self.delayed.iter().fold(self.now.clone(), |sum, term| sum + &term.on_state);
        if sum.is_empty() {
            return false;
        }
        let values = sum.singular_values();
        values.min() <= 1e-13 * values.max()
    }

    fn is_neutral(&self) -> bool {
        self.delayed.iter().any(|term| term.on_rate.iter().any(|&value| value != 0.0))
    }

    /// r of the module's doc. With one delay the phase does not matter; with several r is bounded from above.
    fn neutral_radius(&self) -> Result<f64, Refusal> {
        let neutral: Vec<&DMatrix<f64>> = self
            .delayed
            .iter()
            .map(|term| &term.on_rate)
            .filter(|rate| rate.iter().any(|&value| value != 0.0))
            .collect();
        let lost = Refusal { name: "inertia", value: neutral.len() as f64, unit: "terms", limit: "do not converge" };
        match neutral[..] {
            [] => Ok(0.0),
            [only] => spectral_radius(only.clone()).ok_or(lost),
            _ => {
                // Entry by entry no phases can make the sum larger than this, so its radius is no smaller than r.
                let n = self.now.nrows();
                let sum = neutral.iter().fold(DMatrix::zeros(n, n), |sum, rate| sum + rate.abs());
                spectral_radius(sum).ok_or(lost)
            }
        }
    }
}

/// Square, of this size, and finite.
pub(super) fn shaped(name: &'static str, matrix: &DMatrix<f64>, n: usize) -> Result<(), Refusal> {
    if matrix.nrows() != n || matrix.ncols() != n {
        return Err(Refusal {
            name,
            value: matrix.nrows() as f64,
            unit: "rows",
            limit: "does not fit the other matrices",
        });
    }
    match matrix.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(Refusal { name, value, unit: "as an entry", limit: "is not a finite number" }),
        None => Ok(()),
    }
}

fn complex(matrix: &DMatrix<f64>) -> DMatrix<Complex<f64>> {
    matrix.map(|value| Complex::new(value, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::exact::critical_delay;

    fn one(value: f64) -> DMatrix<f64> {
        DMatrix::from_element(1, 1, value)
    }

    fn axis(mass: f64, stiffness: f64, damping: f64, delay_s: f64) -> DelayedSystem {
        let force = DelayedForce::spring_dashpot(delay_s, one(stiffness), one(damping));
        DelayedSystem::mechanical(&one(mass), &[force]).unwrap()
    }

    #[test]
    fn without_delay_it_is_an_oscillator() {
        let spectrum = axis(2.0, 200.0, 4.0, 0.0).rightmost(2).unwrap();
        let frequency = libm::sqrt(100.0 - 1.0);
        assert_eq!(spectrum.roots.len(), 1);
        assert!((spectrum.roots[0].growth_per_s + 1.0).abs() < 1e-12);
        assert!((spectrum.roots[0].frequency_rad_per_s - frequency).abs() < 1e-12);
    }

    #[test]
    fn at_the_edge_a_pair_sits_on_the_axis() {
        for (mass, stiffness, damping) in [
            (60.0, 1000.0, 50.0),
            (15.6, 3000.0, 50.0),
            (1000.0, 500.0, 17.0),
            (60.0, 1000.0, 800.0),
            (15.6, 106_590.0, 500.0),
        ] {
            let edge = critical_delay(mass, stiffness, damping).unwrap();
            let spectrum = axis(mass, stiffness, damping, edge.delay_s).rightmost(1).unwrap();
            let found = spectrum.roots[0];
            let rounding = 1e-12 * edge.frequency_rad_per_s;
            assert!(found.growth_per_s.abs() < rounding, "{found:?}");
            assert!((found.frequency_rad_per_s - edge.frequency_rad_per_s).abs() < rounding, "{found:?} {edge:?}");
        }
    }

    #[test]
    fn every_root_is_a_root() {
        let system = axis(63.2, 1066.0, 40.0, 0.1);
        for root in system.rightmost(6).unwrap().roots {
            let s = Complex::new(root.growth_per_s, root.frequency_rad_per_s);
            let left = s * s * 63.2 + (s * 40.0 + 1066.0) * exponential(-s * 0.1);
            assert!(modulus(left) < 1e-10 * modulus(s * s * 63.2), "{root:?}: {left}");
        }
    }

    #[test]
    fn six_axes_with_two_delays_are_six_loops_if_nothing_couples() {
        let mass = DMatrix::from_diagonal(&DVector::from_column_slice(&[60.0, 60.0, 60.0, 8.0, 9.0, 10.0]));
        let stiffness = DMatrix::from_diagonal(&DVector::from_column_slice(&[1000.0, 800.0, 1200.0, 50.0, 60.0, 70.0]));
        let damping = &stiffness * 0.06;
        let half = |delay_s| DelayedForce::spring_dashpot(delay_s, &stiffness * 0.5, &damping * 0.5);
        let all = DelayedSystem::mechanical(&mass, &[half(0.016), half(0.032)]).unwrap().rightmost(6).unwrap();
        assert!(all.stable() && all.roots.len() == 6 && all.rigid_modes == 0, "{all:?}");
        let mut single: Vec<Root> = (0..6)
            .map(|i| {
                let one_half = |delay_s| {
                    DelayedForce::spring_dashpot(delay_s, one(stiffness[(i, i)] * 0.5), one(damping[(i, i)] * 0.5))
                };
                let system = DelayedSystem::mechanical(&one(mass[(i, i)]), &[one_half(0.016), one_half(0.032)]);
                system.unwrap().rightmost(1).unwrap().roots[0]
            })
            .collect();
        single.sort_by(|a, b| b.growth_per_s.total_cmp(&a.growth_per_s));
        for (together, alone) in all.roots.iter().zip(&single) {
            assert!((together.growth_per_s - alone.growth_per_s).abs() < 1e-10, "{all:?} {single:?}");
            assert!((together.frequency_rad_per_s - alone.frequency_rad_per_s).abs() < 1e-10);
        }
    }

    #[test]
    fn a_direction_without_force_is_counted_and_left_out() {
        let mass = DMatrix::from_diagonal_element(3, 3, 60.0);
        let mut stiffness = DMatrix::zeros(3, 3);
        stiffness[(2, 2)] = 1000.0;
        let force = DelayedForce::spring_dashpot(0.016, stiffness.clone(), stiffness * 0.05);
        let spectrum = DelayedSystem::mechanical(&mass, &[force]).unwrap().rightmost(1).unwrap();
        assert_eq!(spectrum.rigid_modes, 2);
        let alone = axis(60.0, 1000.0, 50.0, 0.016).rightmost(1).unwrap();
        assert!((spectrum.roots[0].growth_per_s - alone.roots[0].growth_per_s).abs() < 1e-12);
    }

    #[test]
    fn several_delays_of_rates_are_bounded_from_above() {
        let rate = |delay_s, right: f64, left: f64| Delayed {
            delay_s,
            on_state: DMatrix::zeros(2, 2),
            on_rate: DMatrix::from_row_slice(2, 2, &[0.0, right, left, 0.0]),
        };
        let radius = |terms: &[(f64, f64, f64)]| {
            let delayed = terms.iter().map(|&(delay_s, right, left)| rate(delay_s, right, left)).collect();
            let spectrum = DelayedSystem::new(-DMatrix::identity(2, 2), delayed).unwrap().rightmost(1).unwrap();
            (spectrum.neutral_radius, spectrum.stable())
        };
        let (alone, _) = radius(&[(0.1, 0.6, 0.6)]);
        assert!((alone - 0.6).abs() < 1e-12, "{alone}");
        // Their phases a, b give a radius of 0.6 √|e^{2ia} - e^{2ib}|, 0.85 at most: the bound of 1.2 is safe, and not sharp.
        let (bound, stable) = radius(&[(0.1, 0.6, 0.6), (0.23, 0.6, -0.6)]);
        assert!((bound - 1.2).abs() < 1e-12 && !stable, "{bound}");
    }

    #[test]
    fn input_without_meaning_is_refused() {
        let force = |delay_s| DelayedForce::spring_dashpot(delay_s, one(1.0), one(1.0));
        assert!(DelayedSystem::mechanical(&one(0.0), &[force(0.1)]).is_err());
        assert!(DelayedSystem::mechanical(&one(1.0), &[force(-0.1)]).is_err());
        assert!(DelayedSystem::mechanical(&DMatrix::identity(2, 2), &[force(0.1)]).is_err());
        let stiff = DelayedForce::spring_dashpot(1.0, one(1e12), one(1.0));
        assert!(DelayedSystem::mechanical(&one(1.0), &[stiff]).unwrap().rightmost(1).is_err());
    }
}
