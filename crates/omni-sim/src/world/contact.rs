//! Contact forces as the solver applied them.

use rapier3d_f64::prelude::*;
use rapier3d_f64::utils::OrthonormalBasis;

use super::vehicle::VehicleBodies;
use crate::observation::Observation;

/// Adds this physics step's contact forces to each wheel's average, weighted by `share` of the control period.
///
/// Under the Coulomb friction model the sum over the solver's contacts of normal and tangent impulses over dt is the
/// whole force on the wheel: it closes the vehicle's Newton balance to rounding (`tests/physics.rs`).
pub(super) fn accumulate(
    physics: &PhysicsWorld,
    vehicle: &VehicleBodies,
    share: f64,
    observation: &mut Observation,
) {
    let per_second = share / physics.integration_parameters.dt;
    for (wheel, seen) in vehicle.wheels.iter().zip(&mut observation.wheels) {
        let (mut force, mut normal) = (Vector::ZERO, Vector::ZERO);
        let pairs = wheel
            .colliders()
            .iter()
            .flat_map(|own| physics.contact_pairs_with(*own).map(move |pair| (own, pair)));
        for (own, pair) in pairs {
            let sign = if pair.collider1 == *own { 1.0 } else { -1.0 };
            for manifold in pair.solver_manifolds() {
                // The solver pushes collider 1 along `direction`; its tangents are a fixed basis of that.
                let direction = -manifold.data.normal;
                let tangent = direction.orthonormal_vector();
                let bitangent = direction.cross(tangent);
                for point in &manifold.points {
                    let data = &point.data;
                    let push = direction * (data.impulse * sign);
                    normal += push;
                    force +=
                        push + (tangent * data.tangent_impulse.x + bitangent * data.tangent_impulse.y) * sign;
                }
            }
        }
        let along = wheel.axle_world(physics).cross(normal).normalize_or_zero();
        seen.add_force(
            (force * per_second).into(),
            (normal * per_second).into(),
            force.dot(along) * per_second,
        );
    }
}
