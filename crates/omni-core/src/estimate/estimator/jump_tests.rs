//! Sensors that now and then read what cannot be.

use super::tests::{Random, mecanum};
use super::{Estimator, EstimatorConfig, EstimatorInput};
use crate::BodyTwist;
use crate::geometry::{Kinematics, WheelLayout};

/// Sizes of jumps of each wheel and of the gyro \[rad/s\]: of one reading in a thousand.
type Jumps = [f64; 2];

/// Error ahead, to the left \[m\] and in yaw \[rad\] after half a minute at 0.3 m/s.
fn error<const N: usize>(
    kinematics: &Kinematics<f64, N>,
    period_s: f64,
    jumps: Jumps,
    seed: u64,
) -> [f64; 3] {
    let estimator = Estimator::new(EstimatorConfig::new(period_s), kinematics).expect("in range");
    let mut state = estimator.start();
    let (mut random, mut dice) = (Random(seed * 0x9e37_79b9), Random(seed * 0x7f4a_7c15));
    let (mut speed, mut x) = (0.0_f64, 0.0);
    let mut jump = |size: f64| match dice.next() {
        dice if dice > 0.999 => size,
        dice if dice < -0.999 => -0.5 * size,
        _ => 0.0,
    };
    for _ in 0..(30.0 / period_s) as usize {
        let gains = (0.3 - speed).min(period_s);
        speed += gains;
        x += (speed - 0.5 * gains) * period_s;
        let ahead = BodyTwist {
            vx_m_s: speed,
            ..BodyTwist::ZERO
        };
        let wheels = kinematics.inverse(&ahead).rad_s;
        let wheels = wheels.map(|rate| rate + 0.05 * random.normal() + jump(jumps[0]));
        let mut input = EstimatorInput::new(&wheels.into());
        input.yaw_rate_rad_s = 0.005 * random.normal() + jump(jumps[1]);
        input.acceleration_m_s2 = [gains / period_s, 0.0];
        for each in &mut input.acceleration_m_s2 {
            *each += 0.03 + 0.05 * random.normal();
        }
        estimator.step(&mut state, &input);
    }
    let pose = state.pose();
    [pose.x_m - x, pose.y_m, pose.yaw_rad]
}

/// Root mean squares of the errors over eight seeds.
fn errors<const N: usize>(kinematics: &Kinematics<f64, N>, period_s: f64, jumps: Jumps) -> [f64; 3] {
    let errors: [_; 8] = core::array::from_fn(|k| error(kinematics, period_s, jumps, k as u64 + 1));
    [0, 1, 2].map(|i| (errors.iter().map(|each| each[i].powi(2)).sum::<f64>() / 8.0).sqrt())
}

/// With jumps the errors are those without, within the chance of the few readings that are left out.
fn moves_nothing<const N: usize>(kinematics: &Kinematics<f64, N>) {
    for period_s in [1e-3, 5e-3] {
        let clean = errors(kinematics, period_s, [0.0; 2]);
        for jumps in [
            [30.0, 0.0],
            [300.0, 0.0],
            [3e4, 0.0],
            [0.0, 3.0],
            [0.0, 30.0],
            [0.0, 3e4],
        ] {
            let found = errors(kinematics, period_s, jumps);
            // 30 rad/s at once are 1.5 and 2.3 m/s. The smallest jumps of the gyro, -1.5 rad/s, are just no jumps
            // at 5 ms: thrice in 30 s 5 ms of them are 4 cm of way after 30 s.
            for (found, clean) in found.iter().zip(clean) {
                assert!(
                    *found < 1.1 * clean + 0.05,
                    "{period_s} s, {jumps:?}: {found} instead of {clean}"
                );
            }
        }
    }
}

#[test]
fn jumps_of_encoders_and_gyro_move_neither_four_wheels_nor_three() {
    moves_nothing(&mecanum());
    let omni = WheelLayout::omni(0.2, 0.0, 0.05).expect("valid");
    moves_nothing(&Kinematics::<f64, 3>::new(&omni).expect("sound"));
}

#[test]
fn counts_of_a_fast_loop_are_no_jumps() {
    // A loop of 10 kHz that takes what its encoders count in a period: 0 for a dozen periods, and then 12 rad/s.
    let (kinematics, period_s, count) = (mecanum::<f64>(), 1e-4_f64, core::f64::consts::TAU / 5120.0);
    let mut config = EstimatorConfig::new(period_s);
    config.wheel_rad_s = count / (6.0 * period_s * 0.05).sqrt();
    let estimator = Estimator::new(config, &kinematics).expect("in range");
    let mut state = estimator.start();
    let (mut speed, mut x, mut before) = (0.0_f64, 0.0, [0.0; 4]);
    for k in 0..20_000 {
        let gains = (0.075 - speed).min(period_s);
        speed += gains;
        x += (speed - 0.5 * gains) * period_s;
        let ahead = |vx_m_s| BodyTwist {
            vx_m_s,
            ..BodyTwist::ZERO
        };
        let angles = kinematics.inverse(&ahead(x)).rad_s;
        let counted = angles.map(|angle| (angle / count).floor() * count);
        let wheels: [f64; 4] = core::array::from_fn(|i| (counted[i] - before[i]) / period_s);
        before = counted;
        let mut input = EstimatorInput::new(&wheels.into());
        input.yaw_rate_rad_s = 0.0;
        assert_eq!(estimator.step(&mut state, &input).readings, 4, "{k}");
    }
}
