//! Encoders over arrays: counters that wrap, velocities out of counts.

use omni_core::estimate::{CounterState, LONGEST_WINDOW, VelocityConfig, VelocityMethod, VelocityState};
use pyo3::prelude::*;

use crate::arrays::{Array, Rows, array, choice, each_row, floats};
use crate::error::{of_core, refused};

/// One encoder, or several beside each other.
#[derive(Clone, Copy)]
struct Beside(Option<usize>);

impl Beside {
    fn new(wheels: Option<usize>) -> PyResult<Self> {
        match wheels {
            Some(count) if !(1..=1000).contains(&count) => Err(refused(
                "wheels",
                &format!("wheels = {count}, allowed: 1 to 1000, or none for numbers instead of rows"),
            )),
            _ => Ok(Self(wheels)),
        }
    }

    fn count(self) -> usize {
        self.0.unwrap_or(1)
    }

    /// Shape of one number an encoder.
    fn shape(self) -> Vec<usize> {
        self.0.into_iter().collect()
    }

    /// Numbers row by row, and their shape. NaN and infinities pass.
    fn read(self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
        let Some(wheels) = self.0 else {
            return floats(name, value);
        };
        let rows = Rows::with_gaps(name, value, wheels)?;
        let shape = rows.shape(wheels);
        Ok((rows.values, shape))
    }

    /// [`Beside::read`] of whole numbers from `least` to `most`.
    fn whole(
        self,
        name: &str,
        value: &Bound<'_, PyAny>,
        least: i64,
        most: i64,
    ) -> PyResult<(Vec<i64>, Vec<usize>)> {
        let (values, shape) = self.read(name, value)?;
        let allowed = least as f64..=most as f64;
        let bad = |value: &f64| !(allowed.contains(value) && value.fract() == 0.0);
        let Some(at) = values.iter().position(bad) else {
            return Ok((values.iter().map(|value| *value as i64).collect(), shape));
        };
        let index = match shape.len() {
            0 => String::new(),
            1 => format!("[{at}]"),
            _ => format!("[{}, {}]", at / self.count(), at % self.count()),
        };
        let message = format!(
            "{name}{index} = {}, allowed: whole numbers, {least} to {most}",
            values[at]
        );
        Err(refused(name, &message))
    }
}

/// Decodes incremental encoders whose hardware counters wrap around, at any width, and accumulates the counts.
///
/// Args:
///     counts_per_turn: counted edges per turn of the measured shaft, 1 to 1e9 (four per line of a quadrature encoder),
///         times the gear ratio if the encoder sits before the gear.
///     bits: width of the counter, 2 to 32.
///     wheels: number of encoders side by side, 1 to 1000; if left out, a single encoder, with numbers instead of rows.
///
/// Raises:
///     ConfigError: an argument is out of range.
///
/// Example:
///     >>> import omnistep
///     >>> encoder = omnistep.EncoderCounter(counts_per_turn=360.0, bits=16)
///     >>> encoder.update([65_530, 65_534, 2, 65_535]).tolist(), int(encoder.counts)  # across the wrap, and back
///     ([0, 4, 4, -3], 5)
#[pyclass(module = "omnistep")]
pub(crate) struct EncoderCounter {
    inner: omni_core::estimate::EncoderCounter<f64>,
    beside: Beside,
    states: Vec<CounterState>,
}

#[pymethods]
impl EncoderCounter {
    #[new]
    #[pyo3(signature = (*, counts_per_turn, bits, wheels = None))]
    fn new(counts_per_turn: f64, bits: u32, wheels: Option<usize>) -> PyResult<Self> {
        let inner = omni_core::estimate::EncoderCounter::new(counts_per_turn, bits)
            .map_err(|error| of_core(error.parameter, &error))?;
        let beside = Beside::new(wheels)?;
        Ok(Self {
            inner,
            beside,
            states: vec![CounterState::default(); beside.count()],
        })
    }

    /// Process readings in order; return the counts since the previous reading, positive forwards, 0 for the first.
    ///
    /// A wrap-around counts in the shorter direction, so read a counter at least once per half of its range.
    ///
    /// Args:
    ///     readings: whole numbers, -2147483648 to 4294967295, a number or (T,); of several encoders (N,) or (T, N).
    ///         Bits beyond the counter's width are ignored.
    ///
    /// Returns:
    ///     Counts in the shape of ``readings``.
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong, or a number is not whole or out of range.
    ///     TypeError: not numbers.
    fn update<'py>(&mut self, readings: &Bound<'py, PyAny>) -> PyResult<Array<'py, i64>> {
        let py = readings.py();
        let (readings, shape) =
            self.beside
                .whole("readings", readings, i64::from(i32::MIN), i64::from(u32::MAX))?;
        let (inner, states) = (&self.inner, &mut self.states);
        let mut counts = Vec::with_capacity(readings.len());
        each_row(py, readings.len(), |i| {
            let wheel = i % states.len();
            // A signed counter is taken as its bits.
            counts.push(i64::from(inner.update(&mut states[wheel], readings[i] as u32)));
        })?;
        array(py, shape, counts)
    }

    /// Counts since the first reading, () or (N,).
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, i64>> {
        let counts = self.states.iter().map(CounterState::counts).collect();
        array(py, self.beside.shape(), counts)
    }

    /// Angle since the first reading [rad], () or (N,).
    #[getter]
    fn angle_rad<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let angles = self.states.iter().map(|state| self.inner.angle_rad(state));
        array(py, self.beside.shape(), angles.collect())
    }

    /// Angle of one count [rad].
    #[getter]
    fn count_rad(&self) -> f64 {
        self.inner.count_rad()
    }

    /// Reset to the initial state, before the first reading.
    fn reset(&mut self) {
        self.states.fill(CounterState::default());
    }

    fn __repr__(&self) -> String {
        let counts: Vec<i64> = self.states.iter().map(CounterState::counts).collect();
        format!(
            "<omnistep.EncoderCounter: {:.9} rad a count, {counts:?} counted>",
            self.inner.count_rad()
        )
    }
}

/// Estimates velocities from the integer counts of coarse encoders. The firmware's code, in float64.
///
/// When counts stop, the velocity falls: it is at most one count over the time without counts. With a count of angle d,
/// a period T and a wheel that turns steadily, a window of n periods is off by at most d / (n T) and lags by n T / 2;
/// an observer is off by at most d bandwidth / e and lags by 2 / bandwidth.
///
/// Args:
///     count_rad: angle of one count [rad], 1e-9 to 7.
///     period_s: control period [s], 1e-6 to 10.
///     method: ``window``, the counts of the last ``periods`` over their time; ``edges``, the counts between the last
///         edges of two periods over the time between them (the M/T method); or ``observer``, which follows the
///         counted angle with both poles at ``bandwidth_rad_s``.
///     periods: length of a window in periods, 1 to 32; 1 if left out.
///     bandwidth_rad_s: bandwidth of an observer [rad/s], 0.001 to 1 over the period.
///     wheels: number of wheels side by side, 1 to 1000; if left out, a single wheel, with numbers instead of rows.
///
/// Raises:
///     ConfigError: an argument is out of range, unknown, or not compatible with another.
///
/// Example:
///     >>> import math, omnistep
///     >>> estimator = omnistep.VelocityEstimator(count_rad=math.radians(1.0), period_s=0.001, periods=4)
///     >>> estimator.step([1, 0, 0, 0]).round(3).tolist()  # a degree in 4 ms; before the window is full too
///     [4.363, 4.363, 4.363, 4.363]
#[pyclass(module = "omnistep")]
pub(crate) struct VelocityEstimator {
    inner: omni_core::estimate::VelocityEstimator<f64, LONGEST_WINDOW>,
    config: VelocityConfig<f64>,
    beside: Beside,
    states: Vec<VelocityState<f64, LONGEST_WINDOW>>,
}

#[pymethods]
impl VelocityEstimator {
    #[new]
    #[pyo3(signature = (
        *, count_rad, period_s, method = "window", periods = None, bandwidth_rad_s = None, wheels = None
    ))]
    fn new(
        count_rad: f64,
        period_s: f64,
        method: &str,
        periods: Option<u16>,
        bandwidth_rad_s: Option<f64>,
        wheels: Option<usize>,
    ) -> PyResult<Self> {
        let window = VelocityMethod::Window {
            periods: periods.unwrap_or(1),
        };
        let observer = VelocityMethod::Observer {
            bandwidth_rad_s: bandwidth_rad_s.unwrap_or(f64::NAN),
        };
        let chosen = choice(
            "method",
            method,
            &[
                ("window", window),
                ("edges", VelocityMethod::Edges),
                ("observer", observer),
            ],
        )?;
        let only_with = |name: &str, given: bool, with: &str| {
            if given && method != with {
                let message =
                    format!("{name} is given with method = {method:?}, allowed: only with {with:?}");
                return Err(refused(name, &message));
            }
            Ok(())
        };
        only_with("periods", periods.is_some(), "window")?;
        only_with("bandwidth_rad_s", bandwidth_rad_s.is_some(), "observer")?;
        if method == "observer" && bandwidth_rad_s.is_none() {
            let message = "bandwidth_rad_s is not given, allowed: 0.001 to 1 over the period with method = \"observer\"";
            return Err(refused("bandwidth_rad_s", message));
        }
        let config = VelocityConfig {
            method: chosen,
            count_rad,
            period_s,
        };
        let inner = omni_core::estimate::VelocityEstimator::new(config)
            .map_err(|error| of_core(error.parameter, &error))?;
        let beside = Beside::new(wheels)?;
        Ok(Self {
            inner,
            config,
            beside,
            states: vec![VelocityState::default(); beside.count()],
        })
    }

    /// One control period, or T of them, one after the other.
    ///
    /// Args:
    ///     counts: counts of each period, whole numbers, positive forwards, a number or (T,); of several wheels (N,) or
    ///         (T, N).
    ///     since_edge_s: time from the last edge to the end of the period [s], in that shape, which ``edges`` uses. If
    ///         it is NaN, or not within the period, it counts as 0, as if left out.
    ///
    /// Returns:
    ///     Velocities [rad/s] in the shape of ``counts``; always finite.
    ///
    /// Raises:
    ///     ConfigError: a shape is wrong, or a count is not whole or beyond 32 bits.
    ///     TypeError: not numbers.
    #[pyo3(signature = (counts, *, since_edge_s = None))]
    fn step<'py>(
        &mut self,
        counts: &Bound<'py, PyAny>,
        since_edge_s: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py, f64>> {
        let py = counts.py();
        let (counts, shape) =
            self.beside
                .whole("counts", counts, i64::from(i32::MIN), i64::from(i32::MAX))?;
        let ages = match since_edge_s {
            Some(given) => {
                let (ages, found) = self.beside.read("since_edge_s", given)?;
                if found != shape {
                    let message = format!(
                        "since_edge_s = an array of shape {found:?}, allowed: the shape of counts, {shape:?}"
                    );
                    return Err(refused("since_edge_s", &message));
                }
                Some(ages)
            }
            None => None,
        };
        let (inner, states) = (&self.inner, &mut self.states);
        let mut velocities = Vec::with_capacity(counts.len());
        each_row(py, counts.len(), |i| {
            let wheel = i % states.len();
            // Within the range of i32, as was seen to; a time that is NaN is none.
            let age = ages.as_ref().map(|ages| ages[i]).filter(|age| !age.is_nan());
            velocities.push(inner.step(&mut states[wheel], counts[i] as i32, age));
        })?;
        array(py, shape, velocities)
    }

    /// Control period [s].
    #[getter]
    fn period_s(&self) -> f64 {
        self.config.period_s
    }

    /// Angle of one count [rad].
    #[getter]
    fn count_rad(&self) -> f64 {
        self.config.count_rad
    }

    /// Reset to the initial state: at rest.
    fn reset(&mut self) {
        self.states.fill(VelocityState::default());
    }

    fn __repr__(&self) -> String {
        let method = match self.config.method {
            VelocityMethod::Window { periods } => format!("window of {periods} periods"),
            VelocityMethod::Observer { bandwidth_rad_s } => format!("observer of {bandwidth_rad_s} rad/s"),
            _ => "edges".into(),
        };
        format!(
            "<omnistep.VelocityEstimator: {method}, {:.9} rad a count, every {} s>",
            self.config.count_rad, self.config.period_s
        )
    }
}
