//! A run that a page steps.

use std::collections::BTreeMap;
use std::fmt::Write;

use omni_core::BodyTwist;
use omni_log::{InMemory, RunLog, View};
use omni_sim::config::{CommandFile, Override, Scenario, WheelModel, builtin_scenarios};
use omni_sim::controller::AnyController;
use omni_sim::{Metric, Outcome, Simulation, SteppedRun, Verdict, control_periods};
use serde::Deserialize;
use serde_json::{Value, json};

/// What a run is made of; it comes from a page, and is not trusted.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// A built-in scenario.
    pub scenario: String,
    /// Its policy; the scenario's own if left out.
    #[serde(default)]
    pub policy: Option<String>,
    /// Keys and values, as `--set` has them.
    #[serde(default)]
    pub set: BTreeMap<String, toml::Value>,
    /// Write a log.
    #[serde(default)]
    pub log: bool,
}

/// A run, what is seen of it, what it was commanded.
pub struct Session {
    scenario: Scenario,
    run: SteppedRun,
    view: View,
    log: Option<RunLog<InMemory>>,
    /// Time \[s\] and twist, where the command changed.
    commanded: Vec<(f64, [f64; 3])>,
    periods: u64,
    /// Another command than the scenario's.
    driven: bool,
}

/// One line of text.
fn said(error: impl std::fmt::Display) -> String {
    error.to_string()
}

impl Session {
    /// The run of a request, a JSON object, at its start.
    pub fn open(request: &[u8]) -> Result<Self, String> {
        let request: Request =
            serde_json::from_slice(request).map_err(|error| format!("request: {error}"))?;
        Self::new(&request)
    }

    /// The run at its start.
    pub fn new(request: &Request) -> Result<Self, String> {
        let known = builtin_scenarios();
        let name = &request.scenario;
        if !known.contains(&name.as_str()) {
            // The name may be as long as the page likes.
            let name: String = name.chars().take(40).collect();
            return Err(format!("scenario: {name:?}, allowed: {}", known.join(", ")));
        }
        let set = request.set.iter();
        let set: Vec<_> = set
            .map(|(key, value)| Override::new(key.as_str(), value.clone()))
            .collect();
        let mut scenario = Scenario::load(name, &set).map_err(said)?;
        if let Some(policy) = &request.policy {
            scenario = scenario.with_policy(policy).map_err(said)?;
        }
        let controller = AnyController::new(&scenario).map_err(said)?;
        let log = request.log.then(|| RunLog::in_memory(&scenario, &controller));
        Ok(Self {
            view: View::new(&scenario, &controller),
            log: log.transpose().map_err(said)?,
            run: SteppedRun::new(&scenario, controller).map_err(said)?,
            scenario,
            commanded: Vec::new(),
            periods: 0,
            driven: false,
        })
    }

    /// What there is to see, and what the scenario has for what a page lets its reader choose.
    pub fn scene(&self) -> String {
        let settings = json!({
            "vehicle": self.scenario.vehicle().name,
            "policy": self.scenario.control.policy,
            "engine": self.scenario.physics.engine.name(),
            "duration_s": self.scenario.duration_s,
            "period_s": self.scenario.period_s(),
            "torque": self.scenario.vehicle().motor.stall_torque_n_m,
            "wheels": if self.scenario.wheel_model() == WheelModel::Rollers { "rollers" } else { "ball" },
            "wheel_model_valid": self.scenario.beyond_balls().is_none(),
            "friction": terrain(&self.scenario, "friction"),
            "height": terrain(&self.scenario, "height_m"),
        });
        format!(r#"{{"settings":{settings},"scene":{}}}"#, self.view.scene())
    }

    /// Goes on for some control periods, with a command or with the scenario's own, and says how
    /// many it went: fewer where the scenario's command has ended, or the physics failed.
    pub fn advance(&mut self, periods: u32, command: Option<[f64; 3]>) -> Result<u32, String> {
        if let Some(twist) = command {
            check(twist)?;
            self.driven |= periods > 0;
        }
        let end = control_periods(&self.scenario);
        for done in 0..periods {
            let across = self.scenario.stop_when_done && self.run.is_across();
            if across || (command.is_none() && self.periods >= end) {
                return Ok(done);
            }
            let time_s = self.run.simulation().time_ns() as f64 * 1e-9;
            let twist = match command {
                Some(twist) => BodyTwist::from_array(twist),
                None => self.run.simulation().scenario_command(),
            };
            if !self.run.step(&twist).map_err(said)? {
                return Ok(done);
            }
            self.periods += 1;
            let bits = |twist: [f64; 3]| twist.map(f64::to_bits);
            let last = self.commanded.last().map(|(_, twist)| bits(*twist));
            if last != Some(bits(twist.to_array())) {
                self.commanded.push((time_s, twist.to_array()));
            }
            let simulation = self.run.simulation();
            self.view.push(simulation.sample());
            if let Some(log) = &mut self.log {
                log.push(simulation.period()).map_err(said)?;
            }
        }
        Ok(periods)
    }

    /// How it is now.
    pub fn state(&self) -> String {
        self.view.state(self.run.simulation())
    }

    /// The metrics until now, why the physics failed, and how tables show each metric: its text and
    /// whether they need it, by key.
    pub fn outcome(&self) -> String {
        let outcome = self.metrics();
        let shown = |metric: &Metric| (metric.key, (metric.shown(&outcome), metric.is_of(&outcome)));
        json!({
            "time_s": self.run.simulation().time_ns() as f64 / 1e9,
            "failure": self.run.failure().map(said),
            "shown": Metric::ALL.iter().map(shown).collect::<BTreeMap<_, _>>(),
            "outcome": outcome,
        })
        .to_string()
    }

    /// The commands so far as a CSV file that a scenario may name: `command = { file = "drive.csv" }`.
    pub fn commands(&self) -> String {
        let mut rows = String::from("time_s,vx_m_s,vy_m_s,wz_rad_s\n");
        for (time_s, [vx, vy, wz]) in &self.commanded {
            let _ = writeln!(rows, "{time_s},{vx},{vy},{wz}");
        }
        rows
    }

    /// What has been written of the log since the last time.
    pub fn log(&mut self) -> Result<Vec<u8>, String> {
        let log = self.log.as_mut();
        log.map(RunLog::take).ok_or_else(no_log)
    }

    /// The last piece of the log.
    pub fn finish_log(&mut self) -> Result<Vec<u8>, String> {
        let log = self.log.take().ok_or_else(no_log)?;
        log.finish(&self.metrics()).map_err(said)
    }

    /// The scenario as it is run.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The metrics until now, as of a scenario with the commands that were given.
    pub fn metrics(&self) -> Outcome {
        let mut metrics = self.run.outcome();
        let commanded = self
            .driven
            .then(|| CommandFile::from_csv(self.commands().as_bytes()));
        if let Some(Ok(file)) = commanded {
            let mut scenario = self.scenario.clone();
            scenario.command.file = Some(file);
            metrics.wheel_model_valid = scenario.beyond_balls().is_none();
            // The commands replace a path.
            (metrics.path_error_rms_m, metrics.path_error_peak_m) = (None, None);
            metrics.arrived_s = None;
            if metrics.verdict == Verdict::Arrived {
                metrics.verdict = Verdict::Completed;
            }
        }
        metrics
    }

    /// The simulation as it is now.
    pub fn simulation(&self) -> &Simulation {
        self.run.simulation()
    }
}

fn no_log() -> String {
    "this run has no log, or its log is finished".into()
}

/// A key of the ground; null where it has none.
fn terrain(scenario: &Scenario, key: &str) -> Value {
    let keys = serde_json::to_value(&scenario.terrain).unwrap_or_default();
    keys.get(key).cloned().unwrap_or_default()
}

/// May it be commanded? As in a table of commands.
fn check([vx, vy, wz]: [f64; 3]) -> Result<(), String> {
    let table = format!("time_s,vx_m_s,vy_m_s,wz_rad_s\n0,{vx},{vy},{wz}\n");
    let checked = CommandFile::from_csv(table.as_bytes());
    checked
        .map(drop)
        .map_err(|error| error.replacen("line 2: ", "", 1))
}
