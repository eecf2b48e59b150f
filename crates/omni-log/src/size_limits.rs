//! Limits of the memory that a log may request, in proportion to its size.

use mcap::records::op;

/// Largest unpacked size of a log, as a multiple of its bytes. Our own unpack to 3 times theirs; the emptiest, of a
/// vehicle that floats without gravity and command, to 23 times, and its emptiest chunk to 53.
const MOST_RATIO: u64 = 60;
/// What the smallest of logs may unpack to \[bytes\]: some thousand control periods.
const LEAST_UNPACKED: u64 = 1 << 24;
/// Kind and length of a record, before what it holds.
pub(crate) const HEAD_BYTES: u64 = 9;
/// Records larger than any that we write are damage.
const LARGEST_RECORD: u64 = 1 << 28;

/// Most bytes of messages in so many bytes of file.
pub(crate) fn most_unpacked(file_bytes: u64) -> u64 {
    file_bytes.saturating_mul(MOST_RATIO).max(LEAST_UNPACKED)
}

/// The largest record, or chunk of records, of a file of so many bytes.
pub(crate) fn largest_record(file_bytes: u64) -> usize {
    most_unpacked(file_bytes).min(LARGEST_RECORD) as usize
}

/// A piece of a record.
#[derive(Clone, Copy)]
enum Piece {
    /// This many bytes.
    Plain(usize),
    /// A length of 4 bytes, and as many bytes.
    Block,
    /// A length of 4 bytes, and as many bytes of blocks.
    Blocks,
}

/// The beginning of each kind of record up to its last length, by the specification; of those without a length nothing.
fn pieces(opcode: u8) -> &'static [Piece] {
    use Piece::{Block, Blocks, Plain};
    match opcode {
        op::HEADER => &[Block, Block],
        op::SCHEMA => &[Plain(2), Block, Block, Block],
        op::CHANNEL => &[Plain(4), Block, Block, Blocks],
        // Not unpacked by the reader: a chunk within a chunk, which no writer makes. Then the length of its records.
        op::CHUNK => &[Plain(28), Block, Plain(8)],
        // Then the length of its data and, behind the data, a checksum.
        op::ATTACHMENT => &[Plain(16), Block, Block, Plain(12)],
        op::CHUNK_INDEX => &[Plain(32), Block, Plain(8), Block],
        op::ATTACHMENT_INDEX => &[Plain(40), Block, Block],
        op::METADATA => &[Block, Blocks],
        op::METADATA_INDEX => &[Plain(16), Block],
        _ => &[],
    }
}

/// Are the lengths inside a record within the record? To be asked before it is parsed: the parser
/// takes the memory of a text before it looks whether there is as much.
pub(crate) fn fits(opcode: u8, record: &[u8]) -> Result<(), String> {
    let mut rest = record;
    let inside = pieces(opcode).iter().try_for_each(|piece| match piece {
        Piece::Plain(length) => taken(&mut rest, *length).map(drop),
        Piece::Block => block(&mut rest).map(drop),
        Piece::Blocks => {
            let mut blocks = block(&mut rest)?;
            while !blocks.is_empty() {
                block(&mut blocks)?;
            }
            Some(())
        }
    });
    inside.ok_or_else(|| {
        let length = record.len();
        format!("a record of kind {opcode:#04x} and {length} bytes that claims to hold more")
    })
}

fn taken<'a>(rest: &mut &'a [u8], length: usize) -> Option<&'a [u8]> {
    let (piece, behind) = rest.split_at_checked(length)?;
    *rest = behind;
    Some(piece)
}

fn block<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let length = taken(rest, 4)?.try_into().map(u32::from_le_bytes).ok()?;
    taken(rest, length as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
    }

    /// A record of each kind with texts in it, and where its lengths are.
    fn records() -> Vec<(u8, Vec<u8>, Vec<usize>)> {
        let map = text(std::str::from_utf8(&[text("key"), text("value")].concat()).expect("ASCII"));
        let plain = |n: usize| vec![0_u8; n];
        vec![
            (op::HEADER, [text("ros2"), text("x")].concat(), vec![0, 8]),
            (
                op::SCHEMA,
                [plain(2), text("ab"), text("c"), text("d")].concat(),
                vec![2, 8, 13],
            ),
            (
                op::CHANNEL,
                [plain(4), text("/tf"), text("cdr"), map.clone()].concat(),
                vec![4, 11, 18, 22, 29],
            ),
            (op::CHUNK, [plain(28), text("zstd"), plain(8)].concat(), vec![28]),
            (
                op::ATTACHMENT,
                [plain(16), text("a"), text("b"), plain(12)].concat(),
                vec![16, 21],
            ),
            (
                op::CHUNK_INDEX,
                [plain(32), text(""), plain(8), text("zstd"), plain(16)].concat(),
                vec![32, 44],
            ),
            (
                op::ATTACHMENT_INDEX,
                [plain(40), text("a"), text("b")].concat(),
                vec![40, 45],
            ),
            (op::METADATA, [text("run"), map].concat(), vec![0, 7, 11, 18]),
            (op::METADATA_INDEX, [plain(16), text("run")].concat(), vec![16]),
        ]
    }

    #[test]
    fn a_length_beyond_its_record_is_refused_in_every_kind_and_all_others_are_parsed() {
        for (opcode, record, lengths) in records() {
            assert_eq!(fits(opcode, &record), Ok(()), "{opcode:#04x}");
            mcap::parse_record(opcode, &record).expect("as the specification has it");
            for at in lengths {
                for far in [u32::MAX, 1 << 31, record.len() as u32] {
                    let mut lying = record.clone();
                    lying[at..at + 4].copy_from_slice(&far.to_le_bytes());
                    let said = fits(opcode, &lying).expect_err("refused");
                    assert!(
                        said.ends_with("bytes that claims to hold more"),
                        "{opcode:#04x} at {at}: {said}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_record_that_ends_early_is_refused_before_or_by_the_parser_and_never_panics() {
        for (opcode, record, _) in records() {
            for end in 0..record.len() {
                // The parser alone panics where an attachment ends before its checksum.
                let refused = fits(opcode, &record[..end]).is_err()
                    || mcap::parse_record(opcode, &record[..end]).is_err();
                assert!(refused, "{opcode:#04x}: {end}");
            }
        }
    }
}
