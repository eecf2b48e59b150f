//! The control task of a four-wheeled vehicle, without a word about the chip: what `main.rs` binds to an STM32F407 and
//! what the tests bind to wheels that exist in memory alone.
#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod encoder;
pub mod frames;
pub mod motor;
pub mod task;

/// The controller of `vehicle/omni4-flat.toml`, as the simulator has it.
pub mod constants {
    include!(concat!(env!("OUT_DIR"), "/constants.rs"));
}

#[cfg(test)]
extern crate std;
