//! Simulation of a scenario's wheels: with rollers or as balls, and the parts of a physics step.

use super::Scenario;
use crate::microseconds::seconds;
use crate::ranges::SUBSTEPS;
use crate::{Engine, Error, RollerWheel, Source, Terrain, WheelModel};

/// Longest step \[us\] in which rapier's wheels of rollers drive straight: with twice that they
/// hop, and the vehicle is 9 % off.
const ROLLER_STEP_US: u64 = 250;

impl Scenario {
    /// Parts of a physics step if wheels have rollers.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let parts = |scenario: &str, engine: &str| -> Result<u64, omni_config::Error> {
    ///     Ok(Scenario::load(scenario, &[Override::new("physics.engine", engine)])?.roller_parts())
    /// };
    /// assert_eq!([parts("step", "rapier")?, parts("height_map", "rapier")?, parts("step", "articulated")?], [2, 4, 1]);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn roller_parts(&self) -> u64 {
        let part_us = match self.terrain {
            // On hills rapier's rollers gain energy in longer ones.
            Terrain::HeightMap { .. } => ROLLER_STEP_US / 2,
            _ => ROLLER_STEP_US,
        };
        let derived = match self.physics.engine {
            Engine::Rapier => self.physics.timestep_us.div_ceil(part_us),
            _ => 1,
        };
        self.physics.roller_substeps.unwrap_or(derived)
    }

    /// If every wheel must have rollers, every wheel has fitting rollers.
    pub(super) fn check_rollers(&self, source: &Source) -> Result<(), Error> {
        let missing = |i: &usize| self.rollers(*i).is_none();
        let wheels = 0..self.vehicle.wheel.len();
        let everywhere = self.physics.wheel_model == WheelModel::Rollers;
        let rolling = everywhere || !wheels.clone().all(|i| missing(&i));
        if everywhere && let Some(i) = wheels.clone().find(missing) {
            let message = format!(
                "\"rollers\", allowed: \"auto\" or \"ball\" with {}, until [rollers] fit wheel[{i}]",
                self.vehicle.name
            );
            return Err(source.refuse("physics.wheel_model", message));
        }
        if self.physics.engine != Engine::Rapier {
            return Ok(());
        }
        let (timestep_us, parts) = (self.physics.timestep_us, self.roller_parts());
        let (least, most) = (timestep_us.div_ceil(ROLLER_STEP_US), SUBSTEPS.max as u64);
        if rolling && least > most {
            let message = format!(
                "{}, allowed: up to {} where wheels have rollers",
                seconds(timestep_us),
                seconds(most * ROLLER_STEP_US)
            );
            return Err(source.refuse("physics.timestep_s", message));
        }
        if rolling && parts < least {
            let message = format!(
                "{parts}, allowed: {least} to {most} at physics.timestep_s = {}: rollers vibrate in parts of more than {} s",
                seconds(timestep_us),
                seconds(ROLLER_STEP_US)
            );
            return Err(source.refuse("physics.roller_substeps", message));
        }
        Ok(())
    }

    /// The rollers of the wheel with that index, from 0, according to `physics.wheel_model`; none for a ball.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let of = |vehicle: &str| Scenario::load("step", &[Override::new("vehicle", vehicle)]);
    /// assert!(of("chugo7")?.rollers(0).is_none()); // straight ahead an omni wheel is a ball
    /// assert!(of("mecanum4")?.rollers(0).is_some()); // at an edge a mecanum wheel is not
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn rollers(&self, wheel: usize) -> Option<RollerWheel> {
        self.vehicle.rollers(wheel, self.wheel_model)
    }

    /// The effect of `physics.wheel_model` on this ground: [`WheelModel::Auto`] becomes rollers if some ball does not
    /// represent its wheel and every wheel has rollers that fit, and stays if balls are valid.
    #[must_use]
    pub fn wheel_model(&self) -> WheelModel {
        self.wheel_model
    }

    pub(super) fn wheel_model_here(&self) -> WheelModel {
        let mut wheels = 0..self.vehicle.wheel.len();
        let model = self.physics.wheel_model;
        let fit = |i| self.vehicle.rollers(i, WheelModel::Rollers).is_some();
        match model {
            WheelModel::Auto if self.beyond_balls_with(model).is_some() && wheels.all(fit) => {
                WheelModel::Rollers
            }
            _ => model,
        }
    }
}
