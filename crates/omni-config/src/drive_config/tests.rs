use omni_core::Kinematics;
use omni_core::drive::{Expectation, FaultMonitor, FaultState};

use super::*;
use crate::Override;

/// The built-in mecanum vehicle with a control period of 10 ms and 1024 counts per turn: a count reads as 0.61 rad/s.
fn coarse() -> Scenario {
    let keys = [
        "vehicle=mecanum4",
        "control.period_s=0.01",
        "sensors.encoder_counts=1024",
        "drive={}",
    ];
    let keys = keys.map(|key| Override::parse(key).expect("KEY=VALUE"));
    Scenario::load("flat", &keys).expect("valid")
}

/// Wheels that a monitor with this threshold calls faulty: for each of them, and each way in which the readings of the
/// others can toggle by a count, they all toggle while its own reading stays.
fn blamed(stuck_rad_s: f64) -> usize {
    let scenario = coarse();
    let count_rad_s = scenario.encoder_step_rad_s().expect("it counts");
    let kinematics = Kinematics::<f64, 4>::new(&scenario.vehicle().layout().expect("valid")).expect("sound");
    let mut faults = scenario.drive_faults().expect("it has a [drive]");
    faults.stuck_rad_s = Some(stuck_rad_s);
    let monitor = FaultMonitor::new(faults.config(scenario.period_s())).expect("valid");
    let mut blamed = 0;
    for wheel in 0..4 {
        let rest = kinematics.excluding(&std::array::from_fn(|i| i == wheel));
        let rest = rest.expect("three wheels determine the motion");
        for up in 0..16_u32 {
            let mut state = FaultState::<f64, 4>::default();
            // Twenty periods: twice those of evidence that make a reading stuck.
            for k in 0..21 {
                let read: [f64; 4] = std::array::from_fn(|i| {
                    let toggled = i != wheel && (up >> i & 1 == 1) == (k > 0);
                    count_rad_s * if toggled { 18.0 } else { 17.0 }
                });
                let by_others = rest.inverse(&rest.forward(&read.into()));
                let expected = Expectation {
                    by_others: &by_others,
                    checked: &std::array::from_fn(|i| i == wheel),
                    reference: &read.into(),
                    torque_n_m: &[0.0; 4],
                };
                monitor.step(&mut state, &read.map(Some), &expected);
            }
            blamed += usize::from(state.faults()[wheel].is_some());
        }
    }
    blamed
}

#[test]
fn mecanum_wheels_of_coarse_encoders_are_not_called_stuck_when_all_others_toggle() {
    let count_rad_s = coarse().encoder_step_rad_s().expect("it counts");
    let usual_rad_s = coarse().drive_faults().and_then(|faults| faults.stuck_rad_s);
    assert!((usual_rad_s.expect("set") / count_rad_s - 3.5).abs() < 1e-9);
    assert_eq!(blamed(usual_rad_s.expect("set")), 0);
    // Two counts are too few: a drive of 0.5 m/s on level ground lost a sound wheel by it.
    assert!(blamed(LEAST_COUNTS * count_rad_s) > 0);
}
