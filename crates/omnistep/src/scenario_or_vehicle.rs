//! The scenario of a command that also accepts the name of a vehicle.

use omni_config::{Error, FileKind, Override, Scenario};

/// A scenario by its name; for the name of a vehicle that vehicle on a built-in ground, which
/// `ground` names with what it replaces there.
pub(crate) fn scenario_or_vehicle(
    name: &str,
    overrides: Vec<Override>,
    ground: impl FnOnce() -> Result<(&'static str, Vec<Override>), Error>,
) -> Result<Scenario, Error> {
    match Scenario::load(name, &overrides) {
        Err(Error::OtherKind {
            found: FileKind::Vehicle,
            ..
        }) => {
            let (ground, mut all) = ground()?;
            all.push(Override::new("vehicle", name));
            all.extend(overrides);
            Scenario::load(ground, &all)
        }
        other => other,
    }
}
