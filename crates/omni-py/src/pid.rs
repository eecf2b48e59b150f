//! One PID loop, step by step and over arrays.

use numpy::PyArrayDyn;
use omni_core::loops::{AntiWindup, FeedForward, IntegrationOrder, PidState};
use omni_core::motor::TorqueRange;
use omni_core::{PidConfig, PidGains};
use pyo3::prelude::*;
use toml::Value;

use crate::arrays::{array, choice, each_row, floats, together};
use crate::error::{of_core, refused};
use crate::values::from_python;

/// A PID loop on an actuator's velocity, eq. (10) of the paper, with its state.
///
/// ``u = kp e + ki (integral of e) + kd e'`` with ``e = reference - measured``; integrals and derivatives are backward
/// differences. The firmware's code, in float64.
///
/// Args:
///     kp_n_m_s_rad: proportional gain [N.m per rad/s], 0 to 1e6.
///     ki_n_m_rad: integral gain [N.m per rad], 0 to 1e6.
///     kd_n_m_s2_rad: derivative gain [N.m per rad/s^2], 0 to 1e6.
///     period_s: control period [s], 1e-6 to 10.
///     proportional_weight: weight of the reference in the proportional term, 0 to 1.
///     derivative_weight: weight of the reference in the derivative term, 0 to 1: 0 is the derivative of the
///         measurement alone.
///     derivative_filter_s: time constant of the derivative's filter [s], 0 to 1000.
///     static_friction_n_m: feed-forward in the direction of the reference [N.m], 0 to 1e6.
///     viscous_friction_n_m_s_rad: feed-forward by the reference [N.m per rad/s], 0 to 1e6.
///     inertia_n_m_s2_rad: feed-forward by the reference's change [N.m per rad/s^2], 0 to 1e6.
///     order: whether the integral includes the present error before or after the output is formed.
///     anti_windup: treatment of the integral while the output is limited: ``"conditioned"`` (the default),
///         ``"conditional"``, ``"none"``, ``{"clamp": {"limit_n_m": 1.0}}`` with the largest integral term [N.m], 0 to
///         1e9, or ``{"back_calculation": {"tracking_time_s": 0.1}}`` with a time constant [s], the period to 1e6.
///     integral_zone_rad_s: the integral accumulates errors of at most this [rad/s], 0 or more; a larger error resets
///         it to 0 (WPILib's ``IZone``).
///     proportional_limit_n_m: largest proportional term [N.m], 0 or more.
///     output_n_m: lowest (<= 0) and highest (>= 0) output [N.m].
///
/// Raises:
///     ConfigError: an argument is out of range, unknown, or not compatible with another.
///
/// Example:
///     >>> import omnistep
///     >>> pid = omnistep.Pid(kp_n_m_s_rad=2.0, ki_n_m_rad=10.0, period_s=0.1)
///     >>> pid.step([1.0, 1.0], 0.0).output_n_m.tolist()  # 2 * 1 + 10 * (0.1 * 1), then more
///     [3.0, 4.0]
#[pyclass(module = "omnistep")]
pub(crate) struct Pid {
    config: PidConfig<f64>,
    inner: omni_core::loops::Pid<f64>,
    state: PidState<f64>,
}

/// What a parameter of the control library is called here.
fn argument(parameter: &'static str) -> &'static str {
    match parameter {
        "output.lower_n_m" | "output.upper_n_m" => "output_n_m",
        "static_n_m" => "static_friction_n_m",
        "velocity_n_m_s_rad" => "viscous_friction_n_m_s_rad",
        "acceleration_n_m_s2_rad" => "inertia_n_m_s2_rad",
        "limit_n_m" => "anti_windup.clamp.limit_n_m",
        "tracking_time_s" => "anti_windup.back_calculation.tracking_time_s",
        same => same,
    }
}

/// `anti_windup` as a file has it: a name, or a name with its key.
struct AntiWindupArg(AntiWindup<f64>);

impl Default for AntiWindupArg {
    fn default() -> Self {
        Self(AntiWindup::Conditioned)
    }
}

impl<'py> FromPyObject<'_, 'py> for AntiWindupArg {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let value = from_python("Pid", "anti_windup", &given)?;
        let number = |keys: &Value, key: &str| {
            let keys = keys.as_table().filter(|keys| keys.len() == 1)?;
            let value = keys.get(key)?;
            value
                .as_float()
                .or(value.as_integer().map(|integer| integer as f64))
        };
        let with_key = |name: &str, keys: &Value| match name {
            "clamp" => number(keys, "limit_n_m").map(|limit_n_m| AntiWindup::Clamp { limit_n_m }),
            "back_calculation" => number(keys, "tracking_time_s")
                .map(|tracking_time_s| AntiWindup::BackCalculation { tracking_time_s }),
            _ => None,
        };
        let law = match &value {
            Value::String(name) => match name.as_str() {
                "none" => Some(AntiWindup::None),
                "conditional" => Some(AntiWindup::Conditional),
                "conditioned" => Some(AntiWindup::Conditioned),
                _ => None,
            },
            Value::Table(law) if law.len() == 1 => law.iter().find_map(|(name, keys)| with_key(name, keys)),
            _ => None,
        };
        let allowed = "conditioned, conditional, none, {\"clamp\": {\"limit_n_m\": number}} or \
                       {\"back_calculation\": {\"tracking_time_s\": number}}";
        let message = || format!("anti_windup = {value}, allowed: {allowed}");
        law.map(Self).ok_or_else(|| refused("anti_windup", &message()))
    }
}

#[pymethods]
impl Pid {
    #[new]
    #[pyo3(signature = (
        *, kp_n_m_s_rad, ki_n_m_rad = 0.0, kd_n_m_s2_rad = 0.0, period_s, proportional_weight = 1.0,
        derivative_weight = 1.0, derivative_filter_s = 0.0, static_friction_n_m = 0.0,
        viscous_friction_n_m_s_rad = 0.0, inertia_n_m_s2_rad = 0.0, order = "before_output",
        anti_windup = AntiWindupArg::default(),
        integral_zone_rad_s = f64::INFINITY, proportional_limit_n_m = f64::INFINITY,
        output_n_m = (f64::NEG_INFINITY, f64::INFINITY)
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python constructor")]
    fn new(
        kp_n_m_s_rad: f64,
        ki_n_m_rad: f64,
        kd_n_m_s2_rad: f64,
        period_s: f64,
        proportional_weight: f64,
        derivative_weight: f64,
        derivative_filter_s: f64,
        static_friction_n_m: f64,
        viscous_friction_n_m_s_rad: f64,
        inertia_n_m_s2_rad: f64,
        order: &str,
        anti_windup: AntiWindupArg,
        integral_zone_rad_s: f64,
        proportional_limit_n_m: f64,
        output_n_m: (f64, f64),
    ) -> PyResult<Self> {
        let order = choice(
            "order",
            order,
            &[
                ("before_output", IntegrationOrder::BeforeOutput),
                ("after_output", IntegrationOrder::AfterOutput),
            ],
        )?;
        let gains = PidGains {
            kp_n_m_s_rad,
            ki_n_m_rad,
            kd_n_m_s2_rad,
        };
        let mut config = PidConfig::new(gains, period_s);
        config.proportional_weight = proportional_weight;
        config.derivative_weight = derivative_weight;
        config.derivative_filter_s = derivative_filter_s;
        config.feed_forward = FeedForward {
            static_n_m: static_friction_n_m,
            velocity_n_m_s_rad: viscous_friction_n_m_s_rad,
            acceleration_n_m_s2_rad: inertia_n_m_s2_rad,
        };
        config.order = order;
        config.anti_windup = anti_windup.0;
        config.integral_zone_rad_s = integral_zone_rad_s;
        config.proportional_limit_n_m = proportional_limit_n_m;
        config.output = TorqueRange {
            lower_n_m: output_n_m.0,
            upper_n_m: output_n_m.1,
        };
        let inner =
            omni_core::loops::Pid::new(config).map_err(|error| of_core(argument(error.parameter), &error))?;
        Ok(Self {
            config,
            inner,
            state: PidState::default(),
        })
    }

    /// One step, or T of them, one after the other.
    ///
    /// Args:
    ///     reference_rad_s: reference [rad/s], a number or (T,); one number stays the same for every step.
    ///     measured_rad_s: measurement [rad/s], likewise. NaN, or more than 1e6 rad/s, leaves the state unchanged and
    ///         yields the integral term alone.
    ///
    /// Returns:
    ///     Output and terms, () or (T,).
    ///
    /// Raises:
    ///     ConfigError: the lengths differ.
    ///     TypeError: not numbers.
    fn step(
        &mut self,
        reference_rad_s: &Bound<'_, PyAny>,
        measured_rad_s: &Bound<'_, PyAny>,
    ) -> PyResult<PidSample> {
        let py = reference_rad_s.py();
        let (references, shape) = floats("reference_rad_s", reference_rad_s)?;
        let (measured, measured_shape) = floats("measured_rad_s", measured_rad_s)?;
        let (a, b) = (shape.first().copied(), measured_shape.first().copied());
        let count = together("number", ("references", a), ("measured_rad_s", b))?;
        let steps = count.unwrap_or(1);
        let (pid, state) = (&self.inner, &mut self.state);
        let mut columns: [Vec<f64>; 5] = Default::default();
        let mut saturated = Vec::with_capacity(steps);
        // What is one number stays the same.
        let pick = |values: &[f64], i: usize| values[i.min(values.len() - 1)];
        each_row(py, steps, |i| {
            let sample = pid.step(state, pick(&references, i), pick(&measured, i));
            let terms = sample.terms;
            let row = [
                sample.output_n_m,
                terms.p_n_m,
                terms.i_n_m,
                terms.d_n_m,
                terms.ff_n_m,
            ];
            columns
                .iter_mut()
                .zip(row)
                .for_each(|(column, value)| column.push(value));
            saturated.push(sample.saturated);
        })?;
        let shape: Vec<usize> = count.into_iter().collect();
        let [output, p, i, d, ff] = columns;
        let column = |values| Ok::<_, PyErr>(array(py, shape.clone(), values)?.unbind());
        Ok(PidSample {
            output_n_m: column(output)?,
            p_n_m: column(p)?,
            i_n_m: column(i)?,
            d_n_m: column(d)?,
            ff_n_m: column(ff)?,
            saturated: array(py, shape.clone(), saturated)?.unbind(),
        })
    }

    /// Bumpless transfer: the next step with this reference and measurement yields ``output_n_m`` [N.m].
    ///
    /// Without an integral gain, or with an error beyond the integral zone, this has no effect, and the output may
    /// jump.
    ///
    /// Raises:
    ///     ConfigError: a number is not finite.
    #[pyo3(signature = (output_n_m, *, reference_rad_s, measured_rad_s))]
    fn track(&mut self, output_n_m: f64, reference_rad_s: f64, measured_rad_s: f64) -> PyResult<()> {
        for (name, value) in [
            ("output_n_m", output_n_m),
            ("reference_rad_s", reference_rad_s),
            ("measured_rad_s", measured_rad_s),
        ] {
            if !value.is_finite() {
                return Err(refused(name, &format!("{name} = {value}, allowed: finite")));
            }
        }
        self.inner
            .track(&mut self.state, output_n_m, reference_rad_s, measured_rad_s);
        Ok(())
    }

    /// Return to the initial state.
    fn reset(&mut self) {
        self.state = PidState::default();
    }

    /// State of the integral [N.m].
    #[getter]
    fn integral_n_m(&self) -> f64 {
        self.state.integral_n_m
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.config.period_s
    }

    fn __repr__(&self) -> String {
        let gains = &self.config.gains;
        format!(
            "<omnistep.Pid: kp {} N.m.s/rad, ki {} N.m/rad, kd {} N.m.s2/rad, every {} s>",
            gains.kp_n_m_s_rad, gains.ki_n_m_rad, gains.kd_n_m_s2_rad, self.config.period_s
        )
    }
}

/// Result of :meth:`Pid.step`: arrays () for one step, (T,) for many.
#[pyclass(frozen, get_all, module = "omnistep")]
pub(crate) struct PidSample {
    /// Output within the limits [N.m].
    output_n_m: Py<PyArrayDyn<f64>>,
    /// Proportional term [N.m].
    p_n_m: Py<PyArrayDyn<f64>>,
    /// Integral term [N.m].
    i_n_m: Py<PyArrayDyn<f64>>,
    /// Derivative term [N.m].
    d_n_m: Py<PyArrayDyn<f64>>,
    /// Feed-forward [N.m].
    ff_n_m: Py<PyArrayDyn<f64>>,
    /// The limits reduced the output.
    saturated: Py<PyArrayDyn<bool>>,
}

#[pymethods]
impl PidSample {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (output, saturated) = (self.output_n_m.bind(py).repr()?, self.saturated.bind(py).repr()?);
        Ok(format!(
            "<omnistep.PidSample: output_n_m {output}, saturated {saturated}>"
        ))
    }
}
