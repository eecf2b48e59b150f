//! Minimum torque and run-up of a climb.

use numpy::PyArray1;
use omni_bound::RowLimits;
use omni_sim::config::{Scenario, Source};
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::error::exception;
use crate::scenario::{ScenarioArg, load};
use crate::values::Pickled;

/// Torque and run-up: required by a step, and available. Arrays over rows are (3,), the front row first.
#[pyclass(frozen, eq, module = "omnistep")]
#[derive(Clone, PartialEq)]
pub(crate) struct ClimbLimits {
    scenario: Scenario,
    inner: omni_bound::ClimbLimits,
}

impl ClimbLimits {
    fn of(scenario: Scenario) -> PyResult<Self> {
        let inner = omni_bound::ClimbLimits::of(&scenario).map_err(exception)?;
        Ok(Self { scenario, inner })
    }

    fn column<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&RowLimits) -> f64,
    ) -> pyo3::Bound<'py, PyArray1<f64>> {
        let column = [0, 1, 2].map(|row| of(&self.inner.rows[row]));
        PyArray1::from_slice(py, &column)
    }
}

#[pymethods]
impl ClimbLimits {
    fn __reduce__<'py>(&self, py: Python<'py>) -> Pickled<'py, (String,)> {
        let text = self.scenario.to_toml().map_err(exception)?;
        Ok((py.get_type::<Self>().getattr("_of_state")?, (text,)))
    }

    /// Limits out of their pickle: the scenario's, computed again.
    #[staticmethod]
    fn _of_state(scenario: String) -> PyResult<Self> {
        let source = Source::embedded("pickle", scenario);
        Self::of(Scenario::from_source(&source, &[]).map_err(exception)?)
    }

    /// The vehicle's name.
    #[getter]
    fn vehicle(&self) -> &str {
        &self.inner.vehicle
    }

    /// Height of the step [m].
    #[getter]
    fn height_m(&self) -> f64 {
        self.inner.step.height_m
    }

    /// Coulomb coefficient between wheels and ground.
    #[getter]
    fn friction(&self) -> f64 {
        self.inner.step.friction
    }

    /// Torque of each actuator [N.m].
    #[getter]
    fn torque_n_m(&self) -> f64 {
        self.inner.torque_n_m
    }

    /// Speed at which each row is assumed to meet the edge [m/s].
    #[getter]
    fn speed_m_s(&self) -> f64 {
        self.inner.speed_m_s
    }

    /// The climb is not excluded: no verdict is `impossible`.
    #[getter]
    fn possible(&self) -> bool {
        self.inner.possible()
    }

    /// The row that needs the most run-up; if no row needs any, the row that needs the most torque.
    #[getter]
    fn decisive(&self) -> &'static str {
        self.inner.rows[self.inner.decisive()].row
    }

    /// `front`, `middle`, `rear`.
    #[getter]
    fn rows(&self) -> Vec<&'static str> {
        self.inner.rows.iter().map(|row| row.row).collect()
    }

    /// Names of the wheels of each row.
    #[getter]
    fn wheels(&self) -> Vec<Vec<String>> {
        self.inner.rows.iter().map(|row| row.wheels.clone()).collect()
    }

    /// For each row: `torque` suffices at any speed; the `run_up` compensates for it; it is `open`; or `impossible`.
    ///
    /// Open means that the result depends on the part of the run-up that the impact on the edge leaves.
    #[getter]
    fn verdicts(&self) -> Vec<&'static str> {
        self.inner.rows.iter().map(|row| row.verdict.name()).collect()
    }

    /// Least torque of an actuator that lifts each row, however slowly [N.m]; infinite if no torque does.
    #[getter]
    fn least_torque_n_m<'py>(&self, py: Python<'py>) -> pyo3::Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.least_torque_n_m)
    }

    /// Energy that the torque lacks, up to the worst point of each row's path [J]; 0 if it suffices.
    #[getter]
    fn deficit_j<'py>(&self, py: Python<'py>) -> pyo3::Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.deficit_j)
    }

    /// Inertia of the motion up the edge right after the impact, over the square of the hinge's distance [kg].
    #[getter]
    fn path_mass_kg<'py>(&self, py: Python<'py>) -> pyo3::Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.path_mass_kg)
    }

    /// Part of the run-up's kinetic energy that the impact leaves at most, 0 to 1.
    #[getter]
    fn kept_at_most<'py>(&self, py: Python<'py>) -> pyo3::Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.kept_at_most)
    }

    /// The part that it leaves if all motion must follow the path, 0 to ``kept_at_most``.
    #[getter]
    fn kept_on_path<'py>(&self, py: Python<'py>) -> pyo3::Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.kept_on_path)
    }

    /// Below this run-up each row does not climb, whatever the impact leaves [m/s].
    #[getter]
    fn run_up_m_s<'py>(&self, py: Python<'py>) -> pyo3::Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.run_up_m_s)
    }

    /// From this run-up on, the energy suffices if the impact leaves the motion along the path [m/s].
    #[getter]
    fn path_run_up_m_s<'py>(&self, py: Python<'py>) -> pyo3::Bound<'py, PyArray1<f64>> {
        self.column(py, |row| row.path_run_up_m_s)
    }

    fn __repr__(&self) -> String {
        let limits = &self.inner;
        let possible = if limits.possible() {
            "not excluded"
        } else {
            "impossible"
        };
        let row = limits.rows[limits.decisive()].row;
        format!(
            "<omnistep.ClimbLimits of {} over {} m: {possible}, the {row} row is decisive>",
            limits.vehicle, limits.step.height_m
        )
    }
}

/// Least torque and run-up for the step of a scenario, from the balance of forces, without a simulation.
///
/// The torque is the stall torque of the scenario's motors. The speed is the fastest forward command, and every row of
/// wheels is assumed to meet the edge at this speed. docs/derivations.md, Minimum torque and run-up of a climb, lists
/// the assumptions.
///
/// Args:
///     scenario: a built-in name (see :func:`list_scenarios`), the path of a .toml file or a :class:`Scenario`; the
///         step by default.
///     overrides: keys to replace, as in :func:`omnistep.run`.
///
/// Returns:
///     Torque and run-up that each row of wheels needs, and whether the vehicle reaches them.
///
/// Raises:
///     ConfigError: a name, key or value is wrong; the ground is not a plain step with one friction, met head-on; or
///         the vehicle is not two frames on one transverse hinge with three rows of wheels.
///
/// Example:
///     >>> import omnistep
///     >>> limits = omnistep.climb_limits("step", overrides={"vehicle.motor.stall_torque_n_m": 1.4})
///     >>> limits.least_torque_n_m.round(1)  # the rear row climbs with a run-up or not at all
///     array([1.3, 2.5, inf])
///     >>> limits.verdicts, limits.possible, limits.decisive
///     (['torque', 'run_up', 'run_up'], True, 'middle')
#[pyfunction]
#[pyo3(signature = (scenario = ScenarioArg::default(), *, overrides = None))]
pub(crate) fn climb_limits(
    py: Python<'_>,
    scenario: ScenarioArg,
    overrides: Option<&pyo3::Bound<'_, PyMapping>>,
) -> PyResult<ClimbLimits> {
    let scenario = load(scenario, None, overrides, None)?;
    py.detach(|| ClimbLimits::of(scenario))
}
