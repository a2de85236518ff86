//! Whether a fit ran to the end of what is physical.

use super::challenger::Challenger;
use crate::{
    Axis, Term,
    effects::{ParameterCard, Role, Stage},
    evidence::{problem::Slot, series::Series},
    scan::Candidate,
};

impl Challenger<'_> {
    /// Whether a parameter ran to the end of what is physical: the fit looks for something else.
    pub(super) fn at_bound(&self) -> bool {
        self.ends().into_iter().any(|parameter| self.goes_beyond(parameter))
    }

    /// The parameters that did: whether one that is no shape, and whether a shape.
    pub(super) fn bounds_reached(&self) -> (bool, bool) {
        let beyond: Vec<usize> = self.ends().into_iter().filter(|&parameter| self.goes_beyond(parameter)).collect();
        let is_shape = |&parameter: &usize| self.is_extreme_shape(parameter);
        (!beyond.iter().all(is_shape), beyond.iter().any(is_shape))
    }

    fn card(&self, parameter: usize) -> &'static ParameterCard {
        let axis = self.study.bench.problem.series[self.candidate.series].axis;
        &self.candidate.term.effect.parameters(axis)[parameter]
    }

    fn ends(&self) -> Vec<usize> {
        ends(&self.candidate.term, &self.study.bench.problem.series[self.candidate.series])
    }

    /// Whether the likelihood asks for more than an end that a parameter stands at. A shape which the log hardly tells, a damping
    /// say, may stand there.
    fn goes_beyond(&self, parameter: usize) -> bool {
        let Candidate { series, ref term, .. } = self.candidate;
        let of_suspect = |slot: &Slot| slot.series == series && slot.parameter == parameter;
        let row = self.study.slots.iter().rposition(of_suspect);
        let beyond = |row: usize| {
            let step = if term.values[parameter] <= self.card(parameter).bounds.0 {
                -self.gls.step[row]
            } else {
                self.gls.step[row]
            };
            step > BEYOND * self.gls.std_error(row)
        };
        !self.is_extreme_shape(parameter) || row.is_none_or(beyond)
    }

    /// Whether a parameter that stands at an end is a shape there: what is nothing at that end is not there, and some ends lie
    /// within the bounds.
    fn is_extreme_shape(&self, parameter: usize) -> bool {
        let card = self.card(parameter);
        let (value, (low, high)) = (self.candidate.term.values[parameter], card.bounds);
        card.role == Role::Shape && low < card.neutral && card.neutral < high && !(low < value && value < high)
    }
}

/// Whether a parameter stands at the end of what is physical.
pub(super) fn is_at_bound(term: &Term, series: &Series) -> bool {
    !ends(term, series).is_empty()
}

/// The fitted parameters that stand at the end of what is physical.
fn ends(term: &Term, series: &Series) -> Vec<usize> {
    let span = series.span();
    let nyquist = 0.5 / span.dt;
    let cards = term.effect.parameters(series.axis);
    let instants: Vec<usize> = term.effect.instants(series.axis).collect();
    let is_at_end = |k: usize| {
        let (card, v) = (&cards[k], term.values[k]);
        if instants.contains(&k) && is_seen_from_one_side(term, series) {
            return true;
        }
        // Between two samples a motion is guessed: a window as narrow as that stands for what the guess is off by.
        if term.effect.stage() == Stage::Shown && v < BETWEEN_SAMPLES * span.dt {
            return true;
        }
        let near = |bound: f64| bound.is_finite() && (v - bound).abs() <= 1e-6 * bound.abs().max(1e-12);
        near(card.bounds.0) || near(card.bounds.1) || (card.unit == "Hz" && v > nyquist)
    };
    (0..cards.len()).filter(|&k| cards[k].role != Role::Chosen && is_at_end(k)).collect()
}

/// Whether something that begins at an instant begins where the log does, or ends: a step that is seen from one side only is the constant
/// that another effect is (a delay, a bias), or nothing. Every model has a bias, so that a step of the bias shows within seconds.
pub(super) fn is_seen_from_one_side(term: &Term, series: &Series) -> bool {
    let (start, duration) = (series.t[0], series.span().duration);
    let share = ENDS * duration;
    let end = if term.effect.stage() == Stage::Felt { share.min(SHOWS) } else { share };
    let both = start + end..start + duration - end;
    term.effect.instants(series.axis).any(|k| !both.contains(&term.values[k]))
}

/// The largest coefficient over its typical size; 0 where none has one.
pub(super) fn size(term: &Term, axis: Axis) -> f64 {
    let pairs = term.effect.parameters(axis).iter().zip(&term.values);
    let sizes = pairs.filter(|(card, _)| card.role == Role::Linear && card.typical != 0.0);
    sizes.map(|(card, v)| (v / card.typical).abs()).fold(0.0, f64::max)
}

/// Share of a sample's interval that a window has to be as wide as.
const BETWEEN_SAMPLES: f64 = 0.5;
/// Share of the log at its ends where no step is looked for.
const ENDS: f64 = 0.05;
/// The longest such end where the bias steps, s.
const SHOWS: f64 = 10.0;
/// Standard errors beyond such an end that are no chance.
const BEYOND: f64 = 3.0;
