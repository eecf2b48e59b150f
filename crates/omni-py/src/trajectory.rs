//! Trajectories over arrays of times.

use omni_core::path::{PathPiece, PathSegment, PlanarInertia};
use omni_core::shaping::MotionLimits;
use omni_sim::config::PlannedPath;
use pyo3::prelude::*;

use crate::arrays::{Array, array, each_row, fixed, floats, numbers};
use crate::error::refused;
use crate::kinematics::Kinematics;
use crate::plan::{Limits, Plan};
use crate::waypoint::waypoints;

/// Plans trajectories through waypoints, within the wheels' speeds and torques; firmware's code in float64.
///
/// No wheel turns faster than ``share`` of its highest speed; curves and accelerations use no more than ``share`` of
/// the motors' torque at their speed; velocity, acceleration and jerk along the path and of the heading stay within
/// their limits. The planner does not model ground friction, so limit ``acceleration`` accordingly.
///
/// Args:
///     kinematics: the wheels.
///     velocity: highest speed along the path [m/s] and of the heading [rad/s], two numbers, like the next three
///         arguments: 0, or 0.001 or more.
///     acceleration: highest acceleration while the speed grows [m/s^2, rad/s^2], 0.001 or more, finite.
///     deceleration: highest deceleration while the speed shrinks; ``acceleration`` if left out.
///     jerk: highest rate of change of the acceleration [m/s^3, rad/s^3], 0.001 or more; no limit if left out.
///     mass_kg: mass of the whole vehicle [kg], above 0.
///     yaw_kg_m2: yaw moment of inertia about the centre of mass [kg.m^2], above 0.
///     centre_m: centre of mass from the vehicle's origin, forward and to the left [m]; the origin if left out.
///     speeds_rad_s: highest speed of actuators [rad/s], 0.001 or more: one number, or one per wheel, like the next
///         three arguments.
///     stall_torque_n_m: torque of actuators at rest [N.m], above 0.
///     slope_n_m_s_rad: torque lost per speed [N.m per rad/s], 0 or more; 0 if left out.
///     wheel_kg_m2: inertia of wheel and rotor, referred to the actuator [kg.m^2], 0 or more; 0 if left out.
///     fastest: largest magnitude of vx, vy [m/s], wz [rad/s] of the body twist, 0, or 0.001 or more; no limit if left
///         out.
///     quickest: largest change of each [m/s^2, m/s^2, rad/s^2], 0.001 or more; no limit if left out.
///     share: fraction of the wheels' speeds and torques that a trajectory may use, 0.05 to 1: the remaining fraction
///         is a reserve for the follower.
///
/// Raises:
///     ConfigError: an argument is out of range, or has the wrong length.
///     TypeError: not numbers.
///
/// Example:
///     >>> import omnistep
///     >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.5, track_m=0.4, radius_m=0.076)
///     >>> planner = omnistep.TrajectoryPlanner(
///     ...     kinematics=omnistep.Kinematics(layout=layout), velocity=[0.8, 2.0], acceleration=[1.0, 4.0],
///     ...     jerk=[8.0, 40.0], mass_kg=24.0, yaw_kg_m2=1.0, speeds_rad_s=25.0, stall_torque_n_m=3.0)
///     >>> ahead = planner.plan([(0.0, 0.0), (2.0, 0.0)])
///     >>> round(ahead.duration_s, 9) == 2.0 / 0.8 + 0.8 / 1.0 + 1.0 / 8.0  # and half of v / a + a / j for each ramp
///     True
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct TrajectoryPlanner {
    wheels: usize,
    plan: Box<dyn Plan>,
}

/// One number for all wheels, or one per wheel.
fn of_wheels(name: &'static str, value: &Bound<'_, PyAny>, wheels: usize) -> PyResult<Vec<f64>> {
    if value.len().is_err()
        && let Ok(one) = value.extract::<f64>()
    {
        return Ok(vec![one; wheels]);
    }
    numbers(name, value, "a number, or one for each wheel")
}

#[pymethods]
impl TrajectoryPlanner {
    #[new]
    #[pyo3(signature = (
        *, kinematics, velocity, acceleration, deceleration = None, jerk = None, mass_kg, yaw_kg_m2, centre_m = None,
        speeds_rad_s, stall_torque_n_m, slope_n_m_s_rad = None, wheel_kg_m2 = None, fastest = None, quickest = None,
        share = 0.9
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python constructor")]
    fn new(
        kinematics: &Bound<'_, Kinematics>,
        velocity: &Bound<'_, PyAny>,
        acceleration: &Bound<'_, PyAny>,
        deceleration: Option<&Bound<'_, PyAny>>,
        jerk: Option<&Bound<'_, PyAny>>,
        mass_kg: f64,
        yaw_kg_m2: f64,
        centre_m: Option<&Bound<'_, PyAny>>,
        speeds_rad_s: &Bound<'_, PyAny>,
        stall_torque_n_m: &Bound<'_, PyAny>,
        slope_n_m_s_rad: Option<&Bound<'_, PyAny>>,
        wheel_kg_m2: Option<&Bound<'_, PyAny>>,
        fastest: Option<&Bound<'_, PyAny>>,
        quickest: Option<&Bound<'_, PyAny>>,
        share: f64,
    ) -> PyResult<Self> {
        let two = |name, given| fixed::<2>(name, given, "two numbers: linear and yaw");
        let three = |name, given: Option<&Bound<'_, PyAny>>| match given {
            Some(given) => fixed::<3>(name, given, "three numbers: of vx, vy and wz"),
            None => Ok([f64::INFINITY; 3]),
        };
        let velocity = two("velocity", velocity)?;
        let acceleration = two("acceleration", acceleration)?;
        let deceleration = match deceleration {
            Some(given) => two("deceleration", given)?,
            None => acceleration,
        };
        let jerk = match jerk {
            Some(given) => two("jerk", given)?,
            None => [f64::INFINITY; 2],
        };
        let motion = |k: usize| MotionLimits {
            velocity: velocity[k],
            acceleration: acceleration[k],
            deceleration: deceleration[k],
            jerk: jerk[k],
        };
        let kinematics = kinematics.get();
        let wheels = kinematics.wheel_count();
        let each = |name, given: Option<&Bound<'_, PyAny>>| match given {
            Some(given) => of_wheels(name, given, wheels),
            None => Ok(vec![0.0; wheels]),
        };
        let centre_m = match centre_m {
            Some(given) => fixed("centre_m", given, "two numbers, x and y [m]")?,
            None => [0.0; 2],
        };
        let limits = Limits {
            linear: motion(0),
            yaw: motion(1),
            fastest: three("fastest", fastest)?,
            quickest: three("quickest", quickest)?,
            body: PlanarInertia {
                mass_kg,
                yaw_kg_m2,
                centre_m,
            },
            speeds_rad_s: each("speeds_rad_s", Some(speeds_rad_s))?,
            stall_torque_n_m: each("stall_torque_n_m", Some(stall_torque_n_m))?,
            slope_n_m_s_rad: each("slope_n_m_s_rad", slope_n_m_s_rad)?,
            wheel_kg_m2: each("wheel_kg_m2", wheel_kg_m2)?,
            share,
        };
        let plan = kinematics.planner(&limits)?;
        Ok(Self { wheels, plan })
    }

    /// The trajectory through waypoints, from rest to rest.
    ///
    /// Args:
    ///     waypoints: 2 to 1000 of them; a pair of x and y [m] is a waypoint that is reached on a line.
    ///
    /// Raises:
    ///     ConfigError: too few or too many waypoints; a value is out of range; a waypoint repeats the previous one; or
    ///         the limits do not allow its time.
    ///     TypeError: not waypoints.
    #[pyo3(signature = (waypoints, /))]
    fn plan(&self, waypoints: &Bound<'_, PyAny>) -> PyResult<Trajectory> {
        let py = waypoints.py();
        let waypoints = self::waypoints(waypoints)?;
        let planned = py.detach(|| self.plan.plan(&waypoints));
        let (segments, pieces) = planned.map_err(|error| {
            let key = error.parameter.trim_start_matches("waypoint.");
            let key = error
                .index
                .map_or("waypoints".into(), |i| format!("waypoints[{i}].{key}"));
            refused(
                &key,
                &format!("{key} = {}, allowed: {}", error.value, error.allowed),
            )
        })?;
        Ok(Trajectory { segments, pieces })
    }

    /// Actuator velocities [rad/s] of a vehicle that follows a sample exactly, (N,) or (T, N).
    #[pyo3(signature = (sample, /))]
    fn velocities<'py>(&self, sample: &Bound<'py, TrajectorySample>) -> PyResult<Array<'py, f64>> {
        let (py, sample) = (sample.py(), sample.get());
        let velocities = self.plan.velocities(&sample.samples);
        array(py, sample.shape(Some(self.wheels)), velocities)
    }

    /// Actuator torques [N.m] that a sample's acceleration requires, (N,) or (T, N), without friction.
    ///
    /// Of all torques that produce the acceleration, the set with the smallest sum of squares.
    #[pyo3(signature = (sample, /))]
    fn torques<'py>(&self, sample: &Bound<'py, TrajectorySample>) -> PyResult<Array<'py, f64>> {
        let (py, sample) = (sample.py(), sample.get());
        let torques = self.plan.torques(&sample.samples);
        array(py, sample.shape(Some(self.wheels)), torques)
    }

    fn __repr__(&self) -> String {
        format!("<omnistep.TrajectoryPlanner for {} wheels>", self.wheels)
    }
}

/// A reference trajectory, from :class:`TrajectoryPlanner` or ``Scenario.trajectory``.
///
/// Example:
///     >>> import omnistep
///     >>> square = omnistep.Scenario("square").trajectory
///     >>> square.at([0.0, square.duration_s]).pose[:, :2].round(6).tolist()  # it ends where it began
///     [[0.0, 0.0], [0.0, 0.0]]
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct Trajectory {
    segments: Vec<PathSegment<f64>>,
    pieces: Vec<PathPiece<f64>>,
}

impl Trajectory {
    /// What a scenario's path is.
    pub(crate) fn of(path: &PlannedPath) -> Self {
        let planned = path.trajectory();
        Self {
            segments: planned.segments().to_vec(),
            pieces: planned.pieces().to_vec(),
        }
    }

    fn inner(&self) -> omni_core::path::Trajectory<'_, f64> {
        omni_core::path::Trajectory::new(&self.segments, &self.pieces)
    }
}

#[pymethods]
impl Trajectory {
    /// Duration [s].
    #[getter]
    fn duration_s(&self) -> f64 {
        self.inner().duration_s()
    }

    /// Start time of the segment to each waypoint after the first [s], (K,).
    #[getter]
    fn starts_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let starts: Vec<f64> = self.segments.iter().map(PathSegment::start_s).collect();
        array(py, vec![starts.len()], starts)
    }

    /// Length of each segment [m], (K,); [rad] for a turn on the spot, 0 for waiting.
    #[getter]
    fn lengths_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let lengths: Vec<f64> = self.segments.iter().map(PathSegment::length_m).collect();
        array(py, vec![lengths.len()], lengths)
    }

    /// The trajectory at given times.
    ///
    /// Args:
    ///     time_s: since its start [s], a number or (T,). Before 0, and for NaN, the sample is the first pose, at rest;
    ///         from ``duration_s`` on, the last pose.
    ///
    /// Raises:
    ///     ConfigError: the shape is wrong.
    ///     TypeError: not numbers.
    #[pyo3(signature = (time_s, /))]
    fn at(&self, time_s: &Bound<'_, PyAny>) -> PyResult<TrajectorySample> {
        let py = time_s.py();
        let (times, shape) = floats("time_s", time_s)?;
        let inner = self.inner();
        let mut samples = Vec::with_capacity(times.len());
        each_row(py, times.len(), |i| samples.push(inner.at(times[i])))?;
        Ok(TrajectorySample {
            samples,
            count: shape.first().copied(),
        })
    }

    fn __repr__(&self) -> String {
        format!(
            "<omnistep.Trajectory: {} ways in {:.3} s>",
            self.segments.len(),
            self.duration_s()
        )
    }
}

/// A :class:`Trajectory` at one time, or at each of many.
#[pyclass(frozen, module = "omnistep")]
pub(crate) struct TrajectorySample {
    pub(crate) samples: Vec<omni_core::path::TrajectorySample<f64>>,
    /// How many; none for a single one without a dimension of its own.
    pub(crate) count: Option<usize>,
}

impl TrajectorySample {
    fn shape(&self, columns: Option<usize>) -> Vec<usize> {
        self.count.into_iter().chain(columns).collect()
    }

    fn one<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        of: impl Fn(&omni_core::path::TrajectorySample<f64>) -> T,
    ) -> PyResult<Array<'py, T>> {
        array(py, self.shape(None), self.samples.iter().map(of).collect())
    }

    fn three<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&omni_core::path::TrajectorySample<f64>) -> [f64; 3],
    ) -> PyResult<Array<'py, f64>> {
        array(
            py,
            self.shape(Some(3)),
            self.samples.iter().flat_map(of).collect(),
        )
    }
}

#[pymethods]
impl TrajectorySample {
    /// The given times [s], () or (T,).
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.one(py, |sample| sample.time_s)
    }

    /// Reference pose (x [m], y [m], heading [rad] in (-pi, pi]), (3,) or (T, 3).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.three(py, |sample| {
            [sample.pose.x_m, sample.pose.y_m, sample.pose.yaw_rad]
        })
    }

    /// Reference velocity along the world's axes (x, y [m/s], yaw [rad/s]), (3,) or (T, 3).
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.three(py, |sample| {
            let velocity = sample.velocity;
            [velocity.vx_m_s, velocity.vy_m_s, velocity.wz_rad_s]
        })
    }

    /// Reference acceleration (x, y [m/s^2], yaw [rad/s^2]), (3,) or (T, 3).
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.three(py, |sample| sample.acceleration)
    }

    /// The body twist (vx, vy [m/s], wz [rad/s]) of a vehicle at the reference pose, (3,) or (T, 3).
    #[getter]
    fn feed_forward<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.three(py, |sample| sample.feed_forward().to_array())
    }

    /// Speed along the path [m/s], rad/s in a turn on the spot; 0 or more, () or (T,).
    #[getter]
    fn speed_m_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.one(py, |sample| sample.speed_m_s)
    }

    /// The end is reached, () or (T,).
    #[getter]
    fn done<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, bool>> {
        self.one(py, |sample| sample.done)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (time, pose) = (self.time_s(py)?.repr()?, self.pose(py)?.repr()?);
        Ok(format!("<omnistep.TrajectorySample: time_s {time}, pose {pose}>"))
    }
}
