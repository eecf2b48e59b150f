//! The pose that the estimator of the core finds from encoders, gyro and accelerometer.

use omni_core::estimate::{Estimator, EstimatorInput, EstimatorState, PoseCovariance};
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
    period_s: f64,
    estimator: Estimator<f64, N>,
    state: EstimatorState<f64, N>,
}

impl<const N: usize> Localize for OfWheels<N> {
    fn step(&mut self, control: &ControlSample, sensed: &Sensed) {
        let drive = control.report.drive.as_ref();
        let excluded =
            |wheel: usize| drive.is_some_and(|drive| drive.wheels.get(wheel).is_some_and(|w| w.excluded));
        // A wheel without a reading, or whose reading the fault monitor rejects, is left out.
        let read = |wheel: usize| match sensed.increments_rad.get(wheel) {
            Some(turned) if !excluded(wheel) => *turned / self.period_s,
            _ => f64::NAN,
        };
        let wheels = std::array::from_fn(read).into();
        let input = EstimatorInput::with_imu(&wheels, &sensed.imu, &control.command);
        let _ = self.estimator.step(&mut self.state, &input);
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

fn of_wheels<const N: usize>(
    scenario: &Scenario,
    start: &PlanarPose<f64>,
) -> Result<Localization, config::Error> {
    let estimator = scenario.estimator::<f64, N>()?;
    let mut state = estimator.start();
    state.reset(start, &PoseCovariance::default());
    let period_s = scenario.period_s();
    Ok(Localization(Box::new(OfWheels {
        period_s,
        estimator,
        state,
    })))
}

impl Localization {
    /// Of a scenario's vehicle, which knows the pose that it starts at.
    pub(crate) fn new(scenario: &Scenario, start: &PlanarPose<f64>) -> Result<Self, Error> {
        let count = scenario.vehicle().wheel.len();
        let refuse = |count| {
            Err(config::Error::Key {
                file: format!("vehicle {}", scenario.vehicle().name),
                key: "wheel".into(),
                message: config::wheel_count_refused(count).to_string(),
            })
        };
        Ok(for_wheel_count!(count, of_wheels[](scenario, start), refuse)?)
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
