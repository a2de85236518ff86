//! Effects whose undoing makes noise less, whatever else it does.

use crate::{
    Axis, Term,
    effects::{Stage, Trait},
    evidence::{draws::draw_through, study::Study},
};
use std::f64::consts::{SQRT_2, TAU};

/// Whether undoing a term makes the noise of the error curve less: comparing with a smoothed reference does where the gyro's noise counts
/// beside the reference's, and so does the inverse of a resonance, 1 − (f/f₀)² but for the damping, where the error curve sees little of
/// what lies above √2 f₀. A window that is narrower than the samples are apart also stands for what is guessed between them.
pub(super) fn is_mean(term: &Term, study: &Study, series: usize) -> bool {
    let may_be = term.effect.stage() == Stage::Shown || term.effect.is(Trait::Resonance);
    let s = &study.bench.problem.series[series];
    may_be && (width(term, s.axis) < s.span().dt || quietens(term, study, series))
}

/// The width, s, of the window that takes as much from slow motion: that of a resonance is √2/(2π f₀).
fn width(term: &Term, axis: Axis) -> f64 {
    let is_frequency = term.effect.parameters(axis).first().is_some_and(|card| card.unit == "Hz");
    let value = term.values.first().copied().unwrap_or(0.0);
    if is_frequency { SQRT_2 / (TAU * value) } else { value }
}

/// Whether noise alone has less of an error where the model of `study` undoes `term` too.
fn quietens(term: &Term, study: &Study, series: usize) -> bool {
    let bench = study.bench;
    let axis = bench.problem.series[series].axis.index();
    let terms = study.model.axes[axis].as_ref().map_or(&[][..], |model| &model.terms);
    let without: Vec<Term> =
        terms.iter().filter(|other| other.effect.card().id != term.effect.card().id).cloned().collect();
    let square = |draw: Vec<f64>| -> f64 { bench.increments(&[draw]).iter().map(|z| z * z).sum() };
    let [mut all, mut less] = [0.0; 2];
    for seed in 0..DRAWN {
        let [plain, undone] = draw_through(bench, series, &study.warm[series], [&without, terms], seed);
        (all, less) = (all + square(plain), less + square(undone));
    }
    less < QUIETER * all
}

/// Draws of noise from which that is seen.
const DRAWN: u64 = 2;
/// Share of the error² that noise alone has left, 1, below which it is less.
const QUIETER: f64 = 0.99;
