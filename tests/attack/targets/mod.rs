//! Six functions that take any bytes and panic where a law is broken. The campaign feeds them random bits and a corpus, the
//! fuzzer in `fuzz/` what it finds.

mod config;
mod drive;
mod height_map;
mod link;
mod log;
mod numbers;
mod toml;
mod trace;

/// What a target did: steps, frames, files.
pub(crate) type Done = usize;

/// A target by its name, which is also that of its folder in `fuzz/corpus`.
pub(crate) type Target = (&'static str, fn(&[u8]) -> Done);

/// All of them.
pub(crate) const TARGETS: [Target; 6] = [
    ("toml", toml::run),
    ("height_map", height_map::run),
    ("log", log::run),
    ("link", link::run),
    ("drive", drive::run),
    ("trace", trace::run),
];

/// Longest message for a person.
const LONGEST_MESSAGE: usize = 300;

/// No longer than a person reads, and nothing that a terminal obeys, whatever was in the file.
fn check_message(error: &dyn std::fmt::Display) {
    let message = error.to_string();
    let characters = message.chars().count();
    assert!(
        characters <= LONGEST_MESSAGE,
        "a message of {characters} characters: {}...",
        message.chars().take(120).collect::<String>()
    );
    assert!(
        !message.chars().any(|c| c.is_control()),
        "control characters: {message:?}"
    );
}
