//! Another policy while the vehicle drives: nothing jumps.

use omni_sim::Simulation;
use omni_sim::config::{Override, POLICIES};

use crate::engines::load;

/// From every policy to every other one, bare and inside a drive: the limited command goes on, and the vehicle with it.
#[test]
fn any_policy_takes_over_from_any_other_while_the_vehicle_drives() {
    for surroundings in [None, Some("drive={}")] {
        let overrides: Vec<_> = (surroundings.iter())
            .map(|text| Override::parse(text).expect("KEY=VALUE"))
            .collect();
        let scenario = load("flat", &overrides).expect("valid");
        for from in POLICIES {
            let from_scenario = scenario.with_policy(from).expect("a policy");
            let mut simulation = Simulation::new(&from_scenario).expect("valid");
            for _ in 0..1000 {
                simulation.step(&simulation.scenario_command()).expect("finite");
            }
            let saved = simulation.save(&from_scenario).expect("a state");
            let speed_m_s = simulation.observation().twist.vx_m_s;
            assert!(speed_m_s > 0.15, "{from}: {speed_m_s}");
            for to in POLICIES {
                let mut simulation = Simulation::resume(&from_scenario, &saved).expect("a snapshot");
                let case = format!("{from} to {to}, {surroundings:?}");
                let before = simulation.sample().command.vx_m_s;
                simulation
                    .take_control(&scenario.with_policy(to).expect("a policy"))
                    .unwrap_or_else(|error| panic!("{case}: {error}"));
                simulation.step(&simulation.scenario_command()).expect("finite");
                let after = simulation.sample().command.vx_m_s;
                assert!(
                    (after - before).abs() < 0.01,
                    "{case}: command {before} to {after}"
                );
                // Integrals that start at 0 may cost the friction of the gears for a moment: the speed falls by no more than a tenth.
                // The vehicle still speeds up by a thousandth of its speed; nothing else changes it on level ground.
                for _ in 0..500 {
                    simulation.step(&simulation.scenario_command()).expect("finite");
                    let now_m_s = simulation.observation().twist.vx_m_s;
                    assert!(
                        (now_m_s / speed_m_s - 1.0).abs() < 0.01,
                        "{case}: {speed_m_s} to {now_m_s}"
                    );
                }
            }
        }
    }
}
