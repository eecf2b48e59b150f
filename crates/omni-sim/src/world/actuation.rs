//! From commanded to applied torques, and the resulting rotation: lag, the motors' line, faults, angles, work.
//!
//! A motor is bound by its torque-speed line at the speed that it truly has, whatever the controller read.
//! Both engines ask for the torques of a step, put them on their wheels, and say how fast the actuators turn after it.

use std::ops::Range;

use omni_core::motor::GearFriction;
use serde::{Deserialize, Serialize};

use crate::config::{Fault, Scenario};
use crate::observation::Observation;

/// The actuators of all wheels.
pub(super) struct Actuation {
    state: State,
    /// Part of the gap between a torque and the commanded one that closes in a physics step, and in
    /// the step's mean; 1 without lag.
    follow: f64,
    follow_mean: f64,
    sag: f64,
    stall_n_m: f64,
    peak_n_m: f64,
    slope_n_m_s_rad: f64,
    step_s: f64,
    /// Motors whose windings are shorted.
    shorted: Vec<bool>,
    /// Remaining fraction of motors: 0 for a lost one.
    weak: Vec<(Span, f64)>,
    /// Remaining fraction of the supply, and its times \[s\].
    supply: Vec<(Range<f64>, f64)>,
    drags: Vec<(Span, f64)>,
    inertia_kg_m2: Vec<f64>,
    gear: Vec<f64>,
    /// Losses of gears, one per wheel; none without losses.
    friction: Vec<Option<GearFriction<f64>>>,
}

/// What a gear makes of the torque that acts on its actuator.
#[derive(Clone, Copy)]
pub(super) struct Geared {
    /// Torque that reaches the wheel, seen from the actuator \[N.m\].
    pub(super) torque_n_m: f64,
    /// Dry friction between wheel and carrier, about the axle \[N.m\]: it holds the wheel at rest
    /// with up to this, and acts with this against its turning.
    pub(super) hold_n_m: f64,
}

/// The saved state.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct State {
    /// Torque that acts \[N.m\], one an actuator: the mean over the step.
    torque_n_m: Vec<f64>,
    /// Where the lag has brought it at the step's end \[N.m\].
    lagged_n_m: Vec<f64>,
    /// Actuator velocity after the last step \[rad/s\].
    velocity_rad_s: Vec<f64>,
    /// Actuator angle since the start \[rad\].
    pub(super) angle_rad: Vec<f64>,
    /// Work of the motors on wheels and frames \[J\].
    pub(super) work_j: f64,
    /// Sum of the sizes of that work \[J\].
    pub(super) turnover_j: f64,
    /// Work dissipated by drags and gear friction \[J\].
    pub(super) drag_loss_j: f64,
}

/// A fault of one wheel.
struct Span {
    wheel: usize,
    time_s: Range<f64>,
}

impl Span {
    fn is_active(&self, wheel: usize, time_s: f64) -> bool {
        self.wheel == wheel && self.time_s.contains(&time_s)
    }
}

impl State {
    /// Is it of so many wheels?
    pub(super) fn fits(&self, wheels: usize) -> bool {
        [
            &self.torque_n_m,
            &self.lagged_n_m,
            &self.velocity_rad_s,
            &self.angle_rad,
        ]
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
        let of_wheels = |value: fn(&Fault) -> Option<f64>| {
            let faults = scenario.fault.iter().filter_map(|fault| {
                let (value, name) = (value(fault)?, fault.wheel()?);
                // A loaded scenario names wheels that exist.
                let wheel = vehicle.wheel.iter().position(|w| w.name == name)?;
                let time_s = fault.span_s();
                Some((Span { wheel, time_s }, value))
            });
            faults.collect()
        };
        let supply = scenario.fault.iter().filter_map(|fault| match fault {
            Fault::SupplySag(sag) => Some((fault.span_s(), sag.part)),
            _ => None,
        });
        let follow = if lag_s > 0.0 {
            -libm::expm1(-step_s / lag_s)
        } else {
            1.0
        };
        Self {
            follow,
            follow_mean: 1.0 - follow * lag_s / step_s,
            sag: scenario.actuators.voltage_sag,
            stall_n_m: vehicle.motor.stall_torque_n_m,
            peak_n_m: vehicle.motor.peak_torque_n_m(),
            slope_n_m_s_rad: vehicle.motor.line_slope_n_m_s_rad(),
            step_s,
            shorted: Vec::new(),
            weak: of_wheels(|fault| match fault {
                Fault::WheelLost(_) => Some(0.0),
                Fault::MotorWeak(weak) => Some(weak.part),
                _ => None,
            }),
            supply: supply.collect(),
            drags: of_wheels(|fault| match fault {
                Fault::WheelDrag(drag) => Some(drag.damper_n_m_s_rad),
                _ => None,
            }),
            inertia_kg_m2: vehicle.wheel.iter().map(|w| w.inertia_kg_m2).collect(),
            gear: vehicle.wheel.iter().map(|w| w.gear).collect(),
            friction: vehicle
                .wheel
                .iter()
                // A loaded vehicle's figures are in range.
                .map(|w| vehicle.motor.gear_friction(w.gear).ok().flatten())
                .collect(),
            state: State {
                torque_n_m: vec![0.0; wheels],
                lagged_n_m: vec![0.0; wheels],
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
        let acting_n_m: f64 = self.state.torque_n_m.iter().map(|t| t.abs()).sum();
        let full = self.stall_n_m * self.gear.len() as f64;
        let supply = self.supply.iter().filter(|(span, _)| span.contains(&time_s));
        let voltage =
            (1.0 - self.sag * (acting_n_m / full).min(1.0)) * supply.map(|(_, part)| part).product::<f64>();
        for (i, commanded) in commanded_n_m.iter().enumerate() {
            // A bridge that shorts the windings drives no current through them.
            let strength = if self.is_shorted(i) {
                0.0
            } else {
                self.strength(i, time_s)
            };
            let [lower, upper] = self.line(i, voltage);
            let within = |torque: f64| torque.max(strength * lower).min(strength * upper);
            let lagged = &mut self.state.lagged_n_m[i];
            // What is left of a current after twenty time constants is none.
            if *commanded == 0.0 && lagged.abs() < 1e-9 * self.stall_n_m {
                *lagged = 0.0;
            }
            let gap = strength * commanded - *lagged;
            self.state.torque_n_m[i] = within(*lagged + self.follow_mean * gap);
            *lagged = within(*lagged + self.follow * gap);
        }
    }

    /// What is left of a motor: of its torque at every speed.
    fn strength(&self, wheel: usize, time_s: f64) -> f64 {
        let weak = self.weak.iter().filter(|(span, _)| span.is_active(wheel, time_s));
        weak.map(|(_, part)| part).product()
    }

    /// Lowest and highest torque of a motor at the speed that it has, at a part of its voltage, as
    /// [`omni_core::TorqueLimit::range`] has it.
    ///
    /// The speed is taken at the step's start. If the line is so steep that a wheel without load would pass its no-load
    /// speed in the step, the torque just reaches this speed.
    fn line(&self, wheel: usize, voltage: f64) -> [f64; 2] {
        let (velocity, slope) = (self.state.velocity_rad_s[wheel], self.slope_n_m_s_rad);
        let stall = voltage * self.stall_n_m;
        let most = stall.min(self.peak_n_m);
        let driving = (stall - slope * velocity.abs()).clamp(0.0, most);
        let lower = if velocity < 0.0 { -driving } else { -most };
        let upper = if velocity > 0.0 { driving } else { most };
        let per_rad_s = self.inertia_kg_m2[wheel] * self.gear[wheel] * self.gear[wheel] / self.step_s;
        if slope <= per_rad_s {
            return [lower, upper];
        }
        let no_load = stall / slope;
        let [back, ahead] = [-no_load, no_load].map(|to| per_rad_s * (to - velocity));
        [lower.max(back.min(0.0)), upper.min(ahead.max(0.0))]
    }

    /// What the gear of a wheel makes of the torque that acts; drags and viscous friction are not in it.
    ///
    /// Dry friction and efficiency are one law: turning forwards the wheel gets the lower torque of
    /// [`GearFriction::holding`], turning backwards the upper one, and at rest what keeps it there.
    /// Therefore the mean of both acts, and half their difference holds.
    pub(super) fn geared(&self, wheel: usize) -> Geared {
        let torque = self.state.torque_n_m[wheel];
        match &self.friction[wheel] {
            None => Geared {
                torque_n_m: torque,
                hold_n_m: 0.0,
            },
            Some(friction) => {
                let range = friction.holding(torque);
                Geared {
                    torque_n_m: self.gear[wheel] * f64::midpoint(range.lower_n_m, range.upper_n_m),
                    hold_n_m: 0.5 * (range.upper_n_m - range.lower_n_m),
                }
            }
        }
    }

    /// Does the gear of this wheel ever hold it by friction?
    pub(super) fn has_gear_friction(&self, wheel: usize) -> bool {
        self.friction[wheel].is_some()
    }

    /// Shorts the windings of these motors; of none if the list is empty.
    pub(super) fn brake(&mut self, motors: &[bool]) {
        self.shorted.clear();
        self.shorted.extend(motors);
    }

    fn is_shorted(&self, wheel: usize) -> bool {
        self.shorted.get(wheel) == Some(&true)
    }

    /// Damping by drags, viscous friction and a shorted motor between a wheel and its carrier now
    /// \[N.m.s/rad\], about the axle.
    ///
    /// A motor's torque falls with its speed because its windings see the voltage that it makes:
    /// shorted they see nothing else, and the slope is a damper. A motor that is lost has no
    /// windings to short, and a weak one only a part.
    pub(super) fn damper_n_m_s_rad(&self, wheel: usize, time_s: f64) -> f64 {
        let holding = self
            .drags
            .iter()
            .filter(|(span, _)| span.is_active(wheel, time_s));
        let drags: f64 = holding.map(|(_, damper)| damper).sum();
        let drags = match &self.friction[wheel] {
            None => drags,
            Some(friction) => drags + friction.viscous_n_m_s_rad(),
        };
        if self.is_shorted(wheel) {
            let slope = self.strength(wheel, time_s) * self.slope_n_m_s_rad;
            drags + slope / (self.gear[wheel] * self.gear[wheel])
        } else {
            drags
        }
    }

    /// Torque of the drags on an actuator \[N.m\]; at most what stops the wheel alone in a physics
    /// step, so that it does not swing.
    pub(super) fn explicit_drag_n_m(&self, wheel: usize, time_s: f64) -> f64 {
        let damper = self.damper_n_m_s_rad(wheel, time_s);
        if damper == 0.0 {
            return 0.0;
        }
        let gear = self.gear[wheel];
        let velocity = self.state.velocity_rad_s[wheel] * gear;
        -gear * damper.min(self.inertia_kg_m2[wheel] / self.step_s) * velocity
    }

    /// Accounts for a physics step that has been made: angles, work, torques. `moved` is by how
    /// much an actuator has turned \[rad\] and how fast it turns now \[rad/s\], with the velocity
    /// before; `drag_n_m` the torque of the drags on it in the step, and `held_n_m` that of the dry
    /// friction about its wheel's axle, given how far the actuator turned.
    pub(super) fn account(
        &mut self,
        share: f64,
        observation: &mut Observation,
        moved: impl Fn(usize, f64) -> [f64; 2],
        drag_n_m: impl Fn(&Self, usize) -> f64,
        held_n_m: impl Fn(Geared, usize, f64) -> f64,
    ) {
        for i in 0..self.gear.len() {
            let mut drag = drag_n_m(self, i);
            let [turned, after] = moved(i, self.state.velocity_rad_s[i]);
            if self.has_gear_friction(i) {
                // Total losses of the gear from the motor's torque.
                let geared = self.geared(i);
                let held = self.gear[i] * held_n_m(geared, i, turned);
                drag += geared.torque_n_m + held - self.state.torque_n_m[i];
            }
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
