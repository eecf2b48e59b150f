//! Energy and momentum, accounted for so that they close.
//!
//! An impulse changes the kinetic energy by itself times the mean of the velocities before and after the
//! step, where it acts. Motors and drags are accounted for by the actuation; contacts and hinges here.

use rapier3d_f64::prelude::Vector as Vector3;
use serde::{Deserialize, Serialize};

use super::contact::Contact;
use super::hinges::Held;
use super::linear::Vector;
use super::tree::Twist;
use crate::observation::{Energy, Observation};
use crate::world::actuation;

/// What has been lost and added since the start, and the momentum when it was last looked at.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Balance {
    friction_loss_j: f64,
    impact_loss_j: f64,
    /// Dampers, stops and couplings of hinges, and bearings of rollers.
    joint_loss_j: f64,
    added_j: f64,
    added_size_j: f64,
    start_potential_j: f64,
    momentum: [f64; 3],
}

/// Energies and momentum now.
pub(super) struct Now {
    pub(super) kinetic_j: f64,
    pub(super) potential_j: f64,
    pub(super) momentum: Vector3,
    pub(super) weight_n: f64,
}

/// The mean of the generalised velocities in a step, of the twists of bodies, and of the spins of wheels.
pub(super) struct Mean<'a, const N: usize> {
    pub(super) u: &'a Vector<N>,
    pub(super) twists: &'a [Twist; N],
    pub(super) spins: &'a [f64],
}

impl Balance {
    pub(super) fn start(now: &Now) -> Self {
        Self {
            start_potential_j: now.potential_j,
            ..Self::default()
        }
    }

    /// Energy loss of a contact in a step; `roller_rad_s` is the mean spin of the roller in touch.
    pub(super) fn contact<const N: usize>(
        &mut self,
        contact: &Contact,
        mean: &Mean<'_, N>,
        roller_rad_s: f64,
    ) {
        let (carrier, spin) = (&mean.twists[contact.body], mean.spins[contact.wheel]);
        self.impact_loss_j -= contact.normal_impulse * contact.separation.at(carrier, spin);
        self.friction_loss_j -= contact.friction_impulse * contact.slip.at(carrier, spin);
        if let Some(across) = &contact.across {
            let slip = across.line.at(carrier, spin) + across.lever_m * roller_rad_s;
            self.friction_loss_j -= across.impulse * slip;
        }
    }

    /// What a hinge took in a step that ended with these velocities.
    pub(super) fn hinge<const N: usize>(&mut self, held: &Held, u: &Vector<N>, mean: &Mean<'_, N>) {
        self.joint_loss_j += held.rate(mean.u) * (held.constant + held.per_rate * held.rate(u));
    }

    /// Energy loss of a roller's bearing.
    pub(super) fn bearing(&mut self, loss_j: f64) {
        self.joint_loss_j += loss_j;
    }

    /// A mass that appears brings its energy with it.
    pub(super) fn added(&mut self, before: &Now, after: &Now) {
        let added_j = after.kinetic_j + after.potential_j - before.kinetic_j - before.potential_j;
        self.added_j += added_j;
        self.added_size_j += added_j.abs();
        for k in 0..3 {
            self.momentum[k] += after.momentum[k] - before.momentum[k];
        }
    }

    /// At the end of a control period: the energies, and the force that Newton's second law misses.
    pub(super) fn close(
        &mut self,
        now: &Now,
        moved: &actuation::State,
        period_s: f64,
        seen: &mut Observation,
    ) {
        seen.energy = Energy {
            work_in_j: moved.work_j + self.added_j,
            turnover_j: moved.turnover_j + self.added_size_j,
            kinetic_j: now.kinetic_j,
            potential_j: now.potential_j - self.start_potential_j,
            friction_loss_j: self.friction_loss_j,
            impact_loss_j: self.impact_loss_j,
            joint_loss_j: self.joint_loss_j,
            drag_loss_j: moved.drag_loss_j,
        };
        if period_s > 0.0 {
            let ground: Vector3 = seen.wheels.iter().map(|wheel| Vector3::from(wheel.force_n)).sum();
            let change = (now.momentum - Vector3::from(self.momentum)) / period_s;
            seen.newton_residual_n = (change - ground + Vector3::Z * now.weight_n).length();
        }
        self.momentum = now.momentum.into();
    }
}
