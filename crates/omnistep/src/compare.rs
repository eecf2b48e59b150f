//! `omnistep compare` and `omnistep run`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use omni_config::{Engine, Override, POLICIES, PathChoice, Precision, Scenario};
use omni_log::{FinishedLog, LogRun, RunLog};
use omni_sim::Outcome;
use omni_sim::controller::{AnyController, Firmware, LinkCounters};

use crate::Error;
use crate::args::RunArgs;
use crate::fault_messages::FaultMessages;
use crate::metrics::{Run, explained, results};
use crate::notices::{announce, warn_of_policies};
use crate::output::{print, print_path, say};
use crate::reasons::reasons;
use crate::retry_state::RetryState;
use crate::signals::stop_flag;

/// One line of `--json`, one row of the table.
#[derive(Serialize)]
struct Row {
    policy: String,
    // The engine is among the outcome's metrics.
    #[serde(flatten)]
    outcome: Outcome,
    steps_per_s: f64,
    realtime_factor: f64,
    mcap: PathBuf,
    /// For as long as it is reported, no other run replaces it.
    #[serde(skip)]
    _log: FinishedLog,
    /// What its drive found.
    #[serde(skip)]
    notes: FaultMessages,
    /// That it still tried at the end.
    #[serde(skip)]
    trying: Option<String>,
}

impl Row {
    /// Its column of the table, with its engine where runs of several stand beside one another.
    fn shown(&self, engines: bool) -> Run<'_> {
        let mut run = Run::new(&*self.policy, &self.outcome);
        if engines {
            run.labels.push(("engine", self.outcome.engine.name().to_owned()));
        }
        run.stopped = self.notes.stopped();
        run.realtime = Some(self.realtime_factor);
        run
    }
}

/// A key that one engine alone has is rejected where every engine runs; the message says who asked for that.
fn of_one_engine(mut error: omni_config::Error, engines: &[Engine]) -> omni_config::Error {
    if let omni_config::Error::Key { message, .. } = &mut error
        && !engines.is_empty()
        && message.contains("only with physics.engine")
    {
        message.push_str(" (--engines runs every engine)");
    }
    error
}

/// What a scenario is run under.
#[derive(Clone, Copy)]
pub(super) enum Policies<'a> {
    /// Every preset, and the scenario's own law where that is none of them.
    All,
    /// One instead of the scenario's own, as a key; none: its own.
    One(Option<&'a str>),
}

/// Runs the scenario under some policies with each engine (none: the scenario's own), with the
/// controller in `firmware` if there is one.
pub(super) fn compare(
    args: &RunArgs,
    policies: Policies<'_>,
    engines: &[Engine],
    firmware: Option<&Firmware>,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let mut overrides = args.overrides()?;
    if let Policies::One(Some(policy)) = policies {
        overrides.push(Override::new("control.policy", policy));
    }
    let for_all = |error| of_one_engine(error, engines);
    let mut scenario = Scenario::load(&args.scenario, &overrides).map_err(for_all)?;
    if firmware.is_some() {
        in_f32(args, &mut scenario)?;
        scenario = scenario.for_firmware();
    }
    let names = LogNames::new(args, &overrides)?;
    announce(&scenario);
    let mut runs = match policies {
        Policies::All => presets(&scenario)?,
        Policies::One(_) => vec![scenario.clone()],
    };
    warn_of_policies(&scenario, &runs);
    if !engines.is_empty() {
        let with = |run: &Scenario, engine: &Engine| {
            run.with(&args.scenario, &[Override::new("physics.engine", engine.name())])
        };
        let each = runs
            .iter()
            .flat_map(|run| engines.iter().map(move |engine| with(run, engine)));
        runs = each.collect::<Result<Vec<_>, _>>().map_err(for_all)?;
    }
    std::fs::create_dir_all(&args.out).map_err(|source| {
        let source = std::io::Error::new(
            source.kind(),
            format!("cannot create the folder of --out: {source}"),
        );
        Error::Io {
            path: args.out.clone(),
            source,
        }
    })?;

    let bar = if args.quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(1000 * runs.len() as u64)
    };
    if let Ok(style) = ProgressStyle::with_template("{msg:14} {bar:40} {percent:>3} % {eta:>4} left") {
        bar.set_style(style);
    }
    let stop = stop_flag();
    let (mut rows, mut failed) = (Vec::new(), None);
    for (k, run) in runs.iter().enumerate() {
        bar.set_message(run.control.law());
        let progress = |part: f64| bar.set_position(1000 * k as u64 + (1000.0 * part) as u64);
        let ran = one(run, firmware, &names.of(run), stop, progress);
        let (row, link, ended) = match ran {
            Ok(ran) => ran,
            Err(error) => {
                bar.finish_and_clear();
                if !args.json && !rows.is_empty() {
                    // What is done stands; why the rest is not there is said last, even if the table is not read.
                    let _ = show(&scenario, &rows, args.explain, out);
                }
                return Err(error);
            }
        };
        if let Some(link) = link.filter(|link| !link.is_zero()) {
            // The metrics remain valid, but describe a disturbed run.
            bar.suspend(|| say(&format!("messages lost on the link: {link}")));
        }
        if args.json {
            // One line as soon as it is known. Serialising plain numbers and strings cannot fail.
            let line = serde_json::to_string(&row).unwrap_or_default();
            bar.suspend(|| print(out, &format!("{line}\n")))?;
        }
        rows.push(row);
        failed = failed.or(ended);
    }
    bar.finish_and_clear();
    if !args.json {
        show(&scenario, &rows, args.explain, out)?;
    }
    // The table and the logs show how far a run came; that its physics failed is an error all the same.
    failed.map_or(Ok(()), |error| Err(error.into()))
}

/// The scenario under every preset, and under its own law where that is none of them.
fn presets(scenario: &Scenario) -> Result<Vec<Scenario>, omni_config::Error> {
    let own = (!scenario.control.is_preset()).then(|| Ok(scenario.clone()));
    let presets = POLICIES.map(|policy| scenario.with_policy(policy));
    presets.into_iter().chain(own).collect()
}

/// Prints the table of what was run, what its metrics say where that is asked for, and where the logs are.
fn show(scenario: &Scenario, rows: &[Row], explain: bool, out: &mut dyn Write) -> Result<(), Error> {
    let one = rows
        .iter()
        .all(|row| row.outcome.engine == scenario.physics.engine);
    let engine = if one {
        format!(", engine {}", scenario.physics.engine.name())
    } else {
        String::new()
    };
    let runs: Vec<_> = rows.iter().map(|row| row.shown(!one)).collect();
    let table = results("policy", &runs, if one { 1 } else { Engine::ALL.len() });
    print(out, &format!("{}{engine}\n{table}", headline(scenario)))?;
    for row in rows {
        let which = match (rows.len(), one) {
            (1, _) => None,
            (_, true) => Some(format!("policy {}", row.policy)),
            (_, false) => Some(format!(
                "policy {}, engine {}",
                row.policy,
                row.outcome.engine.name()
            )),
        };
        let of = which
            .as_ref()
            .map_or_else(String::new, |which| format!(", {which}"));
        print(out, &row.notes.text(&of))?;
        let which = which.map_or_else(String::new, |which| format!("{which}: "));
        let reasons = reasons(&row.outcome, scenario.vehicle().wheel.len());
        for line in reasons.iter().chain(&row.trying) {
            print(out, &format!("{which}{line}\n"))?;
        }
    }
    rows.iter().try_for_each(|row| print_path(out, &row.mcap))?;
    if explain {
        print(out, &explained(&runs))?;
    }
    Ok(())
}

/// Firmware computes in `f32`, and so does the scenario, also in its log. Only an override that asks for something else
/// is rejected; what a file says is overridden.
fn in_f32(args: &RunArgs, scenario: &mut Scenario) -> Result<(), Error> {
    let asked = args.overrides.iter().any(|text| {
        text.split_once('=')
            .is_some_and(|(key, _)| key.trim() == "control.precision")
    });
    if asked && scenario.control.precision != Precision::F32 {
        return Err(Error::Argument {
            name: "control.precision",
            value: format!("{:?}", scenario.control.precision).to_lowercase(),
            allowed: "f32 with --controller qemu",
        });
    }
    scenario.control.precision = Precision::F32;
    Ok(())
}

/// What logs are called.
struct LogNames<'a> {
    folder: &'a Path,
    /// The seed and the engine of the scenario's file.
    own_seed: u64,
    own_engine: Engine,
}

impl<'a> LogNames<'a> {
    fn new(args: &'a RunArgs, overrides: &[Override]) -> Result<Self, Error> {
        if args.json && args.out.to_str().is_none() {
            return Err(Error::Argument {
                name: "--out",
                value: format!("{:?}", args.out),
                allowed: "with --json, a folder whose name is UTF-8",
            });
        }
        let others: Vec<_> = overrides
            .iter()
            .filter(|each| each.key() != "seed")
            .cloned()
            .collect();
        Ok(Self {
            folder: &args.out,
            own_seed: Scenario::load(&args.scenario, &others)?.seed,
            // Of the file alone, which may not be a scenario without what is replaced.
            own_engine: Scenario::engine_of(&args.scenario)?.unwrap_or_default(),
        })
    }

    /// Runs that differ in their seed or engine have different names, so that they may go on side by side.
    fn of(&self, run: &Scenario) -> PathBuf {
        let seed = if run.seed == self.own_seed {
            String::new()
        } else {
            format!("-seed{}", run.seed)
        };
        let engine = if run.physics.engine == self.own_engine {
            String::new()
        } else {
            format!("-{}", run.physics.engine.name())
        };
        self.folder
            .join(format!("{}-{}{engine}{seed}.mcap", run.name, run.control.law()))
    }
}

fn one(
    scenario: &Scenario,
    firmware: Option<&Firmware>,
    path: &Path,
    stop: &AtomicBool,
    progress: impl Fn(f64),
) -> Result<(Row, Option<LinkCounters>, Option<omni_sim::Error>), Error> {
    let controller = match firmware {
        Some(firmware) => AnyController::in_qemu(scenario, firmware)?,
        None => AnyController::new(scenario)?,
    };
    let mut notes = FaultMessages::new(controller.columns().wheels());
    let mut trying = RetryState::new(scenario);
    let start = Instant::now();
    let mut log = RunLog::create(path, scenario, &controller)?;
    let mut simulated = 0.0;
    let interrupted = |time_s, part| Error::RunInterrupted {
        time_s,
        duration_s: scenario.duration_s,
        part,
    };
    let run = omni_sim::Run::new(scenario)
        .controller(controller)
        .watch(|simulation, part| {
            simulated = simulation.time_ns() as f64 * 1e-9;
            progress(part);
            let report = &simulation.sample().report;
            notes.look(simulation.time_ns(), report);
            trying.look(report);
            if stop.load(Ordering::SeqCst) {
                Err(interrupted(simulated, None))
            } else {
                Ok(())
            }
        });
    let logged = match run.log_to::<Error>(&mut log) {
        // Also where what ran beside it, as the processor in QEMU, was ended by the same signal.
        Err(_) if stop.load(Ordering::SeqCst) => {
            return Err(interrupted(simulated, Some(log.leave()?)));
        }
        logged => logged?,
    };
    let log = log.finish(&logged.outcome)?;
    let seconds = start.elapsed().as_secs_f64();
    let row = Row {
        policy: scenario.control.law(),
        trying: trying.note(&logged.outcome),
        outcome: logged.outcome,
        steps_per_s: simulated * 1e6 / scenario.physics.timestep_us as f64 / seconds,
        realtime_factor: simulated / seconds,
        mcap: log.path().to_owned(),
        _log: log,
        notes,
    };
    Ok((row, logged.link, logged.ended))
}

pub(super) fn headline(scenario: &Scenario) -> String {
    let command = &scenario.command;
    headline_for(
        scenario,
        &match (&command.path, &command.file) {
            (Some(PathChoice::Name(name)), _) => format!("along the path {name}"),
            (Some(_), _) => "along a path".to_owned(),
            (_, Some(file)) => format!("by a table of {} twists", file.rows().len()),
            _ if command.vy_m_s == 0.0 && command.wz_rad_s == 0.0 => format!("at {} m/s", command.vx_m_s),
            _ => format!(
                "at ({}, {}) m/s and {} rad/s",
                command.vx_m_s, command.vy_m_s, command.wz_rad_s
            ),
        },
    )
}

/// The same of a vehicle with another command than the scenario's.
pub(super) fn headline_for(scenario: &Scenario, commanded: &str) -> String {
    let vehicle = &scenario.vehicle().name;
    let torque = scenario.vehicle().motor.peak_torque_n_m();
    let wheels = 0..scenario.vehicle().wheel.len();
    let on = match wheels
        .clone()
        .filter(|wheel| scenario.rollers(*wheel).is_some())
        .count()
    {
        0 => "",
        some if some < wheels.len() => " on balls and rollers",
        _ => " on rollers",
    };
    let blocks = match scenario.block.len() {
        0 => String::new(),
        1 => " with 1 block".into(),
        count => format!(" with {count} blocks"),
    };
    format!(
        "{vehicle}{on} {}{blocks}, friction {}, {commanded}, torque limit {torque} N.m",
        scenario.terrain.described(),
        scenario.terrain.friction(),
    )
}
