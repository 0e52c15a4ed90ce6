//! Units at the edge.
//!
//! A quotient is rounded once: 1.125 mm, which a double holds exactly, becomes the same number as the literal `1.125e-3`. A
//! product with `1e-3` is rounded twice.

use core::f64::consts::PI;
use sim_core::time::Nanos;

/// Length that a robot controller reports, in m.
pub fn metres_from_millimetres(length_mm: f64) -> f64 {
    length_mm / 1000.0
}

/// Length as a robot controller wants it, in mm.
pub fn millimetres_from_metres(length_m: f64) -> f64 {
    length_m * 1000.0
}

/// Angle that a robot controller reports, in rad. A half turn is exactly the nearest number to π.
pub fn radians_from_degrees(angle_deg: f64) -> f64 {
    angle_deg / 180.0 * PI
}

/// Angle as a robot controller wants it, in degrees.
pub fn degrees_from_radians(angle_rad: f64) -> f64 {
    angle_rad / PI * 180.0
}

/// Time that a controller counts in whole milliseconds.
pub fn nanos_from_milliseconds(time_ms: u32) -> Nanos {
    Nanos(i64::from(time_ms) * 1_000_000)
}

/// What one count of a force/torque sensor is worth. Its calibration says how many counts make a newton.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorScale {
    counts_per_n: f64,
    counts_per_n_m: f64,
}

impl SensorScale {
    /// From the sensor's calibration; `None` unless both are finite and above zero.
    pub fn new(counts_per_n: f64, counts_per_n_m: f64) -> Option<Self> {
        let sound = |value: f64| value.is_finite() && value > 0.0;
        (sound(counts_per_n) && sound(counts_per_n_m)).then_some(SensorScale { counts_per_n, counts_per_n_m })
    }

    /// Force of a reading, in N.
    pub fn newtons_from_counts(&self, counts: i32) -> f64 {
        f64::from(counts) / self.counts_per_n
    }

    /// Torque of a reading, in N m.
    pub fn newton_metres_from_counts(&self, counts: i32) -> f64 {
        f64::from(counts) / self.counts_per_n_m
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "proves that bits are equal")]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_the_number_that_one_would_write() {
        // Eighths of a millimetre are exact in a double, so that only the quotient rounds.
        for eighths in -80_000..80_000_i32 {
            let written: f64 = format!("{}e-6", eighths * 125).parse().expect("a number");
            assert_eq!(metres_from_millimetres(f64::from(eighths) / 8.0), written, "{eighths} eighths of a millimetre");
        }
    }

    #[test]
    fn an_angle_meets_its_landmarks() {
        for (degrees, radians) in [(0.0, 0.0), (90.0, PI / 2.0), (-180.0, -PI), (360.0, 2.0 * PI), (45.0, PI / 4.0)] {
            assert_eq!(radians_from_degrees(degrees), radians);
            assert_eq!(degrees_from_radians(radians), degrees);
        }
    }

    #[test]
    fn there_and_back_is_the_same_to_rounding() {
        for i in -1000..1000_i32 {
            let value = f64::from(i) * 0.37;
            // Two roundings, half a unit in the last place each.
            let near = |back: f64| (back - value).abs() <= value.abs() * 2.0 * f64::EPSILON;
            assert!(near(millimetres_from_metres(metres_from_millimetres(value))));
            assert!(near(degrees_from_radians(radians_from_degrees(value))));
        }
    }

    #[test]
    fn counts_become_newtons() {
        // A million counts for a newton and for a newton metre: the usual calibration of ATI's network box.
        let scale = SensorScale::new(1e6, 1e6).expect("a sound calibration");
        assert_eq!(scale.newtons_from_counts(-12_500_000), -12.5);
        assert_eq!(scale.newton_metres_from_counts(250), 0.00025);
        assert_eq!(scale.newtons_from_counts(i32::MIN), -2147.483648);
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(SensorScale::new(bad, 1e6), None);
            assert_eq!(SensorScale::new(1e6, bad), None);
        }
    }

    #[test]
    fn milliseconds_are_whole_nanoseconds() {
        assert_eq!(nanos_from_milliseconds(4), Nanos(4_000_000));
        assert_eq!(nanos_from_milliseconds(u32::MAX), Nanos(4_294_967_295_000_000));
    }
}
