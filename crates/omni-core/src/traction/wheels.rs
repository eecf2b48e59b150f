//! The torque of each wheel.

use super::observation::Look;
use super::record::Record;
use super::travel_direction::Way;
use super::{Traction, TractionState, larger, least};
use crate::constants::each;
use crate::linkage::{NO_RISE, attitude, rolled};
use crate::{Real, TorqueRanges};

/// What is the same of all wheels in a period.
#[derive(Clone, Copy)]
pub(super) struct Common<R> {
    pub(super) speed_m_s: R,
    /// Square of the speed, and its sign, at next to none the target's; 0 of none.
    pub(super) squared: R,
    pub(super) sign: R,
    pub(super) thrust_n_m: R,
    pub(super) yaw_thrust: R,
    pub(super) yaw_reference: R,
    /// Of wheels that climb: slip that is free \[m/s\], by how much they are to spin, with what torque per speed that is lacking.
    pub(super) climbing: u32,
    pub(super) climbing_free_m_s: R,
    pub(super) spin_m_s: R,
    pub(super) spin_gain: R,
    /// Parts of the filters.
    pub(super) contact: R,
    /// Where rows are levelled, torque by how far the left side and the nose of a wheel's carrier point up \[N.m/rad\].
    pub(super) levels: bool,
    pub(super) across: [R; 2],
    /// The thrust is not back.
    pub(super) forward: bool,
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// Every wheel's torque, and what is remembered of it.
    #[inline(always)]
    pub(super) fn torques(
        &self,
        state: &mut TractionState<R, N>,
        observed: &Look<'_, R, N>,
        common: &Common<R>,
        range: &TorqueRanges<R, N>,
        told: &mut impl Record<R, N>,
    ) {
        let (config, zero) = (&self.config, R::zero());
        let ahead = if common.forward { R::one() } else { -R::one() };
        let driven = state.ways.driven;
        let (turning, yaw_thrust) = (
            self.turning(common.yaw_reference),
            self.turning(common.yaw_thrust),
        );
        each!(i of N {
            let (way, memory) = (&state.ways.wheels[i], &mut state.wheels[i]);
            let measured = observed.measured[i];
            let turning = turning[i];
            let (lower, upper) = (range.lower_n_m[i], range.upper_n_m[i]);
            let fits = |torque: R| {
                if self.limits.are_constant() {
                    torque.abs() <= upper // which is as far from 0 as the lower one
                } else {
                    torque <= upper && torque >= lower
                }
            };
            let (torque, inside);
            if driven & 1 << i != 0 {
                // What the ground takes: the motor's torque less what turns the wheel faster.
                let taken = memory.applied_n_m - self.inertia_kg_m2[i] / config.period_s * (measured - memory.measured_rad_s);
                memory.contact_n_m += common.contact * (taken - memory.contact_n_m);
                let rolled = self.rolled(way, common, observed.rise_m_s[i]);
                let slip = (observed.free_rad_s[i] - turning) * way.inverse_m - rolled;
                let climbs = common.climbing & 1 << i != 0;
                let p = common.thrust_n_m * way.part;
                let free = if climbs {
                    common.climbing_free_m_s
                } else {
                    config.slip_free_m_s
                };
                let mut own = self.slipping(memory.contact_n_m, p, ahead * slip, free, ahead * way.gain);
                if climbs && common.spin_m_s > zero {
                    let spun = common.spin_gain * way.size * (common.spin_m_s - slip);
                    own = way.along * larger(least(spun, memory.most_n_m), way.along * own);
                }
                own += yaw_thrust[i];
                if common.levels {
                    let attitude = attitude(observed.bodies, self.linkage.carrier(i));
                    let tilt = attitude.left_up_rad * common.across[0] - attitude.nose_up_rad * common.across[1];
                    own -= way.lever * tilt;
                }
                (torque, inside) = (own, fits(own));
                told.driven(i, p, torque, way.size * slip, memory.contact_n_m);
            } else {
                let error = way.per_m * common.speed_m_s + turning - measured;
                let (p, held) = (config.free_gain_n_m_s_rad * error, memory.free_n_m);
                torque = p + held;
                inside = fits(torque);
                if inside || error * torque <= zero {
                    memory.free_n_m += config.free_integral_n_m_rad * error * config.period_s;
                }
                told.across(i, p, held);
            }
            let applied = if inside { torque } else { torque.limited(lower, upper) };
            (memory.applied_n_m, memory.measured_rad_s) = (applied, measured);
            told.torque(i, torque, applied, !inside);
        });
    }

    /// Speed along the way at which a wheel does not slip \[m/s\]: along the way of its centre, up the edge too.
    #[inline(always)]
    fn rolled(&self, way: &Way<R>, common: &Common<R>, rise_m_s: R) -> R {
        let rise = rise_m_s * rise_m_s;
        if rise < R::of(NO_RISE) {
            common.speed_m_s
        } else {
            common.sign * rolled(common.squared, rise, way.cosine)
        }
    }

    /// The torque \[N.m\] of a wheel that has this common thrust, slips so fast along it and is free to slip so fast.
    #[inline(always)]
    fn slipping(&self, contact_n_m: R, thrust_n_m: R, slip: R, free: R, gain: R) -> R {
        if slip > R::zero() {
            let beyond = slip - free;
            if beyond > R::zero() {
                return self.pushing(contact_n_m, thrust_n_m, beyond) - gain * beyond;
            }
        } else {
            let beyond = -slip - free;
            if beyond > R::zero() {
                return thrust_n_m + gain * beyond;
            }
        }
        thrust_n_m
    }

    /// A wheel that pushes beyond what is free gives no more than the ground takes where all of what is tolerated is used up \[N.m\].
    #[inline(always)]
    fn pushing(&self, contact_n_m: R, thrust_n_m: R, beyond: R) -> R {
        let (mut held, most, width) = (contact_n_m, thrust_n_m.abs(), self.config.slip_width_m_s);
        if held.abs() > most {
            held = if held > R::zero() { most } else { -most };
        }
        if beyond < width {
            let a = beyond / width;
            held = (R::one() - a) * thrust_n_m + a * held;
        }
        held
    }
}
