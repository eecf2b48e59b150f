//! Traction control for vehicles that climb: one thrust for all driven wheels, and slip taken out wheel by wheel.
//!
//! Over a step every wheel should give all that its motor and the ground allow, at the moment at which it is needed. Scaling torques or
//! references can only take from that. This law measures one speed for the whole vehicle from the wheels that tell the truth, gives all
//! wheels the thrust that this speed lacks, and takes out of each the part that would only spin it: what the ground takes is estimated
//! from the motor's torque and the wheel's acceleration (maximum transmissible torque; Yin, Oh and Hori, 2009).
//!
//! - [`Traction`] is the law: [`Traction::observe`] says how the vehicle moves, [`Traction::act`] makes torques of a target speed.
//! - [`Supervisor`] chooses the target speed: more of it for rows that need a run-up, another try where the vehicle is stuck.
//! - [`TractionPolicy`] is both behind the face of any controller.

mod config;
mod encoder;
mod observation;
mod observe;
mod policy;
mod record;
mod sample;
mod sensor_input;
mod state;
mod supervisor;
#[cfg(test)]
mod tests;
mod torque_law;
mod torques;
mod travel_direction;
mod wheels;

use crate::constants::{constant_struct, each};
use crate::motor::TorqueLimits;
use crate::{ConfigError, Kinematics, Linkage, Real};
pub use config::{TractionConfig, TractionWheel};
pub use observation::TractionObservation;
pub use policy::{TractionPolicy, TractionPolicyState};
pub use sample::TractionSample;
pub use state::TractionState;
pub use supervisor::{Ladder, Supervisor, SupervisorConfig, SupervisorMode, SupervisorState, TractionTarget};

/// Part of the largest way per turn from which on a direction of travel drives a wheel. The other wheels follow the measured speed.
const DRIVEN_PART: f64 = 0.3;
/// The same where wheels with that much push without turning the vehicle. Wheels across that push at an edge press the vehicle along it: with
/// 0.3 `chugo7` stays at the built-in step at 18 degrees and more off straight ahead, with 0.6 it climbs (docs/study.md).
const ENOUGH_PART: f64 = 0.6;
/// Part of their levers by which pushes may turn the vehicle and count as balanced.
const BALANCED_PART: f64 = 0.01;
/// Part of its motor's torque against the thrust from which on a wheel brakes.
const BRAKING_PART: f64 = 0.025;
/// Heading error that is kept at most \[rad\].
const HEADING_RAD: f64 = 0.5;
/// Time within which the thrust's integral falls where the vehicle is told to rest \[s\].
const REST_S: f64 = 0.25;
/// The vehicle drives straight on level ground where nothing turns or rises faster \[m/s\], and nothing points up further \[rad\].
const QUIET_M_S: f64 = 0.02;
const LEVEL_RAD: f64 = 0.02;
/// Largest correction of the gyro's zero in a period, and largest zero \[rad/s\].
const ZERO_STEP_RAD_S: f64 = 0.1;
const ZERO_MOST_RAD_S: f64 = 0.2;
/// A measured speed has a direction above this \[m/s\].
const SURE_M_S: f64 = 5e-3;

/// Traction control of one vehicle. Immutable; what it remembers is a [`TractionState`].
///
/// ```
/// use omni_core::{BodyTwist, Readings, Traction, TractionState, TractionTarget};
/// # use omni_core::{CarriedWheel, Kinematics, Linkage, TorqueLimit, TractionConfig, TractionWheel, WheelLayout};
/// # let layout = WheelLayout::chugo7(0.30, 0.23, 0.066)?;
/// # let wheel = |place_m: [f64; 2]| TractionWheel { limit: TorqueLimit::constant(2.0).unwrap(), inertia_kg_m2: 0.002178, carrier: [1.0, 0.0], place_m };
/// # let places = [[-0.3, -0.23], [-0.3, 0.0], [-0.3, 0.23], [0.0, 0.0], [0.3, -0.23], [0.3, 0.0], [0.3, 0.23]];
/// # let wheels = places.map(wheel);
/// # let linkage = Linkage::new(&[], &places.map(|[x, y]| CarriedWheel { body: 0, centre_m: [x, y, 0.066] }))?;
/// # let config = TractionConfig::steady(0.3, 2.0, 1e-3);
/// let traction = Traction::new(Kinematics::new(&layout)?, linkage, wheels, config)?;
/// let mut state = TractionState::new();
/// // At rest, told to go ahead at 0.3 m/s: every wheel that points ahead gives the same, those across nothing.
/// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let readings = Readings::new(ahead, &[0.0; 7]);
/// let observed = traction.observe(&mut state, &readings);
/// let sample = traction.act(&mut state, &readings, &observed, &TractionTarget::at(0.3));
/// assert_eq!(observed.speed_m_s, 0.0);
/// assert_eq!(sample.wheels.applied.n_m.map(|torque| torque.signum() * f64::from(torque != 0.0)), [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Traction<R, const N: usize> {
    kinematics: Kinematics<R, N>,
    linkage: Linkage<R, N>,
    limits: TorqueLimits<R, N>,
    inertia_kg_m2: [R; N],
    carrier: [[R; 2]; N],
    /// Way along the push per turn of the actuator \[m/rad\].
    way_m_rad: [R; N],
    place_m: [[R; 2]; N],
    config: TractionConfig<R>,
    /// Largest rate of a wheel per yaw rate.
    per_yaw: R,
    /// Inverses of how far the outermost wheels are to the side, for travel along x and along y \[1/m\].
    per_side_m: [R; 2],
}

constant_struct!(Traction<R, const N> {
    kinematics: Kinematics<R, N>, linkage: Linkage<R, N>, limits: TorqueLimits<R, N>, inertia_kg_m2: [R; N], carrier: [[R; 2]; N],
    way_m_rad: [R; N], place_m: [[R; 2]; N], config: TractionConfig<R>, per_yaw: R,
    per_side_m: [R; 2]
});

impl<R: Real, const N: usize> Traction<R, N> {
    /// For a vehicle whose wheels are in the order of `kinematics`.
    ///
    /// # Errors
    /// Whatever of the configuration is out of its range: [`TractionConfig`], [`TractionWheel`] with the wheel's index. In particular
    /// `slip_s`: slip that is taken out within less than two control periods swings.
    ///
    /// ```
    /// use omni_core::{Traction, TractionConfig};
    /// # use omni_core::{CarriedWheel, Kinematics, Linkage, TorqueLimit, TractionWheel, WheelLayout};
    /// # let wheel = TractionWheel { limit: TorqueLimit::constant(2.0)?, inertia_kg_m2: 0.002, carrier: [1.0, 0.0], place_m: [0.0; 2] };
    /// # let linkage = Linkage::new(&[], &[CarriedWheel { body: 0, centre_m: [0.0; 3] }; 4])?;
    /// # let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?)?;
    /// let mut config = TractionConfig::steady(0.3, 2.0, 1e-3);
    /// config.slip_s = 0.5e-3; // half a period
    /// let error = Traction::new(kinematics, linkage, [wheel; 4], config).unwrap_err();
    /// assert_eq!((error.parameter, error.allowed), ("slip_s", "2 control periods to 10"));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn new(
        kinematics: Kinematics<R, N>,
        linkage: Linkage<R, N>,
        wheels: [TractionWheel<R>; N],
        config: TractionConfig<R>,
    ) -> Result<Self, ConfigError> {
        config.check()?;
        for (index, wheel) in wheels.iter().enumerate() {
            wheel.check().map_err(|error| error.at(index))?;
        }
        let largest = |sizes: [R; N]| sizes.into_iter().fold(R::zero(), larger);
        let inverse = |x: R| if x > R::zero() { R::one() / x } else { R::zero() };
        Ok(Self {
            per_yaw: largest(kinematics.inverse_matrix().map(|row| row[2].abs())),
            per_side_m: [1, 0]
                .map(|axis: usize| inverse(largest(wheels.map(|wheel| wheel.place_m[axis].abs())))),
            limits: TorqueLimits::new(&wheels.map(|wheel| wheel.limit)),
            inertia_kg_m2: wheels.map(|wheel| wheel.inertia_kg_m2),
            carrier: wheels.map(|wheel| wheel.carrier),
            way_m_rad: kinematics
                .inverse_matrix()
                .map(|[x, y, _]| inverse((x * x + y * y).sqrt())),
            place_m: wheels.map(|wheel| wheel.place_m),
            kinematics,
            linkage,
            config,
        })
    }

    /// Its kinematics.
    ///
    /// ```
    /// # use omni_core::{CarriedWheel, Kinematics, Linkage, TorqueLimit, Traction, TractionConfig, TractionWheel, WheelLayout};
    /// # let wheel = TractionWheel { limit: TorqueLimit::constant(2.0)?, inertia_kg_m2: 0.002, carrier: [1.0, 0.0], place_m: [0.0; 2] };
    /// # let linkage = Linkage::new(&[], &[CarriedWheel { body: 0, centre_m: [0.0; 3] }; 4])?;
    /// # let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1_f64)?)?;
    /// let traction = Traction::new(kinematics, linkage, [wheel; 4], TractionConfig::steady(0.3, 2.0, 1e-3))?;
    /// assert!((traction.kinematics().inverse_matrix()[0][0] - 10.0).abs() < 1e-12); // 1 / 0.1 m
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics<R, N> {
        &self.kinematics
    }

    pub(crate) fn period_s(&self) -> R {
        self.config.period_s
    }
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// Rate of a wheel's actuator per yaw rate.
    #[inline(always)]
    fn turned_by(&self, wheel: usize) -> R {
        self.kinematics.inverse_matrix()[wheel][2]
    }

    /// What a yaw rate, or what is as one, makes of each wheel.
    #[inline(always)]
    fn turning(&self, yaw: R) -> [R; N] {
        let mut turning = [yaw; N];
        each!(i of N {
            turning[i] = self.turned_by(i) * yaw;
        });
        turning
    }
}

fn larger<R: Real>(a: R, b: R) -> R {
    if a > b { a } else { b }
}

fn least<R: Real>(a: R, b: R) -> R {
    if a < b { a } else { b }
}
