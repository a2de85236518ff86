//! A recording under way: rows to the log, to the guide and to the worker that computes beside them.

use super::{
    source::{Next, Source},
    worker::{Done, Worker},
};
use crate::compensator::store::Store;
use anyhow::Result;
use gyro_model::{
    Record, Row,
    guide::{Guide, Stage},
};
use std::time::Duration;
use workbench::log::GrowingLog;

/// How often it is asked what the rows tell, s of the source.
const ASKS: f64 = 0.5;
/// Rows that are taken before anything else is looked at.
const AT_ONCE: usize = 256;
/// Rows that are kept to be judged: 20 minutes at 1 kHz.
const MOST_ROWS: usize = 1_200_000;
/// So long the first of them is waited for.
const PATIENCE: Duration = Duration::from_millis(20);

/// See the head.
pub(super) struct Recording<'a> {
    log: &'a mut GrowingLog,
    store: Store,
    /// What the rows tell so far.
    pub guide: Guide,
    worker: Worker,
    /// When it was last asked what the rows tell, and the time of the last row, s of the source.
    asked: f64,
    now: f64,
}

impl<'a> Recording<'a> {
    /// Begins with the first rows, which the log has already.
    pub fn begin(log: &'a mut GrowingLog, first: &Record, guide: Guide) -> Result<Self> {
        let store = Store::new(MOST_ROWS, false, first.free_names.clone());
        let worker = Worker::start(store.view())?;
        let mut recording = Self { log, store, guide, worker, asked: 0.0, now: first.duration() };
        first.rows.iter().for_each(|row| recording.keep(*row));
        Ok(recording)
    }

    fn keep(&mut self, row: Row) {
        self.store.push(row);
        self.guide.take(&row);
    }

    /// Takes the rows that have come; whether there are no more.
    pub fn take(&mut self, source: &mut Source) -> Result<bool> {
        let mut is_over = false;
        for k in 0..AT_ONCE {
            match source.next(if k == 0 { PATIENCE } else { Duration::ZERO })? {
                Next::Row(row) => {
                    self.log.row(&row)?;
                    self.keep(row);
                    self.now = row.t_ns as f64 * 1e-9;
                    if source.waits() && self.now >= self.asked + ASKS {
                        break;
                    }
                }
                Next::Later => break,
                Next::End => {
                    is_over = true;
                    break;
                }
            }
        }
        self.log.flush()?;
        self.store.settle();
        Ok(is_over)
    }

    /// Asks the worker what the rows tell, where that is due.
    pub fn ask(&mut self, is_over: bool) {
        if self.worker.busy || (self.now < self.asked + ASKS && !is_over) {
            return;
        }
        self.asked = self.now;
        match (self.guide.state().stage, self.guide.ask()) {
            (Stage::Searching, _) => self.worker.search(self.guide.judged_axes()),
            (_, Some(ask)) => self.worker.ask(ask),
            _ => {}
        }
    }

    /// Hands on what the worker found, which is waited for where rows wait; whether there was something.
    pub fn learn(&mut self, waits: bool) -> Result<bool> {
        let done = self.worker.done(waits)?;
        let learned = done.is_some();
        match done {
            Some(Done::Learned(answer)) => self.guide.learn(answer),
            Some(Done::Searched(axes)) => self.guide.judge(axes?),
            None => {}
        }
        Ok(learned)
    }
}
