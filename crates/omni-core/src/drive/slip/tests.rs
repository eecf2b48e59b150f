use super::*;
use crate::geometry::WheelLayout;
use proptest::prelude::*;

const CONFIG: SlipConfig<f64> = SlipConfig {
    enter_rad_s: 1.0,
    leave_rad_s: 0.5,
    enter_periods: 5,
    leave_periods: 10,
};

fn kinematics() -> Kinematics<f64, 7> {
    Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid")).expect("valid")
}

fn twist(vx: f64, vy: f64, wz: f64) -> BodyTwist<f64> {
    BodyTwist {
        vx_m_s: vx,
        vy_m_s: vy,
        wz_rad_s: wz,
    }
}

/// Steps until `periods` have passed with `slip` added to the wheels; the last sample.
fn run(state: &mut SlipState<f64, 7>, slip: [f64; 7], periods: usize) -> SlipSample<f64, 7> {
    let (kinematics, detector) = (kinematics(), SlipDetector::new(CONFIG).expect("valid"));
    let mut wheels = kinematics.inverse(&twist(0.3, -0.1, 0.4));
    for (w, s) in wheels.rad_s.iter_mut().zip(slip) {
        *w += s;
    }
    let mut sample = detector.step(&kinematics, state, &wheels);
    for _ in 1..periods {
        sample = detector.step(&kinematics, state, &wheels);
    }
    sample
}

#[test]
fn a_slipping_wheel_is_named_left_out_and_let_in_again_with_hysteresis() {
    for wheel in [0, 2, 3, 4, 6] {
        let slip = |s: f64| core::array::from_fn(|i| if i == wheel { s } else { 0.0 });
        let mut state = SlipState::new(&kinematics());
        assert_eq!(run(&mut state, slip(1.2), 4).excluded, [false; 7]);
        let expected: [bool; 7] = core::array::from_fn(|i| i == wheel);
        assert_eq!(
            run(&mut state, slip(1.2), 1).excluded,
            expected,
            "wheel {}",
            wheel + 1
        );
        // Between the thresholds it stays out, and the estimate is what the others say.
        let sample = run(&mut state, slip(0.7), 100);
        assert_eq!(sample.excluded, expected);
        assert!(
            (sample.estimated.vx_m_s - 0.3).abs() < 1e-12 && (sample.slip_rad_s[wheel] - 0.7).abs() < 1e-12
        );
        run(&mut state, slip(0.3), 9);
        assert_eq!(run(&mut state, slip(0.3), 1).excluded, [false; 7]);
    }
}

#[test]
fn two_slipping_wheels_are_left_out_one_after_the_other() {
    let mut state = SlipState::new(&kinematics());
    let sample = run(&mut state, [0.0, 0.0, 3.0, 0.0, 5.0, 0.0, 0.0], 20);
    assert_eq!(sample.excluded, [false, false, true, false, true, false, false]);
    assert!((sample.estimated.vx_m_s - 0.3).abs() < 1e-12);
}

#[test]
fn three_wheels_exclude_none() {
    let kinematics =
        Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05).expect("valid")).expect("valid");
    let detector = SlipDetector::new(CONFIG).expect("valid");
    let mut state = SlipState::new(&kinematics);
    for _ in 0..100 {
        let sample = detector.step(&kinematics, &mut state, &[50.0, -3.0, 8.0].into());
        assert_eq!((sample.excluded, sample.slip_rad_s), ([false; 3], [0.0; 3]));
    }
    assert!(
        !state.declare(&kinematics, &[true, false, false]),
        "two wheels do not determine three motions"
    );
    assert_eq!(state.excluded(), [false; 3]);
}

#[test]
fn a_disagreement_that_fits_several_wheels_accuses_none_of_them() {
    // Four wheels check once: whichever slips, every residual has the same size.
    let four = Kinematics::new(&WheelLayout::mecanum4(0.5, 0.4, 0.05).expect("valid")).expect("valid");
    assert!(four.redundancy().iter().all(|r: &f64| (r - 0.25).abs() < 1e-12));
    let mut wheels = four.inverse(&twist(0.5, 0.0, 0.0));
    wheels.rad_s[2] += 2.0;
    let detector = SlipDetector::new(CONFIG).expect("valid");
    let mut state = SlipState::new(&four);
    for _ in 0..100 {
        let sample = detector.step(&four, &mut state, &wheels);
        assert!(sample.unattributed && sample.excluded == [false; 4]);
        assert!(
            sample
                .residual
                .rad_s
                .iter()
                .all(|r| (r.abs() - 0.5).abs() < 1e-12)
        );
    }
    // Wheels 2 and 6 alone measure lateral motion; the others check only their sum, which is yaw.
    for wheel in [1, 5] {
        let slip = core::array::from_fn(|i| if i == wheel { 9.0 } else { 0.0 });
        let sample = run(&mut SlipState::new(&kinematics()), slip, 100);
        assert!(sample.unattributed && sample.excluded == [false; 7]);
        assert!((sample.slip_rad_s[wheel] - 9.0).abs() < 1e-12);
    }
}

#[test]
fn declared_wheels_stay_out_and_slipping_ones_come_back_to_help() {
    let kinematics = kinematics();
    let mut state = SlipState::new(&kinematics);
    run(&mut state, [0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0], 10);
    assert!(state.excluded()[3]);
    // With the side wheels lifted, wheel 4, slipping or not, is the only one left that measures forward motion.
    let mut lifted = [true, false, true, false, true, false, true];
    assert!(state.declare(&kinematics, &lifted));
    assert_eq!(state.excluded(), lifted);
    lifted[3] = true;
    assert!(
        !state.declare(&kinematics, &lifted),
        "no wheel left that measures forward motion"
    );
    assert!(state.declare(&kinematics, &[false; 7]) && state.excluded() == [false; 7]);
}

#[test]
fn the_map_as_chosen_is_in_use_while_every_wheel_is_trusted() {
    let layout = WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066).expect("valid");
    let average =
        Kinematics::with_forward(&layout, crate::geometry::ForwardMap::PaperAverage).expect("valid");
    let mut state = SlipState::new(&average);
    assert!(state.declare(&average, &[true, false, false, false, false, false, false]));
    assert!(state.observed().forward_matrix() != average.forward_matrix());
    assert!(state.declare(&average, &[false; 7]));
    assert_eq!(state.observed(), &average);
}

#[test]
fn thresholds_and_times_are_checked_by_name() {
    let named = |config| SlipDetector::<f64>::new(config).expect_err("refused").parameter;
    assert_eq!(
        named(SlipConfig {
            enter_rad_s: 0.0,
            ..CONFIG
        }),
        "enter_rad_s"
    );
    assert_eq!(
        named(SlipConfig {
            enter_rad_s: f64::NAN,
            ..CONFIG
        }),
        "enter_rad_s"
    );
    assert_eq!(
        named(SlipConfig {
            leave_rad_s: 1.1,
            ..CONFIG
        }),
        "leave_rad_s"
    );
    assert_eq!(
        named(SlipConfig {
            enter_periods: 0,
            ..CONFIG
        }),
        "enter_periods"
    );
    assert_eq!(
        named(SlipConfig {
            leave_periods: 0,
            ..CONFIG
        }),
        "leave_periods"
    );
}

proptest! {
    #[test]
    fn the_largest_w_is_the_one_wheel_that_slips(
        which in 0..5_usize, slip in 1.0..50.0_f64, negative: bool, vx in -1.0..1.0_f64, vy in -1.0..1.0_f64, wz in -2.0..2.0_f64,
    ) {
        let (kinematics, detector) = (kinematics(), SlipDetector::new(SlipConfig { enter_periods: 1, ..CONFIG }).expect("valid"));
        let wheel = [0, 2, 3, 4, 6][which];
        let slip = if negative { -slip } else { slip } * 1.001;
        let mut wheels = kinematics.inverse(&twist(vx, vy, wz));
        wheels.rad_s[wheel] += slip;
        let sample = detector.step(&kinematics, &mut SlipState::new(&kinematics), &wheels);
        prop_assert!((sample.slip_rad_s[wheel] - slip).abs() < 1e-10);
        prop_assert_eq!(sample.excluded.iter().position(|e| *e), Some(wheel));
    }
}
