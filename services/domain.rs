//! Who may use an instance's place, and how it is left: claims, locks, the clearing of what remains.

use anyhow::{Context, anyhow, bail};
use ipc_types::domain::Domain;
use std::{
    env,
    fs::{self, DirBuilder, File, OpenOptions, Permissions, TryLockError},
    io::{ErrorKind, Read, Write},
    os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// The folder below which every instance of this user lives: `TRUERATE_RUNTIME_DIR`, or `/tmp/truerate-UID`.
#[must_use]
pub fn base() -> PathBuf {
    env::var_os("TRUERATE_RUNTIME_DIR")
        .map_or_else(|| PathBuf::from(format!("/tmp/truerate-{}", rustix::process::geteuid().as_raw())), PathBuf::from)
}

/// The place of an instance, which need not exist.
///
/// # Errors
/// A name that is none, a base folder with too long a path.
pub fn place(instance: &str) -> anyhow::Result<Domain> {
    Ok(Domain::new(&base(), instance)?)
}

/// The place of an instance that is there and ours, for those who only look.
///
/// # Errors
/// Where no such pipeline runs, or it is another user's.
pub fn existing(instance: &str) -> anyhow::Result<Domain> {
    let domain = place(instance)?;
    match fs::metadata(domain.root()) {
        Ok(_) => {}
        Err(error) if error.kind() == ErrorKind::PermissionDenied => {
            let mut upper = domain.folder().ancestors();
            let owner = upper.find_map(|folder| fs::metadata(folder).ok()).map_or(0, |meta| meta.uid());
            bail!(
                "{} belongs to another user{}: use that one, `sudo -u USER`",
                domain.folder().display(),
                if owner == 0 { String::new() } else { format!(" ({owner})") }
            );
        }
        Err(_) => {
            bail!("no pipeline '{instance}' runs here ({}): start one with `truerate run`", domain.folder().display())
        }
    }
    check_owner(domain.folder())?;
    Ok(domain)
}

/// Nobody but its owner may put another folder in the place of one that lies here.
fn check_base(base: &Path) -> anyhow::Result<()> {
    check_owner(base)?;
    let mode = fs::metadata(base).with_context(|| base.display().to_string())?.mode();
    if mode & 0o1002 == 0o002 {
        bail!(
            "{}: every user may write here: chmod o-w, or set TRUERATE_RUNTIME_DIR to another folder",
            base.display()
        );
    }
    Ok(())
}

fn check_owner(folder: &Path) -> anyhow::Result<()> {
    let owner = fs::metadata(folder).with_context(|| folder.display().to_string())?.uid();
    let me = rustix::process::geteuid().as_raw();
    if owner != me {
        bail!("{} belongs to user {owner}, we are user {me}: use that user, or another --instance", folder.display());
    }
    Ok(())
}

/// The claim to an instance: while it is held nobody else supervises it.
#[derive(Debug)]
pub struct Claim {
    domain: Domain,
    lock: Lock,
}

impl Claim {
    /// Takes the claim, making the folder where it is not there.
    ///
    /// # Errors
    /// Where somebody else holds it, or the folder is not ours.
    pub fn take(instance: &str) -> anyhow::Result<Self> {
        Self::try_take(instance)?.map_err(|holder| {
            let pid = holder.map_or_else(String::new, |pid| format!(" (process {pid})"));
            anyhow!("pipeline '{instance}' already runs{pid}: stop it, or choose another --instance")
        })
    }

    /// Takes the first of `name`, `name-2`, `name-3`, … that nobody holds.
    ///
    /// # Errors
    /// Where all are held, or a folder is not ours.
    pub fn take_free(name: &str) -> anyhow::Result<Self> {
        let names = std::iter::once(name.to_owned()).chain((2..100).map(|n| format!("{name}-{n}")));
        for name in names {
            if let Ok(claim) = Self::try_take(&name)? {
                return Ok(claim);
            }
        }
        bail!("ninety-nine pipelines '{name}' run already: stop one")
    }

    /// The claim, or the process that holds it.
    fn try_take(instance: &str) -> anyhow::Result<Result<Self, Option<u32>>> {
        let domain = place(instance)?;
        let builder = || {
            let mut builder = DirBuilder::new();
            builder.recursive(true).mode(0o700);
            builder
        };
        loop {
            let base = domain.folder().parent().unwrap_or(domain.folder());
            builder().create(domain.folder()).with_context(|| {
                format!(
                    "{}: cannot make this folder; set TRUERATE_RUNTIME_DIR to one of yours",
                    domain.folder().display()
                )
            })?;
            check_base(base)?;
            check_owner(domain.folder())?;
            fs::set_permissions(domain.folder(), Permissions::from_mode(0o700))
                .with_context(|| domain.folder().display().to_string())?;
            let path = domain.folder().join("lock");
            let Some(lock) = Lock::take(&path)? else { return Ok(Err(Lock::holder(&path))) };
            if lock.is_in_place(&path) {
                return Ok(Ok(Self { domain, lock }));
            }
        }
    }

    /// The place claimed.
    #[must_use]
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Removes what iceoryx2 has of this instance: files and shared memory. Only where none of its processes lives.
    ///
    /// # Errors
    /// Where something resists.
    pub fn wipe(&self) -> anyhow::Result<()> {
        clear_folder(&self.domain.root())?;
        clear_memory(self.domain.prefix())
    }

    /// Removes everything of this instance and gives up the claim.
    ///
    /// # Errors
    /// Where something resists.
    pub fn remove(self) -> anyhow::Result<()> {
        clear_memory(self.domain.prefix())?;
        clear_folder(self.domain.folder())?;
        drop(self.lock);
        let _ = fs::remove_dir(self.domain.folder().parent().unwrap_or(Path::new("/nowhere")));
        Ok(())
    }
}

/// A watcher that joins makes files of its own there meanwhile; it is soon done.
const CLEARED_WITHIN: Duration = Duration::from_secs(2);

fn clear_folder(folder: &Path) -> anyhow::Result<()> {
    let start = Instant::now();
    loop {
        match fs::remove_dir_all(folder) {
            Err(e) if e.kind() == ErrorKind::DirectoryNotEmpty && start.elapsed() < CLEARED_WITHIN => {
                std::thread::sleep(Duration::from_millis(2));
            }
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(e).with_context(|| format!("{}: cannot be removed", folder.display()));
            }
            _ => return Ok(()),
        }
    }
}

/// What another user left under our names is none of ours, and is never opened.
fn clear_memory(prefix: &str) -> anyhow::Result<()> {
    let me = rustix::process::geteuid().as_raw();
    for entry in fs::read_dir("/dev/shm").context("/dev/shm")?.flatten() {
        let ours = || entry.metadata().is_ok_and(|meta| meta.uid() == me);
        if entry.file_name().to_string_lossy().starts_with(prefix) && ours() {
            let path = entry.path();
            match fs::remove_file(&path) {
                Err(e) if e.kind() != ErrorKind::NotFound => {
                    return Err(e).with_context(|| format!("{}: cannot be removed", path.display()));
                }
                _ => {}
            }
        }
    }
    Ok(())
}

/// A lock file with its holder's process id in it. The kernel frees it when the holder dies.
#[derive(Debug)]
pub struct Lock(File);

impl Lock {
    /// Takes the lock; `None` where somebody has it.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn take(path: &Path) -> anyhow::Result<Option<Self>> {
        let what = || format!("{}: cannot be locked", path.display());
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).with_context(what)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(e)) => return Err(e).with_context(what),
        }
        // Of one length always: where the disk is full the next holder still finds room.
        write!(file, "{:<10}", std::process::id()).with_context(what)?;
        Ok(Some(Self(file)))
    }

    /// Takes the lock, waiting for its holder at most `patience`.
    ///
    /// # Errors
    /// As [`Lock::take`].
    pub fn wait_for(path: &Path, patience: Duration) -> anyhow::Result<Option<Self>> {
        let start = Instant::now();
        loop {
            if let Some(lock) = Self::take(path)? {
                return Ok(Some(lock));
            }
            if start.elapsed() > patience {
                return Ok(None);
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// The process that holds the lock at `path`, if one does.
    #[must_use]
    pub fn holder(path: &Path) -> Option<u32> {
        let mut file = File::open(path).ok()?;
        match file.try_lock_shared() {
            Err(TryLockError::WouldBlock) => {}
            _ => return None,
        }
        let mut text = String::new();
        file.read_to_string(&mut text).ok()?;
        text.trim().parse().ok()
    }

    fn is_in_place(&self, path: &Path) -> bool {
        match (self.0.metadata(), fs::metadata(path)) {
            (Ok(ours), Ok(there)) => ours.ino() == there.ino(),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Lock, clear_folder};

    #[test]
    fn a_lock_has_one_holder_and_says_who() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        assert_eq!(Lock::holder(&path), None);
        let lock = Lock::take(&path).unwrap().unwrap();
        assert!(Lock::take(&path).unwrap().is_none());
        assert_eq!(Lock::holder(&path), Some(std::process::id()));
        drop(lock);
        assert_eq!(Lock::holder(&path), None);
    }

    #[test]
    fn a_folder_is_cleared_while_a_watcher_still_makes_files_in_it() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("i");
        std::fs::create_dir(&folder).unwrap();
        let watched = folder.clone();
        let watcher = std::thread::spawn(move || {
            for k in 0..2_000 {
                let _ = std::fs::create_dir_all(&watched);
                let _ = std::fs::write(watched.join(k.to_string()), []);
            }
        });
        clear_folder(&folder).unwrap();
        watcher.join().unwrap();
        clear_folder(&folder).unwrap();
        assert!(!folder.exists());
    }
}
