//! Motion of the bodies of a linkage and of their wheels.

#[cfg(test)]
mod tests;

use super::tree::{Attitude, Linkage, MAX_HINGES};
use crate::Real;
use crate::scalar::is_plausible;

/// Attitude and rates of the bodies of a [`Linkage`], and the resulting motion of each wheel.
///
/// ```
/// use omni_core::linkage::{Attitude, CarriedWheel, Linkage};
/// // One body: the wheel ahead rises while the nose goes up.
/// let wheel = |x| CarriedWheel { body: 0, centre_m: [x, 0.0, 0.0] };
/// let linkage = Linkage::new(&[], &[wheel(0.2), wheel(-0.2), wheel(-0.2)])?;
/// let motion = linkage.motion(&Attitude { nose_up_rad_s: 1.0, ..Attitude::level() }, &[], &[]);
/// assert_eq!(motion.rise_m_s, [0.4, 0.0, 0.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "R: serde::Serialize",
        deserialize = "R: Real + serde::Deserialize<'de>"
    ))
)]
pub struct LinkageMotion<R, const N: usize> {
    /// Height of each wheel's centre above the base's origin \[m\].
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub height_m: [R; N],
    /// Its rate of rise relative to the wheels on the ground \[m/s\]. The reference is the median, because most wheels
    /// are on the ground; the lower median for an even number.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub rise_m_s: [R; N],
    #[cfg_attr(feature = "serde", serde(skip, default = "BodyMotion::flat"))]
    bodies: [BodyMotion<R>; MAX_HINGES + 1],
}

impl<R: Real, const N: usize> LinkageMotion<R, N> {
    /// On flat ground, at rest in its hinges.
    ///
    /// ```
    /// assert_eq!(omni_core::linkage::LinkageMotion::<f64, 4>::flat().rise_m_s, [0.0; 4]);
    /// ```
    #[must_use]
    pub const fn flat() -> Self {
        Self {
            height_m: [R::ZERO; N],
            rise_m_s: [R::ZERO; N],
            bodies: [BodyMotion::FLAT; MAX_HINGES + 1],
        }
    }

    /// Attitude and rates of the body in that slot: 0 is the base, others are the slots of [`Linkage::carrier`]. The
    /// base's values if there is no such body.
    ///
    /// ```
    /// use omni_core::linkage::{Attitude, LinkageMotion};
    /// assert_eq!(LinkageMotion::<f64, 4>::flat().attitude(0), &Attitude::level());
    /// ```
    #[inline]
    #[must_use]
    pub fn attitude(&self, slot: usize) -> &Attitude<R> {
        let [base, ..] = &self.bodies;
        &self.bodies.get(slot).unwrap_or(base).attitude
    }
}

/// Makes rates those against the wheels that stand: the lower median.
pub(super) fn against_those_that_stand<R: Real, const N: usize>(rises: &mut [R; N]) {
    let middle = N.saturating_sub(1) / 2;
    let stands = rises.iter().copied().find(|rise| {
        let (mut slower, mut not_faster) = (0, 0);
        for other in rises.iter() {
            slower += usize::from(other < rise);
            not_faster += usize::from(other <= rise);
        }
        slower <= middle && middle < not_faster
    });
    let stands = stands.unwrap_or(R::zero());
    for rise in rises {
        *rise -= stands;
    }
}

/// A body, and what it makes of points on it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct BodyMotion<R> {
    attitude: Attitude<R>,
    /// Height of its reference point, and of the tips of its axes above that.
    height_m: R,
    up: [R; 3],
    /// Their rates.
    rise_m_s: R,
    up_s: [R; 3],
    /// Cosines of the two angles, whose sines are `up`'s first.
    cosine: [R; 2],
}

impl<R: Real> BodyMotion<R> {
    const FLAT: Self = Self {
        attitude: Attitude::LEVEL,
        height_m: R::ZERO,
        up: [R::ZERO, R::ZERO, R::ONE],
        rise_m_s: R::ZERO,
        up_s: [R::ZERO; 3],
        cosine: [R::ONE; 2],
    };

    #[cfg(feature = "serde")]
    fn flat() -> [Self; MAX_HINGES + 1] {
        [Self::FLAT; MAX_HINGES + 1]
    }

    fn new(attitude: Attitude<R>, nose: (R, R), left: (R, R), height_m: R, rise_m_s: R) -> Self {
        let (nose_s, left_s) = (attitude.nose_up_rad_s, attitude.left_up_rad_s);
        Self {
            attitude,
            height_m,
            up: [nose.0, left.0, nose.1 * left.1],
            rise_m_s,
            up_s: [
                nose_s * nose.1,
                left_s * left.1,
                -(nose_s * nose.0 + left_s * left.0),
            ],
            cosine: [nose.1, left.1],
        }
    }

    /// Height of a point and its rate.
    fn at(&self, arm_m: &[R; 3]) -> (R, R) {
        let height = self.height_m + along(&self.up, arm_m);
        (height, self.rise_m_s + along(&self.up_s, arm_m))
    }
}

fn along<R: Real>(a: &[R; 3], arm: &[R; 3]) -> R {
    a[0] * arm[0] + a[1] * arm[1] + a[2] * arm[2]
}

/// Sine and cosine of an angle that no vehicle exceeds on its wheels: off by less than 1e-5 up to
/// 0.6 rad and 2e-4 up to 1 rad. A larger angle than a quarter turn is one.
fn small_angle<R: Real>(x: R) -> (R, R) {
    let most = R::frac_pi_2();
    let x = x.limited(-most, most);
    let z = x * x;
    let sine = x * (R::one() - z * (R::of(1.0 / 6.0) - z * R::of(1.0 / 120.0)));
    let cosine = R::one() - z * (R::of(0.5) - z * (R::of(1.0 / 24.0) - z * R::of(1.0 / 720.0)));
    (sine, cosine)
}

impl<R: Real, const N: usize> Linkage<R, N> {
    /// Motion of the wheels, from the base's attitude and rates and from the hinges: angles \[rad\] and rates \[rad/s\]
    /// in the order in which they were given. A hinge without a reading, or with one that is no number, stands at 0.
    /// O(N).
    ///
    /// Angles of parallel hinges add up exactly. For hinges at right angles the product of two angles is neglected: 1 %
    /// of an arm if both are 0.1 rad.
    ///
    /// ```
    /// use omni_core::linkage::{Attitude, CarriedWheel, Linkage};
    /// let wheel = |x, y| CarriedWheel { body: 0, centre_m: [x, y, 0.0] };
    /// let linkage = Linkage::new(&[], &[wheel(0.0, 0.2), wheel(0.0, -0.2), wheel(-0.3, 0.0)])?;
    /// let leaning = Attitude { left_up_rad: 0.1, ..Attitude::level() };
    /// let [left, right, rear] = linkage.motion(&leaning, &[], &[]).height_m;
    /// assert!(left > 0.0 && right < 0.0 && rear == 0.0); // above the origin
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn motion(&self, base: &Attitude<R>, hinges_rad: &[R], hinges_rad_s: &[R]) -> LinkageMotion<R, N> {
        let mut motion = LinkageMotion::flat();
        self.move_by(base, hinges_rad, hinges_rad_s, &mut motion);
        motion
    }

    /// As [`Linkage::motion`], into a motion that is kept from period to period.
    pub(crate) fn move_by(
        &self,
        base: &Attitude<R>,
        hinges_rad: &[R],
        hinges_rad_s: &[R],
        motion: &mut LinkageMotion<R, N>,
    ) {
        let read = |readings: &[R], index: usize| match readings.get(index) {
            Some(reading) if is_plausible(*reading) => *reading,
            _ => R::zero(),
        };
        let (nose, left) = (small_angle(base.nose_up_rad), small_angle(base.left_up_rad));
        let bodies = &mut motion.bodies;
        bodies[0] = BodyMotion::new(*base, nose, left, R::zero(), R::zero());
        for (k, joint) in self.joints.iter().take(self.hinge_count()).enumerate() {
            let [base_body, ..] = &*bodies;
            let parent = bodies.get(usize::from(joint.parent)).unwrap_or(base_body);
            let reading = usize::from(joint.reading);
            let (angle, rate) = (read(hinges_rad, reading), read(hinges_rad_s, reading));
            let mut attitude = parent.attitude;
            // Most hinges only pitch or only roll.
            let (mut nose, mut left) = ((parent.up[0], parent.cosine[0]), (parent.up[1], parent.cosine[1]));
            if joint.nose_up != R::zero() {
                attitude.nose_up_rad += joint.nose_up * angle;
                attitude.nose_up_rad_s += joint.nose_up * rate;
                nose = small_angle(attitude.nose_up_rad);
            }
            if joint.left_up != R::zero() {
                attitude.left_up_rad += joint.left_up * angle;
                attitude.left_up_rad_s += joint.left_up * rate;
                left = small_angle(attitude.left_up_rad);
            }
            let (height, rise) = parent.at(&joint.arm_m);
            if let Some(body) = bodies.get_mut(k + 1) {
                *body = BodyMotion::new(attitude, nose, left, height, rise);
            }
        }
        for i in 0..N {
            let [base, ..] = &motion.bodies;
            let body = motion.bodies.get(self.carrier(i)).unwrap_or(base);
            (motion.height_m[i], motion.rise_m_s[i]) = body.at(&self.arm_m[i]);
        }
        against_those_that_stand(&mut motion.rise_m_s);
    }
}
