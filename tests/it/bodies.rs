//! Two bodies and the laws of an impact against solutions of another kind: Jacobi's functions, and a solver that is not ours
//! (`fixtures/published/scipy_cases.py`).
//!
//! No tolerance is a guess. A scheme of order p that gives `a` with a step and `b` with half of it is off by about
//! `|a - b| / (2^p - 1)` at the half step; what it may differ from the other solver is a quarter more than that, and the error
//! that the other solver states of itself. Where a force that never pulls has let go inside a tick, the bend costs up to an
//! eighth of (its rate × T²) of impulse, another part of it for every step: that is added, see [`Bend`].

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde_json::Value;
use sim_core::plant::Integrator;

mod axis;
mod free;
mod pair;

const ALL: [Integrator; 3] = [Integrator::SemiImplicit, Integrator::ExactHold, Integrator::RungeKutta4];

fn published(case: &str) -> Value {
    let text = std::fs::read_to_string(fixtures::folder().join("published/scipy_cases.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()[case].take()
}

fn number(case: &Value, name: &str) -> f64 {
    case[name].as_f64().unwrap_or_else(|| panic!("{name} is a number"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|entry| entry.as_f64().unwrap()).collect()
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_iterator(numbers(value))
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_row_slice(&numbers(value))
}

fn attitude(value: &Value) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix(value)))
}

/// What the end of a contact inside a tick may cost at the half step, in the units of what is compared.
///
/// A force that falls to zero with the rate s, held at its value in the middle of the tick, is off by at most `s T²/8` of
/// impulse. At both steps this is anything up to that, so the halving may be wrong by 5/3 of it, and the result by 8/3.
#[derive(Clone, Copy)]
struct Bend(f64);

/// Whether a scheme of this order, run with a step and with half of it, agrees with the other solver as well as it can.
fn check_order(about: &str, order: u32, runs: [&[f64]; 2], other: &[f64], other_error: f64, bend: Option<Bend>) {
    let [coarse, fine] = runs;
    assert_eq!((coarse.len(), fine.len()), (other.len(), other.len()), "{about}");
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let halving = apart(coarse, fine) / f64::from((1 << order) - 1);
    let found = apart(fine, other);
    let allowed = 1.25 * halving + other_error + bend.map_or(0.0, |bend| bend.0 * 8.0 / 3.0);
    assert!(found <= allowed, "{about}: off by {found:e}, step halving says {halving:e}, allowed {allowed:e}");
    // The order itself: or a scheme of first order could hide behind a coarse step.
    let ratio = apart(coarse, other) / found;
    let expected = f64::from(1 << order);
    let clean = bend.is_none() && found > 10.0 * other_error;
    assert!(!clean || (ratio / expected - 1.0).abs() < 0.25, "{about}: the error falls by {ratio}");
}
