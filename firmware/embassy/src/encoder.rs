//! Encoders: what a chip's counter is to the control task.

/// A counter of encoder steps. embedded-hal 1.0 has no trait for one (that of 0.2, `Qei`, is gone), so this is ours.
pub trait Encoder {
    /// Why there is no count.
    type Error;

    /// The counter as it stands. It counts up while the wheel turns positively and wraps around at
    /// 2^16: of a counter of 32 bits, the lower half.
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
