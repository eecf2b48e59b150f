//! Cost of a control step and of a simulated climb.
//!
//! Read ratios within one run; absolute times depend on the machine.

#[path = "../crates/omni-core/examples/instructions/setup.rs"]
mod setup;

use std::cell::Cell;
use std::hint::black_box;
use std::time::Instant;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use num_traits::float::FloatCore;
use omni_core::shaping::TwistLimiterState;
use omni_core::{
    BodyTwist, ControlState, Coordination, PidGains, Real, TorqueLimit, WheelLayout, WheelVelocities,
};
use omni_sim::Simulation;
use omni_sim::config::Scenario;
use setup::{chugo7, controller, limiter, mecanum4, omni3, pid_loops, pid_step};

const TORQUE_LIMIT_N_M: f64 = 1.0;
const GAINS: PidGains<f64> = PidGains {
    kp_n_m_s_rad: 0.3,
    ki_n_m_rad: 2.0,
    kd_n_m_s2_rad: 0.0,
};

fn limit<R: Real>() -> TorqueLimit<R> {
    TorqueLimit::constant(R::of(TORQUE_LIMIT_N_M)).expect("valid")
}

fn control<R: Real>(c: &mut Criterion, scalar: &str) {
    let mut group = c.benchmark_group(format!("control_step_{scalar}"));
    for policy in Coordination::<f64>::PRESETS {
        let coordination = Coordination::preset(policy).expect("a preset");
        let controller = controller(&chugo7::<R>(), GAINS, limit(), coordination);
        let command = BodyTwist::from_array([R::of(0.3), R::of(0.0), R::of(0.1)]);
        let mut state = ControlState::default();
        group.bench_function(policy, |b| {
            b.iter(|| {
                controller.step(
                    &mut state,
                    black_box(&command),
                    black_box(&WheelVelocities {
                        rad_s: [R::of(1.0); 7],
                    }),
                )
            })
        });
    }
    group.finish();
}

/// The shortest time of a call \[s\] over the samples of one benchmark: what the machine needs when
/// nothing disturbs it. Infinite where the command line asked for other benchmarks only.
fn shortest<O>(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, mut call: impl FnMut() -> O) -> f64 {
    let shortest_s = Cell::new(f64::INFINITY);
    group.bench_function(name, |b| {
        b.iter_custom(|calls| {
            let start = Instant::now();
            for _ in 0..calls {
                black_box(call());
            }
            let elapsed = start.elapsed();
            shortest_s.set(shortest_s.get().min(elapsed.as_secs_f64() / calls as f64));
            elapsed
        })
    });
    shortest_s.get()
}

/// A whole step, from the command, limited axis by axis, to torques within limits that keep the
/// wheels together, next to as many loops of the `pid` crate as there are wheels, which know
/// nothing of each other. Prints the ratio of the times.
fn against_pid<R: Real + FloatCore, const N: usize>(
    c: &mut Criterion,
    layout: &WheelLayout<R, N>,
    scalar: &str,
) {
    let controller = controller(layout, GAINS, limit(), Coordination::scale_references());
    let command = BodyTwist::from_array([R::of(0.3), R::of(0.1), R::of(0.2)]);
    let reference = controller.kinematics().inverse(&command);
    // Above and below the reference by turns, so that the integrals stay small and no limit is met.
    let measured = [0.98, 1.02].map(|share| WheelVelocities {
        rad_s: reference.rad_s.map(|r| r * R::of(share)),
    });
    let mut turn = 0;
    let mut next = || {
        turn = 1 - turn;
        turn
    };

    let mut group = c.benchmark_group(format!("step_against_pid_{N}_{scalar}"));
    let limiter = limiter();
    let (mut limited, mut state) = (TwistLimiterState::default(), ControlState::default());
    let whole = shortest(&mut group, "omni", || {
        let command = limiter.step(&mut limited, black_box(&command));
        controller
            .step(&mut state, &command, black_box(&measured[next()]))
            .wheels
            .applied
    });
    let mut loops = pid_loops(&reference, GAINS, TORQUE_LIMIT_N_M);
    let separate = shortest(&mut group, "pid", || {
        pid_step(&mut loops, black_box(&measured[next()]))
    });
    group.finish();
    let ratio = whole / separate;
    if ratio.is_finite() {
        eprintln!("{N} wheels, {scalar}: a whole step takes {ratio:.2} times as long as {N} pid loops\n");
    }
}

/// One control period (two physics steps) of the built-in step, the vehicle on flat ground.
fn simulate(c: &mut Criterion) {
    let scenario = Scenario::load("step", &[]).expect("built-in");
    let mut group = c.benchmark_group("simulation");
    group.throughput(Throughput::Elements(
        scenario.control.period_us / scenario.physics.timestep_us,
    ));
    let mut simulation = Simulation::new(&scenario).expect("valid");
    group.bench_function("period", |b| {
        b.iter(|| simulation.step(black_box(&BodyTwist::ZERO)))
    });
    group.finish();
}

fn all(c: &mut Criterion) {
    control::<f32>(c, "f32");
    control::<f64>(c, "f64");
    against_pid(c, &omni3::<f32>(), "f32");
    against_pid(c, &omni3::<f64>(), "f64");
    against_pid(c, &mecanum4::<f32>(), "f32");
    against_pid(c, &mecanum4::<f64>(), "f64");
    against_pid(c, &chugo7::<f32>(), "f32");
    against_pid(c, &chugo7::<f64>(), "f64");
    simulate(c);
}

criterion_group!(benches, all);
criterion_main!(benches);
