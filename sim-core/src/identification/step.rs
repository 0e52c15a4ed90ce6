//! The classical reading of a step response: overshoot, decay, period.
//!
//! ```text
//! M_p = exp(-π ζ / √(1 - ζ²))  →  ζ = -ln M_p / √(π² + ln² M_p)
//! δ = ln(x₀ / xₙ) / n           →  ζ = δ / √(4 π² + δ²)          (n whole periods)
//! T_d: twice the time between two passages of the final value    →  fₙ = 1 / (T_d √(1 - ζ²))
//! ```
//!
//! It uses a few samples of many: noise makes peaks larger, so that ζ comes out low by up to 0.02 at ζ = 0.7, and fₙ scatters by
//! 2 to 5 % at 0.5 % noise. The fit of the whole response ([`super::response`]) is what counts; this is its check.

use alloc::vec::Vec;

/// A step in the command, and the pose that followed.
#[derive(Debug, Clone, PartialEq)]
pub struct StepTest {
    /// Time of each change of the command, and its size: one entry for an ideal step.
    pub changes: Vec<(f64, f64)>,
    /// Time of each sample of the pose.
    pub time_s: Vec<f64>,
    /// The pose along the axis.
    pub pose: Vec<f64>,
}

impl StepTest {
    /// Size of the whole step.
    pub fn size(&self) -> f64 {
        self.changes.iter().map(|change| change.1).sum()
    }

    /// Time of the first change.
    pub fn begin_s(&self) -> f64 {
        self.changes.first().map_or(0.0, |change| change.0)
    }

    /// Time of the last change.
    pub fn end_s(&self) -> f64 {
        self.changes.last().map_or(0.0, |change| change.0)
    }
}

/// What can be read off a step response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Classical {
    /// First overshoot over the step.
    pub overshoot: f64,
    /// ζ from the overshoot.
    pub damping_from_overshoot: f64,
    /// ζ from the decay of the lobes, if there are two that stand above the noise.
    pub damping_from_decay: Option<f64>,
    /// Damped period, if the final value is passed at least twice after the first overshoot begins.
    pub period_s: Option<f64>,
    /// fₙ from period and damping.
    pub natural_frequency_hz: Option<f64>,
}

/// Part of the record, at its end, that shows the final value.
const TAIL: f64 = 0.2;
/// A lobe counts when its peak is this many standard deviations of the noise in the tail.
const LOBE_SIGMAS: f64 = 5.0;
/// A tail that passes its mean as often as this rings, or is noise: a period and a half.
const PASSAGES_MIN: usize = 3;

/// Reads a step response; `None` without an overshoot that stands above the noise.
pub fn classical(test: &StepTest) -> Option<Classical> {
    let from = test.time_s.iter().position(|time| *time >= test.end_s())?;
    let (times, poses) = (&test.time_s[from..], &test.pose[from..]);
    let tail = &poses[poses.len() - libm::ceil(poses.len() as f64 * TAIL) as usize..];
    let (last, scatter) = settled(tail);
    let size = test.size();
    // Above 0 is beyond the final value, in the sense of the step.
    let over: Vec<f64> = poses.iter().map(|pose| (pose - last) / size).collect();
    let lobes = lobes(times, &over, LOBE_SIGMAS * scatter / size.abs());
    let first = lobes.first()?;
    let log = libm::log(first.peak);
    let pi = core::f64::consts::PI;
    let damping_from_overshoot = -log / libm::sqrt(pi * pi + log * log);
    let halves = lobes.len() as f64 - 1.0;
    let damping_from_decay = lobes.last().filter(|_| lobes.len() > 1).map(|last| {
        let decrement = 2.0 * libm::log(first.peak / last.peak) / halves;
        decrement / libm::sqrt(4.0 * pi * pi + decrement * decrement)
    });
    let period_s = first.until_s.map(|_| {
        let ended: Vec<(f64, f64)> = lobes.iter().filter_map(|lobe| Some((lobe.from_s, lobe.until_s?))).collect();
        2.0 * (ended[ended.len() - 1].1 - ended[0].0) / ended.len() as f64
    });
    let damping = damping_from_decay.unwrap_or(damping_from_overshoot);
    let natural_frequency_hz = period_s.map(|period_s| 1.0 / (period_s * libm::sqrt(1.0 - damping * damping)));
    Some(Classical {
        overshoot: first.peak,
        damping_from_overshoot,
        damping_from_decay,
        period_s,
        natural_frequency_hz,
    })
}

/// Final value and noise, from the end of a record.
///
/// A barely damped axis still rings there: under a Hann window whole and broken periods count little in the mean, and the second
/// differences, of which white noise has `6 σ²`, hold next to nothing of the ringing. They tell the noise only where the tail
/// passes its mean often enough to ring; a tail that drifts keeps its whole scatter.
fn settled(tail: &[f64]) -> (f64, f64) {
    let count = tail.len() as f64;
    let weight = |nth: usize| 1.0 - libm::cos(2.0 * core::f64::consts::PI * (nth as f64 + 0.5) / count);
    // The weights of the window sum to the count.
    let last = tail.iter().enumerate().map(|(nth, pose)| weight(nth) * pose).sum::<f64>() / count;
    let scatter = libm::sqrt(tail.iter().map(|pose| (pose - last) * (pose - last)).sum::<f64>() / count);
    let passages = tail.windows(2).filter(|pair| (pair[0] - last) * (pair[1] - last) < 0.0).count();
    if passages < PASSAGES_MIN {
        return (last, scatter);
    }
    let bend = |of: &[f64]| of[0] - 2.0 * of[1] + of[2];
    let bends = tail.windows(3).map(|of| bend(of) * bend(of)).sum::<f64>();
    (last, scatter.min(libm::sqrt(bends / (6.0 * (count - 2.0)))))
}

/// Between two passages of the final value.
struct Lobe {
    from_s: f64,
    /// The next passage; `None` if the record ends before it.
    until_s: Option<f64>,
    peak: f64,
}

/// Lobes that stand above the noise, the overshoot first. A passage inside the noise is none: the side counts as changed only
/// once the other side was seen above it.
fn lobes(times: &[f64], over: &[f64], least: f64) -> Vec<Lobe> {
    let mut found: Vec<Lobe> = Vec::new();
    let mut side = -1.0;
    let mut passage_s = times.first().copied().unwrap_or(0.0);
    for nth in 1..over.len() {
        let (before, now) = (over[nth - 1], over[nth]);
        if before * side > 0.0 && now * side <= 0.0 {
            passage_s = times[nth - 1] + (times[nth] - times[nth - 1]) * before / (before - now);
        }
        if now * side < 0.0 && now.abs() > least {
            side = -side;
            if let Some(lobe) = found.last_mut() {
                lobe.until_s = Some(passage_s);
            }
            found.push(Lobe { from_s: passage_s, until_s: None, peak: 0.0 });
        }
        if let Some(lobe) = found.last_mut()
            && now * side > 0.0
        {
            lobe.peak = lobe.peak.max(now.abs());
        }
    }
    found
}
