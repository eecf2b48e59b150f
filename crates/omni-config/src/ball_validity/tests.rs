//! Which wheels balls represent, and where.

use super::BALL_LEAN_RAD;
use crate::{Override, Scenario, WheelModel, builtin_scenarios, builtin_vehicles};

/// Largest lean in degrees where balls, which are asked for, are not the wheels; none if they are.
fn lean_deg(scenario: &str, sets: &[&str]) -> Option<f64> {
    let keys: Vec<_> = ["physics.wheel_model=ball"]
        .iter()
        .chain(sets)
        .map(|set| Override::parse(set).expect("key=value"))
        .collect();
    let scenario = Scenario::load(scenario, &keys).expect("valid");
    scenario.beyond_balls().map(|beyond| beyond.lean_rad.to_degrees())
}

#[test]
fn balls_are_the_wheels_of_every_vehicle_on_flat_ground() {
    for vehicle in builtin_vehicles() {
        for scenario in ["flat", "ice"] {
            assert_eq!(
                lean_deg(scenario, &[&format!("vehicle={vehicle}")]),
                None,
                "{vehicle}"
            );
        }
    }
}

#[test]
fn balls_are_the_wheels_of_chugo7_in_every_built_in_scenario_but_across_steep_hills() {
    // Five omni wheels roll straight at the obstacle; two are transverse, meet it with a roller and do not have to
    // push.
    for scenario in builtin_scenarios()
        .into_iter()
        .filter(|name| *name != "height_map")
    {
        assert_eq!(lean_deg(scenario, &[]), None, "{scenario}");
    }
    // The hills' steepest pixels rise by 16.8 degrees, to the side too: measured with another reader of the picture.
    let hills = lean_deg("height_map", &[]).expect("steep sideways");
    assert!((hills - 16.84).abs() < 0.05, "{hills}");
}

#[test]
fn without_a_model_by_name_wheels_have_rollers_where_balls_are_not_the_wheels() {
    for (vehicle, scenario) in builtin_vehicles()
        .into_iter()
        .flat_map(|vehicle| builtin_scenarios().into_iter().map(move |each| (vehicle, each)))
    {
        let key = format!("vehicle={vehicle}");
        let keys = [Override::parse(&key).expect("key=value")];
        let Ok(auto) = Scenario::load(scenario, &keys) else {
            continue; // a drive of other wheels
        };
        let rollers = auto.wheel_model() == WheelModel::Rollers;
        assert_eq!(
            rollers,
            lean_deg(scenario, &[&key]).is_some(),
            "{vehicle} {scenario}"
        );
        assert_eq!(auto.beyond_balls(), None, "{vehicle} {scenario}");
    }
}

#[test]
fn rollers_are_never_called_what_they_are_not() {
    for vehicle in ["chugo7", "omni3", "mecanum4"] {
        let keys = [&format!("vehicle={vehicle}"), "physics.wheel_model=rollers"];
        assert_eq!(lean_deg("step", &keys), None, "{vehicle}");
    }
}

#[test]
fn a_mecanum_ball_leans_by_the_sine_of_the_edge_times_that_of_its_farther_axis() {
    // An edge of height h meets a ball of radius r where its normal leans by acos(1 - h / r).
    let of = |heading: f64, height: f64| {
        let keys = [
            "vehicle=mecanum4".to_owned(),
            format!("start.heading_rad={heading}"),
            format!("terrain.height_m={height}"),
        ];
        lean_deg("step", &keys.each_ref().map(String::as_str))
    };
    let edge = |height: f64| (1.0 - (1.0 - height / 0.076_f64).powi(2)).sqrt();
    for height in [0.01, 0.02, 0.05] {
        // Head-on the driven axis is at 45 degrees to the edge's, side-on the axle points at the edge.
        for (heading, sine) in [(0.0, 0.5_f64.sqrt()), (std::f64::consts::FRAC_PI_2, 1.0)] {
            let expected = (edge(height) * sine).asin().to_degrees();
            let lean = of(heading, height).expect("mecanum at an edge");
            assert!(
                (lean - expected).abs() < 1e-6,
                "{height} m, {heading}: {lean}, {expected}"
            );
        }
    }
    // 10 degrees head-on are an edge of 2.3 mm.
    let most = 0.076 * (1.0 - (1.0 - 2.0 * BALL_LEAN_RAD.sin().powi(2)).sqrt());
    assert_eq!(of(0.0, 0.99 * most), None);
    assert!(of(0.0, 1.01 * most).is_some());
}

#[test]
fn an_omni_ball_is_the_wheel_within_ten_degrees_of_straight_ahead() {
    let at = |heading: f64| lean_deg("step", &[&format!("start.heading_rad={heading}")]);
    assert_eq!(at(0.17), None);
    assert!(at(0.19).is_some_and(|lean| lean < 12.0));
    assert!(at(std::f64::consts::FRAC_PI_2).is_some_and(|lean| lean > 60.0));
    assert_eq!(lean_deg("step", &["perturbation.yaw_rad=0.03"]), None);
    assert!(lean_deg("step", &["perturbation.yaw_rad=0.3"]).is_some());
    // A vehicle that turns meets the edge at any angle; one that goes sideways needs the transverse wheels to push.
    assert!(lean_deg("step", &["command.wz_rad_s=0.1"]).is_some());
    assert!(lean_deg("step", &["command.vy_m_s=0.1"]).is_some());
    // Wheels of three at 120 degrees, and corner wheels at 45, are met aslant.
    for vehicle in ["omni3", "rocker_bogie6"] {
        assert!(
            lean_deg("step", &[&format!("vehicle={vehicle}")]).is_some(),
            "{vehicle}"
        );
    }
}

#[test]
fn the_ground_leans_by_what_its_keys_say() {
    let lean =
        |scenario: &str, set: &str| lean_deg(scenario, &["vehicle=mecanum4", "terrain.start_x_m=1", set]);
    let ramp = |slope: f64| lean("ramp", &format!("terrain.slope_rad={slope}"));
    assert_eq!(ramp(0.2), None); // 11 degrees, seen at 45
    let steep = ramp(0.5).expect("steep");
    assert!((steep - (0.5_f64.sin() * 0.5_f64.sqrt()).asin().to_degrees()).abs() < 1e-6);
    assert!(lean("bumps", "terrain.height_m=0.01").is_some());
    assert_eq!(lean("bumps", "terrain.height_m=0.0005"), None);
    assert!(lean("ditch", "terrain.width_m=0.06").is_some());
    assert_eq!(lean("ditch", "terrain.width_m=0.01"), None); // it sinks by 0.2 mm
    assert_eq!(lean("rough", "terrain.rms_m=0.005"), None);
    assert!(lean("rough", "terrain.rms_m=0.03").is_some());
    assert!(lean("height_map", "terrain.white_height_m=0.5").is_some());
    assert_eq!(lean("height_map", "terrain.white_height_m=0.01"), None);
}
