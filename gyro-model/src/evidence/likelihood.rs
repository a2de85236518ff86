//! The likeliest noise: the score and Fisher's information of the filter's likelihood, in one pass over the log.
//!
//! With innovations e, one a channel (m of them), and their variance S at each row,
//!
//! ```text
//! −ln L   = ½ Σ (m ln S + Σ e²/S)
//! gᵢ      = Σ ½ (m − Σ e²/S) ∂ᵢln S + Σ e ∂ᵢe / S
//! Iᵢⱼ     = Σ ½ m ∂ᵢln S ∂ⱼln S + Σ ∂ᵢe ∂ⱼe / S
//! ```
//!
//! (Watson and Engle 1983). The derivatives by the parameters' logarithms are differences of filters that run side by
//! side, one parameter of each a little larger: their recursions don't wait for one another, so the lot costs hardly more
//! than one.

#![allow(clippy::inline_always)] // what is not inlined is not compiled for the wider instructions

use super::whiten::{LogSum, NoiseModel, Rows};
use crate::nls::{self, Normal};
use std::ops::{Add, Div, Mul, Sub};

/// The lane in which the correlation time is longer.
const TIME: usize = 5;
/// The information is that of every so manieth row: it only says how far to step.
const METRIC: usize = 4;
/// By how much the logarithm of a parameter is larger.
const H: f64 = 1e-5;
/// Fall of −2 ln L with which a step is the last.
const ENOUGH: f64 = 1e-3;
/// Steps from a start that is one of several, and from the best of them on.
pub(super) const FIRST: usize = 4;
pub(super) const AFTER: usize = 12;
/// What two more parameters of the noise have to raise ln L by.
pub(super) const WORTH: f64 = 6.0;
/// Variance of the constant rate that a residual may have, (rad/s)²: any. Its bias was fitted, and a walk that was fitted away
/// with it looks smaller than it is; integrated over what was fitted, the likelihood is not fooled (restricted maximum
/// likelihood, Patterson and Thompson 1971), and does not hang on where the fit stood.
const UNKNOWN_RATE: f64 = 1.0;
/// By how much the logarithm of a parameter may move in one step: where it hardly matters, the information says nothing
/// of what it will do once it does.
const STRIDE: f64 = 2.0;
/// By how much the logarithm of a parameter may move in all.
const REACH: f64 = 9.0;

/// What is sought within.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// The largest parameters, infinite where they don't matter.
    pub most: NoiseModel,
    /// The shortest correlation time, s.
    pub shortest: f64,
    /// The smallest angle random walk, rad/√s.
    pub quietest: f64,
}

/// The likeliest noise within `limits` that is reached from `start` in so many steps, and its −ln L.
#[must_use]
pub(crate) fn seek(
    start: &NoiseModel,
    rows: &Rows,
    residual: &[Vec<f64>],
    limits: &Limits,
    steps: usize,
) -> (NoiseModel, f64) {
    seek_to(start, rows, residual, limits, steps, ENOUGH)
}

/// The same where a fall of −2 ln L by less than `enough` is not sought.
#[must_use]
pub(crate) fn seek_to(
    start: &NoiseModel,
    rows: &Rows,
    residual: &[Vec<f64>],
    limits: &Limits,
    steps: usize,
    enough: f64,
) -> (NoiseModel, f64) {
    let p = start.logs();
    let most = limits.most.with_the_parts_of(start).logs();
    let bounds: Vec<(f64, f64)> = p
        .iter()
        .zip(&most)
        .enumerate()
        .map(|(k, (v, most))| {
            let least = match k {
                0 => limits.quietest.ln().min(*most),
                4 => limits.shortest.ln().min(*most),
                _ => f64::NEG_INFINITY,
            };
            ((v - REACH).clamp(least, *most), (v + REACH).clamp(least, *most))
        })
        .collect();
    let ends = bounds.clone();
    let mut last: Option<(Vec<f64>, Normal)> = None;
    let evaluate = |p: &[f64], _: bool| {
        if let Some((_, normal)) = last.as_ref().filter(|(at, _)| at == p) {
            return normal.clone();
        }
        let mut normal = pulp::Arch::new().dispatch(Pass { p, rows, residual });
        // A parameter at its end that would go further does not drag the others along.
        for (k, (v, end)) in p.iter().zip(&ends).enumerate() {
            if (*v >= end.1 && normal.gradient[k] < 0.0) || (*v <= end.0 && normal.gradient[k] > 0.0) {
                normal.fix(k);
            }
        }
        last = Some((p.to_vec(), normal.clone()));
        normal
    };
    let options = nls::Options {
        max_iterations: steps,
        absolute: enough,
        damping: 1e-2,
        longest_step: STRIDE,
        ..nls::Options::default()
    };
    let inside: Vec<f64> = p.iter().zip(&bounds).map(|(v, b)| v.clamp(b.0, b.1)).collect();
    let found = nls::minimise(&inside, &bounds, evaluate, &options);
    (NoiseModel::from_logs(&found.values), 0.5 * found.cost)
}

/// One pass over the log, with the widest instructions that the machine has.
struct Pass<'a> {
    p: &'a [f64],
    rows: &'a Rows,
    residual: &'a [Vec<f64>],
}

impl pulp::NullaryFnOnce for Pass<'_> {
    type Output = Normal;

    #[inline(always)]
    fn call(self) -> Normal {
        if self.p.len() > 3 {
            score::<8>(self.p, self.rows, self.residual)
        } else {
            score::<4>(self.p, self.rows, self.residual)
        }
    }
}

/// −2 ln L (constants left out), its score and information by the logarithms `p` of at most L − 1 parameters.
#[inline(always)]
fn score<const L: usize>(p: &[f64], rows: &Rows, residual: &[Vec<f64>]) -> Normal {
    let n = p.len();
    let noises: [NoiseModel; L] = std::array::from_fn(|l| {
        let mut moved = p.to_vec();
        if (1..=n).contains(&l) {
            moved[l - 1] += H;
        }
        NoiseModel::from_logs(&moved)
    });
    let law = Law::new(&noises);
    let mut spread = Spread { cc: law.c2, ..Spread::default() };
    (spread.aa, spread.bb) = (Lanes([1e6; L]), Lanes([UNKNOWN_RATE; L]));
    let mut states = vec![State::<L>::default(); residual.len()];
    let channels = residual.len() as f64;
    let (mut logs, mut squares, mut even) = (LogSum::default(), 0.0, f64::NAN);
    let mut phi = Lanes([0.0; L]);
    let (mut gradient, mut information) = (Lanes([0.0; L]), [Lanes([0.0; L]); L]);
    for (i, &row) in rows.index.iter().enumerate() {
        let dt = if i == 0 { 0.0 } else { rows.t[i] - rows.t[i - 1] };
        if n > TIME - 1 && (dt - even).abs().partial_cmp(&1e-9) != Some(std::cmp::Ordering::Less) {
            // The others' lanes have the correlation time of the first one.
            phi = Lanes([(-dt / noises[0].correlation_time).exp(); L]);
            phi.0[TIME] = (-dt / noises[TIME].correlation_time).exp();
            even = dt;
        }
        let gap = rows.lost[i] && i > 0;
        if gap {
            spread.aa = spread.aa + 1e6;
        } else {
            spread.pass(&law, dt, rows.turned[i], phi);
        }
        let (s, share, gain) = spread.read(law.r * rows.spread[i]);
        let counts = i > 0 && !gap;
        let by_s = (s * share.0[0] + -1.0) * H.recip();
        let mut left = channels;
        for (state, channel) in states.iter_mut().zip(residual) {
            let e = state.innovate(dt, phi, &gain, channel[row]);
            if counts {
                let by_e = (e + -e.0[0]) * H.recip();
                let weighed = e.0[0] * share.0[0];
                left -= e.0[0] * weighed;
                squares += e.0[0] * weighed;
                gradient = gradient + by_e * weighed;
                if i % METRIC == 0 {
                    let along = by_e * share.0[0];
                    for (row, along) in information.iter_mut().zip(along.0) {
                        *row = *row + by_e * along;
                    }
                }
            }
        }
        if counts {
            logs.add(s.0[0]);
            gradient = gradient + by_s * (0.5 * left);
            if i % METRIC == 0 {
                let along = by_s * (0.5 * channels);
                for (row, along) in information.iter_mut().zip(along.0) {
                    *row = *row + by_s * along;
                }
            }
        }
    }
    let mut normal = Normal::zeros(n);
    normal.cost = channels * logs.total() + squares;
    for a in 0..n {
        normal.gradient[a] = gradient.0[a + 1];
        for b in 0..n {
            normal.matrix[(a, b)] = METRIC as f64 * information[a + 1].0[b + 1];
        }
    }
    normal
}

/// One number a filter.
#[derive(Clone, Copy)]
struct Lanes<const L: usize>([f64; L]);

impl<const L: usize> Default for Lanes<L> {
    fn default() -> Self {
        Self([0.0; L])
    }
}

macro_rules! lanewise {
    ($($op:ident $f:ident $sign:tt),*) => {$(
        impl<const L: usize> $op for Lanes<L> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                let mut out = self;
                for l in 0..L {
                    out.0[l] = self.0[l] $sign other.0[l];
                }
                out
            }
        }
        impl<const L: usize> $op<f64> for Lanes<L> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: f64) -> Self {
                let mut out = self;
                for l in 0..L {
                    out.0[l] = self.0[l] $sign other;
                }
                out
            }
        }
    )*};
}
lanewise!(Add add +, Sub sub -, Mul mul *, Div div /);

/// What the noises put into the states.
struct Law<const L: usize> {
    n2: Lanes<L>,
    b2: Lanes<L>,
    c2: Lanes<L>,
    r: Lanes<L>,
    m2: Lanes<L>,
}

impl<const L: usize> Law<L> {
    fn new(noises: &[NoiseModel; L]) -> Self {
        let square = |of: &dyn Fn(&NoiseModel) -> f64| Lanes(noises.each_ref().map(|n| of(n).powi(2)));
        Self {
            n2: square(&|n| n.angle_random_walk),
            b2: square(&|n| n.bias_random_walk),
            c2: square(&|n| n.correlated),
            r: square(&|n| n.encoder),
            m2: square(&|n| n.rate_random_walk),
        }
    }
}

/// The covariances of (a, b, c), upper triangles; see [`super::whiten`].
#[derive(Clone, Copy, Default)]
struct Spread<const L: usize> {
    aa: Lanes<L>,
    ab: Lanes<L>,
    ac: Lanes<L>,
    bb: Lanes<L>,
    bc: Lanes<L>,
    cc: Lanes<L>,
}

impl<const L: usize> Spread<L> {
    /// Over a step of time in which ∫ω²dt is `turned`.
    #[inline(always)]
    fn pass(&mut self, law: &Law<L>, dt: f64, turned: f64, phi: Lanes<L>) {
        let Self { aa, ab, ac, bb, bc, cc } = *self;
        let b2 = law.b2 * dt;
        self.aa = aa + ((ab + ac) * 2.0 + (bb + bc * 2.0 + cc + b2 * (1.0 / 3.0)) * dt + law.n2) * dt + law.m2 * turned;
        self.ab = ab + (bb + bc + b2 * 0.5) * dt;
        self.ac = phi * (ac + (bc + cc) * dt);
        self.bb = bb + b2;
        self.bc = bc * phi;
        self.cc = law.c2 + phi * phi * (cc - law.c2);
    }

    /// At a reading of variance `own`: the innovation's variance, its inverse, the gains.
    #[inline(always)]
    fn read(&mut self, own: Lanes<L>) -> (Lanes<L>, Lanes<L>, [Lanes<L>; 3]) {
        let Self { aa, ab, ac, bb, bc, cc } = *self;
        let s = aa + own + 1e-24;
        let share = Lanes([1.0; L]) / s;
        let gain = [aa * share, ab * share, ac * share];
        let left = own * share;
        (self.aa, self.ab, self.ac) = (aa * left, ab * left, ac * left);
        (self.bb, self.bc, self.cc) = (bb - gain[1] * ab, bc - gain[1] * ac, cc - gain[2] * ac);
        (s, share, gain)
    }
}

/// The states (a, b, c) of one channel.
#[derive(Clone, Copy, Default)]
struct State<const L: usize>([Lanes<L>; 3]);

impl<const L: usize> State<L> {
    /// The innovations of a reading, and the states after it.
    #[inline(always)]
    fn innovate(&mut self, dt: f64, phi: Lanes<L>, gain: &[Lanes<L>; 3], y: f64) -> Lanes<L> {
        let [a, b, c] = self.0;
        let a = a + (b + c) * dt;
        let e = Lanes([y; L]) - a;
        self.0 = [a + gain[0] * e, b + gain[1] * e, phi * c + gain[2] * e];
        e
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const TRUTH: NoiseModel = NoiseModel {
        angle_random_walk: 3e-4,
        bias_random_walk: 1e-5,
        encoder: 2e-4,
        correlated: 2e-3,
        correlation_time: 0.5,
        rate_random_walk: 2e-4,
    };

    /// A residual of that noise; the reference is read unevenly, less sure now and then, and lost once.
    fn residual(rows: usize) -> (Rows, Vec<Vec<f64>>) {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
        let mut out = Rows { rows, ..Rows::default() };
        let (mut t, mut angle, mut bias, mut correlated, mut values) = (0.0, 0.0, 0.0, 0.0, Vec::new());
        for k in 0..rows {
            let dt = if k % 3 == 0 { 0.02 } else { 0.01 };
            let spread = if k % 5 == 0 { 0.3 } else { 1.0 };
            let phi = (-dt / TRUTH.correlation_time).exp();
            t += dt;
            // Turned and held in turn.
            let rate = if k % 400 < 200 { 3.0 } else { 0.1 };
            let walk = TRUTH.angle_random_walk.hypot(TRUTH.rate_random_walk * rate);
            angle += (bias + correlated) * dt + walk * f64::sqrt(dt) * normal();
            bias += TRUTH.bias_random_walk * f64::sqrt(dt) * normal();
            correlated = phi * correlated + TRUTH.correlated * (1.0 - phi * phi).sqrt() * normal();
            values.push(angle + TRUTH.encoder * f64::sqrt(spread) * normal());
            out.index.push(k);
            out.t.push(t);
            out.turned.push(rate * rate * dt);
            out.spread.push(spread);
            out.lost.push(k == rows / 2);
        }
        (out, vec![values])
    }

    fn within(longest: f64) -> Limits {
        let most = NoiseModel { correlation_time: longest, ..NoiseModel::UNLIMITED };
        Limits { most, shortest: 0.02, quietest: 0.0 }
    }

    #[test]
    fn the_score_is_the_slope_of_the_likelihood() {
        let (rows, residual) = residual(3000);
        let p = NoiseModel { angle_random_walk: 5e-4, encoder: 1e-4, ..TRUTH }.logs();
        let at = |p: &[f64]| score::<8>(p, &rows, &residual);
        let slope = at(&p).gradient;
        for k in 0..p.len() {
            let moved = |h: f64| {
                let mut p = p.clone();
                p[k] += h;
                0.5 * at(&p).cost
            };
            let numeric = (moved(1e-4) - moved(-1e-4)) / 2e-4;
            assert!((slope[k] - numeric).abs() < 1e-3 * (1.0 + numeric.abs()), "{k}: {} {numeric}", slope[k]);
        }
    }

    #[test]
    fn the_likeliest_noise_is_found_from_one_that_is_off_by_half() {
        let (rows, residual) = residual(20_000);
        let start = NoiseModel {
            angle_random_walk: 6e-4,
            bias_random_walk: 3e-6,
            encoder: 1e-4,
            correlated: 1e-3,
            correlation_time: 1.0,
            rate_random_walk: 1e-4,
        };
        let (found, cost) = seek(&start, &rows, &residual, &within(30.0), 40);
        assert!((found.angle_random_walk / TRUTH.angle_random_walk - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.encoder / TRUTH.encoder - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.correlated / TRUTH.correlated - 1.0).abs() < 0.25, "{found:?}");
        assert!((found.correlation_time / TRUTH.correlation_time).ln().abs() < 0.5, "{found:?}");
        assert!((found.rate_random_walk / TRUTH.rate_random_walk - 1.0).abs() < 0.1, "{found:?}");
        assert!(cost < seek(&TRUTH, &rows, &residual, &within(30.0), 0).1, "likelier than the truth");
        let (short, _) = seek(&start, &rows, &residual, &within(0.1), 40);
        assert!(short.correlation_time <= 0.1 + 1e-9, "{short:?}");
        let quiet = Limits { most: NoiseModel { encoder: 1e-4, ..within(30.0).most }, ..within(30.0) };
        let (limited, dearer) = seek(&start, &rows, &residual, &quiet, 40);
        assert!(limited.encoder <= 1e-4 + 1e-12 && dearer > cost + 100.0, "{limited:?}");
    }
}
