//! What a recording keeps, refuses, and is to replay.

use omni_config::Override;

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
    let loops = Override::new("control.policy", "scale_references");
    let done = recording.write(&path, &Scenario::load("flat", &[loops]).expect("built-in"));
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
    // 0.2 s at 50 Hz and the first period; the second half has no pose; the robot's own odometry is missing.
    let counts = &logged.file.counts;
    assert_eq!((counts["/joint_states"], counts["/ground_truth/odom"]), (11, 6));
    assert!(!counts.contains_key("/odom") && !counts.contains_key("/cmd_vel"));
    // Frames are where the true pose was measured: not in the second half.
    assert_eq!((counts["/tf"], logged.frame_time_s.len()), (6, 6));
    assert!(logged.file.complete && logged.file.recorded && !logged.file.own_controller);
    assert_eq!(logged.file.run["policy"], "recorded");
}

#[test]
fn an_unobserved_vehicle_is_at_its_odometry_pose_and_hinges_turn_as_sensed() {
    let [x, y, yaw] = ODOMETRY;
    let mut columns = vec![
        (x, column(|k| 0.001 * k as f64)),
        (y, column(|_| 0.5)),
        (yaw, column(|k| if k < 150 { 0.3 } else { f64::NAN })),
        (
            "sensed_angle_rad_pitch",
            column(|k| if k < 100 { 0.2 } else { f64::NAN }),
        ),
    ];
    let (_folder, path, done) = written(&columns);
    done.expect("writable");
    let logged = LoggedRun::read(&path).expect("a log");
    // 50 Hz: at 1 ms, then every 20 ms until 150 ms; then the heading is not known.
    assert_eq!(logged.frame_time_s.len(), 8);
    let base = &logged.frames[BASE_LINK];
    for (time_s, pose) in logged.frame_time_s.iter().zip(base) {
        let row = (time_s * 1000.0).round() - 1.0;
        assert_eq!(pose[..3], [0.001 * row, 0.5, 0.0]);
        assert_eq!(pose[3..], about_z(0.3));
    }
    // The world is odometry's then.
    for pose in &logged.frames[ODOM_LINK] {
        assert!(pose[..3].iter().all(|place| place.abs() < 1e-15), "{pose:?}");
    }
    // The front frame: turned by the sensed angle, and by the last one where it was not sensed. It
    // stays where the hinge is.
    let front = &logged.frames["front"];
    let turned = |pose: &[f64; 7]| {
        2.0 * libm::acos(
            pose[3] * base[0][3] + pose[4] * base[0][4] + pose[5] * base[0][5] + pose[6] * base[0][6],
        )
    };
    for pose in front {
        assert!((turned(pose) - 0.2).abs() < 1e-7, "{pose:?}");
    }
    // With a truth that is known for a while only, odometry says nothing of the world.
    columns.extend(TRUTH.map(|name| (name, column(|k| if k < 50 { 0.0 } else { f64::NAN }))));
    let (_folder, path, done) = written(&columns);
    done.expect("writable");
    assert_eq!(LoggedRun::read(&path).expect("a log").frame_time_s.len(), 3);
}

#[test]
fn a_pose_without_a_stated_covariance_is_named_in_the_message() {
    let mut columns = ODOMETRY.map(|name| (name, column(|k| 0.01 * k as f64))).to_vec();
    columns.extend(TRUTH.map(|name| (name, column(|k| 0.01 * k as f64))));
    let (_folder, path, done) = written(&columns);
    done.expect("writable");
    let logged = LoggedRun::read(&path).expect("a log");
    for track in [&logged.odometry, &logged.ground_truth] {
        assert!(track.variances.len() == 11, "{}", track.variances.len());
        // Variances of x, of y and of the yaw, and what x and y have in common: large and finite, a
        // matrix that filters can invert.
        assert!(track.variances.iter().all(|v| *v == [1e6, 0.0, 1e6, 1e6]));
    }
}

#[test]
fn columns_that_cannot_be_are_refused_in_one_line() {
    let (_folder, _, done) = written(&[("asked_vx_m_s", vec![0.0; 3]), ("gyro_rad_s", vec![0.0; 2])]);
    let said = done.expect_err("refused").to_string();
    assert!(
        said.ends_with("column gyro_rad_s: 2 rows, allowed: 3, as in the other columns"),
        "{said}"
    );
    let (_folder, _, done) = written(&[("wheel_99_measured_rad_s", vec![0.0])]);
    assert!(done.is_err());
}

#[test]
fn an_unknown_vehicle_at_rest_is_not_taken_for_a_file_that_unpacks_to_too_much() {
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
    // At rest and commanded to rest the controller asks for nothing.
    let [wheel_1, wheel_2] = [&replayed.wheels[0], &replayed.wheels[1]];
    assert_eq!((wheel_1.compared, wheel_2.compared), (0, 150));
    assert_eq!((wheel_2.logged_rms_n_m, wheel_2.replayed_rms_n_m), (0.5, 0.0));
    assert_eq!((wheel_2.largest_n_m, wheel_2.largest_at_ns), (0.5, 51_000_000));
    // Traction control needs what was not measured.
    let traction = omni_config::Override::new("control.policy", "traction");
    let said = replay(&path, &[traction]).expect_err("refused").to_string();
    assert!(
        said.ends_with(
            "no readings of hinges and inertial measurement unit, but traction needs them, allowed: a recording with both, \
             or a policy of wheel speed loops"
        ),
        "{said}"
    );
}
