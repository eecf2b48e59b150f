//! Odometry as an output of a run: where the wheels have the vehicle, how sure that is, and how far it is off.

use omni_core::{BodyTwist, Kinematics};
use omni_sim::config::{Override, Scenario};
use omni_sim::{Simulation, Trace, run};

use crate::engines::{self, on_the_fast_engine};

fn load(name: &str, overrides: &[&str]) -> Scenario {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    engines::load(name, &overrides).expect("valid")
}

fn trace(name: &str, overrides: &[&str]) -> Trace {
    run(&load(name, overrides)).expect("finite")
}

fn column<'a>(trace: &'a Trace, name: &str) -> &'a [f64] {
    trace.column(name).unwrap_or_else(|| panic!("no column {name}"))
}

fn last(trace: &Trace, name: &str) -> f64 {
    column(trace, name)[trace.rows() - 1]
}

fn where_wheels_roll_odometry_is_the_truth() {
    // Contacts creep: a wheel that is driven or braked turns a little more or less than it rolls, by parts
    // of ten thousand of the way here. A thousandth of it is more than creep, and far less than slip.
    for (name, way_m) in [("flat", 1.15), ("square", 4.0), ("figure_eight", 6.0)] {
        let run = trace(name, &[]);
        let error_m = run.outcome().odometry_error_m;
        assert!(error_m < 0.001 * way_m, "{name}: {error_m} m");
        let turned = last(&run, "odom_yaw_rad") - last(&run, "pose_yaw_rad");
        assert!(turned.abs() < 0.001, "{name}: {turned} rad");
    }
}

fn the_metrics_are_those_of_the_last_row() {
    // On the step the front row is up by then, and the crossing goes on.
    for name in ["flat", "ice", "step"] {
        let run = trace(name, &["duration_s=2.5"]);
        let outcome = run.outcome();
        let [x_m, y_m] = ["x_m", "y_m"]
            .map(|axis| last(&run, &format!("pose_{axis}")) - last(&run, &format!("odom_{axis}")));
        assert_eq!(outcome.odometry_error_m, x_m.hypot(y_m), "{name}");
        assert_eq!(outcome.final_x_m, last(&run, "pose_x_m"));
        assert_eq!(outcome.final_y_m, last(&run, "pose_y_m"));
        assert_eq!(outcome.final_yaw_rad, last(&run, "pose_yaw_rad"));
    }
    // Nothing was measured where the edge was never reached.
    assert!(
        trace("step", &["duration_s=0.2"])
            .outcome()
            .odometry_error_m
            .is_nan()
    );
}

fn wheels_on_ice_deceive_odometry() {
    // At 0.02 the ice gives 0.2 m/s^2: 0.23 m in 1.5 s. Wheels that spin up to 1 m/s show a metre more.
    let overrides = |friction: f64| {
        trace(
            "ice",
            &[
                &format!(
                    "friction_patch=[{{ x_m = [-2.0, 3.0], y_m = [-2.0, 2.0], friction = {friction} }}]"
                ),
                "command.vx_m_s=1.0",
                "command.ramp_s=0.1",
                "duration_s=1.5",
            ],
        )
    };
    let [gripping, on_ice] = [0.7, 0.02].map(|friction| overrides(friction).outcome().odometry_error_m);
    assert!(
        on_ice > 10.0 * gripping && on_ice > 0.5,
        "{on_ice} m, with grip {gripping} m"
    );
}

fn the_covariance_begins_at_nothing_and_grows_as_the_core_says() {
    let run = trace("flat", &["vehicle=mecanum4", "duration_s=3.0"]);
    for name in ["odom_var_x_m2", "odom_var_y_m2", "odom_var_yaw_rad2"] {
        let variances = column(&run, name);
        assert_eq!(variances[0], 0.0, "{name}");
        assert!(
            variances.windows(2).all(|pair| pair[1] >= pair[0]),
            "{name} falls"
        );
        assert!(variances[run.rows() - 1] > 0.0, "{name}");
    }
    // Straight ahead every wheel turns by s / r, is good for a quarter of the way, and off by k^2 s / r:
    // r k^2 s / 4, and residuals of wheels that do not turn quite alike, here less than a fiftieth of it.
    let k = 0.02;
    let radius_m = load("flat", &["vehicle=mecanum4"]).vehicle().wheel[0].radius_m;
    let expected_m2 = radius_m * k * k * last(&run, "odom_x_m") / 4.0;
    let found_m2 = last(&run, "odom_var_x_m2");
    assert!(
        found_m2 > 0.98 * expected_m2 && found_m2 < 1.02 * expected_m2,
        "{found_m2} m^2, by hand {expected_m2} m^2"
    );
}

fn it_begins_where_the_vehicle_is_put() {
    let placed = [
        "start={ x_m = 0.4, y_m = -0.2, heading_rad = 2.0 }",
        "duration_s=1.5",
    ];
    for more in [
        None,
        Some("perturbation={ yaw_rad = 0.1, start_m = 0.05 }"),
        Some("drive={}"),
    ] {
        let overrides: Vec<_> = placed.into_iter().chain(more).collect();
        let scenario = load("flat", &overrides);
        let simulation = Simulation::new(&scenario).expect("a simulation");
        let (seen, odometry) = (simulation.observation(), simulation.observation().odometry);
        let [x_m, y_m, _] = seen.pose.position_m;
        assert_eq!([odometry.pose.x_m, odometry.pose.y_m], [x_m, y_m], "{more:?}");
        assert!(
            (odometry.pose.yaw_rad - seen.pose.yaw_rad()).abs() < 1e-12,
            "{more:?}"
        );
        // 0.4 m on its way: a thousandth of that, as above, and 0.3 mm, a period's way, by which a drive is late.
        let run = run(&scenario).expect("finite");
        assert!(
            run.outcome().odometry_error_m < 0.0004 + 0.0003,
            "{more:?}: {:?}",
            run.outcome()
        );
    }
}

fn a_drives_own_pose_is_the_odometry() {
    let overrides = [
        "drive={}",
        "duration_s=1.0",
        "start={ x_m = 0.5, y_m = 0.1, heading_rad = 1.0 }",
        "command.wz_rad_s=0.3",
    ];
    let run = trace("flat", &overrides);
    let (sin, cos) = 1.0_f64.sin_cos();
    for row in (0..run.rows()).step_by(37) {
        let [x, y, yaw] =
            ["x_m", "y_m", "yaw_rad"].map(|axis| column(&run, &format!("drive_pose_{axis}"))[row]);
        let expected = [0.5 + cos * x - sin * y, 0.1 + sin * x + cos * y, 1.0 + yaw];
        for (axis, expected) in ["x_m", "y_m", "yaw_rad"].into_iter().zip(expected) {
            let found = column(&run, &format!("odom_{axis}"))[row];
            assert!(
                (found - expected).abs() < 1e-12,
                "row {row}: odom_{axis} = {found}, {expected}"
            );
        }
    }
}

fn a_wheel_without_a_reading_is_excluded() {
    // Six of seven wheels determine the motion as well. If a period without a reading were one
    // without motion, half the way would be missing.
    let silent = "fault=[{ kind = \"encoder_silent\", wheel = \"5\", from_s = 1.0, until_s = 3.0 }]";
    let run = trace("flat", &[silent, "duration_s=3.5"]);
    let way_m = last(&run, "pose_x_m");
    assert!(way_m > 0.8, "{way_m} m");
    assert!(
        run.outcome().odometry_error_m < 0.02 * way_m,
        "{:?}",
        run.outcome()
    );
}

fn while_too_few_wheels_determine_the_motion_the_true_pose_stays_inside() {
    // Two wheels of three do not determine it, from 1.0 to 2.0 s; the vehicle drives on, by loops
    // that know nothing of it or in a safe stop.
    let silent = "fault=[{ kind = \"encoder_silent\", wheel = \"1\", from_s = 1.0, until_s = 2.0 }]";
    for more in [None, Some("drive={}")] {
        let keys = ["vehicle=omni3", silent, "duration_s=3.0", "command.wz_rad_s=0.4"];
        let overrides: Vec<_> = keys.into_iter().chain(more).collect();
        let run = trace("flat", &overrides);
        let of = |name: &str| column(&run, name);
        let top = load("flat", &overrides).vehicle().limits.expect("it has limits");
        let (mut outside, mut farthest) = (0, 0.0_f64);
        for row in 0..run.rows() {
            let time_s = of("time_s")[row];
            let off = |truth: &str, odometry: &str| of(truth)[row] - of(odometry)[row];
            let error = [
                off("pose_x_m", "odom_x_m"),
                off("pose_y_m", "odom_y_m"),
                omni_core::Real::wrapped_angle(off("pose_yaw_rad", "odom_yaw_rad")),
            ];
            let variances = ["odom_var_x_m2", "odom_var_y_m2", "odom_var_yaw_rad2"].map(|name| of(name)[row]);
            for (error, variance) in error.iter().zip(variances) {
                // As far as a vehicle at its top speed comes is one deviation; loops overshoot. Of odometry
                // by wheels three, and a millimetre of creep and of a period by which a drive is late.
                let inside = 3.0 * variance.sqrt() + 1e-3;
                assert!(error.abs() < inside, "{more:?}, {time_s} s: {error}, {inside}");
            }
            farthest = farthest.max(error[0].hypot(error[1]));
            // In the midst of it: the top speed times the time, of which the first period may be gone.
            if (1.1..1.95).contains(&time_s) {
                let expected_m = top.vx_m_s.max(top.vy_m_s) * (time_s - 1.0);
                let deviation_m = variances[0].sqrt();
                assert!(
                    (deviation_m - expected_m).abs() < 0.02 * expected_m + 0.01,
                    "{more:?}, {time_s} s: {deviation_m} m, {expected_m} m"
                );
                outside += 1;
            }
        }
        // It did leave it, or nothing was tested.
        assert!(outside > 500, "{outside}");
        assert!(more.is_some() || farthest > 0.1, "{farthest} m");
        // Wheels with readings again do not say where it went.
        assert!(last(&run, "odom_var_x_m2").sqrt() > 0.5 * top.vx_m_s);
    }
}

fn a_snapshot_goes_on_with_the_odometry_it_had() {
    // In the middle of the 10 ms over which turns are gathered for the covariance, and while a wheel is silent.
    let silent = "fault=[{ kind = \"encoder_silent\", wheel = \"4\", from_s = 0.1, until_s = 1.0 }]";
    let scenario = load("flat", &[silent, "command.wz_rad_s=0.4"]);
    let mut simulation = Simulation::new(&scenario).expect("a simulation");
    let step = |simulation: &mut Simulation| {
        simulation
            .step(&simulation.scenario_command())
            .expect("it goes on")
    };
    (0..333).for_each(|_| step(&mut simulation));
    let bytes = simulation.save(&scenario).expect("it can be saved");
    let mut resumed = Simulation::resume(&scenario, &bytes).expect("it can be resumed");
    for _ in 0..50 {
        step(&mut simulation);
        step(&mut resumed);
        assert_eq!(simulation.observation().odometry, resumed.observation().odometry);
    }
    assert!(resumed.observation().odometry.covariance[1][2] != 0.0);
}

on_the_fast_engine! {
    where_wheels_roll_odometry_is_the_truth,
    the_metrics_are_those_of_the_last_row,
    wheels_on_ice_deceive_odometry,
    the_covariance_begins_at_nothing_and_grows_as_the_core_says,
    it_begins_where_the_vehicle_is_put,
    a_drives_own_pose_is_the_odometry,
    a_wheel_without_a_reading_is_excluded,
    while_too_few_wheels_determine_the_motion_the_true_pose_stays_inside,
    a_snapshot_goes_on_with_the_odometry_it_had,
}

/// Way to the left of `mecanum4` with so many rollers a wheel, by odometry over the truth: with the angle of the lowest
/// roller, and with that of all rollers in the mean.
fn sideways(rollers: u32) -> [f64; 2] {
    let keys = [
        "vehicle=mecanum4",
        &format!("vehicle.rollers.count={rollers}"),
        "physics.engine=articulated",
        "physics.wheel_model=rollers",
        "control.policy=scale_references",
    ];
    let scenario = load("flat", &keys);
    let layouts = [scenario.vehicle().layout(), scenario.rolling_layout()];
    let maps = layouts.map(|layout| Kinematics::<f64, 4>::new(&layout.expect("four wheels")).expect("sound"));
    let mut simulation = Simulation::new(&scenario).expect("valid");
    let left = BodyTwist {
        vy_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    let at = |simulation: &Simulation| simulation.observation().pose.position_m[1];
    let (mut start_m, mut ways_m) = (0.0, [0.0; 2]);
    for k in 0..7000 {
        simulation.step(&left).expect("goes on");
        if k == 999 {
            start_m = at(&simulation);
        }
        let increments: [f64; 4] = std::array::from_fn(|wheel| simulation.sensed().increments_rad[wheel]);
        if k > 999 {
            for (way, map) in ways_m.iter_mut().zip(&maps) {
                *way += map.displacement(&increments.into()).dy_m;
            }
        }
    }
    ways_m.map(|way| way / (at(&simulation) - start_m))
}

#[test]
fn a_mecanum_vehicle_moves_sideways_by_less_than_the_angle_of_its_lowest_roller_says() {
    for rollers in [9, 12, 15] {
        let half = std::f64::consts::PI / f64::from(rollers);
        let [lowest, mean] = sideways(rollers);
        // To second order of the angle; the next one is a twentieth of that, and four wheels on different rollers
        // creep.
        let expected = half / half.sin();
        assert!((lowest / expected - 1.0).abs() < 0.002, "{rollers}: {lowest}");
        assert!((mean - 1.0).abs() < 0.002, "{rollers}: {mean}");
    }
}
