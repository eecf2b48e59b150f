//! The ground as plain shapes, for the physics and for pictures.

mod heights;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::config::{Scenario, Terrain};
pub(crate) use heights::Rectangle;

/// Half the thickness of slabs \[m\]: no wheel tunnels through.
const HALF_THICKNESS: f64 = 1.0;
/// Waves that make up a rough surface: enough that no direction stands out.
const WAVES: usize = 64;
/// Cells of a rough surface in its shortest wave.
const CELLS_PER_WAVE: f64 = 8.0;

/// Minimum extent of a run's ground \[m\]. Any number would do. This one yields the built-in step's metrics in tables.
const REACH_M: f64 = 202.4;

/// How far the ground of a scenario's physics reaches to all sides \[m\]: at least twice as far as the command goes.
///
/// Coordinates within a box are rounded in proportion to its size. Therefore runs that differ only in `duration_s` have
/// the same ground, unless exactly one of them exceeds 100 m, 3 km or 100 km.
pub(crate) fn reach_m(scenario: &Scenario) -> f64 {
    let mut reach_m = REACH_M;
    while reach_m < 2.0 * scenario.farthest_m() {
        reach_m *= 32.0;
    }
    reach_m
}

/// A part of the ground, in the world's frame.
#[derive(Clone, Debug, PartialEq)]
// Not `non_exhaustive`: a shape that is left out is a hole in the ground. Whatever the terrain, these can make it.
pub enum Shape {
    /// A box.
    Box {
        /// Half its edges \[m\].
        half_m: [f64; 3],
        /// Its centre \[m\].
        centre_m: [f64; 3],
        /// Its turn about y \[rad\]; negative raises its front.
        turn_y_rad: f64,
    },
    /// A round bar across the way, along y.
    Bar {
        /// Half its length \[m\].
        half_length_m: f64,
        /// Its radius \[m\].
        radius_m: f64,
        /// Its centre \[m\].
        centre_m: [f64; 3],
    },
    /// Heights at the corners of cells, rows going forward, columns to the right from the left border.
    Field {
        /// Position of the first row along x \[m\].
        from_m: f64,
        /// Its length and width, along x and y \[m\]; its middle is at y = 0.
        extent_m: [f64; 2],
        /// Rows of cells.
        rows: usize,
        /// Columns of cells.
        columns: usize,
        /// Row by row \[m\].
        heights_m: Vec<f64>,
    },
}

/// The shapes of a scenario's ground, which reaches `far` \[m\] to all sides; none for unknown ground, which
/// [`Simulation::new`](crate::Simulation::new) rejects.
///
/// ```
/// use omni_sim::{config::Scenario, ground::{Shape, shapes}};
/// let ground = shapes(&Scenario::load("step", &[])?, 100.0);
/// let top_m = |shape: &Shape| match shape {
///     Shape::Box { half_m, centre_m, .. } => centre_m[2] + half_m[2],
///     _ => f64::NAN,
/// };
/// assert_eq!((ground.len(), top_m(&ground[0])), (2, 0.0)); // the floor
/// assert!((top_m(&ground[1]) - 0.05).abs() < 1e-12); // and a step of 5 cm
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[must_use]
pub fn shapes(scenario: &Scenario, far: f64) -> Vec<Shape> {
    let mut ground = Ground {
        shapes: Vec::new(),
        far,
    };
    ground.build(&scenario.terrain);
    // Ground that is unknown stays none.
    if !ground.shapes.is_empty() {
        for block in &scenario.block {
            ground.slab(block.x_m, block.y_m, block.height_m);
        }
    }
    ground.shapes
}

struct Ground {
    shapes: Vec<Shape>,
    far: f64,
}

impl Ground {
    fn build(&mut self, terrain: &Terrain) {
        let far = self.far;
        let ground = self;
        match terrain {
            Terrain::Flat { .. } => ground.slab([-far, far], [-far, far], 0.0),
            Terrain::Step {
                height_m, start_x_m, ..
            } => {
                ground.slab([-far, far], [-far, far], 0.0);
                ground.slab([*start_x_m, far], [-far, far], *height_m);
            }
            Terrain::StepDown {
                height_m, start_x_m, ..
            } => {
                ground.slab([-far, far], [-far, far], -height_m);
                ground.slab([-far, *start_x_m], [-far, far], 0.0);
            }
            Terrain::Stairs {
                height_m,
                tread_m,
                count,
                start_x_m,
                ..
            } => {
                ground.slab([-far, far], [-far, far], 0.0);
                for k in 0..*count {
                    let k = f64::from(k);
                    ground.slab([start_x_m + k * tread_m, far], [-far, far], (k + 1.0) * height_m);
                }
            }
            Terrain::Ramp {
                slope_rad,
                length_m,
                start_x_m,
                ..
            } => {
                let height = length_m * libm::tan(*slope_rad);
                ground.slab([-far, far], [-far, far], 0.0);
                ground.slab([start_x_m + length_m, far], [-far, far], height);
                ground.wedge(*start_x_m, *length_m, height);
            }
            Terrain::HalfStep {
                height_m,
                left_of_m,
                start_x_m,
                ..
            } => {
                ground.slab([-far, far], [-far, far], 0.0);
                ground.slab([*start_x_m, far], [*left_of_m, far], *height_m);
            }
            Terrain::Ditch {
                width_m,
                depth_m,
                start_x_m,
                ..
            } => {
                ground.slab([-far, *start_x_m], [-far, far], 0.0);
                ground.slab([start_x_m + width_m, far], [-far, far], 0.0);
                // The bottom lies between the walls, so that these are all one face.
                ground.slab([*start_x_m, start_x_m + width_m], [-far, far], -depth_m);
            }
            Terrain::Bumps {
                height_m,
                width_m,
                spacing_m,
                count,
                start_x_m,
                ..
            } => {
                ground.slab([-far, far], [-far, far], 0.0);
                // A circle through both feet and the top.
                let radius = (width_m * width_m / 4.0 + height_m * height_m) / (2.0 * height_m);
                for k in 0..*count {
                    let x = start_x_m + width_m / 2.0 + f64::from(k) * spacing_m;
                    ground.bar(x, height_m - radius, radius);
                }
            }
            Terrain::Rough {
                rms_m,
                wavelength_m,
                length_m,
                width_m,
                seed,
                start_x_m,
                ..
            } => {
                let surface = RoughSurface {
                    rms_m: *rms_m,
                    wavelength_m: *wavelength_m,
                    extent_m: [*length_m, *width_m],
                    waves: waves(*seed, *wavelength_m),
                };
                let cells = surface.cells();
                ground.field(*start_x_m, surface.extent_m, cells, |i, j| surface.height_m(i, j));
            }
            Terrain::HeightMap {
                image,
                pixel_m,
                black_height_m,
                white_height_m,
                start_x_m,
                ..
            } => {
                let (rows, columns) = (image.rows(), image.columns());
                let extent = [rows, columns].map(|n| pixel_m * (n - 1) as f64);
                let heights = |i: usize, j: usize| {
                    black_height_m + (white_height_m - black_height_m) * image.level(rows - 1 - i, j)
                };
                ground.field(*start_x_m, extent, [rows, columns], heights);
            }
            _ => {}
        }
    }

    /// A box with its upper face at `top`.
    fn slab(&mut self, x: [f64; 2], y: [f64; 2], top: f64) {
        let half = |[from, to]: [f64; 2]| (to - from) / 2.0;
        let middle = |[from, to]: [f64; 2]| f64::midpoint(from, to);
        self.shapes.push(Shape::Box {
            half_m: [half(x), half(y), HALF_THICKNESS],
            centre_m: [middle(x), middle(y), top - HALF_THICKNESS],
            turn_y_rad: 0.0,
        });
    }

    /// A slope from the plane at `from` up to `height`: a tilted box that goes on into the lower
    /// slab, with its back inside the upper one.
    fn wedge(&mut self, from: f64, length: f64, height: f64) {
        let slope = libm::atan2(height, length);
        let (sin, cos) = (libm::sin(slope), libm::cos(slope));
        let half = libm::hypot(length, height) / 2.0 + HALF_THICKNESS / 2.0;
        // From the crest back along the slope, then down across it.
        let x = from + length - half * cos + HALF_THICKNESS * sin;
        let z = height - half * sin - HALF_THICKNESS * cos;
        self.shapes.push(Shape::Box {
            half_m: [half, self.far, HALF_THICKNESS],
            centre_m: [x, 0.0, z],
            turn_y_rad: -slope,
        });
    }

    /// A round bar across the way.
    fn bar(&mut self, x: f64, z: f64, radius: f64) {
        self.shapes.push(Shape::Bar {
            half_length_m: self.far,
            radius_m: radius,
            centre_m: [x, 0.0, z],
        });
    }

    /// A field of heights from `from` on, with the plane around it.
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
        let heights = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        self.shapes.push(Shape::Field {
            from_m: from,
            extent_m: [length, width],
            rows,
            columns,
            heights_m: heights.map(|(i, j)| height(i, j)).collect(),
        });
    }
}

/// A surface of waves that fades to the plane at its borders.
struct RoughSurface {
    rms_m: f64,
    wavelength_m: f64,
    extent_m: [f64; 2],
    waves: [[f64; 3]; WAVES],
}

impl RoughSurface {
    /// Numbers of corners along x and y.
    fn cells(&self) -> [usize; 2] {
        self.extent_m
            .map(|extent| (extent / self.wavelength_m * CELLS_PER_WAVE).ceil() as usize + 1)
    }

    /// Height of a corner, as [`Shape::Field`] counts them.
    fn height_m(&self, i: usize, j: usize) -> f64 {
        let ([rows, columns], [length, width]) = (self.cells(), self.extent_m);
        let x = length * i as f64 / (rows - 1) as f64;
        let y = width * (0.5 - j as f64 / (columns - 1) as f64);
        let fade = fade(x, length, self.wavelength_m) * fade(y + width / 2.0, width, self.wavelength_m);
        let sum: f64 = self
            .waves
            .iter()
            .map(|[kx, ky, phase]| libm::sin(kx * x + ky * y + phase))
            .sum();
        // Each of the waves has a mean square of a half.
        self.rms_m * fade * sum / (WAVES as f64 / 2.0).sqrt()
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
