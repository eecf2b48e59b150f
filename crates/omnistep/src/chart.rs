//! `omnistep chart`.

use std::cell::RefCell;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use comfy_table::Table;
use omni_config::{MOST_TOML_BYTES, read_regular};
use omni_study::{Chart, ChartCell, ChartPlan, ChartSetup, Edge};

use crate::Error;
use crate::args::{ChartArgs, parse_overrides};
use crate::notices::announce_vehicle;
use crate::output::{aligned, print, print_path, write_file};
use crate::signals::stop_flag;
use crate::study::bar;

/// Makes a chart, or what is missing of one, and prints its table. The file has every finished cell at any time.
pub(super) fn chart(args: &ChartArgs, out: &mut dyn Write) -> Result<(), Error> {
    let plan = ChartPlan::new(&setup(args)?)?;
    announce_vehicle(plan.level());
    let empty = plan.empty();
    let file = match &args.out {
        Some(file) => file.clone(),
        None => PathBuf::from("out").join(format!("chart-{}-{}.toml", empty.vehicle, empty.policy)),
    };
    let before = if args.resume && file.exists() {
        read(&file)?
    } else {
        empty
    };
    let missing = plan.missing(&before).count();
    let start = Instant::now();
    let bar = bar(args.quiet, missing, "{bar:40} {pos}/{len} cells, {eta} left");
    // What went wrong with the file is said as the command's error.
    let unwritten = RefCell::new(None);
    let made = omni_study::chart(&plan, &before, args.jobs, stop_flag(), |chart| {
        bar.inc(1);
        write(&file, chart).map_err(|error| {
            *unwritten.borrow_mut() = Some(error);
            omni_study::Error::Stopped
        })
    });
    bar.finish_and_clear();
    let made = match (made, unwritten.take()) {
        (_, Some(error)) => return Err(error),
        (made, None) => made?,
    };
    let left = plan.missing(&made).count();
    if left > 0 {
        return Err(Error::ChartInterrupted {
            done: missing - left,
            cells: missing,
            file,
        });
    }
    if missing == 0 {
        write(&file, &made)?;
    }
    if args.json {
        for cell in &made.cell {
            // Serialising plain numbers and strings cannot fail.
            let line = serde_json::to_string(cell).unwrap_or_default();
            print(out, &format!("{line}\n"))?;
        }
        return Ok(());
    }
    print(out, &format!("{}\n{}\n", headline(&made), table(&made)))?;
    let there = made.cell.len() - missing;
    let kept = if there > 0 {
        format!(", {there} of them done before")
    } else {
        String::new()
    };
    let seconds = start.elapsed().as_secs_f64();
    let (count, s) = (made.cell.len(), if made.cell.len() == 1 { "" } else { "s" });
    print(out, &format!("{count} cell{s}{kept}; {seconds:.1} s\n"))?;
    print_path(out, &file)
}

fn setup(args: &ChartArgs) -> Result<ChartSetup, Error> {
    Ok(ChartSetup {
        overrides: parse_overrides(&args.overrides)?,
        policy: args.policy.clone(),
        friction: args.friction,
        speed_m_s: args.speed,
        margin: args.margin,
        starts: args.starts,
        edges: args.edge.iter().map(|edge| Edge::from(*edge)).collect(),
        sides_deg: args.side.clone(),
        skews_deg: args.skew.clone(),
        ..ChartSetup::new(args.vehicle.as_str())
    })
}

/// The chart of a file.
pub(crate) fn read(file: &Path) -> Result<Chart, Error> {
    let failed = |source| Error::Io {
        path: file.into(),
        source,
    };
    let bytes = read_regular(file, MOST_TOML_BYTES).map_err(failed)?;
    let text = String::from_utf8(bytes).map_err(|error| failed(std::io::Error::other(error)))?;
    Ok(Chart::from_toml(&file.display().to_string(), &text)?)
}

fn write(file: &Path, chart: &Chart) -> Result<(), Error> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(|source| Error::Io {
            path: folder.into(),
            source,
        })?;
    }
    write_file(file, &chart.to_toml()?, &[])
}

/// `chugo7 under traction, friction 0.7, 0.3 m/s: ...`.
fn headline(chart: &Chart) -> String {
    let mirrored = if chart.mirrored {
        "; to the right as to the left"
    } else {
        ""
    };
    format!(
        "{} under {}, friction {}, {} m/s: sizes to plan with [mm] ({} of the limit), the limit, and what ends it{mirrored}",
        chart.vehicle, chart.policy, chart.friction, chart.speed_m_s, chart.margin
    )
}

/// A row for each side and skew, a column for each edge.
fn table(chart: &Chart) -> Table {
    let edges: Vec<Edge> = Edge::ALL
        .into_iter()
        .filter(|edge| chart.cell.iter().any(|cell| cell.edge == *edge))
        .collect();
    let mut places: Vec<[f64; 2]> = chart
        .cell
        .iter()
        .map(|cell| [cell.skew_deg, cell.side_deg])
        .collect();
    places.sort_by(|one, other| one[0].total_cmp(&other[0]).then(one[1].total_cmp(&other[1])));
    places.dedup();
    let headings = ["side [deg]", "skew [deg]"].map(str::to_owned);
    let headings: Vec<String> = headings
        .into_iter()
        .chain(edges.iter().map(|edge| edge.name().to_owned()))
        .collect();
    let rows = places.iter().map(|[skew, side]| {
        let of = |edge: &Edge| {
            let mut cells = chart.cell.iter();
            let cell =
                cells.find(|cell| cell.edge == *edge && [cell.skew_deg, cell.side_deg] == [*skew, *side]);
            cell.map_or_else(String::new, shown)
        };
        let place = [side.to_string(), skew.to_string()];
        place.into_iter().chain(edges.iter().map(of)).collect::<Vec<_>>()
    });
    aligned(headings, rows, 0)
}

fn shown(cell: &ChartCell) -> String {
    let [climbs, limit] = [cell.climbs_m, cell.limit_m].map(|size_m| 1e3 * size_m);
    format!("{climbs:.1} of {limit:.1}, {}", cell.because)
}
