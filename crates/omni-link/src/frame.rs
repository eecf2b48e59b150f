//! A message in a frame: postcard, then CRC-32 (MPEG-2, little end first), both COBS-stuffed, then a zero byte.

#[cfg(test)]
mod tests;

use cobs::{CobsEncoder, DecodeResult, DecoderState};
use crc::{CRC_32_MPEG_2, Crc, NoTable};
use postcard::ser_flavors::Flavor;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Bit by bit: a table of 1 KiB would be the largest thing in the firmware. Of the common checks this is the
/// one that is its own start for the bytes that follow, and the one that many microcontrollers have a unit for.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_MPEG_2);

/// The check of nothing.
const CHECK_OF_NOTHING: u32 = CRC_32_MPEG_2.init;

/// The check with one more byte. Never inlined: it would be unrolled for every caller.
#[inline(never)]
fn check_with(check: u32, byte: u8) -> u32 {
    let mut digest = CRC.digest_with_initial(check);
    digest.update(&[byte]);
    digest.finalize()
}

/// The error of a received frame.
///
/// The border between the two is a guess where bytes are damaged that say how long something is; that
/// a frame is not as it was sent is none: 32 bits of check, and every single flipped bit is noticed.
///
/// ```
/// use omni_link::{FrameError, decode, encode};
/// let mut buffer = [0; 16];
/// let sent = encode(&[1.5_f32, -2.0], &mut buffer).map_or(0, |frame| frame.len());
/// assert_eq!(sent, 2 * 4 + 4 + 2); // and the check, one byte of stuffing, the closing zero
/// let mut received = buffer;
/// assert_eq!(decode::<[f32; 2]>(&mut received[..6]), Err(FrameError::Truncated));
/// let mut received = buffer;
/// received[4] ^= 1;
/// assert_eq!(decode::<[f32; 2]>(&mut received[..sent]), Err(FrameError::Corrupted));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// Shorter than the message that it begins.
    Truncated,
    /// The check fails, or what it covers is no message of this protocol.
    Corrupted,
}

/// Writes `message` as one frame, with its closing zero, to the front of `out` and returns that
/// part; nothing if `out` is too short. There is no other zero in a frame.
///
/// ```
/// use omni_link::{decode, encode};
/// let mut buffer = [0; 16];
/// let frame = encode(&(7_u8, f32::NAN), &mut buffer).unwrap_or_default();
/// assert_eq!(frame.iter().position(|&byte| byte == 0), Some(frame.len() - 1));
/// let (number, nan) = decode::<(u8, f32)>(&mut buffer).expect("as it was sent");
/// assert_eq!((number, nan.to_bits()), (7, f32::NAN.to_bits()));
/// assert!(encode(&[0.0_f32; 4], &mut buffer).is_none()); // 16 bytes, the check and the rest
/// ```
pub fn encode<'a, T: Serialize + ?Sized>(message: &T, out: &'a mut [u8]) -> Option<&'a [u8]> {
    let stuffed = postcard::serialize_with_flavor(message, Checked::into(out)).ok()?;
    *out.get_mut(stuffed)? = 0;
    out.get(..=stuffed)
}

/// The message in a frame that was `received`, with or without its closing zero. Works in place:
/// afterwards the bytes are not the frame any more.
///
/// # Errors
/// The error of the frame.
///
/// ```
/// use omni_link::{FrameError, decode, encode};
/// let mut buffer = [0; 16];
/// encode(&true, &mut buffer);
/// assert_eq!(decode(&mut buffer), Ok(true));
/// assert_eq!(decode::<bool>(&mut []), Err(FrameError::Truncated));
/// ```
pub fn decode<T: DeserializeOwned>(received: &mut [u8]) -> Result<T, FrameError> {
    let length = unstuff(received)?;
    let (body, check) = received
        .get(..length)
        .and_then(<[u8]>::split_last_chunk)
        .ok_or(FrameError::Truncated)?;
    let found = body
        .iter()
        .fold(CHECK_OF_NOTHING, |check, &byte| check_with(check, byte));
    match postcard::take_from_bytes(body) {
        Err(postcard::Error::DeserializeUnexpectedEnd) => Err(FrameError::Truncated),
        Ok((message, [])) if found == u32::from_le_bytes(*check) => Ok(message),
        _ => Err(FrameError::Corrupted),
    }
}

/// Undoes the stuffing in place; returns how many bytes are left.
fn unstuff(received: &mut [u8]) -> Result<usize, FrameError> {
    let (mut state, mut written) = (DecoderState::Idle, 0);
    let mut read = 0;
    loop {
        // The end of what was received closes the frame as a zero does.
        let byte = received.get(read).copied().unwrap_or(0);
        read += 1;
        match state.feed(byte) {
            Ok(DecodeResult::NoData) if byte != 0 => {}
            Ok(DecodeResult::DataContinue(plain)) => {
                // Always behind what is read: stuffing only adds.
                if let Some(place) = received.get_mut(written) {
                    *place = plain;
                }
                written += 1;
            }
            Ok(DecodeResult::DataComplete) => return Ok(written),
            _ => return Err(FrameError::Truncated),
        }
    }
}

/// Stuffs what postcard writes and takes it into the check, byte by byte: one buffer is enough.
struct Checked<'a> {
    encoder: CobsEncoder<'a>,
    check: u32,
}

impl<'a> Checked<'a> {
    fn into(out: &'a mut [u8]) -> Self {
        Self {
            encoder: CobsEncoder::new(out),
            check: CHECK_OF_NOTHING,
        }
    }

    #[inline(never)]
    fn stuff(&mut self, byte: u8) -> postcard::Result<()> {
        let full = |_| postcard::Error::SerializeBufferFull;
        self.encoder.push(&[byte]).map_err(full)
    }
}

impl Flavor for Checked<'_> {
    /// Bytes written.
    type Output = usize;

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.check = check_with(self.check, byte);
        self.stuff(byte)
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        for &byte in bytes {
            self.try_push(byte)?;
        }
        Ok(())
    }

    fn finalize(mut self) -> postcard::Result<usize> {
        for byte in self.check.to_le_bytes() {
            self.stuff(byte)?;
        }
        Ok(self.encoder.finalize())
    }
}

/// Collects bytes into frames, of at most `SIZE` bytes with their closing zero; longer ones come
/// out as nothing, which is [`FrameError::Truncated`].
///
/// ```
/// use omni_link::{FrameError, Receiver, decode, encode};
/// let mut buffer = [0; 16];
/// let frame = encode(&true, &mut buffer).unwrap_or_default();
/// let mut receiver = Receiver::<16>::new();
/// let mut received = Vec::new();
/// for &byte in [&[0], frame, &[17; 40], &[0], frame].concat().iter() {
///     received.extend(receiver.push(byte).map(decode::<bool>)); // a zero before any byte is no frame
/// }
/// assert_eq!(received, [Ok(true), Err(FrameError::Truncated), Ok(true)]);
/// ```
#[derive(Clone, Debug)]
pub struct Receiver<const SIZE: usize> {
    bytes: [u8; SIZE],
    length: usize,
}

impl<const SIZE: usize> Receiver<SIZE> {
    /// Nothing received yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [0; SIZE],
            length: 0,
        }
    }

    /// Takes one byte in; the frame without its zero where this was a closing one.
    pub fn push(&mut self, byte: u8) -> Option<&mut [u8]> {
        if byte != 0 {
            if let Some(place) = self.bytes.get_mut(self.length) {
                *place = byte;
            }
            // The last place is the closing zero's: a frame that needs it has lost bytes.
            self.length = SIZE.min(self.length + 1);
            return None;
        }
        let length = core::mem::take(&mut self.length);
        match length {
            0 => None,
            whole if whole < SIZE => self.bytes.get_mut(..whole),
            _ => Some(&mut []),
        }
    }
}

impl<const SIZE: usize> Default for Receiver<SIZE> {
    fn default() -> Self {
        Self::new()
    }
}
