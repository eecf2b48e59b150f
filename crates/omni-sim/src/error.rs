//! The errors of a simulation, each with its file and key, in one line.

use crate::config::{self, Scenario, shortened};

/// An error of configuration or simulation. Its message is one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file, a key or a name is not usable.
    #[error(transparent)]
    Config(#[from] crate::config::Error),
    /// A command handed to a running simulation is not usable.
    #[error("{name} = {}, allowed: {allowed}", shortened(value))]
    Argument {
        /// Name of the argument.
        name: &'static str,
        /// The value found.
        value: String,
        /// The range allowed.
        allowed: &'static str,
    },
    /// A controller at the other end of a link cannot be started, or is not the scenario's.
    #[error("{}: {}", shortened(name), shortened(reason))]
    Firmware {
        /// The image, or what else serves the controller.
        name: String,
        /// The error, and the remedy.
        reason: String,
    },
    /// The link to a running controller has stopped; there is no torque any more.
    #[error(
        "the link to the controller stopped at t = {time_s:.3} s: {} ({counters})",
        shortened(reason)
    )]
    Link {
        /// Simulated time \[s\].
        time_s: f64,
        /// Why.
        reason: String,
        /// Losses until then.
        counters: crate::link_counters::LinkCounters,
    },
    /// A custom controller returned a value that is not a torque.
    #[error(
        "policy {}: it returned {value} N.m for wheel {wheel} in period {period}, t = {time_s:.3} s, allowed: finite torques",
        shortened(policy)
    )]
    Policy {
        /// Its name.
        policy: String,
        /// Control period, from 0.
        period: u64,
        /// Simulated time at its start \[s\].
        time_s: f64,
        /// The wheel's name.
        wheel: String,
        /// Its output.
        value: f64,
    },
    /// A controller of one's own said that it failed.
    #[error(
        "policy {}: period {period}, t = {time_s:.3} s: {}",
        shortened(policy),
        shortened(reason)
    )]
    PolicyFailed {
        /// Its name.
        policy: String,
        /// Control period, from 0.
        period: u64,
        /// Simulated time at its start \[s\].
        time_s: f64,
        /// Its message.
        reason: String,
    },
    /// A signal of a controller of one's own cannot be a column.
    #[error(
        "policy {}: the signal {}, allowed: {allowed}",
        shortened(policy),
        shortened(signal)
    )]
    Signal {
        /// Name of the policy.
        policy: String,
        /// The name, in quotation marks.
        signal: String,
        /// The allowed values.
        allowed: &'static str,
    },
    /// The physics left the finite numbers.
    #[error("the simulation diverged at t = {time_s:.3} s: body {body} has no finite state")]
    Diverged {
        /// Simulated time \[s\].
        time_s: f64,
        /// Name of the first body concerned.
        body: String,
    },
    /// External physics cannot go on.
    #[error("{engine}: t = {time_s:.3} s: {}", shortened(reason))]
    External {
        /// The physics engine.
        engine: &'static str,
        /// Simulated time \[s\].
        time_s: f64,
        /// Why.
        reason: String,
    },
    /// A joint gave way: forces beyond what the physics step can hold.
    #[error("a joint separated at t = {time_s:.3} s: {part} by {:.1} mm", 1e3 * gap_m)]
    FellApart {
        /// Simulated time \[s\].
        time_s: f64,
        /// The joint, as `wheel 4` or `hinge pitch`.
        part: String,
        /// Distance of the parted joint \[m\].
        gap_m: f64,
    },
    /// The contacts of too many steps did not come to rest: what they pushed with is not known.
    #[error(
        "the contacts did not converge in more than 1 % of the steps until t = {time_s:.3} s: no metric of this \
         run is valid; use a physics.timestep_s below {timestep_s}"
    )]
    Unsettled {
        /// Simulated time \[s\].
        time_s: f64,
        /// The physics step \[s\].
        timestep_s: f64,
    },
    /// The physics returned more energy than was put in, beyond its error.
    #[error(
        "the physics gained {gained_j:.1} J while {through_j:.1} J went through the vehicle: no metric of \
         this run is valid; use a physics.timestep_s below {timestep_s}"
    )]
    GainedEnergy {
        /// Amount of energy gained \[J\].
        gained_j: f64,
        /// While so much went through the motors, and came of falling \[J\].
        through_j: f64,
        /// The physics step \[s\].
        timestep_s: f64,
    },
    /// The run exceeded its limit of real time; never without a clock.
    #[error("stopped at t = {time_s:.3} s: the run took longer than time_limit_s, {time_limit_s} s")]
    OutOfTime {
        /// Simulated time \[s\].
        time_s: f64,
        /// The time allowed \[s\].
        time_limit_s: f64,
    },
    /// A snapshot does not belong to the scenario.
    #[error("the snapshot cannot be resumed: {}", shortened(reason))]
    Snapshot {
        /// Its error.
        reason: String,
    },
}

impl Error {
    /// Whether the request is at fault (exit code 2) or the run failed (exit code 1).
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        !matches!(
            self,
            Self::Diverged { .. }
                | Self::FellApart { .. }
                | Self::Unsettled { .. }
                | Self::GainedEnergy { .. }
                | Self::OutOfTime { .. }
                | Self::Link { .. }
                | Self::External { .. }
                | Self::PolicyFailed { .. }
        )
    }
}

/// A key that a newer omni-config reads and this simulation does not know is rejected, never ignored; `what` describes
/// it.
pub(crate) fn unknown(scenario: &Scenario, key: &str, what: &str) -> config::Error {
    config::Error::Key {
        file: format!("scenario {}", scenario.name),
        key: key.into(),
        message: format!("{what}unknown to this simulation, which is older than the file"),
    }
}
