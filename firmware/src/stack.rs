//! How deep the stack gets.

const WORDS: usize = 1024;
const PAINT: u32 = 0xa5a5_5a5a;
/// Left alone below the present frame: what painting itself uses.
const MARGIN: usize = 16;

/// Bytes of stack that `work` uses below the frame it is called from, to a word; 4 KiB at most are seen.
#[inline(never)]
pub fn used_by(work: impl FnOnce()) -> u32 {
    let here = stack_pointer();
    let top = here.wrapping_sub(MARGIN * 4);
    for word in 1..=WORDS {
        // SAFETY: memory below the stack pointer that belongs to the stack; nothing interrupts these images.
        unsafe { (top.wrapping_sub(4 * word) as *mut u32).write_volatile(PAINT) };
    }
    work();
    let mut untouched = 0;
    for word in (1..=WORDS).rev() {
        // SAFETY: as above.
        if unsafe { (top.wrapping_sub(4 * word) as *const u32).read_volatile() } != PAINT {
            break;
        }
        untouched += 1;
    }
    ((MARGIN + WORDS - untouched) * 4) as u32
}

#[inline(always)]
fn stack_pointer() -> usize {
    let pointer: usize;
    // SAFETY: reads a register.
    #[cfg(target_arch = "arm")]
    unsafe {
        core::arch::asm!("mov {}, sp", out(reg) pointer, options(nomem, nostack, preserves_flags));
    }
    // SAFETY: reads a register.
    #[cfg(target_arch = "riscv32")]
    unsafe {
        core::arch::asm!("mv {}, sp", out(reg) pointer, options(nomem, nostack, preserves_flags));
    }
    pointer
}
