//! Requests of clients, and their effect on the run.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use byteorder::LittleEndian;
use omni_config::{Override, Scenario};
use omni_core::BodyTwist;

use super::controls::Controls;
use crate::ros2::{RosMessage, Twist};

const VX: &str = "command.vx_m_s";
const VY: &str = "command.vy_m_s";
const WZ: &str = "command.wz_rad_s";
const POLICY: &str = "control.policy";
const TORQUE: &str = "vehicle.motor.stall_torque_n_m";

/// Names that clients have for [`Twist`].
const TWIST: [&str; 2] = [Twist::TYPE, "geometry_msgs/Twist"];
/// Real time for which a command holds.
pub(super) const COMMAND_HOLDS: Duration = Duration::from_millis(500);

/// Which client.
pub(super) type ClientId = u64;

/// Value of a setting, present or requested.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Setting {
    Number(f64),
    Text(String),
    /// Nothing that a setting can be; in words, for the answer.
    Other(String),
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "{text:?}"),
            Self::Other(words) => f.write_str(words),
        }
    }
}

/// Exchange between the threads of clients and the run's thread.
pub(super) struct Requests {
    /// A pause, and another start.
    pub(super) controls: Arc<Controls>,
    pending: Mutex<Pending>,
    /// Held by who changes the scenario, never by the run: checking one with a picture of a ground
    /// inside takes longer than a period.
    setting: Mutex<()>,
}

struct Pending {
    scenario: Arc<Scenario>,
    command: Command,
    /// When the last command of a client came.
    commanded: Option<Instant>,
    changed: bool,
    /// The scenario is not the one that the run has from its start.
    has_settings: bool,
    subscribed: bool,
}

/// Source of the vehicle's command.
enum Command {
    /// The scenario: no client has commanded yet.
    Scenario,
    /// A client, whose last command came at that time.
    Client(ClientId, Instant, BodyTwist<f64>),
    /// No client any more: it fell silent or went. The vehicle rests until another command comes.
    Rest,
}

impl Requests {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let pending = Pending {
            scenario: Arc::new(scenario.clone()),
            command: Command::Scenario,
            commanded: None,
            changed: false,
            has_settings: false,
            subscribed: false,
        };
        Self {
            controls: Arc::default(),
            pending: Mutex::new(pending),
            setting: Mutex::new(()),
        }
    }

    /// No thread panics while writing; if one did, what is there is still whole.
    fn pending(&self) -> MutexGuard<'_, Pending> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The twist that clients want; none: the scenario's.
    pub(super) fn command(&self) -> Option<BodyTwist<f64>> {
        match self.pending().command {
            Command::Scenario => None,
            Command::Client(_, _, twist) => Some(twist),
            Command::Rest => Some(BodyTwist::ZERO),
        }
    }

    /// When the last command of a client came.
    #[cfg(feature = "ros2")]
    pub(super) fn commanded(&self) -> Option<Instant> {
        self.pending().commanded
    }

    /// The vehicle rests until the next command.
    pub(super) fn rest(&self) {
        self.pending().command = Command::Rest;
    }

    /// Takes a command back that is too old. Was there one?
    pub(super) fn time_out(&self, now: Instant) -> bool {
        self.rest_if(|_, at| now.saturating_duration_since(at) > COMMAND_HOLDS)
    }

    /// Takes back what a client commanded that no longer does. Was there something?
    pub(super) fn leave(&self, who: ClientId) -> bool {
        self.rest_if(|commander, _| commander == who)
    }

    fn rest_if(&self, ends: impl Fn(ClientId, Instant) -> bool) -> bool {
        let mut pending = self.pending();
        let ended = matches!(pending.command, Command::Client(who, at, _) if ends(who, at));
        if ended {
            pending.command = Command::Rest;
        }
        ended
    }

    /// The scenario with what was changed since the last time.
    pub(super) fn take_changed(&self) -> Option<Arc<Scenario>> {
        let mut pending = self.pending();
        std::mem::take(&mut pending.changed).then(|| pending.scenario.clone())
    }

    /// The run begins anew: settings stay.
    pub(super) fn start_again(&self) {
        let mut pending = self.pending();
        pending.changed |= pending.has_settings;
    }

    /// A client subscribed to something.
    pub(super) fn subscribe(&self) {
        self.pending().subscribed = true;
    }

    /// Did a client subscribe to something since the last time?
    pub(super) fn take_subscribed(&self) -> bool {
        std::mem::take(&mut self.pending().subscribed)
    }

    /// The settings as they are now, by name.
    pub(super) fn settings(&self) -> [(&'static str, Setting); 5] {
        self.pending().settings()
    }

    /// Applies the allowed settings of a client, and reports why others are not allowed.
    pub(super) fn set(&self, who: ClientId, settings: &[(String, Setting)], now: Instant) -> Vec<String> {
        let _alone = self.setting.lock().unwrap_or_else(PoisonError::into_inner);
        let set = settings
            .iter()
            .map(|(name, value)| self.set_one(who, name, value, now));
        set.filter_map(Result::err).collect()
    }

    /// Makes a setting that value, or says why not.
    fn set_one(&self, who: ClientId, name: &str, value: &Setting, now: Instant) -> Result<(), String> {
        let number = || match value {
            Setting::Number(value) if value.is_finite() => Ok(*value),
            other => Err(format!("{name}: {other}, allowed: a finite number")),
        };
        let with = match name {
            VX | VY | WZ => {
                return self.take_command(who, now, |scenario, twist| {
                    let mut twist = twist.to_array();
                    twist[[VX, VY, WZ].iter().position(|known| *known == name).unwrap_or(0)] = number()?;
                    allowed(scenario, twist)
                });
            }
            POLICY => match value {
                Setting::Text(policy) => Override::new(POLICY, policy.as_str()),
                other => return Err(format!("{name}: {other}, allowed: the name of a policy")),
            },
            TORQUE => Override::new(TORQUE, number()?),
            _ => {
                return Err(format!(
                    "{name}: no such parameter, allowed: {VX}, {VY}, {WZ}, {POLICY}, {TORQUE}"
                ));
            }
        };
        self.take_setting(|scenario| checked(scenario, &[with]))
    }

    /// Takes a twist that a client published on `/cmd_vel`, as teleoperation panels do, or says why not.
    pub(super) fn publish(
        &self,
        who: ClientId,
        published: &Published,
        payload: &[u8],
        now: Instant,
    ) -> Result<(), String> {
        self.take_command(who, now, |scenario, _| {
            allowed(scenario, twist(published, payload)?)
        })
    }

    /// Takes a twist that came otherwise: vx, vy \[m/s\] and wz \[rad/s\]; or says why not.
    pub(super) fn drive(&self, who: ClientId, twist: [f64; 3], now: Instant) -> Result<(), String> {
        self.take_command(who, now, |scenario, _| allowed(scenario, twist))
    }

    /// Takes the twist that `check` makes of the scenario and the twist of now, or says why not. `check` runs without
    /// the pending, which the run looks at every period: it may read files.
    fn take_command(
        &self,
        who: ClientId,
        now: Instant,
        check: impl FnOnce(&Scenario, BodyTwist<f64>) -> Result<BodyTwist<f64>, String>,
    ) -> Result<(), String> {
        let (scenario, twist) = {
            let pending = self.pending();
            (pending.scenario.clone(), pending.twist())
        };
        let twist = check(&scenario, twist)?;
        let mut pending = self.pending();
        pending.command = Command::Client(who, now, twist);
        pending.commanded = Some(now);
        Ok(())
    }

    /// Takes the scenario that `check` makes of the one of now, or says why not. `check` runs
    /// without the pending, as in [`Requests::take_command`].
    fn take_setting(&self, check: impl FnOnce(&Scenario) -> Result<Scenario, String>) -> Result<(), String> {
        let scenario = self.pending().scenario.clone();
        let changed = Arc::new(check(&scenario)?);
        let mut pending = self.pending();
        pending.scenario = changed;
        (pending.changed, pending.has_settings) = (true, true);
        Ok(())
    }
}

impl Pending {
    /// The vehicle's command: a client's twist, else the scenario's.
    fn twist(&self) -> BodyTwist<f64> {
        let own = &self.scenario.command;
        match self.command {
            Command::Scenario => BodyTwist {
                vx_m_s: own.vx_m_s,
                vy_m_s: own.vy_m_s,
                wz_rad_s: own.wz_rad_s,
            },
            Command::Client(_, _, twist) => twist,
            Command::Rest => BodyTwist::ZERO,
        }
    }

    fn settings(&self) -> [(&'static str, Setting); 5] {
        let command = self.twist();
        [
            (VX, Setting::Number(command.vx_m_s)),
            (VY, Setting::Number(command.vy_m_s)),
            (WZ, Setting::Number(command.wz_rad_s)),
            (
                POLICY,
                Setting::Text(self.scenario.control.policy.as_str().into()),
            ),
            (
                TORQUE,
                Setting::Number(self.scenario.vehicle().motor.stall_torque_n_m),
            ),
        ]
    }
}

/// The scenario with other values, checked as a file is.
fn checked(scenario: &Scenario, values: &[Override]) -> Result<Scenario, String> {
    scenario
        .with("parameter", values)
        .map_err(|error| error.to_string())
}

/// The twist if it is one that the scenario may ask for.
fn allowed(scenario: &Scenario, [vx_m_s, vy_m_s, wz_rad_s]: [f64; 3]) -> Result<BodyTwist<f64>, String> {
    let named = [(VX, vx_m_s), (VY, vy_m_s), (WZ, wz_rad_s)];
    checked(scenario, &named.map(|(key, value)| Override::new(key, value)))?;
    Ok(BodyTwist {
        vx_m_s,
        vy_m_s,
        wz_rad_s,
    })
}

/// Encoding of a client's messages on `/cmd_vel`.
pub(super) struct Published {
    pub(super) encoding: String,
    pub(super) schema: String,
}

/// The twist of a message: vx, vy \[m/s\] and wz \[rad/s\].
fn twist(published: &Published, payload: &[u8]) -> Result<[f64; 3], String> {
    if !TWIST.contains(&published.schema.as_str()) {
        return Err(format!("{}, allowed: {}", published.schema, Twist::TYPE));
    }
    let twist: Twist = match (published.encoding.as_str(), payload) {
        // Plain CDR, little end first.
        ("cdr", [0, 1, _, _, body @ ..]) => {
            let decoded = cdr_encoding::from_bytes::<Twist, LittleEndian>(body);
            decoded
                .map(|(twist, _)| twist)
                .map_err(|error| error.to_string())?
        }
        ("json", _) => serde_json::from_slice(payload).map_err(|error| error.to_string())?,
        (encoding, _) => return Err(format!("encoding {encoding}, allowed: little-endian cdr or json")),
    };
    Ok([twist.linear.x, twist.linear.y, twist.angular.z])
}

#[cfg(test)]
mod tests {
    use super::*;

    const AHEAD: &[u8] = br#"{"linear":{"x":-0.3,"y":0,"z":0},"angular":{"x":0,"y":0,"z":0}}"#;

    fn json() -> Published {
        Published {
            encoding: "json".into(),
            schema: Twist::TYPE.into(),
        }
    }

    fn requests() -> Requests {
        Requests::new(&Scenario::load("flat", &[]).expect("built-in"))
    }

    fn set_number(name: &str, value: f64) -> (String, Setting) {
        (name.into(), Setting::Number(value))
    }

    fn set_text(name: &str, value: &str) -> (String, Setting) {
        (name.into(), Setting::Text(value.into()))
    }

    fn commanded(requests: &Requests) -> Option<f64> {
        requests.command().map(|twist| twist.vx_m_s)
    }

    #[test]
    fn a_command_holds_for_half_a_second_after_its_last_message_then_the_vehicle_rests() {
        let (requests, start) = (requests(), Instant::now());
        let after = |seconds| start + Duration::from_secs_f64(seconds);
        assert!(
            commanded(&requests).is_none() && !requests.time_out(after(100.0)),
            "the scenario's own does not end"
        );
        // By message and by parameter alike; each starts the time anew.
        requests.publish(1, &json(), AHEAD, after(0.0)).expect("a twist");
        assert!(!requests.time_out(after(0.5)) && commanded(&requests) == Some(-0.3));
        assert_eq!(
            requests.set(1, &[set_number(VX, 0.2)], after(0.5)),
            Vec::<String>::new()
        );
        assert!(!requests.time_out(after(1.0)) && commanded(&requests) == Some(0.2));
        assert!(requests.time_out(after(1.001)) && commanded(&requests) == Some(0.0));
        // Said once; not back to the scenario's command; a later command moves the vehicle again.
        assert!(!requests.time_out(after(2.0)) && commanded(&requests) == Some(0.0));
        assert_eq!(requests.settings()[0], (VX, Setting::Number(0.0)));
        requests.publish(1, &json(), AHEAD, after(3.0)).expect("a twist");
        assert_eq!(commanded(&requests), Some(-0.3));
    }

    #[test]
    fn what_is_refused_does_not_keep_a_command_alive() {
        let (requests, start) = (requests(), Instant::now());
        let late = start + Duration::from_millis(400);
        requests.publish(1, &json(), AHEAD, start).expect("a twist");
        assert!(requests.publish(1, &json(), b"{", late).is_err());
        assert_eq!(
            requests
                .set(1, &[set_number(VX, 1e9), set_number("x", 0.0)], late)
                .len(),
            2
        );
        assert!(
            requests
                .set(1, &[set_text(POLICY, "scale_torques")], late)
                .is_empty()
        );
        assert!(requests.time_out(start + Duration::from_millis(501)));
    }

    #[test]
    fn what_is_asked_is_checked_while_the_run_goes_on_taking_its_command() {
        // Every setting and command is checked in one of these two: a caller that held the pending
        // could not get through.
        let requests = requests();
        let slow = BodyTwist {
            vx_m_s: 0.1,
            ..BodyTwist::ZERO
        };
        let taken = requests.take_command(1, Instant::now(), |_, _| {
            assert!(requests.pending.try_lock().is_ok(), "the run waits for a check");
            Ok(slow)
        });
        assert_eq!((taken, commanded(&requests)), (Ok(()), Some(0.1)));
        let taken = requests.take_setting(|scenario| {
            assert!(requests.pending.try_lock().is_ok(), "the run waits for a check");
            checked(scenario, &[Override::new(TORQUE, 1.25)])
        });
        let changed = requests.take_changed().expect("a setting");
        assert_eq!((taken, changed.vehicle().motor.stall_torque_n_m), (Ok(()), 1.25));
    }

    #[test]
    fn settings_stay_when_the_run_begins_anew() {
        let (requests, now) = (requests(), Instant::now());
        requests.start_again();
        assert!(requests.take_changed().is_none(), "nothing was set");
        let refused = requests.set(1, &[set_text(POLICY, "scale_torques")], now);
        assert!(refused.is_empty() && requests.take_changed().is_some());
        assert!(requests.take_changed().is_none());
        requests.start_again();
        let again = requests.take_changed().expect("the settings");
        assert_eq!(again.control.policy.as_str(), "scale_torques");
    }

    #[test]
    fn a_command_goes_with_its_client_and_settings_stay() {
        let (requests, now) = (requests(), Instant::now());
        requests.publish(1, &json(), AHEAD, now).expect("a twist");
        assert!(
            requests
                .set(
                    1,
                    &[set_text(POLICY, "scale_torques"), set_number(TORQUE, 1.25)],
                    now
                )
                .is_empty()
        );
        assert!(
            !requests.leave(2) && commanded(&requests) == Some(-0.3),
            "another client's going changes nothing"
        );
        assert!(requests.leave(1) && commanded(&requests) == Some(0.0));
        let changed = requests.take_changed().expect("settings");
        assert_eq!(
            (
                changed.control.policy.as_str(),
                changed.vehicle().motor.stall_torque_n_m
            ),
            ("scale_torques", 1.25)
        );
        // The end of the client that commanded last counts.
        requests.publish(1, &json(), AHEAD, now).expect("a twist");
        requests.publish(2, &json(), AHEAD, now).expect("a twist");
        assert!(!requests.leave(1) && requests.leave(2));
    }
}
