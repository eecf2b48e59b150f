//! The torque that a row needs where it touches a step, by statics, against a vehicle that meets one slowly.

use omni_bound::{Step, touch};
use omni_config::Vehicle;
use omni_sim::Verdict;
use omni_sim::config::{Override, Scenario};
use omni_sim::run;

/// The row at which a `mecanum4` with rollers stalls at an edge of 16 mm with that torque: none where it goes over.
fn stalls_at(torque_n_m: f64) -> Option<usize> {
    let keys = [
        "vehicle=mecanum4".to_owned(),
        "physics.engine=articulated".into(),
        "physics.wheel_model=rollers".into(),
        "control.policy=independent".into(),
        "command.vx_m_s=0.1".into(), // a run-up of 0.1 J at most, a fiftieth of what the front lifts
        "terrain.height_m=0.016".into(),
        "duration_s=25".into(),
        "stop_when_done=true".into(),
        format!("vehicle.motor.stall_torque_n_m={torque_n_m}"),
        "vehicle.motor.slope_n_m_s_rad=0".into(),
    ];
    let keys: Vec<_> = keys
        .iter()
        .map(|key| Override::parse(key).expect("KEY=VALUE"))
        .collect();
    let trace = run(&Scenario::load("step", &keys).expect("valid")).expect("runs");
    let outcome = trace.outcome();
    assert!(
        outcome.climbed || outcome.verdict == Verdict::Stalled,
        "{:?}",
        outcome.verdict
    );
    outcome.stalled_row
}

#[test]
fn a_row_stalls_below_the_torque_of_statics_and_lifts_above_it() {
    let vehicle = Vehicle::load("mecanum4").expect("built in");
    let rows = touch(&vehicle, &Step::new(0.016, 0.7).expect("valid"))
        .expect("valid")
        .expect("rigid, on two rows");
    let [front, rear] = [0, 1].map(|row: usize| rows[row].torque_n_m);
    // 3 %: what statics leaves out, as the run-up, the vehicle's lean of 2 degrees, and contacts
    // that give by half a millimetre.
    assert_eq!(stalls_at(0.97 * front), Some(1), "the front row below {front}");
    assert_eq!(
        stalls_at(1.03 * front),
        Some(2),
        "the rear row below {rear}, the front row is over"
    );
    assert_eq!(stalls_at(0.97 * rear), Some(2), "the rear row below {rear}");
    assert_eq!(stalls_at(1.05 * rear), None, "over with more than {rear}");
}
