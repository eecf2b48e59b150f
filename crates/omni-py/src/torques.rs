//! Torques within limits, over arrays: eqs. (11) to (13) of the paper.

use omni_core::motor::TorqueRanges;
use omni_core::{TorqueLimit, loops};
use omni_sim::config::for_wheel_count;
use pyo3::prelude::*;

use crate::arrays::{Array, Rows, array, floats};
use crate::error::{of_core, refused};
use crate::wheel_count;
use crate::wheel_rows::{every, wheels};

fn ranges<const N: usize>(lower_n_m: [f64; N], upper_n_m: [f64; N]) -> TorqueRanges<f64, N> {
    TorqueRanges { lower_n_m, upper_n_m }
}

fn factors<const N: usize>(py: Python<'_>, rows: &[Rows]) -> PyResult<Vec<f64>> {
    every::<3, N, 1>(py, rows, |[requested, lower, upper]| {
        let factor = loops::torque_factor(&requested, &ranges(lower, upper));
        [factor]
    })
}

/// The common factor of eqs. (11) and (12) of the paper: the largest that brings every torque within its limits.
///
/// Args:
///     requested_n_m: requested torques [N.m], (N,) or (T, N) of 3 to 8 wheels.
///     lower_n_m: lowest torques [N.m], each 0 or less, in that shape, or (N,).
///     upper_n_m: highest torques [N.m], each 0 or more, in that shape, or (N,).
///
/// Returns:
///     Factors, 0 to 1, () or (T,).
///
/// Raises:
///     ConfigError: a shape is wrong, a number is not finite, or a range lacks 0.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> limits = {"lower_n_m": [-0.2, -0.2, -0.2], "upper_n_m": [0.2, 0.2, 0.2]}
///     >>> omnistep.torque_factor([0.1, -0.4, 0.2], **limits).item()
///     0.5
#[pyfunction]
#[pyo3(signature = (requested_n_m, *, lower_n_m, upper_n_m))]
pub(crate) fn torque_factor<'py>(
    requested_n_m: &Bound<'py, PyAny>,
    lower_n_m: &Bound<'py, PyAny>,
    upper_n_m: &Bound<'py, PyAny>,
) -> PyResult<Array<'py, f64>> {
    let (count, rows) = wheels([
        ("requested_n_m", requested_n_m),
        ("lower_n_m", lower_n_m),
        ("upper_n_m", upper_n_m),
    ])?;
    about_zero(&rows[1], &rows[2])?;
    let py = requested_n_m.py();
    let values = for_wheel_count!(count, factors[](py, &rows), wheel_count::refuse)?;
    array(py, rows[0].shape_of_scalars(), values)
}

/// Zero is within every range.
fn about_zero(lower: &Rows, upper: &Rows) -> PyResult<()> {
    let bad = |name: &str, value: f64, allowed: &str| {
        Err(refused(name, &format!("{name} = {value}, allowed: {allowed}")))
    };
    if let Some(value) = lower.values.iter().find(|value| **value > 0.0) {
        return bad("lower_n_m", *value, "0 or less");
    }
    match upper.values.iter().find(|value| **value < 0.0) {
        Some(value) => bad("upper_n_m", *value, "0 or more"),
        None => Ok(()),
    }
}

fn references<const N: usize>(py: Python<'_>, rows: &[Rows], floor: f64) -> PyResult<Vec<f64>> {
    every::<4, N, 1>(py, rows, |[requested, slopes, lower, upper]| {
        let ranges = ranges(lower, upper);
        let factor = loops::reference_factor(&requested, &slopes, &ranges, floor);
        [factor]
    })
}

/// The common factor on the references of ``scale_references``: the largest with which no torque meets its limit.
///
/// Args:
///     requested_n_m: torques for the whole references [N.m], (N,) or (T, N) of 3 to 8 wheels.
///     slopes_n_m: the part of these that is proportional to the reference [N.m], in that shape, or (N,).
///     lower_n_m: lowest torques [N.m], each 0 or less, in that shape, or (N,).
///     upper_n_m: highest torques [N.m], each 0 or more, in that shape, or (N,).
///     floor: the smallest factor, 0 to 1.
///
/// Returns:
///     Factors, ``floor`` to 1, () or (T,).
///
/// Raises:
///     ConfigError: a shape is wrong, a number is not finite, a range lacks 0, or the floor is out of range.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> limits = {"lower_n_m": [-1.0, -1.0, -1.0], "upper_n_m": [1.0, 1.0, 1.0]}
///     >>> omnistep.reference_factor([2.5, -0.2, 0.0], [3.0, -0.4, 0.0], **limits).item()
///     0.5
#[pyfunction]
#[pyo3(signature = (requested_n_m, slopes_n_m, *, lower_n_m, upper_n_m, floor = 0.0))]
pub(crate) fn reference_factor<'py>(
    requested_n_m: &Bound<'py, PyAny>,
    slopes_n_m: &Bound<'py, PyAny>,
    lower_n_m: &Bound<'py, PyAny>,
    upper_n_m: &Bound<'py, PyAny>,
    floor: f64,
) -> PyResult<Array<'py, f64>> {
    if !(0.0..=1.0).contains(&floor) {
        return Err(refused("floor", &format!("floor = {floor}, allowed: 0 to 1")));
    }
    let (count, rows) = wheels([
        ("requested_n_m", requested_n_m),
        ("slopes_n_m", slopes_n_m),
        ("lower_n_m", lower_n_m),
        ("upper_n_m", upper_n_m),
    ])?;
    about_zero(&rows[2], &rows[3])?;
    let py = requested_n_m.py();
    let values = for_wheel_count!(count, references[](py, &rows, floor), wheel_count::refuse)?;
    array(py, rows[0].shape_of_scalars(), values)
}

/// Torque range of a motor at a velocity, eq. (13) of the paper: a line that falls with the speed.
///
/// Args:
///     velocity_rad_s: velocity of the actuator [rad/s], a number or (T,).
///     stall_torque_n_m: torque at rest [N.m], above 0.
///     slope_n_m_s_rad: torque lost per speed [N.m per rad/s], 0 or more; 0 is a constant limit.
///
/// Returns:
///     Lowest (0 or less) and highest (0 or more) torque [N.m], each () or (T,).
///
/// Raises:
///     ConfigError: a torque or slope is out of range.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> lower, upper = omnistep.torque_range([0.0, 10.0], stall_torque_n_m=2.0, slope_n_m_s_rad=0.1)
///     >>> upper.tolist()
///     [2.0, 1.0]
#[pyfunction]
#[pyo3(signature = (velocity_rad_s, *, stall_torque_n_m, slope_n_m_s_rad = 0.0))]
pub(crate) fn torque_range<'py>(
    velocity_rad_s: &Bound<'py, PyAny>,
    stall_torque_n_m: f64,
    slope_n_m_s_rad: f64,
) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
    let limit = TorqueLimit::line(stall_torque_n_m, slope_n_m_s_rad)
        .map_err(|error| of_core(error.parameter, &error))?;
    let py = velocity_rad_s.py();
    let (velocities, shape) = floats("velocity_rad_s", velocity_rad_s)?;
    let each = velocities.iter().map(|velocity| limit.range(*velocity));
    let (lower, upper) = each.map(|range| (range.lower_n_m, range.upper_n_m)).unzip();
    Ok((array(py, shape.clone(), lower)?, array(py, shape, upper)?))
}
