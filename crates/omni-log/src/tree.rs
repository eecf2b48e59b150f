//! The frame tree of a vehicle, from the world to its wheels.

use omni_config::{Vehicle, WheelSpec};

#[cfg(feature = "ros2")]
use crate::base_pose::chained;
use crate::base_pose::{BasePose, inverse};
use crate::ros2::{Header, TfMessage, Transform, TransformStamped};
use crate::rotation::about;
#[cfg(feature = "ros2")]
use crate::urdf::MAP_LINK;
use crate::urdf::{BASE_LINK, ODOM_LINK, WORLD_LINK, link_frame_m, link_name, wheel_link};

/// Poses of the parts of a vehicle.
pub(crate) struct Placement<'a> {
    /// The base in the world.
    pub base: BasePose,
    /// The base by odometry.
    pub odometry: BasePose,
    /// Angle of each hinge in the vehicle's order \[rad\]; none: their frames are left out.
    pub hinges_rad: &'a mut dyn Iterator<Item = f64>,
    /// What the actuator of each wheel has turned in the vehicle's order \[rad\]; empty: their frames are left out.
    pub wheels_rad: &'a [f64],
}

/// Which frame the others hang from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Roots {
    /// The world: below it the base as it is, below the base the frame of odometry.
    World,
    /// The frame of odometry, as REP 105 asks of a robot: below it the base by odometry, and the world, so
    /// that what is in the world is shown where it is. A node that localises the robot puts its map above.
    #[cfg(feature = "ros2")]
    Odometry,
    /// The same below a map, which is the world: a localisation without error.
    #[cfg(feature = "ros2")]
    Map,
}

/// Those of the base, parent to child of every hinge, carrier to every wheel.
pub(crate) fn transforms(
    vehicle: &Vehicle,
    time_ns: u64,
    roots: Roots,
    placement: Placement<'_>,
) -> TfMessage {
    let between = |parent: &str, child: &str, (at, turn): BasePose| TransformStamped {
        header: Header::new(time_ns, parent),
        child_frame_id: child.to_owned(),
        transform: Transform {
            translation: at.into(),
            rotation: turn.into(),
        },
    };
    // A link's frame is at the joint that carries it.
    let from = |body: &str, point: [f64; 3]| {
        let origin = link_frame_m(vehicle, body);
        [0, 1, 2].map(|k| point[k] - origin[k])
    };
    let Placement { base, odometry, .. } = placement;
    let mut transforms = match roots {
        Roots::World => vec![
            between(WORLD_LINK, BASE_LINK, base),
            between(BASE_LINK, ODOM_LINK, inverse(odometry)),
        ],
        #[cfg(feature = "ros2")]
        Roots::Odometry | Roots::Map => {
            let odometry_in_world = chained(base, inverse(odometry));
            let mut top = vec![
                between(ODOM_LINK, BASE_LINK, odometry),
                between(ODOM_LINK, WORLD_LINK, inverse(odometry_in_world)),
            ];
            if roots == Roots::Map {
                top.push(between(MAP_LINK, ODOM_LINK, odometry_in_world));
            }
            top
        }
    };
    for (hinge, angle_rad) in vehicle.hinge.iter().zip(placement.hinges_rad) {
        transforms.push(between(
            link_name(vehicle, &hinge.parent),
            link_name(vehicle, &hinge.child),
            (from(&hinge.parent, hinge.anchor_m), about(hinge.axis, angle_rad)),
        ));
    }
    for (wheel, angle_rad) in vehicle.wheel.iter().zip(placement.wheels_rad) {
        let [x, y] = wheel.position_m;
        transforms.push(between(
            link_name(vehicle, &wheel.body),
            &wheel_link(&wheel.name),
            (
                from(&wheel.body, [x, y, wheel.radius_m]),
                about(axle(wheel), angle_rad * wheel.gear),
            ),
        ));
    }
    TfMessage { transforms }
}

/// The axle, to the left of the rolling direction.
fn axle(wheel: &WheelSpec) -> [f64; 3] {
    let [dx, dy] = wheel.rolling_direction;
    [-dy, dx, 0.0]
}
