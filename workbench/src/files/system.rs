//! The file system.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

pub(super) fn open(path: &Path) -> io::Result<Box<dyn Read + Send>> {
    Ok(Box::new(File::open(path)?))
}

pub(super) fn size(path: &Path) -> io::Result<u64> {
    Ok(fs::metadata(path)?.len())
}
