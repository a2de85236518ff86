//! Fits a model to a log by Gauss–Newton steps, taking derivatives only where they have changed.
//!
//! The cost is the error curve over its floor, with z the weighted increments of the residual r(p) over all averaging
//! times τ, and a small precision h that holds each coefficient near zero:
//!
//! ```text
//! f(p) = Σ_τ E(τ)²/F(τ)² + Σ_k h_k p_k² = zᵀz + Σ_k h_k p_k²,     J = ∂z/∂p
//! (JᵀJ + h) Δp = −(Jᵀz + h p)
//! ```
//!
//! While the regressors stand still, r is affine in every coefficient: one J serves all steps. A shape (a delay, a time
//! constant) bends it a little, so J is kept while f falls as it says (the chord method, Kelley, Iterative Methods for
//! Linear and Nonlinear Equations, ch. 5), and taken anew at the end: where it then still leads downhill, the fit goes on.
//!
//! The instant of a step has no useful derivative. Once the other parameters have settled it is sought by halving the search step, from the
//! spacing of the scan's grid to a sample, and the fit goes on from there.

use super::{
    problem::{Evaluation, Problem, Slot},
    study::{Bench, Study, assign, columns, hold, is_tone, parameter_card, values},
    warm::Warm,
};
use crate::{
    Model,
    effects::{Role, Stage},
    nls,
};
use itertools::Itertools;

/// Share by which f may still change from one refreshing of the regressors to the next.
const SETTLED: f64 = 1e-4;
/// Rounds of a fit.
const ROUNDS: usize = 6;
/// Rounds of a fit whose regressors still move by more than [`MOVES`]: the inverse of a strong nonlinearity, found by
/// substitution, converges linearly, its error falling to a third in each round.
const MOST_ROUNDS: usize = 20;
/// The same of a model on trial, which begins from a fitted one.
const TRIAL_ROUNDS: usize = 8;
/// Share of the rate by which the regressors of a settled fit may still move.
const MOVES: f64 = 1e-6;
/// Share of f by which a round has to lower it for the derivatives by shapes to be taken anew.
const BENT: f64 = 0.02;
/// Parts of a log from one instant to the next where a grid has looked for what begins.
const INSTANTS: f64 = 60.0;
/// Times that they are sought.
const SEEKS: usize = 3;
/// Times that the derivatives at the end may send the fit on.
const AGAIN: usize = 3;

/// Derivatives of the residual by the parameters.
struct Jacobian {
    /// ∂r/∂p, one entry a slot, channel by channel.
    columns: Vec<Vec<Vec<f64>>>,
    /// The same as weighted increments.
    increments: Vec<Vec<f64>>,
    /// JᵀJ.
    normal: nls::Normal,
    /// The steps of the log that said nothing where they were taken.
    lost: Vec<bool>,
}

impl Jacobian {
    fn of(bench: &Bench, columns: Vec<Vec<Vec<f64>>>, lost: &[bool]) -> Self {
        let increments: Vec<Vec<f64>> = columns.iter().map(|c| bench.increments(c)).collect();
        let mut normal = nls::Normal::zeros(columns.len());
        for (i, a) in increments.iter().enumerate() {
            for (j, b) in increments.iter().enumerate().take(i + 1) {
                let sum = nls::dot(a, b);
                (normal.matrix[(i, j)], normal.matrix[(j, i)]) = (sum, sum);
            }
        }
        Self { columns, increments, normal, lost: lost.to_vec() }
    }

    /// The normal equations of a residual.
    fn normal(&self, bench: &Bench, residual: &[Vec<f64>]) -> nls::Normal {
        let z = bench.increments(residual);
        let mut normal = self.normal.clone();
        normal.cost = nls::dot(&z, &z);
        normal.gradient = self.increments.iter().map(|column| nls::dot(column, &z)).collect();
        normal
    }
}

/// A fit on its way.
struct Descent<'a> {
    bench: &'a Bench,
    model: Model,
    slots: Vec<Slot>,
    warm: Vec<Warm>,
    unobservable: Vec<usize>,
}

/// Where one round ended.
struct Round {
    cost: f64,
    evaluation: Evaluation,
}

impl<'a> Study<'a> {
    /// Fits every parameter of `start` by minimising Σ_τ E²/F².
    #[must_use]
    pub fn fit(bench: &'a Bench, start: &Model, warm: Option<&[Warm]>) -> Self {
        fit(bench, start, warm, None)
    }

    /// The same from the derivatives of a fitted model that is much like it.
    #[must_use]
    pub fn fit_from(&self, start: &Model, warm: &[Warm]) -> Self {
        fit(self.bench, start, Some(warm), Some(self))
    }

    /// The model as it stands, its derivatives taken but nothing moved.
    #[must_use]
    pub fn held(bench: &'a Bench, model: &Model) -> Self {
        let slots = bench.problem.slots(model);
        Self::hold(bench, model, &slots, refreshed(bench, model), Vec::new())
    }
}

/// Fits every parameter of `start`; `known` is a fitted model whose derivatives it may begin with.
fn fit<'a>(bench: &'a Bench, start: &Model, warm: Option<&[Warm]>, known: Option<&Study>) -> Study<'a> {
    let problem = &bench.problem;
    let model = start.clone();
    let slots = problem.slots(&model);
    let warm = warm.map_or_else(|| problem.cold(), <[Warm]>::to_vec);
    let mut descent = Descent { bench, model, slots, warm, unobservable: Vec::new() };
    let mut at = problem.evaluate(&descent.model, &descent.warm);
    if (0..problem.series.len()).any(|k| problem.unsure(&at, k).is_some()) {
        descent.warm = problem.warm(&at, &descent.warm);
        at = problem.evaluate(&descent.model, &descent.warm);
    }
    let z = bench.increments(&at.residual);
    let mut last = nls::dot(&z, &z);
    let mut jacobian = descent.jacobian(&at, known);
    let longest = if known.is_some() { TRIAL_ROUNDS } else { MOST_ROUNDS };
    let (mut round, mut settled, mut again) = (0, false, 0);
    // An instant that `known` has stands where it was found.
    let knows = |study: &Study| descent.onsets().len() == onsets(problem, &study.model, &study.slots).len();
    let mut seeks = if known.is_some_and(knows) || descent.onsets().is_empty() { 0 } else { SEEKS };
    loop {
        round += 1;
        if jacobian.lost != at.lost {
            jacobian = descent.jacobian(&at, None);
        }
        let hold = hold(problem, &descent.model, &descent.slots, last);
        let done = descent.round(&jacobian, at, &hold);
        let next = problem.warm(&done.evaluation, &descent.warm);
        let moved = moved(&descent.warm, &next);
        descent.warm = next;
        at = problem.evaluate(&descent.model, &descent.warm);
        // The regressors have moved since: only where nothing more falls is it settled.
        let still = (last - done.cost).abs() <= SETTLED * done.cost;
        let bent = last - done.cost > BENT * done.cost && descent.has_shapes();
        last = done.cost;
        let most = if moved > MOVES { longest } else { ROUNDS };
        if (settled && still || round >= most) && seeks > 0 {
            round = 0;
            seeks -= 1;
            if descent.seek_onsets(last) {
                at = problem.evaluate(&descent.model, &descent.warm);
                descent.warm = problem.warm(&at, &descent.warm);
                at = problem.evaluate(&descent.model, &descent.warm);
                jacobian = descent.jacobian(&at, None);
                settled = false;
                continue;
            }
            seeks = 0;
        }
        if settled && still || round >= most {
            jacobian = descent.jacobian(&at, None);
            again += 1;
            if again > AGAIN || round >= longest || !descent.leads_on(&jacobian, &at, &hold) {
                return Study::assembled(
                    bench,
                    descent.model,
                    descent.slots,
                    descent.warm,
                    at,
                    jacobian.columns,
                    descent.unobservable,
                );
            }
            settled = false;
        } else {
            if bent {
                jacobian = descent.jacobian(&at, None);
            }
            settled = still;
        }
    }
}

/// The instants at which something begins, each with all slots that hold it: a clock is one for all axes.
fn onsets(problem: &Problem, model: &Model, slots: &[Slot]) -> Vec<Vec<Slot>> {
    let mut groups: Vec<(&str, Vec<Slot>)> = Vec::new();
    for slot in slots {
        let series = &problem.series[slot.series];
        let Some(term) = problem.axis(model, series).terms.get(slot.term) else { continue };
        let effect = term.effect;
        if !effect.instants(series.axis).contains(&slot.parameter) {
            continue;
        }
        let id = effect.card().id;
        match groups.iter_mut().find(|(known, _)| *known == id).filter(|_| effect.is_of_whole_sensor()) {
            Some((_, group)) => group.push(*slot),
            None => groups.push((id, vec![*slot])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

impl Descent<'_> {
    fn onsets(&self) -> Vec<Vec<Slot>> {
        onsets(&self.bench.problem, &self.model, &self.slots)
    }

    /// Moves instants to where f is least, the other parameters standing: a derivative sees no farther than a sample. By halves, from the
    /// spacing of a grid down to a sample. Whether f has fallen.
    fn seek_onsets(&mut self, last: f64) -> bool {
        let problem = &self.bench.problem;
        let mut least = last;
        for group in self.onsets() {
            let span = problem.series[group[0].series].span();
            let mut step = span.duration / INSTANTS;
            let value = |slot: &Slot| values(problem, &mut self.model.clone(), &[*slot])[0];
            let mut best = value(&group[0]);
            let mut tried: Vec<f64> = group.iter().map(value).collect();
            while step > 0.5 * span.dt {
                tried.extend([best - step, best + step]);
                for instant in std::mem::take(&mut tried) {
                    let mut trial = self.model.clone();
                    assign(problem, &mut trial, &group, &vec![instant; group.len()]);
                    let at = problem.evaluate(&trial, &self.warm);
                    // What is a guess is so about the instant that is tried.
                    let warm: Vec<Warm> =
                        self.warm.iter().zip(&at.tracks).map(|(warm, track)| warm.unsure_as(&track.unsure)).collect();
                    let z = self.bench.increments(&problem.evaluate(&trial, &warm).residual);
                    let cost = nls::dot(&z, &z);
                    if cost < least {
                        (least, best) = (cost, instant);
                        self.model = trial;
                    }
                }
                step *= 0.5;
            }
        }
        least < (1.0 - SETTLED) * last
    }

    fn has_shapes(&self) -> bool {
        self.slots.iter().any(|slot| parameter_card(&self.bench.problem, &self.model, *slot).role != Role::Linear)
    }

    /// The derivatives here; those that `known` has by the same parameters are taken from there.
    fn jacobian(&self, at: &Evaluation, known: Option<&Study>) -> Jacobian {
        let problem = &self.bench.problem;
        let known = known.filter(|study| study.evaluation.lost == at.lost);
        let id = |model: &Model, slot: &Slot| {
            let axis = model.axes[problem.series[slot.series].axis.index()].as_ref();
            axis.and_then(|axis| axis.terms.get(slot.term)).map(|term| term.effect.card().id)
        };
        let same = |slot: &Slot| {
            let study = known?;
            let is = |other: &Slot| {
                other.series == slot.series
                    && other.parameter == slot.parameter
                    && id(&study.model, other) == id(&self.model, slot)
            };
            study.slots.iter().position(is).map(|k| study.columns[k].clone())
        };
        let new = |slot: &Slot| columns(problem, &self.model, &[*slot], &self.warm, at).swap_remove(0);
        let columns = self.slots.iter().map(|slot| same(slot).unwrap_or_else(|| new(slot))).collect();
        Jacobian::of(self.bench, columns, &at.lost)
    }

    /// Adds to normal equations what holds the parameters near zero; those that are not fitted stand where they are.
    fn held(&self, mut normal: nls::Normal, p: &[f64], hold: &[f64]) -> nls::Normal {
        for (k, (precision, value)) in hold.iter().zip(p).enumerate() {
            normal.cost += precision * value * value;
            normal.gradient[k] += precision * value;
            normal.matrix[(k, k)] += precision;
        }
        for k in (0..p.len()).filter(|&k| self.stands(self.slots[k])) {
            normal.fix(k);
        }
        normal
    }

    /// Whether these steps leave a parameter where it is: a tone hardly moves the increments, so what the likelihood says of it stands;
    /// and a clock that is set a moment later moves no more than that moment, which a derivative sees nothing of.
    fn stands(&self, slot: Slot) -> bool {
        let problem = &self.bench.problem;
        let clock = |slot: &Slot| {
            let terms = &problem.axis(&self.model, &problem.series[slot.series]).terms;
            terms[slot.term].effect.stage() == Stage::Timing
        };
        is_tone(problem, &self.model, slot) || self.onsets().concat().iter().any(|onset| *onset == slot && clock(onset))
    }

    fn bounds(&self, p: &[f64]) -> Vec<(f64, f64)> {
        let problem = &self.bench.problem;
        let of = |(slot, at): (&Slot, &f64)| {
            if self.stands(*slot) { (*at, *at) } else { parameter_card(problem, &self.model, *slot).bounds }
        };
        self.slots.iter().zip(p).map(of).collect()
    }

    /// Steps with these derivatives, the regressors standing still.
    fn round(&mut self, jacobian: &Jacobian, at: Evaluation, hold: &[f64]) -> Round {
        let problem = &self.bench.problem;
        let before = values(problem, &mut self.model.clone(), &self.slots);
        let bounds = self.bounds(&before);
        let mut trial = self.model.clone();
        let mut seen = vec![(before.clone(), jacobian.normal(self.bench, &at.residual), at)];
        let solution = nls::minimise(
            &before,
            &bounds,
            |p, _| {
                if !seen.iter().any(|(at, ..)| at == p) {
                    assign(problem, &mut trial, &self.slots, p);
                    let evaluation = problem.evaluate(&trial, &self.warm);
                    let normal = jacobian.normal(self.bench, &evaluation.residual);
                    seen.push((p.to_vec(), normal, evaluation));
                }
                let (_, normal, _) = seen.iter().find(|(at, ..)| at == p).unwrap_or(&seen[0]);
                self.held(normal.clone(), p, hold)
            },
            // However far a step has to be shortened before it is taken: a shape's first one may lead anywhere.
            &nls::Options { max_accepted: 2, tolerance: 1e-6, ..nls::Options::default() },
        );
        let place = seen.iter().position(|(at, ..)| *at == solution.values).unwrap_or(0);
        assign(problem, &mut self.model, &self.slots, &solution.values);
        self.unobservable = solution.unobservable;
        Round { cost: solution.cost, evaluation: seen.swap_remove(place).2 }
    }

    /// Whether these derivatives promise that f falls by more than a settled fit's may.
    fn leads_on(&self, jacobian: &Jacobian, at: &Evaluation, hold: &[f64]) -> bool {
        let p = values(&self.bench.problem, &mut self.model.clone(), &self.slots);
        let normal = self.held(jacobian.normal(self.bench, &at.residual), &p, hold);
        let step = normal.step_from(&normal, 1e-9);
        let bounds = self.bounds(&p);
        let inside: Vec<f64> = p.iter().zip(&step).zip(bounds).map(|((v, s), b)| (v + s).clamp(b.0, b.1) - v).collect();
        normal.cost - normal.cost_after(&inside) > SETTLED * normal.cost
    }
}

/// How far the rates have moved that the regressors are evaluated at, over their size: the largest of the axes.
fn moved(from: &[Warm], to: &[Warm]) -> f64 {
    let share = |(from, to): (&Warm, &Warm)| {
        let pairs = from.rate.iter().zip(&to.rate);
        let (moved, size) = pairs.fold((0.0, 0.0), |(moved, size), (a, b)| (moved + (a - b).powi(2), size + b * b));
        if size > 0.0 { (moved / size).sqrt() } else { 0.0 }
    };
    from.iter().zip(to).map(share).fold(0.0, f64::max)
}

/// Refreshes the regressors of a model whose parameters stand until they stand too.
fn refreshed(bench: &Bench, model: &Model) -> Vec<Warm> {
    let mut warm = bench.problem.cold();
    for round in 1..=MOST_ROUNDS {
        let next = bench.problem.warm(&bench.problem.evaluate(model, &warm), &warm);
        let moved = moved(&warm, &next);
        warm = next;
        if round >= 2 && moved <= MOVES {
            break;
        }
    }
    warm
}
