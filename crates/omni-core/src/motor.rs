//! Torque limits and motor models.
//!
//! | module | covers |
//! |---|---|
//! | [`TorqueLimit`] | torque-speed line in four quadrants with a cap, the limit the loops use every step |
//! | [`TorqueTable`] | the same from measured points |
//! | [`DcMotor`] | the line from a data sheet: torque constant, resistance, voltage, no-load current, current limit |
//! | [`MotorDuty`] | the duty of a bridge for a torque, by [`DcMotor::duty`]; from a torque-speed line alone by [`TorqueLimit::duty`], [`TorqueLimit::duty_at`] |
//! | [`Gearbox`] | ratio and efficiency, the right way round in each quadrant |
//! | [`GearFriction`] | a gearbox with dry and viscous friction, and the torque that makes up for them |
//! | [`ThermalModel`] | I2t: time for which a motor may exceed its continuous torque |
//!
//! Loops use [`TorqueLimit`]s; the present limits of the other modules are passed as [`TorqueRanges`] to
//! [`crate::loops::WheelController::step_within`].

mod dc;
mod duty;
mod friction;
mod gearbox;
mod limit;
mod table;
mod thermal;
mod torque_range;

pub use dc::{DcMotor, DcMotorConfig};
pub use duty::MotorDuty;
pub use friction::GearFriction;
pub use gearbox::Gearbox;
pub use limit::TorqueLimit;
#[doc(hidden)]
pub use limit::TorqueLimits;
pub use table::TorqueTable;
pub use thermal::{ThermalConfig, ThermalModel, ThermalState};
pub use torque_range::{TorqueRange, TorqueRanges};
