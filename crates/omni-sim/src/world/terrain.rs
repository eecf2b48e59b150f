//! The ground as fixed colliders.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rapier3d_f64::parry::utils::Array2;
use rapier3d_f64::prelude::*;

use crate::config::{FrictionPatch, Scenario, Terrain};

/// Half the thickness of slabs \[m\]: no wheel tunnels through.
const HALF_THICKNESS: f64 = 1.0;
/// Waves that make up a rough surface: enough that no direction stands out.
const WAVES: usize = 64;
/// Cells of a rough surface in its shortest wave.
const CELLS_PER_WAVE: f64 = 8.0;

/// Adds the ground to the world.
pub(super) fn insert(physics: &mut PhysicsWorld, scenario: &Scenario) {
    let terrain = &scenario.terrain;
    // Wherever the run goes there is ground: twice as far as the command asks for.
    let far = 200.0 + 2.0 * scenario.command.fastest_m_s() * scenario.duration_s;
    let mut ground = Ground {
        physics,
        friction: terrain.friction(),
        patched: !scenario.friction_patch.is_empty(),
        far,
    };
    match terrain {
        Terrain::Flat { .. } => ground.slab([-far, far], [-far, far], 0.0),
        Terrain::Step { height_m, at_m, .. } => {
            ground.slab([-far, far], [-far, far], 0.0);
            ground.slab([*at_m, far], [-far, far], *height_m);
        }
        Terrain::StepDown { height_m, at_m, .. } => {
            ground.slab([-far, far], [-far, far], -height_m);
            ground.slab([-far, *at_m], [-far, far], 0.0);
        }
        Terrain::Stairs {
            height_m,
            tread_m,
            count,
            at_m,
            ..
        } => {
            ground.slab([-far, far], [-far, far], 0.0);
            for k in 0..*count {
                let k = f64::from(k);
                ground.slab([at_m + k * tread_m, far], [-far, far], (k + 1.0) * height_m);
            }
        }
        Terrain::Ramp {
            slope_rad,
            length_m,
            at_m,
            ..
        } => {
            let height = length_m * libm::tan(*slope_rad);
            ground.slab([-far, far], [-far, far], 0.0);
            ground.slab([at_m + length_m, far], [-far, far], height);
            ground.wedge(*at_m, *length_m, height);
        }
        Terrain::HalfStep {
            height_m,
            left_of_m,
            at_m,
            ..
        } => {
            ground.slab([-far, far], [-far, far], 0.0);
            ground.slab([*at_m, far], [*left_of_m, far], *height_m);
        }
        Terrain::Ditch {
            width_m,
            depth_m,
            at_m,
            ..
        } => {
            ground.slab([-far, *at_m], [-far, far], 0.0);
            ground.slab([at_m + width_m, far], [-far, far], 0.0);
            // The bottom lies between the walls, so that these are all one face.
            ground.slab([*at_m, at_m + width_m], [-far, far], -depth_m);
        }
        Terrain::Bumps {
            height_m,
            width_m,
            spacing_m,
            count,
            at_m,
            ..
        } => {
            ground.slab([-far, far], [-far, far], 0.0);
            // A circle through both feet and the top.
            let radius = (width_m * width_m / 4.0 + height_m * height_m) / (2.0 * height_m);
            for k in 0..*count {
                let x = at_m + width_m / 2.0 + f64::from(k) * spacing_m;
                ground.bar(x, height_m - radius, radius);
            }
        }
        Terrain::Rough {
            rms_m,
            wavelength_m,
            length_m,
            width_m,
            seed,
            at_m,
            ..
        } => {
            let waves = waves(*seed, *wavelength_m);
            let cells = |extent: f64| (extent / wavelength_m * CELLS_PER_WAVE).ceil() as usize;
            let (rows, columns) = (cells(*length_m) + 1, cells(*width_m) + 1);
            let heights = |i: usize, j: usize| {
                let x = length_m * i as f64 / (rows - 1) as f64;
                let y = width_m * (0.5 - j as f64 / (columns - 1) as f64);
                let fade =
                    fade(x, *length_m, *wavelength_m) * fade(y + width_m / 2.0, *width_m, *wavelength_m);
                let sum: f64 = waves
                    .iter()
                    .map(|[kx, ky, phase]| libm::sin(kx * x + ky * y + phase))
                    .sum();
                // Each of the waves has a mean square of a half.
                rms_m * fade * sum / (WAVES as f64 / 2.0).sqrt()
            };
            ground.field(*at_m, [*length_m, *width_m], [rows, columns], heights);
        }
        Terrain::HeightMap {
            image,
            pixel_m,
            black_m,
            white_m,
            at_m,
            ..
        } => {
            let (rows, columns) = (image.rows(), image.columns());
            let extent = [rows, columns].map(|n| pixel_m * (n - 1) as f64);
            let heights = |i: usize, j: usize| black_m + (white_m - black_m) * image.level(rows - 1 - i, j);
            ground.field(*at_m, extent, [rows, columns], heights);
        }
    }
}

/// Height of the ground \[m\] at places x, y \[m\] of the world.
///
/// ```
/// use omni_sim::config::Scenario;
/// let stairs = Scenario::load("stairs", &[])?; // of 3 cm, from x = 0.7 m on, every 0.4 m
/// let heights = omni_sim::ground_heights_m(&stairs, &[[0.0, 0.0], [0.9, 0.0], [1.2, 0.5], [9.0, 0.0]]);
/// for (height, expected) in heights.iter().zip([0.0, 0.03, 0.06, 0.09]) {
///     assert!((height - expected).abs() < 1e-9);
/// }
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn ground_heights_m(scenario: &Scenario, places_m: &[[f64; 2]]) -> Vec<f64> {
    let mut physics = PhysicsWorld::new();
    insert(&mut physics, scenario);
    // Puts the colliders where rays look for them.
    physics.detect_collisions(&(), &());
    let above = 100.0; // obstacles are at most 10 m high
    let height = |[x, y]: [f64; 2]| {
        let ray = Ray::new(Vector::new(x, y, above), Vector::new(0.0, 0.0, -1.0));
        let hit = physics.cast_ray(&ray, 2.0 * above, true, QueryFilter::default());
        hit.map_or(f64::NAN, |(_, fall)| above - fall)
    };
    places_m.iter().copied().map(height).collect()
}

struct Ground<'a> {
    physics: &'a mut PhysicsWorld,
    friction: f64,
    patched: bool,
    far: f64,
}

impl Ground<'_> {
    fn add(&mut self, collider: ColliderBuilder) {
        let hooks = if self.patched {
            ActiveHooks::MODIFY_SOLVER_CONTACTS
        } else {
            ActiveHooks::empty()
        };
        let collider = collider
            .friction(self.friction)
            .friction_combine_rule(CoefficientCombineRule::Min)
            .active_hooks(hooks);
        self.physics.insert_collider(collider, None);
    }

    /// A box with its upper face at `top`.
    fn slab(&mut self, x: [f64; 2], y: [f64; 2], top: f64) {
        let half = |[from, to]: [f64; 2]| (to - from) / 2.0;
        let middle = |[from, to]: [f64; 2]| f64::midpoint(from, to);
        let shape = ColliderBuilder::cuboid(half(x), half(y), HALF_THICKNESS);
        self.add(shape.translation(Vector::new(middle(x), middle(y), top - HALF_THICKNESS)));
    }

    /// A slope from the plane at `from` up to `height`: a tilted box that goes on into the lower slab, with its back inside the
    /// upper one.
    fn wedge(&mut self, from: f64, length: f64, height: f64) {
        let slope = libm::atan2(height, length);
        let (sin, cos) = (libm::sin(slope), libm::cos(slope));
        let half = length.hypot(height) / 2.0 + HALF_THICKNESS / 2.0;
        // From the crest back along the slope, then down across it.
        let x = from + length - half * cos + HALF_THICKNESS * sin;
        let z = height - half * sin - HALF_THICKNESS * cos;
        let shape = ColliderBuilder::cuboid(half, self.far, HALF_THICKNESS);
        // Nose up is a negative turn about y.
        self.add(shape.position(Pose::new(
            Vector::new(x, 0.0, z),
            AngVector::new(0.0, -slope, 0.0),
        )));
    }

    /// A round bar across the way.
    fn bar(&mut self, x: f64, z: f64, radius: f64) {
        let shape = ColliderBuilder::cylinder(self.far, radius); // along y
        self.add(shape.translation(Vector::new(x, 0.0, z)));
    }

    /// A field of heights from `from` on, with the plane around it: rows go forward, columns to the right.
    fn field(
        &mut self,
        from: f64,
        [length, width]: [f64; 2],
        [rows, columns]: [usize; 2],
        height: impl Fn(usize, usize) -> f64,
    ) {
        let (far, side) = (self.far, width / 2.0);
        self.slab([-far, from], [-far, far], 0.0);
        self.slab([from + length, far], [-far, far], 0.0);
        self.slab([from, from + length], [-far, -side], 0.0);
        self.slab([from, from + length], [side, far], 0.0);
        // rapier's fields have y up, rows along z and columns along x. Turned by a quarter about x they have z up and rows to
        // the right; so rows here are columns there.
        let mut heights = Array2::repeat(columns, rows, 0.0);
        for i in 0..rows {
            for j in 0..columns {
                heights[(j, i)] = height(i, j);
            }
        }
        let flags = HeightFieldFlags::FIX_INTERNAL_EDGES;
        let shape = ColliderBuilder::heightfield_with_flags(heights, Vector::new(length, 1.0, width), flags);
        let quarter = std::f64::consts::FRAC_PI_2;
        self.add(shape.position(Pose::new(
            Vector::new(from + length / 2.0, 0.0, 0.0),
            AngVector::new(quarter, 0.0, 0.0),
        )));
    }
}

/// From 0 at the borders to 1 a wave inside, smoothly.
fn fade(at: f64, extent: f64, wavelength: f64) -> f64 {
    let t = (at.min(extent - at) / wavelength).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Wave numbers along x and y \[rad/m\] and phases of waves between one and four wavelengths in all directions.
fn waves(seed: u32, wavelength: f64) -> [[f64; 3]; WAVES] {
    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(seed));
    let mut uniform = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    std::array::from_fn(|_| {
        let direction = std::f64::consts::TAU * uniform();
        let k = std::f64::consts::TAU / (wavelength * (1.0 + 3.0 * uniform()));
        [
            k * libm::cos(direction),
            k * libm::sin(direction),
            std::f64::consts::TAU * uniform(),
        ]
    })
}

/// Friction by place: the last patch that holds a contact sets its coefficient.
pub(super) struct Patches(pub(super) Vec<FrictionPatch>);

impl PhysicsHooks for Patches {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let Some(rigid) = context.rigid_mut() else {
            return;
        };
        // A ball touches a convex shape in one point; a manifold has one coefficient.
        let Some(contact) = rigid.solver_contacts.first() else {
            return;
        };
        let at = contact.anchor1;
        let inside = |[from, to]: [f64; 2], v: f64| v >= from && v < to;
        let patch = self
            .0
            .iter()
            .rev()
            .find(|patch| inside(patch.x_m, at.x) && inside(patch.y_m, at.y));
        if let Some(patch) = patch {
            *rigid.friction = patch.friction;
        }
    }
}
