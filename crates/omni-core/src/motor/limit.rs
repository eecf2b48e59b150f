//! The torque-speed line that the loops use every step.

use super::torque_range::{TorqueRange, TorqueRanges, four_quadrants, known};
use crate::constants::{constant_struct, each};
use crate::error::{not_negative, positive};
use crate::{ConfigError, Real};

/// Torque-speed line of a DC motor, in four quadrants: speed costs torque only while the motor drives.
///
/// Driving (torque and velocity of one sign): `max(0, min(cap, stall - slope |v|))`. Braking:
/// `min(cap, stall)`. As printed, eq. (13) turns negative above 114.5 rpm and would push a fast
/// wheel backwards; here a limit is never negative.
///
/// ```
/// use omni_core::TorqueLimit;
/// let limit = TorqueLimit::chugo(); // eq. (13): -1.713 v + 196.13, in mN.m and rpm
/// let rpm = core::f64::consts::PI / 30.0;
/// let range = limit.range(100.0 * rpm);
/// assert!((range.upper_n_m - 24.83e-3_f64).abs() < 1e-9);
/// assert!((range.lower_n_m + 196.13e-3_f64).abs() < 1e-9);
/// assert_eq!(limit.range(200.0 * rpm).upper_n_m, 0.0);
/// // A driver that limits the current to what 50 mN.m take:
/// assert_eq!(limit.capped(0.05)?.range(0.0).upper_n_m, 0.05);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct TorqueLimit<R> {
    /// The line's value at rest.
    stall_n_m: R,
    slope_n_m_s_rad: R,
    /// Largest torque in any quadrant, at most the stall torque.
    cap_n_m: R,
}

constant_struct!(TorqueLimit<R> { stall_n_m: R, slope_n_m_s_rad: R, cap_n_m: R });

impl<R: Real> TorqueLimit<R> {
    /// The same limit `torque_n_m` > 0 \[N.m\] at every velocity.
    ///
    /// # Errors
    /// Parameter `torque_n_m` if it is not finite or not positive.
    ///
    /// ```
    /// use omni_core::TorqueLimit;
    /// let limit = TorqueLimit::constant(2.0)?;
    /// assert_eq!(limit.range(-1000.0).lower_n_m, -2.0); // drives backwards as strongly as at rest
    /// assert_eq!(TorqueLimit::constant(-2.0).unwrap_err().parameter, "torque_n_m");
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn constant(torque_n_m: R) -> Result<Self, ConfigError> {
        let torque = positive("torque_n_m", torque_n_m)?;
        Ok(Self {
            stall_n_m: torque,
            slope_n_m_s_rad: R::zero(),
            cap_n_m: torque,
        })
    }

    /// A line from `stall_torque_n_m` > 0 \[N.m\] at rest down by `slope_n_m_s_rad` >= 0 \[N.m per rad/s\].
    ///
    /// # Errors
    /// Parameter `stall_torque_n_m` or `slope_n_m_s_rad` if it is out of range or not finite.
    ///
    /// ```
    /// use omni_core::TorqueLimit;
    /// let limit = TorqueLimit::line(2.0, 0.25)?;
    /// // 2 N.m at rest, 0.25 less for every rad/s, nothing from 2.0 / 0.25 = 8 rad/s on.
    /// assert_eq!([0.0, 4.0, 8.0, 9.0].map(|v| limit.range(v).upper_n_m), [2.0, 1.0, 0.0, 0.0]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn line(stall_torque_n_m: R, slope_n_m_s_rad: R) -> Result<Self, ConfigError> {
        let stall = positive("stall_torque_n_m", stall_torque_n_m)?;
        let slope = not_negative("slope_n_m_s_rad", slope_n_m_s_rad)?;
        Ok(Self {
            stall_n_m: stall,
            slope_n_m_s_rad: slope,
            cap_n_m: stall,
        })
    }

    /// The same with no more than `torque_n_m` > 0 \[N.m\] in any quadrant: the effect of a current limit.
    ///
    /// # Errors
    /// Parameter `torque_n_m` if it is not finite or not positive.
    ///
    /// ```
    /// use omni_core::TorqueLimit;
    /// let capped = TorqueLimit::line(2.0, 0.25)?.capped(1.5)?;
    /// // Flat up to (2.0 - 1.5) / 0.25 = 2 rad/s, then the line.
    /// assert_eq!([0.0, 2.0, 4.0].map(|v| capped.range(v).upper_n_m), [1.5, 1.5, 1.0]);
    /// assert_eq!(capped.capped(9.0)?, capped); // a higher cap changes nothing
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn capped(self, torque_n_m: R) -> Result<Self, ConfigError> {
        let cap = positive("torque_n_m", torque_n_m)?;
        Ok(Self {
            cap_n_m: if cap < self.cap_n_m { cap } else { self.cap_n_m },
            ..self
        })
    }

    /// Eq. (13): 196.13 mN.m at rest, 1.713 mN.m less for every rpm. Serves the simulation of section 3.3 of the paper;
    /// its peak power of 0.59 W cannot lift a vehicle over a step.
    ///
    /// ```
    /// use omni_core::TorqueLimit;
    /// let limit = TorqueLimit::<f64>::chugo();
    /// assert!((limit.range(0.0).upper_n_m - 0.19613).abs() < 1e-12);
    /// let no_load_rad_s = 196.13 / 1.713 * core::f64::consts::PI / 30.0; // 114.5 rpm
    /// assert!(limit.range(0.999 * no_load_rad_s).upper_n_m > 0.0);
    /// assert_eq!(limit.range(1.001 * no_load_rad_s).upper_n_m, 0.0);
    /// ```
    #[must_use]
    pub fn chugo() -> Self {
        let milli = 1e-3;
        let rpm = core::f64::consts::PI / 30.0;
        let stall = R::of(196.13 * milli);
        Self {
            stall_n_m: stall,
            slope_n_m_s_rad: R::of(1.713 * milli / rpm),
            cap_n_m: stall,
        }
    }

    /// Lowest and highest torque \[N.m\] at the actuator velocity \[rad/s\]. Nothing if that is NaN.
    ///
    /// ```
    /// use omni_core::motor::TorqueRange;
    /// use omni_core::TorqueLimit;
    /// let limit = TorqueLimit::line(2.0, 0.25)?;
    /// // Turning backwards it drives with up to 1 N.m and brakes with up to 2.
    /// assert_eq!(limit.range(-4.0), TorqueRange { lower_n_m: -1.0, upper_n_m: 2.0 });
    /// assert_eq!(limit.range(f64::NAN), TorqueRange { lower_n_m: 0.0, upper_n_m: 0.0 });
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    #[must_use]
    pub fn range(&self, velocity_rad_s: R) -> TorqueRange<R> {
        let driving = self.stall_n_m - self.slope_n_m_s_rad * velocity_rad_s.abs();
        known(
            velocity_rad_s,
            four_quadrants(driving, self.cap_n_m, velocity_rad_s),
        )
    }

    /// The duty cycle of a bridge without a current loop, -1 to 1, that produces `torque_n_m` \[N.m\] at
    /// `velocity_rad_s` \[rad/s\], or the nearest possible torque: the line at a fraction of the supply voltage,
    /// `torque = stall duty - slope velocity`, solved for the duty. The torque is held within the cap. Duty 0 shorts
    /// the motor, which brakes with `slope velocity`; to release a wheel, open the bridge. 0 for NaN.
    ///
    /// It needs no more than a data sheet's stall torque and no-load speed at the supply's voltage. With resistance,
    /// torque constant and friction known, [`DcMotor::duty`](crate::motor::DcMotor::duty) also returns the current.
    ///
    /// ```
    /// use omni_core::TorqueLimit;
    /// let motor = TorqueLimit::line(2.0, 0.25)?; // 2 N.m at rest, 8 rad/s without load
    /// assert_eq!(motor.duty(0.5, 0.0), 0.25);
    /// assert_eq!(motor.duty(0.5, 4.0), 0.75); // a half against the back-EMF
    /// assert_eq!(motor.duty(0.0, 8.0), 1.0); // no load
    /// assert_eq!(motor.duty(-1.0, 4.0), 0.0); // so much a shorted motor brakes
    /// assert_eq!(motor.duty(2.0, 4.0), 1.0); // more than there is
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    #[must_use]
    pub fn duty(&self, torque_n_m: R, velocity_rad_s: R) -> R {
        self.duty_at(torque_n_m, velocity_rad_s, R::one())
    }

    /// [`TorqueLimit::duty`] where the supply has `supply_part` > 0 of the voltage that the line is
    /// of: a battery that runs down. 0 for a part that is not positive.
    ///
    /// ```
    /// use omni_core::TorqueLimit;
    /// let motor = TorqueLimit::line(2.0, 0.25)?; // at 12 V
    /// assert_eq!(motor.duty(0.5, 0.0), 0.25);
    /// assert_eq!(motor.duty_at(0.5, 0.0, 10.0 / 12.0), 0.3); // 3 V in both cases
    /// assert_eq!(motor.duty_at(0.5, 4.0, 0.5), 1.0); // 9 V are needed, 6 are there
    /// assert_eq!(motor.duty_at(0.5, 4.0, 0.0), 0.0);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    #[must_use]
    pub fn duty_at(&self, torque_n_m: R, velocity_rad_s: R, supply_part: R) -> R {
        let lost = self.slope_n_m_s_rad * velocity_rad_s;
        let known = (torque_n_m + lost).partial_cmp(&R::zero()).is_some();
        if !(known && supply_part > R::zero()) {
            return R::zero();
        }
        let torque = torque_n_m.limited(-self.cap_n_m, self.cap_n_m);
        ((torque + lost) / (self.stall_n_m * supply_part)).limited(-R::one(), R::one())
    }
}

/// The limits of `N` actuators, their numbers side by side: loops over them run several at a time
/// where the processor can.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct TorqueLimits<R, const N: usize> {
    stall: [R; N],
    slope: [R; N],
    cap: [R; N],
    /// No limit depends on the velocity.
    constant: bool,
}

constant_struct!(TorqueLimits<R, const N> { stall: [R; N], slope: [R; N], cap: [R; N], constant: bool });

impl<R: Real, const N: usize> TorqueLimits<R, N> {
    pub(crate) fn new(limits: &[TorqueLimit<R>; N]) -> Self {
        Self {
            stall: limits.map(|l| l.stall_n_m),
            slope: limits.map(|l| l.slope_n_m_s_rad),
            cap: limits.map(|l| l.cap_n_m),
            constant: limits.iter().all(|l| l.slope_n_m_s_rad == R::zero()),
        }
    }

    /// As [`TorqueLimit::range`], for every actuator at its velocity \[rad/s\].
    #[inline(always)]
    pub(crate) fn ranges(&self, velocities: &[R; N], ranges: &mut TorqueRanges<R, N>) {
        if self.constant {
            each!(i of N {
                (ranges.lower_n_m[i], ranges.upper_n_m[i]) = (-self.cap[i], self.cap[i]);
            });
            return;
        }
        for i in 0..N {
            let driving = self.stall[i] - self.slope[i] * velocities[i].abs();
            let range = four_quadrants(driving, self.cap[i], velocities[i]);
            (ranges.lower_n_m[i], ranges.upper_n_m[i]) = (range.lower_n_m, range.upper_n_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RPM: f64 = core::f64::consts::PI / 30.0;

    #[test]
    fn duty_gives_every_torque_within_the_line_and_none_for_what_is_no_number() {
        let motor = TorqueLimit::line(2.0_f64, 0.25)
            .expect("valid")
            .capped(1.5)
            .expect("valid");
        for k in -40..=40_i32 {
            let velocity = 0.2 * f64::from(k);
            let range = motor.range(velocity);
            // Driving and braking: what the range allows the duty gives, by the motor's own equation, to rounding.
            for torque in [
                range.lower_n_m,
                0.3 * range.lower_n_m,
                0.0,
                0.7 * range.upper_n_m,
                range.upper_n_m,
            ] {
                let duty = motor.duty(torque, velocity);
                assert!(
                    (2.0 * duty - 0.25 * velocity - torque).abs() < 1e-12,
                    "{torque} at {velocity}: {duty}"
                );
            }
            assert_eq!(motor.duty(9.0, velocity), motor.duty(1.5, velocity)); // the cap
        }
        for (torque, velocity) in [
            (f64::NAN, 0.0),
            (0.0, f64::NAN),
            (f64::INFINITY, f64::NEG_INFINITY),
        ] {
            assert_eq!(motor.duty(torque, velocity), 0.0, "{torque} at {velocity}");
        }
    }

    #[test]
    fn duty_at_part_of_the_supply_gives_the_torque_that_the_whole_gives() {
        let motor = TorqueLimit::line(2.0_f64, 0.25).expect("valid");
        for k in -40..=40_i32 {
            let (torque, velocity) = (0.03 * f64::from(k), 0.1 * f64::from(k));
            for part in [0.3, 0.8, 1.0, 1.1] {
                let (duty, volts) = (
                    motor.duty_at(torque, velocity, part),
                    (torque + 0.25 * velocity) / 2.0,
                );
                // By the motor's own equation, to rounding, where there is enough of the supply.
                let wanted = volts.clamp(-part, part);
                assert!(
                    (duty * part - wanted).abs() < 1e-15,
                    "{torque} at {velocity}, {part}: {duty}"
                );
            }
        }
        assert_eq!(motor.duty_at(0.0, 1e-200, 1e-200), 0.125); // 0.25 / 2
        for part in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(motor.duty_at(1.0, 1.0, part), 0.0, "{part}");
        }
    }

    #[test]
    fn torque_limit_is_never_negative_at_any_speed() {
        let limit = TorqueLimit::<f64>::chugo();
        for rpm in -400..=400_i32 {
            let TorqueRange {
                lower_n_m: lower,
                upper_n_m: upper,
            } = limit.range(f64::from(rpm) * RPM);
            assert!(lower <= 0.0 && upper >= 0.0, "{rpm} rpm: {lower} {upper}");
            let printed = 1e-3 * (196.13 - 1.713 * f64::from(rpm.abs())).max(0.0);
            let driving = if rpm < 0 { -lower } else { upper };
            assert!((driving - printed).abs() < 1e-15, "{rpm} rpm");
        }
    }

    #[test]
    fn limits_of_opposite_velocities_mirror_each_other() {
        let limit = TorqueLimit::line(2.0, 0.1).expect("valid");
        for v in [0.5, 3.0, 30.0] {
            let (a, b) = (limit.range(v), limit.range(-v));
            assert_eq!((a.lower_n_m, a.upper_n_m), (-b.upper_n_m, -b.lower_n_m));
        }
    }

    #[test]
    fn load_torque_meets_equation_13_where_the_paper_s_wheels_settle() {
        // Speeds of notes.md: damper coefficient [N.m.s/rad] -> rpm at which the motor just holds the load.
        for (damper, rpm) in [(0.004, 91.999), (0.008, 76.891), (0.003, 96.751)] {
            let drive = TorqueLimit::<f64>::chugo().range(rpm * RPM).upper_n_m;
            assert!((drive - damper * rpm * RPM).abs() < 1e-6, "{damper}: {drive}"); // rpm are given to 0.001
        }
    }

    #[test]
    fn a_cap_holds_in_every_quadrant_and_only_ever_lowers() {
        let limit = TorqueLimit::line(2.0_f64, 0.1)
            .expect("valid")
            .capped(1.2)
            .expect("valid");
        for (v, lower, upper) in [
            (0.0, -1.2, 1.2),
            (5.0, -1.2, 1.2),
            (10.0, -1.2, 1.0),
            (-10.0, -1.0, 1.2),
            (30.0, -1.2, 0.0),
        ] {
            let range = limit.range(v);
            assert!(
                (range.lower_n_m - lower).abs() < 1e-15 && (range.upper_n_m - upper).abs() < 1e-15,
                "{v}: {range:?}"
            );
        }
        assert_eq!(limit.capped(5.0), Ok(limit));
        assert_eq!(limit.capped(0.0).expect_err("refused").parameter, "torque_n_m");
        assert_eq!(limit.range(f64::NAN), TorqueRange::none());
    }

    #[test]
    fn limits_side_by_side_are_the_limits_one_by_one() {
        let one = TorqueLimit::line(2.0_f32, 0.1)
            .expect("valid")
            .capped(1.2)
            .expect("valid");
        let constants = [
            TorqueLimit::constant(0.5).expect("valid"),
            TorqueLimit::constant(2.0_f32).expect("valid"),
        ];
        let mut ranges = TorqueRanges::unlimited();
        TorqueLimits::new(&constants).ranges(&[-3.0, 3.0], &mut ranges);
        assert_eq!(
            (ranges.wheel(0), ranges.wheel(1)),
            (constants[0].range(-3.0), constants[1].range(3.0))
        );
        let limits = [
            one,
            TorqueLimit::constant(0.5).expect("valid"),
            TorqueLimit::chugo(),
        ];
        for v in [-200.0, -3.0, 0.0, 1e-3, 7.0, 1e5_f32] {
            let mut ranges = TorqueRanges::unlimited();
            TorqueLimits::new(&limits).ranges(&[v; 3], &mut ranges);
            for (i, limit) in limits.iter().enumerate() {
                assert_eq!(ranges.wheel(i), limit.range(v));
            }
        }
    }
}
