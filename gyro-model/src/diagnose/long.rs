//! Logs too long to be searched whole: sought in parts, judged on the whole.
//!
//! What is slow or large shows in the whole log at less detail (means over blocks, [`crate::thin`]); what is fast shows
//! in one stretch of it at full detail, the one that turns most. What either shows is fitted to every row, and the model's
//! parameters and errors are reported from there; a suspect that was not added is reported as its part shows it.

use super::{
    Options,
    challenger::{Challenger, Incumbent},
    ladder,
    search::{Change, search, simplified},
};
use crate::{
    Axis, Model, Record,
    diagnosis::AxisResult,
    evidence::study::{Bench, Study},
    fit::{judged::Judged, parts::Parts},
};

impl Parts {
    /// The model fitted to each part, and the suspects there.
    #[must_use]
    pub(crate) fn suspects(&self, model: &Model, options: &Options) -> [(Incumbent<'_>, Vec<Challenger<'_>>); 2] {
        self.each().map(|part| {
            let incumbent = Incumbent::new(Study::fit(part, model, None));
            let suspects = incumbent.suspects(options);
            (incumbent, suspects)
        })
    }

    /// The ladder of axes that share a reference.
    #[must_use]
    pub(crate) fn climb(
        &self,
        record: &Record,
        bench: &Bench,
        start: &Model,
        options: &Options,
    ) -> (Model, Vec<AxisResult>) {
        let axes = bench.axes();
        let mut rungs: Vec<(Model, Change)> = Vec::new();
        let tell = |study: &Study, change: &Change| {
            let step = change.step(&Judged::new(study, change.series, false));
            (options.took)(axes[change.series], &step);
        };
        let slow = search(&self.thin, start, options, &mut |study, change| {
            tell(study, &change);
            rungs.push((study.model.clone(), change));
        });
        let known = slow.incumbent.study.model.clone();
        let fast = search(&self.stretch, &known, options, &mut |study, change| {
            if change.added.is_some() || change.removed.is_some() {
                tell(study, &change);
                rungs.push((joined(&known, &study.model, &axes), change));
            }
        });
        (options.progress)("the whole log");
        let found = joined(&known, &fast.incumbent.study.model, &axes);
        let mut incumbent = Incumbent::new(Study::fit(bench, &found, None));
        let fitted = incumbent.study.clone();
        // On the whole log a parameter may go where a part did not send it.
        let mut simpler = Vec::new();
        incumbent =
            simplified(incumbent, start, None, &mut |study, change| simpler.push((study.model.clone(), change)));
        let of_parts = rungs.len();
        rungs.extend(simpler);
        let mut steps = vec![Vec::new(); axes.len()];
        for (k, (model, change)) in rungs.iter().enumerate() {
            let study = match k {
                k if k + 1 == rungs.len() => incumbent.study.clone(),
                k if k + 1 == of_parts => fitted.clone(),
                _ => Study::held(bench, model),
            };
            steps[change.series].push(change.step(&Judged::new(&study, change.series, false)));
        }
        ladder::note(&mut steps, &slow.alike);
        ladder::note(&mut steps, &fast.alike);
        ladder::share(&mut steps);
        ladder::conclude(record, &incumbent, (&slow.incumbent, &slow.last), &steps, options)
    }
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
