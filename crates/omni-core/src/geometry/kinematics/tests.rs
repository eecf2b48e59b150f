use super::*;
use crate::geometry::Wheel;
use proptest::prelude::*;
use std::vec;

fn chugo7(r1: f64, r2: f64, map: ForwardMap) -> Kinematics<f64, 7> {
    let layout = WheelLayout::chugo7(r1, r2, 0.066).expect("valid layout");
    Kinematics::with_forward(&layout, map).expect("valid maps")
}

/// Largest difference between two matrices.
fn distance(a: &[[f64; 7]; 3], b: &[[f64; 7]; 3]) -> f64 {
    a.iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(x, y)| (x - y).abs())
        .fold(0.0, f64::max)
}

#[test]
fn inverse_map_is_equation_9_as_printed() {
    let (k, r, r1, r2) = (0.05, 0.066, 0.30, 0.23);
    let wheels = WheelLayout::<f64, 7>::chugo7(r1, r2, r)
        .expect("valid")
        .wheels()
        .map(|w| Wheel { gear: k, ..w });
    let kinematics = Kinematics::new(&WheelLayout::new(wheels).expect("valid")).expect("valid");
    let printed = [
        [1.0, 0.0, r2],
        [0.0, -1.0, r1],
        [-1.0, 0.0, r2],
        [1.0, 0.0, 0.0],
        [1.0, 0.0, r2],
        [0.0, 1.0, r1],
        [-1.0, 0.0, r2],
    ];
    for (row, printed) in kinematics.inverse_matrix().iter().zip(printed) {
        for (x, p) in row.iter().zip(printed) {
            // One multiplication and one division: a few units in the last place of values up to 300.
            assert!((x - p / (k * r)).abs() < 1e-12 / k, "{x} {p}");
        }
    }
}

#[test]
fn average_map_is_equation_7_as_printed() {
    let (r, r1, r2) = (0.066, 0.30, 0.23);
    let (x, y, z2, z1) = (r / 5.0, r / 2.0, r / (6.0 * r2), r / (6.0 * r1));
    let printed = [
        [x, 0.0, -x, x, x, 0.0, -x],
        [0.0, -y, 0.0, 0.0, 0.0, y, 0.0],
        [z2, z1, z2, 0.0, z2, z1, z2],
    ];
    assert!(
        distance(
            chugo7(r1, r2, ForwardMap::PaperAverage).forward_matrix(),
            &printed
        ) < 1e-16
    );
}

#[test]
fn average_map_7_times_inverse_map_9_is_the_identity() {
    for (r1, r2) in [(0.30, 0.23), (0.2, 0.2), (0.1, 0.4)] {
        let kinematics = chugo7(r1, r2, ForwardMap::PaperAverage);
        for j in 0..3 {
            let mut unit = [0.0; 3];
            unit[j] = 1.0;
            let back = kinematics
                .forward(&kinematics.inverse(&BodyTwist::from_array(unit)))
                .to_array();
            for (got, expected) in back.iter().zip(unit) {
                assert!((got - expected).abs() < 1e-15, "J * (9) = I: {back:?}");
            }
        }
    }
}

#[test]
fn equation_9_is_the_moore_penrose_inverse_of_7_only_where_r1_equals_r2() {
    let gap = |r1, r2| {
        let least_squares = chugo7(r1, r2, ForwardMap::LeastSquares);
        distance(
            least_squares.forward_matrix(),
            chugo7(r1, r2, ForwardMap::PaperAverage).forward_matrix(),
        )
    };
    // (9) is the pseudo-inverse of (7) exactly where (7) is the pseudo-inverse of (9).
    assert!(gap(0.25, 0.25) < 1e-15);
    // Yaw row, transverse wheels: least squares r R1 / (4 R2^2 + 2 R1^2), average r / (6 R1).
    let (r, r1, r2) = (0.066, 0.30, 0.23);
    let expected: f64 = r * r1 / (4.0 * r2 * r2 + 2.0 * r1 * r1) - r / (6.0 * r1);
    assert!(
        (gap(r1, r2) - expected).abs() < 1e-15,
        "{} {expected}",
        gap(r1, r2)
    );
    assert!(expected > 0.01, "a quarter of the coefficient, not rounding");
}

#[test]
fn residual_is_what_no_rigid_motion_explains() {
    let kinematics = chugo7(0.35, 0.27, ForwardMap::LeastSquares);
    let rigid = kinematics.inverse(&BodyTwist {
        vx_m_s: 0.3,
        vy_m_s: 0.2,
        wz_rad_s: -0.7,
    });
    assert!(kinematics.residual(&rigid).rad_s.iter().all(|r| r.abs() < 1e-14));
    let mut slipping = rigid;
    slipping.rad_s[3] += 1.0;
    let norm = kinematics
        .residual(&slipping)
        .rad_s
        .iter()
        .map(|r| r * r)
        .sum::<f64>()
        .sqrt();
    assert!((norm - 0.894_427_190_999_915_9).abs() < 1e-12); // sqrt(0.8): wheel 4 is one of five that roll along x
}

#[test]
fn average_is_refused_where_it_is_not_an_inverse() {
    let at = |degrees: f64, reach: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Wheel::omni([reach * cos, reach * sin], [-sin, cos], 0.05)
    };
    let layout = WheelLayout::new([at(0.0, 0.2), at(120.0, 0.3), at(240.0, 0.2)]).expect("rank 3");
    let error = Kinematics::with_forward(&layout, ForwardMap::PaperAverage).expect_err("not a left inverse");
    assert_eq!(error.parameter, "forward_map");
    assert!(Kinematics::new(&layout).is_ok());
}

#[test]
fn weights_outlast_an_exclusion() {
    let layout = WheelLayout::<f64, 4>::omni(0.2, 0.0, 0.05).expect("valid");
    let weighted = Kinematics::weighted(&layout, &[0.25, 1.0, 1.0, 1.0]).expect("valid");
    assert_eq!(weighted.excluding(&[false; 4]), Some(weighted));
}

/// Wheels anywhere within a metre, rolling and rollers any way, that make a layout worth driving.
fn any_layout() -> impl Strategy<Value = WheelLayout<f64, 5>> {
    let wheel = (
        -1.0..1.0_f64,
        -1.0..1.0_f64,
        0.0..6.3_f64,
        -1.2..1.2_f64,
        0.02..0.3_f64,
        0.05..2.0_f64,
        any::<bool>(),
    );
    prop::array::uniform5(wheel).prop_filter_map("ill-conditioned", |wheels| {
        let wheels = wheels.map(|(x, y, direction, roller, radius, gear, reversed)| {
            let (sin, cos) = direction.sin_cos();
            let wheel = Wheel::omni([x, y], [cos, sin], radius).geared(gear);
            let wheel = Wheel {
                roller_angle_rad: roller,
                ..wheel
            };
            if reversed {
                wheel.with_reversed_motor()
            } else {
                wheel
            }
        });
        WheelLayout::new(wheels).ok()
    })
}

/// Largest number, at least 1: what a tolerance in units of rounding is relative to.
fn scale(numbers: &[f64]) -> f64 {
    numbers.iter().fold(1.0, |m, x| m.max(x.abs()))
}

proptest! {
    #[test]
    fn forward_undoes_inverse_for_any_layout_weights_and_paths(
        layout in any_layout(), weights in prop::array::uniform5(0.01..100.0_f64), factors in prop::array::uniform5(0.5..2.0_f64),
        twist in prop::array::uniform3(-2.0..2.0_f64), out in 0..5_usize,
    ) {
        let twist = BodyTwist::from_array(twist);
        let path = PathFactors::new(factors).expect("in range");
        let mut maps = vec![Kinematics::new(&layout).expect("valid")];
        maps.extend(Kinematics::weighted(&layout, &weights));
        maps.extend(maps[0].excluding(&core::array::from_fn(|i| i == out)));
        for kinematics in maps {
            let wheels = path.of_wheels(&kinematics.inverse(&twist));
            let back = kinematics.forward(&path.of_body(&wheels)).to_array();
            // Condition up to 100 with the weights in it, squared by the normal equations, a dozen roundings.
            let tolerance = 1e-16 * 1e4 * 12.0;
            for (got, expected) in back.iter().zip(twist.to_array()) {
                prop_assert!((got - expected).abs() < tolerance, "{got} {expected}");
            }
            let again = kinematics.project_along(&wheels, &path).rad_s;
            for (a, b) in again.iter().zip(wheels.rad_s) {
                prop_assert!((a - b).abs() < tolerance * scale(&wheels.rad_s) * 10.0);
            }
        }
    }

    #[test]
    fn both_maps_are_linear_and_the_residual_is_a_projection(
        layout in any_layout(), a in prop::array::uniform5(-9.0..9.0_f64), b in prop::array::uniform5(-9.0..9.0_f64), k in -3.0..3.0_f64,
    ) {
        let kinematics = Kinematics::new(&layout).expect("valid");
        let sum: [f64; 5] = core::array::from_fn(|i| a[i] + k * b[i]);
        let (fa, fb, fs) = (kinematics.forward(&a.into()), kinematics.forward(&b.into()), kinematics.forward(&sum.into()));
        let size = scale(&fa.to_array()).max(scale(&fb.to_array())) * 4.0;
        for ((x, y), z) in fa.to_array().iter().zip(fb.to_array()).zip(fs.to_array()) {
            prop_assert!((x + k * y - z).abs() < 1e-13 * size);
        }
        let (ia, ib, is) = (kinematics.inverse(&fa).rad_s, kinematics.inverse(&fb).rad_s, kinematics.inverse(&fs).rad_s);
        for i in 0..5 {
            prop_assert!((ia[i] + k * ib[i] - is[i]).abs() < 1e-11 * scale(&ia).max(scale(&ib)));
        }
        // (I - A A+)^2 = I - A A+, and what is left determines no motion.
        let once = kinematics.residual(&a.into());
        let twice = kinematics.residual(&once);
        for (x, y) in once.rad_s.iter().zip(twice.rad_s) {
            prop_assert!((x - y).abs() < 1e-9); // condition 100, squared, of numbers below 100
        }
        let sum: f64 = kinematics.redundancy().iter().sum();
        prop_assert!((sum - 2.0).abs() < 1e-9, "five wheels check twice: {sum}");
    }

    #[test]
    fn least_squares_has_the_smallest_residual(
        layout in any_layout(), velocities in prop::array::uniform5(-9.0..9.0_f64), other in prop::array::uniform3(-0.1..0.1_f64),
    ) {
        let kinematics = Kinematics::new(&layout).expect("valid");
        let best = kinematics.forward(&velocities.into());
        let error = |t: &BodyTwist<f64>| {
            kinematics.inverse(t).rad_s.iter().zip(velocities).map(|(a, v)| (a - v) * (a - v)).sum::<f64>()
        };
        let [x, y, w] = best.to_array();
        let moved = BodyTwist::from_array([x + other[0], y + other[1], w + other[2]]);
        prop_assert!(error(&best) <= error(&moved) * (1.0 + 1e-12) + 1e-9);
    }

    #[test]
    fn forward_undoes_inverse_and_f32_follows_f64(
        r1 in 0.05..1.0, r2 in 0.05..1.0, radius in 0.02..0.2, vx in -2.0..2.0, vy in -2.0..2.0, wz in -3.0..3.0,
    ) {
        let twist = BodyTwist { vx_m_s: vx, vy_m_s: vy, wz_rad_s: wz };
        let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(r1, r2, radius).expect("valid")).expect("valid");
        let wheels = kinematics.inverse(&twist);
        let back = kinematics.forward(&wheels);
        for (got, expected) in back.to_array().iter().zip(twist.to_array()) {
            // Condition below 20 after scaling, numbers below 3.
            prop_assert!((got - expected).abs() < 1e-13);
        }
        let layout = WheelLayout::<f32, 7>::chugo7(r1 as f32, r2 as f32, radius as f32).expect("valid");
        let single = Kinematics::new(&layout).expect("valid");
        let wheels32 = single.inverse(&BodyTwist { vx_m_s: vx as f32, vy_m_s: vy as f32, wz_rad_s: wz as f32 });
        for (a, b) in wheels32.rad_s.iter().zip(wheels.rad_s) {
            // A dozen roundings of 6e-8 each on sums of up to three terms that may cancel.
            prop_assert!((f64::from(*a) - b).abs() < 1e-6 * (5.0 / radius));
        }
    }
}
