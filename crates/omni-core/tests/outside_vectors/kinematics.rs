//! Inverse and forward kinematics.

use omni_core::geometry::Wheel;
use omni_core::{BodyTwist, Kinematics, WheelLayout, WheelVelocities};

use crate::{Case, as_number, as_numbers};

fn twist(numbers: &[f64]) -> BodyTwist<f64> {
    BodyTwist::from_array(numbers.try_into().expect("vx, vy, wz"))
}

/// ros2_controllers: the same places as `WheelLayout::omni`, but wheels turn positively clockwise.
pub(crate) fn ros2_omni<const N: usize>(case: &Case) {
    assert_eq!(case.number("n_wheels"), N as f64);
    let layout = WheelLayout::<f64, N>::omni(
        case.number("robot_radius_m"),
        case.number("wheel_offset_rad"),
        case.number("wheel_radius_m"),
    );
    let command = ["vx", "vy", "wz"].map(|key| as_number(&case.input["twist"][key]));
    let wheels = Kinematics::new(&layout.expect("valid"))
        .expect("valid")
        .inverse(&twist(&command));
    case.expects("wheel_rad_s", &wheels.rad_s.map(|w| -w));
}

/// ros2_controllers: front left, front right, rear right, rear left; the lever given is half of wheelbase plus track.
pub(crate) fn ros2_mecanum(case: &Case) {
    let lever = case.number("lx_plus_ly_m");
    let layout =
        WheelLayout::mecanum4(1.2 * lever, 0.8 * lever, case.number("wheel_radius_m")).expect("valid");
    let [fl, fr, rl, rr] = Kinematics::new(&layout)
        .expect("valid")
        .inverse(&twist(&case.numbers("twist")))
        .rad_s;
    case.expects("wheel_rad_s", &[fl, fr, rr, rl]);
}

/// WPILib: front left, front right, rear left, rear right, values are surface speeds [m/s]: wheels of radius 1 m.
fn wpilib(case: &Case) -> Kinematics<f64, 4> {
    let places = case.input["wheels_m"].as_array().expect("places");
    let quarter = core::f64::consts::FRAC_PI_4;
    let wheel =
        |i: usize, roller: f64| Wheel::mecanum(as_numbers(&places[i]).try_into().expect("x, y"), roller, 1.0);
    let layout = WheelLayout::new([
        wheel(0, -quarter),
        wheel(1, quarter),
        wheel(2, quarter),
        wheel(3, -quarter),
    ]);
    Kinematics::new(&layout.expect("valid")).expect("valid")
}

pub(crate) fn wpilib_inverse(case: &Case) {
    let centre = case.array("center_of_rotation");
    let origin = BodyTwist::from_point(twist(&case.numbers("chassis")), centre);
    case.expects("wheel_m_s", &wpilib(case).inverse(&origin).rad_s);
}

pub(crate) fn wpilib_forward(case: &Case) {
    let wheels = WheelVelocities {
        rad_s: case.array("wheel_m_s"),
    };
    case.expects("chassis", &wpilib(case).forward(&wheels).to_array());
}

/// TIGERs: four omni wheels at 30, 150, 225 and 315 degrees, counter-clockwise, as in the class's defaults.
fn tigers() -> Kinematics<f64, 4> {
    let wheels = [30.0_f64, 150.0, 225.0, 315.0].map(|degrees| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Wheel::omni([0.076 * cos, 0.076 * sin], [-sin, cos], 0.025)
    });
    Kinematics::new(&WheelLayout::new(wheels).expect("valid")).expect("valid")
}

pub(crate) fn tigers_inverse(case: &Case) {
    case.expects(
        "wheel_rad_s",
        &tigers().inverse(&twist(&case.numbers("twist"))).rad_s,
    );
}

pub(crate) fn tigers_forward(case: &Case) {
    let wheels = WheelVelocities {
        rad_s: case.array("wheel_rad_s"),
    };
    case.expects("twist", &tigers().forward(&wheels).to_array());
    let residual = tigers().residual(&wheels).rad_s;
    case.expects(
        "residual_norm_rad_s",
        &[residual.iter().map(|r| r * r).sum::<f64>().sqrt()],
    );
}
