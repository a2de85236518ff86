//! Looking beside the learning: the model held against the newest data, and the search for what is missing.

use super::{
    Compensator, FEWEST_ROWS,
    budget::Budget,
    change::Windows,
    is_due,
    judge::{self, Held},
    judgement::{Job, Judgement},
    next,
    store::Store,
    worker::{Cost, Rank, Worker},
};
use crate::clock::now_ns;
use crate::{
    agreement::Agreement,
    settings::{Learning, Source},
};
use gyro_model::fit::FitError;
use ipc_types::topic;
use std::{sync::Arc, time::Duration};

/// A search may take so many of its periods.
const SEARCH_PERIODS: f64 = 4.0;

/// The two threads that look, and what they saw.
pub(super) struct Lookout {
    judge: Worker<Job, Result<Held, FitError>>,
    searcher: Worker<Job, Result<Judgement, FitError>>,
    judged_ns: u64,
    judged: u64,
    /// Grows by one whenever what was seen so far is forgotten.
    data: u64,
    /// When the sensor became another one, last; ns of the source, 0 where it never did.
    changed_ns: i64,
    /// What the last search found, and the number of searches.
    found: Option<Arc<Judgement>>,
    searches: u64,
    agreement: Agreement,
}

impl Lookout {
    /// Starts the threads, which look at what `store` keeps of the source of this name.
    pub fn start(store: &Store, learning: &Learning, rank: Rank, name: String) -> Self {
        let (to_judge, to_search) = (store.view(), store.view());
        let budget = |fewest, periods: f64| {
            let patience = Duration::from_secs_f64(super::AIM * learning.duty * learning.diagnosis * periods);
            Budget::new(fewest, judge::ROWS.1, patience)
        };
        let (mut holds, mut searches) = (budget(judge::FEWEST_HELD, 1.0), budget(judge::ROWS.0, SEARCH_PERIODS));
        let rows = judge::Rows::default();
        let judged_rows = rows.clone();
        let mut windows = Windows::default();
        Self {
            judge: Worker::start(learning.duty, Cost::Thread, rank, move |job| {
                judge::hold(&to_judge, &judged_rows, &mut holds, &mut windows, &name, job)
            }),
            searcher: Worker::start(learning.duty, Cost::Wall, rank, move |job| {
                judge::search(&to_search, &rows, &mut searches, job)
            }),
            judged_ns: now_ns(),
            judged: 0,
            data: 0,
            changed_ns: 0,
            found: None,
            searches: 0,
            agreement: Agreement::default(),
        }
    }

    /// What was seen so far is forgotten.
    pub fn forget(&mut self) {
        self.data += 1;
    }

    /// What the last search of these data and of a model with these effects found.
    pub fn found(&self, model: &gyro_model::Model) -> Option<&Judgement> {
        self.found.as_deref().filter(|found| found.job.data == self.data && found.is_of(model))
    }
}

impl Compensator<'_> {
    /// Takes what the two threads saw.
    pub(super) fn look(&mut self) -> anyhow::Result<()> {
        if let Some(Ok(found)) = self.lookout.searcher.result()? {
            self.lookout.found = Some(Arc::new(found));
        }
        if let Some(Ok(held)) = self.lookout.judge.result()? {
            self.report(&held)?;
        }
        Ok(())
    }

    /// Asks for a judgement and a search, where they are due.
    pub(super) fn look_closer(&mut self) {
        let period = self.settings.learning.diagnosis;
        let live = period > 0.0 && !self.settings.lossless();
        if !live || self.pulse.health.received < FEWEST_ROWS {
            return;
        }
        if self.lookout.searcher.is_ready() {
            self.lookout.searches += 1;
            let job = self.judge_job(self.lookout.searches, None);
            self.lookout.searcher.ask(job);
        }
        if self.lookout.judge.is_ready() && is_due(self.lookout.judged_ns, period) {
            self.lookout.judged_ns = next(self.lookout.judged_ns, period);
            let job = self.judge_job(0, self.lookout.found.clone());
            self.lookout.judge.ask(job);
        }
    }

    fn judge_job(&self, search: u64, found: Option<Arc<Judgement>>) -> Job {
        Job { model: self.current.start().clone(), took_ns: now_ns(), data: self.lookout.data, search, found }
    }

    fn report(&mut self, held: &Held) -> anyhow::Result<()> {
        if held.job.data != self.lookout.data {
            return Ok(());
        }
        self.lookout.judged += 1;
        let mut message = held.message;
        (message.run, message.sequence) = (self.run.number, self.lookout.judged);
        message.trial = self.trial;
        self.lookout.agreement.take(&mut message);
        if let Some(from_ns) = held.changed_ns.filter(|_| !matches!(self.settings.source, Source::Log(_))) {
            self.begin_anew(from_ns);
        }
        message.changed_ns = self.lookout.changed_ns;
        message.compensator_gave_ns = now_ns();
        self.diagnoses.give(message)?;
        if held.report.len() <= topic::REPORT_BYTES {
            self.reports.give(&held.report)?;
        } else {
            tracing::warn!("the report is too long: {} bytes", held.report.len());
        }
        Ok(())
    }

    /// The sensor has changed: what it was before says nothing any more. A log is read to its end, and learned whole.
    fn begin_anew(&mut self, from_ns: i64) {
        tracing::warn!(
            "the error jumps at {:.0} s: something has changed, and what came before is left out from here on",
            from_ns as f64 * 1e-9
        );
        self.void();
        self.lookout.forget();
        self.lookout.changed_ns = from_ns;
        self.store.forget_before(from_ns);
    }
}
