//! `omnistep plan`.

use std::io::Write;
use std::path::{Path, PathBuf};

use comfy_table::Table;
use omni_config::Scenario;
use omni_plan::{Area, Chart, Cost, CrossingKind, Elevation, Options, Route};

use crate::Error;
use crate::args::{CostArg, PlanArgs, parse_overrides};
use crate::output::{aligned, print, print_path, say, write_file};
use crate::routes::{RouteRequest, driven, goal, planner, start};

/// Plans a route, and prints its crossings.
pub(super) fn plan(args: &PlanArgs, out: &mut dyn Write) -> Result<(), Error> {
    let scenario = Scenario::load(&args.scenario, &parse_overrides(&args.overrides)?)?;
    let format = args.out.as_deref().map(Format::of).transpose()?;
    let elevation = elevation(args)?;
    let keep_out = args.keep_out.iter();
    let keep_out: Vec<_> = keep_out
        .map(|[x, to_x, y, to_y]| Area::rectangle([*x, *to_x], [*y, *to_y]))
        .collect::<Result<_, _>>()?;
    let request = RouteRequest {
        goal: goal(&args.to)?,
        chart: &charted(&scenario, args.chart.as_deref())?,
        map: args.map.as_deref(),
        elevation: elevation.as_ref(),
        keep_out: &keep_out,
        resolution_m: args.resolution,
        around_m: args.around,
        options: options(args),
    };
    let planner = planner(&scenario, &request)?;
    if let Some(folder) = &args.costmaps {
        // Before the search: they show why there is no way.
        let written = planner.write_costmaps(folder, scenario.vehicle().name.as_str())?;
        eprintln!("{} costmaps in {}", written.len(), folder.display());
    }
    let route = planner
        .plan(&start(&scenario), &request.goal)
        .map_err(Error::NoRoute)?;
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

/// Files that are read, and not written over.
fn inputs(args: &PlanArgs) -> Vec<PathBuf> {
    let files = [
        args.chart.clone(),
        args.map.clone(),
        args.elevation.clone(),
        Some(args.scenario.clone().into()),
    ];
    files.into_iter().flatten().collect()
}

/// The heights of a map.
fn elevation(args: &PlanArgs) -> Result<Option<Elevation>, Error> {
    let Some(file) = &args.elevation else {
        return Ok(None);
    };
    match args.elevation_range[..] {
        [black_m, white_m] => Ok(Some(Elevation::new(file, black_m, white_m))),
        _ => Err(Error::Argument {
            name: "--elevation-range",
            value: format!("{:?}", args.elevation_range),
            allowed: "two numbers: the heights of black and white [m]",
        }),
    }
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

/// What the scenario's vehicle climbs.
pub(super) fn charted(scenario: &Scenario, file: Option<&Path>) -> Result<Chart, Error> {
    let vehicle = scenario.vehicle();
    let policy = scenario.control.law();
    let usual = || PathBuf::from("out").join(format!("chart-{}-{policy}.toml", vehicle.name));
    let file = match file {
        Some(file) => file.to_owned(),
        None => Some(usual())
            .filter(|file| file.exists())
            .ok_or_else(|| Error::NoChart {
                file: usual(),
                vehicle: vehicle.name.clone(),
                policy: policy.clone(),
            })?,
    };
    let chart = crate::chart::read(&file)?;
    chart.check_vehicle(&file.display().to_string(), vehicle)?;
    if chart.policy != policy {
        say(&format!(
            "{}: limits of {}, the scenario has {policy}",
            file.display(),
            chart.policy
        ));
    }
    Ok(Chart::read(&file)?)
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
