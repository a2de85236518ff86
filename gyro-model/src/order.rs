//! Values by their order.

/// The value below which a share `q` of them lies; `None` where there is none.
pub(crate) fn quantile(mut values: Vec<f64>, q: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let place = ((values.len() - 1) as f64 * q).round() as usize;
    Some(*values.select_nth_unstable_by(place, f64::total_cmp).1)
}

/// The value in the middle, of an even number the larger of two.
pub(crate) fn median(values: Vec<f64>) -> Option<f64> {
    quantile(values, 0.5)
}
