//! Rate limiters, time-outs and commands that are no numbers.

use omni_core::shaping::{
    AxisLimits, CommandShaper, CommandStatus, RateLimiter, RateLimiterState, ShaperState, ShapingConfig,
};
use omni_core::{
    BodyTwist, ControlState, Controller, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig,
    WheelLayout, WheelVelocities,
};
use serde_json::Value;

use crate::{Case, as_number};

/// `null` there is no limit.
fn limit(params: &Value, key: &str) -> f64 {
    params[key].as_f64().map_or(f64::INFINITY, f64::abs)
}

/// The limits of which one call there takes some: `limit_value`, `limit_first_derivative`,
/// `limit_second_derivative`, or all.
fn limits(params: &Value, call: &str) -> AxisLimits<f64> {
    let mut limits = AxisLimits::unlimited();
    let all = call == "limit";
    if all || call == "limit_value" {
        limits.min_velocity = -limit(params, "min_value");
        limits.max_velocity = limit(params, "max_value");
    }
    if all || call == "limit_first_derivative" {
        // What is not given for slowing down there is as for speeding up.
        let or = |key: &str, other: &str| {
            if params[key].is_null() {
                limit(params, other)
            } else {
                limit(params, key)
            }
        };
        limits.acceleration = limit(params, "max_first_derivative_pos");
        limits.deceleration = or("min_first_derivative_pos", "max_first_derivative_pos");
        limits.reverse_acceleration = limit(params, "min_first_derivative_neg");
        limits.reverse_deceleration = or("max_first_derivative_neg", "min_first_derivative_neg");
    }
    if all || call == "limit_second_derivative" {
        // Ours is symmetric; these cases speed up.
        limits.jerk = limit(params, "max_second_derivative");
    }
    limits
}

pub(crate) fn rate_limiter(case: &Case) {
    let (params, args) = (&case.input["params"], &case.input["args"]);
    let call = case.input["call"].as_str().expect("a call");
    // limit_value has no period: any will do.
    let period = args["dt"].as_f64().unwrap_or(0.5);
    let start = args["v0"].as_f64().unwrap_or(0.0);
    assert_eq!(
        args["v1"].as_f64().unwrap_or(start),
        start,
        "steady before the call"
    );
    let limiter = RateLimiter::new(limits(params, call), period).expect("valid");
    let wanted = as_number(&args["v"]);
    let got = limiter.step(&mut RateLimiterState::at(start), wanted);
    case.expects("v", &[got]);
    case.expects("limiting_factor", &[got / wanted]);
}

pub(crate) fn invalid_limits(case: &Case) {
    let params = &case.input["params"];
    let [min_velocity, max_velocity] = ["min_value", "max_value"].map(|key| as_number(&params[key]));
    let limits = AxisLimits {
        min_velocity,
        max_velocity,
        ..AxisLimits::unlimited()
    };
    assert_eq!(
        RateLimiter::new(limits, 0.01).expect_err("refused").parameter,
        "min_velocity"
    );
    assert_eq!(case.expected["error"], "invalid_argument");
}

pub(crate) fn time_to_stop(case: &Case) {
    let [from, to] = case.array("cmd");
    let limits = AxisLimits {
        deceleration: case.input["max_deceleration"]
            .as_f64()
            .map_or(f64::INFINITY, f64::abs),
        reverse_deceleration: case.input["max_deceleration_reverse"]
            .as_f64()
            .map_or(f64::INFINITY, f64::abs),
        ..AxisLimits::unlimited()
    };
    let dt = case.number("dt_s");
    let limiter = RateLimiter::new(limits, dt).expect("valid");
    let mut state = RateLimiterState::at(from);
    let mut periods = 0.0;
    while limiter.step(&mut state, to) != to {
        periods += 1.0;
        assert!(periods < 1e4, "never there");
    }
    case.expects("reaches_target_at_s", &[(periods + 1.0) * dt]);
}

/// A time-out of 0 uses a command in one period only.
pub(crate) fn timeout_zero(case: &Case) {
    let mut config = ShapingConfig::none();
    config.timeout_s = Some(case.number("reference_timeout"));
    let shaper = CommandShaper::new(config, 0.01).expect("valid");
    let mut state = ShaperState::default();
    let command = BodyTwist {
        vx_m_s: 1.0,
        ..BodyTwist::ZERO
    };
    let once = shaper.step(&mut state, Some(&command));
    assert_eq!((once.twist, once.status), (command, CommandStatus::Following));
    let after = shaper.step(&mut state, None);
    assert_eq!(
        (after.twist, after.status),
        (BodyTwist::ZERO, CommandStatus::TimedOut)
    );
    assert!(
        case.expected["behaviour"]
            .as_str()
            .expect("words")
            .contains("exactly one update")
    );
}

/// A NaN in any component changes nothing that goes out, and is never passed on.
pub(crate) fn nan_reference(case: &Case) {
    assert!(
        case.expected["behaviour"]
            .as_str()
            .expect("words")
            .contains("never NaN")
    );
    let shaper = CommandShaper::new(ShapingConfig::none(), 0.01).expect("valid");
    let gains = PidGains {
        kp_n_m_s_rad: 0.3,
        ki_n_m_rad: 2.0,
        kd_n_m_s2_rad: 0.0,
    };
    let config = WheelControlConfig {
        pid: PidConfig::new(gains, 0.01),
        limits: [TorqueLimit::constant(2.0).expect("valid"); 4],
        coordination: Coordination::independent(),
    };
    let controller =
        Controller::new(&WheelLayout::omni(0.5, 0.0, 0.1).expect("valid"), config).expect("valid");
    let good = BodyTwist {
        vx_m_s: 1.0,
        vy_m_s: 1.0,
        wz_rad_s: 1.0,
    };
    for component in 0..3 {
        let mut bad = good.to_array();
        bad[component] = f64::NAN;
        let bad = BodyTwist::from_array(bad);
        let mut state = ShaperState::default();
        shaper.step(&mut state, Some(&good));
        let shaped = shaper.step(&mut state, Some(&bad));
        assert!(shaped.twist == good && shaped.rejected);
        // Without a shaper the controller itself takes it for rest.
        let sample = controller.step(&mut ControlState::default(), &bad, &WheelVelocities::zero());
        assert_eq!(sample.wheels.applied.n_m, [0.0; 4]);
    }
}
