//! Dead reckoning: the vehicle's pose from the wheels' angles.
//!
//! Each step moves the pose along an arc, exactly for a twist that is constant over the step. The three numbers of the
//! pose are compensated sums (after Neumaier, 1974): in `f32` a step of 0.3 mm at 100 m from the origin would else be
//! rounded to a multiple of 8 micrometres.

use crate::constants::constant_struct;
use crate::error::period;
use crate::geometry::{BodyDisplacement, BodyTwist, Kinematics, PlanarPose, WheelAngles, WheelVelocities};
use crate::sum::Sum;
use crate::{ConfigError, Real};

/// An angle of at most one turn beyond (-pi, pi]. A full turn is subtracted in twice the precision.
fn wrapped<R: Real>(angle: Sum<R>) -> Sum<R> {
    let pi = R::pi();
    let wrapped = if angle.total > pi {
        angle.plus(-R::two_pi()).plus(-R::TURN_REST)
    } else if angle.total <= -pi {
        angle.plus(R::two_pi()).plus(R::TURN_REST)
    } else {
        angle
    };
    // An angle right at the seam may round to the side that does not belong to the range.
    if wrapped.total <= -pi || wrapped.total > pi {
        Sum::of(pi)
    } else {
        wrapped
    }
}

/// Result of an odometry step.
///
/// ```
/// use omni_core::estimate::{Odometry, OdometryState, OdometryStep};
/// use omni_core::geometry::BodyDisplacement;
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.5)?)?;
/// let (odometry, mut state) = (Odometry::new(1e-3)?, OdometryState::default());
/// let mut step = |rad: f64| odometry.step_positions(&mut state, &kinematics, &[rad; 4].into());
/// assert_eq!(step(7.0), OdometryStep::Started);
/// assert_eq!(step(f64::NAN), OdometryStep::Skipped);
/// let OdometryStep::Moved(by) = step(9.0) else { panic!("two positions are known") };
/// assert!((by.dx_m - 2.0 * 0.5).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
// Not `non_exhaustive`: a step moves the pose, has nothing to differ from, or does nothing.
pub enum OdometryStep<R> {
    /// The pose moved by this.
    Moved(BodyDisplacement<R>),
    /// These were the first positions: stored, the pose is unchanged.
    Started,
    /// A reading, or the pose it would have led to, was infinite or NaN: nothing changed.
    Skipped,
}

/// Dead reckoning of a vehicle with `N` wheels. Immutable; the changing state is in [`OdometryState`].
///
/// The maps are passed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
/// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
/// positions are exact.
///
/// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
/// [`WheelLayout::chugo7`](crate::geometry::WheelLayout::chugo7):
///
/// | path | as here | plain sums ([`PlanarPose::moved_by`]) |
/// |---|---|---|
/// | winding and lateral, ending far away | 0.05 mm | 36 mm |
/// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
/// | straight forward | 0.06 mm | 2.6 m |
///
/// From positions instead of velocities the first column is at most 0.14 mm.
///
/// ```
/// use omni_core::estimate::{Odometry, OdometryState, OdometryStep};
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.1)?)?;
/// let odometry = Odometry::new(1e-3)?;
/// let mut state = OdometryState::default();
/// // Encoders start anywhere.
/// let started = odometry.step_positions(&mut state, &kinematics, &[7.0_f64; 7].into());
/// assert_eq!(started, OdometryStep::Started);
/// odometry.step_positions(&mut state, &kinematics, &[10.0, 7.0, 4.0, 10.0, 10.0, 7.0, 4.0].into());
/// assert!((state.pose().x_m - 0.3).abs() < 1e-15);
/// // Velocities will do as well: 3 rad/s for a millisecond.
/// odometry.step_velocities(&mut state, &kinematics, &[3.0, 0.0, -3.0, 3.0, 3.0, 0.0, -3.0].into());
/// assert!((state.pose().x_m - 0.3003).abs() < 1e-15);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Odometry<R, const N: usize> {
    period_s: R,
}

constant_struct!(Odometry<R, const N> { period_s: R });

/// The state of odometry; `default` is at the world's origin with no position read.
///
/// ```
/// use omni_core::estimate::{Odometry, OdometryState};
/// use omni_core::BodyTwist;
/// let (odometry, mut state) = (Odometry::<f32, 4>::new(1e-3)?, OdometryState::default());
/// // A millimetre a thousand times. Added up as they are, `f32` would drift off by its rounding.
/// for _ in 0..1000 {
///     odometry.step_displacement(&mut state, &BodyTwist { vx_m_s: 1.0, vy_m_s: 0.0, wz_rad_s: 0.0 }.over(1e-3));
/// }
/// assert_eq!(state.pose().x_m, 1.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OdometryState<R, const N: usize> {
    x: Sum<R>,
    y: Sum<R>,
    yaw: Sum<R>,
    last_positions: Option<WheelAngles<R, N>>,
}

impl<R: Real, const N: usize> Default for OdometryState<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real, const N: usize> OdometryState<R, N> {
    /// At the origin, facing +x, also for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        let zero = Sum::of(R::ZERO);
        Self {
            x: zero,
            y: zero,
            yaw: zero,
            last_positions: None,
        }
    }

    /// The estimated pose \[m, m, rad\], its yaw in (-pi, pi].
    ///
    /// ```
    /// use omni_core::estimate::{Odometry, OdometryState};
    /// use omni_core::geometry::BodyDisplacement;
    /// let (odometry, mut state) = (Odometry::<f64, 4>::new(1e-3)?, OdometryState::default());
    /// let turn = BodyDisplacement { dx_m: 0.0, dy_m: 0.0, dyaw_rad: 2.0 };
    /// odometry.step_displacement(&mut state, &turn);
    /// odometry.step_displacement(&mut state, &turn);
    /// assert!((state.pose().yaw_rad - (4.0 - core::f64::consts::TAU)).abs() < 1e-15); // 4 rad to the left
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn pose(&self) -> PlanarPose<R> {
        PlanarPose {
            x_m: self.x.total,
            y_m: self.y.total,
            yaw_rad: self.yaw.total,
        }
    }

    /// Sets the pose; false, and nothing changed, if `pose` is not finite. Its yaw is wrapped.
    ///
    /// The last positions stay, so that the next step adds what the wheels turn from here and no jump.
    ///
    /// ```
    /// use omni_core::estimate::OdometryState;
    /// use omni_core::geometry::PlanarPose;
    /// let mut state = OdometryState::<f64, 7>::default();
    /// assert!(state.reset(&PlanarPose { x_m: 2.0, y_m: -1.0, yaw_rad: 7.0 }));
    /// assert!((state.pose().yaw_rad - (7.0 - core::f64::consts::TAU)).abs() < 1e-15);
    /// assert!(!state.reset(&PlanarPose { x_m: f64::NAN, y_m: 0.0, yaw_rad: 0.0 }));
    /// assert_eq!(state.pose().x_m, 2.0);
    /// ```
    pub fn reset(&mut self, pose: &PlanarPose<R>) -> bool {
        let finite = [pose.x_m, pose.y_m, pose.yaw_rad]
            .iter()
            .all(|x| x.is_finite_real());
        if finite {
            self.x = Sum::of(pose.x_m);
            self.y = Sum::of(pose.y_m);
            self.yaw = Sum::of(pose.yaw_rad.wrapped_angle());
        }
        finite
    }

    /// Discards the last positions: the next positions only initialise, as the first did. For encoders that were set to
    /// zero.
    ///
    /// ```
    /// use omni_core::estimate::{Odometry, OdometryState, OdometryStep};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.5)?)?;
    /// let (odometry, mut state) = (Odometry::new(1e-3)?, OdometryState::default());
    /// odometry.step_positions(&mut state, &kinematics, &[700.0; 4].into());
    /// state.forget_positions(); // the encoders are set to zero: no way of -350 m
    /// assert_eq!(odometry.step_positions(&mut state, &kinematics, &[0.0; 4].into()), OdometryStep::Started);
    /// assert_eq!(state.pose().x_m, 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn forget_positions(&mut self) {
        self.last_positions = None;
    }
}

impl<R: Real, const N: usize> Odometry<R, N> {
    /// Odometry stepped every `period_s` \[s\], 1e-6 to 10.
    ///
    /// # Errors
    /// Parameter `period_s` out of its range.
    pub fn new(period_s: R) -> Result<Self, ConfigError> {
        Ok(Self {
            period_s: period(period_s)?,
        })
    }

    /// The core of every step: the pose moves by `displacement`, exactly for a twist that was constant.
    ///
    /// Skipped if the displacement, or the pose after it, is not finite.
    ///
    /// ```
    /// use omni_core::estimate::{Odometry, OdometryState};
    /// use omni_core::BodyTwist;
    /// let odometry = Odometry::<f64, 7>::new(1e-3)?;
    /// let mut state = OdometryState::default();
    /// let twist = BodyTwist { vx_m_s: 2.0, vy_m_s: 0.5, wz_rad_s: 1.0 };
    /// odometry.step_displacement(&mut state, &twist.over(1.0));
    /// // Along the arc, vx sin(wz t) - vy (1 - cos(wz t)), over wz.
    /// let x_m = 2.0 * 1.0_f64.sin() - 0.5 * (1.0 - 1.0_f64.cos());
    /// assert!((state.pose().x_m - x_m).abs() < 1e-15);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step_displacement(
        &self,
        state: &mut OdometryState<R, N>,
        displacement: &BodyDisplacement<R>,
    ) -> OdometryStep<R> {
        let [dx, dy] = displacement.in_world(state.yaw.total);
        let (x, y) = (state.x.plus(dx), state.y.plus(dy));
        let yaw = wrapped(state.yaw.plus(displacement.dyaw_rad.wrapped_angle()));
        if !(x.is_finite() && y.is_finite() && yaw.is_finite()) {
            return OdometryStep::Skipped;
        }
        (state.x, state.y, state.yaw) = (x, y, yaw);
        OdometryStep::Moved(*displacement)
    }

    /// One period at the actuator velocities `velocities` \[rad/s\], held constant over it.
    ///
    /// Skipped if the resulting twist is not finite.
    ///
    /// ```
    /// use omni_core::estimate::{Odometry, OdometryState};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::omni(0.5, 0.0, 0.1)?)?;
    /// let (odometry, mut state) = (Odometry::new(0.01)?, OdometryState::default());
    /// odometry.step_velocities(&mut state, &kinematics, &[10.0; 4].into());
    /// assert!((state.pose().yaw_rad - 10.0 * 0.1 / 0.5 * 0.01).abs() < 1e-15); // all wheels positive: to the left
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step_velocities(
        &self,
        state: &mut OdometryState<R, N>,
        kinematics: &Kinematics<R, N>,
        velocities: &WheelVelocities<R, N>,
    ) -> OdometryStep<R> {
        self.step_twist(state, &kinematics.forward(velocities))
    }

    /// One period of a motion that is known already, as from [`Kinematics::forward`].
    ///
    /// ```
    /// use omni_core::estimate::{Odometry, OdometryState};
    /// use omni_core::BodyTwist;
    /// let (odometry, mut state) = (Odometry::<f64, 3>::new(0.25)?, OdometryState::default());
    /// odometry.step_twist(&mut state, &BodyTwist { vx_m_s: 2.0, ..BodyTwist::ZERO });
    /// assert_eq!(state.pose().x_m, 2.0 * 0.25);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step_twist(&self, state: &mut OdometryState<R, N>, twist: &BodyTwist<R>) -> OdometryStep<R> {
        self.step_displacement(state, &twist.over(self.period_s))
    }

    /// From the actuator positions `positions` \[rad\], unwrapped, of the last call to these; the first positions only
    /// start. `kinematics` may leave wheels out ([`Kinematics::excluding`]).
    ///
    /// Skipped if one is not finite. The next finite positions then compensate: the rotation since the last valid row
    /// counts as one arc.
    ///
    /// ```
    /// use omni_core::estimate::{Odometry, OdometryState};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.5)?)?;
    /// let (odometry, mut state) = (Odometry::new(1e-3)?, OdometryState::default());
    /// for rad in [1.0, 2.0, f64::NAN, 4.0] {
    ///     odometry.step_positions(&mut state, &kinematics, &[rad; 4].into());
    /// }
    /// assert!((state.pose().x_m - 0.5 * (4.0 - 1.0)).abs() < 1e-12); // the missing one costs nothing
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step_positions(
        &self,
        state: &mut OdometryState<R, N>,
        kinematics: &Kinematics<R, N>,
        positions: &WheelAngles<R, N>,
    ) -> OdometryStep<R> {
        if !positions.is_finite() {
            return OdometryStep::Skipped;
        }
        let step = match self.increments(state, positions) {
            Some(increments) => self.step_displacement(state, &kinematics.displacement(&increments)),
            None => OdometryStep::Started,
        };
        if step != OdometryStep::Skipped {
            state.last_positions = Some(*positions);
        }
        step
    }

    /// Rotation of each actuator \[rad\] from the last step to `positions`; none before the first. Changes nothing.
    ///
    /// For who needs them besides the pose, as [`PoseCovariance`](crate::estimate::PoseCovariance)
    /// does: to be called before the step.
    ///
    /// ```
    /// use omni_core::estimate::{Odometry, OdometryState};
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
    /// let (odometry, mut state) = (Odometry::new(1e-3)?, OdometryState::default());
    /// assert_eq!(odometry.increments(&state, &[1.0, 2.0, 3.0].into()), None);
    /// odometry.step_positions(&mut state, &kinematics, &[1.0, 2.0, 3.0].into());
    /// assert_eq!(odometry.increments(&state, &[1.5, 1.0, 3.0].into()), Some([0.5, -1.0, 0.0].into()));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn increments(
        &self,
        state: &OdometryState<R, N>,
        positions: &WheelAngles<R, N>,
    ) -> Option<WheelAngles<R, N>> {
        state.last_positions.map(|last| {
            let mut increments = *positions;
            for (increment, last) in increments.rad.iter_mut().zip(last.rad) {
                *increment -= last;
            }
            increments
        })
    }
}

#[cfg(test)]
mod tests;
