//! Positions, velocities and inertia of the tree's bodies: docs/derivations.md derives the equations.
//!
//! Generalised velocities: the velocity of the common centre of mass, the angular velocity of the
//! base, and the rate of every hinge. Positions are counted from the common centre of mass. Gravity
//! then acts on the first three alone, these are the momentum over the mass, and inertia couples
//! them with nothing. Wheels turn on their own: their spins are not among these velocities.

use rapier3d_f64::prelude::{Matrix as Matrix3, Rotation, Vector as Vector3};
use serde::{Deserialize, Serialize};

use super::linear::{Matrix, Vector, add, dot, times, times_transposed};
use super::model::{Model, of_point};
use crate::config::MOST_WHEELS;

/// Unknowns of a tree without hinges.
pub(super) const FREE: usize = 6;

/// Velocity of a body: of its place at the common centre of mass \[m/s\], and angular velocity
/// \[rad/s\]. What acts on one has the same shape: a force, and a moment about that centre.
pub(super) type Twist = Vector<FREE>;

/// A twist by its two parts.
#[inline(always)]
pub(super) fn twist(linear: Vector3, angular: Vector3) -> Twist {
    [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
}

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
    /// Twist that a unit rate of the hinge gives all that hangs on it, were its inner end held.
    pub(super) joint: [Twist; N],
    /// Twist that it gives everything then, so that the common centre of mass stays where it is.
    pub(super) drift: [Twist; N],
    /// Present twist of each body.
    pub(super) twist: [Twist; N],
    /// Axle of each wheel, a unit vector, and its centre \[m\].
    pub(super) axle: [Vector3; MOST_WHEELS],
    pub(super) centre: [Vector3; MOST_WHEELS],
    /// Inertia of each body: its momentum per twist.
    pub(super) inertia: [Matrix<FREE>; N],
    /// Present momentum of each body, and angular momentum about the common centre of mass; without spins of wheels.
    pub(super) momentum: [Twist; N],
    /// What gyroscopic and centrifugal terms push each body with.
    pub(super) bias_force: [Twist; N],
    mass_kg: f64,
    pub(super) bodies: usize,
    pub(super) parent: [usize; N],
    path: [u32; N],
}

impl<const N: usize> Tree<N> {
    pub(super) fn new(model: &Model) -> Self {
        let (mut parent, mut path) = ([0; N], [0; N]);
        for (b, body) in model.bodies.iter().enumerate() {
            (parent[b], path[b]) = (body.parent, body.path);
        }
        Self {
            rotation: [Matrix3::IDENTITY; N],
            origin: [Vector3::ZERO; N],
            com: [Vector3::ZERO; N],
            omega: [Vector3::ZERO; N],
            axis: [Vector3::ZERO; N],
            anchor: [Vector3::ZERO; N],
            joint: [[0.0; FREE]; N],
            drift: [[0.0; FREE]; N],
            twist: [[0.0; FREE]; N],
            axle: [Vector3::ZERO; MOST_WHEELS],
            centre: [Vector3::ZERO; MOST_WHEELS],
            inertia: [[[0.0; FREE]; FREE]; N],
            momentum: [[0.0; FREE]; N],
            bias_force: [[0.0; FREE]; N],
            mass_kg: model.mass_kg,
            bodies: model.bodies.len(),
            parent,
            path,
        }
    }

    /// Takes over a state: places, velocities, inertia.
    pub(super) fn update(&mut self, model: &Model, state: &State) {
        self.place(model, state);
        self.weigh(model, state);
        self.hang(model);
        let mut u = [0.0; N];
        u.copy_from_slice(&state.u);
        self.twist = self.twists(&u);
        for b in 0..self.bodies {
            // Inertia is symmetric, and this way quicker.
            self.momentum[b] = times_transposed(&self.inertia[b], &self.twist[b]);
        }
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
        for (i, wheel) in model.wheels.iter().enumerate() {
            self.axle[i] = self.rotation[wheel.body] * wheel.axle;
            self.centre[i] = self.origin[wheel.body] + self.rotation[wheel.body] * wheel.centre_m;
        }
    }

    /// Inertia of each body and the push of the present velocities; [`Tree::place`] comes first.
    ///
    /// The push from accelerations with all generalised ones zero, outwards from the base. The common centre of mass
    /// follows outer forces alone: what the bodies' own motion asks of it is taken off everywhere. A wheel's carrier
    /// turns the wheel's spin around.
    fn weigh(&mut self, model: &Model, state: &State) {
        let none = Vector3::ZERO;
        // Acceleration of the place at the common centre of mass, as part of each body, and of the body's own centre.
        let (mut alpha, mut acceleration, mut here) = ([none; N], [none; N], [none; N]);
        let mut spinning = [none; N];
        for (i, wheel) in model.wheels.iter().enumerate() {
            spinning[wheel.body] += self.axle[i] * (wheel.inertia_kg_m2 * state.spin_rad_s[i]);
        }
        let mut mean = none;
        for (b, body) in model.bodies.iter().enumerate() {
            let (omega, anchor, com) = (self.omega[b], self.anchor[b], self.com[b]);
            if b > 0 {
                let (parent, outer) = (body.parent, self.omega[body.parent]);
                alpha[b] = alpha[parent] + outer.cross(self.axis[b] * state.u[FREE - 1 + b]);
                // Both have the hinge.
                acceleration[b] = acceleration[parent]
                    + (alpha[parent] - alpha[b]).cross(anchor)
                    + (outer.cross(outer.cross(anchor)) - omega.cross(omega.cross(anchor)));
            }
            here[b] = acceleration[b] + alpha[b].cross(com) + omega.cross(omega.cross(com));
            mean += here[b] * (body.mass_kg / model.mass_kg);
        }
        for (b, body) in model.bodies.iter().enumerate() {
            let (omega, com, mass) = (self.omega[b], self.com[b], body.mass_kg);
            let own = self.rotation[b] * body.inertia_kg_m2 * self.rotation[b].transpose();
            let force = (here[b] - mean) * mass;
            let moment = com.cross(force) + own * alpha[b] + omega.cross(own * omega + spinning[b]);
            self.bias_force[b] = twist(-force, -moment);
            self.inertia[b] = spatial(mass, com, &(own + of_point(mass, com)));
        }
    }

    /// Twists for a unit rate of each hinge; [`Tree::place`] comes first.
    fn hang(&mut self, model: &Model) {
        let (mut mass, mut first) = ([0.0; N], [Vector3::ZERO; N]);
        for (b, body) in model.bodies.iter().enumerate().skip(1).rev() {
            mass[b] += body.mass_kg;
            first[b] += self.com[b] * body.mass_kg;
            mass[body.parent] += mass[b];
            let inner = first[b];
            first[body.parent] += inner;
            let at_anchor = self.axis[b].cross(self.anchor[b]);
            // Momentum of all that hangs on the hinge.
            let momentum = self.axis[b].cross(first[b]) - at_anchor * mass[b];
            self.joint[b] = twist(-at_anchor, self.axis[b]);
            self.drift[b] = twist(momentum / -self.mass_kg, Vector3::ZERO);
        }
    }

    /// Kinetic energy of the bodies \[J\].
    pub(super) fn kinetic_j(&self) -> f64 {
        let bodies = self.twist.iter().zip(&self.momentum).take(self.bodies);
        bodies.map(|(twist, momentum)| 0.5 * dot(twist, momentum)).sum()
    }

    /// Inertia that a hinge turns against \[kg.m^2\] if neither the base nor another hinge turns.
    pub(super) fn hinge_inertia_kg_m2(&self, hinge: usize) -> f64 {
        let of_body = |b: usize| {
            let mut twist = self.drift[hinge];
            if self.hangs_on(b, hinge) {
                add(&mut twist, 1.0, &self.joint[hinge]);
            }
            dot(&twist, &times(&self.inertia[b], &twist))
        };
        (0..self.bodies).map(of_body).sum()
    }

    /// The twist of each body at these generalised velocities.
    pub(super) fn twists(&self, u: &Vector<N>) -> [Twist; N] {
        let mut twists = [[0.0; FREE]; N];
        twists[0].copy_from_slice(&u[..FREE]);
        for b in 1..self.bodies {
            add(&mut twists[0], u[FREE - 1 + b], &self.drift[b]);
        }
        for b in 1..self.bodies {
            twists[b] = twists[self.parent[b]];
            add(&mut twists[b], u[FREE - 1 + b], &self.joint[b]);
        }
        twists
    }

    /// A linear function of a body's twist as one of the generalised velocities, or what a force and
    /// a moment on it do to these.
    pub(super) fn row(&self, body: usize, of_twist: &Twist) -> Vector<N> {
        let mut row = [0.0; N];
        row[..FREE].copy_from_slice(of_twist);
        for b in 1..self.bodies {
            row[FREE - 1 + b] = dot(of_twist, &self.drift[b]);
            if self.hangs_on(body, b) {
                row[FREE - 1 + b] += dot(of_twist, &self.joint[b]);
            }
        }
        row
    }

    /// Is this the hinge of a body, or one between the base and it?
    pub(super) fn hangs_on(&self, body: usize, hinge: usize) -> bool {
        self.path[body] & (1 << hinge) != 0
    }

    /// Present velocity of a point of a body \[m/s\].
    #[inline(always)]
    pub(super) fn velocity(&self, body: usize, point: Vector3) -> Vector3 {
        let [x, y, z, ..] = self.twist[body];
        Vector3::new(x, y, z) + self.omega[body].cross(point)
    }
}

/// Inertia of a body: its momentum, and angular momentum about the common centre of mass, per twist; `inertia` is about
/// that centre too.
fn spatial(mass: f64, com: Vector3, inertia: &Matrix3) -> Matrix<FREE> {
    let [x, y, z] = (com * mass).to_array();
    let [i, j, k] = [inertia.x_axis, inertia.y_axis, inertia.z_axis];
    [
        [mass, 0.0, 0.0, 0.0, z, -y],
        [0.0, mass, 0.0, -z, 0.0, x],
        [0.0, 0.0, mass, y, -x, 0.0],
        [0.0, -z, y, i.x, i.y, i.z],
        [z, 0.0, -x, j.x, j.y, j.z],
        [-y, x, 0.0, k.x, k.y, k.z],
    ]
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
        let all: [&[f64]; 7] = [
            &self.com_m,
            &self.base,
            &self.angle_rad,
            &self.u,
            &self.spin_rad_s,
            &self.turn_rad,
            &self.roller_rad_s,
        ];
        let mut sound = true;
        for values in all {
            for value in values {
                sound &= value.abs() < MOST; // no branch, so several at once
            }
        }
        sound
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
