//! Single effects against closed forms, step by step and outside the loop.
#![expect(clippy::disallowed_methods, reason = "the oracle is another implementation than libm")]

use super::{attached, rates};
use sim_core::effect::{Attached, Context};
use sim_core::rng::{Stream, Streams};
use sim_core::signals::{ContactForce, Received, Signals};
use sim_core::space::{Axis, AxisMotion, AxisTouch};
use sim_core::time::{Nanos, Step};

/// The physics step, in s.
const DT_S: f64 = 5e-4;

/// An effect with its memory, called step by step.
struct Bench {
    attached: Attached<Axis>,
    memory: Vec<f64>,
    random: Stream,
    index: u64,
}

impl Bench {
    fn new(id: &str, values: &[f64]) -> Self {
        let attached = attached(id, values);
        let mut memory = vec![0.0; attached.effect.memory(&rates())];
        attached.effect.begin(&mut memory, &rates(), &Signals::default());
        Bench { attached, memory, random: Streams::new(11).named(id), index: 0 }
    }

    /// Calls `act` with the context of the next step.
    fn step(&mut self, act: impl FnOnce(&Attached<Axis>, Context<'_>)) {
        let dt = rates().physics_step;
        let step = Step { index: self.index, now: Nanos(self.index as i64 * dt.0), dt };
        self.index += 1;
        act(&self.attached, Context { step, memory: &mut self.memory, random: &mut self.random });
    }

    fn sensed(&mut self, mut out: f64) -> f64 {
        self.step(|attached, context| attached.effect.sensed(context, &Signals::default(), &mut out));
        out
    }

    fn achieved(&mut self, mut out: AxisMotion) -> AxisMotion {
        self.step(|attached, context| attached.effect.achieved(context, &Signals::default(), &mut out));
        out
    }

    fn measured(&mut self, mut out: AxisMotion) -> AxisMotion {
        self.step(|attached, context| attached.effect.measured(context, &Signals::default(), &mut out));
        out
    }

    fn contact(&mut self, depth_m: f64) -> f64 {
        self.added(AxisTouch { depth_m, rate_m_per_s: 0.0 }, 0.0)
    }

    /// What it makes of an elastic force at this penetration.
    fn added(&mut self, touch: AxisTouch, elastic: f64) -> f64 {
        let mut out = ContactForce::<Axis> { elastic, dissipative: 0.0 };
        let seen = Signals { touch, ..Signals::default() };
        self.step(|attached, context| attached.effect.contact(context, &seen, &mut out));
        out.total()
    }
}

/// Response at `t` after an input that rises from 0 to 1 within the first step, from the response to the ramp u = t.
fn rising(ramp: impl Fn(f64) -> f64, t: f64) -> f64 {
    (ramp(t) - ramp(t - DT_S)) / DT_S
}

/// Rounding: each step errs by some ulps of the lag in steps, and errors live for about as many steps; the closed form itself is
/// a difference of numbers up to t, divided by a step.
fn rounding(lag_s: f64, t: f64) -> f64 {
    let steps = lag_s / DT_S + 1.0;
    16.0 * f64::EPSILON * (steps * steps + t / DT_S)
}

#[test]
fn force_lag_follows_its_step_response() {
    for (corner_hz, poles) in [(15.0, 1.0), (15.0, 2.0), (40.0, 1.0), (40.0, 2.0), (500.0, 1.0), (500.0, 2.0)] {
        let tau = 1.0 / (2.0 * std::f64::consts::PI * corner_hz);
        let ramp = |t: f64| {
            let left = (-t / tau).exp();
            if poles > 1.5 { t - 2.0 * tau + (t + 2.0 * tau) * left } else { t - tau + tau * left }
        };
        let mut bench = Bench::new("force-lag", &[corner_hz, poles]);
        assert_eq!(bench.sensed(0.0).to_bits(), 0.0_f64.to_bits());
        for i in 1..400 {
            let t = f64::from(i) * DT_S;
            let (is, should) = (bench.sensed(1.0), rising(ramp, t));
            let limit = rounding(poles * tau, t);
            assert!((is - should).abs() <= limit, "{corner_hz} Hz, {poles} poles, {t} s: {is}, not {should}");
        }
    }
}

/// Response of the robot to the ramp u = t, and its rate: the free motion of the deviation 2ζ/ω with rate -1, by its roots.
fn robot_ramp(natural: f64, ratio: f64, t: f64) -> (f64, f64) {
    let (lag, decay) = (2.0 * ratio / natural, ratio * natural);
    let q = 1.0 - ratio * ratio;
    let own = natural * q.abs().sqrt();
    let (deviation, rate) = if q.abs() < 1e-12 {
        let drive = natural * lag - 1.0;
        let left = (-natural * t).exp();
        ((lag + drive * t) * left, (drive - natural * (lag + drive * t)) * left)
    } else if q > 0.0 {
        let (sine, b) = ((own * t).sin_cos(), (decay * lag - 1.0) / own);
        let left = (-decay * t).exp();
        let deviation = left * (lag * sine.1 + b * sine.0);
        (deviation, -decay * deviation + left * own * (b * sine.1 - lag * sine.0))
    } else {
        let (slow, fast) = (own - decay, -own - decay);
        let a = (-1.0 - lag * fast) / (slow - fast);
        let (a, b) = (a * (slow * t).exp(), (lag - a) * (fast * t).exp());
        (a + b, a * slow + b * fast)
    };
    (t - lag + deviation, 1.0 + rate)
}

#[test]
fn robot_second_order_follows_its_step_response() {
    for (natural_hz, ratio) in [(5.0, 0.3), (10.0, 0.7), (20.0, 1.0), (10.0, 1.5), (15.0, 0.05)] {
        let natural = 2.0 * std::f64::consts::PI * natural_hz;
        let mut bench = Bench::new("robot-second-order", &[natural_hz, ratio]);
        bench.achieved(AxisMotion::default());
        for i in 1..800 {
            let t = f64::from(i) * DT_S;
            let is = bench.achieved(AxisMotion { position_m: 1.0, pitch_rad: -2.0, ..AxisMotion::default() });
            let position_m = rising(|t| robot_ramp(natural, ratio, t).0, t);
            let velocity = rising(|t| robot_ramp(natural, ratio, t).1, t);
            let acceleration = natural * natural * (1.0 - is.position_m) - 2.0 * ratio * natural * is.velocity_m_per_s;
            // What dies slowest lives for 1/(ζ ω), or for 2ζ/ω if it creeps.
            let limit = rounding((1.0 / ratio).max(2.0 * ratio) / natural, t);
            let at = format!("{natural_hz} Hz, ratio {ratio}, {t} s");
            assert!((is.position_m - position_m).abs() <= limit, "{at}: {} m, not {position_m}", is.position_m);
            assert!((is.velocity_m_per_s - velocity).abs() <= natural * limit, "{at}: {}", is.velocity_m_per_s);
            assert!((is.acceleration_m_per_s2 - acceleration).abs() <= natural * natural * limit, "{at}");
            assert!((is.pitch_rad + 2.0 * is.position_m).abs() <= 2.0 * limit, "{at}: the pitch follows alike");
        }
    }
}

#[test]
fn robot_second_order_begins_in_its_steady_state() {
    let (natural, ratio) = (20.0 * std::f64::consts::PI, 0.3);
    let mut bench = Bench::new("robot-second-order", &[10.0, ratio]);
    for i in 0..2000 {
        let input = AxisMotion::moving(-0.02, 0.035);
        let is = bench.achieved(AxisMotion { position_m: -0.02 + 0.035 * f64::from(i) * DT_S, ..input });
        let should = -0.02 + 0.035 * f64::from(i) * DT_S - 2.0 * ratio / natural * 0.035;
        let limit = 0.05 * rounding(1.0 / (ratio * natural), 1.0);
        assert!((is.position_m - should).abs() <= limit, "step {i}: {} m, not {should}", is.position_m);
        assert!((is.velocity_m_per_s - 0.035).abs() <= natural * limit, "step {i}: {}", is.velocity_m_per_s);
        assert!(is.acceleration_m_per_s2.abs() <= natural * natural * limit, "step {i}");
    }
}

#[test]
fn delay_lines_are_exact() {
    let input = |i: i64| (0.1 * i as f64).sin();
    for whole in [0_i64, 1, 6, 40] {
        let mut bench = Bench::new("force-delay", &[whole as f64 * DT_S]);
        for i in 0..200 {
            let should = input((i - whole).max(0));
            assert_eq!(bench.sensed(input(i)).to_bits(), should.to_bits(), "{whole} steps, step {i}");
        }
    }
    // Between two steps, a straight line stays one.
    let mut bench = Bench::new("force-delay", &[2.25 * DT_S]);
    for i in 0..200 {
        let (is, should) = (bench.sensed(f64::from(i)), f64::from(i) - 2.25);
        assert!(i < 3 || (is - should).abs() <= 4.0 * f64::EPSILON * 200.0, "step {i}: {is}, not {should}");
    }
}

/// A whole number of steps more in the read-back is the same as this effect, to the last bit.
#[test]
fn measurement_delay_is_a_slower_read_back() {
    use super::{ALL, SensorNoise, cell, impact};
    use sim_core::closed_loop::Clamps;
    let mut slower = cell();
    slower.readout.delay_s = 0.0185;
    let slower = impact(&slower, &[], SensorNoise::NONE, &Clamps::default());
    let effect = [attached("measurement-delay", &[0.0025])];
    let late = impact(&cell(), &effect, SensorNoise::NONE, &Clamps::default());
    assert!(ALL.measured && slower.measured_steps.len() == 4000);
    let both = slower.measured_steps.iter().zip(&late.measured_steps);
    // The first five steps come from before the run, where both coast, in one piece or in two.
    for (i, (a, b)) in both.enumerate().skip(5) {
        assert_eq!(a.position_m.to_bits(), b.position_m.to_bits(), "step {i}: {} m, {} m", a.position_m, b.position_m);
    }
}

#[test]
fn command_loss_loses_its_share_in_runs_of_its_length() {
    let (p, q, ticks) = (0.02, 0.3, 200_000);
    let mut bench = Bench::new("command-loss", &[p, q]);
    let (mut lost, mut runs, mut before, mut last) = (0.0, 0.0, false, 0.0);
    for i in 0..ticks {
        let sent = f64::from(i);
        let mut out = Received::<Axis> { motion: AxisMotion::moving(sent, 1.0), ..Received::default() };
        bench.step(|attached, context| attached.effect.received(context, &Signals::default(), &mut out));
        last = if out.lost { last } else { sent };
        assert_eq!(out.motion.position_m.to_bits(), f64::to_bits(last), "the last packet that arrived counts");
        lost += f64::from(u8::from(out.lost));
        runs += f64::from(u8::from(out.lost && !before));
        before = out.lost;
    }
    let share = p / (p + q);
    // A two-state chain forgets by 1 - p - q each tick, which widens the binomial spread by (2 - p - q) / (p + q).
    let spread = (share * (1.0 - share) * (2.0 - p - q) / (p + q) / f64::from(ticks)).sqrt();
    assert!((lost / f64::from(ticks) - share).abs() <= 4.0 * spread, "{lost} of {ticks} lost, expected {share}");
    // A run is geometric: its length has mean 1/q and variance (1 - q) / q².
    let spread = ((1.0 - q) / (q * q) / runs).sqrt();
    assert!((lost / runs - 1.0 / q).abs() <= 4.0 * spread, "runs of {} on average", lost / runs);
}

#[test]
fn hysteresis_depends_on_the_path_only() {
    let (mut fine, mut coarse) = (Bench::new("hysteresis", &[1.0, 5e-4]), Bench::new("hysteresis", &[1.0, 5e-4]));
    for i in 1..30 {
        fine.contact(f64::from(i) * 1e-4);
    }
    let deepest = (fine.contact(3e-3), coarse.contact(3e-3));
    for i in 1..10 {
        fine.contact(3e-3 - f64::from(i) * 1e-4);
    }
    let back = (fine.contact(2e-3), coarse.contact(2e-3));
    // 3 mm in is 6 lengths, 1 mm back is 2.
    let way_in = 1.0 - (-6.0_f64).exp();
    let way_back = -1.0 + (way_in + 1.0) * (-2.0_f64).exp();
    // 40 steps, each of which rounds its travel by one ulp of 3 mm, in units of 0.5 mm.
    let limit = 40.0 * f64::EPSILON * 6.0 * 2.0;
    for (is, should) in [(deepest.0, way_in), (deepest.1, way_in), (back.0, way_back), (back.1, way_back)] {
        assert!((is - should).abs() <= limit, "{is}, not {should}");
    }
    assert_eq!(fine.contact(-1e-4).to_bits(), 0.0_f64.to_bits(), "released");
}

#[test]
fn maxwell_branch_follows_a_ramp() {
    let (stiffness, tau, speed) = (300.0, 0.05, 0.035);
    let mut bench = Bench::new("maxwell-branch", &[stiffness, tau]);
    for i in 0..1000 {
        // The touch falls between two steps.
        let t = (f64::from(i) - 10.3) * DT_S;
        let is = bench.contact(speed * t);
        let should = if t > 0.0 { stiffness * speed * tau * (1.0 - (-t / tau).exp()) } else { 0.0 };
        // Errors of some ulps live for τ / Δt steps.
        let limit = 16.0 * f64::EPSILON * (tau / DT_S) * stiffness * speed * tau;
        assert!((is - should).abs() <= limit, "{t} s: {is} N, not {should}");
    }
}

/// Effect, parameters, depth in m, rate in m/s: what becomes of a nominal 2 N, by hand.
const CONTACT: &[(&str, &[f64], f64, f64, f64)] = &[
    ("asymmetric-damping", &[10.0], 0.004, -0.02, 1.8),
    ("asymmetric-damping", &[10.0], 0.004, 0.02, 2.0),
    ("asymmetric-damping", &[10.0], -0.004, -0.02, 1.8),
    ("contact-preload", &[0.5], 1e-6, 0.02, 2.5),
    ("contact-preload", &[0.5], 0.0, 0.02, 2.0),
    ("coulomb-friction", &[0.3], 0.004, 0.05, 2.3),
    ("coulomb-friction", &[0.3], 0.004, -0.05, 1.7),
    ("end-stop", &[0.003, 2e3], 0.002, 0.02, 2.0),
    ("end-stop", &[0.003, 2e3], 0.004, 0.02, 4.0),
    ("hunt-crossley", &[1e3], 0.004, 0.02, 2.08),
    ("hunt-crossley", &[1e3], 0.008, -0.02, 1.84),
    ("hunt-crossley", &[1e3], -0.004, 0.02, 2.0),
    ("stiffness-hardening", &[3e6], 0.01, 0.02, 5.0),
    ("stiffness-power-law", &[2.0], 0.0005, 0.02, 0.2),
    ("stiffness-power-law", &[1.5], 0.02, 0.02, 4.0),
    ("stiffness-power-law", &[2.0], -0.001, 0.02, 2.0),
];

#[test]
fn contact_terms_are_their_formulas() {
    for &(id, values, depth_m, rate_m_per_s, should) in CONTACT {
        let is = Bench::new(id, values).added(AxisTouch { depth_m, rate_m_per_s }, 2.0);
        // A handful of products and one sum.
        assert!(
            (is - should).abs() <= 8.0 * f64::EPSILON * 5.0,
            "{id} {values:?} at {depth_m} m: {is} N, not {should}"
        );
    }
}

#[test]
fn measurement_delay_begins_on_the_line() {
    for delay_s in [0.003, 0.00325, -0.003] {
        let mut bench = Bench::new("measurement-delay", &[delay_s]);
        for i in 0..100 {
            let at = |t: f64| AxisMotion {
                pitch_rad: 0.1 - 0.2 * t,
                pitch_rate_rad_per_s: -0.2,
                ..AxisMotion::moving(-0.02 + 0.035 * t, 0.035)
            };
            let (is, should) = (bench.measured(at(f64::from(i) * DT_S)), at(f64::from(i) * DT_S - delay_s));
            let limit = 8.0 * f64::EPSILON * 0.1;
            assert!((is.position_m - should.position_m).abs() <= limit, "{delay_s} s, step {i}: {} m", is.position_m);
            assert!((is.pitch_rad - should.pitch_rad).abs() <= limit, "{delay_s} s, step {i}: {} rad", is.pitch_rad);
        }
    }
}

#[test]
fn a_turned_tool_weighs_its_sine() {
    for (mass_kg, pitch_rad, should_n) in
        [(2.0, 0.5_f64, 9.403_117), (-2.0, 0.5, -9.403_117), (2.0, 0.0, 0.0), (1.0, -1.0, -8.252_011)]
    {
        let seen = Signals { achieved: AxisMotion { pitch_rad, ..AxisMotion::default() }, ..Signals::default() };
        let mut out_n = 3.0;
        Bench::new("tool-weight", &[mass_kg])
            .step(|attached, context| attached.effect.sensed(context, &seen, &mut out_n));
        assert!((out_n - 3.0 - should_n).abs() < 1e-6, "{mass_kg} kg at {pitch_rad} rad: {out_n} N");
    }
}
