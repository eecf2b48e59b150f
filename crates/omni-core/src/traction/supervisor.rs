//! Target speed of a vehicle: higher for rows that need a run-up, a retry if it is stuck.

mod config;
mod state;

use super::model::CLIMBS_M_S;
use super::state::TractionState;
use super::target::TractionTarget;
use crate::constants::constant_struct;
use crate::scalar::{max, min};
use crate::{ConfigError, Real};
pub use config::{RetrySchedule, SupervisorConfig};
pub use state::{SupervisorMode, SupervisorState};

/// Wheels that stand no further apart along the way are of one row \[m\].
const ROW_M: f64 = 0.02;
/// With fewer wheels none is to spare, and a wheel that slips looks like one of a vehicle that drifts or turns: the
/// first attempt and every other retry is by the wheels' own loops, those between by one thrust.
const SPARE: usize = 4;
/// By own loops a vehicle that has turned by so much off its heading slides along the edge \[rad\].
const TURNED_RAD: f64 = 0.45;
/// The vehicle squares up below this speed \[m/s\], above this part of the largest thrust.
const SQUARES_M_S: f64 = 0.1;
const SQUARES_PART: f64 = 0.7;
/// A run-up has begun once this part of its speed is reached, and ends in an impact below that part.
const BEGUN_PART: f64 = 0.6;
const IMPACT_PART: f64 = 0.3;
/// A vehicle that drives on faster than this part of its target needs no spin.
const ROLLS_PART: f64 = 0.6;
/// Backing off lasts no longer than this multiple of the nominal time for its distance.
const BACK_OFF_TIMES: f64 = 4.0;
/// A vehicle that is stuck for this long after its last retry gives up \[s\].
const GIVES_UP_S: f64 = 1.0;
/// A vehicle that pushes with this part of its weight beyond what the slope takes, or half its thrust
/// if that is less, and does not rise, for so long \[s\] and for the time of so much of its commanded
/// way \[m\], is stuck whatever its wheels say: all of them may spin as commanded.
const VAIN_WEIGHT: f64 = 0.2;
const VAIN_PART: f64 = 0.5;
const VAIN_S: f64 = 3.0;
const VAIN_M: f64 = 0.3;
/// An edge is past this way behind its last event, with all rows level \[m\].
const PAST_EDGE_M: f64 = 0.3;
/// One that has this part of its commanded speed is not stuck.
const CREEPS_PART: f64 = 0.5;

/// Chooses the target speed of a [`super::Traction`]. Immutable.
///
/// It knows which row of wheels climbs next from how high the rows stand. Rows behind the first need a run-up, because
/// an impact absorbs most of the vehicle's energy. A vehicle that pushes with its full thrust and does not move backs
/// off and retries.
///
/// ```
/// use omni_core::traction::{Supervisor, SupervisorConfig};
/// let places = [[-0.3, -0.23], [-0.3, 0.0], [-0.3, 0.23], [0.0, 0.0], [0.3, -0.23], [0.3, 0.0], [0.3, 0.23]];
/// let supervisor = Supervisor::new(&places, SupervisorConfig::traction(1e-3))?;
/// assert_eq!(supervisor.config().retry.retries, 8);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Supervisor<R, const N: usize> {
    config: SupervisorConfig<R>,
    /// Row of each wheel from the front, and from the left; how many rows there are.
    rows: [[u16; N]; 2],
    counts: [u16; 2],
}

constant_struct!(Supervisor<R, const N> { config: SupervisorConfig<R>, rows: [[u16; N]; 2], counts: [u16; 2] });

impl<R: Real, const N: usize> Supervisor<R, N> {
    /// For wheels at these places: x forward, y left of the vehicle's origin \[m\].
    ///
    /// # Errors
    /// Whatever of the configuration is out of its range.
    pub fn new(places_m: &[[R; 2]; N], config: SupervisorConfig<R>) -> Result<Self, ConfigError> {
        config.check()?;
        let along = [0, 1].map(|axis| rows(&places_m.map(|place: [R; 2]| place[axis])));
        Ok(Self {
            config,
            rows: along.map(|(rows, _)| rows),
            counts: along.map(|(_, count)| count),
        })
    }

    /// Its configuration.
    #[must_use]
    pub fn config(&self) -> &SupervisorConfig<R> {
        &self.config
    }

    /// The target of a period, by how the vehicle moved in the last one. [`super::Traction::command`] goes before it.
    ///
    /// ```
    /// use omni_core::traction::{SupervisorState, TractionState};
    /// use omni_core::BodyTwist;
    /// # let traction = omni_core::examples::traction()?;
    /// # let supervisor = omni_core::examples::supervisor()?;
    /// let (mut state, mut memory) = (TractionState::new(), SupervisorState::new());
    /// traction.command(&mut state, &BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO });
    /// let target = supervisor.step(&mut memory, &state);
    /// assert!((target.speed_m_s - 4.0 * 1e-3).abs() < 1e-12); // 4 m/s^2 for a period
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn step(
        &self,
        state: &mut SupervisorState<R>,
        traction: &TractionState<R, N>,
    ) -> TractionTarget<R, N> {
        let (config, retry, zero) = (&self.config, &self.config.retry, R::zero());
        let commanded = traction.commanded_m_s;
        if commanded == zero {
            // At rest nothing is climbed; the next way begins afresh.
            state.forget();
            return TractionTarget::at(self.slewed(state, zero));
        }
        let order = self.face(state, traction.direction);
        state.since_start_s += config.period_s;
        if !traction.can_discern() {
            return self.without_retries(state, traction);
        }
        let drop_m;
        (state.row, drop_m) = self.next_row(order, &traction.motion.height_m);
        let wanted = self.wanted_speed(state, commanded, drop_m);
        self.progress(state, order, traction.speed_m_s);
        let most = self.max_speed(traction.direction);
        let speed = self.step_mode(state, traction, wanted, most);
        let mut target = TractionTarget::at(self.slewed(state, speed.limited(-most, most)));
        let hard = R::of(f64::from(state.row_retries.saturating_sub(retry.slow_retries)));
        target.climbing = core::array::from_fn(|i| self.row_of(order, i) == state.row);
        if state.mode != SupervisorMode::BackOff {
            target.allowance_m_s = retry.allowance_m_s * hard;
        }
        target.spin_gain = retry.spin_gain;
        target.spin_m_s = self.spin(state, traction.speed_m_s, hard);
        target.trying = matches!(state.mode, SupervisorMode::BackOff | SupervisorMode::RunUp);
        target.own_loops = Self::by_own_loops(state);
        target.square_up = state.row == 0
            && state.mode == SupervisorMode::Drive
            && state.since_start_s > config.starting_s
            && traction.thrust_n_m > R::of(SQUARES_PART) * traction.largest_motor_n_m
            && traction.speed_m_s < R::of(SQUARES_M_S);
        target
    }

    /// Turns to a direction of travel; returns the order of the rows along it. The target speed is the part of the
    /// last one along the new direction. Another order begins afresh.
    fn face(&self, state: &mut SupervisorState<R>, direction: [R; 2]) -> (usize, bool) {
        let order = self.order(direction);
        if direction != state.direction {
            let [dx, dy] = direction;
            if order != self.order(state.direction) {
                state.forget();
            }
            state.target_m_s *= dx * state.direction[0] + dy * state.direction[1];
            state.direction = direction;
        }
        order
    }

    /// The commanded speed, higher for rows behind the first: they need a run-up.
    fn wanted_speed(&self, state: &SupervisorState<R>, commanded_m_s: R, drop_m: R) -> R {
        let (config, zero) = (&self.config, R::zero());
        let boost = match state.row {
            0 => zero,
            1 => config.boost[0],
            _ => config.boost[1],
        };
        // A low edge requires no more than the available thrust.
        let part =
            ((drop_m - config.height_m) / (config.boost_height_m - config.height_m)).limited(zero, R::one());
        let raised = commanded_m_s * (R::one() + boost * part);
        if state.row > 0 {
            max(config.retry.later_rows_part * state.later_rows_m_s, raised)
        } else {
            raised
        }
    }

    /// Slip that the climbing row is spun up to \[m/s\], after so many tries beyond the slow ones: in a run-up before
    /// its impact, and on the way to later rows once a row has climbed so.
    fn spin(&self, state: &SupervisorState<R>, measured_m_s: R, hard: R) -> R {
        let (retry, zero) = (&self.config.retry, R::zero());
        let again = state.mode == SupervisorMode::Drive
            && state.later_rows_m_s > zero
            && state.row > 0
            && measured_m_s > R::of(ROLLS_PART) * state.target_m_s;
        let after_impact = state.begun && measured_m_s < R::of(IMPACT_PART) * state.run_up_m_s;
        if retry.spin_m_s == zero {
            zero
        } else if again {
            retry.later_rows_spin * retry.spin_m_s
        } else if state.mode == SupervisorMode::RunUp && hard > zero && !after_impact {
            retry.spin_m_s + retry.spin_more_m_s * (hard - R::one())
        } else {
            zero
        }
    }

    /// Nothing is tried while slip does not stand out from noise: the target is the commanded
    /// speed, and what was tried counts. A stuck vehicle also gives up here.
    fn without_retries(
        &self,
        state: &mut SupervisorState<R>,
        traction: &TractionState<R, N>,
    ) -> TractionTarget<R, N> {
        if state.mode == SupervisorMode::GaveUp {
            return TractionTarget::at(self.slewed(state, R::zero()));
        }
        if state.mode != SupervisorMode::Drive {
            state.start(SupervisorMode::Drive);
        }
        state.target_m_s = traction.commanded_m_s;
        let slow = self.slow(R::zero(), traction.commanded_m_s);
        // Wheels without readings, such as on a stuck vehicle, do not push: it is still stuck.
        let stuck = self.is_stuck(traction, slow);
        if stuck || moves(traction, slow) {
            state.stuck_s = SupervisorState::net_s(state.stuck_s, self.config.period_s, stuck);
        }
        if state.stuck_s > R::of(GIVES_UP_S) || self.pushes_in_vain(state, traction) {
            state.start(SupervisorMode::GaveUp);
        }
        TractionTarget::at(state.target_m_s)
    }

    /// It has pushed hard for long: nothing that moves needs that. Without an attitude, which tells a
    /// slope, it is never said.
    fn pushes_in_vain(&self, state: &mut SupervisorState<R>, traction: &TractionState<R, N>) -> bool {
        let weight = self.config.weight_thrust;
        let pushes = traction.attitude_rad.is_some_and(|[roll, pitch]| {
            let part =
                min(R::of(VAIN_WEIGHT) * weight, R::of(VAIN_PART)) + weight * (roll.abs() + pitch.abs());
            traction.thrust_n_m > part * traction.largest_motor_n_m && !rises(traction)
        });
        state.vain_s = SupervisorState::net_s(state.vain_s, self.config.period_s, pushes);
        state.vain_s > max(R::of(VAIN_S), R::of(VAIN_M) / traction.commanded_m_s)
    }

    /// It pushes with nearly all it has, and neither moves nor rises.
    fn is_stuck(&self, traction: &TractionState<R, N>, slow_m_s: R) -> bool {
        traction.thrust_n_m > self.config.stuck_thrust * traction.largest_motor_n_m
            && !moves(traction, slow_m_s)
    }

    /// Retries count for the furthest row so far: the retries of a row end once a row behind it climbs for the first
    /// time. All are over where every row is past the obstacle. A vehicle that falls back to level ground goes on
    /// counting, or it would try for ever. One that gave up rests although it is lifted, or slumps, onto another row.
    fn progress(&self, state: &mut SupervisorState<R>, (axis, _): (usize, bool), speed_m_s: R) {
        let (config, zero) = (&self.config, R::zero());
        if state.row > state.furthest && state.mode != SupervisorMode::GaveUp {
            state.furthest = state.row;
            if state.row_retries > config.retry.slow_retries {
                state.later_rows_m_s = state.run_up_m_s;
            }
            state.row_retries = 0;
            state.start(SupervisorMode::Drive);
        }
        // The last wheel says that it is up a few centimetres behind the edge.
        if state.edge_m > zero && state.row == 0 && state.mode == SupervisorMode::Drive {
            state.past_edge_m += speed_m_s.abs() * config.period_s;
        }
        if state.past_edge_m > R::of(PAST_EDGE_M) {
            state.edge_m = zero;
        }
        let all_climbed = state.furthest > 0 && state.furthest + 1 >= self.counts[axis];
        let past = all_climbed && state.row == 0 && state.mode == SupervisorMode::Drive;
        state.level_s = if past {
            state.level_s + config.period_s
        } else {
            zero
        };
        if state.level_s > config.level_s {
            (state.furthest, state.row_retries, state.later_rows_m_s) = (0, 0, zero);
        }
    }

    /// A period of the present phase, and the target speed that it asks for; `wanted_m_s` while it drives.
    fn step_mode(
        &self,
        state: &mut SupervisorState<R>,
        traction: &TractionState<R, N>,
        wanted_m_s: R,
        max_m_s: R,
    ) -> R {
        let stuck = self.is_stuck(traction, self.slow(state.target_m_s, traction.commanded_m_s));
        state.in_mode_s += self.config.period_s;
        match state.mode {
            SupervisorMode::Drive => {
                self.drive(state, traction, stuck);
                wanted_m_s
            }
            SupervisorMode::BackOff => self.back_off(state, traction),
            SupervisorMode::RunUp => self.run_up(state, traction, stuck, max_m_s),
            SupervisorMode::GaveUp => R::zero(),
        }
    }

    /// Below this speed a vehicle that pushes is stuck \[m/s\]. One that is commanded to creep and creeps is not.
    fn slow(&self, target_m_s: R, commanded_m_s: R) -> R {
        let config = &self.config;
        let creeps = R::of(CREEPS_PART) * commanded_m_s;
        max(
            config.stuck_part * target_m_s.abs(),
            min(config.stuck_m_s, creeps),
        )
    }

    /// Ends in a retry where the vehicle is stuck, or gives up after the last.
    fn drive(&self, state: &mut SupervisorState<R>, traction: &TractionState<R, N>, stuck: bool) {
        let config = &self.config;
        let stuck = stuck && state.since_start_s > config.starting_s;
        state.stuck_s = SupervisorState::net_s(state.stuck_s, config.period_s, stuck);
        let in_vain = self.pushes_in_vain(state, traction);
        let turned = Self::by_own_loops(state) && traction.heading_rad.abs() > R::of(TURNED_RAD);
        if (state.stuck_s > config.stuck_s || in_vain || turned) && self.has_retries(state) {
            state.back_off();
        } else if state.stuck_s > R::of(GIVES_UP_S) || in_vain {
            state.start(SupervisorMode::GaveUp);
        }
    }

    /// Is this attempt by the wheels' own loops?
    fn by_own_loops(state: &SupervisorState<R>) -> bool {
        N < SPARE && state.row_retries.is_multiple_of(2)
    }

    /// Backs off until the way, or the time for it, is over; returns the target speed.
    fn back_off(&self, state: &mut SupervisorState<R>, traction: &TractionState<R, N>) -> R {
        let retry = &self.config.retry;
        state.back_m -= traction.speed_m_s * self.config.period_s;
        let again = R::of(f64::from(state.row_retries.saturating_sub(1)));
        let (more, most) = if state.row == 0 {
            (retry.first_row_more_m, retry.first_row_max_m)
        } else {
            (retry.back_off_more_m, retry.back_off_max_m)
        };
        state.far_m = min(retry.back_off_m + more * again, most);
        let speed = min(retry.back_off_m_s, traction.commanded_m_s);
        if state.back_m > state.far_m || state.in_mode_s * speed > R::of(BACK_OFF_TIMES) * state.far_m {
            state.start(SupervisorMode::RunUp);
        }
        -speed
    }

    /// Runs up until its time is over or the vehicle is stuck again; returns the target speed.
    fn run_up(
        &self,
        state: &mut SupervisorState<R>,
        traction: &TractionState<R, N>,
        stuck: bool,
        max_m_s: R,
    ) -> R {
        let (config, retry) = (&self.config, &self.config.retry);
        let speed = if state.row_retries <= retry.slow_retries {
            retry.slow_retry_m_s
        } else {
            retry.run_up_m_s
                + retry.run_up_more_m_s * R::of(f64::from(state.row_retries - retry.slow_retries - 1))
        };
        // No vehicle that is commanded to creep rams an edge.
        let speed = min(speed, min(max_m_s, retry.run_up_times * traction.commanded_m_s));
        state.run_up_m_s = speed;
        state.begun |= traction.speed_m_s > R::of(BEGUN_PART) * speed;
        let stuck = stuck && state.begun;
        state.stuck_again_s = SupervisorState::net_s(state.stuck_again_s, config.period_s, stuck);
        if retry.stuck_again_s > R::zero() && state.stuck_again_s > retry.stuck_again_s {
            if self.has_retries(state) {
                state.back_off();
            } else {
                state.start(SupervisorMode::Drive);
            }
        } else if state.in_mode_s > retry.run_up_s && state.in_mode_s * speed > state.far_m {
            state.start(SupervisorMode::Drive);
        }
        speed
    }

    /// A retry of this row is left. On an edge that the vehicle does not climb there is one for all rows.
    fn has_retries(&self, state: &SupervisorState<R>) -> bool {
        let ends = state.edge_m > self.config.climbs_m && state.edge_retries > 0;
        state.row_retries < self.config.retry.retries && !ends
    }

    /// The largest speed in a direction \[m/s\].
    fn max_speed(&self, direction: [R; 2]) -> R {
        let [ahead, aside] = self.config.max_m_s;
        let (x, y) = (direction[0].abs() / ahead, direction[1].abs() / aside);
        R::one() / max(x, y)
    }

    fn slewed(&self, state: &mut SupervisorState<R>, speed_m_s: R) -> R {
        let step = self.config.acceleration_m_s2 * self.config.period_s;
        state.target_m_s += (speed_m_s - state.target_m_s).limited(-step, step);
        state.target_m_s
    }

    /// Which axis rows are along, and whether they are counted from its other end.
    #[inline(always)]
    fn order(&self, [x, y]: [R; 2]) -> (usize, bool) {
        if x.abs() >= y.abs() {
            (0, x < R::zero())
        } else {
            (1, y < R::zero())
        }
    }

    #[inline(always)]
    fn row_of(&self, (axis, reversed): (usize, bool), wheel: usize) -> u16 {
        let row = self.rows[axis][wheel];
        if reversed {
            self.counts[axis] - 1 - row
        } else {
            row
        }
    }

    /// The row that climbs next, that behind the largest drop from row to row, and the drop \[m\]. Three rows
    /// and more distinguish a step from a slope: what every row is below the one before it is the slope's.
    fn next_row(&self, order: (usize, bool), height_m: &[R; N]) -> (u16, R) {
        let zero = R::zero();
        let (mut sums, mut wheels) = ([zero; N], [zero; N]);
        for i in 0..N {
            if let (Some(sum), Some(count)) = {
                let row = usize::from(self.row_of(order, i));
                (sums.get_mut(row), wheels.get_mut(row))
            } {
                *sum += height_m[i];
                *count += R::one();
            }
        }
        let count = usize::from(self.counts[order.0]).min(N);
        let drop = |row: usize| sums[row - 1] / wheels[row - 1] - sums[row] / wheels[row];
        let slope = (1..count).map(drop).fold(None, |least, drop| match least {
            Some(least) if least < drop => Some(least),
            _ => Some(drop),
        });
        let slope = match slope {
            Some(slope) if count > 2 && slope > zero => slope,
            _ => zero,
        };
        let (mut next, mut most) = (0, self.config.height_m);
        for row in 1..count {
            if drop(row) - slope > most {
                (next, most) = (row as u16, drop(row) - slope);
            }
        }
        (next, most)
    }
}

/// The vehicle is no slower than this, or one of its wheels climbs.
fn moves<R: Real, const N: usize>(traction: &TractionState<R, N>, slow_m_s: R) -> bool {
    traction.speed_m_s.abs() >= slow_m_s || rises(traction)
}

/// One of its wheels climbs.
fn rises<R: Real, const N: usize>(traction: &TractionState<R, N>) -> bool {
    let mut speeds = traction.motion.rise_m_s.iter();
    speeds.any(|rise| rise.abs() > R::of(CLIMBS_M_S))
}

/// Row of each place along an axis, counted from the largest, and how many rows there are.
fn rows<R: Real, const N: usize>(places: &[R; N]) -> ([u16; N], u16) {
    let (mut rows, mut count, mut below) = ([0; N], 0, None::<R>);
    loop {
        // The largest place that has no row yet.
        let free = |place: &&R| below.is_none_or(|below| **place < below);
        let next = places
            .iter()
            .filter(free)
            .fold(None::<R>, |most, place| match most {
                Some(most) if most >= *place => Some(most),
                _ => Some(*place),
            });
        let Some(next) = next else {
            return (rows, count);
        };
        let end = next - R::of(ROW_M);
        for (row, place) in rows.iter_mut().zip(places) {
            if *place >= end && below.is_none_or(|below| *place < below) {
                *row = count;
            }
        }
        (count, below) = (count + 1, Some(end));
    }
}
