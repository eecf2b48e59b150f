//! Wheels and layouts of the control library.

use omni_core::{ConfigError, WheelLayout};
use omni_sim::config::{Vehicle, for_wheel_count};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{fixed, whole};
use crate::error::{of_core, refused};
use crate::values::{Pickled, rebuilt};
use crate::wheel_count::{self, unusable};

/// One driven wheel with free rollers on its rim. Its numbers are checked when a :class:`Layout` is built.
///
/// Args:
///     position_m: position of the contact point in the body frame [m] (x forward, y left), each within +-1000.
///     rolling_direction: direction in which the vehicle moves when this wheel alone turns positively, (x, y) of any
///         length but zero; forward by default.
///     roller_angle_rad: angle from the rolling direction to the axis of the roller on the ground [rad],
///         counter-clockwise is positive: 0 for an omni wheel, +-pi/4 for a mecanum wheel, never +-pi/2.
///     radius_m: rolling radius [m], 0.0001 to 100.
///     gear: wheel velocity over actuator velocity, 1e-6 to 1000: 1 for direct drive, 0.05 for a 20:1 reduction.
///     reversed: the actuator turns the wheel backwards when it turns positively.
///
/// Raises:
///     ConfigError: a position or direction is not two numbers.
///     TypeError: an argument is not a number.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.Wheel(position_m=(0.3, -0.2), radius_m=0.05, gear=0.05).rolling_direction
///     (1.0, 0.0)
#[pyclass(frozen, eq, from_py_object, module = "omnistep")]
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Wheel {
    inner: omni_core::geometry::Wheel<f64>,
}

#[pymethods]
impl Wheel {
    #[new]
    #[pyo3(signature = (
        *, position_m, rolling_direction = None, roller_angle_rad = 0.0, radius_m, gear = 1.0, reversed = false
    ))]
    fn new(
        position_m: &Bound<'_, PyAny>,
        rolling_direction: Option<&Bound<'_, PyAny>>,
        roller_angle_rad: f64,
        radius_m: f64,
        gear: f64,
        reversed: bool,
    ) -> PyResult<Self> {
        let rolling_direction = match rolling_direction {
            Some(direction) => fixed("rolling_direction", direction, "two numbers, x and y")?,
            None => [1.0, 0.0],
        };
        let inner = omni_core::geometry::Wheel {
            position_m: fixed("position_m", position_m, "two numbers, x and y [m]")?,
            rolling_direction,
            roller_angle_rad,
            radius_m,
            gear,
            reversed,
        };
        Ok(Self { inner })
    }

    /// Position of the contact point [m], x and y.
    #[getter]
    fn position_m(&self) -> (f64, f64) {
        self.inner.position_m.into()
    }

    /// Direction in which the vehicle moves when this wheel alone turns positively, as given.
    #[getter]
    fn rolling_direction(&self) -> (f64, f64) {
        self.inner.rolling_direction.into()
    }

    /// Angle from the rolling direction to the axis of the roller on the ground [rad].
    #[getter]
    fn roller_angle_rad(&self) -> f64 {
        self.inner.roller_angle_rad
    }

    /// Rolling radius [m].
    #[getter]
    fn radius_m(&self) -> f64 {
        self.inner.radius_m
    }

    /// Wheel velocity over actuator velocity.
    #[getter]
    fn gear(&self) -> f64 {
        self.inner.gear
    }

    /// The actuator turns the wheel backwards when it turns positively.
    #[getter]
    fn reversed(&self) -> bool {
        self.inner.reversed
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, Bound<'py, PyTuple>> {
        let w = &self.inner;
        let keywords = PyDict::new(py);
        keywords.set_item("position_m", w.position_m)?;
        keywords.set_item("rolling_direction", w.rolling_direction)?;
        keywords.set_item("roller_angle_rad", w.roller_angle_rad)?;
        keywords.set_item("radius_m", w.radius_m)?;
        keywords.set_item("gear", w.gear)?;
        keywords.set_item("reversed", w.reversed)?;
        rebuilt(&py.get_type::<Self>(), &keywords)
    }

    fn __repr__(&self) -> String {
        let w = &self.inner;
        format!(
            "omnistep.Wheel(position_m={:?}, rolling_direction={:?}, roller_angle_rad={:?}, radius_m={:?}, gear={:?}, \
             reversed={})",
            self.position_m(),
            self.rolling_direction(),
            w.roller_angle_rad,
            w.radius_m,
            w.gear,
            if w.reversed { "True" } else { "False" },
        )
    }
}

/// Wheels that together can move the vehicle in every direction: 3 to 8 wheels, N below.
///
/// Args:
///     wheels: the wheels; their order is that of every array over wheels.
///
/// Raises:
///     ConfigError: a number of a wheel is out of range, the wheels cannot move the vehicle in three directions, or
///         the condition number is above 100.
///     TypeError: not a list of wheels.
///
/// Example:
///     >>> import omnistep
///     >>> layout = omnistep.Layout.omni(wheels=3, circle_radius_m=0.2, wheel_radius_m=0.05)
///     >>> len(layout), round(layout.condition_number, 6)
///     (3, 1.0)
#[pyclass(frozen, eq, module = "omnistep")]
#[derive(PartialEq)]
pub(crate) struct Layout {
    wheels: Vec<omni_core::geometry::Wheel<f64>>,
    condition_number: f64,
}

impl Layout {
    /// The wheels as the control library wants them, `N` of them.
    pub(crate) fn sized<const N: usize>(&self) -> PyResult<WheelLayout<f64, N>> {
        of_wheels(&self.wheels)
    }

    pub(crate) fn len(&self) -> usize {
        self.wheels.len()
    }

    /// The layout of a vehicle that was checked.
    pub(crate) fn of_vehicle(vehicle: &Vehicle) -> PyResult<Self> {
        for_wheel_count!(vehicle.wheel.len(), vehicles[](vehicle), wheel_count::refuse)
    }

    fn checked<const N: usize>(layout: &WheelLayout<f64, N>) -> Result<Self, ConfigError> {
        Ok(Self {
            wheels: layout.wheels().to_vec(),
            condition_number: omni_core::Kinematics::new(layout)?.condition_number(),
        })
    }
}

fn of_wheels<const N: usize>(wheels: &[omni_core::geometry::Wheel<f64>]) -> PyResult<WheelLayout<f64, N>> {
    let wheels = wheels.try_into().map_err(|_| unusable(wheels.len()))?;
    WheelLayout::new(wheels).map_err(|error| {
        let key = match error.index {
            Some(index) => format!("wheels[{index}].{}", error.parameter),
            None => "wheels".into(),
        };
        of_core(&key, &error)
    })
}

fn checked_wheels<const N: usize>(wheels: &[omni_core::geometry::Wheel<f64>]) -> PyResult<Layout> {
    Layout::checked::<N>(&of_wheels(wheels)?).map_err(|error| of_core("wheels", &error))
}

/// Names of the built-in vehicles.
///
/// Example:
///     >>> import omnistep
///     >>> omnistep.list_vehicles()
///     ['chugo7', 'omni3', 'mecanum4', 'rocker_bogie6']
fn vehicles<const N: usize>(vehicle: &Vehicle) -> PyResult<Layout> {
    preset(vehicle.layout::<f64, N>(), |same| same)
}

/// A layout of the control library's making; `argument` is Python's name of a parameter of its wheels.
fn preset<const N: usize>(
    layout: Result<WheelLayout<f64, N>, ConfigError>,
    argument: impl Fn(&'static str) -> &'static str,
) -> PyResult<Layout> {
    layout
        .and_then(|layout| Layout::checked(&layout))
        .map_err(|error| of_core(argument(error.parameter), &error))
}

fn omni<const N: usize>(circle_radius_m: f64, offset_rad: f64, wheel_radius_m: f64) -> PyResult<Layout> {
    let layout = WheelLayout::<f64, N>::omni(circle_radius_m, offset_rad, wheel_radius_m);
    preset(layout, |parameter| match parameter {
        "radius_m" => "wheel_radius_m",
        "position_m" => "circle_radius_m",
        same => same,
    })
}

/// A length of the vehicle, which must be above zero.
fn length(name: &str, value: f64) -> PyResult<f64> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(refused(
            name,
            &format!("{name} = {value}, allowed: finite and > 0"),
        ))
    }
}

#[pymethods]
impl Layout {
    #[new]
    #[pyo3(signature = (*, wheels))]
    fn new(wheels: &Bound<'_, PyAny>) -> PyResult<Self> {
        let wheels = wheels.extract::<Vec<Wheel>>().map_err(|_| {
            let found = wheels.get_type();
            PyTypeError::new_err(format!("wheels: {found}, allowed: a list of omnistep.Wheel"))
        })?;
        let wheels: Vec<_> = wheels.iter().map(|wheel| wheel.inner).collect();
        for_wheel_count!(wheels.len(), checked_wheels[](&wheels), wheel_count::refuse)
    }

    /// The seven-wheel vehicle of the paper; ``docs/units.md`` draws it.
    ///
    /// Args:
    ///     r1_m: distance of the front and rear rows from the middle [m], above 0.
    ///     r2_m: distance of the side wheels from the centre line [m], above 0.
    ///     radius_m: rolling radius of the wheels [m].
    ///
    /// Raises:
    ///     ConfigError: a length is out of range.
    #[staticmethod]
    #[pyo3(signature = (*, r1_m, r2_m, radius_m))]
    fn chugo7(r1_m: f64, r2_m: f64, radius_m: f64) -> PyResult<Self> {
        let (r1_m, r2_m) = (length("r1_m", r1_m)?, length("r2_m", r2_m)?);
        preset(WheelLayout::chugo7(r1_m, r2_m, radius_m), |same| same)
    }

    /// Equal omni wheels on a circle, each rolling counter-clockwise.
    ///
    /// Args:
    ///     wheels: how many, 3 to 8.
    ///     circle_radius_m: radius of the circle [m], above 0.
    ///     offset_rad: angle from forward to the first wheel [rad], counter-clockwise is positive.
    ///     wheel_radius_m: rolling radius of the wheels [m].
    ///
    /// Raises:
    ///     ConfigError: a count, length or angle is out of range.
    #[staticmethod]
    #[pyo3(signature = (*, wheels, circle_radius_m, offset_rad = 0.0, wheel_radius_m))]
    fn omni(
        wheels: &Bound<'_, PyAny>,
        circle_radius_m: f64,
        offset_rad: f64,
        wheel_radius_m: f64,
    ) -> PyResult<Self> {
        let count = whole("wheels", wheels, wheel_count::ALLOWED)?;
        for_wheel_count!(count, omni[](circle_radius_m, offset_rad, wheel_radius_m), wheel_count::refuse)
    }

    /// Four mecanum wheels at the corners of a rectangle: front left, front right, rear left, rear right.
    ///
    /// All turn positively when the vehicle drives forward. The axes of the rollers on the ground form a diamond.
    ///
    /// Args:
    ///     wheelbase_m: distance from the front to the rear contact points [m], above 0.
    ///     track_m: distance from the left to the right contact points [m], above 0.
    ///     radius_m: rolling radius of the wheels [m].
    ///
    /// Raises:
    ///     ConfigError: a length is out of range.
    #[staticmethod]
    #[pyo3(signature = (*, wheelbase_m, track_m, radius_m))]
    fn mecanum4(wheelbase_m: f64, track_m: f64, radius_m: f64) -> PyResult<Self> {
        preset(WheelLayout::mecanum4(wheelbase_m, track_m, radius_m), |same| same)
    }

    /// The wheels, in order.
    #[getter]
    fn wheels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.wheels.iter().map(|&inner| Wheel { inner }))
    }

    /// How much more wheel noise is amplified in the worst direction of motion than in the best, 1 to 100.
    ///
    /// Yaw is measured at the wheels' mean lever, so that metres and radians compare.
    #[getter]
    fn condition_number(&self) -> f64 {
        self.condition_number
    }

    fn __len__(&self) -> usize {
        self.len()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, Bound<'py, PyTuple>> {
        let keywords = PyDict::new(py);
        keywords.set_item("wheels", self.wheels(py)?)?;
        rebuilt(&py.get_type::<Self>(), &keywords)
    }

    fn __repr__(&self) -> String {
        format!(
            "<omnistep.Layout of {} wheels, condition number {:.2}>",
            self.len(),
            self.condition_number
        )
    }
}
