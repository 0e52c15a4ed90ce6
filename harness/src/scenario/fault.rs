//! Faults: effects that begin and end.
//!
//! A fault that is not acting runs all the same, and what it makes is dropped: its memory and its random numbers are, when it
//! begins, what they would be had it acted from the start. A lag that comes on is a lag that was watching.

use super::FaultModel;
use crate::model::Chosen;
use sim_core::effect::{Attached, Catalog, Context, Effect, Kind, Rates, Reads, kind_along};
use sim_core::signals::{ContactForce, Received, Signals};
use sim_core::space::{Axis, AxisMotion, AxisTouch, Spatial};
use std::sync::Arc;

/// An effect with its values, and when it acts.
#[derive(Debug, Clone)]
pub struct Fault {
    /// The effect.
    pub chosen: Chosen,
    /// When it begins.
    pub from_s: Option<f64>,
    /// When it ends.
    pub until_s: Option<f64>,
}

impl Fault {
    /// From the beginning to the end.
    pub fn always(chosen: Chosen) -> Self {
        Fault { chosen, from_s: None, until_s: None }
    }

    /// What it is, with its values and its time.
    pub fn words(&self) -> String {
        let params = self.chosen.kind.params.iter().zip(&self.chosen.values);
        let values: Vec<String> =
            params.map(|(param, value)| format!("{} = {value} {}", param.name, param.unit)).collect();
        let time = match (self.from_s, self.until_s) {
            (None, None) => String::new(),
            (Some(from_s), None) => format!(", from {from_s} s"),
            (None, Some(until_s)) => format!(", until {until_s} s"),
            (Some(from_s), Some(until_s)) => format!(", from {from_s} s until {until_s} s"),
        };
        format!("{} ({}){time}", self.chosen.kind.id, values.join(", "))
    }

    /// Ready to run.
    pub fn attach(&self) -> Attached<Axis> {
        self.kind().attach(&self.chosen.values)
    }

    /// Ready to run with six axes, along z.
    pub fn attach_along(&self) -> Attached<Spatial> {
        kind_along(&self.kind()).attach(&self.chosen.values)
    }

    /// The kind of effect, acting while the fault does.
    fn kind(&self) -> Kind<Axis> {
        let kind = self.chosen.kind.clone();
        if self.from_s.is_none() && self.until_s.is_none() {
            return kind;
        }
        let (from_s, until_s) = (self.from_s.unwrap_or(f64::NEG_INFINITY), self.until_s.unwrap_or(f64::INFINITY));
        let build = kind.build.clone();
        Kind { build: Arc::new(move |values| Box::new(Timed { inner: build(values), from_s, until_s })), ..kind }
    }
}

/// The faults of a scenario that take part.
pub fn acting(faults: &[FaultModel], catalog: &Catalog<Axis>) -> Vec<Fault> {
    let enabled = faults.iter().filter(|fault| fault.effect.enabled);
    let of = |fault: &FaultModel| {
        let chosen = fault.effect.chosen(catalog.get(&fault.effect.id)?);
        Some(Fault { chosen, from_s: fault.from_s, until_s: fault.until_s })
    };
    enabled.filter_map(of).collect()
}

/// An effect whose work counts from one time to another.
struct Timed {
    inner: Box<dyn Effect<Axis>>,
    from_s: f64,
    until_s: f64,
}

impl Timed {
    /// Lets the effect work on a copy, and keeps the copy while the fault acts.
    fn work<T: Copy>(&self, context: Context<'_>, out: &mut T, work: impl FnOnce(Context<'_>, &mut T)) {
        let now_s = context.step.now.seconds();
        let mut made = *out;
        work(context, &mut made);
        if now_s >= self.from_s && now_s < self.until_s {
            *out = made;
        }
    }
}

impl Effect<Axis> for Timed {
    fn memory(&self, rates: &Rates) -> usize {
        self.inner.memory(rates)
    }
    fn begin(&self, memory: &mut [f64], rates: &Rates, first: &Signals<Axis>) {
        self.inner.begin(memory, rates, first);
    }
    fn received(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut Received<Axis>) {
        self.work(context, out, |context, out| self.inner.received(context, seen, out));
    }
    fn achieved(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut AxisMotion) {
        self.work(context, out, |context, out| self.inner.achieved(context, seen, out));
    }
    fn measured(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut AxisMotion) {
        self.work(context, out, |context, out| self.inner.measured(context, seen, out));
    }
    fn touch(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut AxisTouch) {
        self.work(context, out, |context, out| self.inner.touch(context, seen, out));
    }
    fn contact(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        self.work(context, out, |context, out| self.inner.contact(context, seen, out));
    }
    fn sensed(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut f64) {
        self.work(context, out, |context, out| self.inner.sensed(context, seen, out));
    }
    fn reads(&self) -> Reads {
        self.inner.reads()
    }
    fn stamp_offset_s(&self) -> f64 {
        self.inner.stamp_offset_s()
    }
}
