//! Contacts: where wheels touch, and how fast the wheel's surface moves there per velocity of the vehicle.

use rapier3d_f64::prelude::Vector as Vector3;
use serde::{Deserialize, Serialize};

use super::grip::Grip;
use super::ground::Touch;
use super::linear::{Vector, add, dot};
use super::model::{Wheel, WheelShape};
use super::tree::{FREE, Tree, twist};

/// A velocity as a linear function of velocities and of the spin of one wheel: of the twist of the
/// wheel's carrier, if nothing else is said.
#[derive(Clone, Copy)]
pub(super) struct LinearForm<const N: usize = FREE> {
    pub(super) row: Vector<N>,
    /// Per unit of the wheel's spin \[m\].
    pub(super) lever_m: f64,
}

impl<const N: usize> LinearForm<N> {
    pub(super) const ZERO: Self = Self {
        row: [0.0; N],
        lever_m: 0.0,
    };

    #[inline(always)]
    pub(super) fn at(&self, velocities: &Vector<N>, spin: f64) -> f64 {
        dot(&self.row, velocities) + self.lever_m * spin
    }

    /// Adds a multiple of another one.
    pub(super) fn add(&mut self, factor: f64, other: &Self) {
        add(&mut self.row, factor, &other.row);
        self.lever_m += factor * other.lever_m;
    }
}

impl LinearForm {
    /// How fast a carrier moves along a direction and turns about a vector, and its wheel turns.
    #[inline(always)]
    pub(super) fn new(direction: Vector3, turning: Vector3, lever_m: f64) -> Self {
        Self {
            row: twist(direction, turning),
            lever_m,
        }
    }
}

/// The unit vector along another one; zero along zero.
#[inline(always)]
pub(super) fn unit(vector: Vector3) -> Vector3 {
    let length = vector.length();
    if length > f64::MIN_POSITIVE {
        vector * (1.0 / length)
    } else {
        Vector3::ZERO
    }
}

/// State of a contact.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(super) enum Mode {
    Open,
    /// Along the driven direction, and across it, which a free roller gives way to.
    Closed(Grip, Grip),
}

/// The direction across the axis of a roller that is borne by the wheel, and turns with what it passes over.
#[derive(Clone, Copy)]
pub(super) struct Across {
    pub(super) direction: Vector3,
    /// Slip along it without the roller's own spin.
    pub(super) line: LinearForm,
    /// The roller, by its index among all of the vehicle's.
    pub(super) roller: usize,
    /// Slip per unit of the roller's spin \[m\].
    pub(super) lever_m: f64,
    /// About its axis, with its bearing's damping \[kg.m^2\].
    pub(super) inertia_kg_m2: f64,
    /// The spin that the roller has at the end of the step if it is not touched \[rad/s\].
    pub(super) free_rad_s: f64,
    /// The spin that it has \[rad/s\].
    pub(super) rad_s: f64,
    /// Impulse along the direction \[N.s\].
    pub(super) impulse: f64,
}

/// A place where a wheel touches the ground, or may within the step.
#[derive(Clone, Copy)]
pub(super) struct Contact {
    pub(super) wheel: usize,
    /// The body that carries the wheel.
    pub(super) body: usize,
    /// The same as long as the contact lasts: roller and wheel, and what of the ground they touch.
    pub(super) key: [u32; 3],
    /// On the wheel \[m\], about the common centre of mass.
    pub(super) point: Vector3,
    pub(super) normal: Vector3,
    pub(super) along: Vector3,
    /// Speed of separation.
    pub(super) separation: LinearForm,
    /// Slip along the driven direction.
    pub(super) slip: LinearForm,
    pub(super) across: Option<Across>,
    /// Normal impulse per separation speed \[kg\], step (step spring + damper): the normal impulse
    /// is `-gain (separation + bias)`, or 0.
    pub(super) gain_kg: f64,
    /// Speed at which spring and damper would leave the contact without an impulse \[m/s\], below 0 inside the ground.
    pub(super) bias_m_s: f64,
    pub(super) friction: f64,
    pub(super) mode: Mode,
    /// Impulses of the step along normal and driven direction \[N.s\].
    pub(super) normal_impulse: f64,
    pub(super) friction_impulse: f64,
}

/// What a contact starts from: its mode in the step before.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct WarmStart {
    pub(super) key: [u32; 3],
    pub(super) mode: Mode,
}

impl Contact {
    /// The contact of a wheel that is a ball of this radius.
    #[inline(always)]
    pub(super) fn of_ball<const N: usize>(
        wheel: &Wheel,
        index: usize,
        tree: &Tree<N>,
        touch: &Touch,
        ball: Vector3,
        radius_m: f64,
        step_s: f64,
    ) -> Self {
        let (axle, normal) = (tree.axle[index], touch.normal);
        let point = ball - normal * radius_m;
        // The roller in touch has its axis along this; nothing is passed on across it. Of a wheel that is touched
        // beside its lowest point the lowest roller is still the one in touch where only that one is modelled.
        let up = match wheel.shape {
            WheelShape::RollerBall { .. } => tree.rotation[wheel.body].z_axis,
            _ => normal,
        };
        let rolling = unit(axle.cross(up));
        let [sin, cos] = wheel.sin_cos;
        let axis = rolling * cos + axle * sin;
        let along = unit(axis - normal * normal.dot(axis));
        let lever_m = axle.cross(point - tree.centre[index]).dot(along);
        let separation = LinearForm::new(normal, point.cross(normal), 0.0);
        // What turns the wheel about its axle does not turn its carrier.
        let slip = LinearForm::new(along, point.cross(along) - axle * lever_m, lever_m);
        Self::new(wheel, index, touch, [point, along], [separation, slip], step_s)
    }

    /// A contact that is still open; its spring is the wheel's.
    #[inline(always)]
    pub(super) fn new(
        wheel: &Wheel,
        index: usize,
        touch: &Touch,
        [point, along]: [Vector3; 2],
        [separation, slip]: [LinearForm; 2],
        step_s: f64,
    ) -> Self {
        let [spring, damper] = wheel.contact;
        let gain_kg = step_s * (step_s * spring + damper);
        Self {
            wheel: index,
            body: wheel.body,
            key: [index as u32, touch.key[0], touch.key[1]],
            point,
            normal: touch.normal,
            along,
            separation,
            slip,
            across: None,
            gain_kg,
            // Inside, a spring and a damper, both as they are at the end of the step. Outside, what
            // is left of the gap closes freely: the damper does not act before surfaces touch.
            bias_m_s: if touch.gap_m < 0.0 {
                spring * touch.gap_m * step_s / gain_kg
            } else {
                touch.gap_m / step_s
            },
            friction: touch.friction,
            mode: Mode::Open,
            normal_impulse: 0.0,
            friction_impulse: 0.0,
        }
    }

    /// What to start from: the mode of the step before, or what the carrier's twist makes of it. The
    /// contact was most likely the one of number `likely` then.
    #[inline(always)]
    pub(super) fn warm_start(
        &mut self,
        warm_starts: &[WarmStart],
        likely: usize,
        carrier: &Vector<FREE>,
        spin: f64,
    ) {
        let known = |known: &&WarmStart| known.key == self.key;
        let before = warm_starts
            .get(likely)
            .filter(known)
            .or_else(|| warm_starts.iter().find(known));
        self.mode = match before.map(|known| known.mode) {
            Some(mode @ Mode::Closed(..)) => mode,
            _ if self.separation.at(carrier, spin) + self.bias_m_s < 0.0 => {
                Mode::Closed(Grip::Stick, Grip::Stick)
            }
            _ => Mode::Open,
        };
    }

    /// Do both belong to the same roller?
    pub(super) fn shares_roller(&self, other: &Self) -> bool {
        let of = |contact: &Self| contact.across.as_ref().map(|across| across.roller);
        self.across.is_some() && of(self) == of(other)
    }

    /// The impulse on the wheel \[N.s\].
    pub(super) fn impulse(&self) -> Vector3 {
        let across = self
            .across
            .as_ref()
            .map_or(Vector3::ZERO, |across| across.direction * across.impulse);
        self.normal * self.normal_impulse + self.along * self.friction_impulse + across
    }
}
