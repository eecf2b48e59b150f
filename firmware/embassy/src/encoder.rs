//! Encoders: counts in, velocities out.

/// A counter of encoder steps. embedded-hal 1.0 has no trait for one (that of 0.2, `Qei`, is gone), so this is ours.
pub trait Encoder {
    /// Why there is no count.
    type Error;

    /// The counter as it stands. It counts up while the wheel turns positively and wraps around at 2^16: of a counter of
    /// 32 bits, the lower half.
    ///
    /// # Errors
    /// Those of the device; a timer of the chip has none.
    fn count(&mut self) -> Result<u16, Self::Error>;
}

impl<E: Encoder + ?Sized> Encoder for &mut E {
    type Error = E::Error;

    fn count(&mut self) -> Result<u16, Self::Error> {
        (**self).count()
    }
}

/// A wheel's velocity by the difference of two counts a control period apart.
#[derive(Clone, Copy, Debug)]
pub struct Velocity {
    rad_s_per_count: f32,
    last: Option<u16>,
}

impl Velocity {
    /// For an encoder of `counts_per_turn` > 0 counts a turn of the wheel (four times the lines, times the gear), read
    /// every `period_us` \[us\] > 0.
    #[must_use]
    pub const fn new(counts_per_turn: u32, period_us: u32) -> Self {
        let turns_s = 1e6 / (counts_per_turn as f32 * period_us as f32);
        Self {
            rad_s_per_count: core::f32::consts::TAU * turns_s,
            last: None,
        }
    }

    /// The velocity \[rad/s\] by this period's count, right while the wheel turns by less than 32768 counts a period.
    ///
    /// None where the count did not arrive, and in the first period after that: one count determines no velocity.
    pub fn step(&mut self, count: Option<u16>) -> Option<f32> {
        let last = core::mem::replace(&mut self.last, count);
        // The difference modulo 2^16, taken as signed: right across the wrap, whichever way the wheel turns.
        let difference = count?.wrapping_sub(last?) as i16;
        Some(f32::from(difference) * self.rad_s_per_count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1000 counts a turn, every millisecond: a count is a turn a second.
    const TURN_PER_S: f32 = core::f32::consts::TAU;

    /// A unit in the last place or two: the factor was rounded once, the product once.
    fn is(velocity: Option<f32>, turns_s: f32) -> bool {
        velocity.is_some_and(|v| (v - turns_s * TURN_PER_S).abs() <= 2.0 * f32::EPSILON * v.abs())
    }

    #[test]
    fn velocity_is_right_across_the_wrap_in_both_directions() {
        let mut velocity = Velocity::new(1000, 1000);
        velocity.step(Some(65_530));
        assert!(is(velocity.step(Some(4)), 10.0));
        assert!(is(velocity.step(Some(65_530)), -10.0));
        assert!(is(velocity.step(Some(65_530)), 0.0));
    }

    #[test]
    fn velocity_is_right_up_to_half_the_counter_a_period() {
        let mut velocity = Velocity::new(1000, 1000);
        velocity.step(Some(40_000));
        assert!(is(velocity.step(Some(40_000_u16.wrapping_add(32_767))), 32_767.0));
        assert!(is(velocity.step(Some(40_000_u16.wrapping_sub(1))), -32_768.0));
    }

    #[test]
    fn a_count_without_one_before_it_gives_no_velocity() {
        let mut velocity = Velocity::new(1000, 1000);
        assert_eq!(velocity.step(Some(500)), None); // not 500 turns a second
        assert!(is(velocity.step(Some(501)), 1.0));
        assert_eq!(velocity.step(None), None);
        assert_eq!(velocity.step(Some(900)), None);
        assert!(is(velocity.step(Some(899)), -1.0));
    }
}
