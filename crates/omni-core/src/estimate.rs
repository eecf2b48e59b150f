//! Estimate what encoders and gyros do not say: wheel velocities, the pose, its uncertainty, slip.
//!
//! [`EncoderCounter`] and [`VelocityEstimator`] read encoders; [`Odometry`] and [`PoseCovariance`] integrate the wheels;
//! [`Estimator`] fuses them with an inertial measurement unit.

mod covariance;
mod encoder;
pub(crate) mod estimator;
mod odometry;
mod velocity;

pub use covariance::{CovarianceGrowth, OdometryNoise, PoseCovariance};
pub use encoder::{CounterState, EncoderCounter};
pub use estimator::{Estimator, EstimatorConfig, EstimatorInput, EstimatorState, EstimatorStep};
pub use odometry::{Odometry, OdometryState, OdometryStep};
#[doc(hidden)]
pub use velocity::VelocityLaw;
pub use velocity::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
