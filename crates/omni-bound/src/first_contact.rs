//! The least torques of a rigid vehicle's wheels at first contact with a step.

use omni_config::{Row, Vehicle};

use crate::{Error, Step};

/// Push of a wheel \[N per N at its rim\] below which it comes of the rounding of an angle.
const ROUNDING: f64 = 1e-9;

/// Torque that a row of wheels needs to lift off at the edge.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RowTouch {
    /// Names of its wheels, in the vehicle's order.
    pub wheels: Vec<String>,
    /// Least torque of each actuator \[N.m\], all of them equal; infinite if none lifts it.
    pub torque_n_m: f64,
}

/// The least torque with which each row of wheels of a rigid vehicle leaves the ground where it
/// touches a step, the front row first. `None` for a vehicle with hinges or another number of rows
/// than two, and if a wheel is no higher than the step.
///
/// Plane statics (docs/derivations.md): the row's load is held about the axle by its own actuators
/// and by the push of the other row, which friction limits; the push lowers the load of the front
/// row, because it acts below the edge. The friction of the wheels that climb is not asked for, nor
/// what comes after first touch, so it says what is too weak, not what suffices.
///
/// # Errors
/// As [`Vehicle::pushes_ahead`]; a loaded vehicle has been checked.
///
/// ```
/// use omni_bound::{Step, touch};
/// let mecanum4 = omni_config::Vehicle::load("mecanum4")?; // 24 kg on four wheels of 76 mm, half a metre apart
/// let rows = touch(&mecanum4, &Step::new(0.016, 0.7)?)?.expect("it is rigid, on two rows");
/// // The edge is 46.65 mm ahead of the axle. Rear: half the weight, more as the edge is nearer to the front wheels than the axle.
/// let ahead_m = (0.076_f64.powi(2) - 0.060_f64.powi(2)).sqrt();
/// let load_n = 24.0 * 9.81 * 0.25 / (0.5 - ahead_m);
/// assert!((rows[1].torque_n_m - load_n * ahead_m / (2.0 + 2.0 * 0.060 / 0.076)).abs() < 1e-9);
/// assert!((rows[0].torque_n_m - 1.39).abs() < 0.01 && (rows[1].torque_n_m - 1.69).abs() < 0.01);
/// # Ok::<(), omni_bound::Error>(())
/// ```
pub fn touch(vehicle: &Vehicle, step: &Step) -> Result<Option<Vec<RowTouch>>, Error> {
    let rows = vehicle.rows();
    let [front, rear] = rows.as_slice() else {
        return Ok(None);
    };
    if !vehicle.hinge.is_empty() {
        return Ok(None);
    }
    let pushes = vehicle.pushes_ahead()?;
    let weight_n = vehicle.mass_kg() * step.gravity_m_s2;
    let [centre_m, ..] = vehicle.centre_of_mass_m();
    let apart_m = front.x_m - rear.x_m;
    let touching = |row: &Row, other: &Row, is_front: bool| {
        let push = |row: &Row| row.wheels.iter().map(|wheel| pushes[*wheel]).sum::<f64>();
        let radius = row
            .wheels
            .iter()
            .map(|wheel| vehicle.wheel[*wheel].contact_radius_m());
        let radius = radius.fold(f64::INFINITY, f64::min);
        let down = radius - step.height_m;
        if down <= 0.0 {
            return None;
        }
        let ahead = (radius * radius - down * down).sqrt();
        // The load N of the edge is (weight * lever - push * drop) / span, about where the other
        // row stands; a rear row climbs while the front row stands as high as the edge.
        let (lever, span, drop) = if is_front {
            (centre_m - other.x_m, apart_m + ahead, step.height_m)
        } else {
            (other.x_m - centre_m, apart_m - ahead, 0.0)
        };
        // N forward = T own + P down, with P = T others or what friction holds of the other row's load. A transverse
        // wheel applies no push, except for the rounding of its angle.
        let own = push(row) * radius;
        let own = if own.abs() < ROUNDING { 0.0 } else { own };
        let others = push(other);
        let needed = weight_n * lever * ahead / span;
        let by_push = down + drop * ahead / span; // of a newton of push, about the axle
        let torque = needed / (own + others * by_push);
        let held = step.friction * (weight_n - (weight_n * lever - others * torque * drop) / span);
        let torque = if others * torque <= held {
            torque
        } else {
            let mu = step.friction;
            let load = weight_n * (lever - mu * drop) / (span - mu * drop);
            (load * ahead - mu * (weight_n - load) * down) / own
        };
        Some(RowTouch {
            wheels: row
                .wheels
                .iter()
                .map(|wheel| vehicle.wheel[*wheel].name.clone())
                .collect(),
            torque_n_m: if torque.is_finite() {
                torque.max(0.0)
            } else {
                f64::INFINITY
            },
        })
    };
    let front_touch = touching(front, rear, true);
    let rear_touch = touching(rear, front, false);
    Ok(front_touch.zip(rear_touch).map(|(front, rear)| vec![front, rear]))
}
