//! Mean and spreads of an effect over many logs: a mixed model with known errors.
//!
//! ```text
//! y_l = μ + u_p + v_l + e_l     u ~ N(0, τ_p²) of the part, v ~ N(0, τ_l²) of the log (its mounting), e ~ N(0, s_l²) known
//! ```
//!
//! The spreads maximise the restricted likelihood (REML; Patterson and Thompson 1971) from the start of DerSimonian and Laird (1986). The
//! covariance of a part's logs is a diagonal with a constant added, so that one evaluation takes a time that grows with the logs alone:
//! with w_l = 1/(s_l² + τ_l²) and S = Σ w_l over a part,
//!
//! ```text
//! V⁻¹ = W − W11ᵀW τ_p²/(1 + τ_p² S)        ln|V| = −Σ ln w + ln(1 + τ_p² S)
//! ```
//!
//! The error of the mean is that of Knapp and Hartung (2003), with the t distribution of as many degrees of freedom as there are parts
//! less one: from few parts a spread is known badly. It is not taken below what the logs' own errors come to, σ = 1/√Σw: what all logs have in
//! common (how a rate was summed up between rows) is in those errors and in no scatter. metafor calls that `test="adhoc"`. The interval of the next part is μ ± t √(σ² + τ_p²) (Higgins et al. 2009).

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// One log's estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The part that it is of: a number from 0 on.
    pub part: usize,
    /// The estimate.
    pub value: f64,
    /// Its variance.
    pub variance: f64,
}

impl Reading {
    /// Whether it can be weighed against others: neither its square nor that of its weight overflows.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.variance > 0.0
            && self.variance.is_finite()
            && self.variance.powi(-2).is_finite()
            && (self.value * self.value / self.variance).is_finite()
    }
}

/// What the readings of an effect come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Nested {
    /// Parts.
    pub parts: usize,
    /// Readings.
    pub logs: usize,
    /// μ.
    pub mean: f64,
    /// Its standard error, that of Knapp and Hartung where there are two parts or more, and at least the plain one.
    pub std_error: f64,
    /// Its standard error where the spreads are taken for known.
    pub plain_error: f64,
    /// Degrees of freedom of the first; infinite for one part.
    pub freedom: f64,
    /// τ_p² between parts.
    pub between: f64,
    /// τ_l² between the logs of a part.
    pub within: f64,
    /// −2 (restricted ln L without a spread between parts − with it), at least 0.
    pub spread_ratio: f64,
    /// The same of a spread between the logs of a part.
    pub ratio_of_logs: f64,
    /// What ln L gains over a type that has nothing of it.
    ///
    /// ```text
    /// ln N(y | μ, V) − ln N(y | 0, diag s²)
    /// ```
    pub gain: f64,
}

/// Sums of one part: Σw, Σwy, Σwy², Σw², Σw²y, Σw²y².
#[derive(Clone, Copy, Default)]
struct Sums {
    w: f64,
    y: f64,
    yy: f64,
    w2: f64,
    w2y: f64,
    w2yy: f64,
}

/// One evaluation.
#[derive(Clone, Copy)]
struct At {
    /// 1ᵀV⁻¹1 and the mean.
    weight: f64,
    mean: f64,
    /// (y − μ)ᵀ V⁻¹ (y − μ).
    squares: f64,
    /// Slope of the restricted ln L by τ_p² and τ_l².
    slope: [f64; 2],
    /// Σ over parts of w̄_p (ȳ_p − μ)², of which Knapp and Hartung's factor is made.
    scatter: f64,
}

fn sums(readings: &[Reading], parts: usize, within: f64, about: f64) -> Vec<Sums> {
    let mut all = vec![Sums::default(); parts];
    for r in readings {
        let (s, w, y) = (&mut all[r.part], 1.0 / (r.variance + within), r.value - about);
        s.w += w;
        s.y += w * y;
        s.yy += w * y * y;
        s.w2 += w * w;
        s.w2y += w * w * y;
        s.w2yy += w * w * y * y;
    }
    all
}

fn at(readings: &[Reading], parts: usize, between: f64, within: f64) -> At {
    // Values are counted from their plain mean: what is left of large numbers is then not lost.
    let about = readings.iter().map(|r| r.value).sum::<f64>() / readings.len() as f64;
    let all = sums(readings, parts, within, about);
    let (mut weight, mut along) = (0.0, 0.0);
    for s in all.iter().filter(|s| s.w > 0.0) {
        let share = 1.0 / (1.0 + between * s.w);
        weight += s.w * share;
        along += s.y * share;
    }
    let mean = along / weight;
    let (mut squares, mut trace_within, mut second, mut pull_within) = (0.0, 0.0, 0.0, 0.0);
    let (mut trace_between, mut fourth, mut pull_between, mut scatter) = (0.0, 0.0, 0.0, 0.0);
    for s in all.iter().filter(|s| s.w > 0.0) {
        let share = 1.0 / (1.0 + between * s.w);
        // Of y − μ.
        let (y, yy) = (s.y - mean * s.w, s.yy - 2.0 * mean * s.y + mean * mean * s.w);
        let (w2y, w2yy) = (s.w2y - mean * s.w2, s.w2yy - 2.0 * mean * s.w2y + mean * mean * s.w2);
        let pull = between * share * y;
        squares += yy - pull * y;
        trace_within += s.w - between * share * s.w2;
        second += s.w2 * share * share;
        // ‖V⁻¹(y − μ)‖², V⁻¹(y − μ) = w (y − μ − pull).
        pull_within += w2yy - 2.0 * pull * w2y + pull * pull * s.w2;
        let own = s.w * share;
        trace_between += own;
        fourth += own * own;
        pull_between += (y * share).powi(2);
        scatter += own * (y / s.w).powi(2);
    }
    At {
        weight,
        mean: mean + about,
        squares,
        slope: [
            -0.5 * (trace_between - fourth / weight - pull_between),
            -0.5 * (trace_within - second / weight - pull_within),
        ],
        scatter,
    }
}

/// ln|V|.
fn log_determinant(readings: &[Reading], parts: usize, between: f64, within: f64) -> f64 {
    let mut weights = vec![0.0; parts];
    let mut logs = 0.0;
    for r in readings {
        weights[r.part] += 1.0 / (r.variance + within);
        logs += (r.variance + within).ln();
    }
    logs + weights.into_iter().map(|weight| (between * weight).ln_1p()).sum::<f64>()
}

/// −2 restricted ln L, constants left out.
fn cost(readings: &[Reading], parts: usize, between: f64, within: f64) -> f64 {
    let At { weight, squares, .. } = at(readings, parts, between, within);
    log_determinant(readings, parts, between, within) + weight.ln() + squares
}

/// DerSimonian and Laird's spread of readings that are each a part of their own.
#[must_use]
pub fn moments(readings: &[Reading]) -> f64 {
    let w: Vec<f64> = readings.iter().map(|r| 1.0 / r.variance).collect();
    let (sum, squares) = (w.iter().sum::<f64>(), w.iter().map(|w| w * w).sum::<f64>());
    let mean = w.iter().zip(readings).map(|(w, r)| w * r.value).sum::<f64>() / sum;
    let q: f64 = w.iter().zip(readings).map(|(w, r)| w * (r.value - mean).powi(2)).sum();
    ((q - (readings.len() as f64 - 1.0)) / (sum - squares / sum)).max(0.0)
}

/// Turns over the two spreads at most, and the change with which they are found.
const TURNS: usize = 500;
const FOUND: f64 = 1e-12;

/// The value above 0 at which a slope goes from positive to negative, searched from `start`; 0 where it is negative at once.
fn crossing(slope: impl Fn(f64) -> f64, start: f64, scale: f64) -> f64 {
    if slope(0.0) <= 0.0 {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, if start > 0.0 { start } else { scale });
    let (mut at_low, mut at_high) = (slope(low), slope(high));
    for _ in 0..200 {
        if at_high <= 0.0 {
            break;
        }
        (low, at_low) = (high, at_high);
        high *= 2.0;
        at_high = slope(high);
    }
    // False position, the end that stays counting half (Dowell and Jarratt 1971); a half where it would leave the interval.
    let mut stays = 0;
    for _ in 0..200 {
        if high - low <= 1e-14 * high || at_high == 0.0 {
            break;
        }
        let share = at_low / (at_low - at_high);
        let middle = low + (high - low) * if (0.0..1.0).contains(&share) { share.max(1e-3) } else { 0.5 };
        let at_middle = slope(middle);
        if (middle - low).min(high - middle) <= 1e-15 * high {
            return middle;
        }
        if at_middle > 0.0 {
            (low, at_low) = (middle, at_middle);
            at_high *= if stays == 1 { 0.5 } else { 1.0 };
            stays = 1;
        } else {
            (high, at_high) = (middle, at_middle);
            at_low *= if stays == -1 { 0.5 } else { 1.0 };
            stays = -1;
        }
    }
    if at_high == 0.0 { high } else { 0.5 * (low + high) }
}

impl Nested {
    /// The mixed model of these readings; `None` where there is none. A spread between logs is asked for where a part has several, one
    /// between parts where there are several.
    #[must_use]
    pub fn fit(readings: &[Reading]) -> Option<Self> {
        let known: Vec<Reading> = readings.iter().filter(|r| r.is_sound()).copied().collect();
        let mut names: Vec<usize> = known.iter().map(|r| r.part).collect();
        names.sort_unstable();
        names.dedup();
        let (parts, logs) = (names.len(), known.len());
        let number = |part: usize| names.partition_point(|name| *name < part);
        let known: Vec<Reading> = known.into_iter().map(|r| Reading { part: number(r.part), ..r }).collect();
        if logs == 0 {
            return None;
        }
        let scale = known.iter().map(|r| r.variance).sum::<f64>() / logs as f64;
        let (has_between, has_within) = (parts > 1, logs > parts);
        let seek = |free_between: bool, free_within: bool| {
            let (mut between, mut within) = (0.0, 0.0);
            if free_between {
                between = moments(&known);
            }
            for _ in 0..TURNS {
                let before = (between, within);
                if free_within {
                    within = crossing(|v| at(&known, parts, between, v).slope[1], within, scale);
                }
                if free_between {
                    between = crossing(|v| at(&known, parts, v, within).slope[0], between, scale);
                }
                let moved = (between - before.0).abs().max((within - before.1).abs());
                if moved <= FOUND * (between + within + scale) || !moved.is_finite() {
                    break;
                }
            }
            (between, within)
        };
        let cost = |(between, within): (f64, f64)| cost(&known, parts, between, within);
        let (between, within) = seek(has_between, has_within);
        let found = at(&known, parts, between, within);
        let ratio = |of: bool, without: &dyn Fn() -> (f64, f64)| {
            if of { (cost(without()) - cost((between, within))).max(0.0) } else { 0.0 }
        };
        let spread_ratio = ratio(between > 0.0, &|| seek(false, has_within));
        let ratio_of_logs = ratio(within > 0.0, &|| seek(has_between, false));
        let plain_error = (1.0 / found.weight).sqrt();
        let freedom = parts as f64 - 1.0;
        let (std_error, freedom) = if parts > 1 {
            ((found.scatter / freedom / found.weight).sqrt().max(plain_error), freedom)
        } else {
            (plain_error, f64::INFINITY)
        };
        Some(Self {
            parts,
            logs,
            mean: found.mean,
            std_error,
            plain_error,
            freedom,
            between,
            within,
            spread_ratio,
            ratio_of_logs,
            gain: 0.5
                * (known.iter().map(|r| r.value * r.value / r.variance + r.variance.ln()).sum::<f64>()
                    - log_determinant(&known, parts, between, within)
                    - found.squares),
        })
    }

    /// Standard deviation between parts; `None` from one part.
    #[must_use]
    pub fn spread(&self) -> Option<f64> {
        (self.parts > 1).then(|| self.between.sqrt())
    }

    /// Standard deviation between the logs of a part; `None` where no part has two.
    #[must_use]
    pub fn spread_of_logs(&self) -> Option<f64> {
        (self.logs > self.parts).then(|| self.within.sqrt())
    }

    /// The quantile of the mean's distribution: 0.975 for an interval of 95 %.
    fn quantile(&self, p: f64) -> f64 {
        if self.freedom.is_finite() {
            StudentsT::new(0.0, 1.0, self.freedom).map_or(f64::INFINITY, |law| law.inverse_cdf(p))
        } else {
            Normal::standard().inverse_cdf(p)
        }
    }

    /// Chance of such a mean where the type has none: two-sided.
    #[must_use]
    pub fn p_of_mean(&self) -> f64 {
        two_sided(self.mean / self.std_error, self.freedom)
    }

    /// Chance of such a spread between parts where there is none: at the boundary, half of χ² with one degree of freedom (Self and Liang
    /// 1987).
    #[must_use]
    pub fn p_of_spread(&self) -> f64 {
        at_boundary(self.between, self.spread_ratio)
    }

    /// The same of a spread between the logs of a part.
    #[must_use]
    pub fn p_of_spread_of_logs(&self) -> f64 {
        at_boundary(self.within, self.ratio_of_logs)
    }

    /// The interval in which the next part lies with a probability of 95 %; `None` from one part.
    #[must_use]
    pub fn next(&self) -> Option<(f64, f64)> {
        let half = self.quantile(0.975) * self.std_error.hypot(self.between.sqrt());
        (self.parts > 1 && half.is_finite()).then_some((self.mean - half, self.mean + half))
    }

    /// What a part is best taken for (best linear unbiased prediction), with its standard error, from its own logs: between what they say
    /// and the mean of the type.
    #[must_use]
    pub fn predicted(&self, own: &[Reading]) -> (f64, f64) {
        let (value, variance) = self.of_part(own);
        let share = self.between / (self.between + variance);
        let error = (self.between * (1.0 - share) + ((1.0 - share) * self.plain_error).powi(2)).sqrt();
        if self.between > 0.0 {
            (self.mean + share * (value - self.mean), error)
        } else {
            (self.mean, self.plain_error)
        }
    }

    /// What a part's own logs say of it alone: value and variance.
    #[must_use]
    pub fn of_part(&self, own: &[Reading]) -> (f64, f64) {
        let (weight, along) = own.iter().fold((0.0, 0.0), |(weight, along), r| {
            let w = 1.0 / (r.variance + self.within);
            (weight + w, along + w * r.value)
        });
        (along / weight, 1.0 / weight)
    }

    /// The same without one part's logs, the spreads being what they are.
    #[must_use]
    pub fn beside(&self, own: &[Reading]) -> Self {
        let (value, variance) = self.of_part(own);
        let (all, mine) = (self.plain_error.powi(-2), 1.0 / (variance + self.between));
        let rest = all - mine;
        Self {
            parts: self.parts - 1,
            logs: self.logs.saturating_sub(own.len()),
            mean: (all * self.mean - mine * value) / rest,
            plain_error: rest.powf(-0.5),
            freedom: self.freedom - 1.0,
            ..*self
        }
    }

    /// What ln L of one part's logs gains over a type that has nothing of it.
    #[must_use]
    pub fn gain_of_part(&self, own: &[Reading]) -> f64 {
        let none: f64 = own.iter().map(|r| r.value * r.value / r.variance + r.variance.ln()).sum();
        let (mut w, mut y, mut yy, mut logs) = (0.0, 0.0, 0.0, 0.0);
        for r in own {
            let (weight, off) = (1.0 / (r.variance + self.within), r.value - self.mean);
            (w, y, yy, logs) = (w + weight, y + weight * off, yy + weight * off * off, logs + weight.ln());
        }
        let share = 1.0 / (1.0 + self.between * w);
        0.5 * (none - (yy - self.between * share * y * y - logs - share.ln()))
    }

    /// Chance that a further part of this type reads as these logs do, or further off: two-sided.
    #[must_use]
    pub fn p_of_part(&self, own: &[Reading]) -> f64 {
        // A spread that few parts tell is known badly.
        two_sided(self.z_of_part(own), if self.between > 0.0 { self.freedom } else { f64::INFINITY })
    }

    /// How many standard errors of a further part the mean of these logs lies off.
    #[must_use]
    pub fn z_of_part(&self, own: &[Reading]) -> f64 {
        let (value, variance) = self.of_part(own);
        (value - self.mean) / (variance + self.between + self.plain_error.powi(2)).sqrt()
    }
}

/// Chance of a value so many standard errors from nothing or further off: Student's t, or the normal distribution for infinitely many
/// degrees of freedom. 1 of what is no number.
fn two_sided(size: f64, freedom: f64) -> f64 {
    if size.is_nan() {
        return 1.0;
    }
    if size.is_infinite() {
        return 0.0;
    }
    let tail = if freedom.is_finite() {
        StudentsT::new(0.0, 1.0, freedom).map_or(0.5, |law| law.sf(size.abs()))
    } else {
        Normal::standard().sf(size.abs())
    };
    2.0 * tail
}

fn at_boundary(spread: f64, ratio: f64) -> f64 {
    if spread <= 0.0 {
        return 1.0;
    }
    if ratio.is_finite() { ChiSquared::new(1.0).map_or(1.0, |law| 0.5 * law.sf(ratio)) } else { 1.0 }
}

/// Which of these hypotheses are refused so that a share of at most `rate` of those is refused wrongly (Benjamini and Hochberg 1995).
#[must_use]
pub fn discoveries(p: &[f64], rate: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let bound = |rank: usize| rate * (rank + 1) as f64 / p.len() as f64;
    let last = (0..order.len()).rev().find(|&rank| p[order[rank]] <= bound(rank));
    let mut found = vec![false; p.len()];
    if let Some(last) = last {
        order[..=last].iter().for_each(|&k| found[k] = true);
    }
    found
}

/// A value that changed at one time and stayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// It lies between reading `after − 1` and reading `after`, most likely.
    pub after: usize,
    /// The first and the last place at which it may as well lie (95 %).
    pub from: usize,
    /// See `from`.
    pub to: usize,
    /// By how much.
    pub by: f64,
    /// Standard error of that.
    pub std_error: f64,
    /// Chance of such a change at any place where there is none.
    pub p_value: f64,
}

/// Fall of ln L within which a place is as good as the best: half of the 95 % quantile of χ² with one degree of freedom.
const AS_GOOD: f64 = 1.92;

/// Readings on either side of a change: a single one is no level, and may itself be the odd one.
const EITHER: usize = 2;

/// The likeliest single change of readings in time: a cumulated sum (Page 1954) with both levels fitted.
///
/// ```text
/// z_k = (ȳ after k − ȳ before k) / √(1/Σw after + 1/Σw before)          the largest |z_k| of n − 3 places
/// ```
///
/// The variances of the readings are known to so many degrees of freedom: z has that t distribution.
#[must_use]
pub fn change(readings: &[(f64, f64)], freedom: f64) -> Option<Change> {
    let n = readings.len();
    if n < 2 * EITHER {
        return None;
    }
    let w: Vec<f64> = readings.iter().map(|(_, variance)| 1.0 / variance).collect();
    let total = (w.iter().sum::<f64>(), w.iter().zip(readings).map(|(w, r)| w * r.0).sum::<f64>());
    let (mut before, mut each) = ((0.0, 0.0), Vec::new());
    for k in 1..n {
        before = (before.0 + w[k - 1], before.1 + w[k - 1] * readings[k - 1].0);
        let after = (total.0 - before.0, total.1 - before.1);
        let by = after.1 / after.0 - before.1 / before.0;
        each.push((by, (1.0 / after.0 + 1.0 / before.0).sqrt()));
    }
    let gain = |k: usize| 0.5 * (each[k].0 / each[k].1).powi(2);
    let best = (EITHER - 1..n - EITHER).max_by(|&a, &b| gain(a).total_cmp(&gain(b)))?;
    let good: Vec<usize> = (0..each.len()).filter(|&k| gain(k) > gain(best) - AS_GOOD).collect();
    let (by, std_error) = each[best];
    Some(Change {
        after: best + 1,
        from: good.iter().find(|&&k| k <= best)? + 1,
        to: good.last()? + 1,
        by,
        std_error,
        p_value: (two_sided(by / std_error, freedom) * places(n) as f64).min(1.0),
    })
}

/// Places at which n readings can have changed.
fn places(n: usize) -> usize {
    n + 1 - 2 * EITHER
}

/// How far the logs of a part scatter beyond their own errors, over the parts of a type, each in the order of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Its variance.
    pub variance: f64,
    /// The degrees of freedom to which that is known; infinite where the logs' own errors explain all.
    pub freedom: f64,
}

/// The scatter between logs, pooled over parts: of what each part's logs leave about two levels, so that a part that changed does not
/// count as scatter. It makes χ² equal to its degrees of freedom (Paule and Mandel 1982).
///
/// ```text
/// Σ_p Σ_l (y_l − level)²/(s_l² + τ_l²) = Σ_p (n_p − 2, less one where the place of the change was chosen)
/// ```
#[must_use]
pub fn scatter(parts: &[Vec<(f64, f64)>]) -> Scatter {
    let told: Vec<&Vec<(f64, f64)>> = parts.iter().filter(|own| own.len() >= 2 * EITHER).collect();
    let freedom: usize = told.iter().map(|own| own.len() - 2 - usize::from(places(own.len()) > 1)).sum();
    if freedom == 0 {
        return Scatter { variance: 0.0, freedom: f64::INFINITY };
    }
    let squares = |variance: f64| -> f64 { told.iter().map(|own| about_two_levels(own, variance)).sum::<f64>() };
    let over = |variance: f64| squares(variance) - freedom as f64;
    let scale = told.iter().flat_map(|own| own.iter().map(|(_, variance)| *variance)).fold(0.0, f64::max);
    let variance = crossing(over, 0.0, scale);
    Scatter { variance, freedom: if variance > 0.0 { freedom as f64 } else { f64::INFINITY } }
}

/// What readings leave about the two levels that fit them best: the sum of squares over their variances.
fn about_two_levels(readings: &[(f64, f64)], scatter: f64) -> f64 {
    let sum = |own: &[(f64, f64)]| -> f64 {
        let w = |variance: f64| 1.0 / (variance + scatter);
        let weight: f64 = own.iter().map(|r| w(r.1)).sum();
        let level = own.iter().map(|r| w(r.1) * r.0).sum::<f64>() / weight;
        own.iter().map(|r| w(r.1) * (r.0 - level).powi(2)).sum()
    };
    let of = |place: usize| sum(&readings[..place]) + sum(&readings[place..]);
    (EITHER..=readings.len() - EITHER).map(of).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
pub(super) mod tests;
