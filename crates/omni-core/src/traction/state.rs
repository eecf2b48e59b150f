//! The state of traction control.

use super::encoder::EncoderState;
use super::loops::TractionLoops;
use crate::Real;
use crate::geometry::BodyTwist;
use crate::linkage::{LinkageMotion, MAX_HINGES};
use crate::scalar::is_plausible;

/// The state of [`super::Traction`] between periods; `default` is a fresh start. It belongs to one [`super::Traction`]
/// only, whose results for a direction of travel it stores.
///
/// ```
/// use omni_core::traction::TractionState;
/// static STATE: TractionState<f32, 7> = TractionState::new();
/// assert_eq!((STATE.speed_m_s(), STATE.thrust_n_m()), (0.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(deserialize = "R: Real + serde::Deserialize<'de>"))
)]
pub struct TractionState<R, const N: usize> {
    /// The last command, its speed \[m/s\], the rates that it asks of the wheels.
    pub(super) command: BodyTwist<R>,
    pub(super) commanded_m_s: R,
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) reference_rad_s: [R; N],
    /// Direction of travel in the vehicle's frame, a unit vector: the direction of the last command that was not rest.
    pub(super) direction: [R; 2],
    /// `travel` has been worked out for `direction`.
    pub(super) wheels_found: bool,
    /// The wheels on it.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) travel: [WheelAlongTravel<R>; N],
    pub(super) largest_rate_rad_m: R,
    /// Filtered rates: of the base's nose and left side, of the hinges.
    pub(super) base_rad_s: [R; 2],
    /// What the unit says of the base's rates beyond the change of its attitude, and for how long
    /// that has been looked at \[rad/s, s\].
    pub(super) base_zero_rad_s: [R; 2],
    pub(super) base_found_s: R,
    /// The attitude of the period before, nose and left side; none if it was not read \[rad\].
    pub(super) attitude_rad: Option<[R; 2]>,
    pub(super) hinges_rad_s: [R; MAX_HINGES],
    /// How the wheels rise is known: there are hinges, and every one and the attitude of the base are read.
    pub(super) reads_linkage: bool,
    /// How bodies and wheels move.
    pub(super) motion: LinkageMotion<R, N>,
    /// Along the direction \[m/s\].
    pub(super) speed_m_s: R,
    pub(super) target_m_s: R,
    pub(super) thrust_n_m: R,
    pub(super) integral_n_m: R,
    /// Largest torque of one driven wheel's motor \[N.m\].
    pub(super) largest_motor_n_m: R,
    pub(super) heading_rad: R,
    pub(super) yaw_rad_s: R,
    /// Speed across the direction of travel, to the left \[m/s\], and how far that went \[m\].
    pub(super) drift_m_s: R,
    pub(super) drift_m: R,
    pub(super) gyro_zero_rad_s: R,
    /// Time over which the zero was found so far \[s\].
    pub(super) gyro_found_s: R,
    pub(super) loops: TractionLoops,
    /// Times for which the vehicle has been held up, has not needed traction control, and has had most wheels off the
    /// speed \[s\].
    pub(super) held_up_s: R,
    /// The speed when that began, along the target \[m/s\].
    pub(super) held_up_m_s: R,
    pub(super) calm_s: R,
    pub(super) off_speed_s: R,
    /// Slip stands out from the sensors' noise at the commanded speed.
    pub(super) slip_observable: bool,
    /// The fault monitor of a drive judges readings of wheels that stand.
    pub(crate) watched: bool,
    /// Slip is not observable and counts are rare: own loops use the readings without the estimator.
    pub(super) raw: bool,
    /// Time until traction control is possible again, once there are wheels to spare \[s\]; 0 when it is.
    pub(super) redundant_again_s: R,
    /// Thrust at which every driven wheel applies its largest torque \[N.m\].
    pub(super) full_thrust_n_m: R,
    /// For how long one wheel has shown a slow vehicle while the ground carried most driven wheels,
    /// less four times the time for which it was not so \[s\].
    pub(super) carried_s: R,
    /// What the inertial unit sees while driven wheels push and stand, if there are such wheels.
    pub(super) unseen: Unseen<R>,
    /// There are.
    pub(super) any_stood: bool,
    /// Part of the gain of slip control that is in use: less where wheels swing from limit to limit.
    pub(super) slip_gain_part: R,
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) wheels: [WheelState<R>; N],
}

/// The state of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct WheelState<R> {
    pub(super) usable: bool,
    /// It showed a slow vehicle while the ground carried the others, or stood while the vehicle went where it pushed:
    /// not usable until the command rests.
    pub(super) doubted: bool,
    /// It has stood and pushed for as long as `unseen` says.
    pub(super) stood: bool,
    pub(super) encoder: EncoderState<R>,
    /// What was read last \[rad/s\], and for how long just that while it pushed \[s\].
    pub(super) read_rad_s: R,
    pub(super) same_s: R,
    pub(super) measured_rad_s: R,
    /// Its rolling speed along the direction, filtered \[m/s\].
    pub(super) speed_m_s: R,
    pub(super) applied_n_m: R,
    /// Largest torque that its motor has.
    pub(super) most_n_m: R,
    /// Torque to the ground.
    pub(super) contact_n_m: R,
    /// Of its own loop.
    pub(super) integral_n_m: R,
    /// Time since its torque was limited \[s\]; negative if that was at the lower limit, 0 before the first time.
    pub(super) limited_s: R,
}

impl<R: Real> WheelState<R> {
    const fn new() -> Self {
        Self {
            usable: false,
            doubted: false,
            stood: false,
            encoder: EncoderState::new(),
            read_rad_s: R::ZERO,
            same_s: R::ZERO,
            measured_rad_s: R::ZERO,
            speed_m_s: R::ZERO,
            applied_n_m: R::ZERO,
            most_n_m: R::ZERO,
            contact_n_m: R::ZERO,
            integral_n_m: R::ZERO,
            limited_s: R::ZERO,
        }
    }

    /// A wheel without a reading starts afresh.
    pub(super) fn forget(&mut self) {
        let zero = R::zero();
        (self.applied_n_m, self.contact_n_m, self.integral_n_m) = (zero, zero, zero);
        self.encoder = EncoderState::new();
    }
}

impl<R: Real, const N: usize> Default for TractionState<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real, const N: usize> TractionState<R, N> {
    /// A fresh start, also for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            command: BodyTwist::ZERO,
            commanded_m_s: R::ZERO,
            reference_rad_s: [R::ZERO; N],
            direction: [R::ONE, R::ZERO],
            wheels_found: false,
            travel: [WheelAlongTravel::NONE; N],
            largest_rate_rad_m: R::ZERO,
            base_rad_s: [R::ZERO; 2],
            base_zero_rad_s: [R::ZERO; 2],
            base_found_s: R::ZERO,
            attitude_rad: None,
            hinges_rad_s: [R::ZERO; MAX_HINGES],
            reads_linkage: false,
            motion: LinkageMotion::flat(),
            speed_m_s: R::ZERO,
            target_m_s: R::ZERO,
            thrust_n_m: R::ZERO,
            integral_n_m: R::ZERO,
            largest_motor_n_m: R::ZERO,
            heading_rad: R::ZERO,
            yaw_rad_s: R::ZERO,
            drift_m_s: R::ZERO,
            drift_m: R::ZERO,
            gyro_zero_rad_s: R::ZERO,
            gyro_found_s: R::ZERO,
            loops: TractionLoops::Plain,
            held_up_s: R::ZERO,
            held_up_m_s: R::ZERO,
            calm_s: R::ZERO,
            off_speed_s: R::ZERO,
            slip_observable: true,
            watched: false,
            raw: false,
            redundant_again_s: R::ZERO,
            full_thrust_n_m: R::ZERO,
            carried_s: R::ZERO,
            unseen: Unseen::NONE,
            any_stood: false,
            slip_gain_part: R::ONE,
            wheels: [WheelState::new(); N],
        }
    }

    /// A start of a vehicle that moves with `twist` already: after a reset, or if another controller drove it. Without
    /// it the speed is found within the time in which the vehicle could have reached it, and wheels brake until then. A
    /// twist that is not finite, or beyond 1e6, is none.
    ///
    /// ```
    /// use omni_core::BodyTwist;
    /// use omni_core::traction::TractionState;
    /// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// assert_eq!(TractionState::<f64, 4>::moving(&ahead).speed_m_s(), 0.3);
    /// let unknown = BodyTwist { vx_m_s: f64::NAN, ..BodyTwist::ZERO };
    /// assert_eq!(TractionState::<f64, 4>::moving(&unknown).speed_m_s(), 0.0);
    /// ```
    #[must_use]
    pub fn moving(twist: &BodyTwist<R>) -> Self {
        if !twist.to_array().into_iter().all(is_plausible) {
            return Self::new();
        }
        // In the vehicle's frame, the frame of the first direction.
        Self {
            speed_m_s: twist.vx_m_s,
            drift_m_s: twist.vy_m_s,
            yaw_rad_s: twist.wz_rad_s,
            ..Self::new()
        }
    }

    /// Measured speed along the direction of travel \[m/s\].
    #[must_use]
    pub fn speed_m_s(&self) -> R {
        self.speed_m_s
    }

    /// Common thrust \[N.m\].
    #[must_use]
    pub fn thrust_n_m(&self) -> R {
        self.thrust_n_m
    }

    /// The control mode of the wheels.
    #[must_use]
    pub fn loops(&self) -> TractionLoops {
        self.loops
    }

    /// The command is to stand, and not to turn.
    pub(super) fn is_resting(&self) -> bool {
        self.commanded_m_s == R::zero() && self.command.wz_rad_s == R::zero()
    }

    /// Slip stands out from noise, and a wrong wheel from the others.
    pub(super) fn can_discern(&self) -> bool {
        self.slip_observable && self.redundant_again_s == R::zero()
    }

    /// Excess speed of the target, as a rate of the wheel with the most turns per distance \[rad/s\].
    pub(super) fn lack_rad_s(&self) -> R {
        (self.target_m_s - self.speed_m_s) * self.largest_rate_rad_m
    }

    /// Sign of the target, forward if there is none.
    pub(super) fn target_sign(&self) -> R {
        if self.target_m_s < R::zero() {
            -R::one()
        } else {
            R::one()
        }
    }

    /// Measured speed over the commanded, -1 to 1; 1 if none is commanded.
    pub(super) fn speed_part(&self) -> R {
        if self.commanded_m_s > R::zero() {
            (self.speed_m_s / self.commanded_m_s).limited(-R::one(), R::one())
        } else {
            R::one()
        }
    }
}

/// Speed and way that the inertial unit sees the vehicle gain while wheels push and do not turn \[m/s, m\].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Unseen<R> {
    pub(super) gained_m_s: R,
    pub(super) gone_m: R,
    /// The gyro in the period before.
    pub(super) yaw_rad_s: R,
}

impl<R: Real> Unseen<R> {
    pub(super) const NONE: Self = Self {
        gained_m_s: R::ZERO,
        gone_m: R::ZERO,
        yaw_rad_s: R::ZERO,
    };
}

/// A wheel on a direction of travel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct WheelAlongTravel<R> {
    pub(super) driven: bool,
    /// Rate of its actuator per speed along the direction \[rad/m\], and the sign of that.
    pub(super) rate_rad_m: R,
    pub(super) along: R,
    /// Rate of its actuator per speed across the direction, to the left \[rad/m\].
    pub(super) side_rate_rad_m: R,
    /// Speed along the direction per rate of the actuator \[m/rad\]; 0 of a wheel that is not driven.
    pub(super) way_m: R,
    /// Its part of the common thrust.
    pub(super) part: R,
    /// How far it is to the left of the middle, as a part of how far the outermost wheel is, signed as its thrust.
    pub(super) lever: R,
    /// Square of the cosine of the angle between its push and the direction.
    pub(super) cosine_squared: R,
    /// Torque removed per speed of slip \[N.s\], with the sign of `along`.
    pub(super) slip_gain: R,
}

impl<R: Real> WheelAlongTravel<R> {
    pub(super) const NONE: Self = Self {
        driven: false,
        rate_rad_m: R::ZERO,
        along: R::ONE,
        side_rate_rad_m: R::ZERO,
        way_m: R::ZERO,
        part: R::ZERO,
        lever: R::ZERO,
        cosine_squared: R::ZERO,
        slip_gain: R::ZERO,
    };
}
