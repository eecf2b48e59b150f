//! Mixers of autopilots, and desaturation.
//!
//! Their frame is forward, right, down: lateral and steering are positive to the right, so y and yaw change sign. Their
//! inputs are normalised: wheels of radius 1 m at levers of 1 m.

use omni_core::geometry::{Desaturation, SpeedLimits, Wheel};
use omni_core::{BodyTwist, Kinematics, WheelLayout, WheelVelocities};

use crate::{Case, as_numbers};

fn scaled<const N: usize>(wheels: &WheelVelocities<f64, N>, limit: f64) -> ([f64; N], f64, Option<usize>) {
    let limits = SpeedLimits::new([limit; N], Desaturation::Uniform).expect("valid");
    let (wheels, factor, limiting) = limits.scale(wheels);
    (wheels.rad_s, factor, limiting)
}

pub(crate) fn wpilib_desaturate(case: &Case) {
    let wheels = WheelVelocities {
        rad_s: case.array::<4>("wheel_m_s"),
    };
    case.expects("wheel_m_s", &scaled(&wheels, case.number("max")).0);
}

/// Forward, steering and lateral inputs as a twist.
fn command(forward: f64, steering: f64, lateral: f64) -> BodyTwist<f64> {
    BodyTwist {
        vx_m_s: forward,
        vy_m_s: -lateral,
        wz_rad_s: -steering,
    }
}

fn ardupilot(case: &Case) -> BodyTwist<f64> {
    command(case.number("thr"), case.number("steer"), case.number("lat"))
}

/// Levers of half a metre along and across: (wheelbase + track) / 2 = 1.
fn unit_mecanum() -> Kinematics<f64, 4> {
    Kinematics::new(&WheelLayout::mecanum4(1.0, 1.0, 1.0).expect("valid")).expect("valid")
}

/// OMNIX has the rows of a mecanum base, in the order front right, rear right, rear left, front left.
pub(crate) fn omnix(case: &Case) {
    let [fl, fr, rl, rr] = unit_mecanum().inverse(&ardupilot(case)).rad_s;
    let (motors, factor, _) = scaled(&[fr, rr, rl, fl].into(), 1.0);
    case.expects("motors", &motors);
    case.expects("scale", &[factor]);
}

/// OMNI3: at 60, 180 and 300 degrees, each motor turning so that the vehicle moves forward or left;
/// scaled to the largest.
pub(crate) fn omni3(case: &Case) {
    let third = core::f64::consts::FRAC_PI_3;
    let kinematics =
        Kinematics::new(&WheelLayout::<f64, 3>::omni(1.0, third, 1.0).expect("valid")).expect("valid");
    let [a, b, c] = kinematics.inverse(&ardupilot(case)).rad_s;
    let largest = a.abs().max(c.abs());
    // Our wheels turn counter-clockwise: the one on the left moves the vehicle backwards.
    case.expects("motors", &[-a / largest, -b / largest, c / largest]);
}

/// The wheel whose row is `factors` (forward, steering, lateral): it rolls along (forward, -lateral), as far from the
/// origin as its steering asks for.
fn wheel_of([forward, steering, lateral]: [f64; 3]) -> Wheel<f64> {
    let (dx, dy) = (forward, -lateral);
    // dy x - dx y = -steering with the place across the rolling direction.
    Wheel::omni([-steering * dy, steering * dx], [dx, dy], 1.0)
}

pub(crate) fn omniplus(case: &Case) {
    let factors = case.input["factors"].as_array().expect("factors");
    let wheels: Vec<_> = factors
        .iter()
        .map(|row| wheel_of(as_numbers(row).try_into().expect("three")))
        .collect();
    let layout = WheelLayout::<f64, 4>::new(wheels.try_into().expect("four wheels")).expect("valid");
    let motors = Kinematics::new(&layout).expect("valid").inverse(&ardupilot(case));
    case.expects("motors", &scaled(&motors, 1.0).0);
}

/// Three wheels 120 degrees apart, rolling along 195, 315 and 75 degrees; the factors are scaled by 1 / cos(15 degrees)
/// and printed to five digits.
pub(crate) fn omni3_factors(case: &Case) {
    let degree = core::f64::consts::PI / 180.0;
    let rows: Vec<Vec<f64>> = case.expected["factors"]
        .as_array()
        .expect("rows")
        .iter()
        .map(as_numbers)
        .collect();
    let scale = 1.0 / (15.0 * degree).cos();
    // Right is positive there: a rolling direction of -a there is one of a here. Ours are 90
    // degrees ahead of the place.
    let layout = WheelLayout::<f64, 3>::omni(1.0, (-195.0 - 90.0) * degree, 1.0).expect("valid");
    let kinematics = Kinematics::new(&layout).expect("valid");
    for (row, ours) in rows.iter().zip([0, 2, 1]) {
        let [vx, vy, _] = kinematics.inverse_matrix()[ours];
        let expected = [vx * scale, -vy * scale];
        assert!(
            (row[0] - expected[0]).abs() < 5e-6 && (row[2] - expected[1]).abs() < 5e-6,
            "{row:?} {expected:?}"
        );
        assert_eq!(row[1], 1.0); // all wheels steer alike
    }
}

/// PX4: front right, front left, rear left... as its rows say; nothing is over the limit in these cases.
pub(crate) fn px4(case: &Case) {
    let twist = command(case.number("x"), case.number("yaw"), case.number("y"));
    let limits = SpeedLimits::new([1.0; 4], Desaturation::KeepsYaw).expect("valid");
    let limited = limits.desaturate(&unit_mecanum(), &twist);
    let [fl, fr, rl, rr] = limited.velocities.rad_s;
    case.expects("motors", &[fr, fl, rr, rl]);
    assert_eq!(limited.limiting, None);
}
