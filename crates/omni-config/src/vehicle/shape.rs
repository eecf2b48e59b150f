//! A shape that can be and can stand: wheels clear of each other, hinges near the vehicle, its weight over its wheels.

use super::Vehicle;
use crate::Error;
use crate::load::Source;
use crate::wheel_spec::WheelSpec;

/// A centre of mass this far beyond the wheels is rounding \[m\].
const ROUNDING_M: f64 = 1e-6;

impl Vehicle {
    pub(super) fn check_shape(&self, source: &Source) -> Result<(), Error> {
        self.check_wheels_apart(source)?;
        self.check_anchors(source)?;
        self.check_stands(source)
    }

    fn check_wheels_apart(&self, source: &Source) -> Result<(), Error> {
        for (j, b) in self.wheel.iter().enumerate() {
            for a in &self.wheel[..j] {
                if touch(a, b) || cross(a, b) {
                    let message = format!(
                        "{:?}, allowed: clear of other wheels: wheels {:?} and {:?} intersect",
                        b.position_m, a.name, b.name
                    );
                    return Err(source.refuse(format!("wheel[{j}].position_m"), message));
                }
            }
        }
        Ok(())
    }

    /// A hinge joins parts of the vehicle: its axis may lie beside them, but no farther than the vehicle is large.
    fn check_anchors(&self, source: &Source) -> Result<(), Error> {
        let mut low = [f64::INFINITY, f64::INFINITY, 0.0];
        let mut high = [f64::NEG_INFINITY; 3];
        let wheels = self.wheel.iter().map(|w| {
            let [x, y] = w.position_m;
            ([x, y, w.radius_m], [w.radius_m; 3])
        });
        let bodies = self
            .body
            .iter()
            .map(|b| (b.com_m, b.inertia_box_m.map(|edge| edge / 2.0)));
        for (centre, reach) in wheels.chain(bodies) {
            for axis in 0..3 {
                low[axis] = low[axis].min(centre[axis] - reach[axis]);
                high[axis] = high[axis].max(centre[axis] + reach[axis]);
            }
        }
        let size = (0..3)
            .map(|axis| (high[axis] - low[axis]).powi(2))
            .sum::<f64>()
            .sqrt();
        let inside = |hinge: &super::Hinge| {
            (0..3).all(|axis| {
                let at = hinge.anchor_m[axis];
                at >= low[axis] - size && at <= high[axis] + size
            })
        };
        match self.hinge.iter().position(|hinge| !inside(hinge)) {
            None => Ok(()),
            Some(i) => {
                let spans = (0..3).map(|k| format!("{:.2} to {:.2}", low[k] - size, high[k] + size));
                let message = format!(
                    "{:?}, allowed: {}, at most the vehicle's size away from it",
                    self.hinge[i].anchor_m,
                    spans.collect::<Vec<_>>().join("; ")
                );
                Err(source.refuse(format!("hinge[{i}].anchor_m"), message))
            }
        }
    }

    /// Whatever its hinges do, a vehicle at rest on flat ground needs its centre of mass over the
    /// wheels' polygon: no ground pulls. (Parts of it may still fall over.)
    fn check_stands(&self, source: &Source) -> Result<(), Error> {
        let [cx, cy, _] = self.centre_of_mass_m();
        let places = || self.wheel.iter().map(|w| w.position_m);
        for a in places() {
            for b in places() {
                let along = [b[0] - a[0], b[1] - a[1]];
                let length = libm::hypot(along[0], along[1]);
                if length < ROUNDING_M {
                    continue;
                }
                // To the right of the way from a to b, in metres.
                let beyond = |x: f64, y: f64| ((x - a[0]) * along[1] - (y - a[1]) * along[0]) / length;
                let edge = places().all(|p| beyond(p[0], p[1]) <= ROUNDING_M);
                if edge && beyond(cx, cy) > ROUNDING_M {
                    return Err(self.tips(source, [cx, cy], beyond));
                }
            }
        }
        Ok(())
    }

    /// Names the body whose weight tips the vehicle most over an edge.
    fn tips(&self, source: &Source, [cx, cy]: [f64; 2], beyond: impl Fn(f64, f64) -> f64) -> Error {
        let moment = |i: &usize| {
            let body = &self.body[*i];
            body.mass_kg * beyond(body.com_m[0], body.com_m[1])
        };
        let worst = (0..self.body.len()).max_by(|a, b| moment(a).total_cmp(&moment(b)));
        let worst = worst.unwrap_or(0);
        let span = |axis: usize| {
            let places = || self.wheel.iter().map(|w| w.position_m[axis]);
            let (low, high) = (
                places().fold(f64::INFINITY, f64::min),
                places().fold(f64::NEG_INFINITY, f64::max),
            );
            format!("{low:.3} to {high:.3}")
        };
        let message = format!(
            "{:?} puts the vehicle's centre of mass at ({cx:.3}, {cy:.3}), where it tips at rest, allowed: inside the \
             polygon of the wheels, within x {}, y {}",
            self.body[worst].com_m,
            span(0),
            span(1)
        );
        source.refuse(format!("body[{worst}].com_m"), message)
    }
}

/// Balls on the ground intersect nearer than twice the geometric mean of their radii.
fn touch(a: &WheelSpec, b: &WheelSpec) -> bool {
    let distance = libm::hypot(
        a.position_m[0] - b.position_m[0],
        a.position_m[1] - b.position_m[1],
    );
    distance < 2.0 * (a.contact_radius_m() * b.contact_radius_m()).sqrt()
}

/// Thin upright discs of the wheels' radii intersect: where their planes cross, both are at the same height.
fn cross(a: &WheelSpec, b: &WheelSpec) -> bool {
    let unit = |[x, y]: [f64; 2]| [x / libm::hypot(x, y), y / libm::hypot(x, y)];
    let (d, e) = (unit(a.rolling_direction), unit(b.rolling_direction));
    let gap = [
        b.position_m[0] - a.position_m[0],
        b.position_m[1] - a.position_m[1],
    ];
    let turn = d[0] * e[1] - d[1] * e[0];
    if turn.abs() < 1e-9 {
        let aside = gap[0] * d[1] - gap[1] * d[0];
        return aside.abs() < 1e-9 && libm::hypot(gap[0], gap[1]) < 2.0 * (a.radius_m * b.radius_m).sqrt();
    }
    let (s, t) = (
        (gap[0] * e[1] - gap[1] * e[0]) / turn,
        (gap[0] * d[1] - gap[1] * d[0]) / turn,
    );
    let heights = |radius: f64, off: f64| {
        let half = (radius * radius - off * off).sqrt(); // NaN beyond the rim: then no comparison holds
        (radius - half, radius + half)
    };
    let ((low_a, high_a), (low_b, high_b)) = (heights(a.radius_m, s), heights(b.radius_m, t));
    low_a < high_b && low_b < high_a
}
