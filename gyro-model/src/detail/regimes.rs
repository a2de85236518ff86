//! Where the model fails: mean error by bins of a regressor, and RMS by regime and frequency.

use super::{Channel, HeatMap, Input, Referenced, Regime, RegimeBin, channels::extent, mean, short, some};

/// Bins of a regime panel.
const BINS: usize = 16;
/// Rows of a heat map.
const ROWS: usize = 8;
/// Stretches of time that the standard errors are taken over.
const STRETCHES: f64 = 200.0;

/// Mean error by regime, the regressor that explains most first.
pub(super) fn regimes(input: &Input, referenced: &Referenced) -> Vec<Regime> {
    let tau = (4.0 * referenced.dt).max(0.1).min(referenced.duration() / 100.0).max(referenced.dt);
    let windows = referenced.windows(tau);
    let mut regimes: Vec<Regime> =
        input.channels.iter().filter_map(|channel| regime(channel, &windows, referenced)).collect();
    regimes.sort_by(|a, b| b.explains.total_cmp(&a.explains));
    regimes
}

/// One window: the regressor's mean, the rate error, the samples in it, the stretch of time it lies in.
struct Piece {
    value: f64,
    error: f64,
    samples: usize,
    stretch: usize,
}

fn regime(channel: &Channel, windows: &[(usize, usize)], referenced: &Referenced) -> Option<Regime> {
    let stretch = referenced.duration() / STRETCHES;
    let pieces: Vec<Piece> = windows
        .iter()
        .map(|&(from, to)| {
            let (a, b) = (referenced.row[from], referenced.row[to]);
            Piece {
                value: typical(channel, &channel.values[a..=b]),
                error: referenced.rate_error((from, to)),
                samples: to - from,
                stretch: ((referenced.t[from] - referenced.t[0]) / stretch) as usize,
            }
        })
        .filter(|p| p.value.is_finite() && p.error.is_finite())
        .collect();
    let edges = edges(channel, &pieces)?;
    let least = (pieces.len() / 300).max(4);
    let bins: Vec<RegimeBin> = edges
        .windows(2)
        .enumerate()
        .filter_map(|(i, edge)| {
            let last = i + 2 == edges.len();
            // The outer edges are rounded, and what lies at the ends belongs inside them.
            let is_inside = |p: &&Piece| (i == 0 || p.value >= edge[0]) && (last || p.value < edge[1]);
            let inside: Vec<&Piece> = pieces.iter().filter(is_inside).collect();
            (inside.len() >= least).then(|| bin(edge[0], edge[1], &inside))
        })
        .collect();
    if bins.len() < 2 {
        return None;
    }
    let samples: f64 = bins.iter().map(|b| b.samples as f64).sum();
    let power = bins.iter().map(|b| b.samples as f64 * (b.mean.powi(2) - b.std_error.powi(2))).sum::<f64>() / samples;
    Some(Regime {
        regressor: channel.regressor.clone(),
        unit: channel.unit.into(),
        explains: short(power.max(0.0).sqrt()),
        bins,
    })
}

/// The mean over a window; for a direction the middle value, for an angle within a turn too (its mean means nothing
/// across the wrap).
fn typical(channel: &Channel, values: &[f64]) -> f64 {
    let is_point = matches!((channel.regressor.as_str(), channel.unit), ("direction", "1") | ("angle", "rad"));
    if is_point { values[values.len() / 2] } else { mean(values) }
}

fn edges(channel: &Channel, pieces: &[Piece]) -> Option<Vec<f64>> {
    if (channel.regressor.as_str(), channel.unit) == ("direction", "1") {
        return Some(vec![-1.5, -0.5, 0.5, 1.5]);
    }
    let mut sorted: Vec<f64> = pieces.iter().map(|p| p.value).collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n < 40 {
        return None;
    }
    // A few far values must not squeeze everything else into one bin.
    let (low, high) = (sorted[n / 200], sorted[n - 1 - n / 200]);
    (high > low).then(|| {
        let mut edges: Vec<f64> = (0..=BINS).map(|i| low + (high - low) * i as f64 / BINS as f64).collect();
        edges[0] = sorted[0];
        edges[BINS] = sorted[n - 1];
        edges.iter().map(|&e| short(e)).collect()
    })
}

/// Mean with the standard error over stretches: Var = Σ_s (Σ_{i in s} (x_i − x̄))² / n², which stays honest where
/// neighbours are correlated, positively (slow errors) or negatively (encoder noise).
fn bin(from: f64, to: f64, inside: &[&Piece]) -> RegimeBin {
    let n = inside.len() as f64;
    let mean = inside.iter().map(|p| p.error).sum::<f64>() / n;
    let mut square = 0.0;
    let mut stretches = 0.0;
    let mut sum = 0.0;
    for (k, piece) in inside.iter().enumerate() {
        sum += piece.error - mean;
        if inside.get(k + 1).is_none_or(|next| next.stretch != piece.stretch) {
            square += sum * sum;
            stretches += 1.0;
            sum = 0.0;
        }
    }
    let correction: f64 = if stretches > 1.0 { stretches / (stretches - 1.0) } else { 1.0 };
    RegimeBin {
        from,
        to,
        samples: inside.iter().map(|p| p.samples).sum(),
        mean: short(mean),
        std_error: short((square * correction).sqrt() / n),
    }
}

/// RMS of the difference of two adjoining averages over τ (a band about 1/(2τ) wide an octave), by regime.
pub(super) fn heat_maps(input: &Input, referenced: &Referenced) -> Vec<HeatMap> {
    ["rate", "rate-change", "angle", "temperature", "time"]
        .iter()
        .filter_map(|name| input.channels.iter().find(|c| c.regressor == *name))
        .filter_map(|channel| heat_map(channel, input, referenced))
        .collect()
}

fn heat_map(channel: &Channel, input: &Input, referenced: &Referenced) -> Option<HeatMap> {
    let (low, high) = extent(&channel.values);
    if high <= low {
        return None;
    }
    let edges: Vec<f64> = (0..=ROWS).map(|i| low + (high - low) * i as f64 / ROWS as f64).collect();
    let mut map = HeatMap {
        regressor: channel.regressor.clone(),
        unit: channel.unit.into(),
        edges: edges.iter().map(|&e| short(e)).collect(),
        frequency: Vec::new(),
        rms: vec![Vec::new(); ROWS],
        floor: Vec::new(),
    };
    let mut tau = 2.0 * referenced.dt;
    while tau < referenced.duration() / 20.0 {
        let windows = referenced.windows(tau);
        let mut sums = [(0.0, 0.0); ROWS];
        for pair in windows.windows(2).filter(|p| p[0].1 == p[1].0) {
            let value = channel.values[referenced.row[pair[1].0]];
            let step = referenced.rate_error(pair[1]) - referenced.rate_error(pair[0]);
            if value.is_finite() && step.is_finite() {
                let row = ((value - low) / (high - low) * ROWS as f64) as usize;
                let (sum, n) = &mut sums[row.min(ROWS - 1)];
                *sum += step * step;
                *n += 1.0;
            }
        }
        for (row, (sum, n)) in map.rms.iter_mut().zip(sums) {
            row.push(if n >= 5.0 { some(f64::sqrt(sum / n)) } else { None });
        }
        // Two averages over τ: gyro noise N²/τ each; encoder noise σ²(1 + 4 + 1)/τ².
        let (walk, encoder) = (input.noise.angle_random_walk, input.noise.encoder);
        let floor = (2.0 * walk * walk / tau + 6.0 * (encoder / tau).powi(2)).sqrt();
        map.frequency.push(short(0.5 / tau));
        map.floor.push(if floor > 0.0 { some(floor) } else { None });
        tau *= 2.0;
    }
    (!map.frequency.is_empty()).then_some(map)
}
