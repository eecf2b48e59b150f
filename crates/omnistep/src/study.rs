//! `omnistep study`.

mod tables;

use std::collections::BTreeSet;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value};

use omni_config::{Override, Seeds, Study};
use omni_study::{MapCell, PairedCell, Plan, Store, cells, compute, paired};

use crate::Error;
use crate::args::{StudyArgs, parse_overrides, whole};
use crate::notices;
use crate::output::{print, say, warn};
use crate::signals::stop_flag;

pub(super) fn study(args: &StudyArgs, out: &mut dyn Write) -> Result<(), Error> {
    let plan = planned(args)?;
    let baseline = args.baseline.as_deref().map(Override::parse).transpose()?;
    let compared = |rows: &[_]| match &baseline {
        Some(baseline) => paired(&plan, rows, baseline, &plan.study().map.metrics),
        None => Ok(Vec::new()),
    };
    compared(&[])?; // what is wrong with it is said before hours of runs
    warn_of(&plan);
    let folder = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from("out").join(&plan.study().name));
    let store = Store::new(folder, &plan)?;
    let _lock = store.lock()?;
    if args.retry_errors {
        store.forget_errors()?;
    }
    let found = store.read()?;
    for (path, reason) in &found.damaged {
        say(&format!(
            "{}: cannot be read ({reason}); renamed to .damaged, its runs are repeated",
            path.display()
        ));
    }
    let missing = plan.missing(&found);
    let stop = stop_flag();
    let start = Instant::now();
    let bar = bar(
        args.quiet,
        missing.len(),
        "{bar:40} {pos}/{len} runs, {eta} left {msg}",
    );
    let mut errors = 0_usize;
    let computed = compute(&missing, &store, args.jobs, stop, |row| {
        if row.error.is_some() {
            errors += 1;
            bar.set_message(format!("{errors} failed"));
        }
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    let runs = plan.runs().len();
    if computed.rows < missing.len() {
        return Err(Error::StudyInterrupted {
            done: runs - missing.len() + computed.rows,
            runs,
            folder: store.folder().into(),
        });
    }
    let rows = store.read()?.rows;
    let map = cells(&plan, &rows);
    if args.json {
        return json(&plan, &map, &compared(&rows)?, out);
    }
    print(out, &tables::tables(&plan, &map))?;
    if let Some(baseline) = &baseline {
        print(out, &tables::baseline(&plan, baseline, &compared(&rows)?))?;
    }
    let line = counted(&plan, computed.rows, start.elapsed());
    let failed = map.iter().map(|cell| cell.errors).sum::<usize>();
    print(
        out,
        &format!("{line}; {failed} failed; {}\n", store.folder().display()),
    )?;
    let of_plan = |key: &str| plan.runs().iter().any(|run| run.key == key);
    if let Some(row) = rows.iter().find(|row| row.error.is_some() && of_plan(&row.key)) {
        let error = row.error.as_deref().unwrap_or_default();
        print(
            out,
            &format!("the first of {failed} failed runs, seed {}: {error}\n", row.seed),
        )?;
    }
    Ok(())
}

/// The plan of the study that the arguments ask for.
fn planned(args: &StudyArgs) -> Result<Plan, Error> {
    let mut study = Study::load(&args.study)?;
    if let Some(count) = &args.seeds {
        let count = whole("--seeds", count, 1..=100_000, "a whole number, 1 to 100000")?;
        study.seeds = Seeds::Count(count.unsigned_abs() as u32);
    }
    let mut overrides = parse_overrides(&args.overrides)?;
    if args.stop_when_done {
        overrides.push(Override::new("stop_when_done", true));
    }
    Ok(Plan::new(&study, &overrides)?)
}

/// Warns of what is doubtful of the runs.
fn warn_of(plan: &Plan) {
    if let Some(short) = too_short(plan) {
        warn(&short);
    }
    let said = [notices::beyond_balls, notices::coarse].map(|why| plan.said_of(why));
    for why in said.iter().flatten().chain(&plan.policy_notes()) {
        warn(why);
    }
}

/// `400 runs, 100 of them done before; 30.0 s, 10.0 runs/s; engine articulated`.
fn counted(plan: &Plan, computed: usize, took: Duration) -> String {
    let runs = plan.runs().len();
    let mut line = format!("{runs} runs");
    if computed < runs {
        line += &format!(", {} of them done before", runs - computed);
    }
    if computed > 0 {
        let seconds = took.as_secs_f64();
        line += &format!("; {seconds:.1} s, {:.1} runs/s", computed as f64 / seconds);
    }
    if let Some(run) = plan.runs().first()
        && plan.study().axis.iter().all(|axis| axis.key != "physics.engine")
    {
        line += &format!("; engine {}", run.scenario().physics.engine.name());
    }
    line
}

/// `climb_map: 400 runs: 80 combinations of 3 axes with 5 seeds, scenario step`.
fn described(study: &Study, combinations: usize) -> String {
    let seeds = study.seeds.list().len();
    format!(
        "{}: {} runs, {combinations} combinations of {} axes with {seeds} seeds; scenario {}",
        study.name,
        combinations * seeds,
        study.axis.len(),
        study.scenario
    )
}

/// What a study is, every value of every axis checked alone, and what is to be said of those on balls that
/// are not their wheels. Doubtful: what is so of a vehicle, the first run that ends before its vehicle can
/// be across, the first whose encoders are too coarse, and the first whose traction control lacks something.
pub(super) fn checked(study: &Study) -> Result<(String, Vec<String>, Option<String>), Error> {
    let mut looked_at = 0;
    let (mut beyond, mut short, mut coarse) = (Vec::new(), Vec::new(), Vec::new());
    let mut without = Vec::new();
    let mut of_vehicles = BTreeSet::new();
    let combinations = Plan::check(study, |scenario| {
        looked_at += 1;
        beyond.extend(notices::beyond_balls(scenario));
        short.extend(scenario.too_short());
        coarse.extend(notices::coarse(scenario));
        let notes = scenario.traction_notes();
        without.extend((!notes.is_empty()).then(|| notes.join("; ")));
        of_vehicles.extend(scenario.vehicle().doubts(scenario.period_s()).unwrap_or_default());
    })?;
    let seeds = study.seeds.list().len();
    let some = |count: usize| {
        if looked_at == combinations {
            format!("{} of {} runs", seeds * count, seeds * combinations)
        } else {
            format!("{count} of the {looked_at} combinations that were checked")
        }
    };
    let mut doubts: Vec<String> = of_vehicles.into_iter().collect();
    if let Some(first) = short.first() {
        let runs = some(short.len());
        doubts.push(format!("{runs} cannot finish in time; the first: {first}"));
    }
    for found in [coarse, without] {
        if let Some(first) = found.first() {
            doubts.push(format!("{}: {first}", some(found.len())));
        }
    }
    let warning = beyond
        .first()
        .map(|first| format!("{}: {first}", some(beyond.len())));
    Ok((described(study, combinations), doubts, warning))
}

/// Number of a study's runs that end before their vehicle can be across, and the reason for the first of them; none if
/// all may get across.
fn too_short(plan: &Plan) -> Option<String> {
    let seeds = plan.study().seeds.list().len().max(1);
    // All seeds of a combination have the same time and way.
    let short = plan.runs().iter().step_by(seeds).filter_map(|run| {
        let said = run.too_short()?;
        let axes = plan.study().axis.iter().zip(&*run.axes);
        let axes: Vec<_> = axes
            .map(|(axis, value)| format!("{} = {value}", axis.key))
            .collect();
        Some((axes.join(", "), said))
    });
    let mut short = short.peekable();
    let (axes, said) = short.peek().cloned()?;
    let (name, runs, all) = (&plan.study().name, short.count() * seeds, plan.runs().len());
    let first = if axes.is_empty() {
        String::new()
    } else {
        format!("the first with {axes}: ")
    };
    Some(format!(
        "{name}: {runs} of {all} runs cannot finish in time; {first}{said}"
    ))
}

/// A bar of so many steps on standard error; hidden where it was asked for or there is nothing to do.
pub(crate) fn bar(quiet: bool, steps: usize, template: &str) -> ProgressBar {
    if quiet || steps == 0 {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(steps as u64);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

/// One object a cell: each axis by its column, `runs`, `errors`, `unfinished`, `beyond_balls`, the mean of
/// each metric with the ends of its interval; and what the cell is against its fellow, where it is compared.
fn json(plan: &Plan, map: &[MapCell], compared: &[PairedCell], out: &mut dyn Write) -> Result<(), Error> {
    for cell in map {
        let mut object = Map::new();
        for (column, value) in plan.columns().axes.iter().zip(&cell.axes) {
            object.insert(
                column.name.clone(),
                serde_json::to_value(value).unwrap_or_default(),
            );
        }
        object.insert("runs".into(), cell.runs.into());
        object.insert("errors".into(), cell.errors.into());
        object.insert("unfinished".into(), cell.unfinished.into());
        object.insert("beyond_balls".into(), cell.beyond_balls.into());
        for (i, metric) in plan.study().map.metrics.iter().enumerate() {
            let [low, high] = cell.intervals[i].map_or([None; 2], |ends| ends.map(Some));
            let number = |number: Option<f64>| number.map_or(Value::Null, Value::from);
            object.insert(metric.clone(), number(cell.mean(i)));
            object.insert(format!("{metric}_low"), number(low));
            object.insert(format!("{metric}_high"), number(high));
            if let Some(pair) = compared.iter().find(|pair| pair.axes == cell.axes) {
                let pair = &pair.metrics[i];
                let [low, high] = pair.interval.map_or([None; 2], |ends| ends.map(Some));
                object.insert(format!("{metric}_pairs"), pair.pairs.into());
                object.insert(format!("{metric}_difference"), number(pair.mean));
                object.insert(format!("{metric}_difference_low"), number(low));
                object.insert(format!("{metric}_difference_high"), number(high));
                if let Some([here, there]) = pair.only {
                    object.insert(format!("{metric}_only_here"), here.into());
                    object.insert(format!("{metric}_only_there"), there.into());
                }
            }
        }
        print(out, &format!("{}\n", Value::Object(object)))?;
    }
    Ok(())
}
