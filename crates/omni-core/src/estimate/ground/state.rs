//! State of the ground odometry: pose, filters, biases and heights of the ground.

use super::biases::Biases;
use super::edges::WheelPath;
use super::grid::{HeightGrid, Track};
use super::height::HeightError;
use super::inertial::InertialFilter;
use super::input::GroundInput;
use super::pose_error::PoseError;
use crate::Real;
use crate::estimate::PoseCovariance;
use crate::linkage::{Attitude, MAX_HINGES};
use crate::scalar::{follow, is_plausible};
use crate::sum::Sum;

/// Pose of the vehicle and heights of the ground: 12 kB in `f32` and 19 kB in `f64`, of which the 512 cells of the
/// ground are 10 kB and 16 kB.
///
/// ```
/// use omni_core::estimate::GroundOdometryState;
/// let mut state = GroundOdometryState::<f32, 7>::new();
/// assert!(state.reset([1.0, 2.0, 0.5], 0.1));
/// assert_eq!(state.pose().position_m, [1.0, 2.0, 0.5]);
/// assert!(core::mem::size_of_val(&state) < 13_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub struct GroundOdometryState<R, const N: usize> {
    pub(super) x: Sum<R>,
    pub(super) y: Sum<R>,
    pub(super) yaw: Sum<R>,
    /// Height of the base's origin above the ground at the start, and the difference of the world's height.
    pub(super) height_m: Sum<R>,
    offset_m: R,
    /// Rates about the base's axes, without biases, and about x and y averaged \[rad/s\].
    pub(super) rates_rad_s: [R; 3],
    tilt_rates_rad_s: [R; 2],
    pub(super) attitude: Attitude<R>,
    /// Hinges without biases, their rates averaged.
    pub(super) hinges_rad: [R; MAX_HINGES],
    pub(super) hinges_rad_s: [R; MAX_HINGES],
    pub(super) biases: Biases<R>,
    pub(super) filter: InertialFilter<R>,
    pub(super) pose_error: PoseError<R>,
    pub(super) height_error: HeightError<R>,
    pub(super) track: Track<R>,
    pub(super) grid: HeightGrid<R>,
    /// The ground at the start is known, and the vehicle has moved since.
    pub(super) started: bool,
    pub(super) moved: bool,
    /// Time for which the wheels have agreed on another velocity than the predicted one \[s\].
    pub(super) lost_s: R,
    /// Average of [`MotionEstimate::disagreement_m2_s2`](super::wheel_motion::MotionEstimate).
    pub(super) disagreement_m2_s2: R,
    /// Rate of rise of the base, averaged.
    pub(super) base_rise_m_s: R,
    /// Height of each contact above the base's origin, and of the ground below it.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) contact_m: [R; N],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) ground_m: [R; N],
    /// Slope of the path of each wheel, averaged, and of the ground below the vehicle \[m/m\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) slope: [R; N],
    pub(super) ground_slope: [R; 2],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) paths: [WheelPath<R>; N],
}

/// Pose in three dimensions: [`GroundOdometryState::pose`].
///
/// ```
/// use omni_core::estimate::GroundOdometryState;
/// let pose = GroundOdometryState::<f64, 3>::new().pose();
/// assert_eq!((pose.position_m, pose.yaw_rad), ([0.0; 3], 0.0));
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
    /// Height of each wheel's contact in the world \[m\]; NaN before the first step.
    pub contact_m: [R; N],
    /// Slope of the plane with the least squared distance from the contacts \[m/m\]: along the heading and to its
    /// left.
    pub slope: [R; 2],
}

impl<R: Real, const N: usize> Default for GroundOdometryState<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real, const N: usize> GroundOdometryState<R, N> {
    /// At the origin, facing +x, on even ground.
    #[must_use]
    pub fn new() -> Self {
        let zero = R::zero();
        let nan = R::of(f64::NAN);
        let none = Sum::of(zero);
        Self {
            x: none,
            y: none,
            yaw: none,
            height_m: none,
            offset_m: zero,
            rates_rad_s: [zero; 3],
            tilt_rates_rad_s: [zero; 2],
            attitude: Attitude::LEVEL,
            hinges_rad: [zero; MAX_HINGES],
            hinges_rad_s: [zero; MAX_HINGES],
            biases: Biases::none(),
            filter: InertialFilter::at_rest(),
            pose_error: PoseError::none(),
            height_error: HeightError::none(),
            track: Track::start(),
            grid: HeightGrid::EMPTY,
            started: false,
            moved: false,
            lost_s: zero,
            disagreement_m2_s2: zero,
            base_rise_m_s: zero,
            contact_m: [nan; N],
            ground_m: [nan; N],
            slope: [zero; N],
            ground_slope: [zero; 2],
            paths: [WheelPath::NONE; N],
        }
    }

    /// Sets position and yaw, which is wrapped. The heights of the ground and the covariance stay. False, and nothing
    /// changed, if a value is not finite.
    ///
    /// ```
    /// use omni_core::estimate::GroundOdometryState;
    /// let mut state = GroundOdometryState::<f64, 4>::new();
    /// assert!(state.reset([0.0, 0.0, 0.2], 7.0));
    /// assert!((state.pose().yaw_rad - (7.0 - core::f64::consts::TAU)).abs() < 1e-15);
    /// assert!(!state.reset([f64::NAN, 0.0, 0.0], 0.0));
    /// ```
    pub fn reset(&mut self, position_m: [R; 3], yaw_rad: R) -> bool {
        let [x, y, z] = position_m;
        let finite = [x, y, z, yaw_rad].iter().all(|each| each.is_finite_real());
        if finite {
            self.x = Sum::of(x);
            self.y = Sum::of(y);
            self.yaw = Sum::of(yaw_rad.wrapped_angle());
            self.offset_m = z - self.height_m.total;
        }
        finite
    }

    /// Position, attitude and contacts of the wheels.
    ///
    /// ```
    /// use omni_core::estimate::GroundOdometryState;
    /// let pose = GroundOdometryState::<f32, 6>::new().pose();
    /// assert_eq!(pose.position_m[2], 0.0);
    /// assert!(pose.contact_m[0].is_nan()); // until the first step
    /// ```
    #[must_use]
    pub fn pose(&self) -> GroundPose<R, N> {
        let height_m = self.height_m.total + self.offset_m;
        GroundPose {
            position_m: [self.x.total, self.y.total, height_m],
            roll_rad: self.attitude.left_up_rad,
            pitch_rad: self.attitude.nose_up_rad,
            yaw_rad: self.yaw.total.wrapped_angle(),
            contact_m: self.contact_m.map(|each| each + height_m),
            slope: self.ground_slope,
        }
    }

    /// Covariance of x, y and yaw.
    ///
    /// ```
    /// use omni_core::estimate::GroundOdometryState;
    /// assert_eq!(GroundOdometryState::<f32, 6>::new().covariance().standard_deviations(), [0.0; 3]);
    /// ```
    #[must_use]
    pub fn covariance(&self) -> PoseCovariance<R> {
        PoseCovariance::of(self.pose_error.covariance())
    }

    /// Variance of the height \[m^2\]. It grows with the distance while no wheel is on ground of known height.
    #[must_use]
    pub fn height_variance_m2(&self) -> R {
        self.height_error.variance_m2
    }

    /// Updates the biases of a vehicle that stands.
    pub(super) fn learn_biases(&mut self, input: &GroundInput<R, N>, gyro_rad_s: R) {
        if let Some(part) = self.biases.learn(input) {
            self.pose_error.measure_bias(gyro_rad_s * gyro_rad_s * part);
        }
    }

    /// Updates attitude and hinges; the rates are averaged, with weight `part` of the newest one. A hinge without a
    /// reading keeps its angle, with a rate of 0.
    pub(super) fn read(&mut self, input: &GroundInput<R, N>, part: R) {
        let known = |value: R, otherwise: R| if is_plausible(value) { value } else { otherwise };
        let read_rad = self.biases.hinges(&input.hinges_rad);
        for (angle, read) in self.hinges_rad.iter_mut().zip(read_rad) {
            *angle = known(read, *angle);
        }
        let [p, q, _] = self.rates_rad_s;
        let read = input.hinges_rad_s.into_iter().chain([p, q]);
        let averages = self.hinges_rad_s.iter_mut().chain(&mut self.tilt_rates_rad_s);
        for (average, read) in averages.zip(read) {
            follow(average, known(read, R::zero()), part);
        }
        self.attitude = self.filter.attitude(self.tilt_rates_rad_s);
    }
}
