//! Trajectory following for a vehicle that moves in every direction: feedforward, and feedback of the pose.

use crate::constants::constant_struct;
use crate::error::within;
use crate::geometry::{BodyTwist, PlanarPose, WorldTwist};
use crate::path::TrajectorySample;
use crate::{ConfigError, Real};

/// Gains and limits of a [`HolonomicFollower`].
///
/// ```
/// use omni_core::path::{FollowerConfig, HolonomicFollower};
/// let config = FollowerConfig { gain_per_s: -1.0, heading_gain_per_s: 2.0, limit_m_s: 0.2, limit_rad_s: 0.5 };
/// let error = HolonomicFollower::new(config).unwrap_err();
/// assert_eq!(error.to_string(), "gain_per_s = -1, allowed: 0 to 1000");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct FollowerConfig<R> {
    /// Velocity asked for per distance \[m/s per m\], 0 to 1000. Its inverse is the time constant
    /// of the return: it should be several times the time constant of the wheels' loops.
    pub gain_per_s: R,
    /// Yaw rate asked for per heading error \[rad/s per rad\], 0 to 1000; as above.
    pub heading_gain_per_s: R,
    /// Largest correction of the velocity, as a vector \[m/s\], 0 to 1000.
    pub limit_m_s: R,
    /// Largest correction of the yaw rate \[rad/s\], 0 to 1000.
    pub limit_rad_s: R,
}

constant_struct!(FollowerConfig<R> { gain_per_s: R, heading_gain_per_s: R, limit_m_s: R, limit_rad_s: R });

/// At the end of a trajectory a vehicle this near to the last pose is there \[m\], \[rad\].
const THERE: [f64; 2] = [0.005, 0.01];
/// After [`SETTLES_S`], this multiple is near enough, so that noise and drift of the pose are not corrected.
const STAYS: f64 = 3.0;
/// Settling time after the end \[s\]: four time constants of the default gain.
const SETTLES_S: f64 = 2.0;

/// Result of a [`HolonomicFollower`]: the errors and the command.
///
/// ```
/// use omni_core::geometry::PlanarPose;
/// use omni_core::path::{FollowerConfig, HolonomicFollower, Trajectory};
/// let config = FollowerConfig { gain_per_s: 2.0, heading_gain_per_s: 2.0, limit_m_s: 0.2, limit_rad_s: 0.5 };
/// let end = Trajectory::<f64>::new(&[], &[]).at(1.0); // to stay at the origin
/// let beside = PlanarPose { x_m: 0.0, y_m: 0.05, yaw_rad: 0.0 };
/// let follow = HolonomicFollower::new(config)?.step(&end, &beside);
/// assert_eq!((follow.error_m, follow.twist.vy_m_s), ([0.0, -0.05], -0.1));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct Follow<R> {
    /// The twist to command \[m/s, m/s, rad/s\].
    pub twist: BodyTwist<R>,
    /// Position error in the vehicle frame: forward, left \[m\]. 0 if the pose is not known.
    pub error_m: [R; 2],
    /// Heading error, by the shorter turn \[rad\], in (-pi, pi]. 0 if the pose is not known.
    pub error_rad: R,
}

/// Follows a trajectory: its velocity in the vehicle frame, and a correction proportional to the pose error. Goes
/// before the limits of the twist. It has no state.
///
/// The correction of the velocity is limited as a vector, so that its direction stays; the yaw rate correction follows
/// the shorter turn.
///
/// After the end of the trajectory the command is exactly 0, so that the torque ends, while the vehicle is
/// within 5 mm and 0.01 rad of the last pose, from 2 s after the end on within 15 mm and 0.03 rad. Farther
/// away it is brought back. A pose that is not finite corrects nothing: the trajectory's own twist is driven.
///
/// ```
/// use omni_core::path::{FollowerConfig, HolonomicFollower, PathPiece, PathSegment, Waypoint};
/// # let planner = omni_core::examples::planner()?;
/// # let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
/// let left = planner.plan(&[Waypoint::at(0.0, 0.0), Waypoint::at(0.0, 3.0)], &mut segments, &mut pieces)?;
/// let config = FollowerConfig { gain_per_s: 2.0, heading_gain_per_s: 2.0, limit_m_s: 0.2, limit_rad_s: 0.5 };
/// let follower = HolonomicFollower::new(config)?;
/// let halfway = left.at(0.5 * left.duration_s());
/// // There, but looking to the left as well: what was to the left is ahead, and it turns back as quickly as it may.
/// let mut pose = halfway.pose;
/// pose.yaw_rad = core::f64::consts::FRAC_PI_2;
/// let follow = follower.step(&halfway, &pose);
/// assert!((follow.twist.vx_m_s - 0.5).abs() < 1e-9 && follow.twist.vy_m_s.abs() < 1e-9);
/// assert_eq!(follow.twist.wz_rad_s, -0.5);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct HolonomicFollower<R> {
    config: FollowerConfig<R>,
}

constant_struct!(HolonomicFollower<R> { config: FollowerConfig<R> });

impl<R: Real> HolonomicFollower<R> {
    /// A follower with these gains.
    ///
    /// # Errors
    /// Parameter `gain_per_s`, `heading_gain_per_s`, `limit_m_s` or `limit_rad_s`.
    pub fn new(config: FollowerConfig<R>) -> Result<Self, ConfigError> {
        for (name, value) in [
            ("gain_per_s", config.gain_per_s),
            ("heading_gain_per_s", config.heading_gain_per_s),
            ("limit_m_s", config.limit_m_s),
            ("limit_rad_s", config.limit_rad_s),
        ] {
            within(name, value, 0.0..=1000.0, "0 to 1000")?;
        }
        Ok(Self { config })
    }

    /// The twist to command, for a vehicle at `pose` with the reference `sample`.
    ///
    /// ```
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::path::{FollowerConfig, HolonomicFollower, Trajectory};
    /// let config = FollowerConfig { gain_per_s: 2.0, heading_gain_per_s: 2.0, limit_m_s: 0.2, limit_rad_s: 0.5 };
    /// let follower = HolonomicFollower::new(config)?;
    /// let stay = Trajectory::<f64>::new(&[], &[]).at(1.0);
    /// // 3 m and 4 m away: 0.2 m/s in that direction.
    /// let twist = follower.step(&stay, &PlanarPose { x_m: -3.0, y_m: -4.0, yaw_rad: 0.0 }).twist;
    /// assert!((twist.vx_m_s - 0.12).abs() < 1e-12 && (twist.vy_m_s - 0.16).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn step(&self, sample: &TrajectorySample<R>, pose: &PlanarPose<R>) -> Follow<R> {
        let FollowerConfig {
            gain_per_s,
            heading_gain_per_s,
            limit_m_s,
            limit_rad_s,
        } = self.config;
        let (dx, dy) = (sample.pose.x_m - pose.x_m, sample.pose.y_m - pose.y_m);
        let error_rad = (sample.pose.yaw_rad - pose.yaw_rad).wrapped_angle();
        // Squares that overflow would be no number either.
        let square = dx * dx + dy * dy;
        if !(square.is_finite_real() && error_rad.is_finite_real()) {
            return Follow {
                twist: sample.feed_forward(),
                error_m: [R::ZERO; 2],
                error_rad: R::ZERO,
            };
        }
        let distance = square.sqrt();
        let near = if sample.over_s < R::of(SETTLES_S) {
            R::ONE
        } else {
            R::of(STAYS)
        };
        let [near_m, near_rad] = THERE.map(|near_by| near * R::of(near_by));
        let rests = sample.done && distance <= near_m && error_rad.abs() <= near_rad;
        let gain = if gain_per_s * distance > limit_m_s {
            limit_m_s / distance
        } else {
            gain_per_s
        };
        let (sin, cos) = pose.yaw_rad.sine_cosine();
        let WorldTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        } = sample.velocity;
        let (x, y) = (vx_m_s + gain * dx, vy_m_s + gain * dy);
        Follow {
            twist: if rests {
                BodyTwist::ZERO
            } else {
                BodyTwist {
                    vx_m_s: cos * x + sin * y,
                    vy_m_s: cos * y - sin * x,
                    wz_rad_s: wz_rad_s + (heading_gain_per_s * error_rad).limited(-limit_rad_s, limit_rad_s),
                }
            },
            error_m: [cos * dx + sin * dy, cos * dy - sin * dx],
            error_rad,
        }
    }
}

#[cfg(test)]
mod tests;
