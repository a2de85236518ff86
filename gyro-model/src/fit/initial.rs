//! Where an effect that is new to a model begins: at the shape that this log shows most clearly.
//!
//! A resonance at an infinite frequency, a tone at any, a step at any time: from there no fit finds the way. So a term
//! whose values are still neutral takes what the scan of the suspects finds for it, its limit what the readings show.

use super::parts::Parts;
use crate::{
    Axis, Model, Record, Term,
    effects::{Effect, Role},
    evidence::study::{Bench, Study},
    scan::{Candidate, starts},
};

/// The error over its floor beyond which a suspect is worth what it takes from the error, not from the likelihood.
const NEAR_THE_FLOOR: f64 = 2.0;

/// The model with each term of this log's axes that has a shape and is still neutral at the shape to fit it from; left
/// neutral where the log shows nothing like it.
#[must_use]
pub(crate) fn begun(record: &Record, bench: &Bench, model: &Model) -> Model {
    let axes: Vec<Axis> = bench.problem.series.iter().map(|series| series.axis).collect();
    let mut begun = model.clone();
    let mut new: Vec<(usize, &'static dyn Effect)> = Vec::new();
    for (series, axis) in axes.iter().enumerate() {
        let Some(own) = &mut begun.axes[axis.index()] else { continue };
        new.extend(own.terms.extract_if(.., |term| is_new(term, *axis)).map(|term| (series, term.effect)));
    }
    if new.is_empty() {
        return begun;
    }
    let parts = Parts::new(record, bench, model);
    let looked_at = parts.as_ref().map_or_else(|| vec![bench], |parts| parts.each().to_vec());
    for (series, effect) in new {
        let found = looked_at.iter().filter_map(|part| {
            let study = Study::fit(part, &begun, None);
            clearest(starts(&study, effect, series), study.over_floor() > NEAR_THE_FLOOR)
        });
        let best = found.max_by(|a, b| a.score.total_cmp(&b.score));
        let axis = axes[series];
        if let Some(own) = &mut begun.axes[axis.index()] {
            own.terms.push(best.map_or_else(|| Term::neutral(effect, axis), |found| found.term));
        }
    }
    begun
}

/// Whether nothing is known of a term yet whose shape has to be found.
fn is_new(term: &Term, axis: Axis) -> bool {
    let has_shape = term.effect.parameters(axis).iter().any(|card| card.role != Role::Linear);
    has_shape && term.values == Term::neutral(term.effect, axis).values
}

fn clearest(starts: Vec<Candidate>, by_error: bool) -> Option<Candidate> {
    let worth = |candidate: &Candidate| if by_error { candidate.removes } else { candidate.score };
    starts.into_iter().max_by(|a, b| worth(a).total_cmp(&worth(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effects::{CATALOGUE, Stage},
        fit::fit,
        simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
    };

    #[test]
    fn an_effect_with_a_shape_is_fitted_from_neutral() {
        let with_shape = CATALOGUE.iter().filter(|effect| {
            effect.stage() != Stage::Calibration
                && effect.parameters(Axis::X).iter().any(|card| card.role != Role::Linear)
        });
        for &effect in with_shape {
            let id = effect.card().id;
            let (motion, sensor) = (Motion::Drive { rate: 1.2, hold: 1.0 }, SensorSpec::default());
            let hidden = vec![Hidden::typical(effect, Axis::X)];
            let scenario = Scenario { motion, seconds: 90.0, rate_hz: 200.0, sensor, hidden, ..Scenario::default() };
            let simulated = simulate(&scenario);
            let mut model = Model::base_for(&simulated.record);
            let base = fit(&simulated.record, &model, &[Axis::X]).unwrap();
            if let Some(own) = &mut model.axes[0] {
                own.terms.push(Term::neutral(effect, Axis::X));
            }
            let with = fit(&simulated.record, &model, &[Axis::X]).unwrap();
            let bench = Bench::new(&simulated.record, &[Axis::X], &base).unwrap();
            let [before, after, truth] =
                [&base, &with, &simulated.truth].map(|model| Study::held(&bench, model).over_floor());
            assert!(after < 1.3 * truth.max(1.0), "{id}: {before} without, {after} with it, {truth} of the true model");
        }
    }
}
