//! A docking cell as the stability theory sees it: one linear loop, and who makes it late.
//!
//! The command of a tick leaves before that tick's reading and is reached when its dead time is over, on a straight line; the
//! satellites integrate a held force by the rule of their model; the newest sample of the force counts.

use super::subject::Cell;
use crate::model::{Chosen, LawModel, Model};
use sim_core::compensator::{Compensation, VirtualPose};
use sim_core::stability::budget::{self, Contributor, Path, Stiffness};
use sim_core::stability::sampled::{Arrival, Issue, SampledLoop, SecondOrder, Seen, Sensing};

/// Samples that a tick may have in the prediction.
const SAMPLES_MAX: f64 = 64.0;

/// What the linear loop is made of.
#[derive(Debug, Clone)]
pub struct Linear {
    /// The loop as the computers run it.
    pub sampled: SampledLoop,
    /// Stiffness of each path.
    pub stiffness: Stiffness,
    /// Everything that makes the force late.
    pub contributors: Vec<Contributor>,
    /// Mass that the sensor feels and nobody declared, kg.
    pub tool_mass_kg: f64,
    /// What the model holds and the linear loop does not, each with the reason.
    pub left_out: Vec<String>,
    /// Names of those of them that may turn the answer round.
    pub undecided: Vec<String>,
    /// Whether the software adds a contact of its own.
    pub computes: bool,
    /// Whether something holds the mass back in contact: a virtual part, or a compensation.
    pub pulls: bool,
}

impl Linear {
    /// The linear loop of a cell.
    pub fn of(cell: &Cell) -> Self {
        let (model, timing) = (&cell.model, &cell.model.timing);
        let samples = (timing.loop_period_s / timing.sensor_period_s).clamp(1.0, SAMPLES_MAX);
        let mut linear = Linear {
            sampled: SampledLoop {
                mass_kg: model.plant.mass_kg,
                hardware_stiffness_n_per_m: model.contact.stiffness_n_per_m,
                hardware_damping_n_s_per_m: model.contact.damping_n_s_per_m,
                virtual_stiffness_n_per_m: model.virtual_contact.stiffness_n_per_m,
                virtual_damping_n_s_per_m: model.virtual_contact.damping_n_s_per_m,
                own_damping_n_s_per_m: 0.0,
                stiffness_on: Seen::Measured,
                damping_on: Seen::Measured,
                tick_s: timing.loop_period_s,
                dead_time_s: timing.command_delay_s,
                readout_s: timing.measurement_delay_s,
                issue: Issue::BeforeReading,
                arrival: Arrival::LineTo,
                robot: None,
                sensing: Sensing { samples_per_tick: samples as usize, averaged: 1, age_s: 0.0, low_pass: None },
                integrator: model.plant.integrator,
            },
            stiffness: Stiffness {
                hardware_n_per_m: model.contact.stiffness_n_per_m,
                virtual_n_per_m: model.virtual_contact.stiffness_n_per_m,
            },
            contributors: Vec::new(),
            tool_mass_kg: 0.0,
            left_out: Vec::new(),
            undecided: Vec::new(),
            computes: model.virtual_contact.architecture.computes(),
            pulls: false,
        };
        linear.choose(model);
        linear.late("dead time of the command", linear.commanded(), timing.command_delay_s);
        if linear.sampled.stiffness_on == Seen::Measured {
            linear.late("read-back of the pose", Path::Virtual, timing.measurement_delay_s);
        }
        let hold_s = budget::integrator_delay_s(model.plant.integrator, timing.loop_period_s);
        linear.late("force held for one tick", Path::Both, hold_s);
        for chosen in &cell.effects {
            linear.add(chosen);
        }
        linear
    }

    /// Takes in the parts that the model chooses, or says why one is left out.
    fn choose(&mut self, model: &Model) {
        let software = &model.virtual_contact;
        if !software.architecture.feels() {
            self.sampled.hardware_stiffness_n_per_m = 0.0;
            self.sampled.hardware_damping_n_s_per_m = 0.0;
            self.stiffness.hardware_n_per_m = 0.0;
        }
        if !software.architecture.computes() {
            self.sampled.virtual_stiffness_n_per_m = 0.0;
            self.sampled.virtual_damping_n_s_per_m = 0.0;
            self.stiffness.virtual_n_per_m = 0.0;
        }
        match software.pose {
            VirtualPose::Measured => {}
            VirtualPose::Commanded => {
                (self.sampled.stiffness_on, self.sampled.damping_on) = (Seen::Commanded, Seen::Commanded);
            }
            VirtualPose::Estimated(_) => {
                self.open("virtual_contact.pose", "the estimator; the pose counts as the measured one");
            }
        }
        if model.contact.law != LawModel::SpringDashpot {
            let what = "its stiffness depends on the depth; the loop has that of the depth at which they agree";
            self.open("contact.law", what);
        }
        match &model.compensation {
            Compensation::None(_) => {}
            // It acts on what the sensor feels, and is 0 where that is.
            Compensation::VirtualDamping(damping) if software.architecture.feels() => {
                self.sampled.own_damping_n_s_per_m = damping.stiffness_n_per_m * damping.delay_s;
            }
            Compensation::VirtualDamping(_) => {}
            _ => self.open("compensation", "run the loop to see it"),
        }
        let (stiffness, damping) = (self.stiffness.virtual_n_per_m, self.sampled.virtual_damping_n_s_per_m);
        self.pulls = [stiffness, damping, self.sampled.own_damping_n_s_per_m].iter().any(|value| *value != 0.0);
    }

    /// Leaves out what may turn the answer round.
    fn open(&mut self, name: &str, why: &str) {
        self.left_out.push(format!("{name}: {why}"));
        self.undecided.push(name.to_owned());
    }

    /// What the way to the robot makes late: a virtual part on the commanded pose does not go there.
    fn commanded(&self) -> Path {
        if self.sampled.stiffness_on == Seen::Commanded { Path::Hardware } else { Path::Both }
    }

    fn late(&mut self, name: &str, path: Path, delay_s: f64) {
        self.contributors.push(Contributor { name: name.to_owned(), path, delay_s });
    }

    /// Takes an effect of the model in, or says why it is left out.
    fn add(&mut self, chosen: &Chosen) {
        let (id, values) = (chosen.kind.id.as_ref(), &chosen.values);
        let tau_s = |corner_hz: f64| 1.0 / (2.0 * std::f64::consts::PI * corner_hz);
        match id {
            "command-delay" => {
                self.sampled.dead_time_s += values[0];
                self.late(id, self.commanded(), values[0]);
            }
            "command-loss" => {
                // A share p/(p + q) of the packets is lost, in runs of 1/q: that many ticks late on average.
                let mean_s = self.sampled.tick_s * values[0] / ((values[0] + values[1]) * values[1]);
                self.sampled.dead_time_s += mean_s;
                self.late("command-loss, on average", self.commanded(), mean_s);
            }
            "robot-second-order" => {
                let robot = SecondOrder { natural_frequency_hz: values[0], damping_ratio: values[1] };
                self.sampled.robot = Some(robot);
                self.late(id, self.commanded(), budget::second_order_delay_s(values[0], values[1]));
            }
            "measurement-delay" => {
                self.sampled.readout_s += values[0];
                if self.sampled.stiffness_on == Seen::Measured {
                    self.late(id, Path::Virtual, values[0]);
                }
            }
            "force-delay" => {
                self.sampled.sensing.age_s += values[0];
                self.late(id, Path::Hardware, values[0]);
            }
            "force-lag" if values[1] > 1.5 => {
                // Two equal poles are a second order of damping ratio 1.
                self.sampled.sensing.low_pass =
                    Some(SecondOrder { natural_frequency_hz: values[0], damping_ratio: 1.0 });
                self.late(id, Path::Hardware, 2.0 * tau_s(values[0]));
            }
            "force-lag" => {
                // One pole delays slow motion by its time constant.
                self.sampled.sensing.age_s += tau_s(values[0]);
                self.late(id, Path::Hardware, tau_s(values[0]));
            }
            "force-scale" => {
                self.sampled.hardware_stiffness_n_per_m *= values[0];
                self.sampled.hardware_damping_n_s_per_m *= values[0];
                self.stiffness.hardware_n_per_m *= values[0];
            }
            "tool-inertia" => {
                // What the sensor feels late acts as mass on slow motion.
                self.tool_mass_kg += values[0];
                self.sampled.mass_kg += values[0];
            }
            "contact-gap" => self.left_out.push(format!("{id}: it moves where contact begins, not the loop in it")),
            "clock-offset" => self.left_out.push(format!("{id}: it shifts the log, not the loop")),
            "force-bias" | "force-bias-drift" | "tool-weight" => {
                self.left_out.push(format!("{id}: a constant moves the loop, and damps or feeds nothing"));
            }
            "command-jitter" => self.left_out.push(format!("{id}: its mean is zero")),
            _ => self.open(id, "it depends on the amplitude; run the loop to see it"),
        }
    }
}
