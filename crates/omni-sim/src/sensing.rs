//! Models of the sensors: encoders, gyro and accelerometer.

use std::collections::VecDeque;
use std::ops::Range;

use omni_core::estimate::{LONGEST_WINDOW, VelocityEstimator, VelocityState};
use omni_core::policy::Imu;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::config::{Fault, Scenario, Sensors};
use crate::observation::Observation;
use crate::sensed::Sensed;

/// What happens to an encoder.
#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    Stuck,
    Dead,
    Toggles,
    /// With the part of the shaft's turning that it turns.
    Slips(f64),
    Silent,
}

/// An encoder that counts: a disc on the shaft, and a counter of its edges.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Encoder {
    /// Angle of the shaft \[rad\], and how much of it the disc has not turned because its coupling slipped.
    shaft_rad: f64,
    lost_rad: f64,
    /// Where the disc is \[counts\].
    place: f64,
    /// The whole counts of that place that the counter has seen.
    seen: f64,
}

impl Encoder {
    /// Turns with the shaft, or by a part of its turning; at the start the disc is `phase` \[counts\] past an edge.
    fn turn(&mut self, shaft_rad: f64, part: f64, per_rad: f64, phase: f64) {
        self.lost_rad += (1.0 - part) * (shaft_rad - self.shaft_rad);
        self.shaft_rad = shaft_rad;
        self.place = (shaft_rad - self.lost_rad) * per_rad + phase;
    }

    /// What the counter has counted since it was last read, and the place of the last edge.
    fn count(&mut self, has: impl Fn(Trouble) -> bool, forwards: bool) -> (f64, f64) {
        if has(Trouble::Stuck) {
            return (0.0, self.place); // the counter itself goes on
        }
        let whole = self.place.floor();
        let before = std::mem::replace(&mut self.seen, whole);
        if has(Trouble::Dead) {
            (0.0, self.place)
        } else if has(Trouble::Toggles) {
            // Its edges are every second one, and without the other channel all that rise count up
            // and all that fall count down.
            let level = |whole: f64| (0.5 * (whole + 1.0)).floor().rem_euclid(2.0);
            let pairs = 0.5 * (self.place - 1.0);
            let edge = if forwards { pairs.floor() } else { pairs.ceil() };
            (level(whole) - level(before), 2.0 * edge + 1.0)
        } else {
            (whole - before, if forwards { whole } else { whole + 1.0 })
        }
    }
}

/// The sensors of a vehicle.
pub(crate) struct Sensing {
    sensors: Sensors,
    /// What makes velocities of counts, where there are counts.
    estimator: Option<VelocityEstimator<f64, LONGEST_WINDOW>>,
    gravity_m_s2: f64,
    period_s: f64,
    /// Of which wheel, what, and from when to when \[s\].
    trouble: Vec<(usize, Trouble, Range<f64>)>,
    /// How far past an edge each encoder starts \[counts\], 0 up to 1.
    phase: Vec<f64>,
    state: State,
}

/// The saved state.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct State {
    rng: ChaCha8Rng,
    /// Of the gyros about x and y.
    tilt_rng: ChaCha8Rng,
    /// Of the accelerometer and of the attitude, and how far that has walked away \[rad\].
    lean_rng: ChaCha8Rng,
    walked_rad: [f64; 2],
    encoders: Vec<Encoder>,
    /// What is remembered for the velocity of each encoder; empty if nothing is.
    velocities: Vec<VelocityState<f64, LONGEST_WINDOW>>,
    /// Last reading of each encoder \[rad/s\].
    read: Vec<f64>,
    /// Velocity of the base a period ago \[m/s\].
    velocity_m_s: [f64; 3],
    /// Readings on their way to the controller, the oldest first.
    line: VecDeque<Sensed>,
}

impl Sensing {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let vehicle = scenario.vehicle();
        let trouble = scenario.fault.iter().filter_map(|fault| {
            let trouble = match fault {
                Fault::EncoderStuck(_) => Trouble::Stuck,
                Fault::EncoderDead(_) => Trouble::Dead,
                Fault::EncoderToggles(_) => Trouble::Toggles,
                Fault::EncoderSlips(slips) => Trouble::Slips(slips.part),
                Fault::EncoderSilent(_) => Trouble::Silent,
                _ => return None,
            };
            let name = fault.wheel()?;
            let wheel = vehicle.wheel.iter().position(|w| w.name == name)?;
            Some((wheel, trouble, fault.span_s()))
        });
        let wheels = vehicle.wheel.len();
        let sensors = scenario.sensors;
        let periods = sensors.delay_us / scenario.control.period_us;
        let stream = |stream| {
            let mut rng = ChaCha8Rng::seed_from_u64(scenario.seed);
            rng.set_stream(stream); // the perturbation draws from stream 0
            rng
        };
        // A loaded scenario's method goes with its period.
        let estimator = scenario.velocity_estimator().ok().flatten();
        let remembered = if estimator.is_some() { wheels } else { 0 };
        let mut phases = stream(3);
        Self {
            sensors,
            estimator,
            gravity_m_s2: scenario.physics.gravity_m_s2,
            period_s: scenario.period_s(),
            trouble: trouble.collect(),
            phase: (0..wheels).map(|_| uniform(&mut phases)).collect(),
            state: State {
                rng: stream(1),
                tilt_rng: stream(2),
                lean_rng: stream(4),
                walked_rad: [0.0; 2],
                encoders: vec![Encoder::default(); wheels],
                velocities: vec![VelocityState::at_rest(); remembered],
                read: vec![0.0; wheels],
                velocity_m_s: [0.0; 3],
                // At rest before the start.
                line: vec![Sensed::at_rest(vehicle); periods as usize].into(),
            },
        }
    }

    pub(crate) fn state(&self) -> &State {
        &self.state
    }

    pub(crate) fn restore(&mut self, state: State) {
        self.state = state;
    }

    /// From the truth, and the true actuator velocities \[rad/s\] in `sensed`, to what the
    /// controller is given: `sensed` is overwritten.
    pub(crate) fn read(&mut self, angles_rad: &[f64], seen: &Observation, sensed: &mut Sensed) {
        self.read_encoders(seen.time_ns as f64 * 1e-9, angles_rad, sensed);
        let Self { sensors, state, .. } = self;
        sensed.gyro_rad_s = seen.twist.wz_rad_s + sensors.gyro_bias_rad_s;
        let mut noise = 0.0;
        if sensors.gyro_noise_rad_s > 0.0 {
            noise = sensors.gyro_noise_rad_s * normal(&mut state.rng);
            sensed.gyro_rad_s += noise;
        }
        for (i, hinge) in seen.hinges.iter().enumerate() {
            (sensed.hinges_rad[i], sensed.hinges_rad_s[i]) = (hinge.angle_rad, hinge.rate_rad_s);
        }
        let acceleration: [f64; 3] =
            std::array::from_fn(|k| (seen.velocity_m_s[k] - state.velocity_m_s[k]) / self.period_s);
        state.velocity_m_s = seen.velocity_m_s;
        let [x, y, z] = acceleration;
        let axes = seen.pose.axes();
        let along = |v: [f64; 3]| axes.map(|axis| axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]);
        sensed.imu.specific_force_m_s2 = along([x, y, z + self.gravity_m_s2]);
        sensed.imu.rate_rad_s = along(seen.rate_rad_s);
        for (k, rate) in sensed.imu.rate_rad_s.iter_mut().enumerate() {
            // One and the same gyro about z.
            let noise = if k == 2 || sensors.gyro_noise_rad_s == 0.0 {
                noise
            } else {
                sensors.gyro_noise_rad_s * normal(&mut state.tilt_rng)
            };
            *rate += sensors.gyro_bias_rad_s + noise;
        }
        let level = |axis: [f64; 3]| libm::asin(axis[2].clamp(-1.0, 1.0));
        (sensed.imu.pitch_rad, sensed.imu.roll_rad) = (level(axes[0]), level(axes[1]));
        for force in &mut sensed.imu.specific_force_m_s2 {
            *force += sensors.accelerometer_bias_m_s2;
            if sensors.accelerometer_noise_m_s2 > 0.0 {
                *force += sensors.accelerometer_noise_m_s2 * normal(&mut state.lean_rng);
            }
        }
        let walk = sensors.attitude_walk_rad_per_sqrt_s * self.period_s.sqrt();
        for (angle, walked) in [&mut sensed.imu.pitch_rad, &mut sensed.imu.roll_rad]
            .into_iter()
            .zip(&mut state.walked_rad)
        {
            if walk > 0.0 {
                *walked += walk * normal(&mut state.lean_rng);
            }
            *angle += sensors.attitude_bias_rad + *walked;
        }
        if sensors.no_hinge_encoders {
            sensed.hinges_rad.fill(f64::NAN);
            sensed.hinges_rad_s.fill(f64::NAN);
        }
        if sensors.no_imu {
            sensed.imu = Imu::silent();
        }
        if sensors.delay_us > 0 {
            state.line.push_back(sensed.clone());
            if let Some(old) = state.line.pop_front() {
                *sensed = old;
            }
        }
    }

    fn read_encoders(&mut self, time_s: f64, angles_rad: &[f64], sensed: &mut Sensed) {
        let Self {
            sensors,
            estimator,
            period_s,
            trouble,
            phase,
            state,
            ..
        } = self;
        let readings = sensed.wheels_rad_s.iter_mut().zip(&mut sensed.increments_rad);
        for (i, (velocity, increment)) in readings.enumerate() {
            let now = || {
                let all = trouble.iter();
                all.filter(|(wheel, _, span)| *wheel == i && span.contains(&time_s))
                    .map(|(_, trouble, _)| *trouble)
            };
            let has = |what: Trouble| now().any(|trouble| trouble == what);
            let slips = now().filter_map(|trouble| match trouble {
                Trouble::Slips(part) => Some(part),
                _ => None,
            });
            let part: f64 = slips.product();
            let counts = sensors.encoder_counts > 0.0;
            if counts {
                let per_rad = sensors.encoder_counts / std::f64::consts::TAU;
                let encoder = &mut state.encoders[i];
                let before = encoder.place;
                encoder.turn(angles_rad[i], part, per_rad, phase[i]);
                let moved = encoder.place - before;
                let (counted, edge) = encoder.count(has, moved > 0.0);
                *increment = counted / per_rad;
                if let (Some(estimator), Some(remembered)) = (&*estimator, state.velocities.get_mut(i)) {
                    // When the last edge passed, the wheel turning evenly over the period.
                    let part = (encoder.place - edge) / moved;
                    *velocity = estimator.step(remembered, counted as i32, Some(part * *period_s));
                }
            } else {
                *velocity *= part;
            }
            // Drawn in any case, so that a fault changes no other reading.
            let noise = if sensors.encoder_noise_rad_s > 0.0 {
                sensors.encoder_noise_rad_s * normal(&mut state.rng)
            } else {
                0.0
            };
            let (stuck, dead) = (has(Trouble::Stuck), has(Trouble::Dead) || has(Trouble::Toggles));
            if stuck && !counts {
                *velocity = state.read[i];
            } else if dead && !counts {
                *velocity = 0.0;
            } else if !(stuck || dead) {
                *velocity += noise;
            }
            state.read[i] = *velocity;
            if !counts {
                *increment = *velocity * *period_s;
            }
            if has(Trouble::Silent) {
                (*velocity, *increment) = (f64::NAN, f64::NAN);
            }
        }
    }
}

/// A number of the standard normal distribution (Box and Muller, 1958).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let mut above_0 = || uniform(rng) + 1.0 / (1u64 << 53) as f64;
    let radius = (-2.0 * libm::log(above_0())).sqrt();
    radius * libm::cos(std::f64::consts::TAU * above_0())
}

/// A number from 0 up to 1, without 1.
fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
