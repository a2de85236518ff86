//! A log that comes while it is read: standard input, a pipe. The next row may take as long as it likes, so a thread of
//! its own waits for it.

use crate::{
    hopeless::Hopeless,
    log::{Layout, LogError, Options, Reader},
    stop::Stop,
};
use anyhow::bail;
use gyro_model::Row;
use std::{
    path::Path,
    sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel},
    thread,
    time::Duration,
};

/// Rows that wait for whoever takes them; the thread waits with the next one, and so does the pipe behind it.
const WAITING: usize = 256;
/// Between two looks at whether to go on waiting.
const LOOK: Duration = Duration::from_millis(20);

/// The taking end.
#[derive(Debug)]
pub struct Stream {
    head: Head,
    rows: Receiver<Result<Arrival, LogError>>,
}

/// What is known of a log once its first row has come.
#[derive(Debug)]
pub struct Head {
    /// Its name.
    pub log: String,
    /// What its columns hold.
    pub layout: Layout,
    /// Its own time of its first row, ns.
    pub start_ns: i128,
}

/// A row that has come.
#[derive(Debug)]
pub struct Arrival {
    /// The row; `None` at the end.
    pub row: Option<Row>,
    /// When it was read, ns.
    pub read_ns: u64,
    /// Rows so far that were left out, or of which a value was.
    pub faulty: u64,
}

impl Stream {
    /// Opens it and waits for its first row, calling `meanwhile` again and again; `None` when asked to stop before.
    ///
    /// # Errors
    /// Where it cannot be read, and those of `meanwhile`.
    pub fn open(
        path: &Path,
        options: &Options,
        stop: &Stop,
        mut meanwhile: impl FnMut() -> anyhow::Result<()>,
    ) -> anyhow::Result<Option<Self>> {
        let (to_open, opened) = sync_channel(1);
        let (give, rows) = sync_channel(WAITING);
        let (path, options) = (path.to_owned(), options.clone());
        // It may be waiting when the process ends: nobody joins it.
        thread::spawn(move || {
            if let Err(error) = read(&path, &options, &to_open, &give) {
                let _ = give.send(Err(error));
            }
        });
        while !stop.asked() {
            match opened.recv_timeout(LOOK) {
                Ok(head) => return Ok(Some(Self { head, rows })),
                Err(RecvTimeoutError::Timeout) => meanwhile()?,
                Err(RecvTimeoutError::Disconnected) => match rows.recv() {
                    Ok(Err(error)) => return Err(Hopeless::from_error(error)),
                    _ => bail!("the thread that reads the source has died"),
                },
            }
        }
        Ok(None)
    }

    /// What is known of it.
    #[must_use]
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// The next row or the end, where it comes within `patience`.
    ///
    /// # Errors
    /// A log that is damaged from here on.
    pub fn next(&self, patience: Duration) -> anyhow::Result<Option<Arrival>> {
        match self.rows.recv_timeout(patience) {
            Ok(told) => told.map(Some).map_err(Hopeless::from_error),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => bail!("the thread that reads {} has died", self.head.log),
        }
    }
}

/// Reads to the end, or until nobody takes the rows any more.
fn read(
    path: &Path,
    options: &Options,
    opened: &SyncSender<Head>,
    give: &SyncSender<Result<Arrival, LogError>>,
) -> Result<(), LogError> {
    let mut reader = Reader::open(path, options)?;
    let mut row = reader.next_row()?;
    let start_ns = reader.start_ns().unwrap_or(0);
    let _ = opened.send(Head { log: reader.log().to_owned(), layout: reader.layout().clone(), start_ns });
    loop {
        let ended = row.is_none();
        let arrival = Arrival { row, read_ns: reader.row_read_ns(), faulty: reader.rows_faulty() };
        if give.send(Ok(arrival)).is_err() || ended {
            return Ok(());
        }
        row = reader.next_row()?;
    }
}
