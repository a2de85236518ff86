//! A Unix socket: whoever connects gets every row from then on.

use super::sink::{Form, Sink};
use anyhow::{Context, bail};
use std::{
    fs::{self, Permissions},
    io::{ErrorKind, Write},
    os::unix::{
        fs::PermissionsExt,
        net::{UnixListener, UnixStream},
    },
    path::{Path, PathBuf},
};

/// So many may be connected.
const MOST: usize = 16;

/// An open socket.
pub struct Socket {
    path: PathBuf,
    listener: UnixListener,
    clients: Vec<Client>,
}

/// Who is connected, and what is left of a row that it has half.
struct Client {
    stream: UnixStream,
    rest: Vec<u8>,
}

impl Socket {
    /// Opens the socket, for our user and group. What a life that was killed left there is removed.
    ///
    /// # Errors
    /// Where it is in use, or cannot be made.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        let what = || format!("{}: the socket for the rate", path.display());
        if UnixStream::connect(path).is_ok() {
            bail!("{}: somebody serves this socket already", path.display());
        }
        if fs::symlink_metadata(path).is_ok_and(|there| there.len() == 0 && !there.is_file() && !there.is_dir()) {
            fs::remove_file(path).with_context(what)?;
        }
        let listener = UnixListener::bind(path).with_context(what)?;
        fs::set_permissions(path, Permissions::from_mode(0o660)).with_context(what)?;
        listener.set_nonblocking(true).with_context(what)?;
        Ok(Self { path: path.to_owned(), listener, clients: Vec::new() })
    }
}

impl Sink for Socket {
    fn give(&mut self, bytes: &[u8], _form: Form) -> u64 {
        let mut left_out = 0;
        self.clients.retain_mut(|client| match client.give(bytes) {
            Ok(true) => true,
            Ok(false) => {
                left_out += 1;
                true
            }
            Err(_) => false,
        });
        left_out
    }

    fn turn(&mut self, form: Form) -> bool {
        while self.clients.len() < MOST
            && let Ok((stream, _)) = self.listener.accept()
        {
            if stream.set_nonblocking(true).is_ok() {
                self.clients.push(Client { stream, rest: form.header().to_vec() });
            }
        }
        self.clients.retain_mut(|client| client.give_rest().is_ok());
        true
    }
}

impl Client {
    /// Gives a row, whole; `false` where it has no room for it.
    fn give(&mut self, bytes: &[u8]) -> std::io::Result<bool> {
        if !self.give_rest()? {
            return Ok(false);
        }
        match self.stream.write(bytes) {
            Ok(n) => self.rest.extend_from_slice(&bytes[n..]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(false),
            Err(error) => return Err(error),
        }
        Ok(true)
    }

    /// Gives what is left; whether nothing is left any more.
    fn give_rest(&mut self) -> std::io::Result<bool> {
        while !self.rest.is_empty() {
            match self.stream.write(&self.rest) {
                Ok(n) => _ = self.rest.drain(..n),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(false),
                Err(error) => return Err(error),
            }
        }
        Ok(true)
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}
