//! A place in the file system: a temporary file beside the one that is meant, or a device.

use super::For;
use std::{
    fs::{self, File, Permissions},
    io::{self, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};
use tempfile::NamedTempFile;

pub(super) enum Place {
    Temporary(NamedTempFile),
    Direct(File),
}

impl Place {
    pub(super) fn open(path: &Path, for_whom: For) -> io::Result<Self> {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        match fs::metadata(&target) {
            Ok(meta) if meta.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
            Ok(meta) if !meta.is_file() => return File::options().write(true).open(&target).map(Self::Direct),
            Ok(meta) if meta.permissions().readonly() => return Err(io::ErrorKind::PermissionDenied.into()),
            _ => {}
        }
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        // The umask narrows it, as for any new file.
        builder.permissions(Permissions::from_mode(if for_whom == For::User { 0o666 } else { 0o600 }));
        // Its error would name a file that nobody asked for.
        let made = builder.prefix(".truerate-").tempfile_in(folder).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => io::Error::new(io::ErrorKind::NotFound, "no such folder"),
            kind => kind.into(),
        });
        made.map(Self::Temporary)
    }

    /// Puts the file at its path; a user's, on the disk.
    pub(super) fn finish(self, path: &Path, for_whom: For) -> io::Result<()> {
        match self {
            Self::Temporary(file) => {
                if for_whom == For::User {
                    file.as_file().sync_all()?;
                }
                // Behind a symbolic link the file itself is replaced, not the link.
                let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
                file.persist(target)?;
                Ok(())
            }
            Self::Direct(mut file) => file.flush(),
        }
    }
}

impl Write for Place {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Temporary(file) => file.as_file_mut().write(bytes),
            Self::Direct(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Temporary(file) => file.as_file_mut().flush(),
            Self::Direct(file) => file.flush(),
        }
    }
}
