//! A controller at the other end of a link: faults on the way, and peers with false answers.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod drive_image;
mod link;
mod untrusted_firmware;
