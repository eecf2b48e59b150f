//! Positions, velocities and inertia of the tree's bodies: docs/derivations.md derives the equations.
//!
//! Generalised velocities: the velocity of the common centre of mass, the angular velocity of the
//! base, and the rate of every hinge. Positions are counted from the common centre of mass. Gravity
//! then acts on the first three alone, these are the momentum over the mass, and the mass matrix
//! couples them with nothing. Wheels turn on their own: their spins are not among these velocities.

use rapier3d_f64::prelude::{Matrix as Matrix3, Rotation, Vector as Vector3};
use serde::{Deserialize, Serialize};

use super::linear::{Matrix, Vector};
use super::model::{Model, of_point};

/// Unknowns of a tree without hinges.
pub(super) const FREE: usize = 6;

/// What moves: all that a snapshot needs of the bodies.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct State {
    /// The common centre of mass in the world \[m\].
    pub(super) com_m: [f64; 3],
    /// Orientation of the base, x, y, z, w.
    pub(super) base: [f64; 4],
    /// Angle of the hinge that a body hangs on \[rad\], one a body; 0 for the base.
    pub(super) angle_rad: Vec<f64>,
    /// Generalised velocities; those beyond the hinges are zero.
    pub(super) u: Vec<f64>,
    /// Turning speed of each wheel about its axle, against the world \[rad/s\].
    pub(super) spin_rad_s: Vec<f64>,
    /// How far each wheel has turned against its carrier \[rad\]; 0 if it has no rollers.
    pub(super) turn_rad: Vec<f64>,
    /// Turning speed of every roller about its axis, against the world \[rad/s\].
    pub(super) roller_rad_s: Vec<f64>,
}

/// Places and velocities of the bodies, in world axes about the common centre of mass; entries are by body.
pub(super) struct Tree<const N: usize> {
    pub(super) rotation: [Matrix3; N],
    /// Origin of the body's frame \[m\].
    pub(super) origin: [Vector3; N],
    com: [Vector3; N],
    /// Angular velocity \[rad/s\].
    pub(super) omega: [Vector3; N],
    pub(super) axis: [Vector3; N],
    anchor: [Vector3; N],
    /// Momentum that a unit rate of the hinge gives all that hangs on it, were its inner end held \[kg.m\].
    momentum: [Vector3; N],
    /// The mass matrix.
    pub(super) mass: Matrix<N>,
    /// What gyroscopic and centrifugal terms push with.
    pub(super) bias_force: Vector<N>,
    mass_kg: f64,
    bodies: usize,
    path: [u32; N],
}

impl<const N: usize> Tree<N> {
    pub(super) fn new(model: &Model) -> Self {
        let mut path = [0; N];
        for (path, body) in path.iter_mut().zip(&model.bodies) {
            *path = body.path;
        }
        Self {
            rotation: [Matrix3::IDENTITY; N],
            origin: [Vector3::ZERO; N],
            com: [Vector3::ZERO; N],
            omega: [Vector3::ZERO; N],
            axis: [Vector3::ZERO; N],
            anchor: [Vector3::ZERO; N],
            momentum: [Vector3::ZERO; N],
            mass: [[0.0; N]; N],
            bias_force: [0.0; N],
            mass_kg: model.mass_kg,
            bodies: model.bodies.len(),
            path,
        }
    }

    /// Takes over a state: places, velocities, inertia.
    pub(super) fn update(&mut self, model: &Model, state: &State) {
        self.place(model, state);
        self.weigh(model, state);
    }

    /// Places and velocities of the bodies.
    pub(super) fn place(&mut self, model: &Model, state: &State) {
        let u = &state.u;
        self.mass_kg = model.mass_kg;
        self.rotation[0] = matrix(state.base);
        self.origin[0] = Vector3::ZERO;
        self.omega[0] = Vector3::new(u[3], u[4], u[5]);
        self.com[0] = self.rotation[0] * model.bodies[0].com_m;
        let mut first = self.com[0] * model.bodies[0].mass_kg;
        for (b, body) in model.bodies.iter().enumerate().skip(1) {
            let parent = body.parent;
            self.rotation[b] = self.rotation[parent] * turn(body.axis, state.angle_rad[b]);
            self.axis[b] = self.rotation[parent] * body.axis;
            self.anchor[b] = self.origin[parent] + self.rotation[parent] * body.anchor_m;
            self.origin[b] = self.anchor[b] - self.rotation[b] * body.anchor_m;
            self.omega[b] = self.omega[parent] + self.axis[b] * u[FREE - 1 + b];
            self.com[b] = self.origin[b] + self.rotation[b] * body.com_m;
            first += self.com[b] * body.mass_kg;
        }
        let common = first / model.mass_kg;
        for b in 0..self.bodies {
            self.origin[b] -= common;
            self.com[b] -= common;
            self.anchor[b] -= common;
        }
    }

    /// The mass matrix and the push of the present velocities; [`Tree::place`] comes first.
    ///
    /// The push by one Newton-Euler pass: accelerations outwards with all generalised ones zero, then forces
    /// and moments inwards, composite inertias with them. A wheel's carrier turns the wheel's spin around.
    fn weigh(&mut self, model: &Model, state: &State) {
        let none = Vector3::ZERO;
        let (mut mass, mut first, mut inertia) = ([0.0; N], [none; N], [Matrix3::ZERO; N]);
        let (mut force, mut moment) = ([none; N], [none; N]);
        let (mut alpha, mut acceleration) = ([none; N], [none; N]); // the latter of a frame's origin
        for (b, body) in model.bodies.iter().enumerate() {
            let omega = self.omega[b];
            if b > 0 {
                let parent = body.parent;
                let arm = self.anchor[b] - self.origin[parent];
                let at_anchor = acceleration[parent]
                    + alpha[parent].cross(arm)
                    + self.omega[parent].cross(self.omega[parent].cross(arm));
                alpha[b] = alpha[parent] + self.omega[parent].cross(self.axis[b] * state.u[FREE - 1 + b]);
                let back = self.origin[b] - self.anchor[b];
                acceleration[b] = at_anchor + alpha[b].cross(back) + omega.cross(omega.cross(back));
            }
            let own = self.rotation[b] * body.inertia_kg_m2 * self.rotation[b].transpose();
            let (com, arm) = (self.com[b], self.com[b] - self.origin[b]);
            let here = acceleration[b] + alpha[b].cross(arm) + omega.cross(omega.cross(arm));
            mass[b] = body.mass_kg;
            first[b] = com * body.mass_kg;
            inertia[b] = own + of_point(body.mass_kg, com);
            force[b] = here * body.mass_kg;
            moment[b] = com.cross(force[b]) + own * alpha[b] + omega.cross(own * omega);
        }
        for (wheel, spin) in model.wheels.iter().zip(&state.spin_rad_s) {
            let axle = self.rotation[wheel.body] * wheel.axle;
            moment[wheel.body] += self.omega[wheel.body].cross(axle) * (wheel.inertia_kg_m2 * spin);
        }
        for b in (1..self.bodies).rev() {
            let parent = model.bodies[b].parent;
            mass[parent] += mass[b];
            first[parent] += first[b];
            inertia[parent] += inertia[b];
            force[parent] += force[b];
            moment[parent] += moment[b];
        }
        self.mass = [[0.0; N]; N];
        self.bias_force = [0.0; N];
        // Hinges that there are not: unknowns that stay zero.
        for i in FREE - 1 + self.bodies..N {
            self.mass[i][i] = 1.0;
        }
        for k in 0..3 {
            self.mass[k][k] = self.mass_kg;
            self.bias_force[3 + k] = -moment[0][k];
            for j in 0..3 {
                self.mass[3 + k][3 + j] = inertia[0].col(j)[k];
            }
        }
        // The common centre of mass follows outer forces alone: what the bodies' own motion asks of
        // it is taken off everywhere.
        let mean = force[0] / self.mass_kg;
        let mut angular = [none; N];
        for b in 1..self.bodies {
            let (axis, anchor) = (self.axis[b], self.anchor[b]);
            let at_anchor = axis.cross(anchor);
            self.momentum[b] = axis.cross(first[b]) - at_anchor * mass[b];
            angular[b] = inertia[b] * axis - first[b].cross(at_anchor);
            let row = FREE - 1 + b;
            for k in 0..3 {
                self.mass[3 + k][row] = angular[b][k];
                self.mass[row][3 + k] = angular[b][k];
            }
            self.bias_force[row] =
                -(axis.dot(moment[b] - anchor.cross(force[b])) - self.momentum[b].dot(mean));
        }
        for j in 1..self.bodies {
            for i in 1..=j {
                let mut value = -self.momentum[i].dot(self.momentum[j]) / self.mass_kg;
                if self.path[j] & (1 << i) != 0 {
                    value += self.axis[i].dot(angular[j])
                        - self.axis[i].cross(self.anchor[i]).dot(self.momentum[j]);
                }
                self.mass[FREE - 1 + i][FREE - 1 + j] = value;
                self.mass[FREE - 1 + j][FREE - 1 + i] = value;
            }
        }
    }

    /// How fast a point of a body moves along a direction, per generalised velocity.
    pub(super) fn along(&self, body: usize, point: Vector3, direction: Vector3) -> Vector<N> {
        let mut row = [0.0; N];
        let turning = point.cross(direction);
        for k in 0..3 {
            row[k] = direction[k];
            row[3 + k] = turning[k];
        }
        for b in 1..self.bodies {
            let mut value = -direction.dot(self.momentum[b]) / self.mass_kg;
            if self.path[body] & (1 << b) != 0 {
                value += self.axis[b].dot((point - self.anchor[b]).cross(direction));
            }
            row[FREE - 1 + b] = value;
        }
        row
    }

    /// Adds to a row how fast a body turns along a vector, per generalised velocity.
    pub(super) fn add_turning(&self, row: &mut Vector<N>, body: usize, vector: Vector3) {
        for k in 0..3 {
            row[3 + k] += vector[k];
        }
        for b in 1..self.bodies {
            if self.path[body] & (1 << b) != 0 {
                row[FREE - 1 + b] += self.axis[b].dot(vector);
            }
        }
    }

    /// Velocity of a point of a body \[m/s\].
    pub(super) fn velocity(&self, body: usize, point: Vector3, u: &Vector<N>) -> Vector3 {
        let mut velocity = Vector3::new(u[0], u[1], u[2]) + self.omega[0].cross(point);
        for b in 1..self.bodies {
            let rate = u[FREE - 1 + b];
            velocity -= self.momentum[b] * (rate / self.mass_kg);
            if self.path[body] & (1 << b) != 0 {
                velocity += self.axis[b].cross(point - self.anchor[b]) * rate;
            }
        }
        velocity
    }
}

/// The rotation matrix of a unit quaternion x, y, z, w.
fn matrix([x, y, z, w]: [f64; 4]) -> Matrix3 {
    Matrix3::from_quat(Rotation::from_xyzw(x, y, z, w))
}

/// A turn about a unit vector by an angle \[rad\], the same on every machine.
fn turn(axis: Vector3, angle_rad: f64) -> Matrix3 {
    let (sin, cos) = libm::sincos(0.5 * angle_rad);
    matrix([axis.x * sin, axis.y * sin, axis.z * sin, cos])
}

/// No vehicle is farther, faster or more turned than this \[m\], \[m/s\], \[rad\], \[rad/s\].
const MOST: f64 = 1e7;

impl State {
    /// Is everything a number that a vehicle can have?
    pub(super) fn is_sound(&self) -> bool {
        let all = [
            &self.angle_rad,
            &self.u,
            &self.spin_rad_s,
            &self.turn_rad,
            &self.roller_rad_s,
        ];
        let mut all = all.into_iter().flatten().chain(&self.com_m).chain(&self.base);
        all.all(|value| value.abs() < MOST)
    }

    /// Moves positions on by the present velocities.
    pub(super) fn advance(&mut self, step_s: f64) {
        for k in 0..3 {
            self.com_m[k] += step_s * self.u[k];
        }
        let turn = Vector3::new(self.u[3], self.u[4], self.u[5]) * step_s;
        let angle = turn.length();
        // sin(angle / 2) / angle, from its series where the quotient would lose digits.
        let part = if angle > 1e-3 {
            libm::sin(0.5 * angle) / angle
        } else {
            0.5 - angle * angle / 48.0
        };
        let step = Rotation::from_xyzw(
            turn.x * part,
            turn.y * part,
            turn.z * part,
            libm::cos(0.5 * angle),
        );
        let [x, y, z, w] = self.base;
        let turned = (step * Rotation::from_xyzw(x, y, z, w)).normalize();
        self.base = [turned.x, turned.y, turned.z, turned.w];
        for (b, angle) in self.angle_rad.iter_mut().enumerate().skip(1) {
            *angle += step_s * self.u[FREE - 1 + b];
        }
    }
}
