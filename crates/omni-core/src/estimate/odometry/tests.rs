use super::*;
use crate::geometry::{BodyTwist, WheelLayout};
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use proptest::prelude::*;

const PERIOD_S: f64 = 1e-3;

fn kinematics<R: Real>() -> Kinematics<R, 7> {
    let layout = WheelLayout::chugo7(R::of(0.30), R::of(0.23), R::of(0.066)).expect("valid layout");
    Kinematics::new(&layout).expect("valid maps")
}

fn odometry<R: Real>() -> Odometry<R, 7> {
    Odometry::new(R::of(PERIOD_S)).expect("valid period")
}

fn displacement(dx_m: f64, dy_m: f64, dyaw_rad: f64) -> BodyDisplacement<f64> {
    BodyDisplacement { dx_m, dy_m, dyaw_rad }
}

/// A winding path at 0.3 m/s, at up to 20 degrees to where the vehicle looks, on a mean turn. No
/// period is a multiple of another.
fn winding(t: f64, mean_turn_rad_s: f64) -> BodyTwist<f64> {
    let slip = 0.35 * (TAU * t / 23.7).sin();
    BodyTwist {
        vx_m_s: 0.3 * slip.cos(),
        vy_m_s: 0.3 * slip.sin(),
        wz_rad_s: mean_turn_rad_s + 0.4 * (TAU * t / 17.3).sin(),
    }
}

/// Metres and radians between an `f32` pose and the `f64` one.
fn apart(single: &PlanarPose<f32>, double: &PlanarPose<f64>) -> (f64, f64) {
    let (dx, dy) = (
        f64::from(single.x_m) - double.x_m,
        f64::from(single.y_m) - double.y_m,
    );
    let turned = f64::from(single.yaw_rad) - double.yaw_rad;
    (dx.hypot(dy), turned.wrapped_angle().abs())
}

/// Largest distance \[m\] and angle \[rad\] from `f64` in 1,000,000 steps: `f32` from velocities, from positions, and
/// without compensation.
fn drift_over_300_m(path: impl Fn(f64) -> BodyTwist<f64>) -> [(f64, f64); 3] {
    let (k32, k64) = (kinematics::<f32>(), kinematics::<f64>());
    let (o32, o64) = (odometry::<f32>(), odometry::<f64>());
    let mut double = OdometryState::default();
    let (mut by_velocity, mut by_position) = (OdometryState::default(), OdometryState::default());
    let mut plain = PlanarPose::<f32>::origin();
    let mut positions = [0.0; 7];
    o32.step_positions(&mut by_position, &k32, &WheelAngles::zero());
    let mut worst = [(0.0_f64, 0.0_f64); 3];
    for step in 0..1_000_000_u32 {
        let velocities = k64.inverse(&path(PERIOD_S * (f64::from(step) + 0.5)));
        o64.step_velocities(&mut double, &k64, &velocities);
        let single = WheelVelocities {
            rad_s: velocities.rad_s.map(|v| v as f32),
        };
        o32.step_velocities(&mut by_velocity, &k32, &single);
        for (position, velocity) in positions.iter_mut().zip(velocities.rad_s) {
            *position += velocity * PERIOD_S;
        }
        o32.step_positions(&mut by_position, &k32, &positions.map(|p| p as f32).into());
        plain = plain.moved_by(&k32.forward(&single).over(PERIOD_S as f32));
        plain.yaw_rad = plain.yaw_rad.wrapped_angle();
        if step % 100 == 99 {
            let found = [by_velocity.pose(), by_position.pose(), plain].map(|p| apart(&p, &double.pose()));
            for (worst, found) in worst.iter_mut().zip(found) {
                *worst = (worst.0.max(found.0), worst.1.max(found.1));
            }
        }
    }
    worst
}

#[test]
fn compensated_f32_odometry_keeps_to_f64_over_300_m() {
    let straight = BodyTwist::from_array([0.3, 0.0, 0.0]);
    // Measured, in metres from velocities, from positions, uncompensated:
    for (drift, least_plain_m) in [
        // 4.8e-6, 2.8e-5, 3.9e-4: circles of 6 m radius, numbers stay small.
        (drift_over_300_m(|t| winding(t, 0.05)), 2e-4),
        // 4.9e-5, 1.4e-4, 3.6e-2: away from the origin, roundings mostly average out.
        (drift_over_300_m(|t| winding(t, 0.0)), 2e-2),
        // 5.7e-5, 7.6e-5, 2.6: straight, every step rounds the same way.
        (drift_over_300_m(|_| straight), 2.0),
    ] {
        let [velocity, position, plain] = drift;
        let path_m = 300.0;
        assert!(velocity.0 < 1e-4 * path_m && velocity.1 < 1e-4, "{drift:?}");
        assert!(position.0 < 1e-4 * path_m && position.1 < 1e-4, "{drift:?}");
        // Ten times tighter than the law above: what the documentation states.
        assert!(velocity.0 < 6e-5 && position.0 < 1.5e-4, "{drift:?}");
        assert!(plain.0 > least_plain_m, "the comparison sees rounding: {drift:?}");
    }
}

#[test]
fn steps_at_a_constant_twist_add_up_to_one_arc() {
    let (kinematics, odometry) = (kinematics(), odometry());
    let twist = BodyTwist::<f64>::from_array([0.3, -0.2, 0.7]);
    let mut state = OdometryState::default();
    for _ in 0..2000 {
        odometry.step_velocities(&mut state, &kinematics, &kinematics.inverse(&twist));
    }
    let arc = PlanarPose::origin().moved_by(&twist.over(2.0));
    // The maps are inverse within 1e-15, the sums are exact but for their last rounding.
    let pose = state.pose();
    assert!((pose.x_m - arc.x_m).abs() < 1e-14 && (pose.y_m - arc.y_m).abs() < 1e-14);
    assert!((pose.yaw_rad - arc.yaw_rad).abs() < 1e-14);
}

#[test]
fn thousands_of_turns_leave_an_f32_heading_accurate() {
    let (o32, o64) = (odometry::<f32>(), odometry::<f64>());
    let (mut single, mut double) = (OdometryState::default(), OdometryState::default());
    for k in 0..200_000 {
        // On average 0.37 rad forward, exactly the same in both.
        let dyaw_rad = if k % 3 == 0 { -0.37_f32 } else { 0.74 };
        o32.step_displacement(
            &mut single,
            &BodyDisplacement {
                dyaw_rad,
                ..BodyDisplacement::zero()
            },
        );
        o64.step_displacement(&mut double, &displacement(0.0, 0.0, f64::from(dyaw_rad)));
        let yaw = single.pose().yaw_rad;
        assert!(yaw > -core::f32::consts::PI && yaw <= core::f32::consts::PI);
        // Half a unit in the last place of a number below pi is 1.2e-7, and it does not grow over 11,777 turns.
        let (_, off) = apart(&single.pose(), &double.pose());
        assert!(off < 1.3e-7, "{k}: {off}");
    }
}

#[test]
fn headings_next_to_the_seam_stay_in_their_range() {
    let odometry = odometry::<f64>();
    for yaw in [PI, PI.next_down(), -PI, (-PI).next_up()] {
        for turn in [4e-16, 8e-16, 1e-15, -4e-16, -8e-16, -1e-15, PI, -PI, TAU, -TAU] {
            let mut state = OdometryState::default();
            assert!(state.reset(&PlanarPose {
                yaw_rad: yaw,
                ..PlanarPose::origin()
            }));
            odometry.step_displacement(&mut state, &displacement(0.0, 0.0, turn));
            let after = state.pose().yaw_rad;
            assert!(after > -PI && after <= PI, "{yaw} {turn} {after}");
            // Same direction: sums of numbers up to 2 pi.
            assert!(
                (after.sin() - (yaw + turn).sin()).abs() < 2e-15,
                "{yaw} {turn} {after}"
            );
        }
    }
}

#[test]
fn first_positions_only_start_and_a_reset_never_jumps() {
    let (kinematics, odometry) = (kinematics(), odometry());
    let mut state = OdometryState::default();
    let positions = [812.3, -44.0, 17.5, 1e4, -3e3, 0.0, 2.0].into();
    let started = odometry.step_positions(&mut state, &kinematics, &positions);
    assert_eq!(started, OdometryStep::Started);
    assert_eq!(state.pose(), PlanarPose::origin());
    let pose = PlanarPose {
        x_m: 4.0,
        y_m: -7.0,
        yaw_rad: 3.0,
    };
    assert!(state.reset(&pose));
    odometry.step_positions(&mut state, &kinematics, &positions);
    assert_eq!(state.pose(), pose);
    // Encoders set to zero are a jump of theirs, unless said.
    state.forget_positions();
    odometry.step_positions(&mut state, &kinematics, &WheelAngles::zero());
    assert_eq!(state.pose(), pose);
}

#[test]
fn readings_that_are_not_finite_change_nothing_and_positions_catch_up() {
    let (kinematics, odometry) = (kinematics(), odometry());
    let twist = BodyTwist::from_array([0.3, 0.1, 0.5]);
    let at = |seconds: f64| WheelAngles {
        rad: kinematics.inverse(&twist).rad_s.map(|v| 100.0 + v * seconds),
    };
    let mut state = OdometryState::default();
    odometry.step_positions(&mut state, &kinematics, &at(0.0));
    odometry.step_positions(&mut state, &kinematics, &at(0.1));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for wheel in 0..7 {
            let before = state;
            let mut readings = at(0.2);
            readings.rad[wheel] = bad;
            let step = odometry.step_positions(&mut state, &kinematics, &readings);
            assert_eq!((step, state), (OdometryStep::Skipped, before));
            let step = odometry.step_velocities(&mut state, &kinematics, &readings.rad.into());
            assert_eq!((step, state), (OdometryStep::Skipped, before));
        }
    }
    for field in 0..3 {
        let (before, mut bad) = (state, [0.1; 3]);
        bad[field] = f64::NAN;
        let step = odometry.step_displacement(&mut state, &BodyDisplacement::from_array(bad));
        assert_eq!((step, state), (OdometryStep::Skipped, before));
    }
    odometry.step_positions(&mut state, &kinematics, &at(0.3));
    let arc = PlanarPose::origin().moved_by(&twist.over(0.3));
    // Differences of positions near 100 rad are off by 1.4e-14 rad.
    assert!((state.pose().x_m - arc.x_m).abs() < 1e-14 && (state.pose().yaw_rad - arc.yaw_rad).abs() < 1e-13);
}

#[test]
fn a_slipping_wheel_left_out_does_not_move_the_pose() {
    let (full, odometry) = (kinematics(), odometry());
    let mut excluded = [false; 7];
    excluded[3] = true;
    let without_4 = full
        .excluding(&excluded)
        .expect("six wheels determine the motion");
    let mut turned = full
        .inverse(&BodyTwist::from_array([0.3, 0.0, FRAC_PI_2]))
        .over(1.0);
    turned.rad[3] += 5.0;
    let end = |kinematics| {
        let mut state = OdometryState::default();
        odometry.step_positions(&mut state, kinematics, &WheelAngles::zero());
        odometry.step_positions(&mut state, kinematics, &turned);
        state.pose()
    };
    let truth = PlanarPose::origin().moved_by(&displacement(0.3, 0.0, FRAC_PI_2));
    assert!((end(&without_4).x_m - truth.x_m).abs() < 1e-14);
    // A fifth of 5 rad times 0.066 m, along a quarter turn: 0.066 * 0.9 * cos(45 deg) each way.
    assert!((end(&full).x_m - truth.x_m).abs() > 0.04);
}

#[test]
fn period_is_checked_by_name() {
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Odometry::<f64, 7>::new(period).expect_err("refused");
        assert_eq!(error.parameter, "period_s");
    }
}

proptest! {
    #[test]
    fn any_finite_displacements_leave_a_finite_pose(
        bits in prop::array::uniform3(any::<u32>()), again in prop::array::uniform3(any::<u32>()),
    ) {
        let odometry = odometry::<f32>();
        let mut state = OdometryState::default();
        for bits in [bits, again, bits] {
            let moved = BodyDisplacement::from_array(bits.map(f32::from_bits));
            let before = state;
            let step = odometry.step_displacement(&mut state, &moved);
            let pose = state.pose();
            prop_assert!(pose.x_m.is_finite() && pose.y_m.is_finite());
            prop_assert!(pose.yaw_rad > -core::f32::consts::PI && pose.yaw_rad <= core::f32::consts::PI);
            if moved.to_array().iter().any(|d| !d.is_finite()) {
                prop_assert!(step == OdometryStep::Skipped && state == before);
            }
        }
    }

    #[test]
    fn positions_and_velocities_give_the_same_pose(
        twists in prop::collection::vec(prop::array::uniform3(-2.0..2.0_f64), 1..50),
        start in prop::array::uniform7(-100.0..100.0_f64),
    ) {
        let (kinematics, odometry) = (kinematics(), odometry());
        let (mut by_velocity, mut by_position) = (OdometryState::default(), OdometryState::default());
        let mut positions = start;
        odometry.step_positions(&mut by_position, &kinematics, &positions.into());
        for twist in twists {
            let velocities = kinematics.inverse(&BodyTwist::from_array(twist));
            for (p, v) in positions.iter_mut().zip(velocities.rad_s) {
                *p += v * PERIOD_S;
            }
            odometry.step_velocities(&mut by_velocity, &kinematics, &velocities);
            odometry.step_positions(&mut by_position, &kinematics, &positions.into());
        }
        let (a, b) = (by_velocity.pose(), by_position.pose());
        // Positions near 100 rad are rounded to 1.4e-14 rad, 50 times; a radian is at most 0.2 rad or 0.07 m of motion.
        prop_assert!((a.x_m - b.x_m).abs() < 1e-12 && (a.y_m - b.y_m).abs() < 1e-12);
        prop_assert!((a.yaw_rad - b.yaw_rad).abs() < 1e-12);
    }
}
