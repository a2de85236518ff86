//! A place in memory, under a name that the page takes it by.

use super::For;
use crate::files;
use std::{
    io::{self, Write},
    path::Path,
};

pub(super) struct Place(Vec<u8>);

#[expect(clippy::unnecessary_wraps, reason = "the file system's place may fail")]
impl Place {
    pub(super) fn open(_: &Path, _: For) -> io::Result<Self> {
        Ok(Self(Vec::new()))
    }

    pub(super) fn finish(self, path: &Path, _: For) -> io::Result<()> {
        files::put(path, self.0);
        Ok(())
    }
}

impl Write for Place {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
