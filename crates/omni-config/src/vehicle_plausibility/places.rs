//! Centres of mass, boxes and clearances that are doubtful.

use crate::digits::digits;
use crate::{Body, Vehicle};

/// A centre of mass as high as this multiple of the distance between the wheels furthest apart is doubtful: mm mistaken
/// for m.
const HIGH: f64 = 3.0;
/// A box whose longest edge exceeds this multiple of that distance is doubtful: cm mistaken for m.
const LARGE: f64 = 5.0;
/// A box whose longest edge is below this fraction of that distance is doubtful: mm mistaken for cm, or wheel positions
/// in another unit.
const SMALL: f64 = 0.05;

impl Vehicle {
    /// Bodies that are not where a body with wheels on the ground is, and those of another size.
    pub(super) fn misplaced(&self) -> Vec<String> {
        let places = || self.wheel.iter().map(|wheel| wheel.position_m);
        let apart = |[ax, ay]: [f64; 2]| places().map(move |[bx, by]| libm::hypot(ax - bx, ay - by));
        let span_m = places().flat_map(apart).fold(0.0, f64::max);
        let [_, _, z] = self.centre_of_mass_m();
        if z > HIGH * span_m {
            let (z, span) = (digits(z), digits(span_m));
            return vec![format!(
                "com_m: the centre of mass is {z} m up, the wheels are {span} m apart; write com_m in metres"
            )];
        }
        let bodies = self.body.iter();
        bodies
            .filter_map(|body| Some(format!("body {}: {}", body.name, misplaced(body, span_m)?)))
            .collect()
    }
}

/// What is doubtful of a body's size or place where its wheels are so far apart.
fn misplaced(body: &Body, span_m: f64) -> Option<String> {
    let ([_, _, z], span) = (body.com_m, digits(span_m));
    let longest_m = body.inertia_box_m.into_iter().fold(0.0, f64::max);
    if z <= 0.0 {
        return Some(format!(
            "com_m has the height {z}, allowed: above 0, which is on the ground; the origin of all heights is the ground, not the axles"
        ));
    }
    if !(SMALL * span_m..=LARGE * span_m).contains(&longest_m) {
        return Some(format!(
            "inertia_box_m = {:?}, but the wheels are {span} m apart; write inertia_box_m and position_m in metres",
            body.inertia_box_m
        ));
    }
    let face_m = z - body.inertia_box_m[2] / 2.0;
    if face_m > span_m {
        return Some(format!(
            "com_m has the height {z}, and inertia_box_m the edge {}: the box begins {} m above the ground, and the wheels are {span} m apart; \
             check both",
            body.inertia_box_m[2],
            digits(face_m)
        ));
    }
    // A box that reaches into the ground has the body's inertia, but not its shape: then only the
    // centre of mass is above the lowest point.
    let most_m = if face_m > 0.0 {
        z - body.inertia_box_m[2] / 4.0
    } else {
        z
    };
    body.clearance_m.filter(|clearance_m| *clearance_m > most_m).map(|clearance_m| {
        format!(
            "clearance_m = {clearance_m}, but its centre of mass is {z} m up and its box begins at {} m; usual: up to {}",
            digits(face_m.max(0.0)),
            digits(most_m)
        )
    })
}
