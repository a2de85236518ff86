//! acquisition: takes rows from the source, at their time or as fast as they are followed, and gives them as samples.

use crate::clock::now_ns;
use crate::{
    consumers::Consumers,
    pulse::Pulse,
    run_folder::{Run, RunFolder},
    settings::{Settings, Source, Speed},
    source::{Feed, Next},
    stop::Stop,
    wire,
};
use gyro_model::Row;
use ipc_types::{
    Command, MARK_END, Reply, Sample, ServiceId, State, Text,
    port::{Answerer, Hub, Writer},
    topic,
    wait::Wait,
};
use std::{thread::sleep, time::Duration};

/// The longest sleep without looking at anything else.
const NAP: Duration = Duration::from_millis(20);
/// How long a live source waits for its followers before it goes on without them, ns.
const PATIENCE_NS: u64 = 10_000_000_000;
/// A simulated vehicle does not wait: rows that are later than this are gone, ns.
const GONE_NS: u64 = 50_000_000;
/// Rows of a live source that are given before anything else is looked at.
const AT_ONCE: u32 = 64;
const END_AGAIN_NS: u64 = 100_000_000;

struct Acquisition<'a> {
    run: &'a Run,
    settings: &'a Settings,
    folder: &'a RunFolder,
    stop: &'a Stop,
    pulse: Pulse,
    samples: Writer<Sample>,
    consumers: Consumers,
    commands: Answerer<Command, Reply>,
    answered: Vec<Reply>,
    feed: Feed,
    /// Number of the last sample given.
    sent: u64,
    /// Where time is counted from: the clock's and the source's.
    anchor: Option<(u64, i64)>,
    /// When the next row is due, ns; 0 where none is.
    due_ns: u64,
}

/// The process.
///
/// # Errors
/// A source that cannot be read, or broken plumbing.
pub fn run(hub: &Hub, run: &Run, folder: &RunFolder, stop: &Stop) -> anyhow::Result<()> {
    let settings = &run.settings;
    let mut pulse = Pulse::begin(hub, run.number, ServiceId::Acquisition, ["acquisition", "", ""])?;
    let opened = Feed::open(run, folder, stop, |source| {
        pulse.health.source = *source;
        Ok(pulse.beat(u64::MAX)?)
    });
    let Some(feed) = opened? else { return Ok(()) };
    let mut followers = vec![ServiceId::Kalman, ServiceId::Compensator];
    if settings.record.is_some() {
        followers.push(ServiceId::Recorder);
    }
    if settings.has_sender() {
        followers.push(ServiceId::Sender);
    }
    let mut acquisition = Acquisition {
        run,
        settings,
        folder,
        stop,
        pulse,
        samples: hub.writer(&topic::SAMPLE)?,
        consumers: Consumers::new(run.number, hub.reader(&topic::HEALTH, None, Wait::Event)?, &followers),
        commands: hub.answerer(&topic::INJECTION)?,
        answered: Vec::new(),
        feed,
        sent: 0,
        anchor: None,
        due_ns: 0,
    };
    acquisition.pulse.health.resumable = u32::from(!settings.source.comes_once());
    acquisition.pulse.become_state(State::Running)?;
    acquisition.begin()?;
    acquisition.stream()?;
    acquisition.close()
}

impl Acquisition<'_> {
    /// Waits for the followers, and takes the source up after the last row that kalman has. A live sensor that an earlier life of this
    /// process has read is taken up at once: the followers that live are connected already.
    fn begin(&mut self) -> anyhow::Result<()> {
        if self.settings.source.is_live() && self.feed.given() > 0 {
            self.sent = self.feed.given();
            return self.look();
        }
        let start = now_ns();
        loop {
            self.look()?;
            let late = now_ns() > start + PATIENCE_NS && !self.settings.unpaced();
            if self.stop.asked() || self.consumers.ready() || late {
                break;
            }
            sleep(Duration::from_millis(2));
        }
        if self.settings.source.is_live() {
            return Ok(());
        }
        let resume =
            if self.settings.lossless() { self.consumers.slowest() } else { self.consumers.done(ServiceId::Kalman) };
        if resume > 0 {
            tracing::info!("taken up after row {resume}");
            self.go_back_to(resume + 1)?;
        }
        Ok(())
    }

    /// Gives every row of the source, then the end mark until everybody has it.
    fn stream(&mut self) -> anyhow::Result<()> {
        let mut end_ns = 0;
        let mut last = None;
        while !self.stop.asked() {
            self.look()?;
            if self.settings.lossless()
                && let Some(first) = self.consumers.wants_again(self.sent)
            {
                self.go_back_to(first)?;
                last = None;
            }
            match last {
                Some(end) if self.consumers.slowest() >= end => return Ok(()),
                Some(end) => {
                    if !self.settings.lossless() && now_ns() > end_ns + END_AGAIN_NS {
                        end_ns = now_ns();
                        self.give_end(end)?;
                    }
                    sleep(Duration::from_millis(1));
                }
                None => match self.feed.next(NAP)? {
                    Next::Later => {}
                    Next::End => {
                        last = Some(self.give_end(self.sent + 1)?);
                        end_ns = now_ns();
                    }
                    Next::Row(..) if self.settings.source.is_live() => {
                        for _ in 0..AT_ONCE {
                            if !self.give_next()? {
                                break;
                            }
                        }
                    }
                    Next::Row(..) if self.settings.unpaced() => {
                        let credit = if self.settings.lossless() {
                            self.consumers.credit(self.sent)
                        } else {
                            self.consumers.credit_of_pipe(self.sent)
                        };
                        if credit == 0 {
                            sleep(Duration::from_micros(200));
                        }
                        for _ in 0..credit {
                            if !self.give_next()? {
                                break;
                            }
                        }
                    }
                    Next::Row(row, _) => {
                        if self.sleep_until_due(&row)? {
                            self.give_next()?;
                        }
                    }
                },
            }
        }
        Ok(())
    }

    /// Stays, for those who look, until told to go.
    fn close(&mut self) -> anyhow::Result<()> {
        while !self.stop.asked() {
            self.look()?;
            self.count();
            self.pulse.become_state(State::Finished)?;
            if self.settings.lossless() && self.consumers.wants_again(self.sent).is_some() {
                self.stream()?;
            }
            sleep(NAP);
        }
        self.count();
        Ok(self.pulse.beat_now()?)
    }

    fn look(&mut self) -> anyhow::Result<()> {
        self.consumers.listen(self.sent, self.settings.lossless())?;
        self.obey()?;
        if self.pulse.is_due() {
            self.count();
        }
        self.pulse.beat(u64::MAX)?;
        Ok(())
    }

    /// Hides what it is told to hide.
    fn obey(&mut self) -> anyhow::Result<()> {
        let Self { commands, feed, folder, answered, .. } = self;
        commands.serve(|command| {
            if let Some(reply) = answered.iter().find(|reply| reply.id == command.id) {
                return Some(*reply);
            }
            let values = command.argument.as_str();
            let text =
                if values.is_empty() { command.effect.to_string() } else { format!("{}:{values}", command.effect) };
            let (done, says) = match feed.hide(&text, folder) {
                Ok(()) => (1, format!("{text} is hidden in the source from now on")),
                Err(error) => (0, format!("{error:#}")),
            };
            let reply = Reply { id: command.id, epoch: 0, done, says: Text::new(&says) };
            answered.truncate(31);
            answered.insert(0, reply);
            Some(reply)
        })?;
        Ok(())
    }

    /// Gives the next row, where it has come.
    fn give_next(&mut self) -> anyhow::Result<bool> {
        let Next::Row(row, read_ns) = self.feed.next(Duration::ZERO)? else { return Ok(false) };
        // What comes by itself arrives when it is read, though not before it is due; what is there, when it is given.
        let arrived_ns = if read_ns > 0 { read_ns.max(self.due_ns) } else { now_ns() };
        self.sent += 1;
        let mut sample = wire::sample_of(&row, self.run.number, self.sent);
        sample.injected = u32::from(self.feed.injects());
        sample.arrived_ns = arrived_ns;
        sample.acquisition_gave_ns = now_ns();
        self.pulse.health.stages[0].record(sample.acquisition_gave_ns.saturating_sub(arrived_ns));
        // Counted first: a number that two lives of this process give would be two samples.
        self.feed.count();
        self.samples.give(sample)?;
        self.feed.advance()?;
        Ok(true)
    }

    /// Counts are those of the run, whichever life of this process gave the rows.
    fn count(&mut self) {
        let health = &mut self.pulse.health;
        (health.received, health.sent) = (self.feed.given() + self.feed.rejected(), self.feed.given());
        health.rejected = self.feed.rejected();
        health.acknowledged = self.feed.given();
        health.source = self.feed.health();
    }

    fn give_end(&mut self, number: u64) -> anyhow::Result<u64> {
        let now = now_ns();
        let end = Sample {
            run: self.run.number,
            sequence: number,
            mark: MARK_END,
            arrived_ns: now,
            acquisition_gave_ns: now,
            ..Sample::EMPTY
        };
        self.samples.give(end)?;
        self.count();
        self.sent = number;
        Ok(number)
    }

    /// Sleeps until this row, the next, is due, at most a nap; whether it is due.
    fn sleep_until_due(&mut self, row: &Row) -> anyhow::Result<bool> {
        let Speed::Times(times) = self.settings.speed else { return Ok(true) };
        let now = now_ns();
        let (clock, time) = match self.anchor {
            Some(anchor) => anchor,
            None => self.set_anchor(now, row)?,
        };
        let due = clock + ((row.t_ns - time).max(0) as f64 / times) as u64;
        if self.settings.source == Source::Simulated && due + GONE_NS < now && self.feed.is_taken_up() {
            self.feed.count();
            self.feed.advance()?;
            self.sent += 1;
            return Ok(false);
        }
        self.due_ns = due;
        if due > now {
            let rest = Duration::from_nanos(due - now);
            sleep(rest.min(NAP));
            return Ok(rest <= NAP);
        }
        Ok(true)
    }

    /// A log goes on from where it was; a vehicle has driven on.
    fn set_anchor(&mut self, now: u64, row: &Row) -> anyhow::Result<(u64, i64)> {
        let mut anchor = (now, row.t_ns);
        if self.settings.source == Source::Simulated {
            anchor = self.feed.remember_start(self.folder, anchor)?;
        }
        self.anchor = Some(anchor);
        Ok(anchor)
    }

    fn go_back_to(&mut self, number: u64) -> anyhow::Result<()> {
        self.anchor = None;
        if self.feed.given() + 1 != number {
            let Self { feed, stop, pulse, .. } = self;
            feed.begin_again(number - 1, stop, || Ok(pulse.beat(u64::MAX)?))?;
        }
        self.sent = self.feed.given();
        Ok(())
    }
}
