#![doc = include_str!("../README.md")]
//!
//! # In this crate
//!
//! A [`Linkage`] is a vehicle in the plane of its climb, a [`Step`] what it climbs; [`Linkage::bound`] gives a [`Bound`], with a
//! [`RowBound`] for each row of wheels. [`Bound::of`] takes all of it from a scenario.

#![forbid(unsafe_code)]

mod balance;
mod bound;
mod climb_path;
mod error;
mod first_contact;
mod impact;
mod linkage;
mod step;

pub use bound::{Bound, RowBound, Verdict};
pub use error::Error;
pub use first_contact::{RowTouch, touch};
pub use linkage::Linkage;
pub use step::Step;
