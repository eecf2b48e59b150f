//! How a vehicle moves, by its own sensors.

use crate::linkage::{Bodies, WheelMotion};
use crate::{LinkageMotion, Real, WheelVelocities};

/// How the vehicle moves: what [`super::Traction::observe`] makes of a period's readings.
///
/// ```
/// use omni_core::{BodyTwist, Readings, TractionState};
/// # use omni_core::{CarriedWheel, Kinematics, Linkage, TorqueLimit, Traction, TractionConfig, TractionWheel, WheelLayout};
/// # let wheel = TractionWheel { limit: TorqueLimit::constant(2.0)?, inertia_kg_m2: 0.002, carrier: [1.0, 0.0], place_m: [0.0; 2] };
/// # let linkage = Linkage::new(&[], &[CarriedWheel { body: 0, centre_m: [0.0; 3] }; 4])?;
/// # let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1_f64)?)?;
/// # let mut config = TractionConfig::steady(0.3, 2.0, 1e-3);
/// config.speed_s = 0.0; // follows at once
/// config.acceleration_m_s2 = 1e6;
/// let traction = Traction::new(kinematics, linkage, [wheel; 4], config)?;
/// let mut state = TractionState::new();
/// // The third wheel is the slowest of a vehicle that goes ahead: the others slip.
/// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let observed = traction.observe(&mut state, &Readings::new(ahead, &[3.0, 3.5, 2.0, 3.0]));
/// assert_eq!(observed.believed, Some(2));
/// assert!((observed.speed_m_s - 0.2).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TractionObservation<R, const N: usize> {
    /// Speed along the direction of travel \[m/s\].
    pub speed_m_s: R,
    /// The wheel that it is from; none where no driven wheel is heard.
    pub believed: Option<usize>,
    /// Yaw rate, by the gyro less its zero, or by the wheels where there is none \[rad/s\].
    pub yaw_rad_s: R,
    /// How the wheels rise, and what carries them turns.
    pub motion: LinkageMotion<R, N>,
    /// Rate of each wheel, 0 of those that are not heard, and which are; wheel i is bit i.
    pub(super) measured: WheelVelocities<R, N>,
    pub(super) heard: u32,
    /// Rate of each wheel less what its encoder sees of its carrier \[rad/s\].
    pub(super) free_rad_s: [R; N],
}

impl<R: Real, const N: usize> TractionObservation<R, N> {
    /// At rest on flat ground, by no wheel: what [`super::Traction::observe_into`] fills.
    ///
    /// ```
    /// assert_eq!(omni_core::TractionObservation::<f64, 4>::zero().believed, None);
    /// ```
    #[must_use]
    pub const fn zero() -> Self {
        Self {
            speed_m_s: R::ZERO,
            believed: None,
            yaw_rad_s: R::ZERO,
            motion: LinkageMotion::flat(),
            measured: WheelVelocities::zero(),
            heard: 0,
            free_rad_s: [R::ZERO; N],
        }
    }
}

/// What an observation is made of.
pub(super) struct Seen<R, const N: usize> {
    pub(super) measured: [R; N],
    pub(super) heard: u32,
    pub(super) free_rad_s: [R; N],
    pub(super) moves: WheelMotion<R, N>,
    pub(super) yaw_rad_s: R,
    pub(super) believed: Option<usize>,
}

/// What torques are made of.
pub(super) struct Look<'a, R, const N: usize> {
    pub(super) measured: &'a [R; N],
    pub(super) heard: u32,
    pub(super) free_rad_s: &'a [R; N],
    pub(super) rise_m_s: &'a [R; N],
    pub(super) bodies: &'a Bodies<R>,
    pub(super) yaw_rad_s: R,
    pub(super) believed: Option<usize>,
}

impl<R: Real, const N: usize> Seen<R, N> {
    #[inline(always)]
    pub(super) fn look<'a>(&'a self, bodies: &'a Bodies<R>) -> Look<'a, R, N> {
        Look {
            measured: &self.measured,
            heard: self.heard,
            free_rad_s: &self.free_rad_s,
            rise_m_s: &self.moves.rise_m_s,
            bodies,
            yaw_rad_s: self.yaw_rad_s,
            believed: self.believed,
        }
    }
}

impl<R: Real, const N: usize> TractionObservation<R, N> {
    #[inline(always)]
    pub(super) fn look(&self) -> Look<'_, R, N> {
        Look {
            measured: &self.measured.rad_s,
            heard: self.heard,
            free_rad_s: &self.free_rad_s,
            rise_m_s: &self.motion.rise_m_s,
            bodies: self.motion.bodies(),
            yaw_rad_s: self.yaw_rad_s,
            believed: self.believed,
        }
    }
}
