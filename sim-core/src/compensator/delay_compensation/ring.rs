//! The positions of the recent past, one for each tick of the loop.

use crate::delay;
use crate::refusal::Refusal;
use crate::space::AxisMotion;

const SLOTS: usize = 64;

/// How many ticks back a compensation may look: 248 ms at 4 ms.
pub const TICKS_BACK: usize = SLOTS - 2;

/// A fixed ring of positions. Before the first one, everything has been moving along it for ever.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    position_m: [f64; SLOTS],
    newest: usize,
    filled: bool,
}

impl Default for Ring {
    fn default() -> Self {
        Ring { position_m: [0.0; SLOTS], newest: 0, filled: false }
    }
}

impl Ring {
    /// Takes the position of this tick.
    pub fn push(&mut self, motion: &AxisMotion, period_s: f64) {
        if !self.filled {
            for age in 0..SLOTS {
                let past_m = motion.position_m - motion.velocity_m_per_s * (age as f64 * period_s);
                self.position_m[(SLOTS - age) % SLOTS] = past_m;
            }
            (self.newest, self.filled) = (0, true);
            return;
        }
        self.newest = (self.newest + 1) % SLOTS;
        self.position_m[self.newest] = motion.position_m;
    }

    /// The position `ticks` before the newest one, on the straight line between two ticks.
    pub fn at(&self, ticks: f64) -> f64 {
        let whole = libm::floor(ticks);
        assert!(ticks >= 0.0 && whole <= TICKS_BACK as f64, "{ticks} ticks back were refused by `check`");
        let past = |age: usize| self.position_m[(self.newest + SLOTS - age) % SLOTS];
        let (young, old) = (past(whole as usize), past(whole as usize + 1));
        young + (old - young) * (ticks - whole)
    }
}

/// Refuses a look back that the ring cannot give.
pub(crate) fn within_reach(name: &'static str, delay_s: f64, period_s: f64) -> Result<(), Refusal> {
    if delay::steps(delay_s, period_s) <= TICKS_BACK as f64 {
        Ok(())
    } else {
        Err(Refusal { name, value: delay_s, unit: "s", limit: "is more than 62 ticks of the loop" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reads_what_was_put_in_and_a_straight_past_before_that() {
        let mut ring = Ring::default();
        for n in 0..200 {
            let t = f64::from(n) * 0.004;
            ring.push(&AxisMotion::moving(0.5 * t, 0.5), 0.004);
            for ticks in [0.0, 1.0, 2.25, 61.5, 62.0] {
                assert!((ring.at(ticks) - 0.5 * (t - ticks * 0.004)).abs() < 1e-15, "{n} {ticks}");
            }
        }
        assert!(within_reach("delay_s", 0.248, 0.004).is_ok());
        let refused = within_reach("delay_s", 0.249, 0.004).unwrap_err();
        assert_eq!(alloc::format!("{refused}"), "delay_s = 0.249 s is more than 62 ticks of the loop");
    }
}
