//! From commanded torques to those that act, and what turns meanwhile: lag, voltage, faults, angles, work.
//!
//! Both engines ask for the torques of a step, put them on their wheels, and say how fast the actuators turn after it.

use serde::{Deserialize, Serialize};

use crate::config::{Fault, Scenario};
use crate::observation::Observation;

/// The actuators of all wheels.
pub(super) struct Actuation {
    state: State,
    /// Part of the torque's gap that closes in a physics step; 1 without lag.
    follow: f64,
    sag: f64,
    stall_n_m: f64,
    slope_n_m_s_rad: f64,
    step_s: f64,
    /// Motors whose windings are shorted.
    shorted: Vec<bool>,
    lost: Vec<Span>,
    drags: Vec<(Span, f64)>,
    inertia_kg_m2: Vec<f64>,
    gear: Vec<f64>,
}

/// What a snapshot keeps.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct State {
    /// Torque that acts \[N.m\], one an actuator.
    torque_n_m: Vec<f64>,
    /// Actuator velocity after the last step \[rad/s\].
    velocity_rad_s: Vec<f64>,
    /// Actuator angle since the start \[rad\].
    pub(super) angle_rad: Vec<f64>,
    /// Work of the motors on wheels and frames \[J\].
    pub(super) work_j: f64,
    /// Sum of the sizes of that work \[J\].
    pub(super) turnover_j: f64,
    /// Work that drags have taken \[J\].
    pub(super) drag_loss_j: f64,
}

/// A fault of one wheel.
struct Span {
    wheel: usize,
    from_s: f64,
    until_s: f64,
}

impl Span {
    fn holds(&self, wheel: usize, time_s: f64) -> bool {
        self.wheel == wheel && time_s >= self.from_s && time_s < self.until_s
    }
}

impl State {
    /// Is it of so many wheels?
    pub(super) fn fits(&self, wheels: usize) -> bool {
        [&self.torque_n_m, &self.velocity_rad_s, &self.angle_rad]
            .iter()
            .all(|each| each.len() == wheels)
    }
}

impl Actuation {
    /// For steps of the engine of `step_s`.
    pub(super) fn new(scenario: &Scenario, step_s: f64) -> Self {
        let vehicle = scenario.vehicle();
        let wheels = vehicle.wheel.len();
        let lag_s = scenario.actuators.torque_lag_s;
        let span = |fault: &Fault, name: &str| {
            let (from_s, until_s) = fault.span_s();
            // A loaded scenario names wheels that exist.
            let wheel = vehicle.wheel.iter().position(|w| w.name == name)?;
            Some(Span {
                wheel,
                from_s,
                until_s,
            })
        };
        let lost = scenario.fault.iter().filter_map(|fault| match fault {
            Fault::WheelLost { wheel, .. } => span(fault, wheel),
            _ => None,
        });
        let drags = scenario.fault.iter().filter_map(|fault| match fault {
            Fault::WheelDrag {
                wheel,
                damper_n_m_s_rad,
                ..
            } => Some((span(fault, wheel)?, *damper_n_m_s_rad)),
            _ => None,
        });
        Self {
            follow: if lag_s > 0.0 {
                -libm::expm1(-step_s / lag_s)
            } else {
                1.0
            },
            sag: scenario.actuators.voltage_sag,
            stall_n_m: vehicle.motor.stall_torque_n_m,
            slope_n_m_s_rad: vehicle.motor.slope_n_m_s_rad,
            step_s,
            shorted: Vec::new(),
            lost: lost.collect(),
            drags: drags.collect(),
            inertia_kg_m2: vehicle.wheel.iter().map(|w| w.inertia_kg_m2).collect(),
            gear: vehicle.wheel.iter().map(|w| w.gear).collect(),
            state: State {
                torque_n_m: vec![0.0; wheels],
                velocity_rad_s: vec![0.0; wheels],
                angle_rad: vec![0.0; wheels],
                work_j: 0.0,
                turnover_j: 0.0,
                drag_loss_j: 0.0,
            },
        }
    }

    pub(super) fn state(&self) -> &State {
        &self.state
    }

    pub(super) fn restore(&mut self, state: State) {
        self.state = state;
    }

    /// Works out the torques that act in the next physics step; [`Actuation::torques_n_m`] has them.
    pub(super) fn follow(&mut self, time_s: f64, commanded_n_m: &[f64]) {
        let asked: f64 = self.state.torque_n_m.iter().map(|t| t.abs()).sum();
        let full = self.stall_n_m * self.gear.len() as f64;
        let voltage = 1.0 - self.sag * (asked / full).min(1.0);
        for (i, commanded) in commanded_n_m.iter().enumerate() {
            let velocity = self.state.velocity_rad_s[i];
            let torque = &mut self.state.torque_n_m[i];
            *torque += self.follow * (commanded - *torque);
            if self.sag > 0.0 {
                let stall = voltage * self.stall_n_m;
                let driving = (stall - self.slope_n_m_s_rad * velocity.abs()).max(0.0);
                let (lower, upper) = if velocity >= 0.0 {
                    (-stall, driving)
                } else {
                    (-driving, stall)
                };
                *torque = torque.max(lower).min(upper);
            }
            if self.lost.iter().any(|span| span.holds(i, time_s)) {
                *torque = 0.0;
            }
        }
    }

    /// The torques that act \[N.m\], one an actuator; drags are not among them.
    pub(super) fn torques_n_m(&self) -> &[f64] {
        &self.state.torque_n_m
    }

    /// Shorts the windings of these motors; of none where the list is empty.
    pub(super) fn brake(&mut self, motors: &[bool]) {
        self.shorted.clear();
        self.shorted.extend(motors);
    }

    /// Damping by drags and by a shorted motor between a wheel and its carrier now \[N.m.s/rad\], about the axle.
    ///
    /// A motor's torque falls with its speed because its windings see the voltage that it makes: shorted they see nothing else, and
    /// the slope is a damper. A motor that is lost has no windings to short.
    pub(super) fn damper_n_m_s_rad(&self, wheel: usize, time_s: f64) -> f64 {
        let holding = self.drags.iter().filter(|(span, _)| span.holds(wheel, time_s));
        let drags: f64 = holding.map(|(_, damper)| damper).sum();
        let shorted =
            self.shorted.get(wheel) == Some(&true) && !self.lost.iter().any(|span| span.holds(wheel, time_s));
        if shorted {
            drags + self.slope_n_m_s_rad / (self.gear[wheel] * self.gear[wheel])
        } else {
            drags
        }
    }

    /// Torque of the drags on an actuator \[N.m\]; at most what stops the wheel alone in a physics step, so that it does not swing.
    pub(super) fn explicit_drag_n_m(&self, wheel: usize, time_s: f64) -> f64 {
        let damper = self.damper_n_m_s_rad(wheel, time_s);
        if damper == 0.0 {
            return 0.0;
        }
        let gear = self.gear[wheel];
        let velocity = self.state.velocity_rad_s[wheel] * gear;
        -gear * damper.min(self.inertia_kg_m2[wheel] / self.step_s) * velocity
    }

    /// Accounts for a physics step that has been made: angles, work, torques. `moved` is by how much an actuator has turned \[rad\] and how
    /// fast it turns now \[rad/s\], with the velocity before; `drag_n_m` the torque of the drags on it in the step.
    pub(super) fn account(
        &mut self,
        share: f64,
        observation: &mut Observation,
        moved: impl Fn(usize, f64) -> [f64; 2],
        drag_n_m: impl Fn(&Self, usize) -> f64,
    ) {
        for i in 0..self.gear.len() {
            let drag = drag_n_m(self, i);
            let [turned, after] = moved(i, self.state.velocity_rad_s[i]);
            self.state.velocity_rad_s[i] = after;
            self.state.angle_rad[i] += turned;
            let work_j = self.state.torque_n_m[i] * turned;
            self.state.work_j += work_j;
            self.state.turnover_j += work_j.abs();
            self.state.drag_loss_j -= drag * turned;
            observation.wheels[i].torque_n_m += self.state.torque_n_m[i] * share;
        }
    }
}
