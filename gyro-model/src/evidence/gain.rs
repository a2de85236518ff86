//! How many times as far a reference turns as the readings say.

use crate::nls::dot;

/// |α|, about: the angle that the reference turns over the one that the readings do, both less their mean rates; 1 where
/// they do not go together.
pub(crate) fn gain(t: &[f64], read: &[f64], reference: &[f64]) -> f64 {
    let (x, y) = (untrended(t, read), untrended(t, reference));
    let [xx, xy, yy] = [(&x, &x), (&x, &y), (&y, &y)].map(|(a, b)| dot(a, b));
    let found = xy.abs() / xx;
    if xy * xy > TOGETHER * xx * yy && found.is_finite() { found } else { 1.0 }
}

/// Least squared correlation of two angles that are one.
const TOGETHER: f64 = 0.9;

/// The values less the straight line through them.
pub(crate) fn untrended(t: &[f64], values: &[f64]) -> Vec<f64> {
    let n = t.len() as f64;
    let (at, level) = (t.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
    let along = |of: &dyn Fn(usize) -> f64| -> f64 { (0..t.len()).map(|k| (t[k] - at) * of(k)).sum() };
    let slope = along(&|k| values[k] - level) / along(&|k| t[k] - at);
    t.iter().zip(values).map(|(t, value)| value - level - slope * (t - at)).collect()
}
