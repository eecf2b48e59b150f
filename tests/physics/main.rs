//! The laws that a simulation keeps, and the figures that documents promise.

mod articulated;
mod coarse_encoders;
mod core_serde;
mod derived_gains;
mod drive_in_the_loop;
mod engines;
mod figures;
mod flat_ground;
mod gear_friction;
mod imperfections;
mod other_vehicles;
mod own_policy;
mod paths;
mod randomised_steps;
mod rims;
mod rocker_bogie;
mod roller_wheels;
mod snapshots;
mod statics;
mod step_section_4;
mod terrain;
mod touch;
mod traction;
mod verdicts;
mod wheels_section_3_3;
