//! What clients ask for, and what the run takes from it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use byteorder::LittleEndian;
use foxglove::websocket::{
    AnyClient, ChannelView, Client, ClientChannel, GetParametersResponder, Parameter, ParameterHandler,
    ParameterValue, ServerListener, SetParametersResponder,
};
use omni_core::BodyTwist;

use crate::config::{Override, Scenario};
use crate::log::ros2::{RosMessage, Twist};
use crate::log::topic;

const VX: &str = "command.vx_m_s";
const VY: &str = "command.vy_m_s";
const WZ: &str = "command.wz_rad_s";
const POLICY: &str = "control.policy";
const TORQUE: &str = "vehicle.motor.stall_torque_n_m";

/// Names that clients have for [`Twist`].
const TWIST: [&str; 2] = [Twist::TYPE, "geometry_msgs/Twist"];
/// What is kept for clients until it is sent.
const MOST_SAID: usize = 100;

/// What clients are told.
pub(super) enum Said {
    /// Why something was not done.
    Refused(String),
    /// What parameters are now.
    Set(Vec<Parameter>),
}

/// Where the threads of clients leave what the run's thread takes.
pub(super) struct Desk(Mutex<Papers>);

struct Papers {
    scenario: Scenario,
    command: Option<BodyTwist<f64>>,
    changed: bool,
    subscribed: bool,
    said: Vec<Said>,
}

impl Desk {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self(Mutex::new(Papers {
            scenario: scenario.clone(),
            command: None,
            changed: false,
            subscribed: false,
            said: Vec::new(),
        }))
    }

    /// Nobody panics while writing; if somebody did, what is there is still whole.
    fn papers(&self) -> MutexGuard<'_, Papers> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The twist that a client wants; none: the scenario's.
    pub(super) fn command(&self) -> Option<BodyTwist<f64>> {
        self.papers().command
    }

    /// The scenario with what was changed since the last time.
    pub(super) fn take_changed(&self) -> Option<Scenario> {
        let mut papers = self.papers();
        std::mem::take(&mut papers.changed).then(|| papers.scenario.clone())
    }

    /// Did a client subscribe to something since the last time?
    pub(super) fn take_subscribed(&self) -> bool {
        std::mem::take(&mut self.papers().subscribed)
    }

    pub(super) fn take_said(&self) -> Vec<Said> {
        std::mem::take(&mut self.papers().said)
    }
}

impl Papers {
    /// What the vehicle is told: a client's twist, else the scenario's.
    fn twist(&self) -> BodyTwist<f64> {
        let own = &self.scenario.command;
        self.command.unwrap_or(BodyTwist {
            vx_m_s: own.vx_m_s,
            vy_m_s: own.vy_m_s,
            wz_rad_s: own.wz_rad_s,
        })
    }

    fn parameters(&self) -> Vec<Parameter> {
        let command = self.twist();
        vec![
            Parameter::float64(VX, command.vx_m_s),
            Parameter::float64(VY, command.vy_m_s),
            Parameter::float64(WZ, command.wz_rad_s),
            Parameter::string(POLICY, self.scenario.control.policy.as_str()),
            Parameter::float64(TORQUE, self.scenario.vehicle().motor.stall_torque_n_m),
        ]
    }

    /// Sets a parameter, or says why not.
    fn set(&mut self, parameter: &Parameter) -> Result<(), String> {
        let name = parameter.name.as_str();
        let number = || match parameter.value {
            Some(ParameterValue::Float64(value)) if value.is_finite() => Ok(value),
            Some(ParameterValue::Integer(value)) => Ok(value as f64),
            ref other => Err(format!("{name}: {other:?}, allowed: a finite number")),
        };
        match name {
            VX | VY | WZ => {
                let mut twist = self.twist().to_array();
                twist[[VX, VY, WZ].iter().position(|known| *known == name).unwrap_or(0)] = number()?;
                self.command = Some(allowed(&self.scenario, twist)?);
                Ok(())
            }
            POLICY => match &parameter.value {
                Some(ParameterValue::String(policy)) => self.change(Override::new(POLICY, policy.as_str())),
                other => Err(format!("{name}: {other:?}, allowed: the name of a policy")),
            },
            TORQUE => self.change(Override::new(TORQUE, number()?)),
            _ => Err(format!(
                "{name}: no such parameter, allowed: {VX}, {VY}, {WZ}, {POLICY}, {TORQUE}"
            )),
        }
    }

    /// Another value of the scenario from now on.
    fn change(&mut self, with: Override) -> Result<(), String> {
        self.scenario = checked(&self.scenario, &[with])?;
        self.changed = true;
        Ok(())
    }

    /// Tells clients something; the oldest is forgotten where nobody takes it.
    fn say(&mut self, said: Said) {
        if self.said.len() == MOST_SAID {
            self.said.remove(0);
        }
        self.said.push(said);
    }
}

impl ParameterHandler for Desk {
    fn get(&self, _: AnyClient, names: Vec<String>, _: Option<String>, responder: GetParametersResponder) {
        let mut all = self.papers().parameters();
        all.retain(|parameter| names.is_empty() || names.contains(&parameter.name));
        responder.respond(all);
    }

    fn set(
        &self,
        _: AnyClient,
        parameters: Vec<Parameter>,
        _: Option<String>,
        responder: SetParametersResponder,
    ) {
        let now = {
            let mut papers = self.papers();
            for parameter in &parameters {
                if let Err(why) = papers.set(parameter) {
                    papers.say(Said::Refused(why));
                }
            }
            let now = papers.parameters();
            papers.say(Said::Set(now.clone()));
            now
        };
        responder.respond(now);
    }
}

impl ServerListener for Desk {
    fn on_subscribe(&self, _: Client, _: ChannelView<'_>) {
        self.papers().subscribed = true;
    }

    /// A twist on `/cmd_vel`, as teleoperation panels publish it.
    fn on_message_data(&self, _: Client, channel: &ClientChannel, payload: &[u8]) {
        if channel.topic != topic::CMD_VEL {
            return;
        }
        // Checked without the papers, which the run looks at every period.
        let scenario = self.papers().scenario.clone();
        match twist(channel, payload).and_then(|twist| allowed(&scenario, twist)) {
            Ok(twist) => self.papers().command = Some(twist),
            Err(why) => self.papers().say(Said::Refused(format!("/cmd_vel: {why}"))),
        }
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

/// The twist of a message: vx, vy \[m/s\] and wz \[rad/s\].
fn twist(channel: &ClientChannel, payload: &[u8]) -> Result<[f64; 3], String> {
    if !TWIST.contains(&channel.schema_name.as_str()) {
        return Err(format!("{}, allowed: {}", channel.schema_name, Twist::TYPE));
    }
    let twist: Twist = match (channel.encoding.as_str(), payload) {
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
