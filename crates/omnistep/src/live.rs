//! `omnistep run --live`.

use std::io::Write;
use std::sync::atomic::Ordering;

use omni_config::Scenario;
use omni_log::{Live, run_live};
use omni_sim::Simulation;

use crate::Error;
use crate::args::{LiveArgs, RunArgs};
use crate::compare::{headline, policy_key};
use crate::figures::{cells, figures, headings};
use crate::notices::announce;
use crate::output::{BEYOND_BALLS, aligned, print, say};
use crate::signals::stop_flag;

/// Runs the scenario in step with the clock, served to viewers, and prints its row.
pub(super) fn live(
    args: &RunArgs,
    policy: Option<&str>,
    live: LiveArgs,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let mut overrides = args.overrides()?;
    if let Some(policy) = policy {
        overrides.push(policy_key(policy)?);
    }
    let scenario = Scenario::load(&args.scenario, &overrides)?;
    announce(&scenario);
    let asked = live;
    let mut live = Live::new(asked.port);
    (live.speed, live.wait, live.steer) = (asked.speed, asked.wait, asked.steer);
    live.origins = asked.origins;
    let started = |address: &str| {
        say(&format!(
            "serving {address}: open it in Foxglove or Lichtblick (Foxglove WebSocket); Ctrl-C ends it"
        ));
    };
    let warn = |line: &str| say(&format!("live: {line}"));
    let stop = stop_flag();
    let watch = |simulation: Option<&Simulation>, _| {
        if !stop.load(Ordering::SeqCst) {
            return Ok(());
        }
        Err(Error::RunInterrupted {
            time_s: simulation.map_or(0.0, |simulation| simulation.time_ns() as f64 * 1e-9),
            duration_s: scenario.duration_s,
            part: None,
        })
    };
    let (outcome, ended) = run_live(&scenario, &live, started, warn, watch)?;
    if args.json {
        // Serialising plain numbers and strings cannot fail.
        print(
            out,
            &format!("{}\n", serde_json::to_string(&outcome).unwrap_or_default()),
        )?;
    } else {
        let shown = figures([&outcome]);
        let row: Vec<_> = cells(&outcome, &shown).collect();
        let table = aligned(headings(&shown), [row], shown.len() + 1);
        let engine = outcome.engine.name();
        print(
            out,
            &format!("{}, engine {engine}\n{table}\n", headline(&scenario)),
        )?;
        if !outcome.wheel_model_valid {
            print(out, &format!("{BEYOND_BALLS}\n"))?;
        }
    }
    ended.map_or(Ok(()), |error| Err(error.into()))
}
