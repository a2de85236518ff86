//! One axis of a model on a log: what its readings become, step by step, and what one term's change makes of that.
//!
//! ```text
//! reading → α, δ → response of the sensor undone → errors subtracted → response of the mount undone → re-stamped angle
//! reference angle → errors of the reference subtracted
//! re-stamped angle → what the reference shows of it, evaluated at the motion that is known
//! ```
//!
//! Everything is linear in the rate but a play, and errors of different terms add up. So where one term changes, only
//! its own step and those behind it are taken again ([`Tracker::moved`]).

use super::{
    integrate::{cubic, hermite, integral},
    series::{HOLE, Series},
    shaft::{best_angle, turning_point},
    warm::{Quiet, Warm},
};
use crate::{
    Term,
    effects::{Memory, Signals, Stage, Trait, Window, derivative},
};
use std::sync::Arc;

/// One axis of an evaluation.
#[derive(Clone, Debug)]
pub struct Track {
    /// Compensated rate at the samples, rad/s.
    pub rate: Arc<Vec<f64>>,
    /// The same before what the mount adds was undone, where it adds something.
    pub(super) felt: Option<Arc<Vec<f64>>>,
    /// Σ of the felt errors that were subtracted, rad/s; empty where there are none.
    errors: Arc<Vec<f64>>,
    /// Its integral at the samples' times, re-stamped, rad.
    pub(super) whole: Arc<Vec<f64>>,
    /// Whether readings are valid at other times than they are stamped.
    pub(super) restamped: bool,
    /// The same at the reference's rows, rad.
    pub(super) angle: Vec<f64>,
    /// What the reference shows of that angle, less the angle, rad; empty where it shows the angle itself.
    pub(super) off: Vec<f64>,
    /// The reference less its own errors, rad.
    pub(super) reference: Vec<f64>,
    /// Reference rows that say nothing of the angle.
    pub(super) silent: Vec<bool>,
    pub(super) lost: Vec<bool>,
    pub(super) any_lost: bool,
    pub(super) unsure: Vec<bool>,
}

impl Track {
    /// The reference less its own errors, at its rows, rad.
    #[must_use]
    pub fn reference(&self) -> &[f64] {
        &self.reference
    }

    /// What the encoder counts: the best known angle, and at the reference rows what the model says that the encoder errs by.
    pub(super) fn counted_angle(&self, s: &Series, half: f64) -> Vec<f64> {
        let mut angle = best_angle(s, &self.reference, &self.silent, &self.whole, &self.lost, half);
        for ((&k, read), right) in s.reference_rows.iter().zip(&s.reference_angle).zip(&self.reference) {
            angle[k] += read - right;
        }
        angle
    }
}

/// Where in a play of the sensor a rate stands that is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HeldRate {
    /// Anywhere: a shaft that settles, or trembles, goes back as far as nobody sees. Such readings say nothing.
    #[default]
    Anywhere,
    /// At the end that it came to: nothing moves it back.
    AtTheEnd,
}

/// What one axis is evaluated with.
#[derive(Clone, Copy)]
pub(super) struct Tracker<'a> {
    /// All axes that share the reference.
    pub series: &'a [Series],
    /// This one among them.
    pub index: usize,
    /// What the regressors are evaluated at, axis by axis.
    pub warm: &'a [Warm],
    /// What is known of a rate that is held inside a play.
    pub held_rate: HeldRate,
}

/// The angle of a rate with what these terms do to it and to its times undone, at the samples, rad.
pub(super) fn undone(s: &Series, terms: &[Term], rate: &[f64]) -> Vec<f64> {
    let of = |stage: Stage| terms.iter().filter(move |t| t.effect.stage() == stage);
    let undo = |rate: Vec<f64>, t: &Term| t.effect.undo_response_whole(&t.values, &s.t, &rate);
    let rate = of(Stage::Response).fold(rate.to_vec(), undo);
    let timing: Vec<&Term> = of(Stage::Timing).collect();
    if timing.is_empty() { integral(&s.t, &rate) } else { restamped(s, 0.0, &rate, &timing) }
}

/// What this axis' noise, an angle at the samples, makes of the angle that the reference shows by these terms, at its rows, rad:
/// the model takes it for motion as far as it is as slow. Empty where the reference shows the angle itself.
pub(super) fn shown_of_noise(s: &Series, terms: &[Term], warm: &Warm, noise: &[f64]) -> Vec<f64> {
    let as_motion = warm.motion(&s.t).likewise(&s.t, noise);
    off(s, terms, || &as_motion)
}

/// The rate that a sensor felt, its readings' scale, bias and response undone, its errors still in it, rad/s.
pub(crate) fn felt(s: &Series, terms: &[Term]) -> Vec<f64> {
    felt_but(s, terms, &lost(s, terms))
}

impl Tracker<'_> {
    fn own(&self) -> &Series {
        &self.series[self.index]
    }

    /// One axis: compensated rate, its angle at the reference rows, the reference less its own errors.
    pub(super) fn track(&self, terms: &[Term]) -> Track {
        let (s, warm) = (self.own(), &self.warm[self.index]);
        let of = |stage: Stage| terms.iter().filter(move |t| t.effect.stage() == stage);
        let mut lost = lost(s, terms);
        let response: Vec<&Term> = of(Stage::Response).collect();
        let timing: Vec<&Term> = of(Stage::Timing).collect();
        let mut unsure = displaced(&s.t, &lost, &response, &timing);
        let mut rate = felt_but(s, terms, &lost);
        for without in [&warm.unsure, &warm.left_out] {
            merge(&mut lost, without);
        }
        let terms_felt: Vec<&Term> = of(Stage::Felt).collect();
        let mut errors = Vec::new();
        if !terms_felt.is_empty() {
            let before = rate.clone();
            merge(&mut unsure, &self.subtract_errors(&terms_felt, &mut rate));
            errors = before.iter().zip(&rate).map(|(before, rate)| before - rate).collect();
        }
        let mut felt = None;
        for term in response.into_iter().filter(|term| is_of_mount(term)) {
            let undone = term.effect.undo_response_whole(&term.values, &s.t, &rate);
            felt.get_or_insert(std::mem::replace(&mut rate, undone));
        }
        let felt = felt.map(Arc::new);
        let whole = stamped(s, calibration(terms).0, &rate, terms);
        let angle = at_rows(s, &whole);
        let off = off(s, terms, || warm.motion(&s.t));
        if let Some(reach) = of(Stage::Shown).map(|term| term.effect.reach(&term.values)).reduce(f64::max) {
            let (first, last) = (s.t[0] + reach, s.t[s.t.len() - 1] - reach);
            merge(&mut unsure, &s.t.iter().map(|t| *t < first || *t > last).collect::<Vec<_>>());
        }
        let mut reference = s.reference_angle.clone();
        let mut silent = vec![false; reference.len()];
        for term in of(Stage::Reference) {
            let mut known = 0;
            reference_errors(s, term, warm, |i, error, memory| {
                silent[i] |= term.effect.silent(&term.values, error);
                reference[i] -= error;
                if term.effect.is_guess(&term.values, memory) {
                    known = s.reference_rows[i] + 1;
                }
            });
            if known > 0 {
                unsure.resize(s.t.len(), false);
                unsure[..known].fill(true);
            }
        }
        let any_lost = lost.iter().any(|&l| l);
        Track {
            rate: Arc::new(rate),
            felt,
            errors: Arc::new(errors),
            whole: Arc::new(whole),
            restamped: !timing.is_empty(),
            angle,
            off,
            reference,
            silent,
            lost,
            any_lost,
            unsure,
        }
    }

    /// ω̂ = u − Σ error(ω̂), the errors at the warm rate that the sensor felt: the fixed point is in the refreshing of it.
    /// Gives the samples at which an error is a guess.
    fn subtract_errors(&self, errors: &[&Term], rate: &mut [f64]) -> Vec<bool> {
        let (ahead, errors): (Vec<&Term>, Vec<&Term>) = errors.iter().partition(|t| t.effect.is_play());
        let mut memories = vec![Memory::default(); errors.len()];
        for (k, rate) in rate.iter_mut().enumerate() {
            let signals = self.signals(k);
            let mut sum = 0.0;
            for (term, memory) in errors.iter().zip(&mut memories) {
                sum += term.effect.error_seen(&term.values, &signals, memory);
            }
            *rate -= sum;
        }
        let mut unsure = Vec::new();
        for term in ahead {
            let mut whole = term.effect.error_whole(&term.values, &self.own().t, rate);
            if self.held_rate == HeldRate::Anywhere {
                merge(&mut whole.unsure, &whole.held);
            }
            rate.iter_mut().zip(whole.error).for_each(|(rate, error)| *rate -= error);
            unsure = whole.unsure;
        }
        unsure
    }

    /// What the regressors of one axis see at sample `k`.
    fn signals(&self, k: usize) -> Signals {
        let (s, warm) = (self.own(), &self.warm[self.index]);
        let mut signals = s.signals(k);
        for (other, w) in self.series.iter().zip(self.warm) {
            signals.rates[other.axis.index()] = w.rate[k];
        }
        if let Some(felt) = warm.felt.get(k) {
            signals.rates[s.axis.index()] = *felt;
        }
        signals.rate_dot = warm.rate_dot[k];
        signals.angle = warm.angle[k];
        signals
    }

    /// What the change of term `place` of an axis moves; `None` where all has to be done again.
    pub(super) fn moved(&self, terms: &[Term], other: &[Term], place: usize, at: &Track) -> Option<Moved> {
        let (s, warm) = (self.own(), &self.warm[self.index]);
        let (was, now) = (terms.get(place), &other[place]);
        let has_play = other.iter().any(|term| term.effect.is_play());
        let rate_of = |felt: Vec<f64>| {
            let mounts = other.iter().filter(|term| is_of_mount(term));
            mounts.fold(felt, |rate, term| term.effect.undo_response_whole(&term.values, &s.t, &rate))
        };
        match now.effect.stage() {
            Stage::Felt if !has_play => {
                let (mut old, mut new) = (Memory::default(), Memory::default());
                let change = (0..s.t.len()).map(|k| {
                    let signals = self.signals(k);
                    let before = was.map_or(0.0, |was| was.effect.error_seen(&was.values, &signals, &mut old));
                    before - now.effect.error_seen(&now.values, &signals, &mut new)
                });
                let whole = stamped(s, 0.0, &rate_of(change.collect()), other);
                Some(Moved::Angle(at.angle.iter().zip(at_rows(s, &whole)).map(|(a, b)| a + b).collect()))
            }
            Stage::Timing => Some(Moved::Angle(at_rows(s, &stamped(s, calibration(other).0, &at.rate, other)))),
            Stage::Shown => Some(Moved::Off(off(s, other, || warm.motion(&s.t)))),
            Stage::Calibration | Stage::Response if !has_play => {
                let bridges = |terms: &[Term]| terms.iter().any(|term| term.effect.stage() == Stage::Response);
                let mut lost = Vec::new();
                if bridges(other) {
                    lost = self::lost(s, other);
                    if !bridges(terms) && lost.contains(&true) {
                        return None;
                    }
                }
                let mut felt = felt_but(s, other, &lost);
                felt.iter_mut().zip(at.errors.iter()).for_each(|(rate, error)| *rate -= error);
                let rate = rate_of(felt);
                Some(Moved::Angle(at_rows(s, &stamped(s, calibration(other).0, &rate, other))))
            }
            Stage::Reference => {
                let mut reference = at.reference.clone();
                reference_errors(s, now, warm, |i, error, _| reference[i] -= error);
                if let Some(was) = was {
                    reference_errors(s, was, warm, |i, error, _| reference[i] += error);
                }
                Some(Moved::Reference(reference))
            }
            _ => None,
        }
    }
}

/// What one term's change moves, at the reference's rows, rad.
pub(super) enum Moved {
    /// The compensated angle.
    Angle(Vec<f64>),
    /// What the reference shows of it less the angle.
    Off(Vec<f64>),
    /// The reference less its own errors.
    Reference(Vec<f64>),
}

/// Hands each reference row, what this term makes the reference err by there and what it remembers to `take`.
fn reference_errors(s: &Series, term: &Term, warm: &Warm, mut take: impl FnMut(usize, f64, &Memory)) {
    let mut memory = Memory::default();
    let mut passed = s.reference_rows.first().copied().unwrap_or(0);
    for (i, &k) in s.reference_rows.iter().enumerate() {
        let at = |row: usize, angle: f64| {
            let mut signals = Signals { angle, ..s.signals(row) };
            signals.rates[s.axis.index()] = warm.turning.get(row).copied().unwrap_or(warm.rate[row]);
            signals
        };
        // A play goes by where the shaft has been, between the readings too.
        for row in passed..k {
            let been = [Some(warm.angle[row]), turning_point(&warm.angle, row)];
            for angle in been.into_iter().flatten() {
                let _ = term.effect.error(&term.values, &at(row, angle), &mut memory);
            }
        }
        passed = k;
        let error = term.effect.error(&term.values, &at(k, warm.angle[k]), &mut memory);
        take(i, error, &memory);
    }
}

/// The angle of a rate at the samples' times, re-stamped where these terms say that readings are valid at other times.
fn stamped(s: &Series, alpha: f64, rate: &[f64], terms: &[Term]) -> Vec<f64> {
    let timing: Vec<&Term> = terms.iter().filter(|term| term.effect.stage() == Stage::Timing).collect();
    if timing.is_empty() { s.angle_of(alpha, rate, &s.t) } else { restamped(s, alpha, rate, &timing) }
}

/// Values of the samples at the reference's rows.
fn at_rows(s: &Series, whole: &[f64]) -> Vec<f64> {
    s.reference_rows.iter().map(|&k| whole[k]).collect()
}

/// What the reference shows of the motion less the motion itself, at its rows, rad; empty where no term says that it shows another.
fn off<'a>(s: &Series, terms: &[Term], motion: impl FnOnce() -> &'a Quiet) -> Vec<f64> {
    let shown: Vec<&Term> = terms.iter().filter(|term| term.effect.stage() == Stage::Shown).collect();
    if shown.is_empty() {
        return Vec::new();
    }
    let (motion, dt) = (motion(), s.span().dt);
    let mut off = vec![0.0; s.reference_rows.len()];
    for term in shown {
        let means = means(&s.t, motion, &term.effect.window(&term.values, dt), &s.reference_rows);
        for ((off, mean), &k) in off.iter_mut().zip(means).zip(&s.reference_rows) {
            *off += mean - motion.angle[k];
        }
    }
    off
}

/// Even times beside samples up to which means are taken at even times.
const FINEST: f64 = 4.0;

/// Means of a motion at these rows. Unless the window is narrow beside the samples' distance, the motion is taken at even times once, and
/// the means, which are smooth, are interpolated.
fn means(t: &[f64], motion: &Quiet, window: &Window, rows: &[usize]) -> Vec<f64> {
    let mut hint = 0;
    let mut at = |x: f64| hermite(t, &motion.angle, &motion.rate, x, &mut hint);
    // What a slope of fourth order takes in on either side.
    let edge = window.reach() + 2;
    let steps = ((t[t.len() - 1] - t[0]) / window.step).ceil();
    if !(1.0..FINEST * t.len() as f64).contains(&steps) {
        return rows.iter().map(|&k| window.mean(|u| at(t[k] + u))).collect();
    }
    let time = |i: usize| t[0] + (i as f64 - edge as f64) * window.step;
    let even: Vec<f64> = (0..=steps as usize + 2 * edge).map(|i| at(time(i))).collect();
    let means = window.means(&even);
    let slope = |i: usize| (8.0 * (means[i + 1] - means[i - 1]) - (means[i + 2] - means[i - 2])) / 12.0;
    let last = means.len() - 4;
    let mean = |&k: &usize| {
        let x = (t[k] - t[0]) / window.step;
        let i = (x.floor() as usize + 2).min(last);
        cubic([means[i], means[i + 1]], [slope(i), slope(i + 1)], x + 2.0 - i as f64)
    };
    rows.iter().map(mean).collect()
}

/// α and δ of the calibration ω̂ = α ω_g + δ.
fn calibration(terms: &[Term]) -> (f64, f64) {
    let (mut alpha, mut delta) = (1.0, 0.0);
    for term in terms.iter().filter(|term| term.effect.stage() == Stage::Calibration) {
        let value = if term.effect.is(Trait::Gain) { &mut alpha } else { &mut delta };
        *value = term.values[0];
    }
    (alpha, delta)
}

/// Readings that say nothing: those that are missing, those that a limit cut off, and their neighbours, from which the integral takes the curve
/// over the step beside them.
fn lost(s: &Series, terms: &[Term]) -> Vec<bool> {
    let mut lost = s.missing.clone();
    for term in terms.iter().filter(|term| term.effect.stage() == Stage::Reading) {
        // A reading that stays short of the limit by less than its noise is one that the noise kept there.
        let is_cut = |g: f64| [-s.margin, 0.0, s.margin].iter().any(|m| term.effect.lost(&term.values, g + m));
        for k in (0..lost.len()).filter(|&k| is_cut(s.gyro[k])) {
            lost[k.saturating_sub(1)..(k + 2).min(s.gyro.len())].fill(true);
        }
    }
    lost
}

/// The same beside what is lost.
fn felt_but(s: &Series, terms: &[Term], lost: &[bool]) -> Vec<f64> {
    let (alpha, delta) = calibration(terms);
    let mut rate: Vec<f64> = s.gyro.iter().map(|g| alpha * g + delta).collect();
    let mut response = terms.iter().filter(|term| term.effect.stage() == Stage::Response).peekable();
    if response.peek().is_some() {
        smooth_over(&s.t, lost, &mut rate);
    }
    for term in response.filter(|term| !is_of_mount(term)) {
        rate = term.effect.undo_response_whole(&term.values, &s.t, &rate);
    }
    rate
}

/// Whether a response is that of what carries the sensor: what it adds is felt.
fn is_of_mount(term: &Term) -> bool {
    term.effect.is(Trait::Resonance)
}

/// Marks what is marked in `more` too; either may be empty, which marks nothing.
fn merge(marks: &mut Vec<bool>, more: &[bool]) {
    marks.resize(marks.len().max(more.len()), false);
    marks.iter_mut().zip(more).for_each(|(mark, more)| *mark |= more);
}

/// Samples at which a lost reading counts, and which are not its own: undoing a response spreads it over its neighbours,
/// and one that is late is valid before its stamp. So are those at the log's ends that no reading is valid at. Empty where there
/// are none.
fn displaced(t: &[f64], lost: &[bool], response: &[&Term], timing: &[&Term]) -> Vec<bool> {
    let beyond = beyond(t, timing);
    if response.is_empty() && timing.is_empty() || !lost.contains(&true) {
        return beyond;
    }
    let mut at: Vec<usize> = (0..lost.len()).filter(|&k| lost[k]).collect();
    let mut marks = vec![false; lost.len()];
    if !response.is_empty() {
        let reach: f64 = response.iter().map(|term| term.effect.reach(&term.values)).sum();
        for &k in &at {
            let (first, last) = (k.saturating_sub(NEIGHBOURS), (k + NEIGHBOURS).min(t.len() - 1));
            let before = (0..first).rev().take_while(|&other| t[first] - t[other] <= reach).count();
            let after = (last + 1..t.len()).take_while(|&other| t[other] - t[last] <= reach).count();
            marks[first - before..=last + after].fill(true);
        }
        at = (0..lost.len()).filter(|&k| marks[k]).collect();
    }
    if !timing.is_empty() {
        for k in at {
            let valid = timing.iter().fold(t[k], |t, term| term.effect.valid_time(&term.values, t));
            let next = t.partition_point(|t| *t <= valid);
            marks[next.saturating_sub(1)..(next + 1).min(t.len())].fill(true);
        }
    }
    marks.iter_mut().zip(lost).for_each(|(mark, lost)| *mark &= !lost);
    merge(&mut marks, &beyond);
    marks
}

/// Samples that lie further from all times at which readings are valid than samples of one log lie apart: a clock that runs slow
/// leaves the last seconds without, one that was set some in between. Empty where there are none.
fn beyond(t: &[f64], timing: &[&Term]) -> Vec<bool> {
    let (Some(&first), Some(&last)) = (t.first(), t.last()) else { return Vec::new() };
    let reach = HOLE * (last - first) / (t.len() - 1).max(1) as f64;
    let valid = |t: f64| timing.iter().fold(t, |t, term| term.effect.valid_time(&term.values, t));
    let mut stretches = vec![(f64::NEG_INFINITY, valid(first) - reach), (valid(last) + reach, f64::INFINITY)];
    if timing.iter().any(|term| term.effect.is(Trait::Onset)) {
        let skipped = t.windows(2).map(|pair| (valid(pair[0]), valid(pair[1]))).filter(|(from, to)| to - from > reach);
        stretches.extend(skipped);
    }
    stretches.retain(|(from, to)| *from < last && *to > first);
    if stretches.is_empty() {
        return Vec::new();
    }
    t.iter().map(|t| stretches.iter().any(|(from, to)| from < t && t < to)).collect()
}

/// Puts a cubic over each stretch of lost samples, with the value and the slope that the rate has on either side: undoing a
/// response would follow the corners, of which the truth has none.
fn smooth_over(t: &[f64], lost: &[bool], rate: &mut [f64]) {
    let mut first = 0;
    for run in lost.chunk_by(|a, b| a == b) {
        let (from, to) = (first, first + run.len());
        first = to;
        if !run[0] || from < 2 || to + 2 > t.len() {
            continue;
        }
        let (a, b) = (from - 1, to);
        let span = t[b] - t[a];
        let chord = rate[b] - rate[a];
        let beside = |near: usize, far: usize| {
            if lost[far] { chord } else { span * (rate[near] - rate[far]) / (t[near] - t[far]) }
        };
        let (rises, ends) = (beside(a, a - 1), beside(b, b + 1));
        for k in from..to {
            let x = (t[k] - t[a]) / span;
            let bend = x * (1.0 - x) * ((1.0 - x) * (rises - chord) - x * (ends - chord));
            rate[k] = rate[a] + x * chord + bend;
        }
    }
}

/// Samples on either side that a centred derivative takes in.
const NEIGHBOURS: usize = 2;

/// The angle at the samples' times, where a reading stamped t is valid at another time: a rate is integrated over its
/// times of validity, cubic between them.
fn restamped(s: &Series, alpha: f64, rate: &[f64], timing: &[&Term]) -> Vec<f64> {
    let at = |&t: &f64| timing.iter().fold(t, |t, term| term.effect.valid_time(&term.values, t));
    let valid: Vec<f64> = s.t.iter().map(at).collect();
    let (mut whole, mut hint) = (s.angle_of(alpha, rate, &valid), 0);
    if timing.iter().any(|term| term.effect.is(Trait::Onset)) {
        over_set_clocks(&s.t, &valid, rate, &mut whole);
    }
    s.t.iter().map(|&t| hermite(&valid, &whole, rate, t, &mut hint)).collect()
}

/// Integrates anew over the instants at which a clock was set. Where it was set back, the readings before reach as far as the first one
/// after; where it was set ahead, a cubic bridges what nobody read.
fn over_set_clocks(t: &[f64], valid: &[f64], rate: &[f64], whole: &mut [f64]) {
    let slope = derivative(t, rate);
    for k in 1..t.len() {
        let (usual, step) = (t[k] - t[k - 1], valid[k] - valid[k - 1]);
        if (step - usual).abs() <= SET * usual {
            continue;
        }
        let turned = if step < 0.0 && k > 1 {
            let mut hint = k - 2;
            hermite(&valid[..k], &whole[..k], &rate[..k], valid[k], &mut hint) - whole[k - 1]
        } else {
            // The slopes of the samples next to it, which hold none of the step.
            let (rises, ends) = (slope[k.saturating_sub(3)], slope[(k + 2).min(t.len() - 1)]);
            0.5 * step * (rate[k - 1] + rate[k]) + step * step / 12.0 * (rises - ends)
        };
        let off = turned - (whole[k] - whole[k - 1]);
        whole[k..].iter_mut().for_each(|angle| *angle += off);
    }
}

/// Share of its usual length by which a step between two readings may be another where no clock was set.
const SET: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::{Quiet, Window, means};

    #[test]
    fn means_of_a_motion_are_those_of_its_instants() {
        let dt = 0.004;
        let t: Vec<f64> = (0..2000).map(|k| dt * (f64::from(k) + 0.2 * (f64::from(k) * 1.7).sin())).collect();
        let rows: Vec<usize> = (200..1800).step_by(3).collect();
        for (w, omega) in [(0.002, 40.0), (0.01, 60.0), (0.01, 5.0), (0.1, 8.0)] {
            let motion = Quiet {
                angle: t.iter().map(|t| (omega * t).sin()).collect(),
                rate: t.iter().map(|t| omega * (omega * t).cos()).collect(),
                by: None,
            };
            let window = Window::gaussian(w, dt.clamp(w / 8.0, w / 2.0), 4.0 * w);
            let gain = (-0.5 * (omega * w).powi(2)).exp();
            for (mean, &k) in means(&t, &motion, &window, &rows).iter().zip(&rows) {
                let exact = gain * (omega * t[k]).sin();
                assert!((mean - exact).abs() < 1e-4, "w {w} s, {omega} rad/s at {} s: {mean} for {exact}", t[k]);
            }
        }
    }
}
