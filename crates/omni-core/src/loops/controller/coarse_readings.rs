//! Encoders whose single readings ask for more torque than the motors have: the vehicle goes as fast as commanded.

use core::f64::consts::TAU;
use std::format;
use std::string::String;
use std::vec::Vec;

use super::*;
use crate::loops::{AntiWindup, Coordination, PidConfig, PidGains};
use crate::motor::TorqueLimit;

/// A vehicle whose wheels do not slip.
trait Model<const N: usize> {
    const NAME: &'static str;
    /// kp \[N.m.s/rad\] and ki \[N.m/rad\].
    const GAINS: [f64; 2];
    /// Stall torque \[N.m\] and what is lost of it per speed \[N.m.s/rad\].
    const MOTOR: [f64; 2];
    /// Mass along x and y \[kg\] and about z \[kg.m^2\], wheels' rotation included.
    const INERTIA: [f64; 3];
    fn layout<R: Real>() -> WheelLayout<R, N>;
}

struct Chugo7;
impl Model<7> for Chugo7 {
    const NAME: &'static str = "chugo7";
    const GAINS: [f64; 2] = [0.3, 2.0];
    const MOTOR: [f64; 2] = [2.0, 0.0];
    const INERTIA: [f64; 3] = [22.5, 21.0, 1.5];
    fn layout<R: Real>() -> WheelLayout<R, 7> {
        WheelLayout::chugo7(R::of(0.30), R::of(0.23), R::of(0.066)).expect("valid")
    }
}

struct Omni3;
impl Model<3> for Omni3 {
    const NAME: &'static str = "omni3";
    const GAINS: [f64; 2] = [0.15, 0.8];
    const MOTOR: [f64; 2] = [1.0, 0.03];
    const INERTIA: [f64; 3] = [7.6, 7.6, 0.12];
    fn layout<R: Real>() -> WheelLayout<R, 3> {
        WheelLayout::omni(R::of(0.18), R::zero(), R::of(0.05)).expect("valid")
    }
}

struct Mecanum4;
impl Model<4> for Mecanum4 {
    const NAME: &'static str = "mecanum4";
    const GAINS: [f64; 2] = [0.4, 2.0];
    const MOTOR: [f64; 2] = [3.0, 0.10];
    const INERTIA: [f64; 3] = [26.4, 26.4, 1.5];
    fn layout<R: Real>() -> WheelLayout<R, 4> {
        WheelLayout::mecanum4(R::of(0.5), R::of(0.4), R::of(0.076)).expect("valid")
    }
}

/// What reads the wheels.
#[derive(Clone, Copy, Debug)]
enum Encoder {
    /// Counts per turn.
    Counts(f64),
    /// Standard deviation of normal noise \[rad/s\].
    Noise(f64),
}

/// Uniform numbers from a seed: a generator of 64 bits (Marsaglia, Xorshift RNGs, 2003).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Twelve uniform numbers less six: mean 0, deviation 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

const DT: f64 = 1e-3;

/// Mean of the velocity ahead \[m/s\] over the second half of 20 s: at 0.1 m/s the coarsest encoder then counts 67
/// times, and one count is 1.5 %. No loop knows the mean of the noise, so that is added: what is left is the law's.
fn mean_speed<R: Real, M: Model<N>, const N: usize>(
    policy: &str,
    anti_windup: AntiWindup<R>,
    encoder: Encoder,
    asked: f64,
) -> f64 {
    let exact = Kinematics::new(&M::layout::<f64>()).expect("valid");
    let gains = PidGains {
        kp_n_m_s_rad: R::of(M::GAINS[0]),
        ki_n_m_rad: R::of(M::GAINS[1]),
        kd_n_m_s2_rad: R::zero(),
    };
    let limit = TorqueLimit::line(R::of(M::MOTOR[0]), R::of(M::MOTOR[1])).expect("valid");
    let config = WheelControlConfig {
        pid: PidConfig {
            anti_windup,
            ..PidConfig::new(gains, R::of(DT))
        },
        limits: [limit; N],
        coordination: Coordination::preset(policy).expect("a preset"),
    };
    let controller = Controller::new(&M::layout(), config).expect("valid");
    let mut state = ControlState::default();
    let command = BodyTwist::from_array([R::of(asked), R::zero(), R::zero()]);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut twist = [0.0; 3];
    let mut counted: Vec<f64> = (0..N).map(|_| 0.0).collect();
    let mut angle: Vec<f64> = (0..N).map(|_| random.uniform()).collect();
    let mut noise = WheelVelocities::zero();
    let mut sum = 0.0;
    let periods = 20_000;
    for k in 0..periods {
        let velocity = exact.inverse(&BodyTwist::from_array(twist)).rad_s;
        let mut measured = WheelVelocities::zero();
        for i in 0..N {
            measured.rad_s[i] = R::of(match encoder {
                Encoder::Counts(counts) => {
                    angle[i] += velocity[i] * DT;
                    let now = (angle[i] * counts / TAU).floor();
                    let reading = if k == 0 {
                        0.0
                    } else {
                        (now - counted[i]) * TAU / counts / DT
                    };
                    counted[i] = now;
                    reading
                }
                Encoder::Noise(deviation) => {
                    noise.rad_s[i] = deviation * random.normal();
                    velocity[i] + noise.rad_s[i]
                }
            });
        }
        let torques = controller
            .step(&mut state, &command, &measured)
            .wheels
            .applied
            .n_m;
        // The power of the wheels is that of the force on the vehicle; bearings brake it a little.
        for axis in 0..3 {
            let force: f64 = (0..N)
                .map(|i| exact.inverse_matrix()[i][axis] * torques[i].as_f64())
                .sum();
            twist[axis] += DT * (force / M::INERTIA[axis] - 0.1 * twist[axis]);
        }
        if k >= periods / 2 {
            sum += twist[0] + exact.forward(&noise).vx_m_s;
        }
    }
    sum / f64::from(periods / 2)
}

/// What is off by more than 5 % of the speed asked for.
fn off<M: Model<N>, const N: usize>() -> Vec<String> {
    let counts = [32.0, 64.0, 128.0, 256.0, 512.0, 1024.0, 2048.0, 4096.0].map(Encoder::Counts);
    let noises = [0.0, 1.0, 5.0, 10.0, 20.0].map(Encoder::Noise);
    let mut off = Vec::new();
    for policy in Coordination::<f64>::PRESETS {
        for encoder in counts.iter().chain(&noises) {
            for asked in [0.1, 0.3] {
                for (precision, mean) in [
                    (
                        "f32",
                        mean_speed::<f32, M, N>(policy, AntiWindup::None, *encoder, asked),
                    ),
                    (
                        "f64",
                        mean_speed::<f64, M, N>(policy, AntiWindup::None, *encoder, asked),
                    ),
                ] {
                    let kept = (mean / asked - 1.0).abs() <= 0.05; // not where it is no number
                    if !kept {
                        off.push(format!(
                            "{} {policy} {precision} {encoder:?}: {mean:.3} of {asked} m/s",
                            M::NAME
                        ));
                    }
                }
            }
        }
    }
    off
}

#[test]
fn coarse_noisy_encoders_leave_the_mean_speed_within_5_percent_under_every_policy() {
    let off = [off::<Chugo7, 7>(), off::<Omni3, 3>(), off::<Mecanum4, 4>()].concat();
    assert!(off.is_empty(), "{} off:\n{}", off.len(), off.join("\n"));
}

#[test]
fn no_choice_of_anti_windup_makes_a_bias_of_single_readings() {
    let laws = [
        AntiWindup::Conditional,
        AntiWindup::BackCalculation {
            tracking_time_s: 0.15,
        },
        AntiWindup::Conditioned,
    ];
    for law in laws {
        for policy in ["independent", "scale_torques", "shared_integral"] {
            for encoder in [
                Encoder::Counts(64.0),
                Encoder::Counts(512.0),
                Encoder::Noise(20.0),
            ] {
                let mean = mean_speed::<f64, Chugo7, 7>(policy, law, encoder, 0.3);
                assert!(
                    (mean / 0.3 - 1.0).abs() <= 0.05,
                    "{law:?} {policy} {encoder:?}: {mean:.3} m/s"
                );
            }
        }
    }
}
