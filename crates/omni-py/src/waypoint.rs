//! Places of a path, as Python names them.

use omni_core::path::WayShape;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{choice, fixed};
use crate::error::{about, refused};
use crate::values::{Pickled, rebuilt};

/// A waypoint of a path with optional constraints. Its numbers are checked when a path is planned.
///
/// Args:
///     x_m: world x [m], -10000 to 10000.
///     y_m: world y [m], -10000 to 10000.
///     kind: shape of the path from the previous waypoint: ``line``, ``arc`` (with ``sweep_rad``), or ``spline``,
///         smooth through this waypoint and its neighbours. On a line from a waypoint at the same position the vehicle
///         turns on the spot to the heading, or waits for the time.
///     sweep_rad: turn of the direction of travel on an arc [rad]: left is +, 0.01 to 6.2 or as much to the right.
///     heading_rad: heading at this waypoint [rad], reached by the shorter turn; if left out, the turn continues to the
///         next waypoint with a heading. The default of the first waypoint is 0.
///     speed_m_s: highest speed on the segment to this waypoint [m/s], above 0 and up to 1000; only the planner's
///         limits apply if left out.
///     time_s: time of arrival [s] from the start, up to 100000; as early as the limits allow if left out.
///
/// Raises:
///     ConfigError: an unknown ``kind``, or ``sweep_rad`` without an arc or an arc without it.
///     TypeError: an argument is not a number.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.Waypoint(1.0, 1.0, kind="arc", sweep_rad=1.57).kind
///     'arc'
#[pyclass(frozen, eq, from_py_object, module = "omnistep")]
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Waypoint {
    inner: omni_core::path::Waypoint<f64>,
}

#[pymethods]
impl Waypoint {
    #[new]
    #[pyo3(signature = (
        x_m, y_m, *, kind = "line", sweep_rad = None, heading_rad = None, speed_m_s = None, time_s = None
    ))]
    fn new(
        x_m: f64,
        y_m: f64,
        kind: &str,
        sweep_rad: Option<f64>,
        heading_rad: Option<f64>,
        speed_m_s: Option<f64>,
        time_s: Option<f64>,
    ) -> PyResult<Self> {
        let arc = WayShape::Arc {
            sweep_rad: sweep_rad.unwrap_or_default(),
        };
        let shape = choice(
            "kind",
            kind,
            &[
                ("line", WayShape::Line),
                ("arc", arc),
                ("spline", WayShape::Spline),
            ],
        )?;
        if sweep_rad.is_some() != (kind == "arc") {
            let is = if sweep_rad.is_some() { "given" } else { "not given" };
            let message = format!(
                "sweep_rad {is} with kind = {kind:?}, allowed: only with \"arc\", where it is required"
            );
            return Err(refused("sweep_rad", &message));
        }
        let mut inner = omni_core::path::Waypoint::at(x_m, y_m);
        (inner.shape, inner.heading_rad, inner.speed_m_s, inner.time_s) =
            (shape, heading_rad, speed_m_s, time_s);
        Ok(Self { inner })
    }

    /// World x [m].
    #[getter]
    fn x_m(&self) -> f64 {
        self.inner.x_m
    }

    /// World y [m].
    #[getter]
    fn y_m(&self) -> f64 {
        self.inner.y_m
    }

    /// Shape of the path from the previous waypoint: line, arc or spline.
    #[getter]
    fn kind(&self) -> &'static str {
        match self.inner.shape {
            WayShape::Arc { .. } => "arc",
            WayShape::Spline => "spline",
            _ => "line",
        }
    }

    /// Turn of the direction of travel on an arc [rad]; None for lines and splines.
    #[getter]
    fn sweep_rad(&self) -> Option<f64> {
        match self.inner.shape {
            WayShape::Arc { sweep_rad } => Some(sweep_rad),
            _ => None,
        }
    }

    /// Heading at this waypoint [rad].
    #[getter]
    fn heading_rad(&self) -> Option<f64> {
        self.inner.heading_rad
    }

    /// Highest speed on the segment to this waypoint [m/s].
    #[getter]
    fn speed_m_s(&self) -> Option<f64> {
        self.inner.speed_m_s
    }

    /// Time of arrival [s].
    #[getter]
    fn time_s(&self) -> Option<f64> {
        self.inner.time_s
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, Bound<'py, PyTuple>> {
        let keywords = PyDict::new(py);
        keywords.set_item("x_m", self.inner.x_m)?;
        keywords.set_item("y_m", self.inner.y_m)?;
        keywords.set_item("kind", self.kind())?;
        keywords.set_item("sweep_rad", self.sweep_rad())?;
        keywords.set_item("heading_rad", self.inner.heading_rad)?;
        keywords.set_item("speed_m_s", self.inner.speed_m_s)?;
        keywords.set_item("time_s", self.inner.time_s)?;
        rebuilt(&py.get_type::<Self>(), &keywords)
    }

    fn __repr__(&self) -> String {
        let mut text = format!("omnistep.Waypoint({}, {}", self.inner.x_m, self.inner.y_m);
        if self.kind() != "line" {
            text += &format!(", kind='{}'", self.kind());
        }
        for (name, value) in [
            ("sweep_rad", self.sweep_rad()),
            ("heading_rad", self.inner.heading_rad),
            ("speed_m_s", self.inner.speed_m_s),
            ("time_s", self.inner.time_s),
        ] {
            if let Some(value) = value {
                text += &format!(", {name}={value}");
            }
        }
        text + ")"
    }
}

/// Waypoints, or rows of x and y.
pub(crate) fn waypoints(given: &Bound<'_, PyAny>) -> PyResult<Vec<omni_core::path::Waypoint<f64>>> {
    const ALLOWED: &str = "waypoints, or pairs of x and y [m]";
    let py = given.py();
    let refuse = |_| PyTypeError::new_err(format!("waypoints: {}, allowed: {ALLOWED}", given.get_type()));
    let mut found = Vec::new();
    for (i, each) in given.try_iter().map_err(refuse)?.enumerate() {
        let each = each?;
        found.push(match each.cast::<Waypoint>() {
            Ok(waypoint) => waypoint.get().inner,
            Err(_) => {
                let pair = fixed::<2>("waypoints", &each, ALLOWED);
                let [x_m, y_m] = pair.map_err(|error| about(py, &format!("waypoint {i}"), error))?;
                omni_core::path::Waypoint::at(x_m, y_m)
            }
        });
        // No more than is allowed, and one: an endless iterator is rejected.
        if found.len() > 1000 {
            break;
        }
    }
    Ok(found)
}
