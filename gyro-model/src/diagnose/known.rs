//! Whether a log shows every parameter of an effect.
//!
//! A coefficient within its standard error of nothing may be nothing, and an instant, a frequency or a time constant that is not known
//! to its own size describes no effect that this log can show: some of its values make another effect, a simpler one.

use super::challenger::Challenger;
use crate::{
    Term,
    effects::Role,
    evidence::{noise::Gls, series::Series, study::Study},
    nls,
    scan::Candidate,
    thresholds as limit,
};
use faer::Mat;
use itertools::Itertools;

/// What is known of the parameters of one term.
struct Known<'a> {
    term: &'a Term,
    series: &'a Series,
    /// The fitted parameters, and where each stands in the covariance.
    fitted: Vec<(usize, usize)>,
    gls: &'a Gls,
}

/// The largest standard error of an effect's parameters, each over the size that it has to stay below; infinite where a parameter lies
/// outside of what the log can show. 0 where the model has no such effect.
pub(super) fn doubt(study: &Study, gls: &Gls, series: usize, id: &str) -> f64 {
    let of = &study.bench.problem.series[series];
    let terms = study.model.axes[of.axis.index()].as_ref().map_or(&[][..], |model| &model.terms);
    let Some(place) = terms.iter().position(|term| term.effect.card().id == id) else { return 0.0 };
    let is_own = |slot: &crate::evidence::problem::Slot| slot.series == series && slot.term == place;
    let own = study.slots.iter().enumerate().filter(|(_, slot)| is_own(slot));
    let fitted = own.map(|(row, slot)| (slot.parameter, row)).collect();
    Known { term: &terms[place], series: of, fitted, gls }.doubt()
}

impl Challenger<'_> {
    /// The same of a suspect.
    pub(super) fn doubt(&self) -> f64 {
        let Candidate { series, ref term, .. } = self.candidate;
        doubt(&self.study, &self.gls, series, term.effect.card().id)
    }
}

impl Known<'_> {
    fn doubt(&self) -> f64 {
        let cards = self.term.effect.parameters(self.series.axis);
        let shapes = (0..cards.len()).filter(|&k| cards[k].role == Role::Shape).map(|k| self.of_shape(k));
        shapes.chain(self.of_coefficients()).fold(0.0, f64::max)
    }

    /// As it is stamped into the model, where it is: it knows how the parameter scatters from block to block. The error of an
    /// instant is that of the likelihood's curvature: within a long rest every instant fits, and the effect is there all the same.
    fn std_error(&self, parameter: usize) -> f64 {
        let is_instant = self.term.effect.instants(self.series.axis).contains(&parameter);
        let stamped = self.term.std_errors.get(parameter).filter(|error| !error.is_nan() && !is_instant);
        if let Some(stamped) = stamped {
            return *stamped;
        }
        let row = self.fitted.iter().find(|(own, _)| *own == parameter);
        row.map_or(f64::INFINITY, |(_, row)| self.gls.std_error(*row))
    }

    /// A frequency has to lie in the band of the log, an instant in the log, a rate within those that it shows.
    fn of_shape(&self, parameter: usize) -> f64 {
        let cards = self.term.effect.parameters(self.series.axis);
        let (card, value, span) = (&cards[parameter], self.term.values[parameter], self.series.span());
        let is_instant = self.term.effect.instants(self.series.axis).contains(&parameter);
        let size = if is_instant {
            let is_inside = (span.start..span.start + span.duration).contains(&value);
            if is_inside { limit::INSTANT.value * span.duration } else { 0.0 }
        } else if card.unit == "Hz" {
            if value <= 0.5 / span.dt { value } else { 0.0 }
        } else if card.unit == "rad/s" {
            if value.abs() <= span.reading_max { value.abs() } else { 0.0 }
        } else if card.neutral == 0.0 || card.unit != "1" {
            value.abs()
        } else {
            card.bounds.1 - card.bounds.0
        };
        ratio(self.std_error(parameter), size)
    }

    /// All coefficients together, since one of several may well be nothing: over √(vᵀ C⁻¹ v − (n − 1)), their size in standard errors.
    fn of_coefficients(&self) -> Option<f64> {
        let cards = self.term.effect.parameters(self.series.axis);
        let is_seen = |(k, row): &&(usize, usize)| {
            let errors = [self.gls.std_error(*row), self.std_error(*k)];
            cards[*k].role == Role::Linear && errors.iter().all(|error| error.is_finite() && *error > 0.0)
        };
        if !cards.iter().any(|card| card.role == Role::Linear) {
            return None;
        }
        let rows: Vec<(usize, usize)> = self.fitted.iter().filter(is_seen).copied().collect();
        let error = |i: usize| self.gls.std_error(rows[i].1);
        let correlation = Mat::from_fn(rows.len(), rows.len(), |i, j| {
            self.gls.covariance[(rows[i].1, rows[j].1)] / (error(i) * error(j))
        });
        let (inverse, _) = nls::invert_observable(&correlation, 1e-9);
        let z = |i: usize| (self.term.values[rows[i].0] - cards[rows[i].0].neutral) / self.std_error(rows[i].0);
        let n = rows.len();
        let form: f64 = (0..n).map(|i| (0..n).map(|j| z(i) * inverse[(i, j)] * z(j)).sum::<f64>()).sum();
        Some(ratio(1.0, (form - (n as f64 - 1.0)).max(0.0).sqrt()))
    }
}

/// A standard error over a size; infinite where either is unknown or the size is nothing.
fn ratio(std_error: f64, size: f64) -> f64 {
    let ratio = std_error / size;
    if ratio.is_finite() { ratio } else { f64::INFINITY }
}
