//! One line of bad input each, and the one line that says so.

use std::fs;
use std::path::Path;

use super::refused;

/// The built-in vehicle and step with one text replaced, as files `v.toml` and `s.toml`; refused with this message.
fn refused_file(file: &str, from: &str, to: &str, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../omni-config/assets");
    let vehicle = fs::read_to_string(assets.join("vehicles/chugo7.toml")).unwrap();
    let scenario = fs::read_to_string(assets.join("scenarios/step.toml")).unwrap();
    let scenario = scenario
        .replace("vehicle = \"chugo7\"", "vehicle = \"v.toml\"")
        .replace("policy = \"traction\"", "policy = \"scale_references\"");
    let change = |text: &str, name: &str| {
        if name == file {
            assert!(text.contains(from), "{name} has no {from:?}");
            text.replacen(from, to, 1)
        } else {
            text.to_owned()
        }
    };
    fs::write(folder.path().join("v.toml"), change(&vehicle, "v.toml")).unwrap();
    fs::write(folder.path().join("s.toml"), change(&scenario, "s.toml")).unwrap();
    let said = refused(folder.path(), &["compare", "s.toml"]);
    assert!(said.contains(file), "names the file: {said}");
    assert!(said.contains(expected), "expected {expected:?} in: {said}");
    assert!(!folder.path().join("out").exists(), "nothing is written");
}

#[test]
fn a_scenario_sets_keys_of_its_vehicle_only() {
    refused_file(
        "s.toml",
        "[terrain]",
        "[set]\n\"terrain.friction\" = 0.5\n[terrain]",
        "set.terrain.friction: allowed: keys that begin with vehicle.; the others are keys of this file",
    );
    refused_file(
        "s.toml",
        "seed = 0",
        "seed = 0\nset = 3",
        "set: 3, allowed: a table of keys",
    );
}

#[test]
fn a_typo_in_a_key_is_named_with_the_keys_there_are() {
    refused_file(
        "s.toml",
        "height_m =",
        "hight_m =",
        "terrain.hight_m: unknown field `hight_m` (did you mean `height_m`?), expected one of",
    );
    refused_file(
        "v.toml",
        "\nradius_m = 0.066",
        "\nradios_m = 0.066",
        "wheel[0].radios_m: unknown field `radios_m` (did you mean `radius_m`?), expected one of",
    );
}

#[test]
fn a_missing_field_is_named() {
    let name = "top level: missing field `name`; for example name = \"step\"";
    refused_file("s.toml", "name = \"step\"", "", name);
    let friction = "terrain: missing field `friction`; for example friction = 0.7";
    refused_file("s.toml", "friction = 0.7", "", friction);
    let mass = "body[1]: missing field `mass_kg`; for example mass_kg = 6.0";
    refused_file("v.toml", "mass_kg = 6.0", "", mass);
    // All at once, so that a file is complete after one run.
    let ground = "friction = 0.7              # rubber on dry concrete; not in the paper\nheight_m = 0.05\nstart_x_m = 0.7 ";
    let all = "terrain: missing field `friction`, also terrain.height_m, terrain.start_x_m; for example friction = 0.7";
    refused_file("s.toml", ground, "", all);
}

#[test]
fn a_missing_vehicle_file_is_named_with_key_and_suggestion() {
    refused_file(
        "s.toml",
        "vehicle = \"v.toml\"",
        "vehicle = \"v1.toml\"",
        "s.toml: vehicle: \"v1.toml\" (did you mean \"v.toml\"?): No such file",
    );
}

#[test]
fn a_decimal_comma_is_named_and_other_slips_are_not() {
    let hint = "numbers are written with a decimal point";
    refused_file("s.toml", "height_m = 0.05", "height_m = 0,05", hint);
}

#[test]
fn a_wrong_type_is_named_with_its_key() {
    refused_file(
        "s.toml",
        "height_m = 0.05",
        "height_m = \"high\"",
        "terrain.height_m: invalid type: string \"high\", expected a number; for example height_m = 0.05",
    );
    refused_file(
        "s.toml",
        "kind = \"step\"",
        "kind = \"steps\"",
        "unknown variant `steps` (did you mean `step`?), expected one of `flat`, `step`,",
    );
    refused_file("s.toml", "kind = \"step\"", "", "missing field `kind`");
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = true",
        "body[1].mass_kg: invalid type: boolean",
    );
}

#[test]
fn text_that_is_not_toml_is_refused_with_its_line() {
    refused_file("s.toml", "name = \"step\"", "name = \"step", "s.toml:3: ");
}

#[test]
fn values_out_of_range_are_named_with_the_range() {
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = nan",
        "body[1].mass_kg: NaN, allowed: 0.001 to 10000",
    );
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = -6.0",
        "body[1].mass_kg: -6, allowed: 0.001 to 10000",
    );
    refused_file(
        "v.toml",
        "radius_m = 0.066",
        "radius_m = 0.0",
        "wheel[0].radius_m: 0, allowed: 0.001 to 10",
    );
    refused_file(
        "v.toml",
        "limit_rad = 0.9",
        "limit_rad = 9.0",
        "hinge[0].limit_rad: 9, allowed: 0 to 3",
    );
    refused_file(
        "s.toml",
        "vx_m_s = 0.3",
        "vx_m_s = inf",
        "command.vx_m_s: inf, allowed: -100 to 100",
    );
    refused_file(
        "s.toml",
        "period_s = 0.001",
        "period_s = 0.00075",
        "control.period_s: 0.00075, allowed: a multiple of physics.timestep_s, 0.0005",
    );
    refused_file(
        "v.toml",
        "mass_kg = 6.0",
        "mass_kg = 1e300",
        "body[1].mass_kg: 1e300, allowed: 0.001 to 10000",
    );
    refused_file(
        "v.toml",
        "com_m = [0.18, 0.0, 0.18]",
        "com_m = [180, 0.0, 180]",
        "body[1].com_m: [180, 0, 180], allowed: -100 to 100",
    );
    refused_file(
        "v.toml",
        "clearance_m = 0.066 ",
        "clearance_m = 0 ",
        "body[1].clearance_m: 0, allowed: 0.001 to 100",
    );
}

#[test]
fn keys_of_drive_and_grid_are_named_with_their_ranges() {
    let in_scenario = |text: &str, expected: &str| {
        refused_file("s.toml", "[physics]", &format!("{text}\n[physics]"), expected);
    };
    in_scenario(
        "[drive]\ncommand_timeout_s = -1",
        "drive.command_timeout_s: -1, allowed: 0 to 3600",
    );
    in_scenario(
        "[drive]\nunobservable_periods = 70000",
        "drive.unobservable_periods: 70000, allowed: 0 to 65534",
    );
    in_scenario(
        "[drive.slip]\nenter_rad_s = 0.5",
        "drive.slip.leave_rad_s: 1, allowed: up to enter_rad_s, 0.5",
    );
    in_scenario(
        "[drive.faults]\nstuck_periods = 1",
        "drive.faults.stuck_periods: 1, allowed: 2 to 65535",
    );
    in_scenario(
        "[drive]\nrestart = \"never\"",
        "drive.restart: unknown variant `never`, expected `at_once` or `neutral`",
    );
    in_scenario(
        "[drive]\ntimeout = 1",
        "drive.timeout: unknown field `timeout` (did you mean `command_timeout_s`?)",
    );
    let in_control = |text: &str, expected: &str| {
        refused_file(
            "s.toml",
            "period_s = 0.001",
            &format!("period_s = 0.001\n{text}"),
            expected,
        );
    };
    in_control(
        "proportional_limit_n_m = 1e7",
        "control.proportional_limit_n_m: 10000000, allowed: 0 to 1000000",
    );
    in_control(
        "integral = \"both\"",
        "control.integral: unknown variant `both`, expected `per_wheel` or `shared`",
    );
}

#[test]
fn another_version_of_a_file_says_what_to_do() {
    for file in ["s.toml", "v.toml"] {
        // Keys that a later version may have are no reason to speak of keys.
        refused_file(
            file,
            "schema_version = 1",
            "schema_version = 2\nfrom_the_future = true",
            "schema_version: 2, this program reads version 1: update omnistep",
        );
        refused_file(
            file,
            "schema_version = 1",
            "schema_version = 0",
            "schema_version: 0, the first version is 1: write schema_version = 1",
        );
        refused_file(
            file,
            "schema_version = 1",
            "",
            "schema_version: missing: write schema_version = 1 at the top of the file",
        );
        refused_file(
            file,
            "schema_version = 1",
            "schema_version = \"1\"",
            "schema_version: \"1\", allowed: a whole number: write schema_version = 1",
        );
    }
}

#[test]
fn a_shape_that_cannot_be_or_cannot_stand_is_refused() {
    refused_file(
        "v.toml",
        "position_m = [-0.30, 0.23]",
        "position_m = [-0.30, -0.11]",
        "wheel[2].position_m: [-0.3, -0.11], allowed: clear of other wheels: wheels \"1\" and \"3\" intersect",
    );
    // As balls on the ground they are clear of each other, the rollers being small; their rims cross.
    refused_file(
        "v.toml",
        "position_m = [-0.30, 0.00]",
        "position_m = [-0.24, -0.17]",
        "wheels \"1\" and \"2\" intersect",
    );
    // Millimetres for metres.
    refused_file(
        "v.toml",
        "anchor_m = [0.0, 0.0, 0.066] ",
        "anchor_m = [0.0, 0.0, 66] ",
        "hinge[0].anchor_m: [0.0, 0.0, 66.0], allowed: ",
    );
    refused_file(
        "v.toml",
        "com_m = [0.18, 0.0, 0.18]",
        "com_m = [1.8, 0.0, 0.18]",
        "body[1].com_m: [1.8, 0.0, 0.18] puts the vehicle's centre of mass at (0.486, 0.000), where it tips at \
         rest, allowed: inside the polygon of the wheels, within x -0.300 to 0.300, y -0.230 to 0.230",
    );
}

#[test]
fn couplings_join_two_hinges_that_the_physics_step_resolves() {
    let coupling = |rest: &str| format!("[[coupling]]\nname = \"c\"\nhinge_a = \"pitch\"\n{rest}\n\n[motor]");
    for (rest, expected) in [
        (
            "hinge_b = \"yaw\"",
            "coupling[0].hinge_b: \"yaw\", allowed: pitch, roll",
        ),
        (
            "hinge_b = \"pitch\"",
            "coupling[0].hinge_b: \"pitch\", allowed: another hinge than hinge_a",
        ),
        (
            "hinge_b = \"roll\"\nratio = 0.0",
            "coupling[0].ratio: 0, allowed: at least 0.001 or at most -0.001",
        ),
    ] {
        refused_file("v.toml", "[motor]", &coupling(rest), expected);
    }
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "vehicle=rocker_bogie6",
        "physics.engine=rapier",
        "physics.timestep_s=0.002",
        "control.period_s=0.002",
    ];
    let args = ["run", "flat"]
        .into_iter()
        .chain(sets.iter().flat_map(|s| ["--set", s]));
    let said = refused(folder.path(), &args.collect::<Vec<_>>());
    assert!(
        said.contains("physics.timestep_s: 0.002, allowed: up to 0.001165 with the stiffness and damping of the coupling \"differential\""),
        "{said}"
    );
}

#[test]
fn more_that_no_single_key_shows_is_named() {
    refused_file(
        "s.toml",
        "start_x_m = 0.7",
        "start_x_m = 0.3",
        "terrain.start_x_m: 0.3, allowed: more than 0.366",
    );
    refused_file(
        "s.toml",
        "timestep_s = 0.0005",
        "timestep_s = 0.0005\nsolver_iterations = 0",
        "solver_iterations: 0, allowed: 1 to 100",
    );
    refused_file(
        "s.toml",
        "v.toml",
        "chugo8",
        "s.toml: vehicle: \"chugo8\" (did you mean \"chugo7\"?), allowed: chugo7",
    );
}

#[test]
fn references_to_bodies_that_are_not_there_are_refused() {
    refused_file(
        "v.toml",
        "child = \"front\"",
        "child = \"nose\"",
        "hinge[0].child: \"nose\", allowed: middle, front, rear",
    );
    refused_file(
        "v.toml",
        "body = \"rear\"",
        "body = \"tail\"",
        "wheel[0].body: \"tail\", allowed: middle, front, rear",
    );
    refused_file(
        "v.toml",
        "name = \"rear\"",
        "name = \"front\"",
        "body[2].name: \"front\" twice",
    );
}

#[test]
fn unknown_names_are_refused_with_the_names_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let said = refused(folder.path(), &["compare", "stairway"]);
    assert!(
        said.contains("unknown scenario \"stairway\" (did you mean \"stairs\"?), allowed: step, hard_step, flat, step_down, stairs, ramp, half_step, ditch, bumps, rough, height_map, ice, square, figure_eight, or the path"),
        "{said}"
    );
    let said = refused(folder.path(), &["run", "step", "--policy", "scale_torque"]);
    assert!(
        said.contains("control.policy: \"scale_torque\" (did you mean \"scale_torques\"?), allowed: auto, independent, scale_torques, scale_references, shared_integral"),
        "{said}"
    );
    let said = refused(folder.path(), &["run", "--set", "control.policy=scale_torque"]);
    assert!(
        said.contains("control.policy: \"scale_torque\" (did you mean \"scale_torques\"?), allowed: auto, independent, scale_torques, scale_references, shared_integral"),
        "{said}"
    );
    let said = refused(folder.path(), &["compare", "--set", "terrain.friction"]);
    assert!(
        said.contains("terrain.friction") && said.contains("KEY=VALUE"),
        "{said}"
    );
    let said = refused(
        folder.path(),
        &["compare", "--set", "vehicle.wheel[9].radius_m=0.1"],
    );
    assert!(
        said.contains("element \"9\", allowed: * for all, 0 to 6"),
        "{said}"
    );
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        0,
        "nothing is written"
    );
}

#[test]
fn names_that_frames_of_logs_have_are_refused() {
    let allowed =
        "allowed: any name except \"world\", \"odom\", \"base_link\" and \"wheel_\" with a wheel's name";
    for name in ["world", "odom", "base_link", "wheel_4"] {
        refused_file(
            "v.toml",
            "name = \"roll\"",
            &format!("name = \"{name}\""),
            &format!("hinge[1].name: \"{name}\", {allowed}"),
        );
    }
}

#[test]
fn unknown_engines_and_keys_of_the_other_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let said = |args: &[&str], expected: &str| {
        let said = refused(folder.path(), args);
        assert!(
            said.contains(expected),
            "{args:?}: expected {expected:?} in: {said}"
        );
        said
    };
    let run = |key: &str, engine: &str, expected: &str| {
        said(
            &[
                "run",
                "step",
                "--set",
                key,
                "--set",
                &format!("physics.engine={engine}"),
            ],
            expected,
        );
    };
    run(
        "duration_s=1.0",
        "rapierr",
        "physics.engine: unknown variant `rapierr` (did you mean `rapier`?), expected `articulated` or `rapier`",
    );
    run(
        "physics.solver_iterations=4",
        "articulated",
        "physics.solver_iterations: 4, allowed: only with physics.engine = \"rapier\"",
    );
    let soft = "vehicle.wheel.0.contact_stiffness_n_m=20000";
    let only =
        "vehicle.wheel[0].contact_stiffness_n_m: 20000, allowed: only with physics.engine = \"articulated\"";
    run(soft, "rapier", only);
    said(
        &["compare", "step", "--engines", "--set", soft],
        "(--engines runs every engine)",
    );
    run(
        "vehicle.wheel.0.contact_stiffness_n_m=-1",
        "articulated",
        "wheel[0].contact_stiffness_n_m: -1, allowed: 100 to",
    );
    run(
        "vehicle.wheel.0.preload_n=1e9",
        "articulated",
        "wheel[0].preload_n: 1e9, allowed: -100000 to 100000",
    );
    // More than a tenth of the radius lower: 0.0066 m times what the contact gives way.
    run(
        "vehicle.wheel.0.preload_n=100000",
        "articulated",
        "a larger one moves the wheel by more than a tenth of its radius",
    );
}

#[test]
fn a_motor_says_once_what_speed_takes_off_its_torque() {
    let slope = "slope_n_m_s_rad = 0.0 ";
    refused_file(
        "v.toml",
        slope,
        "no_load_rpm = 200.0\nslope_n_m_s_rad = 0.0 ",
        "motor: slope_n_m_s_rad = 0 and no_load_rpm = 200 together, allowed: exactly one of slope_n_m_s_rad, no_load_rpm, no_load_rad_s",
    );
    refused_file(
        "v.toml",
        slope,
        "# ",
        "motor: the slope of torque over speed is missing, allowed: exactly one of",
    );
    refused_file(
        "v.toml",
        slope,
        "no_load_rpm = -200.0 # ",
        "motor.no_load_rpm: -200, allowed: 0.001 to 1000000",
    );
    refused_file(
        "v.toml",
        slope,
        "no_load_rad_s = nan # ",
        "motor.no_load_rad_s: NaN, allowed: 0.0001 to 100000",
    );
    refused_file(
        "v.toml",
        slope,
        "slope_n_m_s_rad = 0.0\ngear_friction_n_m = -0.1 # ",
        "motor.gear_friction_n_m: -0.1, allowed: 0 to 1000000",
    );
    refused_file(
        "v.toml",
        slope,
        "slope_n_m_s_rad = 0.0\nefficiency = 1.2 # ",
        "motor.efficiency: 1.2, allowed: 0.01 to 1",
    );
}

#[test]
fn a_way_of_reading_velocities_goes_with_counts_and_the_period() {
    let folder = tempfile::tempdir().unwrap();
    let said = |velocity: &str, counts: &str| {
        let keys = [
            format!("sensors.encoder_velocity={velocity}"),
            format!("sensors.encoder_counts={counts}"),
        ];
        refused(
            folder.path(),
            &["run", "flat", "--set", &keys[0], "--set", &keys[1]],
        )
    };
    for (velocity, counts, expected) in [
        (
            "{ kind = \"edges\" }",
            "0",
            "sensors.encoder_velocity: set without encoder counts, allowed: only with sensors.encoder_counts above 0",
        ),
        (
            "{ kind = \"window\", periods = 33 }",
            "360",
            "periods: 33, allowed: 1 to 32",
        ),
        (
            "{ kind = \"observer\", bandwidth_rad_s = 1500.0 }",
            "360",
            "sensors.encoder_velocity.bandwidth_rad_s: 1500, allowed: 0.001 to 1 over the control period (0.001 s)",
        ),
        (
            "{ kind = \"windows\", periods = 3 }",
            "360",
            "unknown variant `windows` (did you mean `window`?)",
        ),
    ] {
        let said = said(velocity, counts);
        assert!(said.contains(expected), "expected {expected:?} in: {said}");
    }
}

#[test]
fn check_prefers_built_in_names_to_files_as_run_does() {
    let folder = tempfile::tempdir().unwrap();
    let said = |name: &str| {
        let output = super::omnistep(folder.path(), &["check", name]);
        assert!(output.status.success(), "{name}");
        String::from_utf8(output.stdout).unwrap()
    };
    assert!(said("step").starts_with("step: scenario step, 6 s, policy traction, engine rapier"));
    assert!(said("chugo7").starts_with("chugo7: vehicle chugo7: 3 bodies"));
    assert!(said("climb_map").starts_with("climb_map: study "));
    assert!(said("motor_bench").starts_with("motor_bench: experiment motor_bench"));
    fs::write(folder.path().join("step"), "no = 1").unwrap();
    assert!(said("step").starts_with("step: scenario step"));
    assert!(refused(folder.path(), &["check", "./step"]).contains("./step"));
}
