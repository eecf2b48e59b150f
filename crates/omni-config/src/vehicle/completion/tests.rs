//! Short vehicles, and what is wrong in them.

use crate::{FileKind, Override, Source, Vehicle};

const SHORT: &str = r#"
schema_version = 1
name = "short"
total_mass_kg = 8.8
[[body]]
name = "frame"
inertia_box_m = [0.4, 0.35, 0.12]
[motor]
stall_torque_kg_cm = 24.3
no_load_rpm = 312
[mecanum4]
wheelbase_m = 0.3
track_m = 0.4
radius_m = 0.05
wheel_mass_kg = 0.4
"#;

fn vehicle(text: &str, keys: &[&str]) -> Result<Vehicle, String> {
    let keys: Vec<_> = keys
        .iter()
        .map(|key| Override::parse(key).expect("a key"))
        .collect();
    Vehicle::from_source(&Source::text("short.toml", text), &keys).map_err(|error| error.to_string())
}

#[test]
fn nine_numbers_describe_a_mecanum_base() {
    let short = vehicle(SHORT, &[]).expect("whole");
    let built_in = Vehicle::load("mecanum4").expect("built in");
    // The hands are those of the built-in one, whose rollers on the ground form a diamond.
    for (own, theirs) in short.wheel.iter().zip(&built_in.wheel) {
        assert_eq!(own.name, theirs.name);
        assert!((own.roller_angle_rad - theirs.roller_angle_rad).abs() < 1e-9);
        assert_eq!(
            own.position_m.map(f64::signum),
            theirs.position_m.map(f64::signum)
        );
        assert_eq!(own.position_m.map(f64::abs), [0.15, 0.2]);
        assert_eq!(own.inertia_kg_m2, 0.4 * 0.05 * 0.05 / 2.0);
    }
    assert!((short.motor.stall_torque_n_m - 2.383).abs() < 1e-3); // 24.3 kg.cm
    assert!((short.body[0].mass_kg - (8.8 - 4.0 * 0.4)).abs() < 1e-12);
    assert_eq!(short.body[0].com_m, [0.0, 0.0, 0.06]);
    assert_eq!(short.assumptions().len(), 3, "{:?}", short.assumptions());
    // What was assumed is written out: read again, nothing is left to assume.
    let written = toml::to_string(&short).expect("plain data");
    let again = vehicle(&written, &[]).expect("whole");
    assert_eq!(
        (again.assumptions().len(), &again.wheel, &again.body),
        (0, &short.wheel, &short.body)
    );
}

#[test]
fn three_wheels_in_a_circle_are_those_of_the_built_in_vehicle() {
    let form =
        "[omni3]\nlever_m = 0.18\nradius_m = 0.05\nwheel_mass_kg = 0.4\nwheel_inertia_kg_m2 = 0.0007\n";
    let text = FileKind::Vehicle.template("omni3").expect("built in");
    let (before, _) = text.split_once("[[wheel]]").expect("it has wheels");
    let (short, whole) = (
        vehicle(&format!("{before}{form}"), &[]),
        Vehicle::load("omni3").expect("built in"),
    );
    for (own, theirs) in short.expect("whole").wheel.iter().zip(&whole.wheel) {
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-8 && (a[1] - b[1]).abs() < 1e-8;
        assert!(
            near(own.position_m, theirs.position_m) && near(own.rolling_direction, theirs.rolling_direction)
        );
    }
}

#[test]
fn a_rotor_behind_a_gear_adds_its_inertia_by_the_square_of_the_ratio() {
    let keys = ["motor.rotor_inertia_kg_m2=1e-6", "motor.gear_ratio=20"];
    let with = vehicle(SHORT, &keys).expect("whole");
    assert!((with.wheel[0].inertia_kg_m2 - (0.0005 + 1e-6 * 400.0)).abs() < 1e-12);
}

#[test]
fn rollers_that_no_file_gives_leave_no_gaps() {
    for (name, text) in [
        ("short", SHORT),
        ("omni3", FileKind::Vehicle.template("omni3").expect("built in")),
    ] {
        let mut own = vehicle(text, &[]).expect("whole");
        own.rollers = None;
        for wheel in 0..own.wheel.len() {
            let built = own.rollers(wheel, crate::WheelModel::Rollers).expect("as usual");
            let radius_m = own.wheel[wheel].radius_m;
            // A full turn in steps of a tenth of a degree: the rim is round to a thousandth.
            let heights =
                (0..3600).map(|tenth| built.axle_height_m(f64::from(tenth) * 1e-1_f64.to_radians()));
            let (least, most) = heights.fold((f64::INFINITY, 0.0_f64), |(least, most), h| {
                (least.min(h), most.max(h))
            });
            assert!(
                most - least < 1e-3 * radius_m && (most / radius_m - 1.0).abs() < 1e-3,
                "{name}: {least} to {most}"
            );
        }
    }
}

#[test]
fn a_wheel_of_a_short_form_is_set_as_one_that_is_written_out() {
    let set = vehicle(
        SHORT,
        &[
            "wheel.*.mass_kg=0.5",
            "mecanum4.radius_m=0.06",
            "wheel.1.radius_m=0.07",
        ],
    );
    let set = set.expect("whole");
    let sizes: Vec<_> = set
        .wheel
        .iter()
        .map(|wheel| (wheel.mass_kg, wheel.radius_m))
        .collect();
    assert_eq!(sizes, [(0.5, 0.06), (0.5, 0.07), (0.5, 0.06), (0.5, 0.06)]);
    // What is left of the total mass knows of it.
    assert!((set.body[0].mass_kg - (8.8 - 4.0 * 0.5)).abs() < 1e-12);
}

#[test]
fn a_slip_of_a_key_that_is_written_out_is_answered_with_that_key() {
    let said = |key: &str| vehicle(SHORT, &[key]).expect_err("refused");
    for (key, meant) in [
        ("mecanum_4.track_m=1", "`mecanum4`"),
        ("total_mas_kg=3", "`total_mass_kg`"),
        ("motor.stall_torque_kgcm=3", "`stall_torque_kg_cm`"),
        ("wheel.*.roller_angle_degrees=45", "`roller_angle_deg`"),
    ] {
        let said = said(key);
        assert!(said.contains(&format!("(did you mean {meant}?)")), "{said}");
    }
    let said = said("colour=1");
    assert!(said.ends_with("`mecanum4`, `omni3`, `total_mass_kg`"), "{said}");
}

#[test]
fn what_is_short_and_wrong_is_refused_by_its_key() {
    let refused = |text: &str, keys: &[&str]| vehicle(text, keys).expect_err("wrong");
    let with = |keys: &[&str]| refused(SHORT, keys);
    let starts = [
        (
            with(&["total_mass_kg=1"]),
            "short.toml: total_mass_kg: 1, allowed: more than the 1.6 kg of wheels and other bodies",
        ),
        (
            with(&["mass_kg=8"]),
            "short.toml: mass_kg: unknown field `mass_kg`; use `total_mass_kg`, or `body.0.mass_kg`",
        ),
        (
            with(&["motor.stall_torque_n_m=2"]),
            "short.toml: motor.stall_torque_kg_cm: beside stall_torque_n_m, allowed: one of the two",
        ),
        (
            with(&["motor.stall_torque_kg_cm=nan"]),
            "short.toml: motor.stall_torque_kg_cm: NaN",
        ),
        (
            with(&["mecanum4.mounting=Z"]),
            "short.toml: mecanum4.mounting: unknown variant `Z`, expected `O` or `X`",
        ),
        (
            with(&["mecanum4.diameter_m=0.1"]),
            "short.toml: mecanum4.diameter_m: unknown field `diameter_m`",
        ),
        (
            with(&["mecanum4.track_m=wide"]),
            "short.toml: mecanum4.track_m: invalid type: string \"wide\", expected a number",
        ),
        (
            with(&["mecanum4.radius_m=48"]),
            "short.toml: mecanum4.radius_m: 48, allowed: 0.001 to 10",
        ),
        (
            with(&["omni3={lever_m = 1.0, radius_m = 0.05, wheel_mass_kg = 0.4}"]),
            "short.toml: omni3: beside wheel, allowed: one of the two",
        ),
        (
            with(&["motor.gear_ratio=20"]),
            "short.toml: motor.rotor_inertia_kg_m2: missing, allowed: rotor_inertia_kg_m2 and gear_ratio together",
        ),
        (
            with(&[
                "mecanum4.wheel_inertia_kg_m2=1e-3",
                "motor.gear_ratio=20",
                "motor.rotor_inertia_kg_m2=1e-6",
            ]),
            "short.toml: motor.rotor_inertia_kg_m2: no use, allowed: where a wheel leaves out inertia_kg_m2",
        ),
    ];
    for (message, start) in starts {
        assert!(message.starts_with(start), "{message}");
    }
    let built_in = FileKind::Vehicle.template("mecanum4").expect("built in");
    for (key, start) in [
        (
            "wheel.*.roller_angle_rad=45",
            "short.toml: wheel[0].roller_angle_rad: 45, allowed: -1.5 to 1.5; for degrees",
        ),
        (
            "wheel.0.diameter_m=0.1",
            "short.toml: wheel[0].diameter_m: allowed: radius_m = 0.05, half of it",
        ),
        (
            "wheel.rear_left.position_m=[-250, 200]",
            "short.toml: wheel[2].position_m: -250, allowed: metres; -250 mm are -0.25",
        ),
        (
            "wheel.0.roller_angle_deg=45",
            "short.toml: wheel[0].roller_angle_deg: beside roller_angle_rad, allowed: one",
        ),
    ] {
        let message = refused(built_in, &[key]);
        assert!(message.starts_with(start), "{message}");
    }
}
