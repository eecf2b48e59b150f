//! What is no drive is not called one: runaways, disobedience, leans and gained energy have verdicts of their own.

use omni_core::{Policy, Readings};
use omni_sim::config::{FileKind, Override, Scenario};
use omni_sim::controller::AnyController;
use omni_sim::{Outcome, Run, Simulation, Verdict, outcome_of, run};

use crate::engines::{load, on_the_fast_engine};

fn scenario(name: &str, overrides: &[&str]) -> Scenario {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    load(name, &overrides).expect("valid")
}

fn outcome(name: &str, overrides: &[&str]) -> Outcome {
    *run(&scenario(name, overrides)).expect("runs").outcome()
}

/// On a slope of 10 degrees every motor fails: the vehicle rolls back with 1.6 m/s^2 and has 1 m/s after 0.3 m.
fn rolling_away_without_motors_is_overspeed_unless_it_is_braked_in_time() {
    let failing = |until_s: &str| {
        let faults: Vec<_> = (1..=7)
            .map(|wheel| format!("{{ kind = \"wheel_lost\", wheel = \"{wheel}\", from_s = 6.0{until_s} }}"))
            .collect();
        let faults = format!("fault=[{}]", faults.join(", "));
        outcome("ramp", &["terrain.length_m=4.0", &faults]).verdict
    };
    assert_eq!(failing(""), Verdict::Overspeed);
    // For 0.3 s: 0.48 m/s backwards at the most, 0.1 m/s of it above the bound, and the motors brake at once.
    assert_eq!(failing(", until_s = 6.3"), Verdict::Unfinished);
}

/// The same slope and the same failure, 1.16 m/s at the most: half as fast again as the farthest
/// wheel at the commanded 2 rad/s is more.
fn a_vehicle_that_is_commanded_to_turn_and_slides_off_ran_away() {
    let faults: Vec<_> = (1..=7)
        .map(|wheel| format!("{{ kind = \"wheel_lost\", wheel = \"{wheel}\", from_s = 4.0 }}"))
        .collect();
    let faults = format!("fault=[{}]", faults.join(", "));
    let turn = "command.then=[{ at_s = 4.0, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 2.0 }]";
    let sliding = outcome("ramp", &["terrain.length_m=4.0", &faults, turn]);
    assert_eq!(sliding.verdict, Verdict::Overspeed, "{sliding:?}");
}

fn hills_that_turn_a_vehicle_are_no_runaway_under_any_policy() {
    // Down the hills it goes at 0.4 to 0.5 m/s and turns by 0.24 to 0.46 rad/s; the sum of both was
    // above the bound under shared_integral.
    for policy in [
        "independent",
        "scale_torques",
        "scale_references",
        "shared_integral",
    ] {
        let policy = format!("control.policy={policy}");
        assert_eq!(
            outcome("height_map", &[&policy, "physics.wheel_model=ball"]).verdict,
            Verdict::Climbed,
            "{policy}"
        );
    }
}

/// 10 kg half a metre behind its hinge lift the front frame's wheels off the ground, up to the
/// hinge's stop at 0.9 rad: 52 degrees.
fn a_frame_that_stands_at_its_stop_on_flat_ground_leaned_and_did_not_drive() {
    let load = "fault=[{ kind = \"load_added\", body = \"front\", mass_kg = 10.0, at_m = [-0.5, 0.0, 0.3], from_s = 1.0 }]";
    let leaning = outcome("flat", &[load]);
    assert!(leaning.pitch_peak_deg > 45.0, "{leaning:?}");
    assert_eq!(leaning.verdict, Verdict::Tilted);
}

/// Every wheel of chugo7 towards a speed of the vehicle ahead \[m/s\], whatever is commanded, with
/// at most so much torque \[N.m\].
struct Heedless {
    ahead_m_s: f64,
    most_n_m: f64,
}

impl Policy<f64> for Heedless {
    fn reset(&mut self) {}
    fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
        // Wheels 2 and 6 stand across the way.
        let ahead = [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0];
        for (i, torque) in torques_n_m.iter_mut().enumerate() {
            let off_rad_s = ahead[i] * self.ahead_m_s / 0.066 - readings.wheels_rad_s[i];
            *torque = (0.3 * off_rad_s).clamp(-self.most_n_m, self.most_n_m);
        }
    }
}

fn heedless(ahead_m_s: f64, overrides: &[&str]) -> Outcome {
    let scenario = scenario("flat", overrides);
    let policy = Heedless {
        ahead_m_s,
        most_n_m: 2.0,
    };
    let controller = AnyController::own(&scenario, Box::new(policy)).expect("seven wheels");
    *Run::new(&scenario)
        .controller(controller)
        .trace()
        .expect("runs")
        .outcome()
}

fn a_vehicle_that_drives_back_where_ahead_is_commanded_goes_the_wrong_way() {
    let back = heedless(-0.3, &[]);
    assert_eq!(back.verdict, Verdict::WrongWay, "{back:?}");
    assert!(back.final_x_m < -0.8, "{back:?}");
    // Too slow is another thing than the wrong way.
    assert_eq!(heedless(0.2, &[]).verdict, Verdict::Completed);
}

fn less_than_half_of_the_way_fell_short_and_turning_unasked_is_off_course() {
    // 0.48 m of the 1.11 m that a vehicle goes which comes to 0.3 m/s with 0.5 m/s^2.
    let slow = heedless(0.12, &[]);
    assert_eq!(slow.verdict, Verdict::FellShort, "{slow:?}");
    // The loops of the others scale their references to a wheel that is dragged.
    let drag =
        "fault=[{ kind = \"wheel_drag\", wheel = \"front_left\", damper_n_m_s_rad = 5.0, from_s = 0.0 }]";
    let dragged = outcome(
        "flat",
        &[
            "vehicle=mecanum4",
            "control.policy=scale_references",
            drag,
            "duration_s=6.0",
        ],
    );
    assert_eq!(dragged.verdict, Verdict::FellShort, "{dragged:?}");
    // Both motors of one side are lost, and the others turn the vehicle by some 4 degrees in a second.
    let lost = ["front_left", "rear_left"]
        .map(|wheel| format!("{{ kind = \"wheel_lost\", wheel = \"{wheel}\", from_s = 0.5 }}"));
    let lost = format!("fault=[{}]", lost.join(", "));
    let turned = |duration: &str| outcome("flat", &["vehicle=mecanum4", &lost, duration]);
    let (little, much) = (turned("duration_s=4.0"), turned("duration_s=15.0"));
    assert!(
        little.verdict == Verdict::Completed && little.yaw_error_deg.abs() < 44.0,
        "{little:?}"
    );
    assert!(
        much.verdict == Verdict::OffCourse && much.yaw_error_deg.abs() > 46.0,
        "{much:?}"
    );
}

/// Sensors that are wrong: encoder noise, a gyro's zero. Whatever a policy makes of them, a vehicle
/// that ends behind its start went the wrong way or ran away.
fn a_vehicle_that_wrong_sensors_drive_back_is_not_called_driven() {
    for (vehicle, sensors) in [
        ("rocker_bogie6", "sensors.encoder_noise_rad_s=1.0"),
        ("chugo7", "sensors.encoder_noise_rad_s=2.0"),
        ("mecanum4", "sensors.gyro_bias_rad_s=0.1"),
    ] {
        let vehicle = format!("vehicle={vehicle}");
        let found = outcome(
            "flat",
            &[&vehicle, sensors, "control.policy=traction", "duration_s=4.0"],
        );
        let named = matches!(found.verdict, Verdict::WrongWay | Verdict::Overspeed);
        assert!(named || found.final_x_m > -0.1, "{found:?}");
    }
}

/// 0.08 m/s are below what running away begins with.
fn motors_that_drive_on_after_a_command_of_rest_are_named() {
    let rest = "command.then=[{ at_s = 1.0, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 0.0 }]";
    // Where nothing takes energy, a vehicle rolls on without work: here a wheel is dragged, and
    // takes 0.1 N.m s x (1.2 rad/s)^2 = 0.15 W.
    let drag = "fault=[{ kind = \"wheel_drag\", wheel = \"4\", damper_n_m_s_rad = 0.1, from_s = 0.0 }]";
    let on = heedless(0.08, &["command.vx_m_s=0.08", rest, drag]);
    assert_eq!(on.verdict, Verdict::DroveOn, "{on:?}");
    let obeyed = outcome("flat", &["command.vx_m_s=0.08", rest, drag]);
    assert_eq!(obeyed.verdict, Verdict::Completed, "{obeyed:?}");
}

/// Flat ground and wheels without friction take nothing of 0.08 m/s. The same with a wheel that is
/// dragged with 1 N.m s: 230 N s/m of 20 kg, so that a tenth of the speed is left after 0.2 s.
fn a_vehicle_that_coasts_past_a_stop_rolled_on_unless_it_comes_to_a_stand() {
    let rest = "command.then=[{ at_s = 1.0, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 0.0 }]";
    let coasting = |drag: &str| {
        let lost =
            (1..=7).map(|wheel| format!("{{ kind = \"wheel_lost\", wheel = \"{wheel}\", from_s = 1.0 }}"));
        let faults: Vec<_> = lost.chain((!drag.is_empty()).then(|| drag.to_owned())).collect();
        let faults = format!("fault=[{}]", faults.join(", "));
        outcome("flat", &["command.vx_m_s=0.08", rest, &faults])
    };
    let on = coasting("");
    assert_eq!(on.verdict, Verdict::RolledOn, "{on:?}");
    let stands = coasting("{ kind = \"wheel_drag\", wheel = \"4\", damper_n_m_s_rad = 1.0, from_s = 1.0 }");
    assert_eq!(stands.verdict, Verdict::Completed, "{stands:?}");
}

/// The gears' friction is more than the motors' 2 N.m, and the integrals bring every motor to its limit.
fn a_vehicle_held_on_flat_ground_stalled_and_its_time_at_full_torque_is_a_metric() {
    let held = outcome(
        "flat",
        &[
            "vehicle.motor.gear_friction_n_m=3.0",
            "control.policy=independent",
            "duration_s=4.0",
        ],
    );
    assert_eq!(
        (held.verdict, held.stalled_row),
        (Verdict::Stalled, None),
        "{held:?}"
    );
    assert!(held.stalled_at_m.is_some_and(|x| x.abs() < 0.01), "{held:?}");
    let from_s = held.stall_from_s.expect("it stalled");
    // The command is there after 0.3 s; to 90 % of 2 N.m the loop's terms then take less than a
    // second. From there to the end.
    assert!(from_s > 0.1 && from_s < 1.3, "{held:?}");
    assert!((from_s + held.stall_s - 4.0).abs() < 1e-9, "{held:?}");
    // A climb pushes for a moment.
    let climb = outcome("step", &[]);
    assert!(climb.climbed && climb.stall_s < 0.5, "{climb:?}");
}

/// Its stop is at 0.5 rad, 28.6 degrees; stops give by a tenth of a degree or two.
fn a_rocker_without_a_differential_falls_on_its_nose_and_leaned() {
    let text = FileKind::Vehicle.template("rocker_bogie6").expect("built in");
    let [from, end] = ["\n[[coupling]]", "\n[motor]"].map(|table| text.find(table).expect("it has one"));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("loose.toml");
    std::fs::write(&path, format!("{}{}", &text[..from], &text[end..])).expect("written");
    let vehicle = format!("vehicle={}", path.display());
    let fallen = outcome("flat", &[&vehicle, "duration_s=3.0"]);
    assert_eq!(fallen.verdict, Verdict::Tilted, "{fallen:?}");
    assert!((fallen.nose_down_peak_deg - 28.6).abs() < 0.5, "{fallen:?}");
    assert!(fallen.pitch_peak_deg < 1.0, "{fallen:?}");
    let whole = outcome("flat", &["vehicle=rocker_bogie6", "duration_s=3.0"]);
    assert!(
        whole.verdict == Verdict::Completed && whole.nose_down_peak_deg < 1.0,
        "{whole:?}"
    );
}

/// `traction_runup` backs off by 0.11 m and more at 0.3 m/s, for longer than half a second with the way to a stand.
fn traction_control_that_backs_off_for_another_try_does_not_go_the_wrong_way() {
    let hard = [
        "control.policy=traction_runup",
        "terrain.friction=0.55",
        "terrain.height_m=0.055",
        "vehicle.motor.stall_torque_n_m=1.4",
        "duration_s=8.0",
    ];
    let tried = outcome("step", &hard);
    assert!(tried.retries.is_some_and(|retries| retries > 0), "{tried:?}");
    assert_ne!(tried.verdict, Verdict::WrongWay, "{tried:?}");
}

/// A riser turns a mecanum vehicle square that meets it askew, and its rollers then carry it along
/// the riser at its full speed.
fn a_mecanum_vehicle_that_meets_a_riser_askew_slides_along_it_and_is_not_on_its_way() {
    let askew = |heading_rad: &str| {
        outcome(
            "step",
            &[
                "vehicle=mecanum4",
                "control.policy=independent",
                "physics.wheel_model=rollers",
                "terrain.height_m=0.03",
                "command.frame=body",
                "duration_s=6.0",
                heading_rad,
            ],
        )
    };
    let slid = askew("start.heading_rad=0.2");
    assert_eq!(slid.verdict, Verdict::SlidAlong, "{slid:?}");
    // A vehicle that goes 0.3 m/s aside for two seconds has gone much further than the 0.2 m that 0.2 rad explain.
    assert!(slid.final_y_m.abs() > 0.5 && !slid.climbed, "{slid:?}");
    // Its command is across the riser by its true heading, which is square to it.
    assert!(slid.final_yaw_rad.abs() < 0.1, "{slid:?}");
}

/// Held by its gears' friction. The caller set torques once: nothing was commanded in that period. And with a period
/// of 0.1 s, of which a second has ten.
fn a_held_vehicle_stalled_after_a_period_of_ones_own_torques_and_with_long_periods() {
    let keys = [
        "vehicle.motor.gear_friction_n_m=3.0",
        "control.policy=independent",
    ];
    let held = scenario("flat", &keys);
    let (mut simulation, mut kept) = (Simulation::new(&held).expect("valid"), Vec::new());
    simulation.step_torques(&[0.0; 7]).expect("runs");
    kept.push(simulation.period().clone());
    for _ in 0..4000 {
        let command = simulation.scenario_command();
        simulation.step(&command).expect("runs");
        kept.push(simulation.period().clone());
    }
    let past = outcome_of(&held, &kept);
    assert_eq!(past.verdict, Verdict::Stalled, "{past:?}");
    assert!(past.yaw_error_deg.abs() < 0.1, "{past:?}");
    let long = outcome(
        "flat",
        &[keys[0], keys[1], "control.period_s=0.1", "duration_s=4.0"],
    );
    assert_eq!(long.verdict, Verdict::Stalled, "{long:?}");
}

/// Half a second ahead and half a second back, six times: a vehicle that does so is where it was a second ago, as
/// commanded.
fn a_vehicle_that_goes_back_and_forth_as_commanded_has_not_stalled() {
    let then: Vec<_> = (1..12)
        .map(|k| {
            let vx_m_s = if k % 2 == 0 { 0.3 } else { -0.3 };
            format!(
                "{{ at_s = {}, vx_m_s = {vx_m_s}, vy_m_s = 0.0, wz_rad_s = 0.0, ramp_s = 0.1 }}",
                0.5 * f64::from(k)
            )
        })
        .collect();
    let then = format!("command.then=[{}]", then.join(", "));
    let shuttles = outcome("flat", &["command.ramp_s=0.1", "duration_s=6.0", &then]);
    assert_eq!(shuttles.verdict, Verdict::Completed, "{shuttles:?}");
}

/// Along the edge as commanded, up to it and then aside: nothing was commanded across that it did not do.
fn a_vehicle_that_is_commanded_along_an_edge_is_on_its_way() {
    let aside = "command.then=[{ at_s = 2.6, vx_m_s = 0.0, vy_m_s = 0.3, wz_rad_s = 0.0 }]";
    let along = outcome("step", &["vehicle=mecanum4", "duration_s=5.0", aside]);
    assert_eq!(along.verdict, Verdict::Unfinished, "{along:?}");
}

on_the_fast_engine! {
    a_mecanum_vehicle_that_meets_a_riser_askew_slides_along_it_and_is_not_on_its_way,
    a_vehicle_that_is_commanded_along_an_edge_is_on_its_way,
    a_vehicle_that_drives_back_where_ahead_is_commanded_goes_the_wrong_way,
    less_than_half_of_the_way_fell_short_and_turning_unasked_is_off_course,
    a_vehicle_that_wrong_sensors_drive_back_is_not_called_driven,
    motors_that_drive_on_after_a_command_of_rest_are_named,
    a_vehicle_that_coasts_past_a_stop_rolled_on_unless_it_comes_to_a_stand,
    a_vehicle_held_on_flat_ground_stalled_and_its_time_at_full_torque_is_a_metric,
    a_held_vehicle_stalled_after_a_period_of_ones_own_torques_and_with_long_periods,
    a_vehicle_that_goes_back_and_forth_as_commanded_has_not_stalled,
    a_rocker_without_a_differential_falls_on_its_nose_and_leaned,
    traction_control_that_backs_off_for_another_try_does_not_go_the_wrong_way,
    rolling_away_without_motors_is_overspeed_unless_it_is_braked_in_time,
    a_vehicle_that_is_commanded_to_turn_and_slides_off_ran_away,
    hills_that_turn_a_vehicle_are_no_runaway_under_any_policy,
    a_frame_that_stands_at_its_stop_on_flat_ground_leaned_and_did_not_drive,
}
