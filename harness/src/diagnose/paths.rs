//! Paths of commands, stretch by stretch, each without its best straight line: from where and how fast a stretch began is known to the
//! digits of its first two commands only, and a force bends every line.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x | recorded commands | m |
//! | f | path that the felt force makes of the declared mass | m |
//! | u | path that 1 N makes of it | m |
//! | r, c | mass over the declared one, bias of the compensator | 1, N |
//!
//! Our software gives `x = -(f / r + c u)`; r and c are those that leave least.

/// Least number of ticks from which anything can be told.
const TICKS_MIN: usize = 10;

/// Paths of all stretches, one after the other.
#[derive(Debug, Default)]
pub(super) struct Paths {
    /// x.
    commanded: Vec<f64>,
    /// f.
    by_force: Vec<f64>,
    /// u.
    by_newton: Vec<f64>,
}

/// What remains of the commands, and what explains them best.
#[derive(Debug, Clone, Copy)]
pub(super) struct LeftOver {
    /// Root mean square, in m; infinite where there is too little to tell.
    pub(super) rms_m: f64,
    /// Mass over the declared one.
    pub(super) mass_ratio: f64,
    /// Twice the bias that the compensator took out beyond the declared one, in N: two ticks feel it.
    pub(super) twice_bias_n: f64,
    /// The mass ratio where there is no bias.
    pub(super) mass_ratio_alone: f64,
    /// Twice the bias where the mass is the declared one, in N.
    pub(super) twice_bias_alone_n: f64,
    /// Change of the mass ratio for a change of the commands by 1 m, root mean square.
    pub(super) ratio_per_m: f64,
}

impl Paths {
    /// Largest difference between recorded commands and those that the force makes.
    pub(super) fn closure_m(&self) -> f64 {
        let pairs = self.commanded.iter().zip(&self.by_force);
        pairs.map(|(commanded, by_force)| (commanded + by_force).abs()).fold(0.0, f64::max)
    }

    /// What is left with the mass and the bias that leave least.
    pub(super) fn left_over(&self) -> LeftOver {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (x, f, u) = (&self.commanded, &self.by_force, &self.by_newton);
        let (ff, fu, uu) = (dot(f, f), dot(f, u), dot(u, u));
        let (xf, xu) = (-dot(x, f), -dot(x, u));
        let determinant = ff * uu - fu * fu;
        if x.len() < TICKS_MIN || determinant <= 0.0 {
            return LeftOver::nothing();
        }
        let share = (xf * uu - xu * fu) / determinant;
        let twice_bias_n = (xu * ff - xf * fu) / determinant;
        let left = |((x, f), u): ((&f64, &f64), &f64)| x + share * f + twice_bias_n * u;
        let squares: f64 = x.iter().zip(f).zip(u).map(|tick| left(tick) * left(tick)).sum();
        LeftOver {
            rms_m: libm::sqrt(squares / x.len() as f64),
            mass_ratio: 1.0 / share,
            twice_bias_n,
            mass_ratio_alone: ff / xf,
            twice_bias_alone_n: (xu - fu) / uu,
            ratio_per_m: libm::sqrt(uu / determinant) / (share * share),
        }
    }
}

impl LeftOver {
    fn nothing() -> Self {
        LeftOver {
            rms_m: f64::INFINITY,
            mass_ratio: 1.0,
            twice_bias_n: 0.0,
            mass_ratio_alone: 1.0,
            twice_bias_alone_n: 0.0,
            ratio_per_m: 0.0,
        }
    }
}

/// A stretch that grows: the three paths, from rest at zero.
#[derive(Debug, Default)]
pub(super) struct Stretch(Vec<[f64; 3]>);

impl Stretch {
    /// One tick more, whose paths are bent by so much.
    pub(super) fn bend(&mut self, by: [f64; 3]) {
        if self.0.is_empty() {
            self.0.extend([[0.0; 3]; 2]);
        }
        let [before, now] = [self.0[self.0.len() - 2], self.0[self.0.len() - 1]];
        self.0.push(std::array::from_fn(|column| 2.0 * now[column] - before[column] + by[column]));
    }

    /// It ends here.
    pub(super) fn end(self, paths: &mut Paths) {
        for (column, out) in [&mut paths.commanded, &mut paths.by_force, &mut paths.by_newton].into_iter().enumerate() {
            out.extend(without_line(&self.0, column));
        }
    }
}

/// One column without its best straight line.
fn without_line(rows: &[[f64; 3]], column: usize) -> impl Iterator<Item = f64> {
    let n = rows.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = rows.iter().map(|row| row[column]).sum::<f64>() / n;
    let about = |nth: usize| nth as f64 - middle;
    let spread: f64 = (0..rows.len()).map(|nth| about(nth) * about(nth)).sum();
    let slope = rows.iter().enumerate().map(|(nth, row)| about(nth) * (row[column] - mean)).sum::<f64>() / spread;
    rows.iter().enumerate().map(move |(nth, row)| row[column] - mean - slope * (nth as f64 - middle))
}

#[cfg(test)]
mod tests {
    use super::{Paths, Stretch};

    /// Commands of a mass of 1.2 times the declared one under a known force with a bias, rounded to a step, in two stretches.
    fn paths(step_m: f64) -> Paths {
        let (mut paths, per_newton) = (Paths::default(), 1e-7);
        for stretch in 0..2 {
            let force = |tick: usize| 20.0 * libm::sin(0.05 * tick as f64 + stretch as f64);
            let mut exact = vec![0.0, 1e-4];
            for tick in 0..198 {
                let acted = force(tick) / 1.2 + 0.4;
                exact.push(2.0 * exact[tick + 1] - exact[tick] - acted * per_newton);
            }
            let sent: Vec<f64> =
                exact.iter().map(|x| if step_m > 0.0 { libm::round(x / step_m) * step_m } else { *x }).collect();
            let mut one = Stretch::default();
            for tick in 0..198 {
                let bend = sent[tick + 2] - 2.0 * sent[tick + 1] + sent[tick];
                one.bend([bend, force(tick) * per_newton, per_newton]);
            }
            one.end(&mut paths);
        }
        paths
    }

    #[test]
    fn mass_and_bias_are_those_that_made_the_commands() {
        let left = paths(0.0).left_over();
        assert!(left.rms_m < 1e-12, "{left:?}");
        assert!((left.mass_ratio - 1.2).abs() < 1e-8 && (left.twice_bias_n - 0.4).abs() < 1e-7, "{left:?}");
        let rounded = paths(1e-7).left_over();
        assert!(rounded.rms_m < 1e-7, "what rounding leaves does not add up: {rounded:?}");
        let off = (rounded.mass_ratio - 1.2).abs();
        assert!(off > 0.0 && off < 4.0 * rounded.ratio_per_m * 1e-7, "{off} {rounded:?}");
    }

    #[test]
    fn nothing_is_told_of_too_little() {
        let mut stretch = Stretch::default();
        stretch.bend([1e-6, 1e-6, 1e-7]);
        let mut paths = Paths::default();
        stretch.end(&mut paths);
        Stretch::default().end(&mut paths);
        assert!(paths.left_over().rms_m.is_infinite());
        assert!(paths.closure_m() < 1e-5);
    }
}
