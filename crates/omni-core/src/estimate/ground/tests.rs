use std::string::ToString;
use std::vec::Vec;

use super::edges::{Contact, WheelPath, edge_normal};
use super::*;
use crate::BodyTwist;
use crate::Real;
use crate::estimate::estimator::tests::Random;
use crate::geometry::Wheel;
use crate::linkage::{CarriedWheel, HingeGeometry};
use crate::policy::Imu;

pub(super) const PERIOD_S: f64 = 0.005;
pub(super) const SPEED_M_S: f64 = 0.3;

pub(super) fn rigid<R: Real, const N: usize>(layout: &WheelLayout<R, N>) -> GroundOdometry<R, N> {
    let carried = |wheel: Wheel<R>| {
        let [x, y] = wheel.position_m;
        CarriedWheel {
            body: 0,
            centre_m: [x, y, wheel.radius_m],
        }
    };
    let linkage = Linkage::new(&[], &layout.wheels().map(carried)).expect("valid");
    let estimator = EstimatorConfig::new(R::of(PERIOD_S));
    GroundOdometry::new(GroundOdometryConfig::new(), estimator, layout, linkage).expect("valid")
}

pub(super) fn four<R: Real>() -> WheelLayout<R, 4> {
    WheelLayout::mecanum4(R::of(0.5), R::of(0.4), R::of(0.076)).expect("valid")
}

/// Height of the middle of a wheelbase of 0.5 m, and its angle, on a slope that begins at 0.6 m: front and rear wheels
/// are on the ground.
fn on_slope(x: f64, slope: f64) -> (f64, f64) {
    let ground = |x: f64| if x > 0.6 { slope * (x - 0.6) } else { 0.0 };
    let (front, rear) = (ground(x + 0.25), ground(x - 0.25));
    ((front + rear) / 2.0, ((front - rear) / 0.5).atan())
}

/// Up a slope for 9 s, with noise of gyros, accelerometer and wheels: errors of the height and of x at the end, and the
/// slope of the ground.
fn up<R: Real>(slope: f64, noise: f64, seed: u64) -> (f64, f64, f64) {
    let layout = four::<R>();
    let odometry = rigid(&layout);
    let mut state = odometry.start();
    // Spread over all bits: the first numbers of small seeds are alike.
    let mut noise_of = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let (mut x, mut speed, mut before) = (0.0, 0.0, 0.0);
    let mut truth = 0.0;
    for k in 0..2600 {
        let standing = k < 800;
        if !standing {
            speed = f64::min(speed + 1.0 * PERIOD_S, SPEED_M_S);
        }
        // The horizontal speed is the cosine of the lean times the speed along the slope.
        let (_, lean) = on_slope(x, slope);
        let level = speed * lean.cos();
        x += level * PERIOD_S;
        let (height, lean) = on_slope(x, slope);
        truth = height;
        let mut imu = Imu::silent();
        let rate = (lean - before) / PERIOD_S;
        let push = if standing || speed >= SPEED_M_S { 0.0 } else { 1.0 };
        let middle = f64::midpoint(lean, before);
        before = lean;
        let mut noisy = |value: f64, deviation: f64| R::of(value + noise * deviation * noise_of.normal());
        imu.rate_rad_s = [noisy(0.0, 0.014), noisy(-rate, 0.014), noisy(0.0, 0.014)];
        let (sin, cos) = middle.sin_cos();
        imu.specific_force_m_s2 = [
            noisy(9.81 * sin + push * cos, 0.05),
            noisy(0.0, 0.05),
            noisy(9.81 * cos, 0.05),
        ];
        // An encoder measures the wheel relative to its carrier: nose up turns it backwards.
        let wheels = [(); 4].map(|()| noisy(speed / 0.076 + rate, 0.05));
        let vx_m_s = R::of(if standing { 0.0 } else { SPEED_M_S });
        let command = BodyTwist {
            vx_m_s,
            ..BodyTwist::ZERO
        };
        let input = GroundInput::new(&wheels.into(), &imu, &command);
        assert!(odometry.step(&mut state, &input).taken);
    }
    let [found_x, _, found] = state.pose().position_m.map(Real::as_f64);
    (found - truth, found_x - x, state.pose().slope[0].as_f64())
}

#[test]
fn a_vehicle_that_rolls_up_a_slope_rises_by_it() {
    for slope in [0.0, 0.1, -0.1] {
        let (off, off_x, found) = up::<f64>(slope, 0.0, 1);
        // Some 190 mm high: cells average over 2 cm where the slope begins, and rates over 15 ms.
        assert!(off.abs() < 2e-3 && off_x.abs() < 10e-3, "{slope}: {off} {off_x}");
        assert!((found - slope).abs() < 1e-3, "{slope}: {found}");
    }
}

#[test]
fn noise_of_zero_mean_changes_neither_height_nor_distance() {
    let seeds = 12;
    let all: [(f64, f64, f64); 12] = core::array::from_fn(|seed| up::<f64>(0.0, 1.0, 77 + seed as u64));
    let mean = |of: fn(&(f64, f64, f64)) -> f64| all.iter().map(of).sum::<f64>() / f64::from(seeds);
    let deviation = (all.iter().map(|each| each.0 * each.0).sum::<f64>() / f64::from(seeds)).sqrt();
    // A mean of twelve is within 2.6 of its standard deviations; each error is 1 mm.
    assert!(
        mean(|each| each.0).abs() < 2.6 * deviation / 12.0_f64.sqrt(),
        "{deviation}"
    );
    assert!(deviation < 2e-3, "{deviation}");
    assert!(mean(|each| each.1).abs() < 1e-3);
}

#[test]
fn single_precision_is_within_a_tenth_of_a_millimetre_of_double() {
    for slope in [0.0, 0.1] {
        let (single, double) = (up::<f32>(slope, 1.0, 5), up::<f64>(slope, 1.0, 5));
        assert!((single.0 - double.0).abs() < 1e-4, "{single:?} {double:?}");
        assert!((single.1 - double.1).abs() < 1e-4, "{single:?} {double:?}");
    }
}

/// Forward at 0.3 m/s on flat ground for 5 s, with readings that `change` has modified.
fn forward<const N: usize>(
    layout: &WheelLayout<f64, N>,
    change: impl Fn(usize, &mut [f64; N], &mut Imu<f64>),
) -> (GroundOdometryState<f64, N>, bool) {
    let odometry = rigid(layout);
    let mut state = odometry.start();
    let kinematics = Kinematics::new(layout).expect("valid");
    let command = BodyTwist {
        vx_m_s: SPEED_M_S,
        ..BodyTwist::ZERO
    };
    let mut follows = true;
    for k in 0..1000 {
        let vx_m_s = SPEED_M_S * f64::min((k + 1) as f64 / 60.0, 1.0);
        let mut wheels = kinematics
            .inverse(&BodyTwist {
                vx_m_s,
                ..BodyTwist::ZERO
            })
            .rad_s;
        let mut imu = Imu::level();
        imu.specific_force_m_s2[0] = if k < 60 { 1.0 } else { 0.0 };
        change(k, &mut wheels, &mut imu);
        follows = odometry
            .step(&mut state, &GroundInput::new(&wheels.into(), &imu, &command))
            .follows;
    }
    (state, follows)
}

/// Distance of [`forward`], whose first period only starts \[m\].
const DISTANCE_M: f64 = SPEED_M_S * PERIOD_S * (1000.0 - 29.5);

#[test]
fn a_wheel_without_reading_is_left_out() {
    let (state, _) = forward(&four(), |k, wheels, _| {
        if k > 200 {
            wheels[1] = f64::NAN;
        }
    });
    assert!((state.pose().position_m[0] - DISTANCE_M).abs() < 1e-3);
}

#[test]
fn jumps_of_an_encoder_move_neither_place_nor_height() {
    for size in [30.0, 3e4] {
        let (state, _) = forward(&four(), |k, wheels, _| {
            if k > 200 && k % 50 == 0 {
                wheels[(k / 50) % 4] += size;
            }
        });
        let [x, y, z] = state.pose().position_m;
        assert!(
            (x - DISTANCE_M).abs() < 1e-3 && y.abs() < 1e-3 && z.abs() < 1e-3,
            "{size}: {x} {y} {z}"
        );
    }
}

#[test]
fn with_an_accelerometer_a_slip_of_all_wheels_is_detected() {
    let spin = |k: usize, wheels: &mut [f64; 4]| {
        if (400..440).contains(&k) {
            *wheels = [8.0; 4]; // twice as fast for 0.2 s: a slip of 60 mm
        }
    };
    let (state, _) = forward(&four(), |k, wheels, _| spin(k, wheels));
    assert!((state.pose().position_m[0] - DISTANCE_M).abs() < 3e-3);
}

#[test]
fn wheels_are_left_out_in_a_jolt_and_not_while_the_base_trembles() {
    // An accelerometer whose bias no rest has shown: alone it is off by 0.6 m after 5 s.
    let error = |turns: &dyn Fn(usize) -> f64, jumps: &dyn Fn(usize) -> f64| {
        let (state, _) = forward(&four(), |k, wheels, imu| {
            imu.rate_rad_s[1] = turns(k);
            imu.specific_force_m_s2[0] += 0.05;
            *wheels = wheels.map(|rate| rate + jumps(k));
        });
        (state.pose().position_m[0] - DISTANCE_M).abs()
    };
    let calm = error(&|_| 0.0, &|_| 0.0);
    // To and fro by 5 mrad with every reading, as bolts that rattle.
    let trembles = error(&|k| if k % 2 == 0 { 1.0 } else { -1.0 }, &|_| 0.0);
    // Of 0.15 of the time, and of the first 0.1 s; of all the time it were 0.6 m.
    assert!(trembles < 0.03, "{trembles}");
    // Wheels land six times: the nose turns by 50 mrad up and down again, and meanwhile the wheels, whose axles are
    // below it, by 2 rad/s, 8 mm of way each time.
    let landing = |k: usize| match k % 120 {
        _ if k < 240 => 0.0,
        0..10 => 1.0,
        10..20 => -1.0,
        _ => 0.0,
    };
    let lands = error(&landing, &|k| if landing(k) > 0.0 { 2.0 } else { 0.0 });
    assert!(lands < calm + 3e-3, "{lands} {calm}");
}

#[test]
fn four_wheels_determine_the_height_and_three_do_not() {
    let (four, follows) = forward(&four(), |_, _, _| {});
    assert!(follows && four.height_variance_m2().sqrt() < 2e-3);
    let omni = WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05).expect("valid");
    let (three, follows) = forward(&omni, |_, _, _| {});
    // A tenth of the distance, less the length of the known ground.
    assert!(!follows && three.height_variance_m2().sqrt() > 0.05);
    assert!((three.pose().position_m[0] - DISTANCE_M).abs() < 1e-3);
}

#[test]
fn readings_that_are_not_valid_have_no_lasting_effect() {
    let (state, _) = forward(&four(), |k, wheels, imu| {
        if k % 7 == 3 {
            *wheels = [f64::INFINITY, -f64::INFINITY, f64::NAN, 1e300];
        }
        if k % 11 == 5 {
            *imu = Imu::silent();
        }
    });
    let [x, y, z] = state.pose().position_m;
    assert!(
        (x - DISTANCE_M).abs() < 0.02 && y.abs() < 1e-3 && z.abs() < 1e-3,
        "{x} {y} {z}"
    );
    let (wild, _) = forward(&four(), |k, wheels, imu| {
        if k < 500 {
            *wheels = [1e6, -1e6, 1e6, 1e6];
            imu.rate_rad_s = [1e6, -1e6, 1e6];
            imu.specific_force_m_s2 = [1e6; 3];
        }
    });
    assert!(wild.pose().position_m.iter().all(|each| each.is_finite()));
    assert!(wild.height_variance_m2().is_finite());
}

#[test]
fn a_step_is_met_climbed_and_left_with_its_height_and_angle() {
    // The path of a wheel of 76 mm over a step of 30 mm at x = 1 m, down again at 1.5 m.
    let (radius, height) = (0.076, 0.03);
    let ground = |x: f64| {
        let climb = |distance: f64| {
            let reach = f64::sqrt(radius * radius - (radius - height) * (radius - height));
            let distance = distance.clamp(0.0, reach);
            f64::sqrt(radius * radius - distance * distance) - radius + height
        };
        if x < 1.25 { climb(1.0 - x) } else { climb(x - 1.5) }
    };
    let mut paths = [WheelPath::<f64>::NONE; 2];
    let (mut kinds, mut angles) = (Vec::new(), Vec::new());
    for k in 0..2000 {
        let x = 1e-3 * f64::from(k);
        for (wheel, y) in [0.2, -0.2].into_iter().enumerate() {
            // The right wheel lags by 20 mm: 50 mrad of skew.
            let own = x - 0.02 * wheel as f64;
            let contact = Contact {
                wheel,
                height_m: if own < 0.0 { 0.0 } else { ground(own) },
                distance_m: 1e-3,
                place_m: [x, y],
                variance_m2: 1e-8,
            };
            let Some(mut event) = paths[wheel].step(&contact, 6e-3) else {
                continue;
            };
            event.angle = edge_normal(&paths, &event, [1.0, 0.0], 1e-3);
            kinds.push((wheel, event.kind));
            if event.kind != EdgeKind::Met {
                let sign = if event.kind == EdgeKind::Climbed {
                    1.0
                } else {
                    -1.0
                };
                // Even ground begins where the path is no steeper than a tenth: r (1 - cos 0.1) is 0.4 mm.
                assert!((event.height_m - sign * height).abs() < 0.6e-3, "{event:?}");
                angles.extend(event.angle.map(|[angle, _]| angle));
            }
        }
    }
    let of = |wheel| {
        kinds
            .iter()
            .filter(|each| each.0 == wheel)
            .map(|each| each.1)
            .collect::<Vec<_>>()
    };
    assert_eq!(of(0), [EdgeKind::Met, EdgeKind::Climbed, EdgeKind::Left]);
    assert_eq!(of(1), of(0));
    // The right wheel met the edge 20 mm later: the normal points to the left.
    assert_eq!(angles.len(), 2);
    assert!(
        angles.iter().all(|angle| (angle - 0.05).abs() < 0.005),
        "{angles:?}"
    );
}

/// Rear wheels on the base, front wheels on a frame that turns about an axis across.
fn hinged() -> GroundOdometry<f64, 4> {
    let layout = four::<f64>();
    let hinge = HingeGeometry {
        parent: 0,
        child: 1,
        axis: [0.0, 1.0, 0.0],
        anchor_m: [0.0, 0.0, 0.076],
    };
    let carried = |wheel: Wheel<f64>| {
        let [x, y] = wheel.position_m;
        CarriedWheel {
            body: usize::from(x > 0.0),
            centre_m: [x, y, wheel.radius_m],
        }
    };
    let linkage = Linkage::new(&[hinge], &layout.wheels().map(carried)).expect("a tree");
    let estimator = EstimatorConfig::new(PERIOD_S);
    GroundOdometry::new(GroundOdometryConfig::new(), estimator, &layout, linkage).expect("valid")
}

#[test]
fn wheels_behind_a_mute_hinge_have_no_height_and_still_count_for_the_place() {
    let (odometry, layout) = (hinged(), four::<f64>());
    let mut state = odometry.start();
    let kinematics = Kinematics::new(&layout).expect("valid");
    let command = BodyTwist {
        vx_m_s: SPEED_M_S,
        ..BodyTwist::ZERO
    };
    let mut imu = Imu::level();
    for k in 0..1000 {
        imu.specific_force_m_s2[0] = if k == 0 { SPEED_M_S / PERIOD_S } else { 0.0 };
        let angle = if k < 100 { 0.0 } else { f64::NAN };
        let input =
            GroundInput::new(&kinematics.inverse(&command), &imu, &command).with_hinges(&[angle], &[0.0]);
        assert!(odometry.step(&mut state, &input).taken);
    }
    let pose = state.pose();
    // Wheels 0 and 1 are those in front.
    assert!(pose.contact_m[0].is_nan() && pose.contact_m[1].is_nan());
    assert!(pose.contact_m[2].abs() < 1e-9 && pose.position_m[2].abs() < 1e-9);
    assert!((pose.position_m[0] - SPEED_M_S * PERIOD_S * 999.5).abs() < 1e-3);
    // With no wheel to follow, a tenth of the distance.
    assert!(state.height_variance_m2().sqrt() > 0.05);
}

#[test]
fn without_any_sensor_of_the_lean_the_variance_of_the_height_grows() {
    let (state, follows) = forward(&four(), |k, _, imu| {
        if k > 200 {
            *imu = Imu::silent();
        }
    });
    assert!(!follows && state.height_variance_m2().sqrt() > 0.05);
    assert!((state.pose().position_m[0] - DISTANCE_M).abs() < 1e-3);
    // Gyros alone are enough.
    let (state, follows) = forward(&four(), |_, _, imu| {
        (imu.roll_rad, imu.pitch_rad) = (f64::NAN, f64::NAN);
    });
    assert!(follows && state.height_variance_m2().sqrt() < 2e-3);
}

#[test]
fn an_attitude_that_jumps_is_not_a_lean() {
    let (state, _) = forward(&four(), |k, _, imu| {
        imu.pitch_rad = match k {
            300..=310 => 1.0,      // for a moment
            400..=450 => f64::NAN, // and missing
            k if k > 600 => -0.3,  // started anew
            _ => 0.0,
        };
    });
    let pose = state.pose();
    assert!(
        pose.pitch_rad.abs() < 1e-9 && pose.position_m[2].abs() < 1e-9,
        "{pose:?}"
    );
}

#[test]
fn a_measured_attitude_that_walks_away_does_not_lift_the_vehicle() {
    // 10 mrad in 5 s: 7 mm of height, were it the lean.
    let (state, _) = forward(&four(), |k, _, imu| imu.pitch_rad = 1e-5 * k as f64);
    // A drift of w per second leaves an error of the lean of 2 w T: 1.6 mrad, and 1.46 m of that in height.
    let [_, _, z] = state.pose().position_m;
    assert!((z - 1.6e-3 * DISTANCE_M).abs() < 0.5e-3, "{z}");
}

#[test]
fn whatever_is_read_the_state_stays_finite() {
    let layout = WheelLayout::<f32, 4>::mecanum4(0.5, 0.4, 0.076).expect("valid");
    let values = [
        0.0,
        1.0,
        -1.0,
        1e-30,
        1e6,
        -1e6,
        1e30,
        f32::MAX,
        f32::NAN,
        f32::INFINITY,
        -f32::INFINITY,
    ];
    let mut bits = 1_u32;
    let mut any = || {
        bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        values[(bits >> 16) as usize % values.len()]
    };
    for (period_s, lean_s) in [(0.005_f32, 0.4), (10.0, 0.01), (1e-6, 1000.0)] {
        let carried = |wheel: Wheel<f32>| CarriedWheel {
            body: 0,
            centre_m: [wheel.position_m[0], wheel.position_m[1], 0.076],
        };
        let linkage = Linkage::new(&[], &layout.wheels().map(carried)).expect("a tree");
        let mut config = GroundOdometryConfig::new();
        config.lean_s = lean_s;
        let mut estimator = EstimatorConfig::new(period_s);
        estimator.slip_s = f32::max(estimator.slip_s, period_s);
        let odometry = GroundOdometry::new(config, estimator, &layout, linkage).expect("valid");
        let mut state = odometry.start();
        for k in 0..3000 {
            let imu = Imu {
                roll_rad: any(),
                pitch_rad: any(),
                rate_rad_s: [any(), any(), any()],
                specific_force_m_s2: [any(), any(), any()],
            };
            let command = BodyTwist {
                vx_m_s: if k % 100 < 50 { 0.0 } else { 1.0 },
                ..BodyTwist::ZERO
            };
            let wheels = [any(), any(), any(), any()];
            _ = odometry.step(&mut state, &GroundInput::new(&wheels.into(), &imu, &command));
            let pose = state.pose();
            assert!(
                pose.position_m.iter().all(|each| each.is_finite()),
                "{k} {pose:?}"
            );
            assert!(pose.pitch_rad.abs() < 1.6 && pose.roll_rad.abs() < 1.6, "{k}");
            let variance_m2 = state.height_variance_m2();
            assert!(
                variance_m2 >= 0.0 && variance_m2.is_finite(),
                "{period_s} {k}: {variance_m2} {pose:?}"
            );
        }
    }
}

#[test]
fn a_configuration_out_of_range_is_rejected_by_name() {
    let layout = four::<f64>();
    let linkage = Linkage::new(
        &[],
        &[CarriedWheel {
            body: 0,
            centre_m: [0.0; 3],
        }; 4],
    )
    .expect("valid");
    let (mut config, estimator) = (GroundOdometryConfig::new(), EstimatorConfig::new(PERIOD_S));
    config.cell_m = 0.0;
    let error = GroundOdometry::new(config, estimator, &layout, linkage).expect_err("out of range");
    assert_eq!(error.to_string(), "cell_m = 0, allowed: 0.001 to 10");
    type Field = fn(&mut GroundOdometryConfig<f64>) -> &mut f64;
    let fields: [(&str, Field); 6] = [
        ("attitude_rad", |config| &mut config.attitude_rad),
        ("hinge_rad", |config| &mut config.hinge_rad),
        ("level_m_s", |config| &mut config.level_m_s),
        ("lean_s", |config| &mut config.lean_s),
        ("cell_m", |config| &mut config.cell_m),
        ("edge_m", |config| &mut config.edge_m),
    ];
    for (name, field) in fields {
        for value in [f64::NAN, -1.0, 1e9] {
            let mut config = GroundOdometryConfig::new();
            *field(&mut config) = value;
            let error = GroundOdometry::new(config, estimator, &layout, linkage).expect_err("out of range");
            assert_eq!(error.parameter, name);
        }
    }
    let error = GroundOdometry::new(
        GroundOdometryConfig::new(),
        EstimatorConfig::new(0.0),
        &layout,
        linkage,
    )
    .expect_err("out of range");
    assert_eq!(error.parameter, "period_s");
}

#[test]
fn a_state_has_the_size_of_its_documentation() {
    let of = core::mem::size_of::<GroundOdometryState<f32, 7>>();
    assert!((11_000..13_000).contains(&of), "{of}");
    let of = core::mem::size_of::<GroundOdometryState<f64, 7>>();
    assert!((18_000..20_000).contains(&of), "{of}");
}
