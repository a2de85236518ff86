//! The parts of a log that is too long to be searched or fitted whole at once.
//!
//! What is slow or large shows in the whole log at less detail (means over blocks, [`crate::thin`]); what is fast shows
//! in one stretch of it at full detail, the one that turns most.

use crate::{
    Axis, Model, Record,
    evidence::study::{Bench, Study},
    parallel,
    thin::thinned,
};

/// Rows beyond which a log is long.
pub const LONG: usize = 120_000;
/// Rows of a stretch, and of a thinned log at least and at most.
const STRETCH: usize = 30_000;
const THINNED: (f64, f64) = (30_000.0, 60_000.0);
/// Rows a second that a log is thinned to: a delay of some milliseconds still moves a turn's edge.
const RATE: f64 = 20.0;

/// The parts of a long log.
pub(crate) struct Parts {
    /// The whole at less detail.
    pub(crate) thin: Bench,
    /// The stretch that turns most, in full.
    pub(crate) stretch: Bench,
}

impl Parts {
    /// `None` where the log is not long, or too little of it is left in a part.
    #[must_use]
    pub(crate) fn new(record: &Record, bench: &Bench, model: &Model) -> Option<Self> {
        if record.len() <= LONG {
            return None;
        }
        let axes = bench.axes();
        let (stretch, thin) = parallel::both(
            || Bench::new(&busiest(record, &axes), &axes, model),
            || bench.thin(model, || thin(record, &axes, model)),
        );
        let (mut stretch, mut thin) = (stretch?, thin?);
        stretch.know(&bench.prior);
        (thin.problem.held_rate, stretch.problem.held_rate) = (bench.problem.held_rate, bench.problem.held_rate);
        Some(Self { thin, stretch })
    }

    /// Both.
    #[must_use]
    pub(crate) fn each(&self) -> [&Bench; 2] {
        [&self.thin, &self.stretch]
    }

    /// A model fitted to every row of the log, begun from its thinned fit.
    #[must_use]
    pub(crate) fn fit<'a>(&self, bench: &'a Bench, model: &Model) -> Study<'a> {
        Study::fit(bench, &Study::fit(&self.thin, model, None).model, None)
    }
}

/// The stretch in which these axes turn most.
fn busiest(record: &Record, axes: &[Axis]) -> Record {
    let rows = &record.rows;
    let turning = |k: usize| -> f64 {
        axes.iter().map(|a| rows[k].gyro[a.index()]).filter(|g| g.is_finite()).map(|g| g * g).sum()
    };
    let mut sum: f64 = (0..STRETCH).map(turning).sum();
    let (mut best, mut first) = (sum, 0);
    for end in STRETCH..rows.len() {
        sum += turning(end) - turning(end - STRETCH);
        if sum > best {
            (best, first) = (sum, end + 1 - STRETCH);
        }
    }
    record.part(first..first + STRETCH)
}

/// The whole at less detail.
fn thin(record: &Record, axes: &[Axis], model: &Model) -> Option<Bench> {
    let seconds = (record.rows.last()?.t_ns - record.rows.first()?.t_ns) as f64 * 1e-9;
    let rows = (RATE * seconds).clamp(THINNED.0, THINNED.1);
    Bench::new(&thinned(record, rows as usize), axes, model)
}

/// A log laid out, and at less detail besides where it is long.
#[must_use]
pub(crate) fn laid(record: &Record, axes: &[Axis], model: &Model) -> Option<Bench> {
    let whole = || Bench::new(record, axes, model);
    if record.len() <= LONG {
        return whole();
    }
    let (thin, bench) = parallel::both(|| thin(record, axes, model), whole);
    Some(bench?.with_thin(thin))
}

/// A log laid out at less detail where it is long.
#[must_use]
pub(crate) fn brief(record: &Record, axes: &[Axis], model: &Model) -> Option<Bench> {
    if record.len() > LONG { thin(record, axes, model) } else { Bench::new(record, axes, model) }
}

/// Fits a model to the means over blocks first where a log is long: what is left to do on every row is little.
#[must_use]
pub(crate) fn begun(record: &Record, bench: &Bench, model: &Model) -> Model {
    let lay = || thin(record, &bench.axes(), model);
    let thin = (record.len() > LONG).then(|| bench.thin(model, lay)).flatten();
    thin.map_or_else(
        || model.clone(),
        |mut thin| {
            thin.problem.held_rate = bench.problem.held_rate;
            Study::fit(&thin, model, None).model
        },
    )
}
