//! Which candidates of the score test are refitted exactly, and in which order they stand.

use super::{
    Options,
    bounds::is_seen_from_one_side,
    challenger::{Challenger, Incumbent},
    comparison::{drop_driven, drop_seen_from_one_side, prefer_plainer, rank, take_smoothed_counts},
};
use crate::{
    effects::{Effect, Stage, Trait, are_aliases},
    evidence::series::Series,
    parallel,
    scan::{Candidate, can_show, is_near},
    thresholds as limit,
};
use itertools::Itertools;

/// How many suspects of an axis are refitted exactly, by either measure: of an axis alone, and of one of several.
const LEADERS: usize = 5;
const LEADERS_OF_SEVERAL: usize = 3;

impl<'a> Incumbent<'a> {
    /// The suspects of this model, refitted, axis by axis, best first.
    #[must_use]
    pub(crate) fn suspects(&self, options: &Options) -> Vec<Challenger<'a>> {
        let all = self.scanned(options);
        let axes = self.study.bench.problem.series.len();
        let most = if axes > 1 { LEADERS_OF_SEVERAL } else { LEADERS };
        let of = |k: usize| all.iter().filter(|c| c.series == k).cloned().collect::<Vec<_>>();
        let list: Vec<Candidate> = (0..axes).flat_map(|k| leaders(of(k), most)).collect();
        (options.progress)(&list.iter().map(|c| c.term.effect.card().id).collect::<Vec<_>>().join(", "));
        let (first, rest): (Vec<Candidate>, Vec<Candidate>) = promising(list, axes);
        let refitted = |list: &[Candidate]| -> Vec<Challenger<'a>> {
            let refit = |(start, each): &(Candidate, Vec<Candidate>)| match each.as_slice() {
                _ if (options.stop)() => Vec::new(),
                [_] => vec![self.refit(start.clone())],
                several => self.refit_throughout(start, several.to_vec()),
            };
            parallel::map(&self.trials(list), refit).concat()
        };
        let mut left = refitted(&first);
        // What cannot come near the best by either measure is not refitted, unless it may be taken for it.
        let rest: Vec<Candidate> =
            rest.into_iter().filter(|c| self.may_win(c, &left) || is_alias_of_best(c, &left)).collect();
        left.extend(refitted(&rest));
        left.extend(refitted(&self.simpler(&left, options)));
        let series = &self.study.bench.problem.series;
        left.retain(|r| !is_seen_from_one_side(&r.candidate.term, &series[r.candidate.series]));
        let mut challengers = Vec::new();
        for k in 0..axes {
            let mut own = left.extract_if(.., |r| r.candidate.series == k).collect();
            drop_driven(&mut own);
            drop_seen_from_one_side(&mut own, self);
            let mut unlikely = take_smoothed_counts(&mut own);
            rank(&mut own);
            prefer_plainer(&mut own, self);
            challengers.append(&mut own);
            challengers.append(&mut unlikely);
        }
        // Of one effect, the best that is not at the end of what is physical: from another start it may be.
        let key = |r: &Challenger| (r.candidate.series, r.candidate.term.effect.card().id);
        let is_best = |k: usize| {
            let own: Vec<usize> =
                (0..challengers.len()).filter(|&i| key(&challengers[i]) == key(&challengers[k])).collect();
            own.iter().find(|&&i| !challengers[i].at_bound()).or(own.first()) == Some(&k)
        };
        let mut best = (0..challengers.len()).map(is_best).collect::<Vec<bool>>().into_iter();
        challengers.retain(|_| best.next() == Some(true));
        challengers
    }

    /// The simpler effects that those contain of which this log does not show every parameter.
    fn simpler(&self, fitted: &[Challenger], options: &Options) -> Vec<Candidate> {
        let is_fitted = |series: usize, id: &str| {
            fitted.iter().any(|r| r.candidate.series == series && r.candidate.term.effect.card().id == id)
        };
        let unknown = fitted.iter().filter(|r| {
            !r.candidate.term.effect.card().simpler.is_empty() && (r.at_bound() || r.doubt() >= limit::KNOWN.value)
        });
        let wanted =
            unknown.flat_map(|r| r.candidate.term.effect.card().simpler.iter().map(|id| (r.candidate.series, *id)));
        let open = wanted.unique().filter(|(series, id)| !is_fitted(*series, id));
        let of = |(series, id): (usize, &str)| {
            let own = self.scanned(options).iter().filter(move |c| c.series == series && c.term.effect.card().id == id);
            own.max_by(|a, b| a.score.total_cmp(&b.score)).cloned()
        };
        open.filter_map(of).collect()
    }

    /// Where the trials of these candidates begin, and which candidates each of them judges: on the axes of an orientation what a whole sensor
    /// has is one model, tried from the likeliest start and from that which removes most.
    fn trials(&self, list: &[Candidate]) -> Vec<(Candidate, Vec<Candidate>)> {
        let (whole, single): (Vec<&Candidate>, Vec<&Candidate>) = list.iter().partition(|c| self.joins_throughout(c));
        let mut trials: Vec<_> = single.into_iter().map(|one| (one.clone(), vec![one.clone()])).collect();
        let by_id = whole.into_iter().into_group_map_by(|c| c.term.effect.card().id);
        for own in by_id.into_values().sorted_by_key(|own| own[0].term.effect.card().id) {
            let starts = own.iter().max_by(|a, b| a.score.total_cmp(&b.score)).into_iter();
            let starts = starts.chain(own.iter().max_by(|a, b| a.removes.total_cmp(&b.removes)));
            let each: Vec<Candidate> = own.iter().unique_by(|c| c.series).map(|c| (*c).clone()).collect();
            let apart = starts.dedup_by(|a, b| is_near(&a.term, &b.term));
            trials.extend(apart.map(|start| ((*start).clone(), each.clone())));
        }
        trials
    }

    /// Whether a candidate of one axis joins on all axes of an orientation, none of which has anything of the kind.
    fn joins_throughout(&self, candidate: &Candidate) -> bool {
        let problem = &self.study.bench.problem;
        let has_none = |s: &Series| {
            let own = self.study.model.axes[s.axis.index()].as_ref();
            own.is_none_or(|own| !own.terms.iter().any(|t| t.effect.is_like(candidate.term.effect)))
                && can_show(candidate.term.effect, s)
        };
        candidate.term.effect.joins_throughout() && problem.attitude().is_some() && problem.series.iter().all(has_none)
    }

    /// Whether an exact refit of this candidate may come near the best of those fitted so far, by the error or by the
    /// likelihood.
    fn may_win(&self, candidate: &Candidate, fitted: &[Challenger]) -> bool {
        let own = || fitted.iter().filter(|r| r.candidate.series == candidate.series && !r.at_bound());
        let least = own().map(|r| r.excess).fold(f64::INFINITY, f64::min);
        let most = own().map(|r| r.rise).filter(|rise| rise.is_finite()).fold(0.0, f64::max);
        let left = limit::GRID.value * (1.0 - candidate.removes) * self.excess(candidate.series);
        // What a whole sensor has is scanned on one axis, and fitted on all.
        let is_scanned_in_part = candidate.term.effect.joins_throughout() && self.study.bench.problem.series.len() > 1;
        let is_read_off = candidate.term.effect.stage() == Stage::Reading;
        // A clock that was set holds a plain error of the times, and may stand in for it: only an exact refit tells.
        let is_held = is_of_times(candidate) && own().any(|r| is_of_times(&r.candidate) && begins(&r.candidate));
        is_read_off || is_scanned_in_part || is_held || left < least || candidate.score > limit::GRID.value * most
    }

    /// Whether an effect that the model does not have would be let in on any of its axes.
    pub(super) fn may_lack(&self, effect: &'static dyn Effect) -> bool {
        let series = &self.study.bench.problem.series;
        let scanner = self.scanner();
        let own = (0..series.len()).filter(|&k| can_show(effect, &series[k]));
        let mut promising = own.flat_map(|k| scanner.best(effect, k)).filter(|c| lowers(c) || shows(c));
        promising.any(|candidate| self.refit(candidate).passes(self))
    }
}

/// Whether the catalogue says that a candidate may be taken for the best of those fitted so far, and the score test finds it nearly as
/// likely. Not of a reference that is smoothed: what it takes out of the noise besides makes it the likelier one.
fn is_alias_of_best(candidate: &Candidate, fitted: &[Challenger]) -> bool {
    let own = fitted.iter().filter(|r| r.candidate.series == candidate.series && !r.at_bound());
    own.min_by(|a, b| a.excess.total_cmp(&b.excess)).is_some_and(|best| {
        are_aliases(best.candidate.term.effect.card().id, candidate.term.effect.card().id)
            && candidate.score > NEARLY * best.candidate.score
            && candidate.term.effect.stage() != Stage::Shown
    })
}

/// Share of the score of the best suspect that is nearly as much.
const NEARLY: f64 = 0.9;

fn is_of_times(candidate: &Candidate) -> bool {
    candidate.term.effect.stage() == Stage::Timing
}

fn begins(candidate: &Candidate) -> bool {
    candidate.term.effect.is(Trait::Onset)
}

/// The candidates of each axis that promise most, by either measure, and the rest.
fn promising(list: Vec<Candidate>, axes: usize) -> (Vec<Candidate>, Vec<Candidate>) {
    let mut first = vec![false; list.len()];
    for axis in 0..axes {
        for by in [|c: &Candidate| c.removes, |c: &Candidate| c.score] {
            let own = (0..list.len()).filter(|&k| list[k].series == axis && !first[k]);
            if let Some(best) = own.max_by(|&a, &b| by(&list[a]).total_cmp(&by(&list[b]))) {
                first[best] = true;
            }
        }
    }
    // What is one model on all axes is fitted but once.
    let one_model = |c: &Candidate| axes > 1 && c.term.effect.joins_throughout();
    for k in 0..list.len() {
        let id = list[k].term.effect.card().id;
        first[k] |= one_model(&list[k]) && (0..list.len()).any(|j| first[j] && list[j].term.effect.card().id == id);
    }
    let (first, rest): (Vec<_>, Vec<_>) = list.into_iter().zip(first).partition(|(_, first)| *first);
    let only = |list: Vec<(Candidate, bool)>| list.into_iter().map(|(candidate, _)| candidate).collect();
    (only(first), only(rest))
}

/// Whether the scan promises that an effect lowers the error.
fn lowers(candidate: &Candidate) -> bool {
    candidate.removes > limit::PROMISES.value
}

/// Whether the likelihood notices an effect.
fn shows(candidate: &Candidate) -> bool {
    candidate.score - candidate.freedom as f64 > limit::NOTICEABLE.value
}

/// The suspects that are worth an exact refit: first by the error that they remove, and by likelihood.
fn leaders(mut list: Vec<Candidate>, most: usize) -> Vec<Candidate> {
    list.sort_by(|a, b| b.removes.total_cmp(&a.removes));
    let mut chosen: Vec<Candidate> = list.extract_if(.., |c| lowers(c)).collect();
    list.extend(chosen.drain(most.min(chosen.len())..));
    list.retain(shows);
    list.sort_by(|a, b| b.score.total_cmp(&a.score));
    list.truncate(most);
    chosen.extend(list);
    chosen
}
