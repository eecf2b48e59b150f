//! Messages for a person: short, and on one line.

/// Longest message for a person.
const LONGEST_MESSAGE: usize = 300;

/// No longer than a person reads, and nothing that a terminal obeys, whatever was in the file.
pub(super) fn check_message(error: &dyn std::fmt::Display) {
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
