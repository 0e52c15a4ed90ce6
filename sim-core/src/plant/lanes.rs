//! Arithmetic and the free turn of a rigid body, written once for one number or for several side by side.
//!
//! Chaser and target turn by the same operations on different numbers. Written over [`Lane`], the compiler puts both into one
//! register: two bodies cost little more than one. Every lane has the bits that it would have alone, but for the number of
//! rounds of the midpoint, which is that of the slowest lane.
//!
//! `μ = M + (T/2) μ × J⁻¹μ`, `q ← q ⊗ (1, T J⁻¹μ/2) / |·|`; symbols in [`super::body`].

use core::ops::{Add, Mul, Sub};

/// A number, or several that share their operations.
pub(crate) trait Lane: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// The same number in every lane.
    fn all(value: f64) -> Self;
    /// Whether no lane is above its limit.
    fn within(self, limit: Self) -> bool;
    /// The root in every lane.
    fn root(self) -> Self;
    /// One over every lane.
    fn inverse(self) -> Self;
}

impl Lane for f64 {
    #[inline(always)]
    fn all(value: f64) -> f64 {
        value
    }
    #[inline(always)]
    fn within(self, limit: f64) -> bool {
        self <= limit
    }
    fn root(self) -> f64 {
        libm::sqrt(self)
    }
    fn inverse(self) -> f64 {
        1.0 / self
    }
}

/// Two numbers side by side: chaser and target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Two(pub f64, pub f64);

impl Add for Two {
    type Output = Two;
    #[inline(always)]
    fn add(self, other: Two) -> Two {
        Two(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for Two {
    type Output = Two;
    #[inline(always)]
    fn sub(self, other: Two) -> Two {
        Two(self.0 - other.0, self.1 - other.1)
    }
}

impl Mul for Two {
    type Output = Two;
    #[inline(always)]
    fn mul(self, other: Two) -> Two {
        Two(self.0 * other.0, self.1 * other.1)
    }
}

impl Lane for Two {
    #[inline(always)]
    fn all(value: f64) -> Two {
        Two(value, value)
    }
    #[inline(always)]
    fn within(self, limit: Two) -> bool {
        (self.0 <= limit.0) & (self.1 <= limit.1)
    }
    fn root(self) -> Two {
        Two(libm::sqrt(self.0), libm::sqrt(self.1))
    }
    fn inverse(self) -> Two {
        Two(1.0 / self.0, 1.0 / self.1)
    }
}

/// x, y, z.
pub(crate) type Triple<T> = [T; 3];

#[inline(always)]
pub(crate) fn plus<T: Lane>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn minus<T: Lane>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot<T: Lane>(a: Triple<T>, b: Triple<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn times<T: Lane>(a: Triple<T>, factor: T) -> Triple<T> {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

#[inline(always)]
pub(crate) fn cross<T: Lane>(a: Triple<T>, b: Triple<T>) -> Triple<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A symmetric matrix: xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Symmetric<T>(pub [T; 6]);

impl<T: Lane> Symmetric<T> {
    #[inline(always)]
    pub(crate) fn times(&self, v: Triple<T>) -> Triple<T> {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        [xx * v[0] + xy * v[1] + xz * v[2], xy * v[0] + yy * v[1] + yz * v[2], xz * v[0] + yz * v[1] + zz * v[2]]
    }
}

/// The quaternion `w, x, y, z` of a body with this angular momentum (global axes), a free turn later.
/// `half_inverse` is `(T/2) J⁻¹`.
#[inline(always)]
pub(crate) fn turned<T: Lane>(q: [T; 4], spin: Triple<T>, half_inverse: &Symmetric<T>) -> [T; 4] {
    let half = half_turn(in_body(q, spin), half_inverse);
    let raw = sum(q, product(q, half));
    // |raw|² = |q|² (1 + |half|²). The first factor is one but for rounding, and known before the turn is.
    let [w, x, y, z] = q;
    let keep = T::all(1.5) - (w * w + x * x + (y * y + z * z)) * T::all(0.5);
    let scale = inverse_root_above(dot(half, half)) * keep;
    raw.map(|part| part * scale)
}

/// Rate of the attitude of a body with this angular momentum; `half_inverse` is `J⁻¹/2`, and q may be a little off unit length.
#[inline(always)]
pub(crate) fn attitude_rate<T: Lane>(q: [T; 4], spin: Triple<T>, half_inverse: &Symmetric<T>) -> [T; 4] {
    product(q, half_inverse.times(in_body(q, spin)))
}

/// `q + other`.
#[inline(always)]
pub(crate) fn sum<T: Lane>(q: [T; 4], other: [T; 4]) -> [T; 4] {
    [q[0] + other[0], q[1] + other[1], q[2] + other[2], q[3] + other[3]]
}

/// `q ⊗ (0, v)`.
#[inline(always)]
fn product<T: Lane>(q: [T; 4], v: Triple<T>) -> [T; 4] {
    let u = [q[1], q[2], q[3]];
    let [x, y, z] = plus(times(v, q[0]), cross(u, v));
    [T::all(0.0) - dot(u, v), x, y, z]
}

/// The quaternion at unit length, if it is within a tick's turn of it.
#[inline(always)]
pub(crate) fn unit<T: Lane>(q: [T; 4]) -> [T; 4] {
    let [w, x, y, z] = q;
    let scale = inverse_root_above(w * w + x * x + (y * y + z * z) - T::all(1.0));
    q.map(|part| part * scale)
}

/// A vector of global axes, in the axes of a body at the attitude q.
#[inline(always)]
pub(crate) fn in_body<T: Lane>(q: [T; 4], global: Triple<T>) -> Triple<T> {
    // v + 2 w (v × u) + 2 u × (u × v) for the inverse turn, with u the vector part.
    let u = [q[1], q[2], q[3]];
    let side = cross(global, times(u, T::all(2.0)));
    plus(plus(global, times(side, q[0])), cross(side, u))
}

/// `(T/2) J⁻¹μ` with `μ = M + μ × (T/2) J⁻¹μ`, by iteration: each round gains the factor T|ω|, so that two or three are usual.
/// Above about 1 rad in a tick it need not converge; the answer is then poor, and the audit of energy says so.
#[inline(always)]
fn half_turn<T: Lane>(spin: Triple<T>, half_inverse: &Symmetric<T>) -> Triple<T> {
    /// Square of 1e-18. After a round that changed μ by c, relatively, c |half| is left, and c |half|² of the energy at most.
    const ENERGY: f64 = 1e-36;
    const ROUNDS_MAX: usize = 50;
    let mut half = half_inverse.times(spin);
    let mut middle = plus(spin, cross(spin, half));
    for _ in 1..ROUNDS_MAX {
        half = half_inverse.times(middle);
        let next = plus(spin, cross(middle, half));
        let change = minus(next, middle);
        middle = next;
        let angle = dot(half, half);
        if (dot(change, change) * angle * angle).within(dot(middle, middle) * T::all(ENERGY)) {
            break;
        }
    }
    half_inverse.times(middle)
}

/// `1/√(1 + off)`. Near one it is a series, whose next term is below rounding: 35/128 of the fourth power of 1e-4.
#[inline(always)]
fn inverse_root_above<T: Lane>(off: T) -> T {
    const NEAR: f64 = 1e-4;
    let square = off * off;
    if square.within(T::all(NEAR * NEAR)) {
        let outer = T::all(0.375) - off * T::all(0.3125);
        (T::all(1.0) - off * T::all(0.5)) + square * outer
    } else {
        (T::all(1.0) + off).root().inverse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quaternion_comes_to_unit_length_from_near_and_far() {
        for size in [0.5, 0.9999, 0.99996, 1.0, 1.00004, 1.0001, 3.0] {
            let q = unit([0.5, -0.5, 0.5, -0.5].map(|part| part * size));
            let norm = libm::sqrt(q.iter().map(|part| part * part).sum());
            assert!((norm - 1.0).abs() <= 2.0 * f64::EPSILON, "{size}");
        }
    }

    /// Both lanes do what one alone does.
    #[test]
    fn two_lanes_are_two_bodies() {
        let attitudes = [[0.8, 0.0, 0.6, 0.0], [0.5, 0.5, -0.5, 0.5]];
        let spins = [[0.3, -0.2, 0.5], [0.4, 0.1, -0.3]];
        let inverses = [Symmetric([2e-4, 3e-4, 4e-4, 1e-5, 0.0, 2e-5]), Symmetric([3e-4, 2e-4, 2e-4, 0.0, 1e-5, 0.0])];
        let beside = |a: f64, b: f64| Two(a, b);
        let both = turned(
            core::array::from_fn(|i| beside(attitudes[0][i], attitudes[1][i])),
            core::array::from_fn(|i| beside(spins[0][i], spins[1][i])),
            &Symmetric(core::array::from_fn(|i| beside(inverses[0].0[i], inverses[1].0[i]))),
        );
        for (lane, get) in [|two: &Two| two.0, |two: &Two| two.1].iter().enumerate() {
            let alone = turned(attitudes[lane], spins[lane], &inverses[lane]);
            assert_eq!(both.each_ref().map(get).map(f64::to_bits), alone.map(f64::to_bits));
        }
    }
}
