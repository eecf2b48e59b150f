//! A vehicle that stands.

use super::step::{ValidReadings, above_zero, part};
use super::{
    BIAS, Estimator, EstimatorInput, EstimatorState, QUIET, Real, Rolling, SIZE, STANDING_M_S, STILL_S,
    Standstill, VX, VY, X, Y, YAW,
};
use crate::scalar::min;

/// Time that everything has to be quiet before the pose is held \[s\].
const HELD_S: f64 = 1.0;
/// Time in which the accelerometer's bias is followed at rest \[s\].
const FOLLOWS_S: f64 = 2.0;
/// Deviation of the velocity of a vehicle whose wheels stand and that may still glide on free rollers \[m/s\],
/// and for how long such an error lasts \[s\].
const GLIDE_M_S: f64 = 3e-3;
const GLIDE_S: f64 = 0.5;

impl<R: Real, const N: usize> Estimator<R, N> {
    /// For how long has everything been quiet?
    pub(super) fn standstill(
        &self,
        state: &mut EstimatorState<R, N>,
        input: &EstimatorInput<R, N>,
        valid: &ValidReadings<R, N>,
    ) -> Standstill {
        let (config, zero) = (&self.config, R::zero());
        let part = part(config.period_s, STILL_S);
        let mut square = zero;
        for (w, valid) in input.wheels.rad_s.iter().zip(valid.wheels) {
            if valid {
                square += *w * *w;
            }
        }
        if valid.count > 0 {
            square /= R::of(valid.count as f64);
        }
        // A reading that is absurd is forgotten as soon as any: ten times what is quiet.
        let ten = R::of(10.0);
        let noise = R::of(QUIET) * config.wheel_rad_s * config.wheel_rad_s;
        let calm = config.still_wheel_rad_s * config.still_wheel_rad_s + noise;
        state.turning += part * (min(square, ten * calm) - state.turning);
        let rate = valid.gyro.map_or(zero, |rate| rate - state.bias);
        let [ax, ay] = valid.acceleration.unwrap_or([zero; 2]);
        // The gyro's mean is as near to its bias as that is known: a vehicle that turns slowly would else teach it.
        let known = state.covariance.0[BIAS][BIAS] + part * config.gyro_rad_s * config.gyro_rad_s;
        let bias = config.accelerometer_bias_m_s2;
        let known_bias = min(state.accelerometer_bias_variance, R::of(4.0) * bias * bias);
        let push = config.still_m_s2 * config.still_m_s2 + R::of(16.0) * known_bias;
        let limits = [R::of(16.0) * known, push, push];
        let mut quiet = input.commanded_rest && valid.count > 0 && state.turning <= calm;
        let pushed = config.still_m_s2 + bias;
        let most = [config.still_gyro_rad_s + config.bias_rad_s, pushed, pushed].map(|limit| ten * limit);
        for (((mean, now), most), limit) in state.quiet.iter_mut().zip([rate, ax, ay]).zip(most).zip(limits) {
            *mean += part * (now.limited(-most, most) - *mean);
            quiet &= *mean * *mean <= limit;
        }
        // A bias is steady; a vehicle that is braked is not.
        let about = rate - state.quiet[0];
        let steady = config.still_gyro_rad_s * config.still_gyro_rad_s
            + R::of(QUIET) * config.gyro_rad_s * config.gyro_rad_s;
        state.restless += part * (min(about * about, ten * steady) - state.restless);
        quiet &= state.restless <= steady;
        state.still_s = if quiet {
            state.still_s + config.period_s
        } else {
            zero
        };
        // It need not be counted for ever.
        state.still_s = min(state.still_s, R::of(2.0 * HELD_S));
        if state.still_s > R::of(HELD_S) {
            Standstill::Held
        } else if state.still_s > R::of(STILL_S) {
            Standstill::Settling
        } else {
            Standstill::Moving
        }
    }

    /// It has just become quiet: no velocity, and no turning, are one more reading each, whose errors last.
    pub(super) fn settle(
        &self,
        state: &mut EstimatorState<R, N>,
        valid: &ValidReadings<R, N>,
        moved: &mut [R; SIZE],
    ) {
        let variance = R::of(GLIDE_M_S * GLIDE_M_S * GLIDE_S) / self.config.period_s;
        let [vx, _] = state.velocity;
        state.take::<VX>(-vx, variance, moved);
        let [_, vy] = state.velocity;
        state.take::<VY>(-vy, variance, moved);
        if let Some(gyro) = valid.gyro {
            let noise = self.config.gyro_rad_s * self.config.gyro_rad_s + variance / self.lever_m2;
            state.take::<BIAS>(gyro - state.bias, noise, moved);
        }
    }

    /// It does not move but tremble and creep, and gyro and accelerometer say their biases beyond that.
    pub(super) fn stand(
        &self,
        state: &mut EstimatorState<R, N>,
        input: &EstimatorInput<R, N>,
        valid: &ValidReadings<R, N>,
        moved: &mut [R; SIZE],
    ) {
        let config = &self.config;
        let walk = config.bias_walk_rad_s_per_sqrt_s;
        state.covariance.0[BIAS][BIAS] += walk * walk * config.period_s;
        let still = R::of(STANDING_M_S * STANDING_M_S);
        let [vx, _] = state.velocity;
        state.take::<VX>(-vx, still, moved);
        let [_, vy] = state.velocity;
        state.take::<VY>(-vy, still, moved);
        // It trembles as much now as before: no number of readings determines its velocity of this moment better.
        let p = &mut state.covariance.0;
        for i in [VX, VY] {
            p[i][i] = if p[i][i] < still { still } else { p[i][i] };
        }
        let (turns, variance) = self.trembling(input, valid);
        if valid.count == N {
            // What creeps is where its wheels have taken it.
            let dt = config.period_s;
            let [vx, vy, _] = self.kinematics.forward(&input.wheels).to_array();
            let (sin, cos) = state.yaw.total.sine_cosine();
            moved[X] += (cos * vx - sin * vy) * dt;
            moved[Y] += (sin * vx + cos * vy) * dt;
            moved[YAW] += turns * dt;
            let grown = variance * dt * dt;
            let p = &mut state.covariance.0;
            for (i, grown) in [
                (X, grown * self.lever_m2),
                (Y, grown * self.lever_m2),
                (YAW, grown),
            ] {
                p[i][i] += grown;
            }
        }
        if let Some(gyro) = valid.gyro {
            let noise = config.gyro_rad_s * config.gyro_rad_s + variance;
            state.take::<BIAS>(gyro - turns - state.bias, noise, moved);
        }
        if let Some(acceleration) = valid.acceleration {
            // A mean, and of more than two seconds one that follows.
            let noise = config.accelerometer_m_s2 * config.accelerometer_m_s2;
            let known = state.accelerometer_bias_variance;
            let gain = known / (known + noise);
            // A jolt is no bias.
            let most = R::of(10.0) * (config.still_m_s2 + config.accelerometer_bias_m_s2);
            for (bias, beyond) in state.accelerometer_bias.iter_mut().zip(acceleration) {
                *bias += gain * beyond.limited(-most, most);
            }
            let least = min(known, noise * part(config.period_s, FOLLOWS_S));
            let less = gain * noise;
            state.accelerometer_bias_variance = if less > least { less } else { least };
        }
        state.rolling = Rolling::at_rest();
        // Wheels that stand on a vehicle that stands do not slip.
        let left = R::one() - part(config.period_s, STILL_S);
        state.slip = state.slip.map(|slip| slip * left);
        state.yaw_rate = state.bias;
    }

    /// The yaw rate of a vehicle that stands, by its wheels, and its variance. Where a reading is
    /// missing it is not known, and what the vehicle trembles lasts for `STILL_S`: a mean over many
    /// readings knows less than if each were another.
    fn trembling(&self, input: &EstimatorInput<R, N>, valid: &ValidReadings<R, N>) -> (R, R) {
        let config = &self.config;
        if valid.count < N {
            let lasts = R::of(2.0 * STILL_S * STANDING_M_S * STANDING_M_S) / config.period_s;
            return (R::zero(), lasts / self.lever_m2);
        }
        let (mut rate, mut variance) = (R::zero(), R::zero());
        for ((a, share), wheel) in self.kinematics.forward_matrix()[2]
            .iter()
            .zip(&self.shares[2])
            .zip(input.wheels.rad_s)
        {
            rate += *a * wheel;
            variance += *share;
        }
        (rate, variance * config.wheel_rad_s * config.wheel_rad_s)
    }
}

impl<R: Real, const N: usize> EstimatorState<R, N> {
    /// Takes in a reading of one component with this variance.
    pub(super) fn take<const I: usize>(&mut self, innovation: R, variance: R, moved: &mut [R; SIZE]) {
        let seen = self.covariance.0.map(|row| row[I]);
        let gain = self.covariance.take(&seen, above_zero(seen[I]) + variance);
        self.add(&gain, innovation, moved);
    }
}
