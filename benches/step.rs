//! Cost of a control step and of a simulated climb.
//!
//! Read ratios within one run; absolute times depend on the machine.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use omni_core::{
    BodyTwist, ControlState, Controller, Coordination, PidConfig, PidGains, Real, TorqueLimit,
    WheelControlConfig, WheelLayout, WheelVelocities,
};
use omni_sim::Simulation;
use omni_sim::config::Scenario;

fn controller<R: Real>(policy: &str) -> Controller<R, 7> {
    let layout = WheelLayout::chugo7(R::of(0.30), R::of(0.23), R::of(0.066)).expect("valid");
    let gains = PidGains {
        kp_n_m_s_rad: R::of(0.3),
        ki_n_m_rad: R::of(2.0),
        kd_n_m_s2_rad: R::of(0.0),
    };
    let limits = [TorqueLimit::constant(R::of(1.0)).expect("valid"); 7];
    let coordination = Coordination::preset(policy).expect("a preset");
    Controller::new(
        &layout,
        WheelControlConfig {
            pid: PidConfig::new(gains, R::of(1e-3)),
            limits,
            coordination,
        },
    )
    .expect("valid")
}

fn control<R: Real>(c: &mut Criterion, scalar: &str) {
    let mut group = c.benchmark_group(format!("control_step_{scalar}"));
    for policy in Coordination::<f64>::PRESETS {
        let controller = controller::<R>(policy);
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

/// One control period (two physics steps) of the built-in step, the vehicle on flat ground.
fn simulate(c: &mut Criterion) {
    let scenario = Scenario::load("step", &[]).expect("built-in");
    let mut group = c.benchmark_group("simulation");
    group.throughput(Throughput::Elements(
        scenario.control.period_us / scenario.physics.step_us,
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
    simulate(c);
}

criterion_group!(benches, all);
criterion_main!(benches);
