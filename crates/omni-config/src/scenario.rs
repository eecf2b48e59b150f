//! A scenario file: vehicle, ground, command, controller, physics.

mod policy;
mod start;
mod wheels;

use std::path::{Path, PathBuf};

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::Error;
use crate::command::{Command, Start};
use crate::command_file::CommandFile;
use crate::control::{AUTO, AutoPolicy, Control};
use crate::derived_gains::DerivedGains;
use crate::drive::Drive;
use crate::fault::Fault;
use crate::file_kind::FileKind;
use crate::height_map::HeightMap;
use crate::imperfections::{Actuators, HeadingHold, Sensors};
use crate::key_place::with_place;
use crate::load::{Source, check_version, read};
use crate::log_rates::LogRates;
use crate::microseconds::seconds;
use crate::odometry::{Odometry, OdometryKind};
use crate::override_key::Override;
use crate::physics::{Engine, Physics};
#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{self, DURATION_S, HEADING_RAD, OFFSET_M, TIME_LIMIT_S, is_name};
use crate::rollers::WheelModel;
use crate::suggestion::did_you_mean;
use crate::terrain::{Block, FrictionPatch, Terrain};
use crate::vehicle::Vehicle;

/// A scenario file with its vehicle. Written as TOML it is complete: the vehicle is a table inside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of the file format; always 1.
    #[garde(skip)] // checked before anything else is read
    #[cfg_attr(feature = "schema", schemars(range(min = crate::SCHEMA_VERSION, max = crate::SCHEMA_VERSION)))]
    pub schema_version: u32,
    /// Name in logs and file names.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// The vehicle. In a file: the name of a built-in vehicle, a path relative to the file, or the vehicle's own table.
    #[garde(skip)] // checked with its own source, before it is put here
    #[cfg_attr(feature = "schema", schemars(with = "VehicleChoice"))]
    vehicle: Vehicle,
    /// Keys of the vehicle that this scenario replaces: `"vehicle.motor.stall_torque_n_m" = 1.0`.
    #[serde(default, skip_serializing)]
    #[garde(skip)]
    #[cfg_attr(
        feature = "schema",
        schemars(with = "std::collections::BTreeMap<String, serde_json::Value>")
    )]
    set: Table,
    /// Simulated time \[s\], 0.01 to 3600; 10 if left out.
    #[serde(default = "ten_seconds")]
    #[garde(adapt(ranges), range(min = DURATION_S.min, max = DURATION_S.max))]
    pub duration_s: f64,
    /// Ends a run as soon as every wheel stands beyond the obstacle, before `duration_s`; without
    /// effect on flat ground. False by default.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[garde(skip)]
    pub stop_when_done: bool,
    /// Longest real time of a run \[s\], 0.01 to 1e6; it then ends with an error. Without effect if there is no clock:
    /// in `wasm32-unknown-unknown`.
    #[serde(default = "an_hour")]
    #[garde(adapt(ranges), range(min = TIME_LIMIT_S.min, max = TIME_LIMIT_S.max))]
    pub time_limit_s: f64,
    /// Seed of the perturbation and of the sensors' noise.
    #[serde(default, deserialize_with = "crate::integers::seed_64")]
    #[garde(skip)]
    pub seed: u64,
    /// The ground.
    #[garde(dive)]
    pub terrain: Terrain,
    /// Blocks on the ground. They are no obstacle of the terrain: it alone decides the verdict `climbed`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[garde(adapt(ranges), length(max = 1000), dive)]
    pub block: Vec<Block>,
    /// Parts of the ground with another friction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[garde(adapt(ranges), length(max = 1000), dive)]
    pub friction_patch: Vec<FrictionPatch>,
    /// Start pose of the vehicle.
    #[serde(default)]
    #[garde(dive)]
    pub start: Start,
    /// The command of the vehicle.
    #[garde(dive)]
    pub command: Command,
    /// The controller; at 1 kHz, with the best policy that vehicle and sensors allow, if left out.
    #[serde(default)]
    #[garde(dive)]
    pub control: Control,
    /// The complete firmware step around the loops: shaping, time-out, faults, slip, odometry.
    /// Without it only the loops run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub drive: Option<Drive>,
    /// A loop that holds the heading by a gyro; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub heading_hold: Option<HeadingHold>,
    /// Imperfections of the encoders and the gyro.
    #[serde(default)]
    #[garde(dive)]
    pub sensors: Sensors,
    /// The pose that the run's odometry gives; by the wheels, in the plane, by default.
    #[serde(default)]
    #[garde(dive)]
    pub odometry: Odometry,
    /// Imperfections of the actuators.
    #[serde(default)]
    #[garde(dive)]
    pub actuators: Actuators,
    /// Faults during the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[garde(adapt(ranges), length(max = 100), dive)]
    pub fault: Vec<Fault>,
    /// Random differences between runs of different seeds; none by default.
    #[serde(default)]
    #[garde(dive)]
    pub perturbation: Perturbation,
    /// Engine, step and contacts of the simulation; as in the built-in scenarios if left out.
    #[serde(default)]
    #[garde(dive)]
    pub physics: Physics,
    /// Message rates of the log.
    #[serde(default)]
    #[garde(dive)]
    pub log: LogRates,
    /// Source of the vehicle's gains, if not its file.
    #[serde(skip)]
    #[garde(skip)]
    derived_gains: Option<DerivedGains>,
    /// The value of `physics.wheel_model` for this scenario.
    #[serde(skip)]
    #[garde(skip)]
    wheel_model: WheelModel,
    /// The policy behind `control.policy = "auto"` for this scenario.
    #[serde(skip)]
    #[garde(skip)]
    auto_policy: Option<AutoPolicy>,
}

/// A file's keys about its vehicle.
#[cfg(feature = "schema")]
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum VehicleChoice {
    /// The name of a built-in vehicle, or the path of a vehicle file relative to this one.
    Name(String),
    /// The vehicle itself.
    Table(Box<Vehicle>),
}

/// Largest height difference of a wheel's mounting below the other wheels, as a fraction of its radius.
const LOWEST: f64 = 0.1;

fn ten_seconds() -> f64 {
    10.0
}

fn an_hour() -> f64 {
    3600.0
}

/// Uniform random differences, plus or minus the amplitude given; all zero by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Perturbation {
    /// Heading at the start \[rad\], 0 to 3.2.
    #[garde(adapt(ranges), range(min = HEADING_RAD.min, max = HEADING_RAD.max))]
    pub yaw_rad: f64,
    /// Position along x at the start \[m\], 0 to 100. It varies at which angle of their rotation
    /// the wheels meet the step.
    #[garde(adapt(ranges), range(min = OFFSET_M.min, max = OFFSET_M.max))]
    pub start_m: f64,
}

impl Scenario {
    /// The built-in scenario or the file of that name, with some keys replaced.
    ///
    /// # Errors
    /// Its first error, in one line that names file, key, value and allowed range.
    ///
    /// ```
    /// use omni_config::{Override, Scenario, Terrain};
    /// let low = Scenario::load("step", &[Override::parse("terrain.height_m=0.02")?])?;
    /// assert!(matches!(low.terrain, Terrain::Step { height_m: 0.02, .. }));
    /// let error = Scenario::load("step", &[Override::parse("terrain.friction=-1")?]).unwrap_err();
    /// assert_eq!(error.to_string(), "built-in step: terrain.friction: -1, allowed: 0 to 2");
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn load(name: &str, overrides: &[Override]) -> Result<Self, Error> {
        Self::from_source(&Source::scenario(name)?, overrides)
    }

    /// The files that [`Scenario::load`] reads for a name, its vehicle's, its height map's and its
    /// table of commands included; none for built-in scenarios. A build script makes Cargo watch them.
    ///
    /// # Errors
    /// [`Error::UnknownName`], [`Error::Missing`], [`Error::Io`] or [`Error::Syntax`].
    ///
    /// ```
    /// assert!(omni_config::Scenario::files("step")?.is_empty());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn files(name: &str) -> Result<Vec<PathBuf>, Error> {
        let source = Source::scenario(name)?;
        let mut files: Vec<_> = source.path().into_iter().collect();
        let table = source.table()?;
        if let Some(Value::String(vehicle)) = table.get("vehicle") {
            files.extend(Source::vehicle(vehicle, source.folder())?.path());
        }
        let named = |kind: &str, key: &str| table.get(kind)?.get(key)?.as_str();
        let image = named("terrain", "image").filter(|image| HeightMap::is_path(image));
        let commands = named("command", "file").filter(|file| CommandFile::is_path(file));
        let folder = source.folder().unwrap_or(Path::new(""));
        files.extend(
            [image, commands]
                .into_iter()
                .flatten()
                .map(|file| folder.join(file)),
        );
        Ok(files)
    }

    /// The engine that a built-in scenario or a file asks for, whatever else is in it; none if it names none that there
    /// is.
    ///
    /// # Errors
    /// [`Error::UnknownName`], [`Error::Missing`], [`Error::Io`] or [`Error::Syntax`].
    ///
    /// ```
    /// use omni_config::{Engine, Scenario};
    /// assert_eq!(Scenario::engine_of("step")?, Some(Engine::Rapier));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn engine_of(name: &str) -> Result<Option<Engine>, Error> {
        let table = Source::scenario(name)?.table()?;
        let said = table.get("physics").and_then(|physics| physics.get("engine"));
        Ok(match said.map(Value::as_str) {
            None => Some(Engine::default()),
            Some(name) => Engine::ALL.into_iter().find(|engine| Some(engine.name()) == name),
        })
    }

    /// The scenario that a source describes, with some keys replaced. A path in the source is
    /// relative to the source's folder; a path in an override, of a vehicle, a picture or a table
    /// of commands, is relative to the current folder.
    ///
    /// # Errors
    /// As [`Scenario::load`].
    pub fn from_source(source: &Source, overrides: &[Override]) -> Result<Self, Error> {
        let mut table = source.table()?;
        source.expect(FileKind::Scenario, &table)?;
        let (mut for_vehicle, mut own) = (Vec::new(), Vec::new());
        for each in overrides {
            match each.of_vehicle() {
                Some(inner) => for_vehicle.push(inner),
                None => own.push(each),
            }
        }
        for each in &own {
            each.apply(source, &mut table)?;
        }
        check_version(source, &table)?;
        // The file's before the caller's. What is written of a scenario has them in its vehicle.
        let settings = match table.remove("set") {
            None => Vec::new(),
            Some(Value::Table(set)) => Override::all_of(&set),
            Some(other) => return Err(source.refuse("set", format!("{other}, allowed: a table of keys"))),
        };
        for each in settings.iter().rev() {
            let allowed = "allowed: keys that begin with vehicle.; the others are keys of this file";
            let inner = each
                .of_vehicle()
                .ok_or_else(|| source.refuse(format!("set.{}", each.key()), allowed));
            for_vehicle.insert(0, inner?);
        }
        // A path in a replaced key is relative to the working directory, not to the file.
        let folder_of = |key: &str| match own.iter().any(|each| each.replaces(key)) {
            true => None,
            false => source.folder(),
        };
        let vehicle = match table.remove("vehicle") {
            Some(Value::String(name)) => {
                source.check_reference("vehicle", &name, "the vehicle")?;
                let vehicle = Source::vehicle(&name, folder_of("vehicle")).map_err(|error| match error {
                    Error::UnknownName { name, known, .. } => {
                        let meant = did_you_mean(&name, known.split(", "));
                        source.refuse("vehicle", format!("{name:?}{meant}, allowed: {known}"))
                    }
                    Error::Missing {
                        meant,
                        source: reason,
                        ..
                    } => source.refuse("vehicle", format!("{name:?}{meant}: {reason}")),
                    other => other,
                })?;
                Vehicle::from_source(&vehicle, &for_vehicle)?
            }
            Some(Value::Table(inline)) => {
                Vehicle::from_table(source, inline, &for_vehicle).map_err(|error| error.inside("vehicle"))?
            }
            Some(other) => {
                return Err(source.refuse("vehicle", format!("{other}, allowed: a name, a path or a table")));
            }
            None => {
                let example = "for example vehicle = \"chugo7\"";
                return Err(source.refuse("top level", format!("missing field `vehicle`; {example}")));
            }
        };
        // Plain data read from TOML: it can be written as TOML.
        let inline =
            Value::try_from(&vehicle).map_err(|error| source.refuse("vehicle", error.to_string()))?;
        table.insert("vehicle".into(), inline);
        HeightMap::embed(source, folder_of("terrain.image"), &mut table)?;
        CommandFile::embed(source, folder_of("command.file"), &mut table)?;
        Command::complete(&mut table);
        let whole = || Self::load("step", &[]).ok()?.to_toml().ok()?.parse().ok();
        let mut scenario: Self = read(source, table).map_err(|error| with_place(error, whole))?;
        scenario.vehicle = vehicle; // with what is in no file: assumptions
        scenario.wheel_model = scenario.wheel_model_here();
        scenario.choose_policy();
        scenario.check(source)?;
        scenario.check_couplings(source)?;
        scenario.check_rollers(source)?;
        scenario.derive_gains()?;
        scenario.choose_loops_if_refused()?;
        Ok(scenario)
    }

    /// Checks across several keys.
    fn check(&self, source: &Source) -> Result<(), Error> {
        let multiple = |key: &str, us: u64, of: &str, divisor_us: u64, hint: &str| {
            if us.is_multiple_of(divisor_us) {
                return Ok(());
            }
            let (value, divisor) = (seconds(us), seconds(divisor_us));
            Err(source.refuse(
                key,
                format!("{value}, allowed: a multiple of {of}, {divisor}{hint}"),
            ))
        };
        let period_us = self.control.period_us;
        multiple(
            "control.period_s",
            period_us,
            "physics.timestep_s",
            self.physics.timestep_us,
            "",
        )?;
        multiple(
            "sensors.delay_s",
            self.sensors.delay_us,
            "control.period_s",
            period_us,
            "; a shorter delay can be a part of actuators.torque_lag_s",
        )?;
        if let Some((key, message)) = self.encoder_velocity_refusal() {
            return Err(source.refuse(key, message));
        }
        if let Some((key, message)) = self.control.refusal() {
            return Err(source.refuse(format!("control.{key}"), message));
        }
        if let (Some(climbs_m), OdometryKind::Planar) = (self.control.climbs_m, self.odometry.kind) {
            let message =
                format!("{climbs_m}, allowed: only with odometry.kind = \"ground\", which measures edges");
            return Err(source.refuse("control.climbs_m", message));
        }
        if let Some((key, message)) = self.drive.and_then(|drive| drive.refusal()) {
            return Err(source.refuse(format!("drive.{key}"), message));
        }
        if let Some((key, message)) = self.physics.refusal() {
            return Err(source.refuse(format!("physics.{key}"), message));
        }
        for (i, wheel) in self.vehicle.wheel.iter().enumerate() {
            let stiffness = wheel.contact_stiffness_n_m(self.physics.contact_frequency_hz);
            let most = LOWEST * wheel.contact_radius_m() * stiffness;
            if wheel.preload_n.abs() > most {
                let message = format!(
                    "{}, allowed: -{most:.0} to {most:.0} with a contact of {stiffness:.0} N/m: a larger one moves the wheel by \
                     more than a tenth of its radius",
                    wheel.preload_n
                );
                return Err(source.refuse(format!("vehicle.wheel[{i}].preload_n"), message));
            }
        }
        if self.physics.engine == Engine::Rapier
            && let Some((i, stiffness)) = self
                .vehicle
                .wheel
                .iter()
                .enumerate()
                .find_map(|(i, wheel)| Some((i, wheel.contact_stiffness_n_m?)))
        {
            let message = format!("{stiffness}, allowed: only with physics.engine = \"articulated\"");
            return Err(source.refuse(format!("vehicle.wheel[{i}].contact_stiffness_n_m"), message));
        }
        if let Some((key, message)) = self.command.refusal() {
            return Err(source.refuse(key, message));
        }
        if let Err((key, message)) = self.plan_path() {
            return Err(source.refuse(key, message));
        }
        if let Some((key, message)) = self.terrain.refusal() {
            return Err(source.refuse(format!("terrain.{key}"), message));
        }
        for (i, fault) in self.fault.iter().enumerate() {
            if let Some((key, message)) = fault.refusal(&self.vehicle) {
                return Err(source.refuse(format!("fault[{i}].{key}"), message));
            }
            let needs = match fault {
                Fault::EmergencyStop(_) if self.drive.is_none() => {
                    "\"emergency_stop\", allowed: only with [drive], which has the emergency stop"
                }
                Fault::EncoderToggles(_) if self.sensors.encoder_counts == 0.0 => {
                    "\"encoder_toggles\", allowed: only with sensors.encoder_counts above 0"
                }
                _ => continue,
            };
            return Err(source.refuse(format!("fault[{i}].kind"), needs));
        }
        for (i, patch) in self.friction_patch.iter().enumerate() {
            if let Some((key, message)) = patch.refusal() {
                return Err(source.refuse(format!("friction_patch[{i}].{key}"), message));
            }
        }
        self.check_start(source)
    }

    /// Height of the highest block \[m\]; 0 without any.
    #[must_use]
    pub fn highest_block_m(&self) -> f64 {
        self.block.iter().map(|block| block.height_m).fold(0.0, f64::max)
    }

    /// Gains that the vehicle's file leaves out. What runs and what a log holds are then the derived ones.
    fn derive_gains(&mut self) -> Result<(), Error> {
        if self.vehicle.gains.is_none() {
            let derived = self.vehicle.derived_gains(self.period_s())?;
            self.vehicle.gains = Some(derived.gains);
            self.derived_gains = Some(derived);
        }
        Ok(())
    }

    /// The physics step resolves every coupling's spring.
    fn check_couplings(&self, source: &Source) -> Result<(), Error> {
        let (vehicle, timestep_us) = (self.vehicle(), self.physics.timestep_us);
        if self.physics.engine != Engine::Rapier {
            return Ok(()); // it takes springs as they are at the end of a step
        }
        for coupling in &vehicle.coupling {
            let longest_us = 1e6 * vehicle.coupling_spring(coupling).longest_step_s();
            if timestep_us as f64 > longest_us {
                let message = format!(
                    "{}, allowed: up to {} with the stiffness and damping of the coupling {:?} of {}",
                    seconds(timestep_us),
                    seconds(longest_us as u64),
                    coupling.name,
                    vehicle.name
                );
                return Err(source.refuse("physics.timestep_s", message));
            }
        }
        Ok(())
    }

    /// Gains that the vehicle's file left out and how they were found; none if the file sets them.
    ///
    /// ```
    /// assert!(omni_config::Scenario::load("step", &[])?.derived_gains().is_none()); // chugo7 has its own
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn derived_gains(&self) -> Option<&DerivedGains> {
        self.derived_gains.as_ref()
    }

    /// The vehicle, its gains resolved.
    #[must_use]
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// The same scenario with other keys, checked as a file is; messages name it `file`.
    ///
    /// # Errors
    /// The error of a key, in one line.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let step = Scenario::load("step", &[])?;
    /// let higher = step.with("step", &[Override::new("terrain.height_m", 0.06)])?;
    /// assert_eq!(higher, Scenario::load("step", &[Override::new("terrain.height_m", 0.06)])?);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn with(&self, file: &str, overrides: &[Override]) -> Result<Self, Error> {
        Self::from_source(&Source::text(file, self.to_toml()?), overrides)
    }

    /// The scenario as a file says it, its vehicle inside. Derived gains or a derived policy are left out, because they
    /// would be derived again.
    ///
    /// # Errors
    /// [`Error::Key`] for a seed above 2^63 - 1, which TOML cannot hold.
    ///
    /// ```
    /// use omni_config::{Scenario, Source};
    /// let step = Scenario::load("step", &[])?;
    /// assert_eq!(Scenario::from_source(&Source::text("step", step.to_toml()?), &[])?, step);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn to_toml(&self) -> Result<String, Error> {
        let mut plain = self.clone();
        if self.derived_gains.is_some() {
            plain.vehicle.gains = None;
        }
        if self
            .auto_policy
            .as_ref()
            .is_some_and(|auto| auto.policy == self.control.policy)
        {
            plain.control.policy = AUTO.into();
        }
        plain.to_resolved_toml()
    }

    /// The scenario with everything that was derived, its vehicle inside: it reads back as it is in any version.
    ///
    /// # Errors
    /// [`Error::Key`] for a seed above 2^63 - 1, which TOML cannot hold.
    ///
    /// ```
    /// use omni_config::{Override, Scenario, Source};
    /// let stronger = Override::new("vehicle.motor.stall_torque_n_m", 2.5);
    /// let step = Scenario::load("step", &[stronger])?;
    /// assert_eq!(Scenario::from_source(&Source::text("log", step.to_resolved_toml()?), &[])?, step);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn to_resolved_toml(&self) -> Result<String, Error> {
        toml::to_string(self).map_err(|error| Error::Key {
            file: format!("scenario {}", self.name),
            key: "seed".into(),
            message: error.to_string(),
        })
    }

    /// The same scenario under a policy, or `"auto"`, with nothing chosen instead of the policy's parts.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let keys = [("control.policy", "independent"), ("control.integral", "shared")];
    /// let own = Scenario::load("flat", &keys.map(|(key, value)| Override::new(key, value)))?;
    /// assert_eq!(own.with_policy("scale_torques")?.control.law(), "scale_torques"); // nothing else chosen
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn with_policy(&self, policy: &str) -> Result<Self, Error> {
        let mut other = self.clone();
        other.auto_policy = None;
        other.control.be_preset(policy);
        other.choose_policy();
        other.choose_loops_if_refused()?;
        other.coordination::<f64>()?;
        Ok(other)
    }
}
