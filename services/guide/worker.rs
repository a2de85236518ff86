//! The thread that computes beside the rows: fits and rehearsals twice a second, a search where all is told.

use crate::compensator::store::View;
use anyhow::Result;
use gyro_model::{
    Axis, Model,
    diagnose::{self, diagnose},
    diagnosis::AxisResult,
    fit::FitError,
    guide::{Answer, Ask},
};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, SyncSender, TryRecvError, sync_channel},
    },
    thread,
};

/// Rows of a fit and of a search; longer recordings are thinned.
const ROWS: (usize, usize) = (4_000, 12_000);

/// What is to be done.
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
enum Job {
    Ask(Ask),
    Search(Vec<Axis>),
}

/// What came of it.
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
pub(super) enum Done {
    Learned(Answer),
    Searched(Result<Vec<AxisResult>, FitError>),
}

/// The taking end.
pub(super) struct Worker {
    jobs: SyncSender<Job>,
    done: Receiver<Done>,
    stop: Arc<AtomicBool>,
    /// Whether something is being computed.
    pub busy: bool,
}

impl Worker {
    /// Starts the thread, which sees the rows through `view`.
    pub fn start(view: View) -> Result<Self> {
        let (jobs, taken) = sync_channel::<Job>(1);
        let (give, done) = sync_channel(1);
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        thread::Builder::new().name("judge".to_owned()).spawn(move || {
            for job in taken {
                let done = match job {
                    Job::Ask(ask) => Done::Learned(ask.answer(&view.thinned(ROWS.0))),
                    Job::Search(axes) => {
                        let record = view.thinned(ROWS.1);
                        let is_over = || stopped.load(Ordering::Relaxed);
                        let options = diagnose::Options { stop: &is_over, ..diagnose::Options::default() };
                        let mut base = Model::base_for(&record);
                        for axis in Axis::ALL.into_iter().filter(|axis| !axes.contains(axis)) {
                            base.axes[axis.index()] = None;
                        }
                        Done::Searched(diagnose(&record, &base, &axes, &options))
                    }
                };
                if give.send(done).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { jobs, done, stop, busy: false })
    }

    pub fn ask(&mut self, ask: Ask) {
        self.busy = self.jobs.send(Job::Ask(ask)).is_ok();
    }

    pub fn search(&mut self, axes: Vec<Axis>) {
        self.busy = self.jobs.send(Job::Search(axes)).is_ok();
    }

    /// What is done; waited for where `waits`.
    pub fn done(&mut self, waits: bool) -> Result<Option<Done>> {
        if !self.busy {
            return Ok(None);
        }
        let done = if waits {
            self.done.recv().map(Some).map_err(|_| TryRecvError::Disconnected)
        } else {
            self.done.try_recv().map(Some)
        };
        match done {
            Ok(done) => {
                self.busy = false;
                Ok(done)
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => anyhow::bail!("the thread that judges the recording has died"),
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
