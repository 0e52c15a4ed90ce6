//! Eigenvalues of a general real matrix: balance, reduce to Hessenberg form, then shifted QR steps in complex arithmetic.
//!
//! One shift at a time, Wilkinson's, with an exceptional one every tenth step, so that the cyclic matrices which delays bring
//! do not stall it. Only the active block is kept up to date, since no vectors are asked for.

use alloc::vec::Vec;
use nalgebra::{Complex, DMatrix};

/// Steps for one eigenvalue before the search is given up; two or three are usual.
const STEPS_MAX: usize = 120;
/// A number whose square is still one, and so is the square of its inverse.
const BEYOND: f64 = 1e120;

/// |z|.
pub fn modulus(z: Complex<f64>) -> f64 {
    // Scaled, so that squares of small numbers do not vanish.
    let (large, small) = if z.re.abs() > z.im.abs() { (z.re.abs(), z.im.abs()) } else { (z.im.abs(), z.re.abs()) };
    if large == 0.0 { 0.0 } else { large * libm::sqrt(1.0 + (small / large) * (small / large)) }
}

/// e^z.
pub fn exponential(z: Complex<f64>) -> Complex<f64> {
    let size = libm::exp(z.re);
    Complex::new(size * libm::cos(z.im), size * libm::sin(z.im))
}

/// The root of z with a real part that is not negative.
fn square_root(z: Complex<f64>) -> Complex<f64> {
    let size = modulus(z);
    let re = libm::sqrt(0.5 * (size + z.re).max(0.0));
    let im = libm::sqrt(0.5 * (size - z.re).max(0.0));
    Complex::new(re, if z.im < 0.0 { -im } else { im })
}

/// All eigenvalues, in no order; `None` if the matrix is not square and finite, if its numbers are out of all proportion, or if the steps do not converge.
pub fn eigenvalues(mut matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let n = matrix.nrows();
    if n != matrix.ncols() || !matrix.iter().all(|value| value.is_finite()) {
        return None;
    }
    if n < 2 {
        return Some(matrix.iter().map(|&value| Complex::new(value, 0.0)).collect());
    }
    // Balancing works on squares, and never ends where they overflow or vanish.
    let largest = matrix.amax();
    if largest > 0.0 && !(1.0 / BEYOND..=BEYOND).contains(&largest) {
        return None;
    }
    matrix.iter_mut().filter(|value| value.abs() * BEYOND < largest).for_each(|value| *value = 0.0);
    nalgebra::linalg::balancing::balance_parlett_reinsch(&mut matrix);
    let reduced = matrix.hessenberg().unpack_h();
    let mut h = Hessenberg { n, values: Vec::with_capacity(n * n) };
    for row in 0..n {
        h.values.extend((0..n).map(|column| Complex::new(reduced[(row, column)], 0.0)));
    }
    h.diagonalise()
}

/// Largest modulus of the eigenvalues, as `eigenvalues`.
pub fn spectral_radius(matrix: DMatrix<f64>) -> Option<f64> {
    Some(eigenvalues(matrix)?.into_iter().map(modulus).fold(0.0, f64::max))
}

/// An upper Hessenberg matrix, row by row.
struct Hessenberg {
    n: usize,
    values: Vec<Complex<f64>>,
}

impl Hessenberg {
    fn at(&self, row: usize, column: usize) -> Complex<f64> {
        self.values[row * self.n + column]
    }

    fn diagonalise(mut self) -> Option<Vec<Complex<f64>>> {
        let scale = self.values.iter().map(|&value| modulus(value)).fold(0.0, f64::max);
        let mut last = self.n - 1;
        let mut steps = 0;
        while last > 0 {
            let first = self.first_of_block(last, scale);
            if first == last {
                last -= 1;
                steps = 0;
                continue;
            }
            if steps == STEPS_MAX {
                return None;
            }
            steps += 1;
            let shift = if steps % 10 == 0 {
                let size = modulus(self.at(last, last - 1)) + self.at(last - 1, last - 1).re.abs();
                self.at(last, last) + Complex::new(size, 0.3 * size)
            } else {
                self.wilkinson_shift(last)
            };
            self.step(first, last, shift);
        }
        Some((0..self.n).map(|i| self.at(i, i)).collect())
    }

    /// Where the unreduced block that ends at `last` begins; entries below the diagonal that are rounding become zero.
    fn first_of_block(&mut self, last: usize, scale: f64) -> usize {
        let mut row = last;
        while row > 0 {
            let around = modulus(self.at(row, row)) + modulus(self.at(row - 1, row - 1));
            let compared = if around == 0.0 { scale } else { around };
            if modulus(self.at(row, row - 1)) <= f64::EPSILON * compared {
                self.values[row * self.n + row - 1] = Complex::new(0.0, 0.0);
                return row;
            }
            row -= 1;
        }
        0
    }

    /// The eigenvalue of the last two rows and columns that is nearer to the corner.
    fn wilkinson_shift(&self, last: usize) -> Complex<f64> {
        let (a, b) = (self.at(last - 1, last - 1), self.at(last - 1, last));
        let (c, d) = (self.at(last, last - 1), self.at(last, last));
        let half = (a - d) * 0.5;
        let root = square_root(half * half + b * c);
        let (plus, minus) = (half + root, half - root);
        let far = if modulus(plus) > modulus(minus) { plus } else { minus };
        if modulus(far) == 0.0 { d } else { d - b * c / far }
    }

    /// One QR step on the block `first..=last`.
    fn step(&mut self, first: usize, last: usize, shift: Complex<f64>) {
        let n = self.n;
        for i in first..=last {
            self.values[i * n + i] -= shift;
        }
        let mut rotations = Vec::with_capacity(last - first);
        for row in first..last {
            let (x, y) = (self.at(row, row), self.at(row + 1, row));
            let size = libm::sqrt(x.norm_sqr() + y.norm_sqr());
            let (c, s) = if size == 0.0 {
                (Complex::new(1.0, 0.0), Complex::new(0.0, 0.0))
            } else {
                (x.conj() / size, y.conj() / size)
            };
            let (upper, lower) = self.values.split_at_mut((row + 1) * n);
            for (up, low) in upper[row * n + row..row * n + last + 1].iter_mut().zip(&mut lower[row..=last]) {
                let (a, b) = (*up, *low);
                *up = c * a + s * b;
                *low = c.conj() * b - s.conj() * a;
            }
            rotations.push((c, s));
        }
        for (offset, &(c, s)) in rotations.iter().enumerate() {
            let column = first + offset;
            for row in first..=(column + 1).min(last) {
                let (a, b) = (self.at(row, column), self.at(row, column + 1));
                self.values[row * n + column] = a * c.conj() + b * s.conj();
                self.values[row * n + column + 1] = b * c - a * s;
            }
        }
        for i in first..=last {
            self.values[i * n + i] += shift;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    fn sorted(mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        values.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        values
    }

    #[test]
    fn numbers_out_of_all_proportion_come_to_an_end() {
        let companion = |size: f64| DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -size, -size]);
        assert_eq!(eigenvalues(companion(1e303)), None);
        assert!(eigenvalues(companion(1e-297)).is_some());
        assert!(eigenvalues(companion(1e100)).is_some());
    }

    #[test]
    fn a_companion_matrix_has_the_roots_of_its_polynomial() {
        // (s - 1)(s + 2)(s² + 2 s + 10) = s⁴ + 3 s³ + 10 s² + 6 s - 20
        let companion = DMatrix::from_row_slice(
            4,
            4,
            &[-3.0, -10.0, -6.0, 20.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        );
        let expected =
            vec![Complex::new(-2.0, 0.0), Complex::new(-1.0, -3.0), Complex::new(-1.0, 3.0), Complex::new(1.0, 0.0)];
        for (found, expected) in sorted(eigenvalues(companion).unwrap()).iter().zip(expected) {
            // Simple roots of a matrix of norm 20: some ten roundings of it.
            assert!(modulus(found - expected) < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn a_cyclic_shift_has_the_roots_of_one() {
        // All moduli are equal and its diagonal is empty: plain shifts stand still on it.
        for n in [2, 3, 8, 25] {
            let shift = DMatrix::from_fn(n, n, |row, column| if (row + 1) % n == column { 1.0 } else { 0.0 });
            let found = eigenvalues(shift).unwrap();
            assert!(found.iter().all(|value| (modulus(*value) - 1.0).abs() < 1e-12), "{n}: {found:?}");
            let sum = found.iter().fold(Complex::new(0.0, 0.0), |sum, value| sum + value);
            assert!(modulus(sum) < 1e-12);
        }
    }

    #[test]
    fn a_nilpotent_matrix_is_answered() {
        let ring = DMatrix::from_fn(12, 12, |row, column| if row == column + 1 { 1.0 } else { 0.0 });
        assert!(spectral_radius(ring).unwrap() < 0.1);
        assert_eq!(eigenvalues(DMatrix::from_element(2, 2, f64::NAN)), None);
    }
}
