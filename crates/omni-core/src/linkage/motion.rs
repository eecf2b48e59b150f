//! How the bodies of a linkage and the wheels on them move.

use super::{Attitude, Linkage, MAX_HINGES};
use crate::Real;
use crate::constants::each;

/// How the bodies of a [`Linkage`] stand and turn, and how each wheel moves with them.
///
/// ```
/// use omni_core::{Attitude, CarriedWheel, Linkage};
/// // One body: the wheel ahead rises while the nose goes up.
/// let wheel = |x| CarriedWheel { body: 0, centre_m: [x, 0.0, 0.0] };
/// let linkage = Linkage::new(&[], &[wheel(0.2), wheel(-0.2), wheel(-0.2)])?;
/// let motion = linkage.motion(&Attitude { nose_up_rad_s: 1.0, ..Attitude::level() }, &[], &[]);
/// assert_eq!(motion.rise_m_s, [0.4, 0.0, 0.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkageMotion<R, const N: usize> {
    /// Height of each wheel's centre above the base's origin \[m\].
    pub height_m: [R; N],
    /// How fast it rises against the wheels that stand \[m/s\]. Those that stand are the median: most wheels do, and where the halves are
    /// even the lower one does.
    pub rise_m_s: [R; N],
    bodies: Bodies<R>,
}

impl<R: Real, const N: usize> LinkageMotion<R, N> {
    /// On flat ground, at rest in its hinges.
    ///
    /// ```
    /// assert_eq!(omni_core::LinkageMotion::<f64, 4>::flat().rise_m_s, [0.0; 4]);
    /// ```
    #[must_use]
    pub const fn flat() -> Self {
        Self {
            height_m: [R::ZERO; N],
            rise_m_s: [R::ZERO; N],
            bodies: [Attitude::LEVEL; MAX_HINGES + 1],
        }
    }

    /// How the body in that slot points and turns: 0 is the base, others are [`Linkage::carrier`]'s. The base's where there is none.
    ///
    /// ```
    /// use omni_core::{Attitude, LinkageMotion};
    /// assert_eq!(LinkageMotion::<f64, 4>::flat().attitude(0), &Attitude::level());
    /// ```
    #[inline]
    #[must_use]
    pub fn attitude(&self, slot: usize) -> &Attitude<R> {
        attitude(&self.bodies, slot)
    }

    /// Takes what moves, with the first so many bodies.
    #[inline(always)]
    #[expect(
        clippy::manual_memcpy,
        reason = "unrolled: a call costs more than a few bodies"
    )]
    pub(crate) fn take(&mut self, moves: &WheelMotion<R, N>, bodies: &Bodies<R>, count: usize) {
        (self.height_m, self.rise_m_s) = (moves.height_m, moves.rise_m_s);
        self.bodies[0] = bodies[0];
        let count = count.min(MAX_HINGES);
        each!(k of count {
            self.bodies[k + 1] = bodies[k + 1];
        });
    }

    #[inline(always)]
    pub(crate) fn bodies(&self) -> &Bodies<R> {
        &self.bodies
    }
}

/// How bodies point and turn, by their slots. By themselves: where nobody else looks at them, what is worked out of a wheel stays in
/// registers, and what is not asked for is not worked out.
pub(crate) type Bodies<R> = [Attitude<R>; MAX_HINGES + 1];

/// How a body points and turns, the base's where there is none of that slot.
#[inline(always)]
pub(crate) fn attitude<R>(bodies: &Bodies<R>, slot: usize) -> &Attitude<R> {
    let [base, ..] = bodies;
    bodies.get(slot).unwrap_or(base)
}

/// How each wheel moves: as [`LinkageMotion`].
pub(crate) struct WheelMotion<R, const N: usize> {
    pub(crate) height_m: [R; N],
    pub(crate) rise_m_s: [R; N],
}

impl<R: Real, const N: usize> WheelMotion<R, N> {
    /// Makes the rates of wheels those against the lower median: against the wheel that stood last if that is still in the middle.
    #[inline(always)]
    pub(super) fn against_those_that_stand(&mut self, standing: &mut u16) {
        let mut median = one_of(&self.rise_m_s, *standing);
        let mut against = self.rise_m_s;
        let mut slower = 0;
        each!(i of N {
            against[i] -= median;
            slower += usize::from(against[i].is_sign_negative());
        });
        if slower != middle::<N>() {
            // Where several rise alike, the middle one may be of them.
            let mut faster = 0;
            each!(i of N {
                faster += usize::from((median - self.rise_m_s[i]).is_sign_negative());
            });
            if slower > middle::<N>() || N - faster <= middle::<N>() {
                (*standing, median) = stands(self.rise_m_s);
                each!(i of N {
                    against[i] = self.rise_m_s[i] - median;
                });
            }
        }
        self.rise_m_s = against;
    }
}

/// The number of that index, by a jump to where its register is taken; 0 where there is none.
#[inline(always)]
fn one_of<R: Real, const N: usize>(numbers: &[R; N], index: u16) -> R {
    let number = |k: usize| numbers.get(k).copied().unwrap_or(R::zero());
    match index {
        0 => number(0),
        1 => number(1),
        2 => number(2),
        3 => number(3),
        4 => number(4),
        5 => number(5),
        6 => number(6),
        7 => number(7),
        _ if N > 8 => number(usize::from(index)),
        _ => R::zero(),
    }
}

/// How many of the wheels are slower than the one that stands.
const fn middle<const N: usize>() -> usize {
    N.saturating_sub(1) / 2
}

/// The wheel whose rate is the lower median, and that rate.
#[inline(never)]
fn stands<R: Real, const N: usize>(rises: [R; N]) -> (u16, R) {
    let mut best = (0, R::zero());
    for (index, rise) in rises.iter().enumerate() {
        let (mut slower, mut not_faster) = (0, 0);
        for other in &rises {
            slower += usize::from(other < rise);
            not_faster += usize::from(other <= rise);
        }
        if slower <= middle::<N>() && middle::<N>() < not_faster {
            best = (index as u16, *rise);
            break;
        }
    }
    best
}

/// A body, and what it makes of points on it.
#[derive(Clone, Copy)]
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

    #[inline(always)]
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
    #[inline(always)]
    fn at(&self, arm_m: &[R; 3]) -> (R, R) {
        let height = self.height_m + along(&self.up, arm_m);
        (height, self.rise_m_s + along(&self.up_s, arm_m))
    }
}

/// Of arms along an axis, whose zeros are constants, nothing is multiplied.
#[inline(always)]
fn along<R: Real>(a: &[R; 3], arm: &[R; 3]) -> R {
    let mut sum = R::zero();
    let mut first = true;
    for (a, arm) in a.iter().zip(arm) {
        if *arm != R::zero() {
            sum = if first { *a * *arm } else { sum + *a * *arm };
            first = false;
        }
    }
    sum
}

/// Sine and cosine of an angle that no vehicle exceeds on its wheels: off by less than 1e-5 up to 0.6 rad and 2e-4 up to 1 rad. A larger
/// angle than a quarter turn is one.
#[inline(always)]
fn small_angle<R: Real, const UPRIGHT: bool>(x: R) -> (R, R) {
    if !UPRIGHT && x.abs() > R::frac_pi_2() {
        return quarter_turn(x);
    }
    series(x)
}

#[cold]
#[inline(never)]
fn quarter_turn<R: Real>(x: R) -> (R, R) {
    let most = R::frac_pi_2();
    series(x.limited(-most, most))
}

#[inline(always)]
fn series<R: Real>(x: R) -> (R, R) {
    let z = x * x;
    let sine = x * (R::one() - z * (R::of(1.0 / 6.0) - z * R::of(1.0 / 120.0)));
    let cosine = R::one() - z * (R::of(0.5) - z * (R::of(1.0 / 24.0) - z * R::of(1.0 / 720.0)));
    (sine, cosine)
}

impl<R: Real, const N: usize> Linkage<R, N> {
    /// As [`Linkage::motion`], with what says a hinge's angle and rate, which are numbers. `UPRIGHT`: no body is further from level than a
    /// quarter turn.
    #[inline(always)]
    pub(crate) fn move_by<const UPRIGHT: bool>(
        &self,
        base: &Attitude<R>,
        mut hinge: impl FnMut(usize) -> (R, R),
        bodies: &mut Bodies<R>,
        standing: &mut u16,
    ) -> WheelMotion<R, N> {
        let zero = R::zero();
        let attitudes = bodies;
        let mut motion = WheelMotion {
            height_m: [zero; N],
            rise_m_s: [zero; N],
        };
        // Gone where the tree is a constant, which is known body by body.
        let mut bodies = [BodyMotion::FLAT; MAX_HINGES + 1];
        bodies[0] = BodyMotion::new(
            *base,
            small_angle::<R, UPRIGHT>(base.nose_up_rad),
            small_angle::<R, UPRIGHT>(base.left_up_rad),
            zero,
            zero,
        );
        attitudes[0] = *base;
        let count = self.hinge_count().min(MAX_HINGES);
        each!(k of count {
            let joint = &self.joints[k];
            let [base_body, ..] = &bodies;
            let parent = *bodies.get(usize::from(joint.parent)).unwrap_or(base_body);
            let (angle, rate) = hinge(usize::from(joint.reading));
            let mut attitude = parent.attitude;
            // Most hinges only pitch or only roll.
            let (mut nose, mut left) = ((parent.up[0], parent.cosine[0]), (parent.up[1], parent.cosine[1]));
            if joint.nose_up != zero {
                attitude.nose_up_rad += joint.nose_up * angle;
                attitude.nose_up_rad_s += joint.nose_up * rate;
                nose = small_angle::<R, UPRIGHT>(attitude.nose_up_rad);
            }
            if joint.left_up != zero {
                attitude.left_up_rad += joint.left_up * angle;
                attitude.left_up_rad_s += joint.left_up * rate;
                left = small_angle::<R, UPRIGHT>(attitude.left_up_rad);
            }
            let (height, rise) = parent.at(&joint.arm_m);
            bodies[k + 1] = BodyMotion::new(attitude, nose, left, height, rise);
            attitudes[k + 1] = attitude;
        });
        each!(i of N {
            let [base, ..] = &bodies;
            let (height, rise) = bodies.get(self.carrier(i)).unwrap_or(base).at(&self.arm_m[i]);
            (motion.height_m[i], motion.rise_m_s[i]) = (height, rise);
        });
        motion.against_those_that_stand(standing);
        motion
    }
}
