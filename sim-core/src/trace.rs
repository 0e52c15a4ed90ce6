//! What a run leaves behind: columns at the rates at which they were produced, and a fingerprint of their bits.

use crate::signals::{Received, Signals};
use crate::space::{AxisMotion, AxisTouch, Motion, Space, Touch, Wrench};
use crate::time::Nanos;
use alloc::vec::Vec;

/// Which columns a run fills; what nobody asks for costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns {
    /// Commanded, received, measured, feedback and the motion after the tick, at each tick of the loop; the acceleration of
    /// what is measured only where something in the loop reads it.
    pub loop_ticks: bool,
    /// The analogue reading, the interface force and the touch, at each tick of the sensor.
    pub sensor_ticks: bool,
    /// The achieved motion, at each physics step: what a later run can be clamped to.
    pub achieved: bool,
    /// The measured motion, at each physics step.
    pub measured: bool,
}

impl Columns {
    /// What a log would hold.
    pub const LOG: Columns = Columns { loop_ticks: true, sensor_ticks: true, achieved: false, measured: false };
    /// Only what the force sensor would say.
    pub const FORCE: Columns = Columns { loop_ticks: false, sensor_ticks: true, achieved: false, measured: false };
    /// Only the robot's path.
    pub const PATH: Columns = Columns { loop_ticks: false, sensor_ticks: false, achieved: true, measured: true };
}

/// The columns of a run.
#[derive(Debug, Clone)]
pub struct Trace<S: Space> {
    /// Time of each tick of the loop.
    pub loop_time: Vec<Nanos>,
    /// Commanded motion, before the tick's force acts.
    pub commanded: Vec<S::Motion>,
    /// The command as received at this tick.
    pub received: Vec<Received<S>>,
    /// Pose reported at this tick, without read-out noise.
    pub measured: Vec<S::Motion>,
    /// Motion of the satellites after this tick's force acted.
    pub after: Vec<S::Motion>,
    /// Net force at this tick; positive resists closing.
    pub feedback: Vec<S::Wrench>,
    /// Time of each tick of the sensor.
    pub sensor_time: Vec<Nanos>,
    /// Reading.
    pub sensed: Vec<S::Wrench>,
    /// Force at the interface; positive resists penetration.
    pub interface: Vec<S::Wrench>,
    /// Penetration.
    pub touch: Vec<S::Touch>,
    /// Achieved motion at each physics step.
    pub achieved: Vec<S::Motion>,
    /// Measured motion at each physics step.
    pub measured_steps: Vec<S::Motion>,
}

impl<S: Space> Default for Trace<S> {
    fn default() -> Self {
        Trace {
            loop_time: Vec::new(),
            commanded: Vec::new(),
            received: Vec::new(),
            measured: Vec::new(),
            after: Vec::new(),
            feedback: Vec::new(),
            sensor_time: Vec::new(),
            sensed: Vec::new(),
            interface: Vec::new(),
            touch: Vec::new(),
            achieved: Vec::new(),
            measured_steps: Vec::new(),
        }
    }
}

impl<S: Space> Trace<S> {
    /// Empties all columns and keeps their memory, so that the next run allocates nothing.
    pub fn clear(&mut self) {
        self.loop_time.clear();
        self.commanded.clear();
        self.received.clear();
        self.measured.clear();
        self.after.clear();
        self.feedback.clear();
        self.sensor_time.clear();
        self.sensed.clear();
        self.interface.clear();
        self.touch.clear();
        self.achieved.clear();
        self.measured_steps.clear();
    }

    /// Room for this many ticks and steps.
    pub fn reserve(&mut self, columns: Columns, loop_ticks: usize, sensor_ticks: usize, steps: usize) {
        if columns.loop_ticks {
            self.loop_time.reserve(loop_ticks);
            self.commanded.reserve(loop_ticks);
            self.received.reserve(loop_ticks);
            self.measured.reserve(loop_ticks);
            self.after.reserve(loop_ticks);
            self.feedback.reserve(loop_ticks);
        }
        if columns.sensor_ticks {
            self.sensor_time.reserve(sensor_ticks);
            self.sensed.reserve(sensor_ticks);
            self.interface.reserve(sensor_ticks);
            self.touch.reserve(sensor_ticks);
        }
        if columns.achieved {
            self.achieved.reserve(steps);
        }
        if columns.measured {
            self.measured_steps.reserve(steps);
        }
    }

    /// Writes down one tick of the loop.
    pub(crate) fn loop_tick(&mut self, now: Nanos, signals: &Signals<S>, after: S::Motion) {
        self.loop_time.push(now);
        self.commanded.push(signals.commanded);
        self.received.push(signals.received);
        self.measured.push(signals.measured);
        self.after.push(after);
        self.feedback.push(signals.feedback);
    }

    /// Writes down one tick of the sensor.
    pub(crate) fn sensor_tick(&mut self, now: Nanos, signals: &Signals<S>, reading: S::Wrench) {
        self.sensor_time.push(now);
        self.sensed.push(reading);
        self.interface.push(signals.interface);
        self.touch.push(signals.touch);
    }
}

/// A hash of bits, in the order in which they are put in. Two runs are the same if and only if their bits are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fingerprint(u64, u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Fingerprint(0x243f_6a88_85a3_08d3, 0x1319_8a2e_0370_7344)
    }
}

impl Fingerprint {
    /// Takes the bits of a number in; only here, -0 counts as 0.
    pub fn take(&mut self, value: f64) {
        let bits = if value == 0.0 { 0 } else { value.to_bits() };
        self.0 = (self.0 ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31);
        self.1 = (self.1 ^ self.0.rotate_left(17)).wrapping_mul(0xd6e8_feb8_6659_fd93) ^ bits.rotate_left(7);
    }

    /// As 32 hexadecimal digits.
    pub fn hex(&self) -> alloc::string::String {
        alloc::format!("{:016x}{:016x}", self.0, self.1)
    }
}

/// What has bits to be taken in.
pub trait Bits {
    /// Takes all of them in, in one order.
    fn take_into(&self, print: &mut Fingerprint);
}

impl Bits for f64 {
    fn take_into(&self, print: &mut Fingerprint) {
        print.take(*self);
    }
}

impl Bits for AxisMotion {
    fn take_into(&self, print: &mut Fingerprint) {
        [self.position_m, self.velocity_m_per_s, self.pitch_rad].iter().for_each(|&value| print.take(value));
    }
}

impl Bits for AxisTouch {
    fn take_into(&self, print: &mut Fingerprint) {
        [self.depth_m, self.rate_m_per_s].iter().for_each(|&value| print.take(value));
    }
}

impl Bits for Motion {
    fn take_into(&self, print: &mut Fingerprint) {
        let vectors = self.position_m.iter().chain(&self.velocity_m_per_s).chain(&self.rate_rad_per_s);
        vectors.chain(&self.attitude.coords).for_each(|&value| print.take(value));
    }
}

impl Bits for Wrench {
    fn take_into(&self, print: &mut Fingerprint) {
        self.force_n.iter().chain(&self.torque_n_m).for_each(|&value| print.take(value));
    }
}

impl Bits for Touch {
    fn take_into(&self, print: &mut Fingerprint) {
        let vectors = self.normal.iter().chain(&self.point_m).chain(&self.arm_m).chain(&self.slip_m_per_s);
        [self.depth_m, self.rate_m_per_s].iter().chain(vectors).for_each(|&value| print.take(value));
    }
}

impl<S: Space> Trace<S>
where
    S::Motion: Bits,
    S::Wrench: Bits,
    S::Touch: Bits,
{
    /// The fingerprint of everything that a log of this run would hold.
    pub fn fingerprint(&self) -> Fingerprint {
        let mut print = Fingerprint::default();
        let motions = [&self.commanded, &self.measured, &self.after, &self.achieved, &self.measured_steps];
        motions.into_iter().flatten().for_each(|motion| motion.take_into(&mut print));
        let loads = [&self.feedback, &self.sensed, &self.interface];
        loads.into_iter().flatten().for_each(|load| load.take_into(&mut print));
        self.touch.iter().for_each(|touch| touch.take_into(&mut print));
        print
    }
}
