//! A compensation in a model's file, and the settings of the compensator.

use super::bench::{Device, STIFFNESS_N_PER_M, bench, compensated, restitution};
use sim_core::compensator::delay_compensation::{EnergyTank, Extrapolation, Order, PhaseLead, SmithPredictor};
use sim_core::compensator::{
    Architecture, Compensation, DelayCompensation, Hybrid, PositionEstimator, Uncompensated, VirtualPose,
};

const METHODS: [&str; 10] = [
    "method = \"none\"\n",
    "method = \"virtual-damping\"\nstiffness_n_per_m = 1066.0\ndelay_s = 0.036\n",
    "method = \"phase-lead\"\ndelay_s = 0.036\n",
    "method = \"smith-predictor\"\nstiffness_n_per_m = 1066.0\ndelay_s = 0.036\n",
    "method = \"smith-lead\"\ndelay_s = 0.036\n",
    "method = \"extrapolation\"\norder = \"cubic\"\ndelay_s = 0.036\n",
    "method = \"response-error\"\nstiffness_n_per_m = 1066.0\nforward_s = 0.016\n",
    "method = \"identified-response\"\ninitial_stiffness_n_per_m = 0.0\nforgetting = 0.98\nforward_s = 0.016\n",
    "method = \"passivity\"\nside = \"force\"\n",
    "method = \"energy-tank\"\ninitial_j = 0.0\n",
];

#[test]
fn a_model_holds_any_method_and_gives_it_back() {
    for text in METHODS {
        let method: Compensation = toml::from_str(text).unwrap();
        assert_eq!(toml::to_string(&method).unwrap(), text);
        assert_eq!(method.check(0.004), Ok(()), "{text}");
        if text.contains("delay_s") {
            let misspelt = text.replace("delay_s", "delay_ms");
            assert!(toml::from_str::<Compensation>(&misspelt).is_err(), "{misspelt}");
        }
    }
    assert!(toml::from_str::<Compensation>("method = \"smith\"\n").is_err());
}

#[test]
fn input_without_meaning_is_refused_with_its_name() {
    for (text, refusal) in [
        ("method = \"phase-lead\"\ndelay_s = -0.001", "delay_s = -0.001 s is below 0"),
        ("method = \"smith-lead\"\ndelay_s = nan", "delay_s = NaN s is not a finite number"),
        (
            "method = \"extrapolation\"\norder = \"cubic\"\ndelay_s = 0.1",
            "delay_s * 3 = 0.30000000000000004 s is more than 62 ticks of the loop",
        ),
        (
            "method = \"smith-predictor\"\nstiffness_n_per_m = -1.0\ndelay_s = 0.036",
            "stiffness_n_per_m = -1 N/m is below 0",
        ),
        (
            "method = \"identified-response\"\ninitial_stiffness_n_per_m = 0.0\nforgetting = 1.5\nforward_s = 0.0",
            "forgetting = 1.5  is above 1",
        ),
        ("method = \"energy-tank\"\ninitial_j = -1.0", "initial_j = -1 J is below 0"),
    ] {
        let method: Compensation = toml::from_str(text).unwrap();
        assert_eq!(method.check(0.004).unwrap_err().to_string(), refusal);
    }
}

#[test]
fn the_choice_at_run_time_costs_no_bit() {
    fn e<D: DelayCompensation>(delay: D) -> f64 {
        let hybrid = Hybrid::<Uncompensated>::default().with_delay(delay);
        restitution(&bench(Device::SPRING, hybrid, 0.036, 0.016), 0.0)
    }
    fn same<D: DelayCompensation + Copy>(method: D, chosen: fn(D) -> Compensation) {
        assert_eq!(e(method).to_bits(), e(chosen(method)).to_bits());
    }
    same(Uncompensated, Compensation::None);
    same(PhaseLead { delay_s: 0.036 }, Compensation::PhaseLead);
    same(SmithPredictor { stiffness_n_per_m: STIFFNESS_N_PER_M, delay_s: 0.036 }, Compensation::SmithPredictor);
    same(Extrapolation { order: Order::Cubic, delay_s: 0.036 }, Compensation::Extrapolation);
    same(EnergyTank { initial_j: 0.0 }, Compensation::EnergyTank);
}

/// A device of 300 N/m and a virtual spring of 766 N/m: together the spring of the bench.
fn mixed(architecture: Architecture, virtual_pose: VirtualPose) -> f64 {
    let device = Device { stiffness_n_per_m: 300.0, ..Device::SPRING };
    let hybrid = Hybrid::<Uncompensated> {
        virtual_stiffness_n_per_m: STIFFNESS_N_PER_M - 300.0,
        architecture,
        virtual_pose,
        ..Hybrid::default()
    };
    hybrid.check(0.004).unwrap();
    restitution(&bench(device, hybrid, 0.036, 0.016), 0.0)
}

#[test]
fn each_architecture_is_the_loop_of_its_part_alone() {
    let pure = |stiffness_n_per_m, virtual_stiffness_n_per_m| {
        let device = Device { stiffness_n_per_m, ..Device::SPRING };
        let hybrid = Hybrid::<Uncompensated> { virtual_stiffness_n_per_m, ..Hybrid::default() };
        restitution(&bench(device, hybrid, 0.036, 0.016), 0.0)
    };
    let found = |architecture| mixed(architecture, VirtualPose::Measured).to_bits();
    assert_eq!(found(Architecture::PureHardware), pure(300.0, 0.0).to_bits());
    assert_eq!(found(Architecture::PureSoftware), pure(0.0, STIFFNESS_N_PER_M - 300.0).to_bits());
    assert_eq!(found(Architecture::Hybrid), pure(300.0, STIFFNESS_N_PER_M - 300.0).to_bits());
}

#[test]
fn the_pose_that_the_virtual_contact_penetrates_sets_its_delay() {
    // Each millisecond on the stiffness path of k is a damping of -k ms: ln e = π Σ k τ / (2 √(k m)), with 2 ms for the hold.
    let expected = |virtual_s: f64| {
        let damping = 300.0 * 0.038 + (STIFFNESS_N_PER_M - 300.0) * (virtual_s + 0.002);
        damping * std::f64::consts::PI / (2.0 * (STIFFNESS_N_PER_M * super::bench::MASS_KG).sqrt())
    };
    let history = PositionEstimator::CommandHistory { dead_time_s: 0.036, readout_delay_s: 0.016 };
    let forward = PositionEstimator::Forward { readout_delay_s: 0.016 };
    for (pose, virtual_s) in [
        (VirtualPose::Measured, 0.052),
        (VirtualPose::Estimated(history), 0.036),
        (VirtualPose::Estimated(forward), 0.036),
        (VirtualPose::Commanded, 0.0),
    ] {
        let found = libm::log(mixed(Architecture::Hybrid, pose));
        // To the second order in ω τ of the longest delay.
        let bound = (4.107_f64 * 0.054) * (4.107 * 0.054) * expected(0.052);
        assert!((found - expected(virtual_s)).abs() < bound, "{pose:?}: {found} {}", expected(virtual_s));
    }
    let estimated = mixed(Architecture::Hybrid, VirtualPose::Estimated(history));
    // Nothing but a dead time lies between command and pose: the estimate is the pose, and the loop is that of hardware alone.
    let hardware = restitution(&compensated(Device::SPRING, Compensation::default()), 0.0);
    assert!((estimated - hardware).abs() < 1e-9, "{estimated} {hardware}");
}

#[test]
fn files_that_say_nothing_new_read_as_before() {
    let old = "bias_n = 2.1\ntool_weight_n = 73.5\nvirtual_stiffness_n_per_m = 0.0\nvirtual_damping_n_s_per_m = 40.0\ndead_band_n = 0.25\n";
    let hybrid: Hybrid = toml::from_str(old).unwrap();
    assert_eq!((hybrid.architecture, hybrid.virtual_pose), (Architecture::Hybrid, VirtualPose::Measured));
    let with = format!(
        "{old}architecture = \"pure-software\"\n[virtual_pose.estimated]\nmethod = \"command-history\"\ndead_time_s = 0.016\n\
         readout_delay_s = 0.016\n[delay]\nmethod = \"phase-lead\"\ndelay_s = 0.036\n"
    );
    let hybrid: Hybrid<Compensation> = toml::from_str(&with).unwrap();
    assert_eq!(hybrid.delay, Compensation::PhaseLead(PhaseLead { delay_s: 0.036 }));
    assert_eq!(hybrid.architecture, Architecture::PureSoftware);
    let mass: sim_core::plant::PointMass = toml::from_str("mass_kg = 63.2\n").unwrap();
    assert_eq!(mass, sim_core::plant::PointMass::of_mass(63.2));
}
