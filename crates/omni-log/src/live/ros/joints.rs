//! Wheels that are driven one by one, as ros2_control does: the place of a vehicle's hardware interface.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use omni_config::{Scenario, for_wheel_count};
use omni_core::loops::WheelController;
use omni_core::{ControlState, Policy, Readings, WheelVelocities};
use omni_sim::controller::AnyController;

use crate::live::requests::COMMAND_HOLDS;
use crate::ros2::JointState;
use crate::urdf::{JointInterface, wheel_link};

/// The wheels' commands.
pub(in crate::live) struct JointCommands {
    interface: JointInterface,
    /// The wheels' joints in the vehicle's order, and turns of a wheel a turn of its actuator.
    joints: Vec<(String, f64)>,
    commanded: Mutex<Commanded>,
}

struct Commanded {
    /// Of the actuators \[rad/s or N.m\].
    values: Vec<f64>,
    /// When each was commanded: a joint with newer commands keeps no other going.
    at: Vec<Option<Instant>>,
}

impl JointCommands {
    pub(in crate::live) fn new(scenario: &Scenario, interface: JointInterface) -> Self {
        let wheels = &scenario.vehicle().wheel;
        Self {
            interface,
            joints: wheels
                .iter()
                .map(|wheel| (wheel_link(&wheel.name), wheel.gear))
                .collect(),
            commanded: Mutex::new(Commanded {
                values: vec![0.0; wheels.len()],
                at: vec![None; wheels.len()],
            }),
        }
    }

    /// No thread panics while writing; if one did, what is there is still whole.
    fn commanded(&self) -> MutexGuard<'_, Commanded> {
        self.commanded.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a message, or says why not. A joint that is not in it, and one whose command is NaN,
    /// keeps its last command; a message of NaN alone is no command: a controller that was stopped
    /// leaves these behind, and ros2_control goes on sending them.
    pub(super) fn take(&self, message: &JointState, now: Instant) -> Result<(), String> {
        let (field, values) = match self.interface {
            JointInterface::Velocity => ("velocity", &message.velocity),
            JointInterface::Effort => ("effort", &message.effort),
        };
        let (names, count) = (message.name.len(), values.len());
        if names != count {
            return Err(format!(
                "{field}: {count} values for {names} names, allowed: one for each name"
            ));
        }
        let mut commanded = self.commanded();
        let (mut next, mut at) = (commanded.values.clone(), commanded.at.clone());
        let mut known = false;
        for (name, value) in message.name.iter().zip(values) {
            // Other joints are ignored, such as the joints of an arm on the vehicle.
            let Some(i) = self.joints.iter().position(|(joint, _)| joint == name) else {
                continue;
            };
            known = true;
            if value.is_infinite() {
                return Err(format!(
                    "{field} of {name}: {value}, allowed: finite, or NaN for no change"
                ));
            }
            if !value.is_nan() {
                at[i] = Some(now);
                let gear = self.joints[i].1;
                next[i] = match self.interface {
                    JointInterface::Velocity => value / gear,
                    JointInterface::Effort => value * gear,
                };
            }
        }
        (commanded.values, commanded.at) = (next, at);
        if !known {
            let wheels: Vec<_> = self.joints.iter().map(|(joint, _)| joint.as_str()).collect();
            let names = message.name.join(", ");
            return Err(format!("name: {names}, allowed: one of {}", wheels.join(", ")));
        }
        Ok(())
    }

    /// The actuators' commands now: one whose last command is too old rests.
    fn read(&self, now: Instant, values: &mut [f64]) {
        let mut commanded = self.commanded();
        let Commanded { values: all, at } = &mut *commanded;
        for (value, at) in all.iter_mut().zip(at) {
            if at.is_some_and(|at| now.saturating_duration_since(at) > COMMAND_HOLDS) {
                (*value, *at) = (0.0, None);
            }
        }
        values.copy_from_slice(all);
    }
}

/// The controller of a vehicle whose wheels are driven one by one.
pub(in crate::live) fn controller(
    scenario: &Scenario,
    joints: &Arc<JointCommands>,
) -> Result<AnyController, omni_sim::Error> {
    let count = scenario.vehicle().wheel.len();
    let refused = |count: usize| refuse("vehicle.wheel", count.to_string(), "3 to 8 wheels");
    for_wheel_count!(count, of_wheels[](scenario, joints), refused)
}

fn refuse(
    name: &'static str,
    value: String,
    allowed: &'static str,
) -> Result<AnyController, omni_sim::Error> {
    Err(omni_sim::Error::Argument { name, value, allowed })
}

fn of_wheels<const N: usize>(
    scenario: &Scenario,
    joints: &Arc<JointCommands>,
) -> Result<AnyController, omni_sim::Error> {
    let joints = joints.clone();
    match joints.interface {
        JointInterface::Effort => AnyController::own(scenario, Box::new(Efforts::<N>(joints))),
        JointInterface::Velocity => {
            let config = scenario.wheel_control::<f64, N>()?;
            let Ok(loops) = WheelController::new(config) else {
                let allowed = "a policy without a shared integral, because each wheel has its own command";
                return refuse("control.policy", scenario.control.law(), allowed);
            };
            let state = ControlState::default();
            AnyController::own(scenario, Box::new(Velocities { joints, loops, state }))
        }
    }
}

/// Torques as commanded.
struct Efforts<const N: usize>(Arc<JointCommands>);

impl<const N: usize> Policy<f64> for Efforts<N> {
    fn reset(&mut self) {}

    fn step(&mut self, _: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
        self.0.read(Instant::now(), torques_n_m);
    }

    fn name(&self) -> &str {
        "joint efforts"
    }
}

/// Velocities as commanded, kept by the loops and the coordination of the scenario.
struct Velocities<const N: usize> {
    joints: Arc<JointCommands>,
    loops: WheelController<f64, N>,
    state: ControlState<f64, N>,
}

impl<const N: usize> Policy<f64> for Velocities<N> {
    fn reset(&mut self) {
        self.state = ControlState::default();
    }

    fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
        let (mut reference, mut measured) = (WheelVelocities::zero(), WheelVelocities::zero());
        self.joints.read(Instant::now(), &mut reference.rad_s);
        if let Ok(velocities) = readings.wheels_rad_s.try_into() {
            measured.rad_s = velocities;
        }
        let sample = self.loops.step(&mut self.state, &reference, &measured);
        torques_n_m.copy_from_slice(&sample.applied.n_m);
    }

    fn name(&self) -> &str {
        "joint velocities"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn message(names: &[&str], values: &[f64]) -> JointState {
        JointState {
            name: names.iter().map(|name| (*name).into()).collect(),
            velocity: values.to_vec(),
            effort: values.to_vec(),
            ..JointState::default()
        }
    }

    fn commands(interface: JointInterface) -> JointCommands {
        let scenario = Scenario::load("flat", &[omni_config::Override::new("vehicle", "mecanum4")]);
        JointCommands::new(&scenario.expect("built-in"), interface)
    }

    fn now(commands: &JointCommands, at: Instant) -> Vec<f64> {
        let mut values = vec![f64::NAN; 4];
        commands.read(at, &mut values);
        values
    }

    #[test]
    fn joints_are_commanded_by_name_and_rest_half_a_second_after_the_last_message() {
        let (commands, start) = (commands(JointInterface::Velocity), Instant::now());
        let names: Vec<_> = commands.joints.iter().map(|(name, _)| name.clone()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        assert_eq!(now(&commands, start), [0.0; 4]);
        let backwards: Vec<&str> = names.iter().rev().copied().collect();
        let taken = commands.take(&message(&backwards, &[4.0, 3.0, 2.0, 1.0]), start);
        assert_eq!((taken, now(&commands, start)), (Ok(()), vec![1.0, 2.0, 3.0, 4.0]));
        // One that is left out, and one whose command is NaN, go on.
        let taken = commands.take(&message(&names[..2], &[f64::NAN, -2.0]), start);
        assert_eq!(
            (taken, now(&commands, start)),
            (Ok(()), vec![1.0, -2.0, 3.0, 4.0])
        );
        let late = start + COMMAND_HOLDS + Duration::from_millis(1);
        assert_eq!(now(&commands, late), [0.0; 4]);
        // NaN alone is no command: it does not prolong the last one.
        let kept = start + COMMAND_HOLDS / 2;
        assert_eq!(commands.take(&message(&names, &[2.0; 4]), start), Ok(()));
        assert_eq!(commands.take(&message(&names, &[f64::NAN; 4]), kept), Ok(()));
        assert_eq!(
            (now(&commands, kept), now(&commands, late)),
            (vec![2.0; 4], vec![0.0; 4])
        );
        // What held then does not come back with the next message.
        let taken = commands.take(&message(&names[..1], &[5.0]), late);
        assert_eq!((taken, now(&commands, late)), (Ok(()), vec![5.0, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn a_message_that_does_not_fit_changes_nothing_and_is_answered_with_the_reason() {
        let (commands, start) = (commands(JointInterface::Effort), Instant::now());
        let known = commands.joints[0].0.clone();
        for (commanded, part) in [
            (
                message(&["arm", "wheel_x"], &[1.0, 1.0]),
                "name: arm, wheel_x, allowed: one of wheel_",
            ),
            (
                message(&[&known], &[f64::INFINITY]),
                "allowed: finite, or NaN for no change",
            ),
            (
                message(&[&known], &[]),
                "effort: 0 values for 1 names, allowed: one for each name",
            ),
        ] {
            let said = commands.take(&commanded, start).expect_err("refused");
            assert!(said.contains(part), "{said}");
            assert_eq!(now(&commands, start), [0.0; 4]);
        }
        // Other joints are ignored.
        let taken = commands.take(&message(&["arm", &known], &[7.0, 1.0]), start);
        assert_eq!(
            (taken, now(&commands, start)[1..].to_vec()),
            (Ok(()), vec![0.0; 3])
        );
        assert!(now(&commands, start)[0] > 0.0);
    }
}
