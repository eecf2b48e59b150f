//! One program for all targets; the environment's `TARGET` says which.
#![no_main]

#[path = "../../tests/attack/targets/mod.rs"]
mod targets;

use std::sync::LazyLock;

use targets::{TARGETS, Target};

static TARGET: LazyLock<Target> = LazyLock::new(|| {
    let wanted = std::env::var("TARGET").unwrap_or_default();
    let known = TARGETS.map(|(name, _)| name).join(", ");
    *TARGETS
        .iter()
        .find(|(name, _)| *name == wanted)
        .unwrap_or_else(|| panic!("TARGET={wanted}, allowed: {known}"))
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    TARGET.1(data);
});
