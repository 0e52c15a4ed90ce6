//! A contact in software: the impulse in the delay ring makes the exit velocity of second order in the step.

use super::bench::{MASS_KG, SPEED_M_PER_S, STIFFNESS_N_PER_M, computed_exit_m_per_s};
use sim_core::compensator::{Release, Software};
use sim_core::time::Nanos;

fn contact(release: Release) -> Software {
    Software { stiffness_n_per_m: STIFFNESS_N_PER_M, damping_n_s_per_m: 40.0, dead_time_s: 0.016, release }
}

/// Relative error of the exit velocity at 4, 2, 1 and 0.5 ms, against a step of 1/64 ms, whose own error is a thousandth of
/// that at 0.5 ms if the order is two.
fn errors(release: Release, gap_m: f64) -> [f64; 4] {
    let exit = |step: Nanos| computed_exit_m_per_s(MASS_KG, contact(release), gap_m, SPEED_M_PER_S, step, 2.0);
    let reference = exit(Nanos(15_625));
    [4_000_000, 2_000_000, 1_000_000, 500_000].map(|step| (exit(Nanos(step)) / reference - 1.0).abs())
}

#[test]
fn the_exit_velocity_is_of_second_order_in_the_step() {
    // Contact begins at a tick of every step, or a third into a tick of 4 ms: then one or two thirds into any other.
    let (on_grid, off_grid) = (72.0 * 0.004, (72.0 + 1.0 / 3.0) * 0.004);
    println!("relative error of the exit velocity at 4, 2, 1, 0.5 ms; order over all");
    for release in [Release::ZeroDepth, Release::ZeroForce] {
        for (name, onset_s) in [("on the grid", on_grid), ("off the grid", off_grid)] {
            let errors = errors(release, onset_s * SPEED_M_PER_S);
            let order = libm::log2(errors[0] / errors[3]) / 3.0;
            let [four, two, one, half] = errors;
            println!("{release:?}, {name}: {four:.2e} {two:.2e} {one:.2e} {half:.2e}; {order:.2}");
            assert!(order >= 1.9, "{release:?} {name}: {errors:?} {order}");
        }
    }
}

#[test]
fn a_dead_time_that_is_no_number_of_ticks_is_refused() {
    let contact = contact(Release::ZeroDepth);
    assert!(contact.check(0.004).is_ok() && contact.check(0.005).is_err() && contact.check(0.032).is_err());
    let negative = Software { dead_time_s: -0.016, ..contact };
    assert!(negative.check(0.004).unwrap_err().to_string().contains("dead_time_s = -0.016 s"));
}
