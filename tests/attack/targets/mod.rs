//! Six functions that take any bytes and panic where a law is broken. The campaign feeds them
//! random bits and a corpus, the fuzzer in `fuzz/` what it finds.

mod config;
mod drive;
mod height_map;
mod link;
mod log;
mod message;
mod numbers;
mod toml;
mod trace;

/// A target by its name, which is also that of its folder in `fuzz/corpus`. It returns how many
/// steps, frames or files it did; 0 for a file that is refused.
pub(crate) type Target = (&'static str, fn(&[u8]) -> usize);

/// All of them.
pub(crate) const TARGETS: [Target; 6] = [
    ("toml", toml::run),
    ("height_map", height_map::run),
    ("log", log::run),
    ("link", link::run),
    ("drive", drive::run),
    ("trace", trace::run),
];
