//! What a policy sees, written in place.

use numpy::{PyArray1, PyArrayMethods};
use omni_core::Readings;
use parking_lot::Mutex;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};

#[derive(Clone, Copy, Default)]
struct Scalars {
    period: u64,
    time_s: f64,
    new_command: bool,
    roll_rad: f64,
    pitch_rad: f64,
    climbed_m: f64,
}

/// Inputs of a controller of your own in a control period: sensors, its own torques, its command.
///
/// There is one object for each run. It and its arrays are overwritten before every step: copy the values that you
/// keep. The arrays are read-only. N wheels and H hinges are in the order of :class:`omnistep.PolicyInfo`.
///
/// Example:
///     >>> import omnistep
///     >>> def kept(observation):
///     ...     seen.append((observation.period, observation.command.copy(), observation.wheels_rad_s.shape))
///     ...     return [0.0] * 7
///     >>> seen = []
///     >>> trace = omnistep.run("flat", policy=kept, overrides={"duration_s": 0.01})
///     >>> [period for period, *_ in seen[:3]], seen[0][1].shape, seen[0][2]
///     ([0, 1, 2], (3,), (7,))
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Observation {
    now: Mutex<Scalars>,
    /// All numbers of the arrays below, one after the other.
    numbers: Py<PyArray1<f64>>,
    /// The last command that arrived, (3,): vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise.
    ///
    /// It is the output of the scenario's heading hold, before any limit of the vehicle.
    #[pyo3(get)]
    command: Py<PyArray1<f64>>,
    /// Actuator velocities by the encoders [rad/s], (N,); NaN if no reading arrived.
    #[pyo3(get)]
    wheels_rad_s: Py<PyArray1<f64>>,
    /// Torques that were applied in the previous period [N.m], (N,); 0 in the first.
    #[pyo3(get)]
    torques_n_m: Py<PyArray1<f64>>,
    /// Angles of the hinges [rad], (H,).
    #[pyo3(get)]
    hinges_rad: Py<PyArray1<f64>>,
    /// Rates of the hinges [rad/s], (H,).
    #[pyo3(get)]
    hinges_rad_s: Py<PyArray1<f64>>,
    /// Angular velocity of the base about its x, y and z axes by the gyro [rad/s], (3,).
    #[pyo3(get)]
    rate_rad_s: Py<PyArray1<f64>>,
    /// Acceleration of the base minus gravity along its axes [m/s^2], (3,): 9.81 upwards at rest.
    #[pyo3(get)]
    specific_force_m_s2: Py<PyArray1<f64>>,
}

impl Observation {
    pub(crate) fn new(py: Python<'_>, wheels: usize, hinges: usize) -> PyResult<Self> {
        let numbers = PyArray1::<f64>::zeros(py, 3 + 2 * wheels + 2 * hinges + 3 + 3, false);
        let mut start = 0;
        let mut view = |count: usize| -> PyResult<Py<PyArray1<f64>>> {
            let end = start + count;
            let view = numbers.get_item(PySlice::new(py, start as isize, end as isize, 1))?;
            start = end;
            let flags = PyDict::new(py);
            flags.set_item("write", false)?;
            view.call_method("setflags", (), Some(&flags))?;
            Ok(view.cast_into::<PyArray1<f64>>()?.unbind())
        };
        Ok(Self {
            now: Mutex::default(),
            command: view(3)?,
            wheels_rad_s: view(wheels)?,
            torques_n_m: view(wheels)?,
            hinges_rad: view(hinges)?,
            hinges_rad_s: view(hinges)?,
            rate_rad_s: view(3)?,
            specific_force_m_s2: view(3)?,
            numbers: numbers.unbind(),
        })
    }

    /// What is known in a period; the slices are as long as they were made for.
    pub(crate) fn set(
        &self,
        py: Python<'_>,
        period: u64,
        time_s: f64,
        readings: &Readings<'_, f64>,
    ) -> PyResult<()> {
        *self.now.lock() = Scalars {
            period,
            time_s,
            new_command: readings.new_command,
            roll_rad: readings.imu.roll_rad,
            pitch_rad: readings.imu.pitch_rad,
            climbed_m: readings.climbed_m,
        };
        let mut numbers = self.numbers.bind(py).try_readwrite()?;
        let command = readings.command.to_array();
        let parts: [&[f64]; 7] = [
            &command,
            readings.wheels_rad_s,
            readings.torques_n_m,
            readings.hinges_rad,
            readings.hinges_rad_s,
            &readings.imu.rate_rad_s,
            &readings.imu.specific_force_m_s2,
        ];
        let all = numbers.as_slice_mut()?;
        for (number, part) in all.iter_mut().zip(parts.into_iter().flatten()) {
            *number = *part;
        }
        Ok(())
    }
}

#[pymethods]
impl Observation {
    /// Control periods before this one.
    #[getter]
    fn period(&self) -> u64 {
        self.now.lock().period
    }

    /// Time since the start [s].
    #[getter]
    fn time_s(&self) -> f64 {
        self.now.lock().time_s
    }

    /// The command arrived since the previous period.
    #[getter]
    fn new_command(&self) -> bool {
        self.now.lock().new_command
    }

    /// Angle of the base's y axis above the horizon [rad]: left side up is positive.
    #[getter]
    fn roll_rad(&self) -> f64 {
        self.now.lock().roll_rad
    }

    /// Angle of the base's x axis above the horizon [rad]: nose up is positive.
    #[getter]
    fn pitch_rad(&self) -> f64 {
        self.now.lock().pitch_rad
    }

    /// Height of the edge that a wheel has climbed in this period, by ``odometry.kind = "ground"`` [m]; else 0.
    #[getter]
    fn climbed_m(&self) -> f64 {
        self.now.lock().climbed_m
    }

    fn __reduce__(&self) -> PyResult<()> {
        let message =
            "an Observation is overwritten in every period: keep copies of its arrays, not the Observation";
        Err(PyTypeError::new_err(message))
    }

    fn __repr__(&self) -> String {
        let now = *self.now.lock();
        format!(
            "<omnistep.Observation of period {}, t = {:.3} s>",
            now.period, now.time_s
        )
    }
}
