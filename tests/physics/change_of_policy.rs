//! Another policy while the vehicle drives: nothing jumps.

use omni_core::BodyTwist;
use omni_sim::Simulation;
use omni_sim::config::{Override, POLICIES, Scenario};

use crate::engines::load;

/// Level ground, with other keys.
fn flat(surroundings: Option<&str>) -> Scenario {
    let overrides: Vec<_> = (surroundings.iter())
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    load("flat", &overrides).expect("valid")
}

/// Drives as the scenario commands, for so many periods.
fn drive(simulation: &mut Simulation, periods: usize) {
    for _ in 0..periods {
        simulation.step(&simulation.scenario_command()).expect("finite");
    }
}

/// From every policy to every other one, bare and inside a drive: the limited command goes on, and the vehicle with it.
#[test]
fn any_policy_takes_over_from_any_other_while_the_vehicle_drives() {
    for surroundings in [None, Some("drive={}")] {
        let scenario = flat(surroundings);
        for from in POLICIES {
            let from_scenario = scenario.with_policy(from).expect("a policy");
            let mut simulation = Simulation::new(&from_scenario).expect("valid");
            drive(&mut simulation, 1000);
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

/// Torque that has ended at rest stays at 0, and integrals of a drive's loops are not those of before traction control.
#[test]
fn a_change_of_policy_gives_no_torque_that_has_ended() {
    for surroundings in [None, Some("drive={}")] {
        let scenario = flat(surroundings);
        let with = |policy| scenario.with_policy(policy).expect("a policy");
        for [from, to] in [["independent", "traction"], ["traction", "independent"]] {
            let mut simulation = Simulation::new(&with(from)).expect("valid");
            drive(&mut simulation, 1000);
            for _ in 0..2000 {
                simulation.step(&BodyTwist::ZERO).expect("finite");
            }
            for policy in [from, to, from] {
                simulation.take_control(&with(policy)).expect("a policy");
                simulation.step(&BodyTwist::ZERO).expect("finite");
                for wheel in &simulation.sample().wheels {
                    let case = format!("{from}, {policy}, {surroundings:?}");
                    assert_eq!((wheel.applied_n_m, wheel.i_n_m), (0.0, 0.0), "{case}");
                }
            }
        }
        // A tenth of a second after the start no loop is at rest; what it held before traction control is gone.
        let mut simulation = Simulation::new(&with("independent")).expect("valid");
        drive(&mut simulation, 100);
        let held = simulation.sample().wheels[0].i_n_m;
        for policy in ["traction", "independent"] {
            simulation.take_control(&with(policy)).expect("a policy");
            simulation.step(&simulation.scenario_command()).expect("finite");
        }
        let now = simulation.sample().wheels[0].i_n_m;
        assert!(
            held > 0.01 && now.abs() < 0.1 * held,
            "{surroundings:?}: {held} to {now}"
        );
    }
}

/// What happens without the controller says nothing of the motion: traction control begins with that of the encoders.
#[test]
fn traction_control_takes_over_after_torques_without_the_controller() {
    let scenario = flat(None);
    let mut simulation =
        Simulation::new(&scenario.with_policy("independent").expect("a policy")).expect("valid");
    drive(&mut simulation, 1000);
    let torques: Vec<_> = simulation.sample().wheels.iter().map(|w| w.applied_n_m).collect();
    simulation.step_torques(&torques).expect("finite");
    let traction = scenario.with_policy("traction").expect("a policy");
    simulation.take_control(&traction).expect("a policy");
    for _ in 0..200 {
        simulation.step(&simulation.scenario_command()).expect("finite");
        assert!(
            simulation
                .sample()
                .wheels
                .iter()
                .all(|w| w.applied_n_m.is_finite())
        );
    }
    let speed_m_s = simulation.observation().twist.vx_m_s;
    assert!((speed_m_s - 0.3).abs() < 0.003, "{speed_m_s}");
}
