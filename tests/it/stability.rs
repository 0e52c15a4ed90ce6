//! Prediction against observation: what `sim_core::stability` says of random loops, and what plain simulations of them do.
//!
//! The simulations share nothing with what they check: a ring of delayed forces, stepped, written here. In a step the force of
//! one delay ago is a known function of time, so that Simpson's rule with Hermite's cubic in the middle is a step of fourth
//! order.
//!
//! The dead band of an observed growth is what is not yet known of it: by how much it changes when the step is halved, plus by
//! how much the last quarter of the time differs from the quarter before. Outside that band the sign has to be the predicted one
//! in every single case.

use nalgebra::Matrix2;
use proptest::prelude::*;
use proptest::test_runner::{Config, FileFailurePersistence, RngSeed, TestCaseError, TestRunner};
use sim_core::stability::exact::{assess, damping_interval};
use sim_core::stability::impact::{OneSided, Pull};
use sim_core::stability::planar::{PlanarBody, PlanarContact};
use std::cell::RefCell;

/// Seed of every random case of this file.
const SEED: u64 = 20_140_307;

/// A contact whose rate has fallen from 1 to this is at rest: below it is the rounding of bodies that drift on at a rate of 1.
const STILL: f64 = 1e-12;

fn runner(cases: u32) -> TestRunner {
    let regressions = concat!(env!("CARGO_MANIFEST_DIR"), "/proptest-regressions/stability.txt");
    TestRunner::new(Config {
        cases,
        rng_seed: RngSeed::Fixed(SEED),
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(regressions))),
        ..Config::default()
    })
}

/// Bodies with `D` coordinates, a contact with `N`, and the force of one delay ago between them.
#[derive(Debug, Clone)]
struct Plain<const D: usize, const N: usize> {
    /// Inverse mass or inertia of each coordinate.
    mobility: [f64; D],
    /// Contact coordinates from those of the bodies.
    jacobian: [[f64; D]; N],
    stiffness: [[f64; N]; N],
    damping: [[f64; N]; N],
    delay_s: f64,
}

/// Positions and rates of the bodies at the start.
type Start<const D: usize> = ([f64; D], [f64; D]);

fn times<const R: usize, const C: usize>(matrix: &[[f64; C]; R], vector: &[f64; C]) -> [f64; R] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

impl<const D: usize, const N: usize> Plain<D, N> {
    fn acceleration(&self, force: &[f64; N]) -> [f64; D] {
        std::array::from_fn(|i| -self.mobility[i] * (0..N).map(|j| self.jacobian[j][i] * force[j]).sum::<f64>())
    }

    /// Largest rate of the contact in each quarter of the time, from these positions and rates; shorter if it leaves all bounds.
    fn quarters(&self, steps_per_delay: usize, horizon_s: f64, start: &Start<D>) -> Vec<f64> {
        let dt = self.delay_s / steps_per_delay as f64;
        let steps = (horizon_s / dt) as usize;
        let mut ring = vec![([0.0; N], [0.0; N]); steps_per_delay];
        let (mut q, mut v) = *start;
        let mut largest = vec![0.0_f64];
        let mut slot = 0;
        for index in 0..steps {
            let (late, late_rate) = ring[slot];
            let (y, rate) = (times(&self.jacobian, &q), times(&self.jacobian, &v));
            let change = times(&self.jacobian, &self.acceleration(&late));
            let (kx, bv) = (times(&self.stiffness, &y), times(&self.damping, &rate));
            let (kv, ba) = (times(&self.stiffness, &rate), times(&self.damping, &change));
            ring[slot] = (std::array::from_fn(|i| kx[i] + bv[i]), std::array::from_fn(|i| kv[i] + ba[i]));
            let size: f64 = rate.iter().map(|rate| rate * rate).sum();
            if 4 * index >= largest.len() * steps {
                largest.push(0.0);
            }
            let quarter = largest.len() - 1;
            largest[quarter] = largest[quarter].max(size.sqrt());
            if largest[quarter] > 1e200 || (quarter > 0 && largest[quarter] < STILL) {
                break;
            }
            slot = if slot + 1 == steps_per_delay { 0 } else { slot + 1 };
            let (next, next_rate) = ring[slot];
            let middle =
                std::array::from_fn(|i| 0.5 * (late[i] + next[i]) + 0.125 * dt * (late_rate[i] - next_rate[i]));
            let (a, b, c) = (self.acceleration(&late), self.acceleration(&middle), self.acceleration(&next));
            for i in 0..D {
                q[i] += dt * v[i] + dt * dt / 6.0 * (a[i] + 2.0 * b[i]);
                v[i] += dt / 6.0 * (a[i] + 4.0 * b[i] + c[i]);
            }
        }
        largest
    }

    /// Sign of the growth: 1, -1, or 0 inside the dead band. The larger of the growths from two starts counts, since one may
    /// miss a mode. What is undecided is observed four times as long, three times over.
    fn observed(&self, coarse: usize, horizon_s: f64, starts: &[Start<D>]) -> i8 {
        let longer = [1.0, 4.0, 16.0].map(|times| times * horizon_s);
        let signs = longer.into_iter().map(|horizon_s| {
            starts.iter().map(|start| self.observed_from(coarse, horizon_s, start)).max().unwrap_or(0)
        });
        let mut signs = signs.skip_while(|&sign| sign == 0);
        signs.next().unwrap_or(0)
    }

    fn observed_from(&self, coarse: usize, horizon_s: f64, start: &Start<D>) -> i8 {
        // Growth in the last quarter, and by how much the quarter before differs.
        let growth = |steps: usize| -> (f64, f64) {
            let quarters = self.quarters(steps, horizon_s, start);
            let [_, second, third, fourth] = quarters[..] else {
                let out = if quarters[quarters.len() - 1] > 1.0 { f64::INFINITY } else { f64::NEG_INFINITY };
                return (out, 0.0);
            };
            let rate = |from: f64, to: f64| libm::log(to / from) / (0.25 * horizon_s);
            (rate(third, fourth), (rate(third, fourth) - rate(second, third)).abs())
        };
        let (fine, unsettled) = growth(2 * coarse);
        if fine.is_infinite() {
            return if fine > 0.0 { 1 } else { -1 };
        }
        let band = (fine - growth(coarse).0).abs() + unsettled;
        i8::from(fine > band) - i8::from(fine < -band)
    }
}

/// Predicted (stable, unstable) against observed (decays, dead band, grows).
#[derive(Debug, Default, Clone, Copy)]
struct Confusion([[u32; 3]; 2]);

impl Confusion {
    fn count(table: &RefCell<Confusion>, stable: bool, observed: i8) -> bool {
        table.borrow_mut().0[usize::from(!stable)][(observed + 1) as usize] += 1;
        observed == 0 || (observed < 0) == stable
    }

    fn print(&self, what: &str) {
        println!("{what:24}  decays  dead band  grows");
        for (name, row) in ["predicted stable", "predicted unstable"].iter().zip(self.0) {
            println!("{name:24} {:7} {:10} {:6}", row[0], row[1], row[2]);
        }
    }

    /// A test that puts too much into its dead band, or all cases on one side, would prove nothing.
    fn is_telling(&self) {
        let [[decays, a, _], [_, b, grows]] = self.0;
        let all: u32 = self.0.iter().flatten().sum();
        assert!(10 * (a + b) < all, "{self:?}: a tenth of the cases is undecided");
        assert!(5 * decays > all && 5 * grows > all, "{self:?}: nearly all cases are on one side");
    }
}

#[test]
fn the_predicted_sign_of_growth_is_observed_along_one_axis() {
    // Decades of mass, stiffness and h √(k/m), and damping as a multiple of k h (the lower edge) or of m/h (the upper one).
    let loops = (0.0..3.0_f64, 2.0..5.0_f64, -1.5..0.0_f64, prop::bool::ANY, -1.0..1.0_f64);
    let table = RefCell::new(Confusion::default());
    let done = runner(10_000).run(&loops, |(mass, stiffness, scaled, upper, damping)| {
        let [mass, stiffness, scaled, damping] = [mass, stiffness, scaled, damping].map(libm::exp10);
        let omega = (stiffness / mass).sqrt();
        let delay_s = scaled / omega;
        let damping = damping * if upper { mass / delay_s } else { stiffness * delay_s };
        let plain = Plain::<1, 1> {
            mobility: [1.0 / mass],
            jacobian: [[1.0]],
            stiffness: [[stiffness]],
            damping: [[damping]],
            delay_s,
        };
        // Twelve steps for the faster of: a radian of the spring, a delay as seen by the damper.
        let coarse = (12.0 * scaled.max(damping * delay_s / mass)).ceil() as usize;
        let observed = plain.observed(coarse.max(2), 50.0 / omega, &[([1.0], [0.0]), ([0.0], [1.0])]);
        let stable = assess(mass, stiffness, damping, delay_s).unwrap().stable;
        if Confusion::count(&table, stable, observed) {
            return Ok(());
        }
        Err(TestCaseError::fail(format!("{plain:?}: predicted stable {stable}, observed {observed}")))
    });
    table.borrow().print("10,000 loops, one axis");
    assert!(done.is_ok(), "{done:?}");
    table.borrow().is_telling();
}

/// Two bodies in the plane, with levers, and a contact that is stiff along n and t and couples them.
#[derive(Debug, Clone)]
struct Plane {
    masses: [f64; 2],
    inertias: [f64; 2],
    normal_levers: [f64; 2],
    tangential_levers: [f64; 2],
    stiffness: [f64; 3],
    damping: [f64; 3],
    scaled_delay: f64,
}

fn planes() -> impl Strategy<Value = Plane> {
    let pair = |from: f64, to: f64| prop::array::uniform2(from..to);
    let shape = || (0.3..1.0_f64, -0.4..0.4_f64);
    let log = -1.3..0.0_f64;
    (pair(20.0, 200.0), pair(2.0, 40.0), pair(-0.4, 0.4), pair(-0.6, 0.6), shape(), shape(), log, -0.7..0.9_f64)
        .prop_map(|(masses, inertias, normal_levers, tangential_levers, spring, damper, scaled, damping)| {
            let symmetric = |size: f64, (ratio, coupling): (f64, f64)| {
                // A coupling below the geometric mean keeps the matrix positive.
                [size, size * ratio, size * ratio.sqrt() * coupling]
            };
            let stiffness = symmetric(1000.0, spring);
            // Per unit of k h, as along one axis; the delay follows from the loop's frequency.
            let damping = symmetric(1000.0 * libm::exp10(damping), damper);
            let scaled_delay = libm::exp10(scaled);
            Plane { masses, inertias, normal_levers, tangential_levers, stiffness, damping, scaled_delay }
        })
}

impl Plane {
    fn contact(&self, delay_s: f64) -> PlanarContact {
        let body = |i: usize| PlanarBody {
            mass_kg: self.masses[i],
            inertia_kg_m2: self.inertias[i],
            normal_lever_m: self.normal_levers[i],
            tangential_lever_m: self.tangential_levers[i],
        };
        let matrix = |[n, t, c]: [f64; 3]| Matrix2::new(n, c, c, t);
        PlanarContact {
            chaser: body(0),
            target: body(1),
            stiffness_n_per_m: matrix(self.stiffness),
            damping_n_s_per_m: matrix(self.damping) * delay_s,
        }
    }

    /// Coordinates n, t and angle of each body; the contact point moves by v + ω × r.
    fn plain(&self) -> Plain<6, 2> {
        let mobility =
            std::array::from_fn(|i| if i % 3 == 2 { 1.0 / self.inertias[i / 3] } else { 1.0 / self.masses[i / 3] });
        let (d, a) = (self.normal_levers, self.tangential_levers);
        let jacobian = [[1.0, 0.0, -d[0], -1.0, 0.0, d[1]], [0.0, 1.0, a[0], 0.0, -1.0, -a[1]]];
        let matrix = |[n, t, c]: [f64; 3]| [[n, c], [c, t]];
        // The stiffest way through: no frequency of the undelayed loop is above the root of this sum.
        let light: f64 =
            (0..6).map(|i| mobility[i] * (jacobian[0][i] * jacobian[0][i] + jacobian[1][i] * jacobian[1][i])).sum();
        let omega = (light * self.stiffness[0]).sqrt();
        let delay_s = self.scaled_delay / omega;
        let damping = matrix(self.damping.map(|value| value * delay_s));
        Plain { mobility, jacobian, stiffness: matrix(self.stiffness), damping, delay_s }
    }
}

#[test]
fn the_predicted_sign_of_growth_is_observed_in_the_plane() {
    let table = RefCell::new(Confusion::default());
    let done = runner(1_000).run(&planes(), |plane| {
        let plain = plane.plain();
        let damped = plane.damping[0] / plane.stiffness[0] * plane.scaled_delay;
        let coarse = (12.0 * plane.scaled_delay * damped.max(1.0)).ceil() as usize;
        let axis = |i: usize| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
        let starts = [(axis(0), [0.0; 6]), ([0.0; 6], axis(1))];
        let observed = plain.observed(coarse.max(2), 120.0 * plain.delay_s / plane.scaled_delay, &starts);
        let system = plane.contact(plain.delay_s).system(plain.delay_s).unwrap();
        let stable = system.rightmost(1).unwrap().stable();
        if Confusion::count(&table, stable, observed) {
            return Ok(());
        }
        let root = system.rightmost(3).unwrap();
        Err(TestCaseError::fail(format!("{plane:?}: predicted stable {stable} ({root:?}), observed {observed}")))
    });
    table.borrow().print("1,000 loops in the plane");
    assert!(done.is_ok(), "{done:?}");
    table.borrow().is_telling();
}

/// Damping in proportion falls apart into two loops along one axis; the roots of the coupled loop agree at the smaller edge.
#[test]
fn in_the_plane_damping_in_proportion_decouples() {
    let done = runner(200).run(&(planes(), -2.0..-0.3_f64), |(plane, proportion)| {
        let proportion_s = libm::exp10(proportion);
        let base = plane.contact(0.0);
        let contact = PlanarContact { damping_n_s_per_m: base.stiffness_n_per_m * proportion_s, ..base };
        let edge = contact.proportional(proportion_s).unwrap().first().unwrap();
        for (share, stable) in [(0.99, true), (1.01, false)] {
            let spectrum = contact.system(share * edge.delay_s).unwrap().rightmost(1).unwrap();
            prop_assert_eq!(spectrum.stable(), stable, "{:?} at {} of {:?}", spectrum, share, edge);
        }
        let root = contact.system(edge.delay_s).unwrap().rightmost(1).unwrap().roots[0];
        prop_assert!(root.growth_per_s.abs() < 1e-9 * edge.frequency_rad_per_s, "{:?} {:?}", root, edge);
        Ok(())
    });
    assert!(done.is_ok(), "{done:?}");
}

/// Restitution of a contact on one side, stepped: the force is a ring of this many steps, and trapezia.
fn stepped_restitution(contact: &OneSided, steps: usize) -> f64 {
    let dt = contact.delay_s / steps as f64;
    let mut ring = vec![0.0; steps];
    let (mut x, mut v, mut index, mut quiet) = (0.0, 1.0, 0, 0);
    while quiet <= steps || x > 0.0 || v > 0.0 {
        let slot = index % steps;
        let late = ring[slot];
        let law = contact.stiffness_n_per_m * x + contact.damping_n_s_per_m * v;
        let pushes = x > 0.0 && (law > 0.0 || contact.pull == Pull::Allowed);
        ring[slot] = if pushes { law } else { 0.0 };
        quiet = if pushes || index == 0 { 0 } else { quiet + 1 };
        let next = ring[(slot + 1) % steps];
        x += dt * v - dt * dt / (6.0 * contact.mass_kg) * (2.0 * late + next);
        v -= dt / (2.0 * contact.mass_kg) * (late + next);
        index += 1;
    }
    -v
}

/// On both sides of the computed damping of e = 1, by one per cent, the stepped impact gains and loses.
#[test]
fn the_computed_edge_of_an_impact_is_observed() {
    let contacts = (0.0..3.0_f64, 2.0..5.0_f64, -1.5..-0.31_f64, prop::bool::ANY);
    let table = RefCell::new(Confusion::default());
    let done = runner(300).run(&contacts, |(mass, stiffness, scaled, pulls)| {
        let [mass_kg, stiffness_n_per_m, scaled] = [mass, stiffness, scaled].map(libm::exp10);
        let delay_s = scaled * (mass_kg / stiffness_n_per_m).sqrt();
        let pull = if pulls { Pull::Allowed } else { Pull::Never };
        let at = |damping_n_s_per_m: f64| OneSided { mass_kg, stiffness_n_per_m, damping_n_s_per_m, delay_s, pull };
        let edge = at(0.0).unit_restitution_damping().unwrap();
        let Some(edge) = edge else { return Err(TestCaseError::fail(format!("{:?} has no edge", at(0.0)))) };
        for (share, loses) in [(0.99, false), (1.01, true)] {
            let contact = at(share * edge);
            let (coarse, fine) = (stepped_restitution(&contact, 200), stepped_restitution(&contact, 400));
            // The place of onset and release inside a step is open: a force of at most b v for a step too long or too
            // short, twice, of the momentum m v.
            let place = 2.0 * contact.damping_n_s_per_m * contact.delay_s / 400.0 / mass_kg;
            let band = (fine - coarse).abs() + place;
            let observed = if fine - 1.0 > band {
                1
            } else if fine - 1.0 < -band {
                -1
            } else {
                0
            };
            if !Confusion::count(&table, loses, observed) {
                return Err(TestCaseError::fail(format!("{contact:?}: {fine} ± {band}")));
            }
            // The number itself, not only its side.
            let computed = contact.impact().unwrap().restitution;
            prop_assert!(
                (computed - fine).abs() <= 4.0 * band + 1e-6,
                "{:?}: {} {} ± {}",
                contact,
                computed,
                fine,
                band
            );
        }
        Ok(())
    });
    table.borrow().print("600 one-sided impacts");
    assert!(done.is_ok(), "{done:?}");
    table.borrow().is_telling();
}

/// `reference/PHYSICS.md`, correction 1, from the computed impact and from the stepped one; and the 52.960 of `oracles.rs`.
#[test]
fn the_edge_of_an_impact_is_above_that_of_the_loop_by_the_table() {
    let stepped_edge = |contact: &OneSided, near: f64, steps: usize| {
        let (mut gains, mut loses) = (0.9 * near, 1.1 * near);
        for _ in 0..40 {
            let middle = 0.5 * (gains + loses);
            let tried = OneSided { damping_n_s_per_m: middle, ..*contact };
            if stepped_restitution(&tried, steps) > 1.0 { gains = middle } else { loses = middle }
        }
        gains
    };
    println!("H       computed  stepped  of b_lo");
    for (scaled, factor, digit) in
        [(0.066, 1.022, 5e-4), (0.13, 1.046, 5e-4), (0.4, 1.20, 5e-3), (0.5, 1.33, 5e-3), (0.221_88, 1.0847, 5e-5)]
    {
        // The last row is the planar case, 15.6 kg, 3000 N/m, 16 ms: 52.960 over 48.825.
        let contact = OneSided {
            mass_kg: 1.0,
            stiffness_n_per_m: 1.0,
            damping_n_s_per_m: 0.0,
            delay_s: scaled,
            pull: Pull::Never,
        };
        let low = damping_interval(1.0, 1.0, scaled).unwrap().unwrap().low_n_s_per_m;
        let computed = contact.unit_restitution_damping().unwrap().unwrap() / low;
        let [coarse, fine] = [800, 1600].map(|steps| stepped_edge(&contact, computed * low, steps) / low);
        println!("{scaled:.3}   {computed:.5}   {fine:.5}");
        assert!((computed - factor).abs() <= digit, "{scaled}: {computed}");
        // First order in the step: what remains is as large as the last change, and the place of release at most doubles it.
        assert!((computed - fine).abs() <= 2.0 * (fine - coarse).abs(), "{scaled}: {computed} {fine} {coarse}");
    }
}
