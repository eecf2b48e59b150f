//! Vehicles and ground as URDF, for viewers and other simulators.
//!
//! A link's frame is where the joint that carries it is, as URDF has it; the base's is the vehicle's. Frames of a log's `/tf` and
//! joints of its `/joint_states` have the same names and places.

mod ground;
mod vehicle;

use urdf_rs::{Color, Geometry, Inertia, Inertial, Link, Material, Pose, Robot, Vec3, Vec4, Visual};

pub use ground::ground_urdf;
pub use vehicle::{BASE_LINK, WORLD_LINK, link_frame_m, link_name, vehicle_urdf, wheel_link};

fn text(robot: &Robot) -> String {
    // Names, numbers and nothing else: there is nothing that XML could not hold.
    urdf_rs::write_to_string(robot).unwrap_or_default()
}

fn at(xyz: [f64; 3], rpy: [f64; 3]) -> Pose {
    Pose {
        xyz: Vec3(xyz),
        rpy: Vec3(rpy),
    }
}

fn inertial(mass: f64, at_m: [f64; 3], [ixx, iyy, izz]: [f64; 3], yaw_rad: f64) -> Inertial {
    Inertial {
        origin: at(at_m, [0.0, 0.0, yaw_rad]),
        mass: urdf_rs::Mass { value: mass },
        inertia: Inertia {
            ixx,
            iyy,
            izz,
            ..Inertia::default()
        },
    }
}

fn link(name: &str, inertial: Inertial, visual: Vec<Visual>) -> Link {
    let collision = visual.iter().map(|v| urdf_rs::Collision {
        name: None,
        origin: v.origin.clone(),
        geometry: v.geometry.clone(),
    });
    Link {
        name: name.to_owned(),
        inertial,
        collision: collision.collect(),
        visual,
    }
}

fn visual(origin: Pose, geometry: Geometry, (name, rgba): (&str, [f64; 4])) -> Visual {
    Visual {
        name: None,
        origin,
        geometry,
        material: Some(Material {
            name: name.into(),
            color: Some(Color { rgba: Vec4(rgba) }),
            texture: None,
        }),
    }
}

fn robot(name: &str, links: Vec<Link>, joints: Vec<urdf_rs::Joint>) -> Robot {
    Robot {
        name: name.to_owned(),
        version: None,
        links,
        joints,
        materials: Vec::new(),
    }
}
