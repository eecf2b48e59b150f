//! Numeric facts of public test suites (`tests/vectors/outside_vectors.json`), asserted case by case.
//!
//! Inputs and expectations are read from the file. Where a suite has another convention, an adapter of signs, scales or
//! order stands between, and the numbers are asserted all the same.

mod kinematics;
mod limits;
mod mixers;
mod odometry;
mod paper;
mod path;
mod pid;

use serde_json::Value;

const FILE: &str = include_str!("../../../../tests/vectors/outside_vectors.json");

/// One case of a suite.
pub(crate) struct Case {
    input: Value,
    expected: Value,
    /// How far a number may be off: as the suite says, else rounding.
    tolerance: f64,
}

impl Case {
    /// A number of the input.
    fn number(&self, key: &str) -> f64 {
        as_number(&self.input[key])
    }

    /// Numbers of the input.
    fn numbers(&self, key: &str) -> Vec<f64> {
        as_numbers(&self.input[key])
    }

    /// `N` numbers of the input.
    fn array<const N: usize>(&self, key: &str) -> [f64; N] {
        self.numbers(key)
            .try_into()
            .expect("as many numbers as there are wheels or axes")
    }

    /// Asserts numbers against the expectation of that name.
    #[track_caller]
    fn expects(&self, key: &str, got: &[f64]) {
        let expected = match &self.expected[key] {
            Value::Array(_) => as_numbers(&self.expected[key]),
            value => vec![as_number(value)],
        };
        assert_eq!(got.len(), expected.len(), "{key}");
        for (got, expected) in got.iter().zip(&expected) {
            // Where the suite names no tolerance: rounding, relative to the number.
            let allowed = if self.tolerance > 0.0 {
                self.tolerance
            } else {
                1e-12 * expected.abs().max(1.0)
            };
            assert!(
                (got - expected).abs() <= allowed,
                "{key}: {got}, expected {expected} +- {allowed}"
            );
        }
    }
}

pub(crate) fn as_number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number: {value}"))
}

pub(crate) fn as_numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap_or_else(|| panic!("numbers: {value}"))
        .iter()
        .map(as_number)
        .collect()
}

type Check = fn(&Case);

/// What asserts each case.
const CHECKS: &[(&str, &str, Check)] = &[
    ("ros2_omni_ik", "omni4_offset0", kinematics::ros2_omni::<4>),
    ("ros2_omni_ik", "omni3_offset_pi3", kinematics::ros2_omni::<3>),
    ("ros2_omni_ik", "omni5_offset0", kinematics::ros2_omni::<5>),
    ("ros2_omni_ik", "nan_reference", limits::nan_reference),
    ("ros2_omni_odometry", "linear_x", odometry::ros2_wheels),
    ("ros2_omni_odometry", "pure_rotation", odometry::ros2_wheels),
    ("ros2_omni_odometry", "open_loop_arc", odometry::ros2_arc),
    ("ros2_omni_odometry", "small_dt_rejected", odometry::small_period),
    ("ros2_mecanum", "combined", kinematics::ros2_mecanum),
    ("ros2_mecanum", "forward_3", kinematics::ros2_mecanum),
    ("ros2_mecanum", "limiter_decel_fwd", limits::time_to_stop),
    ("ros2_mecanum", "limiter_decel_rev", limits::time_to_stop),
    ("ros2_mecanum", "timeout_zero_means_once", limits::timeout_zero),
    ("ct_rate_limiter", "value_hi", limits::rate_limiter),
    ("ct_rate_limiter", "all_hi", limits::rate_limiter),
    ("ct_rate_limiter", "jerk_hi", limits::rate_limiter),
    ("ct_rate_limiter", "asym_pos_up", limits::rate_limiter),
    ("ct_rate_limiter", "asym_neg_up", limits::rate_limiter),
    ("ct_rate_limiter", "jerk_only_hi", limits::rate_limiter),
    ("ct_rate_limiter", "invalid_value_limits", limits::invalid_limits),
    ("ct_pid", "p_only", pid::control_toolbox),
    ("ct_pid", "d_only", pid::control_toolbox),
    ("ct_pid", "clamp", pid::control_toolbox),
    ("ct_pid", "conditional_integration", pid::control_toolbox),
    ("ct_pid", "dt_zero_holds", pid::period_zero),
    ("ct_pid", "reset_keep_i", pid::reset_keeping_integral),
    ("wpilib_mecanum", "ik_straight", kinematics::wpilib_inverse),
    ("wpilib_mecanum", "ik_rotate", kinematics::wpilib_inverse),
    ("wpilib_mecanum", "ik_offcenter_rot", kinematics::wpilib_inverse),
    ("wpilib_mecanum", "fk_straight", kinematics::wpilib_forward),
    ("wpilib_mecanum", "fk_rotate", kinematics::wpilib_forward),
    ("wpilib_mecanum", "fk_offcenter_ls", kinematics::wpilib_forward),
    ("wpilib_mecanum", "desaturate", mixers::wpilib_desaturate),
    (
        "wpilib_mecanum",
        "desaturate_negative_is_largest",
        mixers::wpilib_desaturate,
    ),
    ("wpilib_odometry", "odo_straight", odometry::wpilib_straight),
    (
        "wpilib_odometry",
        "odo_reset_absorbs_position",
        odometry::wpilib_reset,
    ),
    (
        "wpilib_odometry",
        "twist_exp_quarter_circle",
        odometry::wpilib_exponential,
    ),
    (
        "wpilib_odometry",
        "discretize_closes",
        odometry::wpilib_discretize,
    ),
    (
        "wpilib_odometry",
        "to_field_relative",
        odometry::wpilib_field_relative,
    ),
    ("wpilib_odometry", "simple_motor_ff", pid::wpilib_feed_forward),
    ("wpilib_pid", "p", pid::wpilib),
    ("wpilib_pid", "d", pid::wpilib_derivative),
    ("wpilib_pid", "izone_allows", pid::wpilib),
    ("pid_rs", "p", pid::pid_rs),
    ("pid_rs", "i", pid::pid_rs),
    ("pid_rs", "output_limit", pid::pid_rs),
    ("idsp_pid", "coefficients", pid::idsp),
    ("ardupilot_omni_mixer", "omnix_fwd_plus_steer", mixers::omnix),
    ("ardupilot_omni_mixer", "omni3_forward", mixers::omni3),
    ("ardupilot_omni_mixer", "omniplus_mixed", mixers::omniplus),
    (
        "ardupilot_omni_mixer",
        "omni3mecanum_factors",
        mixers::omni3_factors,
    ),
    ("px4_mecanum_mixer", "forward", mixers::px4),
    ("px4_mecanum_mixer", "yaw", mixers::px4),
    ("px4_mecanum_mixer", "feasible", mixers::px4),
    ("tigers_matrix_motor_model", "ik_x", kinematics::tigers_inverse),
    ("tigers_matrix_motor_model", "ik_w", kinematics::tigers_inverse),
    (
        "tigers_matrix_motor_model",
        "fk_one_wheel_slipping",
        kinematics::tigers_forward,
    ),
    ("ruckig_rest_to_rest", "cruise", path::ruckig),
    ("ruckig_rest_to_rest", "no_cruise", path::ruckig),
    ("ruckig_rest_to_rest", "acceleration_not_reached", path::ruckig),
    (
        "ruckig_rest_to_rest",
        "cruise_without_full_acceleration",
        path::ruckig,
    ),
    ("ruckig_rest_to_rest", "long", path::ruckig),
    ("wpilib_holonomic", "behind", path::wpilib_holonomic),
    ("wpilib_holonomic", "beside_looking_left", path::wpilib_holonomic),
    ("wpilib_holonomic", "across_the_seam", path::wpilib_holonomic),
    (
        "wpilib_holonomic",
        "at_rest_too_far_right",
        path::wpilib_holonomic,
    ),
    ("paper_7wheel", "eq9_forward", paper::equation_9),
    ("paper_7wheel", "eq9_yaw", paper::equation_9),
    ("paper_7wheel", "J_times_eq9_is_identity", paper::left_inverse),
    (
        "paper_7wheel",
        "forward_least_squares_vs_eq7",
        paper::forward_maps,
    ),
    ("paper_7wheel", "eq11_abs_needed", paper::equation_11),
    ("paper_7wheel", "eq14_disturbed_ratio", paper::equation_14),
];

/// Cases that are not asserted here, what this library does, and why.
const UNASSERTED: &[(&str, &str, &str)] = &[
    (
        "ct_pid",
        "nan_error",
        "the output is the integral term, and finite: a NaN never leaves; the integrator is unchanged, as there",
    ),
    (
        "wpilib_odometry",
        "pose_estimator_bound",
        "no estimator with vision; the covariance of odometry is there for those who have one",
    ),
    (
        "paper_7wheel",
        "fig8_order_of_events",
        "needs the three wheels of section 3.3: tests/motor_bench.rs asserts every event",
    ),
];

/// Suites on simulation: the simulator's, not this library's.
const SIMULATION: &[&str] = &[
    "gazebo_wheel_slip",
    "gazebo_mecanum_accept",
    "picknik_roller_ripple",
];

/// Every case of the file with its suite, in order.
fn cases() -> Vec<(String, String, Case)> {
    let file: Value = serde_json::from_str(FILE).expect("valid JSON");
    let text = |value: &Value| value.as_str().expect("a name").to_owned();
    let mut all = Vec::new();
    for suite in file["suites"].as_array().expect("suites") {
        for case in suite["cases"].as_array().expect("cases") {
            let tolerance = ["tol_abs", "tol_s", "tol_rel"]
                .iter()
                .find_map(|key| case[key].as_f64())
                .unwrap_or(0.0);
            let case_ = Case {
                input: case["input"].clone(),
                expected: case["expected"].clone(),
                tolerance,
            };
            all.push((text(&suite["id"]), text(&case["id"]), case_));
        }
    }
    all
}

#[test]
fn every_case_of_the_file_is_asserted_or_says_why_not() {
    let mut asserted = 0;
    for (suite, id, case) in cases() {
        if SIMULATION.contains(&suite.as_str()) {
            continue;
        }
        let check = CHECKS
            .iter()
            .find(|(s, i, _)| (*s, *i) == (suite.as_str(), id.as_str()));
        let excused = UNASSERTED
            .iter()
            .any(|(s, i, _)| (*s, *i) == (suite.as_str(), id.as_str()));
        assert!(
            check.is_some() != excused,
            "{suite}/{id} needs an entry, and only one"
        );
        if let Some((_, _, check)) = check {
            // The name comes first, so that a failure says which case it was.
            eprintln!("{suite}/{id}");
            check(&case);
            asserted += 1;
        }
    }
    assert_eq!(asserted, CHECKS.len(), "an entry without a case");
    assert!(UNASSERTED.len() <= 5);
    eprintln!("{asserted} cases asserted, {} not:", UNASSERTED.len());
    for (suite, id, why) in UNASSERTED {
        eprintln!("  {suite}/{id}: {why}");
    }
}

/// `value` with each of its numbers made wrong in turn.
fn each_number_wrong(value: &Value) -> Vec<Value> {
    match value {
        Value::Number(_) => vec![Value::from(as_number(value) * 1.5 + 0.75)],
        Value::Array(items) => (0..items.len())
            .flat_map(|i| {
                each_number_wrong(&items[i]).into_iter().map(move |wrong| {
                    let mut items = items.clone();
                    items[i] = wrong;
                    Value::Array(items)
                })
            })
            .collect(),
        Value::Object(entries) => entries
            .iter()
            .flat_map(|(key, item)| {
                each_number_wrong(item).into_iter().map(move |wrong| {
                    let mut entries = entries.clone();
                    entries.insert(key.clone(), wrong);
                    Value::Object(entries)
                })
            })
            .collect(),
        _ => Vec::new(),
    }
}

#[test]
fn a_wrong_number_in_the_file_is_noticed() {
    // The panics are expected and need not be read.
    std::panic::set_hook(Box::new(|_| {}));
    let (mut tried, mut unnoticed) = (0, Vec::new());
    for (suite, id, case) in cases() {
        let Some((_, _, check)) = CHECKS
            .iter()
            .find(|(s, i, _)| (*s, *i) == (suite.as_str(), id.as_str()))
        else {
            continue;
        };
        for expected in each_number_wrong(&case.expected) {
            let wrong = Case {
                input: case.input.clone(),
                expected,
                tolerance: case.tolerance,
            };
            tried += 1;
            if std::panic::catch_unwind(|| check(&wrong)).is_ok() {
                unnoticed.push(format!("{suite}/{id}: {}", wrong.expected));
            }
        }
    }
    let _ = std::panic::take_hook();
    assert!(tried > 150 && unnoticed.is_empty(), "of {tried}: {unnoticed:#?}");
}
