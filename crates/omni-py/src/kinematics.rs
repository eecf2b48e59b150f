//! The linear maps of a layout over arrays of twists and of wheel velocities.

use numpy::PyArrayDyn;
use omni_core::{BodyTwist, Desaturation, ForwardMap, SpeedLimits, WheelVelocities};
use omni_sim::config::for_wheel_count;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{Array, Rows, array, choice, numbers, sized};
use crate::counts;
use crate::error::{of_core, refused};
use crate::layout::Layout;
use crate::odometry::{self, Track};
use crate::values::rebuilt;

/// The maps of any wheel count: rows of 3 or N numbers in, rows out.
trait Maps: Send + Sync {
    fn inverse(&self, twists: &[f64]) -> Vec<f64>;
    fn forward(&self, velocities: &[f64]) -> Vec<f64>;
    fn residual(&self, velocities: &[f64]) -> Vec<f64>;
    fn desaturate(&self, twists: &[f64], limits_rad_s: &[f64], gives_way: Desaturation) -> PyResult<Reduced>;
    fn inverse_matrix(&self) -> Vec<f64>;
    fn forward_matrix(&self) -> Vec<f64>;
    /// Odometry that starts at the origin.
    fn track(&self, period_s: f64) -> PyResult<Box<dyn Track>>;
}

/// Columns of [`Desaturated`], row after row.
#[derive(Default)]
struct Reduced {
    twist: Vec<f64>,
    velocities: Vec<f64>,
    translation_factor: Vec<f64>,
    yaw_factor: Vec<f64>,
    limiting: Vec<i64>,
}

/// Every row through `map`.
fn each<const FROM: usize, const TO: usize>(
    rows: &[f64],
    map: impl Fn([f64; FROM]) -> [f64; TO],
) -> Vec<f64> {
    let (rows, _) = rows.as_chunks();
    rows.iter().flat_map(|&row| map(row)).collect()
}

impl<const N: usize> Maps for omni_core::Kinematics<f64, N> {
    fn inverse(&self, twists: &[f64]) -> Vec<f64> {
        each(twists, |twist| self.inverse(&BodyTwist::from_array(twist)).rad_s)
    }

    fn forward(&self, velocities: &[f64]) -> Vec<f64> {
        each(velocities, |rad_s| {
            self.forward(&WheelVelocities { rad_s }).to_array()
        })
    }

    fn residual(&self, velocities: &[f64]) -> Vec<f64> {
        each(velocities, |rad_s| {
            self.residual(&WheelVelocities { rad_s }).rad_s
        })
    }

    fn desaturate(&self, twists: &[f64], limits_rad_s: &[f64], gives_way: Desaturation) -> PyResult<Reduced> {
        let limits = SpeedLimits::<f64, N>::new(*sized("limits_rad_s", limits_rad_s)?, gives_way)
            .map_err(|error| of_core(&indexed("limits_rad_s", error.index), &error))?;
        let mut reduced = Reduced::default();
        let (twists, _) = twists.as_chunks();
        for &twist in twists {
            let row = limits.desaturate(self, &BodyTwist::from_array(twist));
            reduced.twist.extend(row.twist.to_array());
            reduced.velocities.extend(row.velocities.rad_s);
            reduced.translation_factor.push(row.translation_factor);
            reduced.yaw_factor.push(row.yaw_factor);
            reduced
                .limiting
                .push(row.limiting.map_or(-1, |index| index as i64));
        }
        Ok(reduced)
    }

    fn inverse_matrix(&self) -> Vec<f64> {
        self.inverse_matrix().as_flattened().to_vec()
    }

    fn forward_matrix(&self) -> Vec<f64> {
        self.forward_matrix().as_flattened().to_vec()
    }

    fn track(&self, period_s: f64) -> PyResult<Box<dyn Track>> {
        odometry::track(self, period_s)
    }
}

/// An argument, or the element of it that a wheel's index points to.
fn indexed(name: &str, index: Option<usize>) -> String {
    index.map_or(name.into(), |index| format!("{name}[{index}]"))
}

fn named<const N: usize>(layout: &Layout, map: ForwardMap) -> PyResult<Box<dyn Maps>> {
    match omni_core::Kinematics::<f64, N>::with_forward(&layout.sized()?, map) {
        Ok(maps) => Ok(Box::new(maps)),
        Err(error) => Err(of_core("forward", &error)),
    }
}

fn weighted<const N: usize>(layout: &Layout, weights: &[f64]) -> PyResult<Box<dyn Maps>> {
    match omni_core::Kinematics::<f64, N>::weighted(&layout.sized()?, sized("weights", weights)?) {
        Ok(maps) => Ok(Box::new(maps)),
        Err(error) => Err(of_core(&indexed("weights", error.index), &error)),
    }
}

/// Body twist to wheel velocities and back.
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Kinematics {
    layout: Py<Layout>,
    wheels: usize,
    forward: String,
    weights: Option<Py<PyAny>>,
    maps: Box<dyn Maps>,
}

impl Kinematics {
    pub(crate) fn wheels(&self) -> usize {
        self.wheels
    }

    pub(crate) fn track(&self, period_s: f64) -> PyResult<Box<dyn Track>> {
        self.maps.track(period_s)
    }
}

#[pymethods]
impl Kinematics {
    #[new]
    #[pyo3(signature = (*, layout, forward = "least_squares", weights = None))]
    fn new(layout: Bound<'_, Layout>, forward: &str, weights: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let known = [
            ("least_squares", ForwardMap::LeastSquares),
            ("paper_average", ForwardMap::PaperAverage),
        ];
        let map = choice("forward", forward, &known)?;
        let built = layout.get();
        // A copy, which nobody else can change.
        let tuple = layout.py().get_type::<PyTuple>();
        let kept = weights.map(|weights| tuple.call1((weights,))).transpose()?;
        let maps = match (weights, map) {
            (None, _) => for_wheel_count!(built.len(), named[](built, map), counts::refuse)?,
            (Some(weights), ForwardMap::LeastSquares) => {
                let weights = numbers("weights", weights, "one number a wheel")?;
                for_wheel_count!(built.len(), weighted[](built, &weights), counts::refuse)?
            }
            (Some(_), ForwardMap::PaperAverage) => {
                let message =
                    format!("weights given with forward = {forward:?}, allowed: with \"least_squares\"");
                return Err(refused("weights", &message));
            }
        };
        Ok(Self {
            wheels: built.len(),
            layout: layout.unbind(),
            forward: forward.into(),
            weights: kept.map(Bound::unbind),
            maps,
        })
    }

    /// The layout.
    #[getter]
    pub(crate) fn layout(&self, py: Python<'_>) -> Py<Layout> {
        self.layout.clone_ref(py)
    }

    /// Actuator velocities [rad/s] that move the vehicle with `twists`.
    fn inverse<'py>(&self, twists: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (py, rows) = (twists.py(), Rows::read("twists", twists, 3)?);
        let velocities = py.detach(|| self.maps.inverse(&rows.values));
        array(py, rows.shape(self.wheels), velocities)
    }

    /// The twists that actuator velocities [rad/s] amount to.
    fn forward<'py>(&self, velocities: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (py, rows) = (
            velocities.py(),
            Rows::read("velocities", velocities, self.wheels)?,
        );
        let twists = py.detach(|| self.maps.forward(&rows.values));
        array(py, rows.shape(3), twists)
    }

    /// The part of actuator velocities [rad/s] that no motion of the vehicle explains.
    fn residual<'py>(&self, velocities: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (py, rows) = (
            velocities.py(),
            Rows::read("velocities", velocities, self.wheels)?,
        );
        let residual = py.detach(|| self.maps.residual(&rows.values));
        array(py, rows.shape(self.wheels), residual)
    }

    /// Twists that every wheel can follow.
    #[pyo3(signature = (twists, *, limits_rad_s, gives_way = "uniform"))]
    fn desaturate(
        &self,
        twists: &Bound<'_, PyAny>,
        limits_rad_s: &Bound<'_, PyAny>,
        gives_way: &str,
    ) -> PyResult<Desaturated> {
        let known = [
            ("uniform", Desaturation::Uniform),
            ("yaw", Desaturation::TranslationFirst),
            ("translation", Desaturation::YawFirst),
        ];
        let gives_way = choice("gives_way", gives_way, &known)?;
        let (py, rows) = (twists.py(), Rows::read("twists", twists, 3)?);
        // What has a length is a list or an array; what has none is one number for all.
        let limits = if limits_rad_s.len().is_err()
            && let Ok(limit) = limits_rad_s.extract::<f64>()
        {
            vec![limit; self.wheels]
        } else {
            numbers("limits_rad_s", limits_rad_s, "a number, or one a wheel")?
        };
        let reduced = py.detach(|| self.maps.desaturate(&rows.values, &limits, gives_way))?;
        let scalar = rows.shape_of_scalars();
        Ok(Desaturated {
            twist: array(py, rows.shape(3), reduced.twist)?.unbind(),
            velocities: array(py, rows.shape(self.wheels), reduced.velocities)?.unbind(),
            translation_factor: array(py, scalar.clone(), reduced.translation_factor)?.unbind(),
            yaw_factor: array(py, scalar.clone(), reduced.yaw_factor)?.unbind(),
            limiting: array(py, scalar, reduced.limiting)?.unbind(),
        })
    }

    /// The inverse map, (N, 3).
    #[getter]
    fn inverse_matrix<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![self.wheels, 3], self.maps.inverse_matrix())
    }

    /// The forward map, (3, N).
    #[getter]
    fn forward_matrix<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3, self.wheels], self.maps.forward_matrix())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("layout", &self.layout)?;
        keywords.set_item("forward", &self.forward)?;
        keywords.set_item("weights", &self.weights)?;
        rebuilt(&py.get_type::<Self>(), &keywords)
    }

    fn __repr__(&self) -> String {
        format!(
            "<omnistep.Kinematics of {} wheels, {}>",
            self.wheels, self.forward
        )
    }
}

/// Twists that every wheel can follow, and what became of those asked for.
#[pyclass(frozen, get_all, module = "omnistep")]
pub(crate) struct Desaturated {
    /// The twists as reduced.
    twist: Py<PyArrayDyn<f64>>,
    /// The actuator velocities that belong to them [rad/s].
    velocities: Py<PyArrayDyn<f64>>,
    /// What translation was multiplied by.
    translation_factor: Py<PyArrayDyn<f64>>,
    /// What the yaw rate was multiplied by.
    yaw_factor: Py<PyArrayDyn<f64>>,
    /// Index of the wheel that set the smallest factor, -1 for none.
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
