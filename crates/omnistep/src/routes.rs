//! A route over a scenario's ground or over a map, and the scenario that drives it.

use std::path::Path;

use omni_config::{Override, Scenario, Vehicle};
use omni_plan::{Area, Chart, Elevation, Footprint, Goal, Grid, Map, Options, Planner, Pose, Route};

use crate::Error;
#[cfg(feature = "ros2")]
use crate::args::{AROUND_M, RESOLUTION_M};

/// After this time beyond the end of its path a vehicle has come to rest \[s\].
const AFTER_S: f64 = 3.0;
/// Time for which a vehicle stands before it drives, so that its estimator learns the biases of gyro and
/// accelerometer \[s\].
const REST_S: f64 = 3.0;

/// As far as waypoints may be \[m\].
const FARTHEST_M: f64 = 100.0;

/// The goal of these numbers: x and y \[m\], and a heading \[deg\] if it matters.
///
/// # Errors
/// Argument `to`.
pub fn goal(to: &[f64]) -> Result<Goal, Error> {
    let is_place = |x_m: f64, y_m: f64| [x_m, y_m].iter().all(|part| part.abs() <= FARTHEST_M);
    match *to {
        [x_m, y_m] if is_place(x_m, y_m) => Ok(Goal::place(x_m, y_m)),
        [x_m, y_m, deg] if is_place(x_m, y_m) && deg.abs() <= 360.0 => {
            Ok(Goal::pose(x_m, y_m, deg.to_radians()))
        }
        _ => Err(omni_plan::Error::Argument {
            name: "to",
            value: to.iter().map(f64::to_string).collect::<Vec<_>>().join(","),
            allowed: "x and y [m], -100 to 100, and a heading [deg], -360 to 360, if it matters".into(),
        }
        .into()),
    }
}

/// Where to go, over what, and how it is planned.
pub struct RouteRequest<'a> {
    /// Where to go.
    pub goal: Goal,
    /// What the scenario's vehicle climbs.
    pub chart: &'a Chart,
    /// A map of map_server; none for the scenario's ground.
    pub map: Option<&'a Path>,
    /// Its heights; none if it is level.
    pub elevation: Option<&'a Elevation>,
    /// Areas that the vehicle does not enter.
    pub keep_out: &'a [Area],
    /// Cells of the scenario's ground \[m\], 0.001 to 10.
    pub resolution_m: f64,
    /// How far around start and goal the scenario's ground is looked at \[m\], 1 to 100.
    pub around_m: f64,
    /// Margins, speeds, and what the route has the least of.
    pub options: Options,
}

#[cfg(feature = "ros2")]
impl<'a> RouteRequest<'a> {
    /// Over the scenario's ground, with the planner's usual margins and speeds.
    pub(crate) fn new(goal: Goal, chart: &'a Chart) -> Self {
        Self {
            goal,
            chart,
            map: None,
            elevation: None,
            keep_out: &[],
            resolution_m: RESOLUTION_M,
            around_m: AROUND_M,
            options: Options::default(),
        }
    }
}

/// A route from a scenario's start.
///
/// # Errors
/// A file or an argument that is not usable, by its name; [`Error::NoRoute`], which says what is in the way.
pub fn plan_route(scenario: &Scenario, request: &RouteRequest) -> Result<Route, Error> {
    let planner = planner(scenario, request)?;
    planner
        .plan(&start(scenario), &request.goal)
        .map_err(Error::NoRoute)
}

/// The planner over the map or the scenario's ground, which also writes costmaps.
///
/// # Errors
/// A file or an argument that is not usable, by its name.
pub fn planner(scenario: &Scenario, request: &RouteRequest) -> Result<Planner, Error> {
    planner_from(scenario, &start(scenario), request)
}

/// The same for a vehicle that is anywhere.
pub(crate) fn planner_from(
    scenario: &Scenario,
    start: &Pose,
    request: &RouteRequest,
) -> Result<Planner, Error> {
    let mut map = match request.map {
        Some(file) => Map::from_map_server(file, request.elevation)?,
        None => ground(scenario, request, start)?,
    };
    for area in request.keep_out {
        map = map.with_keep_out(area.clone());
    }
    let footprint = footprint(scenario.vehicle())?;
    Ok(Planner::new(
        &map,
        request.chart,
        &footprint,
        request.options.clone(),
    )?)
}

/// The scenario, whose command is the route, and which lasts until its end. The vehicle follows with the estimated
/// pose, and the path waits for it.
///
/// # Errors
/// [`Error::Simulation`] where a point of the route is beyond what a path may be.
pub fn driven(route: &Route, scenario: &Scenario) -> Result<Scenario, Error> {
    let point = |point: &omni_plan::RoutePoint| {
        let mut table = toml::Table::new();
        let numbers = [
            ("x_m", point.x_m),
            ("y_m", point.y_m),
            ("heading_rad", point.yaw_rad),
        ];
        for (key, value) in numbers {
            table.insert(key.into(), value.into());
        }
        if point.speed_m_s > 0.0 {
            table.insert("speed_m_s".into(), point.speed_m_s.into());
        }
        toml::Value::Table(table)
    };
    let path: Vec<toml::Value> = route.points.iter().skip(1).map(point).collect();
    let mut command = toml::Table::new();
    command.insert("path".into(), path.into());
    let mut follow = toml::Table::new();
    follow.insert("wait".into(), toml::Table::new().into());
    follow.insert("pose".into(), "estimate".into());
    follow.insert("rest_s".into(), REST_S.into());
    command.insert("follow".into(), follow.into());
    let name = format!("{}, its command replaced by the route", scenario.name);
    let command = Override::new("command", toml::Value::Table(command));
    let driven = scenario.with(&name, &[command])?;
    // The planner's times have no acceleration in them.
    let path = driven.planned_path()?;
    let duration_s = path.map_or(route.duration_s, |path| path.duration_s());
    let lasts = Override::new("duration_s", (duration_s + AFTER_S).ceil());
    Ok(driven.with(&name, &[lasts])?)
}

/// Where a scenario's vehicle starts.
pub fn start(scenario: &Scenario) -> Pose {
    let start = &scenario.start;
    Pose::new(start.x_m, start.y_m, start.heading_rad)
}

/// The scenario's ground around start and goal.
fn ground(scenario: &Scenario, request: &RouteRequest, start: &Pose) -> Result<Map, Error> {
    let (goal, around_m) = (&request.goal, request.around_m);
    if !(1.0..=100.0).contains(&around_m) {
        return Err(omni_plan::Error::Argument {
            name: "around_m",
            value: around_m.to_string(),
            allowed: "1 to 100".into(),
        }
        .into());
    }
    let around = |from: f64, to: f64| [from.min(to) - around_m, from.max(to) + around_m];
    let (x_m, y_m) = (around(start.x_m, goal.x_m), around(start.y_m, goal.y_m));
    let cells = |[from, to]: [f64; 2]| ((to - from) / request.resolution_m).ceil() as usize;
    let grid = Grid::new(cells(x_m), cells(y_m), request.resolution_m, [x_m[0], y_m[0]])?;
    let centres =
        (0..grid.rows).flat_map(|row| (0..grid.columns).map(move |column| grid.centre_of([column, row])));
    let heights = omni_sim::ground_heights_m(scenario, &centres.collect::<Vec<_>>());
    let mut map = Map::from_heights(grid, heights)?.with_friction(scenario.terrain.friction())?;
    // The last patch that holds a place is its friction.
    for patch in &scenario.friction_patch {
        map = map.with_friction_area(Area::rectangle(patch.x_m, patch.y_m)?, patch.friction)?;
    }
    Ok(map)
}

/// What a vehicle covers: its wheels and the boxes of its bodies.
fn footprint(vehicle: &Vehicle) -> Result<Footprint, Error> {
    let wheels = vehicle.wheel.iter().map(|wheel| {
        let [x, y] = wheel.position_m;
        ([x, y], [wheel.radius_m; 2])
    });
    let bodies = vehicle.body.iter().filter(|body| body.underside_m().is_some());
    let bodies = bodies.map(|body| {
        let ([x, y, _], [length, width, _]) = (body.com_m, body.inertia_box_m);
        ([x, y], [length / 2.0, width / 2.0])
    });
    let (mut low, mut high) = ([0.0_f64; 2], [0.0_f64; 2]);
    for (centre, reach) in wheels.chain(bodies) {
        for axis in 0..2 {
            low[axis] = low[axis].min(centre[axis] - reach[axis]);
            high[axis] = high[axis].max(centre[axis] + reach[axis]);
        }
    }
    Ok(Footprint::new(high[0], -low[0], high[1], -low[1])?)
}
