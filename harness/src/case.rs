//! One recording, put on the clocks of the model: a case that every block of the loop can be evaluated on.
//!
//! Samples go to the tick that their stamp is nearest to. A tick without a sample is filled by a straight line and marked, so
//! that it counts nowhere. Nothing is shifted to fit.

use crate::error::Error;
use crate::missing::{self, Has, Missing};
use crate::model::{Model, RigKind};
use crate::recording::{Grade, Kind, Series, Session};
use sim_core::effect::Rates;
use sim_core::space::AxisMotion;
use sim_core::time::Nanos;

/// One channel on a regular clock.
#[derive(Debug, Clone, Default)]
pub struct Channel {
    /// One value for each tick.
    pub value: Vec<f64>,
    /// Whether the recording holds a sample of this tick.
    pub known: Vec<bool>,
}

impl Channel {
    /// Values that are known.
    pub fn known_values(&self) -> impl Iterator<Item = f64> + '_ {
        self.value.iter().zip(&self.known).filter(|(_, known)| **known).map(|(value, _)| *value)
    }
}

/// A recording along the axis of travel.
#[derive(Debug, Clone)]
pub struct Case {
    /// File name, for reports.
    pub name: String,
    /// Integrity of the file.
    pub grade: Grade,
    /// What was done.
    pub kind: Kind,
    /// Mass of this run: the recording's own record holds where it differs from the model's.
    pub mass_kg: f64,
    /// Clocks, with the phase that the stamps show.
    pub rates: Rates,
    /// Time after the last tick.
    pub until: Nanos,
    /// Motion at time zero.
    pub first: AxisMotion,
    /// Commanded motion at each tick of the loop; empty for a drive.
    pub commanded: Vec<AxisMotion>,
    /// Step to which recorded commands were rounded on their wire, in m; 0 where nobody says.
    pub command_quantum_m: f64,
    /// Whether that command was recorded.
    pub commanded_known: Vec<bool>,
    /// Reported position at each tick of the loop.
    pub measured_m: Channel,
    /// Reported rotation about x at each tick of the loop.
    pub measured_pitch_rad: Vec<f64>,
    /// Velocity of the satellites after each tick; empty where not recorded.
    pub after_m_per_s: Channel,
    /// Raw reading along the axis at each tick of the sensor; positive z of the nozzle frame.
    pub sensed_n: Channel,
    /// The two readings across the axis, x and y, for the check of axes and signs.
    pub across_n: [Channel; 2],
    /// Force that drives the axis at each tick; empty for a docking cell.
    pub applied_n: Vec<f64>,
    /// What is missing in it.
    pub missing: Missing,
    /// What is known of the ticks at which something is missing, once [`crate::diagnose::settle::settled`] has looked.
    pub settled: Settled,
}

/// What is known of the ticks at which something is missing.
#[derive(Debug, Clone, Default)]
pub struct Settled {
    /// Ticks at which the robot holds, having got no command; empty before anybody has looked.
    pub held: Vec<bool>,
    /// Ticks whose command is recorded and did not reach the robot in time.
    pub unheard: Vec<usize>,
    /// Ticks at which the software did what nobody knows, soon after a gap.
    pub resumed: Vec<usize>,
}

/// The median interval of a stream.
pub fn median_period_ns(time_ns: &[i64]) -> i64 {
    let mut intervals: Vec<i64> = time_ns.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_unstable();
    intervals.get(intervals.len() / 2).copied().unwrap_or(0)
}

impl Case {
    /// Puts a session on the clocks of a model.
    pub fn of(session: &Session, model: &Model) -> Result<Self, Error> {
        match model.rig {
            RigKind::Docking => docking(session, model),
            RigKind::Drive => drive(session, model),
        }
    }

    /// Whether the interfaces touch in it.
    pub fn is_impact(&self) -> bool {
        self.kind == Kind::Impact
    }

    /// Whether the command of a tick was recorded, and is the one of that tick.
    pub fn trusts_command(&self, tick: usize) -> bool {
        self.missing.command.get(tick).is_none_or(|has| *has == Has::Sample)
    }

    /// Time of a tick of the sensor, in s.
    pub fn sensor_time_s(&self, tick: usize) -> f64 {
        (self.rates.sensor_phase.0 + tick as i64 * self.rates.sensor_period.0) as f64 * 1e-9
    }

    /// Time of a tick of the loop, in s.
    pub fn loop_time_s(&self, tick: usize) -> f64 {
        (self.rates.loop_phase.0 + tick as i64 * self.rates.loop_period.0) as f64 * 1e-9
    }
}

fn docking(session: &Session, model: &Model) -> Result<Case, Error> {
    let missing =
        |what: &str, help: &str| Error::new(format!("the recording has no {what}")).file(&session.file).help(help);
    let map_help = "name its topic in a map file and pass it with --map MAP.toml";
    let commanded = session.commanded.as_ref().ok_or_else(|| missing("commanded pose", map_help))?;
    let measured = session.measured.as_ref().ok_or_else(|| missing("measured pose", map_help))?;
    let sensed = session.sensed.as_ref().ok_or_else(|| missing("wrench", map_help))?;
    if commanded.value.len() < 20 || sensed.value.len() < 20 {
        return Err(missing("20 samples of command and force", "record at least a tenth of a second"));
    }
    let mass_kg = session.believed_f64_or("reduced_mass_kg", model.plant.mass_kg)?;
    if !(mass_kg.is_finite() && mass_kg > 0.0) {
        let what = format!("reduced_mass_kg = {mass_kg} kg is not above 0");
        return Err(Error::new(what)
            .file(&session.file)
            .place("metadata record session")
            .help("correct the recording's session record, or leave it out: then the model's plant.mass_kg holds"));
    }
    let period = Nanos::from_seconds(model.timing.loop_period_s);
    let start_ns = commanded.time_ns[0];
    let last_ns = commanded.time_ns[commanded.time_ns.len() - 1];
    let ticks = ((last_ns - start_ns + period.0 / 2) / period.0) as usize + 1;
    let pose = |axis: fn(&crate::recording::Pose) -> f64, series: &Series<crate::recording::Pose>| {
        gridded(series, axis, start_ns, period.0, ticks)
    };
    let position = pose(|pose| pose.position_m[2], commanded);
    let pitch = pose(pitch_rad, commanded);
    let mut motion: Vec<AxisMotion> = (0..ticks)
        .map(|i| AxisMotion { pitch_rad: pitch.value[i], ..AxisMotion::moving(position.value[i], 0.0) })
        .collect();
    let after_m_per_s = session
        .twist
        .as_ref()
        .map_or(Channel::default(), |twist| gridded(twist, |twist| twist.linear_m_per_s[2], start_ns, period.0, ticks));
    let sensor_period = Nanos::from_seconds(model.timing.sensor_period_s);
    let physics_step = Nanos::from_seconds(model.timing.physics_step_s);
    let phase = on_grid(sensed.time_ns[0] - start_ns, physics_step.0);
    let sensor_last = sensed.time_ns[sensed.time_ns.len() - 1];
    let sensor_ticks = ((sensor_last - sensed.time_ns[0] + sensor_period.0 / 2) / sensor_period.0) as usize + 1;
    let reading =
        |axis: usize| gridded(sensed, |wrench| wrench.force_n[axis], sensed.time_ns[0], sensor_period.0, sensor_ticks);
    // Samples before the first command belong to no tick of the loop.
    let early = if phase < 0 { ((-phase + sensor_period.0 - 1) / sensor_period.0) as usize } else { 0 };
    let phase = phase + early as i64 * sensor_period.0;
    let without_early = |channel: Channel| Channel {
        value: channel.value.get(early..).unwrap_or_default().to_vec(),
        known: channel.known.get(early..).unwrap_or_default().to_vec(),
    };
    let sensed_n = without_early(reading(2));
    let (of_readings, readings) = (
        missing::ticks_of(&sensed.time_ns, sensed.time_ns[0], sensor_period.0, sensor_ticks),
        sensor_ticks.saturating_sub(early),
    );
    let until = Nanos((ticks as i64 * period.0).max(phase + sensed_n.value.len() as i64 * sensor_period.0));
    let speed = (motion[1].position_m - motion[0].position_m) / period.seconds();
    let measured_m = pose(|pose| pose.position_m[2], measured);
    let measured_pitch_rad = pose(pitch_rad, measured).value;
    let speed = after_m_per_s.value.first().copied().unwrap_or(speed);
    if came_in_moving(model, &measured_m, motion[0].position_m, speed) {
        // Only the first command needs its velocity: along it the robot came in.
        motion[0].velocity_m_per_s = speed;
        motion[0].pitch_rate_rad_per_s = (motion[1].pitch_rad - motion[0].pitch_rad) / period.seconds();
    }
    Ok(Case {
        name: short_name(session),
        grade: session.grade,
        kind: session.kind,
        mass_kg,
        rates: Rates {
            physics_step,
            loop_period: period,
            loop_phase: Nanos(0),
            sensor_period,
            sensor_phase: Nanos(phase),
        },
        until,
        first: motion[0],
        commanded: motion,
        command_quantum_m: session.believed_f64_or("command_quantum_m", 0.0)?.max(0.0),
        commanded_known: position.known,
        measured_m,
        measured_pitch_rad,
        after_m_per_s,
        sensed_n,
        across_n: [without_early(reading(0)), without_early(reading(1))],
        applied_n: Vec::new(),
        missing: Missing {
            command: missing::ticks_of(&commanded.time_ns, start_ns, period.0, ticks),
            pose: missing::ticks_of(&measured.time_ns, start_ns, period.0, ticks),
            reading: of_readings.get(early..).unwrap_or_default().to_vec(),
            before: ((start_ns - measured.time_ns.first().unwrap_or(&start_ns)).max(0) as f64 / period.0 as f64).round()
                as usize,
            late: missing::late(
                &sensed.time_ns,
                sensed.time_ns[0] + early as i64 * sensor_period.0,
                sensor_period.0,
                readings,
            ),
        },
        settled: Settled::default(),
    })
}

/// Whether the robot was already moving when the recording starts, or at rest: before the first command can show in the reported
/// pose, that pose tells.
fn came_in_moving(model: &Model, measured_m: &Channel, first_m: f64, speed_m_per_s: f64) -> bool {
    let period_s = model.timing.loop_period_s;
    let delay_s = model.timing.command_delay_s + model.timing.measurement_delay_s;
    let ticks = (libm::floor(delay_s / period_s) as usize).clamp(1, measured_m.value.len());
    let misfit = |speed: f64| -> f64 {
        let at = |tick: usize| first_m + speed * (tick as f64 * period_s - delay_s);
        (0..ticks).map(|tick| (measured_m.value[tick] - at(tick)) * (measured_m.value[tick] - at(tick))).sum()
    };
    misfit(speed_m_per_s) < misfit(0.0)
}

fn drive(session: &Session, model: &Model) -> Result<Case, Error> {
    let missing = |what: &str| {
        Error::new(format!("the recording has no {what}")).file(&session.file).help("name its column in the map file")
    };
    let measured = session.measured.as_ref().ok_or_else(|| missing("measured position"))?;
    let applied = session.applied.as_ref().ok_or_else(|| missing("applied force"))?;
    let period = Nanos::from_seconds(model.timing.loop_period_s);
    let start_ns = measured.time_ns[0];
    let last_ns = measured.time_ns[measured.time_ns.len() - 1];
    let ticks = ((last_ns - start_ns + period.0 / 2) / period.0) as usize + 1;
    let measured_m = gridded(measured, |pose| pose.position_m[2], start_ns, period.0, ticks);
    let applied_n = gridded(applied, |force| *force, start_ns, period.0, ticks);
    let first = AxisMotion::moving(measured_m.value[0], 0.0);
    Ok(Case {
        name: short_name(session),
        grade: session.grade,
        kind: session.kind,
        mass_kg: model.plant.mass_kg,
        rates: Rates {
            physics_step: period,
            loop_period: period,
            loop_phase: Nanos(0),
            sensor_period: period,
            sensor_phase: Nanos(0),
        },
        until: Nanos(ticks as i64 * period.0),
        first,
        commanded: Vec::new(),
        command_quantum_m: 0.0,
        commanded_known: Vec::new(),
        measured_m,
        measured_pitch_rad: Vec::new(),
        after_m_per_s: Channel::default(),
        sensed_n: Channel::default(),
        across_n: [Channel::default(), Channel::default()],
        applied_n: applied_n.value,
        missing: Missing::default(),
        settled: Settled::default(),
    })
}

fn short_name(session: &Session) -> String {
    session
        .file
        .file_name()
        .map_or_else(|| session.file.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Rotation about +x of the nozzle frame.
fn pitch_rad(pose: &crate::recording::Pose) -> f64 {
    2.0 * libm::atan2(pose.orientation_xyzw[0], pose.orientation_xyzw[3])
}

fn on_grid(time_ns: i64, step_ns: i64) -> i64 {
    (time_ns + step_ns.div_euclid(2)).div_euclid(step_ns) * step_ns
}

/// Puts a stream on a clock; ticks without a sample get a straight line and are marked.
fn gridded<T>(series: &Series<T>, value: impl Fn(&T) -> f64, start_ns: i64, period_ns: i64, ticks: usize) -> Channel {
    let mut channel = Channel { value: vec![f64::NAN; ticks], known: vec![false; ticks] };
    for (time_ns, sample) in series.time_ns.iter().zip(&series.value) {
        let tick = (time_ns - start_ns + period_ns / 2).div_euclid(period_ns);
        if (0..ticks as i64).contains(&tick) {
            channel.value[tick as usize] = value(sample);
            channel.known[tick as usize] = true;
        }
    }
    fill_gaps(&mut channel);
    channel
}

fn fill_gaps(channel: &mut Channel) {
    let mut before: Option<usize> = None;
    for tick in 0..channel.value.len() {
        if !channel.known[tick] {
            continue;
        }
        let end = channel.value[tick];
        match before {
            Some(from) => {
                let begin = channel.value[from];
                for gap in from + 1..tick {
                    channel.value[gap] = begin + (end - begin) * (gap - from) as f64 / (tick - from) as f64;
                }
            }
            None => channel.value[..tick].fill(end),
        }
        before = Some(tick);
    }
    let last = before.map_or(0.0, |tick| channel.value[tick]);
    let from = before.map_or(0, |tick| tick + 1);
    channel.value[from..].fill(last);
}
