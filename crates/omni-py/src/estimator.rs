//! The estimator over arrays.

use omni_core::estimate::EstimatorConfig;
use pyo3::prelude::*;

use crate::arrays::{Array, Rows, STEPS_PER_LOOK, array, as_many_or_one, fixed, flags, floats};
use crate::error::refused;
use crate::estimate::{Beside, Estimate};
use crate::kinematics::Kinematics;

/// Estimates the pose and its covariance from wheels, gyro and accelerometer, also while wheels slip.
///
/// An extended Kalman filter with the common slip of all wheels as a state. Redundancy cannot detect that slip, but an
/// accelerometer can. Wheels that disagree are weighted less. If the vehicle is commanded to rest and is at rest, its
/// velocity is 0, and the filter then estimates the biases of gyro and accelerometer. NaN marks a missing reading,
/// which is left out.
///
/// Args:
///     kinematics: the map from wheel velocities to the vehicle's motion.
///     period_s: time between two steps [s], 1e-6 to 10.
///     wheel_rad_s: noise of a wheel's velocity [rad/s], a standard deviation like every noise below; 0.1.
///     gyro_rad_s: noise of the yaw rate [rad/s]; 0.01.
///     accelerometer_m_s2: noise of each acceleration [m/s^2]; 0.05.
///     wander_m_s_per_sqrt_s: random walk of the velocity without an acceleration reading [m/s per root of s]; 0.3.
///     bias_rad_s: standard deviation of the gyro bias at the start [rad/s]; 0.02.
///     bias_walk_rad_s_per_sqrt_s: random walk of the bias [rad/s per root of s]; 1e-4.
///     accelerometer_bias_m_s2: standard deviation of the accelerometer's bias at the start, or of what a lean adds
///         that is not measured [m/s^2]; 0.05.
///     accelerometer_bias_walk_m_s2_per_sqrt_s: random walk of it [m/s^2 per root of s]; 0.01.
///     slip_m_s: slip of the whole vehicle while its wheels agree [m/s]; 0.001.
///     slip_s: correlation time of the slip [s]; 0.2.
///     still_wheel_rad_s: commanded to rest, the vehicle counts as at rest if its wheels turn no faster than this,
///         beyond noise, on average over 50 ms [rad/s], 0 to 1000; 0.05.
///     still_gyro_rad_s: and if the gyro stays within this range of its own average, which may lie anywhere within four
///         deviations of the estimated bias [rad/s], 0 to 1000; 0.05.
///     still_m_s2: and if each acceleration is at most this beyond four deviations of its bias, on average
///         [m/s^2], 0 to 1000; 0.1.
///
/// Raises:
///     ConfigError: a value is out of range.
///
/// Example:
///     >>> import omnistep
///     >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.5, track_m=0.4, radius_m=0.1)
///     >>> kinematics = omnistep.Kinematics(layout=layout)
///     >>> estimator = omnistep.Estimator(kinematics=kinematics, period_s=0.001, accelerometer_bias_m_s2=1e-4)
///     >>> spinning = [[10.0] * 4] * 1000  # at 1 m/s for a second, on ice: the vehicle follows at 0.5 m/s^2
///     >>> poses = estimator.step(spinning, yaw_rates=0.0, accelerations=[0.5, 0.0])
///     >>> abs(float(poses[-1, 0]) - 0.25) < 0.01, abs(float(estimator.slip[0]) - 0.5) < 0.02
///     (True, True)
#[pyclass(module = "omnistep")]
pub(crate) struct Estimator {
    wheels: usize,
    filter: Box<dyn Estimate>,
    nis: Vec<f64>,
    nis_shape: Vec<usize>,
}

/// As many values as there are rows, a single one standing for all.
fn each(name: &str, found: usize, rows: usize) -> PyResult<()> {
    if found == rows || found == 1 {
        Ok(())
    } else {
        Err(as_many_or_one((name, found), "row", ("wheels", rows)))
    }
}

#[pymethods]
impl Estimator {
    #[new]
    #[pyo3(signature = (*, kinematics, period_s, wheel_rad_s = None, gyro_rad_s = None, accelerometer_m_s2 = None,
        wander_m_s_per_sqrt_s = None, bias_rad_s = None, bias_walk_rad_s_per_sqrt_s = None, accelerometer_bias_m_s2 = None,
        accelerometer_bias_walk_m_s2_per_sqrt_s = None, slip_m_s = None, slip_s = None, still_wheel_rad_s = None, still_gyro_rad_s = None, still_m_s2 = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords, each with a name")]
    fn new(
        kinematics: &Bound<'_, Kinematics>,
        period_s: f64,
        wheel_rad_s: Option<f64>,
        gyro_rad_s: Option<f64>,
        accelerometer_m_s2: Option<f64>,
        wander_m_s_per_sqrt_s: Option<f64>,
        bias_rad_s: Option<f64>,
        bias_walk_rad_s_per_sqrt_s: Option<f64>,
        accelerometer_bias_m_s2: Option<f64>,
        accelerometer_bias_walk_m_s2_per_sqrt_s: Option<f64>,
        slip_m_s: Option<f64>,
        slip_s: Option<f64>,
        still_wheel_rad_s: Option<f64>,
        still_gyro_rad_s: Option<f64>,
        still_m_s2: Option<f64>,
    ) -> PyResult<Self> {
        let mut config = EstimatorConfig::new(period_s);
        for (to, given) in [
            (&mut config.wheel_rad_s, wheel_rad_s),
            (&mut config.gyro_rad_s, gyro_rad_s),
            (&mut config.accelerometer_m_s2, accelerometer_m_s2),
            (&mut config.wander_m_s_per_sqrt_s, wander_m_s_per_sqrt_s),
            (&mut config.bias_rad_s, bias_rad_s),
            (&mut config.bias_walk_rad_s_per_sqrt_s, bias_walk_rad_s_per_sqrt_s),
            (&mut config.accelerometer_bias_m_s2, accelerometer_bias_m_s2),
            (
                &mut config.accelerometer_bias_walk_m_s2_per_sqrt_s,
                accelerometer_bias_walk_m_s2_per_sqrt_s,
            ),
            (&mut config.slip_m_s, slip_m_s),
            (&mut config.slip_s, slip_s),
            (&mut config.still_wheel_rad_s, still_wheel_rad_s),
            (&mut config.still_gyro_rad_s, still_gyro_rad_s),
            (&mut config.still_m_s2, still_m_s2),
        ] {
            *to = given.unwrap_or(*to);
        }
        let kinematics = kinematics.get();
        Ok(Self {
            wheels: kinematics.wheel_count(),
            filter: kinematics.estimate(config)?,
            nis: Vec::new(),
            nis_shape: vec![0],
        })
    }

    /// The pose now, (3,).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3], self.filter.pose().to_vec())
    }

    /// The vehicle's estimated twist now, not the twist of its wheels, (3,).
    #[getter]
    fn twist<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3], self.filter.twist().to_vec())
    }

    /// Common slip of all wheels: their twist less the vehicle's twist, (3,).
    #[getter]
    fn slip<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3], self.filter.slip().to_vec())
    }

    /// Covariance of the pose, (3, 3), in x [m], y [m] and yaw [rad].
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![3, 3], self.filter.covariance().as_flattened().to_vec())
    }

    /// Estimated reading of the gyro at rest [rad/s].
    #[getter]
    fn gyro_bias_rad_s(&self) -> f64 {
        self.filter.bias()
    }

    /// Estimated readings of the accelerometer at rest, forward and to the left [m/s^2], (2,).
    #[getter]
    fn accelerometer_bias_m_s2<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, vec![2], self.filter.accelerometer_bias().to_vec())
    }

    /// Normalised squared innovation per row of the last step, over the wheels used: 1 on average; NaN if none.
    #[getter]
    fn nis<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        array(py, self.nis_shape.clone(), self.nis.clone())
    }

    /// Process one period per row.
    ///
    /// Args:
    ///     wheels: actuator velocities [rad/s], (N,) or (T, N).
    ///     yaw_rates: yaw rate from the gyro [rad/s], one or (T,); none by default.
    ///     accelerations: horizontal accelerations without gravity, along the heading and to its left [m/s^2], (2,) or
    ///         (T, 2); none by default.
    ///     commanded_rest: the vehicle is commanded to rest, one or (T,); False by default.
    ///
    /// Returns:
    ///     The pose after each, (3,) or (T, 3).
    ///
    /// Raises:
    ///     ConfigError: a shape is wrong.
    ///     TypeError: not numbers.
    #[pyo3(signature = (wheels, *, yaw_rates = None, accelerations = None, commanded_rest = None))]
    fn step<'py>(
        &mut self,
        wheels: &Bound<'py, PyAny>,
        yaw_rates: Option<&Bound<'py, PyAny>>,
        accelerations: Option<&Bound<'py, PyAny>>,
        commanded_rest: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array<'py, f64>> {
        let py = wheels.py();
        let rows = Rows::with_gaps("wheels", wheels, self.wheels)?;
        let count = rows.len();
        let yaw_rates = match yaw_rates {
            Some(given) => floats("yaw_rates", given)?.0,
            None => vec![f64::NAN],
        };
        let accelerations = match accelerations {
            Some(given) => Rows::with_gaps("accelerations", given, 2)?.values,
            None => vec![f64::NAN; 2],
        };
        let rests = match commanded_rest {
            Some(given) => flags("commanded_rest", given)?,
            None => vec![false],
        };
        each("yaw_rates", yaw_rates.len(), count)?;
        each("accelerations", accelerations.len() / 2, count)?;
        each("commanded_rest", rests.len(), count)?;
        let (filter, width) = (&mut *self.filter, self.wheels);
        let accelerations: &[[f64; 2]] = accelerations.as_chunks().0;
        let (poses, nis) = py.detach(|| -> PyResult<_> {
            let (mut poses, mut nis) = (Vec::with_capacity(3 * count), Vec::with_capacity(count));
            let last = |values: usize, k: usize| k.min(values.saturating_sub(1));
            for (k, row) in rows.values.chunks_exact(width).enumerate() {
                let beside = Beside {
                    yaw_rate_rad_s: yaw_rates
                        .get(last(yaw_rates.len(), k))
                        .copied()
                        .unwrap_or(f64::NAN),
                    acceleration_m_s2: accelerations
                        .get(last(accelerations.len(), k))
                        .copied()
                        .unwrap_or([f64::NAN; 2]),
                    commanded_rest: rests.get(last(rests.len(), k)).copied().unwrap_or(false),
                };
                let came = filter.step(row, &beside);
                poses.extend(came.pose);
                nis.push(if came.readings > 0 {
                    came.nis / came.readings as f64
                } else {
                    f64::NAN
                });
                if k % STEPS_PER_LOOK == STEPS_PER_LOOK - 1 {
                    Python::attach(|py| py.check_signals())?;
                }
            }
            Ok((poses, nis))
        })?;
        (self.nis, self.nis_shape) = (nis, rows.shape_of_scalars());
        array(py, rows.shape(3), poses)
    }

    /// Set the pose and its uncertainty; the yaw is wrapped.
    ///
    /// Args:
    ///     pose: x [m], y [m], yaw [rad].
    ///     pose_deviations: standard deviations of x, y and yaw; 0 (known exactly) by default.
    ///
    /// Raises:
    ///     ConfigError: not three finite numbers, or a deviation that is not valid.
    ///     TypeError: not numbers.
    #[pyo3(signature = (pose, *, pose_deviations = None))]
    fn reset(&mut self, pose: &Bound<'_, PyAny>, pose_deviations: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        const ALLOWED: &str = "three finite numbers, x [m], y [m], yaw [rad]";
        let pose: [f64; 3] = fixed("pose", pose, ALLOWED)?;
        let deviations = match pose_deviations {
            Some(given) => fixed("pose_deviations", given, "three finite numbers >= 0")?,
            None => [0.0; 3],
        };
        if self.filter.reset(pose, deviations)? {
            Ok(())
        } else {
            Err(refused("pose", &format!("pose = {pose:?}, allowed: {ALLOWED}")))
        }
    }

    fn __repr__(&self) -> String {
        let [x, y, yaw] = self.filter.pose();
        format!("<omnistep.Estimator at x {x:.3} m, y {y:.3} m, yaw {yaw:.3} rad>")
    }
}
