#![doc = include_str!("../README.md")]
//!
//! # In this crate
//!
//! A [`Linkage`] is a vehicle in the plane of its climb, a [`Step`] what it climbs; [`Linkage::bound`] gives a [`Bound`], with a
//! [`RowBound`] for each row of wheels. [`Bound::of`] takes all of it from a scenario.

#![forbid(unsafe_code)]

mod balance;
mod bound;
mod error;
mod impact;
mod linkage;
mod posture;
mod step;
mod touch;

pub use bound::{Bound, RowBound, Verdict};
pub use error::Error;
pub use linkage::Linkage;
pub use step::Step;
pub use touch::{RowTouch, touch};
