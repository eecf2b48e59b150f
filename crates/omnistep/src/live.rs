//! `omnistep run --live` and `omnistep run --ros2`.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use omni_config::{Override, Scenario};
use omni_log::{Live, Opened, Until, run_live};
use omni_sim::{Outcome, Simulation};

use crate::Error;
use crate::args::{LiveArgs, RunArgs};
use crate::compare::{headline, headline_for};
use crate::metrics::{Run, explained, results};
use crate::notices::announce;
use crate::output::{print, print_path, say};
use crate::signals::stop_flag;

/// Runs the scenario in step with the clock, shown to others, and prints its row.
pub(super) fn live(
    args: &RunArgs,
    policy: Option<&str>,
    live: LiveArgs,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let mut overrides = args.overrides()?;
    if let Some(policy) = policy {
        overrides.push(Override::new("control.policy", policy));
    }
    let scenario = Scenario::load(&args.scenario, &overrides)?;
    announce(&scenario);
    let seconds = live.duration;
    #[cfg(feature = "ros2")]
    let chart = live.on_ros2.chart.clone();
    let live = asked(live)?;
    #[cfg(feature = "ros2")]
    let live = match chart {
        Some(chart) => crate::ros2::with_goals(live, &scenario, &chart)?,
        None => live,
    };
    let opened = |opened: &Opened| match opened {
        Opened::Port(address) => say(&format!(
            "serving {address}: open it in Foxglove or Lichtblick (Foxglove WebSocket), or {} in a browser; Ctrl-C ends it",
            page_of(address)
        )),
        #[cfg(feature = "ros2")]
        Opened::Ros2(domain) => crate::ros2::announce(*domain, &live),
        _ => {}
    };
    let about = if live.port.is_some() { "live" } else { "ros2" };
    let warn = move |line: &str| say(&format!("{about}: {line}"));
    let stop = stop_flag();
    let mut waits = false;
    let watch = |simulation: Option<&Simulation>, _| match simulation {
        None if !std::mem::replace(&mut waits, true) => {
            say("waiting for the first subscriber");
            Ok(ControlFlow::Continue(()))
        }
        _ if !stop.load(Ordering::SeqCst) => Ok(ControlFlow::Continue(())),
        // What has no end of its own is not cut short.
        Some(_) if live.until == Until::Stopped => Ok(ControlFlow::Break(())),
        _ => Err(Error::RunInterrupted {
            time_s: simulation.map_or(0.0, |simulation| simulation.time_ns() as f64 * 1e-9),
            duration_s: seconds.unwrap_or(scenario.duration_s),
            part: None,
        }),
    };
    let ran = run_live(&scenario, &live, opened, warn, watch).map_err(|error| match error {
        Error::RunInterrupted {
            time_s, duration_s, ..
        } => Error::RunInterrupted {
            time_s,
            duration_s,
            part: live.log.clone().map(unfinished),
        },
        other => other,
    });
    let (outcome, ended) = ran?;
    show(&headline_of(&scenario, &live), &outcome, args.json, out)?;
    if let Some(log) = live.log.filter(|_| !args.json) {
        print_path(out, &log)?;
    }
    if args.explain {
        explain(&outcome, out)?;
    }
    ended.map_or(Ok(()), |error| Err(error.into()))
}

/// What the table is of: others may have commanded more than its scenario.
fn headline_of(scenario: &Scenario, live: &Live) -> String {
    #[cfg(feature = "ros2")]
    if live.ros2.is_some() {
        return headline_for(scenario, "driven over ROS 2");
    }
    if live.allow_control {
        return headline_for(scenario, "driven by viewers");
    }
    headline(scenario)
}

/// The page of a run, by its address for viewers.
pub(super) fn page_of(address: &str) -> String {
    address.replacen("ws", "http", 1)
}

/// Meaning of a run's metrics.
pub(super) fn explain(outcome: &Outcome, out: &mut dyn Write) -> Result<(), Error> {
    print(out, &explained(&[Run::new("this run", outcome)]))
}

/// What a run came to: a table, or JSON.
pub(super) fn show(headline: &str, outcome: &Outcome, json: bool, out: &mut dyn Write) -> Result<(), Error> {
    if json {
        // Serialising plain numbers and strings cannot fail.
        print(
            out,
            &format!("{}\n", serde_json::to_string(outcome).unwrap_or_default()),
        )?;
    } else {
        let runs = [Run::new("this run", outcome)];
        let (table, engine) = (results("metric", &runs, 1), outcome.engine.name());
        print(out, &format!("{headline}, engine {engine}\n{table}"))?;
    }
    Ok(())
}

/// The file of a log that has no end.
fn unfinished(log: PathBuf) -> PathBuf {
    let mut name = log.into_os_string();
    name.push(".part");
    name.into()
}

/// The run as it is asked for.
fn asked(args: LiveArgs) -> Result<Live, Error> {
    let mut live = Live::new(args.port);
    #[cfg(feature = "ros2")]
    if args.on_ros2.ros2 {
        live = Live::on_ros2(crate::ros2::ros2(args.on_ros2)?);
        live.port = args.live.then_some(args.port);
    }
    if let Some(seconds) = args.duration {
        live.until = Until::Seconds(seconds);
    }
    (live.real_time_factor, live.wait) = (args.real_time_factor, args.wait);
    live.allow_control = args.allow_control;
    (live.origins, live.log) = (args.origins, args.log);
    Ok(live)
}
