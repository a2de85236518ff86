//! Files that are written whole or not at all: those that a user asked for, and those that a run keeps for itself; and standard output.

use anyhow::{Context, Result};
use std::{
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

#[cfg(target_family = "wasm")]
mod memory;
#[cfg(not(target_family = "wasm"))]
mod system;

#[cfg(target_family = "wasm")]
use memory::Place;
#[cfg(not(target_family = "wasm"))]
use system::Place;

/// A file under way: nobody sees it, and what stood there before stays, until [`Output::finish`].
///
/// Devices and pipes (`/dev/stdout`, `/dev/full`) are written directly, and `-` is standard output.
pub struct Output {
    path: PathBuf,
    for_whom: For,
    to: BufWriter<To>,
}

/// Whom a file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum For {
    /// The user: as any new file of theirs, and on the disk before it counts.
    User,
    /// The processes of a run: nobody else may read it. It goes with the run, so nobody waits for the disk; no process can
    /// lose it by dying (a machine can).
    Run,
}

enum To {
    Place(Place),
    Stdout(io::Stdout),
}

impl Output {
    /// Begins to write this file.
    ///
    /// # Errors
    /// Its folder is missing or read-only, or it is itself a folder.
    pub fn create(path: &Path) -> Result<Self> {
        Self::create_for(For::User, path)
    }

    fn create_for(for_whom: For, path: &Path) -> Result<Self> {
        let to = open(path, for_whom).with_context(|| {
            format!("{}: cannot be written: check that the folder exists and may be written to", path.display())
        })?;
        Ok(Self { path: path.to_owned(), for_whom, to: BufWriter::with_capacity(1 << 16, to) })
    }

    /// Everything is written: put it in its place; a user's, on the disk.
    ///
    /// # Errors
    /// The disk is full, or the folder has changed meanwhile.
    pub fn finish(self) -> Result<()> {
        let path = self.path;
        let done = || match self.to.into_inner().map_err(io::IntoInnerError::into_error)? {
            To::Place(place) => place.finish(&path, self.for_whom),
            To::Stdout(mut out) => out.flush(),
        };
        done().with_context(|| failed(&path))
    }
}

/// Writes a file in one go, whole or not at all.
///
/// # Errors
/// As [`Output::create`] and [`Output::finish`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_for(For::User, path, bytes)
}

/// The same for whom it is for.
///
/// # Errors
/// As [`write()`].
pub fn write_for(for_whom: For, path: &Path, bytes: &[u8]) -> Result<()> {
    let mut output = Output::create_for(for_whom, path)?;
    output.write_all(bytes).with_context(|| failed(path))?;
    output.finish()
}

/// What failed, for the chain of a write error.
#[must_use]
pub fn failed(path: &Path) -> String {
    format!("{}: cannot be written to the end: free some space, or choose another place", path.display())
}

fn open(path: &Path, for_whom: For) -> io::Result<To> {
    if path == Path::new("-") {
        return Ok(To::Stdout(io::stdout()));
    }
    Place::open(path, for_whom).map(To::Place)
}

impl Write for To {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Place(place) => place.write(bytes),
            Self::Stdout(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Place(place) => place.flush(),
            Self::Stdout(out) => out.flush(),
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Writes to standard output, whole.
///
/// # Errors
/// What standard output answers; a reader that has left ends the program quietly at the top.
pub fn print(text: &str) -> Result<()> {
    let write = || -> io::Result<()> {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes())?;
        if !text.ends_with('\n') {
            out.write_all(b"\n")?;
        }
        out.flush()
    };
    write().context("standard output cannot be written: send it to a place with room")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{fs, os::unix::fs::PermissionsExt};

    #[test]
    fn what_stood_there_stays_until_the_new_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        fs::write(&path, "old").unwrap();
        let mut output = Output::create(&path).unwrap();
        output.write_all(&vec![b'x'; 1 << 20]).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        drop(output);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "an abandoned file is left behind");
        write(&path, b"new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    }

    #[test]
    fn a_users_file_is_read_as_any_of_theirs_and_a_runs_by_itself_alone() {
        let folder = tempfile::tempdir().unwrap();
        let mode = |name: &str| fs::metadata(folder.path().join(name)).unwrap().permissions().mode() & 0o777;
        fs::write(folder.path().join("any"), "").unwrap();
        write(&folder.path().join("model.toml"), b"").unwrap();
        write_for(For::Run, &folder.path().join("token"), b"").unwrap();
        assert_eq!((mode("model.toml"), mode("token")), (mode("any"), 0o600));
    }

    #[test]
    fn a_full_disk_is_an_error_that_says_so() {
        let error = write(Path::new("/dev/full"), b"x").unwrap_err();
        assert!(format!("{error:#}").starts_with("/dev/full: cannot be written to the end"), "{error:#}");
    }

    #[test]
    fn a_symbolic_link_keeps_pointing_at_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write(&link, b"new").unwrap();
        assert_eq!(fs::read_to_string(&real).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
