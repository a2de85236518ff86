//! The search: forward selection with look-ahead and exchange, backward elimination, pruning.
//!
//! ```text
//! forward      the best suspect that passes every test of admission joins, one at a time; on several axes, alike on all
//! exchange     an effect of the model gives way to one that it may be taken for, where that leaves less
//! look-ahead   where no single suspect passes: two or three that hide one another, on trial
//! backward     each effect that is no longer needed goes
//! exchange     each effect once more beside those that it could not be told from
//! pruning      what the final model does not tell from nothing goes (Wald test)
//! simplifying  what has a parameter that the log does not show gives way to the simpler effect that it contains
//! chance       what a random cause explains as well goes
//! ```

mod backward;
mod chance;
mod exchange;
mod forward;
mod lookahead;
mod pair;
mod prune;
mod simplify;

pub(super) use backward::without;
pub(super) use exchange::Alike;
pub(super) use lookahead::look_ahead;
pub(super) use simplify::simplified;

use super::{
    Options,
    challenger::{Challenger, Incumbent},
    comparison::aliases,
    explain::explained,
};
use crate::{
    Axis, Model,
    budget::Budget,
    diagnosis::LadderStep,
    effects::Stage,
    evidence::{
        study::{Bench, Study},
        whiten::NoiseModel,
    },
    fit::judged::{self, Judged},
    scan::{Candidate, with_term},
    thresholds as limit,
};
use exchange::{Swapped, exchange, settle_doubts};
use forward::{companion, next};

/// A change of the model on the way up; neither added nor removed: where it began.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// Index into the problem's series.
    pub series: usize,
    /// What came in.
    pub added: Option<&'static str>,
    /// What went.
    pub removed: Option<&'static str>,
    /// What the log could not tell it from.
    pub aliases: Vec<String>,
}

impl Change {
    pub(super) fn of(series: usize, added: Option<&'static str>, removed: Option<&'static str>) -> Self {
        Self { series, added, removed, aliases: Vec::new() }
    }

    /// As reported.
    pub(super) fn step(&self, judged: &Judged) -> LadderStep {
        LadderStep {
            added: self.added.map(str::to_owned),
            removed: self.removed.map(str::to_owned),
            aliases: self.aliases.clone(),
            error_curve: judged.points(),
            error_over_floor: judged::finite(judged.over_floor()),
        }
    }
}

impl LadderStep {
    /// The same over the floor of the set-up as it is.
    pub(super) fn on(&mut self, budget: &Budget) {
        budget.raise_points(&mut self.error_curve);
        let ratios = self.error_curve.iter().filter_map(|point| Some(point.error? / point.floor?));
        self.error_over_floor = judged::finite(ratios.fold(0.0, f64::max));
    }
}

/// What an effect could not be told from when it came in.
pub(super) struct Doubt {
    series: usize,
    id: &'static str,
    aliases: Vec<String>,
}

/// Where a search ended.
pub(super) struct Top<'a> {
    /// The model there.
    pub incumbent: Incumbent<'a>,
    /// What it was not worth while to add.
    pub last: Vec<Challenger<'a>>,
    /// What its effects may as well be.
    pub alike: Vec<Alike>,
}

/// A search under way.
struct Search<'a, 'o> {
    start: &'o Model,
    options: &'o Options<'o>,
    axes: Vec<Axis>,
    incumbent: Incumbent<'a>,
    /// Its suspects, where they are known.
    suspects: Option<Vec<Challenger<'a>>>,
    doubts: Vec<Doubt>,
    /// What went because this log does not show it, or not all of its parameters, by axis: it does not come in again.
    unknown: Vec<(usize, &'static str)>,
    /// Told of each change, the model with it fitted.
    took: &'o mut dyn FnMut(&Study, Change),
}

/// Runs every stage; `took` is told of each change, the model with it fitted.
pub(super) fn search<'a>(
    bench: &'a Bench,
    start: &Model,
    options: &Options,
    took: &mut dyn FnMut(&Study, Change),
) -> Top<'a> {
    let incumbent = Incumbent::new(Study::fit(bench, start, None));
    (0..bench.problem.series.len()).for_each(|k| took(&incumbent.study, Change::of(k, None, None)));
    search_on(incumbent, None, start, options, took)
}

/// The same from a model that is fitted already, whose suspects may be known.
pub(super) fn search_on<'a>(
    incumbent: Incumbent<'a>,
    suspects: Option<Vec<Challenger<'a>>>,
    start: &Model,
    options: &Options,
    took: &mut dyn FnMut(&Study, Change),
) -> Top<'a> {
    let axes: Vec<Axis> = incumbent.study.bench.problem.series.iter().map(|s| s.axis).collect();
    let mut search =
        Search { start, options, axes, incumbent, suspects, doubts: Vec::new(), unknown: Vec::new(), took };
    let mut left = options.steps * search.axes.len();
    for _ in 0..TURNS {
        let last = search.forward_to_the_end(&mut left);
        if (options.stop)() {
            return Top { incumbent: search.incumbent, last, alike: Vec::new() };
        }
        let before = search.errors();
        let alike = search.look_back();
        // What leaves rows out hides what they show: once it is gone, more may be missing.
        let shows = |(now, before): (&f64, &f64)| *now > limit::NOISE.value && *now > limit::CLOSE.value * before;
        if !search.errors().iter().zip(&before).any(shows) {
            return search.ended(last, alike);
        }
    }
    let last = search.forward_to_the_end(&mut left);
    let alike = search.look_back();
    search.ended(last, alike)
}

/// Times that a search goes forward and back where the way back uncovers an error.
const TURNS: usize = 2;

/// What one round came to.
enum Forward<'a> {
    Changed,
    /// Nothing more is to be added: of these suspects, none is worth while.
    Ended(Vec<Challenger<'a>>),
}

impl<'a> Search<'a, '_> {
    /// Rounds forward until nothing more is to be added, or no step is left; the suspects of the last one.
    fn forward_to_the_end(&mut self, left: &mut usize) -> Vec<Challenger<'a>> {
        while *left > 0 {
            *left -= 1;
            if let Forward::Ended(suspects) = self.forward() {
                return suspects;
            }
        }
        Vec::new()
    }

    /// J of each axis.
    fn errors(&self) -> Vec<f64> {
        (0..self.axes.len()).map(|k| self.incumbent.excess(k)).collect()
    }

    /// One round forward: an exchange where one leaves less, else the best suspect, else what a look ahead finds.
    fn forward(&mut self) -> Forward<'a> {
        let mut suspects = self.suspects.take().unwrap_or_else(|| self.incumbent.suspects(self.options));
        suspects.retain(|r| !self.unknown.contains(&(r.candidate.series, r.candidate.term.effect.card().id)));
        if self.options.explain {
            for (k, &axis) in self.axes.iter().enumerate() {
                (self.options.looked)(axis, &explained(&self.incumbent, &suspects, k, self.options));
            }
        }
        if (self.options.stop)() {
            return Forward::Ended(suspects);
        }
        let chosen = next(&self.incumbent, &suspects);
        let stands_beside = |k: usize| self.incumbent.other_zero_than(&suspects[k]).is_none();
        if chosen.is_some_and(|k| !stands_beside(k)) {
            return Forward::Ended(suspects);
        }
        if let Some((swapped, study)) = self.exchanged(chosen.map(|k| &suspects[k])) {
            let warm = self.incumbent.study.warm.clone();
            let study = Study::fit(study.bench, &study.model, Some(&warm));
            self.incumbent = Incumbent::near(study, &self.incumbent.gls.noise);
            self.tell_of(swapped);
        } else if let Some(chosen) = chosen {
            self.add(&suspects, chosen);
        } else if let Some(way) = look_ahead(&self.incumbent, &suspects, self.options) {
            for step in way {
                self.doubts.push(Doubt { series: 0, id: step.id, aliases: step.aliases.clone() });
                let change = Change { aliases: step.aliases, ..Change::of(0, Some(step.id), None) };
                (self.took)(&step.incumbent.study, change);
                self.incumbent = step.incumbent;
            }
        } else {
            return Forward::Ended(suspects);
        }
        Forward::Changed
    }

    /// What came first was told from its aliases while much else was missing: one of them in its place may leave less than the
    /// suspect that is next, or by a tenth less where none is.
    fn exchanged(&self, next: Option<&Challenger>) -> Option<(Vec<Swapped>, Study<'a>)> {
        let asked = match next {
            Some(refit) if refit.candidate.term.effect.stage() == Stage::Reading => return None,
            Some(refit) => vec![(refit.candidate.series, refit.excess)],
            None => self.errors().iter().map(|error| (1.0 - limit::SHARE.value) * error).enumerate().collect(),
        };
        exchange(&self.incumbent, self.start, &asked, self.options)
    }

    /// Adds a suspect, and the same on other axes that have it too.
    fn add(&mut self, suspects: &[Challenger<'a>], chosen: usize) {
        let Candidate { series, ref term, .. } = suspects[chosen].candidate;
        let id = term.effect.card().id;
        let aliases = aliases(suspects, chosen, Some(&self.incumbent));
        self.doubts.push(Doubt { series, id, aliases: aliases.clone() });
        self.take_over(&with_term(&self.incumbent.study, series, term.clone()), &suspects[chosen].gls.noise);
        let mut changes = vec![Change { aliases, ..Change::of(series, Some(id), None) }];
        for other in (0..self.axes.len()).filter(|&other| other != series) {
            if let Some(with) = companion(&self.incumbent, term, series, other) {
                self.take_over(&with, &self.incumbent.gls.noise.clone());
                changes.push(Change::of(other, Some(id), None));
            }
        }
        // Axes of one orientation carry their errors into one another's: what all have is judged once all have it.
        for change in changes {
            (self.took)(&self.incumbent.study, change);
        }
    }

    /// Backward elimination, exchange, pruning; what the effects at the top may as well be.
    fn look_back(&mut self) -> Vec<Alike> {
        self.eliminate();
        let (incumbent, swapped, alike) = settle_doubts(self.incumbent.clone(), self.start, &self.doubts, self.options);
        self.incumbent = incumbent;
        self.tell_of(swapped);
        let settled = self.prune();
        self.simplify(settled);
        alike
    }

    /// The top. What a random cause explains as well goes last: the search forward, which knows of none, would add it again.
    fn ended(mut self, last: Vec<Challenger<'a>>, alike: Vec<Alike>) -> Top<'a> {
        self.face_chance();
        Top { incumbent: self.incumbent, last, alike }
    }

    fn take_over(&mut self, model: &Model, noise: &NoiseModel) {
        let Study { bench, ref warm, .. } = self.incumbent.study;
        self.incumbent = Incumbent::near(Study::fit(bench, model, Some(warm)), noise);
    }

    fn tell_of(&mut self, swapped: Vec<Swapped>) {
        for Swapped { series, old, new } in swapped {
            (self.took)(&self.incumbent.study, Change::of(series, Some(new), Some(old)));
        }
    }
}

/// What was added to the model that the ladder began with, in the order of adding.
pub(super) fn added(incumbent: &Incumbent, start: &Model, axis: Axis) -> Vec<&'static str> {
    let kept = judged::axis_model(start, axis).effect_ids();
    let now = judged::axis_model(&incumbent.study.model, axis).effect_ids();
    now.into_iter().filter(|id| !kept.contains(id)).collect()
}
