//! The stretches of a recording on which our software is judged.
//!
//! Where a command, a pose or a reading is missing, what the software had is not known. It begins anew after it: along a stretch
//! `x₊ - 2x + x₋ = -(F + F₋) T² / (2m)` must add up. What a gap hides is found by asking what would be otherwise if that which is
//! missing were otherwise; a compensator that never forgets leaves nothing to judge.
//!
//! Not covered: a compensation that moves the command, which then does not tell where the satellites are.

use super::gaps::Gaps;
use super::paths::{LeftOver, Paths, Stretch};
use super::score::path_delay_s;
use super::software::{Balance, FELT_N, Inputs, balances, recomputed};
use crate::case::{Case, Settled};
use crate::missing::Has;
use crate::model::{Chosen, Model};

/// How far a missing command and a missing reading are moved to see what hangs on them: a few cycles of an approach, and more
/// than a sample's worth of any contact.
const MOVED_M: f64 = 1e-3;
const MOVED_N: f64 = 10.0;
/// A force hangs on it from here on: it bends no path by more than rounding.
const HANGS_N: f64 = 1e-6;
/// Bend of the path of commands that is rounding, beside that of their own wire, in m.
pub(super) const BEND_M: f64 = 1e-12;

/// What the rounding of commands on their wire leaves of a path whose best straight line is taken out: half a step of each axis that
/// is rounded, and as much again where the line follows it.
pub(super) fn rounding_m(case: &Case) -> f64 {
    2.0 * case.command_quantum_m
}

/// The same recording on a robot that holds also where it did not hear a command.
pub(super) fn held(case: &Case) -> Case {
    let mut held = case.clone();
    held.settled.held.resize(case.commanded.len(), false);
    case.settled.unheard.iter().for_each(|tick| held.settled.held[*tick] = true);
    held
}

/// Whether a tick lacks anything.
pub(super) fn lacks(case: &Case, tick: usize) -> bool {
    let has = |all: &[Has], at: usize| all.get(at).is_none_or(|has| *has == Has::Sample);
    let reading = sample_of(case, tick).is_none_or(|sample| has(&case.missing.reading, sample));
    !(has(&case.missing.command, tick) && has(&case.missing.pose, tick) && reading)
}

/// The sample that carries a tick's own stamp, or the last one before it.
pub(super) fn sample_of(case: &Case, tick: usize) -> Option<usize> {
    let since = tick as i64 * case.rates.loop_period.0 - case.rates.sensor_phase.0;
    usize::try_from(since.div_euclid(case.rates.sensor_period.0)).ok()
}

/// Ticks from a command to its report.
pub(super) fn round_trip(model: &Model, case: &Case, effects: &[Chosen]) -> usize {
    libm::ceil(path_delay_s(model, effects) / case.rates.loop_period.seconds()).max(0.0) as usize
}

/// Which ticks of a recording can be judged.
pub struct Judged {
    /// Ticks whose net force is not known.
    unsure: Vec<bool>,
    balances: Vec<Option<Balance>>,
    step_m_per_n: f64,
}

impl Judged {
    /// The whole recording, as if nothing were missing in it.
    pub(super) fn whole(model: &Model, case: &Case, inputs: &Inputs<'_>) -> Self {
        let balances = balances(model, case, inputs).into_iter().map(Some).collect();
        Judged { balances, ..Judged::nowhere(case, inputs) }
    }

    /// Nothing yet.
    fn nowhere(case: &Case, inputs: &Inputs<'_>) -> Self {
        let period_s = case.rates.loop_period.seconds();
        let step_m_per_n = period_s * period_s / (2.0 * case.mass_kg * inputs.mass_ratio);
        Judged { unsure: Vec::new(), balances: Vec::new(), step_m_per_n }
    }

    /// Of the model as it stands.
    pub fn of(model: &Model, case: &Case, effects: &[Chosen]) -> Self {
        Judged::with(model, case, &Inputs::plain(effects))
    }

    /// Whether anything is missing, so that it must be asked which.
    pub(super) fn is_needed(case: &Case) -> bool {
        let Settled { unheard, resumed, .. } = &case.settled;
        case.missing.any() || !(unheard.is_empty() && resumed.is_empty())
    }

    pub(super) fn with(model: &Model, case: &Case, inputs: &Inputs<'_>) -> Self {
        let case = &held(case);
        let inputs = &Inputs { clamped: true, ..*inputs };
        let mut judged = Judged { unsure: unsure(model, case, inputs), ..Judged::nowhere(case, inputs) };
        judged.balances = judged.masked(case, balances(model, case, inputs));
        judged
    }

    /// The same ticks with other inputs; the mass stays.
    pub(super) fn again(&self, model: &Model, case: &Case, inputs: &Inputs<'_>) -> Self {
        let case = &held(case);
        let all = balances(model, case, inputs);
        let balances = if self.is_whole() { all.into_iter().map(Some).collect() } else { self.masked(case, all) };
        Judged { unsure: self.unsure.clone(), balances, step_m_per_n: self.step_m_per_n }
    }

    /// Judged anew with other inputs, the mass among them.
    pub(super) fn anew(&self, model: &Model, case: &Case, inputs: &Inputs<'_>) -> Self {
        if self.is_whole() { Judged::whole(model, case, inputs) } else { Judged::with(model, case, inputs) }
    }

    fn is_whole(&self) -> bool {
        self.unsure.is_empty()
    }

    /// Balances of the ticks that can be judged, one for each tick.
    fn masked(&self, case: &Case, all: Vec<Balance>) -> Vec<Option<Balance>> {
        let sure = |tick: usize| {
            !(self.unsure[tick] || self.unsure[tick - 1]) && (tick - 1..=tick + 1).all(|tick| case.trusts_command(tick))
        };
        all.into_iter().enumerate().map(|(nth, balance)| sure(nth + 1).then_some(balance)).collect()
    }

    /// How far the path of the commands is bent beyond what the force does, at each tick that can be judged, in m.
    fn bends_m<'j>(&'j self, case: &'j Case) -> impl Iterator<Item = Option<f64>> + 'j {
        let period_s = case.rates.loop_period.seconds();
        let acted = period_s * period_s / (2.0 * case.mass_kg);
        let one = move |balance: &Balance| balance.felt_n * self.step_m_per_n - balance.acted_n * acted;
        self.balances.iter().map(move |balance| balance.as_ref().map(one))
    }

    /// The first tick at which the force does not bend the path of the commands as it should.
    pub(super) fn first_unbalanced(&self, case: &Case) -> Option<usize> {
        let limit_m = BEND_M + 2.0 * case.command_quantum_m;
        self.bends_m(case).position(|bend| bend.is_some_and(|bend_m| bend_m.abs() > limit_m)).map(|nth| nth + 1)
    }

    /// The paths of all stretches, of the ticks of which `counts` is true.
    fn paths(&self, case: &Case, counts: impl Fn(&Balance) -> bool) -> Paths {
        let period_s = case.rates.loop_period.seconds();
        let acted = period_s * period_s / (2.0 * case.mass_kg);
        let (mut paths, mut stretch) = (Paths::default(), Stretch::default());
        for balance in &self.balances {
            match balance.as_ref().filter(|balance| counts(balance)) {
                Some(balance) => {
                    stretch.bend([-balance.acted_n * acted, balance.felt_n * self.step_m_per_n, self.step_m_per_n])
                }
                None => std::mem::take(&mut stretch).end(&mut paths),
            }
        }
        stretch.end(&mut paths);
        paths
    }

    /// Largest difference between the recorded commands and those that follow from where each stretch began.
    pub(super) fn closure_m(&self, case: &Case) -> f64 {
        self.paths(case, |_| true).closure_m()
    }

    /// What is left where a force surely acts, and which mass and bias leave least.
    pub(super) fn left_over(&self, case: &Case) -> LeftOver {
        self.paths(case, |balance| balance.felt_n.abs() > 2.0 * FELT_N).left_over()
    }

    /// What is missing in the recording, and how much was judged; none where nobody needed it.
    pub(super) fn gaps(&self, case: &Case, felt: &[Balance]) -> Option<Gaps> {
        let judged: Vec<bool> = self.balances.iter().map(Option::is_some).collect();
        Gaps::of(case, felt, &judged)
    }
}

/// Ticks at which the net force hangs on something that is missing.
fn unsure(model: &Model, case: &Case, inputs: &Inputs<'_>) -> Vec<bool> {
    let ticks = case.commanded.len();
    let mut unsure = vec![false; ticks];
    case.settled.resumed.iter().for_each(|tick| unsure[*tick] = true);
    let has = |all: &[Has], at: usize| all.get(at).is_none_or(|has| *has == Has::Sample);
    for (tick, unsure) in unsure.iter_mut().enumerate() {
        let reading = sample_of(case, tick).is_none_or(|sample| {
            let at = (sample as i64 + inputs.shift).max(0) as usize;
            has(&case.missing.reading, at)
        });
        // The speed of the reported pose takes the one before too.
        let pose = !model.hears_pose() || (tick.saturating_sub(1)..=tick).all(|tick| has(&case.missing.pose, tick));
        *unsure |= !(reading && pose);
    }
    if case.missing.before > 0 && model.hears_pose() {
        let first = round_trip(model, case, inputs.effects) + 2;
        unsure.iter_mut().take(first).for_each(|unsure| *unsure = true);
    }
    if !case.missing.any() {
        return unsure;
    }
    let plain = recomputed(model, case, inputs).1;
    for sign in [-1.0, 1.0] {
        let there = recomputed(model, &moved(case, sign), inputs).1;
        for (unsure, (here, there)) in unsure.iter_mut().zip(plain.iter().zip(&there)) {
            *unsure |= (here - there).abs() > HANGS_N;
        }
    }
    unsure
}

/// The recording with what is missing in it moved.
fn moved(case: &Case, sign: f64) -> Case {
    let mut moved = case.clone();
    // Where nothing came, the robot may have got what was not recorded.
    for tick in 0..moved.commanded.len() {
        if !case.trusts_command(tick) {
            moved.commanded[tick].position_m += sign * MOVED_M;
            moved.settled.held[tick] = false;
        }
    }
    for (reading_n, has) in moved.sensed_n.value.iter_mut().zip(&case.missing.reading) {
        if *has != Has::Sample {
            *reading_n += sign * MOVED_N;
        }
    }
    moved
}
