//! A scenario's ground as URDF.

use std::f64::consts::FRAC_PI_2;

use omni_config::Scenario;
use omni_sim::ground::Shape;

use super::{Geometry, Inertial, Shape as Shown, WORLD_LINK, at, link, robot};
use crate::ground_around::ground_around;

const COLOUR: (&str, [f64; 4]) = ("ground", [0.62, 0.6, 0.56, 1.0]);

/// The ground around a scenario's way as URDF: one link, the world's frame. Fields of heights are shown as columns,
/// at most 40 along each side, each as high as the mean of the field there; all else is as in the physics.
///
/// ```
/// use omni_config::Scenario;
/// use omni_log::ground_urdf;
/// let urdf = ground_urdf(&Scenario::load("stairs", &[])?);
/// assert_eq!(urdf.matches("<visual").count(), 1 + 3); // the floor and three steps
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn ground_urdf(scenario: &Scenario) -> String {
    let parts: Vec<_> = ground_around(scenario).iter().filter_map(shown).collect();
    // It does not move: URDF asks for a mass all the same.
    let inertial = Inertial {
        mass_kg: 0.0,
        place: at([0.0; 3], [0.0; 3]),
        moments_kg_m2: [0.0; 3],
    };
    robot("ground", |xml| link(xml, WORLD_LINK, inertial, &parts))
}

/// A box or a bar as URDF has it, which knows no field of heights.
fn shown(shape: &Shape) -> Option<Shown> {
    let (place, geometry) = match *shape {
        Shape::Box {
            half_m,
            centre_m,
            turn_y_rad,
        } => {
            let geometry = Geometry::Box(half_m.map(|half| 2.0 * half));
            (at(centre_m, [0.0, turn_y_rad, 0.0]), geometry)
        }
        Shape::Bar {
            half_length_m,
            radius_m,
            centre_m,
        } => {
            let length_m = 2.0 * half_length_m;
            let geometry = Geometry::Cylinder { radius_m, length_m };
            (at(centre_m, [FRAC_PI_2, 0.0, 0.0]), geometry)
        }
        Shape::Field { .. } => return None,
    };
    Some(Shown {
        place,
        geometry,
        colour: COLOUR,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use omni_config::Override;

    #[test]
    fn a_high_step_has_no_hole_under_its_riser() {
        let high = Override::new("terrain.height_m", 0.3);
        let scenario = Scenario::load("step", &[high]).expect("valid");
        let robot = urdf_rs::read_from_string(&ground_urdf(&scenario)).expect("a URDF");
        let holds = |point: [f64; 3]| {
            robot.links[0].collision.iter().any(|part| match part.geometry {
                urdf_rs::Geometry::Box { size } => {
                    (0..3).all(|k| (point[k] - part.origin.xyz[k]).abs() <= size[k] / 2.0)
                }
                _ => false,
            })
        };
        // Behind the riser at 0.7 m, from the floor up, and not before it or above.
        for z in [-0.05, 0.05, 0.15, 0.29] {
            assert!(holds([0.71, 0.0, z]), "at a height of {z} m");
        }
        assert!(!holds([0.69, 0.0, 0.05]) && !holds([0.71, 0.0, 0.31]));
    }
}
