//! Estimate what encoders and gyros do not say: wheel velocities, the pose, its uncertainty, slip.
//!
//! [`Encoder`] makes velocities of counters, by [`EncoderCounter`] and [`VelocityEstimator`]; [`Odometry`]
//! and [`PoseCovariance`] integrate the wheels; [`Estimator`] fuses them with an inertial measurement unit.

mod covariance;
mod encoder;
pub(crate) mod estimator;
mod ground;
mod odometry;
mod velocity;

pub use covariance::{CovarianceGrowth, OdometryNoise, PoseCovariance};
pub use encoder::{CounterState, Encoder, EncoderConfig, EncoderCounter, EncoderState};
pub use estimator::{Estimator, EstimatorConfig, EstimatorInput, EstimatorState, EstimatorStep};
pub use ground::{
    EdgeEvent, EdgeKind, GroundInput, GroundOdometry, GroundOdometryConfig, GroundOdometryState, GroundPose,
    GroundStep,
};
pub use odometry::{Odometry, OdometryState, OdometryStep};
#[doc(hidden)]
pub use velocity::VelocityLaw;
pub use velocity::{LONGEST_WINDOW, VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
