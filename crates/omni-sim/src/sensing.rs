//! What encoders and a gyro make of the truth.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::config::{Fault, Scenario, Sensors};

/// The sensors of a vehicle.
pub(crate) struct Sensing {
    sensors: Sensors,
    period_s: f64,
    stuck: Vec<(usize, f64, f64)>,
    state: State,
}

/// What a snapshot keeps.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct State {
    rng: ChaCha8Rng,
    /// Whole counts of each encoder after the last period.
    counts: Vec<f64>,
    /// What each encoder last read \[rad/s\].
    read: Vec<f64>,
    /// Readings on their way to the controller, the oldest first: encoders, then the gyro.
    line: VecDeque<(Vec<f64>, f64)>,
}

impl Sensing {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let vehicle = scenario.vehicle();
        let stuck = scenario.fault.iter().filter_map(|fault| match fault {
            Fault::EncoderStuck { wheel, .. } => {
                let (from_s, until_s) = fault.span_s();
                let wheel = vehicle.wheel.iter().position(|w| w.name == *wheel)?;
                Some((wheel, from_s, until_s))
            }
            _ => None,
        });
        let wheels = vehicle.wheel.len();
        let sensors = scenario.sensors;
        let periods = sensors.delay_us / scenario.control.period_us;
        let mut rng = ChaCha8Rng::seed_from_u64(scenario.seed);
        rng.set_stream(1); // the perturbation draws from stream 0
        Self {
            sensors,
            period_s: scenario.period_s(),
            stuck: stuck.collect(),
            state: State {
                rng,
                counts: vec![0.0; wheels],
                read: vec![0.0; wheels],
                // At rest before the start.
                line: vec![(vec![0.0; wheels], 0.0); periods as usize].into(),
            },
        }
    }

    pub(crate) fn state(&self) -> &State {
        &self.state
    }

    pub(crate) fn restore(&mut self, state: State) {
        self.state = state;
    }

    /// From the true actuator velocities \[rad/s\], their angles \[rad\] and the yaw rate \[rad/s\] at a time to what the controller is
    /// given then: velocities are replaced, the gyro's rate is returned.
    pub(crate) fn read(
        &mut self,
        time_s: f64,
        velocities_rad_s: &mut Vec<f64>,
        angles_rad: &[f64],
        yaw_rate_rad_s: f64,
    ) -> f64 {
        let Self {
            sensors,
            period_s,
            stuck,
            state,
        } = self;
        for (i, velocity) in velocities_rad_s.iter_mut().enumerate() {
            if sensors.encoder_counts > 0 {
                let per_rad = f64::from(sensors.encoder_counts) / std::f64::consts::TAU;
                let counts = (angles_rad[i] * per_rad).floor();
                *velocity = (counts - state.counts[i]) / per_rad / *period_s;
                state.counts[i] = counts;
            }
            if sensors.encoder_noise_rad_s > 0.0 {
                *velocity += sensors.encoder_noise_rad_s * normal(&mut state.rng);
            }
            if stuck
                .iter()
                .any(|(wheel, from_s, until_s)| *wheel == i && time_s >= *from_s && time_s < *until_s)
            {
                *velocity = state.read[i];
            }
            state.read[i] = *velocity;
        }
        let mut gyro = yaw_rate_rad_s + sensors.gyro_bias_rad_s;
        if sensors.gyro_noise_rad_s > 0.0 {
            gyro += sensors.gyro_noise_rad_s * normal(&mut state.rng);
        }
        if sensors.delay_us == 0 {
            return gyro;
        }
        state.line.push_back((velocities_rad_s.clone(), gyro));
        match state.line.pop_front() {
            Some((old, gyro)) => {
                *velocities_rad_s = old;
                gyro
            }
            None => gyro,
        }
    }
}

/// A number of the standard normal distribution (Box and Muller, 1958).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let mut uniform = || ((rng.next_u64() >> 11) as f64 + 1.0) / (1u64 << 53) as f64; // above 0, up to 1
    let radius = (-2.0 * libm::log(uniform())).sqrt();
    radius * libm::cos(std::f64::consts::TAU * uniform())
}
