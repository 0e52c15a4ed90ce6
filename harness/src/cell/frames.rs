//! Where probe and nozzle are when the robots report their poses, and where a robot must go for a relative pose.
//!
//! `relative = (base_n · rail_n · RIst_n · interface_n)⁻¹ · (base_p · rail_p · RIst_p · interface_p)`: the probe tip in the nozzle
//! frame, positive z closes the gap. A cell with one robot has its nozzle at the origin of the laboratory.
//!
//! | symbol | meaning |
//! |---|---|
//! | base | the robot's BASE in the laboratory, with its rail at zero |
//! | rail | displacement of the base along the rail, in the laboratory's axes |
//! | RIst | the tool in BASE, as the controller counts it: mm, and turns A, B, C about z, y', x'' in deg |
//! | interface | probe tip or nozzle, seen from the tool |
//!
//! A relative command is split: the probe's robot moves, the nozzle's robot holds. Not modelled: a BASE that is not the foot of
//! the robot turns with nothing; the arms are not known here.

use super::config::{Carries, CellConfig, PlaceConfig, RobotConfig};
use crate::recording::Pose as Recorded;
use drivers::{degrees_from_radians, metres_from_millimetres, millimetres_from_metres, radians_from_degrees};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sim_core::frames::{Base, Euler321, Global, Nozzle, Pose, Probe, Tool};

/// What a robot controller reports: the tool in mm and deg, and external axes in mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reported {
    /// `RIst`.
    pub pose_mm_deg: [f64; 6],
    /// `EIPos`.
    pub external_mm: [f64; 6],
}

/// One robot's place in the laboratory.
#[derive(Debug, Clone, Copy)]
struct Station<End> {
    base: Pose<Global, Base>,
    interface: Pose<Tool, End>,
    /// Which external axis, and the way that the base goes.
    rail: Option<(usize, Vector3<f64>)>,
}

impl<End> Station<End> {
    fn of(robot: &RobotConfig) -> Self {
        let rail = robot.rail.as_ref().map(|rail| {
            let axis = rail.axis.bytes().last().map_or(0, |digit| usize::from(digit.saturating_sub(b'1')));
            (axis.min(5), Vector3::from(rail.direction))
        });
        Station { base: placed(&robot.base), interface: placed(&robot.interface), rail }
    }

    /// The robot's BASE with its rail where it is.
    fn standing(&self, external_mm: &[f64; 6]) -> Pose<Global, Base> {
        let Some((axis, direction)) = self.rail else { return self.base };
        let moved_m = metres_from_millimetres(external_mm[axis]);
        Pose::new(self.base.position_m + direction * moved_m, self.base.attitude)
    }

    fn end(&self, reported: &Reported) -> Pose<Global, End> {
        self.standing(&reported.external_mm).then(&tool(&reported.pose_mm_deg)).then(&self.interface)
    }
}

/// The frames of a cell.
#[derive(Debug, Clone, Copy)]
pub struct Places {
    probe: Station<Probe>,
    nozzle: Option<Station<Nozzle>>,
}

impl Places {
    /// The frames that the cell says. `None` where no robot carries the probe, which no checked cell has.
    pub fn of(config: &CellConfig) -> Option<Self> {
        let probe = Station::of(config.robot(Carries::Probe)?);
        Some(Places { probe, nozzle: config.robot(Carries::Nozzle).map(Station::of) })
    }

    fn nozzle(&self, reported: Option<&Reported>) -> Pose<Global, Nozzle> {
        match (&self.nozzle, reported) {
            (Some(station), Some(reported)) => station.end(reported),
            _ => Pose::default(),
        }
    }

    /// The probe tip in the nozzle frame, for what the two controllers report.
    pub fn relative(&self, probe: &Reported, nozzle: Option<&Reported>) -> Pose<Nozzle, Probe> {
        self.nozzle(nozzle).inverse().then(&self.probe.end(probe))
    }

    /// Where the probe's tool must be in its BASE for this relative pose, while the nozzle is where it is: mm and deg.
    pub fn probe_mm_deg(
        &self,
        relative: &Pose<Nozzle, Probe>,
        external_mm: &[f64; 6],
        nozzle: Option<&Reported>,
    ) -> [f64; 6] {
        let tip = self.nozzle(nozzle).then(relative);
        let tool = self.probe.standing(external_mm).inverse().then(&tip).then(&self.probe.interface.inverse());
        mm_deg(&tool)
    }
}

/// A place of a file.
fn placed<A, B>(place: &PlaceConfig) -> Pose<A, B> {
    Pose::new(Vector3::from(place.position_m), turned(place.abc_deg))
}

fn turned([a, b, c]: [f64; 3]) -> UnitQuaternion<f64> {
    let [about_z_rad, about_y_rad, about_x_rad] = [a, b, c].map(radians_from_degrees);
    Euler321 { about_z_rad, about_y_rad, about_x_rad }.attitude()
}

/// A pose as a controller counts it.
fn tool([x, y, z, a, b, c]: &[f64; 6]) -> Pose<Base, Tool> {
    Pose::new(Vector3::new(*x, *y, *z).map(metres_from_millimetres), turned([*a, *b, *c]))
}

fn mm_deg(pose: &Pose<Base, Tool>) -> [f64; 6] {
    let angles = Euler321::of(&pose.attitude);
    let [x, y, z] = [pose.position_m.x, pose.position_m.y, pose.position_m.z].map(millimetres_from_metres);
    let [a, b, c] = [angles.about_z_rad, angles.about_y_rad, angles.about_x_rad].map(degrees_from_radians);
    [x, y, z, a, b, c]
}

/// A relative pose as a recording holds it.
pub fn recorded(pose: &Pose<Nozzle, Probe>) -> Recorded {
    let turn = pose.attitude.coords;
    Recorded { position_m: pose.position_m.into(), orientation_xyzw: [turn.x, turn.y, turn.z, turn.w] }
}

/// A recorded pose as frames count.
pub fn relative(pose: &Recorded) -> Pose<Nozzle, Probe> {
    let [x, y, z, w] = pose.orientation_xyzw;
    Pose::new(Vector3::from(pose.position_m), UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)))
}

/// The nearest turn to an angle: controllers count from -180° to 180°.
pub fn within_half_turn_deg(angle_deg: f64) -> f64 {
    if (-180.0..=180.0).contains(&angle_deg) { angle_deg } else { angle_deg - 360.0 * (angle_deg / 360.0).round() }
}

#[cfg(test)]
mod tests {
    use super::super::config::Cell;
    use super::*;
    use std::path::Path;

    fn two_robots() -> Places {
        let text = Cell::find(Path::new("bench")).unwrap().source.text;
        let second = r#"
[[robot]]
name = "target"
carries = "nozzle"
rsi = "rsi/bench.xml"
listen = "127.0.0.1:49154"
base = { position_m = [3.0, -1.0, 0.5], abc_deg = [180.0, 0.0, 0.0] }
interface = { position_m = [0.1, 0.0, 0.3], abc_deg = [0.0, 90.0, 0.0] }
rail = { axis = "E1", direction = [0.0, 1.0, 0.0] }
"#;
        Places::of(&CellConfig::parse("two", &format!("{text}\n{second}")).unwrap()).unwrap()
    }

    /// By hand: BASE at -1.2 m, tool at 0.992 m, tip 0.2 m further, nozzle at the origin.
    #[test]
    fn one_robot_has_its_nozzle_at_the_origin() {
        let places = Places::of(&Cell::find(Path::new("bench")).unwrap().config).unwrap();
        let probe = Reported { pose_mm_deg: [0.0, 0.0, 992.0, 0.0, 0.0, 0.0], ..Reported::default() };
        let relative = places.relative(&probe, None);
        assert!((relative.position_m - Vector3::new(0.0, 0.0, -0.008)).norm() < 4.0 * f64::EPSILON);
    }

    #[test]
    fn what_a_relative_pose_asks_of_the_probe_is_that_relative_pose() {
        let places = two_robots();
        let nozzle = Reported {
            pose_mm_deg: [1200.0, 300.0, 900.0, 30.0, -20.0, 100.0],
            external_mm: [226_966.932_6, 0.0, 0.0, 0.0, 0.0, 0.0],
        };
        let probe = Reported { pose_mm_deg: [100.0, -50.0, 700.0, -150.0, 35.0, 12.0], ..Reported::default() };
        let relative = places.relative(&probe, Some(&nozzle));
        let asked = places.probe_mm_deg(&relative, &probe.external_mm, Some(&nozzle));
        for (asked, was) in asked.iter().zip(probe.pose_mm_deg) {
            // Roundings of 227 m there and back, in mm; of angles far less.
            assert!((asked - was).abs() < 1e-9, "{asked} {was}");
        }
        let back = super::relative(&recorded(&relative));
        assert!(
            (back.position_m - relative.position_m).norm() == 0.0 && back.attitude.angle_to(&relative.attitude) < 1e-7
        );
    }

    /// The rail moves the nozzle along y of the laboratory: the probe goes back by as much in it.
    #[test]
    fn a_rail_moves_the_base() {
        let places = two_robots();
        let at = |rail_mm: f64| Reported { external_mm: [rail_mm, 0.0, 0.0, 0.0, 0.0, 0.0], ..Reported::default() };
        let probe = Reported::default();
        let near = places.nozzle(Some(&at(0.0))).position_m;
        let far = places.nozzle(Some(&at(2000.0))).position_m;
        assert!((far - near - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-15);
        let gap_m = |rail_mm| places.relative(&probe, Some(&at(rail_mm))).position_m.norm();
        assert!((gap_m(0.0) - gap_m(2000.0)).abs() > 0.1);
    }
}
