//! The residual of a model on a log: compensated angle less reference angle, and its derivatives.
//!
//! Shaft references: r(t) = θ̂(t) − θ_ref(t), one channel. Quaternion references, three axes together: the error of each
//! step, in the frame of its middle, turned to the world and summed, three channels. Where a reading holds no
//! information (missing, saturated, inside a dead zone) the residual stands still: that step says nothing.

use super::{
    attitude::Attitude,
    integrate::{hermite, integral, smooth},
    series::Series,
};
use crate::{
    Axis, AxisModel, Model, Record, Term,
    effects::{Memory, Signals, Stage, derivative},
    model::Origin,
    record::ReferenceKind,
};

/// One log, laid out for evaluating models of the axes that share a reference.
#[derive(Clone, Debug)]
pub struct Problem {
    /// One axis, or three that a quaternion serves.
    pub series: Vec<Series>,
    attitude: Option<Attitude>,
}

/// What the regressors of one axis are evaluated at; refreshed after each fit.
#[derive(Clone, Debug)]
pub struct Warm {
    /// Compensated rate at the samples, rad/s.
    pub rate: Vec<f64>,
    rate_dot: Vec<f64>,
    /// Best known angle at the samples: the gyro's shape on the reference's level, rad.
    pub angle: Vec<f64>,
}

/// A model on a log.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Residual at the reference rows, rad: one channel, or three in the world frame.
    pub residual: Vec<Vec<f64>>,
    /// Steps (from the previous reference row to this one) that say nothing.
    pub lost: Vec<bool>,
    /// Compensated rate of each axis at its samples, rad/s.
    pub rate: Vec<Vec<f64>>,
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
    /// Lays out `axes`, which share one reference (one shaft axis, or the axes a quaternion serves).
    #[must_use]
    pub fn new(record: &Record, axes: &[Axis], origin: &Origin) -> Option<Self> {
        let series: Vec<Series> = axes.iter().filter_map(|&a| Series::new(record, a, origin)).collect();
        let first = series.first()?;
        let attitude = (first.kind == ReferenceKind::Quaternion).then(|| Attitude::new(record, first));
        Some(Self { series, attitude })
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

    /// Number of residual channels: 1 or 3.
    #[must_use]
    pub fn channels(&self) -> usize {
        if self.attitude.is_some() { 3 } else { 1 }
    }

    /// Every parameter of the axes' terms that a fit moves: `Reading` limits are read off the data instead.
    #[must_use]
    pub fn slots(&self, model: &Model) -> Vec<Slot> {
        let mut slots = Vec::new();
        for (series, s) in self.series.iter().enumerate() {
            for (term, t) in self.axis(model, s).terms.iter().enumerate() {
                if t.effect.stage() != Stage::Reading {
                    slots.extend((0..t.values.len()).map(|parameter| Slot { series, term, parameter }));
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
                let slope = derivative(&s.t, &s.gyro);
                Warm { angle: self.best_angle(s, &s.gyro), rate_dot: slope, rate: s.gyro.clone() }
            })
            .collect()
    }

    /// The signals at this model, for the next evaluations.
    #[must_use]
    pub fn warm(&self, evaluation: &Evaluation) -> Vec<Warm> {
        self.series
            .iter()
            .zip(&evaluation.rate)
            .map(|(s, rate)| Warm {
                angle: self.best_angle(s, rate),
                rate_dot: derivative(&s.t, rate),
                rate: rate.clone(),
            })
            .collect()
    }

    /// Integral of `rate`, held to the level of the reference over some tens of seconds.
    fn best_angle(&self, s: &Series, rate: &[f64]) -> Vec<f64> {
        let angle = integral(&s.t, rate);
        if s.reference_angle.is_empty() {
            return angle;
        }
        let error: Vec<f64> = s.reference_rows.iter().zip(&s.reference_angle).map(|(&k, r)| angle[k] - r).collect();
        let level = smooth(&s.reference_t, &error, 8.0);
        let flat = vec![0.0; level.len()];
        let mut hint = 0;
        angle.iter().zip(&s.t).map(|(a, &t)| a - linear(&s.reference_t, &level, &flat, t, &mut hint)).collect()
    }

    /// The residual of `model` with its regressors at `warm`.
    #[must_use]
    pub fn evaluate(&self, model: &Model, warm: &[Warm]) -> Evaluation {
        let tracks: Vec<Track> =
            self.series.iter().enumerate().map(|(i, s)| self.track(s, &self.axis(model, s).terms, i, warm)).collect();
        let n = self.times().len();
        let mut lost = vec![false; n];
        for (track, s) in tracks.iter().zip(&self.series) {
            for i in 1..n {
                let (a, b) = (s.reference_rows[i - 1], s.reference_rows[i]);
                lost[i] |= track.lost[a..=b].iter().any(|&l| l);
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
                let zero = vec![0.0; n];
                let angle: [&[f64]; 3] = std::array::from_fn(|a| {
                    self.series.iter().position(|s| s.axis.index() == a).map_or(&zero[..], |i| &tracks[i].angle[..])
                });
                attitude.residual(angle, &lost)
            }
        };
        Evaluation { residual, lost, rate: tracks.into_iter().map(|t| t.rate).collect() }
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

    /// One axis: compensated rate, its angle at the reference rows, the reference less its own errors.
    fn track(&self, s: &Series, terms: &[Term], index: usize, warm: &[Warm]) -> Track {
        let of = |stage: Stage| terms.iter().filter(move |t| t.effect.stage() == stage);
        let (mut alpha, mut delta) = (1.0, 0.0);
        for term in of(Stage::Calibration) {
            match term.effect.card().id {
                "scale-factor" => alpha = term.values[0],
                _ => delta = term.values[0],
            }
        }
        let mut lost = s.missing.clone();
        for term in of(Stage::Reading) {
            for (l, &g) in lost.iter_mut().zip(&s.gyro) {
                *l |= term.effect.lost(&term.values, g);
            }
        }
        let mut rate: Vec<f64> = s.gyro.iter().map(|g| alpha * g + delta).collect();
        for term in of(Stage::Response).filter(|t| t.effect.card().id != "mount-resonance") {
            rate = term.effect.undo_response_whole(&term.values, &s.t, &rate);
        }
        let felt: Vec<&Term> = of(Stage::Felt).collect();
        if !felt.is_empty() {
            self.subtract_felt(s, &felt, index, warm, &mut rate);
        }
        for term in of(Stage::Response).filter(|t| t.effect.card().id == "mount-resonance") {
            rate = term.effect.undo_response_whole(&term.values, &s.t, &rate);
        }
        let timing: Vec<&Term> = of(Stage::Timing).collect();
        let angle = if timing.is_empty() {
            let whole = integral(&s.t, &rate);
            s.reference_rows.iter().map(|&k| whole[k]).collect()
        } else {
            // A rate belongs to its time of validity, and that is the time over which it is integrated.
            let at = |&t: &f64| timing.iter().fold(t, |t, term| term.effect.valid_time(&term.values, t));
            let valid: Vec<f64> = s.t.iter().map(at).collect();
            let (whole, mut hint) = (integral(&valid, &rate), 0);
            s.reference_t.iter().map(|&t| hermite(&valid, &whole, &rate, t, &mut hint)).collect()
        };
        let mut reference = s.reference_angle.clone();
        for term in of(Stage::Reference) {
            let mut memory = Memory::default();
            for (r, &k) in reference.iter_mut().zip(&s.reference_rows) {
                let signals = Signals { angle: warm[index].angle[k], ..s.signals[k] };
                *r -= term.effect.error(&term.values, &signals, &mut memory);
            }
        }
        Track { rate, angle, reference, lost }
    }

    /// ω̂ = u − Σ error(ω̂), two rounds of the fixed point a sample, from the warm rate.
    fn subtract_felt(&self, s: &Series, felt: &[&Term], index: usize, warm: &[Warm], rate: &mut [f64]) {
        let mut memories = vec![Memory::default(); felt.len()];
        let own = s.axis.index();
        for k in 0..rate.len() {
            let u = rate[k];
            let mut signals = s.signals[k];
            for (other, w) in self.series.iter().zip(warm) {
                signals.rates[other.axis.index()] = w.rate[k];
            }
            signals.rate_dot = warm[index].rate_dot[k];
            signals.angle = warm[index].angle[k];
            for round in 0..2 {
                let mut sum = 0.0;
                for (term, memory) in felt.iter().zip(&mut memories) {
                    let mut trial = *memory;
                    sum += term.effect.error(&term.values, &signals, &mut trial);
                    if round == 1 {
                        *memory = trial;
                    }
                }
                signals.rates[own] = u - sum;
            }
            rate[k] = signals.rates[own];
        }
    }
}

struct Track {
    rate: Vec<f64>,
    angle: Vec<f64>,
    reference: Vec<f64>,
    lost: Vec<bool>,
}

/// Linear interpolation, held at the ends.
fn linear(t: &[f64], y: &[f64], _slope: &[f64], x: f64, hint: &mut usize) -> f64 {
    let n = t.len();
    let mut k = (*hint).min(n - 2);
    while k + 2 < n && t[k + 1] <= x {
        k += 1;
    }
    *hint = k;
    let w = ((x - t[k]) / (t[k + 1] - t[k])).clamp(0.0, 1.0);
    y[k] + w * (y[k + 1] - y[k])
}

/// Reads or writes one parameter of a model.
pub fn value<'a>(problem: &Problem, model: &'a mut Model, slot: Slot) -> Option<&'a mut f64> {
    let axis = problem.series[slot.series].axis.index();
    model.axes[axis].as_mut()?.terms.get_mut(slot.term)?.values.get_mut(slot.parameter)
}
