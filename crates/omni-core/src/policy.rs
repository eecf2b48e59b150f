//! The interface of a user's own controller: readings in, torques out.
//!
//! The built-in controllers behind it are [`ControllerPolicy`](crate::loops::ControllerPolicy),
//! [`DrivePolicy`](crate::drive::DrivePolicy) and [`TractionPolicy`](crate::traction::TractionPolicy).

use crate::Real;
use crate::geometry::BodyTwist;
use crate::scalar::all_plausible;

/// Standard gravity \[m/s^2\], and how far from it a specific force is no direction of gravity any more.
pub(crate) const GRAVITY_M_S2: f64 = 9.81;
const UNLIKE_GRAVITY_M_S2: f64 = 1.5;
/// Time constant with which an accelerometer corrects the angles of a gyro \[s\].
const ATTITUDE_S: f64 = 2.0;
/// Largest angle of [`Imu::update_angles`] \[rad\]: no vehicle of these leans further.
const LARGEST_LEAN_RAD: f64 = 0.9;

/// Readings of an inertial measurement unit on the base, in the base's axes: x forward, y left, z up.
///
/// ```
/// use omni_core::policy::Imu;
/// let at_rest = Imu::<f32>::level();
/// assert_eq!((at_rest.specific_force_m_s2, at_rest.pitch_rad), ([0.0, 0.0, 9.81], 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[non_exhaustive]
pub struct Imu<R> {
    /// Turning rates about x, y and z \[rad/s\]: a gyro.
    pub rate_rad_s: [R; 3],
    /// Acceleration less gravity \[m/s^2\]: an accelerometer. At rest it is 9.81 upwards.
    pub specific_force_m_s2: [R; 3],
    /// Angle of the base's y axis above the horizon \[rad\]: left side up is positive.
    pub roll_rad: R,
    /// Angle of the base's x axis above the horizon \[rad\]: nose up is positive.
    pub pitch_rad: R,
}

impl<R: Real> Imu<R> {
    /// At rest on level ground.
    ///
    /// ```
    /// assert_eq!(omni_core::policy::Imu::<f64>::level().rate_rad_s, [0.0; 3]);
    /// ```
    #[must_use]
    pub fn level() -> Self {
        let zero = R::zero();
        Self {
            rate_rad_s: [zero; 3],
            specific_force_m_s2: [zero, zero, R::of(GRAVITY_M_S2)],
            roll_rad: zero,
            pitch_rad: zero,
        }
    }

    /// No unit, or no reading of it: NaN throughout.
    ///
    /// ```
    /// let valid = |imu: omni_core::policy::Imu<f64>| imu.rate_rad_s.iter().filter(|rate| !rate.is_nan()).count();
    /// assert_eq!((valid(omni_core::policy::Imu::silent()), valid(omni_core::policy::Imu::level())), (0, 3));
    /// ```
    #[must_use]
    pub fn silent() -> Self {
        let nan = R::of(f64::NAN);
        Self {
            rate_rad_s: [nan; 3],
            specific_force_m_s2: [nan; 3],
            roll_rad: nan,
            pitch_rad: nan,
        }
    }

    /// Follows [`roll_rad`](Self::roll_rad) and [`pitch_rad`](Self::pitch_rad) by the rates and the specific force that
    /// were read in this period, for a unit that does not compute angles itself. False, and the angles stay, if one of
    /// the readings is no number, or the first force is far from 1 g: then pass [`silent`](Self::silent) in this
    /// period.
    ///
    /// The gyro turns the angles, and the accelerometer corrects them with a time constant of 2 s, as long as it reads
    /// nearly 1 g. From [`silent`](Self::silent) the first reading gives the angles at once.
    ///
    /// ```
    /// let mut imu = omni_core::policy::Imu::<f32>::silent();
    /// imu.rate_rad_s = [0.0, -0.1, 0.0]; // the nose rises
    /// imu.specific_force_m_s2 = [4.905, 0.0, 8.496]; // half of g along x: nose up by 30 degrees
    /// assert!(imu.update_angles(0.001));
    /// assert!((imu.pitch_rad - 30_f32.to_radians()).abs() < 1e-3 && imu.roll_rad == 0.0);
    /// ```
    pub fn update_angles(&mut self, period_s: R) -> bool {
        let [fx, fy, fz] = self.specific_force_m_s2;
        let [p, q, r] = self.rate_rad_s;
        if !all_plausible(&[fx, fy, fz, p, q, r, period_s]) {
            return false;
        }
        let begins = !all_plausible(&[self.roll_rad, self.pitch_rad]);
        let force_m_s2 = (fx * fx + fy * fy + fz * fz).sqrt();
        let known = (force_m_s2 - R::of(GRAVITY_M_S2)).abs() < R::of(UNLIKE_GRAVITY_M_S2);
        let (roll_rad, pitch_rad);
        if begins {
            if !known {
                return false;
            }
            roll_rad = fy.atan2((fx * fx + fz * fz).sqrt());
            pitch_rad = fx.atan2((fy * fy + fz * fz).sqrt());
        } else {
            let by = turned(self.roll_rad, self.pitch_rad, self.rate_rad_s, period_s);
            let ((y, cy), (x, cx)) = (self.roll_rad.sine_cosine(), self.pitch_rad.sine_cosine());
            // In free fall nothing is read, and in a jolt something else.
            let read = if known {
                [fy / force_m_s2, fx / force_m_s2]
            } else {
                [y, x]
            };
            let part = period_s / R::of(ATTITUDE_S);
            roll_rad = self.roll_rad + by[0] + part * (read[0] - y) / cy;
            pitch_rad = self.pitch_rad + by[1] + part * (read[1] - x) / cx;
        }
        let most = R::of(LARGEST_LEAN_RAD);
        self.roll_rad = roll_rad.limited(-most, most);
        self.pitch_rad = pitch_rad.limited(-most, most);
        true
    }
}

/// By how much roll and pitch change in a period in which the base turns at these rates about its own axes \[rad\].
#[inline]
pub(crate) fn turned<R: Real>(roll_rad: R, pitch_rad: R, rate_rad_s: [R; 3], period_s: R) -> [R; 2] {
    let [p, q, r] = rate_rad_s;
    // Heights of the tips of x and y axis, which turn with the base.
    let ((x, cx), (y, cy)) = (pitch_rad.sine_cosine(), roll_rad.sine_cosine());
    let up = (R::one() - x * x - y * y).limited(R::of(0.01), R::one()).sqrt();
    [(p * up - r * x) * period_s / cy, (r * y - q * up) * period_s / cx]
}

/// All that a controller may use in one control period: the vehicle's sensors, its own torques, its command.
///
/// ```
/// use omni_core::policy::Imu;
/// use omni_core::{BodyTwist, Readings};
/// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let readings = Readings::new(ahead, &[1.0, f64::NAN, -1.0]);
/// assert!(readings.wheels_rad_s[1].is_nan() && readings.hinges_rad.is_empty()); // no reading of wheel 2
/// assert_eq!((readings.new_command, readings.imu), (true, Imu::level()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Readings<'a, R> {
    /// The vehicle's command: the last one that arrived.
    pub command: BodyTwist<R>,
    /// The command arrived since the previous period.
    pub new_command: bool,
    /// Actuator velocities by the encoders \[rad/s\], one per wheel; NaN if no reading arrived.
    pub wheels_rad_s: &'a [R],
    /// Commanded actuator torques of the previous period \[N.m\], one per wheel; empty if they are not kept.
    pub torques_n_m: &'a [R],
    /// Angles of the hinges \[rad\], and their rates \[rad/s\], one per hinge; empty if they have no encoders.
    pub hinges_rad: &'a [R],
    /// Rates of the hinges \[rad/s\].
    pub hinges_rad_s: &'a [R],
    /// The inertial measurement unit.
    pub imu: Imu<R>,
    /// Height of the edge that a wheel has climbed in this period \[m\], by
    /// [`GroundOdometry`](crate::estimate::GroundOdometry); 0 if none has.
    pub climbed_m: R,
}

impl<'a, R: Real> Readings<'a, R> {
    /// A new command and actuator velocities \[rad/s\], one per wheel; no hinges, the vehicle level and at rest.
    #[must_use]
    pub fn new(command: BodyTwist<R>, wheels_rad_s: &'a [R]) -> Self {
        Self {
            command,
            new_command: true,
            wheels_rad_s,
            torques_n_m: &[],
            hinges_rad: &[],
            hinges_rad_s: &[],
            imu: Imu::level(),
            climbed_m: R::zero(),
        }
    }
}

/// A controller: computes one torque per wheel from an observation, once every control period. An implementation runs
/// unchanged in firmware and in the simulation.
///
/// ```
/// use omni_core::{BodyTwist, Policy, Readings};
/// /// Every wheel by itself: 0.5 N.m a rad/s towards 4 rad/s. It counts its periods.
/// struct Simple(u32);
/// impl Policy<f64> for Simple {
///     fn reset(&mut self) {
///         self.0 = 0;
///     }
///     fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
///         self.0 += 1;
///         for (torque, velocity) in torques_n_m.iter_mut().zip(readings.wheels_rad_s) {
///             *torque = 0.5 * (4.0 - velocity);
///         }
///     }
///     fn signal_name(&self, index: usize) -> Option<&str> {
///         ["periods"].get(index).copied()
///     }
///     fn signals(&self, values: &mut [f64]) {
///         values[0] = f64::from(self.0);
///     }
/// }
/// let (mut policy, mut torques_n_m, mut values) = (Simple(0), [0.0; 3], [0.0]);
/// policy.step(&Readings::new(BodyTwist::ZERO, &[4.0, 3.0, 5.0]), &mut torques_n_m);
/// policy.signals(&mut values);
/// assert_eq!((torques_n_m, values), ([0.0, 0.5, -0.5], [1.0]));
/// assert_eq!((policy.name(), policy.signal_name(1)), ("own", None)); // unless it says its name
/// ```
pub trait Policy<R> {
    /// Resets to the initial state.
    fn reset(&mut self);

    /// One control period: writes one torque per wheel \[N.m\], finite. `torques_n_m` is all zero before. The caller
    /// brings the torques within what the motors have.
    fn step(&mut self, readings: &Readings<'_, R>, torques_n_m: &mut [R]);

    /// Its name in traces, tables and logs.
    fn name(&self) -> &str {
        "own"
    }

    /// Reason why the last step returned no torques, in one line: the caller then stops. None if all is well.
    ///
    /// ```
    /// # use omni_core::{Policy, Readings};
    /// /// Says how far it is, and when it is over.
    /// struct Talks(f64);
    /// impl Policy<f64> for Talks {
    ///     fn reset(&mut self) {}
    ///     fn step(&mut self, _: &Readings<'_, f64>, _: &mut [f64]) {}
    ///     fn failure(&self) -> Option<&str> {
    ///         (self.0 > 1.0).then_some("beyond the end")
    ///     }
    /// }
    /// assert_eq!(Talks(0.5).failure(), None);
    /// assert_eq!(Talks(1.5).failure(), Some("beyond the end"));
    /// ```
    fn failure(&self) -> Option<&str> {
        None
    }

    /// Names of signals of its own, by index from 0 until there is none: columns of traces and
    /// logs. Lower case, digits and `_`.
    fn signal_name(&self, _index: usize) -> Option<&str> {
        None
    }

    /// Writes these signals, as they are after the last step.
    fn signals(&self, _values: &mut [R]) {}
}

#[cfg(test)]
mod tests;
