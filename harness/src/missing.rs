//! What a recording lacks: commands, reported poses and readings that should be there by its own clock.
//!
//! | not trusted | why |
//! |---|---|
//! | a tick without a sample, between two that have one | it was lost, or nobody sent it |
//! | the first sample after it | stamps are those of arrival: what comes first after a gap may be what was due in it |
//!
//! A stream slower than the clock lacks nothing, and so does one before its first and after its last sample.

use crate::case::{Channel, median_period_ns};

/// What a tick has of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Has {
    /// A sample.
    Sample,
    /// The first sample after a gap.
    AfterGap,
    /// Nothing.
    Nothing,
}

/// What a recording lacks, stream by stream.
#[derive(Debug, Clone, Default)]
pub struct Missing {
    /// Commands, by tick of the loop.
    pub command: Vec<Has>,
    /// Reported poses, by tick of the loop.
    pub pose: Vec<Has>,
    /// Readings, by tick of the sensor.
    pub reading: Vec<Has>,
    /// Cycles with a reported pose before the first command: what the robot was told then is not recorded.
    pub before: usize,
    /// Readings stamped later than their tick by more than a tenth of the sensor's period.
    pub late: Vec<bool>,
}

/// Share of a period from which on a stamp is late: above what a clock's resolution makes of it. Chosen.
const LATE: f64 = 0.1;

impl Missing {
    /// Whether anything is.
    pub fn any(&self) -> bool {
        let all = [&self.command, &self.pose, &self.reading];
        self.before > 0 || all.into_iter().flatten().any(|has| *has != Has::Sample)
    }
}

/// What each tick of a regular clock has of a stream with these stamps.
pub fn ticks_of(time_ns: &[i64], start_ns: i64, period_ns: i64, ticks: usize) -> Vec<Has> {
    let mut out = vec![Has::Sample; ticks];
    if median_period_ns(time_ns) * 2 > period_ns * 3 {
        return out;
    }
    let mut before: Option<usize> = None;
    for time_ns in time_ns {
        let tick = (time_ns - start_ns + period_ns / 2).div_euclid(period_ns);
        let Some(tick) = usize::try_from(tick).ok().filter(|tick| *tick < ticks) else { continue };
        if let Some(before) = before.filter(|before| before + 1 < tick) {
            out[before + 1..tick].fill(Has::Nothing);
            out[tick] = Has::AfterGap;
        }
        before = Some(tick);
    }
    out
}

/// Ticks whose sample bears a late stamp.
pub fn late(time_ns: &[i64], start_ns: i64, period_ns: i64, ticks: usize) -> Vec<bool> {
    let mut out = vec![false; ticks];
    for time_ns in time_ns {
        let tick = (time_ns - start_ns + period_ns / 2).div_euclid(period_ns);
        let late_ns = time_ns - start_ns - tick * period_ns;
        if let Some(late) = usize::try_from(tick).ok().and_then(|tick| out.get_mut(tick)) {
            *late = late_ns as f64 > LATE * period_ns as f64;
        }
    }
    out
}

/// Marks the samples of a channel that are not trusted as unknown.
pub fn distrust(channel: &mut Channel, has: &[Has]) {
    for (known, has) in channel.known.iter_mut().zip(has) {
        *known &= *has == Has::Sample;
    }
}

#[cfg(test)]
mod tests {
    use super::{Has, late, ticks_of};

    #[test]
    fn a_gap_and_the_sample_after_it_are_not_trusted_and_slow_streams_have_none() {
        let has = ticks_of(&[10, 20, 50, 60, 71, 80], 0, 10, 10);
        let mut wanted = [Has::Sample; 10];
        (wanted[3], wanted[4], wanted[5]) = (Has::Nothing, Has::Nothing, Has::AfterGap);
        assert_eq!(has, wanted, "before the first and after the last sample nothing is missing");
        assert_eq!(ticks_of(&[0, 30, 60, 90], 0, 10, 10), [Has::Sample; 10]);
        assert_eq!(late(&[0, 12, 19, 31], 0, 10, 4), [false, true, false, false]);
    }
}
