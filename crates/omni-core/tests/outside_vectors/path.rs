//! Trajectories and who follows them.

use omni_core::geometry::{PlanarPose, WorldTwist};
use omni_core::path::{
    FollowerConfig, HolonomicFollower, PathLimits, PathPiece, PathSegment, PlanarInertia, TrajectoryPlanner,
    Waypoint,
};
use omni_core::shaping::MotionLimits;
use omni_core::{Kinematics, TorqueLimit, WheelLayout};

use crate::Case;

/// Ruckig: a line, for wheels whose limits nothing meets.
pub(crate) fn ruckig(case: &Case) {
    let motion = MotionLimits {
        velocity: case.number("velocity"),
        acceleration: case.number("acceleration"),
        deceleration: case.number("acceleration"),
        jerk: case.number("jerk"),
    };
    let body = PlanarInertia {
        mass_kg: 20.0,
        yaw_kg_m2: 1.0,
        centre_m: [0.0; 2],
    };
    let layout = WheelLayout::<f64, 4>::mecanum4(0.5, 0.4, 0.076).expect("valid");
    let torque = TorqueLimit::constant(1e6).expect("valid");
    let limits = PathLimits::new(motion, motion, body, [1e6; 4], [torque; 4]);
    let planner = TrajectoryPlanner::new(&Kinematics::new(&layout).expect("valid"), limits).expect("valid");
    let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
    let line = [
        Waypoint::at(0.0, 0.0),
        Waypoint::at(case.number("distance_m"), 0.0),
    ];
    let line = planner.plan(&line, &mut segments, &mut pieces).expect("planned");
    case.expects("duration_s", &[line.duration_s()]);
    let samples: Vec<_> = case.numbers("times_s").iter().map(|t| line.at(*t)).collect();
    let all = |value: fn(&omni_core::path::TrajectorySample<f64>) -> f64| {
        samples.iter().map(value).collect::<Vec<_>>()
    };
    case.expects("position_m", &all(|sample| sample.pose.x_m));
    case.expects("velocity_m_s", &all(|sample| sample.velocity.vx_m_s));
    case.expects("acceleration_m_s2", &all(|sample| sample.acceleration[0]));
}

/// WPILib: the trajectory is a speed along a direction.
pub(crate) fn wpilib_holonomic(case: &Case) {
    let follower = HolonomicFollower::new(FollowerConfig {
        gain_per_s: case.number("gain_per_s"),
        heading_gain_per_s: case.number("heading_gain_per_s"),
        limit_m_s: 1000.0,
        limit_rad_s: 1000.0,
    })
    .expect("valid");
    let pose = |key: &str| {
        let [x_m, y_m, yaw_rad] = case.array(key);
        PlanarPose { x_m, y_m, yaw_rad }
    };
    let (speed, direction) = (case.number("speed_m_s"), case.number("direction_rad"));
    let mut sample = omni_core::path::Trajectory::<f64>::new(&[], &[]).at(0.0);
    sample.pose = pose("wanted");
    sample.velocity = WorldTwist {
        vx_m_s: speed * direction.cos(),
        vy_m_s: speed * direction.sin(),
        wz_rad_s: 0.0,
    };
    let twist = follower.step(&sample, &pose("pose")).twist;
    case.expects("twist", &twist.to_array());
}
