//! Looking ahead where no single suspect passes: two or three effects that hide one another.
//!
//! Two may cancel in the error, so that it shows neither: all pairs are held against the residual at once, and the two of
//! which each says most beside the other are added on trial. And what one effect leaves unexplained is taken for noise while
//! another is judged, so that neither may pass alone: a few are then added on trial, the likeliest or the one that removes
//! most first. They stay only together: where the error comes down to what noise leaves, and each of them passes every test
//! beside the others.

use super::{
    candidates::{Candidate, with_term},
    gate::{UNEVEN, is_outsized},
    judged::Judged,
    ladder::{aliases, without},
    pair::beside_its_like,
    refit::{Present, Refit},
};
use crate::{effects::Effect, evidence::study::Study};

/// Effects that are added on trial at most.
const TRIED: usize = 3;

/// Where all suspects together leave more than this of J, by the linear scan, no three of them bring the error down to the noise
/// (J of 1.2): the look-ahead is left out. The margin is for shapes between two points of their grid.
const OUT_OF_REACH: f64 = 4.0;

/// One effect on the way.
pub(super) struct Step<'a> {
    /// The model with it.
    pub present: Present<'a>,
    /// What came in.
    pub id: &'static str,
    /// What the log could not tell it from.
    pub aliases: Vec<String>,
}

/// The steps of a way that holds; `None` where nothing of the kind is found. `suspects` are those of `present`.
pub(super) fn ahead<'a>(
    present: &Present<'a>,
    suspects: &[Refit<'a>],
    extra: &[&'static dyn Effect],
    progress: &(dyn Fn(&str) + Sync),
) -> Option<Vec<Step<'a>>> {
    if present.study.bench.problem.series.len() > 1 {
        return None;
    }
    if present.reachable(0, extra) > OUT_OF_REACH {
        return None;
    }
    if let Some(way) = two(present, extra, progress) {
        return Some(way);
    }
    if !leaves_something(present) && !suspects.iter().any(Refit::is_no_chance) {
        return None;
    }
    let lowest = |list: &[Refit]| best(list, |r| -r.excess);
    let likeliest = |list: &[Refit]| best(list, |r| r.rise / r.inflation);
    let first = [lowest(suspects), likeliest(suspects)];
    let firsts = if first[0] == first[1] { &first[..1] } else { &first[..] };
    firsts.iter().flatten().find_map(|&first| {
        let mut way = vec![step(present, suspects, first)];
        while way.len() < TRIED {
            let last = &way.last()?.present;
            let list = last.suspects(extra, progress);
            let next = list.iter().position(|r| r.passes(last)).or_else(|| likeliest(&list))?;
            let next = step(last, &list, next);
            if beside_its_like(&next.present.study, &next.present.gls, 0, next.id) {
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
fn two<'a>(
    present: &Present<'a>,
    extra: &[&'static dyn Effect],
    progress: &(dyn Fn(&str) + Sync),
) -> Option<Vec<Step<'a>>> {
    let pair = present.pair(0, extra)?;
    let mut way: Vec<Step> = Vec::new();
    for candidate in pair {
        let last = way.last().map_or(present, |step| &step.present);
        let id = candidate.term.effect.card().id;
        progress(id);
        let model = with_term(&last.study, 0, candidate.term);
        let with = Present::new(Study::fit(present.study.bench, &model, Some(&last.study.warm)));
        way.push(Step { present: with, id, aliases: Vec::new() });
    }
    holds(&way).then_some(way)
}

/// Whether the error lies above what noise leaves: in the mean, or far at one averaging time.
fn leaves_something(present: &Present) -> bool {
    let (held, weights) = present.study.held_out_about(0);
    let over = |(error, floor): (&f64, &f64)| error / floor > ABOVE;
    present.excess(0) > UNEVEN || held.curve().iter().zip(&weights).any(over)
}

/// Error over floor at one averaging time that is worth a look ahead.
const ABOVE: f64 = 1.4;

/// The suspect for which `worth` is largest, of those that stay within their bounds.
fn best(list: &[Refit], worth: impl Fn(&Refit) -> f64) -> Option<usize> {
    let inside = (0..list.len()).filter(|&k| !list[k].at_bound());
    inside.max_by(|&a, &b| worth(&list[a]).total_cmp(&worth(&list[b])))
}

fn step<'a>(present: &Present<'a>, suspects: &[Refit<'a>], chosen: usize) -> Step<'a> {
    let study = &suspects[chosen].study;
    Step {
        present: Present::new(Study::fit(present.study.bench, &study.model, Some(&present.study.warm))),
        id: suspects[chosen].candidate.term.effect.card().id,
        aliases: aliases(suspects, chosen, Some(present)),
    }
}

/// Whether the last model leaves no more than noise and needs every effect of the way, none of them beyond what sensors have:
/// those that cancel may grow together as far as one likes.
fn holds(way: &[Step]) -> bool {
    let Some(last) = way.last().map(|step| &step.present) else { return false };
    let axis = last.study.bench.problem.series[0].axis;
    // The floor's draws know what estimating costs where little is left to fit to, and what bridging does: beneath its band
    // throughout, an error is noise, whatever its mean.
    let judged = Judged::new(&last.study, 0, false);
    (judged.excess() < UNEVEN || judged.within())
        && way.iter().all(|step| {
            without(last, axis, step.id).is_some_and(|(rest, term)| {
                let freedom = term.values.len();
                let candidate = Candidate { series: 0, term, score: 0.0, removes: 0.0, freedom };
                !is_outsized(&candidate.term, axis) && rest.refit_beside(candidate, &last.study.model).passes(&rest)
            })
        })
}
