//! What depends on the direction of travel only, and on the configuration.

use super::{BALANCED_PART, DRIVEN_PART, ENOUGH_PART, Traction, TractionState};
use crate::{BodyTwist, Real};

/// A wheel on a way.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Way<R> {
    /// Rate of its actuator per speed along the direction \[rad/m\], and the size and the sign of that.
    pub(super) per_m: R,
    pub(super) size: R,
    pub(super) along: R,
    /// Speed along the direction per rate of the actuator \[m/rad\]; 0 of a wheel that is not driven.
    pub(super) inverse_m: R,
    /// Its part of the common thrust.
    pub(super) part: R,
    /// How far it is to the left of the middle, as a part of how far the outermost wheel is, signed as its thrust.
    pub(super) lever: R,
    /// Square of the cosine of the angle between its push and the way.
    pub(super) cosine: R,
    /// Torque taken out per speed of slip \[N.s\], with the sign of `along`.
    pub(super) gain: R,
}

/// The wheels of a vehicle on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub(super) struct Ways<R, const N: usize> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) wheels: [Way<R>; N],
    pub(super) largest_per_m: R,
    /// Wheels that the direction drives; wheel i is bit i.
    pub(super) driven: u32,
    /// It is of the present direction, and what motors have is known of its driven wheels.
    pub(super) known: bool,
    pub(super) ranged: bool,
}

impl<R: Real, const N: usize> Ways<R, N> {
    pub(super) const fn new() -> Self {
        let nothing = Way {
            per_m: R::ZERO,
            size: R::ZERO,
            along: R::ONE,
            inverse_m: R::ZERO,
            part: R::ZERO,
            lever: R::ZERO,
            cosine: R::ZERO,
            gain: R::ZERO,
        };
        Self {
            wheels: [nothing; N],
            largest_per_m: R::ZERO,
            driven: 0,
            known: false,
            ranged: false,
        }
    }
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// Takes a new command, or the first, for the direction of travel.
    #[cold]
    #[inline(never)]
    pub(super) fn travel(&self, state: &mut TractionState<R, N>, command: &BodyTwist<R>) {
        state.travel(command, &self.kinematics);
        if !state.ways.known {
            self.find_ways(state);
        }
    }

    /// The wheels on their way in this direction.
    fn find_ways(&self, state: &mut TractionState<R, N>) {
        const { assert!(N <= 32, "at most 32 wheels") };
        let (zero, config) = (R::zero(), &self.config);
        let ([dx, dy], ways) = (state.direction, &mut state.ways);
        let mut largest = zero;
        for (way, [ax, ay, _]) in ways.wheels.iter_mut().zip(self.kinematics.inverse_matrix()) {
            way.per_m = *ax * dx + *ay * dy;
            way.size = way.per_m.abs();
            largest = if way.size > largest { way.size } else { largest };
        }
        let (mut moment, mut levers) = (zero, zero);
        for (way, [_, _, turned]) in ways.wheels.iter().zip(self.kinematics.inverse_matrix()) {
            if way.size >= R::of(ENOUGH_PART) * largest {
                moment += way.per_m * *turned;
                levers += (way.per_m * *turned).abs();
            }
        }
        let balanced = moment.abs() <= R::of(BALANCED_PART) * levers;
        let part = R::of(if balanced { ENOUGH_PART } else { DRIVEN_PART });
        ways.driven = 0;
        for (i, way) in ways.wheels.iter_mut().enumerate() {
            let [x, y] = self.place_m[i];
            // What the ground takes along the thrust is so along another thrust too.
            let along = way.per_m.signum();
            state.wheels[i].contact_n_m *= along * way.along;
            way.along = along;
            let driven = largest > zero && way.size >= part * largest;
            ways.driven |= u32::from(driven) << i;
            if driven {
                state.wheels[i].free_n_m = zero;
            }
            way.inverse_m = if driven { R::one() / way.per_m } else { zero };
            way.part = if driven { way.per_m / largest } else { zero };
            way.lever = way.along * (y * dx * self.per_side_m[0] - x * dy * self.per_side_m[1]);
            let cosine = way.size * self.way_m_rad[i];
            way.cosine = cosine * cosine;
            way.gain = self.inertia_kg_m2[i] / config.slip_s * way.per_m;
        }
        ways.largest_per_m = largest;
        (ways.known, ways.ranged) = (true, false);
    }
}
