//! `rate-hysteresis`: the output depends on the direction of change, a play operator of width h on ω.

use super::{Card, Effect, ErrorWhole, Memory, ParameterCard, Role, Signals, Span, Stage, play, quieted, white_noise};
use crate::Axis;
use nalgebra::{Matrix4, Vector4};

/// The effect.
pub static RATE_HYSTERESIS: RateHysteresis = RateHysteresis;

/// See the file's head.
pub struct RateHysteresis;

static CARD: Card = Card {
    id: "rate-hysteresis",
    title: "hysteresis in rate",
    physics: "Friction in the suspension or charge in the dielectric holds the output back until the rate has \
              changed by h, at every turn of the acceleration.",
    equation: "ω_f = P_h(ω): stands still until ω has left the clearance ±h/2 about it",
    typical: "0.01–0.5 °/s",
    source: "IEEE Std 1431, hysteresis error; play operator",
    needs: &[],
    excited_by: "reversals of the acceleration, several amplitudes",
    mended_by: "well, where noise is smaller than h",
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "h",
    unit: "rad/s",
    says: "width of the clearance",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.01,
    bounds: (0.0, 0.5),
}];

/// −h/2 while the rate goes up, +h/2 while it goes down, and between them the passage through the play.
///
/// A rate that peaks is fitted to the readings about its peak ([`Passage::over_a_peak`]). Where it turns otherwise, the slopes
/// tell: the reading lets go of its extreme P when the rate has come back by h, and falls from there with slope v. The rate left
/// its own extreme earlier: on a parabola 2h/v before, along a straight ramp h/v. An even peak is left as it was reached, which
/// tells where between the two; the quadratic through both ends with slope v at the later one is exact for either. But a
/// rate that is held, and wanders within the play, shows nothing of it: while the reading stands still, and before it first
/// turns, the error is unsure.
fn passages(h: f64, t: &[f64], felt: &[f64]) -> ErrorWhole {
    let (mut error, mut unsure) = (vec![0.0; t.len()], vec![false; t.len()]);
    if h <= 0.0 || t.len() < 3 {
        return ErrorWhole { error, unsure };
    }
    let (s, noise) = quieted(t, felt);
    let white = white_noise(felt);
    // By how much the rate has to come back before it counts as turned: below it, noise would turn it.
    let back = (TURN * h).max(SURE * noise);
    // Where the steadied reading, going back from `k`, was last on the other side of that depth below the extreme.
    let crossing = |extreme: f64, sign: f64, depth: f64, k: usize, from: usize| -> f64 {
        let below = |i: usize| sign * (extreme - s[i]) - depth;
        let other = |i: &usize| (below(*i) > 0.0) != (below(k) > 0.0);
        let i = (from..k).rev().find(other).unwrap_or(from);
        let (a, b) = (below(i), below(i + 1));
        t[i] + (a / (a - b)).clamp(0.0, 1.0) * (t[i + 1] - t[i])
    };
    let (mut sign, mut extreme, mut at, mut since, mut level) = (0.0, s[0], 0, 0, 0.0);
    let (mut low, mut high) = (s[0], s[0]);
    for k in 1..t.len() {
        if sign == 0.0 {
            (low, high) = (low.min(s[k]), high.max(s[k]));
            if high - low > back {
                sign = if s[k] >= high { 1.0 } else { -1.0 };
                (extreme, at, since, level) = (s[k], k, k, -0.5 * h * sign);
            }
            unsure[k] = true;
            continue;
        }
        error[k] = level;
        if sign * (s[k] - extreme) >= 0.0 {
            (extreme, at) = (s[k], k);
        } else if sign * (extreme - s[k]) > back {
            let (early, late) =
                (crossing(extreme, sign, 0.3 * back, k, since), crossing(extreme, sign, back, k, since));
            let v = 0.7 * back / (late - early).max(1e-9);
            let let_go = (late - back / v).max(t[at]);
            // About as long as it took to come as near on the way there, as any even peak; not longer than a parabola.
            let came = crossing(extreme, sign, h.max(back), at, since);
            let first = (0.5 * (came + let_go)).max(let_go - 2.0 * h / v).max(came);
            let bend = (v * (let_go - first) / h).clamp(1.0, 2.0) - 1.0;
            let rough = Passage { from: first, to: let_go, shape: [1.0 - bend, bend, 0.0] };
            let depth = |i: usize| sign * (extreme - s[i]);
            let reach = REACH * h.max(SURE * noise);
            // A few samples at least, as long as they go the same way.
            let is_about =
                |n: usize, i: usize, before: usize| depth(i) < reach || n < FEWEST / 2 && depth(i) > depth(before);
            let risen = (since..at).rev().enumerate().take_while(|&(n, i)| is_about(n, i, i + 1)).count();
            let fallen = (at + 1..t.len()).enumerate().take(2 * risen + FEWEST);
            let fallen = fallen.take_while(|&(n, i)| i <= k || is_about(n, i, i - 1)).count();
            let window = at - risen..at + 1 + fallen;
            let depths = [window.start, window.end - 1].map(depth);
            let samples: Vec<(f64, f64)> = window.map(|i| (t[i], sign * felt[i])).collect();
            let passage = Passage::over_a_peak(h, &samples, depths, white).unwrap_or(rough);
            let mut i = k;
            while i > since && t[i] > passage.from {
                error[i] = level * (1.0 - 2.0 * passage.share(t[i]));
                i -= 1;
            }
            (sign, extreme, at, since, level) = (-sign, s[k], k, k, -level);
        }
    }
    // Where the reading stays about one value, the rate may be anywhere within the play.
    let near = (NEAR * h).max(SURE * noise);
    let mut from = 0;
    for k in 1..=t.len() {
        if k == t.len() || (s[k] - s[from]).abs() > near {
            if t[k - 1] - t[from] > DWELL {
                unsure[from..k].fill(true);
            }
            from = k;
        }
    }
    ErrorWhole { error, unsure }
}

/// The rate's way through the play.
struct Passage {
    /// When the rate turned, s.
    from: f64,
    /// When the reading let go, s.
    to: f64,
    /// The share of h that it has gone by: x, x² and x³ of the time, from 0 to 1.
    shape: [f64; 3],
}

impl Passage {
    fn share(&self, t: f64) -> f64 {
        let x = ((t - self.from) / (self.to - self.from).max(1e-9)).clamp(0.0, 1.0);
        x * (self.shape[0] + x * (self.shape[1] + x * self.shape[2]))
    }

    /// Least squares of the readings about a peak, y up to it, flat while the rate comes back by h, and y + h after that,
    /// of a rate y = W − ½ c τ² − q τ³ from its top at τ = t − tₚ. `None` where they are no such peak.
    fn over_a_peak(h: f64, readings: &[(f64, f64)], depths: [f64; 2], noise: f64) -> Option<Self> {
        if readings.len() < FEWEST {
            return None;
        }
        // In units of h and of the passage's length: the rate is at `depths` and h more below its peak where they begin and end.
        let [before, after] = [depths[0].max(0.0) / h, 1.0 + depths[1].max(0.0) / h].map(f64::sqrt);
        let unit = (readings[readings.len() - 1].0 - readings[0].0) / (before + after);
        let (begin, top) = (readings[0].0 + before * unit, readings[readings.len() / 2].1);
        let samples: Vec<(f64, f64)> = readings.iter().map(|(t, y)| ((t - begin) / unit, (y - top) / h)).collect();
        // What is known beforehand of the shape keeps few and noisy samples from bending it as they please.
        let usual = Vector4::new(0.0, 0.0, 2.0, 0.0);
        let known = Matrix4::from_diagonal(&USUAL.map(|spread| (noise / h / spread).powi(2)));
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
        if spread > MISSES * noise.hypot(FORM * (h + depths[0].max(depths[1]))) {
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

/// Share of h by which the rate has to come back before it counts as turned.
const TURN: f64 = 0.5;
/// Standard deviations of the steadied reading's noise that noise alone hardly goes.
const SURE: f64 = 5.0;

impl Effect for RateHysteresis {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn stage(&self) -> Stage {
        Stage::Felt
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        play(p[0], s.rate(), memory) - s.rate()
    }

    /// Inside the play the reading stands still whatever the rate does, so P_h has no inverse. Where the rate has turned
    /// is seen from a narrower play that it has crossed: −h/2 going up, +h/2 going down.
    fn error_seen(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let turn = TURN * p[0];
        if turn > 0.0 { (play(turn, s.rate(), memory) - s.rate()) / TURN } else { 0.0 }
    }

    fn error_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> Option<ErrorWhole> {
        Some(passages(p[0], t, felt))
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        let end = (0.3 * span.reading_max).min(0.5);
        std::iter::successors(Some(3e-4), |h| Some(h * 1.6)).take_while(|&h| h <= end).map(|h| vec![h]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Motion, Shaft};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Readings of a motion through the play, at times t: `(t, felt, error)`.
    fn readings(motion: Motion, rate: f64, seconds: f64, h: f64, density: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let fine = 10;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut shaft = Shaft::new(motion, 1);
        let mut memory = Memory::default();
        let (mut t, mut felt, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..(seconds * rate) as usize * fine {
            let at = k as f64 / rate / fine as f64;
            let true_rate = shaft.at(at).rate;
            let error =
                RATE_HYSTERESIS.error(&[h], &Signals { rates: [true_rate; 3], ..Signals::default() }, &mut memory);
            if k % fine == 0 {
                let noise: f64 = StandardNormal.sample(&mut rng);
                t.push(at);
                felt.push(true_rate + error + density * f64::sqrt(rate) * noise);
                truth.push(error);
            }
        }
        (t, felt, truth)
    }

    /// What a drive's angle is off by at most where the error counts as known, over what white noise alone walks.
    fn off(h: f64, density: f64) -> f64 {
        let (rate, seconds) = (100.0, 60.0);
        let (t, felt, truth) = readings(Motion::Drive { rate: 1.2, hold: 2.0 }, rate, seconds, h, density);
        let whole = passages(h, &t, &felt);
        let steps = (0..t.len()).filter(|&k| !whole.unsure[k]).map(|k| (whole.error[k] - truth[k]) / rate);
        let walk = steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(f64::abs(*sum))
        });
        walk.fold(0.0, f64::max) / (density * f64::sqrt(seconds))
    }

    /// How late a rate counts as turned, in the mean, s: what the angle is off by, the same way at every turn, over h.
    fn late(motion: Motion, h: f64, rate: f64, density: f64) -> f64 {
        let (t, felt, truth) = readings(motion, rate, 60.0, h, density);
        let whole = passages(h, &t, &felt);
        let (mut off, mut turns) = (0.0, 0.0);
        let about = (0.05 * rate) as usize;
        for k in about..t.len() - about {
            // The error goes from −h/2 to h/2 where the rate peaks, and back at its troughs.
            let peak = (felt[k] - 0.5 * (felt[k - about] + felt[k + about])).signum();
            off += peak * (truth[k] - whole.error[k]) / rate;
            turns += (truth[k] - truth[k - 1]).abs() / h;
        }
        off / h / turns
    }

    #[test]
    fn a_reading_as_noisy_as_the_play_is_wide_shows_which_way_it_goes() {
        assert!(off(1e-3, 1e-4) < 1.0 && off(6e-3, 1e-4) < 1.0, "{} {}", off(1e-3, 1e-4), off(6e-3, 1e-4));
    }

    #[test]
    fn a_rate_that_creeps_before_it_turns_is_not_taken_for_a_long_passage() {
        assert!(off(6e-3, 1e-5) < 2.0 && off(0.02, 1e-5) < 2.0, "{} {}", off(6e-3, 1e-5), off(0.02, 1e-5));
    }

    #[test]
    fn a_peak_tells_when_the_rate_turned_however_noisy_and_short() {
        let sine = Motion::Sine { amplitude: 2.5, frequency: 0.4 };
        let multisine = Motion::Multisine { travel: 6.0 };
        for (motion, h, rate, density) in [
            (sine, 0.02, 250.0, 1e-5),
            (sine, 0.02, 250.0, 1e-4),
            (sine, 0.01, 500.0, 1e-4),
            (multisine, 0.03, 100.0, 1e-4),
            (multisine, 0.03, 500.0, 1e-4),
        ] {
            let late = late(motion, h, rate, density);
            assert!(late.abs() < 2e-3, "{late} s: {motion:?}, {h} rad/s at {rate} Hz, {density} rad/√s");
        }
    }
}
