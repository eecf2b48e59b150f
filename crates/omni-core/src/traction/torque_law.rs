//! Torques for a target speed: the second half of a control period.

use super::encoder::EncoderState;
use super::observation::Look;
use super::record::Record;
use super::wheels::Common;
use super::{
    BRAKING_PART, REST_S, SURE_M_S, Traction, TractionObservation, TractionSample, TractionState,
    TractionTarget, least,
};
use crate::constants::each;
use crate::pid::is_plausible;
use crate::{Readings, Real, TorqueRanges};

impl<R: Real, const N: usize> Traction<R, N> {
    /// Torques for a target speed: the second half of a control period.
    ///
    /// ```
    /// # use omni_core::{AxisLimits, BodyTwist, CarriedWheel, Kinematics, Linkage, Policy, Readings, Supervisor, SupervisorConfig, SupervisorState};
    /// # use omni_core::{TorqueLimit, Traction, TractionConfig, TractionPolicy, TractionState, TractionTarget, TractionWheel, TwistLimiter, TwistLimits};
    /// # use omni_core::WheelLayout;
    /// # let places = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]];
    /// # let limit = TorqueLimit::constant(2.0)?;
    /// # let wheels = places.map(|place_m| TractionWheel { limit, inertia_kg_m2: 0.002, carrier: [1.0, 0.0], place_m });
    /// # let linkage = Linkage::new(&[], &places.map(|[x, y]| CarriedWheel { body: 0, centre_m: [x, y, 0.1] }))?;
    /// # let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1_f64)?)?;
    /// # let traction = Traction::new(kinematics, linkage, wheels, TractionConfig::steady(0.3, 2.0, 1e-3))?;
    /// # let supervisor = Supervisor::new(&places, SupervisorConfig::steady(1e-3))?;
    /// # let any = AxisLimits::unlimited();
    /// # let limiter = TwistLimiter::new(TwistLimits::PerAxis { vx: any, vy: any, wz: any }, 1e-3)?;
    /// # let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// let (mut state, readings) = (TractionState::new(), Readings::new(ahead, &[0.0; 4]));
    /// let observed = traction.observe(&mut state, &readings);
    /// let sample = traction.act(&mut state, &readings, &observed, &TractionTarget::at(0.3));
    /// // 2.47 times kp, of the 3 rad/s that are lacking, is more than the motors have.
    /// assert_eq!(sample.thrust_n_m, 2.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn act(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        observed: &TractionObservation<R, N>,
        target: &TractionTarget<R>,
    ) -> TractionSample<R, N> {
        let mut sample = TractionSample::zero();
        self.act_into(state, readings, observed, target, &mut sample);
        sample
    }

    /// As [`Traction::act`], into a sample that is kept. All of it is written.
    ///
    /// ```
    /// # use omni_core::{AxisLimits, BodyTwist, CarriedWheel, Kinematics, Linkage, Policy, Readings, Supervisor, SupervisorConfig, SupervisorState};
    /// # use omni_core::{TorqueLimit, Traction, TractionConfig, TractionPolicy, TractionSample, TractionState, TractionTarget, TractionWheel, TwistLimiter, TwistLimits};
    /// # use omni_core::WheelLayout;
    /// # let places = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]];
    /// # let limit = TorqueLimit::constant(2.0)?;
    /// # let wheels = places.map(|place_m| TractionWheel { limit, inertia_kg_m2: 0.002, carrier: [1.0, 0.0], place_m });
    /// # let linkage = Linkage::new(&[], &places.map(|[x, y]| CarriedWheel { body: 0, centre_m: [x, y, 0.1] }))?;
    /// # let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1_f64)?)?;
    /// # let traction = Traction::new(kinematics, linkage, wheels, TractionConfig::steady(0.3, 2.0, 1e-3))?;
    /// # let supervisor = Supervisor::new(&places, SupervisorConfig::steady(1e-3))?;
    /// # let any = AxisLimits::unlimited();
    /// # let limiter = TwistLimiter::new(TwistLimits::PerAxis { vx: any, vy: any, wz: any }, 1e-3)?;
    /// # let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// let (mut state, readings) = (TractionState::new(), Readings::new(ahead, &[0.0; 4]));
    /// let observed = traction.observe(&mut state, &readings);
    /// let mut sample = TractionSample::zero();
    /// traction.act_into(&mut state, &readings, &observed, &TractionTarget::at(0.3), &mut sample);
    /// // 2.47 times kp, of the 3 rad/s that are lacking, is more than the motors have.
    /// assert_eq!(sample.thrust_n_m, 2.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline(always)]
    pub fn act_into(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        observed: &TractionObservation<R, N>,
        target: &TractionTarget<R>,
        sample: &mut TractionSample<R, N>,
    ) {
        self.act_told::<false>(state, readings, &observed.look(), target, sample);
    }

    /// [`Traction::act`], whose signals are told to `told`. `SPLIT`: the code of the wheels is there four times, for each way of the thrust,
    /// with levelling and without.
    #[inline(always)]
    pub(super) fn act_told<const SPLIT: bool>(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        observed: &Look<'_, R, N>,
        target: &TractionTarget<R>,
        told: &mut impl Record<R, N>,
    ) {
        let (config, zero, one) = (&self.config, R::zero(), R::one());
        let mut range = TorqueRanges::unlimited();
        self.limits.ranges(observed.measured, &mut range);
        if !state.ways.ranged || !self.limits.are_constant() {
            most(state, range);
        }
        if observed.heard != state.heard {
            seldom();
            // Wheels that are heard again have not changed their rates.
            each!(i of N {
                if observed.heard & !state.heard & 1 << i != 0 {
                    state.wheels[i].measured_rad_s = observed.measured[i];
                }
            });
            state.heard = observed.heard;
        }
        if is_plausible(target.speed_m_s) {
            state.target_m_s = target.speed_m_s;
        }
        let resting = state.resting;
        self.thrust(state);
        // The yaw rate that keeps to the path, at the speed that there is.
        let (speed, commanded) = (state.speed_m_s, state.commanded_m_s);
        let share = || {
            if commanded > zero {
                held_within(speed / commanded, one)
            } else {
                one
            }
        };
        let yaw_rad_s = state.commanded_rad_s;
        let mut path_rad_s = yaw_rad_s;
        if !state.straight {
            let way = state.commanded_m_s * state.ways.largest_per_m;
            let on_the_spot = yaw_rad_s.abs() * self.per_yaw > way;
            path_rad_s = yaw_rad_s * if on_the_spot { one } else { share() };
        }
        let beyond_rad_s = observed.yaw_rad_s - path_rad_s;
        state.turn(beyond_rad_s, resting, target.square_up, config);
        let heading = if resting { zero } else { state.heading_rad };
        let common = Common {
            speed_m_s: state.speed_m_s,
            squared: state.speed_m_s * state.speed_m_s,
            sign: if speed.abs() > R::of(SURE_M_S) {
                if speed > zero { one } else { -one }
            } else {
                seldom();
                sign(state.target_m_s)
            },
            thrust_n_m: state.thrust_n_m,
            yaw_thrust: -config.thrust_gain_n_m_s_rad
                * (config.heading_thrust_per_s * heading + config.yaw_damping * beyond_rad_s),
            yaw_reference: path_rad_s - config.heading_per_s * heading,
            climbing: if target.allowance_m_s > zero || target.spin_m_s > zero {
                target.climbing
            } else {
                0
            },
            climbing_free_m_s: config.slip_free_m_s + target.allowance_m_s,
            spin_m_s: target.spin_m_s,
            spin_gain: target.spin_gain * config.thrust_gain_n_m_s_rad,
            contact: config.part(config.contact_s),
            levels: false,
            across: [zero; 2],
            forward: true,
        };
        // Where much of the torque is asked for, what is high is held back.
        let levels = state.thrust_n_m.abs() > config.levelling_from * state.largest_n_m;
        let mut across = [zero; 2];
        if levels {
            let load = (state.thrust_n_m.abs() / state.largest_n_m - config.levelling_from)
                / (one - config.levelling_from);
            let levelling = config.thrust_gain_n_m_s_rad * config.levelling_per_s * least(load, one);
            let levelling = levelling * sign(state.thrust_n_m);
            across = state.direction.map(|part| levelling * part);
        }
        told.period(&range, &state.reference_rad_s, observed.measured);
        let each = |state: &mut _, told: &mut _, levels: bool, forward: bool| {
            let common = Common {
                levels,
                across,
                forward,
                ..common
            };
            self.torques(state, observed, &common, &range, told);
        };
        // What is the same of all wheels none asks for: shorter by 5 % for twice the room.
        match (SPLIT, levels, state.thrust_n_m >= zero) {
            (true, false, true) => each(state, told, false, true),
            (true, false, false) => each(state, told, false, false),
            (true, true, true) => each(state, told, true, true),
            (true, true, false) => each(state, told, true, false),
            (false, levels, forward) => each(state, told, levels, forward),
        }
        told.common(readings, state, share, observed.believed);
        if resting {
            self.fade(state);
        }
        if observed.heard != all::<N>() {
            let_go(state, observed.heard);
            told.let_go(observed.heard);
        }
    }

    /// The common thrust, of a wheel with the most way per turn \[N.m\].
    #[inline(always)]
    fn thrust(&self, state: &mut TractionState<R, N>) {
        let (config, zero, one) = (&self.config, R::zero(), R::one());
        let largest = state.largest_n_m;
        let error = (state.target_m_s - state.speed_m_s) * state.ways.largest_per_m;
        let size = error.abs() * config.soft_s_rad;
        let soft = config.soft_part + (one - config.soft_part) * least(size, one);
        let asked = config.thrust_gain_n_m_s_rad * soft * error + state.integral_n_m;
        let more = config.thrust_integral_n_m_rad * error * config.period_s;
        if asked.abs() <= largest {
            state.thrust_n_m = asked;
            state.integral_n_m += more;
        } else {
            state.thrust_n_m = beyond(asked, largest);
            if error * asked < zero {
                state.integral_n_m += more;
            }
        }
        state.integral_n_m = held_within(state.integral_n_m, largest);
    }

    /// Where the vehicle is told to rest, integrals fall.
    #[cold]
    #[inline(never)]
    fn fade(&self, state: &mut TractionState<R, N>) {
        let left = R::one() - self.config.part(R::of(REST_S));
        state.integral_n_m *= left;
        for (i, memory) in state.wheels.iter_mut().enumerate() {
            if state.ways.driven & 1 << i == 0 {
                memory.free_n_m *= left;
            }
        }
    }
}

fn sign<R: Real>(x: R) -> R {
    if x > R::zero() {
        R::one()
    } else if x < R::zero() {
        -R::one()
    } else {
        R::zero()
    }
}

/// Of every wheel its bit.
pub(super) fn all<const N: usize>() -> u32 {
    u32::MAX >> (32 - N as u32).min(31)
}

/// What the motors have at most, and the driven ones.
#[inline(never)]
fn most<R: Real, const N: usize>(state: &mut TractionState<R, N>, range: TorqueRanges<R, N>) {
    let mut largest = R::zero();
    for (i, memory) in state.wheels.iter_mut().enumerate() {
        let (lower, upper) = (-range.lower_n_m[i], range.upper_n_m[i]);
        memory.most_n_m = if upper > lower { upper } else { lower };
        memory.braking_n_m = -R::of(BRAKING_PART) * memory.most_n_m;
        let driven = state.ways.driven & 1 << i != 0;
        largest = if driven && memory.most_n_m > largest {
            memory.most_n_m
        } else {
            largest
        };
    }
    (state.largest_n_m, state.ways.ranged) = (largest, true);
}

/// Where this is called is seldom got to.
#[cold]
pub(super) const fn seldom() {}

/// No torque without a reading.
#[cold]
#[inline(never)]
fn let_go<R: Real, const N: usize>(state: &mut TractionState<R, N>, heard: u32) {
    for (i, memory) in state.wheels.iter_mut().enumerate() {
        if heard & 1 << i == 0 {
            memory.forget();
            state.encoders[i] = EncoderState::new();
        }
    }
}

/// As [`Real::limited`] on both sides of 0, of what is mostly within.
#[inline(always)]
pub(super) fn held_within<R: Real>(x: R, most: R) -> R {
    if x.abs() > most { beyond(x, most) } else { x }
}

#[cold]
#[inline(never)]
fn beyond<R: Real>(x: R, most: R) -> R {
    if x > most { most } else { -most }
}
