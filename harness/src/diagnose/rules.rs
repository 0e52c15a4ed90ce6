//! When an effect is accepted.

/// Rules of acceptance. They are fixed before any recording is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    /// Most effects that are added.
    pub effects_max: usize,
    /// How many candidates are ranked by leaving recordings out.
    pub finalists: usize,
    /// Least gain in -2 ln p, of the fit and of left-out recordings alike: 12 is 3.5 σ, and what is called visible. The library's
    /// size may raise it to 2 ln(candidates).
    pub gain_min: f64,
    /// Sets whose left-out recordings differ by no more than this tell them equally well.
    pub tie_max: f64,
    /// Share of the leader's gain up to which an effect goes first that leaves the contact as the model has it, where the leader
    /// does not: far below what a wrong form of a law costs.
    pub simpler_share: f64,
    /// A total gain beyond doubt (5 σ), wherever it comes from, once no recording speaks against it.
    pub gain_certain: f64,
    /// Share of the gains that recordings may lose together: as long as a second effect is missing, the first one costs a little
    /// where the second one is large.
    pub loss_share: f64,
    /// An effect that imitated an accepted one, by this share of its gain, is its shadow …
    pub shadow_gain: f64,
    /// … and is added beside it only if it is worth this share of it: otherwise only the exact form differs.
    pub shadow_worth: f64,
    /// How many standard deviations the size of an effect is away from none, at least.
    pub significance: f64,
    /// Least linear gain that is followed up by a fit: the signature at a start shows a third of what the right values would gain, so
    /// that nothing that could be accepted stays below.
    pub promise_min: f64,
    /// The same as a share of the gain that is wanted, where an effect has to stand in for another one.
    pub promise_share: f64,
    /// Share of the leader's gain that a finalist's fit must reach.
    pub near_share: f64,
}

impl Default for Rules {
    fn default() -> Self {
        Rules {
            effects_max: 4,
            finalists: 6,
            gain_min: 12.0,
            tie_max: 6.0,
            simpler_share: 1e-3,
            gain_certain: 25.0,
            loss_share: 0.02,
            shadow_gain: 0.5,
            shadow_worth: 0.1,
            significance: 3.0,
            promise_min: 2.0,
            promise_share: 0.02,
            near_share: 0.5,
        }
    }
}
