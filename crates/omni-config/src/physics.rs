//! Engine, wheel model and step of a scenario, `[physics]`.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::ranges::{self, CONTACT_DAMPING_RATIO, CONTACT_FREQUENCY_HZ, GRAVITY_M_S2, ITERATIONS, SUBSTEPS};
use crate::rollers::WheelModel;

/// Physics engine that simulates the vehicle on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Engine {
    /// Reduced coordinates and one implicit contact solution a step: fast, and converged at usual steps.
    #[default]
    Articulated,
    /// Rigid bodies, joints and contacts of the rapier engine, which others wrote: some ten times slower.
    Rapier,
    /// MuJoCo, which omnistep.mujoco drives from Python: in outcomes, not in files.
    #[cfg_attr(feature = "schema", schemars(skip))]
    Mujoco,
}

impl Engine {
    /// Engines that a file may name, the default first.
    pub const ALL: [Self; 2] = [Self::Articulated, Self::Rapier];

    /// Its name in files, tables and logs.
    ///
    /// ```
    /// assert_eq!(omni_config::Engine::Articulated.name(), "articulated");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rapier => "rapier",
            Self::Articulated => "articulated",
            Self::Mujoco => "mujoco",
        }
    }
}

/// An engine that a file may name.
fn of_file<'de, D: Deserializer<'de>>(from: D) -> Result<Engine, D::Error> {
    #[derive(Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Named {
        Articulated,
        Rapier,
    }
    Ok(match Named::deserialize(from)? {
        Named::Rapier => Engine::Rapier,
        Named::Articulated => Engine::Articulated,
    })
}

/// Engine, step and contacts of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Physics {
    /// Physics engine; `articulated` by default.
    #[serde(deserialize_with = "of_file")]
    #[garde(skip)]
    pub engine: Engine,
    /// Physics step \[us\], 1 to 100 000; 500 by default. A file has it in seconds.
    #[serde(
        rename = "timestep_s",
        deserialize_with = "crate::microseconds::period",
        serialize_with = "crate::microseconds::write"
    )]
    #[garde(skip)]
    #[cfg_attr(feature = "schema", schemars(with = "f64", description = "Physics step [s]: whole microseconds, 1e-6 to 0.1; 0.0005 if left out.", range(min = crate::ranges::PERIOD_S.min, max = crate::ranges::PERIOD_S.max)))]
    pub timestep_us: u64,
    /// Solver iterations per step of the engine, 1 to 100. Left out: 8, or with a step above 0.5 ms
    /// one per started 62.5 us; with fewer, vehicles climb more slowly. Only with
    /// `engine = "rapier"`: the other iterates until the contacts converge.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::iterations"
    )]
    #[garde(adapt(ranges), range(min = ITERATIONS.min, max = ITERATIONS.max))]
    pub solver_iterations: Option<usize>,
    /// Natural frequency of contacts \[Hz\], 1 to 100000; 200 if left out.
    #[garde(adapt(ranges), range(min = CONTACT_FREQUENCY_HZ.min, max = CONTACT_FREQUENCY_HZ.max))]
    pub contact_frequency_hz: f64,
    /// Damping ratio of contacts, 0.001 to 1000; 5 if left out.
    #[garde(adapt(ranges), range(min = CONTACT_DAMPING_RATIO.min, max = CONTACT_DAMPING_RATIO.max))]
    pub contact_damping_ratio: f64,
    /// Gravity \[m/s^2\], downwards, 0 to 100; 9.81 if left out.
    #[garde(adapt(ranges), range(min = GRAVITY_M_S2.min, max = GRAVITY_M_S2.max))]
    pub gravity_m_s2: f64,
    /// Wheel model: `auto` uses rollers, each a separate body, if balls do not represent the wheels on this ground, and
    /// otherwise each wheel's own `contact`, usually a ball, which is faster; `ball` and `rollers` by name.
    #[garde(skip)]
    pub wheel_model: WheelModel,
    /// Parts into which each physics step is divided for wheels of rollers, 1 to 16. By default 1 with
    /// `engine = "articulated"`; with `engine = "rapier"`, as many as keep a part at 250 us or less, on height maps
    /// twice as many.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::substeps"
    )]
    #[garde(adapt(ranges), range(min = SUBSTEPS.min, max = SUBSTEPS.max))]
    pub roller_substeps: Option<u64>,
}

impl Default for Physics {
    /// Values of every built-in scenario: docs/physics.md states the reasons.
    fn default() -> Self {
        Self {
            engine: Engine::default(),
            timestep_us: 500,
            solver_iterations: None,
            contact_frequency_hz: 200.0,
            contact_damping_ratio: 5.0,
            gravity_m_s2: 9.81,
            wheel_model: WheelModel::default(),
            roller_substeps: None,
        }
    }
}

impl Physics {
    /// A key that the engine cannot honour, and what it allows.
    pub(crate) fn refusal(&self) -> Option<(&'static str, String)> {
        let iterations = self.solver_iterations.filter(|_| self.engine != Engine::Rapier)?;
        let message = format!(
            "{iterations}, allowed: only with physics.engine = \"rapier\"; \"{}\" iterates until the contacts converge",
            self.engine.name()
        );
        Some(("solver_iterations", message))
    }

    /// Solver iterations in each of the `parts` of a physics step.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let of = |timestep_s: f64| -> Result<usize, omni_config::Error> {
    ///     let keys = [Override::new("physics.timestep_s", timestep_s), Override::new("control.period_s", 0.001)];
    ///     Ok(Scenario::load("step", &keys)?.physics.iterations(1))
    /// };
    /// assert_eq!([of(0.001)?, of(0.0005)?, of(0.00025)?], [16, 8, 8]);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn iterations(&self, parts: u64) -> usize {
        let derived = || {
            let part_us = self.timestep_us.div_ceil(parts.max(1));
            usize::try_from(2 * part_us).unwrap_or(usize::MAX).div_ceil(125)
        };
        self.solver_iterations
            .unwrap_or_else(|| derived().clamp(8, ITERATIONS.max as usize))
    }
}
