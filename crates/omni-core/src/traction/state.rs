//! What a traction control remembers.

use super::encoder::EncoderState;
use super::torque_law::held_within;
use super::travel_direction::Ways;
use super::{HEADING_RAD, TractionConfig, ZERO_MOST_RAD_S, ZERO_STEP_RAD_S};
use crate::linkage::MAX_HINGES;
use crate::pid::is_plausible;
use crate::{BodyTwist, Kinematics, Real};

/// What [`super::Traction`] remembers between periods; `default` is a fresh start. It is of one [`super::Traction`] only: what that works out
/// for a direction of travel is kept here.
///
/// ```
/// use omni_core::TractionState;
/// static STATE: TractionState<f32, 7> = TractionState::new();
/// assert_eq!((STATE.speed_m_s(), STATE.thrust_n_m()), (0.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub struct TractionState<R, const N: usize> {
    /// Direction of travel in the vehicle's frame, a unit vector: that of the last command that was not rest.
    pub(super) direction: [R; 2],
    /// The command that it is of \[m/s\], and its size.
    command_m_s: [R; 2],
    pub(super) commanded_m_s: R,
    pub(super) commanded_rad_s: R,
    /// It is not to turn, and it is to stand.
    pub(super) straight: bool,
    pub(super) resting: bool,
    /// The rates that it asks of the wheels.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) reference_rad_s: [R; N],
    /// Along the direction \[m/s\].
    pub(super) speed_m_s: R,
    pub(super) target_m_s: R,
    pub(super) thrust_n_m: R,
    pub(super) integral_n_m: R,
    /// Largest thrust that a driven wheel had.
    pub(super) largest_n_m: R,
    pub(super) heading_rad: R,
    /// Yaw rate by the wheels, where there is no gyro.
    pub(super) yaw_rad_s: R,
    pub(super) gyro_zero_rad_s: R,
    /// Time over which the zero was found so far \[s\].
    gyro_zero_s: R,
    /// Filtered rates: of the base's nose and left side, of the hinges.
    pub(super) base_rad_s: [R; 2],
    pub(super) hinges_rad_s: [R; MAX_HINGES],
    /// The wheel that stands: where the search for the next one begins.
    pub(super) standing: u16,
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) wheels: [WheelMemory<R>; N],
    /// Wheels of which there was a reading a period ago; wheel i is bit i.
    pub(super) heard: u32,
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(super) encoders: [EncoderState<R>; N],
    pub(super) ways: Ways<R, N>,
}

/// What is remembered of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct WheelMemory<R> {
    pub(super) applied_n_m: R,
    /// Largest torque that the motor had.
    pub(super) most_n_m: R,
    pub(super) measured_rad_s: R,
    /// Less than this against the thrust, and the wheel brakes.
    pub(super) braking_n_m: R,
    /// What the ground takes.
    pub(super) contact_n_m: R,
    /// Integral of a wheel that points across the way.
    pub(super) free_n_m: R,
}

impl<R: Real> WheelMemory<R> {
    const fn new() -> Self {
        Self {
            applied_n_m: R::ZERO,
            most_n_m: R::ZERO,
            braking_n_m: R::ZERO,
            measured_rad_s: R::ZERO,
            contact_n_m: R::ZERO,
            free_n_m: R::ZERO,
        }
    }

    /// A wheel without a reading starts afresh.
    pub(super) fn forget(&mut self) {
        let zero = R::zero();
        (self.applied_n_m, self.contact_n_m, self.free_n_m) = (zero, zero, zero);
    }
}

impl<R: Real, const N: usize> Default for TractionState<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real, const N: usize> TractionState<R, N> {
    /// A fresh start, for a `static` too.
    ///
    /// ```
    /// use omni_core::TractionState;
    /// assert_eq!(TractionState::<f64, 4>::new(), TractionState::default());
    /// ```
    #[must_use]
    pub const fn new() -> Self {
        Self {
            direction: [R::ONE, R::ZERO],
            command_m_s: [R::ZERO; 2],
            commanded_m_s: R::ZERO,
            commanded_rad_s: R::ZERO,
            straight: true,
            resting: true,
            reference_rad_s: [R::ZERO; N],
            speed_m_s: R::ZERO,
            target_m_s: R::ZERO,
            thrust_n_m: R::ZERO,
            integral_n_m: R::ZERO,
            largest_n_m: R::ZERO,
            heading_rad: R::ZERO,
            yaw_rad_s: R::ZERO,
            gyro_zero_rad_s: R::ZERO,
            gyro_zero_s: R::ZERO,
            base_rad_s: [R::ZERO; 2],
            hinges_rad_s: [R::ZERO; MAX_HINGES],
            standing: 0,
            wheels: [WheelMemory::new(); N],
            heard: 0,
            encoders: [EncoderState::new(); N],
            ways: Ways::new(),
        }
    }

    /// Measured speed along the direction of travel \[m/s\].
    ///
    /// ```
    /// assert_eq!(omni_core::TractionState::<f64, 4>::new().speed_m_s(), 0.0);
    /// ```
    #[must_use]
    pub fn speed_m_s(&self) -> R {
        self.speed_m_s
    }

    /// Common thrust \[N.m\].
    ///
    /// ```
    /// assert_eq!(omni_core::TractionState::<f64, 4>::new().thrust_n_m(), 0.0);
    /// ```
    #[must_use]
    pub fn thrust_n_m(&self) -> R {
        self.thrust_n_m
    }

    /// Takes a command for the direction of travel. What is known along the old one is taken over as far as the new one points there. What
    /// is no command, as NaN, is none: the last one goes on.
    pub(super) fn travel(&mut self, command: &BodyTwist<R>, kinematics: &Kinematics<R, N>) {
        let same = command.vx_m_s == self.command_m_s[0]
            && command.vy_m_s == self.command_m_s[1]
            && command.wz_rad_s == self.commanded_rad_s;
        if !same && command.to_array().into_iter().all(is_plausible) {
            self.turn_to(command);
            self.commanded_rad_s = command.wz_rad_s;
            self.reference_rad_s = kinematics.inverse(command).rad_s;
            self.straight = self.commanded_rad_s == R::zero();
            self.resting = self.commanded_m_s == R::zero() && self.straight;
        }
    }

    /// The command is the last one, bit by bit: [`Self::travel`] changes nothing.
    #[inline(always)]
    pub(super) fn travels(&self, command: &BodyTwist<R>) -> bool {
        command.vx_m_s.same_bits(self.command_m_s[0])
            && command.vy_m_s.same_bits(self.command_m_s[1])
            && command.wz_rad_s.same_bits(self.commanded_rad_s)
    }

    fn turn_to(&mut self, command: &BodyTwist<R>) {
        let asked = [command.vx_m_s, command.vy_m_s];
        if asked == self.command_m_s {
            return;
        }
        // A root of a square is that number.
        let speed = if asked[1] == R::zero() {
            asked[0].abs()
        } else {
            (asked[0] * asked[0] + asked[1] * asked[1]).sqrt()
        };
        (self.command_m_s, self.commanded_m_s) = (asked, speed);
        if speed > R::zero() {
            let direction = [asked[0] / speed, asked[1] / speed];
            if direction == self.direction {
                return;
            }
            let kept = direction[0] * self.direction[0] + direction[1] * self.direction[1];
            self.direction = direction;
            self.ways.known = false;
            for along in [&mut self.speed_m_s, &mut self.target_m_s, &mut self.integral_n_m] {
                *along *= kept;
            }
        }
    }

    /// Adds a yaw rate too much to the heading error.
    #[inline(always)]
    pub(super) fn turn(
        &mut self,
        error_rad_s: R,
        resting: bool,
        square_up: bool,
        config: &TractionConfig<R>,
    ) {
        if resting {
            return;
        }
        let most = R::of(HEADING_RAD);
        self.heading_rad = held_within(self.heading_rad + config.period_s * error_rad_s, most);
        if square_up {
            self.heading_rad *= R::one() - config.part(config.squaring_s);
        }
    }

    /// Takes what a gyro says too much while the vehicle is told to go straight.
    #[inline(always)]
    pub(super) fn zero_gyro(&mut self, error_rad_s: R, config: &TractionConfig<R>) {
        let most = config.gyro_zero_s;
        self.gyro_zero_s += config.period_s;
        self.gyro_zero_s = if self.gyro_zero_s < most {
            self.gyro_zero_s
        } else {
            most
        };
        let step = R::of(ZERO_STEP_RAD_S);
        let zero = self.gyro_zero_rad_s + config.part(self.gyro_zero_s) * held_within(error_rad_s, step);
        self.gyro_zero_rad_s = held_within(zero, R::of(ZERO_MOST_RAD_S));
    }
}
