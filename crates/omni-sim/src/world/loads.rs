//! Masses that are put on bodies on the way.

use crate::config::{Fault, Scenario};

/// A mass that is put on a body at a time.
pub(super) struct Load {
    /// The body, by its index in the vehicle file.
    pub(super) body: usize,
    from_ns: u64,
    pub(super) mass_kg: f64,
    /// Where, in the vehicle's frame as it stands on flat ground \[m\].
    pub(super) at_m: [f64; 3],
    pub(super) done: bool,
}

/// The loads of a scenario, none of them put on yet.
pub(super) fn loads(scenario: &Scenario) -> Vec<Load> {
    let bodies = &scenario.vehicle().body;
    let load = |fault: &Fault| match fault {
        Fault::LoadAdded(added) => Some(Load {
            // A loaded scenario names bodies that exist.
            body: bodies.iter().position(|known| known.name == added.body)?,
            from_ns: (added.from_s * 1e9) as u64,
            mass_kg: added.mass_kg,
            at_m: added.at_m,
            done: false,
        }),
        _ => None,
    };
    scenario.fault.iter().filter_map(load).collect()
}

impl Load {
    /// Is it to be put on now? True once.
    pub(super) fn falls_due(&mut self, time_ns: u64) -> bool {
        let due = !self.done && time_ns >= self.from_ns;
        self.done |= due;
        due
    }
}
