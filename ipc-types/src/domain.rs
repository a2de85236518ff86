//! Where a pipeline lives: one private iceoryx2 domain for each instance, by root path **and** prefix, so that several
//! run side by side on a machine and tests never meet.

use iceoryx2::prelude::{Config, FileName, NodeBuilder, Path as IoxPath, SemanticString, SignalHandlingMode, ipc};
use std::{
    fs::{self, OpenOptions},
    hash::{BuildHasher, Hasher, RandomState},
    io::{self, Read, Write},
    os::unix::fs::{MetadataExt, OpenOptionsExt},
    path::{Path, PathBuf},
};

/// The longest name of an instance: socket paths below the root have room for 108 bytes in all.
pub const LONGEST_NAME: usize = 24;

/// The longest path of an instance's folder: a socket's adds `/i/truerate_HHHHHH_GGGGGG_` and an id of 31 digits with `.event`
/// to it, and has room for 107 bytes.
const LONGEST_PATH: usize = 44;
/// The file that names the generation.
const GENERATION: &str = "generation";
/// Where shared memory lies.
const MEMORY: &str = "/dev/shm";

/// One instance's place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Domain {
    name: String,
    folder: PathBuf,
    prefix: String,
}

/// Why a place cannot serve.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DomainError {
    /// Not a name.
    #[error("invalid instance name '{0}': use 1 to {LONGEST_NAME} letters, digits, '-' or '_'")]
    Name(String),
    /// Nobody has made it.
    #[error("pipeline '{0}' is not there (yet): start it with `truerate run`")]
    NotThere(String),
    /// Too deep a folder.
    #[error("{0}: this path is too long for the sockets below it; set TRUERATE_RUNTIME_DIR to a shorter one")]
    Path(PathBuf),
    /// It cannot be made anew.
    #[error("pipeline '{name}' finds no place in {folder} or {MEMORY}: {cause}")]
    Making {
        /// Whose.
        name: String,
        /// Its folder.
        folder: PathBuf,
        /// Why not.
        cause: String,
    },
}

impl Domain {
    /// The instance `name` below the folder `base`.
    ///
    /// # Errors
    /// A name that is no file name, a base whose path is too long.
    pub fn new(base: &Path, name: &str) -> Result<Self, DomainError> {
        let good = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.len() > LONGEST_NAME || !name.chars().all(good) {
            return Err(DomainError::Name(name.to_owned()));
        }
        let folder = base.join(name);
        let path = folder.to_str().ok_or_else(|| DomainError::Path(folder.clone()))?;
        if path.len() > LONGEST_PATH {
            return Err(DomainError::Path(folder));
        }
        let prefix = format!("truerate_{:06x}_", crate::schema(path) >> 40);
        Ok(Self { name: name.to_owned(), folder, prefix })
    }

    /// The instance's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Everything of this instance that is a file lies here.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Every shared-memory segment of this instance has a name that begins so.
    #[must_use]
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// iceoryx2's own files.
    #[must_use]
    pub fn root(&self) -> PathBuf {
        self.folder.join("i")
    }

    /// Which making of the domain this is. Each has names of its own for files and shared memory, so that whoever still joins one
    /// that is being removed leaves nothing in the next. `None` before the first.
    #[must_use]
    pub fn generation(&self) -> Option<String> {
        let text = fs::read_to_string(self.folder.join(GENERATION)).ok()?;
        let good = text.len() == 6 && text.bytes().all(|b| b.is_ascii_hexdigit());
        good.then_some(text)
    }

    /// Begins another generation, whose name nobody can foresee: from now on that is where everybody joins. Its shared memory
    /// is this user's alone.
    ///
    /// # Errors
    /// Where the folder or shared memory cannot be written.
    pub fn begin_generation(&self) -> Result<(), DomainError> {
        let cause = |cause: String| DomainError::Making { name: self.name.clone(), folder: self.folder.clone(), cause };
        let generation = format!("{:06x}", RandomState::new().build_hasher().finish() >> 40);
        // The first node of a domain makes one file that everybody may write (iceoryx2 0.10). Nobody else knows its name yet.
        let config = self.config_of(&generation)?;
        let founder = NodeBuilder::new().config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
        drop(founder.create::<ipc::Service>().map_err(|e| cause(format!("{e:?}")))?);
        let done = || -> io::Result<()> {
            make_private(&format!("{}{generation}_", self.prefix))?;
            let part = self.folder.join("generation.part");
            fs::write(&part, &generation)?;
            fs::rename(part, self.folder.join(GENERATION))
        };
        done().map_err(|e| cause(e.to_string()))
    }

    /// iceoryx2's configuration for this domain as it is now; of files, only the generation's is read.
    ///
    /// # Errors
    /// A domain that nobody has made yet, a path that iceoryx2 refuses.
    pub fn config(&self) -> Result<Config, DomainError> {
        // Whoever joined before it is made would leave something in its place.
        self.config_of(&self.generation().ok_or_else(|| DomainError::NotThere(self.name.clone()))?)
    }

    fn config_of(&self, generation: &str) -> Result<Config, DomainError> {
        let wrong = || DomainError::Path(self.folder.clone());
        let mut config = Config::default();
        let root = self.root();
        let root = IoxPath::new(root.to_str().ok_or_else(wrong)?.as_bytes()).map_err(|_| wrong())?;
        config.global.set_root_path(&root);
        config.global.prefix =
            FileName::new(format!("{}{generation}_", self.prefix).as_bytes()).map_err(|_| wrong())?;
        Ok(config)
    }
}

/// Puts a copy that is this user's alone in the place of each file of shared memory that others may open: whoever has opened it
/// already keeps the old one.
fn make_private(prefix: &str) -> io::Result<()> {
    for entry in fs::read_dir(MEMORY)?.flatten() {
        if entry.file_name().to_string_lossy().starts_with(prefix) && entry.metadata()?.mode() & 0o077 != 0 {
            let mut bytes = Vec::new();
            fs::File::open(entry.path())?.read_to_end(&mut bytes)?;
            let part = Path::new(MEMORY).join(format!("{prefix}part"));
            OpenOptions::new().write(true).create_new(true).mode(0o600).open(&part)?.write_all(&bytes)?;
            fs::rename(part, entry.path())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::Domain;
    use std::path::Path;

    #[test]
    fn two_names_or_two_bases_make_two_prefixes() {
        let of = |base: &str, name| Domain::new(Path::new(base), name).unwrap().prefix().to_owned();
        assert_ne!(of("/tmp/a", "x"), of("/tmp/a", "y"));
        assert_ne!(of("/tmp/a", "x"), of("/tmp/b", "x"));
    }

    #[test]
    fn a_name_with_a_slash_is_refused() {
        for name in ["", "..", "a/b", "ä", &"x".repeat(25)] {
            assert!(Domain::new(Path::new("/tmp"), name).is_err(), "{name}");
        }
    }
}
