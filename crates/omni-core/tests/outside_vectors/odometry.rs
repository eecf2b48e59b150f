//! Dead reckoning and what belongs to it.

use omni_core::estimate::{Odometry, OdometryState};
use omni_core::geometry::{PlanarPose, WheelAngles};
use omni_core::{BodyTwist, Kinematics, PidConfig, PidGains, WheelLayout, WheelVelocities};

use crate::{Case, as_numbers};

fn pose(state: &OdometryState<f64, 4>) -> [f64; 3] {
    let pose = state.pose();
    [pose.x_m, pose.y_m, pose.yaw_rad]
}

/// ros2_controllers: wheels turn positively clockwise.
pub(crate) fn ros2_wheels(case: &Case) {
    let layout = WheelLayout::<f64, 4>::omni(
        case.number("robot_radius_m"),
        case.number("wheel_offset_rad"),
        case.number("wheel_radius_m"),
    );
    let kinematics = Kinematics::new(&layout.expect("valid")).expect("valid");
    let velocities = WheelVelocities {
        rad_s: case.array::<4>("wheel_rad_s").map(|w| -w),
    };
    let mut state = OdometryState::default();
    Odometry::new(case.number("dt_s"))
        .expect("valid")
        .step_velocities(&mut state, &kinematics, &velocities);
    let ([x, y, heading], twist) = (pose(&state), kinematics.forward(&velocities));
    for (key, value) in [
        ("x", x),
        ("y", y),
        ("heading", heading),
        ("vx", twist.vx_m_s),
        ("vy", twist.vy_m_s),
        ("wz", twist.wz_rad_s),
    ] {
        if case.expected.get(key).is_some() {
            case.expects(key, &[value]);
        }
    }
}

pub(crate) fn ros2_arc(case: &Case) {
    let twist = BodyTwist::from_array(case.array("twist"));
    let pose = PlanarPose::origin().moved_by(&twist.over(case.number("dt_s")));
    case.expects("x", &[pose.x_m]);
    case.expects("y", &[pose.y_m]);
    case.expects("heading", &[pose.yaw_rad]);
}

/// Periods below a microsecond: refused when a loop is built, before there is anything to reject at run time.
pub(crate) fn small_period(case: &Case) {
    let gains = PidGains {
        kp_n_m_s_rad: 1.0,
        ki_n_m_rad: 0.0,
        kd_n_m_s2_rad: 0.0,
    };
    let error = omni_core::loops::Pid::new(PidConfig::new(gains, case.number("dt_s"))).expect_err("refused");
    assert_eq!(error.parameter, "period_s");
    let error = Odometry::<f64, 4>::new(case.number("dt_s")).expect_err("refused");
    assert_eq!(error.parameter, "period_s");
    assert_eq!(case.expected["updated"], false);
    case.expects("x", &[OdometryState::<f64, 4>::default().pose().x_m]);
}

/// Mecanum wheels that rolled so far [m] along their surface; radius 1 m.
fn wpilib() -> (Kinematics<f64, 4>, Odometry<f64, 4>) {
    let layout = WheelLayout::mecanum4(0.6, 0.4, 1.0).expect("valid");
    (
        Kinematics::new(&layout).expect("valid"),
        Odometry::new(0.02).expect("valid"),
    )
}

/// The heading there is a gyro's, 0 all the time; our wheels say the same.
pub(crate) fn wpilib_straight(case: &Case) {
    assert_eq!(case.number("gyro_deg"), 0.0);
    let (kinematics, odometry) = wpilib();
    let mut state = OdometryState::default();
    odometry.step_positions(&mut state, &kinematics, &WheelAngles::zero());
    odometry.step_positions(
        &mut state,
        &kinematics,
        &WheelAngles {
            rad: case.array("wheel_pos_m"),
        },
    );
    let [x, y, yaw] = pose(&state);
    case.expects("x", &[x]);
    case.expects("y", &[y]);
    case.expects("yaw", &[yaw]);
}

pub(crate) fn wpilib_reset(case: &Case) {
    let (kinematics, odometry) = wpilib();
    let positions = WheelAngles {
        rad: case.array("reset_with_wheel_pos_m"),
    };
    let mut state = OdometryState::default();
    // The first sample initialises, wherever the encoders stand; a reset keeps what they read.
    odometry.step_positions(&mut state, &kinematics, &WheelAngles::zero());
    odometry.step_positions(&mut state, &kinematics, &positions);
    assert!(state.pose().x_m > 3.0, "it moved");
    assert!(state.reset(&PlanarPose::origin()));
    odometry.step_positions(&mut state, &kinematics, &positions);
    let [x, y, yaw] = pose(&state);
    case.expects("x", &[x]);
    case.expects("y", &[y]);
    case.expects("yaw", &[yaw]);
}

pub(crate) fn wpilib_exponential(case: &Case) {
    let pose = PlanarPose::origin().moved_by(&BodyTwist::from_array(case.array("twist")).over(1.0));
    case.expects("pose", &[pose.x_m, pose.y_m, pose.yaw_rad]);
}

pub(crate) fn wpilib_discretize(case: &Case) {
    let (duration, step) = (case.number("duration_s"), case.number("substep_s"));
    let twist = BodyTwist::from_array(case.array("chassis")).discretize(duration);
    let mut pose = PlanarPose::origin();
    for _ in 0..(duration / step).round() as usize {
        pose = pose.moved_by(&twist.over(step));
    }
    case.expects("pose_after", &[pose.x_m, pose.y_m, pose.yaw_rad]);
}

pub(crate) fn wpilib_field_relative(case: &Case) {
    let yaw_rad = case.number("robot_angle_deg").to_radians();
    let world = BodyTwist::from_array(case.array("chassis")).to_world(&PlanarPose {
        yaw_rad,
        ..PlanarPose::origin()
    });
    assert_eq!(as_numbers(&case.expected["chassis"]).len(), 3);
    case.expects("chassis", &[world.vx_m_s, world.vy_m_s, world.wz_rad_s]);
}
