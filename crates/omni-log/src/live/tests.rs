//! Live runs without anybody who watches.

use std::fs;

use omni_config::{Override, Scenario};

use super::*;
use crate::{LogRun, RunLog};
use omni_sim::Run;

fn scenario() -> Scenario {
    Scenario::load("flat", &[Override::new("duration_s", 0.5)]).expect("built-in")
}

/// What a watcher ends a run with.
fn stop() -> omni_sim::Error {
    omni_sim::Error::Argument {
        name: "stop",
        value: "now".into(),
        allowed: "nothing",
    }
}

/// As fast as it goes.
fn fast() -> Live {
    let mut live = Live::new(0);
    live.real_time_factor = f64::INFINITY;
    live
}

fn ran(
    live: &Live,
    watch: impl FnMut(Option<&Simulation>, f64) -> Result<ControlFlow<()>, Error>,
) -> Result<Outcome, Error> {
    let (outcome, ended) = run_live(&scenario(), live, |_| {}, |line| panic!("{line}"), watch)?;
    assert!(ended.is_none(), "{ended:?}");
    Ok(outcome)
}

#[test]
fn the_log_of_a_live_run_is_that_of_the_run_byte_by_byte() {
    let folder = tempfile::tempdir().expect("a folder");
    let [alone, live_one] = ["alone", "live"].map(|name| folder.path().join(format!("{name}.mcap")));
    let scenario = scenario();
    let controller = AnyController::new(&scenario).expect("built-in");
    let mut log = RunLog::create(&alone, &scenario, &controller).expect("a log");
    let run = Run::new(&scenario)
        .controller(controller)
        .log_to::<Error>(&mut log)
        .expect("a run");
    log.finish(&run.outcome).expect("a log");
    let mut live = fast();
    live.log = Some(live_one.clone());
    let outcome = ran(&live, |_, _| Ok(ControlFlow::Continue(()))).expect("a run");
    assert_eq!(outcome, run.outcome);
    assert!(
        fs::read(alone).expect("a file") == fs::read(live_one).expect("a file"),
        "the logs differ"
    );
}

#[test]
fn a_run_without_an_end_goes_on_at_rest_beyond_its_scenario_until_it_is_stopped() {
    let mut live = fast();
    live.until = Until::Stopped;
    let mut commands = Vec::new();
    let outcome = ran(&live, |simulation, part| {
        assert!(part.abs() < f64::EPSILON, "no part of what has no end");
        let Some(simulation) = simulation else {
            return Ok(ControlFlow::Continue(()));
        };
        commands.push(simulation.sample().asked.vx_m_s);
        Ok(if commands.len() < 2000 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        })
    });
    assert!(outcome.is_ok());
    // Its scenario has 500 periods; the command of the last of them is the ramp's.
    assert!(commands[499] > 0.1, "{}", commands[499]);
    assert!(commands[500..].iter().all(|command| *command == 0.0));
    assert_eq!(commands.len(), 2000);
}

#[test]
fn a_run_ends_after_so_many_seconds_and_an_error_leaves_its_log_unfinished() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.mcap");
    let mut live = fast();
    (live.until, live.log) = (Until::Seconds(0.75), Some(path.clone()));
    let mut periods = 0;
    let outcome = ran(&live, |simulation, _| {
        periods += usize::from(simulation.is_some());
        Ok(ControlFlow::Continue(()))
    });
    assert!(outcome.is_ok() && path.exists());
    assert_eq!(periods, 750); // of 1 ms
    let failed = ran(&live, |simulation, part| match simulation {
        Some(_) if part > 0.5 => Err(stop().into()),
        _ => Ok(ControlFlow::Continue(())),
    });
    assert!(failed.is_err() && folder.path().join("drive.mcap.part").exists());
}

#[test]
fn what_a_live_run_cannot_do_is_refused_in_a_line() {
    let said = |change: &dyn Fn(&mut Live)| {
        let mut live = fast();
        change(&mut live);
        let refused = ran(&live, |_, _| Ok(ControlFlow::Continue(())));
        refused.err().map(|error| error.to_string()).unwrap_or_default()
    };
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let line = said(&|live| live.until = Until::Seconds(seconds));
        assert_eq!(
            line,
            format!("--duration = {seconds}, allowed: above 0, at most 1e9 s")
        );
    }
    let line = said(&|live| (live.allow_control, live.log) = (true, Some("drive.mcap".into())));
    assert_eq!(
        line,
        "--allow-control = true, allowed: only without --log, because a log has one policy from start to end"
    );
    assert!(said(&|live| live.origins = vec!["x".into()]).starts_with("--allow-origin = x, allowed: "));
}
