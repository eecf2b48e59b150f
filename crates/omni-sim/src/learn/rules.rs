//! A task's own part in an episode, and what differs between episodes.

use crate::config::Scenario;
use crate::{Error, Simulation};

/// A quantity that differs between episodes, drawn uniformly from a range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// Its name with its unit, such as `height_m`.
    pub name: &'static str,
    /// Lowest and highest value drawn.
    pub range: [f64; 2],
    /// Lowest and highest value that may be asked for, and the same in words.
    pub(super) within: ([f64; 2], &'static str),
}

impl Draw {
    pub(super) fn check(&self, value: f64) -> Result<(), Error> {
        let ([low, high], allowed) = self.within;
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(Error::Argument {
            name: self.name,
            value: value.to_string(),
            allowed,
        })
    }
}

/// A task's own part in an episode.
pub(super) trait Rules: Send + Sync {
    /// The quantities that differ between episodes.
    fn draws(&self) -> Vec<Draw>;
    /// Size of an action.
    fn actions(&self) -> usize;
    /// A new episode with what was drawn, in the order of [`Rules::draws`].
    fn begin(&mut self, drawn: &[f64], scenario: &mut Scenario);
    /// One control period under an action, each of its numbers within -1 to 1.
    fn control(&mut self, simulation: &mut Simulation, action: &[f64]) -> Result<(), Error>;
    /// What the time since the last call is worth, and whether the task is over. `failed` where the physics ended it.
    fn judge(&mut self, simulation: &Simulation, action: &[f64], failed: bool) -> (f64, bool);
    /// Readings of the sensors, before scaling: pairs of value and scale.
    fn observe(&self, simulation: &Simulation, seen: &mut Vec<(f64, f64)>);
    /// Figures for people; the first is 1 for a success and 0 else.
    fn info(&self, simulation: &Simulation) -> Vec<f64>;
    /// Their names.
    fn info_names(&self) -> &'static [&'static str];
}
