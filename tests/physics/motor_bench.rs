//! Section 3.3 of the paper: three motors on dampers (docs/paper.md).

use omni_sim::config::{MotorBench, Override};
use omni_sim::{MotorBenchTrace, run_motor_bench};

fn run(policy: &str, friction_n_m_s_rad: f64) -> MotorBenchTrace {
    let friction = Override::new("friction_n_m_s_rad", friction_n_m_s_rad);
    let experiment = MotorBench::load("motor_bench", &[friction]).expect("built-in experiment");
    run_motor_bench(&experiment, policy).expect("a policy for wheels")
}

/// Largest minus smallest of three speeds \[rpm\].
fn spread([a, b, c]: [f64; 3]) -> f64 {
    a.max(b).max(c) - a.min(b).min(c)
}

#[test]
fn with_scaled_references_wheels_converge_on_the_speed_of_the_most_loaded_one() {
    let trace = run("scale_references", 0.0);
    // Speeds at which the load's torque equals eq. (13), friction 0: B 91.999, C 76.891, A 96.751 rpm.
    // 0.2 rpm covers the end of the transient (at 54 s wheel B, just unloaded, is 0.08 rpm above).
    for (time_s, rpm) in [
        (4.0, 100.0),
        (13.0, 100.0),
        (20.0, 92.0),
        (30.0, 76.89),
        (45.0, 76.89),
        (54.0, 76.89),
        (59.9, 96.75),
        (64.0, 100.0),
    ] {
        for speed in trace.speeds_at(time_s) {
            assert!(
                (speed - rpm).abs() < 0.2,
                "at {time_s} s: {:?}, expected {rpm}",
                trace.speeds_at(time_s)
            );
        }
    }
    // A load that the motor can hold costs no speed: 0.1 rpm is a transient of half a second after 5 s.
    assert!(
        trace
            .speeds_at(6.5)
            .iter()
            .all(|speed| (speed - 100.0).abs() < 0.2)
    );
}

#[test]
fn literal_equation_12_does_not_converge() {
    let trace = run("scale_torques", 0.0);
    let [a, _, c] = trace.speeds_at(45.0);
    assert!(
        a - c > 5.0,
        "A {a} and C {c} rpm at 45 s: the paper reports one speed"
    );
    let late = (0..trace.t_s.len()).filter(|k| trace.t_s[*k] > 53.0);
    let widest = late.map(|k| spread(trace.speed_rpm.row(k))).fold(0.0, f64::max);
    assert!(widest > 50.0, "released wheels run apart by {widest} rpm");
}

#[test]
fn independent_wheels_each_settle_on_their_own_load() {
    let trace = run("independent", 0.0);
    for (got, expected) in trace.speeds_at(30.0).iter().zip([100.0, 92.0, 76.89]) {
        assert!((got - expected).abs() < 0.2, "{:?}", trace.speeds_at(30.0));
    }
}

#[test]
fn friction_of_2e_4_gives_back_the_table_checked_by_two_independent_programs() {
    let times = [13.0, 20.0, 30.0, 45.0, 54.0, 59.9, 64.0];
    let literal = [
        [100.0, 100.0, 100.0],
        [99.5, 91.1, 99.5],
        [99.3, 86.7, 76.3],
        [85.5, 86.3, 76.3],
        [8.7, 113.1, 6.4],
        [5.9, 94.5, 113.1],
        [64.0, 63.2, 113.1],
    ];
    let shared = [
        [100.0; 3], [91.1; 3], [76.3; 3], [76.3; 3], [76.3; 3], [95.8; 3], [100.0; 3],
    ];
    for (policy, table) in [("scale_torques", literal), ("scale_references", shared)] {
        let trace = run(policy, 2e-4);
        for (time_s, expected) in times.into_iter().zip(table) {
            for (got, expected) in trace.speeds_at(time_s).iter().zip(expected) {
                // The table is rounded to 0.1; at 59.9 s wheel B is falling at 25 rpm/s, 0.06 rpm
                // in a few milliseconds.
                assert!(
                    (got - expected).abs() < 0.12,
                    "{policy} at {time_s} s: {got}, expected {expected}"
                );
            }
        }
    }
}
