//! The residual of a model on a log: compensated angle less reference angle, and its derivatives.
//!
//! Shaft references: r(t) = θ̂(t) − θ_ref(t), one channel. Quaternion references, three axes together: the error of each
//! step, in the frame of its middle, turned to the world and summed, three channels; where an axis has no gyro, or is not
//! asked about, those of the others summed in the body, a channel each. Where a reading holds no
//! information (missing, saturated, inside a dead zone) the residual stands still: that step says nothing.

use super::{
    attitude::Attitude,
    knots,
    series::{HOLE, Rest, Series, usual},
    shaft::{LEVEL, best_angle, nearness, stand},
    track::{self, HeldRate, Moved, Track, Tracker},
    warm::Warm,
};
use crate::{
    Axis, AxisModel, Model, Record, Term,
    effects::{Role, Stage, Trait, derivative, steadied},
    order::median,
    record::ReferenceKind,
};
use std::sync::{Arc, OnceLock};

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

/// A model on a log.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Residual at the reference rows, rad: one channel, or those of an orientation.
    pub residual: Vec<Vec<f64>>,
    /// Steps (from the previous reference row to this one) that say nothing.
    pub lost: Vec<bool>,
    /// Each axis by itself.
    pub tracks: Vec<Arc<Track>>,
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
        let mut series: Vec<Series> = axes.iter().filter_map(|&a| Series::new(record, a, model)).collect();
        let first = series.first()?;
        let own = series.iter().map(|s| s.axis.index()).collect();
        let attitude = (first.kind == ReferenceKind::Quaternion).then(|| Attitude::new(record, first, own));
        let apart: Vec<f64> = first.reference_t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let steps = apart.clone();
        let longest = if attitude.is_some() { HOLE * usual(apart.clone()) } else { f64::INFINITY };
        let broken = std::iter::once(false).chain(apart.into_iter().map(|apart| apart > longest)).collect();
        let angles = attitude.as_ref().map_or_else(
            || vec![first.reference_angle.clone()],
            |attitude| (0..3).map(|axis| attitude.turned_about(axis)).collect(),
        );
        // Whole counts bend at each count, and lie on no line between.
        let counts = first.encoder.step > 0.0;
        let knots =
            (!counts).then(|| knots::apart(&first.reference_t, median(steps).unwrap_or(0.0), &angles)).flatten();
        for own in &mut series {
            own.knots = knots;
        }
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

    /// Every parameter of the axes' terms that a fit moves: `Reading` limits are read off the data instead, as is what
    /// the scan chooses, and a sensor whose reference stood still keeps its scale.
    #[must_use]
    pub fn slots(&self, model: &Model) -> Vec<Slot> {
        let mut slots = Vec::new();
        for (series, s) in self.series.iter().enumerate() {
            for (term, t) in self.axis(model, s).terms.iter().enumerate() {
                if t.effect.stage() != Stage::Reading && !(s.rest != Rest::None && is_scale(t)) {
                    let cards = t.effect.parameters(s.axis).iter().enumerate();
                    let free = cards.filter(|(_, card)| card.role != Role::Chosen);
                    slots.extend(free.map(|(parameter, _)| Slot { series, term, parameter }));
                }
            }
        }
        slots
    }

    #[allow(clippy::unused_self)]
    pub(super) fn axis<'a>(&self, model: &'a Model, series: &Series) -> &'a AxisModel {
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
                let whole = Arc::new(s.angle_of(1.0, &s.gyro, &s.t));
                Warm {
                    angle: best_angle(s, &s.reference_angle, &[], &whole, &s.missing, LEVEL),
                    whole,
                    motion: OnceLock::new(),
                    close: Vec::new(),
                    rate_dot: derivative(&s.t, &rate),
                    turning: Vec::new(),
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
                    whole: track.whole.clone(),
                    motion: OnceLock::new(),
                    close: nearness(s).map_or_else(Vec::new, |half| track.counted_angle(s, half)),
                    rate_dot: derivative(&s.t, &rate),
                    turning: if track.restamped { steadied(&s.t, &derivative(&s.t, &track.whole)) } else { Vec::new() },
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
        let track = |(i, s)| Arc::new(self.tracker(i, warm).track(&self.axis(model, s).terms));
        let tracks = self.series.iter().enumerate().map(track).collect();
        self.together(tracks)
    }

    /// What an axis is evaluated with.
    fn tracker<'a>(&'a self, index: usize, warm: &'a [Warm]) -> Tracker<'a> {
        Tracker { series: &self.series, index, warm, held_rate: self.held_rate }
    }

    /// What the residual changes by where one axis' term `place` becomes `term`, or where `term` joins behind its terms; `at`
    /// is the evaluation of `model`.
    #[must_use]
    pub fn difference(
        &self,
        model: &Model,
        warm: &[Warm],
        at: &Evaluation,
        (series, place): (usize, usize),
        term: &Term,
    ) -> Vec<Vec<f64>> {
        let tracker = self.tracker(series, warm);
        let terms = &self.axis(model, &self.series[series]).terms;
        let mut other = terms.clone();
        match other.get_mut(place) {
            Some(own) => own.clone_from(term),
            None => other.push(term.clone()),
        }
        let Some(moved) = tracker.moved(terms, &other, place, &at.tracks[series]) else {
            let mut tracks = at.tracks.clone();
            tracks[series] = Arc::new(tracker.track(&other));
            return less(&self.together(tracks).residual, &at.residual);
        };
        let own = &at.tracks[series];
        if self.attitude().is_none() {
            let change: Vec<f64> = match &moved {
                Moved::Angle(angle) => angle.iter().zip(&own.angle).map(|(new, own)| new - own).collect(),
                Moved::Off(off) if own.off.is_empty() => off.clone(),
                Moved::Off(off) => off.iter().zip(&own.off).map(|(new, own)| new - own).collect(),
                Moved::Reference(reference) => {
                    reference.iter().zip(&own.reference).map(|(new, own)| own - new).collect()
                }
            };
            let mut sum = 0.0;
            let mut before = change[0];
            let steps = (0..change.len()).map(|i| {
                let now = change[i];
                sum += if at.lost[i] { 0.0 } else { now - before };
                before = now;
                sum
            });
            return vec![steps.collect()];
        }
        let mut track = Track::clone(own);
        match moved {
            Moved::Angle(angle) if at.tracks.iter().all(|track| track.off.is_empty()) => {
                return self.turned_otherwise(at, series, &angle);
            }
            Moved::Angle(angle) => track.angle = angle,
            Moved::Off(off) => track.off = off,
            Moved::Reference(reference) => track.reference = reference,
        }
        let mut tracks = at.tracks.clone();
        tracks[series] = Arc::new(track);
        less(&self.together(tracks).residual, &at.residual)
    }

    /// The rate that a sensor felt, its readings' scale, bias and response undone, its errors still in it, rad/s.
    #[must_use]
    pub fn felt(&self, model: &Model, series: usize) -> Vec<f64> {
        let s = &self.series[series];
        track::felt(s, &self.axis(model, s).terms)
    }

    /// The residual of the axes' tracks.
    fn together(&self, tracks: Vec<Arc<Track>>) -> Evaluation {
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
                    let off = if track.off.is_empty() { 0.0 } else { track.off[i] - track.off[i - 1] };
                    let step =
                        track.angle[i] - track.angle[i - 1] + off - (track.reference[i] - track.reference[i - 1]);
                    r[i] = r[i - 1] + if lost[i] { 0.0 } else { step };
                }
                vec![r]
            }
            Some(attitude) => attitude.residual(self.angles(&tracks), self.offs(&tracks), &lost),
        };
        Evaluation { residual, lost, tracks }
    }

    /// The angle of each body axis that has a track.
    fn angles<'a>(&self, tracks: &'a [Arc<Track>]) -> [Option<&'a [f64]>; 3] {
        std::array::from_fn(|a| self.series.iter().position(|s| s.axis.index() == a).map(|i| &tracks[i].angle[..]))
    }

    /// What the reference shows of these angles beside them, where that is another.
    fn offs<'a>(&self, tracks: &'a [Arc<Track>]) -> [Option<&'a [f64]>; 3] {
        let off = |i: usize| Some(&tracks[i].off[..]).filter(|off| !off.is_empty());
        std::array::from_fn(|a| self.series.iter().position(|s| s.axis.index() == a).and_then(off))
    }

    /// What the residual changes by where the angle of one axis is another one; of an orientation that shows what it is.
    fn turned_otherwise(&self, at: &Evaluation, series: usize, angle: &[f64]) -> Vec<Vec<f64>> {
        let axis = self.series[series].axis.index();
        let difference = |attitude: &Attitude| attitude.difference(self.angles(&at.tracks), axis, angle, &at.lost);
        self.attitude.as_ref().map(difference).unwrap_or_default()
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
        self.about_axis(&evaluation.residual, series)
    }

    /// Channels, or their derivatives, as one axis has them.
    pub(crate) fn about_axis(&self, channels: &[Vec<f64>], series: usize) -> Vec<f64> {
        match &self.attitude {
            None => channels[0].clone(),
            Some(attitude) => attitude.about_body_axis(channels, self.series[series].axis.index()),
        }
    }
}

/// a − b, channel by channel.
fn less(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect()
}

/// Whether this is the base model's scale factor.
pub(super) fn is_scale(term: &Term) -> bool {
    term.effect.is(Trait::Gain)
}

/// Reads or writes one parameter of a model.
pub fn value<'a>(problem: &Problem, model: &'a mut Model, slot: Slot) -> Option<&'a mut f64> {
    let axis = problem.series[slot.series].axis.index();
    model.axes[axis].as_mut()?.terms.get_mut(slot.term)?.values.get_mut(slot.parameter)
}
