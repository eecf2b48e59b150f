//! Motions in the plane over arrays: commands held for a period, and where they lead.

use omni_core::BodyTwist;
use omni_core::geometry::{BodyDisplacement, PlanarPose, WorldTwist};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Array, Rows, array, as_many_or_one, each_row, fixed, floats, positive};
use crate::error::refused;

/// Twists that, held for a period, reach the end of a straight line along the given twists.
///
/// A vehicle that turns while it moves drifts off the commanded line. This function corrects commands that are held for
/// a period.
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
    let dt_s = positive("dt_s", dt_s)?;
    let rows = Rows::read("twists", twists, 3)?;
    of_twists(twists.py(), &rows, |_, twist| twist.discretize(dt_s).to_array())
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
        let message =
            format!("displacements = an array of shape {found}, allowed: the shape of poses, {allowed}");
        return Err(refused("displacements", &message));
    }
    let (poses_read, _) = from.values.as_chunks();
    let (displacements_read, _) = by.values.as_chunks();
    let mut values = Vec::with_capacity(from.values.len());
    each_row(py, from.len(), |i| {
        let [x_m, y_m, yaw_rad] = poses_read[i];
        let displacement = BodyDisplacement::from_array(displacements_read[i]);
        let end = PlanarPose { x_m, y_m, yaw_rad }.moved_by(&displacement);
        values.extend([end.x_m, end.y_m, end.yaw_rad]);
    })?;
    array(py, shape, values)
}

/// Every twist through `map`, which gets its row.
fn of_twists<'py>(
    py: Python<'py>,
    rows: &Rows,
    map: impl Fn(usize, BodyTwist<f64>) -> [f64; 3] + Sync,
) -> PyResult<Array<'py, f64>> {
    let (each, _) = rows.values.as_chunks();
    let mut values = Vec::with_capacity(rows.values.len());
    each_row(py, rows.len(), |i| {
        values.extend(map(i, BodyTwist::from_array(each[i])));
    })?;
    array(py, rows.shape(3), values)
}

/// Twists of a point of the body: its velocity along the body's axes, and the yaw rate.
///
/// Args:
///     twists: body twists of the origin (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3).
///     point_m: the point (x forward, y left) from the origin [m], (2,).
///
/// Returns:
///     Twists in the shape of ``twists``.
///
/// Raises:
///     ConfigError: a shape is wrong or a number is not finite.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.at_point([0.1, 0.0, 2.0], [0.5, 0.0]).tolist()  # half a metre ahead: swings to the left
///     [0.1, 1.0, 2.0]
#[pyfunction]
#[pyo3(signature = (twists, point_m, /))]
pub(crate) fn at_point<'py>(
    twists: &Bound<'py, PyAny>,
    point_m: &Bound<'py, PyAny>,
) -> PyResult<Array<'py, f64>> {
    let point = place(point_m)?;
    let rows = Rows::read("twists", twists, 3)?;
    of_twists(twists.py(), &rows, |_, twist| twist.at_point(point).to_array())
}

/// Twists of the origin from the twists of a point of the body: commands for another centre of rotation.
///
/// Undoes :func:`at_point`.
///
/// Args:
///     twists: twists of the point, along the body's axes (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3).
///     point_m: the point (x forward, y left) from the origin [m], (2,).
///
/// Returns:
///     Body twists in the shape of ``twists``.
///
/// Raises:
///     ConfigError: a shape is wrong or a number is not finite.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.from_point([0.0, 0.0, 2.0], [0.5, 0.0]).tolist()  # turn about a point ahead, which stands still
///     [0.0, -1.0, 2.0]
#[pyfunction]
#[pyo3(signature = (twists, point_m, /))]
pub(crate) fn from_point<'py>(
    twists: &Bound<'py, PyAny>,
    point_m: &Bound<'py, PyAny>,
) -> PyResult<Array<'py, f64>> {
    let point = place(point_m)?;
    let rows = Rows::read("twists", twists, 3)?;
    of_twists(twists.py(), &rows, |_, twist| {
        BodyTwist::from_point(twist, point).to_array()
    })
}

/// A point of the body.
fn place(point_m: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    let point: [f64; 2] = fixed("point_m", point_m, "two numbers: x and y")?;
    match point.iter().find(|part| !part.is_finite()) {
        Some(part) => Err(refused(
            "point_m",
            &format!("point_m = {part}, allowed: finite numbers"),
        )),
        None => Ok(point),
    }
}

/// A yaw for every twist.
fn yaws(twists: &Rows, yaw_rad: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let count = twists.len();
    let (yaws, _) = floats("yaw_rad", yaw_rad)?;
    if let Some(yaw) = yaws.iter().find(|yaw| !yaw.is_finite()) {
        return Err(refused(
            "yaw_rad",
            &format!("yaw_rad = {yaw}, allowed: finite numbers"),
        ));
    }
    match yaws.len() {
        1 => Ok(vec![yaws[0]; count]),
        found if found == count => Ok(yaws),
        found => Err(as_many_or_one(("yaw_rad", found), "number", ("twists", count))),
    }
}

/// Body twists along the world's axes, for a vehicle with this yaw: field-oriented from robot-oriented.
///
/// Args:
///     twists: body twists (vx [m/s] forward, vy [m/s] left, wz [rad/s]), (3,) or (T, 3).
///     yaw_rad: heading [rad], counter-clockwise from the world's x, a number or (T,).
///
/// Returns:
///     Twists (vx along the world's x, vy along its y, wz) in the shape of ``twists``.
///
/// Raises:
///     ConfigError: a shape is wrong or a number is not finite.
///     TypeError: not numbers.
///
/// Example:
///     >>> import math, omnistep
///     >>> omnistep.to_world([0.3, 0.1, 0.5], math.pi / 2).round(9).tolist()  # facing left
///     [-0.1, 0.3, 0.5]
#[pyfunction]
#[pyo3(signature = (twists, yaw_rad, /))]
pub(crate) fn to_world<'py>(
    twists: &Bound<'py, PyAny>,
    yaw_rad: &Bound<'py, PyAny>,
) -> PyResult<Array<'py, f64>> {
    let rows = Rows::read("twists", twists, 3)?;
    let yaws = yaws(&rows, yaw_rad)?;
    of_twists(twists.py(), &rows, |i, twist| {
        let there = twist.to_world(&facing(yaws[i]));
        [there.vx_m_s, there.vy_m_s, there.wz_rad_s]
    })
}

/// Twists along the world's axes as body twists: commands for a vehicle with this yaw.
///
/// Undoes :func:`to_world`.
///
/// Args:
///     twists: twists (vx [m/s] along the world's x, vy [m/s] along its y, wz [rad/s]), (3,) or (T, 3).
///     yaw_rad: heading [rad], counter-clockwise from the world's x, a number or (T,).
///
/// Returns:
///     Body twists in the shape of ``twists``.
///
/// Raises:
///     ConfigError: a shape is wrong or a number is not finite.
///     TypeError: not numbers.
///
/// Example:
///     >>> import math, omnistep
///     >>> omnistep.to_body([0.0, 0.3, 0.0], math.pi / 2).round(9).tolist()  # along the world's y, facing there
///     [0.3, 0.0, 0.0]
#[pyfunction]
#[pyo3(signature = (twists, yaw_rad, /))]
pub(crate) fn to_body<'py>(
    twists: &Bound<'py, PyAny>,
    yaw_rad: &Bound<'py, PyAny>,
) -> PyResult<Array<'py, f64>> {
    let rows = Rows::read("twists", twists, 3)?;
    let yaws = yaws(&rows, yaw_rad)?;
    of_twists(twists.py(), &rows, |i, twist| {
        let [vx_m_s, vy_m_s, wz_rad_s] = twist.to_array();
        let there = WorldTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        };
        there.to_body(&facing(yaws[i])).to_array()
    })
}

fn facing(yaw_rad: f64) -> PlanarPose<f64> {
    PlanarPose {
        yaw_rad,
        ..PlanarPose::origin()
    }
}
