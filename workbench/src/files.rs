//! Where files are: the file system; in WebAssembly, which has none, the names and bytes that its page gave.

pub mod archive;
#[cfg(any(target_family = "wasm", clippy))]
#[cfg_attr(not(target_family = "wasm"), allow(dead_code))] // the page is checked where it is not built
mod memory;
#[cfg(not(target_family = "wasm"))]
mod system;

#[cfg(target_family = "wasm")]
use memory as place;
#[cfg(any(target_family = "wasm", clippy))]
pub use memory::{put, take};
#[cfg(not(target_family = "wasm"))]
use system as place;

use std::{
    io::{self, Cursor, Read},
    path::Path,
};

/// Opens a file to read it, also one inside an [`archive`].
///
/// # Errors
/// It is not there, or may not be read.
pub fn open(path: &Path) -> io::Result<Box<dyn Read + Send>> {
    place::open(path).or_else(|error| Ok(Box::new(Cursor::new(within(path, error)?)) as Box<dyn Read + Send>))
}

/// Its size, bytes.
///
/// # Errors
/// It is not there.
pub fn size(path: &Path) -> io::Result<u64> {
    place::size(path).or_else(|error| within(path, error).map(|bytes| bytes.len() as u64))
}

/// A file inside an archive, or why this path cannot be opened.
fn within(path: &Path, error: io::Error) -> io::Result<Vec<u8>> {
    archive::within(path, place::open).unwrap_or(Err(error))
}

/// Its text.
///
/// # Errors
/// It is not there, may not be read, or is no UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    io::read_to_string(open(path)?)
}
