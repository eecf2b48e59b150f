//! The controller's side of the processor in the loop: frames come in and go out through the
//! semihosting console. A scenario with a `[drive]` gets its drive served, another one its loops.
//!
//! Works in lock-step: reads until a frame is whole, answers it, reads on. The host's clock is the only
//! one. On a board the same [`Server`] sits behind a serial line, and a timer calls [`Server::missed`].
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use omni_firmware::constants::{DIGEST, PERIOD_US, SERVED, ServedState, WHEELS};
use omni_firmware::platform::{Link, exit};
use omni_link::{Receiver, Server, answer_frame, request_with_bodies_frame};

#[entry]
fn main() -> ! {
    static mut SERVER: Server<ServedState, WHEELS> = Server::new(DIGEST, PERIOD_US);
    static mut RECEIVER: Receiver<{ request_with_bodies_frame(WHEELS) }> = Receiver::new();
    static mut ANSWER: [u8; answer_frame(WHEELS)] = [0; answer_frame(WHEELS)];
    let Some(mut link) = Link::open() else { exit(false) };
    let mut bytes = [0; 64];
    // Until the host closes its end.
    while let Some(bytes) = link.read(&mut bytes) {
        for &byte in bytes {
            if let Some(frame) = RECEIVER.push(byte)
                && !link.write(SERVER.answer(&SERVED, frame, ANSWER))
            {
                exit(false)
            }
        }
    }
    exit(true)
}

/// A fault ends the emulator too, instead of letting the host wait.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    exit(false)
}
