//! What one control period did and what came of it.

use std::sync::Arc;

use numpy::PyArray1;
use omni_sim::config::Vehicle;
use omni_sim::observation::WheelObservation;
use omni_sim::{Period, WheelSignal, WheelSignals};
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// Signals and results of one control period. Arrays over wheels are (N,).
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Sample {
    body_names: Vec<String>,
    hinge_names: Vec<String>,
    period: Arc<Period>,
}

impl Sample {
    pub(crate) fn new(vehicle: &Vehicle, period: Arc<Period>) -> Self {
        Self {
            body_names: vehicle.body.iter().map(|body| body.name.clone()).collect(),
            hinge_names: vehicle.hinge.iter().map(|hinge| hinge.name.clone()).collect(),
            period,
        }
    }

    fn wheels(&self) -> impl Iterator<Item = (&WheelSignals, &WheelObservation)> {
        self.period
            .control
            .wheels
            .iter()
            .zip(&self.period.observed.wheels)
    }

    fn signal<'py>(&self, py: Python<'py>, name: &str) -> Floats<'py> {
        let signal = WheelSignal::all().find(|signal| signal.name == name);
        let value = |(signals, wheel)| signal.map_or(f64::NAN, |signal| signal.value(signals, wheel));
        PyArray1::from_iter(py, self.wheels().map(value))
    }
}

fn by_name<'py>(
    py: Python<'py>,
    names: &[String],
    values: impl Iterator<Item = f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in names.iter().zip(values) {
        dict.set_item(name, value)?;
    }
    Ok(dict)
}

/// Getters of one array over the wheels each. `saturated` is one of yes and no.
macro_rules! getters {
    (
        control { $($(#[$c_doc:meta])+ $c:ident: $c_place:ident = $($c_source:ident).+;)* }
        of_control { $(#[$s_doc:meta])+ saturated: $s_place:ident = $s_value:expr; $($(#[$d_doc:meta])+ $d:ident: $d_place:ident = $d_value:expr;)* }
        observed { $($(#[$o_doc:meta])+ $o:ident: $o_place:ident = $o_value:expr;)* }
    ) => {
        getters! { @all $($(#[$c_doc])+ $c)* $($(#[$d_doc])+ $d)* $($(#[$o_doc])+ $o)* }
    };
    (@all $($(#[$doc:meta])+ $name:ident)*) => {
        #[pymethods]
        impl Sample {
            /// End of the control period [s].
            #[getter]
            fn time_s(&self) -> f64 {
                self.period.observed.time_ns as f64 * 1e-9
            }

            /// The command: vx [m/s], vy [m/s], wz [rad/s].
            #[getter]
            fn command(&self) -> (f64, f64, f64) {
                self.period.control.command.to_array().into()
            }

            /// The twist from the encoders, at the start of the period.
            #[getter]
            fn estimated(&self) -> (f64, f64, f64) {
                self.period.control.estimated.to_array().into()
            }

            /// The true twist along the vehicle's heading, at the end of the period.
            #[getter]
            fn twist(&self) -> (f64, f64, f64) {
                self.period.observed.twist.to_array().into()
            }

            /// Factor of the policy on all torques or all references, 0 to 1.
            #[getter]
            fn common_factor(&self) -> f64 {
                self.period.control.common_factor
            }

            /// Position of the base [m], (3,).
            #[getter]
            fn position_m<'py>(&self, py: Python<'py>) -> Floats<'py> {
                PyArray1::from_slice(py, &self.period.observed.pose.position_m)
            }

            /// Orientation of the base, a unit quaternion (4,).
            #[getter]
            fn rotation_xyzw<'py>(&self, py: Python<'py>) -> Floats<'py> {
                PyArray1::from_slice(py, &self.period.observed.pose.rotation_xyzw)
            }

            /// Heading of the base [rad].
            #[getter]
            fn yaw_rad(&self) -> f64 {
                self.period.observed.pose.yaw_rad()
            }

            /// Nose-up angle of each body [rad].
            #[getter]
            fn body_nose_up_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                by_name(py, &self.body_names, self.period.observed.body_nose_up_rad.iter().copied())
            }

            /// Angle of each hinge [rad].
            #[getter]
            fn hinge_angle_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                by_name(py, &self.hinge_names, self.period.observed.hinges.iter().map(|hinge| hinge.angle_rad))
            }

            /// Rate of each hinge [rad/s].
            #[getter]
            fn hinge_rate_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                by_name(py, &self.hinge_names, self.period.observed.hinges.iter().map(|hinge| hinge.rate_rad_s))
            }

            /// The request was outside the limits.
            #[getter]
            fn saturated<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
                PyArray1::from_iter(py, self.period.control.wheels.iter().map(|wheel| wheel.saturated() == 1.0))
            }

            /// The wheel touched the ground during the period.
            #[getter]
            fn touches<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
                PyArray1::from_iter(py, self.period.observed.wheels.iter().map(WheelObservation::touches))
            }

            fn __repr__(&self) -> String {
                let [vx, vy, wz] = self.period.observed.twist.to_array();
                format!("<omnistep.Sample at {:.3} s: twist ({vx:.3}, {vy:.3}, {wz:.3})>", self.time_s())
            }

            $(
                $(#[$doc])+
                #[getter]
                fn $name<'py>(&self, py: Python<'py>) -> Floats<'py> {
                    self.signal(py, stringify!($name))
                }
            )*
        }
    };
}

omni_sim::for_each_wheel_signal!(getters);
