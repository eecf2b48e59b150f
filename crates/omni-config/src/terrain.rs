//! The ground, as a file gives it.

mod shape;

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::height_map::HeightMap;
use crate::kind_tables::deserialize_by_kind;
use crate::ranges::{
    self, BLOCK_HEIGHT_M, BUMP_M, COUNT, FIELD_M, FRICTION, LENGTH_M, LEVEL_M, PIXEL_M, PLACE_M, RISER_M,
    RMS_M, SEED, SLOPE_RAD, STEP_HEIGHT_M, TIME_S, TREAD_M, VELOCITY_M_S, WAVELENGTH_M, WIDTH_M, WORLD_M,
    within,
};

/// The ground ahead of the vehicle: a plane at z = 0 and, from world x = `start_x_m` on, an obstacle
/// across the path. Every kind has `friction`, the Coulomb coefficient between wheels and ground, 0 to 2.
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
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
    },
    /// A higher plane from `start_x_m` on.
    Step {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Height of the step \[m\], 1e-4 to 10.
        #[garde(adapt(ranges), range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max))]
        height_m: f64,
        /// World x of the riser \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// A lower plane from `start_x_m` on.
    StepDown {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Depth of the step \[m\], 1e-4 to 10.
        #[garde(adapt(ranges), range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max))]
        height_m: f64,
        /// World x of the edge \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// Equal steps up, one after the other; the last one goes on as a plane.
    Stairs {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Height of each step \[m\], 1e-4 to 10.
        #[garde(adapt(ranges), range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max))]
        height_m: f64,
        /// Distance from riser to riser \[m\], 0.01 to 10.
        #[garde(adapt(ranges), range(min = TREAD_M.min, max = TREAD_M.max))]
        tread_m: f64,
        /// Number of steps, 1 to 100.
        #[garde(adapt(ranges), range(min = COUNT.min, max = COUNT.max))]
        count: u32,
        /// World x of the first riser \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// A slope up to a higher plane.
    Ramp {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Slope \[rad\], 0.001 to 1.2; up is positive.
        #[garde(adapt(ranges), range(min = SLOPE_RAD.min, max = SLOPE_RAD.max))]
        slope_rad: f64,
        /// Length of the slope, measured level \[m\], 0.01 to 100.
        #[garde(adapt(ranges), range(min = LENGTH_M.min, max = LENGTH_M.max))]
        length_m: f64,
        /// World x of its foot \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// A step that only the left wheels meet: the higher plane lies at y > `left_of_m`.
    HalfStep {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Height of the step \[m\], 1e-4 to 10.
        #[garde(adapt(ranges), range(min = STEP_HEIGHT_M.min, max = STEP_HEIGHT_M.max))]
        height_m: f64,
        /// World y of the step's side (left is +) \[m\], -100 to 100; the step lies to the left of it.
        #[serde(default)]
        #[garde(adapt(ranges), range(min = PLACE_M.min, max = PLACE_M.max))]
        left_of_m: f64,
        /// World x of the riser \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// A trench with upright walls.
    Ditch {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Width of the trench, along x \[m\], 1e-3 to 10.
        #[garde(adapt(ranges), range(min = WIDTH_M.min, max = WIDTH_M.max))]
        width_m: f64,
        /// Depth of the trench \[m\], 1e-3 to 10.
        #[garde(adapt(ranges), range(min = WIDTH_M.min, max = WIDTH_M.max))]
        depth_m: f64,
        /// World x of the near wall \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// Round bars across the path, sunk into the ground: cables and sills.
    Bumps {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Height above the ground \[m\], 1e-4 to 1.
        #[garde(adapt(ranges), range(min = BUMP_M.min, max = BUMP_M.max))]
        height_m: f64,
        /// Width at the ground, at least twice the height \[m\], 1e-3 to 10. A half round is twice as wide as high.
        #[garde(adapt(ranges), range(min = WIDTH_M.min, max = WIDTH_M.max))]
        width_m: f64,
        /// Distance from bar to bar \[m\], 0.01 to 100.
        #[garde(adapt(ranges), range(min = LENGTH_M.min, max = LENGTH_M.max))]
        spacing_m: f64,
        /// Number of bars, 1 to 100.
        #[garde(adapt(ranges), range(min = COUNT.min, max = COUNT.max))]
        count: u32,
        /// World x of the first bar's near side \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// A random surface: a sum of waves in all directions that fades into the plane at its borders.
    Rough {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// Root mean square of the height \[m\], 0 to 1.
        #[garde(adapt(ranges), range(min = RMS_M.min, max = RMS_M.max))]
        rms_m: f64,
        /// Shortest wave \[m\], 0.02 to 10; the longest is four times as long.
        #[garde(adapt(ranges), range(min = WAVELENGTH_M.min, max = WAVELENGTH_M.max))]
        wavelength_m: f64,
        /// Extent along x \[m\], 0.1 to 50.
        #[garde(adapt(ranges), range(min = FIELD_M.min, max = FIELD_M.max))]
        length_m: f64,
        /// Extent along y, half of it on either side \[m\], 0.1 to 50.
        #[garde(adapt(ranges), range(min = FIELD_M.min, max = FIELD_M.max))]
        width_m: f64,
        /// Seed of the surface; the scenario's own seed does not change the ground.
        #[serde(default)]
        #[garde(adapt(ranges), range(min = SEED.min, max = SEED.max))]
        seed: u32,
        /// World x at which it begins \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
    },
    /// Heights from a grey picture: up in the picture is forward, its middle column lies at y = 0.
    HeightMap {
        /// Coulomb friction coefficient between wheels and ground, 0 to 2.
        #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
        friction: f64,
        /// A PNG, grey, of 8 or 16 bits: a path relative to this file. (A log holds it as a data URL.)
        #[garde(skip)] // read or refused when the file is loaded
        #[cfg_attr(feature = "schema", schemars(with = "String"))]
        image: HeightMap,
        /// Edge of a pixel \[m\], 1e-4 to 10.
        #[garde(adapt(ranges), range(min = PIXEL_M.min, max = PIXEL_M.max))]
        pixel_m: f64,
        /// Height of black \[m\], -10 to 10.
        #[serde(default)]
        #[garde(adapt(ranges), range(min = LEVEL_M.min, max = LEVEL_M.max))]
        black_height_m: f64,
        /// Height of white \[m\], -10 to 10.
        #[garde(adapt(ranges), range(min = LEVEL_M.min, max = LEVEL_M.max))]
        white_height_m: f64,
        /// World x of the picture's lower edge \[m\], 0.001 to 190.
        #[garde(adapt(ranges), range(min = RISER_M.min, max = RISER_M.max))]
        start_x_m: f64,
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
        start_x_m: f64,
    },
    StepDown {
        friction: f64,
        height_m: f64,
        start_x_m: f64,
    },
    Stairs {
        friction: f64,
        height_m: f64,
        tread_m: f64,
        #[serde(deserialize_with = "crate::integers::count")]
        count: u32,
        start_x_m: f64,
    },
    Ramp {
        friction: f64,
        slope_rad: f64,
        length_m: f64,
        start_x_m: f64,
    },
    HalfStep {
        friction: f64,
        height_m: f64,
        #[serde(default)]
        left_of_m: f64,
        start_x_m: f64,
    },
    Ditch {
        friction: f64,
        width_m: f64,
        depth_m: f64,
        start_x_m: f64,
    },
    Bumps {
        friction: f64,
        height_m: f64,
        width_m: f64,
        spacing_m: f64,
        #[serde(deserialize_with = "crate::integers::count")]
        count: u32,
        start_x_m: f64,
    },
    Rough {
        friction: f64,
        rms_m: f64,
        wavelength_m: f64,
        length_m: f64,
        width_m: f64,
        #[serde(default, deserialize_with = "crate::integers::seed_32")]
        seed: u32,
        start_x_m: f64,
    },
    HeightMap {
        friction: f64,
        image: HeightMap,
        pixel_m: f64,
        #[serde(default)]
        black_height_m: f64,
        white_height_m: f64,
        start_x_m: f64,
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

/// An upright block on the ground: a sill, a kerb, a platform, a wall.
///
/// ```
/// use omni_config::{Override, Scenario};
/// let sill = Override::parse("block=[{ x_m = [1.0, 1.05], y_m = [-2.0, 2.0], height_m = 0.03 }]")?;
/// let hall = Scenario::load("flat", &[sill, Override::new("vehicle", "mecanum4")])?;
/// assert_eq!(hall.block[0].height_m, 0.03);
/// assert!(hall.rollers(0).is_some()); // it has edges, where balls are no mecanum wheels
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Block {
    /// World x from and to \[m\], in this order, -10000 to 10000.
    #[garde(custom(within(WORLD_M)), custom(interval))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = WORLD_M.min, max = WORLD_M.max))))]
    pub x_m: [f64; 2],
    /// World y from and to \[m\], in this order (left is +), -10000 to 10000.
    #[garde(custom(within(WORLD_M)), custom(interval))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = WORLD_M.min, max = WORLD_M.max))))]
    pub y_m: [f64; 2],
    /// Height of its top above z = 0 \[m\], 1e-4 to 1.
    #[garde(adapt(ranges), range(min = BLOCK_HEIGHT_M.min, max = BLOCK_HEIGHT_M.max))]
    pub height_m: f64,
}

impl Block {
    /// How far a place of the world is from it \[m\]; 0 within it.
    pub(crate) fn distance_m(&self, [x, y]: [f64; 2]) -> f64 {
        let off = |[from, to]: [f64; 2], at: f64| at - at.clamp(from, to);
        libm::hypot(off(self.x_m, x), off(self.y_m, y))
    }
}

/// A rectangle of the ground with another friction: oil, ice, a carpet. It may come, move and go.
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
    #[garde(adapt(ranges), range(min = FRICTION.min, max = FRICTION.max))]
    pub friction: f64,
    /// How it moves, world x and y \[m/s\], -100 to 100; left out: not at all. `x_m` and `y_m` are
    /// where it is at `from_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), inner(range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max)))]
    pub velocity_m_s: Option<[f64; 2]>,
    /// It is there from this time \[s\], 0 to 3600; left out: from the start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub from_s: Option<f64>,
    /// It is there until this time \[s\], 0 to 3600; left out: to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub until_s: Option<f64>,
}

impl FrictionPatch {
    /// Is a place of the world \[m\] in it at a time \[s\]?
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let patch = "friction_patch=[{x_m=[0, 1], y_m=[0, 1], friction=0.1, velocity_m_s=[0.5, 0], from_s=1.0}]";
    /// let patch = Scenario::load("flat", &[Override::parse(patch)?])?.friction_patch[0];
    /// assert_eq!([0.9, 1.0, 3.0].map(|time_s| patch.holds(0.5, 0.5, time_s)), [false, true, false]); // it lies at x = 1 to 2 then
    /// assert!(patch.holds(1.5, 0.5, 3.0));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn holds(&self, x_m: f64, y_m: f64, time_s: f64) -> bool {
        let from_s = self.from_s.unwrap_or(0.0);
        let [vx, vy] = self.velocity_m_s.unwrap_or_default();
        let inside = |[from, to]: [f64; 2], at: f64| at >= from && at < to;
        let since_s = time_s - from_s;
        since_s >= 0.0
            && time_s < self.until_s.unwrap_or(f64::INFINITY)
            && inside(self.x_m, x_m - vx * since_s)
            && inside(self.y_m, y_m - vy * since_s)
    }

    /// The key that makes it another patch at another time, where one does.
    #[must_use]
    pub fn changes_by(&self) -> Option<&'static str> {
        let moves = self.velocity_m_s.is_some_and(|v| v != [0.0; 2]);
        match (moves, self.from_s, self.until_s) {
            (true, ..) => Some("velocity_m_s"),
            (false, Some(from_s), _) if from_s > 0.0 => Some("from_s"),
            (false, _, Some(_)) => Some("until_s"),
            _ => None,
        }
    }

    /// The key and what is wrong with it where it ends before it begins.
    pub(crate) fn refusal(&self) -> Option<(&'static str, String)> {
        let (from_s, until_s) = (self.from_s.unwrap_or(0.0), self.until_s?);
        (until_s <= from_s).then(|| {
            (
                "until_s",
                format!("{until_s}, allowed: more than from_s, {from_s}"),
            )
        })
    }
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
