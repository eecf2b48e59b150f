//! 10,000 steps of a controller under random commands, loads and broken readings, as one number:
//! the same on every machine, bit for bit, or something computes differently. Included by the build
//! script too, which says what the number should be.

use omni_core::estimate::{Odometry, OdometryState};
use omni_core::loops::ControlSample;
use omni_core::shaping::{TwistLimiter, TwistLimiterState};
use omni_core::{BodyTwist, ControlState, Controller, WheelVelocities};

/// Steps that are hashed.
pub const STEPS: u32 = 10_000;

/// A 32-bit xorshift (Marsaglia, 2003): the same everywhere, and nothing of it in floating point.
struct Random(u32);

impl Random {
    fn bits(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// A number from -`scale` to `scale`; 24 bits, so that it is exact in `f32`.
    fn within(&mut self, scale: f32) -> f32 {
        ((self.bits() >> 8) as f32 / 8_388_608.0 - 1.0) * scale
    }
}

/// FNV-1a over the bits of a number, a NaN as any other NaN: its payload is the processor's own business.
fn take(hash: &mut u32, value: f32) {
    let bits = if value.is_nan() {
        0x7fc0_0000
    } else {
        value.to_bits()
    };
    for byte in bits.to_le_bytes() {
        *hash = (*hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    }
}

/// What a control task keeps between periods.
pub struct Memory {
    /// Of the limits.
    pub limited: TwistLimiterState<f32>,
    /// Of the loops.
    pub state: ControlState<f32, 7>,
    /// Every signal of the last step.
    pub sample: ControlSample<f32, 7>,
    /// Pose of the vehicle.
    pub pose: OdometryState<f32, 7>,
    /// What shows slip.
    pub residual: WheelVelocities<f32, 7>,
}

impl Memory {
    /// At rest at the origin.
    pub const fn new() -> Self {
        Self {
            limited: TwistLimiterState::new(),
            state: ControlState::new(),
            sample: ControlSample::zero(),
            pose: OdometryState::new(),
            residual: WheelVelocities::zero(),
        }
    }
}

/// The hash of every signal of `steps` steps. `step` makes one from the memory, the command and the
/// measured velocities.
pub fn hash(steps: u32, mut step: impl FnMut(&mut Memory, &BodyTwist<f32>, &WheelVelocities<f32, 7>)) -> u32 {
    let mut random = Random(0x9e37_79b9);
    let mut hash = 0x811c_9dc5;
    let mut memory = Memory::new();
    let mut command = BodyTwist::ZERO;
    let mut slowed = [1.0_f32; 7];
    for k in 0..steps {
        if k % 50 == 0 {
            let asked = BodyTwist {
                vx_m_s: random.within(1.5),
                vy_m_s: random.within(1.5),
                wz_rad_s: random.within(3.0),
            };
            // A stop now and then.
            command = if k % 500 == 450 { BodyTwist::ZERO } else { asked };
            // Some wheels are held back, or all of them: every branch of the coordination runs, in every mixture.
            let all = k % 100 == 0;
            slowed = [0; 7].map(|_| {
                if all || random.bits().is_multiple_of(3) {
                    random.within(0.5) + 0.5
                } else {
                    1.0
                }
            });
        }
        let mut measured = memory.sample.wheels.reference;
        for (velocity, slowed) in measured.rad_s.iter_mut().zip(slowed) {
            *velocity = *velocity * slowed + random.within(1.0);
        }
        if random.bits().is_multiple_of(20) {
            measured.rad_s[3] = f32::NAN;
        }
        step(&mut memory, &command, &measured);
        let wheels = &memory.sample.wheels;
        let signals = [
            &wheels.reference.rad_s,
            &wheels.measured.rad_s,
            &wheels.p_n_m,
            &wheels.i_n_m,
            &wheels.d_n_m,
            &wheels.requested.n_m,
            &wheels.applied.n_m,
            &wheels.range.lower_n_m,
            &wheels.range.upper_n_m,
        ];
        for signal in signals {
            for value in signal {
                take(&mut hash, *value);
            }
        }
        take(&mut hash, wheels.common_factor);
        for residual in memory.residual.rad_s {
            take(&mut hash, residual);
        }
        let pose = memory.pose.pose();
        for value in [pose.x_m, pose.y_m, pose.yaw_rad] {
            take(&mut hash, value);
        }
    }
    hash
}

/// One period of a control task: velocity limits, inverse kinematics, seven loops, coordination.
#[inline(always)]
pub fn step(
    controller: &Controller<f32, 7>,
    limiter: &TwistLimiter<f32>,
    memory: &mut Memory,
    command: &BodyTwist<f32>,
    measured: &WheelVelocities<f32, 7>,
) {
    let twist = limiter.step(&mut memory.limited, command);
    controller.step_into(&mut memory.state, &twist, measured, &mut memory.sample);
}

/// The pose, and what shows slip, from what the step took for measured: a reading that is no number counts as rest.
#[inline(always)]
pub fn pose(controller: &Controller<f32, 7>, odometry: &Odometry<f32, 7>, memory: &mut Memory) {
    let measured = memory.sample.wheels.measured;
    let twist = controller.kinematics().forward(&measured);
    odometry.step_twist(&mut memory.pose, &twist);
    memory.residual = controller.kinematics().residual_beyond(&measured, &twist);
}
