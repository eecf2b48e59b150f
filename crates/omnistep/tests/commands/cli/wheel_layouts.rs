//! Wheels that do not move the vehicle in three directions.

use super::refused;

#[test]
fn wheels_that_cannot_move_the_vehicle_three_ways_are_refused() {
    // Every wheel rolling along x: forward and yaw only.
    let folder = tempfile::tempdir().unwrap();
    let sets = (0..7)
        .map(|i| format!("vehicle.wheel.{i}.rolling_direction=[1,0]"))
        .collect::<Vec<_>>();
    let args = ["compare"]
        .into_iter()
        .chain(sets.iter().flat_map(|s| ["--set", s.as_str()]))
        .collect::<Vec<_>>();
    let said = refused(folder.path(), &args);
    assert!(
        said.contains(
            "built-in chugo7: wheel: all wheels push 0 degrees from ahead, allowed: omni and mecanum wheels"
        ),
        "{said}"
    );
}

#[test]
fn wheels_that_push_past_their_middle_by_nothing_are_refused() {
    // Rollers the other way round on a square base.
    let folder = tempfile::tempdir().unwrap();
    let mut args = vec![
        "run".to_owned(),
        "flat".to_owned(),
        "--set".to_owned(),
        "vehicle=mecanum4".to_owned(),
    ];
    for (wheel, [x, y]) in [[0.2, 0.2], [0.2, -0.2], [-0.2, 0.2], [-0.2, -0.2]]
        .iter()
        .enumerate()
    {
        let sign = if wheel == 0 || wheel == 3 { 1.0 } else { -1.0 };
        args.extend([
            "--set".to_owned(),
            format!("vehicle.wheel.{wheel}.position_m=[{x}, {y}]"),
        ]);
        args.extend([
            "--set".to_owned(),
            format!("vehicle.wheel.{wheel}.roller_angle_rad={}", sign * 0.785),
        ]);
    }
    let args: Vec<_> = args.iter().map(String::as_str).collect();
    let said = refused(folder.path(), &args);
    assert!(
        said.contains("roller_angle_rad: lever ")
            && said.contains("allowed: 0.01 of the wheels' distance from their middle, 0.283 m"),
        "{said}"
    );
}
