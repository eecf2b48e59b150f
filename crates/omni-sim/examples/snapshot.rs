//! Saves a simulation in the middle of a climb, resumes it, and lets both go on: they stay equal to the last bit.
//!
//! Prints the size of the snapshot and where the two vehicles end.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_sim::{Error, Simulation, config::Scenario};

fn go_on(simulation: &mut Simulation, periods: u32) -> Result<(), Error> {
    for _ in 0..periods {
        simulation.step(&simulation.scenario_command())?;
    }
    Ok(())
}

fn main() -> Result<(), Error> {
    let scenario = Scenario::load("step", &[])?;
    let mut first = Simulation::new(&scenario)?;
    go_on(&mut first, 2000)?; // 2 s: the front wheels are on the step

    let bytes = first.save(&scenario)?; // to a file, or to another process
    let mut second = Simulation::resume(&scenario, &bytes)?;
    println!(
        "saved at {:.1} s: {} bytes",
        first.time_ns() as f64 * 1e-9,
        bytes.len()
    );

    go_on(&mut first, 3000)?;
    go_on(&mut second, 3000)?;
    for (name, simulation) in [("first", &first), ("second", &second)] {
        let [x_m, y_m, z_m] = simulation.observation().pose.position_m;
        println!(
            "{name:6} at {:.1} s: {x_m} {y_m} {z_m} m",
            simulation.time_ns() as f64 * 1e-9
        );
    }
    assert_eq!(first.observation(), second.observation());
    assert_eq!(first.save(&scenario)?, second.save(&scenario)?);
    Ok(())
}
