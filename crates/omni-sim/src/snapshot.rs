//! A simulation as bytes and back; the continuation is bit-identical.

use serde::{Deserialize, Serialize};

use crate::control_loop::LoopState;
use crate::controller::AnyController;
use crate::following::{self, Following};
use crate::odometry;
use crate::{Error, Period, Sensed, Simulation, config::Scenario, sensing, state_bytes};

/// The layout of the bytes below: another number, another layout.
const FORMAT: u32 = 13;

/// What comes first, so that a wrong file is named rather than misread.
#[derive(PartialEq, Serialize, Deserialize)]
struct Header {
    format: u32,
    /// Another version may simulate otherwise.
    program: String,
    /// CRC-32 of the scenario as TOML.
    scenario: u32,
}

impl Header {
    fn of(scenario: &Scenario) -> Result<Self, Error> {
        let text = scenario
            .to_resolved_toml()
            .map_err(|error| refuse(error.to_string()))?;
        Ok(Self {
            format: FORMAT,
            program: crate::VERSION.into(),
            scenario: crc32fast::hash(text.as_bytes()),
        })
    }
}

/// What follows the header; saving and resuming name the same fields in the same order.
#[derive(Serialize)]
struct Saved<'a> {
    world: Vec<u8>,
    sensing: &'a sensing::State,
    control: LoopState,
    period: &'a Period,
    sensed: &'a Sensed,
    odometry: odometry::State,
    following: Option<following::State>,
}

#[derive(Deserialize)]
struct Resumed {
    world: Vec<u8>,
    sensing: sensing::State,
    control: LoopState,
    period: Period,
    sensed: Sensed,
    odometry: odometry::State,
    following: Option<following::State>,
}

fn refuse(reason: impl Into<String>) -> Error {
    Error::Snapshot {
        reason: reason.into(),
    }
}

impl Simulation {
    /// All data that [`Simulation::resume`] needs for a bit-identical continuation.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if the controller is at the other end of a link, whose state cannot be read, and in a build
    /// without the feature `snapshots`.
    ///
    /// ```
    /// use omni_sim::{Simulation, config::Scenario};
    /// let scenario = Scenario::load("step", &[])?;
    /// let mut simulation = Simulation::new(&scenario)?;
    /// for _ in 0..100 {
    ///     simulation.step(&simulation.scenario_command())?;
    /// }
    /// let mut resumed = Simulation::resume(&scenario, &simulation.save(&scenario)?)?;
    /// for each in [&mut simulation, &mut resumed] {
    ///     each.step(&each.scenario_command())?;
    /// }
    /// assert_eq!(simulation.observation(), resumed.observation());
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn save(&self, scenario: &Scenario) -> Result<Vec<u8>, Error> {
        state_bytes::check_built_in()?;
        let control = self
            .control
            .save()
            .ok_or_else(|| refuse("its controller runs at the other end of a link"))?;
        let saved = Saved {
            world: self.world.save().map_err(|error| refuse(error.to_string()))?,
            sensing: self.sensing.state(),
            control,
            period: &self.period,
            sensed: &self.sensed,
            odometry: self.odometer.state(),
            following: self.following.as_ref().map(Following::state),
        };
        let mut bytes = state_bytes::to_bytes(&(Header::of(scenario)?, saved))
            .map_err(|error| refuse(error.to_string()))?;
        let checksum = crc32fast::hash(&bytes);
        bytes.extend(checksum.to_le_bytes());
        Ok(bytes)
    }

    /// A simulation of the same scenario at the time when `bytes` were saved.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if they are damaged, or of another scenario or version.
    pub fn resume(scenario: &Scenario, bytes: &[u8]) -> Result<Self, Error> {
        Self::resume_with_controller(scenario, AnyController::new(scenario)?, bytes)
    }

    /// [`Simulation::resume`] with a controller that was made for the scenario. A custom controller
    /// ([`AnyController::own`]) comes with its own state, which the bytes do not hold.
    ///
    /// # Errors
    /// As [`Simulation::resume`].
    ///
    /// ```
    /// use omni_core::{Policy, Readings};
    /// use omni_sim::{Simulation, config::Scenario, controller::AnyController};
    /// /// Pushes ahead more and more.
    /// #[derive(Clone)]
    /// struct Ramp(f64);
    /// impl Policy<f64> for Ramp {
    ///     fn reset(&mut self) {}
    ///     fn step(&mut self, _: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
    ///         self.0 += 0.01;
    ///         torques_n_m[0] = self.0;
    ///     }
    /// }
    /// let scenario = Scenario::load("flat", &[])?;
    /// let started = AnyController::own(&scenario, Box::new(Ramp(0.0)))?;
    /// let mut simulation = Simulation::with_controller(&scenario, started)?;
    /// simulation.step(&simulation.scenario_command())?;
    /// let (bytes, again) = (simulation.save(&scenario)?, AnyController::own(&scenario, Box::new(Ramp(0.01)))?);
    /// let mut resumed = Simulation::resume_with_controller(&scenario, again, &bytes)?;
    /// resumed.step(&resumed.scenario_command())?;
    /// assert_eq!(resumed.sample().wheels[0].applied_n_m, 0.02);
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn resume_with_controller(
        scenario: &Scenario,
        controller: AnyController,
        bytes: &[u8],
    ) -> Result<Self, Error> {
        state_bytes::check_built_in()?;
        // The checksum comes last: of another version there may be none.
        let (whole, checksum) = bytes
            .split_last_chunk()
            .ok_or_else(|| refuse("it is not a snapshot"))?;
        let (header, rest): (Header, _) =
            state_bytes::take_from_bytes(whole).map_err(|_| refuse("it is not a snapshot"))?;
        let own = Header::of(scenario)?;
        if header.format != own.format || header.program != own.program {
            let named = |header: &Header| format!("version {}, format {}", header.program, header.format);
            return Err(refuse(format!(
                "it has {}, this program reads {}",
                named(&header),
                named(&own)
            )));
        }
        // Physics that go on from numbers of no run end in a panic, or in a run of another scenario.
        if u32::from_le_bytes(*checksum) != crc32fast::hash(whole) {
            return Err(refuse("it is damaged: its checksum is wrong"));
        }
        if header.scenario != own.scenario {
            return Err(refuse("it belongs to another scenario"));
        }
        let resumed: Resumed =
            state_bytes::from_bytes(rest).map_err(|error| refuse(format!("it is damaged: {error}")))?;
        let mut simulation = Self::with_controller(scenario, controller)?;
        if !simulation.control.restore(resumed.control) {
            return Err(refuse("its controller's state is damaged"));
        }
        let damaged = |error| refuse(format!("it is damaged: {error}"));
        simulation.world.restore(&resumed.world).map_err(damaged)?;
        simulation.sensing.restore(resumed.sensing);
        for sensed in [&resumed.period.sensed, &resumed.sensed] {
            if !sensed.is_of(scenario.vehicle()) {
                return Err(refuse("it is damaged: sensors of another vehicle"));
            }
        }
        simulation.period = resumed.period;
        simulation.sensed = resumed.sensed;
        if !simulation.odometer.restore(resumed.odometry) {
            return Err(refuse("it is damaged: odometry of another kind"));
        }
        let follows = match (&mut simulation.following, resumed.following) {
            (Some(following), Some(state)) => {
                following.restore(state);
                true
            }
            (None, None) => true,
            _ => false,
        };
        if !follows {
            return Err(refuse("it is damaged: a path of another scenario"));
        }
        Ok(simulation)
    }
}
