//! The whole loop of a base with four mecanum wheels: encoder counts in, duties of H-bridges out, motors computed.
//!
//! `cargo run --release -p omnistep-core --example counts_to_duty`

use omni_core::drive::{DriveSample, FaultConfig};
use omni_core::estimate::{Encoder, EncoderConfig, EncoderState, VelocityMethod};
use omni_core::shaping::{MotionLimits, TwistLimits};
use omni_core::{
    BodyTwist, ConfigError, Coordination, Drive, DriveConfig, DriveInput, DriveMode, DriveState,
};
use omni_core::{PidConfig, PidGains, TorqueLimit, WheelControlConfig, WheelLayout, WheelVelocities};

const PERIOD_S: f32 = 0.005;
/// A gear motor of 12 V: torque at rest \[N.m\], and what a rad/s takes of it; edges of its encoder
/// a turn of the wheel.
const STALL_N_M: f32 = 2.38;
const SLOPE_N_M_S_RAD: f32 = 0.073;
const COUNTS_PER_TURN: f32 = 537.7;
/// What a wheel turns of the vehicle's mass, and of itself \[kg.m^2\].
const INERTIA_KG_M2: f32 = 0.0065;

/// Motor, wheel and encoder, as the board sees them.
#[derive(Clone, Copy, Default)]
struct Wheel {
    rad_s: f32,
    turned_rad: f64,
    cut: bool,
}

impl Wheel {
    /// A bridge without a current loop sets a voltage, and the motor's own turning works against it.
    fn turn(&mut self, duty: f32) {
        let torque_n_m = STALL_N_M * duty - SLOPE_N_M_S_RAD * self.rad_s;
        self.rad_s += torque_n_m / INERTIA_KG_M2 * PERIOD_S;
        self.turned_rad += f64::from(self.rad_s * PERIOD_S);
    }

    /// A timer of 16 bits; none where it cannot be read.
    fn counter(&self) -> Option<u32> {
        let counts = self.turned_rad / std::f64::consts::TAU * f64::from(COUNTS_PER_TURN);
        (!self.cut).then_some(65_500_u16.wrapping_add(counts.floor() as i64 as u16).into())
    }
}

/// What a firmware knows from one period to the next.
struct Base {
    drive: Drive<f32, 4>,
    encoder: Encoder<f32>,
    motor: TorqueLimit<f32>,
    state: DriveState<f32, 4>,
    encoders: [EncoderState<f32>; 4],
    sample: DriveSample<f32, 4>,
}

impl Base {
    fn new() -> Result<Self, ConfigError> {
        let gains = PidGains {
            kp_n_m_s_rad: 0.1,
            ki_n_m_rad: 1.0,
            kd_n_m_s2_rad: 0.0,
        };
        let motor = TorqueLimit::line(STALL_N_M, SLOPE_N_M_S_RAD)?;
        let control = WheelControlConfig {
            pid: PidConfig::new(gains, PERIOD_S),
            limits: [motor; 4],
            coordination: Coordination::scale_references(),
        };
        let mut config = DriveConfig::new(WheelLayout::mecanum4(0.22, 0.26, 0.0485)?, control);
        let limits = |velocity, acceleration| MotionLimits {
            velocity,
            acceleration,
            deceleration: 2.0 * acceleration,
            jerk: f32::INFINITY,
        };
        config.shaping.limits = TwistLimits::AlongMotion {
            linear: limits(1.0, 1.5),
            yaw: limits(3.0, 6.0),
        };
        config.shaping.timeout_s = Some(0.2);
        config.faults = Some(FaultConfig {
            stuck_torque_n_m: 0.5 * STALL_N_M,
            ..FaultConfig::usual(PERIOD_S)
        });
        let drive = Drive::new(config)?;
        let velocity = VelocityMethod::Observer {
            bandwidth_rad_s: 60.0,
        };
        let encoder = EncoderConfig {
            counts_per_turn: COUNTS_PER_TURN,
            bits: 16,
            velocity,
            period_s: PERIOD_S,
        };
        Ok(Self {
            state: DriveState::new(&drive),
            drive,
            encoder: Encoder::new(encoder)?,
            motor,
            encoders: [EncoderState::at_rest(); 4],
            sample: DriveSample::zero(),
        })
    }

    /// Every 5 ms: from what the timers and the radio say to the duty of each bridge, none where it is open.
    fn every_period(
        &mut self,
        counters: [Option<u32>; 4],
        command: Option<BodyTwist<f32>>,
        red_button: bool,
    ) -> [Option<f32>; 4] {
        let mut input = DriveInput::measured(&WheelVelocities::zero());
        for ((reading, state), counter) in input
            .readings_rad_s
            .iter_mut()
            .zip(&mut self.encoders)
            .zip(counters)
        {
            *reading = self.encoder.step(state, counter, None);
        }
        (input.command, input.emergency) = (command, red_button);
        self.drive.step_into(&mut self.state, &input, &mut self.sample);
        let wheels = &self.sample.wheels;
        core::array::from_fn(|i| {
            let duty = self.motor.duty(wheels.applied.n_m[i], wheels.measured.rad_s[i]);
            match (self.sample.brake[i], wheels.active[i]) {
                (true, _) => Some(0.0), // shorts the motor
                (_, true) => Some(duty),
                _ => None,
            }
        })
    }
}

#[expect(clippy::print_stdout, reason = "an example speaks on standard output")]
fn main() -> Result<(), ConfigError> {
    let (mut base, mut wheels) = (Base::new()?, [Wheel::default(); 4]);
    let wanted = BodyTwist {
        vx_m_s: 0.6,
        vy_m_s: 0.3,
        wz_rad_s: 0.5,
    };
    for period in 0..1000 {
        // The stick is sent every 20 ms for 2.5 s; the plug of wheel 4 comes off after 1.5 s; the
        // button is pressed after 4 s.
        let command = (period % 4 == 0 && period < 500).then_some(wanted);
        wheels[3].cut = period >= 300;
        let duties = base.every_period(wheels.map(|wheel| wheel.counter()), command, period >= 800);
        for (wheel, duty) in wheels.iter_mut().zip(duties) {
            // An open bridge drives nothing; this bench lets the wheel roll with what it has.
            wheel.turn(duty.unwrap_or(SLOPE_N_M_S_RAD / STALL_N_M * wheel.rad_s));
        }
        let sample = &base.sample;
        let off = |motion: BodyTwist<f32>| {
            let (is, shall) = (motion.to_array(), wanted.to_array());
            is.iter()
                .zip(shall)
                .fold(0.0_f32, |most, (is, shall)| most.max((is - shall).abs()))
        };
        match period {
            // As commanded: to the half of what a count in a period is, 0.11 m/s, through an observer.
            299 => assert!(sample.mode == DriveMode::Normal && off(sample.slip.estimated) < 0.02),
            // Three wheels still say how it moves.
            499 => assert!(sample.mode == DriveMode::Degraded && off(sample.slip.estimated) < 0.02),
            // 0.2 s of time-out, then 0.67 m/s at 3 m/s^2, and half a second in which the torque ends.
            799 => assert!(wheels[..3].iter().all(|wheel| wheel.rad_s.abs() < 0.1) && sample.wheels.ended),
            999 => assert!(sample.mode == DriveMode::EmergencyStop && sample.brake == [true; 4]),
            _ => {}
        }
    }
    let pose = base.sample.pose;
    println!("x = {:.2} m, y = {:.2} m", pose.x_m, pose.y_m);
    // The chord of an arc: 0.67 m/s and 0.5 rad/s for 2.68 s, less the ramp of 0.45 s, and a stop of 0.22 s.
    assert!((pose.x_m.hypot(pose.y_m) - 1.6).abs() < 0.05);
    Ok(())
}
