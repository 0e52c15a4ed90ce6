//! Which effects are missing: greedy forward, by the error on recordings that a fit has not seen, with ties told as ties.
//!
//! Every candidate is refitted together with the base. Candidates are screened by their signature (linear), fitted, and the best
//! of them ranked by leaving one recording out at a time: `d_s` is by how much twice the log predictive density of the left-out
//! recording s rises. After each addition members are pruned and swapped, since the first pick may have imitated two others.

mod ties;
mod visible;

use super::fit::{Fit, Signature, fit, fit_without, predictive, signature};
use super::problem::{Knob, Problem, Scratch, Trial};
use super::quality::{Block, all_blocks, remainder};
pub use super::rules::Rules;
use super::verdict::denies_model;
use crate::model::{Chosen, RigKind};
use rayon::prelude::*;
use sim_core::effect::{Catalog, Kind, Where};
use sim_core::space::Axis;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// A set of effects, fitted and tried on left-out recordings.
#[derive(Debug, Clone)]
pub struct Tried {
    /// The fit on all learning recordings.
    pub fit: Fit,
    /// Twice the negative log predictive density of each run, given the others.
    pub left_out: Vec<f64>,
}

impl Tried {
    /// Ids of the effects, sorted.
    pub fn ids(&self) -> Vec<String> {
        key(&self.fit.trial)
    }

    /// Sum over left-out recordings.
    pub fn total(&self) -> f64 {
        self.left_out.iter().sum()
    }

    /// By how much each left-out recording is better told than by `other`.
    pub fn gains_over(&self, other: &Tried) -> Vec<f64> {
        other.left_out.iter().zip(&self.left_out).map(|(other, own)| other - own).collect()
    }
}

/// One row of a ranking.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// The effect that was added.
    pub id: String,
    /// By how much the fit on all learning recordings improved, in -2 ln p.
    pub gain: f64,
    /// Gains on left-out recordings; empty if it was not among the finalists.
    pub gains: Vec<f64>,
    /// Whether it passed the rules.
    pub accepted: bool,
}

/// What the search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Base values alone.
    pub base: Tried,
    /// The accepted set.
    pub best: Tried,
    /// The ranking at each step.
    pub rankings: Vec<Vec<Ranked>>,
    /// For each effect of the set: itself, then those that tell the recordings as well in its place, best first.
    pub ties: BTreeMap<String, Vec<String>>,
    /// For each effect of the set: sets of several effects that tell the recordings as well in its place.
    pub sets: BTreeMap<String, Vec<Vec<String>>>,
    /// Effects with which the contact is as the model has it, while it is not without them, and which tell the recordings better.
    pub instead: Vec<String>,
    /// Gain on left-out recordings that each effect of the set is worth.
    pub worth: BTreeMap<String, f64>,
    /// For each kind that is not in the set, and its first parameter: the size that these recordings would have shown.
    pub visible: BTreeMap<String, f64>,
}

/// Beyond this multiple of a start, its linear extrapolation is not trusted alone.
const FAR: f64 = 30.0;

/// A search over a catalogue.
pub struct Search<'a> {
    problem: &'a Problem,
    rules: Rules,
    /// Candidates, by id.
    kinds: Vec<&'a Kind<Axis>>,
    runs: Vec<usize>,
    /// Recordings, each with its runs: what is left out together.
    folds: Vec<Vec<usize>>,
    /// How many effects of the start are given: they are fitted, but never taken out.
    given: usize,
    /// What was computed once: additions to a set, and sets that were tried.
    done: Mutex<Done>,
    progress: &'a (dyn Fn(&str) + Sync),
}

/// Results that come up again when members are pruned, swapped and compared: a set is fitted and tried once.
#[derive(Default)]
struct Done {
    /// With the least promise that was followed up.
    additions: BTreeMap<Key, (f64, Vec<(String, Fit)>)>,
    tried: BTreeMap<Key, Tried>,
}

/// The ids of a set, sorted.
type Key = Vec<String>;

fn key(trial: &Trial) -> Key {
    let mut ids: Vec<String> = trial.effects.iter().map(|chosen| chosen.kind.id.to_string()).collect();
    ids.sort();
    ids
}

impl<'a> Search<'a> {
    /// A search over those kinds of the catalogue that can happen on this rig, without the ones that are excluded.
    pub fn new(
        problem: &'a Problem,
        catalog: &'a Catalog<Axis>,
        excluded: &[&str],
        rules: Rules,
        progress: &'a (dyn Fn(&str) + Sync),
    ) -> Self {
        let other_rig = match problem.model.rig {
            RigKind::Docking => Where::Drive,
            RigKind::Drive => Where::Docking,
        };
        let takes_part = |kind: &&Kind<Axis>| kind.rigs != other_rig && !excluded.contains(&kind.id.as_ref());
        let kinds = catalog.kinds().iter().filter(takes_part).collect();
        let runs: Vec<usize> = (0..problem.runs.len()).collect();
        let folds = runs.iter().map(|&run| vec![run]).collect();
        Search { problem, rules, kinds, runs, folds, given: 0, done: Mutex::default(), progress }
    }

    /// Leaves out these runs together.
    #[must_use]
    pub fn with_folds(self, folds: Vec<Vec<usize>>) -> Self {
        Search { folds, ..self }
    }

    /// How many candidates there are.
    pub fn size(&self) -> usize {
        self.kinds.len()
    }

    fn threshold(&self) -> f64 {
        self.rules.gain_min.max(2.0 * libm::log(self.kinds.len().max(1) as f64))
    }

    /// Fits a set on all learning recordings.
    fn fitted(&self, trial: &Trial, warm: Option<&Fit>) -> Fit {
        fit(self.problem, trial, &self.runs, warm, &mut Scratch::default())
    }

    /// Leaves each recording out in turn.
    fn tried(&self, fit_all: Fit) -> Tried {
        let key = key(&fit_all.trial);
        if let Some(tried) = self.remembered(|done| done.tried.get(&key).cloned()) {
            return tried;
        }
        let left_out: Vec<f64> = self.folds.par_iter().map(|left| self.fold(&fit_all, left)).collect();
        let tried = Tried { fit: fit_all, left_out };
        self.remembered(|done| done.tried.insert(key, tried.clone()));
        tried
    }

    fn remembered<T>(&self, with: impl FnOnce(&mut Done) -> T) -> T {
        // A poisoned lock means that another thread has panicked: its panic is the one to report.
        with(&mut self.done.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn fold(&self, fit_all: &Fit, left: &[usize]) -> f64 {
        let others: Vec<usize> = self.runs.iter().copied().filter(|run| !left.contains(run)).collect();
        let mut scratch = Scratch::default();
        let without = fit_without(self.problem, fit_all, &others, &mut scratch);
        predictive(fit_all, &without)
    }

    /// The whole search, from this set on.
    pub fn run(mut self, start: &Trial) -> Found {
        self.given = start.effects.len();
        (self.progress)("fitting the base values");
        let base = self.tried(self.fitted(start, None));
        let mut best = base.clone();
        let mut rankings = Vec::new();
        for step in 0..self.rules.effects_max {
            (self.progress)(&format!("step {}: trying {} effects", step + 1, self.kinds.len()));
            let (mut ranking, mut next) = self.extend(&best, &rankings);
            if next.is_none() && !rankings.is_empty() && self.leaves_something(&best) {
                // What imitated an accepted effect may be there beside it: as long as something is left, it is no shadow.
                (ranking, next) = self.extend(&best, &[]);
            }
            rankings.push(ranking);
            let Some(next) = next else { break };
            best = self.prune(self.swap(next));
        }
        (self.progress)("looking for ties");
        let (ties, worth) = self.ties(&base, &best);
        let sets = self.equivalent_sets(&best);
        let visible = self.visible(&best);
        let instead = self.instead(&best);
        Found { base, best, rankings, ties, sets, instead, worth, visible }
    }

    /// Tries every effect on top of a set.
    fn extend(&self, current: &Tried, before: &[Vec<Ranked>]) -> (Vec<Ranked>, Option<Tried>) {
        let mut fits = self.additions(current, 0.0);
        fits.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let mut ranking: Vec<Ranked> = fits
            .iter()
            .map(|(id, fit)| Ranked {
                id: id.clone(),
                gain: current.fit.cost - fit.cost,
                gains: Vec::new(),
                accepted: false,
            })
            .collect();
        let mut finalists: Vec<(usize, Tried)> = Vec::new();
        for (row, (id, fit)) in fits.iter().enumerate() {
            if self.is_shadow(id, ranking[row].gain, before) {
                continue;
            }
            // What the fit itself puts far behind cannot lead on left-out recordings, nor tie.
            let near = ranking[row].gain > (self.rules.gain_min / 2.0).max(self.rules.near_share * ranking[0].gain);
            if finalists.len() < self.rules.finalists && near {
                finalists.push((row, self.tried(fit.clone())));
            }
        }
        for (row, tried) in &finalists {
            ranking[*row].gains = tried.gains_over(current);
        }
        finalists.sort_by(|a, b| a.1.total().total_cmp(&b.1.total()));
        // Among those that tell the recordings equally well the one that leaves the contact as the model has it goes first, then
        // the one with fewer parameters.
        let pick = finalists.first().and_then(|(_, lead)| {
            let order = |tried: &Tried| (self.denies_model(tried), tried.fit.knobs.len());
            let near = finalists.iter().filter(|(_, tried)| {
                tried.total() - lead.total() <= self.rules.tie_max
                    || self.is_simpler(tried, lead, current)
                    || self.is_vaguer(lead, tried, current)
            });
            near.min_by(|(_, a), (_, b)| order(a).cmp(&order(b)).then(a.total().total_cmp(&b.total())))
        });
        let mut next = None;
        if let Some((row, tried)) = pick {
            let extra = tried.fit.knobs.len() - current.fit.knobs.len();
            let told = !self.is_nought(&tried.fit) && !is_at_limit(&tried.fit);
            if told && self.accepts(&ranking[*row].gains, ranking[*row].gain, extra) {
                ranking[*row].accepted = true;
                next = Some(tried.clone());
            }
        }
        (ranking, next)
    }

    fn denies_model(&self, tried: &Tried) -> bool {
        denies_model(&self.problem.model, &tried.fit)
    }

    /// Whether it needs no value of the contact that the model denies, while the other does, and tells the recordings all but as
    /// well: such a value bends to whatever else is there.
    fn is_simpler(&self, tried: &Tried, other: &Tried, before: &Tried) -> bool {
        let worth = before.total() - other.total();
        tried.total() - other.total() <= self.rules.simpler_share * worth
            && self.denies_model(other)
            && !self.denies_model(tried)
    }

    /// Whether the last effect of one set has a parameter that the recordings do not tell, while the other's does without it and tells
    /// the recordings all but as well.
    fn is_vaguer(&self, lead: &Tried, other: &Tried, before: &Tried) -> bool {
        let last = lead.fit.trial.effects.len() - 1;
        let vague = |knob: &&Knob| {
            let estimate = lead.fit.estimate(knob);
            estimate.is_some_and(|(value, sd)| sd.is_nan() || 2.0 * sd > value.abs())
        };
        let own = |knob: &&Knob| matches!(knob, Knob::Effect(effect, _) if *effect == last);
        other.fit.knobs.len() < lead.fit.knobs.len()
            && lead.fit.knobs.iter().filter(own).any(|knob| vague(&knob))
            && other.total() - lead.total() <= self.rules.simpler_share * (before.total() - lead.total())
    }

    fn blocks(&self, fit: &Fit) -> Vec<Vec<Block>> {
        all_blocks(self.problem, &fit.trial, &fit.nuisances)
    }

    /// Whether the recordings show more than this set.
    fn leaves_something(&self, tried: &Tried) -> bool {
        self.problem.model.rig == RigKind::Docking && remainder(self.problem, &self.blocks(&tried.fit)).is_some()
    }

    /// Whether the size of the last effect cannot be told from none: then its gain is what the set before had left unfitted.
    fn is_nought(&self, fit: &Fit) -> bool {
        let Some(chosen) = fit.trial.effects.last() else { return false };
        let size = chosen.kind.size();
        let estimate = fit.estimate(&Knob::Effect(fit.trial.effects.len() - 1, size));
        let far = |(value, sd): (f64, f64)| (value - chosen.kind.params[size].off).abs() / sd;
        estimate.filter(|(_, sd)| sd.is_finite()).is_some_and(|estimate| far(estimate) < self.rules.significance)
    }

    /// Whether an effect that imitated an accepted one would now be added for a trifle.
    fn is_shadow(&self, id: &str, gain: f64, before: &[Vec<Ranked>]) -> bool {
        before.iter().any(|ranking| {
            let accepted = ranking.iter().find(|row| row.accepted);
            let own = ranking.iter().find(|row| row.id == id);
            accepted.zip(own).is_some_and(|(accepted, own)| {
                own.gain > self.rules.shadow_gain * accepted.gain && gain < self.rules.shadow_worth * accepted.gain
            })
        })
    }

    /// Whether gains on left-out recordings are enough.
    fn accepts(&self, gains: &[f64], gain: f64, parameters: usize) -> bool {
        let samples: usize = self.runs.iter().map(|&run| self.problem.samples(run)).sum();
        let (sum, z) = sum_and_z(gains);
        let better = gains.iter().filter(|gain| **gain > 0.0).count();
        let worst = gains.iter().copied().fold(f64::INFINITY, f64::min);
        let many = gains.len() >= 4 && better + 1 >= gains.len() && worst > -2.0;
        let losses: f64 = gains.iter().filter(|gain| **gain < 0.0).sum();
        let certain =
            sum > self.rules.gain_certain && -losses < self.rules.tie_max + self.rules.loss_share * (sum - losses);
        let enough = gain > self.threshold() && gain > parameters as f64 * libm::log(samples.max(2) as f64) / 2.0;
        sum > self.threshold() && (z > 2.0 || many || certain) && enough
    }

    /// Every effect that is not in the set, fitted on top of it from its most promising starts; those that are far from gaining
    /// `wanted` are not fitted.
    fn additions(&self, current: &Tried, wanted: f64) -> Vec<(String, Fit)> {
        let key = key(&current.fit.trial);
        let least = self.rules.promise_min.max(self.rules.promise_share * wanted);
        let known = self.remembered(|done| done.additions.get(&key).cloned());
        if let Some((_, fits)) = known.filter(|(screened, _)| *screened <= least) {
            return fits;
        }
        let there = current.ids();
        let absent: Vec<&&Kind<Axis>> =
            self.kinds.iter().filter(|kind| !there.contains(&kind.id.to_string())).collect();
        let fit = |kind: &&&Kind<Axis>| self.addition(&current.fit, kind, least).map(|fit| (kind.id.to_string(), fit));
        let fits: Vec<(String, Fit)> = absent.par_iter().filter_map(fit).collect();
        self.remembered(|done| done.additions.insert(key, (least, fits.clone())));
        fits
    }

    fn addition(&self, current: &Fit, kind: &Kind<Axis>, least: f64) -> Option<Fit> {
        let mut promising: Vec<(f64, Chosen)> =
            starts(kind).into_iter().flat_map(|chosen| self.promise(current, chosen)).collect();
        promising.sort_by(|a, b| b.0.total_cmp(&a.0));
        promising.first().filter(|(gain, _)| *gain > least)?;
        let fits = promising.iter().take(2).map(|(_, chosen)| {
            let mut trial = current.trial.clone();
            trial.effects.push(chosen.clone());
            self.fitted(&trial, Some(current))
        });
        fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// The linear gain of an effect at a start: the start moved to the size that the data ask for, and, where that is far away, the
    /// start itself, since so far away nothing is linear.
    fn promise(&self, current: &Fit, chosen: Chosen) -> Vec<(f64, Chosen)> {
        let Signature { information, gradient } = self.signature(current, &chosen);
        if !(information > 0.0 && information.is_finite()) {
            return Vec::new();
        }
        let amplitude = -gradient / information;
        let at = chosen.kind.size();
        let param = &chosen.kind.params[at];
        let gain = if amplitude > 0.0 { gradient * gradient / information } else { 0.0 };
        // Only a size that is zero when off can be scaled; one in the wrong direction stays where it is: the residual may be of
        // another shape.
        if amplitude <= 0.05 || param.off != 0.0 {
            return vec![(gain, chosen)];
        }
        let mut moved = chosen.clone();
        moved.values[at] = (amplitude * moved.values[at]).clamp(param.lower, param.upper);
        let mut both = vec![(gain, moved)];
        if amplitude > FAR {
            both.push((0.5 * gain, chosen));
        }
        both
    }

    fn signature(&self, current: &Fit, chosen: &Chosen) -> Signature {
        signature(self.problem, current, &self.runs, chosen, &mut Scratch::default())
    }

    /// Takes out every member that the left-out recordings do not miss.
    fn prune(&self, mut best: Tried) -> Tried {
        loop {
            if best.fit.trial.effects.len() < self.given + 2 {
                return best;
            }
            let without = self.without_each(&best);
            let cheapest = without.into_iter().min_by(|a, b| a.total().total_cmp(&b.total()));
            match cheapest {
                Some(smaller) if smaller.total() - best.total() <= self.threshold() => best = smaller,
                _ => return best,
            }
        }
    }

    fn without_each(&self, best: &Tried) -> Vec<Tried> {
        (self.given..best.fit.trial.effects.len()).map(|member| self.without(best, member)).collect()
    }

    fn without(&self, best: &Tried, member: usize) -> Tried {
        let mut trial = best.fit.trial.clone();
        trial.effects.remove(member);
        let known = self.remembered(|done| done.tried.get(&key(&trial)).cloned());
        known.unwrap_or_else(|| self.tried(self.fitted(&trial, Some(&best.fit))))
    }

    /// Replaces members by others while the left-out recordings gain from it.
    fn swap(&self, mut best: Tried) -> Tried {
        if best.fit.trial.effects.len() < self.given + 2 {
            return best;
        }
        for _ in 0..2 {
            let mut better: Option<Tried> = None;
            for member in self.given..best.fit.trial.effects.len() - 1 {
                let smaller = self.without(&best, member);
                let mut fits = self.additions(&smaller, smaller.fit.cost - best.fit.cost);
                fits.retain(|(_, fit)| fit.cost < best.fit.cost - self.rules.tie_max);
                fits.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
                for (_, fit) in fits.into_iter().take(2) {
                    let tried = self.tried(fit);
                    if tried.total() < better.as_ref().map_or(best.total(), Tried::total) - self.rules.tie_max {
                        better = Some(tried);
                    }
                }
            }
            match better {
                Some(tried) => best = tried,
                None => return best,
            }
        }
        best
    }

    /// Whether a deficit on left-out recordings leaves it open which of the two is right.
    fn is_tie(&self, deficits: &[f64]) -> bool {
        let (sum, _) = sum_and_z(deficits);
        let error = deviation(deficits) * libm::sqrt(deficits.len() as f64);
        sum <= self.rules.tie_max || (sum <= 2.0 * error && sum <= self.rules.gain_certain)
    }
}

/// Every combination of the starts of a kind's parameters.
fn starts(kind: &Kind<Axis>) -> Vec<Chosen> {
    let mut all: Vec<Vec<f64>> = vec![Vec::new()];
    for param in &kind.params {
        all = all
            .iter()
            .flat_map(|head| param.starts.iter().map(move |start| [head.as_slice(), &[*start]].concat()))
            .collect();
    }
    all.into_iter().map(|values| Chosen { kind: kind.clone(), values }).collect()
}

/// Whether the size of the last effect lies at its limit: that is no estimate.
fn is_at_limit(fit: &Fit) -> bool {
    let Some(chosen) = fit.trial.effects.last() else { return false };
    let size = chosen.kind.size();
    let (param, value) = (&chosen.kind.params[size], chosen.values[size]);
    (value <= param.lower || value >= param.upper) && value.to_bits() != param.off.to_bits()
}

fn deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let sum: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    libm::sqrt(sum / (n - 1.0).max(1.0))
}

/// Sum, and sum in multiples of its own standard error.
fn sum_and_z(values: &[f64]) -> (f64, f64) {
    let sum: f64 = values.iter().sum();
    let error = deviation(values) * libm::sqrt(values.len() as f64);
    (sum, if error > 0.0 { sum / error } else { 0.0 })
}
