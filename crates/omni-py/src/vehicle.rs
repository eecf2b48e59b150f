//! Vehicle files, and what follows from their numbers.

use std::path::PathBuf;

use omni_log::{JointInterface, ros2_control_urdf, ros2_controllers, vehicle_urdf};
use omni_sim::config::{self, Source};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyTuple};
use toml::{Table, Value};

use crate::arrays::{Array, array, choice};
use crate::error::{exception, refused};
use crate::layout::Layout;
use crate::values::{self, Pickled};

/// A vehicle as its file describes it, checked; immutable, compared by value, and can be pickled.
///
/// ``vehicle["motor.stall_torque_n_m"]`` and ``vehicle["wheel.0.radius_m"]`` are values of the file.
///
/// Args:
///     vehicle: a built-in name (see :func:`list_vehicles`), the path of a .toml file or another :class:`Vehicle`.
///     overrides: keys to replace, ``{"motor.stall_torque_n_m": 1.0}``.
///
/// Raises:
///     ConfigError: a name, key or value is wrong; the message names the key and the allowed values.
///     TypeError: a value is of a type that no key can hold.
///
/// Example:
///     >>> import omnistep
///     >>> vehicle = omnistep.Vehicle("chugo7", overrides={"wheel.0.radius_m": 0.07})
///     >>> vehicle.mass_kg, vehicle["wheel.0.radius_m"], len(vehicle.layout)
///     (20.0, 0.07, 7)
#[pyclass(frozen, eq, module = "omnistep")]
#[derive(Clone, PartialEq)]
pub(crate) struct Vehicle {
    pub(crate) inner: config::Vehicle,
}

/// A vehicle, or if to find one.
pub(crate) enum VehicleArg {
    Loaded(Box<config::Vehicle>),
    Name(String),
}

impl Default for VehicleArg {
    fn default() -> Self {
        Self::Name("chugo7".into())
    }
}

impl VehicleArg {
    pub(crate) fn load(self) -> Result<config::Vehicle, config::Error> {
        match self {
            Self::Loaded(vehicle) => Ok(*vehicle),
            Self::Name(name) => config::Vehicle::load(&name),
        }
    }
}

impl<'py> FromPyObject<'_, 'py> for VehicleArg {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(vehicle) = given.cast::<Vehicle>() {
            return Ok(Self::Loaded(Box::new(vehicle.get().inner.clone())));
        }
        let name = given.extract::<PathBuf>().map_err(|_| {
            let found = given.get_type();
            PyTypeError::new_err(format!(
                "vehicle: {found}, allowed: a name, a path or an omnistep.Vehicle"
            ))
        })?;
        Ok(Self::Name(name.to_string_lossy().into_owned()))
    }
}

/// Plain data read from TOML: it can be written as TOML.
fn table(vehicle: &config::Vehicle) -> Table {
    Table::try_from(vehicle).unwrap_or_default()
}

fn read(source: &Source, overrides: Option<&Bound<'_, PyMapping>>) -> PyResult<Vehicle> {
    let overrides = values::overrides(overrides)?;
    let inner = config::Vehicle::from_source(source, &overrides);
    Ok(Vehicle {
        inner: inner.map_err(exception)?,
    })
}

fn config_error(error: config::Error) -> PyErr {
    exception(error)
}

#[pymethods]
impl Vehicle {
    #[new]
    #[pyo3(signature = (vehicle = VehicleArg::default(), *, overrides = None))]
    fn new(vehicle: VehicleArg, overrides: Option<&Bound<'_, PyMapping>>) -> PyResult<Self> {
        match vehicle {
            VehicleArg::Loaded(inner) => Self { inner: *inner }.replace(overrides),
            VehicleArg::Name(name) => {
                let source = Source::vehicle(&name, None).map_err(config_error)?;
                read(&source, overrides)
            }
        }
    }

    /// The vehicle that the text of a file describes.
    ///
    /// Raises:
    ///     ConfigError: a key or value is wrong.
    #[staticmethod]
    #[pyo3(signature = (text, *, overrides = None))]
    fn from_toml(text: String, overrides: Option<&Bound<'_, PyMapping>>) -> PyResult<Self> {
        read(&Source::text("vehicle", text), overrides)
    }

    /// The vehicle that a file with these keys would describe; None marks an absent key.
    ///
    /// Raises:
    ///     ConfigError: a key or value is wrong.
    ///     TypeError: a value is of a type that no key can hold.
    #[staticmethod]
    fn from_dict(keys: &Bound<'_, PyMapping>) -> PyResult<Self> {
        let table = values::table("vehicle", keys)?;
        read(&Source::text("vehicle", table.to_string()), None)
    }

    /// The same vehicle with other keys.
    ///
    /// Raises:
    ///     ConfigError: a key or value is wrong.
    #[pyo3(signature = (overrides = None))]
    fn replace(&self, overrides: Option<&Bound<'_, PyMapping>>) -> PyResult<Self> {
        let file = format!("vehicle {}", self.inner.name);
        read(&Source::text(file, self.inner.to_toml()), overrides)
    }

    /// The vehicle as a file.
    fn to_toml(&self) -> String {
        self.inner.to_toml()
    }

    /// Every key of the file.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        values::to_python(py, &Value::Table(table(&self.inner)))
    }

    /// The value at a dotted key; elements of lists count from 0.
    ///
    /// Raises:
    ///     KeyError: there is no such key; the message names the existing keys.
    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        values::at(py, &table(&self.inner), key)
    }

    /// Name in logs.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Names of the N wheels, in the order of every array over wheels.
    #[getter]
    pub(crate) fn wheel_names(&self) -> Vec<String> {
        self.inner.wheel.iter().map(|wheel| wheel.name.clone()).collect()
    }

    /// The wheel layout for kinematics.
    #[getter]
    fn layout(&self) -> PyResult<Layout> {
        Layout::of_vehicle(&self.inner)
    }

    /// Mass of the whole vehicle [kg].
    #[getter]
    fn mass_kg(&self) -> f64 {
        self.inner.mass_kg()
    }

    /// Centre of mass of the vehicle at rest on flat ground [m], (3,).
    #[getter]
    fn centre_of_mass_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3], self.inner.centre_of_mass_m().to_vec())
    }

    /// Velocity at which the motors' torque falls to 0 [rad/s]; None if the limit is constant.
    #[getter]
    fn no_load_rad_s(&self) -> Option<f64> {
        self.inner.no_load_rad_s()
    }

    /// Load of each wheel on flat ground [N], (N,); None if moment balance alone does not determine it.
    ///
    /// Raises:
    ///     ConfigError: gravity is not above 0.
    #[pyo3(signature = (*, gravity_m_s2 = 9.81))]
    fn static_loads_n<'py>(&self, py: Python<'py>, gravity_m_s2: f64) -> PyResult<Option<Array<'py, f64>>> {
        if !(gravity_m_s2.is_finite() && gravity_m_s2 > 0.0) {
            let message = format!("gravity_m_s2 = {gravity_m_s2}, allowed: finite and > 0");
            return Err(refused("gravity_m_s2", &message));
        }
        let loads = self.inner.static_loads_n(gravity_m_s2);
        loads.map(|loads| array(py, vec![loads.len()], loads)).transpose()
    }

    /// Speeds along x, y [m/s] and yaw rate [rad/s], each alone, for this speed of the fastest actuator, (3,).
    ///
    /// Raises:
    ///     ConfigError: not a finite number.
    fn speeds_at<'py>(&self, py: Python<'py>, actuator_rad_s: f64) -> PyResult<Array<'py, f64>> {
        if !actuator_rad_s.is_finite() {
            let message = format!("actuator_rad_s = {actuator_rad_s}, allowed: finite");
            return Err(refused("actuator_rad_s", &message));
        }
        let speeds = self.inner.speeds_at(actuator_rad_s).map_err(config_error)?;
        array(py, vec![3], speeds.to_vec())
    }

    /// The vehicle as URDF, for RViz, Rerun and other simulators.
    ///
    /// Args:
    ///     ros2_control: adds a block for ros2_control, whose controllers command each wheel by its ``velocity``
    ///         [rad/s] or ``effort`` [N.m]; None for none.
    ///
    /// Raises:
    ///     ConfigError: ``ros2_control`` is none of these.
    ///
    /// Example:
    ///     >>> import omnistep
    ///     >>> omnistep.Vehicle("mecanum4").urdf(ros2_control="velocity").count("<command_interface ")
    ///     4
    #[pyo3(signature = (*, ros2_control = None))]
    fn urdf(&self, ros2_control: Option<&str>) -> PyResult<String> {
        let known = [JointInterface::Velocity, JointInterface::Effort].map(|each| (each.name(), each));
        Ok(match ros2_control {
            None => vehicle_urdf(&self.inner),
            Some(name) => ros2_control_urdf(&self.inner, choice("ros2_control", name, &known)?),
        })
    }

    /// The ros2_control YAML file, for ``omni_wheel_drive_controller`` or ``mecanum_drive_controller``.
    ///
    /// Raises:
    ///     ConfigError: neither controller matches the vehicle's kinematics; the message names the wheel.
    ///
    /// Example:
    ///     >>> import omnistep
    ///     >>> print(omnistep.Vehicle("mecanum4").ros2_controllers().splitlines()[0])
    ///     # ros2_control's controllers for the vehicle mecanum4. Units are m, rad and s.
    fn ros2_controllers(&self) -> PyResult<String> {
        ros2_controllers(&self.inner).map_err(exception)
    }

    fn __hash__(&self) -> u64 {
        values::hash(&self.inner.to_toml())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, Bound<'py, PyTuple>> {
        let read = py.get_type::<Self>().getattr("from_toml")?;
        Ok((read, PyTuple::new(py, [self.inner.to_toml()])?))
    }

    fn __repr__(&self) -> String {
        let (name, wheels, mass) = (&self.inner.name, self.inner.wheel.len(), self.inner.mass_kg());
        format!("<omnistep.Vehicle {name}: {wheels} wheels, {mass:.1} kg>")
    }
}
