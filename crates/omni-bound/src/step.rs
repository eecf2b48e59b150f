//! The step that is climbed.

use serde::Serialize;

use crate::Error;

/// A step up and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Step {
    /// Height \[m\], more than 0.
    pub height_m: f64,
    /// Coulomb coefficient between wheels and ground, 0 to 10.
    pub friction: f64,
    /// Fall \[m/s^2\], 9.81 unless set; more than 0.
    pub gravity_m_s2: f64,
}

impl Step {
    /// A step of this height \[m\], more than 0 up to 10, with this friction, 0 to 10, under a fall of 9.81 m/s^2.
    ///
    /// # Errors
    /// [`Error::Argument`] for numbers out of these ranges.
    ///
    /// ```
    /// let step = omni_bound::Step::new(0.05, 0.7)?;
    /// assert_eq!(step.gravity_m_s2, 9.81);
    /// assert!(omni_bound::Step::new(f64::NAN, 0.7).is_err());
    /// # Ok::<(), omni_bound::Error>(())
    /// ```
    pub fn new(height_m: f64, friction: f64) -> Result<Self, Error> {
        for (name, value, least) in [("height_m", height_m, 1e-6), ("friction", friction, 0.0)] {
            if !(least..=10.0).contains(&value) {
                let allowed = format!("{least} to 10");
                return Err(Error::Argument { name, value, allowed });
            }
        }
        Ok(Self {
            height_m,
            friction,
            gravity_m_s2: 9.81,
        })
    }
}
