//! PID loops.

use omni_core::loops::{AntiWindup, FeedForward, IntegrationOrder, LastStep, Pid, PidState};
use omni_core::motor::TorqueRange;
use omni_core::{PidConfig, PidGains};

use crate::{Case, as_number, as_numbers};

fn gains(kp: f64, ki: f64, kd: f64) -> PidGains<f64> {
    PidGains {
        kp_n_m_s_rad: kp,
        ki_n_m_rad: ki,
        kd_n_m_s2_rad: kd,
    }
}

/// A loop whose step before was one at rest: its first derivative is not zero.
fn at_rest() -> PidState<f64> {
    let last = LastStep {
        reference_rad_s: 0.0,
        measured_rad_s: 0.0,
    };
    PidState {
        last: Some(last),
        ..PidState::default()
    }
}

/// A number of the input, or 0.
fn or_zero(case: &Case, key: &str) -> f64 {
    case.input[key].as_f64().unwrap_or(0.0)
}

/// control_toolbox integrates after the output and compares its first error with 0. Its period may change from call to
/// call: one `Pid` a period, on the same state.
pub(crate) fn control_toolbox(case: &Case) {
    let params = &case.input["params"];
    let [p, i, d, upper_n_m, lower_n_m] = ["p", "i", "d", "umax", "umin"].map(|key| as_number(&params[key]));
    let anti_windup = match params["aw"].as_str() {
        Some("conditional_integration") => AntiWindup::Conditional,
        Some(other) => panic!("another law: {other}"),
        None => AntiWindup::None,
    };
    let mut state = at_rest();
    let (mut outputs, mut integrals) = (Vec::new(), Vec::new());
    for pair in case.input["sequence_error_dt"]
        .as_array()
        .expect("errors and periods")
    {
        let [error, dt] = as_numbers(pair).try_into().expect("two numbers");
        let mut config = PidConfig::new(gains(p, i, d), dt);
        config.order = IntegrationOrder::AfterOutput;
        config.anti_windup = anti_windup;
        config.output = TorqueRange { lower_n_m, upper_n_m };
        let pid = Pid::new(config);
        outputs.push(pid.expect("valid").step(&mut state, error, 0.0).output_n_m);
        integrals.push(state.integral_n_m);
    }
    case.expects("cmd", &outputs);
    if case.expected.get("i_term_after").is_some() {
        case.expects("i_term_after", &integrals);
    }
}

/// A period of 0 there holds the last command at run time; here it cannot be configured.
pub(crate) fn period_zero(case: &Case) {
    assert!(case.input.as_str().expect("words").contains("dt=0"));
    let error = Pid::new(PidConfig::new(gains(1.0, 1.0, 1.0), 0.0)).expect_err("refused");
    assert_eq!(error.parameter, "period_s");
}

pub(crate) fn reset_keeping_integral(case: &Case) {
    assert!(case.input.as_str().expect("words").contains("i_term=-0.5"));
    let pid = Pid::new(PidConfig::new(gains(1.0, 1.0, 1.0), 1.0)).expect("valid");
    let mut state = PidState {
        integral_n_m: -0.5,
        derivative_n_m: 3.0,
        last: None,
    };
    state.reset_keeping_integral();
    case.expects("cmd", &[pid.step(&mut state, 0.0, 0.0).output_n_m]);
}

/// WPILib: 20 ms unless the case says otherwise, the integral before the output.
pub(crate) fn wpilib(case: &Case) {
    let period = case.input["period_s"].as_f64().unwrap_or(0.02);
    let config = PidConfig::new(
        gains(or_zero(case, "kp"), or_zero(case, "ki"), or_zero(case, "kd")),
        period,
    );
    let mut state = PidState::default();
    let output = Pid::new(config).expect("valid").step(
        &mut state,
        case.number("setpoint"),
        case.number("measurement"),
    );
    // The error is within the zone in which that case integrates: it changes nothing.
    assert!(
        case.input["i_zone"]
            .as_f64()
            .is_none_or(|zone| case.number("measurement").abs() <= zone)
    );
    case.expects("out", &[output.output_n_m]);
}

pub(crate) fn wpilib_derivative(case: &Case) {
    let pid = Pid::new(PidConfig::new(
        gains(0.0, 0.0, case.number("kd")),
        case.number("period_s"),
    ))
    .expect("valid");
    let mut state = PidState::default();
    let mut last = 0.0;
    for measured in case.numbers("measurements") {
        last = pid.step(&mut state, case.number("setpoint"), measured).output_n_m;
    }
    case.expects("out_last", &[last]);
}

/// The exact discretisation of `ka w' = u - kv w`, friction added.
pub(crate) fn wpilib_feed_forward(case: &Case) {
    let mut config = PidConfig::new(gains(0.0, 0.0, 0.0), case.number("dt_s"));
    config.feed_forward = FeedForward {
        static_n_m: case.number("ks"),
        velocity_n_m_s_rad: case.number("kv"),
        acceleration_n_m_s2_rad: case.number("ka"),
    };
    let pid = Pid::new(config).expect("valid");
    let mut state = PidState::default();
    pid.step(&mut state, case.number("v"), 0.0);
    case.expects(
        "volts",
        &[pid.step(&mut state, case.number("v_next"), 0.0).output_n_m],
    );
}

/// The `pid` crate has no period: 1 s, gains as they are. Derivative of the measurement. A limit a term.
pub(crate) fn pid_rs(case: &Case) {
    let limit = case.number("output_limit");
    let gains = gains(or_zero(case, "kp"), or_zero(case, "ki"), or_zero(case, "kd"));
    let mut config = PidConfig::new(gains, 1.0);
    config.anti_windup = case.input["i_limit"]
        .as_f64()
        .map_or(AntiWindup::None, |limit_n_m| AntiWindup::Clamp { limit_n_m });
    config.output = TorqueRange {
        lower_n_m: -limit,
        upper_n_m: limit,
    };
    let pid = Pid::new(config.with_derivative_on_measurement()).expect("valid");
    let mut state = PidState::default();
    let measured = case.input["measurements"].as_array().map_or_else(
        || vec![case.number("measurement")],
        |m| m.iter().map(as_number).collect(),
    );
    let outputs: Vec<f64> = measured
        .iter()
        .map(|&m| pid.step(&mut state, case.number("setpoint"), m).output_n_m)
        .collect();
    case.expects("out", &outputs);
}

/// idsp low-passes the whole error with the time constant kd / limit_d, backward Euler, before an ideal PID; as one
/// biquad `y = b0 x + b1 x1 + b2 x2 + a1 y1 + a2 y2`. Its limit of the integral leaves no trace in these coefficients.
pub(crate) fn idsp(case: &Case) {
    let [kp, ki, kd, limit_d] = ["kp", "ki", "kd", "limit_d"].map(|key| case.number(key));
    let period = case.number("sample_period");
    let pid = Pid::new(PidConfig::new(gains(kp, ki, kd), period)).expect("valid");
    let memory = (kd / limit_d) / (kd / limit_d + period);
    // The first three samples of our impulse response, started at rest, and its poles give the numerator.
    let mut state = at_rest();
    let mut filtered = 1.0 - memory;
    let response = [0; 3].map(|_| {
        let output = pid.step(&mut state, filtered, 0.0).output_n_m;
        filtered *= memory;
        output
    });
    let b0 = response[0];
    let b1 = response[1] - (memory + 1.0) * response[0];
    let b2 = response[2] - (memory + 1.0) * response[1] + memory * response[0];
    for (got, expected) in [b0, b1, b2, memory + 1.0, -memory]
        .iter()
        .zip(as_numbers(&case.expected["ba"]))
    {
        assert!(
            (got - expected).abs() <= case.tolerance * expected.abs(),
            "{got} {expected}"
        );
    }
}
