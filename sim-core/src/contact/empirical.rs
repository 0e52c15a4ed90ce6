//! A measured spring: `f = k(A) d + b d'`, with the stiffness k read from a table over the amplitude A of the penetration.
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | A | amplitude of the penetration: the size of its depth | m | measured |
//! | k(A) | secant stiffness, force over depth; straight between the rows, held beyond them | N/m | measured |
//! | b | dashpot, or 0 | N s/m | measured |
//! | d | penetration | m | |
//!
//! The thesis names a stiffness k(A) found by experiment. Neither its table nor what exactly A stands for is recovered: nothing
//! here reproduces it. Read as an area, A is a depth as well: a ball of radius R, pressed in by d ≪ R, touches on `A = π R d`
//! (Hertz), so that a table over the area becomes one over the depth. A power law needs no table: it is `Hertz`.
//!
//! The force follows from the present depth, so a loop without dashpot gives back what it took. Where k falls faster than A
//! grows the force falls with the depth: unstable, and answered. Not modelled: a stiffness that remembers the deepest point.

use super::{DepthLaw, Sides};
use crate::refusal::{self, Refusal};
use crate::signals::ContactForce;
use crate::space::{Axis, AxisTouch};

/// Most rows of a table: the law stays a plain value, and a look-up stays short.
pub const ROWS_MAX: usize = 16;

/// One row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Row {
    /// Amplitude A.
    pub amplitude_m: f64,
    /// Secant stiffness k(A).
    pub stiffness_n_per_m: f64,
}

/// Spring from a table, with or without a dashpot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Empirical {
    rows: [Row; ROWS_MAX],
    last: usize,
    damping_n_s_per_m: f64,
    sides: Sides,
}

impl Empirical {
    /// From rows of growing amplitude.
    pub fn new(table: &[Row], damping_n_s_per_m: f64, sides: Sides) -> Result<Self, Refusal> {
        if table.is_empty() || table.len() > ROWS_MAX {
            let (value, limit) = (table.len() as f64, "is not between 1 and 16");
            return Err(Refusal { name: "table", value, unit: "rows", limit });
        }
        for row in table {
            refusal::not_negative("amplitude_m", row.amplitude_m, "m")?;
            refusal::not_negative("stiffness_n_per_m", row.stiffness_n_per_m, "N/m")?;
        }
        for pair in table.windows(2) {
            if pair[1].amplitude_m <= pair[0].amplitude_m {
                let limit = "is not above the row before";
                return Err(Refusal { name: "amplitude_m", value: pair[1].amplitude_m, unit: "m", limit });
            }
        }
        refusal::finite("damping_n_s_per_m", damping_n_s_per_m, "N s/m")?;
        let mut rows = [Row::default(); ROWS_MAX];
        rows[..table.len()].copy_from_slice(table);
        Ok(Empirical { rows, last: table.len() - 1, damping_n_s_per_m, sides })
    }

    /// The secant stiffness at this amplitude.
    pub fn stiffness_n_per_m(&self, amplitude_m: f64) -> f64 {
        let rows = &self.rows[..=self.last];
        let above = rows.iter().position(|row| row.amplitude_m > amplitude_m);
        match above {
            None => rows[self.last].stiffness_n_per_m,
            Some(0) => rows[0].stiffness_n_per_m,
            Some(i) => {
                let (low, high) = (rows[i - 1], rows[i]);
                let share = (amplitude_m - low.amplitude_m) / (high.amplitude_m - low.amplitude_m);
                low.stiffness_n_per_m + (high.stiffness_n_per_m - low.stiffness_n_per_m) * share
            }
        }
    }
}

impl DepthLaw for Empirical {
    fn resistance(&self, touch: &AxisTouch) -> ContactForce<Axis> {
        ContactForce {
            elastic: self.stiffness_n_per_m(touch.depth_m.abs()) * touch.depth_m,
            dissipative: self.damping_n_s_per_m * touch.rate_m_per_s,
        }
    }

    fn sides(&self) -> Sides {
        self.sides
    }
}
