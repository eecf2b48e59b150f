//! The tree of a vehicle's bodies, joined by passive hinges.

use crate::constants::constant_struct;
use crate::error::within;
use crate::policy::Imu;
use crate::scalar::all_plausible;
use crate::{ConfigError, Real};

/// Largest number of hinges of a vehicle.
pub const MAX_HINGES: usize = 8;

/// A passive hinge between two bodies of a tree, as the vehicle stands on flat ground.
///
/// ```
/// use omni_core::linkage::HingeGeometry;
/// // A front frame that pitches about the middle wheel's axle. Positive is nose down: the right-hand rule about y.
/// let pitch = HingeGeometry { parent: 0, child: 1, axis: [0.0, 1.0, 0.0], anchor_m: [0.0, 0.0, 0.066] };
/// assert_eq!((pitch.parent, pitch.child), (0, 1)); // body 0 is the base
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HingeGeometry<R> {
    /// Body on the side of the base; 0 is the base, which has the inertial measurement unit.
    pub parent: usize,
    /// Body that it carries.
    pub child: usize,
    /// Unit vector of the axis: x forward, y left, z up. A positive angle turns the child by the right-hand rule.
    pub axis: [R; 3],
    /// A point of the axis \[m\], each within +-100 m.
    pub anchor_m: [R; 3],
}

/// A wheel and its carrier.
///
/// ```
/// use omni_core::linkage::CarriedWheel;
/// let wheel = CarriedWheel { body: 1, centre_m: [0.30, -0.23, 0.066] };
/// assert_eq!(wheel.body, 1); // of the front frame
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CarriedWheel<R> {
    /// The body, 0 for the base.
    pub body: usize,
    /// Its centre as the vehicle stands on flat ground \[m\], each within +-100 m.
    pub centre_m: [R; 3],
}

/// A hinge on the way from the base outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
#[doc(hidden)]
pub struct Joint<R> {
    /// Slot of the parent, and which of the readings is its angle.
    pub(super) parent: u16,
    pub(super) reading: u16,
    /// What a radian of it adds to how the child's nose, and its left side, point up.
    pub(super) nose_up: R,
    pub(super) left_up: R,
    /// From the parent's reference point to its own \[m\].
    pub(super) arm_m: [R; 3],
}

constant_struct!(Joint<R> { parent: u16, reading: u16, nose_up: R, left_up: R, arm_m: [R; 3] });

/// Attitude and rates of a body: up is positive for its nose and for its left side.
///
/// ```
/// use omni_core::linkage::Attitude;
/// use omni_core::policy::Imu;
/// let mut imu = Imu::level();
/// (imu.pitch_rad, imu.rate_rad_s[1]) = (0.1, -0.5); // nose up, and going up: to turn about y by the right-hand rule is nose down
/// let attitude = Attitude::of_imu(&imu);
/// assert_eq!((attitude.nose_up_rad, attitude.nose_up_rad_s, attitude.left_up_rad), (0.1, 0.5, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Attitude<R> {
    /// Angle of its x axis above the horizon \[rad\].
    pub nose_up_rad: R,
    /// Angle of its y axis above the horizon \[rad\].
    pub left_up_rad: R,
    /// Rate of the first \[rad/s\].
    pub nose_up_rad_s: R,
    /// Rate of the second \[rad/s\].
    pub left_up_rad_s: R,
}

impl<R: Real> Attitude<R> {
    pub(crate) const LEVEL: Self = Self {
        nose_up_rad: R::ZERO,
        left_up_rad: R::ZERO,
        nose_up_rad_s: R::ZERO,
        left_up_rad_s: R::ZERO,
    };

    /// Level and at rest.
    ///
    /// ```
    /// assert_eq!(omni_core::linkage::Attitude::<f32>::level().nose_up_rad, 0.0);
    /// ```
    #[must_use]
    pub fn level() -> Self {
        Self::LEVEL
    }

    /// The base's attitude, from its inertial measurement unit; level if that is silent ([`Imu::silent`]).
    ///
    /// ```
    /// use omni_core::linkage::Attitude;
    /// use omni_core::policy::Imu;
    /// assert_eq!(Attitude::of_imu(&Imu::<f64>::silent()), Attitude::level());
    /// let mut imu = Imu::level();
    /// imu.roll_rad = 0.2;
    /// assert_eq!(Attitude::of_imu(&imu).left_up_rad, 0.2);
    /// ```
    #[must_use]
    pub fn of_imu(imu: &Imu<R>) -> Self {
        let read = Self::read(imu);
        let values = [
            read.nose_up_rad,
            read.left_up_rad,
            read.nose_up_rad_s,
            read.left_up_rad_s,
        ];
        if all_plausible(&values) {
            read
        } else {
            Self::level()
        }
    }

    /// As [`Attitude::of_imu`] of one that says numbers.
    #[inline(always)]
    pub(crate) fn read(imu: &Imu<R>) -> Self {
        Self {
            nose_up_rad: imu.pitch_rad,
            left_up_rad: imu.roll_rad,
            nose_up_rad_s: -imu.rate_rad_s[1],
            left_up_rad_s: imu.rate_rad_s[0],
        }
    }
}

/// The tree of a vehicle's bodies, and the wheels on it.
///
/// ```
/// use omni_core::linkage::{Attitude, CarriedWheel, HingeGeometry, Linkage};
/// // Two wheels on the base, one ahead on a frame that pitches about the base's origin.
/// let pitch = HingeGeometry { parent: 0, child: 1, axis: [0.0, 1.0, 0.0], anchor_m: [0.0; 3] };
/// let wheel = |body, x, y| CarriedWheel { body, centre_m: [x, y, 0.0] };
/// let linkage = Linkage::new(&[pitch], &[wheel(0, -0.3, -0.2), wheel(0, -0.3, 0.2), wheel(1, 0.3, 0.0)])?;
/// // The hinge turns by -0.1 rad, nose up, at -0.5 rad/s: the front wheel rises.
/// let motion = linkage.motion(&Attitude::level(), &[-0.1], &[-0.5]);
/// assert!((motion.height_m[2] - 0.3 * 0.1_f64.sin()).abs() < 1e-6);
/// assert!((motion.rise_m_s[2] - 0.3 * 0.1_f64.cos() * 0.5).abs() < 1e-6);
/// assert_eq!((motion.rise_m_s[0], motion.attitude(linkage.carrier(2)).nose_up_rad_s), (0.0, 0.5));
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Linkage<R, const N: usize> {
    pub(super) joints: [Joint<R>; MAX_HINGES],
    pub(super) count: u16,
    /// Slot of the carrier of each wheel: 0 the base, k + 1 the child of joint k.
    pub(super) carrier: [u16; N],
    /// From the carrier's reference point to each wheel \[m\].
    pub(super) arm_m: [[R; 3]; N],
}

constant_struct!(Linkage<R, const N> {
    joints: [Joint<R>; MAX_HINGES], count: u16, carrier: [u16; N], arm_m: [[R; 3]; N]
});

impl<R: Real, const N: usize> Linkage<R, N> {
    /// A linkage from a tree of hinges, in any order, and the carriers of the wheels. Turns of hinges about vertical
    /// axes lift nothing and are left out of account.
    ///
    /// # Errors
    /// Parameter `hinges` for more than [`MAX_HINGES`]; `hinge.child` or `hinge.parent` if they form no tree whose root
    /// is body 0, with the index of the hinge; `hinge.axis`, `hinge.anchor_m`, `wheel.body`, `wheel.centre_m`.
    pub fn new(hinges: &[HingeGeometry<R>], wheels: &[CarriedWheel<R>; N]) -> Result<Self, ConfigError> {
        if hinges.len() > MAX_HINGES {
            return Err(ConfigError::new("hinges", hinges.len() as f64, "8 at most"));
        }
        for (index, hinge) in hinges.iter().enumerate() {
            check(hinge, hinges).map_err(|error| error.at(index))?;
        }
        let nothing = Joint {
            parent: 0,
            reading: 0,
            nose_up: R::zero(),
            left_up: R::zero(),
            arm_m: [R::zero(); 3],
        };
        let mut linkage = Self {
            joints: [nothing; MAX_HINGES],
            count: 0,
            carrier: [0; N],
            arm_m: [[R::zero(); 3]; N],
        };
        // From the base outwards: bodies that have their place so far, and their reference points.
        let mut bodies = [(0, [R::zero(); 3]); MAX_HINGES + 1];
        for count in 0..hinges.len() {
            let placed = &bodies[..=count];
            let slot = |body: usize| placed.iter().position(|(placed, _)| *placed == body);
            let next = hinges.iter().enumerate().find_map(|(reading, hinge)| {
                let parent = slot(hinge.parent)?;
                slot(hinge.child).is_none().then_some((reading, hinge, parent))
            });
            let Some((reading, hinge, parent)) = next else {
                let lost = hinges.iter().position(|hinge| slot(hinge.child).is_none());
                let index = lost.unwrap_or(0);
                let parent = hinges.get(index).map_or(0, |hinge| hinge.parent);
                let error = ConfigError::new(
                    "hinge.parent",
                    parent as f64,
                    "a body that hinges join to the base, body 0",
                );
                return Err(error.at(index));
            };
            linkage.joints[count] = Joint {
                parent: parent as u16,
                reading: reading as u16,
                nose_up: -hinge.axis[1],
                left_up: hinge.axis[0],
                arm_m: less(&hinge.anchor_m, &placed[parent].1),
            };
            linkage.count += 1;
            bodies[count + 1] = (hinge.child, hinge.anchor_m);
        }
        for (index, wheel) in wheels.iter().enumerate() {
            let placed = &bodies[..=hinges.len()];
            let Some(slot) = placed.iter().position(|(body, _)| *body == wheel.body) else {
                return Err(
                    ConfigError::new("wheel.body", wheel.body as f64, "0 or the child of a hinge").at(index),
                );
            };
            for each in wheel.centre_m {
                within("wheel.centre_m", each, -100.0..=100.0, "-100 to 100")
                    .map_err(|error| error.at(index))?;
            }
            linkage.carrier[index] = slot as u16;
            linkage.arm_m[index] = less(&wheel.centre_m, &placed[slot].1);
        }
        Ok(linkage)
    }

    /// Number of hinges, which is the number of readings that [`Linkage::motion`] uses.
    ///
    /// ```
    /// use omni_core::linkage::{CarriedWheel, Linkage};
    /// let linkage = Linkage::new(&[], &[CarriedWheel { body: 0, centre_m: [0.0_f32; 3] }; 3])?;
    /// assert_eq!(linkage.hinge_count(), 0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn hinge_count(&self) -> usize {
        usize::from(self.count)
    }

    /// The slot of the body that carries a wheel, as
    /// [`LinkageMotion::attitude`](crate::linkage::LinkageMotion::attitude) counts them: 0 is the base.
    ///
    /// ```
    /// use omni_core::linkage::{CarriedWheel, HingeGeometry, Linkage};
    /// let pitch = HingeGeometry { parent: 0, child: 7, axis: [0.0, 1.0, 0.0], anchor_m: [0.0; 3] };
    /// let wheel = |body| CarriedWheel { body, centre_m: [0.0; 3] };
    /// let linkage = Linkage::new(&[pitch], &[wheel(7), wheel(0), wheel(0)])?;
    /// assert_eq!([0, 1, 2].map(|wheel| linkage.carrier(wheel)), [1, 0, 0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn carrier(&self, wheel: usize) -> usize {
        self.carrier.get(wheel).copied().map_or(0, usize::from)
    }
}

/// Speed along its push of a wheel that rolls without slip \[m/s\], signed as `push_m_s`: the speed that the ground
/// imposes on a wheel that moves over it with `ground_m_s` >= 0, of which `push_m_s` along its push, and rises with
/// `rise_m_s`.
///
/// It rolls in the plane of its centre's motion: a wheel that points forward rolls up the edge, along the hypotenuse; a
/// transverse wheel is not affected.
///
/// ```
/// use omni_core::linkage::rolled_speed;
/// assert_eq!(rolled_speed(3.0, 3.0, 4.0), 5.0);
/// assert_eq!(rolled_speed(-3.0, 3.0, 4.0), -5.0);
/// assert_eq!(rolled_speed(0.0, 3.0, 4.0), 0.0); // crosswise
/// assert_eq!(rolled_speed(0.2, 0.3, 0.0), 0.2); // flat ground
/// ```
#[must_use]
pub fn rolled_speed<R: Real>(push_m_s: R, ground_m_s: R, rise_m_s: R) -> R {
    let rise = rise_m_s * rise_m_s;
    if rise < R::of(NO_RISE) {
        return push_m_s;
    }
    if ground_m_s > R::zero() {
        let part = push_m_s / ground_m_s;
        part * rolled(ground_m_s * ground_m_s, rise, part * part)
    } else {
        R::zero()
    }
}

/// Slower than a tenth of a millimetre a second is no rise, and the root of next to nothing is not
/// taken: its square \[m^2/s^2\].
pub(crate) const NO_RISE: f64 = 1e-8;

/// [`rolled_speed`] over the cosine between the push and the way, from the squares of the speed
/// over the ground, the rise and the cosine.
#[inline(always)]
pub(crate) fn rolled<R: Real>(ground: R, rise: R, cosine: R) -> R {
    (ground + rise) * (ground + cosine * rise).per_root()
}

fn less<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn check<R: Real>(hinge: &HingeGeometry<R>, all: &[HingeGeometry<R>]) -> Result<(), ConfigError> {
    let length = hinge.axis.iter().fold(R::zero(), |sum, each| sum + *each * *each);
    within("hinge.axis", length, 0.999..=1.001, "a vector of length 1")?;
    for each in hinge.anchor_m {
        within("hinge.anchor_m", each, -100.0..=100.0, "-100 to 100")?;
    }
    let carried = all.iter().filter(|other| other.child == hinge.child).count();
    if hinge.child == 0 || carried > 1 {
        let allowed = "a body that is no other hinge's child and not the base, 0";
        return Err(ConfigError::new("hinge.child", hinge.child as f64, allowed));
    }
    Ok(())
}
