//! A place for a controller of one's own: what a vehicle's sensors say in, torques out.

use crate::{
    BodyTwist, ControlSample, ControlState, Controller, Drive, DriveInput, DriveSample, DriveState, Real,
    TwistLimiter, TwistLimiterState, WheelVelocities,
};

/// What an inertial measurement unit on the base says, in the base's axes: x forward, y left, z up.
///
/// ```
/// use omni_core::Imu;
/// let at_rest = Imu::<f32>::level();
/// assert_eq!((at_rest.specific_force_m_s2, at_rest.pitch_rad), ([0.0, 0.0, 9.81], 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Imu<R> {
    /// Turning rates about x, y and z \[rad/s\]: a gyro.
    pub rate_rad_s: [R; 3],
    /// Acceleration less gravity \[m/s^2\]: an accelerometer. At rest it is 9.81 upwards.
    pub specific_force_m_s2: [R; 3],
    /// Angle of the base's y axis above the horizon \[rad\]: left side up is positive.
    pub roll_rad: R,
    /// Angle of the base's x axis above the horizon \[rad\]: nose up is positive.
    pub pitch_rad: R,
}

impl<R: Real> Imu<R> {
    /// At rest on level ground.
    ///
    /// ```
    /// assert_eq!(omni_core::Imu::<f64>::level().rate_rad_s, [0.0; 3]);
    /// ```
    #[must_use]
    pub fn level() -> Self {
        let zero = R::zero();
        Self {
            rate_rad_s: [zero; 3],
            specific_force_m_s2: [zero, zero, R::of(9.81)],
            roll_rad: zero,
            pitch_rad: zero,
        }
    }
}

/// What a vehicle knows in one control period, and nothing else: its sensors, its own torques, its command.
///
/// ```
/// use omni_core::{BodyTwist, Imu, Readings};
/// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let readings = Readings::new(ahead, &[1.0, f64::NAN, -1.0]);
/// assert!(readings.wheels_rad_s[1].is_nan() && readings.hinges_rad.is_empty()); // wheel 2 was not heard
/// assert_eq!((readings.new_command, readings.imu), (true, Imu::level()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Readings<'a, R> {
    /// What the vehicle is told to do: the last command that arrived.
    pub command: BodyTwist<R>,
    /// The command arrived since the period before.
    pub new_command: bool,
    /// Actuator velocities by the encoders \[rad/s\], one a wheel; NaN where no reading arrived.
    pub wheels_rad_s: &'a [R],
    /// Torques that the actuators were told in the period before \[N.m\], one a wheel; empty where nobody keeps them.
    pub torques_n_m: &'a [R],
    /// Angles of the hinges \[rad\], and their rates \[rad/s\], one a hinge; empty where they have no encoders.
    pub hinges_rad: &'a [R],
    /// Rates of the hinges \[rad/s\].
    pub hinges_rad_s: &'a [R],
    /// The inertial measurement unit.
    pub imu: Imu<R>,
}

impl<'a, R: Real> Readings<'a, R> {
    /// A new command and actuator velocities \[rad/s\], one a wheel; no hinges, the vehicle level and at rest.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Readings};
    /// assert_eq!(Readings::new(BodyTwist::ZERO, &[2.0_f32; 4]).wheels_rad_s.len(), 4);
    /// ```
    #[must_use]
    pub fn new(command: BodyTwist<R>, wheels_rad_s: &'a [R]) -> Self {
        Self {
            command,
            new_command: true,
            wheels_rad_s,
            torques_n_m: &[],
            hinges_rad: &[],
            hinges_rad_s: &[],
            imu: Imu::level(),
        }
    }
}

/// A controller: from what a vehicle knows to a torque a wheel, once every control period. What is written for it runs in firmware and
/// in the simulation unchanged.
///
/// ```
/// use omni_core::{BodyTwist, Policy, Readings};
/// /// Every wheel by itself: 0.5 N.m a rad/s towards 4 rad/s.
/// struct Simple;
/// impl Policy<f64> for Simple {
///     fn reset(&mut self) {}
///     fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
///         for (torque, velocity) in torques_n_m.iter_mut().zip(readings.wheels_rad_s) {
///             *torque = 0.5 * (4.0 - velocity);
///         }
///     }
/// }
/// let mut torques_n_m = [0.0; 3];
/// Simple.step(&Readings::new(BodyTwist::ZERO, &[4.0, 3.0, 5.0]), &mut torques_n_m);
/// assert_eq!(torques_n_m, [0.0, 0.5, -0.5]);
/// ```
pub trait Policy<R> {
    /// Back to the start: nothing is remembered.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Policy, Readings};
    /// /// Counts its steps.
    /// struct Count(f64);
    /// impl Policy<f64> for Count {
    ///     fn reset(&mut self) {
    ///         self.0 = 0.0;
    ///     }
    ///     fn step(&mut self, _: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
    ///         self.0 += 1.0;
    ///         torques_n_m.fill(self.0);
    ///     }
    /// }
    /// let (mut count, mut torques_n_m) = (Count(0.0), [0.0; 2]);
    /// let readings = Readings::new(BodyTwist::ZERO, &[0.0; 2]);
    /// count.step(&readings, &mut torques_n_m);
    /// count.reset();
    /// count.step(&readings, &mut torques_n_m);
    /// assert_eq!(torques_n_m, [1.0; 2]);
    /// ```
    fn reset(&mut self);

    /// One control period: writes a torque a wheel \[N.m\], finite. `torques_n_m` is all zero before. Whoever calls it brings the torques
    /// within what the motors have.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Policy, Readings};
    /// /// Counts its steps.
    /// struct Count(f64);
    /// impl Policy<f64> for Count {
    ///     fn reset(&mut self) {
    ///         self.0 = 0.0;
    ///     }
    ///     fn step(&mut self, _: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
    ///         self.0 += 1.0;
    ///         torques_n_m.fill(self.0);
    ///     }
    /// }
    /// let (mut count, mut torques_n_m) = (Count(0.0), [0.0; 2]);
    /// let readings = Readings::new(BodyTwist::ZERO, &[0.0; 2]);
    /// count.step(&readings, &mut torques_n_m);
    /// count.step(&readings, &mut torques_n_m);
    /// assert_eq!(torques_n_m, [2.0; 2]);
    /// ```
    fn step(&mut self, readings: &Readings<'_, R>, torques_n_m: &mut [R]);

    /// What traces, tables and logs call it.
    ///
    /// ```
    /// # use omni_core::{Policy, Readings};
    /// struct Coast;
    /// impl Policy<f32> for Coast {
    ///     fn reset(&mut self) {}
    ///     fn step(&mut self, _: &Readings<'_, f32>, _: &mut [f32]) {}
    /// }
    /// assert_eq!(Coast.name().len(), 3); // "own"
    /// ```
    fn name(&self) -> &str {
        "own"
    }

    /// Why the last step gave no torques, in one line: whoever calls it stops then. None where all is well.
    ///
    /// ```
    /// # use omni_core::{Policy, Readings};
    /// /// Says how far it is, and when it is over.
    /// struct Talks(f64);
    /// impl Policy<f64> for Talks {
    ///     fn reset(&mut self) {}
    ///     fn step(&mut self, _: &Readings<'_, f64>, _: &mut [f64]) {}
    ///     fn failure(&self) -> Option<&str> {
    ///         (self.0 > 1.0).then_some("beyond the end")
    ///     }
    /// }
    /// assert_eq!(Talks(0.5).failure(), None);
    /// assert_eq!(Talks(1.5).failure(), Some("beyond the end"));
    /// ```
    fn failure(&self) -> Option<&str> {
        None
    }

    /// Names of signals of its own, by index from 0 until there is none: columns of traces and logs. Lower case, digits and `_`.
    ///
    /// ```
    /// # use omni_core::{Policy, Readings};
    /// /// Says how far it is, and when it is over.
    /// struct Talks(f64);
    /// impl Policy<f64> for Talks {
    ///     fn reset(&mut self) {}
    ///     fn step(&mut self, _: &Readings<'_, f64>, _: &mut [f64]) {}
    ///     fn signal_name(&self, index: usize) -> Option<&str> {
    ///         ["part_done"].get(index).copied()
    ///     }
    /// }
    /// assert_eq!((Talks(0.5).signal_name(0), Talks(0.5).signal_name(1)), (Some("part_done"), None));
    /// ```
    fn signal_name(&self, _index: usize) -> Option<&str> {
        None
    }

    /// Writes these signals, as they are after the last step.
    ///
    /// ```
    /// # use omni_core::{Policy, Readings};
    /// /// Says how far it is, and when it is over.
    /// struct Talks(f64);
    /// impl Policy<f64> for Talks {
    ///     fn reset(&mut self) {}
    ///     fn step(&mut self, _: &Readings<'_, f64>, _: &mut [f64]) {}
    ///     fn signals(&self, values: &mut [f64]) {
    ///         values[0] = self.0;
    ///     }
    /// }
    /// let mut values = [0.0];
    /// Talks(0.5).signals(&mut values);
    /// assert_eq!(values, [0.5]);
    /// ```
    fn signals(&self, _values: &mut [R]) {}
}

/// omni-core's loops as a [`Policy`]: a vehicle's limits, then [`Controller::step`].
///
/// ```
/// use omni_core::{BodyTwist, Controller, ControllerPolicy, Policy, Readings, TwistLimiter, WheelLayout};
/// # use omni_core::{AxisLimits, Coordination, PidConfig, PidGains, TorqueLimit, TwistLimits, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// # let [vx, vy, wz] = [AxisLimits::symmetric(0.5, f64::INFINITY, f64::INFINITY, f64::INFINITY); 3];
/// # let limits = TwistLimits::PerAxis { vx, vy, wz };
/// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config)?;
/// let mut policy = ControllerPolicy::new(TwistLimiter::new(limits, 1e-3)?, controller); // 0.5 m/s at most
/// let (ahead, mut torques_n_m) = (BodyTwist { vx_m_s: 9.0, ..BodyTwist::ZERO }, [0.0; 4]);
/// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut torques_n_m);
/// assert_eq!(torques_n_m, [0.25 * 0.5 / 0.125; 4]);
/// assert_eq!(policy.sample().command.vx_m_s, 0.5);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerPolicy<R, const N: usize> {
    limiter: TwistLimiter<R>,
    controller: Controller<R, N>,
    state: (TwistLimiterState<R>, ControlState<R, N>),
    sample: ControlSample<R, N>,
}

impl<R: Real, const N: usize> ControllerPolicy<R, N> {
    /// Freshly started.
    ///
    /// ```
    /// use omni_core::{Controller, ControllerPolicy, TwistLimiter, WheelLayout};
    /// # use omni_core::{AxisLimits, Coordination, PidConfig, PidGains, TorqueLimit, TwistLimits, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// # let [vx, vy, wz] = [AxisLimits::unlimited(); 3];
    /// # let limits = TwistLimits::PerAxis { vx, vy, wz };
    /// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config)?;
    /// let policy = ControllerPolicy::new(TwistLimiter::new(limits, 1e-3)?, controller);
    /// assert_eq!(policy.sample().wheels.applied.n_m, [0.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn new(limiter: TwistLimiter<R>, controller: Controller<R, N>) -> Self {
        Self {
            limiter,
            controller,
            state: (TwistLimiterState::default(), ControlState::default()),
            sample: ControlSample::zero(),
        }
    }

    /// The loops.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Controller, ControllerPolicy, Policy, Readings, TwistLimiter, WheelLayout};
    /// # use omni_core::{AxisLimits, Coordination, PidConfig, PidGains, TorqueLimit, TwistLimits, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 10.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(9.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-2), limits, coordination };
    /// # let [vx, vy, wz] = [AxisLimits::unlimited(); 3];
    /// # let limits = TwistLimits::PerAxis { vx, vy, wz };
    /// # let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config)?;
    /// # let mut policy = ControllerPolicy::new(TwistLimiter::new(limits, 1e-2)?, controller);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// assert_eq!(policy.controller().kinematics().inverse(&ahead).rad_s, [4.0; 4]); // 0.5 m/s on wheels of 0.125 m
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn controller(&self) -> &Controller<R, N> {
        &self.controller
    }

    /// Everything that the last step did.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Controller, ControllerPolicy, Policy, Readings, TwistLimiter, WheelLayout};
    /// # use omni_core::{AxisLimits, Coordination, PidConfig, PidGains, TorqueLimit, TwistLimits, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 10.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(9.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-2), limits, coordination };
    /// # let [vx, vy, wz] = [AxisLimits::unlimited(); 3];
    /// # let limits = TwistLimits::PerAxis { vx, vy, wz };
    /// # let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config)?;
    /// # let mut policy = ControllerPolicy::new(TwistLimiter::new(limits, 1e-2)?, controller);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut [0.0; 4]);
    /// assert_eq!(policy.sample().wheels.p_n_m, [1.0; 4]); // 0.25 N.m a rad/s
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn sample(&self) -> &ControlSample<R, N> {
        &self.sample
    }

    /// What it remembers.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Controller, ControllerPolicy, Policy, Readings, TwistLimiter, WheelLayout};
    /// # use omni_core::{AxisLimits, Coordination, PidConfig, PidGains, TorqueLimit, TwistLimits, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 10.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(9.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-2), limits, coordination };
    /// # let [vx, vy, wz] = [AxisLimits::unlimited(); 3];
    /// # let limits = TwistLimits::PerAxis { vx, vy, wz };
    /// # let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config)?;
    /// # let mut policy = ControllerPolicy::new(TwistLimiter::new(limits, 1e-2)?, controller);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// let fresh = *policy.state();
    /// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut [0.0; 4]);
    /// assert_ne!(*policy.state(), fresh); // 4 rad/s are missing: integrals of 0.4 N.m
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn state(&self) -> &(TwistLimiterState<R>, ControlState<R, N>) {
        &self.state
    }

    /// Goes on from what another one of the same kind remembered.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Controller, ControllerPolicy, Policy, Readings, TwistLimiter, WheelLayout};
    /// # use omni_core::{AxisLimits, Coordination, PidConfig, PidGains, TorqueLimit, TwistLimits, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 10.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(9.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-2), limits, coordination };
    /// # let [vx, vy, wz] = [AxisLimits::unlimited(); 3];
    /// # let limits = TwistLimits::PerAxis { vx, vy, wz };
    /// # let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config)?;
    /// # let mut policy = ControllerPolicy::new(TwistLimiter::new(limits, 1e-2)?, controller);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// let (readings, mut torques_n_m, mut other) = (Readings::new(ahead, &[0.0; 4]), [0.0; 4], policy);
    /// policy.step(&readings, &mut torques_n_m);
    /// other.restore(*policy.state());
    /// other.step(&readings, &mut torques_n_m);
    /// assert!((torques_n_m[0] - 1.8).abs() < 1e-12); // 1 N.m of the error, and two integrals of 0.4 N.m
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn restore(&mut self, state: (TwistLimiterState<R>, ControlState<R, N>)) {
        self.state = state;
    }
}

/// Velocities of `N` wheels; those beyond what there is count as not heard.
fn of_wheels<R: Real, const N: usize>(rad_s: &[R]) -> WheelVelocities<R, N> {
    let mut velocities = WheelVelocities {
        rad_s: [R::of(f64::NAN); N],
    };
    for (velocity, rad_s) in velocities.rad_s.iter_mut().zip(rad_s) {
        *velocity = *rad_s;
    }
    velocities
}

impl<R: Real, const N: usize> Policy<R> for ControllerPolicy<R, N> {
    fn reset(&mut self) {
        *self = Self::new(self.limiter, self.controller);
    }

    fn step(&mut self, readings: &Readings<'_, R>, torques_n_m: &mut [R]) {
        let (limited, state) = &mut self.state;
        let command = self.limiter.step(limited, &readings.command);
        let measured = of_wheels(readings.wheels_rad_s);
        self.controller
            .step_into(state, &command, &measured, &mut self.sample);
        for (torque, applied) in torques_n_m.iter_mut().zip(self.sample.wheels.applied.n_m) {
            *torque = applied;
        }
    }
}

/// A [`Drive`] as a [`Policy`]: everything that firmware does in a period.
///
/// ```
/// use omni_core::{BodyTwist, Drive, DriveConfig, DriveMode, DrivePolicy, Policy, Readings, WheelLayout};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let mut policy = DrivePolicy::new(Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config))?);
/// let (ahead, mut torques_n_m) = (BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO }, [0.0; 4]);
/// policy.step(&Readings::new(ahead, &[0.0, f64::NAN, 0.0, 0.0]), &mut torques_n_m); // wheel 2 is silent: let go
/// assert_eq!(torques_n_m, [1.0, 0.0, 1.0, 1.0]); // 0.25 N.m a rad/s, 4 rad/s
/// assert_eq!(policy.sample().map(|sample| sample.mode), Some(DriveMode::Degraded));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivePolicy<R, const N: usize> {
    drive: Drive<R, N>,
    state: DriveState<R, N>,
    sample: Option<DriveSample<R, N>>,
}

impl<R: Real, const N: usize> DrivePolicy<R, N> {
    /// Freshly started.
    ///
    /// ```
    /// use omni_core::{Drive, DriveConfig, DrivePolicy, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// let drive = Drive::new(DriveConfig::new(WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.125)?, config))?;
    /// let mut policy = DrivePolicy::new(drive);
    /// assert!(policy.sample().is_none()); // no step yet
    /// assert_eq!(policy.state().odometry.pose().x_m, 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn new(drive: Drive<R, N>) -> Self {
        Self {
            state: DriveState::new(&drive),
            drive,
            sample: None,
        }
    }

    /// The drive.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Drive, DriveConfig, DriveMode, DrivePolicy, Policy, Readings, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// # let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config))?;
    /// # let mut policy = DrivePolicy::new(drive);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// assert_eq!(policy.drive().kinematics().inverse(&ahead).rad_s, [4.0; 4]); // 0.5 m/s on wheels of 0.125 m
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn drive(&self) -> &Drive<R, N> {
        &self.drive
    }

    /// Everything that the last step did; none before the first.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Drive, DriveConfig, DriveMode, DrivePolicy, Policy, Readings, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// # let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config))?;
    /// # let mut policy = DrivePolicy::new(drive);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut [0.0; 4]);
    /// assert_eq!(policy.sample().map(|sample| sample.wheels.p_n_m), Some([1.0; 4])); // 0.25 N.m a rad/s
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn sample(&self) -> Option<&DriveSample<R, N>> {
        self.sample.as_ref()
    }

    /// What it remembers.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Drive, DriveConfig, DriveMode, DrivePolicy, Policy, Readings, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// # let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config))?;
    /// # let mut policy = DrivePolicy::new(drive);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut [0.0; 4]);
    /// assert_eq!(policy.state().odometry.pose().x_m, 0.0); // it stood
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn state(&self) -> &DriveState<R, N> {
        &self.state
    }

    /// What it remembers, to stop and release it.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, Drive, DriveConfig, DriveMode, DrivePolicy, Policy, Readings, WheelLayout};
    /// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// # let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
    /// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
    /// # let drive = Drive::new(DriveConfig::new(WheelLayout::mecanum4(0.6, 0.4, 0.125)?, config))?;
    /// # let mut policy = DrivePolicy::new(drive);
    /// # let ahead = BodyTwist { vx_m_s: 0.5, ..BodyTwist::ZERO };
    /// policy.state_mut().emergency_stop();
    /// let mut torques_n_m = [9.0; 4];
    /// policy.step(&Readings::new(ahead, &[0.0; 4]), &mut torques_n_m);
    /// assert_eq!(torques_n_m, [0.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn state_mut(&mut self) -> &mut DriveState<R, N> {
        &mut self.state
    }
}

impl<R: Real, const N: usize> Policy<R> for DrivePolicy<R, N> {
    fn reset(&mut self) {
        *self = Self::new(self.drive);
    }

    fn step(&mut self, readings: &Readings<'_, R>, torques_n_m: &mut [R]) {
        let measured = of_wheels::<R, N>(readings.wheels_rad_s);
        let mut input = DriveInput::measured(&measured);
        for (heard, velocity) in input.readings_rad_s.iter_mut().zip(measured.rad_s) {
            // What is not a number did not arrive; what is no velocity is for the monitor to judge.
            *heard = (velocity == velocity).then_some(velocity);
        }
        input.command = readings.new_command.then_some(readings.command);
        let sample = self.drive.step(&mut self.state, &input);
        for (torque, applied) in torques_n_m.iter_mut().zip(sample.wheels.applied.n_m) {
            *torque = applied;
        }
        self.sample = Some(sample);
    }
}
