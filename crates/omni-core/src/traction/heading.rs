//! Fifth step: how the vehicle turns, keeping its heading, keeping rows level. `measure_yaw` runs before the second
//! step, which takes its yaw rate.

use super::loops::TractionLoops;
use super::model::Traction;
use super::state::TractionState;
use super::target::TractionTarget;
use crate::Real;
use crate::policy::Imu;
use crate::scalar::{follow, is_plausible, max, min};

/// Heading error that is kept at most \[rad\].
const HEADING_RAD: f64 = 0.5;
/// Way across the direction of travel that is made up for at most \[m\].
const DRIFT_M: f64 = 0.05;
/// Nothing rises faster \[m/s\], nothing points up further \[rad\]: the vehicle drives on the level.
const QUIET_M_S: f64 = 0.02;
const LEVEL_RAD: f64 = 0.02;
/// Driven wheels that differ by less than so many times the slip that is left alone roll at the same speed.
const ALIKE: f64 = 4.0;
/// A gyro is used once its zero was looked at for so long \[s\].
const FOUND_S: f64 = 0.05;

/// Effect of turning on the wheels.
#[derive(Clone, Copy)]
pub(super) struct Turn<R> {
    /// Yaw rate that the wheels are meant to have \[rad/s\].
    pub(super) reference_rad_s: R,
    /// Thrust per rate of a wheel by yaw rate.
    pub(super) thrust_n_m: R,
    /// Torque of a wheel per its rate by speed across the direction of travel, which is in rad/m \[N.m^2/rad\].
    pub(super) side_n_m2_rad: R,
    /// Rows are levelled: torque by how far left side and nose of a wheel's carrier point up \[N.m/rad\].
    pub(super) levels: bool,
    pub(super) level_n_m_rad: [R; 2],
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// Steps the yaw rate, by the gyro less its zero, or by the wheels if there is none, or none whose zero is known;
    /// returns it as it is read, without the filter.
    pub(super) fn measure_yaw(
        &self,
        state: &mut TractionState<R, N>,
        imu: &Imu<R>,
        rolling_rad_s: &[R; N],
    ) -> R {
        let config = &self.config;
        let gyro = Some(imu.rate_rad_s[2]).filter(|rate| is_plausible(*rate));
        if let Some(rate) = gyro
            && let Some(turns) = self.turns_by_wheels(state, rolling_rad_s)
        {
            let most = config.gyro_zero_max_rad_s;
            state.gyro_found_s = min(state.gyro_found_s + config.period_s, config.gyro_zero_s);
            let zero = state.gyro_zero_rad_s;
            state.gyro_zero_rad_s = zero + config.part(state.gyro_found_s) * (rate - turns - zero);
            state.gyro_zero_rad_s = state.gyro_zero_rad_s.limited(-most, most);
        }
        let rate = match gyro {
            Some(rate) if self.knows_zero(state) => rate - state.gyro_zero_rad_s,
            _ => self.by_wheels(state, rolling_rad_s, &self.kinematics.forward_matrix()[2]),
        };
        let [dx, dy] = state.direction;
        let [ahead, left, _] = self.kinematics.forward_matrix();
        let across: [R; N] = core::array::from_fn(|i| left[i] * dx - ahead[i] * dy);
        let drift = self.by_wheels(state, rolling_rad_s, &across);
        let part = config.part(self.times.speed_s);
        follow(&mut state.yaw_rad_s, rate, part);
        follow(&mut state.drift_m_s, drift, part);
        rate
    }

    /// Has the gyro's zero been looked at for long enough?
    pub(super) fn knows_zero(&self, state: &TractionState<R, N>) -> bool {
        state.gyro_found_s >= min(R::of(FOUND_S), self.config.gyro_zero_s)
    }

    /// A part of the motion by the wheels, one that is not usable taken to turn as it would with the last motion.
    pub(super) fn by_wheels(
        &self,
        state: &TractionState<R, N>,
        rolling_rad_s: &[R; N],
        per_rate: &[R; N],
    ) -> R {
        let mut sum = R::zero();
        for i in 0..N {
            let rate = if state.wheels[i].usable {
                rolling_rad_s[i]
            } else {
                let travel = &state.travel[i];
                travel.rate_rad_m * state.speed_m_s
                    + travel.side_rate_rad_m * state.drift_m_s
                    + self.turned_by(i) * state.yaw_rad_s
            };
            sum += per_rate[i] * rate;
        }
        sum
    }

    /// The yaw rate by the wheels where it can be trusted with a gyro's zero: where the vehicle
    /// stands, or drives on the level with little thrust and no wheel that disagrees with the others.
    fn turns_by_wheels(&self, state: &TractionState<R, N>, rolling_rad_s: &[R; N]) -> Option<R> {
        let (config, zero) = (&self.config, R::zero());
        if config.gyro_zero_s == zero || !state.wheels.iter().all(|wheel| wheel.usable) {
            return None;
        }
        let quiet =
            state.thrust_n_m.abs() < config.gyro_zero_part * state.largest_motor_n_m || state.is_resting();
        let still = state
            .motion
            .rise_m_s
            .iter()
            .all(|rise| rise.abs() < R::of(QUIET_M_S));
        if !(quiet && still) {
            return None;
        }
        if state.is_resting() && rolling_rad_s.iter().all(|rate| *rate == zero) {
            return Some(zero);
        }
        let level = (0..N)
            .all(|i| state.motion.attitude(self.linkage.carrier(i)).nose_up_rad.abs() < R::of(LEVEL_RAD));
        if !level {
            return None;
        }
        let turns = self.by_wheels(state, rolling_rad_s, &self.kinematics.forward_matrix()[2]);
        // Without that every driven wheel rolls at the same speed.
        let (mut slowest, mut fastest) = (R::of(1e30), -R::of(1e30));
        for i in 0..N {
            if state.travel[i].driven {
                let rolls = (rolling_rad_s[i] - self.turned_by(i) * turns) * state.travel[i].way_m;
                (slowest, fastest) = (min(slowest, rolls), max(fastest, rolls));
            }
        }
        let agree = fastest - slowest < R::of(ALIKE) * self.times.free_m_s;
        agree.then_some(turns)
    }

    /// Steps the heading error, and says what turning asks of the wheels.
    pub(super) fn turn(&self, state: &mut TractionState<R, N>, target: &TractionTarget<R, N>) -> Turn<R> {
        let (config, zero, one) = (&self.config, R::zero(), R::one());
        // The yaw rate that keeps to the path, at the speed that there is.
        let asked = state.command.wz_rad_s;
        let on_the_spot = asked.abs() * self.per_yaw > state.commanded_m_s * state.largest_rate_rad_m;
        let path = if on_the_spot {
            asked
        } else {
            asked * state.speed_part()
        };
        let beyond = state.yaw_rad_s - path;
        let mut heading = zero;
        if !state.is_resting() {
            let most = R::of(HEADING_RAD);
            heading = (state.heading_rad + config.period_s * beyond).limited(-most, most);
            if target.square_up {
                heading *= one - config.part(config.squaring_s);
            }
            state.heading_rad = heading;
        }
        let drift = match state.loops {
            TractionLoops::Traction => state.drift_m + config.period_s * state.drift_m_s,
            _ => zero, // the wheels' own loops make up for it
        };
        state.drift_m = drift.limited(-R::of(DRIFT_M), R::of(DRIFT_M));
        let gain = self.times.thrust_gain_n_m_s_rad;
        // If much of the torque is requested, raised wheels are held back.
        let load = state.thrust_n_m.abs() - config.levelling_from * state.largest_motor_n_m;
        let levels = load > zero;
        let mut level = zero;
        if levels {
            let part = min(
                load / (state.largest_motor_n_m * (one - config.levelling_from)),
                one,
            );
            level = gain * config.levelling_per_s * part * state.thrust_n_m.signum();
        }
        Turn {
            reference_rad_s: path - config.heading_per_s * heading,
            thrust_n_m: -gain * (config.heading_thrust_per_s * heading + config.yaw_damping * beyond),
            // As plain loops would.
            side_n_m2_rad: -self.times.own_gain_n_m_s_rad * state.drift_m_s
                - self.times.own_integral_n_m_rad * state.drift_m,
            levels,
            level_n_m_rad: state.direction.map(|part| level * part),
        }
    }

    /// Torque reduction of a wheel with the outermost lever arm because its carrier points up to its side \[N.m\].
    #[inline(always)]
    pub(super) fn tilt(&self, state: &TractionState<R, N>, turn: &Turn<R>, i: usize) -> R {
        let attitude = state.motion.attitude(self.linkage.carrier(i));
        let [left, nose] = turn.level_n_m_rad;
        attitude.left_up_rad * left - attitude.nose_up_rad * nose
    }
}
