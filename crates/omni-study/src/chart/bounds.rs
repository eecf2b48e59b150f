//! Upper bounds of a climb without a simulation: the clearance of the bodies, and the balance of forces.

use omni_bound::ClimbLimits;
use omni_config::{Body, Scenario, Vehicle, WheelSpec};

use super::Approach;
use super::edge::Edge;
use crate::Error;

/// A body may be so deep in the ground without having touched it \[m\], as a run's verdict has it.
const TOUCHES_M: f64 = 2e-3;
/// Wheels closer than that along the way are abreast \[m\], as in [`Vehicle::rows`].
const ABREAST_M: f64 = 0.02;
/// Heights are compared with the bodies in steps of this \[m\].
const GRID_M: f64 = 1e-4;

/// The greatest step up that the bodies clear where the edge is met squarely \[m\]; none if neither of the two rules
/// bounds it.
///
/// - *Overhang*: a body whose box extends further forward than the point at which every wheel meets the riser
///   (`sqrt(r^2 - (r - c)^2)` in front of its axle) clears its clearance c.
/// - *Straddling*: a single body on two rows of wheels, L apart, stands with the front row on a step of height h,
///   and the rear row at the riser. It is tilted by `asin(h / L)`. The edge, `d = sqrt(r^2 - (r - h)^2)` ahead of
///   the rear axle, is then at `x = d cos + (h - r) sin`, `z = r + (h - r) cos - d sin` in the vehicle's axes,
///   and z is at most the clearance. If the box begins further forward, the edge meets it there.
///
/// A body may be 2 mm in the ground, as in the verdict `touched`.
///
/// ```
/// use omni_config::Vehicle;
/// let mut mecanum4 = Vehicle::load("mecanum4")?;
/// let ahead = |vehicle: &Vehicle| omni_study::clearance_m(vehicle, 0.0).expect("one body on two rows");
/// assert!((ahead(&mecanum4) - 0.0609).abs() < 1e-4); // 50 mm, the tilt, and 2 mm
/// mecanum4.body[0].clearance_m = Some(0.02);
/// assert!((ahead(&mecanum4) - 0.0247).abs() < 1e-4);
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn clearance_m(vehicle: &Vehicle, side_deg: f64) -> Option<f64> {
    let way = Way::new(side_deg);
    let overhang = vehicle
        .body
        .iter()
        .filter_map(|body| way.overhang_m(vehicle, body));
    overhang.chain(way.straddling_m(vehicle)).reduce(f64::min)
}

/// A direction of travel in the vehicle's axes.
struct Way {
    ahead: [f64; 2],
}

impl Way {
    fn new(side_deg: f64) -> Self {
        let (sin, cos) = side_deg.to_radians().sin_cos();
        Self { ahead: [cos, sin] }
    }

    fn along(&self, place: [f64; 2]) -> f64 {
        self.ahead[0] * place[0] + self.ahead[1] * place[1]
    }

    /// From where to where a body's box reaches along the way \[m\].
    fn extent_m(&self, body: &Body) -> [f64; 2] {
        let middle = self.along([body.com_m[0], body.com_m[1]]);
        let [x, y] = [0, 1].map(|k| self.ahead[k].abs() * body.inertia_box_m[k] / 2.0);
        [middle - x - y, middle + x + y]
    }

    fn overhang_m(&self, vehicle: &Vehicle, body: &Body) -> Option<f64> {
        let clears_m = body.underside_m()? + TOUCHES_M;
        let meets = |wheel: &WheelSpec| self.along(wheel.position_m) + ahead_m(wheel.radius_m, clears_m);
        let first_m = vehicle.wheel.iter().map(meets).fold(f64::NEG_INFINITY, f64::max);
        (self.extent_m(body)[1] > first_m).then_some(clears_m)
    }

    fn straddling_m(&self, vehicle: &Vehicle) -> Option<f64> {
        let [body] = &*vehicle.body else { return None };
        let clears_m = body.underside_m()? + TOUCHES_M;
        let places: Vec<f64> = vehicle
            .wheel
            .iter()
            .map(|wheel| self.along(wheel.position_m))
            .collect();
        let rear_m = places.iter().copied().fold(f64::INFINITY, f64::min);
        let front_m = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let of_rows = |place: &f64| (place - rear_m).min(front_m - place) < ABREAST_M;
        let radius_m = vehicle
            .wheel
            .iter()
            .map(|wheel| wheel.radius_m)
            .fold(0.0, f64::max);
        if front_m - rear_m < ABREAST_M || !places.iter().all(of_rows) {
            return None;
        }
        let [begins_m, ends_m] = self.extent_m(body).map(|at| at - rear_m);
        let span_m = front_m - rear_m;
        for step in 1..(span_m / GRID_M) as u32 {
            let height_m = GRID_M * f64::from(step);
            let sin = height_m / span_m;
            let cos = (1.0 - sin * sin).sqrt();
            let below_m = height_m - radius_m;
            // Further forward, the edge is lower under the body.
            let begins = (begins_m - below_m * sin) / cos;
            let ahead = ahead_m(radius_m, height_m).max(begins);
            let (x, z) = (
                ahead * cos + below_m * sin,
                radius_m + below_m * cos - ahead * sin,
            );
            if z > clears_m && x <= ends_m && ahead < span_m * cos {
                return Some(height_m - GRID_M);
            }
        }
        None
    }
}

/// How far ahead of its axle a wheel meets a riser of a height \[m\]; of one above its axle with its rim.
fn ahead_m(radius_m: f64, height_m: f64) -> f64 {
    let above_m = (radius_m - height_m).max(0.0);
    (radius_m * radius_m - above_m * above_m).sqrt()
}

/// The greatest step that the balance of forces does not exclude, of those every millimetre up to `largest_mm` \[mm\].
/// None if it excludes none of them, does not describe the vehicle or the approach, or the policy runs up by itself.
pub(super) fn climb_limits_mm(
    scenario: impl Fn(u32) -> Result<Scenario, Error>,
    approach: &Approach,
    largest_mm: u32,
) -> Result<Option<u32>, Error> {
    if approach.edge != Edge::Step || approach.side_deg != 0.0 || approach.skew_deg != 0.0 {
        return Ok(None);
    }
    for height_mm in 1..=largest_mm {
        let scenario = scenario(height_mm)?;
        if scenario.has_traction() {
            return Ok(None);
        }
        match ClimbLimits::of(&scenario) {
            Ok(limits) if limits.possible() => {}
            Ok(_) => return Ok(Some(height_mm - 1)),
            // Above the axle, or another vehicle than those that it describes: it says nothing.
            Err(_) => return Ok(None),
        }
    }
    Ok(None)
}
