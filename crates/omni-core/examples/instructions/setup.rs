//! What the instruction counter and the benchmark set up alike: vehicles, their controllers, and `pid` loops beside.

use num_traits::float::FloatCore;
use omni_core::shaping::{AxisLimits, TwistLimiter, TwistLimits};
use omni_core::{
    Controller, Coordination, PidConfig, PidGains, Real, TorqueLimit, WheelControlConfig, WheelLayout,
    WheelVelocities,
};

const PERIOD_S: f64 = 1e-3;

/// Three omni wheels at 120 degrees.
pub(crate) fn omni3<R: Real>() -> WheelLayout<R, 3> {
    WheelLayout::omni(R::of(0.2), R::of(0.0), R::of(0.05)).expect("valid")
}

/// Four mecanum wheels in a rectangle.
pub(crate) fn mecanum4<R: Real>() -> WheelLayout<R, 4> {
    WheelLayout::mecanum4(R::of(0.4), R::of(0.3), R::of(0.05)).expect("valid")
}

/// The paper's seven wheels.
pub(crate) fn chugo7<R: Real>() -> WheelLayout<R, 7> {
    WheelLayout::chugo7(R::of(0.30), R::of(0.23), R::of(0.066)).expect("valid")
}

/// Loops of all wheels with the same gains and the same limit.
pub(crate) fn controller<R: Real, const N: usize>(
    layout: &WheelLayout<R, N>,
    gains: PidGains<f64>,
    limit: TorqueLimit<R>,
    coordination: Coordination<R>,
) -> Controller<R, N> {
    let gains = PidGains {
        kp_n_m_s_rad: R::of(gains.kp_n_m_s_rad),
        ki_n_m_rad: R::of(gains.ki_n_m_rad),
        kd_n_m_s2_rad: R::of(gains.kd_n_m_s2_rad),
    };
    Controller::new(
        layout,
        WheelControlConfig {
            pid: PidConfig::new(gains, R::of(PERIOD_S)),
            limits: [limit; N],
            coordination,
        },
    )
    .expect("valid")
}

/// Velocity and acceleration limits of each axis, met by no command here: what limiting costs when it does nothing.
pub(crate) fn limiter<R: Real>() -> TwistLimiter<R> {
    let axis = AxisLimits::symmetric(R::of(1.0), R::of(1e4), R::of(1e4), R::of(f64::INFINITY));
    let limits = TwistLimits::PerAxis {
        vx: axis,
        vy: axis,
        wz: axis,
    };
    TwistLimiter::new(limits, R::of(PERIOD_S)).expect("valid")
}

/// One `pid` loop a wheel, with the same gains per period and one limit \[N.m\] for its terms and their sum.
pub(crate) fn pid_loops<R: Real + FloatCore, const N: usize>(
    reference: &WheelVelocities<R, N>,
    gains: PidGains<f64>,
    limit_n_m: f64,
) -> [pid::Pid<R>; N] {
    let limit = R::of(limit_n_m);
    reference.rad_s.map(|reference| {
        let mut pid = pid::Pid::new(reference, limit);
        pid.p(R::of(gains.kp_n_m_s_rad), limit)
            .i(R::of(gains.ki_n_m_rad * PERIOD_S), limit)
            .d(R::of(gains.kd_n_m_s2_rad / PERIOD_S), limit);
        pid
    })
}

/// A step of loops that know nothing of each other and whose references stay.
#[inline]
pub(crate) fn pid_step<R: Real + FloatCore, const N: usize>(
    loops: &mut [pid::Pid<R>; N],
    measured: &WheelVelocities<R, N>,
) -> [R; N] {
    let mut torques = [R::zero(); N];
    for ((torque, pid), &measured) in torques.iter_mut().zip(loops).zip(&measured.rad_s) {
        *torque = pid.next_control_output(measured).output;
    }
    torques
}
