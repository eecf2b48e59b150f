//! Encoders: from a raw hardware reading to counts, angles and velocities.

use crate::constants::constant_struct;
use crate::error::within;
use crate::estimate::{VelocityConfig, VelocityEstimator, VelocityMethod, VelocityState};
use crate::{ConfigError, Real};

/// The configuration of an [`Encoder`].
///
/// ```
/// use omni_core::estimate::{Encoder, EncoderConfig, EncoderState, VelocityMethod};
/// // A motor with 28 edges a turn before a gear of 19.2, on a timer of 16 bits.
/// let observer = VelocityMethod::Observer { bandwidth_rad_s: 100.0 };
/// let config = EncoderConfig { counts_per_turn: 537.6, bits: 16, velocity: observer, period_s: 0.005_f32 };
/// let (encoder, mut state) = (Encoder::<_>::new(config)?, EncoderState::default());
/// let read = [0, 1, 2].map(|turns| encoder.step(&mut state, Some(turns * 538), None));
/// assert_eq!(read[0], Some(0.0)); // the first reading says nothing of the velocity
/// assert!(read[2] > Some(0.0) && (encoder.angle_rad(&state) - 2.0 * core::f32::consts::TAU).abs() < 0.01);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EncoderConfig<R> {
    /// Counted edges per turn of the measured shaft, 1 to 1e9 (four per line of a quadrature encoder), times the gear
    /// ratio if the encoder sits before the gear.
    pub counts_per_turn: R,
    /// Bits of the counter, 2 to 32.
    pub bits: u32,
    /// Method that estimates a velocity from the counts.
    pub velocity: VelocityMethod<R>,
    /// Control period \[s\], 0.000001 to 10.
    pub period_s: R,
}

/// A wheel's encoder on a hardware counter: from its raw reading to a velocity, by an [`EncoderCounter`]
/// and a [`VelocityEstimator`]. `WINDOW` is 1 unless the velocity uses a longer window.
///
/// ```
/// use omni_core::estimate::{Encoder, EncoderConfig, EncoderState, VelocityMethod};
/// let velocity = VelocityMethod::Window { periods: 1 };
/// let config = EncoderConfig { counts_per_turn: 360.0_f64, bits: 16, velocity, period_s: 0.001 };
/// let (encoder, mut state) = (Encoder::<_>::new(config)?, EncoderState::default());
/// let mut read = |raw| encoder.step(&mut state, raw, None).map(f64::to_degrees);
/// assert_eq!(read(Some(65_534)), Some(0.0));
/// assert!((read(Some(1)).unwrap() - 3000.0).abs() < 1e-9); // three degrees in a millisecond, across the wrap
/// assert_eq!(read(None), None);
/// assert!((read(Some(7)).unwrap() - 3000.0).abs() < 1e-9); // six in two
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Encoder<R, const WINDOW: usize = 1> {
    counter: EncoderCounter<R>,
    velocity: VelocityEstimator<R, WINDOW>,
}

constant_struct!(Encoder<R, const WINDOW> { counter: EncoderCounter<R>, velocity: VelocityEstimator<R, WINDOW> });

/// The state of one wheel's encoder; `default` before the first reading.
///
/// ```
/// use omni_core::estimate::EncoderState;
/// assert_eq!(EncoderState::<f32>::default().counts(), 0);
/// assert!(size_of::<EncoderState<f32>>() <= 96); // bytes
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct EncoderState<R, const WINDOW: usize = 1> {
    counter: CounterState,
    velocity: VelocityState<R, WINDOW>,
}

impl<R: Real, const WINDOW: usize> EncoderState<R, WINDOW> {
    /// Before the first reading, the wheel standing.
    ///
    /// ```
    /// use omni_core::estimate::EncoderState;
    /// const START: EncoderState<f32> = EncoderState::at_rest();
    /// assert_eq!((START, START.counts()), (EncoderState::default(), 0));
    /// ```
    #[must_use]
    pub const fn at_rest() -> Self {
        Self {
            counter: CounterState::new(),
            velocity: VelocityState::at_rest(),
        }
    }

    /// Counts since the first reading, positive forwards.
    #[must_use]
    pub fn counts(&self) -> i64 {
        self.counter.counts
    }
}

impl<R: Real, const WINDOW: usize> Default for EncoderState<R, WINDOW> {
    fn default() -> Self {
        Self::at_rest()
    }
}

impl<R: Real, const WINDOW: usize> Encoder<R, WINDOW> {
    /// An encoder of that configuration.
    ///
    /// # Errors
    /// As [`EncoderCounter::new`] and [`VelocityEstimator::new`].
    pub fn new(config: EncoderConfig<R>) -> Result<Self, ConfigError> {
        let counter = EncoderCounter::new(config.counts_per_turn, config.bits)?;
        let velocity = VelocityEstimator::new(VelocityConfig {
            method: config.velocity,
            count_rad: counter.count_rad,
            period_s: config.period_s,
        })?;
        Ok(Self { counter, velocity })
    }

    /// One control period: reads the present counter, and returns the velocity \[rad/s\]; none if the counter could not
    /// be read. The first reading after such a period accounts for the elapsed time. The wheel may turn by less than
    /// half the counter's range between two readings.
    ///
    /// `since_edge_s` is as in [`VelocityEstimator::step`].
    ///
    /// ```
    /// use omni_core::estimate::{Encoder, EncoderConfig, EncoderState};
    /// # let velocity = Default::default();
    /// # let config = EncoderConfig { counts_per_turn: 360.0_f64, bits: 16, velocity, period_s: 0.001 };
    /// let (encoder, mut states) = (Encoder::<_>::new(config)?, [EncoderState::default(); 3]);
    /// let mut readings_rad_s = [None; 3]; // as `DriveInput` has them
    /// for (wheel, raw) in [Some(7), None, Some(9)].into_iter().enumerate() {
    ///     readings_rad_s[wheel] = encoder.step(&mut states[wheel], raw, None);
    /// }
    /// assert_eq!(readings_rad_s, [Some(0.0), None, Some(0.0)]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step(
        &self,
        state: &mut EncoderState<R, WINDOW>,
        raw: Option<u32>,
        since_edge_s: Option<R>,
    ) -> Option<R> {
        let Some(raw) = raw else {
            self.velocity.missed(&mut state.velocity);
            return None;
        };
        let counts = self.counter.update(&mut state.counter, raw);
        Some(self.velocity.step(&mut state.velocity, counts, since_edge_s))
    }

    /// The velocity \[rad/s\] by a counter that was read `since_reading_s` \[s\] after the last time, if that time was
    /// measured: as [`VelocityEstimator::step_after`].
    ///
    /// ```
    /// use omni_core::estimate::{Encoder, EncoderConfig, EncoderState};
    /// # let velocity = Default::default();
    /// # let config = EncoderConfig { counts_per_turn: 360.0_f64, bits: 16, velocity, period_s: 0.001 };
    /// let (encoder, mut state) = (Encoder::<_>::new(config)?, EncoderState::default());
    /// encoder.step(&mut state, Some(0), None);
    /// let late = encoder.step_after(&mut state, 3, 0.0015, None); // the timer's interrupt came half a period late
    /// assert!((late.to_degrees() - 2000.0).abs() < 1e-9);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline]
    pub fn step_after(
        &self,
        state: &mut EncoderState<R, WINDOW>,
        raw: u32,
        since_reading_s: R,
        since_edge_s: Option<R>,
    ) -> R {
        let counts = self.counter.update(&mut state.counter, raw);
        self.velocity
            .step_after(&mut state.velocity, counts, since_reading_s, since_edge_s)
    }

    /// Angle since the first reading \[rad\], as [`EncoderCounter::angle_rad`].
    ///
    /// ```
    /// use omni_core::estimate::{Encoder, EncoderConfig, EncoderState};
    /// # let velocity = Default::default();
    /// # let config = EncoderConfig { counts_per_turn: 360.0_f64, bits: 16, velocity, period_s: 0.001 };
    /// let (encoder, mut state) = (Encoder::<_>::new(config)?, EncoderState::default());
    /// for raw in [65_530, 24] {
    ///     encoder.step(&mut state, Some(raw), None);
    /// }
    /// assert!((encoder.angle_rad(&state).to_degrees() - 30.0).abs() < 1e-9); // across the wrap
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn angle_rad(&self, state: &EncoderState<R, WINDOW>) -> R {
        self.counter.angle_rad(&state.counter)
    }
}

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

/// The state of a counter; `default` before the first reading.
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
    const fn new() -> Self {
        Self {
            counts: 0,
            last: 0,
            read: false,
        }
    }

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
    /// An encoder of `counts_per_turn` counted edges per turn of the measured shaft, 1 to 1e9 (four per line of a
    /// quadrature encoder), times the gear ratio if it sits before the gear; and a counter of `bits`, 2 to 32.
    ///
    /// # Errors
    /// Parameter `counts_per_turn` or `bits` if it is out of range.
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

    /// Takes in a reading and returns the counts since the one before, positive forwards; 0 for the
    /// first. Bits beyond the counter's width are ignored. The way round is the shorter one: read at least once in half
    /// the counter's range.
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
        // The counter's highest bit becomes bit 31 of 32: differences wrap as it does, and keep their sign.
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
