//! The bearings of rollers: spins of those that do not touch, and what damping holds on to the wheel with.

use rapier3d_f64::prelude::Vector as Vector3;

use super::balance::Balance;
use super::contact::Contact;
use super::model::{Model, Wheel};
use super::rollers::Rollers;
use super::spin::Spin;
use super::tree::{State, Tree};

/// What a step needs to know of all rollers; entries are by roller unless they say otherwise.
#[derive(Default)]
pub(super) struct Bearings {
    /// Spin at the end of the step if nothing touches \[rad/s\].
    pub(super) free_rad_s: Vec<f64>,
    /// The same of a roller in touch, without what its wheel's turning gives it: that is solved for \[rad/s\].
    pub(super) in_touch_rad_s: Vec<f64>,
    /// Mean spin in the step \[rad/s\], once it is known.
    pub(super) mean_rad_s: Vec<f64>,
    /// How fast the wheel turns about the roller's axis \[rad/s\].
    carried_rad_s: Vec<f64>,
    /// Moment of the bearings on each wheel's carrier \[N.m\], by wheel; what turns the wheel itself is not in it.
    pub(super) on_carrier: Vec<Vector3>,
}

fn with_rollers(model: &Model) -> impl Iterator<Item = (usize, &Wheel, &Rollers)> {
    let wheels = model.wheels.iter().enumerate();
    wheels.filter_map(|(i, wheel)| Some((i, wheel, wheel.rollers()?)))
}

impl Bearings {
    /// Starts a step: the spins of rollers that nothing touches, and what their bearings do to the wheels.
    pub(super) fn release<const N: usize>(
        &mut self,
        model: &Model,
        tree: &Tree<N>,
        state: &State,
        step_s: f64,
        spins: &mut [Spin],
    ) {
        self.on_carrier.clear();
        if model.rollers == 0 {
            return;
        }
        self.free_rad_s.clone_from(&state.roller_rad_s);
        self.in_touch_rad_s.clone_from(&state.roller_rad_s);
        for (i, wheel, rollers) in with_rollers(model) {
            let damping = rollers.friction_n_m_s_rad;
            if damping == 0.0 {
                continue;
            }
            self.carried_rad_s.resize(model.rollers, 0.0);
            self.on_carrier.resize(model.wheels.len(), Vector3::ZERO);
            let rotation = tree.rotation[wheel.body];
            let axle = tree.axle[i];
            let omega = tree.omega[wheel.body];
            let turning = omega + axle * (state.spin_rad_s[i] - omega.dot(axle));
            let mut moment = Vector3::ZERO;
            for k in 0..rollers.count() {
                let axis = rotation * rollers.axis(wheel, k, state.turn_rad[i]);
                let (roller, carried) = (rollers.first + k, turning.dot(axis));
                let spin = state.roller_rad_s[roller];
                let inertia = rollers.inertia_kg_m2;
                self.carried_rad_s[roller] = carried;
                self.in_touch_rad_s[roller] = inertia * spin / (inertia + step_s * damping);
                self.free_rad_s[roller] =
                    (inertia * spin + step_s * damping * carried) / (inertia + step_s * damping);
                // The wheel receives the torque of the roller.
                moment += axis * (damping * (self.free_rad_s[roller] - carried));
            }
            let about_axle = moment.dot(axle);
            spins[i].free_rad_s += step_s * about_axle / wheel.inertia_kg_m2;
            self.on_carrier[i] = moment - axle * about_axle;
        }
    }

    /// Ends a step: the rollers' spins with the contacts' impulses, and what bearings took.
    pub(super) fn turn(
        &mut self,
        model: &Model,
        contacts: &[Contact],
        spins_rad_s: &mut [f64],
        step_s: f64,
        balance: &mut Balance,
    ) {
        if model.rollers == 0 {
            return;
        }
        self.mean_rad_s.clone_from(&self.free_rad_s);
        // From here on those with the contacts' impulses.
        for across in contacts.iter().filter_map(|contact| contact.across.as_ref()) {
            let gained = across.impulse * across.lever_m / across.inertia_kg_m2;
            self.free_rad_s[across.roller] += gained;
            self.mean_rad_s[across.roller] += 0.5 * gained;
        }
        for (_, _, rollers) in with_rollers(model) {
            let damping = rollers.friction_n_m_s_rad;
            if damping == 0.0 {
                continue;
            }
            for roller in rollers.first..rollers.first + rollers.count() {
                let (before, after) = (spins_rad_s[roller], self.free_rad_s[roller]);
                let (mean, carried) = (0.5 * (before + after), self.carried_rad_s[roller]);
                let free = 2.0 * self.mean_rad_s[roller] - after;
                self.mean_rad_s[roller] = mean;
                // What the contacts gave the roller, less what it has of that, and what of the rest the wheel has got.
                let inertia = rollers.inertia_kg_m2;
                let given = (after - free) * (inertia + step_s * damping);
                balance.bearing(
                    (given - inertia * (after - before)) * mean + inertia * (free - before) * carried,
                );
            }
        }
        spins_rad_s.copy_from_slice(&self.free_rad_s);
    }

    /// Kinetic energy of the rollers' spins \[J\].
    pub(super) fn kinetic_j(model: &Model, spins_rad_s: &[f64]) -> f64 {
        with_rollers(model)
            .map(|(_, _, rollers)| {
                let own = &spins_rad_s[rollers.first..rollers.first + rollers.count()];
                0.5 * rollers.inertia_kg_m2 * own.iter().map(|spin| spin * spin).sum::<f64>()
            })
            .sum()
    }
}
