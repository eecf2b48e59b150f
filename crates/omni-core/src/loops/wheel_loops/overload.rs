//! Which wheels have been beyond a limit for so long that it is an overload, and no single reading.

use crate::Real;

#[cfg(test)]
const OVERLOAD_PERIODS: usize = 1 << Overload::new().count.len();

/// Number of consecutive periods in which each wheel has requested more than the same limit: anti-windup waits for 8.
/// Wheel i is bit i; at most 32 wheels.
///
/// One encoder count, or noise, can request more than a motor's torque in a single reading. If the integral reacted to
/// each, it would discard these readings and keep the remaining ones: a bias, with which the vehicle runs away or
/// creeps. Noise is beyond the same limit 8 times in a row in one period of 2^8.
///
/// ```
/// use omni_core::ControlState;
/// assert_eq!(ControlState::<f32, 7>::new().overload.wheels(), 0); // none
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Overload {
    /// Wheels that were beyond a limit in the step before.
    beyond: u32,
    /// Those of them that asked for more than their upper limit.
    above: u32,
    /// Periods in a row before that one, 0 to 7: bit i of `count[k]` is binary digit k of wheel i's count.
    count: [u32; 3],
}

impl Overload {
    /// None.
    pub(in crate::loops) const fn new() -> Self {
        Self {
            beyond: 0,
            above: 0,
            count: [0; 3],
        }
    }

    /// Wheels that are overloaded, wheel i as bit i.
    ///
    /// ```
    /// use omni_core::loops::WheelController;
    /// use omni_core::{ControlState, Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
    /// let gains = PidGains { kp_n_m_s_rad: 1.0, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
    /// let wheels = WheelController::new(WheelControlConfig {
    ///     pid: PidConfig::new(gains, 1e-3),
    ///     limits: [TorqueLimit::constant(1.0)?; 2],
    ///     coordination: Coordination::independent(),
    /// })?;
    /// let mut state = ControlState::default();
    /// let counts = [(); 9].map(|()| {
    ///     wheels.step(&mut state, &[0.5, 9.0].into(), &[0.0, 0.0].into());
    ///     state.overload.wheels()
    /// });
    /// assert_eq!(counts, [0, 0, 0, 0, 0, 0, 0, 0b10, 0b10]); // the second wheel, from the eighth period on
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn wheels(&self) -> u32 {
        let [ones, twos, fours] = self.count;
        ones & twos & fours
    }

    /// One step in which the wheels `beyond` ask for more than they can have; returns those that are overloaded.
    #[inline]
    pub(in crate::loops) fn step<R: Real, const N: usize>(&mut self, beyond: u32, requested: &[R; N]) -> u32 {
        let mut above = 0;
        for i in 0..N {
            above |= u32::from(requested[i] > R::zero()) << i;
        }
        if (beyond, above) == (self.beyond, self.above) && beyond == self.wheels() {
            return beyond; // as before, and it cannot count further
        }
        let again = beyond & self.beyond & !(above ^ self.above);
        let [ones, twos, fours] = self.count;
        let more = again & !(ones & twos & fours);
        let carry = ones & more;
        self.count = [
            (ones ^ more) & again,
            (twos ^ carry) & again,
            (fours ^ (twos & carry)) & again,
        ];
        (self.beyond, self.above) = (beyond, above);
        self.wheels()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_wheel_is_overloaded_once_it_was_beyond_the_same_limit_so_often_in_a_row(
            torques in prop::collection::vec(prop::array::uniform3(-1..=1_i8), 1..60),
        ) {
            let mut overload = Overload::new();
            let mut counts = [0_i8; 3];
            for torque in torques {
                let beyond = (0..3).map(|i| u32::from(torque[i] != 0) << i).sum();
                let wheels = overload.step(beyond, &torque.map(f64::from));
                for i in 0..3 {
                    // A plain count, up for one limit and down for the other.
                    let same = counts[i].signum() == torque[i];
                    counts[i] = if same { counts[i].saturating_add(torque[i]) } else { torque[i] };
                    let lasts = usize::from(counts[i].unsigned_abs()) >= OVERLOAD_PERIODS;
                    prop_assert_eq!(wheels & (1 << i) != 0, lasts);
                }
            }
        }
    }
}
