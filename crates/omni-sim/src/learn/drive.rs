//! Following a twist by the torques of the wheels.

use omni_core::TorqueLimit;

use super::rules::{Draw, Rules};
use crate::config::{self, Scenario};
use crate::{Error, Simulation};

/// Torque at 1, as a part of what the motor can give at its speed: 1.6 m/s^2 for the seven-wheel
/// vehicle, brisk for the speeds asked for.
const TORQUE_PART: f64 = 0.25;
/// Errors of speed \[m/s\] and of yaw rate \[rad/s\] that count as 1.
const ERROR: [f64; 3] = [0.25, 0.25, 0.5];
/// Worth of full torque on all wheels.
const PER_EFFORT: f64 = -0.05;
/// For a simulation that diverged.
const FAILED: f64 = -1.0;
/// Error below which the twist counts as followed, for so long \[s\] without a break.
const FOLLOWED: (f64, f64) = (0.3, 1.0);

const INFO: &[&str] = &["is_success", "time_s", "error", "vx_m_s", "vy_m_s", "wz_rad_s"];

pub(super) struct Drive {
    limit: TorqueLimit<f64>,
    wheels: usize,
    torques_n_m: Vec<f64>,
    target: [f64; 3],
    error: f64,
    /// Since when the twist is followed \[s\]; none while it is not.
    followed_from_s: Option<f64>,
    /// Of a failure, for good.
    failed: bool,
}

impl Drive {
    pub(super) fn new(scenario: &Scenario) -> Result<Self, Error> {
        let vehicle = scenario.vehicle();
        let limit = vehicle.motor.limit().map_err(|error| config::Error::Key {
            file: format!("vehicle {}", vehicle.name),
            key: "motor".into(),
            message: error.to_string(),
        })?;
        Ok(Self {
            limit,
            wheels: vehicle.wheel.len(),
            torques_n_m: Vec::new(),
            target: [0.0; 3],
            error: 0.0,
            followed_from_s: None,
            failed: false,
        })
    }

    fn off(&self, simulation: &Simulation) -> f64 {
        let twist = simulation.observation().twist.to_array();
        let parts = (0..3).map(|k| ((twist[k] - self.target[k]) / ERROR[k]).powi(2));
        parts.sum::<f64>().sqrt()
    }
}

impl Rules for Drive {
    fn draws(&self) -> Vec<Draw> {
        let speed = |name| Draw {
            name,
            range: [-0.4, 0.4],
            within: ([-1.0, 1.0], "-1 to 1"),
        };
        vec![
            speed("vx_m_s"),
            speed("vy_m_s"),
            Draw {
                range: [-0.8, 0.8],
                within: ([-2.0, 2.0], "-2 to 2"),
                ..speed("wz_rad_s")
            },
        ]
    }

    fn actions(&self) -> usize {
        self.wheels
    }

    fn begin(&mut self, drawn: &[f64], _: &mut Scenario) {
        self.target = [drawn[0], drawn[1], drawn[2]];
        (self.error, self.followed_from_s, self.failed) = (f64::NAN, None, false);
    }

    fn control(&mut self, simulation: &mut Simulation, action: &[f64]) -> Result<(), Error> {
        self.torques_n_m.clear();
        for (share, velocity) in action.iter().zip(simulation.measured_rad_s()) {
            let range = self.limit.range(*velocity);
            let most = if *share < 0.0 {
                -range.lower_n_m
            } else {
                range.upper_n_m
            };
            self.torques_n_m.push(share * TORQUE_PART * most);
        }
        simulation.step_torques(&self.torques_n_m)
    }

    fn judge(&mut self, simulation: &Simulation, action: &[f64], failed: bool) -> (f64, bool) {
        self.failed = failed;
        if failed {
            return (FAILED, true);
        }
        self.error = self.off(simulation);
        let time_s = simulation.time_ns() as f64 * 1e-9;
        self.followed_from_s =
            (self.error < FOLLOWED.0).then(|| self.followed_from_s.map_or(time_s, |from_s| from_s));
        let effort = action.iter().map(|a| a * a).sum::<f64>() / action.len() as f64;
        (libm::exp(-self.error * self.error) + PER_EFFORT * effort, false)
    }

    fn observe(&self, simulation: &Simulation, seen: &mut Vec<(f64, f64)>) {
        seen.extend(simulation.measured_rad_s().iter().map(|v| (*v, 20.0)));
        seen.push((simulation.gyro_rad_s(), 2.0));
        let [vx, vy, wz] = self.target;
        seen.extend([(vx, 1.0), (vy, 1.0), (wz, 2.0)]);
    }

    fn info(&self, simulation: &Simulation) -> Vec<f64> {
        let time_s = simulation.time_ns() as f64 * 1e-9;
        let followed = self
            .followed_from_s
            .is_some_and(|from_s| !self.failed && time_s - from_s >= FOLLOWED.1 - 1e-9);
        let error = if self.error.is_nan() {
            self.off(simulation)
        } else {
            self.error
        };
        let [vx, vy, wz] = self.target;
        vec![f64::from(u8::from(followed)), time_s, error, vx, vy, wz]
    }

    fn info_names(&self) -> &'static [&'static str] {
        INFO
    }
}
