//! A wheel's spin in a step, and the dry friction of its gear.

use rapier3d_f64::prelude::Vector as Vector3;

use super::contact::LinearForm;
use super::grip::{Grip, STICK, follow};
use super::linear::add;
use super::tree::{Twist, twist};

/// A wheel's spin in the step.
#[derive(Clone, Copy)]
pub(super) struct Spin {
    /// The body that carries the wheel.
    pub(super) body: usize,
    pub(super) inertia_kg_m2: f64,
    /// With its motor's torque alone at the end of the step \[rad/s\].
    pub(super) free_rad_s: f64,
    /// Of drags between wheel and carrier, times the step \[kg.m^2\].
    pub(super) damper: f64,
    /// Impulse of dry friction between wheel and carrier at most \[N.m.s\].
    pub(super) hold: f64,
    /// Whether that holds the wheel, or which way it acts.
    pub(super) grip: Grip,
    /// Its impulse on the wheel.
    pub(super) held: f64,
    /// Of the wheel, a unit vector.
    pub(super) axle: Vector3,
}

impl Spin {
    /// Impulse per rate of a wheel that dry friction holds \[kg.m^2\]: it creeps as by a millionth
    /// of what the impulse alone would turn it.
    pub(super) fn stick(&self) -> f64 {
        STICK * self.inertia_kg_m2
    }

    /// The carrier's turning about the axle, per twist.
    pub(super) fn carried(&self) -> Twist {
        twist(Vector3::ZERO, self.axle)
    }

    /// How fast a wheel of this spin turns against its carrier \[rad/s\].
    #[inline(always)]
    pub(super) fn turning_rad_s(&self, [_, _, _, x, y, z]: &Twist, spin: f64) -> f64 {
        spin - self.axle.dot(Vector3::new(*x, *y, *z))
    }

    /// Rotation of the wheel relative to its carrier.
    pub(super) fn turning(&self) -> LinearForm {
        LinearForm {
            row: twist(Vector3::ZERO, -self.axle),
            lever_m: 1.0,
        }
    }

    /// Takes the grip for that of the step before: `rad_s` is how the wheel turned against its carrier.
    pub(super) fn guess(&mut self, rad_s: f64) {
        self.grip = if self.stick() * rad_s.abs() <= 2.0 * self.hold {
            Grip::Stick
        } else {
            Grip::Slide(-rad_s.signum())
        };
    }

    /// The same with its dry friction as the grip has it: a damper, or an impulse.
    pub(super) fn gripped(&self) -> Self {
        match self.grip {
            Grip::Stick => Self {
                damper: self.damper + self.stick(),
                ..*self
            },
            Grip::Slide(sign) => Self {
                free_rad_s: self.free_rad_s + sign * self.hold / self.inertia_kg_m2,
                ..*self
            },
        }
    }

    /// What dry friction that acts pushes the carrier with.
    pub(super) fn push_carrier(&self, right: &mut Twist) {
        if let (true, Grip::Slide(sign)) = (self.hold > 0.0, self.grip) {
            add(right, -sign * self.hold, &self.carried());
        }
    }

    /// The impulse of dry friction at this twist of the carrier; says whether the grip changes for it.
    pub(super) fn settle(&mut self, carrier: &Twist, spin: f64) -> bool {
        let rad_s = self.turning_rad_s(carrier, spin);
        let grip = follow(
            Some(self.grip),
            rad_s,
            -self.stick() * rad_s,
            self.hold,
            &mut self.held,
        );
        let changes = grip != self.grip;
        self.grip = grip;
        changes
    }
}
