//! Encoders that are dead together: the inertial unit sees the vehicle gain speed, and wheels that push it stand.

use super::model::Traction;
use super::state::{TractionState, Unseen};
use crate::Real;
use crate::policy::{GRAVITY_M_S2, Imu};
use crate::scalar::{all_plausible, max};

/// A wheel that stands pushes the vehicle with more than this fraction of its torque.
pub(super) const PUSH_PART: f64 = 0.1;
/// One that begins to stand counts as one that stood throughout until the inertial unit has seen this way \[m\].
const JOINS_M: f64 = 0.002;
/// Speed \[m/s\] gained within about this time \[s\] that is enough: an attitude that is off by 3 degrees makes less
/// of gravity.
const GAINED_M_S: f64 = 0.3;
const WITHIN_S: f64 = 0.5;
/// The way that goes with it \[m\], also in counts: a wheel that turns has shown it by then.
const GONE_M: f64 = 0.02;
const GONE_COUNTS: f64 = 3.0;
/// Turning counts as motion at this distance \[m\].
const LEVER_M: f64 = 0.3;
/// A unit whose accelerometer is not filled in reads less \[m/s^2\].
const LEAST_M_S2: f64 = 1.0;

impl<R: Real, const N: usize> Traction<R, N> {
    /// Leaves out the wheels that stand and push while the vehicle goes where they push it: their encoders are dead.
    #[inline(never)]
    pub(super) fn doubt_standing(&self, state: &mut TractionState<R, N>, imu: &Imu<R>) {
        let joins = !state.any_stood || state.unseen.gone_m < R::of(JOINS_M);
        // What they push along the direction of travel, to the left of it \[N\], and about the vertical \[N.m\].
        let mut push = [R::zero(); 3];
        for i in 0..N {
            let (travel, wheel) = (&state.travel[i], &mut state.wheels[i]);
            let stands = wheel.usable && wheel.read_rad_s == R::zero() && wheel.pushes(PUSH_PART);
            wheel.stood = stands && (joins || wheel.stood);
            if wheel.stood {
                let rates = [travel.rate_rad_m, travel.side_rate_rad_m, self.turned_by(i)];
                for (push, rate) in push.iter_mut().zip(rates) {
                    *push += rate * wheel.applied_n_m;
                }
            }
        }
        let [fx, fy, fz] = imu.specific_force_m_s2;
        let read = [fx, fy, fz, imu.pitch_rad, imu.roll_rad, imu.rate_rad_s[2]];
        let (least, zero) = (R::of(LEAST_M_S2), R::zero());
        let [ahead_n, left_n, turn_n] = [push[0], push[1], push[2] / R::of(LEVER_M)];
        let push_n = (ahead_n * ahead_n + left_n * left_n + turn_n * turn_n).sqrt();
        if !all_plausible(&read) || fx * fx + fy * fy + fz * fz < least * least || push_n <= zero {
            state.any_stood = false;
            return;
        }
        let period_s = self.config.period_s;
        let ((nose_up, _), (left_up, _)) = (imu.pitch_rad.sine_cosine(), imu.roll_rad.sine_cosine());
        let (ax, ay) = (
            fx - R::of(GRAVITY_M_S2) * nose_up,
            fy - R::of(GRAVITY_M_S2) * left_up,
        );
        let [dx, dy] = state.direction;
        let (ahead_m_s2, left_m_s2) = (ax * dx + ay * dy, ay * dx - ax * dy);
        let yaw_rad_s = imu.rate_rad_s[2];
        if !state.any_stood {
            state.unseen = Unseen {
                yaw_rad_s,
                ..Unseen::NONE
            };
            state.any_stood = true;
        }
        let unseen = &mut state.unseen;
        // The power of the push by a change of the motion, over the push: a blocked wheel does no work, also if the
        // vehicle turns about it.
        let turned_m_s = R::of(LEVER_M) * (yaw_rad_s - unseen.yaw_rad_s);
        let gained_m_s =
            ((ahead_m_s2 * ahead_n + left_m_s2 * left_n) * period_s + turned_m_s * turn_n) / push_n;
        unseen.yaw_rad_s = yaw_rad_s;
        unseen.gained_m_s += gained_m_s - unseen.gained_m_s / R::of(WITHIN_S) * period_s;
        unseen.gained_m_s = max(unseen.gained_m_s, zero);
        unseen.gone_m += unseen.gained_m_s * period_s;
        let counts_m = R::of(GONE_COUNTS) * self.times.count_rad / state.largest_rate_rad_m;
        if unseen.gained_m_s > R::of(GAINED_M_S) && unseen.gone_m > max(R::of(GONE_M), counts_m) {
            for wheel in &mut state.wheels {
                wheel.doubted |= wheel.stood;
            }
            state.any_stood = false;
        }
    }
}
