//! What a vehicle's sensors make of the truth.

use std::collections::VecDeque;
use std::ops::Range;

use omni_core::{BodyTwist, Imu, Readings, VelocityEstimator, VelocityState};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::config::{Fault, Scenario, Sensors, Vehicle};
use crate::observation::Observation;

/// Columns of what the inertial measurement unit says, and of each hinge: a log is enough to replay a controller that was told it.
pub(crate) const SENSED: [&str; 5] = [
    "sensed_roll_rate_rad_s",
    "sensed_pitch_rate_rad_s",
    "sensed_yaw_rate_rad_s",
    "sensed_roll_rad",
    "sensed_pitch_rad",
];
pub(crate) const SENSED_HINGE: [&str; 2] = ["sensed_angle_rad", "sensed_rate_rad_s"];

/// What a vehicle's sensors say in one control period.
///
/// ```
/// use omni_sim::{Simulation, config::Scenario};
/// let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
/// for _ in 0..1500 {
///     simulation.step(&simulation.scenario_command())?;
/// }
/// let sensed = simulation.sensed();
/// assert_eq!((sensed.wheels_rad_s.len(), sensed.hinges_rad.len()), (7, 2));
/// assert!((sensed.imu.specific_force_m_s2[2] - 9.81).abs() < 0.1); // it drives steadily on flat ground
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Sensed {
    /// Actuator velocities \[rad/s\], one a wheel; NaN where no reading arrived.
    pub wheels_rad_s: Vec<f64>,
    /// Angles of the hinges \[rad\], one a hinge; NaN where they have no encoders.
    pub hinges_rad: Vec<f64>,
    /// Rates of the hinges \[rad/s\], one a hinge.
    pub hinges_rad_s: Vec<f64>,
    /// Yaw rate about the vertical by the gyro \[rad/s\], counter-clockwise positive.
    pub gyro_rad_s: f64,
    /// The inertial measurement unit on the base.
    pub imu: Imu<f64>,
}

impl Sensed {
    /// A vehicle at rest on level ground.
    #[must_use]
    pub fn at_rest(vehicle: &Vehicle) -> Self {
        let hinges = vehicle.hinge.len();
        Self {
            wheels_rad_s: vec![0.0; vehicle.wheel.len()],
            hinges_rad: vec![0.0; hinges],
            hinges_rad_s: vec![0.0; hinges],
            gyro_rad_s: 0.0,
            imu: Imu::level(),
        }
    }

    /// Takes what hinges and inertial measurement unit said out of the signals of a controller that was told it (`steady`, `reach`): their
    /// names and values in one control period. Says whether everything was there.
    ///
    /// ```
    /// use omni_sim::{Sensed, Simulation, config::Scenario};
    /// let scenario = Scenario::load("step", &[])?.with_policy("steady")?;
    /// let mut simulation = Simulation::new(&scenario)?;
    /// let sensed = simulation.sensed().clone();
    /// simulation.step(&simulation.scenario_command())?;
    /// let (names, values) = (simulation.controller().signal_names(), &simulation.sample().own);
    /// let mut again = Sensed::at_rest(scenario.vehicle());
    /// assert!(again.take_signals(scenario.vehicle(), names, values));
    /// assert_eq!((again.imu.pitch_rad, &again.hinges_rad), (sensed.imu.pitch_rad, &sensed.hinges_rad));
    /// assert!(!again.take_signals(scenario.vehicle(), &names[1..], values)); // the names of other values
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    #[must_use]
    pub fn take_signals(&mut self, vehicle: &Vehicle, names: &[String], values: &[f64]) -> bool {
        if names.len() != values.len() {
            return false;
        }
        let value = |name: &str| {
            let at = names.iter().position(|each| each == name)?;
            values.get(at).copied()
        };
        let take = |to: &mut f64, name: &str| value(name).map(|value| *to = value).is_some();
        let Imu {
            rate_rad_s: [roll_rate, pitch_rate, yaw_rate],
            roll_rad,
            pitch_rad,
            ..
        } = &mut self.imu;
        let mut there = true;
        for (to, name) in [roll_rate, pitch_rate, yaw_rate, roll_rad, pitch_rad]
            .into_iter()
            .zip(SENSED)
        {
            there &= take(to, name);
        }
        for (readings, signal) in [&mut self.hinges_rad, &mut self.hinges_rad_s]
            .into_iter()
            .zip(SENSED_HINGE)
        {
            for (to, hinge) in readings.iter_mut().zip(&vehicle.hinge) {
                there &= take(to, &format!("{signal}_{}", hinge.name));
            }
        }
        there
    }

    /// With a new command: what a controller is told.
    #[must_use]
    pub fn readings(&self, command: BodyTwist<f64>) -> Readings<'_, f64> {
        let mut readings = Readings::new(command, &self.wheels_rad_s);
        readings.hinges_rad = &self.hinges_rad;
        readings.hinges_rad_s = &self.hinges_rad_s;
        readings.imu = self.imu;
        readings
    }
}

/// What happens to an encoder.
#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    Stuck,
    Silent,
}

/// The sensors of a vehicle.
pub(crate) struct Sensing {
    sensors: Sensors,
    /// What makes velocities of counts, where that is not the counts of a period.
    estimator: Option<VelocityEstimator<f64>>,
    gravity_m_s2: f64,
    period_s: f64,
    /// Of which wheel, what, and from when to when \[s\].
    trouble: Vec<(usize, Trouble, Range<f64>)>,
    state: State,
}

/// What a snapshot keeps.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct State {
    rng: ChaCha8Rng,
    /// Of the gyros about x and y.
    tilt_rng: ChaCha8Rng,
    /// Whole counts of each encoder after the last period.
    counts: Vec<f64>,
    /// What is remembered for the velocity of each encoder, and its angle after the last period \[rad\]; empty where nothing is.
    velocities: Vec<(VelocityState<f64>, f64)>,
    /// What each encoder last read \[rad/s\].
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
            let (wheel, trouble) = match fault {
                Fault::EncoderStuck { wheel, .. } => (wheel, Trouble::Stuck),
                Fault::EncoderSilent { wheel, .. } => (wheel, Trouble::Silent),
                _ => return None,
            };
            let wheel = vehicle.wheel.iter().position(|w| w.name == *wheel)?;
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
        Self {
            sensors,
            estimator,
            gravity_m_s2: scenario.physics.gravity_m_s2,
            period_s: scenario.period_s(),
            trouble: trouble.collect(),
            state: State {
                rng: stream(1),
                tilt_rng: stream(2),
                counts: vec![0.0; wheels],
                velocities: vec![(VelocityState::at_rest(), 0.0); remembered],
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

    /// From the truth, and the true actuator velocities \[rad/s\] in `sensed`, to what the controller is given: `sensed` is overwritten.
    pub(crate) fn read(&mut self, angles_rad: &[f64], seen: &Observation, sensed: &mut Sensed) {
        self.read_encoders(seen.time_ns as f64 * 1e-9, angles_rad, &mut sensed.wheels_rad_s);
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

    fn read_encoders(&mut self, time_s: f64, angles_rad: &[f64], velocities_rad_s: &mut [f64]) {
        let Self {
            sensors,
            estimator,
            period_s,
            trouble,
            state,
            ..
        } = self;
        for (i, velocity) in velocities_rad_s.iter_mut().enumerate() {
            if sensors.encoder_counts > 0 {
                let per_rad = f64::from(sensors.encoder_counts) / std::f64::consts::TAU;
                let counts = (angles_rad[i] * per_rad).floor();
                let counted = counts - state.counts[i];
                state.counts[i] = counts;
                *velocity = match (&*estimator, state.velocities.get_mut(i)) {
                    (Some(estimator), Some((remembered, before_rad))) => {
                        // When the last edge passed, the wheel turning evenly over the period: of a count it is the lower end.
                        let edge_rad = if counted > 0.0 { counts } else { counts + 1.0 } / per_rad;
                        let part = (angles_rad[i] - edge_rad) / (angles_rad[i] - *before_rad);
                        *before_rad = angles_rad[i];
                        estimator.step(remembered, counted as i32, Some(part * *period_s))
                    }
                    _ => counted / per_rad / *period_s,
                };
            }
            if sensors.encoder_noise_rad_s > 0.0 {
                *velocity += sensors.encoder_noise_rad_s * normal(&mut state.rng);
            }
            let suffers = |what: Trouble| {
                let mut trouble = trouble.iter();
                trouble
                    .any(|(wheel, trouble, span)| *wheel == i && *trouble == what && span.contains(&time_s))
            };
            if suffers(Trouble::Stuck) {
                *velocity = state.read[i];
            }
            state.read[i] = *velocity;
            if suffers(Trouble::Silent) {
                *velocity = f64::NAN;
            }
        }
    }
}

/// A number of the standard normal distribution (Box and Muller, 1958).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let mut uniform = || ((rng.next_u64() >> 11) as f64 + 1.0) / (1u64 << 53) as f64; // above 0, up to 1
    let radius = (-2.0 * libm::log(uniform())).sqrt();
    radius * libm::cos(std::f64::consts::TAU * uniform())
}
