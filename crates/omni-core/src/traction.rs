//! Traction control for vehicles that climb: one thrust for all driven wheels, slip control for each wheel.
//!
//! Over a step every wheel should give all that its motor and the ground allow, at the moment at which it is needed. Scaling torques or
//! references can only take from that. This law measures one speed for the whole vehicle from the slowest wheels that push, gives all
//! wheels the thrust that this speed lacks, and takes out of each the part that would only spin it: what the ground takes is estimated
//! from the motor's torque and the wheel's acceleration (maximum transmissible torque; Yin, Oh and Hori, 2009).
//!
//! - [`Traction`] is the law: [`Traction::observe`] says how the vehicle moves, [`Traction::act`] makes torques of a target speed.
//! - [`Supervisor`] chooses the target speed: more of it for rows that need a run-up, another try where the vehicle is stuck.
//! - [`TractionPolicy`] is both behind the face of any controller.

mod config;
mod direction;
mod encoder;
mod heading;
mod linkage;
mod policy;
mod sample;
mod slip;
mod speed;
mod state;
mod supervised;
mod supervisor;
#[cfg(test)]
mod tests;
mod thrust;

use crate::constants::constant_struct;
use crate::motor::TorqueLimits;
use crate::pid::is_plausible;
use crate::{ConfigError, Kinematics, Linkage, Readings, Real, TorqueRanges};
use slip::Asked;

#[doc(hidden)]
pub use config::TractionTimes;
pub use config::{TractionConfig, TractionSensors, TractionWheel};
pub use policy::{TractionPolicy, TractionPolicyState};
pub use sample::TractionSample;
pub use state::TractionState;
pub(crate) use supervised::{Supervised, SupervisedState};
pub use supervisor::{
    RetrySchedule, Supervisor, SupervisorConfig, SupervisorMode, SupervisorState, TractionTarget,
};
pub use thrust::TractionLoops;

/// Part of its motor's torque against the thrust from which on a wheel brakes.
const BRAKING_PART: f64 = 0.025;
/// A reading is mute where it stays the same to the bit while the motor gives more than this part of its torque: that of a wheel that turns
/// for the second time, that of a wheel that stands for the first \[s\]. Such a wheel is usable again after the last.
const MUTE_PART: f64 = 0.5;
const MUTE_STANDING_S: f64 = 1.0;
const MUTE_TURNING_S: f64 = 0.25;
const MUTE_AGAIN_S: f64 = 4.0;

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
/// # let config = TractionConfig::traction(0.3, 2.0, 1e-3);
/// let traction = Traction::new(Kinematics::new(&layout)?, linkage, wheels, config)?;
/// let mut state = TractionState::new();
/// // At rest, commanded to go ahead at 0.3 m/s: every wheel that points ahead gives the same, those across nothing.
/// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let sample = traction.step(&mut state, &Readings::new(ahead, &[0.0; 7]), &TractionTarget::at(0.3));
/// assert_eq!(sample.speed_m_s, 0.0);
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
    times: TractionTimes<R>,
    /// Largest rate of a wheel per yaw rate.
    per_yaw: R,
    /// Inverses of how far the outermost wheels are to the side, for travel along x and along y \[1/m\].
    per_lever: [R; 2],
}

constant_struct!(Traction<R, const N> {
    kinematics: Kinematics<R, N>, linkage: Linkage<R, N>, limits: TorqueLimits<R, N>, inertia_kg_m2: [R; N], carrier: [[R; 2]; N],
    way_m_rad: [R; N], place_m: [[R; 2]; N], config: TractionConfig<R>, times: TractionTimes<R>, per_yaw: R,
    per_lever: [R; 2]
});

impl<R: Real, const N: usize> Traction<R, N> {
    /// For a vehicle whose wheels are in the order of `kinematics`.
    ///
    /// # Errors
    /// Whatever of the configuration is out of its range: [`TractionConfig`], [`TractionWheel`] with the wheel's index.
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
        let inverse = |x: R| if x > R::zero() { R::one() / x } else { R::zero() };
        let rows = kinematics.inverse_matrix();
        let way_m_rad = rows.map(|[x, y, _]| inverse((x * x + y * y).sqrt()));
        let per_yaw = largest(rows.map(|row| row[2].abs()));
        let way_m = largest(way_m_rad);
        let torque_n_m = wheels.iter().fold(R::of(1e6), |least, wheel| {
            self::min(least, wheel.limit.range(R::zero()).upper_n_m)
        });
        let inertia_kg_m2 = largest(wheels.map(|wheel| wheel.inertia_kg_m2));
        Ok(Self {
            times: TractionTimes::new(&config, inertia_kg_m2, torque_n_m, way_m, per_yaw * way_m),
            per_yaw,
            per_lever: [1, 0]
                .map(|axis: usize| inverse(largest(wheels.map(|wheel| wheel.place_m[axis].abs())))),
            limits: TorqueLimits::new(&wheels.map(|wheel| wheel.limit)),
            inertia_kg_m2: wheels.map(|wheel| wheel.inertia_kg_m2),
            carrier: wheels.map(|wheel| wheel.carrier),
            way_m_rad,
            place_m: wheels.map(|wheel| wheel.place_m),
            kinematics,
            linkage,
            config,
        })
    }

    /// Its kinematics.
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics<R, N> {
        &self.kinematics
    }

    pub(crate) fn period_s(&self) -> R {
        self.config.period_s
    }
}

impl<R: Real, const N: usize> Traction<R, N> {
    /// One control period: readings and a target speed in, torques and every signal out. Never NaN, never beyond a motor's limits, whatever
    /// is read. O(N).
    ///
    /// ```
    /// use omni_core::{BodyTwist, Readings, TractionState, TractionTarget};
    /// # let traction = omni_core::examples::traction()?;
    /// let (mut state, ahead) = (TractionState::new(), BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO });
    /// for _ in 0..100 {
    ///     traction.step(&mut state, &Readings::new(BodyTwist::ZERO, &[0.0; 4]), &TractionTarget::at(0.0)); // finds the gyro's zero
    /// }
    /// let mut sample = traction.step(&mut state, &Readings::new(ahead, &[3.0; 4]), &TractionTarget::at(0.3));
    /// for _ in 0..200 {
    ///     sample = traction.step(&mut state, &Readings::new(ahead, &[3.0, 3.0, 3.0, 2.0]), &TractionTarget::at(0.3));
    /// }
    /// assert_eq!(sample.speed_wheel, Some(3)); // the slowest: the others slip
    /// assert!((sample.speed_m_s - 0.2).abs() < 1e-3);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        target: &TractionTarget<R, N>,
    ) -> TractionSample<R, N> {
        let mut sample = TractionSample::zero();
        self.step_into(state, readings, target, &mut sample);
        sample
    }

    /// As [`Traction::step`], into a sample that is kept from period to period: returned by value it is copied. All of it is written.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Readings, TractionSample, TractionState, TractionTarget};
    /// # let traction = omni_core::examples::traction()?;
    /// let (mut state, ahead) = (TractionState::new(), BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO });
    /// let mut sample = TractionSample::zero();
    /// traction.step_into(&mut state, &Readings::new(ahead, &[0.0; 4]), &TractionTarget::at(0.3), &mut sample);
    /// assert!((sample.wheels.applied.n_m[0] - 0.3 * 3.0).abs() < 1e-12); // kp, of the 3 rad/s that are lacking
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step_into(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        target: &TractionTarget<R, N>,
        sample: &mut TractionSample<R, N>,
    ) {
        self.run(state, readings, target, None, sample);
    }

    /// [`Traction::step_into`], with ranges of the torques that hold besides the motors' own.
    pub(crate) fn run(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        target: &TractionTarget<R, N>,
        within: Option<&TorqueRanges<R, N>>,
        sample: &mut TractionSample<R, N>,
    ) {
        self.command(state, &readings.command);
        if is_plausible(target.speed_m_s) {
            state.target_m_s = target.speed_m_s;
        }
        // 1. How bodies and wheels move.
        let rates_rad_s = self.read_wheels(state, readings);
        self.find_motion(state, readings);
        let free_rad_s = self.free_of_carriers(&rates_rad_s, &state.motion);
        // 2. One speed.
        self.measure_yaw(state, &readings.imu, &free_rad_s);
        let speed_wheel = self.measure_speed(state, &free_rad_s);
        // 3. One thrust.
        let wheels = &mut sample.wheels;
        self.limits.ranges(&rates_rad_s, &mut wheels.range);
        if let Some(within) = within {
            wheels.range.restrict(within);
        }
        self.find_largest(state, &wheels.range);
        self.choose_loops(state, target);
        if state.loops == TractionLoops::Traction {
            self.find_thrust(state);
        } else {
            state.thrust_n_m = self.mean_thrust(state, |wheel| wheel.applied_n_m);
        }
        // 4. and 5. Slip of each wheel; heading and level.
        let turn = self.turn(state, target);
        let asked = Asked {
            rates_rad_s: &rates_rad_s,
            free_rad_s: &free_rad_s,
            target,
            turn,
        };
        (wheels.ended, wheels.shorted) = (false, false);
        wheels.measured.rad_s = rates_rad_s;
        wheels.reference.rad_s = state.reference_rad_s;
        self.find_torques(state, &asked, sample);
        sample.command = readings.command;
        sample.loops = state.loops;
        sample.factor = state.speed_part();
        (sample.speed_m_s, sample.target_m_s, sample.thrust_n_m) =
            (state.speed_m_s, state.target_m_s, state.thrust_n_m);
        (sample.speed_wheel, sample.drift_m_s) = (speed_wheel, state.drift_m_s);
        (sample.yaw_rad_s, sample.heading_rad, sample.gyro_zero_rad_s) =
            (state.yaw_rad_s, state.heading_rad, state.gyro_zero_rad_s);
    }

    /// Rate of a wheel's actuator per yaw rate.
    #[inline(always)]
    fn turned_by(&self, wheel: usize) -> R {
        self.kinematics.inverse_matrix()[wheel][2]
    }
}

/// Follows what is read with this part of the gap.
fn follow<R: Real>(held: &mut R, now: R, part: R) {
    *held += part * (now - *held);
}

fn max<R: Real>(a: R, b: R) -> R {
    if a > b { a } else { b }
}

fn min<R: Real>(a: R, b: R) -> R {
    if a < b { a } else { b }
}

fn largest<R: Real, const N: usize>(sizes: [R; N]) -> R {
    sizes.into_iter().fold(R::zero(), max)
}
