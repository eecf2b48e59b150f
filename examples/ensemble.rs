//! How often each policy climbs: perturbed runs of the built-in step.
//!
//! Near the torque threshold single runs are chaotic; only ensembles mean anything (docs/physics.md).
//!
//! `cargo run --release --example ensemble -- 24 terrain.friction=0.6 physics.solver_iterations=4`
#![expect(clippy::print_stdout, reason = "an example's output")]

use omni_sim::config::{Override, Scenario};
use omni_sim::{Error, run};

fn main() -> Result<(), Error> {
    let mut args = std::env::args().skip(1);
    let runs: u64 = args.next().and_then(|n| n.parse().ok()).unwrap_or(12);
    let mut overrides = args
        .map(|text| Override::parse(&text))
        .collect::<Result<Vec<_>, _>>()?;
    // Heading and phase of the step as a person would place the vehicle.
    overrides.push(Override::parse("perturbation.yaw_rad=0.03")?);
    overrides.push(Override::parse("perturbation.start_m=0.02")?);
    println!("policy         climbed  crossing [s]  slip   spread  heat [N2m2s]");
    for policy in omni_core::Coordination::<f64>::PRESETS {
        let (mut climbed, mut crossing, mut slip, mut spread, mut heat) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for seed in 0..runs {
            let mut scenario = Scenario::load("step", &overrides)?.with_policy(policy)?;
            scenario.seed = seed;
            let outcome = *run(&scenario)?.outcome();
            climbed += f64::from(u8::from(outcome.climbed));
            crossing += outcome.crossing_s.unwrap_or(0.0);
            slip += outcome.slip_rms / runs as f64;
            spread += outcome.spread_rms / runs as f64;
            heat += outcome.heat_n2m2s / runs as f64;
        }
        let mean = if climbed > 0.0 {
            format!("{:.2}", crossing / climbed)
        } else {
            "-".into()
        };
        println!("{policy:13} {climbed:4}/{runs:<4} {mean:>12}  {slip:.3}  {spread:.3}   {heat:.1}");
    }
    Ok(())
}
