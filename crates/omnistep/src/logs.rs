//! `omnistep info` and `omnistep replay`.

use std::io::Write;
use std::path::PathBuf;

use comfy_table::Table;
use serde::Serialize;

use omni_config::Override;
use omni_log::{LogFile, LogMessage, Replay, read_log, replay};
use omni_sim::{Outcome, ReportColumns};

use crate::Error;
use crate::args::parse_overrides;
use crate::fault_messages::FaultMessages;
use crate::metrics::{Run, explained, results};
use crate::output::{aligned, each, print};
use crate::reasons::reasons;

/// A log as `--json` shows it.
#[derive(Serialize)]
struct Inspected<'a> {
    file: String,
    run: &'a std::collections::BTreeMap<String, String>,
    complete: bool,
    until_s: f64,
    messages: &'a std::collections::BTreeMap<String, u64>,
    outcome: Option<Outcome>,
}

/// Reads logs from start to end, every checksum included, and prints what is in them. The exit code is the exit code of
/// the worst.
pub(super) fn info(paths: &[PathBuf], json: bool, explain: bool, out: &mut dyn Write) -> Result<u8, Error> {
    let mut files = Vec::new();
    let code = each(paths, |path| {
        let mut notes: Option<(ReportColumns, FaultMessages)> = None;
        let file = read_log(path, |time_ns, message| {
            if let LogMessage::ControllerSignals(signals) = message {
                let (columns, notes) = notes.get_or_insert_with(|| {
                    let columns = ReportColumns::named(&signals.name);
                    let notes = FaultMessages::new(columns.wheels());
                    (columns, notes)
                });
                if let Some(report) = columns.report(&signals.value) {
                    notes.look(time_ns, &report);
                }
            }
            Ok(())
        })?;
        if json {
            let shown = Inspected {
                file: path.display().to_string(),
                run: &file.run,
                complete: file.complete,
                until_s: file.until_ns as f64 / 1e9,
                messages: &file.counts,
                outcome: file.outcome,
            };
            // Serialising plain numbers and strings cannot fail.
            print(
                out,
                &format!("{}\n", serde_json::to_string(&shown).unwrap_or_default()),
            )?;
        } else {
            print(out, &described(&file))?;
            // The user's own controller may give its signals any names.
            notes = notes.filter(|_| file.scenario.drive.is_some() && !file.own_controller);
            if let Some((_, notes)) = &notes {
                print(out, &notes.text(""))?;
            }
            for line in file
                .outcome
                .iter()
                .flat_map(|outcome| reasons(outcome, file.scenario.vehicle().wheel.len()))
            {
                print(out, &format!("{line}\n"))?;
            }
        }
        files.push((file, notes.and_then(|(_, notes)| notes.stopped())));
        Ok(())
    });
    if json || files.is_empty() {
        return Ok(code);
    }
    let runs: Vec<_> = files
        .iter()
        .map(|(file, stopped)| shown(file, stopped.clone()))
        .collect();
    print(out, &results("log", &runs, 1))?;
    if explain {
        print(out, &explained(&runs))?;
    }
    Ok(code)
}

/// The engine that simulated: physics of one's own are in the outcome, not in the scenario.
fn engine(file: &LogFile) -> &'static str {
    let of_outcome = file.outcome.as_ref().map(|outcome| outcome.engine);
    of_outcome.unwrap_or(file.scenario.physics.engine).name()
}

/// Its column of the table.
fn shown(file: &LogFile, stopped: Option<String>) -> Run<'_> {
    let name = file.path.file_name().unwrap_or_default().to_string_lossy();
    // Of a controller of one's own the run says its name, the scenario does not.
    let policy = file.run.get("policy").cloned();
    let policy = policy.unwrap_or_else(|| file.scenario.control.law());
    let engine = if file.recorded { "-" } else { engine(file) };
    Run {
        name: name.into_owned(),
        labels: vec![("policy", policy), ("engine", engine.into())],
        outcome: file.outcome.as_ref(),
        otherwise: if file.recorded { "recorded" } else { "ended early" },
        stopped,
        realtime: None,
    }
}

fn described(file: &LogFile) -> String {
    let run = |key: &str| file.run.get(key).map_or("?", String::as_str);
    let path = file.path.display();
    let mut text = if file.recorded {
        let [source, vehicle, omnistep] = ["source", "vehicle", "omnistep"].map(run);
        format!("{path}: recorded, imported from {source}, vehicle {vehicle}, omnistep {omnistep}; ")
    } else {
        format!(
            "{path}: {} with {}, policy {}, seed {}, engine {}, omnistep {}; ",
            run("scenario"),
            run("vehicle"),
            run("policy"),
            run("seed"),
            engine(file),
            run("omnistep")
        )
    };
    let until_s = file.until_ns as f64 / 1e9;
    text += &if file.complete {
        format!("complete, {until_s} s, all checksums are correct\n")
    } else {
        format!("not finished: read up to {until_s} s, every checksum up to there is right\n")
    };
    for (topic, count) in &file.counts {
        text += &format!("  {count:8}  {topic}\n");
    }
    if file.foreign > 0 {
        text += &format!("  {:8}  of other topics\n", file.foreign);
    }
    text
}

/// Replays a log's measurements through its controller and prints the first difference.
pub(super) fn replayed(
    path: &PathBuf,
    policy: Option<&str>,
    overrides: &[String],
    out: &mut dyn Write,
) -> Result<(), Error> {
    let mut overrides = parse_overrides(overrides)?;
    overrides.extend(policy.map(|policy| Override::new("control.policy", policy)));
    let replay = replay(path, &overrides)?;
    print(out, &said(&replay))?;
    if !overrides.is_empty() || replay.file.recorded {
        print(out, &format!("{}\n", torques(&replay)))?;
    }
    Ok(())
}

fn said(replay: &Replay) -> String {
    let (file, periods) = (replay.file.path.display(), replay.periods);
    if replay.file.recorded {
        let compared = replay.wheels.iter().map(|wheel| wheel.compared).max();
        return format!(
            "{file}: policy {}: {periods} control periods of a recording; it has torques in {}, no command in {}, no velocity of some wheel in {}\n",
            replay.policy,
            compared.unwrap_or(0),
            replay.without_command,
            replay.without_measurement
        );
    }
    let Some(first) = &replay.first else {
        return format!(
            "{file}: policy {}: {periods} control periods, bit-identical\n",
            replay.policy
        );
    };
    let wheel = first
        .wheel
        .as_ref()
        .map_or(String::new(), |wheel| format!("wheel {wheel}, "));
    format!(
        "{file}: policy {}: {} of {periods} control periods differ, first at t = {} s (period {}): {wheel}{}: logged {}, replayed {}\n",
        replay.policy,
        replay.differing,
        first.time_ns as f64 / 1e9,
        first.period,
        first.signal,
        first.logged,
        first.replayed
    )
}

fn torques(replay: &Replay) -> Table {
    let headings = [
        "wheel",
        "logged rms [N.m]",
        "replayed rms [N.m]",
        "largest difference [N.m]",
        "at [s]",
    ];
    let rows = replay.wheels.iter().map(|wheel| {
        if wheel.compared == 0 {
            return std::array::from_fn(|k| if k == 0 { wheel.wheel.clone() } else { "-".into() });
        }
        [
            wheel.wheel.clone(),
            format!("{:.4}", wheel.logged_rms_n_m),
            format!("{:.4}", wheel.replayed_rms_n_m),
            format!("{:.4}", wheel.largest_n_m),
            format!("{:.3}", wheel.largest_at_ns as f64 / 1e9),
        ]
    });
    aligned(headings, rows, 1)
}
