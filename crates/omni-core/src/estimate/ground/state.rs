//! State of the ground odometry: the estimator's, lean, and heights of the ground.

use super::GroundOdometry;
use super::edges::WheelPath;
use super::grid::{HeightGrid, Track};
use super::height::HeightError;
use super::lean::Lean;
use super::push::Push;
use crate::Real;
use crate::estimate::{EstimatorState, PoseCovariance};
use crate::geometry::PlanarPose;
use crate::sum::Sum;

/// Pose of the vehicle and heights of the ground. Made by [`GroundOdometry::start`]. Of it the 512 cells of the ground
/// are 10 kB in `f32` and 16 kB in `f64`.
///
/// ```
/// assert!(core::mem::size_of::<omni_core::estimate::GroundOdometryState<f32, 7>>() < 14_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub struct GroundOdometryState<R, const N: usize> {
    pub(super) planar: EstimatorState<R, N>,
    pub(super) lean: Lean<R>,
    pub(super) push: Push<R>,
    /// Height of the base's origin above the ground at the start, and the difference of the world's height.
    pub(super) height_m: Sum<R>,
    pub(super) offset_m: R,
    pub(super) height_error: HeightError<R>,
    pub(super) track: Track<R>,
    pub(super) grid: HeightGrid<R>,
    /// The ground at the start is known; the vehicle stands; it has moved since the start.
    pub(super) started: bool,
    pub(super) standing: bool,
    pub(super) moved: bool,
    /// Rate of rise of the base, averaged.
    pub(super) base_rise_m_s: R,
    /// Height of each contact above the base's origin, and of the ground below it; NaN if it is not known.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) contact_m: [R; N],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) ground_m: [R; N],
    /// Slope of the path of each wheel, averaged, and of the ground below the vehicle \[m/m\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) slope: [R; N],
    pub(super) ground_slope: [R; 2],
    /// The latter, along the displacement.
    pub(super) plane_slope: R,
    /// Distance since a wheel was on an edge or all slipped \[m\]; not beyond what matters.
    pub(super) even_m: R,
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) paths: [WheelPath<R>; N],
}

/// Pose in three dimensions: [`GroundOdometryState::pose`].
///
/// ```
/// let height = |pose: &omni_core::estimate::GroundPose<f32, 4>| pose.position_m[2];
/// # let _ = height;
/// assert_eq!(core::mem::size_of::<omni_core::estimate::GroundPose<f32, 4>>(), 48);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GroundPose<R, const N: usize> {
    /// Position of the base's origin in the world \[m\].
    pub position_m: [R; 3],
    /// Angle of the base's y axis above the horizon \[rad\]: left side up.
    pub roll_rad: R,
    /// Angle of the base's x axis above the horizon \[rad\]: nose up.
    pub pitch_rad: R,
    /// Heading, counter-clockwise, in (-pi, pi] \[rad\].
    pub yaw_rad: R,
    /// Height of each wheel's contact in the world \[m\]; NaN where it is not known, and before the first step.
    pub contact_m: [R; N],
    /// Slope of the plane with the least squared distance from the contacts \[m/m\]: along the heading and to its
    /// left.
    pub slope: [R; 2],
}

impl<R: Real, const N: usize> GroundOdometry<R, N> {
    /// At the origin, facing +x, at rest on level ground.
    ///
    /// ```
    /// # let odometry = omni_core::examples::ground_odometry()?;
    /// assert_eq!(odometry.start().pose().position_m, [0.0; 3]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn start(&self) -> GroundOdometryState<R, N> {
        let zero = R::zero();
        let nan = R::of(f64::NAN);
        GroundOdometryState {
            planar: self.estimator.start(),
            lean: Lean::LEVEL,
            push: Push::NONE,
            height_m: Sum::of(zero),
            offset_m: zero,
            height_error: HeightError::none(),
            track: Track::start(),
            grid: HeightGrid::EMPTY,
            started: false,
            standing: false,
            moved: false,
            base_rise_m_s: zero,
            contact_m: [nan; N],
            ground_m: [nan; N],
            slope: [zero; N],
            ground_slope: [zero; 2],
            plane_slope: zero,
            even_m: R::one(),
            paths: [WheelPath::NONE; N],
        }
    }
}

impl<R: Real, const N: usize> GroundOdometryState<R, N> {
    /// Sets the pose in the plane with its uncertainty, as [`EstimatorState::reset`], and the height. The heights of
    /// the ground stay relative to the vehicle. False, and nothing changed, if a value is not finite.
    ///
    /// ```
    /// # let odometry = omni_core::examples::ground_odometry()?;
    /// use omni_core::estimate::PoseCovariance;
    /// use omni_core::geometry::PlanarPose;
    /// let mut state = odometry.start();
    /// let pose = PlanarPose { x_m: 1.0, y_m: 2.0, yaw_rad: 0.1 };
    /// assert!(state.reset(&pose, &PoseCovariance::default(), 0.5));
    /// assert_eq!(state.pose().position_m, [1.0, 2.0, 0.5]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn reset(&mut self, pose: &PlanarPose<R>, known: &PoseCovariance<R>, height_m: R) -> bool {
        let taken = height_m.is_finite_real() && self.planar.reset(pose, known);
        if taken {
            self.offset_m = height_m - self.height_m.total;
        }
        taken
    }

    /// Position, attitude and contacts of the wheels.
    ///
    /// ```
    /// # let odometry = omni_core::examples::ground_odometry()?;
    /// let pose = odometry.start().pose();
    /// assert!(pose.position_m[2] == 0.0 && pose.contact_m[0].is_nan()); // until the first step
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn pose(&self) -> GroundPose<R, N> {
        let height_m = self.height_m.total + self.offset_m;
        let planar = self.planar.pose();
        let attitude = self.lean.attitude();
        GroundPose {
            position_m: [planar.x_m, planar.y_m, height_m],
            roll_rad: attitude.left_up_rad,
            pitch_rad: attitude.nose_up_rad,
            yaw_rad: planar.yaw_rad,
            contact_m: self.contact_m.map(|each| each + height_m),
            slope: self.ground_slope,
        }
    }

    /// The estimator's state: pose in the plane, its covariance, twist and slip.
    #[must_use]
    pub fn planar(&self) -> &EstimatorState<R, N> {
        &self.planar
    }

    /// Variance of the height \[m^2\]. It grows with the distance while no wheel is on ground of known height.
    #[must_use]
    pub fn height_variance_m2(&self) -> R {
        self.height_error.variance_m2
    }
}
