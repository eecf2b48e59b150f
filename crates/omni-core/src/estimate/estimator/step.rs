//! One period of the filter.

use super::{
    BIAS, BodyTwist, ConfigError, Estimator, EstimatorConfig, EstimatorInput, EstimatorState, EstimatorStep,
    Kinematics, Matrix, Motion, Real, Rolling, SIZE, SLIP, STANDING_M_S, Standstill, Sum, VX, VY, X, Y, YAW,
    is_plausible,
};
use crate::scalar::{max, min};

/// Acceleration beyond which a reading is none \[m/s^2\]: 100 g.
pub(in crate::estimate) const MOST_M_S2: f64 = 1000.0;

/// Squared deviations of the accelerometer's bias that are not taken for a slip.
const UNTAKEN: f64 = 16.0;

/// Change of a wheel's velocity that no wheel has in a period: at its rim at once \[m/s\] and for as long as the period
/// lasts \[m/s^2\], and deviations of its noise.
const JUMP_M_S: f64 = 0.3;
const JUMP_M_S2: f64 = 30.0;
const JUMP_DEVIATIONS: f64 = 30.0;
/// The noise of a wheel that counts is a count over `sqrt(period * COUNTED_S)`: a count and a half in a period is no
/// jump.
const COUNTED_S: f64 = 0.3;
const COUNTS: f64 = 1.5;
/// The same of the yaw rate \[rad/s\], \[rad/s^2\].
const JUMP_RAD_S: f64 = 1.0;
const JUMP_RAD_S2: f64 = 100.0;
/// For how long jumps are left out \[s\], at least two periods, and in which part of the time: what lasts is no jump.
const JUMPS_S: f64 = 0.01;
const JUMPS_PART: f64 = 0.15;

/// The valid readings of a period.
pub(super) struct ValidReadings<R, const N: usize> {
    pub(super) wheels: [bool; N],
    pub(super) count: usize,
    pub(super) gyro: Option<R>,
    /// Without its bias.
    pub(super) acceleration: Option<[R; 2]>,
}

impl<R: Real, const N: usize> ValidReadings<R, N> {
    pub(super) fn of(input: &EstimatorInput<R, N>, state: &EstimatorState<R, N>) -> Self {
        let wheels = input.wheels.rad_s.map(is_plausible);
        let ([ax, ay], most) = (input.acceleration_m_s2, R::of(MOST_M_S2));
        let [bx, by] = state.accelerometer_bias;
        Self {
            count: wheels.iter().filter(|valid| **valid).count(),
            wheels,
            gyro: Some(input.yaw_rate_rad_s).filter(|rate| is_plausible(*rate)),
            acceleration: (ax.abs() <= most && ay.abs() <= most).then_some([ax - bx, ay - by]),
        }
    }
}

/// A sensor jumps, or not: is it left out? `spare` is for how long it may be \[s\].
fn is_left_out<R: Real>(spare: &mut R, jumps: bool, period_s: R) -> bool {
    let left_out = jumps && *spare > R::zero();
    *spare += if jumps {
        -period_s
    } else {
        R::of(JUMPS_PART) * period_s
    };
    *spare = spare.limited(R::zero(), max(R::of(JUMPS_S), R::of(2.0) * period_s));
    left_out
}

pub(super) fn above_zero<R: Real>(a: R) -> R {
    if a > R::zero() { a } else { R::zero() }
}

/// A part of the gap that a filter with the time constant `time_s` closes in a period.
pub(super) fn part<R: Real>(period_s: R, time_s: f64) -> R {
    min(period_s / R::of(time_s), R::one())
}

impl<R: Real, const N: usize> Estimator<R, N> {
    /// A filter for these wheels.
    ///
    /// # Errors
    /// The field of [`EstimatorConfig`] that is out of range, by its name.
    pub fn new(config: EstimatorConfig<R>, kinematics: &Kinematics<R, N>) -> Result<Self, ConfigError> {
        let mut squares = [R::zero(); 3];
        for row in kinematics.inverse_matrix() {
            for (sum, a) in squares.iter_mut().zip(row) {
                *sum += *a * *a;
            }
        }
        let ([x, y, w], config) = (squares, config.checked()?);
        // Mean velocity of the wheels per velocity of the vehicle, in any direction.
        let per_speed = ((x + y) / R::of(N as f64)).sqrt();
        let jump_m_s = R::of(JUMP_M_S) + R::of(JUMP_M_S2) * config.period_s;
        let counts = R::of(COUNTS) * (R::of(COUNTED_S) / config.period_s).sqrt();
        let deviations = max(counts, R::of(JUMP_DEVIATIONS));
        Ok(Self {
            config,
            jump_rad_s: max(per_speed * jump_m_s, deviations * config.wheel_rad_s),
            kinematics: *kinematics,
            shares: kinematics.forward_matrix().map(|row| row.map(|f| f * f)),
            redundancy: kinematics.redundancy(),
            lever_m2: R::of(2.0) * w / (x + y),
        })
    }

    /// Time between steps \[s\].
    pub(in crate::estimate) fn period_s(&self) -> R {
        self.config.period_s
    }

    /// Inverse kinematic matrix of its vehicle.
    pub(in crate::estimate) fn inverse_matrix(&self) -> &[[R; 3]; N] {
        self.kinematics.inverse_matrix()
    }

    /// At the origin, facing +x, known exactly, at rest; the biases are unknown.
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let state = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?.start();
    /// assert_eq!(state.covariance().standard_deviations(), [0.0; 3]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn start(&self) -> EstimatorState<R, N> {
        let (zero, slip) = (R::zero(), self.config.slip_m_s);
        let (still, slips) = (R::of(STANDING_M_S), slip * slip);
        let bias = self.config.bias_rad_s;
        EstimatorState {
            x: Sum::of(zero),
            y: Sum::of(zero),
            yaw: Sum::of(zero),
            velocity: [zero; 2],
            bias: zero,
            accelerometer_bias: [zero; 2],
            accelerometer_bias_variance: self.config.accelerometer_bias_m_s2
                * self.config.accelerometer_bias_m_s2,
            rolling: Rolling::at_rest(),
            doubted_s: zero,
            jumps_s: [zero; 2],
            slip: [zero; 3],
            covariance: Matrix::diagonal([
                zero,
                zero,
                zero,
                still * still,
                still * still,
                bias * bias,
                slips,
                slips,
                slips / self.lever_m2,
            ]),
            yaw_rate: zero,
            disagreement: [zero; N],
            quiet: [zero; 3],
            turning: zero,
            restless: zero,
            still_s: zero,
            sideways: false,
        }
    }

    /// One period. Values that are not valid (NaN, or beyond 1e6) are left out. Bounded: the same work whatever the
    /// readings, but for a wheel without a valid reading, whose innovation is filled in by the others eight times over.
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig, EstimatorInput};
    /// use omni_core::policy::Imu;
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
    /// let estimator = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?;
    /// let mut state = estimator.start();
    /// let left = BodyTwist { wz_rad_s: 1.0, ..BodyTwist::ZERO };
    /// let mut imu = Imu::level();
    /// imu.rate_rad_s[2] = 1.0;
    /// let input = EstimatorInput::with_imu(&kinematics.inverse(&left), &imu, &left);
    /// (0..1000).for_each(|_| _ = estimator.step(&mut state, &input));
    /// assert!((state.pose().yaw_rad - 1.0).abs() < 1e-3);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut EstimatorState<R, N>, input: &EstimatorInput<R, N>) -> EstimatorStep<R> {
        let mut next = *state;
        let mut valid = ValidReadings::of(input, state);
        self.leave_out_jumps(&mut next, input, &mut valid);
        let standstill = self.standstill(&mut next, input, &valid);
        let (standing, held) = (standstill != Standstill::Moving, standstill == Standstill::Held);
        let mut nis = R::zero();
        let mut moved = [R::zero(); SIZE];
        if held {
            self.stand(&mut next, input, &valid, &mut moved);
        } else {
            self.predict(&mut next, input, &valid);
            nis = self.correct(&mut next, input, &valid, &mut moved);
            if standing {
                self.settle(&mut next, &valid, &mut moved);
            }
        }
        next.x = next.x.plus(moved[X]);
        next.y = next.y.plus(moved[Y]);
        next.yaw = next.yaw.plus(moved[YAW]);
        if next.yaw.total.abs() > R::pi() {
            let turn = if next.yaw.total > R::zero() {
                -R::one()
            } else {
                R::one()
            };
            next.yaw = next.yaw.plus(turn * R::two_pi()).plus(turn * R::TURN_REST);
        }
        let taken = next.is_finite();
        if !taken {
            return EstimatorStep {
                nis: R::zero(),
                readings: 0,
                standing,
                taken,
            };
        }
        next.covariance.keep_positive();
        *state = next;
        EstimatorStep {
            nis,
            readings: if held { 0 } else { valid.count },
            standing,
            taken,
        }
    }

    /// Readings that no vehicle can cause are none, unless they last.
    fn leave_out_jumps(
        &self,
        state: &mut EstimatorState<R, N>,
        input: &EstimatorInput<R, N>,
        valid: &mut ValidReadings<R, N>,
    ) {
        let expected = self.kinematics.inverse(&state.expected_of_wheels());
        let mut jumps = [false; N];
        for (jumps, (reading, expected)) in jumps
            .iter_mut()
            .zip(input.wheels.rad_s.iter().zip(expected.rad_s))
        {
            *jumps = (*reading - expected).abs() > self.jump_rad_s;
        }
        let [of_wheels, of_gyro] = &mut state.jumps_s;
        let dt = self.config.period_s;
        if is_left_out(of_wheels, jumps.contains(&true), dt) {
            for (valid, jumps) in valid.wheels.iter_mut().zip(jumps) {
                *valid &= !jumps;
            }
            valid.count = valid.wheels.iter().filter(|valid| **valid).count();
        }
        let turns = R::of(JUMP_RAD_S) + R::of(JUMP_RAD_S2) * dt;
        let turns = max(turns, R::of(JUMP_DEVIATIONS) * self.config.gyro_rad_s);
        let rate = state.yaw_rate;
        let jumps = valid.gyro.is_some_and(|gyro| (gyro - rate).abs() > turns);
        if is_left_out(of_gyro, jumps, dt) {
            valid.gyro = None;
        }
    }

    /// Variance that the noise of the accelerometer adds to the velocity in a period.
    pub(super) fn gained(&self, valid: &ValidReadings<R, N>) -> R {
        let (config, dt) = (&self.config, self.config.period_s);
        match valid.acceleration {
            Some(_) => config.accelerometer_m_s2 * config.accelerometer_m_s2 * dt * dt,
            None => config.wander_m_s_per_sqrt_s * config.wander_m_s_per_sqrt_s * dt,
        }
    }

    /// Variance that its bias adds in a period: of four deviations, so that none is taken for a slip that lasts.
    pub(super) fn biased(&self, state: &EstimatorState<R, N>, valid: &ValidReadings<R, N>) -> R {
        let lasts = R::of(2.0 * UNTAKEN) * self.config.slip_s * self.config.period_s;
        valid
            .acceleration
            .map_or(R::zero(), |_| lasts * state.accelerometer_bias_variance)
    }

    /// The state moves by what gyro and accelerometer say.
    pub(super) fn predict(
        &self,
        state: &mut EstimatorState<R, N>,
        input: &EstimatorInput<R, N>,
        valid: &ValidReadings<R, N>,
    ) {
        let (config, zero, half) = (&self.config, R::zero(), R::of(0.5));
        let (dt, [vx, vy]) = (config.period_s, state.velocity);
        let (rate, biased, rate_variance) = match valid.gyro {
            Some(gyro) => (gyro, R::one(), config.gyro_rad_s * config.gyro_rad_s),
            None => {
                // What the wheels say, as far as they do not slip; that lasts, and counts as often as it does.
                let rate = if valid.count == N {
                    self.kinematics.forward(&input.wheels).wz_rad_s - state.slip[2]
                } else {
                    state.yaw_rate - state.bias
                };
                let slip = state.covariance.0[SLIP + 2][SLIP + 2];
                (rate + state.bias, zero, slip * R::of(2.0) * config.slip_s / dt)
            }
        };
        let turn = ((rate + state.yaw_rate) * half - state.bias) * dt;
        state.yaw_rate = rate;
        let (sin, cos) = turn.sine_cosine();
        // Along the new heading, first the velocity before, then with what was gained.
        let before = [cos * vx + sin * vy, cos * vy - sin * vx];
        let [ax, ay] = valid.acceleration.unwrap_or([zero; 2]);
        let after = [before[0] + ax * dt, before[1] + ay * dt];
        let yaw = state.yaw.total + turn;
        let (s, c) = yaw.sine_cosine();
        let middle = [
            (before[0] + after[0]) * half * dt,
            (before[1] + after[1]) * half * dt,
        ];
        let way = [c * middle[0] - s * middle[1], s * middle[0] + c * middle[1]];
        // The place by the velocity before: turned back by the turn, which is the heading before.
        // Therefore only the gain in velocity turns with the rate.
        let (s0, c0) = (s * cos - c * sin, c * cos + s * sin);
        let extra = [ax * half * dt * dt, ay * half * dt * dt];
        let turns = [c * extra[0] - s * extra[1], s * extra[0] + c * extra[1]];
        let fades = R::one() - dt / config.slip_s;
        let motion = Motion {
            way,
            carried: [[c0 * dt, -(s0 * dt)], [s0 * dt, c0 * dt]],
            turned: [cos, sin],
            by_rate: [
                -(turns[1] * dt),
                turns[0] * dt,
                dt,
                before[1] * dt,
                -(before[0] * dt),
            ],
            biased,
            fades,
        };
        state.covariance.carry(&motion, rate_variance);
        let gained = self.gained(valid) + self.biased(state, valid);
        let p = &mut state.covariance.0;
        p[VX][VX] += gained;
        p[VY][VY] += gained;
        p[BIAS][BIAS] += config.bias_walk_rad_s_per_sqrt_s * config.bias_walk_rad_s_per_sqrt_s * dt;
        // The yaw rate that the wheels are held against has the gyro's noise.
        p[SLIP + 2][SLIP + 2] += config.gyro_rad_s * config.gyro_rad_s;
        self.roll(state, [cos, sin], valid.acceleration);
        state.x = state.x.plus(way[0]);
        state.y = state.y.plus(way[1]);
        state.yaw = state.yaw.plus(turn);
        state.velocity = after;
        state.slip[2] *= fades;
    }
}

impl<R: Real, const N: usize> EstimatorState<R, N> {
    /// The estimates move by gain times innovation; `moved` keeps all of it, of which the pose is moved later.
    pub(super) fn add(&mut self, gain: &[R; SIZE], innovation: R, moved: &mut [R; SIZE]) {
        for (moved, gain) in moved.iter_mut().zip(gain) {
            *moved += *gain * innovation;
        }
        self.velocity[0] += gain[VX] * innovation;
        self.velocity[1] += gain[VY] * innovation;
        self.bias += gain[BIAS] * innovation;
        for (slip, gain) in self.slip.iter_mut().zip(&gain[SLIP..]) {
            *slip += *gain * innovation;
        }
    }

    /// The motion that the wheels are expected to show together, slip included.
    pub(super) fn expected_of_wheels(&self) -> BodyTwist<R> {
        let ([vx, vy], [sx, sy, sw]) = (self.velocity, self.slip);
        BodyTwist::from_array([vx + sx, vy + sy, self.yaw_rate - self.bias + sw])
    }

    fn is_finite(&self) -> bool {
        let mut sum = self.x.total + self.y.total + self.yaw.total + self.bias + self.turning + self.restless;
        sum += self.accelerometer_bias_variance + self.rolling.variance + self.rolling.with_bias;
        for value in self
            .velocity
            .iter()
            .chain(&self.slip)
            .chain(&self.quiet)
            .chain(&self.accelerometer_bias)
            .chain(&self.rolling.velocity)
            .chain(&self.disagreement)
        {
            sum += *value;
        }
        for row in &self.covariance.0 {
            for value in row {
                sum += *value;
            }
        }
        sum.is_finite_real()
    }
}
