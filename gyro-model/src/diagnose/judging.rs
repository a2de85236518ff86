//! A refitted suspect as the tests see it: its numbers beside the model as it stands.

use super::{
    admission::{ADMISSION, ELIMINATION, MENTION},
    bounds::size,
    case::{Case, REMOVED},
    challenger::{Challenger, Incumbent},
    chance::{chance, swings_of_slow},
    decision::{outcomes, passes},
};
use crate::{
    Term,
    diagnosis::TestOutcome,
    effects::{Stage, Trait},
    evidence::{
        noise::{self, Gls},
        study::Study,
    },
    scan::{Candidate, tone},
    statistics::Estimate,
    thresholds as limit,
};

impl Incumbent<'_> {
    /// Whether a model without `term`, of this series, needs it: `with` is this model and the term, fitted.
    #[must_use]
    pub(crate) fn needs(&self, with: &Incumbent, series: usize, term: &Term) -> bool {
        let gls = |incumbent: &Incumbent| incumbent.beside(term.effect, series).gls.log_likelihood;
        let gain = gls(with) - gls(self);
        let candidate = Candidate { series, term: term.clone(), score: gain, removes: 0.0, freedom: term.values.len() };
        let unknown = Estimate { value: f64::NAN, std_error: f64::NAN };
        let case = Case {
            is_read_off: false,
            is_line: term.effect.is(Trait::Line),
            is_mean: false,
            is_slow: term.effect.is(Trait::Slow),
            swings: f64::NAN,
            before: self.excess(series),
            after: with.excess(series),
            grows: f64::NAN,
            silences: f64::NAN,
            p_value: chance(gain, &candidate, &with.study),
            gain,
            held_out: unknown,
            fall: unknown,
            is_beyond_wander: self.gls.noise.beyond_wander(),
            leaves_noise: is_noise(&with.study, &with.gls),
            size: f64::NAN,
            doubt: f64::NAN,
            is_in_reading: false,
            may_be_aliased: false,
            is_in_reference: false,
            is_at_bound: false,
            is_shape_at_bound: false,
        };
        passes(ELIMINATION, &case)
    }
}

impl Challenger<'_> {
    /// J of its axis without it.
    #[must_use]
    pub(crate) fn before(&self, incumbent: &Incumbent) -> f64 {
        incumbent.excess(self.candidate.series)
    }

    /// Share of J − 1 that it removes; `None` where there is none.
    #[must_use]
    pub(crate) fn share(&self, incumbent: &Incumbent) -> Option<f64> {
        let before = self.before(incumbent);
        (before > 1.0).then(|| (before - self.excess) / (before - 1.0))
    }

    /// Its numbers beside the model `incumbent`.
    pub(super) fn case(&self, incumbent: &Incumbent) -> Case {
        let [judged, left] = [&incumbent.study, &self.study].map(|study| 1.0 - study.share_left_out());
        Case {
            before: self.before(incumbent),
            silences: 1.0 - left / judged,
            is_beyond_wander: incumbent.gls.noise.beyond_wander(),
            ..self.alone()
        }
    }

    /// Those numbers that the model which it joins has no part in.
    fn alone(&self) -> Case {
        let Candidate { series, ref term, .. } = self.candidate;
        let (is_at_bound, is_shape_at_bound) = self.bounds_reached();
        let is_line = term.effect.is(Trait::Line);
        Case {
            is_read_off: term.effect.stage() == Stage::Reading,
            is_line,
            is_mean: self.is_mean,
            is_slow: term.effect.is(Trait::Slow),
            swings: swings_of_slow(term, &self.study.bench.problem.series[series]),
            before: f64::NAN,
            after: self.excess,
            grows: self.grows,
            silences: f64::NAN,
            p_value: self.p_value,
            gain: self.rise,
            held_out: self.held_out,
            fall: self.fall,
            is_beyond_wander: false,
            leaves_noise: is_noise(&self.study, &self.gls),
            size: size(term, self.study.bench.problem.series[series].axis),
            doubt: self.doubt(),
            is_in_reading: is_line && tone::is_read(&self.study, series, term),
            may_be_aliased: is_line && tone::may_be_aliased(&self.study, series, term),
            is_in_reference: is_line && tone::is_in_reference(&self.study, series, term),
            is_at_bound,
            is_shape_at_bound,
        }
    }

    /// Whether it is let in.
    #[must_use]
    pub(crate) fn passes(&self, incumbent: &Incumbent) -> bool {
        passes(ADMISSION, &self.case(incumbent))
    }

    /// Whether most of an error is its own, whatever else is not known.
    pub(super) fn dominates(&self, incumbent: &Incumbent) -> bool {
        (REMOVED.of)(&self.case(incumbent)) > limit::DOMINATES.value
    }

    /// Each test of its admission, with its numbers.
    pub(super) fn explained(&self, incumbent: &Incumbent) -> Vec<TestOutcome> {
        outcomes(ADMISSION, &self.case(incumbent))
    }

    /// Whether it is worth a mention: significant, holding on data that were not fitted, and within its bounds.
    #[must_use]
    pub(crate) fn significant(&self) -> bool {
        passes(MENTION, &self.alone())
    }

    /// Whether noise alone would hardly do as well.
    #[must_use]
    pub(crate) fn is_no_chance(&self) -> bool {
        self.p_value < limit::SIGNIFICANCE.value
    }
}

/// Whether what a model leaves is noise that sensors have.
fn is_noise(study: &Study, gls: &Gls) -> bool {
    noise::sober(study, &gls.noise).is_none()
}
