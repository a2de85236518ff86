//! When a rate turned that is read through a play of width h, and how it went through the play.

use super::super::{quieted, white_noise};
use nalgebra::{Matrix4, Vector4};
use std::ops::Range;

/// A reading through a play of width h, at times t.
pub(super) struct Reading<'a> {
    h: f64,
    t: &'a [f64],
    felt: &'a [f64],
    /// Without its noise, as far as the motion allows.
    steady: Vec<f64>,
    /// The same, its mean where a rate is held: the range of what noise is left grows with time, until it would turn the rate.
    pub(super) level: Vec<f64>,
    /// Where that mean is all there is, a peak not being as flat.
    is_flat: Vec<bool>,
    /// Standard deviation of the noise of `felt`, and of what is left of it in `steady`.
    white: f64,
    noise: f64,
    /// By how much the rate has to come back before it counts as turned: below it, noise would turn it.
    back: f64,
}

/// The way up or down since the last turn.
#[derive(Clone, Copy)]
pub(super) struct Way {
    /// 1 up, −1 down.
    pub(super) sign: f64,
    /// The sample at which it was known that this is the way.
    pub(super) since: usize,
    /// The farthest that the reading came, and when.
    pub(super) extreme: f64,
    pub(super) at: usize,
}

impl Way {
    /// Takes the reading at sample `k` along where it is the farthest.
    pub(super) fn goes_on(&mut self, reading: f64, k: usize) -> bool {
        let goes_on = self.sign * (reading - self.extreme) >= 0.0;
        if goes_on {
            (self.extreme, self.at) = (reading, k);
        }
        goes_on
    }
}

impl<'a> Reading<'a> {
    pub(super) fn through(h: f64, t: &'a [f64], felt: &'a [f64]) -> Self {
        let (steady, noise) = quieted(t, felt);
        let (level, is_flat, back) = (steady.clone(), vec![false; t.len()], (TURN * h).max(SURE * noise));
        let mut reading = Self { h, t, felt, steady, level, is_flat, white: white_noise(felt), noise, back };
        for hold in reading.stays(SURE * noise, HOLD) {
            reading.settle(&hold);
        }
        reading
    }

    /// Levels a hold, and what a parabola through the corners overshoots where a ramp meets it.
    fn settle(&mut self, hold: &Range<usize>) {
        let part = &self.level[hold.clone()];
        let mean = part.iter().sum::<f64>() / part.len() as f64;
        let spread = part.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / part.len() as f64;
        let before = self.overshot(mean, (0..hold.start).rev());
        let after = self.overshot(mean, hold.end..self.t.len());
        let hold = hold.start - before..hold.end + after;
        self.level[hold.clone()].fill(mean);
        self.is_flat[hold].fill(spread < FLAT * self.noise.powi(2));
    }

    /// How many of the samples beside a hold lie beyond it although the readings themselves do not.
    fn overshot(&self, mean: f64, beside: impl Iterator<Item = usize> + Clone) -> usize {
        let Some(next) = beside.clone().next() else { return 0 };
        let side = (self.steady[next] - mean).signum();
        let is_beyond = |&k: &usize| side * (self.steady[k] - mean) > 0.0 && (self.t[k] - self.t[next]).abs() < HOLD;
        let beyond = beside.take_while(is_beyond);
        let (n, sum) = beyond.fold((0_u32, 0.0), |(n, sum), k| (n + 1, sum + side * (self.felt[k] - mean)));
        if sum < SHOWS * self.white * f64::from(n).sqrt() { n as usize } else { 0 }
    }

    /// Which way it goes first; `None` where it never goes any.
    pub(super) fn first_way(&self) -> Option<Way> {
        let s = &self.level;
        let (mut low, mut high) = (s[0], s[0]);
        (1..s.len()).find_map(|k| {
            (low, high) = (low.min(s[k]), high.max(s[k]));
            let sign = if s[k] >= high { 1.0 } else { -1.0 };
            (high - low > self.back).then_some(Way { sign, since: k, extreme: s[k], at: k })
        })
    }

    /// How far it is behind the farthest that it came.
    fn depth(&self, way: &Way, k: usize) -> f64 {
        way.sign * (way.extreme - self.steady[k])
    }

    pub(super) fn has_turned(&self, way: &Way, k: usize) -> bool {
        way.sign * (way.extreme - self.level[k]) > self.back
    }

    /// When it was last, going back from `k`, on the other side of that depth.
    fn crossing(&self, way: &Way, depth: f64, k: usize) -> f64 {
        let below = |i: usize| self.depth(way, i) - depth;
        let i = (way.since..k).rev().find(|&i| (below(i) > 0.0) != (below(k) > 0.0)).unwrap_or(way.since);
        let (a, b) = (below(i), below(i + 1));
        self.t[i] + (a / (a - b)).clamp(0.0, 1.0) * (self.t[i + 1] - self.t[i])
    }

    /// The samples about a peak that was seen to be one at `k`: a few at least, as long as they go the same way.
    fn about(&self, way: &Way, k: usize) -> Range<usize> {
        let reach = REACH * self.h.max(SURE * self.noise);
        let depth = |i| self.depth(way, i);
        let is_about =
            |n: usize, i: usize, before: usize| depth(i) < reach || n < FEWEST / 2 && depth(i) > depth(before);
        let risen = (way.since..way.at).rev().enumerate().take_while(|&(n, i)| is_about(n, i, i + 1)).count();
        let fallen = (way.at + 1..self.t.len()).enumerate().take(2 * risen + FEWEST);
        let fallen = fallen.take_while(|&(n, i)| i <= k || is_about(n, i, i - 1)).count();
        way.at - risen..way.at + 1 + fallen
    }

    /// Where it stays about one value: the rate may be anywhere within the play.
    pub(super) fn stands(&self) -> Vec<Range<usize>> {
        self.stays((NEAR * self.h).max(SURE * self.noise), DWELL)
    }

    /// Where it stays as `near` to its mean for longer than `dwell`, s.
    fn stays(&self, near: f64, dwell: f64) -> Vec<Range<usize>> {
        let (mut stays, mut from, mut sum) = (Vec::new(), 0, 0.0);
        for k in 0..=self.t.len() {
            let mean = sum / (k - from) as f64;
            if k == self.t.len() || k > from && (self.steady[k] - mean).abs() > near {
                if self.t[k - 1] - self.t[from] > dwell {
                    stays.push(from..k);
                }
                (from, sum) = (k, 0.0);
            }
            sum += self.steady.get(k).unwrap_or(&0.0);
        }
        stays
    }
}

/// The rate's passage through the play where it turns.
///
/// A rate that peaks is fitted to the readings about its peak. Where it turns otherwise, their slopes tell.
pub(super) struct Turn {
    /// When the rate turned, s.
    pub(super) from: f64,
    /// When the reading let go, s.
    to: f64,
    /// The share of h that it has gone by: x, x² and x³ of the time, from 0 to 1.
    shape: [f64; 3],
}

impl Turn {
    /// The turn that has shown at sample `k`.
    pub(super) fn of(reading: &Reading, way: &Way, k: usize) -> Self {
        Self::over_a_peak(reading, way, k).unwrap_or_else(|| Self::by_slopes(reading, way, k))
    }

    /// The share of the play that it has gone through.
    pub(super) fn share(&self, t: f64) -> f64 {
        let x = ((t - self.from) / (self.to - self.from).max(1e-9)).clamp(0.0, 1.0);
        x * (self.shape[0] + x * (self.shape[1] + x * self.shape[2]))
    }

    /// The reading lets go of its extreme when the rate has come back by h, and falls from there with slope v. The rate left its
    /// own extreme earlier: on a parabola 2h/v before, along a straight ramp h/v. An even peak is left as it was reached, which
    /// tells where between the two; the quadratic through both ends with slope v at the later one is exact for either.
    fn by_slopes(reading: &Reading, way: &Way, k: usize) -> Self {
        let Reading { h, back, .. } = *reading;
        let (early, late) = (reading.crossing(way, 0.3 * back, k), reading.crossing(way, back, k));
        let v = 0.7 * back / (late - early).max(1e-9);
        let let_go = (late - back / v).max(reading.t[way.at]);
        // About as long as it took to come as near on the way there, as any even peak; not longer than a parabola.
        let came = reading.crossing(way, h.max(back), way.at);
        let from = (0.5 * (came + let_go)).max(let_go - 2.0 * h / v).max(came);
        let bend = (v * (let_go - from) / h).clamp(1.0, 2.0) - 1.0;
        Self { from, to: let_go, shape: [1.0 - bend, bend, 0.0] }
    }

    /// Least squares of the readings about a peak, y up to it, flat while the rate comes back by h, and y + h after that,
    /// of a rate y = W − ½ c τ² − q τ³ from its top at τ = t − tₚ. `None` where they are no such peak.
    fn over_a_peak(reading: &Reading, way: &Way, k: usize) -> Option<Self> {
        let Reading { h, t, felt, white, .. } = *reading;
        let about = reading.about(way, k);
        if about.len() < FEWEST || reading.is_flat[way.at] {
            return None;
        }
        let (start, end) = (about.start, about.end - 1);
        let depths = [start, end].map(|i| reading.depth(way, i));
        // In units of h and of the passage's length: the rate is at `depths` and h more below its peak where they begin and end.
        let [before, after] = [depths[0].max(0.0) / h, 1.0 + depths[1].max(0.0) / h].map(f64::sqrt);
        let unit = (t[end] - t[start]) / (before + after);
        let (begin, top) = (t[start] + before * unit, felt[start + about.len() / 2]);
        let samples: Vec<(f64, f64)> = about.map(|i| ((t[i] - begin) / unit, way.sign * (felt[i] - top) / h)).collect();
        // What is known beforehand of the shape keeps few and noisy samples from bending it as they please.
        let usual = Vector4::new(0.0, 0.0, 2.0, 0.0);
        let known = Matrix4::from_diagonal(&USUAL.map(|spread| (white / h / spread).powi(2)));
        let cost = |p: &Vector4<f64>| {
            let off = p - usual;
            samples.iter().map(|&(x, y)| (y - seen(p, x).0).powi(2)).sum::<f64>() + off.dot(&(known * off))
        };
        let mut p = usual;
        let mut best = cost(&p);
        for _ in 0..ROUNDS {
            let (mut normal, mut gradient) = (known, known * (usual - p));
            for &(x, y) in &samples {
                let (value, slope) = seen(&p, x);
                normal += slope * slope.transpose();
                gradient += slope * (y - value);
            }
            let step = normal.cholesky()?.solve(&gradient);
            let tried = [1.0, 0.5, 0.25, 0.125].map(|share| p + step * share).into_iter();
            let Some((cost, next)) = tried.map(|p| (cost(&p), p)).find(|(cost, _)| *cost < best) else { break };
            let settled = best - cost < 1e-6 * best;
            (best, p) = (cost, next);
            if settled {
                break;
            }
        }
        let length = length(&p)?;
        let spread = (best / (samples.len() - 4) as f64).sqrt() * h;
        if spread > MISSES * white.hypot(FORM * (h + depths[0].max(depths[1]))) {
            return None;
        }
        let from = begin + p[1] * unit;
        let shape = [0.0, 0.5 * p[2] * length.powi(2), p[3] * length.powi(3)];
        Some(Self { from, to: from + length * unit, shape })
    }
}

/// The reading about a peak, over h, and its slopes along W, tₚ, c and q.
fn seen(p: &Vector4<f64>, x: f64) -> (f64, Vector4<f64>) {
    let [top, at, c, q] = [p[0], p[1], p[2], p[3]];
    let back = |x: f64| x * x * (0.5 * c + q * x);
    let x = x - at;
    let fallen = back(x);
    if x > 0.0 && fallen < 1.0 {
        return (top, Vector4::new(1.0, 0.0, 0.0, 0.0));
    }
    let up = if x > 0.0 { 1.0 } else { 0.0 };
    (top - fallen + up, Vector4::new(1.0, c * x + 3.0 * q * x * x, -0.5 * x * x, -x.powi(3)))
}

/// How long the rate takes to come back by h; `None` where it never does.
fn length(p: &Vector4<f64>) -> Option<f64> {
    let (c, q) = (p[2], p[3]);
    let mut x = (2.0 / c).sqrt();
    for _ in 0..20 {
        let slope = x * (c + 3.0 * q * x);
        x -= (x * x * (0.5 * c + q * x) - 1.0) / slope;
    }
    let back = x * x * (0.5 * c + q * x);
    (c > 0.0 && x > 0.0 && c + 3.0 * q * x > 0.0 && (back - 1.0).abs() < 1e-6).then_some(x)
}

/// Times h that the reading may be below its peak to count as about it.
const REACH: f64 = 1.25;
/// By how much W and tₚ, of h and of a passage, c and q may be off beforehand.
const USUAL: Vector4<f64> = Vector4::new(f64::INFINITY, f64::INFINITY, 1.0, 0.2);
/// Share of what the rate goes through that the form is right to.
const FORM: f64 = 0.01;
/// Samples that a peak has to have.
const FEWEST: usize = 8;
/// Rounds of Gauss and Newton.
const ROUNDS: usize = 12;
/// Times the noise that a peak may be missed by.
const MISSES: f64 = 1.5;

/// Share of h within which the reading counts as standing still, and for how long, s.
const NEAR: f64 = 0.3;
const DWELL: f64 = 0.05;
/// How long a rate is held for at least, s, the times the noise's variance that it varies by at most, and the standard deviations
/// by which readings show that it overshot.
const HOLD: f64 = 0.25;
const FLAT: f64 = 2.0;
const SHOWS: f64 = 4.0;

/// Share of h by which the rate has to come back before it counts as turned.
pub(super) const TURN: f64 = 0.5;
/// Standard deviations of the steadied reading's noise that noise alone hardly goes.
const SURE: f64 = 5.0;
