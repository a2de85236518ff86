//! A model fitted to a log: its parameters, its residual, and the derivatives there.

use super::{
    increments::{Grams, HeldOut, Windows},
    prior::{self, Prior},
    problem::{Evaluation, Problem, Slot, value},
    series::{Beside, Reading, Rest, Series},
    warm::Warm,
};
use crate::{
    Axis, AxisModel, Model, Record,
    effects::{Role, Trait},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::sync::OnceLock;

/// A log ready to be fitted: everything that does not depend on the model.
#[derive(Clone, Debug)]
pub struct Bench {
    /// Columns and residuals.
    pub problem: Problem,
    /// The increments of the error curve.
    pub windows: Windows,
    /// A few of them, for scans.
    pub coarse: Windows,
    /// Noise known beforehand, one an axis.
    pub prior: Vec<Prior>,
    /// The weights' F(τ): the axes' prior floors, in the mean square.
    pub weights: Vec<f64>,
    /// What each axis was laid out beside.
    beside: Vec<Beside>,
    thin: OnceLock<Option<Box<Self>>>,
}

impl Bench {
    /// Lays out the axes of `record` that share a reference, beside the others as `model` calibrates them; `None` where
    /// they have none.
    #[must_use]
    pub fn new(record: &Record, axes: &[Axis], model: &Model) -> Option<Self> {
        let mut problem = Problem::new(record, axes, model)?;
        let windows = Windows::new(problem.times());
        if windows.tau.len() < 3 {
            return None;
        }
        let prior = prior::priors(&problem);
        problem.series.iter_mut().for_each(Series::forget_quiet);
        let coarse = Windows::with(problem.times(), COARSE / problem.channels());
        let (beside, thin) = (beside(axes, model), OnceLock::new());
        let mut bench = Self { problem, windows, coarse, prior: Vec::new(), weights: Vec::new(), beside, thin };
        bench.know(&prior);
        Some(bench)
    }

    /// The axes.
    #[must_use]
    pub fn axes(&self) -> Vec<Axis> {
        self.problem.series.iter().map(|series| series.axis).collect()
    }

    /// The same with the log at less detail, laid out beside the same model.
    #[must_use]
    pub(crate) fn with_thin(self, thin: Option<Self>) -> Self {
        Self { thin: OnceLock::from(thin.map(Box::new)), ..self }
    }

    /// Whether the same log would be laid out as this one for these axes beside another model.
    #[must_use]
    pub(crate) fn serves(&self, axes: &[Axis], model: &Model) -> bool {
        self.axes() == axes && self.beside == beside(axes, model)
    }

    /// The same log at less detail beside a model, as `lay` lays it out: once, where this one serves that model, too.
    #[must_use]
    pub(crate) fn thin(&self, model: &Model, lay: impl FnOnce() -> Option<Self>) -> Option<Self> {
        if !self.serves(&self.axes(), model) {
            return lay();
        }
        self.thin.get_or_init(|| lay().map(Box::new)).as_deref().cloned()
    }

    /// Increments of one series, all channels, weighted so that the sum of their squares is Σ_τ E²/F².
    pub(crate) fn increments(&self, series: &[Vec<f64>]) -> Vec<f64> {
        self.windows.weigh(series, &self.weights)
    }

    /// Takes what is known beforehand of each axis' noise.
    pub(crate) fn know(&mut self, prior: &[Prior]) {
        let rests: Vec<Rest> =
            self.problem.series.iter().zip(prior).map(|(s, p)| prior::rests(&self.problem, s, p)).collect();
        for ((series, prior), rest) in self.problem.series.iter_mut().zip(prior).zip(rests) {
            series.rest = rest;
            series.margin = MARGIN * prior.reading / series.span().dt.sqrt();
        }
        let each: Vec<Vec<f64>> = prior.iter().map(|p| prior::weights(p, &self.windows.tau)).collect();
        self.weights = (0..self.windows.tau.len())
            .map(|k| (each.iter().map(|w| w[k] * w[k]).sum::<f64>() / each.len() as f64).sqrt())
            .collect();
        let rounding = |s: &Series, p: &Prior| p.rounding.as_ref().map(|rounding| rounding.on(s));
        let own = self.problem.series.iter().zip(prior).map(|(s, p)| Prior { rounding: rounding(s, p), ..p.clone() });
        self.prior = own.collect();
    }
}

fn beside(axes: &[Axis], model: &Model) -> Vec<Beside> {
    axes.iter().map(|axis| Beside::of(model, *axis)).collect()
}

/// Increments of an averaging time, over all channels, that a scan looks at.
const COARSE: usize = 1500;

/// Standard deviations of a reading's noise within which a limit bends its distribution.
const MARGIN: f64 = 3.5;

/// A model at its best on a log.
#[derive(Clone, Debug)]
pub struct Study<'a> {
    /// The log.
    pub bench: &'a Bench,
    /// The model, fitted.
    pub model: Model,
    /// Its free parameters.
    pub slots: Vec<Slot>,
    /// Where its regressors are evaluated.
    pub warm: Vec<Warm>,
    /// Residual and rates.
    pub evaluation: Evaluation,
    /// ∂r/∂p, one entry a slot.
    pub columns: Vec<Vec<Vec<f64>>>,
    /// Increments of residual and columns (all channels).
    pub grams: Grams,
    /// Parameters (indices into `slots`) that the log does not determine.
    pub unobservable: Vec<usize>,
    /// Precision with which each parameter is held near zero, or near its value where blocks are left out.
    pub hold: Vec<f64>,
    /// One in so many readings is what its likelihood is made of.
    pub every: usize,
    shaken: OnceLock<Box<Shaken>>,
}

impl<'a> Study<'a> {
    /// A model with these parameters free, its derivatives taken where its regressors are evaluated.
    pub(super) fn hold(
        bench: &'a Bench,
        model: &Model,
        slots: &[Slot],
        warm: Vec<Warm>,
        unobservable: Vec<usize>,
    ) -> Self {
        let evaluation = bench.problem.evaluate(model, &warm);
        let columns = columns(&bench.problem, model, slots, &warm, &evaluation);
        Self::assembled(bench, model.clone(), slots.to_vec(), warm, evaluation, columns, unobservable)
    }

    pub(super) fn assembled(
        bench: &'a Bench,
        model: Model,
        slots: Vec<Slot>,
        warm: Vec<Warm>,
        evaluation: Evaluation,
        columns: Vec<Vec<Vec<f64>>>,
        unobservable: Vec<usize>,
    ) -> Self {
        let grams = grams(bench, &evaluation, &columns, None);
        let cost = grams.normal(&bench.windows.tau, &bench.weights).cost;
        let hold = hold(&bench.problem, &model, &slots, cost);
        Self {
            bench,
            model,
            slots,
            warm,
            evaluation,
            columns,
            grams,
            unobservable,
            hold,
            every: 1,
            shaken: OnceLock::new(),
        }
    }

    /// The same where the likelihood is made of one in so many readings.
    #[must_use]
    pub fn reading(self, every: usize) -> Self {
        Self { every, ..self }
    }

    /// The scale factors among its parameters: which, and their values.
    pub(super) fn scales(&self) -> impl Iterator<Item = (usize, f64)> {
        let problem = &self.bench.problem;
        let scale = |(k, slot): (usize, &Slot)| {
            let term = problem.axis(&self.model, &problem.series[slot.series]).terms.get(slot.term)?;
            term.effect.is(Trait::Gain).then(|| (k, term.values[slot.parameter]))
        };
        self.slots.iter().enumerate().filter_map(scale)
    }

    /// What noise of the gyro adds to residual and columns: of the N that is asked for first, axis by axis.
    pub(super) fn shaken(&self, white: &[f64]) -> &Shaken {
        self.shaken.get_or_init(|| Box::new(Shaken::of(self, white)))
    }

    /// Where its regressors are evaluated, for another model that is to be compared with this one on the same samples.
    #[must_use]
    pub fn frozen(&self) -> Vec<Warm> {
        self.warm.iter().map(Warm::frozen).collect()
    }

    /// The residual as the filter reads it: at each reading less what that is off by, but where an encoder stands because its
    /// shaft is inside a play, and not because it turns round within a count.
    #[must_use]
    pub fn as_read(&self) -> Vec<Vec<f64>> {
        (0..self.evaluation.residual.len()).map(|channel| self.channel_as_read(channel)).collect()
    }

    /// The same of one channel.
    #[must_use]
    pub fn channel_as_read(&self, channel: usize) -> Vec<f64> {
        let mut residual = self.evaluation.residual[channel].clone();
        // Empty where the reference is no shaft's angle.
        let silent = &self.evaluation.tracks[0].silent;
        let moves = |reading: &&Reading| silent.get(reading.row) != Some(&true);
        for reading in self.bench.problem.series[0].readings.iter().filter(moves) {
            residual[reading.row] -= reading.off;
        }
        residual
    }

    /// Whether hardly any of the log is cut off or left out.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.evaluation.silent() < 0.01
    }

    /// Whether it leaves out samples that its model makes unsure.
    #[must_use]
    pub fn leaves_out(&self) -> bool {
        self.warm.iter().any(|w| w.unsure.contains(&true))
    }

    /// Share of the steps that its model leaves out, or will leave out once it is fitted on its own. A trial beside another model keeps
    /// that model's rows, and judges there what its own model is unsure of.
    #[must_use]
    pub fn share_left_out(&self) -> f64 {
        let problem = &self.bench.problem;
        let mut silent = self.evaluation.lost.clone();
        for unsure in (0..problem.series.len()).filter_map(|k| problem.unsure(&self.evaluation, k)) {
            silent.iter_mut().zip(&unsure).for_each(|(silent, unsure)| *silent |= unsure);
        }
        silent.iter().filter(|silent| **silent).count() as f64 / silent.len() as f64
    }

    /// Held-out errors of all channels together.
    #[must_use]
    pub fn held_out(&self) -> HeldOut {
        self.grams.held_out(&self.bench.windows.tau, &self.bench.weights, &self.hold)
    }

    /// Held-out errors about one axis, and its own weights: of a shaft these are all there are.
    #[must_use]
    pub fn held_out_about(&self, series: usize) -> (HeldOut, Vec<f64>) {
        let bench = self.bench;
        if bench.problem.attitude().is_none() {
            return (self.held_out(), self.weights(series));
        }
        let about = grams(bench, &self.evaluation, &self.columns, Some(bench.problem.series[series].axis.index()));
        let held = self.grams.held_out_on(&about, &bench.windows.tau, &bench.weights, &self.hold);
        (held, self.weights(series))
    }

    /// F(τ) of one axis. Each stretch that is bridged leaves the noise of two readings of the reference in the angle: n of
    /// them in a time T are a walk.
    ///
    /// ```text
    /// F² = N²/τ + 2σ²/τ² + 2σ² n/(Tτ)
    /// ```
    #[must_use]
    pub fn weights(&self, series: usize) -> Vec<f64> {
        let (lost, t, prior) = (&self.evaluation.lost, self.bench.problem.times(), &self.bench.prior[series]);
        let bridged = lost.windows(2).filter(|pair| pair[1] && !pair[0]).count();
        let often = bridged as f64 / (t[t.len() - 1] - t[0]);
        let tau = &self.bench.windows.tau;
        let own = prior::weights(prior, tau).into_iter().zip(tau);
        own.map(|(f, tau)| f.hypot((2.0 * often / tau).sqrt() * prior.encoder)).collect()
    }

    /// The largest error over the weights' floor, held out.
    #[must_use]
    pub fn over_floor(&self) -> f64 {
        self.largest(&self.held_out())
    }

    /// The same with the parameters as they stand.
    #[must_use]
    pub fn over_floor_as_is(&self) -> f64 {
        self.largest(&self.grams.as_is(&self.bench.windows.tau))
    }

    fn largest(&self, errors: &HeldOut) -> f64 {
        let each: Vec<Vec<f64>> = (0..self.bench.problem.series.len()).map(|k| self.weights(k)).collect();
        let floor = |k: usize| (each.iter().map(|w| w[k] * w[k]).sum::<f64>() / each.len() as f64).sqrt();
        errors.curve().iter().enumerate().map(|(k, error)| error / floor(k)).fold(0.0, f64::max)
    }
}

/// What a draw of the gyro's noise adds to the residual of a model and to its derivatives.
#[derive(Clone, Debug)]
pub(super) struct Shaken {
    /// By channel.
    pub(super) residual: Vec<Vec<f64>>,
    /// By slot and channel.
    pub(super) columns: Vec<Vec<Vec<f64>>>,
}

impl Shaken {
    /// A draw of white noise on the readings of every axis, each with its N, rad/√s.
    pub(super) fn of(study: &Study, white: &[f64]) -> Self {
        let (bench, model, warm, at) = (study.bench, &study.model, &study.warm, &study.evaluation);
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut problem = bench.problem.clone();
        for (series, white) in problem.series.iter_mut().zip(white) {
            let alpha = model.axes[series.axis.index()].as_ref().map_or(1.0, AxisModel::alpha);
            let size = white / (alpha.abs().max(0.1) * series.span().dt.sqrt());
            for reading in &mut series.gyro {
                let normal: f64 = StandardNormal.sample(&mut random);
                *reading += size * normal;
            }
        }
        let own = problem.warm(&problem.evaluate(model, warm), warm);
        let evaluation = problem.evaluate(model, &own);
        let less = |mut a: Vec<Vec<f64>>, b: &[Vec<f64>]| {
            a.iter_mut().zip(b).for_each(|(a, b)| a.iter_mut().zip(b).for_each(|(a, b)| *a -= b));
            a
        };
        let moved = columns(&problem, model, &study.slots, &own, &evaluation);
        Self {
            columns: moved.into_iter().zip(&study.columns).map(|(a, b)| less(a, b)).collect(),
            residual: less(evaluation.residual, &at.residual),
        }
    }
}

pub(super) fn is_tone(problem: &Problem, model: &Model, slot: Slot) -> bool {
    let terms = model.axes[problem.series[slot.series].axis.index()].as_ref().map_or(&[][..], |m| &m.terms);
    terms[slot.term].effect.is(Trait::Line)
}

/// Precision with which the coefficients of effects are held near zero: one [`FAR`] times its typical size costs the
/// share [`HELD`] of the present error. What the data determine does not feel it; what they hardly do (a component of
/// the acceleration that stays the same) does not run off to explain something else.
pub(super) fn hold(problem: &Problem, model: &Model, slots: &[Slot], cost: f64) -> Vec<f64> {
    slots
        .iter()
        .map(|slot| {
            let card = parameter_card(problem, model, *slot);
            let held = card.role == Role::Linear && card.neutral == 0.0 && card.typical != 0.0 && card.name != "delta";
            if held { HELD * cost / (FAR * card.typical).powi(2) } else { 0.0 }
        })
        .collect()
}

const FAR: f64 = 10.0;
const HELD: f64 = 5e-3;

fn scale(typical: f64, value: f64) -> f64 {
    let typical = if typical.is_finite() { typical.abs() } else { 0.0 };
    typical.max(value.abs()).max(1e-9)
}

pub(super) fn parameter_card(problem: &Problem, model: &Model, slot: Slot) -> &'static crate::effects::ParameterCard {
    let axis = problem.series[slot.series].axis;
    let terms = model.axes[axis.index()].as_ref().map_or(&[][..], |m| &m.terms);
    &terms[slot.term].effect.parameters(axis)[slot.parameter]
}

/// Parameter values in the order of the slots.
pub(crate) fn values(problem: &Problem, model: &mut Model, slots: &[Slot]) -> Vec<f64> {
    slots.iter().map(|s| value(problem, model, *s).map_or(f64::NAN, |v| *v)).collect()
}

pub(super) fn assign(problem: &Problem, model: &mut Model, slots: &[Slot], values: &[f64]) {
    for (slot, v) in slots.iter().zip(values) {
        if let Some(place) = value(problem, model, *slot) {
            *place = *v;
        }
    }
}

/// ∂r/∂p by differences, the regressors held at `warm`; `at` is the evaluation of `model`.
pub(crate) fn columns(
    problem: &Problem,
    model: &Model,
    slots: &[Slot],
    warm: &[Warm],
    at: &Evaluation,
) -> Vec<Vec<Vec<f64>>> {
    let column = |slot: &Slot| {
        let card = parameter_card(problem, model, *slot);
        let axis = problem.series[slot.series].axis.index();
        let Some(own) = model.axes[axis].as_ref().and_then(|own| own.terms.get(slot.term)) else { return Vec::new() };
        let place = own.values[slot.parameter];
        let mut h = if card.role == Role::Linear {
            1e-2 * scale(card.typical, place)
        } else if is_tone(problem, model, *slot) {
            // Its phase goes through the log.
            let t = &problem.series[slot.series].t;
            1e-3 / (t[t.len() - 1] - t[0])
        } else {
            1e-3 * scale(card.typical, place)
        };
        if place + h > card.bounds.1 {
            h = -h;
        }
        let mut term = own.clone();
        term.values[slot.parameter] = place + h;
        scaled(problem.difference(model, warm, at, (slot.series, slot.term), &term), h)
    };
    slots.iter().map(column).collect()
}

/// A change over the step h of the parameter that made it.
pub(crate) fn scaled(mut change: Vec<Vec<f64>>, h: f64) -> Vec<Vec<f64>> {
    change.iter_mut().flatten().for_each(|x| *x /= h);
    change
}

/// Increments of residual and columns.
pub(crate) fn grams(bench: &Bench, at: &Evaluation, columns: &[Vec<Vec<f64>>], component: Option<usize>) -> Grams {
    let columns: Vec<&[Vec<f64>]> = columns.iter().map(Vec::as_slice).collect();
    bench.windows.grams(&bench.problem, &[&at.residual], &columns, component).swap_remove(0)
}
