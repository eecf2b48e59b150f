//! What tells a drive from a runaway, a lean and physics that gain energy, gathered while a run goes on.

use crate::config::{Scenario, Vehicle};
use crate::controller::ControlSample;
use crate::observation::Observation;

/// A vehicle runs away where it is so much faster than it is told: half as fast again. Loops hold a speed within some per cent, and
/// what an edge or a slope adds is braked.
const FASTER: f64 = 1.5;
/// And by so much \[m/s\]: what bumps and the end of a stall shake a vehicle that is told to creep, or to stand.
const SHAKEN_M_S: f64 = 0.1;
/// For so long without a break \[s\]: a drop of 20 cm is over in 0.2 s, and what it leaves is braked in as long.
const SUSTAINED_S: f64 = 0.5;
/// A vehicle that is told to slow down may do it as slowly as on wet ice, 0.05 times gravity \[m/s^2\].
const BRAKING_M_S2: f64 = 0.5;

/// Is a vehicle faster than it is told?
pub(super) struct Runaway {
    /// From the origin to the farthest wheel: what a yaw rate is as a speed.
    reach_m: f64,
    period_s: f64,
    /// What it may still have of the largest speed commanded \[m/s\].
    told_m_s: f64,
    over_s: f64,
    found: bool,
}

impl Runaway {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let wheels = &scenario.vehicle().wheel;
        let far = |reach: f64, wheel: &crate::config::WheelSpec| {
            reach.max(wheel.position_m[0].hypot(wheel.position_m[1]))
        };
        Self {
            reach_m: wheels.iter().fold(0.0, far),
            period_s: scenario.period_s(),
            told_m_s: 0.0,
            over_s: 0.0,
            found: false,
        }
    }

    pub(super) fn push(&mut self, sample: &ControlSample, seen: &Observation) {
        let fastest = |twist: &omni_core::BodyTwist<f64>| {
            twist.vx_m_s.hypot(twist.vy_m_s) + twist.wz_rad_s.abs() * self.reach_m
        };
        let slowed_m_s = self.told_m_s - BRAKING_M_S2 * self.period_s;
        self.told_m_s = slowed_m_s.max(fastest(&sample.command));
        if fastest(&seen.twist) > FASTER * self.told_m_s + SHAKEN_M_S {
            self.over_s += self.period_s;
        } else {
            self.over_s = 0.0;
        }
        self.found |= self.over_s >= SUSTAINED_S;
    }

    pub(super) fn found(&self) -> bool {
        self.found
    }
}

/// How much further than the ground asks a body may lean \[rad\]: 30 degrees. What built-in runs have of it, from drops off edges and from frames
/// that swing, is 8 degrees; and a frame that stands 30 degrees steeper than the ground under it has half its wheels in the air.
const SWING_RAD: f64 = 0.52;

/// Does a body lean further than the ground asks?
pub(super) struct Lean {
    most_rad: f64,
    allowed_rad: f64,
}

impl Lean {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let span_m = shortest_span_m(scenario.vehicle());
        let part = scenario.terrain.relief_m(span_m) / span_m;
        Self {
            most_rad: 0.0,
            // Two rows of wheels, or two tracks, stand on heights that differ by that.
            allowed_rad: libm::asin(part.min(1.0)) + SWING_RAD,
        }
    }

    pub(super) fn push(&mut self, seen: &Observation) {
        self.most_rad = seen
            .body_lean_rad
            .iter()
            .fold(self.most_rad, |most, lean| most.max(*lean));
    }

    pub(super) fn found(&self) -> bool {
        self.most_rad > self.allowed_rad
    }
}

/// The shortest way between neighbouring rows or tracks of wheels \[m\]: over it a step in the ground turns a body furthest.
fn shortest_span_m(vehicle: &Vehicle) -> f64 {
    let along = |k: usize| {
        let mut places: Vec<f64> = vehicle.wheel.iter().map(|wheel| wheel.position_m[k]).collect();
        places.sort_by(f64::total_cmp);
        let gaps = places.windows(2).map(|pair| pair[1] - pair[0]);
        gaps.filter(|gap| *gap >= ABREAST_M).fold(f64::INFINITY, f64::min)
    };
    along(0).min(along(1))
}

/// Wheels closer than that are side by side, as [`Vehicle::rows`] has it \[m\].
const ABREAST_M: f64 = 0.02;

/// Part of the energy that went through a run which finite steps may gain: ten times what they miss of it in any built-in run.
const GAINED_PART: f64 = 0.1;
/// And so much \[m\] times the weight: what contacts give under a vehicle that is put down.
const GAINED_M: f64 = 1e-3;

/// Does the physics give back more than was put in?
pub(super) struct Gain {
    weight_n: f64,
    released_j: f64,
    worst: f64,
    gained: Gained,
}

/// Energy out of nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Gained {
    /// So much of it \[J\].
    pub(crate) gained_j: f64,
    /// While so much went through the vehicle \[J\].
    pub(crate) through_j: f64,
}

impl Gain {
    pub(super) fn new(weight_n: f64) -> Self {
        Self {
            weight_n,
            released_j: 0.0,
            worst: 0.0,
            gained: Gained::default(),
        }
    }

    pub(super) fn push(&mut self, seen: &Observation) {
        let energy = &seen.energy;
        // A vehicle that falls has what it falls too.
        self.released_j = self.released_j.max(-energy.potential_j);
        let through_j = energy.turnover_j + self.released_j;
        let gained_j = -energy.residual_j();
        let worst = gained_j / (GAINED_PART * through_j + GAINED_M * self.weight_n);
        if worst > self.worst {
            self.worst = worst;
            self.gained = Gained { gained_j, through_j };
        }
    }

    pub(super) fn found(&self) -> Option<Gained> {
        (self.worst > 1.0).then_some(self.gained)
    }
}
