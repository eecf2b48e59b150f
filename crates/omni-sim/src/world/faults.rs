//! Which faults the plants make happen.

use crate::Error;
use crate::config::{Fault, Scenario};
use crate::error::unknown;

/// A kind of fault that is not made to happen here is rejected: a run without it would be another.
pub(super) fn check_faults(scenario: &Scenario) -> Result<(), Error> {
    let is_known = |fault: &Fault| {
        matches!(
            fault,
            Fault::WheelLost(_)
                | Fault::WheelDrag(_)
                | Fault::MotorWeak(_)
                | Fault::SupplySag(_)
                | Fault::EncoderStuck(_)
                | Fault::EncoderDead(_)
                | Fault::EncoderToggles(_)
                | Fault::EncoderSlips(_)
                | Fault::EncoderSilent(_)
                | Fault::CommandLost(_)
                | Fault::EmergencyStop(_)
                | Fault::LoadAdded(_)
        )
    };
    match scenario.fault.iter().position(|fault| !is_known(fault)) {
        Some(k) => Err(unknown(scenario, &format!("fault[{k}].kind"), "").into()),
        None => Ok(()),
    }
}
