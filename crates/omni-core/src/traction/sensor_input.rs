//! What is read: which of it says something, through the filters.

use super::torque_law::all;
use super::{Traction, TractionState};
use crate::constants::each;
use crate::linkage::{Bodies, MAX_HINGES, WheelMotion};
use crate::pid::is_plausible;
use crate::{Attitude, Readings, Real};

/// Sum of the base's and the hinges' angles up to which no body stands on its side \[rad\]: less than a quarter turn, with what axes may
/// be too long.
const UPRIGHT_RAD: f64 = 1.5;
/// Sum of sizes up to which each of them is [`is_plausible`].
const MOST: f64 = 1e6;

impl<R: Real, const N: usize> Traction<R, N> {
    /// Everything is read that there is, all of it is a number, and no body is far from level.
    #[inline(always)]
    pub(super) fn plain(&self, readings: &Readings<'_, R>) -> bool {
        let (imu, count) = (&readings.imu, self.linkage.hinge_count().min(MAX_HINGES));
        let (angles, rates) = (readings.hinges_rad, readings.hinges_rad_s);
        let Some(wheels) = readings.wheels_rad_s.first_chunk::<N>() else {
            return false;
        };
        if angles.len() < count || rates.len() < count {
            return false;
        }
        let mut angle = imu.pitch_rad.abs() + imu.roll_rad.abs();
        let [x, y, z] = imu.rate_rad_s;
        let mut sum = x.abs() + y.abs() + z.abs();
        each!(k of count {
            angle += angles[k].abs();
            sum += rates[k].abs();
        });
        each!(i of N {
            sum += wheels[i].abs();
        });
        // What is no number is not below anything.
        sum + angle * R::of(MOST / UPRIGHT_RAD) <= R::of(MOST)
    }

    /// Which wheels say something, and what: 0 of the others.
    #[inline(always)]
    pub(super) fn hear(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        plain: bool,
    ) -> ([R; N], u32) {
        let (config, zero) = (&self.config, R::zero());
        let (mut measured, heard);
        if plain && let Some(rates) = readings.wheels_rad_s.first_chunk::<N>() {
            measured = *rates;
            heard = all::<N>();
        } else {
            (measured, heard) = heard_of(readings.wheels_rad_s);
        }
        if config.encoder_rad > zero {
            each!(i of N {
                if heard & 1 << i != 0 {
                    measured[i] = state.encoders[i].step(measured[i], config.encoder_rad, config.period_s);
                }
            });
        }
        (measured, heard)
    }

    /// How the bodies turn and the wheels rise, through the filter of the rates.
    #[inline(always)]
    pub(super) fn bodies(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        plain: bool,
        bodies: &mut Bodies<R>,
    ) -> WheelMotion<R, N> {
        if !plain {
            let moves;
            (moves, *bodies) = self.doubtful(state, readings);
            return moves;
        }
        let imu = &readings.imu;
        let (angles, rates) = (readings.hinges_rad, readings.hinges_rad_s);
        let base = self.base(state, &Attitude::read(imu));
        let part = self.config.part(self.config.rates_s);
        let held = &mut state.hinges_rad_s;
        let hinge = |k: usize| match (angles.get(k), rates.get(k)) {
            (Some(angle), Some(rate)) => (*angle, follow(&mut held[k], *rate, part)),
            _ => (R::zero(), R::zero()), // there are as many
        };
        self.linkage
            .move_by::<true>(&base, hinge, bodies, &mut state.standing)
    }

    /// As [`Self::bodies`], where a sensor says nothing, or an angle that is not small.
    #[cold]
    #[inline(never)]
    fn doubtful(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
    ) -> (WheelMotion<R, N>, Bodies<R>) {
        let zero = R::zero();
        let base = self.base(state, &Attitude::of_imu(&readings.imu));
        let part = self.config.part(self.config.rates_s);
        let held = &mut state.hinges_rad_s;
        let hinge = |index: usize| {
            let angle = match readings.hinges_rad.get(index) {
                Some(angle) if is_plausible(*angle) => *angle,
                _ => zero,
            };
            let rate = match (held.get_mut(index), readings.hinges_rad_s.get(index)) {
                (Some(held), Some(now)) if is_plausible(*now) => follow(held, *now, part),
                (Some(held), Some(_)) => follow(held, zero, part), // stands, as far as anybody knows
                _ => zero,
            };
            (angle, rate)
        };
        let mut bodies = [Attitude::LEVEL; MAX_HINGES + 1];
        let moves = self
            .linkage
            .move_by::<false>(&base, hinge, &mut bodies, &mut state.standing);
        (moves, bodies)
    }

    /// The base's attitude through the filter of the rates.
    #[inline(always)]
    fn base(&self, state: &mut TractionState<R, N>, read: &Attitude<R>) -> Attitude<R> {
        let part = self.config.part(self.config.rates_s);
        let [nose, left] = &mut state.base_rad_s;
        Attitude {
            nose_up_rad_s: follow(nose, read.nose_up_rad_s, part),
            left_up_rad_s: follow(left, read.left_up_rad_s, part),
            ..*read
        }
    }
}

/// Follows what is read with this part of the gap.
#[inline(always)]
fn follow<R: Real>(held: &mut R, now: R, part: R) -> R {
    *held += part * (now - *held);
    *held
}

/// Where not every wheel says what one can have: the rates of those that do, 0 of the others, and which they are.
#[cold]
#[inline(never)]
fn heard_of<R: Real, const N: usize>(rates_rad_s: &[R]) -> ([R; N], u32) {
    let (mut measured, mut heard) = ([R::zero(); N], 0);
    for (i, (measured, read)) in measured.iter_mut().zip(rates_rad_s).enumerate() {
        if is_plausible(*read) {
            *measured = *read;
            heard |= 1 << i;
        }
    }
    (measured, heard)
}
