//! The linear maps of a layout over arrays of twists and of wheel velocities.

use numpy::PyArrayDyn;
use omni_core::estimate::EstimatorConfig;
use omni_core::geometry::{Desaturation, ForwardMap};
use omni_sim::config::for_wheel_count;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{Array, Rows, array, choice, numbers};
use crate::error::refused;
use crate::estimate::Estimate;
use crate::layout::Layout;
use crate::maps::{Maps, Reduced, named, weighted};
use crate::plan::{Limits, Plan};
use crate::track::Track;
use crate::values::{Pickled, rebuilt};
use crate::wheel_count;

/// Body twist to actuator velocities and back, for one twist or T of them; float64 throughout.
///
/// Twists are (vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise). Arguments are not changed, and every
/// returned array is new.
///
/// Args:
///     layout: the wheels.
///     forward: method that estimates the twist from more wheels than degrees of freedom: the twist with the smallest
///         sum of squared wheel errors, or the average over the wheels, eq. (7) of the paper.
///     weights: least squares by the sum of weight times squared error, (N,), each 0 to 1000000: the inverse variance
///         of each wheel's measurement. A wheel of weight 0 is ignored.
///
/// Raises:
///     ConfigError: an unknown ``forward``, an average that does not undo the inverse map of this layout, or weights
///         that are out of range, too few, or leave less than three motions.
///     TypeError: weights are not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.6, track_m=0.4, radius_m=0.1)
///     >>> omnistep.Kinematics(layout=layout).inverse([1.0, 0.0, 2.0]).round(9).tolist()
///     [0.0, 20.0, 0.0, 20.0]
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Kinematics {
    /// The wheels.
    layout: Py<Layout>,
    wheels: usize,
    forward: String,
    weights: Option<Vec<f64>>,
    maps: Box<dyn Maps>,
}

impl Kinematics {
    pub(crate) fn wheel_count(&self) -> usize {
        self.wheels
    }

    pub(crate) fn track(&self, period_s: f64) -> PyResult<Box<dyn Track>> {
        self.maps.track(period_s)
    }

    pub(crate) fn estimate(&self, config: EstimatorConfig<f64>) -> PyResult<Box<dyn Estimate>> {
        self.maps.estimate(config)
    }

    pub(crate) fn planner(&self, limits: &Limits) -> PyResult<Box<dyn Plan>> {
        self.maps.planner(limits)
    }
}

impl Kinematics {
    /// A limit for every wheel.
    fn speed_limits(&self, limits_rad_s: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        // What has a length is a list or an array; what has none is one number for all.
        if limits_rad_s.len().is_err()
            && let Ok(limit) = limits_rad_s.extract::<f64>()
        {
            return Ok(vec![limit; self.wheels]);
        }
        numbers("limits_rad_s", limits_rad_s, "a number, or one for each wheel")
    }

    fn reduced(&self, py: Python<'_>, rows: &Rows, reduced: Reduced) -> PyResult<Desaturated> {
        let scalar = rows.shape_of_scalars();
        Ok(Desaturated {
            twist: array(py, rows.shape(3), reduced.twist)?.unbind(),
            velocities: array(py, rows.shape(self.wheels), reduced.velocities)?.unbind(),
            translation_factor: array(py, scalar.clone(), reduced.translation_factor)?.unbind(),
            yaw_factor: array(py, scalar.clone(), reduced.yaw_factor)?.unbind(),
            limiting: array(py, scalar, reduced.limiting)?.unbind(),
        })
    }
}

#[pymethods]
impl Kinematics {
    #[new]
    #[pyo3(signature = (*, layout, forward = "least_squares", weights = None))]
    fn new(layout: &Bound<'_, PyAny>, forward: &str, weights: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let layout = layout.cast::<Layout>().map_err(|_| {
            let found = layout.get_type();
            PyTypeError::new_err(format!("layout: {found}, allowed: an omnistep.Layout"))
        })?;
        let known = [
            ("least_squares", ForwardMap::LeastSquares),
            ("paper_average", ForwardMap::PaperAverage),
        ];
        let map = choice("forward", forward, &known)?;
        let built = layout.get();
        let weights = weights.map(|weights| numbers("weights", weights, "one number for each wheel"));
        let weights = weights.transpose()?;
        let maps = match (&weights, map) {
            (None, _) => for_wheel_count!(built.len(), named[](built, map), wheel_count::refuse)?,
            (Some(weights), ForwardMap::LeastSquares) => {
                for_wheel_count!(built.len(), weighted[](built, weights), wheel_count::refuse)?
            }
            (Some(_), _) => {
                let message =
                    format!("weights given with forward = {forward:?}, allowed: only with \"least_squares\"");
                return Err(refused("weights", &message));
            }
        };
        Ok(Self {
            wheels: built.len(),
            layout: layout.clone().unbind(),
            forward: forward.into(),
            weights,
            maps,
        })
    }

    /// The wheels.
    #[getter]
    pub(crate) fn layout(&self, py: Python<'_>) -> Py<Layout> {
        self.layout.clone_ref(py)
    }

    /// Actuator velocities that move the vehicle with the twists.
    ///
    /// Args:
    ///     twists: (3,) or (T, 3).
    ///
    /// Returns:
    ///     Velocities [rad/s], (N,) or (T, N).
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong or a number is not finite.
    ///     TypeError: not numbers.
    fn inverse<'py>(&self, twists: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (py, rows) = (twists.py(), Rows::read("twists", twists, 3)?);
        let velocities = py.detach(|| self.maps.inverse(&rows.values));
        array(py, rows.shape(self.wheels), velocities)
    }

    /// The twists from actuator velocities.
    ///
    /// Args:
    ///     velocities: actuator velocities [rad/s], (N,) or (T, N).
    ///
    /// Returns:
    ///     Twists, (3,) or (T, 3).
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong or a number is not finite.
    ///     TypeError: not numbers.
    fn forward<'py>(&self, velocities: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (py, rows) = (
            velocities.py(),
            Rows::read("velocities", velocities, self.wheels)?,
        );
        let twists = py.detach(|| self.maps.forward(&rows.values));
        array(py, rows.shape(3), twists)
    }

    /// The part of actuator velocities that no motion of the vehicle explains: zero if no wheel slips.
    ///
    /// Args:
    ///     velocities: actuator velocities [rad/s], (N,) or (T, N).
    ///
    /// Returns:
    ///     Velocities [rad/s] in the shape of ``velocities``.
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong or a number is not finite.
    ///     TypeError: not numbers.
    fn residual<'py>(&self, velocities: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (py, rows) = (
            velocities.py(),
            Rows::read("velocities", velocities, self.wheels)?,
        );
        let residual = py.detach(|| self.maps.residual(&rows.values));
        array(py, rows.shape(self.wheels), residual)
    }

    /// Scale twists down to the wheels' speed limits.
    ///
    /// Args:
    ///     twists: (3,) or (T, 3).
    ///     limits_rad_s: highest speed of every actuator [rad/s], or of each, (N,); above 0, to 1e6.
    ///     gives_way: ``uniform`` scales the whole twist, so that the path stays the same; ``yaw`` keeps translation
    ///         and ``translation`` keeps the yaw rate as far as each is possible alone, even if the two together would
    ///         have been possible.
    ///
    /// Returns:
    ///     The scaled twists, which every wheel can follow.
    ///
    /// Raises:
    ///     ConfigError: a shape is wrong, a number is not finite, a limit is out of range, or ``gives_way`` is
    ///         unknown.
    ///     TypeError: not numbers.
    #[pyo3(signature = (twists, *, limits_rad_s, gives_way = "uniform"))]
    fn desaturate(
        &self,
        twists: &Bound<'_, PyAny>,
        limits_rad_s: &Bound<'_, PyAny>,
        gives_way: &str,
    ) -> PyResult<Desaturated> {
        let known = [
            ("uniform", Desaturation::Uniform),
            ("yaw", Desaturation::KeepsTranslation),
            ("translation", Desaturation::KeepsYaw),
        ];
        let gives_way = choice("gives_way", gives_way, &known)?;
        let (py, rows) = (twists.py(), Rows::read("twists", twists, 3)?);
        let limits = self.speed_limits(limits_rad_s)?;
        let reduced = py.detach(|| self.maps.desaturate(&rows.values, &limits, gives_way))?;
        self.reduced(py, &rows, reduced)
    }

    /// Wheel velocities scaled into their limits by one factor, even if they correspond to no twist.
    ///
    /// Args:
    ///     velocities: actuator velocities [rad/s], (N,) or (T, N).
    ///     limits_rad_s: highest speed of every actuator [rad/s], or of each, (N,); above 0, to 1e6.
    ///
    /// Returns:
    ///     The velocities within the limits, and their twist; both factors are equal.
    ///
    /// Raises:
    ///     ConfigError: a shape is wrong, a number is not finite, or a limit is out of range.
    ///     TypeError: not numbers.
    ///
    /// Example:
    ///     >>> import omnistep
    ///     >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.6, track_m=0.4, radius_m=0.1)
    ///     >>> scaled = omnistep.Kinematics(layout=layout).scale_velocities([5.0, 6.0, 4.0, -8.0], limits_rad_s=4.0)
    ///     >>> scaled.velocities.tolist(), int(scaled.limiting)
    ///     ([2.5, 3.0, 2.0, -4.0], 3)
    #[pyo3(signature = (velocities, *, limits_rad_s))]
    fn scale_velocities(
        &self,
        velocities: &Bound<'_, PyAny>,
        limits_rad_s: &Bound<'_, PyAny>,
    ) -> PyResult<Desaturated> {
        let (py, rows) = (
            velocities.py(),
            Rows::read("velocities", velocities, self.wheels)?,
        );
        let limits = self.speed_limits(limits_rad_s)?;
        let reduced = py.detach(|| self.maps.scale(&rows.values, &limits))?;
        self.reduced(py, &rows, reduced)
    }

    /// The inverse map A, one row [1/m, 1/m, 1] per wheel, (N, 3): ``inverse(x)`` is ``A @ x``.
    #[getter]
    fn inverse_matrix<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![self.wheels, 3], self.maps.inverse_matrix())
    }

    /// The forward map, a left inverse of A, one row per degree of freedom, (3, N).
    #[getter]
    fn forward_matrix<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3, self.wheels], self.maps.forward_matrix())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, Bound<'py, PyTuple>> {
        let keywords = PyDict::new(py);
        keywords.set_item("layout", &self.layout)?;
        keywords.set_item("forward", &self.forward)?;
        keywords.set_item("weights", self.weights.clone())?;
        rebuilt(&py.get_type::<Self>(), &keywords)
    }

    fn __repr__(&self) -> String {
        format!(
            "<omnistep.Kinematics of {} wheels, {}>",
            self.wheels, self.forward
        )
    }
}

/// Twists that every wheel can follow, and their scale factors; made by :meth:`Kinematics.desaturate`.
///
/// Shapes are those for (3,) and for (T, 3) twists.
#[pyclass(frozen, get_all, module = "omnistep")]
pub(crate) struct Desaturated {
    /// The reduced twists, (3,) or (T, 3).
    twist: Py<PyArrayDyn<f64>>,
    /// The actuator velocities [rad/s] that belong to them, within the limits, (N,) or (T, N).
    velocities: Py<PyArrayDyn<f64>>,
    /// Factor on the translation, 0 to 1, () or (T,).
    translation_factor: Py<PyArrayDyn<f64>>,
    /// Factor on the yaw rate, 0 to 1, () or (T,).
    yaw_factor: Py<PyArrayDyn<f64>>,
    /// Index of the wheel that set the smallest factor, -1 if nothing was reduced, () or (T,).
    limiting: Py<PyArrayDyn<i64>>,
}

#[pymethods]
impl Desaturated {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (twist, limiting) = (self.twist.bind(py).repr()?, self.limiting.bind(py).repr()?);
        Ok(format!(
            "<omnistep.Desaturated: twist {twist}, limiting {limiting}>"
        ))
    }
}
