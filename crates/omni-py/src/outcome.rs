//! The metrics of a run.

use std::collections::HashMap;

use omni_sim::Metric;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::damaged_pickle;
use crate::values::Pickled;

/// Key, heading, meaning, unit and ``lower``, ``zero`` or nothing for every metric, in the order of tables.
#[pyfunction]
pub(crate) fn metrics() -> Vec<(&'static str, String, &'static str, &'static str, &'static str)> {
    let value_of = |metric: &Metric| {
        (
            metric.key,
            metric.heading(),
            metric.meaning,
            metric.unit,
            metric.better.name(),
        )
    };
    Metric::ALL.iter().map(value_of).collect()
}

/// Metrics of a run; if there is an obstacle, over the crossing (docs/metrics.md).
///
/// A metric that was not measured, because nothing crossed or the run was killed, is NaN, or None if documented.
#[pyclass(frozen, eq, module = "omnistep")]
#[derive(Clone, PartialEq)]
pub(crate) struct Outcome {
    inner: omni_sim::Outcome,
}

impl Outcome {
    pub(crate) fn new(inner: omni_sim::Outcome) -> Self {
        Self { inner }
    }

    pub(crate) fn summary(&self) -> String {
        match self.inner.crossing_s {
            Some(seconds) => format!("climbed in {seconds:.2} s"),
            None => self.inner.verdict.name().into(),
        }
    }
}

#[pymethods]
impl Outcome {
    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, (String,)> {
        let state =
            serde_json::to_string(&self.inner).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok((py.get_type::<Self>().getattr("_of_state")?, (state,)))
    }

    /// Metrics out of their pickle.
    #[staticmethod]
    fn _of_state(state: &str) -> PyResult<Self> {
        let inner = serde_json::from_str(state).map_err(damaged_pickle)?;
        Ok(Self::new(inner))
    }

    /// Result of the run; `completed` on flat ground, `unfinished` if `duration_s` ended it.
    ///
    /// docs/metrics.md defines each of them.
    #[getter]
    fn verdict(&self) -> &'static str {
        self.inner.verdict.name()
    }

    /// Whether the verdict is `climbed`; a vehicle that got across, but `touched`, has not.
    #[getter]
    fn climbed(&self) -> bool {
        self.inner.climbed
    }

    /// Physics engine: `rapier`, `articulated`, or `mujoco` in :func:`omnistep.mujoco.run`.
    #[getter]
    fn engine(&self) -> &'static str {
        self.inner.engine.name()
    }

    /// The wheel model is valid on this ground: rollers, or balls that represent them there.
    ///
    /// docs/physics.md, Validity of the ball model.
    #[getter]
    fn wheel_model_valid(&self) -> bool {
        self.inner.wheel_model_valid
    }

    /// From the foremost wheel's contact to the last wheel beyond the obstacle [s]; None unless climbed.
    #[getter]
    fn crossing_s(&self) -> Option<f64> {
        self.inner.crossing_s
    }

    /// World x of the base where it stalled [m]; None unless stalled.
    #[getter]
    fn stalled_at_m(&self) -> Option<f64> {
        self.inner.stalled_at_m
    }

    /// The foremost row that had not passed the obstacle at the stall, 1 is the front row; None unless stalled.
    #[getter]
    fn stalled_row(&self) -> Option<usize> {
        self.inner.stalled_row
    }

    /// Limiting factor: `torque`, `friction` or `time`; None unless stalled or unfinished.
    ///
    /// docs/metrics.md, Limit of a stalled run.
    #[getter]
    fn limited_by(&self) -> Option<&'static str> {
        self.inner.limited_by.map(omni_sim::LimitedBy::name)
    }

    /// Wheels that slipped, or stood still while their motors were at their limit; None if neither happened.
    #[getter]
    fn limited_wheels(&self) -> Option<usize> {
        self.inner.limited_wheels
    }

    /// The first body that was more than 2 mm below the ground; None if none was.
    #[getter]
    fn touched_body(&self) -> Option<String> {
        self.inner.touched_body.map(|body| body.to_string())
    }

    /// Time when that happened, from the start of the run [s]; None if there was none.
    #[getter]
    fn touched_s(&self) -> Option<f64> {
        self.inner.touched_s
    }

    /// World x of the deepest point then [m].
    #[getter]
    fn touched_x_m(&self) -> Option<f64> {
        self.inner.touched_x_m
    }

    /// World y of that point [m].
    #[getter]
    fn touched_y_m(&self) -> Option<f64> {
        self.inner.touched_y_m
    }

    /// Depth of that point below the ground [m].
    #[getter]
    fn touched_depth_m(&self) -> Option<f64> {
        self.inner.touched_depth_m
    }

    /// Number of retries of traction control; None for policies without retries.
    #[getter]
    fn retries(&self) -> Option<u32> {
        self.inner.retries
    }

    /// Longest time that a motor applied 90 % of its stall torque or more while the vehicle stood still [s].
    #[getter]
    fn stall_s(&self) -> f64 {
        self.inner.stall_s
    }

    /// Start of that time, from the start of the run [s]; None if there was none.
    #[getter]
    fn stall_from_s(&self) -> Option<f64> {
        self.inner.stall_from_s
    }

    /// Largest nose-up angle of any body [deg].
    #[getter]
    fn pitch_peak_deg(&self) -> f64 {
        self.inner.pitch_peak_deg
    }

    /// Largest nose-down angle of any body, positive [deg].
    #[getter]
    fn nose_down_peak_deg(&self) -> f64 {
        self.inner.nose_down_peak_deg
    }

    /// Heading minus commanded heading, at the end of the crossing [deg]; left is positive.
    #[getter]
    fn yaw_error_deg(&self) -> f64 {
        self.inner.yaw_error_deg
    }

    /// Root mean square of the slip ratio over driven wheels that touch the ground.
    #[getter]
    fn slip_rms(&self) -> f64 {
        self.inner.slip_rms
    }

    /// Root mean square of the relative speed error (the disturbed ratio) over driven wheels.
    #[getter]
    fn speed_error_rms(&self) -> f64 {
        self.inner.speed_error_rms
    }

    /// Root mean square of the speed error relative to the reference after the policy's reduction.
    #[getter]
    fn speed_error_realised_rms(&self) -> f64 {
        self.inner.speed_error_realised_rms
    }

    /// Standard deviation over driven wheels of velocity over reference, root mean square over time.
    #[getter]
    fn speed_ratio_std(&self) -> f64 {
        self.inner.speed_ratio_std
    }

    /// Standard deviation over driven wheels of slip speed, over commanded speed: 0 if all wheels roll.
    #[getter]
    fn slip_speed_std(&self) -> f64 {
        self.inner.slip_speed_std
    }

    /// Root mean square of the part of the velocities that no common factor on the references explains [rad/s].
    #[getter]
    fn shape_error_rms_rad_s(&self) -> f64 {
        self.inner.shape_error_rms_rad_s
    }

    /// Sum over wheels of the time integral of torque squared [N^2.m^2.s].
    #[getter]
    fn torque_squared_n2m2s(&self) -> f64 {
        self.inner.torque_squared_n2m2s
    }

    /// Work of the motors [J].
    #[getter]
    fn work_j(&self) -> f64 {
        self.inner.work_j
    }

    /// Work of the motors over weight times distance; None for less than 1 cm.
    #[getter]
    fn cost_of_transport(&self) -> Option<f64> {
        self.inner.cost_of_transport
    }

    /// Work of the motors over weight times height gained; None unless climbed to a greater height.
    #[getter]
    fn e_over_mgh(&self) -> Option<f64> {
        self.inner.e_over_mgh
    }

    /// Friction coefficient that sufficed in 95 of 100 averages of 10 ms.
    #[getter]
    fn required_friction(&self) -> f64 {
        self.inner.required_friction
    }

    /// Energy that the balance does not explain, over the total energy through the motors.
    #[getter]
    fn energy_residual(&self) -> f64 {
        self.inner.energy_residual
    }

    /// Root mean square over time of the distance of the base from its reference pose [m]; None without a path.
    #[getter]
    fn path_error_rms_m(&self) -> Option<f64> {
        self.inner.path_error_rms_m
    }

    /// Largest distance of the base from its reference pose [m]; None without a path.
    #[getter]
    fn path_error_peak_m(&self) -> Option<f64> {
        self.inner.path_error_peak_m
    }

    /// Time since which the base was at the end of its path [s]; None if it was elsewhere when the run ended.
    #[getter]
    fn arrived_s(&self) -> Option<f64> {
        self.inner.arrived_s
    }

    /// Distance of the base's origin from its position by odometry [m], at the end of the crossing or run.
    #[getter]
    fn odometry_error_m(&self) -> f64 {
        self.inner.odometry_error_m
    }

    /// True x of the base's origin then [m], world.
    #[getter]
    fn final_x_m(&self) -> f64 {
        self.inner.final_x_m
    }

    /// True y then [m], world.
    #[getter]
    fn final_y_m(&self) -> f64 {
        self.inner.final_y_m
    }

    /// True heading then [rad], counter-clockwise positive, -pi to pi.
    #[getter]
    fn final_yaw_rad(&self) -> f64 {
        self.inner.final_yaw_rad
    }

    /// The metrics by name.
    pub(crate) fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("verdict", self.verdict())?;
        dict.set_item("climbed", self.inner.climbed)?;
        dict.set_item("engine", self.inner.engine.name())?;
        dict.set_item("wheel_model_valid", self.inner.wheel_model_valid)?;
        dict.set_item("crossing_s", self.inner.crossing_s)?;
        dict.set_item("stalled_at_m", self.inner.stalled_at_m)?;
        dict.set_item("stalled_row", self.inner.stalled_row)?;
        dict.set_item("retries", self.inner.retries)?;
        dict.set_item("stall_s", self.inner.stall_s)?;
        dict.set_item("stall_from_s", self.inner.stall_from_s)?;
        dict.set_item("pitch_peak_deg", self.inner.pitch_peak_deg)?;
        dict.set_item("nose_down_peak_deg", self.inner.nose_down_peak_deg)?;
        dict.set_item("yaw_error_deg", self.inner.yaw_error_deg)?;
        dict.set_item("slip_rms", self.inner.slip_rms)?;
        dict.set_item("speed_error_rms", self.inner.speed_error_rms)?;
        dict.set_item("speed_error_realised_rms", self.inner.speed_error_realised_rms)?;
        dict.set_item("speed_ratio_std", self.inner.speed_ratio_std)?;
        dict.set_item("slip_speed_std", self.inner.slip_speed_std)?;
        dict.set_item("shape_error_rms_rad_s", self.inner.shape_error_rms_rad_s)?;
        dict.set_item("torque_squared_n2m2s", self.inner.torque_squared_n2m2s)?;
        dict.set_item("work_j", self.inner.work_j)?;
        dict.set_item("cost_of_transport", self.inner.cost_of_transport)?;
        dict.set_item("e_over_mgh", self.inner.e_over_mgh)?;
        dict.set_item("required_friction", self.inner.required_friction)?;
        dict.set_item("energy_residual", self.inner.energy_residual)?;
        dict.set_item("path_error_rms_m", self.inner.path_error_rms_m)?;
        dict.set_item("path_error_peak_m", self.inner.path_error_peak_m)?;
        dict.set_item("arrived_s", self.inner.arrived_s)?;
        dict.set_item("odometry_error_m", self.inner.odometry_error_m)?;
        dict.set_item("final_x_m", self.inner.final_x_m)?;
        dict.set_item("final_y_m", self.inner.final_y_m)?;
        dict.set_item("final_yaw_rad", self.inner.final_yaw_rad)?;
        dict.set_item("limited_by", self.limited_by())?;
        dict.set_item("limited_wheels", self.inner.limited_wheels)?;
        dict.set_item("touched_body", self.touched_body())?;
        dict.set_item("touched_s", self.inner.touched_s)?;
        dict.set_item("touched_x_m", self.inner.touched_x_m)?;
        dict.set_item("touched_y_m", self.inner.touched_y_m)?;
        dict.set_item("touched_depth_m", self.inner.touched_depth_m)?;
        Ok(dict)
    }

    /// Each metric's value as tables format it, and whether the command's tables show it for this run, by key.
    fn _rows(&self) -> HashMap<&'static str, (Option<String>, bool)> {
        let row = |metric: &Metric| (metric.key, (metric.shown(&self.inner), metric.is_of(&self.inner)));
        Metric::ALL.iter().map(row).collect()
    }

    fn __repr__(&self) -> String {
        let o = &self.inner;
        format!(
            "<omnistep.Outcome: {}, pitch {:.2} deg, slip rms {:.3}, speed error rms {:.3}, speed ratio std {:.3}, torque squared {:.1} N2m2s>",
            self.summary(),
            o.pitch_peak_deg,
            o.slip_rms,
            o.speed_error_rms,
            o.speed_ratio_std,
            o.torque_squared_n2m2s
        )
    }
}
