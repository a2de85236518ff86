//! How well the instant is known at which an effect begins.
//!
//! The likelihood of an instant is not a parabola. Where an angle itself steps, each row that the instant passes counts alike, and the
//! likeliest instant is the highest point of a random walk; where the axis rests meanwhile, one instant is as good as another, and a later
//! one may be nearly as good again. So the error is the second moment of the likelihood about the likeliest instant t₀, the other
//! parameters standing, with W what whitens the residual r:
//!
//! ```text
//! σ² = ∫ s² L(s) ds / ∫ L(s) ds,     ln L(s) = −½ (|W r(t₀ + s)|² − |W r(t₀)|²)
//! ```
//!
//! Between two rows every instant is as good: where it is and where it is said to be are two of them, so σ² is at least Δt²/6.
//! Ibragimov and Has'minskii, Statistical Estimation (1981), ch. 7.

use super::{
    problem::{Slot, value},
    study::Study,
    whiten::Whitener,
};
use crate::nls;
use itertools::Itertools;

/// From one offset that is looked at to the next one farther out.
const APART: f64 = 1.5;

/// Standard error of an instant, s; `None` where the slot is none.
pub(super) fn std_error(study: &Study, whitener: &Whitener, slot: Slot) -> Option<f64> {
    let problem = &study.bench.problem;
    let series = &problem.series[slot.series];
    let term = problem.axis(&study.model, series).terms.get(slot.term)?;
    if !term.effect.instants(series.axis).contains(&slot.parameter) {
        return None;
    }
    let (span, at) = (series.span(), *value(problem, &mut study.model.clone(), slot)?);
    let here = whitener.apply_each(&study.as_read());
    let log_likelihood = |s: f64| -> f64 {
        let mut moved = term.clone();
        moved.values[slot.parameter] = at + s;
        let change = problem.difference(&study.model, &study.warm, &study.evaluation, (slot.series, slot.term), &moved);
        let pairs = here.iter().zip(whitener.apply_each(&change));
        -pairs.map(|(r, d)| nls::dot(r, &d) + 0.5 * nls::dot(&d, &d)).sum::<f64>()
    };
    let room = (span.start - at, span.start + span.duration - at);
    let spread = spread(&offsets(span.dt, room), log_likelihood);
    Some(spread.max(span.dt / 6_f64.sqrt()))
}

/// Offsets to either side, as far as there is room, in order.
fn offsets(dt: f64, (least, most): (f64, f64)) -> Vec<f64> {
    let side = |room: f64| std::iter::successors(Some(dt), |s| Some(APART * s)).take_while(move |s| *s < room);
    let mut all: Vec<f64> = side(-least).map(|s| -s).collect();
    all.reverse();
    all.push(0.0);
    all.extend(side(most));
    all
}

/// √(∫ s² L ds / ∫ L ds) by the trapezoidal rule.
fn spread(offsets: &[f64], log_likelihood: impl Fn(f64) -> f64) -> f64 {
    let logs: Vec<f64> = offsets.iter().map(|&s| if s == 0.0 { 0.0 } else { log_likelihood(s) }).collect();
    let top = logs.iter().copied().fold(0.0, f64::max);
    let (mut square, mut all) = (0.0, 0.0);
    for ((a, b), (of_a, of_b)) in offsets.iter().tuple_windows().zip(logs.iter().tuple_windows()) {
        let (of_a, of_b) = ((of_a - top).exp(), (of_b - top).exp());
        square += 0.5 * (b - a) * (a * a * of_a + b * b * of_b);
        all += 0.5 * (b - a) * (of_a + of_b);
    }
    if all > 0.0 { (square / all).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::{offsets, spread};

    #[test]
    fn a_parabola_is_known_to_where_it_is_one_and_a_corner_to_where_it_has_gone_down() {
        let all = offsets(0.01, (-30.0, 40.0));
        assert!(all.is_sorted() && all.contains(&0.0) && all[0] > -30.0 && all[all.len() - 1] < 40.0);
        let parabola = spread(&all, |s| -0.5 * (s / 0.5).powi(2));
        assert!((parabola / 0.5 - 1.0).abs() < 0.05, "{parabola}");
        // ∫ s² e^(−|s|/a) ds = 2 a² ∫ e^(−|s|/a) ds.
        let corner = spread(&all, |s| -s.abs() / 0.5);
        assert!((corner / (0.5 * 2_f64.sqrt()) - 1.0).abs() < 0.1, "{corner}");
        // Another instant is as likely.
        let two = spread(&all, |s| if (1.0..4.0).contains(&s) { 0.0 } else { -1e3 * s.abs() });
        assert!(two > 1.0, "{two}");
        assert_eq!(spread(&offsets(0.01, (0.0, 0.0)), |_| 0.0), 0.0);
    }
}
