//! Vehicles and scenarios as files of other simulators.

use super::{omnistep, refused, stderr, stdout, words};

#[test]
fn constants_of_a_vehicle_say_which_scenario_they_are_of() {
    let folder = tempfile::tempdir().unwrap();
    let said = |args: &[&str]| stderr(&omnistep(folder.path(), args));
    assert!(
        said(&["export", "mecanum4", "--format", "c"]).starts_with(
            "mecanum4: a vehicle, so its commands, sensors and actuators are those of the scenario flat; those of another: \
             omnistep export SCENARIO --vehicle mecanum4\n"
        )
    );
    // It was asked for.
    assert!(!said(&["export", "flat", "--vehicle", "mecanum4", "--format", "c"]).contains("a vehicle, so"));
}

#[test]
fn a_vehicle_as_urdf_has_its_masses_and_axes() {
    let folder = tempfile::tempdir().unwrap();
    let text = stdout(&omnistep(
        folder.path(),
        &["export", "rocker_bogie6", "--format", "urdf"],
    ));
    let robot = urdf_rs::read_from_string(&text).unwrap();
    let vehicle = omni_config::Vehicle::load("rocker_bogie6").unwrap();
    let masses = |links: &[urdf_rs::Link]| {
        links
            .iter()
            .map(|link| link.inertial.mass.value)
            .collect::<Vec<_>>()
    };
    let bodies = vehicle.body.iter().map(|body| body.mass_kg);
    let wheels = vehicle.wheel.iter().map(|wheel| wheel.mass_kg);
    assert_eq!(masses(&robot.links), bodies.chain(wheels).collect::<Vec<_>>());
    let joint = |name: &str| robot.joints.iter().find(|joint| joint.name == name).unwrap();
    for hinge in &vehicle.hinge {
        let found = joint(&hinge.name);
        assert_eq!(
            (found.axis.xyz.0, found.limit.upper),
            (hinge.axis, hinge.limit_rad)
        );
    }
    for wheel in &vehicle.wheel {
        let [x, y, z] = joint(&format!("wheel_{}", wheel.name)).axis.xyz.0;
        let [dx, dy] = wheel.rolling_direction;
        let length = dx.hypot(dy);
        // The axle is the rolling direction turned to the left.
        assert!((x + dy / length).abs() < 1e-12 && (y - dx / length).abs() < 1e-12 && z == 0.0);
    }
    // A differential: one rocker mimics the other, reversed.
    let mimics: Vec<_> = robot
        .joints
        .iter()
        .filter_map(|joint| joint.mimic.as_ref())
        .collect();
    assert_eq!(mimics.len(), 1);
    assert_eq!(mimics[0].multiplier, Some(-vehicle.coupling[0].ratio));
}

#[test]
fn an_option_of_one_format_is_refused_with_another() {
    let folder = tempfile::tempdir().unwrap();
    let said = |args: &str| refused(folder.path(), &words(args));
    for format in ["urdf", "ros2-control"] {
        assert_eq!(
            said(&format!("export chugo7 --vehicle omni3 --format {format}")),
            "error: --vehicle = omni3, allowed: only with --format mjcf, rust and c; for urdf and ros2-control NAME is the \
             vehicle\n"
        );
    }
    for format in ["mjcf", "ros2-control", "rust", "c"] {
        assert_eq!(
            said(&format!("export omni3 --ros2-control effort --format {format}")),
            "error: --ros2-control = effort, allowed: only with --format urdf\n"
        );
    }
}

#[test]
fn a_vehicle_alone_has_the_constants_of_flat_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let text = |args: &str| stdout(&omnistep(folder.path(), &words(args)));
    for (format, start) in [("rust", "//"), ("c", "/*")] {
        let alone = text(&format!("export omni3 --format {format}"));
        assert!(alone.starts_with(start), "{alone}");
        assert_eq!(
            alone,
            text(&format!("export flat --vehicle omni3 --format {format}"))
        );
    }
}

#[test]
fn a_scenario_as_mjcf_has_every_roller_hinge_coupling_and_motor() {
    let folder = tempfile::tempdir().unwrap();
    let args = words("export step --format mjcf --set vehicle=rocker_bogie6");
    let text = stdout(&omnistep(folder.path(), &args));
    let count = |what: &str| text.matches(what).count();
    // Six wheels of twelve rollers, each on a bearing, of three ellipsoids; five bodies on a free
    // joint and four hinges.
    assert_eq!(count("_roller_"), 2 * 6 * 12);
    assert_eq!(count("type=\"ellipsoid\""), 3 * 6 * 12);
    assert_eq!(
        [count("<body"), count("<freejoint"), count("type=\"hinge\"")],
        [5 + 6 + 6 * 12, 1, 4]
    );
    assert_eq!([count("polycoef=\"0 -1 0 0 0\""), count("<motor")], [1, 6]);
    // The floor, and the step's box from 0.7 m on with its top at 5 cm.
    assert_eq!([count("type=\"plane\""), count("type=\"box\"")], [1, 1 + 5]);
    let to = words("export step --format mjcf --set vehicle=rocker_bogie6 -o r.xml");
    assert_eq!(stdout(&omnistep(folder.path(), &to)), "");
    assert_eq!(
        std::fs::read_to_string(folder.path().join("r.xml")).unwrap(),
        text
    );
}

#[test]
fn a_crown_that_leaves_the_rim_is_a_polyhedron_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let args = words("export mecanum4 --format mjcf --set vehicle.rollers.crown_m=0");
    let text = stdout(&omnistep(folder.path(), &args));
    assert_eq!(
        [
            text.matches("<mesh ").count(),
            text.matches("type=\"mesh\"").count()
        ],
        [4, 4 * 9]
    );
    assert!(text.contains("does not follow the wheel's rim"));
}

#[test]
fn friction_patches_are_boxes_on_level_ground_else_refused() {
    let folder = tempfile::tempdir().unwrap();
    let ice = ["export", "ice", "--format", "mjcf"];
    let text = stdout(&omnistep(folder.path(), &ice));
    assert_eq!(
        text.matches("priority=\"2\"").count(),
        text.matches("name=\"friction_").count()
    );
    assert!(text.contains("name=\"friction_"));
    let patch = "friction_patch=[{ x_m = [0.0, 1.0], y_m = [-1.0, 1.0], friction = 0.1 }]";
    assert_eq!(
        refused(
            folder.path(),
            &["export", "ramp", "--format", "mjcf", "--set", patch]
        ),
        "error: scenario ramp: friction_patch: allowed in MJCF: only ground of level boxes (flat, step, step_down, \
         stairs, half_step, ditch)\n"
    );
}

#[test]
fn a_file_that_cannot_be_written_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let said = refused(
        folder.path(),
        &["export", "omni3", "--format", "mjcf", "-o", "no/such/folder.xml"],
    );
    assert!(said.starts_with("error: no/such/folder.xml: "), "{said}");
}

#[test]
fn no_file_that_an_export_reads_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let template = |kind: omni_config::FileKind, name| kind.template(name).unwrap();
    let flat = template(omni_config::FileKind::Scenario, "flat");
    let files = [
        (
            "run.toml",
            flat.replace("\"chugo7\"", "\"own.toml\"").replace(
                "vx_m_s = 0.3\nvy_m_s = 0.0\nwz_rad_s = 0.0\nramp_s = 0.3",
                "file = \"way.csv\"",
            ),
        ),
        (
            "own.toml",
            template(omni_config::FileKind::Vehicle, "omni3").to_owned(),
        ),
        (
            "way.csv",
            "time_s,vx_m_s,vy_m_s,wz_rad_s\n0.5,0.3,0,0\n".to_owned(),
        ),
    ];
    for (name, text) in &files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let args = ["export", "run.toml", "--format", "mjcf", "-o"];
    for (name, text) in &files {
        let said = refused(folder.path(), &[&args[..], &[name]].concat());
        let kept = "this command reads this file, allowed: another name";
        assert!(said.starts_with(&format!("error: {name}: {kept}")), "{said}");
        assert_eq!(std::fs::read_to_string(folder.path().join(name)).unwrap(), *text);
    }
    let set = words("export flat --format mjcf --set vehicle=own.toml -o own.toml");
    let said = refused(folder.path(), &set);
    assert!(said.contains("this command reads this file"), "{said}");
    assert!(
        omnistep(folder.path(), &[&args[..], &["run.xml"]].concat())
            .status
            .success()
    );
}

#[test]
fn names_that_mjcf_would_have_twice_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let said = |set: &str| {
        refused(
            folder.path(),
            &["export", "step", "--format", "mjcf", "--set", set],
        )
    };
    let allowed = "allowed in MJCF: any name except \"free\" and the names of wheels and rollers (wheel_NAME, wheel_NAME_roller_K)\n";
    assert_eq!(
        said("vehicle.hinge.0.name=free"),
        format!("error: vehicle chugo7: hinge[0].name: \"free\", {allowed}")
    );
    assert_eq!(
        said("vehicle.wheel.1.name=1_roller_3"),
        format!("error: vehicle chugo7: wheel[1].name: \"1_roller_3\", {allowed}")
    );
    // A patch on the step is a box there and one below it: each has a name of its own.
    let patch = "friction_patch=[{ x_m = [1.0, 1.2], y_m = [-1.0, 1.0], friction = 0.2 }]";
    let text = stdout(&omnistep(
        folder.path(),
        &["export", "step", "--format", "mjcf", "--set", patch],
    ));
    let mut names: Vec<_> = text
        .split("name=\"")
        .skip(1)
        .filter(|rest| rest.starts_with("friction_"))
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    assert_eq!(names.len(), 2);
    names.dedup();
    assert_eq!(names.len(), 2);
}

/// Every file below a folder with its text.
fn files(folder: &std::path::Path) -> Vec<(String, String)> {
    let mut all = Vec::new();
    for name in ["", "msg"] {
        for entry in std::fs::read_dir(folder.join(name)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                let name = path.strip_prefix(folder).unwrap().to_str().unwrap();
                all.push((name.replace('\\', "/"), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    all.sort();
    all
}

#[test]
fn the_package_of_messages_replaces_its_own_files_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let export = words("export --format ros2-msgs");
    let to = |name| [&export[..], &["-o", name]].concat();
    let mut expected = omni_log::ros2_messages();
    expected.sort();
    let path = |name| folder.path().join(name);
    // New, then its own again, one file of it changed; in an empty folder, and below one that is missing.
    assert_eq!(stdout(&omnistep(folder.path(), &export)), "");
    assert_eq!(files(&path("omnistep_msgs")), expected);
    std::fs::write(path("omnistep_msgs/msg/Sensors.msg"), "of an earlier version").unwrap();
    assert_eq!(stdout(&omnistep(folder.path(), &export)), "");
    std::fs::create_dir(path("empty")).unwrap();
    for name in ["empty", "ws/src/omnistep_msgs"] {
        assert_eq!(stdout(&omnistep(folder.path(), &to(name))), "");
        assert_eq!(files(&path(name)), expected);
    }
    // What is not its own is kept, whole.
    let kept = "not of this export, allowed: a folder that is new, empty or an earlier export";
    for (name, file) in [
        ("notes", "notes/to-do.txt"),
        ("inner", "inner/msg/Own.msg"),
        // A package of others with the same files.
        ("other", "other/package.xml"),
    ] {
        std::fs::create_dir_all(path(name).join("msg")).unwrap();
        std::fs::write(path(file), "mine").unwrap();
        assert_eq!(
            refused(folder.path(), &to(name)),
            format!("error: {}: {kept}\n", std::path::Path::new(file).display())
        );
        assert_eq!(files(&path(name)).len(), 1, "{name}");
        assert_eq!(std::fs::read_to_string(path(file)).unwrap(), "mine");
    }
    std::fs::create_dir(path("bare")).unwrap();
    std::fs::write(path("bare/CMakeLists.txt"), "mine").unwrap();
    let said = refused(folder.path(), &to("bare"));
    assert!(
        said.starts_with("error: bare/package.xml: not of this export"),
        "{said}"
    );
    std::fs::write(path("file"), "mine").unwrap();
    assert!(refused(folder.path(), &to("file")).starts_with("error: file: "));
}

#[test]
fn the_package_of_messages_is_of_no_vehicle_and_all_else_is_of_one() {
    let folder = tempfile::tempdir().unwrap();
    let said = |args: &str| refused(folder.path(), &words(args));
    for (arguments, value) in [
        ("flat", "NAME = flat"),
        ("--vehicle omni3", "--vehicle = omni3"),
        ("--set seed=1", "--set = seed=1"),
    ] {
        assert_eq!(
            said(&format!("export --format ros2-msgs {arguments}")),
            format!("error: {value}, allowed: nothing with --format ros2-msgs, which is of no vehicle\n")
        );
    }
    assert!(!folder.path().join("omnistep_msgs").exists());
    for format in ["mjcf", "urdf", "ros2-control", "rust", "c"] {
        let said = stderr(&omnistep(folder.path(), &["export", "--format", format]));
        assert!(said.contains("not provided:\n  <NAME>\n"), "{said}");
    }
}
