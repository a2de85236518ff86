//! The raw rows that the compensator learns from: bounded, written by one thread while another one solves.

use gyro_model::{
    Record, Row,
    thin::{Growing, Thinner},
};
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard, TryLockError};

/// Rows, the oldest of which go when there is no more room. While the learner reads, new rows wait outside.
#[derive(Debug)]
pub struct Store {
    record: Arc<RwLock<Record>>,
    growing: Arc<Mutex<Growing>>,
    waiting: Vec<Row>,
    /// What is in the record is to be forgotten as soon as nobody reads it.
    stale: bool,
    /// What is older is to be forgotten, likewise.
    from_ns: i64,
    limit: usize,
    /// Means in place of rows, where they come faster than anything here needs.
    thinner: Option<Thinner>,
}

/// The learner's view.
#[derive(Clone, Debug)]
pub struct View {
    record: Arc<RwLock<Record>>,
    growing: Arc<Mutex<Growing>>,
}

impl Store {
    /// An empty store of at most `limit` rows. `at_once`: its memory is taken, and touched, now, so that it stays the
    /// same however long a stream runs.
    #[must_use]
    pub fn new(limit: usize, at_once: bool, free_names: Vec<String>) -> Self {
        let mut rows = Vec::new();
        if at_once {
            rows.resize(limit, Row::EMPTY);
            rows.clear();
        }
        let record = Record { rows, free_names, ..Record::default() };
        let (record, growing) = (Arc::new(RwLock::new(record)), Arc::new(Mutex::new(Growing::new(limit))));
        Self { record, growing, waiting: Vec::new(), stale: false, from_ns: i64::MIN, limit, thinner: None }
    }

    /// Keeps means over about so many rows in their place.
    #[must_use]
    pub fn keeping_means(self, rows: usize) -> Self {
        Self { thinner: (rows > 1).then(|| Thinner::new(rows, true)), ..self }
    }

    /// The learner's view.
    #[must_use]
    pub fn view(&self) -> View {
        View { record: Arc::clone(&self.record), growing: Arc::clone(&self.growing) }
    }

    /// Keeps a row.
    pub fn push(&mut self, row: Row) {
        let kept = match &mut self.thinner {
            Some(thinner) => thinner.push(&row),
            None => Some(row),
        };
        self.waiting.extend(kept);
        if self.waiting.len() > self.limit {
            self.waiting.drain(..self.limit / 8);
        }
    }

    /// Moves what waits into the record, where nobody reads; whether nothing waits any more.
    pub fn settle(&mut self) -> bool {
        if self.waiting.is_empty() && !self.stale {
            return true;
        }
        let mut record = match self.record.try_write() {
            Ok(record) => record,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return false,
        };
        if std::mem::take(&mut self.stale) {
            record.rows.clear();
        }
        let old = record.rows.partition_point(|row| row.t_ns < self.from_ns);
        record.rows.drain(..old);
        record.rows.append(&mut self.waiting);
        record.means.readings = self.thinner.as_ref().map_or(1, Thinner::readings);
        let over = record.rows.len().saturating_sub(self.limit);
        if over > 0 {
            let gone = over.max(self.limit / 8).min(record.rows.len());
            record.rows.drain(..gone);
        }
        true
    }

    /// Forgets what is older than this, as soon as nobody reads it.
    pub fn forget_before(&mut self, t_ns: i64) {
        self.from_ns = t_ns;
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.waiting.clear();
        (self.stale, self.from_ns) = (true, i64::MIN);
    }
}

impl View {
    /// The whole record, which does not change while this is held.
    pub fn whole(&self) -> RwLockReadGuard<'_, Record> {
        self.record.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// At most about `most` rows of the whole record, as means over blocks. What the last views averaged is not averaged
    /// again.
    pub fn thinned(&self, most: usize) -> Record {
        let mut growing = self.growing.lock().unwrap_or_else(PoisonError::into_inner);
        growing.thinned(&self.whole(), most)
    }

    /// From the first row to the last, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.whole().duration()
    }

    /// A copy of the last `seconds`.
    #[must_use]
    pub fn last(&self, seconds: f64) -> Record {
        let whole = self.whole();
        let from = whole.rows.last().map_or(0, |last| last.t_ns - (seconds * 1e9) as i64);
        let first = whole.rows.partition_point(|row| row.t_ns < from);
        whole.part(first..whole.len())
    }
}

#[cfg(test)]
mod tests {
    use super::{Row, Store};

    #[test]
    fn the_oldest_rows_go_and_the_window_is_the_newest() {
        let mut store = Store::new(1000, false, Vec::new());
        let view = store.view();
        for i in 0..1500 {
            store.push(Row { t_ns: i * 1_000_000, ..Row::EMPTY });
            store.settle();
        }
        let whole = view.whole();
        assert!(whole.len() <= 1000 && whole.len() > 800);
        assert_eq!(whole.rows.last().unwrap().t_ns, 1_499_000_000);
        drop(whole);
        assert_eq!(view.last(0.1).len(), 101);
    }

    #[test]
    fn what_is_older_than_a_change_goes_and_what_comes_later_stays() {
        let mut store = Store::new(1000, false, Vec::new());
        let view = store.view();
        for i in 0..100 {
            store.push(Row { t_ns: i, ..Row::EMPTY });
            store.settle();
        }
        store.forget_before(60);
        store.push(Row { t_ns: 100, ..Row::EMPTY });
        assert!(store.settle());
        assert_eq!((view.whole().rows[0].t_ns, view.whole().len()), (60, 41));
        // A clock that begins again.
        store.clear();
        store.push(Row { t_ns: 5, ..Row::EMPTY });
        assert!(store.settle());
        assert_eq!(view.whole().len(), 1);
    }

    #[test]
    fn rows_wait_while_the_learner_reads() {
        let mut store = Store::new(1000, false, Vec::new());
        let view = store.view();
        let reading = view.whole();
        store.push(Row::EMPTY);
        assert!(!store.settle());
        drop(reading);
        assert!(store.settle());
        assert_eq!(view.whole().len(), 1);
    }
}
