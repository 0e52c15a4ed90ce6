//! One tick of the sampled loop as a linear map.
//!
//! Between two ticks the achieved pose is piecewise a jump or a line, behind it the robot and the filter are linear: each piece
//! is carried by a matrix exponential of (u, u', p, p', g, g'). Pieces end at jumps, at force samples and where the pose is
//! read, so that nothing is interpolated.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u | pose asked of the robot, as it arrives | m |
//! | p | pose that the robot has | m |
//! | g | filtered force | N |
//! | age | time before the tick | s |

use super::sampled::{Arrival, Issue, SampledLoop, SecondOrder, Seen};
use crate::plant::PointIntegrator;
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::PI;
use nalgebra::{DMatrix, Matrix6, Vector6};

/// Ages that differ by less than this share of a tick are one instant.
const SAME: f64 = 1e-9;

/// A piece of the time between two ticks.
struct Piece {
    carry: Matrix6<f64>,
    /// Age of its begin and of its end, in ticks.
    begin: f64,
    end: f64,
    sampled: bool,
    read: bool,
}

/// All that does not depend on the damping.
pub(super) struct Tick {
    pieces: Vec<Piece>,
    /// From the time for which a position is valid to its arrival, in ticks.
    late: f64,
    /// A reading at the instant of a jump sees the pose after it.
    fresh: bool,
    line: bool,
    direct: bool,
    positions: usize,
    poses: usize,
    samples: usize,
    newest_sample: usize,
    pose_read: usize,
}

/// The state, in parts.
struct State<'a> {
    positions: &'a [f64],
    speed: f64,
    inner: &'a [f64],
    poses: &'a [f64],
    samples: &'a [f64],
}

impl Tick {
    pub(super) fn new(sampled: &SampledLoop) -> Tick {
        let tick = sampled.tick_s;
        let issued = match sampled.issue {
            Issue::AsComputed => -1.0,
            Issue::BeforeReading | Issue::WhenValid => 0.0,
            Issue::OneTickLate => 1.0,
        };
        let travel = if sampled.arrival == Arrival::LineFrom { 1.0 } else { 0.0 };
        let late = whole(issued + travel + sampled.dead_time_s / tick);
        let per_tick = sampled.sensing.samples_per_tick as f64;
        let (newest_sample, sample_age) = split(sampled.sensing.age_s / tick * per_tick);
        let (pose_read, read_age) = split(sampled.readout_s / tick);
        let ages = (0..sampled.sensing.samples_per_tick).map(|i| (i as f64 + sample_age) / per_tick);
        let sample_ages: Vec<f64> = ages.collect();
        let jump = libm::ceil(late) - late;
        let mut stops = sample_ages.clone();
        stops.extend([0.0, 1.0, read_age, jump]);
        stops.sort_by(|a, b| b.total_cmp(a));
        stops.dedup_by(|a, b| near(*a, *b));
        let rates = rates(sampled);
        let piece = |ends: &[f64]| Piece {
            carry: exponential(&(rates * ((ends[0] - ends[1]) * tick))),
            begin: ends[0],
            end: ends[1],
            sampled: sample_ages.iter().any(|&age| near(age, ends[1])),
            read: near(read_age, ends[1]),
        };
        Tick {
            pieces: stops.windows(2).map(piece).collect(),
            late,
            fresh: sampled.issue == Issue::BeforeReading,
            line: sampled.arrival != Arrival::Hold,
            direct: sampled.arrival == Arrival::Hold && sampled.robot.is_none() && sampled.sensing.low_pass.is_none(),
            positions: libm::ceil(late + 1.0) as usize + 2,
            poses: pose_read + 2,
            samples: (newest_sample + sampled.sensing.averaged).max(sampled.sensing.samples_per_tick),
            newest_sample,
            pose_read,
        }
    }

    /// The matrix of one tick.
    pub(super) fn monodromy(&self, sampled: &SampledLoop) -> DMatrix<f64> {
        let size = self.positions + 5 + self.poses + self.samples;
        let mut unit = vec![0.0; size];
        let mut matrix = DMatrix::zeros(size, size);
        for column in 0..size {
            unit[column] = 1.0;
            let next = self.step(sampled, &unit);
            matrix.column_mut(column).copy_from_slice(&next);
            unit[column] = 0.0;
        }
        matrix
    }

    fn parts<'a>(&self, state: &'a [f64]) -> State<'a> {
        let (positions, rest) = state.split_at(self.positions);
        let (inner, rest) = rest.split_at(5);
        let (poses, samples) = rest.split_at(self.poses);
        State { positions, speed: inner[0], inner: &inner[1..], poses, samples }
    }

    /// From tick n - 1 (just done, so that position and speed of n are known) to tick n done.
    fn step(&self, sampled: &SampledLoop, state: &[f64]) -> Vec<f64> {
        let state = self.parts(state);
        let mut flow = Vector6::new(0.0, 0.0, state.inner[0], state.inner[1], state.inner[2], state.inner[3]);
        let (mut samples, mut poses) = (state.samples.to_vec(), state.poses.to_vec());
        for piece in &self.pieces {
            (flow[0], flow[1]) = self.asked(state.positions, piece, sampled.tick_s);
            flow = piece.carry * flow;
            if piece.sampled {
                samples.rotate_right(1);
                samples[0] = self.force(sampled, state.positions, &flow, piece.end);
            }
            if piece.read {
                poses.rotate_right(1);
                poses[0] = match sampled.robot {
                    Some(_) => flow[2],
                    None => self.pose(state.positions, piece.end),
                };
            }
        }
        let acceleration = -self.feedback(sampled, &state, &samples, &poses) / sampled.mass_kg;
        let (tick, position, speed) = (sampled.tick_s, state.positions[0], state.speed);
        let next_speed = speed + acceleration * tick;
        let next_position = match sampled.integrator {
            PointIntegrator::SemiImplicit => position + next_speed * tick,
            PointIntegrator::ExactHold => position + speed * tick + 0.5 * acceleration * tick * tick,
            PointIntegrator::Explicit => position + speed * tick,
        };
        let mut next = vec![next_position];
        next.extend(&state.positions[..self.positions - 1]);
        next.push(next_speed);
        // Dynamics that are not there keep no state, which would be an eigenvalue of 1.
        next.extend(if sampled.robot.is_some() { [flow[2], flow[3]] } else { [0.0; 2] });
        next.extend(if sampled.sensing.low_pass.is_some() { [flow[4], flow[5]] } else { [0.0; 2] });
        next.extend(poses);
        next.extend(samples);
        next
    }

    /// Pose and rate asked of the robot at the beginning of a piece.
    fn asked(&self, positions: &[f64], piece: &Piece, tick_s: f64) -> (f64, f64) {
        let middle = 0.5 * (piece.begin + piece.end) + self.late;
        if !self.line {
            return (positions[libm::ceil(middle).max(0.0) as usize], 0.0);
        }
        let newer = libm::floor(middle) as usize;
        let (to, from) = (positions[newer], positions[newer + 1]);
        let share = piece.begin + self.late - newer as f64;
        (to + (from - to) * share, (to - from) / tick_s)
    }

    /// The achieved pose at an age, without robot dynamics.
    fn pose(&self, positions: &[f64], age: f64) -> f64 {
        let back = whole(age + self.late);
        if self.line {
            let newer = libm::floor(back) as usize;
            let share = back - newer as f64;
            return positions[newer] + (positions[newer + 1] - positions[newer]) * share;
        }
        let jumped = if self.fresh { libm::ceil(back) } else { libm::floor(back) + 1.0 };
        positions[jumped.max(0.0) as usize]
    }

    fn force(&self, sampled: &SampledLoop, positions: &[f64], flow: &Vector6<f64>, age: f64) -> f64 {
        if sampled.sensing.low_pass.is_some() {
            return flow[4];
        }
        if self.direct {
            return sampled.hardware_stiffness_n_per_m * self.pose(positions, age);
        }
        let (pose, rate) = if sampled.robot.is_some() { (flow[2], flow[3]) } else { (flow[0], flow[1]) };
        sampled.hardware_stiffness_n_per_m * pose + sampled.hardware_damping_n_s_per_m * rate
    }

    fn feedback(&self, sampled: &SampledLoop, state: &State<'_>, samples: &[f64], poses: &[f64]) -> f64 {
        let averaged = sampled.sensing.averaged;
        let felt: f64 =
            samples[self.newest_sample..self.newest_sample + averaged].iter().sum::<f64>() / averaged as f64;
        let measured = poses[self.pose_read];
        let pose = if sampled.stiffness_on == Seen::Measured { measured } else { state.positions[0] };
        let rate = match sampled.damping_on {
            Seen::Measured => (measured - poses[self.pose_read + 1]) / sampled.tick_s,
            Seen::Commanded => state.speed,
        };
        let added = sampled.virtual_stiffness_n_per_m * pose + sampled.virtual_damping_n_s_per_m * rate;
        felt + added + sampled.own_damping_n_s_per_m * state.speed
    }
}

/// A number of ticks without the rounding of its quotient.
fn whole(ticks: f64) -> f64 {
    let nearest = libm::round(ticks);
    if near(ticks, nearest) { nearest } else { ticks }
}

/// Whole ticks and the rest.
fn split(ticks: f64) -> (usize, f64) {
    let ticks = whole(ticks);
    let whole = libm::floor(ticks);
    (whole as usize, ticks - whole)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < SAME
}

/// Rates of (u, u', p, p', g, g').
fn rates(sampled: &SampledLoop) -> Matrix6<f64> {
    let mut rates = Matrix6::zeros();
    rates[(0, 1)] = 1.0;
    let mut pose = 0;
    if let Some(robot) = sampled.robot {
        second_order(&mut rates, robot, 2);
        rates[(3, 0)] = square(robot);
        pose = 2;
    }
    if let Some(low_pass) = sampled.sensing.low_pass {
        second_order(&mut rates, low_pass, 4);
        rates[(5, pose)] = square(low_pass) * sampled.hardware_stiffness_n_per_m;
        rates[(5, pose + 1)] = square(low_pass) * sampled.hardware_damping_n_s_per_m;
    }
    rates
}

fn square(part: SecondOrder) -> f64 {
    let rate = 2.0 * PI * part.natural_frequency_hz;
    rate * rate
}

fn second_order(rates: &mut Matrix6<f64>, part: SecondOrder, at: usize) {
    rates[(at, at + 1)] = 1.0;
    rates[(at + 1, at)] = -square(part);
    rates[(at + 1, at + 1)] = -2.0 * part.damping_ratio * 2.0 * PI * part.natural_frequency_hz;
}

/// e^M by its series on a matrix halved until it is small, then squared back.
fn exponential(matrix: &Matrix6<f64>) -> Matrix6<f64> {
    let mut halvings = 0;
    let mut small = *matrix;
    while small.abs().max() > 0.05 && halvings < 60 {
        small *= 0.5;
        halvings += 1;
    }
    let (mut sum, mut term) = (Matrix6::identity(), Matrix6::identity());
    // The sixfold norm is below 0.3, so that the 17th term is below rounding.
    for order in 1..=16 {
        term = term * small / f64::from(order);
        sum += term;
    }
    for _ in 0..halvings {
        sum = sum * sum;
    }
    sum
}
