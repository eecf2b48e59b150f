//! Extent and height of the ground.

use super::{Obstacle, Terrain};

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

    /// Extent of the obstacle; none on flat ground.
    #[must_use]
    pub fn obstacle(&self) -> Option<Obstacle> {
        let (from_m, length) = match self {
            Self::Flat { .. } => return None,
            Self::Step { start_x_m, .. }
            | Self::StepDown { start_x_m, .. }
            | Self::HalfStep { start_x_m, .. } => (*start_x_m, 0.0),
            Self::Stairs {
                tread_m,
                count,
                start_x_m,
                ..
            } => (*start_x_m, tread_m * f64::from(count - 1)),
            Self::Ramp {
                length_m, start_x_m, ..
            }
            | Self::Rough {
                length_m, start_x_m, ..
            } => (*start_x_m, *length_m),
            Self::Ditch {
                width_m, start_x_m, ..
            } => (*start_x_m, *width_m),
            Self::Bumps {
                width_m,
                spacing_m,
                count,
                start_x_m,
                ..
            } => (*start_x_m, width_m + spacing_m * f64::from(count - 1)),
            Self::HeightMap {
                image,
                pixel_m,
                start_x_m,
                ..
            } => (*start_x_m, pixel_m * (image.rows() - 1) as f64),
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

    /// Height of the first edge that a wheel meets \[m\]; 0 if it meets none at once.
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
            Self::HeightMap {
                black_height_m,
                white_height_m,
                ..
            } => {
                let (low, high) = (
                    black_height_m.min(*white_height_m).min(0.0),
                    black_height_m.max(*white_height_m).max(0.0),
                );
                high - low
            }
        }
    }

    /// A description for people, such as `over a step of 5.0 cm`.
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

    /// Checks across several keys: the key, and its error.
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
