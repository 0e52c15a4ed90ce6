//! What a virtual cell gets wrong: wire faults, and effects of the catalogue, each with an account of whether it did anything.
//!
//! An effect is watched: it has acted once what it makes of a wire differs from what it was given, where that can be felt: a command
//! that is late or lost is felt once the commands have moved, a force once the interfaces touch. A fault that never acted is an
//! error of the run, since a run that passes then says nothing about it. What needs another socket: [`super::net_faults`].

use super::config::Cell;
use super::net_faults::is_on_links;
use crate::error::Error;
use crate::model::{List, Model, RigKind, check_effects, nearest, place};
use crate::scenario::{Fault, FaultModel, acting};
use drivers::fault::{Action, At, Stream, TABLE, WireFault};
use drivers::rsi::Transport;
use sim_core::effect::{Attached, Catalog, Context, Effect, Rates, Reads};
use sim_core::signals::{ContactForce, Received, Signals};
use sim_core::space::{Axis, AxisMotion, AxisTouch};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// The faults of a cell, read and checked.
#[derive(Debug, Clone, Default)]
pub struct Faults {
    /// Those of the wire.
    pub wire: Vec<WireFault>,
    /// Which `[[fault]]` of the cell each of them is.
    pub places: Vec<usize>,
    /// Those that act in the cell.
    pub effects: Vec<Fault>,
}

impl Faults {
    /// Reads the faults of a cell.
    ///
    /// # Errors
    /// When one is unknown or has a value that cannot be; the error points at it.
    pub fn of(cell: &Cell, model: &Model, catalog: &Catalog<Axis>) -> Result<Self, Error> {
        let (file, text) = (&cell.source.file, &cell.source.text);
        let (mut wire, mut places) = (Vec::new(), Vec::new());
        let mut models: Vec<FaultModel> = Vec::new();
        for (nth, table) in cell.config.faults.iter().enumerate() {
            let id = table.get("id").and_then(toml::Value::as_str).unwrap_or_default();
            let refuse = |what: String, help: &str| {
                let span = place::in_list(text, "fault", nth, None);
                Error::new(what).file(file).span(text, span).help(help.to_owned())
            };
            if WireFault::knows(id) {
                let fault = table.clone().try_into::<WireFault>();
                let help = "see the streams and parameters of each fault with: dockhil cell --list-faults";
                let fault = fault.map_err(|error| refuse(error.message().replace('\n', " "), help))?;
                if let Some((what, help)) = impossible(&fault, cell)? {
                    return Err(refuse(what, help));
                }
                if fault.robot.as_ref().is_some_and(|name| cell.config.robots.iter().all(|robot| robot.name != *name)) {
                    let what = format!("fault {} is on a robot that the cell does not have", fault.id());
                    return Err(refuse(what, "name one of the [[robot]] tables"));
                }
                wire.push(fault);
                places.push(nth);
                continue;
            }
            if catalog.get(id).is_none() {
                let names = catalog.kinds().iter().map(|kind| kind.id.as_ref()).chain(TABLE.iter().map(|row| row.id));
                let meant = nearest(id, names).map(|name| format!("; did you mean {name}?")).unwrap_or_default();
                let help = "see the faults of the wire with: dockhil cell --list-faults, and the effects with: dockhil effect list";
                return Err(refuse(format!("no fault and no effect is called {id:?}{meant}"), help));
            }
            let help = "see all effects with: dockhil effect list";
            let fault = table.clone().try_into::<FaultModel>();
            models.push(fault.map_err(|error| refuse(error.message().replace('\n', " "), help))?);
            let all: Vec<_> = models.iter().map(|fault| &fault.effect).collect();
            let list = List { effects: &all, rig: RigKind::Docking, name: "", text: "", catalog };
            check_effects(&list).map_err(|error| refuse(error.what, error.help.as_deref().unwrap_or(help)))?;
            if model.effects.iter().any(|effect| effect.enabled && effect.id == id) {
                return Err(refuse(format!("effect {id} is in the model already"), "put it into one of the two files"));
            }
        }
        Ok(Faults { wire, places, effects: acting(&models, catalog) })
    }
}

/// Why the cell cannot do this fault, and what to do.
fn impossible(fault: &WireFault, cell: &Cell) -> Result<Option<(String, &'static str)>, Error> {
    let (id, on) = (fault.id(), fault.on.id());
    let robots = cell.config.robots.iter();
    let nth = robots.enumerate().find(|(_, robot)| fault.robot.as_ref().is_none_or(|name| *name == robot.name));
    let is_stream = nth.map(|(nth, _)| cell.ethernet(nth)).transpose()?.is_some_and(|it| it.protocol == Transport::Tcp);
    if fault.on == Stream::RsiReply && is_stream && !is_on_links(fault) {
        let what =
            format!("{id} on {on}: this robot speaks TCP, and on its connection nobody but the computer answers");
        return Ok(Some((what, "choose a robot that speaks UDP, or a fault of the bytes")));
    }
    if matches!(fault.action, Action::IpocCrossing { .. }) && matches!(fault.at, At::Event(_)) {
        let what = format!("{id} cannot wait for an event: the controller's clock starts so far before 2^32 that it");
        return Ok(Some((format!("{what} passes it in a known cycle"), "give the number of that cycle: at = 200")));
    }
    if fault.on == Stream::Http && cell.config.sensor.page.is_none() {
        let what = format!("{id} on {on}: the sensor of this cell has no page");
        return Ok(Some((what, "add page = \"127.0.0.1:8080\" to [sensor]: there the cell serves it")));
    }
    if fault.on == Stream::Http && matches!(fault.at, At::Event(_)) {
        let what = format!("{id} on {on} cannot wait for an event: the page is read before the run");
        return Ok(Some((what, "give the number of the request: at = 0 is the first")));
    }
    Ok(None)
}

/// Whether an effect has changed anything yet.
#[derive(Debug, Clone)]
pub struct Account {
    /// Its id.
    pub id: String,
    acted: Arc<AtomicBool>,
}

impl Account {
    /// Whether it has acted.
    pub fn acted(&self) -> bool {
        self.acted.load(Ordering::Relaxed)
    }
}

/// The effect of a fault, ready to run, and its account.
pub fn watched(fault: &Fault) -> (Attached<Axis>, Account) {
    let attached = fault.attach();
    // What shifts stamps shifts all of them.
    let acted = Arc::new(AtomicBool::new(attached.effect.stamp_offset_s() != 0.0));
    let account = Account { id: attached.id.to_string(), acted: acted.clone() };
    let effect = Box::new(Watched { inner: attached.effect, acted, first: OnceLock::new() });
    (Attached { effect, ..attached }, account)
}

struct Watched {
    inner: Box<dyn Effect<Axis>>,
    acted: Arc<AtomicBool>,
    /// The command with which the run began.
    first: OnceLock<AxisMotion>,
}

impl Watched {
    fn watch<T: Copy, V: PartialEq>(&self, out: &mut T, value: impl Fn(&T) -> V, work: impl FnOnce(&mut T)) {
        let before = value(out);
        work(out);
        if value(out) != before {
            self.acted.store(true, Ordering::Relaxed);
        }
    }
}

impl Effect<Axis> for Watched {
    fn memory(&self, rates: &Rates) -> usize {
        self.inner.memory(rates)
    }
    fn begin(&self, memory: &mut [f64], rates: &Rates, first: &Signals<Axis>) {
        self.inner.begin(memory, rates, first);
    }
    fn received(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut Received<Axis>) {
        let has_moved = *self.first.get_or_init(|| out.motion) != out.motion;
        let felt = |out: &Received<Axis>| (out.motion, has_moved.then_some((out.late_s, out.lost)));
        self.watch(out, felt, |out| self.inner.received(context, seen, out));
    }
    fn achieved(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut AxisMotion) {
        self.watch(out, |out| *out, |out| self.inner.achieved(context, seen, out));
    }
    fn measured(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut AxisMotion) {
        self.watch(out, |out| *out, |out| self.inner.measured(context, seen, out));
    }
    fn touch(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut AxisTouch) {
        self.watch(out, |out| *out, |out| self.inner.touch(context, seen, out));
    }
    fn contact(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut ContactForce<Axis>) {
        let touches = seen.touch.depth_m > 0.0;
        let felt = |out: &ContactForce<Axis>| touches.then_some((out.elastic, out.dissipative));
        self.watch(out, felt, |out| self.inner.contact(context, seen, out));
    }
    fn sensed(&self, context: Context<'_>, seen: &Signals<Axis>, out: &mut f64) {
        self.watch(out, |out| *out, |out| self.inner.sensed(context, seen, out));
    }
    fn reads(&self) -> Reads {
        self.inner.reads()
    }
    fn stamp_offset_s(&self) -> f64 {
        self.inner.stamp_offset_s()
    }
}
