//! A file as lines.

use crate::{
    batch::{self, Batch},
    cell,
    columns::{self, Column, LONGEST_LIST},
    guard::guarded,
    pages,
};
use bytes::Bytes;
use parquet::{
    basic::Compression,
    column::reader::ColumnReader,
    errors::{ParquetError, Result},
    file::metadata::{ColumnChunkMetaData, ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData},
};
use std::{
    io::{self, Read},
    sync::Arc,
};

/// Rows that are read at once.
const ROWS: usize = 4096;
/// Rows of lists that are counted at once.
const LISTS: usize = 64;
/// Fields of a row at most.
const MOST_FIELDS: usize = 4000;

/// Why nothing of a file can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// The list of columns stands at a file's end.
    #[error("its end, which lists its columns, is cut off or damaged: copy it again, or write it as CSV")]
    NoFooter,
    /// The list of columns is encrypted.
    #[error("it is encrypted: write it without encryption")]
    Encrypted,
    /// How its pages are packed is not known here.
    #[error("it is packed with Brotli or LZO: write it with zstd, Snappy, gzip or LZ4")]
    Packing,
    /// Nothing in it can be written as text.
    #[error("it has no columns of numbers")]
    NoColumns,
}

/// A file as the lines of a CSV, its header first.
pub struct Rows {
    file: Arc<Bytes>,
    metadata: ParquetMetaData,
    /// The columns, each with its fields in a row.
    columns: Vec<(Column, usize)>,
    left_out: Vec<String>,
    /// The next group of rows.
    group: usize,
    /// Of the group that is being read.
    readers: Vec<ColumnReader>,
    left: usize,
    /// Nothing more is read of it.
    is_damaged: bool,
    /// Lines that are not taken yet.
    lines: Vec<u8>,
    from: usize,
}

impl Rows {
    /// Of the whole file.
    ///
    /// # Errors
    /// Nothing of it can be read.
    pub fn of(bytes: Vec<u8>) -> std::result::Result<Self, Unusable> {
        if bytes.starts_with(&crate::ENCRYPTED) {
            return Err(Unusable::Encrypted);
        }
        let file = Arc::new(Bytes::from(bytes));
        let metadata =
            guarded(|| ParquetMetaDataReader::new().parse_and_finish(&*file)).map_err(|_| Unusable::NoFooter)?;
        let chunks = metadata.row_groups().iter().flat_map(RowGroupMetaData::columns);
        if chunks
            .map(ColumnChunkMetaData::compression)
            .any(|packing| matches!(packing, Compression::BROTLI(_) | Compression::LZO))
        {
            return Err(Unusable::Packing);
        }
        let schema = metadata.file_metadata().schema_descr_ptr();
        let (columns, left_out) = columns::of(schema.root_schema(), schema.columns());
        let mut rows = Self {
            file,
            metadata,
            columns: Vec::new(),
            left_out,
            group: 0,
            readers: Vec::new(),
            left: 0,
            is_damaged: false,
            lines: Vec::new(),
            from: 0,
        };
        let mut fields = 0;
        for column in columns {
            // What is damaged is found where its rows are.
            let width = if column.within.is_some() { guarded(|| rows.longest(&column)).unwrap_or(0) } else { 1 };
            if width == 0 || width > LONGEST_LIST || fields + width > MOST_FIELDS {
                rows.left_out.push(column.name.clone());
                continue;
            }
            fields += width;
            rows.columns.push((column, width));
        }
        if rows.columns.is_empty() {
            return Err(Unusable::NoColumns);
        }
        let names: Vec<String> = rows.columns.iter().flat_map(|(column, width)| column.names(*width)).collect();
        for (k, name) in names.iter().enumerate() {
            if k > 0 {
                rows.lines.push(b',');
            }
            cell::text(name, &mut rows.lines);
        }
        rows.lines.push(b'\n');
        Ok(rows)
    }

    /// The names of columns that are not among the lines: pictures, maps, lists of lists.
    #[must_use]
    pub fn left_out(&self) -> &[String] {
        &self.left_out
    }

    /// The items of the longest list of a column.
    fn longest(&self, column: &Column) -> Result<usize> {
        let mut longest = 0;
        for group in 0..self.metadata.num_row_groups() {
            let mut reader = pages::column(&self.file, &self.metadata, group, column.leaf)?;
            loop {
                let (of_these, rows) = batch::longest(&mut reader, column, LISTS)?;
                longest = longest.max(of_these);
                if rows == 0 || longest > LONGEST_LIST {
                    break;
                }
            }
        }
        Ok(longest)
    }

    /// Reads the next rows; `false` at the end.
    fn more(&mut self) -> Result<bool> {
        while self.left == 0 {
            if self.group == self.metadata.num_row_groups() {
                return Ok(false);
            }
            self.left = usize::try_from(self.metadata.row_group(self.group).num_rows()).unwrap_or_default();
            let readers = self
                .columns
                .iter()
                .map(|(column, _)| pages::column(&self.file, &self.metadata, self.group, column.leaf));
            self.readers = readers.collect::<Result<_>>()?;
            self.group += 1;
        }
        let rows = self.left.min(ROWS);
        let mut batches = Vec::with_capacity(self.columns.len());
        for (reader, (column, width)) in self.readers.iter_mut().zip(&self.columns) {
            let mut batch = Batch::read(reader, column, *width, rows)?;
            batch.fill(*width);
            if batch.rows(*width) != rows {
                return Err(ParquetError::EOF(format!("column {} is shorter than the others", column.name)));
            }
            batches.push((batch, *width));
        }
        self.left -= rows;
        self.lines.clear();
        self.from = 0;
        for row in 0..rows {
            for (k, (batch, width)) in batches.iter().enumerate() {
                for field in 0..*width {
                    if k + field > 0 {
                        self.lines.push(b',');
                    }
                    self.lines.extend_from_slice(batch.field(row * width + field));
                }
            }
            self.lines.push(b'\n');
        }
        Ok(true)
    }
}

impl Read for Rows {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.from == self.lines.len() {
            let more = if self.is_damaged { Ok(false) } else { guarded(|| self.more()) };
            self.is_damaged |= more.is_err();
            if !more.map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))? {
                return Ok(0);
            }
        }
        let count = buffer.len().min(self.lines.len() - self.from);
        buffer[..count].copy_from_slice(&self.lines[self.from..self.from + count]);
        self.from += count;
        Ok(count)
    }
}
