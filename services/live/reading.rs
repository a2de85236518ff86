//! The thread that reads a live source: it opens the link again when it is lost, and takes the time at which bytes came.

use super::{
    Address, Tally,
    arrival::{Arrival, LOOK, Origin, Told, Watched},
    fast::Fast,
    format::{Format, Found},
    link::{Got, Link},
    spikes::Spikes,
    tally::Fault,
    timeline::{Timed, Timeline},
    trouble::{Trouble, refusal},
};
use crate::clock::now_ns;
use anyhow::anyhow;
use ipc_types::{Text, health};
use std::{
    io,
    sync::{Arc, Mutex, PoisonError, mpsc::SyncSender},
    thread,
    time::Duration,
};
use workbench::log::{LogError, Problem};

/// The first pause before a link is opened again, and the longest.
const PAUSES: [Duration; 2] = [Duration::from_millis(50), Duration::from_secs(2)];
/// Bytes that are read at once.
const CHUNK: usize = 1 << 14;
/// Reads without a row after which it is said.
const BARREN: u64 = 1000;

/// Why a link is left.
enum Left {
    /// It has ended, or is lost.
    Over(Option<io::Error>),
    /// Nobody takes the rows any more.
    Unheard,
}

/// The reading end.
pub(super) struct Reading {
    address: Address,
    format: Box<dyn Format>,
    timeline: Timeline,
    tally: Tally,
    watched: Arc<Mutex<Watched>>,
    opened: Option<SyncSender<Origin>>,
    give: SyncSender<Told>,
    trouble: Trouble,
    fast: Fast,
    spikes: Spikes,
    /// Reads before the first row, and whether it was said that none comes.
    barren: u64,
    told_barren: bool,
    /// Why the link is not open.
    absent: Option<String>,
}

impl Reading {
    /// Of a source that is not open yet: `opened` is told what rows hold, `give` takes them.
    pub(super) fn new(
        address: Address,
        format: Box<dyn Format>,
        timeline: Timeline,
        trouble: Trouble,
        watched: Arc<Mutex<Watched>>,
        opened: SyncSender<Origin>,
        give: SyncSender<Told>,
    ) -> Self {
        let (tally, opened) = (Tally::default(), Some(opened));
        Self {
            address,
            format,
            timeline,
            tally,
            watched,
            opened,
            give,
            trouble,
            fast: Fast::default(),
            spikes: Spikes::default(),
            barren: 0,
            told_barren: false,
            absent: None,
        }
    }

    /// Reads, until a pipe ends or nobody takes the rows any more.
    pub(super) fn run(mut self) {
        let mut pause = PAUSES[0];
        let mut told = false;
        self.become_link(health::Link::Waiting);
        loop {
            let rows = self.tally.counts.rows;
            let over = match self.address.open() {
                Ok(mut link) => {
                    self.absent = None;
                    self.tally.counts.reconnects += u32::from(rows > 0);
                    self.become_link(health::Link::Connected);
                    match self.read(link.as_mut()) {
                        Left::Over(why) => why,
                        Left::Unheard => return,
                    }
                }
                Err(error) => {
                    let why = format!("{}: {}", self.address, self.address.why(&error));
                    if self.absent.as_ref() != Some(&why) {
                        self.absent = Some(why);
                        self.watch(false);
                    }
                    Some(error)
                }
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
                let why = over.map_or_else(|| "it has ended".to_owned(), |error| self.address.why(&error));
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
        let is_pipe = self.address.is_pipe();
        let over = |format: &mut dyn Format, found: &mut dyn FnMut(Found)| {
            if is_pipe { format.end(found) } else { format.cut(found) }
        };
        if !self.hand_over(over) || is_pipe {
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
        let Self { format, timeline, tally, opened, give, trouble, fast, spikes, .. } = self;
        let arrived_ns = now_ns();
        let (mut heard, mut rows, mut waiting) = (true, 0, Vec::new());
        find(format.as_mut(), &mut |found| match found {
            Found::Row(mut row, own) => {
                if let Some(says) = fast.take(&mut row) {
                    tally.add(Fault::Value, &says);
                }
                let left_out = spikes.take(&mut row, own);
                if left_out > 0 {
                    tally.mark(left_out, own);
                }
                timeline.take(row, own, arrived_ns, tally, |Timed { row, arrived_ns, start_ns }| {
                    rows += 1;
                    trouble.row(&row);
                    let told = Told::Row(Arrival { row, read_ns: arrived_ns, start_ns });
                    if opened.is_some() {
                        // Until it is said what rows hold.
                        waiting.push(told);
                    } else {
                        heard &= give.send(told).is_ok();
                    }
                });
            }
            Found::Fault(fault, says) => {
                tally.add(fault, &says);
                trouble.line(&says);
            }
            Found::Missed(rows) => tally.counts.missed += rows,
            Found::Begins => timeline.expect_beginning(),
        });
        tally.counts.rows += rows;
        self.barren += u64::from(tally.counts.rows == 0);
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

    /// Shows the counts, and what is wrong with the source.
    fn watch(&mut self, has_rows: bool) {
        let trouble = self.trouble.says(&self.address, self.format.as_ref(), &self.tally);
        let trouble = [self.fast.says(), trouble].into_iter().flatten().reduce(|a, b| format!("{a}; {b}"));
        let is_absent = self.absent.is_some();
        let trouble = self.absent.clone().or(trouble);
        let counts = &mut self.tally.counts;
        if has_rows {
            counts.link = health::Link::Connected as u32;
        }
        let barren = || (counts.rows == 0 && self.barren >= BARREN).then(|| "no row so far".to_owned());
        if let Some(why) = trouble.clone().or_else(barren)
            && !is_absent
            && !std::mem::replace(&mut self.told_barren, true)
        {
            tracing::warn!("{}: {why}", self.address);
        }
        self.told_barren &= trouble.is_some() || counts.rows == 0;
        counts.trouble = Text::new(trouble.as_deref().unwrap_or_default());
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
            (None, content) => match (refusal(&self.address, self.format.as_ref()), content) {
                (Some(why), _) => Told::Failed(anyhow!("{name}: {why}")),
                (None, Some(_)) => Told::End,
                (None, None) => refuse(Problem::Empty),
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
