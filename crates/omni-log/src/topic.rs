//! Topics, by content.

/// The request to the controller, and its result.
pub const VEHICLE_STATE: &str = "/vehicle_state";
/// The controller's input.
pub const SENSORS: &str = "/sensors";
/// Signals that only this run's controller has.
pub const CONTROLLER_SIGNALS: &str = "/controller_signals";
/// Frames.
pub const TF: &str = "/tf";
/// Hinges and wheels.
pub const JOINT_STATES: &str = "/joint_states";
/// Pose and twist by odometry, with the pose's covariance.
pub const ODOM: &str = "/odom";
/// True pose and twist; for a recording, if they were measured externally.
pub const GROUND_TRUTH: &str = "/ground_truth/odom";
/// The command.
pub const CMD_VEL: &str = "/cmd_vel";
/// Forces of the ground.
pub const MARKERS: &str = "/markers";
/// The vehicle as URDF.
pub const ROBOT_DESCRIPTION: &str = "/robot_description";
/// The ground as URDF.
pub const TERRAIN: &str = "/terrain/robot_description";
/// Frames that do not move; live on ROS 2 alone.
pub const TF_STATIC: &str = "/tf_static";
/// Simulated time; live on ROS 2 alone.
pub const CLOCK: &str = "/clock";
/// What is wrong with the vehicle; live on ROS 2 alone, outside of every namespace.
pub const DIAGNOSTICS: &str = "/diagnostics";
/// The inertial measurement unit; live on ROS 2 alone.
pub const IMU: &str = "/imu";
/// Where to go; live on ROS 2 alone.
pub const GOAL_POSE: &str = "/goal_pose";
/// Where the vehicle is to be placed; live on ROS 2 alone.
pub const INITIAL_POSE: &str = "/initialpose";
/// The way to the goal; live on ROS 2 alone.
pub const PLAN: &str = "/plan";
/// Commands of the wheels by a foreign controller; live on ROS 2 alone.
pub const JOINT_COMMANDS: &str = "/joint_commands";
