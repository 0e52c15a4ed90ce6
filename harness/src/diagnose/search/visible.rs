//! What could not be seen: how large an absent effect would have to be, to first order about its start.

use super::super::fit::Fit;
use super::{Search, Tried};
use crate::model::Chosen;
use rayon::prelude::*;
use sim_core::effect::Kind;
use sim_core::space::Axis;
use std::collections::BTreeMap;

/// Gain in -2 ln p at which an effect would have been seen: 3.5 σ.
const VISIBLE_GAIN: f64 = 12.0;

impl Search<'_> {
    /// How large each absent effect would have to be to gain 12 (3.5 σ) on these recordings.
    pub(super) fn visible(&self, best: &Tried) -> BTreeMap<String, f64> {
        let there = best.ids();
        let absent: Vec<&&Kind<Axis>> =
            self.kinds.iter().filter(|kind| !there.contains(&kind.id.to_string())).collect();
        let of = |kind: &&&Kind<Axis>| self.least_visible(&best.fit, kind).map(|size| (kind.id.to_string(), size));
        absent.par_iter().filter_map(of).collect::<Vec<_>>().into_iter().collect()
    }

    fn least_visible(&self, fit: &Fit, kind: &Kind<Axis>) -> Option<f64> {
        let at = kind.size();
        let param = &kind.params[at];
        let mut chosen = Chosen::at_start(kind);
        if param.lower > 0.0 && param.off > 100.0 * param.lower {
            // A frequency: the higher, the less of the effect. The highest one of a grid that would still show.
            return (0..20).map(|i| 400.0 * libm::pow(0.8, f64::from(i))).find(|frequency| {
                chosen.values[at] = *frequency;
                self.signature(fit, &chosen).information >= VISIBLE_GAIN
            });
        }
        let size = (chosen.values[at] - param.off).abs();
        let least = size * libm::sqrt(VISIBLE_GAIN / self.signature(fit, &chosen).information);
        least.is_finite().then_some(least)
    }
}
