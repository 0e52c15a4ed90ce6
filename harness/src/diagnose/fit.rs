//! Least squares with runs that scatter: shared knobs, and nuisances of each run with a Gaussian prior.
//!
//! Minimises `J = Σ_s [ |r_s|² + uᵀ Σ⁻¹ u + ln det(C_s Σ) ] + ν Σ_j (s_j²/σ_j² + ln σ_j²/s_j²)`, twice the negative logarithm
//! of the marginal likelihood (Laplace in the nuisances u, C_s their Gauss-Newton Hessian). The scatter σ is estimated with the
//! declared one s as a prior that is worth ν runs. Levenberg-Marquardt; nuisances are eliminated run by run (Schur).

use super::problem::{Knob, Nuisance, Problem, Scatter, Scratch, Trial};
use nalgebra::{DMatrix, DVector};

/// How many runs the declared scatter is worth.
const PRIOR_RUNS: f64 = 3.0;
/// Steps of the minimiser before it gives up.
const STEPS_MAX: usize = 60;
/// How often the scatter is estimated anew: each time it comes closer to what the runs show.
const SCATTER_UPDATES: usize = 2;
/// A step that lowers J by less is the last one: ranking resolves about 1.
const GAIN_MIN: f64 = 0.02;

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Base values and effects.
    pub trial: Trial,
    /// The knobs that were turned.
    pub knobs: Vec<Knob>,
    /// Nuisances of each run; those of runs that did not take part stay at their start.
    pub nuisances: Vec<Nuisance>,
    /// Estimated scatter.
    pub scatter: Scatter,
    /// Declared scatter.
    pub declared: Scatter,
    /// J, over the runs that took part.
    pub cost: f64,
    /// Inverse covariance of the knobs, nuisances eliminated.
    pub information: DMatrix<f64>,
}

impl Fit {
    /// Standard deviation of each knob; infinite where the runs say nothing of it.
    pub fn deviations(&self) -> Vec<f64> {
        let inverse = self.information.clone().cholesky().map(|factor| factor.inverse());
        let of = |i: usize| inverse.as_ref().map_or(f64::INFINITY, |inverse| libm::sqrt(inverse[(i, i)].max(0.0)));
        (0..self.knobs.len()).map(of).collect()
    }

    /// Logarithm of the determinant of the information, with a prior as wide as a hundred times what matters for each knob.
    fn spread(&self) -> f64 {
        let wide = |knob: &Knob| 100.0 * self.trial.matter(knob);
        let mut matrix = self.information.clone();
        for (i, knob) in self.knobs.iter().enumerate() {
            matrix[(i, i)] += 1.0 / (wide(knob) * wide(knob));
        }
        matrix.cholesky().map_or(0.0, |factor| factor.l().diagonal().iter().map(|d| 2.0 * libm::log(*d)).sum())
    }

    /// Value and standard deviation of a knob.
    pub fn estimate(&self, knob: &Knob) -> Option<(f64, f64)> {
        let at = self.knobs.iter().position(|other| other == knob)?;
        Some((self.trial.get(knob), self.deviations()[at]))
    }
}

/// The quadratic model of one run around a point.
struct Normal {
    shared: DMatrix<f64>,
    mixed: DMatrix<f64>,
    own: DMatrix<f64>,
    shared_gradient: DVector<f64>,
    own_gradient: DVector<f64>,
}

/// Fits the knobs of `start` on `runs`, from the nuisances of `warm` on.
pub fn fit(problem: &Problem, start: &Trial, runs: &[usize], warm: Option<&Fit>, scratch: &mut Scratch) -> Fit {
    minimise(problem, begin(problem, start, warm), runs, scratch)
}

/// Fits the same knobs again on fewer runs.
pub fn fit_without(problem: &Problem, from: &Fit, runs: &[usize], scratch: &mut Scratch) -> Fit {
    minimise(problem, from.clone(), runs, scratch)
}

fn minimise(problem: &Problem, mut fit: Fit, runs: &[usize], scratch: &mut Scratch) -> Fit {
    let mut residuals = all_residuals(problem, &fit, runs, scratch);
    let mut normals = linearise(problem, &fit, runs, &residuals, scratch);
    fit.cost = cost(problem, &fit, runs, &residuals, &normals);
    let mut damping = 1e-3;
    let mut scatter_updates = 0;
    for _ in 0..STEPS_MAX {
        let mut next = fit.clone();
        if !step(&mut next, runs, &normals, damping) {
            damping *= 10.0;
            continue;
        }
        let next_residuals = all_residuals(problem, &next, runs, scratch);
        // Determinants change little within a step: the point is judged by its squares.
        let (before, after) =
            (squares(problem, &fit, runs, &residuals), squares(problem, &next, runs, &next_residuals));
        if after.is_nan() || after > before {
            damping *= 10.0;
            if damping > 1e8 {
                break;
            }
            continue;
        }
        damping = (damping * 0.2).max(1e-9);
        fit = next;
        residuals = next_residuals;
        normals = linearise(problem, &fit, runs, &residuals, scratch);
        if before - after < GAIN_MIN {
            if scatter_updates == SCATTER_UPDATES || !problem.declared[0].is_finite() {
                break;
            }
            fit.scatter = estimated_scatter(problem, &fit, runs, &normals);
            normals = linearise(problem, &fit, runs, &residuals, scratch);
            scatter_updates += 1;
        }
    }
    fit.cost = cost(problem, &fit, runs, &residuals, &normals);
    fit.information = schur(&fit, &normals).0;
    fit
}

/// Twice the negative log predictive density of the run that `without` has not seen and `all` has.
///
/// It is the ratio of two marginal likelihoods (Laplace in the knobs too): what the others say of a knob is the prior under
/// which the left-out run is judged, so that a knob of which they say little is charged for it, and nothing worse.
pub fn predictive(all: &Fit, without: &Fit) -> f64 {
    all.cost + all.spread() - without.cost - without.spread()
}

/// A trial as it stands, with nothing fitted.
pub fn held(problem: &Problem, trial: &Trial) -> Fit {
    begin(problem, trial, None)
}

/// The nuisances of a run that took no part, fitted with the knobs held.
pub fn own_nuisance(problem: &Problem, fit: &Fit, run: usize, scratch: &mut Scratch) -> Nuisance {
    let mut alone = fit.clone();
    for _ in 0..4 {
        let residuals = all_residuals(problem, &alone, &[run], scratch);
        let normals = linearise(problem, &alone, &[run], &residuals, scratch);
        let Some(moves) = own_step(&normals[0], &DVector::zeros(alone.knobs.len())) else { break };
        apply_own(&mut alone.nuisances[run], &moves);
    }
    alone.nuisances[run]
}

fn begin(problem: &Problem, start: &Trial, warm: Option<&Fit>) -> Fit {
    let knobs = start.knobs(problem.model.rig);
    let n = knobs.len();
    let first = || problem.runs.iter().map(|run| problem.first_nuisance(run)).collect();
    Fit {
        trial: start.clone(),
        nuisances: warm.map_or_else(first, |fit| fit.nuisances.clone()),
        scatter: problem.declared,
        declared: problem.declared,
        cost: f64::INFINITY,
        information: DMatrix::zeros(n, n),
        knobs,
    }
}

fn all_residuals(problem: &Problem, fit: &Fit, runs: &[usize], scratch: &mut Scratch) -> Vec<Vec<f64>> {
    runs.iter().map(|&run| problem.residuals(run, &fit.trial, &fit.nuisances[run], scratch)).collect()
}

/// Whether a knob can change what a run shows: a run without contact knows nothing of stiffness.
fn matters(problem: &Problem, run: usize, fit: &Fit, knob: &Knob) -> bool {
    let contact = problem.runs[run].nuisances != 1;
    match knob {
        Knob::Stiffness | Knob::Damping => contact,
        Knob::Effect(e, _) => {
            let wires = &fit.trial.effects[*e].kind.wires;
            contact
                || wires
                    .iter()
                    .any(|wire| !matches!(wire, sim_core::signals::Wire::Contact | sim_core::signals::Wire::Touch))
        }
        Knob::Mass | Knob::Offset => true,
    }
}

fn linearise(
    problem: &Problem,
    fit: &Fit,
    runs: &[usize],
    residuals: &[Vec<f64>],
    scratch: &mut Scratch,
) -> Vec<Normal> {
    let of = |(&run, here): (&usize, &Vec<f64>)| {
        let shared = shared_columns(problem, fit, run, here, scratch);
        let own = problem.nuisance_columns(run, &fit.trial, &fit.nuisances[run], &shared, scratch);
        normal(problem, fit, run, here, &shared, &own)
    };
    runs.iter().zip(residuals).map(of).collect()
}

/// Difference quotients of one run's residuals by every knob; empty for a knob that cannot matter there.
fn shared_columns(problem: &Problem, fit: &Fit, run: usize, here: &[f64], scratch: &mut Scratch) -> Vec<Vec<f64>> {
    let column = |knob: &Knob| {
        if !matters(problem, run, fit, knob) {
            return Vec::new();
        }
        let nudge = fit.trial.nudge(knob);
        let mut moved = fit.trial.clone();
        moved.set(knob, fit.trial.get(knob) + nudge);
        let there = problem.residuals(run, &moved, &fit.nuisances[run], scratch);
        there.iter().zip(here).map(|(there, here)| (there - here) / nudge).collect()
    };
    fit.knobs.iter().map(column).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn normal(problem: &Problem, fit: &Fit, run: usize, here: &[f64], shared: &[Vec<f64>], own: &[Vec<f64>]) -> Normal {
    let (p, q) = (shared.len(), own.len());
    let docking = problem.declared[0].is_finite();
    let prior = |j: usize| if docking { 1.0 / (fit.scatter[j] * fit.scatter[j]) } else { 0.0 };
    let mut own_matrix = DMatrix::from_fn(q, q, |i, j| if j <= i { dot(&own[i], &own[j]) } else { 0.0 });
    own_matrix.fill_upper_triangle_with_lower_triangle();
    for j in 0..q {
        own_matrix[(j, j)] += prior(j);
    }
    let mut shared_matrix = DMatrix::from_fn(p, p, |i, j| if j <= i { dot(&shared[i], &shared[j]) } else { 0.0 });
    shared_matrix.fill_upper_triangle_with_lower_triangle();
    Normal {
        shared: shared_matrix,
        mixed: DMatrix::from_fn(p, q, |i, j| dot(&shared[i], &own[j])),
        own: own_matrix,
        shared_gradient: DVector::from_fn(p, |i, _| dot(&shared[i], here)),
        own_gradient: DVector::from_fn(q, |j, _| dot(&own[j], here) + prior(j) * fit.nuisances[run][j]),
    }
}

/// Matrix and gradient of one run's knobs with its nuisances eliminated.
fn eliminated(normal: &Normal) -> (DMatrix<f64>, DVector<f64>) {
    match normal.own.clone().cholesky() {
        Some(factor) => (
            &normal.shared - &normal.mixed * factor.solve(&normal.mixed.transpose()),
            &normal.shared_gradient - &normal.mixed * factor.solve(&normal.own_gradient),
        ),
        None => (normal.shared.clone(), normal.shared_gradient.clone()),
    }
}

/// Matrix and gradient of the knobs with all nuisances eliminated.
fn schur(fit: &Fit, normals: &[Normal]) -> (DMatrix<f64>, DVector<f64>) {
    let p = fit.knobs.len();
    let zero = (DMatrix::zeros(p, p), DVector::zeros(p));
    normals.iter().map(eliminated).fold(zero, |sum, part| (sum.0 + part.0, sum.1 + part.1))
}

/// One damped step of everything; false if the equations cannot be solved.
fn step(fit: &mut Fit, runs: &[usize], normals: &[Normal], damping: f64) -> bool {
    let (matrix, gradient) = schur(fit, normals);
    let held: Vec<bool> =
        fit.knobs.iter().enumerate().map(|(i, knob)| is_held(&fit.trial, knob, gradient[i])).collect();
    let free: Vec<usize> = (0..held.len()).filter(|&i| !held[i] && matrix[(i, i)] > 0.0).collect();
    let mut small = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
    for i in 0..free.len() {
        small[(i, i)] *= 1.0 + damping;
    }
    let right = DVector::from_fn(free.len(), |i, _| -gradient[free[i]]);
    let Some(factor) = small.cholesky() else { return false };
    let solved = factor.solve(&right);
    let mut moves = DVector::zeros(held.len());
    for (i, &knob) in free.iter().enumerate() {
        let before = fit.trial.get(&fit.knobs[knob]);
        fit.trial.set(&fit.knobs[knob], before + solved[i]);
        moves[knob] = fit.trial.get(&fit.knobs[knob]) - before;
    }
    for (&run, normal) in runs.iter().zip(normals) {
        if let Some(own) = own_step(normal, &moves) {
            apply_own(&mut fit.nuisances[run], &own);
        }
    }
    true
}

/// A knob at its limit that the data push outwards.
fn is_held(trial: &Trial, knob: &Knob, gradient: f64) -> bool {
    let (lower, upper) = trial.limits(knob);
    let value = trial.get(knob);
    (value <= lower && gradient > 0.0) || (value >= upper && gradient < 0.0)
}

/// The best move of a run's own nuisances, once the knobs have moved.
fn own_step(normal: &Normal, moves: &DVector<f64>) -> Option<DVector<f64>> {
    let right = -(&normal.own_gradient + normal.mixed.transpose() * moves);
    normal.own.clone().cholesky().map(|factor| factor.solve(&right))
}

fn apply_own(nuisance: &mut Nuisance, moves: &DVector<f64>) {
    for (value, change) in nuisance.iter_mut().zip(moves.iter()) {
        *value += change;
    }
}

/// Squares of residuals and of nuisances.
fn squares(problem: &Problem, fit: &Fit, runs: &[usize], residuals: &[Vec<f64>]) -> f64 {
    let docking = problem.declared[0].is_finite();
    let of = |(&run, residual): (&usize, &Vec<f64>)| {
        let prior: f64 = if docking {
            let ratios = (0..problem.runs[run].nuisances).map(|j| fit.nuisances[run][j] / fit.scatter[j]);
            ratios.map(|ratio| ratio * ratio).sum()
        } else {
            0.0
        };
        dot(residual, residual) + prior
    };
    runs.iter().zip(residuals).map(of).sum()
}

/// `Σ ln det(C_s Σ)`, and what the scatter itself costs.
fn determinants(problem: &Problem, fit: &Fit, runs: &[usize], normals: &[Normal]) -> f64 {
    let docking = problem.declared[0].is_finite();
    let of = |(&run, normal): (&usize, &Normal)| {
        let factor = normal.own.clone().cholesky();
        let own: f64 = factor.map_or(0.0, |factor| factor.l().diagonal().iter().map(|d| 2.0 * libm::log(*d)).sum());
        let prior: f64 =
            if docking { (0..problem.runs[run].nuisances).map(|j| 2.0 * libm::log(fit.scatter[j])).sum() } else { 0.0 };
        own + prior
    };
    runs.iter().zip(normals).map(of).sum()
}

fn cost(problem: &Problem, fit: &Fit, runs: &[usize], residuals: &[Vec<f64>], normals: &[Normal]) -> f64 {
    let hyper: f64 = if problem.declared[0].is_finite() {
        let of = |(declared, found): (&f64, &f64)| {
            let ratio = (found / declared) * (found / declared);
            PRIOR_RUNS * (1.0 / ratio + libm::log(ratio) - 1.0)
        };
        problem.declared.iter().zip(&fit.scatter).map(of).sum()
    } else {
        0.0
    };
    squares(problem, fit, runs, residuals) + determinants(problem, fit, runs, normals) + hyper
}

/// The scatter that the runs show, with the declared one as a prior.
fn estimated_scatter(problem: &Problem, fit: &Fit, runs: &[usize], normals: &[Normal]) -> Scatter {
    let mut scatter = fit.scatter;
    if !problem.declared[0].is_finite() {
        return scatter;
    }
    for (j, sd) in scatter.iter_mut().enumerate() {
        let (mut sum, mut count) = (PRIOR_RUNS * problem.declared[j] * problem.declared[j], PRIOR_RUNS);
        for (&run, normal) in runs.iter().zip(normals) {
            if j < problem.runs[run].nuisances {
                let covariance = normal.own.clone().cholesky().map_or(0.0, |factor| factor.inverse()[(j, j)]);
                sum += fit.nuisances[run][j] * fit.nuisances[run][j] + covariance;
                count += 1.0;
            }
        }
        *sd = libm::sqrt(sum / count);
    }
    scatter
}

/// The trace that an effect of a given size would leave, once base values, effects and nuisances have taken what they can.
#[derive(Debug, Clone, Copy)]
pub struct Signature {
    /// Squared size of that trace, in multiples of the noise.
    pub information: f64,
    /// Its product with the residuals.
    pub gradient: f64,
}

/// The signature of an effect on top of a fit.
pub fn signature(
    problem: &Problem,
    fit: &Fit,
    runs: &[usize],
    chosen: &crate::model::Chosen,
    scratch: &mut Scratch,
) -> Signature {
    let mut with = fit.trial.clone();
    with.effects.push(chosen.clone());
    let residuals = all_residuals(problem, fit, runs, scratch);
    let p = fit.knobs.len();
    let (mut matrix, mut gradient) = (DMatrix::zeros(p + 1, p + 1), DVector::zeros(p + 1));
    for (&run, here) in runs.iter().zip(&residuals) {
        let mut shared = shared_columns(problem, fit, run, here, scratch);
        let own = problem.nuisance_columns(run, &fit.trial, &fit.nuisances[run], &shared, scratch);
        let there = problem.residuals(run, &with, &fit.nuisances[run], scratch);
        shared.push(there.iter().zip(here).map(|(there, here)| there - here).collect());
        let normal = normal(problem, fit, run, here, &shared, &own);
        let (part, slope) = eliminated(&normal);
        matrix += part;
        gradient += slope;
    }
    let knobs = matrix.view((0, 0), (p, p)).clone_owned();
    let mixed = matrix.view((0, p), (p, 1)).clone_owned();
    let Some(factor) = knobs.cholesky() else {
        return Signature { information: matrix[(p, p)], gradient: gradient[p] };
    };
    let solved = factor.solve(&mixed);
    let information = matrix[(p, p)] - mixed.dot(&solved);
    let gradient = gradient[p] - solved.dot(&gradient.rows(0, p).clone_owned());
    Signature { information, gradient }
}
