//! Runs control steps for an instruction counter: omni-core's whole step, or one loop of the `pid` crate a wheel.
//!
//! `instructions omni|pid 3|4|7 f32|f64 free|saturated STEPS`. Start and end cost the same for any number of steps, so
//! the difference of two counts is the steps' alone: `scripts/instructions.sh` takes it.

mod setup;

use std::env;
use std::hint::black_box;
use std::process::ExitCode;

use num_traits::float::FloatCore;
use omni_core::loops::ControlSample;
use omni_core::shaping::{TwistLimiter, TwistLimiterState};
use omni_core::{
    BodyTwist, ControlState, Controller, Coordination, PidGains, Real, TorqueLimit, WheelLayout,
    WheelVelocities,
};
use setup::{chugo7, controller, limiter, mecanum4, omni3, pid_loops, pid_step};

const USAGE: &str = "usage: instructions omni|pid 3|4|7 f32|f64 free|saturated STEPS";
/// Inputs are taken in turn from a table of this many.
const INPUTS: usize = 8;
const STALL_TORQUE_N_M: f64 = 2.0;
const SLOPE_N_M_S_RAD: f64 = 0.02;
const GAINS: PidGains<f64> = PidGains {
    kp_n_m_s_rad: 0.3,
    ki_n_m_rad: 2.0,
    kd_n_m_s2_rad: 1e-5,
};

/// What one step is given.
struct Input<R, const N: usize> {
    command: BodyTwist<R>,
    measured: WheelVelocities<R, N>,
}

/// Free: a vehicle that follows its command, 2 % above and below by turns. Saturated: one held at 0.6 of
/// it, so that the common factor settles near 0.6, above its floor, with a wheel at its torque limit.
fn inputs<R: Real, const N: usize>(controller: &Controller<R, N>, saturated: bool) -> [Input<R, N>; INPUTS] {
    core::array::from_fn(|i| {
        let command = BodyTwist::from_array([R::of(0.3), R::of(0.1), R::of(0.2)]);
        let sign = if i % 2 == 0 { 0.02 } else { -0.02 };
        let share = R::of(if saturated { 0.6 } else { 1.0 + sign });
        Input {
            command,
            measured: WheelVelocities {
                rad_s: controller.kinematics().inverse(&command).rad_s.map(|r| r * share),
            },
        }
    })
}

/// Inputs and state of the step.
struct Vehicle<R, const N: usize> {
    limiter: TwistLimiter<R>,
    limited: TwistLimiterState<R>,
    controller: Controller<R, N>,
    state: ControlState<R, N>,
    sample: ControlSample<R, N>,
}

/// The step as the interrupt of a motor controller calls it: command and measurements in, the
/// command limited, torques out.
#[inline(never)]
fn omni_step<R: Real, const N: usize>(vehicle: &mut Vehicle<R, N>, input: &Input<R, N>) -> [R; N] {
    let command = vehicle.limiter.step(&mut vehicle.limited, &input.command);
    vehicle
        .controller
        .step_into(&mut vehicle.state, &command, &input.measured, &mut vehicle.sample);
    vehicle.sample.wheels.applied.n_m
}

/// The same of the `pid` loops.
#[inline(never)]
fn separate_step<R: Real + FloatCore, const N: usize>(
    loops: &mut [pid::Pid<R>; N],
    input: &Input<R, N>,
) -> [R; N] {
    pid_step(loops, &input.measured)
}

fn limit<R: Real>() -> TorqueLimit<R> {
    TorqueLimit::line(R::of(STALL_TORQUE_N_M), R::of(SLOPE_N_M_S_RAD)).expect("valid")
}

/// Whether the last of `steps` steps left some wheel at its torque limit.
fn run<R: Real + FloatCore, const N: usize>(
    layout: &WheelLayout<R, N>,
    omni: bool,
    saturated: bool,
    steps: usize,
) -> bool {
    let controller = controller(layout, GAINS, limit(), Coordination::scale_references());
    let inputs = inputs(&controller, saturated);
    let mut torques = [R::zero(); N];
    let turns = inputs.iter().cycle().take(steps);
    if omni {
        let mut vehicle = Vehicle {
            limiter: limiter(),
            limited: TwistLimiterState::default(),
            controller,
            state: ControlState::default(),
            sample: ControlSample::zero(),
        };
        for input in turns {
            torques = omni_step(black_box(&mut vehicle), black_box(input));
            black_box(&torques);
        }
    } else {
        let reference = controller.kinematics().inverse(&inputs[0].command);
        let mut loops = pid_loops(&reference, GAINS, STALL_TORQUE_N_M);
        for input in turns {
            torques = separate_step(black_box(&mut loops), black_box(input));
            black_box(&torques);
        }
    }
    // The inputs repeat and the loops settle within the first thousand steps, so the last step
    // stands for those counted.
    let limit = limit();
    let last = &inputs[(steps + INPUTS - 1) % INPUTS];
    torques
        .iter()
        .zip(&last.measured.rad_s)
        .any(|(&torque, &velocity)| {
            let range = limit.range(velocity);
            torque >= range.upper_n_m * R::of(0.9999) || torque <= range.lower_n_m * R::of(0.9999)
        })
}

fn run_scalar<R: Real + FloatCore>(wheels: &str, omni: bool, saturated: bool, steps: usize) -> Option<bool> {
    Some(match wheels {
        "3" => run(&omni3::<R>(), omni, saturated, steps),
        "4" => run(&mecanum4::<R>(), omni, saturated, steps),
        "7" => run(&chugo7::<R>(), omni, saturated, steps),
        _ => return None,
    })
}

/// The answer to the arguments: `None` where they are not as the usage says, else whether the case was what it claims.
fn answer(arguments: &[String]) -> Option<bool> {
    let [side, wheels, scalar, case, steps] = arguments else {
        return None;
    };
    let omni = match side.as_str() {
        "omni" => true,
        "pid" => false,
        _ => return None,
    };
    let saturated = match case.as_str() {
        "free" => false,
        "saturated" => true,
        _ => return None,
    };
    let steps = steps.parse().ok()?;
    let at_limit = match scalar.as_str() {
        "f32" => run_scalar::<f32>(wheels, omni, saturated, steps),
        "f64" => run_scalar::<f64>(wheels, omni, saturated, steps),
        _ => None,
    }?;
    Some(at_limit == saturated)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match answer(&arguments) {
        Some(true) => ExitCode::SUCCESS,
        Some(false) => {
            eprintln!("{}: the wheels were not as the case says", arguments.join(" "));
            ExitCode::FAILURE
        }
        None => {
            eprintln!("{USAGE}");
            ExitCode::FAILURE
        }
    }
}
