//! Python bindings of omnistep: the module `omnistep._omnistep` and nothing else.
#![deny(unsafe_code)] // but for the zero-copy borrows, in trace.rs and arrow.rs

mod arrays;
mod arrow;
mod chart;
mod cli;
mod climb_limits;
mod controller;
mod elements;
mod encoder;
mod error;
mod estimate;
mod estimator;
mod external_physics;
mod follower;
mod in_turn;
mod interruptible;
mod kinematics;
mod layout;
mod learn;
mod log;
mod maps;
mod metrics;
mod motion;
mod motor;
mod motor_bench;
mod nested;
mod odometry;
mod outcome;
mod pid;
mod plan;
mod policy;
mod policy_observation;
mod routes;
mod run;
mod sample;
mod scenario;
mod shaping;
mod simulation;
mod study;
mod torques;
mod trace;
mod track;
mod trajectory;
mod values;
mod vehicle;
mod waypoint;
mod wheel_count;
mod wheel_rows;

/// Control and simulation of omni-directional vehicles that climb steps.
#[pyo3::pymodule]
mod _omnistep {
    #[pymodule_export]
    use crate::chart::ChartRuns;
    #[pymodule_export]
    use crate::cli::cli;
    #[pymodule_export]
    use crate::climb_limits::{ClimbLimits, climb_limits};
    #[pymodule_export]
    use crate::controller::{ControlSample, Controller};
    #[pymodule_export]
    use crate::encoder::{EncoderCounter, VelocityEstimator};
    #[pymodule_export]
    use crate::error::{did_you_mean_file, shortened};
    #[pymodule_export]
    use crate::estimator::Estimator;
    #[pymodule_export]
    use crate::external_physics::run_external;
    #[pymodule_export]
    use crate::follower::{Follow, HolonomicFollower};
    #[pymodule_export]
    use crate::kinematics::{Desaturated, Kinematics};
    #[pymodule_export]
    use crate::layout::{Layout, Wheel};
    #[pymodule_export]
    use crate::learn::Episodes;
    #[pymodule_export]
    use crate::log::{Log, read_mcap, recover, write_recording};
    #[pymodule_export]
    use crate::metrics::{disturbed_ratio, shape_error, slip_ratio, speed_ratio_std};
    #[pymodule_export]
    use crate::motion::{at_point, discretize, from_point, moved_by, to_body, to_world};
    #[pymodule_export]
    use crate::motor::{DcMotor, MotorDuty, torque_duty};
    #[pymodule_export]
    use crate::motor_bench::{MotorBenchTrace, run_motor_bench};
    #[pymodule_export]
    use crate::odometry::Odometry;
    #[pymodule_export]
    use crate::outcome::{Outcome, metrics};
    #[pymodule_export]
    use crate::pid::{Pid, PidSample};
    #[pymodule_export]
    use crate::policy::policy_name;
    #[pymodule_export]
    use crate::policy_observation::Observation;
    #[pymodule_export]
    use crate::routes::{drive_route, plan_route};
    #[pymodule_export]
    use crate::run::run;
    #[pymodule_export]
    use crate::sample::Sample;
    #[pymodule_export]
    use crate::scenario::{Scenario, list_policies, list_scenarios, list_vehicles};
    #[pymodule_export]
    use crate::shaping::{CommandShaper, ShapedCommands};
    #[pymodule_export]
    use crate::simulation::Simulation;
    #[pymodule_export]
    use crate::study::{Plan, Rows, Store, compute_batch, damage, mean_interval, wilson};
    #[pymodule_export]
    use crate::torques::{reference_factor, torque_factor, torque_range};
    #[pymodule_export]
    use crate::trace::Trace;
    #[pymodule_export]
    use crate::trajectory::{Trajectory, TrajectoryPlanner, TrajectorySample};
    #[pymodule_export]
    use crate::vehicle::Vehicle;
    #[pymodule_export]
    use crate::waypoint::Waypoint;

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
