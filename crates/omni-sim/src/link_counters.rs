//! Frames of a link that were not received.

use std::fmt;

use omni_link::Counters;

/// Frames that were not received as they were sent, both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct LinkCounters {
    /// Of answers, counted here.
    pub answers: Counters,
    /// Of requests, as the controller last said.
    pub requests: Counters,
}

impl LinkCounters {
    /// All arrived.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.answers.is_zero() && self.requests.is_zero()
    }
}

impl fmt::Display for LinkCounters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            answers: a,
            requests: r,
        } = self;
        write!(
            f,
            "answers: {} lost, {} truncated, {} corrupted; ",
            a.lost, a.truncated, a.corrupted
        )?;
        write!(
            f,
            "requests: {} lost, {} truncated, {} corrupted",
            r.lost, r.truncated, r.corrupted
        )
    }
}
