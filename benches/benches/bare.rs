//! What somebody writes by hand when nothing has to be exchanged, recorded or disturbed: the floor that a step is held against.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Dead time, in steps of 1 ms.
const LATE: usize = 16;
const STEP_S: f64 = 1e-3;

/// One axis: a delayed spring and dashpot that never pulls, and a point of 63.2 kg. Returns the last velocity.
pub fn axis(steps: usize) -> f64 {
    let (mass_kg, stiffness, damping) = (63.2, 1066.0, 46.0);
    let mut ring = [0.0; LATE];
    let mut head = 0;
    let (mut position_m, mut velocity) = (-0.010_13_f64, 0.035_f64);
    for _ in 0..steps {
        let force_n = ring[head];
        ring[head] = if position_m > 0.0 { (stiffness * position_m + damping * velocity).max(0.0) } else { 0.0 };
        head = if head + 1 == LATE { 0 } else { head + 1 };
        velocity -= force_n * STEP_S / mass_kg;
        position_m += velocity * STEP_S;
    }
    velocity
}

/// A free body.
struct Free {
    position_m: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    /// In body axes.
    rate: Vector3<f64>,
    mass_kg: f64,
    inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl Free {
    fn new(mass_kg: f64, moment: f64, position_m: Vector3<f64>) -> Self {
        let inertia = Matrix3::new(moment, 0.1, 0.0, 0.1, 1.2 * moment, 0.0, 0.0, 0.0, 1.5 * moment);
        Free {
            position_m,
            attitude: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            rate: Vector3::new(0.01, -0.02, 0.005),
            mass_kg,
            inertia,
            inverse: inertia.try_inverse().expect("its diagonal dominates"),
        }
    }

    fn axes(&self) -> Matrix3<f64> {
        self.attitude.to_rotation_matrix().into_inner()
    }

    fn advance(&mut self, axes: &Matrix3<f64>, force_n: &Vector3<f64>, at_m: &Vector3<f64>) {
        let torque = axes.tr_mul(&(at_m - self.position_m).cross(force_n));
        self.velocity += force_n * (STEP_S / self.mass_kg);
        self.position_m += self.velocity * STEP_S;
        let gyration = self.rate.cross(&(self.inertia * self.rate));
        self.rate += self.inverse * (torque - gyration) * STEP_S;
        let half = self.rate * (0.5 * STEP_S);
        let turned = self.attitude.into_inner() * Quaternion::new(1.0, half.x, half.y, half.z);
        self.attitude = UnitQuaternion::new_normalize(turned);
    }
}

/// Six axes: two free bodies, one delayed contact of a point with a plane off their centres. Returns the chaser's last velocity.
pub fn space(steps: usize) -> f64 {
    let (stiffness, damping) = (1066.0, 46.0);
    let mut chaser = Free::new(60.0, 4.0, Vector3::new(0.0, 0.0, -0.61));
    let mut target = Free::new(200.0, 30.0, Vector3::new(0.1, -0.1, 0.8));
    chaser.velocity.z = 0.035;
    let (probe_m, nozzle_m) = (Vector3::new(0.05, 0.02, 0.6), Vector3::new(-0.05, 0.1, -0.8));
    let mut ring = [Vector3::zeros(); LATE];
    let mut head = 0;
    for _ in 0..steps {
        let (probe, nozzle) = (chaser.axes(), target.axes());
        let arm_m = probe * probe_m;
        let tip_m = chaser.position_m + arm_m;
        let seat_m = target.position_m + nozzle * nozzle_m;
        let normal = nozzle.column(2).into_owned();
        let depth_m = normal.dot(&(tip_m - seat_m));
        let tip = chaser.velocity + (probe * chaser.rate).cross(&arm_m);
        let seat = target.velocity + (nozzle * target.rate).cross(&(tip_m - target.position_m));
        let pressed_n = stiffness * depth_m + damping * normal.dot(&(tip - seat));
        let force_n = ring[head];
        ring[head] = normal * if depth_m > 0.0 { -pressed_n.max(0.0) } else { 0.0 };
        head = if head + 1 == LATE { 0 } else { head + 1 };
        chaser.advance(&probe, &force_n, &tip_m);
        target.advance(&nozzle, &-force_n, &tip_m);
    }
    chaser.velocity.z
}
