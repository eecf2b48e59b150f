//! Motions in the plane over arrays: commands held for a period, and where they lead.

use omni_core::{BodyDisplacement, BodyTwist, PlanarPose};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Array, Rows, array};
use crate::error::refused;

/// Twists that, held for a period, end where a straight line along the twists given would.
///
/// A vehicle that turns while it moves drifts off the line that it was told to follow; commands held for a period are
/// straightened by this.
///
/// Args:
///     twists: body twists (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3).
///     dt_s: the period [s], above 0. The turn within it should stay below one revolution.
///
/// Returns:
///     Body twists in the shape of ``twists``; wz is kept.
///
/// Raises:
///     ConfigError: a shape is wrong or a number is not finite.
///     TypeError: not numbers.
///
/// Example:
///     >>> import math, omnistep
///     >>> held = omnistep.discretize([1.0, 0.0, math.pi], dt_s=0.5)  # a quarter of a turn while going straight ahead
///     >>> end = omnistep.moved_by([0.0, 0.0, 0.0], 0.5 * held)
///     >>> end.round(9).tolist()
///     [0.5, 0.0, 1.570796327]
#[pyfunction]
#[pyo3(signature = (twists, *, dt_s))]
pub(crate) fn discretize<'py>(twists: &Bound<'py, PyAny>, dt_s: f64) -> PyResult<Array<'py, f64>> {
    if !(dt_s.is_finite() && dt_s > 0.0) {
        return Err(refused(
            "dt_s",
            &format!("dt_s = {dt_s}, allowed: finite and > 0"),
        ));
    }
    let rows = Rows::read("twists", twists, 3)?;
    let (each, _) = rows.values.as_chunks();
    let values = each
        .iter()
        .flat_map(|&twist| BodyTwist::from_array(twist).discretize(dt_s).to_array());
    array(twists.py(), rows.shape(3), values.collect())
}

/// Poses after displacements, exact for twists that stayed constant: the vehicle moves along an arc.
///
/// Args:
///     poses: poses in the world (x [m], y [m], yaw [rad]), (3,) or (T, 3).
///     displacements: twists times the time they were held (forward [m], left [m], turn [rad]), in the shape of
///         ``poses``.
///
/// Returns:
///     Poses in the shape of ``poses``; the yaw is added up, not wrapped.
///
/// Raises:
///     ConfigError: a shape is wrong or a number is not finite.
///     TypeError: not numbers.
///
/// Example:
///     >>> import math, omnistep
///     >>> omnistep.moved_by([0.0, 0.0, math.pi / 2], [1.0, 0.0, 0.0]).round(9).tolist()  # facing left
///     [0.0, 1.0, 1.570796327]
#[pyfunction]
#[pyo3(signature = (poses, displacements, /))]
pub(crate) fn moved_by<'py>(
    poses: &Bound<'py, PyAny>,
    displacements: &Bound<'py, PyAny>,
) -> PyResult<Array<'py, f64>> {
    let py = poses.py();
    let from = Rows::read("poses", poses, 3)?;
    let by = Rows::read("displacements", displacements, 3)?;
    let (shape, expected) = (by.shape(3), from.shape(3));
    if shape != expected {
        let (found, allowed) = (PyTuple::new(py, shape)?, PyTuple::new(py, expected)?);
        let message = format!("displacements = an array of shape {found}, allowed: that of poses, {allowed}");
        return Err(refused("displacements", &message));
    }
    let (poses_read, _) = from.values.as_chunks();
    let (displacements_read, _) = by.values.as_chunks();
    let values = poses_read
        .iter()
        .zip(displacements_read)
        .flat_map(|(&pose, &displacement)| {
            let [x_m, y_m, yaw_rad] = pose;
            let end = PlanarPose { x_m, y_m, yaw_rad }.moved_by(&BodyDisplacement::from_array(displacement));
            [end.x_m, end.y_m, end.yaw_rad]
        });
    array(py, shape, values.collect())
}
