//! A drive and an encoder that are made on the chip, without constants from a build script: the
//! image links only if no constructor can panic, and what is wrong with a configuration is an error.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use omni_core::drive::{DriveSample, FaultConfig, SlipConfig};
use omni_core::estimate::{Encoder, EncoderConfig, EncoderState, OdometryNoise, VelocityMethod};
use omni_core::geometry::{Desaturation, SpeedLimits};
use omni_core::loops::Rest;
use omni_core::shaping::{EmergencyDeceleration, MotionLimits, TwistLimits};
use omni_core::{BodyTwist, ConfigError, Coordination, Drive, DriveConfig, DriveInput, DriveState};
use omni_core::{PidConfig, PidGains, TorqueLimit, WheelControlConfig, WheelLayout};
use omni_firmware::platform::exit;
use omni_firmware::say;

const PERIOD_S: f32 = 0.001;

/// Everything on. No number is known to the compiler.
fn drive(radius_m: f32) -> Result<Drive<f32, 4>, ConfigError> {
    let b = black_box::<f32>;
    let gains = PidGains {
        kp_n_m_s_rad: b(0.3),
        ki_n_m_rad: b(2.0),
        kd_n_m_s2_rad: b(0.001),
    };
    let control = WheelControlConfig {
        pid: PidConfig::new(gains, b(PERIOD_S)),
        limits: [TorqueLimit::line(b(2.0), b(0.02))?; 4],
        coordination: black_box(Coordination::scale_references()),
    };
    let layout = WheelLayout::mecanum4(b(0.6), b(0.4), radius_m)?;
    let mut config = DriveConfig::new(layout, control);
    let limits = MotionLimits {
        velocity: b(0.8),
        acceleration: b(1.5),
        deceleration: b(3.0),
        jerk: b(20.0),
    };
    config.rest = Rest::hold(b(10.0), b(100.0));
    config.shaping.limits = TwistLimits::AlongMotion {
        linear: limits,
        yaw: limits,
    };
    config.shaping.timeout_s = Some(b(0.2));
    config.shaping.emergency_deceleration = Some(EmergencyDeceleration {
        linear_m_s2: b(4.0),
        yaw_rad_s2: b(8.0),
    });
    config.command_point_m = [b(0.1), b(0.0)];
    config.discretize = black_box(true);
    config.speed_limits = Some(SpeedLimits::new([b(20.0); 4], black_box(Desaturation::KeepsYaw))?);
    config.slip = Some(SlipConfig::usual(b(PERIOD_S)));
    config.faults = Some(FaultConfig::usual(b(PERIOD_S)));
    config.noise = Some(OdometryNoise {
        wheel_rad_per_sqrt_rad: b(0.02),
        residual_gain: b(1.0),
    });
    Drive::new(config)
}

/// Is a vehicle driven by what was made here?
fn drives() -> Result<bool, ConfigError> {
    let drive = drive(black_box(0.1))?;
    let encoder = Encoder::<f32>::new(EncoderConfig {
        counts_per_turn: black_box(1440.0),
        bits: black_box(16),
        velocity: black_box(VelocityMethod::Observer {
            bandwidth_rad_s: 100.0,
        }),
        period_s: black_box(PERIOD_S),
    })?;
    let (mut state, mut sample) = (DriveState::new(&drive), DriveSample::zero());
    let mut encoders = [EncoderState::at_rest(); 4];
    let ahead = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    for k in 0..300 {
        let mut input = DriveInput::measured(&[0.0; 4].into()).with_command(ahead);
        for (reading, state) in input.readings_rad_s.iter_mut().zip(&mut encoders) {
            *reading = encoder.step(state, black_box((k != 100).then_some(0)), None);
        }
        drive.step_into(&mut state, &input, &mut sample);
    }
    // Against wheels that stand: 3 rad/s away, and an integral.
    Ok(sample.wheels.applied.n_m[0] > 0.9)
}

#[entry]
fn main() -> ! {
    let refused = drive(black_box(0.0)).err();
    let good = drives() == Ok(true) && refused.is_some_and(|error| error.parameter == "radius_m");
    say!(
        "constructors on the chip: {}",
        if good {
            "as on a computer"
        } else {
            "NOT as expected"
        }
    );
    exit(good)
}
