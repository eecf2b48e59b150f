//! Tests of what the documentation of constructors and getters states without an example.

use crate::drive::{Drive, DriveConfig, DriveMode, Fault, TractionDrive};
use crate::estimate::{EncoderCounter, EstimatorConfig};
use crate::geometry::{BodyTwist, PathFactors};
use crate::loops::{AntiWindup, Controller, ControllerPolicy, PidConfig, PidGains, Rest, WheelSample};
use crate::motor::{GearFriction, Gearbox, TorqueTable};
use crate::path::{PathLimits, PathPiece, PathSegment, PlanarInertia, Trajectory, TrajectoryPlanner};
use crate::policy::{Policy, Readings};
use crate::shaping::{HeadingHold, HeadingHoldConfig};
use crate::traction::{Supervisor, SupervisorConfig, SupervisorMode, TractionConfig, TractionLoops};
use crate::{ConfigError, examples};
use std::string::ToString;

/// The parameter, the wheel or point, and the value that a constructor rejected.
fn refused<T>(built: Result<T, ConfigError>) -> (&'static str, Option<usize>, f64) {
    let error = built.err().expect("refused");
    (error.parameter, error.index, error.value)
}

#[test]
fn constructors_name_what_they_refuse() {
    assert_eq!(
        refused(PathFactors::new([1.0, 0.0, 1.0])),
        ("path_factor", Some(1), 0.0)
    );
    let mut config = SupervisorConfig::traction(1e-3);
    config.retry.run_up_m_s = 0.0;
    assert_eq!(
        refused(Supervisor::new(&[[0.0; 2]; 4], config)),
        ("run_up_m_s", None, 0.0)
    );

    let drive = (
        examples::drive().expect("valid"),
        examples::supervisor().expect("valid"),
    );
    let slower = examples::traction_with(TractionConfig::traction(0.3, 2.0, 2e-3)).expect("valid");
    assert_eq!(
        refused(TractionDrive::new(drive.0, drive.1, slower)),
        ("period_s", None, 2e-3)
    );

    let limits = examples::path_limits().expect("valid");
    let body = PlanarInertia {
        mass_kg: -7.0,
        ..limits.body
    };
    let kinematics = *drive.0.kinematics();
    let planned = TrajectoryPlanner::new(&kinematics, PathLimits { body, ..limits });
    assert_eq!(refused(planned), ("mass_kg", None, -7.0));
}

#[test]
fn a_refused_table_and_a_refused_gain_say_what_is_allowed() {
    let said = TorqueTable::new([(0.0, 2.0), (20.0, 0.0), (10.0, 1.0)], 2.5).expect_err("not in order");
    let expected = "point 3: speed_rad_s = 10, allowed: above the speed of the point before";
    assert_eq!((said.to_string().as_str(), said.index), (expected, Some(2)));
    let config = HeadingHoldConfig {
        gain_per_s: -1.0,
        limit_rad_s: 0.5,
        period_s: 1e-3,
    };
    let said = HeadingHold::new(config).expect_err("refused").to_string();
    assert_eq!(said, "gain_per_s = -1, allowed: 0 to 1000");
}

#[test]
fn modes_and_faults_keep_the_numbers_that_logs_hold() {
    assert_eq!(
        [Fault::NotANumber, Fault::Stuck, Fault::Lost].map(Fault::number),
        [1, 3, 5]
    );
    assert_eq!((DriveMode::Normal.number(), DriveMode::SafeStop.number()), (0, 2));
    assert_eq!(
        (TractionLoops::Plain.number(), TractionLoops::Traction.number()),
        (0, 1)
    );
    assert_eq!(SupervisorMode::Drive.number(), 0);
}

#[test]
fn configurations_begin_with_the_values_that_they_state() {
    let pid = PidConfig::new(PidGains::pi(2.0, 4.0), 1e-3);
    assert_eq!(
        (
            pid.proportional_weight,
            pid.derivative_weight,
            pid.derivative_filter_s
        ),
        (1.0, 1.0, 0.0)
    );
    assert_eq!(
        (pid.output.upper_n_m, pid.anti_windup),
        (f64::INFINITY, AntiWindup::None)
    );
    let estimator = EstimatorConfig::<f32>::new(1e-3);
    assert_eq!((estimator.wheel_rad_s, estimator.slip_s), (0.1, 0.2));
    let limits = examples::path_limits().expect("valid");
    assert_eq!((limits.fastest.vx_m_s, limits.share), (f64::INFINITY, 0.9));
    assert_eq!(SupervisorConfig::traction_runup(1e-3_f64).retry.slow_retries, 1);
    assert_eq!(WheelSample::<f32, 3>::zero().common_factor, 1.0);
}

#[test]
fn getters_hand_out_what_they_name() {
    let gear = Gearbox::new(20.0, 0.8).expect("valid");
    assert_eq!(
        GearFriction::new(gear, 0.04, 0.002)
            .expect("valid")
            .viscous_n_m_s_rad(),
        0.002
    );
    let degree = EncoderCounter::<f64>::new(360.0, 16).expect("valid").count_rad();
    assert!((degree - 1.0_f64.to_radians()).abs() < 1e-15); // rounding
    let (segments, pieces) = ([PathSegment::<f64>::EMPTY; 2], [PathPiece::EMPTY; 3]);
    let path = Trajectory::new(&segments, &pieces);
    assert_eq!((path.segments().len(), path.pieces().len()), (2, 3));
    let mut config = DriveConfig::new(
        examples::layout().expect("valid"),
        examples::loops(0.3, 0.0, 2.0).expect("valid"),
    );
    assert!(!Drive::new(config).expect("valid").shorts_at_rest());
    config.rest.short_windings = true;
    assert!(Drive::new(config).expect("valid").shorts_at_rest());
}

#[test]
fn a_restored_controller_policy_goes_on_as_the_one_it_was_taken_from() {
    let layout = examples::layout().expect("valid");
    let limiter = examples::limiter(f64::INFINITY).expect("valid");
    let controller = Controller::new(&layout, examples::loops(0.25, 2.0, 2.0).expect("valid"))
        .and_then(|controller| controller.with_rest(Rest::default()))
        .expect("valid");
    let mut policy = ControllerPolicy::new(limiter, controller);
    policy.step(&Readings::new(BodyTwist::ZERO, &[1.0; 4]), &mut [0.0; 4]);
    assert_eq!(policy.sample().wheels.p_n_m, [-0.25; 4]);
    // ki dt is 0.002; at rest integrals fall by a five-hundredth.
    assert!((policy.state().1.integral_n_m[0] + 0.002).abs() < 1e-5);
    let mut other = ControllerPolicy::new(limiter, *policy.controller());
    other.restore(*policy.state());
    assert_eq!(other.state(), policy.state());
}
