//! Two suspects that hide one another: what one adds to the residual the other takes away again, and neither shows alone.

use super::super::{Options, challenger::Incumbent};
use crate::{
    Axis,
    effects::{ParameterCard, Role, Stage, are_aliases},
    evidence::{noise::Gls, problem::Slot, study::Study},
    parallel,
    scan::{Candidate, Scanner},
    thresholds as limit,
};
use faer::Mat;
use itertools::Itertools;
use std::ops::Range;

impl Incumbent<'_> {
    /// Two suspects of one axis that hide one another.
    pub(super) fn pair(&self, series: usize, options: &Options) -> Option<[Candidate; 2]> {
        let own: Vec<Candidate> = self.scanned(options).iter().filter(|c| c.series == series).cloned().collect();
        let axis = self.study.bench.problem.series[series].axis;
        pair(&self.scanner(), axis, &own)
    }
}

/// The two of these candidates of one axis where each raises ln L most beside the other, by at least [`limit::TOGETHER`], each at its
/// share: all pairs are held against the residual in one set of normal equations.
fn pair(scanner: &Scanner, axis: Axis, list: &[Candidate]) -> Option<[Candidate; 2]> {
    let mut each: Vec<&Candidate> =
        list.iter().filter(|c| c.term.effect.stage() != Stage::Reading && c.score.is_finite()).collect();
    each.sort_by(|a, b| b.score.total_cmp(&a.score));
    each = each.into_iter().unique_by(|c| c.term.effect.card().id).collect();
    let columns = parallel::map(&each, |c| scanner.white_along(c.series, &c.term));
    let all = scanner.beside_model(&columns.iter().flatten().map(Vec::as_slice).collect::<Vec<_>>());
    let own: Vec<Range<usize>> = columns
        .iter()
        .scan(0, |end, columns| {
            let start = *end;
            *end += columns.len();
            Some(start..*end)
        })
        .collect();
    let alone: Vec<f64> = own.iter().map(|own| all.part(own.clone()).rise(RANK).0).collect();
    let gained = |a: usize, b: usize| {
        let both = all.part(own[a].clone().chain(own[b].clone()));
        (unshared(&both.matrix, own[a].len()) > limit::OWN_OF_PAIR.value).then_some(())?;
        let (together, step) = both.rise(RANK);
        let (of_a, of_b) = step.split_at(own[a].len());
        let pair = [moved(each[a], axis, of_a)?, moved(each[b], axis, of_b)?];
        Some((together - alone[a].max(alone[b]), pair)).filter(|(gain, _)| *gain > limit::TOGETHER.value)
    };
    // The difference of two effects that look alike is a shape of its own, which is the physics of neither.
    let id = |k: usize| each[k].term.effect.card().id;
    let pairs = (0..each.len()).tuple_combinations().filter(|&(a, b)| !are_aliases(id(a), id(b)));
    let gains = pairs.filter_map(|(a, b)| gained(a, b));
    gains.max_by(|x, y| x.0.total_cmp(&y.0)).map(|(_, pair)| pair)
}

/// Share of a column's own size below which nothing is left of it.
const RANK: f64 = 1e-6;

/// What the first `split` parameters and the others do not share, Π(1 − ρ²) over their canonical correlations: 1 where
/// neither says anything of the other, 0 where one follows from the other. The matrix is their information or their
/// covariance, which give the same.
pub(super) fn unshared(matrix: &Mat<f64>, split: usize) -> f64 {
    let volume = |range: Range<usize>| {
        let scaled = |i: usize, j: usize| {
            let (i, j) = (i + range.start, j + range.start);
            matrix[(i, j)] / (matrix[(i, i)] * matrix[(j, j)]).sqrt()
        };
        Mat::from_fn(range.len(), range.len(), scaled).determinant()
    };
    volume(0..matrix.nrows()) / (volume(0..split) * volume(split..matrix.nrows()))
}

/// Whether a fitted model has, of one axis, an effect beside one that it may be taken for, and the log tells hardly more of the
/// two together than of one of them. Their difference is a shape of its own, which is the physics of neither.
pub(super) fn beside_its_like(study: &Study, gls: &Gls, series: usize, id: &str) -> bool {
    let axis = study.bench.problem.series[series].axis;
    let terms = study.model.axes[axis.index()].as_ref().map_or(&[][..], |model| &model.terms);
    let own = |id: &str| -> Vec<usize> {
        let is_own = |slot: &Slot| slot.series == series && terms[slot.term].effect.card().id == id;
        (0..study.slots.len()).filter(|&k| is_own(&study.slots[k])).collect()
    };
    let looks_like = |other: &str| {
        let (a, b) = (own(id), own(other));
        let rows = [a.as_slice(), b.as_slice()].concat();
        let own = unshared(&Mat::from_fn(rows.len(), rows.len(), |i, j| gls.covariance[(rows[i], rows[j])]), a.len());
        own.is_nan() || own < limit::OWN_BESIDE_ALIAS.value
    };
    // Scale factor and bias stand in every model.
    let others = terms.iter().filter(|term| term.effect.stage() != Stage::Calibration);
    others.map(|term| term.effect.card().id).any(|other| are_aliases(id, other) && looks_like(other))
}

/// A candidate with these coefficients, or with this share of its size; `None` where that is not physical.
fn moved(candidate: &Candidate, axis: Axis, by: &[f64]) -> Option<Candidate> {
    let mut moved = candidate.clone();
    let cards = candidate.term.effect.parameters(axis);
    let has_coefficients = cards.first().is_some_and(|card| card.role == Role::Linear);
    if has_coefficients {
        moved.term.values[..by.len()].copy_from_slice(by);
    } else if cards.iter().all(|card| card.neutral == 0.0) {
        moved.term.values.iter_mut().for_each(|v| *v *= by[0]);
    } else if by[0] <= 0.0 {
        return None;
    }
    let inside = |(v, card): (&f64, &ParameterCard)| *v >= card.bounds.0 && *v <= card.bounds.1;
    moved.term.values.iter().zip(cards).all(inside).then_some(moved)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_share_what_their_correlations_say_whichever_way_it_is_told() {
        // Correlated by 0.6: 1 − 0.36 is left, and beside an independent third no less.
        let matrix = Mat::from_fn(3, 3, |i, j| match (i.min(j), i.max(j)) {
            (0, 1) => 0.6 * 2.0 * 5.0,
            (i, j) if i == j => [4.0, 25.0, 9.0][i],
            _ => 0.0,
        });
        assert!((unshared(&matrix, 1) - 0.64).abs() < 1e-12);
        let (inverse, _) = crate::nls::invert_observable(&matrix, 1e-12);
        assert!((unshared(&inverse, 1) - 0.64).abs() < 1e-12);
        assert!((unshared(&matrix, 2) - 1.0).abs() < 1e-12, "the third is alone");
    }
}
