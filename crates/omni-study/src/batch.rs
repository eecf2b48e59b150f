//! A batch of runs for another process or machine.

use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use omni_config::{Scenario, Source};
use serde::{Deserialize, Serialize};

use crate::key::{Lines, VERSION, key_with};
use crate::part_names::named;
use crate::part_writer::PartWriter;
use crate::run::compute_into;
use crate::{Cell, Columns, Computed, Error, OwnPolicy, Plan, Row, Run, Store};

/// Some runs of a plan as plain text, for a worker that sees the folder of results.
///
/// The worker adds each row to the batch's own part as soon as it is done. Nothing is lost with a worker, and a worker
/// that receives the same batch again continues with the missing runs.
///
/// ```
/// use omni_config::{Override, Study};
/// use omni_study::{Batch, Plan};
/// let plan = Plan::new(&Study::load("ensemble")?, &[Override::parse("duration_s=0.5")?])?;
/// let batch = Batch::new(&plan, &plan.runs()[..30])?;
/// assert_eq!(Batch::from_text(&batch.to_text())?, batch);
/// assert!(batch.to_text().len() < 20_000); // two scenarios of some 6 kB, and 30 keys
/// # Ok::<(), omni_study::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Batch {
    version: String,
    study: String,
    columns: Columns,
    shared: Lines,
    /// As TOML, whole.
    scenarios: Vec<String>,
    runs: Vec<Packed>,
    /// Identity of the controller, where it is the user's own: that does not travel with the text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    policy: Option<String>,
    #[serde(skip)]
    own: Option<OwnPolicy>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Packed {
    key: String,
    seed: u64,
    axes: Vec<Cell>,
    /// Index into `scenarios`.
    scenario: usize,
}

impl Batch {
    /// Some runs of a plan.
    ///
    /// # Errors
    /// [`omni_sim::Error::Config`] if a scenario cannot be written as TOML: its seed is above 2^63 - 1.
    pub fn new(plan: &Plan, runs: &[Run]) -> Result<Self, Error> {
        let mut scenarios: Vec<String> = Vec::new();
        let mut packed = Vec::with_capacity(runs.len());
        let mut last: Option<&Arc<Scenario>> = None;
        for run in runs {
            // All seeds of a combination come together and share it.
            if !last.is_some_and(|last| Arc::ptr_eq(last, &run.scenario)) {
                scenarios.push(run.scenario.to_toml()?);
                last = Some(&run.scenario);
            }
            packed.push(Packed {
                key: run.key.clone(),
                seed: run.seed,
                axes: run.axes.to_vec(),
                scenario: scenarios.len() - 1,
            });
        }
        Ok(Self {
            version: VERSION.into(),
            study: plan.study().name.clone(),
            columns: plan.columns().clone(),
            shared: plan.shared().clone(),
            scenarios,
            runs: packed,
            policy: plan.own_policy().map(|own| own.identity().to_owned()),
            own: plan.own_policy().cloned(),
        })
    }

    /// The batch with the user's own controller that its plan had; none if it had none.
    ///
    /// # Errors
    /// [`Error::Study`] if it is another one.
    ///
    /// ```
    /// use omni_config::{Override, Scenario, Seeds};
    /// use omni_study::{Batch, OwnPolicy, Plan};
    /// let own = |identity: &str| {
    ///     // What makes the controller does not travel either: here it is the scenario's own.
    ///     OwnPolicy::new("mine", identity, |scenario: &Scenario| omni_sim::controller::AnyController::new(scenario))
    /// };
    /// let scenario = Scenario::load("flat", &[Override::new("duration_s", 0.1)])?;
    /// let points = vec![(Vec::new(), scenario)];
    /// let plan = Plan::of_scenarios_until("one", points, Seeds::Count(2), Some(own("1")), &false.into())?;
    /// let text = Batch::new(&plan, plan.runs())?.to_text();
    /// assert!(Batch::from_text(&text)?.with_policy(Some(own("1"))).is_ok());
    /// assert!(Batch::from_text(&text)?.with_policy(Some(own("2"))).is_err());
    /// assert!(Batch::from_text(&text)?.with_policy(None).is_err());
    /// # Ok::<(), omni_study::Error>(())
    /// ```
    pub fn with_policy(mut self, own: Option<OwnPolicy>) -> Result<Self, Error> {
        let given = own.as_ref().map(OwnPolicy::identity);
        if given != self.policy.as_deref() {
            return Err(refuse(format!(
                "of the policy {:?}, but this worker has {:?}, allowed: the same policy in the same version",
                self.policy.as_deref().unwrap_or("the scenario's own"),
                given.unwrap_or("none")
            )));
        }
        self.own = own;
        Ok(self)
    }

    /// The batch as text.
    #[must_use]
    pub fn to_text(&self) -> String {
        // Plain names, texts and finite numbers: it can be written as JSON.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// The batch that [`Batch::to_text`] wrote.
    ///
    /// # Errors
    /// [`Error::Study`] if it is not a batch, or belongs to another version of the program.
    pub fn from_text(text: &str) -> Result<Self, Error> {
        let batch: Self = serde_json::from_str(text).map_err(|error| refuse(error.to_string()))?;
        if batch.version != VERSION {
            let version = &batch.version;
            return Err(refuse(format!(
                "of omnistep {version}, but this worker has {VERSION}, allowed: the same version"
            )));
        }
        Ok(batch)
    }

    /// Computes what its part in the folder lacks on `jobs` threads (all cores by default), until
    /// all is done or `stop` is set. Calls `watch` after each row.
    ///
    /// # Errors
    /// [`Error::Study`] if the folder belongs to another study, [`Error::Io`].
    pub fn compute(
        &self,
        folder: impl Into<PathBuf>,
        jobs: Option<NonZeroUsize>,
        stop: &AtomicBool,
        watch: impl FnMut(&Row),
    ) -> Result<Computed, Error> {
        let (columns, shared) = (self.columns.clone(), self.shared.clone());
        let store = Store::shared(folder.into(), columns, shared, self.study.clone())?;
        let name = named(self.runs.iter().map(|run| run.key.as_str()));
        let done = store.keys_of_batch(&name)?;
        let mut missing = self.runs(stop)?;
        missing.retain(|run| !done.contains(&run.key));
        let keys: BTreeSet<String> = self.runs.iter().map(|run| run.key.clone()).collect();
        compute_into(
            &missing,
            PartWriter::of_batch(&store, name, keys),
            jobs,
            stop,
            watch,
        )
    }

    /// The runs, as in the plan; only some if `stop` is set meanwhile.
    fn runs(&self, stop: &AtomicBool) -> Result<Vec<Run>, Error> {
        let going = || !stop.load(Ordering::Relaxed);
        let columns = Arc::new(self.columns.clone());
        let read = |text: &String| Scenario::from_source(&Source::embedded("batch", text), &[]).map(Arc::new);
        let scenarios = self
            .scenarios
            .iter()
            .take_while(|_| going())
            .map(read)
            .collect::<Result<Vec<_>, _>>()?;
        let run = |packed: &Packed| {
            let run = Run {
                key: packed.key.clone(),
                seed: packed.seed,
                axes: packed.axes.clone().into(),
                columns: columns.clone(),
                own: self.own.clone(),
                scenario: scenarios
                    .get(packed.scenario)
                    .cloned()
                    .ok_or_else(|| refuse("incomplete".into()))?,
            };
            if key_with(&run.scenario(), self.own.as_ref())? != run.key {
                return Err(refuse(format!("run {} has another scenario", run.key)));
            }
            Ok(run)
        };
        self.runs.iter().take_while(|_| going()).map(run).collect()
    }
}

fn refuse(reason: String) -> Error {
    Error::Study {
        folder: "batch of runs".into(),
        reason,
    }
}
