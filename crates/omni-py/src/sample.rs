//! What one control period did and what came of it.

use std::sync::Arc;

use numpy::PyArray1;
use omni_sim::config::Vehicle;
use omni_sim::controller::{ControlSample, WheelSignals};
use omni_sim::observation::{Observation, WheelObservation};
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// Signals and results of one control period. Arrays over wheels are (N,).
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Sample {
    body_names: Vec<String>,
    hinge_names: Vec<String>,
    period: Period,
}

/// What the controller did in a period, and what came of it.
pub(crate) type Period = Arc<(ControlSample, Observation)>;

impl Sample {
    pub(crate) fn new(vehicle: &Vehicle, period: Period) -> Self {
        Self {
            body_names: vehicle.body.iter().map(|body| body.name.clone()).collect(),
            hinge_names: vehicle.hinge.iter().map(|hinge| hinge.name.clone()).collect(),
            period,
        }
    }

    fn signal<'py>(&self, py: Python<'py>, get: impl Fn(&WheelSignals) -> f64) -> Floats<'py> {
        PyArray1::from_iter(py, self.period.0.wheels.iter().map(get))
    }

    fn wheel<'py>(&self, py: Python<'py>, get: impl Fn(&WheelObservation) -> f64) -> Floats<'py> {
        PyArray1::from_iter(py, self.period.1.wheels.iter().map(get))
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

/// Getters of one array over the wheels each.
macro_rules! wheel_arrays {
    ($($(#[$doc:meta])* $name:ident = $from:ident $get:expr;)*) => {
        #[pymethods]
        impl Sample {
            /// End of the control period [s].
            #[getter]
            fn time_s(&self) -> f64 {
                self.period.1.time_ns as f64 * 1e-9
            }

            /// The command: vx [m/s], vy [m/s], wz [rad/s].
            #[getter]
            fn command(&self) -> (f64, f64, f64) {
                self.period.0.command.to_array().into()
            }

            /// The twist from the encoders, at the start of the period.
            #[getter]
            fn estimated(&self) -> (f64, f64, f64) {
                self.period.0.estimated.to_array().into()
            }

            /// The true twist along the vehicle's heading, at the end of the period.
            #[getter]
            fn twist(&self) -> (f64, f64, f64) {
                self.period.1.twist.to_array().into()
            }

            /// Factor of the policy on all torques or all references, 0 to 1.
            #[getter]
            fn common_factor(&self) -> f64 {
                self.period.0.common_factor
            }

            /// Position of the base [m], (3,).
            #[getter]
            fn position_m<'py>(&self, py: Python<'py>) -> Floats<'py> {
                PyArray1::from_slice(py, &self.period.1.pose.position_m)
            }

            /// Orientation of the base, a unit quaternion (4,).
            #[getter]
            fn rotation_xyzw<'py>(&self, py: Python<'py>) -> Floats<'py> {
                PyArray1::from_slice(py, &self.period.1.pose.rotation_xyzw)
            }

            /// Heading of the base [rad].
            #[getter]
            fn yaw_rad(&self) -> f64 {
                self.period.1.pose.yaw_rad()
            }

            /// Nose-up angle of each body [rad].
            #[getter]
            fn body_nose_up_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                by_name(py, &self.body_names, self.period.1.body_nose_up_rad.iter().copied())
            }

            /// Angle of each hinge [rad].
            #[getter]
            fn hinge_angle_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                by_name(py, &self.hinge_names, self.period.1.hinges.iter().map(|hinge| hinge.angle_rad))
            }

            /// Rate of each hinge [rad/s].
            #[getter]
            fn hinge_rate_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                by_name(py, &self.hinge_names, self.period.1.hinges.iter().map(|hinge| hinge.rate_rad_s))
            }

            /// The request was outside the limits.
            #[getter]
            fn saturated<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
                PyArray1::from_iter(py, self.period.0.wheels.iter().map(|wheel| wheel.saturated))
            }

            /// The wheel touched the ground during the period.
            #[getter]
            fn touches<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
                PyArray1::from_iter(py, self.period.1.wheels.iter().map(WheelObservation::touches))
            }

            fn __repr__(&self) -> String {
                let [vx, vy, wz] = self.period.1.twist.to_array();
                format!("<omnistep.Sample at {:.3} s: twist ({vx:.3}, {vy:.3}, {wz:.3})>", self.time_s())
            }

            $(
                $(#[$doc])*
                #[getter]
                fn $name<'py>(&self, py: Python<'py>) -> Floats<'py> {
                    self.$from(py, $get)
                }
            )*
        }
    };
}

wheel_arrays! {
    /// Reference as commanded [rad/s].
    reference_rad_s = signal |w| w.reference_rad_s;
    /// Measured velocity [rad/s], at the start of the period.
    measured_rad_s = signal |w| w.measured_rad_s;
    /// Proportional term [N.m].
    p_n_m = signal |w| w.p_n_m;
    /// Integral term [N.m].
    i_n_m = signal |w| w.i_n_m;
    /// Derivative term [N.m].
    d_n_m = signal |w| w.d_n_m;
    /// Torque requested with the whole reference [N.m].
    requested_n_m = signal |w| w.requested_n_m;
    /// Torque applied [N.m], within the limits.
    applied_n_m = signal |w| w.applied_n_m;
    /// Lowest torque allowed [N.m], <= 0.
    limit_lower_n_m = signal |w| w.limit_lower_n_m;
    /// Highest torque allowed [N.m], >= 0.
    limit_upper_n_m = signal |w| w.limit_upper_n_m;
    /// Part of the measured velocity that no motion of the vehicle explains [rad/s].
    residual_rad_s = signal |w| w.residual_rad_s;
    /// Safe form of eq. (14), within -2 to 2; lagging is +.
    disturbed_ratio = signal WheelSignals::disturbed_ratio;
    /// Safe form of eq. (15), within -2 to 2; spinning is +; 0 in the air.
    slip_ratio = wheel WheelObservation::slip_ratio;
    /// Speed of the rim [m/s], from the wheel's rotation against the world.
    rim_m_s = wheel |w| w.rim_m_s;
    /// Velocity of the wheel's centre along its rolling direction in the contact's tangent plane [m/s].
    along_m_s = wheel |w| w.along_m_s;
    /// Ground force along the contact normals [N], averaged over the period.
    force_normal_n = wheel |w| w.force_normal_n;
    /// Ground force along the rolling direction [N], averaged over the period.
    force_along_n = wheel |w| w.force_along_n;
}
