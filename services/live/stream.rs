//! The rows of a live source. The next one may take as long as it likes, so a thread of its own waits for it, opens the
//! link again when it is lost, and takes the time at which bytes came.

use super::{
    Address, Content, Tally,
    format::{self, Format, Found},
    link::{self, Got, Link},
    timeline::{LIVE_JUMP_NS, PIPE_JUMP_NS, Timed, Timeline},
};
use crate::{
    clock::now_ns,
    hopeless::Hopeless,
    log::{LogError, Problem},
    stop::Stop,
};
use anyhow::{anyhow, bail};
use gyro_model::Row;
use ipc_types::health::{self, SourceHealth};
use std::{
    io,
    path::Path,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel},
    },
    thread,
    time::Duration,
};

/// Rows that wait for whoever takes them, half a second at 8 kHz; the thread waits with the next one, and so does the
/// pipe behind it.
const WAITING: usize = 4096;
/// Between two looks at whether to go on waiting.
const LOOK: Duration = Duration::from_millis(20);
/// A link without rows for that long is shown as silent.
const SILENT_NS: u64 = 2_000_000_000;
/// The first pause before a link is opened again, and the longest.
const PAUSES: [Duration; 2] = [Duration::from_millis(50), Duration::from_secs(2)];
/// Bytes that are read at once.
const CHUNK: usize = 1 << 14;
/// Lines without a header after which it is said.
const HEADERLESS: u64 = 50;
/// What may be done about it.
const HEADER: &str = "…?header=t,gyro_z,ref_angle_z";

/// The taking end.
#[derive(Debug)]
pub struct Stream {
    name: String,
    origin: Origin,
    rows: Receiver<Told>,
    watched: Arc<Mutex<Watched>>,
}

/// What is known of a source once its first row has come.
#[derive(Clone, Debug)]
pub struct Origin {
    /// What its rows hold.
    pub content: Content,
    /// Its own time of the stream's beginning, ns.
    pub start_ns: i128,
}

/// A row that has come.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// The row.
    pub row: Row,
    /// When it was read, ns.
    pub read_ns: u64,
}

/// What the thread says.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "a box would be an allocation a row")]
enum Told {
    Row(Arrival),
    End,
    Failed(anyhow::Error),
}

/// What is seen of the link while no row comes.
#[derive(Debug, Default)]
struct Watched {
    counts: SourceHealth,
    row_ns: u64,
}

impl Stream {
    /// Opens it and waits for its first row, calling `meanwhile` again and again; `None` when asked to stop before.
    /// `given` is what an earlier life of this process gave last: the stream's time and ours, ns.
    ///
    /// # Errors
    /// A pipe that cannot be read or has no row in it, a header that is none, and those of `meanwhile`.
    pub fn open(
        address: &Address,
        columns: Option<&Path>,
        given: Option<(i64, u64)>,
        stop: &Stop,
        mut meanwhile: impl FnMut(&SourceHealth) -> anyhow::Result<()>,
    ) -> anyhow::Result<Option<Self>> {
        let (to_open, opened) = sync_channel(1);
        let (give, rows) = sync_channel(WAITING);
        let watched = Arc::new(Mutex::new(Watched::default()));
        let jump = if address.is_pipe() { PIPE_JUMP_NS } else { LIVE_JUMP_NS };
        let reading = Reading {
            address: address.clone(),
            format: format::of(address, columns).map_err(Hopeless::from_error)?,
            timeline: Timeline::new(jump, given),
            tally: Tally::default(),
            watched: Arc::clone(&watched),
            opened: Some(to_open),
            give,
            headerless: false,
        };
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

/// Why a link is left.
enum Left {
    /// It has ended, or is lost.
    Over(Option<io::Error>),
    /// Nobody takes the rows any more.
    Unheard,
}

/// The reading end.
struct Reading {
    address: Address,
    format: Box<dyn Format>,
    timeline: Timeline,
    tally: Tally,
    watched: Arc<Mutex<Watched>>,
    opened: Option<SyncSender<Origin>>,
    give: SyncSender<Told>,
    headerless: bool,
}

impl Reading {
    fn run(mut self) {
        let mut pause = PAUSES[0];
        let mut told = false;
        self.become_link(health::Link::Waiting);
        loop {
            let rows = self.tally.counts.rows;
            let over = match link::open(&self.address) {
                Ok(mut link) => {
                    self.tally.counts.reconnects += u32::from(rows > 0);
                    self.become_link(health::Link::Connected);
                    match self.read(link.as_mut()) {
                        Left::Over(why) => why,
                        Left::Unheard => return,
                    }
                }
                Err(error) => Some(error),
            };
            if self.address.is_pipe() {
                self.end(over);
                return;
            }
            if self.tally.counts.rows > rows {
                // It was good: the next trouble is told anew.
                (pause, told) = (PAUSES[0], false);
            }
            if !std::mem::replace(&mut told, true) {
                let why = over.map_or_else(|| "it has ended".to_owned(), |error| error.to_string());
                tracing::warn!("{}: {why}; it is opened again as soon as it is there", self.address);
            }
            thread::sleep(pause);
            pause = (2 * pause).min(PAUSES[1]);
        }
    }

    /// Reads until the link is over.
    fn read(&mut self, link: &mut dyn Link) -> Left {
        let mut buffer = vec![0; CHUNK];
        let mut heard_ns = now_ns();
        loop {
            let over = match link.read(&mut buffer, LOOK) {
                Ok(Got::Bytes(n)) => {
                    heard_ns = now_ns();
                    if !self.take(&buffer[..n], link.gives_packets()) {
                        return Left::Unheard;
                    }
                    continue;
                }
                Ok(Got::Nothing) => match self.address.silence {
                    Some(silence) if now_ns() > heard_ns + silence.as_nanos() as u64 => {
                        Some(io::ErrorKind::TimedOut.into())
                    }
                    _ => continue,
                },
                Ok(Got::End) => None,
                Err(error) => Some(error),
            };
            self.lose();
            return Left::Over(over);
        }
    }

    /// The link is over: what was half here is no row, and the source's clock may begin again.
    fn lose(&mut self) {
        if !self.hand_over(|format, found| format.cut(found)) {
            return;
        }
        if self.address.is_pipe() {
            return;
        }
        self.timeline.expect_beginning();
        self.become_link(if self.tally.counts.rows > 0 { health::Link::Lost } else { health::Link::Waiting });
    }

    fn take(&mut self, bytes: &[u8], is_packet: bool) -> bool {
        self.hand_over(|format, found| {
            format.take(bytes, found);
            if is_packet {
                format.cut(found);
            }
        })
    }

    /// Hands on what a format finds; whether somebody takes it.
    fn hand_over(&mut self, find: impl FnOnce(&mut dyn Format, &mut dyn FnMut(Found))) -> bool {
        let Self { format, timeline, tally, opened, give, .. } = self;
        let arrived_ns = now_ns();
        let (mut heard, mut rows, mut waiting) = (true, 0, Vec::new());
        find(format.as_mut(), &mut |found| match found {
            Found::Row(row, own) => timeline.take(row, own, arrived_ns, tally, |Timed { row, arrived_ns }| {
                rows += 1;
                let told = Told::Row(Arrival { row, read_ns: arrived_ns });
                if opened.is_some() {
                    // Until it is said what rows hold.
                    waiting.push(told);
                } else {
                    heard &= give.send(told).is_ok();
                }
            }),
            Found::Fault(fault, says) => tally.add(fault, &says),
            Found::Missed(rows) => tally.counts.missed += rows,
            Found::Begins => timeline.expect_beginning(),
        });
        tally.counts.rows += rows;
        if !waiting.is_empty() {
            self.say_what_rows_hold();
            for told in waiting {
                heard &= self.give.send(told).is_ok();
            }
        }
        self.watch(rows > 0);
        heard
    }

    fn say_what_rows_hold(&mut self) {
        if let (Some(content), Some(opened)) = (self.format.content(), self.opened.take()) {
            let _ = opened.send(Origin { content: content.clone(), start_ns: self.timeline.start_ns() });
        }
    }

    /// Shows the counts.
    fn watch(&mut self, has_rows: bool) {
        let counts = &mut self.tally.counts;
        if has_rows {
            counts.link = health::Link::Connected as u32;
        } else if counts.rows == 0 && counts.remarks >= HEADERLESS && !std::mem::replace(&mut self.headerless, true) {
            let why = self.format.refusal().map_or_else(|| "no row so far".to_owned(), ToString::to_string);
            tracing::warn!("{}: {why}; or say the columns in the address: {HEADER}", self.address);
        }
        let mut watched = self.watched.lock().unwrap_or_else(PoisonError::into_inner);
        watched.counts = *counts;
        if has_rows {
            watched.row_ns = now_ns();
        }
    }

    fn become_link(&mut self, link: health::Link) {
        self.tally.counts.link = link as u32;
        self.watch(false);
    }

    /// The end of a pipe.
    fn end(mut self, error: Option<io::Error>) {
        let name = self.address.to_string();
        let refuse = |problem| Told::Failed(LogError::new(&name, None, None, problem).into());
        let told = match (error, self.format.content()) {
            (Some(error), _) if self.tally.counts.rows == 0 && error.kind() == io::ErrorKind::NotFound => {
                refuse(Problem::Open(error))
            }
            (Some(error), _) => refuse(Problem::Read(error)),
            (None, Some(_)) => Told::End,
            (None, None) => match self.format.refusal() {
                Some(problem) => Told::Failed(anyhow!("{name}: {problem}")),
                None => refuse(Problem::Empty),
            },
        };
        if matches!(told, Told::End) {
            self.say_what_rows_hold();
        }
        self.become_link(health::Link::Ended);
        // Whoever waits for the first row must find the reason.
        let _ = self.give.send(told);
        drop(self.opened.take());
    }
}
