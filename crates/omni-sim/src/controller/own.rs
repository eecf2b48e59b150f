//! The user's own controller, between the sensors and the motors of a vehicle.

use omni_core::{BodyTwist, Controller, Policy, Readings, TorqueLimit};

use super::control_law::{ControlLaw, inverse, velocities};
use crate::config::{self, Scenario};
use crate::control_sample::ControlSample;
use crate::{Error, ReportColumns, TraceBuilder, WheelSignals};

/// Signals of a policy at most: a name costs at each message of a log.
pub const MOST_SIGNALS: usize = 256;
/// Largest number of characters of a policy's name.
const LONGEST_NAME: usize = 80;
/// What its snapshots begin with: those of another controller are not taken for its own.
const OWN: &str = "a controller of one's own";
/// Columns that a log has beside a trace's.
const OF_LOGS: [&str; 3] = ["asked_vx_m_s", "asked_vy_m_s", "asked_wz_rad_s"];

/// A policy for a vehicle of `N` wheels.
pub(super) struct UserPolicy<const N: usize> {
    policy: Box<dyn Policy<f64> + Send + Sync>,
    /// The vehicle's own controller, for what it knows of the vehicle.
    here: Controller<f64, N>,
    motors: [TorqueLimit<f64>; N],
    columns: ReportColumns,
    wheels: Vec<String>,
    period_s: f64,
    periods: u64,
}

impl<const N: usize> UserPolicy<N> {
    pub(super) fn new(
        scenario: &Scenario,
        policy: Box<dyn Policy<f64> + Send + Sync>,
    ) -> Result<Self, config::Error> {
        Ok(Self {
            here: scenario.controller()?,
            motors: scenario.wheel_control::<f64, N>()?.limits,
            columns: ReportColumns::own(
                (0..=MOST_SIGNALS)
                    .map_while(|index| policy.signal_name(index).map(str::to_owned))
                    .collect(),
            ),
            wheels: scenario
                .vehicle()
                .wheel
                .iter()
                .map(|wheel| wheel.name.clone())
                .collect(),
            period_s: scenario.period_s(),
            periods: 0,
            policy,
        })
    }
}

/// Can a controller of one's own be called so? The name stands in tables and logs, and beside those
/// of coordination policies.
///
/// # Errors
/// [`Error::Argument`] for the name of a coordination policy, for none, and for one of more than 80
/// characters or of two lines.
///
/// ```
/// use omni_sim::controller::check_name;
/// assert!(check_name("my law").is_ok());
/// let said = check_name("scale_torques").map_err(|error| error.to_string());
/// assert_eq!(said.err().as_deref(), Some("policy = \"scale_torques\", allowed: a name that is not a coordination policy's"));
/// ```
pub fn check_name(name: &str) -> Result<(), Error> {
    let refuse = |allowed| {
        let (key, value) = ("policy", format!("{name:?}"));
        Err(Error::Argument {
            name: key,
            value,
            allowed,
        })
    };
    let count = name.chars().count();
    if count == 0 || count > LONGEST_NAME || name.contains(char::is_control) {
        return refuse("a name of 1 to 80 characters in one line");
    }
    if config::POLICIES.contains(&name) {
        return refuse("a name that is not a coordination policy's");
    }
    Ok(())
}

/// Can these be columns of a trace and of a log, beside those that every one has?
pub(super) fn check_names(scenario: &Scenario, policy: &str, names: &[String]) -> Result<(), Error> {
    let refuse = |signal: &str, allowed| {
        let (policy, signal) = (policy.into(), format!("{signal:?}"));
        Err(Error::Signal {
            policy,
            signal,
            allowed,
        })
    };
    if let Some(one_more) = names.get(MOST_SIGNALS) {
        return refuse(one_more, "256 signals at most");
    }
    let columns = TraceBuilder::new(scenario.vehicle());
    for (i, name) in names.iter().enumerate() {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(plain) || name.len() > 64
        {
            return refuse(
                name,
                "lower case letters, digits and _, a letter first, 64 characters at most",
            );
        }
        if names[..i].contains(name) {
            return refuse(name, "each name once");
        }
        let reserved = ["wheel_", "drive_", "path_", "traction_", "odom_", "ground_"]
            .iter()
            .any(|prefix| name.starts_with(prefix));
        let of_wheels = scenario.vehicle().wheel.first().is_some_and(|wheel| {
            let column = format!("wheel_{}_{name}", wheel.name);
            columns.names().contains(&column)
        });
        let taken = columns.names().contains(name) || OF_LOGS.contains(&name.as_str());
        if taken || reserved || of_wheels {
            return refuse(
                name,
                "another name: reserved are the columns of every trace or log and names that begin with wheel_, drive_, path_, traction_, odom_ or ground_",
            );
        }
    }
    Ok(())
}

impl<const N: usize> ControlLaw for UserPolicy<N> {
    fn step(&mut self, readings: &Readings<'_, f64>, sample: &mut ControlSample) -> Result<(), Error> {
        let period = self.periods;
        self.periods += 1;
        let mut torques_n_m = [0.0; N];
        self.policy.step(readings, &mut torques_n_m);
        let kinematics = self.here.kinematics();
        let measured = velocities::<f64, N>(readings.wheels_rad_s);
        let (reference, residual) = (
            kinematics.inverse(&readings.command),
            kinematics.residual(&measured),
        );
        sample.command = readings.command;
        sample.estimated = kinematics.forward(&measured);
        sample.common_factor = f64::NAN; // not known, and a zero would be taken for a measurement
        sample.brake.clear();
        sample.wheels.clear();
        sample.wheels.extend((0..N).map(|i| {
            let range = self.motors[i].range(measured.rad_s[i]);
            let requested_n_m = torques_n_m[i];
            WheelSignals {
                reference_rad_s: reference.rad_s[i],
                measured_rad_s: measured.rad_s[i],
                requested_n_m,
                // Nothing if it is no number; the period ends the run then.
                applied_n_m: if requested_n_m.is_finite() {
                    range.clip(requested_n_m)
                } else {
                    0.0
                },
                limit_lower_n_m: range.lower_n_m,
                limit_upper_n_m: range.upper_n_m,
                residual_rad_s: residual.rad_s[i],
                ..WheelSignals::UNKNOWN
            }
        }));
        let own = &mut sample.report.own;
        own.resize(self.columns.names().len(), f64::NAN);
        self.policy.signals(own);
        if let Some(reason) = self.policy.failure() {
            return Err(Error::PolicyFailed {
                policy: self.policy.name().into(),
                period,
                time_s: period as f64 * self.period_s,
                reason: reason.into(),
            });
        }
        match torques_n_m.iter().position(|torque| !torque.is_finite()) {
            None => Ok(()),
            Some(i) => Err(Error::Policy {
                policy: self.policy.name().into(),
                period,
                time_s: period as f64 * self.period_s,
                wheel: self.wheels[i].clone(),
                value: torques_n_m[i],
            }),
        }
    }

    fn columns(&self) -> ReportColumns {
        self.columns.clone()
    }

    fn inverse(&self, twist: &BodyTwist<f64>) -> Vec<f64> {
        inverse(self.here.kinematics(), twist)
    }

    /// The periods alone: the owner keeps the state of the policy.
    fn save(&self) -> Option<Vec<u8>> {
        postcard::to_allocvec(&(OWN, self.policy.name(), self.periods)).ok()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        match postcard::take_from_bytes::<(&str, &str, u64)>(state) {
            Ok(((OWN, name, periods), [])) if name == self.policy.name() => {
                self.periods = periods;
                true
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::controller::AnyController;

    /// Does nothing, and fails in its sixth period.
    struct Signals(Vec<String>, u32);

    impl Policy<f64> for Signals {
        fn reset(&mut self) {}

        fn step(&mut self, _: &Readings<'_, f64>, _: &mut [f64]) {
            self.1 += 1;
        }

        fn name(&self) -> &str {
            "mine"
        }

        fn failure(&self) -> Option<&str> {
            (self.1 > 5).then_some("tired")
        }

        fn signal_name(&self, index: usize) -> Option<&str> {
            self.0.get(index).map(String::as_str)
        }
    }

    fn made(names: &[&str]) -> Result<AnyController, Error> {
        let scenario = Scenario::load("flat", &[]).expect("built-in");
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        AnyController::own(&scenario, Box::new(Signals(names, 0)))
    }

    #[test]
    fn names_that_cannot_be_columns_are_refused_with_what_is_allowed() {
        for (names, allowed) in [
            (&["a", "b", "a"][..], "each name once"),
            (&["Speed"], "lower case"),
            (&["1st"], "a letter first"),
            (&[""], "a letter first"),
            (&["time_s"], "reserved are the columns"),
            (&["measured_rad_s"], "reserved are the columns"),
            (&["drive_mode"], "odom_ or ground_"),
            (&["path_x_m"], "odom_ or ground_"),
            (&["odom_z_m"], "odom_ or ground_"),
            (&["wheel_3_p_n_m"], "reserved are the columns"),
            (&["asked_vx_m_s"], "reserved are the columns"),
        ] {
            let said = made(names).err().expect("refused").to_string();
            assert!(said.starts_with("policy mine: the signal \""), "{said}");
            assert!(said.contains(allowed), "{said}");
        }
        let controller = made(&["a", "b_2"]).expect("good names");
        assert_eq!((controller.policy(), controller.is_own()), ("mine", true));
        assert_eq!(controller.columns().names(), ["a", "b_2"]);
    }

    #[test]
    fn names_without_end_are_cut_off() {
        struct Endless;
        impl Policy<f64> for Endless {
            fn reset(&mut self) {}
            fn step(&mut self, _: &Readings<'_, f64>, _: &mut [f64]) {}
            fn signal_name(&self, _: usize) -> Option<&str> {
                Some("more")
            }
        }
        let scenario = Scenario::load("flat", &[]).expect("built-in");
        let said = AnyController::own(&scenario, Box::new(Endless))
            .err()
            .expect("refused");
        assert!(
            said.to_string().ends_with("allowed: 256 signals at most"),
            "{said}"
        );
    }

    #[test]
    fn a_policy_that_says_it_failed_ends_the_run_with_what_it_says() {
        let scenario = Scenario::load("flat", &[]).expect("built-in");
        let run = Run::new(&scenario).controller(made(&[]).expect("good")).trace();
        let said = run.expect_err("it failed").to_string();
        assert_eq!(said, "policy mine: period 5, t = 0.005 s: tired");
    }
}
