//! The accelerometer's bias while driving: what it says in seconds beyond what the wheels say.

use super::rolling::{Rolling, SLIPS_M_S};
use super::step::above_zero;
use super::{Estimator, EstimatorState, Real};

/// Squared deviations beyond which the wheels' velocity has slipped away.
const GONE: f64 = 25.0;
/// For how long the wheels deviate from the vehicle's velocity by what passes for none \[s\].
const SLIPS_S: f64 = 0.5;

/// A vehicle moves and slips if it does at least this \[m/s\]; then friction takes it towards its wheels' velocity
/// by at least this \[m/s^2\], if no such part of the slip's square is disagreement of the wheels. For how long it
/// may be otherwise \[s\], and how much more than what is read the bias may then be \[m/s^2\].
const MOVES_M_S: f64 = 0.03;
const RUBS_M_S2: f64 = 0.05;
const DISAGREES: f64 = 0.3;
const DOUBTED_S: f64 = 0.5;
const WRONG_M_S2: f64 = 0.6;

impl<R: Real, const N: usize> Estimator<R, N> {
    /// The accelerometer moves the velocity, turned as the vehicle is.
    pub(super) fn roll(
        &self,
        state: &mut EstimatorState<R, N>,
        [cos, sin]: [R; 2],
        acceleration: Option<[R; 2]>,
    ) {
        let (dt, known) = (self.config.period_s, state.accelerometer_bias_variance);
        let walk = self.config.accelerometer_bias_walk_m_s2_per_sqrt_s;
        let rolling = &mut state.rolling;
        let ([vx, vy], [ax, ay]) = (rolling.velocity, acceleration.unwrap_or([R::zero(); 2]));
        rolling.velocity = [cos * vx + sin * vy + ax * dt, cos * vy - sin * vx + ay * dt];
        if acceleration.is_none() {
            *rolling = Rolling::at(rolling.velocity);
        }
        let noise = self.config.accelerometer_m_s2 * dt;
        rolling.variance += noise * noise + dt * (dt * known - R::of(2.0) * rolling.with_bias);
        rolling.with_bias -= dt * known;
        state.accelerometer_bias_variance = known + walk * walk * dt;
    }

    /// The bias follows from the velocity of the wheels. One that no bias explains is a slip that has come or gone:
    /// what is compared starts anew.
    pub(super) fn compare(&self, state: &mut EstimatorState<R, N>, wheels: [R; 2]) {
        let [sx, sy, _] = state.slip;
        let least = R::of(SLIPS_M_S * SLIPS_M_S);
        let slips = least + sx * sx + sy * sy;
        let mut rolling = state.rolling;
        let [vx, vy] = rolling.velocity;
        let [x, y] = [wheels[0] - vx, wheels[1] - vy];
        if x * x + y * y > R::of(GONE) * (rolling.variance + least) {
            state.rolling = Rolling::at(wheels);
            return;
        }
        let noise = slips * R::of(2.0 * SLIPS_S) / self.config.period_s;
        let part = R::one() / (rolling.variance + noise);
        let (gain, of_bias) = (rolling.variance * part, rolling.with_bias * part);
        rolling.velocity = [vx + gain * x, vy + gain * y];
        let [bx, by] = &mut state.accelerometer_bias;
        *bx += of_bias * x;
        *by += of_bias * y;
        // Below 0 by rounding alone.
        let known = state.accelerometer_bias_variance - of_bias * rolling.with_bias;
        state.accelerometer_bias_variance = above_zero(known);
        rolling.variance *= noise * part;
        rolling.with_bias *= noise * part;
        state.rolling = rolling;
    }

    /// Friction takes a vehicle that slides towards the velocity of its wheels, or some of its wheels hold it, and they
    /// disagree. If neither is so for long, it does not slide: its accelerometer is off by more than was known.
    pub(super) fn doubt(&self, state: &mut EstimatorState<R, N>, acceleration: [R; 2], disagreed: R) {
        let ([vx, vy], [sx, sy, _], [_, ax, ay]) = (state.velocity, state.slip, state.quiet);
        let (least, slip) = (R::of(MOVES_M_S * MOVES_M_S), sx * sx + sy * sy);
        let slides = vx * vx + vy * vy > least && slip > least && disagreed < R::of(DISAGREES) * slip;
        let towards = ax * sx + ay * sy;
        let rubs = towards > R::zero() && towards * towards > R::of(RUBS_M_S2 * RUBS_M_S2) * slip;
        let dt = self.config.period_s;
        let doubted_s = state.doubted_s + if slides && !rubs { dt } else { -dt };
        state.doubted_s = doubted_s.limited(R::zero(), R::of(DOUBTED_S));
        if doubted_s > R::of(DOUBTED_S) {
            let [rx, ry] = acceleration;
            let wrong = R::of(WRONG_M_S2 * WRONG_M_S2) + rx * rx + ry * ry;
            if state.accelerometer_bias_variance < wrong {
                state.accelerometer_bias_variance = wrong;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyTwist;
    use crate::estimate::EstimatorInput;
    use crate::estimate::estimator::tests::{Random, filter, mecanum};

    /// Drives 0.3 m/s ahead for a minute on ground where nothing slips, with an accelerometer that reads at a time,
    /// of an acceleration ahead, what `reads` says; gives the largest error of the velocity \[m/s\], that of the
    /// last second, and of the bias from 10 s on \[m/s^2\].
    fn drive(reads: impl Fn(f64, f64) -> [f64; 2]) -> [f64; 3] {
        let (estimator, kinematics, mut random) = (filter::<f64>(), mecanum::<f64>(), Random(7));
        let mut state = estimator.start();
        let (mut speed, [mut of_velocity, mut at_the_end, mut of_bias]) = (0.0, [0.0_f64; 3]);
        for k in 0..60_000 {
            let time_s = f64::from(k) * 1e-3;
            let gains = if speed < 0.3 { 0.3 } else { 0.0 };
            speed += gains * 1e-3;
            let ahead = BodyTwist {
                vx_m_s: speed,
                ..BodyTwist::ZERO
            };
            let mut input = EstimatorInput::new(&kinematics.inverse(&ahead));
            for reading in &mut input.wheels.rad_s {
                *reading += 0.1 * random.normal();
            }
            let [x, y] = reads(time_s, gains);
            input.yaw_rate_rad_s = 0.01 * random.normal();
            input.acceleration_m_s2 = [x + 0.05 * random.normal(), y + 0.05 * random.normal()];
            estimator.step(&mut state, &input);
            let (twist, [found_x, found_y]) = (state.twist(), state.accelerometer_bias_m_s2());
            let off = (twist.vx_m_s - speed).hypot(twist.vy_m_s);
            of_velocity = of_velocity.max(off);
            if time_s > 59.0 {
                at_the_end = at_the_end.max(off);
            }
            if time_s > 10.0 {
                of_bias = of_bias.max((found_x + gains - x).hypot(found_y - y));
            }
        }
        [of_velocity, at_the_end, of_bias]
    }

    #[test]
    fn a_bias_that_no_rest_has_shown_is_found_while_driving() {
        let [velocity, _, bias] = drive(|_, gains| [gains + 0.1, -0.05]);
        // Deviation where a walk of 0.01 and a slip of 0.02 m/s for half a second balance: (q R)^(1/4) q^(1/4) 2^(1/4)
        // with q = 1e-4 and R = 4e-4 is 0.014 m/s^2, a bias that really walks; four of them.
        assert!(bias < 0.056, "{bias}");
        assert!(velocity < 0.05, "{velocity}");
    }

    #[test]
    fn an_accelerometer_that_is_wrong_by_far_is_no_reason_to_run_away() {
        // Attitudes that swing by two degrees and a half in 20 s: integrated it were 1.3 m/s.
        let swing = |time_s: f64, gains: f64| {
            let (sin, _) = (0.3 * time_s).sine_cosine();
            [gains + 0.4 * sin, -0.4 * sin]
        };
        let [velocity, ..] = drive(swing);
        assert!(velocity < 0.3, "{velocity}");
        // An axis that is stuck at its limit, 2 g: half a second until it is doubted, and then that is its bias.
        let [velocity, at_the_end, _] =
            drive(|time_s, gains| [if time_s > 20.0 { 19.6 } else { gains }, 0.0]);
        assert!(
            velocity < 1.1 * 19.6 * DOUBTED_S && at_the_end < 0.05,
            "{velocity} {at_the_end}"
        );
        // It is dead: the start alone is not seen.
        let [velocity, at_the_end, _] = drive(|_, _| [0.0, 0.0]);
        assert!(velocity < 0.35 && at_the_end < 0.05, "{velocity} {at_the_end}");
    }

    #[test]
    fn a_jolt_is_forgotten_and_a_reading_that_cannot_be_is_none() {
        // 1 m/s that the vehicle does not have.
        let jolt = |time_s: f64| {
            if (20.0..20.02).contains(&time_s) {
                50.0
            } else {
                0.0
            }
        };
        let [velocity, at_the_end, _] = drive(|time_s, gains| [gains + jolt(time_s), 0.0]);
        assert!(velocity < 1.1 && at_the_end < 0.05, "{velocity} {at_the_end}");
        let [velocity, ..] = drive(|time_s, gains| [if time_s == 20.0 { 9e4 } else { gains }, 0.0]);
        assert!(velocity < 0.05, "{velocity}");
        // At rest, 4.8 m/s: it is where it was but for half a second of that.
        let (estimator, mut state) = (filter::<f64>(), filter::<f64>().start());
        for k in 0..10_000 {
            let mut input = EstimatorInput::new(&[0.0; 4].into());
            (input.yaw_rate_rad_s, input.commanded_rest) = (0.0, true);
            input.acceleration_m_s2 = [if (5000..5030).contains(&k) { 160.0 } else { 0.0 }, 0.0];
            estimator.step(&mut state, &input);
        }
        let (pose, twist) = (state.pose(), state.twist());
        assert!(pose.x_m < 4.8 && twist.vx_m_s.abs() < 0.01, "{pose:?} {twist:?}");
    }
}
