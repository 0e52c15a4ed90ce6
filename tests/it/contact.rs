//! Contact in space as properties: no law creates energy, the gap has no steps, and its gradient is the normal.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use sim_core::contact::{ContactLaw, DepthLaw, Empirical, Friction, Hertz, HuntCrossley, Row, Sides, SpringDashpot};
use sim_core::effect::Context;
use sim_core::effects::standard;
use sim_core::geometry::{Cone, Geometry, Peg, Plane, Ring};
use sim_core::rng::Streams;
use sim_core::signals::Signals;
use sim_core::space::{Axis, AxisTouch, Motion, Path, Spatial, Touch, Wrench};
use sim_core::time::{Nanos, Step};

/// A geometry, the radius of what touches, and the middle and the half width of the places to try.
struct Place {
    geometry: Box<dyn Geometry<Spatial>>,
    radius_m: f64,
    middle_m: Vector3<f64>,
    width_m: Vector3<f64>,
    tilt_rad: f64,
}

fn places() -> [Place; 4] {
    let place = |geometry, radius_m, middle: [f64; 3], width: [f64; 3], tilt_rad| Place {
        geometry,
        radius_m,
        middle_m: Vector3::from(middle),
        width_m: Vector3::from(width),
        tilt_rad,
    };
    // Rim 0.2 m, throat 0.05 m, 30°: 0.26 m deep. Bore 0.05 m, peg 0.045 m, 0.2 m deep.
    let cone = Cone::new(0.2, 0.05, core::f64::consts::FRAC_PI_6, 0.02).unwrap();
    let peg = Peg::new(0.05, 0.2, 0.045, 0.5).unwrap();
    [
        place(Box::new(Plane), 0.0, [0.0; 3], [0.1; 3], 3.0),
        place(Box::new(cone), 0.02, [0.0, 0.0, 0.13], [0.25, 0.25, 0.2], 3.0),
        place(Box::new(Ring::new(0.1, 0.01, 0.02).unwrap()), 0.02, [0.0; 3], [0.15, 0.15, 0.05], 3.0),
        place(Box::new(peg), 0.045, [0.0, 0.0, 0.15], [0.03, 0.03, 0.25], 0.25),
    ]
}

/// Numbers in [-1, 1] that become a motion at a place.
fn motion(place: &Place, numbers: &[f64; 12]) -> Motion {
    let part = |i: usize| Vector3::new(numbers[i], numbers[i + 1], numbers[i + 2]);
    // A turn about the probe's own axis matters to nobody; the tilt is bounded by the place.
    let turn = Vector3::new(numbers[3], numbers[4], 0.0) * (place.tilt_rad / 2.0_f64.sqrt());
    Motion {
        position_m: place.middle_m + part(0).component_mul(&place.width_m),
        attitude: UnitQuaternion::from_scaled_axis(turn),
        velocity_m_per_s: part(6) * 0.05,
        rate_rad_per_s: part(9) * 0.3,
        ..Motion::default()
    }
}

fn numbers() -> impl Strategy<Value = [f64; 12]> {
    prop::array::uniform12(-1.0..1.0)
}

/// Whether a depth means anything at this place: deeper than the shaft's radius, its middle line is inside the wall.
fn meant(place: &Place, touch: &Touch) -> bool {
    place.radius_m <= 0.0 || touch.depth_m < 0.9 * place.radius_m
}

/// Steps that a derivative is taken over.
const STEP_M: f64 = 1e-6;
const STEP_S: f64 = 1e-5;

/// Closer than this to a circle, or to the axis, no derivative is taken: there the third derivative of a distance is below
/// `1 / CLEAR_M²` for each of the two, and a difference over a step is right to `step² / (3 CLEAR_M²)`.
const CLEAR_M: f64 = 5e-3;

/// The third derivative's share, and twice as much again for a shaft whose nearest point moves.
const SLOPE: f64 = STEP_M * STEP_M / (CLEAR_M * CLEAR_M);

fn clear(place: &Place, touch: &Touch) -> bool {
    // From the contact point back to what is nearest to the wall: the middle of the tip, or a point of the shaft.
    let middle_m = touch.point_m + touch.normal * place.radius_m;
    place.radius_m <= 0.0 || (place.radius_m - touch.depth_m).abs() > CLEAR_M && middle_m.xy().norm() > CLEAR_M
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, ..ProptestConfig::default() })]

    /// A distance changes by no more than the way: nothing jumps at a rim, a throat, a corner, or where another place is deeper.
    #[test]
    fn the_gap_has_no_steps(which in 0..4_usize, numbers in numbers(), way in -9.0..-1.0_f64, to in prop::array::uniform3(-1.0..1.0)) {
        let place = &places()[which];
        let here = motion(place, &numbers);
        let by = Vector3::from(to) * libm::pow(10.0, way);
        let there = Motion { position_m: here.position_m + by, ..here };
        let (a, b) = (place.geometry.touch(&here), place.geometry.touch(&there));
        prop_assume!(meant(place, &a) && meant(place, &b));
        // Lengths below a metre are rounded a few times.
        prop_assert!((a.depth_m - b.depth_m).abs() <= by.norm() + 1e-15, "{} m over {} m", a.depth_m - b.depth_m, by.norm());
    }

    #[test]
    fn the_normal_is_the_gradient_of_the_gap(which in 0..4_usize, numbers in numbers()) {
        let place = &places()[which];
        let here = motion(place, &numbers);
        let touch = place.geometry.touch(&here);
        prop_assume!(meant(place, &touch) && clear(place, &touch));
        prop_assert!((touch.normal.norm() - 1.0).abs() < 1e-12);
        for axis in 0..3 {
            let by = Vector3::ith(axis, STEP_M);
            let at = |by: Vector3<f64>| place.geometry.touch(&Motion { position_m: here.position_m + by, ..here });
            let (more, less) = (at(by), at(-by));
            // A smooth normal turns by less than 4 step / CLEAR_M = 8e-4; anything else is an edge between two places.
            prop_assume!((more.normal - less.normal).norm() < 1e-3);
            let slope = (more.depth_m - less.depth_m) / (2.0 * STEP_M);
            // Where a face becomes a circle the curvature jumps, and the difference is off by up to a quarter of how much the normal
            // bends there.
            let bend = (more.normal + less.normal - touch.normal * 2.0).norm();
            prop_assert!((slope + touch.normal[axis]).abs() < SLOPE + bend, "{slope} {}", touch.normal[axis]);
        }
    }

    /// Also while the probe turns: the contact point then moves with the arm.
    #[test]
    fn the_rate_is_the_derivative_of_the_depth(which in 0..4_usize, numbers in numbers()) {
        let place = &places()[which];
        let here = motion(place, &numbers);
        let touch = place.geometry.touch(&here);
        prop_assume!(meant(place, &touch) && clear(place, &touch));
        let (later, earlier) = (place.geometry.touch(&here.coasted(STEP_S)), place.geometry.touch(&here.coasted(-STEP_S)));
        prop_assume!((later.normal - earlier.normal).norm() < 1e-3);
        let slope = (later.depth_m - earlier.depth_m) / (2.0 * STEP_S);
        // In the time of a step a point of the probe moves by up to 0.4 m/s times it: the same error, over that way, times that speed.
        let tolerance = SLOPE * (0.4 * STEP_S / STEP_M) * (0.4 * STEP_S / STEP_M) * 0.4;
        let bend = (later.rate_m_per_s + earlier.rate_m_per_s - 2.0 * touch.rate_m_per_s).abs();
        prop_assert!((slope - touch.rate_m_per_s).abs() < tolerance + bend, "{slope} {touch:?}");
        let velocity = here.velocity_m_per_s + here.rate_rad_per_s.cross(&touch.arm_m);
        prop_assert!((velocity - touch.slip_m_per_s + touch.normal * touch.rate_m_per_s).norm() < 1e-15);
        prop_assert!(touch.slip_m_per_s.dot(&touch.normal).abs() < 1e-15);
        prop_assert!((touch.point_m - here.position_m - touch.arm_m).norm() < 1e-15);
    }

    /// What a law does beyond its spring only takes: `(f - f_spring) d' ≥ 0` at every depth and rate, and the spring depends on the
    /// depth alone. So no closed loop yields anything.
    #[test]
    fn no_law_creates_energy(which in 0..LAWS, depth_m in -0.01..0.02_f64, rate_m_per_s in -0.2..0.2_f64, sides in sides()) {
        let law = &laws(sides)[which];
        let touch = Touch { depth_m, rate_m_per_s, ..Touch::default() };
        let total = law.clamped(&touch, &law.force(&touch));
        let still = Touch { rate_m_per_s: 0.0, ..touch };
        let spring = law.clamped(&still, &law.force(&still));
        let pressing = |wrench: Wrench| wrench.force_n.dot(&touch.normal);
        prop_assert!((pressing(total) - pressing(spring)) * rate_m_per_s >= 0.0, "{total:?} {spring:?}");
        prop_assert!(sides == Sides::Two || depth_m > 0.0 || total == Wrench::default());
        prop_assert!(sides != Sides::One || pressing(total) >= 0.0);
    }
}

const LAWS: usize = 5;

fn sides() -> impl Strategy<Value = Sides> {
    prop::sample::select(vec![Sides::One, Sides::OnePulling, Sides::Two])
}

fn laws(sides: Sides) -> [Box<dyn ContactLaw<Spatial>>; LAWS] {
    let row = |amplitude_m, stiffness_n_per_m| Row { amplitude_m, stiffness_n_per_m };
    let table = [row(0.001, 800.0), row(0.003, 1000.0), row(0.009, 300.0)];
    [
        Box::new(SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 40.0, sides }),
        Box::new(Hertz::new(15e3, 1.5, 10.0, sides).unwrap()),
        Box::new(HuntCrossley::new(15e3, 1.3, 3.0, sides).unwrap().with_rate_exponent(1.2).unwrap()),
        Box::new(Empirical::new(&table, 10.0, sides).unwrap()),
        Box::new(
            Friction::new(SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 40.0, sides }, 0.2, 0.001)
                .unwrap(),
        ),
    ]
}

/// A closed way through a contact: the probe swings about `middle_m` in all six axes.
fn swing(middle_m: Vector3<f64>, size_m: f64, tilt_rad: f64, phase_rad: f64) -> Motion {
    let wave = |order: f64, shift: f64| libm::sin(order * phase_rad + shift);
    Motion {
        position_m: middle_m + Vector3::new(wave(1.0, 0.3), wave(2.0, 1.1), wave(1.0, 2.0)) * size_m,
        attitude: UnitQuaternion::from_scaled_axis(
            Vector3::new(wave(1.0, 0.7), wave(2.0, 0.2), wave(1.0, 1.9)) * tilt_rad,
        ),
        ..Motion::default()
    }
}

/// What a probe felt on a closed way.
#[derive(Debug, Default)]
struct Felt {
    /// Energy that the contact took.
    taken_j: f64,
    /// The most that it held on the way.
    held_j: f64,
    /// Largest force.
    peak_n: f64,
    /// Longest step of the point of contact.
    step_m: f64,
}

fn felt(geometry: &dyn Geometry<Spatial>, law: &dyn ContactLaw<Spatial>, middle_m: Vector3<f64>, steps: u32) -> Felt {
    let mut felt = Felt::default();
    let step_s = 2.0 / f64::from(steps);
    let at = |i: u32| swing(middle_m, 0.01, 0.1, core::f64::consts::TAU * f64::from(i) / f64::from(steps));
    for i in 0..steps {
        let between = Motion::on(&Motion::line(&at(i), &at(i + 1), step_s), 0.5);
        let touch = geometry.touch(&between);
        let wrench = law.clamped(&touch, &law.force(&touch));
        let power_w = wrench.force_n.dot(&between.velocity_m_per_s) + wrench.torque_n_m.dot(&between.rate_rad_per_s);
        felt.taken_j -= power_w * step_s;
        felt.held_j = felt.held_j.max(felt.taken_j);
        felt.peak_n = felt.peak_n.max(wrench.force_n.norm());
        felt.step_m = felt.step_m.max((touch.slip_m_per_s - touch.normal * touch.rate_m_per_s).norm() * step_s);
    }
    felt
}

/// Wrench, twist, normal and arm together: springs give back on every closed way through every geometry, with turning, and
/// whatever damps takes something.
#[test]
fn a_closed_way_through_a_contact_gives_nothing() {
    let spring = SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 0.0, sides: Sides::One };
    let damped = SpringDashpot { damping_n_s_per_m: 40.0, ..spring };
    let rough = Friction::new(spring, 0.2, 0.001).unwrap();
    let bent = Hertz::agreeing(1066.0, 0.005, 1.5).unwrap();
    let hunt = HuntCrossley::new(15e3, 1.5, 3.0, Sides::One).unwrap();
    let middles = [[0.0; 3], [0.12, 0.03, 0.1], [0.07, 0.06, -0.02], [0.005, 0.002, 0.1]];
    for (place, middle) in places().iter().zip(middles) {
        let felt =
            |law: &dyn ContactLaw<Spatial>, steps| felt(place.geometry.as_ref(), law, Vector3::from(middle), steps);
        for law in [&spring as &dyn ContactLaw<Spatial>, &bent] {
            let fine = felt(law, 200_000);
            assert!(fine.held_j > 1e-4, "it is a contact: {fine:?}");
            // The sum is right to the square of the step, (2 · 2π / 200 000)² = 4e-9 of the energy held, but where the normal jumps
            // from one place to another: there one step may miss the force times its way. A way has a dozen such edges at most.
            let edges_j = if place.tilt_rad < 1.0 { 12.0 * fine.peak_n * fine.step_m } else { 0.0 };
            assert!(edges_j < 0.02 * fine.held_j, "the test can see something: {fine:?}");
            assert!(fine.taken_j.abs() < 1e-7 * fine.held_j + edges_j, "{fine:?}");
        }
        for law in [&damped as &dyn ContactLaw<Spatial>, &rough, &hunt] {
            let fine = felt(law, 8_000);
            assert!(fine.taken_j > 0.03 * fine.held_j, "it takes something: {fine:?}");
        }
    }
}

/// Along an axis and in space it is one law.
#[test]
fn a_law_is_the_same_along_the_axis_and_in_space() {
    let law = HuntCrossley::new(15e3, 1.3, 3.0, Sides::One).unwrap();
    for (depth_m, rate_m_per_s) in [(0.004, 0.03), (0.004, -0.03), (0.004, -3.0), (-0.001, 0.03)] {
        let along = AxisTouch { depth_m, rate_m_per_s };
        let (axis, space): (&dyn ContactLaw<Axis>, &dyn ContactLaw<Spatial>) = (&law, &law);
        let force_n = axis.clamped(&along, &law.resistance(&along));
        let touch = Touch { depth_m, rate_m_per_s, ..Touch::default() };
        let wrench = space.clamped(&touch, &space.force(&touch));
        assert_eq!(wrench, Wrench { force_n: Vector3::new(0.0, 0.0, -1.0) * force_n, ..Wrench::default() });
    }
}

/// The force of a spring with an effect of the catalogue on it.
fn with_effect(id: &str, value: f64, touch: &AxisTouch, spring: &SpringDashpot) -> f64 {
    let built = (standard().get(id).unwrap().build)(&[value]);
    let context = Context {
        step: Step { index: 0, now: Nanos(0), dt: Nanos(1_000_000) },
        memory: &mut [],
        random: &mut Streams::new(1).named(id),
    };
    let mut force = spring.resistance(touch);
    built.contact(context, &Signals { touch: *touch, ..Signals::default() }, &mut force);
    force.total()
}

/// What a diagnosis calls an effect on a linear spring is a law of its own: the same force from both.
#[test]
fn the_laws_say_what_the_effects_of_the_same_name_say() {
    let spring = SpringDashpot { stiffness_n_per_m: 1066.0, damping_n_s_per_m: 0.0, sides: Sides::One };
    let power = Hertz::agreeing(1066.0, 0.005, 1.4).unwrap();
    let hunt = HuntCrossley::new(1066.0, 1.0, 2.0, Sides::One).unwrap();
    for depth_m in [0.0005, 0.005, 0.02] {
        for rate_m_per_s in [-0.03, 0.0, 0.04] {
            let touch = AxisTouch { depth_m, rate_m_per_s };
            let same = |law: &dyn DepthLaw, effect_n: f64| {
                let law_n = law.resistance(&touch).total();
                // Two powers, each to an ulp or two, and the scale between them.
                assert!((law_n - effect_n).abs() <= 16.0 * f64::EPSILON * law_n.abs(), "{law_n} {effect_n}");
            };
            same(&power, with_effect("stiffness-power-law", 1.4, &touch, &spring));
            same(&hunt, with_effect("hunt-crossley", 1.5 * 2.0 * 1066.0, &touch, &spring));
        }
    }
}
