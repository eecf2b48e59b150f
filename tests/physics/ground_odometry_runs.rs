//! Odometry in three dimensions in a run: its columns, whatever the control period, and what traction control makes of
//! its edges.

use omni_sim::config::{Override, Scenario};

use crate::ground_odometry::IMPERFECT;

/// A scenario's run with the simulator's sensors as bought; `command` begins after 3 s of rest.
fn with_sensors(scenario: &str, keys: &[&str]) -> omni_sim::Trace {
    let rests = "command={ vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 0.0, then = [{ at_s = 3.0, vx_m_s = 0.3, vy_m_s = 0.0, wz_rad_s = 0.0, ramp_s = 0.3 }] }";
    let biases = [
        "sensors.gyro_bias_rad_s=0.003",
        "sensors.accelerometer_bias_m_s2=0.05",
        "sensors.attitude_bias_rad=0.003",
        "sensors.encoder_counts=4096",
        "physics.engine=articulated",
        "physics.wheel_model=rollers",
        "control.policy=traction",
        "duration_s=12",
        rests,
    ];
    let all = IMPERFECT.iter().chain(&biases).chain(keys);
    let all: Vec<_> = all.map(|key| Override::parse(key).expect("KEY=VALUE")).collect();
    let scenario = Scenario::load(scenario, &all).expect("valid");
    omni_sim::run(&scenario).expect("it runs")
}

fn last(trace: &omni_sim::Trace, column: &str) -> f64 {
    trace
        .column(column)
        .and_then(<[f64]>::last)
        .copied()
        .expect(column)
}

#[test]
fn a_run_reports_height_attitude_and_edges_and_its_pose_is_nearer_than_by_the_wheels() {
    for vehicle in ["chugo7", "mecanum4", "rocker_bogie6"] {
        let run = |kind: &str| {
            let vehicle = format!("vehicle={vehicle}");
            let kind = format!("odometry.kind={kind}");
            with_sensors("step", &["terrain.height_m=0.02", &vehicle, &kind])
        };
        let off = |trace: &omni_sim::Trace, axis: &str| {
            last(trace, &format!("odom_{axis}_m")) - last(trace, &format!("pose_{axis}_m"))
        };
        let (planar, ground) = (run("planar"), run("ground"));
        assert!(planar.column("odom_z_m").is_none());
        assert_eq!(
            planar.column("pose_x_m"),
            ground.column("pose_x_m"),
            "it watches, and does nothing"
        );
        // The gates of the core's odometry, for one drive of 2.7 m.
        assert!(
            off(&ground, "x").abs() < 10e-3,
            "{vehicle}: {}",
            off(&ground, "x")
        );
        assert!(
            off(&ground, "x").abs() < 0.5 * off(&planar, "x").abs(),
            "{vehicle}: {}",
            off(&planar, "x")
        );
        assert!(off(&ground, "z").abs() < 3e-3, "{vehicle}: {}", off(&ground, "z"));
        // 3 mrad of bias, which the rest removes, and a walk of 1 mrad per root of s over 9 s.
        let pitch = last(&ground, "odom_pitch_rad");
        assert!(pitch.abs() < 9e-3, "{vehicle}: {pitch}");
        for wheel in ground.wheel_names() {
            let column = |signal: &str| ground.column(&format!("{signal}_{wheel}")).expect(signal);
            let events = column("ground_edge").iter().zip(column("ground_edge_height_m"));
            let climbed: Vec<_> = events
                .filter(|(kind, _)| **kind == 2.0)
                .map(|(_, height)| *height)
                .collect();
            assert!(
                climbed.len() == 1 && (climbed[0] - 0.02).abs() < 3e-3,
                "{vehicle} {wheel}: {climbed:?}"
            );
            let is_m = column("ground_z_m")[11_999];
            assert!((is_m - 0.02).abs() < 4e-3, "{vehicle} {wheel}: {is_m}");
        }
    }
}

/// The jolt with which the simulation puts the vehicle on its wheels is in the only readings at rest.
#[test]
fn without_a_rest_no_single_reading_is_a_bias_whatever_the_control_period() {
    for period_s in ["0.001", "0.0025", "0.005", "0.01"] {
        let keys = [
            format!("control.period_s={period_s}"),
            "odometry.kind=ground".into(),
            "physics.engine=articulated".into(),
        ];
        let keys = keys.map(|key| Override::parse(&key).expect("KEY=VALUE"));
        let trace = omni_sim::run(&Scenario::load("flat", &keys).expect("valid")).expect("it runs");
        let (height_m, pitch_rad) = (last(&trace, "odom_z_m"), last(&trace, "odom_pitch_rad"));
        // A reading of 0.1 m/s^2 is 10 mrad, and a twentieth of it 0.5 mrad: 0.6 mm over the 1.2 m.
        assert!(
            height_m.abs() < 1e-3 && pitch_rad.abs() < 1e-3,
            "{period_s} s: {height_m} m, {pitch_rad} rad"
        );
    }
}

#[test]
fn an_edge_beyond_what_the_vehicle_climbs_ends_in_one_retry() {
    let run = |climbs: &str, seed: &str| {
        let keys = [
            "terrain.height_m=0.07",
            "odometry.kind=ground",
            "perturbation.start_m=0.03",
            "duration_s=25",
            climbs,
            seed,
        ];
        with_sensors("step", &keys)
    };
    let mut known = 0;
    for seed in ["seed=1", "seed=2", "seed=3"] {
        let trace = run("control.climbs_m=0.055", seed);
        let column = |name: &str| trace.column(name).expect(name);
        let (edge, retries) = (column("traction_edge_m"), column("traction_retries"));
        let Some(found) = edge.iter().position(|edge| *edge > 0.0) else {
            continue; // no wheel got up
        };
        known += 1;
        assert!((edge[found] - 0.07).abs() < 3e-3, "{seed}: {}", edge[found]);
        assert!(last(&trace, "traction_retries") - retries[found] <= 1.0, "{seed}");
        assert_eq!(last(&trace, "traction_mode"), 3.0, "{seed}: it gave up");
        // Without the chart it still tries.
        let without = run("control.climbs_m=1", seed);
        assert!(
            last(&without, "traction_retries") > last(&trace, "traction_retries"),
            "{seed}"
        );
    }
    assert!(known > 0, "no front row got up");
}
