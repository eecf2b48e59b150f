//! The controller's side of the loop in QEMU: frames come in and go out through semihosting's console, `:tt`.
//!
//! Works in lock-step: reads until a frame is whole, answers it, reads on. The host's clock is the only one.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cortex_m_semihosting::hio::{HostStream, hstdout};
use cortex_m_semihosting::{debug, nr, syscall};
use omni_core::{
    Controller, Coordination, PidConfig, PidGains, TorqueLimit, Wheel, WheelControlConfig, WheelLayout,
};
use omni_link::{Receiver, Server, answer_frame, request_frame};

/// Wheels.
const N: usize = 7;
/// Control period [us].
const PERIOD_US: u32 = 1000;
/// Digest of the constants below; the host says which one it wants.
const DIGEST: u32 = parse(option_env!("OMNI_LINK_DIGEST"));

#[entry]
fn main() -> ! {
    // Who ends without a reason to has failed: the host sees the image end, whatever it says.
    let _ = serve();
    stop()
}

fn serve() -> Option<()> {
    let controller = controller()?;
    let mut server = Server::<N>::new(DIGEST, PERIOD_US);
    let mut receiver = Receiver::<{ request_frame(N) }>::new();
    let mut answer = [0; answer_frame(N)];
    let (input, mut output) = (open_input()?, hstdout().ok()?);
    let mut bytes = [0; 64];
    loop {
        for &byte in read(input, &mut bytes)? {
            if let Some(frame) = receiver.push(byte) {
                send(&mut output, server.answer(&controller, frame, &mut answer))?;
            }
        }
    }
}

fn send(output: &mut HostStream, bytes: &[u8]) -> Option<()> {
    output.write_all(bytes).ok()
}

/// Opens the console for reading.
fn open_input() -> Option<usize> {
    let name = b":tt\0";
    // SAFETY: SYS_OPEN reads a string of the length given, which is the constant's without its closing zero.
    let handle = unsafe { syscall!(OPEN, name.as_ptr(), nr::open::R, name.len() - 1) };
    (handle != usize::MAX).then_some(handle)
}

/// Waits for bytes; nothing where the host has closed its end.
fn read(input: usize, bytes: &mut [u8]) -> Option<&[u8]> {
    // SAFETY: SYS_READ writes at most as many bytes as are given to where they are.
    let missing = unsafe { syscall!(READ, input, bytes.as_mut_ptr(), bytes.len()) };
    match bytes.len().checked_sub(missing) {
        Some(0) | None => None,
        Some(got) => bytes.get(..got),
    }
}

fn stop() -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    stop()
}

/// A hard fault ends the emulator too, instead of letting the host wait.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    stop()
}

/// The vehicle chugo7 under the policy "synchronised" at 1 kHz; generated constants will stand here.
fn controller() -> Option<Controller<f32, N>> {
    let places: [([f32; 2], [f32; 2]); N] = [
        ([-0.30, -0.23], [1.0, 0.0]),
        ([-0.30, 0.00], [0.0, -1.0]),
        ([-0.30, 0.23], [-1.0, 0.0]),
        ([0.00, 0.00], [1.0, 0.0]),
        ([0.30, -0.23], [1.0, 0.0]),
        ([0.30, 0.00], [0.0, 1.0]),
        ([0.30, 0.23], [-1.0, 0.0]),
    ];
    let wheels = places.map(|(position, direction)| Wheel::omni(position, direction, 0.066).geared(1.0));
    let gains = PidGains {
        kp_n_m_s_rad: 0.3,
        ki_n_m_rad: 2.0,
        kd_n_m_s2_rad: 0.0,
    };
    let config = WheelControlConfig {
        pid: PidConfig::new(gains, 1e-3),
        limits: [TorqueLimit::line(2.0, 0.0).ok()?; N],
        coordination: Coordination::preset("synchronised")?,
    };
    Controller::new(&WheelLayout::new(wheels).ok()?, config).ok()
}

/// A decimal number from the build's environment, 0 where there is none.
const fn parse(text: Option<&str>) -> u32 {
    let Some(text) = text else { return 0 };
    let (digits, mut number, mut k) = (text.as_bytes(), 0_u32, 0);
    while k < digits.len() {
        number = number.wrapping_mul(10).wrapping_add((digits[k] - b'0') as u32);
        k += 1;
    }
    number
}
