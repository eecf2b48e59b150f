//! A simulation saved and resumed goes on bit for bit.

use omni_sim::config::{Override, Scenario};
use omni_sim::controller::ControlSample;
use omni_sim::observation::Observation;
use omni_sim::{Error, Simulation};

use crate::engines::{load, on_both_engines};

/// A climb with everything that has a state: noise, delay, lag, faults, heading hold.
fn scenario() -> Scenario {
    let overrides = [
        "sensors={ encoder_counts = 8192, encoder_noise_rad_s = 0.05, delay_s = 0.002, gyro_noise_rad_s = 0.01 }",
        "actuators={ torque_lag_s = 0.005, voltage_sag = 0.1 }",
        "heading_hold={ gain_per_s = 2.0, limit_rad_s = 0.3 }",
        "odometry.kind=ground",
        "perturbation.yaw_rad=0.02",
        "seed=7",
        r#"fault=[{ kind = "load_added", body = "front", mass_kg = 1.0, at_m = [0.1, 0.0, 0.2], from_s = 1.0 }]"#,
    ];
    let overrides: Vec<_> = overrides
        .iter()
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    load("step", &overrides).expect("valid")
}

fn step(simulation: &mut Simulation) -> (ControlSample, Observation) {
    let command = simulation.scenario_command();
    simulation.step(&command).expect("finite");
    (simulation.sample().clone(), simulation.observation().clone())
}

fn a_snapshot_of_any_period_resumes_bit_for_bit() {
    let scenario = scenario();
    let mut simulation = Simulation::new(&scenario).expect("valid");
    let mut saved = Vec::new();
    let mut history = Vec::new();
    for k in 0..2600 {
        // At the start, before and after the load, at the riser, in the climb.
        if [0, 1, 700, 999, 1000, 1001, 1400, 1777, 2300].contains(&k) {
            saved.push((k, simulation.save(&scenario).expect("saved")));
        }
        history.push(step(&mut simulation));
    }
    for (k, bytes) in saved {
        let mut resumed = Simulation::resume(&scenario, &bytes).expect("a snapshot");
        for (ahead, expected) in history[k..].iter().enumerate().take(300) {
            assert_eq!(
                &step(&mut resumed),
                expected,
                "saved at period {k}, {ahead} periods later"
            );
        }
        // The same bytes again: nothing is lost in between.
        let again = Simulation::resume(&scenario, &bytes).expect("a snapshot");
        assert_eq!(again.save(&scenario).expect("saved"), bytes, "period {k}");
    }
}

#[test]
fn a_snapshot_of_another_scenario_or_a_damaged_one_is_refused_by_name() {
    let scenario = scenario();
    let mut simulation = Simulation::new(&scenario).expect("valid");
    step(&mut simulation);
    let bytes = simulation.save(&scenario).expect("saved");
    let refused = |scenario: &Scenario, bytes: &[u8]| match Simulation::resume(scenario, bytes) {
        Err(Error::Snapshot { reason }) => reason,
        other => panic!("{:?}", other.map(|_| "resumed")),
    };
    let other = load("step", &[]).expect("built in");
    assert_eq!(refused(&other, &bytes), "it belongs to another scenario");
    assert_eq!(refused(&scenario, b""), "it is not a snapshot");
    assert_eq!(
        refused(&scenario, &bytes[..bytes.len() / 2]),
        "it is damaged: its checksum is wrong"
    );
}

/// Every bit that is flipped is noticed: of 3000 in every engine none is resumed. CRC-32 finds any
/// single one, and whatever is cut off or in another place but for one in 4e9.
fn no_damaged_snapshot_is_resumed() {
    let scenario = scenario();
    let mut simulation = Simulation::new(&scenario).expect("valid");
    (0..20).for_each(|_| _ = step(&mut simulation));
    let bytes = simulation.save(&scenario).expect("saved");
    let refused = |damaged: &[u8]| {
        matches!(
            Simulation::resume(&scenario, damaged),
            Err(Error::Snapshot { .. })
        )
    };
    let bits = 8 * bytes.len();
    for k in 0..3000 {
        let bit = k * bits / 3000 + k % 8;
        let mut damaged = bytes.clone();
        damaged[bit / 8 % bytes.len()] ^= 1 << (bit % 8);
        assert!(refused(&damaged), "bit {bit} of {bits}");
    }
    for k in 1..100 {
        let cut = k * bytes.len() / 100;
        assert!(refused(&bytes[..cut]) && refused(&bytes[cut..]), "cut at {cut}");
        let mut turned = bytes.clone();
        turned.rotate_left(cut);
        assert!(refused(&turned), "turned by {cut}");
    }
    assert!(refused(&[&bytes[..], b"more"].concat()));
}

on_both_engines! {
    no_damaged_snapshot_is_resumed,
    a_snapshot_of_any_period_resumes_bit_for_bit,
}
