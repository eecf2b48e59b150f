//! The laws that a simulation keeps, and the figures that documents promise.

mod articulated;
mod core_serde;
mod derived_gains;
mod drive_in_the_loop;
mod engines;
mod figures;
mod flat_ground;
mod imperfections;
mod other_vehicles;
mod own_policy;
mod randomised_steps;
mod rims;
mod rocker_bogie;
mod roller_wheels;
mod snapshots;
mod statics;
mod step_section_4;
mod terrain;
mod verdicts;
mod wheels_section_3_3;
