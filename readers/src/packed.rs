//! Bytes that were packed with zstd, as ROS 2 packs whole files, chunks and messages.

use std::io::{self, Read};

/// What packed bytes begin with.
pub const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Unpacks what a source gives.
///
/// # Errors
/// It is not zstd.
pub fn zstd<R: Read>(source: R) -> io::Result<impl Read> {
    ruzstd::decoding::StreamingDecoder::new(source).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}
