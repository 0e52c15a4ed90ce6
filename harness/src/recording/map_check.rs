//! What a map must obey, and the look-ups and conversions that follow from it.

use super::map::{AxisMap, AxisName, Clock, ForceSign, ForceUnit, Map, Role, SensorMap, TorqueUnit};
use super::session::Wrench;

/// Rounding of a quaternion that a person writes with four digits.
const UNIT_LENGTH_ERROR_MAX: f64 = 1e-3;

/// Says which key is wrong, and what is wrong with it.
pub(super) fn check(map: &Map) -> Result<(), (&'static str, String)> {
    if map.schema != 1 {
        return Err(("schema", format!("schema = {} is not known, expected 1", map.schema)));
    }
    let sensor = &map.sensor;
    let length = norm(&sensor.rotation_to_nozzle_xyzw);
    if (length - 1.0).abs() > UNIT_LENGTH_ERROR_MAX || !length.is_finite() {
        let what = format!("rotation_to_nozzle_xyzw has length {length}, expected 1 within {UNIT_LENGTH_ERROR_MAX}");
        return Err(("rotation_to_nozzle_xyzw", what));
    }
    if let Some(angles) = sensor.rotation_to_nozzle_euler_zyx_deg {
        if angles.iter().any(|angle| !angle.is_finite()) {
            let what = format!("rotation_to_nozzle_euler_zyx_deg = {angles:?} deg is not finite");
            return Err(("rotation_to_nozzle_euler_zyx_deg", what));
        }
        if sensor.rotation_to_nozzle_xyzw.map(f64::to_bits) != [0.0, 0.0, 0.0, 1.0].map(f64::to_bits) {
            let what = "the rotation is given twice, as a quaternion and as angles; give one".to_owned();
            return Err(("rotation_to_nozzle_euler_zyx_deg", what));
        }
    }
    if sensor.gravity_m_per_s2.iter().any(|part| !part.is_finite()) {
        return Err(("gravity_m_per_s2", format!("gravity_m_per_s2 = {:?} is not finite", sensor.gravity_m_per_s2)));
    }
    if map.axis.sign.abs() != 1 {
        return Err(("sign", format!("sign = {} is neither 1 nor -1", map.axis.sign)));
    }
    if map.axis.travel == map.axis.pitch {
        return Err(("pitch", "travel and pitch are the same axis".to_owned()));
    }
    check_topics(map)?;
    check_factors(map)
}

fn check_topics(map: &Map) -> Result<(), (&'static str, String)> {
    let mut seen: Vec<&str> = Vec::new();
    for (role, topic) in roles(map) {
        if topic.is_empty() || seen.contains(&topic) {
            let fault = if topic.is_empty() {
                "is empty; leave the key out"
            } else {
                "plays two roles; each has its own topic"
            };
            return Err((role.id(), format!("topic `{topic}` of {} {fault}", role.id())));
        }
        seen.push(topic);
    }
    Ok(())
}

fn check_factors(map: &Map) -> Result<(), (&'static str, String)> {
    let Some(csv) = &map.csv else { return Ok(()) };
    let factors = [
        ("time_s_per_unit", csv.time_s_per_unit),
        ("commanded_m_per_unit", csv.commanded_m_per_unit),
        ("measured_m_per_unit", csv.measured_m_per_unit),
        ("sensed_n_per_unit", csv.sensed_n_per_unit),
        ("applied_n_per_unit", csv.applied_n_per_unit),
    ];
    for (key, factor) in factors {
        let usable = factor.is_normal() && (key != "time_s_per_unit" || factor > 0.0);
        if !usable {
            return Err((key, format!("{key} = {factor} is not a usable factor")));
        }
    }
    Ok(())
}

/// The mapped roles and their topics, in a fixed order.
pub(super) fn roles(map: &Map) -> Vec<(Role, &str)> {
    let topics = &map.topics;
    let all = [
        (Role::Commanded, &topics.commanded),
        (Role::Measured, &topics.measured),
        (Role::Twist, &topics.twist),
        (Role::Sensed, &topics.sensed),
        (Role::Applied, &topics.applied),
    ];
    all.into_iter().filter_map(|(role, topic)| topic.as_deref().map(|topic| (role, topic))).collect()
}

/// The clock that dates a role's samples.
pub(crate) fn clock_of(map: &Map, role: Role) -> Clock {
    let clocks = &map.clock_of;
    let own = match role {
        Role::Commanded => clocks.commanded,
        Role::Measured => clocks.measured,
        Role::Twist => clocks.twist,
        Role::Sensed => clocks.sensed,
        Role::Applied => clocks.applied,
    };
    own.unwrap_or(map.clock)
}

impl AxisName {
    /// Position in a vector.
    pub const fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

impl AxisMap {
    /// The component along the direction that closes the gap.
    pub fn along(&self, vector: [f64; 3]) -> f64 {
        vector[self.travel.index()] * f64::from(self.sign)
    }

    /// The vector with that component and nothing else.
    pub fn vector(&self, along: f64) -> [f64; 3] {
        let mut vector = [0.0; 3];
        vector[self.travel.index()] = along * f64::from(self.sign);
        vector
    }
}

impl SensorMap {
    /// Turns vectors from sensor axes to nozzle-parallel axes; unit quaternion x, y, z, w.
    pub fn rotation_xyzw(&self) -> [f64; 4] {
        let Some([z_deg, y_deg, x_deg]) = self.rotation_to_nozzle_euler_zyx_deg else {
            let length = norm(&self.rotation_to_nozzle_xyzw);
            return self.rotation_to_nozzle_xyzw.map(|part| part / length);
        };
        let half = |degrees: f64| libm::sincos(degrees * core::f64::consts::PI / 360.0);
        let (sz, cz) = half(z_deg);
        let (sy, cy) = half(y_deg);
        let (sx, cx) = half(x_deg);
        [
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
            cx * cy * cz + sx * sy * sz,
        ]
    }

    /// From what the sensor reports to a force on the probe in nozzle-parallel axes, in N and N m.
    pub(super) fn convert(&self, rotation_xyzw: [f64; 4], reported: Wrench) -> Wrench {
        let sign = match self.force_sign {
            ForceSign::OnProbe => 1.0,
            ForceSign::OnTarget => -1.0,
        };
        let force = sign * newton_per(self.force_unit);
        let torque = sign * newton_metre_per(self.torque_unit);
        Wrench {
            force_n: rotate(rotation_xyzw, reported.force_n).map(|part| part * force),
            torque_n_m: rotate(rotation_xyzw, reported.torque_n_m).map(|part| part * torque),
        }
    }
}

const fn newton_per(unit: ForceUnit) -> f64 {
    match unit {
        ForceUnit::Newton => 1.0,
        ForceUnit::Millinewton => 1e-3,
        ForceUnit::Kilonewton => 1e3,
        // 0.453 592 37 kg times 9.806 65 m/s², both exact by definition.
        ForceUnit::PoundForce => 4.448_221_615_260_5,
    }
}

const fn newton_metre_per(unit: TorqueUnit) -> f64 {
    match unit {
        TorqueUnit::NewtonMetre => 1.0,
        TorqueUnit::MillinewtonMetre | TorqueUnit::NewtonMillimetre => 1e-3,
    }
}

pub(super) fn norm(parts: &[f64]) -> f64 {
    parts.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// v + 2 w (u × v) + 2 u × (u × v), with q = (u, w). The identity leaves every bit as it is.
fn rotate([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    if [x, y, z].iter().all(|part| part.abs() <= 0.0) {
        return v;
    }
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let u = [x, y, z];
    let uv = cross(u, v);
    let uuv = cross(u, uv);
    [0, 1, 2].map(|i| v[i] + 2.0 * (w * uv[i] + uuv[i]))
}
