//! From a value with its uncertainty to a verdict.

use super::{Bound, Criterion, Estimate, Missing, Outcome, Verdict};
use crate::refusal::Refusal;
use crate::time::Nanos;
use alloc::format;
use alloc::string::{String, ToString};

/// Two bounds, either of which may be absent.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Range {
    pub at_least: Option<f64>,
    pub at_most: Option<f64>,
}

impl Range {
    /// The bound with the smaller margin, that margin, and which bound it is.
    fn nearest(&self, value: f64) -> Option<(f64, f64, Bound)> {
        let low = self.at_least.map(|limit| (limit, value - limit, Bound::AtLeast));
        let high = self.at_most.map(|limit| (limit, limit - value, Bound::AtMost));
        match (low, high) {
            (Some(low), Some(high)) => Some(if low.1 <= high.1 { low } else { high }),
            (low, high) => low.or(high),
        }
    }

    /// Refuses bounds that are not finite, or that nothing can satisfy.
    pub fn check(&self, names: [&'static str; 2], unit: &'static str) -> Result<(), Refusal> {
        for (bound, name) in [(self.at_least, names[0]), (self.at_most, names[1])] {
            if let Some(value) = bound {
                crate::refusal::finite(name, value, unit)?;
            }
        }
        match (self.at_least, self.at_most) {
            (Some(low), Some(high)) if low > high => {
                Err(Refusal { name: names[0], value: low, unit, limit: "is above the upper limit: nothing would pass" })
            }
            _ => Ok(()),
        }
    }
}

/// What was found, before it is held against a limit.
pub(super) struct Finding {
    pub estimate: Estimate,
    pub unit: &'static str,
    pub at: Option<Nanos>,
    /// How it was had.
    pub about: String,
}

/// Holds a finding against a range.
pub(super) fn judged(
    criterion: &dyn Criterion,
    found: Result<Finding, Missing>,
    unit: &'static str,
    range: Range,
) -> Verdict {
    let found = match found {
        Ok(found) => found,
        Err(missing) => return cannot(criterion, unit, &missing),
    };
    let Estimate { value, sd } = found.estimate;
    let mut verdict = Verdict {
        criterion: criterion.id().to_string(),
        outcome: Outcome::Undecided,
        value: Some(value),
        uncertainty: sd.map(|sd| 2.0 * sd),
        limit: None,
        bound: None,
        margin: None,
        unit: found.unit,
        at: found.at,
        why: found.about,
    };
    let Some((limit, margin, bound)) = range.nearest(value) else {
        verdict.why = format!("no limit is given; {}", verdict.why);
        return verdict;
    };
    (verdict.limit, verdict.margin, verdict.bound) = (Some(limit), Some(margin), Some(bound));
    // Without a noise figure nothing is inside it.
    let resolved = margin.abs() > 2.0 * sd.unwrap_or(0.0);
    verdict.outcome = match (margin >= 0.0, resolved) {
        (true, true) => Outcome::Pass,
        (false, true) => Outcome::Fail,
        // On the limit itself, without any uncertainty, it is kept.
        (true, false) if sd.unwrap_or(0.0) == 0.0 => Outcome::Pass,
        _ => Outcome::Undecided,
    };
    if verdict.outcome == Outcome::Undecided {
        verdict.why = format!("the margin is below the uncertainty; {}", verdict.why);
    }
    verdict
}

/// The verdict on a run that lacks what the criterion needs.
pub(super) fn cannot(criterion: &dyn Criterion, unit: &'static str, missing: &Missing) -> Verdict {
    Verdict {
        criterion: criterion.id().to_string(),
        outcome: Outcome::Undecided,
        value: None,
        uncertainty: None,
        limit: None,
        bound: None,
        margin: None,
        unit,
        at: None,
        why: format!("cannot be judged: {missing}"),
    }
}
