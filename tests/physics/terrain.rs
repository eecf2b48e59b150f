//! The ground is where the scenario says, and a vehicle on it does what geometry and friction ask.

use omni_sim::config::{Engine, Override, Scenario, builtin_scenarios};
use omni_sim::{Trace, Verdict, run};

use crate::engines::{load, on, on_both_engines, passed};

fn scenario(name: &str, overrides: &[&str]) -> Scenario {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    load(name, &overrides).expect("valid")
}

fn drive(name: &str, overrides: &[&str]) -> Trace {
    run(&scenario(name, overrides)).expect("runs")
}

fn last(trace: &Trace, column: &str) -> f64 {
    *trace.column(column).expect("a column").last().expect("a row")
}

fn peak(trace: &Trace, column: &str) -> f64 {
    let column = trace.column(column).expect("a column");
    column.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x))
}

#[test]
fn every_built_in_scenario_ends_on_its_level_with_energy_within_a_ten_thousandth() {
    on(Engine::Articulated, || ends_on_its_level(builtin_scenarios()));
    // An edge of blocks and a field of heights; make test-full has all of them.
    on(Engine::Rapier, || ends_on_its_level(["step", "rough"]));
}

#[test]
#[ignore = "rapier takes a minute and a half: make test-full"]
fn every_built_in_scenario_ends_on_its_level_on_rapier() {
    on(Engine::Rapier, || ends_on_its_level(builtin_scenarios()));
}

fn ends_on_its_level(names: impl IntoIterator<Item = &'static str>) {
    for name in names {
        let trace = drive(name, &["control.policy=scale_references"]);
        let outcome = trace.outcome();
        // The hard step is there because plain loops stall at it.
        if name != "hard_step" {
            assert_eq!(outcome.verdict, passed(&scenario(name, &[])), "{name}");
        }
        assert!(
            outcome.energy_residual.abs() < 1e-4,
            "{name}: {} of what went through the motors is not in the book",
            outcome.energy_residual
        );
        // Contact forces are read from the solver, so this is rounding: 1e-9 of the weight.
        let newton = peak(&trace, "newton_residual_n");
        assert!(newton < 2e-7, "{name}: {newton} N");
        let level = match name {
            "step" => Some(0.05),
            "step_down" => Some(-0.05),
            "stairs" => Some(0.09),
            "ramp" => Some(0.175_f64.tan()),
            "ditch" | "bumps" | "rough" | "height_map" => Some(0.0),
            _ => None,
        };
        if let Some(level) = level {
            let z = last(&trace, "pose_z_m");
            // Contacts give by 42 um at rest and swing by less than a millimetre some seconds after the edge.
            assert!((z - level).abs() < 1e-3, "{name}: {z} m instead of {level} m");
        }
    }
}

fn a_run_is_in_every_bit_the_beginning_of_the_same_run_made_longer() {
    // A box's size rounds coordinates in it, so a ground that grows with the time that a run may
    // take would change the run. Boxes of twice these times at this speed, and 200 m, round the
    // place of the edge to an odd unit and to an even one.
    for name in [
        "step",
        "step_down",
        "stairs",
        "ramp",
        "ditch",
        "half_step",
        "bumps",
        "rough",
    ] {
        let run_for = |seconds: f64| {
            drive(
                name,
                &[
                    &format!("duration_s={seconds}"),
                    "control.policy=independent",
                    "command.vx_m_s=0.6",
                ],
            )
        };
        let (shorter, longer) = (run_for(2.0), run_for(2.6));
        assert_eq!(shorter.names(), longer.names());
        for column in shorter.names() {
            let bits = |trace: &Trace| -> Vec<u64> {
                let values = trace.column(column).expect("its own name").iter();
                values.map(|value| value.to_bits()).collect()
            };
            let (shorter, longer) = (bits(&shorter), bits(&longer));
            assert!(longer.starts_with(&shorter), "{name}: {column} differs");
        }
    }
}

fn a_ramp_pitches_the_whole_vehicle_by_its_slope() {
    let trace = drive("ramp", &["terrain.slope_rad=0.12", "terrain.length_m=2.0"]);
    let rear = trace.column("body_rear_nose_up_rad").expect("a column");
    // All rows stand on the slope once the base is 0.3 m past its foot, at x = 1.0 m.
    let x = trace.column("pose_x_m").expect("a column");
    let row = x.iter().position(|x| *x > 1.5).expect("on the slope");
    // Loads on a slope differ by row: contacts that give by 40 um over 0.3 m turn a frame by 1e-4 rad.
    assert!((rear[row] - 0.12).abs() < 5e-4, "{} rad", rear[row]);
    // The weight's part along the slope is what the wheels push with: m g sin, within the ripple of the drive.
    let along: f64 = (0..7)
        .map(|w| trace.wheel("force_along_n", w).expect("a signal")[row])
        .filter(|force| force.abs() > 0.0)
        .sum();
    let rolled = [0, 2, 3, 4, 6];
    let pushed: f64 = rolled
        .iter()
        .map(|w| {
            trace.wheel("torque_n_m", *w).expect("a signal")[row]
                * if [2, 6].contains(w) { -1.0 } else { 1.0 }
        })
        .sum::<f64>()
        / 0.066;
    let expected = 20.0 * 9.81 * 0.12_f64.sin();
    assert!(
        (pushed / expected - 1.0).abs() < 0.02,
        "{pushed} N of torque over radius, {expected} N"
    );
    assert!(along.is_finite());
}

fn a_half_round_bar_lifts_a_wheel_by_its_height() {
    for height in ["0.01", "0.02"] {
        let trace = drive(
            "bumps",
            &[
                &format!("terrain.height_m={height}"),
                "terrain.count=1",
                "command.vx_m_s=0.1",
                "duration_s=9.0",
            ],
        );
        let h: f64 = height.parse().expect("a number");
        for wheel in ["5", "7"] {
            let top = peak(&trace, &format!("wheel_{wheel}_z_m"));
            // At 0.1 m/s wheels hardly leave the bar: v^2 / 2 g is 0.5 mm.
            assert!(
                (top - 0.066 - h).abs() < 1e-3,
                "wheel {wheel}: {top} m over a bar of {h} m"
            );
        }
    }
}

fn a_ditch_lets_a_wheel_sink_between_its_edges() {
    let trace = drive("ditch", &["command.vx_m_s=0.1", "duration_s=9.0"]);
    // A circle of radius r between two edges w apart hangs r - sqrt(r^2 - w^2 / 4) lower; wheel 5 is a ball of 66 mm.
    let expected = 0.066 - (0.066_f64.powi(2) - 0.03_f64.powi(2)).sqrt();
    let z = trace.column("wheel_5_z_m").expect("a column");
    let lowest = z.iter().fold(f64::INFINITY, |m, z| m.min(*z));
    // It touches both edges for an instant only, with some bounce: half a millimetre of 7.2 mm.
    assert!(
        (0.066 - lowest - expected).abs() < 5e-4,
        "{} m, {expected} m",
        0.066 - lowest
    );
}

fn a_half_step_turns_the_roll_hinge_by_its_slope_between_the_wheels() {
    // Without a heading held the left wheels' longer way turns the vehicle by 20 degrees, and the
    // rear row misses the step.
    let hold = "heading_hold={ gain_per_s = 3.0, limit_rad_s = 0.5 }";
    let trace = drive("half_step", &["command.vx_m_s=0.15", "duration_s=12.0", hold]);
    assert_eq!(trace.outcome().verdict, Verdict::Climbed);
    // Left and right wheels are 0.46 m apart; wheels 2 and 6 roll at y = 0, beside the step, and hang in
    // the air. With the front row up on the left and the rear row still down, the hinge has all of it.
    let expected = (0.03_f64 / 0.46).asin();
    let roll = trace.column("hinge_roll_angle_rad").expect("a column");
    let most = roll.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
    // The bump at the edge swings it a little further: a tenth.
    assert!(
        most > expected && most < 1.1 * expected,
        "{most} rad, {expected} rad"
    );
    // With both rows up on the left it is straight again.
    assert!(last(&trace, "hinge_roll_angle_rad").abs() < 0.05 * expected);
    let tilt = last(&trace, "wheel_3_z_m") - last(&trace, "wheel_1_z_m");
    assert!((tilt - 0.03).abs() < 1e-3, "{tilt} m from wheel 1 to wheel 3");
}

fn friction_patches_take_the_grip_where_they_lie_and_nowhere_else() {
    // All wheels of the left side on ice, braking hard: the vehicle turns right, towards the side that still holds.
    let patch = "friction_patch=[{ x_m = [0.2, 30.0], y_m = [0.05, 5.0], friction = 0.02 }]";
    let brake = "command.then=[{ at_s = 3.0, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 0.0 }]";
    let faster = [
        "command.vx_m_s=0.9",
        brake,
        "control.policy=independent",
        "duration_s=3.3",
    ];
    let with = |extra: &[&str]| {
        let all: Vec<&str> = faster.iter().chain(extra).copied().collect();
        drive("flat", &all)
    };
    let (iced, dry) = (with(&[patch]), with(&[]));
    let yaw = last(&iced, "pose_yaw_rad");
    assert!(yaw < -0.02, "{yaw} rad");
    assert!(last(&dry, "pose_yaw_rad").abs() < 1e-3);
    // On ice a wheel never pushes with more than the patch's friction.
    let (mut worst, rows) = (0.0_f64, iced.rows());
    for k in 2000..rows {
        let normal = iced.wheel("force_normal_n", 2).expect("a signal")[k];
        worst = worst.max(iced.wheel("force_along_n", 2).expect("a signal")[k].abs() / normal);
    }
    assert!(worst <= 0.02 * (1.0 + 1e-6), "{worst}");
}

/// A block as long and as wide as the ground of the built-in step is that step.
fn a_step_of_a_block_is_the_step_in_every_bit_of_the_pose() {
    let of = |keys: &[&str]| {
        let more = [
            "control.policy=independent",
            "duration_s=4.0",
            "physics.wheel_model=ball",
        ];
        drive("step", &[&more, keys].concat())
    };
    let block = "block=[{ x_m = [0.7, 202.4], y_m = [-202.4, 202.4], height_m = 0.05 }]";
    let (step, block) = (
        of(&[]),
        of(&["terrain={ kind = \"flat\", friction = 0.7 }", block]),
    );
    assert!(last(&step, "wheel_1_z_m") > 0.05 + 0.06, "it is up");
    for name in ["pose_x_m", "pose_z_m", "body_front_nose_up_rad"] {
        assert_eq!(step.column(name), block.column(name), "{name}");
    }
}

fn a_block_lifts_what_drives_over_it_and_nothing_beside_it() {
    let over = |y_m: &str| {
        let block = format!("block=[{{ x_m = [0.6, 0.65], y_m = {y_m}, height_m = 0.01 }}]");
        let trace = drive("flat", &[&block, "duration_s=3.0", "control.policy=independent"]);
        (
            peak(&trace, "wheel_7_z_m"),
            peak(&trace, "wheel_5_z_m"),
            trace.outcome().wheel_model_valid,
        )
    };
    let radius_m = 0.066;
    let ((left, right, valid), (none, _, _)) = (over("[0.05, 2.0]"), over("[1.0, 2.0]"));
    // Wheel 5 is the right one of the front row, wheel 7 the left one.
    assert!(valid && (left - radius_m - 0.01).abs() < 1e-3, "{left} m");
    assert!(
        (right - radius_m).abs() < 2e-3 && (none - radius_m).abs() < 1e-3,
        "{right}, {none} m"
    );
}

#[test]
fn a_block_under_a_wheel_at_the_start_is_refused_with_the_distance_that_it_needs() {
    let refused = |keys: &[&str]| {
        let overrides: Vec<_> = keys
            .iter()
            .map(|key| Override::parse(key).expect("KEY=VALUE"))
            .collect();
        load("flat", &overrides)
            .map(|_| "valid")
            .expect_err("refused")
            .to_string()
    };
    let under = refused(&["block=[{ x_m = [0.2, 0.3], y_m = [0.1, 0.2], height_m = 0.02 }]"]);
    assert!(
        under.contains("block[0]: x_m [0.2, 0.3], y_m [0.1, 0.2], allowed: more than 0.066 m from"),
        "{under}"
    );
    let turned = [
        "block=[{ x_m = [0.4, 0.5], y_m = [-2.0, 2.0], height_m = 0.02 }]",
        "perturbation.start_m=0.1",
    ];
    assert!(
        refused(&turned).contains("more than 0.166 m from"),
        "{}",
        refused(&turned)
    );
    let high = refused(&["block=[{ x_m = [2.0, 3.0], y_m = [-2.0, 2.0], height_m = 2.0 }]"]);
    assert!(
        high.contains("block[0].height_m: 2, allowed: 0.0001 to 1"),
        "{high}"
    );
}

#[test]
fn every_kind_of_ground_is_as_high_as_its_keys_say() {
    let at = |name: &str, overrides: &[&str], x: f64, y: f64| {
        omni_sim::ground_heights_m(&scenario(name, overrides), &[[x, y]])[0]
    };
    let slope = 0.175_f64.tan();
    let round = |off: f64| (0.02_f64.powi(2) - off * off).sqrt(); // half a bar of 2 cm
    for (name, x, y, height) in [
        ("flat", 3.0, -2.0, 0.0),
        ("step", 0.699, 0.0, 0.0),
        ("step", 0.701, 0.0, 0.05),
        ("step_down", 0.699, 0.0, 0.0),
        ("step_down", 0.701, 0.0, -0.05),
        ("stairs", 1.09, 0.3, 0.03),
        ("stairs", 1.11, 0.3, 0.06),
        ("ramp", 0.7, 0.0, 0.0),
        ("ramp", 0.9, 1.0, 0.2 * slope),
        ("ramp", 1.69, 1.0, 0.99 * slope),
        ("ramp", 2.5, 1.0, slope),
        ("half_step", 1.0, 0.11, 0.03),
        ("half_step", 1.0, 0.09, 0.0),
        ("ditch", 0.73, 0.0, -0.05),
        ("ditch", 0.77, 0.0, 0.0),
        ("bumps", 0.72, 0.0, 0.02),
        ("bumps", 0.73, 0.0, round(0.01)),
        ("bumps", 0.72 + 0.45, 0.0, 0.02),
        ("bumps", 0.9, 0.0, 0.0),
    ] {
        let got = at(name, &[], x, y);
        assert!(
            (got - height).abs() < 1e-9,
            "{name} at ({x}, {y}): {got} m, {height} m"
        );
    }
    // Flatter bars are parts of larger circles: 1 cm high and 8 cm wide, of radius 8.5 cm.
    let flat = ["terrain.height_m=0.01", "terrain.width_m=0.08"];
    assert!((at("bumps", &flat, 0.74, 0.0) - 0.01).abs() < 1e-9);
    let side = (0.085_f64.powi(2) - 0.02_f64.powi(2)).sqrt() - 0.075;
    let got = at("bumps", &flat, 0.76, 0.0);
    // A ray finds a cylinder's side by iteration, to some micrometres.
    assert!((got - side).abs() < 1e-5, "{got} m, {side} m");
}

#[test]
fn rough_ground_has_the_deviation_asked_for_inside_and_none_at_its_borders() {
    let wide = ["terrain.length_m=20", "terrain.width_m=20", "terrain.rms_m=0.02"];
    let scenario = scenario("rough", &wide);
    let places: Vec<[f64; 2]> = (0..10_000)
        .map(|k| [2.0 + 0.17 * f64::from(k % 100), -8.5 + 0.17 * f64::from(k / 100)])
        .collect();
    let heights = omni_sim::ground_heights_m(&scenario, &places);
    let square: f64 = heights.iter().map(|h| h * h).sum::<f64>() / heights.len() as f64;
    // 17 m hold some 20 of the longest waves each way, some 400 patches that vary by themselves: 1
    // / sqrt(800), three times.
    assert!(
        (square.sqrt() / 0.02 - 1.0).abs() < 0.11,
        "{} m rms",
        square.sqrt()
    );
    let border = omni_sim::ground_heights_m(
        &scenario,
        &[[0.7, 3.0], [20.7, -4.0], [5.0, 10.0], [5.0, -10.0], [0.3, 0.0]],
    );
    assert!(border.iter().all(|h| h.abs() < 1e-9), "{border:?}");
}

#[test]
fn another_seed_is_another_ground_and_the_runs_own_seed_is_not() {
    let heights = |seed: &str| {
        let trace = drive("rough", &[seed, "duration_s=6.0"]);
        trace.column("wheel_4_z_m").expect("a column").to_vec()
    };
    let (one, again, other) = (
        heights("terrain.seed=1"),
        heights("terrain.seed=1"),
        heights("terrain.seed=2"),
    );
    assert_eq!(one, again);
    assert_ne!(one, other);
    // The scenario's own seed is not the ground's.
    assert_eq!(one, heights("seed=5"));
}

fn a_height_map_lies_with_its_upper_edge_ahead_and_its_left_edge_on_the_left() {
    // A picture of 3 x 3: white in the upper left corner only. Its middle column is at y = 0.
    let folder = tempfile::tempdir().expect("a folder");
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 3, 3);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("written");
    writer
        .write_image_data(&[255, 0, 0, 0, 0, 0, 0, 0, 0])
        .expect("written");
    writer.finish().expect("written");
    std::fs::write(folder.path().join("corner.png"), png).expect("written");
    let text = omni_sim::config::FileKind::Scenario
        .template("height_map")
        .expect("built in");
    let text = text
        .replace("\"hills\"", "\"corner.png\"")
        .replace("pixel_m = 0.015", "pixel_m = 1.0");
    let path = folder.path().join("corner.toml");
    std::fs::write(&path, text).expect("written");
    let scenario = load(path.to_str().expect("a path"), &[]).expect("valid");
    let omni_sim::config::Terrain::HeightMap { image, .. } = &scenario.terrain else {
        panic!("a height map");
    };
    assert_eq!(
        (image.level(0, 0), image.level(0, 2), image.level(2, 0)),
        (1.0, 0.0, 0.0)
    );
    // White is 8 cm: at the far left of the upper edge, 2 m from the lower one.
    let heights = omni_sim::ground_heights_m(
        &scenario,
        &[[2.699, 0.999], [2.699, -0.999], [0.701, 0.999], [1.7, 0.0]],
    );
    for (height, expected) in heights.iter().zip([0.08, 0.0, 0.0, 0.0]) {
        assert!((height - expected).abs() < 5e-4, "{heights:?}");
    }
    // The vehicle at the far left is lifted there, at the far right it is not.
    for (y, raised) in [("0.9", true), ("-0.9", false)] {
        let overrides = [format!("start.y_m={y}"), "duration_s=8.5".into()];
        let overrides: Vec<_> = overrides
            .iter()
            .map(|o| Override::parse(o).expect("KEY=VALUE"))
            .collect();
        let scenario = load(path.to_str().expect("a path"), &overrides).expect("valid");
        let top = peak(&run(&scenario).expect("runs"), "wheel_5_z_m") - 0.066;
        assert_eq!(top > 0.02, raised, "{top} m at y = {y} m");
    }
    // A log's text holds the picture: it reads back without the file.
    let whole = scenario.to_toml().expect("plain data");
    let source = omni_sim::config::Source::text("a log", whole);
    assert_eq!(Scenario::from_source(&source, &[]).expect("valid"), scenario);
}

fn a_step_higher_than_a_wheel_and_ground_without_friction_are_stalls_not_errors() {
    // Loops, which do not try again.
    let loops = "control.policy=independent";
    let high = drive("step", &["terrain.height_m=0.2", "duration_s=4.0", loops]);
    assert_eq!(
        (high.outcome().verdict, high.outcome().stalled_row),
        (Verdict::Stalled, Some(1))
    );
    let slick = drive("step", &["terrain.friction=0", "duration_s=3.0"]);
    assert_eq!(slick.outcome().verdict, Verdict::Stalled);
    assert!(slick.outcome().stalled_at_m.is_some_and(|x| x.abs() < 1e-3));
}

fn a_vehicle_that_falls_off_a_high_edge_has_tipped() {
    // Half a metre: the front frame hangs on its hinge's stop, and the rest follows over the edge.
    for vehicle in ["chugo7", "omni3"] {
        let vehicle = format!("vehicle={vehicle}");
        let fallen = drive("step_down", &["terrain.height_m=0.5", &vehicle]);
        assert_eq!(fallen.outcome().verdict, Verdict::Tipped, "{vehicle}");
        assert!(!fallen.outcome().climbed && fallen.outcome().crossing_s.is_none());
    }
}

fn start_and_heading_are_where_the_scenario_puts_them() {
    let keys = [
        "start.x_m=-0.2",
        "start.y_m=0.3",
        "start.heading_rad=0.5",
        "duration_s=0.01",
    ];
    let trace = drive("step", &keys);
    for (column, expected) in [("pose_x_m", -0.2), ("pose_y_m", 0.3), ("pose_yaw_rad", 0.5)] {
        // 3 mm/s after 10 ms of the command's ramp: some micrometres.
        assert!((last(&trace, column) - expected).abs() < 1e-4, "{column}");
    }
    // A command in the world's frame goes straight at the step, whatever the heading.
    let across = drive(
        "flat",
        &["start.heading_rad=0.5", "command.frame=world", "duration_s=3.0"],
    );
    assert!(last(&across, "pose_x_m") > 0.8 && last(&across, "pose_y_m").abs() < 5e-3);
    assert!((last(&across, "pose_yaw_rad") - 0.5).abs() < 5e-3);
}

on_both_engines! {
    a_step_of_a_block_is_the_step_in_every_bit_of_the_pose,
    a_block_lifts_what_drives_over_it_and_nothing_beside_it,
    a_run_is_in_every_bit_the_beginning_of_the_same_run_made_longer,
    a_ramp_pitches_the_whole_vehicle_by_its_slope,
    a_half_round_bar_lifts_a_wheel_by_its_height,
    a_ditch_lets_a_wheel_sink_between_its_edges,
    a_half_step_turns_the_roll_hinge_by_its_slope_between_the_wheels,
    friction_patches_take_the_grip_where_they_lie_and_nowhere_else,
    a_height_map_lies_with_its_upper_edge_ahead_and_its_left_edge_on_the_left,
    a_step_higher_than_a_wheel_and_ground_without_friction_are_stalls_not_errors,
    a_vehicle_that_falls_off_a_high_edge_has_tipped,
    start_and_heading_are_where_the_scenario_puts_them,
}
