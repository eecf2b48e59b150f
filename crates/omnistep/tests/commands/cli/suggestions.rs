//! A name that is not there, and the name that was meant.

use std::fs;

use super::{omnistep, one_of_each, refused, stdout};

#[test]
fn a_slip_in_a_key_or_a_name_is_answered_with_the_nearest_one() {
    let folder = one_of_each();
    let path = folder.path();
    for (args, expected) in [
        (
            ["run", "flat", "--set", "terain.friction=0.5"],
            "terain: unknown field `terain` (did you mean `terrain`?), expected one of",
        ),
        (
            ["run", "flat", "--set", "vehicle.motor.stal_torque=1"],
            "motor.stal_torque: unknown field `stal_torque` (did you mean `stall_torque_n",
        ),
        // The key of another table, and a word of a longer key.
        (
            ["run", "flat", "--set", "friction=0.5"],
            "friction: unknown field `friction`; use `terrain.friction`\n",
        ),
        (
            ["run", "flat", "--set", "stall_torque_n_m=1"],
            "stall_torque_n_m: unknown field `stall_torque_n_m`; use `vehicle.motor.stall_torque_n_m`\n",
        ),
        (
            ["run", "flat", "--set", "vehicle.kp_n_m_s_rad=1"],
            "kp_n_m_s_rad: unknown field `kp_n_m_s_rad`; use `gains.kp_n_m_s_rad`\n",
        ),
        // No key of this kind of ground; in a list of the vehicle; nowhere else alone.
        (
            ["run", "flat", "--set", "terrain.height_m=0.1"],
            "terrain.height_m: unknown field `height_m`, expected `friction`",
        ),
        (
            ["run", "flat", "--set", "mass_kg=3"],
            "mass_kg: unknown field `mass_kg`, expected one of schema_version",
        ),
        (
            ["run", "flat", "--set", "control.policy=pid"],
            "control.policy: \"pid\" (did you mean \"independent\"?), allowed: auto, independent",
        ),
        (
            ["run", "flat", "--set", "vehicle.wheel.radius_m=0.1"],
            "wheel.radius_m: element \"radius_m\", allowed: * for all, 0 to 6",
        ),
        (
            ["run", "flat", "--set", "sensors.gyro=1"],
            "sensors.gyro: unknown field `gyro` (did you mean `gyro_bias_rad_s`?)",
        ),
    ] {
        let said = refused(path, &args);
        assert!(said.contains(expected), "{said}\nhas no\n{expected}");
    }
    let study = fs::read_to_string(path.join("y.toml")).unwrap();
    fs::write(path.join("y.toml"), study.replace("[[axis]]", "[[axes]]")).unwrap();
    let said = refused(path, &["check", "y.toml"]);
    assert!(
        said.contains("y.toml: axes: unknown field `axes` (did you mean `axis`?)"),
        "{said}"
    );
}

#[test]
fn help_and_message_of_a_python_command_name_the_same_extra() {
    let folder = tempfile::tempdir().unwrap();
    let help = stdout(&omnistep(folder.path(), &["help"]));
    let commands: Vec<_> = help
        .lines()
        .filter(|line| line.ends_with("[Python]"))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert_eq!(commands.len(), 7, "{help}");
    let extra = |text: &str| {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let named = text
            .split_once("its extra \"")
            .and_then(|(_, rest)| rest.split_once('"'));
        named.map(|(extra, _)| extra.to_owned())
    };
    for command in commands {
        let named = match command {
            "video" | "report" => "view",
            "plot" | "resimulate" => "plot",
            "identify" | "calibrate" => "identify",
            import => import,
        };
        let of_help = extra(&stdout(&omnistep(folder.path(), &["help", command])));
        let said = refused(folder.path(), &[command, "x.mcap", "-o", "y"]);
        assert_eq!(
            [of_help, extra(&said)],
            [Some(named.to_owned()), Some(named.to_owned())],
            "{command}: {said}"
        );
        assert!(said.contains(&format!("pip install \".[{named}]\"")), "{said}");
    }
}

#[test]
fn a_missing_file_is_answered_with_the_name_that_was_meant() {
    let folder = one_of_each();
    let path = folder.path();
    fs::copy(path.join("v.toml"), path.join("mybot.toml")).unwrap();
    for (args, expected) in [
        (&["check", "setp"][..], "error: setp (did you mean \"step\"?): "),
        (
            &["check", "mecanum"],
            "error: mecanum (did you mean \"mecanum4\"?): ",
        ),
        (
            &["check", "climbmap"],
            "error: climbmap (did you mean \"climb_map\"?): ",
        ),
        (
            &["check", "mybot"],
            "error: mybot (did you mean \"mybot.toml\"?): ",
        ),
        (
            &["check", "mybto.toml"],
            "error: mybto.toml (did you mean \"mybot.toml\"?): ",
        ),
        (
            &["check", "moon"],
            "error: moon (omnistep list prints what is built in): ",
        ),
        (&["check", "moon.toml"], "error: moon.toml: "),
        (
            &["run", "mybto.toml"],
            "error: mybto.toml (did you mean \"mybot.toml\"?): ",
        ),
        (
            &["run", "flat.toml"],
            "error: flat.toml (did you mean \"flat\"?): ",
        ),
        (&["study", "x/../yy.toml"], "error: x/../yy.toml: "),
        (
            &["export", "mybto.toml", "--format", "urdf"],
            "error: mybto.toml (did you mean \"mybot.toml\"?): ",
        ),
    ] {
        let said = refused(path, args);
        assert!(said.starts_with(expected), "{said}has no\n{expected}");
        // Of Windows: "The system cannot find the file specified."
        assert!(
            said.contains("No such file") || said.contains("cannot find"),
            "{said}"
        );
    }
}
