//! Oracles of stability: O1, O2, O3, O5, O13 and O14. Each number with its source and the tolerance that its source allows.

use nalgebra::{Complex, DMatrix};
use sim_core::stability::budget::{Contributor, Path, Stiffness, budget, integrator_delay_s};
use sim_core::stability::exact::{critical_delay, damping_interval, longest_delay};
use sim_core::stability::impact::{OneSided, Pull};
use sim_core::stability::pade::{critical_delay_pade, root_locus};
use sim_core::stability::sampled::{Arrival, Integrator, Issue, SampledLoop, SecondOrder, Seen, Sensing};
use sim_core::stability::spectral::{Delayed, DelayedForce, DelayedSystem};
use sim_core::stability::windows::ScalarLoop;

// O1 -----------------------------------------------------------------------------------------------------------------

/// `reference/PHYSICS.md`, section 1.5: mass kg, stiffness N/m, damping N s/m, critical delay ms, half a unit of its last digit.
const CRITICAL_DELAYS: [(f64, f64, f64, f64, f64); 18] = [
    (60.0, 1000.0, 50.0, 49.309, 5e-4),
    (15.0, 1000.0, 50.0, 47.27, 5e-3),
    (30.0, 1000.0, 50.0, 48.62, 5e-3),
    (120.0, 1000.0, 50.0, 49.65, 5e-3),
    (1000.0, 1000.0, 50.0, 49.96, 5e-3),
    (60.0, 250.0, 50.0, 189.1, 5e-2),
    (60.0, 500.0, 50.0, 97.2, 5e-2),
    (60.0, 2000.0, 50.0, 24.8, 5e-2),
    (60.0, 5000.0, 50.0, 9.97, 5e-3),
    (60.0, 20000.0, 50.0, 2.50, 5e-3),
    (60.0, 1000.0, 10.0, 9.99, 5e-3),
    (60.0, 1000.0, 25.0, 24.9, 5e-2),
    (60.0, 1000.0, 100.0, 94.5, 5e-2),
    (60.0, 1000.0, 200.0, 159.3, 5e-2),
    (60.0, 1000.0, 400.0, 174.1, 5e-2),
    (60.0, 1000.0, 800.0, 110.3, 5e-2),
    (15.6, 1000.0, 50.0, 47.375, 5e-4),
    (15.6, 3000.0, 50.0, 16.372, 5e-4),
];

/// The docking axis as a general system with a delay.
fn docking_axis(mass: f64, stiffness: f64, damping: f64, delay_s: f64) -> DelayedSystem {
    let one = |value: f64| DMatrix::from_element(1, 1, value);
    let force = DelayedForce::spring_dashpot(delay_s, one(stiffness), one(damping));
    DelayedSystem::mechanical(&one(mass), &[force]).unwrap()
}

#[test]
fn o1_the_critical_delay_is_the_one_of_the_table() {
    for (mass, stiffness, damping, delay_ms, digit_ms) in CRITICAL_DELAYS {
        let found = critical_delay(mass, stiffness, damping).unwrap();
        assert!((found.delay_s * 1e3 - delay_ms).abs() <= digit_ms, "{mass} {stiffness} {damping}: {found:?}");
        // The closed form balances m s² + (b s + k) e^{-hs} on the axis, to the rounding of its largest term.
        let (w, h) = (found.frequency_rad_per_s, found.delay_s);
        let (sin, cos) = (libm::sin(w * h), libm::cos(w * h));
        let real = -mass * w * w + stiffness * cos + damping * w * sin;
        let imaginary = damping * w * cos - stiffness * sin;
        assert!(real.abs().max(imaginary.abs()) < 1e-14 * mass * w * w, "{real} {imaginary}");
    }
    assert_eq!(critical_delay(60.0, 1000.0, 0.0), None, "without damping any delay destabilises");
}

/// The root finder shares nothing with the closed form: rightmost characteristic roots, and bisection over the delay.
#[test]
fn o1_the_root_finder_agrees_with_the_closed_form() {
    for (mass, stiffness, damping, ..) in CRITICAL_DELAYS {
        let edge = critical_delay(mass, stiffness, damping).unwrap();
        let (mut stable_s, mut unstable_s) = (0.5 * edge.delay_s, 2.0 * edge.delay_s);
        for _ in 0..40 {
            let middle = 0.5 * (stable_s + unstable_s);
            let spectrum = docking_axis(mass, stiffness, damping, middle).rightmost(1).unwrap();
            if spectrum.stable() { stable_s = middle } else { unstable_s = middle }
        }
        assert!((stable_s - edge.delay_s).abs() < 1e-6 * edge.delay_s, "{stable_s} {edge:?}");
        let at_edge = docking_axis(mass, stiffness, damping, stable_s).rightmost(1).unwrap().roots[0];
        assert!((at_edge.frequency_rad_per_s - edge.frequency_rad_per_s).abs() < 1e-6 * edge.frequency_rad_per_s);
    }
}

/// `reference/PHYSICS.md`, section 1.5: b_lo and b_hi at 16 and 32 ms, and the longest delay that can be stabilised.
#[test]
fn o1_the_damping_that_stabilises_is_the_interval_of_the_table() {
    for (mass, stiffness, at_16_ms, at_32_ms, longest_ms) in [
        (63.2, 1066.0, (17.081, 6198.0), (34.312, 3088.0), 180.5),
        (60.0, 1000.0, (16.023, 5884.0), (32.185, 2932.0), 181.6),
        (15.6, 3000.0, (48.825, 1511.0), (103.75, 719.0), 53.5),
        (15.6, 1000.0, (16.089, 1525.0), (32.745, 752.0), 92.6),
    ] {
        for (delay_s, (low, high)) in [(0.016, at_16_ms), (0.032, at_32_ms)] {
            let found = damping_interval(mass, stiffness, delay_s).unwrap().unwrap();
            // Half a unit of the last digit: three decimals below 100, two above; none for the upper edge.
            let digit = if low < 100.0 { 5e-4 } else { 5e-3 };
            assert!((found.low_n_s_per_m - low).abs() <= digit, "{mass} {stiffness} {delay_s}: {found:?}");
            assert!((found.high_n_s_per_m - high).abs() <= 0.5, "{mass} {stiffness} {delay_s}: {found:?}");
        }
        let longest = longest_delay(mass, stiffness).unwrap();
        assert!((longest.delay_s * 1e3 - longest_ms).abs() <= 0.05, "{longest:?}");
        assert!((longest.delay_s / (mass / stiffness).sqrt() - 0.7415).abs() <= 5e-5);
        assert!((longest.damping_n_s_per_m / (mass * stiffness).sqrt() - 1.2788).abs() <= 5e-5);
        let phase = longest.delay_s * longest.frequency_rad_per_s;
        assert!((phase - 1.07687).abs() < 5e-6 && (phase * libm::tan(phase) - 2.0).abs() < 1e-12);
    }
}

/// `reference/PHYSICS.md`, correction 9: two loops that are not the docking loop, and one that regains its stability.
#[test]
fn o1_other_loops_have_their_windows() {
    let first = ScalarLoop::new(&[1.0, 1.0], &[3.0]).unwrap().windows(2.0).unwrap();
    assert_eq!(first.len(), 1, "{first:?}");
    assert!((first[0].until_s - 0.6755).abs() <= 5e-5, "{first:?}");
    let second = ScalarLoop::new(&[1.0, 0.1, 1.0], &[0.4]).unwrap().windows(8.0).unwrap();
    assert_eq!(second.len(), 2, "{second:?}");
    assert!(second[0].from_s == 0.0 && (second[0].until_s - 0.2537).abs() <= 5e-5, "{second:?}");
    assert!((second[1].from_s - 3.778).abs() <= 5e-4 && (second[1].until_s - 5.598).abs() <= 5e-4, "{second:?}");
    // The characteristic roots say the same on both sides of every edge.
    let matrix = |values: [f64; 4]| DMatrix::from_row_slice(2, 2, &values);
    for (delay_s, stable) in [(0.25, true), (0.26, false), (3.77, false), (3.79, true), (5.59, true), (5.61, false)] {
        let late = Delayed { delay_s, on_state: matrix([0.0, 0.0, -0.4, 0.0]), on_rate: matrix([0.0, 0.0, 0.0, 0.0]) };
        let system = DelayedSystem::new(matrix([0.0, 1.0, -1.0, -0.1]), vec![late]).unwrap();
        assert_eq!(system.rightmost(2).unwrap().stable(), stable, "{delay_s}");
    }
}

// O2 -----------------------------------------------------------------------------------------------------------------

/// `reference/PHYSICS.md`, section 1.4: by how many per cent Padé's first approximation is optimistic.
#[test]
fn o2_pade_is_optimistic_by_the_per_cent_of_the_table() {
    for (mass, stiffness, damping, per_cent, digit) in [
        (60.0, 1000.0, 20.0, 0.06, 5e-3),
        (60.0, 1000.0, 50.0, 0.35, 5e-3),
        (60.0, 1000.0, 100.0, 1.4, 5e-2),
        (60.0, 1000.0, 200.0, 5.2, 5e-2),
        (60.0, 1000.0, 313.0, 10.9, 5e-2),
        (60.0, 1000.0, 1000.0, 24.7, 5e-2),
        (15.6, 3000.0, 50.0, 0.44, 5e-3),
        (63.2, 1066.0, 40.0, 0.20, 5e-3),
    ] {
        let exact = critical_delay(mass, stiffness, damping).unwrap();
        let pade = critical_delay_pade(mass, stiffness, damping).unwrap();
        let found = 100.0 * (pade.delay_s / exact.delay_s - 1.0);
        assert!((found - per_cent).abs() <= digit, "{mass} {stiffness} {damping}: {found} %");
        // Routh's condition on the polynomial is a quadratic in the delay: its smaller root, by the school formula.
        let (square, linear) = (0.25 * damping * stiffness, -(mass * stiffness + 0.5 * damping * damping));
        let root = (-linear - (linear * linear - 4.0 * square * mass * damping).sqrt()) / (2.0 * square);
        assert!((root - pade.delay_s).abs() < 1e-9 * root, "{root} {pade:?}");
        let locus = root_locus(mass, stiffness, damping, &[pade.delay_s]).unwrap();
        assert!(locus[0].roots[0].re.abs() < 1e-9 * exact.frequency_rad_per_s, "{locus:?}");
    }
}

// O3 -----------------------------------------------------------------------------------------------------------------

/// The delay equation, stepped: 200 steps in a delay, 60 periods; growth from amplitudes 40 periods apart.
#[test]
fn o3_the_delay_equation_neither_grows_nor_decays_at_the_edge() {
    for (mass, stiffness, damping) in [(60.0, 1000.0, 50.0), (15.6, 3000.0, 50.0), (60.0, 1000.0, 400.0)] {
        let edge = critical_delay(mass, stiffness, damping).unwrap();
        let period_s = 2.0 * std::f64::consts::PI / edge.frequency_rad_per_s;
        for (delay_share, sign) in [(0.98, -1.0), (1.0, 0.0), (1.02, 1.0)] {
            let delay_s = delay_share * edge.delay_s;
            let axis = Axis1 { mass, stiffness, damping, delay_s };
            let amplitude = axis.amplitudes(200, &[20.0 * period_s, 60.0 * period_s], edge.frequency_rad_per_s);
            let growth_per_s = libm::log(amplitude[1] / amplitude[0]) / (40.0 * period_s);
            if sign == 0.0 {
                // The bound that the source states, and 1e-6 is some 2e-7 of the frequency.
                assert!(growth_per_s.abs() < 1e-6, "{axis:?}: {growth_per_s}");
            } else {
                assert!(growth_per_s * sign > 1e-4, "{axis:?}: {growth_per_s}");
                let root = docking_axis(mass, stiffness, damping, delay_s).rightmost(1).unwrap().roots[0];
                assert!((growth_per_s - root.growth_per_s).abs() < 1e-2 * root.growth_per_s.abs(), "{root:?}");
            }
        }
    }
}

/// A docking axis as plain as it can be: nothing of it is from the parts that it checks.
#[derive(Debug)]
struct Axis1 {
    mass: f64,
    stiffness: f64,
    damping: f64,
    delay_s: f64,
}

impl Axis1 {
    /// Amplitudes `√(x² + (v/ω)²)` at these times. The force of one delay ago is a known function of time, so that a step is
    /// Simpson's rule on it, with Hermite's cubic in the middle: fourth order.
    fn amplitudes(&self, steps_per_delay: usize, times_s: &[f64], omega: f64) -> Vec<f64> {
        let dt = self.delay_s / steps_per_delay as f64;
        // Force and its rate, one slot for each step of the last delay; before the start there was none.
        let mut ring = vec![(0.0, 0.0); steps_per_delay];
        let (mut x, mut v) = (self.damping, -self.stiffness);
        let (mut found, mut index) = (Vec::new(), 0);
        while found.len() < times_s.len() {
            if index as f64 * dt >= times_s[found.len()] {
                found.push((x * x + (v / omega) * (v / omega)).sqrt());
            }
            let slot = index % steps_per_delay;
            let (late, late_rate) = ring[slot];
            let acceleration = -late / self.mass;
            ring[slot] = (self.stiffness * x + self.damping * v, self.stiffness * v + self.damping * acceleration);
            let (next, next_rate) = ring[(slot + 1) % steps_per_delay];
            let middle = 0.5 * (late + next) + 0.125 * dt * (late_rate - next_rate);
            x += dt * v - dt * dt / (6.0 * self.mass) * (late + 2.0 * middle);
            v -= dt / (6.0 * self.mass) * (late + 4.0 * middle + next);
            index += 1;
        }
        found
    }
}

// O5 -----------------------------------------------------------------------------------------------------------------

/// `reference/PHYSICS.md`, section 2.2, and correction 4: mass 63.2 kg, 1066 N/m, 4 ms.
///
/// What the rows rest on, found by computing them all: the reading of a tick sees the pose before a jump of the same instant;
/// `x_{n+1} valid at t_{n+1}` leaves after that tick's reading; the rate is the backward difference of the measured pose, 16 ms
/// behind the achieved one; filter and robot follow the held command exactly; `interpolated` starts a line when a command
/// arrives; `32 ms before the force is used` is dead time, and the rate is that of the pose then achieved.
fn sampled_rows() -> Vec<(&'static str, SampledLoop, f64)> {
    let base = SampledLoop::facility(63.2, 1066.0, 0.0);
    let exact = SampledLoop { integrator: Integrator::ExactHold, ..base };
    let explicit = SampledLoop { integrator: Integrator::Explicit, ..base };
    let part = |natural_frequency_hz, damping_ratio| Some(SecondOrder { natural_frequency_hz, damping_ratio });
    let filtered = |from: SampledLoop, corner_hz| {
        let low_pass = part(corner_hz, std::f64::consts::FRAC_1_SQRT_2);
        SampledLoop { sensing: Sensing { low_pass, ..from.sensing }, ..from }
    };
    let averaged = |from: SampledLoop| SampledLoop {
        sensing: Sensing { averaged: 4, ..from.sensing },
        arrival: Arrival::LineFrom,
        ..from
    };
    let shared = |from: SampledLoop, share: f64| SampledLoop {
        hardware_stiffness_n_per_m: 1066.0 * (1.0 - share),
        virtual_stiffness_n_per_m: 1066.0 * share,
        ..from
    };
    let far = |from: SampledLoop| SampledLoop { dead_time_s: 0.032, readout_s: 0.0, ..from };
    let issued = |from: SampledLoop, issue| SampledLoop { issue, ..from };
    let robot = part(10.0, 0.5);
    vec![
        ("hardware, semi-implicit", base, 21.56),
        ("hardware, exact hold", exact, 23.74),
        ("hardware, explicit", explicit, 25.93),
        ("hardware, issued a tick early", issued(base, Issue::AsComputed), 17.21),
        ("hardware, issued a tick late", issued(base, Issue::OneTickLate), 25.93),
        ("hardware, mean of 4, line", averaged(base), 23.17),
        ("hardware, low pass 73 Hz", filtered(base, 73.0), 22.78),
        ("hardware, low pass 10 Hz", filtered(base, 10.0), 43.55),
        ("hardware, robot 10 Hz in addition", SampledLoop { robot, ..base }, 36.94),
        ("hardware, robot 10 Hz instead", SampledLoop { robot, dead_time_s: 0.0, ..base }, 19.34),
        ("hardware, damping on commanded rate", SampledLoop { damping_on: Seen::Commanded, ..base }, 21.30),
        ("half hardware, half virtual", shared(base, 0.5), 30.14),
        ("virtual, semi-implicit", shared(base, 1.0), 38.71),
        ("virtual, exact hold", shared(exact, 1.0), 40.90),
        ("virtual, a tick late", shared(issued(base, Issue::OneTickLate), 1.0), 43.10),
        ("hardware 32 ms, semi-implicit", far(base), 38.71),
        ("hardware 32 ms, exact, line", SampledLoop { arrival: Arrival::LineFrom, ..far(exact) }, 40.90),
        ("hardware 32 ms, exact, line, mean", averaged(far(exact)), 42.50),
        // DIFFERENCE: the source has 45.65. It advanced the filter in steps of 0.25 ms, each with the command at its end: an
        // eighth of a millisecond of lead, worth k/8 ms = 0.133 N s/m. With such steps a separate computation gives 45.651,
        // with ever finer ones 45.784, which is what the filter without steps gives here.
        ("hardware 32 ms, exact, line, mean, 73 Hz", filtered(averaged(far(exact)), 73.0), 45.65 + 1066.0 * 0.000_125),
        ("hardware, exact, command before the reading", issued(exact, Issue::BeforeReading), 19.38),
        ("virtual, exact, command before the reading", shared(issued(exact, Issue::BeforeReading), 1.0), 36.53),
    ]
}

#[test]
fn o5_the_sampled_loop_needs_the_damping_of_the_table() {
    for (name, sampled, expected) in sampled_rows() {
        let found = sampled.damping_interval().unwrap().unwrap().low_n_s_per_m;
        println!("{name:45} {found:7.3} {expected:7.3}");
        assert!((found - expected).abs() <= 0.05, "{name}: {found}, expected {expected}");
    }
}

/// The tick leaves the stiffness in hardware between 17 and 26: no choice of conventions reaches 40.
#[test]
fn o5_with_the_stiffness_in_hardware_the_damping_needed_stays_below_26() {
    for issue in [Issue::AsComputed, Issue::BeforeReading, Issue::WhenValid] {
        for integrator in [Integrator::SemiImplicit, Integrator::ExactHold, Integrator::Explicit] {
            let sampled = SampledLoop { issue, integrator, ..SampledLoop::facility(63.2, 1066.0, 0.0) };
            let found = sampled.damping_interval().unwrap().unwrap().low_n_s_per_m;
            assert!((17.0..26.0).contains(&found), "{issue:?} {integrator:?}: {found}");
        }
    }
}

/// `reference/PHYSICS.md`, section 2.2: the budget is good to 2 % against the sampled loop.
#[test]
fn o5_the_budget_predicts_the_sampled_loop() {
    let line = |name: &str, path, delay_s| Contributor { name: name.to_string(), path, delay_s };
    for (virtual_share, integrator, expected) in [
        (0.0, Integrator::SemiImplicit, 21.56),
        (0.0, Integrator::ExactHold, 23.74),
        (0.0, Integrator::Explicit, 25.93),
        (0.5, Integrator::SemiImplicit, 30.14),
        (1.0, Integrator::SemiImplicit, 38.71),
        (1.0, Integrator::ExactHold, 40.90),
    ] {
        let stiffness =
            Stiffness { hardware_n_per_m: 1066.0 * (1.0 - virtual_share), virtual_n_per_m: 1066.0 * virtual_share };
        let contributors = [
            line("dead time", Path::Both, 0.016),
            line("issue of the command", Path::Both, 0.004),
            line("read-out", Path::Virtual, 0.016),
            line("integrator", Path::Both, integrator_delay_s(integrator, 0.004)),
        ];
        let found = budget(63.2, stiffness, &contributors).unwrap().damping_n_s_per_m.unwrap();
        assert!((found / expected - 1.0).abs() < 0.02, "{virtual_share} {integrator:?}: {found}, expected {expected}");
    }
}

// O13 ----------------------------------------------------------------------------------------------------------------

/// e^z.
fn turned(z: Complex<f64>) -> Complex<f64> {
    Complex::new(libm::cos(z.im), libm::sin(z.im)) * libm::exp(z.re)
}

/// A tool between sensor and contact is felt as inertia, late: `m s² + (m_t s² + b s + k) e^{-hs} = 0`.
#[test]
fn o13_a_tool_as_heavy_as_the_simulated_mass_is_unstable() {
    let one = |value: f64| DMatrix::from_element(1, 1, value);
    let spectrum = |tool_kg: f64, stiffness: f64, damping: f64| {
        let force =
            DelayedForce { delay_s: 0.016, stiffness: one(stiffness), damping: one(damping), inertia: one(tool_kg) };
        DelayedSystem::mechanical(&one(15.6), &[force]).unwrap().rightmost(4).unwrap()
    };
    for (stiffness, damping) in [(3000.0, 60.0), (3000.0, 200.0), (0.0, 0.0)] {
        for tool_kg in [15.6, 16.0, 30.0] {
            let found = spectrum(tool_kg, stiffness, damping);
            // By reasoning: the chain of roots tends to Re s = ln(m_t/m)/h.
            assert!((found.neutral_radius - tool_kg / 15.6).abs() < 1e-12);
            assert!(!found.stable(), "{tool_kg} kg at {stiffness} N/m: {found:?}");
        }
    }
    // Below it the roots decide. In free flight what is left is the root at zero, and a chain that decays.
    for tool_kg in [1.0, 5.0, 12.0, 15.0] {
        let free = spectrum(tool_kg, 0.0, 0.0);
        assert!(free.stable() && free.root_at_zero, "{tool_kg} kg: {free:?}");
        let chain_per_s = libm::log(tool_kg / 15.6) / 0.016;
        for root in &free.roots {
            // s² (m + m_t e^{-hs}) = 0: the chain is exact there.
            assert!((root.growth_per_s - chain_per_s).abs() < 1e-6 * chain_per_s.abs(), "{root:?} {chain_per_s}");
        }
    }
    // In contact a light tool leaves a damped loop stable, and every root found is one.
    let light = spectrum(1.0, 3000.0, 100.0);
    assert!(light.stable(), "{light:?}");
    for root in &light.roots {
        let s = Complex::new(root.growth_per_s, root.frequency_rad_per_s);
        let late = (s * s + s * 100.0 + 3000.0) * turned(-s * 0.016);
        assert!((s * s * 15.6 + late).norm_sqr() < 1e-18 * (s * s * 15.6).norm_sqr(), "{root:?}");
    }
}

// O14 ----------------------------------------------------------------------------------------------------------------

#[test]
fn o14_delay_adds_energy_damping_takes_it_and_the_duration_hardly_moves() {
    let delays_s = [0.004, 0.008, 0.012, 0.016, 0.020, 0.024, 0.028, 0.032];
    let dampings = [0.0, 10.0, 20.0, 30.0, 40.0, 55.0, 70.0, 100.0];
    let undelayed_s = std::f64::consts::PI * (63.2_f64 / 1066.0).sqrt();
    for pull in [Pull::Never, Pull::Allowed] {
        let impact = |delay_s: f64, damping_n_s_per_m: f64| {
            let contact = OneSided { mass_kg: 63.2, stiffness_n_per_m: 1066.0, damping_n_s_per_m, delay_s, pull };
            contact.impact().unwrap()
        };
        for pair in delays_s.windows(2) {
            for damping in dampings {
                assert!(impact(pair[1], damping).restitution > impact(pair[0], damping).restitution, "{pair:?}");
            }
        }
        for delay_s in delays_s {
            for pair in dampings.windows(2) {
                assert!(impact(delay_s, pair[1]).restitution < impact(delay_s, pair[0]).restitution, "{pair:?}");
            }
            // Section 4.2: 0.76 to 0.78 s at this mass and stiffness for damping up to 70, against 0.765 s.
            for damping in [20.0, 40.0, 70.0] {
                let until_s = impact(delay_s, damping).until_zero_depth_s;
                assert!((until_s / undelayed_s - 1.0).abs() < 0.08, "{delay_s} {damping}: {until_s}");
            }
        }
    }
}

/// `reference/PHYSICS.md`, correction 1.
#[test]
fn o14_the_edge_of_an_impact_is_not_that_of_the_loop() {
    let contact = OneSided {
        mass_kg: 15.6,
        stiffness_n_per_m: 3000.0,
        damping_n_s_per_m: 0.0,
        delay_s: 0.016,
        pull: Pull::Never,
    };
    let one_sided = contact.unit_restitution_damping().unwrap().unwrap();
    let two_sided = damping_interval(15.6, 3000.0, 0.016).unwrap().unwrap().low_n_s_per_m;
    assert!((two_sided - 48.8).abs() <= 0.05, "{two_sided}");
    // DIFFERENCE: the source has 52.97. Pieces that are exact give 52.960; `stability.rs` finds the same with small steps.
    assert!((one_sided - 52.960).abs() < 5e-4, "{one_sided}");
    let may_pull = OneSided { pull: Pull::Allowed, ..contact }.unit_restitution_damping().unwrap().unwrap();
    assert!((may_pull / two_sided - 1.0).abs() < 2e-3, "{may_pull}");
}
