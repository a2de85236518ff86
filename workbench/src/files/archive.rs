//! Zip archives, as phones and mail programs make them. A file inside is named like one of a folder: `export.zip/Gyroscope.csv`.

use std::{
    io::{self, Cursor, Read},
    path::Path,
};
use zip::{ZipArchive, result::ZipError};

/// How each of them begins.
pub const MAGIC: &[u8] = b"PK\x03\x04";

/// Bytes that an archive, and a file inside, may have: both are held in memory.
const LARGEST: u64 = 1 << 30;

/// An opened archive.
pub struct Archive(ZipArchive<Cursor<Vec<u8>>>);

impl Archive {
    /// Reads all of it.
    ///
    /// # Errors
    /// It cannot be read, is no whole archive, or too large.
    pub fn read(source: impl Read) -> io::Result<Self> {
        ZipArchive::new(Cursor::new(whole(source)?)).map(Self).map_err(error)
    }

    /// Whether it is a sheet of Excel.
    #[must_use]
    pub fn is_sheet(&self) -> bool {
        self.names().iter().any(|name| name == "xl/workbook.xml")
    }

    /// The files in it, in the order of their names, but for those that are hidden or of macOS.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let is_hidden = |name: &str| name.split('/').any(|part| part.starts_with('.') || part == "__MACOSX");
        let names = self.0.file_names().filter(|name| !name.ends_with('/') && !is_hidden(name));
        let mut names: Vec<String> = names.map(str::to_owned).collect();
        names.sort_unstable();
        names
    }

    /// The only file, or the only one that lies in no folder of others.
    #[must_use]
    pub fn only(&self) -> Option<String> {
        let names = self.names();
        let depth = |name: &String| name.matches('/').count();
        let least = names.iter().map(depth).min()?;
        let mut outermost = names.into_iter().filter(|name| depth(name) == least);
        outermost.next().filter(|_| outermost.next().is_none())
    }

    /// The bytes of a file in it.
    ///
    /// # Errors
    /// There is none of this name, it is damaged, packed in a way that is not read, under a password, or too large.
    pub fn file(&mut self, name: &str) -> io::Result<Vec<u8>> {
        whole(self.0.by_name(name).map_err(error)?)
    }
}

/// A file inside an archive; `None` where no part of the path is one.
pub(super) fn within(
    path: &Path,
    open: impl Fn(&Path) -> io::Result<Box<dyn Read + Send>>,
) -> Option<io::Result<Vec<u8>>> {
    let (outer, source) = path.ancestors().skip(1).find_map(|outer| {
        let mut source = open(outer).ok()?;
        let mut start = [0; MAGIC.len()];
        source.read_exact(&mut start).ok()?;
        (start == MAGIC).then(|| (outer, Cursor::new(start).chain(source)))
    })?;
    let name = path.strip_prefix(outer).ok()?.to_str()?;
    Some(Archive::read(source).and_then(|mut archive| archive.file(name)))
}

fn whole(source: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "larger than 1 GiB, which is held in memory"));
    }
    Ok(bytes)
}

fn error(error: ZipError) -> io::Error {
    match error {
        ZipError::Io(error) => error,
        ZipError::FileNotFound => io::Error::new(io::ErrorKind::NotFound, "the archive has no file of this name"),
        other => io::Error::new(io::ErrorKind::InvalidData, other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use zip::{ZipWriter, write::SimpleFileOptions};

    fn archive(files: &[(&str, &str)]) -> Vec<u8> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in files {
            writer.start_file(*name, SimpleFileOptions::default()).unwrap();
            writer.write_all(text.as_bytes()).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn only(names: &[&str]) -> Option<String> {
        let files: Vec<(&str, &str)> = names.iter().map(|name| (*name, "t\n")).collect();
        Archive::read(archive(&files).as_slice()).unwrap().only()
    }

    #[test]
    fn the_one_file_that_is_meant_is_found_and_of_several_none_is_guessed() {
        assert_eq!(only(&["log.csv"]).as_deref(), Some("log.csv"));
        assert_eq!(only(&["run/log.csv", "__MACOSX/run/._log.csv", "run/.DS_Store"]).as_deref(), Some("run/log.csv"));
        assert_eq!(only(&["Raw Data.csv", "meta/device.csv", "meta/time.csv"]).as_deref(), Some("Raw Data.csv"));
        assert_eq!(only(&["Gyroscope.csv", "Orientation.csv"]), None);
        assert_eq!(only(&[]), None);
    }

    #[test]
    fn a_file_inside_has_a_path_and_what_is_not_there_or_no_archive_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("export.zip");
        std::fs::write(&path, archive(&[("a/Gyroscope.csv", "t,x\n"), ("b.csv", "")])).unwrap();
        let read = |inside: &str| super::super::read_to_string(&path.join(inside));
        assert_eq!(read("a/Gyroscope.csv").unwrap(), "t,x\n");
        assert_eq!(super::super::size(&path.join("a/Gyroscope.csv")).unwrap(), 4);
        let absent = read("c.csv").unwrap_err();
        assert!(absent.kind() == io::ErrorKind::NotFound && absent.to_string().contains("no file of this name"));
        let plain = folder.path().join("plain.csv");
        std::fs::write(&plain, "t\n").unwrap();
        assert!(super::super::open(&plain.join("x.csv")).is_err_and(|error| !error.to_string().contains("archive")));
    }

    #[test]
    fn a_damaged_archive_is_an_error_wherever_it_breaks_off() {
        let bytes = archive(&[("log.csv", "t,gyro_z\n0,1\n"), ("b.csv", "x")]);
        for end in 0..bytes.len() {
            let read = Archive::read(&bytes[..end]).and_then(|mut archive| archive.file("log.csv"));
            assert!(read.is_err(), "{end}");
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0xff;
            // No panic; what is read is what was written, or an error.
            if let Ok(text) = Archive::read(changed.as_slice()).and_then(|mut archive| archive.file("log.csv")) {
                assert_eq!(text, b"t,gyro_z\n0,1\n", "{at}");
            }
        }
    }
}
