//! Configurations of loops and drives out of bytes, most of them accepted.

use arbitrary::Unstructured;
use omni_core::drive::{FaultConfig, SlipConfig};
use omni_core::estimate::OdometryNoise;
use omni_core::geometry::{Desaturation, ForwardMap, SpeedLimits, Wheel};
use omni_core::loops::{AntiWindup, FeedForward, Integral, IntegrationOrder, Rest, Saturation};
use omni_core::shaping::{AxisLimits, EmergencyDeceleration, MotionLimits, ShapingConfig, TwistLimits};
use omni_core::{
    Coordination, DriveConfig, PidConfig, PidGains, Real, TorqueLimit, WheelControlConfig, WheelLayout,
};

use super::numbers::{bits, byte, limit, none_or, one_in, signed, within};

/// A configuration, most of the time one that is accepted, and the limits of its motors.
pub(super) fn drive<R: Real, const N: usize>(
    u: &mut Unstructured<'_>,
) -> Option<(DriveConfig<R, N>, [TorqueLimit<R>; N])> {
    let (layout, control) = (layout::<R, N>(u)?, control::<R, N>(u)?);
    let limits = control.limits;
    let speed_limits = one_in(u, 2).then(|| {
        let desaturation = [
            Desaturation::Uniform,
            Desaturation::KeepsYaw,
            Desaturation::KeepsTranslation,
        ];
        SpeedLimits::new(
            std::array::from_fn(|_| within(u, 1e-3, 1e6)),
            desaturation[usize::from(byte(u) % 3)],
        )
        .ok()
    });
    let slip = one_in(u, 2).then(|| {
        let enter_rad_s = limit::<R>(u, 1e-9, 1e3);
        let share = within(u, 1e-3, 1.0);
        let leave_rad_s = if enter_rad_s.is_finite_real() {
            enter_rad_s * share
        } else {
            share
        };
        SlipConfig {
            enter_rad_s,
            leave_rad_s,
            enter_periods: periods(u),
            leave_periods: periods(u),
        }
    });
    let faults = one_in(u, 2).then(|| {
        let mut faults = FaultConfig::unchecked();
        faults.jump_rad_s = limit(u, 1e-9, 1e3);
        faults.jump_periods = periods(u);
        faults.stuck_rad_s = limit(u, 1e-9, 1e3);
        faults.stuck_torque_n_m = limit(u, 1e-9, 1e3);
        faults.stuck_periods = periods(u).max(2);
        faults.silent_periods = periods(u);
        faults.recovery_periods = periods(u);
        faults
    });
    let noise = one_in(u, 2).then(|| OdometryNoise {
        wheel_rad_per_sqrt_rad: none_or(u, 1e-6, 1.0),
        residual_gain: none_or(u, 1e-6, 10.0),
    });
    let mut rest = Rest::default();
    rest.bleed_s = none_or(u, 1e-3, 10.0);
    rest.hold_s = none_or(u, 1e-3, 3600.0);
    rest.hold_torque_squared_n2m2s = none_or(u, 1e-3, 1e9);
    // Any bits: what is accepted has to work.
    let command_point_m = if one_in(u, 4) {
        [bits(u), bits(u)]
    } else {
        [signed(u, 1e-3, 10.0), signed(u, 1e-3, 10.0)]
    };
    let mut config = DriveConfig::new(layout, control);
    config.forward = if one_in(u, 4) {
        ForwardMap::PaperAverage
    } else {
        ForwardMap::LeastSquares
    };
    config.shaping = shaping(u);
    config.command_point_m = command_point_m;
    config.discretize = one_in(u, 2);
    config.unobservable_periods = periods(u);
    config.speed_limits = speed_limits.flatten();
    config.slip = slip;
    config.faults = faults;
    config.noise = noise;
    rest.short_windings = config.discretize; // as good as drawn, and inputs of the corpus stay what they are
    config.rest = rest;
    Some((config, limits))
}

/// A few periods most of the time, up to 65535.
fn periods(u: &mut Unstructured<'_>) -> u16 {
    if one_in(u, 8) {
        u.arbitrary::<u16>().unwrap_or_default().max(1)
    } else {
        1 + u16::from(byte(u) % 20)
    }
}

pub(super) fn layout<R: Real, const N: usize>(u: &mut Unstructured<'_>) -> Option<WheelLayout<R, N>> {
    let regular = one_in(u, 2);
    let size: R = within(u, 0.01, 100.0);
    let radius_m: R = within(u, 1e-3, 1.0);
    let layout = if regular {
        WheelLayout::omni(size, signed(u, 0.1, 3.0), radius_m)
    } else {
        let wheels = std::array::from_fn(|_| Wheel {
            position_m: [signed::<R>(u, 0.1, 1.0) * size, signed::<R>(u, 0.1, 1.0) * size],
            rolling_direction: [signed(u, 0.1, 10.0), signed(u, 0.1, 10.0)],
            roller_angle_rad: signed(u, 0.1, 1.5),
            radius_m: within(u, 1e-3, 1.0),
            gear: within(u, 1e-2, 100.0),
            reversed: one_in(u, 2),
        });
        WheelLayout::new(wheels)
    };
    match layout.ok() {
        None => WheelLayout::omni(R::of(0.3), R::zero(), R::of(0.05)).ok(),
        layout => layout,
    }
}

/// Gains over the whole of their range, 0 to 1e6.
pub(super) fn control<R: Real, const N: usize>(u: &mut Unstructured<'_>) -> Option<WheelControlConfig<R, N>> {
    let top = if one_in(u, 8) { 1e6 } else { 30.0 };
    let gains = PidGains {
        kp_n_m_s_rad: none_or(u, 1e-6, top),
        ki_n_m_rad: none_or(u, 1e-6, top),
        kd_n_m_s2_rad: none_or(u, 1e-9, top / 1e3),
    };
    let period_s: R = within(u, 1e-6, 10.0);
    let anti_windup = match byte(u) % 5 {
        0 => AntiWindup::None,
        1 => AntiWindup::Clamp {
            limit_n_m: none_or(u, 1e-3, 1e9),
        },
        2 => AntiWindup::Conditional,
        3 => AntiWindup::BackCalculation {
            tracking_time_s: period_s * within(u, 1.0, 1e4),
        },
        _ => AntiWindup::Conditioned,
    };
    let mut pid = PidConfig::new(gains, period_s);
    pid.proportional_weight = none_or(u, 1e-3, 1.0);
    pid.derivative_weight = none_or(u, 1e-3, 1.0);
    pid.derivative_filter_s = none_or(u, 1e-6, 1e3);
    pid.feed_forward = FeedForward {
        static_n_m: none_or(u, 1e-6, top),
        velocity_n_m_s_rad: none_or(u, 1e-6, top),
        acceleration_n_m_s2_rad: none_or(u, 1e-6, top),
    };
    pid.order = if one_in(u, 3) {
        IntegrationOrder::AfterOutput
    } else {
        IntegrationOrder::BeforeOutput
    };
    pid.anti_windup = anti_windup;
    if one_in(u, 3) {
        pid.integral_zone_rad_s = none_or(u, 1e-3, 1e6);
    }
    if one_in(u, 3) {
        pid.proportional_limit_n_m = none_or(u, 1e-3, 1e6);
    }
    let saturation = match byte(u) % 4 {
        0 => Saturation::Clip,
        1 => Saturation::ScaleTorques,
        _ => Saturation::ScaleReferences {
            floor: none_or(u, 1e-3, 1.0),
        },
    };
    let integral = if one_in(u, 3) {
        Integral::Shared
    } else {
        Integral::PerWheel
    };
    let mut limits = [TorqueLimit::constant(R::one()).ok()?; N];
    for limit in &mut limits {
        let stall = within(u, 1e-3, 1e3);
        *limit = TorqueLimit::line(stall, none_or(u, 1e-3, 10.0)).ok()?;
        if one_in(u, 3) {
            *limit = limit.capped(within(u, 1e-3, 1e3)).ok()?;
        }
    }
    Some(WheelControlConfig {
        pid,
        limits,
        coordination: Coordination::new(saturation, integral),
    })
}

fn shaping<R: Real>(u: &mut Unstructured<'_>) -> ShapingConfig<R> {
    let mut shaping = ShapingConfig::none();
    shaping.limits = twist_limits(u);
    shaping.timeout_s = one_in(u, 2).then(|| none_or(u, 1e-4, 10.0));
    shaping.emergency_deceleration = one_in(u, 2).then(|| EmergencyDeceleration {
        linear_m_s2: limit(u, 1e-6, 1e6),
        yaw_rad_s2: limit(u, 1e-6, 1e6),
    });
    shaping
}

pub(super) fn twist_limits<R: Real>(u: &mut Unstructured<'_>) -> TwistLimits<R> {
    if one_in(u, 2) {
        let mut motion = || MotionLimits {
            velocity: limit(u, 1e-3, 100.0),
            acceleration: limit(u, 1e-3, 1e3),
            deceleration: limit(u, 1e-3, 1e3),
            jerk: limit(u, 1e-3, 1e4),
        };
        TwistLimits::AlongMotion {
            linear: motion(),
            yaw: motion(),
        }
    } else {
        let mut axis = || AxisLimits {
            min_velocity: -limit::<R>(u, 1e-3, 100.0),
            max_velocity: limit(u, 1e-3, 100.0),
            acceleration: limit(u, 1e-3, 1e3),
            deceleration: limit(u, 1e-3, 1e3),
            reverse_acceleration: limit(u, 1e-3, 1e3),
            reverse_deceleration: limit(u, 1e-3, 1e3),
            jerk: limit(u, 1e-3, 1e4),
        };
        TwistLimits::PerAxis {
            vx: axis(),
            vy: axis(),
            wz: axis(),
        }
    }
}
