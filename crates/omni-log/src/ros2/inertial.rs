//! Inertial messages of a vehicle, and the time.

use serde::{Deserialize, Serialize};

use super::geometry::{Header, Quaternion, Time, Vector3};

/// `rosgraph_msgs/msg/Clock`: the time of a simulation.
///
/// ```
/// use omni_log::ros2::{Clock, Time, encode};
/// let clock = Clock { clock: Time::from_ns(2_000_000_005) };
/// assert_eq!(encode(&clock)?, [0, 1, 0, 0, 2, 0, 0, 0, 5, 0, 0, 0]);
/// # Ok::<(), cdr_encoding::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    /// Simulated time since the start of the run.
    pub clock: Time,
}

/// `sensor_msgs/msg/Imu`: an inertial measurement unit. A covariance whose first element is -1 says
/// that there is no such measurement; all zero, that it is not known.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// Time and frame of the measurement.
    pub header: Header,
    /// Attitude of the frame, if it is measured.
    pub orientation: Quaternion,
    /// Rows and columns about x, y, z \[rad^2\].
    pub orientation_covariance: [f64; 9],
    /// Rates about the frame's axes \[rad/s\], counter-clockwise positive.
    pub angular_velocity: Vector3,
    /// Rows and columns about x, y, z \[(rad/s)^2\].
    pub angular_velocity_covariance: [f64; 9],
    /// Acceleration less gravity along the frame's axes \[m/s^2\]: at rest 9.81 upwards.
    pub linear_acceleration: Vector3,
    /// Rows and columns along x, y, z \[(m/s^2)^2\].
    pub linear_acceleration_covariance: [f64; 9],
}
