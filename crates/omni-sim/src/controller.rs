//! One interface to all controllers of omni-core: files choose wheel count and precision at run time.

mod built_in;
mod control_law;
mod emulator_process;
mod link;
mod linked;
mod own;
mod qemu;

use omni_config::for_wheel_count;
use omni_core::{BodyTwist, Policy, Readings};

use crate::config::{self, OdometryKind, Precision, Scenario};
pub use crate::control_sample::ControlSample;
use crate::error::unknown;
pub use crate::link_counters::LinkCounters;
use crate::{Error, Report, ReportColumns};
use built_in::built_in;
use control_law::ControlLaw;
pub use link::Link;
pub use own::{MOST_SIGNALS, check_name};
pub use qemu::{DEFAULT_FIRMWARE, Firmware, emulator};

/// A controller for the vehicle's number of wheels: local in the scenario's precision, or in `f32` at the other end of
/// a link.
pub struct AnyController {
    control: Box<dyn ControlLaw>,
    policy: String,
    own: bool,
    /// Its report, and the reference pose of a followed path.
    columns: ReportColumns,
}

impl AnyController {
    /// The controller of a scenario, freshly started.
    ///
    /// # Errors
    /// [`Error::Config`] if the vehicle and the control cannot be combined; a loaded scenario has been checked.
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        let refuse = |_| Err(wheel_count_refused(scenario));
        let count = scenario.vehicle().wheel.len();
        let built = match scenario.control.precision {
            Precision::F32 => for_wheel_count!(count, built_in[f32](scenario), refuse),
            Precision::F64 => for_wheel_count!(count, built_in[f64](scenario), refuse),
            _ => Err(unknown(scenario, "control.precision", "")),
        };
        Ok(Self::of_scenario(scenario, built?))
    }

    fn of_scenario(scenario: &Scenario, control: Box<dyn ControlLaw>) -> Self {
        Self {
            columns: columns(scenario, &*control),
            control,
            policy: scenario.control.law(),
            own: false,
        }
    }

    /// A controller of one's own, for a vehicle of the scenario. Its torques are limited to the motors' ranges; it is
    /// responsible for vehicle limits of the command. It is used as it is; the caller resets one that was used before.
    /// A snapshot does not contain its state.
    ///
    /// # Errors
    /// As [`AnyController::new`] and [`check_name`]; [`Error::Config`] for a scenario with a
    /// `[drive]`; [`Error::Signal`] if the name of one of its signals is invalid, duplicate, or the name of a column
    /// that every trace has.
    ///
    /// ```
    /// use omni_core::{Policy, Readings};
    /// use omni_sim::{Error, Run, config::{Override, Scenario}, controller::AnyController};
    /// /// Every wheel towards the speed that goes ahead with 0.3 m/s, and how hard it tries.
    /// struct Own(f64);
    /// impl Policy<f64> for Own {
    ///     fn reset(&mut self) {}
    ///     fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
    ///         for (i, torque) in torques_n_m.iter_mut().enumerate() {
    ///             let ahead = [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0][i] * 0.3 / 0.066;
    ///             *torque = 0.3 * (ahead - readings.wheels_rad_s[i]);
    ///         }
    ///         self.0 = torques_n_m[0];
    ///     }
    ///     fn signal_name(&self, index: usize) -> Option<&str> {
    ///         ["effort_n_m"].get(index).copied()
    ///     }
    ///     fn signals(&self, values: &mut [f64]) {
    ///         values[0] = self.0;
    ///     }
    /// }
    /// let scenario = Scenario::load("flat", &[Override::new("duration_s", 1.0)])?;
    /// let controller = AnyController::own(&scenario, Box::new(Own(0.0)))?;
    /// let trace = Run::new(&scenario).controller(controller).trace()?;
    /// assert!(trace.column("twist_vx_m_s").is_some_and(|speed| speed[999] > 0.25));
    /// assert!(trace.column("effort_n_m").is_some_and(|effort| effort[0] > 1.3));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn own(scenario: &Scenario, policy: Box<dyn Policy<f64> + Send + Sync>) -> Result<Self, Error> {
        if scenario.drive.is_some() {
            return Err(refused(
                scenario,
                "drive".into(),
                "[drive], allowed: only without a custom controller, which replaces it",
            ));
        }
        let refuse = |_| Err(wheel_count_refused(scenario));
        let count = scenario.vehicle().wheel.len();
        let name = policy.name().to_owned();
        check_name(&name)?;
        let control = for_wheel_count!(count, owned[](scenario, policy), refuse)?;
        own::check_names(scenario, &name, control.columns().names())?;
        Ok(Self {
            columns: columns(scenario, &*control),
            control,
            policy: name,
            own: true,
        })
    }

    /// A controller at the other end of `link`, an [`omni_link::Server`], freshly started. It works in `f32` whatever
    /// the scenario says. Greets it: it must be built for this scenario, with [`Scenario::constants_digest`].
    ///
    /// # Errors
    /// [`Error::Config`] as [`AnyController::new`]; [`Error::Firmware`] if there is no answer, or not for this
    /// scenario.
    pub fn over_link(scenario: &Scenario, link: Link) -> Result<Self, Error> {
        without_bare_traction(scenario)?;
        let refuse = |_| Err(wheel_count_refused(scenario).into());
        let count = scenario.vehicle().wheel.len();
        let control = for_wheel_count!(count, linked[](scenario, link), refuse)?;
        Ok(Self::of_scenario(scenario, control))
    }

    /// A controller in an emulated Cortex-M4F, in lock-step: the physics wait for it, it waits for them.
    ///
    /// # Errors
    /// As [`AnyController::over_link`], and [`Error::Firmware`] if the image or the emulator is missing.
    pub fn in_qemu(scenario: &Scenario, firmware: &Firmware) -> Result<Self, Error> {
        without_bare_traction(scenario)?; // whatever image there is
        Self::over_link(scenario, firmware.start()?)
    }

    /// One control step; `measured_rad_s` has one actuator velocity a wheel. `sample` is
    /// overwritten, whatever is returned.
    ///
    /// # Errors
    /// As [`AnyController::step_readings`].
    pub fn step(
        &mut self,
        command: &BodyTwist<f64>,
        measured_rad_s: &[f64],
        sample: &mut ControlSample,
    ) -> Result<(), Error> {
        sample.asked = *command;
        self.step_readings(&Readings::new(*command, measured_rad_s), sample)
    }

    /// One control step from everything that a vehicle knows. `sample` is overwritten but for what
    /// was asked for, whatever is returned.
    ///
    /// # Errors
    /// [`Error::Link`] if a link has stopped, and ever after, with zero torques; [`Error::Policy`] if a custom
    /// controller returns a torque that is not a number, [`Error::PolicyFailed`] if it reports a failure.
    pub fn step_readings(
        &mut self,
        readings: &Readings<'_, f64>,
        sample: &mut ControlSample,
    ) -> Result<(), Error> {
        sample.report = Report::default();
        let stepped = self.control.step(readings, sample);
        // As they were read, before any monitor or loop: a replay of a log starts from these.
        for (wheel, measured_rad_s) in sample.wheels.iter_mut().zip(readings.wheels_rad_s) {
            wheel.measured_rad_s = *measured_rad_s;
        }
        stepped
    }

    /// Its name in traces, tables and logs: the scenario's coordination policy ([`config::Control::law`]), or the name
    /// of a custom policy.
    #[must_use]
    pub fn policy(&self) -> &str {
        &self.policy
    }

    /// Whether it is the user's own ([`AnyController::own`]). Its behaviour then does not follow from the scenario.
    #[must_use]
    pub fn is_own(&self) -> bool {
        self.own
    }

    /// Presses the emergency stop of a `[drive]`, or releases it. A controller without one goes on.
    ///
    /// ```
    /// use omni_core::{BodyTwist, DriveMode};
    /// use omni_sim::{config::{Override, Scenario}, controller::{AnyController, ControlSample}};
    /// let scenario = Scenario::load("flat", &[Override::new("drive.command_timeout_s", 0.5)])?;
    /// let mut controller = AnyController::new(&scenario)?;
    /// controller.emergency_stop(true);
    /// let (ahead, mut sample) = (BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO }, ControlSample::default());
    /// controller.step(&ahead, &[0.0; 7], &mut sample)?;
    /// let mode = sample.report.drive.map(|drive| drive.mode);
    /// assert_eq!((mode, sample.wheels[0].reference_rad_s), (Some(DriveMode::EmergencyStop), 0.0));
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn emergency_stop(&mut self, pressed: bool) {
        self.control.emergency_stop(pressed);
    }

    /// Contents of its [`Report`]s, and the reference pose of a followed path: additional columns of the trace.
    #[must_use]
    pub fn columns(&self) -> &ReportColumns {
        &self.columns
    }

    /// Actuator velocities \[rad/s\] that move the vehicle with `twist`.
    #[must_use]
    pub fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        self.control.inverse(twist)
    }

    pub(crate) fn save(&self) -> Option<Vec<u8>> {
        self.control.save()
    }

    pub(crate) fn restore(&mut self, state: &[u8]) -> bool {
        self.control.restore(state)
    }

    /// Continues after another controller of the same vehicle, which moves with `twist`: from all of its state, or from
    /// the part that both kinds have. Says whether it can.
    pub(crate) fn take_over(&mut self, from: &Self, twist: &BodyTwist<f64>) -> bool {
        from.save().is_some_and(|state| self.restore(&state))
            || (from.control.hand_over()).is_some_and(|handed| self.control.take_over(&handed, twist))
    }

    /// Losses on the link so far; none if the controller is local.
    #[must_use]
    pub fn link_counters(&self) -> Option<LinkCounters> {
        self.control.link_counters()
    }
}

/// Report columns of a run of this scenario with this controller.
fn columns(scenario: &Scenario, control: &dyn ControlLaw) -> ReportColumns {
    let mut columns = control.columns();
    if scenario.odometry.kind == OdometryKind::Ground {
        columns = columns.with_ground(scenario.vehicle());
    }
    if scenario.command.path.is_some() {
        columns = columns.following_a_path();
    }
    columns
}

/// At the other end of a link, traction control runs only inside a drive.
fn without_bare_traction(scenario: &Scenario) -> Result<(), config::Error> {
    match scenario.drive {
        Some(_) => Ok(()),
        None => scenario.without_traction("without [drive] for a controller at the other end of a link"),
    }
}

/// A key of a scenario that its controller does not go with.
fn refused(scenario: &Scenario, key: String, message: &str) -> Error {
    let file = format!("scenario {}", scenario.name);
    let message = message.into();
    config::Error::Key { file, key, message }.into()
}

fn wheel_count_refused(scenario: &Scenario) -> config::Error {
    config::Error::Key {
        file: format!("vehicle {}", scenario.vehicle().name),
        key: "wheel".into(),
        message: config::wheel_count_refused(scenario.vehicle().wheel.len()).to_string(),
    }
}

fn owned<const N: usize>(
    scenario: &Scenario,
    policy: Box<dyn Policy<f64> + Send + Sync>,
) -> Result<Box<dyn ControlLaw>, config::Error> {
    Ok(Box::new(own::UserPolicy::<N>::new(scenario, policy)?))
}

fn linked<const N: usize>(scenario: &Scenario, link: Link) -> Result<Box<dyn ControlLaw>, Error> {
    Ok(Box::new(linked::Linked::<N>::greet(scenario, link)?))
}
