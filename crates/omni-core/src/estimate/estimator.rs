//! Pose and velocity from wheels, gyro and accelerometer, with wheel slip as a state.
//!
//! An extended Kalman filter. Its special feature is the slip: the common slip of all wheels is a part of the state,
//! because it persists and no redundancy of wheels detects it, while an accelerometer does. Disagreement between the
//! wheels increases their noise.

mod bias;
mod config;
mod correction;
mod input;
mod matrix;
mod rolling;
mod standstill;
mod step;

use crate::constants::constant_struct;
use crate::estimate::PoseCovariance;
use crate::geometry::{BodyTwist, Kinematics, PlanarPose, WheelVelocities};
use crate::scalar::is_plausible;
use crate::sum::Sum;
use crate::{ConfigError, Real};
pub use config::EstimatorConfig;
pub use input::EstimatorInput;
use matrix::{BIAS, Matrix, Motion, SIZE, SLIP, SLIP_Y, VX, VY, X, Y, YAW};
use rolling::Rolling;
pub(in crate::estimate) use step::MOST_M_S2;

/// Innovation squared over its variance from which on a slip has changed at once: three standard deviations.
const SUDDEN: f64 = 9.0;
/// Largest addition of a period to the variance of the slip, relative to the wheels' noise: the amount that `f32` can
/// subtract again.
const MOST: f64 = 1e4;
/// Disagreement that passes for noise of the readings, over their variance: its estimate over 20
/// periods is off by a third.
const QUIET: f64 = 1.3;
/// Time over which the disagreement of a wheel is averaged \[s\].
const DISAGREEMENT_S: f64 = 0.02;
/// Time over which stillness is averaged \[s\], and for how long it has to last.
const STILL_S: f64 = 0.05;
/// Redundancy below which the others say too little about a wheel.
const LEAST_REDUNDANCY: f64 = 0.05;
/// Part of the squared disagreement that is noise of the wheel's reading. All of it is in what the
/// slip may be: what lasts is no noise.
const AS_NOISE: f64 = 0.5;
/// Largest unpredicted change of the slip in a period, relative to the velocity's change (variances), so that little of
/// such a change is mistaken for a change of velocity. More, and every period expects a change that comes in few.
const RESTLESS: f64 = 400.0;
/// Standard deviation of a vehicle's velocity that stands \[m/s\]: its loops answer the noise of their encoders.
const STANDING_M_S: f64 = 3e-4;

/// Result of the test for standstill.
#[derive(Clone, Copy, PartialEq)]
enum Standstill {
    Moving,
    /// Everything is quiet, but the vehicle may glide: rollers turn freely, and wheels without load stand.
    Settling,
    /// Quiet for so long that it stands.
    Held,
}

/// The filter for a vehicle with `N` wheels. Immutable; the changing state is in [`EstimatorState`].
///
/// A reading of a wheel or of the gyro that differs from what is expected by more than it can change in a period is a
/// jump of the sensor, and left out: for 10 ms or two periods, because what lasts is no jump, and for a seventh of the
/// time.
///
/// State: place and yaw in the world; velocity of the origin along the vehicle's heading; the gyro's bias;
/// and the slip of all wheels together, as a twist that they show beyond the vehicle's own. Each period
///
/// 1. gyro and accelerometer move the state (without accelerometer the velocity follows a random walk, without gyro the
///    wheels' yaw rate is used);
/// 2. the slip is held against none, by as little as a slip says that lasts for `slip_s` and is
///    `slip_m_s`, as much as it is itself in any direction (wheels that slide hold in none) and as the
///    wheels disagree. It changes by as much, but in a period by no more than 400 times what the velocity
///    does (variances), which is little with an accelerometer. A body innovation beyond three deviations
///    widens it at once, by its excess (after Jazwinski, *Adaptive filtering*, Automatica 5, 1969);
/// 3. every valid wheel reading is processed separately, its noise increased by its own residual (as variance
///    components are estimated from redundancy: Baarda, 1968). No matrix is inverted, and the covariance is updated in
///    Joseph's form. Its variances are never below 0.
///
/// A vehicle that is commanded to rest and is quiet (wheels, gyro and accelerometer for 50 ms) has nearly no velocity.
/// It may still glide or turn on free rollers, so that only after a second of quiet its pose is held, and the gyro's
/// difference from the wheels' yaw rate is its bias: the vehicle trembles because its loops respond to encoder noise.
/// What the accelerometer reads then is its bias, or a lean that is not measured. The gyro's bias is estimated only at
/// rest: a wheel's slip in a turn is one-sided, and would be mistaken for it.
///
/// The accelerometer's bias walks, because attitudes wander. It is followed while driving by a filter of two states
/// for each direction, which takes the wheels for the vehicle with a slip of 2 cm/s, or as much as there is, that
/// lasts half a second: a slip comes and goes, a bias stays. As far as it is unknown it adds to the noise of the
/// velocity, with four of its deviations, so that none is taken for a slip that lasts. Friction takes a vehicle
/// that slides towards the velocity of its wheels, or wheels that hold it disagree with the others; if neither is
/// so for half a second, nothing is known of the bias any more.
///
/// Limits: a bias that is off by b m/s^2 is b t m/s of error while all wheels slip for t seconds. A vehicle that slides
/// down a slope with braked wheels, or is pushed, is taken for one that rolls.
///
/// ```
/// use omni_core::estimate::{Estimator, EstimatorConfig, EstimatorInput};
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
/// let mut config = EstimatorConfig::new(1e-3);
/// config.accelerometer_bias_m_s2 = 1e-4; // a calibrated unit, whose angles do not wander
/// config.accelerometer_bias_walk_m_s2_per_sqrt_s = 1e-4;
/// let estimator = Estimator::new(config, &kinematics)?;
/// let mut state = estimator.start();
/// let ahead = kinematics.inverse(&BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO });
/// for period in 0..2000 {
///     let mut input = EstimatorInput::new(&ahead);
///     input.yaw_rate_rad_s = 0.0;
///     input.acceleration_m_s2 = [if period == 0 { 500.0 } else { 0.0 }, 0.0]; // at once
///     if period > 1600 {
///         input.wheels.rad_s = [9.0; 4]; // all wheels spin: by them it were 0.9 m/s, and 1.16 m of way
///     }
///     estimator.step(&mut state, &input);
/// }
/// assert!((state.pose().x_m - 1.0).abs() < 0.01);
/// assert!((state.slip().vx_m_s - 0.4).abs() < 0.01);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Estimator<R, const N: usize> {
    config: EstimatorConfig<R>,
    kinematics: Kinematics<R, N>,
    /// Squares of the forward map: contribution of a wheel's variance to the variance of each axis.
    shares: [[R; N]; 3],
    redundancy: [R; N],
    /// Mean squared lever of the wheels \[m^2\]: turning by 1 rad/s is as much as its root in m/s.
    lever_m2: R,
    /// Change of a wheel's velocity in a period that is a jump of its encoder \[rad/s\].
    jump_rad_s: R,
}

constant_struct!(Estimator<R, const N> {
    config: EstimatorConfig<R>,
    kinematics: Kinematics<R, N>,
    shares: [[R; N]; 3],
    redundancy: [R; N],
    lever_m2: R,
    jump_rad_s: R,
});

/// The filter's state: estimates and their covariance. Made by [`Estimator::start`].
///
/// ```
/// use omni_core::estimate::{Estimator, EstimatorConfig};
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f32, 3>::omni(0.2, 0.0, 0.05)?)?;
/// let state = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?.start();
/// assert_eq!((state.pose().x_m, state.twist().vx_m_s, state.gyro_bias_rad_s()), (0.0, 0.0, 0.0));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EstimatorState<R, const N: usize> {
    x: Sum<R>,
    y: Sum<R>,
    yaw: Sum<R>,
    velocity: [R; 2],
    bias: R,
    /// What the accelerations read beyond the vehicle's own \[m/s^2\], and the variance of each.
    accelerometer_bias: [R; 2],
    accelerometer_bias_variance: R,
    rolling: Rolling<R>,
    /// For how long the slip has not been one \[s\].
    doubted_s: R,
    /// For how long readings that jump are still left out: of wheels and gyro \[s\].
    jumps_s: [R; 2],
    slip: [R; 3],
    covariance: Matrix<R>,
    /// Yaw rate of the period before, by the gyro or what stands for it, bias included.
    yaw_rate: R,
    /// Mean squared disagreement of each wheel \[rad^2/s^2\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    disagreement: [R; N],
    /// Yaw rate and accelerations, averaged, and the mean square of the wheels.
    quiet: [R; 3],
    turning: R,
    /// Mean square of the yaw rate about its average \[rad^2/s^2\].
    restless: R,
    /// Time for which everything has been quiet \[s\].
    still_s: R,
    /// The slip that was last held against none is that to the left.
    sideways: bool,
}

/// Result of a step of an [`Estimator`].
///
/// ```
/// use omni_core::estimate::{Estimator, EstimatorConfig, EstimatorInput};
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
/// let estimator = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?;
/// // A wheel without a reading is left out.
/// let step = estimator.step(&mut estimator.start(), &EstimatorInput::new(&[1.0, f64::NAN, 1.0, 1.0].into()));
/// assert_eq!((step.readings, step.standing), (3, false));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct EstimatorStep<R> {
    /// Normalised innovation squared: sum over the wheels of innovation squared over its variance. Chi-square with
    /// `readings` degrees of freedom if the model holds. 0 or more; 0 if no reading was used.
    pub nis: R,
    /// Wheels whose readings were used.
    pub readings: usize,
    /// The vehicle counted as standing: a zero-velocity update, after a second without wheel readings.
    pub standing: bool,
    /// False if the result was not finite: nothing changed.
    pub taken: bool,
}

impl<R: Real, const N: usize> EstimatorState<R, N> {
    /// The estimated pose \[m, m, rad\], its yaw in (-pi, pi].
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig, PoseCovariance};
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let mut state = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?.start();
    /// state.reset(&PlanarPose { x_m: 2.0, y_m: 0.0, yaw_rad: 7.0 }, &PoseCovariance::default());
    /// assert!((state.pose().yaw_rad - (7.0 - core::f64::consts::TAU)).abs() < 1e-15);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn pose(&self) -> PlanarPose<R> {
        PlanarPose {
            x_m: self.x.total,
            y_m: self.y.total,
            yaw_rad: self.yaw.total.wrapped_angle(),
        }
    }

    /// The estimated motion of the vehicle, not of its wheels: in its own axes.
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig, EstimatorInput};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
    /// let mut config = EstimatorConfig::new(1e-3);
    /// config.accelerometer_bias_m_s2 = 1e-4; // a calibrated unit
    /// let estimator = Estimator::new(config, &kinematics)?;
    /// let mut state = estimator.start();
    /// let mut input = EstimatorInput::new(&[0.0; 4].into());
    /// input.acceleration_m_s2 = [2.0, 0.0]; // pushed, its wheels locked
    /// (0..100).for_each(|_| _ = estimator.step(&mut state, &input));
    /// assert!((state.twist().vx_m_s - 0.2).abs() < 0.02);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn twist(&self) -> BodyTwist<R> {
        let [vx, vy] = self.velocity;
        BodyTwist::from_array([vx, vy, self.yaw_rate - self.bias])
    }

    /// Common slip of all wheels relative to the vehicle's motion, as a twist. Its yaw rate includes the gyro's noise.
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// assert_eq!(Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?.start().slip().vx_m_s, 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn slip(&self) -> BodyTwist<R> {
        BodyTwist::from_array(self.slip)
    }

    /// Reading of the gyro at rest \[rad/s\].
    #[must_use]
    pub fn gyro_bias_rad_s(&self) -> R {
        self.bias
    }

    /// Reading of the accelerometer at rest, forward and to the left \[m/s^2\].
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig, EstimatorInput};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let estimator = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?;
    /// let mut state = estimator.start();
    /// let mut input = EstimatorInput::new(&[0.0; 3].into());
    /// (input.commanded_rest, input.acceleration_m_s2) = (true, [0.15, 0.0]);
    /// (0..2000).for_each(|_| _ = estimator.step(&mut state, &input));
    /// assert!((state.accelerometer_bias_m_s2()[0] - 0.15).abs() < 1e-3);
    /// assert!(state.pose().x_m.abs() < 0.01); // 0.3 m by the accelerometer alone
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn accelerometer_bias_m_s2(&self) -> [R; 2] {
        self.accelerometer_bias
    }

    /// Covariance of [`EstimatorState::pose`].
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig, EstimatorInput};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let estimator = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?;
    /// let mut state = estimator.start();
    /// assert_eq!(state.covariance().standard_deviations(), [0.0; 3]);
    /// (0..100).for_each(|_| _ = estimator.step(&mut state, &EstimatorInput::new(&[0.0; 3].into())));
    /// assert!(state.covariance().standard_deviations()[0] > 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn covariance(&self) -> PoseCovariance<R> {
        let p = &self.covariance.0;
        // Without indices that are looked up: no panic is linked, whatever the compiler does.
        let row = |row: &[R; SIZE]| [row[X], row[Y], row[YAW]];
        PoseCovariance::of([row(&p[X]), row(&p[Y]), row(&p[YAW])])
    }

    /// Covariance of the velocities of [`EstimatorState::twist`], rows and columns forward and left \[m^2/s^2\].
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let state = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?.start();
    /// assert_eq!(state.velocity_covariance()[0][1], 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn velocity_covariance(&self) -> [[R; 2]; 2] {
        let p = &self.covariance.0;
        [[p[VX][VX], p[VX][VY]], [p[VY][VX], p[VY][VY]]]
    }

    /// Standard deviation of [`EstimatorState::gyro_bias_rad_s`] \[rad/s\].
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let state = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?.start();
    /// assert!((state.gyro_bias_deviation_rad_s() - 0.02).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn gyro_bias_deviation_rad_s(&self) -> R {
        self.covariance.0[BIAS][BIAS].abs().sqrt()
    }

    /// Sets the pose and its uncertainty; its correlation with the other states is reset. False, and nothing changed,
    /// if `pose` is not finite.
    ///
    /// ```
    /// use omni_core::estimate::{Estimator, EstimatorConfig, PoseCovariance};
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let mut state = Estimator::new(EstimatorConfig::new(1e-3), &kinematics)?.start();
    /// let known = PoseCovariance::diagonal([1e-4, 1e-4, 1e-6])?;
    /// assert!(state.reset(&PlanarPose { x_m: 1.0, y_m: 2.0, yaw_rad: 0.5 }, &known));
    /// assert_eq!((state.pose().y_m, state.covariance().matrix()[0][0]), (2.0, 1e-4));
    /// assert!(!state.reset(&PlanarPose { x_m: f64::NAN, y_m: 2.0, yaw_rad: 0.5 }, &known));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn reset(&mut self, pose: &PlanarPose<R>, known: &PoseCovariance<R>) -> bool {
        let finite = [pose.x_m, pose.y_m, pose.yaw_rad]
            .iter()
            .all(|x| x.is_finite_real());
        if finite {
            (self.x, self.y) = (Sum::of(pose.x_m), Sum::of(pose.y_m));
            self.yaw = Sum::of(pose.yaw_rad.wrapped_angle());
            self.covariance.set_pose(known.matrix());
        }
        finite
    }
}

#[cfg(test)]
mod absurd_tests;
#[cfg(test)]
mod jump_tests;
#[cfg(test)]
mod standing_tests;
#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
mod transition_tests;
