//! Wheel quantities with their role in the type: a torque cannot be passed where a velocity is meant.

use crate::Real;

macro_rules! per_wheel {
    ($name:ident, $field:ident) => {
        impl<R: Real, const N: usize> $name<R, N> {
            /// Zero for every wheel.
            ///
            /// At rest, or without torque: a start for values that are filled in wheel by wheel.
            #[must_use]
            pub const fn zero() -> Self {
                Self {
                    $field: [R::ZERO; N],
                }
            }

            /// Every number is finite: neither NaN nor infinite.
            ///
            /// ```
            /// use omni_core::geometry::{WheelAngles, WheelTorques};
            /// use omni_core::WheelVelocities;
            /// assert!(WheelVelocities { rad_s: [1e30_f32, -1e30] }.is_finite()); // absurd, but a number
            /// assert!(!WheelTorques { n_m: [0.5, f64::NAN] }.is_finite()); // one is enough
            /// assert!(!WheelAngles { rad: [0.0, f64::NEG_INFINITY] }.is_finite());
            /// ```
            #[must_use]
            pub fn is_finite(&self) -> bool {
                self.$field.iter().all(|x| x.is_finite_real())
            }
        }

        impl<R, const N: usize> From<[R; N]> for $name<R, N> {
            fn from($field: [R; N]) -> Self {
                Self { $field }
            }
        }
    };
}

/// Actuator velocities, one per wheel in the layout's order, which kinematics maps and loops control.
///
/// ```
/// use omni_core::WheelVelocities;
/// let velocities = WheelVelocities { rad_s: [3.0_f64, 0.0, -3.0] };
/// assert_eq!(velocities.rad_s[2], -3.0);
/// assert_eq!(WheelVelocities::<f64, 3>::zero().rad_s, [0.0; 3]);
/// assert!(!WheelVelocities::from([f32::NAN]).is_finite());
/// ```
///
/// A torque is not a velocity:
///
/// ```compile_fail
/// use omni_core::geometry::WheelTorques;
/// use omni_core::{Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05).unwrap()).unwrap();
/// kinematics.forward(&WheelTorques { n_m: [1.0, 1.0, 1.0] });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
#[repr(C)]
pub struct WheelVelocities<R, const N: usize> {
    /// Velocity of each actuator \[rad/s\] (positive as the wheel's rolling direction says), any finite number.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub rad_s: [R; N],
}

per_wheel!(WheelVelocities, rad_s);

impl<R: Real, const N: usize> WheelVelocities<R, N> {
    /// The received values of `N` wheels; missing ones count as not received.
    pub(crate) fn received(rad_s: &[R]) -> Self {
        let mut velocities = Self {
            rad_s: [R::of(f64::NAN); N],
        };
        for (velocity, rad_s) in velocities.rad_s.iter_mut().zip(rad_s) {
            *velocity = *rad_s;
        }
        velocities
    }
}

/// Actuator torques, one per wheel in the layout's order: a controller's request to the motors. Not a wheel velocity.
///
/// ```
/// use omni_core::geometry::WheelTorques;
/// assert_eq!(WheelTorques { n_m: [0.5_f32, -0.5] }.n_m[1], -0.5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
#[repr(C)]
pub struct WheelTorques<R, const N: usize> {
    /// Torque of each actuator \[N.m\] (positive drives the wheel in its rolling direction), any finite number.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub n_m: [R; N],
}

per_wheel!(WheelTorques, n_m);

/// Actuator angles or their increments, one per wheel in the layout's order: readings of position encoders.
///
/// ```
/// use omni_core::geometry::WheelAngles;
/// assert_eq!(WheelAngles { rad: [0.1_f32, 0.2] }.rad[0], 0.1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
#[repr(C)]
pub struct WheelAngles<R, const N: usize> {
    /// Angle turned by each actuator \[rad\] (positive as the wheel's rolling direction says), unwrapped.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub rad: [R; N],
}

per_wheel!(WheelAngles, rad);

impl<R: Real, const N: usize> WheelVelocities<R, N> {
    /// Angles turned at these velocities within `dt_s` \[s\].
    ///
    /// ```
    /// use omni_core::WheelVelocities;
    /// assert_eq!(WheelVelocities { rad_s: [4.0, -2.0] }.over(0.5).rad, [2.0, -1.0]);
    /// ```
    #[must_use]
    pub fn over(&self, dt_s: R) -> WheelAngles<R, N> {
        WheelAngles {
            rad: self.rad_s.map(|v| v * dt_s),
        }
    }
}
