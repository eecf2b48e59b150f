//! Does energy close where gears have friction? Seeded runs over the built-in step, on both engines, on balls and on
//! rollers, with much friction and with little. `gear_friction_energy SEEDS` prints a table as Markdown; the exit code
//! is 1 where a run ends with an error or its residual is beyond the bound of docs/validation.md.
//! Without an argument it makes 22 runs in some seconds, none of rapier's rollers.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use std::process::ExitCode;

use omni_sim::config::{Override, Scenario};
use omni_sim::{Error, run};

/// Engine, wheel model, and one of how many seeds it gets: a tenth costs rapier's rollers five
/// times what all the others cost.
const WHEELS: [(&str, &str, u64); 4] = [
    ("articulated", "ball", 1),
    ("articulated", "rollers", 1),
    ("rapier", "ball", 5),
    ("rapier", "rollers", 10),
];
/// Of the energy that went through the motors, so much may be missing.
const MOST: f64 = 1e-4;
/// Dry friction behind a gear \[N.m\], and its efficiency.
const GEARS: [(f64, f64); 2] = [(0.2, 0.8), (0.05, 0.9)];

fn main() -> Result<ExitCode, Error> {
    let seeds: u64 = std::env::args()
        .nth(1)
        .and_then(|seeds| seeds.parse().ok())
        .unwrap_or(5);
    println!("| engine, wheels | friction, efficiency | runs | errors | beyond the bound | worst residual |");
    println!("|---|---|---|---|---|---|");
    let mut closes = true;
    for (engine, wheels, part) in WHEELS {
        let seeds = seeds / part;
        for (friction, efficiency) in GEARS.into_iter().filter(|_| seeds > 0) {
            let (mut runs, mut errors, mut beyond, mut worst) = (0, 0, 0, 0.0_f64);
            for seed in 0..seeds {
                let keys = [
                    format!("seed={}", 8800 + seed),
                    format!("physics.engine={engine}"),
                    format!("physics.wheel_model={wheels}"),
                    format!("vehicle.motor.gear_friction_n_m={friction}"),
                    format!("vehicle.motor.efficiency={efficiency}"),
                    // Half of them slip for seconds, half climb.
                    format!(
                        "control.policy={}",
                        ["independent", "traction"][seed as usize % 2]
                    ),
                    "perturbation.yaw_rad=0.03".to_owned(),
                    "perturbation.start_m=0.02".to_owned(),
                    "duration_s=12".to_owned(),
                ];
                let keys: Result<Vec<_>, _> = keys.iter().map(|text| Override::parse(text)).collect();
                runs += 1;
                match run(&Scenario::load("step", &keys?)?) {
                    Ok(trace) => {
                        let residual = trace.outcome().energy_residual.abs();
                        worst = worst.max(residual);
                        beyond += u64::from(residual > MOST);
                    }
                    Err(error) => {
                        eprintln!("{engine}, {wheels}, seed {}: {error}", 8800 + seed);
                        errors += 1;
                    }
                }
            }
            closes &= errors == 0 && beyond == 0;
            println!(
                "| {engine}, {wheels} | {friction} N.m, {efficiency} | {runs} | {errors} | {beyond} | {worst:.1e} |"
            );
        }
    }
    Ok(if closes {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
