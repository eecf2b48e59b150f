//! What can be seen of a simulated vehicle after a control period.

use omni_core::BodyTwist;
use omni_core::metrics::{SLIP_FLOOR_M_S, slip_ratio};

use crate::config::Vehicle;

/// A place and an orientation in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose3 {
    /// Position \[m\]: x, y, z.
    pub position_m: [f64; 3],
    /// Unit quaternion x, y, z, w that turns body vectors into world vectors.
    pub rotation_xyzw: [f64; 4],
}

impl Default for Pose3 {
    fn default() -> Self {
        Self {
            position_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        }
    }
}

impl Pose3 {
    /// Heading \[rad\] about the vertical, counter-clockwise positive, -pi to pi.
    #[must_use]
    pub fn yaw_rad(&self) -> f64 {
        let [x, y, z, w] = self.rotation_xyzw;
        libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    }
}

/// The vehicle at one instant, with contact forces averaged over the control period that ended there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observation {
    /// Simulated time since the start \[ns\].
    pub time_ns: u64,
    /// Pose of the base, its first body; its origin is on the ground under the vehicle.
    pub pose: Pose3,
    /// Velocity of that origin along the vehicle's heading, and yaw rate.
    pub twist: BodyTwist<f64>,
    /// Angle of each body's x axis above the horizon \[rad\]: **nose up is positive** (REP-103 pitch is the opposite).
    pub body_nose_up_rad: Vec<f64>,
    /// The hinges, in the vehicle file's order.
    pub hinges: Vec<HingeObservation>,
    /// The wheels, in the vehicle file's order.
    pub wheels: Vec<WheelObservation>,
}

impl Observation {
    /// An observation with room for a vehicle's parts.
    #[must_use]
    pub(crate) fn of(vehicle: &Vehicle) -> Self {
        Self {
            body_nose_up_rad: vec![0.0; vehicle.body.len()],
            hinges: vec![HingeObservation::default(); vehicle.hinge.len()],
            wheels: vec![WheelObservation::default(); vehicle.wheel.len()],
            ..Self::default()
        }
    }
}

/// A passive hinge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HingeObservation {
    /// Angle of the child about the axis \[rad\], 0 on flat ground.
    pub angle_rad: f64,
    /// Its rate \[rad/s\].
    pub rate_rad_s: f64,
}

/// A wheel and its contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelObservation {
    /// Centre of the axle in the world \[m\].
    pub centre_m: [f64; 3],
    /// Speed that the wheel asks of its centre along its push \[m/s\]: r times the wheel's turning speed, times the cosine of
    /// the roller angle. An omni wheel pushes along its rolling direction, a mecanum wheel along its roller's axis.
    pub rim_m_s: f64,
    /// Velocity of the centre along the push in the contact's tangent plane \[m/s\].
    pub along_m_s: f64,
    /// Force of the ground on the wheel \[N\], world axes, averaged over the control period.
    pub force_n: [f64; 3],
    /// Its part along the contact normals \[N\], >= 0.
    pub force_normal_n: f64,
    /// Its part along the rolling direction in the contact's tangent plane \[N\]; drives the vehicle if positive.
    pub force_along_n: f64,
    /// Direction of the normal force, a unit vector; zero in the air.
    pub normal: [f64; 3],
    normal_force_n: [f64; 3],
}

impl WheelObservation {
    /// Did it touch the ground during the control period?
    #[must_use]
    pub fn touches(&self) -> bool {
        self.force_normal_n > 0.0
    }

    /// Slip ratio, the safe form of eq. (15), within -2..=2 (faster than it moves is +); 0 in the air.
    #[must_use]
    pub fn slip_ratio(&self) -> f64 {
        if self.touches() {
            slip_ratio(self.rim_m_s, self.along_m_s, SLIP_FLOOR_M_S)
        } else {
            0.0
        }
    }

    pub(crate) fn start_period(&mut self) {
        (self.force_n, self.normal_force_n, self.normal) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        (self.force_normal_n, self.force_along_n) = (0.0, 0.0);
    }

    pub(crate) fn add_force(&mut self, force: [f64; 3], normal: [f64; 3], along: f64) {
        for k in 0..3 {
            self.force_n[k] += force[k];
            self.normal_force_n[k] += normal[k];
        }
        self.force_along_n += along;
        self.force_normal_n = self.normal_force_n.iter().map(|n| n * n).sum::<f64>().sqrt();
        if self.force_normal_n > 0.0 {
            self.normal = self.normal_force_n.map(|n| n / self.force_normal_n);
        }
    }
}
