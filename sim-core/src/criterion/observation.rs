//! What a criterion sees of a run: columns, borrowed where their owner holds them as they are.
//!
//! Columns that were not recorded are absent, and a criterion that needs them says so. Signs are those of the loop: position and
//! velocity positive closing, forces positive when they resist, whatever the sensor's own sign was.
//!
//! In space the loads of a trace act *on the chaser*, in the nozzle frame, so that a resisting force is minus that load.

use super::Missing;
use crate::space::{Axis, AxisMotion, Motion, Spatial, Wrench};
use crate::time::Nanos;
use crate::trace::Trace;
use alloc::borrow::Cow;
use alloc::format;
use alloc::vec;
use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

/// One number for each tick.
pub type Column<'a> = Cow<'a, [f64]>;

/// An axis of the nozzle frame: along it, or about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObservedAxis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z, the axis of travel.
    #[default]
    Z,
    /// About x.
    AboutX,
    /// About y.
    AboutY,
    /// About z, torsion.
    AboutZ,
}

impl ObservedAxis {
    /// All six, translations first.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::AboutX, Self::AboutY, Self::AboutZ];

    /// As files write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::AboutX => "about-x",
            Self::AboutY => "about-y",
            Self::AboutZ => "about-z",
        }
    }

    /// Whether its loads are torques in N m, its positions angles in rad.
    pub fn turns(self) -> bool {
        matches!(self, Self::AboutX | Self::AboutY | Self::AboutZ)
    }
}

/// The columns along one axis: N, m, m/s; about an axis N m, rad, rad/s.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Along<'a> {
    /// Which axis.
    pub axis: ObservedAxis,
    /// Net load on the satellites, held for one tick of the loop; positive resists.
    pub feedback: Option<Column<'a>>,
    /// Velocity of the satellites before each tick's load acted; positive closes.
    pub before: Option<Column<'a>>,
    /// The same after it acted.
    pub after: Option<Column<'a>>,
    /// Commanded position at each tick of the loop.
    pub commanded: Option<Column<'a>>,
    /// Reported position at each tick of the loop.
    pub measured: Option<Column<'a>>,
    /// The sensor's reading at its own ticks, as a load that resists, with known bias and weight taken out.
    pub sensed: Option<Column<'a>>,
    /// What the interface really felt, at the ticks of the sensor: only a simulation knows.
    pub interface: Option<Column<'a>>,
    /// Standard deviation of one reading, as the loop hears it; none if nobody measured it.
    pub load_sd: Option<f64>,
    /// Standard deviation of one reported position.
    pub position_sd: Option<f64>,
}

/// A run, measured or simulated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observation<'a> {
    /// Time of each tick of the loop.
    pub loop_time: Cow<'a, [Nanos]>,
    /// Time of each tick of the sensor.
    pub sensor_time: Cow<'a, [Nanos]>,
    /// Reduced mass of the satellites in kg.
    pub mass_kg: Option<f64>,
    /// Position of the contact plane on the axis of travel, in m; none if it is where contact was first felt.
    pub contact_plane_m: Option<f64>,
    /// Penetration at the ticks of the sensor, in m: only a simulation knows.
    pub depth_m: Option<Column<'a>>,
    /// Its rate, in m/s.
    pub depth_rate_m_per_s: Option<Column<'a>>,
    /// One entry for each axis that was observed.
    pub along: Vec<Along<'a>>,
}

/// What is known of a run besides its columns.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// Reduced mass of the satellites in kg.
    pub mass_kg: Option<f64>,
    /// Known bias of the reading: force in N on x, y, z, torque in N m about them. One axis uses z; in space the caller takes it out.
    pub bias: [f64; 6],
    /// Known weight of the tool in N, which pitch turns into the axis of travel. Along one axis; in space the caller takes it out.
    pub tool_weight_n: f64,
    /// Standard deviation of one force reading in N.
    pub force_sd_n: Option<f64>,
    /// Standard deviation of one torque reading in N m.
    pub torque_sd_n_m: Option<f64>,
    /// Standard deviation of one reported position in m.
    pub position_sd_m: Option<f64>,
}

impl<'a> Observation<'a> {
    /// A run along one axis.
    pub fn of_axis(trace: &'a Trace<Axis>, known: &Known) -> Self {
        let column = |of: fn(&AxisMotion) -> f64, motions: &[AxisMotion]| some(motions.iter().map(of).collect());
        let after: Vec<f64> = trace.after.iter().map(|motion| motion.velocity_m_per_s).collect();
        let first = trace.commanded.first().map_or(0.0, |motion| motion.velocity_m_per_s);
        let along = Along {
            axis: ObservedAxis::Z,
            feedback: borrowed(&trace.feedback),
            before: some(one_earlier(first, &after)),
            after: some(after),
            commanded: column(|motion| motion.position_m, &trace.commanded),
            measured: column(|motion| motion.position_m, &trace.measured),
            sensed: some(felt_along_axis(trace, known)),
            interface: borrowed(&trace.interface),
            load_sd: known.force_sd_n,
            position_sd: known.position_sd_m,
        };
        Observation {
            loop_time: Cow::Borrowed(&trace.loop_time),
            sensor_time: Cow::Borrowed(&trace.sensor_time),
            mass_kg: known.mass_kg,
            contact_plane_m: Some(0.0),
            depth_m: some(trace.touch.iter().map(|touch| touch.depth_m).collect()),
            depth_rate_m_per_s: some(trace.touch.iter().map(|touch| touch.rate_m_per_s).collect()),
            along: vec![along],
        }
    }

    /// A run in space: six axes. Positions about an axis are the attitude's rotation vector.
    ///
    /// `felt` turns a reading, in the sensor's own frame and with bias and weight in it, into the load on the chaser at the
    /// probe tip, in the nozzle frame; the pose is the newest reported one. Only the sensor's owner knows how.
    pub fn of_spatial(trace: &'a Trace<Spatial>, known: &Known, felt: impl Fn(&Wrench, &Motion) -> Wrench) -> Self {
        let pose = |time: &Nanos| newest(time, &trace.loop_time).and_then(|tick| trace.measured.get(tick));
        let readings = trace.sensed.iter().zip(&trace.sensor_time);
        let sensed: Vec<Wrench> =
            readings.map(|(reading, time)| felt(reading, &pose(time).copied().unwrap_or_default())).collect();
        let along = ObservedAxis::ALL.iter().enumerate().map(|(place, axis)| {
            let after: Vec<f64> = trace.after.iter().map(|motion| rate(motion, place)).collect();
            let first = trace.commanded.first().map_or(0.0, |motion| rate(motion, place));
            let positions = |motions: &[Motion]| some(motions.iter().map(|motion| position(motion, place)).collect());
            let resisting = |loads: &[Wrench]| some(loads.iter().map(|wrench| -load(wrench, place)).collect());
            Along {
                axis: *axis,
                feedback: resisting(&trace.feedback),
                before: some(one_earlier(first, &after)),
                after: some(after),
                commanded: positions(&trace.commanded),
                measured: positions(&trace.measured),
                sensed: resisting(&sensed),
                interface: resisting(&trace.interface),
                load_sd: if axis.turns() { known.torque_sd_n_m } else { known.force_sd_n },
                position_sd: if axis.turns() { None } else { known.position_sd_m },
            }
        });
        Observation {
            loop_time: Cow::Borrowed(&trace.loop_time),
            sensor_time: Cow::Borrowed(&trace.sensor_time),
            mass_kg: known.mass_kg,
            contact_plane_m: None,
            depth_m: some(trace.touch.iter().map(|touch| touch.depth_m).collect()),
            depth_rate_m_per_s: some(trace.touch.iter().map(|touch| touch.rate_m_per_s).collect()),
            along: along.collect(),
        }
    }

    /// The columns along this axis.
    pub fn along(&self, axis: ObservedAxis) -> Result<&Along<'a>, Missing> {
        let found = self.along.iter().find(|along| along.axis == axis);
        found.ok_or_else(|| Missing(format!("axis {} was not observed", axis.name())))
    }

    /// Period of the loop, in s.
    pub fn tick_s(&self) -> Result<f64, Missing> {
        period_s(&self.loop_time).ok_or_else(|| Missing("fewer than two ticks of the loop".into()))
    }

    /// Period of the sensor, in s.
    pub fn sensor_tick_s(&self) -> Result<f64, Missing> {
        period_s(&self.sensor_time).ok_or_else(|| Missing("fewer than two ticks of the sensor".into()))
    }

    /// The ticks of the loop in `[from_s, to_s)`.
    pub fn ticks(&self, from_s: f64, to_s: f64) -> core::ops::Range<usize> {
        let place = |time_s: f64| self.loop_time.partition_point(|time| time.seconds() < time_s);
        place(from_s)..place(to_s).max(place(from_s))
    }
}

impl<'a> Along<'a> {
    /// Net load on the satellites at each tick: recorded, or from what it did to them, `F = -m (v₊ - v₋) / T`.
    pub fn net_load(&self, mass_kg: Option<f64>, tick_s: f64) -> Result<Column<'_>, Missing> {
        if let Some(feedback) = &self.feedback {
            return Ok(Cow::Borrowed(feedback));
        }
        match (&self.before, &self.after, mass_kg) {
            (Some(before), Some(after), Some(mass_kg)) if !self.axis.turns() => {
                let pairs = before.iter().zip(after.iter());
                Ok(pairs.map(|(before, after)| -mass_kg * (after - before) / tick_s).collect())
            }
            _ => Err(self.no("net force on the satellites, and none of velocity with mass")),
        }
    }

    /// Mean of the satellites' velocity before and after each tick.
    pub fn mean_velocity(&self) -> Result<Vec<f64>, Missing> {
        match (&self.before, &self.after) {
            (Some(before), Some(after)) => {
                Ok(before.iter().zip(after.iter()).map(|(before, after)| 0.5 * (before + after)).collect())
            }
            _ => Err(self.no("velocity of the satellites")),
        }
    }

    /// The sentence for a column that is not there.
    pub fn no(&self, what: &str) -> Missing {
        Missing(format!("no {what} on axis {}", self.axis.name()))
    }
}

fn some<'a>(values: Vec<f64>) -> Option<Column<'a>> {
    (!values.is_empty()).then_some(Cow::Owned(values))
}

fn borrowed(values: &[f64]) -> Option<Column<'_>> {
    (!values.is_empty()).then_some(Cow::Borrowed(values))
}

/// `first`, then every value but the last.
fn one_earlier(first: f64, values: &[f64]) -> Vec<f64> {
    core::iter::once(first).chain(values.iter().copied()).take(values.len()).collect()
}

fn period_s(time: &[Nanos]) -> Option<f64> {
    let (first, last) = (time.first()?, time.last()?);
    (time.len() > 1).then(|| (last.0 - first.0) as f64 * 1e-9 / (time.len() - 1) as f64)
}

/// What resists, by the sensor: its sign turned, known bias and weight taken out. The pitch is the newest reported one.
fn felt_along_axis(trace: &Trace<Axis>, known: &Known) -> Vec<f64> {
    let weight_n = |time: &Nanos| {
        let tick = newest(time, &trace.loop_time);
        let pitch_rad = tick.and_then(|tick| trace.measured.get(tick)).map_or(0.0, |motion| motion.pitch_rad);
        known.tool_weight_n * libm::sin(pitch_rad)
    };
    let pairs = trace.sensed.iter().zip(&trace.sensor_time);
    pairs.map(|(reading, time)| known.bias[2] + weight_n(time) - reading).collect()
}

/// The last tick at or before this time.
fn newest(time: &Nanos, ticks: &[Nanos]) -> Option<usize> {
    ticks.partition_point(|tick| tick <= time).checked_sub(1)
}

fn rate(motion: &Motion, place: usize) -> f64 {
    if place < 3 { motion.velocity_m_per_s[place] } else { motion.rate_rad_per_s[place - 3] }
}

fn position(motion: &Motion, place: usize) -> f64 {
    if place < 3 { motion.position_m[place] } else { motion.attitude.scaled_axis()[place - 3] }
}

fn load(wrench: &Wrench, place: usize) -> f64 {
    if place < 3 { wrench.force_n[place] } else { wrench.torque_n_m[place - 3] }
}
