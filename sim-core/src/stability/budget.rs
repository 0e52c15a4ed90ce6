//! The delay budget: who takes how much of the phase, and what that costs in damping.
//!
//! Each contributor delays a share of the stiffness. To first order the loop sees one delay `τ_eff = Σ kᵢ τᵢ / k` and needs the
//! damping `b = Σ kᵢ τᵢ`; with the second order kept, `b_crit = m ω sin(ω τ_eff)` where `m ω² cos(ω τ_eff) = k`. Against
//! the sampled loop this is good to some 2 %.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m | reduced mass | kg |
//! | k | whole stiffness, hardware and virtual | N/m |
//! | kᵢ | stiffness that the contributor delays | N/m |
//! | τᵢ | by how much | s |
//!
//! Delay on the damping path alone counts in second order only, and is left out.
//! Source: `reference/PHYSICS.md`, section 2.2.

use super::exact::damping_interval;
use super::sampled::Integrator;
use crate::refusal::{Refusal, finite, positive};
use alloc::string::String;
use alloc::vec::Vec;

/// Which part of the stiffness is late by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// What the force sensor feels.
    Hardware,
    /// What the software adds.
    Virtual,
    /// Both: all that is between the satellites and the achieved pose.
    Both,
}

/// Something that makes the force late.
#[derive(Debug, Clone, PartialEq)]
pub struct Contributor {
    /// What it is called.
    pub name: String,
    /// Which stiffness it delays.
    pub path: Path,
    /// By how much. Negative: a lead.
    pub delay_s: f64,
}

/// One line of the budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Who.
    pub contributor: Contributor,
    /// Share of the whole stiffness that is late by it, 0 to 1.
    pub stiffness_share: f64,
    /// Its part of τ_eff.
    pub contribution_s: f64,
    /// Its part of the damping needed, so that the lines add up; `None` if no damping suffices.
    pub damping_n_s_per_m: Option<f64>,
    /// How much less damping would be needed without it; `None` if that cannot be told.
    pub saving_n_s_per_m: Option<f64>,
}

/// The whole budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// One line for each contributor, in the order handed in.
    pub lines: Vec<Line>,
    /// τ_eff.
    pub delay_s: f64,
    /// The damping needed; `None` if no damping suffices.
    pub damping_n_s_per_m: Option<f64>,
}

/// The stiffness of each path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// What the force sensor feels.
    pub hardware_n_per_m: f64,
    /// What the software adds.
    pub virtual_n_per_m: f64,
}

impl Stiffness {
    fn whole_n_per_m(&self) -> f64 {
        self.hardware_n_per_m + self.virtual_n_per_m
    }

    fn share(&self, path: Path) -> f64 {
        let late = match path {
            Path::Hardware => self.hardware_n_per_m,
            Path::Virtual => self.virtual_n_per_m,
            Path::Both => self.whole_n_per_m(),
        };
        late / self.whole_n_per_m()
    }
}

/// The budget of these contributors.
pub fn budget(mass_kg: f64, stiffness: Stiffness, contributors: &[Contributor]) -> Result<Budget, Refusal> {
    positive("mass_kg", mass_kg, "kg")?;
    finite("hardware_stiffness_n_per_m", stiffness.hardware_n_per_m, "N/m")?;
    finite("virtual_stiffness_n_per_m", stiffness.virtual_n_per_m, "N/m")?;
    let whole = positive("stiffness_n_per_m", stiffness.whole_n_per_m(), "N/m")?;
    for contributor in contributors {
        finite("delay_s", contributor.delay_s, "s")?;
    }
    let contribution = |contributor: &Contributor| stiffness.share(contributor.path) * contributor.delay_s;
    let delay_s: f64 = contributors.iter().map(contribution).sum();
    let needed = |delay_s: f64| {
        // A lead needs no damping: the loop without damping already decays.
        if delay_s <= 0.0 {
            return Ok(Some(0.0));
        }
        Ok(damping_interval(mass_kg, whole, delay_s)?.map(|edges| edges.low_n_s_per_m))
    };
    let damping_n_s_per_m = needed(delay_s)?;
    let line = |contributor: &Contributor| {
        let contribution_s = contribution(contributor);
        let without = needed(delay_s - contribution_s)?;
        let share = |needed: f64| if delay_s > 0.0 { needed * contribution_s / delay_s } else { 0.0 };
        Ok(Line {
            contributor: contributor.clone(),
            stiffness_share: stiffness.share(contributor.path),
            contribution_s,
            damping_n_s_per_m: damping_n_s_per_m.map(share),
            saving_n_s_per_m: damping_n_s_per_m.zip(without).map(|(with, without)| with - without),
        })
    };
    let lines = contributors.iter().map(line).collect::<Result<_, _>>()?;
    Ok(Budget { lines, delay_s, damping_n_s_per_m })
}

/// Delay of a second-order low pass or a robot that follows like one, at low frequency: `2 ζ / ω`.
pub fn second_order_delay_s(natural_frequency_hz: f64, damping_ratio: f64) -> f64 {
    2.0 * damping_ratio / (2.0 * core::f64::consts::PI * natural_frequency_hz)
}

/// Delay of the mean of the newest `count` samples.
pub fn mean_delay_s(count: usize, period_s: f64) -> f64 {
    0.5 * (count.max(1) - 1) as f64 * period_s
}

/// Delay by the integration of a force that is held for one tick.
pub fn integrator_delay_s(integrator: Integrator, tick_s: f64) -> f64 {
    match integrator {
        Integrator::SemiImplicit => 0.0,
        Integrator::ExactHold => 0.5 * tick_s,
        Integrator::Explicit => tick_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    fn contributor(name: &str, path: Path, delay_s: f64) -> Contributor {
        Contributor { name: name.to_string(), path, delay_s }
    }

    #[test]
    fn the_lines_add_up() {
        let both = Stiffness { hardware_n_per_m: 533.0, virtual_n_per_m: 533.0 };
        let all = [
            contributor("dead time", Path::Both, 0.016),
            contributor("tick", Path::Both, 0.004),
            contributor("read-out", Path::Virtual, 0.016),
        ];
        let found = budget(63.2, both, &all).unwrap();
        // Half the stiffness has 20 ms and half of it 36 ms.
        assert!((found.delay_s - 0.028).abs() < 1e-15);
        let sum: f64 = found.lines.iter().map(|line| line.damping_n_s_per_m.unwrap()).sum();
        assert!((sum - found.damping_n_s_per_m.unwrap()).abs() < 1e-12);
        assert!((found.lines[2].contribution_s - 0.008).abs() < 1e-15);
        let saved = found.lines[2].saving_n_s_per_m.unwrap();
        assert!((saved - 1066.0 * 0.008).abs() < 0.02 * saved, "about k τ: {saved}");
    }

    #[test]
    fn too_much_delay_is_answered_and_nonsense_refused() {
        let soft = Stiffness { hardware_n_per_m: 1066.0, virtual_n_per_m: 0.0 };
        let found = budget(63.2, soft, &[contributor("far away", Path::Both, 1.0)]).unwrap();
        assert_eq!(found.damping_n_s_per_m, None);
        let lead = budget(63.2, soft, &[contributor("lead", Path::Hardware, -0.01)]).unwrap();
        assert_eq!(lead.damping_n_s_per_m, Some(0.0));
        assert!(budget(63.2, Stiffness { hardware_n_per_m: 0.0, virtual_n_per_m: 0.0 }, &[]).is_err());
        assert!(budget(63.2, soft, &[contributor("broken", Path::Both, f64::NAN)]).is_err());
    }
}
