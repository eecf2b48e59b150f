//! Odometry in three dimensions: position, height, attitude and edges of the ground from wheels, hinges and gyros.
//!
//! Encoders of wheels and hinges, gyros and the attitude of the base determine where the centre of each wheel is and
//! how it moves. The centre of a wheel that climbs moves along a sloped path. The slope follows from the linkage, as
//! the contact angles of Lamon and Siegwart (*3D position tracking in challenging terrain*, Int. J. of Robotics
//! Research 26, 2007). The first wheel that passes over ground records its height in a small grid. Wheels that pass
//! over the same ground later determine the height of the vehicle.
//!
//! The equations are in docs/derivations.md, *Odometry in three dimensions*.

mod biases;
mod config;
mod edges;
mod grid;
mod height;
mod inertial;
mod input;
mod pose_error;
mod standing;
mod state;
mod step;
mod wheel_motion;

use crate::constants::constant_struct;
use crate::geometry::WheelLayout;
use crate::linkage::Linkage;
use crate::{ConfigError, Real};
pub use config::GroundOdometryConfig;
pub use edges::{EdgeEvent, EdgeKind};
pub use input::GroundInput;
pub use state::{GroundOdometryState, GroundPose};

/// Odometry in three dimensions of a vehicle with `N` wheels. Immutable; the changing state is in
/// [`GroundOdometryState`].
///
/// Each period
///
/// 1. gyros and accelerometer predict velocity and lean of the base. Without accelerometer the lean is the measured
///    one, and the velocity follows a random walk;
/// 2. the speed of each wheel's rim is a linear equation of the vehicle's velocity, along the path of the wheel's
///    centre. The path rises by attitude and hinges, and the encoder's reading is corrected by the rotation of the
///    carrier. The velocity is the solution by least squares over the prediction, the gyro and all wheels; the weight
///    of a wheel that slips or is lifted decreases with its residual;
/// 3. the velocity corrects lean and position by their covariance with it (a Kalman filter);
/// 4. wheels on ground of known height determine the height of the vehicle, those on even ground with the largest
///    weight. If no wheel is on known ground, the ground is assumed to continue with its slope, and the standard
///    deviation of the height grows by a tenth of the distance;
/// 5. each wheel records the height of its contact in cells without a height, and the path of each wheel is searched
///    for edges.
///
/// While the vehicle stands, the mean readings of the gyros are their biases. On level ground the mean readings of
/// roll, pitch, hinges and accelerometer also are: an error of 4 mrad would be a false rise of 4 mm per metre.
///
/// Limits: it is not a map. The grid has 512 cells; ground that has left them is unknown when the vehicle returns.
///
/// ```
/// use omni_core::estimate::{GroundInput, GroundOdometry, GroundOdometryConfig, GroundOdometryState};
/// use omni_core::geometry::Wheel;
/// use omni_core::linkage::{CarriedWheel, Linkage};
/// use omni_core::policy::Imu;
/// use omni_core::WheelLayout;
/// let layout = WheelLayout::<f64, 4>::mecanum4(0.5, 0.4, 0.076)?;
/// let wheel = |wheel: Wheel<f64>| CarriedWheel {
///     body: 0,
///     centre_m: [wheel.position_m[0], wheel.position_m[1], wheel.radius_m],
/// };
/// let linkage = Linkage::new(&[], &layout.wheels().map(wheel))?;
/// let odometry = GroundOdometry::new(GroundOdometryConfig::new(0.005), &layout, linkage)?;
/// let mut state = GroundOdometryState::new();
/// // A second on level ground with a gyro bias of 0.01 rad/s, then forward at 0.3 m/s.
/// let mut imu = Imu::level();
/// imu.rate_rad_s[2] = 0.01;
/// for _ in 0..200 {
///     odometry.step(&mut state, &GroundInput::new(&[0.0; 4].into(), &imu).at_rest(true));
/// }
/// for period in 0..1000 {
///     imu.specific_force_m_s2[0] = if period < 100 { 0.6 } else { 0.0 };
///     let speed = 0.3 * f64::min(f64::from(period + 1) / 100.0, 1.0);
///     odometry.step(&mut state, &GroundInput::new(&[speed / 0.076; 4].into(), &imu));
/// }
/// let [x, y, z] = state.pose().position_m;
/// assert!((x - 1.4258).abs() < 3e-3 && y.abs() < 1e-3 && z.abs() < 1e-3);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct GroundOdometry<R, const N: usize> {
    config: GroundOdometryConfig<R>,
    linkage: Linkage<R, N>,
    radius_m: [R; N],
    /// Speed of each rim per velocity of its actuator \[m/rad\].
    rim_m_rad: [R; N],
    /// Rolling direction of each wheel.
    direction: [[R; 2]; N],
    /// Cosine and sine of each roller's angle to the rolling direction.
    roller: [[R; 2]; N],
}

constant_struct!(GroundOdometry<R, const N> {
    config: GroundOdometryConfig<R>,
    linkage: Linkage<R, N>,
    radius_m: [R; N],
    rim_m_rad: [R; N],
    direction: [[R; 2]; N],
    roller: [[R; 2]; N],
});

/// Result of a step of a [`GroundOdometry`].
///
/// ```
/// use omni_core::estimate::GroundStep;
/// let climbs = |step: &GroundStep<f32, 7>| step.edges.iter().flatten().any(|edge| edge.height_m > 0.02);
/// # let _ = climbs;
/// assert_eq!(core::mem::size_of::<GroundStep<f32, 7>>() % 4, 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GroundStep<R, const N: usize> {
    /// Each wheel's event at an edge in this period.
    pub edges: [Option<EdgeEvent<R>>; N],
    /// At least one wheel is on ground of known height. If none is, the variance of the height grows.
    pub follows: bool,
    /// False if the result was not finite: velocity and lean are reset to rest, and the pose stays.
    pub taken: bool,
}

impl<R: Real, const N: usize> GroundStep<R, N> {
    /// The step of a vehicle that stands.
    const STANDING: Self = Self {
        edges: [None; N],
        follows: true,
        taken: true,
    };
}

impl<R: Real, const N: usize> GroundOdometry<R, N> {
    /// For a vehicle with this layout of wheels on this linkage, in the same order.
    ///
    /// # Errors
    /// The field of [`GroundOdometryConfig`] that is out of range, by its name.
    pub fn new(
        config: GroundOdometryConfig<R>,
        layout: &WheelLayout<R, N>,
        linkage: Linkage<R, N>,
    ) -> Result<Self, ConfigError> {
        let wheels = layout.wheels();
        Ok(Self {
            config: config.checked()?,
            linkage,
            radius_m: wheels.map(|wheel| wheel.radius_m),
            rim_m_rad: wheels.map(|wheel| wheel.radius_m * wheel.wheel_per_actuator()),
            direction: wheels.map(|wheel| wheel.unit_direction()),
            roller: wheels.map(|wheel| {
                let (sin, cos) = wheel.roller_angle_rad.sine_cosine();
                [cos, sin]
            }),
        })
    }
}

#[cfg(test)]
mod tests;
