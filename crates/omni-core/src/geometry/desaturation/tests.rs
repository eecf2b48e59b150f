use super::*;
use crate::geometry::WheelLayout;
use proptest::prelude::*;

fn kinematics() -> Kinematics<f64, 7> {
    Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid")).expect("valid")
}

#[test]
fn a_limit_that_is_not_a_speed_is_refused_with_its_wheel() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = SpeedLimits::new([1.0, bad], Desaturation::Uniform).expect_err("refused");
        assert_eq!((error.parameter, error.index), ("limit_rad_s", Some(1)));
    }
}

#[test]
fn yaw_that_is_impossible_alone_leaves_no_translation() {
    let limits = SpeedLimits::new([1.0; 7], Desaturation::KeepsYaw).expect("valid");
    let twist = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.1,
        wz_rad_s: 1.0,
    };
    let limited = limits.desaturate(&kinematics(), &twist);
    assert_eq!(limited.translation_factor, 0.0);
    // The transverse wheels turn R1 / r = 4.545 rad/s for 1 rad/s of yaw.
    assert!((limited.yaw_factor - 0.066 / 0.30).abs() < 1e-12);
    assert_eq!(limited.limiting, Some(1));
}

#[test]
fn what_fits_is_left_alone_even_where_a_part_alone_would_not() {
    // Wheel 3 turns backwards going forward, and forwards turning left: together it is slow.
    let limits = SpeedLimits::new(
        [9.0, 9.0, 3.0, 9.0, 9.0, 9.0, 3.0],
        Desaturation::KeepsTranslation,
    )
    .expect("valid");
    let twist = BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.0,
        wz_rad_s: 0.6,
    };
    let result = limits.desaturate(&kinematics(), &twist);
    assert_eq!((result.twist, result.limiting), (twist, None));
}

#[test]
fn a_twist_beyond_all_numbers_is_rest() {
    let limits = SpeedLimits::new([9.0; 7], Desaturation::Uniform).expect("valid");
    let absurd = BodyTwist {
        vx_m_s: 1e308,
        vy_m_s: -1e308,
        wz_rad_s: 1e308,
    };
    let result = limits.desaturate(&kinematics(), &absurd);
    assert_eq!(
        (result.twist, result.velocities),
        (BodyTwist::ZERO, WheelVelocities::zero())
    );
}

proptest! {
    #[test]
    fn no_wheel_passes_its_limit_and_nothing_is_given_away(
        vx in -2.0..2.0_f64, vy in -2.0..2.0_f64, wz in -6.0..6.0_f64,
        limits in prop::array::uniform7(0.5..40.0_f64), which in 0..3_usize,
    ) {
        let desaturation = [Desaturation::Uniform, Desaturation::KeepsYaw, Desaturation::KeepsTranslation][which];
        let twist = BodyTwist { vx_m_s: vx, vy_m_s: vy, wz_rad_s: wz };
        let kinematics = kinematics();
        let result = SpeedLimits::new(limits, desaturation).expect("valid").desaturate(&kinematics, &twist);
        let fullest = result.velocities.rad_s.iter().zip(limits).map(|(v, l)| v.abs() / l).fold(0.0, f64::max);
        prop_assert!(fullest <= 1.0 + 1e-12);
        match result.limiting {
            None => prop_assert_eq!(result.twist, twist),
            Some(i) => prop_assert!((result.velocities.rad_s[i].abs() / limits[i] - 1.0).abs() < 1e-12),
        }
        // The velocities are those of the twist; translation keeps its direction.
        for (a, b) in kinematics.inverse(&result.twist).rad_s.iter().zip(result.velocities.rad_s) {
            prop_assert!((a - b).abs() < 1e-12);
        }
        prop_assert!((result.twist.vx_m_s * vy - result.twist.vy_m_s * vx).abs() < 1e-12);
        match desaturation {
            Desaturation::Uniform => prop_assert_eq!(result.translation_factor, result.yaw_factor),
            Desaturation::KeepsYaw => prop_assert!(result.yaw_factor == 1.0 || result.translation_factor == 0.0),
            Desaturation::KeepsTranslation => prop_assert!(result.translation_factor == 1.0 || result.yaw_factor == 0.0),
        }
    }
}
