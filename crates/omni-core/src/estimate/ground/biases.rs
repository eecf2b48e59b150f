//! Biases of gyros, accelerometer, attitude and hinges: mean readings of a vehicle that stands.

use super::inertial::GRAVITY_M_S2;
use super::input::GroundInput;
use crate::Real;
use crate::linkage::MAX_HINGES;
use crate::policy::Imu;
use crate::scalar::{all_plausible, follow, is_plausible};

/// Largest number of readings in a mean: later readings replace the oldest ones exponentially.
const MOST_READINGS: u16 = 2000;

/// Biases, each the mean of the readings since the vehicle stands.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Biases<R> {
    gyro_rad_s: [R; 3],
    accelerometer_m_s2: [R; 3],
    /// Of pitch and roll.
    lean_rad: [R; 2],
    hinge_rad: [R; MAX_HINGES],
    /// Readings since the vehicle stands, and those of them on level ground.
    count: u16,
    level_count: u16,
}

/// Inertial readings less their biases. A reading that is not plausible stays so.
pub(super) struct Unbiased<R> {
    pub(super) rate_rad_s: [R; 3],
    pub(super) force_m_s2: [R; 3],
    /// Angles of nose and left side above the horizon.
    pub(super) lean_rad: [R; 2],
}

impl<R: Real> Biases<R> {
    pub(super) fn none() -> Self {
        let zero = R::zero();
        Self {
            gyro_rad_s: [zero; 3],
            accelerometer_m_s2: [zero; 3],
            lean_rad: [zero; 2],
            hinge_rad: [zero; MAX_HINGES],
            count: 0,
            level_count: 0,
        }
    }

    /// Takes in the readings of a period. Weight of the newest reading in the means of the gyros; none if the vehicle
    /// does not stand.
    pub(super) fn learn<const N: usize>(&mut self, input: &GroundInput<R, N>) -> Option<R> {
        if !input.standing {
            (self.count, self.level_count) = (0, 0);
            return None;
        }
        self.count = (self.count + 1).min(MOST_READINGS);
        let part = self.newest_part();
        let zero = R::zero();
        average(&mut self.gyro_rad_s, input.imu.rate_rad_s, [zero; 3], part);
        if input.level {
            self.level_count = (self.level_count + 1).min(MOST_READINGS);
            let part = R::one() / R::of(f64::from(self.level_count));
            let gravity = [zero, zero, R::of(GRAVITY_M_S2)];
            average(
                &mut self.accelerometer_m_s2,
                input.imu.specific_force_m_s2,
                gravity,
                part,
            );
            average(
                &mut self.lean_rad,
                [input.imu.pitch_rad, input.imu.roll_rad],
                [zero; 2],
                part,
            );
            average(&mut self.hinge_rad, input.hinges_rad, [zero; MAX_HINGES], part);
        }
        Some(part)
    }

    /// Weight of the newest reading in a mean of all readings since the vehicle stands.
    pub(super) fn newest_part(&self) -> R {
        R::one() / R::of(f64::from(self.count.max(1)))
    }

    pub(super) fn hinges(&self, read_rad: &[R; MAX_HINGES]) -> [R; MAX_HINGES] {
        less(read_rad, &self.hinge_rad)
    }

    pub(super) fn imu(&self, imu: &Imu<R>) -> Unbiased<R> {
        Unbiased {
            rate_rad_s: less(&imu.rate_rad_s, &self.gyro_rad_s),
            force_m_s2: less(&imu.specific_force_m_s2, &self.accelerometer_m_s2),
            lean_rad: less(&[imu.pitch_rad, imu.roll_rad], &self.lean_rad),
        }
    }
}

impl<R: Real> Unbiased<R> {
    /// The accelerometer; none if one of its axes is without a plausible reading.
    pub(super) fn force(&self) -> Option<&[R; 3]> {
        all_plausible(&self.force_m_s2).then_some(&self.force_m_s2)
    }

    /// The gyros; none if one of them is without a plausible reading.
    pub(super) fn rate(&self) -> Option<&[R; 3]> {
        all_plausible(&self.rate_rad_s).then_some(&self.rate_rad_s)
    }

    /// The measured lean; none without plausible readings.
    pub(super) fn lean(&self) -> Option<[R; 2]> {
        all_plausible(&self.lean_rad).then_some(self.lean_rad)
    }
}

fn less<R: Real, const K: usize>(read: &[R; K], bias: &[R; K]) -> [R; K] {
    let mut unbiased = *read;
    for (each, bias) in unbiased.iter_mut().zip(bias) {
        *each -= *bias;
    }
    unbiased
}

/// Adds readings less their expected values to the means; readings that are not plausible are left out.
fn average<R: Real, const K: usize>(means: &mut [R; K], read: [R; K], expected: [R; K], part: R) {
    for ((mean, read), expected) in means.iter_mut().zip(read).zip(expected) {
        if is_plausible(read) {
            follow(mean, read - expected, part);
        }
    }
}
