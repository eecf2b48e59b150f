//! The pose of the base, by odometry and in truth.

use omni_core::BodyTwist;
use omni_sim::observation::Observation;
use omni_sim::{GroundReport, Period};

use crate::ros2::{Header, Odometry, Pose, PoseWithCovariance, TwistWithCovariance};
use crate::rotation::{about, after, rotate};
use crate::urdf::{BASE_LINK, ODOM_LINK, WORLD_LINK};

/// A place \[m\] and a turn in a frame, the turn a unit quaternion x, y, z, w.
pub(crate) type BasePose = ([f64; 3], [f64; 4]);

/// The frame that a place and a turn are given in, as what is there sees it. Of the base by
/// odometry it is the frame of odometry: a log sends that as a frame of the base, which is a frame
/// of the world, so that the base's own position stays bit-identical to the simulation.
pub(crate) fn inverse((at, [x, y, z, w]): BasePose) -> BasePose {
    let back = [-x, -y, -z, w];
    (rotate(back, at.map(|place| -place)), back)
}

/// An item in a frame that has its own pose.
#[cfg(feature = "ros2")]
pub(crate) fn chained((at, turn): BasePose, (then, by): BasePose) -> BasePose {
    let there = rotate(turn, then);
    ([0, 1, 2].map(|k| at[k] + there[k]), after(turn, by))
}

/// The base by odometry: on the plane, or in three dimensions.
pub(crate) fn by_odometry(seen: &Observation, ground: Option<&GroundReport>) -> BasePose {
    let pose = &seen.odometry.pose;
    let heading = about([0.0, 0.0, 1.0], pose.yaw_rad);
    let Some(ground) = ground else {
        return ([pose.x_m, pose.y_m, 0.0], heading);
    };
    // Nose up is negative about y. The y axis, turned by r about x, is at asin(cos(pitch) sin(r)) above the horizon.
    let (pitch, roll) = (ground.pitch_rad, ground.roll_rad);
    let about_x = libm::asin((libm::sin(roll) / libm::cos(pitch)).clamp(-1.0, 1.0));
    let leans = after(about([0.0, 1.0, 0.0], -pitch), about([1.0, 0.0, 0.0], about_x));
    ([pose.x_m, pose.y_m, ground.z_m], after(heading, leans))
}

/// What odometry says nothing of \[m^2, rad^2\]: on the plane height, roll and pitch have a variance that outweighs
/// none of another sensor, and so do roll and pitch in three dimensions, whose deviations it does not know.
const UNKNOWN: f64 = 1e6;

/// Covariance of a pose or twist for which none is known. A 0 would say that it is exact, and a
/// message of odometry has no other word for it: the first element -1 is one of `sensor_msgs` alone.
pub(crate) fn unknown_covariance() -> [[f64; 6]; 6] {
    std::array::from_fn(|row| std::array::from_fn(|column| if row == column { UNKNOWN } else { 0.0 }))
}

/// Covariance of a pose or twist of which x, y and yaw are known as they are here.
fn planar_covariance(known: &[[f64; 3]; 3]) -> [[f64; 6]; 6] {
    let mut covariance = [[0.0; 6]; 6];
    for (row, of_known) in [0, 1, 5].into_iter().zip(known) {
        for (column, value) in [0, 1, 5].into_iter().zip(of_known) {
            covariance[row][column] = *value;
        }
    }
    for unknown in [2, 3, 4] {
        covariance[unknown][unknown] = UNKNOWN;
    }
    covariance
}

/// What the wheels say, and how well the twist is known, if it is.
pub(crate) fn odometry(period: &Period, twist_covariance: Option<[[f64; 3]; 3]>) -> Odometry {
    let (seen, ground) = (&period.observed, period.control.report.ground.as_ref());
    let (at, turn) = by_odometry(seen, ground);
    let mut covariance = planar_covariance(&seen.odometry.covariance);
    if let Some(ground) = ground {
        covariance[2][2] = ground.std_z_m * ground.std_z_m;
    }
    let twist = twist_covariance.as_ref();
    let twist = twist.map_or_else(unknown_covariance, planar_covariance);
    located(
        seen.time_ns,
        ODOM_LINK,
        ((at, turn), covariance),
        (seen.odometry.twist, twist),
    )
}

/// What is so.
pub(crate) fn ground_truth(seen: &Observation) -> Odometry {
    let pose = (seen.pose.position_m, seen.pose.rotation_xyzw);
    let exact = [[0.0; 6]; 6];
    located(seen.time_ns, WORLD_LINK, (pose, exact), (seen.twist, exact))
}

/// The base in a frame: its pose and its twist, each with its covariance.
fn located(
    time_ns: u64,
    frame: &str,
    ((at, turn), covariance): (BasePose, [[f64; 6]; 6]),
    (moves, of_twist): (BodyTwist<f64>, [[f64; 6]; 6]),
) -> Odometry {
    let pose = Pose {
        position: at.into(),
        orientation: turn.into(),
    };
    Odometry {
        header: Header::new(time_ns, frame),
        child_frame_id: BASE_LINK.into(),
        pose: PoseWithCovariance { pose, covariance },
        twist: TwistWithCovariance {
            twist: moves.into(),
            covariance: of_twist,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use omni_config::{Override, Scenario};
    use omni_sim::Simulation;

    /// After 0.8 s of a bend to the left, started with another heading.
    fn period() -> Period {
        let overrides = [
            Override::new("command.wz_rad_s", 0.5),
            Override::new("start.heading_rad", 0.7),
        ];
        let scenario = Scenario::load("flat", &overrides).expect("built-in");
        let mut simulation = Simulation::new(&scenario).expect("valid");
        for _ in 0..800 {
            simulation.step(&simulation.scenario_command()).expect("finite");
        }
        simulation.period().clone()
    }

    #[test]
    fn a_covariance_is_where_ros_looks_for_it_and_says_what_the_plane_does_not() {
        let period = period();
        let seen = &period.observed;
        let covariance = odometry(&period, None).pose.covariance;
        let flat = covariance.as_flattened();
        let [[xx, xy, xw], [_, yy, yw], [_, _, ww]] = seen.odometry.covariance;
        for (places, expected) in [
            (&[0][..], xx),
            (&[1, 6], xy),
            (&[7], yy),
            (&[5, 30], xw),
            (&[11, 31], yw),
            (&[35], ww),
            (&[14, 21, 28], 1e6), // z, roll, pitch
        ] {
            assert!(places.iter().all(|place| flat[*place] == expected), "{places:?}");
            assert!(expected != 0.0, "{places:?}: the bend couples all of them");
        }
        assert_eq!(flat.iter().filter(|value| **value == 0.0).count(), 36 - 12);
        assert_eq!(ground_truth(seen).pose.covariance, [[0.0; 6]; 6]);
        assert_eq!(ground_truth(seen).twist.covariance, [[0.0; 6]; 6]);
        // Of the twist in the same places; all of it unknown if it is not determined.
        let known = odometry(&period, Some(seen.odometry.covariance));
        assert_eq!(known.twist.covariance, covariance);
        let diagonal = |k: usize| odometry(&period, None).twist.covariance[k][k];
        assert!((0..6).all(|k| diagonal(k) == 1e6));
    }

    #[test]
    fn from_the_frame_of_odometry_the_base_is_where_odometry_has_it() {
        let period = period();
        let seen = &period.observed;
        let (origin, turn) = inverse(by_odometry(seen, None));
        let message = odometry(&period, None);
        let (at, heading) = (message.pose.pose.position, message.pose.pose.orientation);
        // The base's pose there takes that frame's origin, as the base sees it, to the origin.
        let back = rotate([heading.x, heading.y, heading.z, heading.w], origin);
        for (place, back) in [at.x, at.y, at.z].into_iter().zip(back) {
            assert!((place + back).abs() < 1e-15, "{place} {back}");
        }
        assert_eq!((turn[2], turn[3]), (-heading.z, heading.w));
        assert_eq!([at.x, at.y], [seen.odometry.pose.x_m, seen.odometry.pose.y_m]);
        let frames = [message.header.frame_id, ground_truth(seen).header.frame_id];
        assert_eq!(frames, ["odom", "world"]);
    }

    #[test]
    fn the_axes_of_a_base_that_leans_rise_by_its_angles_and_x_keeps_the_heading() {
        let mut seen = Observation::default();
        seen.odometry.pose.yaw_rad = 0.7;
        let ground = GroundReport {
            z_m: 0.3,
            std_z_m: 0.01,
            roll_rad: -0.4,
            pitch_rad: 0.5,
            wheels: Vec::new(),
        };
        let (at, turn) = by_odometry(&seen, Some(&ground));
        let [x, y] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|axis| rotate(turn, axis));
        assert_eq!(at, [0.0, 0.0, 0.3]);
        for (is, expected) in [
            (x[2], 0.5_f64.sin()),
            (y[2], -(0.4_f64.sin())),
            (x[1].atan2(x[0]), 0.7),
        ] {
            assert!((is - expected).abs() < 1e-15, "{is} {expected}");
        }
    }

    #[test]
    fn in_three_dimensions_the_base_by_odometry_is_where_it_is_on_a_ramp() {
        let overrides = [
            Override::new("odometry.kind", "ground"),
            Override::new("physics.engine", "articulated"),
            Override::new("terrain.slope_rad", 0.15),
        ];
        let scenario = Scenario::load("ramp", &overrides).expect("built-in");
        let mut simulation = Simulation::new(&scenario).expect("valid");
        for _ in 0..5000 {
            simulation.step(&simulation.scenario_command()).expect("finite");
        }
        let truth = simulation.observation().pose;
        let up = |turn: [f64; 4]| rotate(turn, [0.0, 0.0, 1.0]);
        let is_up = up(truth.rotation_xyzw);
        assert!(
            is_up[0] < -0.1 && truth.position_m[2] > 0.02,
            "it is on the ramp: {truth:?}"
        );
        let message = odometry(simulation.period(), None);
        let (at, turn) = (message.pose.pose.position, message.pose.pose.orientation);
        // The gate of the core's odometry on a ramp of 2.7 m: 10 mm. The attitude is exact but for 5 ms of delay.
        for (is, expected) in [at.x, at.y, at.z].into_iter().zip(truth.position_m) {
            assert!((is - expected).abs() < 0.01, "{is} {expected}");
        }
        for (is, expected) in up([turn.x, turn.y, turn.z, turn.w]).into_iter().zip(is_up) {
            assert!((is - expected).abs() < 0.005, "{is} {expected}");
        }
        let deviation_m = message.pose.covariance[2][2].sqrt();
        assert!((1e-4..0.05).contains(&deviation_m), "{deviation_m}");
    }
}
