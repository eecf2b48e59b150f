//! Contact forces as the solver applied them.

use rapier3d_f64::prelude::*;
use rapier3d_f64::utils::OrthonormalBasis;

use super::energy_balance::EnergyBalance;
use super::vehicle::VehicleBodies;
use crate::observation::Observation;
use crate::world::observed::ContactSum;

/// Adds this physics step's contact forces to each wheel's average, weighted by `share` of the
/// control period, and their work to the energy balance.
///
/// Under the Coulomb friction model the sum over the solver's contacts of normal and tangent impulses over dt is the
/// whole force on the wheel: it closes the vehicle's Newton balance to rounding (`newton_residual_n`).
pub(super) fn accumulate(
    physics: &PhysicsWorld,
    vehicle: &VehicleBodies,
    share: f64,
    energy: &mut EnergyBalance,
    observation: &mut Observation,
) {
    let per_second = share / physics.integration_parameters.dt;
    for (wheel, seen) in vehicle.wheels.iter().zip(&mut observation.wheels) {
        let mut sum = ContactSum::default();
        let pairs = wheel
            .colliders()
            .iter()
            .flat_map(|own| physics.contact_pairs_with(*own).map(move |pair| (own, pair)));
        for (own, pair) in pairs {
            let first = pair.collider1 == *own;
            let sign = if first { 1.0 } else { -1.0 };
            let Some(handle) = physics.colliders[*own].parent() else {
                continue; // no part of a wheel is without a body
            };
            let body = &physics.bodies[handle];
            for manifold in pair.solver_manifolds() {
                // The solver pushes collider 1 along `direction`; its tangents are a fixed basis of that.
                let direction = -manifold.data.normal;
                let tangent = direction.orthonormal_vector();
                let bitangent = direction.cross(tangent);
                for contact in &manifold.points {
                    let data = &contact.data;
                    if data.impulse == 0.0 {
                        continue;
                    }
                    let normal_impulse = direction * (data.impulse * sign);
                    let friction_impulse =
                        (tangent * data.tangent_impulse.x + bitangent * data.tangent_impulse.y) * sign;
                    let arm = if first { data.solver_dp1 } else { data.solver_dp2 };
                    energy.contact(handle, body, arm, normal_impulse, friction_impulse);
                    let at = body.center_of_mass() + arm;
                    sum.add(
                        normal_impulse + friction_impulse,
                        normal_impulse,
                        at,
                        data.impulse.abs(),
                    );
                }
            }
        }
        sum.add_to(wheel.across_push_world(physics), per_second, seen);
    }
}
