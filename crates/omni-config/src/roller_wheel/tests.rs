//! The geometry of roller wheels against closed forms.

use std::f64::consts::PI;

use crate::{Override, RollerWheel, Source, Vehicle, WheelModel};

/// The first wheel of a built-in vehicle with other rollers.
fn wheel(vehicle: &str, overrides: &[(&str, f64)]) -> Result<RollerWheel, String> {
    let overrides: Vec<_> = overrides
        .iter()
        .map(|(key, value)| {
            let value = if *key == "count" || *key == "rows" {
                toml::Value::Integer(*value as i64)
            } else {
                toml::Value::Float(*value)
            };
            Override::new(format!("rollers.{key}"), value)
        })
        .collect();
    let source = Source::vehicle(vehicle, None).map_err(|e| e.to_string())?;
    let vehicle = Vehicle::from_source(&source, &overrides).map_err(|e| e.to_string())?;
    Ok(vehicle
        .rollers(0, WheelModel::Rollers)
        .expect("the file has rollers"))
}

/// Corner of the core of a roller: along its axis and away from the axle \[m\].
fn corner(built: &RollerWheel) -> [f64; 2] {
    let [along, away] = built.barrel.core_support(1.0);
    [along, built.pitch_radius_m + away]
}

#[test]
fn axle_sinks_between_crowned_rollers_by_what_the_corners_leave() {
    for (count, radius_m) in [(12.0, 0.006), (12.0, 0.012), (8.0, 0.01), (20.0, 0.004)] {
        let built = wheel("chugo7", &[("count", count), ("radius_m", radius_m)]).expect("fits");
        let ripple = built.ripple();
        // Crowned to the rim: R wherever a roller's crown is below. In the middle of a gap two
        // corners touch, and each is at an angle of pi / N less its own from the vertical.
        let [along, away] = corner(&built);
        let low = along.hypot(away) * (PI / count - along.atan2(away)).cos() + built.barrel.edge_m();
        assert!((ripple.max_m - 0.066).abs() < 1e-12, "{ripple:?}");
        assert!((ripple.min_m - low).abs() < 1e-12, "{ripple:?}, expected {low}");
        // The way of a turn lies between that of the lowest and that of the highest height.
        assert!(ripple.rolling_radius_m > ripple.min_m && ripple.rolling_radius_m < ripple.max_m);
    }
}

#[test]
fn straight_rollers_whose_ends_meet_make_a_polygon() {
    // Needles a fiftieth of a millimetre thick meet their neighbours at the corners of a regular polygon in the rim:
    // its height goes from R cos(pi / N) on a side to R on a corner, and it rolls its circumference, 2 N R sin(pi / N).
    for count in [6.0, 12.0] {
        let keys = [("count", count), ("radius_m", 1e-5), ("crown_m", 0.0)];
        let ripple = wheel("chugo7", &keys).expect("fits").ripple();
        let (low, way) = (
            0.066 * (PI / count).cos(),
            0.066 * count / PI * (PI / count).sin(),
        );
        // The needles' thickness and the clearance move corners by some hundredths of a millimetre.
        assert!((ripple.max_m - 0.066).abs() < 3e-5, "{ripple:?}");
        assert!((ripple.min_m - low).abs() < 3e-5, "{ripple:?}, expected {low}");
        assert!(
            (ripple.rolling_radius_m - way).abs() < 3e-5,
            "{ripple:?}, expected {way}"
        );
    }
}

#[test]
fn straight_rollers_are_lowest_on_their_sides_and_highest_on_their_corners() {
    let built = wheel("chugo7", &[("count", 8.0), ("radius_m", 0.009), ("crown_m", 0.0)]).expect("fits");
    let ripple = built.ripple();
    let [along, away] = corner(&built);
    assert!(
        (along.hypot(away) + built.barrel.edge_m() - 0.066).abs() < 1e-9,
        "corners on the rim"
    );
    // What is straight is an arc of 66 km: 3 nm of crown.
    assert!(
        (ripple.min_m - (away + built.barrel.edge_m())).abs() < 1e-8,
        "{ripple:?}"
    );
    // 4096 angles a pitch miss the corner by R (0.1 mrad)^2 / 2.
    assert!((ripple.max_m - 0.066).abs() < 1e-9, "{ripple:?}");
}

#[test]
fn second_row_closes_the_gaps_of_the_first() {
    let one = wheel("omni3", &[("rows", 1.0)]).expect("fits").ripple();
    let two = wheel("omni3", &[("rows", 2.0)]).expect("fits").ripple();
    assert!(one.max_m - one.min_m > 1e-4, "{one:?}");
    assert!(two.max_m - two.min_m < 1e-12, "{two:?}");
    assert!((two.rolling_radius_m - 0.05).abs() < 1e-12, "{two:?}");
}

#[test]
fn oblique_rollers_close_a_mecanum_wheel() {
    let ripple = wheel("mecanum4", &[]).expect("fits").ripple();
    assert!(ripple.max_m - ripple.min_m < 1e-12, "{ripple:?}");
    assert!((ripple.rolling_radius_m - 0.076).abs() < 1e-12, "{ripple:?}");
}

#[test]
fn longest_rollers_come_within_the_clearance_of_their_neighbours() {
    for (count, radius_m) in [(12.0, 0.006), (12.0, 0.012), (8.0, 0.01)] {
        let built = wheel("chugo7", &[("count", count), ("radius_m", radius_m)]).expect("fits");
        // Neighbours mirror each other in the plane between them; the inner corner of the core is
        // nearest to it, and rounded.
        let [along, away] = built.barrel.core_support(1.0);
        let inner = built.pitch_radius_m - away;
        let (sin, cos) = (PI / count).sin_cos();
        let room = inner * sin - along * cos - built.barrel.edge_m();
        assert!((room - 0.01 * radius_m).abs() < 1e-9, "{room}");
    }
}

#[test]
fn what_does_not_fit_is_one_line_with_key_value_and_bound() {
    for (vehicle, keys, expected) in [
        (
            "chugo7",
            &[("radius_m", 0.04)][..],
            "built-in chugo7: rollers.radius_m: 0.04, allowed: less than half the wheel's, 0.033 (on wheel \"1\")",
        ),
        (
            "chugo7",
            &[("radius_m", 0.03)],
            "built-in chugo7: rollers.radius_m: 0.03, allowed: up to 0.02585: with 12 rollers a row, thicker ones \
             overlap their neighbours (on wheel \"1\")",
        ),
        (
            "chugo7",
            &[("length_m", 0.04)],
            "built-in chugo7: rollers.length_m: 0.04, allowed: up to 0.02983: longer rollers overlap their neighbours (on wheel \
             \"1\")",
        ),
        (
            "chugo7",
            &[("length_m", 0.06)], // beyond where a crowned roller ends in a point
            "built-in chugo7: rollers.length_m: 0.06, allowed: up to 0.02983: longer rollers overlap their neighbours (on wheel \
             \"1\")",
        ),
        (
            "mecanum4",
            &[("length_m", 0.001)],
            "built-in mecanum4: rollers.length_m: 0.001, allowed: more than 0.0015, twice the radius of its rounded edges (on wheel \
             \"front_left\")",
        ),
        (
            "chugo7",
            &[("radius_m", 0.03), ("length_m", 0.01)],
            "built-in chugo7: rollers.length_m: 0.01, allowed: up to 0.003292: longer rollers overlap their neighbours (on wheel \
             \"1\")",
        ),
        (
            "chugo7", // ends that reach beyond the rim wherever the rollers are
            &[("count", 3.0), ("length_m", 0.14), ("crown_m", 0.0)],
            "built-in chugo7: rollers.length_m: 0.14, allowed: up to 0.1027: longer rollers overlap their neighbours (on wheel \"1\")",
        ),
        (
            "mecanum4",
            &[("length_m", 0.3), ("crown_m", 0.0)],
            "built-in mecanum4: rollers.length_m: 0.3, allowed: up to 0.02926: longer rollers overlap their neighbours (on wheel \
             \"front_left\")",
        ),
        (
            "chugo7",
            &[("crown_m", 0.005)],
            "built-in chugo7: rollers.crown_m: 0.005, allowed: 0 to 0.001708, at which it follows the rim (on wheel \"1\")",
        ),
        (
            "omni3",
            &[("row_gap_m", 0.01)],
            "built-in omni3: rollers.row_gap_m: 0.01, allowed: at least 0.01792: closer rows overlap (on wheel \"1\")",
        ),
        (
            "chugo7",
            &[("row_gap_m", 0.01)],
            "built-in chugo7: rollers.row_gap_m: 0.01, allowed: only with rows = 2 (on wheel \"1\")",
        ),
        (
            "chugo7",
            &[("roller_mass_kg", 0.1)],
            "built-in chugo7: rollers.roller_mass_kg: 0.1, allowed: up to 0.02053: the hub must keep a tenth of the wheel's \
             mass and inertia (on wheel \"1\")",
        ),
        (
            "chugo7",
            &[("count", 33.0)],
            "built-in chugo7: rollers.count: 33, allowed: 3 to 32",
        ),
        (
            "chugo7",
            &[("rows", 3.0)],
            "built-in chugo7: rollers.rows: 3, allowed: 1 to 2",
        ),
    ] {
        assert_eq!(wheel(vehicle, keys).expect_err("does not fit"), expected);
    }
}

#[test]
fn largest_values_of_the_messages_fit() {
    for keys in [("radius_m", 0.02585), ("length_m", 0.02983), ("crown_m", 0.0017)] {
        wheel("chugo7", &[keys]).expect("fits");
    }
    wheel("omni3", &[("row_gap_m", 0.01792)]).expect("fits");
}
