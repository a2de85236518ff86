//! Normal equations by name: A θ = b for the *whole* values θ, not for steps from where they were linearised, so that those of
//! different logs add up.

use super::{Key, Piece};
use crate::nls;
use faer::Mat;

/// A and b over named parameters.
#[derive(Clone, Debug)]
pub struct Equations {
    /// The parameters, in order.
    pub keys: Vec<Key>,
    /// A = XᵀV⁻¹X.
    pub matrix: Mat<f64>,
    /// b = XᵀV⁻¹y, y the reading of θ that the residual is.
    pub right: Vec<f64>,
}

/// One parameter as some equations tell it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Its value.
    pub value: f64,
    /// The variance of it.
    pub variance: f64,
}

/// Share of a column that has to be its own, beside the others: below it the log says nothing of it.
const OWN_SHARE: f64 = 1e-6;
/// Eigenvalues of the scaled matrix below which a direction is not known.
const RANK: f64 = 1e-10;

impl Equations {
    /// With nothing in them.
    #[must_use]
    pub fn empty() -> Self {
        Self { keys: Vec::new(), matrix: Mat::zeros(0, 0), right: Vec::new() }
    }

    /// Of one log: what its score is expected to be of noise alone is taken off.
    #[must_use]
    pub fn of(piece: &Piece) -> Self {
        let n = piece.columns.len();
        let matrix = Mat::from_fn(n, n, |i, j| piece.entry(i, j));
        let at: Vec<f64> = piece.columns.iter().map(|column| column.at).collect();
        let right = (0..n)
            .map(|i| piece.score[i] - piece.expected[i] + (0..n).map(|j| matrix[(i, j)] * at[j]).sum::<f64>())
            .collect();
        Self { keys: piece.columns.iter().map(|column| column.key.clone()).collect(), matrix, right }
    }

    fn place(&self, key: &Key) -> Option<usize> {
        self.keys.iter().position(|own| own == key)
    }

    /// These of the parameters, by place and name, the others being zero.
    #[must_use]
    pub fn with(&self, keep: impl Fn(usize, &Key) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.keys.len()).filter(|&k| keep(k, &self.keys[k])).collect();
        Self {
            keys: kept.iter().map(|&k| self.keys[k].clone()).collect(),
            matrix: Mat::from_fn(kept.len(), kept.len(), |i, j| self.matrix[(kept[i], kept[j])]),
            right: kept.iter().map(|&k| self.right[k]).collect(),
        }
    }

    /// Without some of the parameters, each of which these equations alone determine: the Schur complement.
    ///
    /// ```text
    /// A_SS − A_SN A_NN⁻¹ A_NS ,   b_S − A_SN A_NN⁻¹ b_N
    /// ```
    #[must_use]
    pub fn without(&self, gone: impl Fn(&Key) -> bool) -> Self {
        let (out, kept): (Vec<usize>, Vec<usize>) = (0..self.keys.len()).partition(|&k| gone(&self.keys[k]));
        let (inverse, _) = inverse(&Mat::from_fn(out.len(), out.len(), |i, j| self.matrix[(out[i], out[j])]));
        // A_NN⁻¹ A_NS and A_NN⁻¹ b_N.
        let solved = |right: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..out.len()).map(|i| (0..out.len()).map(|j| inverse[(i, j)] * right(j)).sum()).collect()
        };
        let along: Vec<Vec<f64>> = kept.iter().map(|&k| solved(&|j| self.matrix[(out[j], k)])).collect();
        let own = solved(&|j| self.right[out[j]]);
        let off =
            |k: usize, solved: &[f64]| -> f64 { (0..out.len()).map(|j| self.matrix[(k, out[j])] * solved[j]).sum() };
        Self {
            keys: kept.iter().map(|&k| self.keys[k].clone()).collect(),
            matrix: Mat::from_fn(kept.len(), kept.len(), |i, j| {
                let (a, b) = (i.max(j), i.min(j));
                self.matrix[(kept[a], kept[b])] - off(kept[a], &along[b])
            }),
            right: kept.iter().map(|&k| self.right[k] - off(k, &own)).collect(),
        }
    }

    /// The other parameters where some are known: θ_N = A_NN⁻¹ (b_N − A_NS θ_S), of those that `own` says.
    #[must_use]
    pub fn rest_beside(&self, known: &dyn Fn(&Key) -> Option<f64>, own: &dyn Fn(&Key) -> bool) -> Vec<(Key, f64)> {
        let (out, kept): (Vec<usize>, Vec<usize>) = (0..self.keys.len()).partition(|&k| own(&self.keys[k]));
        let right: Vec<f64> = out
            .iter()
            .map(|&i| {
                let taken = |&k: &usize| known(&self.keys[k]).map_or(0.0, |value| self.matrix[(i, k)] * value);
                self.right[i] - kept.iter().map(taken).sum::<f64>()
            })
            .collect();
        let part = Self {
            keys: out.iter().map(|&k| self.keys[k].clone()).collect(),
            matrix: Mat::from_fn(out.len(), out.len(), |i, j| self.matrix[(out[i], out[j])]),
            right,
        };
        let (values, _) = part.solve();
        part.keys.into_iter().zip(values).collect()
    }

    /// Together with others: a parameter of the same name is the same.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let mut keys = self.keys.clone();
        keys.extend(other.keys.iter().filter(|key| self.place(key).is_none()).cloned());
        keys.sort();
        let places = |of: &Self| keys.iter().map(|key| of.place(key)).collect::<Vec<_>>();
        let (a, b) = (places(self), places(other));
        let entry = |of: &Self, i: Option<usize>, j: Option<usize>| i.zip(j).map_or(0.0, |(i, j)| of.matrix[(i, j)]);
        let right = |of: &Self, i: Option<usize>| i.map_or(0.0, |i| of.right[i]);
        Self {
            matrix: Mat::from_fn(keys.len(), keys.len(), |i, j| entry(self, a[i], a[j]) + entry(other, b[i], b[j])),
            right: (0..keys.len()).map(|i| right(self, a[i]) + right(other, b[i])).collect(),
            keys,
        }
    }

    /// The sum of many.
    #[must_use]
    pub fn sum<'a>(all: impl IntoIterator<Item = &'a Self>) -> Self {
        all.into_iter().fold(Self::empty(), |sum, one| sum.and(one))
    }

    /// Values and covariance of all parameters, along the directions that are known.
    #[must_use]
    pub fn solve(&self) -> (Vec<f64>, Mat<f64>) {
        let n = self.keys.len();
        let (inverse, unknown) = inverse(&self.matrix);
        let values = (0..n).map(|i| (0..n).map(|j| inverse[(i, j)] * self.right[j]).sum()).collect();
        let mut covariance = inverse;
        for k in unknown {
            covariance[(k, k)] = f64::INFINITY;
        }
        (values, covariance)
    }

    /// One parameter, all others being free; `None` where the others say as much, or nothing is known of it.
    #[must_use]
    pub fn told(&self, key: &Key) -> Option<Told> {
        let place = self.place(key)?;
        let own = self.matrix[(place, place)];
        let rest = self.without(|other| other != key);
        let left = rest.matrix[(0, 0)];
        (left > OWN_SHARE * own && left.is_finite() && own > 0.0)
            .then(|| Told { value: rest.right[0] / left, variance: 1.0 / left })
    }
}

/// Along the directions that are known; of nothing, nothing.
fn inverse(matrix: &Mat<f64>) -> (Mat<f64>, Vec<usize>) {
    if matrix.nrows() == 0 { (Mat::zeros(0, 0), Vec::new()) } else { nls::invert_observable(matrix, RANK) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;
    use proptest::prelude::*;

    fn key(k: usize) -> Key {
        Key::new(Axis::X, ["bias", "delay", "lag", "scale-factor"][k], "v")
    }

    /// The equations of some rows of a design with n parameters.
    fn of_rows(rows: &[Vec<f64>], y: &[f64]) -> Equations {
        let n = rows[0].len();
        Equations {
            keys: (0..n).map(key).collect(),
            matrix: Mat::from_fn(n, n, |i, j| rows.iter().map(|row| row[i] * row[j]).sum()),
            right: (0..n).map(|i| rows.iter().zip(y).map(|(row, y)| row[i] * y).sum()).collect(),
        }
    }

    proptest! {
        #[test]
        fn two_halves_say_what_the_whole_says(
            rows in proptest::collection::vec(proptest::collection::vec(-1.0..1.0_f64, 4), 30),
            y in proptest::collection::vec(-1.0..1.0_f64, 30),
            at in 5_usize..25,
        ) {
            let whole = of_rows(&rows, &y);
            let halves = of_rows(&rows[..at], &y[..at]).and(&of_rows(&rows[at..], &y[at..]));
            // The sum has them in the order of their names.
            let at_of = |i: usize| halves.place(&key(i)).unwrap();
            for i in 0..4 {
                for j in 0..4 {
                    prop_assert!((whole.matrix[(i, j)] - halves.matrix[(at_of(i), at_of(j))]).abs() < 1e-9);
                }
            }
            let ((a, _), (b, _)) = (whole.solve(), halves.solve());
            for (i, a) in a.iter().enumerate() {
                let b = b[at_of(i)];
                prop_assert!((a - b).abs() < 1e-6 * (1.0 + a.abs()), "{a} {b}");
            }
        }

        #[test]
        fn taking_a_parameter_out_leaves_the_others_as_the_whole_has_them(
            rows in proptest::collection::vec(proptest::collection::vec(-1.0..1.0_f64, 4), 30),
            y in proptest::collection::vec(-1.0..1.0_f64, 30),
        ) {
            let whole = of_rows(&rows, &y);
            let (values, covariance) = whole.solve();
            let (reduced, less) = whole.without(|k| *k == key(1) || *k == key(3)).solve();
            for (place, whole) in [(0, 0), (1, 2)] {
                prop_assert!((reduced[place] - values[whole]).abs() < 1e-6);
                prop_assert!((less[(place, place)] - covariance[(whole, whole)]).abs() < 1e-6);
            }
            let told = whole.told(&key(2)).unwrap();
            prop_assert!((told.value - values[2]).abs() < 1e-6);
            prop_assert!((told.variance - covariance[(2, 2)]).abs() < 1e-6);
        }
    }

    #[test]
    fn a_column_that_the_others_span_is_not_told() {
        let rows: Vec<Vec<f64>> = (0..20).map(f64::from).map(|t| vec![1.0, t, 2.0 * t, t * t]).collect();
        let y: Vec<f64> = rows.iter().map(|row| row[1]).collect();
        let equations = of_rows(&rows, &y);
        assert!(equations.told(&key(2)).is_none() && equations.told(&key(3)).is_some());
    }
}
