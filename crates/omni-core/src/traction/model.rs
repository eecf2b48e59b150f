//! A vehicle's numbers as traction control needs them, checked once.

use super::config::{TractionConfig, TractionTimes, TractionWheel};
use crate::constants::constant_struct;
use crate::geometry::Kinematics;
use crate::linkage::Linkage;
use crate::motor::TorqueLimits;
use crate::scalar::{largest, min};
use crate::{ConfigError, Real};

/// Part of its motor's torque against the thrust from which on a wheel brakes.
pub(super) const BRAKING_PART: f64 = 0.025;
/// Part of the target up to which no wheel is slowed down, whatever speed is measured. 1 would
/// leave wheels spinning that have no load, and twice as much of their spread.
pub(super) const BACK_PART: f64 = 0.5;
/// A wheel that rises faster climbs \[m/s\].
pub(super) const CLIMBS_M_S: f64 = 0.02;

/// Traction control of one vehicle. Immutable; its state is a
/// [`TractionState`](crate::traction::TractionState).
///
/// ```
/// use omni_core::traction::{Traction, TractionState, TractionTarget};
/// use omni_core::{BodyTwist, Readings};
/// # use omni_core::linkage::{CarriedWheel, Linkage};
/// # use omni_core::traction::{TractionConfig, TractionWheel};
/// # use omni_core::{Kinematics, TorqueLimit, WheelLayout};
/// # let layout = WheelLayout::chugo7(0.30, 0.23, 0.066)?;
/// # let wheel = |place_m: [f64; 2]| TractionWheel { limit: TorqueLimit::constant(2.0).unwrap(), inertia_kg_m2: 0.002178, carrier: [1.0, 0.0], place_m };
/// # let places = [[-0.3, -0.23], [-0.3, 0.0], [-0.3, 0.23], [0.0, 0.0], [0.3, -0.23], [0.3, 0.0], [0.3, 0.23]];
/// # let wheels = places.map(wheel);
/// # let linkage = Linkage::new(&[], &places.map(|[x, y]| CarriedWheel { body: 0, centre_m: [x, y, 0.066] }))?;
/// # let config = TractionConfig::traction(0.3, 2.0, 1e-3);
/// let traction = Traction::new(Kinematics::new(&layout)?, linkage, wheels, config)?;
/// let mut state = TractionState::new();
/// // At rest, commanded to go ahead at 0.3 m/s: every wheel that points ahead gives the same, those across nothing.
/// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let sample = traction.step(&mut state, &Readings::new(ahead, &[0.0; 7]), &TractionTarget::at(0.3));
/// assert_eq!(sample.speed_m_s, 0.0);
/// assert_eq!(sample.wheels.applied.n_m.map(|torque| torque.signum() * f64::from(torque != 0.0)), [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Traction<R, const N: usize> {
    pub(super) kinematics: Kinematics<R, N>,
    pub(super) linkage: Linkage<R, N>,
    pub(super) limits: TorqueLimits<R, N>,
    pub(super) inertia_kg_m2: [R; N],
    pub(super) carrier: [[R; 2]; N],
    /// Way along the push per turn of the actuator \[m/rad\].
    pub(super) way_m_rad: [R; N],
    pub(super) place_m: [[R; 2]; N],
    pub(super) config: TractionConfig<R>,
    pub(super) times: TractionTimes<R>,
    /// Largest rate of a wheel per yaw rate.
    pub(super) per_yaw: R,
    /// Inverses of how far the outermost wheels are to the side, for travel along x and along y \[1/m\].
    pub(super) per_lever: [R; 2],
}

constant_struct!(Traction<R, const N> {
    kinematics: Kinematics<R, N>, linkage: Linkage<R, N>, limits: TorqueLimits<R, N>, inertia_kg_m2: [R; N], carrier: [[R; 2]; N],
    way_m_rad: [R; N], place_m: [[R; 2]; N], config: TractionConfig<R>, times: TractionTimes<R>, per_yaw: R,
    per_lever: [R; 2]
});

impl<R: Real, const N: usize> Traction<R, N> {
    /// For a vehicle whose wheels are in the order of `kinematics`.
    ///
    /// # Errors
    /// Whatever of the configuration is out of its range: [`TractionConfig`], [`TractionWheel`] with the wheel's index.
    pub fn new(
        kinematics: Kinematics<R, N>,
        linkage: Linkage<R, N>,
        wheels: [TractionWheel<R>; N],
        config: TractionConfig<R>,
    ) -> Result<Self, ConfigError> {
        config.check()?;
        for (index, wheel) in wheels.iter().enumerate() {
            wheel.check().map_err(|error| error.at(index))?;
        }
        let inverse = |x: R| if x > R::zero() { R::one() / x } else { R::zero() };
        let rows = kinematics.inverse_matrix();
        let way_m_rad = rows.map(|[x, y, _]| inverse((x * x + y * y).sqrt()));
        let per_yaw = largest(rows.map(|row| row[2].abs()));
        let way_m = largest(way_m_rad);
        let torque_n_m = wheels.iter().fold(R::of(1e6), |least, wheel| {
            min(least, wheel.limit.range(R::zero()).upper_n_m)
        });
        let inertia_kg_m2 = largest(wheels.map(|wheel| wheel.inertia_kg_m2));
        Ok(Self {
            times: TractionTimes::new(&config, inertia_kg_m2, torque_n_m, way_m, per_yaw * way_m),
            per_yaw,
            per_lever: [1, 0]
                .map(|axis: usize| inverse(largest(wheels.map(|wheel| wheel.place_m[axis].abs())))),
            limits: TorqueLimits::new(&wheels.map(|wheel| wheel.limit)),
            inertia_kg_m2: wheels.map(|wheel| wheel.inertia_kg_m2),
            carrier: wheels.map(|wheel| wheel.carrier),
            way_m_rad,
            place_m: wheels.map(|wheel| wheel.place_m),
            kinematics,
            linkage,
            config,
        })
    }

    /// Its kinematics.
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics<R, N> {
        &self.kinematics
    }

    pub(crate) fn period_s(&self) -> R {
        self.config.period_s
    }

    /// Rate of a wheel's actuator per yaw rate.
    #[inline(always)]
    pub(super) fn turned_by(&self, wheel: usize) -> R {
        self.kinematics.inverse_matrix()[wheel][2]
    }
}
