//! Files that the command line starts, checks and describes.

use std::fs;

use serde_json::Value;

use super::{omnistep, refused, rows, stdout, words};

#[test]
fn a_new_file_is_checked_runs_and_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let said = omnistep(folder.path(), &["new", "vehicle", "rover", "--template", "omni3"]);
    assert_eq!(
        stdout(&said),
        "rover.toml: started from omni3; run it with: omnistep run flat --set vehicle=rover.toml\n"
    );
    let said = omnistep(folder.path(), &["new", "scenario", "kerb"]);
    assert_eq!(
        stdout(&said),
        "kerb.toml: started from step; run it with: omnistep run kerb.toml\n"
    );
    let said = omnistep(folder.path(), &["check", "rover.toml", "kerb.toml"]);
    assert_eq!(
        stdout(&said),
        "rover.toml: vehicle rover: 1 body, 0 hinges, 3 wheels, 7.200 kg\n  \
         layout   condition number 1.00 (1 is best)\n  \
         encoders all 3 are needed: without one the motion is unknown, and the drive stops\n  \
         weight   centre of mass at (0.017, 0.000, 0.075) m\n  \
         loads    at rest on flat ground [N]: 1 27.9, 2 21.4, 3 21.4\n  \
         under    clearance [m]: 0.030 under base\n  \
         speed    motors reach 33.3 rad/s without load: 1.92 m/s forward, 1.67 m/s sideways, 9.26 rad/s in yaw\n  \
         gains    kp 0.1500 N.m.s/rad, ki 0.8000 N.m/rad, kd 0 N.m.s2/rad, given\n  \
         policy   traction if none is named: the best that sensors and motors allow\n  \
         wheels   balls on level ground; rollers at an edge, because the ground's normal leans 90 deg \
         out of the rolling plane of wheel 1, allowed: 10\n\
         kerb.toml: scenario kerb, 6 s, policy traction, engine rapier; vehicle chugo7: 3 bodies, 2 hinges, 7 wheels, 20.000 kg\n  \
         layout   condition number 1.58 (1 is best)\n  \
         weight   centre of mass at (0.000, 0.000, 0.134) m\n  \
         loads    at rest on flat ground [N]: 1 21.6, 2 21.6, 3 21.6, 4 66.7, 5 21.6, 6 21.6, 7 21.6\n  \
         shares   row at x = 0.3 m: 33 % on transverse wheel 6; row at x = -0.3 m: 33 % on transverse wheel 2\n  \
         under    clearance [m]: 0.036 under middle, 0.066 under front rear\n  \
         gains    kp 0.3000 N.m.s/rad, ki 2.0000 N.m/rad, kd 0 N.m.s2/rad, given\n  \
         wheels   balls, a valid model over a step of 5.0 cm\n"
    );
    let run = [
        "run",
        "flat",
        "--set",
        "vehicle=rover.toml",
        "--set",
        "duration_s=0.1",
        "--json",
    ];
    assert!(omnistep(folder.path(), &run).status.success());

    let own = fs::read_to_string(folder.path().join("rover.toml"))
        .unwrap()
        .replace("mass_kg = 6.0", "mass_kg = -6.0");
    fs::write(folder.path().join("rover.toml"), &own).unwrap();
    let said = refused(folder.path(), &["new", "vehicle", "rover"]);
    assert_eq!(
        said,
        "error: rover.toml: the file exists and was not changed; use another name, or move it away first\n"
    );
    assert_eq!(fs::read_to_string(folder.path().join("rover.toml")).unwrap(), own);
    let said = refused(folder.path(), &["new", "vehicle", "my robot"]);
    assert_eq!(
        said,
        "error: new my robot: name: \"my robot\", allowed: 1 to 40 letters, digits, '_' or '-'\n"
    );
    // No file of these names can be made on Windows, whatever their extension and case.
    for device in ["con", "Nul", "COM1", "lpt9", "aux", "prn"] {
        let said = refused(folder.path(), &["new", "vehicle", device]);
        assert_eq!(
            said,
            format!(
                "error: new {device}: name: \"{device}\", allowed: another name: on Windows this is a device\n"
            )
        );
    }
    for (name, kind) in [("console", "vehicle"), ("com10", "scenario"), ("con_1", "study")] {
        assert!(
            omnistep(folder.path(), &["new", kind, name]).status.success(),
            "{name}"
        );
    }
}

#[test]
fn schemas_are_printed_and_a_new_file_names_the_one_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let first = |name: &str| {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        text.lines().next().unwrap().to_owned()
    };
    assert!(omnistep(folder.path(), &["new", "vehicle", "a"]).status.success());
    assert!(
        first("a.toml")
            .starts_with("# For completion in an editor: omnistep schema vehicle > vehicle.schema.json")
    );
    for kind in ["vehicle", "scenario", "experiment"] {
        let text = stdout(&omnistep(folder.path(), &["schema", kind]));
        let schema: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
        assert_eq!(schema["properties"]["schema_version"]["maximum"], 1);
        fs::write(folder.path().join(format!("{kind}.schema.json")), text).unwrap();
    }
    assert!(omnistep(folder.path(), &["new", "vehicle", "b"]).status.success());
    assert_eq!(first("b.toml"), "#:schema ./vehicle.schema.json");
    assert!(
        omnistep(folder.path(), &["new", "scenario", "c"])
            .status
            .success()
    );
    assert_eq!(first("c.toml"), "#:schema ./scenario.schema.json");
    assert!(
        omnistep(folder.path(), &["check", "a.toml", "b.toml", "c.toml"])
            .status
            .success()
    );
}

#[test]
fn in_a_new_excitation_no_wheel_slips() {
    let folder = tempfile::tempdir().unwrap();
    for vehicle in omni_config::builtin_vehicles() {
        let name = format!("grip_{vehicle}");
        omnistep(folder.path(), &["new", "excitation", &name, "--vehicle", vehicle]);
        let path = folder.path().join(format!("{name}.toml"));
        let scenario = omni_config::Scenario::load(path.to_str().unwrap(), &[]).unwrap();
        let trace = omni_sim::run(&scenario).unwrap();
        // Contacts creep by some ten thousandths of the speed. Slip is a hundred times as much: 0.4 m/s
        // where a ramp asks for more than friction gives. Single periods do not count, means over ten do.
        let top = scenario.vehicle().top_speeds().unwrap();
        let max_m_s = 0.002 * top[0].max(top[1]);
        for wheel in 0..scenario.vehicle().wheel.len() {
            let [rim, along] = ["rim_m_s", "along_m_s"].map(|signal| trace.wheel(signal, wheel).unwrap());
            let slips: Vec<_> = rim.iter().zip(along).map(|(rim, along)| rim - along).collect();
            let worst = slips
                .windows(10)
                .map(|ten| (ten.iter().sum::<f64>() / 10.0).abs())
                .fold(0.0, f64::max);
            assert!(worst < max_m_s, "{vehicle}, wheel {wheel}: {worst} m/s");
        }
    }
}

#[test]
fn a_new_excitation_stays_within_the_limits_of_its_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    for vehicle in omni_config::builtin_vehicles() {
        let name = format!("of_{vehicle}");
        let said = omnistep(folder.path(), &["new", "excitation", &name, "--vehicle", vehicle]);
        assert_eq!(
            stdout(&said),
            format!("{name}.toml: an excitation for {vehicle}; run it with: omnistep run {name}.toml\n")
        );
        let scenario =
            omni_config::Scenario::load(folder.path().join(format!("{name}.toml")).to_str().unwrap(), &[])
                .unwrap();
        let limits = scenario.vehicle().limits.unwrap();
        let duration_s = scenario.duration_s;
        // The whole share in each direction, both ways, and never more; at rest in the end.
        let mut most = [[0.0_f64; 3]; 2];
        for step in 0..(100.0 * duration_s) as usize {
            let twist = scenario.command.at(0.01 * step as f64).to_array();
            for axis in 0..3 {
                most[0][axis] = most[0][axis].max(twist[axis]);
                most[1][axis] = most[1][axis].max(-twist[axis]);
            }
        }
        for most in most {
            assert!(most[0] <= 0.6 * limits.vx_m_s + 1e-3 && most[1] <= 0.6 * limits.vy_m_s + 1e-3);
            assert!(most[2] <= 0.6 * limits.wz_rad_s + 1e-3);
            assert!(most.iter().all(|most| *most > 0.05), "{vehicle} {most:?}");
        }
        assert_eq!(scenario.command.at(duration_s).to_array(), [0.0; 3]);
    }
    let said = refused(folder.path(), &["new", "excitation", "a", "--vehicle", "omni33"]);
    assert!(said.contains("omni3") && said.lines().count() == 1, "{said}");
    let said = refused(folder.path(), &["new", "vehicle", "a", "--vehicle", "omni3"]);
    assert_eq!(
        said,
        "error: --vehicle = omni3, allowed: only with new scenario, new excitation and new import-map\n"
    );
}

#[test]
fn a_new_import_map_names_the_wheels_and_overwrites_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let said = omnistep(
        folder.path(),
        &["new", "import-map", "mine", "--vehicle", "mecanum4"],
    );
    assert_eq!(
        stdout(&said),
        "mine.toml: an import map for mecanum4; write the names of your log's columns into it, then: omnistep import LOG --map mine.toml\n"
    );
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    let map: toml::Table = text.parse().unwrap();
    assert_eq!(map["vehicle"].as_str(), Some("mecanum4"));
    let wheels: Vec<_> = map["wheels"]["names"]
        .as_array()
        .unwrap()
        .iter()
        .map(|name| name.as_str().unwrap())
        .collect();
    let own: Vec<_> = omni_config::Vehicle::load("mecanum4")
        .unwrap()
        .wheel
        .iter()
        .map(|wheel| format!("encoder_{}", wheel.name))
        .collect();
    assert_eq!(wheels, own);
    assert!(!text.contains("hinge"));
    let said = refused(folder.path(), &["new", "import-map", "mine"]);
    assert!(
        said.contains("mine.toml") && said.contains("was not changed"),
        "{said}"
    );
    assert!(
        omnistep(folder.path(), &["new", "import-map", "climber"])
            .status
            .success()
    );
    let climber = std::fs::read_to_string(folder.path().join("climber.toml")).unwrap();
    assert!(
        climber.contains("# names = [\"hinge_pitch\", \"hinge_roll\"]"),
        "{climber}"
    );
    let said = refused(folder.path(), &["new", "import-map", "../mine"]);
    assert!(said.contains("letters, digits"), "{said}");
    let said = refused(folder.path(), &["new", "import-map", "a", "--template", "step"]);
    assert!(
        said.starts_with("error: --template = step, allowed: only with"),
        "{said}"
    );
}

#[test]
fn a_new_scenario_simulates_rollers_where_balls_are_invalid() {
    let folder = tempfile::tempdir().unwrap();
    for (vehicle, like, wheels) in [
        ("mecanum4", "step", "rollers"),
        ("mecanum4", "bumps", "rollers"),
        ("mecanum4", "flat", "balls, a valid model on flat ground"),
        ("chugo7", "step", "balls, a valid model over a step of 5.0 cm"),
    ] {
        let name = format!("{vehicle}_{like}");
        let args = ["new", "scenario", &name, "--template", like, "--vehicle", vehicle];
        assert!(omnistep(folder.path(), &args).status.success());
        let checked = omnistep(folder.path(), &["check", &format!("{name}.toml")]);
        assert!(
            stdout(&checked).contains(&format!("  wheels   {wheels}\n")),
            "{checked:?}"
        );
    }
}

#[test]
fn a_new_scenario_is_like_another_with_a_vehicle_of_ones_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    assert!(
        omnistep(path, &["new", "vehicle", "mybot", "--template", "omni3"])
            .status
            .success()
    );
    let scenarios = stdout(&omnistep(path, &["list", "scenarios"]));
    for like in scenarios
        .lines()
        .filter_map(|line| line.split_whitespace().next())
    {
        let name = format!("my_{like}");
        let output = omnistep(
            path,
            &[
                "new",
                "scenario",
                &name,
                "--template",
                like,
                "--vehicle",
                "mybot.toml",
            ],
        );
        assert!(output.status.success(), "{output:?}");
        let text = fs::read_to_string(path.join(format!("{name}.toml"))).unwrap();
        assert!(text.contains("\nvehicle = \"mybot.toml\"\n"), "{like}: {text}");
        let checked = stdout(&omnistep(path, &["check", &format!("{name}.toml")]));
        assert!(checked.contains("mybot"), "{checked}");
    }
    let said = refused(
        path,
        &words("new scenario other --template bumps --vehicle mybt.toml"),
    );
    assert!(said.contains("mybt.toml"), "{said}");
    assert!(!path.join("other.toml").exists());
}

#[test]
fn a_new_scenario_has_its_obstacle_ahead_of_a_long_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // 1.5 m from rim to rim.
    let long = omni_config::FileKind::Vehicle
        .template("mecanum4")
        .unwrap()
        .replace("position_m = [0.25,", "position_m = [0.836,")
        .replace("position_m = [-0.25,", "position_m = [-0.512,");
    fs::write(path.join("long.toml"), long).unwrap();
    let scenarios = stdout(&omnistep(path, &["list", "scenarios"]));
    let names = scenarios
        .lines()
        .filter_map(|line| line.split_whitespace().next());
    let mut longer = 0;
    for like in names {
        let usual = omni_config::Scenario::load(like, &[]).unwrap();
        let name = format!("long_{like}");
        let new = [
            "new",
            "scenario",
            &name,
            "--template",
            like,
            "--vehicle",
            "long.toml",
        ];
        let output = omnistep(path, &new);
        assert!(output.status.success(), "{like}: {output:?}");
        let text = fs::read_to_string(path.join(format!("{name}.toml"))).unwrap();
        if usual.terrain.obstacle().is_none() {
            assert!(!text.contains("for the length of this vehicle"), "{text}");
            continue;
        }
        longer += 1;
        // 0.836 + 0.076 to the foremost rim and 0.3 to the obstacle are 1.212: in tenths, 0.6 more
        // than usual. The rear wheels are 0.262 m farther behind than with mecanum4, which is
        // longer behind than most: at 0.3 m/s some 2 s, and up to 1.
        assert!(text.contains("\nstart_x_m = 1.3  "), "{like}: {text}");
        let file = path.join(format!("{name}.toml"));
        let scenario = omni_config::Scenario::load(file.to_str().unwrap(), &[]).unwrap();
        let more_s = scenario.duration_s - usual.duration_s;
        assert!((2.0..=4.0).contains(&more_s), "{like}: {more_s} s more");
    }
    assert!(longer >= 8, "{longer}");
    let run = [
        "run",
        "long_bumps.toml",
        "--quiet",
        "--json",
        "--set",
        "physics.engine=articulated",
    ];
    let row = &rows(&omnistep(path, &run))[0];
    assert_eq!(row["verdict"], "climbed", "{row}");
}

#[test]
fn a_scenario_of_five_lines_runs_as_one_that_writes_every_key() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let short = "schema_version = 1\nname = \"cable\"\nvehicle = \"mecanum4\"\nterrain = { kind = \"flat\", friction = 0.7 }\n\
                 command = { vx_m_s = 0.2 }\n";
    assert_eq!(short.lines().count(), 5);
    fs::write(path.join("short.toml"), short).unwrap();
    let long = short.replace(
        "vx_m_s = 0.2 }",
        "vx_m_s = 0.2, vy_m_s = 0.0, wz_rad_s = 0.0, ramp_s = 0.3 }",
    ) + "duration_s = 10.0\n[control]\npolicy = \"traction\"\nperiod_s = 0.001\nprecision = \"f64\"\n\
           [physics]\nengine = \"articulated\"\ntimestep_s = 0.0005\ncontact_frequency_hz = 200.0\ncontact_damping_ratio = 5.0\ngravity_m_s2 = 9.81\n\
           wheel_model = \"auto\"\n";
    fs::write(path.join("long.toml"), long).unwrap();
    let log = |file: &str| {
        let run = ["run", file, "--quiet", "--out", file.split('.').next().unwrap()];
        let output = omnistep(path, &run);
        assert!(output.status.success(), "{output:?}");
        fs::read(path.join(run[4]).join("cable-traction.mcap")).unwrap()
    };
    assert!(log("short.toml") == log("long.toml"));
    // What says what the run is about has no default.
    for (line, said) in [(3, "terrain"), (4, "command")] {
        let without: Vec<_> = short
            .lines()
            .enumerate()
            .filter(|(k, _)| *k != line)
            .map(|(_, text)| text)
            .collect();
        fs::write(path.join("w.toml"), without.join("\n")).unwrap();
        let message = refused(path, &["run", "w.toml"]);
        assert!(message.contains(&format!("missing field `{said}`")), "{message}");
    }
}
