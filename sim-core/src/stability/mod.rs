//! Where the loop with a delay is stable, and how far from the edge.
//!
//! Two questions stay apart. Whether a *two-sided* loop grows is answered by its characteristic roots: `exact`, `planar`,
//! `spectral`, `windows`, `sampled`. Whether a *one-sided* impact leaves faster than it came is answered by computing it:
//! `impact`. The two edges differ by 2 % at small delays and by a third before the second one ceases to exist.

pub mod budget;
mod chebyshev;
pub mod eigen;
pub mod exact;
pub mod impact;
pub mod impedance;
mod mechanical;
pub mod pade;
pub mod planar;
pub mod sampled;
mod sampled_tick;
pub mod space;
pub mod spectral;
pub mod windows;
