//! One period of the law, step by step.

#[cfg(test)]
mod tests;

use super::loops::TractionLoops;
use super::model::Traction;
use super::sample::TractionSample;
use super::slip::Asked;
use super::state::TractionState;
use super::target::TractionTarget;
use crate::Real;
use crate::motor::TorqueRanges;
use crate::policy::Readings;
use crate::scalar::is_plausible;

impl<R: Real, const N: usize> Traction<R, N> {
    /// One control period: readings and a target speed in, torques and every signal out. Never NaN,
    /// never beyond a motor's limits, whatever is read. O(N).
    ///
    /// ```
    /// use omni_core::traction::{TractionState, TractionTarget};
    /// use omni_core::{BodyTwist, Readings};
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

    /// As [`Traction::step`], into a sample that is kept from period to period: returned by value
    /// it is copied. All but `wheels.ff_n_m` and `wheels.common_factor` is written.
    ///
    /// ```
    /// use omni_core::traction::{TractionSample, TractionState, TractionTarget};
    /// use omni_core::{BodyTwist, Readings};
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
        let rolling_rad_s = self.free_of_carriers(&rates_rad_s, &state.motion);
        // 2. One speed.
        let yaw_rad_s = self.measure_yaw(state, &readings.imu, &rolling_rad_s);
        let speed_wheel = self.measure_speed(state, &rolling_rad_s, yaw_rad_s);
        // 3. One thrust.
        let wheels = &mut sample.wheels;
        self.limits.ranges(&rates_rad_s, &mut wheels.range);
        if let Some(within) = within {
            wheels.range.restrict(within);
        }
        self.find_largest(state, &wheels.range);
        self.choose_loops(state, target, speed_wheel);
        if state.loops == TractionLoops::Traction {
            self.find_thrust(state);
        } else {
            state.thrust_n_m = self.mean_thrust(state, |wheel| wheel.applied_n_m);
        }
        // 4. and 5. Slip of each wheel; heading and level.
        let turn = self.turn(state, target);
        let asked = Asked {
            rates_rad_s: &rates_rad_s,
            rolling_rad_s: &rolling_rad_s,
            target,
            turn,
        };
        (wheels.ended, wheels.shorted) = (false, false);
        wheels.measured.rad_s = rates_rad_s;
        wheels.reference.rad_s = state.reference_rad_s;
        self.find_torques(state, &asked, sample);
        sample.command = state.command;
        sample.loops = state.loops;
        sample.factor = state.speed_part();
        (sample.speed_m_s, sample.target_m_s, sample.thrust_n_m) =
            (state.speed_m_s, state.target_m_s, state.thrust_n_m);
        (sample.speed_wheel, sample.drift_m_s) = (speed_wheel, state.drift_m_s);
        (sample.yaw_rad_s, sample.heading_rad, sample.gyro_zero_rad_s) =
            (state.yaw_rad_s, state.heading_rad, state.gyro_zero_rad_s);
    }
}
