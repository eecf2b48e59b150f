//! The ground.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::height_map::HeightMap;
use crate::ranges::{
    BUMP_M, COUNT, FIELD_M, FRICTION, LENGTH_M, LEVEL_M, PIXEL_M, PLACE_M, RISER_M, RMS_M, SEED, SLOPE_RAD,
    STEP_HEIGHT_M, TREAD_M, WAVELENGTH_M, WIDTH_M, WORLD_M, within,
};
use crate::tagged::deserialize_by_kind;

/// The ground ahead of the vehicle: a plane at z = 0 and, from world x = `at_m` on, an obstacle across the way. Every kind has
/// `friction`, the Coulomb coefficient between wheels and ground, 0 to 2.
///
/// ```
/// use omni_config::{Scenario, Terrain};
/// let stairs = Scenario::load("stairs", &[])?.terrain;
/// let obstacle = stairs.obstacle().expect("stairs are one");
/// assert!((obstacle.to_m - obstacle.from_m - 2.0 * 0.40).abs() < 1e-12); // three steps, two treads between
/// assert!((stairs.level_beyond_m(0.0) - 0.09).abs() < 1e-12);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Terrain {
    /// A plane.
    Flat {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
    },
    /// A higher plane from `at_m` on.
    Step {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Height of the step \[m\], 1e-4 to 10.
        #[garde(custom(within(STEP_HEIGHT_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max)))]
        height_m: f64,
        /// World x of the riser \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// A lower plane from `at_m` on.
    StepDown {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Depth of the step \[m\], 1e-4 to 10.
        #[garde(custom(within(STEP_HEIGHT_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max)))]
        height_m: f64,
        /// World x of the edge \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// Equal steps up, one after the other; the last one goes on as a plane.
    Stairs {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Height of each step \[m\], 1e-4 to 10.
        #[garde(custom(within(STEP_HEIGHT_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max)))]
        height_m: f64,
        /// Way from riser to riser \[m\], 0.01 to 10.
        #[garde(custom(within(TREAD_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TREAD_M.min, max = TREAD_M.max)))]
        tread_m: f64,
        /// Number of steps, 1 to 100.
        #[garde(custom(within(COUNT)))]
        #[cfg_attr(feature = "schema", schemars(range(min = COUNT.min, max = COUNT.max)))]
        count: u32,
        /// World x of the first riser \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// A slope up to a higher plane.
    Ramp {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Slope \[rad\], 0.001 to 1.2; up is positive.
        #[garde(custom(within(SLOPE_RAD)))]
        #[cfg_attr(feature = "schema", schemars(range(min = SLOPE_RAD.min, max = SLOPE_RAD.max)))]
        slope_rad: f64,
        /// Length of the slope, measured level \[m\], 0.01 to 100.
        #[garde(custom(within(LENGTH_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = LENGTH_M.min, max = LENGTH_M.max)))]
        length_m: f64,
        /// World x of its foot \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// A step that only the left wheels meet: the higher plane lies at y > `left_of_m`.
    HalfStep {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Height of the step \[m\], 1e-4 to 10.
        #[garde(custom(within(STEP_HEIGHT_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max)))]
        height_m: f64,
        /// World y of the step's side (left is +) \[m\], -100 to 100; the step lies to the left of it.
        #[serde(default)]
        #[garde(custom(within(PLACE_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = PLACE_M.min, max = PLACE_M.max)))]
        left_of_m: f64,
        /// World x of the riser \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// A trench with upright walls.
    Ditch {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Width of the trench, along x \[m\], 1e-3 to 10.
        #[garde(custom(within(WIDTH_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = WIDTH_M.min, max = WIDTH_M.max)))]
        width_m: f64,
        /// Depth of the trench \[m\], 1e-3 to 10.
        #[garde(custom(within(WIDTH_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = WIDTH_M.min, max = WIDTH_M.max)))]
        depth_m: f64,
        /// World x of the near wall \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// Round bars across the way, sunk into the ground: cables and sills.
    Bumps {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Height above the ground \[m\], 1e-4 to 1.
        #[garde(custom(within(BUMP_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = BUMP_M.min, max = BUMP_M.max)))]
        height_m: f64,
        /// Width at the ground, at least twice the height \[m\], 1e-3 to 10. A half round is twice as wide as high.
        #[garde(custom(within(WIDTH_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = WIDTH_M.min, max = WIDTH_M.max)))]
        width_m: f64,
        /// Way from bar to bar \[m\], 0.01 to 100.
        #[garde(custom(within(LENGTH_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = LENGTH_M.min, max = LENGTH_M.max)))]
        spacing_m: f64,
        /// Number of bars, 1 to 100.
        #[garde(custom(within(COUNT)))]
        #[cfg_attr(feature = "schema", schemars(range(min = COUNT.min, max = COUNT.max)))]
        count: u32,
        /// World x of the first bar's near side \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// A random surface: a sum of waves in all directions that fades into the plane at its borders.
    Rough {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// Root mean square of the height \[m\], 0 to 1.
        #[garde(custom(within(RMS_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RMS_M.min, max = RMS_M.max)))]
        rms_m: f64,
        /// Shortest wave \[m\], 0.02 to 10; the longest is four times as long.
        #[garde(custom(within(WAVELENGTH_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = WAVELENGTH_M.min, max = WAVELENGTH_M.max)))]
        wavelength_m: f64,
        /// Extent along x \[m\], 0.1 to 50.
        #[garde(custom(within(FIELD_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FIELD_M.min, max = FIELD_M.max)))]
        length_m: f64,
        /// Extent along y, half of it on either side \[m\], 0.1 to 50.
        #[garde(custom(within(FIELD_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FIELD_M.min, max = FIELD_M.max)))]
        width_m: f64,
        /// Seed of the surface; the scenario's own seed does not change the ground.
        #[serde(default)]
        #[garde(custom(within(SEED)))]
        #[cfg_attr(feature = "schema", schemars(range(min = SEED.min, max = SEED.max)))]
        seed: u32,
        /// World x at which it begins \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
    /// Heights from a grey picture: up in the picture is forward, its middle column lies at y = 0.
    HeightMap {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(custom(within(FRICTION)))]
        #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
        friction: f64,
        /// A PNG, grey, of 8 or 16 bits: a path relative to this file. (A log holds it as a data URL.)
        #[garde(skip)] // read or refused when the file is loaded
        #[cfg_attr(feature = "schema", schemars(with = "String"))]
        image: HeightMap,
        /// Edge of a pixel \[m\], 1e-4 to 10.
        #[garde(custom(within(PIXEL_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = PIXEL_M.min, max = PIXEL_M.max)))]
        pixel_m: f64,
        /// Height of black \[m\], -10 to 10.
        #[serde(default)]
        #[garde(custom(within(LEVEL_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = LEVEL_M.min, max = LEVEL_M.max)))]
        black_m: f64,
        /// Height of white \[m\], -10 to 10.
        #[garde(custom(within(LEVEL_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = LEVEL_M.min, max = LEVEL_M.max)))]
        white_m: f64,
        /// World x of the picture's lower edge \[m\], 1e-3 to 1000.
        #[garde(custom(within(RISER_M)))]
        #[cfg_attr(feature = "schema", schemars(range(min = RISER_M.min, max = RISER_M.max)))]
        at_m: f64,
    },
}

#[derive(Deserialize)]
#[serde(remote = "Terrain", rename_all = "snake_case", deny_unknown_fields)]
enum TerrainByKind {
    Flat {
        friction: f64,
    },
    Step {
        friction: f64,
        height_m: f64,
        at_m: f64,
    },
    StepDown {
        friction: f64,
        height_m: f64,
        at_m: f64,
    },
    Stairs {
        friction: f64,
        height_m: f64,
        tread_m: f64,
        count: u32,
        at_m: f64,
    },
    Ramp {
        friction: f64,
        slope_rad: f64,
        length_m: f64,
        at_m: f64,
    },
    HalfStep {
        friction: f64,
        height_m: f64,
        #[serde(default)]
        left_of_m: f64,
        at_m: f64,
    },
    Ditch {
        friction: f64,
        width_m: f64,
        depth_m: f64,
        at_m: f64,
    },
    Bumps {
        friction: f64,
        height_m: f64,
        width_m: f64,
        spacing_m: f64,
        count: u32,
        at_m: f64,
    },
    Rough {
        friction: f64,
        rms_m: f64,
        wavelength_m: f64,
        length_m: f64,
        width_m: f64,
        #[serde(default)]
        seed: u32,
        at_m: f64,
    },
    HeightMap {
        friction: f64,
        image: HeightMap,
        pixel_m: f64,
        #[serde(default)]
        black_m: f64,
        white_m: f64,
        at_m: f64,
    },
}
deserialize_by_kind!(Terrain, TerrainByKind);

/// Where an obstacle lies along x \[m\]: it is passed when a wheel's centre is beyond `to_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Obstacle {
    /// World x of its near side.
    pub from_m: f64,
    /// World x of its far side; that of a step is its riser.
    pub to_m: f64,
}

impl Terrain {
    /// Coulomb friction coefficient between wheels and ground, outside any patch.
    #[must_use]
    pub fn friction(&self) -> f64 {
        match self {
            Self::Flat { friction }
            | Self::Step { friction, .. }
            | Self::StepDown { friction, .. }
            | Self::Stairs { friction, .. }
            | Self::Ramp { friction, .. }
            | Self::HalfStep { friction, .. }
            | Self::Ditch { friction, .. }
            | Self::Bumps { friction, .. }
            | Self::Rough { friction, .. }
            | Self::HeightMap { friction, .. } => *friction,
        }
    }

    /// Where the obstacle lies; none on flat ground.
    #[must_use]
    pub fn obstacle(&self) -> Option<Obstacle> {
        let (from_m, length) = match self {
            Self::Flat { .. } => return None,
            Self::Step { at_m, .. } | Self::StepDown { at_m, .. } | Self::HalfStep { at_m, .. } => {
                (*at_m, 0.0)
            }
            Self::Stairs {
                tread_m, count, at_m, ..
            } => (*at_m, tread_m * f64::from(count - 1)),
            Self::Ramp { length_m, at_m, .. } | Self::Rough { length_m, at_m, .. } => (*at_m, *length_m),
            Self::Ditch { width_m, at_m, .. } => (*at_m, *width_m),
            Self::Bumps {
                width_m,
                spacing_m,
                count,
                at_m,
                ..
            } => (*at_m, width_m + spacing_m * f64::from(count - 1)),
            Self::HeightMap {
                image, pixel_m, at_m, ..
            } => (*at_m, pixel_m * (image.rows() - 1) as f64),
        };
        Some(Obstacle {
            from_m,
            to_m: from_m + length,
        })
    }

    /// Height of the ground beyond the obstacle \[m\] at world y \[m\].
    #[must_use]
    pub fn level_beyond_m(&self, y_m: f64) -> f64 {
        match self {
            Self::Step { height_m, .. } => *height_m,
            Self::StepDown { height_m, .. } => -height_m,
            Self::Stairs { height_m, count, .. } => height_m * f64::from(*count),
            Self::Ramp {
                slope_rad, length_m, ..
            } => length_m * libm::tan(*slope_rad),
            Self::HalfStep {
                height_m, left_of_m, ..
            } if y_m > *left_of_m => *height_m,
            _ => 0.0,
        }
    }

    /// Height of the first edge that a wheel meets \[m\]; 0 where it meets none at once.
    #[must_use]
    pub fn first_edge_m(&self) -> f64 {
        match self {
            Self::Step { height_m, .. } | Self::Stairs { height_m, .. } | Self::HalfStep { height_m, .. } => {
                *height_m
            }
            _ => 0.0,
        }
    }

    /// Largest difference in height \[m\] that it can have between two wheels `span_m` apart \[m\].
    ///
    /// ```
    /// let relief_m = |name| omni_config::Scenario::load(name, &[]).map(|scenario| scenario.terrain.relief_m(0.3));
    /// assert_eq!((relief_m("flat")?, relief_m("step")?), (0.0, 0.05));
    /// assert!((relief_m("ramp")? - 0.3 * libm::tan(0.175)).abs() < 1e-12);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn relief_m(&self, span_m: f64) -> f64 {
        match self {
            Self::Flat { .. } => 0.0,
            Self::Step { height_m, .. }
            | Self::StepDown { height_m, .. }
            | Self::HalfStep { height_m, .. }
            | Self::Bumps { height_m, .. } => *height_m,
            Self::Stairs {
                height_m,
                tread_m,
                count,
                ..
            } => height_m * (1.0 + (span_m / tread_m).floor()).min(f64::from(*count)),
            Self::Ramp {
                slope_rad, length_m, ..
            } => span_m.min(*length_m) * libm::tan(*slope_rad),
            Self::Ditch { depth_m, .. } => *depth_m,
            // Heights of many waves at once: less than three times their root mean square, up or down.
            Self::Rough { rms_m, .. } => 6.0 * rms_m,
            Self::HeightMap { black_m, white_m, .. } => {
                let (low, high) = (black_m.min(*white_m).min(0.0), black_m.max(*white_m).max(0.0));
                high - low
            }
        }
    }

    /// What a person would call it, as `over a step of 5.0 cm`.
    #[must_use]
    pub fn described(&self) -> String {
        let cm = |metres: &f64| format!("{:.1} cm", 100.0 * metres);
        match self {
            Self::Flat { .. } => "on flat ground".into(),
            Self::Step { height_m, .. } => format!("over a step of {}", cm(height_m)),
            Self::StepDown { height_m, .. } => format!("down a step of {}", cm(height_m)),
            Self::Stairs { height_m, count, .. } if *count == 1 => format!("up 1 step of {}", cm(height_m)),
            Self::Stairs {
                height_m,
                tread_m,
                count,
                ..
            } => format!("up {count} steps of {}, every {}", cm(height_m), cm(tread_m)),
            Self::Ramp {
                slope_rad, length_m, ..
            } => format!("up a ramp of {:.1} deg, {}", slope_rad.to_degrees(), cm(length_m)),
            Self::HalfStep { height_m, .. } => format!("over a step of {} on the left", cm(height_m)),
            Self::Ditch { width_m, depth_m, .. } => {
                format!("over a ditch {} wide and {} deep", cm(width_m), cm(depth_m))
            }
            Self::Bumps { height_m, count, .. } => {
                let bumps = if *count == 1 { "bump" } else { "bumps" };
                format!("over {count} {bumps} of {}", cm(height_m))
            }
            Self::Rough { rms_m, length_m, .. } => {
                format!("over {length_m} m of rough ground, rms {}", cm(rms_m))
            }
            Self::HeightMap { image, pixel_m, .. } => {
                let metres = |pixels: usize| pixel_m * (pixels - 1) as f64;
                format!(
                    "over a height map of {:.2} x {:.2} m",
                    metres(image.rows()),
                    metres(image.columns())
                )
            }
        }
    }

    /// What no single key shows: the key, and what is wrong with it.
    pub(crate) fn refusal(&self) -> Option<(&'static str, String)> {
        match self {
            Self::Bumps {
                height_m, width_m, ..
            } if *width_m < 2.0 * height_m => {
                let least = 2.0 * height_m;
                Some((
                    "width_m",
                    format!("{width_m}, allowed: at least twice height_m, {least}"),
                ))
            }
            Self::Bumps {
                width_m,
                spacing_m,
                count,
                ..
            } if *count > 1 && spacing_m < width_m => Some((
                "spacing_m",
                format!("{spacing_m}, allowed: at least width_m, {width_m}"),
            )),
            Self::Rough {
                wavelength_m,
                length_m,
                width_m,
                ..
            } => {
                let least = 2.0 * wavelength_m;
                [("length_m", length_m), ("width_m", width_m)]
                    .into_iter()
                    .find(|(_, extent)| **extent < least)
                    .map(|(key, extent)| {
                        (
                            key,
                            format!("{extent}, allowed: at least twice wavelength_m, {least}"),
                        )
                    })
            }
            _ => None,
        }
    }
}

/// A rectangle of the ground with a friction of its own: oil, ice, a carpet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct FrictionPatch {
    /// World x from and to \[m\], in this order, -10000 to 10000.
    #[garde(custom(within(WORLD_M)), custom(interval))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = WORLD_M.min, max = WORLD_M.max))))]
    pub x_m: [f64; 2],
    /// World y from and to \[m\], in this order (left is +), -10000 to 10000.
    #[garde(custom(within(WORLD_M)), custom(interval))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = WORLD_M.min, max = WORLD_M.max))))]
    pub y_m: [f64; 2],
    /// Coulomb friction coefficient between wheels and ground, 0 to 2. Where patches overlap the last one counts.
    #[garde(custom(within(FRICTION)))]
    #[cfg_attr(feature = "schema", schemars(range(min = FRICTION.min, max = FRICTION.max)))]
    pub friction: f64,
}

fn interval(value: &[f64; 2], _: &()) -> garde::Result {
    let [from, to] = value;
    if from.is_finite() && to.is_finite() && from < to {
        Ok(())
    } else {
        Err(garde::Error::new(format!(
            "{value:?}, allowed: [from, to], finite, from < to"
        )))
    }
}
