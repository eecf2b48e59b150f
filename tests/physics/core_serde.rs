//! States and configurations of omni-core survive being written and read, bit for bit.

use omni_core::estimate::{Odometry, OdometryState};
use omni_core::loops::{AntiWindup, ControlSample};
use omni_core::shaping::{AxisLimits, TwistLimiter, TwistLimiterState, TwistLimits};
use omni_core::{
    BodyTwist, ControlState, Controller, Coordination, Kinematics, PidConfig, PidGains, TorqueLimit,
    WheelControlConfig, WheelLayout,
};

const GAINS: PidGains<f32> = PidGains {
    kp_n_m_s_rad: 0.3,
    ki_n_m_rad: 2.0,
    kd_n_m_s2_rad: 1e-3,
};

/// Everything that changes while a vehicle drives.
type Memory = (
    TwistLimiterState<f32>,
    ControlState<f32, 7>,
    OdometryState<f32, 7>,
);

fn drive(periods: std::ops::Range<u32>, memory: &mut Memory) -> Vec<ControlSample<f32, 7>> {
    let layout = WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid");
    let config = WheelControlConfig {
        pid: PidConfig::new(GAINS, 1e-3),
        limits: [TorqueLimit::constant(0.5).expect("valid"); 7],
        coordination: Coordination::scale_references(),
    };
    let controller = Controller::new(&layout, config).expect("valid");
    let axis = AxisLimits::symmetric(1.0, 0.5, 0.5, 5.0);
    let limiter = TwistLimiter::new(
        TwistLimits::PerAxis {
            vx: axis,
            vy: axis,
            wz: axis,
        },
        1e-3,
    )
    .expect("valid");
    let (odometry, kinematics) = (
        Odometry::new(1e-3).expect("valid"),
        Kinematics::new(&layout).expect("valid"),
    );
    let (limited, state, pose) = memory;
    periods
        .map(|k| {
            let command = BodyTwist {
                vx_m_s: 0.8,
                vy_m_s: 0.1,
                wz_rad_s: (k as f32 * 0.01).fract(),
            };
            let twist = limiter.step(limited, &command);
            let lagging = kinematics.inverse(&twist).rad_s.map(|v| 0.9 * v);
            odometry.step_velocities(pose, &kinematics, &lagging.into());
            controller.step(state, &twist, &lagging.into())
        })
        .collect()
}

#[test]
fn a_drive_goes_on_from_what_was_written_as_if_nothing_had_happened() {
    let mut memory = Memory::default();
    drive(0..300, &mut memory);
    let text = serde_json::to_string(&memory).expect("states are plain data");
    let mut read: Memory = serde_json::from_str(&text).expect("what was written can be read");
    assert_eq!(read, memory);
    assert_eq!(drive(300..600, &mut read), drive(300..600, &mut memory));
    assert_eq!(read.2.pose(), memory.2.pose());
}

#[test]
fn a_configuration_is_plain_data_with_the_names_of_its_fields() {
    let mut config = PidConfig::new(
        PidGains {
            kp_n_m_s_rad: 0.25,
            ki_n_m_rad: 2.0,
            kd_n_m_s2_rad: 0.0,
        },
        1e-3,
    );
    config.anti_windup = AntiWindup::BackCalculation { tracking_time_s: 0.5 };
    let value = serde_json::to_value(config.gains).expect("plain data");
    assert_eq!(
        value,
        serde_json::json!({"kp_n_m_s_rad": 0.25, "ki_n_m_rad": 2.0, "kd_n_m_s2_rad": 0.0})
    );
    let value = serde_json::to_value(config.anti_windup).expect("plain data");
    assert_eq!(
        value,
        serde_json::json!({"BackCalculation": {"tracking_time_s": 0.5}})
    );
    assert!(serde_json::from_str::<PidGains<f32>>(r#"{"kp_n_m_s_rad": 0.25}"#).is_err());
}
