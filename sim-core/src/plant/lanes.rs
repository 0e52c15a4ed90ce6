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
    let (w, v) = (q[0], [q[1], q[2], q[3]]);
    let vector = plus(plus(times(half, w), v), cross(v, half));
    let raw = [w - dot(v, half), vector[0], vector[1], vector[2]];
    // |raw|² = |q|² (1 + |half|²): known before the product is.
    let size = (w * w + dot(v, v)) * (T::all(1.0) + dot(half, half));
    raw.map(|part| part * inverse_root(size))
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

/// `1/√size`. Near one it is a series, whose next term is below rounding: 35/128 of the fourth power of 1e-4.
#[inline(always)]
pub(crate) fn inverse_root<T: Lane>(size: T) -> T {
    const NEAR: f64 = 1e-4;
    let off = size - T::all(1.0);
    if (off * off).within(T::all(NEAR * NEAR)) {
        let square = off * off;
        let outer = T::all(0.375) - off * T::all(0.3125);
        T::all(1.0) - off * T::all(0.5) + square * outer
    } else {
        size.root().inverse()
    }
}
