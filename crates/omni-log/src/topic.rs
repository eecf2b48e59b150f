//! Topics, by what they carry.

/// What was asked of the controller, and what it did.
pub const VEHICLE_STATE: &str = "/vehicle_state";
/// What the controller read.
pub const SENSORS: &str = "/sensors";
/// What only this run's controller says.
pub const CONTROLLER_SIGNALS: &str = "/controller_signals";
/// Frames.
pub const TF: &str = "/tf";
/// Hinges and wheels.
pub const JOINT_STATES: &str = "/joint_states";
/// Pose and twist by what the wheels turned, with the pose's covariance.
pub const ODOM: &str = "/odom";
/// True pose and twist; of a recording where they were measured from outside.
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
/// The inertial measurement unit; live on ROS 2 alone.
pub const IMU: &str = "/imu";
/// Commands of the wheels by a foreign controller; live on ROS 2 alone.
pub const JOINT_COMMANDS: &str = "/joint_commands";
