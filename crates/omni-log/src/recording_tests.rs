//! What a recording keeps, refuses, and is to replay.

use super::*;
use crate::{LoggedRun, replay};

fn column(value: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..200).map(value).collect()
}

fn written(columns: &[(&str, Vec<f64>)]) -> (tempfile::TempDir, std::path::PathBuf, Result<(), Error>) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("robot.mcap");
    let columns = columns.iter().map(|(name, c)| ((*name).to_owned(), c.clone()));
    let recording = Recording::new(columns.collect());
    let done = recording.write(&path, &Scenario::load("flat", &[]).expect("built-in"));
    (folder, path, done.map(drop))
}

#[test]
fn what_is_known_comes_back_in_every_bit_and_the_rest_is_not_a_number() {
    let pose = TRUTH.map(|name| (name, column(|k| if k < 100 { k as f64 } else { f64::NAN })));
    let mut columns = vec![
        ("wheel_3_measured_rad_s", column(|k| 0.1 * k as f64)),
        ("wheel_3_torque_n_m", column(|k| -0.3 * k as f64)),
        ("asked_vx_m_s", column(|_| 0.3)),
        ("sensed_pitch_rad", column(|k| 1.0 / (k as f64 + 1.0))),
    ];
    columns.extend(pose);
    let (_folder, path, done) = written(&columns);
    done.expect("writable");
    let logged = LoggedRun::read(&path).expect("a log");
    for (name, given) in &columns {
        let read = logged.trace.column(name).expect("a column");
        let bits = |c: &[f64]| c.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(read), bits(given), "{name}");
    }
    for unknown in [
        "gyro_rad_s",
        "common_factor",
        "wheel_3_applied_n_m",
        "wheel_3_saturated",
        "wheel_1_measured_rad_s",
    ] {
        let read = logged.trace.column(unknown).expect("a column");
        assert!(read.iter().all(|v| v.is_nan()), "{unknown}");
    }
    // 0.2 s at 50 Hz and the first period; the second half has no pose; nobody gave the robot's own odometry.
    let counts = &logged.file.counts;
    assert_eq!((counts["/joint_states"], counts["/ground_truth/odom"]), (11, 6));
    assert!(!counts.contains_key("/odom") && !counts.contains_key("/cmd_vel"));
    assert!(logged.file.complete && logged.file.recorded && !logged.file.own_controller);
    assert_eq!(logged.file.run["policy"], "recorded");
}

#[test]
fn columns_that_cannot_be_are_refused_in_one_line() {
    let (_folder, _, done) = written(&[("asked_vx_m_s", vec![0.0; 3]), ("gyro_rad_s", vec![0.0; 2])]);
    let said = done.expect_err("refused").to_string();
    assert!(
        said.ends_with("column gyro_rad_s: 2 rows, allowed: 3 as of the others"),
        "{said}"
    );
    let (_folder, _, done) = written(&[("wheel_99_measured_rad_s", vec![0.0])]);
    assert!(done.is_err());
}

#[test]
fn a_vehicle_at_rest_of_which_nothing_is_known_is_not_taken_for_a_file_that_unpacks_to_too_much() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("robot.mcap");
    let still = vec![0.0; 60_000];
    let columns = BTreeMap::from([("wheel_1_measured_rad_s".to_owned(), still)]);
    let scenario = Scenario::load("flat", &[]).expect("built-in");
    Recording::new(columns).write(&path, &scenario).expect("writable");
    assert_eq!(LoggedRun::read(&path).expect("a log").trace.rows(), 60_000);
}

#[test]
fn replay_feeds_the_controller_and_compares_torques_where_the_log_has_them() {
    let names: Vec<_> = (1..=7).map(|k| format!("wheel_{k}_measured_rad_s")).collect();
    let mut columns: Vec<_> = names
        .iter()
        .map(|name| (name.as_str(), column(|_| 0.0)))
        .collect();
    columns.extend(["asked_vx_m_s", "asked_vy_m_s", "asked_wz_rad_s"].map(|name| (name, column(|_| 0.0))));
    columns.push((
        "wheel_2_applied_n_m",
        column(|k| if k < 50 { f64::NAN } else { 0.5 }),
    ));
    let (_folder, path, done) = written(&columns);
    done.expect("writable");
    let replayed = replay(&path, &[]).expect("its measurements are there");
    assert!(replayed.file.recorded && replayed.first.is_none());
    assert_eq!(replayed.periods, 200);
    // At rest and told to rest the controller asks for nothing.
    let [wheel_1, wheel_2] = [&replayed.wheels[0], &replayed.wheels[1]];
    assert_eq!((wheel_1.compared, wheel_2.compared), (0, 150));
    assert_eq!((wheel_2.logged_rms_n_m, wheel_2.replayed_rms_n_m), (0.5, 0.0));
    assert_eq!((wheel_2.largest_n_m, wheel_2.largest_at_ns), (0.5, 51_000_000));
}
