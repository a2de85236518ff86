//! How likely noise alone makes what a suspect shows: the likelihood-ratio test, corrected for the whole search.
//!
//! Twice the gain in ln L of m parameters that are nothing is χ² distributed with m degrees of freedom (Wilks 1938). Of k
//! hypotheses, one gains as much with a chance of at most k times that (Bonferroni): every effect of the catalogue, on every axis,
//! at every shape that its grid tells apart. Neighbouring shapes of a grid are correlated, and √n of n are counted; whole numbers
//! and lines of a spectrum are not, and all are.

use crate::{
    Term,
    effects::{Memory, Role, Trait},
    evidence::{series::Series, study::Study},
    scan::{Candidate, tone},
};
use itertools::Itertools;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Chance that noise alone raises ln L as much, for any effect at any shape of the search.
pub(super) fn chance(rise: f64, candidate: &Candidate, study: &Study) -> f64 {
    let effect = candidate.term.effect;
    let series = &study.bench.problem.series[candidate.series];
    let is_chosen = !effect.parameters(series.axis).iter().any(|card| card.role == Role::Shape);
    let grid = effect.grid(&series.span()).len().max(1) as f64;
    let (shapes, freedom) = if !effect.is(Trait::Line) {
        // Neighbouring shapes of a grid are not independent, one harmonic and the next are.
        (if is_chosen { grid } else { grid.sqrt() }, candidate.freedom)
    } else if study.is_whole() && tone::is_read(study, candidate.series, &candidate.term) {
        // Where the reading has the line, it gives amplitude and phase too: only whether the shaft shares it is open. (One
        // that is cut off has lines that nobody turned.)
        (tone::LINES as f64, 1)
    } else {
        // Every line of a spectrum is its own.
        (tone::frequencies(study.bench.problem.times()), candidate.freedom)
    };
    let effects = (crate::effects::CATALOGUE.len() * study.bench.problem.series.len()) as f64;
    let Ok(law) = ChiSquared::new(freedom as f64) else { return 1.0 };
    (law.sf((2.0 * rise).max(0.0)) * effects * shapes).min(1.0)
}

/// How often the error of a slow effect swings; without end for one that is not slow.
pub(super) fn swings_of_slow(term: &Term, series: &Series) -> f64 {
    if !term.effect.is(Trait::Slow) {
        return f64::INFINITY;
    }
    let mut memory = Memory::default();
    let error = |k| term.effect.error(&term.values, &series.signals(k), &mut memory);
    let error: Vec<f64> = (0..series.t.len()).map(error).collect();
    swings(&error) as f64
}

/// How often a signal goes from half a standard deviation on one side of its mean to as much on the other.
fn swings(signal: &[f64]) -> usize {
    let n = signal.len() as f64;
    let mean = signal.iter().sum::<f64>() / n;
    let half = 0.5 * (signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    let sides = signal.iter().map(|x| x - mean).filter(|x| x.abs() > half).map(f64::is_sign_positive);
    sides.tuple_windows().filter(|(a, b)| a != b).count()
}

#[cfg(test)]
mod tests {
    use super::swings;

    #[test]
    fn a_drift_swings_once_and_three_periods_five_times() {
        let line: Vec<f64> = (0..600).map(|k| f64::from(k) + 5.0 * f64::from(k % 7)).collect();
        assert_eq!(swings(&line), 1);
        let sine: Vec<f64> = (0..600).map(|k| (f64::from(k) * 0.01 * std::f64::consts::PI).sin()).collect();
        assert_eq!(swings(&sine), 5);
    }
}
