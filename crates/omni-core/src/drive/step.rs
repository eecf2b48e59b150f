//! The whole control step of a firmware: faults, motion, command, limits, loops and pose.

#[cfg(test)]
mod tests;

use super::config::DriveInput;
use super::faults::Expectation;
use super::model::Drive;
use super::sample::{DriveMode, DriveSample};
use super::slip::SlipSample;
use super::state::DriveState;
use crate::Real;
use crate::geometry::{BodyTwist, Desaturated, Kinematics, WheelVelocities};
use crate::loops::wheel_loops::LoopInputs;
use crate::loops::{ControlState, WheelSample};

/// The task of a drive's loops in a period.
pub(super) struct Asked<'a, R, const N: usize> {
    pub(super) inputs: LoopInputs<'a, R, N>,
    /// The twist of the origin that this is of.
    pub(super) twist: &'a BodyTwist<R>,
    /// The maps of the wheels that are trusted.
    pub(super) observed: &'a Kinematics<R, N>,
}

impl<R: Real, const N: usize> Drive<R, N> {
    /// One period: torques that move the vehicle as commanded, as far as command, limits and wheels allow. To be called
    /// once every control period. O(N).
    ///
    /// Never fails: an invalid input is rejected, or its wheel is released.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Drive, DriveConfig, DriveInput, DriveMode, DriveState, WheelLayout, WheelVelocities};
    /// # let config = omni_core::examples::loops(0.0625, 0.0, 2.0)?;
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?, config))?;
    /// // 5 rad/s of wheels of 0.1 m; the fourth is in the air and spins with 21 rad/s.
    /// let mut input = DriveInput::measured(&WheelVelocities { rad_s: [5.0, 5.0, 5.0, 21.0] });
    /// input.lifted[3] = true;
    /// let sample = drive.step(&mut DriveState::new(&drive), &input);
    /// assert!((sample.slip.estimated.vx_m_s - 0.5).abs() < 1e-12); // it is excluded
    /// assert_eq!(sample.wheels.applied.n_m[3], -0.0625 * 21.0); // but it is braked as the others are
    /// assert_eq!(sample.mode, DriveMode::Degraded);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step(&self, state: &mut DriveState<R, N>, input: &DriveInput<R, N>) -> DriveSample<R, N> {
        let mut sample = DriveSample::zero();
        self.step_into(state, input, &mut sample);
        sample
    }

    /// [`Drive::step`] into a sample that is there already: nothing is copied, for the smallest of processors.
    ///
    /// ```
    /// use omni_core::drive::DriveSample;
    /// use omni_core::{DriveInput, DriveState, WheelVelocities};
    /// # let drive = omni_core::examples::drive()?;
    /// let (mut state, mut sample) = (DriveState::new(&drive), DriveSample::zero());
    /// for rad_s in [4.0, 5.0] {
    ///     drive.step_into(&mut state, &DriveInput::measured(&WheelVelocities { rad_s: [rad_s; 4] }), &mut sample);
    /// }
    /// assert!((sample.slip.estimated.vx_m_s - 0.1 * 5.0).abs() < 1e-12); // of the last step
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step_into(
        &self,
        state: &mut DriveState<R, N>,
        input: &DriveInput<R, N>,
        sample: &mut DriveSample<R, N>,
    ) {
        self.step_with(state, input, sample, |state, asked, wheels| {
            self.controller
                .run(state, &asked.inputs, asked.observed, &input.path, wheels);
        });
    }

    /// One period around `loops`.
    #[inline]
    pub(super) fn step_with(
        &self,
        state: &mut DriveState<R, N>,
        input: &DriveInput<R, N>,
        sample: &mut DriveSample<R, N>,
        loops: impl FnOnce(&mut ControlState<R, N>, &Asked<'_, R, N>, &mut WheelSample<R, N>),
    ) {
        let expected = Expectation {
            by_others: &state.by_others,
            checked: &state.checked,
            reference: &state.reference,
            torque_n_m: &state.torque_n_m,
        };
        let measured = self
            .faults
            .step(&mut state.faults, &input.readings_rad_s, &expected);
        let dropped = state.faults.usable().map(|usable| !usable);
        let kinematics = self.controller.kinematics();

        // The motion by the remaining wheels.
        let mut excluded = dropped;
        for (excluded, &lifted) in excluded.iter_mut().zip(&input.lifted) {
            *excluded |= lifted;
        }
        let enough = state.slip.declare(kinematics, &excluded);
        let beneath = input.path.of_body(&measured);
        sample.slip = if enough {
            self.slip.step(kinematics, &mut state.slip, &beneath)
        } else {
            // Too few wheels determine no motion.
            SlipSample::unknown(excluded)
        };
        // Lifted wheels still hold the vehicle on its course when they come down: no reason to stop.
        let unobservable = !enough && dropped.contains(&true) && kinematics.excluding(&dropped).is_none();
        state.unobservable_periods = if unobservable {
            state.unobservable_periods.saturating_add(1)
        } else {
            0
        };
        state.stopping |= state.unobservable_periods > self.unobservable_periods;
        let stops = state.stopping || input.emergency;
        if stops {
            state.shaper.emergency_stop();
        } else {
            state.shaper.release();
        }

        // The task of the wheels.
        sample.shaped = self.shaper.step(&mut state.shaper, input.command.as_ref());
        let twist = sample.shaped.twist;
        let twist = if self.discretize {
            twist.discretize(self.period_s)
        } else {
            twist
        };
        sample.desaturated = if self.limits_speed {
            let limits = &self.speed_limits;
            limits.desaturate_at(kinematics, &twist, self.command_point_m, &input.path, &dropped)
        } else {
            let twist = BodyTwist::from_point(twist, self.command_point_m);
            Desaturated::whole(twist, kinematics.inverse(&twist))
        };
        let reference = input.path.of_wheels(&sample.desaturated.velocities);
        let inputs = LoopInputs {
            reference: &reference,
            measured: &measured,
            dropped: Some(&dropped),
            within: Some(&input.torque_ranges),
            // Loops that hold trust their encoders.
            holds: !stops,
        };
        let observed = *state.slip.observed();
        let asked = Asked {
            inputs,
            twist: &sample.desaturated.twist,
            observed: &observed,
        };
        loops(&mut state.control, &asked, &mut sample.wheels);

        if enough {
            self.integrate_pose(state, &observed, &sample.slip, &beneath);
        }
        self.store_expectation(state, &measured, &sample.slip, &sample.wheels, input);
        sample.mode = if input.emergency {
            DriveMode::EmergencyStop
        } else if state.stopping {
            DriveMode::SafeStop
        } else if sample.slip.excluded.contains(&true) || dropped.contains(&true) {
            DriveMode::Degraded
        } else {
            DriveMode::Normal
        };
        sample.faults = state.faults.faults();
        let wheels = &sample.wheels;
        sample.brake = sample
            .faults
            .map(|fault| wheels.shorted || (stops && (wheels.ended || fault.is_some())));
        sample.motion_known = enough;
        sample.pose = state.odometry.pose();
    }

    /// Odometry and its covariance.
    fn integrate_pose(
        &self,
        state: &mut DriveState<R, N>,
        observed: &Kinematics<R, N>,
        slip: &SlipSample<R, N>,
        beneath: &WheelVelocities<R, N>,
    ) {
        let start = state.odometry.pose();
        self.odometry
            .step_displacement(&mut state.odometry, &slip.estimated.over(self.period_s));
        if self.grows_covariance {
            let increments = beneath.over(self.period_s);
            let residuals = slip.residual.over(self.period_s);
            self.growth.step_by(
                &mut state.covariance,
                &start,
                observed.forward_matrix(),
                &increments,
                &residuals,
            );
        }
    }

    /// The values that the next period's readings will be compared with.
    fn store_expectation(
        &self,
        state: &mut DriveState<R, N>,
        measured: &WheelVelocities<R, N>,
        slip: &SlipSample<R, N>,
        wheels: &WheelSample<R, N>,
        input: &DriveInput<R, N>,
    ) {
        let slips = input.path.of_wheels(&WheelVelocities {
            rad_s: slip.slip_rad_s,
        });
        for i in 0..N {
            state.by_others.rad_s[i] = measured.rad_s[i] - slips.rad_s[i];
        }
        state.checked = slip.checked;
        for (checked, &lifted) in state.checked.iter_mut().zip(&input.lifted) {
            // Ground contact is irrelevant to a wheel in the air.
            *checked &= !lifted;
        }
        state.reference = wheels.reference;
        state.torque_n_m = wheels.applied.n_m;
    }
}
