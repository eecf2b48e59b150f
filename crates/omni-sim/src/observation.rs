//! The observed state of a simulated vehicle after a control period.

use omni_core::BodyTwist;
use omni_core::geometry::PlanarPose;
use omni_core::metrics::{SLIP_FLOOR_M_S, slip_ratio};
use serde::{Deserialize, Serialize};

use crate::config::Vehicle;

/// A place and an orientation in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// The body's axes x, y and z in the world: unit vectors.
    ///
    /// ```
    /// use omni_sim::observation::Pose3;
    /// let mut pose = Pose3::default();
    /// pose.rotation_xyzw = [0.0, 0.0, 1.0, 0.0]; // half a turn about the vertical
    /// assert_eq!(pose.axes(), [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]);
    /// ```
    #[must_use]
    pub fn axes(&self) -> [[f64; 3]; 3] {
        let [x, y, z, w] = self.rotation_xyzw;
        [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y + w * z),
                2.0 * (x * z - w * y),
            ],
            [
                2.0 * (x * y - w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z + w * x),
            ],
            [
                2.0 * (x * z + w * y),
                2.0 * (y * z - w * x),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ]
    }

    /// Heading \[rad\], counter-clockwise positive, -pi to pi.
    #[must_use]
    pub fn yaw_rad(&self) -> f64 {
        let [x, y, z, w] = self.rotation_xyzw;
        libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    }

    /// Position and heading in the plane.
    #[must_use]
    pub fn planar(&self) -> PlanarPose<f64> {
        let [x_m, y_m, _] = self.position_m;
        PlanarPose {
            x_m,
            y_m,
            yaw_rad: self.yaw_rad(),
        }
    }
}

/// The vehicle at one instant, with contact forces averaged over the control period that ended there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Observation {
    /// Simulated time since the start \[ns\].
    pub time_ns: u64,
    /// Pose of the base, its first body; its origin is on the ground under the vehicle.
    pub pose: Pose3,
    /// Velocity of that origin along the vehicle's heading, and yaw rate.
    pub twist: BodyTwist<f64>,
    /// Velocity of that origin \[m/s\], world axes.
    pub velocity_m_s: [f64; 3],
    /// Angular velocity of the base \[rad/s\], world axes.
    pub rate_rad_s: [f64; 3],
    /// Angle of each body's x axis above the horizon \[rad\]: **nose up is positive** (REP-103 pitch is the opposite).
    pub body_nose_up_rad: Vec<f64>,
    /// Angle between each body's z axis and the vertical \[rad\], to whatever side, 0 to pi.
    pub body_lean_rad: Vec<f64>,
    /// The hinges, in the vehicle file's order.
    pub hinges: Vec<HingeObservation>,
    /// The wheels, in the vehicle file's order.
    pub wheels: Vec<WheelObservation>,
    /// Load of each row of wheels \[N\], upwards, front row first
    /// ([`crate::config::Vehicle::rows`]), averaged as the forces are.
    pub row_loads_n: Vec<f64>,
    /// Change of momentum of all parts over the control period that neither the ground nor gravity explains \[N\]: the
    /// error of the simulation or of the reading of its forces.
    pub newton_residual_n: f64,
    /// Energy balance since the start.
    pub energy: Energy,
    /// Pose by odometry: not the truth, but from the wheels' rotation.
    pub odometry: OdometryEstimate,
}

/// Pose by odometry and its covariance, at the end of a control period.
///
/// ```
/// use omni_sim::{Simulation, config::Scenario};
/// let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
/// for _ in 0..2000 {
///     simulation.step(&simulation.scenario_command())?;
/// }
/// let (odometry, truth) = (simulation.observation().odometry, simulation.observation().pose.position_m);
/// assert!(truth[0] > 0.3 && (odometry.pose.x_m - truth[0]).abs() < 0.005); // its wheels roll
/// assert!(odometry.covariance[0][0] > 0.0);
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct OdometryEstimate {
    /// Pose of the origin in the world \[m, m, rad\], yaw in (-pi, pi]. It begins at the true pose of the start.
    pub pose: PlanarPose<f64>,
    /// Twist of the origin that the wheels last amounted to.
    pub twist: BodyTwist<f64>,
    /// Covariance of the pose: rows and columns x, y, yaw, world axes \[m^2, m rad, rad^2\]. 0 at the start.
    pub covariance: [[f64; 3]; 3],
    /// Covariance of the twist: vx, vy \[m/s\] and wz \[rad/s\]; none of odometry by the wheels alone.
    pub twist_covariance: Option<[[f64; 3]; 3]>,
}

impl Default for OdometryEstimate {
    fn default() -> Self {
        Self {
            pose: PlanarPose::origin(),
            twist: BodyTwist::ZERO,
            covariance: [[0.0; 3]; 3],
            twist_covariance: None,
        }
    }
}

/// The energy balance since the start of a run.
///
/// ```
/// use omni_sim::{Simulation, config::Scenario};
/// use omni_core::geometry::PlanarPose;
/// use omni_core::BodyTwist;
/// let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
/// for _ in 0..1000 {
///     simulation.step(&BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 })?;
/// }
/// let energy = simulation.observation().energy;
/// assert!(energy.work_in_j > 1.0 && energy.residual_j().abs() < 0.01 * energy.turnover_j);
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Energy {
    /// Work of the motors, and energy of masses put on the vehicle \[J\].
    pub work_in_j: f64,
    /// Sum of the sizes of all that work, forward and back \[J\]: what a residual is small against.
    pub turnover_j: f64,
    /// Kinetic energy of all parts now \[J\].
    pub kinetic_j: f64,
    /// Potential energy now, 0 at the start \[J\].
    pub potential_j: f64,
    /// Taken by friction in the contacts \[J\].
    pub friction_loss_j: f64,
    /// Taken by the contacts along their normals, in impacts \[J\].
    pub impact_loss_j: f64,
    /// Dissipated by joints \[J\]: the dampers and stops of hinges, and the compliance of all joints in impacts.
    pub joint_loss_j: f64,
    /// Taken by drags on wheels and friction of gears \[J\].
    pub drag_loss_j: f64,
}

impl Energy {
    /// Work put in that is nowhere in the balance \[J\]: the error of finite steps.
    #[must_use]
    pub fn residual_j(&self) -> f64 {
        self.work_in_j
            - self.kinetic_j
            - self.potential_j
            - self.friction_loss_j
            - self.impact_loss_j
            - self.joint_loss_j
            - self.drag_loss_j
    }

    /// Unexplained energy \[J\], below 0 if some is missing: the energy beyond the work of the motors, and the energy
    /// that contacts, hinges and drags together returned beyond their losses. Together, because in an impact rapier's
    /// joints give what its contacts take.
    ///
    /// ```
    /// use omni_sim::{Simulation, config::Scenario};
    /// use omni_core::geometry::PlanarPose;
    /// use omni_core::BodyTwist;
    /// let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
    /// for _ in 0..1000 {
    ///     simulation.step(&BodyTwist { vx_m_s: 0.3, vy_m_s: 0.0, wz_rad_s: 0.0 })?;
    /// }
    /// let energy = simulation.observation().energy;
    /// assert!(energy.made_j() < 0.01 * energy.turnover_j);
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    #[must_use]
    pub fn made_j(&self) -> f64 {
        let lost_j = self.friction_loss_j + self.impact_loss_j + self.joint_loss_j + self.drag_loss_j;
        (-lost_j).max(0.0) - self.residual_j()
    }
}

impl Observation {
    /// An observation with room for a vehicle's parts.
    #[must_use]
    pub(crate) fn of(vehicle: &Vehicle) -> Self {
        Self {
            body_nose_up_rad: vec![0.0; vehicle.body.len()],
            body_lean_rad: vec![0.0; vehicle.body.len()],
            hinges: vec![HingeObservation::default(); vehicle.hinge.len()],
            wheels: vec![WheelObservation::default(); vehicle.wheel.len()],
            row_loads_n: vec![0.0; vehicle.rows().len()],
            ..Self::default()
        }
    }

    /// Empties the averages.
    pub(crate) fn start_period(&mut self) {
        self.wheels.iter_mut().for_each(WheelObservation::start_period);
    }

    /// Works out what follows from the period's sums.
    pub(crate) fn end_period(&mut self) {
        self.wheels.iter_mut().for_each(WheelObservation::end_period);
    }
}

/// A passive hinge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct HingeObservation {
    /// Angle of the child about the axis \[rad\], 0 on flat ground.
    pub angle_rad: f64,
    /// Its rate \[rad/s\].
    pub rate_rad_s: f64,
}

/// A wheel and its contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WheelObservation {
    /// Centre of the axle in the world \[m\].
    pub centre_m: [f64; 3],
    /// Speed of the wheel's centre along its push if it rolls \[m/s\], from its rotation against the world, also while
    /// its carrier pitches. That is r times the cosine of the roller angle times what an encoder reads of the wheel,
    /// and r times the carrier's own turning about the level axis across the push. An omni wheel pushes along its
    /// rolling direction, a mecanum wheel along its roller's axis.
    pub rim_m_s: f64,
    /// Velocity of the centre along the push in the contact's tangent plane \[m/s\].
    pub along_m_s: f64,
    /// Force of the ground on the wheel \[N\], world axes, averaged over the control period.
    pub force_n: [f64; 3],
    /// Its part along the contact normals \[N\], >= 0.
    pub force_normal_n: f64,
    /// Its part along the push (as of `rim_m_s`) in the contact's tangent plane \[N\]; drives the vehicle if positive.
    pub force_along_n: f64,
    /// Direction of the normal force, a unit vector; zero in the air.
    pub normal: [f64; 3],
    /// Point of contact \[m\], world, the mean weighted by the normal force; zero in the air.
    pub contact_m: [f64; 3],
    /// Torque that acted on the actuator \[N.m\], averaged: the commanded one, unless actuators
    /// lack something or have failed.
    pub torque_n_m: f64,
    normal_force_n: [f64; 3],
    moment_m_n: [f64; 3],
    normal_sum_n: f64,
}

/// A physics step's share in the average force on a wheel.
pub(crate) struct ContactForce {
    pub(crate) force_n: [f64; 3],
    pub(crate) normal_n: [f64; 3],
    pub(crate) along_n: f64,
    /// Sum over contacts of the point times the size of the normal force \[m.N\], and of that size \[N\].
    pub(crate) moment_m_n: [f64; 3],
    pub(crate) normal_sum_n: f64,
}

impl WheelObservation {
    /// Did it touch the ground during the control period?
    #[must_use]
    pub fn touches(&self) -> bool {
        self.force_normal_n > 0.0
    }

    /// Slip ratio, the safe form of eq. (15) of the paper, within -2..=2 (faster than it moves is +); 0 in the air.
    #[must_use]
    pub fn slip_ratio(&self) -> f64 {
        if self.touches() {
            slip_ratio(self.rim_m_s, self.along_m_s, SLIP_FLOOR_M_S)
        } else {
            0.0
        }
    }

    fn start_period(&mut self) {
        (self.force_n, self.normal_force_n, self.normal) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        (self.moment_m_n, self.contact_m, self.normal_sum_n) = ([0.0; 3], [0.0; 3], 0.0);
        (self.force_normal_n, self.force_along_n, self.torque_n_m) = (0.0, 0.0, 0.0);
    }

    pub(crate) fn add(&mut self, contact: &ContactForce) {
        for k in 0..3 {
            self.force_n[k] += contact.force_n[k];
            self.normal_force_n[k] += contact.normal_n[k];
            self.moment_m_n[k] += contact.moment_m_n[k];
        }
        self.normal_sum_n += contact.normal_sum_n;
        self.force_along_n += contact.along_n;
    }

    fn end_period(&mut self) {
        self.force_normal_n = self.normal_force_n.iter().map(|n| n * n).sum::<f64>().sqrt();
        if self.force_normal_n > 0.0 {
            self.normal = self.normal_force_n.map(|n| n / self.force_normal_n);
            self.contact_m = self.moment_m_n.map(|moment| moment / self.normal_sum_n);
        }
    }
}
