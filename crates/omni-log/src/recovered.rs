//! The intact part of a truncated MCAP file, as a complete file.

use std::io::{BufWriter, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, WriteOptions};
use omni_config::open_regular;

use crate::{Error, LogError, PartFile, size_limits};

/// Bytes that are read at a time.
const BLOCK: usize = 1 << 18;

/// Writes the schemas, channels and messages of a truncated file of any program as a complete file.
///
/// Says how long it is, first message to last \[s\]. A chunk that is not whole is left out, and so
/// are zeros at the end.
///
/// # Errors
/// [`LogError::Read`], [`LogError::Damaged`] if something else is wrong with it, [`LogError::Mcap`] if it cannot be
/// written.
pub fn recover(cut_off: impl AsRef<Path>, whole: impl AsRef<Path>) -> Result<f64, Error> {
    let (path, out) = (cut_off.as_ref().to_path_buf(), whole.as_ref().to_path_buf());
    let unreadable = |source| LogError::unreadable(&path, source);
    let damaged = |reason| LogError::damaged(&path, reason);
    let unwritable = |source| LogError::Mcap {
        path: out.clone(),
        source,
    };
    let mut file = open_regular(&path).map_err(unreadable)?;
    let length = length_without_zeros(&mut file).map_err(unreadable)?;
    let mut file = file.take(length);
    // Under its name only once it is whole.
    let part = PartFile::create(&out)?;
    let mut created = Some(BufWriter::new(part.writer()?));
    let mut writer = None;
    let options = LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(size_limits::largest_record(length));
    let mut reader = LinearReader::new_with_options(options);
    let (mut unpacked, mut times_ns) = (0, None);
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let got = file.read(reader.insert(wanted.min(length as usize).max(BLOCK)));
                reader.notify_read(got.map_err(unreadable)?);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                unpacked += size_limits::HEAD_BYTES + data.len() as u64;
                if unpacked > size_limits::most_unpacked(length) {
                    let reason = format!("{length} bytes that unpack to more than {unpacked}");
                    return Err(damaged(reason).into());
                }
                size_limits::fits(opcode, data).map_err(damaged)?;
                let record = mcap::parse_record(opcode, data).map_err(|error| damaged(error.to_string()))?;
                if let (Record::Header(header), Some(file)) = (&record, created.take_if(|_| writer.is_none()))
                {
                    // It is read once and thrown away.
                    let options = WriteOptions::new()
                        .compression(None)
                        .profile(header.profile.clone());
                    writer = Some(options.create(file).map_err(unwritable)?);
                }
                let Some(writer) = &mut writer else {
                    return Err(damaged("no header".into()).into());
                };
                match record {
                    Record::Schema { header, data } => writer
                        .add_schema_with_id(header.id, &header.name, &header.encoding, &data)
                        .map(drop),
                    Record::Channel(it) => writer
                        .add_channel_with_id(
                            it.id,
                            it.schema_id,
                            &it.topic,
                            &it.message_encoding,
                            &it.metadata,
                        )
                        .map(drop),
                    Record::Message { header, data } => {
                        let now = header.log_time;
                        let (first, last) = times_ns.unwrap_or((now, now));
                        times_ns = Some((now.min(first), now.max(last)));
                        writer.write_to_known_channel(&header, &data)
                    }
                    _ => Ok(()),
                }
                .map_err(|error| match error {
                    McapError::Io(_) => unwritable(error),
                    // A message of an unknown channel, two channels of one number, and so on.
                    error => damaged(error.to_string()),
                })?;
            }
            Err(McapError::UnexpectedEof) => break,
            Err(error) => return Err(damaged(error.to_string()).into()),
        }
    }
    let mut writer = writer.ok_or_else(|| damaged("no header".into()))?;
    writer.finish().map_err(unwritable)?;
    let file = writer.into_inner().into_inner().map_err(|error| LogError::Io {
        path: out.clone(),
        source: error.into_error(),
    })?;
    part.complete(file)?;
    Ok(times_ns.map_or(0.0, |(first, last)| (last - first) as f64 * 1e-9))
}

/// Start of the zeros at the end, for example after a power cut before an extended file was written. The record that
/// contains them, or that ends with zeros of its own, is incomplete.
fn length_without_zeros(file: &mut (impl Read + Seek)) -> std::io::Result<u64> {
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut block = vec![0; BLOCK];
    let mut data = 0;
    while end > 0 && data == 0 {
        let begin = end.saturating_sub(BLOCK as u64);
        let block = &mut block[..(end - begin) as usize];
        file.seek(SeekFrom::Start(begin))?;
        file.read_exact(block)?;
        let last = block.iter().rposition(|byte| *byte != 0);
        (data, end) = (last.map_or(0, |last| begin + last as u64 + 1), begin);
    }
    file.rewind()?;
    Ok(data)
}
