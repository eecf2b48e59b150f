#![doc = include_str!("../README.md")]
//!
//! # In this crate
//!
//! A [`Linkage`] is a vehicle in the plane of its climb, a [`Step`] its obstacle; [`Linkage::climb_limits`] returns a
//! [`ClimbLimits`], with a [`RowLimits`] for each row of wheels. [`ClimbLimits::of`] reads all of it from a scenario.

#![forbid(unsafe_code)]

mod balance;
mod climb_limits;
mod climb_path;
mod error;
mod first_contact;
mod impact;
mod linkage;
mod step;

pub use climb_limits::{ClimbLimits, RowLimits, Verdict};
pub use error::Error;
pub use first_contact::{RowTouch, touch};
pub use linkage::Linkage;
pub use step::Step;
