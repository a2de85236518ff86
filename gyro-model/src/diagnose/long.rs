//! Logs too long to be searched whole: sought in parts, judged on the whole.
//!
//! What is slow or large shows in the whole log at less detail (means over blocks, [`crate::thin`]); what is fast shows
//! in one stretch of it at full detail, the one that turns most. What either shows is fitted to every row, and the model's
//! parameters and errors are reported from there; a suspect that was not added is reported as its part shows it.

use super::{
    Options,
    judged::Judged,
    ladder,
    refit::{Present, Refit},
    search::{Change, search},
};
use crate::{
    Axis, Model, Record,
    diagnosis::AxisLadder,
    evidence::study::{Bench, Study},
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
pub struct Parts {
    /// The whole at less detail.
    thin: Bench,
    /// The stretch that turns most, in full.
    stretch: Bench,
}

impl Parts {
    /// `None` where the log is not long, or too little of it is left in a part.
    #[must_use]
    pub fn new(record: &Record, bench: &Bench, model: &Model) -> Option<Self> {
        if record.len() <= LONG {
            return None;
        }
        let axes = axes(bench);
        let mut stretch = Bench::new(&busiest(record, &axes), &axes, model)?;
        stretch.know(&bench.prior);
        let mut thin = thin(record, &axes, model)?;
        (thin.problem.held_rate, stretch.problem.held_rate) = (bench.problem.held_rate, bench.problem.held_rate);
        Some(Self { thin, stretch })
    }

    /// Both.
    #[must_use]
    pub fn each(&self) -> [&Bench; 2] {
        [&self.thin, &self.stretch]
    }

    /// A model fitted to every row of the log, begun from its thinned fit.
    #[must_use]
    pub fn fit<'a>(&self, bench: &'a Bench, model: &Model) -> Study<'a> {
        Study::fit(bench, &Study::fit(&self.thin, model, None).model, None)
    }

    /// The model fitted to each part, and the suspects there.
    #[must_use]
    pub fn suspects(&self, model: &Model, options: &Options) -> [(Present<'_>, Vec<Refit<'_>>); 2] {
        self.each().map(|part| {
            let present = Present::new(Study::fit(part, model, None));
            let suspects = present.suspects(options);
            (present, suspects)
        })
    }

    /// The ladder of axes that share a reference.
    #[must_use]
    pub fn climb(&self, record: &Record, bench: &Bench, start: &Model, options: &Options) -> (Model, Vec<AxisLadder>) {
        let axes = axes(bench);
        let mut rungs: Vec<(Model, Change)> = Vec::new();
        let tell = |study: &Study, change: &Change| {
            let step = change.step(&Judged::new(study, change.series, false));
            (options.took)(axes[change.series], &step);
        };
        let slow = search(&self.thin, start, options, &mut |study, change| {
            tell(study, &change);
            rungs.push((study.model.clone(), change));
        });
        let known = slow.present.study.model.clone();
        let fast = search(&self.stretch, &known, options, &mut |study, change| {
            if change.added.is_some() || change.removed.is_some() {
                tell(study, &change);
                rungs.push((joined(&known, &study.model, &axes), change));
            }
        });
        (options.progress)("the whole log");
        let found = joined(&known, &fast.present.study.model, &axes);
        let present = Present::new(Study::fit(bench, &found, None));
        let mut steps = vec![Vec::new(); axes.len()];
        for (k, (model, change)) in rungs.iter().enumerate() {
            let study = if k + 1 == rungs.len() { present.study.clone() } else { Study::held(bench, model) };
            steps[change.series].push(change.step(&Judged::new(&study, change.series, false)));
        }
        ladder::note(&mut steps, &slow.alike);
        ladder::note(&mut steps, &fast.alike);
        ladder::conclude(record, &present, (&slow.present, &slow.last), &steps, options)
    }
}

fn axes(bench: &Bench) -> Vec<Axis> {
    bench.problem.series.iter().map(|s| s.axis).collect()
}

/// `model` with the terms that `other` has besides.
fn joined(model: &Model, other: &Model, axes: &[Axis]) -> Model {
    let mut joined = model.clone();
    for axis in axes {
        if let (Some(own), Some(other)) = (&mut joined.axes[axis.index()], &other.axes[axis.index()]) {
            let new = |id: &str| !own.effect_ids().contains(&id);
            let more: Vec<_> = other.terms.iter().filter(|t| new(t.effect.card().id)).cloned().collect();
            own.terms.extend(more);
        }
    }
    joined
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

/// A log laid out at less detail where it is long.
#[must_use]
pub(crate) fn brief(record: &Record, axes: &[Axis], model: &Model) -> Option<Bench> {
    if record.len() > LONG { thin(record, axes, model) } else { Bench::new(record, axes, model) }
}

/// Fits a model to the means over blocks first where a log is long: what is left to do on every row is little.
#[must_use]
pub(crate) fn begun(record: &Record, bench: &Bench, model: &Model) -> Model {
    let thin = (record.len() > LONG).then(|| thin(record, &axes(bench), model)).flatten();
    thin.map_or_else(
        || model.clone(),
        |mut thin| {
            thin.problem.held_rate = bench.problem.held_rate;
            Study::fit(&thin, model, None).model
        },
    )
}
