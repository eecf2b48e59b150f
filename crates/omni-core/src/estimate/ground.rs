//! Odometry in three dimensions: height, lean and edges of the ground, beside the estimate in the plane.
//!
//! An [`Estimator`] finds x, y and yaw. It takes each wheel to roll on even ground; the speeds that it reads here are
//! those of wheels on even ground. Attitude and hinges determine where the centre of each wheel is and how it moves,
//! as the contact angles of Lamon and Siegwart (*3D position tracking in challenging terrain*, Int. J. of Robotics
//! Research 26, 2007). The first wheel that passes over ground records its height in a small grid. Wheels that pass
//! over the same ground later determine the height of the vehicle.
//!
//! The equations are in docs/derivations.md, *Odometry in three dimensions*.

mod config;
mod edges;
mod grid;
mod height;
mod input;
mod lean;
mod push;
mod rolling;
mod state;
mod step;

use crate::constants::constant_struct;
use crate::estimate::{Estimator, EstimatorConfig};
use crate::geometry::{Kinematics, WheelLayout};
use crate::linkage::Linkage;
use crate::scalar::max;
use crate::{ConfigError, Real};
pub use config::GroundOdometryConfig;
pub use edges::{EdgeEvent, EdgeKind};
pub use input::GroundInput;
use rolling::RollingWheel;
pub use state::{GroundOdometryState, GroundPose};

/// Odometry in three dimensions of a vehicle with `N` wheels. Immutable; the changing state is in
/// [`GroundOdometryState`].
///
/// Each period
///
/// 1. the lean of the base turns by what its measured angles change, or else by the gyros. Both drift. Velocity that
///    the accelerometer gains steadily beyond the wheels is an error of the lean, which is corrected; not on edges, nor
///    where all wheels slip;
/// 2. the reading of each wheel is converted to that of a wheel on even ground: the centre of a wheel that climbs at
///    the rate h' moves by `sqrt(s^2 - h'^2)` over the ground while its rim moves by s;
/// 3. the [`Estimator`] finds x, y, yaw and slip, without the wheels that are on an edge if most others are not, and
///    without any wheel in a jolt of the base. Torques show an edge that holds the vehicle while all its wheels turn;
/// 4. wheels on ground of known height determine the height of the vehicle, those on even ground with the largest
///    weight. If no wheel is on known ground, the vehicle rises as the plane of its contacts, and the standard
///    deviation of the height grows by a tenth of the distance;
/// 5. each wheel records the height of its contact in cells without a height, and the path of each wheel is searched
///    for edges.
///
/// While the vehicle stands, the mean readings of the gyros are their biases. The ground below it before it first
/// moves counts as level: the mean readings of roll, pitch, hinges and accelerometer are then biases. An error of 4
/// mrad would be a false rise of 4 mm per metre.
///
/// What is not known is NaN: the height of a wheel behind a hinge without a reading. Such wheels count as on even
/// ground for the place, and for the height not at all. Without any reading of the lean nothing is followed.
///
/// Limits: it is meant for 100 to 200 Hz with the mean readings of each period; hinge angles of single readings each
/// millisecond make a ramp 6 mm too low. It is not a map: of the 512 cells the oldest are replaced, and ground that
/// has left them is unknown when the vehicle returns. With three wheels no wheel follows another, and in directions in
/// which no wheel does the height is only that of the plane. Slip along an edge that is met at an angle is not seen.
/// docs/estimate.md has the measured accuracy.
///
/// ```
/// use omni_core::estimate::{EstimatorConfig, GroundInput, GroundOdometry, GroundOdometryConfig};
/// use omni_core::geometry::Wheel;
/// use omni_core::linkage::{CarriedWheel, Linkage};
/// use omni_core::policy::Imu;
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let layout = WheelLayout::<f64, 4>::mecanum4(0.5, 0.4, 0.076)?;
/// let wheel = |wheel: Wheel<f64>| CarriedWheel {
///     body: 0,
///     centre_m: [wheel.position_m[0], wheel.position_m[1], wheel.radius_m],
/// };
/// let linkage = Linkage::new(&[], &layout.wheels().map(wheel))?;
/// let (config, period_s) = (GroundOdometryConfig::new(), 0.005);
/// let odometry = GroundOdometry::new(config, EstimatorConfig::new(period_s), &layout, linkage)?;
/// let mut state = odometry.start();
/// // On even ground, onto a ramp of 0.1 rad and up: the lean is measured.
/// let (kinematics, mut imu) = (Kinematics::new(&layout)?, Imu::level());
/// let command = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// for (periods, pitch_rad_s) in [(200, 0.0), (334, 0.06), (400, 0.0)] {
///     imu.rate_rad_s[1] = -pitch_rad_s; // nose up is negative about y
///     for _ in 0..periods {
///         imu.pitch_rad += pitch_rad_s * period_s;
///         imu.specific_force_m_s2 = [9.81 * imu.pitch_rad.sin(), 0.0, 9.81 * imu.pitch_rad.cos()];
///         if state.pose().contact_m[0].is_nan() {
///             imu.specific_force_m_s2[0] = 0.3 / period_s; // at once
///         }
///         odometry.step(&mut state, &GroundInput::new(&kinematics.inverse(&command), &imu, &command));
///     }
/// }
/// // 0.6 m up the ramp, and half of that while its wheels came onto it.
/// let [_, _, z] = state.pose().position_m;
/// assert!((z - 0.085).abs() < 0.005, "{z}");
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct GroundOdometry<R, const N: usize> {
    config: GroundOdometryConfig<R>,
    estimator: Estimator<R, N>,
    linkage: Linkage<R, N>,
    position_m: [[R; 2]; N],
    radius_m: [R; N],
    wheel_per_actuator: [R; N],
    /// Rolling direction of each wheel.
    direction: [[R; 2]; N],
    /// Tangent of each roller's angle to the rolling direction.
    roller: [R; N],
}

constant_struct!(GroundOdometry<R, const N> {
    config: GroundOdometryConfig<R>,
    estimator: Estimator<R, N>,
    linkage: Linkage<R, N>,
    position_m: [[R; 2]; N],
    radius_m: [R; N],
    wheel_per_actuator: [R; N],
    direction: [[R; 2]; N],
    roller: [R; N],
});

/// Result of a step of a [`GroundOdometry`].
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_core::estimate::{EstimatorConfig, GroundInput, GroundOdometry, GroundOdometryConfig};
/// use omni_core::linkage::{CarriedWheel, Linkage};
/// use omni_core::policy::Imu;
/// use omni_core::{Kinematics, WheelLayout};
/// // No wheel of three follows in the track of another one: the height is not determined.
/// let layout = WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?;
/// let wheels = layout.wheels().map(|wheel| CarriedWheel {
///     body: 0,
///     centre_m: [wheel.position_m[0], wheel.position_m[1], 0.05],
/// });
/// let linkage = Linkage::new(&[], &wheels)?;
/// let odometry = GroundOdometry::new(GroundOdometryConfig::new(), EstimatorConfig::new(0.005), &layout, linkage)?;
/// let (mut state, kinematics) = (odometry.start(), Kinematics::new(&layout)?);
/// let command = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let mut input = GroundInput::new(&kinematics.inverse(&command), &Imu::level(), &command);
/// let mut follows = true;
/// for period in 0..1000 {
///     input.imu.specific_force_m_s2[0] = if period == 0 { 60.0 } else { 0.0 }; // at once
///     follows = odometry.step(&mut state, &input).follows;
/// }
/// assert!(!follows && state.height_variance_m2().sqrt() > 0.05); // after 1.5 m
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GroundStep<R, const N: usize> {
    /// Each wheel's event at an edge in this period.
    pub edges: [Option<EdgeEvent<R>>; N],
    /// At least one wheel is on ground of known height. If none is, the variance of the height grows.
    pub follows: bool,
    /// The vehicle stands, as in [`EstimatorStep`](crate::estimate::EstimatorStep).
    pub standing: bool,
    /// False if the result was not finite: nothing changed.
    pub taken: bool,
}

impl<R: Real, const N: usize> GroundStep<R, N> {
    /// Height of the highest edge that a wheel has climbed in this period \[m\], for
    /// [`Readings::climbed_m`](crate::policy::Readings::climbed_m); 0 if none has.
    ///
    /// ```
    /// # let odometry = omni_core::examples::ground_odometry()?;
    /// use omni_core::BodyTwist;
    /// use omni_core::drive::BodyReadings;
    /// use omni_core::estimate::GroundInput;
    /// use omni_core::policy::Imu;
    /// let input = GroundInput::new(&[0.0; 4].into(), &Imu::level(), &BodyTwist::ZERO);
    /// let step = odometry.step(&mut odometry.start(), &input);
    /// let mut bodies = BodyReadings::none(); // of a drive with traction control
    /// bodies.climbed_m = step.climbed_m();
    /// assert_eq!(bodies.climbed_m, 0.0); // it stands
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn climbed_m(&self) -> R {
        let climbed = self
            .edges
            .iter()
            .flatten()
            .filter(|edge| edge.kind == EdgeKind::Climbed);
        climbed.fold(R::zero(), |most, edge| max(most, edge.height_m))
    }
}

impl<R: Real, const N: usize> GroundOdometry<R, N> {
    /// For a vehicle with this layout of wheels and this linkage, in the same order.
    ///
    /// # Errors
    /// The field of a configuration that is out of range, by its name.
    pub fn new(
        config: GroundOdometryConfig<R>,
        estimator: EstimatorConfig<R>,
        layout: &WheelLayout<R, N>,
        linkage: Linkage<R, N>,
    ) -> Result<Self, ConfigError> {
        let wheels = layout.wheels();
        let config = config.checked()?;
        Ok(Self {
            config,
            estimator: Estimator::new(estimator, &Kinematics::new(layout)?)?,
            linkage,
            position_m: wheels.map(|wheel| wheel.position_m),
            radius_m: wheels.map(|wheel| wheel.radius_m),
            wheel_per_actuator: wheels.map(|wheel| wheel.wheel_per_actuator()),
            direction: wheels.map(|wheel| wheel.unit_direction()),
            roller: wheels.map(|wheel| {
                let (sin, cos) = wheel.roller_angle_rad.sine_cosine();
                sin / cos
            }),
        })
    }

    fn wheel(&self, index: usize) -> RollingWheel<R> {
        RollingWheel {
            position_m: self.position_m[index],
            radius_m: self.radius_m[index],
            wheel_per_actuator: self.wheel_per_actuator[index],
            direction: self.direction[index],
            roller: self.roller[index],
        }
    }
}

#[cfg(test)]
mod held_tests;
#[cfg(test)]
mod tests;
