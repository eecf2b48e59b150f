//! What the images share: the vehicle's constants, a way to speak, and a panic handler that cannot be linked.
#![no_std]

#[doc(hidden)]
pub use ufmt;

pub mod counter;
pub mod drive_cost;
pub mod platform;
pub mod randomised;
pub mod stack;
pub mod three;

/// The controller of the scenario that the image was built for.
pub mod constants {
    include!(concat!(env!("OUT_DIR"), "/constants.rs"));
}

/// A panic that could happen is an error of the linker: it finds no such function.
///
/// Only where the optimiser proves that no panic is reachable does this vanish; every image in this folder links.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        safe fn omnistep_a_panic_is_reachable() -> !;
    }
    omnistep_a_panic_is_reachable()
}
