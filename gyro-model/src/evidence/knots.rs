//! A reference that is known seldom, straight lines between: how far apart its knots are.

use crate::order::median;

/// How far apart the knots are between which these angles, of one reference at times `t`, turn evenly, s; `None` where every row is a
/// reading of its own. `dt` is the usual time from row to row.
#[must_use]
pub(super) fn apart(t: &[f64], dt: f64, angles: &[Vec<f64>]) -> Option<f64> {
    let bends = bends(t, angles);
    let mut sorted = bends.clone();
    sorted.sort_by(f64::total_cmp);
    let large = *sorted.get(sorted.len() * 49 / 50).filter(|large| **large > 0.0)?;
    // A knot between two rows bends two steps.
    let is_knot = |k: usize| bends[k] > BEND * large && (k == 0 || bends[k - 1] <= BEND * large);
    let at: Vec<usize> = (0..bends.len()).filter(|&k| is_knot(k)).collect();
    let pairs: Vec<(usize, usize)> =
        at.windows(2).map(|pair| (pair[0], pair[1])).filter(|(a, b)| (3..64).contains(&(b - a))).collect();
    if pairs.len() < KNOTS {
        return None;
    }
    let usual = median(pairs.iter().map(|(a, b)| (b - a) as f64).collect())?;
    let alike = pairs.iter().filter(|(a, b)| ((b - a) as f64 - usual).abs() <= 1.0).count();
    let straight = |&(a, b): &(usize, usize)| {
        let between = median(bends[a + 2..b].to_vec()).unwrap_or(0.0);
        between < STRAIGHT * (bends[a] + bends[a + 1]).max(bends[b])
    };
    let even = pairs.iter().filter(|pair| straight(pair)).count();
    (2 * alike > pairs.len() && 4 * even > 3 * pairs.len()).then_some(usual * dt)
}

/// By how much the rate changes from one step to the next, about all axes together, rad/s.
fn bends(t: &[f64], angles: &[Vec<f64>]) -> Vec<f64> {
    let mut squares = vec![0.0; t.len().saturating_sub(2)];
    for angle in angles {
        for (k, square) in squares.iter_mut().enumerate() {
            let rate = |k: usize| (angle[k + 1] - angle[k]) / (t[k + 1] - t[k]).max(1e-9);
            *square += (rate(k + 1) - rate(k)).powi(2);
        }
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// Knots that show how far they are apart.
const KNOTS: usize = 40;
/// Share of the largest bends from which one is a knot, and of a knot's below which there is none.
const BEND: f64 = 0.1;
const STRAIGHT: f64 = 0.05;
