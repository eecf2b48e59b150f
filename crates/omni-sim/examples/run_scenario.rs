//! Runs a built-in scenario from start to end: the seven-wheel vehicle drives over a step of 5 cm.
//!
//! Prints one signal of its trace over time, how far the nose is up, and then how the run ended and what it took.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_sim::{Error, config::Scenario, run};

fn main() -> Result<(), Error> {
    let trace = run(&Scenario::load("step", &[])?)?;

    // One number a control period, 1 ms; `trace.names()` lists the signals.
    let nose_up_rad = trace.column("body_front_nose_up_rad").unwrap_or_default();
    for (row, nose_up_rad) in nose_up_rad.iter().enumerate().step_by(500).take(7) {
        let time_s = 0.001 * row as f64;
        println!(
            "{time_s:4.1} s: front frame {:5.2} deg up",
            nose_up_rad.to_degrees()
        );
    }

    let outcome = trace.outcome();
    println!("verdict   {}", outcome.verdict.name());
    println!("crossing  {:.2} s", outcome.crossing_s.unwrap_or(f64::NAN));
    println!("pitch     {:.2} deg at most", outcome.pitch_peak_deg);
    println!("work      {:.1} J", outcome.work_j);

    // From the hinge to the front wheels it is 0.30 m, and these stand 0.05 m higher.
    let expected_deg = (0.05_f64 / 0.30).asin().to_degrees();
    assert!(outcome.climbed && (outcome.pitch_peak_deg - expected_deg).abs() < 0.1);
    Ok(())
}
