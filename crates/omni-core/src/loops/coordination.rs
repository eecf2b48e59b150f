//! Coordination laws: joint behaviour of the wheels when one of them saturates.
//!
//! Two independent choices: the method that brings torques within limits ([`Saturation`]), and the error that the
//! integrals accumulate ([`Integral`]). Every law is closed form and O(N).

#[cfg(test)]
mod tests;

use crate::constants::{constant_enum, constant_struct};
use crate::motor::TorqueRanges;
use crate::{ConfigError, Real};

/// How requested torques are brought within the limits.
///
/// ```
/// use omni_core::loops::{Integral, Saturation, WheelController};
/// use omni_core::{ControlState, Coordination};
/// # let mut config = omni_core::examples::loops(0.125, 0.0, 1.0)?;
/// let mut applied = |saturation| {
///     config.coordination = Coordination::new(saturation, Integral::PerWheel);
///     let wheels = WheelController::new(config).expect("valid");
///     // Errors of 16 and -8 rad/s at a gain of 0.125 ask for 2 and -1 N.m; 1 N.m is the limit.
///     wheels.step(&mut ControlState::default(), &[16.0, -16.0].into(), &[0.0, -8.0].into()).applied.n_m
/// };
/// assert_eq!(applied(Saturation::Clip), [1.0, -1.0]);
/// assert_eq!(applied(Saturation::ScaleTorques), [1.0, -0.5]); // half of each torque
/// assert_eq!(applied(Saturation::ScaleReferences { floor: 0.0 }), [1.0, 0.0]); // half of each reference: 8 and -8
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C, u8)]
#[non_exhaustive]
pub enum Saturation<R> {
    /// Each wheel is cut to its own limit; the others do not notice.
    Clip,
    /// Eqs. (11), (12) with |torque|: all torques are multiplied by the factor of the wheel
    /// furthest over its limit. Ratios of torques are kept. The integrals react as `anti_windup`
    /// says; with [`None`](crate::loops::AntiWindup::None) they do not.
    ScaleTorques,
    /// All references are multiplied by one factor s, as large as keeps every wheel within its
    /// limit, and the loops see the error against the reduced reference (a conditioned controller
    /// shared by the wheels). Ratios of velocities are kept and nothing winds up.
    ScaleReferences {
        /// The factor never falls below this, 0 to 1: a wheel may then saturate. With 0, one blocked wheel stops all.
        floor: R,
    },
}

constant_enum!(Saturation<R> { Clip, ScaleTorques, ScaleReferences { floor } });

/// The error that the integrals accumulate.
///
/// ```
/// use omni_core::loops::{Integral, Saturation};
/// use omni_core::{BodyTwist, ControlState, Controller, Coordination, WheelLayout};
/// # let mut config = omni_core::examples::loops(0.0, 5.0, 2.0)?;
/// config.pid.period_s = 0.1;
/// let layout = WheelLayout::mecanum4(0.6, 0.4, 0.1)?;
/// for (integral, expected) in [(Integral::PerWheel, 0.5), (Integral::Shared, 0.0)] {
///     config.coordination = Coordination::new(Saturation::Clip, integral);
///     let controller = Controller::new(&layout, config)?;
///     let mut state = ControlState::default();
///     let ahead = BodyTwist { vx_m_s: 1.0, ..BodyTwist::ZERO }; // 10 rad/s at every wheel
///     // Front against rear is no motion of the vehicle; ki dt is 0.5.
///     controller.step(&mut state, &ahead, &[9.0, 9.0, 11.0, 11.0].into());
///     assert!((state.integral_n_m[0] - expected).abs() < 1e-12);
/// }
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum Integral {
    /// Each wheel its own.
    PerWheel,
    /// The part of the errors that a motion of the vehicle explains, so that redundant wheels cannot wind up against
    /// each other. Needs a layout.
    Shared,
}

constant_enum!(Integral { PerWheel, Shared });

/// A coordination policy: one choice of each.
///
/// ```
/// use omni_core::loops::{Integral, Saturation};
/// use omni_core::Coordination;
/// let policy = Coordination::<f64>::preset("scale_references").expect("one of Coordination::<f64>::PRESETS");
/// assert_eq!(policy.saturation, Saturation::ScaleReferences { floor: 0.3 });
/// assert_eq!(policy.integral, Integral::PerWheel);
/// let patient = Coordination::new(Saturation::ScaleReferences { floor: 0.5 }, Integral::Shared);
/// assert_eq!(patient.saturation, Saturation::ScaleReferences { floor: 0.5 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct Coordination<R> {
    /// How torques are brought within limits.
    pub saturation: Saturation<R>,
    /// The error that the integrals accumulate.
    pub integral: Integral,
}

constant_struct!(Coordination<R> { saturation: Saturation<R>, integral: Integral });

impl<R: Real> Coordination<R> {
    /// Names that [`Coordination::preset`] knows. A preset's meaning never changes; a new law receives a new name.
    pub const PRESETS: [&'static str; 4] = [
        "independent",
        "scale_torques",
        "scale_references",
        "shared_integral",
    ];

    /// A policy of these two choices; whatever else there will be to choose stays as in [`Coordination::independent`].
    #[must_use]
    pub const fn new(saturation: Saturation<R>, integral: Integral) -> Self {
        Self { saturation, integral }
    }

    /// The policy of that name, one of [`Coordination::PRESETS`]; none for any other.
    ///
    /// ```
    /// use omni_core::Coordination;
    /// assert_eq!(Coordination::<f64>::PRESETS.map(|name| Coordination::<f64>::preset(name).is_some()), [true; 4]);
    /// assert_eq!(Coordination::<f64>::preset("synchronized"), None); // British spelling
    /// ```
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        match name {
            "independent" => Some(Self::independent()),
            "scale_torques" => Some(Self::scale_torques()),
            "scale_references" => Some(Self::scale_references()),
            "shared_integral" => Some(Self::shared_integral()),
            _ => None,
        }
    }

    /// Each wheel on its own: the paper's "general controller".
    ///
    /// ```
    /// use omni_core::loops::WheelController;
    /// use omni_core::{ControlState, Coordination};
    /// # let mut config = omni_core::examples::loops(0.125, 0.0, 1.0)?;
    /// config.coordination = Coordination::independent();
    /// let wheels = WheelController::new(config)?; // limits of 1 N.m
    /// let sample = wheels.step(&mut ControlState::default(), &[16.0, 4.0].into(), &[0.0; 2].into());
    /// assert_eq!(sample.requested.n_m, [2.0, 0.5]);
    /// assert_eq!(sample.applied.n_m, [1.0, 0.5]); // the second gives what it was asked for
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn independent() -> Self {
        Self {
            saturation: Saturation::Clip,
            integral: Integral::PerWheel,
        }
    }

    /// Eqs. (10)-(12) literally. It does not synchronise, whatever the text says: see docs/paper.md.
    ///
    /// ```
    /// use omni_core::loops::WheelController;
    /// use omni_core::{ControlState, Coordination};
    /// # let mut config = omni_core::examples::loops(0.125, 4.0, 1.0)?;
    /// (config.pid.period_s, config.coordination) = (0.0625, Coordination::scale_torques());
    /// let wheels = WheelController::new(config)?; // limits of 1 N.m
    /// let mut state = ControlState::default();
    /// let sample = wheels.step(&mut state, &[8.0, 2.0].into(), &[0.0; 2].into());
    /// assert_eq!(sample.requested.n_m, [3.0, 0.75]);
    /// assert_eq!(sample.common_factor, 1.0 / 3.0);
    /// assert_eq!(state.integral_n_m, [2.0, 0.5]); // 4 * 0.0625 s of the whole errors: without knowledge of the limit
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn scale_torques() -> Self {
        Self {
            saturation: Saturation::ScaleTorques,
            integral: Integral::PerWheel,
        }
    }

    /// The method in the text of section 3.2: references reduced together, to no less than 0.3 of the request.
    ///
    /// ```
    /// use omni_core::loops::WheelController;
    /// use omni_core::{ControlState, Coordination};
    /// # let mut config = omni_core::examples::loops(0.125, 0.0, 1.0)?;
    /// config.coordination = Coordination::scale_references();
    /// let wheels = WheelController::new(config)?; // limits of 1 N.m
    /// // 8 N.m would need an eighth of the references. No less than 0.3 is taken, and wheel 1 saturates.
    /// let sample = wheels.step(&mut ControlState::default(), &[64.0, 8.0].into(), &[0.0; 2].into());
    /// assert_eq!((sample.common_factor, sample.applied.n_m[0]), (0.3, 1.0));
    /// assert!((sample.applied.n_m[1] - 0.3 * 1.0).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn scale_references() -> Self {
        Self {
            saturation: Saturation::ScaleReferences { floor: R::of(0.3) },
            integral: Integral::PerWheel,
        }
    }

    /// Each wheel cut to its own limit, one integral for the vehicle's motion: the least heat. Needs a layout, as
    /// [`crate::loops::Controller`] has.
    ///
    /// ```
    /// use omni_core::{BodyTwist, ControlState, Controller, Coordination, WheelLayout};
    /// # let mut config = omni_core::examples::loops(0.0, 5.0, 2.0)?;
    /// (config.pid.period_s, config.coordination) = (0.1, Coordination::shared_integral());
    /// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config)?;
    /// let mut state = ControlState::default();
    /// let ahead = BodyTwist { vx_m_s: 1.0, ..BodyTwist::ZERO }; // 10 rad/s at every wheel
    /// // Wheel 1 alone lags by 2 rad/s: three quarters of that can be motion, in which the others take part.
    /// controller.step(&mut state, &ahead, &[8.0, 10.0, 10.0, 10.0].into());
    /// for (integral, expected) in state.integral_n_m.iter().zip([1.5, -0.5, 0.5, 0.5]) {
    ///     assert!((integral - 5.0 * 0.1 * expected).abs() < 1e-12);
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn shared_integral() -> Self {
        Self {
            saturation: Saturation::Clip,
            integral: Integral::Shared,
        }
    }

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        match self.saturation {
            Saturation::ScaleReferences { floor } if !(floor >= R::zero() && floor <= R::one()) => {
                Err(ConfigError::new("floor", floor.as_f64(), "0 to 1"))
            }
            _ => Ok(()),
        }
    }
}

/// The common factor c = min c_i of eqs. (11), (12), with |torque| so that wheels turning backwards are also limited.
///
/// 1 if no torque of `requested_n_m` exceeds its range, 0 if one does whose range ends at 0.
///
/// ```
/// use omni_core::loops::torque_factor;
/// use omni_core::motor::TorqueRanges;
/// let ranges = TorqueRanges { lower_n_m: [-0.2; 2], upper_n_m: [0.2; 2] };
/// assert_eq!(torque_factor(&[0.1, -0.4], &ranges), 0.5);
/// ```
pub fn torque_factor<R: Real, const N: usize>(requested_n_m: &[R; N], ranges: &TorqueRanges<R, N>) -> R {
    let mut factor = R::one();
    for (i, &torque) in requested_n_m.iter().enumerate() {
        let clipped = ranges.clip(i, torque);
        if clipped != torque {
            // The torque is not zero, because zero is always within a range.
            let c = clipped / torque;
            factor = if c < factor { c } else { factor };
        }
    }
    factor
}

/// The common speed factor of [`Saturation::ScaleReferences`]: the largest s in `floor..=1` with every
/// torque short of the limit that its own reference pushes it towards; `floor` if there is none.
///
/// `requested_n_m`: torque of each wheel for its whole reference. `slopes_n_m`: the part of it that
/// is proportional to the reference, so that the torque for s times the reference is
/// `requested - (1 - s) slope`. A wheel without reference (slope 0) is excluded. Limits on the other
/// side are left to the final clip. Closed form: `u_i = 1 - (requested - limit) / slope`.
///
/// ```
/// use omni_core::loops::reference_factor;
/// use omni_core::motor::TorqueRanges;
/// let ranges = TorqueRanges { lower_n_m: [-1.0; 2], upper_n_m: [1.0; 2] };
/// // Wheel 1 asks 2.5 of which 3 are its reference's: its limit of 1 is at s = 0.5; wheel 2 has room to spare.
/// assert_eq!(reference_factor(&[2.5, -0.2], &[3.0, -0.4], &ranges, 0.0), 0.5);
/// ```
#[inline]
pub fn reference_factor<R: Real, const N: usize>(
    requested_n_m: &[R; N],
    slopes_n_m: &[R; N],
    ranges: &TorqueRanges<R, N>,
    floor: R,
) -> R {
    factors(requested_n_m, slopes_n_m, ranges, floor, |_| false).0
}

/// [`reference_factor`] of all wheels, and of the `overloaded` ones alone: wheel i is bit i.
#[inline]
pub(crate) fn reference_factors<R: Real, const N: usize>(
    requested_n_m: &[R; N],
    slopes_n_m: &[R; N],
    ranges: &TorqueRanges<R, N>,
    floor: R,
    overloaded: u32,
) -> (R, R) {
    let lasts = |i: usize| overloaded & (1 << i) != 0;
    factors(requested_n_m, slopes_n_m, ranges, floor, lasts)
}

#[inline(always)]
fn factors<R: Real, const N: usize>(
    requested_n_m: &[R; N],
    slopes_n_m: &[R; N],
    ranges: &TorqueRanges<R, N>,
    floor: R,
    lasts: impl Fn(usize) -> bool,
) -> (R, R) {
    let (mut factor, mut lasting) = (R::one(), R::one());
    for i in 0..N {
        let (requested, slope) = (requested_n_m[i], slopes_n_m[i]);
        let limit = if slope > R::zero() {
            ranges.upper_n_m[i]
        } else {
            ranges.lower_n_m[i]
        };
        let over = requested - limit;
        // Same sign: the reference pushes over the limit. A slope of zero has no sign.
        if over * slope > R::zero() {
            let u = R::one() - over / slope;
            factor = if u < factor { u } else { factor };
            if lasts(i) {
                lasting = if u < lasting { u } else { lasting };
            }
        }
    }
    let raised = |factor| if factor < floor { floor } else { factor };
    (raised(factor), raised(lasting))
}
