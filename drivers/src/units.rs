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

/// Unit in which a sensor counts force, with its code on ATI's pages (reference/PROTOCOLS.md, section 2.6).
///
/// | unit | N | from |
/// |---|---|---|
/// | lbf | 4.4482216152605 | pound 0.45359237 kg (1959), standard gravity 9.80665 m/s² (1901): exact |
/// | kgf, gf | 9.80665, 0.00980665 | standard gravity: exact |
/// | klbf, kN | a thousand of the above | |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceUnit {
    /// Pound-force, code 1.
    PoundForce,
    /// Newton, code 2.
    Newton,
    /// A thousand pound-force, code 3.
    KilopoundForce,
    /// Kilonewton, code 4.
    Kilonewton,
    /// Kilogram-force, code 5.
    KilogramForce,
    /// Gram-force, code 6.
    GramForce,
}

impl ForceUnit {
    /// Every unit, in the order of the codes, from 1.
    pub const ALL: [ForceUnit; 6] = [
        ForceUnit::PoundForce,
        ForceUnit::Newton,
        ForceUnit::KilopoundForce,
        ForceUnit::Kilonewton,
        ForceUnit::KilogramForce,
        ForceUnit::GramForce,
    ];

    /// Unit of a code on ATI's pages.
    pub fn of_code(code: u8) -> Option<ForceUnit> {
        Self::ALL.get(usize::from(code).checked_sub(1)?).copied()
    }

    /// Unit of a text, whatever its hyphens and capitals.
    pub fn of_text(text: &str) -> Option<ForceUnit> {
        let plain = letters(text);
        Self::ALL.into_iter().find(|unit| unit.text().eq_ignore_ascii_case(&plain))
    }

    /// How the sensor's pages write it.
    pub fn text(self) -> &'static str {
        match self {
            ForceUnit::PoundForce => "lbf",
            ForceUnit::Newton => "N",
            ForceUnit::KilopoundForce => "klbf",
            ForceUnit::Kilonewton => "kN",
            ForceUnit::KilogramForce => "kgf",
            ForceUnit::GramForce => "gf",
        }
    }

    /// Newtons in one of it.
    pub fn newtons(self) -> f64 {
        match self {
            ForceUnit::PoundForce => 4.4482216152605,
            ForceUnit::Newton => 1.0,
            ForceUnit::KilopoundForce => 4448.2216152605,
            ForceUnit::Kilonewton => 1000.0,
            ForceUnit::KilogramForce => 9.80665,
            ForceUnit::GramForce => 0.00980665,
        }
    }
}

/// Unit in which a sensor counts torque, with its code on ATI's pages. An inch is 0.0254 m, a foot twelve (1959): exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TorqueUnit {
    /// Pound-force inch, code 1.
    PoundForceInch,
    /// Pound-force foot, code 2.
    PoundForceFoot,
    /// Newton metre, code 3.
    NewtonMetre,
    /// Newton millimetre, code 4.
    NewtonMillimetre,
    /// Kilogram-force centimetre, code 5.
    KilogramForceCentimetre,
    /// Kilonewton metre, code 6.
    KilonewtonMetre,
}

impl TorqueUnit {
    /// Every unit, in the order of the codes, from 1.
    pub const ALL: [TorqueUnit; 6] = [
        TorqueUnit::PoundForceInch,
        TorqueUnit::PoundForceFoot,
        TorqueUnit::NewtonMetre,
        TorqueUnit::NewtonMillimetre,
        TorqueUnit::KilogramForceCentimetre,
        TorqueUnit::KilonewtonMetre,
    ];

    /// Unit of a code on ATI's pages.
    pub fn of_code(code: u8) -> Option<TorqueUnit> {
        Self::ALL.get(usize::from(code).checked_sub(1)?).copied()
    }

    /// Unit of a text, whatever its hyphens and capitals.
    pub fn of_text(text: &str) -> Option<TorqueUnit> {
        let plain = letters(text);
        Self::ALL.into_iter().find(|unit| unit.text().eq_ignore_ascii_case(&plain))
    }

    /// How the sensor's pages write it, without a hyphen.
    pub fn text(self) -> &'static str {
        match self {
            TorqueUnit::PoundForceInch => "lbfin",
            TorqueUnit::PoundForceFoot => "lbfft",
            TorqueUnit::NewtonMetre => "Nm",
            TorqueUnit::NewtonMillimetre => "Nmm",
            TorqueUnit::KilogramForceCentimetre => "kgfcm",
            TorqueUnit::KilonewtonMetre => "kNm",
        }
    }

    /// Newton metres in one of it.
    pub fn newton_metres(self) -> f64 {
        match self {
            TorqueUnit::PoundForceInch => 0.1129848290276167,
            TorqueUnit::PoundForceFoot => 1.3558179483314004,
            TorqueUnit::NewtonMetre => 1.0,
            TorqueUnit::NewtonMillimetre => 0.001,
            TorqueUnit::KilogramForceCentimetre => 0.0980665,
            TorqueUnit::KilonewtonMetre => 1000.0,
        }
    }
}

fn letters(text: &str) -> String {
    text.chars().filter(char::is_ascii_alphanumeric).collect()
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

    /// From counts for one unit of each kind, as a sensor's page has them.
    pub fn from_units(per_force: f64, force: ForceUnit, per_torque: f64, torque: TorqueUnit) -> Option<Self> {
        SensorScale::new(per_force / force.newtons(), per_torque / torque.newton_metres())
    }

    /// Counts that one newton makes.
    pub fn counts_per_n(&self) -> f64 {
        self.counts_per_n
    }

    /// Counts that one newton metre makes.
    pub fn counts_per_n_m(&self) -> f64 {
        self.counts_per_n_m
    }

    /// Counts of a wrench in N and N m, rounded to the nearest, and held at the limits of the type as a sensor does.
    pub fn counts_from_wrench(&self, wrench: [f64; 6]) -> [i32; 6] {
        let [fx, fy, fz, tx, ty, tz] = wrench;
        let [fx, fy, fz] = [fx, fy, fz].map(|force_n| (force_n * self.counts_per_n).round() as i32);
        let [tx, ty, tz] = [tx, ty, tz].map(|torque_n_m| (torque_n_m * self.counts_per_n_m).round() as i32);
        [fx, fy, fz, tx, ty, tz]
    }

    /// Wrench of six counts, in N and N m.
    pub fn wrench_from_counts(&self, counts: [i32; 6]) -> [f64; 6] {
        let [fx, fy, fz, tx, ty, tz] = counts;
        let [fx, fy, fz] = [fx, fy, fz].map(|count| self.newtons_from_counts(count));
        let [tx, ty, tz] = [tx, ty, tz].map(|count| self.newton_metres_from_counts(count));
        [fx, fy, fz, tx, ty, tz]
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
    fn every_unit_is_the_exact_product() {
        // Whole numbers of 1e-18 N and 1e-18 N m, so that nothing rounds before the last step.
        let pound_force = 45_359_237_u128 * 980_665 * 100_000; // 1e-8 kg times 1e-5 m/s², in 1e-18 N
        let kilogram_force = 980_665_u128 * 10_000_000_000_000;
        let number = |times_1e18: u128| format!("{times_1e18}e-18").parse::<f64>().expect("a number");
        let newton = 10_u128.pow(18);
        let forces =
            [pound_force, newton, pound_force * 1000, newton * 1000, kilogram_force, kilogram_force / 1000].map(number);
        assert_eq!(ForceUnit::ALL.map(ForceUnit::newtons), forces);
        for text in ["N", "n", "kN", "lbf", "klbf", "gf", "kgf"] {
            assert!(ForceUnit::of_text(text).is_some(), "{text}");
        }
        for text in ["Nm", "N-m", "lbf-in", "lbf-ft", "Nmm", "N-mm", "kgf-cm", "kN-m"] {
            assert!(TorqueUnit::of_text(text).is_some(), "{text}");
        }
        assert_eq!((ForceUnit::of_text("N-m"), TorqueUnit::of_text("N")), (None, None));
        assert_eq!(ForceUnit::of_code(2).map(ForceUnit::text), Some("N"));
        assert_eq!(TorqueUnit::of_code(3).map(TorqueUnit::text), Some("Nm"));
        assert_eq!((ForceUnit::of_code(0), TorqueUnit::of_code(7)), (None, None));
        let torques = [
            pound_force * 254 / 10_000,
            pound_force * 3048 / 10_000,
            newton,
            newton / 1000,
            kilogram_force / 100,
            newton * 1000,
        ];
        assert_eq!(TorqueUnit::ALL.map(TorqueUnit::newton_metres), torques.map(number));
    }

    #[test]
    fn counts_stop_at_the_limits_of_the_type() {
        let scale = SensorScale::new(1e6, 1e6).expect("a sound calibration");
        let counts = scale.counts_from_wrench([12.5, 1e9, f64::NAN, -1e9, -0.000001, 0.0]);
        assert_eq!(counts, [12_500_000, i32::MAX, 0, i32::MIN, -1, 0]);
        assert_eq!(scale.wrench_from_counts([12_500_000, 0, 0, 0, -1, 0])[0], 12.5);
    }

    #[test]
    fn milliseconds_are_whole_nanoseconds() {
        assert_eq!(nanos_from_milliseconds(4), Nanos(4_000_000));
        assert_eq!(nanos_from_milliseconds(u32::MAX), Nanos(4_294_967_295_000_000));
    }
}
