//! Readings that contradict each other, and readings of absurd size.

use super::tests::{Random, mecanum};
use super::{Estimator, EstimatorConfig, EstimatorInput, SIZE};
use crate::Real;
use crate::geometry::WheelVelocities;

/// A power of ten between these.
fn ten_to<R: Real>(random: &mut Random, most: f64) -> R {
    R::of(10.0_f64.powf(most * random.next()))
}

/// Readings up to 10 to the power of `wild` of any sign, each sensor of another size, which changes every 50
/// periods; every second run has deviations that are up to a thousand times the default or a thousandth of it.
fn keeps_its_variances<R: Real>(wild: f64) {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for run in 0..40 {
        let mut config = EstimatorConfig::new(R::of(1e-3));
        if run % 2 == 1 {
            for deviation in [
                &mut config.wheel_rad_s,
                &mut config.gyro_rad_s,
                &mut config.accelerometer_m_s2,
                &mut config.wander_m_s_per_sqrt_s,
                &mut config.bias_rad_s,
            ] {
                *deviation *= ten_to(&mut random, 3.0);
            }
            // Beyond, `f32` keeps nothing of the slip beside the velocity that such a bias makes.
            for deviation in [
                &mut config.accelerometer_bias_m_s2,
                &mut config.accelerometer_bias_walk_m_s2_per_sqrt_s,
            ] {
                *deviation *= ten_to(&mut random, 1.0);
            }
        }
        let estimator = Estimator::<R, 4>::new(config, &mecanum()).expect("in range");
        let mut state = estimator.start();
        let mut sizes = [R::one(); 3];
        for k in 0..4000 {
            if k % 50 == 0 {
                sizes = [0; 3].map(|_| ten_to(&mut random, wild));
            }
            let mut reading = |size: R| size * R::of(random.next());
            let wheels = WheelVelocities {
                rad_s: [0; 4].map(|_| reading(sizes[0])),
            };
            let mut input = EstimatorInput::new(&wheels);
            input.yaw_rate_rad_s = reading(sizes[1]);
            input.acceleration_m_s2 = [reading(sizes[2]), reading(sizes[2])];
            input.commanded_rest = random.next() > 0.0;
            let nan = R::of(f64::NAN);
            if random.next() > 0.8 {
                input.yaw_rate_rad_s = nan;
            }
            if random.next() > 0.8 {
                input.acceleration_m_s2 = [nan; 2];
            }
            if random.next() > 0.8 {
                input.wheels.rad_s[k % 4] = nan;
            }
            let step = estimator.step(&mut state, &input);
            assert!(step.nis >= R::zero(), "run {run}, period {k}: {step:?}");
            assert!(
                state.accelerometer_bias_variance >= R::zero(),
                "run {run}, period {k}"
            );
            for i in 0..SIZE {
                let variance = state.covariance.0[i][i];
                // A reading of 1e6 after one of 1 leaves `f32` nothing of a slip's: not less than nothing.
                assert!(variance >= R::zero(), "run {run}, period {k}, {i}: {variance:?}");
            }
            let deviations = state.covariance().standard_deviations();
            assert!(
                deviations.iter().all(|d| *d > R::zero()),
                "run {run}, period {k}: {deviations:?}"
            );
        }
    }
}

#[test]
fn variances_stay_positive_and_nis_is_a_number_when_readings_contradict() {
    keeps_its_variances::<f32>(2.0);
    keeps_its_variances::<f64>(2.0);
}

#[test]
fn no_variance_is_below_zero_and_nis_is_a_number_when_readings_are_of_absurd_size() {
    // All that is taken for a reading: up to 1e6.
    keeps_its_variances::<f32>(6.0);
    keeps_its_variances::<f64>(6.0);
}

#[test]
fn what_is_not_finite_changes_nothing_and_is_no_surprise() {
    let estimator = Estimator::<f32, 4>::new(EstimatorConfig::new(1e-3), &mecanum()).expect("in range");
    let mut state = estimator.start();
    state.velocity = [f32::MAX; 2]; // nothing finite comes of it
    let before = state;
    let step = estimator.step(&mut state, &EstimatorInput::new(&[1.0; 4].into()));
    assert_eq!((step.taken, step.nis, step.readings), (false, 0.0, 0));
    assert_eq!(state, before);
}
