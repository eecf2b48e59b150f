//! Configuration, state and sample of the loops.

use super::{Overload, RestState};
use crate::Real;
use crate::geometry::{WheelTorques, WheelVelocities};
use crate::loops::{Coordination, PidConfig};
use crate::motor::{TorqueLimit, TorqueRanges};

/// Everything that the loops of `N` wheels need to know; checked by
/// [`WheelController::new`](crate::loops::WheelController::new) or [`crate::loops::Controller::new`].
///
/// ```
/// use omni_core::loops::WheelController;
/// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// let gains = PidGains { kp_n_m_s_rad: 0.25, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// let wheels = WheelController::new(WheelControlConfig {
///     pid: PidConfig::new(gains, 1e-3),
///     limits: [TorqueLimit::constant(1.0)?, TorqueLimit::constant(0.5)?], // one loop, two motors
///     coordination: Coordination::independent(),
/// })?;
/// let sample = wheels.step(&mut ControlState::default(), &[8.0, -8.0].into(), &[0.0; 2].into());
/// assert_eq!(sample.applied.n_m, [1.0, -0.5]); // 0.25 * 8 is too much for either
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelControlConfig<R, const N: usize> {
    /// The loop, the same for every wheel. Its `output` limits are ignored: the actuators' count.
    pub pid: PidConfig<R>,
    /// Torque limit of each actuator.
    pub limits: [TorqueLimit<R>; N],
    /// Coordination of the wheels.
    pub coordination: Coordination<R>,
}

/// The state of the loops between steps; `default` is a fresh start.
///
/// ```
/// use omni_core::loops::WheelController;
/// use omni_core::ControlState;
/// # let mut config = omni_core::examples::loops(0.0, 2.0, 2.0)?;
/// config.pid.period_s = 0.25;
/// let wheels = WheelController::new(config)?;
/// let mut state = ControlState::default();
/// for _ in 0..2 {
///     wheels.step(&mut state, &[1.0, 0.5].into(), &[0.0; 2].into());
/// }
/// assert_eq!(state.integral_n_m, [2.0 * 0.25 * 2.0, 2.0 * 0.25 * 1.0]); // ki dt times the sum of the errors
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct ControlState<R, const N: usize> {
    /// Integral term of each wheel \[N.m\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub integral_n_m: [R; N],
    /// Derivative term of each wheel \[N.m\], after its filter.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub derivative_n_m: [R; N],
    /// Reference of the step before, as realised \[rad/s\]; 0 without derivative and feed-forward.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub last_reference_rad_s: [R; N],
    /// Measurement of the step before \[rad/s\]; 0 without derivative and feed-forward.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub last_measured_rad_s: [R; N],
    /// The wheel has a step to compare with; only loops with a derivative or a feed-forward set it.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub started: [bool; N],
    /// The overloaded wheels, and the time for which each other wheel has been beyond a limit.
    pub overload: Overload,
    /// Progress of the torque's end while every reference was 0.
    pub(crate) rest: RestState<R>,
}

impl<R: Real, const N: usize> Default for ControlState<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real, const N: usize> ControlState<R, N> {
    /// A fresh start, also for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        let zero = [R::ZERO; N];
        Self {
            integral_n_m: zero,
            derivative_n_m: zero,
            last_reference_rad_s: zero,
            last_measured_rad_s: zero,
            started: [false; N],
            overload: Overload::new(),
            rest: RestState::new(),
        }
    }

    /// A fresh start of the loops, with the remaining hold at rest: another law that takes over holds no longer than
    /// this one.
    ///
    /// ```
    /// use omni_core::ControlState;
    /// let mut state = ControlState::<f64, 4>::new();
    /// state.integral_n_m = [0.3; 4];
    /// assert_eq!(state.afresh().integral_n_m, [0.0; 4]);
    /// ```
    #[must_use]
    pub fn afresh(&self) -> Self {
        Self {
            rest: self.rest,
            ..Self::new()
        }
    }

    /// Every wheel has a step behind it.
    #[inline]
    pub(in crate::loops) fn all_started(&self) -> bool {
        let mut all = true;
        for started in self.started {
            all &= started;
        }
        all
    }
}

/// Every signal of one control step, per wheel in the layout's order. Velocities \[rad/s\] and torques \[N.m\] are the
/// actuators'. Nothing in it is ever NaN.
///
/// ```
/// use omni_core::loops::WheelController;
/// use omni_core::ControlState;
/// # let mut config = omni_core::examples::loops(0.5, 2.0, 2.0)?;
/// config.pid.period_s = 0.125;
/// let wheels = WheelController::new(config)?;
/// let sample = wheels.step(&mut ControlState::default(), &[2.0, 8.0].into(), &[0.0, 0.0].into());
/// assert_eq!((sample.p_n_m[0], sample.i_n_m[0]), (0.5 * 2.0, 2.0 * 0.125 * 2.0));
/// assert_eq!(sample.requested.n_m, [1.5, 6.0]);
/// assert_eq!((sample.applied.n_m, sample.saturated), ([1.5, 2.0], [false, true])); // limits of 2 N.m
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
// Not `non_exhaustive`: a frame of omni-link and a struct of C hold it field by field, and have to notice one more.
#[repr(C)]
pub struct WheelSample<R, const N: usize> {
    /// Reference r as commanded, before any reduction.
    pub reference: WheelVelocities<R, N>,
    /// Measurement y; 0 for a released wheel.
    pub measured: WheelVelocities<R, N>,
    /// The wheel was controlled. One without a usable measurement is released: no torque, its loop
    /// starts afresh. When the torque has `ended` no wheel is controlled.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub active: [bool; N],
    /// Proportional term, formed with the reference as reduced by `common_factor` under
    /// [`Saturation::ScaleReferences`](crate::loops::Saturation::ScaleReferences).
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub p_n_m: [R; N],
    /// Integral term, likewise.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub i_n_m: [R; N],
    /// Derivative term, likewise.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub d_n_m: [R; N],
    /// Feed-forward, likewise.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub ff_n_m: [R; N],
    /// Torque that the loops request with the whole reference: the torque that actuators without limits would apply.
    pub requested: WheelTorques<R, N>,
    /// Torque to apply, always within the limits.
    pub applied: WheelTorques<R, N>,
    /// Limits at the present velocities.
    pub range: TorqueRanges<R, N>,
    /// The requested torque is outside the limits.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub saturated: [bool; N],
    /// Factor on all torques ([`Saturation::ScaleTorques`](crate::loops::Saturation::ScaleTorques)) or all references
    /// ([`Saturation::ScaleReferences`](crate::loops::Saturation::ScaleReferences)), 0 to 1; 1 under
    /// [`Saturation::Clip`](crate::loops::Saturation::Clip).
    pub common_factor: R,
    /// Every reference has been 0 for long enough that all torque has ended: see
    /// [`Rest`](crate::loops::Rest). Bridges that are driven by voltage are then opened or shorted,
    /// because the voltage for no torque follows from a velocity that may be measured wrongly.
    pub ended: bool,
    /// And the windings of all motors are to be shorted: [`Rest::short_windings`](crate::loops::Rest::short_windings).
    pub shorted: bool,
}

impl<R: Real, const N: usize> WheelSample<R, N> {
    /// At rest, to be written to by [`WheelController::step_into`](crate::loops::WheelController::step_into):
    /// all zero but the common factor, which is 1.
    #[must_use]
    pub const fn zero() -> Self {
        let zero = [R::ZERO; N];
        Self {
            reference: WheelVelocities { rad_s: zero },
            measured: WheelVelocities { rad_s: zero },
            active: [false; N],
            p_n_m: zero,
            i_n_m: zero,
            d_n_m: zero,
            ff_n_m: zero,
            requested: WheelTorques { n_m: zero },
            applied: WheelTorques { n_m: zero },
            range: TorqueRanges {
                lower_n_m: zero,
                upper_n_m: zero,
            },
            saturated: [false; N],
            common_factor: R::ONE,
            ended: false,
            shorted: false,
        }
    }

    /// Ends all torque: no wheel is controlled, and nothing is asked for. `shorted` says whether
    /// the windings of all motors are to be shorted.
    ///
    /// ```
    /// use omni_core::loops::WheelSample;
    /// let mut sample = WheelSample::<f32, 2>::zero();
    /// (sample.active, sample.applied.n_m) = ([true; 2], [1.5, -0.5]);
    /// sample.end(true);
    /// assert_eq!((sample.active, sample.applied.n_m), ([false; 2], [0.0; 2]));
    /// assert!(sample.ended && sample.shorted);
    /// ```
    pub fn end(&mut self, shorted: bool) {
        let zero = R::zero();
        for i in 0..N {
            (self.active[i], self.saturated[i]) = (false, false);
            (self.p_n_m[i], self.i_n_m[i], self.d_n_m[i], self.ff_n_m[i]) = (zero, zero, zero, zero);
            (self.requested.n_m[i], self.applied.n_m[i]) = (zero, zero);
            (self.range.lower_n_m[i], self.range.upper_n_m[i]) = (zero, zero);
        }
        self.common_factor = R::one();
        (self.ended, self.shorted) = (true, shorted);
    }
}
