//! Encoder counters: from a raw hardware reading to counts and angles.

use crate::constants::constant_struct;
use crate::error::within;
use crate::{ConfigError, Real};

/// An incremental encoder on a hardware counter that wraps around, whatever its width.
///
/// ```
/// use omni_core::estimate::{CounterState, EncoderCounter};
/// let encoder = EncoderCounter::<f32>::new(360.0, 16)?; // a timer of 16 bits counts 360 edges a turn
/// let mut state = CounterState::default();
/// let readings: [u16; 4] = [65_530, 65_534, 2, 65_535];
/// let counted = readings.map(|raw| encoder.update(&mut state, u32::from(raw)));
/// assert_eq!(counted, [0, 4, 4, -3]); // across the wrap, and back
/// assert_eq!(state.counts(), 5);
/// assert!((encoder.angle_rad(&state) - 5.0 * core::f32::consts::TAU / 360.0).abs() < 1e-7);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct EncoderCounter<R> {
    count_rad: R,
    /// Bits of 32 that the counter has not.
    unused: u32,
}

constant_struct!(EncoderCounter<R> { count_rad: R, unused: u32 });

/// What is remembered of a counter; `default` before the first reading.
///
/// ```
/// use omni_core::estimate::CounterState;
/// assert_eq!(CounterState::default().counts(), 0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct CounterState {
    /// Counts since the first reading.
    counts: i64,
    /// The last reading, aligned to 32 bits, once there was one.
    last: u32,
    read: bool,
}

impl CounterState {
    /// Counts since the first reading, positive forwards.
    ///
    /// ```
    /// use omni_core::estimate::{CounterState, EncoderCounter};
    /// let encoder = EncoderCounter::<f64>::new(360.0, 32)?;
    /// let mut state = CounterState::default();
    /// for raw in [7_i32, -3] {
    ///     encoder.update(&mut state, raw as u32); // a signed counter is taken as its bits
    /// }
    /// assert_eq!(state.counts(), -10);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn counts(&self) -> i64 {
        self.counts
    }
}

impl<R: Real> EncoderCounter<R> {
    /// An encoder of `counts_per_turn` edges a turn of what shall be measured, 1 to 1e9, all of them counted (four a line of a quadrature
    /// encoder), times the gear's ratio where it sits before the gear; and a counter of `bits`, 2 to 32.
    ///
    /// # Errors
    /// Parameter `counts_per_turn` or `bits` where it is out of range.
    pub fn new(counts_per_turn: R, bits: u32) -> Result<Self, ConfigError> {
        let counts = within("counts_per_turn", counts_per_turn, 1.0..=1e9, "1 to 1e9")?;
        if !(2..=32).contains(&bits) {
            return Err(ConfigError::new("bits", f64::from(bits), "2 to 32"));
        }
        Ok(Self {
            count_rad: R::two_pi() / counts,
            unused: 32 - bits,
        })
    }

    /// Angle of one count \[rad\].
    #[must_use]
    pub fn count_rad(&self) -> R {
        self.count_rad
    }

    /// Takes in a reading and returns the counts since the one before, positive forwards; 0 for the first. Bits that the counter does not
    /// have are ignored. The way round is the shorter one: read at least once in half the counter's range.
    ///
    /// ```
    /// use omni_core::estimate::{CounterState, EncoderCounter};
    /// let encoder = EncoderCounter::<f64>::new(360.0, 24)?; // a counter of 24 bits
    /// let mut state = CounterState::default();
    /// encoder.update(&mut state, 0xff_ffff);
    /// assert_eq!(encoder.update(&mut state, 0x00_0001), 2);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn update(&self, state: &mut CounterState, raw: u32) -> i32 {
        // The counter's highest bit becomes that of 32: differences wrap as it does, and keep their sign.
        let aligned = raw << (self.unused & 31);
        let counts = if state.read {
            (aligned.wrapping_sub(state.last) as i32) >> (self.unused & 31)
        } else {
            0
        };
        (state.last, state.read) = (aligned, true);
        state.counts = state.counts.wrapping_add(i64::from(counts));
        counts
    }

    /// Angle since the first reading \[rad\], to the precision of the type: in `f32` whole counts up to 16.7 million.
    ///
    /// ```
    /// use omni_core::estimate::{CounterState, EncoderCounter};
    /// let encoder = EncoderCounter::<f64>::new(4.0, 8)?; // a quarter of a turn a count
    /// let mut state = CounterState::default();
    /// encoder.update(&mut state, 0);
    /// encoder.update(&mut state, 255);
    /// assert!((encoder.angle_rad(&state) + 1.5708).abs() < 1e-4); // a quarter back
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn angle_rad(&self, state: &CounterState) -> R {
        R::from_i64(state.counts).unwrap_or(R::zero()) * self.count_rad // every i64 has a nearest value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whatever_the_width_and_wherever_it_starts_the_counts_are_those_that_came(
            bits in 2..=32_u32, start in any::<u32>(), ways in prop::collection::vec(-1000..1000_i64, 1..50), junk in any::<u32>(),
        ) {
            let encoder = EncoderCounter::<f64>::new(360.0, bits).expect("valid");
            let (half, mask) = (1_i64 << (bits - 1), u32::MAX >> (32 - bits));
            let (mut state, mut at, mut sum) = (CounterState::default(), i64::from(start), 0);
            // Bits above the counter's are anything.
            let raw = |at: i64| (at as u32 & mask) | (junk & !mask);
            prop_assert_eq!(encoder.update(&mut state, raw(at)), 0);
            for way in ways {
                let way = way.clamp(-half, half - 1);
                at += way;
                sum += way;
                prop_assert_eq!(i64::from(encoder.update(&mut state, raw(at))), way);
            }
            prop_assert_eq!(state.counts(), sum);
        }
    }

    #[test]
    fn figures_are_checked_by_name() {
        let named = |counts, bits| {
            EncoderCounter::<f32>::new(counts, bits)
                .expect_err("refused")
                .parameter
        };
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(named(bad, 16), "counts_per_turn");
        }
        assert_eq!((named(1.0, 1), named(1.0, 33)), ("bits", "bits"));
    }
}
