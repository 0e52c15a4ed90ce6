//! What a calibration leaves: size per axis, and shape against the angle of gravity and against the order of the poses.
//!
//! Right residuals are white. Against the angle θ of gravity about an axis of the sensor:
//! - `sin θ, cos θ`: something linear in the weight is left: centre of mass, misalignment, mass, or crosstalk;
//! - `sin 2θ, cos 2θ`: something that grows with its square: a tool or an arm that sags;
//! - a line or a bend over the order of the poses: the bias drifts.
//!
//! `e = a₀ + a₁ cos θ + a₂ sin θ + a₃ cos 2θ + a₄ sin 2θ` is fitted; a pair counts as seen when its F quotient is too large for
//! chance: `P(F > x) = (1 + 2x/ν)^(-ν/2)` for two numerator degrees of freedom, exactly.

use super::batch::Calibration;
use super::measurement::StaticPose;
use alloc::vec::Vec;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Chance that white residuals show any pattern at all; it is shared by all tests of a calibration.
const FALSE_ALARM: f64 = 0.01;
/// Six axes, three angles with two pairs each, and the order.
const TESTS: f64 = 6.0 * 7.0;
/// Gravity nearer than this to the axis has no angle about it: the projection is shorter than half.
const PROJECTION_MIN: f64 = 0.5;
/// Fewest poses for a pattern of five numbers: as many degrees of freedom are left as were fitted.
const POSES_MIN: usize = 10;

/// Residuals of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisResidual {
    /// Mean.
    pub mean: f64,
    /// Root of the mean square about the mean.
    pub deviation: f64,
    /// Largest size.
    pub largest: f64,
    /// The pose that has it.
    pub at: usize,
}

/// What a pattern looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// sin θ and cos θ of the angle of gravity about this axis of the sensor.
    Once(usize),
    /// sin 2θ and cos 2θ of it.
    Twice(usize),
    /// A line and a bend over the order of the poses.
    Order,
}

/// A pattern that is not chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// Three forces, then three torques.
    pub axis: usize,
    /// What it looks like.
    pub shape: Shape,
    /// Amplitude, in N or N m; for [`Shape::Order`], half of the change from first to last.
    pub amplitude: f64,
    /// Chance of as large a pattern in white residuals.
    pub chance: f64,
}

impl Calibration {
    /// Statistics of the residuals: three forces in N, then three torques in N m.
    pub fn axis_residuals(&self) -> [AxisResidual; 6] {
        core::array::from_fn(|axis| {
            let values: Vec<f64> = self.residuals.iter().map(|residual| residual[axis]).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
            let mut worst = AxisResidual { mean, deviation: libm::sqrt(square), largest: 0.0, at: 0 };
            for (at, value) in values.iter().enumerate() {
                if value.abs() > worst.largest {
                    (worst.largest, worst.at) = (value.abs(), at);
                }
            }
            worst
        })
    }
}

/// The patterns in the residuals of a calibration, at most one of each sort for each axis, the surest first.
pub fn patterns(calibration: &Calibration, poses: &[StaticPose]) -> Vec<Pattern> {
    let mut found = Vec::new();
    for axis in 0..6 {
        let values: Vec<f64> = calibration.residuals.iter().map(|residual| residual[axis]).collect();
        let turns = [0, 1, 2].map(|about| harmonics(axis, about, poses, &values));
        let surest = |pick: fn(&[Pattern; 2]) -> Pattern| {
            let all = turns.iter().flatten().map(pick);
            all.min_by(|one, other| one.chance.total_cmp(&other.chance))
        };
        found.extend(surest(|pair| pair[0]));
        found.extend(surest(|pair| pair[1]));
        found.extend(trend(axis, &values));
    }
    found.retain(|pattern| pattern.chance < FALSE_ALARM / TESTS);
    found.sort_by(|one, other| one.chance.total_cmp(&other.chance));
    found
}

fn harmonics(axis: usize, about: usize, poses: &[StaticPose], values: &[f64]) -> Option<[Pattern; 2]> {
    let (first, second) = ((about + 1) % 3, (about + 2) % 3);
    let angle = |pose: &StaticPose| {
        let gravity = pose.gravity_m_per_s2;
        let flat = libm::hypot(gravity[first], gravity[second]);
        (flat >= PROJECTION_MIN * gravity.norm()).then(|| libm::atan2(gravity[second], gravity[first]))
    };
    let points: Vec<(f64, f64)> =
        poses.iter().zip(values).filter_map(|(pose, value)| Some((angle(pose)?, *value))).collect();
    let row = |angle: f64| {
        let ((sin, cos), (sin2, cos2)) = (libm::sincos(angle), libm::sincos(2.0 * angle));
        [1.0, cos, sin, cos2, sin2]
    };
    let rows = DMatrix::from_fn(points.len(), 5, |nth, column| row(points[nth].0)[column]);
    let fit = Fit::of(rows, DVector::from_iterator(points.len(), points.iter().map(|point| point.1)))?;
    let pattern = |shape, at: usize| {
        let (amplitude, chance) = fit.pair(at);
        Pattern { axis, shape, amplitude, chance }
    };
    Some([pattern(Shape::Once(about), 1), pattern(Shape::Twice(about), 3)])
}

fn trend(axis: usize, values: &[f64]) -> Option<Pattern> {
    let place = |nth: usize| 2.0 * nth as f64 / (values.len() - 1) as f64 - 1.0;
    let rows = DMatrix::from_fn(values.len(), 3, |nth, column| [1.0, place(nth), place(nth) * place(nth)][column]);
    let fit = Fit::of(rows, DVector::from_column_slice(values))?;
    let (_, chance) = fit.pair(1);
    Some(Pattern { axis, shape: Shape::Order, amplitude: fit.solution[1].abs(), chance })
}

/// A linear fit whose pairs of numbers can be tested.
struct Fit {
    solution: DVector<f64>,
    /// (AᵀA)⁻¹
    inverse: DMatrix<f64>,
    /// Mean square of what is left.
    square: f64,
    free: f64,
}

impl Fit {
    fn of(rows: DMatrix<f64>, values: DVector<f64>) -> Option<Fit> {
        if rows.nrows() < POSES_MIN {
            return None;
        }
        let inverse = (rows.transpose() * &rows).cholesky()?.inverse();
        let solution = &inverse * (rows.transpose() * &values);
        let free = (rows.nrows() - rows.ncols()) as f64;
        let square = (&values - rows * &solution).norm_squared() / free;
        Some(Fit { solution, inverse, square, free })
    }

    /// Amplitude of the pair that starts at this column, and the chance of as large a one.
    fn pair(&self, at: usize) -> (f64, f64) {
        let pair = Vector2::new(self.solution[at], self.solution[at + 1]);
        let block = Matrix2::from_fn(|row, column| self.inverse[(at + row, at + column)]);
        let squares = block.try_inverse().map_or(0.0, |weight| pair.dot(&(weight * pair)));
        // Residuals of rounding alone have no pattern worth a name; the quotient is then 0 / 0.
        let quotient = if self.square > 0.0 { squares / (2.0 * self.square) } else { 0.0 };
        (pair.norm(), libm::pow(1.0 + 2.0 * quotient / self.free, -self.free / 2.0))
    }
}
