//! `omnistep study`.

mod tables;

use std::io::Write;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value};

use super::{StudyArgs, parse_overrides, print};
use crate::Error;
use crate::config::{Seeds, Study};
use crate::study::{MapCell, Plan, Store, cells, compute};

/// Set by Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

pub(super) fn study(args: &StudyArgs, out: &mut dyn Write) -> Result<(), Error> {
    let mut study = Study::load(&args.study)?;
    if let Some(count) = args.seeds {
        study.seeds = Seeds::Count(count);
    }
    let plan = Plan::new(&study, &parse_overrides(&args.overrides)?)?;
    let folder = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from("out").join(&study.name));
    let store = Store::new(folder, &plan)?;
    let _lock = store.lock()?;
    if args.retry_errors {
        store.forget_errors()?;
    }
    let found = store.read()?;
    for (path, reason) in &found.damaged {
        let _ = writeln!(
            std::io::stderr(),
            "{}: cannot be read ({reason}): set aside as .damaged, its runs are run again",
            path.display()
        );
    }
    let missing = plan.missing(&found);
    on_ctrl_c();
    let start = Instant::now();
    let bar = progress(args, missing.len());
    let mut errors = 0_usize;
    let computed = compute(&missing, &store, args.jobs, &STOP, |row| {
        if row.error.is_some() {
            errors += 1;
            bar.set_message(format!("{errors} failed"));
        }
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    let runs = plan.runs().len();
    if computed.rows < missing.len() {
        return Err(Error::Interrupted {
            done: runs - missing.len() + computed.rows,
            runs,
            folder: store.folder().into(),
        });
    }
    let rows = store.read()?.rows;
    let map = cells(&plan, &rows);
    if args.json {
        return json(&plan, &map, out);
    }
    print(out, &tables::tables(&plan, &map))?;
    let mut line = format!("{runs} runs");
    if computed.rows < runs {
        line += &format!(", {} of them done before", runs - computed.rows);
    }
    if computed.rows > 0 {
        let seconds = start.elapsed().as_secs_f64();
        line += &format!("; {seconds:.1} s, {:.1} runs/s", computed.rows as f64 / seconds);
    }
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
            &format!("the first of {failed} that failed, seed {}: {error}\n", row.seed),
        )?;
    }
    Ok(())
}

/// `climb_map: 320 runs: 64 combinations of 3 axes with 5 seeds, scenario step`.
pub(super) fn described(study: &Study, combinations: usize) -> String {
    let seeds = study.seeds.list().len();
    format!(
        "{}: {} runs, {combinations} combinations of {} axes with {seeds} seeds; scenario {}",
        study.name,
        combinations * seeds,
        study.axis.len(),
        study.scenario
    )
}

/// The first Ctrl-C asks for an orderly end, the second one ends at once.
fn on_ctrl_c() {
    static ONCE: OnceLock<()> = OnceLock::new();
    STOP.store(false, Ordering::Relaxed);
    ONCE.get_or_init(|| {
        // Without a handler Ctrl-C ends at once, and what is written is kept all the same.
        let _ = ctrlc::set_handler(|| {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
    });
}

fn progress(args: &StudyArgs, runs: usize) -> ProgressBar {
    if args.quiet || runs == 0 {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(runs as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {eta} left {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

/// One object a cell: each axis by its column, `runs`, `errors`, the mean of each figure.
fn json(plan: &Plan, map: &[MapCell], out: &mut dyn Write) -> Result<(), Error> {
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
        for (i, figure) in plan.study().map.figures.iter().enumerate() {
            object.insert(figure.clone(), cell.mean(i).map_or(Value::Null, Value::from));
        }
        print(out, &format!("{}\n", Value::Object(object)))?;
    }
    Ok(())
}
