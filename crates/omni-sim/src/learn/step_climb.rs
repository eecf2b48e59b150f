//! Getting over a step of unknown height and friction.

use omni_core::BodyTwist;

use super::rules::{Draw, Rules};
use crate::config::{self, Scenario, Terrain};
use crate::outcome::Meter;
use crate::{Error, Outcome, Simulation, Verdict};

/// Forward command at 1 \[m/s\]: the paper's speed.
const SPEED_M_S: f64 = 0.3;
/// Yaw rate commanded at 1 \[rad/s\]: five times what turns the largest heading of the start away in half a second.
const TURN_RAD_S: f64 = 0.3;
/// Torque added to a row's wheels at 1, as a part of the motor's stall torque: as much as the
/// coordination may be wrong by.
const ADDED_PART: f64 = 0.5;

/// Worth of a metre forward.
const PER_M: f64 = 1.0;
/// Of all wheels standing beyond the riser.
const CLIMBED: f64 = 2.0;
/// Of a second at full torque on all wheels: three seconds of a stall cost as much as 0.3 m.
const PER_EFFORT_S: f64 = -0.1;
/// Of a second one radian off the heading.
const PER_RAD_S: f64 = -0.5;
/// For tipping over, leaning further than the ground requires, running away, or a simulation that diverged or gained
/// energy.
const FAILED: f64 = -1.0;

const INFO: &[&str] = &[
    "is_success",
    "time_s",
    "crossing_s",
    "x_m",
    "height_m",
    "friction",
    "effort_s",
];

pub(super) struct StepClimb {
    /// Indices of the wheels of each row, the front row first.
    rows: Vec<Vec<usize>>,
    /// How much of a torque forward each wheel gives, -1 to 1.
    forward: Vec<f64>,
    stall_n_m: f64,
    period_s: f64,
    /// Way from the start to the riser \[m\], as the vehicle knows it.
    way_m: f64,
    heading_rad: f64,
    added_n_m: Vec<f64>,
    /// Of the present episode.
    now: Now,
}

struct Now {
    drawn: [f64; 2],
    meter: Meter,
    outcome: Outcome,
    /// Way by the encoders \[m\].
    odometry_m: f64,
    /// Mean over wheels of torque over stall torque, squared, over time \[s\].
    effort_s: f64,
    /// Where things stood when they were last judged: x \[m\], effort, time \[s\].
    judged: (f64, f64, f64),
}

impl Now {
    fn new(scenario: &Scenario, drawn: [f64; 2]) -> Self {
        let meter = Meter::new(scenario);
        Self {
            drawn,
            outcome: meter.outcome(false),
            meter,
            odometry_m: 0.0,
            effort_s: 0.0,
            judged: (f64::NAN, 0.0, 0.0),
        }
    }
}

impl StepClimb {
    pub(super) fn new(scenario: &Scenario, simulation: &Simulation) -> Result<Self, Error> {
        let Terrain::Step {
            friction,
            height_m,
            start_x_m,
        } = scenario.terrain
        else {
            return Err(Error::Config(config::Error::Key {
                file: scenario.name.clone(),
                key: "terrain.kind".into(),
                message: "another ground, allowed: \"step\"".into(),
            }));
        };
        let vehicle = scenario.vehicle();
        let ahead = BodyTwist::from_array([1.0, 0.0, 0.0]);
        let mut forward = simulation.controller().inverse(&ahead);
        let most = forward.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        forward.iter_mut().for_each(|v| *v /= most);
        Ok(Self {
            rows: vehicle.rows().into_iter().map(|row| row.wheels).collect(),
            added_n_m: vec![0.0; forward.len()],
            forward,
            stall_n_m: vehicle.motor.peak_torque_n_m(),
            period_s: scenario.period_s(),
            way_m: start_x_m - scenario.start.x_m,
            heading_rad: scenario.start.heading_rad,
            now: Now::new(scenario, [height_m, friction]),
        })
    }
}

impl StepClimb {
    /// How far the heading is off the start's, left is positive \[rad\], within half a turn.
    fn off_rad(&self, simulation: &Simulation) -> f64 {
        let yaw_rad = simulation.observation().pose.yaw_rad();
        libm::remainder(yaw_rad - self.heading_rad, core::f64::consts::TAU)
    }
}

impl Rules for StepClimb {
    fn draws(&self) -> Vec<Draw> {
        vec![
            Draw {
                name: "height_m",
                range: [0.02, 0.06],
                within: ([1e-3, 0.2], "0.001 to 0.2"),
            },
            Draw {
                name: "friction",
                range: [0.5, 0.9],
                within: ([0.0, 2.0], "0 to 2"),
            },
        ]
    }

    fn actions(&self) -> usize {
        2 + self.rows.len()
    }

    fn begin(&mut self, drawn: &[f64], scenario: &mut Scenario) {
        let drawn = [drawn[0], drawn[1]];
        if let Terrain::Step {
            height_m, friction, ..
        } = &mut scenario.terrain
        {
            [*height_m, *friction] = drawn;
        }
        self.now = Now::new(scenario, drawn);
    }

    fn control(&mut self, simulation: &mut Simulation, action: &[f64]) -> Result<(), Error> {
        let now = &mut self.now;
        if now.judged.0.is_nan() {
            now.judged.0 = simulation.observation().pose.position_m[0];
        }
        let command = BodyTwist::from_array([SPEED_M_S * action[0], 0.0, TURN_RAD_S * action[1]]);
        for (row, share) in self.rows.iter().zip(&action[2..]) {
            for wheel in row {
                self.added_n_m[*wheel] = share * ADDED_PART * self.stall_n_m * self.forward[*wheel];
            }
        }
        simulation.step_helped(&command, &self.added_n_m)?;
        let sample = simulation.sample();
        now.odometry_m += sample.estimated.vx_m_s * self.period_s;
        let part = |wheel: &crate::WheelSignals| (wheel.applied_n_m / self.stall_n_m).powi(2);
        let parts: f64 = sample.wheels.iter().map(part).sum();
        now.effort_s += parts / sample.wheels.len() as f64 * self.period_s;
        now.meter.push(simulation.period());
        Ok(())
    }

    fn judge(&mut self, simulation: &Simulation, _: &[f64], failed: bool) -> (f64, bool) {
        let off_rad = self.off_rad(simulation).abs();
        let now = &mut self.now;
        now.outcome = now.meter.outcome(failed);
        let seen = simulation.observation();
        let (x_m, time_s) = (seen.pose.position_m[0], simulation.time_ns() as f64 * 1e-9);
        let (before_m, effort_s, before_s) = now.judged;
        now.judged = (x_m, now.effort_s, time_s);
        let (ended, worth) = match now.outcome.verdict {
            Verdict::Climbed => (true, CLIMBED),
            Verdict::Tipped
            | Verdict::Tilted
            | Verdict::Touched
            | Verdict::Overspeed
            | Verdict::GainedEnergy
            | Verdict::Diverged => (true, FAILED),
            // Commands and torques are the learner's own here: what comes of them is paid by the way gone.
            Verdict::WrongWay
            | Verdict::DroveOn
            | Verdict::RolledOn
            | Verdict::OffCourse
            | Verdict::FellShort => (false, 0.0),
            Verdict::Stalled
            | Verdict::SlidAlong
            | Verdict::Unfinished
            | Verdict::Arrived
            | Verdict::Completed => (false, 0.0),
        };
        if failed {
            return (worth, ended); // where it is then says nothing
        }
        let reward = PER_M * (x_m - before_m)
            + PER_EFFORT_S * (now.effort_s - effort_s)
            + PER_RAD_S * off_rad * (time_s - before_s)
            + worth;
        (reward, ended)
    }

    fn observe(&self, simulation: &Simulation, seen: &mut Vec<(f64, f64)>) {
        let body = simulation.observation();
        let applied = &simulation.sample().wheels;
        seen.extend(simulation.measured_rad_s().iter().map(|v| (*v, 10.0)));
        let torque = |wheel: usize| applied.get(wheel).map_or(0.0, |w| w.applied_n_m);
        seen.extend((0..self.forward.len()).map(|wheel| (torque(wheel), self.stall_n_m)));
        seen.extend(body.hinges.iter().map(|hinge| (hinge.angle_rad, 0.5)));
        seen.extend(body.hinges.iter().map(|hinge| (hinge.rate_rad_s, 2.0)));
        let [x, y, z, w] = body.pose.rotation_xyzw;
        let left_up_rad = libm::asin((2.0 * (y * z + w * x)).clamp(-1.0, 1.0));
        seen.push((left_up_rad, 0.5));
        seen.push((body.body_nose_up_rad[0], 0.5));
        seen.push((self.off_rad(simulation), 0.5));
        seen.push((simulation.gyro_rad_s(), 1.0));
        seen.push((self.way_m - self.now.odometry_m, 1.5));
    }

    fn info(&self, simulation: &Simulation) -> Vec<f64> {
        let now = &self.now;
        vec![
            f64::from(u8::from(now.outcome.climbed)),
            simulation.time_ns() as f64 * 1e-9,
            now.outcome.crossing_s.unwrap_or(f64::NAN),
            simulation.observation().pose.position_m[0],
            now.drawn[0],
            now.drawn[1],
            now.effort_s,
        ]
    }

    fn info_names(&self) -> &'static [&'static str] {
        INFO
    }
}
