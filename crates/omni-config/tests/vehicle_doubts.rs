//! What is doubtful of a vehicle: files that cannot drive get a line each, and files that can get none.

use std::f64::consts::FRAC_PI_4;
use std::fs;
use std::path::Path;

use omni_config::{Override, Source, Vehicle};

const PERIOD_S: f64 = 1e-3;

/// What is doubtful of a built-in vehicle with some keys replaced.
fn doubts(vehicle: &str, keys: &[&str]) -> Vec<String> {
    let keys: Vec<_> = keys
        .iter()
        .map(|key| Override::parse(key).expect("valid"))
        .collect();
    let source = Source::vehicle(vehicle, None).expect("valid");
    Vehicle::from_source(&source, &keys)
        .expect("valid")
        .doubts(PERIOD_S)
        .expect("valid")
}

/// The signs of the roller angles of mecanum4: front left, front right, rear left, rear right.
fn hands(signs: [f64; 4]) -> Vec<String> {
    let keys: Vec<_> = (0..4)
        .map(|i| format!("wheel[{i}].roller_angle_rad={}", FRAC_PI_4 * signs[i]))
        .collect();
    doubts("mecanum4", &keys.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Radii of the wheels of mecanum4.
fn radii(radii_m: [f64; 4]) -> Vec<String> {
    let keys: Vec<_> = (0..4)
        .map(|i| format!("wheel[{i}].radius_m={}", radii_m[i]))
        .collect();
    doubts("mecanum4", &keys.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn nothing_is_doubtful_of_built_in_vehicles_and_of_the_robots_to_start_from() {
    for vehicle in ["chugo7", "omni3", "mecanum4", "rocker_bogie6"] {
        assert_eq!(doubts(vehicle, &[]), Vec::<String>::new(), "{vehicle}");
    }
    let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../omnistep/assets/robots");
    let mut count = 0;
    for robot in fs::read_dir(robots).expect("valid") {
        let path = robot.expect("valid").path();
        let source = Source::text("robot.toml", fs::read_to_string(&path).expect("valid"));
        let vehicle = Vehicle::from_source(&source, &[]).expect("valid");
        assert_eq!(
            vehicle.doubts(PERIOD_S).expect("valid"),
            Vec::<String>::new(),
            "{path:?}"
        );
        count += 1;
    }
    assert_eq!(count, 8);
}

#[test]
fn radii_that_were_calibrated_are_not_doubtful_and_one_that_was_changed_is() {
    // As a calibration writes them, for wheels of 76 mm of which two are 3 % larger and 2 % smaller.
    let calibrated = [0.07602, 0.07927, 0.0758, 0.07432];
    assert_eq!(radii(calibrated), Vec::<String>::new());
    // 4 and 4 % apart from the middle: 8 % apart from each other.
    assert_eq!(radii([0.0731, 0.0762, 0.0758, 0.0789]), Vec::<String>::new());
    let changed = "check whether only one wheel was changed";
    let expected =
        format!("wheel front_left: radius_m = 0.0794, 4.47 % off 0.076, the median of the wheels; {changed}");
    assert_eq!(radii([0.0794, 0.076, 0.076, 0.076]), [expected]);
    assert_eq!(radii([0.0777, 0.076, 0.076, 0.076]), Vec::<String>::new());
    // The same wheel beside measured ones is a measured one, but one of 82.6 mm is of another size.
    assert_eq!(radii([0.0794, 0.0761, 0.0759, 0.0760]), Vec::<String>::new());
    let [other] = &radii([0.0761, 0.0759, 0.0826, 0.0757])[..] else {
        panic!("one line")
    };
    assert!(
        other.starts_with("wheel rear_left: radius_m = 0.0826, 8.54 % off 0.0761")
            && other.ends_with(changed),
        "{other}"
    );
    // The first wheel is no measure of the others: it is the one that was changed.
    let [first] = &radii([0.100, 0.0759, 0.0760, 0.0757])[..] else {
        panic!("one line")
    };
    assert!(first.starts_with("wheel front_left: radius_m = 0.1, "), "{first}");
}

#[test]
fn every_wrong_hand_of_four_mecanum_wheels_is_named_alone_or_in_a_pair() {
    let names = ["front_left", "front_right", "rear_left", "rear_right"];
    for bits in 0..16_u8 {
        let signs: [f64; 4] = std::array::from_fn(|i| {
            let right = if i == 1 || i == 2 { 1.0 } else { -1.0 };
            if bits >> i & 1 == 1 { -right } else { right }
        });
        let keys: Vec<_> = (0..4)
            .map(|i| {
                Override::parse(&format!("wheel[{i}].roller_angle_rad={}", FRAC_PI_4 * signs[i]))
                    .expect("valid")
            })
            .collect();
        let source = Source::vehicle("mecanum4", None).expect("valid");
        // All alike are refused.
        let Ok(vehicle) = Vehicle::from_source(&source, &keys) else {
            continue;
        };
        let wrong: Vec<_> = (0..4).filter(|i| bits >> i & 1 == 1).map(|i| names[i]).collect();
        let lines = vehicle.doubts(PERIOD_S).expect("valid");
        let expected = match wrong.len() {
            0 => {
                assert!(lines.is_empty(), "{lines:?}");
                continue;
            }
            4 => "roller_angle_rad: the wheels' forces have a lever arm of 0.035 m".to_owned(),
            _ => format!("wheel {}: roller_angle_rad = ", wrong.join(", ")),
        };
        assert!(
            lines.iter().any(|line| line.starts_with(&expected)),
            "{wrong:?}: {lines:?}"
        );
    }
    // The rear pair exchanged: both left wheels alike; then both front wheels alike.
    assert_eq!(
        hands([-1.0, 1.0, -1.0, 1.0]),
        [
            "wheel rear_left, rear_right: roller_angle_rad = -0.7853981633974483, 0.7853981633974483 look like those of wheels for the other side: \
          the roller axes on the ground should form a diamond"
        ]
    );
    assert_eq!(hands([-1.0, -1.0, 1.0, 1.0]).len(), 1);
}

#[test]
fn a_pair_of_wrong_hands_is_found_on_any_shape_of_vehicle_and_right_ones_are_not() {
    for (front, rear, half_front, half_rear, origin) in [
        (0.5, 0.5, 0.15, 0.15, 0.0),
        (0.1, 0.1, 0.6, 0.6, 0.0),
        (0.033, 0.633, 0.145, 0.485, 0.0),
        (0.25, 0.25, 0.2, 0.2, 0.25),
    ] {
        let places = [
            [front, half_front],
            [front, -half_front],
            [-rear, half_rear],
            [-rear, -half_rear],
        ];
        for (signs, right) in [
            ([-1, 1, 1, -1], true),
            ([-1, 1, -1, 1], false),
            ([-1, -1, 1, 1], false),
        ] {
            let keys: Vec<_> = (0..4)
                .flat_map(|i| {
                    let [x, y] = places[i];
                    [
                        format!("wheel[{i}].position_m=[{}, {y}]", x + origin),
                        format!("wheel[{i}].roller_angle_rad={}", FRAC_PI_4 * f64::from(signs[i])),
                    ]
                })
                .collect();
            let lines = doubts("mecanum4", &keys.iter().map(String::as_str).collect::<Vec<_>>());
            let said = lines.iter().any(|line| line.contains("for the other side"));
            assert_eq!(said, !right, "{places:?} {signs:?}: {lines:?}");
        }
    }
    // Six wheels: two of them exchanged.
    assert_eq!(doubts("rocker_bogie6", &[]), Vec::<String>::new());
}

#[test]
fn each_value_with_which_a_vehicle_cannot_drive_gets_its_line() {
    let place = "body platform: com_m has the height ";
    for (keys, expected) in [
        (
            &["motor.gear_friction_n_m=5"][..],
            "motor.gear_friction_n_m = 5, but the motor gives wheel front_left at most 3 N.m; usual: less than half of that",
        ),
        (
            &["motor.gear_friction_n_m=2.9"],
            "motor.gear_friction_n_m = 2.9, but the motor gives wheel front_left at most 3 N.m",
        ),
        // The drive's limit counts, not the motor's line.
        (
            &["motor.gear_friction_n_m=0.3", "motor.torque_limit_n_m=0.5"],
            "motor.gear_friction_n_m = 0.3, but the motor gives wheel front_left at most 0.5 N.m",
        ),
        (
            &["motor.viscous_n_m_s_rad=5"],
            // 3 N.m over 5.1 N.m.s/rad; a turn of 2 rad/s at 0.45 m takes 11.8 rad/s, 1 m/s 13.2.
            "motor.viscous_n_m_s_rad = 5: with it wheel front_left reaches 0.588 rad/s without load, and limits and motor are for 13.2; \
             check the unit",
        ),
        (
            &["gains.kd_n_m_s2_rad=5"],
            "gains: kd_n_m_s2_rad = 5, but a wheel moves an inertia of 0.0382 kg.m2",
        ),
        (&["gains.ki_n_m_rad=2000"], "gains: ki_n_m_rad = 2000 is "),
        (
            &["body[0].com_m=[0.0, 0.0, -5.0]"],
            "body platform: com_m has the height -5, allowed: above 0, which is on the ground",
        ),
        (
            &["body[0].com_m=[0.0, 0.0, -0.12]"],
            "body platform: com_m has the height -0.12",
        ),
        (
            &["body[0].com_m=[0.0, 0.0, 0.0]"],
            "body platform: com_m has the height 0",
        ),
        (
            &["body[0].com_m=[0.0, 0.0, 1.2]"],
            "body platform: com_m has the height 1.2, and inertia_box_m the edge 0.2: the box begins 1.1 m above the ground, and the wheels are 0.64 m \
             apart; check both",
        ),
        (
            &["body[0].inertia_box_m=[60.0, 40.0, 20.0]"],
            "body platform: inertia_box_m = [60.0, 40.0, 20.0], but the wheels are 0.64 m apart; write inertia_box_m and position_m in metres",
        ),
        (
            &["body[0].inertia_box_m=[0.006, 0.004, 0.002]"],
            "body platform: inertia_box_m = [0.006, 0.004, 0.002], but",
        ),
        (
            &["body[0].clearance_m=0.5"],
            "body platform: clearance_m = 0.5, but its centre of mass is 0.12 m up and its box begins at 0.02 m; usual: up to 0.07",
        ),
        (
            &["body[0].mass_kg=9000"],
            "motor.stall_torque_n_m = 3: no gains move 9004.000 kg with a time constant below ",
        ),
    ] {
        let lines = doubts("mecanum4", keys);
        let found = lines.iter().filter(|line| line.starts_with(expected)).count();
        assert_eq!(found, 1, "{keys:?}: {lines:?}");
        let of_place = lines.iter().filter(|line| line.starts_with(place)).count();
        assert!(of_place <= 1, "{keys:?}: {lines:?}");
    }
}

#[test]
fn values_with_which_a_vehicle_drives_get_no_line() {
    for keys in [
        &[
            "motor.gear_friction_n_m=0.3",
            "motor.viscous_n_m_s_rad=0.02",
            "motor.efficiency=0.7",
        ][..],
        // A loop that is three times as fast, one without an integral, one with a derivative.
        &["gains.kp_n_m_s_rad=1.1", "gains.ki_n_m_rad=15"],
        &["gains.ki_n_m_rad=0"],
        &["gains.kd_n_m_s2_rad=0.005"],
        &["body[0].clearance_m=0.065"],
        &["body[0].com_m=[0.0, 0.0, 0.4]"],
        // Boxes as the inertia of a tall and of a long body; the first reaches into the ground.
        &[
            "body[0].inertia_box_m=[0.5, 0.4, 0.6]",
            "body[0].clearance_m=0.07",
        ],
        &["body[0].inertia_box_m=[2.0, 0.4, 0.2]"],
        &["body[0].mass_kg=150"],
    ] {
        assert_eq!(doubts("mecanum4", keys), Vec::<String>::new(), "{keys:?}");
    }
}
