//! The covariance of the state, and what is done with it.

use crate::Real;

pub(super) const X: usize = 0;
pub(super) const Y: usize = 1;
pub(super) const YAW: usize = 2;
pub(super) const VX: usize = 3;
pub(super) const VY: usize = 4;
pub(super) const BIAS: usize = 5;
/// The first of three.
pub(super) const SLIP: usize = 6;
pub(super) const SLIP_Y: usize = 7;
pub(super) const SIZE: usize = 9;

/// Symmetric.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Matrix<R>(pub(super) [[R; SIZE]; SIZE]);

/// How a period moves the state, to first order.
pub(super) struct Motion<R> {
    /// Way in the world \[m\].
    pub(super) way: [R; 2],
    /// Derivatives of the place by the velocity before: rows x and y.
    pub(super) carried: [[R; 2]; 2],
    /// Cosine and sine of the turn.
    pub(super) turned: [R; 2],
    /// Derivatives by what the gyro is off \[rad/s\]: of the place, the yaw and the velocity.
    pub(super) by_rate: [R; 5],
    /// The gyro's bias counts: 1, or 0 if there is no gyro.
    pub(super) biased: R,
    /// What is left of a slip in yaw.
    pub(super) fades: R,
}

impl<R: Real> Motion<R> {
    fn carry(&self, p: &[R; SIZE]) -> [R; SIZE] {
        let [x, y, yaw, vx, vy, bias, sx, sy, sw] = *p;
        let ([dx, dy], [cos, sin]) = (self.way, self.turned);
        let [[xx, xy], [yx, yy]] = self.carried;
        // A bias reduces the rate.
        let off = -(bias * self.biased);
        let [rx, ry, ryaw, rvx, rvy] = self.by_rate;
        [
            x - dy * yaw + xx * vx + xy * vy + rx * off,
            y + dx * yaw + yx * vx + yy * vy + ry * off,
            yaw + ryaw * off,
            cos * vx + sin * vy + rvx * off,
            cos * vy - sin * vx + rvy * off,
            bias,
            sx,
            sy,
            self.fades * sw,
        ]
    }
}

impl<R: Real> Matrix<R> {
    pub(super) fn diagonal(variances: [R; SIZE]) -> Self {
        let mut p = [[R::zero(); SIZE]; SIZE];
        for (i, variance) in variances.into_iter().enumerate() {
            p[i][i] = variance;
        }
        Self(p)
    }

    /// The pose's own part, without correlation with the other states.
    pub(super) fn set_pose(&mut self, known: &[[R; 3]; 3]) {
        for i in 0..3 {
            for j in 0..SIZE {
                let value = if j < 3 { known[i][j] } else { R::zero() };
                self.0[i][j] = value;
                self.0[j][i] = value;
            }
        }
    }

    /// `F P F^T + rate_variance g g^T`, g being the derivatives by the rate.
    pub(super) fn carry(&mut self, motion: &Motion<R>, rate_variance: R) {
        let once = self.0.map(|row| motion.carry(&row));
        for i in 0..SIZE {
            let column = once.map(|row| row[i]);
            let carried = motion.carry(&column);
            for j in i..SIZE {
                self.0[i][j] = carried[j];
                self.0[j][i] = carried[j];
            }
        }
        for (row, a) in self.0.iter_mut().zip(&motion.by_rate) {
            for (value, b) in row.iter_mut().zip(&motion.by_rate) {
                *value += rate_variance * (*a * *b);
            }
        }
    }

    /// `P h` of a wheel whose row is `row`: it shows velocity and slip.
    pub(super) fn seen_by(&self, row: &[R; 3]) -> [R; SIZE] {
        let [a, b, c] = *row;
        self.0
            .map(|p| a * (p[VX] + p[SLIP]) + b * (p[VY] + p[SLIP + 1]) + c * p[SLIP + 2])
    }

    /// Processes a scalar reading with the innovation variance `variance`, `seen` being `P h`; returns the gain.
    /// Joseph's form `(I - k h^T) P (I - k h^T)^T + k r k^T`, multiplied out: `P - k m^T - m k^T` with
    /// `m = P h - k variance / 2`.
    pub(super) fn take(&mut self, seen: &[R; SIZE], variance: R) -> [R; SIZE] {
        let (per, half) = (R::one() / variance, R::of(0.5) * variance);
        let gain = seen.map(|s| s * per);
        let mut m = *seen;
        for (m, k) in m.iter_mut().zip(&gain) {
            *m -= half * *k;
        }
        for i in 0..SIZE {
            for j in i..SIZE {
                let value = self.0[i][j] - gain[i] * m[j] - m[i] * gain[j];
                self.0[i][j] = value;
                self.0[j][i] = value;
            }
        }
        gain
    }

    /// Where rounding has left less than nothing of a variance, the variances stay, and what they have in common
    /// is forgotten: no digit of it is known. Joseph's form leaves less than nothing only if readings are
    /// absurd: `f32` keeps seven digits of variances that these make 1e7 times as large as those that follow.
    pub(super) fn keep_positive(&mut self) {
        if (0..SIZE).any(|i| self.0[i][i] < R::zero()) {
            *self = Self::diagonal(core::array::from_fn(|i| self.0[i][i].abs()));
        }
    }
}
