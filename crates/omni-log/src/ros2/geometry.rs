//! Times, vectors, poses, twists and transforms, of which other messages consist.

use omni_core::BodyTwist;
use serde::{Deserialize, Serialize};

/// `builtin_interfaces/msg/Time`: simulated time since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// Whole seconds \[s\].
    pub sec: i32,
    /// Nanoseconds behind the second \[ns\], below 1e9.
    pub nanosec: u32,
}

impl Time {
    /// The time `time_ns` \[ns\] after the start; held at the last second of an `i32` (68 years) beyond it.
    #[must_use]
    pub fn from_ns(time_ns: u64) -> Self {
        let nanosec = (time_ns % 1_000_000_000) as u32; // below 1e9, so nothing is cut off
        Self {
            sec: i32::try_from(time_ns / 1_000_000_000).unwrap_or(i32::MAX),
            nanosec,
        }
    }

    /// The same after the start \[ns\]; what is before it is the start.
    ///
    /// ```
    /// use omni_log::ros2::Time;
    /// assert_eq!(Time::from_ns(5_000_000_007).to_ns(), 5_000_000_007);
    /// ```
    #[must_use]
    pub fn to_ns(self) -> u64 {
        u64::try_from(self.sec).map_or(0, |sec| sec * 1_000_000_000 + u64::from(self.nanosec))
    }
}

/// `std_msgs/msg/Header`: when and in which frame.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Simulated time of the content.
    pub stamp: Time,
    /// Frame the content is expressed in.
    pub frame_id: String,
}

impl Header {
    /// The header of something at `time_ns` \[ns\] of simulated time, expressed in `frame_id`.
    pub fn new(time_ns: u64, frame_id: impl Into<String>) -> Self {
        Self {
            stamp: Time::from_ns(time_ns),
            frame_id: frame_id.into(),
        }
    }
}

/// `geometry_msgs/msg/Vector3`: a free vector, in the unit of its owner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector3 {
    /// Along x (forward is +).
    pub x: f64,
    /// Along y (left is +).
    pub y: f64,
    /// Along z (up is +).
    pub z: f64,
}

impl From<[f64; 3]> for Vector3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

/// `geometry_msgs/msg/Quaternion`: a rotation of unit norm; the default is no rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// Axis along x times the sine of half the angle.
    pub x: f64,
    /// Axis along y times the sine of half the angle.
    pub y: f64,
    /// Axis along z times the sine of half the angle.
    pub z: f64,
    /// Cosine of half the angle.
    pub w: f64,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        }
    }
}

impl From<[f64; 4]> for Quaternion {
    fn from([x, y, z, w]: [f64; 4]) -> Self {
        Self { x, y, z, w }
    }
}

/// `geometry_msgs/msg/Point`: a place \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Along x \[m\] (forward is +).
    pub x: f64,
    /// Along y \[m\] (left is +).
    pub y: f64,
    /// Along z \[m\] (up is +).
    pub z: f64,
}

impl From<[f64; 3]> for Point {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

/// `geometry_msgs/msg/Pose`: place and attitude of a body in the frame of the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Origin of the body \[m\].
    pub position: Point,
    /// Rotation from the body's frame to the header's.
    pub orientation: Quaternion,
}

/// `geometry_msgs/msg/PoseStamped`: a pose with its time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// Time, and the frame of the pose.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
}

/// `geometry_msgs/msg/Twist`: linear and angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Linear velocity \[m/s\].
    pub linear: Vector3,
    /// Angular velocity \[rad/s\] (counter-clockwise is +).
    pub angular: Vector3,
}

impl From<BodyTwist<f64>> for Twist {
    fn from(twist: BodyTwist<f64>) -> Self {
        Self {
            linear: [twist.vx_m_s, twist.vy_m_s, 0.0].into(),
            angular: [0.0, 0.0, twist.wz_rad_s].into(),
        }
    }
}

/// `geometry_msgs/msg/TwistStamped`: a twist with its time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistStamped {
    /// Time, and the frame of the twist.
    pub header: Header,
    /// The twist.
    pub twist: Twist,
}

/// `geometry_msgs/msg/Transform`: maps points of the child frame to the parent frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Origin of the child in the parent \[m\].
    pub translation: Vector3,
    /// Rotation from child to parent.
    pub rotation: Quaternion,
}

/// `geometry_msgs/msg/TransformStamped`: a transform between two named frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// Time, and the parent frame.
    pub header: Header,
    /// The child frame.
    pub child_frame_id: String,
    /// Child to parent.
    pub transform: Transform,
}

/// `geometry_msgs/msg/PoseWithCovariance`: a pose and how well it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// Covariance, rows and columns x, y, z \[m\], then about x, y, z \[rad\]; 1e6 is unknown.
    pub covariance: [[f64; 6]; 6],
}

/// `geometry_msgs/msg/PoseWithCovarianceStamped`: the same with its time and frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovarianceStamped {
    /// Time, and the frame of the pose.
    pub header: Header,
    /// The pose.
    pub pose: PoseWithCovariance,
}

/// `geometry_msgs/msg/TwistWithCovariance`: a twist and how well it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The twist.
    pub twist: Twist,
    /// Covariance, rows and columns x, y, z \[m/s\], then about x, y, z \[rad/s\]; 1e6 is unknown.
    pub covariance: [[f64; 6]; 6],
}
