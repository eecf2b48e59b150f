//! Commands made followable: limits of speed, acceleration and jerk, a time-out, an emergency stop.

use numpy::PyArrayDyn;
use omni_core::BodyTwist;
use omni_core::shaping::{
    AxisLimits, EmergencyDeceleration, MotionLimits, ShaperState, ShapingConfig, TwistLimits,
};
use pyo3::prelude::*;

use crate::arrays::{Rows, array, as_many, each_row, fixed, flags};
use crate::error::{of_core, refused};

/// Conditions commands before they reach a vehicle's controller: limits, a time-out, an emergency stop.
///
/// The firmware's code, in float64. It is stateful; a call with T rows is the same as T calls with one row.
///
/// Args:
///     period_s: control period [s], 1e-6 to 10.
///     velocity: highest speeds of vx, vy [m/s] and wz [rad/s], 0 or more; with ``keeps_direction``, of the speed along
///         the direction of motion and of the yaw rate. No limit if left out, as for the other limits.
///     acceleration: change of velocity while the speed grows, above 0, likewise [m/s^2, rad/s^2].
///     deceleration: change of velocity while the speed shrinks, above 0, likewise.
///     jerk: change of the acceleration, above 0, likewise [m/s^3, rad/s^3].
///     keeps_direction: limits along the motion, two numbers each (linear, yaw), so that the direction is kept while
///         the speed grows; otherwise per axis, three numbers each, and the path bends while an axis lags.
///     timeout_s: greatest age of a command [s], 0 or more; an older command is replaced by rest. No time-out if left
///         out.
///     emergency_deceleration: deceleration of an emergency stop (linear [m/s^2], yaw [rad/s^2]), above 0, and the
///         most after a time-out; an immediate stop if left out.
///
/// Raises:
///     ConfigError: an argument is out of range, or has the wrong length.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> shaper = omnistep.CommandShaper(period_s=0.5, acceleration=[1.0, 1.0, 1.0], timeout_s=0.5)
///     >>> ahead = [[2.0, 0.0, 0.0]] * 4
///     >>> shaped = shaper.step(ahead, arrived=[True, False, False, False])
///     >>> shaped.twist[:, 0].tolist(), shaped.status.tolist()  # half a metre per second a period, then a time-out
///     ([0.5, 1.0, 0.0, 0.0], [2, 2, 3, 3])
#[pyclass(module = "omnistep")]
pub(crate) struct CommandShaper {
    inner: omni_core::shaping::CommandShaper<f64>,
    state: ShaperState<f64>,
    period_s: f64,
}

/// The limits of `N` motions: velocity, acceleration, deceleration, jerk; infinite if not given.
fn limits<const N: usize>(
    given: [(&'static str, Option<&Bound<'_, PyAny>>); 4],
    allowed: &'static str,
) -> PyResult<[[f64; 4]; N]> {
    let mut found = [[f64::INFINITY; 4]; N];
    for (quantity, (name, values)) in given.into_iter().enumerate() {
        if let Some(values) = values {
            let values: [f64; N] = checked(name, fixed(name, values, allowed)?)?;
            for (limits, value) in found.iter_mut().zip(values) {
                limits[quantity] = value;
            }
        }
    }
    Ok(found)
}

/// `limits` that are all in range; an error names the element, which the control library calls otherwise.
fn checked<const N: usize>(name: &str, limits: [f64; N]) -> PyResult<[f64; N]> {
    let may_be_0 = name == "velocity";
    let usable = |limit: f64| limit > 0.0 || (may_be_0 && limit == 0.0);
    let Some(at) = limits.iter().position(|limit| !usable(*limit)) else {
        return Ok(limits);
    };
    let allowed = if may_be_0 { "0 or more" } else { "> 0" };
    let message = format!(
        "{name}[{at}] = {}, allowed: {allowed} (infinity: no limit)",
        limits[at]
    );
    Err(refused(name, &message))
}

#[pymethods]
impl CommandShaper {
    #[new]
    #[pyo3(signature = (
        *, period_s, velocity = None, acceleration = None, deceleration = None, jerk = None, keeps_direction = false,
        timeout_s = None, emergency_deceleration = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python constructor")]
    fn new(
        period_s: f64,
        velocity: Option<&Bound<'_, PyAny>>,
        acceleration: Option<&Bound<'_, PyAny>>,
        deceleration: Option<&Bound<'_, PyAny>>,
        jerk: Option<&Bound<'_, PyAny>>,
        keeps_direction: bool,
        timeout_s: Option<f64>,
        emergency_deceleration: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let given = [
            ("velocity", velocity),
            ("acceleration", acceleration),
            ("deceleration", deceleration),
            ("jerk", jerk),
        ];
        let mut config = ShapingConfig::none();
        config.limits = if keeps_direction {
            let allowed = "two numbers with keeps_direction: linear and yaw";
            let [linear, yaw] =
                limits::<2>(given, allowed)?.map(|[velocity, acceleration, deceleration, jerk]| {
                    MotionLimits {
                        velocity,
                        acceleration,
                        deceleration,
                        jerk,
                    }
                });
            TwistLimits::AlongMotion { linear, yaw }
        } else {
            let allowed = "three numbers: of vx, vy and wz";
            let [vx, vy, wz] =
                limits::<3>(given, allowed)?.map(|[velocity, acceleration, deceleration, jerk]| {
                    AxisLimits::symmetric(velocity, acceleration, deceleration, jerk)
                });
            TwistLimits::PerAxis { vx, vy, wz }
        };
        config.timeout_s = timeout_s;
        let name = "emergency_deceleration";
        let brakes = emergency_deceleration
            .map(|values| checked(name, fixed::<2>(name, values, "two numbers: linear and yaw")?));
        config.emergency_deceleration =
            brakes
                .transpose()?
                .map(|[linear_m_s2, yaw_rad_s2]| EmergencyDeceleration {
                    linear_m_s2,
                    yaw_rad_s2,
                });
        let inner = omni_core::shaping::CommandShaper::new(config, period_s)
            .map_err(|error| of_core(error.parameter, &error))?;
        Ok(Self {
            inner,
            state: ShaperState::default(),
            period_s,
        })
    }

    /// One control period, or T of them, one after the other.
    ///
    /// Args:
    ///     twists: commanded body twists (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3). A command that is not a
    ///         number is rejected, and the last command remains.
    ///     arrived: whether a command arrived in the period, (T,); if none did, the row is not read. Every period if
    ///         left out.
    ///
    /// Returns:
    ///     The shaped commands.
    ///
    /// Raises:
    ///     ConfigError: a shape is wrong, or the lengths differ.
    ///     TypeError: not numbers, or ``arrived`` is not true or false.
    #[pyo3(signature = (twists, *, arrived = None))]
    fn step(
        &mut self,
        twists: &Bound<'_, PyAny>,
        arrived: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ShapedCommands> {
        let py = twists.py();
        let rows = Rows::with_gaps("twists", twists, 3)?;
        let (each, _) = rows.values.as_chunks();
        let arrived = match arrived {
            Some(arrived) => flags("arrived", arrived)?,
            None => vec![true; each.len()],
        };
        if arrived.len() != each.len() {
            let (found, expected) = (("arrived", arrived.len()), ("twists", each.len()));
            return Err(as_many(found, "value", expected));
        }
        let (inner, state) = (&self.inner, &mut self.state);
        let (mut twist, mut status, mut rejected) =
            (Vec::with_capacity(3 * each.len()), Vec::new(), Vec::new());
        each_row(py, each.len(), |i| {
            let command = arrived[i].then(|| BodyTwist::from_array(each[i]));
            let shaped = inner.step(state, command.as_ref());
            twist.extend(shaped.twist.to_array());
            // As the column `drive_command_status` has it.
            status.push(i64::from(shaped.status as u8));
            rejected.push(shaped.rejected);
        })?;
        let scalar = rows.shape_of_scalars();
        Ok(ShapedCommands {
            twist: array(py, rows.shape(3), twist)?.unbind(),
            status: array(py, scalar.clone(), status)?.unbind(),
            rejected: array(py, scalar, rejected)?.unbind(),
        })
    }

    /// Stop, regardless of commands, until :meth:`release`.
    fn emergency_stop(&mut self) {
        self.state.emergency_stop();
    }

    /// End an emergency stop; earlier commands are discarded.
    fn release(&mut self) {
        self.state.release();
    }

    /// An emergency stop is active.
    #[getter]
    fn stopped(&self) -> bool {
        self.state.is_stopped()
    }

    /// Reset to the initial state: at rest, without a command.
    fn reset(&mut self) {
        self.state = ShaperState::default();
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.period_s
    }

    fn __repr__(&self) -> String {
        let stopped = if self.state.is_stopped() { ", stopped" } else { "" };
        format!("<omnistep.CommandShaper every {} s{stopped}>", self.period_s)
    }
}

/// Result of :meth:`CommandShaper.step`, for one command or for T commands.
#[pyclass(frozen, get_all, module = "omnistep")]
pub(crate) struct ShapedCommands {
    /// Twists within the limits (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3); always finite.
    twist: Py<PyArrayDyn<f64>>,
    /// 0 idle, 1 following, 2 limited, 3 timed out, 4 emergency stop, () or (T,).
    status: Py<PyArrayDyn<i64>>,
    /// A command arrived that is not finite or beyond reason, () or (T,).
    rejected: Py<PyArrayDyn<bool>>,
}

#[pymethods]
impl ShapedCommands {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (twist, status) = (self.twist.bind(py).repr()?, self.status.bind(py).repr()?);
        Ok(format!(
            "<omnistep.ShapedCommands: twist {twist}, status {status}>"
        ))
    }
}
