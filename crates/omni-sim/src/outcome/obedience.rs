//! Does a vehicle move the way that it is commanded, and does it rest when that is commanded?

use std::collections::VecDeque;

use omni_core::BodyTwist;
use omni_core::traction::SupervisorMode;

use super::criteria::{BRAKING_M_S2, SUSTAINED_S, farthest_wheel_m, lasts};
use crate::config::Scenario;
use crate::control_sample::ControlSample;
use crate::observation::Observation;

/// Slower motion, and a slower command, has no direction \[m/s\]; yaw counts as the speed of the farthest wheel about
/// the origin.
const LEAST_M_S: f64 = 0.02;
/// Nor has motion below this part of the command.
const LEAST_PART: f64 = 0.1;
/// A vehicle that slips off an edge goes back by less than this \[m\].
const LEAST_M: f64 = 0.05;
/// Traction control that backs off for another try moves against the command on purpose: for as long as it does, over
/// this way at most \[m\], and 2 s from the beginning whatever it does \[s\].
const BACKS_OFF_M: f64 = 0.5;
const BACKS_OFF_S: f64 = 2.0;
/// A vehicle at rest moves no faster over the ground \[m/s\], and about \[rad/s\].
const STANDS: [f64; 2] = [0.01, 0.05];
/// Without its motors a vehicle may coast for so long after its torque should have ended \[s\].
const COASTS_S: f64 = 1.0;
/// More work of the motors in [`PUSHES_S`] moves a vehicle \[J\]: 5 kg get 0.14 m/s by it.
const PUSHES_J: f64 = 0.05;
const PUSHES_S: f64 = 0.6;
/// Work is summed over such times \[s\].
const MARK_S: f64 = 0.01;

/// Heading that a vehicle may be off without being off its course \[rad\]: 45 degrees.
const OFF_RAD: f64 = core::f64::consts::FRAC_PI_4;
/// And this part of all turning that was commanded. Less than this part of the commanded way has fallen short.
const HALF: f64 = 0.5;
/// A shorter way that is commanded is none to fall short of \[m\].
const COMMANDED_M: f64 = 0.1;

/// Watches both.
pub(super) struct Obedience {
    period_s: f64,
    reach_m: f64,
    command_point_m: [f64; 2],
    way_per_rad: Vec<f64>,
    /// From a reference of 0 on, this is how long torque may last \[s\].
    torque_ends_s: f64,
    /// The command as a vehicle follows that speeds up and slows down with [`BRAKING_M_S2`]: over
    /// the ground, and about.
    followed: ([f64; 2], f64),
    against: [Against; 2],
    retries: u32,
    backs_off_s: f64,
    backed_off_m: f64,
    on_purpose: bool,
    rest_s: f64,
    moves_s: f64,
    work: Work,
    course: Course,
    found: Found,
}

/// What it was found to do.
#[derive(Clone, Copy, Default)]
pub(super) struct Found {
    pub(super) wrong_way: bool,
    pub(super) drove_on: bool,
    pub(super) rolled_on: bool,
    pub(super) off_course: bool,
    pub(super) fell_short: bool,
}

/// What was commanded since the start, as a vehicle follows it, and what became of it.
#[derive(Default)]
struct Course {
    /// A path says by itself how far the heading is off.
    has_path: bool,
    /// Way over the ground, and of the farthest wheel about the origin \[m\], and how much of it the vehicle went.
    commanded_m: f64,
    went_m: f64,
    commanded_rad: f64,
    /// Turned beyond that \[rad\].
    unasked_rad: f64,
}

/// For how long and how far something has gone against its command without a break.
#[derive(Default)]
struct Against {
    time_s: f64,
    way_m: f64,
}

/// Work of the motors in the last [`PUSHES_S`].
#[derive(Default)]
struct Work {
    total_j: f64,
    since_mark_s: f64,
    /// The total at each mark, the oldest first.
    marks_j: VecDeque<f64>,
}

impl Obedience {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self {
            period_s: scenario.period_s(),
            reach_m: farthest_wheel_m(scenario),
            command_point_m: scenario
                .drive
                .as_ref()
                .map_or([0.0; 2], |drive| drive.command_point_m),
            way_per_rad: scenario
                .vehicle()
                .wheel
                .iter()
                .map(crate::config::WheelSpec::way_per_rad)
                .collect(),
            torque_ends_s: scenario.control.rest.torque_ends_s(),
            followed: Default::default(),
            against: Default::default(),
            retries: 0,
            backs_off_s: 0.0,
            backed_off_m: 0.0,
            on_purpose: false,
            rest_s: 0.0,
            moves_s: 0.0,
            work: Work::default(),
            course: Course {
                has_path: scenario.command.path.is_some(),
                ..Course::default()
            },
            found: Found::default(),
        }
    }

    /// Adds a period; `path_off_rad` is the heading error relative to a path.
    pub(super) fn push(&mut self, sample: &ControlSample, seen: &Observation, path_off_rad: f64) {
        self.found.off_course |= path_off_rad.abs() > OFF_RAD;
        let Some(command) = sample.commanded() else {
            (self.followed, self.against) = Default::default();
            self.rest_s = 0.0;
            return;
        };
        let command = BodyTwist::from_point(command, self.command_point_m);
        // The heading hold turns a vehicle that is not asked to turn.
        let turns = sample.asked.wz_rad_s * command.wz_rad_s > 0.0;
        self.follow(
            [command.vx_m_s, command.vy_m_s],
            if turns { command.wz_rad_s } else { 0.0 },
        );
        if let Some(retries) = sample.retries().filter(|retries| *retries != self.retries) {
            (self.retries, self.backs_off_s, self.backed_off_m) = (retries, BACKS_OFF_S, 0.0);
        }
        self.backs_off_s -= self.period_s;
        self.backed_off_m += libm::hypot(seen.twist.vx_m_s, seen.twist.vy_m_s) * self.period_s;
        let mode = sample.report.traction.as_ref().map(|traction| traction.mode);
        self.on_purpose = self.backs_off_s > 0.0
            || (mode == Some(SupervisorMode::BackOff) && self.backed_off_m < BACKS_OFF_M);
        self.judge_direction(&seen.twist);
        self.judge_course(&seen.twist);

        let rest = command.to_array() == [0.0; 3] && self.followed == Default::default();
        self.rest_s = lasts(self.rest_s, rest, self.period_s);
        if self.rest_s > self.torque_ends_s {
            self.judge_rest(seen);
        } else {
            (self.moves_s, self.work) = Default::default();
        }
    }

    fn follow(&mut self, [vx, vy]: [f64; 2], wz: f64) {
        let step_m_s = BRAKING_M_S2 * self.period_s;
        let ([x, y], about) = &mut self.followed;
        let part = step_m_s / libm::hypot(vx - *x, vy - *y);
        if part < 1.0 {
            *x += part * (vx - *x);
            *y += part * (vy - *y);
        } else {
            (*x, *y) = (vx, vy);
        }
        let most = step_m_s / self.reach_m;
        *about = if (wz - *about).abs() > most {
            *about + most.copysign(wz - *about)
        } else {
            wz
        };
    }

    fn judge_direction(&mut self, twist: &BodyTwist<f64>) {
        let ([x, y], about) = self.followed;
        let size = libm::hypot(x, y);
        let along = (twist.vx_m_s * x + twist.vy_m_s * y) / size;
        let parts = [
            (size, along),
            (
                self.reach_m * about.abs(),
                self.reach_m * twist.wz_rad_s * about.signum(),
            ),
        ];
        for (against, (commanded_m_s, moves_m_s)) in self.against.iter_mut().zip(parts) {
            let goes = commanded_m_s >= LEAST_M_S && -moves_m_s > LEAST_M_S.max(LEAST_PART * commanded_m_s);
            if goes && !self.on_purpose {
                against.time_s += self.period_s;
                against.way_m -= moves_m_s * self.period_s;
            } else {
                *against = Against::default();
            }
            self.found.wrong_way |= against.time_s >= SUSTAINED_S && against.way_m >= LEAST_M;
        }
    }

    fn judge_course(&mut self, twist: &BodyTwist<f64>) {
        let ([x, y], about) = self.followed;
        let (size, course) = (libm::hypot(x, y), &mut self.course);
        course.commanded_m += (size + self.reach_m * about.abs()) * self.period_s;
        if size > 0.0 {
            course.went_m += (twist.vx_m_s * x + twist.vy_m_s * y) / size * self.period_s;
        }
        if about != 0.0 {
            course.went_m += self.reach_m * twist.wz_rad_s * about.signum() * self.period_s;
        }
        course.commanded_rad += about.abs() * self.period_s;
        course.unasked_rad += (twist.wz_rad_s - about) * self.period_s;
        let allowed_rad = OFF_RAD + HALF * course.commanded_rad;
        self.found.off_course |= !course.has_path && course.unasked_rad.abs() > allowed_rad;
        self.found.fell_short =
            course.commanded_m >= COMMANDED_M && course.went_m < HALF * course.commanded_m;
    }

    fn judge_rest(&mut self, seen: &Observation) {
        let moves = libm::hypot(seen.twist.vx_m_s, seen.twist.vy_m_s) > STANDS[0]
            || seen.twist.wz_rad_s.abs() > STANDS[1];
        self.moves_s = lasts(self.moves_s, moves, self.period_s);
        self.found.rolled_on |= self.moves_s >= COASTS_S;
        // What a motor takes out of a wheel is no push.
        let pushes_w = |(wheel, way): (&crate::observation::WheelObservation, &f64)| {
            (wheel.torque_n_m * wheel.rim_m_s / way).max(0.0)
        };
        let power_w: f64 = seen.wheels.iter().zip(&self.way_per_rad).map(pushes_w).sum();
        let done_j = self.work.push(power_w * self.period_s, self.period_s);
        self.found.drove_on |= done_j > PUSHES_J;
    }

    pub(super) fn found(&self) -> Found {
        self.found
    }
}

impl Work {
    /// Adds a period's; returns that of the last [`PUSHES_S`].
    fn push(&mut self, work_j: f64, period_s: f64) -> f64 {
        if self.marks_j.is_empty() {
            self.marks_j.push_back(0.0);
        }
        self.total_j += work_j;
        self.since_mark_s += period_s;
        if self.since_mark_s >= MARK_S {
            self.since_mark_s = 0.0;
            self.marks_j.push_back(self.total_j);
            let marks = (PUSHES_S / period_s.max(MARK_S)).round() as usize + 1;
            if self.marks_j.len() > marks {
                self.marks_j.pop_front();
            }
        }
        self.total_j - self.marks_j.front().copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

    use super::*;
    use crate::config::Override;
    use crate::{Simulation, TractionReport};
    use omni_core::traction::TractionLoops;

    /// Periods of 1 ms of one kind, one after the other: how many, what is commanded, how the vehicle moves, the torque
    /// of its first wheel \[N.m\], how fast that turns \[rad/s\], and how often traction control has backed off.
    struct Stage {
        periods: u32,
        commanded: [f64; 3],
        moves: [f64; 3],
        torque_n_m: f64,
        turns_rad_s: f64,
        retries: Option<u32>,
        mode: SupervisorMode,
    }

    fn stage(periods: u32, commanded: [f64; 3], moves: [f64; 3]) -> Stage {
        Stage {
            periods,
            commanded,
            moves,
            torque_n_m: 0.0,
            turns_rad_s: 0.0,
            retries: None,
            mode: SupervisorMode::Drive,
        }
    }

    /// Traction control that backed off so many times, in this phase.
    fn backed_off(retries: u32, mode: SupervisorMode) -> TractionReport {
        TractionReport {
            factor: 1.0,
            speed_m_s: 0.0,
            target_m_s: 0.0,
            thrust_n_m: 0.0,
            speed_wheel: None,
            row: 0,
            mode,
            row_retries: 0,
            retries,
            edge_m: 0.0,
            heading_rad: 0.0,
            gyro_zero_rad_s: 0.0,
            loops: TractionLoops::Plain,
            drift_m_s: 0.0,
            wheels: Vec::new(),
        }
    }

    fn flat(keys: &[&str]) -> Scenario {
        let keys: Vec<_> = keys.iter().map(|key| Override::parse(key).unwrap()).collect();
        Scenario::load("flat", &keys).unwrap()
    }

    fn found_with(keys: &[&str], stages: &[Stage]) -> Found {
        let scenario = flat(keys);
        let simulation = Simulation::new(&scenario).unwrap();
        let (mut sample, mut seen) = (simulation.sample().clone(), simulation.observation().clone());
        let way = scenario.vehicle().wheel[0].way_per_rad();
        let mut obedience = Obedience::new(&scenario);
        for stage in stages {
            (sample.command, seen.twist) = (
                BodyTwist::from_array(stage.commanded),
                BodyTwist::from_array(stage.moves),
            );
            sample.asked = sample.command;
            sample.report.traction = stage.retries.map(|retries| backed_off(retries, stage.mode));
            seen.wheels[0].torque_n_m = stage.torque_n_m;
            seen.wheels[0].rim_m_s = stage.turns_rad_s * way;
            (0..stage.periods).for_each(|_| obedience.push(&sample, &seen, 0.0));
        }
        obedience.found()
    }

    fn found(stages: &[Stage]) -> Found {
        found_with(&[], stages)
    }

    const AHEAD: [f64; 3] = [0.3, 0.0, 0.0];
    const BACK: [f64; 3] = [-0.3, 0.0, 0.0];
    const REST: [f64; 3] = [0.0; 3];

    #[test]
    fn half_a_second_and_five_centimetres_against_the_command_is_the_wrong_way() {
        let goes =
            |periods, moves| found(&[stage(1000, AHEAD, AHEAD), stage(periods, AHEAD, moves)]).wrong_way;
        assert!(goes(501, BACK) && !goes(499, BACK));
        // 5 cm at 0.04 m/s take 1.25 s; slower than a tenth of the command is no direction.
        assert!(goes(1260, [-0.04, 0.0, 0.0]) && !goes(1240, [-0.04, 0.0, 0.0]));
        assert!(!goes(60_000, [-0.029, 0.0, 0.0]));
        // Standing and sliding aside are not against it.
        assert!(!goes(5000, REST) && !goes(5000, [0.0, -0.5, 0.0]));
        // A break of one period begins anew.
        let broken = [
            stage(1000, AHEAD, AHEAD),
            stage(499, AHEAD, BACK),
            stage(1, AHEAD, AHEAD),
            stage(499, AHEAD, BACK),
        ];
        assert!(!found(&broken).wrong_way);
    }

    #[test]
    fn turning_against_the_command_is_wrong_way_unless_only_the_heading_hold_asked() {
        let (left, right) = ([0.3, 0.0, 0.5], [0.3, 0.0, -0.5]);
        // chugo7's farthest wheel is 0.378 m out: 0.5 rad/s are 0.19 m/s, of which 5 cm take 0.26 s.
        assert!(found(&[stage(1000, left, left), stage(501, left, right)]).wrong_way);
        assert!(!found(&[stage(1000, left, left), stage(499, left, right)]).wrong_way);
        assert!(
            !found(&[stage(3000, AHEAD, right)]).wrong_way,
            "no turn was commanded"
        );
        let scenario = flat(&[]);
        let simulation = Simulation::new(&scenario).unwrap();
        let (mut sample, mut seen) = (simulation.sample().clone(), simulation.observation().clone());
        (sample.asked, sample.command) = (BodyTwist::from_array(AHEAD), BodyTwist::from_array(left));
        seen.twist = BodyTwist::from_array(right);
        let mut held = Obedience::new(&scenario);
        (0..3000).for_each(|_| held.push(&sample, &seen, 0.0));
        assert!(!held.found().wrong_way);
    }

    #[test]
    fn less_than_half_of_the_commanded_way_has_fallen_short() {
        let goes = |commanded, moves| found(&[stage(4000, commanded, moves)]).fell_short;
        // The command as it is followed comes to 0.3 m/s in 0.6 s: 1.11 m in 4 s. At v the vehicle
        // is behind that once v is below 0.139 m/s.
        assert!(goes(AHEAD, [0.138, 0.0, 0.0]) && !goes(AHEAD, [0.140, 0.0, 0.0]));
        assert!(
            goes(AHEAD, BACK) && goes(AHEAD, [0.0, 0.3, 0.0]),
            "only the way along counts"
        );
        // A turn of 0.5 rad/s, 0.19 m/s of the farthest wheel, takes 0.38 s to come to.
        let turn = |wz| [0.0, 0.0, wz];
        assert!(goes(turn(0.5), turn(0.237)) && !goes(turn(0.5), turn(0.24)));
        // Nothing of 9.9 cm, and of rest, is not short of it; 10.2 cm take 0.64 s.
        assert!(
            !found(&[stage(630, AHEAD, REST)]).fell_short && found(&[stage(645, AHEAD, REST)]).fell_short
        );
        assert!(!goes(REST, [0.0, 0.0, 0.04]));
        // Who catches up has not fallen short in the end.
        assert!(!found(&[stage(1000, AHEAD, REST), stage(3000, AHEAD, AHEAD)]).fell_short);
    }

    #[test]
    fn a_heading_45_degrees_off_is_off_course() {
        let ahead_turning = |wz, periods| found(&[stage(periods, AHEAD, [0.3, 0.0, wz])]).off_course;
        // 0.1 rad/s come to 45 degrees in 7.85 s.
        assert!(!ahead_turning(0.1, 7850) && ahead_turning(0.1, 7860) && ahead_turning(-0.1, 7860));
        // Commanded to turn by 0.5 rad/s, half of it too much or too little is allowed besides; the
        // first 0.38 s take 0.095 rad from what is commanded.
        let turning = |wz, periods| found(&[stage(periods, [0.0, 0.0, 0.5], [0.0, 0.0, wz])]).off_course;
        assert!(!turning(0.5, 60_000) && !turning(0.75, 60_000) && !turning(0.26, 60_000));
        assert!(turning(0.85, 6500) && !turning(0.85, 6350));
        // A path says it by itself.
        let scenario = flat(&[]);
        let simulation = Simulation::new(&scenario).unwrap();
        let off = |rad: f64| {
            let mut obedience = Obedience::new(&scenario);
            obedience.push(simulation.sample(), simulation.observation(), rad);
            obedience.found().off_course
        };
        assert!(!off(0.78) && off(0.79) && off(-0.79));
    }

    #[test]
    fn a_reversed_command_may_take_what_wet_ice_takes() {
        // From 0.3 m/s ahead to a command of 0.3 m/s back at 0.5 m/s^2: 0.6 s to a stand.
        let turned = |late: u32| {
            let braking = (0..600 + late).map(|k| {
                stage(
                    1,
                    BACK,
                    [0.3 - 0.5e-3 * f64::from(k.saturating_sub(late)), 0.0, 0.0],
                )
            });
            let stages: Vec<_> = std::iter::once(stage(1000, AHEAD, AHEAD))
                .chain(braking)
                .collect();
            found(&stages).wrong_way
        };
        // Half a second of going on is counted once the followed command is 0.02 m/s back, 0.64 s after the reversal.
        assert!(!turned(0) && !turned(400) && turned(700));
    }

    #[test]
    fn a_retry_backs_off_on_purpose_for_at_most_two_seconds_and_half_a_metre() {
        let backs = |periods, retries, mode, vx| {
            let mut back = stage(periods, AHEAD, [vx, 0.0, 0.0]);
            (back.retries, back.mode) = (retries, mode);
            let mut ahead = stage(1000, AHEAD, AHEAD);
            ahead.retries = retries.map(|_| 0);
            found(&[ahead, back]).wrong_way
        };
        let (drive, back) = (SupervisorMode::Drive, SupervisorMode::BackOff);
        assert!(!backs(2490, Some(1), drive, -0.3) && backs(2510, Some(1), drive, -0.3));
        assert!(backs(501, Some(0), drive, -0.3) && backs(501, None, drive, -0.3));
        // At 0.05 m/s half a metre takes 10 s; a second later 5 cm have gone on.
        assert!(!backs(10_900, Some(1), back, -0.05) && backs(11_100, Some(1), back, -0.05));
    }

    /// A stop out of 0.3 m/s: the followed command is 0 after 0.6 s, and torque may last for a second more.
    fn after_a_stop(keys: &[&str], then: Stage) -> Found {
        let braking = (0..600_u32).map(|k| stage(1, REST, [0.3 - 0.5e-3 * f64::from(k), 0.0, 0.0]));
        let first = std::iter::once(stage(1000, AHEAD, AHEAD));
        let stages: Vec<_> = first
            .chain(braking)
            .chain([stage(1010, REST, REST), then])
            .collect();
        found_with(keys, &stages)
    }

    #[test]
    fn a_twentieth_of_a_joule_in_six_tenths_of_a_second_after_a_stop_is_driving_on() {
        let pushed = |power_w: f64, periods| {
            let push = Stage {
                torque_n_m: power_w / 4.0,
                turns_rad_s: 4.0,
                ..stage(periods, REST, REST)
            };
            after_a_stop(&[], push).drove_on
        };
        // 0.0846 W in 0.6 s are 0.0508 J; 0.0819 W for ever are never more than 0.05 J in 0.61 s.
        assert!(pushed(0.0846, 601) && !pushed(0.0819, 5000));
        assert!(pushed(60.0, 2), "a blow is as much");
        // A motor that is turned by its wheel takes work out of it.
        let braked = Stage {
            torque_n_m: -1.0,
            turns_rad_s: 9.0,
            ..stage(3000, REST, REST)
        };
        assert!(!after_a_stop(&[], braked).drove_on);
        // Standing under full torque is no work.
        let stalled = Stage {
            torque_n_m: 2.0,
            ..stage(3000, REST, REST)
        };
        assert!(!after_a_stop(&[], stalled).drove_on);
    }

    #[test]
    fn torque_is_judged_from_the_time_on_at_which_the_configuration_ends_it() {
        let push = |periods| Stage {
            torque_n_m: 1.0,
            turns_rad_s: 9.0,
            ..stage(periods, REST, REST)
        };
        let stages = |periods| [stage(1000, AHEAD, AHEAD), push(periods)];
        // 0.6 s to slow down, 0.5 s until the torque has ended, a few periods for 0.05 J at 9 W.
        assert!(!found(&stages(1095)).drove_on && found(&stages(1110)).drove_on);
        let later = ["control.rest.bleed_s=1.5"];
        assert!(!found_with(&later, &stages(2095)).drove_on && found_with(&later, &stages(2110)).drove_on);
        let held = ["control.rest={ hold_s = 5.0, hold_torque_squared_n2m2s = 9.0 }"];
        assert!(!found_with(&held, &stages(6095)).drove_on && found_with(&held, &stages(6110)).drove_on);
        assert!(
            !found(&[
                stage(1000, AHEAD, AHEAD),
                Stage {
                    commanded: AHEAD,
                    ..push(9000)
                }
            ])
            .drove_on,
            "commanded to drive"
        );
    }

    #[test]
    fn motion_without_work_a_second_later_is_rolling_on_and_coasting_to_a_stand_is_not() {
        let rolls = |periods, moves| {
            let found = after_a_stop(&[], stage(periods, REST, moves));
            assert!(!found.drove_on && !found.wrong_way);
            found.rolled_on
        };
        assert!(rolls(1010, [-0.02, 0.0, 0.0]) && !rolls(990, [-0.02, 0.0, 0.0]));
        assert!(rolls(1010, [0.0, 0.0, 0.06]));
        assert!(!rolls(9000, [0.009, 0.0, 0.049]), "that is standing");
    }
}
