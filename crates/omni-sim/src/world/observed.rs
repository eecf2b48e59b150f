//! From an engine's vectors to what is observed: the same for both engines.

use omni_core::BodyTwist;
use rapier3d_f64::prelude::Vector;

use crate::observation::{ContactForce, Observation, WheelObservation};

/// The impulses of a wheel's contacts in a step.
#[derive(Default)]
pub(super) struct ContactSum {
    force: Vector,
    normal: Vector,
    moment: Vector,
    size: f64,
}

impl ContactSum {
    /// Adds a contact at a place in the world \[m\]: its whole impulse, the normal part, and that part's size \[N.s\].
    pub(super) fn add(&mut self, whole: Vector, normal: Vector, at: Vector, size: f64) {
        self.force += whole;
        self.normal += normal;
        self.moment += at * size;
        self.size += size;
    }

    /// Adds the forces to a wheel's average; `across` is the level direction across its push, in the world.
    pub(super) fn add_to(&self, across: Vector, per_second: f64, seen: &mut WheelObservation) {
        if self.size == 0.0 {
            return;
        }
        let along = across.cross(self.normal).normalize_or_zero();
        seen.add(&ContactForce {
            force_n: (self.force * per_second).into(),
            normal_n: (self.normal * per_second).into(),
            along_n: self.force.dot(along) * per_second,
            moment_m_n: (self.moment * per_second).into(),
            normal_sum_n: self.size * per_second,
        });
    }
}

/// A velocity of the vehicle's origin along the base's axes turned about the vertical only: what odometry means.
pub(super) fn level_twist(forward: Vector, velocity: Vector, yaw_rate_rad_s: f64) -> BodyTwist<f64> {
    let level = Vector::new(forward.x, forward.y, 0.0).normalize_or(Vector::X);
    let (sin, cos) = (level.y, level.x);
    BodyTwist {
        vx_m_s: cos * velocity.x + sin * velocity.y,
        vy_m_s: cos * velocity.y - sin * velocity.x,
        wz_rad_s: yaw_rate_rad_s,
    }
}

/// Angles of a body with these x and z axes: nose up, and lean to whatever side \[rad\].
pub(super) fn tilt(x: Vector, z: Vector) -> (f64, f64) {
    (libm::asin(x.z.clamp(-1.0, 1.0)), libm::acos(z.z.clamp(-1.0, 1.0)))
}

/// Velocity of a wheel's centre along its push, in the tangent plane of its contact; the ground's
/// plane while there is none \[m/s\].
pub(super) fn along_push(velocity: Vector, across: Vector, seen: &WheelObservation) -> f64 {
    let normal = if seen.touches() {
        Vector::from(seen.normal)
    } else {
        Vector::Z
    };
    velocity.dot(across.cross(normal).normalize_or_zero())
}

/// Speed that a wheel asks of its centre along its push \[m/s\]. `way` is what its turning against
/// its carrier makes of it; the carrier takes the rim along as it turns itself, about the axis
/// `across` the push (docs/derivations.md, What a carrier's turning does to a rim).
pub(super) fn rim_speed(way_m_s: f64, radius_m: f64, across: Vector, carrier_rad_s: Vector) -> f64 {
    way_m_s + radius_m * across.dot(carrier_rad_s)
}

/// Sums the wheels' forces up to the loads of rows.
pub(super) fn load_rows(rows: &[Vec<usize>], observation: &mut Observation) {
    let wheels = &observation.wheels;
    for (row, load_n) in rows.iter().zip(&mut observation.row_loads_n) {
        *load_n = row.iter().map(|w| wheels[*w].force_n[2]).sum();
    }
}
