//! FNV-1a over what the examples compute.
#![allow(dead_code, reason = "no example needs all of it")]

/// What a hash starts with.
pub(crate) const START: u32 = 0x811c_9dc5;

/// Over bytes.
pub(crate) fn take_bytes(hash: u32, bytes: &[u8]) -> u32 {
    bytes.iter().fold(hash, |hash, byte| {
        (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193)
    })
}

/// Over the bits of a number.
pub(crate) fn take(hash: u32, value: f32) -> u32 {
    take_bytes(hash, &value.to_bits().to_le_bytes())
}

/// Over those of some.
pub(crate) fn take_all(hash: u32, values: &[f32]) -> u32 {
    values.iter().fold(hash, |hash, value| take(hash, *value))
}
