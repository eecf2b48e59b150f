//! What a simulated climb costs beside its physics.
//!
//! Every line is a ratio of shortest times, measured in turns in one run: machines are noisy, ratios less so.
#![expect(clippy::print_stdout, reason = "a benchmark's output")]

use std::time::Instant;

use omni_core::loops::ControllerPolicy;
use omni_log::{Error, LogRun, RunLog};
use omni_sim::config::{Override, Scenario};
use omni_sim::controller::AnyController;
use omni_sim::{Run, Simulation, Trace, run};

/// Rounds of which the shortest time counts.
const ROUNDS: usize = 7;

fn seconds<O>(work: impl FnOnce() -> O) -> f64 {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed().as_secs_f64()
}

/// Shortest times of several pieces of work, made in turns.
fn shortest<const N: usize>(mut work: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut best = [f64::INFINITY; N];
    for _ in 0..ROUNDS {
        for (best, work) in best.iter_mut().zip(&mut work) {
            *best = best.min(seconds(work));
        }
    }
    best
}

/// The same physics as the run of the trace, without all else: its torques, period by period.
fn bare(scenario: &Scenario, torques: &[Vec<f64>]) {
    let mut simulation = Simulation::new(scenario).expect("valid");
    for torques in torques {
        simulation.advance_physics(torques);
    }
}

/// Seconds of two threads that each do `work`, and of one that does it.
fn alone_and_pair(work: impl Fn() + Sync) -> [f64; 2] {
    shortest([&mut || work(), &mut || {
        std::thread::scope(|scope| {
            scope.spawn(&work);
            scope.spawn(&work);
        });
    }])
}

/// Some tenths of a second of arithmetic in registers: what the machine's second core is worth.
fn arithmetic() {
    let mut x = 1.0_f64;
    for k in 0..60_000_000_u32 {
        x = x.mul_add(0.999_999, f64::from(k & 7));
    }
    std::hint::black_box(x);
}

/// The first seconds of the step with an engine and a wheel model.
fn step(engine: &str, model: &str, duration_s: f64) -> Scenario {
    let overrides = [
        Override::new("duration_s", duration_s),
        Override::new("physics.engine", engine),
        Override::new("physics.wheel_model", model),
    ];
    Scenario::load("step", &overrides).expect("built in")
}

/// What the engines do in the same time: with control, observation and trace, with a log of every
/// period, and with rollers.
fn engines(folder: &std::path::Path) {
    let [rapier, own, rollers] = [
        ("rapier", "ball"),
        ("articulated", "ball"),
        ("articulated", "rollers"),
    ]
    .map(|(e, m)| step(e, m, 3.0));
    let log = |scenario: &Scenario| {
        let controller = AnyController::new(scenario).expect("a controller");
        let mut log = RunLog::create(folder.join("engine.mcap"), scenario, &controller).expect("writable");
        let run = Run::new(scenario).controller(controller);
        let run = run.log_to::<Error>(&mut log).expect("runs");
        log.finish(&run.outcome).expect("writable");
    };
    let traced = |scenario: &Scenario| drop(run(scenario).expect("runs"));
    let [theirs, ours, logged, rolled] = shortest([
        &mut || traced(&rapier),
        &mut || traced(&own),
        &mut || log(&own),
        &mut || traced(&rollers),
    ]);
    // The same loops behind the seam for controllers of one's own.
    let behind = || {
        let (limiter, controller) = (
            own.limiter().expect("valid"),
            own.controller::<f64, 7>().expect("valid"),
        );
        let policy = Box::new(ControllerPolicy::new(limiter, controller));
        let controller = AnyController::own(&own, policy).expect("a controller");
        drop(Run::new(&own).controller(controller).trace().expect("runs"));
    };
    let [built_in, seam] = shortest([&mut || traced(&own), &mut || behind()]);
    println!(
        "a controller of one's own costs {:+.1} % of a run with the same loops built in (none measurable: within 5)",
        100.0 * (seam / built_in - 1.0)
    );
    let times = |seconds: f64| 3.0 / seconds;
    println!(
        "articulated: {:.0} times real time with control, observation and trace (at least 100), {:.1} times rapier's",
        times(ours),
        theirs / ours
    );
    println!(
        "articulated: {:.0} times real time with a log of every period (at least 50)",
        times(logged)
    );
    println!(
        "articulated: {:.0} times real time with rollers (at least 60), {:.2} of balls",
        times(rolled),
        ours / rolled
    );
}

/// Seconds a simulated second takes with a wheel model in rapier: the vehicle drives up to the step.
fn wheel_model(model: &str) -> f64 {
    let scenario = step("rapier", model, 0.2);
    let [time] = shortest([&mut || drop(run(&scenario).expect("runs"))]);
    time / scenario.duration_s
}

fn torques(trace: &Trace) -> Vec<Vec<f64>> {
    let wheels = trace.wheel_names().len();
    let of = |row: usize| (0..wheels).map(move |w| trace.wheel("applied_n_m", w).expect("a signal")[row]);
    (0..trace.rows()).map(|row| of(row).collect()).collect()
}

fn main() {
    let scenario = Scenario::load("step", &[Override::new("duration_s", 3.0)]).expect("built in");
    let trace = run(&scenario).expect("runs");
    let torques = torques(&trace);
    let folder = tempfile::tempdir().expect("a folder");
    let log = || {
        let controller = AnyController::new(&scenario).expect("a controller");
        let mut log = RunLog::create(folder.path().join("x.mcap"), &scenario, &controller).expect("writable");
        let run = Run::new(&scenario).controller(controller);
        let run = run.log_to::<Error>(&mut log).expect("runs");
        log.finish(&run.outcome).expect("writable");
    };
    let [physics, traced, metered, logged] = shortest([
        &mut || bare(&scenario, &torques),
        &mut || drop(run(&scenario).expect("runs")),
        &mut || drop(Run::new(&scenario).outcome().expect("runs")),
        &mut || log(),
    ]);
    let [alone, pair] = alone_and_pair(|| drop(run(&scenario).expect("runs")));
    let [machine_alone, machine_pair] = alone_and_pair(arithmetic);
    let [ball, rollers] = ["ball", "rollers"].map(wheel_model);
    let simulated = scenario.duration_s;
    let steps = simulated * 1e6 / scenario.physics.timestep_us as f64;
    println!(
        "physics alone:                        {:8.0} steps/s",
        steps / physics
    );
    println!(
        "with control, observation and trace:  {:8.0} steps/s, {:.1} times real time",
        steps / traced,
        simulated / traced
    );
    println!(
        "control, observation and trace cost {:+.1} % of the physics (at most 10)",
        100.0 * (traced / physics - 1.0)
    );
    println!(
        "metrics without a trace cost        {:+.1} % of the physics",
        100.0 * (metered / physics - 1.0)
    );
    println!(
        "an MCAP log costs                   {:+.1} % more (at most 10)",
        100.0 * (logged / metered - 1.0)
    );
    println!(
        "two worlds on two threads are worth {:.2} of one (at least 1.8; arithmetic alone: {:.2})",
        2.0 * alone / pair,
        2.0 * machine_alone / machine_pair
    );
    println!(
        "in rapier balls are {:.0} times as fast as rollers (at least 10): {:.1} and {:.2} times real time",
        rollers / ball,
        1.0 / ball,
        1.0 / rollers
    );
    engines(folder.path());
}
