//! Vehicles other than the paper's are files, not code: each follows its commands and stands as its masses say.

use omni_sim::config::{Engine, Override, Scenario};
use omni_sim::{Trace, run};

use crate::engines::{engine, load, on_both_engines};

/// A vehicle on flat ground under one command.
fn drive(vehicle: &str, [vx, vy, wz]: [f64; 3], duration_s: f64) -> (Scenario, Trace) {
    let overrides = [
        Override::new("vehicle", vehicle),
        Override::new("duration_s", duration_s),
        Override::new("command.vx_m_s", vx),
        Override::new("command.vy_m_s", vy),
        Override::new("command.wz_rad_s", wz),
    ];
    let scenario = load("flat", &overrides).expect("valid");
    let trace = run(&scenario).expect("runs");
    (scenario, trace)
}

fn last(trace: &Trace, column: &str) -> f64 {
    *trace.column(column).expect("a column").last().expect("a row")
}

fn each_vehicle_follows_every_direction_on_flat_ground() {
    for vehicle in ["omni3", "mecanum4", "rocker_bogie6"] {
        for command in [
            [0.3, 0.0, 0.0],
            [0.0, 0.3, 0.0],
            [0.0, 0.0, 0.8],
            [0.2, -0.2, 0.5],
        ] {
            let (_, trace) = drive(vehicle, command, 3.0);
            for (column, wanted) in ["twist_vx_m_s", "twist_vy_m_s", "twist_wz_rad_s"]
                .into_iter()
                .zip(command)
            {
                let got = last(&trace, column);
                // The integral has settled (10 time constants); creep of contacts and the circle's
                // centripetal slip stay.
                assert!(
                    (got - wanted).abs() < 0.005,
                    "{vehicle} {command:?}: {column} {got}"
                );
            }
            // The encoders measure the same motion: nothing slips.
            for (estimated, actual) in [
                ("estimated_vx_m_s", "twist_vx_m_s"),
                ("estimated_vy_m_s", "twist_vy_m_s"),
            ] {
                let (e, a) = (last(&trace, estimated), last(&trace, actual));
                assert!(
                    (e - a).abs() < 0.005,
                    "{vehicle} {command:?}: {estimated} {e}, {actual} {a}"
                );
            }
        }
    }
}

/// Loads of wheels that stand on the ground, by balance of force and of moments about both axes; `share` of the base.
fn assert_loads(vehicle: &str, expected_n: &[f64]) {
    let (_, trace) = drive(vehicle, [0.0; 3], 1.5);
    assert_trace_loads(vehicle, &trace, expected_n);
}

fn assert_trace_loads(vehicle: &str, trace: &Trace, expected_n: &[f64]) {
    for (wheel, expected) in expected_n.iter().enumerate() {
        let column = trace.wheel("force_normal_n", wheel).expect("a column");
        let tail = &column[column.len() - 500..];
        let mean = tail.iter().sum::<f64>() / tail.len() as f64;
        // Half a per cent: what contacts of 200 Hz still swing after a second.
        assert!(
            (mean / expected - 1.0).abs() < 0.005,
            "{vehicle}, wheel {wheel}: {mean}, {expected}"
        );
    }
}

fn three_wheels_carry_what_the_moment_balance_says() {
    // Wheels at 0.18 m and 0, 120, 240 degrees: n1 0.18 - (n2 + n3) 0.09 = 6 g 0.02 with n1 + n2 +
    // n3 = 6 g, and their own 0.4 g.
    let (g, base, own) = (9.81, 6.0, 0.4);
    let ahead = base * g * (0.02 + 0.09) / 0.27;
    let behind = (base * g - ahead) / 2.0;
    assert_loads("omni3", &[ahead + own * g, behind + own * g, behind + own * g]);
}

fn four_wheels_under_a_symmetric_platform_carry_a_quarter_each() {
    assert_loads("mecanum4", &[24.0 * 9.81 / 4.0; 4]);
}

fn a_rocker_bogie_shares_its_weight_as_its_levers_say() {
    // A bogie's hinge is midway between its wheels and its own weight is there: both carry n. The whole vehicle, 16 kg,
    // about y at x = 0: 2 f 0.30 - 4 n 0.15 = g (8 x 0.02 + 2 x 1.2 x 0.10 - 2 x 1.0 x 0.15), and 2 f + 4 n = 16 g.
    let (g, moment) = (9.81, 9.81 * (0.16 + 0.24 - 0.30));
    let n = (16.0 * g - moment / 0.30) / 6.0;
    let front = n + moment / 0.60;
    assert_loads("rocker_bogie6", &[front, front, n, n, n, n]);
}

fn loads_that_check_prints_are_those_that_the_ground_gives() {
    // Balance alone, and where it leaves the loads open equally stiff contacts: what is simulated.
    // Half a per cent as above.
    for vehicle in ["chugo7", "omni3", "mecanum4", "rocker_bogie6"] {
        let (scenario, _) = drive(vehicle, [0.0; 3], 0.01);
        let loads = scenario.vehicle().static_loads_n(9.81).expect("it stands");
        assert_loads(vehicle, &loads);
    }
}

/// The loads of a vehicle at rest with keys of its own are those that `check` prints, and differ from those without.
fn assert_shared(keys: &[(&str, f64)], expected_n: [f64; 3]) {
    let still = [("duration_s", 1.5), ("command.vx_m_s", 0.0)];
    let keys: Vec<_> = still
        .iter()
        .chain(keys)
        .map(|(key, value)| Override::new(*key, *value))
        .collect();
    let scenario = load("flat", &keys).expect("valid");
    let loads = scenario.vehicle().static_loads_n(9.81).expect("it stands");
    for (load, expected) in loads[4..].iter().zip(expected_n) {
        assert!((load - expected).abs() < 1e-6, "{loads:?}, {expected_n:?}");
    }
    assert_trace_loads("chugo7", &run(&scenario).expect("runs"), &loads);
}

fn a_preload_moves_the_load_of_a_row_by_two_thirds_of_itself() {
    // The front row carries 64.746 N on wheels 5, 6, 7, alike: a third each. Wheel 6 is mounted
    // lower by p / k, and the row sinks less for it: it gets p - p / 3 more.
    let row = 9.81 * (6.0 * 0.18 + 3.0 * 0.30) / 0.30;
    let preload = -12.0;
    let outer = row / 3.0 - preload / 3.0;
    assert_shared(
        &[("vehicle.wheel.5.preload_n", preload)],
        [outer, row / 3.0 + 2.0 / 3.0 * preload, outer],
    );
}

fn a_softer_contact_takes_less_of_its_row() {
    if engine() == Engine::Rapier {
        // Its contacts are as stiff as what they push is heavy, all by one frequency: it says that it cannot.
        let key = Override::new("vehicle.wheel.5.contact_stiffness_n_m", 1e6);
        let error = load("flat", &[key]).expect_err("refused").to_string();
        assert!(error.ends_with("vehicle.wheel[5].contact_stiffness_n_m: 1000000, allowed: only with physics.engine = \"articulated\""), "{error}");
        return;
    }
    // A quarter as stiff as the other two: a ninth of the row.
    let row = 9.81 * (6.0 * 0.18 + 3.0 * 0.30) / 0.30;
    let keys = [4, 5, 6].map(|i| format!("vehicle.wheel.{i}.contact_stiffness_n_m"));
    let keys = [
        (keys[0].as_str(), 2e6),
        (keys[1].as_str(), 5e5),
        (keys[2].as_str(), 2e6),
    ];
    assert_shared(&keys, [4.0, 1.0, 4.0].map(|part| part / 9.0 * row));
}

fn mecanum_wheels_accelerate_a_vehicle_as_their_rollers_angle_says() {
    // Each wheel at its limit pushes with tau / (r cos 45) along its roller, tau / r of it forward:
    // 4 tau / r in all. What is accelerated is the mass and the wheels' inertia at the rim, which
    // move with v / r. rapier's balls add their cost: a ball spins freely across the push too, with
    // an inertia of I / cos^2 of 45 degrees, as much again as the wheel's own.
    let turning = if engine() == Engine::Rapier { 2.0 } else { 1.0 };
    let (limit, r) = (0.5, 0.076);
    let overrides = [
        Override::new("vehicle", "mecanum4"),
        Override::new("duration_s", 0.2),
        Override::new("command.vx_m_s", 1.0),
        Override::new("command.ramp_s", 0.0),
        Override::new("vehicle.motor.stall_torque_n_m", limit),
        Override::new("vehicle.motor.slope_n_m_s_rad", 0.0),
        Override::new("control.policy", "independent"),
    ];
    let trace = run(&load("flat", &overrides).expect("valid")).expect("runs");
    assert_eq!(trace.wheel("applied_n_m", 0).expect("a column")[150], limit);
    let v = trace.column("twist_vx_m_s").expect("a column");
    let measured = (v[180] - v[80]) / 0.1;
    let expected = 4.0 * limit / r / (24.0 + turning * 4.0 * 0.0035 / (r * r));
    assert!((measured / expected - 1.0).abs() < 0.01, "{measured}, {expected}");
}

on_both_engines! {
    each_vehicle_follows_every_direction_on_flat_ground,
    three_wheels_carry_what_the_moment_balance_says,
    four_wheels_under_a_symmetric_platform_carry_a_quarter_each,
    a_rocker_bogie_shares_its_weight_as_its_levers_say,
    loads_that_check_prints_are_those_that_the_ground_gives,
    mecanum_wheels_accelerate_a_vehicle_as_their_rollers_angle_says,
    a_preload_moves_the_load_of_a_row_by_two_thirds_of_itself,
    a_softer_contact_takes_less_of_its_row,
}
