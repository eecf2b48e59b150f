//! The vehicle as a tree of bodies on hinges, with what never changes while it drives.

use rapier3d_f64::prelude::{Matrix, Vector};

use super::rollers::Rollers;
use crate::config::{RollerWheel, Scenario, Vehicle, WheelContact, WheelSpec};
use crate::world::loads::Load;

/// Part of its moment of inertia about the axle that a wheel has across it: a disc's. The carrier carries it.
const ACROSS: f64 = 0.5;

/// A vehicle.
pub(super) struct Model {
    /// The base first, every other after the one that it hangs on.
    pub(super) bodies: Vec<Body>,
    /// In the vehicle file's order.
    pub(super) wheels: Vec<Wheel>,
    /// Rollers of all wheels together.
    pub(super) rollers: usize,
    pub(super) couplings: Vec<Coupling>,
    /// Where the bodies of the vehicle file are in `bodies`.
    pub(super) place_of: Vec<usize>,
    /// Of everything \[kg\].
    pub(super) mass_kg: f64,
    /// Downwards \[m/s^2\].
    pub(super) gravity_m_s2: f64,
}

/// A body with the wheels that it carries. Its frame is the vehicle's as it stands on flat ground.
pub(super) struct Body {
    /// The body that it hangs on; of the base the base itself.
    pub(super) parent: usize,
    /// The hinge that it hangs on, by its index in the vehicle file; of the base none.
    pub(super) hinge: Option<usize>,
    pub(super) mass_kg: f64,
    /// Centre of mass \[m\].
    pub(super) com_m: Vector,
    /// About the centre of mass \[kg.m^2\]; of the wheels only what they have across their axles.
    pub(super) inertia_kg_m2: Matrix,
    /// Axis of the hinge, a unit vector, and a point of it \[m\].
    pub(super) axis: Vector,
    pub(super) anchor_m: Vector,
    /// Largest angle of the hinge to either side \[rad\].
    pub(super) limit_rad: f64,
    pub(super) damping_n_m_s_rad: f64,
    /// The bodies between the base and this one, itself included, as bits; not the base.
    pub(super) path: u32,
}

/// A wheel in the frame of its carrier.
pub(super) struct Wheel {
    pub(super) body: usize,
    /// Unit vector: turns about it drive along the rolling direction.
    pub(super) axle: Vector,
    /// The same, turned by the roller angle: across the push.
    pub(super) across_push: Vector,
    /// Centre of the axle \[m\].
    pub(super) centre_m: Vector,
    pub(super) shape: WheelShape,
    /// Sine and cosine of the roller angle.
    pub(super) sin_cos: [f64; 2],
    /// About the axle \[kg.m^2\], less what free rollers do not turn with.
    pub(super) inertia_kg_m2: f64,
    /// Spring \[N/m\] and damper \[N.s/m\] of a contact.
    pub(super) contact: [f64; 2],
    /// From the axle to the ground \[m\].
    pub(super) radius_m: f64,
    /// Way along the push a wheel turn \[m/rad\].
    pub(super) way_per_rad: f64,
    /// Wheel velocity over actuator velocity.
    pub(super) gear: f64,
}

/// What of a wheel touches the ground.
pub(super) enum WheelShape {
    /// A ball about the axle's centre, of the wheel's radius \[m\].
    Ball { radius_m: f64 },
    /// The roller under the axle, as a ball of its radius and about its centre \[m\].
    RollerBall { radius_m: f64, centre_m: Vector },
    /// Every roller.
    Rollers(Box<Rollers>),
}

/// Two hinges held at `angle_a + ratio angle_b = 0`.
pub(super) struct Coupling {
    /// The bodies that hang on the hinges.
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) ratio: f64,
    pub(super) stiffness_n_m_rad: f64,
    pub(super) damping_n_m_s_rad: f64,
}

impl Model {
    /// The scenario's vehicle with the loads that have been put on it.
    pub(super) fn new(scenario: &Scenario, loads: &[Load]) -> Self {
        let vehicle = scenario.vehicle();
        let (order, hinges) = outwards(vehicle);
        let mut place_of = vec![0; order.len()];
        for (place, body) in order.iter().enumerate() {
            place_of[*body] = place;
        }
        // A loaded vehicle names bodies and hinges that exist.
        let named = |name: &str| {
            let found = vehicle.body.iter().position(|body| body.name == name);
            place_of[found.unwrap_or(0)]
        };
        let mut rollers = 0;
        let wheels: Vec<_> = (0..vehicle.wheel.len())
            .map(|i| {
                let spec = &vehicle.wheel[i];
                let wheel = Wheel::new(scenario, spec, named(&spec.body), scenario.rollers(i), rollers);
                rollers += wheel.rollers().map_or(0, Rollers::count);
                wheel
            })
            .collect();
        let mut bodies: Vec<Body> = Vec::new();
        for (place, (index, hinge)) in order.iter().zip(hinges).enumerate() {
            let spec = &vehicle.body[*index];
            let mut masses = vec![(spec.mass_kg, Vector::from(spec.com_m))];
            let mut inertia_kg_m2 = Matrix::from_diagonal(Vector::from(spec.inertia_kg_m2()));
            for (wheel, own) in vehicle.wheel.iter().zip(&wheels) {
                if own.body == place {
                    masses.push((wheel.mass_kg, own.centre_m));
                    inertia_kg_m2 += (Matrix::IDENTITY - outer(own.axle)) * (ACROSS * wheel.inertia_kg_m2);
                }
            }
            let put_on = loads.iter().filter(|load| load.done && load.body == *index);
            masses.extend(put_on.map(|load| (load.mass_kg, Vector::from(load.at_m))));
            let mass_kg: f64 = masses.iter().map(|(mass, _)| mass).sum();
            let first: Vector = masses.iter().map(|(mass, at)| *at * *mass).sum();
            let com_m = first / mass_kg;
            for (mass, at) in masses {
                inertia_kg_m2 += of_point(mass, at - com_m);
            }
            let spec = hinge.map(|hinge: usize| &vehicle.hinge[hinge]);
            let parent = spec.map_or(0, |spec| named(&spec.parent));
            bodies.push(Body {
                parent,
                hinge,
                mass_kg,
                com_m,
                inertia_kg_m2,
                axis: spec.map_or(Vector::X, |spec| Vector::from(spec.axis).normalize()),
                anchor_m: spec.map_or(Vector::ZERO, |spec| Vector::from(spec.anchor_m)),
                limit_rad: spec.map_or(0.0, |spec| spec.limit_rad),
                damping_n_m_s_rad: spec.map_or(0.0, |spec| spec.damping_n_m_s_rad),
                path: if place == 0 {
                    0
                } else {
                    bodies[parent].path | 1 << place
                },
            });
        }
        let on_hinge = |name: &str| {
            let index = vehicle.hinge.iter().position(|hinge| hinge.name == name);
            bodies.iter().position(|body| body.hinge == index).unwrap_or(0)
        };
        let couplings = vehicle.coupling.iter().map(|coupling| {
            let spring = vehicle.coupling_spring(coupling);
            Coupling {
                a: on_hinge(&coupling.hinge_a),
                b: on_hinge(&coupling.hinge_b),
                ratio: coupling.ratio,
                stiffness_n_m_rad: spring.stiffness_n_m_rad,
                damping_n_m_s_rad: spring.damping_n_m_s_rad,
            }
        });
        Self {
            couplings: couplings.collect(),
            mass_kg: bodies.iter().map(|body| body.mass_kg).sum(),
            gravity_m_s2: scenario.physics.gravity_m_s2,
            bodies,
            wheels,
            rollers,
            place_of,
        }
    }
}

impl Wheel {
    fn new(
        scenario: &Scenario,
        spec: &WheelSpec,
        body: usize,
        rollers: Option<RollerWheel>,
        first: usize,
    ) -> Self {
        let [dx, dy] = spec.rolling_direction;
        let (sin, cos) = (libm::sin(spec.roller_angle_rad), libm::cos(spec.roller_angle_rad));
        let rolling = Vector::new(dx, dy, 0.0).normalize();
        let push = Vector::new(cos * dx - sin * dy, sin * dx + cos * dy, 0.0).normalize();
        let [x, y] = spec.position_m;
        let stiffness = spec.contact_stiffness_n_m(scenario.physics.contact_frequency_hz);
        let damping = 2.0 * scenario.physics.contact_damping_ratio * (stiffness * spec.mass_kg).sqrt();
        let lower_m = spec.preload_n / stiffness;
        // A roller that is free turns with its wheel but for its own axis.
        let free_kg_m2 = rollers.as_ref().map_or(0.0, |built| {
            let [axial, _] = built.roller_inertia_kg_m2();
            (built.count * built.rows) as f64 * axial * sin * sin
        });
        let shape = match (rollers, spec.contact) {
            (Some(built), _) => WheelShape::Rollers(Box::new(Rollers::new(&built, first))),
            (None, WheelContact::Roller { radius_m }) => WheelShape::RollerBall {
                radius_m,
                centre_m: Vector::new(x, y, radius_m - lower_m),
            },
            (None, _) => WheelShape::Ball {
                radius_m: spec.radius_m,
            },
        };
        Self {
            body,
            axle: Vector::Z.cross(rolling),
            across_push: Vector::Z.cross(push),
            centre_m: Vector::new(x, y, spec.radius_m - lower_m),
            shape,
            sin_cos: [sin, cos],
            inertia_kg_m2: spec.inertia_kg_m2 - free_kg_m2,
            contact: [stiffness, damping],
            radius_m: spec.radius_m,
            way_per_rad: spec.radius_m * cos,
            gear: spec.gear,
        }
    }

    /// Its rollers, where they are resolved.
    pub(super) fn rollers(&self) -> Option<&Rollers> {
        match &self.shape {
            WheelShape::Rollers(rollers) => Some(rollers),
            _ => None,
        }
    }
}

/// The bodies of a vehicle from its base outwards, and the hinge that each hangs on, by their indices in the file.
fn outwards(vehicle: &Vehicle) -> (Vec<usize>, Vec<Option<usize>>) {
    let index = |name: &str| vehicle.body.iter().position(|body| body.name == name);
    let (mut order, mut hinges) = (vec![0], vec![None]);
    // Hinges are in this order in the file: a vehicle is checked for it when it is loaded.
    for (i, hinge) in vehicle.hinge.iter().enumerate() {
        order.push(index(&hinge.child).unwrap_or(0));
        hinges.push(Some(i));
    }
    (order, hinges)
}

/// The matrix `a a^T`.
pub(super) fn outer(a: Vector) -> Matrix {
    Matrix::from_cols(a * a.x, a * a.y, a * a.z)
}

/// Inertia of a point mass about another point \[kg.m^2\].
pub(super) fn of_point(mass_kg: f64, at_m: Vector) -> Matrix {
    (Matrix::from_diagonal(Vector::splat(at_m.length_squared())) - outer(at_m)) * mass_kg
}
