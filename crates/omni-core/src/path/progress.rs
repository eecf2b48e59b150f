//! Progress along a trajectory: its time waits for a vehicle that is held up.

use crate::constants::constant_struct;
use crate::error::within;
use crate::geometry::PlanarPose;
use crate::path::{Trajectory, TrajectorySample};
use crate::scalar::max;
use crate::sum::Sum;
use crate::{ConfigError, Real};

/// Time of a trajectory from standstill to its full rate \[s\], and back, so that its changes stay within the wheels'
/// limits.
const FULL_S: f64 = 0.2;
/// A trajectory that is slower than this part of its rate is held up.
const HELD_UP: f64 = 0.1;

/// From which error on a trajectory waits.
///
/// ```
/// use omni_core::path::{PathProgress, ProgressConfig};
/// let error = PathProgress::new(ProgressConfig { lag_m: 0.0, lag_rad: 0.3 }).unwrap_err();
/// assert_eq!(error.to_string(), "lag_m = 0, allowed: 0.001 to 100");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct ProgressConfig<R> {
    /// A vehicle with a larger position error than this \[m\], 0.001 to 100, slows its trajectory down; from twice this
    /// error on, the trajectory stands still. It should be several times the error of a vehicle that is not held up.
    pub lag_m: R,
    /// The same of its heading \[rad\], 0.001 to 100.
    pub lag_rad: R,
}

constant_struct!(ProgressConfig<R> { lag_m: R, lag_rad: R });

/// Samples a trajectory at a time that waits for the vehicle: while it tries again to climb an
/// edge, or is stuck, the pose to follow stays near.
///
/// Its follower has to correct the pose, or a vehicle that lags stays behind for good.
///
/// ```
/// use omni_core::geometry::PlanarPose;
/// use omni_core::path::{PathPiece, PathProgress, PathSegment, ProgressConfig, ProgressState, Waypoint};
/// # let planner = omni_core::examples::planner()?;
/// # let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
/// let ahead = planner.plan(&[Waypoint::at(0.0, 0.0), Waypoint::at(3.0, 0.0)], &mut segments, &mut pieces)?;
/// let progress = PathProgress::new(ProgressConfig { lag_m: 0.1, lag_rad: 0.3 })?;
/// let mut state = ProgressState::default();
/// let stuck = PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };
/// let mut sample = progress.step(&mut state, &ahead, 0.0, &stuck);
/// for period in 1..10_000 {
///     sample = progress.step(&mut state, &ahead, 1e-3 * period as f64, &stuck);
/// }
/// // It waits 20 cm ahead, and asks for no speed.
/// assert!((sample.pose.x_m - 0.2).abs() < 0.02 && sample.speed_m_s < 0.1);
/// assert!(state.held_up_s() > 5.0 && state.waited_s() > 5.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct PathProgress<R> {
    config: ProgressConfig<R>,
}

constant_struct!(PathProgress<R> { config: ProgressConfig<R> });

/// Progress of a trajectory, and its waiting time.
///
/// ```
/// use omni_core::path::ProgressState;
/// let state = ProgressState::<f32>::default();
/// assert_eq!((state.waited_s(), state.held_up_s(), state.rate()), (0.0, 0.0, 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ProgressState<R> {
    /// Total waiting time \[s\]: exactly 0 until it first waits, so that until then its time is bit-identical to the
    /// clock's.
    waited: Sum<R>,
    /// The clock at the last step \[s\].
    clock_s: R,
    /// Of its time over the clock's, 0 to 1.
    rate: R,
    held_up_s: R,
}

/// At the start of a trajectory.
impl<R: Real> Default for ProgressState<R> {
    fn default() -> Self {
        Self {
            waited: Sum::of(R::ZERO),
            clock_s: R::ZERO,
            rate: R::ONE,
            held_up_s: R::ZERO,
        }
    }
}

impl<R: Real> ProgressState<R> {
    /// Present delay relative to the plan \[s\].
    #[must_use]
    pub fn waited_s(&self) -> R {
        self.waited.total
    }

    /// Time for which the vehicle has been held up without interruption \[s\]: the trajectory is slower than a tenth of
    /// its rate.
    #[must_use]
    pub fn held_up_s(&self) -> R {
        self.held_up_s
    }

    /// Rate of the trajectory's time, 0 to 1.
    #[must_use]
    pub fn rate(&self) -> R {
        self.rate
    }
}

impl<R: Real> PathProgress<R> {
    /// Of a configuration.
    ///
    /// # Errors
    /// Parameter `lag_m` or `lag_rad`.
    pub fn new(config: ProgressConfig<R>) -> Result<Self, ConfigError> {
        for (name, value) in [("lag_m", config.lag_m), ("lag_rad", config.lag_rad)] {
            within(name, value, 0.001..=100.0, "0.001 to 100")?;
        }
        Ok(Self { config })
    }

    /// Reference pose and motion at a time \[s\] since the start, for a vehicle at `pose`. If time goes backwards, or
    /// is not a number, the previous time is used. A pose that is not finite holds nothing up.
    ///
    /// ```
    /// use omni_core::path::{PathPiece, PathProgress, PathSegment, ProgressConfig, ProgressState, Waypoint};
    /// # let planner = omni_core::examples::planner()?;
    /// # let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 1]);
    /// let ahead = planner.plan(&[Waypoint::at(0.0, 0.0), Waypoint::at(3.0, 0.0)], &mut segments, &mut pieces)?;
    /// let progress = PathProgress::new(ProgressConfig { lag_m: 0.1, lag_rad: 0.3 })?;
    /// let mut state = ProgressState::default();
    /// // A vehicle within 10 cm of where it should be is followed by the clock.
    /// let near = omni_core::geometry::PlanarPose { x_m: 0.05, y_m: 0.0, yaw_rad: 0.0 };
    /// assert_eq!(progress.step(&mut state, &ahead, 0.3, &near), ahead.at(0.3));
    /// assert_eq!(state.waited_s(), 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn step(
        &self,
        state: &mut ProgressState<R>,
        trajectory: &Trajectory<'_, R>,
        time_s: R,
        pose: &PlanarPose<R>,
    ) -> TrajectorySample<R> {
        let passed_s = if time_s > state.clock_s {
            time_s - state.clock_s
        } else {
            R::ZERO
        };
        // The vehicle's present reference.
        let before = trajectory.at(state.clock_s - state.waited.total);
        let wanted = if before.done {
            R::ONE
        } else {
            self.rate_at(&before.pose, pose)
        };
        let most = passed_s / R::of(FULL_S);
        state.rate += (wanted - state.rate).limited(-most, most);
        if state.rate < R::ONE {
            state.waited = state.waited.plus((R::ONE - state.rate) * passed_s);
        }
        state.held_up_s = if state.rate < R::of(HELD_UP) {
            state.held_up_s + passed_s
        } else {
            R::ZERO
        };
        if passed_s > R::ZERO {
            state.clock_s = time_s;
        }
        let now = trajectory.at(state.clock_s - state.waited.total);
        let rate = state.rate;
        let mut sample = now;
        if rate < R::ONE {
            for speed in [
                &mut sample.velocity.vx_m_s,
                &mut sample.velocity.vy_m_s,
                &mut sample.velocity.wz_rad_s,
                &mut sample.speed_m_s,
            ] {
                *speed *= rate;
            }
            sample.acceleration = sample.acceleration.map(|change| change * rate * rate);
        }
        sample
    }

    /// 1 within the lag, 0 from twice that on, in between in proportion.
    fn rate_at(&self, wanted: &PlanarPose<R>, pose: &PlanarPose<R>) -> R {
        let (dx, dy) = (wanted.x_m - pose.x_m, wanted.y_m - pose.y_m);
        let turned = (wanted.yaw_rad - pose.yaw_rad).wrapped_angle().abs();
        let error = max(
            (dx * dx + dy * dy).sqrt() / self.config.lag_m,
            turned / self.config.lag_rad,
        );
        if error.is_finite_real() {
            (R::of(2.0) - error).limited(R::ZERO, R::ONE)
        } else {
            R::ONE
        }
    }
}

#[cfg(test)]
mod tests;
