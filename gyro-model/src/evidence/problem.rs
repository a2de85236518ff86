//! The residual of a model on a log: compensated angle less reference angle, and its derivatives.
//!
//! Shaft references: r(t) = θ̂(t) − θ_ref(t), one channel. Quaternion references, three axes together: the error of each
//! step, in the frame of its middle, turned to the world and summed, three channels; where an axis has no gyro, or is not
//! asked about, those of the others summed in the body, a channel each. Where a reading holds no
//! information (missing, saturated, inside a dead zone) the residual stands still: that step says nothing.

use super::{
    attitude::Attitude,
    integrate::integral,
    knots,
    prior::Prior,
    series::{HOLE, Rest, Series, usual},
    shaft::{LEVEL, best_angle, counted_angle, nearness, stand},
    track::{Track, angle_of},
};
use crate::{
    Axis, AxisModel, Model, Record, Term,
    effects::{Parabola, Role, Stage, Trait, derivative, quieter, steadied},
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
    pub(super) felt: Vec<f64>,
    /// The integral of the compensated rate, re-stamped, at the samples, rad.
    whole: Arc<Vec<f64>>,
    motion: OnceLock<Quiet>,
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

/// A motion without the gyro's noise, as far as it is slower than that.
#[derive(Clone, Debug)]
pub(super) struct Quiet {
    /// At the samples, rad.
    pub angle: Vec<f64>,
    /// Its derivative, rad/s.
    pub rate: Vec<f64>,
    /// What took the noise out; `None` where the motion allows nothing.
    pub by: Option<Parabola>,
}

impl Quiet {
    fn of(t: &[f64], rate: &[f64], by: Option<Parabola>) -> Self {
        let rate = by.as_ref().map_or_else(|| rate.to_vec(), |by| by.through_all(rate));
        Self { angle: integral(t, &rate), rate, by }
    }

    /// What is left of another angle, noise alone say, where the same is done to it.
    pub fn likewise(&self, t: &[f64], angle: &[f64]) -> Self {
        Self::of(t, &derivative(t, angle), self.by.clone())
    }
}

impl Warm {
    /// What a reference shows a part of: with the noise in it, a mean over several samples would make the residual's noise less.
    pub(super) fn motion(&self, t: &[f64]) -> &Quiet {
        self.motion.get_or_init(|| {
            let rate = derivative(t, &self.whole);
            Quiet::of(t, &rate, quieter(t, &rate))
        })
    }

    /// The same with what is a guess on this track.
    pub(super) fn unsure_as(&self, track: &Track) -> Self {
        let unsure = if self.left_out.is_empty() { track.unsure.clone() } else { Vec::new() };
        Self { unsure, ..self.clone() }
    }

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
        if spread(&turned) > TURNS * prior.encoder.hypot(walk) && moves(series, prior) {
            Rest::OfReference
        } else {
            Rest::Whole
        }
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
                let whole = Arc::new(angle_of(s, 1.0, &s.gyro, &s.t));
                Warm {
                    angle: best_angle(s, &s.reference_angle, &[], &whole, &s.missing, LEVEL),
                    whole,
                    motion: OnceLock::new(),
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
                    whole: track.whole.clone(),
                    motion: OnceLock::new(),
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
        let track = |(i, s)| Arc::new(self.track(s, &self.axis(model, s).terms, i, warm));
        let tracks = self.series.iter().enumerate().map(track).collect();
        self.together(tracks)
    }

    /// The residual of the axes' tracks.
    pub(super) fn together(&self, tracks: Vec<Arc<Track>>) -> Evaluation {
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
    pub(super) fn turned_otherwise(&self, at: &Evaluation, series: usize, angle: &[f64]) -> Vec<Vec<f64>> {
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
        match &self.attitude {
            None => evaluation.residual[0].clone(),
            Some(attitude) => attitude.about_body_axis(&evaluation.residual, self.series[series].axis.index()),
        }
    }
}

/// Whether a gyro's reading keeps changing from one stretch to the next by more than its noise: a bias that drifts or steps does
/// not, a sensor that turns does.
fn moves(series: &Series, prior: &Prior) -> bool {
    let rows = ((STRETCH / series.span().dt).round() as usize).max(1);
    let means: Vec<f64> =
        series.gyro.chunks_exact(rows).map(|part| part.iter().sum::<f64>() / part.len() as f64).collect();
    let changes: Vec<f64> = means.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    // Of normal numbers the median size lies at 0.674 of the standard deviation.
    let noise = 0.674 * prior.reading * (2.0 / (rows as f64 * series.span().dt)).sqrt();
    median(changes).is_some_and(|usual| usual > TURNS * noise)
}

/// A stretch of a rest, s.
const STRETCH: f64 = 1.0;

/// Standard deviations of the reference's noise that an axis has to turn by, in the root mean square.
const TURNS: f64 = 3.0;

/// Whether this is the base model's scale factor.
pub(super) fn is_scale(term: &Term) -> bool {
    term.effect.is(Trait::Gain)
}

/// Reads or writes one parameter of a model.
pub fn value<'a>(problem: &Problem, model: &'a mut Model, slot: Slot) -> Option<&'a mut f64> {
    let axis = problem.series[slot.series].axis.index();
    model.axes[axis].as_mut()?.terms.get_mut(slot.term)?.values.get_mut(slot.parameter)
}
