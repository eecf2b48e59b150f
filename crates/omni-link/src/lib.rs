#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

mod frame;
mod guard;
mod message;
mod served;
mod server;
mod wire;

pub use frame::{FrameError, Receiver, decode, encode};
pub use guard::{Action, Counters, Guard, HOLD_PERIODS};
pub use message::{
    Answer, Bodies, DriveReport, FromController, Greeting, MAX_ANSWER_FRAME, MAX_REQUEST_FRAME,
    PROTOCOL_VERSION, Request, ToController, answer_frame, request_frame, request_with_bodies_frame,
};
pub use served::{Loops, LoopsState, Served};
pub use server::Server;

#[cfg(test)]
extern crate std;
