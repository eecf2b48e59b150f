//! Which loops drive the wheels.

use crate::constants::constant_enum;

/// The control mode of the wheels.
///
/// ```
/// use omni_core::traction::{TractionLoops, TractionState};
/// assert_eq!(TractionState::<f64, 4>::new().loops(), TractionLoops::Plain);
/// assert_eq!(TractionLoops::Fallback.number(), 2);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum TractionLoops {
    /// Every wheel's own loop: nothing slips, climbs or is held up.
    Plain = 0,
    /// One thrust, slip control of each wheel.
    Traction = 1,
    /// Every wheel's own loop, because the measured speed is implausible: until the command rests.
    Fallback = 2,
}

constant_enum!(TractionLoops {
    Plain,
    Traction,
    Fallback
});

impl TractionLoops {
    /// The number that stands for it in tables, 0 to 2 in the order above.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }
}
