//! Whole runs on physics that Python steps, as MuJoCo's.

use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use omni_sim::config::Engine;
use omni_sim::observation::Pose3;
use omni_sim::{
    AxleDrive, BodyState, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep, Run, Touch,
};
use parking_lot::Mutex;
use pyo3::exceptions::{PyFloatingPointError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;

use crate::error::Stop;
use crate::nested::nested;
use crate::policy::{PolicyArg, controller, load_with};
use crate::run::look_every;
use crate::scenario::{ScenarioArg, warn_of};
use crate::trace::Trace;

/// Control periods between two looks at Ctrl-C: some milliseconds.
const PERIODS_PER_LOOK: u32 = 16;
/// Numbers of a body and of a wheel in what `observe` returns.
const OF_BODY: usize = 13;
const OF_WHEEL: usize = 6;
/// Numbers before the first body's: energies and momentum.
const OF_ALL: usize = 5;
/// Numbers of a contact.
const OF_TOUCH: usize = 10;

/// Run a scenario from start to end on a physics engine that Python steps, for :func:`omnistep.mujoco.run`.
///
/// Args:
///     physics: an object with ``start(x_m, yaw_rad)``; ``step(torques_n_m, dampers_n_m_s_rad, holds_n_m)``, which
///         returns angles and rates of the axles, (2N,), and contacts, (C, 10): wheel, force, normal, position; and
///         ``observe()``, which returns (5 + 13 B + 2 H + 6 N,): kinetic and potential energy, momentum; for each body
///         position, quaternion x, y, z, w, velocity and rate; for each hinge angle and rate; for each wheel position
///         and velocity of its centre. ``FloatingPointError`` means that the state is not finite.
///     scenario: a built-in name, a path or a :class:`Scenario`.
///     policy: as in :func:`omnistep.run`.
///     on_progress: called with the completed part, 0 to 1, every few milliseconds; an exception in it ends the run.
#[pyfunction]
#[pyo3(signature = (physics, scenario, *, policy = None, on_progress = None))]
pub(crate) fn run_external(
    py: Python<'_>,
    physics: Py<PyAny>,
    scenario: ScenarioArg,
    policy: Option<PolicyArg>,
    on_progress: Option<Py<PyAny>>,
) -> PyResult<Trace> {
    let (scenario, own) = load_with(scenario, policy, None, None)?;
    if own.is_none() {
        warn_of(py, &scenario, 2)?;
    }
    let (controller, raised) = controller(py, &scenario, own.as_ref(), true)?;
    let policy = controller.policy().to_owned();
    let error = Arc::new(Mutex::new(None));
    let stepped = Box::new(Stepped {
        object: physics,
        error: error.clone(),
    });
    let trace: Result<omni_sim::Trace, Stop> = py.detach(|| {
        let look = look_every(PERIODS_PER_LOOK, on_progress.as_ref());
        Run::new(&scenario)
            .controller(controller)
            .physics(stepped)
            .watch(look)
            .trace()
    });
    match (trace, raised.take().or_else(|| error.lock().take())) {
        (Err(_), Some(raised)) => Err(raised),
        (trace, _) => Ok(Trace::new(scenario, policy, trace?)),
    }
}

/// An object of Python that steps.
struct Stepped {
    object: Py<PyAny>,
    /// What it raised, to be raised in its place.
    error: Arc<Mutex<Option<PyErr>>>,
}

impl Stepped {
    /// Does something with the object; what that raises is kept.
    fn with(&self, work: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<()>) -> Result<(), ExternalFailure> {
        Python::attach(|py| {
            nested(|| work(self.object.bind(py))).map_err(|error| {
                if error.is_instance_of::<PyFloatingPointError>(py) {
                    return ExternalFailure::Diverged;
                }
                let said = error.value(py).to_string();
                *self.error.lock() = Some(error);
                ExternalFailure::Failed(said)
            })
        })
    }
}

impl ExternalPhysics for Stepped {
    fn engine(&self) -> Engine {
        Engine::Mujoco
    }

    fn start(&mut self, x_m: f64, yaw_rad: f64) -> Result<(), ExternalFailure> {
        self.with(|object| {
            object
                .call_method1(intern!(object.py(), "start"), (x_m, yaw_rad))
                .map(drop)
        })
    }

    fn step(&mut self, axles: &[AxleDrive], shown: &mut ExternalStep) -> Result<(), ExternalFailure> {
        self.with(|object| {
            let py = object.py();
            let array = |of: fn(&AxleDrive) -> f64| PyArray1::from_iter(py, axles.iter().map(of));
            let asked = (
                array(|axle| axle.torque_n_m),
                array(|axle| axle.damper_n_m_s_rad),
                array(|axle| axle.hold_n_m),
            );
            let given = object.call_method1(intern!(py, "step"), asked)?;
            let (turns, touches): (PyReadonlyArray1<'_, f64>, PyReadonlyArray2<'_, f64>) = given.extract()?;
            let (turns, touches) = (turns.as_array(), touches.as_array());
            if turns.len() != 2 * axles.len() || touches.ncols() != OF_TOUCH {
                return Err(PyValueError::new_err(format!(
                    "step returned {} angles and rates and contacts of {} numbers, allowed: {} and {OF_TOUCH}",
                    turns.len(),
                    touches.ncols(),
                    2 * axles.len()
                )));
            }
            for i in 0..axles.len() {
                (shown.turned_rad[i], shown.rate_rad_s[i]) = (turns[i], turns[axles.len() + i]);
            }
            shown.touches.extend(touches.rows().into_iter().map(|row| Touch {
                wheel: row[0] as usize,
                force_n: [row[1], row[2], row[3]],
                normal: [row[4], row[5], row[6]],
                at_m: [row[7], row[8], row[9]],
            }));
            Ok(())
        })
    }

    fn observe(&mut self, state: &mut ExternalState) -> Result<(), ExternalFailure> {
        self.with(|object| {
            let given = object.call_method0(intern!(object.py(), "observe"))?;
            let given: PyReadonlyArray1<'_, f64> = given.extract()?;
            let given = given.as_array();
            let (bodies, hinges) = (state.bodies.len(), state.hinges.len());
            let all = OF_ALL + OF_BODY * bodies + 2 * hinges + OF_WHEEL * state.wheels.len();
            if given.len() != all {
                let found = given.len();
                return Err(PyValueError::new_err(format!(
                    "observe returned {found} numbers, allowed: {all}"
                )));
            }
            let three = |at: usize| [given[at], given[at + 1], given[at + 2]];
            (state.kinetic_j, state.potential_j, state.momentum_n_s) = (given[0], given[1], three(2));
            let mut at = OF_ALL;
            for body in &mut state.bodies {
                let rotation_xyzw = [3, 4, 5, 6].map(|k| given[at + k]);
                *body = BodyState {
                    pose: Pose3 {
                        position_m: three(at),
                        rotation_xyzw,
                    },
                    velocity_m_s: three(at + 7),
                    rate_rad_s: three(at + 10),
                };
                at += OF_BODY;
            }
            for hinge in &mut state.hinges {
                *hinge = [given[at], given[at + 1]];
                at += 2;
            }
            for wheel in &mut state.wheels {
                *wheel = [three(at), three(at + 3)];
                at += OF_WHEEL;
            }
            Ok(())
        })
    }
}
