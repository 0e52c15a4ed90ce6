//! Faults and missing physics: one trait for both.
//!
//! A fault is an effect that was injected; an effect is a fault that nobody has explained yet. An effect sees the wires and
//! rewrites its own: it implements the method named after that wire, and no other. It is called with the part's fresh output,
//! so that nothing adds up while an output is held. Its memory is a slice of numbers, which can be copied and stored.

use crate::refusal::{Refusal, positive};
use crate::rng::Stream;
use crate::signals::{ContactForce, Received, Signals, Wire};
use crate::space::Space;
use crate::time::{Nanos, Step};
use alloc::borrow::Cow;
use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

mod along;
pub use along::{catalog_along, kind_along};

/// The clocks of a run. Every period is a whole number of physics steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rates {
    /// Step of robot path, contact and the analogue part of the sensor.
    pub physics_step: Nanos,
    /// Period of satellites and link.
    pub loop_period: Nanos,
    /// First tick of satellites and link.
    pub loop_phase: Nanos,
    /// Period of the force sensor.
    pub sensor_period: Nanos,
    /// First tick of the force sensor; the phase between the two clocks is worth up to one tick of delay.
    pub sensor_phase: Nanos,
}

impl Rates {
    /// Refuses a physics step that does not divide every period and phase.
    pub fn check(&self) -> Result<(), Refusal> {
        let (name, value, unit) = ("physics_step_s", self.physics_step.seconds(), "s");
        positive(name, value, unit)?;
        let clocks = [
            (self.loop_period, "does not divide the period of the loop"),
            (self.loop_phase, "does not divide the phase of the loop"),
            (self.sensor_period, "does not divide the period of the sensor"),
            (self.sensor_phase, "does not divide the phase of the sensor"),
        ];
        match clocks.iter().find(|(time, _)| time.0 % self.physics_step.0 != 0) {
            Some(&(_, limit)) => Err(Refusal { name, value, unit, limit }),
            None => Ok(()),
        }
    }
}

/// What an effect may use besides the signals.
pub struct Context<'a> {
    /// This tick.
    pub step: Step,
    /// The effect's own memory, as long as [`Effect::memory`] asked for.
    pub memory: &'a mut [f64],
    /// The effect's own random numbers.
    pub random: &'a mut Stream,
}

/// What of the signals an effect looks at; each includes those before it. What nobody reads may be old.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reads {
    /// Touch and loads.
    Loads,
    /// Motions too, but no acceleration.
    Motions,
    /// Everything.
    Accelerations,
}

/// Something that the nominal model leaves out, or that somebody put in to see what happens.
///
/// Implement [`Effect::memory`] and [`Effect::begin`] if it looks back, and the method of each wire that it rewrites.
pub trait Effect<S: Space>: Send + Sync {
    /// How many numbers it remembers.
    fn memory(&self, _rates: &Rates) -> usize {
        0
    }
    /// Fills its memory as if the first signals had always been there.
    fn begin(&self, _memory: &mut [f64], _rates: &Rates, _first: &Signals<S>) {}
    /// Rewrites a command as the robot got it, at each tick of the loop.
    fn received(&self, _context: Context<'_>, _seen: &Signals<S>, _out: &mut Received<S>) {}
    /// Rewrites the pose that the robot really has, at each physics step.
    fn achieved(&self, _context: Context<'_>, _seen: &Signals<S>, _out: &mut S::Motion) {}
    /// Rewrites the pose that the robot controller has at hand, at each physics step.
    fn measured(&self, _context: Context<'_>, _seen: &Signals<S>, _out: &mut S::Motion) {}
    /// Rewrites depth, rate and place of the penetration, at each physics step.
    fn touch(&self, _context: Context<'_>, _seen: &Signals<S>, _out: &mut S::Touch) {}
    /// Rewrites the contact force before the law's clamp, at each physics step.
    fn contact(&self, _context: Context<'_>, _seen: &Signals<S>, _out: &mut ContactForce<S>) {}
    /// Rewrites the sensor's analogue reading, at each physics step.
    fn sensed(&self, _context: Context<'_>, _seen: &Signals<S>, _out: &mut S::Wrench) {}
    /// What it looks at besides its own wires; an effect that needs little spares a run the rest.
    fn reads(&self) -> Reads {
        Reads::Accelerations
    }
    /// By how much the recorder's stamps of the force stream are late against the robot's stream, in s.
    fn stamp_offset_s(&self) -> f64 {
        0.0
    }
}

/// One parameter of an effect: what users type, and what a fit may do with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Param {
    /// Name with its unit, as in a model file.
    pub name: Cow<'static, str>,
    /// Unit, for people.
    pub unit: Cow<'static, str>,
    /// Lowest value that physics allows.
    pub lower: f64,
    /// Value at which the effect is the identity (for a structural parameter: any value, the size of another one decides).
    pub off: f64,
    /// Highest value that is sensible.
    pub upper: f64,
    /// A change that matters: fits take their steps in this unit.
    pub scale: f64,
    /// Where a fit starts; several where there are many minima.
    pub starts: Vec<f64>,
    /// Its value in a model file that does not name it; `None` where it must be named.
    pub default: Option<f64>,
    /// A whole number that is chosen, not fitted: each start is tried as it is.
    pub discrete: bool,
}

impl Param {
    /// A fitted parameter.
    pub fn new(name: &'static str, unit: &'static str, bounds: [f64; 3], scale: f64, starts: &[f64]) -> Self {
        let [lower, off, upper] = bounds;
        let (name, unit) = (Cow::Borrowed(name), Cow::Borrowed(unit));
        Param { name, unit, lower, off, upper, scale, starts: starts.to_vec(), default: None, discrete: false }
    }

    /// The same, but a model file need not name it.
    #[must_use]
    pub fn or(self, default: f64) -> Self {
        Param { default: Some(default), ..self }
    }

    /// A parameter that is chosen among its starts.
    pub fn choice(name: &'static str, unit: &'static str, off: f64, choices: &[f64]) -> Self {
        let lower = choices.iter().copied().fold(f64::INFINITY, f64::min);
        let upper = choices.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Param { discrete: true, ..Param::new(name, unit, [lower, off, upper], 1.0, choices) }
    }
}

/// The family an effect belongs to: it decides which block of the loop can show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// The mechanics of the interface.
    Contact,
    /// What the sensor makes of a force.
    Sensor,
    /// When something happens.
    Timing,
    /// How the robot follows.
    Robot,
}

/// How an effect was checked against something that is not ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verified {
    /// Found in recordings that a foreign simulator or a real machine made.
    Foreign(&'static str),
    /// Only our own simulations have shown it yet.
    OwnOnly,
}

/// Which rigs an effect can happen on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Where {
    /// On a docking cell with a force sensor.
    Docking,
    /// On an axis that a known force drives.
    Drive,
    /// On both.
    Both,
}

/// Makes an effect from its parameters, in the order of [`Kind::params`].
pub type Build<S> = Arc<dyn Fn(&[f64]) -> Box<dyn Effect<S>> + Send + Sync>;

/// A kind of effect, as data: the list, the schema, the fit and the reports are read from it.
#[derive(Clone)]
pub struct Kind<S: Space> {
    /// Its name in model files and on the command line.
    pub id: Cow<'static, str>,
    /// What it is, in one sentence.
    pub about: Cow<'static, str>,
    /// How its residual looks, in one sentence that follows 'because'.
    pub fingerprint: Cow<'static, str>,
    /// The experiment that isolates it.
    pub experiment: Cow<'static, str>,
    /// The wires that it rewrites.
    pub wires: Vec<Wire>,
    /// Its place among the effects on the same wire; lower acts first.
    pub order: u8,
    /// Its family.
    pub family: Family,
    /// The rigs that can have it.
    pub rigs: Where,
    /// Its parameters.
    pub params: Vec<Param>,
    /// What it was checked against.
    pub verified: Verified,
    /// Makes one.
    pub build: Build<S>,
}

impl<S: Space> core::fmt::Debug for Kind<S> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Kind").field("id", &self.id).field("params", &self.params).finish_non_exhaustive()
    }
}

impl<S: Space> Kind<S> {
    /// The parameter values at which it does nothing.
    pub fn off(&self) -> Vec<f64> {
        self.params.iter().map(|param| param.off).collect()
    }

    /// The parameter that says how large it is: the first one whose 'off' is a limit, or simply the first.
    pub fn size(&self) -> usize {
        #[expect(clippy::float_cmp, reason = "limits are written, not computed")]
        let at_limit = |param: &Param| param.off == param.lower || param.off == param.upper;
        self.params.iter().position(at_limit).unwrap_or(0)
    }

    /// Ready to run with these values, in the order of the parameters; the last ones may be left out where they have a default.
    pub fn attach(&self, values: &[f64]) -> Attached<S> {
        let rest = self.params.iter().skip(values.len()).filter_map(|param| param.default);
        let values: Vec<f64> = values.iter().copied().chain(rest).collect();
        assert_eq!(values.len(), self.params.len(), "{}: one value for each parameter", self.id);
        Attached { id: self.id.clone(), wires: self.wires.clone(), order: self.order, effect: (self.build)(&values) }
    }
}

/// An effect that takes part in a run.
pub struct Attached<S: Space> {
    /// Its id; also the name of its random stream.
    pub id: Cow<'static, str>,
    /// The wires on which it is called.
    pub wires: Vec<Wire>,
    /// Its place among the effects on the same wire.
    pub order: u8,
    /// The effect.
    pub effect: Box<dyn Effect<S>>,
}

/// The kinds that a program knows: a value, never a global.
#[derive(Debug, Clone)]
pub struct Catalog<S: Space>(Vec<Kind<S>>);

impl<S: Space> Catalog<S> {
    /// A catalogue of these kinds, sorted by id.
    pub fn of(mut kinds: Vec<Kind<S>>) -> Self {
        kinds.sort_by(|a, b| a.id.cmp(&b.id));
        Catalog(kinds)
    }

    /// The same, with one kind more.
    #[must_use]
    pub fn with(self, kind: Kind<S>) -> Self {
        let mut kinds = self.0;
        kinds.retain(|other| other.id != kind.id);
        kinds.push(kind);
        Catalog::of(kinds)
    }

    /// The kind with this id.
    pub fn get(&self, id: &str) -> Option<&Kind<S>> {
        self.0.iter().find(|kind| kind.id == id)
    }

    /// All kinds, sorted by id.
    pub fn kinds(&self) -> &[Kind<S>] {
        &self.0
    }
}
