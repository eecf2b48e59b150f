//! How the vehicle moves: the first half of a control period.

use super::observation::Seen;
use super::state::WheelMemory;
use super::torque_law::seldom;
use super::{BRAKING_PART, LEVEL_RAD, QUIET_M_S, Traction, TractionObservation, TractionState, least};
use crate::constants::each;
use crate::linkage::{Bodies, MAX_HINGES, attitude};
use crate::pid::is_plausible;
use crate::{Attitude, Readings, Real, WheelVelocities};

/// Larger than any speed.
const FAST: f64 = 1e30;
impl<R: Real, const N: usize> Traction<R, N> {
    /// How the vehicle moves: the first half of a control period. Steps the filters of `state`.
    ///
    /// The speed is that of the slowest wheel that pushes: no wheel that pushes is slower than the ground beneath it. Where all brake it
    /// is that of the fastest. A wheel whose reading is no number says nothing, and no hinge or unit that is silent.
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
    /// let mut state = TractionState::new();
    /// let observed = traction.observe(&mut state, &Readings::new(ahead, &[3.0, 3.0, 3.0, 2.0]));
    /// assert_eq!(observed.believed, Some(3)); // the slowest: the others slip
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn observe(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
    ) -> TractionObservation<R, N> {
        let mut observed = TractionObservation::zero();
        self.observe_into(state, readings, &mut observed);
        observed
    }

    /// As [`Traction::observe`], into an observation that is kept from period to period: returned by value it is copied, which costs a
    /// microcontroller some hundred instructions.
    ///
    /// ```
    /// # use omni_core::{AxisLimits, BodyTwist, CarriedWheel, Kinematics, Linkage, Policy, Readings, Supervisor, SupervisorConfig, SupervisorState};
    /// # use omni_core::{TorqueLimit, Traction, TractionConfig, TractionObservation, TractionPolicy, TractionState, TractionTarget, TractionWheel, TwistLimiter, TwistLimits};
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
    /// let mut state = TractionState::new();
    /// let mut observed = TractionObservation::zero();
    /// traction.observe_into(&mut state, &Readings::new(ahead, &[3.0, 3.0, 3.0, 2.0]), &mut observed);
    /// assert_eq!(observed.believed, Some(3)); // the slowest: the others slip
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline(always)]
    pub fn observe_into(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        observed: &mut TractionObservation<R, N>,
    ) {
        let mut bodies = [Attitude::LEVEL; MAX_HINGES + 1];
        let seen = self.see(state, readings, self.plain(readings), &mut bodies);
        (observed.measured.rad_s, observed.heard) = (seen.measured, seen.heard);
        observed.free_rad_s = seen.free_rad_s;
        observed
            .motion
            .take(&seen.moves, &bodies, self.linkage.hinge_count());
        (observed.speed_m_s, observed.yaw_rad_s) = (state.speed_m_s, seen.yaw_rad_s);
        observed.believed = seen.believed;
    }

    /// [`Traction::observe`], of readings that are [`Self::plain`] or not. The vehicle's speed is the state's.
    #[inline(always)]
    pub(super) fn see(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        plain: bool,
        bodies: &mut Bodies<R>,
    ) -> Seen<R, N> {
        let (config, zero) = (&self.config, R::zero());
        let (measured, heard) = self.hear(state, readings, plain);
        let moves = self.bodies(state, readings, plain, bodies);
        if !(state.ways.known && state.travels(&readings.command)) {
            self.travel(state, &readings.command);
        }
        // Without a gyro the wheels say how fast the vehicle turns.
        let gyro = readings.imu.rate_rad_s[2];
        let turns = plain || is_plausible(gyro);
        let yaw_rad_s = if turns {
            gyro - state.gyro_zero_rad_s
        } else {
            self.turned(state, measured, heard)
        };
        let mut seen = Seen {
            measured,
            heard,
            free_rad_s: self.free_of(&measured, bodies),
            moves,
            yaw_rad_s,
            believed: None,
        };
        let before_m_s = state.speed_m_s;
        self.speeds(state, &mut seen);
        // The gyro's zero: what it says while the crosswise wheels say how fast the vehicle turns.
        if turns && state.straight && config.gyro_zero_s > zero && self.level(bodies) {
            let quiet = state.thrust_n_m.abs() < config.gyro_zero_part * state.largest_n_m;
            if quiet && stay(&seen.moves.rise_m_s) {
                let (turns, squares) = self.crosswise(state, &seen, before_m_s);
                if squares > zero {
                    state.zero_gyro(yaw_rad_s - turns / squares, config);
                }
            }
        }
        seen
    }

    /// How fast the vehicle turns by its wheels \[rad/s\]. One that says nothing is taken to turn as it would have with the last motion.
    #[cold]
    #[inline(never)]
    fn turned(&self, state: &mut TractionState<R, N>, measured: [R; N], heard: u32) -> R {
        let (mut rates, [dx, dy]) = (WheelVelocities::from(measured), state.direction);
        for (i, [ax, ay, turned]) in self.kinematics.inverse_matrix().iter().enumerate() {
            if heard & 1 << i == 0 {
                rates.rad_s[i] = (*ax * dx + *ay * dy) * state.speed_m_s + *turned * state.yaw_rad_s;
            }
        }
        state.yaw_rad_s = self.kinematics.forward(&rates).wz_rad_s;
        state.yaw_rad_s
    }

    /// Rates of the wheels less what their encoders see of their carriers.
    #[inline(always)]
    fn free_of(&self, measured: &[R; N], bodies: &Bodies<R>) -> [R; N] {
        let mut free = *measured;
        each!(i of N {
            let attitude = attitude(bodies, self.linkage.carrier(i));
            let [nose, left] = self.carrier[i];
            if nose != R::zero() {
                free[i] -= nose * attitude.nose_up_rad_s;
            }
            if left != R::zero() {
                free[i] -= left * attitude.left_up_rad_s;
            }
        });
        free
    }

    /// Finds the speed of the vehicle, by the wheel that is believed.
    #[inline(always)]
    fn speeds(&self, state: &mut TractionState<R, N>, seen: &mut Seen<R, N>) {
        if state.target_m_s >= R::zero() {
            self.believed::<true>(state, seen);
        } else {
            self.believed::<false>(state, seen);
        }
    }

    /// As [`Self::speeds`], for a target ahead or back.
    #[inline(always)]
    fn believed<const AHEAD: bool>(&self, state: &mut TractionState<R, N>, seen: &mut Seen<R, N>) {
        let config = &self.config;
        let along = |x: R| if AHEAD { x } else { -x };
        // The slowest of those that push, the fastest of those that brake; in reverse the other way round.
        let (mut slowest, mut fastest) = (R::of(FAST), -R::of(FAST));
        let (mut pushing, mut braking) = (N, N);
        let speed = state.speed_m_s;
        let driven = state.ways.driven & seen.heard;
        let turning = self.turning(seen.yaw_rad_s);
        each!(i of N {
            let (way, memory, free) = (&state.ways.wheels[i], &state.wheels[i], seen.free_rad_s[i]);
            if driven & 1 << i != 0 {
                let speed = along((free - turning[i]) * way.inverse_m);
                let thrust = along(way.along * memory.applied_n_m);
                if thrust >= self.braking_n_m(memory, i) {
                    if speed < slowest {
                        (slowest, pushing) = (speed, i);
                    }
                } else if speed > fastest {
                    (fastest, braking) = (speed, i);
                }
            }
        });
        // One is found where the speed is another than that which the search began with.
        let mut raw = slowest;
        seen.believed = Some(pushing);
        if slowest >= R::of(FAST) {
            seldom();
            (seen.believed, raw) = if fastest > -R::of(FAST) {
                (Some(braking), fastest)
            } else {
                (None, along(speed))
            };
        }
        let step = config.part(config.speed_s) * (raw - along(speed));
        let most = config.acceleration_m_s2 * config.period_s;
        state.speed_m_s += along(least(step, most));
    }

    /// Of the wheels across the way, the sums whose ratio says how fast they turn with the vehicle.
    #[inline(always)]
    fn crosswise(&self, state: &TractionState<R, N>, seen: &Seen<R, N>, speed_m_s: R) -> (R, R) {
        let (mut turns, mut squares) = (R::zero(), R::zero());
        let across = !state.ways.driven & seen.heard;
        each!(i of N {
            if across & 1 << i != 0 {
                // What is left of its rate when the way ahead is taken out is from turning.
                let turned = self.turned_by(i);
                turns += turned * (seen.free_rad_s[i] - state.ways.wheels[i].per_m * speed_m_s);
                squares += turned * turned;
            }
        });
        (turns, squares)
    }

    /// A torque against the thrust below which a wheel brakes \[N.m\].
    #[inline(always)]
    fn braking_n_m(&self, memory: &WheelMemory<R>, wheel: usize) -> R {
        if self.limits.are_constant() {
            -R::of(BRAKING_PART) * self.limits.cap(wheel)
        } else {
            memory.braking_n_m
        }
    }

    /// Nothing points up.
    #[inline(always)]
    fn level(&self, bodies: &Bodies<R>) -> bool {
        each!(i of N {
            if attitude(bodies, self.linkage.carrier(i)).nose_up_rad.abs() > R::of(LEVEL_RAD) {
                return false;
            }
        });
        true
    }
}

/// Nothing rises.
#[inline(always)]
fn stay<R: Real, const N: usize>(rises: &[R; N]) -> bool {
    let quiet = R::of(QUIET_M_S);
    let mut sum = R::zero();
    each!(i of N {
        sum += rises[i].abs();
    });
    if sum > quiet {
        each!(i of N {
            if rises[i].abs() > quiet {
                return false;
            }
        });
    }
    true
}
