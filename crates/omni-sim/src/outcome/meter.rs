//! The metrics of a run, gathered while it goes on: nothing here grows with time.

use std::collections::VecDeque;

use omni_core::BodyTwist;
use omni_core::loops::Saturation;
use omni_core::metrics::{DISTURBED_FLOOR_RAD_S, disturbed_ratio, shape_error, speed_ratio_std};
use omni_core::traction::SupervisorMode;

use super::criteria::{Gain, Gained, Lean, Runaway, farthest_wheel_m};
use super::effort::{Effort, LimitedBy};
use super::friction_use::FrictionUse;
use super::mean::{Mean, WINDOW_NS};
use super::obedience::Obedience;
use super::pose_errors::PoseErrors;
use super::slip_speed_std::SlipSpeedStd;
use super::standstill::Standstill;
use super::undersides::Undersides;
use super::{Outcome, Verdict};
use crate::Period;
use crate::config::{Engine, MOST_WHEELS, Obstacle, Scenario, Terrain};
use crate::control_sample::ControlSample;
use crate::observation::Observation;

/// How far below its place on the ground beyond a wheel may be and still count as up \[m\]: contacts give a little.
const UP_TOLERANCE_M: f64 = 0.005;
/// Cosine of the lean at which a vehicle has tipped over: 60 degrees.
const TIPPED_COSINE: f64 = 0.5;
/// A vehicle that goes less than this part of the commanded way has stalled.
const STALLED_PART: f64 = 0.1;
/// A command to go less far in the last second is none, except for [`Progress::stalled`] \[m\]: what is left at the
/// end of a path.
const COMMANDED_M: f64 = 0.05;
/// Time over which that is judged \[s\].
const STALL_S: f64 = 1.0;

/// Gathers an [`Outcome`].
pub(crate) struct Meter {
    engine: Engine,
    wheel_model_valid: bool,
    obstacle: Option<Obstacle>,
    terrain: Terrain,
    reach_m: Vec<f64>,
    radius_m: Vec<f64>,
    rows: Vec<Vec<usize>>,
    /// Travel along the push per turn of the actuator, one per wheel \[m/rad\].
    way_per_rad: Vec<f64>,
    /// The policy's common factor is on references; else it is on torques.
    scales_references: bool,
    period_s: f64,
    /// From the origin to the farthest wheel \[m\].
    farthest_m: f64,
    weight_n: f64,
    friction: FrictionUse,

    phase: Phase,
    retries: Option<u32>,
    crossing: Crossing,
    heading: Heading,
    progress: Progress,
    tipped: bool,
    runaway: Runaway,
    obedience: Obedience,
    standstill: Standstill,
    effort: Effort,
    undersides: Undersides,
    lean: Lean,
    gain: Gain,
    last: Last,
    whereabouts: PoseErrors,
}

#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Before,
    During,
    Across,
}

/// Sums over the crossing.
#[derive(Default)]
struct Crossing {
    periods: u64,
    slip: Mean,
    speed_error: Mean,
    speed_error_realised: Mean,
    speed_ratio: Mean,
    slip_speed: SlipSpeedStd,
    shape: Mean,
    torque_squared: f64,
    nose_up_rad: f64,
    nose_down_rad: f64,
    /// Place \[m\] and work since the start of the run \[J\] before its first period, and after its last.
    from: Option<([f64; 2], f64)>,
    to: ([f64; 2], f64),
    yaw_error_rad: f64,
}

/// Headings without jumps at half a turn.
struct Heading {
    commanded_rad: f64,
    reached_rad: f64,
    last_yaw_rad: Option<f64>,
}

/// Distances commanded and gone in the last second.
struct Progress {
    window_ns: u64,
    now: Travel,
    windows: VecDeque<Travel>,
    /// Windows in a second: one of at least a control period each.
    count: usize,
}

/// Where a vehicle has come to, and what was commanded since the start.
#[derive(Clone, Copy, Default)]
struct Travel {
    place_m: [f64; 2],
    /// In the world's axes; x is across the obstacle. What was commanded back and forth cancels, as in the place.
    commanded_m: [f64; 2],
    /// As distances of the farthest wheel \[m\].
    turned_m: f64,
    commanded_turn_m: f64,
}

/// Observation of the last period.
#[derive(Default)]
struct Last {
    place_m: Option<[f64; 2]>,
    work_j: f64,
    passed: Vec<bool>,
    residual: f64,
    /// Traction control had no retry left, and commands rest of itself.
    gave_up: bool,
}

impl Meter {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let vehicle = scenario.vehicle();
        let edge_m = scenario.terrain.first_edge_m();
        let reach = |w: &crate::config::WheelSpec| {
            let radius = w.contact_radius_m();
            // Forward distance from the centre of a wheel on the ground to its contact with the edge.
            let above = (radius - edge_m).max(0.0);
            (radius * radius - above * above).sqrt()
        };
        let obstacle = scenario.terrain.obstacle();
        let weight_n = vehicle.mass_kg() * scenario.physics.gravity_m_s2;
        Self {
            engine: scenario.physics.engine,
            wheel_model_valid: scenario.beyond_balls().is_none(),
            obstacle,
            terrain: scenario.terrain.clone(),
            reach_m: vehicle.wheel.iter().map(reach).collect(),
            radius_m: vehicle.wheel.iter().map(|w| w.radius_m).collect(),
            rows: vehicle.rows().into_iter().map(|row| row.wheels).collect(),
            way_per_rad: vehicle
                .wheel
                .iter()
                .map(crate::config::WheelSpec::way_per_rad)
                .collect(),
            // A loaded scenario's policy is known.
            scales_references: scenario
                .coordination::<f64>()
                .is_ok_and(|policy| matches!(policy.saturation, Saturation::ScaleReferences { .. })),
            period_s: scenario.period_s(),
            weight_n,
            friction: FrictionUse::new(vehicle.wheel.len(), weight_n),
            phase: if obstacle.is_some() {
                Phase::Before
            } else {
                Phase::During
            },
            retries: None,
            crossing: Crossing::default(),
            heading: Heading {
                commanded_rad: 0.0,
                reached_rad: 0.0,
                last_yaw_rad: None,
            },
            progress: Progress::new(scenario.period_s()),
            tipped: false,
            runaway: Runaway::new(scenario),
            obedience: Obedience::new(scenario),
            standstill: Standstill::new(scenario),
            effort: Effort::new(scenario),
            undersides: Undersides::new(scenario),
            farthest_m: farthest_wheel_m(scenario),
            lean: Lean::new(scenario),
            gain: Gain::new(weight_n),
            last: Last::default(),
            whereabouts: PoseErrors::new(scenario),
        }
    }

    /// The run is of other physics, whose wheels have rollers.
    pub(crate) fn set_external(&mut self, engine: Engine) {
        (self.engine, self.wheel_model_valid) = (engine, true);
    }

    /// Adds a control period.
    pub(crate) fn push(&mut self, period: &Period) {
        let (sample, seen) = (&period.control, &period.observed);
        let command = sample.commanded().unwrap_or(BodyTwist::ZERO);
        let [x, y, z, w] = seen.pose.rotation_xyzw;
        // Cosine of the lean: the upward part of the base's own z axis.
        self.tipped |= (w * w + z * z) - (x * x + y * y) < TIPPED_COSINE;
        self.runaway.push(sample, seen);
        self.lean.push(seen);
        self.gain.push(seen);
        let path_off_rad = self.whereabouts.push(sample.report.path.as_ref(), seen);
        self.obedience.push(sample, seen, path_off_rad);
        self.heading
            .push(command.wz_rad_s * self.period_s, seen.pose.yaw_rad());
        self.standstill.push(seen, self.heading.reached_rad);
        self.effort.push(sample, seen);
        self.undersides.push(seen);
        let [px, py, _] = seen.pose.position_m;
        let way = &mut self.progress.now;
        way.place_m = [px, py];
        let (sin, cos) = libm::sincos(seen.pose.yaw_rad());
        way.commanded_m[0] += (cos * command.vx_m_s - sin * command.vy_m_s) * self.period_s;
        way.commanded_m[1] += (sin * command.vx_m_s + cos * command.vy_m_s) * self.period_s;
        way.turned_m = self.farthest_m * self.heading.reached_rad;
        way.commanded_turn_m = self.farthest_m * self.heading.commanded_rad;
        self.progress.push(seen.time_ns);
        self.last.residual = seen.energy.residual_j() / seen.energy.turnover_j;
        if let Some(traction) = &sample.report.traction {
            self.last.gave_up = traction.mode == SupervisorMode::GaveUp;
        }
        if self.phase != Phase::Across {
            // A period without the controller does not say it.
            self.retries = sample.retries().or(self.retries);
        }

        if let (Some(obstacle), false) = (self.obstacle, self.phase == Phase::Across) {
            let reached = seen
                .wheels
                .iter()
                .zip(&self.reach_m)
                .any(|(wheel, reach)| wheel.centre_m[0] + reach >= obstacle.from_m);
            if self.phase == Phase::Before && reached {
                self.phase = Phase::During;
            }
            let up = |(wheel, radius): (&crate::observation::WheelObservation, &f64)| {
                let [x, y, z] = wheel.centre_m;
                x >= obstacle.to_m && z >= self.terrain.level_beyond_m(y) + radius - UP_TOLERANCE_M
            };
            self.last.passed.clear();
            self.last
                .passed
                .extend(seen.wheels.iter().zip(&self.radius_m).map(up));
            if self.phase == Phase::During && self.last.passed.iter().all(|passed| *passed) {
                self.phase = Phase::Across;
            }
        }
        if self.phase == Phase::During {
            self.cross(sample, seen);
        }
        (self.last.place_m, self.last.work_j) = (Some([px, py]), seen.energy.work_in_j);
    }

    fn cross(&mut self, sample: &ControlSample, seen: &Observation) {
        let [px, py, _] = seen.pose.position_m;
        let before = (self.last.place_m.unwrap_or([px, py]), self.last.work_j);
        let crossing = &mut self.crossing;
        crossing.periods += 1;
        crossing.from.get_or_insert(before);
        crossing.to = ([px, py], seen.energy.work_in_j);
        crossing.yaw_error_rad = self.heading.reached_rad - self.heading.commanded_rad;
        for nose_up_rad in &seen.body_nose_up_rad {
            crossing.nose_up_rad = crossing.nose_up_rad.max(*nose_up_rad);
            crossing.nose_down_rad = crossing.nose_down_rad.max(-nose_up_rad);
        }
        let (mut reference, mut velocity) = ([0.0; MOST_WHEELS], [0.0; MOST_WHEELS]);
        // A controller of one's own says nothing of a factor.
        let realised = if self.scales_references && sample.common_factor.is_finite() {
            sample.common_factor
        } else {
            1.0
        };
        crossing.slip_speed.start_period();
        for (i, (signals, wheel)) in sample
            .wheels
            .iter()
            .zip(&seen.wheels)
            .enumerate()
            .take(MOST_WHEELS)
        {
            // What a silent encoder would have said is not known.
            let measured = signals.measured_rad_s.is_finite();
            if measured {
                (reference[i], velocity[i]) = (signals.reference_rad_s, signals.measured_rad_s);
            }
            crossing.torque_squared += signals.applied_n_m * signals.applied_n_m * self.period_s;
            if signals.reference_rad_s.abs() < DISTURBED_FLOOR_RAD_S || !measured {
                continue;
            }
            crossing.speed_error.add(signals.disturbed_ratio());
            crossing.speed_error_realised.add(disturbed_ratio(
                realised * signals.reference_rad_s,
                signals.measured_rad_s,
                DISTURBED_FLOOR_RAD_S,
            ));
            let asked_m_s = signals.reference_rad_s * self.way_per_rad[i];
            crossing
                .slip_speed
                .add(asked_m_s, wheel.rim_m_s - wheel.along_m_s);
            if wheel.touches() {
                crossing.slip.add(wheel.slip_ratio());
            }
        }
        crossing.slip_speed.end_period();
        crossing
            .speed_ratio
            .add(speed_ratio_std(&reference, &velocity, DISTURBED_FLOOR_RAD_S));
        let shape = shape_error(&reference, &velocity);
        for error in &shape[..sample.wheels.len().min(MOST_WHEELS)] {
            crossing.shape.add(*error);
        }
        self.friction.push(seen);
        self.whereabouts.cross(seen);
    }

    /// Whether every wheel has stood beyond the obstacle.
    pub(crate) fn is_across(&self) -> bool {
        self.phase == Phase::Across
    }

    /// Energy that the physics gained, where it is more than its error may be.
    pub(crate) fn gained(&self) -> Option<Gained> {
        self.gain.found()
    }

    /// The verdict so far: the first that fits.
    fn verdict(&self, failed: bool) -> Verdict {
        let disobeyed = self.obedience.found();
        if failed {
            Verdict::Diverged
        } else if self.gained().is_some() {
            Verdict::GainedEnergy
        } else if self.tipped {
            Verdict::Tipped
        } else if self.runaway.found() {
            Verdict::Overspeed
        } else if disobeyed.wrong_way {
            Verdict::WrongWay
        } else if disobeyed.drove_on {
            Verdict::DroveOn
        } else if disobeyed.rolled_on {
            Verdict::RolledOn
        } else if self.lean.found() {
            Verdict::Tilted
        } else if self.undersides.touched().is_some() {
            Verdict::Touched
        } else if self.is_across() {
            Verdict::Climbed
        } else if self.obstacle.is_none() {
            self.verdict_without_obstacle()
        } else if self.progress.stalled() || self.last.gave_up {
            Verdict::Stalled
        } else if self.phase == Phase::During && self.progress.slid_along() {
            Verdict::SlidAlong
        } else {
            Verdict::Unfinished
        }
    }

    /// The verdict on a vehicle that is upright and under control where nothing has to be climbed.
    fn verdict_without_obstacle(&self) -> Verdict {
        let disobeyed = self.obedience.found();
        if self.whereabouts.arrived_s().is_some() {
            Verdict::Arrived
        } else if self.progress.stalled_without_obstacle() || self.last.gave_up {
            Verdict::Stalled
        } else if disobeyed.off_course {
            Verdict::OffCourse
        } else if disobeyed.fell_short {
            Verdict::FellShort
        } else {
            Verdict::Completed
        }
    }

    /// The foremost row that has not passed the obstacle, from 1.
    fn waiting_row(&self) -> Option<usize> {
        let passed = |row: &Vec<usize>| row.iter().all(|w| self.last.passed.get(*w) == Some(&true));
        let row = self.rows.iter().position(|row| !passed(row))?;
        self.obstacle.is_some().then_some(row + 1)
    }

    /// The metrics so far; `failed` where the physics ended the run.
    pub(crate) fn outcome(&self, failed: bool) -> Outcome {
        let c = &self.crossing;
        let measured = if c.periods > 0 { 1.0 } else { f64::NAN };
        let verdict = self.verdict(failed);
        let (climbed, stalled) = (verdict == Verdict::Climbed, verdict == Verdict::Stalled);
        let limited = match verdict {
            Verdict::Stalled => Some(self.effort.limited()),
            Verdict::Unfinished => Some((LimitedBy::Time, 0)),
            _ => None,
        };
        let touched = self.undersides.touched();
        let (from, from_j) = c.from.unwrap_or(c.to);
        let (to, to_j) = c.to;
        let (way_m, work_j) = (libm::hypot(to[0] - from[0], to[1] - from[1]), to_j - from_j);
        let pose = self.whereabouts.pose();
        let gained_m = self.terrain.level_beyond_m(to[1]);
        Outcome {
            verdict,
            climbed,
            engine: self.engine,
            wheel_model_valid: self.wheel_model_valid,
            crossing_s: climbed.then(|| {
                let us = (self.period_s * 1e6).round() as u64;
                (c.periods * us) as f64 / 1e6
            }),
            stalled_at_m: stalled.then_some(self.whereabouts.place()[0]),
            stalled_row: self.waiting_row().filter(|_| stalled),
            limited_by: limited.map(|(by, _)| by),
            limited_wheels: limited.map(|(_, wheels)| wheels).filter(|wheels| *wheels > 0),
            touched_body: touched.map(|touched| touched.body),
            touched_s: touched.map(|touched| touched.time_s),
            touched_x_m: touched.map(|touched| touched.at_m[0]),
            touched_y_m: touched.map(|touched| touched.at_m[1]),
            touched_depth_m: touched.map(|touched| touched.depth_m),
            retries: self.retries,
            stall_s: self.standstill.longest_s(),
            stall_from_s: self.standstill.began_s(),
            pitch_peak_deg: c.nose_up_rad.to_degrees() * measured,
            nose_down_peak_deg: c.nose_down_rad.to_degrees() * measured,
            yaw_error_deg: c.yaw_error_rad.to_degrees() * measured,
            slip_rms: c.slip.root(),
            speed_error_rms: c.speed_error.root(),
            speed_error_realised_rms: c.speed_error_realised.root(),
            speed_ratio_std: c.speed_ratio.root(),
            slip_speed_std: c.slip_speed.ratio(),
            shape_error_rms_rad_s: c.shape.root(),
            torque_squared_n2m2s: c.torque_squared * measured,
            work_j: work_j * measured,
            cost_of_transport: (way_m > 0.01).then(|| work_j / (self.weight_n * way_m)),
            e_over_mgh: (climbed && gained_m > 0.0).then(|| work_j / (self.weight_n * gained_m)),
            required_friction: self.friction.percentile(0.95),
            energy_residual: self.last.residual,
            path_error_rms_m: self.whereabouts.path_error_rms_m(),
            path_error_peak_m: self.whereabouts.path_error_peak_m(),
            arrived_s: self.whereabouts.arrived_s(),
            odometry_error_m: self.whereabouts.odometry_error_m(),
            final_x_m: pose.x_m,
            final_y_m: pose.y_m,
            final_yaw_rad: pose.yaw_rad,
        }
    }
}

impl Heading {
    fn push(&mut self, commanded_rad: f64, yaw_rad: f64) {
        self.commanded_rad += commanded_rad;
        if let Some(last) = self.last_yaw_rad {
            let step = yaw_rad - last;
            let turns = (step / std::f64::consts::TAU).round();
            self.reached_rad += step - turns * std::f64::consts::TAU;
        }
        self.last_yaw_rad = Some(yaw_rad);
    }
}

impl Progress {
    fn new(period_s: f64) -> Self {
        Self {
            window_ns: 0,
            now: Travel::default(),
            windows: VecDeque::new(),
            count: (STALL_S / period_s.max(WINDOW_NS as f64 * 1e-9)).round() as usize,
        }
    }

    fn push(&mut self, time_ns: u64) {
        if time_ns >= self.window_ns {
            self.window_ns = time_ns - time_ns % WINDOW_NS + WINDOW_NS;
            self.windows.push_back(self.now);
            if self.windows.len() > self.count {
                self.windows.pop_front();
            }
        }
    }

    /// Where it was a second ago; none before there was one.
    fn a_second_ago(&self) -> Option<&Travel> {
        let then = self.windows.front();
        then.filter(|_| self.windows.len() == self.count)
    }

    /// Distances gone and commanded over the ground, then about, in the last second; none before there was one.
    fn last_second(&self) -> Option<[[f64; 2]; 2]> {
        let (then, now) = (self.a_second_ago()?, &self.now);
        let way =
            |of: fn(&Travel) -> [f64; 2]| libm::hypot(of(now)[0] - of(then)[0], of(now)[1] - of(then)[1]);
        Some([
            [way(|travel| travel.place_m), way(|travel| travel.commanded_m)],
            [
                (now.turned_m - then.turned_m).abs(),
                (now.commanded_turn_m - then.commanded_turn_m).abs(),
            ],
        ])
    }

    /// Before an obstacle: the way over the ground counts.
    fn stalled(&self) -> bool {
        let ways = self.last_second();
        ways.is_some_and(|[[gone, commanded], _]| gone < STALLED_PART * commanded)
    }

    /// At an obstacle: it went along it, and not across as commanded. Traction control that backs off moves backward
    /// more than laterally.
    fn slid_along(&self) -> bool {
        self.a_second_ago().is_some_and(|then| {
            let [across, along] = [0, 1].map(|k| self.now.place_m[k] - then.place_m[k]);
            let commanded = self.now.commanded_m[0] - then.commanded_m[0];
            commanded > COMMANDED_M && across < STALLED_PART * commanded && along.abs() > across.abs()
        })
    }

    /// Without one: a vehicle commanded to turn need not go.
    fn stalled_without_obstacle(&self) -> bool {
        self.last_second()
            .is_some_and(|[[gone, commanded], [turned, commanded_turn]]| {
                let whole = commanded + commanded_turn;
                whole > COMMANDED_M && gone + turned < STALLED_PART * whole
            })
    }
}
