//! Variance components: Var y = Σ c z with c ≥ 0, of windows whose squares y² are known.
//!
//! ```text
//! ln L = −½ Σ (ln v + y²/v),   v = Σ c z
//! ```
//!
//! Fisher scoring: each step is weighted least squares of y² on z with the weights 1/v², by non-negative least squares (Harvey 1976;
//! Searle, Casella and McCulloch 1992).

/// Windows with what each column makes of their variance.
pub(super) struct Squares {
    /// y², rad².
    pub square: Vec<f64>,
    /// The columns, window by window.
    pub columns: Vec<Vec<f64>>,
    /// The block of the log in which each window begins.
    pub block: Vec<usize>,
    /// The least variance that a window may have, rad².
    pub least: Vec<f64>,
}

/// What was estimated.
#[derive(Clone, Debug)]
pub(super) struct Components {
    /// The coefficients.
    pub values: Vec<f64>,
    /// Their covariance, if all windows were independent; nothing of those that are zero.
    pub covariance: Vec<Vec<f64>>,
    /// The variance of each window, rad².
    pub variances: Vec<f64>,
    /// ln L of each block.
    pub log_likelihood: Vec<f64>,
    /// The same under the coefficients of the other blocks.
    pub held_out: Vec<f64>,
}

/// Rounds of scoring.
const ROUNDS: usize = 10;
/// Sweeps of coordinate descent.
const SWEEPS: usize = 200;
/// Blocks over which the likelihood is held out.
pub(super) const BLOCKS: usize = 20;

impl Squares {
    /// The components of the columns that are `used`.
    pub(super) fn components(&self, used: &[bool]) -> Components {
        let own: Vec<usize> = (0..self.columns.len()).filter(|&j| used[j]).collect();
        let scale: Vec<f64> =
            own.iter().map(|&j| self.columns[j].iter().copied().fold(0.0, f64::max).max(1e-300)).collect();
        let mut v: Vec<f64> = self.square.iter().zip(&self.least).map(|(y, least)| y.max(100.0 * least)).collect();
        let mean = v.iter().sum::<f64>() / v.len().max(1) as f64;
        v.fill(mean);
        let mut c = vec![0.0; own.len()];
        let all: Vec<usize> = (0..self.square.len()).collect();
        for _ in 0..ROUNDS {
            let (a, b) = self.normal(&own, &scale, &v, &all);
            c = non_negative(&a, &b, c);
            v = self.variances(&own, &scale, &c);
        }
        let (a, b) = self.normal(&own, &scale, &v, &all);
        let mut blocks = vec![Vec::new(); BLOCKS];
        for (k, block) in self.block.iter().enumerate() {
            blocks[*block].push(k);
        }
        let log_likelihood = blocks.iter().map(|block| self.log_likelihood(&own, &scale, &c, block)).collect();
        let without = |block: &Vec<usize>| {
            let (out, side) = self.normal(&own, &scale, &v, block);
            let less = |(a, out): (&Vec<f64>, &Vec<f64>)| a.iter().zip(out).map(|(a, out)| a - out).collect();
            let rest: Vec<Vec<f64>> = a.iter().zip(&out).map(less).collect();
            let right: Vec<f64> = b.iter().zip(&side).map(|(b, side)| b - side).collect();
            self.log_likelihood(&own, &scale, &non_negative(&rest, &right, c.clone()), block)
        };
        let held_out = blocks.iter().map(without).collect();
        let mut values = vec![0.0; self.columns.len()];
        let mut covariance = vec![vec![0.0; self.columns.len()]; self.columns.len()];
        let active: Vec<usize> = (0..own.len()).filter(|&i| c[i] > 0.0).collect();
        // Var y² = 2 v² of a normal y.
        let information = faer::Mat::from_fn(active.len(), active.len(), |i, j| 0.5 * a[active[i]][active[j]]);
        let (inverse, _) = crate::nls::invert_observable(&information, 1e-12);
        for (i, &p) in active.iter().enumerate() {
            values[own[p]] = c[p] / scale[p];
            for (j, &q) in active.iter().enumerate() {
                covariance[own[p]][own[q]] = inverse[(i, j)] / (scale[p] * scale[q]);
            }
        }
        Components { values, covariance, variances: v, log_likelihood, held_out }
    }

    /// The variance of a window.
    fn variance(&self, own: &[usize], scale: &[f64], c: &[f64], k: usize) -> f64 {
        let sum: f64 = own.iter().zip(scale).zip(c).map(|((&j, s), c)| c * self.columns[j][k] / s).sum();
        sum.max(self.least[k])
    }

    fn variances(&self, own: &[usize], scale: &[f64], c: &[f64]) -> Vec<f64> {
        (0..self.square.len()).map(|k| self.variance(own, scale, c, k)).collect()
    }

    /// ln L of some windows.
    fn log_likelihood(&self, own: &[usize], scale: &[f64], c: &[f64], windows: &[usize]) -> f64 {
        let of = |&k: &usize| {
            let v = self.variance(own, scale, c, k);
            -0.5 * (v.ln() + self.square[k] / v)
        };
        windows.iter().map(of).sum()
    }

    /// The normal equations of the windows that count.
    fn normal(&self, own: &[usize], scale: &[f64], v: &[f64], windows: &[usize]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let n = own.len();
        let (mut a, mut b) = (vec![vec![0.0; n]; n], vec![0.0; n]);
        let mut row = vec![0.0; n];
        for &k in windows {
            for (i, (&j, s)) in own.iter().zip(scale).enumerate() {
                row[i] = self.columns[j][k] / (s * v[k]);
            }
            let y = self.square[k] / v[k];
            for i in 0..n {
                if row[i] != 0.0 {
                    b[i] += row[i] * y;
                    a[i].iter_mut().zip(&row).for_each(|(a, other)| *a += row[i] * other);
                }
            }
        }
        (a, b)
    }
}

/// argmin ½ cᵀAc − bᵀc over c ≥ 0, by coordinate descent.
fn non_negative(a: &[Vec<f64>], b: &[f64], mut c: Vec<f64>) -> Vec<f64> {
    for _ in 0..SWEEPS {
        let mut moved = 0.0_f64;
        for j in 0..c.len() {
            if a[j][j] <= 0.0 {
                c[j] = 0.0;
                continue;
            }
            let gradient = a[j].iter().zip(&c).map(|(a, c)| a * c).sum::<f64>() - b[j];
            let new = (c[j] - gradient / a[j][j]).max(0.0);
            moved = moved.max((new - c[j]).abs() / (new + c[j] + 1e-300));
            c[j] = new;
        }
        if moved < 1e-6 {
            break;
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn components_are_found_with_their_errors() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut off = Vec::new();
        for _ in 0..40 {
            let events: Vec<f64> = (0..2000).map(|k| f64::from(k * 7919 % 5)).collect();
            let mut draw = |z: &f64| -> f64 {
                let normal: f64 = StandardNormal.sample(&mut random);
                (0.5 + 0.2 * z).sqrt() * normal
            };
            let y: Vec<f64> = events.iter().map(&mut draw).collect();
            let squares = Squares {
                square: y.iter().map(|y| y * y).collect(),
                columns: vec![vec![1.0; 2000], events],
                block: (0..2000).map(|k| k * BLOCKS / 2000).collect(),
                least: vec![1e-6; 2000],
            };
            let found = squares.components(&[true, true]);
            off.push((found.values[1] - 0.2) / found.covariance[1][1].sqrt());
        }
        let mean = off.iter().sum::<f64>() / 40.0;
        let spread = (off.iter().map(|x| x * x).sum::<f64>() / 40.0).sqrt();
        assert!(mean.abs() < 0.6 && (0.7..1.4).contains(&spread), "{mean} {spread}");
    }

    #[test]
    fn what_is_not_there_is_nothing_and_never_negative() {
        let c = non_negative(&[vec![2.0, 1.0], vec![1.0, 2.0]], &[2.0, -1.0], vec![0.0, 0.0]);
        assert!((c[0] - 1.0).abs() < 1e-6 && c[1] == 0.0);
        assert_eq!(non_negative(&[vec![0.0]], &[1.0], vec![3.0]), [0.0]);
    }
}
