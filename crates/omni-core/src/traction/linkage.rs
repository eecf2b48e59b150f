//! First step: what is read, and how bodies and wheels move by it.

use super::model::Traction;
use super::state::TractionState;
use super::unseen::PUSH_PART;
use crate::Real;
use crate::linkage::{Attitude, LinkageMotion, MAX_HINGES, NO_RISE, rolled};
use crate::policy::Readings;
use crate::scalar::{follow, is_plausible, max, min};

/// This many wheels determine the vehicle's motion. An error of one of them is detected by a further wheel, or by a
/// gyro.
const MOTIONS: usize = 3;
/// Traction control resumes once there was a redundant wheel for this time \[s\].
const SPARE_AGAIN_S: f64 = 0.5;

/// A reading is stuck if it stays bit-identical while its motor applies more than this fraction of its torque: for the
/// first time if it is 0, else for the second \[s\]. A stuck reading of 0 is used again after the last.
const STUCK_PART: f64 = 0.5;
const STUCK_STANDING_S: f64 = 1.0;
const STUCK_TURNING_S: f64 = 0.25;
const STUCK_AGAIN_S: f64 = 4.0;

impl<R: Real, const N: usize> Traction<R, N> {
    /// Rates of the wheels, 0 of those that are not usable. A wheel is not usable where its reading
    /// is no number, stuck, or doubted.
    pub(super) fn read_wheels(&self, state: &mut TractionState<R, N>, readings: &Readings<'_, R>) -> [R; N] {
        let period_s = self.config.period_s;
        let (resting, raw, watched) = (state.is_resting(), state.raw, state.watched);
        let (mut known, mut driven) = (0, 0);
        let mut stands = false;
        let mut rates = [R::zero(); N];
        for (i, rate) in rates.iter_mut().enumerate() {
            let wheel = &mut state.wheels[i];
            let before = wheel.usable;
            let read = readings.wheels_rad_s.get(i).copied();
            let read = read.filter(|read| is_plausible(*read));
            wheel.doubted &= !resting;
            wheel.usable = read.is_some_and(|read| !wheel.check_stuck(read, period_s, resting, watched))
                && !wheel.doubted;
            // One that reads exactly zero may be stuck because it is blocked: it counts as one that works.
            let is_zero = read == Some(R::zero());
            let works = wheel.usable || (is_zero && !wheel.doubted);
            stands |= is_zero && wheel.pushes(PUSH_PART);
            known += usize::from(works);
            driven += usize::from(works && state.travel[i].driven);
            let Some(read) = read.filter(|_| wheel.usable) else {
                wheel.forget();
                continue;
            };
            let times = &self.times;
            *rate = read;
            if times.count_rad > R::zero() {
                let estimated = wheel
                    .encoder
                    .step(read, times.count_rad, times.window_s, period_s);
                if !raw {
                    *rate = estimated;
                }
            }
            if !before {
                wheel.measured_rad_s = *rate; // one that is usable again has not changed its rate
            }
        }
        if stands && !resting {
            self.doubt_standing(state, &readings.imu);
        } else {
            state.any_stood = false;
        }
        let gyro = is_plausible(readings.imu.rate_rad_s[2]) && self.knows_zero(state);
        let spare = known >= if gyro { MOTIONS } else { MOTIONS + 1 } && driven > 1;
        state.redundant_again_s = if spare {
            max(state.redundant_again_s - period_s, R::zero())
        } else {
            R::of(SPARE_AGAIN_S)
        };
        rates
    }

    /// How the bodies turn and the wheels rise, through the filter of the rates. NaN counts as 0.
    pub(super) fn find_motion(&self, state: &mut TractionState<R, N>, readings: &Readings<'_, R>) {
        let part = self.config.part(self.config.rates_s);
        let read = Attitude::of_imu(&readings.imu);
        let imu = Attitude::read(&readings.imu);
        let hinges = self.linkage.hinge_count().min(MAX_HINGES);
        let all = |values: &[R]| {
            values.len() >= hinges && values.iter().take(hinges).all(|value| is_plausible(*value))
        };
        // An attitude that is no number is no unit.
        state.reads_linkage = hinges > 0
            && is_plausible(imu.nose_up_rad + imu.left_up_rad + imu.nose_up_rad_s + imu.left_up_rad_s)
            && all(readings.hinges_rad)
            && all(readings.hinges_rad_s);
        self.find_base_zero(state, &imu);
        let is_read = state.attitude_rad.is_some();
        for (k, rate) in [read.nose_up_rad_s, read.left_up_rad_s].into_iter().enumerate() {
            let zero = if is_read {
                state.base_zero_rad_s[k]
            } else {
                R::zero()
            };
            follow(&mut state.base_rad_s[k], rate - zero, part);
        }
        let [nose, left] = &state.base_rad_s;
        let base = Attitude {
            nose_up_rad_s: *nose,
            left_up_rad_s: *left,
            ..read
        };
        for k in 0..hinges {
            let rate = readings.hinges_rad_s.get(k).copied();
            let rate = rate.filter(|rate| is_plausible(*rate)).unwrap_or(R::zero());
            follow(&mut state.hinges_rad_s[k], rate, part);
        }
        let (rates, motion) = (&state.hinges_rad_s, &mut state.motion);
        self.linkage.move_by(&base, readings.hinges_rad, rates, motion);
    }

    /// The zero of the base's rates is what they say beyond the change of the attitude: it would be wheels that rise.
    fn find_base_zero(&self, state: &mut TractionState<R, N>, imu: &Attitude<R>) {
        let (now, rates) = (
            [imu.nose_up_rad, imu.left_up_rad],
            [imu.nose_up_rad_s, imu.left_up_rad_s],
        );
        if !now.into_iter().chain(rates).all(is_plausible) {
            state.attitude_rad = None;
            return;
        }
        let (period_s, whole_s) = (self.config.period_s, self.config.gyro_zero_s);
        if let Some(before) = state.attitude_rad.replace(now)
            && whole_s > R::zero()
        {
            state.base_found_s = min(state.base_found_s + period_s, whole_s);
            let (part, most) = (
                self.config.part(state.base_found_s),
                self.config.gyro_zero_max_rad_s,
            );
            for (k, zero) in state.base_zero_rad_s.iter_mut().enumerate() {
                // An attitude that jumps is no rate.
                let beyond = rates[k] - (now[k] - before[k]) / period_s;
                follow(zero, beyond.limited(-most, most), part);
            }
        }
    }

    /// Rates of the wheels less what their encoders see of their carriers' turning.
    pub(super) fn free_of_carriers(&self, rates: &[R; N], motion: &LinkageMotion<R, N>) -> [R; N] {
        let mut free = *rates;
        for (i, free) in free.iter_mut().enumerate() {
            let attitude = motion.attitude(self.linkage.carrier(i));
            let [nose, left] = self.carrier[i];
            *free -= nose * attitude.nose_up_rad_s + left * attitude.left_up_rad_s;
        }
        free
    }

    /// Speed along the way at which a wheel that rises so does not slip \[m/s\]: the speed of its centre, also up the
    /// edge.
    pub(super) fn rolled_m_s(&self, speed_m_s: R, sign: R, rise_m_s: R, cosine_squared: R) -> R {
        let rise = rise_m_s * rise_m_s;
        if rise < R::of(NO_RISE) {
            speed_m_s
        } else {
            sign * rolled(speed_m_s * speed_m_s, rise, cosine_squared)
        }
    }
}

impl<R: Real, const N: usize> TractionState<R, N> {
    /// Wheels that are left out because they show a slow vehicle while the ground carries the
    /// others, or turn with a reading that stays.
    pub(crate) fn left_out(&self) -> [bool; N] {
        (self.wheels)
            .map(|wheel| wheel.doubted || (wheel.read_rad_s != R::zero() && wheel.is_same_for_long(false)))
    }
}

impl<R: Real> super::state::WheelState<R> {
    /// Is the reading stuck? Notes for how long it has been the same. A wheel that stands has
    /// longer than one that turns, because it may be blocked, and is used again after a while;
    /// where a fault monitor watches, that judges it.
    #[inline(always)]
    fn check_stuck(&mut self, read_rad_s: R, period_s: R, resting: bool, watched: bool) -> bool {
        let zero = R::zero();
        let stands = read_rad_s == zero;
        if resting || (stands && watched) || !read_rad_s.same_bits(self.read_rad_s) {
            self.same_s = zero;
        } else if self.pushes(STUCK_PART) || self.is_same_for_long(stands) {
            self.same_s += period_s;
        }
        if stands && self.same_s > R::of(STUCK_AGAIN_S) {
            self.same_s = zero;
        }
        self.read_rad_s = read_rad_s;
        self.is_same_for_long(stands)
    }

    /// It applies more than this part of its torque.
    #[inline(always)]
    pub(super) fn pushes(&self, part: f64) -> bool {
        self.applied_n_m.abs() > R::of(part) * self.most_n_m
    }

    #[inline(always)]
    fn is_same_for_long(&self, stands: bool) -> bool {
        self.same_s > R::of(if stands { STUCK_STANDING_S } else { STUCK_TURNING_S })
    }
}
