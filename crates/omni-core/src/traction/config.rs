//! What a traction control is configured with.

use super::larger;
use crate::constants::constant_struct;
use crate::error::{each_within, period, within};
use crate::{ConfigError, Real, TorqueLimit};

/// A wheel as traction control sees it.
///
/// ```
/// use omni_core::{TorqueLimit, TractionWheel};
/// let wheel = TractionWheel { limit: TorqueLimit::constant(2.0)?, inertia_kg_m2: 0.002178, carrier: [1.0, 0.0], place_m: [0.30, -0.23] };
/// assert!(wheel.place_m[1] < 0.0); // on the right
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TractionWheel<R> {
    /// What its actuator gives.
    pub limit: TorqueLimit<R>,
    /// Inertia of wheel, gear and motor at the actuator \[kg.m^2\], 1e-22 to 1e6.
    pub inertia_kg_m2: R,
    /// Rate that its encoder reads per rate at which the nose, and the left side, of its carrier go up: the direction in which the wheel
    /// rolls over its gear, negative where its actuator is mounted the other way round. Each within +-1e6.
    pub carrier: [R; 2],
    /// Where it stands: x forward, y left of the vehicle's origin \[m\], each within +-100 m.
    pub place_m: [R; 2],
}

impl<R: Real> TractionWheel<R> {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        within("inertia_kg_m2", self.inertia_kg_m2, 1e-22..=1e6, "1e-22 to 1e6")?;
        for carrier in self.carrier {
            within("carrier", carrier, -1e6..=1e6, "-1e6 to 1e6")?;
        }
        for place in self.place_m {
            within("place_m", place, -100.0..=100.0, "-100 to 100")?;
        }
        Ok(())
    }
}

/// Gains and times of a traction control. Start from [`TractionConfig::steady`] or [`TractionConfig::reach`].
///
/// Gains beside the thrust's own are in multiples of it, so that they fit another vehicle as soon as that one does.
///
/// ```
/// use omni_core::TractionConfig;
/// let config = TractionConfig::steady(0.3_f64, 2.0, 1e-3);
/// assert!(config.thrust_gain_n_m_s_rad > 0.7 && config.soft_part == 0.25);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TractionConfig<R> {
    /// Control period \[s\], 1e-6 to 10.
    pub period_s: R,
    /// Angle of the actuator that one count of its encoder is \[rad\], 0 to 10: readings are whole counts over the period; 0: they are not.
    /// [`TractionConfig::with_counts`] fits the times to it.
    pub encoder_rad: R,
    /// Thrust of every driven wheel per lack of speed, as a rate of its actuator \[N.m.s/rad\], 0 to 1e6.
    pub thrust_gain_n_m_s_rad: R,
    /// The same per integral of it \[N.m/rad\], 0 to 1e6: what carries the vehicle up a ramp. It does not wind up at the limit.
    pub thrust_integral_n_m_rad: R,
    /// Part of the gain that is left where next to no speed is lacking, 0 to 1; 1 leaves it whole.
    pub soft_part: R,
    /// Inverse of the lack at which the whole gain is there \[s/rad\], 0 to 1e6.
    pub soft_s_rad: R,
    /// Gains of wheels that point across the way: their rate follows the vehicle's motion \[N.m.s/rad, N.m/rad\], 0 to 1e6.
    pub free_gain_n_m_s_rad: R,
    /// The second of them.
    pub free_integral_n_m_rad: R,
    /// Time constant of the measured speed \[s\], 0 to 10; one period or less follows at once.
    pub speed_s: R,
    /// The measured speed rises no faster \[m/s^2\], 0.001 to 1e6.
    pub acceleration_m_s2: R,
    /// Time constant of the rates of hinges and base \[s\], 0 to 10.
    pub rates_s: R,
    /// Time in which a wheel's slip is taken out, by its own inertia \[s\], two control periods to 10.
    pub slip_s: R,
    /// Slip that is left alone, as a speed of the rim \[m/s\], 0 to 100.
    pub slip_free_m_s: R,
    /// Slip beyond that at which a wheel gives what the ground takes and nothing of the common thrust \[m/s\], 1e-6 to 100.
    pub slip_width_m_s: R,
    /// Time constant of the estimate of what the ground takes \[s\], 0 to 10.
    pub contact_s: R,
    /// Yaw rate that wheels are meant to have per heading error \[1/s\], 0 to 1000.
    pub heading_per_s: R,
    /// Thrust per heading error: this times the thrust's gain times the wheel's rate per yaw rate \[1/s\], 0 to 1000.
    pub heading_thrust_per_s: R,
    /// The same per error of the yaw rate, 0 to 100.
    pub yaw_damping: R,
    /// The higher wheel of a row pushes less: this times the thrust's gain, per angle of its carrier \[1/s\], 0 to 1000.
    pub levelling_per_s: R,
    /// Part of the largest thrust from which on rows are levelled, 0 to 0.99.
    pub levelling_from: R,
    /// Time constant with which the heading error is given up while the vehicle leans on a riser to square up \[s\], 0.001 to 1000.
    pub squaring_s: R,
    /// Longest memory of the gyro's zero \[s\], 0 to 3600; 0 leaves the zero as it is.
    pub gyro_zero_s: R,
    /// It is found only below this part of the largest thrust, 0 to 1.
    pub gyro_zero_part: R,
}

constant_struct!(TractionConfig<R> {
    period_s: R, encoder_rad: R, thrust_gain_n_m_s_rad: R, thrust_integral_n_m_rad: R, soft_part: R, soft_s_rad: R, free_gain_n_m_s_rad: R,
    free_integral_n_m_rad: R, speed_s: R, acceleration_m_s2: R, rates_s: R, slip_s: R, slip_free_m_s: R, slip_width_m_s: R,
    contact_s: R, heading_per_s: R, heading_thrust_per_s: R, yaw_damping: R, levelling_per_s: R, levelling_from: R, squaring_s: R,
    gyro_zero_s: R, gyro_zero_part: R
});

impl<R: Real> TractionConfig<R> {
    /// Keeps the wheels together: least slip, heat and force. From the gains of a wheel's velocity loop \[N.m.s/rad, N.m/rad\] and the
    /// control period \[s\]. Slip is taken out within 7.5 ms, or five periods where they are longer: faster than that it swings.
    ///
    /// ```
    /// use omni_core::TractionConfig;
    /// let (one, stiffer) = (TractionConfig::steady(0.3, 2.0, 1e-3), TractionConfig::steady(0.6, 4.0, 1e-3));
    /// assert_eq!(stiffer.thrust_gain_n_m_s_rad, 2.0 * one.thrust_gain_n_m_s_rad);
    /// ```
    #[must_use]
    pub fn steady(kp_n_m_s_rad: R, ki_n_m_rad: R, period_s: R) -> Self {
        let of = R::of;
        Self {
            period_s,
            encoder_rad: R::zero(),
            thrust_gain_n_m_s_rad: of(2.47) * kp_n_m_s_rad,
            thrust_integral_n_m_rad: of(0.5) * ki_n_m_rad,
            soft_part: of(0.25),
            soft_s_rad: of(1.0 / 1.26),
            free_gain_n_m_s_rad: kp_n_m_s_rad,
            free_integral_n_m_rad: ki_n_m_rad,
            speed_s: of(8.4e-3),
            acceleration_m_s2: of(6.0),
            rates_s: of(17.3e-3),
            slip_s: larger(of(7.5e-3), of(5.0) * period_s),
            slip_free_m_s: of(4e-3),
            slip_width_m_s: of(22e-3),
            contact_s: of(2.7e-3),
            heading_per_s: of(3.0),
            heading_thrust_per_s: of(1.0),
            yaw_damping: of(0.05),
            levelling_per_s: of(8.0),
            levelling_from: of(0.5),
            squaring_s: of(45e-3),
            gyro_zero_s: of(2.0),
            gyro_zero_part: of(0.4),
        }
    }

    /// Gets over the highest steps: rows are levelled under more load only, but faster. As [`TractionConfig::steady`] otherwise.
    ///
    /// ```
    /// use omni_core::TractionConfig;
    /// let (reach, steady) = (TractionConfig::reach(0.3, 2.0, 1e-3), TractionConfig::steady(0.3, 2.0, 1e-3));
    /// assert!(reach.levelling_from > steady.levelling_from);
    /// assert_eq!((reach.soft_part, steady.soft_part), (0.25, 0.25));
    /// ```
    #[must_use]
    pub fn reach(kp_n_m_s_rad: R, ki_n_m_rad: R, period_s: R) -> Self {
        let of = R::of;
        Self {
            heading_per_s: of(3.38),
            heading_thrust_per_s: of(0.640),
            yaw_damping: of(0.1341),
            levelling_per_s: of(10.19),
            levelling_from: of(0.7026),
            squaring_s: of(41.4e-3),
            ..Self::steady(kp_n_m_s_rad, ki_n_m_rad, period_s)
        }
    }

    /// For encoders of so many counts a turn of the actuator, on wheels that go `way_m_rad` a radian of it \[m/rad\]. What is read from
    /// coarse counts is late and rough: slip is taken out more slowly, and more of it is left alone. 4096 counts and more change little;
    /// 0 counts stand for none.
    ///
    /// ```
    /// use omni_core::TractionConfig;
    /// let fine = TractionConfig::steady(0.3_f64, 2.0, 1e-3);
    /// let coarse = fine.with_counts(64, 0.066);
    /// assert!(coarse.slip_s > 10.0 * fine.slip_s && coarse.slip_free_m_s < 0.1);
    /// assert_eq!(fine.with_counts(0, 0.066), fine);
    /// ```
    #[must_use]
    pub fn with_counts(mut self, counts: u32, way_m_rad: R) -> Self {
        if counts == 0 {
            return self;
        }
        self.encoder_rad = R::two_pi() / R::of(f64::from(counts));
        let window = super::encoder::window_s(self.encoder_rad);
        let rough_m_s = self.encoder_rad / window * way_m_rad;
        self.contact_s = larger(self.contact_s, window);
        self.slip_s = larger(self.slip_s, R::of(4.0) * window);
        self.speed_s = larger(self.speed_s, R::of(0.5) * window);
        self.slip_free_m_s += R::of(0.2) * rough_m_s;
        self.slip_width_m_s += rough_m_s;
        self
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        period(self.period_s)?;
        each_within(
            &[
                ("thrust_gain_n_m_s_rad", self.thrust_gain_n_m_s_rad),
                ("thrust_integral_n_m_rad", self.thrust_integral_n_m_rad),
                ("soft_s_rad", self.soft_s_rad),
                ("free_gain_n_m_s_rad", self.free_gain_n_m_s_rad),
                ("free_integral_n_m_rad", self.free_integral_n_m_rad),
            ],
            &(0.0..=1e6),
            "0 to 1e6",
        )?;
        each_within(
            &[
                ("encoder_rad", self.encoder_rad),
                ("speed_s", self.speed_s),
                ("rates_s", self.rates_s),
                ("contact_s", self.contact_s),
            ],
            &(0.0..=10.0),
            "0 to 10",
        )?;
        each_within(
            &[
                ("heading_per_s", self.heading_per_s),
                ("heading_thrust_per_s", self.heading_thrust_per_s),
                ("levelling_per_s", self.levelling_per_s),
            ],
            &(0.0..=1000.0),
            "0 to 1000",
        )?;
        each_within(
            &[
                ("soft_part", self.soft_part),
                ("gyro_zero_part", self.gyro_zero_part),
            ],
            &(0.0..=1.0),
            "0 to 1",
        )?;
        within(
            "acceleration_m_s2",
            self.acceleration_m_s2,
            1e-3..=1e6,
            "0.001 to 1e6",
        )?;
        within(
            "slip_s",
            self.slip_s,
            2.0 * self.period_s.as_f64()..=10.0,
            "2 control periods to 10",
        )?;
        within("slip_free_m_s", self.slip_free_m_s, 0.0..=100.0, "0 to 100")?;
        within("slip_width_m_s", self.slip_width_m_s, 1e-6..=100.0, "1e-6 to 100")?;
        within("yaw_damping", self.yaw_damping, 0.0..=100.0, "0 to 100")?;
        within("levelling_from", self.levelling_from, 0.0..=0.99, "0 to 0.99")?;
        within("squaring_s", self.squaring_s, 1e-3..=1e3, "0.001 to 1000")?;
        within("gyro_zero_s", self.gyro_zero_s, 0.0..=3600.0, "0 to 3600")?;
        Ok(())
    }

    /// Part of a gap that a first order of this time constant closes in a period.
    pub(super) fn part(&self, time_s: R) -> R {
        if time_s > self.period_s {
            self.period_s / time_s
        } else {
            R::one()
        }
    }
}
