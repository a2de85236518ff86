//! What is learned beside a stream: parameters refitted to what came so far, whether they are worth taking yet, and another model on
//! trial beside the one in use.

use crate::{
    Axis, AxisModel, Model, Record, Term,
    diagnose::{self, compare},
    diagnosis::{AxisResult, ErrorPoint, Verdict},
    effects::{ParameterCard, Role, Trait},
    faults::is_wrong_ratio,
    fit::{FitError, fit},
    units,
};

/// Two solutions that differ by more than this many standard errors of their difference disagree.
const DISAGREE: f64 = 4.0;
/// A trial is won where the mean of (E/F)² over the averaging times falls by this share at least, …
const WON: f64 = 0.01;
/// … and what is on trial differs from nothing by so many standard errors: it is looked at again and again while data come,
/// and the error of noise alone falls every other time. …
const TOLD: f64 = 4.0;
/// … Unless that mean falls by such a share of itself: where much else is missing nothing is known well. …
const PLAIN: f64 = 0.1;
/// … Even then by so many: what is not known better than that has nothing to add.
const LEAST: f64 = 2.5;

/// How a trial went: both models refitted to the same samples and judged where they did not learn.
#[derive(Debug)]
pub struct Trial {
    /// The model in use.
    pub present: Vec<AxisResult>,
    /// The other one.
    pub other: Vec<AxisResult>,
    /// By how many of its standard errors what is on trial differs from nothing; `None` where that says nothing.
    pub told: Option<f64>,
}

impl Trial {
    /// Held-out excess, the mean of (E/F)², of the model in use and of the other one. Both are held against the lower of their
    /// two floors: what one of them leaves is no noise where the other one removes it.
    #[must_use]
    pub fn excess(&self) -> (f64, f64) {
        let floor = |axis: Axis, tau_s: f64| {
            let both = [&self.present, &self.other].into_iter().flatten().filter(move |own| own.axis == axis);
            let points = both.flat_map(|own| &own.error_curve).filter(|point| point.tau_s == tau_s);
            points.filter_map(|point| point.floor).min_by(f64::total_cmp)
        };
        let excess = |axes| excess_over(axes, |axis, point| floor(axis, point.tau_s));
        (excess(&self.present), excess(&self.other))
    }

    /// Whether the other model is better on data that neither learned from, and by no chance.
    #[must_use]
    pub fn is_won(&self) -> bool {
        let (before, after) = self.excess();
        let falls = after < before && after < before - WON * (before - 1.0).max(0.0);
        let wanted = if after < (1.0 - PLAIN) * before { LEAST } else { TOLD };
        falls && self.told.is_none_or(|told| told > wanted)
    }
}

/// Both models refitted to the same samples, each judged where it did not learn: the other one, and how it went where both can be
/// fitted.
///
/// # Errors
/// Where the other model cannot be fitted.
pub fn attempt(record: &Record, present: &Model, other: &Model) -> Result<(Model, Option<Trial>), FitError> {
    let (before, after) = (refitted(record, present), refitted(record, other)?);
    let trial = before.ok().map(|before| Trial {
        present: judged(record, &before, true),
        other: judged(record, &after, true),
        told: told(&before, &after),
    });
    Ok((after, trial))
}

/// By how many of its standard errors what one model has and another one has not differs from nothing, on the axis that
/// tells it best.
fn told(without: &Model, with: &Model) -> Option<f64> {
    let sizes = Axis::ALL.into_iter().flat_map(|axis| {
        let [before, after] = [without, with].map(|model| model.axes[axis.index()].as_ref());
        let is_new = move |term: &&Term| before.is_none_or(|before| before.term(term.effect.card().id).is_none());
        let added = after.map_or(&[][..], |after| &after.terms).iter().filter(is_new);
        added.filter_map(move |term| term.size_in_errors(axis))
    });
    sizes.max_by(f64::total_cmp)
}

/// A model held against a record, on every axis that can be; `own_log`: it was fitted to this very record.
#[must_use]
pub fn judged(record: &Record, model: &Model, own_log: bool) -> Vec<AxisResult> {
    let options = diagnose::Options { own_log, ..diagnose::Options::default() };
    compare(record, model, &record.fitted_axes(), &options).unwrap_or_default()
}

/// The mean of (E/F)² over averaging times and axes.
#[must_use]
pub fn excess(axes: &[AxisResult]) -> f64 {
    excess_over(axes, |_, point| point.floor)
}

fn excess_over(axes: &[AxisResult], floor: impl Fn(Axis, &ErrorPoint) -> Option<f64>) -> f64 {
    let points = axes.iter().flat_map(|own| own.error_curve.iter().map(|point| (own.axis, point)));
    let ratio = |(axis, point): (Axis, &ErrorPoint)| Some((point.error? / floor(axis, point)?).powi(2));
    let ratios: Vec<f64> = points.filter_map(ratio).filter(|r| r.is_finite()).collect();
    if ratios.is_empty() { f64::INFINITY } else { ratios.iter().sum::<f64>() / ratios.len() as f64 }
}

/// The fit of every axis that can be fitted; where the model has no axis yet, of the base model.
///
/// # Errors
/// Where an axis cannot be fitted.
pub fn refitted(record: &Record, start: &Model) -> Result<Model, FitError> {
    let axes: Vec<Axis> = record.fitted_axes();
    if start.axes.iter().all(Option::is_none) {
        let base = Model { epoch: start.epoch, ..Model::base_for(record) };
        return fit(record, &base, &axes);
    }
    fit(record, start, &axes)
}

/// Whether two solutions differ by more than their standard errors allow.
#[must_use]
pub fn contradicts(a: &Model, b: &Model) -> bool {
    parameters(a).zip(parameters(b)).any(|((x, sx), (y, sy))| (x - y).abs() > DISAGREE * sx.hypot(sy))
}

/// Whether a solution contradicts a model, or has a scale factor that no gyro has where the model's is one that gyros have. Readings of less than
/// a second may do so: their standard errors do not contain what the noise of the gyro does to α (errors in variables).
#[must_use]
pub fn is_surprising(solution: &Model, beside: &Model) -> bool {
    let is_wrong = |model: &Model| model.axes.iter().flatten().any(is_wrong_ratio);
    contradicts(solution, beside) || (is_wrong(solution) && !is_wrong(beside))
}

/// Whether a solution agrees with a model within their standard errors and knows none of its parameters better.
#[must_use]
pub fn adds_nothing(solution: &Model, to: &Model) -> bool {
    let effects = |model: &Model| model.axes.each_ref().map(|axis| axis.as_ref().map(AxisModel::effect_ids));
    let better = |((_, new), (_, known)): ((f64, f64), (f64, f64))| new < known || !known.is_finite();
    effects(solution) == effects(to)
        && !contradicts(solution, to)
        && !parameters(solution).zip(parameters(to)).any(better)
}

fn parameters(model: &Model) -> impl Iterator<Item = (f64, f64)> + '_ {
    let terms = |axis: &AxisModel| -> Vec<(f64, f64)> {
        axis.terms.iter().flat_map(|t| t.values.iter().copied().zip(t.std_errors.iter().copied())).collect()
    };
    model.axes.iter().flatten().flat_map(terms)
}

/// Why a solution is not worth taking yet: no coefficient of an effect is known better than to its typical size, or one was
/// driven to its physical bound (a vehicle that stands still tells nothing about a scale). A coefficient that is typically
/// zero has no size to be known to.
#[must_use]
pub fn not_excited(model: &Model) -> Option<String> {
    if let Some((axis, id)) = model.unseen() {
        return Some(format!("nothing is seen of {id} on axis {axis}"));
    }
    for axis in Axis::ALL {
        let Some(of_axis) = &model.axes[axis.index()] else { continue };
        for term in &of_axis.terms {
            let id = term.effect.card().id;
            let coefficients = || term.parameters(axis).filter(|(card, ..)| card.role == Role::Linear);
            let at_bound = |card: &ParameterCard, value: f64| value <= card.bounds.0 || value >= card.bounds.1;
            if let Some((card, ..)) =
                coefficients().find(|(card, value, _)| at_bound(card, *value) && *value != card.neutral)
            {
                return Some(format!("{id}.{} of axis {axis} is at its physical bound", card.name));
            }
            let sized = || {
                let sizes = coefficients().map(|(card, value, error)| {
                    // Relative to the scale: where a gyro hardly turns, its noise makes α nearly zero, and the standard error as small.
                    let of = if term.effect.is(Trait::Gain) { value.abs() } else { 1.0 };
                    (card, error / of, (card.typical - card.neutral).abs())
                });
                sizes.filter(|(.., typical)| *typical > 0.0)
            };
            let known = sized().any(|(_, std_error, typical)| std_error <= typical);
            if let Some((card, std_error, typical)) = sized().next().filter(|_| !known) {
                let unit = units::shown(card.unit, &[Some(typical)]);
                let shown = |value: f64| format!("{}{}", units::round(value * unit.factor), unit.unit);
                let known = if std_error.is_finite() {
                    format!("known to ± {}", shown(std_error))
                } else {
                    "not known".into()
                };
                return Some(format!(
                    "{id}.{} of axis {axis} is {known}, and {} is typical",
                    card.name,
                    shown(typical)
                ));
            }
        }
    }
    None
}

/// Gives effects that a model has not yet the parameters that a search found for them, to start from.
pub fn begin(model: &mut Model, found: &[AxisResult]) {
    for found in found {
        let Some(axis) = &mut model.axes[found.axis.index()] else { continue };
        for suspect in &found.suspects {
            let Some(term) = axis.terms.iter_mut().find(|t| t.effect.card().id == suspect.effect) else { continue };
            for (card, value) in term.effect.parameters(found.axis).iter().zip(&mut term.values) {
                let known = suspect.parameters.iter().find(|p| p.effect == suspect.effect && p.name == card.name);
                *value = known.and_then(|p| p.value).unwrap_or(*value);
            }
        }
    }
}

/// Takes over what a search of the same model found to be missing. Where it found nothing and the newest data say
/// otherwise, they are right.
pub fn take_suspects(newest: &mut [AxisResult], search: &[AxisResult]) {
    for axis in newest {
        let Some(found) = search.iter().find(|found| found.axis == axis.axis) else { continue };
        let nothing_found = matches!(found.verdict, Verdict::Adequate | Verdict::CannotTell);
        if nothing_found && found.verdict != axis.verdict {
            continue;
        }
        axis.find(found.finding.clone());
        axis.remarks.clone_from(&found.remarks);
        axis.searched = true;
        axis.suspects.clone_from(&found.suspects);
        // A search knows which part of the error an effect would remove.
        axis.budget.clone_from(&found.budget);
        axis.limited_by = found.limited_by;
        axis.limited_says.clone_from(&found.limited_says);
        axis.limit.clone_from(&found.limit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{effects::find, finding::Finding};

    /// An axis of this error at 1 s.
    fn judged(error: f64, floor: f64) -> Vec<AxisResult> {
        let point = ErrorPoint { tau_s: 1.0, error: Some(error), floor: Some(floor), floor_99: Some(1.2 * floor) };
        let finding = Finding::Bare { verdict: Verdict::Unexplained };
        vec![AxisResult { error_curve: vec![point], ..AxisResult::new(Axis::Z, finding) }]
    }

    #[test]
    fn what_was_added_is_told_by_its_coefficients_or_else_its_shapes() {
        let model = |terms: &[(&str, &[f64], &[f64])]| {
            let mut axis = AxisModel::base(Axis::Z);
            for &(id, values, std_errors) in terms {
                let effect = find(id).unwrap();
                axis.terms.push(Term { effect, values: values.to_vec(), std_errors: std_errors.to_vec() });
            }
            Model { axes: [None, None, Some(axis)], ..Model::default() }
        };
        let base = model(&[]);
        let late = ("delay", &[0.02][..], &[0.001][..]);
        assert_eq!(told(&base, &model(&[late])), Some(20.0));
        // What both have is not on trial.
        let supply = ("supply-voltage", &[3e-4][..], &[2e-4][..]);
        let told_beside = told(&model(&[late]), &model(&[late, supply])).unwrap();
        assert!((told_beside - 1.5).abs() < 1e-12, "{told_beside}");
        // Of a zone without motion, its width; nothing is known of it yet.
        assert_eq!(told(&base, &model(&[("dead-zone", &[0.1], &[f64::NAN])])), None);
        assert_eq!(told(&base, &base), None);
    }

    #[test]
    fn a_few_seconds_add_nothing_to_what_minutes_told_unless_they_contradict_it() {
        let model = |delta: f64, std_error: f64| {
            let mut axis = AxisModel::base(Axis::Z);
            for (term, value) in axis.terms.iter_mut().zip([1.0, delta]) {
                (term.values, term.std_errors) = (vec![value], vec![std_error]);
            }
            Model { axes: [None, None, Some(axis)], ..Model::default() }
        };
        let minutes = model(0.01, 1e-5);
        assert!(adds_nothing(&model(0.015, 5e-3), &minutes));
        assert!(!adds_nothing(&model(0.05, 5e-3), &minutes), "it contradicts");
        assert!(!adds_nothing(&model(0.01, 5e-6), &minutes), "it knows more");
        assert!(!adds_nothing(&model(0.015, 5e-3), &model(0.0, f64::NAN)), "nothing was known");
        assert!(!adds_nothing(&model(0.015, 5e-3), &Model::default()), "there was no model");
    }

    #[test]
    fn what_is_as_uncertain_as_it_is_large_is_not_added_whatever_share_it_takes() {
        let is_won = |before: f64, after: f64, told: Option<f64>| {
            Trial { present: judged(before, 1.0), other: judged(after, 1.0), told }.is_won()
        };
        // A quarter of the error², 1 ± 1.
        assert!(!is_won(10.0, 8.66, Some(1.0)));
        assert!(is_won(10.0, 8.66, Some(3.0)));
        assert!(is_won(10.0, 9.9, Some(5.0)) && !is_won(10.0, 9.9, Some(3.0)));
        // A shape without a standard error; and nothing better.
        assert!(is_won(10.0, 8.66, None) && !is_won(10.0, 10.0, None));
    }

    #[test]
    fn what_one_model_takes_for_noise_is_error_where_the_other_one_removes_it() {
        // A quarter over its own floor each, but ten times smaller.
        let trial = Trial { present: judged(0.5, 0.4), other: judged(0.05, 0.04), told: None };
        let (before, after) = trial.excess();
        assert!(
            (before - 12.5_f64.powi(2)).abs() < 1e-9 && (after - 1.25_f64.powi(2)).abs() < 1e-9,
            "{before} {after}"
        );
    }

    #[test]
    fn a_coefficient_that_is_typically_zero_is_not_waited_for() {
        let mut axis = AxisModel::base(Axis::Z);
        axis.terms.push(Term::neutral(find("temperature-bias").unwrap(), Axis::Z));
        for term in &mut axis.terms {
            term.std_errors.fill(1e-9);
        }
        let excited = |axis: &AxisModel| {
            not_excited(&Model { axes: [None, None, Some(axis.clone())], ..Model::default() }).is_none()
        };
        assert!(excited(&axis));
        axis.terms[2].std_errors.fill(1.0);
        assert!(!excited(&axis));
        axis.terms[0].std_errors.fill(1.5);
        let waits = |axis: &AxisModel| {
            not_excited(&Model { axes: [None, None, Some(axis.clone())], ..Model::default() }).unwrap_or_default()
        };
        assert_eq!(waits(&axis), "scale-factor.alpha of axis z is known to ± 150 %, and 2 % is typical");
        (axis.terms[0].values[0], axis.terms[0].std_errors[0]) = (0.025, 0.0075);
        assert_eq!(waits(&axis), "scale-factor.alpha of axis z is known to ± 30 %, and 2 % is typical");
    }

    #[test]
    fn a_scale_that_no_gyro_has_is_a_surprise_and_so_is_what_contradicts() {
        let model = |alpha: f64, std_error: f64| {
            let mut axis = AxisModel::base(Axis::Z);
            axis.terms[0].values[0] = alpha;
            axis.terms.iter_mut().for_each(|term| term.std_errors = vec![std_error]);
            Model { axes: [None, None, Some(axis)], ..Model::default() }
        };
        let unfitted = model(1.0, f64::NAN);
        assert!(
            !is_surprising(&model(0.98, 1e-3), &unfitted) && !is_surprising(&model(0.98, 1e-3), &model(0.979, 1e-4))
        );
        assert!(is_surprising(&model(0.023, 7e-3), &unfitted) && is_surprising(&model(0.95, 1e-3), &model(0.98, 1e-4)));
        // A gear that was there before.
        assert!(!is_surprising(&model(2.001, 1e-3), &model(2.0, 1e-3)));
    }

    #[test]
    fn a_scale_that_was_driven_to_its_bound_is_not_taken() {
        let mut axis = AxisModel::base(Axis::Z);
        for term in &mut axis.terms {
            term.std_errors = vec![1e-9];
        }
        let mut model = Model { axes: [None, None, Some(axis)], ..Model::default() };
        assert_eq!(not_excited(&model), None);
        if let Some(axis) = &mut model.axes[2] {
            let (low, _) = axis.terms[0].effect.parameters(Axis::Z)[0].bounds;
            axis.terms[0].values[0] = low;
        }
        let why = not_excited(&model).unwrap_or_default();
        assert!(why.contains("alpha") && why.contains("bound"), "{why}");
    }
}
