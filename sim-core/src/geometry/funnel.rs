//! The wall around an opening that narrows: a plate, pierced by a cone about the z axis.
//!
//! In the half plane of radius r and depth z the wall is `0 ≤ z ≤ L, r ≥ R(z)`, where R falls from the rim to the throat. Its
//! corners are the rim and the throat, both circles. The signed distance is exact outside the wall; inside, it is the way out
//! through the nearest face. It is continuous everywhere, and so is its gradient outside the wall.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | r, z | distance from the axis; depth behind the plane of the rim | m |
//! | α | half angle: between axis and wall | rad |
//! | s | distance from the wall's inner face, `(r_rim - r) cos α - z sin α` | m |
//! | t | way along the inner face from the rim, `(r_rim - r) sin α + z cos α` | m |

/// A plate with a conical or straight hole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Funnel {
    rim_m: f64,
    throat_m: f64,
    depth_m: f64,
    sin: f64,
    cos: f64,
    wall_m: f64,
}

/// Distance from the wall, positive outside it, and its gradient, a unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Distance {
    /// Signed distance.
    pub distance_m: f64,
    /// Component of the gradient along the radius.
    pub radial: f64,
    /// Component of the gradient along z.
    pub axial: f64,
}

impl Funnel {
    /// From the radius of the rim, the radius of the throat, and the depth between them.
    pub(super) fn new(rim_m: f64, throat_m: f64, depth_m: f64) -> Self {
        let narrowing_m = rim_m - throat_m;
        let wall_m = libm::sqrt(narrowing_m * narrowing_m + depth_m * depth_m);
        Funnel { rim_m, throat_m, depth_m, sin: narrowing_m / wall_m, cos: depth_m / wall_m, wall_m }
    }

    /// Distance of the point at radius `r` and depth `z` from the wall.
    #[inline]
    pub(super) fn distance(&self, r: f64, z: f64) -> Distance {
        if z < 0.0 && r >= self.rim_m {
            return Distance { distance_m: -z, radial: 0.0, axial: -1.0 };
        }
        if z > self.depth_m && r >= self.throat_m {
            return Distance { distance_m: z - self.depth_m, radial: 0.0, axial: 1.0 };
        }
        let s = (self.rim_m - r) * self.cos - z * self.sin;
        let t = (self.rim_m - r) * self.sin + z * self.cos;
        let face = Distance { distance_m: s, radial: -self.cos, axial: -self.sin };
        if s > 0.0 || z > self.depth_m {
            if t < 0.0 {
                return circle(r - self.rim_m, z).unwrap_or(face);
            }
            if t > self.wall_m {
                return circle(r - self.throat_m, z - self.depth_m).unwrap_or(face);
            }
            return face;
        }
        if -z > s && -z >= z - self.depth_m {
            return Distance { distance_m: -z, radial: 0.0, axial: -1.0 };
        }
        if z - self.depth_m > s {
            return Distance { distance_m: z - self.depth_m, radial: 0.0, axial: 1.0 };
        }
        face
    }
}

/// Distance from a circle about the axis, of which the point is `radial_m` and `axial_m` away in its half plane; none on it.
#[inline]
pub(super) fn circle(radial_m: f64, axial_m: f64) -> Option<Distance> {
    let distance_m = libm::sqrt(radial_m * radial_m + axial_m * axial_m);
    (distance_m > 0.0).then(|| Distance { distance_m, radial: radial_m / distance_m, axial: axial_m / distance_m })
}
