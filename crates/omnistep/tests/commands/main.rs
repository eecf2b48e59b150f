//! The command line and what it leaves behind.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod chart;
mod cli;
#[cfg(unix)]
mod firmware;
mod plan;
mod study;
