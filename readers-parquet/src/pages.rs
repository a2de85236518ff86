//! The pages of a column. Those packed with zstd are unpacked here: `parquet` does that in C, which a browser does not run.

use bytes::Bytes;
use parquet::{
    basic::Compression,
    column::{
        page::{Page, PageMetadata, PageReader},
        reader::{ColumnReader, get_column_reader},
    },
    errors::{ParquetError, Result},
    file::{
        metadata::{ColumnChunkMetaData, ParquetMetaData},
        serialized_reader::SerializedPageReader,
    },
};
use ruzstd::decoding::StreamingDecoder;
use std::{io::Read as _, sync::Arc};

/// A page says its length in an `i32`.
const LARGEST: u64 = i32::MAX as u64;

/// A column of a group of rows.
///
/// # Errors
/// The file is damaged, or is packed in a way that is not read.
pub fn column(file: &Arc<Bytes>, of: &ParquetMetaData, group: usize, leaf: usize) -> Result<ColumnReader> {
    let group = of.row_group(group);
    let rows = usize::try_from(group.num_rows())?;
    let chunk = group.column(leaf);
    let pages = |chunk: &ColumnChunkMetaData| SerializedPageReader::new(Arc::clone(file), chunk, rows, None);
    let pages: Box<dyn PageReader> = if matches!(chunk.compression(), Compression::ZSTD(_)) {
        let as_they_are = chunk.clone().into_builder().set_compression(Compression::UNCOMPRESSED).build()?;
        Box::new(Zstd(pages(&as_they_are)?))
    } else {
        Box::new(pages(chunk)?)
    };
    Ok(get_column_reader(chunk.column_descr_ptr(), pages))
}

/// Unpacks pages of a column that is read as if it were not packed.
struct Zstd(SerializedPageReader<Bytes>);

impl PageReader for Zstd {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        let mut page = self.0.get_next_page()?;
        match &mut page {
            // Its levels stand before what is packed.
            Some(Page::DataPageV2 { buf, def_levels_byte_len, rep_levels_byte_len, is_compressed: true, .. }) => {
                let levels = u64::from(*def_levels_byte_len) + u64::from(*rep_levels_byte_len);
                *buf = unpacked(buf, usize::try_from(levels)?)?;
            }
            Some(Page::DataPage { buf, .. } | Page::DictionaryPage { buf, .. }) => *buf = unpacked(buf, 0)?,
            Some(Page::DataPageV2 { .. }) | None => (),
        }
        Ok(page)
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.0.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.0.skip_next_page()
    }
}

impl Iterator for Zstd {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

/// The first bytes as they are, the rest unpacked.
fn unpacked(page: &Bytes, plain: usize) -> Result<Bytes> {
    let (plain, mut packed) =
        page.split_at_checked(plain).ok_or_else(|| ParquetError::EOF("a page is cut off".to_owned()))?;
    let mut bytes = plain.to_vec();
    while !packed.is_empty() {
        let frame = StreamingDecoder::new(&mut packed).map_err(|error| ParquetError::External(Box::new(error)))?;
        frame.take(LARGEST).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > LARGEST {
            return Err(ParquetError::General("a page is larger than any page is".to_owned()));
        }
    }
    Ok(bytes.into())
}
