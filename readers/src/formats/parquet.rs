//! Parquet: a table by columns. It is read as the text that it means, so that its names, units and times are understood as a text's are.
//!
//! What tells where its columns are stands at its end: it is taken into memory whole.

use super::delimited;
use crate::format::{AsText, Converted, Format, Note, Sink, Unreadable};
use parquet_rows::{ENCRYPTED, MAGIC, Rows, Unusable};
use std::io::Read;

/// A larger one is not taken into memory.
const LARGEST: u64 = 4 << 30;

/// Parquet.
pub struct Parquet;

impl Format for Parquet {
    fn name(&self) -> &'static str {
        "Parquet"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        start.starts_with(&MAGIC) || start.starts_with(&ENCRYPTED)
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        delimited::read(converted(bytes)?, sink)
    }

    fn as_text(&self) -> Option<AsText> {
        Some(converted)
    }
}

fn converted(source: &mut dyn Read) -> Result<Converted, Unreadable> {
    let mut bytes = Vec::new();
    source.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        return Err(Unreadable::Unknown("it is larger than 4 GiB: write it as several files"));
    }
    let rows = Rows::of(bytes).map_err(|unusable| {
        Unreadable::Unknown(match unusable {
            Unusable::NoFooter => {
                "its end, which lists its columns, is cut off or damaged: copy it again, or write it as CSV"
            }
            Unusable::Encrypted => "it is encrypted: write it without encryption",
            Unusable::Packing => "it is packed with Brotli or LZO: write it with zstd, Snappy, gzip or LZ4",
            Unusable::NoColumns => "it has no columns of numbers",
        })
    })?;
    let names = rows.left_out().to_vec();
    let notes = if names.is_empty() { Vec::new() } else { vec![Note::LeftOut { names }] };
    Ok(Converted { text: Box::new(rows), notes })
}
