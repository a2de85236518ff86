//! The floor: what the error curve would be with no physics missing.
//!
//! Noise alone, of the size known beforehand ([`super::prior`]), is put through the very computation that makes the
//! error curve ([`super::draws`]). The mean square over the draws is F(τ)², the cost of estimating the parameters
//! included; their spread gives the band.

use super::{draws::Draws, increments::Grams, study::Study};
use crate::parallel;

/// F(τ) and the upper end of its band.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Floor {
    /// F(τ), rad/s.
    pub floor: Vec<f64>,
    /// What 99 % of such logs lie below, over all τ together, rad/s.
    pub upper: Vec<f64>,
}

const DRAWS: u64 = 40;
/// Draws that share one accumulation of the columns; the memory is theirs.
const TOGETHER: u64 = 8;
/// Standard deviations that the largest of some dozen correlated points stays within, in 99 of 100 logs.
const BAND: f64 = 3.1;
/// How well the prior noise is known: a share of F.
const PRIOR_UNCERTAINTY: f64 = 0.04;

/// The floor of one axis of a study; `component` picks its body axis where a quaternion serves three.
#[must_use]
pub(crate) fn floor(study: &Study, series: usize, component: Option<usize>) -> Floor {
    let bench = study.bench;
    let windows = &bench.windows;
    let noise_alone = Draws::where_seen(study, series).unwrap_or_else(|| Draws::anywhere(study, series));
    let columns: Vec<&[Vec<f64>]> = study.columns.iter().map(Vec::as_slice).collect();
    let grams = |noise: &[&[Vec<f64>]], component| windows.grams(&bench.problem, noise, &columns, component);
    let some = |&first: &u64| -> Vec<Vec<f64>> {
        let draws: Vec<_> = (first..DRAWS.min(first + TOGETHER)).map(|seed| noise_alone.plain(seed)).collect();
        let noise: Vec<&[Vec<f64>]> = draws.iter().map(Vec::as_slice).collect();
        let all = grams(&noise, None);
        let judged = component.map(|_| grams(&noise, component));
        let curve = |(all, judged): (&Grams, &Grams)| {
            all.held_out_on(judged, &windows.tau, &bench.weights, &study.hold).curve()
        };
        all.iter().zip(judged.as_ref().unwrap_or(&all)).map(curve).collect()
    };
    let curves = parallel::map(&(0..DRAWS).step_by(TOGETHER as usize).collect::<Vec<_>>(), some).concat();
    let n = DRAWS as f64;
    let (mut floor, mut upper) = (Vec::new(), Vec::new());
    for k in 0..windows.tau.len() {
        let mean_square = curves.iter().map(|c| c[k] * c[k]).sum::<f64>() / n;
        let logs: Vec<f64> = curves.iter().map(|c| c[k].max(1e-300).ln()).collect();
        let mean = logs.iter().sum::<f64>() / n;
        let spread = (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let f = mean_square.sqrt();
        floor.push(f);
        upper.push(f * (BAND * spread.hypot(PRIOR_UNCERTAINTY)).exp());
    }
    Floor { floor, upper }
}
