//! A controller's input, as a message.

use omni_config::Vehicle;
use omni_sim::Sensed;
use serde::{Deserialize, Serialize};

use super::{Header, Vector3};
use crate::topic;
use crate::urdf::IMU_LINK;

/// `omnistep_msgs/msg/Sensors`: the sensor readings at the start of one control period. NaN marks a missing reading, or
/// a sensor that the vehicle lacks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Sensors {
    /// End of the control period, and the frame of the inertial measurement unit.
    pub header: Header,
    /// Actuator velocities \[rad/s\], one per wheel, in the order of the vehicle file.
    pub wheels_rad_s: Vec<f64>,
    /// What each actuator turned in the period \[rad\], by counts where there are counts.
    pub increments_rad: Vec<f64>,
    /// Angles of the hinges \[rad\], one per hinge, in the order of the vehicle file.
    pub hinges_rad: Vec<f64>,
    /// Rates of the hinges \[rad/s\].
    pub hinges_rad_s: Vec<f64>,
    /// Yaw rate about the vertical by the gyro \[rad/s\].
    pub gyro_rad_s: f64,
    /// Turning rates about the unit's axes \[rad/s\].
    pub rate_rad_s: Vector3,
    /// Acceleration less gravity along these axes \[m/s^2\].
    pub specific_force_m_s2: Vector3,
    /// Angle of the y axis above the horizon \[rad\].
    pub roll_rad: f64,
    /// Angle of the x axis above the horizon \[rad\].
    pub pitch_rad: f64,
    /// Height of the edge that a wheel has climbed in the period \[m\]; 0 if none has.
    pub climbed_m: f64,
}

impl Sensors {
    /// Of a period that ends at `time_ns` \[ns\].
    pub(crate) fn new(time_ns: u64, sensed: &Sensed) -> Self {
        let vector = |[x, y, z]: [f64; 3]| Vector3 { x, y, z };
        Self {
            header: Header::new(time_ns, IMU_LINK),
            wheels_rad_s: sensed.wheels_rad_s.clone(),
            increments_rad: sensed.increments_rad.clone(),
            hinges_rad: sensed.hinges_rad.clone(),
            hinges_rad_s: sensed.hinges_rad_s.clone(),
            gyro_rad_s: sensed.gyro_rad_s,
            rate_rad_s: vector(sensed.imu.rate_rad_s),
            specific_force_m_s2: vector(sensed.imu.specific_force_m_s2),
            roll_rad: sensed.imu.roll_rad,
            pitch_rad: sensed.imu.pitch_rad,
            climbed_m: sensed.climbed_m,
        }
    }

    /// Sensor readings of a vehicle, or the reason why they cannot be from this vehicle.
    pub(crate) fn sensed(&self, vehicle: &Vehicle) -> Result<Sensed, String> {
        for (what, found, expected) in [
            ("wheels", &self.wheels_rad_s, vehicle.wheel.len()),
            ("increments", &self.increments_rad, vehicle.wheel.len()),
            ("angles of hinges", &self.hinges_rad, vehicle.hinge.len()),
            ("rates of hinges", &self.hinges_rad_s, vehicle.hinge.len()),
        ] {
            if found.len() != expected {
                let (topic, found) = (topic::SENSORS, found.len());
                return Err(format!(
                    "{topic}: a message with {found} {what}, expected {expected}"
                ));
            }
        }
        let array = |v: &Vector3| [v.x, v.y, v.z];
        let mut sensed = Sensed::at_rest(vehicle);
        sensed.wheels_rad_s.clone_from(&self.wheels_rad_s);
        sensed.increments_rad.clone_from(&self.increments_rad);
        sensed.hinges_rad.clone_from(&self.hinges_rad);
        sensed.hinges_rad_s.clone_from(&self.hinges_rad_s);
        sensed.gyro_rad_s = self.gyro_rad_s;
        sensed.imu.rate_rad_s = array(&self.rate_rad_s);
        sensed.imu.specific_force_m_s2 = array(&self.specific_force_m_s2);
        (sensed.imu.roll_rad, sensed.imu.pitch_rad) = (self.roll_rad, self.pitch_rad);
        sensed.climbed_m = self.climbed_m;
        Ok(sensed)
    }
}
