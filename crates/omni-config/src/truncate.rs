//! Messages cut to a readable length.

use std::borrow::Cow;

/// Most characters of a value, a key or a name in a message.
const MOST: usize = 200;
/// Most characters of what is allowed instead, this program's own words: with the names of a file
/// and of a key no more than 300.
const MOST_ALLOWED: usize = 220;
/// Minimum remaining length of a cut value.
const LEAST: usize = 60;
/// A value is whole up to this much: a key that there is not, and the one that was meant.
const MEANT: usize = 90;
/// Where what is allowed begins, in our words and in serde's.
const ALLOWED: [&str; 2] = [", allowed:", ", expected "];

/// A message about a value, at most some 200 characters of it: where it says what is allowed that is kept and the
/// value before it is cut, else its middle is left out. Control characters are written out: a message is one line.
///
/// ```
/// use omni_config::shortened;
/// assert_eq!(shortened("-1, allowed: 0 to 2"), "-1, allowed: 0 to 2");
/// let long = format!("{:?}, allowed: 1 to 40 letters", "a".repeat(1_000_000));
/// let short = shortened(&long);
/// assert!(short.starts_with("\"aaaa") && short.ends_with("aaa..., allowed: 1 to 40 letters"));
/// assert_eq!(short.len(), 200);
/// ```
#[must_use]
pub fn shortened(message: &str) -> Cow<'_, str> {
    if message.len() <= MOST && !message.contains(char::is_control) {
        return message.into();
    }
    // Of a message of 100 MB neither end is looked at for long.
    let allowed = ALLOWED.iter().filter_map(|word| last(message, word)).max();
    let Some((value, allowed)) = allowed.and_then(|at| message.split_at_checked(at)) else {
        if fits(message, MOST) {
            return one_line(message).into();
        }
        let begin = one_line(head(message, MOST - LEAST - 3));
        return format!("{begin}...{}", one_line(tail(message, LEAST))).into();
    };
    // A list of what there is may be long, beside a value that is not.
    let (most, least) = if fits(value, LEAST) {
        (MOST_ALLOWED, LEAST)
    } else if fits(value, MEANT) {
        (MOST_ALLOWED + LEAST - MEANT, MEANT)
    } else {
        (MOST - LEAST, LEAST)
    };
    let allowed = if fits(allowed, most) {
        one_line(allowed)
    } else {
        // Every name without its quotes says more than half of the names with them.
        cut(&allowed.replace('`', ""), most)
    };
    let room = MOST.saturating_sub(allowed.chars().count()).max(least);
    format!("{}{allowed}", cut(value, room)).into()
}

/// Most characters of a line on standard error.
const MOST_OF_LINE: usize = 300;
/// Characters of its end that are kept: what is allowed, or what to type.
const END_OF_LINE: usize = 150;

/// A finished line, at most 300 characters of it: its middle is left out. What stands in it is
/// short, each alone; a path, a key and a list together may not be.
///
/// ```
/// use omni_config::shortened_line;
/// assert_eq!(shortened_line("error: short"), "error: short");
/// let line = shortened_line(&format!("error: {}, allowed: 0 to 2", "key".repeat(1000))).into_owned();
/// assert!(line.starts_with("error: keykey") && line.ends_with("key, allowed: 0 to 2"));
/// assert_eq!(line.len(), 300);
/// ```
#[must_use]
pub fn shortened_line(line: &str) -> Cow<'_, str> {
    let whole = fits(line, MOST_OF_LINE);
    if whole && !line.contains(char::is_control) {
        return line.into();
    }
    // Written out they may be six times as long; of a line of 100 MB neither end is looked at for long.
    let (begin, end) = (
        one_line(head(line, MOST_OF_LINE)),
        one_line(tail(line, MOST_OF_LINE)),
    );
    if whole && fits(&begin, MOST_OF_LINE) {
        return begin.into();
    }
    let begin = head(&begin, MOST_OF_LINE - END_OF_LINE - 3);
    format!("{begin}...{}", tail(&end, END_OF_LINE)).into()
}

/// A key: whole, or the beginning of what cannot be one.
pub(crate) fn short_key(key: &str) -> String {
    cut(key, if fits(key, MOST) { MOST } else { LEAST })
}

/// Where the last `word` within reach of the end begins.
fn last(message: &str, word: &str) -> Option<usize> {
    // What is allowed is never longer in our own words; further up it is part of the value.
    let reach = message.len() - tail(message, 4 * MOST_ALLOWED).len();
    message[reach..].rfind(word).map(|at| reach + at)
}

/// At most so many characters, the last of them dots where some are left out.
fn cut(text: &str, most: usize) -> String {
    if fits(text, most) {
        one_line(text)
    } else {
        format!("{}...", one_line(head(text, most - 3)))
    }
}

/// Has it at most so many characters?
pub(crate) fn fits(text: &str, most: usize) -> bool {
    text.chars().nth(most).is_none()
}

fn head(text: &str, most: usize) -> &str {
    text.char_indices().nth(most).map_or(text, |(at, _)| &text[..at])
}

fn tail(text: &str, most: usize) -> &str {
    let from = text.char_indices().rev().nth(most.saturating_sub(1));
    from.map_or(text, |(at, _)| &text[at..])
}

fn one_line(text: &str) -> String {
    text.chars()
        .flat_map(|c| {
            let written = if c.is_control() {
                Some(c.escape_default())
            } else {
                None
            };
            let plain = if written.is_none() { Some(c) } else { None };
            written.into_iter().flatten().chain(plain)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_of_any_length_is_cut_and_still_says_what_is_allowed() {
        for length in [0, 10, 150, 199, 200, 201, 1_000, 10_000_000] {
            let message = format!("{}, allowed: 0 to 2", "x".repeat(length));
            let short = shortened(&message);
            assert!(short.chars().count() <= MOST, "{length}");
            assert!(
                short.ends_with("x, allowed: 0 to 2")
                    || short.ends_with("..., allowed: 0 to 2")
                    || length == 0
            );
            assert_eq!(short == message, message.len() <= MOST, "{length}");
            let plain = "y".repeat(length);
            assert!(shortened(&plain).chars().count() <= MOST, "{length}");
        }
    }

    #[test]
    fn a_list_of_what_is_allowed_is_kept_where_it_is_ours_and_cut_where_it_cannot_be() {
        let list = format!(
            "unknown field `hight_m`, expected one of {}",
            "`height_m`, ".repeat(20)
        );
        let plain = format!(
            "unknown field `hight_m`, expected one of {}",
            "height_m, ".repeat(20)
        );
        assert_eq!(shortened(&list), plain); // 259 characters are 219
        let list = format!(
            "unknown field `hight_m`, expected one of {}",
            "`height_m`, ".repeat(1000)
        );
        assert!(shortened(&list).len() <= LEAST + MOST_ALLOWED);
    }

    #[test]
    fn a_finished_line_has_at_most_300_characters_and_keeps_its_beginning_and_its_end() {
        for length in [0, 250, 280, 281, 282, 300, 301, 10_000_000] {
            for letter in ["x", "ä", "\n"] {
                let line = format!("error: {}, allowed: 1", letter.repeat(length));
                let short = shortened_line(&line);
                assert!(short.chars().count() <= MOST_OF_LINE, "{length}");
                assert!(short.starts_with("error: ") && short.ends_with(", allowed: 1"));
                let whole = line.chars().count() <= MOST_OF_LINE && !line.contains('\n');
                assert_eq!(short == line, whole, "{length}");
                assert!(!short.contains('\n'));
            }
        }
    }

    #[test]
    fn letters_of_any_alphabet_are_cut_between_and_lines_are_joined() {
        let message = "äß漢🦀".repeat(1000);
        assert_eq!(shortened(&message).chars().count(), MOST);
        assert_eq!(shortened("two\nlines\u{1b}[31m"), "two\\nlines\\u{1b}[31m");
    }
}
