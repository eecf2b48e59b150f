//! Poses that other nodes send, and the frames that these are in.

use std::sync::{Mutex, PoisonError};

use omni_core::geometry::PlanarPose;

use crate::ros2::{Header, Pose};
use crate::urdf::{MAP_LINK, ODOM_LINK};

/// The norm of an attitude's quaternion is 1 within this: clients round.
const NORM_WITHIN: f64 = 0.01;

/// The vehicle's pose.
#[derive(Clone, Copy)]
pub(super) struct Poses {
    pub(super) in_map: PlanarPose<f64>,
    pub(super) by_odometry: PlanarPose<f64>,
}

impl Poses {
    /// A pose in the frame of odometry as the map has it.
    fn to_map(self, pose: &PlanarPose<f64>) -> PlanarPose<f64> {
        let turn = self.in_map.yaw_rad - self.by_odometry.yaw_rad;
        let (sin, cos) = turn.sin_cos();
        let (x_m, y_m) = (pose.x_m - self.by_odometry.x_m, pose.y_m - self.by_odometry.y_m);
        PlanarPose {
            x_m: self.in_map.x_m + cos * x_m - sin * y_m,
            y_m: self.in_map.y_m + sin * x_m + cos * y_m,
            yaw_rad: pose.yaw_rad + turn,
        }
    }
}

/// The place of the vehicle, and with it the frame of its odometry.
pub(super) struct Frames {
    /// Name of the frame of odometry.
    odom: String,
    /// None before the first period of a run.
    poses: Mutex<Option<Poses>>,
}

impl Frames {
    /// With what stands before the names of frames.
    pub(super) fn new(prefix: &str) -> Self {
        Self {
            odom: format!("{prefix}{ODOM_LINK}"),
            poses: Mutex::default(),
        }
    }

    /// The vehicle is there now; nowhere, before a run's first period.
    pub(super) fn set(&self, poses: Option<Poses>) {
        *self.poses.lock().unwrap_or_else(PoisonError::into_inner) = poses;
    }

    /// The place of the vehicle, or that it is not known.
    pub(super) fn poses(&self) -> Result<Poses, String> {
        let poses = *self.poses.lock().unwrap_or_else(PoisonError::into_inner);
        poses.ok_or_else(|| "the run has not begun".into())
    }

    /// A pose of another node in the plane of the map.
    pub(super) fn in_map(&self, header: &Header, pose: &Pose) -> Result<PlanarPose<f64>, String> {
        let pose = planar(pose)?;
        match header.frame_id.trim_start_matches('/') {
            MAP_LINK => Ok(pose),
            odom if odom == self.odom => Ok(self.poses()?.to_map(&pose)),
            frame => Err(format!(
                "a pose in the frame {frame:?}, allowed: {MAP_LINK}, {}",
                self.odom
            )),
        }
    }
}

/// The pose in the plane of its frame.
fn planar(pose: &Pose) -> Result<PlanarPose<f64>, String> {
    let Pose {
        position: at,
        orientation: q,
    } = pose;
    let norm = (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w).sqrt();
    if !(1.0 - NORM_WITHIN..=1.0 + NORM_WITHIN).contains(&norm) {
        return Err(format!("orientation: a quaternion of norm {norm}, allowed: 1"));
    }
    Ok(PlanarPose {
        x_m: at.x,
        y_m: at.y,
        yaw_rad: (2.0 * (q.w * q.z + q.x * q.y)).atan2(1.0 - 2.0 * (q.y * q.y + q.z * q.z)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose([x, y]: [f64; 2], q: [f64; 4]) -> Pose {
        Pose {
            position: [x, y, 0.0].into(),
            orientation: q.into(),
        }
    }

    #[test]
    fn what_is_no_attitude_is_refused_by_its_norm() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turned = planar(&pose([1.0, -2.0], [0.0, 0.0, half, half])).expect("a pose");
        assert!((turned.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        for (wrong, part) in [
            ([0.0; 4], "norm 0, allowed: 1"),
            ([f64::INFINITY; 4], "norm inf, allowed: 1"),
        ] {
            let said = planar(&pose([1.0, 0.0], wrong)).expect_err(part);
            assert!(said.contains(part), "{said}");
        }
    }
}
