//! The checksum of a part, which reveals any flipped bit.
//!
//! Parquet has room between its first four bytes and the first column, which no reader looks at.
//! There a part has the SHA-256 of all that follows, in one line of text. The columns' own
//! checksums would leave out what says where they are and what they mean.

use std::io::{self, ErrorKind, Read};

use sha2::{Digest, Sha256};

use crate::key::hex;

/// How a file of Parquet begins, and a part behind it.
const BEFORE: &[u8] = b"PAR1";
const NAME: &[u8] = b"omnistep sha256 ";
const DIGITS: usize = 64;
/// Bytes that a checksum takes behind `PAR1`, its last one the end of the line.
const BYTES: usize = NAME.len() + DIGITS + 1;

/// What a part's checksum says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Checksum {
    /// The bytes are those that were written.
    Right,
    /// They are not.
    Wrong,
    /// There is none, or not even its name is left.
    Missing,
}

/// The place of a checksum, to be written behind `PAR1`.
pub(crate) fn empty() -> [u8; BYTES] {
    [b' '; BYTES]
}

/// Writes the checksum of a whole file in its place.
pub(crate) fn close(bytes: &mut [u8]) {
    let Some((head, rest)) = bytes.split_at_mut_checked(BEFORE.len() + BYTES) else {
        return;
    };
    let line = line(&Sha256::digest(rest));
    head[BEFORE.len()..].copy_from_slice(&line);
}

/// Reads a whole file and says whether it is as it was written.
pub(crate) fn check(file: &mut impl Read) -> io::Result<Checksum> {
    let mut head = [0; BEFORE.len() + BYTES];
    match file.read_exact(&mut head) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(Checksum::Missing),
        read => read?,
    }
    let (before, checksum) = head.split_at(BEFORE.len());
    if before != BEFORE || !checksum.starts_with(NAME) {
        return Ok(Checksum::Missing);
    }
    let mut digest = Sha256::new();
    io::copy(file, &mut digest)?;
    Ok(if checksum == line(&digest.finalize()) {
        Checksum::Right
    } else {
        Checksum::Wrong
    })
}

fn line(digest: &[u8]) -> Vec<u8> {
    [NAME, hex(digest, DIGITS / 2).as_bytes(), b"\n"].concat()
}
