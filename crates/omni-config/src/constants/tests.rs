//! What the writers write. That it is the same controller once compiled, firmware images and the C example prove.

use omni_core::constants::{Constant, Describe, Piece};

use super::*;
use crate::Override;

/// One of everything that can be described.
struct Odd;

impl Constant for Odd {
    fn describe(&self, to: &mut dyn Describe) -> std::fmt::Result {
        let (whole, flag): (u32, bool) = (7, true);
        let numbers = [-0.0_f32, 1e-9, 16_777_216.0, f32::NEG_INFINITY];
        to.take(Piece::Struct {
            name: "Odd",
            fields: &[("numbers", &numbers), ("whole", &whole), ("flag", &flag)],
        })
    }
}

#[test]
fn rust_numbers_read_back_as_the_same_bits() {
    let source = rust_expression(&Odd);
    assert_eq!(
        source,
        "omni_core::parts::Odd::from_constants((/* numbers */ [-0.0, 1e-9, 16777216.0, f32::NEG_INFINITY, ],\n\
         /* whole */ 7,\n/* flag */ true,\n))"
    );
    assert_eq!(rust_expression(&Some(0.5_f32)), "Some(0.5)");
    assert_eq!(rust_expression(&None::<f32>), "None");
    // In f32 a tenth is not what it is in f64: the shortest digits of each.
    assert_eq!(
        (rust_expression(&0.1_f32), rust_expression(&0.1_f64)),
        ("0.1".into(), "0.1".into())
    );
    assert_eq!(rust_expression(&f64::from(0.1_f32)), "0.10000000149011612");
}

#[test]
fn c_initialisers_are_float_literals_that_need_no_header() {
    assert_eq!(
        c::initialiser(&Odd),
        "{\n.numbers = {-0.0f, 1e-9f, 16777216.0f, -OMNI_INFINITY, },\n.whole = 7,\n.flag = true,\n}"
    );
}

#[test]
fn a_gain_a_policy_and_a_limit_each_change_the_digest() {
    let digest = |key: &str| {
        let overrides = [Override::parse(key).expect("valid")];
        Scenario::load("step", &overrides)
            .expect("valid")
            .constants_digest()
            .expect("valid")
    };
    let same = digest("seed=1");
    for key in [
        "vehicle.gains.ki_n_m_rad=2.5",
        "control.policy=\"scale_torques\"",
        "vehicle.limits.vx_m_s=0.5",
    ] {
        assert_ne!(digest(key), same, "{key}");
    }
    assert_eq!(digest("terrain.height_m=0.03"), same); // the ground is no part of the controller
}

#[test]
fn eight_wheels_have_constants_in_both_languages() {
    let mut text = include_str!("../../assets/vehicles/chugo7.toml").to_owned();
    let extra = "\n[[wheel]]\nname = \"8\"\nbody = \"middle\"\nposition_m = [0.0, 0.15]\nrolling_direction = [1.0, 0.0]\n\
                 radius_m = 0.066\nmass_kg = 1.0\ninertia_kg_m2 = 0.002\ncontact = { kind = \"ball\" }\n";
    text.push_str(extra);
    let vehicle: toml::Table = text.parse().expect("valid");
    let mut table: toml::Table = include_str!("../../assets/scenarios/step.toml")
        .parse()
        .expect("valid");
    table.insert("vehicle".into(), vehicle.into());
    let source = crate::Source::text("eight.toml", table.to_string());
    let scenario = Scenario::from_source(&source, &[]).expect("valid");
    for (language, line) in [
        (Language::Rust, "omni_core::Controller<f32, 8>"),
        (Language::C, "omni8_controller OMNI_CONTROLLER"),
    ] {
        assert!(scenario.constants(language).expect("eight wheels").contains(line));
    }
}

#[test]
fn every_scenario_is_a_header_with_a_drive_where_it_names_traction_control() {
    for name in crate::builtin_scenarios() {
        let scenario = Scenario::load(name, &[]).expect("built in");
        let header = scenario.constants(Language::C).expect(name);
        assert_eq!(
            header.contains("_traction_drive OMNI_DRIVE"),
            scenario.has_traction() && scenario.auto_policy().is_none(),
            "{name}"
        );
        assert_eq!(
            header.contains("OMNI_TRAJECTORY"),
            scenario.planned_path().expect("checked").is_some(),
            "{name}"
        );
        assert!(header.contains("_estimator OMNI_ESTIMATOR = {"), "{name}");
        let hinges = scenario.vehicle().hinge.len();
        assert!(
            header.contains(&format!("#define OMNI_HINGES {hinges} ")),
            "{name}"
        );
    }
}

/// What has no `[drive]` is flashed as it is simulated: the drive around the law does nothing.
#[test]
fn without_a_drive_traction_control_in_c_gives_the_torques_of_the_simulation() {
    use omni_core::drive::{BodyReadings, TractionDriveState};
    use omni_core::{BodyTwist, DriveInput, Policy, Readings, WheelVelocities};
    let policy = crate::Override::new("control.policy", "traction");
    let scenario = Scenario::load("step", &[policy]).expect("valid");
    let drive = scenario
        .bare_traction_drive::<f32, 7>()
        .expect("valid")
        .expect("no [drive]");
    let mut law = scenario
        .traction::<f32, 7>()
        .expect("valid")
        .expect("traction control");
    let mut state = TractionDriveState::new(&drive);
    let (mut wheels, hinges) = ([0.0_f32; 7], [-0.05_f32, 0.02]);
    for k in 0..4000_u16 {
        let wanted = if (2500..3200).contains(&k) { 0.0 } else { 0.3 };
        let command = BodyTwist {
            vx_m_s: wanted,
            vy_m_s: 0.05 * wanted,
            wz_rad_s: 0.1,
        };
        let mut input = DriveInput::measured(&WheelVelocities { rad_s: wheels }).with_command(command);
        let mut readings = Readings::new(command, &wheels);
        let mut bodies = BodyReadings::none();
        (bodies.hinges_rad, bodies.hinges_rad_s, bodies.imu) =
            (&hinges, &[0.0; 2], omni_core::policy::Imu::level());
        (readings.hinges_rad, readings.hinges_rad_s, readings.imu) =
            (bodies.hinges_rad, bodies.hinges_rad_s, bodies.imu);
        input.command = Some(command);
        let mut torques_n_m = [0.0; 7];
        law.step(&readings, &mut torques_n_m);
        let sample = drive.step(&mut state, &input, &bodies);
        assert_eq!(
            sample.drive.wheels.applied.n_m.map(f32::to_bits),
            torques_n_m.map(f32::to_bits),
            "{k}"
        );
        for (i, rate) in wheels.iter_mut().enumerate() {
            let slips = if i == 2 && k % 700 > 500 { 3.0 } else { 1.0 };
            *rate = 0.98 * *rate + 0.05 * slips * torques_n_m[i];
        }
    }
    assert!(wheels.iter().any(|rate| rate.abs() > 0.5));
}

#[test]
fn a_scenario_with_a_drive_has_it_as_a_constant_in_both_languages() {
    let source = |overrides: &[&str], language| {
        let overrides = overrides
            .iter()
            .map(|text| Override::parse(text).expect("valid"))
            .collect::<Vec<_>>();
        let scenario = Scenario::load("flat", &overrides).expect("valid");
        scenario.constants(language).expect("a known wheel count")
    };
    let loops = "control.policy=scale_references";
    for plain in [source(&[loops], Language::C), source(&[loops], Language::Rust)] {
        assert!(!plain.contains("DRIVE"), "{plain}");
    }
    let limited = [loops, "drive.speed_limit_rad_s=6"];
    assert!(source(&limited, Language::Rust).contains("pub static DRIVE: omni_core::Drive<f32, 7> ="));
    let header = source(&limited, Language::C);
    // Of both optional parts one is there.
    for line in [
        "static const omni7_drive OMNI_DRIVE = {",
        ".limits_speed = true,",
        ".limit_rad_s = {6.0f, ",
        ".desaturation = OMNI_DESATURATION_UNIFORM,",
        ".grows_covariance = false,",
        ".oldest = 500,", // a time-out of 0.5 s in periods of 1 ms
    ] {
        assert!(header.contains(line), "{line}: {header}");
    }
    let six = source(
        &[loops, "vehicle=rocker_bogie6", "drive.discretize=true"],
        Language::C,
    );
    assert!(six.contains("static const omni6_drive OMNI_DRIVE = {"), "{six}");
}

#[test]
fn the_files_of_a_scenario_are_its_own_and_those_that_it_names() {
    // Of its own, not of the repository: the test goes along in the package.
    let folder = std::env::temp_dir().join(format!("omni-config-files-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let (scenario, vehicle) = (folder.join("on-flat.toml"), folder.join("omni4.toml"));
    let text = "vehicle = 'omni4.toml'\nterrain.image = 'hills.png'\ncommand.file = 'way.csv'";
    std::fs::write(&scenario, text).expect("written");
    std::fs::write(&vehicle, "").expect("written");
    let files = Scenario::files(scenario.to_str().expect("a name")).expect("both are there");
    std::fs::remove_dir_all(&folder).expect("removed");
    let (hills, way) = (folder.join("hills.png"), folder.join("way.csv"));
    assert_eq!(files, [scenario, vehicle, hills, way]);
}
