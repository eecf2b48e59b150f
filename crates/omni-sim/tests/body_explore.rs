#[path = "../../../tests/physics/engines.rs"]
mod engines;
#[path = "../../../tests/physics/clearance.rs"]
mod clearance;
#[path = "../../../tests/physics/limited.rs"]
mod limited;
