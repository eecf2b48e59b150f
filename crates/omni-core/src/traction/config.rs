//! The configuration of traction control.

use super::encoder::window_s;
use crate::constants::constant_struct;
use crate::error::{each_within, period, within};
use crate::motor::TorqueLimit;
use crate::scalar::max;
use crate::{ConfigError, Real};

/// A wheel as traction control sees it.
///
/// ```
/// use omni_core::traction::TractionWheel;
/// use omni_core::TorqueLimit;
/// let wheel = TractionWheel { limit: TorqueLimit::constant(2.0)?, inertia_kg_m2: 0.002178, carrier: [1.0, 0.0], place_m: [0.30, -0.23] };
/// assert!(wheel.place_m[1] < 0.0); // on the right
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TractionWheel<R> {
    /// Torque of its actuator.
    pub limit: TorqueLimit<R>,
    /// Inertia of wheel, gear and motor at the actuator \[kg.m^2\], 1e-22 to 1e6.
    pub inertia_kg_m2: R,
    /// Rate that its encoder reads per rate at which the nose, and the left side, of its carrier go
    /// up: the direction in which the wheel rolls over its gear, negative where its actuator is
    /// mounted the other way round. Each within +-1e6.
    pub carrier: [R; 2],
    /// Its position: x forward, y left of the vehicle's origin \[m\], each within +-100 m.
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

/// Known properties of the sensors and motors of a traction control, which determine its time constants. Start from
/// [`TractionSensors::perfect`].
///
/// ```
/// use omni_core::traction::TractionSensors;
/// let mut sensors = TractionSensors::<f32>::perfect();
/// (sensors.encoder_counts, sensors.delay_s) = (1024.0, 2e-3); // counts a turn of the actuator; readings are 2 ms old
/// assert_eq!(sensors.encoder_noise_rad_s, 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct TractionSensors<R> {
    /// Counts of an encoder in a turn of the actuator, where its reading is whole counts over the
    /// period, fractions allowed; 0: it is not.
    pub encoder_counts: R,
    /// Standard deviation of a wheel's reading \[rad/s\], 0 to 100.
    pub encoder_noise_rad_s: R,
    /// Standard deviation of the gyro's reading \[rad/s\], 0 to 100.
    pub gyro_noise_rad_s: R,
    /// Age of the readings \[s\], 0 to 0.03.
    pub delay_s: R,
    /// Time constant of the motors' torque \[s\], 0 to 0.03.
    pub lag_s: R,
}

constant_struct!(TractionSensors<R> { encoder_counts: R, encoder_noise_rad_s: R, gyro_noise_rad_s: R, delay_s: R, lag_s: R });

/// Gains and times of a traction control. Start from [`TractionConfig::traction`] or
/// [`TractionConfig::traction_runup`].
///
/// Gains beside the thrust's own are in multiples of it, so that they fit another vehicle as soon as that one does.
///
/// ```
/// use omni_core::traction::TractionConfig;
/// let config = TractionConfig::traction(0.3_f64, 2.0, 1e-3);
/// assert!(config.thrust_gain_n_m_s_rad > 0.7 && config.soft_part == 0.25);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct TractionConfig<R> {
    /// Control period \[s\], 1e-6 to 10.
    pub period_s: R,
    /// Known properties of sensors and motors. Times and dead zones below hold for perfect ones; these lengthen
    /// them.
    pub sensors: TractionSensors<R>,
    /// Thrust of every driven wheel per lack of speed, as a rate of its actuator \[N.m.s/rad\], 0 to 1e6.
    pub thrust_gain_n_m_s_rad: R,
    /// The same per integral of it \[N.m/rad\], 0 to 1e6: what carries the vehicle up a ramp. It
    /// does not wind up at the limit.
    pub thrust_integral_n_m_rad: R,
    /// Part of the gain that is left where next to no speed is lacking, 0 to 1; 1 leaves it whole.
    pub soft_part: R,
    /// Inverse of the lack at which the whole gain is there \[s/rad\], 0 to 1e6.
    pub soft_s_rad: R,
    /// Proportional gain of a wheel's own velocity loop \[N.m.s/rad\], 0 to 1e6: of wheels across
    /// the direction of travel always, of all wheels without traction control.
    pub free_gain_n_m_s_rad: R,
    /// Integral gain of the same loop \[N.m/rad\], 0 to 1e6.
    pub free_integral_n_m_rad: R,
    /// Time constant of the measured speed \[s\], 0 to 10; one period or less follows at once.
    pub speed_s: R,
    /// The measured speed rises no faster \[m/s^2\], 0.001 to 1e6.
    pub acceleration_m_s2: R,
    /// Time constant of the rates of hinges and base \[s\], 0 to 10.
    pub rates_s: R,
    /// Time in which a wheel's slip is removed, by its own inertia \[s\], 1e-6 to 10.
    pub slip_s: R,
    /// Slip that is left alone, as a speed of the rim \[m/s\], 0 to 100.
    pub slip_free_m_s: R,
    /// Further slip at which a wheel applies only the torque that the ground transmits and none of the common thrust
    /// \[m/s\], 1e-6 to 100.
    pub slip_width_m_s: R,
    /// Time constant of the estimated torque to the ground \[s\], 0 to 10.
    pub contact_s: R,
    /// Yaw rate that wheels are meant to have per heading error \[1/s\], 0 to 1000.
    pub heading_per_s: R,
    /// Thrust per heading error: this times the thrust's gain times the wheel's rate per yaw rate \[1/s\], 0 to 1000.
    pub heading_thrust_per_s: R,
    /// The same per error of the yaw rate, 0 to 100.
    pub yaw_damping: R,
    /// The higher wheel of a row pushes less: this times the thrust's gain, per angle of its
    /// carrier \[1/s\], 0 to 1000.
    pub levelling_per_s: R,
    /// Part of the largest thrust from which on rows are levelled, 0 to 0.99.
    pub levelling_from: R,
    /// Time constant with which the heading error is given up while the vehicle leans on a riser to
    /// square up \[s\], 0.001 to 1000.
    pub squaring_s: R,
    /// Longest memory of the gyro's zero \[s\], 0 to 3600; 0 leaves the zero as it is.
    pub gyro_zero_s: R,
    /// It is found only below this part of the largest thrust, 0 to 1.
    pub gyro_zero_part: R,
    /// Largest zero offset \[rad/s\], 0 to 100: from the gyro's datasheet.
    pub gyro_zero_max_rad_s: R,
}

constant_struct!(TractionConfig<R> {
    period_s: R, sensors: TractionSensors<R>, thrust_gain_n_m_s_rad: R, thrust_integral_n_m_rad: R, soft_part: R, soft_s_rad: R, free_gain_n_m_s_rad: R,
    free_integral_n_m_rad: R, speed_s: R, acceleration_m_s2: R, rates_s: R, slip_s: R, slip_free_m_s: R, slip_width_m_s: R,
    contact_s: R, heading_per_s: R, heading_thrust_per_s: R, yaw_damping: R, levelling_per_s: R, levelling_from: R, squaring_s: R,
    gyro_zero_s: R, gyro_zero_part: R, gyro_zero_max_rad_s: R
});

impl<R: Real> TractionSensors<R> {
    /// Nothing to reckon with.
    ///
    /// ```
    /// assert_eq!(omni_core::traction::TractionSensors::<f64>::perfect().delay_s, 0.0);
    /// ```
    #[must_use]
    pub const fn perfect() -> Self {
        Self {
            encoder_counts: R::ZERO,
            encoder_noise_rad_s: R::ZERO,
            gyro_noise_rad_s: R::ZERO,
            delay_s: R::ZERO,
            lag_s: R::ZERO,
        }
    }
}

impl<R: Real> TractionConfig<R> {
    /// Keeps the wheels together: least slip, heat and force. From the gains of a wheel's velocity
    /// loop \[N.m.s/rad, N.m/rad\] and the control period \[s\].
    ///
    /// Numbers of three and more digits were found by a search over climbs of chugo7. The ensembles of docs/study.md
    /// ran with them, and no law asks for their last digits.
    ///
    /// ```
    /// use omni_core::traction::TractionConfig;
    /// let (one, stiffer) = (TractionConfig::traction(0.3, 2.0, 1e-3), TractionConfig::traction(0.6, 4.0, 1e-3));
    /// assert_eq!(stiffer.thrust_gain_n_m_s_rad, 2.0 * one.thrust_gain_n_m_s_rad);
    /// ```
    #[must_use]
    pub fn traction(kp_n_m_s_rad: R, ki_n_m_rad: R, period_s: R) -> Self {
        let of = R::of;
        Self {
            period_s,
            sensors: TractionSensors::perfect(),
            thrust_gain_n_m_s_rad: of(2.47) * kp_n_m_s_rad,
            thrust_integral_n_m_rad: of(2.0) * ki_n_m_rad,
            soft_part: of(0.25),
            soft_s_rad: of(1.0 / 1.26),
            free_gain_n_m_s_rad: kp_n_m_s_rad,
            free_integral_n_m_rad: ki_n_m_rad,
            speed_s: of(8.4e-3),
            acceleration_m_s2: of(6.0),
            rates_s: of(17.3e-3),
            slip_s: of(7.5e-3),
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
            gyro_zero_max_rad_s: R::one(),
        }
    }

    /// Gets over the highest steps: rows are levelled under more load only, but faster. As
    /// [`TractionConfig::traction`] otherwise.
    ///
    /// ```
    /// use omni_core::traction::TractionConfig;
    /// let (runup, traction) = (TractionConfig::traction_runup(0.3, 2.0, 1e-3), TractionConfig::traction(0.3, 2.0, 1e-3));
    /// assert!(runup.levelling_from > traction.levelling_from);
    /// assert_eq!((runup.soft_part, traction.soft_part), (0.25, 0.25));
    /// ```
    #[must_use]
    pub fn traction_runup(kp_n_m_s_rad: R, ki_n_m_rad: R, period_s: R) -> Self {
        let of = R::of;
        Self {
            heading_per_s: of(3.38),
            heading_thrust_per_s: of(0.640),
            yaw_damping: of(0.1341),
            levelling_per_s: of(10.19),
            levelling_from: of(0.7026),
            squaring_s: of(41.4e-3),
            ..Self::traction(kp_n_m_s_rad, ki_n_m_rad, period_s)
        }
    }

    /// The same with known properties of sensors and motors.
    ///
    /// ```
    /// use omni_core::traction::{TractionConfig, TractionSensors};
    /// let mut late = TractionSensors::perfect();
    /// late.delay_s = 5e-3;
    /// assert_eq!(TractionConfig::traction(0.3, 2.0, 1e-3).with_sensors(late).sensors.delay_s, 5e-3);
    /// ```
    #[must_use]
    pub fn with_sensors(self, sensors: TractionSensors<R>) -> Self {
        Self { sensors, ..self }
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
        each_within(
            &[("delay_s", self.sensors.delay_s), ("lag_s", self.sensors.lag_s)],
            &(0.0..=0.03),
            "0 to 0.03: later, and slip cannot be controlled",
        )?;
        each_within(
            &[
                ("encoder_noise_rad_s", self.sensors.encoder_noise_rad_s),
                ("gyro_noise_rad_s", self.sensors.gyro_noise_rad_s),
                ("gyro_zero_max_rad_s", self.gyro_zero_max_rad_s),
            ],
            &(0.0..=100.0),
            "0 to 100",
        )?;
        within(
            "encoder_counts",
            self.sensors.encoder_counts,
            0.0..=1e9,
            "0 to 1e9",
        )?;
        within("slip_s", self.slip_s, 1e-6..=10.0, "1e-6 to 10")?;
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

/// Times and dead zones that fit sensors, motors and wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
#[doc(hidden)]
pub struct TractionTimes<R> {
    /// Angle of the actuator that one count of its encoder is \[rad\]; 0 if readings are not counts.
    pub(super) count_rad: R,
    /// Time over which a rate is best read from them \[s\].
    pub(super) window_s: R,
    pub(super) slip_s: R,
    pub(super) contact_s: R,
    pub(super) speed_s: R,
    /// Slip that is left alone, and its inverse \[m/s, s/m\].
    pub(super) free_m_s: R,
    pub(super) per_free_s_m: R,
    /// Part of a speed that counts and noise mask \[m/s\]: counts of slow wheels are also late.
    pub(super) hidden_m_s: R,
    pub(super) width_m_s: R,
    pub(super) integral_n_m_rad: R,
    /// Gain of the common thrust.
    pub(super) thrust_gain_n_m_s_rad: R,
    /// Gains of a wheel's own loop.
    pub(super) own_gain_n_m_s_rad: R,
    pub(super) own_integral_n_m_rad: R,
    /// Fraction of a gain that delay and lag alone leave.
    pub(super) late_part: R,
    /// Of slower wheels counts come rarely \[rad/s\].
    pub(super) rare_rad_s: R,
}

constant_struct!(TractionTimes<R> {
    count_rad: R, window_s: R, slip_s: R, contact_s: R, speed_s: R, free_m_s: R, per_free_s_m: R, hidden_m_s: R, width_m_s: R, integral_n_m_rad: R, thrust_gain_n_m_s_rad: R, own_gain_n_m_s_rad: R,
    own_integral_n_m_rad: R, late_part: R, rare_rad_s: R
});

/// Slip is removed no faster than in this many periods, delays, windows of counts, because it would oscillate.
const PERIODS: f64 = 5.0;
const DELAYS: f64 = 6.0;
const WINDOWS: f64 = 4.0;
/// Noise makes no more than a tenth of the torque.
const NOISE_MARGIN: f64 = 10.0;
/// Slip that noise makes is left alone up to so many standard deviations of a filtered wheel.
const DEVIATIONS: f64 = 2.0;
/// Counts come rarely where fewer than this come in their window: plain loops on estimates from half a count on
/// have the commanded speed to a part in a thousand and no heat, but are slower by a tenth to a third below 0.3.
const RARE: f64 = 0.4;
/// Readings older than this \[s\] are answered with smaller gains. A delay is as bad as a window of
/// counts of twice its length.
const FRESH_S: f64 = 0.015;

impl<R: Real> TractionTimes<R> {
    /// For actuators of this largest inertia, least torque, largest way a turn \[kg.m^2, N.m,
    /// m/rad\], and outermost lever \[m\].
    pub(super) fn new(
        config: &TractionConfig<R>,
        inertia_kg_m2: R,
        torque_n_m: R,
        way_m: R,
        lever_m: R,
    ) -> Self {
        let (sensors, zero) = (&config.sensors, R::zero());
        let late_s = sensors.delay_s + sensors.lag_s;
        let noise_s = R::of(NOISE_MARGIN) * inertia_kg_m2 * sensors.encoder_noise_rad_s / torque_n_m;
        let (mut count_rad, mut window) = (zero, zero);
        let (mut rough_m_s, mut rare_rad_s) = (zero, zero);
        if sensors.encoder_counts > zero {
            count_rad = R::two_pi() / sensors.encoder_counts;
            window = window_s(count_rad);
            rough_m_s = count_rad / window * way_m;
            rare_rad_s = R::of(RARE) * count_rad / window;
        }
        // Late or averaged readings are answered with lower gains.
        let softer = |old_s: R| {
            if old_s > R::of(FRESH_S) {
                R::of(FRESH_S) / old_s
            } else {
                R::one()
            }
        };
        let late_part = softer(R::of(2.0) * late_s);
        let softer = softer(window + R::of(2.0) * late_s);
        let most = |times: &[R]| times.iter().fold(zero, |most, time| max(most, *time));
        let of = R::of;
        let speed_s = most(&[config.speed_s, of(0.5) * window, of(0.5) * noise_s]);
        // White noise through a first order.
        let part = config.part(speed_s);
        let filtered = (part / (of(2.0) - part)).sqrt();
        let rim_m_s = sensors.encoder_noise_rad_s * way_m;
        let yaw_m_s = sensors.gyro_noise_rad_s * lever_m;
        let noise_m_s = of(DEVIATIONS) * filtered * (rim_m_s * rim_m_s + yaw_m_s * yaw_m_s).sqrt();
        let free_m_s = max(config.slip_free_m_s + of(0.2) * rough_m_s + noise_m_s, of(1e-6));
        Self {
            count_rad,
            window_s: window,
            slip_s: most(&[
                config.slip_s,
                of(PERIODS) * config.period_s,
                of(WINDOWS) * window,
                of(DELAYS) * late_s,
                noise_s,
            ]),
            contact_s: most(&[config.contact_s, window, late_s, noise_s]),
            speed_s,
            free_m_s,
            per_free_s_m: R::one() / free_m_s,
            hidden_m_s: of(0.4) * rough_m_s + noise_m_s,
            width_m_s: config.slip_width_m_s + rough_m_s,
            integral_n_m_rad: config.thrust_integral_n_m_rad * softer,
            thrust_gain_n_m_s_rad: config.thrust_gain_n_m_s_rad * softer,
            own_gain_n_m_s_rad: config.free_gain_n_m_s_rad * softer,
            own_integral_n_m_rad: config.free_integral_n_m_rad * softer * late_part,
            late_part,
            rare_rad_s,
        }
    }

    /// Gains of a wheel's own loop, proportional and integral: reduced only for the delay if the readings are used as
    /// they arrive.
    #[inline(always)]
    pub(super) fn own(&self, config: &TractionConfig<R>, raw: bool) -> [R; 2] {
        if raw {
            let late = self.late_part;
            [
                config.free_gain_n_m_s_rad * late,
                config.free_integral_n_m_rad * late * late,
            ]
        } else {
            [self.own_gain_n_m_s_rad, self.own_integral_n_m_rad]
        }
    }
}
