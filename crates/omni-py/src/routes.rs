//! Routes over edges as the text of their JSON. The Python functions are in `omnistep/routes.py`.

use std::path::PathBuf;

use omni_plan::{Area, Cost, Elevation, Options, Route};
use omnistep::routes::{self, RouteRequest};
use pyo3::prelude::*;

use crate::error::{exception, refused};
use crate::scenario::Scenario;

/// Plan a route, for :func:`omnistep.plan_route`.
///
/// Args:
///     scenario: as in :func:`omnistep.plan_route`.
///     to: x and y [m], and a heading [deg] if it matters.
///     chart: the text of a climb chart's file.
///     file: the name of that file in messages.
///     map: a file of map_server, or None for the scenario's ground.
///     elevation: the picture of its heights, and the heights of black and white [m], or None for a level map.
///     keep_out: rectangles that the vehicle does not enter, x from and to, y from and to [m].
///     cost: ``time``, ``energy`` or ``risk``.
///     margin: part of the chart's limits to plan with.
///     clearance_m: distance from obstacles [m].
///     resolution_m: cells of the scenario's ground [m].
///     around_m: how far around start and goal the ground is looked at [m].
///
/// Returns:
///     The route as JSON.
///
/// Raises:
///     ConfigError: a file or an argument is not usable.
///     NoRouteError: there is no way.
#[pyfunction]
#[pyo3(signature = (scenario, to, *, chart, file, map, elevation, keep_out, cost, margin, clearance_m, resolution_m, around_m))]
#[expect(clippy::too_many_arguments, reason = "keywords of a function")]
pub(crate) fn plan_route(
    py: Python<'_>,
    scenario: &Scenario,
    to: Vec<f64>,
    chart: &str,
    file: &str,
    map: Option<PathBuf>,
    elevation: Option<(PathBuf, f64, f64)>,
    keep_out: Vec<[f64; 4]>,
    cost: &str,
    margin: f64,
    clearance_m: f64,
    resolution_m: f64,
    around_m: f64,
) -> PyResult<String> {
    let scenario = scenario.inner();
    let of_vehicle = omni_study::Chart::from_toml(file, chart).map_err(exception)?;
    of_vehicle
        .check_vehicle(file, scenario.vehicle())
        .map_err(exception)?;
    let chart = omni_plan::Chart::from_toml(file, chart).map_err(exception)?;
    let cost = match cost {
        "time" => Cost::Time,
        "energy" => Cost::Energy,
        "risk" => Cost::Risk,
        _ => {
            return Err(refused(
                "cost",
                &format!("cost: {cost:?}, allowed: time, energy, risk"),
            ));
        }
    };
    let elevation = elevation.map(|(file, black_m, white_m)| Elevation::new(file, black_m, white_m));
    let keep_out = keep_out
        .iter()
        .map(|[x, to_x, y, to_y]| Area::rectangle([*x, *to_x], [*y, *to_y]))
        .collect::<Result<Vec<_>, _>>()
        .map_err(exception)?;
    let request = RouteRequest {
        goal: routes::goal(&to).map_err(exception)?,
        chart: &chart,
        map: map.as_deref(),
        elevation: elevation.as_ref(),
        keep_out: &keep_out,
        resolution_m,
        around_m,
        options: Options {
            cost,
            margin,
            clearance_m,
            ..Options::default()
        },
    };
    py.detach(|| {
        routes::plan_route(scenario, &request)?
            .to_json()
            .map_err(Into::into)
    })
    .map_err(|error: omnistep::Error| exception(error))
}

/// The scenario with a route as its path, for :attr:`omnistep.routes.Route.scenario`.
///
/// Args:
///     route: a route as JSON.
///     scenario: the scenario that it was planned in.
///
/// Raises:
///     ConfigError: the route is no JSON of a route, or a point is beyond what a path may be.
#[pyfunction]
pub(crate) fn drive_route(route: &str, scenario: &Scenario) -> PyResult<Scenario> {
    let route: Route =
        serde_json::from_str(route).map_err(|error| refused("route", &format!("route: {error}")))?;
    routes::driven(&route, scenario.inner())
        .map(Scenario::of)
        .map_err(exception)
}
