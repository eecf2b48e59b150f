//! A vehicle that an edge holds while all its wheels turn, and vehicles that push without being held.

use super::tests::{PERIOD_S, SPEED_M_S, four, rigid};
use super::*;
use crate::BodyTwist;
use crate::estimate::estimator::tests::Random;
use crate::policy::Imu;

const MASS_KG: f64 = 20.0;
/// Walk of the accelerometer's bias \[m/s^2 per root of s\]: an attitude that wanders by 1 mrad per root of s.
const WALK: f64 = 0.01;

/// What takes the torques of a vehicle that drives ahead, from two seconds after its start on.
#[derive(Clone, Copy)]
struct Takes {
    /// An edge that holds it for this time while the wheels go on, before it backs off for a second \[s\]; 0 for none.
    edge_s: f64,
    /// A load \[m/s^2\].
    load: f64,
    /// Its gears, all the time \[m/s^2\].
    gears: f64,
    /// The accelerometer reads zeros.
    is_dead: bool,
    /// Speed to the left, all the time \[m/s\]: along the edge.
    aside_m_s: f64,
}

const NOTHING: Takes = Takes {
    edge_s: 0.0,
    load: 0.0,
    gears: 0.0,
    is_dead: false,
    aside_m_s: 0.0,
};

/// Error of the place at the end, along and across the way \[m\]; `knows` is whether torques are read.
fn error(takes: Takes, knows: bool, seed: u64) -> [f64; 2] {
    // Motors behind 20:1, of which two are mounted the other way round.
    let mut wheels = four::<f64>().wheels().map(|wheel| wheel.geared(0.05));
    wheels[1] = wheels[1].with_reversed_motor();
    wheels[3] = wheels[3].with_reversed_motor();
    let layout = WheelLayout::new(wheels).expect("valid");
    let (mut odometry, kinematics) = (rigid(&layout), Kinematics::new(&layout).expect("sound"));
    odometry.config.mass_kg = MASS_KG;
    let (mut state, mut random) = (odometry.start(), Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    let (mut x, mut y, mut speed, mut bias) = (0.0, 0.0, 0.0_f64, [0.03, -0.03]);
    let mut aside = 0.0_f64;
    let edge_s = takes.edge_s;
    let lasts_s = if edge_s > 0.0 { edge_s + 1.0 } else { 10.0 };
    for k in 0..((6.0 + lasts_s) / PERIOD_S) as usize {
        let time_s = k as f64 * PERIOD_S - 6.0;
        let held = time_s >= 0.0 && time_s < edge_s;
        let command = match time_s {
            _ if time_s < -2.0 => 0.0,
            _ if edge_s > 0.0 && time_s >= edge_s => -0.2,
            _ => SPEED_M_S,
        };
        let gains = if held {
            -speed / PERIOD_S
        } else {
            (command - speed).clamp(-PERIOD_S, PERIOD_S) / PERIOD_S
        };
        speed += gains * PERIOD_S;
        x += speed * PERIOD_S;
        let aside_to = if time_s < -2.0 { 0.0 } else { takes.aside_m_s };
        let gains_aside = (aside_to - aside).clamp(-PERIOD_S, PERIOD_S) / PERIOD_S;
        aside += gains_aside * PERIOD_S;
        y += aside * PERIOD_S;
        let shown = if held { SPEED_M_S } else { speed };
        let load = if time_s >= 0.0 { takes.load } else { 0.0 };
        // Nearly all that wheels can push with at a friction of 0.6.
        let edge = if held { 5.0 } else { 0.0 };
        let taken = edge
            + load
            + if shown == 0.0 {
                0.0
            } else {
                takes.gears.copysign(shown)
            };
        let twist = |vx_m_s, vy_m_s| BodyTwist {
            vx_m_s,
            vy_m_s,
            ..BodyTwist::ZERO
        };
        let wheels = kinematics
            .inverse(&twist(shown, aside))
            .rad_s
            .map(|rate| rate + 0.05 * random.normal());
        let mut imu = Imu::level();
        bias = bias.map(|bias| bias + WALK * PERIOD_S.sqrt() * random.normal());
        imu.rate_rad_s = [0.0; 3].map(|_| 0.005 * random.normal());
        imu.specific_force_m_s2 = [
            gains + bias[0] + 0.05 * random.normal(),
            gains_aside + bias[1] + 0.05 * random.normal(),
            9.81,
        ];
        if takes.is_dead {
            imu.specific_force_m_s2 = [0.0, 0.0, 9.81];
        }
        let torque_n_m = MASS_KG * (taken + if held { 0.0 } else { gains }) * 0.076 / 4.0;
        let torques = layout
            .wheels()
            .map(|wheel| torque_n_m * wheel.wheel_per_actuator());
        let mut input = GroundInput::new(&wheels.into(), &imu, &twist(command, aside_to));
        if knows {
            input = input.with_torques(&torques.into());
        }
        assert!(odometry.step(&mut state, &input).taken);
    }
    let [found_x, found_y, _] = state.pose().position_m;
    [found_x - x, found_y - y]
}

/// Root mean squares of the errors along and across the way over 12 seeds.
fn both(takes: Takes, knows: bool) -> [f64; 2] {
    let errors: [_; 12] = core::array::from_fn(|seed| error(takes, knows, 400 + seed as u64));
    [0, 1].map(|i| (errors.iter().map(|each| each[i].powi(2)).sum::<f64>() / 12.0).sqrt())
}

/// Of those along the way.
fn along(takes: Takes, knows: bool) -> f64 {
    both(takes, knows)[0]
}

#[test]
fn a_vehicle_that_an_edge_holds_stays_where_it_is_while_its_wheels_turn() {
    // For ten seconds: 3 m by the wheels. Its deviation of 2 cm/s lasts 0.2 s at a time: 0.02 sqrt(2 * 0.2 * 10) is
    // 4 cm.
    for gears in [0.0, 4.0] {
        let edge = Takes {
            edge_s: 10.0,
            gears,
            ..NOTHING
        };
        let (with, without) = (along(edge, true), along(edge, false));
        assert!(with < 0.04, "{gears}: {with}");
        assert!(without > 10.0 * with, "{without}: torques make no difference");
    }
}

#[test]
fn a_vehicle_that_rolls_along_the_edge_that_holds_it_stays_at_it() {
    // Wheels that spin hold nothing sideways: along the edge it may slide, and only the accelerometer would know. By
    // its bias alone that is 0.01 * 10^2.5 / sqrt(20) = 0.7 m after 10 s; it slides a third of that at most.
    let edge = Takes {
        edge_s: 10.0,
        aside_m_s: 0.1,
        ..NOTHING
    };
    let [across, along] = both(edge, true);
    assert!(across < 0.04 && along < 0.7 / 3.0, "{across} {along}");
}

#[test]
fn a_vehicle_that_pulls_a_load_or_has_stiff_gears_is_not_held() {
    // Up to half of its weight, beyond which wheels slip; as much is a supply that is weak while motors are taken for
    // strong. Stiff gears take more than that of a light vehicle.
    let all = [
        (1.0, 0.0),
        (3.0, 0.0),
        (5.0, 0.0),
        (0.0, 2.0),
        (0.0, 6.0),
        (2.0, 4.0),
    ];
    for (load, gears) in all {
        let with = along(
            Takes {
                load,
                gears,
                ..NOTHING
            },
            true,
        );
        // 3.6 m of way; the wheels do not slip.
        assert!(with < 10e-3, "{load} {gears}: {with}");
    }
}

#[test]
fn with_an_accelerometer_that_is_dead_stiff_gears_hold_for_seconds_only() {
    let dead = Takes {
        gears: 4.0,
        is_dead: true,
        ..NOTHING
    };
    // At most 3 s of 0.3 m/s are lost, beside what the estimator loses anyway until it doubts the accelerometer; 3.6 m
    // if it went on.
    let (with, without) = (along(dead, true), along(dead, false));
    assert!(with < without + 0.9, "{with} {without}");
}

/// Way that the odometry has after a rest of 4 s and a drive of 4 s, of which one reading is off by this \[m\].
fn way(force_m_s2: f64, torque_n_m: f64) -> f64 {
    let layout = four::<f64>();
    let mut odometry = rigid(&layout);
    odometry.config.mass_kg = MASS_KG;
    let kinematics = Kinematics::new(&layout).expect("sound");
    let mut state = odometry.start();
    let mut speed = 0.0_f64;
    for k in 0..1600 {
        let target = if k < 800 { 0.0 } else { SPEED_M_S };
        let gains = (target - speed).clamp(-PERIOD_S, PERIOD_S);
        speed += gains;
        let ahead = |vx_m_s| BodyTwist {
            vx_m_s,
            ..BodyTwist::ZERO
        };
        let mut imu = Imu::level();
        let absurd = k == 1000;
        imu.specific_force_m_s2[0] = gains / PERIOD_S + if absurd { force_m_s2 } else { 0.0 };
        let torques = [if absurd { torque_n_m } else { 0.0 }; 4];
        let input = GroundInput::new(&kinematics.inverse(&ahead(speed)), &imu, &ahead(target));
        odometry.step(&mut state, &input.with_torques(&torques.into()));
    }
    state.pose().position_m[0]
}

#[test]
fn one_reading_that_cannot_be_holds_nothing() {
    let exact = way(0.0, 0.0);
    assert!((exact - 1.155).abs() < 1e-3, "{exact}");
    // Of the accelerometer, and torques in another unit: no hold of even a tenth of a second.
    for (force, torque) in [(-9e4, 0.0), (0.0, 3000.0), (0.0, -3000.0)] {
        let off = way(force, torque) - exact;
        assert!(off.abs() < 0.03, "{force} {torque}: {off}");
    }
    // A jolt that can be: what torques tell makes it no worse.
    let unknown = way(-160.0, f64::NAN) - exact;
    let off = way(-160.0, 0.0) - exact;
    assert!(off.abs() < unknown.abs() + 0.03, "{off} {unknown}");
}

#[test]
fn without_a_torque_of_each_wheel_or_the_mass_nothing_is_taken() {
    let layout = four::<f64>();
    let mut odometry = rigid(&layout);
    let command = BodyTwist {
        vx_m_s: SPEED_M_S,
        ..BodyTwist::ZERO
    };
    let wheels = Kinematics::new(&layout).expect("sound").inverse(&command);
    for (mass_kg, torque, is_taken) in [
        (MASS_KG, 1.0, true),
        (MASS_KG, f64::NAN, false),
        (0.0, 1.0, false),
    ] {
        odometry.config.mass_kg = mass_kg;
        let mut state = odometry.start();
        let torques = [1.0, 1.0, 1.0, torque];
        let input = GroundInput::new(&wheels, &Imu::level(), &command).with_torques(&torques.into());
        (0..400).for_each(|_| _ = odometry.step(&mut state, &input));
        assert_eq!(state.push.taken_m_s2[0] > 1.0, is_taken, "{mass_kg} {torque}");
    }
}
