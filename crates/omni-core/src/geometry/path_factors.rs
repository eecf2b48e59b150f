//! Wheels that cover another path than the body beneath them.

use crate::error::within;
use crate::geometry::WheelVelocities;
use crate::{ConfigError, Real};

/// Path of each wheel over path of the body beneath it: 1 on flat ground, above 1 for a wheel that
/// rolls over an edge and covers a longer path than the body.
///
/// ```
/// use omni_core::geometry::PathFactors;
/// use omni_core::{BodyTwist, Kinematics, WheelLayout};
/// let kinematics = Kinematics::new(&WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?)?;
/// let twist = BodyTwist { vx_m_s: 0.0, vy_m_s: 0.0, wz_rad_s: 1.0 };
/// let on_an_edge = PathFactors::new([1.0, 1.5, 1.0])?;
/// let wheels = on_an_edge.of_wheels(&kinematics.inverse(&twist));
/// assert!((wheels.rad_s[1] - 1.5 * wheels.rad_s[0]).abs() < 1e-12);
/// assert!((kinematics.forward(&on_an_edge.of_body(&wheels)).wz_rad_s - 1.0).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PathFactors<R, const N: usize> {
    factor: [R; N],
    reciprocal: [R; N],
}

impl<R: Real, const N: usize> PathFactors<R, N> {
    /// One factor per wheel, each 0.01 to 100.
    ///
    /// # Errors
    /// Parameter `path_factor` with the wheel's index.
    pub fn new(factor: [R; N]) -> Result<Self, ConfigError> {
        for (index, &f) in factor.iter().enumerate() {
            within("path_factor", f, 0.01..=100.0, "0.01 to 100").map_err(|error| error.at(index))?;
        }
        Ok(Self {
            factor,
            reciprocal: factor.map(|f| R::one() / f),
        })
    }

    /// One factor per wheel, as read in a control period: a value outside 0.01 to 100 counts as 1, flat ground.
    ///
    /// ```
    /// use omni_core::geometry::PathFactors;
    /// let read = PathFactors::or_flat([1.5, 0.0, f32::NAN]);
    /// assert_eq!(read, PathFactors::new([1.5, 1.0, 1.0])?);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn or_flat(factor: [R; N]) -> Self {
        let mut factors = Self::default();
        let known = factors.factor.iter_mut().zip(&mut factors.reciprocal);
        for (read, (own, reciprocal)) in factor.into_iter().zip(known) {
            if read >= R::of(0.01) && read <= R::of(100.0) {
                (*own, *reciprocal) = (read, R::one() / read);
            }
        }
        factors
    }

    /// Velocities \[rad/s\] of the wheels from those on flat ground: times the factors.
    ///
    /// ```
    /// use omni_core::geometry::PathFactors;
    /// use omni_core::WheelVelocities;
    /// let second_climbs = PathFactors::new([1.0, 1.5, 1.0])?;
    /// let flat = WheelVelocities { rad_s: [4.0, 4.0, -4.0] };
    /// assert_eq!(second_climbs.of_wheels(&flat).rad_s, [4.0, 6.0, -4.0]); // a longer path in the same time
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn of_wheels(&self, flat: &WheelVelocities<R, N>) -> WheelVelocities<R, N> {
        WheelVelocities {
            rad_s: times(&flat.rad_s, &self.factor),
        }
    }

    /// The equivalent wheel velocities \[rad/s\] on flat ground: divided by the factors. Undoes
    /// [`PathFactors::of_wheels`].
    ///
    /// ```
    /// use omni_core::geometry::PathFactors;
    /// use omni_core::WheelVelocities;
    /// let second_climbs = PathFactors::new([1.0, 2.0, 1.0])?;
    /// let measured = WheelVelocities { rad_s: [4.0, 8.0, -4.0] };
    /// assert_eq!(second_climbs.of_body(&measured).rad_s, [4.0, 4.0, -4.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn of_body(&self, wheels: &WheelVelocities<R, N>) -> WheelVelocities<R, N> {
        WheelVelocities {
            rad_s: times(&wheels.rad_s, &self.reciprocal),
        }
    }
}

impl<R: Real, const N: usize> Default for PathFactors<R, N> {
    /// Flat ground: 1 for every wheel.
    fn default() -> Self {
        Self {
            factor: [R::one(); N],
            reciprocal: [R::one(); N],
        }
    }
}

/// Element by element.
fn times<R: Real, const N: usize>(a: &[R; N], b: &[R; N]) -> [R; N] {
    let mut product = *a;
    for (p, b) in product.iter_mut().zip(b) {
        *p *= *b;
    }
    product
}
