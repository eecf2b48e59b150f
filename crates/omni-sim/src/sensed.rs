//! Readings of a vehicle's sensors in one control period, and their columns in traces and logs.

use omni_core::policy::Imu;
use omni_core::{BodyTwist, Readings};
use serde::{Deserialize, Serialize};

use crate::config::Vehicle;

/// Columns of gyro and inertial measurement unit; then [`WHEEL`] of each wheel, and for each signal of [`HINGE`] one
/// per hinge.
const BASE: [&str; 10] = [
    "gyro_rad_s",
    "sensed_roll_rate_rad_s",
    "sensed_pitch_rate_rad_s",
    "sensed_yaw_rate_rad_s",
    "sensed_specific_force_x_m_s2",
    "sensed_specific_force_y_m_s2",
    "sensed_specific_force_z_m_s2",
    "sensed_roll_rad",
    "sensed_pitch_rad",
    "sensed_climbed_m",
];
const WHEEL: &str = "sensed_increment_rad";
const HINGE: [&str; 2] = ["sensed_angle_rad", "sensed_rate_rad_s"];

/// Readings of a vehicle's sensors in one control period.
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
pub struct Sensed {
    /// Actuator velocities \[rad/s\], one per wheel; NaN if no reading arrived.
    pub wheels_rad_s: Vec<f64>,
    /// What each actuator turned in the period \[rad\]: the encoder's counts, of which none is lost, where it has them.
    /// A velocity by counts reads 0 of a wheel that creeps; a pose is the sum of these.
    pub increments_rad: Vec<f64>,
    /// Angles of the hinges \[rad\], one per hinge; NaN if they have no encoders.
    pub hinges_rad: Vec<f64>,
    /// Rates of the hinges \[rad/s\], one per hinge.
    pub hinges_rad_s: Vec<f64>,
    /// Yaw rate by the gyro \[rad/s\], counter-clockwise positive.
    pub gyro_rad_s: f64,
    /// The inertial measurement unit on the base.
    pub imu: Imu<f64>,
    /// Height of the edge that a wheel has climbed in the period \[m\], by odometry in three dimensions; 0 if none has.
    pub climbed_m: f64,
}

impl Sensed {
    /// A vehicle at rest on level ground.
    #[must_use]
    pub fn at_rest(vehicle: &Vehicle) -> Self {
        let hinges = vehicle.hinge.len();
        Self {
            wheels_rad_s: vec![0.0; vehicle.wheel.len()],
            increments_rad: vec![0.0; vehicle.wheel.len()],
            hinges_rad: vec![0.0; hinges],
            hinges_rad_s: vec![0.0; hinges],
            gyro_rad_s: 0.0,
            imu: Imu::level(),
            climbed_m: 0.0,
        }
    }

    /// Whether its readings match the vehicle's wheels and hinges.
    pub(crate) fn is_of(&self, vehicle: &Vehicle) -> bool {
        let hinges = vehicle.hinge.len();
        self.wheels_rad_s.len() == vehicle.wheel.len()
            && self.increments_rad.len() == vehicle.wheel.len()
            && self.hinges_rad.len() == hinges
            && self.hinges_rad_s.len() == hinges
    }

    /// Names of the columns: of gyro and inertial measurement unit, then the wheels' increments, then angles and rates
    /// of the hinges. The wheels' velocities are the signal `measured_rad_s` of each.
    #[must_use]
    pub fn names(vehicle: &Vehicle) -> Vec<String> {
        let of_hinges = HINGE.iter().flat_map(|signal| {
            let hinges = vehicle.hinge.iter();
            hinges.map(move |hinge| format!("{signal}_{}", hinge.name))
        });
        let of_wheels = vehicle
            .wheel
            .iter()
            .map(|wheel| format!("{WHEEL}_{}", wheel.name));
        BASE.iter()
            .map(|name| (*name).to_owned())
            .chain(of_wheels)
            .chain(of_hinges)
            .collect()
    }

    /// The numbers of these columns.
    ///
    /// ```
    /// use omni_sim::{Sensed, config::Scenario};
    /// let scenario = Scenario::load("flat", &[])?;
    /// let mut sensed = Sensed::at_rest(scenario.vehicle());
    /// let names = Sensed::names(scenario.vehicle());
    /// let values: Vec<_> = (0..names.len()).map(|k| k as f64).collect();
    /// sensed.set_values(&values);
    /// assert_eq!((names[8].as_str(), sensed.imu.pitch_rad), ("sensed_pitch_rad", 8.0));
    /// assert!(sensed.values().eq(values));
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let imu = &self.imu;
        std::iter::once(self.gyro_rad_s)
            .chain(imu.rate_rad_s)
            .chain(imu.specific_force_m_s2)
            .chain([imu.roll_rad, imu.pitch_rad, self.climbed_m])
            .chain(self.increments_rad.iter().copied())
            .chain(self.hinges_rad.iter().chain(&self.hinges_rad_s).copied())
    }

    /// Takes the numbers of these columns, as many as there are.
    pub fn set_values(&mut self, values: &[f64]) {
        let imu = &mut self.imu;
        let places = std::iter::once(&mut self.gyro_rad_s)
            .chain(&mut imu.rate_rad_s)
            .chain(&mut imu.specific_force_m_s2)
            .chain([&mut imu.roll_rad, &mut imu.pitch_rad, &mut self.climbed_m])
            .chain(&mut self.increments_rad)
            .chain(self.hinges_rad.iter_mut().chain(&mut self.hinges_rad_s));
        for (place, value) in places.zip(values) {
            *place = *value;
        }
    }

    /// With a new command: the input of a controller.
    #[must_use]
    pub fn readings(&self, command: BodyTwist<f64>) -> Readings<'_, f64> {
        let mut readings = Readings::new(command, &self.wheels_rad_s);
        readings.hinges_rad = &self.hinges_rad;
        readings.hinges_rad_s = &self.hinges_rad_s;
        readings.imu = self.imu;
        readings.climbed_m = self.climbed_m;
        readings
    }
}
