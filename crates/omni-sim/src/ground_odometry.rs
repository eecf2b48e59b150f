//! Odometry in three dimensions of a run: the core's, by the mean readings of some control periods.

use omni_core::BodyTwist;
use omni_core::estimate::{
    GroundInput, GroundOdometry, GroundOdometryState, GroundStep, Odometry, OdometryState, PoseCovariance,
};
use omni_core::geometry::{BodyDisplacement, PlanarPose};
use omni_core::policy::Imu;
use serde::{Deserialize, Serialize};

use crate::config::{self, OdometryKind, Scenario, for_wheel_count};
use crate::control_sample::ControlSample;
use crate::observation::Pose3;
use crate::report::{GroundReport, GroundWheel};
use crate::{Error, Sensed};

/// [`GroundOdometry`] for a vehicle with any number of wheels.
pub(crate) struct GroundOdometer(Box<dyn Follow>);

/// Pose in the plane with its covariance, twist with its own.
pub(crate) struct Planar {
    pub(crate) pose: PlanarPose<f64>,
    pub(crate) covariance: PoseCovariance<f64>,
    pub(crate) twist: BodyTwist<f64>,
    /// None if the yaw rate is the wheels'.
    pub(crate) twist_covariance: Option<[[f64; 3]; 3]>,
}

/// What a snapshot keeps, as numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct State(Vec<u8>);

/// An odometry whose number of wheels does not show.
trait Follow: Send + Sync {
    fn step(&mut self, control: &ControlSample, sensed: &Sensed);
    fn planar(&self) -> Planar;
    fn report(&self) -> &GroundReport;
    fn state(&self) -> Vec<u8>;
    fn restore(&mut self, state: &[u8]) -> bool;
}

/// The mean of the readings that arrived.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct Mean {
    sum: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, reading: f64) {
        if reading.is_finite() {
            self.add_known(reading);
        }
    }

    /// NaN if one is missing.
    fn add_known(&mut self, reading: f64) {
        self.sum += reading;
        self.count += 1;
    }

    /// NaN if none arrived.
    fn take(&mut self) -> f64 {
        let Self { sum, count } = std::mem::take(self);
        if count == 0 {
            f64::NAN
        } else {
            sum / f64::from(count)
        }
    }
}

struct OfWheels<const N: usize> {
    odometry: GroundOdometry<f64, N>,
    /// Goes on with the twist between steps.
    between: Odometry<f64, 1>,
    period_s: f64,
    /// Control periods whose mean readings make a step, and the variance of the gyro's \[rad^2/s^2\].
    periods: u32,
    gyro_variance: f64,
    memory: Memory<N>,
}

#[derive(Serialize, Deserialize)]
struct Memory<const N: usize> {
    state: GroundOdometryState<f64, N>,
    pose: OdometryState<f64, 1>,
    /// Of the wheels, of the inertial unit, of the torques, and of angles and rates of the hinges.
    means: Vec<Mean>,
    gathered: u32,
    /// The last readings had a yaw rate.
    has_gyro: bool,
    report: GroundReport,
}

impl<const N: usize> OfWheels<N> {
    /// The mean readings since the last step.
    fn input(&mut self, command: &BodyTwist<f64>) -> GroundInput<f64, N> {
        let mut means = self.memory.means.iter_mut().map(Mean::take);
        let mut next = || means.next().unwrap_or(f64::NAN);
        let wheels: [f64; N] = std::array::from_fn(|_| next());
        let mut imu = Imu::silent();
        imu.rate_rad_s = [0; 3].map(|_| next());
        imu.specific_force_m_s2 = [0; 3].map(|_| next());
        (imu.roll_rad, imu.pitch_rad) = (next(), next());
        let torques: [f64; N] = std::array::from_fn(|_| next());
        let hinges: Vec<f64> = means.collect();
        let (angles, rates) = hinges.split_at(hinges.len() / 2);
        GroundInput::new(&wheels.into(), &imu, command)
            .with_torques(&torques.into())
            .with_hinges(angles, rates)
    }

    fn report_of(&self, step: &GroundStep<f64, N>) -> GroundReport {
        let pose = self.memory.state.pose();
        GroundReport {
            z_m: pose.position_m[2],
            std_z_m: self.memory.state.height_variance_m2().sqrt(),
            roll_rad: pose.roll_rad,
            pitch_rad: pose.pitch_rad,
            wheels: pose
                .contact_m
                .iter()
                .zip(&step.edges)
                .map(|(z_m, edge)| GroundWheel {
                    z_m: *z_m,
                    edge: *edge,
                })
                .collect(),
        }
    }
}

impl<const N: usize> Follow for OfWheels<N> {
    fn step(&mut self, control: &ControlSample, sensed: &Sensed) {
        let drive = control.report.drive.as_ref();
        let excluded =
            |wheel: usize| drive.is_some_and(|drive| drive.wheels.get(wheel).is_some_and(|w| w.excluded));
        let period_s = self.period_s;
        // A wheel whose reading the fault monitor rejects is left out.
        let wheels = sensed.increments_rad.iter().enumerate();
        let wheels = wheels.map(|(i, turned)| if excluded(i) { f64::NAN } else { turned / period_s });
        // A motor whose windings are shorted brakes: its torque is not known.
        let brakes = |wheel: usize| control.brake.get(wheel).copied().unwrap_or(false);
        let torques = control.wheels.iter().enumerate();
        let torques = torques.map(|(i, wheel)| if brakes(i) { f64::NAN } else { wheel.applied_n_m });
        let imu = &sensed.imu;
        let readings = wheels
            .chain(imu.rate_rad_s)
            .chain(imu.specific_force_m_s2)
            .chain([imu.roll_rad, imu.pitch_rad])
            .chain(torques)
            .chain(sensed.hinges_rad.iter().chain(&sensed.hinges_rad_s).copied());
        let torques = N + 8..2 * N + 8;
        for (i, (mean, reading)) in self.memory.means.iter_mut().zip(readings).enumerate() {
            if torques.contains(&i) {
                mean.add_known(reading);
            } else {
                mean.add(reading);
            }
        }
        self.memory.gathered += 1;
        if self.memory.gathered < self.periods {
            let twist = self.memory.state.planar().twist().to_array();
            let [dx_m, dy_m, dyaw_rad] = twist.map(|speed| speed * period_s);
            let displacement = BodyDisplacement { dx_m, dy_m, dyaw_rad };
            self.between
                .step_displacement(&mut self.memory.pose, &displacement);
            for wheel in &mut self.memory.report.wheels {
                wheel.edge = None;
            }
            return;
        }
        self.memory.gathered = 0;
        let input = self.input(&control.command);
        self.memory.has_gyro = input.imu.rate_rad_s[2].is_finite();
        let step = self.odometry.step(&mut self.memory.state, &input);
        self.memory.pose.reset(&self.memory.state.planar().pose());
        self.memory.report = self.report_of(&step);
    }

    fn planar(&self) -> Planar {
        let planar = self.memory.state.planar();
        let [[xx, xy], [yx, yy]] = planar.velocity_covariance();
        let yaw = planar.gyro_bias_deviation_rad_s().powi(2) + self.gyro_variance;
        Planar {
            pose: self.memory.pose.pose(),
            covariance: planar.covariance(),
            twist: planar.twist(),
            twist_covariance: self
                .memory
                .has_gyro
                .then_some([[xx, xy, 0.0], [yx, yy, 0.0], [0.0, 0.0, yaw]]),
        }
    }

    fn report(&self) -> &GroundReport {
        &self.memory.report
    }

    fn state(&self) -> Vec<u8> {
        crate::state_bytes::to_bytes(&self.memory).unwrap_or_default()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        crate::state_bytes::from_bytes(state)
            .map(|memory| self.memory = memory)
            .is_ok()
    }
}

fn of_wheels<const N: usize>(
    scenario: &Scenario,
    start: &Pose3,
    between: &Odometry<f64, 1>,
) -> Result<GroundOdometer, config::Error> {
    let (odometry, periods) = scenario.ground_odometry::<f64, N>()?;
    let mut state = odometry.start();
    let hinges = scenario.vehicle().hinge.len();
    let mut pose = OdometryState::new();
    pose.reset(&start.planar());
    let [.., height_m] = start.position_m;
    // Until the first readings: on the level.
    let wheel = GroundWheel {
        z_m: height_m,
        edge: None,
    };
    state.reset(&start.planar(), &PoseCovariance::default(), height_m);
    Ok(GroundOdometer(Box::new(OfWheels::<N> {
        odometry,
        between: *between,
        period_s: scenario.period_s(),
        periods,
        gyro_variance: scenario.sensors.gyro_noise_rad_s.powi(2) / f64::from(periods),
        memory: Memory {
            state,
            pose,
            means: vec![Mean::default(); 2 * N + 8 + 2 * hinges],
            gathered: 0,
            has_gyro: false,
            report: GroundReport {
                z_m: height_m,
                std_z_m: 0.0,
                roll_rad: 0.0,
                pitch_rad: 0.0,
                wheels: vec![wheel; N],
            },
        },
    })))
}

/// Whether it is built in. A page that is loaded does without.
const BUILT_IN: bool = cfg!(feature = "ground-odometry");

impl GroundOdometer {
    /// Of a scenario's vehicle, which knows the pose that it starts at; `between` steps goes on with the twist.
    pub(crate) fn new(scenario: &Scenario, start: &Pose3, between: &Odometry<f64, 1>) -> Result<Self, Error> {
        if !BUILT_IN {
            let (key, message) = match scenario.odometry.kind {
                OdometryKind::Ground => ("odometry.kind", "\"ground\", allowed in this build: planar"),
                OdometryKind::Planar => (
                    "command.follow.pose",
                    "\"estimate\", allowed in this build: odometry, truth",
                ),
            };
            return Err(Error::Config(config::Error::Key {
                file: format!("scenario {}", scenario.name),
                key: key.into(),
                message: message.into(),
            }));
        }
        let count = scenario.vehicle().wheel.len();
        let refuse = |count| {
            Err(config::Error::Key {
                file: format!("vehicle {}", scenario.vehicle().name),
                key: "wheel".into(),
                message: config::wheel_count_refused(count).to_string(),
            })
        };
        Ok(for_wheel_count!(count, of_wheels[](scenario, start, between), refuse)?)
    }

    /// A period of a controller ended, and the sensors were read.
    pub(crate) fn step(&mut self, control: &ControlSample, sensed: &Sensed) {
        self.0.step(control, sensed);
    }

    /// Pose and twist in the plane.
    pub(crate) fn planar(&self) -> Planar {
        self.0.planar()
    }

    /// What else it knows.
    pub(crate) fn report(&self) -> &GroundReport {
        self.0.report()
    }

    pub(crate) fn state(&self) -> State {
        State(self.0.state())
    }

    /// Goes on from what another one remembered; false where that had other wheels.
    pub(crate) fn restore(&mut self, state: &State) -> bool {
        self.0.restore(&state.0)
    }
}
