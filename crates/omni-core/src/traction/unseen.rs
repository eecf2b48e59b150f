//! Encoders that are dead together: the accelerometer sees the vehicle gain speed, and wheels that push it stand.

use super::model::Traction;
use super::state::{TractionState, Unseen};
use crate::Real;
use crate::policy::{GRAVITY_M_S2, Imu};
use crate::scalar::{all_plausible, max};

/// Speed \[m/s\] gained within about this time \[s\] that is enough: an attitude that is off by 3 degrees makes less
/// of gravity.
const GAINED_M_S: f64 = 0.3;
const WITHIN_S: f64 = 0.5;
/// The way that goes with it \[m\], also in counts: a wheel that turns has shown it by then.
const GONE_M: f64 = 0.02;
const GONE_COUNTS: f64 = 3.0;
/// A unit whose accelerometer is not filled in reads less \[m/s^2\].
const LEAST_M_S2: f64 = 1.0;

impl<R: Real, const N: usize> Traction<R, N> {
    /// Leaves out the wheels that stand and push while the vehicle goes where they push it: their encoders are dead.
    /// Those that stood so throughout are known; `push_n` is what they push along the direction of travel and to the
    /// left of it.
    pub(super) fn doubt_standing(&self, state: &mut TractionState<R, N>, imu: &Imu<R>, push_n: [R; 2]) {
        let [fx, fy, fz] = imu.specific_force_m_s2;
        let read = [fx, fy, fz, imu.pitch_rad, imu.roll_rad];
        let least = R::of(LEAST_M_S2);
        let push = (push_n[0] * push_n[0] + push_n[1] * push_n[1]).sqrt();
        if !all_plausible(&read) || fx * fx + fy * fy + fz * fz < least * least || push <= R::zero() {
            state.unseen = None;
            return;
        }
        let period_s = self.config.period_s;
        let ((ahead, _), (left, _)) = (imu.pitch_rad.sine_cosine(), imu.roll_rad.sine_cosine());
        let gravity = R::of(GRAVITY_M_S2);
        let [dx, dy] = state.direction;
        let (ax, ay) = (fx - gravity * ahead, fy - gravity * left);
        let gained_m_s2 = ((ax * dx + ay * dy) * push_n[0] + (ay * dx - ax * dy) * push_n[1]) / push;
        let mut unseen = state.unseen.unwrap_or(Unseen {
            gained_m_s: R::zero(),
            gone_m: R::zero(),
        });
        unseen.gained_m_s += (gained_m_s2 - unseen.gained_m_s / R::of(WITHIN_S)) * period_s;
        unseen.gained_m_s = max(unseen.gained_m_s, R::zero());
        unseen.gone_m += unseen.gained_m_s * period_s;
        let counts_m = R::of(GONE_COUNTS) * self.times.count_rad / state.largest_rate_rad_m;
        state.unseen = Some(unseen);
        if unseen.gained_m_s > R::of(GAINED_M_S) && unseen.gone_m > max(R::of(GONE_M), counts_m) {
            for wheel in &mut state.wheels {
                wheel.doubted |= wheel.stood;
            }
            state.unseen = None;
        }
    }
}
