use super::{Estimator, EstimatorConfig, EstimatorInput, EstimatorState, SIZE};
use crate::Real;
use crate::estimate::{Odometry, OdometryState, PoseCovariance};
use crate::geometry::{BodyTwist, Kinematics, PlanarPose, WheelLayout};
use crate::policy::Imu;

/// Numbers between -1 and 1 that are the same everywhere (Marsaglia's xorshift, 2003).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Of deviation 1: twelve uniform numbers.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() / 2.0
    }
}

pub(super) fn mecanum<R: Real>() -> Kinematics<R, 4> {
    let layout = WheelLayout::mecanum4(R::of(0.5), R::of(0.4), R::of(0.076)).expect("valid");
    Kinematics::new(&layout).expect("well conditioned")
}

pub(super) fn filter<R: Real>() -> Estimator<R, 4> {
    Estimator::new(EstimatorConfig::new(R::of(1e-3)), &mecanum()).expect("valid")
}

/// The same for a vehicle that has stood: the bias of its accelerometer is known to 1 mm/s^2.
fn calibrated() -> Estimator<f64, 4> {
    let mut config = EstimatorConfig::new(1e-3);
    config.accelerometer_bias_m_s2 = 1e-3;
    config.accelerometer_bias_walk_m_s2_per_sqrt_s = 1e-4;
    Estimator::new(config, &mecanum()).expect("valid")
}

/// Is it positive definite? By Cholesky's factors in `f64`, of the rows and columns that have a
/// variance, each scaled by it.
fn is_positive<R: Real>(state: &EstimatorState<R, 4>) -> bool {
    let p = state.covariance.0.map(|row| row.map(Real::as_f64));
    let mut l = [[0.0; SIZE]; SIZE];
    for i in 0..SIZE {
        for j in 0..=i {
            let scale = (p[i][i] * p[j][j]).sqrt();
            if scale.is_nan() || scale <= 0.0 || p[i][j] != p[j][i] {
                return false;
            }
            let sum = p[i][j] / scale - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i == j && (sum.is_nan() || sum <= 0.0) {
                return false;
            }
            l[i][j] = if i == j { sum.sqrt() } else { sum / l[j][j] };
        }
    }
    true
}

#[test]
fn without_noise_and_slip_it_is_where_odometry_is() {
    let (kinematics, estimator) = (mecanum::<f64>(), filter::<f64>());
    let odometry = Odometry::<f64, 4>::new(1e-3).expect("valid");
    let (mut state, mut other) = (estimator.start(), OdometryState::new());
    let mut before = BodyTwist::ZERO;
    for k in 0..20_000 {
        let t = f64::from(k) * 1e-3;
        let twist = BodyTwist {
            vx_m_s: 0.5 * t.sin(),
            vy_m_s: 0.3 * (0.7 * t).sin(),
            wz_rad_s: 0.8 * (0.4 * t).sin(),
        };
        let mut input = EstimatorInput::new(&kinematics.inverse(&twist));
        input.yaw_rate_rad_s = twist.wz_rad_s;
        // What an accelerometer on the vehicle feels: its axes turn.
        let (s, c) = f64::sin_cos(f64::midpoint(before.wz_rad_s, twist.wz_rad_s) * 1e-3);
        input.acceleration_m_s2 = [
            (twist.vx_m_s - (c * before.vx_m_s + s * before.vy_m_s)) / 1e-3,
            (twist.vy_m_s - (c * before.vy_m_s - s * before.vx_m_s)) / 1e-3,
        ];
        assert!(estimator.step(&mut state, &input).nis < 1e-6, "{t} s");
        let middle = |a: f64, b: f64| f64::midpoint(a, b);
        let mean = BodyTwist {
            vx_m_s: middle(before.vx_m_s, twist.vx_m_s),
            vy_m_s: middle(before.vy_m_s, twist.vy_m_s),
            wz_rad_s: middle(before.wz_rad_s, twist.wz_rad_s),
        };
        odometry.step_twist(&mut other, &mean);
        before = twist;
    }
    let (here, there) = (state.pose(), other.pose());
    // Both are of second order in the period: 1e-6 of some metres of way, in 20 s.
    assert!(
        (here.x_m - there.x_m).abs() < 1e-5 && (here.y_m - there.y_m).abs() < 1e-5,
        "{here:?} {there:?}"
    );
    assert!((here.yaw_rad - there.yaw_rad).abs() < 1e-9, "{here:?} {there:?}");
    assert!(there.x_m.hypot(there.y_m) > 0.3); // it went somewhere
}

#[test]
fn yaw_stays_within_a_turn_and_is_not_lost_at_the_seam() {
    let estimator = filter::<f32>();
    let mut state = estimator.start();
    let twist = BodyTwist {
        wz_rad_s: -3.0,
        ..BodyTwist::ZERO
    };
    let mut input = EstimatorInput::new(&mecanum().inverse(&twist));
    input.yaw_rate_rad_s = -3.0;
    for _ in 0..10_000 {
        estimator.step(&mut state, &input);
        let yaw = state.pose().yaw_rad;
        assert!(yaw > -core::f32::consts::PI && yaw <= core::f32::consts::PI);
    }
    // The first period turns by half: the rate before it was 0.
    let turned = -(3.0 * 9.9995_f64);
    let expected = turned - core::f64::consts::TAU * (turned / core::f64::consts::TAU).round();
    assert!(
        (f64::from(state.pose().yaw_rad) - expected).abs() < 1e-5,
        "{:?}",
        state.pose()
    );
}

#[test]
fn the_covariance_stays_positive_definite_in_f32_whatever_is_read() {
    let (kinematics, estimator) = (mecanum::<f32>(), filter::<f32>());
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut state = estimator.start();
    // Known exactly at the start, which is no definite matrix.
    let known = PoseCovariance::diagonal([1e-6; 3]).expect("valid");
    assert!(state.reset(&PlanarPose::origin(), &known));
    let mut twist = [0.0_f64; 3];
    let (mut slips, mut silent, mut stood) = (0, 0, 0);
    for k in 0..100_000 {
        for speed in &mut twist {
            *speed += 0.02 * random.normal() - 2e-3 * *speed;
        }
        let at_rest = k % 10_000 > 7000;
        let [vx_m_s, vy_m_s, wz_rad_s] = twist.map(|speed| if at_rest { 0.0 } else { speed as f32 });
        let mut wheels = kinematics.inverse(&BodyTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        });
        for reading in &mut wheels.rad_s {
            *reading += 0.1 * random.normal() as f32;
            if k % 700 < 200 && !at_rest {
                *reading += 20.0 * random.next() as f32;
                slips += 1;
            }
        }
        let mut input = EstimatorInput::new(&wheels);
        input.commanded_rest = at_rest;
        input.yaw_rate_rad_s = wz_rad_s + 0.01 * random.normal() as f32;
        input.acceleration_m_s2 =
            [random.normal() as f32, random.normal() as f32].map(|a| if at_rest { 0.05 * a } else { a });
        match k % 211 {
            0 => input.yaw_rate_rad_s = f32::NAN,
            1 => input.acceleration_m_s2 = [f32::INFINITY; 2],
            2 => input.wheels.rad_s[k % 4] = f32::NAN,
            3 => input.wheels.rad_s = [f32::NAN; 4],
            4 => input.wheels.rad_s[k % 4] = 9e5,
            _ => {}
        }
        silent += usize::from(k % 211 < 5);
        let step = estimator.step(&mut state, &input);
        stood += usize::from(step.standing);
        assert!(
            step.taken && is_positive(&state),
            "period {k}: {:?}",
            state.covariance
        );
    }
    assert!(
        slips > 10_000 && silent > 2000 && stood > 5000,
        "{slips} {silent} {stood}"
    );
}

#[test]
fn what_nothing_observes_grows() {
    let (kinematics, estimator) = (mecanum::<f64>(), calibrated());
    let mut state = estimator.start();
    let ahead = BodyTwist {
        vx_m_s: 0.5,
        ..BodyTwist::ZERO
    };
    let mut input = EstimatorInput::new(&kinematics.inverse(&ahead));
    (input.yaw_rate_rad_s, input.acceleration_m_s2) = (0.0, [0.0; 2]);
    let mut last = [0.0; 3];
    for _ in 0..20 {
        (0..500).for_each(|_| _ = estimator.step(&mut state, &input));
        let now = state.covariance().standard_deviations();
        assert!((0..3).all(|i| now[i] > last[i]), "{last:?} {now:?}");
        last = now;
    }
    // Yaw by the bias that is not configured, 0.02 rad/s for 10 s.
    assert!((last[2] / 0.2 - 1.0).abs() < 0.05, "{last:?}");
    // The velocity is observed: it does not.
    assert!(state.velocity_covariance()[0][0].sqrt() < 0.01);
}

#[test]
fn who_slides_with_locked_wheels_does_not_stand() {
    let estimator = calibrated();
    let mut state = estimator.start();
    let mut input = EstimatorInput::new(&[0.0; 4].into());
    (input.yaw_rate_rad_s, input.commanded_rest) = (0.0, true);
    // Ice of 0.05 under a vehicle at 0.49 m/s: it stops after a second.
    state.velocity[0] = 0.49;
    input.acceleration_m_s2 = [-0.49, 0.0];
    for k in 0..900 {
        assert!(!estimator.step(&mut state, &input).standing, "period {k}");
    }
    assert!(
        (state.pose().x_m - (0.49 * 0.9 - 0.49 * 0.81 / 2.0)).abs() < 5e-3,
        "{:?}",
        state.pose()
    );
    input.acceleration_m_s2 = [0.0; 2];
    (0..300).for_each(|_| _ = estimator.step(&mut state, &input));
    assert!(estimator.step(&mut state, &input).standing);
}

#[test]
fn one_slipping_wheel_of_four_is_outvoted() {
    let (kinematics, estimator) = (mecanum::<f64>(), calibrated());
    let ahead = BodyTwist {
        vx_m_s: 0.5,
        ..BodyTwist::ZERO
    };
    let mut state = estimator.start();
    for k in 0..2000 {
        let mut wheels = kinematics.inverse(&ahead);
        if k >= 1000 {
            wheels.rad_s[0] += 10.0;
        }
        let mut input = EstimatorInput::new(&wheels);
        input.yaw_rate_rad_s = 0.0;
        input.acceleration_m_s2 = [if k == 0 { 500.0 } else { 0.0 }, 0.0];
        estimator.step(&mut state, &input);
    }
    // By the mean of the wheels it were 10 * 0.076 / 4 = 0.19 m/s more, for a second, ahead, and as much to the right.
    let (twist, pose) = (state.twist(), state.pose());
    assert!(
        (twist.vx_m_s - 0.5).abs() < 0.19 / 20.0 && twist.vy_m_s.abs() < 0.19 / 20.0,
        "{twist:?}"
    );
    assert!(
        (pose.x_m - 1.0).abs() < 0.19 / 20.0 && pose.y_m.abs() < 0.19 / 20.0,
        "{pose:?}"
    );
}

#[test]
fn an_estimate_without_one_wheel_is_as_good() {
    let (kinematics, estimator) = (mecanum::<f64>(), filter::<f64>());
    let twist = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.2,
        wz_rad_s: 0.4,
    };
    let mut state = estimator.start();
    for _ in 0..3000 {
        let mut wheels = kinematics.inverse(&twist);
        wheels.rad_s[2] = f64::NAN;
        let mut input = EstimatorInput::new(&wheels);
        input.yaw_rate_rad_s = 0.4;
        estimator.step(&mut state, &input);
    }
    let found = state.twist();
    assert!(
        (found.vx_m_s - 0.3).abs() < 0.02 && (found.vy_m_s - 0.2).abs() < 0.02,
        "{found:?}"
    );
}

#[test]
fn without_a_gyro_the_wheels_turn_the_vehicle() {
    let (kinematics, estimator) = (mecanum::<f64>(), filter::<f64>());
    let twist = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.0,
        wz_rad_s: 0.4,
    };
    let mut state = estimator.start();
    (0..2000).for_each(|_| _ = estimator.step(&mut state, &EstimatorInput::new(&kinematics.inverse(&twist))));
    assert!((state.pose().yaw_rad - 0.8).abs() < 0.02, "{:?}", state.pose());
    assert_eq!(state.gyro_bias_rad_s(), 0.0);
}

#[test]
fn a_lean_is_levelled_by_the_units_angles() {
    // A base that stands still with its nose and its left side up feels gravity only, which is no acceleration.
    let (pitch, roll) = (0.15_f64, -0.1_f64);
    let axis_z = (1.0 - pitch.sin().powi(2) - roll.sin().powi(2)).sqrt();
    let mut imu = Imu::level();
    (imu.pitch_rad, imu.roll_rad) = (pitch, roll);
    imu.specific_force_m_s2 = [pitch.sin(), roll.sin(), axis_z].map(|up| 9.81 * up);
    // It turns about the vertical by 1 rad/s, and so do all its axes.
    imu.rate_rad_s = [pitch.sin(), roll.sin(), axis_z];
    let input = EstimatorInput::with_imu(&[0.0; 4].into(), &imu, &BodyTwist::ZERO);
    assert!(
        input.acceleration_m_s2.iter().all(|a| a.abs() < 1e-12),
        "{input:?}"
    );
    assert!((input.yaw_rate_rad_s - 1.0).abs() < 1e-12);
    let silent = EstimatorInput::<f64, 4>::with_imu(&[0.0; 4].into(), &Imu::silent(), &BodyTwist::ZERO);
    assert!(silent.acceleration_m_s2[0].is_nan() && silent.yaw_rate_rad_s.is_nan());
}

#[test]
fn what_is_out_of_range_is_named() {
    let refused = |change: fn(&mut EstimatorConfig<f64>)| {
        let mut config = EstimatorConfig::new(1e-3);
        change(&mut config);
        Estimator::new(config, &mecanum()).expect_err("refused").parameter
    };
    assert_eq!(refused(|c| c.period_s = 0.0), "period_s");
    assert_eq!(refused(|c| c.wheel_rad_s = 0.0), "wheel_rad_s");
    assert_eq!(refused(|c| c.slip_s = 1e-4), "slip_s");
    assert_eq!(
        refused(|c| c.bias_walk_rad_s_per_sqrt_s = f64::NAN),
        "bias_walk_rad_s_per_sqrt_s"
    );
    assert_eq!(refused(|c| c.still_m_s2 = -1.0), "still_m_s2");
}
