//! What wheels do together when one of them saturates.
//!
//! Two choices that do not depend on each other: how torques are brought within limits ([`Saturation`]), and which
//! error the integrals take in ([`Integral`]). Every law is closed form and O(N).

use crate::Real;
use crate::error::ConfigError;

/// How requested torques are brought within the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Saturation<R> {
    /// Each wheel is cut to its own limit; the others do not notice.
    Clip,
    /// Eqs. (11), (12) with |torque|: all torques are multiplied by the factor of the wheel furthest over its limit.
    /// Ratios of torques are kept. The integrals are not told.
    ScaleTorques,
    /// All references are multiplied by one factor s, as large as keeps every wheel within its limit, and the loops see
    /// the error against the reduced reference (a conditioned controller shared by the wheels). Ratios of velocities are
    /// kept and nothing winds up.
    ScaleReference {
        /// The factor never falls below this, 0 to 1: a wheel may then saturate. 0 lets one blocked wheel stop all.
        floor: R,
    },
}

/// Which error the integrals take in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integral {
    /// Each wheel its own.
    PerWheel,
    /// The part of the errors that a motion of the vehicle explains, so that redundant wheels cannot wind up against
    /// each other. Needs a layout.
    Shared,
}

/// A coordination policy: one choice of each.
///
/// ```
/// use omni_core::{Coordination, Integral, Saturation};
/// let policy = Coordination::<f64>::preset("synchronised").expect("one of Coordination::<f64>::PRESETS");
/// assert_eq!(policy.saturation, Saturation::ScaleReference { floor: 0.3 });
/// assert_eq!(policy.integral, Integral::PerWheel);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordination<R> {
    /// How torques are brought within limits.
    pub saturation: Saturation<R>,
    /// Which error the integrals take in.
    pub integral: Integral,
}

impl<R: Real> Coordination<R> {
    /// Names that [`Coordination::preset`] knows. A preset's meaning never changes; a new law gets a new name.
    pub const PRESETS: [&'static str; 4] = ["independent", "paper", "synchronised", "load_sharing"];

    /// The policy of that name, if there is one.
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        match name {
            "independent" => Some(Self::independent()),
            "paper" => Some(Self::paper()),
            "synchronised" => Some(Self::synchronised()),
            "load_sharing" => Some(Self::load_sharing()),
            _ => None,
        }
    }

    /// Each wheel on its own: the paper's "general controller".
    #[must_use]
    pub fn independent() -> Self {
        Self {
            saturation: Saturation::Clip,
            integral: Integral::PerWheel,
        }
    }

    /// Eqs. (10)-(12) literally. It does not synchronise, whatever the text says: see docs/paper.md.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            saturation: Saturation::ScaleTorques,
            integral: Integral::PerWheel,
        }
    }

    /// What the text of section 3.2 describes: references reduced together, to no less than 0.3 of what was asked.
    #[must_use]
    pub fn synchronised() -> Self {
        Self {
            saturation: Saturation::ScaleReference { floor: R::of(0.3) },
            integral: Integral::PerWheel,
        }
    }

    /// Each wheel cut to its own limit, one integral for the vehicle's motion: the least heat.
    #[must_use]
    pub fn load_sharing() -> Self {
        Self {
            saturation: Saturation::Clip,
            integral: Integral::Shared,
        }
    }

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        match self.saturation {
            Saturation::ScaleReference { floor } if !(floor >= R::zero() && floor <= R::one()) => {
                Err(ConfigError::new("floor", floor.as_f64(), "0 to 1"))
            }
            _ => Ok(()),
        }
    }
}

/// Torque limits of one wheel at its present velocity \[N.m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueRange<R> {
    /// Lowest torque, <= 0.
    pub lower_n_m: R,
    /// Highest torque, >= 0.
    pub upper_n_m: R,
}

impl<R: Real> TorqueRange<R> {
    /// No limits at all: infinite.
    #[must_use]
    pub fn unlimited() -> Self {
        let infinite = R::one() / R::zero();
        Self {
            lower_n_m: -infinite,
            upper_n_m: infinite,
        }
    }

    /// Nothing but 0: a wheel that is let go.
    #[must_use]
    pub fn none() -> Self {
        Self {
            lower_n_m: R::zero(),
            upper_n_m: R::zero(),
        }
    }

    /// The range with both ends brought within +-`torque_n_m` >= 0.
    #[must_use]
    pub fn capped(&self, torque_n_m: R) -> Self {
        Self {
            lower_n_m: self.lower_n_m.limited(-torque_n_m, torque_n_m),
            upper_n_m: self.upper_n_m.limited(-torque_n_m, torque_n_m),
        }
    }

    /// Is `torque_n_m` outside?
    #[must_use]
    pub fn exceeded_by(&self, torque_n_m: R) -> bool {
        torque_n_m > self.upper_n_m || torque_n_m < self.lower_n_m
    }

    /// `torque_n_m` cut to the range.
    #[must_use]
    pub fn clip(&self, torque_n_m: R) -> R {
        torque_n_m.limited(self.lower_n_m, self.upper_n_m)
    }
}

/// The common factor c = min c_i of eqs. (11), (12), with |torque| so that wheels turning backwards are limited too.
///
/// 1 where no torque of `requested_n_m` exceeds its range, 0 where one does whose range ends at 0.
///
/// ```
/// use omni_core::{TorqueRange, coordination::torque_factor};
/// let range = TorqueRange { lower_n_m: -0.2, upper_n_m: 0.2 };
/// assert_eq!(torque_factor(&[0.1, -0.4], &[range; 2]), 0.5);
/// ```
pub fn torque_factor<R: Real, const N: usize>(requested_n_m: &[R; N], ranges: &[TorqueRange<R>; N]) -> R {
    let mut factor = R::one();
    for (&torque, range) in requested_n_m.iter().zip(ranges) {
        if range.exceeded_by(torque) {
            // The limit on the torque's own side; the torque is not zero, because zero is always within a range.
            let c = range.clip(torque) / torque;
            factor = if c < factor { c } else { factor };
        }
    }
    factor
}

/// The common speed factor of [`Saturation::ScaleReference`]: the largest s in `floor..=1` with every torque
/// `offsets + s * slopes` short of the limit that its own reference pushes it towards; `floor` where there is none.
///
/// `offsets_n_m`: torque of each wheel were its reference zero. `slopes_n_m`: torque added by its whole reference.
/// A wheel without reference (slope 0) has no say. Limits on the other side are left to the final clip.
///
/// ```
/// use omni_core::{TorqueRange, coordination::reference_factor};
/// let range = TorqueRange { lower_n_m: -1.0, upper_n_m: 1.0 };
/// // Wheel 1 asks -0.5 + 3 s and reaches its limit of 1 at s = 0.5; wheel 2 turns backwards with room to spare.
/// assert_eq!(reference_factor(&[-0.5, 0.2], &[3.0, -0.4], &[range; 2], 0.0), 0.5);
/// ```
pub fn reference_factor<R: Real, const N: usize>(
    offsets_n_m: &[R; N],
    slopes_n_m: &[R; N],
    ranges: &[TorqueRange<R>; N],
    floor: R,
) -> R {
    let mut factor = R::one();
    for ((&a, &b), range) in offsets_n_m.iter().zip(slopes_n_m).zip(ranges) {
        let limit = if b > R::zero() {
            range.upper_n_m
        } else if b < R::zero() {
            range.lower_n_m
        } else {
            continue;
        };
        let u = (limit - a) / b;
        factor = if u < factor { u } else { factor };
    }
    if factor < floor { floor } else { factor }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn symmetric(limit: f64) -> TorqueRange<f64> {
        TorqueRange {
            lower_n_m: -limit,
            upper_n_m: limit,
        }
    }

    #[test]
    fn torques_of_wheels_that_turn_backwards_are_limited_too() {
        // The hazard of eq. (11) as printed (no absolute value): -392.26 mN.m would pass the test tau <= tau_max.
        let requested = [100.0, -392.26, 250.0, 180.0, 90.0, 60.0, 120.0];
        let factor = torque_factor(&requested, &[symmetric(196.13); 7]);
        assert_eq!(factor, 0.5);
        assert_eq!(requested[1] * factor, -196.13);
    }

    #[test]
    fn an_exhausted_wheel_stops_all_under_equation_12_and_none_above_the_floor() {
        let ranges = [
            TorqueRange {
                lower_n_m: -1.0,
                upper_n_m: 0.0,
            },
            symmetric(1.0),
        ];
        assert_eq!(torque_factor(&[0.5, 0.5], &ranges), 0.0);
        assert_eq!(reference_factor(&[0.5, 0.0], &[1.0, 1.0], &ranges, 0.3), 0.3);
    }

    proptest! {
        #[test]
        fn torque_ratios_are_kept_and_the_worst_wheel_is_at_its_limit(
            requested in prop::array::uniform7(-5.0..5.0_f64), limits in prop::array::uniform7(0.01..3.0_f64),
        ) {
            let ranges = limits.map(symmetric);
            let c = torque_factor(&requested, &ranges);
            let fullest = requested.iter().zip(limits).map(|(t, l)| (c * t).abs() / l).fold(0.0, f64::max);
            prop_assert!(fullest <= 1.0 + 1e-15); // one division, one multiplication
            prop_assert!(c == 1.0 || fullest >= 1.0 - 1e-15);
        }

        #[test]
        fn the_reference_factor_is_the_largest_that_no_wheel_s_own_reference_overdrives(
            a in prop::array::uniform7(-0.9..0.9_f64), b in prop::array::uniform7(-5.0..5.0_f64),
            limits in prop::array::uniform7(1.0..3.0_f64),
        ) {
            // Offsets within limits: some factor of 0 or more then serves every wheel.
            let ranges = limits.map(symmetric);
            let s = reference_factor(&a, &b, &ranges, 0.0);
            let torque = |s: f64, i: usize| a[i] + s * b[i];
            let over = |s: f64| (0..7).any(|i| torque(s, i) * b[i].signum() > limits[i]);
            prop_assert!((0.0..=1.0).contains(&s));
            prop_assert!(!over(s - 1e-12), "s = {s} overdrives a wheel");
            prop_assert!(s == 1.0 || over(s + 1e-9), "s = {s} could be larger"); // slopes are rarely below 1e-3
        }
    }
}
