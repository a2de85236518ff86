//! Draws of noise alone on a log's own motion.
//!
//! White gyro noise integrated along the log, what rounding leaves of its readings, and the encoder's own quantisation
//! along the motion as it was, its zero at a random place; where the motion repeats itself exactly, at the place that the
//! residual shows.

use super::{
    integrate::integral,
    prior::{Prior, reference_walk},
    rough::median_apart,
    rounding::Rounding,
    series::{Reading, Series, curve, rests},
    study::{Bench, Study},
    track::{shown_of_noise, undone},
    warm::Warm,
};
use crate::{Term, effects::Stage, parallel};
use itertools::Itertools;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, weighted::WeightedIndex};
use std::borrow::Cow;

/// The draw whose encoder counts from where the shaft stood at first: under a regular motion what it reads too much repeats
/// itself there as nowhere else.
const ZEROED: u64 = 0;

/// Draws of noise alone on the motion of one axis of a study: residuals at its reference rows, each channel its own.
pub(crate) struct Draws<'a> {
    study: &'a Study<'a>,
    series: usize,
    /// Where the shaft stood in the encoder's counts, draw by draw; anywhere without them.
    places: Option<Vec<Place>>,
}

/// Counts that an encoder would have shown from elsewhere.
pub(crate) struct Recounted {
    /// The readings that they single out.
    pub readings: Vec<Reading>,
    /// What the encoder makes the residual be at each reference row, rad.
    pub plain: Vec<f64>,
    /// The same as it is read: at those readings less what each is known to be off by.
    pub read: Vec<f64>,
}

/// How the reference's rows are looked at.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
enum Seen {
    /// Each for itself, as the error curve does.
    Plain,
    /// As readings of a filter. It sees the steps of a motion that repeats itself repeat as well, whatever stands between.
    ByFilter,
}

impl<'a> Draws<'a> {
    /// With an encoder that counts from anywhere.
    #[must_use]
    pub(crate) fn anywhere(study: &'a Study<'a>, series: usize) -> Self {
        Self { study, series, places: None }
    }

    /// With one that counts from where the residual says, if the motion repeats itself exactly; `None` where it does not.
    #[must_use]
    pub(crate) fn where_seen(study: &'a Study<'a>, series: usize) -> Option<Self> {
        Some(Self { places: Some(places(study, series)?), ..Self::anywhere(study, series) })
    }

    /// One draw as the error curve sees it.
    #[must_use]
    pub(crate) fn plain(&self, seed: u64) -> Vec<Vec<f64>> {
        self.draw(Seen::Plain, seed)
    }

    /// One draw as the filter reads it: at the middle of a count the encoder errs as little as there, wherever its zero is.
    #[must_use]
    pub(crate) fn read(&self, seed: u64) -> Vec<Vec<f64>> {
        self.draw(Seen::ByFilter, seed)
    }

    /// Counts drawn anew along the motion: the readings that they single out, and what the encoder makes the residual be, at all rows
    /// and as it is read there. `None` without an encoder whose counts show.
    ///
    /// A count's rest where the shaft turns round is long or short by where the encoder counts from, and what it reads too much goes
    /// with that. Whoever holds the rows fixed sees nothing of it.
    #[must_use]
    pub(crate) fn recounted(&self, seed: u64) -> Option<Recounted> {
        let s = &self.study.bench.problem.series[self.series];
        if !s.encoder.shows_counts() {
            return None;
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let along = self.study.warm[self.series].drawn_along();
        let mut angle: Vec<f64> = s.reference_rows.iter().map(|&k| along[k]).collect();
        if let Some(places) = &self.places {
            let (place, mean) = (places[seed as usize % places.len()], mean(&angle));
            for angle in &mut angle {
                *angle = place.of(*angle, mean);
            }
        } else {
            let offset = rng.random::<f64>() * s.encoder.step;
            for angle in &mut angle {
                *angle += offset;
            }
        }
        let counts: Vec<f64> =
            angle.iter().map(|angle| s.encoder.count(angle + s.encoder.noise * draw_normal(&mut rng))).collect();
        let plain: Vec<f64> = angle.iter().zip(&counts).map(|(angle, count)| angle - count).collect();
        let readings = rests(&counts, &s.encoder);
        let mut read = plain.clone();
        for reading in &readings {
            read[reading.row] -= reading.off;
        }
        Some(Recounted { readings, plain, read })
    }

    fn draw(&self, seen: Seen, seed: u64) -> Vec<Vec<f64>> {
        let (bench, lost) = (self.study.bench, &self.study.evaluation.lost);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (s, prior) = (&bench.problem.series[self.series], &bench.prior[self.series]);
        let mut along = Cow::from(self.study.warm[self.series].drawn_along());
        let place = self.places.as_ref().map(|places| places[seed as usize % places.len()]);
        if let Some(place) = place {
            let mean = mean(&s.reference_rows.iter().map(|&k| along[k]).collect::<Vec<_>>());
            along.to_mut().iter_mut().for_each(|angle| *angle = place.of(*angle, mean));
        }
        let rounded = rounded(s, prior, seed);
        let white = white_share(s, prior).sqrt() * prior.angle_random_walk;
        let terms = self.study.model.axes[s.axis.index()].as_ref().map_or(&[][..], |model| &model.terms);
        let is_shown = terms.iter().any(|term| term.effect.stage() == Stage::Shown);
        let mut share = vec![1.0; s.reference_rows.len()];
        if seen == Seen::ByFilter {
            for reading in &s.readings {
                share[reading.row] = reading.steps.sqrt();
            }
        }
        (0..bench.problem.channels())
            .map(|_| {
                let mut offset = match place {
                    Some(_) => 0.0,
                    None if seed == ZEROED => 0.0,
                    None => rng.random::<f64>() * s.encoder.step,
                };
                let smoothed = if is_shown { self.walk_as_shown(terms, prior, &mut rng) } else { Vec::new() };
                let (mut walk, mut skipped, mut before) = (0.0, 0.0, 0.0);
                s.reference_rows
                    .iter()
                    .enumerate()
                    .map(|(i, _)| {
                        let normal = draw_normal(&mut rng);
                        if let Some(shown) = smoothed.get(i) {
                            walk = *shown;
                        } else if i > 0 {
                            walk += white * (s.reference_t[i] - s.reference_t[i - 1]).sqrt() * normal;
                        }
                        if lost[i] && s.encoder.step > 0.0 && seen == Seen::Plain {
                            // How far the shaft turned there is known to whole counts only.
                            offset = rng.random::<f64>() * s.encoder.step;
                        }
                        let noise = s.encoder.noise * draw_normal(&mut rng);
                        let reading =
                            share[i] * (encoder_error(s, prior, &along, offset, i, noise, &mut rng) - noise) + noise;
                        let whole = walk + rounded.get(s.reference_rows[i]).unwrap_or(&0.0) - reading;
                        // A step that says nothing is bridged, as in the residual: what it held, encoder noise too, is gone.
                        if lost[i] {
                            skipped += whole - before;
                        }
                        before = whole;
                        whole - skipped
                    })
                    .collect()
            })
            .collect()
    }

    /// White noise of the readings as an angle at the reference's rows, what the model makes of it in the angle that a smoothed reference
    /// shows included.
    fn walk_as_shown(&self, terms: &[Term], prior: &Prior, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let s = &self.study.bench.problem.series[self.series];
        let (own, of_reference) = whites(s, prior);
        let angle = integral(&s.t, &white_rates(s, own, rng));
        let off = shown_of_noise(s, terms, &self.study.warm[self.series], &angle);
        let walk = walk(s, of_reference, rng);
        s.reference_rows.iter().zip(off).zip(walk).map(|((&row, off), walk)| angle[row] + off + walk).collect()
    }
}

/// One draw of noise alone from the samples on, as residuals at the reference rows: what is left of it where each of two models
/// undoes what its `terms` do to readings and to their times, and compares with what they say that the reference shows.
#[must_use]
pub(crate) fn draw_through(bench: &Bench, series: usize, warm: &Warm, terms: [&[Term]; 2], seed: u64) -> [Vec<f64>; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (s, prior) = (&bench.problem.series[series], &bench.prior[series]);
    let (own, of_reference) = whites(s, prior);
    let mut noise = white_rates(s, own, &mut rng);
    if let Some(rounding) = &prior.rounding {
        noise.iter_mut().zip(rounding.draw(seed)).for_each(|(noise, off)| *noise += off);
    }
    let offset = rng.random::<f64>() * s.encoder.step;
    let along = warm.drawn_along();
    let reading: Vec<f64> = (0..s.reference_rows.len())
        .map(|i| {
            let noise = s.encoder.noise * draw_normal(&mut rng);
            encoder_error(s, prior, along, offset, i, noise, &mut rng)
        })
        .collect();
    let walk = walk(s, of_reference, &mut rng);
    terms.map(|terms| {
        let angle = undone(s, terms, &noise);
        let off = shown_of_noise(s, terms, warm, &angle).into_iter().chain(std::iter::repeat(0.0));
        let reference = reading.iter().zip(&walk).map(|(reading, walk)| reading + walk);
        s.reference_rows.iter().zip(reference).zip(off).map(|((&row, e), off)| angle[row] + off - e).collect()
    })
}

/// N of the white noise of the readings, and of a reference that is a rate, rad/√s: no response of the gyro shapes that.
fn whites(s: &Series, prior: &Prior) -> (f64, f64) {
    let reference = reference_walk(s);
    let own = (prior.angle_random_walk.powi(2) - reference.powi(2)).max(0.0).sqrt();
    (white_share(s, prior).sqrt() * own, reference)
}

/// White noise of the readings, N = `white` rad/√s, at the samples, rad/s; at those without a reading as the gyro's is, between the
/// readings beside them.
fn white_rates(s: &Series, white: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let at: Vec<f64> = s.t.iter().zip(&s.read).filter(|(_, read)| **read).map(|(t, _)| *t).collect();
    let sigma = white / median_apart(&at).sqrt();
    let drawn: Vec<f64> = s.read.iter().map(|read| if *read { sigma * draw_normal(rng) } else { f64::NAN }).collect();
    curve(&s.t, &drawn).unwrap_or_default()
}

/// White noise of a reference that is a rate, N = `white` rad/√s, as an angle at its rows, rad.
fn walk(s: &Series, white: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let steps = s.reference_t.windows(2).map(|pair| white * (pair[1] - pair[0]).sqrt() * draw_normal(rng));
    let sum = |angle: &mut f64, step: f64| {
        *angle += step;
        Some(*angle)
    };
    std::iter::once(0.0).chain(steps).scan(0.0, sum).collect()
}

/// The angle, at the samples, of what rounding leaves of the rates that are held, rad; empty where noise evens it out.
fn rounded(s: &Series, prior: &Prior, seed: u64) -> Vec<f64> {
    prior.rounding.as_ref().map_or_else(Vec::new, |rounding| integral(&s.t, &rounding.draw(seed)))
}

/// Share of the reading's noise that is white beside that.
fn white_share(s: &Series, prior: &Prior) -> f64 {
    let of = |rounding: &Rounding| rounding.variance() * s.span().dt / prior.reading.powi(2);
    prior.rounding.as_ref().map_or(1.0, |rounding| (1.0 - of(rounding)).max(0.0))
}

fn draw_normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// What the encoder's steps and the `noise` of the angle that it counts make it read too much at one of its rows; white where it has
/// none.
fn encoder_error(
    s: &Series,
    prior: &Prior,
    along: &[f64],
    offset: f64,
    i: usize,
    noise: f64,
    rng: &mut ChaCha8Rng,
) -> f64 {
    if s.encoder.step > 0.0 {
        s.encoder.noisy_error(&|i| along[s.reference_rows[i]] + offset, s.reference_rows.len(), i, noise)
    } else {
        prior.encoder * draw_normal(rng)
    }
}

/// Times more counts than it is seen at that a motion would have come to which did not repeat itself exactly.
const REPEATS: f64 = 2.0;
/// Places that it may have stood at, drawn.
const PLACES: usize = 40;
/// Rows from which it is told where such a shaft stood.
const ENOUGH: usize = 6_000;

/// Where a shaft stood that repeats its motion exactly, as its encoder counts it.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// From the middle of a count to where the encoder counts from, rad.
    zero: f64,
    /// How much farther it turned from its mean than the model says, as a share: a fit follows the counts where it turns round.
    farther: f64,
}

impl Place {
    /// An angle in the place of one that the model says.
    fn of(self, angle: f64, mean: f64) -> f64 {
        mean + (angle - mean) * (1.0 + self.farther) + self.zero
    }
}

/// One for each draw, where the motion repeats itself exactly: what the encoder's steps make it err by then depends on where it
/// counts from, and shows in the residual. As likely as the residual's differences say.
fn places(study: &Study, series: usize) -> Option<Vec<Place>> {
    let (s, warm) = (&study.bench.problem.series[series], &study.warm[series]);
    let steps = (s.encoder.step > 0.0).then(|| s.encoder.distinct(&s.reference_angle));
    let (counts, _) = steps.filter(|(_, times)| *times > REPEATS)?;
    let [residual] = study.evaluation.residual.as_slice() else { return None };
    // Beyond what is lost the angle has a level of its own, which is not known so well.
    if study.evaluation.lost.contains(&true) {
        return None;
    }
    let angle: Vec<f64> = s.reference_rows.iter().map(|&k| warm.drawn_along()[k]).collect();
    let mean = mean(&angle);
    let reach = angle.iter().map(|angle| (angle - mean).abs()).fold(0.0, f64::max);
    let (step, rows) = (s.encoder.step, angle.len().min(ENOUGH));
    let square = |place: &Place| -> f64 {
        let along = |i: usize| place.of(angle[i], mean);
        let left = |i: usize| residual[i] + place.farther * (angle[i] - mean) + s.encoder.error(&along, rows, i);
        let left: Vec<f64> = (0..rows).map(left).collect();
        left.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum()
    };
    // In counts: first everywhere, then about the likeliest.
    let about = |at: Place, zeros: i32, farther: i32, apart: f64| -> Vec<(Place, f64)> {
        let place = |(zero, more)| Place {
            zero: at.zero + apart * step * f64::from(zero),
            farther: at.farther + apart * step / reach * f64::from(more),
        };
        let tried: Vec<Place> = (-zeros..=zeros).cartesian_product(-farther..=farther).map(place).collect();
        let squares = parallel::map(&tried, square);
        tried.into_iter().zip(squares).collect()
    };
    let likeliest = |tried: &[(Place, f64)]| tried.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
    let (at, _) = likeliest(&about(Place { zero: 0.0, farther: 0.0 }, 10, 16, 0.05))?;
    let tried = about(at, 6, 6, 0.01);
    let (_, least) = likeliest(&tried)?;
    let likely = tried.iter().map(|(_, square)| (-0.5 * (square / least - 1.0) * counts as f64).exp());
    let odds = WeightedIndex::new(likely).ok()?;
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    Some((0..PLACES).map(|_| tried[odds.sample(&mut rng)].0).collect())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
