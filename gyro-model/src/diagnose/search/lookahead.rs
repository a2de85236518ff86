//! Looking ahead where no single suspect passes: two or three effects that hide one another.
//!
//! Two may cancel in the error, so that it shows neither: all pairs are held against the residual at once, and the two of
//! which each says most beside the other are added on trial. And what one effect leaves unexplained is taken for noise while
//! another is judged, so that neither may pass alone: a few are then added on trial, the likeliest or the one that removes
//! most first. They stay only together: where the error comes down to what noise leaves, and each of them passes every test
//! beside the others.

use super::{
    super::{
        Options,
        bounds::size,
        challenger::{Challenger, Incumbent},
        comparison::aliases,
    },
    pair::beside_its_like,
    without,
};
use crate::{
    effects::Stage,
    evidence::study::Study,
    fit::judged::Judged,
    scan::{Candidate, with_term},
    thresholds as limit,
};

/// Effects that are added on trial at most.
const TRIED: usize = 3;

/// One effect on the way.
pub(in super::super) struct Step<'a> {
    /// The model with it.
    pub incumbent: Incumbent<'a>,
    /// What came in.
    pub id: &'static str,
    /// What the log could not tell it from.
    pub aliases: Vec<String>,
}

/// The steps of a way that holds; `None` where nothing of the kind is found. `suspects` are those of `incumbent`.
pub(in super::super) fn look_ahead<'a>(
    incumbent: &Incumbent<'a>,
    suspects: &[Challenger<'a>],
    options: &Options,
) -> Option<Vec<Step<'a>>> {
    if incumbent.study.bench.problem.series.len() > 1 {
        return None;
    }
    if incumbent.reachable(0, options) > limit::OUT_OF_REACH.value {
        return None;
    }
    if let Some(way) = two(incumbent, options) {
        return Some(way);
    }
    if !leaves_something(incumbent) && !suspects.iter().any(Challenger::is_no_chance) {
        return None;
    }
    let lowest = |list: &[Challenger]| best(list, |r| -r.excess);
    let likeliest = |list: &[Challenger]| best(list, |r| r.rise / r.inflation);
    let first = [lowest(suspects), likeliest(suspects)];
    let firsts = if first[0] == first[1] { &first[..1] } else { &first[..] };
    firsts.iter().flatten().find_map(|&first| {
        let mut way = vec![step(incumbent, suspects, first)];
        while way.len() < TRIED {
            let last = &way.last()?.incumbent;
            let list = last.suspects(options);
            let next = list.iter().position(|r| r.passes(last)).or_else(|| likeliest(&list))?;
            let next = step(last, &list, next);
            if beside_its_like(&next.incumbent.study, &next.incumbent.gls, 0, next.id) {
                break;
            }
            way.push(next);
            if holds(&way) {
                return Some(way);
            }
        }
        None
    })
}

/// Two effects that hide one another so well that the error shows neither: the lateness of a gyro and the play of its
/// encoder's gear, on a drive that turns at one rate.
fn two<'a>(incumbent: &Incumbent<'a>, options: &Options) -> Option<Vec<Step<'a>>> {
    let pair = incumbent.pair(0, options)?;
    let mut way: Vec<Step> = Vec::new();
    for candidate in pair {
        let last = way.last().map_or(incumbent, |step| &step.incumbent);
        let id = candidate.term.effect.card().id;
        (options.progress)(id);
        let model = with_term(&last.study, 0, candidate.term);
        let with = Incumbent::near(Study::fit(incumbent.study.bench, &model, Some(&last.study.warm)), &last.gls.noise);
        way.push(Step { incumbent: with, id, aliases: Vec::new() });
    }
    holds(&way).then_some(way)
}

impl Incumbent<'_> {
    /// J of an axis with everything that the scan found for it, to first order: the least that any of it together may leave.
    pub(super) fn reachable(&self, series: usize, options: &Options) -> f64 {
        let is_own = |c: &&Candidate| c.series == series && c.term.effect.stage() != Stage::Reading;
        let own: Vec<&Candidate> = self.scanned(options).iter().filter(is_own).collect();
        self.excess(series) * self.scanner().leaves(&own)
    }
}

/// Whether the error lies above what noise leaves: in the mean, or far at one averaging time.
fn leaves_something(incumbent: &Incumbent) -> bool {
    let (held, weights) = incumbent.study.held_out_about(0);
    let over = |(error, floor): (&f64, &f64)| error / floor > limit::ABOVE.value;
    incumbent.excess(0) > limit::NOISE.value || held.curve().iter().zip(&weights).any(over)
}

/// The suspect for which `worth` is largest, of those that stay within their bounds.
fn best(list: &[Challenger], worth: impl Fn(&Challenger) -> f64) -> Option<usize> {
    let inside = (0..list.len()).filter(|&k| !list[k].at_bound());
    inside.max_by(|&a, &b| worth(&list[a]).total_cmp(&worth(&list[b])))
}

fn step<'a>(incumbent: &Incumbent<'a>, suspects: &[Challenger<'a>], chosen: usize) -> Step<'a> {
    let Challenger { study, gls, .. } = &suspects[chosen];
    let study = Study::fit(incumbent.study.bench, &study.model, Some(&incumbent.study.warm));
    Step {
        incumbent: Incumbent::near(study, &gls.noise),
        id: suspects[chosen].candidate.term.effect.card().id,
        aliases: aliases(suspects, chosen, Some(incumbent)),
    }
}

/// Whether the last model leaves no more than noise and needs every effect of the way, none of them beyond what sensors have:
/// those that cancel may grow together as far as one likes.
fn holds(way: &[Step]) -> bool {
    let Some(last) = way.last().map(|step| &step.incumbent) else { return false };
    let axis = last.study.bench.problem.series[0].axis;
    // The floor's draws know what estimating costs where little is left to fit to, and what bridging does: beneath its band
    // throughout, an error is noise, whatever its mean.
    let judged = Judged::new(&last.study, 0, false);
    (judged.excess() < limit::NOISE.value || judged.within())
        && way.iter().all(|step| {
            without(last, &[axis], step.id).is_some_and(|(rest, term)| {
                let freedom = term.values.len();
                let candidate = Candidate { series: 0, term, score: 0.0, removes: 0.0, freedom };
                size(&candidate.term, axis) <= limit::OUTSIZED.value
                    && rest.refit_beside(candidate, &last.study.model).passes(&rest)
            })
        })
}
