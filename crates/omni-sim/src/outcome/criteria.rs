//! Detect runaway, lean and physics that gain energy: criteria gathered while a run goes on.

use crate::config::{Scenario, Vehicle};
use crate::control_sample::ControlSample;
use crate::observation::Observation;

/// A vehicle runs away where it is so much faster than commanded: half as fast again. Loops hold a speed
/// within some per cent, and what an edge or a slope adds is braked. The built-in vehicles, commanded
/// 0.3 m/s, have 0.47 m/s for as long at most, down the built-in hills; the bound is then 0.55 m/s.
const FASTER: f64 = 1.5;
/// And by so much \[m/s\]: what bumps and the end of a stall shake a vehicle that is commanded to creep, or to stand.
const SHAKEN_M_S: f64 = 0.1;
/// And about by so much \[m/s\] of the farthest wheel: what lets a vehicle slide a little turns it too, on
/// the built-in hills by 0.24 to 0.46 rad/s, of chugo7's farthest wheel 0.17 m/s, without a command to turn.
const TURNED_M_S: f64 = 0.25;
/// A run-up of a retry is faster than the command on purpose; traction control's are no faster than this multiple of
/// the command, whatever their targets say.
const RUN_UP_TIMES: f64 = 4.0;
/// For so long without a break \[s\]: a drop of 20 cm is over in 0.2 s, and what it leaves is braked in as long.
pub(super) const SUSTAINED_S: f64 = 0.5;
/// A vehicle that is commanded to slow down may do it as slowly as on wet ice, 0.05 times gravity \[m/s^2\].
pub(super) const BRAKING_M_S2: f64 = 0.5;

/// Is a vehicle faster than commanded?
pub(super) struct Runaway {
    /// From the origin to the farthest wheel: what a yaw rate is as a speed.
    reach_m: f64,
    period_s: f64,
    /// What it may still have of the largest speed commanded over the ground, and about \[m/s\].
    commanded_m_s: [f64; 2],
    over_s: f64,
    found: bool,
}

impl Runaway {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self {
            reach_m: farthest_wheel_m(scenario),
            period_s: scenario.period_s(),
            commanded_m_s: [0.0; 2],
            over_s: 0.0,
            found: false,
        }
    }

    pub(super) fn push(&mut self, sample: &ControlSample, seen: &Observation) {
        let parts = |twist: &omni_core::BodyTwist<f64>| {
            let turning_m_s = twist.wz_rad_s.abs() * self.reach_m;
            [libm::hypot(twist.vx_m_s, twist.vy_m_s), turning_m_s]
        };
        let (mut commanded, moving) = (parts(&sample.command), parts(&seen.twist));
        if let Some(traction) = sample
            .report
            .traction
            .as_ref()
            .filter(|traction| traction.retries > 0)
        {
            commanded[0] = commanded[0].max(traction.target_m_s.min(RUN_UP_TIMES * commanded[0]));
        }
        let mut over = false;
        // Each alone: a vehicle commanded to turn is not commanded to go.
        for (k, allowed_m_s) in [SHAKEN_M_S, TURNED_M_S].into_iter().enumerate() {
            let slowed_m_s = self.commanded_m_s[k] - BRAKING_M_S2 * self.period_s;
            self.commanded_m_s[k] = slowed_m_s.max(commanded[k]);
            over |= moving[k] > FASTER * self.commanded_m_s[k] + allowed_m_s;
        }
        self.over_s = lasts(self.over_s, over, self.period_s);
        self.found |= self.over_s >= SUSTAINED_S;
    }

    pub(super) fn found(&self) -> bool {
        self.found
    }
}

/// For how long something has lasted without a break, after another period \[s\].
pub(super) fn lasts(time_s: f64, still: bool, period_s: f64) -> f64 {
    if still { time_s + period_s } else { 0.0 }
}

/// From the origin to the farthest wheel \[m\].
pub(super) fn farthest_wheel_m(scenario: &Scenario) -> f64 {
    let wheels = scenario.vehicle().wheel.iter();
    wheels.fold(0.0, |reach, wheel| {
        reach.max(libm::hypot(wheel.position_m[0], wheel.position_m[1]))
    })
}

/// How much further than the ground asks a body may lean \[rad\]: 30 degrees. No built-in run has
/// any of it, whatever the vehicle and the policy; and a frame that stands 30 degrees steeper than
/// the ground under it has half its wheels in the air.
const SWING_RAD: f64 = core::f64::consts::FRAC_PI_6;

/// A hinge is at its stop within this \[rad\], and no other hinge's stop is so near to where it is on flat ground.
const AT_STOP_RAD: f64 = 0.02;

/// Does a body lean further than the ground asks, or has it fallen to its hinge's stop?
pub(super) struct Lean {
    most_rad: f64,
    allowed_rad: f64,
    /// From there on each hinge is at its stop \[rad\]; infinite if the ground may turn it so far.
    stop_rad: Vec<f64>,
    period_s: f64,
    at_stop_s: f64,
    fell: bool,
}

impl Lean {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let span_m = shortest_span_m(scenario.vehicle());
        let part = (scenario.terrain.relief_m(span_m) + scenario.highest_block_m()) / span_m;
        // Two rows of wheels, or two tracks, stand on heights that differ by that.
        let asked_rad = libm::asin(part.min(1.0));
        let stop_rad = |hinge: &crate::config::Hinge| {
            let stop_rad = hinge.limit_rad - AT_STOP_RAD;
            // Of its two bodies one may lean forward and one back.
            if stop_rad > 2.0 * asked_rad + AT_STOP_RAD {
                stop_rad
            } else {
                f64::INFINITY
            }
        };
        Self {
            most_rad: 0.0,
            allowed_rad: asked_rad + SWING_RAD,
            stop_rad: scenario.vehicle().hinge.iter().map(stop_rad).collect(),
            period_s: scenario.period_s(),
            at_stop_s: 0.0,
            fell: false,
        }
    }

    pub(super) fn push(&mut self, seen: &Observation) {
        self.most_rad = seen
            .body_lean_rad
            .iter()
            .fold(self.most_rad, |most, lean| most.max(*lean));
        let mut hinges = seen.hinges.iter().zip(&self.stop_rad);
        let at_stop = hinges.any(|(hinge, stop)| hinge.angle_rad.abs() >= *stop);
        self.at_stop_s = lasts(self.at_stop_s, at_stop, self.period_s);
        self.fell |= self.at_stop_s >= SUSTAINED_S;
    }

    pub(super) fn found(&self) -> bool {
        self.fell || self.most_rad > self.allowed_rad
    }
}

/// The shortest way between neighbouring rows or tracks of wheels \[m\]: over it a step in the
/// ground turns a body furthest.
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

/// Part of the energy that went through a run which finite steps may gain: a thousand times what
/// any built-in run's balance misses, and what it misses there is lost, not gained.
const GAINED_PART: f64 = 0.1;
/// And so much \[m\] times the weight: twenty times what any built-in run gains at any time, 0.05 mm.
const GAINED_M: f64 = 1e-3;

/// Whether the physics returns more energy than was put in.
pub(super) struct Gain {
    weight_n: f64,
    released_j: f64,
    worst: f64,
    gained: Gained,
}

/// Energy out of nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Gained {
    /// Energy gained \[J\].
    pub(crate) gained_j: f64,
    /// Energy through the vehicle in the same time \[J\].
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
        // A falling vehicle also gains its potential energy.
        self.released_j = self.released_j.max(-energy.potential_j);
        let through_j = energy.turnover_j + self.released_j;
        let gained_j = energy.made_j();
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

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

    use omni_core::BodyTwist;

    use super::*;
    use crate::Simulation;
    use crate::config::Override;

    fn scenario(name: &str, keys: &[&str]) -> Scenario {
        let keys: Vec<_> = keys.iter().map(|key| Override::parse(key).unwrap()).collect();
        Scenario::load(name, &keys).unwrap()
    }

    /// What a period shows where a vehicle has one twist and another command.
    fn period(scenario: &Scenario) -> (ControlSample, Observation) {
        let simulation = Simulation::new(scenario).unwrap();
        (simulation.sample().clone(), simulation.observation().clone())
    }

    /// Is a vehicle, commanded and moving like that for so many periods of 1 ms one after the other, running away?
    fn runs_away(stages: &[(u32, [f64; 3], [f64; 3])]) -> bool {
        let scenario = scenario("flat", &[]);
        let (mut sample, mut seen) = period(&scenario);
        let mut runaway = Runaway::new(&scenario);
        for (periods, commanded, moving) in stages {
            (sample.command, seen.twist) =
                (BodyTwist::from_array(*commanded), BodyTwist::from_array(*moving));
            (0..*periods).for_each(|_| runaway.push(&sample, &seen));
        }
        runaway.found()
    }

    #[test]
    fn half_as_fast_again_and_a_tenth_m_s_for_half_a_second_is_running_away() {
        let commanded = [0.3, 0.0, 0.0];
        let forward = |vx| [vx, 0.0, 0.0];
        assert!(!runs_away(&[(10_000, commanded, forward(0.549))]));
        assert!(runs_away(&[(501, commanded, forward(0.551))]));
        assert!(
            runs_away(&[(501, commanded, forward(-0.551))]),
            "the wrong way too"
        );
        assert!(runs_away(&[(501, commanded, [0.0, 0.551, 0.0])]), "and sideways");
        // 64 counts per turn: asked 0.3 m/s, drove 2.6.
        assert!(runs_away(&[(501, commanded, forward(2.6))]));
        // A break of one period begins anew: drops and bumps.
        assert!(!runs_away(&[
            (499, commanded, forward(2.0)),
            (1, commanded, forward(0.3)),
            (499, commanded, forward(2.0))
        ]));
        // A turn of 3 rad/s has the farthest wheel, 0.378 m out, at 1.13 m/s.
        assert!(runs_away(&[(501, commanded, [0.0, 0.0, 3.0])]));
        assert!(!runs_away(&[(5000, [0.0, 0.0, 3.0], [0.0, 0.0, 3.0])]));
    }

    #[test]
    fn a_command_to_turn_is_none_to_go_and_a_command_to_go_none_to_turn() {
        let turn = [0.0, 0.0, 3.0];
        // Sliding off at 1.7 m/s: half as much again as 3 rad/s have the farthest wheel, and yet it
        // was not commanded to go.
        assert!(runs_away(&[(501, turn, [1.7, 0.0, 3.0])]));
        assert!(runs_away(&[(501, turn, [0.0, 0.101, 3.0])]));
        assert!(!runs_away(&[(5000, turn, [0.0, 0.099, 3.0])]));
        // A vehicle that goes fast may be turned no further than one that creeps: 0.25 m/s of the farthest wheel.
        let (fast, reach_m) = ([2.0, 0.0, 0.0], 0.3_f64.hypot(0.23));
        let turned = |m_s: f64| [2.0, 0.0, m_s / reach_m];
        assert!(runs_away(&[(501, fast, turned(0.251))]));
        assert!(!runs_away(&[(5000, fast, turned(0.249))]));
        // Each is slowed down alone: who stops turning was not going.
        assert!(runs_away(&[(1000, turn, turn), (501, [0.0; 3], [0.5, 0.0, 0.0])]));
    }

    #[test]
    fn a_stop_may_take_what_wet_ice_takes_and_no_more() {
        let braking = |m_s2: f64| -> Vec<(u32, [f64; 3], [f64; 3])> {
            let slowing = (0..3000_u32).map(|k| {
                (
                    1,
                    [0.0; 3],
                    [(1.0 - m_s2 * f64::from(k) * 1e-3).max(0.0), 0.0, 0.0],
                )
            });
            std::iter::once((1000, [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
                .chain(slowing)
                .collect()
        };
        assert!(!runs_away(&braking(0.5)));
        // At 0.05 m/s^2 it still has 0.9 m/s when it should have stood.
        assert!(runs_away(&braking(0.05)));
        // Commanded to stand for good, and never stopping: 39 of 144 runs of an attack.
        assert!(runs_away(&[
            (1000, [0.3, 0.0, 0.0], [0.3, 0.0, 0.0]),
            (2000, [0.0; 3], [0.3, 0.0, 0.0])
        ]));
    }

    fn leans(scenario: &Scenario, degrees: f64) -> bool {
        let (_, mut seen) = period(scenario);
        let mut lean = Lean::new(scenario);
        *seen.body_lean_rad.last_mut().unwrap() = degrees.to_radians();
        lean.push(&seen);
        lean.found()
    }

    #[test]
    fn a_lean_is_measured_against_what_the_ground_asks() {
        // Flat: 30 degrees. Neighbouring tracks of chugo7 are 0.23 m apart: a step of 5 cm turns a
        // frame by 12.6 degrees at most.
        let flat = scenario("flat", &[]);
        assert!(!leans(&flat, 29.0) && leans(&flat, 30.5) && leans(&flat, 52.0));
        let step = scenario("step", &[]);
        assert!(!leans(&step, 42.0) && leans(&step, 43.0));
        // Half a metre stands a frame upright: what tips is another verdict.
        assert!(!leans(&scenario("step", &["terrain.height_m=0.5"]), 89.0));
        let ramp = scenario("ramp", &["terrain.slope_rad=0.5"]);
        assert!(!leans(&ramp, 0.5_f64.to_degrees() + 29.0));
    }

    #[test]
    fn a_tenth_above_what_went_through_is_a_gain_and_losses_are_none() {
        let scenario = scenario("flat", &[]);
        let gained = |residual_j: f64, turnover_j: f64, potential_j: f64| {
            let (_, mut seen) = period(&scenario);
            // Work that is nowhere in the balance is a positive residual, energy from nowhere a negative one.
            seen.energy.turnover_j = turnover_j;
            seen.energy.potential_j = potential_j;
            seen.energy.work_in_j = potential_j + residual_j;
            let mut gain = Gain::new(200.0);
            gain.push(&seen);
            gain.found()
        };
        // 0.2 J for 1 mm of 200 N, and a tenth of 5 J.
        assert_eq!(gained(-0.69, 5.0, 0.0), None);
        let found = gained(-15.0, 5.0, 0.0).unwrap();
        assert!((found.gained_j - 15.0).abs() < 1e-9 && found.through_j == 5.0);
        assert_eq!(gained(15.0, 5.0, 0.0), None, "lost work is no gain");
        assert_eq!(gained(-1.0, 5.0, -10.0), None, "10 J came of falling");
        assert!(gained(-1.0, 5.0, 10.0).is_some());
    }

    #[test]
    fn contacts_that_return_more_than_they_took_made_it_though_the_balance_closes() {
        let scenario = scenario("flat", &[]);
        let made = |impact_loss_j: f64, friction_loss_j: f64| {
            let (_, mut seen) = period(&scenario);
            let energy = &mut seen.energy;
            (energy.turnover_j, energy.work_in_j) = (5.0, 5.0);
            (energy.impact_loss_j, energy.friction_loss_j) = (impact_loss_j, friction_loss_j);
            energy.kinetic_j = 5.0 - impact_loss_j - friction_loss_j;
            assert!(energy.residual_j().abs() < 1e-12);
            let mut gain = Gain::new(200.0);
            gain.push(&seen);
            gain.found().map(|found| found.gained_j)
        };
        assert_eq!(made(-15.0, 0.0), Some(15.0));
        assert_eq!(made(-15.0, 14.9), None, "what friction took of it is no gain");
        assert_eq!(made(4.0, 1.0), None);
    }
}
