//! The table of `reference/PHYSICS.md`, section 7: restitution with each compensation, ideal and with what is believed wrong.
//!
//! The source prints three digits and does not say at which phase of a tick its contacts begin. So a cell agrees if the printed
//! number, give or take half a digit, lies between the least and the greatest restitution over eight phases.

use super::bench::{BELIEVED_S, Device, STIFFNESS_N_PER_M, compensated, restitution};
use sim_core::compensator::delay_compensation::{
    EnergyTank, Extrapolation, IdentifiedResponse, Order, Passivity, PhaseLead, ResponseError, Side, SmithLead,
    SmithPredictor, Uncompensated, VirtualDamping,
};
use sim_core::compensator::{Compensation, DelayCompensation};

/// What a compensation believes of delay and stiffness.
#[derive(Clone, Copy)]
struct Belief {
    delay_s: f64,
    stiffness_n_per_m: f64,
}

struct Row {
    name: &'static str,
    method: fn(Belief) -> Compensation,
    /// Ideal, b = 20, τ - 8 ms, τ + 8 ms, 0.7 k, 1.3 k, stiffening; NaN where the source prints nothing.
    source: [f64; 7],
    /// What comes out here, where that is not the source's number: each with a `DIFFERENCE:` beside it.
    here: Option<[f64; 7]>,
}

fn columns() -> [(Device, Belief); 7] {
    let right = Belief { delay_s: BELIEVED_S, stiffness_n_per_m: STIFFNESS_N_PER_M };
    let spring = Device::SPRING;
    [
        (spring, right),
        (Device { damping_n_s_per_m: 20.0, ..spring }, right),
        (spring, Belief { delay_s: BELIEVED_S - 0.008, ..right }),
        (spring, Belief { delay_s: BELIEVED_S + 0.008, ..right }),
        (spring, Belief { stiffness_n_per_m: 0.7 * STIFFNESS_N_PER_M, ..right }),
        (spring, Belief { stiffness_n_per_m: 1.3 * STIFFNESS_N_PER_M, ..right }),
        // DIFFERENCE: the source calls this column 'x2 tangent at 10 mm'. Its numbers come out with a force that is doubled at 10 mm
        // (a tangent of four times); a tangent of twice gives 1.323 instead of 1.398 without compensation.
        (Device { stiffening_m: 0.010, ..spring }, right),
    ]
}

fn same(number: f64, damped: f64, stiffening: f64) -> [f64; 7] {
    [number, damped, number, number, number, number, stiffening]
}

fn rows() -> Vec<Row> {
    let agrees = |name, method, source| Row { name, method, source, here: None };
    vec![
        agrees("none", |_| Compensation::None(Uncompensated), same(1.276, 1.133, 1.398)),
        Row {
            name: "virtual damping",
            method: |Belief { delay_s, stiffness_n_per_m }| {
                Compensation::VirtualDamping(VirtualDamping { stiffness_n_per_m, delay_s })
            },
            source: [1.005, 0.891, 1.059, 0.953, 1.079, 0.935, 1.114],
            // DIFFERENCE: 0.005 to 0.01 above the source in every column. The source does not say while what the damping acts; here it
            // acts while the sensor feels contact. Three ticks more of it at either end of the contact would give the
            // source's numbers (1.005, 0.891, 1.060, 0.953, 1.080, 0.935, 1.115).
            here: Some([1.012, 0.898, 1.065, 0.961, 1.085, 0.944, 1.122]),
        },
        agrees(
            "phase lead",
            |Belief { delay_s, .. }| Compensation::PhaseLead(PhaseLead { delay_s }),
            [1.015, 0.898, 1.068, 0.964, 1.015, 1.015, 1.022],
        ),
        agrees(
            "Smith predictor",
            |Belief { delay_s, stiffness_n_per_m }| {
                Compensation::SmithPredictor(SmithPredictor { stiffness_n_per_m, delay_s })
            },
            [1.013, 0.898, 1.066, 0.963, 1.086, 0.945, 1.122],
        ),
        Row {
            name: "Smith and lead",
            method: |Belief { delay_s, .. }| Compensation::SmithLead(SmithLead { delay_s }),
            source: [1.023, 0.908, 1.078, 0.969, 1.023, 1.023, 1.031],
            // DIFFERENCE: 0.01 below the source. It does not say how it discretises the filter; the exact step response of
            // the lag, taken at the end of the tick, is within 0.005 of it, by chance of 2 ms less of lead.
            here: Some([1.013, 0.8965, 1.067, 0.9615, 1.013, 1.013, 1.0175]),
        },
        agrees(
            "extrapolation, velocity",
            |Belief { delay_s, .. }| Compensation::Extrapolation(Extrapolation { order: Order::Velocity, delay_s }),
            [1.015, 0.897, 1.068, 0.964, 1.015, 1.015, 1.021],
        ),
        agrees(
            "extrapolation, cubic",
            |Belief { delay_s, .. }| Compensation::Extrapolation(Extrapolation { order: Order::Cubic, delay_s }),
            [1.012, 0.897, f64::NAN, f64::NAN, 1.012, 1.012, 1.015],
        ),
        agrees(
            "passivity, force side",
            |_| Compensation::Passivity(Passivity { side: Side::Force }),
            same(1.015, 1.011, 1.023),
        ),
        agrees("energy tank", |_| Compensation::EnergyTank(EnergyTank { initial_j: 0.0 }), same(1.015, 1.011, 1.023)),
        Row {
            name: "response error, late",
            method: |Belief { stiffness_n_per_m, .. }| {
                Compensation::ResponseError(ResponseError { stiffness_n_per_m, forward_s: 0.0 })
            },
            source: [0.915, 0.810, 0.915, 0.915, 1.012, 0.827, 1.018],
            // DIFFERENCE: 1.0114 at 0.7 k, where the source rounds to 1.012. The other six agree.
            here: Some([0.915, 0.810, 0.915, 0.915, 1.0114, 0.827, 1.018]),
        },
        agrees(
            "response error, forward",
            |Belief { stiffness_n_per_m, .. }| {
                Compensation::ResponseError(ResponseError { stiffness_n_per_m, forward_s: 0.016 })
            },
            [1.012, 0.898, 1.012, 1.012, 1.085, 0.944, 1.121],
        ),
        Row {
            name: "identified response",
            method: |_| {
                Compensation::IdentifiedResponse(IdentifiedResponse {
                    initial_stiffness_n_per_m: 0.0,
                    forgetting: 0.98,
                    forward_s: 0.016,
                })
            },
            source: same(1.035, 0.923, 1.033),
            // DIFFERENCE: 0.008 to 0.01 below the source, and 0.03 above where the spring stiffens. It does not say what it
            // estimates nor with which start and forgetting; of some ten thousand combinations none gives its three numbers.
            here: Some(same(1.028, 0.913, 1.0665)),
        },
    ]
}

/// Least and greatest restitution over the phases of a tick.
fn range(device: Device, method: Compensation) -> (f64, f64) {
    method.check(0.004).unwrap();
    let all = (0..8).map(|eighth| restitution(&compensated(device, method), f64::from(eighth) / 8.0));
    all.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), e| (least.min(e), most.max(e)))
}

#[test]
fn the_table_of_compensations_comes_out() {
    let mut wrong = Vec::new();
    println!("restitution (least of eight phases; + its spread in 1e-4); what it should be");
    for row in rows() {
        let mut line = format!("{:24}", row.name);
        for (column, (device, belief)) in columns().into_iter().enumerate() {
            let (least, most) = range(device, (row.method)(belief));
            let (source, expected) = (row.source[column], row.here.unwrap_or(row.source)[column]);
            line += &format!(" {least:.4}+{:<2.0} {source:.3} |", (most - least) * 1e4);
            if !expected.is_nan() && !(least - 5e-4..=most + 5e-4).contains(&expected) {
                wrong.push(format!("{} column {column}: {least:.4} to {most:.4}, expected {expected}", row.name));
            }
        }
        println!("{line}");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
