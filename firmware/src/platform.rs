//! Text out and the end of the program, through the emulator or the debug probe.

use core::convert::Infallible;

use semihosting::fd::{AsFd, OwnedFd};
use semihosting::sys::arm_compat::{OpenMode, sys_open, sys_read_orig, sys_write_orig, sys_writec};

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

/// The console as a stream of bytes, both ways.
pub struct Link {
    input: OwnedFd,
    output: OwnedFd,
}

impl Link {
    /// Opens both ends; none where there is no console.
    pub fn open() -> Option<Self> {
        Some(Self {
            input: sys_open(c":tt", OpenMode::RDONLY_BINARY).ok()?,
            output: sys_open(c":tt", OpenMode::WRONLY_TRUNC_BINARY).ok()?,
        })
    }

    /// Waits for bytes; none where the other end is closed.
    pub fn read<'a>(&mut self, bytes: &'a mut [u8]) -> Option<&'a [u8]> {
        let missing = sys_read_orig(self.input.as_fd(), bytes).ok()?;
        let got = bytes.len().checked_sub(missing).filter(|got| *got > 0)?;
        bytes.get(..got)
    }

    /// Writes all of it; false where that failed.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        sys_write_orig(self.output.as_fd(), bytes).is_ok_and(|missing| missing == 0)
    }
}
