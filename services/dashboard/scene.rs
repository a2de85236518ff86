//! What there is to see: the newest of everything, the last minutes, and whoever looks on.

use gyro_model::{Record, Row, diagnosis::Diagnosis};
use ipc_types::Parameters;
use serde::Serialize;
use serde_json::{Value, json};
use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use tokio::sync::broadcast;
use workbench::{motion::Step, report::stream::ErrorAt};

/// Steps kept for a new page: one minute.
const STEPS: usize = 1200;
/// Diagnoses kept, one a second: twenty minutes.
const ERRORS: usize = 1200;
/// Sets of parameters kept, two a second: five minutes.
const PARAMETERS: usize = 600;
/// Changes of the model kept.
const MARKS: usize = 100;
/// Rows kept for the export: two minutes at 1 kHz, about 30 MB.
const ROWS: usize = 120_000;
/// Messages that may wait for a slow page; beyond, it loses the oldest.
const WAITING: usize = 256;

/// One message to every page that looks on.
#[derive(Debug)]
pub struct Message {
    /// Its kind.
    pub event: &'static str,
    /// JSON.
    pub data: String,
}

/// A change of the model, for a mark in every chart over time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// s of the source.
    pub t: f64,
    /// From then on.
    pub epoch: u64,
    /// `+ delay (z)`.
    pub says: String,
}

/// Every parameter at one time: key, value, standard error, in the units shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParametersAt {
    /// s of the source.
    pub t: f64,
    /// Key as in [`super::model::Shown`], value, standard error.
    pub values: Vec<(String, f64, Option<f64>)>,
}

/// What the exports are made of.
#[derive(Debug)]
pub struct Kept {
    steps: VecDeque<Step>,
    errors: VecDeque<ErrorAt>,
    parameters: VecDeque<ParametersAt>,
    marks: VecDeque<Mark>,
    newest: BTreeMap<&'static str, Value>,
    rows: VecDeque<Row>,
    /// The newest diagnosis.
    pub diagnosis: Option<Diagnosis>,
    /// The newest parameters.
    pub model: Option<Parameters>,
}

impl Kept {
    fn of(rows: VecDeque<Row>) -> Self {
        Self {
            steps: VecDeque::new(),
            errors: VecDeque::new(),
            parameters: VecDeque::new(),
            marks: VecDeque::new(),
            newest: BTreeMap::new(),
            rows,
            diagnosis: None,
            model: None,
        }
    }
}

/// Shared by the thread that watches the pipeline and the one that serves pages.
#[derive(Clone, Debug)]
pub struct Scene {
    kept: Arc<Mutex<Kept>>,
    pages: broadcast::Sender<Arc<Message>>,
}

impl Default for Scene {
    /// The memory of the rows is taken, and touched, now, so that it stays the same however long a stream runs.
    fn default() -> Self {
        let mut rows = VecDeque::from(vec![Row::EMPTY; ROWS]);
        rows.clear();
        Self::of(Kept::of(rows))
    }
}

impl Scene {
    fn of(kept: Kept) -> Self {
        Self { kept: Arc::new(Mutex::new(kept)), pages: broadcast::channel(WAITING).0 }
    }

    /// One that keeps no rows and takes no memory for them.
    #[must_use]
    pub fn without_rows() -> Self {
        Self::of(Kept::of(VecDeque::new()))
    }

    /// Whether a page is open.
    #[must_use]
    pub fn is_watched(&self) -> bool {
        self.pages.receiver_count() > 0
    }

    /// What is kept. A thread that panicked while it held it left nothing half done that matters here.
    pub fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// New steps of motion.
    pub fn move_on(&self, steps: Vec<Step>) {
        if steps.is_empty() {
            return;
        }
        let mut kept = self.kept();
        self.tell("steps", &steps);
        // A source that began anew.
        if kept.steps.back().zip(steps.first()).is_some_and(|(old, new)| new.t <= old.t) {
            kept.steps.clear();
        }
        kept.steps.extend(steps);
        let surplus = kept.steps.len().saturating_sub(STEPS);
        kept.steps.drain(..surplus);
    }

    /// Rows of the source, for the export; they are taken out of `rows`.
    pub fn keep_rows(&self, rows: &mut Vec<Row>) {
        let mut kept = self.kept();
        let surplus = (kept.rows.len() + rows.len()).saturating_sub(ROWS).min(kept.rows.len());
        kept.rows.drain(..surplus);
        if kept.rows.back().zip(rows.first()).is_some_and(|(old, new)| new.t_ns <= old.t_ns) {
            kept.rows.clear();
        }
        kept.rows.extend(rows.drain(..));
    }

    /// A change of the model.
    pub fn mark(&self, mark: Mark) {
        let mut kept = self.kept();
        self.tell("mark", &mark);
        kept.marks.push_back(mark);
        let surplus = kept.marks.len().saturating_sub(MARKS);
        kept.marks.drain(..surplus);
    }

    /// The judgement of a second.
    pub fn judge(&self, error: ErrorAt) {
        let mut kept = self.kept();
        self.tell("judged", &error);
        kept.errors.push_back(error);
        let surplus = kept.errors.len().saturating_sub(ERRORS);
        kept.errors.drain(..surplus);
    }

    /// Parameters at a time.
    pub fn learn(&self, parameters: ParametersAt) {
        let mut kept = self.kept();
        self.tell("values", &parameters);
        kept.parameters.push_back(parameters);
        let surplus = kept.parameters.len().saturating_sub(PARAMETERS);
        kept.parameters.drain(..surplus);
    }

    /// Something of which only the newest counts; pages hear of it where it has changed.
    pub fn now(&self, event: &'static str, value: &impl Serialize) {
        let Ok(value) = serde_json::to_value(value) else { return };
        let mut kept = self.kept();
        if kept.newest.get(event) == Some(&value) {
            return;
        }
        self.tell(event, &value);
        kept.newest.insert(event, value);
    }

    /// For pages that are open; called with what is kept in hand, so that a page that opens gets it once, here or there.
    fn tell(&self, event: &'static str, value: &impl Serialize) {
        if self.pages.receiver_count() > 0
            && let Ok(data) = serde_json::to_string(value)
        {
            // Nobody listening any more is no error.
            let _ = self.pages.send(Arc::new(Message { event, data }));
        }
    }

    /// Everything for a new page, and what comes from then on.
    #[must_use]
    pub fn open(&self) -> (Message, broadcast::Receiver<Arc<Message>>) {
        let kept = self.kept();
        let receiver = self.pages.subscribe();
        let whole = json!({
            "steps": kept.steps, "errors": kept.errors, "values": kept.parameters, "marks": kept.marks,
            "newest": kept.newest,
        });
        (Message { event: "whole", data: whole.to_string() }, receiver)
    }

    /// The last minutes as a log.
    #[must_use]
    pub fn record(&self, free_names: Vec<String>) -> Record {
        Record { rows: self.kept().rows.iter().copied().collect(), free_names, ..Record::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_stays_bounded_and_the_newest_survives() {
        let scene = Scene::default();
        for k in 0..3000 {
            scene.move_on(vec![Step { t: f64::from(k), axes: Default::default() }]);
            scene.keep_rows(&mut vec![Row { t_ns: i64::from(k), ..Row::EMPTY }; 100]);
        }
        let kept = scene.kept();
        assert_eq!(kept.steps.len(), STEPS);
        assert!(kept.rows.len() <= ROWS, "{}", kept.rows.len());
        assert_eq!(kept.steps.back().unwrap().t, 2999.0);
    }

    #[test]
    fn a_new_page_gets_everything_and_then_what_changes() {
        let scene = Scene::default();
        scene.now("status", &1);
        let (whole, mut pages) = scene.open();
        assert!(whole.data.contains("\"status\":1"), "{}", whole.data);
        scene.now("status", &1);
        scene.now("status", &2);
        assert_eq!(pages.try_recv().unwrap().data, "2");
        assert!(pages.try_recv().is_err());
    }

    #[test]
    fn a_source_that_begins_anew_begins_a_new_picture() {
        let scene = Scene::default();
        scene.move_on(vec![Step { t: 50.0, axes: Default::default() }]);
        scene.move_on(vec![Step { t: 0.05, axes: Default::default() }]);
        assert_eq!(scene.kept().steps.len(), 1);
    }
}
