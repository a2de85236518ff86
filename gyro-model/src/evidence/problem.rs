//! The residual of a model on a log: compensated angle less reference angle, and its derivatives.
//!
//! Shaft references: r(t) = θ̂(t) − θ_ref(t), one channel. Quaternion references, three axes together: the error of each
//! step, in the frame of its middle, turned to the world and summed, three channels; where an axis has no gyro, or is not
//! asked about, those of the others summed in the body, a channel each. Where a reading holds no
//! information (missing, saturated, inside a dead zone) the residual stands still: that step says nothing.

use super::{
    attitude::Attitude,
    integrate::{hermite, integral},
    prior::Prior,
    series::{HOLE, Rest, Series, usual},
    shaft::{LEVEL, best_angle, counted_angle, nearness, stand, turning_point},
};
use crate::{
    Axis, AxisModel, Model, Record, Term,
    effects::{Memory, Role, Signals, Stage, derivative, steadied},
    record::ReferenceKind,
};
use std::sync::Arc;

/// One log, laid out for evaluating models of the axes that share a reference.
#[derive(Clone, Debug)]
pub struct Problem {
    /// One axis, or three that a quaternion serves.
    pub series: Vec<Series>,
    attitude: Option<Attitude>,
    /// Steps over a hole of an orientation: turns about three axes in so long a time do not add up.
    broken: Vec<bool>,
    /// What is known of a rate that is held inside a play.
    pub held_rate: HeldRate,
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

/// What the regressors of one axis are evaluated at; refreshed after each fit.
#[derive(Clone, Debug)]
pub struct Warm {
    /// Compensated rate at the samples, rad/s.
    pub rate: Vec<f64>,
    pub(crate) rate_dot: Vec<f64>,
    /// What the sensor felt of it, the ringing of its mount still in it, rad/s; empty where that is the same.
    felt: Vec<f64>,
    /// Best known angle at the samples: the gyro's shape on the reference's level, rad.
    pub angle: Vec<f64>,
    /// The same on the reference's level over so short a time that it is as near to the true angle as can be, with the
    /// encoder's own errors: what its quantisation is drawn along. Empty where there is no step.
    pub close: Vec<f64>,
    /// Samples whose compensation is a guess under the model they were made with; empty where there are none.
    pub unsure: Vec<bool>,
    /// Samples to be left out whatever the model says, so that models can be compared on the same ones; empty: none.
    pub left_out: Vec<bool>,
}

impl Warm {
    /// What an encoder's quantisation is drawn along.
    #[must_use]
    pub fn drawn_along(&self) -> &[f64] {
        if self.close.is_empty() { &self.angle } else { &self.close }
    }

    /// The same without what another model is unsure of.
    #[must_use]
    pub fn without(&self, other: &Self) -> Self {
        Self { left_out: other.frozen().left_out, unsure: Vec::new(), ..self.clone() }
    }

    /// The same with what is unsure left out for good.
    #[must_use]
    pub fn frozen(&self) -> Self {
        let left_out = if self.left_out.is_empty() { self.unsure.clone() } else { self.left_out.clone() };
        Self { left_out, unsure: Vec::new(), ..self.clone() }
    }
}

/// A model on a log.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Residual at the reference rows, rad: one channel, or those of an orientation.
    pub residual: Vec<Vec<f64>>,
    /// Steps (from the previous reference row to this one) that say nothing.
    pub lost: Vec<bool>,
    /// Each axis by itself.
    pub tracks: Vec<Track>,
}

impl Evaluation {
    /// Share of the steps that say nothing.
    #[must_use]
    pub fn silent(&self) -> f64 {
        self.lost.iter().filter(|lost| **lost).count() as f64 / self.lost.len() as f64
    }
}

/// Where one parameter stands in a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Index into [`Problem::series`].
    pub series: usize,
    /// Index of the term.
    pub term: usize,
    /// Index of the parameter.
    pub parameter: usize,
}

impl Problem {
    /// Lays out `axes`, which share one reference (one shaft axis, or the axes a quaternion serves), beside the others as
    /// `model` calibrates them.
    #[must_use]
    pub fn new(record: &Record, axes: &[Axis], model: &Model) -> Option<Self> {
        let series: Vec<Series> = axes.iter().filter_map(|&a| Series::new(record, a, model)).collect();
        let first = series.first()?;
        let own = series.iter().map(|s| s.axis.index()).collect();
        let attitude = (first.kind == ReferenceKind::Quaternion).then(|| Attitude::new(record, first, own));
        let apart: Vec<f64> = first.reference_t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let longest = if attitude.is_some() { HOLE * usual(apart.clone()) } else { f64::INFINITY };
        let broken = std::iter::once(false).chain(apart.into_iter().map(|apart| apart > longest)).collect();
        Some(Self { series, attitude, broken, held_rate: HeldRate::default() })
    }

    /// Times of the reference rows, s.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.series[0].reference_t
    }

    /// Attitude of the reference, where it is one.
    #[must_use]
    pub fn attitude(&self) -> Option<&Attitude> {
        self.attitude.as_ref()
    }

    /// Number of residual channels: one, or as many as the axes that an orientation serves.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.attitude.as_ref().map_or(1, Attitude::channels)
    }

    /// Whether the reference of an axis shows no more than its noise, and whether its gyro neither does.
    pub(super) fn rests(&self, series: &Series, prior: &Prior) -> Rest {
        let angle = match &self.attitude {
            None => series.reference_angle.clone(),
            Some(attitude) => attitude.turned_about(series.axis.index()),
        };
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let spread = |angle: &[f64]| {
            let level = mean(angle);
            mean(&angle.iter().map(|a| (a - level).powi(2)).collect::<Vec<_>>()).sqrt()
        };
        if spread(&angle) > TURNS * prior.encoder {
            return Rest::None;
        }
        let bias = mean(&series.gyro);
        let turned = integral(&series.t, &series.gyro.iter().map(|g| g - bias).collect::<Vec<_>>());
        let walk = prior.reading * series.span().duration.sqrt();
        if spread(&turned) > TURNS * prior.encoder.hypot(walk) { Rest::OfReference } else { Rest::Whole }
    }

    /// Every parameter of the axes' terms that a fit moves: `Reading` limits are read off the data instead, as is what
    /// the scan chooses, and a sensor that stood still keeps its scale.
    #[must_use]
    pub fn slots(&self, model: &Model) -> Vec<Slot> {
        let mut slots = Vec::new();
        for (series, s) in self.series.iter().enumerate() {
            for (term, t) in self.axis(model, s).terms.iter().enumerate() {
                if t.effect.stage() != Stage::Reading && !(s.rest == Rest::Whole && is_scale(t)) {
                    let cards = t.effect.parameters(s.axis).iter().enumerate();
                    let free = cards.filter(|(_, card)| card.role != Role::Chosen);
                    slots.extend(free.map(|(parameter, _)| Slot { series, term, parameter }));
                }
            }
        }
        slots
    }

    #[allow(clippy::unused_self)]
    fn axis<'a>(&self, model: &'a Model, series: &Series) -> &'a AxisModel {
        static EMPTY: AxisModel = AxisModel::EMPTY;
        model.axes[series.axis.index()].as_ref().unwrap_or(&EMPTY)
    }

    /// The signals that regressors start from where nothing better is known: the readings themselves.
    #[must_use]
    pub fn cold(&self) -> Vec<Warm> {
        self.series
            .iter()
            .map(|s| {
                let rate = steadied(&s.t, &s.gyro);
                Warm {
                    angle: best_angle(s, &s.reference_angle, &[], &angle_of(s, 1.0, &s.gyro, &s.t), &s.missing, LEVEL),
                    close: Vec::new(),
                    rate_dot: derivative(&s.t, &rate),
                    rate,
                    felt: Vec::new(),
                    unsure: Vec::new(),
                    left_out: Vec::new(),
                }
            })
            .collect()
    }

    /// The signals at this model, for the next evaluations; `before` are those that it was evaluated with.
    #[must_use]
    pub fn warm(&self, evaluation: &Evaluation, before: &[Warm]) -> Vec<Warm> {
        self.series
            .iter()
            .zip(&evaluation.tracks)
            .zip(before)
            .map(|((s, track), before)| {
                let rate = steadied(&s.t, &track.rate);
                let mut angle = best_angle(s, &track.reference, &track.silent, &track.whole, &track.lost, LEVEL);
                stand(&s.t, &track.rate, &mut angle);
                Warm {
                    angle,
                    close: nearness(s).map_or_else(Vec::new, |half| counted_angle(s, track, half)),
                    rate_dot: derivative(&s.t, &rate),
                    rate,
                    felt: track.felt.as_ref().map_or_else(Vec::new, |felt| steadied(&s.t, felt)),
                    unsure: if before.left_out.is_empty() { track.unsure.clone() } else { Vec::new() },
                    left_out: before.left_out.clone(),
                }
            })
            .collect()
    }

    /// The residual of `model` with its regressors at `warm`.
    #[must_use]
    pub fn evaluate(&self, model: &Model, warm: &[Warm]) -> Evaluation {
        let tracks =
            self.series.iter().enumerate().map(|(i, s)| self.track(s, &self.axis(model, s).terms, i, warm)).collect();
        self.together(tracks)
    }

    /// The residual where only the model of series `changed` differs from that of `at`.
    #[must_use]
    pub fn evaluate_one(&self, model: &Model, warm: &[Warm], at: &Evaluation, changed: usize) -> Evaluation {
        let s = &self.series[changed];
        let own = self.track(s, &self.axis(model, s).terms, changed, warm);
        let mut tracks = at.tracks.clone();
        tracks[changed] = own;
        self.together(tracks)
    }

    /// The residual of the axes' tracks.
    fn together(&self, tracks: Vec<Track>) -> Evaluation {
        let n = self.times().len();
        let mut lost = self.broken.clone();
        for (track, s) in tracks.iter().zip(&self.series) {
            if track.any_lost {
                for (lost, rows) in lost[1..].iter_mut().zip(s.reference_rows.windows(2)) {
                    *lost |= track.lost[rows[0]..=rows[1]].contains(&true);
                }
            }
        }
        let residual = match &self.attitude {
            None => {
                let track = &tracks[0];
                let mut r = vec![0.0; n];
                for i in 1..n {
                    let step = (track.angle[i] - track.angle[i - 1]) - (track.reference[i] - track.reference[i - 1]);
                    r[i] = r[i - 1] + if lost[i] { 0.0 } else { step };
                }
                vec![r]
            }
            Some(attitude) => {
                let angle: [Option<&[f64]>; 3] = std::array::from_fn(|a| {
                    self.series.iter().position(|s| s.axis.index() == a).map(|i| &tracks[i].angle[..])
                });
                attitude.residual(angle, &lost)
            }
        };
        Evaluation { residual, lost, tracks }
    }

    /// Steps between reference rows in which the compensation of one axis is a guess; `None` where it never is.
    #[must_use]
    pub fn unsure(&self, evaluation: &Evaluation, series: usize) -> Option<Vec<bool>> {
        let (unsure, rows) = (&evaluation.tracks[series].unsure, &self.series[series].reference_rows);
        if !unsure.contains(&true) {
            return None;
        }
        let steps = rows.windows(2).map(|rows| unsure[rows[0]..=rows[1]].contains(&true));
        Some(std::iter::once(false).chain(steps).collect())
    }

    /// The open-loop angle error of one axis at the reference rows, rad: with an attitude, its errors about this body axis
    /// summed.
    #[must_use]
    pub fn axis_error(&self, evaluation: &Evaluation, series: usize) -> Vec<f64> {
        match &self.attitude {
            None => evaluation.residual[0].clone(),
            Some(attitude) => attitude.about_body_axis(&evaluation.residual, self.series[series].axis.index()),
        }
    }

    /// The angle of a rate with what these terms do to it and to its times undone, at the samples, rad.
    #[must_use]
    pub fn undone(&self, series: usize, terms: &[Term], rate: &[f64]) -> Vec<f64> {
        let s = &self.series[series];
        let of = |stage: Stage| terms.iter().filter(move |t| t.effect.stage() == stage);
        let undo = |rate: Vec<f64>, t: &Term| t.effect.undo_response_whole(&t.values, &s.t, &rate);
        let rate = of(Stage::Response).fold(rate.to_vec(), undo);
        let timing: Vec<&Term> = of(Stage::Timing).collect();
        if timing.is_empty() { integral(&s.t, &rate) } else { restamped(s, 0.0, &rate, &timing) }
    }

    /// The rate that a sensor felt, its readings' scale, bias and response undone, its errors still in it, rad/s.
    #[must_use]
    pub fn felt(&self, model: &Model, series: usize) -> Vec<f64> {
        let s = &self.series[series];
        let terms = &self.axis(model, s).terms;
        felt(s, terms, &lost(s, terms))
    }

    /// One axis: compensated rate, its angle at the reference rows, the reference less its own errors.
    fn track(&self, s: &Series, terms: &[Term], index: usize, warm: &[Warm]) -> Track {
        let of = |stage: Stage| terms.iter().filter(move |t| t.effect.stage() == stage);
        let mut lost = lost(s, terms);
        let response: Vec<&Term> = of(Stage::Response).collect();
        let timing: Vec<&Term> = of(Stage::Timing).collect();
        let mut unsure = displaced(&s.t, &lost, &response, &timing);
        let mut rate = felt(s, terms, &lost);
        for without in [&warm[index].unsure, &warm[index].left_out] {
            merge(&mut lost, without);
        }
        let errors: Vec<&Term> = of(Stage::Felt).collect();
        if !errors.is_empty() {
            merge(&mut unsure, &self.subtract_errors(s, &errors, index, warm, &mut rate));
        }
        let mut felt = None;
        for term in response.into_iter().filter(|term| is_of_mount(term)) {
            let undone = term.effect.undo_response_whole(&term.values, &s.t, &rate);
            felt.get_or_insert(std::mem::replace(&mut rate, undone));
        }
        let felt = felt.map(Arc::new);
        let alpha = calibration(terms).0;
        let whole =
            if timing.is_empty() { angle_of(s, alpha, &rate, &s.t) } else { restamped(s, alpha, &rate, &timing) };
        let angle = s.reference_rows.iter().map(|&k| whole[k]).collect();
        let mut reference = s.reference_angle.clone();
        let mut silent = vec![false; reference.len()];
        for term in of(Stage::Reference) {
            let mut memory = Memory::default();
            let (mut known, mut passed) = (0, s.reference_rows.first().copied().unwrap_or(0));
            for ((r, silent), &k) in reference.iter_mut().zip(&mut silent).zip(&s.reference_rows) {
                let at = |row: usize, angle: f64| Signals { angle, ..s.signals[row] };
                // A play goes by where the shaft has been, between the readings too.
                for row in passed..k {
                    let been = [Some(warm[index].angle[row]), turning_point(&warm[index].angle, row)];
                    for angle in been.into_iter().flatten() {
                        term.effect.error(&term.values, &at(row, angle), &mut memory);
                    }
                }
                passed = k;
                let signals = at(k, warm[index].angle[k]);
                let error = term.effect.error(&term.values, &signals, &mut memory);
                *silent |= term.effect.silent(&term.values, error);
                *r -= error;
                if term.effect.is_guess(&term.values, &memory) {
                    known = k + 1;
                }
            }
            if known > 0 {
                unsure.resize(s.t.len(), false);
                unsure[..known].fill(true);
            }
        }
        let any_lost = lost.iter().any(|&l| l);
        Track { rate: Arc::new(rate), felt, whole: Arc::new(whole), angle, reference, silent, lost, any_lost, unsure }
    }

    /// ω̂ = u − Σ error(ω̂), the errors at the warm rate that the sensor felt: the fixed point is in the refreshing of it.
    /// Gives the samples at which an error is a guess.
    fn subtract_errors(
        &self,
        s: &Series,
        errors: &[&Term],
        index: usize,
        warm: &[Warm],
        rate: &mut [f64],
    ) -> Vec<bool> {
        let (ahead, errors): (Vec<&Term>, Vec<&Term>) = errors.iter().partition(|t| t.effect.is_play());
        let mut memories = vec![Memory::default(); errors.len()];
        for (k, rate) in rate.iter_mut().enumerate() {
            let mut signals = s.signals[k];
            for (other, w) in self.series.iter().zip(warm) {
                signals.rates[other.axis.index()] = w.rate[k];
            }
            if let Some(felt) = warm[index].felt.get(k) {
                signals.rates[s.axis.index()] = *felt;
            }
            signals.rate_dot = warm[index].rate_dot[k];
            signals.angle = warm[index].angle[k];
            let mut sum = 0.0;
            for (term, memory) in errors.iter().zip(&mut memories) {
                sum += term.effect.error_seen(&term.values, &signals, memory);
            }
            *rate -= sum;
        }
        let mut unsure = Vec::new();
        for term in ahead {
            let mut whole = term.effect.error_whole(&term.values, &s.t, rate);
            if self.held_rate == HeldRate::Anywhere {
                merge(&mut whole.unsure, &whole.held);
            }
            rate.iter_mut().zip(whole.error).for_each(|(rate, error)| *rate -= error);
            unsure = whole.unsure;
        }
        unsure
    }
}

/// α and δ of the calibration ω̂ = α ω_g + δ.
fn calibration(terms: &[Term]) -> (f64, f64) {
    let (mut alpha, mut delta) = (1.0, 0.0);
    for term in terms.iter().filter(|term| term.effect.stage() == Stage::Calibration) {
        match term.effect.card().id {
            "scale-factor" => alpha = term.values[0],
            _ => delta = term.values[0],
        }
    }
    (alpha, delta)
}

/// Readings that say nothing: those that are missing, and those that a limit cut off.
fn lost(s: &Series, terms: &[Term]) -> Vec<bool> {
    let mut lost = s.missing.clone();
    for term in terms.iter().filter(|term| term.effect.stage() == Stage::Reading) {
        // A reading that stays short of the limit by less than its noise is one that the noise kept there.
        for (l, &g) in lost.iter_mut().zip(&s.gyro) {
            *l |= [-s.margin, 0.0, s.margin].iter().any(|m| term.effect.lost(&term.values, g + m));
        }
    }
    lost
}

/// What a sensor felt: its readings calibrated, and its own response undone.
fn felt(s: &Series, terms: &[Term], lost: &[bool]) -> Vec<f64> {
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
    term.effect.card().id == "mount-resonance"
}

/// Standard deviations of the reference's noise that an axis has to turn by, in the root mean square.
const TURNS: f64 = 3.0;

/// Whether this is the base model's scale factor.
pub(super) fn is_scale(term: &Term) -> bool {
    term.effect.card().id == "scale-factor"
}

/// Marks what is marked in `more` too; either may be empty, which marks nothing.
fn merge(marks: &mut Vec<bool>, more: &[bool]) {
    marks.resize(marks.len().max(more.len()), false);
    marks.iter_mut().zip(more).for_each(|(mark, more)| *mark |= more);
}

/// Samples at which a lost reading counts, and which are not its own: undoing a response spreads it over its neighbours,
/// and one that is late is valid before its stamp. Empty where there are none.
fn displaced(t: &[f64], lost: &[bool], response: &[&Term], timing: &[&Term]) -> Vec<bool> {
    if response.is_empty() && timing.is_empty() || !lost.contains(&true) {
        return Vec::new();
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
    marks
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

/// ∫ rate dt over these times. Where the readings are means, α times what they have turned, and the integral of the rest.
fn angle_of(s: &Series, alpha: f64, rate: &[f64], times: &[f64]) -> Vec<f64> {
    if s.turned.is_empty() {
        return integral(times, rate);
    }
    let rest: Vec<f64> = rate.iter().zip(&s.gyro).map(|(rate, gyro)| rate - alpha * gyro).collect();
    let mut angle = integral(times, &rest);
    let mut turned = 0.0;
    for k in 1..angle.len() {
        let stretch = (times[k] - times[k - 1]) / (s.t[k] - s.t[k - 1]);
        turned += alpha * stretch * (s.turned[k] - s.turned[k - 1]);
        angle[k] += turned;
    }
    angle
}

/// The angle at the samples' times, where a reading stamped t is valid at another time: a rate is integrated over its
/// times of validity, cubic between them.
fn restamped(s: &Series, alpha: f64, rate: &[f64], timing: &[&Term]) -> Vec<f64> {
    let at = |&t: &f64| timing.iter().fold(t, |t, term| term.effect.valid_time(&term.values, t));
    let valid: Vec<f64> = s.t.iter().map(at).collect();
    let (whole, mut hint) = (angle_of(s, alpha, rate, &valid), 0);
    s.t.iter().map(|&t| hermite(&valid, &whole, rate, t, &mut hint)).collect()
}

/// One axis of an evaluation.
#[derive(Clone, Debug)]
pub struct Track {
    /// Compensated rate at the samples, rad/s.
    pub rate: Arc<Vec<f64>>,
    /// The same before what the mount adds was undone, where it adds something.
    felt: Option<Arc<Vec<f64>>>,
    /// Its integral at the samples' times, re-stamped, rad.
    pub(super) whole: Arc<Vec<f64>>,
    angle: Vec<f64>,
    pub(super) reference: Vec<f64>,
    /// Reference rows that say nothing of the angle.
    pub(super) silent: Vec<bool>,
    pub(super) lost: Vec<bool>,
    any_lost: bool,
    unsure: Vec<bool>,
}

/// Reads or writes one parameter of a model.
pub fn value<'a>(problem: &Problem, model: &'a mut Model, slot: Slot) -> Option<&'a mut f64> {
    let axis = problem.series[slot.series].axis.index();
    model.axes[axis].as_mut()?.terms.get_mut(slot.term)?.values.get_mut(slot.parameter)
}
