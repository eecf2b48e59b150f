//! What clients ask for, and what the run takes from it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use byteorder::LittleEndian;
use foxglove::websocket::{
    AnyClient, ChannelView, Client, ClientChannel, GetParametersResponder, Parameter, ParameterHandler,
    ParameterValue, ServerListener, SetParametersResponder,
};
use omni_core::BodyTwist;

use crate::config::{Override, Scenario, Source};
use crate::log::ros2::Twist;
use crate::log::topic;

const VX: &str = "command.vx_m_s";
const VY: &str = "command.vy_m_s";
const WZ: &str = "command.wz_rad_s";
const POLICY: &str = "control.policy";
const TORQUE: &str = "vehicle.motor.stall_torque_n_m";

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

    pub(super) fn policy(&self) -> String {
        self.papers().scenario.control.policy.clone()
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
    fn parameters(&self) -> Vec<Parameter> {
        let command = self.command.unwrap_or(BodyTwist {
            vx_m_s: self.scenario.command.vx_m_s,
            vy_m_s: self.scenario.command.vy_m_s,
            wz_rad_s: self.scenario.command.wz_rad_s,
        });
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
                let value = number()?;
                let mut command = self.command.unwrap_or(BodyTwist::ZERO);
                match name {
                    VX => command.vx_m_s = value,
                    VY => command.vy_m_s = value,
                    _ => command.wz_rad_s = value,
                }
                self.command = Some(command);
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

    /// The scenario with another value, checked as a file is.
    fn change(&mut self, with: Override) -> Result<(), String> {
        let text = toml::to_string(&self.scenario).map_err(|error| error.to_string())?;
        let changed = Scenario::from_source(&Source::text("parameter", text), &[with]);
        self.scenario = changed.map_err(|error| error.to_string())?;
        self.changed = true;
        Ok(())
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
                    papers.said.push(Said::Refused(why));
                }
            }
            let now = papers.parameters();
            papers.said.push(Said::Set(now.clone()));
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
        let twist = match channel.encoding.as_str() {
            "cdr" => cdr_encoding::from_bytes::<Twist, LittleEndian>(payload.get(4..).unwrap_or_default())
                .map(|(twist, _)| twist)
                .map_err(|error| error.to_string()),
            "json" => serde_json::from_slice::<Twist>(payload).map_err(|error| error.to_string()),
            other => Err(format!("encoding {other}, allowed: cdr or json")),
        };
        let mut papers = self.papers();
        match twist {
            Ok(Twist { linear, angular })
                if [linear.x, linear.y, angular.z].iter().all(|v| v.is_finite()) =>
            {
                papers.command = Some(BodyTwist {
                    vx_m_s: linear.x,
                    vy_m_s: linear.y,
                    wz_rad_s: angular.z,
                });
            }
            Ok(_) => papers.said.push(Said::Refused(
                "/cmd_vel: not finite, allowed: finite numbers".into(),
            )),
            Err(why) => papers.said.push(Said::Refused(format!("/cmd_vel: {why}"))),
        }
    }
}
