//! Doubtful friction and gains: against the torque of the motors, and against what follows from masses and motors.

use crate::digits::digits;
use crate::{Error, Vehicle};

/// Dry friction is doubtful beyond this fraction of the motor's stall torque at the wheel.
const DRY: f64 = 0.5;
/// Viscous friction is doubtful that leaves the wheel less than this part of the speed that limits and motor allow.
const VISCOUS: f64 = 0.5;
/// A rim is doubtful that viscous friction holds below this where nothing else limits the speed \[m/s\].
const CREEP_M_S: f64 = 0.05;
/// kp is doubtful beyond so many times, or below such a part of, what follows from masses and
/// motors. A loop that is so many times as fast has the square of that as ki.
const GAINS: f64 = 5.0;
/// A time constant beyond this is doubtful \[s\].
const SLOW_S: f64 = 1.0;

impl Vehicle {
    /// Friction of gears that the motors do not overcome.
    pub(super) fn too_lossy(&self) -> Result<Option<String>, Error> {
        let motor = &self.motor;
        let (dry, viscous) = (motor.gear_friction_n_m, motor.viscous_n_m_s_rad);
        let at_wheel = |torque_n_m: f64, gear: f64| torque_n_m * motor.efficiency / gear;
        let stuck = self.wheel.iter().find_map(|wheel| {
            let most_n_m = at_wheel(motor.peak_torque_n_m(), wheel.gear);
            (dry > DRY * most_n_m).then_some((wheel, most_n_m))
        });
        if let Some((wheel, most_n_m)) = stuck {
            return Ok(Some(format!(
                "motor.gear_friction_n_m = {dry}, but the motor gives wheel {} at most {} N.m; usual: less than half of that",
                wheel.name,
                digits(most_n_m)
            )));
        }
        let top = self.top_rad_s()?;
        let slowed = self.wheel.iter().find_map(|wheel| {
            // Speed at which the line's torque at the wheel equals both frictions.
            let gear = wheel.gear;
            let left = at_wheel(motor.stall_torque_n_m, gear) - dry;
            let slope = at_wheel(motor.line_slope_n_m_s_rad(), gear) / gear;
            let capped = (at_wheel(motor.peak_torque_n_m(), gear) - dry) / viscous;
            let reached = (left / (slope + viscous)).min(capped);
            let wanted = match top {
                Some(top) => VISCOUS * (top * gear).min(left / slope),
                None => CREEP_M_S / wheel.radius_m,
            };
            (viscous > 0.0 && reached < wanted).then_some((wheel, reached))
        });
        Ok(slowed.map(|(wheel, reached)| {
            let why = match top {
                Some(top) => format!("limits and motor are for {}", digits(top * wheel.gear)),
                None => format!("that is {} m/s", digits(reached * wheel.radius_m)),
            };
            format!(
                "motor.viscous_n_m_s_rad = {viscous}: with it wheel {} reaches {} rad/s without load, and {why}; check the unit",
                wheel.name,
                digits(reached)
            )
        }))
    }

    /// Gains that are far from what follows from masses and motors, and motors with which no gains are fast.
    pub(super) fn wrong_gains(&self, period_s: f64) -> Result<Vec<String>, Error> {
        let derived = self.derived_gains(period_s)?;
        let mut doubts = Vec::new();
        let Some(gains) = &self.gains else {
            if derived.time_constant_s > SLOW_S {
                doubts.push(format!(
                    "gains: the derived time constant is {:.2} s, for {:.3} kg and motors of {} N.m: the wheels follow slowly; \
                     use stronger motors, a lower mass or [limits]",
                    derived.time_constant_s,
                    self.mass_kg(),
                    self.motor.stall_torque_n_m
                ));
            }
            return Ok(doubts);
        };
        let (kp, ki, kd) = (gains.kp_n_m_s_rad, gains.ki_n_m_rad, gains.kd_n_m_s2_rad);
        let mut compare = |key: &str, given: f64, right: f64, usual: std::ops::RangeInclusive<f64>| {
            let times = given / right;
            if !usual.contains(&times) {
                doubts.push(format!(
                    "gains: {key} = {given} is {} times what follows from masses and motors, {}; leave [gains] out, or tune them",
                    digits(times),
                    digits(right)
                ));
            }
        };
        compare(
            "kp_n_m_s_rad",
            kp,
            derived.gains.kp_n_m_s_rad,
            1.0 / GAINS..=GAINS,
        );
        // Without an integral a loop is slow to the end, but it is one.
        compare("ki_n_m_rad", ki, derived.gains.ki_n_m_rad, 0.0..=GAINS * GAINS);
        // The derivative acts like an inertia: where it is a good part of the wheel's own, a period
        // of delay makes it swing.
        let inertia = derived.inertia_kg_m2;
        if kd > inertia / GAINS {
            doubts.push(format!(
                "gains: kd_n_m_s2_rad = {kd}, but a wheel moves an inertia of {} kg.m2; usual: 0, or up to a fifth of that",
                digits(inertia)
            ));
        }
        let slowest_s = self.motors_time_constant_s(inertia)?;
        if slowest_s > SLOW_S {
            doubts.push(format!(
                "motor.stall_torque_n_m = {}: no gains move {:.3} kg with a time constant below {slowest_s:.2} s; \
                 use stronger motors, a lower mass or [limits]",
                self.motor.stall_torque_n_m,
                self.mass_kg()
            ));
        }
        Ok(doubts)
    }
}
