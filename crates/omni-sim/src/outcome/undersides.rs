//! Where the underside of a body meets the ground: physics has no contact there, a real vehicle would stand or scrape.

use rapier3d_f64::prelude::{Pose, Rotation, Vector};

use super::BodyName;
use super::mean::WINDOW_NS;
use crate::config::{Body, Hinge, Scenario, Terrain, Vehicle};
use crate::ground::{Rectangle, Shape, reach_m, shapes};
use crate::observation::{Observation, Pose3};

/// A body has not touched that is lower than the ground by no more than this, or no further behind
/// a riser \[m\]: contacts give by half a millimetre, and a box is no body's shape to a millimetre.
const TOLERANCE_M: f64 = 2e-3;
/// Least and largest distance of points of an underside \[m\].
const SPACING_M: [f64; 2] = [0.005, 0.02];
/// Most points of an underside along an edge, less one.
const MOST_CELLS: f64 = 100.0;

/// Where a body first met the ground.
#[derive(Clone, Copy)]
pub(super) struct Touched {
    pub(super) body: BodyName,
    pub(super) time_s: f64,
    /// World x and y \[m\].
    pub(super) at_m: [f64; 2],
    pub(super) depth_m: f64,
}

/// Compares every underside with the ground, every 10 ms until one has touched.
pub(super) struct Undersides {
    ground: Vec<Shape>,
    faces: Vec<Face>,
    joints: Vec<Joint>,
    /// How each body stands against where it is on level ground, in the vehicle file's order.
    places: Vec<Pose>,
    next_ns: u64,
    touched: Option<Touched>,
}

/// The lower face of a body's box, moved to its clearance.
struct Face {
    body: usize,
    name: BodyName,
    corner: Vector,
    /// From point to point along each edge.
    steps: [Vector; 2],
    cells: [u32; 2],
}

struct Joint {
    parent: usize,
    child: usize,
    anchor: Vector,
    /// A unit vector.
    axis: Vector,
}

impl Undersides {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let vehicle = scenario.vehicle();
        let spacing_m = spacing_m(scenario);
        let bodies = vehicle.body.iter().enumerate();
        Self {
            ground: shapes(scenario, reach_m(scenario)),
            faces: bodies
                .filter_map(|(index, body)| Face::new(index, body, spacing_m))
                .collect(),
            joints: vehicle
                .hinge
                .iter()
                .filter_map(|hinge| Joint::new(vehicle, hinge))
                .collect(),
            places: vec![Pose::IDENTITY; vehicle.body.len()],
            next_ns: 0,
            touched: None,
        }
    }

    pub(super) fn push(&mut self, seen: &Observation) {
        if seen.time_ns < self.next_ns || self.touched.is_some() || self.faces.is_empty() {
            return;
        }
        self.next_ns = seen.time_ns - seen.time_ns % WINDOW_NS + WINDOW_NS;
        self.place(seen);
        let mut deepest_m = TOLERANCE_M;
        for face in &self.faces {
            if let Some((point, depth_m)) = face.deepest(&self.places[face.body], &self.ground, deepest_m) {
                deepest_m = depth_m;
                self.touched = Some(Touched {
                    body: face.name,
                    time_s: seen.time_ns as f64 * 1e-9,
                    at_m: [point.x, point.y],
                    depth_m,
                });
            }
        }
    }

    /// The first that touched.
    pub(super) fn touched(&self) -> Option<Touched> {
        self.touched
    }

    fn place(&mut self, seen: &Observation) {
        let Pose3 {
            position_m,
            rotation_xyzw: [x, y, z, w],
        } = seen.pose;
        self.places[0] = Pose::from_parts(Vector::from(position_m), Rotation::from_xyzw(x, y, z, w));
        // Each parent is placed before its children: so are the hinges of a file.
        for (joint, hinge) in self.joints.iter().zip(&seen.hinges) {
            let (sin, cos) = libm::sincos(0.5 * hinge.angle_rad);
            let axis = joint.axis * sin;
            let turn = Rotation::from_xyzw(axis.x, axis.y, axis.z, cos);
            let about = Pose::from_parts(joint.anchor - turn * joint.anchor, turn);
            self.places[joint.child] = self.places[joint.parent] * about;
        }
    }
}

impl Face {
    fn new(index: usize, body: &Body, spacing_m: f64) -> Option<Self> {
        let [x, y, _] = body.com_m;
        let edges = [body.inertia_box_m[0], body.inertia_box_m[1]];
        let cells = edges.map(|edge| (edge / spacing_m).ceil().clamp(1.0, MOST_CELLS));
        Some(Self {
            body: index,
            name: BodyName::new(&body.name)?,
            corner: Vector::new(x - edges[0] / 2.0, y - edges[1] / 2.0, body.underside_m()?),
            steps: [
                Vector::new(edges[0] / cells[0], 0.0, 0.0),
                Vector::new(0.0, edges[1] / cells[1], 0.0),
            ],
            cells: cells.map(|cells| cells as u32),
        })
    }

    /// Its point that is deepest in the ground, and how deep; none where no point is deeper than `least_m`.
    fn deepest(&self, place: &Pose, ground: &[Shape], least_m: f64) -> Option<(Vector, f64)> {
        let corner = place * self.corner;
        let steps = self.steps.map(|step| place.rotation * step);
        let at = |i: u32, j: u32| corner + steps[0] * f64::from(i) + steps[1] * f64::from(j);
        let [along, aside] = self.cells;
        // Nearly always its lowest corner is above all ground under it.
        let corners = [at(0, 0), at(along, 0), at(0, aside), at(along, aside)];
        let (mut low, mut high) = (corners[0], corners[0]);
        for corner in corners {
            (low, high) = (low.min(corner), high.max(corner));
        }
        let under: Rectangle = [[low.x, high.x], [low.y, high.y]];
        if highest(ground, |shape| shape.highest_m(under)) - low.z <= least_m {
            return None;
        }
        let mut deepest = (corner, least_m);
        for i in 0..=along {
            for j in 0..=aside {
                let point = at(i, j);
                let depth_m = least_height_m(ground, point) - point.z;
                if depth_m > deepest.1 {
                    deepest = (point, depth_m);
                }
            }
        }
        (deepest.1 > least_m).then_some(deepest)
    }
}

impl Joint {
    fn new(vehicle: &Vehicle, hinge: &Hinge) -> Option<Self> {
        let body = |name: &str| vehicle.body.iter().position(|body| body.name == name);
        Some(Self {
            parent: body(&hinge.parent)?,
            child: body(&hinge.child)?,
            anchor: Vector::from(hinge.anchor_m),
            axis: Vector::from(hinge.axis).normalize(),
        })
    }
}

/// How near the points of an underside are: a quarter of the shortest rise of the ground, or less.
/// Edges have no width, but a vehicle that crosses one takes all its points over it.
fn spacing_m(scenario: &Scenario) -> f64 {
    let [least, most] = SPACING_M;
    let blocks = scenario.block.iter().flat_map(|block| [block.x_m, block.y_m]);
    let narrowest_m = blocks.map(|[from, to]| to - from).fold(f64::INFINITY, f64::min);
    let fine = match &scenario.terrain {
        Terrain::Bumps { width_m, .. } => width_m / 4.0,
        Terrain::Rough { wavelength_m, .. } => wavelength_m / 8.0,
        Terrain::HeightMap { pixel_m, .. } => 2.0 * pixel_m,
        _ => most,
    };
    fine.min(narrowest_m / 2.0).clamp(least, most)
}

/// The least height of the ground within the tolerance around a point: that of a riser's foot just behind its face.
fn least_height_m(ground: &[Shape], point: Vector) -> f64 {
    let around = [
        [TOLERANCE_M, 0.0],
        [-TOLERANCE_M, 0.0],
        [0.0, TOLERANCE_M],
        [0.0, -TOLERANCE_M],
    ];
    let heights = around
        .map(|[ahead, left]| highest(ground, |shape| shape.height_m([point.x + ahead, point.y + left])));
    heights.into_iter().fold(f64::INFINITY, f64::min)
}

fn highest(ground: &[Shape], height: impl Fn(&Shape) -> Option<f64>) -> f64 {
    ground.iter().filter_map(height).fold(f64::NEG_INFINITY, f64::max)
}
