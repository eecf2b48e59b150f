//! Correction of the estimate by the wheels, and the weight of each.

use super::step::{ValidReadings, above_zero, part};
use super::{
    AS_NOISE, BodyTwist, DISAGREEMENT_S, Estimator, EstimatorInput, EstimatorState, LEAST_REDUNDANCY, MOST,
    QUIET, RESTLESS, Real, Rolling, SIZE, SLIP, SLIP_Y, SUDDEN, VX, VY, WheelVelocities,
};
use crate::scalar::{max, min};

/// Standard deviation of the velocity of a vehicle that is held \[m/s\].
const HELD_M_S: f64 = 0.02;
/// How many times longer than elsewhere a vehicle slips along what holds it.
const ALONG_EDGE: f64 = 10.0;

impl<R: Real, const N: usize> Estimator<R, N> {
    /// Processes the wheels; returns the normalised innovation squared.
    pub(super) fn correct(
        &self,
        state: &mut EstimatorState<R, N>,
        input: &EstimatorInput<R, N>,
        valid: &ValidReadings<R, N>,
        moved: &mut [R; SIZE],
    ) -> R {
        if valid.count == 0 {
            return R::zero();
        }
        let innovations = self.innovations(state, input, valid);
        let body = self.kinematics.forward(&innovations).to_array();
        let ([vx, vy], [sx, sy, _]) = (state.velocity, state.slip);
        let wheels = [vx + sx + body[0], vy + sy + body[1]];
        let held = input.held_along != [R::zero(); 2];
        if held {
            // Wheels that turn while the vehicle is held show nothing of the accelerometer.
            state.rolling = Rolling::at(wheels);
        } else if valid.acceleration.is_some() {
            self.compare(state, wheels);
        }
        let variances = self.variances(state, valid, &innovations, &body);
        let noise = self.gained(valid);
        let gained = [noise + self.biased(state, valid), noise];
        let slip = state.slip;
        let [along, across] = self.widen(state, &variances, &body, gained);
        if held {
            self.hold(state, &input.held_along, max(along, across), moved);
        } else {
            self.hold_against_none(state, along, across, moved);
        }
        let rate = state.yaw_rate - state.bias;
        let mut nis = R::zero();
        for (((row, reading), variance), valid) in self
            .kinematics
            .inverse_matrix()
            .iter()
            .zip(input.wheels.rad_s)
            .zip(variances)
            .zip(valid.wheels)
        {
            if !valid {
                continue;
            }
            let [a, b, c] = *row;
            let ([vx, vy], [sx, sy, sw]) = (state.velocity, state.slip);
            let innovation = reading - (a * (vx + sx) + b * (vy + sy) + c * (rate + sw));
            let seen = state.covariance.seen_by(row);
            let known = a * (seen[VX] + seen[SLIP]) + b * (seen[VY] + seen[SLIP + 1]) + c * seen[SLIP + 2];
            // Below 0 by rounding alone; a reading is never better than its noise.
            let whole = above_zero(known) + variance;
            let gain = state.covariance.take(&seen, whole);
            state.add(&gain, innovation, moved);
            nis += innovation * innovation / whole;
        }
        if let Some(acceleration) = valid.acceleration.filter(|_| !held) {
            let [sx, sy, _] = slip;
            let slides = R::of(2.0) * (self.config.slip_m_s * self.config.slip_m_s + sx * sx + sy * sy);
            self.doubt(state, acceleration, along + across - slides);
        }
        nis
    }

    /// Innovation of each wheel: its reading less what is expected. A wheel without a reading is assigned the value
    /// that the other wheels imply.
    fn innovations(
        &self,
        state: &EstimatorState<R, N>,
        input: &EstimatorInput<R, N>,
        valid: &ValidReadings<R, N>,
    ) -> WheelVelocities<R, N> {
        let mut innovations = self.kinematics.inverse(&state.expected_of_wheels());
        for ((innovation, reading), valid) in innovations
            .rad_s
            .iter_mut()
            .zip(input.wheels.rad_s)
            .zip(valid.wheels)
        {
            *innovation = if valid { reading - *innovation } else { R::zero() };
        }
        if valid.count < N {
            for _ in 0..8 {
                let filled = self.kinematics.project(&innovations);
                for ((innovation, filled), valid) in
                    innovations.rad_s.iter_mut().zip(filled.rad_s).zip(valid.wheels)
                {
                    if !valid {
                        *innovation = filled;
                    }
                }
            }
        }
        innovations
    }

    /// Variance of each wheel's reading: its noise, and a part of what it has disagreed with the others of late.
    fn variances(
        &self,
        state: &mut EstimatorState<R, N>,
        valid: &ValidReadings<R, N>,
        innovations: &WheelVelocities<R, N>,
        body: &[R; 3],
    ) -> [R; N] {
        let noise = self.config.wheel_rad_s * self.config.wheel_rad_s;
        let part = part(self.config.period_s, DISAGREEMENT_S);
        let residual = self
            .kinematics
            .residual_beyond(innovations, &BodyTwist::from_array(*body));
        let mut variances = [noise; N];
        for i in 0..N {
            if !valid.wheels[i] || self.redundancy[i] < R::of(LEAST_REDUNDANCY) {
                continue;
            }
            let square = residual.rad_s[i] * residual.rad_s[i] / self.redundancy[i];
            state.disagreement[i] += part * (square - state.disagreement[i]);
            variances[i] += R::of(AS_NOISE) * above_zero(state.disagreement[i] - R::of(QUIET) * noise);
        }
        variances
    }

    /// The slip may have changed: by what goes unnoticed, by as much as it is, by what the wheels
    /// disagree, and by what was not expected. Gives the variances that it may have along and across.
    fn widen(
        &self,
        state: &mut EstimatorState<R, N>,
        variances: &[R; N],
        body: &[R; 3],
        [gained, by_noise]: [R; 2],
    ) -> [R; 2] {
        let config = &self.config;
        let noise = config.wheel_rad_s * config.wheel_rad_s;
        // Not by the yaw rate of the slip: it has the gyro's noise in it.
        let [sx, sy, _] = state.slip;
        let floor = config.slip_m_s * config.slip_m_s;
        let slides = floor + sx * sx + sy * sy;
        let slides = [slides, slides, slides / self.lever_m2];
        let floors = [floor, floor, floor / self.lever_m2];
        let restless = R::of(RESTLESS) * gained;
        // A bias of the accelerometer turns nothing.
        let restless = [restless, restless, R::of(RESTLESS) * by_noise / self.lever_m2];
        let mut may_be = [floor; 3];
        let per = R::of(2.0) * config.period_s / config.slip_s;
        let p = &mut state.covariance.0;
        for j in 0..3 {
            let (mut read, mut disagreed, mut quiet) = (R::zero(), R::zero(), R::zero());
            for (share, variance) in self.shares[j].iter().zip(variances) {
                read += *share * *variance;
                disagreed += *share * (*variance - noise) * R::of(1.0 / AS_NOISE);
                quiet += *share * noise;
            }
            let most = R::of(MOST) * quiet;
            let (s, v) = (SLIP + j, VX + j);
            may_be[j] = slides[j] + disagreed;
            p[s][s] += min(min(per * may_be[j], restless[j] + per * floors[j]), most);
            let mut known = p[s][s] + read;
            if j < 2 {
                known += p[v][v] + p[v][s] + p[v][s];
            }
            let excess = body[j] * body[j] - R::of(SUDDEN) * known;
            p[s][s] += min(above_zero(excess), most);
        }
        let [along, across, _] = may_be;
        [along, across]
    }

    /// The vehicle is held along this direction: that is no velocity along it and, in the next period, no slip across
    /// it, of the variance `slip`. One more reading each, whose error lasts; a slip along an edge for long, because the
    /// wheels turn all the time.
    fn hold(&self, state: &mut EstimatorState<R, N>, [nx, ny]: &[R; 2], slip: R, moved: &mut [R; SIZE]) {
        let lasts = self.config.slip_s / self.config.period_s;
        let ([vx, vy], [sx, sy, _]) = (state.velocity, state.slip);
        state.sideways = !state.sideways;
        let (axes, row, value, variance) = if state.sideways {
            ([VX, VY], [*nx, *ny], [vx, vy], R::of(2.0 * HELD_M_S * HELD_M_S))
        } else {
            ([SLIP, SLIP_Y], [-*ny, *nx], [sx, sy], R::of(ALONG_EDGE) * slip)
        };
        let read = |of: &[R; SIZE]| row[0] * of[axes[0]] + row[1] * of[axes[1]];
        let seen = state.covariance.0.map(|p| read(&p));
        let known = above_zero(read(&seen));
        let gain = state.covariance.take(&seen, known + lasts * variance);
        state.add(&gain, -(row[0] * value[0] + row[1] * value[1]), moved);
    }

    /// A slip of these variances that lasts for `slip_s` is none on average. In white noise that is a
    /// reading of 0 with the variance times twice the periods that it lasts; by turns along and across,
    /// each with what two periods say. In yaw it fades by itself: gyro and wheels determine it.
    fn hold_against_none(
        &self,
        state: &mut EstimatorState<R, N>,
        along: R,
        across: R,
        moved: &mut [R; SIZE],
    ) {
        let lasts = self.config.slip_s / self.config.period_s;
        let [sx, sy, _] = state.slip;
        state.sideways = !state.sideways;
        if state.sideways {
            state.take::<SLIP_Y>(-sy, lasts * across, moved);
        } else {
            state.take::<SLIP>(-sx, lasts * along, moved);
        }
    }
}
