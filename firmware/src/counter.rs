//! Instructions between two points, counted by the emulated processor itself.
//!
//! Under `-icount` every instruction takes the same emulated time, so a timer is an instruction counter that
//! repeats exactly. Instructions are not cycles: on silicon a Cortex-M4F takes 1 to 14 cycles for one of them.

/// Instructions that `nops` executes, more or less the few of its call.
const NOPS: u32 = 1024;

/// A running timer, calibrated against instructions that do nothing.
pub struct Counter {
    per_nops: u32,
    overhead: u32,
}

impl Counter {
    /// Starts the timer. None where it does not run (no `-icount`, or real hardware without one).
    pub fn start() -> Option<Self> {
        timer::start();
        let mut counter = Self {
            per_nops: 1,
            overhead: 0,
        };
        let (short, long) = (counter.ticks(|| ()), counter.ticks(nops));
        counter.per_nops = long.saturating_sub(short);
        counter.overhead = short;
        (counter.per_nops > 0).then_some(counter)
    }

    fn ticks(&self, work: impl FnOnce()) -> u32 {
        let before = timer::now();
        work();
        timer::since(before)
    }

    /// The most instructions of `times` calls of `work` with 0, 1, 2, ...
    pub fn most(&self, times: u32, mut work: impl FnMut(u32)) -> u32 {
        (0..times).fold(0, |most, k| most.max(self.instructions(|| work(k))))
    }

    /// Instructions of `work`, to about one.
    pub fn instructions(&self, work: impl FnOnce()) -> u32 {
        let ticks = self.ticks(work).saturating_sub(self.overhead);
        // In parts, so that nothing overflows 32 bits; `start` has seen to it that the divisor is not 0.
        let whole = ticks.checked_div(self.per_nops).unwrap_or(0);
        let rest = ticks.checked_rem(self.per_nops).unwrap_or(0);
        whole * NOPS
            + (rest * NOPS + self.per_nops / 2)
                .checked_div(self.per_nops)
                .unwrap_or(0)
    }
}

#[inline(never)] // so much code in the middle of a function puts its literals out of reach
fn nops() {
    // SAFETY: does nothing.
    unsafe {
        core::arch::asm!(
            ".rept 1024",
            "nop",
            ".endr",
            options(nomem, nostack, preserves_flags)
        )
    }
}

#[cfg(target_arch = "arm")]
mod timer {
    //! SysTick: 24 bits, counting down.
    use cortex_m::peripheral::{Peripherals, SYST, syst::SystClkSource};

    const MASK: u32 = 0x00ff_ffff;

    pub(super) fn start() {
        // SAFETY: nothing else in these images uses a peripheral.
        let mut timer = unsafe { Peripherals::steal() }.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(MASK);
        timer.clear_current();
        timer.enable_counter();
    }

    #[inline(always)]
    pub(super) fn now() -> u32 {
        SYST::get_current()
    }

    #[inline(always)]
    pub(super) fn since(before: u32) -> u32 {
        before.wrapping_sub(SYST::get_current()) & MASK
    }
}

#[cfg(target_arch = "riscv32")]
mod timer {
    //! The counter of retired instructions.
    pub(super) fn start() {}

    #[inline(always)]
    pub(super) fn now() -> u32 {
        riscv::register::minstret::read() as u32
    }

    #[inline(always)]
    pub(super) fn since(before: u32) -> u32 {
        (riscv::register::minstret::read() as u32).wrapping_sub(before)
    }
}
