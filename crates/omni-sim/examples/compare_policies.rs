//! Every coordination policy on grounds of less and less friction: a scenario with some of its keys replaced.
//!
//! Prints how long each takes over the step of 5 cm, or how it ends. Single runs near the limit are
//! chaotic: who wants to know which policy is better runs many (`omnistep study`).
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_sim::config::{Override, Scenario};
use omni_sim::{Error, run};

fn main() -> Result<(), Error> {
    let frictions = [0.9, 0.7, 0.5];
    println!(
        "friction      {}",
        frictions.map(|friction| format!("{friction:>12}")).concat()
    );
    for policy in omni_sim::config::POLICIES {
        print!("{policy:14}");
        for friction in frictions {
            let overrides = [
                Override::new("control.policy", policy),
                Override::new("terrain.friction", friction),
                Override::new("stop_when_done", true),
            ];
            let trace = run(&Scenario::load("step", &overrides)?)?;
            let outcome = trace.outcome();
            match outcome.crossing_s {
                Some(crossing_s) => print!("{crossing_s:10.2} s"),
                None => print!("{:>12}", outcome.verdict.name()),
            }
            assert!(outcome.climbed || friction < 0.9); // on good ground all of them climb
        }
        println!();
    }
    Ok(())
}
