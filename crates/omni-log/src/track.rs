//! The vehicle's pose over time, from a log.

use crate::ros2::Odometry;

/// Poses in the plane, one a message of `/odom` or `/ground_truth/odom`.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Track {
    /// Times of the messages \[s\].
    pub time_s: Vec<f64>,
    /// x, y \[m\] and yaw \[rad\], in the message's own frame.
    pub poses: Vec<[f64; 3]>,
    /// Variance of x, covariance of x and y, variance of y \[m^2\], variance of the yaw \[rad^2\].
    pub variances: Vec<[f64; 4]>,
}

impl Track {
    pub(crate) fn add(&mut self, time_ns: u64, message: &Odometry) {
        let (place, turn) = (&message.pose.pose.position, &message.pose.pose.orientation);
        let yaw_rad = libm::atan2(
            2.0 * (turn.w * turn.z + turn.x * turn.y),
            1.0 - 2.0 * (turn.y * turn.y + turn.z * turn.z),
        );
        let [[xx, xy, ..], [_, yy, ..], .., [.., yaw]] = message.pose.covariance;
        self.time_s.push(time_ns as f64 / 1e9);
        self.poses.push([place.x, place.y, yaw_rad]);
        self.variances.push([xx, xy, yy, yaw]);
    }
}
