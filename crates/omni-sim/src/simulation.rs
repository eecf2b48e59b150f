//! Controller and plant in one loop, one control period at a time.

use omni_core::BodyTwist;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::config::{Command, Engine, Scenario};
use crate::control_loop::ControlLoop;
use crate::controller::{AnyController, ControlSample};
use crate::following::Following;
use crate::observation::Observation;
use crate::odometry::Odometer;
use crate::sensed::Sensed;
use crate::sensing::Sensing;
use crate::world::{AnyPlant, ExternalPhysics, external, plant};
use crate::{Error, Period};

/// A scenario being simulated.
///
/// ```
/// use omni_sim::{Simulation, config::Scenario};
/// use omni_core::BodyTwist;
/// let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
/// for _ in 0..500 {
///     simulation.step(&BodyTwist { vx_m_s: 0.2, vy_m_s: 0.0, wz_rad_s: 0.0 })?;
/// }
/// assert!((simulation.observation().twist.vx_m_s - 0.2).abs() < 0.02);
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct Simulation {
    pub(crate) world: AnyPlant,
    pub(crate) sensing: Sensing,
    pub(crate) control: ControlLoop,
    /// The last one.
    pub(crate) period: Period,
    /// Present sensor readings.
    pub(crate) sensed: Sensed,
    torques: Vec<f64>,
    command: Command,
    /// Follower of the command's path.
    pub(crate) following: Option<Following>,
    pub(crate) odometer: Odometer,
}

impl Simulation {
    /// The scenario at its start, at rest.
    ///
    /// # Errors
    /// As [`AnyController::new`] and [`Simulation::with_controller`].
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        Self::with_controller(scenario, AnyController::new(scenario)?)
    }

    /// The scenario at its start, at rest, with a controller that was made for it and is freshly started.
    ///
    /// # Errors
    /// [`Error::Config`] for ground or a fault of a kind that only a newer omni-sim knows, and for
    /// a path that cannot be planned.
    pub fn with_controller(scenario: &Scenario, controller: AnyController) -> Result<Self, Error> {
        Self::of_plant(scenario, controller, |x_m, yaw_rad| plant(scenario, x_m, yaw_rad))
    }

    /// [`Simulation::with_controller`] with external physics, which simulate the scenario's vehicle
    /// on its ground. It cannot be saved.
    ///
    /// # Errors
    /// As [`Simulation::with_controller`]; [`Error::External`] if they cannot start.
    pub fn with_physics(
        scenario: &Scenario,
        controller: AnyController,
        physics: Box<dyn ExternalPhysics>,
    ) -> Result<Self, Error> {
        Self::of_plant(scenario, controller, |x_m, yaw_rad| {
            external(scenario, physics, x_m, yaw_rad)
        })
    }

    fn of_plant(
        scenario: &Scenario,
        controller: AnyController,
        plant: impl FnOnce(f64, f64) -> Result<AnyPlant, Error>,
    ) -> Result<Self, Error> {
        let mut rng = ChaCha8Rng::seed_from_u64(scenario.seed);
        // 53 bits: uniform in -1..1.
        let mut uniform = move || (rng.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
        let yaw_rad = scenario.perturbation.yaw_rad * uniform();
        let x_m = scenario.perturbation.start_m * uniform();
        let mut world = plant(x_m, yaw_rad)?;
        let mut observation = Observation::of(scenario.vehicle());
        world.observe(&mut observation);
        world.start_energy_balance(&mut observation);
        let start = observation.pose;
        let following = Following::new(scenario, &start.planar())?;
        let odometer = Odometer::new(scenario, &start)?;
        let mut simulation = Self {
            world,
            sensing: Sensing::new(scenario),
            control: ControlLoop::new(scenario, controller),
            period: Period {
                sensed: Sensed::at_rest(scenario.vehicle()),
                control: ControlSample::default(),
                observed: observation,
            },
            sensed: Sensed::at_rest(scenario.vehicle()),
            torques: Vec::new(),
            command: scenario.command.clone(),
            following,
            odometer,
        };
        simulation.sense();
        Ok(simulation)
    }

    /// Reads the sensors, once after every period, and from them odometry and the follower of the path, which
    /// reports in the controller's place.
    fn sense(&mut self) {
        self.world.measure(&mut self.sensed.wheels_rad_s);
        self.sensing
            .read(self.world.angles_rad(), &self.period.observed, &mut self.sensed);
        self.odometer.read(&self.period.control, &self.sensed);
        self.period.observed.odometry = self.odometer.estimate();
        if let Some(ground) = self.odometer.ground() {
            self.sensed.climbed_m = ground.climbed_m();
            self.period.control.report.ground = Some(ground.clone());
        }
        let time_s = self.world.time_ns() as f64 * 1e-9;
        if let Some(following) = &mut self.following {
            let estimated = self.odometer.estimated_pose();
            self.period.control.report.path =
                Some(following.advance(time_s, &self.period.observed, estimated));
        }
    }

    /// The scenario's own command for the next period, as the vehicle looks now.
    #[must_use]
    pub fn scenario_command(&self) -> BodyTwist<f64> {
        self.scenario_command_at(self.time_ns() as f64 * 1e-9)
    }

    /// The scenario's own command at a time \[s\], for the present heading and, on a path, the present pose.
    ///
    /// ```
    /// use omni_sim::{Simulation, config::Scenario};
    /// let simulation = Simulation::new(&Scenario::load("square", &[])?)?;
    /// assert_eq!(simulation.scenario_command().vx_m_s, 0.0);
    /// // A second later it should be on its way at 0.6 m/s, and here is 0.3 m/s of correction for being late.
    /// assert!((simulation.scenario_command_at(1.0).vx_m_s - 0.9).abs() < 1e-9);
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    #[must_use]
    pub fn scenario_command_at(&self, time_s: f64) -> BodyTwist<f64> {
        match &self.following {
            Some(following) => following.command(time_s, &self.period.observed),
            None => self
                .command
                .for_heading(time_s, self.period.observed.pose.yaw_rad()),
        }
    }

    /// Continues with the controller of another scenario of the same vehicle: another policy, gains or torque limit. It
    /// goes on from the present one's state. Between traction control and wheel loops that is the limited command, or
    /// all of a `[drive]` but its loops: their integrals start at 0. The heading hold remains that of the first
    /// scenario.
    ///
    /// # Errors
    /// As [`AnyController::new`]; [`Error::Snapshot`] if the state does not fit: other wheels, another precision, a
    /// `[drive]` after none or none after one, the user's own controller, or one at the other end of a link; and in a
    /// build without the feature `snapshots`.
    ///
    /// ```
    /// use omni_sim::{Simulation, config::{Override, Scenario}};
    /// let scenario = Scenario::load("step", &[])?;
    /// let mut simulation = Simulation::new(&scenario)?;
    /// simulation.take_control(&scenario.with_policy("independent")?)?;
    /// simulation.step(&simulation.scenario_command())?;
    /// assert_eq!(simulation.sample().common_factor, 1.0);
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn take_control(&mut self, scenario: &Scenario) -> Result<(), Error> {
        let twist = self.period.observed.odometry.twist;
        self.control.replace(AnyController::new(scenario)?, &twist)
    }

    /// One control period: measures, controls, holds the torques while the physics advance.
    ///
    /// # Errors
    /// [`Error::Argument`] for a command that is not finite (nothing happens then); [`Error::Diverged`] if the physics
    /// fails, [`Error::FellApart`] if a joint gives way, [`Error::Unsettled`] if contacts do not settle, and ever
    /// after; [`Error::Link`] if the link to the controller has stopped, and ever after: the vehicle runs on without
    /// torque; [`Error::Policy`] if a controller of one's own gives no torque that is a number, [`Error::PolicyFailed`]
    /// if it says that it failed.
    pub fn step(&mut self, command: &BodyTwist<f64>) -> Result<(), Error> {
        for (name, value) in [
            ("vx_m_s", command.vx_m_s),
            ("vy_m_s", command.vy_m_s),
            ("wz_rad_s", command.wz_rad_s),
        ] {
            if !value.is_finite() {
                return Err(Error::Argument {
                    name,
                    value: value.to_string(),
                    allowed: "finite",
                });
            }
        }
        self.control_and_advance(command, &[])
    }

    /// [`Simulation::step`] for a finite command, with torques added to the controller's \[N.m\],
    /// one per wheel or none at all, within the limits that it worked with. The controller does not know of them but by
    /// what the wheels then do.
    pub(crate) fn step_helped(&mut self, command: &BodyTwist<f64>, added_n_m: &[f64]) -> Result<(), Error> {
        self.control_and_advance(command, added_n_m)
    }

    fn control_and_advance(&mut self, command: &BodyTwist<f64>, added_n_m: &[f64]) -> Result<(), Error> {
        self.period.sensed.clone_from(&self.sensed);
        let controlled = self.control.step(command, &self.sensed, &mut self.period.control);
        for (wheel, added_n_m) in self.period.control.wheels.iter_mut().zip(added_n_m) {
            let (lower, upper) = (wheel.limit_lower_n_m, wheel.limit_upper_n_m);
            wheel.applied_n_m = (wheel.applied_n_m + added_n_m).max(lower).min(upper);
        }
        self.torques.clear();
        self.torques
            .extend(self.period.control.wheels.iter().map(|wheel| wheel.applied_n_m));
        if !added_n_m.is_empty() {
            self.control.gave(&self.torques);
        }
        self.odometer.stepped(&self.period.control);
        self.world.brake(&self.period.control.brake);
        self.world.step(&self.torques, &mut self.period.observed)?;
        self.sense();
        controlled
    }

    /// Holds actuator torques \[N.m\], one per wheel, for one control period, without the controller.
    ///
    /// # Errors
    /// [`Error::Argument`] for a wrong count or a torque that is not finite; [`Error::Diverged`],
    /// [`Error::FellApart`], [`Error::Unsettled`].
    pub fn step_torques(&mut self, torques_n_m: &[f64]) -> Result<(), Error> {
        let bad = torques_n_m.iter().find(|t| !t.is_finite());
        if torques_n_m.len() != self.period.observed.wheels.len() || bad.is_some() {
            let value = bad.map_or_else(|| format!("{} values", torques_n_m.len()), f64::to_string);
            return Err(Error::Argument {
                name: "torques_n_m",
                value,
                allowed: "one finite torque for each wheel",
            });
        }
        self.control.passed_by(torques_n_m);
        self.period.sensed.clone_from(&self.sensed);
        self.period.control = ControlSample::without_controller(torques_n_m);
        self.world.brake(&[]);
        self.world.step(torques_n_m, &mut self.period.observed)?;
        self.sense();
        Ok(())
    }

    /// The physics of one control period and nothing else: no control, no observation, no energy
    /// balance. Reference of a benchmark.
    #[doc(hidden)]
    pub fn advance_physics(&mut self, torques_n_m: &[f64]) {
        self.world.advance(torques_n_m);
    }

    /// Encoder readings of the actuator velocities after the last step \[rad/s\], one per wheel: the measurement of the
    /// next step.
    #[must_use]
    pub fn measured_rad_s(&self) -> &[f64] {
        &self.sensed.wheels_rad_s
    }

    /// All sensor readings after the last step, one control period later than `period().sensed`: the controller's input
    /// in the next step, besides its command and its own torques.
    #[must_use]
    pub fn sensed(&self) -> &Sensed {
        &self.sensed
    }

    /// Yaw rate as the gyro sees it now \[rad/s\], counter-clockwise positive.
    #[must_use]
    pub fn gyro_rad_s(&self) -> f64 {
        self.sensed.gyro_rad_s
    }

    /// The controller.
    #[must_use]
    pub fn controller(&self) -> &AnyController {
        self.control.controller()
    }

    /// The last control period: the controller's result, and the resulting state.
    #[must_use]
    pub fn period(&self) -> &Period {
        &self.period
    }

    /// The controller's result in the last period; after [`Simulation::step_torques`] only its torques are known.
    #[must_use]
    pub fn sample(&self) -> &ControlSample {
        &self.period.control
    }

    /// The vehicle after the last step.
    #[must_use]
    pub fn observation(&self) -> &Observation {
        &self.period.observed
    }

    /// The physics engine, if it is not the scenario's.
    pub(crate) fn engine(&self) -> Option<Engine> {
        self.world.engine()
    }

    /// Simulated time since the start \[ns\].
    #[must_use]
    pub fn time_ns(&self) -> u64 {
        self.world.time_ns()
    }
}
