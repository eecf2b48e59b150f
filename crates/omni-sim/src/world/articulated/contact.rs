//! Contacts: where wheels touch, and how fast the wheel's surface moves there per velocity of the vehicle.

use rapier3d_f64::prelude::Vector as Vector3;
use serde::{Deserialize, Serialize};

use super::grip::Grip;
use super::ground::Touch;
use super::linear::{Vector, add, dot};
use super::model::{Model, Wheel, WheelShape};
use super::tree::Tree;

/// A velocity as a linear function of the generalised velocities and of the spin of one wheel.
#[derive(Clone, Copy)]
pub(super) struct LinearForm<const N: usize> {
    pub(super) row: Vector<N>,
    /// Per unit of the wheel's spin \[m\].
    pub(super) lever_m: f64,
}

impl<const N: usize> LinearForm<N> {
    pub(super) const ZERO: Self = Self {
        row: [0.0; N],
        lever_m: 0.0,
    };

    pub(super) fn at(&self, u: &Vector<N>, spin: f64) -> f64 {
        dot(&self.row, u) + self.lever_m * spin
    }

    /// Adds a multiple of another one.
    pub(super) fn add(&mut self, factor: f64, other: &Self) {
        add(&mut self.row, factor, &other.row);
        self.lever_m += factor * other.lever_m;
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
pub(super) struct Across<const N: usize> {
    pub(super) direction: Vector3,
    /// Slip along it without the roller's own spin.
    pub(super) line: LinearForm<N>,
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
pub(super) struct Contact<const N: usize> {
    pub(super) wheel: usize,
    /// The same as long as the contact lasts: roller and wheel, and what of the ground they touch.
    pub(super) key: [u32; 3],
    /// On the wheel \[m\], about the common centre of mass.
    pub(super) point: Vector3,
    pub(super) normal: Vector3,
    pub(super) along: Vector3,
    /// Speed of separation.
    pub(super) separation: LinearForm<N>,
    /// Slip along the driven direction.
    pub(super) slip: LinearForm<N>,
    pub(super) across: Option<Across<N>>,
    /// Normal impulse per separation speed \[kg\], step (step spring + damper): the normal impulse
    /// is `-stiffness (separation + bias)`, or 0.
    pub(super) stiffness: f64,
    pub(super) bias: f64,
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

impl<const N: usize> Contact<N> {
    /// The contact of a wheel that is a ball.
    pub(super) fn of_ball(
        model: &Model,
        tree: &Tree<N>,
        index: usize,
        touch: &Touch,
        [ball, centre]: [Vector3; 2],
        radius_m: f64,
        step_s: f64,
    ) -> Self {
        let wheel = &model.wheels[index];
        let rotation = tree.rotation[wheel.body];
        let (axle, normal) = (rotation * wheel.axle, touch.normal);
        let point = ball - normal * radius_m;
        // The roller in touch has its axis along this; nothing is passed on across it. Of a wheel that is touched
        // beside its lowest point the lowest roller is still the one in touch where only that one is modelled.
        let up = match wheel.shape {
            WheelShape::RollerBall { .. } => rotation * Vector3::Z,
            _ => normal,
        };
        let rolling = axle.cross(up).normalize_or_zero();
        let [sin, cos] = wheel.sin_cos;
        let axis = rolling * cos + axle * sin;
        let along = (axis - normal * normal.dot(axis)).normalize_or_zero();
        let lever_m = axle.cross(point - centre).dot(along);
        let mut slip = tree.along(wheel.body, point, along);
        tree.add_turning(&mut slip, wheel.body, axle * -lever_m);
        let separation = LinearForm {
            row: tree.along(wheel.body, point, normal),
            lever_m: 0.0,
        };
        let slip = LinearForm { row: slip, lever_m };
        Self::new(wheel, index, touch, [point, along], [separation, slip], step_s)
    }

    /// A contact that is still open; its spring is the wheel's.
    pub(super) fn new(
        wheel: &Wheel,
        index: usize,
        touch: &Touch,
        [point, along]: [Vector3; 2],
        [separation, slip]: [LinearForm<N>; 2],
        step_s: f64,
    ) -> Self {
        let [spring, damper] = wheel.contact;
        let stiffness = step_s * (step_s * spring + damper);
        Self {
            wheel: index,
            key: [index as u32, touch.key[0], touch.key[1]],
            point,
            normal: touch.normal,
            along,
            separation,
            slip,
            across: None,
            stiffness,
            // Inside, a spring and a damper, both as they are at the end of the step. Outside, what
            // is left of the gap closes freely: the damper does not act before surfaces touch.
            bias: if touch.gap_m < 0.0 {
                spring * touch.gap_m * step_s / stiffness
            } else {
                touch.gap_m / step_s
            },
            friction: touch.friction,
            mode: Mode::Open,
            normal_impulse: 0.0,
            friction_impulse: 0.0,
        }
    }

    /// What to start from: the mode of the step before, or what the present velocities make of it.
    pub(super) fn warm_start(&mut self, warm_starts: &[WarmStart], u: &Vector<N>, spin: f64) {
        let before = warm_starts.iter().find(|known| known.key == self.key);
        self.mode = match before.map(|known| known.mode) {
            Some(mode @ Mode::Closed(..)) => mode,
            _ if self.separation.at(u, spin) + self.bias < 0.0 => Mode::Closed(Grip::Stick, Grip::Stick),
            _ => Mode::Open,
        };
    }

    /// Do both belong to the same roller?
    pub(super) fn shares_roller(&self, other: &Self) -> bool {
        let of = |contact: &Self| contact.across.map(|across| across.roller);
        self.across.is_some() && of(self) == of(other)
    }

    /// The impulse on the wheel \[N.s\].
    pub(super) fn impulse(&self) -> Vector3 {
        let across = self
            .across
            .map_or(Vector3::ZERO, |across| across.direction * across.impulse);
        self.normal * self.normal_impulse + self.along * self.friction_impulse + across
    }
}
