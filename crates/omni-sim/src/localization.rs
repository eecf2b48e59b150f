//! The pose that the estimator of the core finds from encoders, gyro and accelerometer.

use omni_core::estimate::{
    Estimator, EstimatorInput, EstimatorState, GroundInput, GroundOdometry, GroundOdometryState,
    PoseCovariance,
};
use omni_core::geometry::PlanarPose;
use serde::{Deserialize, Serialize};

use crate::config::{self, Scenario, for_wheel_count};
use crate::control_sample::ControlSample;
use crate::{Error, Sensed};

/// [`Estimator`] with the noise that an exported controller has, for a vehicle with any number of wheels.
pub(crate) struct Localization(Box<dyn Localize>);

/// What a snapshot keeps: an [`EstimatorState`] of as many wheels as the vehicle has, as numbers.
#[derive(Serialize, Deserialize)]
pub(crate) struct State(Vec<u8>);

/// An estimator whose number of wheels does not show.
trait Localize: Send + Sync {
    fn step(&mut self, control: &ControlSample, sensed: &Sensed);
    fn pose(&self) -> PlanarPose<f64>;
    fn state(&self) -> Vec<u8>;
    fn restore(&mut self, state: &[u8]) -> bool;
}

struct OfWheels<const N: usize> {
    estimator: Estimator<f64, N>,
    state: EstimatorState<f64, N>,
}

impl<const N: usize> OfWheels<N> {
    fn advance(
        &mut self,
        control: &ControlSample,
        sensed: &Sensed,
    ) -> (omni_core::WheelVelocities<f64, N>, bool) {
        let drive = control.report.drive.as_ref();
        let left_out =
            |wheel: usize| drive.is_some_and(|drive| drive.wheels.get(wheel).is_some_and(|w| w.left_out));
        // A wheel without a reading, or whose reading the fault monitor rejects, is left out.
        let read = |wheel: usize| match sensed.wheels_rad_s.get(wheel) {
            Some(rate) if !left_out(wheel) => *rate,
            _ => f64::NAN,
        };
        let wheels: omni_core::WheelVelocities<f64, N> = std::array::from_fn(read).into();
        let input = EstimatorInput::with_imu(&wheels, &sensed.imu, &control.command);
        (wheels, self.estimator.step(&mut self.state, &input).standing)
    }
}

impl<const N: usize> Localize for OfWheels<N> {
    fn step(&mut self, control: &ControlSample, sensed: &Sensed) {
        let _ = self.advance(control, sensed);
    }

    fn pose(&self) -> PlanarPose<f64> {
        self.state.pose()
    }

    fn state(&self) -> Vec<u8> {
        crate::state_bytes::to_bytes(&self.state).unwrap_or_default()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        crate::state_bytes::from_bytes(state)
            .map(|state| self.state = state)
            .is_ok()
    }
}

/// 3D odometry; the estimator tells when the vehicle stands.
struct OnGround<const N: usize> {
    planar: OfWheels<N>,
    odometry: GroundOdometry<f64, N>,
    state: Box<GroundOdometryState<f64, N>>,
    moved: bool,
}

impl<const N: usize> Localize for OnGround<N> {
    fn step(&mut self, control: &ControlSample, sensed: &Sensed) {
        let (wheels, standing) = self.planar.advance(control, sensed);
        let mut input =
            GroundInput::new(&wheels, &sensed.imu).with_hinges(&sensed.hinges_rad, &sensed.hinges_rad_s);
        self.moved |= control.command != omni_core::BodyTwist::ZERO;
        if standing || !self.moved {
            input = input.at_rest(!self.moved);
        }
        let _ = self.odometry.step(&mut self.state, &input);
    }

    fn pose(&self) -> PlanarPose<f64> {
        let pose = self.state.pose();
        let [x_m, y_m, _] = pose.position_m;
        PlanarPose {
            x_m,
            y_m,
            yaw_rad: pose.yaw_rad,
        }
    }

    fn state(&self) -> Vec<u8> {
        Vec::new()
    }

    fn restore(&mut self, _: &[u8]) -> bool {
        false
    }
}

fn of_wheels<const N: usize>(
    scenario: &Scenario,
    start: &PlanarPose<f64>,
    ground: bool,
) -> Result<Localization, config::Error> {
    let estimator = scenario.estimator::<f64, N>()?;
    let mut state = estimator.start();
    state.reset(start, &PoseCovariance::default());
    let planar = OfWheels { estimator, state };
    if !ground {
        return Ok(Localization(Box::new(planar)));
    }
    let mut state = Box::new(GroundOdometryState::new());
    state.reset([start.x_m, start.y_m, 0.0], start.yaw_rad);
    Ok(Localization(Box::new(OnGround {
        planar,
        odometry: scenario.ground_odometry::<f64, N>()?,
        state,
        moved: false,
    })))
}

impl Localization {
    /// Of a scenario's vehicle, which knows the pose that it starts at.
    pub(crate) fn new(scenario: &Scenario, start: &PlanarPose<f64>, ground: bool) -> Result<Self, Error> {
        let count = scenario.vehicle().wheel.len();
        let refuse = |count| {
            Err(config::Error::Key {
                file: format!("vehicle {}", scenario.vehicle().name),
                key: "wheel".into(),
                message: config::wheel_count_refused(count).to_string(),
            })
        };
        Ok(for_wheel_count!(count, of_wheels[](scenario, start, ground), refuse)?)
    }

    /// A period of a controller ended, and the sensors were read.
    pub(crate) fn step(&mut self, control: &ControlSample, sensed: &Sensed) {
        self.0.step(control, sensed);
    }

    /// Where the vehicle is by it.
    pub(crate) fn pose(&self) -> PlanarPose<f64> {
        self.0.pose()
    }

    pub(crate) fn state(&self) -> State {
        State(self.0.state())
    }

    /// Goes on from what another one remembered; false where that had other wheels.
    pub(crate) fn restore(&mut self, state: &State) -> bool {
        self.0.restore(&state.0)
    }
}
