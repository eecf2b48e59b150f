//! A scenario: a vehicle, the ground, a command, a controller, how finely to simulate.

use std::path::PathBuf;

use garde::Validate;
use omni_core::{BodyTwist, Coordination};
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::Error;
use crate::check::{between, finite, is_name, is_schema_version, not_negative, positive};
use crate::load::{Override, Source, read};
use crate::rollers::{RollerWheel, WheelModel};
use crate::tagged::deserialize_by_kind;
use crate::vehicle::Vehicle;

/// A scenario file, with its vehicle read in. Written as TOML it is whole: the vehicle is a table inside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of the file format, [`crate::SCHEMA_VERSION`].
    #[garde(custom(is_schema_version))]
    pub schema_version: u32,
    /// Name in logs and file names.
    #[garde(custom(is_name))]
    pub name: String,
    /// The vehicle. A file gives the name of a built-in one, a path relative to itself, or the vehicle's own table.
    #[garde(skip)] // checked with its own source, before it is put here
    vehicle: Vehicle,
    /// Simulated time \[s\], 0.01 to 3600.
    #[garde(custom(between(0.01, 3600.0)))]
    pub duration_s: f64,
    /// Seed of the perturbation.
    #[serde(default)]
    #[garde(skip)]
    pub seed: u64,
    /// The ground.
    #[garde(dive)]
    pub terrain: Terrain,
    /// What the vehicle is told to do.
    #[garde(dive)]
    pub command: Command,
    /// The controller.
    #[garde(dive)]
    pub control: Control,
    /// Random differences between runs of different seeds; none by default.
    #[serde(default)]
    #[garde(dive)]
    pub perturbation: Perturbation,
    /// How finely to simulate.
    #[garde(dive)]
    pub physics: Physics,
}

/// The ground under the vehicle, which starts at x = 0 facing +x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Validate)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Terrain {
    /// A plane.
    Flat {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(between(0.0, 2.0)))]
        friction: f64,
    },
    /// A plane and, from `at_m` on, a higher one.
    Step {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(between(0.0, 2.0)))]
        friction: f64,
        /// Height of the step \[m\], > 0.
        #[garde(custom(positive))]
        height_m: f64,
        /// World x of the riser \[m\], > 0.
        #[garde(custom(positive))]
        at_m: f64,
    },
}

#[derive(Deserialize)]
#[serde(remote = "Terrain", rename_all = "snake_case", deny_unknown_fields)]
enum TerrainByKind {
    Flat { friction: f64 },
    Step { friction: f64, height_m: f64, at_m: f64 },
}
deserialize_by_kind!(Terrain, TerrainByKind);

/// A constant body twist, reached on a ramp.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Command {
    /// Forward \[m/s\].
    #[garde(custom(finite))]
    pub vx_m_s: f64,
    /// Left \[m/s\].
    #[garde(custom(finite))]
    pub vy_m_s: f64,
    /// Counter-clockwise \[rad/s\].
    #[garde(custom(finite))]
    pub wz_rad_s: f64,
    /// Time from rest to the whole twist \[s\], >= 0.
    #[garde(custom(not_negative))]
    pub ramp_s: f64,
}

impl Command {
    /// The twist commanded at a time \[s\]: at rest up to 0, the whole of it from `ramp_s` on.
    #[must_use]
    pub fn at(&self, time_s: f64) -> BodyTwist<f64> {
        let part = if self.ramp_s > 0.0 {
            (time_s / self.ramp_s).clamp(0.0, 1.0)
        } else {
            1.0
        };
        BodyTwist {
            vx_m_s: part * self.vx_m_s,
            vy_m_s: part * self.vy_m_s,
            wz_rad_s: part * self.wz_rad_s,
        }
    }
}

/// The scalar that the controller computes in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// `f32`, as in firmware.
    F32,
    /// `f64`.
    #[default]
    F64,
}

/// The controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// Name of a coordination preset.
    #[garde(custom(known_policy))]
    pub policy: String,
    /// Control period \[us\], a multiple of the physics step, 1 to 100000.
    #[garde(custom(microseconds))]
    pub period_us: u64,
    /// Scalar of the controller.
    #[serde(default)]
    #[garde(skip)]
    pub precision: Precision,
}

/// Uniform random differences, plus or minus the amplitude given; all zero by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields, default)]
pub struct Perturbation {
    /// Heading at the start \[rad\], >= 0.
    #[garde(custom(not_negative))]
    pub yaw_rad: f64,
    /// Place along x at the start \[m\], >= 0: the phase at which wheels meet the step.
    #[garde(custom(not_negative))]
    pub start_m: f64,
}

/// How finely to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Physics {
    /// Physics step \[us\], 1 to 100000.
    #[garde(custom(microseconds))]
    pub step_us: u64,
    /// Solver iterations a step, 1 to 100; fewer than 8 change outcomes near the torque threshold.
    #[garde(custom(iterations))]
    pub solver_iterations: usize,
    /// Natural frequency of contacts \[Hz\], > 0.
    #[garde(custom(positive))]
    pub contact_hz: f64,
    /// Damping ratio of contacts, > 0.
    #[garde(custom(positive))]
    pub contact_damping: f64,
    /// Gravity \[m/s^2\], downwards, >= 0.
    #[garde(custom(not_negative))]
    pub gravity_m_s2: f64,
    /// How wheels are simulated.
    #[serde(default)]
    #[garde(skip)]
    pub wheel_model: WheelModel,
    /// Parts that a physics step is taken in where wheels have rollers, 1 to 16; 2 if left out.
    #[serde(default = "two")]
    #[garde(custom(substeps))]
    pub roller_substeps: u64,
}

fn two() -> u64 {
    2
}

fn substeps(value: &u64, _: &()) -> garde::Result {
    if (1..=16).contains(value) {
        Ok(())
    } else {
        Err(garde::Error::new(format!("{value}, allowed: 1 to 16")))
    }
}

fn microseconds(value: &u64, _: &()) -> garde::Result {
    if (1..=100_000).contains(value) {
        Ok(())
    } else {
        Err(garde::Error::new(format!("{value}, allowed: 1 to 100000")))
    }
}

fn iterations(value: &usize, _: &()) -> garde::Result {
    if (1..=100).contains(value) {
        Ok(())
    } else {
        Err(garde::Error::new(format!("{value}, allowed: 1 to 100")))
    }
}

fn known_policy(value: &str, _: &()) -> garde::Result {
    match Coordination::<f64>::preset(value) {
        Some(_) => Ok(()),
        None => Err(garde::Error::new(format!(
            "{value:?}, allowed: {}",
            Coordination::<f64>::PRESETS.join(", ")
        ))),
    }
}

impl Scenario {
    /// The built-in scenario or the file of that name, with some keys replaced.
    ///
    /// # Errors
    /// What is wrong with it, in one line that names file, key, value and allowed range.
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

    /// The files that [`Scenario::load`] reads for a name, its vehicle's included; none for what is built in. A build script
    /// tells Cargo to watch them.
    ///
    /// # Errors
    /// [`Error::UnknownName`], [`Error::Io`] or [`Error::Syntax`].
    ///
    /// ```
    /// assert!(omni_config::Scenario::files("step")?.is_empty());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn files(name: &str) -> Result<Vec<PathBuf>, Error> {
        let source = Source::scenario(name)?;
        let mut files: Vec<_> = source.path().into_iter().collect();
        if let Some(Value::String(vehicle)) = source.table()?.get("vehicle") {
            files.extend(Source::vehicle(vehicle, source.folder())?.path());
        }
        Ok(files)
    }

    /// The scenario that a source describes, with some keys replaced.
    ///
    /// # Errors
    /// As [`Scenario::load`].
    pub fn from_source(source: &Source, overrides: &[Override]) -> Result<Self, Error> {
        let mut table = source.table()?;
        let (mut for_vehicle, mut own) = (Vec::new(), Vec::new());
        for each in overrides {
            match each.of_vehicle() {
                Some(inner) => for_vehicle.push(inner),
                None => own.push(each),
            }
        }
        for each in own {
            each.apply(source, &mut table)?;
        }
        let vehicle = match table.remove("vehicle") {
            Some(Value::String(name)) => {
                let vehicle = Source::vehicle(&name, source.folder()).map_err(|error| match error {
                    Error::UnknownName { name, known, .. } => {
                        source.refuse("vehicle", format!("{name:?}, allowed: {known}"))
                    }
                    other => other,
                })?;
                Vehicle::from_source(&vehicle, &for_vehicle)?
            }
            Some(Value::Table(inline)) => Vehicle::from_table(source, inline, &for_vehicle)?,
            Some(other) => {
                return Err(source.refuse("vehicle", format!("{other}, allowed: a name, a path or a table")));
            }
            None => return Err(source.refuse("top level", "missing field `vehicle`")),
        };
        // Plain data read from TOML: it can be written as TOML.
        let inline =
            Value::try_from(&vehicle).map_err(|error| source.refuse("vehicle", error.to_string()))?;
        table.insert("vehicle".into(), inline);
        let scenario: Self = read(source, table)?;
        let Physics { step_us, .. } = scenario.physics;
        if !scenario.control.period_us.is_multiple_of(step_us) {
            let message = format!(
                "{}, allowed: a multiple of physics.step_us, {step_us}",
                scenario.control.period_us
            );
            return Err(source.refuse("control.period_us", message));
        }
        scenario.check_start(source)?;
        scenario.check_rollers(source)?;
        Ok(scenario)
    }

    /// A riser starts ahead of every wheel, wherever the perturbation puts the vehicle.
    fn check_start(&self, source: &Source) -> Result<(), Error> {
        if let Terrain::Step { at_m, .. } = self.terrain {
            let front = |w: &crate::WheelSpec| {
                w.position_m[0].hypot(w.position_m[1]).max(w.position_m[0]) + w.radius_m
            };
            let ahead = if self.perturbation.yaw_rad > 0.0 {
                self.vehicle.wheel.iter().map(front).fold(0.0, f64::max)
            } else {
                self.vehicle
                    .wheel
                    .iter()
                    .map(|w| w.position_m[0] + w.radius_m)
                    .fold(0.0, f64::max)
            };
            let least = ahead + self.perturbation.start_m;
            if at_m <= least {
                let message = format!(
                    "{at_m}, allowed: more than {least:.3}, where the foremost wheel may stand at the start"
                );
                return Err(source.refuse("terrain.at_m", message));
            }
        }
        Ok(())
    }

    /// Where every wheel shall have rollers, every wheel has some.
    fn check_rollers(&self, source: &Source) -> Result<(), Error> {
        if self.physics.wheel_model == WheelModel::Rollers
            && let Some(i) = (0..self.vehicle.wheel.len()).find(|i| self.rollers(*i).is_none())
        {
            let message = format!(
                "\"rollers\", allowed: \"contact\" or \"ball\" with {}, whose file has neither [rollers] nor rollers of wheel[{i}]",
                self.vehicle.name
            );
            return Err(source.refuse("physics.wheel_model", message));
        }
        Ok(())
    }

    /// The rollers of the wheel with that index, from 0, as `physics.wheel_model` has it; none for a ball.
    ///
    /// ```
    /// let scenario = omni_config::Scenario::load("flat", &[])?;
    /// assert!(scenario.rollers(0).is_none()); // balls, unless asked for rollers
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn rollers(&self, wheel: usize) -> Option<RollerWheel> {
        self.vehicle.rollers(wheel, self.physics.wheel_model)
    }

    /// The vehicle.
    #[must_use]
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// The same scenario under another coordination preset.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn with_policy(&self, policy: &str) -> Result<Self, Error> {
        let mut other = self.clone();
        other.control.policy = policy.into();
        other.coordination::<f64>()?;
        Ok(other)
    }
}
