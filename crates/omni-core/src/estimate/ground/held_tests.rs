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
}

const NOTHING: Takes = Takes {
    edge_s: 0.0,
    load: 0.0,
    gears: 0.0,
};

/// Error of the place at the end, along and across the way \[m\]; `knows` is whether torques are read.
fn error(takes: Takes, knows: bool, seed: u64) -> [f64; 2] {
    let layout = four::<f64>();
    let (mut odometry, kinematics) = (rigid(&layout), Kinematics::new(&layout).expect("sound"));
    odometry.config.mass_kg = MASS_KG;
    let (mut state, mut random) = (odometry.start(), Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    let (mut x, mut speed, mut bias) = (0.0, 0.0_f64, [0.03, -0.03]);
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
        let twist = |vx_m_s| BodyTwist {
            vx_m_s,
            ..BodyTwist::ZERO
        };
        let wheels = kinematics
            .inverse(&twist(shown))
            .rad_s
            .map(|rate| rate + 0.05 * random.normal());
        let mut imu = Imu::level();
        bias = bias.map(|bias| bias + WALK * PERIOD_S.sqrt() * random.normal());
        imu.rate_rad_s = [0.0; 3].map(|_| 0.005 * random.normal());
        imu.specific_force_m_s2 = [
            gains + bias[0] + 0.05 * random.normal(),
            bias[1] + 0.05 * random.normal(),
            9.81,
        ];
        let torque = MASS_KG * (taken + if held { 0.0 } else { gains }) * 0.076 / 4.0;
        let mut input = GroundInput::new(&wheels.into(), &imu, &twist(command));
        if knows {
            input = input.with_torques(&[torque; 4].into());
        }
        assert!(odometry.step(&mut state, &input).taken);
    }
    let [found_x, found_y, _] = state.pose().position_m;
    [found_x - x, found_y]
}

/// Root mean square of the errors along the way over 12 seeds.
fn along(takes: Takes, knows: bool) -> f64 {
    let square = |seed: u64| error(takes, knows, 400 + seed)[0].powi(2);
    ((0..12).map(square).sum::<f64>() / 12.0).sqrt()
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
fn a_vehicle_that_pulls_a_load_or_has_stiff_gears_is_not_held() {
    // Up to 0.3 of its weight: beyond, wheels slip. Stiff gears take more than that of a light vehicle.
    for (load, gears) in [
        (0.5, 0.0),
        (1.0, 0.0),
        (2.9, 0.0),
        (0.0, 2.0),
        (0.0, 6.0),
        (2.0, 4.0),
    ] {
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
fn without_a_torque_of_each_wheel_or_the_mass_nothing_is_held() {
    let layout = four::<f64>();
    let odometry = rigid(&layout);
    let mut state = odometry.start();
    let command = BodyTwist {
        vx_m_s: SPEED_M_S,
        ..BodyTwist::ZERO
    };
    let wheels = Kinematics::new(&layout).expect("sound").inverse(&command);
    for torques in [[9.0; 4], [9.0, 9.0, 9.0, f64::NAN]] {
        let input = GroundInput::new(&wheels, &Imu::level(), &command).with_torques(&torques.into());
        (0..400).for_each(|_| _ = odometry.step(&mut state, &input));
        assert_eq!(state.push.taken_m_s2, [0.0; 2]); // a mass of 0 is unknown
    }
}
