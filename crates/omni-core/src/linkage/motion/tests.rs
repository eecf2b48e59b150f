use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::linkage::*;
use crate::policy::Imu;

const PITCH: HingeGeometry<f64> = HingeGeometry {
    parent: 0,
    child: 1,
    axis: [0.0, 1.0, 0.0],
    anchor_m: [0.0, 0.0, 0.066],
};
const ROLL: HingeGeometry<f64> = HingeGeometry {
    parent: 0,
    child: 2,
    axis: [1.0, 0.0, 0.0],
    anchor_m: [0.0, 0.0, 0.066],
};

fn wheel(body: usize, x: f64, y: f64) -> CarriedWheel<f64> {
    CarriedWheel {
        body,
        centre_m: [x, y, 0.066],
    }
}

/// The paper's vehicle: wheel 4 on the middle, a row on a frame that pitches, a row on one that rolls.
fn seven() -> [CarriedWheel<f64>; 7] {
    [
        wheel(2, -0.30, -0.23),
        wheel(2, -0.30, 0.0),
        wheel(2, -0.30, 0.23),
        wheel(0, 0.0, 0.0),
        wheel(1, 0.30, -0.23),
        wheel(1, 0.30, 0.0),
        wheel(1, 0.30, 0.23),
    ]
}

fn base(nose_up_rad: f64, left_up_rad: f64) -> Attitude<f64> {
    Attitude {
        nose_up_rad,
        left_up_rad,
        ..Attitude::level()
    }
}

/// Heights above wheel 4, by turning every point in space.
fn exact(nose_up: f64, left_up: f64, hinges: [f64; 2]) -> [f64; 7] {
    // Nose up is a negative turn about y; the left side then stands up by the angle that a roll about x makes.
    let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), -nose_up)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), left_up);
    let front = Rotation3::from_axis_angle(&Vector3::y_axis(), hinges[0]);
    let rear = Rotation3::from_axis_angle(&Vector3::x_axis(), hinges[1]);
    let joint = Vector3::new(0.0, 0.0, 0.066);
    seven().map(|wheel| {
        let arm = Vector3::from(wheel.centre_m) - joint;
        let arm = match wheel.body {
            1 => front * arm,
            2 => rear * arm,
            _ => arm,
        };
        (turned * arm).z
    })
}

fn above_wheel_4(heights: [f64; 7]) -> [f64; 7] {
    heights.map(|height| height - heights[3])
}

proptest! {
    #[test]
    fn in_the_plane_heights_are_those_of_turned_points(nose_up in -0.5..0.5_f64, pitch in -0.5..0.5_f64) {
        let linkage = Linkage::new(&[PITCH, ROLL], &seven()).expect("a tree");
        let motion = linkage.motion(&base(nose_up, 0.0), &[pitch, 0.0], &[0.0; 2]);
        let exact = exact(nose_up, 0.0, [pitch, 0.0]);
        for (height, exact) in above_wheel_4(motion.height_m).iter().zip(above_wheel_4(exact)) {
            // The series of sine ends at the fifth power: 1^7 / 5040 of an arm of 0.3 m at 1 rad.
            prop_assert!((height - exact).abs() < 1e-4, "{height} {exact}");
        }
    }

    #[test]
    fn across_each_other_angles_leave_out_no_more_than_their_product(
        nose_up in -0.2..0.2_f64, left_up in -0.2..0.2_f64, pitch in -0.2..0.2_f64, roll in -0.2..0.2_f64,
    ) {
        let linkage = Linkage::new(&[PITCH, ROLL], &seven()).expect("a tree");
        let motion = linkage.motion(&base(nose_up, left_up), &[pitch, roll], &[0.0; 2]);
        let exact = exact(nose_up, left_up, [pitch, roll]);
        let (nose, left) = (nose_up.abs() + pitch.abs(), left_up.abs() + roll.abs());
        for (height, exact) in above_wheel_4(motion.height_m).iter().zip(above_wheel_4(exact)) {
            // An arm of 0.38 m; half a square of the one angle times the other is the next term.
            let product = 0.38 * nose * left + 1e-4;
            prop_assert!((height - exact).abs() < product, "{height} {exact} {product}");
        }
    }

    #[test]
    fn rises_are_the_rates_of_heights(
        nose_up in -0.3..0.3_f64, left_up in -0.3..0.3_f64, pitch in -0.3..0.3_f64, roll in -0.3..0.3_f64,
        rates in prop::array::uniform4(-2.0..2.0_f64),
    ) {
        let linkage = Linkage::new(&[PITCH, ROLL], &seven()).expect("a tree");
        let at = |dt: f64| {
            let now = Attitude {
                nose_up_rad: nose_up + rates[0] * dt,
                left_up_rad: left_up + rates[1] * dt,
                nose_up_rad_s: rates[0],
                left_up_rad_s: rates[1],
            };
            linkage.motion(&now, &[pitch + rates[2] * dt, roll + rates[3] * dt], &rates[2..])
        };
        let (before, now, after) = (at(-1e-4), at(0.0), at(1e-4));
        let difference = |i: usize| (above_wheel_4(after.height_m)[i] - above_wheel_4(before.height_m)[i]) / 2e-4;
        for i in 0..7 {
            let rise = now.rise_m_s[i] - now.rise_m_s[3];
            // The series of sine and cosine end at different powers: 0.6^6 / 720 of 0.38 m at 4 rad/s.
            prop_assert!((rise - difference(i)).abs() < 1.1e-4, "{i}: {rise} {}", difference(i));
        }
    }

    #[test]
    fn the_order_in_which_hinges_are_given_says_only_whose_reading_is_whose(a in -0.3..0.3_f64, b in -0.3..0.3_f64) {
        // A bogie on a rocker on the base.
        let rocker = HingeGeometry { parent: 0, child: 4, ..PITCH };
        let bogie = HingeGeometry { parent: 4, child: 9, anchor_m: [-0.15, 0.0, 0.08], ..PITCH };
        let wheels = [wheel(4, 0.3, 0.0), wheel(9, 0.0, 0.0), wheel(9, -0.3, 0.0)];
        let one = Linkage::new(&[rocker, bogie], &wheels).expect("a tree").motion(&base(0.0, 0.0), &[a, b], &[]);
        let other = Linkage::new(&[bogie, rocker], &wheels).expect("a tree").motion(&base(0.0, 0.0), &[b, a], &[]);
        prop_assert_eq!(one, other);
    }

    #[test]
    fn wheels_that_stand_are_the_lower_median(rises in prop::array::uniform6(-3..4_i8)) { // few values: many are equal
        let rises = rises.map(f64::from);
        let (mut against, mut sorted) = (rises, rises);
        against_those_that_stand(&mut against);
        sorted.sort_by(f64::total_cmp);
        prop_assert_eq!(against, rises.map(|rise| rise - sorted[2]));
    }

    #[test]
    fn a_wheel_that_rolls_is_never_slower_than_its_push(push in -1.0..1.0_f64, across in -1.0..1.0_f64, rise in -1.0..1.0_f64) {
        let ground = push.hypot(across);
        let rolled = rolled_speed(push, ground, rise);
        prop_assert!(rolled * push >= 0.0 && rolled.abs() >= push.abs() * (1.0 - 1e-12));
        // Nor faster than its centre.
        prop_assert!(rolled.abs() <= ground.hypot(rise) * (1.0 + 1e-12));
    }
}

#[test]
fn rows_of_the_papers_vehicle_rise_as_its_front_frame_turns() {
    let linkage = Linkage::new(&[PITCH, ROLL], &seven()).expect("a tree");
    // The front frame's nose goes up at 0.7 rad/s, 0.1 rad up: R1 cos(phi) phi', and two rows stand.
    let motion = linkage.motion(&base(0.0, 0.0), &[-0.1, 0.0], &[-0.7, 0.0]);
    let expected = 0.30 * 0.1_f64.cos() * 0.7;
    for i in [4, 5, 6] {
        assert!((motion.rise_m_s[i] - expected).abs() < 1e-6);
        assert_eq!(motion.attitude(linkage.carrier(i)).nose_up_rad_s, 0.7);
    }
    for i in [0, 1, 2, 3] {
        assert!(motion.rise_m_s[i].abs() < 1e-12);
        assert_eq!(motion.attitude(linkage.carrier(i)).nose_up_rad_s, 0.0);
    }
    // Wheel 4 climbs: the middle and the rear pitch nose up, the front row keeps its height, and so does the rear.
    let climbing = Attitude {
        nose_up_rad_s: 0.5,
        ..Attitude::level()
    };
    let motion = linkage.motion(&climbing, &[0.0; 2], &[1.0, 0.0]); // the front: nose down against the middle
    assert!(
        (motion.rise_m_s[3] - 0.30 * 0.5).abs() < 1e-12,
        "{:?}",
        motion.rise_m_s
    );
    assert!(motion.rise_m_s[0].abs() < 1e-12 && motion.rise_m_s[6].abs() < 1e-12);
}

#[test]
fn readings_that_are_none_stand_at_zero() {
    let linkage = Linkage::new(&[PITCH, ROLL], &seven()).expect("a tree");
    let silent = linkage.motion(&Attitude::of_imu(&Imu::silent()), &[f64::NAN, f64::INFINITY], &[]);
    assert_eq!(silent, linkage.motion(&Attitude::level(), &[0.0; 2], &[0.0; 2]));
}

#[test]
fn what_is_no_tree_is_refused_with_the_hinge_and_the_key() {
    let build = |hinges: &[HingeGeometry<f64>]| Linkage::new(hinges, &seven()).expect_err("no tree");
    type Case<'a> = (&'a [HingeGeometry<f64>], &'a str, Option<usize>);
    let cases: [Case<'_>; 6] = [
        (
            &[PITCH, HingeGeometry { child: 1, ..ROLL }],
            "hinge.child",
            Some(0),
        ), // carried twice
        (
            &[HingeGeometry {
                child: 0,
                parent: 1,
                ..PITCH
            }],
            "hinge.child",
            Some(0),
        ), // the base is carried
        // Two bodies that carry each other.
        (
            &[
                HingeGeometry { parent: 2, ..PITCH },
                HingeGeometry { parent: 1, ..ROLL },
            ],
            "hinge.parent",
            Some(0),
        ),
        (
            &[
                HingeGeometry {
                    axis: [0.0, 2.0, 0.0],
                    ..PITCH
                },
                ROLL,
            ],
            "hinge.axis",
            Some(0),
        ),
        (
            &[
                PITCH,
                HingeGeometry {
                    anchor_m: [0.0, f64::NAN, 0.0],
                    ..ROLL
                },
            ],
            "hinge.anchor_m",
            Some(1),
        ),
        (&[PITCH], "wheel.body", Some(0)), // nothing carries body 2
    ];
    for (hinges, parameter, index) in cases {
        let error = build(hinges);
        assert_eq!((error.parameter, error.index), (parameter, index), "{error}");
    }
    let many: [_; MAX_HINGES + 1] = core::array::from_fn(|k| HingeGeometry {
        child: k + 1,
        ..PITCH
    });
    assert_eq!((build(&many).parameter, build(&many).value), ("hinges", 9.0));
}
