//! A new effect in one file: defined, hidden in a simulated cell, found again by the diagnosis, added to the model.
//!
//! `cargo run --release -p dockhil --example add_effect`
//!
//! What to learn from it:
//! 1. An effect is a value ([`rail_texture`]): an `impl Effect` that rewrites one wire, and a `Kind` that says what a fit may do
//!    with its parameters. Nothing else has to be registered; `standard().with(rail_texture())` is a catalogue that knows it.
//! 2. From the `Kind` follow, with no further line: its table in a model file, its bounds and starts in a fit, its place in the
//!    ranking, its row in every report.
//! 3. Everything that decides a run is written down: the model, the effect's values, the plan, the seed.
//!
//! Truth and model share code here, so this shows how the search works, not that the physics is right. Exit code 1 if the effect
//! was not found.

use harness::diagnose::answer::Verdict;
use harness::diagnose::score::ladder_of;
use harness::diagnose::search::Rules;
use harness::diagnose::{Outcome, Request, diagnose};
use harness::error::Error;
use harness::model::{Chosen, EffectModel, Model};
use harness::simulate::{self, AUX, LEARN, TEST};
use sim_core::effect::{Context, Effect, Family, Kind, Param, Verified, Where};
use sim_core::effects::standard;
use sim_core::signals::{ContactForce, Signals, Wire};
use sim_core::space::Axis;
use std::f64::consts::PI;
use std::process::ExitCode;
use std::sync::Arc;

/// A rail with a regular texture: `f += A sin(2π d / λ)`, while the probe slides into the device.
///
/// | symbol | meaning | unit | source |
/// |---|---|---|---|
/// | A | half of the force between crest and valley | N | fitted |
/// | λ | distance between two crests | m | fitted; balls of a linear guide are 1 to 6 mm apart (chosen) |
/// | d | depth of penetration; a crest-free point lies at the contact plane | m | |
///
/// It stores energy and returns it: the force depends on the place alone. Not modelled: a phase, wear, texture that drags.
/// Confused with: hysteresis at a single amplitude; a stiffness that hardens, when d stays below λ/4.
struct RailTexture {
    amplitude_n: f64,
    wavelength_m: f64,
}

impl Effect<Axis> for RailTexture {
    fn contact(&self, _context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        out.elastic += self.amplitude_n * libm::sin(2.0 * PI * seen.touch.depth_m / self.wavelength_m);
    }
}

/// The entry of the catalogue.
fn rail_texture() -> Kind<Axis> {
    Kind {
        id: "rail-texture".into(),
        about: "a force that repeats along the path of the device, as balls in a linear guide make it".into(),
        fingerprint: "the missing force is the same function of the depth at every speed, and repeats along it".into(),
        experiment: "push in by hand, a tenth of a millimetre per second: crests stay where they are".into(),
        wires: vec![Wire::Contact],
        order: 45,
        family: Family::Contact,
        rigs: Where::Docking,
        params: vec![
            Param::new("amplitude_n", "N", [0.0, 0.0, 100.0], 0.05, &[0.2]),
            // Several starts, since a wave that is off by half a crest is worse than none: one minimum for each.
            Param::new("wavelength_m", "m", [5e-4, 0.003, 0.02], 1e-4, &[0.0015, 0.002, 0.0027, 0.0036, 0.005]),
        ],
        verified: Verified::OwnOnly,
        build: Arc::new(|values| Box::new(RailTexture { amplitude_n: values[0], wavelength_m: values[1] })),
    }
}

/// The cell: what we believe, and what we go on believing until the diagnosis says otherwise.
const CELL: &str = r#"
schema = 1
name = "nominal"
rig = "docking"
plant = { mass_kg = 63.2 }
contact = { stiffness_n_per_m = 1066.0, damping_n_s_per_m = 6.0 }
timing = { command_delay_s = 0.016, measurement_delay_s = 0.016 }
virtual_contact = { damping_n_s_per_m = 40.0, dead_band_n = 0.5 }
sensor = { tool_mass_kg = 7.5, bias_n = 2.1, white_sigma_n = 0.08, slow_sigma_n = 0.03 }
readout = { position_sigma_m = 2e-5 }
"#;

/// What is hidden: amplitude in N and wavelength in m. Six times the noise of a sample, and no start of a fit.
const HIDDEN: [f64; 2] = [0.5, 0.0023];
/// Repeats the whole run.
const SEED: u64 = 20_260_807;

fn main() -> ExitCode {
    match found() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => {
            println!("rail-texture was not found (seed {SEED})");
            ExitCode::FAILURE
        }
        Err(error) => {
            println!("{error:?}");
            ExitCode::from(2)
        }
    }
}

/// Hides the effect, looks for it, adds it.
fn found() -> Result<bool, Error> {
    let catalog = standard().with(rail_texture());
    let mut model = Model::parse("CELL", CELL, &catalog)?;
    let hidden = [Chosen { kind: rail_texture(), values: HIDDEN.to_vec() }];
    println!("hidden in the cell: rail-texture with {:.2} N every {:.2} mm, seed {SEED}", HIDDEN[0], HIDDEN[1] * 1e3);

    let learn = simulate::cell(&model, &hidden, &LEARN, SEED);
    let aux = simulate::cell(&model, &hidden, &AUX, SEED);
    let test = simulate::cell(&model, &hidden, &TEST, SEED);
    println!(
        "simulated: {} impacts to learn from, {} recordings without contact, {} tests",
        learn.len(),
        aux.len(),
        test.len()
    );

    let rules = Rules::default();
    let progress = |_: &str| {};
    let request =
        Request { model: &model, catalog: &catalog, learn: &learn, aux: &aux, test: &test, rules, progress: &progress };
    let outcome = diagnose(&request)?;
    print_answer(&outcome, catalog.kinds().len());

    add(&mut model, &outcome);
    println!("the model with it, run on the {} tests:", test.len());
    let ladder = ladder_of(&model, &catalog, &test, &aux)?;
    for channel in ladder.channels.values() {
        let steps: Vec<String> = channel.steps.iter().map(|step| format!("{} {:.3e}", step.label, step.rms)).collect();
        println!("  {}, noise floor {:.3e} {}", steps.join(" → "), channel.noise_floor, channel.unit);
    }
    let first = outcome.diagnosis.groups.first().and_then(|group| group.effects.first());
    let alone = outcome.diagnosis.groups.len() == 1;
    Ok(alone && first.is_some_and(|id| id == "rail-texture") && outcome.diagnosis.verdict == Verdict::Explained)
}

fn print_answer(outcome: &Outcome, candidates: usize) {
    let diagnosis = &outcome.diagnosis;
    println!("verdict: {}, out of {candidates} candidates", diagnosis.verdict.id());
    for group in &diagnosis.groups {
        println!("missing: {}", group.effects.join(" or "));
        for (id, parameters) in &group.parameters {
            for (name, estimate) in parameters {
                println!("  {id} {name} = {:.4e} ± {:.1e}", estimate.value, estimate.sd);
            }
        }
    }
    for (channel, score) in &diagnosis.test {
        println!(
            "test {channel}: before {:.3e}, after {:.3e}, floor {:.3e} {}",
            score.before, score.after, score.noise_floor, score.unit
        );
    }
}

/// Adds what was found to the model, base values as refitted, with a note where the numbers come from.
fn add(model: &mut Model, outcome: &Outcome) {
    model.contact.stiffness_n_per_m = outcome.base.stiffness_n_per_m;
    model.contact.damping_n_s_per_m = outcome.base.damping_n_s_per_m;
    for chosen in &outcome.found {
        let names = chosen.kind.params.iter().map(|param| param.name.to_string());
        model.effects.push(EffectModel {
            id: chosen.kind.id.to_string(),
            enabled: true,
            source: format!("fitted to {} simulated impacts, seed {SEED}", LEARN.len()),
            values: names.zip(chosen.values.iter().copied()).collect(),
        });
    }
}
