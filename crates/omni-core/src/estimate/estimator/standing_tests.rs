use std::vec::Vec;

use super::tests::{Random, filter, mecanum};
use super::{Estimator, EstimatorConfig, EstimatorInput, EstimatorState};

/// Noise of a mean square over 50 numbers, 99.9 % of it (chi-square of 50 over 50).
const OF_FIFTY: core::ops::Range<f64> = 0.47..1.792;

/// A period of a vehicle that stands and turns by `turns` \[rad/s\] about nothing, with a gyro of this bias.
fn resting(random: &mut Random, bias: f64, turns: f64) -> EstimatorInput<f64, 4> {
    let twist = crate::geometry::BodyTwist {
        wz_rad_s: turns,
        ..crate::geometry::BodyTwist::ZERO
    };
    let mut wheels = mecanum::<f64>().inverse(&twist);
    for wheel in &mut wheels.rad_s {
        *wheel += 0.1 * random.normal();
    }
    let mut input = EstimatorInput::new(&wheels);
    input.commanded_rest = true;
    input.yaw_rate_rad_s = bias + turns + 0.01 * random.normal();
    input.acceleration_m_s2 = [0.05 * random.normal(), 0.05 * random.normal()];
    input
}

/// Fifty vehicles that stand for two seconds, the second of which counts, and tremble about the vertical by this
/// deviation \[rad/s\],
/// each time for 45 ms: squares of what the bias is off by over its deviation, and the deviations.
fn learnt(tremble: f64, change: fn(&mut EstimatorInput<f64, 4>)) -> (Vec<f64>, Vec<f64>) {
    let estimator = filter::<f64>();
    let mut random = Random(7);
    let one = |_| {
        let mut state = estimator.start();
        let (bias, mut turns) = (0.02 * random.normal(), 0.0);
        let left = (-1e-3_f64 / 0.045).exp();
        for _ in 0..2000 {
            turns = left * turns + tremble * (1.0 - left * left).sqrt() * random.normal();
            let mut input = resting(&mut random, bias, turns);
            change(&mut input);
            estimator.step(&mut state, &input);
        }
        // Where it stood, as well as a second shows until it is held.
        let (pose, [x_m, _, yaw_rad]) = (state.pose(), state.covariance().standard_deviations());
        assert!(
            pose.x_m.abs() < 4.0 * x_m && pose.yaw_rad.abs() < 4.0 * yaw_rad && yaw_rad < 0.01,
            "{pose:?}, deviations {x_m} {yaw_rad}"
        );
        let deviation = state.gyro_bias_deviation_rad_s();
        (((state.gyro_bias_rad_s() - bias) / deviation).powi(2), deviation)
    };
    (0..50).map(one).unzip()
}

fn mean(of: &[f64]) -> f64 {
    of.iter().sum::<f64>() / of.len() as f64
}

#[test]
fn a_vehicle_that_stands_learns_the_bias_and_keeps_its_pose() {
    let (squares, deviations) = learnt(0.0, |_| {});
    // The gyro's noise, and that of the yaw rate by four wheels at a lever of 0.25 + 0.2 m, over
    // the root of the 950 periods after the first 1.05 s. Beyond that the bias has wandered by 1e-4
    // rad/s in a second, of which half a variance is known: 3 %.
    let noise = 0.01_f64.hypot(0.1 * 0.076 / (2.0 * 0.45));
    let deviation = mean(&deviations);
    assert!(
        (deviation / (noise / 950.0_f64.sqrt()) - 1.0).abs() < 0.1,
        "{deviation}"
    );
    assert!(OF_FIFTY.contains(&mean(&squares)), "{}", mean(&squares));
}

#[test]
fn a_vehicle_that_trembles_is_as_sure_of_the_bias_as_it_may_be() {
    // 1.5 mrad/s for 45 ms are as much as white noise of 0.014 rad/s: more than the gyro's own.
    let (squares, _) = learnt(1.5e-3, |_| {});
    assert!(OF_FIFTY.contains(&mean(&squares)), "{}", mean(&squares));
    // Where a wheel's reading is missing, it has to allow for trembling: 0.3 mm/s at the wheels'
    // mean lever of 0.45 m, 0.7 mrad/s.
    let (squares, _) = learnt(6e-4, |input| input.wheels.rad_s[1] = f64::NAN);
    assert!(OF_FIFTY.contains(&mean(&squares)), "{}", mean(&squares));
}

/// Standing after two seconds, and the bias then.
fn after_two_seconds(config: EstimatorConfig<f64>, bias: f64) -> (bool, EstimatorState<f64, 4>) {
    let estimator = Estimator::new(config, &mecanum()).expect("valid");
    let (mut random, mut state, mut standing) = (Random(3), estimator.start(), false);
    for _ in 0..2000 {
        standing = estimator
            .step(&mut state, &resting(&mut random, bias, 0.0))
            .standing;
    }
    (standing, state)
}

#[test]
fn a_bias_is_learnt_within_four_of_its_configured_deviations() {
    let usual = EstimatorConfig::new(1e-3);
    for (bias_rad_s, bias) in [(0.02, 0.08), (0.02, -0.08), (0.3, 1.2), (0.3, -1.2)] {
        let (standing, state) = after_two_seconds(EstimatorConfig { bias_rad_s, ..usual }, bias);
        // Four deviations of what is known then.
        let off = (state.gyro_bias_rad_s() - bias).abs();
        assert!(
            standing && off < 4.0 * state.gyro_bias_deviation_rad_s(),
            "{bias}: {standing}, off by {off}"
        );
    }
    // The average over 50 ms that is looked at for 50 ms starts at 0: some 6 deviations get by, 8 do not.
    let (standing, state) = after_two_seconds(usual, 0.16);
    assert!(!standing && state.gyro_bias_rad_s().abs() < 0.01, "{standing}");
    // Nor where nothing is allowed to shake, which this gyro's noise is not.
    let mut strict = usual;
    (strict.still_gyro_rad_s, strict.gyro_rad_s) = (1e-3, 1e-3);
    assert!(!after_two_seconds(strict, 0.0).0);
}

#[test]
fn who_is_braked_in_a_spin_with_locked_wheels_does_not_stand() {
    let estimator = filter::<f64>();
    let mut state = estimator.start();
    let mut input = EstimatorInput::new(&[0.0; 4].into());
    (input.commanded_rest, input.acceleration_m_s2) = (true, [0.0; 2]);
    // Ice of 0.05 at a lever of 0.35 m: 1.4 rad/s^2, from 0.7 rad/s in half a second.
    for k in 0..500 {
        input.yaw_rate_rad_s = 0.7 - 1.4e-3 * f64::from(k);
        assert!(!estimator.step(&mut state, &input).standing, "period {k}");
    }
    input.yaw_rate_rad_s = 0.0;
    (0..400).for_each(|_| _ = estimator.step(&mut state, &input));
    assert!(estimator.step(&mut state, &input).standing);
    // Some 0.7 * 0.5 / 2 rad, less what the last 50 ms of turning are taken for.
    assert!((state.pose().yaw_rad - 0.175).abs() < 0.01, "{:?}", state.pose());
}

/// A period of a vehicle that stands, whose accelerometer has this bias \[m/s^2\].
fn resting_on_a_lean(random: &mut Random, bias: [f64; 2]) -> EstimatorInput<f64, 4> {
    let mut input = resting(random, 0.0, 0.0);
    for (reading, bias) in input.acceleration_m_s2.iter_mut().zip(bias) {
        *reading += bias;
    }
    input
}

#[test]
fn the_bias_of_the_accelerometer_is_learnt_at_rest_and_is_no_slip_of_the_drive_that_follows() {
    let estimator = filter::<f64>();
    let (mut random, mut squares) = (Random(11), Vec::new());
    for _ in 0..25 {
        let bias = [0.05 * random.normal(), 0.05 * random.normal()];
        let mut state = estimator.start();
        for _ in 0..2000 {
            estimator.step(&mut state, &resting_on_a_lean(&mut random, bias));
        }
        // The accelerometer's noise over the root of the 950 periods after the first 1.05 s.
        let deviation = 0.05 / 950.0_f64.sqrt();
        let found = state.accelerometer_bias_m_s2();
        squares.extend((0..2).map(|i| ((found[i] - bias[i]) / deviation).powi(2)));
        // Then it stands under a command for ten seconds, every wheel held fast: by the accelerometer's word it would
        // be b t^2 / 2 away, 2.5 m for 0.05 m/s^2.
        let begin = state.pose();
        for _ in 0..10_000 {
            let mut input = resting_on_a_lean(&mut random, bias);
            input.commanded_rest = false;
            estimator.step(&mut state, &input);
        }
        let (end, [x_m, y_m, _]) = (state.pose(), state.covariance().standard_deviations());
        let [x, y] = [end.x_m - begin.x_m, end.y_m - begin.y_m];
        assert!(
            x.abs() < 4.0 * x_m && y.abs() < 4.0 * y_m,
            "{x} {y}, deviations {x_m} {y_m}"
        );
        assert!(x.hypot(y) < 0.03, "{x} {y}");
    }
    assert!(OF_FIFTY.contains(&mean(&squares)), "{}", mean(&squares));
}

#[test]
fn a_vehicle_with_a_bias_of_four_deviations_stands_and_one_that_slides_on_ice_does_not() {
    let stands = |ahead: f64, speed: f64| {
        let (estimator, mut random) = (filter::<f64>(), Random(5));
        let mut state = estimator.start();
        state.velocity[0] = speed;
        (0..1900).any(|_| {
            let input = resting_on_a_lean(&mut random, [ahead, 0.0]);
            estimator.step(&mut state, &input).standing
        })
    };
    // Four deviations of 0.05 m/s^2 and the 0.1 that counts as still.
    assert!(stands(0.2, 0.0) && stands(-0.2, 0.0));
    // Ice of 0.05, on which it slides for two seconds.
    assert!(!stands(0.49, -0.98) && !stands(-0.49, 0.98));
}

#[test]
fn a_bias_that_changes_is_followed_at_the_next_rest() {
    let estimator = filter::<f64>();
    let (mut random, mut state) = (Random(3), estimator.start());
    for bias in [0.1, 0.15, 0.1, 0.02] {
        for _ in 0..8000 {
            estimator.step(&mut state, &resting_on_a_lean(&mut random, [0.0, bias]));
        }
        // What is left after three and a half times the 2 s in which it is followed, 3 % of at most 0.1, and four
        // times the noise of such a mean: 0.05 * sqrt(1e-3 / 4).
        let [_, found] = state.accelerometer_bias_m_s2();
        assert!((found - bias).abs() < 3e-3 + 3.2e-3, "{found}, {bias}");
    }
}

#[test]
fn a_vehicle_that_creeps_at_rest_is_where_its_wheels_have_taken_it() {
    let (estimator, mut random) = (filter::<f64>(), Random(11));
    let mut state = estimator.start();
    // 2 mrad/s for 20 s, less than the noise of any reading; and what the wheels cannot tell, the gyro's bias.
    for _ in 0..20_000 {
        estimator.step(&mut state, &resting(&mut random, 0.003, 2e-3));
    }
    let (yaw, deviation) = (state.pose().yaw_rad, state.covariance().standard_deviations()[2]);
    // In the first second it is not yet held, with a bias that is not yet known: deviation 5 mrad (`learnt`).
    assert!(
        (yaw - 0.04).abs() < 4.0 * deviation && deviation < 6e-3,
        "{yaw}, deviation {deviation}"
    );
    assert!((state.gyro_bias_rad_s() - 0.003).abs() < 4.0 * state.gyro_bias_deviation_rad_s());
}
