//! One interface to all controllers of omni-core: files choose wheel count and precision at run time.

mod drive;
mod link;
mod linked;
mod own;
mod qemu;
mod traction;

use omni_config::for_wheel_count;
use omni_core::{BodyTwist, ControllerPolicy, Kinematics, Policy, Readings, Real, WheelVelocities};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::config::{self, Precision, Scenario};
use crate::error::unknown;
use crate::following::SIGNALS;
use crate::{Error, WheelSignals, state_bytes};
pub use link::{Link, LinkCounters};
pub use own::{MOST_SIGNALS, check_name};
pub use qemu::{DEFAULT_FIRMWARE, Firmware, emulator};

/// What one control step did: [`omni_core::ControlSample`] in `f64`, for any number of wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ControlSample {
    /// What was asked for, before the heading hold and the limits. With the measured velocities and the gyro's rate it is all that
    /// the controller gets: replay starts from these.
    pub asked: BodyTwist<f64>,
    /// The gyro's rate \[rad/s\], counter-clockwise positive; 0 where no simulation reads one.
    pub gyro_rad_s: f64,
    /// The command, within the vehicle's limits.
    pub command: BodyTwist<f64>,
    /// The twist that the measured velocities amount to.
    pub estimated: BodyTwist<f64>,
    /// Factor on all torques or all references, 0 to 1.
    pub common_factor: f64,
    /// One entry a wheel, in the vehicle's order.
    pub wheels: Vec<WheelSignals>,
    /// Motors whose windings are shorted, one a wheel; empty for none. A shorted motor brakes with the slope of its torque over speed.
    pub brake: Vec<bool>,
    /// Times that traction control backed off for another try since the start; none of a controller that does not try again.
    pub retries: Option<u32>,
    /// Signals that only this controller has, in the order of [`AnyController::signal_names`].
    pub own: Vec<f64>,
}

impl ControlSample {
    /// Of a period that no controller had a part in: of its signals only the actuators' torques \[N.m\] are known, one a wheel,
    /// and all others are NaN. A zero would be taken for a measurement.
    ///
    /// ```
    /// use omni_sim::controller::ControlSample;
    /// let sample = ControlSample::past_the_controller(&[0.5, -0.5]);
    /// assert_eq!((sample.wheels.len(), sample.wheels[1].applied_n_m), (2, -0.5));
    /// assert!(sample.wheels[1].measured_rad_s.is_nan() && sample.common_factor.is_nan());
    /// ```
    #[must_use]
    pub fn past_the_controller(torques_n_m: &[f64]) -> Self {
        const UNKNOWN: f64 = f64::NAN;
        let signals = |applied_n_m: &f64| WheelSignals {
            applied_n_m: *applied_n_m,
            ..WheelSignals::UNKNOWN
        };
        Self {
            asked: BodyTwist::from_array([UNKNOWN; 3]),
            gyro_rad_s: UNKNOWN,
            command: BodyTwist::from_array([UNKNOWN; 3]),
            estimated: BodyTwist::from_array([UNKNOWN; 3]),
            common_factor: UNKNOWN,
            wheels: torques_n_m.iter().map(signals).collect(),
            brake: Vec::new(),
            retries: None,
            own: Vec::new(),
        }
    }
}

impl Default for ControlSample {
    fn default() -> Self {
        Self {
            asked: BodyTwist::ZERO,
            gyro_rad_s: 0.0,
            command: BodyTwist::ZERO,
            estimated: BodyTwist::ZERO,
            common_factor: 1.0,
            wheels: Vec::new(),
            brake: Vec::new(),
            retries: None,
            own: Vec::new(),
        }
    }
}

/// One control loop with its state.
trait Loop: Send + Sync {
    /// `sample` is overwritten but for its own signals where there are none, whatever is returned.
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error>;
    /// Names of signals that only this loop has.
    fn signal_names(&self) -> &[String] {
        &[]
    }
    /// Presses the emergency stop, or releases it; without one nothing happens.
    fn emergency_stop(&mut self, _pressed: bool) {}
    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64>;
    /// The state, for a snapshot; none at the other end of a link.
    fn save(&self) -> Option<Vec<u8>> {
        None
    }
    /// Goes on from a state that [`Loop::save`] gave; says whether it is one.
    fn restore(&mut self, _state: &[u8]) -> bool {
        false
    }
    /// What was not received so far; none without a link.
    fn link(&self) -> Option<LinkCounters> {
        None
    }
}

struct WheelLoops<R, const N: usize>(ControllerPolicy<R, N>);

fn scalar<R: Real>(t: &BodyTwist<f64>) -> BodyTwist<R> {
    BodyTwist {
        vx_m_s: R::of(t.vx_m_s),
        vy_m_s: R::of(t.vy_m_s),
        wz_rad_s: R::of(t.wz_rad_s),
    }
}

fn double<R: Real>(t: &BodyTwist<R>) -> BodyTwist<f64> {
    BodyTwist {
        vx_m_s: t.vx_m_s.as_f64(),
        vy_m_s: t.vy_m_s.as_f64(),
        wz_rad_s: t.wz_rad_s.as_f64(),
    }
}

/// Measured velocities in the controller's scalar.
fn velocities<R: Real, const N: usize>(measured: &[f64]) -> WheelVelocities<R, N> {
    let mut velocities = WheelVelocities::zero();
    for (v, m) in velocities.rad_s.iter_mut().zip(measured) {
        *v = R::of(*m);
    }
    velocities
}

impl ControlSample {
    /// The readings that did not arrive, as such: loops take them for 0, and who replays a log starts from what was read.
    fn mark_silent(&mut self, measured: &[f64]) {
        for (wheel, measured) in self.wheels.iter_mut().zip(measured) {
            if measured.is_nan() {
                wheel.measured_rad_s = f64::NAN;
            }
        }
    }

    /// Overwrites everything with what a controller of omni-core says.
    fn take<R: Real, const N: usize>(
        &mut self,
        s: &omni_core::ControlSample<R, N>,
        estimated: &BodyTwist<R>,
        residual: &WheelVelocities<R, N>,
    ) {
        self.command = double(&s.command);
        self.estimated = double(estimated);
        self.common_factor = s.wheels.common_factor.as_f64();
        self.retries = None;
        self.brake.clear();
        if s.wheels.shorted {
            self.brake.extend([true; N]);
        }
        self.wheels.clear();
        self.wheels.extend((0..N).map(|i| WheelSignals {
            reference_rad_s: s.wheels.reference.rad_s[i].as_f64(),
            measured_rad_s: s.wheels.measured.rad_s[i].as_f64(),
            p_n_m: s.wheels.p_n_m[i].as_f64(),
            i_n_m: s.wheels.i_n_m[i].as_f64(),
            d_n_m: s.wheels.d_n_m[i].as_f64(),
            requested_n_m: s.wheels.requested.n_m[i].as_f64(),
            applied_n_m: s.wheels.applied.n_m[i].as_f64(),
            limit_lower_n_m: s.wheels.range.lower_n_m[i].as_f64(),
            limit_upper_n_m: s.wheels.range.upper_n_m[i].as_f64(),
            residual_rad_s: residual.rad_s[i].as_f64(),
        }));
    }
}

impl<R: Real + Serialize + DeserializeOwned, const N: usize> Loop for WheelLoops<R, N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let velocities = velocities::<R, N>(readings.wheels_rad_s);
        let converted = Readings::new(scalar(&readings.command), &velocities.rad_s);
        self.0.step(&converted, &mut [R::zero(); N]);
        let (s, kinematics) = (self.0.sample(), self.0.controller().kinematics());
        sample.take(
            s,
            &kinematics.forward(&s.wheels.measured),
            &kinematics.residual(&s.wheels.measured),
        );
        sample.mark_silent(readings.wheels_rad_s);
        Ok(())
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(self.0.controller().kinematics(), twist)
    }

    fn save(&self) -> Option<Vec<u8>> {
        state_bytes::to_bytes(self.0.state()).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let state = state_bytes::from_bytes(state);
        state.is_ok_and(|state| {
            self.0.restore(state);
            true
        })
    }
}

/// Actuator velocities that move a vehicle with `twist`.
fn inverse<R: Real, const N: usize>(kinematics: &Kinematics<R, N>, twist: &BodyTwist<f64>) -> Vec<f64> {
    let velocities = kinematics.inverse(&scalar(twist));
    velocities.rad_s.iter().map(|v| v.as_f64()).collect()
}

/// A controller for as many wheels as the vehicle has: here in the precision the scenario names, or in `f32` at the other
/// end of a link.
pub struct AnyController {
    control: Box<dyn Loop>,
    policy: String,
    own: bool,
    /// Signals of the loop, then those of a path that is followed.
    names: Vec<String>,
}

impl AnyController {
    /// The controller of a scenario, freshly started.
    ///
    /// # Errors
    /// [`Error::Config`] where the vehicle and the control cannot be combined; a loaded scenario has been checked.
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        let refuse = |_| Err(wheel_count_refused(scenario));
        let count = scenario.vehicle().wheel.len();
        let built = match scenario.control.precision {
            Precision::F32 => for_wheel_count!(count, sized[f32](scenario), refuse),
            Precision::F64 => for_wheel_count!(count, sized[f64](scenario), refuse),
            _ => Err(unknown(scenario, "control.precision", "")),
        };
        Ok(Self::of_scenario(scenario, built?))
    }

    fn of_scenario(scenario: &Scenario, control: Box<dyn Loop>) -> Self {
        Self {
            names: names(scenario, &*control),
            control,
            policy: scenario.control.law(),
            own: false,
        }
    }

    /// A controller of one's own, for a vehicle of the scenario. Its torques are brought within what the motors give; vehicle limits of
    /// the command are its own affair. It is taken as it is: who gives one that was used before resets it. A snapshot does not hold what it
    /// remembers.
    ///
    /// # Errors
    /// As [`AnyController::new`] and [`check_name`]; [`Error::Config`] for a scenario with a `[drive]`; [`Error::Signal`] where the name of
    /// a signal of its own is none, is there twice, or is that of a column that every trace has.
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
        own::check_names(scenario, &name, control.signal_names())?;
        Ok(Self {
            names: names(scenario, &*control),
            control,
            policy: name,
            own: true,
        })
    }

    /// A controller that somebody serves at the other end of `link`, an [`omni_link::Server`], freshly started. It works in
    /// `f32` whatever the scenario says. Greets it: it must be built for this scenario, with [`Scenario::constants_digest`].
    ///
    /// # Errors
    /// [`Error::Config`] as [`AnyController::new`]; [`Error::Firmware`] where there is no answer, or not for this scenario.
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
    /// As [`AnyController::over_link`], and [`Error::Firmware`] where the image or the emulator is missing.
    pub fn in_qemu(scenario: &Scenario, firmware: &Firmware) -> Result<Self, Error> {
        without_bare_traction(scenario)?; // whatever image there is
        Self::over_link(scenario, firmware.start()?)
    }

    /// One control step; `measured_rad_s` has one actuator velocity a wheel. `sample` is overwritten, whatever is returned.
    ///
    /// # Errors
    /// [`Error::Link`] where a link has stopped, and ever after: the torques are zero then. No other controller fails.
    pub fn step(
        &mut self,
        command: &BodyTwist<f64>,
        measured_rad_s: &[f64],
        sample: &mut ControlSample,
    ) -> Result<(), Error> {
        (sample.asked, sample.gyro_rad_s) = (*command, 0.0);
        self.step_readings(&Readings::new(*command, measured_rad_s), sample)
    }

    /// One control step from everything that a vehicle knows. `sample` is overwritten but for what was asked for and the gyro's rate,
    /// whatever is returned.
    ///
    /// # Errors
    /// As [`AnyController::step`]; [`Error::Policy`] where a controller of one's own gives no torque that is a number, [`Error::PolicyFailed`]
    /// where it says that it failed.
    pub fn step_readings(
        &mut self,
        readings: &Readings<'_, f64>,
        sample: &mut ControlSample,
    ) -> Result<(), Error> {
        self.control.step(readings, sample)
    }

    /// What traces, tables and logs call it: the scenario's coordination policy ([`config::Control::law`]), or the name of a policy of
    /// one's own.
    #[must_use]
    pub fn policy(&self) -> &str {
        &self.policy
    }

    /// Is it one of somebody's own ([`AnyController::own`])? What it does then does not follow from the scenario.
    #[must_use]
    pub fn is_own(&self) -> bool {
        self.own
    }

    /// Presses the emergency stop of a `[drive]`, or releases it. A controller without one goes on.
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// use omni_sim::{config::{Override, Scenario}, controller::{AnyController, ControlSample}};
    /// let scenario = Scenario::load("flat", &[Override::new("drive.command_timeout_s", 0.5)])?;
    /// let mut controller = AnyController::new(&scenario)?;
    /// controller.emergency_stop(true);
    /// let (ahead, mut sample) = (BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO }, ControlSample::default());
    /// controller.step(&ahead, &[0.0; 7], &mut sample)?;
    /// assert_eq!((sample.own[0], sample.wheels[0].reference_rad_s), (3.0, 0.0)); // stopped
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn emergency_stop(&mut self, pressed: bool) {
        self.control.emergency_stop(pressed);
    }

    /// Names of signals that only this controller has, and those of a path that it follows: columns of the trace beside those that every one has.
    #[must_use]
    pub fn signal_names(&self) -> &[String] {
        &self.names
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

    /// What was lost on the link so far; none where the controller runs here.
    #[must_use]
    pub fn link(&self) -> Option<LinkCounters> {
        self.control.link()
    }
}

/// Names of the signals that only a run of this scenario with this loop has.
fn names(scenario: &Scenario, control: &dyn Loop) -> Vec<String> {
    let path = SIGNALS.iter().filter(|_| scenario.command.path.is_some());
    let own = control.signal_names().iter().cloned();
    own.chain(path.map(|name| (*name).to_owned())).collect()
}

/// Traction control runs at the other end of a link inside a drive only.
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

fn sized<R: Real + Serialize + DeserializeOwned, const N: usize>(
    scenario: &Scenario,
) -> Result<Box<dyn Loop>, config::Error> {
    if let Some(drive) = scenario.traction_drive::<R, N>()? {
        return Ok(Box::new(drive::TractionLoop::new(scenario, drive)));
    }
    if let Some(drive) = scenario.drive::<R, N>()? {
        return Ok(Box::new(drive::DriveLoop::new(scenario, drive)));
    }
    if let Some(policy) = scenario.traction::<R, N>()? {
        return Ok(Box::new(traction::TractionLoop::new(scenario, policy)));
    }
    let (limiter, controller) = (scenario.limiter()?, scenario.controller::<R, N>()?);
    Ok(Box::new(WheelLoops(ControllerPolicy::new(limiter, controller))))
}

fn owned<const N: usize>(
    scenario: &Scenario,
    policy: Box<dyn Policy<f64> + Send + Sync>,
) -> Result<Box<dyn Loop>, config::Error> {
    Ok(Box::new(own::UserPolicy::<N>::new(scenario, policy)?))
}

fn linked<const N: usize>(scenario: &Scenario, link: Link) -> Result<Box<dyn Loop>, Error> {
    Ok(Box::new(linked::Linked::<N>::greet(scenario, link)?))
}
