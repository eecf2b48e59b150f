//! A DC motor over arrays: torques, duties, currents.

use numpy::PyArrayDyn;
use omni_core::TorqueLimit;
use omni_core::motor::DcMotorConfig;
use pyo3::prelude::*;

use crate::arrays::{Array, array};
use crate::elements::{Elements, Pairs};
use crate::error::of_core;

/// A DC motor by its data sheet: its torque range at a speed, and the duty cycle for a torque.
///
/// Torques and velocities are at the motor shaft, before any gear; positive is forwards. Arrays of any shape; a single
/// number is compatible with every shape. The model is steady-state, without winding inductance.
///
/// Args:
///     torque_constant_n_m_a: torque per current, and voltage per velocity [N.m/A], above 0.
///     resistance_ohm: resistance of the winding and everything in series with it [ohm], above 0.
///     no_load_current_a: current that overcomes friction [A], 0 or more and below the stall current.
///     supply_v: voltage of the supply [V], above 0.
///     current_limit_a: current limit of the driver [A], above the no-load current; none if left out.
///
/// Raises:
///     ConfigError: an argument is out of range.
///
/// Example:
///     >>> import omnistep
///     >>> motor = omnistep.DcMotor(
///     ...     torque_constant_n_m_a=0.05, resistance_ohm=2.0, no_load_current_a=0.1, supply_v=12.0,
///     ...     current_limit_a=3.0)
///     >>> given = motor.duty([0.045, 1.0], [84.0, 0.0])  # the second is more than the driver's current gives
///     >>> given.duty.round(6).tolist(), given.torque_n_m.round(6).tolist(), given.limited.tolist()
///     ([0.516667, 0.5], [0.045, 0.15], [False, True])
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct DcMotor {
    inner: omni_core::motor::DcMotor<f64>,
}

const TORQUE: &str = "torque_n_m";
const VELOCITY: &str = "velocity_rad_s";

impl DcMotor {
    fn map<'py>(
        &self,
        torque_n_m: &Bound<'py, PyAny>,
        velocity_rad_s: &Bound<'py, PyAny>,
        of: impl Fn(&omni_core::motor::DcMotor<f64>, f64, f64) -> f64,
    ) -> PyResult<Array<'py, f64>> {
        Pairs::read((TORQUE, torque_n_m), (VELOCITY, velocity_rad_s))?
            .map(torque_n_m.py(), |torque, velocity| {
                of(&self.inner, torque, velocity)
            })
    }
}

#[pymethods]
impl DcMotor {
    #[new]
    #[pyo3(signature = (
        *, torque_constant_n_m_a, resistance_ohm, no_load_current_a = 0.0, supply_v, current_limit_a = None
    ))]
    fn new(
        torque_constant_n_m_a: f64,
        resistance_ohm: f64,
        no_load_current_a: f64,
        supply_v: f64,
        current_limit_a: Option<f64>,
    ) -> PyResult<Self> {
        let config = DcMotorConfig {
            torque_constant_n_m_a,
            resistance_ohm,
            no_load_current_a,
            supply_v,
            current_limit_a,
        };
        let inner =
            omni_core::motor::DcMotor::new(config).map_err(|error| of_core(error.parameter, &error))?;
        Ok(Self { inner })
    }

    /// Speed without load [rad/s].
    #[getter]
    fn no_load_speed_rad_s(&self) -> f64 {
        self.inner.no_load_speed_rad_s()
    }

    /// Stall torque [N.m], within the driver's current limit.
    #[getter]
    fn stall_torque_n_m(&self) -> f64 {
        self.inner.torque_limit().range(0.0).upper_n_m
    }

    /// Lowest (0 or less) and highest (0 or more) torque [N.m] at velocities [rad/s], each in their shape.
    ///
    /// Raises:
    ///     TypeError: not numbers.
    fn torque_range<'py>(
        &self,
        velocity_rad_s: &Bound<'py, PyAny>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let py = velocity_rad_s.py();
        let velocities = Elements::read(VELOCITY, velocity_rad_s)?;
        let limit = self.inner.torque_limit();
        let each = velocities.values.iter().map(|velocity| limit.range(*velocity));
        let (lower, upper) = each.map(|range| (range.lower_n_m, range.upper_n_m)).unzip();
        Ok((
            array(py, velocities.shape.clone(), lower)?,
            array(py, velocities.shape, upper)?,
        ))
    }

    /// Duty cycle of a bridge without a current loop, for a torque [N.m] at a velocity [rad/s].
    ///
    /// For values that are not finite the duty cycle is 0, which counts as limited.
    ///
    /// Raises:
    ///     ConfigError: the shapes differ.
    ///     TypeError: not numbers.
    #[pyo3(signature = (torque_n_m, velocity_rad_s, /))]
    fn duty(&self, torque_n_m: &Bound<'_, PyAny>, velocity_rad_s: &Bound<'_, PyAny>) -> PyResult<MotorDuty> {
        let py = torque_n_m.py();
        let pairs = Pairs::read((TORQUE, torque_n_m), (VELOCITY, velocity_rad_s))?;
        let given = pairs.each(|torque, velocity| self.inner.duty(torque, velocity));
        let column = |of: fn(&omni_core::motor::MotorDuty<f64>) -> f64| -> PyResult<_> {
            Ok(array(py, pairs.shape(), given.iter().map(of).collect())?.unbind())
        };
        let limited = given.iter().map(|each| each.limited).collect();
        Ok(MotorDuty {
            duty: column(|each| each.duty)?,
            current_a: column(|each| each.current_a)?,
            torque_n_m: column(|each| each.torque_n_m)?,
            limited: array(py, pairs.shape(), limited)?.unbind(),
        })
    }

    /// Current [A] for a torque [N.m] at a velocity [rad/s], friction included.
    ///
    /// Raises:
    ///     ConfigError: the shapes differ.
    ///     TypeError: not numbers.
    #[pyo3(signature = (torque_n_m, velocity_rad_s, /))]
    fn current_a<'py>(
        &self,
        torque_n_m: &Bound<'py, PyAny>,
        velocity_rad_s: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py, f64>> {
        self.map(torque_n_m, velocity_rad_s, omni_core::motor::DcMotor::current_a)
    }

    /// Voltage [V] at the terminals for a torque [N.m] at a velocity [rad/s].
    ///
    /// Raises:
    ///     ConfigError: the shapes differ.
    ///     TypeError: not numbers.
    #[pyo3(signature = (torque_n_m, velocity_rad_s, /))]
    fn voltage_v<'py>(
        &self,
        torque_n_m: &Bound<'py, PyAny>,
        velocity_rad_s: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py, f64>> {
        self.map(torque_n_m, velocity_rad_s, omni_core::motor::DcMotor::voltage_v)
    }

    /// Electrical power [W] for a torque [N.m] at a velocity [rad/s]; negative flows back into the supply.
    ///
    /// Raises:
    ///     ConfigError: the shapes differ.
    ///     TypeError: not numbers.
    #[pyo3(signature = (torque_n_m, velocity_rad_s, /))]
    fn electrical_power_w<'py>(
        &self,
        torque_n_m: &Bound<'py, PyAny>,
        velocity_rad_s: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py, f64>> {
        self.map(
            torque_n_m,
            velocity_rad_s,
            omni_core::motor::DcMotor::electrical_power_w,
        )
    }

    /// Heat of the winding [W] for a torque [N.m] at a velocity [rad/s]; never negative.
    ///
    /// Raises:
    ///     ConfigError: the shapes differ.
    ///     TypeError: not numbers.
    #[pyo3(signature = (torque_n_m, velocity_rad_s, /))]
    fn heat_w<'py>(
        &self,
        torque_n_m: &Bound<'py, PyAny>,
        velocity_rad_s: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py, f64>> {
        self.map(torque_n_m, velocity_rad_s, omni_core::motor::DcMotor::heat_w)
    }

    fn __repr__(&self) -> String {
        format!(
            "<omnistep.DcMotor: {:.6} N.m at rest, {:.6} rad/s without load>",
            self.stall_torque_n_m(),
            self.no_load_speed_rad_s()
        )
    }
}

/// Duty cycle of a bridge for each torque, with the resulting current and torque, in the shape of the request.
#[pyclass(frozen, get_all, module = "omnistep")]
pub(crate) struct MotorDuty {
    /// Part of the supply's voltage at the terminals, -1 to 1; 0 shorts the motor, which brakes.
    duty: Py<PyArrayDyn<f64>>,
    /// Resulting current [A], positive forwards.
    current_a: Py<PyArrayDyn<f64>>,
    /// Resulting torque at the shaft [N.m]: the requested torque, unless limited.
    torque_n_m: Py<PyArrayDyn<f64>>,
    /// The supply voltage or the driver's current limit restricts the torque.
    limited: Py<PyArrayDyn<bool>>,
}

#[pymethods]
impl MotorDuty {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (duty, limited) = (self.duty.bind(py).repr()?, self.limited.bind(py).repr()?);
        Ok(format!("<omnistep.MotorDuty: duty {duty}, limited {limited}>"))
    }
}

/// Duty cycle of a bridge without a current loop, from a motor's stall torque and its decrease with speed.
///
/// The line of :func:`torque_range` at a fraction of the supply voltage, solved for the fraction. It needs only a data
/// sheet's stall torque and no-load speed; :class:`DcMotor` also yields the current.
///
/// Args:
///     torque_n_m: torque at the actuator [N.m], an array of any shape or a number.
///     velocity_rad_s: its velocity [rad/s], in that shape or a number.
///     stall_torque_n_m: torque at rest with the whole supply [N.m], above 0.
///     slope_n_m_s_rad: torque lost per speed [N.m per rad/s], 0 or more.
///
/// Returns:
///     Duties, -1 to 1; 0 shorts the motor, which brakes with slope times velocity. 0 for NaN.
///
/// Raises:
///     ConfigError: a torque or slope is out of range, or the shapes differ.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.torque_duty([0.5, 0.5, 2.0], [0.0, 4.0, 4.0], stall_torque_n_m=2.0, slope_n_m_s_rad=0.25).tolist()
///     [0.25, 0.75, 1.0]
#[pyfunction]
#[pyo3(signature = (torque_n_m, velocity_rad_s, *, stall_torque_n_m, slope_n_m_s_rad = 0.0))]
pub(crate) fn torque_duty<'py>(
    torque_n_m: &Bound<'py, PyAny>,
    velocity_rad_s: &Bound<'py, PyAny>,
    stall_torque_n_m: f64,
    slope_n_m_s_rad: f64,
) -> PyResult<Array<'py, f64>> {
    let limit = TorqueLimit::line(stall_torque_n_m, slope_n_m_s_rad)
        .map_err(|error| of_core(error.parameter, &error))?;
    Pairs::read((TORQUE, torque_n_m), (VELOCITY, velocity_rad_s))?
        .map(torque_n_m.py(), |torque, velocity| limit.duty(torque, velocity))
}
