//! Text out and the end of the program, through the emulator or the debug probe.

use core::convert::Infallible;

use semihosting::sys::arm_compat::sys_writec;

/// The console: `ufmt::uwriteln!(Console, "{}", 1)`.
pub struct Console;

impl ufmt::uWrite for Console {
    type Error = Infallible;

    fn write_str(&mut self, text: &str) -> Result<(), Infallible> {
        for byte in text.bytes() {
            sys_writec(byte);
        }
        Ok(())
    }
}

/// Prints a line as [`ufmt::uwriteln!`] formats it.
#[macro_export]
macro_rules! say {
    ($($format:tt)*) => {{
        let Ok(()) = $crate::ufmt::uwriteln!($crate::platform::Console, $($format)*);
    }};
}

/// Ends the program; the emulator's exit code is 0 where `good`.
pub fn exit(good: bool) -> ! {
    semihosting::process::exit(i32::from(!good))
}
