//! How far wheels lag, slip and leave their common motion, over arrays: eqs. (14) and (15) of the paper, and more.

use omni_core::metrics;
use omni_sim::config::for_wheel_count;
use pyo3::prelude::*;

use crate::arrays::{Array, Rows, array, each_row, floats, positive, together};
use crate::wheel_count;
use crate::wheel_rows::{every, wheels};

// Python shows a signature's numbers, not constants: these are those of the control library.
const _: () = assert!(metrics::DISTURBED_FLOOR_RAD_S == 0.1 && metrics::SLIP_FLOOR_M_S == 0.01);

type Ratio = fn(f64, f64, f64) -> f64;

/// A ratio of two arrays of one shape, or of an array and a number.
fn ratio<'py>(
    [(first_name, first), (second_name, second)]: [(&str, &Bound<'py, PyAny>); 2],
    (floor_name, floor): (&str, f64),
    literal: bool,
    [safe, printed]: [Ratio; 2],
) -> PyResult<Array<'py, f64>> {
    let floor = positive(floor_name, floor)?;
    let py = first.py();
    let (a, a_shape) = floats(first_name, first)?;
    let (b, b_shape) = floats(second_name, second)?;
    let (one, other) = (a_shape.first().copied(), b_shape.first().copied());
    let rows = together("number", (first_name, one), (second_name, other))?;
    let count = rows.unwrap_or(1);
    let of = if literal { printed } else { safe };
    let pick = |values: &[f64], i: usize| values[i.min(values.len() - 1)];
    let mut values = Vec::with_capacity(count);
    each_row(py, count, |i| values.push(of(pick(&a, i), pick(&b, i), floor)))?;
    array(py, rows.into_iter().collect(), values)
}

/// Relative speed error of wheels: eq. (14) of the paper, in a form that is defined at rest.
///
/// ``(reference - velocity) / max(|reference|, |velocity|, floor)``, with the sign inverted if the reference is below 0
/// (the velocity, if the reference is 0): positive if the wheel lags, forwards and backwards; within -2 to 2.
///
/// Args:
///     reference_rad_s: reference [rad/s], a number or (T,).
///     velocity_rad_s: measured velocity [rad/s], likewise.
///     floor_rad_s: speed [rad/s] under which a difference counts as noise, above 0.
///     literal: eq. (14) as printed, over the velocity: infinite or not a number at rest.
///
/// Returns:
///     Ratios [-], () or (T,).
///
/// Raises:
///     ConfigError: the lengths differ, or the floor is not above 0.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.disturbed_ratio([10.0, -10.0, 0.0], [8.0, -8.0, 0.0]).tolist()
///     [0.2, 0.2, 0.0]
///     >>> omnistep.disturbed_ratio(10.0, 8.0, literal=True).item()
///     0.25
#[pyfunction]
#[pyo3(signature = (reference_rad_s, velocity_rad_s, *, floor_rad_s = 0.1, literal = false))]
pub(crate) fn disturbed_ratio<'py>(
    reference_rad_s: &Bound<'py, PyAny>,
    velocity_rad_s: &Bound<'py, PyAny>,
    floor_rad_s: f64,
    literal: bool,
) -> PyResult<Array<'py, f64>> {
    let printed: Ratio = |reference, velocity, _| metrics::disturbed_ratio_literal(reference, velocity);
    ratio(
        [
            ("reference_rad_s", reference_rad_s),
            ("velocity_rad_s", velocity_rad_s),
        ],
        ("floor_rad_s", floor_rad_s),
        literal,
        [metrics::disturbed_ratio, printed],
    )
}

/// How far wheels slip: eq. (15) of the paper, in a form that is defined at rest.
///
/// ``(rim - along) / max(|rim|, |along|, floor)``, with the other sign where the rim's speed is below 0
/// (``along``, where the rim's is 0): positive where the wheel spins faster than it moves, forwards and backwards;
/// within -2 to 2.
///
/// Args:
///     rim_m_s: radius times the wheel's velocity against the world [m/s], a number or (T,).
///     along_m_s: velocity of the wheel's centre along the push [m/s], likewise.
///     floor_m_s: speed [m/s] under which a difference counts as noise, above 0.
///     literal: eq. (15) as printed, over the rim's speed: infinite or not a number at rest.
///
/// Returns:
///     Ratios [-], () or (T,).
///
/// Raises:
///     ConfigError: the lengths differ, or the floor is not above 0.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.slip_ratio([0.5, -0.5, 0.3], [0.375, -0.375, 0.0]).tolist()  # the last spins on the spot
///     [0.25, 0.25, 1.0]
#[pyfunction]
#[pyo3(signature = (rim_m_s, along_m_s, *, floor_m_s = 0.01, literal = false))]
pub(crate) fn slip_ratio<'py>(
    rim_m_s: &Bound<'py, PyAny>,
    along_m_s: &Bound<'py, PyAny>,
    floor_m_s: f64,
    literal: bool,
) -> PyResult<Array<'py, f64>> {
    let printed: Ratio = |rim, along, _| metrics::slip_ratio_literal(rim, along);
    ratio(
        [("rim_m_s", rim_m_s), ("along_m_s", along_m_s)],
        ("floor_m_s", floor_m_s),
        literal,
        [metrics::slip_ratio, printed],
    )
}

fn shape_errors<const N: usize>(py: Python<'_>, rows: &[Rows]) -> PyResult<Vec<f64>> {
    every::<2, N, N>(py, rows, |[reference, velocity]| {
        metrics::shape_error(&reference, &velocity)
    })
}

/// The part of the wheels' velocities that no common factor on the references explains.
///
/// Args:
///     reference_rad_s: references [rad/s], (N,) or (T, N) of 3 to 8 wheels.
///     velocity_rad_s: measured velocities [rad/s], in that shape, or (N,).
///
/// Returns:
///     Velocities [rad/s] in the shape of the references; zero where all wheels slow down together.
///
/// Raises:
///     ConfigError: a shape is wrong or a number is not finite.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.shape_error([4.0, -4.0, 0.0], [3.0, -1.0, 0.0]).tolist()
///     [1.0, 1.0, 0.0]
#[pyfunction]
#[pyo3(signature = (reference_rad_s, velocity_rad_s, /))]
pub(crate) fn shape_error<'py>(
    reference_rad_s: &Bound<'py, PyAny>,
    velocity_rad_s: &Bound<'py, PyAny>,
) -> PyResult<Array<'py, f64>> {
    let given = [
        ("reference_rad_s", reference_rad_s),
        ("velocity_rad_s", velocity_rad_s),
    ];
    let (count, rows) = wheels(given)?;
    let py = reference_rad_s.py();
    let values = for_wheel_count!(count, shape_errors[](py, &rows), wheel_count::refuse)?;
    array(py, rows[0].shape(count), values)
}

fn speed_ratio_stds<const N: usize>(py: Python<'_>, rows: &[Rows], floor: f64) -> PyResult<Vec<f64>> {
    every::<2, N, 1>(py, rows, |[reference, velocity]| {
        [metrics::speed_ratio_std(&reference, &velocity, floor)]
    })
}

/// Standard deviation of velocity over reference, over the wheels that have a reference: 0 if they keep together.
///
/// Args:
///     reference_rad_s: references [rad/s], (N,) or (T, N) of 3 to 8 wheels.
///     velocity_rad_s: measured velocities [rad/s], in that shape, or (N,).
///     floor_rad_s: wheels with a smaller reference [rad/s] are ignored; above 0.
///
/// Returns:
///     Standard deviations [-], () or (T,).
///
/// Raises:
///     ConfigError: a shape is wrong, a number is not finite, or the floor is not above 0.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.speed_ratio_std([4.0, -4.0, 0.0], [4.0, -2.0, 0.3]).item()
///     0.25
#[pyfunction]
#[pyo3(signature = (reference_rad_s, velocity_rad_s, *, floor_rad_s = 0.1))]
pub(crate) fn speed_ratio_std<'py>(
    reference_rad_s: &Bound<'py, PyAny>,
    velocity_rad_s: &Bound<'py, PyAny>,
    floor_rad_s: f64,
) -> PyResult<Array<'py, f64>> {
    let floor = positive("floor_rad_s", floor_rad_s)?;
    let given = [
        ("reference_rad_s", reference_rad_s),
        ("velocity_rad_s", velocity_rad_s),
    ];
    let (count, rows) = wheels(given)?;
    let py = reference_rad_s.py();
    let values = for_wheel_count!(count, speed_ratio_stds[](py, &rows, floor), wheel_count::refuse)?;
    array(py, rows[0].shape_of_scalars(), values)
}
