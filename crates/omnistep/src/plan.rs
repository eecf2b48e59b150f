//! `omnistep plan`.

use std::io::Write;
use std::path::{Path, PathBuf};

use comfy_table::Table;
use omni_config::{Override, Scenario, Vehicle};
use omni_plan::{Area, Chart, Cost, CrossingKind, Footprint, Goal, Grid, Map, Options, Planner, Pose, Route};

use crate::Error;
use crate::args::{CostArg, PlanArgs, parse_overrides};
use crate::output::{aligned, print, print_path, write_file};

/// Plans a route, and prints its crossings.
pub(super) fn plan(args: &PlanArgs, out: &mut dyn Write) -> Result<(), Error> {
    let scenario = Scenario::load(&args.scenario, &parse_overrides(&args.overrides)?)?;
    let format = args.out.as_deref().map(Format::of).transpose()?;
    let goal = goal(&args.to)?;
    let start = start(&scenario);
    let map = match &args.map {
        Some(file) => Map::from_map_server(file, None)?,
        None => ground(&scenario, args, &start, &goal)?,
    };
    let chart = charted(&scenario, args)?;
    let footprint = footprint(scenario.vehicle())?;
    let options = options(args);
    let planner = Planner::new(&map, &chart, &footprint, options)?;
    let route = planner.plan(&start, &goal).map_err(Error::NoRoute)?;
    if let (Some(file), Some(format)) = (&args.out, format) {
        write_file(file, &format.text(&route, &scenario)?, &inputs(args))?;
    }
    if args.json {
        return print(out, &(route.to_json()? + "\n"));
    }
    print(out, &format!("{}\n", headline(&route, &scenario)))?;
    if !route.crossings.is_empty() {
        print(out, &format!("{}\n", table(&route)))?;
    }
    match &args.out {
        Some(file) => print_path(out, file),
        None => Ok(()),
    }
}

/// Output format of a route.
#[derive(Clone, Copy)]
enum Format {
    Json,
    Csv,
    Toml,
}

impl Format {
    /// By the file's ending.
    fn of(file: &Path) -> Result<Self, Error> {
        match file.extension().and_then(|ending| ending.to_str()) {
            Some("json") => Ok(Self::Json),
            Some("csv") => Ok(Self::Csv),
            Some("toml") => Ok(Self::Toml),
            _ => Err(Error::Argument {
                name: "--out",
                value: file.display().to_string(),
                allowed: "a file that ends in .json, .csv or .toml",
            }),
        }
    }

    fn text(self, route: &Route, scenario: &Scenario) -> Result<String, Error> {
        match self {
            Self::Json => Ok(route.to_json()? + "\n"),
            Self::Csv => Ok(route.points_to_csv()?),
            Self::Toml => Ok(driven(route, scenario)?.to_toml()?),
        }
    }
}

/// The scenario, whose command is the route, and which lasts until its end.
fn driven(route: &Route, scenario: &Scenario) -> Result<Scenario, Error> {
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
    command.insert("follow".into(), follow.into());
    let name = format!("{}, its command replaced by the route", scenario.name);
    let command = Override::new("command", toml::Value::Table(command));
    let driven = scenario.with(&name, &[command])?;
    // The planner's times have no acceleration in them.
    let path = driven.planned_path()?;
    let duration_s = path.map_or(route.duration_s, |path| path.trajectory().duration_s());
    let lasts = Override::new("duration_s", (duration_s + AFTER_S).ceil());
    Ok(driven.with(&name, &[lasts])?)
}

/// As far as waypoints may be \[m\].
const FARTHEST_M: f64 = 100.0;
/// Time after the end of its path until a vehicle has come to rest \[s\].
const AFTER_S: f64 = 3.0;

/// Files that are read, and not written over.
fn inputs(args: &PlanArgs) -> Vec<PathBuf> {
    let files = [
        args.chart.clone(),
        args.map.clone(),
        Some(args.scenario.clone().into()),
    ];
    files.into_iter().flatten().collect()
}

fn options(args: &PlanArgs) -> Options {
    Options {
        cost: match args.cost {
            CostArg::Time => Cost::Time,
            CostArg::Energy => Cost::Energy,
            CostArg::Risk => Cost::Risk,
        },
        margin: args.margin,
        clearance_m: args.clearance,
        ..Options::default()
    }
}

fn goal(to: &[f64]) -> Result<Goal, Error> {
    let is_place = |x_m: f64, y_m: f64| [x_m, y_m].iter().all(|part| part.abs() <= FARTHEST_M);
    match *to {
        [x_m, y_m] if is_place(x_m, y_m) => Ok(Goal::place(x_m, y_m)),
        [x_m, y_m, deg] if is_place(x_m, y_m) && deg.abs() <= 360.0 => {
            Ok(Goal::pose(x_m, y_m, deg.to_radians()))
        }
        _ => Err(Error::Argument {
            name: "--to",
            value: to.iter().map(f64::to_string).collect::<Vec<_>>().join(","),
            allowed: "x and y [m], -100 to 100, and a heading [deg], -360 to 360, if it matters",
        }),
    }
}

fn start(scenario: &Scenario) -> Pose {
    let start = &scenario.start;
    Pose::new(start.x_m, start.y_m, start.heading_rad)
}

/// The scenario's ground around start and goal.
fn ground(scenario: &Scenario, args: &PlanArgs, start: &Pose, goal: &Goal) -> Result<Map, Error> {
    if !(1.0..=100.0).contains(&args.around) {
        return Err(Error::Argument {
            name: "--around",
            value: args.around.to_string(),
            allowed: "1 to 100",
        });
    }
    let around = |from: f64, to: f64| [from.min(to) - args.around, from.max(to) + args.around];
    let (x_m, y_m) = (around(start.x_m, goal.x_m), around(start.y_m, goal.y_m));
    let cells = |[from, to]: [f64; 2]| ((to - from) / args.resolution).ceil() as usize;
    let grid = Grid::new(cells(x_m), cells(y_m), args.resolution, [x_m[0], y_m[0]])?;
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

/// What the scenario's vehicle climbs.
fn charted(scenario: &Scenario, args: &PlanArgs) -> Result<Chart, Error> {
    let vehicle = scenario.vehicle();
    let policy = scenario.control.law();
    let usual = || PathBuf::from("out").join(format!("chart-{}-{policy}.toml", vehicle.name));
    let file = args.chart.clone().unwrap_or_else(usual);
    if args.chart.is_none() && !file.exists() {
        return Err(Error::NoChart {
            file,
            vehicle: vehicle.name.clone(),
        });
    }
    crate::chart::read(&file)?.check_vehicle(&file.display().to_string(), vehicle)?;
    Ok(Chart::read(&file)?)
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

fn headline(route: &Route, scenario: &Scenario) -> String {
    let crossings = match route.crossings.len() {
        0 => "over no edge".to_owned(),
        1 => "over 1 edge".to_owned(),
        count => format!("over {count} edges"),
    };
    format!(
        "{} on {}: {:.2} m in {:.1} s, {crossings}",
        scenario.vehicle().name,
        scenario.name,
        route.length_m,
        route.duration_s
    )
}

/// A row for each crossing.
fn table(route: &Route) -> Table {
    let kind = |kind: CrossingKind| match kind {
        CrossingKind::Up => "up",
        CrossingKind::Down => "down",
        _ => "over",
    };
    let rows = route.crossings.iter().map(|crossing| {
        [
            format!("{:.2}, {:.2}", crossing.x_m, crossing.y_m),
            kind(crossing.kind).to_owned(),
            format!("{:.1}", 1e3 * crossing.height_m),
            format!("{:.1}", 1e3 * crossing.allowed_m),
            format!("{:.0}", crossing.side_deg),
            format!("{:.1}", crossing.normal_rad.to_degrees()),
            format!("{:.2}", crossing.speed_m_s),
            format!("{:.1}", crossing.time_s),
        ]
    });
    let headings = [
        "edge at x, y [m]",
        "",
        "height [mm]",
        "at most [mm]",
        "side [deg]",
        "normal [deg]",
        "speed [m/s]",
        "at [s]",
    ];
    aligned(headings, rows, 2)
}
