//! Lets an effect of one axis act in space, along z of the nozzle frame.
//!
//! What the effect sees and rewrites is the part of each wire that one axis has:
//!
//! | wire | what the effect gets | what becomes of the rest |
//! |---|---|---|
//! | motions | z with its rates; pitch = x component of the turn from alignment (axis times angle), with its rate | x, y, and turns about y and z pass |
//! | received | also lateness and loss, which hold for the whole packet: a lost one is lost in every axis | |
//! | touch | depth and rate along the normal | normal, point, arm and slip pass |
//! | contact | its component along the normal, positive resists | what the effect adds acts along the normal at the contact point |
//! | interface, feedback | -F_z, so that positive resists; seen only | |
//! | sensed | F_z of the reading in the sensor frame: contact reads negative | other forces and all torques pass |
//!
//! What the effect leaves as it was stays as it was, to the last bit: an effect that is off is the identity here too. A change of
//! pitch turns the pose about x of the nozzle frame.
//!
//! Not modelled: the effect across the axis. A lag of the robot or a late read-back acts on z and pitch alone.

use super::{Catalog, Context, Effect, Kind, Rates, Reads};
use crate::signals::{ContactForce, Received, Signals};
use crate::space::{Axis, AxisMotion, Motion, Spatial, Touch, Wrench, turn_between, turned};
use alloc::boxed::Box;
use alloc::sync::Arc;
use nalgebra::{UnitQuaternion, Vector3};

/// An effect of one axis, in space.
struct Along(Box<dyn Effect<Axis>>);

/// The same kind of effect, in space along z.
pub fn kind_along(kind: &Kind<Axis>) -> Kind<Spatial> {
    let build = kind.build.clone();
    Kind {
        id: kind.id.clone(),
        about: kind.about.clone(),
        fingerprint: kind.fingerprint.clone(),
        experiment: kind.experiment.clone(),
        wires: kind.wires.clone(),
        order: kind.order,
        family: kind.family,
        rigs: kind.rigs,
        params: kind.params.clone(),
        verified: kind.verified,
        build: Arc::new(move |values| Box::new(Along(build(values)))),
    }
}

/// A whole catalogue, in space along z.
pub fn catalog_along(catalog: &Catalog<Axis>) -> Catalog<Spatial> {
    Catalog::of(catalog.kinds().iter().map(kind_along).collect())
}

fn motion_along(motion: &Motion) -> AxisMotion {
    AxisMotion {
        position_m: motion.position_m.z,
        velocity_m_per_s: motion.velocity_m_per_s.z,
        acceleration_m_per_s2: motion.acceleration_m_per_s2.z,
        pitch_rad: turn_between(&UnitQuaternion::identity(), &motion.attitude).x,
        pitch_rate_rad_per_s: motion.rate_rad_per_s.x,
    }
}

fn received_along(received: &Received<Spatial>) -> Received<Axis> {
    Received { motion: motion_along(&received.motion), late_s: received.late_s, lost: received.lost }
}

fn contact_along(touch: &Touch, contact: &ContactForce<Spatial>) -> ContactForce<Axis> {
    ContactForce {
        elastic: touch.normal.dot(&contact.elastic.force_n),
        dissipative: touch.normal.dot(&contact.dissipative.force_n),
    }
}

fn loads_along(signals: &Signals<Spatial>) -> Signals<Axis> {
    Signals {
        touch: signals.touch.along_normal(),
        contact: contact_along(&signals.touch, &signals.contact),
        interface: -signals.interface.force_n.z,
        sensed: signals.sensed.force_n.z,
        feedback: -signals.feedback.force_n.z,
        ..Signals::default()
    }
}

fn signals_along(signals: &Signals<Spatial>) -> Signals<Axis> {
    Signals {
        commanded: motion_along(&signals.commanded),
        received: received_along(&signals.received),
        achieved: motion_along(&signals.achieved),
        measured: motion_along(&signals.measured),
        ..loads_along(signals)
    }
}

/// Lets `act` rewrite the part of a motion that one axis has.
fn rewrite(out: &mut Motion, act: impl FnOnce(&mut AxisMotion)) {
    let before = motion_along(out);
    let mut after = before;
    act(&mut after);
    out.position_m.z = after.position_m;
    out.velocity_m_per_s.z = after.velocity_m_per_s;
    out.acceleration_m_per_s2.z = after.acceleration_m_per_s2;
    out.rate_rad_per_s.x = after.pitch_rate_rad_per_s;
    let turn_rad = after.pitch_rad - before.pitch_rad;
    if turn_rad != 0.0 {
        out.attitude = turned(&out.attitude, &(Vector3::x() * turn_rad));
    }
}

/// Adds what an effect changed to a term of the contact force.
fn add_along(touch: &Touch, term: &mut Wrench, change_n: f64) {
    if change_n != 0.0 {
        *term = *term + touch.pushed(change_n);
    }
}

impl Along {
    /// What the effect sees. A motion costs the turn from alignment, four times a call: only who reads motions gets them.
    fn seen(&self, signals: &Signals<Spatial>) -> Signals<Axis> {
        if self.0.reads() == Reads::Loads { loads_along(signals) } else { signals_along(signals) }
    }
}

impl Effect<Spatial> for Along {
    fn memory(&self, rates: &Rates) -> usize {
        self.0.memory(rates)
    }

    fn begin(&self, memory: &mut [f64], rates: &Rates, first: &Signals<Spatial>) {
        self.0.begin(memory, rates, &signals_along(first));
    }

    fn received(&self, context: Context<'_>, seen: &Signals<Spatial>, out: &mut Received<Spatial>) {
        let before = received_along(out);
        let mut after = before;
        self.0.received(context, &self.seen(seen), &mut after);
        if after.lost && !before.lost {
            // The wire still holds the packet of the tick before: that one counts, in every axis.
            out.motion = seen.received.motion;
        }
        rewrite(&mut out.motion, |motion| *motion = after.motion);
        (out.late_s, out.lost) = (after.late_s, after.lost);
    }

    fn achieved(&self, context: Context<'_>, seen: &Signals<Spatial>, out: &mut Motion) {
        rewrite(out, |motion| self.0.achieved(context, &self.seen(seen), motion));
    }

    fn measured(&self, context: Context<'_>, seen: &Signals<Spatial>, out: &mut Motion) {
        rewrite(out, |motion| self.0.measured(context, &self.seen(seen), motion));
    }

    fn touch(&self, context: Context<'_>, seen: &Signals<Spatial>, out: &mut Touch) {
        let mut along = out.along_normal();
        self.0.touch(context, &self.seen(seen), &mut along);
        (out.depth_m, out.rate_m_per_s) = (along.depth_m, along.rate_m_per_s);
    }

    fn contact(&self, context: Context<'_>, seen: &Signals<Spatial>, out: &mut ContactForce<Spatial>) {
        let before = contact_along(&seen.touch, out);
        let mut after = before;
        self.0.contact(context, &self.seen(seen), &mut after);
        add_along(&seen.touch, &mut out.elastic, after.elastic - before.elastic);
        add_along(&seen.touch, &mut out.dissipative, after.dissipative - before.dissipative);
    }

    fn sensed(&self, context: Context<'_>, seen: &Signals<Spatial>, out: &mut Wrench) {
        self.0.sensed(context, &self.seen(seen), &mut out.force_n.z);
    }

    fn stamp_offset_s(&self) -> f64 {
        self.0.stamp_offset_s()
    }

    fn reads(&self) -> Reads {
        self.0.reads()
    }
}
