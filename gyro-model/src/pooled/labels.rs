//! Whether an effect goes by what was said of the logs: a driver's version, a lot, a mount.
//!
//! ```text
//! y_l = β_label(l) + u_p + v_l + e_l        V = diag(s² + τ_l²) + τ_p² within a part        Q = βᵀAβ − (1ᵀAβ)²/1ᵀA1,  A = XᵀV⁻¹X
//! ```
//!
//! X has one column a value of the label. The spreads maximise the restricted likelihood *with* X, so that the difference asked about is
//! in none of them. Q/(k − 1) has the F distribution with k − 1 and as many degrees of freedom as there are parts less k, or, where one part
//! was read under several values, as there are logs less parts less k less one.

use super::spread::Reading;
use crate::nls;
use faer::{Col, Mat, Side, prelude::Solve};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::collections::{BTreeMap, BTreeSet};

/// An effect, value by value of a label.
#[derive(Clone, Debug, PartialEq)]
pub struct ByLabel {
    /// Each value's mean and its standard error, in the order of the values.
    pub means: Vec<(f64, f64)>,
    /// τ_p² and τ_l² beside them.
    pub spreads: (f64, f64),
    /// Q.
    pub statistic: f64,
    /// Chance of such differences where there are none.
    pub p_value: f64,
}

struct At {
    cost: f64,
    matrix: Mat<f64>,
    means: Vec<f64>,
}

fn at(readings: &[Reading], labels: &[usize], k: usize, between: f64, within: f64) -> At {
    let mut parts: BTreeMap<usize, (f64, f64, Vec<f64>)> = BTreeMap::new();
    let mut matrix = Mat::<f64>::zeros(k, k);
    let mut right = vec![0.0; k];
    let (mut cost, mut squares) = (0.0, 0.0);
    for (r, &label) in readings.iter().zip(labels) {
        let w = 1.0 / (r.variance + within);
        let own = parts.entry(r.part).or_insert_with(|| (0.0, 0.0, vec![0.0; k]));
        own.0 += w;
        own.1 += w * r.value;
        own.2[label] += w;
        matrix[(label, label)] += w;
        right[label] += w * r.value;
        squares += w * r.value * r.value;
        cost -= w.ln();
    }
    for (sum, along, each) in parts.values() {
        let share = between / (1.0 + between * sum);
        cost += (1.0 + between * sum).ln();
        squares -= share * along * along;
        for i in 0..k {
            right[i] -= share * each[i] * along;
            for j in 0..k {
                matrix[(i, j)] -= share * each[i] * each[j];
            }
        }
    }
    let (means, log_determinant) = solved(&matrix, &right);
    let explained: f64 = means.iter().zip(&right).map(|(m, b)| m * b).sum();
    At { cost: cost + log_determinant + squares - explained, matrix, means }
}

/// A⁻¹b and ln|A| of a positive definite matrix; NaN where it is none.
fn solved(matrix: &Mat<f64>, right: &[f64]) -> (Vec<f64>, f64) {
    let n = right.len();
    let Ok(factor) = matrix.llt(Side::Lower) else { return (vec![f64::NAN; n], f64::NAN) };
    let means = factor.solve(Col::from_fn(n, |i| right[i]));
    ((0..n).map(|i| means[i]).collect(), (0..n).map(|i| 2.0 * factor.L()[(i, i)].ln()).sum())
}

/// Turns over the two spreads, and the span in which each is sought, as shares of the readings' own scatter.
const TURNS: usize = 12;
const LOWEST: f64 = 1e-6;

/// The value of `of` between 0 and `top` where it is least: a grid of decades halves, then a golden section.
fn least(of: impl Fn(f64) -> f64, top: f64) -> f64 {
    let grid: Vec<f64> = (0..=24).map(|k| top * LOWEST.powf(1.0 - f64::from(k) / 24.0)).collect();
    let costs: Vec<f64> = grid.iter().map(|v| of(*v)).collect();
    let best = (0..grid.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
    let (mut low, mut high) = (if best == 0 { 0.0 } else { grid[best - 1] }, grid[(best + 1).min(grid.len() - 1)]);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..80 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if of(a) <= of(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let found = 0.5 * (low + high);
    if of(0.0) <= of(found) { 0.0 } else { found }
}

/// The means of `readings` by their `labels`, numbers below `k`; `None` where a value has no log, or too little is there to tell.
#[must_use]
pub fn by_label(readings: &[Reading], labels: &[usize], k: usize) -> Option<ByLabel> {
    let used: BTreeSet<usize> = labels.iter().copied().collect();
    let sound = |r: &Reading| r.value.is_finite() && r.variance.is_finite() && r.variance > 0.0;
    if k < 2 || used.len() != k || labels.len() != readings.len() || !readings.iter().all(sound) {
        return None;
    }
    let mut values: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for (r, label) in readings.iter().zip(labels) {
        values.entry(r.part).or_default().insert(*label);
    }
    let (parts, logs) = (values.len(), readings.len());
    let crossed = values.values().any(|own| own.len() > 1);
    let freedom = if crossed { (logs + 1).checked_sub(parts + k)? } else { parts.checked_sub(k)? };
    if freedom < 2 {
        return None;
    }
    // Counted from the plain mean: what is left of large numbers is then not lost.
    let about = readings.iter().map(|r| r.value).sum::<f64>() / logs as f64;
    let own: Vec<Reading> = readings.iter().map(|r| Reading { value: r.value - about, ..*r }).collect();
    let top = own.iter().map(|r| r.value * r.value + r.variance).sum::<f64>() / logs as f64 * 10.0;
    let cost = |between: f64, within: f64| at(&own, labels, k, between, within).cost;
    let (mut between, mut within) = (0.0, 0.0);
    for _ in 0..TURNS {
        let before = (between, within);
        // Of one part a spread between parts is not known, and the difference does not go by it.
        if parts > 1 {
            between = least(|v| cost(v, within), top);
        }
        if logs > parts {
            within = least(|v| cost(between, v), top);
        }
        if (between - before.0).abs() + (within - before.1).abs() < 1e-9 * top {
            break;
        }
    }
    let At { matrix, means, .. } = at(&own, labels, k, between, within);
    let row = |i: usize| (0..k).map(|j| matrix[(i, j)]).sum::<f64>();
    let all: f64 = (0..k).map(row).sum();
    let mean = (0..k).map(|i| row(i) * means[i]).sum::<f64>() / all;
    let off: Vec<f64> = means.iter().map(|m| m - mean).collect();
    let statistic: f64 = (0..k).map(|i| (0..k).map(|j| off[i] * matrix[(i, j)] * off[j]).sum::<f64>()).sum();
    let (covariance, unknown) = nls::invert_observable(&matrix, 1e-12);
    if !unknown.is_empty() || !statistic.is_finite() {
        return None;
    }
    let law = FisherSnedecor::new(k as f64 - 1.0, freedom as f64).ok()?;
    Some(ByLabel {
        means: (0..k).map(|i| (means[i] + about, covariance[(i, i)].sqrt())).collect(),
        spreads: (between, within),
        statistic,
        p_value: law.sf((statistic / (k as f64 - 1.0)).max(0.0)),
    })
}

#[cfg(test)]
mod tests;
