//! What tells the recordings as well as what was found: other effects, sets of them, and effects instead of a wrong base value.

use super::super::verdict::denies_model;
use super::{Search, Tried, is_at_limit};
use crate::model::Chosen;
use sim_core::effect::Kind;
use sim_core::space::Axis;
use std::collections::BTreeMap;

/// Sets that leave the same log to the last digit: moving δ of dead time from the command to the read-out and to the force's
/// transport together changes neither the order nor the size of anything that is written down.
const EQUIVALENT: [(&str, &[&str]); 1] = [("command-delay", &["measurement-delay", "force-delay"])];

/// By the id of a member, those that could stand in its place; and what it is worth.
type Ties = (BTreeMap<String, Vec<String>>, BTreeMap<String, f64>);

impl Search<'_> {
    /// For each member, what could stand in its place, and what it is worth.
    pub(super) fn ties(&self, base: &Tried, best: &Tried) -> Ties {
        let (mut ties, mut worth) = (BTreeMap::new(), BTreeMap::new());
        for member in self.given..best.fit.trial.effects.len() {
            let id = best.fit.trial.effects[member].kind.id.to_string();
            let smaller =
                if best.fit.trial.effects.len() == self.given + 1 { base.clone() } else { self.without(best, member) };
            worth.insert(id.clone(), smaller.total() - best.total());
            let mut fits = self.additions(&smaller, smaller.fit.cost - best.fit.cost);
            fits.retain(|(other, fit)| *other != id && fit.cost < best.fit.cost + 2.0 * self.rules.gain_certain);
            fits.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
            let mut group = vec![(self.denies_model(best), best.total(), id.clone())];
            for (other, fit) in fits.into_iter().take(self.rules.finalists) {
                let tried = self.tried(fit);
                let gains: f64 = tried.gains_over(&smaller).iter().sum();
                let is_tie = self.is_tie(&best.gains_over(&tried)) || self.is_simpler(&tried, best, &smaller);
                if gains > self.threshold() && is_tie {
                    group.push((self.denies_model(&tried), tried.total(), other));
                }
            }
            // The fitted one first: what is said of the group is said of it.
            let order = |one: &(bool, f64, String)| (one.2 != id, one.0);
            group.sort_by(|a, b| order(a).cmp(&order(b)).then(a.1.total_cmp(&b.1)));
            ties.insert(id, group.into_iter().map(|(_, _, id)| id).collect());
        }
        (ties, worth)
    }

    /// What a wrong value of the contact may be instead.
    pub(super) fn instead(&self, best: &Tried) -> Vec<String> {
        if best.fit.trial.effects.len() > self.given || !self.denies_model(best) {
            return Vec::new();
        }
        let mut fits = self.additions(best, 0.0);
        fits.retain(|(_, fit)| !denies_model(&self.problem.model, fit) && !is_at_limit(fit));
        fits.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let tried = fits.into_iter().take(self.rules.finalists).map(|(id, fit)| (id, self.tried(fit)));
        // A free parameter more tells a little more of anything.
        let better = |tried: &Tried| tried.total() < best.total() - self.rules.tie_max;
        tried.filter(|(_, tried)| better(tried)).map(|(id, _)| id).collect()
    }

    /// Sets that could stand in the place of one member; each is fitted, and kept only if it tells the recordings as well.
    pub(super) fn equivalent_sets(&self, best: &Tried) -> BTreeMap<String, Vec<Vec<String>>> {
        let mut sets = BTreeMap::new();
        for (id, others) in EQUIVALENT {
            let Some(member) = best.fit.trial.effects.iter().position(|chosen| chosen.kind.id == id) else { continue };
            let kinds: Vec<&&Kind<Axis>> =
                self.kinds.iter().filter(|kind| others.contains(&kind.id.as_ref())).collect();
            let size = best.fit.trial.effects[member].values[0];
            let mut trial = best.fit.trial.clone();
            trial.effects.remove(member);
            let present = trial.effects.iter().any(|chosen| others.contains(&chosen.kind.id.as_ref()));
            if kinds.len() < others.len() || present || size <= 0.0 {
                continue;
            }
            trial.effects.extend(kinds.iter().map(|kind| Chosen { kind: (**kind).clone(), values: vec![size] }));
            if self.fitted(&trial, Some(&best.fit)).cost - best.fit.cost <= self.rules.tie_max {
                sets.insert(id.to_string(), vec![others.iter().map(|other| other.to_string()).collect()]);
            }
        }
        sets
    }
}
