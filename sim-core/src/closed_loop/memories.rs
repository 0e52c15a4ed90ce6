//! What the effects of a run remember, and their random numbers.

use super::Start;
use crate::effect::{Attached, Context, Effect, Rates};
use crate::rng::Stream;
use crate::signals::Signals;
use crate::space::Space;
use crate::time::Step;
use alloc::vec;
use alloc::vec::Vec;

/// One slice of numbers and one stream for each effect.
pub(super) struct Memories {
    numbers: Vec<f64>,
    span: Vec<(usize, usize)>,
    random: Vec<Stream>,
}

impl Memories {
    pub fn new<S: Space>(effects: &[Attached<S>], rates: &Rates, start: &Start<S>, first: &Signals<S>) -> Self {
        let mut span = Vec::with_capacity(effects.len());
        let mut end = 0;
        for attached in effects {
            let length = attached.effect.memory(rates);
            span.push((end, end + length));
            end += length;
        }
        let mut numbers = vec![0.0; end];
        for (attached, &(from, to)) in effects.iter().zip(&span) {
            attached.effect.begin(&mut numbers[from..to], rates, first);
        }
        let random = effects.iter().map(|attached| start.streams.named(&attached.id)).collect();
        Memories { numbers, span, random }
    }

    /// Lets the effects at the places `on` act, one after the other.
    #[inline]
    pub fn each<S: Space>(
        &mut self,
        effects: &[Attached<S>],
        on: &[usize],
        step: Step,
        mut act: impl FnMut(&dyn Effect<S>, Context<'_>),
    ) {
        for &i in on {
            let (from, to) = self.span[i];
            let context = Context { step, memory: &mut self.numbers[from..to], random: &mut self.random[i] };
            act(effects[i].effect.as_ref(), context);
        }
    }
}
