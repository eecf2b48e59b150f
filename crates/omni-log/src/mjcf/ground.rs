//! The ground: a plane where it is level and endless, boxes, bars, fields of heights.

use std::io;

use omni_config::{Error, Scenario};
use omni_sim::ground::{Shape, shapes};

use super::contact::Contact;
use super::numbers::numbers;
use crate::xml::{Xml, comment, leaf};

const COLOUR: &str = "0.62 0.6 0.56 1";
const OTHER_FRICTION: &str = "0.55 0.7 0.8 1";
/// How far beyond the vehicle's way there is ground \[m\]: farther than it gets, and no farther
/// than digits of a contact last.
const MARGIN_M: f64 = 5.0;
/// Thickness of what is below a field of heights \[m\].
const BASE_M: f64 = 0.5;

/// A part of the ground.
pub(super) enum Part {
    Plane {
        height_m: f64,
    },
    Shape(Shape),
    /// A box with a friction of its own.
    Patch {
        half_m: [f64; 3],
        centre_m: [f64; 3],
        friction: f64,
    },
}

/// The ground of a scenario.
pub(super) fn parts(scenario: &Scenario) -> Result<Vec<Part>, Error> {
    let far = MARGIN_M + 2.0 * scenario.farthest_m();
    let all = shapes(scenario, far);
    if all.is_empty() {
        return Err(refuse(
            scenario,
            "terrain.kind",
            "unknown to this program, which is older than the file",
        ));
    }
    if !scenario.friction_patch.is_empty() {
        return patched(scenario, &all);
    }
    Ok(all
        .into_iter()
        .enumerate()
        .map(|(i, shape)| match shape {
            // The first one is below all others, and as far as there is ground.
            Shape::Box {
                half_m: [x, y, z],
                centre_m,
                ..
            } if i == 0 && x >= far && y >= far => Part::Plane {
                height_m: centre_m[2] + z,
            },
            shape => Part::Shape(shape),
        })
        .collect())
}

fn refuse(scenario: &Scenario, key: &str, message: &str) -> Error {
    Error::Key {
        file: format!("scenario {}", scenario.name),
        key: key.into(),
        message: message.into(),
    }
}

/// Level boxes cut along the borders of the patches of friction.
fn patched(scenario: &Scenario, all: &[Shape]) -> Result<Vec<Part>, Error> {
    let patches = &scenario.friction_patch;
    let mut changing = patches.iter().enumerate();
    if let Some((k, key)) = changing.find_map(|(k, patch)| Some((k, patch.changes_by()?))) {
        let message = "set, allowed in MJCF: only patches that never change";
        return Err(refuse(scenario, &format!("friction_patch[{k}].{key}"), message));
    }
    let mut parts = Vec::new();
    for shape in all {
        let Shape::Box {
            half_m,
            centre_m,
            turn_y_rad: 0.0,
        } = shape
        else {
            let message = "allowed in MJCF: only ground of level boxes (flat, step, step_down, stairs, half_step, ditch)";
            return Err(refuse(scenario, "friction_patch", message));
        };
        let cuts = |k: usize| {
            let (from, to) = (centre_m[k] - half_m[k], centre_m[k] + half_m[k]);
            let borders = patches
                .iter()
                .flat_map(|patch| if k == 0 { patch.x_m } else { patch.y_m });
            let mut cuts: Vec<f64> = borders
                .filter(|at| from < *at && *at < to)
                .chain([from, to])
                .collect();
            cuts.sort_by(f64::total_cmp);
            cuts.dedup();
            cuts
        };
        let (xs, ys) = (cuts(0), cuts(1));
        for x in xs.windows(2) {
            for y in ys.windows(2) {
                let middle = [f64::midpoint(x[0], x[1]), f64::midpoint(y[0], y[1])];
                let patch = patches
                    .iter()
                    .rev()
                    .find(|patch| patch.holds(middle[0], middle[1], 0.0));
                let half_m = [0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0]), half_m[2]];
                let centre_m = [middle[0], middle[1], centre_m[2]];
                parts.push(match patch {
                    Some(patch) => Part::Patch {
                        half_m,
                        centre_m,
                        friction: patch.friction,
                    },
                    None => Part::Shape(Shape::Box {
                        half_m,
                        centre_m,
                        turn_y_rad: 0.0,
                    }),
                });
            }
        }
    }
    Ok(parts)
}

/// Fields of heights, which are assets.
pub(super) fn assets(xml: &mut Xml, parts: &[Part]) -> io::Result<()> {
    for part in parts {
        let Part::Shape(Shape::Field {
            extent_m: [length, width],
            rows,
            columns,
            heights_m,
            ..
        }) = part
        else {
            continue;
        };
        let [low, high] = span(heights_m);
        // MuJoCo's rows go to the left and its columns ahead; as text the last row comes first.
        let turned = (0..*columns).flat_map(|j| (0..*rows).map(move |i| heights_m[i * columns + j] - low));
        let turned: Vec<f64> = turned.map(|height| (height * 1e9).round() * 1e-9).collect();
        let size = [0.5 * length, 0.5 * width, (high - low).max(1e-6), BASE_M];
        leaf(
            xml,
            "hfield",
            &[
                ("name", &"ground"),
                ("nrow", columns),
                ("ncol", rows),
                ("size", &numbers(&size)),
                ("elevation", &numbers(&turned)),
            ],
        )?;
    }
    Ok(())
}

fn span(heights_m: &[f64]) -> [f64; 2] {
    heights_m
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| {
            [low.min(*h), high.max(*h)]
        })
}

/// The ground itself; parts with a friction of their own are touched as `contact` has it.
pub(super) fn write(xml: &mut Xml, parts: &[Part], contact: &Contact) -> io::Result<()> {
    comment(
        xml,
        "Ground. The lowest part is a plane: MuJoCo computes contacts with planes by a formula and with boxes by a search.",
    )?;
    for (k, part) in parts.iter().enumerate() {
        match part {
            Part::Plane { height_m } => leaf(
                xml,
                "geom",
                &[
                    ("type", &"plane"),
                    ("pos", &numbers(&[0.0, 0.0, *height_m])),
                    ("size", &"0 0 1"),
                    ("rgba", &COLOUR),
                ],
            )?,
            Part::Patch {
                half_m,
                centre_m,
                friction,
            } => leaf(
                xml,
                "geom",
                &[
                    ("type", &"box"),
                    ("pos", &numbers(centre_m)),
                    ("size", &numbers(half_m)),
                    // The geom with priority determines the whole contact.
                    ("priority", &2),
                    ("condim", &3),
                    ("friction", &numbers(&[*friction, 0.0, 0.0])),
                    ("solref", &contact.words()[0]),
                    ("solimp", &contact.words()[1]),
                    ("name", &format!("friction_{k}")),
                    ("rgba", &OTHER_FRICTION),
                ],
            )?,
            Part::Shape(Shape::Box {
                half_m,
                centre_m,
                turn_y_rad,
            }) => leaf(
                xml,
                "geom",
                &[
                    ("type", &"box"),
                    ("pos", &numbers(centre_m)),
                    ("euler", &numbers(&[0.0, *turn_y_rad, 0.0])),
                    ("size", &numbers(half_m)),
                    ("rgba", &COLOUR),
                ],
            )?,
            Part::Shape(Shape::Bar {
                half_length_m,
                radius_m,
                centre_m,
            }) => leaf(
                xml,
                "geom",
                &[
                    ("type", &"cylinder"),
                    ("pos", &numbers(centre_m)),
                    ("zaxis", &"0 1 0"),
                    ("size", &numbers(&[*radius_m, *half_length_m])),
                    ("rgba", &COLOUR),
                ],
            )?,
            Part::Shape(Shape::Field {
                from_m,
                extent_m,
                heights_m,
                ..
            }) => leaf(
                xml,
                "geom",
                &[
                    ("type", &"hfield"),
                    ("hfield", &"ground"),
                    (
                        "pos",
                        &numbers(&[from_m + 0.5 * extent_m[0], 0.0, span(heights_m)[0]]),
                    ),
                    ("rgba", &COLOUR),
                ],
            )?,
        }
    }
    Ok(())
}
