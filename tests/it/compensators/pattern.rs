//! Where the sampled loop is neutral, for the set-ups that the captions of thesis Fig. 4.12 and 4.13 could mean.
//!
//! The captions call b = 0 and 20 N s/m active, 40 approximately neutral and 70 passive. They do not say what was simulated. It is
//! a hypothesis, not a finding, that the stiffness was virtual, on the measured pose (16 + 16 ms), the new pose valid at the end of
//! the tick that computed it, and the force held for a tick: only that set-up has its neutral damping at 40.90.
//!
//! At which tick a pose is valid: 'before the step' is what `ClosedLoop` does, a command leaves with its tick and the force of the
//! tick comes after it. 'At the end of the tick' is one tick of delay more.

use super::bench::{MASS_KG, RATES, SPEED_M_PER_S, STIFFNESS_N_PER_M, bench, restitution, run};
use sim_core::compensator::{Compensation, Hybrid};
use sim_core::contact::{Sides, SpringDashpot};
use sim_core::plant::PointIntegrator as Integrator;
use sim_core::space::AxisMotion;

/// Where the stiffness is.
#[derive(Clone, Copy, PartialEq)]
enum Spring {
    Hardware,
    Virtual,
}

struct SetUp {
    name: &'static str,
    spring: Spring,
    integrator: Integrator,
    /// How many ticks later than 'before the step' a pose is valid.
    later: u32,
    /// `reference/PHYSICS.md`, section 2.2 and correction 4.
    source_n_s_per_m: f64,
}

const fn set_up(
    name: &'static str,
    spring: Spring,
    integrator: Integrator,
    later: u32,
    source_n_s_per_m: f64,
) -> SetUp {
    SetUp { name, spring, integrator, later, source_n_s_per_m }
}

const SET_UPS: [SetUp; 9] = [
    set_up("virtual, exact hold, end of tick", Spring::Virtual, Integrator::ExactHold, 1, 40.90),
    set_up("virtual, semi-implicit, end of tick", Spring::Virtual, Integrator::SemiImplicit, 1, 38.71),
    set_up("virtual, semi-implicit, a tick late", Spring::Virtual, Integrator::SemiImplicit, 2, 43.10),
    set_up("virtual, exact hold, before the step", Spring::Virtual, Integrator::ExactHold, 0, 36.53),
    set_up("hardware, exact hold, before the step", Spring::Hardware, Integrator::ExactHold, 0, 19.38),
    set_up("hardware, semi-implicit, before the step", Spring::Hardware, Integrator::SemiImplicit, 0, 17.21),
    set_up("hardware, semi-implicit, end of tick", Spring::Hardware, Integrator::SemiImplicit, 1, 21.56),
    set_up("hardware, exact hold, end of tick", Spring::Hardware, Integrator::ExactHold, 1, 23.74),
    set_up("hardware, explicit, end of tick", Spring::Hardware, Integrator::Explicit, 1, 25.93),
];

type Loop = sim_core::rig::DockingAxis<SpringDashpot, Hybrid<Compensation>>;

fn rig(set_up: &SetUp, sides: Sides, damping_n_s_per_m: f64, push_n: f64) -> Loop {
    let (hardware, virtually) = match set_up.spring {
        Spring::Hardware => (STIFFNESS_N_PER_M, 0.0),
        Spring::Virtual => (0.0, STIFFNESS_N_PER_M),
    };
    let law = SpringDashpot { stiffness_n_per_m: hardware, damping_n_s_per_m: 0.0, sides };
    let compensator = Hybrid {
        bias_n: push_n,
        virtual_stiffness_n_per_m: virtually,
        virtual_damping_n_s_per_m: damping_n_s_per_m,
        ..Hybrid::default()
    };
    let mut rig = bench(law, compensator, 0.016 + 0.004 * f64::from(set_up.later), 0.016);
    rig.plant.integrator = set_up.integrator;
    rig
}

/// How much ln(amplitude) grows within 20 s, about a rest that lies so deep that no part of the loop ever leaves contact.
fn growth(set_up: &SetUp, damping_n_s_per_m: f64) -> f64 {
    let rest_m = 0.1;
    let rig = rig(set_up, Sides::Two, damping_n_s_per_m, -STIFFNESS_N_PER_M * rest_m);
    let trace = run(&rig, AxisMotion::moving(rest_m, SPEED_M_PER_S), 30, 0.0, 1);
    let amplitude_m = |from: usize| {
        let window = &trace.after[from..from + 1250];
        window.iter().map(|motion| (motion.position_m - rest_m).abs()).fold(0.0, f64::max)
    };
    libm::log(amplitude_m(6250) / amplitude_m(1250))
}

/// The damping at which it does not grow, by bisection.
fn neutral_n_s_per_m(set_up: &SetUp) -> f64 {
    let (mut low, mut high) = (10.0, 60.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        *(if growth(set_up, middle) > 0.0 { &mut low } else { &mut high }) = middle;
    }
    0.5 * (low + high)
}

#[test]
fn the_neutral_damping_of_each_set_up() {
    println!("set-up                                    b neutral  source");
    let mut wrong = Vec::new();
    for set_up in &SET_UPS {
        let found = neutral_n_s_per_m(set_up);
        println!("{:42} {found:8.3}  {:6.2}", set_up.name, set_up.source_n_s_per_m);
        // Half a printed digit, and a peak that falls between two ticks: (ω T)² / 8 of it, over 20 s / (2 m) per N s/m.
        let peak = 4.107 * RATES.loop_period.seconds();
        let tolerance = 0.005 + peak * peak / 8.0 / (20.0 / (2.0 * MASS_KG));
        if (found - set_up.source_n_s_per_m).abs() > tolerance {
            wrong.push((set_up.name, found));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// What an impact did, outside the noise of its energy.
#[derive(Debug, PartialEq)]
enum Verdict {
    Active,
    Neutral,
    Passive,
}

#[test]
fn active_active_neutral_passive_at_0_20_40_70() {
    let before_mj = 0.5e3 * MASS_KG * SPEED_M_PER_S * SPEED_M_PER_S;
    // Two standard deviations of the observed energy under 0.25 N: σ v √(T T_c / 2), T_c = 0.765 s.
    let band_mj = 2.0 * 0.25e3 * SPEED_M_PER_S * (0.004 * 0.765 / 2.0_f64).sqrt();
    let verdict = |set_up: &SetUp, damping: f64| {
        let e = restitution(&rig(set_up, Sides::One, damping, 0.0), 0.0);
        let absorbed_mj = before_mj * (1.0 - e * e);
        println!("{:42} b {damping:4} e {e:.4} absorbed {absorbed_mj:6.2} mJ", set_up.name);
        match absorbed_mj {
            lost if lost > band_mj => Verdict::Passive,
            gained if gained < -band_mj => Verdict::Active,
            _ => Verdict::Neutral,
        }
    };
    let pattern = |set_up: &SetUp| [0.0, 20.0, 40.0, 70.0].map(|damping| verdict(set_up, damping));
    let captions = [Verdict::Active, Verdict::Active, Verdict::Neutral, Verdict::Passive];
    assert_eq!(pattern(&SET_UPS[0]), captions, "{}", SET_UPS[0].name);
    for hardware in SET_UPS.iter().filter(|set_up| set_up.spring == Spring::Hardware) {
        assert_ne!(pattern(hardware), captions, "{}", hardware.name);
    }
}
