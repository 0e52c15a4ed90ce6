//! Pure software architecture (thesis Fig. 3.1): a spring and a dashpot on the commanded pose, behind a dead time of their own.
//!
//! At each tick the impulse of the contact over the last segment of the motion goes into a delay ring, and the impulse whose time
//! has come acts: `F = J / T`, `J = ∫ (k x + b x') dt` over the part of the segment that is in contact.
//!
//! Between two ticks the motion is `x(s) = x₀ + v₀ s + (v₁ - v₀) s² / (2 T)`, which is exact for a force that is held (the exact
//! hold of the plant), so that onset and release are roots of a quadratic and the integral is exact. A force that is sampled instead
//! loses, or invents, a share of the jump b v₀ at onset that is of first order in T; an impulse does not, and the exit velocity
//! is of second order in T.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k, b | stiffness and damping | N/m, N s/m |
//! | h | dead time, a whole number of ticks | s |
//! | T | tick of the loop | s |
//! | x₀, v₀, v₁ | commanded position and velocity at the beginning, velocity at the end | m, m/s |
//!
//! Not modelled: a robot, a sensor. Real sampling belongs to a system, and must not be treated so.

use super::{Compensator, Heard};
use crate::delay;
use crate::refusal::{Refusal, not_negative, positive};
use crate::space::{Axis, AxisMotion, Path};
use crate::time::Step;
use alloc::vec;
use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

/// When a contact ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Release {
    /// At zero depth: the dashpot may pull until then.
    ZeroDepth,
    /// At zero force: nothing ever pulls.
    ZeroForce,
}

/// A contact that is computed from the command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Software {
    /// Stiffness k.
    pub stiffness_n_per_m: f64,
    /// Damping b.
    pub damping_n_s_per_m: f64,
    /// Dead time h: a whole number of ticks, at least one.
    pub dead_time_s: f64,
    /// When a contact ends.
    pub release: Release,
}

/// The impulses that are under way.
#[derive(Debug, Clone, PartialEq)]
pub struct SoftwareState {
    /// One for each tick of the dead time.
    impulse_n_s: Vec<f64>,
    head: usize,
    /// None before the first tick.
    before: Option<AxisMotion>,
}

/// `c[0] + c[1] s + c[2] s²`.
type Quadratic = [f64; 3];

impl Software {
    /// Refuses constants without meaning, and a dead time that is not a whole number of ticks.
    pub fn check(&self, period_s: f64) -> Result<(), Refusal> {
        not_negative("stiffness_n_per_m", self.stiffness_n_per_m, "N/m")?;
        not_negative("damping_n_s_per_m", self.damping_n_s_per_m, "N s/m")?;
        positive("dead_time_s", self.dead_time_s, "s")?;
        let ticks = delay::steps(self.dead_time_s, period_s);
        if ticks < 1.0 || ticks - libm::floor(ticks) > 0.0 {
            let limit = "is not a whole number of ticks of the loop";
            return Err(Refusal { name: "dead_time_s", value: self.dead_time_s, unit: "s", limit });
        }
        Ok(())
    }

    /// The impulse of the contact over one tick, from one motion to the next.
    fn impulse_n_s(&self, from: &AxisMotion, to: &AxisMotion, period_s: f64) -> f64 {
        let acceleration = (to.velocity_m_per_s - from.velocity_m_per_s) / period_s;
        let depth: Quadratic = [from.position_m, from.velocity_m_per_s, 0.5 * acceleration];
        let force: Quadratic = [
            self.stiffness_n_per_m * depth[0] + self.damping_n_s_per_m * depth[1],
            self.stiffness_n_per_m * depth[1] + self.damping_n_s_per_m * acceleration,
            self.stiffness_n_per_m * depth[2],
        ];
        let ([a, b], [c, d]) = (roots(&depth), roots(&force));
        let mut edges = [0.0, a, b, c, d, period_s].map(|edge: f64| edge.clamp(0.0, period_s));
        edges.sort_unstable_by(f64::total_cmp);
        let mut sum_n_s = 0.0;
        for edge in edges.windows(2) {
            let middle = 0.5 * (edge[0] + edge[1]);
            let pushes = self.release == Release::ZeroDepth || value(&force, middle) > 0.0;
            if value(&depth, middle) > 0.0 && pushes {
                sum_n_s += integral(&force, edge[1]) - integral(&force, edge[0]);
            }
        }
        sum_n_s
    }
}

impl Compensator<Axis> for Software {
    type State = SoftwareState;

    fn start(&self, _measured: &AxisMotion, period_s: f64) -> SoftwareState {
        let ticks = libm::round(delay::steps(self.dead_time_s, period_s)).max(1.0) as usize;
        SoftwareState { impulse_n_s: vec![0.0; ticks], head: 0, before: None }
    }

    fn feedback(&self, state: &mut SoftwareState, step: Step, heard: Heard<'_, Axis>) -> f64 {
        let period_s = step.dt.seconds();
        let ticks = state.impulse_n_s.len();
        let before = state.before.replace(*heard.commanded).unwrap_or_else(|| {
            // The satellites have been moving along their first motion for ever.
            for (age, impulse_n_s) in state.impulse_n_s.iter_mut().rev().enumerate() {
                let to = heard.commanded.coasted(-((age + 1) as f64) * period_s);
                *impulse_n_s = self.impulse_n_s(&to.coasted(-period_s), &to, period_s);
            }
            heard.commanded.coasted(-period_s)
        });
        state.impulse_n_s[state.head] = self.impulse_n_s(&before, heard.commanded, period_s);
        state.head = (state.head + 1) % ticks;
        state.impulse_n_s[state.head] / period_s
    }

    fn reads_acceleration(&self) -> bool {
        false
    }
}

fn value(of: &Quadratic, s: f64) -> f64 {
    of[0] + s * (of[1] + s * of[2])
}

/// The integral from zero to `s`.
fn integral(of: &Quadratic, s: f64) -> f64 {
    s * (of[0] + s * (0.5 * of[1] + s * of[2] / 3.0))
}

/// Both real roots; infinite where there is none.
fn roots(of: &Quadratic) -> [f64; 2] {
    let [c, b, a] = *of;
    let under = b * b - 4.0 * a * c;
    if under < 0.0 || (a == 0.0 && b == 0.0) {
        return [f64::INFINITY; 2];
    }
    // The sum of two numbers of the same sign: no digits cancel.
    let sum = -0.5 * (b + libm::copysign(libm::sqrt(under), b));
    let first = if a == 0.0 { f64::INFINITY } else { sum / a };
    let second = if sum == 0.0 { first } else { c / sum };
    [first, second]
}
