//! The rows of a live source. The next one may take as long as it likes, so a thread of its own waits for it
//! (`live::reading`).

use super::{
    Address,
    arrival::{Arrival, LOOK, Origin, Told, Watched},
    format,
    reading::Reading,
    timeline::{Given, LIVE_JUMP_NS, PIPE_JUMP_NS, Timeline},
    trouble::Trouble,
};
use crate::clock::now_ns;
use crate::{hopeless::Hopeless, stop::Stop};
use anyhow::bail;
use ipc_types::health::{self, SourceHealth};
use std::{
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, sync_channel},
    },
    thread,
    time::Duration,
};
use workbench::log::Options;

/// Rows that wait for whoever takes them, half a second at 8 kHz; the thread waits with the next one, and so does the
/// pipe behind it.
const WAITING: usize = 4096;
/// A link without rows for that long is shown as silent.
const SILENT_NS: u64 = 2_000_000_000;

/// The taking end.
#[derive(Debug)]
pub struct Stream {
    name: String,
    origin: Origin,
    rows: Receiver<Told>,
    watched: Arc<Mutex<Watched>>,
}

impl Stream {
    /// Opens it and waits for its first row, calling `meanwhile` again and again; `None` when asked to stop before.
    /// `given` is what an earlier life of this process gave last.
    ///
    /// # Errors
    /// A pipe that cannot be read or has no row in it, a header that is none, and those of `meanwhile`.
    pub fn open(
        address: &Address,
        options: &Options,
        given: Option<Given>,
        stop: &Stop,
        mut meanwhile: impl FnMut(&SourceHealth) -> anyhow::Result<()>,
    ) -> anyhow::Result<Option<Self>> {
        let (to_open, opened) = sync_channel(1);
        let (give, rows) = sync_channel(WAITING);
        let watched = Arc::new(Mutex::new(Watched::default()));
        let timeline = Timeline::new(if address.is_pipe() { PIPE_JUMP_NS } else { LIVE_JUMP_NS }, given);
        let format = format::of(address, options).map_err(Hopeless::from_error)?;
        let trouble = Trouble::new(address.is_reference, options.reference.is_some());
        let reading = Reading::new(address.clone(), format, timeline, trouble, Arc::clone(&watched), to_open, give);
        // It may be waiting when the process ends: nobody joins it.
        thread::Builder::new().name("source".to_owned()).spawn(move || reading.run())?;
        let name = address.to_string();
        while !stop.asked() {
            match opened.recv_timeout(LOOK) {
                Ok(origin) => return Ok(Some(Self { name, origin, rows, watched })),
                Err(RecvTimeoutError::Timeout) => meanwhile(&seen(&watched))?,
                Err(RecvTimeoutError::Disconnected) => match rows.recv() {
                    Ok(Told::Failed(error)) => return Err(Hopeless::from_error(error)),
                    _ => bail!("the thread that reads the source has died"),
                },
            }
        }
        Ok(None)
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What is known of it.
    #[must_use]
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// How it is now.
    #[must_use]
    pub fn health(&self) -> SourceHealth {
        seen(&self.watched)
    }

    /// The next row, where it comes within `patience`; `Some(None)` at the end.
    ///
    /// # Errors
    /// A pipe that is damaged from here on.
    pub fn next(&self, patience: Duration) -> anyhow::Result<Option<Option<Arrival>>> {
        match self.rows.recv_timeout(patience) {
            Ok(Told::Row(arrival)) => Ok(Some(Some(arrival))),
            Ok(Told::End) => Ok(Some(None)),
            Ok(Told::Failed(error)) => Err(Hopeless::from_error(error)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => bail!("the thread that reads {} has died", self.name),
        }
    }
}

/// The counts, and a link that is silent called so.
fn seen(watched: &Mutex<Watched>) -> SourceHealth {
    let watched = watched.lock().unwrap_or_else(PoisonError::into_inner);
    let mut counts = watched.counts;
    if counts.link == health::Link::Connected as u32 && now_ns() > watched.row_ns + SILENT_NS {
        counts.link = health::Link::Silent as u32;
    }
    counts
}
