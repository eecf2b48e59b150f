//! Third step: which loops drive the wheels, and one thrust for all of them.

use super::loops::TractionLoops;
use super::model::{BACK_PART, BRAKING_PART, CLIMBS_M_S, Traction};
use super::state::{TractionState, WheelAlongTravel, WheelState};
use super::target::TractionTarget;
use crate::Real;
use crate::motor::TorqueRanges;
use crate::scalar::{max, min};

/// Below this part of its target, or with more than that part of its thrust, a vehicle is held up.
const HELD_UP_PART: f64 = 0.5;
const HELD_UP_THRUST: f64 = 0.8;
/// One that gains so much of its target within the time below is not.
const GAINS_PART: f64 = 0.05;
/// Time after which traction control takes over \[s\]. The others are of vehicles that do not see how their wheels
/// rise: the least, and the longest where plain loops take that to come to their whole torque. What they climb is
/// climbed by then.
const HELD_UP_S: f64 = 0.15;
const HELD_UP_BLIND_S: f64 = 0.3;
const HELD_UP_LONGEST_S: f64 = 2.0;
/// Slip that calls for traction control, in multiples of what is left alone.
const SLIPS: f64 = 2.5;
/// Traction control hands back after so long without a need \[s\], below this part of the largest
/// thrust and this error of the heading \[rad\].
const CALM_S: f64 = 0.5;
const CALM_PART: f64 = 0.4;
const CALM_RAD: f64 = 0.02;
/// Wheels that turn backwards faster than this, or exceed the target by more than this \[m/s\], are off the speed.
const BACKWARD_M_S: f64 = 0.1;
const OFF_SPEED_M_S: f64 = 0.5;
/// Where most are so for this long, plain loops take over until the command rests \[s\].
const OFF_SPEED_S: f64 = 0.3;
/// Faster than its target by this part of it, a vehicle is not pushed.
const FASTER_PART: f64 = 0.25;
/// Slip ends within a slip time. Wheels that nothing drives and that stay faster than slip control
/// leaves them for so many, and for so long at least \[s\], are carried by the ground.
const CARRIED: f64 = 2.0;
const CARRIED_S: f64 = 0.06;
const LEAK: f64 = 4.0;

/// What the driven wheels show of a vehicle that travels.
struct WheelsSeen<R> {
    /// The largest slip \[m/s\].
    slip_m_s: R,
    /// Most wheels go against the target or much faster, or the vehicle goes backwards.
    off_speed: bool,
    /// One wheel shows a slow vehicle, and the ground carries the others.
    wrong: bool,
    /// The ground carries half of the wheels.
    half_carried: bool,
    /// The slowest wheel that pushes.
    slowest: Option<usize>,
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// Chooses what drives the wheels. The controller that takes over begins with the present torque.
    pub(super) fn choose_loops(
        &self,
        state: &mut TractionState<R, N>,
        target: &TractionTarget<R, N>,
        speed_wheel: Option<usize>,
    ) {
        let zero = R::zero();
        if target.own_loops || state.is_resting() || !state.can_discern() {
            // Every wheel by its own loop.
            if state.loops == TractionLoops::Traction {
                self.hand_back(state);
            }
            if state.is_resting() || state.loops == TractionLoops::Traction {
                state.loops = TractionLoops::Plain;
            }
            (state.off_speed_s, state.held_up_s, state.calm_s, state.carried_s) = (zero, zero, zero, zero);
            return;
        }
        self.count_held_up(state);
        let seen = self.look_at_wheels(state, speed_wheel);
        let needed = self.is_needed(state, target, seen.slip_m_s);
        state.calm_s = self.uninterrupted_s(state.calm_s, !needed);
        match state.loops {
            TractionLoops::Plain if needed => {
                state.loops = TractionLoops::Traction;
                (state.off_speed_s, state.carried_s) = (zero, zero);
                // The torque that there is, as it would be of wheels that turn as the vehicle moves: that has no noise.
                let own = self.mean_thrust(state, |wheel| wheel.integral_n_m);
                state.integral_n_m =
                    own + self.times.own_gain_n_m_s_rad * state.lack_rad_s() - self.proportional(state);
            }
            TractionLoops::Traction => {
                self.leave_if_done(state, &seen);
                if state.loops != TractionLoops::Traction {
                    self.hand_back(state);
                }
            }
            _ => {}
        }
    }

    /// How long something has been so without a break \[s\], a period later.
    fn uninterrupted_s(&self, time_s: R, so: bool) -> R {
        if so {
            time_s + self.config.period_s
        } else {
            R::zero()
        }
    }

    /// Counts the time for which the vehicle has been held up.
    fn count_held_up(&self, state: &mut TractionState<R, N>) {
        let sign = state.target_sign();
        let (speed, wanted) = (sign * state.speed_m_s, state.target_m_s.abs());
        let held_up = speed < R::of(HELD_UP_PART) * wanted
            || sign * state.thrust_n_m > R::of(HELD_UP_THRUST) * state.largest_motor_n_m;
        // One that still gains speed is not.
        let gains = speed > state.held_up_m_s + R::of(GAINS_PART) * wanted;
        state.held_up_s = self.uninterrupted_s(state.held_up_s, held_up && !gains);
        if state.held_up_s <= self.config.period_s {
            state.held_up_m_s = speed;
        }
    }

    /// Compares the driven wheels with the vehicle's speed and with its target.
    fn look_at_wheels(&self, state: &TractionState<R, N>, speed_wheel: Option<usize>) -> WheelsSeen<R> {
        let (zero, sign) = (R::zero(), state.target_sign());
        let (speed, wanted) = (sign * state.speed_m_s, state.target_m_s.abs());
        let (mut slip_m_s, mut off_speed, mut carried, mut driven) = (zero, 0, 0, 0);
        // Speed across the direction of travel is no slip, neither of a wheel nor of the one that gives the speed.
        let across =
            |travel: &WheelAlongTravel<R>| sign * travel.side_rate_rad_m * state.drift_m_s * travel.way_m;
        let level = speed
            - speed_wheel
                .and_then(|wheel| state.travel.get(wheel))
                .map_or(zero, across);
        let carries = R::of(BACK_PART) * wanted + R::of(SLIPS) * self.times.free_m_s;
        let (mut least_m_s, mut slowest) = (wanted, None);
        for (i, (travel, wheel)) in state.travel.iter().zip(&state.wheels).enumerate() {
            if travel.driven && wheel.usable {
                let ahead = sign * wheel.speed_m_s - across(travel);
                slip_m_s = max(slip_m_s, (ahead - level).abs());
                driven += 1;
                off_speed += u32::from(ahead < -R::of(BACKWARD_M_S) || ahead > wanted + R::of(OFF_SPEED_M_S));
                let idle = sign * travel.along * wheel.applied_n_m <= R::of(BRAKING_PART) * wheel.most_n_m;
                carried += u32::from(idle && ahead > carries);
                // One that is turned back, as by the heading, may stand whatever the vehicle does.
                if ahead < least_m_s && self.pushes(state, i, sign) {
                    (least_m_s, slowest) = (ahead, Some(i));
                }
            }
        }
        WheelsSeen {
            slip_m_s,
            off_speed: 2 * off_speed > driven || speed < -R::of(BACKWARD_M_S),
            wrong: least_m_s < R::of(HELD_UP_PART) * wanted && 2 * carried >= driven && carried > 0,
            half_carried: 2 * carried == driven,
            slowest,
        }
    }

    /// Do slip, a climb, a vehicle that is held up or the target call for traction control?
    fn is_needed(&self, state: &TractionState<R, N>, target: &TractionTarget<R, N>, slip_m_s: R) -> bool {
        // What cannot see how its wheels rise takes a climb for slip: it helps only if the vehicle is held up.
        let held_up = if state.reads_linkage {
            state.held_up_s > R::of(HELD_UP_S)
        } else {
            state.held_up_s > R::of(HELD_UP_BLIND_S) && self.has_wound_up(state)
        };
        let climbs = || {
            state
                .motion
                .rise_m_s
                .iter()
                .any(|rise| rise.abs() > R::of(CLIMBS_M_S))
        };
        (state.reads_linkage && (slip_m_s > R::of(SLIPS) * self.times.free_m_s || climbs()))
            || held_up
            || target.is_special()
    }

    /// Have plain loops been held up for so long that they ask a wheel that stands for its whole torque?
    fn has_wound_up(&self, state: &TractionState<R, N>) -> bool {
        let [gain, integral] = self.times.own(&self.config, state.raw);
        let rate = state.largest_rate_rad_m * state.target_m_s.abs();
        state.held_up_s > R::of(HELD_UP_LONGEST_S)
            || (gain + integral * state.held_up_s) * rate > state.largest_motor_n_m
    }

    /// Ends traction control that is not needed any more, or by which the wheels are off the speed.
    fn leave_if_done(&self, state: &mut TractionState<R, N>, seen: &WheelsSeen<R>) {
        let zero = R::zero();
        state.off_speed_s = self.uninterrupted_s(state.off_speed_s, seen.off_speed);
        // The time falls four times as fast as it rises, because a late loop oscillates about the threshold.
        let leak = R::of(LEAK) * self.config.period_s;
        state.carried_s = max(
            self.uninterrupted_s(state.carried_s, seen.wrong),
            max(state.carried_s - leak, zero),
        );
        let mut undecided = false;
        if state.carried_s > max(R::of(CARRIED) * self.times.slip_s, R::of(CARRIED_S)) {
            // Half against half does not show which is wrong, and two are not wrong at once.
            undecided = seen.half_carried || state.wheels.iter().any(|wheel| wheel.doubted);
            let slowest = seen.slowest.filter(|_| !undecided);
            if let Some(wheel) = slowest.and_then(|slowest| state.wheels.get_mut(slowest)) {
                wheel.doubted = true;
            }
            state.carried_s = zero;
        }
        let calm = state.calm_s > R::of(CALM_S)
            && state.thrust_n_m.abs() < R::of(CALM_PART) * state.largest_motor_n_m
            && state.heading_rad.abs() < R::of(CALM_RAD);
        if undecided || state.off_speed_s > R::of(OFF_SPEED_S) {
            state.loops = TractionLoops::Fallback;
        } else if calm {
            state.loops = TractionLoops::Plain;
        }
    }

    /// Every driven wheel's own loop begins with the torque that it has.
    fn hand_back(&self, state: &mut TractionState<R, N>) {
        let [gain, _] = self.times.own(&self.config, state.raw);
        for i in 0..N {
            let wheel = &mut state.wheels[i];
            if state.travel[i].driven {
                let rate = state.travel[i].rate_rad_m * wheel.speed_m_s + self.turned_by(i) * state.yaw_rad_s;
                let error = state.reference_rad_s[i] - rate;
                wheel.integral_n_m = wheel.applied_n_m - gain * error;
            }
        }
    }

    /// The mean of a torque of the driven wheels, as a thrust \[N.m\].
    pub(super) fn mean_thrust(
        &self,
        state: &TractionState<R, N>,
        torque_n_m: impl Fn(&WheelState<R>) -> R,
    ) -> R {
        let (mut sum, mut parts) = (R::zero(), R::zero());
        for (travel, wheel) in state.travel.iter().zip(&state.wheels) {
            if travel.driven && wheel.usable {
                sum += travel.along * torque_n_m(wheel);
                parts += travel.part.abs();
            }
        }
        if parts > R::zero() { sum / parts } else { R::zero() }
    }

    /// Torque for the lack of speed \[N.m\]: with a lower gain near zero, where a stiff loop would turn small errors
    /// into heat.
    fn proportional(&self, state: &TractionState<R, N>) -> R {
        let (config, one, error) = (&self.config, R::one(), state.lack_rad_s());
        let soft = config.soft_part + (one - config.soft_part) * min(error.abs() * config.soft_s_rad, one);
        self.times.thrust_gain_n_m_s_rad * soft * error
    }

    /// The common thrust, of the wheel that turns most per way \[N.m\].
    pub(super) fn find_thrust(&self, state: &mut TractionState<R, N>) {
        let (sign, wanted, largest) = (state.target_sign(), state.target_m_s.abs(), state.full_thrust_n_m);
        // Beyond an edge the thrust of the climb falls with the speed that is gained: gains that are soft where
        // readings are late would hold it.
        let width = max(R::of(FASTER_PART) * wanted, self.times.free_m_s);
        let over = (sign * state.speed_m_s - wanted) / width;
        let ahead = largest * (R::one() - over).limited(R::zero(), R::one());
        let (error, asked) = (
            sign * state.lack_rad_s(),
            sign * (self.proportional(state) + state.integral_n_m),
        );
        state.thrust_n_m = sign * asked.limited(-largest, ahead);
        // It does not wind up at the limit.
        if asked.abs() <= largest || error * asked < R::zero() {
            state.integral_n_m += self.times.integral_n_m_rad * state.lack_rad_s() * self.config.period_s;
        }
        state.integral_n_m = sign * (sign * state.integral_n_m).limited(-largest, ahead);
    }

    /// The largest thrust of a driven wheel, and the thrust at which every wheel applies its largest torque \[N.m\]:
    /// wheels that turn less per distance receive a smaller part of it.
    pub(super) fn find_largest(&self, state: &mut TractionState<R, N>, range: &TorqueRanges<R, N>) {
        (state.largest_motor_n_m, state.full_thrust_n_m) = (R::zero(), R::zero());
        for i in 0..N {
            let wheel = &mut state.wheels[i];
            wheel.most_n_m = max(range.upper_n_m[i], -range.lower_n_m[i]);
            if state.travel[i].driven {
                state.largest_motor_n_m = max(state.largest_motor_n_m, wheel.most_n_m);
                let whole = state.largest_rate_rad_m * state.travel[i].way_m.abs(); // over its part
                state.full_thrust_n_m = max(state.full_thrust_n_m, whole * wheel.most_n_m);
            }
        }
    }
}
