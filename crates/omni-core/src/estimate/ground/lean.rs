//! Lean of the base, angles of the hinges and their biases.

use super::input::GroundInput;
use crate::Real;
use crate::linkage::{Attitude, MAX_HINGES};
use crate::policy::{GRAVITY_M_S2, Imu, turned};
use crate::scalar::{all_plausible, follow, is_plausible, max, min};

/// Readings that a mean is as good as before the first: without a rest no single reading, as in the jolt of a start,
/// is a bias.
const PRIOR_READINGS: f64 = 20.0;
/// Time constant of the averages of rates \[s\].
pub(super) const RATES_S: f64 = 0.015;
/// Largest number of readings in the mean of a bias: later readings replace the oldest ones exponentially.
const MOST_READINGS: u16 = 4000;
/// Velocity beyond that by the wheels that counts half as an error of the lean \[m/s\].
const SLIP_M_S: f64 = 0.03;
/// Rate at which a gyro's bias is corrected, relative to that of the lean.
const BIAS_PART: f64 = 0.05;
/// Change of the rate of the base that the averages do not follow, as when a wheel lands \[rad/s\]; for how long a jolt
/// lasts at most \[s\], and part of the time. What trembles for longer is no jolt.
const JOLT_RAD_S: f64 = 0.3;
const JOLT_S: f64 = 0.1;
const JOLT_PART: f64 = 0.15;
/// Largest rate of the base that is used \[rad/s\].
const FASTEST_RAD_S: f64 = 50.0;
/// Largest rate of a measured angle that is one of the base, and not a jump of the sensor \[rad/s\].
const JUMP_RAD_S: f64 = 20.0;
/// Largest bias of a gyro \[rad/s\].
const LARGEST_BIAS_RAD_S: f64 = 1.0;
/// Largest sine of a lean.
const LARGEST_SINE: f64 = 0.9;

/// Lean and hinges, with the biases of their sensors: the mean readings of a vehicle that stands on level ground.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Lean<R> {
    /// Angles of nose and left side above the horizon, and the rates of the base about x and y, averaged.
    attitude: Attitude<R>,
    /// NaN is an angle that is not known.
    pub(super) hinges_rad: [R; MAX_HINGES],
    pub(super) hinges_rad_s: [R; MAX_HINGES],
    /// Roll and pitch as they were read last; not finite if they never were.
    read_rad: [R; 2],
    /// Biases: rates about x and y, specific force, hinges.
    gyro_rad_s: [R; 2],
    force_m_s2: [R; 3],
    hinge_rad: [R; MAX_HINGES],
    /// Velocity by the accelerometer beyond that by the wheels, forward and to the left, over some time.
    gained_m_s: [R; 2],
    count: u16,
    /// Gyros or angles have read how the base turned in the last period.
    pub(super) is_known: bool,
    /// The base begins or ends to turn: the averaged rates are wrong.
    pub(super) is_jolted: bool,
    /// For how long it may last \[s\].
    jolt_s: R,
}

impl<R: Real> Lean<R> {
    pub(super) const LEVEL: Self = Self {
        attitude: Attitude::LEVEL,
        hinges_rad: [R::ZERO; MAX_HINGES],
        hinges_rad_s: [R::ZERO; MAX_HINGES],
        read_rad: [R::ZERO; 2],
        gyro_rad_s: [R::ZERO; 2],
        force_m_s2: [R::ZERO; 3],
        hinge_rad: [R::ZERO; MAX_HINGES],
        gained_m_s: [R::ZERO; 2],
        count: 0,
        is_known: true,
        is_jolted: false,
        jolt_s: R::ZERO,
    };

    pub(super) fn attitude(&self) -> &Attitude<R> {
        &self.attitude
    }

    /// A period of a vehicle that stands: its mean rates are biases, and so are all readings if the ground is `level`.
    pub(super) fn stand<const N: usize>(&mut self, input: &GroundInput<R, N>, level: bool) {
        self.count = (self.count + 1).min(MOST_READINGS);
        let part = R::one() / R::of(f64::from(self.count) + PRIOR_READINGS);
        let [p, q, _] = input.imu.rate_rad_s;
        average(&mut self.gyro_rad_s, [p, q], part);
        if level {
            let [fx, fy, fz] = input.imu.specific_force_m_s2;
            average(&mut self.force_m_s2, [fx, fy, fz - R::of(GRAVITY_M_S2)], part);
            average(
                &mut self.read_rad,
                [input.imu.roll_rad, input.imu.pitch_rad],
                part,
            );
            average(&mut self.hinge_rad, input.hinges_rad, part);
        }
    }

    /// The vehicle moves: the next stand begins a new mean.
    pub(super) fn move_on(&mut self) {
        self.count = 0;
    }

    /// Reads attitude and hinges; the rates are averaged, with weight `part` of the newest one. Result: the readings
    /// without biases, with this lean.
    pub(super) fn read<const N: usize>(
        &mut self,
        input: &GroundInput<R, N>,
        level: bool,
        part: R,
        period_s: R,
    ) -> Imu<R> {
        let zero = R::zero();
        let known = |value: R, otherwise: R| if is_plausible(value) { value } else { otherwise };
        let mut imu = input.imu;
        let [p, q, r] = &mut imu.rate_rad_s;
        (*p, *q) = (*p - self.gyro_rad_s[0], *q - self.gyro_rad_s[1]);
        for (force, bias) in imu.specific_force_m_s2.iter_mut().zip(self.force_m_s2) {
            *force -= bias;
        }
        let attitude = &mut self.attitude;
        let most = R::of(FASTEST_RAD_S);
        let by_gyro = all_plausible(&[*p, *q]);
        let mut is_known = true;
        let [p, q, r] = [*p, *q, *r].map(|rate| known(rate, zero).limited(-most, most));
        let changes = max(
            (q + attitude.nose_up_rad_s).abs(),
            (p - attitude.left_up_rad_s).abs(),
        );
        let changes = by_gyro && !level && changes > R::of(JOLT_RAD_S);
        self.is_jolted = changes && self.jolt_s > R::zero();
        self.jolt_s += if changes {
            -period_s
        } else {
            R::of(JOLT_PART) * period_s
        };
        self.jolt_s = self.jolt_s.limited(R::zero(), R::of(JOLT_S));
        follow(&mut attitude.nose_up_rad_s, -q, part);
        follow(&mut attitude.left_up_rad_s, p, part);
        if level {
            (attitude.nose_up_rad, attitude.left_up_rad) = (zero, zero);
        } else {
            let turned = turned(attitude.left_up_rad, attitude.nose_up_rad, [p, q, r], period_s);
            let most = (R::of(LARGEST_SINE), R::of(JUMP_RAD_S) * period_s);
            let angles = [
                (&mut attitude.left_up_rad, imu.roll_rad),
                (&mut attitude.nose_up_rad, imu.pitch_rad),
            ];
            for (((lean, read), last), turned) in angles.into_iter().zip(&mut self.read_rad).zip(turned) {
                let change = read - *last;
                // Comparisons with NaN are false.
                let is_read = change.abs() <= most.1;
                let by = if is_read { change } else { turned };
                is_known &= is_read || by_gyro;
                *last = if is_plausible(read) { read } else { *last + turned };
                *lean = (*lean + by).limited(-most.0, most.0);
            }
        }
        self.is_known = is_known;
        (imu.roll_rad, imu.pitch_rad) = (attitude.left_up_rad, attitude.nose_up_rad);
        let hinges = input
            .hinges_rad
            .iter()
            .zip(&input.hinges_rad_s)
            .zip(self.hinge_rad);
        for ((angle, rate), ((read, read_s), bias)) in
            self.hinges_rad.iter_mut().zip(&mut self.hinges_rad_s).zip(hinges)
        {
            let is_known = is_plausible(*read);
            *angle = if is_known { *read - bias } else { R::of(f64::NAN) };
            follow(rate, known(*read_s, zero), part);
        }
        imu
    }

    /// A lean that is not measured approaches that by the accelerometer: in this period it gained velocity beyond the
    /// wheels'. A wrong lean lets the sum of it grow steadily; slip is more.
    pub(super) fn correct(&mut self, gained_m_s: [R; 2], is_even: bool, lean_s: R, period_s: R) {
        if !is_even || !all_plausible(&gained_m_s) {
            self.gained_m_s = [R::zero(); 2];
            return;
        }
        let rate = R::one() / lean_s;
        let most = R::of(LARGEST_SINE);
        // With a period as long as the time constant nothing is left of the sum before.
        let part = min(R::of(2.0) * rate * period_s, R::one());
        let attitude = &mut self.attitude;
        let [p, q] = &mut self.gyro_rad_s;
        // A gyro bias about y lowers the nose.
        let leans = [
            (&mut attitude.nose_up_rad, q, R::one()),
            (&mut attitude.left_up_rad, p, -R::one()),
        ];
        for (((lean, bias, sign), sum), gained) in leans.into_iter().zip(&mut self.gained_m_s).zip(gained_m_s)
        {
            *sum += gained - part * *sum;
            let by_rad = trust(*sum) * *sum * rate * rate * period_s / R::of(GRAVITY_M_S2);
            *lean = (*lean + by_rad).limited(-most, most);
            let corrected = *bias + sign * by_rad * rate * R::of(BIAS_PART);
            *bias = corrected.limited(-R::of(LARGEST_BIAS_RAD_S), R::of(LARGEST_BIAS_RAD_S));
        }
    }
}

/// Trust in a velocity beyond that by the wheels as an error of the lean: little if it is much, which is slip.
fn trust<R: Real>(gained_m_s: R) -> R {
    let slip = gained_m_s / R::of(SLIP_M_S);
    R::one() / (R::one() + slip * slip)
}

/// Adds readings to means; those that are not plausible are left out.
fn average<R: Real, const K: usize>(means: &mut [R; K], read: [R; K], part: R) {
    for (mean, read) in means.iter_mut().zip(read) {
        if is_plausible(read) {
            follow(mean, read, part);
        }
    }
}
