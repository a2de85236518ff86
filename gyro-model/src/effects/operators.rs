//! What several effects are made of: play, derivatives of samples, a first-order low-pass.

use crate::order::median;
use bytemuck::{Pod, Zeroable};

/// The last two samples of a felt rate.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Lately {
    /// The rates, the later one first.
    pub(crate) felt: [f64; 2],
    /// Between them, s.
    pub(crate) dt: f64,
    /// Samples so far, at most 3.
    pub(crate) samples: f64,
}

impl Lately {
    /// One sample more, `dt` after the last.
    pub(crate) fn take(&mut self, felt: f64, dt: f64) {
        *self = Self { felt: [felt, self.felt[0]], dt, samples: (self.samples + 1.0).min(3.0) };
    }
}

/// A play operator.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Play {
    /// Where it stands.
    pub(crate) output: f64,
    /// 1 after the first input.
    pub(crate) started: f64,
}

/// One step of the play operator of width `w`: the output stays until the input has left the clearance ±w/2 about it.
pub(crate) fn play(w: f64, input: f64, play: &mut Play) -> f64 {
    if play.started == 0.0 || play.output.is_nan() {
        *play = Play { output: input, started: 1.0 };
    }
    play.output = within(play.output, input - 0.5 * w, input + 0.5 * w);
    play.output
}

/// A value limited to a range. An end that is not a number does not limit it: unlike [`f64::clamp`] this never panics.
pub(crate) fn within(value: f64, low: f64, high: f64) -> f64 {
    if value < low {
        low
    } else if value > high {
        high
    } else {
        value
    }
}

/// Derivative of samples at uneven times: that of the polynomial through the five samples about each, or of the straight line through the two
/// beside it where five do not stand around at about the same distances.
///
/// ```text
/// y'(t_k) = Σ_j w_j (y_j − y_k),   w_j = 1/(t_j − t_k) Π_l (t_k − t_l)/(t_j − t_l),   l ≠ j, k     (Lagrange)
/// ```
pub(crate) fn derivative(t: &[f64], y: &[f64]) -> Vec<f64> {
    let n = y.len();
    (0..n)
        .map(|k| {
            if n < 2 {
                return 0.0;
            }
            if let Some(around) = stencil(t, k) {
                return around.map(|(j, w, _)| w * (y[j] - y[k])).iter().sum();
            }
            let (a, b) = beside(t, k);
            if a == k || b == k {
                return (y[b] - y[a]) / (t[b] - t[a]);
            }
            let (behind, ahead) = (t[k] - t[a], t[b] - t[k]);
            ((y[b] - y[k]) * behind / ahead + (y[k] - y[a]) * ahead / behind) / (ahead + behind)
        })
        .collect()
}

/// The samples on either side of `k` that are not much nearer than others are: the noise of two that are close together says nothing of
/// a slope.
fn beside(t: &[f64], k: usize) -> (usize, usize) {
    let (first, last) = (k.saturating_sub(2), (k + 2).min(t.len() - 1));
    let near = NEAR * (t[last] - t[first]) / (last - first) as f64;
    let before = (0..k).rev().find(|&a| t[k] - t[a] >= near).unwrap_or(0);
    let after = (k + 1..t.len()).find(|&b| t[b] - t[k] >= near).unwrap_or(t.len() - 1);
    (before, after)
}

/// Share of the mean step below which samples are close together.
const NEAR: f64 = 0.3;

/// Second derivative of samples at uneven times, in the same way.
///
/// ```text
/// y''(t_k) = Σ_j 2 w_j (y_j − y_k) Σ_l 1/(t_k − t_l),   l ≠ j, k
/// ```
pub(crate) fn second_derivative(t: &[f64], y: &[f64]) -> Vec<f64> {
    let n = y.len();
    (0..n)
        .map(|k| {
            if n < 3 {
                return 0.0;
            }
            let k = k.clamp(1, n - 2);
            if let Some(around) = stencil(t, k) {
                return around.map(|(j, w, bends)| 2.0 * w * bends * (y[j] - y[k])).iter().sum();
            }
            let (ahead, behind) = (t[k + 1] - t[k], t[k] - t[k - 1]);
            2.0 * ((y[k + 1] - y[k]) / ahead - (y[k] - y[k - 1]) / behind) / (ahead + behind)
        })
        .collect()
}

/// The four samples about `k`, each with w_j and Σ_l 1/(t_k − t_l); `None` where there are not four, or their distances are not alike.
fn stencil(t: &[f64], k: usize) -> Option<[(usize, f64, f64); 4]> {
    if k < 2 || k + 2 >= t.len() {
        return None;
    }
    let mean = 0.25 * (t[k + 2] - t[k - 2]);
    let is_alike = |pair: &[f64]| (0.5 * mean..2.0 * mean).contains(&(pair[1] - pair[0]));
    if !t[k - 2..=k + 2].windows(2).all(is_alike) {
        return None;
    }
    let about = [k - 2, k - 1, k + 1, k + 2];
    let is_even = |j: usize, steps: f64| (t[j] - t[k] - steps * mean).abs() < EVEN * mean;
    if is_even(k - 2, -2.0) && is_even(k - 1, -1.0) && is_even(k + 1, 1.0) {
        let weights = [(1.0, -0.5), (-8.0, -1.0), (8.0, 1.0), (-1.0, 0.5)];
        return Some(std::array::from_fn(|i| (about[i], weights[i].0 / (12.0 * mean), weights[i].1 / mean)));
    }
    // With d_j = t_j − t_k: w_j = −Π_l d_l / (d_j Π_l (d_j − d_l)), and the sum is 1/d_j − Σ_l 1/d_l over all four.
    let [a, b, c, d] = about.map(|j| t[j] - t[k]);
    let inverse = [a, b, c, d].map(f64::recip);
    let all: f64 = inverse.iter().sum();
    let w = [
        -(b * c * d) / (a * (a - b) * (a - c) * (a - d)),
        -(a * c * d) / (b * (b - a) * (b - c) * (b - d)),
        -(a * b * d) / (c * (c - a) * (c - b) * (c - d)),
        -(a * b * c) / (d * (d - a) * (d - b) * (d - c)),
    ];
    Some(std::array::from_fn(|i| (about[i], w[i], inverse[i] - all)))
}

/// Share of a step by which samples may be off even times and their derivative is that of even ones.
const EVEN: f64 = 1e-5;

/// The rate without its fastest noise: a parabola through the samples within ±12 ms. A play operator or a threshold
/// would follow the noise, which the sensor's physics does not see.
pub(crate) fn steadied(t: &[f64], rate: &[f64]) -> Vec<f64> {
    let n = rate.len();
    if n < 2 {
        return rate.to_vec();
    }
    let half = (STEADY / ((t[n - 1] - t[0]) / (n - 1) as f64)) as usize;
    if half < 2 { rate.to_vec() } else { Parabola::new(half).through_all(t, rate) }
}

/// Half width of that window, s.
pub(crate) const STEADY: f64 = 0.012;

/// The rate without what is faster than four times 1/(2π·`half`), as far as its rows tell that from noise: twice a parabola
/// through the samples within ±`half` seconds, between the two whole numbers of samples that this lies between, and the same of
/// what that leaves (Tukey's twicing). What is as slow as 1/(2π·`half`) stays to 1e-4, and half as fast again to 2e-3.
pub(crate) fn slowed(t: &[f64], rate: &[f64], half: f64) -> Vec<f64> {
    let n = rate.len();
    if n < 2 {
        return rate.to_vec();
    }
    let rows = half * (n - 1) as f64 / (t[n - 1] - t[0]);
    let (few, more) = (rows as usize, rows.fract());
    if few < 1 || few > n / 4 {
        return rate.to_vec();
    }
    let smoothed = |rate: &[f64]| -> Vec<f64> {
        let [narrow, wide] = [few, few + 1].map(|half| {
            let parabola = Parabola::new(half);
            parabola.through_all(t, &parabola.through_all(t, rate))
        });
        narrow.iter().zip(wide).map(|(a, b)| a + more * (b - a)).collect()
    };
    let slow = smoothed(rate);
    let left: Vec<f64> = rate.iter().zip(&slow).map(|(rate, slow)| rate - slow).collect();
    slow.iter().zip(smoothed(&left)).map(|(slow, left)| slow + left).collect()
}

/// The rate without its noise as far as the motion allows: a parabola through as many samples as still leave no more than
/// noise between the two, and the standard deviation of what is left of the noise.
pub(crate) fn quieted(t: &[f64], rate: &[f64]) -> (Vec<f64>, f64) {
    let noise = white_noise(rate);
    match quieter(t, rate) {
        Some(parabola) => (parabola.through_all(t, rate), noise * parabola.gain().sqrt()),
        None => (rate.to_vec(), noise),
    }
}

/// That parabola; `None` where the motion allows none.
pub(crate) fn quieter(t: &[f64], rate: &[f64]) -> Option<Parabola> {
    if rate.len() < 2 {
        return None;
    }
    let noise = white_noise(rate);
    let longest = ((QUIET * (rate.len() - 1) as f64 / (t[rate.len() - 1] - t[0])) as usize).min(rate.len());
    let halves: Vec<usize> =
        std::iter::successors(Some(2_usize), |h| Some(h + h / 3 + 1)).take_while(|h| *h <= longest).collect();
    let fits = |parabola: &Parabola| {
        let every = (rate.len() / SAMPLED).max(1);
        let off: Vec<f64> = (parabola.half()..rate.len().saturating_sub(parabola.half()))
            .step_by(every)
            .map(|k| (rate[k] - parabola.through(t, rate, k)).powi(2))
            .collect();
        let mean = off.iter().sum::<f64>() / off.len().max(1) as f64;
        mean <= FITS * noise * noise * (1.0 - parabola.gain())
    };
    halves.into_iter().map(Parabola::new).take_while(fits).last()
}

/// The longest half width of that parabola, s.
const QUIET: f64 = 0.15;
/// Samples that it is tried on.
const SAMPLED: usize = 4000;
/// Times the noise's variance that it may miss the samples by.
const FITS: f64 = 1.1;

/// Standard deviation of what is white in a smooth signal's samples: the median of its sixth differences, over what those of
/// white noise have.
pub(crate) fn white_noise(signal: &[f64]) -> f64 {
    let sizes = sixth_differences(signal).into_iter().map(f64::abs).collect();
    // Half of a normal law lies within 0.6745 of its deviation.
    median(sizes).map_or(0.0, |median| median / (SIXTH.sqrt() * 0.6745))
}

/// What a smooth motion leaves little of; six fewer than there are values.
pub(crate) fn sixth_differences(values: &[f64]) -> Vec<f64> {
    let mut differences = values.to_vec();
    for _ in 0..6 {
        differences = differences.windows(2).map(|w| w[1] - w[0]).collect();
    }
    differences
}

/// Variance of the sixth differences of white noise over its own: the sum of the squared binomial coefficients.
pub(crate) const SIXTH: f64 = 924.0;

/// Least squares' parabola through 2m + 1 even samples, at the middle one (Savitzky and Golay 1964): a sample k from there weighs
/// `level` − `bend` k².
#[derive(Clone, Debug)]
pub(crate) struct Parabola {
    half: usize,
    level: f64,
    bend: f64,
}

impl Parabola {
    fn new(half: usize) -> Self {
        let m = half as f64;
        let norm = (2.0 * m + 3.0) * (2.0 * m + 1.0) * (2.0 * m - 1.0) / 3.0;
        Self { half, level: (3.0 * m * m + 3.0 * m - 1.0) / norm, bend: 5.0 / norm }
    }

    fn half(&self) -> usize {
        self.half
    }

    /// Share of white noise's variance that it leaves, which is its middle weight.
    fn gain(&self) -> f64 {
        self.level
    }

    /// At sample `k`, which has to stand that far from the ends.
    fn through(&self, t: &[f64], y: &[f64], k: usize) -> f64 {
        let steps = t[k - self.half..=k + self.half].windows(2).map(|pair| pair[1] - pair[0]);
        let (least, most) =
            steps.fold((f64::INFINITY, 0.0_f64), |(least, most), step| (least.min(step), most.max(step)));
        if most - least > SCATTER * most { self.at_times(t, y, k) } else { self.value(&self.moments(y, k)) }
    }

    /// The same where the samples' times are not even: the parabola through them at their times.
    ///
    /// ```text
    /// a + b x + c x²  with  Σ xⁱ (y − a − b x − c x²) = 0,  i = 0, 1, 2,   x = t − t_k: its value there is a
    /// ```
    fn at_times(&self, t: &[f64], y: &[f64], k: usize) -> f64 {
        let window = k - self.half..=k + self.half;
        let scale = (t[*window.end()] - t[*window.start()]).max(f64::MIN_POSITIVE).recip();
        let (mut powers, mut along) = ([0.0; 5], [0.0; 3]);
        for j in window {
            let (x, mut power) = (scale * (t[j] - t[k]), 1.0);
            for i in 0..5 {
                powers[i] += power;
                if i < 3 {
                    // About the middle one, so that nothing is lost to rounding.
                    along[i] += power * (y[j] - y[k]);
                }
                power *= x;
            }
        }
        let [s0, s1, s2, s3, s4] = powers;
        let minors = [s2 * s4 - s3 * s3, s1 * s4 - s2 * s3, s1 * s3 - s2 * s2];
        let determinant = s0 * minors[0] - s1 * minors[1] + s2 * minors[2];
        let level = (along[0] * minors[0] - along[1] * minors[1] + along[2] * minors[2]) / determinant;
        if level.is_finite() { y[k] + level } else { y[k] }
    }

    fn value(&self, moments: &[f64; 3]) -> f64 {
        self.level * moments[0] - self.bend * moments[2]
    }

    /// Σ y, Σ j y and Σ j² y over the samples j from `k`.
    fn moments(&self, y: &[f64], k: usize) -> [f64; 3] {
        let m = self.half as f64;
        y[k - self.half..=k + self.half].iter().enumerate().fold([0.0; 3], |[zeroth, first, second], (i, y)| {
            let j = i as f64 - m;
            [zeroth + y, first + j * y, second + j * j * y]
        })
    }

    /// At every sample; those near the ends stay as they are. The moments are carried from each to the next, and made anew before
    /// rounding adds up.
    pub(crate) fn through_all(&self, t: &[f64], y: &[f64]) -> Vec<f64> {
        let (half, m, mut out) = (self.half, self.half as f64, y.to_vec());
        let mut moments = [0.0; 3];
        // The last step that differs from the one before: within a window without one the times are even.
        let differs = |k: usize| {
            let (step, before) = (t[k] - t[k - 1], t[k - 1] - t[k - 2]);
            (step - before).abs() > SCATTER * step.max(before)
        };
        let mut uneven = (2..half.saturating_mul(2).min(t.len())).rfind(|&k| differs(k));
        for k in half..y.len().saturating_sub(half) {
            if k + half > 1 && differs(k + half) {
                uneven = Some(k + half);
            }
            if (k - half).is_multiple_of(CARRIED) {
                moments = self.moments(y, k);
            } else {
                let (gone, new) = (y[k - half - 1], y[k + half]);
                let [zeroth, first, second] = [moments[0] - gone, moments[1] + m * gone, moments[2] - m * m * gone];
                moments = [zeroth + new, first - zeroth + m * new, second - 2.0 * first + zeroth + m * m * new];
            }
            let is_even = uneven.is_none_or(|at| at < k - half + 2);
            out[k] = if is_even { self.value(&moments) } else { self.at_times(t, y, k) };
        }
        out
    }
}

/// Share of a step by which the next may differ and a parabola through even samples is the same.
const SCATTER: f64 = 0.1;

/// Samples over which moments are carried.
const CARRIED: usize = 64;

/// One step of the first-order low-pass T y' + y = u, exact for an input that goes linearly from `u0` to `u1`.
pub(crate) fn low_pass(y: f64, u0: f64, u1: f64, dt: f64, time_constant: f64) -> f64 {
    if dt <= 0.0 {
        return y;
    }
    if time_constant <= 0.0 {
        return u1;
    }
    let a = dt / time_constant;
    let rise = -(-a).exp_m1();
    y + (u0 - y) * rise + (u1 - u0) * (1.0 - rise / a)
}

/// Samples at uneven times through the first-order low-pass T y' + y = u, from rest at the first of them: exact where u is a
/// cubic between samples, its slopes by [`derivative`].
///
/// With p = u − T u' + T² u'' − T³ u''' of that cubic, y − p falls as e^{−t/T}.
pub(crate) fn low_passed(t: &[f64], u: &[f64], time_constant: f64) -> Vec<f64> {
    if time_constant <= 0.0 {
        return u.to_vec();
    }
    let slope = derivative(t, u);
    let mut y = u.to_vec();
    for k in 1..u.len() {
        let dt = t[k] - t[k - 1];
        let third = 6.0 * (slope[k - 1] + slope[k] - 2.0 * (u[k] - u[k - 1]) / dt) / (dt * dt);
        let second = (slope[k] - slope[k - 1]) / dt;
        let particular = |k: usize, second: f64| {
            u[k] - time_constant * (slope[k] - time_constant * (second - time_constant * third))
        };
        let fall = (-dt / time_constant).exp();
        y[k] =
            particular(k, second + 0.5 * third * dt) + fall * (y[k - 1] - particular(k - 1, second - 0.5 * third * dt));
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_of_fourth_order_at_even_times_and_at_times_that_scatter() {
        let omega = std::f64::consts::TAU * 5.0;
        for scatter in [0.0, 1e-4, 1e-3] {
            let t: Vec<f64> =
                (0..200).map(|k| 0.01 * f64::from(k) + scatter * (f64::from(k * 7919 % 13) / 6.0 - 1.0)).collect();
            let y: Vec<f64> = t.iter().map(|t| (omega * t).sin()).collect();
            let (first, second) = (derivative(&t, &y), second_derivative(&t, &y));
            for k in 3..197 {
                let (sin, cos) = (omega * t[k]).sin_cos();
                assert!((first[k] / omega - cos).abs() < 2e-3, "{scatter}, {k}: {} for {cos}", first[k] / omega);
                assert!(
                    (second[k] / omega.powi(2) + sin).abs() < 5e-3,
                    "{scatter}, {k}: {}",
                    second[k] / omega.powi(2)
                );
            }
        }
    }

    #[test]
    fn moments_that_are_carried_are_those_that_are_made_anew() {
        let y: Vec<f64> = (0..3000).map(|k| (0.01 * f64::from(k)).sin() + 1e3 + f64::from(k * 7919 % 13)).collect();
        let t: Vec<f64> = (0..3000).map(|k| 0.01 * f64::from(k)).collect();
        for half in [1, 2, 7, 75] {
            let parabola = Parabola::new(half);
            for (k, carried) in parabola.through_all(&t, &y).into_iter().enumerate().take(3000 - half).skip(half) {
                assert!((carried - parabola.through(&t, &y, k)).abs() < 1e-8, "{half}, {k}");
            }
        }
        let curve: Vec<f64> = (0..100).map(|k| 2.0 - 0.3 * f64::from(k) + 0.01 * f64::from(k * k)).collect();
        assert!(Parabola::new(9).through_all(&t[..100], &curve).iter().zip(&curve).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn beside_a_reference_with_times_of_its_own_a_rate_stays_where_it_is() {
        // Rows of the gyro every 5 ms, and the reference's between them, at every distance from them.
        let mut t: Vec<f64> = (0..2000).map(|k| 0.005 * f64::from(k)).collect();
        t.extend((0..900).map(|k| 0.0104 * f64::from(k) + 0.0007));
        t.sort_by(f64::total_cmp);
        t.dedup_by(|a, b| *a - *b < 1e-6);
        let omega = std::f64::consts::TAU * 2.0;
        let y: Vec<f64> = t.iter().map(|t| (omega * t).sin()).collect();
        let steady = steadied(&t, &y);
        let slope = derivative(&t, &steady);
        for k in 10..t.len() - 10 {
            assert!((steady[k] - y[k]).abs() < 1e-3, "{k}: {} for {}", steady[k], y[k]);
            assert!((slope[k] / omega - (omega * t[k]).cos()).abs() < 0.03, "{k}: {}", slope[k] / omega);
        }
    }

    #[test]
    fn what_is_slow_stays() {
        let t: Vec<f64> = (0..4000).map(|k| 0.005 * f64::from(k)).collect();
        let half = 0.05;
        for (times, off) in [(1.0, 2e-4), (1.5, 4e-3)] {
            let rate: Vec<f64> = t.iter().map(|t| (times / half * t).sin()).collect();
            let slow = slowed(&t, &rate, half);
            let worst = (100..3900).map(|k| (slow[k] - rate[k]).abs()).fold(0.0, f64::max);
            assert!(worst < off, "{times}: {worst}");
        }
    }

    #[test]
    fn a_low_pass_of_samples_is_that_of_the_signal() {
        let (time_constant, omega) = (0.03, 20.0_f64);
        let t: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let u: Vec<f64> = t.iter().map(|t| (omega * t).sin()).collect();
        let y = low_passed(&t, &u, time_constant);
        let (gain, phase) = ((1.0 + (omega * time_constant).powi(2)).sqrt().recip(), (omega * time_constant).atan());
        for k in 60..190 {
            let exact = gain * (omega * t[k] - phase).sin();
            assert!((y[k] - exact).abs() < 1e-4, "{k}: {} for {exact}", y[k]);
        }
    }
}
