//! Which physical effects are missing.
//!
//! One round of the search tells the best suspect. Where the error is still more than noise with it, more than one is missing, and
//! the best of the first round may stand for several: then the search goes on to its end, and what it ends with is what is missing.

use super::{
    Options, Standing, add_faults, apart, axis_result,
    challenger::{Challenger, Incumbent},
    comparison::aliases,
    each_group,
    explain::explained,
    fatal,
    observed::{Observed, unexcited},
    search::{Alike, added, search_on},
    sorted, users,
    verdicts::{at_rest, decide, leaves_noise},
};
use crate::{
    Axis, AxisModel, Model, Record,
    budget::Budget,
    diagnosis::{AxisResult, ErrorPoint, Suspect, Verdict},
    effects::{Effect, delay::DELAY, split_by},
    evidence::study::{Bench, Study},
    fault::FaultKind,
    finding::{Excess, Finding, NamedEffect, Remark},
    fit::{
        FitError,
        judged::{self, Judged, finite},
        parts::Parts,
    },
    scan::Candidate,
    thresholds as limit,
};
use itertools::Itertools;

/// Refits a model and says which physical effects are missing.
///
/// # Errors
/// As [`super::compare`].
pub fn diagnose(record: &Record, model: &Model, axes: &[Axis], options: &Options) -> Result<Vec<AxisResult>, FitError> {
    if let Some(parts) = apart::parts(record, axes, options.faults) {
        return parts.each(|record, axes| diagnose(record, model, axes, &Options { laid: None, ..*options }));
    }
    let work = |bench: &Bench, model: &Model, options: &Options| {
        let parts = Parts::new(record, bench, model);
        let mut incumbent = Incumbent::new(match &parts {
            Some(parts) => parts.fit(bench, model),
            None => Study::fit(bench, model, None),
        });
        let looked = match &parts {
            Some(parts) => parts.suspects(model, options).into(),
            None => vec![(incumbent.clone(), incumbent.suspects(options))],
        };
        let gls = incumbent.gls.clone();
        incumbent.study.stamp(&gls);
        let mut found: Vec<Found> =
            (0..bench.problem.series.len()).map(|k| Found::of(&incumbent, &looked, k)).collect();
        for (part, (seen, suspects)) in looked.iter().enumerate() {
            let is_open = |found: &Found| found.part == part && found.is_open();
            if found.iter().any(is_open) && !(options.stop)() {
                let sets = several(seen, suspects, model, options);
                let is_joined = options.faults.iter().any(|fault| fault.kind == FaultKind::OtherClock);
                for (found, set) in found.iter_mut().zip(sets).filter(|(found, _)| found.part == part) {
                    found.take(set, is_joined);
                }
            }
        }
        let told = found.into_iter().enumerate().map(|(k, found)| {
            let (seen, suspects) = &looked[found.part];
            let before = if parts.is_some() { Judged::new(&seen.study, k, false) } else { found.judged.clone() };
            let fault = fatal(record, options.faults, bench).cloned();
            let is_bad = fault.is_some();
            let listed = if is_bad { Vec::new() } else { found.listed(seen, &before, k) };
            let after = found.top.as_ref().map(|top| Judged::new(&top.study, k, false).points());
            let after = after.or_else(|| listed.first().map(|s: &Suspect| s.error_curve.clone())).unwrap_or_default();
            let lacks = !found.observed.named.is_empty() && found.is_shown() && !is_bad;
            let (rest, noise) = match (&found.top, found.own.first()) {
                (Some(top), _) if lacks && parts.is_none() => (&top.study, &top.gls.noise),
                (None, Some(first)) if lacks && parts.is_none() => (&first.study, &first.gls.noise),
                _ => (&incumbent.study, &incumbent.gls.noise),
            };
            let missing = if lacks && !after.is_empty() { found.judged.removed(&after) } else { Vec::new() };
            let budget = Budget::of(rest, k, &found.judged, noise, Some(&missing));
            let mut missing_error_curve = if found.is_together { after.clone() } else { Vec::new() };
            budget.raise_points(&mut missing_error_curve);
            let explained = if options.explain { explained(seen, suspects, k, options) } else { Vec::new() };
            let unfinished = (options.stop)();
            let observed =
                Observed { fault, unfinished, with_named: found.with_named(&budget, after), ..found.observed.clone() };
            let is_noise = leaves_noise(&observed);
            let divided = observed.clone().divided(&budget, &found.judged);
            let (finding, with_zero) = incumbent.decided(&divided, &found.judged, k);
            let budget = with_zero.unwrap_or(budget);
            // What another zero explains is no suspect's.
            let is_zero = matches!(finding, Finding::Unexplained(Excess::OtherZero { .. }));
            let listed = if is_zero { Vec::new() } else { listed };
            let mut remarks = Vec::new();
            if finding.names() && found.set.is_empty() {
                remarks.extend(observed.unexcited.clone().map(Remark::Unexcited));
            }
            if !matches!(finding, Finding::BadData { .. } | Finding::Stopped { .. }) {
                remarks.extend(users::became(seen, &found.own, options.own_effects, k));
            }
            remarks.extend(at_rest(&observed, &finding));
            let missing = found.set.iter().map(|r| r.candidate.term.effect.card().id.to_owned());
            let missing = if found.set.len() > 1 { missing.collect() } else { Vec::new() };
            let (judged, told) = ((&found.judged, budget), (finding, remarks));
            let axis = axis_result(record, &incumbent.study, k, judged, told, (Some(listed), is_noise), options);
            // Of what is missing, any may change α.
            let models = found.models(seen).map(|model| judged::axis_model(model, axis.axis));
            let models: Vec<AxisModel> =
                std::iter::once(judged::axis_model(&incumbent.study.model, axis.axis)).chain(models).collect();
            let mut axis = AxisResult { missing, missing_error_curve, explained, unfinished, ..axis };
            add_faults(record, &models, &mut axis);
            axis
        });
        let told = of_one_orientation(told.collect());
        (incumbent.study.model.clone(), told)
    };
    // What is missing may still be added: the error as it is counts for nothing yet.
    let standing = |found: &Vec<AxisResult>| {
        let standing = Standing::of(found.iter().map(|d| (d.verdict, &d.effects[..], &d.error_curve[..])));
        Standing { within: true, ..standing }
    };
    let all = each_group(record, model, axes, options, work, standing)?;
    Ok(sorted(all.into_iter().flat_map(|(_, found)| found).collect(), |d| d.axis))
}

/// What is found of one axis.
struct Found<'f, 'a> {
    /// In which of the parts that were looked at.
    part: usize,
    judged: Judged,
    /// What is known of it so far.
    observed: Observed,
    /// Its suspects, what is let in first, and what each cannot be told from.
    own: Vec<&'f Challenger<'a>>,
    aliases: Vec<Vec<String>>,
    /// What is missing together, each beside the model as it stands, where the search went on.
    set: Vec<Challenger<'a>>,
    /// What each of these cannot be told from.
    set_aliases: Vec<Vec<String>>,
    /// Whether the search went on to several.
    is_together: bool,
    /// The model with all of them.
    top: Option<Incumbent<'a>>,
}

impl<'f, 'a> Found<'f, 'a> {
    /// What the first round shows; `incumbent` is the model on the whole log, `looked` that on its parts with the suspects there.
    fn of(incumbent: &Incumbent, looked: &'f [(Incumbent<'a>, Vec<Challenger<'a>>)], series: usize) -> Self {
        let judged = Judged::new(&incumbent.study, series, false);
        let is_own = |refit: &Challenger| refit.candidate.series == series;
        let shows = |(incumbent, suspects): &(Incumbent, Vec<Challenger>)| {
            suspects.iter().any(|refit| is_own(refit) && refit.passes(incumbent))
        };
        let part = looked.iter().position(shows).unwrap_or(0);
        let (seen, suspects) = &looked[part];
        let mut own: Vec<usize> = (0..suspects.len()).filter(|&i| is_own(&suspects[i])).collect();
        // What is let in leads, whatever else lowers the error.
        let first = own.iter().position(|&i| suspects[i].passes(seen));
        if let Some(first) = first {
            own[..=first].rotate_right(1);
        }
        let other_zero = first.and_then(|_| seen.other_zero_than(&suspects[own[0]]));
        let first = first.filter(|_| other_zero.is_none());
        let aliases: Vec<Vec<String>> = own.iter().map(|&i| aliases(suspects, i, Some(seen))).collect();
        let own: Vec<&Challenger> = own.iter().map(|&i| &suspects[i]).collect();
        let mut observed = Observed::of(incumbent, &own, &judged, series);
        observed.other_zero = other_zero;
        if let (Some(_), Some(best)) = (first, own.first()) {
            // What is missing hides the scale factor, too: excitation is judged with the best suspect in.
            observed.unexcited = unexcited(&best.study, &best.gls, series);
            observed.dominates = best.dominates(seen);
            observed.named = vec![NamedEffect { effect: id_of(best).to_owned(), aliases: aliases[0].clone() }];
        }
        Self {
            part,
            judged,
            observed,
            own,
            aliases,
            set: Vec::new(),
            set_aliases: Vec::new(),
            is_together: false,
            top: None,
        }
    }

    /// Whether more may be missing than one effect: an error is left with the best one, or none was found alone.
    fn is_open(&self) -> bool {
        match decide(&self.observed) {
            finding if finding.names() => self.own.first().is_some_and(|r| r.excess > limit::NOISE.value),
            finding => finding.verdict() == Verdict::Unexplained && self.observed.other_zero.is_none(),
        }
    }

    /// Whether the motion shows what is named.
    fn is_shown(&self) -> bool {
        decide(&self.observed).names()
    }

    /// What the search ended with, on a log whose clocks may have been set to each other by the motion.
    fn take(&mut self, mut found: Several<'a>, is_joined: bool) {
        let set = &found.set;
        let is_the_same = set.len() == 1 && !self.observed.named.is_empty() && id_of(&set[0]) == id_of(self.own[0]);
        if set.is_empty() || is_the_same || decide(&self.observed).verdict() == Verdict::CannotTell {
            return;
        }
        self.is_together = set.len() > 1;
        if is_joined {
            found.leave_the_join();
        }
        let Several { set, aliases, top } = found;
        let named = set.iter().zip(&aliases);
        self.observed.named = named
            .map(|(refit, aliases)| NamedEffect { effect: id_of(refit).to_owned(), aliases: aliases.clone() })
            .collect();
        self.observed.dominates = true;
        (self.set, self.set_aliases, self.top) = (set, aliases, Some(top));
    }

    /// The largest error with all that is missing over the floor of the set-up as it is, where that is more than the best suspect alone;
    /// `after` is that error.
    fn with_named(&self, budget: &Budget, mut after: Vec<ErrorPoint>) -> Option<f64> {
        if self.set.is_empty() {
            return None;
        }
        budget.raise_points(&mut after);
        let ratios = after.iter().filter_map(|point| Some(point.error? / point.floor?));
        Some(ratios.fold(0.0, f64::max))
    }

    /// The models that may be the right one: with all that is missing, else with each suspect that is reported.
    fn models<'s>(&'s self, seen: &'s Incumbent) -> impl Iterator<Item = &'s Model> {
        let top = self.top.iter().map(|top| &top.study.model);
        let each = self.own.iter().filter(|r| self.top.is_none() && is_listed(r, seen)).map(|r| &r.study.model);
        top.chain(each)
    }

    /// With its parameters of the model that has all that is missing: alone, it takes up what the others leave.
    fn beside_the_others(&self, mut suspect: Suspect, series: usize) -> Suspect {
        if let Some(top) = &self.top {
            let mut study = top.study.clone();
            study.stamp(&top.gls);
            let axis = study.bench.problem.series[series].axis;
            let own = judged::axis_model(&study.model, axis);
            if let Some(term) = own.term(&suspect.effect) {
                suspect.parameters = judged::parameters(std::slice::from_ref(term), axis);
            }
        }
        suspect
    }

    /// The suspects as reported: what is missing together, else the best of the first round.
    fn listed(&self, seen: &Incumbent, before: &Judged, series: usize) -> Vec<Suspect> {
        if !self.set.is_empty() {
            let listed = self.set.iter().zip(&self.set_aliases).map(|(r, a)| suspect(r, a, before, series));
            return listed.map(|suspect| self.beside_the_others(suspect, series)).collect();
        }
        if self.observed.other_zero.is_some() {
            return Vec::new();
        }
        let listed = self.own.iter().zip(&self.aliases).filter(|(r, _)| is_listed(r, seen)).take(LISTED);
        listed.map(|(r, a)| suspect(r, a, before, series)).collect()
    }
}

/// Whether a suspect is worth a mention.
fn is_listed(suspect: &Challenger, seen: &Incumbent) -> bool {
    let removes = suspect.share(seen).is_none_or(|share| share > 0.0);
    suspect.passes(seen) || suspect.significant() && removes
}

/// Suspects that are reported of one axis.
const LISTED: usize = 5;

fn id_of(refit: &Challenger) -> &'static str {
    refit.candidate.term.effect.card().id
}

/// What one axis lacks together.
struct Several<'a> {
    /// Each refitted alone beside the model as it stands, what removes most first.
    set: Vec<Challenger<'a>>,
    /// What each cannot be told from.
    aliases: Vec<Vec<String>>,
    /// The model with all of them.
    top: Incumbent<'a>,
}

impl Several<'_> {
    /// Takes a delay, and what cannot be told from one, out of what is missing beside others: where the clocks of two files were set to
    /// each other by their motion, a part of the offset is left, more where other effects hid it. It is no effect of the gyro, and stays
    /// in the model.
    fn leave_the_join(&mut self) {
        let delay = DELAY.card().id;
        let may_be_delay = |k: &usize| id_of(&self.set[*k]) == delay || self.aliases[*k].iter().any(|id| id == delay);
        let (joins, others): (Vec<usize>, Vec<usize>) = (0..self.set.len()).partition(may_be_delay);
        if !others.is_empty() {
            for place in joins.into_iter().rev() {
                self.set.remove(place);
                self.aliases.remove(place);
            }
        }
    }
}

/// What the search ends with that goes on from the suspects of `seen`, axis by axis.
fn several<'a>(
    seen: &Incumbent<'a>,
    suspects: &[Challenger<'a>],
    start: &Model,
    options: &Options,
) -> Vec<Several<'a>> {
    let top = search_on(seen.clone(), Some(suspects.to_vec()), start, options, &mut |_, _| ());
    let series = &seen.study.bench.problem.series;
    let of = |k: usize| {
        let own = judged::axis_model(&top.incumbent.study.model, series[k].axis);
        let alone = added(&top.incumbent, start, series[k].axis).into_iter().filter_map(|id| {
            let known = suspects.iter().find(|r| r.candidate.series == k && id_of(r) == id);
            let refit = |term: &crate::Term| {
                let freedom = term.values.len();
                seen.refit(Candidate { series: k, term: term.clone(), score: 0.0, removes: 0.0, freedom })
            };
            known.cloned().or_else(|| own.term(id).map(refit))
        });
        let set: Vec<Challenger> = alone.sorted_by(|a, b| a.excess.total_cmp(&b.excess)).collect();
        let of_effect = |id: &str| {
            let alike = top.alike.iter().find(|alike: &&Alike| alike.series == k && alike.effect == id);
            alike.map_or_else(Vec::new, |alike| alike.others.clone())
        };
        let aliases = set.iter().map(|refit| of_effect(id_of(refit))).collect();
        Several { set, aliases, top: top.incumbent.clone() }
    };
    (0..series.len()).map(of).collect()
}

/// Axes that share an orientation carry their errors into one another's: while one lacks an effect, what is left on the others may
/// be its.
fn of_one_orientation(mut found: Vec<AxisResult>) -> Vec<AxisResult> {
    let lacks = |d: &&AxisResult| d.finding.names();
    let Some((axis, effect)) =
        found.iter().filter(lacks).find_map(|d| Some((d.axis, d.suspects.first()?.effect.clone())))
    else {
        return found;
    };
    for other in found.iter_mut().filter(|d| d.verdict == Verdict::Unexplained) {
        other.remarks.push(Remark::OtherAxis { axis, effect: effect.clone() });
    }
    found
}

/// The parameters of a model that this log has otherwise, refitted, as `effect.name` with the standard errors between the two, the
/// most first.
#[must_use]
pub fn moved(model: &Model, found: &AxisResult) -> Vec<(String, f64)> {
    let Some(before) = &model.axes[found.axis.index()] else { return Vec::new() };
    let known = before.terms.iter().flat_map(|term| {
        let id = term.effect.card().id;
        term.parameters(found.axis).map(move |(card, value, std_error)| (id, card.name, value, std_error))
    });
    let off = known.filter_map(|(id, name, value, std_error)| {
        let now = found.parameters.iter().find(|p| p.effect == id && p.name == name)?;
        let error = now.std_error?.hypot(if std_error.is_finite() { std_error } else { 0.0 });
        let off = (now.value? - value).abs() / error;
        (off > OTHERWISE).then(|| (format!("{id}.{name}"), off))
    });
    off.sorted_by(|a, b| b.1.total_cmp(&a.1)).collect()
}

/// Standard errors between a model's parameter and what a log has that are no chance.
const OTHERWISE: f64 = 5.0;

fn suspect(refit: &Challenger, aliases: &[String], before: &Judged, series: usize) -> Suspect {
    let axis = refit.study.bench.problem.series[series].axis;
    let after = Judged::new(&refit.study, series, false);
    let (j0, j1) = (before.excess(), after.excess());
    let mut study = refit.study.clone();
    study.stamp(&refit.gls);
    let own = judged::axis_model(&study.model, axis);
    let card = refit.candidate.term.effect.card();
    Suspect {
        effect: card.id.to_owned(),
        aliases: aliases.to_vec(),
        separate_by: split_by(card.id, aliases),
        p_value: finite(refit.p_value),
        error_fall: (!before.within() && j0 > 1.0).then(|| finite((j0 - j1) / (j0 - 1.0))).flatten(),
        log_likelihood_gain: finite(refit.rise / refit.inflation),
        parameters: judged::parameters(own.terms.last().map_or(&[], std::slice::from_ref), axis),
        error_curve: after.points(),
    }
}
