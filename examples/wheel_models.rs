//! Where balls and rollers for wheels agree on the step: perturbed runs over torque and friction, both models a cell.
//!
//! `cargo run --release --example wheel_models -- 4` (runs a cell; docs/physics.md has the table). Fails where fewer than nine
//! in ten of the cells in which both models are of one mind say the same.
#![expect(clippy::print_stdout, reason = "an example's output")]

use std::sync::atomic::{AtomicUsize, Ordering};

use omni_sim::config::{Override, Scenario};
use omni_sim::{Error, run};

const TORQUES_N_M: [f64; 4] = [1.0, 1.5, 2.0, 3.0];
const FRICTIONS: [f64; 4] = [0.5, 0.6, 0.7, 0.9];
const MODELS: [&str; 2] = ["ball", "rollers"];

/// How many of `runs` perturbed runs climb, and how long that takes on average \[s\].
fn cell(model: &str, torque: f64, friction: f64, runs: u64, more: &[Override]) -> Result<(u64, f64), Error> {
    let (mut climbed, mut time) = (0, 0.0);
    let mut overrides = vec![
        Override::new("physics.wheel_model", model),
        Override::new("vehicle.motor.stall_torque_n_m", torque),
        Override::new("terrain.friction", friction),
        Override::new("perturbation.yaw_rad", 0.03),
        Override::new("perturbation.start_m", 0.02),
        Override::new("control.policy", "independent"),
    ];
    overrides.extend(more.iter().cloned());
    for seed in 0..runs {
        let mut scenario = Scenario::load("step", &overrides)?;
        scenario.seed = seed;
        let outcome = *run(&scenario)?.outcome();
        climbed += u64::from(outcome.climbed);
        time += outcome.crossing_s.unwrap_or(0.0);
    }
    Ok((climbed, time / climbed as f64))
}

fn main() -> Result<(), Error> {
    let mut args = std::env::args().skip(1);
    let runs: u64 = args.next().and_then(|n| n.parse().ok()).unwrap_or(4);
    let more = args
        .map(|text| Override::parse(&text))
        .collect::<Result<Vec<_>, _>>()?;
    let mut cells = Vec::new();
    for torque in TORQUES_N_M {
        for friction in FRICTIONS {
            for model in MODELS {
                cells.push((model, torque, friction));
            }
        }
    }
    // One world a core: each run is the same whichever thread runs it.
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let work = || -> Result<Vec<(usize, (u64, f64))>, Error> {
        let mut done = Vec::new();
        while let Some((model, torque, friction)) = cells.get(next.fetch_add(1, Ordering::Relaxed)).copied() {
            let index = cells
                .iter()
                .position(|c| *c == (model, torque, friction))
                .unwrap_or(0);
            done.push((index, cell(model, torque, friction, runs, &more)?));
        }
        Ok(done)
    };
    let mut results = vec![(0, 0.0); cells.len()];
    let parts: Vec<_> = std::thread::scope(|scope| {
        let started: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        started
            .into_iter()
            .map(std::thread::ScopedJoinHandle::join)
            .collect()
    });
    for part in parts {
        for (index, result) in part.unwrap_or_else(|panic| std::panic::resume_unwind(panic))? {
            results[index] = result;
        }
    }

    println!("climbed of {runs} (mean crossing [s]), ball | rollers");
    println!(
        "torque [N.m]  {}",
        FRICTIONS.map(|f| format!("{:25}", format!("mu {f}"))).concat()
    );
    let (mut clear, mut agree) = (0, 0);
    for (row, torque) in TORQUES_N_M.iter().enumerate() {
        let mut line = format!("{torque:<14}");
        for column in 0..FRICTIONS.len() {
            let at = 2 * (row * FRICTIONS.len() + column);
            let [ball, rollers] = [results[at], results[at + 1]];
            if [ball.0, rollers.0]
                .iter()
                .all(|climbed| *climbed == 0 || *climbed == runs)
            {
                clear += 1;
                agree += i32::from(ball.0 == rollers.0);
            }
            line += &format!(
                "{:25}",
                format!("{} ({:.2}) | {} ({:.2})", ball.0, ball.1, rollers.0, rollers.1)
            );
        }
        println!("{line}");
    }
    println!("both models of one mind in {clear} of 16 cells; they agree in {agree} of these");
    if 10 * agree < 9 * clear {
        return Err(Error::Argument {
            name: "agreement",
            value: format!("{agree} of {clear}"),
            allowed: "nine in ten",
        });
    }
    Ok(())
}
