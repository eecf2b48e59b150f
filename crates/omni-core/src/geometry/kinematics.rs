//! Kinematics: body twist to wheel velocities and back.
//!
//! The inverse map `A` is built from the layout and is exact (eq. (9)). The forward map is a left inverse of it:
//! least squares by default, weighted if some wheels are more reliable, or the paper's average (7) by name. The part of
//! wheel velocities beyond the three motions of a rigid body is the redundancy residual.

#[cfg(feature = "serde")]
mod rows;
#[cfg(test)]
mod tests;

use super::forward_map::{Gram, column_average};
use super::path_factors::PathFactors;
use crate::constants::constant_struct;
use crate::error::within;
use crate::geometry::{BodyDisplacement, BodyTwist, WheelAngles, WheelLayout, WheelVelocities};
use crate::{ConfigError, Real};

/// Method that estimates a body twist from more wheel velocities than degrees of freedom.
///
/// ```
/// use omni_core::geometry::ForwardMap;
/// use omni_core::{Kinematics, WheelLayout};
/// let layout = WheelLayout::<f64, 7>::chugo7(0.2, 0.1, 0.1)?;
/// let spin = [0.0, 12.0, 0.0, 0.0, 0.0, 0.0, 0.0].into(); // wheel 2 alone
/// let yaw_rate = |map| Kinematics::with_forward(&layout, map).expect("valid").forward(&spin).wz_rad_s;
/// // A yaw rate of 1 turns wheels 2 and 6 twice (0.2 / 0.1), the others on the sides once.
/// assert!((yaw_rate(ForwardMap::LeastSquares) - 12.0 * 2.0 / (2.0 * 4.0 + 4.0 * 1.0)).abs() < 1e-12);
/// assert!((yaw_rate(ForwardMap::PaperAverage) - (12.0 / 2.0) / 6.0).abs() < 1e-12); // one of six votes
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ForwardMap {
    /// `(A^T A)^-1 A^T`: the twist with the smallest sum of squared wheel errors \[rad/s\].
    LeastSquares,
    /// Eq. (7) for any layout: per axis, the mean of the separate estimates of all wheels that the axis turns.
    PaperAverage,
}

/// The two linear maps of one layout. Immutable, no allocation.
///
/// ```
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.30, 0.23, 0.066)?)?;
/// let twist = BodyTwist { vx_m_s: 0.3, vy_m_s: -0.1, wz_rad_s: 0.5 };
/// let back = kinematics.forward(&kinematics.inverse(&twist));
/// assert!((back.wz_rad_s - 0.5_f64).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub struct Kinematics<R, const N: usize> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    inverse: [[R; 3]; N],
    #[cfg_attr(feature = "serde", serde(with = "rows"))]
    forward: [[R; N]; 3],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    weights: [R; N],
}

constant_struct!(Kinematics<R, const N> { inverse: [[R; 3]; N], forward: [[R; N]; 3], weights: [R; N] });

impl<R: Real, const N: usize> Kinematics<R, N> {
    /// The maps of `layout`, forward by least squares.
    ///
    /// # Errors
    /// Parameter `layout` if the wheels cannot move the vehicle in three directions (the value is the rank),
    /// `condition_number` above [`crate::geometry::CONDITION_LIMIT`].
    pub fn new(layout: &WheelLayout<R, N>) -> Result<Self, ConfigError> {
        Self::with_forward(layout, ForwardMap::LeastSquares)
    }

    /// The maps of `layout` with the forward map named.
    ///
    /// # Errors
    /// As [`Kinematics::new`]; parameter `forward_map` if the average is not a left inverse of this layout (the value
    /// is the largest deviation from the identity).
    ///
    /// ```
    /// use omni_core::geometry::ForwardMap;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let seven = WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?;
    /// let average = Kinematics::with_forward(&seven, ForwardMap::PaperAverage)?;
    /// assert!((average.forward_matrix()[0][3] - 0.066 / 5.0).abs() < 1e-15); // one of five along x
    /// // Three omni wheels of which each turns for forward and left motion at once: averages mix the two up.
    /// let three = WheelLayout::<f64, 3>::omni(0.2, 0.3, 0.05)?;
    /// assert_eq!(Kinematics::with_forward(&three, ForwardMap::PaperAverage).unwrap_err().parameter, "forward_map");
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn with_forward(layout: &WheelLayout<R, N>, map: ForwardMap) -> Result<Self, ConfigError> {
        let least_squares = Self::weighted(layout, &[R::one(); N])?;
        match map {
            ForwardMap::LeastSquares => Ok(least_squares),
            ForwardMap::PaperAverage => {
                let forward = column_average(&least_squares.inverse)?;
                Ok(Self {
                    forward,
                    ..least_squares
                })
            }
        }
    }

    /// The maps of `layout`, forward by weighted least squares: the twist with the smallest
    /// `sum of weight_i error_i^2`.
    ///
    /// `weights` are 0 to 1e6, one per wheel: the inverse variance of each wheel's measurement, in any unit. A wheel of
    /// weight 0 is excluded; at least three wheels that span the plane must count.
    ///
    /// # Errors
    /// As [`Kinematics::new`], of the wheels with a weight; parameter `weight` with the wheel's index.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout, WheelVelocities};
    /// let layout = WheelLayout::<f64, 4>::omni(0.2, 0.0, 0.05)?;
    /// // Front wheel doubted: what it says of vy counts a quarter of what the rear wheel says.
    /// let kinematics = Kinematics::weighted(&layout, &[0.25, 1.0, 1.0, 1.0])?;
    /// let front_spins = WheelVelocities { rad_s: [10.0, 0.0, 0.0, 0.0] };
    /// let plain = Kinematics::new(&layout)?.forward(&front_spins);
    /// assert!((plain.vy_m_s - 0.25).abs() < 1e-12);
    /// assert!((kinematics.forward(&front_spins).vy_m_s - 1.0 / 7.0).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn weighted(layout: &WheelLayout<R, N>, weights: &[R; N]) -> Result<Self, ConfigError> {
        for (index, &weight) in weights.iter().enumerate() {
            within("weight", weight, 0.0..=1e6, "0 to 1000000").map_err(|error| error.at(index))?;
        }
        let inverse = layout.wheels().map(|wheel| wheel.rates_per_twist());
        let gram = Gram::checked(&inverse, weights)?;
        let forward = gram.forward(&inverse, weights);
        Ok(Self {
            inverse,
            forward,
            weights: *weights,
        })
    }

    /// The same vehicle with the wheels marked in `excluded` left out of the forward map: least squares over the
    /// remaining wheels. None if these no longer separate the three motions (rank below 3, or too ill-conditioned to
    /// trust).
    ///
    /// Closed form, O(N): may be called in a control step. A map that was not least squares becomes it.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout, WheelVelocities};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
    /// let mut excluded = [false; 7];
    /// excluded[3] = true;
    /// let rest = kinematics.excluding(&excluded).expect("six wheels are enough");
    /// let middle_spins = WheelVelocities { rad_s: [0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0] };
    /// assert_eq!(rest.forward(&middle_spins).vx_m_s, 0.0);
    /// assert!(kinematics.excluding(&[true; 7]).is_none());
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn excluding(&self, excluded: &[bool; N]) -> Option<Self> {
        let mut weights = self.weights;
        for (weight, &out) in weights.iter_mut().zip(excluded) {
            if out {
                *weight = R::zero();
            }
        }
        let gram = Gram::new(&self.inverse, &weights);
        (gram.is_well_conditioned() || !excluded.contains(&true)).then(|| Self {
            forward: gram.forward(&self.inverse, &weights),
            ..*self
        })
    }

    /// Actuator velocities \[rad/s\] that move the vehicle with `twist`: eqs. (8), (9). The wheels
    /// turn `gear` times that.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
    /// let turn_left = BodyTwist { wz_rad_s: 0.5, ..BodyTwist::ZERO };
    /// let wheels = kinematics.inverse(&turn_left).rad_s;
    /// assert!((wheels[5] - 0.30 * 0.5 / 0.066).abs() < 1e-12); // wheel 6, R1 ahead of the middle
    /// assert!((wheels[6] - 0.23 * 0.5 / 0.066).abs() < 1e-12); // wheel 7, R2 beside it
    /// assert_eq!(wheels[3], 0.0); // wheel 4 in the middle
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn inverse(&self, twist: &BodyTwist<R>) -> WheelVelocities<R, N> {
        let [vx, vy, wz] = twist.to_array();
        WheelVelocities {
            rad_s: self.inverse.map(|[a, b, c]| a * vx + b * vy + c * wz),
        }
    }

    /// The twist that the actuator velocities \[rad/s\] amount to: eq. (6), by the forward map chosen. Linear;
    /// velocities that no motion explains are averaged out, not rejected.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
    /// // Every wheel at 5 rad/s: straight ahead with 5 * 0.1 m/s.
    /// let twist = kinematics.forward(&[5.0; 4].into());
    /// assert!((twist.vx_m_s - 0.5).abs() < 1e-12 && twist.vy_m_s.abs() < 1e-12 && twist.wz_rad_s.abs() < 1e-12);
    /// // The right wheels forward, the left ones back: a turn to the left, 0.5 m/s at (0.6 + 0.4) / 2 m.
    /// assert!((kinematics.forward(&[-5.0, 5.0, -5.0, 5.0].into()).wz_rad_s - 1.0).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn forward(&self, velocities: &WheelVelocities<R, N>) -> BodyTwist<R> {
        BodyTwist::from_array(self.apply_forward(&velocities.rad_s))
    }

    /// The displacement in the body frame that increments of the actuator angles amount to.
    ///
    /// ```
    /// use omni_core::geometry::WheelAngles;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::omni(0.5, 0.0, 0.1)?)?;
    /// let quarter = kinematics.displacement(&WheelAngles { rad: [7.85; 4] });
    /// assert!((quarter.dyaw_rad - 1.57).abs() < 1e-12 && quarter.dx_m.abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn displacement(&self, increments: &WheelAngles<R, N>) -> BodyDisplacement<R> {
        BodyDisplacement::from_array(self.apply_forward(&increments.rad))
    }

    /// The part of increments of the actuator angles \[rad\] that no motion of the vehicle explains: `(I - A A+) dphi`,
    /// the residual of [`Kinematics::residual`] for angles.
    ///
    /// ```
    /// use omni_core::geometry::WheelAngles;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
    /// // All by 0.1 rad, the first by 0.04 more: four wheels share a slip that one check finds.
    /// let rest = kinematics.increment_residual(&WheelAngles { rad: [0.14, 0.1, 0.1, 0.1] });
    /// for (rest, expected) in rest.rad.iter().zip([0.01, 0.01, -0.01, -0.01]) {
    ///     assert!((rest - expected).abs() < 1e-12);
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn increment_residual(&self, increments: &WheelAngles<R, N>) -> WheelAngles<R, N> {
        WheelAngles {
            rad: self
                .residual(&WheelVelocities {
                    rad_s: increments.rad,
                })
                .rad_s,
        }
    }

    /// The part of `velocities` \[rad/s\] that some motion of a rigid body explains: `A A+ v`. Projecting twice changes
    /// nothing more; with [`Kinematics::residual`] it adds up to `velocities`.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.35, 0.27, 0.1)?)?;
    /// // Wheel 4 alone spins with 5 rad/s: a fifth of it could be forward motion, in which all five of them turn.
    /// let explained = kinematics.project(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0].into());
    /// for (wheel, expected) in explained.rad_s.iter().zip([1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0]) {
    ///     assert!((wheel - expected).abs() < 1e-12);
    /// }
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn project(&self, velocities: &WheelVelocities<R, N>) -> WheelVelocities<R, N> {
        self.inverse(&self.forward(velocities))
    }

    /// [`Kinematics::project`] of wheels that cover `path` times the way of the body beneath them: actuator velocities
    /// \[rad/s\].
    ///
    /// ```
    /// use omni_core::geometry::PathFactors;
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1)?)?;
    /// let climbing = [6.0, 6.0, 5.0, 5.0].into();
    /// let front_climbs = PathFactors::new([1.2, 1.2, 1.0, 1.0])?;
    /// let explained = kinematics.project_along(&climbing, &front_climbs);
    /// assert!((explained.rad_s[0] - 6.0).abs() < 1e-12); // all of it is one motion
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn project_along(
        &self,
        velocities: &WheelVelocities<R, N>,
        path: &PathFactors<R, N>,
    ) -> WheelVelocities<R, N> {
        path.of_wheels(&self.project(&path.of_body(velocities)))
    }

    /// The redundancy residual, `(I - A A+) v` \[rad/s\]: zero if no wheel slips, `N - 3` independent checks.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::chugo7(0.35, 0.27, 0.1)?)?;
    /// // Forward at 0.3 m/s, wheel 4 slipping by 1 rad/s: four fifths of it cannot be motion.
    /// let residual = kinematics.residual(&[3.0_f64, 0.0, -3.0, 4.0, 3.0, 0.0, -3.0].into());
    /// assert!((residual.rad_s[3] - 0.8).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn residual(&self, velocities: &WheelVelocities<R, N>) -> WheelVelocities<R, N> {
        self.residual_beyond(velocities, &self.forward(velocities))
    }

    /// The part of `velocities` \[rad/s\] that is not the motion `twist`: [`Kinematics::residual`] if their own
    /// [`Kinematics::forward`] is already known.
    ///
    /// ```
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?)?;
    /// let ahead = BodyTwist { vx_m_s: 0.5_f64, ..BodyTwist::ZERO }; // 5 rad/s of each wheel
    /// let beyond = kinematics.residual_beyond(&[5.0, 5.0, 6.0, 5.0].into(), &ahead);
    /// assert!((beyond.rad_s[2] - 1.0).abs() < 1e-12 && beyond.rad_s[0].abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn residual_beyond(
        &self,
        velocities: &WheelVelocities<R, N>,
        twist: &BodyTwist<R>,
    ) -> WheelVelocities<R, N> {
        let mut rest = *velocities;
        for (r, p) in rest.rad_s.iter_mut().zip(self.inverse(twist).rad_s) {
            *r -= p;
        }
        rest
    }

    /// Redundancy of each wheel: `1 - (A A+)_ii`, 0 (the other wheels cannot check it) to 1 (the other wheels determine
    /// it completely). A wheel that alone slips by `d` shows a residual of `d` times this; the sum is `N - 3`.
    /// Geodesy's redundancy numbers.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout};
    /// let seven = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.35, 0.27, 0.1)?)?.redundancy();
    /// assert!((seven[3] - 0.8).abs() < 1e-12 && (seven.iter().sum::<f64>() - 4.0).abs() < 1e-12);
    /// let three = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?.redundancy();
    /// assert!(three.iter().all(|r| r.abs() < 1e-12)); // three wheels check nothing
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn redundancy(&self) -> [R; N] {
        let [x, y, z] = &self.forward;
        let mut numbers = [R::one(); N];
        for ((((number, a), x), y), z) in numbers.iter_mut().zip(&self.inverse).zip(x).zip(y).zip(z) {
            *number -= a[0] * *x + a[1] * *y + a[2] * *z;
        }
        numbers
    }

    /// Condition number of the inverse map, yaw measured at the wheels' mean lever: 1 (best) to
    /// [`crate::geometry::CONDITION_LIMIT`]. The largest over the smallest singular value, of all
    /// wheels alike: weights and wheels left out do not count.
    ///
    /// ```
    /// use omni_core::{Kinematics, WheelLayout};
    /// // Four omni wheels on a circle: no direction of motion is determined better than another, whatever the lengths.
    /// let four = Kinematics::new(&WheelLayout::<f64, 4>::omni(0.5, 0.0, 0.1)?)?;
    /// assert!((four.condition_number() - 1.0).abs() < 1e-12);
    /// // Five wheels along x against two along y.
    /// let seven = Kinematics::new(&WheelLayout::<f64, 7>::chugo7(0.30, 0.23, 0.066)?)?;
    /// assert!((seven.condition_number() - 2.5_f64.sqrt()).abs() < 1e-12);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn condition_number(&self) -> R {
        Gram::new(&self.inverse, &[R::one(); N]).condition_number()
    }

    /// The inverse map `A`, `N` x 3, one row `[rad/m, rad/m, 1]` a wheel: the matrix printed as eq. (9).
    #[must_use]
    pub fn inverse_matrix(&self) -> &[[R; 3]; N] {
        &self.inverse
    }

    /// The forward map, 3 x `N`, one row per axis, in \[m/rad, m/rad, 1\]: J of eq. (7) if [`ForwardMap::PaperAverage`]
    /// was chosen. An excluded wheel has a column of zeros.
    #[must_use]
    pub fn forward_matrix(&self) -> &[[R; N]; 3] {
        &self.forward
    }

    fn apply_forward(&self, wheels: &[R; N]) -> [R; 3] {
        self.forward.map(|row| {
            let mut sum = R::zero();
            for (f, v) in row.iter().zip(wheels) {
                sum += *f * *v;
            }
            sum
        })
    }
}
